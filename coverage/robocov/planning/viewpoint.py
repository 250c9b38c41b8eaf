"""Viewpoints from which a robot can see the unknown parts of its own cell."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robocov.planning.map_window import MapWindow
from robocov.planning.raster import SIDE_STEPS
from robocov.typing import FloatArray, IntArray

_MIN_VIEWPOINT_DISTANCE_M = 0.6
"""Minimum distance of a viewpoint from all viewpoints that the robot has already visited."""
_ADDED_LENGTH_M = 1.0
"""Length that is added to paths, so that very short ones do not outweigh the expected cost."""


class _Candidates(NamedTuple):
    """The cells next to b frontier cells: one on each of their four sides, in the order of `SIDE_STEPS`."""

    rows: IntArray
    """(b, 4) Row in the window."""
    columns: IntArray
    """(b, 4) Column in the window."""


def find_viewpoint(
    map_window: MapWindow,
    cell_distances: FloatArray,
    path_lengths: FloatArray,
    min_cost: float,
    previous_viewpoints: Sequence[FloatArray],
) -> FloatArray | None:
    """Find the best viewpoint from which a robot can look into an unknown patch of its own cell.

    An unknown patch is a connected area of cells of the map that the robot has not seen.

    Parameters
    ----------
    map_window : MapWindow
    cell_distances : (m,) array, m
        Distances from the robot's goal to the nodes of its own cell, 0 for all other nodes.
    path_lengths : (m,) array, m
        Distances from the robot to all nodes.
    min_cost : float
        Only patches with a larger expected cost (see Notes) are worth a visit. The unit is that of the
        expected cost: cells times meters.
    previous_viewpoints : sequence of (2,) arrays, m
        Viewpoints that the robot has already visited.

    Returns
    -------
    (2,) array or None, m
        Center of a free cell at the border of the patch. None if no patch is worth a visit.

    Notes
    -----
    The expected cost of a patch is its contribution to the coverage cost: the sum, over its cells, of the
    probability that the cell is free times the distance from the robot's goal in meters. For example, 50
    cells that are free with probability 0.8, at a mean distance of 3 m, have an expected cost of 120. It is
    close to zero for the inside of an obstacle. The viewpoint maximizes the expected cost of the patch,
    divided by (1 m + path length).
    """
    frontier = map_window.frontier
    frontier_costs = _compute_patch_costs(map_window, cell_distances)[frontier.patches]
    is_worth_visiting = frontier_costs > min_cost
    if not is_worth_visiting.any():
        return None
    # Candidates are the cells on the four sides of each frontier cell. Only those that are marked in
    # `frontier.is_side_free` may be viewpoints.
    rows_up, columns_right = np.array(SIDE_STEPS).T
    candidates = _Candidates(
        rows=frontier.rows[is_worth_visiting, None] + rows_up,
        columns=frontier.columns[is_worth_visiting, None] + columns_right,
    )
    lengths = _get_path_lengths(map_window, path_lengths, candidates)
    cost_per_length = frontier_costs[is_worth_visiting, None] / (_ADDED_LENGTH_M + lengths)
    values = frontier.is_side_free[is_worth_visiting] * cost_per_length
    _exclude_visited(values, map_window, candidates, previous_viewpoints)
    best = values.argmax()
    if not values.flat[best] > 0.0:
        return None
    cell = np.array([candidates.columns.flat[best], candidates.rows.flat[best]])
    return np.asarray(_compute_first_center(map_window) + cell * map_window.known_map.raster.cell_size)


def _compute_patch_costs(map_window: MapWindow, cell_distances: FloatArray) -> FloatArray:
    """Return the expected cost of each unknown patch, by label; see `find_viewpoint`."""
    # Each entry of `unknown` belongs to a patch and a node that represents some of its cells.
    unknown = map_window.unknown_area
    costs = cell_distances[unknown.nodes] * unknown.expected_free_counts
    label_count = 1 + unknown.patches.max(initial=0)
    return np.asarray(np.bincount(unknown.patches, costs, minlength=label_count))


def _get_path_lengths(map_window: MapWindow, path_lengths: FloatArray, candidates: _Candidates) -> FloatArray:
    """Return the path length to each candidate, (b, 4), from the lengths to all nodes, (m,), in meters."""
    nodes = map_window.window.find_nodes(candidates.rows, candidates.columns)
    # A cell beyond the window is not free: its node does not matter, but must exist.
    return np.asarray(path_lengths[np.clip(nodes, 0, len(path_lengths) - 1)])


def _exclude_visited(
    values: FloatArray,
    map_window: MapWindow,
    candidates: _Candidates,
    previous_viewpoints: Sequence[FloatArray],
) -> None:
    """Set the values, (b, 4), of all candidates close to a previous viewpoint to zero."""
    cell_size = map_window.known_map.raster.cell_size
    # Positions are expressed in cells, like the rows and columns of the candidates.
    offsets = np.array(previous_viewpoints).reshape(-1, 2) - _compute_first_center(map_window)
    min_distance = _MIN_VIEWPOINT_DISTANCE_M / cell_size
    for column, row in offsets / cell_size:
        squared_distances = (column - candidates.columns) ** 2 + (row - candidates.rows) ** 2
        values[squared_distances < min_distance**2] = 0.0


def _compute_first_center(map_window: MapWindow) -> FloatArray:
    """Return the center of the lower left cell of the window, from which rows and columns count, (2,) m."""
    window = map_window.window
    raster = map_window.known_map.raster
    return raster.compute_centers(np.array(window.first_row), np.array(window.first_column))
