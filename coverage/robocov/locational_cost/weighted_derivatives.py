"""Gradient and Hessian of the locational cost for any density, by quadrature.

A cell is divided into the triangles between the point p and the edges. A point of a triangle is q = p + u
(e(t) - p), where e(t), with t from 0 to 1, runs along the edge, and u is 0 at p and 1 on the edge. In these
coordinates, the distance and the direction from p are smooth functions, so that Gaussian quadrature converges
quickly if φ is smooth. If φ jumps within a cell, the error is of the order of the distance between the nodes.
"""

from typing import NamedTuple

import numpy as np

from robocov.density import Density
from robocov.locational_cost.performance import Distance, Performance, Sensing
from robocov.observation import Cells
from robocov.typing import BoolArray, FloatArray, IntArray

_NODES_ALONG = 16
"""Number of nodes along an edge."""
_NODES_OUTWARD = 12
"""Number of nodes from the point to an edge."""
_MIN_SQUARED_DISTANCE = 1e-300
"""Minimum divisor, m²; prevents division by zero."""
_MIN_RELATIVE_SIZE = 1e-3
"""Minimum diameter of a cell in heights of the sensor. In smaller cells, f is nearly constant, so
that the choice of the nodes does not matter."""


class WeightedDerivatives(NamedTuple):
    """Derivatives of the costs of n cells with respect to the points, if the costs are to be minimized.

    Attributes
    ----------
    x, y : (n,) array
        Components of the gradients.
    xx, xy, yy : (n,) array
        Entries of the Hessians.
    """

    x: FloatArray
    y: FloatArray
    xx: FloatArray
    xy: FloatArray
    yy: FloatArray


class _Nodes(NamedTuple):
    """The nodes of the quadrature in the triangles between e edges and the points of their cells."""

    offsets: FloatArray
    """(e, 16, 12, 2) Offset of each node from the point, by node along the edge and by node outward, m."""
    weights: FloatArray
    """(e, 16, 12) Weight of each node, m²."""


def compute_weighted_derivatives(
    cells: Cells,
    density: Density,
    f: Performance,
    max_diameters: FloatArray,
    points: FloatArray,
    is_needed: BoolArray,
) -> WeightedDerivatives:
    """Compute the gradients and Hessians of weighted locational costs with respect to the points.

    Parameters
    ----------
    cells : Cells
        n cells.
    density : Density
        The density φ.
    f : Performance
        The function f of the distance. With `Sensing`, the objective is to be maximized; the derivatives are
        then those of the negative objective.
    max_diameters : (n,) array, m
        Upper bound on the diameter of each cell.
    points : (n, 2) array, m
        Point of each cell, relative to the generator.
    is_needed : (n,) bool array
        Whether the derivatives of each cell are computed.

    Returns
    -------
    WeightedDerivatives
        Zero for cells whose derivatives are not needed.
    """
    edges = cells.edges
    selected = np.flatnonzero(is_needed[edges.cells])
    edge_cells = edges.cells[selected]
    starts = edges.starts[selected] - points[edge_cells]
    ends = edges.ends[selected] - points[edge_cells]
    u_nodes, u_weights = _build_outward_rule(f, max_diameters)
    offsets, node_weights = _place_nodes(starts, ends, u_nodes[edge_cells], u_weights[edge_cells])
    positions = offsets + (cells.generators + points)[edge_cells][:, None, None]
    weights = node_weights * density.evaluate(positions.reshape(-1, 2)).reshape(node_weights.shape)
    dx = offsets[..., 0]
    dy = offsets[..., 1]
    # The cost to be minimized has f = r², r or -1/(r²+h²), where r² = dx² + dy². With c1 = f'(r)/r and
    # c2 = (f'(r)/r)'/r, the gradient of f with respect to the point is -c1 (dx, dy), and its Hessian is
    # c1 I + c2 (dx, dy)ᵀ (dx, dy). Both are multiplied by the weight of the node.
    squared_distances = dx * dx + dy * dy
    if isinstance(f, Sensing):
        values = 1.0 / (squared_distances + f.height**2)
        c1 = 2.0 * weights * values * values
        c2 = -8.0 * weights * values * values * values
    elif isinstance(f, Distance):
        inverse_distances = 1.0 / np.sqrt(np.maximum(squared_distances, _MIN_SQUARED_DISTANCE))
        c1 = weights * inverse_distances
        c2 = -weights * inverse_distances * inverse_distances * inverse_distances
    else:
        c1 = 2.0 * weights
        c2 = np.zeros_like(weights)
    cell_count = len(points)
    return WeightedDerivatives(
        x=_sum_by_cell(-c1 * dx, edge_cells, cell_count),
        y=_sum_by_cell(-c1 * dy, edge_cells, cell_count),
        xx=_sum_by_cell(c1 + c2 * dx * dx, edge_cells, cell_count),
        xy=_sum_by_cell(c2 * dx * dy, edge_cells, cell_count),
        yy=_sum_by_cell(c1 + c2 * dy * dy, edge_cells, cell_count),
    )


def _place_nodes(starts: FloatArray, ends: FloatArray, u_nodes: FloatArray, u_weights: FloatArray) -> _Nodes:
    """Return the nodes in the triangles between edges and the points of their cells.

    The edges lead from `starts` to `ends`, (e, 2) m relative to the points. A node is on the segment from
    the point to the point of the edge at the fraction t, at the fraction u of this segment. The nodes and the
    weights of u are (e, 12) each.
    """
    t_nodes, t_weights = _build_gauss_rule(_NODES_ALONG)
    on_edges = starts[:, None] + (ends - starts)[:, None] * t_nodes[:, None]
    offsets = on_edges[:, :, None, :] * u_nodes[:, None, :, None]
    # The area element is twice the area of the triangle times u du dt. The weights of u include the factor u.
    doubled_areas = starts[:, 0] * ends[:, 1] - ends[:, 0] * starts[:, 1]
    weights = doubled_areas[:, None, None] * t_weights[:, None] * u_weights[:, None, :]
    return _Nodes(offsets, weights)


def _build_gauss_rule(node_count: int) -> tuple[FloatArray, FloatArray]:
    """Return the nodes and weights of the Gauss-Legendre rule on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(node_count)
    return 0.5 * (nodes + 1.0), 0.5 * weights


def _build_outward_rule(f: Performance, max_diameters: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the nodes u from the point of each cell to its edges, and their weights, (n, 12) each.

    The weights include the factor u of the area element. For `Sensing`, the rule is a Gauss rule in x, where
    u = sinh(a x) / sinh(a). The larger a cell is compared with the height of the sensor, the closer the nodes
    are to the point, because f is then steep there.
    """
    plain_nodes, plain_weights = _build_gauss_rule(_NODES_OUTWARD)
    nodes = np.tile(plain_nodes, (len(max_diameters), 1))
    weights = np.tile(plain_weights, (len(max_diameters), 1))
    if isinstance(f, Sensing):
        a = np.arcsinh(np.maximum(max_diameters / f.height, _MIN_RELATIVE_SIZE))[:, None]
        weights = weights * a * np.cosh(a * nodes) / np.sinh(a)
        nodes = np.sinh(a * nodes) / np.sinh(a)
    return nodes, nodes * weights


def _sum_by_cell(integrand: FloatArray, edge_cells: IntArray, cell_count: int) -> FloatArray:
    """Return the sum of an integrand, (e, 16, 12), over the nodes of each cell, (n,)."""
    return np.asarray(np.bincount(edge_cells, integrand.sum(axis=(1, 2)), cell_count))
