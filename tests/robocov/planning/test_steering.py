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
    safe = steering.clear_of_walls(velocity, steering.wall_limits(offset, radius))
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


@given(st.integers(0, 2**32 - 1))
def test_a_turn_takes_no_more_acceleration_than_it_may(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wanted, velocity = rng.uniform(-1, 1, (2, 8, 2))
    change = rng.uniform(0.0, 1.5, 8)
    found = steering.reachable(wanted, velocity, change)
    near = np.hypot(*(wanted - velocity).T) <= change
    assert np.array_equal(near, np.abs(found - wanted).max(axis=1) < 1e-12)
    step = found - velocity
    assert (np.hypot(*step.T) <= change + 1e-12).all()
    # straight towards what is wanted
    along = (step * (wanted - velocity)).sum(axis=1)
    np.testing.assert_allclose(along, np.hypot(*step.T) * np.hypot(*(wanted - velocity).T), atol=1e-12)


def test_in_narrow_places_nobody_is_fast() -> None:
    velocity = np.tile([1.0, 0.0], (4, 1))
    slow = np.hypot(*steering.slowed(velocity, np.array([np.nan, 5.0, 0.1, -0.01])).T)
    np.testing.assert_allclose(slow, [1.0, 1.0, np.sqrt(0.16) + steering.CREEP, steering.CREEP])


def test_two_that_meet_pass_on_the_left() -> None:
    velocity = np.array([[1.0, 0.0], [-1.0, 0.0]])
    offset = np.array([[-0.3, 0.0], [0.3, 0.0]])
    near = steering.robot_limits(offset, np.full(2, 0.3), np.full(2, 0.2))
    safe = steering.clear_of_robots(velocity, np.array([0, 1]), near)
    assert safe[0, 0] < 0.5
    assert safe[1, 1] < 0.0 < safe[0, 1]
    np.testing.assert_allclose(safe[0], -safe[1])
    none = steering.robot_limits(np.empty((0, 2)), *np.empty((2, 0)))
    nobody = steering.clear_of_robots(velocity, np.empty(0, dtype=int), none)
    assert np.array_equal(nobody, velocity)


@settings(max_examples=60)
@given(seed=st.integers(0, 10_000))
def test_where_corrections_contradict_each_other_it_is_slow_enough_for_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, k = 12, 6
    velocity, radius = rng.normal(size=(n, 2)), np.full(n, 0.1)
    walls = rng.normal(scale=0.2, size=(n, k, 2))
    robot = np.sort(rng.integers(0, n, 30))
    offset = rng.normal(scale=0.4, size=(30, 2))
    distance, reach = np.hypot(*offset.T), np.full(30, 0.2)
    near = steering.robot_limits(offset, distance, reach)
    safe = steering.scale_to_limits(velocity, steering.wall_limits(walls, radius), robot, near)
    gap = np.hypot(*np.moveaxis(walls, -1, 0)) - 0.1 - steering.MARGIN
    toward = -(walls * safe[:, None]).sum(axis=2) / np.hypot(*np.moveaxis(walls, -1, 0))
    assert (toward <= np.sqrt(2 * steering.BRAKING * gap.clip(0)) + 0.0101).all()
    gap = distance - reach - steering.APART
    toward = -(offset * safe[robot]).sum(axis=1) / distance
    assert (toward <= 0.5 * np.sqrt(2 * steering.BRAKING * gap.clip(0)) + 0.0101).all()
    # the direction is the same, and who approaches nothing goes on
    assert np.abs(velocity[:, 0] * safe[:, 1] - velocity[:, 1] * safe[:, 0]).max() < 1e-12
    nothing = steering.wall_limits(np.full((n, 1, 2), np.nan), radius)
    free = steering.scale_to_limits(velocity, nothing, robot[:0], near)
    assert np.array_equal(free, velocity)
