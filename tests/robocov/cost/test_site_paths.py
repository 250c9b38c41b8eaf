"""Owners and distances of sites, with many robots, equal distances, and around corners."""

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
from property_examples import count_examples

from robocov.cost import CoverageCost
from robocov.environment import Environment

SQUARE = Environment("square", ((0, 0), (1, 0), (1, 1), (0, 1)))


def compute_owners(side, positions):
    """Return the owner of each site, and check that it is the first of the robots nearest to it."""
    cost = CoverageCost(SQUARE, side)
    result = cost(np.asarray(positions, dtype=float))
    grid = cost.geodesics.grid
    offsets = grid.snap(cost.points)[:, None] - grid.snap(result.positions)
    squares = (offsets**2).sum(axis=2)
    np.testing.assert_array_equal(result.owners, squares.argmin(axis=1))
    np.testing.assert_array_equal(result.distances, np.sqrt(squares.min(axis=1)) * grid.spacing)
    return result.owners


lattice_points = st.tuples(st.integers(0, 8), st.integers(0, 8)).map(lambda point: np.array(point) / 8)
any_points = st.tuples(st.floats(0, 1), st.floats(0, 1))
crowded_points = st.tuples(st.floats(0, 1e-9), st.floats(0, 1e-9)).map(lambda point: np.array(point) + 0.4)
points = st.one_of(lattice_points, any_points, crowded_points)


@settings(max_examples=count_examples(250))
@given(st.integers(1, 33), st.lists(points, min_size=1, max_size=30))
def test_the_first_of_the_nearest_robots_owns_a_site(side, positions):
    compute_owners(side, positions)


@settings(max_examples=count_examples(60))
@given(
    st.integers(2, 24), st.lists(st.tuples(st.integers(0, 23), st.integers(0, 23)), min_size=1, max_size=20)
)
@example(15, [(1, 3), (4, 7), (9, 2), (4, 8), (1, 14)])
def test_owners_are_exact_for_robots_at_sites(side, cells):
    compute_owners(side, (np.array(cells) % side + 0.5) / side)


@pytest.mark.parametrize("count", [2, 8, 9, 30])
@pytest.mark.parametrize("shape", ["row", "column", "diagonal", "circle", "one point", "two points"])
def test_owners_are_exact_for_degenerate_teams(count, shape):
    angle = 2.0 * np.pi * np.arange(count) / count
    fraction = np.arange(count) / count
    is_even = np.arange(count) % 2 == 0
    positions = {
        "row": np.column_stack([fraction, np.full(count, 0.3)]),
        "column": np.column_stack([np.full(count, 0.3), fraction]),
        "diagonal": np.column_stack([fraction, 0.1 + 0.7 * fraction]),
        "circle": 0.5 + 0.4 * np.column_stack([np.cos(angle), np.sin(angle)]),
        "one point": np.full((count, 2), 0.6),
        "two points": np.where(is_even[:, None], 0.2, 0.7) * np.ones(2),
    }
    compute_owners(40, positions[shape])


@pytest.mark.parametrize("count", [1, 4, 12])
def test_the_first_of_coincident_robots_owns_their_sites(count):
    positions = np.random.default_rng(3).random((count, 2))
    owners = compute_owners(16, positions)
    owners_of_doubled_team = compute_owners(16, np.concatenate([positions, positions]))
    np.testing.assert_array_equal(owners_of_doubled_team, owners)


@pytest.mark.parametrize("count", [50, 1000])
def test_owners_are_exact_for_many_robots(count):
    rng = np.random.default_rng(count)
    compute_owners(60, rng.random((count, 2)))


def test_the_first_of_coincident_robots_owns_sites_around_corners():
    cost = CoverageCost(OFFICE, 24)
    positions = cost.points[np.random.default_rng(3).choice(len(cost.points), 5)]
    result = cost(positions)
    doubled = cost(np.concatenate([positions, positions]))
    assert (result.first_corners >= 0).any()
    for name in ("owners", "distances", "first_corners", "last_corners"):
        np.testing.assert_array_equal(getattr(doubled, name), getattr(result, name))


PRINT_RESULTS = """
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
    means = [result.value, result.mean_distance]
    numbers = [*means, *result.distances, *result.gradient.ravel(), *result.owners]
    print(*(float(number).hex() for number in numbers))
"""


@pytest.mark.slow
def test_bits_are_the_same_without_the_compiler():
    script = PRINT_RESULTS.format(folder=str(Path(__file__).parents[1]))
    outputs = []
    for variables in ({}, {"NUMBA_DISABLE_JIT": "1"}):
        process = subprocess.run(
            [sys.executable, "-c", script],
            env=os.environ | variables,
            capture_output=True,
            text=True,
            check=True,
        )
        outputs.append(process.stdout)
    assert len(outputs[0].split()) > 100
    assert outputs[1] == outputs[0]
