"""Positions where robots can start, and the starts of a converted map."""

import math

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, STRtree

from robocov.environment import MIN_START_GAP_RADII, DiscStart, PointsStart, StartSpec, UniformStart
from robocov.errors import MapError, format_count
from robocov.typing import FloatArray
from robocov_app.formats.geometry.conversion.conversion_options import Conversion
from robocov_app.formats.geometry.conversion.free_parts import MAX_FILE_ROBOTS
from robocov_app.formats.geometry.crossings import extract_sides
from robocov_app.formats.geometry.simplification.narrow_gaps import count_ray_crossings

_MAX_SQUARES = 1024
"""Maximum number of squares of each size in the search for the widest point."""
_MAX_RAY_CROSSINGS = 5_000_000
_MIN_REGION_AREA_RADII2 = 0.25
"""Smaller regions, in squared radii of the robot, are ignored."""
_MIN_START_TOLERANCE_M = 0.01
_START_STEPS_PER_SIDE = 500
"""The tolerance for the center of a start is the side of a square of the same area, divided by this."""
_STEPS_PER_CLEARANCE = 50
"""The tolerance in the search for a position with enough clearance is the clearance divided by this."""
_STEPS_PER_WIDTH = 500
"""The tolerance for the widest point of a part is the mean width of the part divided by this."""
_QUARTERS = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)])
_MAX_DISC_RADIUS_M = 2.0
_MIN_DISC_RADIUS_M = 0.02


def find_center_regions(free: MultiPolygon, radius: float) -> list[Polygon]:
    """Find the regions in which the center of a robot can move, except for tiny ones.

    Parameters
    ----------
    free : MultiPolygon, m
    radius : float, m
        Radius of the robot.

    Returns
    -------
    list of Polygon, m
        The regions; a robot cannot move from one to another.
    """
    inner = free.buffer(-radius, quad_segs=4)
    min_area = _MIN_REGION_AREA_RADII2 * radius * radius
    return [part for part in shapely.get_parts(inner).tolist() if part.area > min_area]


def find_widest_point(
    free: Polygon, tolerance: float, sufficient: float = math.inf
) -> tuple[tuple[float, float], float]:
    """Find the point of a free space that is farthest from its walls.

    Parameters
    ----------
    free : Polygon, m
    tolerance : float, m
        Accuracy of the distance: no other point is farther from the walls by more than this.
    sufficient : float, m
        The search stops at the first point at this distance from the walls, and ignores areas without such a
        point. The returned point is then not necessarily the farthest.

    Returns
    -------
    point : (float, float), m
    distance : float, m
        Distance to the nearest wall.

    Notes
    -----
    The area is covered with squares. In each round, those that may contain a better point than the best
    center so far are divided into four. The number of squares is limited; the most promising ones are used.
    """
    sides = shapely.linestrings(extract_sides(free))
    walls = STRtree(sides)
    shapely.prepare(free)
    max_squares = _limit_squares(free, sides)
    centers, side = _cover_with_squares(free, max_squares)
    point = centers[0]
    best = -math.inf
    while len(centers) and best < sufficient:
        _, distance = walls.query_nearest(shapely.points(centers), return_distance=True, all_matches=False)
        distance = np.where(shapely.contains_xy(free, *centers.T), distance, -distance)
        if distance.max() > best:
            best = float(distance.max())
            point = centers[distance.argmax()]
        # No point of a square is farther from the walls than its center by more than half its diagonal.
        reachable = distance + side * math.sqrt(0.5)
        order = np.argsort(-reachable, kind="stable")[:max_squares]
        required = best + tolerance
        if sufficient != math.inf:
            required = max(required, sufficient)
        centers = centers[order[reachable[order] > required]]
        side /= 2
        centers = (centers[:, None] + side / 2 * _QUARTERS).reshape(-1, 2)
    return (float(point[0]), float(point[1])), best


def _limit_squares(free: Polygon, sides: FloatArray) -> int:
    """Return the number of squares to use: fewer if testing their centers takes long."""
    _, low_y, _, high_y = free.bounds
    crossings = count_ray_crossings(sides, np.linspace(low_y, high_y, _MAX_SQUARES))
    return max(min(_MAX_SQUARES, _MAX_SQUARES * _MAX_RAY_CROSSINGS // max(crossings, 1)), 16)


def _cover_with_squares(free: Polygon, max_squares: int) -> tuple[FloatArray, float]:
    """Cover the bounding box of a polygon with squares; return their centers, (n, 2) m, and their side, m."""
    low_x, low_y, high_x, high_y = free.bounds
    width = high_x - low_x
    height = high_y - low_y
    side = max(min(width, height), max(width, height) / max_squares)
    corners = np.meshgrid(np.arange(low_x, high_x, side), np.arange(low_y, high_y, side))
    return np.stack(corners, axis=-1).reshape(-1, 2) + side / 2, side


def require_clearance(parts: list[Polygon], conversion: Conversion) -> None:
    """Raise MapError if no part of the free space is wide enough for a robot to start in."""
    clearance = conversion.clearance
    for part in parts:
        if _compute_distance_bound(part) >= clearance:
            _, distance = find_widest_point(part, clearance / _STEPS_PER_CLEARANCE, clearance)
            if distance >= clearance:
                return
    max_distance = _find_max_distance(parts)
    if max_distance >= clearance:
        # The first search may end just below the clearance; this one has a finer tolerance.
        return
    radius = clearance / (1 + MIN_START_GAP_RADII)
    max_radius = max_distance / (1 + MIN_START_GAP_RADII)
    reason = f"no position has enough clearance for a robot of radius {radius:g} m"
    raise MapError(
        f"{conversion.source_name}: {reason} (the widest is for one of {max_radius:.3g} m): "
        "is the scale right?"
    )


def _find_max_distance(parts: list[Polygon]) -> float:
    """Return the distance of the widest point of all parts from its walls, m."""
    max_distance = 0.0
    for part in parts:
        if _compute_distance_bound(part) > max_distance:
            mean_width = part.area / part.length
            _, distance = find_widest_point(part, mean_width / _STEPS_PER_WIDTH)
            max_distance = max(max_distance, distance)
    return max_distance


def _compute_distance_bound(part: Polygon) -> float:
    """Return an upper bound on the distance of points from the walls, m: the radius of a disc of its area."""
    return math.sqrt(part.area / math.pi)


def build_starts(free: MultiPolygon, conversion: Conversion) -> dict[str, StartSpec]:
    """Build the starts of a map: a disc around the widest point, anywhere, and the robots of the file."""
    part = free.geoms[0]
    # A finer tolerance would hardly move the start.
    tolerance = max(_MIN_START_TOLERANCE_M, math.sqrt(part.area) / _START_STEPS_PER_SIDE)
    (x, y), distance = find_widest_point(part, tolerance)
    # The disc contains the centers of robots, so it keeps the clearance of a robot from the walls.
    radius = min(distance - conversion.clearance, _MAX_DISC_RADIUS_M)
    uniform = UniformStart()
    starts: dict[str, StartSpec] = {"uniform": uniform}
    if radius >= _MIN_DISC_RADIUS_M:
        disc = DiscStart((round(x, 2) + 0.0, round(y, 2) + 0.0), math.floor(100 * radius) / 100)
        # The first start of a map is its default.
        if conversion.shaping.default_start == "room":
            starts = {"room": disc, "uniform": uniform}
        else:
            starts = {"uniform": uniform, "room": disc}
    if conversion.foreign.robots:
        positions = _choose_robot_positions(free, conversion)
        if len(positions):
            starts["robots"] = PointsStart(tuple((x, y) for x, y in positions.tolist()))
    return starts


def _choose_robot_positions(free: MultiPolygon, conversion: Conversion) -> FloatArray:
    """Return the positions of the file's robots where robots fit without touching a wall or each other.

    Positions are an (n, 2) array, m. Of two that are too close, the first one in the file is used.
    """
    robots = conversion.foreign.robots
    clearance = conversion.clearance
    positions = np.array(list(dict.fromkeys(robots))[:MAX_FILE_ROBOTS])
    fits = shapely.contains_properly(free, shapely.points(positions))
    fits &= shapely.distance(free.boundary, shapely.points(positions)) >= clearance
    for k in np.flatnonzero(fits).tolist():
        previous = positions[:k][fits[:k]]
        fits[k] = (np.hypot(*(previous - positions[k]).T) >= 2 * clearance).all()
    conversion.notes.append(_describe_robots_of_file(fitting_count=int(fits.sum()), count=len(robots)))
    return np.asarray(positions[fits])


def _describe_robots_of_file(fitting_count: int, count: int) -> str:
    """Return a note on the start "robots", with the number of positions at which robots fit."""
    if fitting_count == 0:
        positions = "the position of the robot" if count == 1 else f"any of the {count} positions of robots"
        return f'no start "robots": no robot fits at {positions} in the file'
    note = f'start "robots": {fitting_count} of {format_count(count, "position")} of robots in the file'
    if count > MAX_FILE_ROBOTS:
        return f"{note}; only the first {MAX_FILE_ROBOTS} are read"
    if fitting_count < count:
        return f"{note}; robots do not fit at the others"
    return note
