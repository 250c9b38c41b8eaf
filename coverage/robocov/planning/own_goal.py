"""The best position for one robot while all others stay where they are."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from robocov.planning.grid_planner import GridPlanner
from robocov.planning.map_window import MapWindow
from robocov.planning.node_visibility import NO_NODE
from robocov.planning.raster import SIDE_STEPS
from robocov.planning.team_placement import UNREACHABLE_M
from robocov.typing import FloatArray, IntArray

_MAX_MOVES = 6
"""Maximum number of moves of a search, each to a neighboring node."""
_LIMIT_PER_CELL_RADIUS = 1.5
"""Limit of the distances that a search computes, divided by the radius of the robot's cell."""
_LIMIT_MARGIN_SPACINGS = 4.0
"""Length that is added to this limit, in spacings of nodes."""
_MAX_SHIFT_SPACINGS = 0.5
"""Maximum distance of a goal from the nearest node, in x and in y, in spacings of nodes."""


class OwnGoal(NamedTuple):
    """A local minimum of the coverage cost as a function of the position of one robot."""

    goal: FloatArray
    """(2,) m, the position of minimum cost."""
    node: int
    """The node at which the search ended, close to the goal."""
    cell_distances: FloatArray
    """(m,) Distances from that node to the nodes of the robot's own cell, in meters; 0 for other nodes."""
    cost: float
    """Coverage cost J of the whole team with the robot at that node, in cells times meters."""


def find_own_goal(
    planner: GridPlanner,
    weights: FloatArray,
    other_positions: FloatArray,
    first_node: int,
    previous_goal: FloatArray,
    min_saving: float,
) -> OwnGoal:
    """Find a local minimum of the coverage cost as a function of the position of one robot.

    Parameters
    ----------
    planner : GridPlanner
    weights : (m,) array
        Weights of the nodes; see `compute_node_weights`.
    other_positions : (k, 2) array, m
        Positions of all other robots.
    first_node : int
        Node at which the search starts.
    previous_goal : (2,) array, m
        Goal that the robot keeps unless a new one saves enough; nan if there is none.
    min_saving : float
        Fraction of the cost of the robot's own cell that a new goal must save.

    Returns
    -------
    OwnGoal

    Notes
    -----
    The search moves to a neighboring node as long as one is better, a few times at most. The goal is the
    minimum of two parabolas, in x and in y, through the costs of the last node and its neighbors.
    """
    search = _NodeSearch(planner, weights, other_positions, first_node)
    node = first_node
    neighbors = search.evaluate_neighbors(node)
    for _ in range(_MAX_MOVES):
        candidates = [neighbor for neighbor in neighbors if neighbor != NO_NODE]
        best = min(candidates, key=search.costs.__getitem__, default=node)
        if not search.costs[best] < search.costs[node]:
            break
        node = best
        neighbors = search.evaluate_neighbors(node)
    cell_distances = search.compute_cell_distances(node)
    goal, excess = _refine_goal(planner.map_window, node, neighbors, search.costs, previous_goal)
    if np.isfinite(previous_goal).all():
        cell_cost = float((search.target_weights * cell_distances[search.targets]).sum())
        if excess < min_saving * cell_cost:
            goal = previous_goal.copy()
    return OwnGoal(goal=goal, node=node, cell_distances=cell_distances, cost=search.costs[node])


class _NodeSearch:
    """The coverage cost as a function of the node at which the robot is.

    It is computed only for the nodes that the search visits, and their neighbors.

    Attributes
    ----------
    targets : (t,) int array
        The nodes that count in the cost.
    target_weights : (t,) array
        Weights of these nodes.
    costs : dict of int to float
        Coverage cost with the robot at each node that has been evaluated.
    """

    def __init__(
        self, planner: GridPlanner, weights: FloatArray, other_positions: FloatArray, first_node: int
    ) -> None:
        """Start a search at a node.

        Parameters
        ----------
        planner : GridPlanner
        weights : (m,) array
            Weights of all nodes.
        other_positions : (k, 2) array, m
            Positions of all other robots.
        first_node : int
        """
        self._planner = planner
        distances = planner.graph.get_distances(first_node)
        self.targets: IntArray = np.flatnonzero(np.isfinite(distances) & (weights > 0.0))
        self.target_weights: FloatArray = weights[self.targets]
        other_distances = planner.compute_distances_from(other_positions)[self.targets]
        self._other_distances: FloatArray = np.minimum(other_distances, UNREACHABLE_M)
        own_distances = distances[self.targets]
        cell_radius = float(own_distances[own_distances < self._other_distances].max(initial=0.0))
        spacing = planner.map_window.spacing
        # Nodes beyond the limit cannot become part of the robot's cell within the few moves of the search.
        self._limit = _LIMIT_PER_CELL_RADIUS * cell_radius + _LIMIT_MARGIN_SPACINGS * spacing
        self._node_count = len(weights)
        self._distances: dict[int, FloatArray] = {}
        self.costs: dict[int, float] = {}

    def evaluate_neighbors(self, node: int) -> list[int]:
        """Add the costs of a node and its neighbors to `costs`. Return the neighbors."""
        neighbors = _list_neighbors(self._planner.map_window, node)
        new_nodes = [k for k in (node, *neighbors) if k != NO_NODE and k not in self._distances]
        table = self._planner.graph.compute_distance_table(new_nodes, self._limit)
        for new_node, distances_to_all in zip(new_nodes, table, strict=True):
            distances = distances_to_all[self.targets]
            nearest = np.minimum(self._other_distances, distances)
            self._distances[new_node] = distances
            self.costs[new_node] = float((self.target_weights * nearest).sum())
        return neighbors

    def compute_cell_distances(self, node: int) -> FloatArray:
        """Compute the distances, (m,) in meters, from a node to those of the robot's cell; 0 for others."""
        distances = self._distances[node]
        is_own = distances < self._other_distances
        cell_distances = np.zeros(self._node_count)
        cell_distances[self.targets] = np.where(is_own, np.minimum(distances, self._limit), 0.0)
        return cell_distances


def _list_neighbors(map_window: MapWindow, node: int) -> list[int]:
    """Return the nodes on the four sides of a node, in the order of `SIDE_STEPS`.

    `NO_NODE` stands for a node without clearance or outside the window.
    """
    rows = map_window.window.rows
    columns = map_window.window.columns
    row, column = divmod(node, columns)
    neighbors = []
    for up, right in SIDE_STEPS:
        is_inside = 0 <= row + up < rows and 0 <= column + right < columns
        neighbor = node + up * columns + right
        neighbors.append(neighbor if is_inside and map_window.has_clearance[neighbor] else NO_NODE)
    return neighbors


def _refine_goal(
    map_window: MapWindow,
    node: int,
    neighbors: list[int],
    costs: Mapping[int, float],
    previous_goal: FloatArray,
) -> tuple[FloatArray, float]:
    """Return the position of minimum cost near a node, and the excess cost of the previous goal.

    The cost is approximated by a parabola in x and one in y, each through the costs of the node and of its
    two neighbors. Along an axis on which a neighbor is missing, the goal stays at the node. If the previous
    goal is more than one spacing away, the parabolas do not hold, and the excess is infinite.
    """
    # The order is that of `SIDE_STEPS`. Axis 0 is x, and axis 1 is y.
    right, up, left, down = neighbors
    goal = map_window.nodes[node].copy()
    excess = 0.0
    for axis, (ahead, behind) in enumerate(((right, left), (up, down))):
        offset = (previous_goal[axis] - map_window.nodes[node][axis]) / map_window.spacing
        if abs(offset) > 1.0:
            excess = math.inf
        if NO_NODE in (ahead, behind):
            continue
        parabola = _fit_parabola(costs[behind], costs[node], costs[ahead])
        if parabola.curvature > 0.0:
            shift = parabola.find_minimum()
            goal[axis] += shift * map_window.spacing
            excess += parabola.evaluate(offset) - parabola.evaluate(shift)
    return goal, excess


class _Parabola(NamedTuple):
    """The change of a cost at an offset t from a node, in spacings of nodes: slope t + curvature t² / 2."""

    slope: float
    curvature: float

    def evaluate(self, offset: float) -> float:
        """Return the change of the cost at an offset from the node, in spacings."""
        return self.slope * offset + 0.5 * self.curvature * offset * offset

    def find_minimum(self) -> float:
        """Return the offset of the minimum within `_MAX_SHIFT_SPACINGS`, for a positive curvature."""
        return min(max(-self.slope / self.curvature, -_MAX_SHIFT_SPACINGS), _MAX_SHIFT_SPACINGS)


def _fit_parabola(behind: float, middle: float, ahead: float) -> _Parabola:
    """Fit a parabola to the costs of a node and of its two neighbors along an axis."""
    slope = 0.5 * (ahead - behind)
    curvature = ahead + behind - 2.0 * middle
    return _Parabola(slope, curvature)
