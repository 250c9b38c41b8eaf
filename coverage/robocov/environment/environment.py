"""The environment: a map with its boundary, obstacles, starts and density."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import copy_read_only, to_tuples
from robocov.density import Density
from robocov.density.polygon_masses import compute_polygon_masses
from robocov.drawing import Drawable
from robocov.environment.closed_gaps import build_bars
from robocov.environment.obstacles import Obstacle, PolygonObstacle, shift_obstacle
from robocov.environment.polygons import (
    GRID_M,
    build_polygon,
    extract_polygons,
    require_valid_polygon,
    unite_shapes,
)
from robocov.environment.starts import Start, StartSpec, UniformStart
from robocov.errors import (
    ParameterError,
    StartError,
    describe_unknown_name,
    format_count,
    is_number,
    quote,
    require_number,
    require_type,
)
from robocov.observation.region import Region
from robocov.typing import FloatArray, Ring

_DISPLACEMENT_DECIMALS = 9
"""Displacements are rounded to the nanometer, so that an obstacle returns to exactly the same position."""
_MAX_RADIUS_M = 1e6
"""Maximum radius of a disc in `Environment.close_gaps`, which keeps widths finite."""
_GEOMETRY_PROPERTIES = ("region", "boundary_polygon", "free", "blocked")
"""Cached properties that do not depend on the density."""


@dataclass(frozen=True)
class Environment(Drawable):
    """A map: its boundary, its obstacles, where teams may start, and the density of its points.

    Environments are immutable, and equal if their contents are equal. Only the physics, the sensor and the
    evaluation know the obstacles. Controllers know `region`, the convex hull of the boundary, and what their
    robots sense.

    Attributes
    ----------
    name : str
        Title in figures and in the window.
    boundary : (k, 2) sequence, m
        Vertices of the outer boundary, clockwise or counter-clockwise, which may be convex or not.
    obstacles : tuple of Obstacle
        Solid shapes, which may overlap, touch and extend beyond the boundary. The positions of moving
        obstacles are those at time zero.
    starts : mapping of str to DiscStart, UniformStart or PointsStart
        Named starts; the first is the default.
    description : str
        One or more sentences about the map.
    extra : mapping
        Additional keys of the map file, kept unchanged.
    schema : str or None
        ``$schema`` of the map file, kept unchanged.
    density : Density or None
        The density φ weights the points of the map in the coverage cost. It is part of the task, and robots
        know it. If it is None, all points have equal weight.

    See Also
    --------
    load_map : Load a map by name or from a file.
    generate_map : Generate a random map.
    save_map : Write a map to a file.
    check_map : Measure a map and look for likely mistakes.

    Examples
    --------
    >>> import robocov as rc
    >>> square = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    >>> environment = rc.Environment("pillar", square, (rc.CircleObstacle((5.0, 5.0), radius=1.0),))
    >>> environment
    <Environment pillar, 10 x 10 m, 1 obstacle>
    >>> round(environment.free_area, 2)
    96.86
    """

    _drawing_name = "environment"

    name: str
    boundary: Ring
    obstacles: tuple[Obstacle, ...] = ()
    starts: Mapping[str, StartSpec] = field(default_factory=dict)
    description: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict)
    schema: str | None = None
    density: Density | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "boundary", to_tuples(self.boundary))
        object.__setattr__(self, "obstacles", to_tuples(self.obstacles))

    def __hash__(self) -> int:
        # The other attributes include mappings, which cannot be hashed.
        return hash((self.name, self.boundary, self.obstacles))

    def __repr__(self) -> str:
        width, height = np.ptp(np.asarray(self.boundary, dtype=float), axis=0).tolist()
        obstacles = format_count(len(self.obstacles), "obstacle")
        return f"<Environment {self.name}, {width:.4g} x {height:.4g} m, {obstacles}>"

    @cached_property
    def region(self) -> Region:
        """Convex hull of the boundary, which robots know."""
        return Region(np.asarray(self.boundary, dtype=float))

    @cached_property
    def boundary_polygon(self) -> Polygon:
        """Boundary as a counter-clockwise polygon.

        Raises
        ------
        MapError
            If it is not a list of at least three finite points, or crosses or touches itself.
        """
        location = f"map {self.name}: boundary"
        polygon = build_polygon(location, self.boundary)
        require_valid_polygon(location, polygon)
        return shapely.orient_polygons(polygon)

    @cached_property
    def free(self) -> MultiPolygon:
        """Components of the free space, inside the boundary and outside every obstacle, the largest first.

        Raises
        ------
        MapError
            If the boundary or an obstacle crosses or touches itself.
        """
        inside = shapely.set_precision(self.boundary_polygon, GRID_M)
        if self.obstacles:
            shapes = [obstacle.polygon for obstacle in self.obstacles]
            for number, shape in enumerate(shapes):
                require_valid_polygon(f"map {self.name}: obstacles[{number}]", shape)
            solid = unite_shapes(np.array(shapes))
            inside = shapely.difference(inside, solid, grid_size=GRID_M)
        return extract_polygons(inside)

    @cached_property
    def blocked(self) -> MultiPolygon:
        """Part of the region that is not free, including the outside of a non-convex boundary."""
        region = shapely.set_precision(self.region.polygon, GRID_M)
        return extract_polygons(shapely.difference(region, self.free, grid_size=GRID_M))

    @cached_property
    def has_moving_obstacles(self) -> bool:
        """Whether an obstacle moves."""
        return any(obstacle.path is not None for obstacle in self.obstacles)

    @cached_property
    def static(self) -> Environment:
        """Map without the moving obstacles; the same object if there are none."""
        if not self.has_moving_obstacles:
            return self
        fixed_obstacles = tuple(obstacle for obstacle in self.obstacles if obstacle.path is None)
        return replace(self, obstacles=fixed_obstacles)

    def at(self, time: float) -> Environment:
        """Return the map at a time, with obstacles that do not move.

        Parameters
        ----------
        time : float, s
            Time since the beginning of a run.

        Returns
        -------
        Environment
            The map with its obstacles at their positions at this time. It is the same object if no obstacle
            moves.

        Raises
        ------
        ParameterError
            If the time is not a finite number.
        """
        _check_time(time)
        if not self.has_moving_obstacles:
            return self
        obstacles = []
        for obstacle in self.obstacles:
            if obstacle.path is not None:
                displacement = np.round(obstacle.path.compute_displacement(time), _DISPLACEMENT_DECIMALS)
                obstacle = shift_obstacle(obstacle, displacement)
            obstacles.append(obstacle)
        return replace(self, obstacles=tuple(obstacles))

    def advance(self, time: float) -> Environment:
        """Return the map for a run that continues another run from a given time.

        Parameters
        ----------
        time : float, s
            Time since the beginning of the other run.

        Returns
        -------
        Environment
            The map with time zero of its moving obstacles shifted to the given time. It is the same object if
            no obstacle moves.

        Raises
        ------
        ParameterError
            If the time is not a finite number.
        """
        _check_time(time)
        if time == 0.0 or not self.has_moving_obstacles:
            return self
        obstacles = []
        for obstacle in self.obstacles:
            path = obstacle.path
            if path is not None:
                shifted = shift_obstacle(obstacle, path.compute_displacement(time))
                obstacle = replace(shifted, path=path.advance(time))
            obstacles.append(obstacle)
        return replace(self, obstacles=tuple(obstacles))

    @property
    def area(self) -> float:
        """Area inside the boundary, m²."""
        return float(self.boundary_polygon.area)

    @property
    def free_area(self) -> float:
        """Area of the free space, m²."""
        return float(self.free.area)

    @cached_property
    def free_masses(self) -> FloatArray:
        """Integral of φ over each component of the free space, m². It is the area if there is no density."""
        components = self.free.geoms
        if self.density is None:
            return copy_read_only([component.area for component in components])
        if self.density.is_uniform:
            return copy_read_only([component.area * self.density.upper_bound for component in components])
        return copy_read_only(compute_polygon_masses(self.density, list(components)))

    def with_density(self, density: Density | None) -> Environment:
        """Return the same map with another density, without computing its geometry again.

        Parameters
        ----------
        density : Density or None
            The new density. If it is None, all points have equal weight.

        Returns
        -------
        Environment
            The map with this density.
        """
        environment = replace(self, density=density)
        # A cached property stores its value in the dictionary of the object, from which it is copied here.
        for name in _GEOMETRY_PROPERTIES:
            if name in vars(self):
                vars(environment)[name] = vars(self)[name]
        return environment

    def close_gaps(self, radius: float) -> Environment:
        """Close the gaps through which a disc does not fit.

        Two points in wide parts of the free space are connected in the result if and only if a disc of this
        radius can move from one to the other. Niches and acute corners that are too narrow for the disc stay
        open. For gaps next to moving obstacles, the positions at time zero count. Call `at` first for other
        times.

        Parameters
        ----------
        radius : float, m
            Radius of the disc. With 0, all gaps stay open.

        Returns
        -------
        Environment
            The map with a thin obstacle across each closed gap, and without moving obstacles. It is the same
            object if there is no gap to close.

        Raises
        ------
        ParameterError
            If the radius is not a finite number of at least 0.

        See Also
        --------
        CoverageCost : Does not count paths through these gaps.

        Notes
        -----
        The obstacle across a gap is a triangle of 3 µm height where the gap is narrowest. Gaps that are
        narrower than the disc by less than 2 µm stay open.

        Examples
        --------
        >>> import robocov as rc
        >>> hall = ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
        >>> wall = rc.WallObstacle(((5.0, 0.1), (5.0, 6.0)), width=0.2)
        >>> cracked = rc.Environment("cracked", hall, (wall,))
        >>> [len(cracked.close_gaps(radius).free.geoms) for radius in (0.0, 0.04, 0.1)]
        [1, 1, 2]
        """
        require_number("radius", radius, 0.0, _MAX_RADIUS_M, "m")
        bars = build_bars(self.free, radius)
        if not bars:
            return self
        obstacles = [replace(obstacle, path=None) for obstacle in self.obstacles]
        for bar in bars:
            vertices = tuple((x, y) for x, y in shapely.get_coordinates(bar.exterior)[:-1].tolist())
            obstacles.append(PolygonObstacle(vertices, name="closed gap"))
        return replace(self, obstacles=tuple(obstacles))

    def has_same_geometry(self, other: Environment) -> bool:
        """Return whether another map has the same boundary and obstacles.

        Parameters
        ----------
        other : Environment
            The map to compare with.

        Returns
        -------
        bool
            Whether they are equal. Other attributes may differ.
        """
        return self.boundary == other.boundary and self.obstacles == other.obstacles

    def start(self, name: str | None = None) -> Start:
        """Return a start of the map.

        Every map has the start ``uniform`` (anywhere in the free space), even if its file does not define it.

        Parameters
        ----------
        name : str or None
            Name of the start; by default, the first start of the map.

        Returns
        -------
        Start
            The start, from which positions are sampled.

        Raises
        ------
        StartError
            If there is no start with this name.
        """
        starts = dict(self.starts)
        starts.setdefault("uniform", UniformStart())
        if name is None:
            name = next(iter(starts))
        if not isinstance(name, str) or name not in starts:
            raise StartError(f"map {self.name!r}: {describe_unknown_name('start', str(name), starts)}")
        return Start(name, starts[name], self.free)


def _check_time(time: float) -> None:
    """Check that a time is a finite number."""
    if not is_number(time) or not math.isfinite(time):
        raise ParameterError(f"time: expected a finite number, got {quote(time)}")


def require_environment(value: object) -> None:
    """Raise an error unless a value is a map.

    Parameters
    ----------
    value : object
        Argument of a function that expects a map.

    Raises
    ------
    ParameterError
        If the value is not an `Environment`.
    """
    require_type("environment", value, Environment, 'a map, as in load_map("rooms")')
