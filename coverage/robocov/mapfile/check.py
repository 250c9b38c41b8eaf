"""A report on a valid map: its measures, and warnings of likely mistakes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import shapely

from robocov.arrays import compute_lengths
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.density import Density, Gaussians
from robocov.environment import (
    DiscStart,
    Environment,
    Gap,
    PointsStart,
    PolygonObstacle,
    Ring,
    WallObstacle,
    compute_center_areas,
    compute_swept_area,
    find_narrowest_gap,
    find_overlaps,
    require_environment,
)
from robocov.errors import (
    StartError,
    format_area,
    format_count,
    format_path,
    format_position,
    summarize_names,
)
from robocov.team import PARAMETERS as TEAM_PARAMETERS
from robocov.typing import FloatArray

MANY_VERTICES = 5000
"""Number of vertices above which there is a warning about the computing time of a map."""
_SECONDS_PER_SQUARED_VERTEX = 6.1e-8
"""Measured time to set up a `robocov.cost.CoverageCost`, divided by the square of the number of vertices."""
_MAX_EQUAL_DISTANCE_M = 1e-6
"""Distance below which two vertices are probably meant to be the same."""
_INTERIORS_INTERSECT = "T********"
"""DE-9IM pattern of two shapes whose interiors have points in common."""


class StartReport(NamedTuple):
    """A start of a map.

    Attributes
    ----------
    name : str
        Name of the start in the map.
    kind : str
        ``disc``, ``uniform`` or ``points``.
    capacity : int
        Approximate number of robots that fit.
    """

    name: str
    kind: str
    capacity: int


@dataclass(frozen=True)
class MapReport:
    """Findings of `check_map`.

    Attributes
    ----------
    name : str
        Name of the map.
    area : float, m²
        Area inside the boundary.
    free_area : float, m²
        Area inside the boundary and outside every obstacle.
    vertex_count : int
        Number of vertices in the file of the map. Circles have none.
    obstacle_count : int
        Number of obstacles.
    components : tuple of float, m²
        Areas of the connected components of the free space, the largest first.
    radius : float, m
        Radius of the robots.
    narrowest_gap : Gap or None
        Narrowest passage of the free space; see `find_narrowest_gap`.
    starts : tuple of StartReport
        Starts in the file of the map.
    warnings : tuple of str
        Likely mistakes, one line each.
    density_kind : str or None
        Kind of the density; None if the map has no density.
    density_bounds : pair of float or None
        Lower bound of the density, and its maximum in the whole plane. Its values on the map may span less.
    mean_density : float
        Mean of the density over the free space.
    environment : Environment
        The map; not part of `to_dict`.

    See Also
    --------
    check_map : Check a map, and return its report.
    """

    name: str
    area: float
    free_area: float
    vertex_count: int
    obstacle_count: int
    components: tuple[float, ...]
    radius: float
    narrowest_gap: Gap | None
    starts: tuple[StartReport, ...]
    warnings: tuple[str, ...]
    density_kind: str | None = None
    density_bounds: tuple[float, float] | None = None
    mean_density: float = 1.0
    environment: Environment = field(kw_only=True, repr=False, compare=False)

    @cached_property
    def unreachable_area(self) -> float:
        """Free area that no robot can reach from the largest area in which robots can move, m².

        It contains sealed rooms, and everything behind gaps that are narrower than a robot. It is computed
        when it is read for the first time, because this takes longer than all other measures.
        """
        return compute_unreachable_area(self.environment, self.radius)

    @property
    def free_fraction(self) -> float:
        """Fraction of the area that is free."""
        return self.free_area / self.area

    def to_dict(self) -> dict[str, Any]:
        """Build the JSON document of the report, with units in the names of its keys.

        Returns
        -------
        dict
            Values by key.
        """
        gap = self.narrowest_gap
        gap_width = None if gap is None else gap.width
        gap_points = None if gap is None else [list(point) for point in gap.between]
        density_bounds = None if self.density_bounds is None else list(self.density_bounds)
        return {
            "name": self.name,
            "area_m2": self.area,
            "free_area_m2": self.free_area,
            "free_fraction": self.free_fraction,
            "vertices": self.vertex_count,
            "obstacles": self.obstacle_count,
            "components_m2": list(self.components),
            "radius_m": self.radius,
            "unreachable_area_m2": self.unreachable_area,
            "narrowest_gap_m": gap_width,
            "narrowest_gap_between": gap_points,
            "starts": {start.name: {"kind": start.kind, "capacity": start.capacity} for start in self.starts},
            "density": self.density_kind,
            "density_range": density_bounds,
            "mean_density": self.mean_density,
            "warnings": list(self.warnings),
        }


def check_map(environment: Environment, radius: float = DEFAULT_RADIUS_M) -> MapReport:
    """Measure a map, and look for likely mistakes.

    Parameters
    ----------
    environment : Environment
        A valid map.
    radius : float, m
        Radius of the robots.

    Returns
    -------
    MapReport
        Measures and warnings.

    Raises
    ------
    ParameterError
        If `environment` is not a map, or the radius is out of range.

    See Also
    --------
    load_map : Load a map, and check that it is valid.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.check_map(rc.load_map("square")).free_area
    100.0
    """
    require_environment(environment)
    TEAM_PARAMETERS["radius"].require("radius", radius)
    gap = find_narrowest_gap(environment.free)
    density = environment.density
    density_kind = None
    density_bounds = None
    if density is not None:
        density_kind = density.kind
        density_bounds = (density.lower_bound, _find_maximum(density))
    return MapReport(
        name=environment.name,
        area=environment.area,
        free_area=environment.free_area,
        vertex_count=count_vertices(environment),
        obstacle_count=len(environment.obstacles),
        components=tuple(float(component.area) for component in environment.free.geoms),
        radius=radius,
        narrowest_gap=gap,
        starts=tuple(_build_start_report(environment, name, radius) for name in environment.starts),
        warnings=tuple(_find_warnings(environment, gap, radius)),
        density_kind=density_kind,
        density_bounds=density_bounds,
        mean_density=float(environment.free_masses.sum()) / environment.free_area,
        environment=environment,
    )


def compute_unreachable_area(environment: Environment, radius: float) -> float:
    """Compute the free area that no robot can reach from the largest area in which robots can move.

    Parameters
    ----------
    environment : Environment
        A valid map.
    radius : float, m
        Radius of the robots.

    Returns
    -------
    float, m²
        All of the free area if no robot fits anywhere.
    """
    closed = environment.close_gaps(radius)
    components = np.array(closed.free.geoms)
    center_areas = compute_center_areas(environment.free, closed.free, radius)
    has_robot = ~shapely.is_empty(center_areas)
    reachable_areas = shapely.area(components[has_robot])
    # The thin bars that close gaps have an area of a few square micrometers.
    unreachable_area = shapely.area(components).sum() - reachable_areas.max(initial=0.0)
    return float(unreachable_area)


def _build_start_report(environment: Environment, name: str, radius: float) -> StartReport:
    start = environment.starts[name]
    if isinstance(start, PointsStart):
        return StartReport(name, "points", len(start.positions))
    kind = "disc" if isinstance(start, DiscStart) else "uniform"
    return StartReport(name, kind, environment.start(name).estimate_capacity(radius))


def _find_maximum(density: Density) -> float:
    """Return the maximum of a density in the whole plane."""
    if not isinstance(density, Gaussians) or len(density.peaks) < 2:
        return density.upper_bound
    # If peaks overlap, the upper bound is not reached, and the maximum is found by optimization.
    # Importing the package takes longer than checking most maps.
    from scipy.optimize import minimize

    def evaluate_negative(point: FloatArray) -> float:
        return -float(density.evaluate(point[None])[0])

    return -float(min(minimize(evaluate_negative, peak.center).fun for peak in density.peaks))


def count_vertices(environment: Environment) -> int:
    """Count the vertices in the file of a map.

    Parameters
    ----------
    environment : Environment
        The map.

    Returns
    -------
    int
        Number of vertices of the boundary, polygons and walls. Circles have none.
    """
    return sum(len(ring) for _, ring in _iterate_rings(environment))


def describe_vertex_count(vertex_count: int) -> str:
    """Build the warning about the computing time of a map with many vertices.

    Parameters
    ----------
    vertex_count : int
        Number of vertices of the map.

    Returns
    -------
    str
        One sentence, without a period.
    """
    seconds = _SECONDS_PER_SQUARED_VERTEX * vertex_count * vertex_count
    time = f"{seconds:.0f} seconds" if seconds < 90.0 else f"{seconds / 60:.0f} minutes"
    return (
        f"This map has many vertices ({vertex_count}): computing the distances between them takes about "
        f"{time} before a run, and four times as long for twice as many"
    )


def _iterate_rings(environment: Environment) -> Iterator[tuple[str, Ring]]:
    """Yield each list of vertices in the file of a map, with its JSON path."""
    yield "boundary", environment.boundary
    for k, obstacle in enumerate(environment.obstacles):
        path = format_path(("obstacles", k))
        if isinstance(obstacle, PolygonObstacle):
            yield f"{path}.vertices", obstacle.vertices
            for hole, ring in enumerate(obstacle.holes):
                yield f"{path}.holes[{hole}]", ring
        elif isinstance(obstacle, WallObstacle):
            yield f"{path}.points", obstacle.points


def _find_warnings(environment: Environment, gap: Gap | None, radius: float) -> Iterator[str]:
    """Yield a warning for each likely mistake."""
    vertex_count = count_vertices(environment)
    if vertex_count > MANY_VERTICES:
        yield describe_vertex_count(vertex_count)
    yield from _find_shape_warnings(environment)
    yield from _find_path_warnings(environment)
    yield from _find_component_warnings(environment, radius)
    if gap is not None and gap.width < 2 * radius:
        ends = " and ".join(format_position(x, y) for x, y in gap.between)
        yield (
            f"the gap between {ends} is {gap.width:.3g} m wide: a robot of radius {radius:g} m cannot pass"
        )
    yield from _find_start_warnings(environment, radius)


def _find_shape_warnings(environment: Environment) -> Iterator[str]:
    """Yield warnings about duplicate vertices, and about obstacles outside the boundary."""
    for path, ring in _iterate_rings(environment):
        points = np.asarray(ring)
        edge_lengths = compute_lengths(np.roll(points, -1, axis=0) - points)
        if path.endswith(".points"):
            edge_lengths = edge_lengths[:-1]  # A wall may end where it starts.
        for index in np.flatnonzero(edge_lengths < _MAX_EQUAL_DISTANCE_M):
            yield f"{path}[{index}] and the next vertex are at the same position"
    boundary = environment.boundary_polygon
    for k, obstacle in enumerate(environment.obstacles):
        if not shapely.relate_pattern(obstacle.polygon, boundary, _INTERIORS_INTERSECT):
            yield f"{_format_obstacle(environment, k)} is entirely outside the boundary"


def _find_path_warnings(environment: Environment) -> Iterator[str]:
    """Yield warnings about obstacles that move through fixed ones or through the boundary."""
    # Polygons of the obstacles that do not move, by their indices.
    fixed = {k: shape.polygon for k, shape in enumerate(environment.obstacles) if shape.path is None}
    for k, obstacle in enumerate(environment.obstacles):
        if obstacle.path is None:
            continue
        area = compute_swept_area(obstacle.polygon, obstacle.path)
        overlaps, excess = find_overlaps(area, fixed, environment.boundary_polygon)
        names = [_format_obstacle(environment, other) for other in overlaps]
        if excess is not None:
            names.append("the boundary")
        if names:
            yield f"{_format_obstacle(environment, k)} moves through {summarize_names(names)}"


def _format_obstacle(environment: Environment, k: int) -> str:
    """Return the JSON path of an obstacle, with its name if it has one."""
    path = format_path(("obstacles", k))
    name = environment.obstacles[k].name
    return f"{path} ({name})" if name else path


def _find_component_warnings(environment: Environment, radius: float) -> Iterator[str]:
    """Yield warnings about components of the free space that are not connected to the largest one."""
    robot_area = math.pi * radius * radius
    pocket_areas = []
    # The largest component comes first.
    _, *other_components = environment.free.geoms
    for component in other_components:
        if component.area < robot_area:
            pocket_areas.append(component.area)
            continue
        point = component.representative_point()
        yield f"sealed room of {format_area(component.area, 3)} around {format_position(point.x, point.y)}"
    if pocket_areas:
        pockets = format_count(len(pocket_areas), "sealed pocket")
        yield f"{pockets} smaller than a robot, {format_area(sum(pocket_areas), 2)} in total"


def _find_start_warnings(environment: Environment, radius: float) -> Iterator[str]:
    """Yield warnings about starts with given positions at which robots of the given radius do not fit."""
    for name, start in environment.starts.items():
        if isinstance(start, PointsStart):
            try:
                environment.start(name).sample(len(start.positions), radius=radius)
            except StartError as error:
                yield str(error)
