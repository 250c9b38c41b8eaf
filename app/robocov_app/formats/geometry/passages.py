"""Gaps that a robot passed before walls moved, and does not pass now."""

import math

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, STRtree

from robocov.arrays import Array, IntArray
from robocov.environment import Point
from robocov_app.formats.geometry.polygons import sides_of

_CHUNK = 2048  # sides that are looked at together, which bounds the memory
_SQUARES = 1024  # so many squares are looked at more closely, at each size
# so many sides may be crossed by the rays that tell whether squares of one size, and gaps, are inside
_SQUARED_WORK, _WORK = 5_000_000, 300_000_000
_QUARTERS = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)])
_MOST_GAPS = 200_000  # so many gaps are looked at
_CLEARLY = 1 + 1e-6  # a gap of just a robot's diameter is none


def rooms(free: MultiPolygon, radius: float) -> list[Polygon]:
    """Return where the centre of a robot may be, each place that it cannot leave, but for tiny ones."""
    inner = free.buffer(-radius, quad_segs=4)
    return [part for part in shapely.get_parts(inner).tolist() if part.area > radius * radius / 4]


def roomiest(free: Polygon, tolerance: float, enough: float = math.inf) -> tuple[Point, float]:
    """Return the place farthest from the walls, and how far that is, m; or any that is far `enough`.

    Squares that may hold a place better by `tolerance` are cut into four, `_SQUARES` of the most promising:
    where there are more, as in a long hall, another place may be a bit better.
    """
    sides = shapely.linestrings(sides_of(free))
    walls = STRtree(sides)
    shapely.prepare(free)
    low_x, low_y, high_x, high_y = free.bounds
    width, height = high_x - low_x, high_y - low_y
    some = np.linspace(low_y, high_y, _SQUARES)
    squares = max(min(_SQUARES, _SQUARES * _SQUARED_WORK // max(_rays(sides, some), 1)), 16)
    side = max(min(width, height), max(width, height) / squares)
    corners = np.meshgrid(np.arange(low_x, high_x, side), np.arange(low_y, high_y, side))
    centres = np.stack(corners, axis=-1).reshape(-1, 2) + side / 2
    best, place = -math.inf, centres[0]
    while len(centres) and best < enough:
        _, away = walls.query_nearest(shapely.points(centres), return_distance=True, all_matches=False)
        away = np.where(shapely.contains_xy(free, *centres.T), away, -away)
        if away.max() > best:
            best, place = float(away.max()), centres[away.argmax()]
        hopeful = away + side * math.sqrt(0.5)
        order = np.argsort(-hopeful, kind="stable")[:squares]
        better = best + tolerance if enough == math.inf else max(best + tolerance, enough)
        centres = centres[order[hopeful[order] > better]]
        side /= 2
        centres = (centres[:, None] + side / 2 * _QUARTERS).reshape(-1, 2)
    return (float(place[0]), float(place[1])), best


def moved_walls(before: MultiPolygon, after: MultiPolygon) -> tuple[float, float]:
    """Return what area, m², was free and is not, or is and was not; and how far walls moved, m, at most."""
    distance = 0.0
    for one, other in ((before, after), (after, before)):
        points = shapely.points(np.unique(shapely.get_coordinates(one), axis=0))
        walls = STRtree(shapely.linestrings(sides_of(other)))
        _, away = walls.query_nearest(points, return_distance=True, all_matches=False)
        distance = max(distance, float(away.max()))
    return float(shapely.symmetric_difference(before, after).area), distance


def _rays(sides: Array, y: Array) -> int:
    """Return how many sides horizontal lines at `y` cross, together: the cost of telling what is inside."""
    bounds = shapely.bounds(sides)
    low, high = np.sort(bounds[:, 1]), np.sort(bounds[:, 3])
    return int((np.searchsorted(low, y, side="right") - np.searchsorted(high, y)).sum())


def closed_gaps(
    sides: Array, paths: Array, free: MultiPolygon, width: float, moved: float
) -> tuple[IntArray, Array] | None:
    """Return the (p, 2) sides and the middles of gaps that are too narrow now; None if they are too many.

    A gap is where two `sides`, (m, 2, 2), of walls as they are now face each other across the `free` space.
    It was wide enough for a robot of diameter `width` if the walls as they were, `paths`, (m,) linestrings,
    are further apart there; none has `moved` further than so many metres.
    """
    lines = shapely.linestrings(sides)
    tree = STRtree(lines)
    pairs = np.empty((0, 2), dtype=np.intp)
    for begin in range(0, len(lines), _CHUNK):
        one, other = tree.query(lines[begin : begin + _CHUNK], predicate="dwithin", distance=width)
        one += begin
        # neighbours meet in a corner; and two walls that are far closer now were close before
        apart = (one < other) & (sides[one, 1] != sides[other, 0]).any(axis=1)
        apart &= (sides[other, 1] != sides[one, 0]).any(axis=1)
        one, other = one[apart], other[apart]
        distance = shapely.distance(lines[one], lines[other])
        narrow = (distance < width) & (distance > width - 2 * moved)
        pairs = np.concatenate([pairs, np.column_stack([one[narrow], other[narrow]])])
        if len(pairs) > _MOST_GAPS:
            return None
    ends = shapely.get_coordinates(shapely.shortest_line(lines[pairs[:, 0]], lines[pairs[:, 1]]))
    places = ends.reshape(-1, 2, 2).mean(axis=1)
    if _rays(lines, places[:, 1]) > _WORK:
        return None
    shapely.prepare(free)
    across = shapely.contains_xy(free, *places.T)
    pairs, places = pairs[across], places[across]
    reach = width / 2 + 2 * moved
    windows = shapely.box(*(places - reach).T, *(places + reach).T)
    before = [shapely.intersection(paths[pairs[:, k]], windows) for k in (0, 1)]
    # where nothing is left of a wall it was further away
    was = np.nan_to_num(shapely.distance(*before), nan=np.inf)
    lost = was > width * _CLEARLY
    return pairs[lost], places[lost]
