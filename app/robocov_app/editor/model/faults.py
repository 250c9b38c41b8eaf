"""What is wrong with the parts of a draft one by one: outlines, holes, walls, circles, discs, names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from shapely import LineString, MultiPoint, Polygon

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle
from robocov.mapfile.models import FARTHEST, LARGEST, SMALLEST

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from robocov.arrays import Array
    from robocov.environment import Obstacle, Point, Ring, StartSpec, WallObstacle

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
