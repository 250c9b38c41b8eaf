"""The graph of the nodes of a map window, and the shortest distances and paths in it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from robocov.planning.lattice import Edges, LatticeCells, build_edges, compute_distances
from robocov.planning.map_window import MapWindow
from robocov.planning.portals import Portals, add_portals, find_portals
from robocov.typing import FloatArray, IntArray


@dataclass(eq=False)
class LatticeGraph:
    """The edges between the m nodes of a map window, and the shortest distances along them.

    Nodes are given by their indices, from 0 to m - 1. The graph is built when it is used for the first time.
    Distances from single nodes are stored, because several robots need them several times.

    Parameters
    ----------
    map_window : MapWindow
    """

    map_window: MapWindow
    _distances_by_node: dict[int, FloatArray] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def straight_edges(self) -> Edges:
        """Straight edges between neighboring nodes; those through unknown cells are longer."""
        map_window = self.map_window
        return build_edges(
            cells=LatticeCells(
                is_near_wall=map_window.is_near_wall,
                is_blocked=map_window.is_blocked,
                is_unknown=map_window.is_unknown,
                has_clearance=map_window.has_clearance,
            ),
            rows=map_window.window.rows,
            columns=map_window.window.columns,
            stride=map_window.window.stride,
            spacing=map_window.spacing,
        )

    @cached_property
    def portals(self) -> Portals:
        """Paths through passages that the straight edges miss."""
        map_window = self.map_window
        return find_portals(
            is_passable=map_window.is_free & ~map_window.is_near_wall,
            node_cells=map_window.window.compute_node_cells(),
            graph=build_matrix(self.straight_edges),
        )

    @cached_property
    def portal_cells(self) -> dict[tuple[int, int], IntArray]:
        """Cells along each portal in both directions, (k, 2) rows and columns, by its first and last node."""
        cells = {}
        for first, last, path in zip(
            self.portals.first_nodes.tolist(),
            self.portals.last_nodes.tolist(),
            self.portals.paths,
            strict=True,
        ):
            cells[first, last] = path
            cells[last, first] = path[::-1]
        return cells

    @cached_property
    def edges(self) -> Edges:
        """All edges between nodes: the straight ones, and the portals."""
        if not len(self.portals.paths):
            return self.straight_edges
        return add_portals(self.straight_edges, self.portals, self.map_window.known_map.raster.cell_size)

    @cached_property
    def matrix(self) -> csr_array:
        """The lengths of all edges as a sparse matrix, (m, m), in m."""
        return build_matrix(self.edges)

    def compute_nearest_distances(
        self, sources: ArrayLike, offsets: ArrayLike, limit: float = math.inf
    ) -> FloatArray:
        """Compute the distance from each node to the nearest of several sources.

        Parameters
        ----------
        sources : (k,) int array_like
            Nodes at which paths start.
        offsets : (k,) array_like, m
            Length that is added to the paths from each source.
        limit : float, m
            The distances of nodes farther away may be infinite. A lower limit takes less time.

        Returns
        -------
        (m,) array, m
            Infinite for nodes that no path leads to.
        """
        return compute_distances(
            self.edges,
            self.map_window.spacing,
            np.asarray(sources, dtype=np.intp),
            np.asarray(offsets, dtype=np.float64),
            limit,
        )

    def get_distances(self, node: int) -> FloatArray:
        """Return the distances from a node to all nodes.

        Parameters
        ----------
        node : int

        Returns
        -------
        (m,) array, m
            Infinite for nodes that no path leads to.
        """
        if node not in self._distances_by_node:
            self._distances_by_node[node] = self.compute_nearest_distances([node], [0.0])
        return self._distances_by_node[node]

    def compute_distance_table(self, nodes: Sequence[int] | IntArray, limit: float = math.inf) -> FloatArray:
        """Compute the distances from each of the given nodes to all nodes.

        Distances that `get_distances` has stored are reused, but no further ones are stored.

        Parameters
        ----------
        nodes : (k,) sequence of int
        limit : float, m
            The distances of nodes farther away may be infinite. A lower limit takes less time.

        Returns
        -------
        (k, m) array, m
            Infinite for nodes that no path leads to.
        """
        table = np.empty((len(nodes), len(self.map_window.nodes)))
        for row, node in enumerate(nodes):
            stored = self._distances_by_node.get(int(node))
            table[row] = self.compute_nearest_distances([node], [0.0], limit) if stored is None else stored
        return table

    def find_shortest_paths(self, node: int) -> tuple[FloatArray, IntArray]:
        """Find the shortest paths from a node to all nodes.

        This takes longer than `get_distances`, which does not find the paths.

        Parameters
        ----------
        node : int

        Returns
        -------
        distances : (m,) array, m
            Infinite for nodes that no path leads to.
        predecessors : (m,) int array
            The node before each node on its path; negative for the first node, and if there is no path.
        """
        distances, predecessors = dijkstra(self.matrix, indices=[node], return_predecessors=True)
        return distances[0], predecessors[0]


def build_matrix(edges: Edges) -> csr_array:
    """Build the sparse matrix of the lengths of edges.

    Parameters
    ----------
    edges : Edges

    Returns
    -------
    (m, m) csr_array, m
    """
    node_count = len(edges.edge_starts) - 1
    return csr_array((edges.lengths, edges.ends, edges.edge_starts), shape=(node_count, node_count))
