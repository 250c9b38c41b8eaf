"""Points, angles and outlines, to a tenth of a millimeter and within the reach of maps."""

import math
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import TypeAlias

import numpy as np
import shapely
from shapely import Polygon

from robocov.arrays import Array
from robocov.environment import Point, PolygonObstacle, Ring
from robocov.mapfile.models import MAX_COORDINATE_M, MIN_SIZE_M
from robocov_app.editor.model import require
from robocov_app.toolkit.tools.geometry import compute_bearing, compute_cos_sin

Box: TypeAlias = tuple[float, float, float, float]  # low x, low y, high x, high y, m
SHIFT_ANGLE_DEG = 15.0  # with Shift, lines are drawn at multiples of this
DECIMALS = 4  # decimal places of the lengths that the editor writes, m
distance = math.dist


def round_length(length: float) -> float:
    """Return a length to a tenth of a millimeter, never minus zero."""
    return round(float(length), DECIMALS) + 0.0


def round_point(point: Iterable[float]) -> Point:
    """Return a point to a tenth of a millimeter."""
    x, y = point
    return round_length(x), round_length(y)


def to_array(points: Sequence[Point] | Array) -> Array:
    """Return points as a (k, 2) array, m."""
    return np.asarray(points, dtype=float).reshape(-1, 2)


def round_ring(points: Sequence[Point] | Array) -> Ring:
    """Return points to a tenth of a millimeter; raise MapError if any is beyond the reach of maps."""
    coordinates = to_array(points)
    # Written so that nan is too far away, too.
    is_within_reach = np.all(np.abs(coordinates) <= MAX_COORDINATE_M)
    limit = f"maps reach {MAX_COORDINATE_M / 1000:.0f} km from their origin"
    require(is_within_reach, f"that is too far away: {limit}")
    return tuple([(x, y) for x, y in (np.round(coordinates, DECIMALS) + 0.0).tolist()])


def check_point(point: Point) -> Point:
    """Return a point to a tenth of a millimeter; raise MapError if it is beyond the reach of maps."""
    return round_ring([point])[0]


def drop_repeated_points(ring: Iterable[Point], *, closed: bool = True) -> Ring:
    """Return points without those that repeat the one before; closed rings also at their end."""
    points = [point for point, _ in groupby(ring)]
    if closed and len(points) > 1 and points[0] == points[-1]:
        points.pop()
    return tuple(points)


def compute_levelling_angle(a: Point, b: Point) -> float:
    """Return the angle by which a line must turn to be level or upright, whichever is nearer, degrees."""
    return 90.0 * round(compute_bearing(a, b) / 90.0) - compute_bearing(a, b)


def constrain_angle(origin: Point, point: Point) -> Point:
    """Return the nearest point on a line through `origin` at a multiple of `SHIFT_ANGLE_DEG`."""
    cos, sin = compute_cos_sin(SHIFT_ANGLE_DEG * round(compute_bearing(origin, point) / SHIFT_ANGLE_DEG))
    along = (point[0] - origin[0]) * cos + (point[1] - origin[1]) * sin
    return round(origin[0] + along * cos, 9) + 0.0, round(origin[1] + along * sin, 9) + 0.0


def build_rectangle(a: Point, b: Point) -> tuple[Point, Point, Point, Point]:
    """Return the corners of a rectangle between two opposite ones."""
    return a, (b[0], a[1]), b, (a[0], b[1])


def compute_center(box: Box) -> Point:
    """Return the center of a box, m."""
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def enclose_boxes(boxes: Iterable[Box]) -> Box:
    """Return the bounding box of boxes, m."""
    low_x, low_y, high_x, high_y = zip(*boxes, strict=True)
    return min(low_x), min(low_y), max(high_x), max(high_y)


def extract_polygons(geometry: shapely.Geometry, name: str | None = None) -> tuple[PolygonObstacle, ...]:
    """Return the polygons of a geometry to a tenth of a millimeter, the largest first, without tiny ones."""
    snapped = shapely.simplify(shapely.set_precision(geometry, 10.0**-DECIMALS), 0.0)
    parts = [part for part in shapely.get_parts(snapped) if isinstance(part, Polygon) and not _is_tiny(part)]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    polygons = []
    for part in map(shapely.orient_polygons, parts):
        rings = [part.exterior, *(hole for hole in part.interiors if not _is_tiny(hole))]
        outline, *holes = [tuple(map(round_point, ring.coords[:-1])) for ring in rings]
        polygons.append(PolygonObstacle(outline, tuple(holes), name))
    return tuple(polygons)


def _is_tiny(part: shapely.Geometry) -> bool:
    low_x, low_y, high_x, high_y = part.bounds
    # Written so that an empty geometry, whose bounds are nan, is tiny, too.
    return not min(high_x - low_x, high_y - low_y) >= MIN_SIZE_M


def format_bearing(a: Point, b: Point) -> str:
    """Format length and direction from a point to another: "2.40 m  ∠ 90°"."""
    angle = compute_bearing(a, b)
    if abs(angle) < 0.05:
        # Otherwise it could become "-0".
        angle = 0.0
    return f"{format_length(distance(a, b))}  ∠ {angle:.1f}".removesuffix(".0") + "°"


def format_length(meters: float) -> str:
    """Format a length: "2.3 cm", "12.35 m", "1234.5 m"."""
    if meters < 0.1:
        return f"{100 * meters:.1f} cm"
    if meters < 1000:
        return f"{meters:.2f} m"
    return f"{meters:.1f} m"


def format_point(point: Point) -> str:
    """Format a position: "(1.00, 2.50) m"."""
    x = round(point[0], 2) + 0.0  # never minus zero
    y = round(point[1], 2) + 0.0
    return f"({x:.2f}, {y:.2f}) m"
