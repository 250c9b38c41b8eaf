"""The handbook's numbers are those of the entries that the package contains."""

from __future__ import annotations

import csv
import math
import re
import runpy
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robocov.controllers import CONTROLLERS
from robocov.typing import FloatArray
from robocov_app.benchmark import ratings, suite
from robocov_app.benchmark.page.anomalies import find_anomalies
from robocov_app.benchmark.rated_controller import COVERAGE_CONTROL_FILES
from robocov_app.benchmark.ratings import Rating, build_ratings, get_run_key
from robocov_app.benchmark.references import RESTARTS
from robocov_app.benchmark.results import ENTRIES, load_bundled_results, read_result
from robocov_app.replication.claims.thresholds import (
    MAX_GAP,
    MAX_MAP_GAP,
    MAX_REST_TIME_S,
    MAX_STEP_RATIO,
    MIN_AT_REST,
    NEVER_WORSE,
    RARELY,
)
from robocov_app.replication.design.plan import UNSEEN

PAGE = Path(__file__).parents[3] / "app/handbook/controllers.md"
BENCHMARK_PAGE = PAGE.parent / "benchmark.md"


def read_text(page: Path) -> str:
    """Return a page of the handbook as one line."""
    return " ".join(page.read_text(encoding="utf-8").split())


@cache
def read_entry(controller: str) -> dict[str, Any]:
    """Return the entry of a controller."""
    return read_result(ENTRIES / f"{controller}.json.gz")


@cache
def read_rows(controller: str, track: str) -> Sequence[dict[str, Any]]:
    """Return the rows of a controller on a track."""
    return [row for row in read_entry(controller)["rows"] if row["track"] == track]


def rate(controller: str, track: str) -> Rating:
    """Return the rating of a controller on a track."""
    return Rating(controller, track, read_rows(controller, track))


def compute_median_gap(controller: str, track: str) -> float:
    """Return the median gap of a controller on a track, %."""
    return 100.0 * rate(controller, track).gap.estimate


def compute_map_medians(controller: str, track: str, metric: str = "gap") -> dict[str, float]:
    """Return the median of a metric on each map of a track."""
    values: dict[str, list[float]] = {}
    for row in read_rows(controller, track):
        values.setdefault(row["map"], []).append(row[metric])
    return {name: float(np.median(values_of_map)) for name, values_of_map in values.items()}


def count_above(controller: str, other: str, track: str) -> int:
    """Return the number of maps on which the median cost is more than 1% above that of another controller."""
    costs = compute_map_medians(controller, track, "mean_distance_m")
    other_costs = compute_map_medians(other, track, "mean_distance_m")
    return sum(cost > NEVER_WORSE * other_costs[name] for name, cost in costs.items())


def format_row(controller: str, track: str) -> str:
    """Return the row of a controller's results on a track."""
    rows = read_rows(controller, track)
    assert not any("error" in row for row in rows)
    rating = rate(controller, track)
    medians = {}
    for name in suite.TRACKS[track].maps:
        gaps = [row["gap"] for row in rows if row["map"] == name and row["gap"] is not None]
        medians[name] = np.median(gaps)
    maps_above = sum(median > 0.05 for median in medians.values())
    runs_with_contacts = sum(row["contacts"] > 0 for row in rows)
    gap = compute_median_gap(controller, track)
    path_length = rating.compute_median("path_length_m")
    settled = 100.0 * rating.compute_rest()[0]
    cells = [
        f"`{controller}`",
        f"{gap:.1f}",
        f"{maps_above} of {len(medians)}",
        f"{runs_with_contacts} of {len(rows)}",
        f"{settled:.0f}",
        f"{path_length:.1f}",
    ]
    return f"| {' | '.join(cells)} |"


RIVALS = ("rapf", "learned", "frontier-median", "greedy-submodular")
PLAN_TRACKS = ("plans-small", "plans-medium", "plans-large", "plans-crowd")
"""Tracks of large plans with more than one robot."""
PLAN_CONTROLLERS = {
    "plans-one-robot": ("frontier-median", "greedy-submodular", "local-search"),
    "plans-small": ("frontier-median", "greedy-submodular", "local-search"),
    "plans-medium": ("frontier-median", "greedy-submodular", "local-search", "exemplar"),
    "plans-large": ("frontier-median", "greedy-submodular", "voronoi-graph", "local-search", "exemplar"),
    "plans-crowd": ("frontier-median", "greedy-submodular", "voronoi-graph", "local-search", "exemplar"),
}
"""Controllers on each track of large plans, in addition to those on all of these tracks."""
PLAN_ROWS = [
    *product(
        ("atlas", "atlas-shared", "learned", "geodesic-lloyd", "tangentbug", "rapf", "lloyd"),
        suite.RANKED_TRACKS["plans"],
    ),
    *((controller, track) for track, names in PLAN_CONTROLLERS.items() for controller in names),
]
"""Controllers and tracks with runs on large plans."""
UNKNOWN_DENSITY_ROWS = [
    (controller, "unknown-density")
    for controller in ("exploring-lloyd", "atlas-shared", "rapf", "gp-ucb", "adaptive", "lloyd")
]
"""Controllers with runs on the track of an unknown density."""
OPEN_SQUARE_ROWS = [
    (controller, "open-square")
    for controller in (
        *COVERAGE_CONTROL_FILES,
        "exploring-lloyd",
        "rapf",
        "gp-ucb",
        "lloyd",
        "adaptive",
    )
]
"""Controllers with runs on the track with the worlds of CoverageControl."""
ROWS = [
    *(
        (controller, track)
        for track in suite.RANKED_TRACKS["core"]
        for controller in ("atlas", "atlas-shared")
    ),
    *((controller, track) for track in ("ideal", "short-range", "large-team") for controller in RIVALS),
    *((controller, "ideal") for controller in ("tangentbug", "local-search", "exemplar")),
    ("learned", "lossy"),
    *PLAN_ROWS,
    *UNKNOWN_DENSITY_ROWS,
    *OPEN_SQUARE_ROWS,
]


@pytest.mark.parametrize(("controller", "track"), ROWS)
def test_rows_agree_with_the_entries(controller: str, track: str) -> None:
    assert f"| {suite.format_heading(track)} {format_row(controller, track)}\n" in PAGE.read_text(
        encoding="utf-8"
    )


def test_the_best_controller_with_own_information_on_large_plans_agrees_with_the_entries() -> None:
    results = {
        result["entry"]["controller"]: result["rows"]
        for result in load_bundled_results()
        if result["entry"]["information"] == "own"
    }
    text = read_text(PAGE)
    gaps_of_atlas = []
    tracks = suite.RANKED_TRACKS["plans"]
    for track in tracks:
        gaps = {
            name: Rating(name, track, rows).gap.estimate
            for name, all_rows in results.items()
            if (rows := [row for row in all_rows if row["track"] == track])
        }
        assert min(gaps, key=lambda name: gaps[name]) == "atlas"
        gaps_of_atlas.append(f"{100.0 * gaps['atlas']:.1f}%")
    *first_gaps, last_gap = gaps_of_atlas
    assert f"({', '.join(first_gaps)} and {last_gap})" in text
    contacts = [row["contacts"] > 0 for row in results["tangentbug"] if row["track"] in tracks]
    assert f"its robots touch something in {sum(contacts)} of {len(contacts)} runs" in text


def test_gaps_of_one_and_three_robots_on_the_same_plans_agree_with_the_entries() -> None:
    results = [
        result
        for result in load_bundled_results()
        if result["entry"]["controller"] not in COVERAGE_CONTROL_FILES
    ]
    gaps, path_lengths = {}, {}
    for result, track in product(results, ("plans-one-robot", "plans-small")):
        rows = [row for row in result["rows"] if row["track"] == track]
        name = result["entry"]["controller"]
        gaps[name, track] = np.median([row["gap"] for row in rows])
        path_lengths[name, track] = np.median([row["path_length_m"] for row in rows])
    names = [result["entry"]["controller"] for result in results]
    larger_count = sum(gaps[name, "plans-small"] > gaps[name, "plans-one-robot"] for name in names)
    text = read_text(PAGE)
    assert f"With three robots, {larger_count} of {len(names)} controllers have larger gaps" in text
    changes = [
        f"from {gaps[name, 'plans-one-robot']:.1%} to {gaps[name, 'plans-small']:.1%}"
        for name in ("atlas", "rapf")
    ]
    assert f"that of `atlas` grows {changes[0]}, that of `rapf` {changes[1]}" in text
    lengths = [f"{path_lengths['atlas', track]:.1f}" for track in ("plans-one-robot", "plans-small")]
    assert f"A single robot of `atlas` moves {lengths[0]} m, each of three {lengths[1]} m" in text


def test_gaps_in_the_first_table_agree_with_the_entries() -> None:
    first_table = PAGE.read_text(encoding="utf-8").partition("## List of controllers")[0]
    rows = [line.split(" | ") for line in first_table.splitlines() if line.startswith("| ")][1:]
    tracks = set()
    for _, choice, gaps in rows:
        names = re.findall(r"`([a-z-]+)`", choice)
        track = "unknown-density" if "on Unknown density" in gaps else "ideal"
        tracks.add(track)
        expected = [f"{compute_median_gap(name, track):.1f}" for name in names]
        assert re.findall(r"(\d+\.\d)%", gaps) == expected
    assert tracks == {"ideal", "unknown-density"}


def list_source_words(text: str) -> set[str]:
    """Return which kinds of sources a text names."""
    kinds = ("abstract", "summar", "first lines", "documentation")
    return {kind for kind in kinds if kind in text}


def test_paths_on_the_open_square_are_as_long_as_the_handbook_says() -> None:
    paths = [
        rate(name, "open-square").compute_median("path_length_m")
        for name in ("exploring-lloyd", "coverage-control-centralized", "coverage-control-decentralized")
    ]
    assert sorted(round(paths[0] / path) for path in paths[1:]) == [4, 5]
    assert "its robots move four to five times as far" in read_text(PAGE)


def test_the_table_of_sources_agrees_with_the_docstrings() -> None:
    table = PAGE.read_text(encoding="utf-8").split("### Sources")[1].partition("Two recent methods")[0]
    listed = []
    for line in table.splitlines():
        if not line.startswith("| `"):
            continue
        names, sources = line.strip("| ").split(" | ")
        for name in re.findall(r"`([a-z-]+)`", names):
            listed.append(name)
            if sources == "our own work" or "Renzaglia" in sources or name in COVERAGE_CONTROL_FILES:
                continue
            docstring = " ".join((CONTROLLERS[name].__doc__ or "").split())
            passage = re.search(r"We (had only|did not have) .*", docstring)
            assert passage is not None, name
            assert list_source_words(sources) == list_source_words(passage[0]), name
            assert ("general knowledge" in sources) == (passage[1] == "did not have"), name
    assert sorted(listed) == sorted([*CONTROLLERS, "learned", *COVERAGE_CONTROL_FILES])


def test_values_of_rapf_with_one_robot_agree_with_the_entry() -> None:
    rating = rate("rapf", "one-robot")
    values = f"{rating.gap.estimate:.1%}, {rating.compute_median('path_length_m'):.1f} m"
    assert f"(`rapf`: {values})" in PAGE.read_text(encoding="utf-8")


def test_the_goals_in_the_handbook_are_the_thresholds_of_the_study() -> None:
    section = PAGE.read_text(encoding="utf-8").split("## The goals of atlas")[1]
    expected = {}
    for row in section.splitlines():
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        if len(cells) == 4:
            expected[cells[0]] = cells[1]
    assert expected["median gap, six robots, 71 maps, 60 s"] == f"{100 * MAX_GAP:g}%"
    assert f"maps with a median gap above {100 * MAX_MAP_GAP:g}%" in expected
    for other in ("rapf", "lloyd"):
        margin = round(100 * (NEVER_WORSE - 1))
        assert f"maps with a median cost more than {margin}% above that of `{other}`" in expected
    assert expected["runs with contacts"] == "0 of 142"
    assert expected["settled after 60 s"] == f"{100 * MIN_AT_REST:g}%"
    assert expected["median settling time"] == f"{MAX_REST_TIME_S:g} s"
    assert expected["the same with 50 robots"] == f"{MAX_STEP_RATIO:g}"
    assert expected["200 robots in real time"] == "1 s per second"
    families = f"{', '.join(UNSEEN[:-1])} and {UNSEEN[-1]}"
    sentence = f"On generated {families}, the study allows contacts in at most {100 * RARELY:g}% of the runs"
    assert sentence in " ".join(section.split())


MAX_PATH_RATIO = 1.2
"""Goal for the mean path length of `atlas`, relative to that of `oracle`."""


def judge(text: str, *, is_met: bool) -> str:
    """Return a cell with a measured value and whether it meets its goal."""
    return f"{text}, {'met' if is_met else 'missed'}"


def build_goal_cells(controller: str) -> dict[str, str]:
    """Return the cells of a controller in the first table of goals by the first cells of the rows."""
    rating = rate(controller, "ideal")
    gap, lossy_gap, noisy_gap, large_gap = (
        compute_median_gap(controller, track) for track in ("ideal", "lossy", "noisy", "large-team")
    )
    above = sum(value > MAX_MAP_GAP for value in compute_map_medians(controller, "ideal").values())
    contacts = sum(row["contacts"] > 0 for row in rating.rows)
    settled, time = rating.compute_rest()
    assert time is not None
    path_length, oracle_length = (
        np.mean([row["path_length_m"] for row in read_rows(name, "ideal")]) for name in (controller, "oracle")
    )
    ratio = path_length / oracle_length
    cells = {
        "median gap, six robots, 71 maps, 60 s": judge(f"{gap:.2f}%", is_met=gap <= 100.0 * MAX_GAP),
        "maps with a median gap above 5%": judge(f"{above}", is_met=above == 0),
        "runs with contacts": judge(f"{contacts}", is_met=contacts == 0),
        "settled after 60 s": judge(f"{settled:.0%}", is_met=settled >= MIN_AT_REST),
        "median settling time": judge(f"{time:.0f} s", is_met=time <= MAX_REST_TIME_S),
        f"mean path length relative to `oracle` ({oracle_length:.1f} m)": judge(
            f"{ratio:.1f} ({path_length:.1f} m)", is_met=bool(ratio <= MAX_PATH_RATIO)
        ),
        "median gap with message loss and latency": judge(f"{lossy_gap:.1f}%", is_met=lossy_gap <= gap),
        "median gap with localization noise of 0.1 m": judge(f"{noisy_gap:.1f}%", is_met=noisy_gap <= gap),
        "median gap of 24 robots on 20 x 20 m": judge(
            f"{large_gap:.1f}%", is_met=large_gap <= 100.0 * MAX_GAP
        ),
    }
    for other in ("rapf", "lloyd"):
        count = count_above(controller, other, "ideal")
        name = f"maps with a median cost more than 1% above that of `{other}`"
        cells[name] = judge(f"{count}", is_met=count == 0)
    return cells


def list_goals() -> dict[str, str]:
    """Return the goals in the first table by the first cells of the rows."""
    map_count = len(compute_map_medians("atlas", "ideal"))
    run_count = len(read_rows("atlas", "ideal"))
    oracle_length = np.mean([row["path_length_m"] for row in read_rows("oracle", "ideal")])
    return {
        "median gap, six robots, 71 maps, 60 s": f"{MAX_GAP:.0%}",
        "maps with a median gap above 5%": f"0 of {map_count}",
        "maps with a median cost more than 1% above that of `rapf`": f"0 of {map_count}",
        "maps with a median cost more than 1% above that of `lloyd`": f"0 of {map_count}",
        "runs with contacts": f"0 of {run_count}",
        "settled after 60 s": f"{MIN_AT_REST:.0%}",
        "median settling time": f"{MAX_REST_TIME_S:g} s",
        f"mean path length relative to `oracle` ({oracle_length:.1f} m)": f"at most {MAX_PATH_RATIO:g}",
        "median gap with message loss and latency": "as in the first row",
        "median gap with localization noise of 0.1 m": "as in the first row",
        "median gap of 24 robots on 20 x 20 m": f"{MAX_GAP:.0%}",
    }


def test_the_first_table_of_goals_agrees_with_the_entries() -> None:
    section = PAGE.read_text(encoding="utf-8").split("## The goals of atlas")[1].partition("After 120 s")[0]
    table = {}
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| ") and cells[0] != "measure":
            table[cells[0]] = cells[1:]
    maps = compute_map_medians("atlas", "short-range")
    count = len(maps) - count_above("atlas", "atlas-shared", "short-range")
    cell = judge(f"{count}", is_met=count == len(maps))
    measure = "communication range 3 m: maps with a cost at most 1% above that of `atlas-shared`"
    assert table.pop(measure) == [f"{len(maps)} of {len(maps)}", cell, ""]
    columns = [build_goal_cells(controller) for controller in ("atlas", "atlas-shared")]
    goals = list_goals()
    assert table == {name: [goals[name], *(column[name] for column in columns)] for name in columns[0]}


def test_path_lengths_on_large_plans_agree_with_the_entries() -> None:
    ranges = []
    for controller in ("atlas", "atlas-shared"):
        ratios = [
            np.mean([row["path_length_m"] for row in read_rows(controller, track)])
            / np.mean([row["path_length_m"] for row in read_rows("oracle", track)])
            for track in suite.RANKED_TRACKS["plans"]
        ]
        ranges.append(f"{min(ratios):.1f} to {max(ratios):.1f} times")
    text = read_text(PAGE)
    assert (
        f"{ranges[0]} as long as those of `oracle` with `atlas`, and {ranges[1]} with `atlas-shared`" in text
    )


def test_unfinished_runs_of_frontier_median_agree_with_the_entries() -> None:
    text = read_text(PAGE)
    ideal_rows = read_rows("frontier-median", "ideal")
    settled = [row["gap"] for row in ideal_rows if row["settled_at_s"] is not None]
    moving = [row["gap"] for row in ideal_rows if row["settled_at_s"] is None]
    assert (
        f"its median gap is {np.median(settled):.1%} in the {len(settled)} runs that have settled after "
        f"60 s, and {np.median(moving):.1%} in the other {len(moving)}"
    ) in text
    counts = []
    for track in ("one-robot", "plans-small"):
        rows = read_rows("frontier-median", track)
        gaps = [row["gap"] for row in rows if row["settled_at_s"] is None]
        counts.append((len(gaps), len(rows), np.median(gaps)))
    (one, one_total, one_gap), (small, small_total, small_gap) = counts
    assert (
        f"{one} of {one_total} runs have not settled after 60 s ({one_gap:.1%}), "
        f"and on Plans small {small} of {small_total} after 240 s ({small_gap:.1%})"
    ) in text
    result = read_entry("frontier-median")
    rapf = read_entry("rapf")
    core_rows = [row for row in result["rows"] if row["track"] in suite.RANKED_TRACKS["core"]]
    large_gaps = [row for row in core_rows if row["gap"] > 0.2]
    unsettled_count = sum(row["settled_at_s"] is None for row in large_gaps)
    assert (
        f"Of the {len(core_rows)} runs of its [complete entry](benchmark.md#a-submission), "
        f"{len(large_gaps)} have a gap above 20%, and {unsettled_count} of these have not settled."
    ) in text
    rows_by_run = {(row["track"], get_run_key(row)): row for row in result["rows"]}
    anomalies = find_anomalies(result, rapf)
    for anomaly in anomalies:
        assert rows_by_run[anomaly.track, (anomaly.map, anomaly.seed)]["settled_at_s"] is None
    assert (
        f'lists {len(anomalies)} of its runs under "Runs to look into". None of these has settled.'
    ) in text


def test_gaps_of_frontier_median_on_large_plans_agree_with_the_entries() -> None:
    gaps = []
    for track in ("plans-medium", "plans-large", "plans-crowd"):
        rows = read_rows("frontier-median", track)
        gaps.append(f"{np.median([row['gap'] for row in rows]):.1%}")
        assert all(row["settled_at_s"] is None for row in rows)
    first, second, third = gaps
    assert f"its gaps are {first}, {second} and {third}, and no team has settled" in read_text(PAGE)


def test_references_of_large_teams_are_described() -> None:
    tracks = [suite.TRACKS[track] for track in ("plans-large", "plans-crowd")]
    references = {
        name: suite.load_frozen_maps()[name]["references"][str(track.robots)]
        for track in tracks
        for name in track.maps
    }
    max_saving = max(
        1.0 - reference["lower_bound_m"] / reference["mean_distance_m"] for reference in references.values()
    )
    worst = min(references, key=lambda name: references[name]["agreement"])
    found = round(RESTARTS * references[worst]["agreement"])
    text = read_text(PAGE)
    assert f"no placement costs {math.ceil(1000 * max_saving) / 10}% less" in text
    assert f"on {worst}, only {found} of {RESTARTS}." in text


def test_mean_gaps_with_an_unknown_density_agree_with_the_entries() -> None:
    means = {
        name: np.mean([row["gap"] for row in read_rows(name, "unknown-density")])
        for name in ("exploring-lloyd", "atlas-shared")
    }
    worst = max(row["gap"] for row in read_rows("atlas-shared", "unknown-density"))
    text = read_text(PAGE)
    assert f"The mean gap of `exploring-lloyd` is therefore {means['exploring-lloyd']:.0%}" in text
    assert f"has a mean gap of {means['atlas-shared']:.0%}, and of {worst:.0%} at most" in text


def test_the_tracks_on_which_rapf_is_better_than_the_learned_policy_are_named() -> None:
    worse = []
    for track in suite.TRACKS:
        if not read_rows("learned", track):
            continue
        if compute_median_gap("learned", track) >= compute_median_gap("rapf", track):
            worse.append(suite.format_heading(track))
    assert f"a smaller gap than `rapf` on all tracks except {' and '.join(worse)}, but" in read_text(PAGE)


def test_the_table_of_coverage_control_has_the_rows_of_its_command() -> None:
    script = runpy.run_path(str(Path(__file__).parents[2] / "bench/bench_coverage_control.py"))
    text = PAGE.read_text(encoding="utf-8")
    _, head, body = text.partition(script["HEAD"] + "\n")
    assert head
    rows = []
    for line in body.partition("\n\n")[0].splitlines():
        label, knowledge, mean, each = line.strip("| ").split(" | ")
        fractions = [float(value) for value in each.split(", ")]
        # The mean is that of values with more digits.
        assert abs(float(mean) - np.mean(fractions)) < 0.0101
        rows.append((label, knowledge, float(mean)))
    assert {label: knowledge for label, knowledge, _ in rows} == script["list_labels"]()
    assert [mean for _, _, mean in rows] == sorted(mean for _, _, mean in rows)


def test_the_tables_of_new_families_have_the_rows_of_their_command(monkeypatch: pytest.MonkeyPatch) -> None:
    bench_folder = Path(__file__).parents[2] / "bench"
    monkeypatch.syspath_prepend(bench_folder)
    script = runpy.run_path(str(bench_folder / "bench_new_families.py"))
    maps = script["build_maps"]()
    assert script["compute_hash"](maps) == script["MAPS_SHA256"]
    expected_rows = [
        (suite.format_heading(track), f"`{name}`")
        for track, name in product(script["TRACKS"], script["CONTROLLERS"])
    ]
    text = PAGE.read_text(encoding="utf-8")
    for head_name in ("RESULT_HEAD", "FAMILY_HEAD"):
        _, head, body = text.partition(script[head_name] + "\n")
        assert head
        rows = [line.strip("| ").split(" | ") for line in body.partition("\n\n")[0].splitlines()]
        # The page may leave out rows, but not change their order.
        labels = [(row[0], row[1]) for row in rows]
        assert labels
        assert labels == [label for label in expected_rows if label in labels]
        assert all(len(row) == head.splitlines()[0].count("|") - 1 for row in rows)
        if head_name == "RESULT_HEAD":
            assert all(row[3].endswith(f" of {len(maps)}") for row in rows)


def test_the_effect_of_the_factors_of_the_score_agrees_with_the_entries(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    results = [result for result in load_bundled_results() if result["entry"]["information"] != "whole map"]
    names = [result["entry"]["controller"] for result in results]
    core = [track for track in suite.TRACKS if suite.TRACKS[track].ranking == "core"]
    by_track = build_ratings(results)
    ranks: dict[str, list[int]] = {name: [] for name in names}
    for contact_factor, motion_factor in product((0.25, 0.5, 0.75, 1.0), repeat=2):
        monkeypatch.setattr(ratings, "CONTACT_FACTOR", contact_factor)
        monkeypatch.setattr(ratings, "MOTION_FACTOR", motion_factor)
        # On core tracks, the ratings are in the order of the results.
        scores = np.mean([[rating.score for rating in by_track[track]] for track in core], axis=0)
        for rank, k in enumerate(np.argsort(-scores), start=1):
            ranks[names[k]].append(rank)
    assert set(ranks["atlas-shared"]) == {1}
    text = read_text(BENCHMARK_PAGE)
    best, worst = min(ranks["atlas"]), max(ranks["atlas"])
    assert f"always `atlas-shared`, but the rank of `atlas` among them varies from {best} to {worst}" in text
    best, worst = min(ranks["learned"]), max(ranks["learned"])
    assert f"that of `learned`, whose robots never settle, from {best} to {worst}" in text
    contacts = {
        track: sum(row["contacts"] > 0 for row in read_rows("oracle", track)) for track in ("lossy", "noisy")
    }
    assert f"in {contacts['lossy']} of 30 runs on Lossy and in {contacts['noisy']} on Noisy" in text
    core_rows = [row for track in core for row in read_rows("oracle", track)]
    best_count = sum(row["gap"] <= 0.002 for row in core_rows)
    assert f"in {best_count} of {len(core_rows)} runs (gap of at most 0.2%)" in text


FAILURES_PAGE = Path(__file__).parents[3] / "app/handbook/where-controllers-fail.md"
FAILURES_OF_ATLAS = (
    ("ideal", "cave"),
    ("ideal", "offices-7005"),
    ("short-range", "mazes-7001"),
    ("short-range", "blocks-7003"),
    ("lossy", "cave"),
    ("failures", "plants-7003"),
    ("large-team", "large-caves-7001"),
)
CONTROLLERS_OF_FAILURES = ("atlas", "atlas-shared", "greedy-submodular", "rapf")
CONTROLLERS_OF_TUNNELS = ("atlas", "atlas-shared", "voronoi-graph", "geodesic-lloyd", "rapf")


def format_gap_and_path_length(controller: str, track: str, map_name: str) -> tuple[str, str]:
    """Return the median gap and path length of a controller on a map."""
    selected = [row for row in read_rows(controller, track) if row["map"] == map_name]
    gap = 100.0 * np.median([row["gap"] for row in selected])
    path_length = np.median([row["path_length_m"] for row in selected])
    return f"{gap:.1f}%", f"{path_length:.1f} m"


@pytest.mark.parametrize(("track", "map_name"), FAILURES_OF_ATLAS)
def test_failures_agree_with_the_entries(track: str, map_name: str) -> None:
    cells = (
        ", ".join(format_gap_and_path_length(controller, track, map_name))
        for controller in CONTROLLERS_OF_FAILURES
    )
    row = f"| {suite.format_heading(track)} | {map_name} | {' | '.join(cells)} |"
    assert f"{row}\n" in FAILURES_PAGE.read_text(encoding="utf-8")


def read_ideal_rows(controller: str) -> dict[tuple[str, int], dict[str, Any]]:
    """Return the rows of a controller on the track Ideal, by map and seed."""
    return {get_run_key(row): row for row in read_rows(controller, "ideal")}


def test_unsettled_runs_of_atlas_agree_with_the_entries() -> None:
    families = ("blocks", "offices", "plants")
    rows = [row for row in read_ideal_rows("atlas").values() if suite.FAMILY_OF[row["map"]] in families]
    count = sum(row["settled_at_s"] is None for row in rows)
    text = read_text(FAILURES_PAGE)
    assert f"{count} of {len(rows)} runs in the families blocks, offices and plants have not settled" in text


def test_paths_of_greedy_submodular_agree_with_the_entries() -> None:
    shared = read_ideal_rows("atlas-shared")
    count = 0
    for key, row in read_ideal_rows("greedy-submodular").items():
        is_shorter = row["path_length_m"] < shared[key]["path_length_m"]
        count += is_shorter and row["mean_distance_m"] <= 1.01 * shared[key]["mean_distance_m"]
    text = read_text(FAILURES_PAGE)
    expected = f"In {count} of {len(shared)} runs on the track Ideal, `greedy-submodular` has a shorter path"
    assert expected in text


def test_path_lengths_of_atlas_agree_with_the_entries() -> None:
    text = FAILURES_PAGE.read_text(encoding="utf-8")
    lengths = [rate(name, "ideal").compute_median("path_length_m") for name in ("atlas", "rapf")]
    assert f"on the track Ideal is {lengths[0]:.1f} m, and {lengths[1]:.1f} m with `rapf`" in text


@pytest.mark.parametrize("track", suite.RANKED_TRACKS["plans"])
def test_the_worst_large_plans_agree_with_the_entries(track: str) -> None:
    cells = []
    for controller in ("atlas", "atlas-shared"):
        gaps = compute_map_medians(controller, track)
        worst = max(gaps, key=lambda name: gaps[name])
        cells.append(f"{worst}: {gaps[worst]:.1%} ({compute_map_medians('rapf', track)[worst]:.1%})")
    row = f"| {suite.format_heading(track)} | {' | '.join(cells)} |"
    assert f"{row}\n" in FAILURES_PAGE.read_text(encoding="utf-8")


def find_tunnels(track: str) -> str:
    """Return the name of the network of tunnels of a track."""
    (name,) = (name for name in suite.TRACKS[track].maps if name.startswith("tunnels-"))
    return name


@pytest.mark.parametrize("track", PLAN_TRACKS)
def test_results_in_tunnels_agree_with_the_entries(track: str) -> None:
    map_name = find_tunnels(track)
    cells = [
        f"{suite.format_heading(track)}, {map_name}",
        f"{suite.TRACKS[track].robots} robots, {suite.TRACKS[track].duration:g} s",
    ]
    cells += [
        ", ".join(format_gap_and_path_length(controller, track, map_name))
        for controller in CONTROLLERS_OF_TUNNELS
    ]
    assert f"| {' | '.join(cells)} |\n" in FAILURES_PAGE.read_text(encoding="utf-8")


def test_statements_on_tunnels_agree_with_the_entries() -> None:
    small, medium, *_ = PLAN_TRACKS
    gap, path_length = format_gap_and_path_length("frontier-median", small, find_tunnels(small))
    text = read_text(FAILURES_PAGE)
    assert f"`frontier-median` reaches a gap of {gap}, with a path of {path_length}" in text
    gaps = {
        (controller, track): compute_map_medians(controller, track)[find_tunnels(track)]
        for controller, track in product(CONTROLLERS_OF_TUNNELS, PLAN_TRACKS)
    }
    medians = compute_map_medians("atlas", medium)
    assert max(medians, key=lambda name: medians[name]) == find_tunnels(medium)
    assert gaps["rapf", medium] < gaps["atlas", medium]
    paths = [
        compute_map_medians(name, medium, "path_length_m")[find_tunnels(medium)] for name in ("rapf", "atlas")
    ]
    assert 0.28 < paths[0] / paths[1] < 0.38
    for track in PLAN_TRACKS:
        best = min(CONTROLLERS_OF_TUNNELS, key=lambda name: gaps[name, track])
        assert best == "atlas-shared"
    for controller, track in product(("atlas", "atlas-shared"), PLAN_TRACKS):
        for row in read_rows(controller, track):
            if row["map"] == find_tunnels(track):
                settles = (controller, track) == ("atlas-shared", small)
                assert (row["settled_at_s"] is not None) == settles


def read_earlier_rows(correction: str, controller: str, track: str) -> list[dict[str, str]]:
    """Return the rows of a controller on a track before a correction of the benchmark.

    ``earlier_results.csv`` contains rows of entries of earlier versions: "messages" of those before robots
    shared maps by messages, "stake" of the last ones with ``stake`` = 0.004, "visits" of the last one in
    which robots of `frontier-median` assumed that those out of range had reached their targets, "reports" of
    the last one in which they did not report visits, and "looks" of the last ones in which robots did not
    look into space among walls.
    """
    with Path(__file__).with_name("earlier_results.csv").open(encoding="utf-8", newline="") as file:
        return [
            row
            for row in csv.DictReader(file)
            if (row["correction"], row["controller"], row["track"]) == (correction, controller, track)
        ]


def select_comparable_rows(
    correction: str, controller: str, track: str
) -> tuple[list[dict[str, str]], list[dict[str, Any]], set[str]]:
    """Return the earlier and current rows with the same cost, and the maps on which the cost has changed."""
    current_rows = {get_run_key(row): row for row in read_rows(controller, track)}
    pairs, changed_maps = [], set()
    for earlier in read_earlier_rows(correction, controller, track):
        current = current_rows[earlier["map"], int(earlier["seed"])]
        reference = float(earlier["mean_distance_m"]) / (1.0 + float(earlier["gap"]))
        if reference == pytest.approx(current["mean_distance_m"] / (1.0 + current["gap"]), rel=1e-5):
            pairs.append((earlier, current))
        else:
            changed_maps.add(earlier["map"])
    return [earlier for earlier, _ in pairs], [current for _, current in pairs], changed_maps


def list_values(rows: Sequence[Mapping[str, Any]], metric: str) -> FloatArray:
    """Return a metric of rows, which may be texts."""
    return np.array([float(row[metric]) for row in rows])


def format_gap_changes(before: FloatArray, after: FloatArray) -> list[str]:
    """Return the changes of the median, mean and worst gap."""
    return [f"{measure(before):.1%} → {measure(after):.1%}" for measure in (np.median, np.mean, np.max)]


@pytest.mark.parametrize(
    "controller", ["atlas-shared", "greedy-submodular", "frontier-median", "voronoi-graph"]
)
def test_changes_by_messages_agree_with_the_entries(controller: str) -> None:
    before, after, changed_maps = select_comparable_rows("messages", controller, "lossy")
    gaps_before = list_values(before, "gap")
    gaps_after = list_values(after, "gap")
    cells = format_gap_changes(gaps_before, gaps_after)
    counts = f"{(gaps_before > 0.05).sum()} → {(gaps_after > 0.05).sum()}"
    row = f"| `{controller}` | {' | '.join(cells)} | {counts} |"
    assert f"{row}\n" in BENCHMARK_PAGE.read_text(encoding="utf-8")
    assert gaps_after.mean() > gaps_before.mean()
    text = read_text(BENCHMARK_PAGE)
    assert f"on {len(before)} of the {len(before) + len(changed_maps)} maps" in text
    assert f"On the other two, {' and '.join(sorted(changed_maps))}, narrow passages were closed" in text


def format_changes_on_track(correction: str, controller: str, track: str) -> list[str]:
    """Return the changes of the gap and of the median path length by a correction on a whole track."""
    before, after, changed_maps = select_comparable_rows(correction, controller, track)
    assert not changed_maps
    assert len(before) == len(read_rows(controller, track))
    path_before = np.median(list_values(before, "path_length_m"))
    path_after = np.median(list_values(after, "path_length_m"))
    gap_changes = format_gap_changes(list_values(before, "gap"), list_values(after, "gap"))
    return [*gap_changes, f"{path_before:.1f} → {path_after:.1f} m"]


@pytest.mark.parametrize("controller", ["atlas", "atlas-shared"])
@pytest.mark.parametrize("track", ["ideal", "short-range", "large-team"])
def test_changes_by_the_gain_stake_agree_with_the_entries(track: str, controller: str) -> None:
    cells = format_changes_on_track("stake", controller, track)
    row = f"| {suite.format_heading(track)} | `{controller}` | {' | '.join(cells)} |"
    assert f"{row}\n" in BENCHMARK_PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("track", [*suite.RANKED_TRACKS["core"], *PLAN_TRACKS])
def test_changes_of_frontier_median_agree_with_the_entries(track: str) -> None:
    cells = format_changes_on_track("visits", "frontier-median", track)
    row = f"| {suite.format_heading(track)} | {' | '.join(cells)} |"
    assert f"{row}\n" in BENCHMARK_PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("track", ["short-range", "lossy", "plans-medium", "plans-large", "plans-crowd"])
def test_changes_by_reports_of_visits_agree_with_the_entries(track: str) -> None:
    cells = format_changes_on_track("reports", "frontier-median", track)
    row = f"| {suite.format_heading(track)} | {' | '.join(cells)} |"
    page = BENCHMARK_PAGE.read_text(encoding="utf-8")
    _, _, rest = page.partition("### Reports of visits before and after\n")
    section, _, _ = rest.partition("\n#")
    assert f"{row}\n" in section


def read_gaps_by_reports(track: str) -> dict[str, tuple[float, float]]:
    """Return the gaps of `frontier-median` on each map of a track, without and with reports of visits."""
    rows_before, rows_after, _ = select_comparable_rows("reports", "frontier-median", track)
    gaps = {}
    for before, after in zip(rows_before, rows_after, strict=True):
        gaps[after["map"]] = (round(float(before["gap"]), 5), round(after["gap"], 5))
    return gaps


def test_gaps_on_single_maps_with_reports_of_visits_agree_with_the_entries() -> None:
    text = read_text(BENCHMARK_PAGE)
    gaps = read_gaps_by_reports("plans-medium")
    smaller = [name for name, (before, after) in gaps.items() if after < before]
    larger = [name for name, (before, after) in gaps.items() if after > before]
    assert smaller == ["office-floors-7002", "wards-7002", "museums-7002"]
    assert larger == ["depots-7002", "schools-7002"]
    before, after = np.array([gaps[name] for name in smaller]).T
    assert (
        f"on {smaller[0]}, {smaller[1]} and {smaller[2]} from {before[0]:.0%}, {before[1]:.0%} and "
        f"{before[2]:.0%} to {after[0]:.0%}, {after[1]:.0%} and {after[2]:.0%}."
    ) in text
    before, after = np.array([gaps[name] for name in larger]).T
    assert (
        f"They grow on {larger[0]} and {larger[1]}, from {before[0]:.0%} to {after[0]:.0%} and from "
        f"{before[1]:.0%} to {after[1]:.0%}."
    ) in text
    limited = [
        gaps for track in ("plans-large", "plans-crowd") for gaps in read_gaps_by_reports(track).values()
    ]
    larger_count = sum(after > before for before, after in limited)
    assert f"{larger_count} of {len(limited)} gaps are larger with reports" in text


@pytest.mark.parametrize("controller", ["atlas", "atlas-shared"])
@pytest.mark.parametrize("track", [*suite.RANKED_TRACKS["core"], *PLAN_TRACKS])
def test_changes_by_looks_among_walls_agree_with_the_entries(track: str, controller: str) -> None:
    cells = format_changes_on_track("looks", controller, track)
    row = f"| {suite.format_heading(track)} | `{controller}` | {' | '.join(cells)} |"
    assert f"{row}\n" in BENCHMARK_PAGE.read_text(encoding="utf-8")


def test_results_of_the_trained_policy_agree_with_the_entries() -> None:
    text = read_text(PAGE.parent / "learning.md")
    rows = read_rows("learned", "ideal")
    rating = rate("learned", "ideal")
    assert f"the median gap of `learned` is {compute_median_gap('learned', 'ideal'):.1f}%" in text
    assert sum(row["contacts"] for row in rows) == 0
    assert rating.compute_rest()[0] == 0.0
    assert f"the median path length is {rating.compute_median('path_length_m'):.1f} m" in text
    assert f"have a median gap of {compute_median_gap('learned', 'large-team'):.1f}%" in text
    assert f"compared with {compute_median_gap('rapf', 'large-team'):.1f}% for RAPF" in text
    medians = {}
    for family, maps in suite.FAMILIES.items():
        medians[family] = 100.0 * np.median([row["gap"] for row in rows if row["map"] in maps])
    assert f"the median is {medians['bundled']:.1f}%" in text
    assert f"{medians['rooms']:.1f}% on the seven maps of the family `rooms`" in text
    assert f"and {medians['offices']:.1f}% on those of `offices`" in text
