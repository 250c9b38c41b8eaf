"""Dispersion of robots that only avoid each other and walls."""

from __future__ import annotations

import numpy as np
import pytest

from robocov.controllers import Dispersion
from robocov.environment import Environment
from robocov.mapfile import load_map
from robocov.metrics import find_settling_time
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

HALL = Environment("hall", ((0, 0), (60, 0), (60, 60), (0, 60)))


@pytest.mark.slow
def test_robots_leave_each_others_reach_and_come_to_rest() -> None:
    """The claim: local dispersion alone spreads the team until no robot is near another."""
    starts = 30.0 + 0.3 * np.mgrid[-1:2, -1:2].reshape(2, -1).T
    record = Simulation(HALL, Dispersion(reach=2.0), starts).run(40.0)
    positions = record.positions[-1]
    distances = np.hypot(*(positions[:, None] - positions).T)
    assert distances[~np.eye(9, dtype=bool)].min() > 1.9
    assert find_settling_time(record.time, record.positions) is not None


def test_robots_that_are_far_apart_are_at_rest() -> None:
    controller = Dispersion()
    positions = np.array([[20.0, 20.0], [40.0, 40.0]])
    seen = Observations(positions, np.zeros((2, 2)), Neighbors(2), np.full((2, 2), np.nan), HALL.region)
    decision = controller.decide(seen, controller.begin(HALL.region, Team.homogeneous(2)))
    np.testing.assert_array_equal(decision.forces, 0.0)


@pytest.mark.parametrize("explore_speed", [0.0, 0.4])
def test_a_robot_without_others_keeps_its_direction_at_the_explore_speed(explore_speed: float) -> None:
    controller = Dispersion(explore_speed=explore_speed)
    simulation = Simulation(HALL, controller, TeamState([[20, 20]], velocities=[[0.3, 0.4]]))
    for _ in range(120):
        simulation.step()
    np.testing.assert_allclose(simulation.velocities[0], explore_speed * np.array([0.6, 0.8]), atol=1e-3)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_robots_move_along_walls_and_not_into_them(seed: int) -> None:
    """Avoiding obstacles has priority over moving away from other robots."""
    pillars = load_map("blocks-a")
    simulation = Simulation(pillars, Dispersion(), pillars.start("uniform").sample(5, seed=seed))
    min_distance = np.inf
    for _ in range(60 * 10):
        simulation.step()
        seen = simulation.observe_and_decide().seen
        distances = np.hypot(*(seen.positions - seen.obstacle_points).T)
        min_distance = min(min_distance, float(np.nanmin(distances)))
    assert min_distance > 0.1


def test_runs_are_reproducible() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(6, seed=1)
    first = Simulation(rooms, Dispersion(), starts).run(3.0)
    second = Simulation(rooms, Dispersion(), starts).run(3.0)
    assert first.positions.tobytes() == second.positions.tobytes()
