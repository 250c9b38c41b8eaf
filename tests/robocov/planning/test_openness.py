"""Openness of unknown cells: random walks, insides of obstacles, and the prior."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.planning.discovered_map import FREE, UNKNOWN, WALL
from robocov.planning.openness import PRIOR_OPENNESS, WALK_LENGTH_BLOCKS, compute_openness


def build_inside(state: np.ndarray) -> np.ndarray:
    """Return a mask by which no cell is outside the region."""
    return np.zeros(state.shape, dtype=bool)


def simulate_walks(state: np.ndarray, row: int, column: int, seed: int, count: int = 4000) -> float:
    """Return the fraction of random walks that come to a free cell first.

    Borders of known cells are half a step away: a walk next to one goes there twice as often.
    """
    rng = np.random.default_rng(seed)
    rows, columns = state.shape
    free_ends = 0
    for _ in range(count):
        r = row
        c = column
        while state[r, c] == UNKNOWN:
            neighbors = [(r, c + 1), (r + 1, c), (r, c - 1), (r - 1, c)]
            neighbors = [(i, j) for i, j in neighbors if 0 <= i < rows and 0 <= j < columns]
            weight = np.array([1.0 if state[cell] == UNKNOWN else 2.0 for cell in neighbors])
            r, c = neighbors[int(rng.choice(len(neighbors), p=weight / weight.sum()))]
        free_ends += state[r, c] == FREE
    return free_ends / count


@pytest.mark.slow
def test_openness_is_the_probability_of_a_random_walk() -> None:
    state = np.full((7, 9), UNKNOWN, dtype=np.uint8)
    state[0] = WALL
    state[:, 0] = WALL
    state[6, 4:] = FREE
    state[3, 5:7] = WALL
    openness = compute_openness(state, build_inside(state))
    for row, column in ((5, 2), (2, 2), (4, 7), (1, 7)):
        assert openness[row, column] == pytest.approx(simulate_walks(state, row, column, row), abs=0.03)


def test_insides_of_obstacles_are_closed_and_shadows_are_open() -> None:
    state = np.full((40, 60), FREE, dtype=np.uint8)
    # An obstacle that has been seen from all sides.
    state[5:15, 5:15] = WALL
    state[6:14, 6:14] = UNKNOWN
    # Everything behind a wall.
    state[:, 40] = WALL
    state[:, 41:] = UNKNOWN
    # The shadow of an obstacle.
    state[25:35, 5:15] = UNKNOWN
    state[25, 5:15] = WALL
    openness = compute_openness(state, build_inside(state))
    assert openness[6:14, 6:14].max() < 0.01
    assert openness[:, 41:44].max() < 0.2
    assert openness[30:34, 7:13].min() > 0.7
    assert (openness[state != UNKNOWN] == 0.0).all()


def test_cells_far_from_everything_known_have_the_prior_openness() -> None:
    unknown = np.zeros((300, 400), dtype=np.uint8)
    np.testing.assert_allclose(compute_openness(unknown, build_inside(unknown)), PRIOR_OPENNESS)
    is_outside = build_inside(unknown)
    is_outside[:, 350:] = True
    openness = compute_openness(unknown, is_outside)
    np.testing.assert_allclose(openness[:, :350], PRIOR_OPENNESS)
    assert (openness[:, 350:] == 0.0).all()
    corridor = np.zeros((1, 1000), dtype=np.uint8)
    corridor[0, 0] = WALL
    openness = compute_openness(corridor, build_inside(corridor))[0]
    assert openness[-1] == pytest.approx(PRIOR_OPENNESS, abs=1e-6)
    near = PRIOR_OPENNESS * (1.0 - np.exp(-1.0))
    assert openness[round(WALK_LENGTH_BLOCKS)] == pytest.approx(near, abs=0.02)


@settings(max_examples=count_examples(40))
@given(seed=st.integers(0, 10_000), rows=st.integers(1, 60), columns=st.integers(1, 60))
def test_openness_is_a_probability_and_does_not_depend_on_the_orientation(
    seed: int, rows: int, columns: int
) -> None:
    rng = np.random.default_rng(seed)
    state = rng.choice(np.array([0, 0, 0, 1, 3], dtype=np.uint8), size=(rows, columns))
    is_outside = rng.random((rows, columns)) < 0.1
    openness = compute_openness(state, is_outside)
    assert ((openness >= 0.0) & (openness <= 1.0)).all()
    assert (openness[(state != UNKNOWN) | is_outside] == 0.0).all()
    if rows * columns <= 1000:  # Every cell is a block of its own.
        np.testing.assert_allclose(compute_openness(state.T, is_outside.T).T, openness, atol=1e-9)
