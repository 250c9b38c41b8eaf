"""The geometric rules of a map: rings, holes, walls, sizes, free space, room at the starts."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from shapely import Polygon

from robocov.arrays import Array
from robocov.density import WeightedArea, WeightedPolygons
from robocov.environment import (
    START_GAP,
    DiscStart,
    Environment,
    PointsStart,
    PolygonObstacle,
    Ring,
    UniformStart,
    WallObstacle,
)
from robocov.errors import JsonPath, MapError, Mistake, StartError, place
from robocov.mapfile.models import LARGEST, SMALLEST
from robocov.robots import DEFAULT_RADIUS

_FLAT = 1e-9
"""A ring whose area is below this part of its bounding box squared is a line."""


def check_rules(environment: Environment, where: str) -> None:
    """Check that `environment`, which messages call `where`, can be simulated.

    Raises `MapError`: one line with the first broken rule, and how many more there are.
    """
    found = list(_ring_mistakes(("boundary",), environment.boundary))
    for k, obstacle in enumerate(environment.obstacles):
        at = ("obstacles", k)
        if isinstance(obstacle, PolygonObstacle):
            found += _polygon_mistakes(at, obstacle)
        elif isinstance(obstacle, WallObstacle):
            found += _line_mistakes((*at, "points"), obstacle.points, "wall")
        if obstacle.path is not None:
            found += _line_mistakes((*at, "path", "points"), obstacle.path.points, "path")
    if isinstance(environment.density, WeightedPolygons):
        for k, area in enumerate(environment.density.areas):
            found += _polygon_mistakes(("density", "areas", k), area)
    if not found:
        found = list(_space_mistakes(environment))
    if found:
        raise MapError.of(where, found)


def _ring_mistakes(at: JsonPath, ring: Ring) -> Iterator[Mistake]:
    """Yield what is wrong with a closed ring of at least 3 points."""
    points = np.asarray(ring, dtype=float)
    extent = points.max(axis=0) - points.min(axis=0)
    count = len(set(map(tuple, ring)))
    if count < 3:
        what = f"{count} different point{'s' if count > 1 else ''}, but at least 3 were wanted"
        yield Mistake.at(at, what)
        return
    if extent.max() > LARGEST:
        yield _too_large(at, extent)
        return
    if extent.min() < SMALLEST:
        yield Mistake.at(at, f"{_size(extent)}, but at least {SMALLEST * 1000:g} mm each way was wanted")
        return
    polygon = Polygon(points)
    flat = _FLAT * float(extent.max()) ** 2
    if polygon.is_valid and polygon.area > flat:
        return
    # a ring that crosses itself may have no area either
    if shapely.convex_hull(polygon).area <= flat:
        what = f"area {polygon.area:g} m², but points that are not on one line were wanted"
        yield Mistake.at(at, what)
    elif not polygon.is_valid:
        yield _crossing(at, points, polygon)


def _line_mistakes(at: JsonPath, line: Ring, thing: str) -> Iterator[Mistake]:
    """Yield what is wrong with the points of a wall or a path."""
    points = np.asarray(line, dtype=float)
    extent = np.ptp(points, axis=0)
    if extent.max() > LARGEST:
        yield _too_large(at, extent)
    elif extent.max() < SMALLEST:
        length = float(np.hypot(*np.diff(points, axis=0).T).sum())
        size = f"{length:g} m long" if thing == "wall" else f"{extent.max():g} m wide"
        yield Mistake.at(at, f"a {thing} {size}, but at least {SMALLEST * 1000:g} mm was wanted")


def _too_large(at: JsonPath, extent: Array) -> Mistake:
    return Mistake.at(at, f"{_size(extent)}, but at most {LARGEST / 1000:g} km was wanted")


def _size(extent: Array) -> str:
    return f"{extent[0]:g} x {extent[1]:g} m"


def _crossing(at: JsonPath, points: Array, polygon: Polygon) -> Mistake:
    """Return the mistake of a ring that crosses or touches itself, with the two edges."""
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
    return Mistake.at(
        (*at, first),
        f"the edge from here meets the edge from {place((*at, second))} near "
        f"[{spot[0]:g}, {spot[1]:g}], but a ring that does not meet itself was wanted",
    )


def _polygon_mistakes(at: JsonPath, shape: PolygonObstacle | WeightedArea) -> Iterator[Mistake]:
    found = list(_ring_mistakes((*at, "vertices"), shape.vertices))
    for k, hole in enumerate(shape.holes):
        found += _ring_mistakes((*at, "holes", k), hole)
    yield from found
    if found or shape.polygon.is_valid:
        return
    # each ring is good by itself
    shell = Polygon(shape.vertices)
    good: list[Ring] = []
    for k, hole in enumerate(shape.holes):
        path = (*at, "holes", k)
        if not shell.covers(Polygon(hole)):
            what = f"sticks out of {place((*at, 'vertices'))}, but a hole inside was wanted"
            yield Mistake.at(path, what)
        elif not Polygon(shape.vertices, [*good, hole]).is_valid:
            yield Mistake.at(path, "meets the outline or another hole, but a hole apart from them was wanted")
        else:
            good.append(hole)


def _space_mistakes(environment: Environment) -> Iterator[Mistake]:
    """Yield what is wrong with the map as a whole, once each part is good."""
    if len(environment.region.vertices) < 3:
        what = "its convex hull is a line, but a region with an area was wanted"
        yield Mistake.at(("boundary",), what)
        return
    if environment.free.is_empty:
        what = "no free space is left inside the boundary, but some was wanted"
        yield Mistake.at(("obstacles",), what)
        return
    density = environment.density
    # integrals take a second to load what they need
    if density is not None and not (density.lowest > 0.0 or environment.free_masses.sum() > 0.0):
        what = "all places in the free space count 0, but a weight above 0 was wanted"
        yield Mistake.at(("density",), what)
    for name in environment.starts:
        yield from _start_mistakes(environment, name)


def _start_mistakes(environment: Environment, name: str) -> Iterator[Mistake]:
    at = ("starts", name)
    spec = environment.starts[name]
    if isinstance(spec, PointsStart):
        points = np.asarray(spec.positions, dtype=float)
        inside = shapely.contains_properly(environment.free, shapely.points(points))
        for k in np.flatnonzero(~inside):
            yield Mistake.at(
                (*at, "positions", int(k)),
                f"[{points[k, 0]:g}, {points[k, 1]:g}] is inside an obstacle or outside the boundary, but a "
                f"free place was wanted",
            )
        if len(np.unique(points, axis=0)) < len(points):
            what = "one place is given twice, but one place a robot was wanted"
            yield Mistake.at((*at, "positions"), what)
        return
    if _plainly_has_room(environment, spec):
        return
    try:
        environment.start(name).sample(1, radius=DEFAULT_RADIUS)
    except StartError:
        what = "the free space"
        if isinstance(spec, DiscStart):
            what = f"the disc of radius {spec.radius:g} m at [{spec.center[0]:g}, {spec.center[1]:g}]"
        wanted = f"room for a robot of radius {DEFAULT_RADIUS:g} m was wanted"
        yield Mistake.at(at, f"{what} has no room, but {wanted}")


def _plainly_has_room(environment: Environment, spec: DiscStart | UniformStart) -> bool:
    """Return whether a robot fits with a centimetre to spare at the centre of a disc.

    A draw says the same, but of a large map it takes seconds.
    """
    discs = [spec] if isinstance(spec, DiscStart) else environment.starts.values()
    given = [disc.center for disc in discs if isinstance(disc, DiscStart)]
    if not given:
        return False
    centres = shapely.points(given)
    inside = shapely.contains_properly(environment.free, centres)
    clearance = shapely.distance(environment.free.boundary, centres)
    return bool((inside & (clearance > DEFAULT_RADIUS * (1 + START_GAP) + 0.01)).any())
