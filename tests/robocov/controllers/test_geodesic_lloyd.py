"""Lloyd's algorithm with path lengths: goals, cost, doors and limited communication."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.controllers import (
    GeodesicLloyd,
    Lloyd,
    inform_controller,
    make_controller,
)
from robocov.controllers.geodesic_lloyd import GeodesicPlanner
from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, WallObstacle, find_nearest_inside
from robocov.errors import ParameterError
from robocov.generator import generate_map
from robocov.mapfile import load_map
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.simulation import Simulation, TeamState
from robocov.team import Team

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
DOOR = Environment("door", SQUARE.boundary, (WallObstacle(((5, 0), (5, 8)), 0.2),))


def observe(positions: np.ndarray, region: Region) -> Observations:
    """Return the observations of robots at rest, in range of each other and far from obstacles."""
    n = len(positions)
    return Observations(positions, np.zeros((n, 2)), Neighbors(n), np.full((n, 2), np.nan), region)


@settings(max_examples=count_examples(8))
@given(
    seed=st.integers(0, 2**20),
    kind=st.sampled_from(["rooms", "caves", "polygons"]),
    exponent=st.sampled_from([1.0, 1.5, 2.0]),
)
def test_a_step_to_the_goals_does_not_raise_the_cost(seed: int, kind: str, exponent: float) -> None:
    """The claim of the papers, for robots without inertia and the cost with d^s."""
    environment = generate_map(seed % 20, kind=kind)
    planner = GeodesicPlanner(environment, 0.13, 32, radius=0.1)
    starts = environment.start("uniform").sample(4, seed=seed)
    positions = find_nearest_inside(planner.configuration_space, starts)
    costs = [np.nanmean(planner.cost(positions).distances ** exponent)]
    for _ in range(6):
        plan = planner.plan(observe(positions, environment.region), exponent)
        is_straight = (plan.waypoints == plan.goals).all(axis=1)
        assert (plan.remaining_lengths[is_straight] == 0.0).all()
        positions = plan.goals
        costs.append(np.nanmean(planner.cost(positions).distances ** exponent))
    # A goal inside a wall is replaced by the nearest free point, which may cost a little more.
    assert (np.diff(costs) < 0.01 * np.array(costs[:-1])).all()
    assert costs[-1] < costs[0]


def test_each_robot_divides_the_map_only_among_the_robots_in_range() -> None:
    rooms = load_map("rooms")
    planner = GeodesicPlanner(rooms, 0.13, 32, radius=0.1)
    positions = find_nearest_inside(planner.configuration_space, rooms.start("uniform").sample(5, seed=3))
    neighbor_rows = ((1, 2), (0,), (), (2, 4), (0, 1, 2, 3))
    neighbors = Neighbors(
        5,
        indptr=np.cumsum([0, *map(len, neighbor_rows)]),
        indices=np.concatenate([np.array(rows, dtype=np.int64) for rows in neighbor_rows]),
    )
    seen = replace(observe(positions, rooms.region), neighbors=neighbors)
    goals = planner.plan(seen, 2.0).goals
    for i, rows in enumerate(neighbor_rows):
        known_positions = positions[[i, *rows]]
        expected = planner.plan(observe(known_positions, rooms.region), 2.0).goals[0]
        assert goals[i].tolist() == expected.tolist()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rooms", "trap", "museum"])
def test_the_final_cost_is_lower_than_that_of_lloyd(name: str) -> None:
    environment = load_map(name)
    cost = CoverageCost(environment, 48)
    starts = environment.start().sample(5, seed=1)
    final_costs = []
    for controller in (GeodesicLloyd(), Lloyd()):
        simulation = Simulation(environment, controller, starts, dt=0.05)
        for _ in range(20 * 25):
            simulation.step()
        final_costs.append(cost(simulation.positions).mean_distance)
    assert final_costs[0] < 0.7 * cost(starts).mean_distance
    assert final_costs[0] < final_costs[1]


def test_the_cost_does_not_rise_again() -> None:
    rooms = load_map("rooms")
    cost = CoverageCost(rooms, 64)
    simulation = Simulation(rooms, GeodesicLloyd(), rooms.start().sample(6, seed=0), dt=0.05)
    costs = []
    for k in range(20 * 45):
        if k % 100 == 0:
            costs.append(cost(simulation.positions).mean_distance)
        simulation.step()
    assert (np.diff(costs) < 0.01 * costs[-1]).all()


@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_without_obstacles_a_robot_moves_to_the_median_or_the_centroid(exponent: float) -> None:
    """In a right triangle the two differ."""
    triangle = Environment("triangle", ((0, 0), (12, 0), (0, 6)))
    simulation = Simulation(triangle, GeodesicLloyd(exponent=exponent, lattice=96), [[2.0, 2.0]])
    for _ in range(60 * 20):
        simulation.step()
    x, y = np.meshgrid(np.arange(0.02, 12, 0.04), np.arange(0.02, 6, 0.04))
    is_inside = x + 2 * y < 12
    points = np.column_stack([x[is_inside], y[is_inside]])
    expected = points.mean(axis=0)
    if exponent == 1.0:
        for _ in range(200):
            weights = 1.0 / np.maximum(np.hypot(*(points - expected).T), 1e-9)
            expected = np.average(points, axis=0, weights=weights)
    np.testing.assert_allclose(simulation.positions[0], expected, atol=0.05)


def test_paths_lead_through_the_door() -> None:
    """The first way-point is at the end of the wall, as far from it as a robot keeps."""
    planner = GeodesicPlanner(DOOR, 0.13, 48, radius=0.1)
    path = planner.paths.find_path(np.array([2.0, 1.0]), np.array([8.0, 1.0]))
    assert np.hypot(*(path[1] - [4.9, 8.0])) == pytest.approx(0.13, abs=0.02)


def test_goals_on_the_same_side_of_a_wall_are_approached_straight() -> None:
    planner = GeodesicPlanner(DOOR, 0.13, 48, radius=0.1)
    plan = planner.plan(observe(np.array([[2.0, 1.0], [1.0, 2.0]]), DOOR.region), 2.0)
    assert (plan.goals[:, 0] < 4.9).all()
    np.testing.assert_array_equal(plan.waypoints, plan.goals)
    np.testing.assert_array_equal(plan.remaining_lengths, 0.0)


def test_without_a_map_it_cannot_start() -> None:
    with pytest.raises(ParameterError, match=r"'geodesic-lloyd': expected a map, call inform\(environment\)"):
        GeodesicLloyd().begin(SQUARE.region, Team.homogeneous(2))


def test_a_map_without_space_for_robots_is_rejected() -> None:
    with pytest.raises(ParameterError, match="map 'square': no space for robots that keep 6 m"):
        GeodesicLloyd(clearance=5.9).inform(SQUARE).begin(SQUARE.region, Team.homogeneous(2))


def test_the_lattice_is_a_whole_number() -> None:
    with pytest.raises(ParameterError, match=r"geodesic-lloyd\.lattice: .*whole number from 4 to 512 cells"):
        make_controller("geodesic-lloyd", {"lattice": 12.5})


def test_a_simulation_informs_the_controller_and_keeps_the_original() -> None:
    controller = GeodesicLloyd()
    simulation = Simulation(DOOR, controller, [[2.0, 2.0], [3.0, 3.0]])
    simulation.step()
    assert simulation.controller is controller
    # After a change of the map, the controller knows the new one.
    opened = simulation.with_changes(environment=SQUARE)
    fresh = Simulation(SQUARE, controller, TeamState(simulation.positions, simulation.velocities, steps=1))
    for _ in range(15):
        opened.step()
        fresh.step()
    goals = opened.observe_and_decide().decision.goals
    assert goals is not None
    np.testing.assert_allclose(goals, fresh.observe_and_decide().decision.goals, atol=0.05)


def test_plans_depend_on_the_robots_in_range_and_the_density() -> None:
    """Two robots out of communication range of each other both move to the center of the density."""
    bell = replace(SQUARE, density=Gaussians((Gaussian((7.0, 7.0), 1.0, 1.0),), floor=0.001))
    controller = inform_controller(GeodesicLloyd(exponent=2.0), bell)
    positions = np.array([[6.0, 6.5], [1.0, 1.0]])
    team = Team.homogeneous(2, communication_range=2.0)
    seen = replace(
        observe(positions, SQUARE.region),
        neighbors=Neighbors.from_ranges(positions, team.communication_range),
    )
    decision = controller.decide(seen, controller.begin(SQUARE.region, team))
    np.testing.assert_allclose(decision.goals, [[7, 7], [7, 7]], atol=0.15)


def test_runs_are_reproducible() -> None:
    starts = DOOR.start().sample(4, seed=1)
    first = Simulation(DOOR, GeodesicLloyd(), starts).run(3.0)
    second = Simulation(DOOR, GeodesicLloyd(), starts).run(3.0)
    assert first.positions.tobytes() == second.positions.tobytes()
