"""Velocities toward goals and next to obstacles and other robots, and the forces that track them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers.driving import (
    Margins,
    avoid_collisions,
    compute_approach_velocities,
    compute_drive_forces,
    limit_approach_speed,
    list_neighbor_offsets,
)
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.team import Team

REGION = Region(np.array([[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0], [-50.0, 50.0]]))


def test_robots_that_meet_brake_on_half_of_their_distance_each() -> None:
    """A wall at the same distance may be approached faster."""
    team = Team.homogeneous(2, max_speed=5.0, max_acceleration=2.0)
    positions = np.array([[0.0, 0.0], [0.7, 0.0]])
    no_points = np.full((2, 1, 2), np.nan)
    seen = Observations(positions, np.zeros((2, 2)), Neighbors(2), no_points[:, 0], REGION)
    margins = Margins(clearance=np.full(2, 0.2), separation=np.full(2, 0.2), rate=1000.0, braking=0.5)
    desired = np.array([[3.0, 0.0], [-3.0, 0.0]])
    velocities = avoid_collisions(desired, seen, team, no_points, margins)
    # Half of the acceleration, 0.5 m/s², brakes each robot within 0.5 m.
    expected_speed = np.sqrt(2 * 0.5 * 0.5)
    np.testing.assert_allclose(velocities, [[expected_speed, 0.0], [-expected_speed, 0.0]])

    alone = Observations(positions[:1], np.zeros((1, 2)), Neighbors(1), no_points[:1, 0], REGION)
    wall_points = positions[None, 1:]
    margins = margins._replace(clearance=np.full(1, 0.2), separation=np.full(1, 0.2))
    velocities = avoid_collisions(desired[:1], alone, team[:1], wall_points, margins)
    np.testing.assert_allclose(velocities, [[np.sqrt(2 * 1.0 * 0.5), 0.0]])


@pytest.mark.parametrize(
    ("offsets", "desired", "expected"),
    [
        # Within the clearance of one object, the robot leaves at half of its maximum speed.
        ([[1.0, 0.0], [np.nan, np.nan]], [-1.0, 0.2], [1.0, 0.2]),
        # Between two objects it approaches neither, but is free to move sideways.
        ([[1.0, 0.0], [-1.0, 0.0]], [-1.0, 0.2], [0.0, 0.2]),
    ],
    ids=["one object", "between two objects"],
)
def test_robots_leave_the_clearance_of_objects_if_they_can(
    offsets: list[list[float]], desired: list[float], expected: list[float]
) -> None:
    velocities = limit_approach_speed(
        np.array([desired]),
        offsets=np.array([offsets]),
        clearance=np.full((1, 2), 3.0),
        rate=10.0,
        braking=np.full((1, 2), 1.0),
        max_speed=np.array([2.0]),
    )
    np.testing.assert_allclose(velocities, [expected], atol=1e-12)


@given(seed=st.integers(0, 2**32), n=st.integers(1, 9))
def test_approach_velocities_are_proportional_and_limited(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    offsets = rng.normal(size=(n, 2))
    offsets[0] = 0.0
    max_speed = rng.uniform(0.1, 2.0, n)
    velocities = compute_approach_velocities(offsets, 2.0, max_speed)
    expected_speed = np.minimum(2.0 * np.hypot(*offsets.T), max_speed)
    np.testing.assert_allclose(np.hypot(*velocities.T), expected_speed, atol=1e-12)
    assert ((velocities * offsets).sum(axis=1) >= 0.0).all()


def test_drive_forces_compensate_viscosity() -> None:
    """At the desired velocity, the force is that of viscosity alone."""
    velocities = np.array([[0.5, 0.0]])
    seen = Observations(np.zeros((1, 2)), velocities, Neighbors(1), np.full((1, 2), np.nan), REGION)
    team = Team.homogeneous(1, viscosity=3.0)
    np.testing.assert_allclose(compute_drive_forces(velocities, seen, team, 0.1), [[1.5, 0.0]])


@given(seed=st.integers(0, 2**32))
def test_only_the_velocity_toward_an_object_is_limited(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 20
    desired = rng.normal(size=(n, 2))
    desired *= np.minimum(1.0, 2.0 / np.hypot(*desired.T))[:, None]
    offsets = rng.normal(size=(n, 1, 2))
    velocities = limit_approach_speed(
        desired,
        offsets=offsets,
        clearance=np.full((n, 1), 0.4),
        rate=2.0,
        braking=np.full((n, 1), 1.0),
        max_speed=np.full(n, 9.0),
    )
    distance = np.hypot(*offsets[:, 0].T)
    normals = offsets[:, 0] / distance[:, None]
    tangents = np.column_stack([-normals[:, 1], normals[:, 0]])
    gap = distance - 0.4
    max_approach_speed = np.minimum(2.0 * gap, np.sqrt(2.0 * np.maximum(gap, 0.0)))
    desired_approach_speed = -(desired * normals).sum(axis=1)
    approach_speed = -(velocities * normals).sum(axis=1)
    expected = np.minimum(desired_approach_speed, max_approach_speed)
    np.testing.assert_allclose(approach_speed, expected, atol=1e-9)
    np.testing.assert_allclose(
        (velocities * tangents).sum(axis=1), (desired * tangents).sum(axis=1), atol=1e-9
    )


def test_without_objects_velocities_do_not_change() -> None:
    desired = np.random.default_rng(0).normal(size=(5, 2))
    velocities = limit_approach_speed(
        desired,
        offsets=np.full((5, 1, 2), np.nan),
        clearance=np.full((5, 1), 0.4),
        rate=2.0,
        braking=np.full((5, 1), 1.0),
        max_speed=np.full(5, 9.0),
    )
    np.testing.assert_allclose(velocities, desired, rtol=1e-12)


def test_neighbor_offsets_are_those_within_reach() -> None:
    n = 40
    positions = np.random.default_rng(0).uniform(20, 30, size=(n, 2))
    seen = Observations(positions, np.zeros((n, 2)), Neighbors(n), np.full((n, 2), np.nan), REGION)
    offsets = list_neighbor_offsets(seen, 1.5)
    for i in range(n):
        expected = positions[i] - np.delete(positions, i, axis=0)
        expected = expected[np.hypot(*expected.T) <= 1.5]
        np.testing.assert_array_equal(offsets[i][~np.isnan(offsets[i, :, 0])], expected)
