"""Measurements of a density that robots do not know."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.density.base import Density
from robocov.errors import ParameterError
from robocov.typing import FloatArray, IntArray

_RANGE_TOLERANCE_M = 1e-9
"""Distance by which a point may exceed the sensing range because of rounding."""

DensityLog: TypeAlias = dict[tuple[int, bytes], float]
"""Measured values by robot and by the bytes of the point."""


class DensitySensor:
    """Measures an unknown density within the sensing range of each robot.

    Parameters
    ----------
    measure : callable
        Called with the indices of robots, (k,), and the point that each of them measures, (k, 2) m. Returns
        φ at each point, (k,).

    Attributes
    ----------
    log : dict
        All measurements of this step, see `DensityLog`.

    See Also
    --------
    Observations.measure_density : Measure the density, whether it is known or not.

    Notes
    -----
    Pickling a sensor stores its log, but not the density. A copy in another process repeats the
    measurements of the original, and raises an error for all others.

    Examples
    --------
    >>> import robocov as rc
    >>> peak = rc.Gaussians((rc.Gaussian((2.0, 2.0), weight=4.0, sigma=1.0),), floor=1.0)
    >>> room = rc.Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6))).with_density(peak)
    >>> conditions = rc.Conditions(density="sensed")
    >>> seen = rc.Simulation(room, rc.Rapf(), [[2.0, 2.0]], conditions=conditions).observe()
    >>> seen.density is None, seen.measure_density([0], seen.positions)
    (True, array([5.]))
    """

    def __init__(self, measure: Callable[[IntArray, FloatArray], FloatArray]) -> None:
        self._measure = measure
        self.log: DensityLog = {}

    @classmethod
    def build(
        cls,
        density: Density | None,
        *,
        positions: FloatArray,
        known_positions: FloatArray,
        sensing_ranges: FloatArray,
    ) -> DensitySensor:
        """Build the sensor for one step.

        Parameters
        ----------
        density : Density or None
            The density that the robots measure. None if it is 1 everywhere.
        positions : (n, 2) array, m
            Positions of the robots.
        known_positions : (n, 2) array, m
            Positions as the robots know them. A robot measures relative to itself: with a localization error,
            it measures at a point that is off by this error.
        sensing_ranges : (n,) array, m
            Maximum distance at which each robot can measure.

        Returns
        -------
        DensitySensor
        """

        def measure(robots: IntArray, points: FloatArray) -> FloatArray:
            offsets = points - known_positions[robots]
            distances = compute_point_distances(points, known_positions[robots])
            is_in_range = distances <= sensing_ranges[robots] + _RANGE_TOLERANCE_M
            if not is_in_range.all():
                k = int(np.flatnonzero(~is_in_range)[0])
                raise ParameterError(
                    f"density: robot {robots[k] + 1}: expected a point within its sensing range of "
                    f"{sensing_ranges[robots[k]]:.10g} m, got a point at {distances[k]:.10g} m"
                )
            if density is None:
                return np.ones(len(points))
            # Both are the same array if there is no localization error. The density is then evaluated at the
            # points themselves, without the rounding of `points - known_positions + positions`.
            if known_positions is positions:
                return density.evaluate(points)
            return density.evaluate(positions[robots] + offsets)

        return cls(measure)

    def measure(self, robots: Any, points: Any) -> FloatArray:
        """Measure the density at points.

        Parameters
        ----------
        robots : int or (k,) int array
            Index of the robot that measures at each point, from 0.
        points : (k, 2) array, m
            Points within the sensing range of these robots.

        Returns
        -------
        (k,) array
            φ at each point.

        Raises
        ------
        ParameterError
            If a point is not within the sensing range of its robot.
        """
        points = np.ascontiguousarray(points, dtype=np.float64)
        robots = np.broadcast_to(np.asarray(robots, dtype=np.intp), len(points))
        values = self._measure(robots, points)
        for k, robot in enumerate(robots.tolist()):
            self.log[robot, points[k].tobytes()] = float(values[k])
        return values

    def copy_without_log(self) -> DensitySensor:
        """Return a sensor for the same density and positions, which has measured nothing yet.

        Returns
        -------
        DensitySensor
        """
        return DensitySensor(self._measure)

    def __reduce__(self) -> tuple[Any, ...]:
        # The density must not reach another process.
        return RecordedDensitySensor, (self.log,)


class RecordedDensitySensor(DensitySensor):
    """Repeats the measurements of another sensor, without the density.

    A point that was not measured raises a ParameterError.

    Parameters
    ----------
    log : mapping
        The measurements of the other sensor.
    robot : int or None
        The only robot whose measurements are repeated. For all other robots, every measurement is 1, so that
        nothing that they measured is revealed. By default, the measurements of all robots are repeated.
    """

    def __init__(self, log: DensityLog, robot: int | None = None) -> None:
        super().__init__(self._repeat)
        self.log = {key: value for key, value in log.items() if robot is None or key[0] == robot}
        self._robot = robot

    def __reduce__(self) -> tuple[Any, ...]:
        return RecordedDensitySensor, (self.log, self._robot)

    def _repeat(self, robots: IntArray, points: FloatArray) -> FloatArray:
        values = np.ones(len(points))
        for k, robot in enumerate(robots.tolist()):
            if self._robot is not None and robot != self._robot:
                continue
            key = (robot, points[k].tobytes())
            if key not in self.log:
                x, y = points[k].tolist()
                raise ParameterError(
                    f"density: robot {robot + 1}: expected a point that it has measured, got [{x!r}, {y!r}]"
                )
            values[k] = self.log[key]
        return values
