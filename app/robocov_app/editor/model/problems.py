"""What is wrong with a sketch, where, in words: for maps, and for drafts that are far from being one.

The rules are those of `robocov.mapfile.models` and `robocov.mapfile.check`, which know of places in files and
stop where it makes no sense to go on; here every fault has its place on the map, and the rest is still looked
at.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.environment import DiscStart, PointsStart, Start, in_the_way, swept_area
from robocov.errors import MapError, StartError, counted, listed, one_line
from robocov.mapfile.check import check_rules
from robocov.mapfile.models import FARTHEST, LARGEST, validate
from robocov.robots import DEFAULT_RADIUS
from robocov_app.editor.model.document import BOUNDARY, Owner, Sketch, draft_document
from robocov_app.editor.model.faults import label_faults, place_words, ring_faults, shape_faults, start_faults
from robocov_app.editor.model.selection import called, rings_of

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from robocov.environment import StartSpec

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
            yield Problem(f"{called(sketch, item.key)}: {fault.words}", fault.where, item.key, True)
    for name, spec in sketch.starts:
        for words in label_faults(name):
            yield Problem(f"a start {words}", None, name, True)
        for fault in start_faults(spec):
            yield Problem(f"{called(sketch, name)}: {fault.words}", fault.where, name, True)


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
            what = f"inside {called(sketch, sketch.obstacles[int(near.max())].key)}"
        at = place_words(*spec.positions[k])
        words = f"{called(sketch, name)}: place {k + 1} at {at} is {what}"
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
        words = f"{called(sketch, item.key)} lies outside the boundary"
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
        names, places = [called(sketch, key) for key in met], list(met.values())
        if beyond is not None:
            names, places = [*names, "the boundary"], [*places, beyond]
        if names:
            words = f"{called(sketch, item.key)} moves through {listed(names)}"
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
            words = f"{called(sketch, item.key)} lies on another one that is just the same"
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
                words = (
                    f"{called(sketch, owner)}: two vertices lie in the same place, {place_words(*twice[0])}"
                )
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
