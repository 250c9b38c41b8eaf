"""What is drawn: obstacles, the boundary, starts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from robocov.environment import (
    CircleObstacle,
    DiscStart,
    Obstacle,
    Point,
    PointsStart,
    PolygonObstacle,
    Ring,
    StartSpec,
    UniformStart,
    WallObstacle,
)
from robocov.errors import MapError, one_line
from robocov.mapfile.models import LARGEST, SMALLEST
from robocov_app.editor.model.geometry import ring_near, tenths
from robocov_app.editor.model.selection import Change, Selection, display_name
from robocov_app.editor.model.sketch import Sketch
from robocov_app.viewer.session.map_edits import SHORTEST, words_for

_LONGEST_NAME = 100


def drawn(sketch: Sketch, shape: Obstacle) -> Change:
    """Put a new obstacle on top, and select it."""
    after, keys = sketch.added([shape])
    return Change(after, Selection.of(*keys), f"{words_for(shape)} drawn")


def polygon_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Put a polygon down; it may cross itself, which `problems` will say."""
    ring = _ring(points)
    if len(ring) < 3 or shapely.MultiPoint(ring).convex_hull.area < SHORTEST**2:
        raise MapError("a polygon needs three corners that enclose something")
    return drawn(sketch, PolygonObstacle(ring))


def rectangle_drawn(sketch: Sketch, a: Point, b: Point) -> Change:
    """Put the rectangle with two opposite corners down."""
    low, high = ring_near(np.array([np.minimum(a, b), np.maximum(a, b)]))
    if min(high[0] - low[0], high[1] - low[1]) < SHORTEST:
        raise MapError("a rectangle needs a width and a height: drag from corner to corner")
    ring = (low, (high[0], low[1]), high, (low[0], high[1]))
    change = drawn(sketch, PolygonObstacle(ring))
    return replace(change, words="rectangle drawn")


def circle_drawn(sketch: Sketch, center: Point, radius: float) -> Change:
    """Put a circle down."""
    (place,) = ring_near(np.array([center], dtype=float))
    if not SHORTEST <= radius <= LARGEST:
        raise MapError("a circle needs a radius: drag from its middle to its rim")
    return drawn(sketch, CircleObstacle(place, tenths(radius)))


def wall_drawn(sketch: Sketch, points: Sequence[Point], width: float) -> Change:
    """Put a wall down."""
    line = _ring(points, closed=False)
    if len(line) < 2 or shapely.LineString(line).length < SHORTEST:
        raise MapError("a wall needs two points that are apart")
    if not SMALLEST <= width <= LARGEST:
        raise MapError(f"a wall's width is at least {1000 * SMALLEST:g} mm")
    return drawn(sketch, WallObstacle(line, tenths(width)))


def boundary_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Draw the boundary, in place of the one that there was."""
    ring = _ring(points)
    if len(ring) < 3 or shapely.MultiPoint(ring).convex_hull.area < SHORTEST**2:
        raise MapError("a boundary needs three corners that enclose something")
    words = "boundary drawn" if sketch.boundary is None else "boundary drawn anew"
    return Change(replace(sketch, boundary=ring), Selection(boundary=True), words)


def disc_start_drawn(sketch: Sketch, center: Point, radius: float, name: str | None = None) -> Change:
    """Add a start that is a disc; without a name it gets a free one."""
    (place,) = ring_near(np.array([center], dtype=float))
    if not SHORTEST <= radius <= LARGEST:
        raise MapError("a start needs a radius: drag from its middle to its rim")
    return _started(sketch, name, DiscStart(place, tenths(radius)))


def points_start_drawn(sketch: Sketch, points: Sequence[Point], name: str | None = None) -> Change:
    """Add a start of given places; without a name it gets a free one."""
    places = tuple(dict.fromkeys(ring_near(np.array(points, dtype=float).reshape(-1, 2))))
    if not places:
        raise MapError("a start needs a place for a robot at least")
    return _started(sketch, name, PointsStart(places))


def uniform_start_added(sketch: Sketch, name: str | None = None) -> Change:
    """Add a start anywhere in the free space."""
    return _started(sketch, name, UniformStart())


def start_point_added(sketch: Sketch, name: str, point: Point) -> Change:
    """Add a place to a start that is made of places."""
    spec = dict(sketch.starts).get(name)
    if not isinstance(spec, PointsStart):
        raise MapError(f"there is no start “{one_line(name)}” that is made of places")
    (place,) = ring_near(np.array([point], dtype=float))
    if place in spec.positions:
        raise MapError("there is a robot's place already")
    after = sketch.with_start(name, PointsStart((*spec.positions, place)))
    return Change(after, Selection.of(name), f"place added to {display_name(sketch, name)}")


def free_name(sketch: Sketch, name: str) -> str:
    """Return a name for a start that no start has yet: this one, or with a number after it.

    >>> free_name(Sketch(starts=(("start", UniformStart()),)), "start")
    'start 2'
    """
    taken = {each for each, _ in sketch.starts}
    stem = re.sub(r" \d+$", "", name)
    count = 2
    while name in taken:
        name = f"{stem} {count}"
        count += 1
    return name


def label_of(name: str) -> str:
    """Return a name as maps can have it.

    Raises
    ------
    MapError
        When it is too long, or not text on one line.
    """
    name = encodable(" ".join(name.split()))
    if len(name) > _LONGEST_NAME:
        raise MapError(f"a name has at most {_LONGEST_NAME} characters")
    if any(ord(char) < 32 or ord(char) == 127 for char in name):
        raise MapError("a name is text on one line")
    return name


def encodable(text: str) -> str:
    """Return text without halves of characters, which no file could hold."""
    return text.encode("utf-8", "ignore").decode("utf-8")


def _started(sketch: Sketch, name: str | None, spec: StartSpec) -> Change:
    name = label_of(name or "") or free_name(sketch, "start")
    if name in dict(sketch.starts):
        raise MapError(f"there is a start “{name}” already")
    return Change(sketch.with_start(name, spec), Selection.of(name), f"start “{name}” added")


def _ring(points: Sequence[Point], *, closed: bool = True) -> Ring:
    """Return points to the tenth of a millimetre, without those that repeat the one before."""
    ring: list[Point] = []
    for point in ring_near(np.array(points, dtype=float).reshape(-1, 2)):
        if not ring or point != ring[-1]:
            ring.append(point)
    if closed and len(ring) > 1 and ring[0] == ring[-1]:
        ring.pop()
    return tuple(ring)
