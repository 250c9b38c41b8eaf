"""Points, angles and outlines of the plane: to the tenth of a millimetre, within reach."""

import math
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.environment import Point, PolygonObstacle, Ring
from robocov.errors import MapError
from robocov.mapfile.models import FARTHEST, SMALLEST

ANGLE = 15.0  # degrees: with Shift, lines are drawn at multiples of this
DECIMALS = 4  # digits after the decimal point of what the editor writes: a tenth of a millimetre


def rounded(point: Iterable[float]) -> Point:
    """Return a point to the tenth of a millimetre, without minus zeros.

    >>> rounded((0.1 + 0.2, -0.00001))
    (0.3, 0.0)
    """
    x, y = point
    return tenths(x), tenths(y)


def tenths(length: float) -> float:
    """Return a length to the tenth of a millimetre.

    >>> tenths(2 / 3)
    0.6667
    """
    return round(float(length), DECIMALS) + 0.0


def ring_near(points: Array) -> Ring:
    """Return (n, 2) points to the tenth of a millimetre; MapError where one is farther than maps reach."""
    if not np.all(np.abs(points) <= FARTHEST):  # nan is not near either
        raise MapError(f"that is too far away: maps reach {FARTHEST / 1000:.0f} km from their origin")
    return tuple([(x, y) for x, y in (np.round(points, DECIMALS) + 0.0).tolist()])


def point_near(point: Point) -> Point:
    """Return a point to the tenth of a millimetre, as `ring_near` does."""
    return ring_near(np.array([point], dtype=float))[0]


def distinct(ring: Iterable[Point], *, closed: bool = True) -> Ring:
    """Return points without those that repeat the one before; of a closed ring the last is before the first.

    >>> distinct([(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 0.0)])
    ((0.0, 0.0), (1.0, 0.0))
    """
    kept: list[Point] = []
    for point in ring:
        if not kept or point != kept[-1]:
            kept.append(point)
    if closed and len(kept) > 1 and kept[0] == kept[-1]:
        kept.pop()
    return tuple(kept)


def nearest_on(starts: Array, ends: Array, point: Array) -> Array:
    """Return for k edges the (k, 2) places that are nearest to a point."""
    along = ends - starts
    squared = np.einsum("kd,kd->k", along, along)
    part = np.einsum("kd,kd->k", point - starts, along) / np.where(squared > 0.0, squared, 1.0)
    return np.asarray(starts + np.clip(part, 0.0, 1.0)[:, None] * along)


def distance(a: Point, b: Point) -> float:
    """Return the distance of two points, m."""
    return float(np.hypot(a[0] - b[0], a[1] - b[1]))


def cos_sin(degrees: float) -> tuple[float, float]:
    """Return cosine and sine of an angle, exact at quarters of a turn.

    >>> cos_sin(-90.0)
    (0.0, -1.0)
    """
    quarters, rest = divmod(degrees, 90.0)
    if rest == 0.0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def angle_to_level(a: Point, b: Point) -> float:
    """Return by how many degrees a line has to be turned to be level or upright, whichever is nearer.

    >>> angle_to_level((1.0, 1.0), (1.0, 3.0)), angle_to_level((0.0, 0.0), (1.0, 1.0))
    (0.0, -45.0)
    """
    angle = math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))
    return 90.0 * round(angle / 90.0) - angle


def rectangle(a: Point, b: Point) -> tuple[Point, Point, Point, Point]:
    """Return the corners of the rectangle with two opposite corners, beginning with the first."""
    return a, (b[0], a[1]), b, (a[0], b[1])


def outlines(geometry: BaseGeometry, name: str | None = None) -> tuple[PolygonObstacle, ...]:
    """Return the polygons of a geometry, to tenths of a millimetre, the largest first, without crumbs."""
    snapped = shapely.simplify(shapely.set_precision(geometry, 10.0**-DECIMALS), 0.0)
    parts = [part for part in shapely.get_parts(snapped) if isinstance(part, Polygon) and not _is_crumb(part)]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    found = []
    for part in map(shapely.orient_polygons, parts):
        rings = [part.exterior, *(hole for hole in part.interiors if not _is_crumb(hole))]
        outline, *holes = [tuple(map(rounded, ring.coords[:-1])) for ring in rings]
        found.append(PolygonObstacle(outline, tuple(holes), name))
    return tuple(found)


def _is_crumb(part: BaseGeometry) -> bool:
    low_x, low_y, high_x, high_y = part.bounds
    return not min(high_x - low_x, high_y - low_y) >= SMALLEST  # of what is empty these are no numbers


def at_round_angle(origin: Point, point: Point) -> Point:
    """Return the point on the nearest line at a multiple of `ANGLE` degrees through another.

    >>> at_round_angle((0.0, 0.0), (3.0, 0.1))
    (3.0, 0.0)
    """
    dx, dy = point[0] - origin[0], point[1] - origin[1]
    step = np.radians(ANGLE)
    angle = step * np.round(np.arctan2(dy, dx) / step)
    along = dx * np.cos(angle) + dy * np.sin(angle)
    x, y = origin[0] + along * np.cos(angle), origin[1] + along * np.sin(angle)
    return round(float(x), 9) + 0.0, round(float(y), 9) + 0.0


def ring_area(points: Sequence[Point]) -> float:
    """Return the area of a ring, m².

    >>> ring_area([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)])
    2.0
    """
    x, y = np.asarray(points).T
    return float(abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2)


def bearing_words(a: Point, b: Point) -> str:
    """Return length and direction from one point to another, in words.

    >>> bearing_words((0.0, 0.0), (0.0, 2.4))
    '2.40 m  ∠ 90°'
    """
    angle = float(np.degrees(np.arctan2(b[1] - a[1], b[0] - a[0])))
    shown = 0.0 if abs(angle) < 0.05 else angle
    return f"{length_words(distance(a, b))}  ∠ {shown:.1f}".removesuffix(".0") + "°"


def length_words(metres: float) -> str:
    """Return a length as it stands beside the cursor.

    >>> length_words(0.0234), length_words(12.3456), length_words(1234.5)
    ('2.3 cm', '12.35 m', '1234.5 m')
    """
    if metres < 0.1:
        return f"{100 * metres:.1f} cm"
    return f"{metres:.2f} m" if metres < 1000 else f"{metres:.1f} m"


def point_words(point: Point) -> str:
    """Return a place in words.

    >>> point_words((1.0, -0.001))
    '(1.00, 0.00) m'
    """
    x, y = (round(value, 2) + 0.0 for value in point)
    return f"({x:.2f}, {y:.2f}) m"
