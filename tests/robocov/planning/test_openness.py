from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.planning.discovered import FREE, LONG, PRIOR, UNKNOWN, WALL, openness


def inside(state: np.ndarray) -> np.ndarray:
    return np.zeros(state.shape, dtype=bool)


def walks(state: np.ndarray, row: int, column: int, seed: int, count: int = 4000) -> float:
    """Return how many of some random walks come to a free cell first, the slow way.

    Borders of cells that are known are half a step away: who is beside one goes there twice as often.
    """
    rng = np.random.default_rng(seed)
    found = 0
    for _ in range(count):
        r, c = row, column
        while state[r, c] == UNKNOWN:
            beside = [(r + dr, c + dc) for dr, dc in ((0, 1), (1, 0), (0, -1), (-1, 0))]
            beside = [(a, b) for a, b in beside if 0 <= a < state.shape[0] and 0 <= b < state.shape[1]]
            weight = np.array([1.0 if state[each] == UNKNOWN else 2.0 for each in beside])
            r, c = beside[int(rng.choice(len(beside), p=weight / weight.sum()))]
        found += state[r, c] == FREE
    return found / count


@pytest.mark.slow
def test_it_is_the_chance_of_a_random_walk() -> None:
    state = np.full((7, 9), UNKNOWN, dtype=np.uint8)
    state[0], state[:, 0], state[6, 4:] = WALL, WALL, FREE
    state[3, 5:7] = WALL
    found = openness(state, inside(state))
    for row, column in ((5, 2), (2, 2), (4, 7), (1, 7)):
        assert found[row, column] == pytest.approx(walks(state, row, column, row), abs=0.03)


def test_insides_and_rock_are_closed_and_shadows_are_open() -> None:
    state = np.full((40, 60), FREE, dtype=np.uint8)
    # an obstacle seen from all sides
    state[5:15, 5:15] = WALL
    state[6:14, 6:14] = UNKNOWN
    # what is behind a wall, and what lies in a shadow
    state[:, 40] = WALL
    state[:, 41:] = UNKNOWN
    state[25:35, 5:15] = UNKNOWN
    state[25, 5:15] = WALL
    found = openness(state, inside(state))
    assert found[6:14, 6:14].max() < 0.01
    assert found[:, 41:44].max() < 0.2
    assert found[30:34, 7:13].min() > 0.7
    assert (found[state != UNKNOWN] == 0.0).all()


def test_where_nothing_is_known_it_is_the_usual() -> None:
    nothing = np.zeros((300, 400), dtype=np.uint8)
    np.testing.assert_allclose(openness(nothing, inside(nothing)), PRIOR)
    outside = inside(nothing)
    outside[:, 350:] = True
    found = openness(nothing, outside)
    np.testing.assert_allclose(found[:, :350], PRIOR)
    assert (found[:, 350:] == 0.0).all()
    # far from all that is known, and near it
    long = np.zeros((1, 1000), dtype=np.uint8)
    long[0, 0] = WALL
    found = openness(long, inside(long))[0]
    assert found[-1] == pytest.approx(PRIOR, abs=1e-6)
    assert found[round(LONG)] == pytest.approx(PRIOR * (1.0 - np.exp(-1.0)), abs=0.02)


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), rows=st.integers(1, 60), columns=st.integers(1, 60))
def test_it_is_between_none_and_all(seed: int, rows: int, columns: int) -> None:
    rng = np.random.default_rng(seed)
    state = rng.choice(np.array([0, 0, 0, 1, 3], dtype=np.uint8), size=(rows, columns))
    outside = rng.random((rows, columns)) < 0.1
    found = openness(state, outside)
    assert ((found >= 0.0) & (found <= 1.0)).all()
    assert (found[(state != UNKNOWN) | outside] == 0.0).all()
    # turned about, it is the same, where a block is a cell
    if rows * columns <= 1000:
        np.testing.assert_allclose(openness(state.T, outside.T).T, found, atol=1e-9)
