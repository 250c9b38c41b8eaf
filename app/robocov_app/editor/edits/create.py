"""Edits that draw: obstacles, the boundary, starts."""

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
from robocov.errors import MapError
from robocov.mapfile.models import LARGEST, SMALLEST
from robocov_app.editor.model.geometry import distinct, point_near, rectangle, ring_near, tenths
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch, kind_and_name

SHORTEST = 0.02  # metres below which what is drawn is taken for a slip of the hand
_LONGEST_NAME = 100


def drawn(sketch: Sketch, shape: Obstacle) -> Change:
    """Put a new obstacle on top, and select it."""
    after, keys = sketch.added([shape])
    return Change(after, Selection.of(*keys), f"{kind_and_name(shape)} drawn")


def polygon_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Put a polygon down; it may cross itself, which `problems` will say."""
    return drawn(sketch, PolygonObstacle(_outline(points, "a polygon")))


def rectangle_drawn(sketch: Sketch, a: Point, b: Point) -> Change:
    """Put the rectangle with two opposite corners down."""
    low, high = ring_near(np.array([np.minimum(a, b), np.maximum(a, b)]))
    if min(high[0] - low[0], high[1] - low[1]) < SHORTEST:
        raise MapError("a rectangle needs a width and a height: drag from corner to corner")
    return replace(drawn(sketch, PolygonObstacle(rectangle(low, high))), words="rectangle drawn")


def circle_drawn(sketch: Sketch, center: Point, radius: float) -> Change:
    """Put a circle down."""
    return drawn(sketch, CircleObstacle(point_near(center), _radius(radius, "a circle")))


def wall_drawn(sketch: Sketch, points: Sequence[Point], width: float) -> Change:
    """Put a wall down."""
    line = distinct(ring_near(np.array(points, dtype=float).reshape(-1, 2)), closed=False)
    if len(line) < 2 or shapely.LineString(line).length < SHORTEST:
        raise MapError("a wall needs two points that are apart")
    if not SMALLEST <= width <= LARGEST:
        raise MapError(f"a wall's width is at least {1000 * SMALLEST:g} mm")
    return drawn(sketch, WallObstacle(line, tenths(width)))


def boundary_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Draw the boundary, in place of the one that there was."""
    words = "boundary drawn" if sketch.boundary is None else "boundary drawn anew"
    after = replace(sketch, boundary=_outline(points, "a boundary"))
    return Change(after, Selection(boundary=True), words)


def disc_start_drawn(sketch: Sketch, center: Point, radius: float) -> Change:
    """Add a start that is a disc."""
    return start_added(sketch, DiscStart(point_near(center), _radius(radius, "a start")))


def points_start_drawn(sketch: Sketch, points: Sequence[Point]) -> Change:
    """Add a start of given places."""
    places = tuple(dict.fromkeys(ring_near(np.array(points, dtype=float).reshape(-1, 2))))
    if not places:
        raise MapError("a start needs a place for a robot at least")
    return start_added(sketch, PointsStart(places))


def uniform_start_added(sketch: Sketch) -> Change:
    """Add a start anywhere in the free space."""
    return start_added(sketch, UniformStart())


def start_added(sketch: Sketch, spec: StartSpec) -> Change:
    """Add a start with a free name."""
    name = free_name(sketch, "start")
    return Change(sketch.with_start(name, spec), Selection.of(name), f"start “{name}” added")


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
    """Return a name as maps can have it."""
    name = encodable(" ".join(name.split()))
    if len(name) > _LONGEST_NAME:
        raise MapError(f"a name has at most {_LONGEST_NAME} characters")
    if any(ord(char) < 32 or ord(char) == 127 for char in name):
        raise MapError("a name is text on one line")
    return name


def encodable(text: str) -> str:
    """Return text without halves of characters, which no file could hold."""
    return text.encode("utf-8", "ignore").decode("utf-8")


def _outline(points: Sequence[Point], what: str) -> Ring:
    ring = distinct(ring_near(np.array(points, dtype=float).reshape(-1, 2)))
    if len(ring) < 3 or shapely.MultiPoint(ring).convex_hull.area < SHORTEST**2:
        raise MapError(f"{what} needs three corners that enclose something")
    return ring


def _radius(radius: float, what: str) -> float:
    if not SHORTEST <= radius <= LARGEST:
        raise MapError(f"{what} needs a radius: drag from its middle to its rim")
    return tenths(radius)
