"""From what a reader found to an environment, and how the two compare."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import (
    START_GAP,
    DiscStart,
    Environment,
    Gap,
    PointsStart,
    PolygonObstacle,
    Ring,
    StartSpec,
    UniformStart,
    narrowest_gap,
)
from robocov.errors import MapError, ParameterError, counted, one_line, shown
from robocov.mapfile import from_json, to_json
from robocov.mapfile.check import MANY_VERTICES, many_vertices, vertex_count
from robocov.mapfile.models import FARTHEST, SMALLEST
from robocov.robots import DEFAULT_RADIUS
from robocov_app.formats.foreign import ForeignMap, ImportReport, square_metres
from robocov_app.formats.geometry.corners import sharpened
from robocov_app.formats.geometry.enclosing import CRUMB, bounded
from robocov_app.formats.geometry.passages import moved_walls, roomiest, rooms
from robocov_app.formats.geometry.polygons import filled, made_valid, polygons, rounded
from robocov_app.formats.geometry.primitives import Primitive, with_primitives
from robocov_app.formats.geometry.simplify import simplified

DEFAULT_TOLERANCE = 0.02
"""By how much walls of vector formats may move, in metres."""

_GRID = 1e-4
"""Coordinates are rounded to a tenth of a millimetre, or to a hundredth of a cell if that is finer."""

_TINY = 0.01
"""Obstacles smaller than this, in m², are perhaps noise: many of them are worth a word."""

_MANY = 10

_LITTLE, _CONSIDERABLE = 0.5, 0.1
"""Where less of the free area stays than the first, or a part of more than the second does not, it is said
how to choose."""

_OFFERED = 3
"""So many of the largest parts that are left out are named, with a place in each."""

_SOON = 10_000
"""Of maps with more vertices it takes too long to say where robots do not pass."""

MAX_OBSTACLES, MAX_KEPT = 8_000, 50_000
"""Most obstacles and vertices of a map that is made: it takes seconds to make one that has as many."""


@dataclass(frozen=True)
class Shaping:
    """How a foreign map becomes an environment."""

    simplify: float | None = None
    """Walls may move by so many metres, and corners by twice as much, where that saves vertices; 0 keeps
    all. By default one cell of a grid, 0.02 of the rest."""
    specks: float | None = None
    """Obstacles smaller than so many m² are dropped. By default single cells of ROS maps and JPEGs are, else
    none."""
    keep: Literal["largest", "all"] = "largest"
    """Which connected parts of the free space stay; where the file places robots, the one with most of them
    counts as the largest."""
    inside: tuple[float, float] | None = None
    """The part of the free space that holds this place, x and y in the map's metres, stays instead of the
    largest."""
    hull: bool = False
    """The boundary is the convex hull of the free space, not its outline."""
    margin: float = 0.0
    """So many metres around the free space are solid."""
    radius: float = DEFAULT_RADIUS
    """Radius of a robot in metres: where it passes in the file, it passes in the map."""
    default_start: Literal["room", "uniform"] = "room"
    """The map's default start: a disc at the roomiest place, or anywhere."""

    def __post_init__(self) -> None:
        ranges = {"simplify": (0.0, 10.0, "m"), "specks": (0.0, 1e6, "m²"), "margin": (0.0, 100.0, "m")}
        ranges["radius"] = (1e-3, 100.0, "m")
        for name, (low, high, unit) in ranges.items():
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and low <= value <= high):
                raise ParameterError(
                    f"{name}: {shown(value)}, but a number from {low:g} to {high:g} ({unit}) was wanted"
                )
        for name, choices in (("keep", ("largest", "all")), ("default_start", ("room", "uniform"))):
            value = getattr(self, name)
            if value not in choices:
                raise ParameterError(f"{name}: {shown(value)}, but one of {', '.join(choices)} was wanted")
        if self.inside is not None:
            if len(self.inside) != 2 or not all(abs(value) <= FARTHEST for value in self.inside):
                raise ParameterError(
                    f"inside: {shown(self.inside)}, but two numbers from {-FARTHEST:.0f} to {FARTHEST:.0f} "
                    "(m) were wanted"
                )
            if self.keep == "all":
                raise ParameterError("inside: keeps one part of the free space, but keep is all")


_MOST_ROBOTS = 1000
"""Of a file, so many are looked at."""

_ZERO = 1e-100
"""Coordinates nearer to zero, in metres, are zero; as of map files."""


@dataclass
class _Told:
    """What the report will say."""

    repaired: list[str] = field(default_factory=list)
    dropped: list[str] = field(default_factory=list)
    changed: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    others: list[tuple[float, float]] = field(default_factory=list)


def shaped(foreign: ForeignMap, shaping: Shaping, where: str) -> tuple[Environment, ImportReport]:
    """Return the environment that `foreign` stands for, and what was done to it.

    `where`: what messages call the map: a file's name. Raises MapError when nothing is free, no place is wide
    enough for a robot, or the map breaks another rule.
    """
    told = _Told(list(foreign.repaired), list(foreign.dropped), [], list(foreign.notes))
    outer = _valid_boundary(foreign.boundary, told)
    read = _valid(foreign.free, outer, told, where)
    least = foreign.specks if shaping.specks is None else shaping.specks
    parts = _kept(read, shaping, foreign.robots, least, told, where)
    parts = _without_specks(parts, foreign.cell, least, told)
    chosen = shaping.inside is not None or (foreign.robots and shaping.keep == "largest")
    if chosen and outer is not None and outer.contains_properly(parts[0]):
        outer = None  # what is around the other parts is not around this one
    _require_few(sum(len(part.interiors) for part in parts), "obstacles", MAX_OBSTACLES, where)
    _require_room(parts, shaping, where)
    tolerance = shaping.simplify
    if tolerance is None:
        tolerance = _default_tolerance(foreign.cell, shaping.radius, told)
    drawn = [sharpened(part, tolerance) for part in parts] if foreign.cut_corners else parts
    simple = simplified(MultiPolygon(drawn), tolerance, foreign.cell, shaping.radius)
    told.changed += simple.changed
    if outer is not None:
        straight = simplified(MultiPolygon([outer]), tolerance, foreign.cell, shaping.radius)
        base: Polygon | None = filled(straight.free)
    else:
        base = None
    digits = _digits(foreign.cell)
    free = rounded(simple.free, digits)
    if free.is_empty:
        raise MapError(f"{where}: {read.area:.3g} m² are free, but more was wanted: is the scale right?")
    _require_few(shapely.count_coordinates(free), "vertices", MAX_KEPT, where)
    moved = moved_walls(MultiPolygon(parts), free)
    if moved.distance >= 1e-3:
        told.changed.append(
            f"walls moved by at most {moved.distance:.2g} m; {square_metres(moved.area, 2)} changed sides, "
            f"{100 * moved.area / free.area:.2g} % of the free area"
        )
    boundary, solid = bounded(free, base, hull=shaping.hull, margin=shaping.margin, digits=digits)
    if outer is not None:
        solid = _without_slivers(solid, shapely.difference(outer, read), tolerance)
    drawn_as: list[Primitive] = []
    if foreign.primitives and shapely.get_num_coordinates(free) <= _SOON:
        places = max(len(rooms(space, shaping.radius)) for space in (MultiPolygon(parts), free))
        drawn_as, solid = with_primitives(
            solid, foreign.primitives, boundary, simple.tolerance, digits, places, shaping.radius
        )
        if drawn_as:  # its vertices where polygons began that are gone
            boundary = boundary.simplify(0.0)
    obstacles = _obstacles(solid, digits, told)
    environment = Environment(
        name=one_line(foreign.name)[:100].strip() or "map",
        boundary=_ring(boundary.exterior, digits),
        obstacles=(*obstacles, *drawn_as),
        starts=_starts(free, shaping, foreign.robots, told),
        description=foreign.description[:10_000],
    )
    # through the rules of map files: what is imported can be saved and loaded
    environment = from_json(to_json(environment), where)
    _note_unreached(environment, shaping.radius, told)
    width, height = np.ptp(np.array(environment.boundary), axis=0).tolist()
    kept = vertex_count(environment)
    if kept > MANY_VERTICES:
        told.notes.append(many_vertices(kept))
    report = ImportReport(
        source=where,
        format=foreign.format,
        vertices_read=foreign.vertices_read,
        vertices_kept=kept,
        area_read=float(read.area),
        area_kept=environment.free_area,
        repaired=tuple(told.repaired),
        dropped=tuple(told.dropped),
        changed=tuple(told.changed),
        notes=tuple(told.notes),
        size=(round(width, digits), round(height, digits)),
        obstacles=len(environment.obstacles),
        tolerance=simple.tolerance,
        moved_area=moved.area,
        moved=moved.distance,
        others=tuple(told.others),
    )
    return environment, report


def _valid_boundary(outer: Polygon | None, told: _Told) -> Polygon | None:
    """Return the boundary that the format gives, valid and without holes."""
    if outer is None:
        return None
    if not outer.is_valid:
        told.repaired.append(f"the boundary met itself: {_reason(outer)}")
        valid = polygons(made_valid(outer))
        return Polygon(valid[0].exterior) if valid else None
    return Polygon(outer.exterior)


def _valid(given: MultiPolygon, outer: Polygon | None, told: _Told, where: str) -> MultiPolygon:
    """Return the free space within `outer` as disjoint valid polygons, the largest first."""
    if not np.isfinite(shapely.get_coordinates(given)).all():
        raise MapError(f"{where}: a coordinate is not finite, but numbers were wanted")
    # what is all but zero makes GEOS divide by zero
    free: BaseGeometry = shapely.transform(given, lambda points: np.where(abs(points) < _ZERO, 0.0, points))
    if not free.is_valid:
        told.repaired.append(f"outlines met themselves or each other: {_reason(free)}")
        free = made_valid(free)
    if outer is not None and not shapely.covers(outer, free):
        inside = shapely.intersection(free, outer)
        if free.area - inside.area > CRUMB:
            told.dropped.append(
                f"{square_metres(free.area - inside.area, 3)} of free space outside the boundary"
            )
        free = inside
    parts = polygons(free)
    if not parts:
        raise MapError(f"{where}: nothing is free, but some free space was wanted")
    return MultiPolygon(parts)


def _reason(geometry: BaseGeometry) -> str:
    """Return why `geometry` is not valid, as a message shows it."""
    what, _, place = shapely.is_valid_reason(geometry).partition("[")
    x, _, y = place.rstrip("]").partition(" ")
    return f"{what.lower()} at [{float(x):.6g}, {float(y):.6g}]" if y else what.lower()


def _kept(
    free: MultiPolygon,
    shaping: Shaping,
    robots: tuple[tuple[float, float], ...],
    specks: float,
    told: _Told,
    where: str,
) -> list[Polygon]:
    """Return the parts of the free space that stay, the largest first."""
    parts = np.array(free.geoms, dtype=object)
    area = shapely.area(parts)
    if shaping.inside is not None:
        stays = np.arange(len(parts)) == _part_around(shaping.inside, parts, where)
    elif shaping.keep == "largest":
        shapely.prepare(parts)
        places = shapely.points(np.array(robots[:_MOST_ROBOTS]).reshape(-1, 2))
        most = int(np.argmax([shapely.contains(part, places).sum() for part in parts])) if robots else 0
        stays = np.arange(len(parts)) == most
        if most:
            told.notes.append("the part of the free space with most robots stays, which is not the largest")
    else:
        stays = area >= max(specks, min(CRUMB, area[0]))
    kept: list[Polygon] = parts[stays].tolist()
    left: list[Polygon] = parts[~stays].tolist()
    if not kept:
        raise MapError(
            f"{where}: no part of the free space is larger than {area[0]:.3g} m², "
            f"but one of at least {specks:g} m² was wanted"
        )
    if left:
        largest = f" (the largest {square_metres(left[0].area, 3)})" if len(left) > 1 else ""
        told.dropped.append(
            f"{counted(len(left), 'separate part')} of the free space, {_squared(left)}{largest}"
        )
        share, next_share = area[stays].sum() / area.sum(), left[0].area / area.sum()
        if share < _LITTLE or next_share > _CONSIDERABLE:
            told.others = [_place_in(part) for part in left[:_OFFERED]]
            choices = " or ".join(
                f"--inside {x:.10g} {y:.10g} ({square_metres(part.area, 3)})"
                for (x, y), part in zip(told.others, left, strict=False)
            )
            told.notes.append(
                f"{'only ' if share < _LITTLE else ''}{100 * share:.2g} % of the free area stays: {choices} "
                "keeps another part, --keep all every part"
            )
    if len(kept) > 1:
        told.notes.append(f"the free space is of {len(kept)} separate parts: robots cannot pass between them")
    return kept


def _part_around(place: tuple[float, float], parts: NDArray[np.object_], where: str) -> int:
    """Return which part holds a place."""
    distance = shapely.distance(parts, shapely.Point(place))
    nearest = int(np.argmin(distance))
    if distance[nearest] > 0.0:
        x, y = _place_in(parts[nearest])
        raise MapError(
            f"{where}: inside: {place[0]:.10g} {place[1]:.10g} is solid, but a place in the free space was "
            f"wanted; {x:.10g} {y:.10g} is one in the nearest part, {distance[nearest]:.3g} m away"
        )
    return nearest


def _place_in(part: Polygon) -> tuple[float, float]:
    """Return a place in a part, to the centimetre."""
    point = shapely.point_on_surface(part)
    return round(point.x, 2), round(point.y, 2)


def _without_specks(parts: list[Polygon], cell: float | None, least: float, told: _Told) -> list[Polygon]:
    """Return `parts` without the holes that are too small."""
    crumb = CRUMB if cell is None else min(CRUMB, cell * cell / 2)
    result: list[Polygon] = []
    specks: list[Polygon] = []
    crumbs: list[Polygon] = []
    tiny = 0
    for part in parts:
        holes = np.array([Polygon(hole) for hole in part.interiors], dtype=object)
        area = shapely.area(holes)
        specks += holes[(area < least) & (area >= crumb)].tolist()
        crumbs += holes[area < crumb].tolist()
        stays = area >= max(crumb, least)
        tiny += int(np.count_nonzero(stays & (area < _TINY)))
        if not stays.all():
            part = Polygon(part.exterior, shapely.get_exterior_ring(holes[stays]).tolist())
        result.append(part)
    if specks:
        what = counted(len(specks), "obstacle")
        told.dropped.append(f"{what} smaller than {least:.3g} m², {_squared(specks)} (--specks 0 keeps them)")
    if crumbs:
        told.dropped.append(f"{counted(len(crumbs), 'hole')} of {_squared(crumbs)}, which come of rounding")
    if tiny >= _MANY and least < _TINY:
        told.notes.append(f"{tiny} obstacles are smaller than {_TINY:g} m² (--specks {_TINY:g} drops them)")
    return result


def _without_slivers(solid: list[Polygon], before: BaseGeometry, tolerance: float) -> list[Polygon]:
    """Return `solid` without what lies between a boundary and a free space that ran along it.

    Walls of the two have moved apart there: such a sliver was not solid `before`, and is no thicker than
    they may move.
    """
    if not solid or tolerance == 0.0:
        return solid
    parts = np.array(solid, dtype=object)
    thin = shapely.is_empty(shapely.buffer(parts, -tolerance, quad_segs=2))
    fresh = np.zeros(len(parts), dtype=bool)
    fresh[thin] = shapely.area(shapely.intersection(parts[thin], before)) < shapely.area(parts[thin]) / 2
    return list(parts[~fresh])


def _default_tolerance(cell: float | None, radius: float, told: _Told) -> float:
    """Return by how much walls may move, m: where cells are larger than robots, each one counts."""
    if cell is None:
        return DEFAULT_TOLERANCE
    if cell > 2 * radius:
        told.notes.append(
            f"cells are larger than robots: walls move by at most {2 * radius:g} m, not by one "
            f"(--simplify {cell:g})"
        )
    return min(cell, 2 * radius)


def _squared(parts: list[Polygon]) -> str:
    area = sum(part.area for part in parts)
    return f"{square_metres(area, 3)}{' together' if len(parts) > 1 else ''}"


def _digits(cell: float | None) -> int:
    """Return how many decimals coordinates have."""
    grid = _GRID if cell is None else min(_GRID, cell / 100)
    return -math.floor(math.log10(grid) + 1e-9)


def _ring(ring: BaseGeometry, digits: int) -> Ring:
    """Return a closed ring as a map has it: counter-clockwise from its leftmost vertex."""
    points = np.round(shapely.get_coordinates(ring)[:-1], digits) + 0.0
    if not shapely.is_ccw(ring):
        points = points[::-1]
    first = int(np.lexsort((points[:, 1], points[:, 0]))[0])
    return tuple((float(x), float(y)) for x, y in np.roll(points, -first, axis=0))


def _obstacles(solid: list[Polygon], digits: int, told: _Told) -> tuple[PolygonObstacle, ...]:
    """Return `solid` as obstacles, the largest first, without what is too small for a map."""
    sides = shapely.bounds(np.array(solid, dtype=object)).reshape(-1, 4)
    small = np.minimum(sides[:, 2] - sides[:, 0], sides[:, 3] - sides[:, 1]) < SMALLEST
    if small.any():
        told.dropped.append(f"{counted(int(small.sum()), 'obstacle')} thinner than {SMALLEST * 1000:g} mm")
    kept = [part for part, gone in zip(solid, small, strict=True) if not gone]
    kept.sort(key=lambda part: (-round(part.area, 6), part.bounds))
    return tuple(
        PolygonObstacle(_ring(part.exterior, digits), tuple(_ring(hole, digits) for hole in part.interiors))
        for part in kept
    )


def _clearance(shaping: Shaping) -> float:
    """Return how far from walls a robot starts, m: the rules of maps want room for the usual one."""
    return max(DEFAULT_RADIUS, shaping.radius) * (1 + START_GAP)


def _require_few(count: int, what: str, most: int, where: str) -> None:
    """Check that a map is none that takes minutes to make, and for ever to simulate."""
    if count > most:
        raise MapError(
            f"{where}: {count} {what}, but at most {most} were wanted: --specks AREA drops small "
            "obstacles, --simplify METRES draws walls with fewer vertices"
        )


def _require_room(parts: list[Polygon], shaping: Shaping, where: str) -> None:
    """Check that a robot fits somewhere in the free space."""
    clearance = _clearance(shaping)
    widest = 0.0
    for part in parts:
        if math.sqrt(part.area / math.pi) > widest:
            widest = max(widest, roomiest(part, clearance / 50, clearance)[1])
        if widest >= clearance:
            return
    raise MapError(
        f"{where}: no place is wide enough for a robot of radius {clearance / (1 + START_GAP):g} m "
        f"(the widest is for one of {widest / (1 + START_GAP):.3g} m): is the scale right?"
    )


def _starts(
    free: MultiPolygon, shaping: Shaping, robots: tuple[tuple[float, float], ...], told: _Told
) -> dict[str, StartSpec]:
    """Return the starts: a disc at the roomiest place, everywhere, and where the file places robots."""
    clearance = _clearance(shaping)
    part = free.geoms[0]
    # what is finer than this does not move a start by much
    (x, y), room = roomiest(part, max(0.01, math.sqrt(part.area) / 500))
    # the disc holds centres: one robot's radius stays between it and the walls
    radius = min(room - clearance, 2.0)
    starts: dict[str, StartSpec] = {"uniform": UniformStart()}
    if radius >= 0.02:
        disc = DiscStart((round(x, 2), round(y, 2)), math.floor(100 * radius) / 100)
        both: dict[str, StartSpec] = {"room": disc, **starts}
        starts = both if shaping.default_start == "room" else dict(reversed(both.items()))
    if robots:
        given = np.array(list(dict.fromkeys(robots))[:_MOST_ROBOTS])
        fits = shapely.contains_properly(free, shapely.points(given))
        fits &= shapely.distance(free.boundary, shapely.points(given)) >= clearance
        for k in np.flatnonzero(fits).tolist():
            fits[k] = (np.hypot(*(given[:k][fits[:k]] - given[k]).T) >= 2 * clearance).all()
        if fits.any():
            starts["robots"] = PointsStart(tuple((x, y) for x, y in given[fits].tolist()))
        rest = "" if fits.sum() == len(robots) else "; there is no room at the others"
        many = f"{int(fits.sum())} of {counted(len(robots), 'place')}"
        told.notes.append(f'start "robots": {many} of robots in the file{rest}')
    return starts


def _note_unreached(environment: Environment, radius: float, told: _Told) -> None:
    """Say how much of the free space robots do not reach from where most of it is, if that is soon known."""
    if shapely.get_num_coordinates(environment.free) > _SOON:
        return
    places = sorted((place.area for place in rooms(environment.free, radius)), reverse=True)[1:]
    if places:
        what = f"{counted(len(places), 'place')} of {square_metres(sum(places), 3)}"
        told.notes.append(f"{what} no robot of radius {radius:g} m reaches from the largest one")


_MOST_VERTICES = 20_000
"""Of a map whose narrowest passage is looked for: that takes seconds then."""

_SLIVER = 2.0
"""Width, in tolerances, below which a difference counts as a wall that moved, not as one that was lost."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Free space as it was read and as it became, and what differs; all in metres.

    `lost`, `opened`: what is free in the first alone, and in the second alone, without the slivers along
    walls that moved. `region`: convex, around all of it. `gap`: the narrowest passage of the second, if that
    is soon known.
    """

    before: BaseGeometry
    after: BaseGeometry
    lost: BaseGeometry
    opened: BaseGeometry
    region: BaseGeometry
    gap: Gap | None

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Least x and y, then largest."""
        x, y, right, top = self.region.bounds
        return x, y, right, top


def compare(foreign: ForeignMap, environment: Environment, report: ImportReport) -> Comparison:
    """Return what an import has changed of the free space."""
    before, after = foreign.free, environment.free
    if not before.is_valid:
        before = made_valid(before)
    everything = [before, after, environment.region.polygon, foreign.boundary or before]
    return Comparison(
        before,
        after,
        lost=_changed(before, after, report.tolerance),
        opened=_changed(after, before, report.tolerance),
        region=shapely.GeometryCollection(everything).convex_hull,
        gap=narrowest_gap(after) if report.vertices_kept <= _MOST_VERTICES else None,
    )


def _changed(first: BaseGeometry, second: BaseGeometry, tolerance: float) -> BaseGeometry:
    """Return what is in the first and not in the second, without the slivers along walls that moved."""
    parts = shapely.get_parts(shapely.difference(first, second))
    parts = np.array([part for part in parts if isinstance(part, Polygon) and part.area > 0.0], dtype=object)
    if not len(parts):
        return shapely.MultiPolygon()
    # of a long strip this is its width
    width = 2.0 * shapely.area(parts) / shapely.length(parts)
    return shapely.MultiPolygon(parts[width > max(_SLIVER * tolerance, 1e-3) / 2].tolist())
