from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.planning import steering


@settings(max_examples=60)
@given(seed=st.integers(0, 10_000))
def test_nobody_approaches_one_wall_faster_than_he_can_stop(seed: int) -> None:
    rng = np.random.default_rng(seed)
    velocity = rng.normal(size=(20, 2))
    offset = rng.normal(size=(20, 1, 2))
    offset[rng.random(20) < 0.2] = np.nan
    radius = np.full(20, 0.1)
    safe = steering.clear_of_walls(velocity, offset, radius)
    distance = np.hypot(*np.moveaxis(offset[:, 0], -1, 0))
    for v, w, o, d in zip(velocity, safe, offset[:, 0], distance, strict=True):
        if np.isnan(d):
            assert np.array_equal(v, w)
            continue
        gap = d - 0.1 - steering.MARGIN
        most = np.sqrt(2 * steering.BRAKING * gap) if gap > 0 else 2 * gap
        assert -(w @ o) / d <= most + 1e-9
        across = np.array([o[1], -o[0]]) / d
        np.testing.assert_allclose(w @ across, v @ across, atol=1e-9)


def test_in_narrow_places_nobody_is_fast() -> None:
    velocity = np.tile([1.0, 0.0], (4, 1))
    slow = np.hypot(*steering.slowed(velocity, np.array([np.nan, 5.0, 0.1, -0.01])).T)
    np.testing.assert_allclose(slow, [1.0, 1.0, np.sqrt(0.16) + steering.CREEP, steering.CREEP])


def test_two_that_meet_pass_on_the_left() -> None:
    velocity = np.array([[1.0, 0.0], [-1.0, 0.0]])
    offset = np.array([[-0.3, 0.0], [0.3, 0.0]])
    safe = steering.clear_of_robots(velocity, np.array([0, 1]), offset, np.full(2, 0.3), np.full(2, 0.2))
    assert safe[0, 0] < 0.5
    assert safe[1, 1] < 0.0 < safe[0, 1]
    np.testing.assert_allclose(safe[0], -safe[1])
    nobody = steering.clear_of_robots(velocity, np.empty(0, dtype=int), np.empty((0, 2)), *np.empty((2, 0)))
    assert np.array_equal(nobody, velocity)
