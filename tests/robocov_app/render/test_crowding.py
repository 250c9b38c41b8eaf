"""Sizes in a crowd, grids of panels, and one legend for several pictures."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robocov_app.look.legend import merge_legends
from robocov_app.render.crowding import (
    choose_width_factor,
    compute_nearest_distances,
    fit_mark_size,
    fit_radii,
)
from robocov_app.render.panel_grid import choose_column_count

points = arrays(np.float64, st.tuples(st.integers(1, 30), st.just(2)), elements=st.floats(0, 100, width=32))


def compute_all_distances(centers):
    distances = np.linalg.norm(centers[:, None] - centers[None], axis=2)
    np.fill_diagonal(distances, np.inf)
    return distances


@settings(deadline=None, max_examples=60)
@given(points)
def test_nearest_distances_are_those_of_all_pairs(centers):
    assert compute_nearest_distances(centers) == pytest.approx(
        compute_all_distances(centers).min(axis=1), abs=1e-9
    )


@settings(deadline=None, max_examples=100)
@given(points, st.floats(0, 2), st.floats(0.1, 3))
def test_discs_overlap_only_if_they_cannot_be_smaller(centers, true_radius, low):
    radii = fit_radii(centers, np.full(len(centers), true_radius), low, 9.0)
    smallest = max(true_radius, low)
    assert (radii >= smallest).all() and (radii <= max(9.0, true_radius)).all()
    free = radii > smallest
    overlaps = radii[:, None] + radii[None] > compute_all_distances(centers) + 1e-9
    assert not overlaps[free][:, free].any()


def test_a_single_mark_has_the_largest_size():
    assert fit_radii(np.zeros((1, 2)), np.ones(1), 2.0, 9.0).tolist() == [9.0]
    assert fit_mark_size(np.zeros((1, 2)), 2.0, 9.0) == fit_mark_size(np.empty((0, 2)), 2.0, 9.0) == 9.0


def test_many_lines_are_thinner_but_not_invisible():
    widths = [choose_width_factor(n) for n in (1, 6, 20, 40, 80, 200, 10000)]
    assert widths[:3] == [1.0, 1.0, 1.0]
    assert 1.0 > widths[3] > widths[4] == widths[-1] == 0.5


@pytest.mark.parametrize(
    ("count", "aspect", "columns"),
    [(1, 1.0, 1), (2, 1.0, 2), (2, 3.0, 1), (3, 1.4, 3), (3, 4.0, 1), (4, 1.5, 2), (4, 0.2, 4), (6, 1.2, 3)],
)
def test_panels_are_as_large_as_possible(count, aspect, columns):
    assert choose_column_count(count, aspect, (1920, 1080)) == columns


ENTRIES = st.lists(st.integers(0, 8), unique=True)


def merge(*legends: str) -> str:
    return "".join(merge_legends([list(legend) for legend in legends], str))


def test_entries_of_later_legends_keep_their_position() -> None:
    assert merge("abe", "abcde") == "abcde"
    assert merge("abcde", "ace") == "abcde"
    assert merge("bc", "abd") == "abdc"
    assert merge("", "ab", "ab") == "ab"


@given(st.lists(ENTRIES, max_size=4))
def test_each_entry_appears_once_and_the_first_legend_keeps_its_order(legends: list[list[int]]) -> None:
    merged = merge_legends(legends, lambda entry: entry)
    assert len(merged) == len(set(merged))
    assert set(merged) == {entry for legend in legends for entry in legend}
    if legends:
        assert [entry for entry in merged if entry in legends[0]] == legends[0]
