"""The environment: outer boundary, obstacles, named starts, and the geometry derived from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, frozen
from robocov.density import Density
from robocov.density.base import masses_of_polygons
from robocov.drawing import Drawable
from robocov.environment.obstacle_path import ObstaclePath
from robocov.environment.starts import Start, StartSpec, UniformStart
from robocov.errors import StartError, counted, unknown_name
from robocov.observation.region import Region

Point: TypeAlias = tuple[float, float]
Ring: TypeAlias = tuple[Point, ...]

GRID = 1e-6
"""Derived geometry is computed on a grid of one micrometre, so that unions and differences are
robust: what touches to within rounding touches exactly, and no sliver survives."""

SAGITTA = 1e-3
"""Largest distance in metres between a circle and the polygon that stands for it."""


@dataclass(frozen=True)
class PolygonObstacle:
    """A solid polygon, with holes where given (a courtyard)."""

    vertices: Ring
    holes: tuple[Ring, ...] = ()
    name: str | None = None
    path: ObstaclePath | None = None

    @cached_property
    def polygon(self) -> Polygon:
        """The obstacle as a shapely polygon."""
        return Polygon(self.vertices, self.holes)

    def shifted(self, by: Array) -> PolygonObstacle:
        """Return the obstacle elsewhere, without a path."""
        holes = tuple(_moved(hole, by) for hole in self.holes)
        return replace(self, vertices=_moved(self.vertices, by), holes=holes, path=None)


@dataclass(frozen=True)
class CircleObstacle:
    """A round pillar: the inscribed regular polygon of at most `SAGITTA` for physics and cost alike."""

    center: Point
    radius: float
    name: str | None = None
    path: ObstaclePath | None = None

    @cached_property
    def polygon(self) -> Polygon:
        """The obstacle as a shapely polygon."""
        sides = 12
        if self.radius > SAGITTA:
            sides = max(sides, math.ceil(math.pi / math.acos(1.0 - SAGITTA / self.radius)))
        angle = np.arange(sides) * (2.0 * np.pi / sides)
        return Polygon(np.column_stack([np.cos(angle), np.sin(angle)]) * self.radius + self.center)

    def shifted(self, by: Array) -> CircleObstacle:
        """Return the obstacle elsewhere, without a path."""
        return replace(self, center=_moved((self.center,), by)[0], path=None)


@dataclass(frozen=True)
class WallObstacle:
    """A poly-line of some width, with flat ends at its first and last point and mitred corners."""

    points: Ring
    width: float
    name: str | None = None
    path: ObstaclePath | None = None

    @cached_property
    def polygon(self) -> BaseGeometry:
        """The obstacle as a shapely polygon (or polygons, where the line doubles back)."""
        line = LineString(self.points)
        return line.buffer(self.width / 2, cap_style="flat", join_style="mitre", mitre_limit=4.0)

    def shifted(self, by: Array) -> WallObstacle:
        """Return the obstacle elsewhere, without a path."""
        return replace(self, points=_moved(self.points, by), path=None)


Obstacle: TypeAlias = PolygonObstacle | CircleObstacle | WallObstacle


@dataclass(frozen=True)
class Environment(Drawable):
    """A map: what is there, and where a team may start. Immutable; equal when the content is equal.

    Only the physics, the sensor and the evaluation know the obstacles. A controller gets
    `region`, the convex hull of the boundary, and what its robots sense.

    Attributes
    ----------
    name, description : str
    boundary : ring of [x, y], m
        The outer boundary as it was given: either way round, convex or not.
    obstacles : tuple of obstacles
        They may overlap, touch and stick out of the boundary. One with a `path` moves; here it is where it
        is at time zero.
    starts : dict of name to start
        The first is the default.
    extra : dict
        Free keys of the file, kept untouched.
    schema : str or None
        The file's ``$schema``, kept untouched.
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
        obstacles = counted(len(self.obstacles), "obstacle")
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
        """The free space: inside the boundary, outside every obstacle; one polygon a component.

        Components are ordered by area, the largest first.
        """
        inside = shapely.set_precision(self.boundary_polygon, GRID)
        if self.obstacles:
            solid = _united(np.array([shape.polygon for shape in self.obstacles]))
            inside = shapely.difference(inside, solid, grid_size=GRID)
        return _polygons(inside)

    @cached_property
    def blocked(self) -> MultiPolygon:
        """The part of the region that is not free: obstacles, and the outside of a non-convex boundary."""
        region = shapely.set_precision(self.region.polygon, GRID)
        return _polygons(shapely.difference(region, self.free, grid_size=GRID))

    @cached_property
    def moves(self) -> bool:
        """Whether an obstacle moves."""
        return any(shape.path is not None for shape in self.obstacles)

    @cached_property
    def static(self) -> Environment:
        """The map without the obstacles that move; this one where none does."""
        still = tuple(shape for shape in self.obstacles if shape.path is None)
        return replace(self, obstacles=still) if self.moves else self

    def at(self, time: float) -> Environment:
        """Return the map as it is at a time, s, with all obstacles standing; this one where none moves."""
        if not self.moves:
            return self
        obstacles = tuple(
            # to the nanometre, so that an obstacle that comes by again stands in the very same place
            shape if shape.path is None else shape.shifted(np.round(shape.path.shift(time), 9))
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
        if self.density is None or self.density.uniform:
            weight = 1.0 if self.density is None else self.density.highest
            return frozen([part.area * weight for part in parts])
        return frozen(masses_of_polygons(self.density, list(parts)))

    def with_density(self, density: Density | None) -> Environment:
        """Return the same map with another density; what is derived from its geometry is kept."""
        twin = replace(self, density=density)
        kept = ("region", "boundary_polygon", "free", "blocked")
        twin.__dict__.update({name: self.__dict__[name] for name in kept if name in self.__dict__})
        return twin

    def same_place(self, other: Environment) -> bool:
        """Return whether another map has the same boundary and obstacles."""
        return self.boundary == other.boundary and self.obstacles == other.obstacles

    def start(self, name: str | None = None) -> Start:
        """Return the start called `name`, by default the map's first.

        Every map has a start ``uniform``, anywhere in the free space, whether the file names it
        or not; it is the default of a map without starts.

        Raises
        ------
        StartError
            When there is none of that name; the message names the nearest.
        """
        starts = {**self.starts}
        starts.setdefault("uniform", UniformStart())
        if name is None:
            name = next(iter(starts))
        if name not in starts:
            raise StartError(f"map {self.name!r}: {unknown_name('start', name, starts)}")
        return Start(name, starts[name], self.free)


def _moved(points: Ring, by: Array) -> Ring:
    dx, dy = by.tolist()
    return tuple((x + dx, y + dy) for x, y in points)


def _united(shapes: NDArray[np.object_]) -> BaseGeometry:
    """Return shapes as one, on the grid; only those that meet are united, which takes most of the time."""
    meets = np.bincount(STRtree(shapes).query(shapes, "dwithin", 2.0 * GRID)[0]) > 1
    alone = shapely.get_parts(shapely.set_precision(shapes[~meets], GRID))
    return shapely.multipolygons([*alone, *_polygons(shapely.union_all(shapes[meets], grid_size=GRID)).geoms])


def _polygons(geometry: BaseGeometry) -> MultiPolygon:
    """Return the polygons of `geometry`, counter-clockwise, the largest first; lines and points go."""
    parts = [part for part in shapely.get_parts(geometry) if isinstance(part, Polygon) and part.area > 0.0]
    parts.sort(key=lambda part: (-part.area, part.bounds))
    return MultiPolygon([shapely.orient_polygons(part) for part in parts])
