"""Snapping: corners and walls of the map attract points that are drawn near them."""

import numpy as np
import shapely

from robocov.environment import Environment, Point

SNAP_REACH_FRACTION = 0.6  # of the width of a finger


def snap_point(environment: Environment, point: Point, reach: float) -> Point:
    """Snap a point to the map.

    Parameters
    ----------
    environment : Environment
        The map.
    point : Point
        Position, m.
    reach : float
        Distance within which it snaps, m.

    Returns
    -------
    Point
        The nearest corner within reach; if there is none, the nearest point on a wall within reach; otherwise
        the point itself.
    """
    walls = environment.free.boundary
    corners = shapely.get_coordinates(walls)
    distances = np.hypot(*(corners - point).T)
    if len(distances) and distances.min() <= reach:
        x, y = corners[distances.argmin()].tolist()
        return x, y
    shortest = shapely.shortest_line(walls, shapely.Point(point))
    if shortest is None or shortest.length > reach:
        return point
    x, y = shapely.get_coordinates(shortest)[0].tolist()
    return x, y
