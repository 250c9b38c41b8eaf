"""Edits of a map: obstacles drawn, moved and deleted, each a new environment; what cannot be is refused."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
import shapely

from robocov.density import Raster, sample_density
from robocov.environment import CircleObstacle, Environment, Obstacle, Point, PolygonObstacle, WallObstacle
from robocov.errors import MapError, format_path
from robocov.mapfile import from_json, to_json

SHORTEST = 0.02  # meters below which what is drawn is taken for a slip of the hand
CELLS = 96  # cells along the longer side of a map whose density is painted
LEAST, MOST = 0.05, 50.0  # between these a place counts once it has been painted
_DAB = 1.15  # factor of one dab on the density at its center
_DECIMALS = 3  # of what is painted, so that a map that is saved stays short


def with_replaced(
    environment: Environment, first: int, removed: int, added: Iterable[Obstacle] = ()
) -> Environment:
    """Return the map, as a file gives it, with obstacles in the place of `removed` ones from a number on.

    Starts that are covered go. Raises MapError where it would break a rule, in a sentence for people.
    """
    there, starts = environment.obstacles, dict(environment.starts)
    obstacles = (*there[:first], *added, *there[first + removed :])
    while True:
        try:
            return from_json(to_json(replace(environment, obstacles=obstacles, starts=starts)), "map")
        except MapError as error:
            # an obstacle on a start takes that start away, nothing else
            message = str(error).removeprefix("map: ")
            told = {name: re.escape(format_path(("starts", name))) for name in starts}
            blocked = [name for name, at in told.items() if re.match(rf"{at}[:.\[]", message)]
            if not blocked:
                raise MapError(message) from None
            for name in blocked:
                del starts[name]


def with_obstacle(environment: Environment, obstacle: Obstacle) -> Environment:
    return with_replaced(environment, len(environment.obstacles), 0, [obstacle])


def moved(obstacle: Obstacle, dx: float, dy: float) -> Obstacle:
    def at(point: tuple[float, float]) -> tuple[float, float]:
        return round(point[0] + dx, 4), round(point[1] + dy, 4)

    if isinstance(obstacle, CircleObstacle):
        return replace(obstacle, center=at(obstacle.center))
    if isinstance(obstacle, WallObstacle):
        return replace(obstacle, points=tuple(map(at, obstacle.points)))
    holes = tuple(tuple(map(at, hole)) for hole in obstacle.holes)
    return replace(obstacle, vertices=tuple(map(at, obstacle.vertices)), holes=holes)


def obstacle_at(environment: Environment, point: tuple[float, float], reach: float = 0.0) -> int | None:
    """Return the number of the topmost obstacle at a point, else of the nearest within `reach` m, or None."""
    away = shapely.distance([shape.polygon for shape in environment.obstacles], shapely.Point(point))
    if not len(away) or away.min() > reach:
        return None
    return int(np.flatnonzero(away == away.min())[-1])


def words_for(obstacle: Obstacle) -> str:
    kind = type(obstacle).__name__.removesuffix("Obstacle").lower()
    return f"{kind} “{obstacle.name}”" if obstacle.name else kind


def polygon_of(points: list[tuple[float, float]]) -> PolygonObstacle:
    ring = _rounded(points)
    ring = ring[:-1] if len(ring) > 2 and ring[0] == ring[-1] else ring
    if len(ring) < 3 or shapely.MultiPoint(ring).convex_hull.area < SHORTEST**2:
        raise MapError("a polygon needs three corners that enclose something")
    if not shapely.Polygon(ring).is_valid:
        raise MapError("the polygon's outline crosses itself")
    return PolygonObstacle(ring)


def wall_of(points: list[tuple[float, float]], width: float) -> WallObstacle:
    line = _rounded(points)
    if len(line) < 2 or shapely.LineString(line).length < SHORTEST:
        raise MapError("a wall needs two points that are apart")
    return WallObstacle(line, width)


def circle_of(center: tuple[float, float], rim: tuple[float, float]) -> CircleObstacle:
    radius = float(np.hypot(rim[0] - center[0], rim[1] - center[1]))
    if radius < SHORTEST:
        raise MapError("a circle needs a radius: drag from its middle to its rim")
    return CircleObstacle(_rounded([center])[0], round(radius, 4))


def _rounded(points: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return points to the tenth of a millimeter, so that files stay short; repeated ones once."""
    rounded = [(round(float(x), 4), round(float(y), 4)) for x, y in points]
    return tuple(point for point, _ in groupby(rounded))


def painted(environment: Environment, dabs: Sequence[Point], radius: float, *, lowers: bool) -> Raster:
    """Return a map's density after dabs of a brush at points, m: raised or lowered, most in their middle."""
    raster = painted_raster(environment)
    values, (x_min, y_min, x_max, y_max) = np.array(raster.values), raster.extent
    rows, columns = values.shape
    x = x_min + (np.arange(columns) + 0.5) * ((x_max - x_min) / columns)
    y = y_min + (np.arange(rows) + 0.5) * ((y_max - y_min) / rows)
    for at_x, at_y in dabs:
        square = ((x[None, :] - at_x) ** 2 + (y[:, None] - at_y) ** 2) / radius**2
        soft = np.where(square < 1.0, (1.0 - np.minimum(square, 1.0)) ** 2, 0.0)
        change = np.exp((-1.0 if lowers else 1.0) * np.log(_DAB) * soft)
        values = np.where(soft > 0.0, np.clip(np.maximum(values, LEAST) * change, LEAST, MOST), values)
    return Raster(np.round(values, _DECIMALS), raster.extent)


def painted_raster(environment: Environment) -> Raster:
    """Return a map's density as a raster that can be painted: as it is where it is one, else sampled."""
    density = environment.density
    if isinstance(density, Raster) and density.interpolation == "bilinear" and min(density.values.shape) > 1:
        return density
    sides = np.ptp(np.reshape(environment.region.bounds, (2, 2)), axis=0).tolist()
    columns, rows = (max(round(side / (max(sides) / CELLS)), 2) for side in sides)
    return sample_density(density, environment.region.bounds, columns, rows)
