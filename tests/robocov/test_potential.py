"""Potentials of repulsion and attraction: gradients, values by hand, and limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov.observation.neighbors import NeighborPositions, Neighbors
from robocov.potential import (
    CONTACT_DISTANCE,
    PotentialGains,
    compute_potential_forces,
    compute_separations,
)

coordinate = st.floats(-5, 5)
strength = st.floats(0.01, 100)


def compute_forces(
    positions: np.ndarray,
    obstacle_points: np.ndarray | None = None,
    goals: np.ndarray | None = None,
    k: tuple[float, ...] = (0.0, 2.0, 0.0, np.inf),
    neighbors: Neighbors | None = None,
    reported: np.ndarray | None = None,
) -> np.ndarray:
    """Return all forces, by strength and range of the repulsion, strength and limit of the attraction."""
    points = np.full_like(positions, np.nan) if obstacle_points is None else obstacle_points
    goals = positions if goals is None else goals
    graph = neighbors or Neighbors(len(positions))
    known = NeighborPositions.from_graph(graph, reported)
    return np.stack(compute_potential_forces(positions, known, points, goals, PotentialGains(*k)))


def compute_repulsive_force(offset: np.ndarray, k_rep: float, rho_0: float) -> np.ndarray:
    return compute_forces(offset, np.zeros_like(offset), k=(k_rep, rho_0, 0.0, np.inf))[3]


def compute_attractive_force(offset: np.ndarray, k_att: float, limit: float | None = None) -> np.ndarray:
    return compute_forces(
        np.zeros_like(offset), goals=offset, k=(0.0, 2.0, k_att, np.inf if limit is None else limit)
    )[1]


def compute_repulsive_potential(distance: np.ndarray, k_rep: float, rho_0: float) -> np.ndarray:
    """Equation (23)."""
    return np.where(distance < rho_0, 0.5 * k_rep * (1.0 / distance - 1.0 / rho_0) ** 2, 0.0)


def compute_attractive_potential(
    distance: np.ndarray, k_att: float, limit: float | None = None
) -> np.ndarray:
    """Equation (26), linear from where its slope is the limit."""
    knee = np.inf if limit is None else np.cbrt(limit / k_att)
    near = np.minimum(distance, knee)
    return 0.25 * k_att * near**4 + (0.0 if limit is None else limit * (distance - near))


def compute_gradient(energy, x: float, y: float, h: float = 1e-6) -> np.ndarray:
    def evaluate_at(a: float, b: float) -> float:
        return float(energy(np.array([np.hypot(a, b)]))[0])

    return np.array(
        [(evaluate_at(x + h, y) - evaluate_at(x - h, y)), (evaluate_at(x, y + h) - evaluate_at(x, y - h))]
    ) / (2 * h)


@given(x=coordinate, y=coordinate, k_rep=strength, rho_0=st.floats(0.2, 6))
def test_repulsion_is_minus_the_gradient_of_its_potential(
    x: float, y: float, k_rep: float, rho_0: float
) -> None:
    distance = float(np.hypot(x, y))
    if distance < 0.05 or abs(distance - rho_0) < 1e-4:
        return
    force = compute_repulsive_force(np.array([[x, y]]), k_rep, rho_0)[0]
    expected = -compute_gradient(lambda d: compute_repulsive_potential(d, k_rep, rho_0), x, y)
    np.testing.assert_allclose(force, expected, rtol=2e-4, atol=1e-5 * k_rep)


@given(x=coordinate, y=coordinate, k_att=strength, limit=st.one_of(st.none(), st.floats(0.1, 50)))
def test_attraction_is_minus_the_gradient_of_its_potential(
    x: float, y: float, k_att: float, limit: float | None
) -> None:
    if np.hypot(x, y) < 1e-3:
        return
    # the goal is the origin, the robot at (x, y)
    force = compute_attractive_force(np.array([[-x, -y]]), k_att, limit)[0]
    expected = -compute_gradient(lambda d: compute_attractive_potential(d, k_att, limit), x, y)
    np.testing.assert_allclose(force, expected, rtol=1e-3, atol=1e-4 * k_att)


def test_equation_24_agrees_with_a_value_computed_by_hand() -> None:
    force = compute_repulsive_force(np.array([[0.5, 0.0]]), k_rep=1.0, rho_0=2.0)
    np.testing.assert_allclose(force, [[(2.0 - 0.5) / 0.25, 0.0]])
    np.testing.assert_allclose(compute_repulsive_potential(np.array([0.5]), 1.0, 2.0), [0.5 * 1.5**2])


def test_equation_27_agrees_with_a_value_computed_by_hand() -> None:
    np.testing.assert_allclose(compute_attractive_force(np.array([[0.0, 2.0]]), 3.0), [[0.0, 24.0]])
    np.testing.assert_allclose(compute_attractive_potential(np.array([2.0]), 3.0), [12.0])


def test_repulsion_is_zero_beyond_its_range_and_continuous_there() -> None:
    distance = np.array([1.999999, 2.0, 2.5, 1e9])
    force = compute_repulsive_force(np.column_stack([distance, 0 * distance]), 1.0, 2.0)
    assert force[0, 0] == pytest.approx(0.0, abs=1e-6)
    assert (force[1:] == 0.0).all()
    assert (compute_repulsive_potential(distance[1:], 1.0, 2.0) == 0.0).all()


@given(distance=st.one_of(st.just(0.0), st.floats(1e-12, CONTACT_DISTANCE)))
def test_contact_is_not_singular(distance: float) -> None:
    contact_force = compute_repulsive_force(np.array([[CONTACT_DISTANCE, 0.0]]), 1.0, 2.0)
    force = compute_repulsive_force(np.array([[distance, 0.0]]), 1.0, 2.0)
    assert np.isfinite(force).all()
    if distance > 0:
        np.testing.assert_allclose(force, contact_force, rtol=1e-9)


@given(offset=st.tuples(coordinate, coordinate), k_att=strength, limit=st.floats(0.01, 100))
def test_the_limit_caps_the_attraction_and_keeps_its_direction(
    offset: tuple[float, float], k_att: float, limit: float
) -> None:
    free = compute_attractive_force(np.array([offset]), k_att)[0]
    capped = compute_attractive_force(np.array([offset]), k_att, limit)[0]
    size = np.hypot(*free)
    assert np.hypot(*capped) <= limit * (1 + 1e-12)
    if size <= limit:
        np.testing.assert_allclose(capped, free, rtol=1e-12)
    else:
        np.testing.assert_allclose(capped, free * limit / size, rtol=1e-9)


@given(st.lists(st.integers(0, 500), min_size=2, max_size=2, unique=True))
def test_robots_at_one_position_are_pushed_apart_in_opposite_directions(pair: list[int]) -> None:
    i = np.array([pair[0]])
    j = np.array([pair[1]])
    np.testing.assert_array_equal(compute_separations(i, j), -compute_separations(j, i))
    np.testing.assert_allclose(np.hypot(*compute_separations(i, j)[0]), 1.0)


@given(
    n=st.integers(1, 80),
    seed=st.integers(0, 2**32),
    rho_0=st.floats(0.1, 4.0),
    knowledge=st.sampled_from(["all", "near", "reports"]),
)
def test_all_forces_agree_with_a_sum_over_pairs(n: int, seed: int, rho_0: float, knowledge: str) -> None:
    rng = np.random.default_rng(seed)
    positions, goals, points = rng.uniform(0.0, 10.0, (3, n, 2))
    points[rng.random(n) < 0.3] = np.nan
    neighbors = Neighbors(n) if knowledge == "all" else Neighbors.from_ranges(positions, rng.uniform(0, 8, n))
    robot, other = neighbors.list_pairs()
    neighbor_positions = positions[other]
    reported = None
    if knowledge == "reports":
        neighbor_positions = neighbor_positions + 0.1 * rng.normal(size=(len(other), 2))
        reported = neighbor_positions
    all_forces = compute_forces(positions, points, goals, (0.7, rho_0, 1.3, 5.0), neighbors, reported)
    expected = np.zeros((4, n, 2))
    for i, position in zip(robot.tolist(), neighbor_positions, strict=True):
        expected[2, i] += compute_repulsive_force((positions[i] - position)[None], 0.7, rho_0)[0]
    sensed = np.isfinite(points[:, 0])
    expected[3, sensed] = compute_repulsive_force((positions - points)[sensed], 0.7, rho_0)
    expected[1] = compute_attractive_force(goals - positions, 1.3, 5.0)
    expected[0] = expected[1:].sum(axis=0)
    np.testing.assert_allclose(all_forces, expected, rtol=1e-9, atol=1e-9)
    crowd = np.concatenate([positions, positions])
    repulsion = compute_forces(crowd, k=(0.7, rho_0, 0.0, np.inf))[2]
    assert np.isfinite(repulsion).all()
    if n == 1:
        np.testing.assert_array_equal(repulsion[0], -repulsion[1])
