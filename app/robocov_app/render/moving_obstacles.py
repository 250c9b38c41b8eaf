"""Moving obstacles at one time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
import shapely.affinity

from robocov.environment import Environment
from robocov.typing import FloatArray

_HEADING_STEP = 1e-3
"""Time over which a heading is measured: a fraction of the path's period, at most this many seconds."""
_MIN_DISPLACEMENT_M = 1e-12


class MovingObstacle(NamedTuple):
    """A moving obstacle at one time."""

    polygon: shapely.Polygon
    middle: FloatArray
    """(2,) m"""
    path: FloatArray
    """(k, 2) m, the path of its middle."""
    heading: FloatArray
    """(2,) Unit vector."""


def list_moving_obstacles(environment: Environment, time: float) -> list[MovingObstacle]:
    """List the moving obstacles of an environment, with their positions and headings at a time, s."""
    moving = []
    for obstacle in environment.obstacles:
        path = obstacle.path
        if path is None:
            continue
        displacement = path.compute_displacement(time)
        later = time + _HEADING_STEP * min(path.period, 1.0)
        heading = path.compute_displacement(later) - displacement
        heading /= max(float(np.hypot(*heading)), _MIN_DISPLACEMENT_M)
        middle = np.array(obstacle.polygon.envelope.centroid.coords[0])
        points = list(path.points)
        if path.repeat == "loop":
            points.append(path.points[0])
        moving.append(
            MovingObstacle(
                polygon=shapely.affinity.translate(obstacle.polygon, *displacement.tolist()),
                middle=middle + displacement,
                path=np.array(points) - points[0] + middle,
                heading=heading,
            )
        )
    return moving
