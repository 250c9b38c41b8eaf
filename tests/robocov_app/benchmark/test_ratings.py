"""Ratings: scores, intervals, failed runs, and the tables that the command prints."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from benchmark_results import build_result, select_bundled_results
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.benchmark import ratings, suite
from robocov_app.commands.benchmark import _EXPLANATIONS, _print_ratings


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


def test_all_columns_of_the_printed_ratings_are_explained(capsys: pytest.CaptureFixture[str]) -> None:
    (result,) = select_bundled_results("rapf")
    _print_ratings(result, Path("benchmark"))
    printed = capsys.readouterr().out
    for explanation in _EXPLANATIONS.values():
        assert explanation in printed
    (_, *titles), _ = ratings.build_summary_table(result)
    assert set(titles) == {"Runs", *_EXPLANATIONS}
