from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocov.controllers import Howard
from robocov.controllers.driving import collect_obstacle_points, update_returns
from robocov.environment import Environment
from robocov.observation import Observations, Scans, compute_headings
from robocov.observation.neighbours import Neighbours
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))


def seen_from(positions: np.ndarray, velocities: np.ndarray | None = None) -> Observations:
    n = len(positions)
    return Observations(
        positions,
        np.zeros((n, 2)) if velocities is None else velocities,
        Neighbours(n),
        np.full((n, 2), np.nan),
        SQUARE.region,
    )


def wall_scan(distance: float, rays: int) -> Scans:
    """What a robot measures of an endless wall at x = `distance` from it."""
    cosine = compute_headings(rays)[:, 0]
    hit = cosine > 1e-9
    distances = np.where(hit, distance / np.where(hit, cosine, 1.0), 1e6)
    return Scans(distances[None], hit[None])


def test_returns_are_kept_where_they_were_met() -> None:
    seen = seen_from(np.array([[1.0, 2.0]]))
    scans = Scans(np.array([[1.0, 3.0, 2.0, 3.0]]), np.array([[True, False, True, False]]))
    points = update_returns(replace(seen, scans=scans), None)
    assert points is not None
    np.testing.assert_allclose(points[0, [0, 2]], [[2.0, 2.0], [-1.0, 2.0]], atol=1e-12)
    assert np.isnan(points[0, [1, 3]]).all()
    moved = seen_from(np.array([[1.5, 2.0]]))
    assert update_returns(moved, points) is points
    assert update_returns(moved, None) is None
    assert collect_obstacle_points(moved, points).shape == (1, 5, 2)
    assert collect_obstacle_points(moved, None).shape == (1, 1, 2)


def test_robots_repel_by_the_inverse_square() -> None:
    """An independent double loop over all pairs."""
    positions = np.random.default_rng(4).uniform(1, 9, size=(12, 2))
    law = Howard(k_robots=0.7)
    forces = law.decide(seen_from(positions), law.begin(SQUARE.region, Team.homogeneous(12))).forces
    for i in range(12):
        away = positions[i] - np.delete(positions, i, axis=0)
        expected = (0.7 * away / np.hypot(*away.T)[:, None] ** 3).sum(axis=0)
        np.testing.assert_allclose(forces[i], expected, rtol=1e-12)


@pytest.mark.parametrize("rays", [36, 72, 720])
def test_a_wall_repels_the_same_by_any_number_of_rays(rays: int) -> None:
    law = Howard(k_obs=2.0)
    seen = replace(seen_from(np.array([[5.0, 5.0]])), scans=wall_scan(0.8, rays))
    force = law.decide(seen, law.begin(SQUARE.region, Team.homogeneous(1))).forces[0]
    # the integral over the rays: k / 2 pi d² times that of cos³
    np.testing.assert_allclose(force, [-2.0 / (2 * np.pi * 0.8**2) * 4 / 3, 0.0], rtol=3e-3, atol=1e-9)
    # before the first scan the closest point stands for that wall
    point = replace(seen, scans=None, obstacle_points=np.array([[5.8, 5.0]]))
    alone = law.decide(point, law.begin(SQUARE.region, Team.homogeneous(1))).forces[0]
    np.testing.assert_allclose(alone, force, rtol=3e-3, atol=1e-9)


def test_all_of_a_corner_repels_not_only_its_closest_point() -> None:
    law, team = Howard(), Team.homogeneous(1)
    simulation = Simulation(SQUARE, law, [[1.0, 1.3]], team)
    force = simulation.observe_and_decide().decision.forces[0]
    assert simulation.observe_and_decide().seen.scans is not None
    assert (force > 0.05).all()


def test_friction_takes_the_place_of_the_worlds_viscosity() -> None:
    """Alone in the middle of nowhere, a robot coasts to rest as exp(-nu t / m)."""
    hall = Environment("hall", ((0, 0), (200, 0), (200, 200), (0, 200)))
    law = Howard(k_obs=0.0, friction=0.5)
    team = Team.homogeneous(1, sensing_range=0.5)
    simulation = Simulation(hall, law, TeamState([[100, 100]], velocities=[[0.9, 0.0]]), team)
    for _ in range(120):
        simulation.step()
    assert simulation.velocities[0, 0] == pytest.approx(0.9 * np.exp(-0.5 * 2.0), rel=0.02)


@pytest.mark.slow
def test_the_team_spreads_and_loses_its_energy() -> None:
    """The claim of the paper: the network spreads from one place, and comes to rest."""
    simulation = Simulation(SQUARE, Howard(), [[4.8, 5.0], [5.2, 5.0], [5.0, 5.4], [5.1, 4.6]])
    for _ in range(60 * 40):
        simulation.step()
    away = np.hypot(*(simulation.positions[:, None] - simulation.positions).T)
    assert away[~np.eye(4, dtype=bool)].min() > 4.0
    # closest points no longer jump in a room without obstacles: it rests
    assert np.hypot(*simulation.velocities.T).max() < 0.05


def test_the_same_run_twice() -> None:
    starts = SQUARE.start().sample(6, seed=1)
    one, other = (Simulation(SQUARE, Howard(), starts).run(3.0) for _ in range(2))
    assert one.positions.tobytes() == other.positions.tobytes()
    assert one.forces.tobytes() == other.forces.tobytes()
