"""The coverage cost (22) of a map whose obstacles move.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import shapely

from robocov.cost.coverage_cost import CoverageCost
from robocov.cost.result import CoverageResult
from robocov.cost.site_paths import NO_ROBOT
from robocov.typing import BoolArray, FloatArray

_MAX_CACHED_MAPS = 64
"""Maximum number of maps whose costs are cached. Maps recur if obstacles move periodically."""


class CostSummary(NamedTuple):
    """The main results of a coverage cost; see `CoverageResult`.

    Attributes
    ----------
    mean_distance : float, m
        Mean geodesic distance from a site to its owner; nan if no robot is available.
    value : float, m³
        The coverage cost (22); nan if no robot is available.
    uncovered_area : float, m²
        Area that no robot can reach; all of the free space if no robot is available.
    """

    mean_distance: float
    value: float
    uncovered_area: float


class TimeVaryingCost:
    """The coverage cost (22) of the available robots at any time.

    A robot is available if it works and is not covered by a moving obstacle. A robot that has failed cannot
    go anywhere. Nor can a robot that a moving obstacle has run over, until the obstacle has moved on.

    Parameters
    ----------
    cost : CoverageCost
        The cost of the map at time zero.
    progress : callable, optional
        Called with the completed fraction while the cost of the map at another time is prepared; see
        `CoverageCost`.

    See Also
    --------
    CoverageCost : The cost of a map whose obstacles do not move.
    ObstaclePath : Makes an obstacle move.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> square = rc.Environment("square", ((0, 0), (1, 0), (1, 1), (0, 1)))
    >>> cost = rc.TimeVaryingCost(rc.CoverageCost(square, 16))
    >>> positions = np.array([[0.5, 0.5], [0.25, 0.25]])
    >>> result = cost(2.0, positions, is_working=np.array([True, False]))
    >>> len(result.positions)
    1
    """

    def __init__(self, cost: CoverageCost, progress: Callable[[float], None] | None = None) -> None:
        self._cost = cost
        self._progress = progress
        self._cost_by_map: dict[bytes, CoverageCost] = {}

    def get_cost(self, time: float) -> CoverageCost:
        """Return the coverage cost of the map at a given time.

        Parameters
        ----------
        time : float, s
            Simulation time.

        Returns
        -------
        CoverageCost
            If no obstacle moves, the one that was passed to the constructor.
        """
        environment = self._cost.environment
        if not environment.has_moving_obstacles:
            return self._cost
        current = environment.at(time)
        # Maps with the same free space have the same cost, wherever their obstacles are.
        key = current.free.wkb
        if key not in self._cost_by_map:
            if len(self._cost_by_map) >= _MAX_CACHED_MAPS:
                oldest = next(iter(self._cost_by_map))
                del self._cost_by_map[oldest]
            self._cost_by_map[key] = CoverageCost(
                current, self._cost.lattice, radius=self._cost.radius, progress=self._progress
            )
        return self._cost_by_map[key]

    def find_available_robots(
        self, time: float, positions: FloatArray, is_working: BoolArray | None = None
    ) -> BoolArray:
        """Find the available robots, which work and are not covered by a moving obstacle.

        Parameters
        ----------
        time : float, s
            Simulation time.
        positions : (n, 2) array, m
            Positions of the robots.
        is_working : (n,) bool array, optional
            False for robots that have failed. By default, all robots work.

        Returns
        -------
        (n,) bool array
            Whether each robot is available.
        """
        is_available = np.ones(len(positions), dtype=bool) if is_working is None else is_working.copy()
        if self._cost.environment.has_moving_obstacles:
            free = self.get_cost(time).environment.free
            is_available &= shapely.contains_properly(free, shapely.points(positions))
        return is_available

    def __call__(
        self,
        time: float,
        positions: FloatArray,
        is_working: BoolArray | None = None,
        speeds: FloatArray | None = None,
    ) -> CoverageResult | None:
        """Compute the coverage cost of the available robots at a given time.

        Parameters
        ----------
        time : float, s
            Simulation time.
        positions : (n, 2) array, m
            Positions of all robots.
        is_working : (n,) bool array, optional
            False for robots that have failed. By default, all robots work.
        speeds : (n,) array, m/s, optional
            Speeds of all robots, if the cost is to be based on travel times; see `CoverageCost`.

        Returns
        -------
        CoverageResult or None
            It contains only the available robots. None if no robot is available.
        """
        is_available = self.find_available_robots(time, positions, is_working)
        if not is_available.any():
            return None
        available_speeds = None if speeds is None else speeds[is_available]
        return self.get_cost(time)(positions[is_available], available_speeds)

    def evaluate_all_robots(
        self, time: float, positions: FloatArray, is_working: BoolArray | None = None
    ) -> CoverageResult | None:
        """Compute the coverage cost of the available robots, with a result that contains all robots.

        Parameters
        ----------
        time : float, s
            Simulation time.
        positions : (n, 2) array, m
            Positions of all robots.
        is_working : (n,) bool array, optional
            False for robots that have failed. By default, all robots work.

        Returns
        -------
        CoverageResult or None
            It contains all robots, so that they have their usual indices, but those that are not available
            own no sites. None if no robot is available.
        """
        result = self(time, positions, is_working)
        if result is None or len(result.positions) == len(positions):
            return result
        available = np.flatnonzero(self.find_available_robots(time, positions, is_working))
        owners = np.where(result.owners != NO_ROBOT, available[result.owners], NO_ROBOT)
        return replace(result, positions=np.array(positions), owners=owners)

    def compute_summary(
        self, time: float, positions: FloatArray, is_working: BoolArray | None = None
    ) -> CostSummary:
        """Compute the mean distance, the coverage cost (22) and the uncovered area at a given time.

        Parameters
        ----------
        time : float, s
            Simulation time.
        positions : (n, 2) array, m
            Positions of the robots.
        is_working : (n,) bool array, optional
            False for robots that have failed. By default, all robots work.

        Returns
        -------
        CostSummary
        """
        result = self(time, positions, is_working)
        if result is None:
            free_area = self.get_cost(time).environment.free_area
            return CostSummary(mean_distance=np.nan, value=np.nan, uncovered_area=free_area)
        return CostSummary(
            mean_distance=result.mean_distance,
            value=result.value,
            uncovered_area=result.uncovered_area,
        )
