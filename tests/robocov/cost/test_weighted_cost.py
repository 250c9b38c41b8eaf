"""The coverage cost (22) with a density: weights, value, gradient and optimum."""

from __future__ import annotations

import numpy as np
import pytest
from density_cases import GAUSSIANS, KINDS, POLYGONS
from numpy.testing import assert_allclose

from robocov.controllers import Lloyd, Rapf
from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians, Uniform, WeightedArea, WeightedPolygons
from robocov.density.polygon_masses import compute_square_means
from robocov.environment import CircleObstacle, Environment, WallObstacle
from robocov.optimum import find_optimum
from robocov.simulation import Simulation

RING = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
ROOMS = Environment(
    "rooms", RING, (WallObstacle(((4.0, 0.0), (4.0, 5.0)), 0.2), CircleObstacle((6.0, 6.0), 0.5))
)
ROBOTS = np.array([[1.037, 1.119], [6.523, 2.071], [2.971, 6.133]])
HALVES = Environment("halves", RING, (WallObstacle(((4.0, -1.0), (4.0, 9.0)), 0.2),))


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_the_mean_distance_is_weighted_by_the_density(density):
    cost = CoverageCost(ROOMS.with_density(density), 40)
    result = cost(ROBOTS)
    weights = compute_square_means(density, cost.points, cost.spacing)
    assert result.mean_distance == pytest.approx(np.average(result.distances, weights=weights), rel=1e-12)
    mass = float(cost.environment.free_masses.sum())
    assert result.value == pytest.approx(result.mean_distance * mass, rel=1e-12)
    if density.is_uniform:
        assert result.weights is None
    else:
        assert_allclose(result.weights, weights)


def test_a_density_of_one_changes_nothing_to_the_last_bit():
    plain = CoverageCost(ROOMS, 32)(ROBOTS)
    uniform = CoverageCost(ROOMS.with_density(Uniform()), 32)(ROBOTS)
    assert (plain.mean_distance, plain.value) == (uniform.mean_distance, uniform.value)
    assert np.array_equal(plain.gradient, uniform.gradient)
    tripled = CoverageCost(ROOMS.with_density(Uniform(3.0)), 32)(ROBOTS)
    assert tripled.mean_distance == plain.mean_distance
    assert tripled.value == pytest.approx(3.0 * plain.value, rel=1e-14)


@pytest.mark.parametrize("density", [GAUSSIANS["two"], POLYGONS["rooms"]])
def test_the_gradient_agrees_with_finite_differences(density):
    cost = CoverageCost(ROOMS.with_density(density), 24)
    step = 1e-6
    gradient = cost(ROBOTS).gradient
    for i in range(len(ROBOTS)):
        for axis in (0, 1):
            values = []
            for sign in (1.0, -1.0):
                moved = ROBOTS.copy()
                moved[i, axis] += sign * step
                values.append(cost(moved).value)
            difference_quotient = (values[0] - values[1]) / (2 * step)
            assert difference_quotient == pytest.approx(gradient[i, axis], rel=1e-4, abs=1e-4)


def test_another_density_shares_the_geodesics():
    cost = CoverageCost(ROOMS, 24)
    weighted_rooms = ROOMS.with_density(GAUSSIANS["two"])
    weighted_cost = cost.with_density(weighted_rooms)
    assert weighted_cost.geodesics is cost.geodesics
    assert weighted_cost(ROBOTS).value == CoverageCost(weighted_rooms, 24)(ROBOTS).value
    assert cost.weights is None
    assert weighted_cost.with_density(ROOMS)(ROBOTS).value == cost(ROBOTS).value


def test_only_covered_components_count():
    left = WeightedArea(((0.0, 0.0), (4.0, 0.0), (4.0, 8.0), (0.0, 8.0)), 5.0)
    density = WeightedPolygons((left,), 1.0)
    result = CoverageCost(HALVES.with_density(density), 40)(np.array([[6.0, 4.0]]))
    plain = CoverageCost(HALVES, 40)(np.array([[6.0, 4.0]]))
    assert result.mean_distance == pytest.approx(plain.mean_distance, rel=1e-12)
    assert result.value == pytest.approx(plain.value, rel=1e-12)
    assert result.uncovered_area == plain.uncovered_area


def test_there_is_no_mean_distance_if_the_covered_components_have_no_mass():
    left = WeightedArea(((0.0, 0.0), (4.0, 0.0), (4.0, 8.0), (0.0, 8.0)), 5.0)
    result = CoverageCost(HALVES.with_density(WeightedPolygons((left,), 0.0)), 40)(np.array([[6.0, 4.0]]))
    assert np.isnan(result.mean_distance)
    assert not result.gradient.any()


def test_the_optimum_is_where_the_density_is_high():
    center = (6.2, 2.0)
    weighted = ROOMS.with_density(Gaussians((Gaussian(center, 50.0, sigma=0.6),), 0.1))
    single = find_optimum(weighted, 1, lattice=32, restarts=4)
    assert np.hypot(*(single.positions[0] - center)) < 0.3
    best = find_optimum(weighted, 3, lattice=32, restarts=4)
    plain = find_optimum(ROOMS, 3, lattice=32, restarts=4)
    cost = CoverageCost(weighted, 32)
    assert best.mean_distance == pytest.approx(cost(best.positions).mean_distance)
    assert best.mean_distance < 0.8 * cost(plain.positions).mean_distance


@pytest.mark.parametrize("controller", [Rapf(), Lloyd()])
def test_robots_move_to_where_the_density_is_high(controller):
    square = Environment("square", RING)
    weighted = square.with_density(Gaussians((Gaussian((6.5, 6.5), 20.0, sigma=0.8),), 0.1))
    starts = np.array([[1.0, 1.0], [1.5, 1.0], [1.0, 1.5], [2.0, 2.0]])
    final_positions = [
        Simulation(environment, controller, starts, dt=0.05).run(20.0).positions[-1]
        for environment in (weighted, square)
    ]
    distances = [np.sort(np.hypot(*(positions - (6.5, 6.5)).T)) for positions in final_positions]
    assert distances[0][1] < 0.7 * distances[1][1]
    repeated = Simulation(weighted, controller, starts, dt=0.05).run(20.0).positions[-1]
    assert np.array_equal(repeated, final_positions[0])


def test_a_simulation_continues_with_another_density():
    square = Environment("square", RING)
    weighted = square.with_density(GAUSSIANS["two"])
    simulation = Simulation(square, Rapf(), ROBOTS)
    for _ in range(30):
        simulation.step()
    continued = simulation.with_density(weighted)
    rebuilt = simulation.with_changes(environment=weighted)
    assert simulation.environment is square
    assert continued.environment is weighted
    assert continued.observe_and_decide().seen.density is weighted.density
    for _ in range(30):
        continued.step()
        rebuilt.step()
    assert np.array_equal(continued.positions, rebuilt.positions)
