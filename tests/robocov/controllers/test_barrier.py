"""Control barrier functions: the quadratic program, and safe distances to robots and walls."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from scipy.optimize import minimize

from robocov.controllers import Barrier
from robocov.controllers.barrier import BarrierMemory
from robocov.controllers.driving import find_nearest_allowed_points
from robocov.environment import Environment
from robocov.mapfile import load_map
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))


def sample_half_planes(seed: int, n: int, m: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(n, m, 2))
    normals /= np.hypot(normals[..., 0], normals[..., 1])[..., None]
    # Most of them contain a point of the disc, as they do with h >= 0.
    offsets = rng.normal(0.7, 0.8, size=(n, m))
    offsets[rng.random((n, m)) < 0.2] = np.inf
    normals[rng.random((n, m)) < 0.1] = np.nan
    return rng.normal(scale=2.0, size=(n, 2)), normals, offsets, rng.uniform(0.5, 2.5, n)


def list_candidates(
    desired: np.ndarray, normals: np.ndarray, offsets: np.ndarray, radius: float
) -> np.ndarray:
    """Return all possible optima: the desired point, its projections, and intersections of any two lines."""
    lines = [(a, b) for a, b in zip(normals, offsets, strict=True) if np.isfinite(b) and np.isfinite(a).all()]
    candidates = [desired, desired * radius / max(np.hypot(*desired), 1e-300)]
    for k, (a, b) in enumerate(lines):
        candidates.append(desired - (a @ desired - b) * a)
        if abs(b) <= radius:
            half = np.sqrt(radius**2 - b**2) * np.array([-a[1], a[0]])
            candidates += [a * b + half, a * b - half]
        for c, d in lines[:k]:
            matrix = np.array([a, c])
            if abs(np.linalg.det(matrix)) > 1e-9:
                candidates.append(np.linalg.solve(matrix, [b, d]))
    return np.array(candidates)


@settings(max_examples=count_examples(60))
@given(seed=st.integers(0, 2**32), m=st.integers(0, 9))
def test_the_quadratic_program_is_solved_exactly(seed: int, m: int) -> None:
    """Compare with the best of all candidates."""
    desired, normals, offsets, radius = sample_half_planes(seed, 5, m)
    best, feasible = find_nearest_allowed_points(desired, normals, offsets, radius)
    for i in range(5):
        real = np.isfinite(offsets[i]) & np.isfinite(normals[i, :, 0])
        candidates = list_candidates(desired[i], normals[i], offsets[i], radius[i])
        beyond = (candidates @ normals[i, real].T - offsets[i, real]).max(axis=1, initial=-1.0)
        allowed = candidates[(beyond < 1e-9) & (np.hypot(*candidates.T) < radius[i] + 1e-9)]
        assert feasible[i] == bool(len(allowed))
        if feasible[i]:
            shortest = np.hypot(*(allowed - desired[i]).T).min()
            assert np.hypot(*(best[i] - desired[i])) == pytest.approx(shortest, abs=1e-8)
            assert np.hypot(*best[i]) <= radius[i] + 1e-9
            assert (normals[i, real] @ best[i] <= offsets[i, real] + 1e-9).all()


def test_the_solution_agrees_with_a_general_solver() -> None:
    desired, normals, offsets, radius = sample_half_planes(7, 20, 6)
    is_empty = np.isinf(offsets) | np.isnan(normals[..., 0])
    normals[is_empty] = (1.0, 0.0)
    offsets[is_empty] = 9.0
    best, feasible = find_nearest_allowed_points(desired, normals, offsets, radius)
    assert 5 < feasible.sum() < 20
    for i in np.flatnonzero(feasible):
        solution = minimize(
            lambda u, i=i: ((u - desired[i]) ** 2).sum(),
            best[i] * 0.9,
            constraints=[
                {"type": "ineq", "fun": lambda u, i=i: offsets[i] - normals[i] @ u},
                {"type": "ineq", "fun": lambda u, i=i: radius[i] ** 2 - u @ u},
            ],
            method="SLSQP",
            options={"ftol": 1e-13},
        )
        np.testing.assert_allclose(best[i], solution.x, atol=1e-5)


def test_no_robots_and_no_constraints_are_valid() -> None:
    best, feasible = find_nearest_allowed_points(
        np.zeros((0, 2)), np.zeros((0, 3, 2)), np.zeros((0, 3)), np.zeros(0)
    )
    assert best.shape == (0, 2)
    assert feasible.shape == (0,)
    best, feasible = find_nearest_allowed_points(
        np.array([[3.0, 4.0]]), np.zeros((1, 0, 2)), np.zeros((1, 0)), np.ones(1)
    )
    np.testing.assert_allclose(best, [[0.6, 0.8]])
    assert feasible.all()


@dataclass(frozen=True)
class Headlong:
    """Drives each robot straight to a goal as hard as possible, through walls and other robots if allowed."""

    goals: tuple[tuple[float, float], ...]
    filter: Barrier
    name: ClassVar[str] = "headlong"
    label: ClassVar[str] = "Headlong"
    summary: ClassVar[str] = "for a test"

    @property
    def scanning(self) -> Scanning:
        return self.filter.scanning

    def begin(self, region: Region, team: Team) -> BarrierMemory:
        return self.filter.begin(region, team)

    def decide(self, seen: Observations, memory: BarrierMemory) -> Decision:
        desired = 50.0 * (np.array(self.goals) - seen.positions)
        accelerations, memory = self.filter.certify(seen, memory, desired)
        return Decision(accelerations + 2.0 * seen.velocities, memory=memory)


def measure_min_gaps(simulation: Simulation, seconds: float) -> tuple[float, float]:
    """Return the minimum gaps between robots, and between robots and walls, over a run."""
    robots = np.inf
    walls = np.inf
    radius = simulation.team.radius
    both = np.add.outer(radius, radius) + np.diag(np.full(len(radius), -np.inf))
    for _ in range(round(seconds / simulation.dt)):
        simulation.step()
        positions = simulation.positions
        points = simulation.observe_and_decide().seen.obstacle_points
        robots = min(robots, float((np.hypot(*(positions[:, None] - positions).T) - both).min()))
        walls = min(walls, float(np.nanmin(np.hypot(*(positions - points).T) - radius, initial=np.inf)))
    return robots, walls


@pytest.mark.parametrize(("name", "seed"), [("rooms", 0), ("cave", 1), ("blocks-a", 2)])
def test_no_robot_comes_closer_than_the_safe_distance(name: str, seed: int) -> None:
    """The claim of the paper: robots that start at the safe distance keep it, from robots and from walls."""
    environment = load_map(name)
    starts = environment.start().sample(6, seed=seed, radius=0.16)
    robots, walls = measure_min_gaps(Simulation(environment, Barrier(safe_gap=0.05), starts), 8.0)
    assert robots > 0.05 - 1e-3
    assert walls > 0.05 - 1e-3


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_robots_that_drive_through_each_other_are_stopped(speed: float) -> None:
    """Each robot on a circle drives straight to the opposite side at full speed."""
    angle = np.arange(6) * np.pi / 3 + 0.1
    ring = 5.0 + 3.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    controller = Headlong(tuple((10 - x, 10 - y) for x, y in ring.tolist()), Barrier(safe_gap=0.05))
    team = Team.homogeneous(6, max_speed=speed)
    robots, _ = measure_min_gaps(Simulation(SQUARE, controller, ring, team), 8.0)
    assert 0.05 - 1e-3 < robots < 0.3


@pytest.mark.parametrize("seed", [0, 1])
def test_robots_that_drive_through_walls_are_stopped(seed: int) -> None:
    environment = load_map("rooms")
    starts = environment.start("uniform").sample(6, seed=seed, radius=0.16)
    goals = tuple((x, y) for x, y in environment.start("uniform").sample(6, seed=seed + 9).tolist())
    robots, walls = measure_min_gaps(Simulation(environment, Headlong(goals, Barrier()), starts), 5.0)
    assert robots > 0.05 - 1e-3
    assert 0.05 - 1e-3 < walls < 0.1


def test_robots_that_start_too_close_to_each_other_separate() -> None:
    simulation = Simulation(SQUARE, Barrier(safe_gap=0.1), [[5.0, 5.0], [5.21, 5.0]])
    robots, _ = measure_min_gaps(simulation, 3.0)
    assert robots > 0.0
    assert measure_min_gaps(simulation, 1.0)[0] > 0.1


def test_far_from_obstacles_and_robots_it_is_lloyds_algorithm() -> None:
    seen = Observations(
        np.array([[3.0, 5.0], [7.0, 5.0]]),
        np.zeros((2, 2)),
        Neighbors(2),
        np.full((2, 2), np.nan),
        SQUARE.region,
    )
    controller = Barrier()
    decision = controller.decide(seen, controller.begin(SQUARE.region, Team.homogeneous(2)))
    np.testing.assert_allclose(decision.terms["barrier"], 0.0, atol=1e-12)
    np.testing.assert_allclose(decision.forces, decision.terms["attraction"] + decision.terms["barrier"])


def test_velocities_of_neighbors_are_derived_from_their_positions() -> None:
    """An approaching robot allows less acceleration than one at rest there, or one that drives ahead."""
    controller = Barrier()
    team = Team.homogeneous(2)
    here = Observations(
        np.array([[3.0, 5.0], [3.4, 5.0]]),
        np.array([[0.3, 0.0], [0.0, 0.0]]),
        Neighbors(2),
        np.full((2, 2), np.nan),
        SQUARE.region,
        time=1.0,
    )
    ahead = np.array([[10.0, 0.0], [0.0, 0.0]])

    def compute_allowed_force(previous_x: float) -> float:
        previous = replace(here, positions=np.array([[3.0, 5.0], [previous_x, 5.0]]), time=1.0 - 1 / 60)
        _, memory = controller.certify(previous, controller.begin(SQUARE.region, team), ahead)
        return float(controller.certify(here, memory, ahead)[0][0, 0])

    approaching = compute_allowed_force(3.4 + 0.3 / 60)
    standing = compute_allowed_force(3.4)
    leaving = compute_allowed_force(3.4 - 0.3 / 60)
    assert approaching < standing < leaving
    # The certificate by hand: alpha 1.6 for each robot, D_s 0.25, the root rounded over 1 mm.
    root = np.sqrt(2 * 3.2)
    h = root * (np.sqrt(0.151) - np.sqrt(0.001)) - 0.3
    assert standing == pytest.approx((20 * h**3 - 0.3 * root / (2 * np.sqrt(0.151))) / 2, rel=1e-9)


def test_runs_are_reproducible() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(6, seed=1)
    first = Simulation(rooms, Barrier(), starts).run(1.5)
    second = Simulation(rooms, Barrier(), starts).run(1.5)
    assert first.positions.tobytes() == second.positions.tobytes()
