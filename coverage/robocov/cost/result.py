"""The coverage cost of one set of positions, with the owner of every site and the path to it.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robocov.arrays import compute_lengths
from robocov.cost.lattice import Sites
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.drawing import Drawable
from robocov.environment import Environment
from robocov.errors import format_count
from robocov.typing import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class CoverageResult(Drawable):
    """The coverage cost (22) of n robots, evaluated at m sites.

    The owner of a site is the robot that is nearest to it or, with `speeds`, the robot that arrives first.

    Attributes
    ----------
    mean_distance : float, m
        Mean geodesic distance from a site to its owner, weighted by φ, over the components of the free space
        that contain robots; nan if these are too small to contain a site.
    value : float, m³
        Equation (22), with φ as in (4): `mean_distance` times the integral of φ over these components, which
        is their area if there is no density. With `speeds`, `mean_time` times that integral, in m² s.
    uncovered_area : float, m²
        Area of the components without a robot. Gaps that are narrower than a robot separate components.
    distances : (m,) array, m
        Distance from each site to its owner; inf if it has none.
    owners : (m,) int array
        The owner of each site, as the index of a robot; -1 if no robot can reach the site. Of several robots
        at the same distance, the one with the lowest index is the owner. Without `speeds`, this is the
        geodesic Voronoi partition.
    first_corners, last_corners : (m,) int array
        The first and the last corner at which the path from the owner to each site bends, as rows of
        `corners`; -1 if the path is straight.
    positions : (n, 2) array, m
        Positions of the robots.
    points : (m, 2) array, m
        Positions of the sites.
    corners : (k, 2) array, m
        All points where paths can bend.
    environment : Environment or None
        The map, for plots.
    sites : Sites or None
        The lattice, for plots.
    weights : (m,) array or None
        Mean of φ over the cell of each site, or None if all are equal.
    speeds : (n,) array or None, m/s
        Speed of each robot, if the cost is based on travel times.
    mean_time : float or None, s
        With `speeds`, the mean time until the first robot arrives at a site.
    radius : float, m
        Radius of the smallest robot. No path leads through a gap that is narrower than this robot.

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
    >>> np.bincount(result.owners)
    array([256, 256])
    """

    _drawing_name = "result"

    mean_distance: float
    value: float
    uncovered_area: float
    distances: FloatArray
    owners: IntArray
    first_corners: IntArray
    last_corners: IntArray
    positions: FloatArray
    points: FloatArray
    corners: FloatArray
    environment: Environment | None = None
    sites: Sites | None = None
    weights: FloatArray | None = None
    speeds: FloatArray | None = None
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
    def times(self) -> FloatArray:
        """Time until the first robot arrives at each site, (m,) in seconds; inf if none does.

        Without `speeds`, robots move at 1 m/s.
        """
        if self.speeds is None:
            return self.distances
        # For a site without an owner, the index -1 selects the speed of the last robot. This does not matter,
        # because the distance is infinite.
        return np.asarray(self.distances / self.speeds[self.owners])

    @cached_property
    def first_waypoints(self) -> FloatArray:
        """First corner on the path from the owner to each site, or else the site itself, (m, 2) in meters."""
        waypoints = self.points.copy()
        is_bent = self.first_corners >= 0
        waypoints[is_bent] = self.corners[self.first_corners[is_bent]]
        return waypoints

    @cached_property
    def gradient(self) -> FloatArray:
        """Derivative of `value` with respect to the positions, (n, 2) m²; with `speeds` in m s.

        If a robot moves toward the first waypoint of a site, the path to the site gets shorter by the same
        distance. The derivative for a robot is therefore minus the sum, over its sites, of the unit vectors
        toward their first waypoints, each times the site's share of the integral of φ. With `speeds`, it is
        divided by the speed of the robot. The gradient is exact where `value` is differentiable and a small
        move changes neither owners nor corners.
        """
        robot_count = len(self.positions)
        sites = np.flatnonzero(self.owners >= 0)
        owners = self.owners[sites]
        pulls = self.first_waypoints[sites] - self.positions[owners]
        lengths = compute_lengths(pulls)
        pulls /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
        total_weight = float(len(sites))
        if self.weights is not None:
            pulls *= self.weights[sites, None]
            total_weight = float(self.weights[sites].sum())
        # The value is the mean times the integral of φ, of which each site has a share in proportion to its
        # weight.
        mean = self.mean_distance if self.mean_time is None else self.mean_time
        mass_per_weight = 0.0
        if total_weight and mean:
            mass_per_weight = self.value / (mean * total_weight)
        total_pull_x = np.bincount(owners, pulls[:, 0], minlength=robot_count)
        total_pull_y = np.bincount(owners, pulls[:, 1], minlength=robot_count)
        gradient = np.column_stack([total_pull_x, total_pull_y]) * -mass_per_weight
        if self.speeds is not None:
            gradient = gradient / self.speeds[:, None]
        return np.asarray(gradient)
