"""A report on a valid map: its measures, and warnings of likely mistakes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely

from robocov.arrays import Array, compute_lengths
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
    compute_swept_area,
    find_narrowest_gap,
    find_overlaps,
)
from robocov.errors import StartError, format_count, format_path, summarize_names

MANY_VERTICES = 5000
"""Maps with more vertices get a warning about computing time."""
_SECONDS_PER_SQUARED_VERTEX = 6.1e-8
"""Measured time to set up a `robocov.cost.CoverageCost`, divided by the squared number of vertices."""
_MAX_EQUAL_DISTANCE_M = 1e-6
"""Vertices closer than this are probably meant to be the same."""


_INTERIORS_INTERSECT = "T********"
"""DE-9IM pattern of two shapes whose interiors have points in common."""


class StartReport(NamedTuple):
    """A start of a map.

    Attributes
    ----------
    name : str
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
    area : float, m²
        Area inside the boundary.
    free_area : float, m²
        Area inside the boundary and outside every obstacle.
    vertex_count, obstacle_count : int
        Numbers in the file; circles have no vertices.
    components : tuple of float, m²
        Areas of the connected components of the free space, the largest first.
    narrowest_gap : Gap or None
        See `robocov.environment.find_narrowest_gap`.
    starts : tuple of StartReport
    warnings : tuple of str
        Likely mistakes, one line each.
    density : str or None
        Kind of the density.
    density_range : pair of float or None
        Smallest and largest value of the density.
    mean_density : float
        Mean of the density over the free space.
    """

    name: str
    area: float
    free_area: float
    vertex_count: int
    obstacle_count: int
    components: tuple[float, ...]
    narrowest_gap: Gap | None
    starts: tuple[StartReport, ...]
    warnings: tuple[str, ...]
    density: str | None = None
    density_range: tuple[float, float] | None = None
    mean_density: float = 1.0

    @property
    def free_fraction(self) -> float:
        """Free area as a fraction of the area."""
        return self.free_area / self.area

    def to_dict(self) -> dict[str, Any]:
        """Build the JSON document of the report, with units in the names of its keys.

        Returns
        -------
        dict
        """
        gap = self.narrowest_gap
        return {
            "name": self.name,
            "area_m2": self.area,
            "free_area_m2": self.free_area,
            "free_fraction": self.free_fraction,
            "vertices": self.vertex_count,
            "obstacles": self.obstacle_count,
            "components_m2": list(self.components),
            "narrowest_gap_m": None if gap is None else gap.width,
            "narrowest_gap_between": None if gap is None else [list(point) for point in gap.between],
            "starts": {start.name: {"kind": start.kind, "capacity": start.capacity} for start in self.starts},
            "density": self.density,
            "density_range": None if self.density_range is None else list(self.density_range),
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

    See Also
    --------
    load_map : Load a map; the maps that it returns are valid.

    Examples
    --------
    >>> import robocov as rc
    >>> rc.check_map(rc.load_map("square")).free_area
    100.0
    """
    gap = find_narrowest_gap(environment.free)
    density = environment.density
    return MapReport(
        name=environment.name,
        area=environment.area,
        free_area=environment.free_area,
        vertex_count=count_vertices(environment),
        obstacle_count=len(environment.obstacles),
        components=tuple(float(component.area) for component in environment.free.geoms),
        narrowest_gap=gap,
        starts=tuple(_build_start_report(environment, name, radius) for name in environment.starts),
        warnings=tuple(_find_warnings(environment, gap, radius)),
        density=None if density is None else density.kind,
        density_range=None if density is None else (density.min_value, _find_maximum(density)),
        mean_density=float(environment.free_masses.sum()) / environment.free_area,
    )


def _build_start_report(environment: Environment, name: str, radius: float) -> StartReport:
    start = environment.starts[name]
    if isinstance(start, PointsStart):
        return StartReport(name, "points", len(start.positions))
    kind = "disc" if isinstance(start, DiscStart) else "uniform"
    return StartReport(name, kind, environment.start(name).estimate_capacity(radius))


def _find_maximum(density: Density) -> float:
    """Return the largest value of a density; `max_value` is only a bound if peaks overlap."""
    if not isinstance(density, Gaussians) or len(density.peaks) < 2:
        return density.max_value
    # Imported only now, because loading it takes longer than checking most maps.
    from scipy.optimize import minimize

    def evaluate_negative(point: Array) -> float:
        return -float(density.evaluate(point[None])[0])

    return -float(min(minimize(evaluate_negative, peak.center).fun for peak in density.peaks))


def count_vertices(environment: Environment) -> int:
    """Count the vertices in the file of a map; circles have none.

    Parameters
    ----------
    environment : Environment

    Returns
    -------
    int
    """
    return sum(len(ring) for _, ring in _iterate_rings(environment))


def describe_vertex_count(vertex_count: int) -> str:
    """Return the warning about the computing time of a map with many vertices.

    Parameters
    ----------
    vertex_count : int

    Returns
    -------
    str
    """
    seconds = _SECONDS_PER_SQUARED_VERTEX * vertex_count * vertex_count
    time = f"{seconds:.0f} seconds" if seconds < 90.0 else f"{seconds / 60:.0f} minutes"
    return (
        f"This map has many vertices ({vertex_count}): computing the distances between them takes about "
        f"{time} before a run, and four times as long for twice as many"
    )


def _iterate_rings(environment: Environment) -> Iterator[tuple[str, Ring]]:
    """Yield the lists of vertices of the file, with their paths."""
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
        ends = " and ".join(f"[{x:.4g}, {y:.4g}]" for x, y in gap.between)
        yield (
            f"the gap between {ends} is {gap.width:.3g} m wide: a robot of radius {radius:g} m cannot pass"
        )
    yield from _find_start_warnings(environment, radius)


def _find_shape_warnings(environment: Environment) -> Iterator[str]:
    """Yield warnings about duplicate vertices and obstacles outside the boundary."""
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
    fixed = {k: shape.polygon for k, shape in enumerate(environment.obstacles) if shape.path is None}
    for k, obstacle in enumerate(environment.obstacles):
        if obstacle.path is None:
            continue
        area = compute_swept_area(obstacle.polygon, obstacle.path)
        overlapped, outside = find_overlaps(area, fixed, environment.boundary_polygon)
        names = [_format_obstacle(environment, other) for other in overlapped]
        if outside is not None:
            names.append("the boundary")
        if names:
            yield f"{_format_obstacle(environment, k)} moves through {summarize_names(names)}"


def _format_obstacle(environment: Environment, k: int) -> str:
    path = format_path(("obstacles", k))
    name = environment.obstacles[k].name
    return f"{path} ({name})" if name else path


def _find_component_warnings(environment: Environment, radius: float) -> Iterator[str]:
    """Yield warnings about components of the free space that the largest one does not reach."""
    footprint = math.pi * radius * radius
    pockets = []
    # The largest component comes first.
    _, *other_components = environment.free.geoms
    for component in other_components:
        if component.area < footprint:
            pockets.append(component.area)
            continue
        point = component.representative_point()
        yield f"sealed room of {component.area:.3g} m² around [{point.x:.4g}, {point.y:.4g}]"
    if pockets:
        pocket_count = format_count(len(pockets), "sealed pocket")
        yield f"{pocket_count} smaller than a robot, {sum(pockets):.2g} m² in total"


def _find_start_warnings(environment: Environment, radius: float) -> Iterator[str]:
    for name, start in environment.starts.items():
        if isinstance(start, PointsStart):
            try:
                environment.start(name).sample(len(start.positions), radius=radius)
            except StartError as error:
                yield str(error)
