"""The locational cost (4) of cells, its gradient (11) and its Hessian, for three functions f of distance.

Everything is an integral over the boundary of a cell. By the divergence theorem

    ∂/∂p ∫_V f(|q-p|) dq = -∮_∂V f(|q-p|) n dq ,      n the outward unit normal,

so that an edge adds -n ∫ f(√(s²+d²)) ds: d is the distance from p to the edge's line, and s runs from the
foot of the perpendicular along the edge. For f = 1/(r²+h²) that is Δ/w with w² = d²+h² and Δ the angle
atan(s₂/w) - atan(s₁/w): equations (15)-(20) of the paper, without its case of upright edges, and without the
second integral of (18), which is printed with the wrong sign but adds up to nothing round a cell. The value
of the integral itself is a sum over the triangles that p spans with the edges. p may lie anywhere.

What is summed over a cell's edges is summed in their order: a cell's row does not depend on the others, to
the last bit.
"""

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.density.cell_edges import CellEdges
from robocov.errors import ParameterError, quote

_RULE = np.stack(np.polynomial.legendre.leggauss(16))  # nodes and weights

# length of a panel of the quadrature in τ, where s = w sinh τ: the integrand is analytic for |Im τ| < π/2,
# and 16 nodes leave less than a rounding error
_PANEL = 2.0

_SQUARES, _DISTANCES = 0, 1


@dataclass(frozen=True)
class SquaredDistance:
    """f = r², equation (12), in m²: mean intervention by squares; its optimum is the centroid, (13)."""

    kind: ClassVar[int] = _SQUARES
    sign: ClassVar[float] = 1.0  # f increases, and the cost is to be small
    height: ClassVar[float] = 1.0


@dataclass(frozen=True)
class Distance:
    """f = r, in m: what the coverage cost (22) asks for within a convex cell; its optimum is the median."""

    kind: ClassVar[int] = _DISTANCES
    sign: ClassVar[float] = 1.0
    height: ClassVar[float] = 1.0


@dataclass(frozen=True)
class Sensing:
    """f = 1/(r²+h²), equation (14), in 1/m²: what a sensor at height h (m) tells of a place.

    The optimum does depend on the height, other than the paper says after (14): it is the centroid for
    h → ∞ alone. A ParameterError tells of a height that is no finite positive number.
    """

    kind: ClassVar[int] = 2
    sign: ClassVar[float] = -1.0  # f decreases, and the cost is to be large

    height: float

    def __post_init__(self) -> None:
        if not 0.0 < self.height < np.inf:
            raise ParameterError(f"height: {quote(self.height)}, but a number above 0 m was wanted")


Performance: TypeAlias = SquaredDistance | Distance | Sensing
"""A function f of the distance, of which (4) is the integral over the cells."""


def compute_locational_costs(edges: CellEdges, points: Array, f: Performance) -> Array:
    """Return the locational cost (4) of each cell: ∫ f(|q-p|) dq over it, (n,), with density 1.

    The points, p for each cell, (n, 2) m, are relative to the cells' generators: zeros are these themselves.

    >>> from robocov import Region, partition
    >>> square = Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    >>> cells = partition(np.array([[1.0, 1.0]]), square)
    >>> compute_locational_costs(cells.edges, np.zeros((1, 2)), SquaredDistance()).round(6)
    array([2.666667])
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    return _values(edges.start, edges.end, edges.cell, points, f.kind, f.height, _RULE)


def compute_gradients(edges: CellEdges, points: Array, f: Performance) -> Array:
    """Return the gradient of `value` with respect to the points, (n, 2): equation (11) at the generators.

    As the cells move with their generators, this is also the gradient of the whole cost: what the boundary
    between two cells adds to one it takes from the other, (8)-(10).
    """
    return compute_derivatives(edges, points, f)[:, :2]


def compute_derivatives(edges: CellEdges, points: Array, f: Performance) -> Array:
    """Return the derivatives of `value` by x, y, xx, xy and yy, and of each cell room, size and area, (n, 8).

    The room, m, is how far the point is inside its cell: negative outside, 0 in an empty cell; of a cell that
    is not convex it is how far the point is inside the part that sees all of it. The size, m, is half of the
    perimeter, which is at least the diameter. The cells stay where they are.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    return _derivatives(edges.start, edges.end, edges.cell, points, f.kind, f.height)


@kernel
def _seen(start: Array, end: Array, k: int, x: float, y: float) -> tuple[float, float, float, float, float]:
    """Return an edge's outward normal and length, d from a point, negative for one beyond it, and s₁."""
    along_x, along_y = end[k, 0] - start[k, 0], end[k, 1] - start[k, 1]
    length = np.sqrt(along_x * along_x + along_y * along_y)
    over = 1.0 / max(length, 1e-300)
    nx, ny = along_y * over, -along_x * over
    px, py = start[k, 0], start[k, 1]
    d = px * nx + py * ny - (x * nx + y * ny)
    return nx, ny, length, d, py * nx - px * ny - (y * nx - x * ny)


@kernel
def _derivatives(start: Array, end: Array, cell: IntArray, points: Array, kind: int, height: float) -> Array:
    found = np.zeros((len(points), 8))
    k = 0
    for i in range(len(points)):
        x, y, begin, room, size = points[i, 0], points[i, 1], k, np.inf, 0.0
        while k < len(cell) and cell[k] == i:
            size += 0.5 * _seen(start, end, k, x, y)[2]
            k += 1
        for edge in range(begin, k):
            nx, ny, length, d, s = _seen(start, end, edge, x, y)
            total, along, across = _over_edge(kind, height, d, s, s + length, size)
            mixed, difference = along * nx * ny, 0.5 * (nx - ny) * (nx + ny)
            found[i, 0] -= nx * total
            found[i, 1] -= ny * total
            found[i, 2] += across * nx * nx - mixed
            # the mean of the two ways to write it, which are equal once they are summed round the cell
            found[i, 3] += across * nx * ny + along * difference
            found[i, 4] += across * ny * ny + mixed
            found[i, 7] += 0.5 * length * (d + x * nx + y * ny)
            # an edge of no length but rounding has no direction either
            if length > 1e-12 * size:
                room = min(room, d)
        found[i, 5], found[i, 6] = room if begin < k else 0.0, size
    return found


@kernel
def _over_edge(
    kind: int, height: float, d: float, s: float, e: float, size: float
) -> tuple[float, float, float]:
    """Return ∫ f ds over an edge, and how it changes as the point moves: ∫ f'(r)/r s ds and ∫ f'(r)/r d ds.

    A constant that is the same for all edges of a cell may be left out of f: round the cell it is 0.
    """
    length, near, far = e - s, np.sqrt(d * d + s * s), np.sqrt(d * d + e * e)
    if kind == _SQUARES:
        return length * ((s * s + s * e + e * e) / 3.0 + d * d), length * (e + s), 2.0 * d * length
    if kind == _DISTANCES:
        log = _inverse_over(d, s, e)
        return 0.5 * (e * far - s * near + d * d * log), far - near, d * log
    square = height * height
    w = np.sqrt(d * d + square)
    angle = np.arctan2(w * length, w * w + s * e)
    total = angle / w
    if size < height:
        # seen from high above, f is nearly the same everywhere: of f - 1/h², which would be lost else
        rest = _arctan_rest(e / w) - _arctan_rest(s / w)
        total = -length * (d / w) ** 2 / square - rest / w
    low, high = near * near + square, far * far + square
    along = (s - e) * (s + e) / (low * high)
    return total, along, -d / (w * w) * (e / high - s / low + angle / w)


@kernel
def _inverse_over(d: float, s: float, e: float) -> float:
    """Return ∫ 1/r ds over an edge."""
    d = max(abs(d), 1e-300)
    return float(np.arcsinh(e / d) - np.arcsinh(s / d))


@kernel
def _arctan_rest(x: float) -> float:
    """Return x - atan x without cancellation where x is small."""
    square, series = x * x, 0.0
    if square >= 0.0625:
        return float(x - np.arctan(x))
    for k in range(14, -1, -1):
        series = series * square + (1.0 - 2.0 * (k % 2)) / (2 * k + 3)
    return x * square * series


@kernel
def _values(
    start: Array, end: Array, cell: IntArray, points: Array, kind: int, height: float, rule: Array
) -> Array:
    """Return the sums of ∫ f over the triangles that the points span with the edges, signed as d."""
    sums = np.zeros(len(points))
    for k in range(len(cell)):
        i = cell[k]
        _, _, length, d, s = _seen(start, end, k, points[i, 0], points[i, 1])
        e = s + length
        if kind == _SQUARES:
            sums[i] += d * length * (3.0 * d * d + s * s + s * e + e * e) / 12.0
            continue
        if kind == _DISTANCES:
            near, far = np.sqrt(d * d + s * s), np.sqrt(d * d + e * e)
            sums[i] += d * (e * far - s * near + d * d * _inverse_over(d, s, e)) / 6.0
            continue
        # by quadrature to rounding: in closed form there are dilogarithms, which cancel where a triangle is
        # flat or seen from high above
        w = np.sqrt(d * d + height * height)
        begin, stop = np.arcsinh(s / w), np.arcsinh(e / w)
        panels = max(int(np.ceil((stop - begin) / _PANEL)), 1)
        half = 0.5 * (stop - begin) / panels
        for panel in range(panels):
            for node in range(rule.shape[1]):
                tau = begin + half * (2 * panel + 1 + rule[0, node])
                foot = w * np.sinh(tau)
                r = (foot * foot + d * d) / (height * height)
                # log(1 + r²/h²)/r², which is 1/h² at the foot of the point
                part = (np.log1p(r) / r if r > 0.0 else 1.0) * w * np.cosh(tau) * rule[1, node]
                sums[i] += 0.5 * d / (height * height) * part * half
    return sums
