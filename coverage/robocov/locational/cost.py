"""The locational cost (4) of cells, its gradient (11) and its Hessian, for three functions f of distance.

Everything is an integral over the boundary of a cell. By the divergence theorem

    ∂/∂p ∫_V f(|q-p|) dq = -∮_∂V f(|q-p|) n dq ,      n the outward unit normal,

so that an edge adds -n ∫ f(√(s²+d²)) ds: d is the distance from p to the edge's line, and s runs from the
foot of the perpendicular along the edge. For f = 1/(r²+h²) that is Δ/w with w² = d²+h² and Δ the angle
atan(s₂/w) - atan(s₁/w): equations (15)-(20) of the paper, without its case of upright edges, and without the
second integral of (18), which is printed with the wrong sign but adds up to nothing round a cell. The value
of the integral itself is a sum over the triangles that p spans with the edges. p may lie anywhere.

What is summed over a cell's edges is summed in their order, and nothing else of other cells comes near it:
a cell's row does not depend on the others, to the last bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.density.cell_edges import CellEdges
from robocov.errors import ParameterError, shown

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)

_PANEL = 2.0
"""Length of a panel of the quadrature in τ, where s = w sinh τ: the integrand is analytic for |Im τ| < π/2,
and 16 nodes leave less than a rounding error."""

_ARCTAN_SERIES = tuple((-1.0) ** k / (2 * k + 3) for k in range(15))
"""Of (x - atan x)/x³ in powers of x²."""


class Seen(NamedTuple):
    """The edges of cells as seen from one point a cell.

    Attributes
    ----------
    distance : (s,) m
        d, from the point to the edge's line along its outward normal: negative where the point is beyond it.
    first, last : (s,) m
        s₁ and s₂: the ends along the edge, from the foot of the perpendicular.
    near, far : (s,) m
        Distances to the two ends.
    size : (s,) m
        Half of the cell's perimeter, which is at least its diameter: the same for all edges of a cell.
    """

    distance: Array
    first: Array
    last: Array
    near: Array
    far: Array
    size: Array


class OverEdge(NamedTuple):
    """Integrals over edges, (s,) each.

    Attributes
    ----------
    value
        ∫ f ds.
    along, across
        ∫ f'(r)/r s ds and ∫ f'(r)/r d ds: how ∫ f ds changes as the point moves.
    """

    value: Array
    along: Array
    across: Array


class Performance(Protocol):
    """A function f of the distance, of which (4) is the integral over the cells.

    Attributes
    ----------
    sign : float
        1 where f increases, and the cost is to be small; -1 where f decreases, and it is to be large.
    """

    sign: ClassVar[float]

    def __call__(self, distance: Array) -> Array:
        """Return f(r) at distances, m."""

    def over_edges(self, seen: Seen) -> OverEdge:
        """Return the integrals over the edges.

        A constant that is the same for all edges of a cell may be left out of f: round the cell it is 0.
        """

    def over_triangles(self, seen: Seen) -> Array:
        """Return ∫ f over the triangles that the points span with the edges, (s,), signed as the distance."""


@dataclass(frozen=True)
class SquaredDistance:
    """f = r², equation (12): mean intervention by squares; its optimum is the centroid, (13). In m²."""

    sign: ClassVar[float] = 1.0

    def __call__(self, distance: Array) -> Array:
        """Return f(r), m²."""
        return np.square(distance)

    def over_edges(self, seen: Seen) -> OverEdge:
        """Return the integrals over edges: m³, m² and m²."""
        d, s, e = seen.distance, seen.first, seen.last
        length = e - s
        value = length * ((s * s + s * e + e * e) / 3.0 + d * d)
        return OverEdge(value, length * (e + s), 2.0 * d * length)

    def over_triangles(self, seen: Seen) -> Array:
        """Return the integrals over triangles, m⁴."""
        d, s, e = seen.distance, seen.first, seen.last
        return d * (e - s) * (3.0 * d * d + s * s + s * e + e * e) / 12.0


@dataclass(frozen=True)
class Distance:
    """f = r: what the coverage cost (22) asks for within a convex cell; its optimum is the median. In m."""

    sign: ClassVar[float] = 1.0

    def __call__(self, distance: Array) -> Array:
        """Return f(r), m."""
        return np.asarray(distance)

    def over_edges(self, seen: Seen) -> OverEdge:
        """Return the integrals over edges: m², m and m."""
        d, s, e, near, far, _ = seen
        log = _inverse_over(seen)
        return OverEdge(0.5 * (e * far - s * near + d * d * log), far - near, d * log)

    def over_triangles(self, seen: Seen) -> Array:
        """Return the integrals over triangles, m³."""
        d, s, e, near, far, _ = seen
        return d * (e * far - s * near + d * d * _inverse_over(seen)) / 6.0


@dataclass(frozen=True)
class Sensing:
    """f = 1/(r²+h²), equation (14): what a sensor at height h tells of a place, which is to be much. In 1/m².

    The optimum does depend on the height, other than the paper says after (14): it is the centroid for
    h → ∞ alone.

    Attributes
    ----------
    height : float, m

    Raises
    ------
    ParameterError
        When the height is no finite positive number.
    """

    sign: ClassVar[float] = -1.0

    height: float

    def __post_init__(self) -> None:
        if not 0.0 < self.height < np.inf:
            raise ParameterError(f"height: {shown(self.height)}, but a number above 0 m was wanted")

    def __call__(self, distance: Array) -> Array:
        """Return f(r), 1/m²."""
        return np.asarray(1.0 / (np.square(distance) + self.height**2))

    def over_edges(self, seen: Seen) -> OverEdge:
        """Return the integrals over edges: 1/m, 1/m² and 1/m²; in cells that are small, of f - 1/h².

        Seen from high above, f is nearly the same everywhere, and what it differs by would be lost.
        """
        d, s, e, near, far, size = seen
        square = self.height**2
        w = np.sqrt(d * d + square)
        angle = np.arctan2(w * (e - s), w * w + s * e)
        value = angle / w
        small = size < self.height
        if small.any():
            rest = _arctan_rest(e / w) - _arctan_rest(s / w)
            value = np.where(small, -(e - s) * (d / w) ** 2 / square - rest / w, value)
        low, high = near * near + square, far * far + square
        along = (s - e) * (s + e) / (low * high)
        across = -d / (w * w) * (e / high - s / low + angle / w)
        return OverEdge(value, along, across)

    def over_triangles(self, seen: Seen) -> Array:
        """Return the integrals over triangles, a number, by quadrature to rounding.

        In closed form there are dilogarithms, which cancel where a triangle is flat or seen from high above.
        """
        d, square = seen.distance, self.height**2
        w = np.sqrt(d * d + square)
        begin, end = np.arcsinh(seen.first / w), np.arcsinh(seen.last / w)
        panels = np.maximum(np.ceil((end - begin) / _PANEL), 1.0).astype(np.intp)
        edge = np.repeat(np.arange(len(d)), panels)
        number = np.arange(len(edge)) - np.repeat(np.cumsum(panels) - panels, panels)
        half = 0.5 * (end - begin) / panels
        middle = begin[edge] + half[edge] * (2 * number + 1)
        tau = middle[:, None] + half[edge, None] * _NODES
        wide = w[edge, None]
        s = wide * np.sinh(tau)
        r = (s * s + (d * d)[edge, None]) / square
        # log(1 + r²/h²)/r², which is 1/h² at the foot of the point
        integrand = np.log1p(r) / np.where(r > 0.0, r, 1.0)
        integrand[r == 0.0] = 1.0
        panel = (integrand * wide * np.cosh(tau) * _WEIGHTS).sum(axis=1) * half[edge]
        return 0.5 * d / square * np.bincount(edge, panel, minlength=len(d))


class CellSides:
    """The edges of n cells, ready to be seen from any points.

    Parameters
    ----------
    edges : CellEdges
    count : int
        n; cells without edges are empty.

    Attributes
    ----------
    normal_x, normal_y : (s,)
        Outward unit normals.
    size : (n,) m
        Half of each perimeter.
    area : (n,) m²
    """

    def __init__(self, edges: CellEdges, count: int) -> None:
        self.cell: IntArray = edges.cell
        self.count = count
        (x, y), (u, v) = edges.start.T, edges.end.T
        along_x, along_y = u - x, v - y
        self._length = np.sqrt(along_x * along_x + along_y * along_y)
        over = 1.0 / np.maximum(self._length, 1e-300)
        # the outward normal; the direction of the edge is (-normal_y, normal_x)
        self.normal_x, self.normal_y = along_y * over, -along_x * over
        n, m = self.normal_x, self.normal_y
        self._squares = n * n, n * m, m * m, 0.5 * (n - m) * (n + m)
        self._distance = x * self.normal_x + y * self.normal_y
        self._first = y * self.normal_x - x * self.normal_y
        self.size = 0.5 * self.summed(self._length)
        # an edge of no length but rounding has no direction either
        self._aside = self._length <= 1e-12 * self.size[self.cell]
        self.area = 0.5 * self.summed(self._distance * self._length)
        self._begins = np.flatnonzero(np.diff(self.cell, prepend=-1))

    def summed(self, values: Array) -> Array:
        """Return the sums over the edges of each cell, (n,), of values on edges, (s,)."""
        return np.bincount(self.cell, values, minlength=self.count).astype(np.float64, copy=False)

    def seen_from(self, x: Array, y: Array) -> Seen:
        """Return the edges as seen from a point for each cell, (n,) m each, relative to its generator."""
        at_x, at_y = x[self.cell], y[self.cell]
        distance = self._distance - (at_x * self.normal_x + at_y * self.normal_y)
        first = self._first - (at_y * self.normal_x - at_x * self.normal_y)
        last = first + self._length
        square = distance * distance
        near, far = np.sqrt(square + first * first), np.sqrt(square + last * last)
        return Seen(distance, first, last, near, far, self.size[self.cell])

    def room(self, seen: Seen) -> Array:
        """Return how far each point is inside its cell, (n,) m: negative outside, 0 in an empty cell.

        Of a cell that is not convex it is how far the point is inside the part that sees all of it.
        """
        found = np.zeros(self.count)
        distance = np.where(self._aside, np.inf, seen.distance)
        if len(distance):
            found[self.cell[self._begins]] = np.minimum.reduceat(distance, self._begins)
        return found

    def gradient(self, over: OverEdge) -> tuple[Array, Array]:
        """Return the two components of the gradients with respect to the points, (n,) each."""
        return -self.summed(self.normal_x * over.value), -self.summed(self.normal_y * over.value)

    def hessian(self, over: OverEdge) -> tuple[Array, Array, Array]:
        """Return the components xx, xy and yy of the Hessians with respect to the points, (n,) each."""
        xx, xy, yy, difference = self._squares
        mixed, across = over.along * xy, over.across
        return (
            self.summed(across * xx - mixed),
            # the mean of the two ways to write it, which are equal once they are summed round the cell
            self.summed(across * xy + over.along * difference),
            self.summed(across * yy + mixed),
        )


def value(edges: CellEdges, points: Array, f: Performance) -> Array:
    """Return the locational cost (4) of each cell: ∫ f(|q-p|) dq over it, (n,), with density 1.

    Parameters
    ----------
    edges : CellEdges
    points : (n, 2) m
        p for each cell, relative to the cell's generator: zeros are the generators themselves.
    f : Performance

    Examples
    --------
    >>> from robocov import Region, partition
    >>> square = Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    >>> cells = partition(np.array([[1.0, 1.0]]), square)
    >>> value(cells.edges, np.zeros((1, 2)), SquaredDistance()).round(6)
    array([2.666667])
    """
    sides = CellSides(edges, len(points))
    return sides.summed(f.over_triangles(sides.seen_from(*np.asarray(points, dtype=np.float64).T)))


def gradient(edges: CellEdges, points: Array, f: Performance) -> Array:
    """Return the gradient of `value` with respect to the points, (n, 2): equation (11) at the generators.

    As the cells move with their generators, this is also the gradient of the whole cost: what the boundary
    between two cells adds to one it takes from the other, (8)-(10). The parameters are those of `value`.
    """
    sides = CellSides(edges, len(points))
    over = f.over_edges(sides.seen_from(*np.asarray(points, dtype=np.float64).T))
    return np.column_stack(sides.gradient(over))


def hessian(edges: CellEdges, points: Array, f: Performance) -> Array:
    """Return the Hessian of `value` with respect to the points, (n, 2, 2); the cells stay where they are.

    The parameters are those of `value`.
    """
    sides = CellSides(edges, len(points))
    over = f.over_edges(sides.seen_from(*np.asarray(points, dtype=np.float64).T))
    xx, xy, yy = sides.hessian(over)
    return np.stack([np.column_stack([xx, xy]), np.column_stack([xy, yy])], axis=1)


def _inverse_over(seen: Seen) -> Array:
    """Return ∫ 1/r ds over the edges, (s,)."""
    d = np.maximum(np.abs(seen.distance), 1e-300)
    return np.asarray(np.arcsinh(seen.last / d) - np.arcsinh(seen.first / d))


def _arctan_rest(x: Array) -> Array:
    """Return x - atan x without cancellation where x is small."""
    square = x * x
    series = np.polynomial.polynomial.polyval(np.minimum(square, 0.0625), _ARCTAN_SERIES)
    return np.where(square < 0.0625, x * square * series, x - np.arctan(x))
