"""The coverage cost of one set of positions, with the owner of every site and the path to it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robocov.arrays import Array, IntArray, compute_lengths
from robocov.cost.lattice import Sites
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.drawing import Drawable
from robocov.environment import Environment
from robocov.errors import format_count


@dataclass(frozen=True, eq=False)
class CoverageResult(Drawable):
    """The coverage cost (22) of n robots, evaluated at m sites.

    Attributes
    ----------
    mean_distance : float, m
        Mean geodesic distance from a site to its nearest robot, weighted by φ, over the components of the
        free space that contain robots; nan if these are too small to contain a site.
    value : float, m³
        Equation (22), with φ as in (4): `mean_distance` times the integral of φ over these components, which
        is their area if there is no density. With `speeds`, `mean_time` times that integral, in m² s.
    uncovered_area : float, m²
        Area of the components without a robot. Gaps that are narrower than a robot separate components.
    distances : (m,) array, m
        Distance to the owner; inf if there is none.
    owner : (m,) int array
        The nearest robot (the geodesic Voronoi partition), or with `speeds` the first one to arrive. Ties go
        to the lowest index. -1 if no robot can reach the site.
    first_corner, last_corner : (m,) int array
        Rows of `corners` where the path from the owner to the site bends first and last; -1 if it is
        straight.
    positions : (n, 2) array, m
        Positions of the robots.
    points : (m, 2) array, m
        The sites.
    corners : (k, 2) array, m
        All points where paths can bend.
    environment : Environment or None
        The map, for plots.
    sites : Sites or None
        The lattice, for plots.
    weights : (m,) array or None
        Mean of φ over the cell of each site, or None if all are equal.
    speeds : (n,) array or None, m/s
        If given, each site belongs to the robot that arrives first instead of the nearest one.
    mean_time : float or None, s
        With `speeds`, the mean time until the first robot arrives at a site.
    radius : float, m
        Radius of the smallest robot; no path leads through narrower gaps.

    See Also
    --------
    CoverageCost : Evaluates positions.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> room = rc.Environment("room", ((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)))
    >>> result = rc.CoverageCost(room, lattice=32)([[1.0, 1.0], [3.0, 1.0]])
    >>> result
    <CoverageResult 2 robots, mean distance 0.764 m>
    >>> np.bincount(result.owner)
    array([256, 256])
    """

    _drawing_name = "result"

    mean_distance: float
    value: float
    uncovered_area: float
    distances: Array
    owner: IntArray
    first_corner: IntArray
    last_corner: IntArray
    positions: Array
    points: Array
    corners: Array
    environment: Environment | None = None
    sites: Sites | None = None
    weights: Array | None = None
    speeds: Array | None = None
    mean_time: float | None = None
    radius: float = DEFAULT_RADIUS_M

    def __repr__(self) -> str:
        robots = format_count(len(self.positions), "robot")
        text = f"{robots}, mean distance {self.mean_distance:.3f} m"
        if self.mean_time is not None:
            text += f", mean time {self.mean_time:.3f} s"
        if self.uncovered_area:
            text += f", {self.uncovered_area:.3f} m² uncovered"
        return f"<CoverageResult {text}>"

    @cached_property
    def times(self) -> Array:
        """Time until the first robot arrives at each site, (m,) s; inf if none does.

        Without `speeds`, robots move at 1 m/s.
        """
        if self.speeds is None:
            return self.distances
        # The owner -1 of a site that no robot can reach selects the last speed. This does not matter, because
        # the distance is infinite.
        return np.asarray(self.distances / self.speeds[self.owner])

    @cached_property
    def first_waypoints(self) -> Array:
        """First waypoint from the owner to each site, (m, 2) m: a corner, or the site itself."""
        waypoints = self.points.copy()
        bent = np.flatnonzero(self.first_corner >= 0)
        waypoints[bent] = self.corners[self.first_corner[bent]]
        return waypoints

    @cached_property
    def gradient(self) -> Array:
        """Derivative of `value` with respect to the positions, (n, 2) m²; with `speeds` in m s.

        Each site pulls its owner toward its first waypoint, by a unit vector times the site's share of the
        integral of φ, divided by the owner's speed. The gradient is exact where `value` is differentiable and
        a small move changes neither owners nor corners.
        """
        count = len(self.positions)
        site = np.flatnonzero(self.owner >= 0)
        owner = self.owner[site]
        pull = self.first_waypoints[site] - self.positions[owner]
        length = compute_lengths(pull)
        pull /= np.where(length > 0.0, length, 1.0)[:, None]
        total_weight = float(len(site))
        if self.weights is not None:
            pull *= self.weights[site, None]
            total_weight = float(self.weights[site].sum())
        # The value is the mean times the integral of φ, which is divided among the sites by weight.
        mean = self.mean_distance if self.mean_time is None else self.mean_time
        mass_per_weight = 0.0
        if total_weight and mean:
            mass_per_weight = self.value / (mean * total_weight)
        pull_x = np.bincount(owner, pull[:, 0], minlength=count)
        pull_y = np.bincount(owner, pull[:, 1], minlength=count)
        gradient = np.column_stack([pull_x, pull_y]) * -mass_per_weight
        if self.speeds is not None:
            gradient = gradient / self.speeds[:, None]
        return np.asarray(gradient)
