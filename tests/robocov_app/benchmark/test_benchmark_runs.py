"""The benchmark end to end: runs, result, verification and page; forged results are detected."""

from __future__ import annotations

import copy
import gzip
import html
import json
import os
import re
import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from command_calls import COMMAND, read_error, read_json
from driven_browser import CHROMIUM, DRIVER, Browser
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from small_studies import HEAD, PULL, DirectExecutor

from robocov.controllers import Adaptive, get_gain_values, load_controller_class
from robocov.errors import InputError
from robocov_app.benchmark import pareto_plots, ratings, suite
from robocov_app.benchmark.anomalies import find_anomalies
from robocov_app.benchmark.label_placement import place_labels
from robocov_app.benchmark.learned import Learned
from robocov_app.benchmark.oracle import Oracle
from robocov_app.benchmark.page import MAX_INCOMPLETE_TABLES, build_page
from robocov_app.benchmark.pareto_plots import (
    ParetoPoint,
    draw_pareto_figure,
    find_pareto_front,
    thin_out_equal_values,
)
from robocov_app.benchmark.rated_controller import RatedController, Selection
from robocov_app.benchmark.results import (
    ENTRIES,
    RESULT_FILE,
    compute_gaps,
    load_bundled_results,
    read_result,
)
from robocov_app.benchmark.running import TRACKS_FOLDER, run_benchmark
from robocov_app.benchmark.verification import Verification, VerificationOptions, verify_result
from robocov_app.cli import main
from robocov_app.commands.benchmark import _EXPLANATIONS, _print_ratings
from robocov_app.look.curve_styles import choose_curve_styles
from robocov_app.terminal.interruption import Interruption

MAPS = ("blocks-a", "blocks-b")
BENCHMARK_LABELS = {"oracle": Oracle.label, "learned": Learned.label}
"""Labels of the controllers that only the benchmark has."""


@pytest.fixture
def short_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Limit two tracks to two maps and runs of one second, and run them in this process."""
    for name in ("ideal", "lossy"):
        track = replace(suite.TRACKS[name], duration=1.0, seeds=(0,), maps=MAPS)
        monkeypatch.setitem(suite.TRACKS, name, track)  # type: ignore[arg-type]
    monkeypatch.setattr("robocov_app.sweep.sweeping.LocalPool", DirectExecutor)


def run_short_benchmark(out: Path, controller: str = "rapf", *tracks: str, **gains: float) -> dict[str, Any]:
    selection = Selection(tracks=tracks or ("ideal",), maps=MAPS)
    with Interruption() as stop:
        result = run_benchmark(RatedController(controller, gains), selection, out, stop=stop, quiet=True)
    assert result is not None
    return result


def verify(out: Path, sample: int, controller: str | None = None) -> tuple[int, list[str]]:
    """Repeat some runs; return their number and the differences."""
    options = VerificationOptions(sample=sample, robots=0, new_maps=0)
    with Interruption() as stop:
        verification = verify_result(out, controller=controller, options=options, stop=stop, quiet=True)
    return verification.runs, verification.differences


def load_results_of(*controllers: str) -> list[dict[str, Any]]:
    """Return the bundled results of some controllers."""
    return [result for result in load_bundled_results() if result["entry"]["controller"] in controllers]


@pytest.fixture
def without_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the plots of the page, which take most of the time to build it."""
    monkeypatch.setattr("robocov_app.benchmark.page.build_plots", lambda *args: [])


def change_result(out: Path, change: Any) -> None:
    result = json.loads((out / RESULT_FILE).read_text())
    change(result)
    (out / RESULT_FILE).write_text(json.dumps(result))


@pytest.mark.usefixtures("short_runs")
def test_runs_are_rated_verified_and_shown_on_a_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run_short_benchmark(tmp_path / "a", "rapf", "ideal", "lossy")
    run_short_benchmark(tmp_path / "b", "rapf", "ideal", k_rep=0.5)
    result = read_result(tmp_path / "a")
    assert [(row["track"], row["map"]) for row in result["rows"]] == [
        (track, name) for track in ("ideal", "lossy") for name in MAPS
    ]
    for row in result["rows"]:
        best = suite.load_frozen_maps()[row["map"]]["references"]["6"]["mean_distance_m"]
        assert row["gap"] == row["mean_distance_m"] / best - 1.0 > 0.0
        assert row["sent_bytes"] == pytest.approx(6 * 20 * (60 if row["track"] == "ideal" else 2))
        assert row["deciding_s"] > 0.0
    assert verify(tmp_path / "a", sample=1) == (1, [])
    page = str(tmp_path / "page.html")
    folders = [str(tmp_path / name) for name in "ab"]
    assert read_json(capsys, "benchmark", "page", *folders, "--alone", "--out", page)["entries"] == 2
    text = Path(page).read_text()
    assert "RAPF (k_rep 0.5)" in text and "Gap and path length" in text and "<h2" in text


def test_bundled_results_are_complete() -> None:
    """Each result has all runs of the core tracks, with gaps that agree with the costs."""
    results = load_bundled_results()
    assert {"rapf", "lloyd", "rpf", "oracle"} <= {result["entry"]["controller"] for result in results}
    runs = set()
    for track, maps, seeds in Selection().list_runs():
        runs |= {(track, map_name, seed) for map_name, seed in product(maps, seeds)}
    for result in results:
        # `verify` needs no file for controllers that are part of robocov.
        assert result["entry"]["source_sha256"] is None
        controller = result["entry"]["controller"]
        if controller in BENCHMARK_LABELS:
            assert result["entry"]["label"] == BENCHMARK_LABELS[controller]
        else:
            assert result["entry"]["label"] == load_controller_class(controller).label
        rows = {(row["track"], row["map"], row["seed"]) for row in result["rows"]}
        assert {row for row in rows if row[0] in suite.RANKED_TRACKS["core"]} == runs
        # On each other track, an entry has either all runs or none.
        for track in {row[0] for row in rows - runs}:
            assert {row[1] for row in rows if row[0] == track} == set(suite.TRACKS[track].maps)
        for row in result["rows"]:
            assert "error" in row or row.items() >= compute_gaps(row["track"], row["map"], row).items()


def test_former_names_in_results_are_updated(tmp_path: Path) -> None:
    content = gzip.decompress((ENTRIES / "adaptive.json.gz").read_bytes()).decode()
    path = tmp_path / "result.json"
    path.write_text(content.replace('"min_density"', '"least"').replace("sent_bytes", "told_bytes"))
    result = read_result(path)
    assert any(sentence.startswith("sent_bytes: ") for sentence in result["method"])
    assert result["entry"]["gains"] == get_gain_values(Adaptive())
    for row in result["rows"]:
        assert "error" in row or (row["sent_bytes"] > 0.0 and "told_bytes" not in row)


@pytest.mark.slow
def test_bundled_results_are_reproducible() -> None:
    path = ENTRIES / "rapf.json.gz"
    options = VerificationOptions(sample=1, robots=1, new_maps=1, seed=3, workers=2)
    with Interruption() as stop:
        verification = verify_result(path, options=options, quiet=True, stop=stop)
    assert verification.runs == 1
    assert verification.robots == 2
    assert verification.comparison is not None
    # Libraries of linear algebra may round the last bit differently on other processors.
    for difference in verification.differences:
        numbers = re.search(r": expected ([\d.e-]+), got ([\d.e-]+)$", difference)
        are_close = numbers and float(numbers[1]) == pytest.approx(float(numbers[2]), rel=1e-3)
        assert difference.startswith("made with") or are_close, difference


LABELED_POINTS = st.tuples(st.floats(100, 500), st.floats(80, 280), st.text("abcde", min_size=3, max_size=16))


@given(st.lists(LABELED_POINTS, min_size=2, max_size=4))
def test_labels_of_a_few_points_do_not_overlap(given_points: list[tuple[float, float, str]]) -> None:
    points = [ParetoPoint(choose_curve_styles(["rapf"])[0], name, x, y, True) for x, y, name in given_points]
    labels = [point.label for point in points]
    centers = place_labels(np.array([(x, y) for x, y, _ in given_points]), labels, (0.0, 0.0, 600.0, 360.0))
    half_sizes = np.array([(3.0 * len(label), 6.5) for label in labels])
    for k, j in combinations(range(len(points)), 2):
        gaps = np.abs(centers[k] - centers[j]) - half_sizes[k] - half_sizes[j]
        assert gaps.max() > -1e-6


def test_labels_are_next_to_the_marks_of_a_figure() -> None:
    style = choose_curve_styles(["rapf"])[0]
    points = [
        ParetoPoint(style, "Near", x=1200.0, gap=30.0, is_rival=True),
        ParetoPoint(style, "Far", x=3800.0, gap=0.5, is_rival=True),
    ]
    figure = draw_pareto_figure(points, "bytes")
    (axes,) = figure.axes
    FigureCanvasAgg(figure).draw()
    for point, text in zip(points, axes.texts, strict=True):
        assert text.get_text() == point.label
        mark = axes.transData.transform((point.x, point.gap))
        box = text.get_window_extent()
        distance = np.linalg.norm(np.clip(mark, box.min, box.max) - mark)
        assert distance < 20.0
        assert axes.bbox.contains(*box.min) and axes.bbox.contains(*box.max)


@pytest.mark.usefixtures("short_runs")
@pytest.mark.parametrize(("controller", "information"), [("oracle", "whole map"), ("learned", "own")])
def test_controllers_of_the_benchmark_can_be_rated_and_verified(
    tmp_path: Path, controller: str, information: str
) -> None:
    run_short_benchmark(tmp_path / "out", controller)
    assert verify(tmp_path / "out", sample=1) == (1, [])
    entry = read_result(tmp_path / "out")["entry"]
    assert entry["information"] == information
    assert entry["label"] == BENCHMARK_LABELS[controller]


@pytest.mark.slow
def test_robots_of_the_oracle_reach_their_goals_through_corridors(tmp_path: Path) -> None:
    selection = Selection(tracks=("ideal",), maps=("mazes-7006",))
    with Interruption() as stop:
        result = run_benchmark(RatedController("oracle", {}), selection, tmp_path, stop=stop, quiet=True)
    assert result is not None and max(row["gap"] for row in result["rows"]) < 1e-3


@pytest.mark.usefixtures("short_runs")
def test_forged_results_are_detected(tmp_path: Path) -> None:
    out = tmp_path / "out"
    run_short_benchmark(out)
    honest = (out / RESULT_FILE).read_text()
    for change, message in (
        (lambda result: result["rows"][1].update(work_J=1.0), "blocks-b, seed 0: work_J: expected"),
        (lambda result: result["rows"][0].update(gap=0.01), "blocks-a, seed 0: gap: expected"),
        (lambda result: result["rows"].pop(), "blocks-b, seed 0: missing row"),
        (
            lambda result: result["selection"].update(maps=["blocks-a"]),
            "blocks-b, seed 0: a row of a run that was not selected",
        ),
        (lambda result: result["versions"].update(numpy="1.0"), "made with numpy 1.0 instead of"),
    ):
        (out / RESULT_FILE).write_text(honest)
        change_result(out, change)
        _, differences = verify(out, sample=9 if "work_J" in message else 0)
        assert any(message in difference for difference in differences), message


@pytest.mark.parametrize(("runs", "status"), [(0, 1), (1, 0)])
def test_a_verification_without_runs_has_the_exit_status_of_a_failure(
    runs: int, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "robocov_app.benchmark.verification.verify_result",
        lambda *_, **__: Verification(seed=0, rows=1, runs=runs),
    )
    assert main(["benchmark", "verify", "entry"]) == status


@pytest.mark.usefixtures("short_runs")
def test_the_page_rejects_gaps_that_do_not_follow_from_costs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    run_short_benchmark(out)
    change_result(out, lambda result: result["rows"][0].update(gap=0.01))
    message = read_error(
        capsys, "benchmark", "page", str(out), "--alone", "--out", str(tmp_path / "page.html")
    )
    assert "rows[0]: gap: expected" in message


@pytest.mark.usefixtures("without_plots")
def test_entries_made_with_an_earlier_version_are_marked() -> None:
    adaptive, rapf = load_results_of("adaptive", "rapf")
    earlier = {**adaptive, "versions": {**adaptive["versions"], "robocov": "0.1.0 (results 4)"}}
    current = {**adaptive, "versions": {**adaptive["versions"], "robocov": "0.1.0 (results 5)"}}
    note = "Adaptive: made with an earlier version"
    page = build_page([rapf, earlier], "Test")
    assert note in page
    assert "in which the same runs have other results: Adaptive." in page
    assert "in which the same runs have other results" not in build_page([rapf, current], "Test")
    assert "made with an earlier version" not in build_page([rapf, current], "Test")


@pytest.mark.usefixtures("without_plots")
def test_an_incomplete_entry_is_listed_separately() -> None:
    results = load_results_of("atlas", "rapf")
    _, rapf = results
    few_result = {**rapf, "rows": rapf["rows"][:3], "entry": {**rapf["entry"], "label": "Few"}}
    ratings_alone = ratings.build_ratings(results)
    ratings_with_few = ratings.build_ratings([*results, few_result])
    for track, track_ratings in ratings_alone.items():
        assert track_ratings == ratings_with_few[track][: len(track_ratings)]
    tables = [build_tables(results), build_tables([*results, few_result])]
    assert tables[0].overview == tables[1].overview[:-1]
    assert tables[1].overview[-1][:5] == ("Few", "own", "–", "–", "3 of 345")
    assert [row[0] for row in tables[1].ideal] == [row[0] for row in tables[0].ideal]
    assert "Few" not in [row[0] for row in tables[1].ideal]
    incomplete = tables[1].incomplete
    few_row, *other_rows = incomplete
    assert few_row[:2] == ("Few", "own") and few_row[3] == "3 of 142"
    # RAPF is shown next to it, over the same runs.
    rapf_row = next(row for row in other_rows if row[0] == "RAPF")
    assert rapf_row[1:] == few_row[1:]


@pytest.mark.usefixtures("without_plots")
def test_unranked_entries_are_in_alphabetical_order_and_entries_without_runs_are_named() -> None:
    results = load_results_of("rapf", "lloyd")
    few_results = [
        {**results[0], "rows": results[0]["rows"][:3], "entry": {**results[0]["entry"], "label": label}}
        for label in ("b", "C", "a")
    ]
    page = build_page([*results, *few_results], "Test")
    overview = page.partition('id="overview-core"')[2].partition("</section>")[0]
    rows = re.findall(r'<th scope="row"[^>]*>(?:<svg.*?</svg>)?(.*?)</th>', overview)
    assert rows[-3:] == ["a", "b", "C"]
    plans = page.partition('id="overview-plans"')[2].partition("</section>")[0]
    assert "Without runs on these tracks: a; b; C." in plans
    entries = page.partition("<span>Entries</span>")[2].partition("</table>")[0]
    labels = re.findall(r'<th scope="row"[^>]*>(?:<svg.*?</svg>)?(.*?)</th>', entries)
    assert labels == ["a", "b", "C", "Lloyd", "RAPF"]


def test_of_many_equal_values_only_the_smallest_gaps_are_drawn() -> None:
    style = choose_curve_styles(["rapf"])[0]
    equal = [
        ParetoPoint(style, f"{gap}", 1200.0, gap, is_rival=gap > 2.0) for gap in (5.0, 4.0, 3.0, 2.0, 1.0)
    ]
    other = ParetoPoint(style, "other", 1210.0, 9.0, is_rival=True)
    drawn, omitted = thin_out_equal_values([*equal, other])
    assert [point.label for point in drawn] == ["3.0", "1.0", "other"]
    assert [point.label for point in omitted] == ["2.0", "4.0", "5.0"]
    assert thin_out_equal_values([*equal[1:], other]) == ([*equal[1:], other], [])
    # No result from a file replaces a bundled one.
    bundled = ParetoPoint(style, "bundled", 1200.0, 6.0, is_rival=True, is_bundled=True)
    drawn, _ = thin_out_equal_values([*equal, bundled, other])
    assert [point.label for point in drawn] == ["3.0", "1.0", "bundled", "other"]


@pytest.mark.usefixtures("without_plots")
@pytest.mark.parametrize("track", ["tuning", "plans-small"])
def test_runs_on_other_tracks_do_not_change_the_overview(track: str) -> None:
    results = load_results_of("atlas", "exploring-lloyd")
    atlas, explorer = results
    row = {**explorer["rows"][0], "track": track, "map": suite.TRACKS[track].maps[0], "seed": 0}
    extended = {**explorer, "rows": [*explorer["rows"], row]}
    assert build_tables([atlas, extended]).overview == build_tables(results).overview


@pytest.mark.usefixtures("without_plots")
def test_large_plans_have_a_ranking_of_their_own() -> None:
    page = build_page(load_results_of("rapf", "lloyd"), "Test")
    overview = page.partition('id="overview-plans"')[2].partition("</section>")[0]
    assert "Overview of large plans" in overview
    first_row = re.findall(r"<tr>(.*?)</tr>", overview.partition("<tbody>")[2])[0]
    cells = re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", first_row)
    assert (cells[2], cells[4]) == ("1", "24")


class PageTables(NamedTuple):
    overview: list[tuple[str, ...]]
    ideal: list[tuple[str, ...]]
    incomplete: list[tuple[str, ...]]


def build_tables(results: list[dict[str, Any]]) -> PageTables:
    """Return rows of the tables on the page of some results."""
    tables: dict[str, list[tuple[str, ...]]] = {}
    for part in re.findall(r"<table>.*?</table>", build_page(results, "Test"), re.DOTALL):
        caption = html.unescape(re.search(r"<caption><span>(.*?)</span>", part)[1])  # type: ignore[index]
        rows = []
        for row in re.findall(r"<tr>(.*?)</tr>", part.partition("<tbody>")[2]):
            cells = re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)
            rows.append(tuple(html.unescape(re.sub(r"<svg.*?</svg>", "", cell)) for cell in cells))
        tables.setdefault(caption.partition(",")[0].partition(":")[0], rows)
    incomplete = tables.get("Few") or tables.get("Few*", [])
    return PageTables(tables["Scores"], tables["Ratings"], incomplete)


def test_a_contact_and_motion_at_the_end_halve_the_score() -> None:
    row = {"gap": 0.25, "contacts": 0, "settled_at_s": 9.0}
    assert ratings.compute_score(row) == 0.8
    assert ratings.compute_score({**row, "contacts": 1}) == 0.4
    assert ratings.compute_score({**row, "settled_at_s": None}) == 0.4
    assert ratings.compute_score({**row, "gap": None}) == 0.0
    two_runs = ratings.Rating("", "ideal", [{**row, "map": "rooms", "seed": 0}], [row])
    assert two_runs.score == 0.4


def test_the_interval_of_the_mean_score_is_over_maps() -> None:
    """More runs on the same maps, on the same or on other tracks, do not make it narrower."""
    names = suite.TRACKS["ideal"].maps[:20]
    gaps = np.random.default_rng(0).uniform(0.0, 1.0, len(names))

    def build_rating(seeds: tuple[int, ...]) -> ratings.Rating:
        runs = product(zip(names, gaps, strict=True), seeds)
        rows = [
            {"map": name, "seed": seed, "gap": gap, "contacts": 0, "settled_at_s": 9.0}
            for (name, gap), seed in runs
        ]
        return ratings.Rating("", "ideal", rows)

    once = ratings.compute_mean_score([build_rating((0,))])
    scores = 1.0 / (1.0 + gaps)
    assert once.score == pytest.approx(scores.mean())
    assert once.margin == pytest.approx(1.96 * scores.std(ddof=1) / np.sqrt(len(names)))
    assert ratings.compute_mean_score([build_rating((0, 1))]) == pytest.approx(once)
    assert ratings.compute_mean_score([build_rating((0,)), build_rating((0, 1))]) == pytest.approx(once)
    rating = build_rating((0,))
    for map_count in (ratings.MIN_INTERVAL_MAPS - 1, ratings.MIN_INTERVAL_MAPS):
        few = replace(rating, rows=rating.rows[:map_count])
        has_margin = bool(np.isfinite(ratings.compute_mean_score([few]).margin))
        assert has_margin == (map_count == ratings.MIN_INTERVAL_MAPS)


def test_intervals_require_at_least_12_maps() -> None:
    rows = [{"map": str(k), "seed": 0, "gap": 0.1 * k} for k in range(ratings.MIN_INTERVAL_MAPS)]
    assert np.isfinite(ratings.Rating("", "ideal", rows).gap.low)
    gap = ratings.Rating("", "ideal", rows[1:]).gap
    assert np.isnan(gap.low)
    assert gap.estimate == pytest.approx(0.6)


def build_failing_rating(failed_count: int) -> ratings.Rating:
    """Build a rating on 20 maps, some of whose runs failed; the others have small values."""
    names = suite.TRACKS["ideal"].maps[:20]
    rows = [
        {**row, "map": name}
        for name, row in zip(names, build_result("Mine", 0.01)["rows"][:1] * 20, strict=True)
    ]
    failed_rows = [{"track": "ideal", "map": name, "seed": 0, "error": ""} for name in names[:failed_count]]
    return ratings.Rating("Mine", "ideal", rows[failed_count:], failed_rows)


def test_failed_runs_count_as_infinite() -> None:
    """No value of an entry improves if runs fail in which the controller would do badly."""
    some = ratings.build_rating_cells(build_failing_rating(9), "own")
    assert (some["Runs"], some["Gap, %"], some["95%"]) == ("20 of 142, 9 failed", "1.0", "1.0–∞")
    assert (some["Mean"], some["Worst"], some["Settled"]) == ("∞", "∞", "55%")
    most = ratings.build_rating_cells(build_failing_rating(11), "own")
    assert (most["Gap, %"], most["95%"]) == ("∞", "1.0–∞")
    for column in ("Within 5%, s", "∫J / J_ref, s", "Path, m", "Work, J", "Settled, s", "B/s", "µs/s"):
        assert some[column] != ratings.NO_VALUE and most[column] == ratings.NO_VALUE
    # A run without a value counts like a failed one.
    incomplete_rating = build_failing_rating(0)
    for row in incomplete_rating.rows[:11]:
        row |= {"near_final_s": None, "mean_distance_over_run_m": None}  # type: ignore[operator]
    cells = ratings.build_rating_cells(incomplete_rating, "own")
    assert cells["Within 5%, s"] == cells["∫J / J_ref, s"] == ratings.NO_VALUE
    bounded_rating = build_failing_rating(11)
    for row in bounded_rating.rows:
        row |= {"gap_to_bound": 0.02}  # type: ignore[operator]
    assert ratings.build_rating_cells(bounded_rating, "own")["Gap, %"] == "∞ (≤ ∞)"


def test_a_run_with_another_area_has_an_infinite_gap() -> None:
    row = {"map": "rooms", "seed": 0, "gap": None}
    assert ratings.Rating("", "ideal", [row]).gap.estimate == np.inf


def test_failed_runs_are_selected_and_have_gaps_by_families() -> None:
    rating = build_failing_rating(12)
    assert rating.select_runs(rating.run_keys) == rating
    assert rating.select_runs(rating.run_keys[-2:]).run_count == 2
    head, (row,) = ratings.build_family_rows([rating])
    # The first twelve maps are the bundled ones.
    assert dict(zip(head, row, strict=True)) == {
        "Controller": "Mine",
        "bundled": "∞",
        "polygons": "1.0",
        "blocks": "1.0",
    }


@pytest.mark.usefixtures("short_ideal_track")
def test_entries_with_failed_runs_are_neither_in_plots_nor_hidden() -> None:
    failing = build_result("Failing", 0.1)
    failing["rows"][0] = {"track": "ideal", "map": MAPS[0], "seed": 0, "error": "it failed"}
    page = build_page([failing, build_result("Mine", 0.2), build_bundled_rapf()], "Test")
    descriptions = re.findall(r"Median gap against .*?\.", page)
    assert descriptions and not any("Failing" in description for description in descriptions)
    overview = page.partition('id="overview-core"')[2].partition("</section>")[0]
    (row,) = [row for row in overview.split("<tr>") if "Failing*</th>" in row]
    # Only a line break keeps the column narrow.
    assert "<td>2,\n1 failed</td>" in row and "<td>50%</td>" in row and "<td>∞</td>" in row


@pytest.mark.usefixtures("without_plots")
def test_unranked_entries_with_the_smallest_gap_are_named() -> None:
    """The oracle has even smaller gaps, but does not compete."""
    page = build_page(load_results_of("atlas-shared", "rapf", "oracle"), "Test")
    assert "have no rank: Atlas, shared maps (Plans small, Plans medium)." in page


@pytest.mark.usefixtures("without_plots")
def test_files_do_not_hide_bundled_entries_with_the_smallest_gap() -> None:
    results = load_results_of("atlas-shared", "rapf")
    forged = copy.deepcopy(results[1])
    forged["is_bundled"] = False
    for row in forged["rows"]:
        row["gap"] = 0.0
    page = build_page([*results, forged], "Test")
    assert "Of the built-in controllers that do not know the whole map" in page
    assert "have no rank: Atlas, shared maps (Plans small, Plans medium)." in page


def test_teams_that_never_move_or_end_far_above_rapf_are_found() -> None:
    def build_result(costs: list[float], path_length: float = 5.0) -> dict[str, Any]:
        rows = [
            {
                "track": "ideal",
                "map": f"map {k}",
                "seed": 0,
                "mean_distance_m": cost,
                "path_length_m": path_length,
            }
            for k, cost in enumerate(costs)
        ]
        return {"rows": [*rows, {"track": "ideal", "map": "failed", "seed": 0, "error": "it failed"}]}

    rapf = build_result([1.0, 1.0, 1.0])
    assert find_anomalies(rapf, rapf) == []
    (anomaly,) = find_anomalies(build_result([0.5, 0.5, 1.5]), rapf)
    assert anomaly == ("ideal", "map 2", 0, "cost more than 1.2 times that of RAPF")
    # A controller that is usually worse than RAPF is no surprise.
    assert find_anomalies(build_result([1.5, 1.5, 1.5]), rapf) == []
    at_rest = find_anomalies(build_result([0.9, 0.9, 0.9], path_length=0.01), rapf)
    assert {anomaly.reason for anomaly in at_rest} == {"at rest from the start"} and len(at_rest) == 3


@pytest.mark.usefixtures("short_runs")
def test_controllers_in_files_are_verified_only_if_named_and_unchanged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = tmp_path / "mine.py"
    out = tmp_path / "out"
    mine.write_text(HEAD + PULL)
    run_short_benchmark(out, f"{mine}:Mine")
    assert str(tmp_path) not in (out / RESULT_FILE).read_text()
    assert "pass --controller FILE.py:CLASS" in read_error(capsys, "benchmark", "verify", str(out))
    assert verify(out, sample=1, controller=f"{mine}:Mine") == (1, [])
    mine.write_text(HEAD + PULL + "\n# changed\n")
    message = read_error(capsys, "benchmark", "verify", str(out), "--controller", f"{mine}:Mine")
    assert "is not the file that was rated" in message


def select_part(result: dict[str, Any], part: str) -> dict[str, Any]:
    """Return the result itself, one of its objects, or its first row."""
    if part == "rows":
        return result["rows"][0]
    return result[part] if part else result


@pytest.mark.usefixtures("short_runs")
def test_damaged_results_are_rejected_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    run_short_benchmark(out)
    honest = json.loads((out / RESULT_FILE).read_text())
    for part in ("", "entry", "selection", "rows"):
        for name in select_part(honest, part):
            damaged = json.loads(json.dumps(honest))
            select_part(damaged, part).pop(name)
            (out / RESULT_FILE).write_text(json.dumps(damaged))
            assert str(out / RESULT_FILE) in read_error(capsys, "benchmark", "verify", str(out)), name
            if name not in ("gains", "set", "entry", "selection", "versions"):
                select_part(damaged, part)[name] = {"x": []}
                (out / RESULT_FILE).write_text(json.dumps(damaged))
                assert str(out / RESULT_FILE) in read_error(capsys, "benchmark", "verify", str(out)), name


@pytest.mark.usefixtures("short_runs")
def test_finished_runs_are_reused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = run_short_benchmark(tmp_path / "out")
    monkeypatch.setattr("robocov_app.sweep.sweeping.LocalPool", None)
    assert run_short_benchmark(tmp_path / "out") == expected


@pytest.mark.usefixtures("short_runs")
def test_the_result_of_another_controller_or_of_other_gains_is_kept(tmp_path: Path) -> None:
    run_short_benchmark(tmp_path, "rapf", k_rep=0.5)
    content = (tmp_path / RESULT_FILE).read_bytes()
    expectation = "expected no result or that of {}, got that of rapf with k_rep=0.5; choose another --out"
    for controller in ("lloyd", "rapf"):
        with pytest.raises(InputError, match=expectation.format(controller)):
            run_short_benchmark(tmp_path, controller)
    assert (tmp_path / RESULT_FILE).read_bytes() == content


def test_all_columns_of_the_printed_ratings_are_explained(capsys: pytest.CaptureFixture[str]) -> None:
    (result,) = load_results_of("rapf")
    _print_ratings(result, Path("benchmark"))
    printed = capsys.readouterr().out
    for explanation in _EXPLANATIONS.values():
        assert explanation in printed
    (_, *titles), _ = ratings.build_summary_rows(result)
    assert set(titles) == {"Runs", *_EXPLANATIONS}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--controller", "rapff"), "--controller: unknown controller 'rapff': did you mean 'rapf'"),
        (("--controller", "rapf", "--set", "k_re=1"), "unknown gain 'k_re'"),
        (("--controller", "rapf", "--track", "idael"), "did you mean 'ideal'"),
        ((), "--controller: expected a controller name or FILE.py:CLASS"),
        (("verify",), "DIR: expected one result"),
        (("page", "--alone"), "DIR: expected results"),
        (
            ("page", "nowhere"),
            "nowhere: expected the folder or the file of a result of the benchmark, got a path that does not",
        ),
        (("page", "TORN"), "torn.json.gz: cannot be unpacked: Compressed file ended"),
        (("suite", "--quick"), "--quick: not an option of robocov benchmark suite"),
        (("--controller", "rapf", "--out", "FOREIGN"), "expected an empty folder or a benchmark"),
        (("verify", "OTHER"), "expected a result of robocov benchmark"),
    ],
)
def test_invalid_commands_are_rejected(
    arguments: tuple[str, ...], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "letter.txt").write_text("Dear")
    (tmp_path / "other.json").write_text("{}")
    (tmp_path / "torn.json.gz").write_bytes(gzip.compress(b"{}" * 99)[:-9])
    paths = {"FOREIGN": str(tmp_path), "OTHER": str(tmp_path / "other.json")}
    paths["TORN"] = str(tmp_path / "torn.json.gz")
    assert message in read_error(
        capsys, "benchmark", *(paths.get(argument, argument) for argument in arguments)
    )


@given(st.lists(st.tuples(st.sampled_from([1.0, 2.0, 5.0, 9.0]), st.booleans()), min_size=1, max_size=12))
def test_the_median_time_to_rest_is_that_of_kaplan_and_meier(runs: list[tuple[float, bool]]) -> None:
    rows = [{"settled_at_s": time if has_settled else None} for time, has_settled in runs]
    fraction, median = ratings.Rating("", "ideal", rows).compute_rest()
    # Runs that did not settle are censored at the end, so the curve is the fraction that still moves.
    times = sorted(row["settled_at_s"] for row in rows if row["settled_at_s"] is not None)
    expected = None
    for settled_at in times:
        moving = sum(other > settled_at for other in times) + len(rows) - len(times)
        if moving <= len(rows) / 2:
            expected = settled_at
            break
    assert fraction == len(times) / len(rows)
    assert median == expected


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=12))
def test_no_point_dominates_the_pareto_front(points: list[tuple[int, int]]) -> None:
    front = {points[k] for k in find_pareto_front(points)}
    dominated = set()
    for x, y in points:
        if any(u <= x and v <= y and (u, v) != (x, y) for u, v in points):
            dominated.add((x, y))
    assert front == set(points) - dominated


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kills a process")
def test_a_killed_benchmark_is_resumed(tmp_path: Path) -> None:
    options = "--controller lloyd --track one-robot --workers 1 --json"
    maps = ("blocks-a", "blocks-b", "polygons-7001")
    arguments = ["benchmark", *options.split(), "--maps", *maps]
    command = [*COMMAND, *arguments, "--out", str(tmp_path / "killed")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        runs = tmp_path / "killed" / TRACKS_FOLDER / "one-robot" / "runs"
        end = time.monotonic() + 120.0
        while not (runs.is_dir() and any(not path.name.startswith(".") for path in runs.iterdir())):
            assert time.monotonic() < end and process.poll() is None
            time.sleep(0.02)
        process.kill()
    assert not (tmp_path / "killed" / RESULT_FILE).exists()
    assert main([*arguments, "--out", str(tmp_path / "killed")]) == 0
    assert main([*arguments, "--out", str(tmp_path / "whole")]) == 0
    rows = {}
    for name in ("killed", "whole"):
        rows[name] = [{**row, "deciding_s": None} for row in read_result(tmp_path / name)["rows"]]
    assert rows["killed"] == rows["whole"] and len(rows["whole"]) == len(maps)


def build_result(label: str, gap: float, *, is_bundled: bool = False, **entry: Any) -> dict[str, Any]:
    """Build a result with the two runs of `short_ideal_track`."""
    rows = [
        {
            **dict.fromkeys(("stuck_robots", "contacts"), 0),
            "track": "ideal",
            "map": map_name,
            "seed": 0,
            "gap": gap,
            "gap_to_bound": None,
            "mean_distance_m": 2.0,
            "mean_distance_over_run_m": 3.0,
            "near_final_s": 9.0,
            "settled_at_s": 8.0,
            "path_length_m": 8.0 + gap,
            "work_J": 50.0,
            "sent_bytes": 4e5,
            "deciding_s": 0.1,
        }
        for map_name in MAPS
    ]
    default_entry = {
        "controller": "mine.py:Mine",
        "label": label,
        "information": "own",
        "gains": {},
        "set": {},
        "source_sha256": "1" * 64,
    }
    return {
        "entry": default_entry | entry,
        "rows": rows,
        "is_bundled": is_bundled,
        "versions": {"numpy": "2"},
    }


@pytest.fixture
def short_ideal_track(monkeypatch: pytest.MonkeyPatch) -> None:
    track = replace(suite.TRACKS["ideal"], seeds=(0,), maps=MAPS)
    monkeypatch.setitem(suite.TRACKS, "ideal", track)  # type: ignore[arg-type]


def build_bundled_rapf() -> dict[str, Any]:
    return build_result("RAPF", 0.3, is_bundled=True, controller="rapf", source_sha256=None)


@pytest.mark.usefixtures("short_ideal_track", "without_plots")
def test_other_entries_do_not_replace_a_bundled_one() -> None:
    by_label = build_result("RAPF", 0.1)
    by_name = build_result("RAPF", 0.2, controller="rapf", source_sha256=None)
    incomplete = build_result("Few", 0.4)
    incomplete["rows"].pop()
    tables = build_tables([by_label, by_name, incomplete, build_bundled_rapf()])
    gaps = {row[0]: row[4] for row in tables.ideal}
    assert gaps == {"RAPF": "30.0", "RAPF*": "10.0", "RAPF #2*": "20.0"}
    # Only the bundled entry is a yardstick.
    assert [row[0] for row in tables.incomplete] == ["Few*", "RAPF"]


@pytest.mark.usefixtures("short_ideal_track")
def test_results_from_files_are_marked_everywhere() -> None:
    long_label = "Atlas, shared maps" + 30 * "."
    pages = [
        build_page([*results, build_bundled_rapf()], "Test")
        for results in ([build_result(long_label, 0.1)], [build_result("Mine", 0.1, is_bundled=True)])
    ]
    assert [f"{long_label}*" in page for page in pages] == [True, False]
    # In a plot, only the name is shortened.
    (text,) = set(re.findall(r">(Atlas, shared maps[^<]*)</text>", pages[0]))
    assert text.endswith("…*")
    assert ["from a file, which may contain anything" in page for page in pages] == [True, False]


@pytest.mark.usefixtures("short_ideal_track", "without_plots")
def test_equal_scores_have_the_same_rank() -> None:
    results = [build_result(label, gap) for label, gap in (("a", 0.2), ("b", 0.2), ("c", 0.1), ("d", 0.4))]
    overview = build_tables([*results, build_bundled_rapf()]).overview
    ranks = {row[0]: row[2] for row in overview}
    # The files change no rank of RAPF.
    assert ranks == {"c*": "1", "a*": "1", "b*": "1", "RAPF": "1", "d*": "2"}
    ranks = {row[0]: row[2] for row in build_tables(results).overview}
    assert ranks == {"c*": "1", "a*": "2", "b*": "2", "d*": "4"}


@pytest.mark.usefixtures("short_ideal_track")
def test_files_do_not_remove_bundled_results_from_plots() -> None:
    bundled = [build_bundled_rapf(), build_result("Bundled", 0.5, is_bundled=True)]
    files = [build_result(f"Short {k}", 0.1) for k in range(5)]
    for result in files:
        for row in result["rows"]:
            row["path_length_m"] = 1e-9
    files += [build_result("Long", 0.1), build_result("Far", 1e9)]
    for row in files[-2]["rows"]:
        row["path_length_m"] = 1e9
    page = build_page([*files, *bundled], "Test")
    (path_plot,) = re.findall(r"<figcaption>Gap and path length</figcaption>.*?</figure>", page)
    drawn, _, note = path_plot.partition("</svg>")
    assert all(f">{label}</text>" in drawn for label in ("RAPF", "Bundled"))
    assert "Short" not in drawn and "Long" not in drawn
    shorts = "; ".join(f"Short {k}*" for k in range(5))
    assert f"because they are far from all others: {shorts}; Long*; Far*." in note


@pytest.mark.usefixtures("short_ideal_track")
def test_files_do_not_squeeze_bundled_results_in_plots() -> None:
    bundled = [build_bundled_rapf(), build_result("Bundled", 0.5, is_bundled=True)]
    results = {name: build_result(name, 0.1) for name in ("Short", "Long", "Near", "Still")}
    path_lengths = {"Short": 2.0, "Long": 40.0, "Near": 3.0, "Still": 0.0}
    for name, result in results.items():
        for row in result["rows"]:
            row["path_length_m"] = path_lengths[name]
    results["High"] = build_result("High", 2.1)
    page = build_page([*results.values(), *bundled], "Test")
    (path_plot,) = re.findall(r"<figcaption>Gap and path length</figcaption>.*?</figure>", page)
    drawn, _, note = path_plot.partition("</svg>")
    assert all(f">{label}</text>" in drawn for label in ("RAPF", "Bundled", "Near*"))
    # The median paths of the bundled results are 8.3 and 8.5 m, and their largest gap is 50%.
    far_labels = note.partition("far from all others: ")[2].partition(".")[0].split("; ")
    assert sorted(far_labels) == ["High*", "Long*", "Short*", "Still*"]


def test_points_at_zero_on_a_logarithmic_axis_are_named() -> None:
    style = choose_curve_styles(["rapf"])[0]
    points = [ParetoPoint(style, f"{x:g}", x, 1.0, is_rival=True) for x in (0.0, 1.0, 9.0)]
    drawn, zeros = pareto_plots._split_zeros(points)
    assert [point.label for point in drawn] == ["1", "9"] and [point.label for point in zeros] == ["0"]
    assert pareto_plots._split_zeros(points[:2]) == (points[:2], [])


def test_files_change_neither_the_front_nor_the_marks_of_bundled_results() -> None:
    style = choose_curve_styles(["rapf"])[0]
    bundled = [
        ParetoPoint(style, "Short", 5.0, 20.0, is_rival=True, is_bundled=True),
        ParetoPoint(style, "Good", 9.0, 3.0, is_rival=True, is_bundled=True),
    ]
    files = [
        ParetoPoint(style, "Better*", 4.0, 1.0, is_rival=True),
        ParetoPoint(style, "Same*", 9.0, 3.0, is_rival=True),
    ]
    lines = draw_pareto_figure([*bundled, *files], "bytes").axes[0].lines
    # The first line is the front. Marks that are drawn later cover others.
    points = [line.get_xydata().tolist() for line in lines]
    assert points[0] == [[5.0, 20.0], [9.0, 3.0]]
    assert points[1:] == [[[4.0, 1.0]], [[9.0, 3.0]], [[5.0, 20.0]], [[9.0, 3.0]]]
    assert draw_pareto_figure(files, "bytes").axes[0].lines[0].get_xydata().tolist() == [[4.0, 1.0]]


def test_files_with_equal_values_do_not_remove_bundled_results() -> None:
    style = choose_curve_styles(["rapf"])[0]
    bundled = [
        ParetoPoint(style, f"{gap}", 1200.0, gap, is_rival=True, is_bundled=True) for gap in (1.0, 2.0)
    ]
    files = [ParetoPoint(style, f"{gap}*", 1200.0, gap, is_rival=True) for gap in (0.1, 0.2, 0.3)]
    drawn, omitted = thin_out_equal_values([*bundled, *files])
    assert [point.label for point in drawn] == ["1.0", "2.0", "0.1*"]
    assert [point.label for point in omitted] == ["0.2*", "0.3*"]


@pytest.mark.usefixtures("short_ideal_track", "without_plots")
def test_the_code_of_an_entry_in_a_file_is_a_claim() -> None:
    forged = build_result("\u0410tlas", 0.1, controller="atlas", source_sha256=None)
    plugin = build_result("Zigzag", 0.1, controller="zigzag", source_sha256=None)
    page = build_page([forged, build_result("Mine", 0.1), plugin, build_bundled_rapf()], "Test")
    entries = page.partition("<span>Entries</span>")[2].partition("</table>")[0]
    codes = re.findall(r"<td[^>]*>((?:according|built|source).*?)</td>", entries)
    # In alphabetical order: Mine, RAPF, Zigzag, and a label that begins with a Cyrillic letter.
    assert codes == [
        "according to the file: source 111111111111",
        "built in",
        "according to the file: installed package",
        "according to the file: built in",
    ]


@pytest.mark.usefixtures("short_ideal_track")
def test_the_page_shows_entries_with_any_content() -> None:
    labels = ["<script>alert(1)</script>", "A\x00B", "\u202eevil", "$x^{$ \\frac", "{{ 7 * 7 }}", "W" * 60]
    results = [build_result(label, 0.1 * k) for k, label in enumerate(labels)]
    results.append(build_result("Gains", 0.1, set={"<b>" * 30: "</table>" * 50}))
    results[0]["rows"][0] = {"track": "ideal", "map": MAPS[0], "seed": 0, "error": "<b>x</b>"}
    results[1]["rows"][0] |= {"deciding_s": 1e15}
    for k in range(100):
        results.append(build_result(f"Entry {k}", 0.5))
        if k % 2:
            results[-1]["rows"].pop()
    page = build_page([*results, build_bundled_rapf()], "Test")
    assert not set(page) & {"\x00", "\u202e"}
    assert "<script" not in page and "<b>" not in page
    assert "A\\x00B" in page and "{{ 7 * 7 }}" in page
    tables = [html.unescape(part) for part in re.findall(r"<caption><span>(.*?)</span>", page)]
    assert sum("incomplete" in caption for caption in tables) == MAX_INCOMPLETE_TABLES
    assert "Incomplete entries without a table: 40." in page
    assert "Entries with lower scores that are not drawn: 17." in page


@pytest.mark.usefixtures("short_runs")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda result: result["entry"].update(label="W" * 61), "label: expected 1 to 60 characters"),
        (lambda result: result["entry"].update(label=" "), "label: expected 1 to 60 characters"),
        (
            lambda result: result["rows"][0].update(work_J=1e30),
            "work_J: expected at most 1e+15",
        ),
    ],
    ids=["long label", "empty label", "huge number"],
)
def test_entries_that_no_page_can_show_are_rejected(change: Any, message: str, tmp_path: Path) -> None:
    run_short_benchmark(tmp_path / "out")
    change_result(tmp_path / "out", change)
    with pytest.raises(InputError, match=re.escape(message)):
        read_result(tmp_path / "out")


def test_no_file_contains_a_bundled_result(tmp_path: Path) -> None:
    result = json.loads(gzip.decompress((ENTRIES / "rapf.json.gz").read_bytes()))
    (tmp_path / RESULT_FILE).write_text(json.dumps({**result, "is_bundled": True}))
    assert read_result(tmp_path)["is_bundled"] is False
    assert all(result["is_bundled"] for result in load_bundled_results())


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    os.environ["SE_OFFLINE"] = "true"
    shared = Browser(tmp_path_factory.mktemp("profile"))
    try:
        yield shared
    finally:
        shared.driver.quit()


@pytest.mark.slow
@pytest.mark.xdist_group("browser")
@pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="not installed: chromium and chromedriver")
def test_the_page_fits_narrow_and_wide_windows(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    track = replace(suite.TRACKS["ideal"], seeds=(0,), maps=("rooms", "polygons-7001"))
    monkeypatch.setitem(suite.TRACKS, "ideal", track)  # type: ignore[arg-type]
    results = []
    for k, name in enumerate(("rapf", "lloyd", "atlas")):
        rows = [
            {
                **dict.fromkeys(("stuck_robots", "contacts"), 0),
                "track": "ideal",
                "map": map_name,
                "seed": 0,
                "gap": 0.1 * (k + 1) + 0.01 * j,
                "gap_to_bound": 0.5 if k == 0 else None,
                "mean_distance_m": 2.0,
                "mean_distance_over_run_m": 3.0,
                "near_final_s": 9.0,
                "settled_at_s": 8.0,
                "path_length_m": 8.0 - k,
                "work_J": 50.0,
                "sent_bytes": 4e5 * (k + 1),
                "deciding_s": 0.1 * 20**k,
            }
            for j, map_name in enumerate(("rooms", "polygons-7001"))
        ]
        entry = {"controller": name, "label": name.upper(), "information": "own", "gains": {}, "set": {}}
        entry |= {"source_sha256": None}
        results.append({"entry": entry, "rows": rows, "is_bundled": False, "versions": {"numpy": "2"}})
    page = tmp_path / "page.html"
    page.write_text(build_page(results, "A <test> of names"), encoding="utf-8")
    for width in (1280, 390):
        browser.open_file(page, width)
        assert browser.read_console() == []
        assert browser.run_script("return performance.getEntriesByType('resource').length") == 0
        assert browser.run_script("return document.documentElement.scrollWidth") <= width
        assert len(browser.find_all("svg.plot")) == 3
    assert browser.find("h1").text == "A <test> of names"
    labels = [cell.text for cell in browser.find_all("#ideal tbody th")][:3]
    assert labels == ["RAPF*", "LLOYD*", "ATLAS*"]
    assert [cell.text for cell in browser.find_all("#overview-core tbody th")] == labels
    gaps = [
        float(cell.text.split()[0])
        for cell in browser.find_all("#ideal .scroll:first-of-type tbody td:nth-child(5)")
    ]
    assert gaps == np.sort(gaps).tolist()
