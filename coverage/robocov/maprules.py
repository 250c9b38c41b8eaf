"""The geometric rules of a map: rings, holes, walls, sizes, free space, room at the starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Polygon

from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle
from robocov.errors import MapError, StartError
from robocov.mapmodels import LARGEST, SMALLEST
from robocov.robots import DEFAULT_RADIUS
from robocov.starts import DiscStart, PointsStart
from robocov.strictjson import place

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov.arrays import Array
    from robocov.environment import Ring

_FLAT = 1e-9
"""A ring whose area is below this part of its bounding box squared is a line."""


def check_rules(environment: Environment, where: str) -> None:
    """Check that `environment` can be simulated.

    Parameters
    ----------
    environment : Environment
    where : str
        What messages call the map: a file's name.

    Raises
    ------
    MapError
        One line with the first broken rule, and how many more there are.
    """
    problems = list(_ring_problems("boundary", environment.boundary))
    for k, obstacle in enumerate(environment.obstacles):
        problems += _obstacle_problems(place(("obstacles", k)), obstacle)
    if not problems:
        problems = list(_space_problems(environment))
    if problems:
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        raise MapError(f"{where}: {problems[0]}{more}")


def _ring_problems(at: str, ring: Ring) -> Iterator[str]:
    """Yield what is wrong with a closed ring of at least 3 points."""
    points = np.asarray(ring, dtype=float)
    extent = np.ptp(points, axis=0)
    count = len(np.unique(points, axis=0))
    if count < 3:
        yield f"{at}: {count} different point{'s' if count > 1 else ''}, but at least 3 were wanted"
        return
    size_problem = _size_problem(at, extent)
    if size_problem:
        yield size_problem
        return
    polygon = Polygon(points)
    # a ring that crosses itself may have no area either
    flat = _FLAT * float(extent.max()) ** 2
    if shapely.convex_hull(polygon).area <= flat:
        yield f"{at}: area {polygon.area:g} m², but points that are not on one line were wanted"
    elif not polygon.is_valid:
        yield _crossing(at, points, polygon)


def _size_problem(at: str, extent: Array) -> str | None:
    """Return what is wrong with the (2,) width and height of something."""
    size = f"{at}: {extent[0]:g} x {extent[1]:g} m"
    if extent.max() > LARGEST:
        return f"{size}, but at most {LARGEST / 1000:g} km was wanted"
    if extent.min() < SMALLEST:
        return f"{size}, but at least {SMALLEST * 1000:g} mm each way was wanted"
    return None


def _crossing(at: str, points: Array, polygon: Polygon) -> str:
    """Return the message for a ring that crosses or touches itself, with the two edges."""
    reason = shapely.is_valid_reason(polygon)
    spot = np.array([float(value) for value in reason[reason.index("[") + 1 : -1].split()])
    ends = np.roll(points, -1, axis=0)
    edges = shapely.linestrings(np.stack([points, ends], axis=1))
    distance = shapely.distance(edges, shapely.Point(spot))
    distance[(points == ends).all(axis=1)] = np.inf
    nearest = [int(k) for k in np.argsort(distance, kind="stable")[:6]]
    # neighbours in the ring always meet: name another edge if there is one at that spot
    apart = (k for k in nearest if (k - nearest[0]) % len(points) not in (0, 1, len(points) - 1))
    other = next((k for k in apart if distance[k] <= 1e-6), nearest[1])
    first, second = sorted((nearest[0], other))
    return (
        f"{at}[{first}]: the edge from here meets the edge from {at}[{second}] near "
        f"[{spot[0]:g}, {spot[1]:g}], but a ring that does not meet itself was wanted"
    )


def _obstacle_problems(at: str, obstacle: PolygonObstacle | CircleObstacle | WallObstacle) -> Iterator[str]:
    if isinstance(obstacle, PolygonObstacle):
        rings = [(f"{at}.vertices", obstacle.vertices)]
        rings += [(f"{at}.holes[{k}]", hole) for k, hole in enumerate(obstacle.holes)]
        found = [problem for path, ring in rings for problem in _ring_problems(path, ring)]
        yield from found
        if not found:
            yield from _hole_problems(at, obstacle)
    elif isinstance(obstacle, WallObstacle):
        points = np.asarray(obstacle.points, dtype=float)
        extent = np.ptp(points, axis=0)
        if extent.max() < SMALLEST:
            length = float(np.hypot(*np.diff(points, axis=0).T).sum())
            yield f"{at}.points: a wall {length:g} m long, but at least {SMALLEST * 1000:g} mm was wanted"
        elif extent.max() > LARGEST:
            size = f"{extent[0]:g} x {extent[1]:g} m"
            yield f"{at}.points: {size}, but at most {LARGEST / 1000:g} km was wanted"


def _hole_problems(at: str, obstacle: PolygonObstacle) -> Iterator[str]:
    """Yield what is wrong with the holes of a polygon whose rings are good one by one."""
    if obstacle.polygon.is_valid:
        return
    shell = Polygon(obstacle.vertices)
    good: list[Ring] = []
    for k, hole in enumerate(obstacle.holes):
        path = f"{at}.holes[{k}]"
        if not shell.covers(Polygon(hole)):
            yield f"{path}: sticks out of {at}.vertices, but a hole inside was wanted"
        elif not Polygon(obstacle.vertices, [*good, hole]).is_valid:
            yield f"{path}: meets the outline or another hole, but a hole apart from them was wanted"
        else:
            good.append(hole)


def _space_problems(environment: Environment) -> Iterator[str]:
    """Yield what is wrong with the map as a whole, once each part is good."""
    if len(environment.region.vertices) < 3:
        yield "boundary: its convex hull is a line, but a region with an area was wanted"
        return
    if environment.free.is_empty:
        yield "obstacles: no free space is left inside the boundary, but some was wanted"
        return
    for name in environment.starts:
        yield from _start_problems(environment, name)


def _start_problems(environment: Environment, name: str) -> Iterator[str]:
    at = place(("starts", name))
    spec = environment.starts[name]
    if isinstance(spec, PointsStart):
        points = np.asarray(spec.positions, dtype=float)
        inside = shapely.contains_properly(environment.free, shapely.points(points))
        for k in np.flatnonzero(~inside):
            yield (
                f"{at}.positions[{k}]: [{points[k, 0]:g}, {points[k, 1]:g}] is inside an obstacle or outside "
                f"the boundary, but a free place was wanted"
            )
        if len(np.unique(points, axis=0)) < len(points):
            yield f"{at}.positions: one place is given twice, but one place a robot was wanted"
        return
    try:
        environment.start(name).sample(1, radius=DEFAULT_RADIUS)
    except StartError:
        what = "the free space"
        if isinstance(spec, DiscStart):
            what = f"the disc of radius {spec.radius:g} m at [{spec.center[0]:g}, {spec.center[1]:g}]"
        yield f"{at}: {what} has no room, but room for a robot of radius {DEFAULT_RADIUS:g} m was wanted"
