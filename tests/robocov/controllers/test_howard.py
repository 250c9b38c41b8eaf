"""Potential fields of Howard et al.: forces of robots and walls, and friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocov.controllers import Howard
from robocov.controllers.driving import collect_obstacle_points, update_returns
from robocov.environment import Environment
from robocov.observation import Observations, Scans, compute_ray_directions
from robocov.observation.neighbors import Neighbors
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))


def observe(positions: np.ndarray, scans: Scans | None = None) -> Observations:
    """Return the observations of robots at rest within communication range of each other.

    There are no obstacle points.
    """
    n = len(positions)
    return Observations(
        positions, np.zeros((n, 2)), Neighbors(n), np.full((n, 2), np.nan), SQUARE.region, scans=scans
    )


def compute_forces(controller: Howard, seen: Observations) -> np.ndarray:
    """Return the forces of the first decision, (n, 2) N."""
    team = Team.homogeneous(len(seen.positions))
    return controller.decide(seen, controller.begin(SQUARE.region, team)).forces


def scan_wall(distance: float, rays: int) -> Scans:
    """Return the scan of an infinite wall at x = distance from the robot."""
    cosine = compute_ray_directions(rays)[:, 0]
    is_hit = cosine > 1e-9
    distances = np.where(is_hit, distance / np.where(is_hit, cosine, 1.0), 1e6)
    return Scans(distances[None], is_hit[None])


def test_returns_keep_their_positions_until_the_next_scan() -> None:
    scans = Scans(np.array([[1.0, 3.0, 2.0, 3.0]]), np.array([[True, False, True, False]]))
    returns = update_returns(observe(np.array([[1.0, 2.0]]), scans), None)
    assert returns is not None
    np.testing.assert_allclose(returns[0, [0, 2]], [[2.0, 2.0], [-1.0, 2.0]], atol=1e-12)
    assert np.isnan(returns[0, [1, 3]]).all()
    moved = observe(np.array([[1.5, 2.0]]))
    assert update_returns(moved, returns) is returns
    assert collect_obstacle_points(moved, returns).shape == (1, 5, 2)


def test_before_the_first_scan_there_are_no_returns() -> None:
    seen = observe(np.array([[1.0, 2.0]]))
    assert update_returns(seen, None) is None
    assert collect_obstacle_points(seen, None).shape == (1, 1, 2)


def test_robots_repel_each_other_by_the_inverse_square() -> None:
    positions = np.random.default_rng(4).uniform(1, 9, size=(12, 2))
    forces = compute_forces(Howard(k_robots=0.7), observe(positions))
    for i in range(12):
        offsets = positions[i] - np.delete(positions, i, axis=0)
        expected = (0.7 * offsets / np.hypot(*offsets.T)[:, None] ** 3).sum(axis=0)
        np.testing.assert_allclose(forces[i], expected, rtol=1e-12)


@pytest.mark.parametrize("rays", [36, 72, 720])
def test_the_force_of_a_wall_does_not_depend_on_the_number_of_rays(rays: int) -> None:
    seen = observe(np.array([[5.0, 5.0]]), scan_wall(0.8, rays))
    force = compute_forces(Howard(k_obs=2.0), seen)[0]
    # The integral of cos³ over the rays is 4/3.
    expected = -2.0 / (2 * np.pi * 0.8**2) * 4 / 3
    np.testing.assert_allclose(force, [expected, 0.0], rtol=3e-3, atol=1e-9)


def test_before_the_first_scan_the_closest_point_is_taken_for_a_wall() -> None:
    seen = observe(np.array([[5.0, 5.0]]))
    force = compute_forces(Howard(k_obs=2.0), replace(seen, obstacle_points=np.array([[5.8, 5.0]])))
    expected = compute_forces(Howard(k_obs=2.0), replace(seen, scans=scan_wall(0.8, 720)))
    np.testing.assert_allclose(force, expected, rtol=3e-3, atol=1e-9)


def test_both_walls_of_a_corner_repel() -> None:
    """The closest point is on one of them only."""
    simulation = Simulation(SQUARE, Howard(), [[1.0, 1.3]], Team.homogeneous(1))
    snapshot = simulation.observe_and_decide()
    assert snapshot.seen.scans is not None
    assert (snapshot.decision.forces[0] > 0.05).all()


def test_friction_replaces_viscosity() -> None:
    """Far from obstacles, the velocity of a robot decays as exp(-ν t / m)."""
    hall = Environment("hall", ((0, 0), (200, 0), (200, 200), (0, 200)))
    controller = Howard(k_obs=0.0, friction=0.5)
    team = Team.homogeneous(1, sensing_range=0.5)
    simulation = Simulation(hall, controller, TeamState([[100, 100]], velocities=[[0.9, 0.0]]), team)
    for _ in range(120):
        simulation.step()
    assert simulation.velocities[0, 0] == pytest.approx(0.9 * np.exp(-0.5 * 2.0), rel=0.02)


@pytest.mark.slow
def test_the_team_spreads_and_comes_to_rest() -> None:
    """The claim of the paper, in a room without obstacles, where closest points do not jump."""
    simulation = Simulation(SQUARE, Howard(), [[4.8, 5.0], [5.2, 5.0], [5.0, 5.4], [5.1, 4.6]])
    for _ in range(60 * 40):
        simulation.step()
    distances = np.hypot(*(simulation.positions[:, None] - simulation.positions).T)
    assert distances[~np.eye(4, dtype=bool)].min() > 4.0
    assert np.hypot(*simulation.velocities.T).max() < 0.05


def test_runs_are_reproducible() -> None:
    starts = SQUARE.start().sample(6, seed=1)
    first = Simulation(SQUARE, Howard(), starts).run(3.0)
    second = Simulation(SQUARE, Howard(), starts).run(3.0)
    assert first.positions.tobytes() == second.positions.tobytes()
    assert first.forces.tobytes() == second.forces.tobytes()
