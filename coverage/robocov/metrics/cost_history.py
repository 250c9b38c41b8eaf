"""The coverage cost over a run.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.drawing import Drawable
from robocov.errors import format_count, require_type
from robocov.record import Record, require_rate, select_nearest_steps
from robocov.typing import FloatArray

DEFAULT_RATE_HZ = 10.0
"""Number of samples of the coverage cost per simulated second."""
MAX_RATE_WITH_MOVING_OBSTACLES_HZ = 1.0
"""Maximum number of samples per simulated second if obstacles move. Then each sample takes longer, because
the map differs."""


@dataclass(frozen=True, eq=False)
class CostHistory(Drawable):
    """The coverage cost of equation (22) over a run, at K sampled time steps.

    Attributes
    ----------
    time : (K,) array, s
        Simulation time of each sample.
    mean_distance : (K,) array, m
        Mean distance of the points of the map from the nearest robot.
    cost : (K,) array, m³
        Coverage cost.
    uncovered_area : (K,) array, m²
        Area of the components of the free space without a robot.
    mean_time : (K,) array or None, s
        Mean over the points of the map of the time until the first robot arrives, if every robot drives at
        its maximum speed. None if all robots have the same maximum speed.

    See Also
    --------
    compute_cost_history : Compute the cost over a run.
    """

    _drawing_name = "history"

    time: FloatArray
    mean_distance: FloatArray
    cost: FloatArray
    uncovered_area: FloatArray
    mean_time: FloatArray | None = None

    def __repr__(self) -> str:
        first = float(self.mean_distance[0])
        last = float(self.mean_distance[-1])
        samples = format_count(len(self.time), "sample")
        return f"<CostHistory {samples}, {self.time[-1]:.1f} s, mean distance {first:.3f} to {last:.3f} m>"


def compute_cost_history(
    record: Record,
    cost: CoverageCost,
    rate: float = DEFAULT_RATE_HZ,
    on_sample: Callable[[], None] | None = None,
) -> CostHistory:
    """Compute the coverage cost over a run.

    At each time step, only working robots count, and moving obstacles are at their positions at this time.

    Parameters
    ----------
    record : Record
        The run.
    cost : CoverageCost
        Cost of the record's environment.
    rate : float, Hz
        Number of samples per simulated second; see `select_sampled_steps`.
    on_sample : callable or None
        Called after each sample, to report progress.

    Returns
    -------
    CostHistory
        The cost at each sampled time step.

    Raises
    ------
    ParameterError
        If `record` or `cost` has the wrong type, or the rate is negative or not finite.

    See Also
    --------
    CoverageCost : The coverage cost of one set of positions.
    compute_run_metrics : Other metrics over a run.
    summarize : The results of a run.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> record = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6, seed=0)).run(2.0)
    >>> history = rc.compute_cost_history(record, rc.CoverageCost(rooms, lattice=16), rate=1.0)
    >>> history.time
    array([0., 1., 2.])
    """
    require_type("record", record, Record, 'a Record, as in Record.load("run")')
    require_type("cost", cost, CoverageCost, "a CoverageCost")
    steps = select_sampled_steps(record, rate)
    sample_count = len(steps)
    mean_distance = np.empty(sample_count)
    cost_values = np.empty(sample_count)
    uncovered_area = np.empty(sample_count)
    has_mixed_speeds = record.team.has_mixed_speeds
    mean_time = np.full(sample_count, np.nan)
    cost_at_time = TimeVaryingCost(cost)
    for sample, step in enumerate(steps):
        time = float(record.time[step])
        positions = record.positions[step]
        is_working = None if record.conditions is None else record.is_working[step]
        summary = cost_at_time.compute_summary(time, positions, is_working)
        mean_distance[sample] = summary.mean_distance
        cost_values[sample] = summary.value
        uncovered_area[sample] = summary.uncovered_area
        if has_mixed_speeds:
            speed_cost = cost_at_time(time, positions, is_working, record.team.max_speed)
            if speed_cost is not None:
                mean_time[sample] = speed_cost.mean_time
        if on_sample is not None:
            on_sample()
    return CostHistory(
        time=record.time[steps],
        mean_distance=mean_distance,
        cost=cost_values,
        uncovered_area=uncovered_area,
        mean_time=mean_time if has_mixed_speeds else None,
    )


def select_sampled_steps(record: Record, rate: float) -> list[int]:
    """Select the time steps nearest to multiples of 1/rate, and the first and last ones.

    Parameters
    ----------
    record : Record
        The run.
    rate : float, Hz
        Number of samples per simulated second. It is limited to `MAX_RATE_WITH_MOVING_OBSTACLES_HZ` if
        obstacles move.

    Returns
    -------
    list of int
        Indices of the time steps, ascending.

    Raises
    ------
    ParameterError
        If the rate is negative or not finite.
    """
    require_rate(rate)
    if record.environment.has_moving_obstacles:
        rate = min(rate, MAX_RATE_WITH_MOVING_OBSTACLES_HZ)
    return [int(step) for step in select_nearest_steps(record.time, rate)]


def compute_mean_over_run(time: FloatArray, values: FloatArray) -> float:
    """Compute the mean over time of values that were sampled over a run, by the trapezoidal rule.

    Parameters
    ----------
    time : (K,) array, s
        Times of the samples, ascending.
    values : (K,) array
        Values at these times.

    Returns
    -------
    float
        Mean, in the unit of the values.

    Examples
    --------
    >>> compute_mean_over_run(np.array([0.0, 1.0, 3.0]), np.array([4.0, 2.0, 2.0]))
    2.3333333333333335
    """
    duration = float(time[-1] - time[0])
    if duration == 0.0:
        return float(values[-1])
    return float(np.trapezoid(values, time)) / duration
