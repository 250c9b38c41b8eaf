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


def narrowest_gap(free: MultiPolygon) -> Gap | None:
    """Return the narrowest passage of `free`, or None where there is none.

    A passage leads round an obstacle, or to a part of the free space that is neither smaller
    than `NEGLIGIBLE` nor smaller than the square over the gap: a niche that is shallower than
    wide is none, and nor is an acute corner.

    `free` is disjoint polygons, counter-clockwise.

    >>> room = shapely.box(0, 0, 6, 3) - shapely.box(2.9, 1, 3.1, 2.2)
    >>> narrowest_gap(shapely.MultiPolygon([room])).width
    0.8
    """
    search = _Search(free)
    if search.free.is_empty:
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

    >>> room = shapely.box(0, 0, 6, 3) - shapely.box(2.9, 1, 3.1, 2.2)
    >>> {gap.width for gap in gaps_narrower(shapely.MultiPolygon([room]), 1.5)}
    {0.8, 1.0}
    """
    search = _Search(free)
    found = {gap for corners in search.chunks() for gap in search.gaps(corners, _CRACK / 2, width)}
    return tuple(sorted(found, key=lambda gap: (gap.width, gap.between)))


class _Search:
    """The e edges of a free space among which passages are looked for; it lies to the left of each."""

    def __init__(self, free: MultiPolygon) -> None:
        self.free = free = _without_cracks(free)
        self.boundary = free.boundary
        shapely.prepare(self.boundary)
        shapely.prepare(free)
        rings = [
            np.asarray(ring.coords)[:-1] for part in free.geoms for ring in (part.exterior, *part.interiors)
        ]
        sizes = np.array([len(ring) for ring in rings], dtype=np.intp)
        self.ring = np.repeat(np.arange(len(rings)), sizes)
        self.start = np.concatenate([np.empty((0, 2)), *rings])
        self.end = np.concatenate([np.empty((0, 2)), *(np.roll(ring, -1, axis=0) for ring in rings)])
        # the edge that ends where each one starts
        last = np.cumsum(sizes) - 1
        first = last - sizes + 1
        self.before = np.arange(len(self.start)) - 1
        self.before[first] = last
        # the first vertex of each edge's ring, and the area, m², that the ring sweeps about it: up to the
        # edge's start, and in all
        self.origin = self.start[first][self.ring]
        area = _cross(self.start - self.origin, self.end - self.origin) / 2
        sums = [np.cumsum(part) for part in np.split(area, first[1:])] if rings else []
        self.swept = np.concatenate([np.empty(0), *sums]) - area
        self.total = np.array([part[-1] for part in sums])[self.ring] if rings else area
        # the edges whose start is a corner that juts into the free space
        turn = _cross(self.start - self.start[self.before], self.end - self.start)
        self.jutting = np.flatnonzero(turn < 0)
        # boxes: the index needs no more, and they are made in one call
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        self.tree = shapely.STRtree(shapely.box(*low.T, *high.T))

    def chunks(self) -> list[IntArray]:
        """Return the corners that jut into the free space, some at a time."""
        corners = self.jutting
        return np.array_split(corners, math.ceil(len(corners) / _CHUNK)) if len(corners) else []

    def gaps(self, corners: IntArray, below: float, limit: float) -> Iterator[Gap]:
        """Yield the passages at some corners, wider than `below` and narrower than `limit`, by width."""
        at = self.start[corners]
        row, edge = self.tree.query(shapely.box(*(at - limit).T, *(at + limit).T))
        corner = corners[row]
        p = self.start[corner]
        along = self.end[edge] - self.start[edge]
        part = np.einsum("kd,kd->k", p - self.start[edge], along) / np.einsum("kd,kd->k", along, along)
        q = self.start[edge] + np.clip(part, 0.0, 1.0)[:, None] * along
        width = np.hypot(*(q - p).T)
        wanted = (width > below) & (width < limit)
        # the sides of the corner may not lean into the disc
        for side in (self.start[self.before[corner]], self.end[corner]):
            wanted &= np.einsum("kd,kd->k", side - p, q - p) <= 1e-9 * width * np.hypot(*(side - p).T)
        p, q, width, corner, edge = p[wanted], q[wanted], width[wanted], corner[wanted], edge[wanted]
        passage = self._leads_on(corner, edge, p, q, width)
        p, q, width = p[passage], q[passage], width[passage]
        order = np.argsort(width, kind="stable")
        for some in np.array_split(order, max(1, len(order) // 512)):
            middle = shapely.points((p[some] + q[some]) / 2)
            # prepared, which `shapely.distance` would not be: of thousands of walls that makes a difference
            empty = ~shapely.dwithin(self.boundary, middle, width[some] / 2 * (1 - 1e-9) - 1e-12)
            empty[empty] = shapely.contains_properly(self.free, middle[empty])
            for k in some[empty].tolist():
                ends = sorted(
                    (round(x, _DIGITS), round(y, _DIGITS)) for x, y in (p[k].tolist(), q[k].tolist())
                )
                yield Gap(round(float(width[k]), _DIGITS), (ends[0], ends[1]))

    def _leads_on(self, corner: IntArray, edge: IntArray, p: Array, q: Array, width: Array) -> BoolArray:
        """Return whether the gaps from corner points p to edge points q lead to more than a pocket.

        A cut between two rings separates nothing: the way round is another one. A cut from a ring
        to itself separates the part that the ring sweeps between the two points.
        """

        def swept(index: IntArray, point: Array) -> Array:
            origin = self.origin[index]
            return self.swept[index] + _cross(self.start[index] - origin, point - origin) / 2

        origin, total = self.origin[corner], self.total[corner]
        between = swept(edge, q) - swept(corner, p) + _cross(q - origin, p - origin) / 2
        between = np.where(edge < corner, total + between, between)
        sides = np.stack([between, total - between])
        # outside a hole's ring there is no pocket: only the side of positive area is one
        pocket = np.where(sides > 0, sides, np.inf).min(axis=0)
        around = self.ring[corner] != self.ring[edge]
        return np.asarray(around | (pocket >= np.maximum(NEGLIGIBLE, width * width)))


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


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
