"""Robots in contact are moved on their own, and whoever they are moved against with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocov.team import Team
from robocov.world import MAX_PENETRATION, World

DT = 1 / 60
FAR = np.array([[90.0, 90.0], [91.0, 90.0], [91.0, 91.0]])
WALL = np.array([[1.0, -5.0], [1.5, -5.0], [1.5, 5.0], [1.0, 5.0]])


def test_who_touches_nothing_moves_as_if_nobody_did() -> None:
    """Bit for bit, in the middle between two that lean on each other and one that leans on a wall."""
    places = np.array([[0.0, 3.0], [0.0, 0.0], [0.21, 3.0], [0.89, -3.0]])
    forces = np.array([[2.0, 0.0], [0.3, 0.1], [-2.0, 0.0], [2.0, 1.0]])
    together = World((WALL,), Team.homogeneous(4), places)
    alone = World((WALL,), Team.homogeneous(1), places[1:2])
    for _ in range(60):
        together.step(forces, DT)
        alone.step(forces[1:2], DT)
        assert together.positions[1].tobytes() == alone.positions[0].tobytes()
        assert together.velocities[1].tobytes() == alone.velocities[0].tobytes()
    assert together._list_touching() == [0, 2, 3]


def test_whoever_is_pushed_on_pushes_on() -> None:
    """A heavy robot runs into a row of slow ones: in the free step only the first of them is touched."""
    n = 6
    row = Team.homogeneous(n, max_speed=0.4)
    mass, limit = np.r_[100.0, np.ones(n - 1)], np.r_[2.0, row.max_speed[1:]]
    gaps = np.r_[0.0, 0.21, np.full(n - 2, 0.2002)]
    places = np.column_stack([np.cumsum(gaps), np.zeros(n)])
    velocities = np.zeros((n, 2))
    velocities[0, 0] = 2.0
    world = World((FAR,), replace(row, mass=mass, max_speed=limit, viscosity=0.0 * mass), places, velocities)
    world.step(np.zeros((n, 2)), DT)
    assert world._list_touching() == [0, 1]
    assert (world.positions[1:, 0] > places[1:, 0] + 0.01).all()
    for _ in range(30):
        assert np.diff(world.positions[:, 0]).min() >= 0.2 - MAX_PENETRATION
        assert (np.hypot(*world.velocities.T) <= limit * (1 + 1e-12)).all()
        world.step(np.zeros((n, 2)), DT)
