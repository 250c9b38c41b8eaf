"""Lines of sight, and the nodes that are visible from a position."""

from __future__ import annotations

import numpy as np
from map_window_cases import build_map_window, build_open_room, build_wall_with_door

from robocov.planning.node_visibility import NO_NODE, NodeVisibility


def test_a_visible_node_is_not_behind_a_wall() -> None:
    visibility = NodeVisibility(build_map_window(build_wall_with_door(), max_nodes=40))
    nodes = visibility.map_window.nodes
    position = np.array([2.88, 1.0])
    nearest = nodes[visibility.find_nearest_node(position)]
    visible = nodes[visibility.find_entry_node(position)]
    assert visible[0] < 2.9 < 3.1 < nearest[0]


def test_visible_nodes_are_sorted_by_distance_and_in_sight() -> None:
    visibility = NodeVisibility(build_map_window(build_wall_with_door()))
    map_window = visibility.map_window
    position = np.array([2.6, 1.0])
    visible = visibility.get_entry_nodes(position)
    distances = np.hypot(*(map_window.nodes[visible] - position).T)
    assert len(visible) > 1
    assert (np.diff(distances) >= 0.0).all()
    assert (map_window.nodes[visible, 0] < 2.9).all()
    assert map_window.has_clearance[visible].all()


def test_a_position_inside_a_wall_has_the_nearest_node() -> None:
    visibility = NodeVisibility(build_map_window(build_wall_with_door()))
    position = np.array([3.0, 1.0])
    assert visibility.get_entry_nodes(position).tolist() == [visibility.find_nearest_node(position)]


def test_without_clearance_no_node_is_visible() -> None:
    visibility = NodeVisibility(build_map_window(~build_open_room()))
    position = np.array([3.0, 1.0])
    assert visibility.find_nearest_node(position) == NO_NODE
    assert visibility.find_entry_node(position) == NO_NODE


def test_cells_close_to_the_position_do_not_obstruct_a_line() -> None:
    visibility = NodeVisibility(build_map_window(build_wall_with_door()))
    is_blocked = visibility.map_window.is_blocked
    position = np.array([2.95, 1.0])
    ends = np.array([[1.0, 1.0], [5.0, 1.0]])
    assert visibility.find_clear_lines(position, ends, is_blocked).tolist() == [False, False]
    assert visibility.find_clear_lines(position, ends, is_blocked, 0.1).tolist() == [True, False]
