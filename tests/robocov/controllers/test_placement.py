"""Controllers that place the team on the known map: local search and exemplar-based clustering."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations, combinations_with_replacement

import numpy as np
import pytest

from robocov.controllers import Exemplar, LocalSearch, inform_controller, make_controller
from robocov.controllers.placement.exemplar import choose_exemplars
from robocov.controllers.placement.local_search import move_in_turn
from robocov.controllers.placement.placement_controller import PlacementController, PlacementMap
from robocov.cost import CoverageCost
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = Environment("square", ((0, 0), (6, 0), (6, 6), (0, 6)))
DOOR = Environment("door", SQUARE.boundary, (WallObstacle(((3, 0), (3, 5)), 0.2),))
SPLIT = Environment("split", SQUARE.boundary, (WallObstacle(((2, 0), (2, 6)), 0.2),))
KINDS = (LocalSearch, Exemplar)


def build_map(environment: Environment, nodes: int = 40) -> PlacementMap:
    """Build a coarse map for robots with a radius of 0.1 m."""
    return PlacementMap(environment, 0.13, nodes, radius=0.1)


def compute_cost(placement_map: PlacementMap, sources: np.ndarray | tuple[int, ...]) -> float:
    return float(placement_map.table[:, list(sources)].min(axis=1).sum())


def compute_min_cost_after_one_move(placement_map: PlacementMap, sources: np.ndarray) -> float:
    """Return the lowest cost if at most one robot moves to another candidate."""
    costs = []
    for robot in range(len(sources)):
        for candidate in range(len(placement_map.candidates)):
            moved = sources.copy()
            moved[robot] = candidate
            costs.append(compute_cost(placement_map, moved))
    return min(costs)


def observe(environment: Environment, positions: np.ndarray, communication_range: float) -> Observations:
    n = len(positions)
    neighbors = Neighbors.from_ranges(positions, np.full(n, communication_range))
    return Observations(positions, np.zeros((n, 2)), neighbors, np.full((n, 2), np.nan), environment.region)


@pytest.mark.parametrize("environment", [DOOR, SPLIT], ids=["door", "split"])
def test_the_table_contains_geodesic_distances(environment: Environment) -> None:
    placement_map = build_map(environment)
    cost = CoverageCost(environment, placement_map.planner.cost.lattice, radius=0.1)
    for k in range(0, len(placement_map.candidates), 7):
        expected = cost(placement_map.candidates[[k]]).distances
        is_reached = np.isfinite(expected)
        np.testing.assert_allclose(placement_map.table[is_reached, k], expected[is_reached], atol=1e-6)
        if environment is SPLIT:
            # A missing path is longer than any other one, but finite.
            assert (placement_map.table[~is_reached, k] > expected[is_reached].max()).all()


def test_sites_are_weighted_by_the_density() -> None:
    bell = replace(SQUARE, density=Gaussians((Gaussian((4.5, 4.5), 0.5, 1.0),), floor=0.001))
    placement_map = build_map(bell)
    chosen = choose_exemplars(placement_map, np.array([1]))
    np.testing.assert_allclose(placement_map.candidates[chosen], [[4.5, 4.5]], atol=0.5)


@pytest.mark.parametrize("seed", range(6))
def test_no_single_move_improves_the_result_of_local_search(seed: int) -> None:
    placement_map = build_map(DOOR)
    count = len(placement_map.candidates)
    starts = np.random.default_rng(seed).choice(count, size=3, replace=False)
    sources = move_in_turn(placement_map, starts, threshold=0.0)
    cost = compute_cost(placement_map, sources)
    assert compute_min_cost_after_one_move(placement_map, sources) >= cost * (1.0 - 1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_local_search_is_within_its_bound(seed: int) -> None:
    """Arya et al. 2004: at most five times the optimum."""
    placement_map = build_map(DOOR)
    count = len(placement_map.candidates)
    best = min(compute_cost(placement_map, pair) for pair in combinations(range(count), 2))
    starts = np.random.default_rng(seed).choice(count, size=2, replace=False)
    sources = move_in_turn(placement_map, starts, threshold=0.0)
    assert best <= compute_cost(placement_map, sources) * (1.0 + 1e-12) <= 5.0 * best


@pytest.mark.parametrize("threshold", [0.0, 0.05, 0.3])
def test_no_remaining_move_saves_more_than_the_threshold(threshold: float) -> None:
    placement_map = build_map(SQUARE)
    sources = move_in_turn(placement_map, np.array([0, 1]), threshold)
    min_cost = compute_min_cost_after_one_move(placement_map, sources)
    assert min_cost >= compute_cost(placement_map, sources) * (1.0 - threshold) * (1.0 - 1e-12)


def test_moves_that_save_too_little_are_not_made() -> None:
    placement_map = build_map(SQUARE)
    starts = np.array([0, 1])
    min_cost = compute_min_cost_after_one_move(placement_map, starts)
    best_saving = 1.0 - min_cost / compute_cost(placement_map, starts)
    too_high = move_in_turn(placement_map, starts, threshold=best_saving + 1e-9)
    assert too_high.tolist() == starts.tolist()
    just_low_enough = move_in_turn(placement_map, starts, threshold=best_saving - 1e-9)
    assert just_low_enough.tolist() != starts.tolist()


def test_local_search_moves_goals_to_another_room() -> None:
    """All robots start in the left room, and some goals are then in the right one."""
    placement_map = build_map(DOOR)
    is_left = placement_map.candidates[:, 0] < 3
    starts = np.flatnonzero(is_left)[:3]
    moved = move_in_turn(placement_map, starts, threshold=1e-4)
    assert 0 < np.count_nonzero(is_left[moved]) < 3


def test_robots_remain_in_their_room() -> None:
    placement_map = build_map(SPLIT)
    rooms = placement_map.components
    starts = np.array([*np.flatnonzero(rooms == 0)[:2], np.flatnonzero(rooms == 1)[0]])
    moved = move_in_turn(placement_map, starts, threshold=0.0)
    assert rooms[moved].tolist() == [0, 0, 1]
    exemplars = choose_exemplars(placement_map, np.array([2, 1]))
    assert sorted(rooms[exemplars].tolist()) == [0, 0, 1]


def test_exemplars_are_greedy() -> None:
    placement_map = build_map(DOOR)
    chosen = choose_exemplars(placement_map, np.array([4])).tolist()
    assert len(set(chosen)) == 4
    for k in range(4):
        costs = [
            compute_cost(placement_map, (*chosen[:k], candidate))
            for candidate in range(len(placement_map.candidates))
        ]
        assert costs[chosen[k]] == pytest.approx(min(costs), rel=1e-12)


@pytest.mark.parametrize("environment", [SQUARE, DOOR], ids=["square", "door"])
def test_exemplars_are_within_their_bound(environment: Environment) -> None:
    """The utility is at least 1 - 1/e of the maximum, for a phantom exemplar that is far from all points."""
    placement_map = build_map(environment, nodes=30)
    phantom_cost = placement_map.table.max(axis=1).sum()
    count = len(placement_map.candidates)
    best = max(
        phantom_cost - compute_cost(placement_map, triple)
        for triple in combinations_with_replacement(range(count), 3)
    )
    utility = phantom_cost - compute_cost(placement_map, choose_exemplars(placement_map, np.array([3])))
    assert (1.0 - 1.0 / math.e) * best <= utility <= best * (1.0 + 1e-12)


def test_a_room_with_too_many_robots_has_fewer_goals() -> None:
    placement_map = build_map(SPLIT, nodes=16)
    count = np.count_nonzero(placement_map.components == 1)
    assert len(choose_exemplars(placement_map, np.array([0, count + 2]))) == count
    positions = placement_map.candidates[placement_map.components == 1]
    components = np.ones(count + 2, dtype=np.intp)
    nearest = placement_map.find_nearest_candidates(np.vstack([positions, positions[:2]]), components)
    assert len(nearest) == count


def test_goals_are_assigned_by_path_length() -> None:
    """The robot on the right of the wall gets the goal there, although the other one is straight ahead."""
    placement_map = build_map(DOOR, nodes=300)
    positions = np.array([[2.5, 0.5], [3.5, 0.5]])
    goals = placement_map.candidates
    left = int(np.hypot(*(goals - [0.5, 0.5]).T).argmin())
    right = int(np.hypot(*(goals - [3.5, 1.5]).T).argmin())
    assigned = placement_map.assign(positions, np.array([right, left]))
    np.testing.assert_array_equal(assigned, goals[[left, right]])


def test_a_robot_without_a_goal_or_a_path_stays() -> None:
    placement_map = build_map(SPLIT)
    positions = np.array([[1.0, 1.0], [4.0, 4.0]])
    goal = np.flatnonzero(placement_map.components == placement_map.find_components(positions[1:])[0])[:1]
    assigned = placement_map.assign(positions, goal)
    np.testing.assert_array_equal(assigned[0], positions[0])
    np.testing.assert_array_equal(assigned[1], placement_map.candidates[goal[0]])
    np.testing.assert_array_equal(placement_map.assign(positions, np.array([], dtype=np.intp)), positions)


@pytest.mark.parametrize("kind", KINDS)
def test_robots_plan_for_the_robots_that_they_know(kind: type[PlacementController]) -> None:
    """A robot without others in communication range moves to the median of the map."""
    controller = inform_controller(kind(nodes=100.0), SQUARE)
    positions = np.array([[1.0, 1.0], [5.0, 5.0]])
    team = Team.homogeneous(2, communication_range=2.0)
    memory = controller.begin(SQUARE.region, team)
    alone = controller.decide(observe(SQUARE, positions, 2.0), memory)
    np.testing.assert_allclose(alone.goals, [[3, 3], [3, 3]], atol=0.5)
    together = controller.decide(observe(SQUARE, positions, np.inf), memory)
    assert np.hypot(*(together.goals[0] - together.goals[1])) > 2.0


@pytest.mark.parametrize("kind", KINDS)
def test_robots_remember_others_out_of_range(kind: type[PlacementController]) -> None:
    controller = inform_controller(kind(nodes=100.0), SQUARE)
    team = Team.homogeneous(2, communication_range=2.0)
    positions = np.array([[2.0, 3.0], [3.5, 3.0]])
    decision = controller.decide(observe(SQUARE, positions, 2.0), controller.begin(SQUARE.region, team))
    apart = replace(observe(SQUARE, np.array([[1.0, 3.0], [5.0, 3.0]]), 2.0), time=2.0)
    later = controller.decide(apart, decision.memory)
    np.testing.assert_array_equal(later.goals, decision.goals)


@pytest.mark.parametrize("kind", KINDS)
def test_robots_reach_their_goals_around_walls(kind: type[PlacementController]) -> None:
    starts = np.array([[1.0, 1.0], [1.0, 2.0], [2.0, 1.0]])
    record = Simulation(DOOR, kind(nodes=200.0), starts, dt=0.05).run(25.0)
    final = record.positions[-1]
    assert np.abs(final - record.positions[-20]).max() < 0.02
    cost = CoverageCost(DOOR, 48)
    assert cost(final).mean_distance < 0.6 * cost(starts).mean_distance
    assert np.count_nonzero(final[:, 0] > 3) in (1, 2)


@pytest.mark.parametrize("offset", [4e-7, -4e-7])
@pytest.mark.parametrize("kind", KINDS)
def test_a_robot_halfway_between_two_rooms_has_a_route(
    kind: type[PlacementController], offset: float
) -> None:
    # The robot fits into the door, but not with its clearance. The rounding of its position decides in which
    # of the two rooms its goal is.
    walls = (WallObstacle(((3, 0), (3, 2.885)), 0.2), WallObstacle(((3, 3.115), (3, 6)), 0.2))
    narrow = Environment("narrow door", SQUARE.boundary, walls)
    simulation = Simulation(narrow, kind(nodes=40), [[3.0 + offset, 3.0]])
    assert np.isfinite(simulation.run(1.0).positions).all()


def test_gains_out_of_range_are_rejected() -> None:
    with pytest.raises(ParameterError, match=r"local-search\.nodes: .*whole number from 16 to 20000"):
        make_controller("local-search", {"nodes": 50.5})
    with pytest.raises(ParameterError, match=r"'exemplar': expected a map, call inform"):
        Exemplar().begin(SQUARE.region, Team.homogeneous(2))
