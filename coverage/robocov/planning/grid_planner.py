"""Distances and routes around known walls, on the lattice of a window of a discovered map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count, pairwise
from typing import NamedTuple
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from robocov.arrays import Array, BoolArray, IntArray, compute_point_distances
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.lattice import (
    Edges,
    Frame,
    LatticeCells,
    build_edges,
    compute_distances,
    find_clear_lines,
    find_nearest_nodes,
)
from robocov.planning.map_window import MapWindow
from robocov.planning.portals import Portals, add_portals, find_portals
from robocov.planning.window import Window

_MAX_ROUTE_ENDS = 12
"""Maximum number of nodes that are tried as the first node of a route, and as the last."""
_MAX_CANDIDATES = 180
"""Maximum number of nodes that `choose_regular_nodes` returns in a small window."""
_NODES_PER_CANDIDATE = 9
"""Minimum number of nodes for each node that `choose_regular_nodes` returns in a large window."""
_MAX_CANDIDATE_DISTANCE_STEPS = 1.5
"""Maximum distance of a usable node from the nearest candidate, in steps between regular nodes."""
_MAX_CACHED_POSITIONS = 1000
"""Maximum number of positions whose visible nodes are cached."""
NO_NODE = -1
"""Index that stands for no node."""


class TeamCandidates(NamedTuple):
    """Nodes that may become goals of a team."""

    nodes: IntArray
    """(c,) Indices of the nodes."""
    distances: Array
    """(c, m) m, distances from these nodes to all nodes."""


@dataclass(eq=False)
class GridPlanner(MapWindow):
    """Distances and routes around known walls, in a window of a discovered map.

    A planner stores results that are needed several times, and robots that share a map share the planner.
    Nodes are given by their indices, from 0 to m - 1. For nodes *with clearance* and cells *near a wall*, see
    `MapWindow`.

    Parameters
    ----------
    known_map : DiscoveredMap
    window : Window
    clearance : float, m
        Distance that routes keep from walls, except for the last step to a node.
    """

    _distances_of_node: dict[int, Array] = field(default_factory=dict, init=False, repr=False)
    _visible_nodes: dict[bytes, IntArray] = field(default_factory=dict, init=False, repr=False)
    _team_candidates: dict[int, TeamCandidates] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def get_shared(cls, known_map: DiscoveredMap, window: Window, clearance: float) -> GridPlanner:
        """Return the planner that is already in use for a map and window, or build it.

        Parameters
        ----------
        known_map : DiscoveredMap
        window : Window
        clearance : float, m
            See `GridPlanner`.

        Returns
        -------
        GridPlanner
        """
        # A planner in use keeps its map alive, so no other map can have the same id.
        key = id(known_map), window, clearance
        planner = _PLANNERS_IN_USE.get(key)
        if planner is None:
            planner = cls(known_map, window, clearance)
            _PLANNERS_IN_USE[key] = planner
        return planner

    def update(self, known_map: DiscoveredMap, window: Window) -> GridPlanner:
        """Return the planner for a later map and window.

        Parameters
        ----------
        known_map : DiscoveredMap
        window : Window

        Returns
        -------
        GridPlanner
            This planner itself if its cells have not changed.
        """
        later = GridPlanner.get_shared(known_map, window, self.clearance)
        if (
            self.window == window
            and np.array_equal(self.is_blocked, later.is_blocked)
            and np.array_equal(self.is_unknown, later.is_unknown)
        ):
            return self
        return later

    @cached_property
    def _moves(self) -> Edges:
        """Straight edges between neighboring nodes; those through unknown cells are longer."""
        return build_edges(
            cells=LatticeCells(self.is_near_wall, self.is_blocked, self.is_unknown, self.has_clearance),
            rows=self.window.rows,
            columns=self.window.columns,
            stride=self.window.stride,
            spacing=self.spacing,
        )

    @cached_property
    def _portals(self) -> Portals:
        """Paths through passages that the straight edges miss."""
        return find_portals(
            is_passable=self.is_free & ~self.is_near_wall,
            node_cells=self.window.compute_node_cells(),
            graph=_build_graph(self._moves),
        )

    @cached_property
    def _edges(self) -> Edges:
        """All edges between nodes: the straight ones, and the portals."""
        if not len(self._portals.paths):
            return self._moves
        return add_portals(self._moves, self._portals, self.known_map.raster.cell_size)

    @cached_property
    def _graph(self) -> csr_array:
        """The edges as a sparse matrix."""
        return _build_graph(self._edges)

    @cached_property
    def _frame(self) -> Frame:
        """Position of the window's cells. The last row and column do not exceed those of the raster."""
        rows, columns = self.known_map.raster.shape
        height, width = self.window.shape
        low_x, low_y = self.known_map.raster.origin
        return Frame(
            low_x=low_x,
            low_y=low_y,
            cell_size=self.known_map.raster.cell_size,
            first_row=self.window.first_row,
            first_column=self.window.first_column,
            last_row=min(self.window.first_row + height, rows) - 1,
            last_column=min(self.window.first_column + width, columns) - 1,
        )

    def choose_regular_nodes(self, is_usable: BoolArray) -> tuple[IntArray, int]:
        """Choose the usable nodes in every k-th row and column of the lattice.

        Parameters
        ----------
        is_usable : (m,) bool array
            Whether each node may be chosen.

        Returns
        -------
        nodes : (c,) int array
        k : int
            The smallest step without too many nodes; see `_MAX_CANDIDATES` and `_NODES_PER_CANDIDATE`.
        """
        max_candidates = max(_MAX_CANDIDATES, len(self.nodes) // _NODES_PER_CANDIDATE)
        rows, columns = np.divmod(np.arange(len(self.nodes)), self.window.columns)
        for k in count(1):
            # One node in the middle of each block of k rows and k columns.
            is_middle = (rows % k == k // 2) & (columns % k == k // 2)
            nodes = np.flatnonzero(is_usable & is_middle)
            if len(nodes) <= max_candidates:
                break
        return nodes, k

    def choose_candidates(self, is_usable: BoolArray) -> IntArray:
        """Choose the nodes that may become goals of a team, spread over the usable nodes.

        Parameters
        ----------
        is_usable : (m,) bool array
            Whether each node may become a goal. All of these nodes have clearance.

        Returns
        -------
        (c,) int array
            The nodes from `choose_regular_nodes`, whose rows and columns may miss narrow passages, and as
            many further nodes as are needed so that no usable node is far from all candidates.
        """
        candidates, step = self.choose_regular_nodes(is_usable)
        max_distance = _MAX_CANDIDATE_DISTANCE_STEPS * step * self.spacing
        distances = self._search(candidates, np.zeros(len(candidates)))
        while True:
            farthest = int(np.where(is_usable, distances, 0.0).argmax())
            if not (is_usable[farthest] and distances[farthest] > max_distance):
                return candidates
            candidates = np.append(candidates, farthest)
            distances = np.minimum(distances, self.get_distances(farthest))

    def get_team_candidates(self, node: int) -> TeamCandidates:
        """Return the nodes that may become goals of a team whose robots can reach a node.

        Parameters
        ----------
        node : int
            A node with clearance.

        Returns
        -------
        TeamCandidates
        """
        is_usable = np.isfinite(self.get_distances(node)) & self.has_clearance
        # Connected nodes with clearance have the same usable nodes, and different components have none in
        # common. The first usable node therefore identifies the component.
        first_node = int(is_usable.argmax())
        if first_node not in self._team_candidates:
            nodes = self.choose_candidates(is_usable)
            self._team_candidates[first_node] = TeamCandidates(nodes, self.compute_distance_table(nodes))
        return self._team_candidates[first_node]

    def get_distances(self, node: int) -> Array:
        """Return the distances from a node to all nodes.

        Parameters
        ----------
        node : int

        Returns
        -------
        (m,) array, m
            Infinite for nodes that no path leads to.
        """
        if node not in self._distances_of_node:
            self._distances_of_node[node] = self.compute_distance_table(np.array([node]))[0]
        return self._distances_of_node[node]

    def compute_distances_within(self, nodes: Sequence[int], limit: float) -> list[Array]:
        """Compute the distances from each of the given nodes to all nodes within a limit.

        Parameters
        ----------
        nodes : sequence of int
        limit : float, m
            The distances of nodes farther away may be infinite. A lower limit takes less time.

        Returns
        -------
        list of (m,) arrays, m
        """
        distances_by_node = []
        for node in nodes:
            distances = self._distances_of_node.get(node)
            if distances is None:
                distances = self._search([node], [0.0], limit)
            distances_by_node.append(distances)
        return distances_by_node

    def compute_distance_table(self, nodes: IntArray) -> Array:
        """Compute the distances from each of the given nodes to all nodes.

        Parameters
        ----------
        nodes : (k,) int array

        Returns
        -------
        (k, m) array, m
        """
        table = np.array([self._search([node], [0.0]) for node in nodes.tolist()])
        return table.reshape(-1, len(self.nodes))

    def compute_distances_from(self, positions: Array) -> Array:
        """Compute the distance from each node to the nearest of the given positions.

        Parameters
        ----------
        positions : (k, 2) array, m

        Returns
        -------
        (m,) array, m
        """
        first_nodes = [np.empty(0, dtype=np.intp)]
        lengths = [np.empty(0)]
        for position in positions:
            visible = self._find_visible_nodes(position)
            first_nodes.append(visible)
            lengths.append(compute_point_distances(self.nodes[visible], position))
        return self._search(np.concatenate(first_nodes), np.concatenate(lengths))

    def look_up_distances(self, position: Array, table: Array) -> Array:
        """Return the distances from a position to given nodes, based on a table of distances between nodes.

        This takes less time than a search from the position.

        Parameters
        ----------
        position : (2,) array, m
        table : (k, m) array, m
            Distances from the given nodes to all nodes; see `compute_distance_table`. The given nodes have
            clearance.

        Returns
        -------
        (k,) array, m
            Infinite for nodes that cannot be reached.
        """
        visible = self._find_visible_nodes(position)
        offsets = compute_point_distances(self.nodes[visible], position)
        return np.asarray((table[:, visible] + offsets).min(axis=1, initial=np.inf))

    def _search(self, nodes: ArrayLike, offsets: ArrayLike, limit: float = math.inf) -> Array:
        """Compute the distance from each node to the nearest of `nodes`, at which paths have offsets, m."""
        return compute_distances(
            self._edges,
            self.spacing,
            np.asarray(nodes, dtype=np.intp),
            np.asarray(offsets, dtype=np.float64),
            limit,
        )

    def find_nearest_node(self, position: Array) -> int:
        """Find the nearest node with clearance.

        Parameters
        ----------
        position : (2,) array, m

        Returns
        -------
        int
            `NO_NODE` if no node has clearance.
        """
        if not self.has_clearance.any():
            return NO_NODE
        squared_distances = ((self.nodes - position) ** 2).sum(axis=1)
        return int(np.where(self.has_clearance, squared_distances, np.inf).argmin())

    def find_visible_node(self, position: Array) -> int:
        """Find the nearest node with clearance that is in sight of a position.

        Parameters
        ----------
        position : (2,) array, m

        Returns
        -------
        int
            If no node is in sight, the nearest one with clearance. `NO_NODE` if no node has clearance.
        """
        visible = self._find_visible_nodes(position)
        return int(visible[0]) if len(visible) else NO_NODE

    def _find_visible_nodes(self, position: Array) -> IntArray:
        """Return the nodes with clearance that are close to a position and in sight, the nearest first.

        If none is in sight, return only the nearest one with clearance.
        """
        key = position.tobytes()
        if key not in self._visible_nodes:
            if len(self._visible_nodes) >= _MAX_CACHED_POSITIONS:
                self._visible_nodes.clear()
            close_nodes = self._find_close_nodes(position, self.has_clearance)
            is_visible = self.find_clear_lines(position, self.nodes[close_nodes], self.is_blocked)
            # A robot in a cell that counts as wall is actually next to the wall, and sees no node.
            self._visible_nodes[key] = close_nodes[is_visible] if is_visible.any() else close_nodes[:1]
        return self._visible_nodes[key]

    def _find_close_nodes(self, position: Array, is_candidate: BoolArray) -> IntArray:
        """Return the candidates closest to a position, up to `_MAX_ROUTE_ENDS`, the nearest first."""
        return find_nearest_nodes(position, self.nodes, is_candidate, _MAX_ROUTE_ENDS)

    def find_clear_lines(
        self, position: Array, ends: Array, is_obstructing: BoolArray, ignored_length: float = 0.0
    ) -> BoolArray:
        """Find the straight lines from a position that cross no obstructing cell.

        Parameters
        ----------
        position : (2,) array, m
        ends : (k, 2) array, m
        is_obstructing : (h, w) bool array
            For example `is_blocked` or `is_near_wall`.
        ignored_length : float, m
            Cells closer to the position do not obstruct a line. Routes start at the position of a robot,
            which may itself be too close to a wall.

        Returns
        -------
        (k,) bool array
            Whether each line is clear.
        """
        return find_clear_lines(position, ends, is_obstructing, self._frame, ignored_length)

    def find_route(self, position: Array, goal: Array) -> Array:
        """Find the shortest route from a position to a goal.

        Parameters
        ----------
        position, goal : (2,) arrays, m

        Returns
        -------
        (w, 2) array, m
            Waypoints, each in sight of the one before. The last one is the goal. If that cannot be reached,
            it is the reachable node closest to the goal, or the position itself if no node can be reached.
            Between waypoints, the route crosses no cell near a wall. If the position itself is near a wall,
            the route leaves it in a straight line.
        """
        is_direct = self.find_clear_lines(position, goal[None], self.is_near_wall, self.clearance)[0]
        if is_direct:
            return np.array(goal[None])
        first = self._find_first_node(position)
        if first == NO_NODE:
            return np.array(position[None])
        distance, predecessor = self._find_shortest_paths(first)
        close_nodes = self._find_close_nodes(goal, np.isfinite(distance) & self.has_clearance)
        if not len(close_nodes):
            return np.array(position[None])
        # The robot may be too close to a wall where its route starts, but not where it ends. Therefore no
        # cells around the goal are ignored.
        is_visible = self.find_clear_lines(goal, self.nodes[close_nodes], self.is_near_wall)
        # The last node is the nearest one in sight of the goal, or simply the nearest one if none is in sight
        # (`argmax` returns the first True, or 0 if there is none).
        last = int(close_nodes[is_visible.argmax()])
        path = [last]
        while path[-1] != first:
            path.append(int(predecessor[path[-1]]))
        path.reverse()
        points = self._expand_portals(path)
        if is_visible.any():
            points = np.vstack([points, goal])
        return self._remove_detours(position, points)

    def _expand_portals(self, path: Sequence[int]) -> Array:
        """Return the positions along a path of nodes, (k, 2) m, with those of the cells in its portals."""
        raster = self.known_map.raster
        origin = np.array([self.window.first_row, self.window.first_column])
        positions = [self.nodes[path[:1]]]
        for node, next_node in pairwise(path):
            cells = self._portal_cells.get((node, next_node))
            if cells is not None:
                positions.append(raster.compute_centers(*(cells + origin).T))
            positions.append(self.nodes[[next_node]])
        return np.concatenate(positions)

    @cached_property
    def _portal_cells(self) -> dict[tuple[int, int], IntArray]:
        """The cells of the portal from one node to another, by the two nodes."""
        cells = {}
        portals = self._portals
        for first, last, path in zip(
            portals.first_nodes.tolist(), portals.last_nodes.tolist(), portals.paths, strict=True
        ):
            cells[first, last] = path
            cells[last, first] = path[::-1]
        return cells

    def _find_shortest_paths(self, node: int) -> tuple[Array, IntArray]:
        """Return the distances from a node to all nodes, m, and the node before each on the shortest path."""
        distances, predecessors = dijkstra(self._graph, indices=[node], return_predecessors=True)
        return distances[0], predecessors[0]

    def _find_first_node(self, position: Array) -> int:
        """Return the first node of a route: a node with clearance, close to a position and in sight.

        If possible, the line to the node crosses no cell near a wall, except for those around the position:
        the robot may itself be too close to a wall. `NO_NODE` if no such node is in sight.
        """
        close_nodes = self._find_close_nodes(position, self.has_clearance)
        ends = self.nodes[close_nodes]
        is_visible = self.find_clear_lines(position, ends, self.is_near_wall, 2.0 * self.clearance)
        if not is_visible.any():
            is_visible = self.find_clear_lines(position, ends, self.is_blocked)
        return int(close_nodes[is_visible.argmax()]) if is_visible.any() else NO_NODE

    def _remove_detours(self, position: Array, points: Array) -> Array:
        """Return the points of a route without those that can be skipped, because later ones are in sight.

        A point is in sight if the line to it crosses no cell near a wall. On the first line, cells around the
        position do not count, because the robot may itself be too close to a wall.
        """
        remaining: list[Array] = []
        current = position
        k = 0
        while k < len(points):
            ignored_length = 0.0 if remaining else self.clearance
            is_visible = self.find_clear_lines(current, points[k:], self.is_near_wall, ignored_length)
            if is_visible.any():
                # Skip the points before the last one in sight.
                k += int(is_visible.nonzero()[0][-1])
            current = points[k]
            remaining.append(current)
            k += 1
        return np.array(remaining)


def _build_graph(edges: Edges) -> csr_array:
    """Return edges as a sparse matrix."""
    node_count = len(edges.first_edge) - 1
    return csr_array((edges.lengths, edges.ends, edges.first_edge), shape=(node_count, node_count))


_PLANNERS_IN_USE: WeakValueDictionary[tuple[int, Window, float], GridPlanner] = WeakValueDictionary()
"""The planners in use, by the id of the map, the window and the clearance."""
