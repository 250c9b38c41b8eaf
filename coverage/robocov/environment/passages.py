"""The narrowest passage of a free space, to a micrometre.

A disc of growing radius can reach the same places, in the same ways, until its diameter
passes the width of a gap. At such a gap the distance to the walls has a saddle: two wall points
face each other, and the disc between them, with their segment as its diameter, holds no other.
One of the two is then a corner that juts into the free space, or both sides are parallel
and such a corner ends one of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.environment import GRID, SAGITTA
from robocov.robots import DEFAULT_RADIUS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array, BoolArray, IntArray

NEGLIGIBLE = math.pi * DEFAULT_RADIUS**2
"""A gap to a pocket smaller than this, in m², is none: no robot would go there."""

_CRACK = 2 * SAGITTA
"""Walls closer than this, in metres, touch: a circle that touches a wall is a polygon that nearly does."""

_CHUNK = 256
"""Corners that are looked at together, so that memory stays bounded."""

_DIGITS = 6
"""Results are rounded to the grid of the derived geometry, a micrometre."""


@dataclass(frozen=True)
class Gap:
    """A passage of the free space.

    Attributes
    ----------
    width : float, m
        Diameter of the largest disc that passes.
    between : two points (x, y), m
        Where the walls are closest to each other.
    """

    width: float
    between: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, eq=False)
class _Walls:
    """The e edges of the rings of a free space; the free space lies to the left of each.

    Attributes
    ----------
    start, end : (e, 2) m
    before : (e,)
        Index of the edge that ends where this one starts.
    ring : (e,)
        Index of the edge's ring.
    origin : (e, 2) m
        First vertex of the edge's ring.
    swept : (e,) m²
        Signed area that the ring sweeps about its origin up to the edge's start.
    total : (e,) m²
        Signed area of the edge's ring.
    jutting : (j,)
        The edges whose start is a corner that juts into the free space.
    """

    start: Array
    end: Array
    before: IntArray
    ring: IntArray
    origin: Array
    swept: Array
    total: Array
    jutting: IntArray


def narrowest_gap(free: MultiPolygon) -> Gap | None:
    """Return the narrowest passage of `free`, or None where there is none.

    A passage leads round an obstacle, or to a part of the free space that is neither smaller
    than `NEGLIGIBLE` nor smaller than the square over the gap: a niche that is shallower than
    wide is none, and nor is an acute corner.

    Parameters
    ----------
    free : MultiPolygon
        Disjoint polygons, counter-clockwise.

    Examples
    --------
    >>> room = shapely.box(0, 0, 6, 3) - shapely.box(2.9, 1, 3.1, 2.2)
    >>> narrowest_gap(shapely.MultiPolygon([room])).width
    0.8
    """
    search = _Search.of(free)
    if search is None:
        return None
    low_x, low_y, high_x, high_y = search.free.bounds
    largest = math.hypot(high_x - low_x, high_y - low_y)
    best: Gap | None = None
    below, reach = _CRACK / 2, largest / 4096
    # most maps have a gap far narrower than the map is wide: look near first
    while best is None and below < largest:
        for corners in search.chunks():
            found = next(search.gaps(corners, below, reach if best is None else best.width), None)
            best = found or best
        below, reach = reach, 2 * reach
    return best


def gaps_narrower(free: MultiPolygon, width: float) -> tuple[Gap, ...]:
    """Return all passages of `free` that are narrower than a width in metres, the narrowest first.

    The first is as wide as `narrowest_gap`. One passage may be found several times, as at all corners of a
    door.

    Examples
    --------
    >>> room = shapely.box(0, 0, 6, 3) - shapely.box(2.9, 1, 3.1, 2.2)
    >>> {gap.width for gap in gaps_narrower(shapely.MultiPolygon([room]), 1.5)}
    {0.8, 1.0}
    """
    search = _Search.of(free)
    if search is None:
        return ()
    found = {gap for corners in search.chunks() for gap in search.gaps(corners, _CRACK / 2, width)}
    return tuple(sorted(found, key=lambda gap: (gap.width, gap.between)))


@dataclass(frozen=True, eq=False)
class _Search:
    """Where passages are looked for.

    Attributes
    ----------
    free : MultiPolygon
        Without cracks, prepared.
    boundary : geometry
        Of `free`, prepared.
    walls : _Walls
    tree : STRtree
        Boxes of the walls' edges.
    """

    free: MultiPolygon
    boundary: BaseGeometry
    walls: _Walls
    tree: shapely.STRtree

    @classmethod
    def of(cls, free: MultiPolygon) -> _Search | None:
        """Return the search in a free space; None where it is empty."""
        free = _without_cracks(free)
        if free.is_empty:
            return None
        walls = _walls(free)
        # boxes: the index needs no more, and they are made in one call
        low, high = np.minimum(walls.start, walls.end), np.maximum(walls.start, walls.end)
        tree = shapely.STRtree(shapely.box(*low.T, *high.T))
        boundary = free.boundary
        shapely.prepare(boundary)
        shapely.prepare(free)
        return cls(free, boundary, walls, tree)

    def chunks(self) -> list[IntArray]:
        """Return the corners that jut into the free space, some at a time."""
        jutting = self.walls.jutting
        return np.array_split(jutting, math.ceil(len(jutting) / _CHUNK)) if len(jutting) else []

    def gaps(self, corners: IntArray, below: float, limit: float) -> Iterator[Gap]:
        """Yield the passages at some corners, wider than `below` and narrower than `limit`, by width."""
        at = self.walls.start[corners]
        corner, edge = self.tree.query(shapely.box(*(at - limit).T, *(at + limit).T))
        return _gaps(self.walls, corners[corner], edge, below, limit, self.boundary, self.free)


def _without_cracks(free: MultiPolygon) -> MultiPolygon:
    """Return `free` without the parts that are narrower than `_CRACK`.

    What touches there becomes one wall, and stays apart by a nanometre so that it does not touch
    in a point again. Corners of less than a degree are cut, vertices that bend a wall by less than
    a micrometre go, everything else comes back as it was.
    """
    for distance in (-_CRACK / 2, _CRACK / 2 - 1e-9):
        free = free.buffer(distance, join_style="mitre", mitre_limit=100.0)
    free = free.simplify(GRID)
    return MultiPolygon([shapely.orient_polygons(part) for part in shapely.get_parts(free)])


def _walls(free: MultiPolygon) -> _Walls:
    parts: list[tuple[Array | IntArray, ...]] = []
    count = 0
    for index, ring in enumerate(ring for part in free.geoms for ring in (part.exterior, *part.interiors)):
        start = np.asarray(ring.coords)[:-1]
        end = np.roll(start, -1, axis=0)
        origin = np.broadcast_to(start[0], start.shape)
        area = _cross(start - origin, end - origin) / 2
        turn = _cross(start - np.roll(start, 1, axis=0), end - start)
        parts.append(
            (
                start,
                end,
                count + np.roll(np.arange(len(start)), 1),
                np.full(len(start), index),
                origin,
                np.cumsum(area) - area,
                np.full(len(start), area.sum()),
                count + np.flatnonzero(turn < 0),
            )
        )
        count += len(start)
    return _Walls(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _gaps(
    walls: _Walls,
    corner: IntArray,
    edge: IntArray,
    below: float,
    limit: float,
    boundary: BaseGeometry,
    free: MultiPolygon,
) -> Iterator[Gap]:
    """Yield the passages between the corners and the edges paired with them, by width.

    Only passages wider than `below` and narrower than `limit` are looked for.
    """
    p = walls.start[corner]
    along = walls.end[edge] - walls.start[edge]
    part = np.einsum("kd,kd->k", p - walls.start[edge], along) / np.einsum("kd,kd->k", along, along)
    q = walls.start[edge] + np.clip(part, 0.0, 1.0)[:, None] * along
    width = np.hypot(*(q - p).T)
    wanted = (width > below) & (width < limit)
    # the sides of the corner may not lean into the disc
    for side in (walls.start[walls.before[corner]], walls.end[corner]):
        wanted &= np.einsum("kd,kd->k", side - p, q - p) <= 1e-9 * width * np.hypot(*(side - p).T)
    p, q, width, corner, edge = p[wanted], q[wanted], width[wanted], corner[wanted], edge[wanted]
    passage = _leads_on(walls, corner, edge, p, q, width)
    p, q, width = p[passage], q[passage], width[passage]
    order = np.argsort(width, kind="stable")
    for some in np.array_split(order, max(1, len(order) // 512)):
        middle = shapely.points((p[some] + q[some]) / 2)
        # prepared, which `shapely.distance` would not be: it takes thousands of walls to see the difference
        empty = ~shapely.dwithin(boundary, middle, width[some] / 2 * (1 - 1e-9) - 1e-12)
        empty[empty] = shapely.contains_properly(free, middle[empty])
        for k in some[empty].tolist():
            ends = sorted(_rounded(point) for point in (p[k], q[k]))
            yield Gap(round(float(width[k]), _DIGITS), (ends[0], ends[1]))


def _rounded(point: Array) -> tuple[float, float]:
    return round(float(point[0]), _DIGITS), round(float(point[1]), _DIGITS)


def _leads_on(walls: _Walls, corner: IntArray, edge: IntArray, p: Array, q: Array, width: Array) -> BoolArray:
    """Return whether the gaps from corner points p to edge points q lead to more than a pocket.

    A cut between two rings separates nothing: the way round is another one. A cut from a ring
    to itself separates the part that the ring sweeps between the two points.
    """

    def swept(index: IntArray, point: Array) -> Array:
        origin = walls.origin[index]
        return walls.swept[index] + _cross(walls.start[index] - origin, point - origin) / 2

    origin = walls.origin[corner]
    total = walls.total[corner]
    between = swept(edge, q) - swept(corner, p) + _cross(q - origin, p - origin) / 2
    between = np.where(edge < corner, total + between, between)
    sides = np.stack([between, total - between])
    # outside a hole's ring there is no pocket: only the side of positive area is one
    pocket = np.where(sides > 0, sides, np.inf).min(axis=0)
    around = walls.ring[corner] != walls.ring[edge]
    return np.asarray(around | (pocket >= np.maximum(NEGLIGIBLE, width * width)))
