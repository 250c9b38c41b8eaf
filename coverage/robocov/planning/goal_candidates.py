"""The choice of nodes that may become goals, spread over a map window."""

from __future__ import annotations

from itertools import count
from typing import NamedTuple

import numpy as np

from robocov.planning.lattice_graph import LatticeGraph
from robocov.planning.window import Window
from robocov.typing import BoolArray, FloatArray, IntArray

_MAX_CANDIDATES = 180
"""Maximum number of nodes that `_choose_regular_nodes` returns in a small window."""
_NODES_PER_CANDIDATE = 9
"""Minimum number of nodes for each node that `_choose_regular_nodes` returns in a large window."""
_MAX_CANDIDATE_DISTANCE_STEPS = 1.5
"""Maximum distance of a usable node from the nearest candidate, in steps between regular nodes."""


class TeamCandidates(NamedTuple):
    """Nodes that may become goals of a team."""

    nodes: IntArray
    """(c,) Indices of the nodes."""
    distances: FloatArray
    """(c, m) m, distances from these nodes to all nodes."""


def _choose_regular_nodes(window: Window, is_usable: BoolArray) -> tuple[IntArray, int]:
    """Choose the usable nodes in every k-th row and column of the nodes of a window.

    Parameters
    ----------
    window : Window
    is_usable : (m,) bool array
        Whether each node may be chosen.

    Returns
    -------
    nodes : (c,) int array
    k : int
        The smallest step without too many nodes; see `_MAX_CANDIDATES` and `_NODES_PER_CANDIDATE`.
    """
    node_count = len(is_usable)
    max_candidates = max(_MAX_CANDIDATES, node_count // _NODES_PER_CANDIDATE)
    rows, columns = np.divmod(np.arange(node_count), window.columns)
    for k in count(1):
        # One node in the middle of each block of k rows and k columns.
        is_middle = (rows % k == k // 2) & (columns % k == k // 2)
        nodes = np.flatnonzero(is_usable & is_middle)
        if len(nodes) <= max_candidates:
            break
    return nodes, k


def choose_candidates(graph: LatticeGraph, is_usable: BoolArray) -> IntArray:
    """Choose the nodes that may become goals of a team, spread over the usable nodes.

    Parameters
    ----------
    graph : LatticeGraph
    is_usable : (m,) bool array
        Whether each node may become a goal. All of these nodes have clearance.

    Returns
    -------
    (c,) int array
        The nodes from `_choose_regular_nodes`, whose rows and columns may miss narrow passages, and as
        many further nodes as are needed so that no usable node is far from all candidates.
    """
    candidates, step = _choose_regular_nodes(graph.map_window.window, is_usable)
    max_distance = _MAX_CANDIDATE_DISTANCE_STEPS * step * graph.map_window.spacing
    distances = graph.compute_nearest_distances(candidates, np.zeros(len(candidates)))
    while True:
        farthest = int(np.where(is_usable, distances, 0.0).argmax())
        if not (is_usable[farthest] and distances[farthest] > max_distance):
            return candidates
        candidates = np.append(candidates, farthest)
        distances = np.minimum(distances, graph.get_distances(farthest))
