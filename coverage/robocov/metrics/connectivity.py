"""Connectivity of the communication graph of a team."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from robocov.observation.neighbors import Neighbors
from robocov.typing import FloatArray

_EIGENVALUE_DECIMALS = 12
"""Decimal places to which eigenvalues are rounded. Smaller differences are rounding errors."""


class Connectivity(NamedTuple):
    """Connectivity of a graph."""

    components: int
    """Number of connected components."""
    algebraic_connectivity: float
    """Second smallest eigenvalue of the graph's Laplacian. It is 0 if the graph has several components."""


def measure_connectivity(positions: FloatArray, ranges: FloatArray) -> Connectivity:
    """Measure the connectivity of the communication graph.

    Two robots are linked if each is within the communication range of the other.

    Parameters
    ----------
    positions : (n, 2) array, m
        Positions of the robots.
    ranges : (n,) array, m
        Communication ranges of the robots.

    Returns
    -------
    Connectivity
        Number of components and algebraic connectivity.

    Notes
    -----
    If all pairs of n robots are linked, the algebraic connectivity is n. For a single robot, it is 0. Source:
    M. Fiedler, *Algebraic connectivity of graphs*, Czechoslovak Mathematical Journal 23 (1973).

    Examples
    --------
    >>> measure_connectivity(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), np.full(3, 1.0))
    Connectivity(components=1, algebraic_connectivity=1.0)
    """
    n = len(positions)
    if n == 0:
        return Connectivity(0, 0.0)
    neighbors = Neighbors.from_ranges(positions, ranges)
    if neighbors.is_complete:
        return Connectivity(1, float(n) if n > 1 else 0.0)
    robots, linked_robots = neighbors.list_pairs()
    adjacency = coo_array((np.ones(len(robots)), (robots, linked_robots)), (n, n))
    component_count, _ = connected_components(adjacency, directed=False)
    if n == 1 or component_count > 1:
        return Connectivity(int(component_count), 0.0)
    # The Laplacian has the degree of each robot on its diagonal, and -1 for each pair of linked robots.
    laplacian = np.diag(np.bincount(robots).astype(float))
    laplacian[robots, linked_robots] = -1.0
    second_eigenvalue = float(np.linalg.eigvalsh(laplacian)[1])
    return Connectivity(int(component_count), round(second_eigenvalue, _EIGENVALUE_DECIMALS))
