"""Random numbers that depend on nothing but seed, stream and step."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robocov.conditions.random_streams import create_generator


@given(seed=st.integers(0, 2**63), step=st.integers(0, 2**40), robots=st.integers(1, 9))
def test_the_same_step_draws_the_same_numbers(seed: int, step: int, robots: int) -> None:
    """Robots that are added at the end do not change the numbers of the others."""
    team = create_generator(seed, 1, step).normal(size=(robots, 2))
    larger_team = create_generator(seed, 1, step).normal(size=(robots + 3, 2))
    np.testing.assert_array_equal(larger_team[:robots], team)


def test_seeds_streams_and_steps_differ() -> None:
    arguments = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 2**33)]
    draws = [create_generator(seed, stream, step).random(50) for seed, stream, step in arguments]
    assert len(np.unique(np.concatenate(draws))) == 50 * len(arguments)


def test_steps_are_independent() -> None:
    """Bounds are five standard errors wide; the draws are the same each time."""
    steps = 20_000
    normal = np.array([create_generator(3, 0, step).normal(size=2) for step in range(steps)])
    assert np.abs(normal.mean(axis=0)).max() < 5 / np.sqrt(steps)
    assert np.abs(normal.var(axis=0) - 1.0).max() < 5 * np.sqrt(2 / steps)
    assert abs(np.corrcoef(normal.T)[0, 1]) < 5 / np.sqrt(steps)
    for component in normal.T:
        assert abs(np.corrcoef(component[:-1], component[1:])[0, 1]) < 5 / np.sqrt(steps)
