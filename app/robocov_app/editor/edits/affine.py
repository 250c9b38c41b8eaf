"""Where things go when they are moved, turned, scaled or mirrored: affine maps of the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from robocov.environment import DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.model.plane import cos_sin, ring_near, tenths

if TYPE_CHECKING:
    from collections.abc import Iterable

    from robocov.arrays import Array
    from robocov.environment import Obstacle, Point, Ring, StartSpec

_ALIKE = 1e-12
"""Relative difference of what is the same but for rounding."""


@dataclass(frozen=True)
class Affine:
    """The map that takes (x, y) to (xx x + xy y + x0, yx x + yy y + y0).

    Examples
    --------
    >>> Affine.turn(90.0, about=(1.0, 0.0)).point((2.0, 0.0))
    (1.0, 1.0)
    """

    xx: float = 1.0
    xy: float = 0.0
    yx: float = 0.0
    yy: float = 1.0
    x0: float = 0.0
    y0: float = 0.0

    @classmethod
    def shift(cls, dx: float, dy: float) -> Affine:
        """Return the map that moves by (dx, dy) m."""
        return cls(x0=dx, y0=dy)

    @classmethod
    def turn(cls, degrees: float, about: Point) -> Affine:
        """Return the map that turns counter-clockwise about a point, exactly at quarters of a turn."""
        cos, sin = cos_sin(degrees)
        return cls(cos, -sin, sin, cos)._about(about)

    @classmethod
    def stretch(cls, fx: float, fy: float, about: Point) -> Affine:
        """Return the map that scales along x and y about a point."""
        return cls(fx, 0.0, 0.0, fy)._about(about)

    @classmethod
    def mirror(cls, a: Point, b: Point) -> Affine:
        """Return the map that mirrors across the line through two points, which are not the same."""
        dx, dy = b[0] - a[0], b[1] - a[1]
        length = math.hypot(dx, dy)
        cos, sin = dx / length, dy / length
        double = cos * cos - sin * sin, 2.0 * cos * sin
        return cls(double[0], double[1], double[1], -double[0])._about(a)

    @property
    def factor(self) -> float | None:
        """By how much it scales all lengths alike; None where it stretches some more than others."""
        a, b = math.hypot(self.xx, self.yx), math.hypot(self.xy, self.yy)
        skew = abs(self.xx * self.xy + self.yx * self.yy)
        if abs(a - b) > _ALIKE * max(a, b) or skew > _ALIKE * a * b:
            return None
        return 1.0 if abs(a - 1.0) <= _ALIKE else a

    def points(self, points: Array) -> Array:
        """Return where (n, 2) points go."""
        x, y = points[:, 0], points[:, 1]
        return np.column_stack([self.xx * x + self.xy * y + self.x0, self.yx * x + self.yy * y + self.y0])

    def ring(self, ring: Iterable[Point]) -> Ring:
        """Return where points go, to the tenth of a millimetre.

        Raises
        ------
        MapError
            When that is farther away than maps reach.
        """
        moved = self.points(np.array(list(ring), dtype=float).reshape(-1, 2))
        return ring_near(moved)

    def point(self, point: Point) -> Point:
        """Return where a point goes, to the tenth of a millimetre."""
        return self.ring([point])[0]

    def shape(self, shape: Obstacle) -> Obstacle:
        """Return where an obstacle goes.

        Radii and the widths of walls grow with it where all lengths do; where they do not, a circle becomes
        a polygon, and a wall keeps its width. The path of one that moves goes with it, its speed stays.
        """
        factor = self.factor
        path = None if shape.path is None else replace(shape.path, points=self.ring(shape.path.points))
        if isinstance(shape, PolygonObstacle):
            holes = tuple(self.ring(hole) for hole in shape.holes)
            return replace(shape, vertices=self.ring(shape.vertices), holes=holes, path=path)
        if isinstance(shape, WallObstacle):
            width = _times(shape.width, factor or 1.0)
            return replace(shape, points=self.ring(shape.points), width=width, path=path)
        if factor is None:
            outline = shape.polygon.exterior.coords[:-1]
            return PolygonObstacle(self.ring(outline), (), shape.name, path)
        radius = _times(shape.radius, factor)
        return replace(shape, center=self.point(shape.center), radius=radius, path=path)

    def start(self, spec: StartSpec) -> StartSpec:
        """Return where a start goes; one in the whole free space stays.

        Raises
        ------
        MapError
            When a disc would become an ellipse.
        """
        if isinstance(spec, PointsStart):
            return PointsStart(self.ring(spec.positions))
        if isinstance(spec, DiscStart):
            factor = self.factor
            if factor is None:
                raise MapError("a start that is a disc stays one: scale it by the same factor both ways")
            return DiscStart(self.point(spec.center), _times(spec.radius, factor))
        return spec

    def _about(self, point: Point) -> Affine:
        """Return the map with the same matrix that leaves a point where it is."""
        x, y = point
        return replace(
            self, x0=x - self.xx * x - self.xy * y + self.x0, y0=y - self.yx * x - self.yy * y + self.y0
        )


def _times(length: float, factor: float) -> float:
    return length if factor == 1.0 else tenths(length * factor)
