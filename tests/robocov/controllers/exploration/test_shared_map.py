"""Coverage with a map that the robots share: frontiers, candidates and assigned goals."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS, Rapf, get_information, make_controller
from robocov.controllers.exploration.frontier_median import FrontierMedian
from robocov.controllers.exploration.greedy_submodular import GreedySubmodular
from robocov.controllers.exploration.scan_exchange import ScanExchange
from robocov.controllers.exploration.shared_map import (
    Candidates,
    Group,
    Placement,
    Plan,
    RobotLimits,
    Situation,
    assign_goals,
)
from robocov.controllers.exploration.visits import VISIT_RADIUS_M
from robocov.controllers.exploration.voronoi_graph import VoronoiGraphCoverage
from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.metrics import compute_clearances, count_contacts
from robocov.observation import Observations, Scans
from robocov.observation.neighbors import Neighbors
from robocov.planning.discovered_map import FREE, UNKNOWN, WALL, DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.raster import Raster
from robocov.planning.window import Window
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
ROOMS = Environment(
    "two rooms",
    SQUARE,
    (
        WallObstacle(((4.0, 0.0), (4.0, 5.0)), 0.2),
        WallObstacle(((4.0, 6.2), (4.0, 8.0)), 0.2),
        WallObstacle(((0.0, 4.0), (2.5, 4.0)), 0.2),
    ),
)
CORNER = [[0.8, 0.8], [1.3, 0.8], [0.8, 1.3], [1.3, 1.3]]
NAMES = ("frontier-median", "greedy-submodular", "voronoi-graph")
RASTER = Raster(ROOMS.region, 0.1)


def build_simulation(name: str, conditions: Conditions | None = None, **limits: float) -> Simulation:
    """Return a simulation of four robots that start in a corner of the two rooms."""
    controller = make_controller(name, {"nodes": 400.0})
    team = Team.homogeneous(len(CORNER), **limits)
    return Simulation(ROOMS, controller, CORNER, team, dt=0.05, conditions=conditions or Conditions())


def build_situation(state: np.ndarray, positions: list[list[float]]) -> Situation:
    """Return the situation of robots without a previous plan on a map with given cells."""
    known_map = DiscoveredMap(RASTER, state.astype(np.uint8))
    window = Window.build_around(RASTER, np.array([1.0, 1.0]), np.inf, 400)
    robot_count = len(positions)
    return Situation(
        group=Group(np.arange(robot_count), np.array(positions), message_times=np.zeros(robot_count)),
        previous_plan=None,
        known_map=known_map,
        planner=GridPlanner(known_map, window, 0.13),
        density=None,
        limits=RobotLimits(radius=0.1, max_speed=1.0, sensing_range=3.0),
    )


def continue_situation(
    situation: Situation, placement: Placement, positions: np.ndarray, message_times: list[float]
) -> Situation:
    """Return the situation after a plan, with the same map."""
    previous_plan = Plan(
        group=situation.group,
        placement=placement,
        known_map=situation.known_map,
        planner=situation.planner,
        density=None,
    )
    group = Group(situation.group.robots, np.asarray(positions), np.array(message_times))
    return situation._replace(group=group, previous_plan=previous_plan)


def build_state_with_unknown_sides() -> np.ndarray:
    """Return the cells of a map whose left and right sides are unknown."""
    state = np.full(RASTER.shape, FREE)
    state[:, :20] = UNKNOWN
    state[:, 60:] = UNKNOWN
    return state


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_the_team_covers_both_rooms_without_contacts_and_comes_to_rest(name: str) -> None:
    record = build_simulation(name).run(40.0)
    clearance = compute_clearances(record)
    assert count_contacts(record, clearance) == 0
    assert clearance.min() > 0.005
    cost = CoverageCost(ROOMS, lattice=32)
    rapf = Simulation(ROOMS, Rapf(), CORNER, dt=0.05).run(40.0)
    assert cost(record.positions[-1]).mean_distance < 0.9 * cost(rapf.positions[-1]).mean_distance
    assert (record.positions[-1, :, 0] > 4.1).sum() == 2
    assert np.abs(record.positions[-1] - record.positions[-40]).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("limits", [{"communication_range": 2.0}, {"sensing_range": 1.0}])
def test_with_short_ranges_the_team_comes_to_rest_without_contacts(
    name: str, limits: dict[str, float]
) -> None:
    record = build_simulation(name, **limits).run(120.0)
    assert count_contacts(record, compute_clearances(record)) == 0
    assert np.abs(record.positions[-1] - record.positions[-40]).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_runs_are_reproducible_and_copies_continue_identically(name: str) -> None:
    first = build_simulation(name)
    second = build_simulation(name)
    for _ in range(50):
        first.step()
        second.step()
    copy = first.copy()
    for simulation in (first, second, copy):
        for _ in range(50):
            simulation.step()
    assert first.positions.tobytes() == second.positions.tobytes() == copy.positions.tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_failed_robots_are_forgotten(name: str) -> None:
    simulation = build_simulation(name, Conditions(failures=((4, 2.0),)))
    simulation.run(30.0)
    assert simulation.memory.plans[0].group.robots.tolist() == [0, 1, 2]


@pytest.mark.parametrize("name", NAMES)
def test_controllers_state_that_they_share_maps(name: str) -> None:
    assert get_information(CONTROLLERS[name]) == "shared map"


def test_the_number_of_nodes_is_checked() -> None:
    with pytest.raises(ParameterError, match=r"voronoi-graph.nodes: expected a whole number from 16"):
        make_controller("voronoi-graph", {"nodes": 3})


def test_goals_are_assigned_with_the_smallest_sum_of_squared_path_lengths() -> None:
    rng = np.random.default_rng(1)
    situation = build_situation(np.full(RASTER.shape, FREE), rng.uniform(1, 7, (5, 2)).tolist())
    planner = situation.planner
    nodes = rng.choice(np.flatnonzero(planner.map_window.has_clearance), 5, replace=False)
    goals = planner.map_window.nodes[nodes]
    path_lengths = np.array(
        [planner.compute_distances_from(position[None])[nodes] for position in situation.positions]
    )
    best = min(permutations(range(5)), key=lambda order: (path_lengths[range(5), order] ** 2).sum())
    np.testing.assert_array_equal(assign_goals(situation, goals), goals[list(best)])


THREE_ROBOTS = [[4.0, 3.0], [4.0, 5.0], [4.0, 4.0]]


def test_every_narrow_passage_has_candidates() -> None:
    """Regularly spaced nodes miss every other passage."""
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    for first_row in range(2, 78, 8):
        state[first_row : first_row + 4, 8:72] = WALL
    window = Window.build_around(RASTER, np.array([4.0, 4.0]), np.inf, 1600)
    planner = GridPlanner(DiscoveredMap(RASTER, state), window, 0.13)
    situation = build_situation(state, THREE_ROBOTS)._replace(planner=planner)
    candidates = Candidates.build_spread_out(situation, np.ones(len(planner.map_window.nodes)))
    distances = planner.compute_distances_from(candidates.positions)
    assert distances[planner.map_window.has_clearance].max() < 1.0


def test_on_a_complete_map_there_is_no_frontier() -> None:
    state = np.full(RASTER.shape, FREE)
    assert FrontierMedian().compute_placement(build_situation(state, THREE_ROBOTS)).is_final


def test_single_unknown_cells_are_not_a_frontier() -> None:
    state = np.full(RASTER.shape, FREE)
    state[20:60:5, 10:70:4] = UNKNOWN
    assert FrontierMedian().compute_placement(build_situation(state, THREE_ROBOTS)).is_final


def test_robots_move_to_different_frontiers() -> None:
    """Both sides of the map are unknown."""
    state = build_state_with_unknown_sides()
    placement = FrontierMedian().compute_placement(build_situation(state, THREE_ROBOTS))
    assert not placement.is_final
    x = np.sort(placement.goals[:, 0])
    assert x[0] == pytest.approx(2.05)
    assert x[-1] == pytest.approx(5.95)


def test_unknown_space_behind_a_wall_has_no_frontier() -> None:
    state = np.full(RASTER.shape, FREE)
    state[:, :20] = UNKNOWN
    state[:, 60:] = UNKNOWN
    state[:, 20] = WALL
    state[:, 59] = WALL
    assert FrontierMedian().compute_placement(build_situation(state, THREE_ROBOTS)).is_final


def test_frontiers_that_no_robot_can_reach_are_dropped() -> None:
    """The frontier is on the other side of a wall, which the robots have looked over."""
    state = np.full(RASTER.shape, FREE)
    state[:, :20] = UNKNOWN
    state[:, 30:32] = WALL
    assert FrontierMedian().compute_placement(build_situation(state, THREE_ROBOTS)).is_final
    state[40:48, 30:32] = FREE
    assert not FrontierMedian().compute_placement(build_situation(state, THREE_ROBOTS)).is_final


def test_robots_move_to_a_voronoi_graph_that_has_fewer_vertices_than_there_are_robots() -> None:
    """Before a wall is seen, the graph of a convex region has only few vertices."""
    empty = Environment("empty", SQUARE)
    simulation = Simulation(empty, VoronoiGraphCoverage(), CORNER, Team.homogeneous(len(CORNER)))
    for _ in range(2):
        simulation.step()
    goals = simulation.memory.plans[0].placement.goals
    distances = np.hypot(*(goals - CORNER).T)
    is_moving = distances > 1.0
    assert is_moving.any() and not is_moving.all()
    assert (distances[~is_moving] < 0.1).all()


def test_visits_are_over_when_robots_arrive() -> None:
    situation = build_situation(build_state_with_unknown_sides(), THREE_ROBOTS)
    first = FrontierMedian().compute_placement(situation)
    assert first.visits is not None
    later = continue_situation(situation, first, first.goals, [1.0, 1.0, 1.0])
    second = FrontierMedian().compute_placement(later)
    assert second.visits is not None
    assert second.visits.find_excluded(first.goals).all()
    distances = np.hypot(*(second.goals[:, None] - first.goals).transpose(2, 0, 1))
    assert distances.min() >= VISIT_RADIUS_M


def test_assumed_arrivals_end_no_visit() -> None:
    """Robots 1 and 2 are out of range, and are assumed to have arrived."""
    situation = build_situation(build_state_with_unknown_sides(), THREE_ROBOTS)
    first = FrontierMedian().compute_placement(situation)
    positions = first.goals.copy()
    positions[0] = situation.positions[0]
    later = continue_situation(situation, first, positions, [1.0, 0.0, 0.0])
    second = FrontierMedian().compute_placement(later)
    assert second.visits is not None
    assert not second.visits.is_over.any()
    assert not second.is_final


def test_targets_reported_by_others_are_not_visited() -> None:
    situation = build_situation(build_state_with_unknown_sides(), THREE_ROBOTS)
    first = FrontierMedian().compute_placement(situation)
    target = first.goals[0]
    later = continue_situation(situation, first, situation.positions, [1.0, 1.0, 1.0])
    assert later.previous_plan is not None
    informed = later._replace(previous_plan=later.previous_plan.add_reported_visits(target[None]))
    goals = FrontierMedian().compute_placement(later).goals
    informed_goals = FrontierMedian().compute_placement(informed).goals
    assert np.hypot(*(goals - target).T).min() < VISIT_RADIUS_M
    assert np.hypot(*(informed_goals - target).T).min() >= VISIT_RADIUS_M


UNVISITED_TARGET = np.array([0.2, 0.2])
"""A point that no robot visits."""


def build_simulation_with_report(communication_range: float) -> Simulation:
    """Return a simulation of three slow robots, of which robot 0 alone knows that a visit is over.

    With a communication range of 2 m, robot 1 is in range of robots 0 and 2, which are out of range of each
    other.
    """
    controller = make_controller("frontier-median", {"nodes": 400.0})
    team = Team.homogeneous(3, communication_range=communication_range, max_speed=0.02)
    starts = [[1.0, 1.0], [2.5, 1.0], [2.5, 2.5]]
    simulation = Simulation(ROOMS, controller, starts, team, dt=0.05)
    for _ in range(5):
        simulation.step()
    plans = list(simulation.memory.plans)
    plans[0] = plans[0].add_reported_visits(UNVISITED_TARGET[None])
    simulation.memory = replace(simulation.memory, plans=tuple(plans))
    return simulation


def list_informed_robots(simulation: Simulation, time: float) -> list[int]:
    """Return the indices of the robots that know at a later time that the visit is over."""
    while simulation.time < time:
        simulation.step()
    visits = [plan.placement.visits for plan in simulation.memory.plans]
    return [robot for robot in range(3) if visits[robot].find_excluded(UNVISITED_TARGET[None])[0]]


def test_robots_pass_on_the_visits_that_others_report() -> None:
    """Robots plan once per second, and report what they know then."""
    simulation = build_simulation_with_report(communication_range=2.0)
    informed_robots = [list_informed_robots(simulation, time) for time in (1.5, 2.5, 3.5)]
    assert informed_robots == [[0], [0, 1], [0, 1, 2]]


def test_a_team_in_range_of_each_other_reports_visits_only_after_a_robot_has_come_into_range() -> None:
    simulation = build_simulation_with_report(communication_range=10.0)
    copy = simulation.copy()
    assert list_informed_robots(simulation, 3.5) == [0]
    plans = list(copy.memory.plans)
    group = plans[0].group
    # In this group of the previous plan, robot 1 was out of range.
    plans[0] = replace(plans[0], group=group._replace(message_times=group.message_times - [0.0, 1.0, 0.0]))
    copy.memory = replace(copy.memory, plans=tuple(plans))
    assert list_informed_robots(copy, 3.5) == [0, 1, 2]


def build_situation_with_short_frontier() -> Situation:
    """Return the situation of five robots, for some of which the only frontier has no utility."""
    state = np.full(RASTER.shape, FREE)
    state[38:42, :4] = UNKNOWN
    return build_situation(state, [[1.5 + 0.3 * k, 4.0] for k in range(5)])


def test_robots_without_a_target_exclude_nothing() -> None:
    situation = build_situation_with_short_frontier()
    first = FrontierMedian().compute_placement(situation)
    is_idle = (first.goals == situation.positions).all(axis=1)
    assert 0 < is_idle.sum() < 5
    later = continue_situation(situation, first, situation.positions, [1.0] * 5)
    second = FrontierMedian().compute_placement(later)
    assert second.visits is not None
    assert not second.visits.is_over.any()
    assert not second.visits.find_excluded(situation.positions).any()


def test_targets_of_robots_out_of_range_are_shared() -> None:
    """A robot remains without a target while it hears the others, and shares theirs when it does not."""
    situation = build_situation_with_short_frontier()
    first = FrontierMedian().compute_placement(situation)
    is_idle = (first.goals == situation.positions).all(axis=1)
    robot = int(is_idle.argmax())
    message_times = [0.0] * 5
    message_times[robot] = 1.0
    later = continue_situation(situation, first, first.goals, message_times)
    second = FrontierMedian().compute_placement(later)
    assert (first.goals[~is_idle] == second.goals[robot]).all(axis=1).any()


@pytest.mark.parametrize("is_moving", [False, True], ids=["at rest", "to and fro"])
def test_targets_are_given_up_after_a_limited_time(is_moving: bool) -> None:
    """One robot never arrives, and the other one is out of range."""
    state = np.full(RASTER.shape, FREE)
    state[38:42, :4] = UNKNOWN
    situation = build_situation(state, [[2.0, 4.0], [6.0, 4.0]])
    plan_counts: dict[tuple[float, ...], int] = {}
    for time in range(60):
        placement = FrontierMedian().compute_placement(situation)
        if placement.is_final:
            break
        goal = tuple(placement.goals[0])
        plan_counts[goal] = plan_counts.get(goal, 0) + 1
        position = [2.0 + is_moving * (time % 2), 4.0]
        situation = continue_situation(
            situation, placement, np.array([position, placement.goals[1]]), [time + 1.0, 0.0]
        )
    assert placement.is_final
    assert 3 < max(plan_counts.values()) < 20


def test_robots_do_not_wait_for_one_out_of_range_that_alone_can_reach_a_frontier() -> None:
    state = np.full(RASTER.shape, FREE)
    state[:, :20] = UNKNOWN
    state[:, 30:32] = WALL
    situation = build_situation(state, [[2.5, 4.0], [6.0, 4.0]])
    placement = FrontierMedian().compute_placement(situation)
    assert not placement.is_final
    later = continue_situation(situation, placement, placement.goals, [0.0, 1.0])
    assert FrontierMedian().compute_placement(later).is_final


def test_a_final_plan_is_computed_again_for_another_density() -> None:
    controller = GreedySubmodular(nodes=100.0)
    density = Gaussians((Gaussian((7.0, 7.0), 50.0, 0.5),), floor=0.01)
    seen = Observations(
        np.array([[1.0, 1.0]]), np.zeros((1, 2)), Neighbors(1), np.full((1, 2), np.nan), ROOMS.region
    )
    known_map = DiscoveredMap(RASTER, np.full(RASTER.shape, FREE, dtype=np.uint8))
    exchange = ScanExchange.build_empty(known_map, 1, robot_radii=[None])
    memory = replace(controller.begin(ROOMS.region, Team.homogeneous(1)), exchange=exchange)
    blind = Scans(np.zeros((1, 8)), np.zeros((1, 8), dtype=bool))
    memory = controller.decide(replace(seen, scans=blind), memory).memory
    first = controller.decide(replace(seen, time=0.1), memory).memory
    later = replace(seen, time=5.0)
    same = controller.decide(later, first).memory
    assert same.plans[0].placement is first.plans[0].placement
    other = controller.decide(replace(later, density=density), first).memory
    assert np.hypot(*(other.plans[0].placement.goals[0] - [7.0, 7.0])) < 1.0
