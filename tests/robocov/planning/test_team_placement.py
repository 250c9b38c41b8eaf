"""Placement of a team on the nodes of a discovered map."""

from __future__ import annotations

import math

import numpy as np
from planning_cases import HALVES, RASTER, WINDOW, build_map, build_planner

from robocov.density import Gaussian, Gaussians
from robocov.observation.region import Region
from robocov.planning import team_placement
from robocov.planning.discovered_map import FREE, WALL, DiscoveredMap
from robocov.planning.goal_candidates import choose_candidates
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.own_goal import find_own_goal
from robocov.planning.raster import Raster
from robocov.planning.team_placement import MinSavings, TeamSituation, compute_node_weights, place_team
from robocov.planning.window import Window

NO_POSITIONS = np.empty((0, 2))


def compute_cost(planner: GridPlanner, positions: np.ndarray) -> float:
    weights = compute_node_weights(planner.map_window)
    distances = planner.compute_distances_from(positions)
    is_target = np.isfinite(distances) & (weights > 0)
    return float((weights[is_target] * distances[is_target]).sum())


def place_at_rest(planner: GridPlanner, positions: np.ndarray, fixed: tuple[int, ...] = ()) -> np.ndarray:
    """Place a team whose robots are at their previous goals. Some of them are fixed."""
    is_fixed = np.isin(np.arange(len(positions)), fixed)
    team = TeamSituation(positions, positions, is_fixed, NO_POSITIONS)
    return place_team(planner, compute_node_weights(planner.map_window), team, MinSavings(0.01, 0.01))


def test_weights_of_nodes_are_numbers_of_free_cells() -> None:
    planner = build_planner(HALVES)
    assert compute_node_weights(planner.map_window).sum() == np.count_nonzero(~build_map(HALVES).is_blocked)


def test_weights_of_nodes_are_multiplied_by_the_density() -> None:
    density = Gaussians((Gaussian((6.0, 2.0), 3.0, 0.5),), floor=1.0)
    planner = build_planner()
    plain = compute_node_weights(planner.map_window)
    dense = compute_node_weights(planner.map_window, density)
    assert (dense >= plain).all()
    node = planner.visibility.find_entry_node(np.array([6.0, 2.0]))
    np.testing.assert_allclose(
        dense[node] / plain[node], density.evaluate(planner.map_window.nodes[[node]])[0]
    )


def test_unknown_insides_of_obstacles_hardly_count_and_shadows_do() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    state[10:20, 10:20] = WALL
    state[11:19, 11:19] = 0
    state[10:20, 50:60] = 0
    planner = GridPlanner(DiscoveredMap(RASTER, state), WINDOW, 0.0)
    free_cells = np.count_nonzero(state == FREE)
    np.testing.assert_allclose(compute_node_weights(planner.map_window).sum(), free_cells + 100, rtol=1e-3)
    assert compute_node_weights(planner.map_window, only_known=True).sum() == free_cells


def test_unknown_cells_can_be_left_out() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    state[:, 40:] = 0
    planner = GridPlanner(DiscoveredMap(RASTER, state), WINDOW, 0.15)
    known = compute_node_weights(planner.map_window, only_known=True).sum()
    assert known == 40 * 40
    assert compute_node_weights(planner.map_window).sum() > 1.5 * known


def test_a_team_spreads_over_both_rooms() -> None:
    planner = build_planner(HALVES)
    positions = np.array([[1.0, 1.0], [1.5, 1.0], [1.0, 1.5], [1.5, 1.5]])
    goals = place_at_rest(planner, positions)
    assert (goals[:, 0] > 4.1).any()
    assert compute_cost(planner, goals) < 0.5 * compute_cost(planner, positions)
    for by_hand in ([[1.5, 2], [2.5, 1], [5.5, 2], [7, 2]], [[1, 1], [3, 1], [1.5, 3], [6, 2]]):
        assert compute_cost(planner, goals) < 1.02 * compute_cost(planner, np.array(by_hand, dtype=float))


def test_all_robots_make_the_same_plan() -> None:
    planner = build_planner(HALVES)
    positions = np.array([[1.0, 1.0], [1.5, 1.0], [1.0, 1.5], [1.5, 1.5]])
    goals = place_at_rest(planner, positions)
    others_goals = place_at_rest(planner, positions[[2, 0, 3, 1]])
    np.testing.assert_allclose(np.sort(goals, axis=0), np.sort(others_goals, axis=0))


def test_fixed_robots_keep_their_goals() -> None:
    planner = build_planner(HALVES)
    positions = np.array([[1.0, 1.0], [6.3, 1.9], [1.0, 1.5]])
    goals = place_at_rest(planner, positions, fixed=(1,))
    np.testing.assert_array_equal(goals[1], positions[1])
    assert (goals[[0, 2], 0] < 4.1).sum() >= 1


def test_goals_are_exchanged_only_if_that_saves_enough() -> None:
    planner = build_planner()
    weights = compute_node_weights(planner.map_window)
    is_fixed = np.zeros(2, dtype=bool)
    start = np.array([[2.0, 2.0], [6.0, 2.0]])
    goals = place_team(
        planner, weights, TeamSituation(start, start, is_fixed, NO_POSITIONS), MinSavings(1.0, 1.0)
    )
    left, right = goals[:, 0]
    assert left < right
    # Each robot is past the middle: 2.4 m from its own goal, 1.6 m from the other one.
    middle = 0.5 * (left + right)
    positions = np.array([[middle + 0.4, 2.25], [middle - 0.4, 2.25]])
    team = TeamSituation(positions, goals, is_fixed, NO_POSITIONS)
    for min_saving, is_exchanged in ((0.0, True), (0.5, True), (0.6, False)):
        new_goals = place_team(planner, weights, team, MinSavings(1.0, 1.0, swap=min_saving))
        assert np.array_equal(new_goals, goals[::-1] if is_exchanged else goals)


def test_the_own_goal_minimizes_the_cost() -> None:
    planner = build_planner()
    weights = compute_node_weights(planner.map_window)
    others = np.array([[6.0, 2.0]])
    first_node = planner.visibility.find_entry_node(np.array([0.7, 0.7]))
    no_goal = np.full(2, np.nan)
    own = find_own_goal(planner, weights, others, first_node, no_goal, 0.0)
    own = find_own_goal(planner, weights, others, own.node, no_goal, 0.0)
    cost = compute_cost(planner, np.vstack([own.goal, others]))
    for shift in ([0.3, 0], [-0.3, 0], [0, 0.3], [0, -0.3]):
        assert compute_cost(planner, np.vstack([own.goal + shift, others])) > cost
    np.testing.assert_allclose(own.goal[1], 2.0, atol=0.1)
    assert (own.cell_distances[planner.map_window.nodes[:, 0] > 5.5] == 0.0).all()


def test_the_previous_goal_is_kept_if_the_new_one_saves_little() -> None:
    planner = build_planner()
    weights = compute_node_weights(planner.map_window)
    others = np.array([[6.0, 2.0]])
    first_node = planner.visibility.find_entry_node(np.array([2.0, 2.0]))
    own = find_own_goal(planner, weights, others, first_node, np.full(2, np.nan), 0.0)
    close = own.goal + [0.05, -0.02]
    kept = find_own_goal(planner, weights, others, own.node, close, 0.01)
    assert kept.goal.tolist() == close.tolist()
    moved = find_own_goal(planner, weights, others, own.node, close, 0.0)
    np.testing.assert_allclose(moved.goal, own.goal, atol=1e-9)


def test_a_previous_goal_outside_the_parabolas_is_never_kept() -> None:
    """The parabolas say nothing about points more than one node away, however low they are there."""
    planner = build_planner()
    weights = compute_node_weights(planner.map_window)
    others = np.array([[6.0, 2.0]])
    first_node = planner.visibility.find_entry_node(np.array([2.0, 2.0]))
    own = find_own_goal(planner, weights, others, first_node, np.full(2, np.nan), 0.0)
    node = planner.map_window.nodes[own.node]
    for shift in ([1.05 * planner.map_window.spacing, 0.0], [0.0, -1.05 * planner.map_window.spacing]):
        far = node + shift
        assert find_own_goal(planner, weights, others, own.node, far, 1.0).goal.tolist() == own.goal.tolist()
        close = node + 0.9 * np.array(shift)
        assert find_own_goal(planner, weights, others, own.node, close, 1.0).goal.tolist() == close.tolist()


def test_a_team_spreads_over_narrow_tunnels() -> None:
    """Tunnels are so narrow that three of the seven contain no node of `_choose_regular_nodes`."""
    region = Region(np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 24.0], [0.0, 24.0]]))
    raster = Raster(region, 0.1)
    state = np.full(raster.shape, FREE, dtype=np.uint8)
    for rows in (slice(12, 108), slice(120, 228)):
        for column in (12, 140, 270):
            state[rows, column : column + 118] = WALL
    window = Window.build_around(raster, np.array([20.0, 12.0]), math.inf, 1000)
    planner = GridPlanner(DiscoveredMap(raster, state), window, 0.13)
    crowd = np.column_stack([np.linspace(2.0, 8.0, 6), np.full(6, 0.5)])
    by_hand = np.array([[1.5, 11.5], [13.5, 1.5], [13.5, 22.5], [26.5, 10.5], [27.5, 23.5], [39.5, 10.5]])
    goals = place_at_rest(planner, crowd)
    assert compute_cost(planner, goals) < 1.03 * compute_cost(planner, by_hand)


WALL_BESIDE_CANDIDATES = (slice(0, 28), slice(44, 45))
"""A wall like `HALVES`, but just to the left of a column of candidates for goals."""


def test_goals_are_assigned_by_the_lengths_of_paths() -> None:
    planner = build_planner(WALL_BESIDE_CANDIDATES)
    left, right = np.array([[2.0, 2.0], [6.0, 2.0]])
    # The candidate nearest to the first robot is behind the wall. The second robot is close to the passage.
    positions = np.array([[4.35, 0.5], [3.6, 2.6]])
    for goals in (np.array([left, right]), np.array([right, left])):
        team = TeamSituation(positions, goals, np.zeros(2, dtype=bool), NO_POSITIONS)
        new_goals = place_team(planner, compute_node_weights(planner.map_window), team, MinSavings(1.0, 1.0))
        assert new_goals[0, 0] < 4.4 < new_goals[1, 0]


def test_the_candidate_closest_to_a_previous_goal_is_on_the_same_side_of_a_wall() -> None:
    planner = build_planner(WALL_BESIDE_CANDIDATES)
    goals = np.array([[4.35, 0.7], [4.8, 0.7]])
    team = TeamSituation(goals, goals, np.zeros(2, dtype=bool), NO_POSITIONS)
    candidates, distances = planner.get_team_candidates(planner.visibility.find_entry_node(goals[0]))
    chosen = team_placement._choose_previous_candidates(planner, candidates, distances, team)
    left, right = planner.map_window.nodes[candidates[chosen]]
    assert left[0] < 4.4 < right[0]


def test_distances_that_are_looked_up_are_those_of_a_search() -> None:
    planner = build_planner(HALVES)
    nodes = choose_candidates(planner.graph, planner.map_window.has_clearance)
    table = planner.graph.compute_distance_table(nodes)
    for position in np.random.default_rng(0).uniform([0.2, 0.2], [3.8, 3.8], (20, 2)):
        searched = planner.compute_distances_from(position[None])[nodes]
        np.testing.assert_allclose(planner.look_up_distances(position, table), searched, atol=1e-12)
