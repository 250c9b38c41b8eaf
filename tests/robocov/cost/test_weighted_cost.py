"""The coverage cost (22) with a density: exact weights, its value, its gradient, the optimum."""

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
    plain, one = CoverageCost(ROOMS, 32)(ROBOTS), CoverageCost(ROOMS.with_density(Uniform()), 32)(ROBOTS)
    assert (plain.mean_distance, plain.value) == (one.mean_distance, one.value)
    assert np.array_equal(plain.gradient, one.gradient)
    three = CoverageCost(ROOMS.with_density(Uniform(3.0)), 32)(ROBOTS)
    assert three.mean_distance == plain.mean_distance
    assert three.value == pytest.approx(3.0 * plain.value, rel=1e-14)


@pytest.mark.parametrize("density", [GAUSSIANS["two"], POLYGONS["rooms"]])
def test_the_gradient_agrees_with_finite_differences(density):
    cost, step = CoverageCost(ROOMS.with_density(density), 24), 1e-6
    slope = cost(ROBOTS).gradient
    for i in range(len(ROBOTS)):
        for axis in (0, 1):
            ends = []
            for sign in (1.0, -1.0):
                moved = ROBOTS.copy()
                moved[i, axis] += sign * step
                ends.append(cost(moved).value)
            assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(slope[i, axis], rel=1e-4, abs=1e-4)


def test_another_density_shares_the_geodesics():
    cost = CoverageCost(ROOMS, 24)
    other = ROOMS.with_density(GAUSSIANS["two"])
    quick, slow = cost.with_density(other), CoverageCost(other, 24)
    assert quick.geodesics is cost.geodesics
    assert quick(ROBOTS).value == slow(ROBOTS).value and cost.weights is None
    assert quick.with_density(ROOMS)(ROBOTS).value == cost(ROBOTS).value


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
    spot = (6.2, 2.0)
    heavy = ROOMS.with_density(Gaussians((Gaussian(spot, 50.0, sigma=0.6),), 0.1))
    best = find_optimum(heavy, 1, lattice=32, restarts=4)
    assert np.hypot(*(best.positions[0] - spot)) < 0.3
    both = find_optimum(heavy, 3, lattice=32, restarts=4)
    plain = find_optimum(ROOMS, 3, lattice=32, restarts=4)
    cost = CoverageCost(heavy, 32)
    assert both.mean_distance == pytest.approx(cost(both.positions).mean_distance)
    assert both.mean_distance < 0.8 * cost(plain.positions).mean_distance


@pytest.mark.parametrize("controller", [Rapf(), Lloyd()])
def test_robots_move_to_where_the_density_is_high(controller):
    square = Environment("square", RING)
    heavy = square.with_density(Gaussians((Gaussian((6.5, 6.5), 20.0, sigma=0.8),), 0.1))
    starts = np.array([[1.0, 1.0], [1.5, 1.0], [1.0, 1.5], [2.0, 2.0]])
    ends = [Simulation(each, controller, starts, dt=0.05).run(20.0).positions[-1] for each in (heavy, square)]
    near = [np.sort(np.hypot(*(end - (6.5, 6.5)).T)) for end in ends]
    assert near[0][1] < 0.7 * near[1][1]
    again = Simulation(heavy, controller, starts, dt=0.05).run(20.0).positions[-1]
    assert np.array_equal(again, ends[0])


def test_a_simulation_continues_with_another_density():
    square = Environment("square", RING)
    heavy = square.with_density(GAUSSIANS["two"])
    simulation = Simulation(square, Rapf(), ROBOTS)
    for _ in range(30):
        simulation.step()
    twin, anew = simulation.with_density(heavy), simulation.with_changes(environment=heavy)
    assert simulation.environment is square and twin.environment is heavy
    assert twin.observe_and_decide().seen.density is heavy.density
    for _ in range(30):
        twin.step()
        anew.step()
    assert np.array_equal(twin.positions, anew.positions)
