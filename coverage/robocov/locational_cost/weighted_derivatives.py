"""Gradient and Hessian of the locational cost for any density, by quadrature.

A cell is divided into the triangles between the point p and the edges. In the coordinates
q = p + u (e(t) - p), where e(t) runs along an edge, distance and direction from p are smooth, so that
Gaussian quadrature converges quickly where φ is smooth. If φ jumps within a cell, the error is of the order
of the distance between the nodes.
"""

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.density import Density
from robocov.locational_cost.performance import Performance, Sensing
from robocov.observation import Cells

_NODES_ALONG = 16
"""Nodes along an edge."""
_NODES_OUTWARD = 12
"""Nodes from the point to an edge."""
_MIN_SQUARED_DISTANCE = 1e-300
"""Smallest squared distance used as a divisor, which prevents division by zero, m²."""
_MIN_RELATIVE_SIZE = 1e-3
"""Size of a cell, relative to the height, below which the nodes are spread evenly: f hardly varies there."""


class WeightedDerivatives(NamedTuple):
    """Derivatives, with respect to the points, of the cost that is to be minimized, (n,) each."""

    x: Array
    y: Array
    xx: Array
    xy: Array
    yy: Array


def compute_weighted_derivatives(
    cells: Cells, density: Density, f: Performance, max_diameter: Array, points: Array, is_needed: BoolArray
) -> WeightedDerivatives:
    """Compute gradients and Hessians of weighted locational costs with respect to the points.

    A cell is divided into the triangles between its point p and its edges. In a triangle, a node of the
    quadrature is p + u (e(t) - p): t is its position along the edge e, and u, from 0 at p to 1 at the edge,
    its position outward.

    Parameters
    ----------
    cells : Cells
        n cells.
    density : Density
    f : Performance
        `Distance`, or `Sensing` with its sign reversed, so that the cost is to be minimized.
    max_diameter : (n,) array, m
        Upper bounds on the diameters of the cells.
    points : (n, 2) array, m
        Relative to the generators.
    is_needed : (n,) bool array
        Cells for which the derivatives are computed.

    Returns
    -------
    WeightedDerivatives
        Zero for the other cells.
    """
    edges = cells.edges
    selected = np.flatnonzero(is_needed[edges.cell])
    cell = edges.cell[selected]
    t_nodes, t_weights = _build_gauss_rule(_NODES_ALONG)
    u_nodes, u_weights = _build_outward_rule(f, max_diameter, cell)
    start = edges.start[selected] - points[cell]
    end = edges.end[selected] - points[cell]
    # Offsets of the nodes from the point, by edge, node along it and node outward: (e, 16, 12, 2).
    on_edge = start[:, None] + (end - start)[:, None] * t_nodes[:, None]
    offset = on_edge[:, :, None, :] * u_nodes[:, None, :, None]
    # The area element is twice the area of the triangle times u du dt; the weights of u include the factor u.
    doubled_area = start[:, 0] * end[:, 1] - end[:, 0] * start[:, 1]
    weight = doubled_area[:, None, None] * t_weights[:, None] * u_weights[:, None, :]
    positions = offset + (cells.generators + points)[cell][:, None, None]
    weight = weight * density.evaluate(positions.reshape(-1, 2)).reshape(weight.shape)
    dx = offset[..., 0]
    dy = offset[..., 1]
    # The cost to be minimized has f = r or f = -1/(r²+h²). Let c1 be the weight times f'(r)/r, where r² = dx²
    # + dy², and c2 the weight times (f'(r)/r)'/r. Then the gradient of the integrand is -c1 (dx, dy), and its
    # Hessian is c1 I + c2 (dx, dy)ᵀ (dx, dy).
    square = dx * dx + dy * dy
    if isinstance(f, Sensing):
        inverse = 1.0 / (square + f.height**2)
        c1 = 2.0 * weight * inverse * inverse
        c2 = -8.0 * weight * inverse * inverse * inverse
    else:
        inverse = 1.0 / np.sqrt(np.maximum(square, _MIN_SQUARED_DISTANCE))
        c1 = weight * inverse
        c2 = -weight * inverse * inverse * inverse
    cell_count = len(points)
    return WeightedDerivatives(
        x=_sum_by_cell(-c1 * dx, cell, cell_count),
        y=_sum_by_cell(-c1 * dy, cell, cell_count),
        xx=_sum_by_cell(c1 + c2 * dx * dx, cell, cell_count),
        xy=_sum_by_cell(c2 * dx * dy, cell, cell_count),
        yy=_sum_by_cell(c1 + c2 * dy * dy, cell, cell_count),
    )


def _build_gauss_rule(count: int) -> tuple[Array, Array]:
    """Return nodes and weights of the Gauss-Legendre rule on [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (nodes + 1.0), 0.5 * weights


def _build_outward_rule(f: Performance, max_diameter: Array, cell: IntArray) -> tuple[Array, Array]:
    """Return nodes u from the point to each edge, and their weights, (e, 12) each.

    The weights include the factor u of the area element. For `Sensing`, the rule is a Gauss rule in x, where
    u = sinh(a x) / sinh(a): the steeper f is near the point, the more nodes lie there.
    """
    plain_nodes, plain_weights = _build_gauss_rule(_NODES_OUTWARD)
    nodes = np.tile(plain_nodes, (len(max_diameter), 1))
    weights = np.tile(plain_weights, (len(max_diameter), 1))
    if isinstance(f, Sensing):
        a = np.arcsinh(np.maximum(max_diameter / f.height, _MIN_RELATIVE_SIZE))[:, None]
        weights = weights * a * np.cosh(a * nodes) / np.sinh(a)
        nodes = np.sinh(a * nodes) / np.sinh(a)
    return nodes[cell], (nodes * weights)[cell]


def _sum_by_cell(integrand: Array, cell: IntArray, cell_count: int) -> Array:
    """Return the sums of an integrand over the nodes of each cell, (n,)."""
    return np.asarray(np.bincount(cell, integrand.sum(axis=(1, 2)), cell_count))
