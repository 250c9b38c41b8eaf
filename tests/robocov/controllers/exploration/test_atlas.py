"""The atlas controller: shared maps, narrow gaps, rest, and reproducible runs."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robocov.conditions import Conditions, Failure
from robocov.controllers import Atlas, AtlasShared, Rapf, get_information, make_controller
from robocov.controllers.exploration import atlas, team_goals, team_knowledge
from robocov.controllers.exploration.atlas_memory import (
    AtlasMemory,
    OwnMotion,
    PlanBasis,
    PlannerState,
    TeamGoals,
    TeamKnowledge,
    TraveledPath,
)
from robocov.controllers.exploration.team_goals import Cooperation
from robocov.controllers.exploration.team_knowledge import update_knowledge
from robocov.controllers.exploration.teammates import Teammates
from robocov.cost import CoverageCost
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.mapfile import load_map
from robocov.metrics import compute_clearances, count_contacts
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.optimum import find_optimum
from robocov.planning.discovered_map import FREE, UNKNOWN, WALL, DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.own_goal import OwnGoal
from robocov.planning.raster import Raster
from robocov.planning.window import Window
from robocov.record import Record
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
SPIRAL = Environment(
    "spiral",
    ((0.0, 0.0), (7.0, 0.0), (7.0, 7.0), (0.0, 7.0)),
    (
        WallObstacle(
            ((0.0, 1.2), (5.8, 1.2), (5.8, 5.8), (1.2, 5.8), (1.2, 2.4), (4.6, 2.4), (4.6, 4.6)), 0.12
        ),
    ),
)
"""A corridor that winds to the center. Its walls hide what is behind the next corner."""
SPIRAL_STARTS = [[6.5, 0.3], [6.0, 0.3], [5.5, 0.3], [5.0, 0.3]]
HALL = Environment("hall", ((0.0, 0.0), (20.0, 0.0), (20.0, 3.0), (0.0, 3.0)))

ROBOT_RADIUS_M = 0.1
PILLARS_X_M = 7.0
"""Position of the row of pillars in the map "gaps"."""
MIN_CLEARANCE_M = 0.005
"""Robots that do not touch anything have at least this clearance."""
CLOSE_CLEARANCE_M = 0.05
"""A robot with a smaller clearance has to turn carefully."""


def build_simulation(kind: type[Atlas] = Atlas, n: int = 4) -> Simulation:
    """Return a simulation of robots that start in a corner of the two rooms."""
    return Simulation(ROOMS, kind(), CORNER[:n], Team.homogeneous(n), dt=0.05)


def run_until(simulation: Simulation, time: float) -> None:
    """Step a simulation until its time is at least this, s."""
    while simulation.time < time:
        simulation.step()


SHARES_RUN = pytest.mark.xdist_group("run of atlas in two rooms")
"""Tests of the same run, which one worker executes once."""


@pytest.fixture(scope="module")
def finished_run() -> tuple[Simulation, Record]:
    simulation = build_simulation()
    record = simulation.run(50.0)
    return simulation, record


@pytest.fixture(scope="module")
def final_simulation(finished_run: tuple[Simulation, Record]) -> Simulation:
    simulation, _ = finished_run
    return simulation


@pytest.mark.slow
@SHARES_RUN
def test_the_team_spreads_to_both_rooms_and_covers_more_than_with_rapf(final_simulation: Simulation) -> None:
    cost = CoverageCost(ROOMS, lattice=32)
    rapf = Simulation(ROOMS, Rapf(), CORNER, dt=0.05)
    for _ in range(1000):
        rapf.step()
    assert cost(final_simulation.positions).mean_distance < 0.9 * cost(rapf.positions).mean_distance
    assert (final_simulation.positions[:, 0] > 4.1).sum() == 2


@pytest.mark.slow
@SHARES_RUN
def test_the_team_comes_to_rest(final_simulation: Simulation) -> None:
    simulation = final_simulation.copy()
    for _ in range(80):
        simulation.step()
    assert np.abs(simulation.positions - final_simulation.positions).max() < 0.05


@pytest.mark.slow
@SHARES_RUN
def test_robots_plan_again_when_all_others_have_come_to_rest(final_simulation: Simulation) -> None:
    """Only then they may relocate, although nothing else has changed."""
    assert all(state.motion.is_idle and state.basis.is_quiet for state in final_simulation.memory.states)


@pytest.mark.slow
def test_robots_that_turn_close_to_a_narrow_gap_do_not_touch_its_rim() -> None:
    """Turning must leave acceleration for braking.

    From exactly these starts, a robot once used all of its acceleration to turn, and touched a pillar.
    """
    starts = [
        (6.606354578438451, 3.582792226112388), (5.82911286359781, 4.5164725372712775),
        (5.893535020701633, 3.786360212980583), (5.341358005239178, 3.400674457312083),
        (6.339880443956025, 4.543777359503736), (5.68626602446254, 3.4239886537883932),
    ]  # fmt: skip
    team = Team.homogeneous(6, sensing_range=6.0)
    record = Simulation(load_map("gaps"), Atlas(), starts, team, dt=0.02).run(11.0)
    # Some robots pass between the pillars, and at least one of them comes close to a pillar.
    assert (record.positions[-1, :, 0] > PILLARS_X_M).any()
    assert MIN_CLEARANCE_M < compute_clearances(record).min() < CLOSE_CLEARANCE_M


@pytest.mark.slow
@SHARES_RUN
def test_robots_move_without_contacts(finished_run: tuple[Simulation, Record]) -> None:
    _, record = finished_run
    clearance = compute_clearances(record)
    assert count_contacts(record, clearance) == 0
    assert clearance.min() > MIN_CLEARANCE_M


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Atlas, AtlasShared])
def test_runs_are_reproducible_and_copies_continue_identically(kind: type[Atlas]) -> None:
    first = build_simulation(kind)
    second = build_simulation(kind)
    for _ in range(40):
        first.step()
        second.step()
    copy = first.copy()
    for simulation in (first, second, copy):
        for _ in range(40):
            simulation.step()
    assert first.positions.tobytes() == second.positions.tobytes() == copy.positions.tobytes()


@pytest.mark.slow
def test_decisions_do_not_change_earlier_memories() -> None:
    simulation = build_simulation()
    for _ in range(40):
        simulation.step()
    memory: AtlasMemory = simulation.memory
    assert memory.returns is not None
    indices = memory.waypoint_indices.copy()
    returns = memory.returns.copy()
    map_states = [known_map.state.copy() for known_map in memory.maps]
    restarted = simulation.with_memory(memory)
    for _ in range(40):
        simulation.step()
        restarted.step()
    np.testing.assert_array_equal(memory.waypoint_indices, indices)
    np.testing.assert_array_equal(memory.returns, returns)
    np.testing.assert_array_equal([known_map.state for known_map in memory.maps], map_states)
    assert simulation.positions.tobytes() == restarted.positions.tobytes()


@pytest.mark.slow
def test_only_shared_maps_are_equal_and_contain_more() -> None:
    unknown_counts = {}
    for kind in (Atlas, AtlasShared):
        simulation = build_simulation(kind)
        for _ in range(100):
            simulation.step()
        maps = simulation.memory.maps
        assert all(known_map.raster is maps[0].raster for known_map in maps)
        unknown_counts[kind] = [np.count_nonzero(known_map.state == UNKNOWN) for known_map in maps]
    assert len(set(unknown_counts[AtlasShared])) == 1
    assert len(set(unknown_counts[Atlas])) > 1
    assert max(unknown_counts[AtlasShared]) < min(unknown_counts[Atlas])


def test_the_information_is_stated() -> None:
    assert get_information(Atlas()) == "own"
    assert get_information(AtlasShared()) == "shared map"


@pytest.mark.slow
def test_a_single_robot_moves_to_the_center() -> None:
    simulation = build_simulation(n=1)
    for _ in range(300):
        simulation.step()
    assert np.isfinite(simulation.observe_and_decide().decision.forces).all()
    assert np.hypot(*(simulation.positions[0] - CORNER[0])) > 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "duration"), [(Atlas, 60.0), (AtlasShared, 40.0)])
def test_robots_cover_winding_corridors(kind: type[Atlas], duration: float) -> None:
    """The space behind the walls could be the inside of an obstacle, but most of the cost may be there."""
    record = Simulation(SPIRAL, kind(), SPIRAL_STARTS, dt=0.05).run(duration)
    cost = CoverageCost(SPIRAL, lattice=32, radius=ROBOT_RADIUS_M)
    best = find_optimum(SPIRAL, 4, radius=ROBOT_RADIUS_M, lattice=32, restarts=4)
    assert cost(record.positions[-1]).mean_distance < 1.1 * best.mean_distance


def build_planner_state(
    known_map: DiscoveredMap,
    positions: np.ndarray,
    team_goals: np.ndarray,
    *,
    is_quiet: bool = True,
    is_heading_for_viewpoint: bool = False,
    viewpoint_length: float = 0.0,
) -> PlannerState:
    """Build the state of the first robot of a team, which is at its goal or on its way to a viewpoint."""
    window = Window.build_around(known_map.raster, np.array([4.0, 4.0]), math.inf, 1000)
    planner = GridPlanner(known_map, window, 0.15)
    robots = np.arange(len(positions))
    goal = positions[0]
    return PlannerState(
        known_map=known_map,
        next_plan_time=0.0,
        knowledge=TeamKnowledge(Teammates.build_empty()),
        path=TraveledPath(viewpoint_length=viewpoint_length),
        basis=PlanBasis(known_map, planner, robots, positions, is_quiet=is_quiet),
        team_goals=TeamGoals(planner, robots, team_goals),
        motion=OwnMotion(goal, goal if is_heading_for_viewpoint else None),
    )


def build_cooperation(
    team_size: int, *, is_agreed: bool = False, are_others_fixed: bool = True
) -> Cooperation:
    """Build the cooperation of a robot that plans for itself, or with an agreed map."""
    return Cooperation(
        is_agreed=is_agreed,
        is_joint=False,
        group_size=team_size,
        is_fixed=np.full(team_size - 1, are_others_fixed),
        savings_factor=1.0,
    )


def test_robots_look_at_open_space_that_is_expected_to_contribute_enough() -> None:
    """An unknown square of 1 m among free cells contributes 100 cells at a distance of 2 m."""
    raster = Raster(ROOMS.region, 0.1)
    state = np.full(raster.shape, FREE, dtype=np.uint8)
    state[35:45, 55:65] = UNKNOWN
    positions = np.array([[2.0, 4.0], [1.0, 1.0]])

    def find_viewpoint(stake: float, viewpoint_length: float = 0.0) -> np.ndarray | None:
        planner_state = build_planner_state(
            DiscoveredMap(raster, state), positions, positions, viewpoint_length=viewpoint_length
        )
        assert planner_state.basis is not None
        planner = planner_state.basis.planner
        node = planner.visibility.find_entry_node(positions[0])
        distances = np.full(len(planner.map_window.nodes), 2.0)
        own = OwnGoal(goal=positions[0], node=node, cell_distances=distances, cost=1e4)
        controller = Atlas(stake=stake)
        return controller._find_viewpoint(planner_state, build_cooperation(2), own, node, None)

    assert find_viewpoint(stake=0.019) is not None
    assert find_viewpoint(stake=0.021) is None
    patience = Atlas().patience * ROOMS.region.diameter
    assert find_viewpoint(stake=0.019, viewpoint_length=0.05 * patience) is not None
    assert find_viewpoint(stake=0.019, viewpoint_length=0.1 * patience) is None


def find_viewpoint_at_chamber(
    positions: list[list[float]],
    *,
    is_agreed: bool = False,
    is_quiet: bool = True,
    is_heading_for_viewpoint: bool = False,
    viewpoint_length: float = 0.0,
    other_goal: list[float] | None = None,
    cost: float = 1e4,
) -> np.ndarray | None:
    """Find the viewpoint from which the first robot looks into an unknown chamber.

    The chamber is on the right of a square of 8 m, and has a door of 1 m at x = 4, between y = 3.5 and 4.5. A
    wall at y = 6.5 divides the square. One meter of this wall is unknown; everything above it is free. The
    second robot moves to `other_goal`, or stays at its position. The cost is in cells times meters.
    """
    raster = Raster(ROOMS.region, 0.1)
    state = np.full(raster.shape, FREE, dtype=np.uint8)
    state[5:60, 40:] = WALL
    state[7:58, 42:78] = UNKNOWN
    state[35:45, 40:42] = UNKNOWN
    state[65, :] = WALL
    state[65, 30:40] = UNKNOWN
    team_goals = np.array(positions)
    if other_goal is not None:
        team_goals[1] = other_goal
    planner_state = build_planner_state(
        DiscoveredMap(raster, state),
        np.array(positions),
        team_goals,
        is_quiet=is_quiet,
        is_heading_for_viewpoint=is_heading_for_viewpoint,
        viewpoint_length=viewpoint_length,
    )
    assert planner_state.basis is not None
    planner = planner_state.basis.planner
    cooperation = build_cooperation(len(positions), is_agreed=is_agreed, are_others_fixed=other_goal is None)
    node = planner.visibility.find_entry_node(team_goals[0])
    distances = np.zeros(len(planner.map_window.nodes))
    own = OwnGoal(goal=team_goals[0], node=node, cell_distances=distances, cost=cost)
    return Atlas()._find_viewpoint_by_possible_saving(planner_state, cooperation, own, node, None)


def test_a_robot_at_its_goal_looks_into_a_chamber_if_no_other_is_closer() -> None:
    viewpoint = find_viewpoint_at_chamber([[2.0, 4.0], [1.0, 1.0]])
    assert viewpoint is not None
    assert 3.8 < viewpoint[0] < 4.1
    assert 3.5 < viewpoint[1] < 4.5
    assert find_viewpoint_at_chamber([[2.0, 4.0], [3.0, 4.0]]) is None
    # The other path may be shorter, but leads through unknown space, so it may be blocked.
    assert find_viewpoint_at_chamber([[0.5, 4.0], [3.5, 7.0]]) is not None


def test_moving_robots_are_expected_at_their_goals() -> None:
    near, far = [3.0, 4.0], [1.0, 1.0]
    assert find_viewpoint_at_chamber([[2.0, 4.0], far], other_goal=near) is None
    assert find_viewpoint_at_chamber([[2.0, 4.0], near], other_goal=far) is not None


def test_a_robot_with_its_own_map_waits_until_the_others_are_at_rest() -> None:
    positions = [[2.0, 4.0], [1.0, 1.0]]
    assert find_viewpoint_at_chamber(positions, is_quiet=False) is None
    assert find_viewpoint_at_chamber(positions, is_quiet=False, is_heading_for_viewpoint=True) is not None
    assert find_viewpoint_at_chamber(positions, is_quiet=False, is_agreed=True) is not None


def test_patches_must_save_more_after_long_paths_to_viewpoints() -> None:
    """The saving that is required doubles with each diameter of the region."""
    positions = [[2.0, 4.0], [1.0, 1.0]]
    diameter = ROOMS.region.diameter
    low, high = 1e4, 1e7
    assert find_viewpoint_at_chamber(positions, cost=high) is None
    while high > 1.02 * low:
        cost = math.sqrt(low * high)
        if find_viewpoint_at_chamber(positions, cost=cost) is None:
            high = cost
        else:
            low = cost
    for doublings in (1, 3):
        cost = low * 0.5**doublings
        short, long = (doublings - 0.1) * diameter, (doublings + 0.1) * diameter
        assert find_viewpoint_at_chamber(positions, cost=cost, viewpoint_length=short) is not None
        assert find_viewpoint_at_chamber(positions, cost=cost, viewpoint_length=long) is None


@pytest.mark.slow
def test_a_team_larger_than_a_planning_group_spreads(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (atlas, team_knowledge):
        monkeypatch.setattr(module, "MAX_PLANNING_GROUP", 4)
    empty = Environment("empty", SQUARE)
    x, y = np.meshgrid(np.linspace(0.6, 1.8, 3), np.linspace(0.6, 1.8, 3))
    starts = np.column_stack([x.ravel(), y.ravel()])
    simulation = Simulation(empty, Atlas(), starts, dt=0.05)
    run_until(simulation, 15.0)
    cost = CoverageCost(empty, lattice=16)
    assert cost(simulation.positions).mean_distance < 0.5 * cost(starts).mean_distance


def test_robots_plan_at_different_times() -> None:
    """The period is longer if nodes are far apart."""
    simulation = build_simulation()
    plan_times = [state.next_plan_time for state in simulation.memory.states]
    assert len(set(plan_times)) == 4
    assert max(plan_times) < 0.5
    run_until(simulation, 0.5)
    plan_times = [state.next_plan_time for state in simulation.memory.states]
    assert len(set(plan_times)) == 4
    assert min(plan_times) > 1.0
    assert max(plan_times) < 2.5


def test_gains_out_of_range_are_rejected() -> None:
    assert make_controller("atlas", {"period": 2}) == replace(Atlas(), period=2.0)
    with pytest.raises(ParameterError, match=r"atlas-shared.threshold: expected .*, got -1"):
        make_controller("atlas-shared", {"threshold": -1})


@pytest.mark.slow
def test_planning_starts_again_when_a_robot_fails() -> None:
    conditions = Conditions(failures=((4, 2.0),))
    simulation = Simulation(ROOMS, Atlas(), CORNER, dt=0.05, conditions=conditions)
    run_until(simulation, 1.9)
    assert max(state.path.start_time for state in simulation.memory.states[:3]) < 1.0
    run_until(simulation, 5.0)
    assert all(2.0 <= state.path.start_time < 4.5 for state in simulation.memory.states[:3])


@pytest.mark.slow
def test_required_savings_double_with_the_path_length(monkeypatch: pytest.MonkeyPatch) -> None:
    savings: list[float] = []
    find_own_goal = atlas.find_own_goal

    def record_saving(*args: Any, **kwargs: Any) -> Any:
        savings.append(kwargs["min_saving"])
        return find_own_goal(*args, **kwargs)

    monkeypatch.setattr(atlas, "find_own_goal", record_saving)
    simulation = Simulation(ROOMS, Atlas(settling=0.1), CORNER[:2], Team.homogeneous(2), dt=0.05)
    run_until(simulation, 8.0)
    path_length = max(state.path.length for state in simulation.memory.states)
    assert path_length > 3.0
    assert min(savings) == 0.002
    doublings = path_length / (0.1 * ROOMS.region.diameter)
    assert max(savings) == pytest.approx(0.002 * 2.0**doublings, rel=0.1)


@pytest.mark.slow
def test_robots_at_rest_stay_as_ready_to_move_as_they_were() -> None:
    """Required savings depend on the path length, not on time."""
    simulation = Simulation(ROOMS, Atlas(settling=0.1), CORNER[:2], Team.homogeneous(2), dt=0.05)
    run_until(simulation, 45.0)
    path_lengths = [state.path.length for state in simulation.memory.states]
    run_until(simulation, 60.0)
    assert [state.path.length for state in simulation.memory.states] == path_lengths


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Atlas, AtlasShared])
def test_a_team_at_rest_moves_again_when_a_door_opens(kind: type[Atlas]) -> None:
    boundary = ((0.0, 0.0), (12.0, 0.0), (12.0, 6.0), (0.0, 6.0))
    closed_wall = WallObstacle(((5.0, 0.0), (5.0, 6.0)), 0.2)
    open_wall = (
        WallObstacle(((5.0, 0.0), (5.0, 2.4)), 0.2),
        WallObstacle(((5.0, 3.6), (5.0, 6.0)), 0.2),
    )
    closed = Environment("closed", boundary, (closed_wall,))
    simulation = Simulation(closed, kind(), CORNER, Team.homogeneous(4), dt=0.05)
    run_until(simulation, 50.0)
    positions = simulation.positions
    run_until(simulation, 55.0)
    assert np.abs(simulation.positions - positions).max() < 1e-3
    simulation = simulation.with_changes(environment=replace(closed, name="open", obstacles=open_wall))
    run_until(simulation, 85.0)
    two_in_each_room = [[2.5, 1.5], [2.5, 4.5], [8.5, 1.5], [8.5, 4.5]]
    cost = CoverageCost(simulation.environment, lattice=48)
    assert cost(simulation.positions).mean_distance < cost(two_in_each_room).mean_distance


def test_robots_that_meet_pass_each_other_on_the_left() -> None:
    simulation = Simulation(Environment("empty", SQUARE), Atlas(), [[3.0, 4.0], [5.0, 4.0]], dt=0.05)
    goals = np.array([[[7.0, 4.0]], [[1.0, 4.0]]])
    sideways = np.zeros(2)
    for _ in range(120):
        memory = simulation.memory
        # No robot makes a plan of its own.
        states = tuple(
            replace(state, next_plan_time=math.inf, basis=build_basis(state)) for state in memory.states
        )
        indices = np.zeros(2, dtype=np.intp)
        simulation = simulation.with_memory(
            replace(memory, states=states, routes=tuple(goals), waypoint_indices=indices)
        )
        simulation.step()
        offset = simulation.positions[0] - simulation.positions[1]
        assert np.hypot(*offset) > 0.23
        if abs(offset[0]) < 0.5:
            sideways = simulation.positions[:, 1] - 4.0
    assert sideways[0] > 0.0 > sideways[1]
    np.testing.assert_allclose(simulation.positions, goals[:, 0], atol=0.2)


def test_a_robot_is_at_rest_while_it_stays_near_a_point() -> None:
    """Robot 1 stays; robot 2 is new; robot 4 creeps away from where it was first seen."""
    positions = np.array([[0.0, 0.0], [1.0, 0.0]])
    teammates = Teammates(
        robots=np.array([1, 4]),
        positions=positions,
        message_times=np.array([1.0, 1.0]),
        message_distances=np.ones(2),
        rest_times=np.array([0.0, 0.5]),
        rest_positions=positions,
    )
    heard = np.array([[0.05, 0.0], [3.0, 3.0], [1.2, 0.0]])
    own_position = np.array([0.05, 4.0])
    later = teammates.add_observation(np.array([1, 2, 4]), heard, own_position, 2.0, np.zeros(2, dtype=bool))
    assert later.rest_times.tolist() == [0.0, 2.0, 2.0]
    assert later.message_times.tolist() == [2.0, 2.0, 2.0]
    np.testing.assert_array_equal(later.positions, heard)
    np.testing.assert_array_equal(later.rest_positions, [[0.0, 0.0], [3.0, 3.0], [1.2, 0.0]])
    np.testing.assert_allclose(later.message_distances, np.hypot(*(heard - own_position).T))


def test_silent_robots_are_kept_unless_they_are_gone() -> None:
    positions = np.zeros((3, 2))
    times = np.full(3, 2.0)
    teammates = Teammates(np.array([1, 2, 4]), positions, times, np.ones(3), times, positions)
    no_robots = np.empty(0, dtype=np.intp)
    is_lost = np.array([False, True, False])
    later = teammates.add_observation(no_robots, np.empty((0, 2)), np.zeros(2), 3.0, is_lost)
    assert later.robots.tolist() == [1, 4]
    assert later.message_times.tolist() == [2.0, 2.0]


def test_the_latest_report_about_a_robot_counts() -> None:
    def build_teammates(*rows: tuple[int, float, float]) -> Teammates:
        """Return teammates by robot, coordinates, and the time when it was heard."""
        robots, x, message_times = np.array(rows, dtype=float).reshape(-1, 3).T
        positions = np.column_stack([x, x])
        distances = np.ones(len(x))
        return Teammates(
            robots.astype(np.intp), positions, message_times, distances, message_times, positions
        )

    own = build_teammates((2, 0.2, 5.0), (3, 0.3, 1.0), (6, 0.6, 4.0))
    report = build_teammates(
        (0, 9.0, 9.0),  # the robot itself
        (2, 9.0, 4.0),  # older than its own knowledge
        (3, 0.33, 2.0),  # newer
        (4, 0.4, 3.0),  # considered missing before
        (5, 9.0, 3.0),  # considered missing since
        (6, 9.0, 4.0),  # as old as its own knowledge
    )
    later = own.add_reports([report.build_report()], 0, {4: 2.5, 5: 3.5})
    assert later.robots.tolist() == [2, 3, 4, 6]
    assert later.positions[:, 0].tolist() == [0.2, 0.33, 0.4, 0.6]
    assert later.message_times.tolist() == [5.0, 2.0, 3.0, 4.0]
    # A robot that may never have been in range cannot be considered failed because of its silence.
    assert later.message_distances.tolist() == [1.0, math.inf, math.inf, 1.0]


@pytest.mark.parametrize(("kind", "expected"), [(Atlas, [1]), (AtlasShared, [1, 2])])
def test_only_with_shared_maps_a_robot_reports_others_to_its_neighbors(
    kind: type[Atlas], expected: list[int]
) -> None:
    """Robot 2, in the middle, is in range of robots 1 and 3, which are out of range of each other."""
    team = Team.homogeneous(3, communication_range=5.0)
    simulation = Simulation(HALL, kind(), [[6.5, 1.5], [10.0, 1.5], [13.5, 1.5]], team)
    run_until(simulation, 2.5)
    state = simulation.memory.states[0]
    assert state.knowledge.teammates.robots.tolist() == expected
    assert state.knowledge.encountered == set(expected)


PAIR = [[9.8, 1.5], [10.2, 1.5]]
"""Starts of two robots in the middle of the hall."""


@pytest.mark.slow
def test_robots_out_of_range_are_assumed_at_their_goals() -> None:
    simulation = Simulation(HALL, Atlas(), PAIR, Team.homogeneous(2, communication_range=5.0), dt=0.05)
    run_until(simulation, 40.0)
    positions = simulation.positions
    np.testing.assert_allclose(np.sort(positions, axis=0), [[5.0, 1.5], [15.0, 1.5]], atol=0.5)
    first, second = [state.knowledge.teammates for state in simulation.memory.states]
    assert first.robots.tolist() == [1]
    assert second.robots.tolist() == [0]
    # They have been out of range for long.
    assert max(first.message_times[0], second.message_times[0]) < 10.0
    np.testing.assert_allclose(first.positions[0], positions[1], atol=0.7)


@pytest.mark.slow
def test_robots_that_become_silent_within_range_are_forgotten() -> None:
    conditions = Conditions(failures=(Failure(2, 0.4),))
    team = Team.homogeneous(2, communication_range=5.0)
    simulation = Simulation(HALL, Atlas(), PAIR, team, dt=0.05, conditions=conditions)
    run_until(simulation, 40.0)
    assert len(simulation.memory.states[0].knowledge.teammates.robots) == 0
    np.testing.assert_allclose(simulation.positions[0], [10.0, 1.5], atol=0.5)


@pytest.mark.slow
def test_robots_that_are_not_at_their_assumed_positions_are_forgotten() -> None:
    """Robot 2 fails out of range, and robot 1 is then moved close to it."""
    team = Team.homogeneous(2, communication_range=5.0)
    simulation = Simulation(HALL, Atlas(), PAIR, team, dt=0.05)
    run_until(simulation, 20.0)
    memory = simulation.memory
    start_time = memory.states[0].path.start_time
    positions = simulation.positions.copy()
    positions[0, 0] += 0.8 * (positions[1, 0] - positions[0, 0])
    conditions = Conditions(failures=(Failure(2, 20.0),))
    simulation = simulation.with_changes(positions=positions, conditions=conditions).with_memory(memory)
    simulation.step()
    # At first, its messages may only be late.
    assert simulation.memory.states[0].knowledge.teammates.robots.tolist() == [1]
    run_until(simulation, 50.0)
    state = simulation.memory.states[0]
    assert len(state.knowledge.teammates.robots) == 0
    assert state.path.start_time == start_time
    np.testing.assert_allclose(simulation.positions[0], [10.0, 1.5], atol=0.7)


def crosses_door(seed: int) -> bool:
    """Return whether a team crosses a door, 1.6 to 2.2 diameters wide, in a wall at a random angle."""
    rng = np.random.default_rng(seed)
    width = 2.0 * ROBOT_RADIUS_M * rng.uniform(1.6, 2.2)
    angle = rng.uniform(-0.6, 0.6)
    door_offset = rng.uniform(-1.5, 1.5)
    center = np.array([4.0, 3.0])
    along = np.array([-math.sin(angle), math.cos(angle)])
    across = np.array([along[1], -along[0]])
    # The wall leaves at most 3 cm to the boundary, because cos(0.6) * 3.6 m is 2.97 m.
    half_length = 3.6
    offsets = (-half_length, door_offset - width / 2, door_offset + width / 2, half_length)
    ends = [(center + along * offset).tolist() for offset in offsets]
    wall_width = 0.1
    walls = (WallObstacle(ends[:2], wall_width), WallObstacle(ends[2:], wall_width))
    # A robot has crossed the wall when all of it is on the other side.
    crossed_distance = ROBOT_RADIUS_M + wall_width / 2
    boundary = ((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0))
    simulation = Simulation(Environment("door", boundary, walls), Atlas(), CORNER[:3])
    while simulation.time < 30.0:
        if ((simulation.positions - center) @ across).max() >= crossed_distance:
            return True
        simulation.step()
    return False


@pytest.mark.slow
def test_robots_cross_doors_that_are_wide_enough() -> None:
    # One exception is allowed: trajectories depend on how processors round, and a run takes only 30 s.
    assert sum(crosses_door(seed) for seed in range(12)) >= 11


def compute_cost(simulation: Simulation) -> float:
    """Return the coverage cost in the two rooms."""
    return CoverageCost(ROOMS, lattice=32)(simulation.positions).mean_distance


@pytest.mark.slow
@SHARES_RUN
def test_more_robots_and_longer_ranges_do_not_cover_less(
    final_simulation: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Others may not cover less after half the time. The larger team exceeds the planning group."""
    cost = compute_cost(final_simulation)
    for module in (atlas, team_knowledge):
        monkeypatch.setattr(module, "MAX_PLANNING_GROUP", 4)
    larger_team = Simulation(ROOMS, Atlas(), [*CORNER, [1.8, 0.8]], dt=0.05)
    run_until(larger_team, 25.0)
    assert compute_cost(larger_team) < 1.01 * cost
    monkeypatch.undo()
    short_ranges = Team.homogeneous(4, communication_range=3.0)
    separate_team = Simulation(ROOMS, Atlas(), CORNER, short_ranges, dt=0.05)
    run_until(separate_team, 25.0)
    assert compute_cost(separate_team) < 1.3 * cost


def test_copies_of_memories_share_immutable_parts() -> None:
    memory = Atlas().begin(ROOMS.region, Team.homogeneous(3))
    copy = deepcopy(memory)
    assert len(memory.maps) == 3
    assert all(state is copied for state, copied in zip(memory.states, copy.states, strict=True))
    assert copy.waypoint_indices is not memory.waypoint_indices


def test_at_the_start_all_cells_are_unknown() -> None:
    memory = Atlas().begin(ROOMS.region, Team.homogeneous(3))
    assert all((known_map.state == UNKNOWN).all() for known_map in memory.maps)


def test_robots_that_share_a_map_plan_once(monkeypatch: pytest.MonkeyPatch) -> None:
    plan_times: list[float] = []
    place_team = team_goals.place_team

    def count_plan(*args: Any, **kwargs: Any) -> Any:
        plan_times.append(simulation.time)
        return place_team(*args, **kwargs)

    monkeypatch.setattr(team_goals, "place_team", count_plan)
    simulation = build_simulation(AtlasShared)
    run_until(simulation, 3.0)
    assert len(plan_times) == len(set(plan_times)) == 3
    states = simulation.memory.states
    assert len({id(state.known_map) for state in states}) == 1
    plans = [state.team_goals for state in states]
    assert len({id(plan.planner) for plan in plans}) == 1
    goals = [plan.goals[np.argsort(plan.robots)] for plan in plans]
    assert all(np.array_equal(goals_of_one, goals[0]) for goals_of_one in goals)


@pytest.mark.slow
def test_a_jam_at_a_door_dissolves() -> None:
    """Thirty robots behind a door of 0.5 m."""
    walls = (
        WallObstacle(((3.0, 0.0), (3.0, 1.75)), 0.2),
        WallObstacle(((3.0, 2.25), (3.0, 4.0)), 0.2),
    )
    halls = Environment("halls", ((0.0, 0.0), (8.0, 0.0), (8.0, 4.0), (0.0, 4.0)), walls)
    x, y = np.meshgrid(np.linspace(1.3, 2.7, 5), np.linspace(1.2, 2.8, 6))
    crowd = Simulation(halls, AtlasShared(), np.column_stack([x.ravel(), y.ravel()]), dt=0.05)
    run_until(crowd, 40.0)
    assert 14 <= (crowd.positions[:, 0] > 3.1).sum() <= 21


def test_a_robot_is_missed_only_after_a_while() -> None:
    """Robot 2 is assumed near robot 1 but is far away: for some seconds its messages may only be late."""
    team = Team.homogeneous(2, communication_range=5.0)
    positions = np.array([[1.0, 1.0], [7.0, 7.0]])
    observations = Observations(
        positions,
        np.zeros((2, 2)),
        Neighbors.from_ranges(positions, team.communication_range),
        np.full((2, 2), np.nan),
        ROOMS.region,
    )
    assumed_position = np.array([[2.0, 1.0]])
    teammates = Teammates(
        robots=np.array([1]),
        positions=assumed_position,
        message_times=np.zeros(1),
        message_distances=np.full(1, math.inf),
        rest_times=np.zeros(1),
        rest_positions=assumed_position,
    )
    for time, expected in ((1.0, [1]), (4.9, [1]), (5.1, [])):
        seen = replace(observations, time=time)
        later = update_knowledge(TeamKnowledge(teammates), None, seen, team, 0, [])
        assert later.teammates.robots.tolist() == expected


def build_basis(state: PlannerState) -> PlanBasis:
    window = Window.build_around(state.known_map.raster, np.array([1.0, 1.0]), math.inf, 100)
    return PlanBasis(
        known_map=state.known_map,
        planner=GridPlanner(state.known_map, window, 0.1),
        robots=np.array([0, 1]),
        positions=np.array([[1.0, 1.0], [2.0, 1.0]]),
        is_quiet=True,
    )


def build_idle_state() -> PlannerState:
    state = Atlas().begin(ROOMS.region, Team.homogeneous(1)).states[0]
    return replace(state, basis=build_basis(state), motion=OwnMotion(np.array([1.0, 1.0]), is_idle=True))


def test_a_plan_is_skipped_only_if_nothing_has_changed() -> None:
    state = build_idle_state()
    group = np.array([0, 1])
    assert state.basis is not None and state.motion is not None
    positions = state.basis.positions

    def is_skipped(
        state: PlannerState, group: np.ndarray, positions: np.ndarray, *, is_quiet: bool = True
    ) -> bool:
        return atlas._may_skip_plan(state, group, positions, is_quiet=is_quiet, max_move=0.1)

    assert is_skipped(state, group, positions + 0.09)
    assert not is_skipped(state, group, positions + [[0.0, 0.0], [0.11, 0.0]])
    assert not is_skipped(state, np.array([0, 2]), positions)
    assert not is_skipped(state, group, positions, is_quiet=False)
    assert not is_skipped(replace(state, motion=replace(state.motion, is_idle=False)), group, positions)
    other_map = DiscoveredMap(state.known_map.raster, np.ones_like(state.known_map.state))
    assert not is_skipped(replace(state, known_map=other_map), group, positions)
    assert not is_skipped(replace(state, basis=None), group, positions)


def test_a_robot_starts_again_when_walls_change() -> None:
    state = build_idle_state()
    raster = state.known_map.raster
    free = np.full(raster.shape, FREE, dtype=np.uint8)
    walls = free.copy()
    walls[50, 20:40] = WALL
    before = replace(state, known_map=DiscoveredMap(raster, walls))
    basis = build_basis(replace(state, known_map=DiscoveredMap(raster, walls)))
    previous = replace(before, basis=basis)
    assert not atlas._has_changed(previous, before, 0.1)
    after = replace(before, known_map=DiscoveredMap(raster, free))
    assert atlas._has_changed(previous, after, 0.1)
    # Small changes are the side of another robot that has come into view, or is gone.
    assert not atlas._has_changed(previous, after, 0.3)
    met = replace(before, knowledge=replace(before.knowledge, encountered=frozenset({1})))
    assert atlas._has_changed(previous, met, 0.1)
