from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import Dispersion
from robocov.controllers.driving import (
    compute_approach_velocities,
    compute_drive_forces,
    limit_approach_speed,
    list_neighbour_offsets,
)
from robocov.environment import Environment
from robocov.mapfile import load_map
from robocov.metrics import find_settling_time
from robocov.observation import Observations
from robocov.observation.neighbours import Neighbours
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

HALL = Environment("hall", ((0, 0), (60, 0), (60, 60), (0, 60)))


def seen_from(positions: np.ndarray, points: np.ndarray | None = None) -> Observations:
    n = len(positions)
    nothing = np.full((n, 2), np.nan)
    return Observations(
        positions, np.zeros((n, 2)), Neighbours(n), nothing if points is None else points, HALL.region
    )


@given(seed=st.integers(0, 2**32), n=st.integers(1, 9))
def test_approach_is_proportional_and_limited(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    offset, limit = rng.normal(size=(n, 2)), rng.uniform(0.1, 2.0, n)
    offset[0] = 0.0
    wanted = compute_approach_velocities(offset, 2.0, limit)
    speed = np.hypot(*wanted.T)
    np.testing.assert_allclose(speed, np.minimum(2.0 * np.hypot(*offset.T), limit), atol=1e-12)
    assert ((wanted * offset).sum(axis=1) >= 0.0).all()


def test_drive_reaches_the_wanted_velocity_against_viscosity() -> None:
    seen = seen_from(np.array([[30.0, 30.0]]))
    team = Team.homogeneous(1, viscosity=3.0)
    still = Observations(
        seen.positions, np.array([[0.5, 0.0]]), seen.neighbours, seen.obstacle_points, seen.region
    )
    np.testing.assert_allclose(compute_drive_forces(np.array([[0.5, 0.0]]), still, team, 0.1), [[1.5, 0.0]])


@given(seed=st.integers(0, 2**32))
def test_kept_off_one_thing_changes_the_approach_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wanted, away = rng.normal(size=(20, 2)), rng.normal(size=(20, 1, 2))
    wanted *= np.minimum(1.0, 2.0 / np.hypot(*wanted.T))[:, None]
    away[0] = np.nan
    clearance, braking = np.full((20, 1), 0.4), np.full((20, 1), 1.0)
    slowed = limit_approach_speed(wanted, away, clearance, 2.0, braking, np.full(20, 9.0))
    np.testing.assert_allclose(slowed[0], wanted[0], rtol=1e-12)
    distance = np.hypot(*away[1:, 0].T)
    normal = away[1:, 0] / distance[:, None]
    gap = distance - 0.4
    allowed = np.minimum(2.0 * gap, np.sqrt(2.0 * np.maximum(gap, 0.0)))
    towards, before = -(slowed[1:] * normal).sum(axis=1), -(wanted[1:] * normal).sum(axis=1)
    np.testing.assert_allclose(towards, np.minimum(before, allowed), atol=1e-9)
    along = np.column_stack([-normal[:, 1], normal[:, 0]])
    np.testing.assert_allclose((slowed[1:] * along).sum(axis=1), (wanted[1:] * along).sum(axis=1), atol=1e-9)


def test_between_two_walls_that_are_too_close_it_goes_along() -> None:
    """Both ask to be left: then neither is approached."""
    away = np.array([[[0.1, 0.0], [-0.1, 0.0]]])
    slowed = limit_approach_speed(
        np.array([[0.5, 0.7]]), away, np.full((1, 2), 0.3), 2.0, np.full((1, 2), 1.0), np.ones(1)
    )
    np.testing.assert_allclose(slowed, [[0.0, 0.7]], atol=1e-12)


def test_neighbour_offsets_by_all_distances() -> None:
    positions = np.random.default_rng(0).uniform(20, 30, size=(40, 2))
    away = list_neighbour_offsets(seen_from(positions), 1.5)
    for i in range(40):
        offset = positions[i] - np.delete(positions, i, axis=0)
        near = offset[np.hypot(*offset.T) <= 1.5]
        np.testing.assert_array_equal(away[i][~np.isnan(away[i, :, 0])], near)


@pytest.mark.slow
def test_robots_leave_each_others_reach_and_rest() -> None:
    """The claim: local dispersion alone spreads the team until nobody is near anybody."""
    starts = 30.0 + 0.3 * np.mgrid[-1:2, -1:2].reshape(2, -1).T
    simulation = Simulation(HALL, Dispersion(reach=2.0), starts)
    record = simulation.run(40.0)
    apart = np.hypot(*(record.positions[-1][:, None] - record.positions[-1]).T) + 99 * np.eye(9)
    assert apart.min() > 1.9
    assert find_settling_time(record.time, record.positions) is not None


def test_nobody_near_and_nothing_to_do() -> None:
    law = Dispersion()
    seen = seen_from(np.array([[20.0, 20.0], [40.0, 40.0]]))
    forces = law.decide(seen, law.begin(HALL.region, Team.homogeneous(2))).forces
    np.testing.assert_array_equal(forces, 0.0)


@pytest.mark.parametrize("explore", [0.0, 0.4])
def test_a_robot_that_is_alone_goes_on_if_it_is_to_explore(explore: float) -> None:
    law = Dispersion(explore_speed=explore)
    simulation = Simulation(HALL, law, TeamState([[20, 20]], velocities=[[0.3, 0.4]]))
    for _ in range(120):
        simulation.step()
    np.testing.assert_allclose(simulation.velocities[0], explore * np.array([0.6, 0.8]), atol=1e-3)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_obstacles_come_first(seed: int) -> None:
    """Fleeing from others along a wall, not into it: what is behind the clearance stays away from it."""
    pillars = load_map("blocks-a")
    simulation = Simulation(pillars, Dispersion(), pillars.start("uniform").sample(5, seed=seed))
    least = np.inf
    for _ in range(60 * 10):
        simulation.step()
        seen = simulation.observe_and_decide().seen
        least = min(least, float(np.nanmin(np.hypot(*(seen.positions - seen.obstacle_points).T))))
    assert least > 0.1


def test_the_same_run_twice() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(6, seed=1)
    one, other = (Simulation(rooms, Dispersion(), starts).run(3.0) for _ in range(2))
    assert one.positions.tobytes() == other.positions.tobytes()
