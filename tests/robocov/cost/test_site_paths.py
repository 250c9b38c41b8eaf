from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cost_cases import OFFICE
from hypothesis import example, given, settings
from hypothesis import strategies as st

from robocov.cost import CoverageCost
from robocov.environment import Environment

SQUARE = Environment("square", ((0, 0), (1, 0), (1, 1), (0, 1)))


def checked_owners(side, places):
    """Return the owner of each site, having checked that it is the first of the robots nearest to it."""
    cost = CoverageCost(SQUARE, side)
    result = cost(np.asarray(places, dtype=float))
    sites, robots = (cost.geodesics.grid.snap(points) for points in (cost.points, result.positions))
    table = ((sites[:, None] - robots) ** 2).sum(axis=2)
    np.testing.assert_array_equal(result.owner, table.argmin(axis=1))
    np.testing.assert_array_equal(result.distances, np.sqrt(table.min(axis=1)) * cost.geodesics.grid.unit)
    return result.owner


coarse = st.tuples(st.integers(0, 8), st.integers(0, 8)).map(lambda place: np.array(place) / 8)
fine = st.tuples(st.floats(0, 1), st.floats(0, 1))
crowd = st.tuples(st.floats(0, 1e-9), st.floats(0, 1e-9)).map(lambda place: np.array(place) + 0.4)


@settings(max_examples=250)
@given(st.integers(1, 33), st.lists(st.one_of(coarse, fine, crowd), min_size=1, max_size=30))
def test_the_first_of_the_nearest_robots_owns_a_site(side, places):
    checked_owners(side, places)


@settings(max_examples=60)
@given(
    st.integers(2, 24), st.lists(st.tuples(st.integers(0, 23), st.integers(0, 23)), min_size=1, max_size=20)
)
@example(15, [(1, 3), (4, 7), (9, 2), (4, 8), (1, 14)])
def test_owners_are_exact_for_robots_at_sites(side, cells):
    places = (np.array(cells) % side + 0.5) / side
    checked_owners(side, places)


@pytest.mark.parametrize("count", [2, 8, 9, 30])
@pytest.mark.parametrize("shape", ["row", "column", "slant", "circle", "one place", "two places"])
def test_owners_are_exact_for_degenerate_teams(count, shape):
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
    checked_owners(40, places)


@pytest.mark.parametrize("count", [1, 4, 12])
def test_the_first_of_coincident_robots_owns_their_sites(count):
    places = np.random.default_rng(3).random((count, 2))
    alone = checked_owners(16, places)
    doubled = checked_owners(16, np.concatenate([places, places]))
    np.testing.assert_array_equal(doubled, alone)


@pytest.mark.parametrize("count", [50, 1000])
def test_owners_are_exact_for_many_robots(count):
    rng = np.random.default_rng(count)
    checked_owners(60, rng.random((count, 2)))


def test_the_first_of_coincident_robots_owns_sites_around_corners():
    cost = CoverageCost(OFFICE, 24)
    places = cost.points[np.random.default_rng(3).choice(len(cost.points), 5)]
    alone, doubled = cost(places), cost(np.concatenate([places, places]))
    assert (alone.first_corner >= 0).any()
    for name in ("owner", "distances", "first_corner", "last_corner"):
        np.testing.assert_array_equal(getattr(doubled, name), getattr(alone, name))


SAME_BITS = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
from cost_cases import OFFICE
from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment
density = Gaussians((Gaussian((3.0, 2.0), 1.0, 2.0),))
office = Environment("office", OFFICE.boundary, OFFICE.obstacles, density=density)
cost = CoverageCost(office, 12)
for speeds in (None, np.array([0.3, 0.7, 0.3])):
    result = cost(np.array([[1.0, 1.0], [10.0, 1.0], [5.5, 7.3]]), speeds)
    numbers = result.value, result.mean_distance, *result.distances, *result.gradient.ravel(), *result.owner
    print(*(float(number).hex() for number in numbers))
"""


@pytest.mark.slow
def test_bits_are_the_same_without_the_compiler_and_on_any_processor():
    script = SAME_BITS.format(folder=str(Path(__file__).parents[1]))
    settings = (
        {},
        {"NUMBA_DISABLE_JIT": "1"},
        {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "OPENBLAS_CORETYPE": "Prescott"},
    )
    answers = [
        subprocess.run(
            [sys.executable, "-c", script], env=os.environ | each, capture_output=True, text=True, check=True
        ).stdout
        for each in settings
    ]
    assert len(answers[0].split()) > 100
    assert answers[1] == answers[0]
    assert answers[2] == answers[0]
