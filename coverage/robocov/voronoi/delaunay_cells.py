"""Voronoi cells of all robots at once, in closed form on the edges of the Delaunay triangulation.

The path for teams in which everybody hears everybody. A few numpy calls on small arrays make one
partition, so each call counts; plane vectors are complex numbers, ``x + i y``, which halves the calls.

Let i, j be the ends of a Delaunay edge, d = p_j - p_i, and m their midpoint. The bisector is the line
m + t i d / 2, and the circumcentre of a triangle on either side lies on it, as far out as the cotangent
of the angle opposite the edge says: t = dot / cross of the two sides at that apex. So no circumcentre
is computed, and what a rounding error in t shifts is weighed by the length |d|² that belongs to it.

The convex region limits t (Cyrus-Beck), and the points where it does so divide the region's boundary
into pieces. Each Voronoi edge, and each piece, adds to its cell the triangle that it spans with the
generator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, ComplexArray, IntArray
from robocov.observation.region import Region
from robocov.voronoi.cell_edges import REGION, CellEdges
from robocov.voronoi.triangulation import SENTINELS, Fitted, Triangulation, triangulated

_TOLERANCE = 1e-12
"""How far the masses may miss the region's area, relative to it."""

_CLOSEST = 1e-5
"""Generators closer to each other than this, relative to the region's diameter, are left to the other
path: coordinates about the region's centroid round their bisector's direction."""

_SENTINELS_AT = 5.0
"""Distance of the sentinels from the region's centroid, in times the farthest corner's."""

_ROBOTS_WITHIN = 2.0
"""How far out robots may be, in the same measure: no sentinel then cuts a cell within the region, and all
robots lie well within the triangle of the sentinels."""


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
    triangulation : Triangulation
        Of the robots, from which the cells were read.
    """

    mass: Array
    centroid: Array
    sides: Sides
    pieces: Pieces
    triangulation: Triangulation

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


def delaunay_cells(
    generators: Array, region: Region, warm: Triangulation | None = None
) -> DelaunayCells | None:
    """Return the cells V_i of equation (1) within `region`, or None where only clipping is safe.

    That is when generators coincide, or nearly so for this arithmetic, when they are outside the region,
    or when a Voronoi vertex lies on the region's boundary so closely that rounding decides.

    Parameters
    ----------
    generators : (n, 2) m
        C-contiguous.
    warm : Triangulation or None
        Of cells before, from which to start.
    """
    frame = _frame(region)
    z = frame.points(generators)
    if z is None:
        return None
    fitted = triangulated(z, warm)
    if fitted is None:
        return None
    ends, p, reach = _between_robots(fitted)
    difference = p[1] - p[0]
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
    return None if sums is None else DelaunayCells(*sums, sides, pieces, fitted.triangulation)


def _between_robots(fitted: Fitted) -> tuple[IntArray, ComplexArray, Array]:
    """Return the edges among robots: ends, their places, and the cotangents at the apexes, (2, e) each."""
    ends = fitted.triangulation.ends
    count = int(ends[1].searchsorted(fitted.triangulation.robots))
    angles = fitted.angles[:, :count]
    return ends[:, :count], fitted.places[:, :count], np.asarray(angles.real / angles.imag)


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
    farthest : float, m
        Largest coordinate with which a generator is not left to the other path.
    sentinels : (3,) m
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
    farthest: float
    sentinels: ComplexArray
    corners: ComplexArray
    angles: Array
    normals: Array
    turned: Array
    offsets: Array

    def points(self, generators: Array) -> ComplexArray | None:
        """Return generators and sentinels about the origin, (n + 3,) m; None when a generator is far out."""
        z = np.concatenate([_complex(generators), self.sentinels])
        z[:-SENTINELS] -= self.origin
        size = np.maximum.reduce(np.abs(z[:-SENTINELS].view(np.float64)), initial=0.0)
        # not a number fails too
        return z if size <= self.farthest else None

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
    radius = float(np.abs(corners).max())
    turns = 1j * (0.3 + 2.0 * np.pi / 3.0 * np.arange(3))
    return _Frame(
        origin=complex(*region.centroid),
        area=region.area,
        closest=(_CLOSEST * region.diameter) ** 2,
        farthest=_ROBOTS_WITHIN * radius / math.sqrt(2.0),
        sentinels=np.asarray(_SENTINELS_AT * radius * np.exp(turns), dtype=np.complex128),
        corners=corners[order],
        angles=angles[order],
        normals=normals,
        turned=np.column_stack([normals[:, 1], -normals[:, 0]]),
        offsets=2.0 * (region.offsets - normals @ region.centroid)[:, None],
    )


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
