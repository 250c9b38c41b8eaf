from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from robocov.cost import scanlines
from robocov.cost.scanlines import Scanlines

SIDE = 2.0**48


def lattice(side, free):
    middles = np.rint((np.arange(side) + 0.5) / side * SIDE)
    return middles, Scanlines(middles, middles, free)


def excess(side, free, places):
    """Return how much farther any site is from the robot it is given to than from the nearest one."""
    middles, lines = lattice(side, free)
    x, y = np.rint(np.asarray(places, dtype=float).T * SIDE)
    runs = lines.nearest(x, y)
    assert (runs.length > 0).all()
    assert runs.begin.tolist() == [0, *np.cumsum(runs.length)[:-1].tolist()]
    row, column = np.nonzero(free)
    # a run stays in one row
    np.testing.assert_array_equal(row[runs.begin], row[runs.begin + runs.length - 1])
    robot = np.repeat(runs.robot, runs.length)
    table = np.hypot(middles[column, None] - x, middles[row, None] - y)
    assert len(robot) == len(table)
    return float((table[np.arange(len(robot)), robot] - table.min(axis=1)).max(initial=0.0)) / SIDE


def masks(side):
    def mask(seed):
        rng = np.random.default_rng(seed)
        free = rng.random((side, side)) < 0.7
        free[rng.integers(side), rng.integers(side)] = True
        return free

    return st.integers(0, 2**32).map(mask)


numbers = st.integers(0, 23)
coarse = st.tuples(st.integers(0, 8), st.integers(0, 8)).map(lambda place: np.array(place) / 8)
fine = st.tuples(st.floats(0, 1), st.floats(0, 1))
crowd = st.tuples(st.floats(0, 1e-9), st.floats(0, 1e-9)).map(lambda place: np.array(place) + 0.4)


@settings(max_examples=250)
@given(st.data(), st.integers(1, 33), st.lists(st.one_of(coarse, fine, crowd), min_size=1, max_size=30))
def test_each_site_is_given_to_a_nearest_robot(data, side, places):
    assert excess(side, data.draw(masks(side)), places) < 1e-14


@settings(max_examples=60)
@given(
    st.integers(2, 24), st.lists(st.tuples(st.integers(0, 23), st.integers(0, 23)), min_size=1, max_size=20)
)
@example(15, [(1, 3), (4, 7), (9, 2), (4, 8), (1, 14)])
def test_robots_on_sites_in_rows_and_columns(side, cells):
    places = (np.array(cells) % side + 0.5) / side
    assert excess(side, np.ones((side, side), dtype=bool), places) < 1e-14


@pytest.mark.parametrize("count", [2, 8, 9, 30])
@pytest.mark.parametrize("shape", ["row", "column", "slant", "circle", "one place", "two places"])
def test_degenerate_teams(count, shape):
    turn = 2.0 * np.pi * np.arange(count) / count
    step = np.arange(count) / count
    places = {
        "row": np.column_stack([step, np.full(count, 0.3)]),
        "column": np.column_stack([np.full(count, 0.3), step]),
        "slant": np.column_stack([step, 0.1 + 0.7 * step]),
        "circle": 0.5 + 0.4 * np.column_stack([np.cos(turn), np.sin(turn)]),
        "one place": np.full((count, 2), 0.6),
        "two places": np.where((np.arange(count) % 2 == 0)[:, None], 0.2, 0.7) * np.ones(2),
    }[shape]
    free = np.random.default_rng(0).random((40, 40)) < 0.8
    assert excess(40, free, places) < 1e-14


@pytest.mark.parametrize("count", [1, 4, 12])
def test_coinciding_robots_share_as_the_first_of_them(count):
    places = np.random.default_rng(3).random((count, 2))
    _, lines = lattice(16, np.ones((16, 16), dtype=bool))
    alone = lines.nearest(*np.rint(places.T * SIDE))
    doubled = lines.nearest(*np.rint(np.concatenate([places, places]).T * SIDE))
    np.testing.assert_array_equal(doubled.robot, alone.robot)


@pytest.mark.parametrize("count", [50, 1000])
def test_many_robots(count):
    rng = np.random.default_rng(count)
    assert excess(60, rng.random((60, 60)) < 0.8, rng.random((count, 2))) < 1e-14


def test_the_comparison_of_all_pairs_agrees(monkeypatch):
    rng = np.random.default_rng(5)
    free = rng.random((40, 40)) < 0.8
    _, lines = lattice(40, free)
    x, y = np.rint(rng.random((2, 30)) * SIDE)
    quick = lines.nearest(x, y)
    monkeypatch.setattr(scanlines, "_PAIRS", 700)
    monkeypatch.setattr(scanlines, "_neighbours", lambda x, y: None)
    slow = lines.nearest(x, y)
    for one, other in zip(quick, slow, strict=True):
        np.testing.assert_array_equal(one, other)
