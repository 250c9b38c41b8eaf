from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from robocov.conditions import Conditions, Failure
from robocov.controllers import Atlas, AtlasShared, Rapf, atlas, get_information, make_controller
from robocov.controllers.atlas import MAX_PLANNING_GROUP, AtlasMemory, PlannerState
from robocov.controllers.teammates import Teammates
from robocov.cost import CoverageCost
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.mapfile import load_map
from robocov.metrics import compute_clearances, count_contacts
from robocov.observation import Observations
from robocov.observation.neighbours import Neighbours
from robocov.planning.discovered_map import FREE, UNKNOWN, WALL, DiscoveredMap
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


def simulation(kind: type[Atlas] = Atlas, n: int = 4, **gains: float) -> Simulation:
    return Simulation(ROOMS, kind(**gains), CORNER[:n], Team.homogeneous(n), dt=0.05)


@pytest.fixture(scope="module")
def finished() -> Simulation:
    some = simulation()
    for _ in range(1000):
        some.step()
    return some


@pytest.mark.slow
def test_it_leaves_the_first_room_and_ends_far_below_rapf(finished: Simulation) -> None:
    cost = CoverageCost(ROOMS, lattice=32)
    other = Simulation(ROOMS, Rapf(), CORNER, dt=0.05)
    for _ in range(1000):
        other.step()
    ours, theirs = (cost(each.positions).mean_distance for each in (finished, other))
    assert ours < 0.9 * theirs
    assert (finished.positions[:, 0] > 4.1).sum() == 2


def test_it_comes_to_rest(finished: Simulation) -> None:
    before = finished.positions
    twin = finished.copy()
    for _ in range(80):
        twin.step()
    assert np.abs(twin.positions - before).max() < 0.05


@pytest.mark.slow
def test_who_rests_notices_that_all_others_have_come_to_rest(finished: Simulation) -> None:
    """Only then it may relocate: it plans once more then, though nothing that it sees has changed."""
    assert all(state.is_idle and state.was_quiet for state in finished.memory.states)


@pytest.mark.slow
def test_who_turns_back_before_a_gap_does_not_touch_its_rim() -> None:
    """The gap turns out to be too narrow: then all acceleration would go into turning, none into braking."""
    places = [
        (6.606354578438451, 3.582792226112388), (5.82911286359781, 4.5164725372712775),
        (5.893535020701633, 3.786360212980583), (5.341358005239178, 3.400674457312083),
        (6.339880443956025, 4.543777359503736), (5.68626602446254, 3.4239886537883932),
    ]  # fmt: skip
    team = Team.homogeneous(6, sensing_range=6.0)
    record = Simulation(load_map("gaps"), Atlas(), places, team, dt=0.02).run(11.0)
    assert compute_clearances(record).min() > 0.005


@pytest.mark.slow
def test_nothing_is_touched_on_the_way() -> None:
    record = simulation().run(25.0)
    clearance = compute_clearances(record)
    assert count_contacts(record, clearance) == 0
    assert clearance.min() > 0.005


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Atlas, AtlasShared])
def test_copies_and_repeated_runs_go_on_identically(kind: type[Atlas]) -> None:
    one, other = simulation(kind), simulation(kind)
    for _ in range(60):
        one.step()
        other.step()
    twin = one.copy()
    for each in (one, other, twin):
        for _ in range(60):
            each.step()
    assert one.positions.tobytes() == other.positions.tobytes() == twin.positions.tobytes()


@pytest.mark.slow
def test_what_was_remembered_stays_as_it_was() -> None:
    some = simulation()
    for _ in range(40):
        some.step()
    memory: AtlasMemory = some.memory
    assert memory.returns is not None
    legs, returns = memory.legs.copy(), memory.returns.copy()
    states = [each.state.copy() for each in memory.maps]
    again = some.with_memory(memory)
    for _ in range(40):
        some.step()
        again.step()
    assert np.array_equal(memory.legs, legs)
    assert np.array_equal(memory.returns, returns, equal_nan=True)
    assert all(np.array_equal(each.state, was) for each, was in zip(memory.maps, states, strict=True))
    assert some.positions.tobytes() == again.positions.tobytes()


@pytest.mark.slow
def test_maps_are_shared_where_it_says_so() -> None:
    unknown = {}
    for kind in (Atlas, AtlasShared):
        some = simulation(kind)
        for _ in range(200):
            some.step()
        maps = some.memory.maps
        unknown[kind] = [np.count_nonzero(each.state == UNKNOWN) for each in maps]
        assert all(each.raster is maps[0].raster for each in maps)
    # all know what all have seen
    assert len(set(unknown[AtlasShared])) == 1
    assert len(set(unknown[Atlas])) > 1
    assert max(unknown[AtlasShared]) < min(unknown[Atlas])
    assert get_information(Atlas()) == "own"
    assert get_information(AtlasShared()) == "shared map"


@pytest.mark.slow
def test_a_robot_alone_and_a_crowd() -> None:
    alone = simulation(n=1)
    for _ in range(300):
        alone.step()
    assert np.isfinite(alone.observe_and_decide().decision.forces).all()
    assert np.hypot(*(alone.positions[0] - CORNER[0])) > 1.0
    empty = Environment("empty", SQUARE)
    x, y = np.meshgrid(np.linspace(0.6, 2.4, 4), np.linspace(0.6, 2.4, 4))
    starts = np.column_stack([x.ravel(), y.ravel()])
    assert len(starts) > MAX_PLANNING_GROUP
    crowd = Simulation(empty, Atlas(), starts, dt=0.05)
    cost = CoverageCost(empty, lattice=16)
    for _ in range(400):
        crowd.step()
    assert cost(crowd.positions).mean_distance < 0.5 * cost(starts).mean_distance


def test_it_plans_now_and_then() -> None:
    """Not all robots at the same moment, and less often where nodes are far apart."""
    some = simulation()
    due = [state.next_plan_time for state in some.memory.states]
    assert len(set(due)) == 4
    assert max(due) < 0.5
    while some.time < 0.5:
        some.step()
    due = [state.next_plan_time for state in some.memory.states]
    assert len(set(due)) == 4
    assert min(due) > 1.0
    assert max(due) < 2.5


def test_gains_are_checked() -> None:
    assert make_controller("atlas", {"period": 2}) == replace(Atlas(), period=2.0)
    with pytest.raises(ParameterError, match=r"atlas-shared.threshold: expected .*, got -1"):
        make_controller("atlas-shared", {"threshold": -1})


@pytest.mark.slow
def test_what_must_be_saved_begins_anew_when_the_team_changes() -> None:
    some = Simulation(ROOMS, Atlas(), CORNER, dt=0.05, conditions=Conditions(failures=((4, 2.0),)))
    while some.time < 1.9:
        some.step()
    before = [state.start_time for state in some.memory.states[:3]]
    assert max(before) < 1.0
    while some.time < 5.0:
        some.step()
    assert all(2.0 <= state.start_time < 4.5 for state in some.memory.states[:3])


@pytest.mark.slow
def test_what_relocations_and_goals_must_save_doubles_with_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[float, float]] = []
    find_own_goal = atlas.find_own_goal

    def record_saving(*args: Any) -> Any:
        asked.append((some.time, args[-1]))
        return find_own_goal(*args)

    monkeypatch.setattr(atlas, "find_own_goal", record_saving)
    some = Simulation(ROOMS, Atlas(settling=0.1), CORNER[:2], Team.homogeneous(2), dt=0.05)
    while some.time < 8.0:
        some.step()
    walked = max(state.path_length for state in some.memory.states)
    rest = np.array([each for _, each in asked])
    assert walked > 3.0 and min(rest) == 0.002
    assert max(rest) == pytest.approx(0.002 * 2.0 ** (walked / (0.1 * ROOMS.region.diameter)), rel=0.1)
    # who stands still stays as ready to move as it was
    while some.time < 60.0:
        some.step()
    rested = [state.path_length for state in some.memory.states]
    while some.time < 90.0:
        some.step()
    assert [state.path_length for state in some.memory.states] == rested


@pytest.mark.slow
@pytest.mark.parametrize("kind", [Atlas, AtlasShared])
def test_a_team_that_rests_moves_again_when_a_door_opens(kind: type[Atlas]) -> None:
    outline = ((0.0, 0.0), (12.0, 0.0), (12.0, 6.0), (0.0, 6.0))
    shut = Environment("shut", outline, (WallObstacle(((5.0, 0.0), (5.0, 6.0)), 0.2),))
    halves = (WallObstacle(((5.0, 0.0), (5.0, 2.4)), 0.2), WallObstacle(((5.0, 3.6), (5.0, 6.0)), 0.2))
    some = Simulation(shut, kind(), CORNER, Team.homogeneous(4), dt=0.05)
    while some.time < 90.0:
        some.step()
    before = some.positions
    while some.time < 100.0:
        some.step()
    assert np.abs(some.positions - before).max() < 1e-3
    some = some.with_changes(environment=replace(shut, name="open", obstacles=halves))
    while some.time < 140.0:
        some.step()
    # about as good as two in each room
    halves = [[2.5, 1.5], [2.5, 4.5], [8.5, 1.5], [8.5, 4.5]]
    cost = CoverageCost(some.environment, lattice=48)
    assert cost(some.positions).mean_distance < cost(halves).mean_distance


def test_robots_that_meet_pass_on_the_left() -> None:
    meeting = [[3.0, 4.0], [5.0, 4.0]]
    some = Simulation(Environment("empty", SQUARE), Atlas(), meeting, dt=0.05)
    goals = np.array([[[7.0, 4.0]], [[1.0, 4.0]]])
    sideways = np.zeros(2)
    for _ in range(120):
        memory = some.memory
        states = tuple(
            replace(state, next_plan_time=math.inf, planned_map=state.known_map) for state in memory.states
        )
        legs = np.zeros(2, dtype=np.intp)
        some = some.with_memory(replace(memory, states=states, routes=tuple(goals), legs=legs))
        some.step()
        between = some.positions[0] - some.positions[1]
        assert np.hypot(*between) > 0.23
        if abs(between[0]) < 0.5:
            sideways = some.positions[:, 1] - 4.0
    assert sideways[0] > 0.0 > sideways[1]
    np.testing.assert_allclose(some.positions, goals[:, 0], atol=0.2)


def test_who_stays_is_noticed() -> None:
    at = np.array([[0.0, 0.0], [1.0, 0.0]])
    known = Teammates(np.array([1, 4]), at, np.array([1.0, 1.0]), np.ones(2), np.array([0.0, 0.5]), at)
    seen = np.array([[0.05, 0.0], [3.0, 3.0], [1.2, 0.0]])
    later = known.add_observation(
        np.array([1, 2, 4]), seen, np.array([0.05, 4.0]), 2.0, np.zeros(2, dtype=bool)
    )
    assert later.rest_times.tolist() == [0.0, 2.0, 2.0] and later.heard_times.tolist() == [2.0] * 3
    np.testing.assert_array_equal(later.positions, seen)
    # creeping away is noticed as well
    np.testing.assert_array_equal(later.rest_positions, [[0.0, 0.0], [3.0, 3.0], [1.2, 0.0]])
    np.testing.assert_allclose(later.heard_distances, np.hypot(*(seen - [0.05, 4.0]).T))
    nobody, nowhere = np.empty(0, dtype=np.intp), np.empty((0, 2))
    silent = later.add_observation(nobody, nowhere, np.zeros(2), 3.0, np.array([False, True, False]))
    assert silent.robots.tolist() == [1, 4] and silent.heard_times.tolist() == [2.0] * 2


def test_the_latest_report_of_a_robot_counts() -> None:
    def known(*rows: tuple[int, float, float]) -> Teammates:
        robots, x, heard = np.array(rows, dtype=float).reshape(-1, 3).T
        at = np.column_stack([x, x])
        return Teammates(robots.astype(np.intp), at, heard, np.ones(len(x)), heard, at)

    mine = known((2, 0.2, 5.0), (3, 0.3, 1.0), (6, 0.6, 4.0))
    # itself, older, later, then missed before, missed since, and just as old news
    report = known((0, 9.0, 9.0), (2, 9.0, 4.0), (3, 0.33, 2.0), (4, 0.4, 3.0), (5, 9.0, 3.0), (6, 9.0, 4.0))
    told = mine.add_reports([report], 0, {4: 2.5, 5: 3.5})
    assert (told.robots.tolist(), told.positions[:, 0].tolist()) == ([2, 3, 4, 6], [0.2, 0.33, 0.4, 0.6])
    assert told.heard_times.tolist() == [5.0, 2.0, 3.0, 4.0]
    # who was never near cannot be missed for its silence
    assert told.heard_distances.tolist() == [1.0, math.inf, math.inf, 1.0]


@pytest.mark.parametrize(("kind", "whom"), [(Atlas, [1]), (AtlasShared, [1, 2])])
def test_a_robot_in_the_middle_tells_where_the_others_are(kind: type[Atlas], whom: list[int]) -> None:
    hall = Environment("hall", ((0.0, 0.0), (20.0, 0.0), (20.0, 3.0), (0.0, 3.0)))
    team = Team.homogeneous(3, communication_range=5.0)
    some = Simulation(hall, kind(), [[6.5, 1.5], [10.0, 1.5], [13.5, 1.5]], team)
    while some.time < 2.5:
        some.step()
    state = some.memory.states[0]
    assert state.teammates.robots.tolist() == whom and state.met == {*whom}


@pytest.mark.slow
def test_who_is_out_of_range_is_presumed_at_its_place_and_who_falls_silent_in_range_is_forgotten() -> None:
    team = Team.homogeneous(2, communication_range=5.0)
    hall = Environment("hall", ((0.0, 0.0), (20.0, 0.0), (20.0, 3.0), (0.0, 3.0)))
    both = Simulation(hall, Atlas(), [[9.8, 1.5], [10.2, 1.5]], team, dt=0.05)
    dies = Conditions(failures=(Failure(2, 0.4),))
    alone = Simulation(hall, Atlas(), both.positions, team, dt=0.05, conditions=dies)
    for each in (both, alone):
        while each.time < 40.0:
            each.step()
    np.testing.assert_allclose(np.sort(both.positions, axis=0), [[5.0, 1.5], [15.0, 1.5]], atol=0.5)
    others = [state.teammates for state in both.memory.states]
    assert [each.robots.tolist() for each in others] == [[1], [0]]
    assert max(each.heard_times[0] for each in others) < 10.0, "out of range since then"
    np.testing.assert_allclose(others[0].positions[0], both.positions[1], atol=0.7)
    assert len(alone.memory.states[0].teammates.robots) == 0
    np.testing.assert_allclose(alone.positions[0], [10.0, 1.5], atol=0.5)


@pytest.mark.slow
def test_who_is_not_where_it_was_presumed_to_be_is_forgotten() -> None:
    """Robot 2 fails out of range, and robot 1 is then set down near its place."""
    team = Team.homogeneous(2, communication_range=5.0)
    hall = Environment("hall", ((0.0, 0.0), (20.0, 0.0), (20.0, 3.0), (0.0, 3.0)))
    some = Simulation(hall, Atlas(), [[9.8, 1.5], [10.2, 1.5]], team, dt=0.05)
    while some.time < 20.0:
        some.step()
    since = some.memory.states[0].start_time
    dies = Conditions(failures=(Failure(2, 20.0),))
    near = some.positions.copy()
    near[0, 0] += 0.8 * (near[1, 0] - near[0, 0])
    some = some.with_changes(positions=near, conditions=dies).with_memory(some.memory)
    some.step()
    assert some.memory.states[0].teammates.robots.tolist() == [1], "it may be late"
    while some.time < 50.0:
        some.step()
    state = some.memory.states[0]
    assert len(state.teammates.robots) == 0 and state.start_time == since
    np.testing.assert_allclose(some.positions[0], [10.0, 1.5], atol=0.7)


@pytest.mark.slow
def test_doors_that_a_robot_fits_through_are_crossed() -> None:
    """Random ones, 1.6 to 2.2 diameters wide, at any place of a wall at any angle."""

    def crossed(seed: int) -> bool:
        rng = np.random.default_rng(seed)
        width, turn, middle = 0.2 * rng.uniform(1.6, 2.2), rng.uniform(-0.6, 0.6), np.array([4.0, 3.0])
        along, door = np.array([-math.sin(turn), math.cos(turn)]), rng.uniform(-1.5, 1.5)
        ends = [(middle + along * far).tolist() for far in (-3.6, door - width / 2, door + width / 2, 3.6)]
        walls = WallObstacle(ends[:2], 0.1), WallObstacle(ends[2:], 0.1)
        some = Simulation(
            Environment("door", ((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0)), walls), Atlas(), CORNER[:3]
        )
        across = np.array([along[1], -along[0]])
        while some.time < 30.0 and ((some.positions - middle) @ across).max() < 0.15:
            some.step()
        return some.time < 30.0

    assert sum(map(crossed, range(12))) >= 11


@pytest.mark.slow
def test_more_robots_are_not_worse_and_a_short_range_hardly_is() -> None:
    rooms = load_map("rooms")
    cost = CoverageCost(rooms, lattice=64)

    def after_a_while(n: int, hears: float = math.inf, seed: int = 0) -> float:
        team = Team.homogeneous(n, communication_range=hears)
        some = Simulation(rooms, Atlas(), rooms.start(None).sample(n, seed=seed, radius=0.1), team)
        while some.time < 40.0:
            some.step()
        return cost(some.positions).mean_distance

    eight = after_a_while(8)
    assert after_a_while(9) < 1.01 * eight
    assert np.mean([after_a_while(8, 3.0, seed) for seed in range(2)]) < 1.3 * eight


def test_copies_share_what_never_changes() -> None:
    memory = Atlas().begin(ROOMS.region, Team.homogeneous(3))
    twin = deepcopy(memory)
    assert len(memory.maps) == 3
    assert all(one is other for one, other in zip(memory.states, twin.states, strict=True))
    assert twin.legs is not memory.legs
    assert all((known.state == 0).all() for known in memory.maps)


def test_robots_that_share_a_map_plan_once(monkeypatch: pytest.MonkeyPatch) -> None:
    plan_times: list[float] = []
    place_team = atlas.place_team

    def count_plan(*args: Any, **kwargs: Any) -> Any:
        plan_times.append(simulated.time)
        return place_team(*args, **kwargs)

    monkeypatch.setattr(atlas, "place_team", count_plan)
    simulated = simulation(AtlasShared)
    while simulated.time < 3.0:
        simulated.step()
    assert len(plan_times) == len(set(plan_times)) == 3
    states = simulated.memory.states
    assert (
        len({id(state.known_map) for state in states})
        == len({id(state.team_planner) for state in states})
        == 1
    )
    plans = [state.planned_goals[np.argsort(state.planned_robots)] for state in states]
    assert all(np.array_equal(plan, plans[0]) for plan in plans)


@pytest.mark.slow
def test_a_jam_at_a_door_dissolves() -> None:
    """Thirty robots behind a door of 0.5 m."""
    walls = WallObstacle(((3.0, 0.0), (3.0, 1.75)), 0.2), WallObstacle(((3.0, 2.25), (3.0, 4.0)), 0.2)
    halls = Environment("halls", ((0.0, 0.0), (8.0, 0.0), (8.0, 4.0), (0.0, 4.0)), walls)
    x, y = np.meshgrid(np.linspace(1.3, 2.7, 5), np.linspace(1.2, 2.8, 6))
    crowd = Simulation(halls, AtlasShared(), np.column_stack([x.ravel(), y.ravel()]), dt=1 / 30)
    while crowd.time < 80.0:
        crowd.step()
    assert 16 <= (crowd.positions[:, 0] > 3.1).sum() <= 21


def test_a_robot_is_missed_only_after_a_while() -> None:
    """Robot 2 is presumed near robot 1 but is far away: for some seconds its messages may just be late."""
    team = Team.homogeneous(2, communication_range=5.0)
    positions = np.array([[1.0, 1.0], [7.0, 7.0]])
    observations = Observations(
        positions,
        np.zeros((2, 2)),
        Neighbours.from_ranges(positions, team.communication_range),
        np.full((2, 2), np.nan),
        ROOMS.region,
    )
    presumed = np.array([[2.0, 1.0]])
    zero = np.zeros(1)
    teammates = Teammates(np.array([1]), presumed, zero, np.full(1, math.inf), zero, presumed)
    state = replace(Atlas().begin(ROOMS.region, team).states[0], teammates=teammates)
    for time, expected in ((1.0, [1]), (4.9, [1]), (5.1, [])):
        later = Atlas()._update_teammates(replace(observations, time=time), team, state, 0, [])
        assert later.teammates.robots.tolist() == expected


def build_idle_state() -> PlannerState:
    state = Atlas().begin(ROOMS.region, Team.homogeneous(1)).states[0]
    return replace(
        state,
        planned_map=state.known_map,
        group=np.array([0, 1]),
        positions=np.array([[1.0, 1.0], [2.0, 1.0]]),
        was_quiet=True,
        is_idle=True,
    )


def test_a_plan_is_skipped_only_if_nothing_has_changed() -> None:
    state = build_idle_state()
    group = np.array([0, 1])
    positions = state.positions
    assert positions is not None

    def is_skipped(state: PlannerState, group: np.ndarray, positions: np.ndarray, is_quiet: bool) -> bool:
        return atlas._is_unchanged(state, group, positions, is_quiet, max_move=0.1)

    assert is_skipped(state, group, positions + 0.09, True)
    assert not is_skipped(state, group, positions + [[0.0, 0.0], [0.11, 0.0]], True)
    assert not is_skipped(state, np.array([0, 2]), positions, True)
    assert not is_skipped(state, group, positions, False)
    assert not is_skipped(replace(state, is_idle=False), group, positions, True)
    other_map = DiscoveredMap(state.known_map.raster, np.ones_like(state.known_map.state))
    assert not is_skipped(replace(state, known_map=other_map), group, positions, True)
    assert not is_skipped(replace(state, positions=None), group, positions, True)


def test_a_robot_starts_again_when_walls_change() -> None:
    state = build_idle_state()
    raster = state.known_map.raster
    free = np.full(raster.shape, FREE, dtype=np.uint8)
    walls = free.copy()
    walls[50, 20:40] = WALL
    before = replace(state, known_map=DiscoveredMap(raster, walls), planned_map=DiscoveredMap(raster, walls))
    assert not atlas._has_changed(before, before, 0.1)
    after = replace(before, known_map=DiscoveredMap(raster, free))
    assert atlas._has_changed(before, after, 0.1)
    # Small changes are the side of another robot that has come into view, or is gone.
    assert not atlas._has_changed(before, after, 0.3)
    assert atlas._has_changed(before, replace(before, met=frozenset({1})), 0.1)
