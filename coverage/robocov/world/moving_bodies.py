"""Obstacles that move, in the physical world: kinematic bodies that go their way whatever is in it.

What they meet they push, and what pushes is stronger than any robot. Walls are stronger still: where a
robot has no room left between a moving obstacle and a wall, it stays in front of the wall, and the obstacle
goes over it; it is pushed out again, where that is nearest, once there is room. No robot gets into a wall
or through one that way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pymunk

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov.world.solid import Mover

WALLS = pymunk.ShapeFilter(mask=0b1)
"""Of queries for walls alone."""

NO_WALL = pymunk.ShapeFilter(categories=pymunk.ShapeFilter.ALL_CATEGORIES() & ~0b1)
"""Of robots and of obstacles that move."""

_SLACK = 1e-4
"""Metres that a robot may lean into a wall: pymunk's own slop."""


def motion(movers: tuple[Mover, ...], time: float, dt: float) -> Array:
    """Return where moving obstacles are at a time, and how fast for `dt` seconds, (m, 4) m and m/s.

    Parameters
    ----------
    movers : tuple of Mover
    time, dt : float, s
    """
    state = np.empty((len(movers), 4))
    for row, mover in enumerate(movers):
        here = mover.path.shift(time)
        state[row] = *here, *((mover.path.shift(time + dt) - here) / dt)
    return state


def keep_before_walls(space: pymunk.Space, disc: pymunk.Circle, before: pymunk.Vec2d) -> None:
    """Leave a robot that was pushed into a wall, from some place, in front of the wall."""
    body, radius = disc.body, disc.radius
    assert body is not None
    if space.segment_query_first(before, body.position, 0.0, WALLS) is not None:
        body.position = before
    for _ in range(3):  # out of one wall may be into another, in a corner
        wall = space.point_query_nearest(body.position, radius, WALLS)
        if wall is None or wall.distance >= radius - _SLACK or wall.distance <= 0.0:
            return
        away = body.position - wall.point
        body.position = wall.point + away * (radius / math.hypot(*away))
