"""What a map is like: areas, rooms, starts, and what may be a mistake in it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely

from robocov.environment import (
    START_GAP,
    DiscStart,
    Environment,
    PointsStart,
    PolygonObstacle,
    Ring,
    WallObstacle,
    in_the_way,
    swept_area,
)
from robocov.environment.passages import Gap, narrowest_gap
from robocov.errors import StartError, listed, place
from robocov.robots import DEFAULT_RADIUS

_SAME_PLACE = 1e-6
"""Vertices closer than this, in metres, are one vertex given twice."""

MANY_VERTICES = 5000
"""Of a map with more vertices it is said that it takes time."""

_COST_SECONDS = 6.1e-8
"""What `robocov.cost.CoverageCost` takes to begin, by the square of the vertices: measured on 1,250 and 2,500
desks in a hall, 1.5 and 6 s."""


class StartReport(NamedTuple):
    """A start of a map: its kind, ``disc``, ``uniform`` or ``points``, and about how many robots fit."""

    name: str
    kind: str
    capacity: int


@dataclass(frozen=True)
class MapReport:
    """What `check_map` finds.

    Attributes
    ----------
    name : str
    area, free_area : float, m²
        Inside the boundary, and of that outside every obstacle.
    vertices, obstacles : int
        As they are given in the file: a circle has none.
    components : tuple of float, m²
        Areas of the connected parts of the free space, the largest first.
    narrowest_gap : Gap or None
        None where the free space has no passage, as in a convex room.
    starts : tuple of StartReport
    warnings : tuple of str
        What may be a mistake, one line each.
    density : str or None
        Its kind, None where there is none; with bounds of its values, `density_range`, and
    mean_density : float
        its mean over the free space.
    """

    name: str
    area: float
    free_area: float
    vertices: int
    obstacles: int
    components: tuple[float, ...]
    narrowest_gap: Gap | None
    starts: tuple[StartReport, ...]
    warnings: tuple[str, ...]
    density: str | None = None
    density_range: tuple[float, float] | None = None
    mean_density: float = 1.0

    @property
    def free_fraction(self) -> float:
        """Free area as a part of the area."""
        return self.free_area / self.area

    def to_dict(self) -> dict[str, Any]:
        """Return the report as a JSON document, with units in the key names."""
        gap = self.narrowest_gap
        return {
            "name": self.name,
            "area_m2": self.area,
            "free_area_m2": self.free_area,
            "free_fraction": self.free_fraction,
            "vertices": self.vertices,
            "obstacles": self.obstacles,
            "components_m2": list(self.components),
            "narrowest_gap_m": gap and gap.width,
            "narrowest_gap_between": gap and [list(point) for point in gap.between],
            "starts": {start.name: {"kind": start.kind, "capacity": start.capacity} for start in self.starts},
            "density": self.density,
            "density_range": self.density_range and list(self.density_range),
            "mean_density": self.mean_density,
            "warnings": list(self.warnings),
        }


def check_map(environment: Environment, radius: float = DEFAULT_RADIUS) -> MapReport:
    """Measure a valid map, and warn of what may be a mistake.

    Parameters
    ----------
    environment : Environment
    radius : float, m
        Radius of a robot, for the capacity of the starts and the warning of gaps.

    Examples
    --------
    >>> from robocov.mapfile import load_map
    >>> check_map(load_map("square")).components
    (100.0,)
    """
    gap = narrowest_gap(environment.free)
    vertices = vertex_count(environment)
    warnings = [many_vertices(vertices)] if vertices > MANY_VERTICES else []
    warnings += [*_shape_warnings(environment), *_path_warnings(environment)]
    warnings += _room_warnings(environment, radius)
    if gap is not None and gap.width < 2 * radius:
        (a, b), (c, d) = gap.between
        warnings.append(
            f"the gap between [{a:.4g}, {b:.4g}] and [{c:.4g}, {d:.4g}] is {gap.width:.3g} m wide: "
            f"a robot of radius {radius:g} m does not pass"
        )
    warnings += _start_warnings(environment, radius)
    density = environment.density
    return MapReport(
        name=environment.name,
        area=environment.area,
        free_area=environment.free_area,
        vertices=vertices,
        obstacles=len(environment.obstacles),
        components=tuple(float(part.area) for part in environment.free.geoms),
        narrowest_gap=gap,
        starts=tuple(_start_report(environment, name, radius) for name in environment.starts),
        warnings=tuple(warnings),
        density=None if density is None else density.kind,
        density_range=None if density is None else (density.lowest, density.highest),
        mean_density=float(environment.free_masses.sum()) / environment.free_area,
    )


def vertex_count(environment: Environment) -> int:
    """Return how many vertices a map has, as they are given in its file: a circle has none."""
    return sum(len(ring) for _, ring in _rings(environment))


def many_vertices(count: int) -> str:
    """Return what it means that a map has more than `MANY_VERTICES`."""
    minutes = _COST_SECONDS * count * count / 60
    time = f"{60 * minutes:.0f} seconds" if minutes < 1.5 else f"{minutes:.0f} minutes"
    return (
        f"{count} vertices are many: before a run the exact distances among them take about {time}, four "
        "times as long for twice as many"
    )


def _rings(environment: Environment) -> Iterator[tuple[str, Ring]]:
    """Yield the lists of vertices of the file, with their places."""
    yield "boundary", environment.boundary
    for k, obstacle in enumerate(environment.obstacles):
        at = place(("obstacles", k))
        if isinstance(obstacle, PolygonObstacle):
            yield f"{at}.vertices", obstacle.vertices
            for hole, ring in enumerate(obstacle.holes):
                yield f"{at}.holes[{hole}]", ring
        elif isinstance(obstacle, WallObstacle):
            yield f"{at}.points", obstacle.points


def _shape_warnings(environment: Environment) -> Iterator[str]:
    for at, ring in _rings(environment):
        points = np.asarray(ring)
        step = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
        if at.endswith(".points"):
            step = step[:-1]  # a wall may end where it began
        for near in np.flatnonzero(step < _SAME_PLACE):
            yield f"{at}[{near}] and the next vertex are the same place"
    inside = environment.boundary_polygon
    for k, obstacle in enumerate(environment.obstacles):
        if not shapely.relate_pattern(obstacle.polygon, inside, "T********"):
            yield f"{_called(k, obstacle.name)} is entirely outside the boundary"


def _path_warnings(environment: Environment) -> Iterator[str]:
    """Warn of obstacles that move through what stands, or through the outer wall."""
    standing = {k: shape.polygon for k, shape in enumerate(environment.obstacles) if shape.path is None}
    for k, obstacle in enumerate(environment.obstacles):
        if obstacle.path is None:
            continue
        area = swept_area(obstacle.polygon, obstacle.path)
        met, beyond = in_the_way(area, standing, environment.boundary_polygon)
        names = [_called(other, environment.obstacles[other].name) for other in met]
        names += ["the boundary"] if beyond is not None else []
        if names:
            yield f"{_called(k, obstacle.name)} moves through {listed(names)}"


def _called(k: int, name: str | None) -> str:
    return place(("obstacles", k)) + (f" ({name})" if name else "")


def _room_warnings(environment: Environment, radius: float) -> Iterator[str]:
    """Warn of parts of the free space that cannot be reached from the largest."""
    footprint = math.pi * radius * radius
    slivers = []
    for part in list(environment.free.geoms)[1:]:
        if part.area < footprint:
            slivers.append(part.area)
            continue
        spot = part.representative_point()
        yield f"sealed room of {part.area:.3g} m² around [{spot.x:.4g}, {spot.y:.4g}]"
    if slivers:
        plural = "s" if len(slivers) > 1 else ""
        yield f"{len(slivers)} sealed pocket{plural} smaller than a robot, {sum(slivers):.2g} m² together"


def _start_warnings(environment: Environment, radius: float) -> Iterator[str]:
    for name, spec in environment.starts.items():
        if isinstance(spec, PointsStart):
            try:
                environment.start(name).sample(len(spec.positions), radius=radius)
            except StartError as error:
                yield str(error)


def _start_report(environment: Environment, name: str, radius: float) -> StartReport:
    spec = environment.starts[name]
    if isinstance(spec, PointsStart):
        return StartReport(name, "points", len(spec.positions))
    # robots in the densest packing, a hexagonal one
    cell = 2 * math.sqrt(3) * (radius * (1 + START_GAP)) ** 2
    capacity = max(1, int(environment.start(name).room(radius).area / cell))
    return StartReport(name, "disc" if isinstance(spec, DiscStart) else "uniform", capacity)
