"""The locational cost (4) of cells, its gradient (11) and its Hessian, for density 1.

All three are sums over the edges of a cell. The point p may lie anywhere. By the divergence theorem, the
gradient is

    ∂/∂p ∫_V f(|q-p|) dq = -∮_∂V f(|q-p|) n dq ,      n the outward unit normal,

so that an edge adds -n ∫ f(√(s²+d²)) ds. Here d is the distance of p from the line of the edge, and s is the
coordinate along the edge, from s₁ to s₂, which is zero at the foot of the perpendicular from p. With
w² = d²+h² and the angle Δ = atan(s₂/w) - atan(s₁/w), the integral is Δ/w for f = 1/(r²+h²). These are
equations (15)-(20), without the special case for vertical edges, and without the second integral of (18),
which is printed with the wrong sign but sums to zero around a cell. The cost itself is a sum over the
triangles between p and the edges.

The terms are added in the order of the edges of a cell, so that the result for a cell does not depend on
other cells, to the last bit.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from typing import NamedTuple

import numpy as np

from robocov.compiled import inlined_kernel, kernel
from robocov.density.cell_edges import CellEdges
from robocov.locational_cost.performance import DISTANCE, SENSING, SQUARED_DISTANCE, Performance
from robocov.typing import FloatArray, IntArray

_GAUSS_RULE = np.stack(np.polynomial.legendre.leggauss(16))
"""Gauss-Legendre rule with 16 nodes on [-1, 1]: the nodes, then the weights.

Kernels receive it as an argument, because a compiled kernel would contain a copy of a global array.
"""
_NODES = 0
"""Row of `_GAUSS_RULE` that contains the nodes."""
_WEIGHTS = 1
"""Row of `_GAUSS_RULE` that contains the weights."""
_PANEL_LENGTH = 2.0
"""Maximum length of a panel of the quadrature in τ, where s = w sinh τ. The integrand is analytic for |Im τ|
< π/2, so that with 16 nodes per panel, the error is less than that of rounding."""
_MIN_RELATIVE_LENGTH = 1e-12
"""Lengths of edges up to this fraction of half the perimeter of the cell may be rounding errors."""
_MIN_LENGTH_M = 1e-300
"""Minimum divisor; prevents division by zero."""
_MAX_SERIES_SQUARE = 0.0625
"""Square of x below which x - atan x is computed from a series."""
_SERIES_TERMS = 15
"""Number of terms of that series, with which the error is less than that of rounding."""


class CellDerivatives(NamedTuple):
    """Derivatives of the locational costs of n cells with respect to their points, and shapes of the cells.

    Attributes
    ----------
    x, y : (n,) array
        Components of the gradients.
    xx, xy, yy : (n,) array
        Entries of the Hessians.
    clearances : (n,) array, m
        Distance of each point from the boundary of its cell: negative outside the cell, 0 if the cell is
        empty. If the cell is not convex, it is the distance from the boundary of its kernel, which consists
        of the points from which the whole cell is visible.
    half_perimeters : (n,) array, m
        Half of the perimeter of each cell, which is an upper bound on its diameter.
    areas : (n,) array, m²
        Area of each cell.
    """

    x: FloatArray
    y: FloatArray
    xx: FloatArray
    xy: FloatArray
    yy: FloatArray
    clearances: FloatArray
    half_perimeters: FloatArray
    areas: FloatArray


class _RelativeEdge(NamedTuple):
    """An edge relative to a point p. For s and d, see the description of the module."""

    normal_x: float
    """x of the outward unit normal n."""
    normal_y: float
    """y of the outward unit normal n."""
    length: float
    """Length of the edge, m."""
    distance: float
    """Distance d of p from the line of the edge, m; negative if p lies on the outer side."""
    start: float
    """Coordinate s₁ of the start of the edge, m."""


class _EdgeIntegral(NamedTuple):
    """Integrals along an edge. For s and d, see the description of the module."""

    total: float
    """∫ (f - c) ds, where the constant c is the same for all edges of a cell, and 0 unless the cell is small.

    Only the sum of n ∫ (f - c) ds over all edges of a cell has a meaning of its own: it does not depend on c.
    """
    along: float
    """∫ f'(r)/r s ds, the derivative of `total` if s₁ and s₂ grow by the same amount."""
    across: float
    """∫ f'(r)/r d ds, the derivative of `total` with respect to d."""


def compute_locational_costs(edges: CellEdges, points: FloatArray, f: Performance) -> FloatArray:
    """Compute the locational cost (4) of each cell, for density 1.

    Parameters
    ----------
    edges : CellEdges
        Edges of n cells.
    points : (n, 2) array, m
        Point p of each cell, relative to the generator of the cell.
    f : Performance
        The function f of the distance.

    Returns
    -------
    (n,) array
        Integral of f(|q-p|) over the points q of each cell.

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
    return _sum_edge_costs(edges.starts, edges.ends, edges.cells, points, f.kind, f.height, _GAUSS_RULE)


def compute_gradients(edges: CellEdges, points: FloatArray, f: Performance) -> FloatArray:
    """Compute the gradient of the locational cost of each cell with respect to its point, for density 1.

    The cells do not move with the points.

    Parameters
    ----------
    edges, points, f
        See `compute_locational_costs`.

    Returns
    -------
    (n, 2) array

    Notes
    -----
    If the points are the generators, this is equation (11). Although the cells change if the generators move,
    this is then also the gradient of the sum of all costs: what a moving boundary adds to the cost of one
    cell, it takes from that of the other, (8)-(10).
    """
    derivatives = compute_derivatives(edges, points, f)
    return np.column_stack([derivatives.x, derivatives.y])


def compute_derivatives(edges: CellEdges, points: FloatArray, f: Performance) -> CellDerivatives:
    """Compute the derivatives of the locational cost of each cell with respect to its point, for density 1.

    The cells do not move with the points.

    Parameters
    ----------
    edges, points, f
        See `compute_locational_costs`.

    Returns
    -------
    CellDerivatives
        Gradients and Hessians, and the shapes of the cells.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    return _sum_derivatives(edges.starts, edges.ends, edges.cells, points, f.kind, f.height)


@kernel
def _sum_derivatives(
    starts: FloatArray, ends: FloatArray, cells: IntArray, points: FloatArray, kind: int, height: float
) -> CellDerivatives:
    """Return the gradients and Hessians of the costs, and the shapes of the cells.

    By the divergence theorem, the gradient of ∫ f(|q-p|) dq over a cell, with respect to p, is the sum of
    -n ∫ f ds over its edges, where n is the outward unit normal of an edge. The Hessian is the derivative of
    this sum, and follows from the derivatives of ∫ f ds if p moves along the edge or perpendicular to it. The
    edges are sorted by cell.
    """
    n = len(points)
    sums = CellDerivatives(
        x=np.zeros(n),
        y=np.zeros(n),
        xx=np.zeros(n),
        xy=np.zeros(n),
        yy=np.zeros(n),
        clearances=np.zeros(n),
        half_perimeters=np.zeros(n),
        areas=np.zeros(n),
    )
    first_edge = 0
    for i in range(n):
        x = points[i, 0]
        y = points[i, 1]
        end_edge = first_edge
        while end_edge < len(cells) and cells[end_edge] == i:
            end_edge += 1
        half_perimeter = 0.0
        for k in range(first_edge, end_edge):
            half_perimeter += 0.5 * _compute_relative_edge(starts, ends, k, x, y).length
        clearance = np.inf
        for k in range(first_edge, end_edge):
            edge = _compute_relative_edge(starts, ends, k, x, y)
            integral = _integrate_edge(kind, height, edge, half_perimeter)
            _add_edge(sums, i, edge, integral)
            # The area of the triangle between the generator and the edge. The sum in parentheses is the
            # distance of the generator from the edge.
            sums.areas[i] += 0.5 * edge.length * (edge.distance + x * edge.normal_x + y * edge.normal_y)
            # If an edge is as short as a rounding error, its direction is meaningless.
            if edge.length > _MIN_RELATIVE_LENGTH * half_perimeter:
                clearance = min(clearance, edge.distance)
        sums.clearances[i] = clearance if first_edge < end_edge else 0.0
        sums.half_perimeters[i] = half_perimeter
        first_edge = end_edge
    return sums


@inlined_kernel
def _add_edge(sums: CellDerivatives, i: int, edge: _RelativeEdge, integral: _EdgeIntegral) -> None:
    """Add the contribution of an edge to the gradient and the Hessian of cell i.

    With the normal n, the edge adds -n total to the gradient. If the point moves by δ, d changes by -n·δ, and
    s by -t·δ, where t = (-n_y, n_x) is the direction of the edge. The edge therefore adds n (across n + along
    t)ᵀ to the Hessian.
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
def _compute_relative_edge(starts: FloatArray, ends: FloatArray, k: int, x: float, y: float) -> _RelativeEdge:
    """Return edge k relative to the point (x, y)."""
    along_x = ends[k, 0] - starts[k, 0]
    along_y = ends[k, 1] - starts[k, 1]
    length = np.sqrt(along_x * along_x + along_y * along_y)
    inverse_length = 1.0 / max(length, _MIN_LENGTH_M)
    normal_x = along_y * inverse_length
    normal_y = -along_x * inverse_length
    distance = starts[k, 0] * normal_x + starts[k, 1] * normal_y - (x * normal_x + y * normal_y)
    s1 = starts[k, 1] * normal_x - starts[k, 0] * normal_y - (y * normal_x - x * normal_y)
    return _RelativeEdge(normal_x, normal_y, length, distance, start=s1)


@kernel
def _integrate_edge(kind: int, height: float, edge: _RelativeEdge, half_perimeter: float) -> _EdgeIntegral:
    """Return the integrals along an edge for the function f of the given kind.

    `height` and `half_perimeter`, that of the cell, are needed only for `Sensing`.
    """
    if kind == SQUARED_DISTANCE:
        return _integrate_squared_distance(edge)
    if kind == DISTANCE:
        return _integrate_distance(edge)
    if kind == SENSING:
        return _integrate_sensing(edge, height, half_perimeter)
    raise ValueError("kind: expected the number of a performance function")


@kernel
def _integrate_squared_distance(edge: _RelativeEdge) -> _EdgeIntegral:
    """Return the integrals along an edge for f = r², where r² = s² + d², and s runs from s1 to s2."""
    d = edge.distance
    s1 = edge.start
    s2 = edge.start + edge.length
    # The length between the rounded ends, which may differ from `edge.length`.
    length = s2 - s1
    mean = (s1 * s1 + s1 * s2 + s2 * s2) / 3.0 + d * d
    return _EdgeIntegral(total=length * mean, along=length * (s2 + s1), across=2.0 * d * length)


@kernel
def _integrate_distance(edge: _RelativeEdge) -> _EdgeIntegral:
    """Return the integrals along an edge for f = r, where r² = s² + d², and s runs from s1 to s2."""
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
    """Return the integrals along an edge for f = 1/(r²+h²), or for f - 1/h² if the cell is small.

    Let r² = s² + d², where s runs from s1 to s2, and w² = d² + h². The integral of f along the edge is then
    (atan(s2/w) - atan(s1/w)) / w. A constant may be subtracted from f, if it is the same for all edges of a
    cell, because the sum of n ∫ ds over all edges is zero.
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
        # In a cell that is small compared with the height, f is nearly constant. The integral of f - 1/h²
        # does not lose the digits of the small variation. With atan x = x - (x - atan x), its leading terms
        # are s/w² - s/h² = -s (d/w)² / h².
        remainder = _subtract_arctan(s2 / w) - _subtract_arctan(s1 / w)
        total = -length * (d / w) ** 2 / squared_height - remainder / w
    # The squared distances r² + h² of both ends from the sensor are the values of 1/f. From them,
    # f(r2) - f(r1), which is `along`, follows without cancellation.
    r1 = np.sqrt(d * d + s1 * s1)
    r2 = np.sqrt(d * d + s2 * s2)
    squared_range1 = r1 * r1 + squared_height
    squared_range2 = r2 * r2 + squared_height
    along = (s1 - s2) * (s1 + s2) / (squared_range1 * squared_range2)
    across = -d / (w * w) * (s2 / squared_range2 - s1 / squared_range1 + angle / w)
    return _EdgeIntegral(total, along, across)


@kernel
def _integrate_inverse(d: float, s1: float, s2: float) -> float:
    """Return ∫ 1/r ds along an edge at the distance d, where r² = s² + d², and s runs from s1 to s2."""
    d = max(abs(d), _MIN_LENGTH_M)
    return float(np.arcsinh(s2 / d) - np.arcsinh(s1 / d))


@kernel
def _subtract_arctan(x: float) -> float:
    """Return x - atan x without cancellation for small x."""
    square = x * x
    if square >= _MAX_SERIES_SQUARE:
        return float(x - np.arctan(x))
    # The series x³/3 - x⁵/5 + x⁷/7 - ... is evaluated by Horner's method.
    series = 0.0
    for k in range(_SERIES_TERMS - 1, -1, -1):
        sign = 1.0 if k % 2 == 0 else -1.0
        series = series * square + sign / (2 * k + 3)
    return x * square * series


@kernel
def _sum_edge_costs(
    starts: FloatArray,
    ends: FloatArray,
    cells: IntArray,
    points: FloatArray,
    kind: int,
    height: float,
    rule: FloatArray,
) -> FloatArray:
    """Return the cost of each cell: the sum of the integrals of f over triangles from the point to the edges.

    An edge is at the distance d from the point, and s runs along it from s1 to s2, so that r² = s² + d². Let
    F(r) be the integral of f(ρ) ρ dρ from 0 to r. The integral over the triangle is then d ∫ F(r)/r² ds. It
    is negative if the point is on the outer side of the edge, where d is negative.
    """
    sums = np.zeros(len(points))
    for k in range(len(cells)):
        i = cells[k]
        edge = _compute_relative_edge(starts, ends, k, points[i, 0], points[i, 1])
        d = edge.distance
        s1 = edge.start
        s2 = s1 + edge.length
        if kind == SQUARED_DISTANCE:
            # F(r)/r² = r²/4, and the mean of r² along the edge is d² + (s1² + s1 s2 + s2²) / 3.
            triple_mean = 3.0 * d * d + s1 * s1 + s1 * s2 + s2 * s2
            sums[i] += d * edge.length * triple_mean / 12.0
        elif kind == DISTANCE:
            # F(r)/r² = r/3, and ∫ r ds = (s2 r2 - s1 r1 + d² ∫ 1/r ds) / 2.
            r1 = np.sqrt(d * d + s1 * s1)
            r2 = np.sqrt(d * d + s2 * s2)
            inverse_integral = _integrate_inverse(d, s1, s2)
            sums[i] += d * (s2 * r2 - s1 * r1 + d * d * inverse_integral) / 6.0
        else:
            _add_sensing_cost(sums, i, edge, height, rule)
    return sums


@kernel
def _add_sensing_cost(sums: FloatArray, i: int, edge: _RelativeEdge, height: float, rule: FloatArray) -> None:
    """Add to sum i the integral of 1/(r²+h²) over the triangle between a point and an edge.

    This is the integral of d F(r)/r² along the edge, where F(r) = ½ log(1 + r²/h²) is the integral of
    ρ/(ρ²+h²) from 0 to r; for d, r and s, see `_sum_edge_costs`. With s = w sinh τ and w² = d² + h², it is
    computed by Gauss rules on panels of equal length in τ, which is exact up to rounding. The closed form
    consists of dilogarithms, which nearly cancel each other if the triangle is flat or the height is large.
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
