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


@given(st.integers(0, 2**63), st.integers(0, 2**40), st.lists(st.integers(0, 2**20), min_size=1, max_size=9))
def test_each_number_depends_on_its_robot_and_step_alone(seed: int, step: int, who: list[int]) -> None:
    draws, rows = RandomStream(seed, 1), np.array(who)
    together = draws.draw_uniform(step, rows, 5)
    assert ((together > 0.0) & (together < 1.0)).all()
    for k, one in enumerate(who):
        assert draws.draw_uniform(step, np.array([one]), 5)[0] == together[k]
        assert (
            RandomStream(seed, 1).draw_normal(step, np.array([one]))[0] == draws.draw_normal(step, rows)[k]
        ).all()


def test_seeds_streams_steps_and_pairs_differ() -> None:
    rows = np.arange(50)
    found = [
        RandomStream(seed, stream).draw_uniform(step, rows, other)
        for seed, stream, step, other in [(0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)]
    ]
    found += [RandomStream(0, 0).draw_uniform(0, rows, 1), RandomStream(0, 0).draw_uniform(2**32, rows)]
    assert len({value for row in found for value in row.tolist()}) == 50 * len(found)


def test_moments_and_independence() -> None:
    """Bounds are five standard errors wide; the draws are the same each time."""
    count = 100_000
    draws = RandomStream(3, 0)
    even = draws.draw_uniform(0, np.arange(count))
    assert abs(even.mean() - 0.5) < 5 / np.sqrt(12 * count)
    assert abs(np.corrcoef(even[:-1], even[1:])[0, 1]) < 5 / np.sqrt(count)
    bell = draws.draw_normal(9, np.arange(count))
    assert np.abs(bell.mean(axis=0)).max() < 5 / np.sqrt(count)
    assert np.abs(bell.var(axis=0) - 1.0).max() < 5 * np.sqrt(2 / count)
    assert abs(np.corrcoef(bell.T)[0, 1]) < 5 / np.sqrt(count)
    assert abs((bell**4).mean() - 3.0) < 5 * np.sqrt(96 / (2 * count))
