"""Geometric rules of valid maps, beyond the structure of their files."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from shapely import Polygon

from robocov.arrays import compute_lengths
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.density import WeightedArea, WeightedPolygons
from robocov.environment import (
    MIN_START_GAP_RADII,
    DiscStart,
    Environment,
    PointsStart,
    PolygonObstacle,
    Ring,
    UniformStart,
    WallObstacle,
)
from robocov.errors import Issue, JsonPath, MapError, StartError, format_path, format_position
from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov.mapfile.structure import NO_WEIGHT
from robocov.typing import FloatArray

_MIN_HULL_AREA_RATIO = 1e-9
"""Minimum area of the convex hull of a ring, relative to its squared extent. A ring with a smaller hull
counts as a line."""
_MEETING_DISTANCE_M = 1e-6
"""Maximum distance between an edge and a point on it, because of rounding errors."""
_MAX_MEETING_EDGES = 6
"""Number of edges, nearest to a point, among which the two that meet there are searched for."""
_START_MARGIN_M = 0.01
"""Clearance beyond the minimum at a start, with which sampling a position certainly succeeds."""


def check_rules(environment: Environment, source_name: str) -> None:
    """Check the geometric rules of a map.

    Parameters
    ----------
    environment : Environment
        The map to check.
    source_name : str
        Name of the source in messages, such as the path of the file.

    Raises
    ------
    MapError
        If the map breaks a rule. The error lists the issues of the boundary, obstacles and density; if there
        are none, the issues in their combination.
    """
    issues = list(_find_ring_issues(("boundary",), environment.boundary))
    for k, obstacle in enumerate(environment.obstacles):
        path = ("obstacles", k)
        if isinstance(obstacle, PolygonObstacle):
            issues += _find_polygon_issues(path, obstacle)
        elif isinstance(obstacle, WallObstacle):
            issues += _find_line_issues((*path, "points"), obstacle.points, "wall")
        if obstacle.path is not None:
            issues += _find_line_issues((*path, "path", "points"), obstacle.path.points, "path")
    if isinstance(environment.density, WeightedPolygons):
        for k, area in enumerate(environment.density.areas):
            issues += _find_polygon_issues(("density", "areas", k), area)
    if not issues:
        issues = list(_find_space_issues(environment))
    if issues:
        raise MapError.from_issues(source_name, issues)


def _find_ring_issues(path: JsonPath, ring: Ring) -> Iterator[Issue]:
    """Yield the first issue, if any, with a closed ring of at least 3 points."""
    points = np.asarray(ring, dtype=float)
    extent = np.ptp(points, axis=0)
    size = f"{extent[0]:g} x {extent[1]:g} m"
    point_count = len(set(map(tuple, ring)))
    if point_count < 3:
        yield Issue.at_path(path, f"expected at least 3 different points, got {point_count}")
        return
    if extent.max() > MAX_SIZE_M:
        yield Issue.at_path(path, f"expected at most {MAX_SIZE_M / 1000:g} km, got {size}")
        return
    if extent.min() < MIN_SIZE_M:
        message = f"expected at least {MIN_SIZE_M * 1000:g} mm in both directions, got {size}"
        yield Issue.at_path(path, message)
        return
    polygon = Polygon(points)
    # The area of a ring that crosses itself may be 0, while the area of its hull is not.
    if shapely.convex_hull(polygon).area <= _MIN_HULL_AREA_RATIO * float(extent.max()) ** 2:
        message = f"expected points that are not on one line, got an area of {polygon.area:g} m²"
        yield Issue.at_path(path, message)
    elif not polygon.is_valid:
        yield _build_crossing_issue(path, points, polygon)


def _find_line_issues(path: JsonPath, line: Ring, noun: str) -> Iterator[Issue]:
    """Yield the issue with the points of a wall or a path."""
    points = np.asarray(line, dtype=float)
    extent = np.ptp(points, axis=0)
    if extent.max() > MAX_SIZE_M:
        message = f"expected at most {MAX_SIZE_M / 1000:g} km, got {extent[0]:g} x {extent[1]:g} m"
        yield Issue.at_path(path, message)
    elif extent.max() < MIN_SIZE_M:
        length = float(compute_lengths(np.diff(points, axis=0)).sum())
        message = f"expected a {noun} of at least {MIN_SIZE_M * 1000:g} mm, got {length:g} m"
        yield Issue.at_path(path, message)


def _build_crossing_issue(path: JsonPath, points: FloatArray, polygon: Polygon) -> Issue:
    """Build the issue for a ring that crosses or touches itself, with the two edges that meet."""
    reason = shapely.is_valid_reason(polygon)
    # The reason ends with the coordinates of a point, as in "Self-intersection[5 5]".
    x, y = (float(number) for number in reason[reason.index("[") + 1 : -1].split())
    ends = np.roll(points, -1, axis=0)
    edges = shapely.linestrings(np.stack([points, ends], axis=1))
    distances = shapely.distance(edges, shapely.Point(x, y))
    distances[(points == ends).all(axis=1)] = np.inf
    nearest_edges = np.argsort(distances, kind="stable")[:_MAX_MEETING_EDGES].tolist()
    first = nearest_edges[0]
    second = nearest_edges[1]
    # Two consecutive edges always meet. If another edge passes through the point as well, name this one.
    for edge in nearest_edges:
        is_neighbor = (edge - first) % len(points) in (0, 1, len(points) - 1)
        if not is_neighbor and distances[edge] <= _MEETING_DISTANCE_M:
            second = edge
            break
    first, second = sorted((first, second))
    other_edge = format_path((*path, second))
    message = f"the edge from here meets the edge from {other_edge} near {format_position(x, y)}"
    return Issue.at_path(
        (*path, first), f"{message}, expected a ring that neither crosses nor touches itself"
    )


def _find_polygon_issues(path: JsonPath, shape: PolygonObstacle | WeightedArea) -> Iterator[Issue]:
    """Yield the issues with a polygon and its holes."""
    issues = list(_find_ring_issues((*path, "vertices"), shape.vertices))
    for k, hole in enumerate(shape.holes):
        issues += _find_ring_issues((*path, "holes", k), hole)
    if issues or shape.polygon.is_valid:
        yield from issues
        return
    # Each ring is valid by itself, but the polygon with its holes is not.
    outline = Polygon(shape.vertices)
    valid_holes: list[Ring] = []
    for k, hole in enumerate(shape.holes):
        hole_path = (*path, "holes", k)
        if not outline.covers(Polygon(hole)):
            message = f"sticks out of {format_path((*path, 'vertices'))}, expected a hole inside it"
            yield Issue.at_path(hole_path, message)
        elif not Polygon(shape.vertices, [*valid_holes, hole]).is_valid:
            message = "meets the outline or another hole, expected a hole apart from them"
            yield Issue.at_path(hole_path, message)
        else:
            valid_holes.append(hole)


def _find_space_issues(environment: Environment) -> Iterator[Issue]:
    """Yield the issues in the combination of boundary, obstacles, density and starts."""
    if len(environment.region.vertices) < 3:
        yield Issue.at_path(("boundary",), "expected a region with an area, got a line as its convex hull")
        return
    if environment.free.is_empty:
        yield Issue.at_path(("obstacles",), "no free space is left inside the boundary")
        return
    density = environment.density
    # Integrate the density only if necessary, because importing the modules for this takes a second.
    if density is not None and not (density.lower_bound > 0.0 or environment.free_masses.sum() > 0.0):
        yield Issue.at_path(("density",), f"{NO_WEIGHT} in the free space")
    for name, start in environment.starts.items():
        if isinstance(start, PointsStart):
            yield from _find_position_issues(environment, name, start)
        else:
            yield from _find_capacity_issues(environment, name, start)


def _find_position_issues(environment: Environment, name: str, start: PointsStart) -> Iterator[Issue]:
    """Yield the issues in the positions of a start."""
    path = ("starts", name, "positions")
    points = np.asarray(start.positions, dtype=float)
    is_free = shapely.contains_properly(environment.free, shapely.points(points))
    for k in np.flatnonzero(~is_free).tolist():
        position = format_position(points[k, 0], points[k, 1])
        message = f"{position} is inside an obstacle or outside the boundary, expected a free position"
        yield Issue.at_path((*path, k), message)
    if len(np.unique(points, axis=0)) < len(points):
        yield Issue.at_path(path, "duplicate position, expected one for each robot")


def _find_capacity_issues(
    environment: Environment, name: str, start: DiscStart | UniformStart
) -> Iterator[Issue]:
    """Yield an issue if a robot of the default size does not fit at a start."""
    if _fits_at_disc_center(environment, start):
        return
    try:
        environment.start(name).sample(1, radius=DEFAULT_RADIUS_M)
    except StartError:
        area = "the free space"
        if isinstance(start, DiscStart):
            x, y = start.center
            area = f"the disc of radius {start.radius:g} m at {format_position(x, y)}"
        message = f"a robot of radius {DEFAULT_RADIUS_M:g} m does not fit into {area}"
        yield Issue.at_path(("starts", name), message)


def _fits_at_disc_center(environment: Environment, start: DiscStart | UniformStart) -> bool:
    """Return whether a robot fits at the center of a start disc, which is faster to check than sampling.

    For a uniform start, the discs of all starts are checked: a robot that fits in one of them fits in the
    map.
    """
    starts = [start] if isinstance(start, DiscStart) else environment.starts.values()
    centers = [disc.center for disc in starts if isinstance(disc, DiscStart)]
    points = shapely.points(np.reshape(centers, (-1, 2)))
    is_free = shapely.contains_properly(environment.free, points)
    clearances = shapely.distance(environment.free.boundary, points)
    min_clearance = DEFAULT_RADIUS_M * (1 + MIN_START_GAP_RADII) + _START_MARGIN_M
    return bool((is_free & (clearances > min_clearance)).any())
