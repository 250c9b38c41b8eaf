"""Obstacles that move, in the physical world: kinematic bodies that go their way whatever is in it.

What they meet they push, and what pushes is stronger than any robot. Walls are stronger still: where a
robot has no room left between a moving obstacle and a wall, it stays in front of the wall, and the obstacle
goes over it; it is pushed out again, where that is nearest, once there is room. No robot gets into a wall
or through one that way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pymunk

from robocov.sensor import added_mover

if TYPE_CHECKING:
    from robocov.world.solid import Mover

_WALLS = pymunk.ShapeFilter(mask=0b1)
_NO_WALL = pymunk.ShapeFilter(categories=pymunk.ShapeFilter.ALL_CATEGORIES() & ~0b1)

_SLACK = 1e-4
"""Metres that a robot may lean into a wall: pymunk's own slop."""


class MovingBodies:
    """The obstacles that move among the bodies of a space.

    Parameters
    ----------
    space : Space
        With its walls.
    movers : tuple of Mover
    discs : list of Circle
        The robots.
    """

    def __init__(self, space: pymunk.Space, movers: tuple[Mover, ...], discs: list[pymunk.Circle]) -> None:
        self.movers = movers
        self._space = space
        self._bodies = [added_mover(space, mover) for mover in movers]
        self._radius: dict[pymunk.Body, float] = {}
        for disc in discs:
            disc.filter = _NO_WALL
            if disc.body is not None:
                self._radius[disc.body] = disc.radius
        for body in self._bodies:
            for shape in body.shapes:
                shape.filter = _NO_WALL
        self._touched: set[pymunk.Body] = set()
        self.fastest = max(mover.path.speed for mover in movers)
        """The speed of the fastest of them, m/s."""
        self.state = np.zeros((len(movers), 4))
        """x, y and velocity of each at the beginning of the substep, (k, 4) m and m/s."""

    def place(self, time: float, dt: float) -> None:
        """Begin a substep of `dt` seconds at a time, s."""
        for row, mover in enumerate(self.movers):
            here = mover.path.shift(time)
            self.state[row] = *here, *((mover.path.shift(time + dt) - here) / dt)
        self.back()

    def back(self) -> None:
        """Go back to the beginning of the substep."""
        self._touched.clear()
        for body, (x, y, vx, vy) in zip(self._bodies, self.state.tolist(), strict=True):
            body.position, body.velocity = (x, y), (vx, vy)

    def touched(self, arbiter: pymunk.Arbiter) -> None:
        """Take note of who touches something."""
        self._touched.update(
            shape.body for shape in arbiter.shapes if shape.body is not None and shape.body in self._radius
        )

    def before_walls(self, move: Callable[[], None]) -> None:
        """Let something move the robots, and leave those that were pushed into a wall in front of it."""
        # in the order of the robots: what is moved first must not depend on addresses
        before = {body: body.position for body in self._radius}
        move()
        for body, place in before.items():
            if body in self._touched:
                self._keep_before_walls(body, place)

    def _keep_before_walls(self, body: pymunk.Body, before: pymunk.Vec2d) -> None:
        crossed = self._space.segment_query_first(before, body.position, 0.0, _WALLS)
        if crossed is not None:
            body.position = before
        radius = self._radius[body]
        for _ in range(3):  # out of one wall may be into another, in a corner
            wall = self._space.point_query_nearest(body.position, radius, _WALLS)
            if wall is None or wall.distance >= radius - _SLACK or wall.distance <= 0.0:
                return
            away = body.position - wall.point
            body.position = wall.point + away * (radius / math.hypot(*away))
