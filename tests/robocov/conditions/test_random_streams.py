"""Random numbers that depend on nothing but seed, stream, step and robots."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.conditions.random_streams import RandomStream, compute_philox


@pytest.mark.parametrize(
    ("counter", "key", "answer"),
    [
        ("00000000 00000000 00000000 00000000", "00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
    ],
)
def test_philox_agrees_with_the_reference_implementation(counter: str, key: str, answer: str) -> None:
    """The known-answer vectors that come with Random123, the reference implementation."""
    words = np.array([int(word, 16) for word in counter.split()], dtype=np.uint64)
    first, second = (int(word, 16) for word in key.split())
    assert [f"{int(word):08x}" for word in compute_philox(words, (first, second))] == answer.split()


@given(
    seed=st.integers(0, 2**63),
    step=st.integers(0, 2**40),
    robots=st.lists(st.integers(0, 2**20), min_size=1, max_size=9),
)
def test_each_number_depends_on_its_robot_and_step_alone(seed: int, step: int, robots: list[int]) -> None:
    stream = RandomStream(seed, 1)
    uniform = stream.draw_uniform(step, np.array(robots), 5)
    normal = stream.draw_normal(step, np.array(robots))
    assert ((uniform > 0.0) & (uniform < 1.0)).all()
    for k, robot in enumerate(robots):
        assert stream.draw_uniform(step, np.array([robot]), 5)[0] == uniform[k]
        own_normal = RandomStream(seed, 1).draw_normal(step, np.array([robot]))[0]
        np.testing.assert_array_equal(own_normal, normal[k])


def test_seeds_streams_steps_and_pairs_differ() -> None:
    robots = np.arange(50)
    draws = [
        RandomStream(0, 0).draw_uniform(0, robots, 0),
        RandomStream(1, 0).draw_uniform(0, robots, 0),
        RandomStream(0, 1).draw_uniform(0, robots, 0),
        RandomStream(0, 0).draw_uniform(1, robots, 0),
        RandomStream(0, 0).draw_uniform(0, robots, 1),
        RandomStream(0, 0).draw_uniform(2**32, robots, 0),
    ]
    assert len(np.unique(np.concatenate(draws))) == 50 * len(draws)


def test_moments_and_independence() -> None:
    """Bounds are five standard errors wide; the draws are the same each time."""
    count = 100_000
    stream = RandomStream(3, 0)
    uniform = stream.draw_uniform(0, np.arange(count))
    assert abs(uniform.mean() - 0.5) < 5 / np.sqrt(12 * count)
    assert abs(np.corrcoef(uniform[:-1], uniform[1:])[0, 1]) < 5 / np.sqrt(count)
    normal = stream.draw_normal(9, np.arange(count))
    assert np.abs(normal.mean(axis=0)).max() < 5 / np.sqrt(count)
    assert np.abs(normal.var(axis=0) - 1.0).max() < 5 * np.sqrt(2 / count)
    assert abs(np.corrcoef(normal.T)[0, 1]) < 5 / np.sqrt(count)
    assert abs((normal**4).mean() - 3.0) < 5 * np.sqrt(96 / (2 * count))
