"""Points, angles and outlines, rounded to tenths of a millimeter and limited to the range of maps."""

import math
from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import TypeAlias

import numpy as np
import shapely
from shapely import Polygon

from robocov.environment import Obstacle, Point, PolygonObstacle, Ring
from robocov.mapfile.models import MAX_COORDINATE_M, MAX_SIZE_M, MIN_SIZE_M
from robocov.typing import FloatArray
from robocov_app.editor.model import require
from robocov_app.toolkit.tools.geometry import compute_bearing

Box: TypeAlias = tuple[float, float, float, float]  # minimum x and y, maximum x and y, m
SHIFT_ROTATION_DEG = 15.0  # while Shift is held, rotations are a multiple of this angle
DECIMALS = 4  # decimal places of lengths in files, m: tenths of a millimeter
COMPARED_DECIMALS = range(3, 7)  # decimal places of two lengths in m; the first number that suffices is used
distance = math.dist


def round_length(length: float) -> float:
    """Round a length to tenths of a millimeter; never return minus zero."""
    # Adding 0.0 turns -0.0 into 0.0.
    return round(float(length), DECIMALS) + 0.0


def require_size(label: str, size: float, minimum: float = MIN_SIZE_M) -> None:
    """Raise MapError if a size, m, is out of range or nan; `label` is its name in the message."""
    is_in_range = minimum <= size <= MAX_SIZE_M
    limits = f"from {1000 * minimum:g} mm to {MAX_SIZE_M / 1000:g} km"
    require(is_in_range, f"expected a {label} {limits}")


def round_point(point: Iterable[float]) -> Point:
    """Round a point to tenths of a millimeter."""
    x, y = point
    return round_length(x), round_length(y)


def to_array(points: Sequence[Point] | FloatArray) -> FloatArray:
    """Return points as a (k, 2) array, m."""
    return np.asarray(points, dtype=float).reshape(-1, 2)


def round_ring(points: Sequence[Point] | FloatArray) -> Ring:
    """Round points to tenths of a millimeter; raise MapError if any is too far from the origin."""
    coordinates = to_array(points)
    # This comparison is also false for nan.
    is_within_reach = np.all(np.abs(coordinates) <= MAX_COORDINATE_M)
    limit = f"coordinates must be within {MAX_COORDINATE_M / 1000:.0f} km of the origin"
    require(is_within_reach, f"that is too far away: {limit}")
    return tuple([(x, y) for x, y in (np.round(coordinates, DECIMALS) + 0.0).tolist()])


def round_map_point(point: Point) -> Point:
    """Round a point to tenths of a millimeter; raise MapError if it is too far from the origin."""
    return round_ring([point])[0]


def drop_repeated_points(ring: Iterable[Point], *, is_closed: bool = True) -> Ring:
    """Remove points that equal the previous one; in a closed ring, also a last one that equals the first."""
    points = [point for point, _ in groupby(ring)]
    if is_closed and len(points) > 1 and points[0] == points[-1]:
        points.pop()
    return tuple(points)


def compute_leveling_angle(a: Point, b: Point) -> float:
    """Return the smallest rotation that makes the line from `a` to `b` horizontal or vertical, degrees."""
    return 90.0 * round(compute_bearing(a, b) / 90.0) - compute_bearing(a, b)


def build_rectangle(a: Point, b: Point) -> tuple[Point, Point, Point, Point]:
    """Return the four corners of an axis-aligned rectangle, given two opposite ones."""
    return a, (b[0], a[1]), b, (a[0], b[1])


def compute_center(box: Box) -> Point:
    """Return the center of a box, m."""
    return (box[0] + box[2]) / 2, (box[1] + box[3]) / 2


def enclose_boxes(boxes: Iterable[Box]) -> Box:
    """Return the common bounding box of several boxes, m."""
    low_x, low_y, high_x, high_y = zip(*boxes, strict=True)
    return min(low_x), min(low_y), max(high_x), max(high_y)


def extract_polygons(
    geometry: shapely.Geometry, original: Obstacle | None = None
) -> tuple[PolygonObstacle, ...]:
    """Convert the polygons of a geometry to obstacles, the largest first.

    They have the name and the path of the original obstacle, if there is one. Coordinates are
    rounded to tenths of a millimeter. Tiny polygons and holes are dropped.
    """
    snapped = shapely.simplify(shapely.set_precision(geometry, 10.0**-DECIMALS), 0.0)
    parts = [part for part in shapely.get_parts(snapped) if isinstance(part, Polygon) and not _is_tiny(part)]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    name = None if original is None else original.name
    path = None if original is None else original.path
    polygons = []
    for part in map(shapely.orient_polygons, parts):
        rings = [part.exterior, *(hole for hole in part.interiors if not _is_tiny(hole))]
        outline, *holes = [tuple(map(round_point, ring.coords[:-1])) for ring in rings]
        polygons.append(PolygonObstacle(outline, tuple(holes), name, path))
    return tuple(polygons)


def _is_tiny(part: shapely.Geometry) -> bool:
    low_x, low_y, high_x, high_y = part.bounds
    # `not` includes empty geometries, whose bounds are nan.
    return not min(high_x - low_x, high_y - low_y) >= MIN_SIZE_M


def format_bearing(a: Point, b: Point) -> str:
    """Format the distance and direction from one point to another, for example "2.40 m  ∠ 90°"."""
    angle = compute_bearing(a, b)
    if abs(angle) < 0.05:
        # Prevents "-0".
        angle = 0.0
    return f"{format_length(distance(a, b))}  ∠ {angle:.1f}".removesuffix(".0") + "°"


def format_length(meters: float) -> str:
    """Format a length, for example "2.3 cm", "12.35 m" or "1234.5 m"."""
    if meters < 0.1:
        return f"{100 * meters:.1f} cm"
    if meters < 1000:
        return f"{meters:.2f} m"
    return f"{meters:.1f} m"


def format_compared_lengths(first: float, second: float) -> tuple[str, str]:
    """Format two lengths, m, with as many decimals (3 to 6) as are needed to tell them apart.

    Examples
    --------
    >>> format_compared_lengths(0.05, 0.2)
    ('0.050 m', '0.200 m')
    >>> format_compared_lengths(0.1997, 0.2)
    ('0.1997 m', '0.2000 m')
    """
    text_pairs = [(f"{first:.{decimals}f} m", f"{second:.{decimals}f} m") for decimals in COMPARED_DECIMALS]
    for texts in text_pairs:
        if texts[0] != texts[1]:
            return texts
    return text_pairs[0]


def format_shift(dx: float, dy: float) -> str:
    """Format a shift in m, for example "Δx 2.00  Δy −3.00"."""
    # Adding 0.0 turns -0.0 into 0.0. A minus sign is as wide as a digit, unlike a hyphen.
    return f"Δx {round(dx, 2) + 0.0:.2f}  Δy {round(dy, 2) + 0.0:.2f}".replace("-", "−")


def format_point(point: Point) -> str:
    """Format a position, for example "(1.00, 2.50) m"."""
    x = round(point[0], 2) + 0.0  # never minus zero
    y = round(point[1], 2) + 0.0
    return f"({x:.2f}, {y:.2f}) m"
