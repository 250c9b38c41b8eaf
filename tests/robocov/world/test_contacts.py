"""Robots in contact are moved again, and with them all robots that they are moved against."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocov.team import Team
from robocov.world import MAX_PENETRATION_M, World
from robocov.world.obstacle_pieces import Obstacles

DT = 1 / 60
DISTANT_WALL = np.array([[90.0, 90.0], [91.0, 90.0], [91.0, 91.0]])
WALL = np.array([[1.0, -5.0], [1.5, -5.0], [1.5, 5.0], [1.0, 5.0]])


def test_robots_without_contact_move_as_if_they_were_alone() -> None:
    """Robot 1 is between two robots that lean on each other and one that leans on a wall."""
    starts = np.array([[0.0, 3.0], [0.0, 0.0], [0.21, 3.0], [0.89, -3.0]])
    forces = np.array([[2.0, 0.0], [0.3, 0.1], [-2.0, 0.0], [2.0, 1.0]])
    team = World(Obstacles((WALL,)), Team.homogeneous(4), starts)
    alone = World(Obstacles((WALL,)), Team.homogeneous(1), starts[1:2])
    for _ in range(60):
        team.step(forces, DT)
        alone.step(forces[1:2], DT)
        assert team.positions[1].tobytes() == alone.positions[0].tobytes()
        assert team.velocities[1].tobytes() == alone.velocities[0].tobytes()
    assert team._list_touching_robots() == [0, 2, 3]


@pytest.mark.parametrize("ratio", [100.0, 1000.0])
def test_a_light_robot_between_a_heavy_one_and_a_wall_is_not_squeezed(ratio: float) -> None:
    pair = Team.homogeneous(2, max_speed=2.0, max_acceleration=20.0)
    team = replace(pair, mass=np.array([1.0, ratio]))
    world = World(Obstacles((WALL,)), team, np.array([[0.85, 0.0], [0.5, 0.0]]))
    for _ in range(60):
        world.step(np.array([[0.0, 0.0], [50.0 * ratio, 0.0]]), DT)
        light_x, heavy_x = world.positions[:, 0]
        assert light_x <= 0.9 + MAX_PENETRATION_M
        assert light_x - heavy_x >= 0.2 - MAX_PENETRATION_M
    assert light_x == pytest.approx(0.9, abs=MAX_PENETRATION_M)


def test_pushes_are_passed_on_along_a_row_of_robots() -> None:
    """A heavy robot runs into a row of slow ones: in the free step it touches only the first of them."""
    n = 6
    row = Team.homogeneous(n, viscosity=0.0)
    mass = np.array([100.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    max_speed = np.array([2.0, 0.4, 0.4, 0.4, 0.4, 0.4])
    gaps = np.array([0.0, 0.21, 0.2002, 0.2002, 0.2002, 0.2002])
    starts = np.column_stack([np.cumsum(gaps), np.zeros(n)])
    velocities = np.zeros((n, 2))
    velocities[0, 0] = 2.0
    world = World(
        Obstacles((DISTANT_WALL,)), replace(row, mass=mass, max_speed=max_speed), starts, velocities
    )
    world.step(np.zeros((n, 2)), DT)
    assert world._list_touching_robots() == [0, 1]
    assert (world.positions[1:, 0] > starts[1:, 0] + 0.01).all()
    for _ in range(30):
        assert np.diff(world.positions[:, 0]).min() >= 0.2 - MAX_PENETRATION_M
        assert (np.hypot(*world.velocities.T) <= max_speed * (1 + 1e-12)).all()
        world.step(np.zeros((n, 2)), DT)
