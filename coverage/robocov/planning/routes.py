"""Shortest routes from a position to a goal around known walls."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from robocov.planning.lattice_graph import LatticeGraph
from robocov.planning.node_visibility import NO_NODE, NodeVisibility
from robocov.typing import FloatArray


def find_route(
    graph: LatticeGraph, visibility: NodeVisibility, position: FloatArray, goal: FloatArray
) -> FloatArray:
    """Find the shortest route from a position to a goal.

    Parameters
    ----------
    graph : LatticeGraph
    visibility : NodeVisibility
        Lines of sight in the map window of the graph.
    position, goal : (2,) arrays, m

    Returns
    -------
    (w, 2) array, m
        Waypoints, each in sight of the one before. The last one is the goal. If that cannot be reached,
        it is the reachable node closest to the goal, or the position itself if no node can be reached.
        Between waypoints, the route crosses no cell near a wall. If the position itself is near a wall,
        the route leaves it in a straight line.
    """
    map_window = graph.map_window
    is_direct = visibility.find_clear_lines(
        position, goal[None], map_window.is_near_wall, map_window.clearance
    )[0]
    if is_direct:
        return np.array(goal[None])
    first = _find_first_node(visibility, position)
    if first == NO_NODE:
        return np.array(position[None])
    distances, predecessors = graph.find_shortest_paths(first)
    last_candidates = visibility.find_nearest_nodes(goal, np.isfinite(distances) & map_window.has_clearance)
    if not len(last_candidates):
        return np.array(position[None])
    # The robot may be too close to a wall where its route starts, but not where it ends. Therefore no cells
    # around the goal are ignored.
    is_visible = visibility.find_clear_lines(goal, map_window.nodes[last_candidates], map_window.is_near_wall)
    # The last node is the nearest one in sight of the goal, or simply the nearest one if none is in sight
    # (`argmax` returns the first True, or 0 if there is none).
    last = int(last_candidates[is_visible.argmax()])
    path = [last]
    while path[-1] != first:
        path.append(int(predecessors[path[-1]]))
    path.reverse()
    points = _expand_portals(graph, path)
    if is_visible.any():
        points = np.vstack([points, goal])
    return _remove_detours(visibility, position, points)


def _find_first_node(visibility: NodeVisibility, position: FloatArray) -> int:
    """Return the first node of a route: the nearest node with clearance in sight of a position.

    If possible, the line to the node crosses no cell near a wall, except for those around the position: the
    robot may itself be too close to a wall. Return `NO_NODE` if none of the nearest nodes is in sight.
    """
    map_window = visibility.map_window
    candidates = visibility.find_nearest_nodes(position, map_window.has_clearance)
    ends = map_window.nodes[candidates]
    is_visible = visibility.find_clear_lines(
        position, ends, map_window.is_near_wall, 2.0 * map_window.clearance
    )
    if not is_visible.any():
        is_visible = visibility.find_clear_lines(position, ends, map_window.is_blocked)
    return int(candidates[is_visible.argmax()]) if is_visible.any() else NO_NODE


def _expand_portals(graph: LatticeGraph, path: Sequence[int]) -> FloatArray:
    """Return the positions along a path of nodes, (k, 2) m, with those of the cells in its portals."""
    nodes = graph.map_window.nodes
    window = graph.map_window.window
    raster = graph.map_window.known_map.raster
    origin = np.array([window.first_row, window.first_column])
    positions = [nodes[path[:1]]]
    for node, next_node in pairwise(path):
        cells = graph.portal_cells.get((node, next_node))
        if cells is not None:
            positions.append(raster.compute_centers(*(cells + origin).T))
        positions.append(nodes[[next_node]])
    return np.concatenate(positions)


def _remove_detours(visibility: NodeVisibility, position: FloatArray, points: FloatArray) -> FloatArray:
    """Return the points of a route without those that can be skipped, because later ones are in sight.

    A point is in sight if the line to it crosses no cell near a wall. On the first line, cells around the
    position do not count, because the robot may itself be too close to a wall.
    """
    map_window = visibility.map_window
    remaining: list[FloatArray] = []
    current = position
    k = 0
    while k < len(points):
        ignored_length = 0.0 if remaining else map_window.clearance
        is_visible = visibility.find_clear_lines(current, points[k:], map_window.is_near_wall, ignored_length)
        if is_visible.any():
            # Skip the points before the last one in sight.
            k += int(is_visible.nonzero()[0][-1])
        current = points[k]
        remaining.append(current)
        k += 1
    return np.array(remaining)
