"""Edits of a map: adding, moving and removing obstacles, and painting the density."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np
import shapely

from robocov.density import Raster, sample_density
from robocov.environment import CircleObstacle, Environment, Obstacle, Point, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov.mapfile import from_json, to_json
from robocov.typing import FloatArray

MIN_SHAPE_SIZE_M = 0.02
"""Drawn shapes that are smaller are considered accidental, and rejected."""
PAINTED_RASTER_CELLS = 96
"""Number of raster cells along the longer side of a map whose density is painted."""
MIN_PAINTED_DENSITY = 0.05
"""Lowest density to which the brush lowers values, and from which it starts to raise lower ones."""
MAX_PAINTED_DENSITY = 50.0
"""Density above which the brush raises no value."""
DAB_FACTOR = 1.15
"""Factor by which a dab of the brush changes the density at its center."""
_DENSITY_DECIMALS = 3
"""Decimals to which a painted density is rounded, so that map files stay short."""
_COORDINATE_DECIMALS = 4
"""Decimals to which drawn coordinates, m, are rounded, so that files stay short."""


def replace_obstacles(
    environment: Environment, first_index: int, removed_count: int, added: Iterable[Obstacle] = ()
) -> Environment:
    """Return a map with some of its obstacles replaced, checked like a map that is read from a file.

    Starts that are covered by an obstacle are removed.

    Parameters
    ----------
    environment : Environment
        The map.
    first_index : int
        Index of the first obstacle that is replaced.
    removed_count : int
        Number of obstacles that are replaced.
    added : iterable of Obstacle
        The obstacles that replace them.

    Returns
    -------
    Environment

    Raises
    ------
    MapError
        If the map would break a rule.
    """
    old = environment.obstacles
    obstacles = (*old[:first_index], *added, *old[first_index + removed_count :])
    starts = dict(environment.starts)
    while True:
        changed = replace(environment, obstacles=obstacles, starts=starts)
        # Writing and reading the map checks all its rules. If obstacles cover starts, retry without them.
        try:
            return from_json(to_json(changed), "map")
        except MapError as error:
            covered_starts = _find_covered_starts(error) & starts.keys()
            if not covered_starts:
                raise MapError(str(error).removeprefix("map: ")) from None
            for name in covered_starts:
                del starts[name]


def _find_covered_starts(error: MapError) -> set[str]:
    """Return the names of the starts about which an error complains, because obstacles cover them."""
    return {str(issue.path[1]) for issue in error.issues if issue.path[:1] == ("starts",)}


def add_obstacle(environment: Environment, obstacle: Obstacle) -> Environment:
    """Return a map with one more obstacle; raise the same errors as `replace_obstacles`."""
    return replace_obstacles(environment, len(environment.obstacles), 0, [obstacle])


def move_obstacle(obstacle: Obstacle, dx: float, dy: float) -> Obstacle:
    """Return an obstacle moved by dx and dy, m."""

    def move(point: Point) -> Point:
        return point[0] + dx, point[1] + dy

    if isinstance(obstacle, CircleObstacle):
        (center,) = map_points((obstacle.center,), move)
        return replace(obstacle, center=center)
    if isinstance(obstacle, WallObstacle):
        return replace(obstacle, points=map_points(obstacle.points, move))
    holes = tuple(map_points(hole, move) for hole in obstacle.holes)
    return replace(obstacle, vertices=map_points(obstacle.vertices, move), holes=holes)


def map_points(points: Iterable[Point], function: Callable[[Point], Point]) -> tuple[Point, ...]:
    """Apply a function to points, m, and round the results to a tenth of a millimeter."""
    mapped = map(function, points)
    return tuple((round(x, _COORDINATE_DECIMALS), round(y, _COORDINATE_DECIMALS)) for x, y in mapped)


def find_obstacle(environment: Environment, point: Point, reach: float = 0.0) -> int | None:
    """Return the index of the obstacle at a point.

    Parameters
    ----------
    environment : Environment
        The map.
    point : tuple
        The point, (x, y) m.
    reach : float, m
        Distance within which an obstacle counts as being at the point.

    Returns
    -------
    int or None
        Index of the nearest obstacle; if several contain the point, of the topmost one; None if no obstacle
        is within reach.
    """
    polygons = [obstacle.polygon for obstacle in environment.obstacles]
    distances = shapely.distance(polygons, shapely.Point(point))
    if not len(distances) or distances.min() > reach:
        return None
    return int(np.flatnonzero(distances == distances.min())[-1])


def describe_obstacle(obstacle: Obstacle) -> str:
    """Return the kind of an obstacle, with its name if it has one."""
    kind = type(obstacle).__name__.removesuffix("Obstacle").lower()
    if obstacle.name:
        return f"{kind} “{obstacle.name}”"
    return kind


def build_polygon(points: list[Point]) -> PolygonObstacle:
    """Build a polygon obstacle from the points of its outline, m.

    Raises
    ------
    MapError
        If the outline encloses almost no area, or crosses itself.
    """
    vertices = _round_points(points)
    if len(vertices) > 2 and vertices[0] == vertices[-1]:
        vertices = vertices[:-1]
    if len(vertices) < 3 or shapely.MultiPoint(vertices).convex_hull.area < MIN_SHAPE_SIZE_M**2:
        raise MapError("a polygon needs three corners that enclose an area")
    if not shapely.Polygon(vertices).is_valid:
        raise MapError("the polygon's outline crosses itself")
    return PolygonObstacle(vertices)


def build_wall(points: list[Point], width: float) -> WallObstacle:
    """Build a wall along a line through points, with a given width; all lengths in m.

    Raises
    ------
    MapError
        If the points are too close together.
    """
    line = _round_points(points)
    if len(line) < 2 or shapely.LineString(line).length < MIN_SHAPE_SIZE_M:
        raise MapError("a wall needs two points that are apart")
    return WallObstacle(line, width)


def build_circle(center: Point, rim: Point) -> CircleObstacle:
    """Build a circular obstacle from its center and a point on its rim, m.

    Raises
    ------
    MapError
        If the points are too close together.
    """
    radius = float(np.hypot(rim[0] - center[0], rim[1] - center[1]))
    if radius < MIN_SHAPE_SIZE_M:
        raise MapError("a circle needs a radius: drag from its center to its rim")
    return CircleObstacle(_round_points([center])[0], round(radius, _COORDINATE_DECIMALS))


def _round_points(points: list[Point]) -> tuple[Point, ...]:
    """Round points to a tenth of a millimeter, and remove consecutive duplicates."""
    rounded = [
        (round(float(x), _COORDINATE_DECIMALS), round(float(y), _COORDINATE_DECIMALS)) for x, y in points
    ]
    return tuple(point for point, _ in groupby(rounded))


def paint_density(environment: Environment, dabs: Sequence[Point], radius: float, *, lowers: bool) -> Raster:
    """Raise or lower the density of a map with a brush.

    The brush raises no value above `MAX_PAINTED_DENSITY`, and lowers none below `MIN_PAINTED_DENSITY`.
    Raising does not change values above the maximum, and lowering does not change values below the minimum.
    Raising a value below the minimum starts from the minimum. Cells that do not change are not rounded.

    Parameters
    ----------
    environment : Environment
        The map.
    dabs : sequence of tuple
        Points at which the brush is applied, (x, y) m each.
    radius : float, m
        Radius of the brush. Its effect decreases from the center to the rim.
    lowers : bool
        Whether the density is lowered.

    Returns
    -------
    Raster
    """
    raster = build_paintable_raster(environment)
    values = np.array(raster.values)
    rows, columns = values.shape
    x_min, y_min, x_max, y_max = raster.extent
    x = _compute_cell_centers(x_min, x_max, columns)[None, :]
    y = _compute_cell_centers(y_min, y_max, rows)[:, None]
    # Each dab multiplies the density by DAB_FACTOR ** (1 - (distance / radius)²)², or divides it by that.
    # A density of 0 could not be raised, so at least the minimum is multiplied.
    exponent = -np.log(DAB_FACTOR) if lowers else np.log(DAB_FACTOR)
    for center_x, center_y in dabs:
        squared_distances = ((x - center_x) ** 2 + (y - center_y) ** 2) / radius**2
        strengths = np.where(squared_distances < 1.0, (1.0 - np.minimum(squared_distances, 1.0)) ** 2, 0.0)
        changed = np.maximum(values, MIN_PAINTED_DENSITY) * np.exp(exponent * strengths)
        if lowers:
            changed = np.minimum(values, np.maximum(changed, MIN_PAINTED_DENSITY))
        else:
            changed = np.maximum(values, np.minimum(changed, MAX_PAINTED_DENSITY))
        values = np.where(strengths > 0.0, changed, values)
    is_painted = values != raster.values
    return Raster(np.where(is_painted, np.round(values, _DENSITY_DECIMALS), values), raster.extent)


def _compute_cell_centers(low: float, high: float, count: int) -> FloatArray:
    """Return the center coordinates of `count` equal cells between two coordinates, (count,) m."""
    cell_size = (high - low) / count
    return np.asarray(low + (np.arange(count) + 0.5) * cell_size, dtype=np.float64)


def build_paintable_raster(environment: Environment) -> Raster:
    """Return the density of a map as a raster that can be painted; sample it unless it already is one."""
    density = environment.density
    is_paintable = (
        isinstance(density, Raster) and density.interpolation == "bilinear" and min(density.values.shape) > 1
    )
    if is_paintable:
        assert isinstance(density, Raster)
        return density
    bounds = environment.region.bounds
    x_min, y_min, x_max, y_max = bounds
    cell_size = max(x_max - x_min, y_max - y_min) / PAINTED_RASTER_CELLS
    columns = max(round((x_max - x_min) / cell_size), 2)
    rows = max(round((y_max - y_min) / cell_size), 2)
    return sample_density(density, bounds, columns, rows)
