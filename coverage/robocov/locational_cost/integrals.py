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
from robocov.compiled import inlined_kernel, kernel
from robocov.density.cell_edges import CellEdges
from robocov.locational_cost.performance import DISTANCE, SQUARED_DISTANCE, Performance

_GAUSS_RULE = np.stack(np.polynomial.legendre.leggauss(16))
"""Nodes, in the first row, and weights on [-1, 1]."""
_NODES = 0
_WEIGHTS = 1
"""Rows of `_GAUSS_RULE`."""
_PANEL_LENGTH = 2.0
"""Length of a panel of the quadrature in τ, where s = w sinh τ. The integrand is analytic for |Im τ| < π/2,
and 16 nodes per panel leave less than a rounding error."""
_MIN_RELATIVE_LENGTH = 1e-12
"""Lengths of edges up to this fraction of half the perimeter of the cell may be rounding errors."""
_MIN_LENGTH_M = 1e-300
"""Smallest length used as a divisor, which prevents division by zero."""
_MAX_SERIES_SQUARE = 0.0625
"""Square of x below which x - atan x is computed from a series."""
_SERIES_TERMS = 15
"""Number of terms of that series, which leave less than a rounding error."""


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
    half_perimeter : m
        Half of the perimeter, which is at least the diameter.
    area : m²
    """

    x: Array
    y: Array
    xx: Array
    xy: Array
    yy: Array
    clearance: Array
    half_perimeter: Array
    area: Array


class _RelativeEdge(NamedTuple):
    """An edge relative to a point.

    In the symbols of the module docstring, `distance` is d, which is negative if the point lies on the outer
    side of the edge, and `start` is s₁.
    """

    normal_x: float
    normal_y: float
    length: float
    distance: float
    start: float


class _EdgeIntegral(NamedTuple):
    """Integrals along an edge, in the symbols of the module docstring."""

    total: float
    """∫ f ds"""
    along: float
    """∫ f'(r)/r s ds, the derivative of `total` as the point moves backwards along the edge."""
    across: float
    """∫ f'(r)/r d ds, the derivative of `total` with respect to the distance d."""


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
    At the generators this is equation (11) of the paper (the numbers are those of its equations). The cells
    move with their generators. Nevertheless, this is also the gradient of the sum of all costs: what a moving
    boundary adds to one cell, it takes from the other, (8)-(10).
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
    """Return the gradients and Hessians of the costs, and the shapes of the cells.

    By the divergence theorem, the gradient of ∫ f(|q-p|) dq over a cell, with respect to p, is the sum of
    -n ∫ f ds over its edges, with n the outward unit normal of an edge. The Hessian is the derivative of that
    sum. It follows from the derivatives of ∫ f ds as p moves along the edge, and across it. The edges are
    sorted by cell.
    """
    n = len(points)
    sums = CellDerivatives(
        x=np.zeros(n),
        y=np.zeros(n),
        xx=np.zeros(n),
        xy=np.zeros(n),
        yy=np.zeros(n),
        clearance=np.zeros(n),
        half_perimeter=np.zeros(n),
        area=np.zeros(n),
    )
    end_edge = 0
    for i in range(n):
        x = points[i, 0]
        y = points[i, 1]
        first_edge = end_edge
        half_perimeter = 0.0
        while end_edge < len(cell) and cell[end_edge] == i:
            half_perimeter += 0.5 * _compute_relative_edge(start, end, end_edge, x, y).length
            end_edge += 1
        clearance = np.inf
        for k in range(first_edge, end_edge):
            edge = _compute_relative_edge(start, end, k, x, y)
            integral = _integrate_edge(kind, height, edge, half_perimeter)
            _add_edge(sums, i, edge, integral)
            sums.area[i] += 0.5 * edge.length * (edge.distance + x * edge.normal_x + y * edge.normal_y)
            # If an edge is as short as a rounding error, its direction is meaningless.
            if edge.length > _MIN_RELATIVE_LENGTH * half_perimeter:
                clearance = min(clearance, edge.distance)
        sums.clearance[i] = clearance if first_edge < end_edge else 0.0
        sums.half_perimeter[i] = half_perimeter
    return sums


@inlined_kernel
def _add_edge(sums: CellDerivatives, i: int, edge: _RelativeEdge, integral: _EdgeIntegral) -> None:
    """Add the contribution of an edge to the gradient and the Hessian of cell i.

    With the integral `total`, the normal n and the tangent t = (-n_y, n_x), an edge adds -n total to the
    gradient. When the point moves by δ, d changes by -n·δ, and s by -t·δ, so that the edge adds
    n (across n + along t)ᵀ to the Hessian.
    """
    nx = edge.normal_x
    ny = edge.normal_y
    sums.x[i] -= nx * integral.total
    sums.y[i] -= ny * integral.total
    # The two mixed derivatives differ for one edge, but not in the sum over all edges of the cell. The
    # contribution to xy is the mean of both.
    mixed = integral.along * nx * ny
    half_difference = 0.5 * (nx - ny) * (nx + ny)
    sums.xx[i] += integral.across * nx * nx - mixed
    sums.xy[i] += integral.across * nx * ny + integral.along * half_difference
    sums.yy[i] += integral.across * ny * ny + mixed


@kernel
def _compute_relative_edge(start: Array, end: Array, k: int, x: float, y: float) -> _RelativeEdge:
    """Return edge k in the frame of a point (x, y): its outward normal, length, distance and start.

    The distance is that of the point from the edge's line, negative beyond it. s1 is the coordinate of the
    start along the edge, from the foot of the perpendicular through the point.
    """
    along_x = end[k, 0] - start[k, 0]
    along_y = end[k, 1] - start[k, 1]
    length = np.sqrt(along_x * along_x + along_y * along_y)
    inverse = 1.0 / max(length, _MIN_LENGTH_M)
    normal_x = along_y * inverse
    normal_y = -along_x * inverse
    distance = start[k, 0] * normal_x + start[k, 1] * normal_y - (x * normal_x + y * normal_y)
    s1 = start[k, 1] * normal_x - start[k, 0] * normal_y - (y * normal_x - x * normal_y)
    return _RelativeEdge(normal_x, normal_y, length, distance, start=s1)


@kernel
def _integrate_edge(kind: int, height: float, edge: _RelativeEdge, half_perimeter: float) -> _EdgeIntegral:
    """Return the integrals over an edge, for the performance function of the given kind."""
    if kind == SQUARED_DISTANCE:
        return _integrate_squared_distance(edge)
    if kind == DISTANCE:
        return _integrate_distance(edge)
    return _integrate_sensing(edge, height, half_perimeter)


@kernel
def _integrate_squared_distance(edge: _RelativeEdge) -> _EdgeIntegral:
    """Return the integrals over an edge for f = r², with r² = s² + d², s from s1 to s2 along the edge."""
    d = edge.distance
    s1 = edge.start
    s2 = edge.start + edge.length
    # The length between the rounded ends, which may differ from `edge.length`.
    length = s2 - s1
    mean = (s1 * s1 + s1 * s2 + s2 * s2) / 3.0 + d * d
    return _EdgeIntegral(total=length * mean, along=length * (s2 + s1), across=2.0 * d * length)


@kernel
def _integrate_distance(edge: _RelativeEdge) -> _EdgeIntegral:
    """Return the integrals over an edge for f = r, with r² = s² + d², s from s1 to s2 along the edge."""
    d = edge.distance
    s1 = edge.start
    s2 = edge.start + edge.length
    r1 = np.sqrt(d * d + s1 * s1)
    r2 = np.sqrt(d * d + s2 * s2)
    inverse_integral = _integrate_inverse(d, s1, s2)
    total = 0.5 * (s2 * r2 - s1 * r1 + d * d * inverse_integral)
    return _EdgeIntegral(total=total, along=r2 - r1, across=d * inverse_integral)


@kernel
def _integrate_sensing(edge: _RelativeEdge, height: float, half_perimeter: float) -> _EdgeIntegral:
    """Return the integrals over an edge for f = 1/(r²+h²), or for f - 1/h².

    With r² = s² + d², s from s1 to s2 along the edge, and w² = d² + h², the integral of f over the edge is
    (atan(s2/w) - atan(s1/w)) / w. A constant that is the same for all edges of a cell may be subtracted from
    f: the sum over all edges around the cell remains the same.
    """
    d = edge.distance
    s1 = edge.start
    s2 = edge.start + edge.length
    # The length between the rounded ends, which may differ from `edge.length`.
    length = s2 - s1
    squared_height = height * height
    w = np.sqrt(d * d + squared_height)
    angle = np.arctan2(w * length, w * w + s1 * s2)
    total = angle / w
    if half_perimeter < height:
        # From far above, f is nearly constant. Integrating f - 1/h² keeps the digits of its variation. With
        # atan x = x - (x - atan x), the terms s/w² - s/h² are -s (d/w)² / h².
        remainder = _subtract_arctan(s2 / w) - _subtract_arctan(s1 / w)
        total = -length * (d / w) ** 2 / squared_height - remainder / w
    # The values of 1/f at both ends, and `along` as f(r₂) - f(r₁) without cancellation.
    r1 = np.sqrt(d * d + s1 * s1)
    r2 = np.sqrt(d * d + s2 * s2)
    inverse_f1 = r1 * r1 + squared_height
    inverse_f2 = r2 * r2 + squared_height
    along = (s1 - s2) * (s1 + s2) / (inverse_f1 * inverse_f2)
    across = -d / (w * w) * (s2 / inverse_f2 - s1 / inverse_f1 + angle / w)
    return _EdgeIntegral(total, along, across)


@kernel
def _integrate_inverse(d: float, s1: float, s2: float) -> float:
    """Return ∫ 1/r ds over an edge."""
    d = max(abs(d), _MIN_LENGTH_M)
    return float(np.arcsinh(s2 / d) - np.arcsinh(s1 / d))


@kernel
def _subtract_arctan(x: float) -> float:
    """Return x - atan x without cancellation for small x."""
    square = x * x
    if square >= _MAX_SERIES_SQUARE:
        return float(x - np.arctan(x))
    # The series is x³/3 - x⁵/5 + x⁷/7 ..., evaluated by Horner's method.
    series = 0.0
    for k in range(_SERIES_TERMS - 1, -1, -1):
        sign = 1.0 if k % 2 == 0 else -1.0
        series = series * square + sign / (2 * k + 3)
    return x * square * series


@kernel
def _sum_edge_costs(
    start: Array, end: Array, cell: IntArray, points: Array, kind: int, height: float, rule: Array
) -> Array:
    """Return the cost of each cell: the sum of ∫ f over the triangles between its point and its edges.

    An edge is at the distance d from the point, and s runs along it from s1 to s2, so that r² = s² + d². With
    F(r) the integral of f(ρ) ρ dρ from 0 to r, the integral over the triangle is d ∫ F(r)/r² ds. It is
    negative if the point is on the outer side of the edge, where d is negative.
    """
    sums = np.zeros(len(points))
    for k in range(len(cell)):
        i = cell[k]
        edge = _compute_relative_edge(start, end, k, points[i, 0], points[i, 1])
        d = edge.distance
        s1 = edge.start
        s2 = s1 + edge.length
        if kind == SQUARED_DISTANCE:
            # F(r)/r² = r²/4.
            square = 3.0 * d * d + s1 * s1 + s1 * s2 + s2 * s2
            sums[i] += d * edge.length * square / 12.0
        elif kind == DISTANCE:
            # F(r)/r² = r/3.
            r1 = np.sqrt(d * d + s1 * s1)
            r2 = np.sqrt(d * d + s2 * s2)
            inverse_integral = _integrate_inverse(d, s1, s2)
            sums[i] += d * (s2 * r2 - s1 * r1 + d * d * inverse_integral) / 6.0
        else:
            _add_sensing_cost(sums, i, edge, height, rule)
    return sums


@kernel
def _add_sensing_cost(sums: Array, i: int, edge: _RelativeEdge, height: float, rule: Array) -> None:
    """Add to sum i the integral of 1/(r²+h²) over the triangle of a point and an edge.

    With F(r) = ½ log(1 + r²/h²) the integral of r/(r²+h²) from 0 to r, this is the integral of d F(r)/r²
    along the edge, with d the distance of its line from the point, r² = s² + d², and s the position along it.
    It is computed by Gauss rules on panels of equal length in τ, where s = w sinh τ and w² = d² + h², which
    is exact up to rounding. The closed form has dilogarithms, which cancel if the triangle is flat or the
    height is large.
    """
    d = edge.distance
    w = np.sqrt(d * d + height * height)
    tau1 = np.arcsinh(edge.start / w)
    tau2 = np.arcsinh((edge.start + edge.length) / w)
    panel_count = max(int(np.ceil((tau2 - tau1) / _PANEL_LENGTH)), 1)
    half_panel = 0.5 * (tau2 - tau1) / panel_count
    for panel in range(panel_count):
        for node in range(rule.shape[1]):
            tau = tau1 + half_panel * (2 * panel + 1 + rule[_NODES, node])
            s = w * np.sinh(tau)
            ratio = (s * s + d * d) / (height * height)
            # log(1 + r²/h²)/r², times h²; its limit at r = 0 is 1.
            logarithm = np.log1p(ratio) / ratio if ratio > 0.0 else 1.0
            term = logarithm * w * np.cosh(tau) * rule[_WEIGHTS, node]
            sums[i] += 0.5 * d / (height * height) * term * half_panel
