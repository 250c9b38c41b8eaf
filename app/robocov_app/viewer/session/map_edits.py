"""Edits of a map: obstacles drawn, moved and deleted, each a new environment; what cannot be is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov.errors import MapError, place
from robocov.mapfile import from_json, to_json

if TYPE_CHECKING:
    from robocov.environment import Environment, Obstacle

SHORTEST = 0.02
"""Metres below which what is drawn is taken for a slip of the hand."""


def with_obstacle(environment: Environment, obstacle: Obstacle) -> Environment:
    """Return the map with one obstacle more, on top of the others.

    Raises
    ------
    MapError
        When the map would break a rule; the message is a sentence for people.
    """
    return _checked(replace(environment, obstacles=(*environment.obstacles, obstacle)))


def without_obstacle(environment: Environment, index: int) -> Environment:
    """Return the map without obstacle number `index`."""
    kept = environment.obstacles[:index] + environment.obstacles[index + 1 :]
    return _checked(replace(environment, obstacles=kept))


def with_moved(environment: Environment, index: int, dx: float, dy: float) -> Environment:
    """Return the map with one obstacle moved by (dx, dy) m.

    Raises
    ------
    MapError
        When the map would break a rule.
    """
    obstacles = list(environment.obstacles)
    obstacles[index] = moved(obstacles[index], dx, dy)
    return _checked(replace(environment, obstacles=tuple(obstacles)))


def moved(obstacle: Obstacle, dx: float, dy: float) -> Obstacle:
    """Return the obstacle moved by (dx, dy) m, its coordinates to the tenth of a millimetre."""

    def at(point: tuple[float, float]) -> tuple[float, float]:
        return round(point[0] + dx, 4), round(point[1] + dy, 4)

    if isinstance(obstacle, CircleObstacle):
        return replace(obstacle, center=at(obstacle.center))
    if isinstance(obstacle, WallObstacle):
        return replace(obstacle, points=tuple(map(at, obstacle.points)))
    holes = tuple(tuple(map(at, hole)) for hole in obstacle.holes)
    return replace(obstacle, vertices=tuple(map(at, obstacle.vertices)), holes=holes)


def obstacle_at(environment: Environment, point: tuple[float, float], reach: float = 0.0) -> int | None:
    """Return the number of the obstacle at a point, or else of the nearest within `reach` metres.

    Of several it is the topmost; None if there is none.
    """
    away = shapely.distance([shape.polygon for shape in environment.obstacles], shapely.Point(point))
    if not len(away) or away.min() > reach:
        return None
    return int(np.flatnonzero(away == away.min())[-1])


def words_for(obstacle: Obstacle) -> str:
    """Return what people call an obstacle."""
    kind = {PolygonObstacle: "polygon", CircleObstacle: "circle", WallObstacle: "wall"}[type(obstacle)]
    return f"{kind} “{obstacle.name}”" if obstacle.name else kind


def polygon_of(points: list[tuple[float, float]]) -> PolygonObstacle:
    """Return the polygon with these corners.

    Raises
    ------
    MapError
        When they are too few, or enclose nothing.
    """
    ring = _rounded(points)
    if len(ring) > 2 and ring[0] == ring[-1]:
        ring = ring[:-1]
    if len(ring) < 3 or shapely.MultiPoint(ring).convex_hull.area < SHORTEST**2:
        raise MapError("a polygon needs three corners that enclose something")
    if not shapely.Polygon(ring).is_valid:
        raise MapError("the polygon's outline crosses itself")
    return PolygonObstacle(ring)


def wall_of(points: list[tuple[float, float]], width: float) -> WallObstacle:
    """Return the wall along these points.

    Raises
    ------
    MapError
        When it has no length.
    """
    line = _rounded(points)
    if len(line) < 2 or shapely.LineString(line).length < SHORTEST:
        raise MapError("a wall needs two points that are apart")
    return WallObstacle(line, width)


def circle_of(center: tuple[float, float], rim: tuple[float, float]) -> CircleObstacle:
    """Return the circle round `center` through `rim`.

    Raises
    ------
    MapError
        When it has no size.
    """
    radius = float(np.hypot(rim[0] - center[0], rim[1] - center[1]))
    if radius < SHORTEST:
        raise MapError("a circle needs a radius: drag from its middle to its rim")
    return CircleObstacle(_rounded([center])[0], round(radius, 4))


def _rounded(points: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return points to the tenth of a millimetre, so that files stay short; repeated ones once."""
    ring: list[tuple[float, float]] = []
    for x, y in points:
        point = round(float(x), 4), round(float(y), 4)
        if not ring or point != ring[-1]:
            ring.append(point)
    return tuple(ring)


def _checked(environment: Environment) -> Environment:
    """Return the map as a file would give it, without the starts that it has covered."""
    starts = dict(environment.starts)
    while True:
        try:
            return from_json(to_json(replace(environment, starts=starts)), "map")
        except MapError as error:
            # an obstacle on a start takes that start away, nothing else
            message = str(error).removeprefix("map: ")
            blocked = [name for name in starts if _is_about(message, name)]
            if not blocked:
                raise MapError(message) from None
            for name in blocked:
                del starts[name]


def _is_about(message: str, start: str) -> bool:
    """Whether a message begins with the place of a start, or of something in it."""
    where = place(("starts", start))
    return message.startswith(tuple(f"{where}{after}" for after in (":", ".", "[")))
