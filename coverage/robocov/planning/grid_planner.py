"""Distances, routes and candidates for goals around known walls, in a window of a discovered map."""

from __future__ import annotations

from dataclasses import dataclass, field
from weakref import WeakValueDictionary

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.goal_candidates import TeamCandidates, choose_candidates
from robocov.planning.lattice_graph import LatticeGraph
from robocov.planning.map_window import MapWindow
from robocov.planning.node_visibility import NodeVisibility
from robocov.planning.routes import find_route
from robocov.planning.window import Window
from robocov.typing import FloatArray


@dataclass(eq=False)
class GridPlanner:
    """Distances, routes and candidates for goals around known walls, in a window of a discovered map.

    A planner stores results that are needed several times, and robots that share a map share the planner.

    Parameters
    ----------
    known_map : DiscoveredMap
    window : Window
    clearance : float, m
        Distance that routes keep from walls, except for the last step to a node.

    Attributes
    ----------
    map_window : MapWindow
        The cells of the map in the window, and the m nodes.
    graph : LatticeGraph
        The edges between the nodes, and the distances along them.
    visibility : NodeVisibility
        The nodes at which paths from a position enter the lattice, and lines of sight.
    """

    known_map: DiscoveredMap
    window: Window
    clearance: float
    map_window: MapWindow = field(init=False, repr=False)
    graph: LatticeGraph = field(init=False, repr=False)
    visibility: NodeVisibility = field(init=False, repr=False)
    _team_candidates: dict[int, TeamCandidates] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self) -> None:
        self.map_window = MapWindow(self.known_map, self.window, self.clearance)
        self.graph = LatticeGraph(self.map_window)
        self.visibility = NodeVisibility(self.map_window)

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
            and np.array_equal(self.map_window.is_blocked, later.map_window.is_blocked)
            and np.array_equal(self.map_window.is_unknown, later.map_window.is_unknown)
        ):
            return self
        return later

    def compute_distances_from(self, positions: FloatArray) -> FloatArray:
        """Compute the distance from each node to the nearest of the given positions.

        Parameters
        ----------
        positions : (k, 2) array, m

        Returns
        -------
        (m,) array, m
        """
        sources = [np.empty(0, dtype=np.intp)]
        offsets = [np.empty(0)]
        for position in positions:
            entry_nodes = self.visibility.get_entry_nodes(position)
            sources.append(entry_nodes)
            offsets.append(compute_point_distances(self.map_window.nodes[entry_nodes], position))
        return self.graph.compute_nearest_distances(np.concatenate(sources), np.concatenate(offsets))

    def look_up_distances(self, position: FloatArray, table: FloatArray) -> FloatArray:
        """Return the distances from a position to given nodes, based on a table of distances between nodes.

        This takes less time than a search from the position.

        Parameters
        ----------
        position : (2,) array, m
        table : (k, m) array, m
            Distances from the given nodes to all nodes; see `LatticeGraph.compute_distance_table`. The given
            nodes have clearance.

        Returns
        -------
        (k,) array, m
            Infinite for nodes that cannot be reached.
        """
        entry_nodes = self.visibility.get_entry_nodes(position)
        offsets = compute_point_distances(self.map_window.nodes[entry_nodes], position)
        return np.asarray((table[:, entry_nodes] + offsets).min(axis=1, initial=np.inf))

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
        is_usable = np.isfinite(self.graph.get_distances(node)) & self.map_window.has_clearance
        # Connected nodes with clearance have the same usable nodes, and different components have none in
        # common. The first usable node therefore identifies the component.
        first_node = int(is_usable.argmax())
        if first_node not in self._team_candidates:
            nodes = choose_candidates(self.graph, is_usable)
            distances = self.graph.compute_distance_table(nodes)
            self._team_candidates[first_node] = TeamCandidates(nodes, distances)
        return self._team_candidates[first_node]

    def find_route(self, position: FloatArray, goal: FloatArray) -> FloatArray:
        """Find the shortest route from a position to a goal.

        Parameters
        ----------
        position, goal : (2,) arrays, m

        Returns
        -------
        (w, 2) array, m
            Waypoints; see `robocov.planning.routes.find_route`.
        """
        return find_route(self.graph, self.visibility, position, goal)


_PLANNERS_IN_USE: WeakValueDictionary[tuple[int, Window, float], GridPlanner] = WeakValueDictionary()
"""The planners in use, by the id of the map, the window and the clearance."""
