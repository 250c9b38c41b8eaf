"""The handbook's numbers are those of the entries that the package contains."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robocov_app.benchmark import ratings, suite
from robocov_app.benchmark.ratings import Rating, build_ratings, get_run_key
from robocov_app.benchmark.results import ENTRIES, load_bundled_results, read_result
from robocov_app.replication.claims.thresholds import MAX_GAP, MAX_MAP_GAP, MIN_AT_REST

PAGE = Path(__file__).parents[3] / "app/handbook/controllers.md"


def format_row(controller: str, track: str) -> str:
    """Return the row of a controller's results on a track."""
    rows = [row for row in read_result(ENTRIES / f"{controller}.json.gz")["rows"] if row["track"] == track]
    assert not any("error" in row for row in rows)
    rating = Rating(controller, track, rows)
    medians = {}
    for name in suite.TRACKS[track].maps:
        gaps = [row["gap"] for row in rows if row["map"] == name and row["gap"] is not None]
        medians[name] = np.median(gaps)
    maps_above = sum(median > 0.05 for median in medians.values())
    runs_with_contacts = sum(row["contacts"] > 0 for row in rows)
    gap = 100.0 * rating.gap.estimate
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
PLAN_CONTROLLERS = {
    "plans-small": ("learned", "frontier-median", "greedy-submodular", "local-search"),
    "plans-medium": ("frontier-median", "greedy-submodular", "local-search", "exemplar"),
    "plans-large": ("frontier-median", "greedy-submodular", "voronoi-graph", "local-search", "exemplar"),
    "plans-crowd": ("voronoi-graph", "local-search", "exemplar"),
}
"""Controllers on each track of large plans, in addition to those on all of these tracks."""
PLAN_ROWS = [
    *product(("atlas", "atlas-shared", "geodesic-lloyd", "tangentbug", "rapf", "lloyd"), PLAN_TRACKS),
    *((controller, track) for track, names in PLAN_CONTROLLERS.items() for controller in names),
]
"""Controllers and tracks with runs on large plans."""
UNKNOWN_DENSITY_ROWS = [
    (controller, "unknown-density")
    for controller in ("exploring-lloyd", "atlas-shared", "rapf", "gp-ucb", "adaptive", "lloyd")
]
"""Controllers with runs on the track of an unknown density."""
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
    text = " ".join(PAGE.read_text(encoding="utf-8").split())
    gaps_of_atlas = []
    for track in PLAN_TRACKS:
        gaps = {
            name: Rating(name, track, rows).gap.estimate
            for name, all_rows in results.items()
            if (rows := [row for row in all_rows if row["track"] == track])
        }
        assert min(gaps, key=lambda name: gaps[name]) == "atlas"
        gaps_of_atlas.append(f"{100.0 * gaps['atlas']:.1f}%")
    *first_gaps, last_gap = gaps_of_atlas
    assert f"({', '.join(first_gaps)} and {last_gap})" in text
    contacts = [row["contacts"] > 0 for row in results["tangentbug"] if row["track"] in PLAN_TRACKS]
    assert f"its robots touch something in {sum(contacts)} of {len(contacts)} runs" in text


def test_gaps_in_the_first_table_agree_with_the_entries() -> None:
    first_table = PAGE.read_text(encoding="utf-8").partition("## List of controllers")[0]
    names = re.findall(r"`([a-z-]+)`", first_table)
    gaps = re.findall(r"(\d+\.\d)%", first_table)
    expected = []
    for name in names:
        rows = [row for row in read_result(ENTRIES / f"{name}.json.gz")["rows"] if row["track"] == "ideal"]
        expected.append(f"{100.0 * Rating(name, 'ideal', rows).gap.estimate:.1f}")
    assert gaps == expected


def test_values_of_rapf_with_one_robot_agree_with_the_entry() -> None:
    rows = [row for row in read_result(ENTRIES / "rapf.json.gz")["rows"] if row["track"] == "one-robot"]
    rating = Rating("rapf", "one-robot", rows)
    values = f"{rating.gap.estimate:.1%}, {rating.compute_median('path_length_m'):.1f} m"
    assert f"(`rapf`: {values})" in PAGE.read_text(encoding="utf-8")


def test_the_goals_in_the_handbook_are_the_thresholds_of_the_study() -> None:
    expected = {}
    for row in PAGE.read_text(encoding="utf-8").split("## The goals of atlas")[1].splitlines():
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        if len(cells) == 4:
            expected[cells[0]] = cells[1]
    assert expected["median gap, six robots, 71 maps, 60 s"] == f"{100 * MAX_GAP:g}%"
    assert f"median above {100 * MAX_MAP_GAP:g}% on no map" in expected
    assert expected["settled after 60 s"] == f"{100 * MIN_AT_REST:g}%"


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
    text = " ".join((PAGE.parent / "benchmark.md").read_text(encoding="utf-8").split())
    best, worst = min(ranks["atlas"]), max(ranks["atlas"])
    assert f"always `atlas-shared`, but the rank of `atlas` among them varies from {best} to {worst}" in text
    best, worst = min(ranks["learned"]), max(ranks["learned"])
    assert f"that of `learned`, whose robots never settle, from {best} to {worst}" in text
    oracle_rows = read_result(ENTRIES / "oracle.json.gz")["rows"]
    contacts = {
        track: sum(row["contacts"] > 0 for row in oracle_rows if row["track"] == track)
        for track in ("lossy", "noisy")
    }
    assert f"in {contacts['lossy']} of 30 runs on Lossy and in {contacts['noisy']} on Noisy" in text
    core_rows = [row for row in oracle_rows if row["track"] in core]
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
CONTROLLERS_OF_TUNNELS = (
    "frontier-median",
    "atlas-shared",
    "greedy-submodular",
    "geodesic-lloyd",
    "rapf",
    "lloyd",
)


def format_gap_and_path_length(controller: str, track: str, map_name: str) -> tuple[str, str]:
    """Return the median gap and path length of a controller on a map."""
    rows = read_result(ENTRIES / f"{controller}.json.gz")["rows"]
    selected = [row for row in rows if (row["track"], row["map"]) == (track, map_name)]
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
    rows = read_result(ENTRIES / f"{controller}.json.gz")["rows"]
    return {get_run_key(row): row for row in rows if row["track"] == "ideal"}


def test_unsettled_runs_of_atlas_agree_with_the_entries() -> None:
    families = ("blocks", "offices", "plants")
    rows = [row for row in read_ideal_rows("atlas").values() if suite.FAMILY_OF[row["map"]] in families]
    count = sum(row["settled_at_s"] is None for row in rows)
    text = " ".join(FAILURES_PAGE.read_text(encoding="utf-8").split())
    assert f"{count} of {len(rows)} runs in the families blocks, offices and plants have not settled" in text


def test_paths_of_greedy_submodular_agree_with_the_entries() -> None:
    shared = read_ideal_rows("atlas-shared")
    count = 0
    for key, row in read_ideal_rows("greedy-submodular").items():
        is_shorter = row["path_length_m"] < shared[key]["path_length_m"]
        count += is_shorter and row["mean_distance_m"] <= 1.01 * shared[key]["mean_distance_m"]
    text = " ".join(FAILURES_PAGE.read_text(encoding="utf-8").split())
    expected = f"In {count} of {len(shared)} runs on the track Ideal, `greedy-submodular` has a shorter path"
    assert expected in text


def test_path_lengths_of_atlas_agree_with_the_entries() -> None:
    atlas, rapf = (
        Rating(
            name,
            "ideal",
            [row for row in read_result(ENTRIES / f"{name}.json.gz")["rows"] if row["track"] == "ideal"],
        )
        for name in ("atlas", "rapf")
    )
    text = FAILURES_PAGE.read_text(encoding="utf-8")
    lengths = [rating.compute_median("path_length_m") for rating in (atlas, rapf)]
    assert f"on the track Ideal is {lengths[0]:.1f} m, and {lengths[1]:.1f} m with `rapf`" in text


@pytest.mark.parametrize("controller", CONTROLLERS_OF_TUNNELS)
def test_results_in_tunnels_agree_with_the_entries(controller: str) -> None:
    gap, path_length = format_gap_and_path_length(controller, "plans-small", "tunnels-7001")
    assert f"| `{controller}` | {gap} | {path_length} |\n" in FAILURES_PAGE.read_text(encoding="utf-8")


def compute_median_gap(controller: str, track: str) -> float:
    """Return the median gap of a controller on a track, %."""
    rows = [row for row in read_result(ENTRIES / f"{controller}.json.gz")["rows"] if row["track"] == track]
    return 100.0 * Rating(controller, track, rows).gap.estimate


def test_results_of_the_trained_policy_agree_with_the_entries() -> None:
    text = " ".join((PAGE.parent / "learning.md").read_text(encoding="utf-8").split())
    rows = [row for row in read_result(ENTRIES / "learned.json.gz")["rows"] if row["track"] == "ideal"]
    rating = Rating("learned", "ideal", rows)
    assert f"the median gap of `learned` is {100.0 * rating.gap.estimate:.1f}%" in text
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
