"""Planners: distances from positions, team candidates, and which robots share a planner."""

from __future__ import annotations

import numpy as np
from map_window_cases import (
    RASTER,
    build_map_window,
    build_open_room,
    build_wall_with_door,
    build_whole_window,
)

from robocov.planning.discovered_map import FREE, UNKNOWN, DiscoveredMap
from robocov.planning.grid_planner import GridPlanner

NO_DOOR = slice(0, 0)


def build_planner(is_blocked: np.ndarray, clearance: float = 0.15) -> GridPlanner:
    map_window = build_map_window(is_blocked, clearance)
    return GridPlanner(map_window.known_map, map_window.window, clearance)


def test_distances_from_positions_are_nearly_straight_in_an_open_room() -> None:
    planner = build_planner(build_open_room(), clearance=0.0)
    positions = np.array([[1.23, 2.07], [4.4, 1.11]])
    straight = np.hypot(*(planner.map_window.nodes[:, None] - positions).T).min(axis=0)
    distances = planner.compute_distances_from(positions)
    is_reached = np.isfinite(distances)
    assert (distances[is_reached] >= straight[is_reached] - 1e-9).all()
    assert (distances[is_reached] <= 1.06 * straight[is_reached] + 1e-9).all()
    assert np.isinf(planner.compute_distances_from(np.empty((0, 2)))).all()


def test_a_map_that_has_not_changed_keeps_its_planner() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    window = build_whole_window()
    planner = GridPlanner(DiscoveredMap(RASTER, state), window, 0.15)
    assert planner.update(DiscoveredMap(RASTER, state.copy()), window) is planner
    changed = state.copy()
    changed[:, 20:40] = UNKNOWN
    assert planner.update(DiscoveredMap(RASTER, changed), window) is not planner


def test_robots_that_share_a_map_share_its_planner() -> None:
    known_map = DiscoveredMap(RASTER, np.full(RASTER.shape, FREE, dtype=np.uint8))
    window = build_whole_window()
    planner = GridPlanner.get_shared(known_map, window, 0.15)
    assert GridPlanner.get_shared(known_map, window, 0.15) is planner
    assert GridPlanner.get_shared(known_map, window, 0.2) is not planner


def test_team_candidates_are_in_the_component_of_the_given_node() -> None:
    planner = build_planner(build_wall_with_door(NO_DOOR))
    left = planner.visibility.find_nearest_node(np.array([1.0, 2.0]))
    right = planner.visibility.find_nearest_node(np.array([5.0, 2.0]))
    # The last case repeats the first one: the stored candidates of a component must not replace those of
    # another one.
    for node, is_left in ((left, True), (right, False), (left, True)):
        candidates = planner.get_team_candidates(node)
        assert len(candidates.nodes) > 0
        assert ((planner.map_window.nodes[candidates.nodes, 0] < 3.0) == is_left).all()
        np.testing.assert_array_equal(
            candidates.distances[:, node], planner.graph.get_distances(node)[candidates.nodes]
        )
