"""Safe velocities next to obstacles and other robots."""

from __future__ import annotations

import numpy as np
import pytest

from robocov.controllers.driving import Margins, avoid_collisions, limit_approach_speed
from robocov.observation import Observations
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.team import Team

REGION = Region(np.array([[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0], [-50.0, 50.0]]))


def test_robots_that_meet_brake_on_half_of_their_distance_each() -> None:
    """A wall at the same distance may be approached faster."""
    team = Team.homogeneous(2, max_speed=5.0, max_acceleration=2.0)
    positions = np.array([[0.0, 0.0], [0.7, 0.0]])
    no_points = np.full((2, 1, 2), np.nan)
    seen = Observations(positions, np.zeros((2, 2)), Neighbours(2), no_points[:, 0], REGION)
    margins = Margins(clearance=np.full(2, 0.2), separation=np.full(2, 0.2), rate=1000.0, braking=0.5)
    desired = np.array([[3.0, 0.0], [-3.0, 0.0]])
    velocities = avoid_collisions(desired, seen, team, no_points, margins)
    # Half of the acceleration, 0.5 m/s², brakes each robot within 0.5 m.
    expected_speed = np.sqrt(2 * 0.5 * 0.5)
    np.testing.assert_allclose(velocities, [[expected_speed, 0.0], [-expected_speed, 0.0]])

    alone = Observations(positions[:1], np.zeros((1, 2)), Neighbours(1), no_points[:1, 0], REGION)
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
