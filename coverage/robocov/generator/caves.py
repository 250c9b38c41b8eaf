"""Maps of the kind `caves`: chambers and tunnels between smooth walls of rock, and pillars.

Where the middle of a robot may be is what a random field leaves below a level (`robocov.generator.contours`),
raised along the boundary. Its parts are joined by tunnels, and all of it is widened by a radius of at
least half the gap (a dilation: J. Serra, *Image Analysis and Mathematical Morphology*, 1982), so that a disc
of that radius gets everywhere. Where two parts of it then meet in a window that is narrower, a tunnel is led
through that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, MultiPolygon, Point, Polygon

from robocov.environment import PolygonObstacle
from robocov.environment.passages import narrowest_gap
from robocov.generator.contours import Field
from robocov.generator.request import AREA_TOLERANCE

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from robocov.environment import Obstacle
    from robocov.environment.passages import Gap
    from robocov.environment.starts import DiscStart
    from robocov.generator.request import Request

_RIM = 0.012
"""Least thickness of rock at the boundary, in shorter sides of the map; the disc of the start keeps more."""

_SHORE, _RAISED = 0.35, 3.0
"""Width of the belt along the boundary where rock is likelier, in sides of a usual chamber, and how much."""

_HALL, _LOWERED = 0.35, 1.5
"""Radius of the place around the start where it is less likely, and how much."""

_FINE, _FINEST = 0.008, 0.0027
"""Walls are simplified by so much: in sides of a usual chamber, and at most in shorter sides of the map."""

_CHAMBER, _PILLAR = 0.03, 0.02
"""Least area of a part of the field that becomes a chamber, and of a pillar, in squares of usual chambers."""

_SPIKE = 0.05
"""Spikes of rock of half that thickness are rounded off, in sides of a usual chamber."""

_BEND = 0.25
"""Tunnels bend by at most so much of their length."""

_USUAL, _WIDEST = 1.2, 2.0
"""Radius by which the level is chosen, and the largest, in the least ones."""

_LEVELS, _RADII, _WINDOWS = 8, 12, 12
"""Halvings of the level and of the radius, and windows that are widened before a draw is given up."""

_CLOSE = 0.5
"""Part of the tolerance of the blocked area that is made use of; rounding takes of the rest."""


@dataclass(frozen=True)
class _Site:
    """What a cave is made to fit.

    Attributes
    ----------
    request : Request
    fine : float, m
        By so much walls are simplified.
    radius : float, m
        Least radius by which is widened where the middle may be: half a gap, and what is lost of it when
        walls are simplified and rounded.
    start : Polygon
        The disc of the start, and a little more, so that the disc is left of it then.
    """

    request: Request
    fine: float
    radius: float
    start: Polygon

    @classmethod
    def of(cls, request: Request, corner: DiscStart) -> _Site:
        """Return that of what was asked for, with the start in the corner."""
        fine = min(_FINE * request.unit, _FINEST * min(request.width, request.height))
        lost = fine + 2.0 * request.step
        start = Point(corner.center).buffer(corner.radius + 2.0 * lost)
        site = cls(request, fine, request.gap / 2.0 + lost, start)
        return replace(site, start=start.intersection(site.inside(0.0)))

    def inside(self, distance: float) -> Polygon:
        """Return the map without what is nearer to the boundary than its rim and a distance, m."""
        off = _RIM * min(self.request.width, self.request.height) + distance
        return shapely.box(off, off, self.request.width - off, self.request.height - off)

    def core(self, below: BaseGeometry, rng: np.random.Generator) -> BaseGeometry:
        """Return where the middle of a robot may be: what is below the level, in one piece."""
        unit = self.request.unit
        inside = self.inside(self.radius)
        below = shapely.simplify(below, self.fine).intersection(inside)
        parts = [part for part in shapely.get_parts(below) if part.area >= _CHAMBER * unit**2]
        start = self.start.buffer(-self.radius)
        whole = shapely.union_all([*parts, self.start.centroid if start.is_empty else start])
        return shapely.union_all([whole, *_tunnels([*shapely.get_parts(whole)], rng)])

    def free(self, core: BaseGeometry, radius: float) -> Polygon:
        """Return the free space: what is nearer to the core than a radius, with smooth walls."""
        unit = self.request.unit
        spike = _SPIKE * unit
        wide = core.buffer(radius + spike).buffer(-spike).intersection(self.inside(0.0)) | self.start
        outer = max(shapely.get_parts(wide), key=lambda part: float(part.area))
        pillars = [ring for ring in outer.interiors if Polygon(ring).area >= _PILLAR * unit**2]
        return shapely.simplify(Polygon(outer.exterior, pillars), self.fine)

    def blocked(self, free: Polygon) -> float:
        """Return the area that is not free, as a part of the map's."""
        return 1.0 - float(free.area) / (self.request.width * self.request.height)


def cave(request: Request, corner: DiscStart, rng: np.random.Generator) -> list[Obstacle] | None:
    """Return the rock around a cave and the pillars in it; None where a draw leads nowhere.

    The level is chosen first, by halving, so that about as much is blocked as is wanted, then the radius
    so that it is.
    """
    site = _Site.of(request, corner)
    if site.inside(2.0 * site.radius).is_empty:
        return None
    field = Field.drawn(request, rng).raised(_SHORE * request.unit, _RAISED)
    field = field.lowered(corner.center, _HALL * request.unit, _LOWERED)
    seed = int(rng.integers(2**32))

    def core(level: float) -> BaseGeometry:
        return site.core(field.below(level), np.random.default_rng(seed))

    low, high = field.range
    for _ in range(_LEVELS):
        level = (low + high) / 2.0
        more = site.blocked(site.free(core(level), _USUAL * site.radius)) > request.area
        low, high = (level, high) if more else (low, level)
    middle = core((low + high) / 2.0)
    for _ in range(_WINDOWS):
        radius = _radius(site, middle)
        free = _rounded(request, site.free(middle, radius))
        if abs(site.blocked(free) - request.area) > _CLOSE * AREA_TOLERANCE:
            return None
        gap = narrowest_gap(MultiPolygon([free]))
        if gap is None or gap.width >= request.gap:
            return _rock(request, free)
        middle = shapely.union_all([middle, _through(gap, middle, radius)])
    return None


def _radius(site: _Site, core: BaseGeometry) -> float:
    """Return the radius by which a core is to be widened so that as much is blocked as is wanted, m."""
    low, high = site.radius, _WIDEST * site.radius
    for _ in range(_RADII):
        radius = (low + high) / 2.0
        more = site.blocked(site.free(core, radius)) > site.request.area
        low, high = (radius, high) if more else (low, radius)
    return (low + high) / 2.0


def _tunnels(parts: list[BaseGeometry], rng: np.random.Generator) -> list[LineString]:
    """Return lines that join all parts, as short as can be, with a bend in each: a spanning tree."""
    group = list(range(len(parts)))
    pairs = list(combinations(range(len(parts)), 2))
    lines = [shapely.shortest_line(parts[i], parts[j]) for i, j in pairs]
    tunnels = []
    for k in sorted(range(len(pairs)), key=lambda k: float(lines[k].length)):
        i, j = pairs[k]
        if group[i] != group[j]:
            tunnels.append(_bent(lines[k], rng.uniform(-_BEND, _BEND)))
            group = [group[i] if number == group[j] else number for number in group]
    return tunnels


def _bent(line: LineString, bend: float) -> LineString:
    """Return a line with its middle moved sideways by a part of its length."""
    begin, end = np.asarray(line.coords)
    along = end - begin
    middle = (begin + end) / 2.0 + bend * np.array([-along[1], along[0]])
    return LineString([begin, middle, end])


def _through(gap: Gap, core: BaseGeometry, radius: float) -> BaseGeometry:
    """Return a line through a window between two parts of a core, or its middle where there are no two."""
    one, other = np.array(gap.between)
    middle = (one + other) / 2.0
    across = (other - one) / np.hypot(*(other - one))
    along = np.array([-across[1], across[0]])
    reach = 1.5 * radius
    ends = []
    for side in (along, -along):
        # the half of a square before the window
        corners = [middle + across * reach, middle - across * reach]
        corners += [corners[1] + side * reach, corners[0] + side * reach]
        near = core.intersection(Polygon(corners))
        if near.is_empty:
            return Point(middle)
        ends.append(shapely.shortest_line(Point(middle), near).coords[-1])
    return LineString([ends[0], middle, ends[1]])


def _rounded(request: Request, free: Polygon) -> Polygon:
    rings = [request.ring(shapely.get_coordinates(ring)[:-1]) for ring in (free.exterior, *free.interiors)]
    return Polygon(rings[0], rings[1:])


def _rock(request: Request, free: Polygon) -> list[Obstacle]:
    """Return what is not free: the rock all around, with the cave as its hole, and the pillars."""
    width, height = float(request.width), float(request.height)
    around = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    outline, *inner = (
        request.ring(shapely.get_coordinates(ring)[:-1]) for ring in (free.exterior, *free.interiors)
    )
    pillars = [PolygonObstacle(ring, name="pillar") for ring in inner]
    return [PolygonObstacle(around, (outline,), "rock"), *pillars]
