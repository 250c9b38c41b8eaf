"""The environment: outer boundary, obstacles, named starts, and the geometry derived from them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from numbers import Integral
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shapely import LineString, MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, IntArray, freeze
from robocov.density import Density
from robocov.density.base import compute_polygon_masses
from robocov.drawing import Drawable
from robocov.errors import StartError, describe_unknown_name, format_count, is_number, require_type
from robocov.observation.region import Region
from robocov.team import DEFAULT_RADIUS

Point: TypeAlias = tuple[float, float]
Ring: TypeAlias = tuple[Point, ...]
Repeat: TypeAlias = Literal["loop", "back-and-forth"]
"""Behaviour at the end of a path: straight to its beginning, or back the way it came."""
REPEATS: tuple[str, ...] = get_args(Repeat)
GRID_M = 1e-6
"""Derived geometry is computed on a grid of one micrometre, so that unions and differences are
robust: what touches to within rounding touches exactly, and no sliver survives."""
MAX_SAGITTA_M = 1e-3
"""Largest distance in metres between a circle and the polygon that stands for it."""
MIN_START_GAP_RADII = 0.02
"""Smallest gap, as a part of a robot's radius, left between two robots and to walls at the start."""
MAX_COUNTED_ROBOTS = 2000
"""Robots of a start that are counted one by one; the capacity of larger ones is estimated from the area."""
_PACKING_TRIALS, _FEW_ROBOTS = 6, 300
"""Number of packings that are tried where there is room for few robots, and how many are few."""
_LEAST_OVERLAP = 1e-6
"""Area in m² from which an obstacle is in the way: what is less is rounding, of obstacles that touch."""
MIN_POCKET_AREA_M2 = math.pi * DEFAULT_RADIUS**2
"""A gap to a pocket smaller than this, in m², is none: no robot would go there."""
_CRACK = 2 * MAX_SAGITTA_M
"""Walls closer than this, in metres, touch: a circle that touches a wall is a polygon that nearly does."""
_CHUNK = 256
"""Corners that are looked at together, so that memory stays bounded."""
_DIGITS = 6
"""Results are rounded to the grid of the derived geometry, a micrometre."""


@dataclass(frozen=True)
class ObstaclePath:
    """A poly-line, (x, y) m, along which an obstacle is shifted at a constant speed, m/s, without turning.

    At time zero the obstacle is where its map has it, and the path's point at the first of `points`; later it
    is shifted by as much as that point has moved.
    """

    points: Ring
    speed: float
    repeat: Repeat = "loop"

    @cached_property
    def _line(self) -> tuple[Array, Array]:
        """One turn, from the first point back to it, (k, 2) m, and how far each is along it, (k,) m."""
        points = np.array(self.points, dtype=float)
        back = points[:1] if self.repeat == "loop" else points[-2::-1]
        line = np.concatenate([points, back])
        length = np.hypot(*np.diff(line, axis=0).T)
        return line, np.concatenate([[0.0], np.cumsum(length)])

    @property
    def period(self) -> float:
        """Seconds until the obstacle is back, and about to go the same way again."""
        return float(self._line[1][-1]) / self.speed

    def compute_displacement(self, time: float) -> Array:
        """Return by how much the obstacle has moved at a time, s; (2,) m."""
        line, along = self._line
        place = (time * self.speed) % along[-1]
        return np.asarray(np.array([np.interp(place, along, line[:, k]) for k in (0, 1)]) - line[0])


@dataclass(frozen=True)
class PolygonObstacle:
    """A solid polygon, with holes where given (a courtyard)."""

    vertices: Ring
    holes: tuple[Ring, ...] = ()
    name: str | None = None
    path: ObstaclePath | None = None

    @cached_property
    def polygon(self) -> Polygon:
        """The obstacle's shape."""
        return Polygon(self.vertices, self.holes)


@dataclass(frozen=True)
class CircleObstacle:
    """A round pillar: the inscribed regular polygon of at most `MAX_SAGITTA_M` for physics and cost alike."""

    center: Point
    radius: float
    name: str | None = None
    path: ObstaclePath | None = None

    @cached_property
    def polygon(self) -> Polygon:
        """The polygon that stands for it."""
        sides = 12
        if self.radius > MAX_SAGITTA_M:
            sides = max(sides, math.ceil(math.pi / math.acos(1.0 - MAX_SAGITTA_M / self.radius)))
        angle = np.arange(sides) * (2.0 * np.pi / sides)
        return Polygon(np.column_stack([np.cos(angle), np.sin(angle)]) * self.radius + self.center)


@dataclass(frozen=True)
class WallObstacle:
    """A poly-line of some width, with flat ends at its first and last point and mitred corners."""

    points: Ring
    width: float
    name: str | None = None
    path: ObstaclePath | None = None

    @cached_property
    def polygon(self) -> BaseGeometry:
        """The obstacle's shape; several polygons where the line doubles back."""
        line = LineString(self.points)
        return line.buffer(self.width / 2, cap_style="flat", join_style="mitre", mitre_limit=4.0)


Obstacle: TypeAlias = PolygonObstacle | CircleObstacle | WallObstacle


@dataclass(frozen=True)
class DiscStart:
    """The robots start somewhere in a disc: a team that was unloaded in one place."""

    center: Point
    radius: float


@dataclass(frozen=True)
class UniformStart:
    """The robots start anywhere in the free space."""


@dataclass(frozen=True)
class PointsStart:
    """The robots start at given positions; at most as many robots as there are positions."""

    positions: Ring


StartSpec: TypeAlias = DiscStart | UniformStart | PointsStart


@dataclass(frozen=True)
class Environment(Drawable):
    """A map: what is there, and where a team may start. Immutable; equal when the content is equal.

    Only the physics, the sensor and the evaluation know the obstacles. A controller gets
    `region`, the convex hull of the boundary, and what its robots sense.

    Attributes
    ----------
    boundary : ring of [x, y], m
        As it was given: either way round, convex or not.
    obstacles : tuple of obstacles
        At time zero, where they have a path. They may overlap, touch and stick out of the boundary.
    starts : dict of name to start
        The first is the default.
    extra, schema : dict, str or None
        Free keys of the file and its ``$schema``, kept untouched.
    density : Density or None
        φ, how much each place counts: part of the task, which robots know. None: every place the same.
    """

    _drawn_as = "environment"

    name: str
    boundary: Ring
    obstacles: tuple[Obstacle, ...] = ()
    starts: Mapping[str, StartSpec] = field(default_factory=dict)
    description: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict)
    schema: str | None = None
    density: Density | None = None

    def __hash__(self) -> int:
        return hash((self.name, self.boundary, self.obstacles))

    def __repr__(self) -> str:
        width, height = np.ptp(np.asarray(self.boundary, dtype=float), axis=0).tolist()
        obstacles = format_count(len(self.obstacles), "obstacle")
        return f"<Environment {self.name}, {width:.4g} x {height:.4g} m, {obstacles}>"

    @cached_property
    def region(self) -> Region:
        """The convex hull of the boundary: all that the robots know of the map."""
        return Region(np.asarray(self.boundary, dtype=float))

    @cached_property
    def boundary_polygon(self) -> Polygon:
        """The boundary as a counter-clockwise shapely polygon."""
        return shapely.orient_polygons(Polygon(self.boundary))

    @cached_property
    def free(self) -> MultiPolygon:
        """The parts of the free space, inside the boundary and outside every obstacle, the largest first."""
        inside = shapely.set_precision(self.boundary_polygon, GRID_M)
        if self.obstacles:
            solid = _united(np.array([shape.polygon for shape in self.obstacles]))
            inside = shapely.difference(inside, solid, grid_size=GRID_M)
        return _polygons(inside)

    @cached_property
    def blocked(self) -> MultiPolygon:
        """The part of the region that is not free: obstacles, and the outside of a non-convex boundary."""
        region = shapely.set_precision(self.region.polygon, GRID_M)
        return _polygons(shapely.difference(region, self.free, grid_size=GRID_M))

    @cached_property
    def has_moving_obstacles(self) -> bool:
        """Whether an obstacle moves."""
        return any(shape.path is not None for shape in self.obstacles)

    @cached_property
    def static(self) -> Environment:
        """The map without the obstacles that move; this one where none does."""
        still = tuple(shape for shape in self.obstacles if shape.path is None)
        return replace(self, obstacles=still) if self.has_moving_obstacles else self

    def at(self, time: float) -> Environment:
        """Return the map as it is at a time, s, with all obstacles standing; this one where none moves."""
        if not self.has_moving_obstacles:
            return self
        obstacles = tuple(
            # to the nanometre, so that an obstacle that comes by again stands in the very same place
            shape
            if shape.path is None
            else shift_obstacle(shape, np.round(shape.path.compute_displacement(time), 9))
            for shape in self.obstacles
        )
        return replace(self, obstacles=obstacles)

    @property
    def area(self) -> float:
        """Area inside the boundary, m²."""
        return float(self.boundary_polygon.area)

    @property
    def free_area(self) -> float:
        """Area of the free space, m²."""
        return float(self.free.area)

    @cached_property
    def free_masses(self) -> Array:
        """Integral of φ over each component of the free space, m²: their areas without a density."""
        parts = self.free.geoms
        if self.density is None or self.density.is_uniform:
            weight = 1.0 if self.density is None else self.density.max_value
            return freeze([part.area * weight for part in parts])
        return freeze(compute_polygon_masses(self.density, list(parts)))

    def with_density(self, density: Density | None) -> Environment:
        """Return the same map with another density; what is derived from its geometry is kept."""
        twin = replace(self, density=density)
        kept = ("region", "boundary_polygon", "free", "blocked")
        twin.__dict__.update({name: self.__dict__[name] for name in kept if name in self.__dict__})
        return twin

    def has_same_geometry(self, other: Environment) -> bool:
        """Return whether another map has the same boundary and obstacles."""
        return self.boundary == other.boundary and self.obstacles == other.obstacles

    def start(self, name: str | None = None) -> Start:
        """Return the start called `name`, by default the map's first; raise StartError for an unknown one.

        Every map has a start ``uniform``, anywhere in the free space, whether the file names it or not.
        """
        starts = {**self.starts}
        starts.setdefault("uniform", UniformStart())
        name = next(iter(starts)) if name is None else name
        if name not in starts:
            raise StartError(f"map {self.name!r}: {describe_unknown_name('start', name, starts)}")
        return Start(name, starts[name], self.free)


@dataclass(frozen=True, eq=False)
class Start:
    """A named start of one environment, ready to draw positions from.

    A draw depends on the start, the number of robots, their radius and the seed only, so that every
    controller gets the same positions for the same seed.
    """

    name: str
    spec: StartSpec
    free: BaseGeometry

    def sample(self, n: int, seed: int = 0, radius: float = DEFAULT_RADIUS) -> Array:
        """Draw positions of `n` robots of a radius, m, that touch neither walls nor each other, (n, 2) m.

        Where positions are given, the seed is not used. Raises StartError when the robots do not fit.
        """
        for name, value, least in (("robots", n, 1), ("seed", seed, 0)):
            if not is_number(value, Integral) or value < least:
                raise self._error(f"{name}: {value!r}, but a whole number from {least} was wanted")
        if not 0.0 < radius < math.inf:
            raise self._error(f"radius: {radius!r} m, but a number above 0 was wanted")
        if isinstance(self.spec, PointsStart):
            return self._given(n, radius, self.spec.positions)
        spacing = 2.0 * radius * (1.0 + MIN_START_GAP_RADII)
        room = self.compute_center_area(radius)
        if room.is_empty:
            raise self._error(f"no room for a robot of radius {radius:g} m; a wider start was wanted")
        rng = np.random.default_rng([seed, n])
        points = np.empty((0, 2))
        if n <= _max_packed(room, spacing):
            points = _darts(rng, room, n, spacing)
            if len(points) < n:
                points = _hexagonal(rng, room, n, spacing)
            if len(points) < n <= MAX_COUNTED_ROBOTS:
                packed = _densest(room, spacing)
                if len(packed) >= n:
                    points = packed[np.sort(rng.choice(len(packed), size=n, replace=False))]
        if len(points) < n:
            raise self._error(self._describe_lack_of_space(n, radius))
        return points

    def estimate_capacity(self, radius: float = DEFAULT_RADIUS) -> int:
        """Return about how many robots of a radius fit.

        It depends on the start and the radius alone: the number of robots in the densest packing that is
        found, with the gaps that `sample` leaves. For so many robots `sample` finds positions with any seed;
        now and then, by chance, one or two more fit. Where there is room for thousands, or where positions
        are given, it is estimated from the area, or their number.

        Parameters
        ----------
        radius : float, m

        Returns
        -------
        int
            0 if not even one robot fits.
        """
        if isinstance(self.spec, PointsStart):
            return len(self.spec.positions)
        room = self.compute_center_area(radius)
        if room.is_empty:
            return 0
        spacing = 2.0 * radius * (1.0 + MIN_START_GAP_RADII)
        if _max_packed(room, spacing) > MAX_COUNTED_ROBOTS:
            # each robot of a hexagonal packing takes a cell of this area
            return max(1, int(room.area / (spacing**2 * math.sqrt(3) / 2)))
        return len(_densest(room, spacing))

    def _describe_lack_of_space(self, n: int, radius: float) -> str:
        capacity = self.estimate_capacity(radius)
        found = f"room for about {capacity} robots of radius {radius:g} m, but {n} were asked for"
        ways = ["fewer or smaller robots", "another map"]
        if not isinstance(self.spec, UniformStart):
            everywhere = Start("uniform", UniformStart(), self.free).estimate_capacity(radius)
            ways.insert(1, f"start 'uniform' (room for about {everywhere})")
        return f"{found}. Try {', '.join(ways[:-1])} or {ways[-1]}."

    def compute_center_area(self, radius: float) -> BaseGeometry:
        """Return where the centre of a robot of that radius may be, unless positions are given."""
        room = self.free.buffer(-radius * (1.0 + MIN_START_GAP_RADII))
        if isinstance(self.spec, DiscStart):
            # the disc holds the centres; robots may stick out of it by their radius
            room = room.intersection(shapely.Point(self.spec.center).buffer(self.spec.radius, quad_segs=64))
        return room

    def _error(self, what: str) -> StartError:
        return StartError(f"start {self.name!r}: {what}")

    def _given(self, n: int, radius: float, positions: Ring) -> Array:
        if n > len(positions):
            found = f"has {len(positions)} positions, but {n} robots were asked for"
            raise self._error(f"{found}; at most {len(positions)} robots or another start was wanted")
        points = np.array(positions[:n], dtype=float)
        distance = shapely.distance(shapely.points(points), self.free.boundary)
        inside = shapely.contains_properly(self.free, shapely.points(points))
        for k in np.flatnonzero(~inside | (distance < radius)).tolist():
            place = f"positions[{k}] = [{points[k, 0]:g}, {points[k, 1]:g}]"
            if not inside[k]:
                raise self._error(f"{place} is inside an obstacle or outside the boundary")
            away = f"{distance[k]:.3g} m from a wall"
            raise self._error(f"{place} is {away}, but a robot of radius {radius:g} m must fit")
        gaps = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
        np.fill_diagonal(gaps, np.inf)
        if gaps.min() < 2 * radius:
            i, j = sorted(np.unravel_index(int(gaps.argmin()), gaps.shape))
            found = f"positions[{i}] and positions[{j}] are {gaps.min():.3g} m apart"
            raise self._error(f"{found}, but at least {2 * radius:g} m, a robot's diameter, was wanted")
        return points


def _max_packed(room: BaseGeometry, spacing: float) -> int:
    """Return a number of robots that is never exceeded: no packing is denser than the hexagonal one."""
    return 1 + int(room.buffer(spacing / 2).area / (spacing**2 * math.sqrt(3) / 2))


def _densest(room: BaseGeometry, spacing: float) -> Array:
    """Return the most points that are found at least `spacing` apart, (k, 2); the same for the same room."""
    best, most = np.empty((0, 2)), _max_packed(room, spacing)
    for trial in range(_PACKING_TRIALS if most <= _FEW_ROBOTS else 1):
        rng = np.random.default_rng(trial)
        # in passages that are hardly wider than a robot darts are denser than lattices
        for points in (_hexagonal(rng, room, most, spacing), _darts(rng, room, most, spacing)):
            if len(points) > len(best):
                best = points
    return best


def _darts(rng: np.random.Generator, room: BaseGeometry, n: int, spacing: float) -> Array:
    """Return up to n random points that are at least `spacing` apart: darts, until hardly any is kept."""
    low_x, low_y, high_x, high_y = room.bounds
    kept = np.empty((0, 2))
    shapely.prepare(room)
    # a thin room misses most darts that are thrown at its bounding box
    share = max(room.area / ((high_x - low_x) * (high_y - low_y)), 1e-3)
    while len(kept) < n:
        count = max(64, int(4 * (n - len(kept)) / share))
        darts = rng.uniform((low_x, low_y), (high_x, high_y), size=(count, 2))
        darts = darts[shapely.contains_xy(room, darts[:, 0], darts[:, 1])]
        if len(kept):
            darts = darts[cKDTree(kept).query(darts)[0] >= spacing]
        fresh = _apart(darts, spacing)
        kept = np.concatenate([kept, fresh])
        if len(fresh) < count * share / 100:
            break
    return kept[:n]


def _apart(points: Array, spacing: float) -> Array:
    """Return the points, in their order, that are at least `spacing` from every one returned before."""
    keep = np.ones(len(points), dtype=bool)
    if len(points):
        pairs = cKDTree(points).query_pairs(spacing, output_type="ndarray")
        for i, k in pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].tolist():
            if keep[i]:
                keep[k] = False
    return points[keep]


def _hexagonal(rng: np.random.Generator, room: BaseGeometry, n: int, spacing: float) -> Array:
    """Return up to n points of the best of some randomly laid hexagonal lattices, denser than darts."""
    low_x, low_y, high_x, high_y = room.bounds
    reach = float(np.hypot(high_x - low_x, high_y - low_y)) / 2 + 2 * spacing
    steps = int(np.ceil(reach / (spacing * np.sqrt(3) / 2))) + 1
    if steps > 2000:
        return np.empty((0, 2))
    a, b = np.meshgrid(np.arange(-steps, steps + 1), np.arange(-steps, steps + 1))
    lattice = np.column_stack([(a + 0.5 * (b % 2)).ravel(), (b * np.sqrt(3) / 2).ravel()]) * spacing
    middle = np.array([(low_x + high_x) / 2, (low_y + high_y) / 2])
    best = np.empty((0, 2))
    shapely.prepare(room)
    for _ in range(20):
        angle = rng.uniform(0, np.pi / 3)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = lattice @ turn.T + middle + rng.uniform(-spacing, spacing, size=2)
        points = points[shapely.contains_xy(room, points[:, 0], points[:, 1])]
        if len(points) > len(best):
            best = points
        if len(best) >= n:
            return best[np.sort(rng.choice(len(best), size=n, replace=False))]
    return best


def compute_swept_area(polygon: Polygon, path: ObstaclePath) -> BaseGeometry:
    """Return all places that an obstacle comes by on its path, given its polygon at time zero."""
    points = np.array([*path.points, *path.points[: path.repeat == "loop"]], dtype=float)
    shifts = points - points[:1]
    return shapely.union_all([polygon, *(_along(polygon, a, b) for a, b in pairwise(shifts))])


def find_overlaps(
    area: BaseGeometry, others: Mapping[Any, BaseGeometry], inside: BaseGeometry | None = None
) -> tuple[dict[Any, BaseGeometry], BaseGeometry | None]:
    """Return what of an area the others take, by more than a touch, and what of it is not `inside`."""
    shared = {name: area.intersection(shape) for name, shape in others.items()}
    met = {name: part for name, part in shared.items() if part.area > _LEAST_OVERLAP}
    beyond = None if inside is None else area.difference(inside)
    return met, beyond if beyond is not None and beyond.area > _LEAST_OVERLAP else None


def _along(polygon: Polygon, begin: Array, end: Array) -> BaseGeometry:
    """Return the Minkowski sum of a polygon and a line: the polygon at both ends and what its edges sweep."""
    parts: list[BaseGeometry] = []
    for ring in (polygon.exterior, *polygon.interiors):
        at = shapely.get_coordinates(ring)
        quads = np.stack([at[:-1] + begin, at[1:] + begin, at[1:] + end, at[:-1] + end], axis=1)
        one, other = at[1:] - at[:-1], end - begin
        flat = np.abs(one[:, 0] * other[1] - one[:, 1] * other[0]) < 1e-12
        parts += shapely.polygons(quads[~flat]).tolist()
    ends = [shapely.transform(polygon, lambda at, by=by: at + by) for by in (begin, end)]
    return shapely.union_all([*parts, *ends])


def shift_obstacle(obstacle: Obstacle, by: Array) -> Obstacle:
    """Return an obstacle elsewhere, without a path."""
    dx, dy = by.tolist()

    def moved(points: Ring) -> Ring:
        return tuple((x + dx, y + dy) for x, y in points)

    if isinstance(obstacle, PolygonObstacle):
        holes = tuple(map(moved, obstacle.holes))
        return replace(obstacle, vertices=moved(obstacle.vertices), holes=holes, path=None)
    if isinstance(obstacle, WallObstacle):
        return replace(obstacle, points=moved(obstacle.points), path=None)
    return replace(obstacle, center=moved((obstacle.center,))[0], path=None)


def _united(shapes: NDArray[np.object_]) -> BaseGeometry:
    """Return shapes as one, on the grid; only those that meet are united, which takes most of the time."""
    meets = np.bincount(STRtree(shapes).query(shapes, "dwithin", 2.0 * GRID_M)[0]) > 1
    alone = shapely.get_parts(shapely.set_precision(shapes[~meets], GRID_M))
    return shapely.multipolygons(
        [*alone, *_polygons(shapely.union_all(shapes[meets], grid_size=GRID_M)).geoms]
    )


def _polygons(geometry: BaseGeometry) -> MultiPolygon:
    """Return the polygons of `geometry`, counter-clockwise, the largest first; lines and points go."""
    parts = [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon) and part.area > 0.0]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    return MultiPolygon([shapely.orient_polygons(part) for part in parts])


class Gap(NamedTuple):
    """A passage: the diameter of the largest disc that passes, m, and where the walls face each other, m."""

    width: float
    between: tuple[Point, Point]


def find_narrowest_gap(free: MultiPolygon) -> Gap | None:
    """Return the narrowest passage of `free`, counter-clockwise polygons, or None where there is none.

    A passage leads round an obstacle, or to a part of the free space that is neither smaller
    than `NEGLIGIBLE` nor smaller than the square over the gap: a niche that is shallower than
    wide is none, and nor is an acute corner.
    """
    search = _Search(free)
    largest = math.dist(search.free.bounds[:2], search.free.bounds[2:])
    best: Gap | None = None
    below, reach = _CRACK / 2, largest / 4096
    # most maps have a gap far narrower than the map is wide: look near first
    while best is None and below < largest:
        for corners in search.chunks():
            found = next(search.gaps(corners, below, reach if best is None else best.width), None)
            best = found or best
        below, reach = reach, 2 * reach
    return best


def find_narrow_gaps(free: MultiPolygon, width: float) -> tuple[Gap, ...]:
    """Return all passages of `free` that are narrower than a width in metres, the narrowest first.

    One may be found several times, as at all corners of a door.
    """
    search = _Search(free)
    found = {gap for corners in search.chunks() for gap in search.gaps(corners, _CRACK / 2, width)}
    return tuple(sorted(found, key=lambda gap: (gap.width, gap.between)))


class _Search:
    """The edges of a free space among which passages are looked for; it lies to the left of each.

    A disc of growing radius can reach the same places, in the same ways, until its diameter passes the width
    of a gap. There two wall points face each other, and the disc between them, with their segment as its
    diameter, holds no other. One of the two is a corner that juts into the free space.
    """

    def __init__(self, free: MultiPolygon) -> None:
        self.free = free = _without_cracks(free)
        self.boundary = free.boundary
        shapely.prepare(self.boundary)
        shapely.prepare(free)
        rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(shapely.get_parts(free))]
        sizes = np.array([len(ring) for ring in rings], dtype=np.intp)
        self.ring = np.repeat(np.arange(len(rings)), sizes)
        self.start = np.concatenate([np.empty((0, 2)), *rings])
        self.end = np.concatenate([np.empty((0, 2)), *(np.roll(ring, -1, axis=0) for ring in rings)])
        # the first edge of each one's ring and the one after the last, and the edge that ends where it starts
        self.last = np.cumsum(sizes)
        self.first = self.last - sizes
        self.before = np.arange(len(self.start)) - 1
        self.before[self.first] = self.last - 1
        # the edges whose start is a corner that juts into the free space
        turn = _cross(self.start - self.start[self.before], self.end - self.start)
        self.jutting = np.flatnonzero(turn < 0)
        # boxes: the index needs no more, and they are made in one call
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        self.tree = shapely.STRtree(shapely.box(*low.T, *high.T))

    def chunks(self) -> list[IntArray]:
        """Return the corners that jut into the free space, some at a time."""
        return np.array_split(self.jutting, math.ceil(len(self.jutting) / _CHUNK) or 1)

    def gaps(self, corners: IntArray, below: float, limit: float) -> Iterator[Gap]:
        """Yield the passages at some corners, wider than `below` and narrower than `limit`, by width."""
        at = self.start[corners]
        row, edge = self.tree.query(shapely.box(*(at - limit).T, *(at + limit).T))
        corner = corners[row]
        p = self.start[corner]
        along = self.end[edge] - self.start[edge]
        part = np.einsum("kd,kd->k", p - self.start[edge], along) / np.einsum("kd,kd->k", along, along)
        q = self.start[edge] + np.clip(part, 0.0, 1.0)[:, None] * along
        width = np.hypot(*(q - p).T)
        wanted = (width > below) & (width < limit)
        # the sides of the corner may not lean into the disc
        for side in (self.start[self.before[corner]], self.end[corner]):
            wanted &= np.einsum("kd,kd->k", side - p, q - p) <= 1e-9 * width * np.hypot(*(side - p).T)
        found = np.flatnonzero(wanted)
        order = found[np.argsort(width[found], kind="stable")]
        for some in np.array_split(order, max(1, len(order) // 512)):
            middle = shapely.points((p[some] + q[some]) / 2)
            # prepared, which `shapely.distance` would not be: of thousands of walls that makes a difference
            empty = ~shapely.dwithin(self.boundary, middle, width[some] / 2 * (1 - 1e-9) - 1e-12)
            empty[empty] = shapely.contains_properly(self.free, middle[empty])
            for k in some[empty].tolist():
                if self._leads_on(corner[k], edge[k], q[k], width[k]):
                    one, other = sorted(map(tuple, (np.round([p[k], q[k]], _DIGITS) + 0.0).tolist()))
                    yield Gap(round(float(width[k]), _DIGITS), (one, other))

    def _leads_on(self, corner: int, edge: int, q: Array, width: float) -> bool:
        """Return whether the gap from a corner to the point q of an edge leads to more than a pocket.

        A cut between two rings separates nothing; one from a ring to itself separates what the ring encloses.
        """
        ring = self.ring[corner]
        if ring != self.ring[edge]:
            return True
        points = np.roll(self.start[self.first[ring] : self.last[ring]], self.first[ring] - corner, axis=0)
        cut = (edge - corner) % len(points) + 1
        halves = np.vstack([points[:cut], q]), np.vstack([q, points[cut:], points[:1]])
        sides = np.array([_area(half) for half in halves])
        # outside a hole's ring there is no pocket: only the side of positive area is one
        pocket = sides.min(where=sides > 0, initial=np.inf)
        return bool(pocket >= max(MIN_POCKET_AREA_M2, width * width))


def _without_cracks(free: MultiPolygon) -> MultiPolygon:
    """Return `free` without the parts that are narrower than `_CRACK`.

    What touches there becomes one wall, and stays apart by a nanometre so that it does not touch in a point
    again. Corners of less than a degree are cut, vertices that bend a wall by less than a micrometre go.
    """
    for distance in (-_CRACK / 2, _CRACK / 2 - 1e-9):
        free = free.buffer(distance, join_style="mitre", mitre_limit=100.0)
    free = free.simplify(GRID_M)
    return MultiPolygon([shapely.orient_polygons(part) for part in shapely.get_parts(free)])


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _area(ring: Array) -> float:
    """Return the area of a ring, m², negative when clockwise."""
    points = ring - ring[0]
    return float(_cross(points[:-1], points[1:]).sum()) / 2


def require_environment(value: object) -> None:
    """Raise a ParameterError unless a value is a map."""
    require_type("environment", value, Environment, 'a map, as in load_map("rooms"),')
