"""Validation of a map: errors against the rules of map files, and warnings about likely mistakes."""

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import shapely
from shapely import MultiPoint, MultiPolygon, Polygon

from robocov import environment as env
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Point, Ring
from robocov.errors import MapError, StartError, format_area, format_count, summarize_names
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M
from robocov.mapfile.rules import check_rules
from robocov.mapfile.structure import validate_document
from robocov_app.editor.model.geometry import to_array
from robocov_app.editor.model.problem import (
    Problem,
    ProblemKind,
    format_position,
    translate_message,
)
from robocov_app.editor.model.selection import format_numbered_name
from robocov_app.editor.model.shape_checks import check_shapes
from robocov_app.editor.model.sketch import BOUNDARY, Item, Owner, Sketch, to_document

__all__ = ["Problem", "ProblemKind", "find_problems", "format_position", "translate_message"]


def find_problems(sketch: Sketch, radius: float) -> tuple[tuple[Problem, ...], MultiPolygon]:
    """Find the errors and the likely mistakes in a map.

    Parameters
    ----------
    sketch : Sketch
        The map.
    radius : float
        Radius of a robot, m.

    Returns
    -------
    problems : tuple of Problem
        Errors, then warnings.
    free : MultiPolygon
        The free space, m. For an invalid map, it is an approximation.
    """
    errors = list(check_shapes(sketch))
    if errors:
        free = _build_rough_free_space(sketch)
        errors += _check_free_space(sketch, free, _list_owners(errors))
    else:
        environment = sketch.build_unchecked_environment()
        free = environment.free
        errors = _check_map_rules(sketch, environment)
    warnings = _list_warnings(sketch, free, radius, _list_owners(errors))
    return (*errors, *warnings), free


def _list_owners(problems: list[Problem]) -> set[Owner | None]:
    return {problem.owner for problem in problems}


def _check_map_rules(sketch: Sketch, environment: env.Environment) -> list[Problem]:
    """Return the errors against the rules of map files, with the editor's own messages where possible."""
    try:
        validate_document(to_document(sketch), "map")
        check_rules(environment, "map")
    except MapError as error:
        problems = list(_check_free_space(sketch, environment.free, set()))
        return problems or [Problem(translate_message(str(error), sketch), None)]
    return []


def _build_rough_free_space(sketch: Sketch) -> MultiPolygon:
    """Build the free space of an invalid map from its repairable parts; empty if no boundary is usable."""
    ring = sketch.boundary or ()
    if len(ring) < 3 or np.abs(ring).max() > MAX_COORDINATE_M or np.ptp(ring, axis=0).max() > MAX_SIZE_M:
        return MultiPolygon()
    inside = shapely.make_valid(Polygon(ring))
    solid = MultiPolygon()
    if len(sketch.geometries):
        solid = shapely.union_all(sketch.geometries)
    # The difference may contain lines and points, which are dropped.
    parts = shapely.get_parts(inside - solid)
    polygons = [part for part in parts if isinstance(part, Polygon) and part.area > 0.0]
    polygons.sort(key=lambda polygon: (-polygon.area, polygon.bounds))
    return MultiPolygon([shapely.orient_polygons(polygon) for polygon in polygons])


def _check_free_space(sketch: Sketch, free: MultiPolygon, skipped: set[Owner | None]) -> Iterator[Problem]:
    """Yield an error if there is no free space, and errors of starts; objects in `skipped` are left out."""
    if sketch.boundary is None or len(sketch.boundary) < 3:
        return
    if free.is_empty:
        if BOUNDARY not in skipped:
            hull = shapely.convex_hull(MultiPoint(sketch.boundary))
            yield Problem("no free space is left inside the boundary", hull, owner=BOUNDARY)
        return
    for name, start in sketch.starts:
        if isinstance(start, env.PointsStart):
            yield from _check_positions(sketch, name, start, free)
        elif name not in skipped:
            yield from _check_space(sketch, name, free, DEFAULT_RADIUS_M, is_error=True)


def _check_positions(
    sketch: Sketch, name: str, start: env.PointsStart, free: MultiPolygon
) -> Iterator[Problem]:
    """Yield an error for each position of a start that is not in the free space."""
    points = shapely.points(to_array(start.positions))
    for number in np.flatnonzero(~shapely.contains_properly(free, points)).tolist():
        covering = sketch.tree.query(points[number], predicate="intersects")
        location = "outside the boundary"
        if len(covering):
            topmost = sketch.obstacles[int(covering.max())]
            location = f"inside {format_numbered_name(sketch, topmost.key)}"
        message = f"{_describe_position(sketch, name, number)} is {location}"
        yield Problem(message, points[number], owner=name, kind="spot")


def _describe_position(sketch: Sketch, name: str, number: int) -> str:
    """Describe a position of a start, for example "start “left”: position 2 at (1.5, 2)"."""
    start = sketch.get_start(name)
    assert isinstance(start, env.PointsStart)
    position = format_position(*start.positions[number])
    return f"{format_numbered_name(sketch, name)}: position {number + 1} at {position}"


def _check_space(
    sketch: Sketch, name: str, free: MultiPolygon, radius: float, *, is_error: bool
) -> Iterator[Problem]:
    """Yield a problem if no robot with a radius, m, fits at a start."""
    start = sketch.get_start(name)
    label = format_numbered_name(sketch, name)
    try:
        env.Start(name, start, free).sample(1, radius=radius)
    except StartError:
        reason = f"a robot of radius {radius:g} m does not fit into"
        if isinstance(start, env.DiscStart):
            disc = shapely.Point(start.center).buffer(start.radius)
            message = f"{label}: {reason} its disc"
            yield Problem(message, disc, owner=name, is_error=is_error, kind="no space")
        else:
            yield Problem(f"{label}: {reason} the free space", None, owner=name, is_error=is_error)


def _list_warnings(
    sketch: Sketch, free: MultiPolygon, radius: float, skipped: set[Owner | None]
) -> Iterator[Problem]:
    """Yield warnings about likely mistakes; checks that need valid objects leave out those in `skipped`."""
    if BOUNDARY not in skipped:
        yield from _warn_of_outside_obstacles(sketch)
    yield from _warn_of_duplicates(sketch)
    yield from _warn_of_repeated_vertices(sketch)
    yield from _warn_of_blocked_paths(sketch, skipped)
    if free.is_empty:
        return
    yield from _warn_of_sealed_rooms(free, radius)
    for name, start in sketch.starts:
        if name in skipped:
            continue
        if isinstance(start, env.PointsStart):
            yield from _warn_of_tight_positions(sketch, name, free, radius)
        elif radius > DEFAULT_RADIUS_M:
            yield from _check_space(sketch, name, free, radius, is_error=False)


def _warn_of_outside_obstacles(sketch: Sketch) -> Iterator[Problem]:
    inside = Polygon(sketch.boundary)
    shapes = sketch.geometries
    shapely.prepare(inside)
    # An obstacle that only touches the boundary from outside has no effect either.
    is_outside = ~shapely.intersects(inside, shapes) | shapely.touches(inside, shapes)
    for index in np.flatnonzero(is_outside & ~shapely.is_empty(shapes)).tolist():
        key = sketch.obstacles[index].key
        message = f"{format_numbered_name(sketch, key)} lies outside the boundary"
        yield Problem(message, shapes[index], owner=key, is_error=False, kind="outside")


def _warn_of_duplicates(sketch: Sketch) -> Iterator[Problem]:
    seen: set[object] = set()
    for item in sketch.obstacles:
        fields = tuple(value for name, value in vars(item.shape).items() if name not in ("name", "polygon"))
        form = (type(item.shape), *fields)
        if form in seen and not item.geometry.is_empty:
            message = f"{format_numbered_name(sketch, item.key)} duplicates another obstacle"
            yield Problem(message, item.geometry, owner=item.key, is_error=False, kind="twice")
        seen.add(form)


def _warn_of_repeated_vertices(sketch: Sketch) -> Iterator[Problem]:
    for owner in sketch.owners:
        for _, ring, is_closed in sketch.list_rings(owner):
            repeated = _find_repeated_vertices(ring, is_closed)
            if repeated and len(set(ring)) >= 3:
                name = format_numbered_name(sketch, owner)
                position = format_position(*repeated[0])
                message = f"{name}: two vertices have the same position, {position}"
                yield Problem(message, MultiPoint(repeated), owner=owner, is_error=False, kind="double")


def _find_repeated_vertices(ring: Ring, is_closed: bool) -> list[Point]:
    """Return the vertices whose successor has the same position."""
    if len(set(ring)) == len(ring):
        return []
    line = ring
    if is_closed:
        line = (*ring, ring[0])
    return [point for point, following in pairwise(line) if point == following]


def _warn_of_blocked_paths(sketch: Sketch, skipped: set[Owner | None]) -> Iterator[Problem]:
    """Warn about moving obstacles whose path crosses obstacles at rest or the boundary."""
    checked = [item for item in sketch.obstacles if item.key not in skipped and not item.geometry.is_empty]
    static_geometries = {item.key: item.geometry for item in checked if item.shape.path is None}
    boundary_area = None
    if BOUNDARY not in skipped:
        boundary_area = Polygon(sketch.boundary)
    for item in checked:
        if item.shape.path is not None:
            yield from _check_path(sketch, item, static_geometries, boundary_area)


def _check_path(
    sketch: Sketch,
    item: Item,
    static_geometries: dict[int, shapely.Geometry],
    boundary_area: Polygon | None,
) -> Iterator[Problem]:
    """Warn if a moving obstacle passes through any of the obstacles at rest, or leaves the boundary."""
    assert item.shape.path is not None
    swept = env.compute_swept_area(item.shape.polygon, item.shape.path)
    overlaps, area_outside = env.find_overlaps(swept, static_geometries, boundary_area)
    names = [format_numbered_name(sketch, key) for key in overlaps]
    if area_outside is not None:
        names.append("the boundary")
    if names:
        area = shapely.union_all([*overlaps.values(), area_outside])
        message = f"{format_numbered_name(sketch, item.key)} moves through {summarize_names(names)}"
        yield Problem(message, area, owner=item.key, is_error=False)


def _warn_of_sealed_rooms(free: MultiPolygon, radius: float) -> Iterator[Problem]:
    """Warn about parts of the free space without an entrance; those smaller than a robot share a warning."""
    robot_area = math.pi * radius * radius
    others = list(free.geoms)[1:]
    pockets = [part for part in others if part.area < robot_area]
    rooms = others[: len(others) - len(pockets)]  # parts are sorted by area, the largest first
    for room in rooms:
        position = format_position(*room.representative_point().coords[0])
        message = f"the room of {format_area(room.area, 3)} around {position} is sealed: it has no entrance"
        yield Problem(message, room, is_error=False, kind="sealed")
    if pockets:
        area = sum(pocket.area for pocket in pockets)
        verb = "are" if len(pockets) > 1 else "is"
        count = format_count(len(pockets), "sealed pocket")
        message = f"{count} {verb} smaller than a robot, {format_area(area, 2)} in total"
        yield Problem(message, MultiPolygon(pockets), is_error=False, kind="sealed")


def _warn_of_tight_positions(
    sketch: Sketch, name: str, free: MultiPolygon, radius: float
) -> Iterator[Problem]:
    """Warn about positions of a start that are too close to a wall or to each other."""
    start = sketch.get_start(name)
    assert isinstance(start, env.PointsStart)
    points = shapely.points(to_array(start.positions))
    gaps = shapely.distance(points, free.boundary)
    for number in np.flatnonzero(gaps < radius).tolist():
        position = _describe_position(sketch, name, number)
        message = f"{position} is {gaps[number]:.3g} m from a wall: robots need {radius:g} m"
        yield Problem(message, points[number], owner=name, is_error=False, kind="spot")
    pairs = shapely.STRtree(points).query(points, predicate="dwithin", distance=2 * radius).T
    for i, j in sorted((i, j) for i, j in pairs.tolist() if i < j):
        gap = math.dist(start.positions[i], start.positions[j])
        if gap < 2 * radius:
            position = _describe_position(sketch, name, i)
            message = f"{position} and position {j + 1} are {gap:.3g} m apart: robots need {2 * radius:g} m"
            pair = MultiPoint([points[i], points[j]])
            yield Problem(message, pair, owner=name, is_error=False, kind="spot")
