"""Voronoi cells of all robots at once, in closed form on the edges of the Delaunay triangulation.

The path for teams in which everybody hears everybody. A few numpy calls on small arrays make one
partition, so each call counts; plane vectors are complex numbers, ``x + i y``, which halves the calls.

Let i, j be the ends of a Delaunay edge, d = p_j - p_i, and m their midpoint. The bisector is the line
m + t i d / 2, and the circumcentre of a triangle on either side lies on it, as far out as the cotangent
of the angle opposite the edge says: t = dot / cross of the two sides at that apex. So no circumcentre
is computed, a sliver's lies far away on the right side, and what a rounding error in t shifts is weighed
by the length |d|² that belongs to it. A hull edge has one side only: t is infinite on the other.

The convex region limits t (Cyrus-Beck), and the points where it does so divide the region's boundary
into pieces. Each Voronoi edge, and each piece, adds to its cell the triangle that it spans with the
generator.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay, QhullError

from robocov.arrays import Array, IntArray
from robocov.cell_edges import REGION, CellEdges
from robocov.region import Region

ComplexArray: TypeAlias = NDArray[np.complex128]

_QHULL_OPTIONS = "Qbb Q5"
"""As scipy's, without the point at infinity (Qz), which only a team on one circle needs, without leave to
return doubtful facets (Q12), without the list of points left out (Qc): their cells have no mass; and
without widening the facets for printing (Q5)."""

_TOLERANCE = 1e-12
"""How far the masses may miss the region's area, relative to it."""

_CLOSEST = 1e-5
"""Generators closer to each other than this, relative to the region's diameter, are left to the other
path: coordinates about the region's centroid round their bisector's direction."""

_SMALLEST_CROSS = 1e-200
"""Cross product of a flat triangle's sides: its circumcentre is far away, on the apex's side."""


class Sides(NamedTuple):
    """The Voronoi edges between two cells.

    Attributes
    ----------
    ends : (2, e)
        The robots i and j of each Delaunay edge.
    difference : (e,) m
        d = p_j - p_i.
    reach : (2, e)
        How far the Voronoi edge extends from the midpoint to the left of d and to the right, in |d| / 2.
    width : (e,)
        The sum of the two, zero where the Voronoi edge lies outside the region.
    """

    ends: IntArray
    difference: ComplexArray
    reach: Array
    width: Array


class Pieces(NamedTuple):
    """The pieces of the region's boundary, counter-clockwise.

    Attributes
    ----------
    owner : (b,)
        Whose cell each belongs to.
    start, end : (b,) m
        Relative to the owner's generator.
    """

    owner: IntArray
    start: ComplexArray
    end: ComplexArray


@dataclass(frozen=True, slots=True, eq=False)
class DelaunayCells:
    """The cells of one partition.

    Attributes
    ----------
    mass : (n,) m²
    centroid : (n, 2) m
    sides : Sides
    pieces : Pieces
    """

    mass: Array
    centroid: Array
    sides: Sides
    pieces: Pieces

    def edges(self, generators: Array) -> CellEdges:
        """Return the edges of the cells, in order round each cell's centroid."""
        live = self.sides.width > 0.0
        i, j = self.sides.ends[:, live]
        half = 0.5 * self.sides.difference[live]
        left, right = 1j * half * self.sides.reach[0, live], -1j * half * self.sides.reach[1, live]
        owner, piece_start, piece_end = self.pieces
        start = np.concatenate([half + right, left - half, piece_start])
        end = np.concatenate([half + left, right - half, piece_end])
        cell = np.concatenate([i, j, owner])
        beyond = np.concatenate([j, i, np.full(len(owner), REGION)])
        # about the centroid, which lies well inside even when the generator is on the cell's boundary
        middle = 0.5 * (start + end) - _complex(self.centroid - generators)[cell]
        order = np.lexsort((np.arctan2(middle.imag, middle.real), cell))
        return CellEdges(_real(start[order]), _real(end[order]), cell[order], beyond[order])


def delaunay_cells(generators: Array, region: Region) -> DelaunayCells | None:
    """Return the cells V_i of equation (1) within `region`, or None where only clipping is safe.

    That is when the generators are collinear, coincident, nearly so for Qhull's arithmetic, outside the
    region, or when a Voronoi vertex lies on the region's boundary so closely that rounding decides.

    Parameters
    ----------
    generators : (n, 2) m
        C-contiguous. Fewer than four cannot be triangulated here.
    """
    frame = _frame(region)
    z = _complex(generators) - frame.origin
    try:
        triangulation = Delaunay(_real(z), qhull_options=_QHULL_OPTIONS)
    except (QhullError, ValueError):
        return None
    ends, apexes, hull = _paired_edges(triangulation.simplices, triangulation.neighbors)
    p = z.take(ends)
    difference = p[1] - p[0]
    reach = _cotangents(p, z.take(apexes, mode="clip"))
    np.putmask(reach[1], hull, np.inf)

    limits = frame.limits(p[0] + p[1], difference)
    if limits is None:
        return None
    cut = reach >= limits
    np.minimum(reach, limits, out=reach)
    width = reach[0] + reach[1]
    np.maximum(width, 0.0, out=width)
    cut &= width > 0.0
    pieces = _boundary_pieces(z, ends.ravel(), limits.ravel(), cut.ravel().nonzero()[0], frame)
    if pieces is None:
        return None
    squares = difference.view(np.float64)
    squares = squares * squares
    square = squares[::2] + squares[1::2]
    if np.minimum.reduce(square) < frame.closest:
        return None
    sides = Sides(ends, difference, reach, width)
    sums = _mass_and_centroid(sides, square, pieces, generators, frame)
    return None if sums is None else DelaunayCells(*sums, sides, pieces)


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """The region about its centroid.

    Attributes
    ----------
    origin : complex, m
        The centroid: coordinates about it are as small as they can be.
    area : float, m²
    closest : float, m²
        Square of the distance below which two generators are left to the other path.
    corners : (k,) m and angles : (k,) rad
        Sorted by the angle about the origin.
    normals, turned : (k, 2)
        The outward normals n, and the matrix that takes d to n · i d.
    offsets : (k, 1) m
        Twice the distances of the edges' lines from the origin.
    """

    origin: complex
    area: float
    closest: float
    corners: ComplexArray
    angles: Array
    normals: Array
    turned: Array
    offsets: Array

    def limits(self, middles: ComplexArray, directions: ComplexArray) -> Array | None:
        """Return how far one can go from m along i d and along -i d, (2, e), in |d| / 2; None outside.

        `middles` is twice m.
        """
        size = middles.size
        room = self.normals @ _real(middles).T
        np.subtract(self.offsets, room, out=room)
        if np.minimum.reduce(room, axis=None) <= 0.0:
            return None
        speed = self.turned @ _real(directions).T
        speed /= room
        limits = np.empty((2, size))
        np.maximum.reduce(speed, axis=0, out=limits[0])
        np.minimum.reduce(speed, axis=0, out=limits[1])
        np.divide(_SIGNS, limits, out=limits)
        return limits


_SIGNS = np.array([[1.0], [-1.0]])


@lru_cache(maxsize=16)
def _frame(region: Region) -> _Frame:
    corners = _complex(region.vertices - region.centroid)
    angles = np.arctan2(corners.imag, corners.real)
    order = angles.argsort()
    normals = region.normals
    return _Frame(
        origin=complex(*region.centroid),
        area=region.area,
        closest=(_CLOSEST * region.diameter) ** 2,
        corners=corners[order],
        angles=angles[order],
        normals=normals,
        turned=np.column_stack([normals[:, 1], -normals[:, 0]]),
        offsets=2.0 * (region.offsets - normals @ region.centroid)[:, None],
    )


@lru_cache(maxsize=8)
def _half_edge_tables(capacity: int) -> tuple[IntArray, NDArray[np.uint32]]:
    """Return, for the half-edge opposite corner k of triangle t, number 3 t + k, its ends and its triangle.

    The ends are numbers of corners, (2, 3 capacity): the next and the last corner counter-clockwise.
    """
    corner = np.arange(3 * capacity)
    triangle = corner // 3 * 3
    ends = np.stack([triangle + (corner + 1) % 3, triangle + (corner + 2) % 3])
    return ends, (corner // 3).astype(np.uint32).reshape(-1, 3)


def _paired_edges(
    simplices: NDArray[np.int32], neighbours: NDArray[np.int32]
) -> tuple[IntArray, IntArray, NDArray[np.bool_]]:
    """Return each Delaunay edge once: its ends (2, e), the apexes left and right of it (2, e), the hull (e,).

    Scipy's triangles are counter-clockwise, and neighbour k lies beyond the edge opposite corner k.
    The apex right of a hull edge means nothing, and may be no index at all.
    """
    count = len(simplices)
    table, triangle = _half_edge_tables(1 << count.bit_length())
    # of the two half-edges of an edge the one in the triangle of lower number; -1 as unsigned is the largest
    half = (neighbours.view(np.uint32) > triangle[:count]).ravel().nonzero()[0]
    corners = simplices.astype(np.intp)
    flat = corners.ravel()
    ends = flat.take(table.take(half, axis=1))
    apexes = np.empty_like(ends)
    flat.take(half, out=apexes[0], mode="clip")
    across = neighbours.ravel().take(half)
    total = corners[:, 0] + corners[:, 1]
    total += corners[:, 2]
    far = total.take(across)
    far -= ends[0]
    np.subtract(far, ends[1], out=apexes[1])
    return ends, apexes, across < 0


def _cotangents(p: ComplexArray, apexes: ComplexArray) -> Array:
    """Return the cotangents of the angles at the apexes, (2, e); overwrites `apexes`."""
    first = p - apexes
    second = np.subtract(p[::-1], apexes, out=apexes)
    np.conjugate(first, out=first)
    first *= second
    return np.asarray(first.real / np.maximum(first.imag, _SMALLEST_CROSS))


def _boundary_pieces(
    z: ComplexArray, ends: IntArray, limits: Array, cut: IntArray, frame: _Frame
) -> Pieces | None:
    """Return owners, starts and ends (relative to their owners) of the boundary's pieces.

    `cut` numbers the half edges that end on the boundary. Counter-clockwise along it, the cell of the
    half edge's own robot follows. None when the cells on both sides of a piece disagree.
    """
    after = ends.take(cut)
    before = ends.take(cut + ends.size // 2, mode="wrap")
    a, b = z.take(after), z.take(before)
    at = limits.take(cut) * (b - a)
    at *= 1j
    at += a
    at += b
    at *= 0.5
    angles = np.arctan2(at.imag, at.real)
    order = angles.argsort()
    angles = angles.take(order)
    after = after.take(order)
    before = before.take(order)
    if not cut.size or after[-1] != before[0] or np.count_nonzero(after[:-1] != before[1:]):
        return None
    # the corners in between belong to the owner of the last crossing; before the first crossing, index -1
    owner = np.concatenate([after, after.take(angles.searchsorted(frame.angles, "right") - 1)])
    stops = np.concatenate([at.take(order), frame.corners])
    order = np.concatenate([angles, frame.angles]).argsort()
    owner = owner.take(order)
    p = z.take(owner)
    start = stops.take(order)
    end = np.concatenate([start[1:], start[:1]])
    start -= p
    end -= p
    return Pieces(owner, start, end)


def _mass_and_centroid(
    sides: Sides, square: Array, pieces: Pieces, generators: Array, frame: _Frame
) -> tuple[Array, Array] | None:
    """Return the areas (n,) m² and centroids (n, 2) m; None when the cells do not tile the region.

    `square` is |d|². Of the triangle that an edge spans with p_i, eight times the area is |d|² width,
    and the centroid is p_i + (d + i d skew / 2) / 3, where skew is the left reach less the right one;
    seen from p_j, d changes its sign in the first term alone.
    """
    ends, difference, reach, width = sides
    owner, start, end = pieces
    n, count = len(generators), square.size
    area = square * width
    piece_area = (np.conjugate(start) * end).imag
    piece_area *= 4.0
    moment = np.empty(2 * count + owner.size, dtype=np.complex128)
    edge_moment = moment[: 2 * count].reshape(2, count)
    along, across = edge_moment.real, edge_moment.imag
    along[0] = area
    np.negative(area, out=along[1])
    skew = reach[0] - reach[1]
    skew *= 0.5
    np.multiply(skew, area, out=across)
    edge_moment *= difference
    np.multiply(start + end, piece_area, out=moment[2 * count :])

    cell = np.concatenate([ends.ravel(), owner])
    mass = np.asarray(np.bincount(cell, np.concatenate([area, area, piece_area]), n), dtype=np.float64)
    mass *= 0.125
    if abs(np.add.reduce(mass) - frame.area) > _TOLERANCE * frame.area or np.count_nonzero(mass) < n:
        return None
    centroid = np.empty((n, 2))
    divisor = mass * 24.0
    np.divide(np.bincount(cell, moment.real, n), divisor, out=centroid[:, 0])
    np.divide(np.bincount(cell, moment.imag, n), divisor, out=centroid[:, 1])
    centroid += generators
    return mass, centroid


def _complex(points: Array) -> ComplexArray:
    return points.view(np.complex128).ravel()


def _real(z: ComplexArray) -> Array:
    return z.view(np.float64).reshape(-1, 2)
