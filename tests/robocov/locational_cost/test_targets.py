"""Targets of robots in their cells: centroid, median and optimum of a sensor."""

from __future__ import annotations

import numpy as np
import pytest
from voronoi_cases import PENTAGON, scatter_points

from robocov.controllers import Lloyd, Rapf, make_controller
from robocov.cost import CoverageCost
from robocov.density import Uniform
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.locational_cost import Distance, Sensing, compute_locational_costs
from robocov.locational_cost.best_points import TARGETS, find_best_points, find_targets
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi import partition

POINTS = scatter_points(PENTAGON, 9, np.random.default_rng(2))


def test_each_target_is_the_optimum_of_its_performance_function() -> None:
    cells = partition(POINTS, PENTAGON)
    assert find_targets(cells, None, "centroid", 1.0) is cells.centroids
    np.testing.assert_array_equal(
        find_targets(cells, None, "median", 1.0), find_best_points(cells, Distance())
    )
    np.testing.assert_array_equal(
        find_targets(cells, None, "sensing", 0.4), find_best_points(cells, Sensing(0.4))
    )
    points = [find_targets(cells, None, target, 0.4) for target in TARGETS]
    assert np.abs(points[0] - points[1]).max() > 1e-3
    assert np.abs(points[1] - points[2]).max() > 1e-3


def test_a_uniform_density_changes_nothing() -> None:
    for density in (Uniform(1.0), Uniform(3.0)):
        cells = partition(POINTS, PENTAGON, density=density)
        for target in TARGETS:
            np.testing.assert_allclose(
                find_targets(cells, density, target, 0.4),
                find_targets(partition(POINTS, PENTAGON), None, target, 0.4),
                atol=1e-9,
            )


def test_unknown_targets_are_rejected() -> None:
    cells = partition(POINTS, PENTAGON)
    with pytest.raises(ParameterError, match="unknown target 'mediane': did you mean 'median'"):
        find_targets(cells, None, "mediane", 1.0)
    with pytest.raises(ParameterError, match=r"height: expected a number above 0, got 0\.0 m"):
        find_targets(cells, None, "sensing", 0.0)


@pytest.mark.parametrize("name", ["rapf", "lloyd"])
@pytest.mark.parametrize("target", TARGETS)
def test_controllers_pull_robots_toward_their_targets(name: str, target: str) -> None:
    n = len(POINTS)
    observations = Observations(POINTS, np.zeros((n, 2)), Neighbors(n), np.full((n, 2), np.nan), PENTAGON)
    controller = make_controller(name, {"target": target, "height": 0.7})
    decision = controller.decide(observations, controller.begin(PENTAGON, Team.homogeneous(n)))
    expected = find_targets(partition(POINTS, PENTAGON), None, target, 0.7)
    assert decision.goals is not None
    np.testing.assert_allclose(decision.goals, expected, atol=1e-12)
    force = decision.terms["attraction"]
    direction = expected - POINTS
    np.testing.assert_allclose(force[:, 0] * direction[:, 1], force[:, 1] * direction[:, 0], atol=1e-9)


def test_a_team_in_a_convex_region_comes_to_rest_at_its_targets(empty: Environment) -> None:
    """The final positions for the three targets are different."""
    starts = scatter_points(Region(np.array(empty.boundary)), 5, np.random.default_rng(4))
    final_positions = []
    for target in TARGETS:
        controller = make_controller("lloyd", {"target": target, "height": 0.5})
        positions = Simulation(empty, controller, starts=starts, dt=1 / 30).run(12.0).positions[-1]
        goals = find_targets(partition(positions, empty.region), None, target, 0.5)
        assert np.abs(positions - goals).max() < 0.1
        final_positions.append(positions)
    assert np.abs(final_positions[0] - final_positions[2]).max() > 1e-3
    assert np.abs(final_positions[0] - final_positions[1]).max() > 1e-3


def test_the_target_of_a_sensor_increases_its_information_at_equal_coverage_cost() -> None:
    box = Environment("box", ((0, 0), (12, 0), (12, 7), (0, 7)))
    starts = np.random.default_rng(0).uniform([0.5, 0.5], [11.5, 6.5], (5, 2))
    height = 0.5
    information = []
    costs = []
    for target in ("centroid", "sensing"):
        controller = Lloyd(target=target, height=height)
        positions = Simulation(box, controller, starts=starts, dt=1 / 30).run(20.0).positions[-1]
        cells = partition(positions, box.region)
        information.append(compute_locational_costs(cells.edges, np.zeros((5, 2)), Sensing(height)).sum())
        costs.append(CoverageCost(box, 48)(positions).mean_distance)
    assert 1.0002 < information[1] / information[0] < 1.01
    assert costs[1] / costs[0] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("blocked_target", ["centroid", "sensing"])
def test_a_wall_stops_a_robot_only_if_its_goal_is_straight_behind_the_wall(blocked_target: str) -> None:
    """The two targets are 1 m apart behind a wall that ends between them, so it blocks only one of them."""
    corners = ((0.0, 0.0), (12.0, 0.0), (0.0, 6.0))
    cell = partition(np.array([[3.5, 0.5]]), Region(np.array(corners)))
    goals = {target: find_targets(cell, None, target, 1.0)[0] for target in ("centroid", "sensing")}
    wall_end_x = 3.5
    assert goals["sensing"][0] + 0.4 < wall_end_x < goals["centroid"][0] - 0.4
    other_end_x = 8.0 if blocked_target == "centroid" else 0.8
    wall = WallObstacle(((wall_end_x, 1.2), (other_end_x, 1.2)), 0.1)
    room = Environment("room", corners, (wall,))
    for target, goal in goals.items():
        simulation = Simulation(room, Rapf(target=target), [[wall_end_x, 0.5]], dt=1 / 30)
        position = simulation.run(30.0).positions[-1][0]
        if target == blocked_target:
            assert position[1] < 1.0
            assert position[0] == pytest.approx(goal[0], abs=0.05)
        else:
            assert position[1] > 1.5
            assert np.hypot(*(position - goal)) < 0.4
