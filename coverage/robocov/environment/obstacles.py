"""Obstacles: polygons, round pillars and walls."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
from shapely import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import to_tuples
from robocov.environment.obstacle_paths import ObstaclePath
from robocov.environment.polygons import build_polygon
from robocov.typing import FloatArray, Point, Ring

MAX_SAGITTA_M = 1e-3
"""Maximum distance between a circle and the polygon that represents the circle."""
_MIN_SIDES = 12
"""Minimum number of sides of such a polygon."""
_MITRE_LIMIT = 4.0
"""Maximum distance between the tip of a wall's corner and the axis of the wall, in half widths."""


@dataclass(frozen=True)
class PolygonObstacle:
    """A solid polygon, which may have holes (courtyards).

    Attributes
    ----------
    vertices : (k, 2) sequence, m
        Outer ring, in either direction. The first vertex is not repeated.
    holes : sequence of (k, 2) sequences, m
        Inner rings, in the same form.
    name : str or None
        Displayed name of the obstacle.
    path : ObstaclePath or None
        Path along which the obstacle moves; None if it does not move.

    See Also
    --------
    WallObstacle : A wall along a line.
    ObstaclePath : Makes an obstacle move.

    Examples
    --------
    >>> import robocov as rc
    >>> desk = rc.PolygonObstacle(((1.0, 4.0), (2.5, 4.0), (2.5, 5.0), (1.0, 5.0)), name="desk")
    >>> desk.polygon.area
    1.5
    """

    vertices: Ring
    holes: tuple[Ring, ...] = ()
    name: str | None = None
    path: ObstaclePath | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", to_tuples(self.vertices))
        object.__setattr__(self, "holes", to_tuples(self.holes))

    @cached_property
    def polygon(self) -> Polygon:
        """Shape of the obstacle."""
        return build_polygon("obstacle", self.vertices, self.holes)


@dataclass(frozen=True)
class CircleObstacle:
    """A round pillar. An inscribed regular polygon represents it in all computations.

    Attributes
    ----------
    center : (2,) sequence, m
        Center of the circle.
    radius : float, m
        Radius of the circle.
    name : str or None
        Displayed name of the obstacle.
    path : ObstaclePath or None
        Path along which the obstacle moves; None if it does not move.

    See Also
    --------
    PolygonObstacle : An obstacle of any other shape.
    ObstaclePath : Makes an obstacle move.

    Notes
    -----
    The polygon deviates from the circle by at most `MAX_SAGITTA_M`.

    Examples
    --------
    >>> import robocov as rc
    >>> pillar = rc.CircleObstacle((2.0, 3.0), radius=0.5)
    >>> round(pillar.polygon.area, 2)
    0.78
    """

    center: Point
    radius: float
    name: str | None = None
    path: ObstaclePath | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", to_tuples(self.center))

    @cached_property
    def polygon(self) -> Polygon:
        """Polygon that represents the circle."""
        side_count = _MIN_SIDES
        if self.radius > MAX_SAGITTA_M:
            # The sagitta of a side is radius * (1 - cos(half_angle)), with half of the side's central angle.
            half_angle = math.acos(1.0 - MAX_SAGITTA_M / self.radius)
            side_count = max(side_count, math.ceil(math.pi / half_angle))
        angles = np.arange(side_count) * (2.0 * np.pi / side_count)
        unit_circle = np.column_stack([np.cos(angles), np.sin(angles)])
        return Polygon(unit_circle * self.radius + self.center)


@dataclass(frozen=True)
class WallObstacle:
    """A wall along a polyline, with flat ends and mitered corners.

    Attributes
    ----------
    points : (k, 2) sequence, m
        Vertices of the polyline, which is the axis of the wall.
    width : float, m
        Thickness of the wall.
    name : str or None
        Displayed name of the obstacle.
    path : ObstaclePath or None
        Path along which the obstacle moves; None if it does not move.

    See Also
    --------
    PolygonObstacle : An obstacle of any other shape.

    Examples
    --------
    >>> import robocov as rc
    >>> wall = rc.WallObstacle(((0.0, 0.0), (3.0, 0.0), (3.0, 2.0)), width=0.1)
    >>> round(wall.polygon.area, 3)
    0.5
    """

    points: Ring
    width: float
    name: str | None = None
    path: ObstaclePath | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", to_tuples(self.points))

    @cached_property
    def polygon(self) -> BaseGeometry:
        """Shape of the obstacle, which may consist of several polygons if the polyline doubles back."""
        return LineString(self.points).buffer(
            self.width / 2, cap_style="flat", join_style="mitre", mitre_limit=_MITRE_LIMIT
        )


Obstacle: TypeAlias = PolygonObstacle | CircleObstacle | WallObstacle
"""Any kind of obstacle."""


def shift_obstacle(obstacle: Obstacle, displacement: FloatArray) -> Obstacle:
    """Return a copy of an obstacle that is shifted, and does not move.

    Parameters
    ----------
    obstacle : Obstacle
        The obstacle to move.
    displacement : (2,) array, m
        Vector by which the obstacle is moved.

    Returns
    -------
    Obstacle
        A copy of the obstacle at its new position, without a path.
    """
    dx, dy = displacement.tolist()

    def shift_points(points: Ring) -> Ring:
        return tuple((x + dx, y + dy) for x, y in points)

    if isinstance(obstacle, PolygonObstacle):
        return replace(
            obstacle,
            vertices=shift_points(obstacle.vertices),
            holes=tuple(shift_points(hole) for hole in obstacle.holes),
            path=None,
        )
    if isinstance(obstacle, WallObstacle):
        return replace(obstacle, points=shift_points(obstacle.points), path=None)
    x, y = obstacle.center
    return replace(obstacle, center=(x + dx, y + dy), path=None)
