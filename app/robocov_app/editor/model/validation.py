"""All that is wrong with a sketch by the rules of `robocov.mapfile`, in words, with its place on the map."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np
import shapely
from shapely import LineString, MultiPoint, MultiPolygon, Polygon

from robocov import environment as env
from robocov.arrays import Array
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Obstacle, Point, Ring, StartSpec
from robocov.errors import MapError, StartError, format_count, summarize_names
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_LABEL_CHARACTERS, MAX_SIZE_M, MIN_SIZE_M
from robocov.mapfile.rules import check_rules
from robocov.mapfile.structure import validate_document
from robocov_app.editor.model.geometry import to_array
from robocov_app.editor.model.selection import format_numbered_name
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch, to_document

ProblemKind: TypeAlias = Literal[
    "other", "no boundary", "crossing", "spot", "no room", "outside", "twice", "double", "sealed", "narrow",
    "cut off",
]  # fmt: skip
"""Kind of a problem, by which fixes are found: see `robocov_app.editor.edits.fixes`."""

_FLAT = 1e-9  # an outline whose area is below this part of its width or height squared is a line
_LONGEST_TEXT = 10_000
_MOST_PLACES = 20
_CONTROL = re.compile(r"[\x00-\x1f\x7f]")
_MAP_PLACE = re.compile(r"\b(obstacles|starts|boundary|density)((?:\[\d+\]|\.\w+|\[\"[^\"]*\"\])+)")
_STEP = re.compile(r"\[(\d+)\]|\.(\w+)|\[\"([^\"]*)\"\]")
_NOUNS = {"vertices": "corner", "points": "point", "positions": "place", "holes": "hole", "areas": "area"}


@dataclass(frozen=True, eq=False)
class Problem:
    """Something that is wrong, or may be."""

    message: (
        str  # a sentence for people; below, one that begins with a colon or a blank goes on after its name
    )
    geometry: shapely.Geometry | None  # a point, an edge, an area; None where it is nowhere
    owner: Owner | None = None  # None of the map as a whole
    is_error: bool = True  # the map cannot run so; else it is a warning
    kind: ProblemKind = "other"


def find_problems(sketch: Sketch, radius: float) -> tuple[tuple[Problem, ...], MultiPolygon]:
    """Return all that is wrong for robots of a radius, m, the grave first, and the free space."""
    found = list(_faults(sketch))
    if found:
        free = _rough_free(sketch)
        found += _space_faults(sketch, free, {problem.owner for problem in found})
    else:
        environment = sketch.build_unchecked_environment()
        free = environment.free
        try:
            validate_document(to_document(sketch), "map")  # whatever the rules are, these are they
            check_rules(environment, "map")
        except MapError as error:
            found = list(_space_faults(sketch, free, set())) or [
                Problem(translate_message(str(error), sketch), None)
            ]
    found += _warnings(sketch, free, radius, {problem.owner for problem in found})
    for k, problem in enumerate(found):
        if problem.owner is not None and problem.message[0] in ": ":
            found[k] = replace(problem, message=format_numbered_name(sketch, problem.owner) + problem.message)
    return tuple(found), free


def translate_message(message: str, sketch: Sketch) -> str:
    """Return a message of the map's rules with the names of things instead of places in a file."""

    def named(match: re.Match[str]) -> str:
        words, noun = [match[1]], "corner"
        steps = _STEP.findall(match[2])
        if match[1] == "obstacles":
            if not steps[0][0] or int(steps[0][0]) >= len(sketch.obstacles):
                return match[0]
            words = [format_numbered_name(sketch, sketch.obstacles[int(steps.pop(0)[0])].key)]
        elif match[1] == "starts":
            words = [f"start “{''.join(steps.pop(0))}”"]
        for number, name, key in steps:
            if not number:
                noun = _NOUNS.get(name or key, name or key)
                words.append(noun)
            elif noun:
                numbered = f"{noun} {int(number) + 1}"
                words = [*words[:-1], numbered] if words[-1] == noun else [*words, numbered]
                noun = "corner" if noun == "hole" else ""
        return ", ".join(words)

    return _MAP_PLACE.sub(named, message.removeprefix("map: "))


def format_position(x: float, y: float) -> str:
    return f"({x:.5g}, {y:.5g})"


def _faults(sketch: Sketch) -> Iterator[Problem]:
    for words in _label_faults(sketch.name):
        yield Problem(f"the map {words}", None)
    if len(sketch.description) > _LONGEST_TEXT:
        yield Problem(f"the description is longer than {_LONGEST_TEXT} characters", None)
    if sketch.boundary is None:
        words = "there is no boundary: draw one round all that is free"
        yield Problem(words, None, BOUNDARY, kind="no boundary")
    for owner in sketch.owners:
        for words in _label_faults(owner) if isinstance(owner, str) else ():
            yield Problem(f"a start {words}", None, owner)
        for fault in _thing_faults(sketch.find_object(owner), sketch.boundary if owner == BOUNDARY else None):
            yield replace(fault, owner=owner, message=f": {fault.message}")


def _label_faults(name: str) -> Iterator[str]:
    if not name:
        yield "has no name"
    elif len(name) > MAX_LABEL_CHARACTERS:
        yield f"has a name of {len(name)} characters: at most {MAX_LABEL_CHARACTERS} are possible"
    elif _CONTROL.search(name):
        yield "has a name with line breaks or other control characters"


def _thing_faults(thing: Obstacle | StartSpec | None, boundary: Ring | None) -> Iterator[Problem]:
    if isinstance(thing, Obstacle) and thing.name is not None:
        yield from (Problem(words, None) for words in _label_faults(thing.name))
    if boundary is not None:
        yield from _ring_faults(boundary, "it")
    elif isinstance(thing, env.PolygonObstacle):
        yield from _polygon_faults(thing)
    elif isinstance(thing, env.CircleObstacle | env.DiscStart):
        yield from _size_faults("radius", thing.radius, thing.center)
        yield from _far_faults((thing.center,))
    elif isinstance(thing, env.WallObstacle):
        yield from _size_faults("width", thing.width, thing.points[0] if thing.points else None)
        far = list(_far_faults(thing.points))
        yield from far
        points = to_array(thing.points)
        extent = np.ptp(points, axis=0).max() if len(points) else 0.0
        if not far and (len(points) < 2 or extent < MIN_SIZE_M):
            yield Problem("it has no length: it needs two points that are apart", _drawn(points))
        elif not far and extent > MAX_SIZE_M:
            words = f"it is {extent:.5g} m long: at most {MAX_SIZE_M / 1000:g} km are possible"
            yield Problem(words, _drawn(points))
    elif isinstance(thing, env.PointsStart):
        if not thing.positions:
            yield Problem("has no places: it needs one a robot", None)
        yield from _far_faults(thing.positions)
        seen: set[Point] = set()
        for place in thing.positions:
            if place in seen:
                words = f"the place {format_position(*place)} is given twice: every robot needs its own"
                yield Problem(words, shapely.Point(place), kind="spot")
            seen.add(place)


def _ring_faults(ring: Ring, what: str = "its outline") -> Iterator[Problem]:
    points, far, count = to_array(ring), list(_far_faults(ring)), len(set(ring))
    if far or count < 3:
        corners = ("no corners", "one corner", "two corners", "")[min(count, 3)]
        yield from far or [Problem(f"{what} has {corners}: it needs three", _drawn(points))]
        return
    extent, polygon = np.ptp(points, axis=0), Polygon(points)
    if extent.max() > MAX_SIZE_M:
        size = f"{extent[0]:.5g} × {extent[1]:.5g} m"
        yield Problem(
            f"{what} is {size} large: at most {MAX_SIZE_M / 1000:g} km are possible", _drawn(points)
        )
    elif extent.min() < MIN_SIZE_M or shapely.convex_hull(polygon).area <= _FLAT * float(extent.max()) ** 2:
        yield Problem(f"{what} encloses nothing: its corners lie on one line", _drawn(points))
    elif not polygon.is_valid:
        places = _meetings(points, polygon)
        more = len(places) - 1
        others = f" and at {more} more places" if more > 1 else " and at one more place" if more else ""
        words = f"{what} crosses or touches itself at {format_position(*places[0])}{others}"
        yield Problem(words, MultiPoint(places[:_MOST_PLACES]), kind="crossing")


def _polygon_faults(shape: env.PolygonObstacle) -> Iterator[Problem]:
    found = list(_ring_faults(shape.vertices))
    for hole in shape.holes:
        found += _ring_faults(hole, "a hole")
    yield from found
    if found or not shape.holes or shape.polygon.is_valid:
        return
    shell = Polygon(shape.vertices)
    good: list[Ring] = []
    for hole in shape.holes:
        inner = Polygon(hole)
        if not shell.covers(inner):
            yield Problem("a hole sticks out of its outline", inner - shell, kind="crossing")
        elif not Polygon(shape.vertices, [*good, hole]).is_valid:
            words = "a hole meets the outline or another hole: it must be apart from them"
            yield Problem(words, inner, kind="crossing")
        else:
            good.append(hole)


def _size_faults(what: str, size: float, at: Point | None) -> Iterator[Problem]:
    if not MIN_SIZE_M <= size <= MAX_SIZE_M:
        limit = (
            f"at least {1000 * MIN_SIZE_M:g} mm" if size < MIN_SIZE_M else f"at most {MAX_SIZE_M / 1000:g} km"
        )
        yield Problem(f"its {what} is {size:.5g} m: {limit} is possible", at and shapely.Point(at))


def _far_faults(points: Ring) -> Iterator[Problem]:
    for x, y in points:
        if not max(abs(x), abs(y)) <= MAX_COORDINATE_M:
            limit = f"maps reach {MAX_COORDINATE_M / 1000:.0f} km from their origin"
            yield Problem(f"{format_position(x, y)} is too far away: {limit}", shapely.Point(x, y))
            return


def _drawn(points: Array) -> shapely.Geometry | None:
    if not len(points):
        return None
    return LineString(points) if len(points) > 1 else shapely.Point(points[0])


def _meetings(points: Array, polygon: Polygon) -> list[Point]:
    """Return where an outline meets itself, left to right: ends of its noded pieces that not two share."""
    pieces = shapely.get_parts(shapely.unary_union(LineString(np.concatenate([points, points[:1]]))))
    ends = np.concatenate([np.asarray(piece.coords)[[0, -1]] for piece in pieces])
    places, counts = np.unique(ends, axis=0, return_counts=True)
    meeting = places[counts > 2] if (counts > 2).any() else places[counts != 2]
    if not len(meeting):
        reason = shapely.is_valid_reason(polygon)
        x, y = map(float, reason[reason.index("[") + 1 : -1].split())
        return [(x, y)]
    return [(x, y) for x, y in meeting.tolist()]


def _rough_free(sketch: Sketch) -> MultiPolygon:
    """Return the free space of a draft, as far as its boundary and its obstacles can be made valid."""
    ring = sketch.boundary or ()
    if len(ring) < 3 or np.abs(ring).max() > MAX_COORDINATE_M or np.ptp(ring, axis=0).max() > MAX_SIZE_M:
        return MultiPolygon()
    inside = shapely.make_valid(Polygon(ring))
    solid = shapely.union_all(sketch.geometries) if len(sketch.geometries) else MultiPolygon()
    # what is left of a broken outline may be collections of collections
    parts = [p for p in shapely.get_parts(inside - solid) if isinstance(p, Polygon) and p.area > 0.0]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    return MultiPolygon([shapely.orient_polygons(part) for part in parts])


def _space_faults(sketch: Sketch, free: MultiPolygon, faulty: set[Owner | None]) -> Iterator[Problem]:
    """Yield what is wrong with the free space and where starts lie, but not of what is at fault already."""
    if sketch.boundary is None or len(sketch.boundary) < 3:
        return
    if free.is_empty:
        if BOUNDARY not in faulty:
            hull = shapely.convex_hull(MultiPoint(sketch.boundary))
            yield Problem("no free space is left inside the boundary", hull, BOUNDARY)
        return
    for name, spec in sketch.starts:
        if not isinstance(spec, env.PointsStart):
            if name not in faulty:
                yield from _no_room(name, spec, free, DEFAULT_RADIUS_M, grave=True)
            continue
        points = shapely.points(to_array(spec.positions))
        for k in np.flatnonzero(~shapely.contains_properly(free, points)).tolist():
            near = sketch.tree.query(points[k], predicate="intersects")
            what = "outside the boundary"
            if len(near):
                what = f"inside {format_numbered_name(sketch, sketch.obstacles[int(near.max())].key)}"
            yield Problem(f"{_spot(spec, k)} is {what}", points[k], name, kind="spot")


def _spot(spec: env.PointsStart, k: int) -> str:
    return f": place {k + 1} at {format_position(*spec.positions[k])}"


def _no_room(name: str, spec: StartSpec, free: MultiPolygon, radius: float, grave: bool) -> Iterator[Problem]:
    try:
        env.Start(name, spec, free).sample(1, radius=radius)
    except StartError:
        words = f"has no room for a robot of radius {radius:g} m"
        if isinstance(spec, env.DiscStart):
            disc = shapely.Point(spec.center).buffer(spec.radius)
            yield Problem(f": its disc {words}", disc, name, grave, "no room")
        else:
            yield Problem(f": the free space {words}", None, name, grave)


def _tight_places(name: str, spec: env.PointsStart, free: MultiPolygon, radius: float) -> Iterator[Problem]:
    points = shapely.points(to_array(spec.positions))
    away = shapely.distance(points, free.boundary)
    for k in np.flatnonzero(away < radius).tolist():
        words = f"{_spot(spec, k)} is {away[k]:.3g} m from a wall: robots need {radius:g} m"
        yield Problem(words, points[k], name, False, "spot")
    pairs = shapely.STRtree(points).query(points, predicate="dwithin", distance=2 * radius).T
    for i, j in sorted((i, j) for i, j in pairs.tolist() if i < j):
        gap = math.dist(spec.positions[i], spec.positions[j])
        if gap < 2 * radius:
            words = f"{_spot(spec, i)} and place {j + 1} are {gap:.3g} m apart: robots need {2 * radius:g} m"
            yield Problem(words, MultiPoint([points[i], points[j]]), name, False, "spot")


def _warnings(sketch: Sketch, free: MultiPolygon, radius: float, bad: set[Owner | None]) -> Iterator[Problem]:
    """Yield what may be a mistake, but not of what is at fault already."""
    if BOUNDARY not in bad:
        inside, shapes = Polygon(sketch.boundary), sketch.geometries
        shapely.prepare(inside)
        # what only touches it from outside does nothing either
        outside = ~shapely.intersects(inside, shapes) | shapely.touches(inside, shapes)
        for k in np.flatnonzero(outside & ~shapely.is_empty(shapes)).tolist():
            yield Problem(" lies outside the boundary", shapes[k], sketch.obstacles[k].key, False, "outside")
    below: set[object] = set()
    for item in sketch.obstacles:
        form = (type(item.shape), *(v for n, v in vars(item.shape).items() if n not in ("name", "polygon")))
        if form in below and not item.geometry.is_empty:
            words = " lies on another one that is just the same"
            yield Problem(words, item.geometry, item.key, False, "twice")
        below.add(form)
    for owner in sketch.owners:
        for _, ring, closed in sketch.list_rings(owner):
            if 3 <= len(set(ring)) < len(ring):
                steps = pairwise((*ring, ring[0]) if closed else ring)
                if twice := [at for at, after in steps if at == after]:
                    words = f": two vertices lie in the same place, {format_position(*twice[0])}"
                    yield Problem(words, MultiPoint(twice), owner, False, "double")
    yield from _paths(sketch, bad)
    if free.is_empty:
        return
    yield from _sealed_rooms(free, radius)
    for name, spec in sketch.starts:
        if name not in bad and isinstance(spec, env.PointsStart):
            yield from _tight_places(name, spec, free, radius)
        elif name not in bad and radius > DEFAULT_RADIUS_M:
            yield from _no_room(name, spec, free, radius, grave=False)


def _paths(sketch: Sketch, faulty: set[Owner | None]) -> Iterator[Problem]:
    sound = [item for item in sketch.obstacles if item.key not in faulty and not item.geometry.is_empty]
    standing = {item.key: item.geometry for item in sound if item.shape.path is None}
    inside = None if BOUNDARY in faulty else Polygon(sketch.boundary)
    for item in sound:
        if item.shape.path is None:
            continue
        met, beyond = env.find_overlaps(
            env.compute_swept_area(item.shape.polygon, item.shape.path), standing, inside
        )
        names = [format_numbered_name(sketch, key) for key in met] + (
            [] if beyond is None else ["the boundary"]
        )
        if names:
            where = shapely.union_all([*met.values(), beyond])
            yield Problem(f" moves through {summarize_names(names)}", where, item.key, False)


def _sealed_rooms(free: MultiPolygon, radius: float) -> Iterator[Problem]:
    rest = list(free.geoms)[1:]
    slivers = [part for part in rest if part.area < math.pi * radius * radius]
    for part in rest[: len(rest) - len(slivers)]:  # the largest first
        at = format_position(*part.representative_point().coords[0])
        words = f"the room of {part.area:.3g} m² round {at} is sealed: no way leads in"
        yield Problem(words, part, None, False, "sealed")
    if slivers:
        area = sum(part.area for part in slivers)
        what = format_count(len(slivers), "sealed pocket")
        words = f"{what} {'are' if len(slivers) > 1 else 'is'} smaller than a robot, {area:.2g} m² in total"
        yield Problem(words, MultiPolygon(slivers), None, False, "sealed")
