"""Viewpoints, the value of looking into unknown parts of the region, and connected positions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from planning_cases import HALVES, RASTER, WINDOW, build_planner

from robocov.density import Raster as DensityRaster
from robocov.planning.discovered_map import FREE, UNKNOWN, WALL, DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.viewpoint import compute_patch_costs, compute_possible_savings, find_viewpoint

CLEARANCE_M = 0.15
BLOCK = (slice(10, 20), slice(10, 20))
"""An obstacle whose inside is unknown."""
SHADOW = (slice(10, 20), slice(50, 60))
"""An unknown area among free cells."""
CHAMBER = (slice(4, 36), slice(41, 76))
"""An unknown area behind walls with a door."""


def build_planner_with_obstacle_and_shadow() -> GridPlanner:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    state[BLOCK] = WALL
    state[11:19, 11:19] = UNKNOWN
    state[SHADOW] = UNKNOWN
    return GridPlanner(DiscoveredMap(RASTER, state), WINDOW, 0.0)


def build_planner_with_chamber(door: slice) -> GridPlanner:
    """Build a planner for an unknown chamber within walls of one cell, with a door in the left wall."""
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    rows, columns = CHAMBER
    state[rows.start - 1 : rows.stop + 1, columns.start - 1 : columns.stop + 1] = WALL
    state[CHAMBER] = UNKNOWN
    state[door, columns.start - 1] = FREE
    return GridPlanner(DiscoveredMap(RASTER, state), WINDOW, CLEARANCE_M)


def get_label(planner: GridPlanner, area: tuple[slice, slice]) -> int:
    """Return the label of the unknown patch in the middle of an area."""
    rows, columns = area
    row = (rows.start + rows.stop) // 2
    column = (columns.start + columns.stop) // 2
    return int(planner.map_window.patches[row, column])


def test_a_viewpoint_is_at_the_border_of_an_open_patch_and_away_from_previous_ones() -> None:
    map_window = build_planner_with_obstacle_and_shadow().map_window
    ones = np.ones(len(map_window.nodes))
    costs = compute_patch_costs(map_window, ones)
    first = find_viewpoint(map_window, costs, ones, ())
    assert first is not None
    assert 4.9 < first[0] < 6.1
    assert 0.9 < first[1] < 2.1
    second = find_viewpoint(map_window, costs, ones, (first,))
    assert second is not None
    assert math.dist(first, second) > 0.5


def test_there_is_no_viewpoint_for_patches_without_value() -> None:
    map_window = build_planner_with_obstacle_and_shadow().map_window
    ones = np.ones(len(map_window.nodes))
    assert find_viewpoint(map_window, np.zeros(1 + map_window.patches.max()), ones, ()) is None


def test_there_is_no_viewpoint_at_nodes_that_are_infinitely_far() -> None:
    planner = build_planner_with_obstacle_and_shadow()
    map_window = planner.map_window
    costs = compute_patch_costs(map_window, np.ones(len(map_window.nodes)))
    is_right = map_window.nodes[:, 0] > 5.5
    viewpoint = find_viewpoint(map_window, costs, np.where(is_right, 1.0, np.inf), ())
    assert viewpoint is not None
    assert viewpoint[0] > 5.5 - map_window.spacing
    assert find_viewpoint(map_window, costs, np.full(len(map_window.nodes), np.inf), ()) is None


def test_there_is_no_viewpoint_if_everything_is_known() -> None:
    map_window = build_planner(HALVES).map_window
    ones = np.ones(len(map_window.nodes))
    costs = compute_patch_costs(map_window, ones)
    assert find_viewpoint(map_window, costs, ones, ()) is None


def test_the_expected_cost_is_small_for_the_inside_of_an_obstacle() -> None:
    planner = build_planner_with_obstacle_and_shadow()
    costs = compute_patch_costs(planner.map_window, np.full(len(planner.map_window.nodes), 2.0))
    np.testing.assert_allclose(costs[get_label(planner, SHADOW)], 2.0 * 100, rtol=1e-3)
    assert costs[get_label(planner, BLOCK)] < 0.1


def test_the_possible_saving_is_that_of_the_best_position_in_the_patch() -> None:
    planner = build_planner_with_chamber(slice(17, 23))
    map_window = planner.map_window
    robot = np.array([[3.0, 2.0]])
    nearest = planner.compute_distances_from(robot)
    savings = compute_possible_savings(planner, nearest)
    # The best of all nodes, by the definition of the saving.
    label = get_label(planner, CHAMBER)
    rows, columns = np.nonzero(map_window.patches == label)
    nodes = map_window.window.find_nodes(rows, columns)
    best = 0.0
    for node in np.unique(nodes[map_window.has_clearance[nodes]]):
        distances = planner.graph.get_distances(node)[nodes]
        best = max(best, float(np.maximum(nearest[nodes] - distances, 0.0).sum()))
    # Not all positions are tried, so the saving may be a little lower.
    assert 0.8 * best < savings[label] <= best + 1e-6
    # A chamber behind a door is unlikely to be free, so that its expected cost is much lower.
    assert compute_patch_costs(map_window, nearest)[label] < 0.5 * savings[label]


def test_small_savings_and_patches_without_an_entrance_do_not_count() -> None:
    planner = build_planner_with_chamber(slice(17, 23))
    nearest = planner.compute_distances_from(np.array([[3.0, 2.0]]))
    label = get_label(planner, CHAMBER)
    saving = compute_possible_savings(planner, nearest)[label]
    assert compute_possible_savings(planner, nearest, min_saving=0.99 * saving)[label] == saving
    assert compute_possible_savings(planner, nearest, min_saving=saving)[label] == 0.0
    closed = build_planner_with_chamber(slice(0, 0))
    assert compute_possible_savings(closed, nearest)[get_label(closed, CHAMBER)] == 0.0
    too_narrow = build_planner_with_chamber(slice(19, 21))
    assert compute_possible_savings(too_narrow, nearest)[get_label(too_narrow, CHAMBER)] == 0.0


def test_a_robot_in_the_patch_leaves_little_to_save() -> None:
    planner = build_planner_with_chamber(slice(17, 23))
    label = get_label(planner, CHAMBER)
    outside = planner.compute_distances_from(np.array([[3.0, 2.0]]))
    inside = planner.compute_distances_from(np.array([[3.0, 2.0], [5.8, 2.0]]))
    savings = [compute_possible_savings(planner, nearest)[label] for nearest in (outside, inside)]
    assert savings[1] < 0.5 * savings[0]


def test_costs_and_savings_are_proportional_to_the_density() -> None:
    """The density is 4 in the right half, which contains the chamber, and 1 in the left half."""
    planner = build_planner_with_chamber(slice(17, 23))
    label = get_label(planner, CHAMBER)
    nearest = planner.compute_distances_from(np.array([[3.0, 2.0]]))
    density = DensityRaster(np.array([[1.0, 4.0]]), extent=RASTER.region.bounds, interpolation="cells")
    savings, weighted_savings = (
        compute_possible_savings(planner, nearest, each)[label] for each in (None, density)
    )
    assert weighted_savings == pytest.approx(4.0 * savings)
    costs, weighted_costs = (
        compute_patch_costs(planner.map_window, nearest, each)[label] for each in (None, density)
    )
    assert weighted_costs == pytest.approx(4.0 * costs)


def test_positions_are_connected_if_a_path_through_free_cells_is_known() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    state[:, 40:50] = UNKNOWN
    map_window = GridPlanner(DiscoveredMap(RASTER, state), WINDOW, CLEARANCE_M).map_window
    positions = np.array([[1.0, 1.0], [3.0, 3.5], [4.5, 2.0], [7.0, 1.0]])
    assert map_window.find_connected(positions).tolist() == [True, True, False, False]
    # The first position is not in a cell that is known to be free.
    assert not map_window.find_connected(positions[[2, 0, 1]]).any()
    assert map_window.find_connected(positions[[3, 0, 3]]).tolist() == [True, False, True]
    assert not map_window.find_connected(positions[[2, 0]]).any()
