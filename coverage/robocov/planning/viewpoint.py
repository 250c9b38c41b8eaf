"""Viewpoints from which a robot can see the unknown parts of its own cell."""

from collections.abc import Sequence

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.map_window import SIDES

_MIN_VIEWPOINT_DISTANCE_M = 0.6
"""Minimum distance of a viewpoint from all viewpoints that the robot has already visited."""
_ADDED_LENGTH_M = 1.0
"""Length that is added to paths, so that very short ones do not outweigh the expected cost."""


def find_viewpoint(
    planner: GridPlanner,
    cell_distances: Array,
    path_lengths: Array,
    min_stake: float,
    previous_viewpoints: Sequence[Array],
) -> Array | None:
    """Find the most worthwhile viewpoint from which a robot can look into an unknown patch of its own cell.

    An unknown patch is a connected area of cells of the map that the robot has not seen.

    Parameters
    ----------
    planner : GridPlanner
    cell_distances : (m,) array, m
        Distances from the robot's goal to the nodes of its own cell, 0 for all other nodes.
    path_lengths : (m,) array, m
        Distances from the robot to all nodes.
    min_stake : float
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
    frontier = planner.frontier
    frontier_costs = _compute_patch_costs(planner, cell_distances)[frontier.patches]
    is_worth_visiting = frontier_costs > min_stake
    if not is_worth_visiting.any():
        return None
    # The frontier consists of the unknown cells that have a free one on at least one of their four sides. The
    # cells on these sides, (b, 4), are possible viewpoints if they are marked in `frontier.is_side_free`.
    rows_up, columns_right = np.array(SIDES).T
    side_rows = frontier.rows[is_worth_visiting, None] + rows_up
    side_columns = frontier.columns[is_worth_visiting, None] + columns_right
    lengths = _get_path_lengths(planner, path_lengths, side_rows, side_columns)
    cost_per_length = frontier_costs[is_worth_visiting, None] / (_ADDED_LENGTH_M + lengths)
    values = frontier.is_side_free[is_worth_visiting] * cost_per_length
    # Rows and columns are counted from the first cell of the window. The same unit is used for positions.
    window = planner.window
    raster = planner.known_map.raster
    first_center = raster.compute_centers(np.array(window.first_row), np.array(window.first_column))
    previous_cells = (np.array(previous_viewpoints).reshape(-1, 2) - first_center) / raster.cell_size
    min_distance = _MIN_VIEWPOINT_DISTANCE_M / raster.cell_size
    for previous_column, previous_row in previous_cells:
        squared_distances = (previous_column - side_columns) ** 2 + (previous_row - side_rows) ** 2
        values[squared_distances < min_distance**2] = 0.0
    best = values.argmax()
    if not values.flat[best] > 0.0:
        return None
    cell = np.array([side_columns.flat[best], side_rows.flat[best]])
    return np.asarray(first_center + cell * raster.cell_size)


def _compute_patch_costs(planner: GridPlanner, cell_distances: Array) -> Array:
    """Return the expected cost of each unknown patch, by label; see `find_viewpoint`."""
    # Each entry of `unknown` belongs to a patch and a node that represents some of its cells.
    unknown = planner.unknown_area
    costs = cell_distances[unknown.nodes] * unknown.expected_free_counts
    label_count = 1 + unknown.patches.max(initial=0)
    return np.asarray(np.bincount(unknown.patches, costs, minlength=label_count))


def _get_path_lengths(planner: GridPlanner, path_lengths: Array, rows: IntArray, columns: IntArray) -> Array:
    """Return the lengths of the paths, (m,) by node, to the nodes of cells in the given rows and columns."""
    window = planner.window
    nodes = rows // window.stride * window.columns + columns // window.stride
    # A cell beyond the window is not free: its node does not matter, but must exist.
    return np.asarray(path_lengths[np.clip(nodes, 0, len(path_lengths) - 1)])
