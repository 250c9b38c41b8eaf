"""What is wrong with a sketch, where, in words: for maps, and for drafts that are far from being one.

The rules are those of `robocov.mapfile.models` and `robocov.mapfile.check`, which know of places in files and
stop where it makes no sense to go on; here every fault has its place on the map, and the rest is still looked
at.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString, MultiPoint, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import (
    CircleObstacle,
    DiscStart,
    Obstacle,
    Point,
    PointsStart,
    PolygonObstacle,
    Ring,
    Start,
    StartSpec,
    WallObstacle,
    in_the_way,
    swept_area,
)
from robocov.errors import MapError, StartError, counted, listed, one_line
from robocov.mapfile.check import check_rules
from robocov.mapfile.models import FARTHEST, LARGEST, SMALLEST, validate
from robocov.robots import DEFAULT_RADIUS
from robocov_app.editor.model.selection import display_name, rings_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch, draft_document

_FLAT = 1e-9
"""An outline whose area is below this part of its width or height squared is a line."""

_LONGEST_NAME = 100
_MOST_PLACES = 20
_CONTROL = re.compile(r"[\x00-\x1f\x7f]")


class Fault(NamedTuple):
    """What is wrong with a part: words that follow its name and a colon, and the place."""

    words: str
    where: BaseGeometry | None


def place_words(x: float, y: float) -> str:
    """Return a place as people read it.

    >>> place_words(1.25, 0.0)
    '(1.25, 0)'
    """
    return f"({x:.5g}, {y:.5g})"


def label_faults(name: str) -> Iterator[str]:
    """Yield what is wrong with the name of something."""
    if not name:
        yield "has no name"
    elif len(name) > _LONGEST_NAME:
        yield f"has a name of {len(name)} characters: at most {_LONGEST_NAME} are possible"
    elif _CONTROL.search(name):
        yield "has a name with line breaks or other control characters"


def shape_faults(shape: Obstacle) -> Iterator[Fault]:
    """Yield what is wrong with an obstacle."""
    if shape.name is not None:
        yield from (Fault(words, None) for words in label_faults(shape.name))
    if isinstance(shape, PolygonObstacle):
        yield from _polygon_faults(shape)
    elif isinstance(shape, CircleObstacle):
        yield from _size_faults("radius", shape.radius, shape.center)
        yield from _far_faults((shape.center,))
    else:
        yield from _wall_faults(shape)


def start_faults(spec: StartSpec) -> Iterator[Fault]:
    """Yield what is wrong with a start, wherever it lies."""
    if isinstance(spec, DiscStart):
        yield from _size_faults("radius", spec.radius, spec.center)
        yield from _far_faults((spec.center,))
    elif isinstance(spec, PointsStart):
        if not spec.positions:
            yield Fault("has no places: it needs one a robot", None)
        yield from _far_faults(spec.positions)
        seen: set[Point] = set()
        for place in spec.positions:
            if place in seen:
                words = f"the place {place_words(*place)} is given twice: every robot needs its own"
                yield Fault(words, shapely.Point(place))
            seen.add(place)


def ring_faults(ring: Ring, what: str = "its outline") -> Iterator[Fault]:
    """Yield what is wrong with a closed outline, which messages call `what`."""
    points = np.array(ring, dtype=float).reshape(-1, 2)
    far = list(_far_faults(ring))
    if far:
        yield from far
        return
    count = len(np.unique(points, axis=0)) if len(points) else 0
    if count < 3:
        corners = "no corners" if count == 0 else "one corner" if count == 1 else "two corners"
        yield Fault(f"{what} has {corners}: it needs three", _drawn(points))
        return
    extent = np.ptp(points, axis=0)
    if extent.max() > LARGEST:
        size = f"{extent[0]:.5g} × {extent[1]:.5g} m"
        yield Fault(f"{what} is {size} large: at most {LARGEST / 1000:g} km are possible", _drawn(points))
        return
    polygon = Polygon(points)
    hull = shapely.convex_hull(polygon)
    if extent.min() < SMALLEST or hull.area <= _FLAT * float(extent.max()) ** 2:
        yield Fault(f"{what} encloses nothing: its corners lie on one line", _drawn(points))
    elif not polygon.is_valid:
        places = _meetings(points, polygon)
        (x, y), more = places[0], len(places) - 1
        others = f" and at {more} more places" if more > 1 else " and at one more place" if more else ""
        words = f"{what} crosses or touches itself at {place_words(x, y)}{others}"
        yield Fault(words, MultiPoint(places[:_MOST_PLACES]))


def _polygon_faults(shape: PolygonObstacle) -> Iterator[Fault]:
    found = list(ring_faults(shape.vertices))
    for hole in shape.holes:
        found += ring_faults(hole, "a hole")
    yield from found
    if found or not shape.holes or shape.polygon.is_valid:
        return
    shell = Polygon(shape.vertices)
    good: list[Ring] = []
    for hole in shape.holes:
        inner = Polygon(hole)
        if not shell.covers(inner):
            yield Fault("a hole sticks out of its outline", inner - shell)
        elif not Polygon(shape.vertices, [*good, hole]).is_valid:
            yield Fault("a hole meets the outline or another hole: it must be apart from them", inner)
        else:
            good.append(hole)


def _wall_faults(shape: WallObstacle) -> Iterator[Fault]:
    points = np.array(shape.points, dtype=float).reshape(-1, 2)
    yield from _size_faults("width", shape.width, shape.points[0] if shape.points else None)
    far = list(_far_faults(shape.points))
    yield from far
    if far:
        return
    extent = np.ptp(points, axis=0) if len(points) else np.zeros(2)
    if len(points) < 2 or extent.max() < SMALLEST:
        yield Fault("it has no length: it needs two points that are apart", _drawn(points))
    elif extent.max() > LARGEST:
        yield Fault(
            f"it is {extent.max():.5g} m long: at most {LARGEST / 1000:g} km are possible", _drawn(points)
        )


def _size_faults(what: str, size: float, at: Point | None) -> Iterator[Fault]:
    if SMALLEST <= size <= LARGEST:
        return
    limit = f"at least {1000 * SMALLEST:g} mm" if size < SMALLEST else f"at most {LARGEST / 1000:g} km"
    yield Fault(f"its {what} is {size:.5g} m: {limit} is possible", None if at is None else shapely.Point(at))


def _far_faults(points: Ring) -> Iterator[Fault]:
    for x, y in points:
        if not max(abs(x), abs(y)) <= FARTHEST:
            words = (
                f"{place_words(x, y)} is too far away: maps reach {FARTHEST / 1000:.0f} km from their origin"
            )
            yield Fault(words, shapely.Point(x, y))
            return


def _drawn(points: Array) -> BaseGeometry | None:
    """Return what there is of an outline that encloses nothing."""
    if not len(points):
        return None
    return LineString(points) if len(points) > 1 else shapely.Point(points[0])


def _meetings(points: Array, polygon: Polygon) -> list[Point]:
    """Return where an outline meets itself, from the left to the right.

    Cut where its edges meet, it has ends there that not just two edges share.
    """
    ring = LineString(np.concatenate([points, points[:1]]))
    pieces = shapely.get_parts(shapely.unary_union(ring))
    ends = np.concatenate([np.asarray(piece.coords)[[0, -1]] for piece in pieces])
    places, counts = np.unique(ends, axis=0, return_counts=True)
    meeting = places[counts > 2] if (counts > 2).any() else places[counts != 2]
    if not len(meeting):
        reason = shapely.is_valid_reason(polygon)
        x, y = (float(value) for value in reason[reason.index("[") + 1 : -1].split())
        return [(x, y)]
    return [(x, y) for x, y in meeting.tolist()]


_LONGEST_TEXT = 10_000


@dataclass(frozen=True, eq=False)
class Problem:
    """Something that is wrong, or may be.

    Attributes
    ----------
    words : str
        A sentence for people.
    where : shapely geometry or None
        The place: a point, an edge, an area; None where it is nowhere, such as a missing boundary.
    of : Owner or None
        The key of an obstacle, `BOUNDARY`, or the name of a start; None of the map as a whole.
    grave : bool
        The map cannot run so; else it is a warning.
    """

    words: str
    where: BaseGeometry | None
    of: Owner | None
    grave: bool


def problems(sketch: Sketch, radius: float = DEFAULT_RADIUS) -> tuple[Problem, ...]:
    """Return all that is wrong, the grave first.

    There is a grave one exactly when ``sketch.environment()`` raises. `radius` is that of the robots, m, for
    the warnings.
    """
    return examined(sketch, radius)[0]


def runnable(found: tuple[Problem, ...]) -> bool:
    """Return whether none of the problems keeps the map from running."""
    return not any(problem.grave for problem in found)


def examined(sketch: Sketch, radius: float) -> tuple[tuple[Problem, ...], MultiPolygon]:
    """Return all that is wrong, and the free space as far as there is one."""
    found = [*_map_faults(sketch), *_part_faults(sketch)]
    if found:
        free = _rough_free(sketch)
        found += _space_faults(sketch, free, {problem.of for problem in found})
    else:
        environment = sketch.unchecked()
        free = environment.free
        try:
            # whatever the rules are, these are they
            validate(draft_document(sketch), "map")
            check_rules(environment, "map")
        except MapError as error:
            otherwise = Problem(str(error).removeprefix("map: "), None, None, True)
            found = list(_space_faults(sketch, free, set())) or [otherwise]
    return (*found, *_warnings(sketch, free, radius, {problem.of for problem in found})), free


def _map_faults(sketch: Sketch) -> Iterator[Problem]:
    """Yield what is wrong with the map as a whole."""
    for words in label_faults(sketch.name):
        yield Problem(f"the map {words}", None, None, True)
    if len(sketch.description) > _LONGEST_TEXT:
        yield Problem(f"the description is longer than {_LONGEST_TEXT} characters", None, None, True)
    if sketch.boundary is None:
        yield Problem("there is no boundary: draw one round all that is free", None, BOUNDARY, True)


def _part_faults(sketch: Sketch) -> Iterator[Problem]:
    """Yield what is wrong with the parts one by one."""
    for fault in ring_faults(sketch.boundary, "it") if sketch.boundary is not None else ():
        yield Problem(f"boundary: {fault.words}", fault.where, BOUNDARY, True)
    for item in sketch.obstacles:
        for fault in shape_faults(item.shape):
            yield Problem(f"{display_name(sketch, item.key)}: {fault.words}", fault.where, item.key, True)
    for name, spec in sketch.starts:
        for words in label_faults(name):
            yield Problem(f"a start {words}", None, name, True)
        for fault in start_faults(spec):
            yield Problem(f"{display_name(sketch, name)}: {fault.words}", fault.where, name, True)


def _rough_free(sketch: Sketch) -> MultiPolygon:
    """Return the free space of a draft, as far as its boundary and its obstacles can be made valid."""
    if sketch.boundary is None or len(sketch.boundary) < 3 or np.abs(sketch.boundary).max() > FARTHEST:
        return MultiPolygon()
    if np.ptp(sketch.boundary, axis=0).max() > LARGEST:
        return MultiPolygon()
    inside = shapely.make_valid(Polygon(sketch.boundary))
    solid = shapely.union_all(sketch.geometries) if len(sketch.geometries) else MultiPolygon()
    parts = [part for part in shapely.get_parts(inside - solid) if isinstance(part, Polygon)]
    # what is left of a broken outline may be collections of collections
    parts = [part for part in parts if part.area > 0.0]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    return MultiPolygon([shapely.orient_polygons(part) for part in parts])


def _space_faults(sketch: Sketch, free: MultiPolygon, faulty: set[Owner | None]) -> Iterator[Problem]:
    """Yield what is wrong with the free space and where starts lie, but not of what is at fault already."""
    if sketch.boundary is None or len(sketch.boundary) < 3:
        return
    if free.is_empty:
        if BOUNDARY not in faulty:
            hull = shapely.convex_hull(shapely.MultiPoint(sketch.boundary))
            yield Problem("no free space is left inside the boundary", hull, BOUNDARY, True)
        return
    for name, spec in sketch.starts:
        if isinstance(spec, PointsStart):
            yield from _blocked_places(sketch, name, spec, free)
        elif name not in faulty:
            words = _no_room(name, spec, free, DEFAULT_RADIUS)
            if words:
                yield Problem(words, _disc(spec), name, True)


def _blocked_places(sketch: Sketch, name: str, spec: PointsStart, free: MultiPolygon) -> Iterator[Problem]:
    if not spec.positions:
        return
    points = shapely.points(np.array(spec.positions, dtype=float))
    for k in np.flatnonzero(~shapely.contains_properly(free, points)).tolist():
        near = sketch.tree.query(points[k], predicate="intersects")
        what = "outside the boundary"
        if len(near):
            what = f"inside {display_name(sketch, sketch.obstacles[int(near.max())].key)}"
        at = place_words(*spec.positions[k])
        words = f"{display_name(sketch, name)}: place {k + 1} at {at} is {what}"
        yield Problem(words, points[k], name, True)


def _no_room(name: str, spec: StartSpec, free: MultiPolygon, radius: float) -> str:
    """Return what is to be said of a start in which no robot finds room; empty if one does."""
    try:
        Start(name, spec, free).sample(1, radius=radius)
    except StartError:
        what = "its disc" if isinstance(spec, DiscStart) else "the free space"
        return f"start “{one_line(name)}”: {what} has no room for a robot of radius {radius:g} m"
    return ""


def _disc(spec: StartSpec) -> BaseGeometry | None:
    if isinstance(spec, DiscStart):
        return shapely.Point(spec.center).buffer(spec.radius)
    return None


def _warnings(
    sketch: Sketch, free: MultiPolygon, radius: float, faulty: set[Owner | None]
) -> Iterator[Problem]:
    """Yield what may be a mistake, but not of what is at fault already."""
    if BOUNDARY not in faulty:
        yield from _outside(sketch)
    yield from _twice(sketch)
    yield from _double_vertices(sketch)
    yield from _paths(sketch, faulty)
    if free.is_empty:
        return
    yield from _sealed_rooms(free, radius)
    for name, spec in sketch.starts:
        if name in faulty:
            continue
        if isinstance(spec, PointsStart):
            try:
                Start(name, spec, free).sample(len(spec.positions), radius=radius)
            except StartError as error:
                yield Problem(one_line(error), shapely.MultiPoint(spec.positions), name, False)
        elif radius > DEFAULT_RADIUS:
            words = _no_room(name, spec, free, radius)
            if words:
                yield Problem(words, _disc(spec), name, False)


def _outside(sketch: Sketch) -> Iterator[Problem]:
    """Warn of obstacles outside the boundary; what only touches it from there does nothing either."""
    inside = Polygon(sketch.boundary)
    shapely.prepare(inside)
    outside = ~shapely.intersects(inside, sketch.geometries) | shapely.touches(inside, sketch.geometries)
    for k in np.flatnonzero(outside & ~shapely.is_empty(sketch.geometries)).tolist():
        item = sketch.obstacles[k]
        words = f"{display_name(sketch, item.key)} lies outside the boundary"
        yield Problem(words, item.geometry, item.key, False)


def _paths(sketch: Sketch, faulty: set[Owner | None]) -> Iterator[Problem]:
    """Warn of obstacles that move through what stands, or through the outer wall."""
    sound = [item for item in sketch.obstacles if item.key not in faulty and not item.geometry.is_empty]
    standing = {item.key: item.geometry for item in sound if item.shape.path is None}
    inside = None if BOUNDARY in faulty else Polygon(sketch.boundary)
    for item in sound:
        if item.shape.path is None:
            continue
        area = swept_area(item.shape.polygon, item.shape.path)
        met, beyond = in_the_way(area, standing, inside)
        names, places = [display_name(sketch, key) for key in met], list(met.values())
        if beyond is not None:
            names, places = [*names, "the boundary"], [*places, beyond]
        if names:
            words = f"{display_name(sketch, item.key)} moves through {listed(names)}"
            yield Problem(words, shapely.union_all(places), item.key, False)


def _twice(sketch: Sketch) -> Iterator[Problem]:
    """Warn of obstacles that lie twice in the same place, as after pasting twice."""
    below: dict[object, int] = {}
    for item in sketch.obstacles:
        shape = item.shape
        if item.geometry.is_empty:
            continue
        form = tuple(value for name, value in vars(shape).items() if name not in ("name", "polygon"))
        if (type(shape), form) in below:
            words = f"{display_name(sketch, item.key)} lies on another one that is just the same"
            yield Problem(words, item.geometry, item.key, False)
        below[(type(shape), form)] = item.key


def _double_vertices(sketch: Sketch) -> Iterator[Problem]:
    for owner in (BOUNDARY, *(item.key for item in sketch.obstacles)):
        for _, ring, closed in rings_of(sketch, owner):
            if len(set(ring)) == len(ring) or len(set(ring)) < 3:
                continue
            following = (*ring[1:], ring[0]) if closed else ring[1:]
            twice = [at for at, after in zip(ring, following, strict=False) if at == after]
            if twice:
                at = place_words(*twice[0])
                words = f"{display_name(sketch, owner)}: two vertices lie in the same place, {at}"
                yield Problem(words, shapely.MultiPoint(twice), owner, False)


def _sealed_rooms(free: MultiPolygon, radius: float) -> Iterator[Problem]:
    """Warn of parts of the free space that nothing leads to from the largest."""
    slivers = []
    for part in list(free.geoms)[1:]:
        if part.area < math.pi * radius * radius:
            slivers.append(part)
            continue
        spot = part.representative_point()
        words = (
            f"the room of {part.area:.3g} m² round {place_words(spot.x, spot.y)} is sealed: no way leads in"
        )
        yield Problem(words, part, None, False)
    if slivers:
        area = sum(part.area for part in slivers)
        what = counted(len(slivers), "sealed pocket")
        is_are = "are" if len(slivers) > 1 else "is"
        words = f"{what} {is_are} smaller than a robot, {area:.2g} m² together"
        yield Problem(words, MultiPolygon(slivers), None, False)
