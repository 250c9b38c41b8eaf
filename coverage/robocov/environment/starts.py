"""Starts: where the robots of a team are at the beginning of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import compute_lengths, to_tuples
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment.packing import (
    bound_point_count,
    choose_points,
    estimate_point_count,
    pack_densely,
    pack_lattice,
    pack_randomly,
)
from robocov.errors import StartError, format_count, format_position, require_whole_number
from robocov.team import PARAMETERS as TEAM_PARAMETERS
from robocov.typing import FloatArray, Point

MIN_START_GAP_RADII = 0.02
"""Half of the minimum gap between two robots at the start, and the minimum gap between robots and walls, as a
multiple of the radius of a robot."""
MAX_COUNTED_ROBOTS = 2000
"""Maximum capacity of a start that is determined by packing. Larger capacities are estimated from the
area."""
_DISC_QUADRANT_SEGMENTS = 64
"""Edges per quadrant of the polygon that represents the disc of a start."""


@dataclass(frozen=True)
class DiscStart:
    """The robots start at random positions in a disc, as if they had been unloaded there.

    Attributes
    ----------
    center : (2,) sequence, m
        Center of the disc.
    radius : float, m
        Radius of the disc, which contains the centers of the robots.

    See Also
    --------
    UniformStart : Anywhere in the free space.
    PointsStart : Given positions.
    Environment.start : A named start, from which positions are sampled.

    Examples
    --------
    >>> import robocov as rc
    >>> square = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    >>> hall = rc.Environment("hall", square, starts={"door": rc.DiscStart((1.0, 1.0), radius=0.8)})
    >>> hall.start("door").sample(4, seed=0).shape
    (4, 2)
    """

    center: Point
    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", to_tuples(self.center))


@dataclass(frozen=True)
class UniformStart:
    """The robots start anywhere in the free space.

    See Also
    --------
    DiscStart : Somewhere in a disc.
    PointsStart : Given positions.

    Examples
    --------
    >>> import robocov as rc
    >>> square = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    >>> hall = rc.Environment("hall", square, starts={"anywhere": rc.UniformStart()})
    >>> hall.start().sample(4, seed=0).shape
    (4, 2)
    """


@dataclass(frozen=True)
class PointsStart:
    """The robots start at given positions, one robot at each.

    Attributes
    ----------
    positions : (k, 2) sequence, m
        Position of each robot. A team of n robots uses the first n.

    See Also
    --------
    DiscStart : Somewhere in a disc.
    UniformStart : Anywhere in the free space.

    Examples
    --------
    >>> import robocov as rc
    >>> square = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
    >>> hall = rc.Environment("hall", square, starts={"here": rc.PointsStart(((1, 1), (2, 1), (3, 1)))})
    >>> hall.start("here").sample(2)
    array([[1., 1.],
           [2., 1.]])
    """

    positions: tuple[Point, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", to_tuples(self.positions))


StartSpec: TypeAlias = DiscStart | UniformStart | PointsStart
"""Description of any kind of start."""


@dataclass(frozen=True, eq=False)
class Start:
    """A named start of one environment, from which positions are sampled.

    Positions depend only on the start, the number of robots, their radius and the seed, so every controller
    gets the same positions for the same seed.

    Attributes
    ----------
    name : str
        Name of the start in the environment.
    spec : DiscStart, UniformStart or PointsStart
        Where robots may start.
    free : geometry, m
        Free space of the environment.

    See Also
    --------
    Environment.start : Return a start of an environment by its name.
    """

    name: str
    spec: StartSpec
    free: BaseGeometry

    def sample(self, n: int, seed: int = 0, radius: float = DEFAULT_RADIUS_M) -> FloatArray:
        """Sample positions at which the robots touch neither walls nor each other.

        Parameters
        ----------
        n : int
            Number of robots.
        seed : int
            Seed of the random numbers. Ignored if the start is a `PointsStart`.
        radius : float, m
            Radius of the robots.

        Returns
        -------
        (n, 2) array, m
            Positions of the robots.

        Raises
        ------
        StartError
            If the robots do not fit, or a parameter is out of range.

        Examples
        --------
        >>> square = shapely.box(0.0, 0.0, 10.0, 10.0)
        >>> Start("corner", DiscStart((1.0, 1.0), 0.8), square).sample(6, seed=3).shape
        (6, 2)
        """
        require_whole_number(f"start {self.name!r}: robots", n, 1, StartError)
        require_whole_number(f"start {self.name!r}: seed", seed, 0, StartError)
        self._require_radius(radius)
        if isinstance(self.spec, PointsStart):
            return self._take_given_positions(n, radius, self.spec.positions)
        area = self.compute_center_area(radius)
        if area.is_empty:
            suggestion = (
                "a wider start" if isinstance(self.spec, DiscStart) else "a smaller robot or another map"
            )
            raise self._build_error(f"no space for a robot of radius {radius:g} m. Try {suggestion}.")
        points = _sample_apart(np.random.default_rng([seed, n]), area, n, compute_start_spacing(radius))
        if len(points) < n:
            raise self._build_error(self._describe_lack_of_space(n, radius))
        return points

    def estimate_capacity(self, radius: float = DEFAULT_RADIUS_M) -> int:
        """Estimate how many robots of a given radius fit.

        The result is the number of robots in the densest packing that is found, with the same gaps as in
        `sample`. Up to this number, `sample` finds positions with any seed; with some seeds, it may find
        positions for one or two more. If there is space for thousands of robots, the result is estimated from
        the area. For a `PointsStart`, it is the number of its positions.

        Parameters
        ----------
        radius : float, m
            Radius of the robots.

        Returns
        -------
        int
            0 if not even one robot fits.

        Raises
        ------
        StartError
            If the radius is out of range.
        """
        self._require_radius(radius)
        if isinstance(self.spec, PointsStart):
            return len(self.spec.positions)
        area = self.compute_center_area(radius)
        if area.is_empty:
            return 0
        spacing = compute_start_spacing(radius)
        if bound_point_count(area, spacing) > MAX_COUNTED_ROBOTS:
            return estimate_point_count(area, spacing)
        return len(pack_densely(area, spacing))

    def compute_center_area(self, radius: float) -> BaseGeometry:
        """Compute the area in which the center of a robot may be at the start. Not for a `PointsStart`.

        Parameters
        ----------
        radius : float, m
            Radius of the robot.

        Returns
        -------
        geometry, m
            Empty if there is no space for a robot.
        """
        area = self.free.buffer(-compute_start_clearance(radius))
        if isinstance(self.spec, DiscStart):
            # The disc contains the centers of the robots. Robots may extend beyond it by their radius.
            center = shapely.Point(self.spec.center)
            area = area.intersection(center.buffer(self.spec.radius, quad_segs=_DISC_QUADRANT_SEGMENTS))
        # A disc that only touches the area gives a point or a line, in which no position can be sampled.
        return area if area.area > 0.0 else shapely.Polygon()

    def _require_radius(self, radius: object) -> None:
        TEAM_PARAMETERS["radius"].require(f"start {self.name!r}: radius", radius, StartError)

    def _describe_lack_of_space(self, n: int, radius: float) -> str:
        capacity = self.estimate_capacity(radius)
        suggestions = ["fewer or smaller robots"]
        if not isinstance(self.spec, UniformStart):
            capacity_everywhere = Start("uniform", UniformStart(), self.free).estimate_capacity(radius)
            suggestions.append(f"start 'uniform' (space for about {capacity_everywhere})")
        return (
            f"space for about {format_count(capacity, 'robot')} of radius {radius:g} m, "
            f"but {n} were requested. Try {', '.join(suggestions)} or another map."
        )

    def _take_given_positions(self, n: int, radius: float, positions: Sequence[Point]) -> FloatArray:
        if n > len(positions):
            raise self._build_error(
                f"expected at most {format_count(len(positions), 'robot')}, one for each of its positions, "
                f"got {n}. Try fewer robots or another start."
            )
        points = np.array(positions[:n], dtype=float)
        self._require_free(points, radius)
        self._require_apart(points, radius)
        return points

    def _require_free(self, points: FloatArray, radius: float) -> None:
        distances = shapely.distance(shapely.points(points), self.free.boundary)
        is_inside = shapely.contains_properly(self.free, shapely.points(points))
        for k in np.flatnonzero(~is_inside | (distances < radius)).tolist():
            location = f"positions[{k}] = {format_position(points[k, 0], points[k, 1])}"
            if not is_inside[k]:
                raise self._build_error(f"{location} is inside an obstacle or outside the boundary")
            raise self._build_error(
                f"{location} is {distances[k]:.3g} m from a wall, "
                f"expected at least the radius of the robot, {radius:g} m"
            )

    def _require_apart(self, points: FloatArray, radius: float) -> None:
        offsets = points[:, None] - points[None]
        distances = compute_lengths(offsets)
        np.fill_diagonal(distances, np.inf)
        if distances.min() < 2 * radius:
            first, second = sorted(np.unravel_index(int(distances.argmin()), distances.shape))
            raise self._build_error(
                f"positions[{first}] and positions[{second}] are {distances.min():.3g} m apart, "
                f"expected at least the diameter of a robot, {2 * radius:g} m"
            )

    def _build_error(self, message: str) -> StartError:
        return StartError(f"start {self.name!r}: {message}")


def compute_start_clearance(radius: float) -> float:
    """Compute the minimum distance between the center of a robot and walls at the start.

    Parameters
    ----------
    radius : float, m
        Radius of the robot.

    Returns
    -------
    float, m
        Slightly more than the radius.
    """
    return radius * (1.0 + MIN_START_GAP_RADII)


def compute_start_spacing(radius: float) -> float:
    """Compute the minimum distance between the centers of two robots at the start.

    Parameters
    ----------
    radius : float, m
        Radius of the robots.

    Returns
    -------
    float, m
        Slightly more than the diameter.
    """
    return 2.0 * radius * (1.0 + MIN_START_GAP_RADII)


def _sample_apart(rng: np.random.Generator, area: BaseGeometry, n: int, spacing: float) -> FloatArray:
    """Return n random points that are at least `spacing` apart, or fewer if no more are found.

    Three methods are tried in turn: a random packing, a random lattice, and the dense packing that
    `Start.estimate_capacity` counts. Each usually finds more points than the one before, but
    they are less random.
    """
    if n > bound_point_count(area, spacing):
        return np.empty((0, 2))
    points = pack_randomly(rng, area, n, spacing)
    if len(points) < n:
        points = pack_lattice(rng, area, n, spacing)
    if len(points) < n <= MAX_COUNTED_ROBOTS:
        packed = pack_densely(area, spacing)
        if len(packed) >= n:
            points = choose_points(rng, packed, n)
    return points
