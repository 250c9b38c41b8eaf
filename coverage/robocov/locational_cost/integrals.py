"""The locational cost (4) of cells, its gradient (11) and its Hessian, for density 1.

All are integrals over the boundary of a cell. By the divergence theorem

    ∂/∂p ∫_V f(|q-p|) dq = -∮_∂V f(|q-p|) n dq ,      n the outward unit normal,

so that an edge adds -n ∫ f(√(s²+d²)) ds: d is the distance from p to the edge's line, and s runs from the
foot of the perpendicular along the edge. For f = 1/(r²+h²) that is Δ/w with w² = d²+h² and Δ the angle
atan(s₂/w) - atan(s₁/w): equations (15)-(20) of the paper, without its special case for vertical edges, and
without the second integral of (18), which is printed with the wrong sign but sums to zero around a cell. The
cost itself is a sum over the triangles that p spans with the edges. p may lie anywhere.

Sums are formed in the order of a cell's edges, so that the results for a cell do not depend on other cells,
to the last bit.
"""

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.density.cell_edges import CellEdges
from robocov.locational_cost.performance import DISTANCE, SQUARED_DISTANCE, Performance

_GAUSS_RULE = np.stack(np.polynomial.legendre.leggauss(16))
"""Nodes and weights on [-1, 1]."""
_PANEL_LENGTH = 2.0
"""Length of a panel of the quadrature in τ, where s = w sinh τ. The integrand is analytic for |Im τ| < π/2,
and 16 nodes per panel leave less than a rounding error."""
_MIN_LENGTH = 1e-12
"""Length of an edge, relative to the size of its cell, up to which it may be a rounding error."""


class CellDerivatives(NamedTuple):
    """Derivatives of the locational cost with respect to the points, and shapes of the cells, (n,) each.

    Attributes
    ----------
    x, y : gradient
    xx, xy, yy : Hessian
    clearance : m
        Distance of the point from the boundary of its cell: negative outside the cell, 0 if the cell is
        empty. In a cell that is not convex, it is the distance from the boundary of the part from which
        all of the cell is visible.
    size : m
        Half of the perimeter, which is at least the diameter.
    area : m²
    """

    x: Array
    y: Array
    xx: Array
    xy: Array
    yy: Array
    clearance: Array
    size: Array
    area: Array


class _RelativeEdge(NamedTuple):
    """An edge relative to a point.

    `distance` is that of its line, negative if the point lies outside it. The edge starts at `start`,
    measured along the line from the foot of the perpendicular.
    """

    normal_x: float
    normal_y: float
    length: float
    distance: float
    start: float


class _EdgeIntegral(NamedTuple):
    """∫ f ds over an edge, and its derivatives by the point: ∫ f'(r)/r s ds and ∫ f'(r)/r d ds."""

    total: float
    along: float
    across: float


def compute_locational_costs(edges: CellEdges, points: Array, f: Performance) -> Array:
    """Compute the locational cost (4) of each cell, for density 1.

    Parameters
    ----------
    edges : CellEdges
        Edges of n cells.
    points : (n, 2) array, m
        Point p of each cell, relative to the generator of the cell.
    f : Performance

    Returns
    -------
    (n,) array
        ∫ f(|q-p|) dq over each cell.

    Examples
    --------
    >>> from robocov import Region, partition
    >>> from robocov.locational_cost import SquaredDistance
    >>> square = Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    >>> cells = partition(np.array([[1.0, 1.0]]), square)
    >>> compute_locational_costs(cells.edges, np.zeros((1, 2)), SquaredDistance()).round(6)
    array([2.666667])
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    return _sum_edge_costs(edges.start, edges.end, edges.cell, points, f.kind, f.height, _GAUSS_RULE)


def compute_gradients(edges: CellEdges, points: Array, f: Performance) -> Array:
    """Compute the gradients of the locational costs of cells with respect to their points.

    Parameters
    ----------
    edges, points, f
        See `compute_locational_costs`.

    Returns
    -------
    (n, 2) array

    Notes
    -----
    At the generators this is equation (11). As the cells move with their generators, it is also the gradient
    of the whole cost: what a moving boundary adds to one cell, it takes from the other, (8)-(10).
    """
    derivatives = compute_derivatives(edges, points, f)
    return np.column_stack([derivatives.x, derivatives.y])


def compute_derivatives(edges: CellEdges, points: Array, f: Performance) -> CellDerivatives:
    """Compute gradients and Hessians of the locational costs of cells with respect to their points.

    The cells do not move.

    Parameters
    ----------
    edges, points, f
        See `compute_locational_costs`.

    Returns
    -------
    CellDerivatives
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    return _sum_derivatives(edges.start, edges.end, edges.cell, points, f.kind, f.height)


@kernel
def _sum_derivatives(
    start: Array, end: Array, cell: IntArray, points: Array, kind: int, height: float
) -> CellDerivatives:
    """Return the derivatives as sums over the edges of each cell."""
    n = len(points)
    sums = CellDerivatives(
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    )
    stop = 0
    for i in range(n):
        x = points[i, 0]
        y = points[i, 1]
        first = stop
        size = 0.0
        while stop < len(cell) and cell[stop] == i:
            size += 0.5 * _compute_relative_edge(start, end, stop, x, y).length
            stop += 1
        clearance = np.inf
        for k in range(first, stop):
            edge = _compute_relative_edge(start, end, k, x, y)
            nx = edge.normal_x
            ny = edge.normal_y
            edge_end = edge.start + edge.length
            integral = _integrate_edge(kind, height, edge.distance, edge.start, edge_end, size)
            mixed = integral.along * nx * ny
            difference = 0.5 * (nx - ny) * (nx + ny)
            sums.x[i] -= nx * integral.total
            sums.y[i] -= ny * integral.total
            sums.xx[i] += integral.across * nx * nx - mixed
            # The mean of two expressions, whose sums around the cell are equal.
            sums.xy[i] += integral.across * nx * ny + integral.along * difference
            sums.yy[i] += integral.across * ny * ny + mixed
            sums.area[i] += 0.5 * edge.length * (edge.distance + x * nx + y * ny)
            # The direction of an edge that may be a rounding error is meaningless.
            if edge.length > _MIN_LENGTH * size:
                clearance = min(clearance, edge.distance)
        sums.clearance[i] = clearance if first < stop else 0.0
        sums.size[i] = size
    return sums


@kernel
def _compute_relative_edge(start: Array, end: Array, k: int, x: float, y: float) -> _RelativeEdge:
    """Return edge k relative to a point (x, y)."""
    along_x = end[k, 0] - start[k, 0]
    along_y = end[k, 1] - start[k, 1]
    length = np.sqrt(along_x * along_x + along_y * along_y)
    inverse = 1.0 / max(length, 1e-300)
    normal_x = along_y * inverse
    normal_y = -along_x * inverse
    distance = start[k, 0] * normal_x + start[k, 1] * normal_y - (x * normal_x + y * normal_y)
    along = start[k, 1] * normal_x - start[k, 0] * normal_y - (y * normal_x - x * normal_y)
    return _RelativeEdge(normal_x, normal_y, length, distance, along)


@kernel
def _integrate_edge(
    kind: int, height: float, d: float, first: float, last: float, size: float
) -> _EdgeIntegral:
    """Return the integrals over an edge at distance d from a point, from `first` to `last` along its line.

    A constant that is the same for all edges of a cell may be omitted from f: around the cell it adds 0.
    """
    length = last - first
    first_r = np.sqrt(d * d + first * first)
    last_r = np.sqrt(d * d + last * last)
    if kind == SQUARED_DISTANCE:
        mean = (first * first + first * last + last * last) / 3.0 + d * d
        return _EdgeIntegral(length * mean, length * (last + first), 2.0 * d * length)
    if kind == DISTANCE:
        inverse = _integrate_inverse(d, first, last)
        total = 0.5 * (last * last_r - first * first_r + d * d * inverse)
        return _EdgeIntegral(total, last_r - first_r, d * inverse)
    squared_height = height * height
    w = np.sqrt(d * d + squared_height)
    angle = np.arctan2(w * length, w * w + first * last)
    total = angle / w
    if size < height:
        # From far above, f is nearly constant. Integrating f - 1/h² keeps the digits of its variation.
        remainder = _subtract_arctan(last / w) - _subtract_arctan(first / w)
        total = -length * (d / w) ** 2 / squared_height - remainder / w
    first_square = first_r * first_r + squared_height
    last_square = last_r * last_r + squared_height
    along = (first - last) * (first + last) / (first_square * last_square)
    across = -d / (w * w) * (last / last_square - first / first_square + angle / w)
    return _EdgeIntegral(total, along, across)


@kernel
def _integrate_inverse(d: float, first: float, last: float) -> float:
    """Return ∫ 1/r ds over an edge."""
    d = max(abs(d), 1e-300)
    return float(np.arcsinh(last / d) - np.arcsinh(first / d))


@kernel
def _subtract_arctan(x: float) -> float:
    """Return x - atan x without cancellation for small x."""
    square = x * x
    if square >= 0.0625:
        return float(x - np.arctan(x))
    series = 0.0
    for k in range(14, -1, -1):
        series = series * square + (1.0 - 2.0 * (k % 2)) / (2 * k + 3)
    return x * square * series


@kernel
def _sum_edge_costs(
    start: Array, end: Array, cell: IntArray, points: Array, kind: int, height: float, rule: Array
) -> Array:
    """Return the cost of each cell: the sum of ∫ f over the triangles of its point and its edges.

    A triangle counts as negative if the point is on the outer side of the edge.
    """
    sums = np.zeros(len(points))
    for k in range(len(cell)):
        i = cell[k]
        edge = _compute_relative_edge(start, end, k, points[i, 0], points[i, 1])
        d = edge.distance
        first = edge.start
        last = first + edge.length
        if kind == SQUARED_DISTANCE:
            square = 3.0 * d * d + first * first + first * last + last * last
            sums[i] += d * edge.length * square / 12.0
        elif kind == DISTANCE:
            first_r = np.sqrt(d * d + first * first)
            last_r = np.sqrt(d * d + last * last)
            inverse = _integrate_inverse(d, first, last)
            sums[i] += d * (last * last_r - first * first_r + d * d * inverse) / 6.0
        else:
            _add_sensing_cost(sums, i, edge, height, rule)
    return sums


@kernel
def _add_sensing_cost(sums: Array, i: int, edge: _RelativeEdge, height: float, rule: Array) -> None:
    """Add to sum i the integral of 1/(r²+h²) over the triangle of a point and an edge.

    The quadrature is exact up to rounding. The closed form has dilogarithms, which cancel if the triangle is
    flat or the height is large.
    """
    d = edge.distance
    w = np.sqrt(d * d + height * height)
    first_tau = np.arcsinh(edge.start / w)
    last_tau = np.arcsinh((edge.start + edge.length) / w)
    panels = max(int(np.ceil((last_tau - first_tau) / _PANEL_LENGTH)), 1)
    half = 0.5 * (last_tau - first_tau) / panels
    for panel in range(panels):
        for node in range(rule.shape[1]):
            tau = first_tau + half * (2 * panel + 1 + rule[0, node])
            s = w * np.sinh(tau)
            ratio = (s * s + d * d) / (height * height)
            # log(1 + r²/h²)/r², times h²; its limit at r = 0 is 1.
            logarithm = np.log1p(ratio) / ratio if ratio > 0.0 else 1.0
            term = logarithm * w * np.cosh(tau) * rule[1, node]
            sums[i] += 0.5 * d / (height * height) * term * half
