"""Handles of a selected obstacle: its points, its rim, and the corners of the frame around a polygon."""

from dataclasses import dataclass, replace
from math import dist
from typing import Literal, TypeAlias

import numpy as np

from robocov.environment import CircleObstacle, Obstacle, Point, PolygonObstacle, WallObstacle
from robocov_app.toolkit.tools.geometry import constrain_angle
from robocov_app.viewer.session.editing.map_edits import MIN_SHAPE_SIZE_M, build_circle, map_points

HandleKind: TypeAlias = Literal["point", "rim", "corner"]

FRAME_MARGIN_FRACTION = 0.9
"""Distance of a polygon's frame from the polygon, as a fraction of the pointer's reach."""
HANDLE_REACH_FRACTION = 0.6
"""Fraction of the pointer's reach within which a handle is grabbed."""
_SIDES = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
_CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))


@dataclass(frozen=True)
class ObstacleHandle:
    """A handle that changes the shape of an obstacle.

    Attributes
    ----------
    kind : {"point", "rim", "corner"}
        A point of a wall or polygon; the rim of a circle; a corner of the frame around a polygon.
    position : Point
        Position, m.
    index : int
        Index of the point or corner.
    """

    kind: HandleKind
    position: Point
    index: int


def list_handles(obstacle: Obstacle, reach: float) -> tuple[ObstacleHandle, ...]:
    """Return the handles of an obstacle.

    Parameters
    ----------
    obstacle : Obstacle
    reach : float, m
        Reach of the pointer.

    Returns
    -------
    tuple of ObstacleHandle
    """
    if isinstance(obstacle, CircleObstacle):
        x, y = obstacle.center
        radius = obstacle.radius
        return tuple(
            ObstacleHandle("rim", (x + radius * dx, y + radius * dy), index)
            for index, (dx, dy) in enumerate(_SIDES)
        )
    points = obstacle.points if isinstance(obstacle, WallObstacle) else obstacle.vertices
    handles = [ObstacleHandle("point", point, index) for index, point in enumerate(points)]
    if isinstance(obstacle, PolygonObstacle):
        center, half_size = _compute_frame(obstacle)
        margin = FRAME_MARGIN_FRACTION * reach
        for index, corner in enumerate(_CORNERS):
            x, y = (center + np.array(corner) * (half_size + margin)).tolist()
            handles.append(ObstacleHandle("corner", (x, y), index))
    return tuple(handles)


def find_handle(obstacle: Obstacle, point: Point, reach: float) -> ObstacleHandle | None:
    """Return the handle of an obstacle that the pointer grabs at a point, m; None if there is none."""
    near = [
        handle
        for handle in list_handles(obstacle, reach)
        if dist(handle.position, point) <= HANDLE_REACH_FRACTION * reach
    ]
    return min(near, key=lambda handle: dist(handle.position, point), default=None)


def drag_handle(
    obstacle: Obstacle, handle: ObstacleHandle, point: Point, *, shift: bool = False, alt: bool = False
) -> Obstacle:
    """Return an obstacle with one of its handles moved to a point.

    Parameters
    ----------
    obstacle : Obstacle
    handle : ObstacleHandle
        A handle of the obstacle.
    point : Point
        New position of the handle, m.
    shift : bool
        Whether an edge keeps a multiple of 45°, or a polygon its proportions.
    alt : bool
        Whether a polygon is resized about its center instead of the opposite corner.

    Returns
    -------
    Obstacle

    Raises
    ------
    MapError
        If a circle would have almost no radius.
    """
    if isinstance(obstacle, CircleObstacle):
        radius = build_circle(obstacle.center, point).radius
        return replace(obstacle, radius=radius)
    if isinstance(obstacle, PolygonObstacle) and handle.kind == "corner":
        return _resize_polygon(obstacle, handle, point, keeps_proportions=shift, is_centered=alt)
    if isinstance(obstacle, WallObstacle):
        # The edge from the point before or, for the first point, from the second one.
        origin = obstacle.points[handle.index - 1 if handle.index else 1]
        points = _move_point(obstacle.points, handle.index, origin, point, is_constrained=shift)
        return replace(obstacle, points=points)
    origin = obstacle.vertices[handle.index - 1]
    vertices = _move_point(obstacle.vertices, handle.index, origin, point, is_constrained=shift)
    return replace(obstacle, vertices=vertices)


def _move_point(
    points: tuple[Point, ...], index: int, origin: Point, point: Point, *, is_constrained: bool
) -> tuple[Point, ...]:
    """Return points with one of them moved; its edge from `origin` may be constrained to a round angle."""
    if is_constrained:
        point = constrain_angle(origin, point)
    # `map_points` rounds the coordinates.
    moved = map_points((point,), lambda coordinates: coordinates)
    return (*points[:index], *moved, *points[index + 1 :])


def _resize_polygon(
    polygon: PolygonObstacle,
    handle: ObstacleHandle,
    point: Point,
    *,
    keeps_proportions: bool,
    is_centered: bool,
) -> PolygonObstacle:
    """Return a polygon scaled so that a corner of its frame moves with its handle."""
    center, half_size = _compute_frame(polygon)
    corner = np.array(_CORNERS[handle.index])
    grip = center + corner * half_size
    fixed = center if is_centered else center - corner * half_size
    target = grip + np.array(point) - np.array(handle.position)
    size = np.maximum(np.abs(grip - fixed), MIN_SHAPE_SIZE_M)
    factors = np.maximum((target - fixed) * corner, MIN_SHAPE_SIZE_M) / size
    if keeps_proportions:
        factors = np.full(2, factors.max())

    def scale(coordinates: Point) -> Point:
        x, y = (fixed + factors * (np.array(coordinates) - fixed)).tolist()
        return x, y

    holes = tuple(map_points(hole, scale) for hole in polygon.holes)
    return replace(polygon, vertices=map_points(polygon.vertices, scale), holes=holes)


def _compute_frame(polygon: PolygonObstacle) -> tuple[np.ndarray, np.ndarray]:
    """Return center and half of the size of a polygon's bounding box, (2,) m each."""
    low = np.min(polygon.vertices, axis=0)
    high = np.max(polygon.vertices, axis=0)
    return (low + high) / 2, (high - low) / 2
