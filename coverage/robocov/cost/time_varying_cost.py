"""The coverage cost (22) of a map whose obstacles move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import shapely

from robocov.arrays import Array, BoolArray
from robocov.cost.coverage_cost import CoverageCost
from robocov.cost.result import CoverageResult

_MAX_CACHED_MAPS = 64
"""Maximum number of maps whose costs are cached: moving obstacles return to the same positions."""


class TimeVaryingCost:
    """The coverage cost (22) at any time, computed from the robots that can move.

    Robots that have failed do not count, since they cannot go anywhere. Neither do robots that a moving
    obstacle has run over, until they are free again.

    Parameters
    ----------
    cost : CoverageCost
        The cost of the map at time zero.
    progress : callable, optional
        See `CoverageCost`; used for the maps at other times.

    Examples
    --------
    >>> from robocov.environment import Environment
    >>> square = Environment("square", ((0, 0), (1, 0), (1, 1), (0, 1)))
    >>> cost = TimeVaryingCost(CoverageCost(square, 16))
    >>> positions = np.array([[0.5, 0.5], [0.25, 0.25]])
    >>> result = cost(2.0, positions, working=np.array([True, False]))
    >>> len(result.positions)
    1
    """

    def __init__(self, cost: CoverageCost, progress: Callable[[float], None] | None = None) -> None:
        self._cost = cost
        self._progress = progress
        self._cost_by_map: dict[bytes, CoverageCost] = {}

    def get_cost(self, time: float) -> CoverageCost:
        """Return the coverage cost of the map at a time.

        Parameters
        ----------
        time : float, s

        Returns
        -------
        CoverageCost
            The one passed to the constructor if no obstacle moves.
        """
        environment = self._cost.environment
        if not environment.has_moving_obstacles:
            return self._cost
        current = environment.at(time)
        key = current.free.wkb
        if key not in self._cost_by_map:
            if len(self._cost_by_map) >= _MAX_CACHED_MAPS:
                oldest = next(iter(self._cost_by_map))
                del self._cost_by_map[oldest]
            self._cost_by_map[key] = CoverageCost(current, self._cost.lattice, progress=self._progress)
        return self._cost_by_map[key]

    def find_counted_robots(
        self, time: float, positions: Array, working: BoolArray | None = None
    ) -> BoolArray:
        """Find the robots that count: they work, and no moving obstacle covers them.

        Parameters
        ----------
        time : float, s
        positions : (n, 2) array, m
        working : (n,) bool array, optional
            Whether each robot works. By default, all do.

        Returns
        -------
        (n,) bool array
        """
        is_counted = np.ones(len(positions), dtype=bool) if working is None else working.copy()
        if self._cost.environment.has_moving_obstacles:
            free = self.get_cost(time).environment.free
            is_counted &= shapely.contains_properly(free, shapely.points(positions))
        return is_counted

    def __call__(
        self, time: float, positions: Array, working: BoolArray | None = None, speeds: Array | None = None
    ) -> CoverageResult | None:
        """Compute the coverage cost at a time.

        Parameters
        ----------
        time : float, s
        positions : (n, 2) array, m
        working : (n,) bool array, optional
            Whether each robot works. By default, all do.
        speeds : (n,) array, m/s, optional
            See `CoverageCost`.

        Returns
        -------
        CoverageResult or None
            It has a row for each robot that counts. None if no robot counts.
        """
        is_counted = self.find_counted_robots(time, positions, working)
        if not is_counted.any():
            return None
        counted_speeds = None if speeds is None else speeds[is_counted]
        return self.get_cost(time)(positions[is_counted], counted_speeds)

    def evaluate_all_robots(
        self, time: float, positions: Array, working: BoolArray | None = None
    ) -> CoverageResult | None:
        """Compute the coverage cost at a time, with a row for every robot.

        Parameters
        ----------
        time : float, s
        positions : (n, 2) array, m
        working : (n,) bool array, optional
            Whether each robot works. By default, all do.

        Returns
        -------
        CoverageResult or None
            A robot that does not count owns no site. None if no robot counts.
        """
        result = self(time, positions, working)
        if result is None or len(result.positions) == len(positions):
            return result
        rows = np.flatnonzero(self.find_counted_robots(time, positions, working))
        owner = np.where(result.owner >= 0, rows[result.owner], -1)
        return replace(result, positions=np.array(positions), owner=owner)

    def compute_summary(
        self, time: float, positions: Array, working: BoolArray | None = None
    ) -> tuple[float, float, float]:
        """Compute the numbers that summarize the coverage cost at a time.

        Parameters
        ----------
        time : float, s
        positions : (n, 2) array, m
        working : (n,) bool array, optional
            Whether each robot works. By default, all do.

        Returns
        -------
        mean_distance : float, m
            nan if no robot counts.
        value : float, m³
            nan if no robot counts.
        uncovered_area : float, m²
            The entire free area if no robot counts.
        """
        result = self(time, positions, working)
        if result is None:
            return np.nan, np.nan, self.get_cost(time).environment.free_area
        return result.mean_distance, result.value, result.uncovered_area
