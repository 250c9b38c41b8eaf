"""Viewpoints from which a robot can see unknown parts of the region."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from robocov.density import Density
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.map_window import MapWindow
from robocov.planning.raster import SIDE_STEPS
from robocov.typing import FloatArray, IntArray

_MIN_VIEWPOINT_DISTANCE_M = 0.6
"""Minimum distance of a viewpoint from all viewpoints that the robot has already visited."""
_ADDED_LENGTH_M = 1.0
"""Length that is added to paths, so that very short ones do not outweigh the value of a patch."""
_MAX_TRIED_POSITIONS = 16
"""Maximum number of positions in a patch that are tried for one more robot."""


class _Candidates(NamedTuple):
    """The cells next to b frontier cells: one on each of their four sides, in the order of `SIDE_STEPS`."""

    rows: IntArray
    """(b, 4) Row in the window."""
    columns: IntArray
    """(b, 4) Column in the window."""


def find_viewpoint(
    map_window: MapWindow,
    patch_values: FloatArray,
    path_lengths: FloatArray,
    previous_viewpoints: Sequence[FloatArray],
) -> FloatArray | None:
    """Find the best viewpoint from which a robot can look into an unknown patch.

    An unknown patch is a connected area of cells of the map that the robot has not seen.

    Parameters
    ----------
    map_window : MapWindow
    patch_values : (1 + patches,) array
        Value of looking into each patch, by label; 0 for patches that are not worth a visit.
    path_lengths : (m,) array, m
        Distances from the robot's node to all nodes; infinite for nodes at which it does not look for
        viewpoints.
    previous_viewpoints : sequence of (2,) arrays, m
        Viewpoints that the robot has already visited.

    Returns
    -------
    (2,) array or None, m
        Center of a free cell next to an unknown patch: the one that maximizes the value of its patch, divided
        by (1 m + path length). None if no patch is worth a visit, or all viewpoints there have been visited
        or are infinitely far away.
    """
    frontier = map_window.frontier
    frontier_values = patch_values[frontier.patches]
    is_worth_visiting = frontier_values > 0.0
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
    value_per_length = frontier_values[is_worth_visiting, None] / (_ADDED_LENGTH_M + lengths)
    values = frontier.is_side_free[is_worth_visiting] * value_per_length
    _exclude_visited(values, map_window, candidates, previous_viewpoints)
    best = values.argmax()
    if not values.flat[best] > 0.0:
        return None
    cell = np.array([candidates.columns.flat[best], candidates.rows.flat[best]])
    return np.asarray(_compute_first_center(map_window) + cell * map_window.known_map.raster.cell_size)


def compute_patch_costs(
    map_window: MapWindow, cell_distances: FloatArray, density: Density | None = None
) -> FloatArray:
    """Compute the expected cost of each unknown patch.

    Parameters
    ----------
    map_window : MapWindow
    cell_distances : (m,) array, m
        Distances from the robot's goal to the nodes of its own cell, 0 for all other nodes.
    density : Density or None
        Weight of the cells, evaluated at each node; None means 1 everywhere.

    Returns
    -------
    (1 + patches,) array
        Expected costs by label, in cells times meters. Entry 0 is unused, because labels start at 1.

    Notes
    -----
    The expected cost of a patch is its contribution to the coverage cost: the sum, over its cells, of the
    probability that the cell is free times the density times the distance from the robot's goal in meters.
    For example, 50 cells that are free with probability 0.8, at a mean distance of 3 m, have an expected cost
    of 120 if the density is 1. It is close to zero for the inside of an obstacle.
    """
    # Each entry of `unknown` belongs to a patch and a node that represents some of its cells.
    unknown = map_window.unknown_area
    weights = _weight_by_density(map_window, unknown.expected_free_counts, density)
    return _sum_by_patch(map_window, cell_distances[unknown.nodes] * weights)


def compute_possible_savings(
    planner: GridPlanner,
    nearest_distances: FloatArray,
    density: Density | None = None,
    *,
    min_saving: float = 0.0,
) -> FloatArray:
    """Compute how much one more robot in each unknown patch could save if all cells of the patch were free.

    Parameters
    ----------
    planner : GridPlanner
    nearest_distances : (m,) array, m
        Distance from each node to the nearest robot; infinite if no robot can reach it.
    density : Density or None
        Weight of the cells, evaluated at each node; None means 1 everywhere.
    min_saving : float
        Savings count only if they exceed this value, in cells times meters.

    Returns
    -------
    (1 + patches,) array
        Savings by label, in cells times meters; 0 if they are at most `min_saving`, and for patches without a
        free cell at their border from which a robot could look in. Entry 0 is unused, because labels start at
        1.

    Notes
    -----
    The expected cost (`compute_patch_costs`) of space among walls is small, because the space may be the
    inside of an obstacle. But it may also be a winding corridor, and only its entrance is visible. In that
    case, the possible saving is large: the decrease of the sum, over all cells of the patch, of the density
    times the distance to the nearest robot when one more robot is placed in the patch. Only some positions
    are tried for this robot, so the result may be slightly too low. Distances through unknown cells include
    the detour that `LatticeGraph` assumes.
    """
    map_window = planner.map_window
    unknown = map_window.unknown_area
    # Nodes that no robot can reach do not count.
    distances = np.where(np.isfinite(nearest_distances), nearest_distances, 0.0)
    weights = _weight_by_density(map_window, unknown.counts, density)
    # No robot can save more than the current cost of the patch. This bound takes little time to compute, and
    # rules out most patches.
    upper_bounds = _sum_by_patch(map_window, distances[unknown.nodes] * weights)
    savings = np.zeros(len(upper_bounds))
    for patch in np.unique(map_window.frontier.patches):
        if upper_bounds[patch] > min_saving:
            is_in_patch = unknown.patches == patch
            saving = _compute_saving(planner, distances, unknown.nodes[is_in_patch], weights[is_in_patch])
            savings[patch] = saving if saving > min_saving else 0.0
    return savings


def _compute_saving(
    planner: GridPlanner, distances: FloatArray, patch_nodes: IntArray, weights: FloatArray
) -> float:
    """Return the saving of one more robot at the best of the nodes that are tried, in cells times meters.

    Parameters
    ----------
    planner : GridPlanner
    distances : (m,) array, m
        Distance from each node to the nearest of the present robots; 0 for nodes that none can reach.
    patch_nodes : (k,) int array
        Nodes of the patch.
    weights : (k,) array
        Number of cells of the patch that each of these nodes represents, times the density.
    """
    is_usable = planner.map_window.has_clearance[patch_nodes] & (distances[patch_nodes] > 0.0)
    usable_nodes = patch_nodes[is_usable]
    step = max(1, math.ceil(len(usable_nodes) / _MAX_TRIED_POSITIONS))
    patch_distances = distances[patch_nodes]
    max_distance = float(patch_distances.max())
    table = planner.graph.compute_distance_table(usable_nodes[::step], max_distance)[:, patch_nodes]
    decreases = np.maximum(patch_distances - table, 0.0) @ weights
    return float(decreases.max(initial=0.0))


def _weight_by_density(map_window: MapWindow, counts: FloatArray, density: Density | None) -> FloatArray:
    """Multiply the counts of the entries of `map_window.unknown_area` by the density at their nodes."""
    if density is None or density.is_uniform:
        return counts
    return counts * density.evaluate(map_window.nodes[map_window.unknown_area.nodes])


def _sum_by_patch(map_window: MapWindow, values: FloatArray) -> FloatArray:
    """Sum the values of the entries of `map_window.unknown_area` by the label of the patch."""
    patches = map_window.unknown_area.patches
    return np.bincount(patches, values, minlength=1 + patches.max(initial=0)).astype(np.float64)


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
