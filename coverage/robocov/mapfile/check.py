"""The geometric rules that a map must keep, what it is like, and what may be a mistake in it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import shapely
from shapely import Polygon

from robocov.arrays import Array
from robocov.density import Density, Gaussians, WeightedArea, WeightedPolygons
from robocov.environment import (
    MIN_START_GAP_RADII,
    DiscStart,
    Environment,
    Gap,
    PointsStart,
    PolygonObstacle,
    Ring,
    UniformStart,
    WallObstacle,
    compute_swept_area,
    find_narrowest_gap,
    find_overlaps,
)
from robocov.errors import JsonPath, MapError, Mistake, StartError, format_count, format_path, summarize_names
from robocov.mapfile.models import LARGEST, SMALLEST
from robocov.team import DEFAULT_RADIUS

_FLAT = 1e-9
"""A ring whose area is below this part of its bounding box squared is a line."""
_SAME_PLACE = 1e-6
"""Vertices closer than this, in metres, are one vertex given twice."""
MANY_VERTICES = 5000
"""Of a map with more vertices it is said that it takes time."""
_COST_SECONDS = 6.1e-8
"""Seconds that `robocov.cost.CoverageCost` takes to begin, by the square of the vertices, as measured."""


def check_rules(environment: Environment, where: str) -> None:
    """Raise `MapError` unless `environment`, which messages call `where`, can be simulated."""
    found = list(_ring_mistakes(("boundary",), environment.boundary))
    for k, obstacle in enumerate(environment.obstacles):
        at = ("obstacles", k)
        if isinstance(obstacle, PolygonObstacle):
            found += _polygon_mistakes(at, obstacle)
        elif isinstance(obstacle, WallObstacle):
            found += _line_mistakes((*at, "points"), obstacle.points, "wall")
        if obstacle.path is not None:
            found += _line_mistakes((*at, "path", "points"), obstacle.path.points, "path")
    if isinstance(environment.density, WeightedPolygons):
        for k, area in enumerate(environment.density.areas):
            found += _polygon_mistakes(("density", "areas", k), area)
    if found := found or list(_space_mistakes(environment)):
        raise MapError.from_mistakes(where, found)


def _ring_mistakes(at: JsonPath, ring: Ring) -> Iterator[Mistake]:
    """Yield what is wrong with a closed ring of at least 3 points."""
    points = np.asarray(ring, dtype=float)
    extent = np.ptp(points, axis=0)
    size, flat = f"{extent[0]:g} x {extent[1]:g} m", _FLAT * float(extent.max()) ** 2
    count = len(set(map(tuple, ring)))
    if count < 3:
        yield Mistake.at_path(at, f"{format_count(count, 'different point')}, but at least 3 were wanted")
    elif extent.max() > LARGEST:
        yield Mistake.at_path(at, f"{size}, but at most {LARGEST / 1000:g} km was wanted")
    elif extent.min() < SMALLEST:
        yield Mistake.at_path(at, f"{size}, but at least {SMALLEST * 1000:g} mm each way was wanted")
    # a ring that crosses itself may have no area either
    elif shapely.convex_hull(polygon := Polygon(points)).area <= flat:
        yield Mistake.at_path(
            at, f"area {polygon.area:g} m², but points that are not on one line were wanted"
        )
    elif not polygon.is_valid:
        yield _crossing(at, points, polygon)


def _line_mistakes(at: JsonPath, line: Ring, thing: str) -> Iterator[Mistake]:
    """Yield what is wrong with the points of a wall or a path."""
    points = np.asarray(line, dtype=float)
    extent = np.ptp(points, axis=0)
    if extent.max() > LARGEST:
        size = f"{extent[0]:g} x {extent[1]:g} m"
        yield Mistake.at_path(at, f"{size}, but at most {LARGEST / 1000:g} km was wanted")
    elif extent.max() < SMALLEST:
        length = float(np.hypot(*np.diff(points, axis=0).T).sum())
        size = f"{length:g} m long" if thing == "wall" else f"{extent.max():g} m wide"
        yield Mistake.at_path(at, f"a {thing} {size}, but at least {SMALLEST * 1000:g} mm was wanted")


def _crossing(at: JsonPath, points: Array, polygon: Polygon) -> Mistake:
    """Return the mistake of a ring that crosses or touches itself, with the two edges."""
    reason = shapely.is_valid_reason(polygon)
    spot = np.array([float(value) for value in reason[reason.index("[") + 1 : -1].split()])
    ends = np.roll(points, -1, axis=0)
    edges = shapely.linestrings(np.stack([points, ends], axis=1))
    distance = shapely.distance(edges, shapely.Point(spot))
    distance[(points == ends).all(axis=1)] = np.inf
    nearest = [int(k) for k in np.argsort(distance, kind="stable")[:6]]
    # neighbours in the ring always meet: name another edge if there is one at that spot
    apart = (k for k in nearest if (k - nearest[0]) % len(points) not in (0, 1, len(points) - 1))
    other = next((k for k in apart if distance[k] <= 1e-6), nearest[1])
    first, second = sorted((nearest[0], other))
    found = (
        f"the edge from here meets the edge from {format_path((*at, second))} near [{spot[0]:g}, {spot[1]:g}]"
    )
    return Mistake.at_path((*at, first), f"{found}, but a ring that does not meet itself was wanted")


def _polygon_mistakes(at: JsonPath, shape: PolygonObstacle | WeightedArea) -> Iterator[Mistake]:
    found = list(_ring_mistakes((*at, "vertices"), shape.vertices))
    for k, hole in enumerate(shape.holes):
        found += _ring_mistakes((*at, "holes", k), hole)
    yield from found
    if found or shape.polygon.is_valid:
        return
    # each ring is good by itself
    shell = Polygon(shape.vertices)
    good: list[Ring] = []
    for k, hole in enumerate(shape.holes):
        path = (*at, "holes", k)
        if not shell.covers(Polygon(hole)):
            yield Mistake.at_path(
                path, f"sticks out of {format_path((*at, 'vertices'))}, but a hole inside was wanted"
            )
        elif not Polygon(shape.vertices, [*good, hole]).is_valid:
            yield Mistake.at_path(
                path, "meets the outline or another hole, but a hole apart from them was wanted"
            )
        else:
            good.append(hole)


def _space_mistakes(environment: Environment) -> Iterator[Mistake]:
    """Yield what is wrong with the map as a whole, once each part is good."""
    if len(environment.region.vertices) < 3:
        yield Mistake.at_path(
            ("boundary",), "its convex hull is a line, but a region with an area was wanted"
        )
        return
    if environment.free.is_empty:
        yield Mistake.at_path(
            ("obstacles",), "no free space is left inside the boundary, but some was wanted"
        )
        return
    density = environment.density
    # integrals take a second to load what they need
    if density is not None and not (density.min_value > 0.0 or environment.free_masses.sum() > 0.0):
        what = "all places in the free space count 0, but a weight above 0 was wanted"
        yield Mistake.at_path(("density",), what)
    for name in environment.starts:
        yield from _start_mistakes(environment, name)


def _start_mistakes(environment: Environment, name: str) -> Iterator[Mistake]:
    at = ("starts", name)
    spec = environment.starts[name]
    if isinstance(spec, PointsStart):
        points = np.asarray(spec.positions, dtype=float)
        inside = shapely.contains_properly(environment.free, shapely.points(points))
        for k in np.flatnonzero(~inside).tolist():
            found = f"[{points[k, 0]:g}, {points[k, 1]:g}] is inside an obstacle or outside the boundary"
            yield Mistake.at_path((*at, "positions", k), f"{found}, but a free place was wanted")
        if len(np.unique(points, axis=0)) < len(points):
            yield Mistake.at_path(
                (*at, "positions"), "one place is given twice, but one place a robot was wanted"
            )
        return
    if _plainly_has_room(environment, spec):
        return
    try:
        environment.start(name).sample(1, radius=DEFAULT_RADIUS)
    except StartError:
        what = "the free space"
        if isinstance(spec, DiscStart):
            what = f"the disc of radius {spec.radius:g} m at [{spec.center[0]:g}, {spec.center[1]:g}]"
        wanted = f"room for a robot of radius {DEFAULT_RADIUS:g} m was wanted"
        yield Mistake.at_path(at, f"{what} has no room, but {wanted}")


def _plainly_has_room(environment: Environment, spec: DiscStart | UniformStart) -> bool:
    """Return whether a robot fits at the centre of a disc: quicker than a draw, which takes seconds."""
    discs = [spec] if isinstance(spec, DiscStart) else environment.starts.values()
    given = [disc.center for disc in discs if isinstance(disc, DiscStart)]
    centres = shapely.points(np.reshape(given, (-1, 2)))
    inside = shapely.contains_properly(environment.free, centres)
    clearance = shapely.distance(environment.free.boundary, centres)
    return bool((inside & (clearance > DEFAULT_RADIUS * (1 + MIN_START_GAP_RADII) + 0.01)).any())


class StartReport(NamedTuple):
    """A start of a map: its kind, ``disc``, ``uniform`` or ``points``, and about how many robots fit."""

    name: str
    kind: str
    capacity: int


@dataclass(frozen=True)
class MapReport:
    """Findings of `check_map`.

    Attributes
    ----------
    area, free_area : float, m²
        Inside the boundary, and of that outside every obstacle.
    vertices, obstacles : int
        As they are given in the file: a circle has none.
    components : tuple of float, m²
        Areas of the connected parts of the free space, the largest first.
    warnings : tuple of str
        What may be a mistake, one line each.
    density, density_range, mean_density : str or None, ...
        Its kind, its least and largest values, and its mean over the free space.
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
    """Measure a valid map, and warn of what may be a mistake with robots of a radius, m."""
    gap = find_narrowest_gap(environment.free)
    vertices = vertex_count(environment)
    warnings = [many_vertices(vertices)] if vertices > MANY_VERTICES else []
    warnings += [*_shape_warnings(environment), *_path_warnings(environment)]
    warnings += _room_warnings(environment, radius)
    if gap is not None and gap.width < 2 * radius:
        (a, b), (c, d) = gap.between
        found = f"the gap between [{a:.4g}, {b:.4g}] and [{c:.4g}, {d:.4g}] is {gap.width:.3g} m wide"
        warnings.append(f"{found}: a robot of radius {radius:g} m does not pass")
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
        density_range=None if density is None else (density.min_value, _highest(density)),
        mean_density=float(environment.free_masses.sum()) / environment.free_area,
    )


def _highest(density: Density) -> float:
    """Return the largest value of a density: of overlapping peaks less than the bound that `highest` is."""
    if not isinstance(density, Gaussians) or len(density.peaks) < 2:
        return density.max_value
    from scipy.optimize import minimize  # which takes longer to load than most maps to check

    def depth(at: Array) -> float:
        return -float(density.evaluate(at[None])[0])

    return -float(min(minimize(depth, peak.center).fun for peak in density.peaks))


def vertex_count(environment: Environment) -> int:
    """Return how many vertices a map has, as they are given in its file: a circle has none."""
    return sum(len(ring) for _, ring in _rings(environment))


def many_vertices(count: int) -> str:
    """Return what it means that a map has more than `MANY_VERTICES`."""
    minutes = _COST_SECONDS * count * count / 60
    time = f"{60 * minutes:.0f} seconds" if minutes < 1.5 else f"{minutes:.0f} minutes"
    takes = f"before a run the exact distances among them take about {time}"
    return f"{count} vertices are many: {takes}, four times as long for twice as many"


def _rings(environment: Environment) -> Iterator[tuple[str, Ring]]:
    """Yield the lists of vertices of the file, with their places."""
    yield "boundary", environment.boundary
    for k, obstacle in enumerate(environment.obstacles):
        at = format_path(("obstacles", k))
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
        area = compute_swept_area(obstacle.polygon, obstacle.path)
        met, beyond = find_overlaps(area, standing, environment.boundary_polygon)
        names = [_called(other, environment.obstacles[other].name) for other in met]
        names += ["the boundary"] if beyond is not None else []
        if names:
            yield f"{_called(k, obstacle.name)} moves through {summarize_names(names)}"


def _called(k: int, name: str | None) -> str:
    return format_path(("obstacles", k)) + (f" ({name})" if name else "")


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
        pockets = format_count(len(slivers), "sealed pocket")
        yield f"{pockets} smaller than a robot, {sum(slivers):.2g} m² together"


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
    kind = "disc" if isinstance(spec, DiscStart) else "uniform"
    return StartReport(name, kind, environment.start(name).estimate_capacity(radius))
