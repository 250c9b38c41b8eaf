"""Metrics of a run over time: areas, energy, path lengths, connectivity and clearance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.errors import format_count
from robocov.metrics.clearance import compute_clearances, measure_robot_gaps
from robocov.metrics.communication import compute_sent_rate
from robocov.metrics.connectivity import Connectivity, measure_connectivity
from robocov.metrics.cost_history import CostHistory
from robocov.metrics.visible_area import CoveredAreas, compute_covered_areas
from robocov.record import Record, select_nearest_steps
from robocov.typing import FloatArray, IntArray

DEFAULT_RATE_HZ = 2.0
"""Number of samples of the metrics per simulated second."""
NEAR_FINAL_TOLERANCE = 0.05
"""Maximum relative deviation of a mean distance that counts as near its final value."""

COLUMNS = {
    "time": "time_s",
    "sensed_area": "sensed_area_m2",
    "range_area": "range_area_m2",
    "visible_area": "visible_area_m2",
    "work": "work_J",
    "effort": "effort_N2_s",
    "path_length": "path_length_m",
    "components": "components",
    "algebraic_connectivity": "algebraic_connectivity",
    "wall_clearance": "wall_clearance_m",
    "robot_clearance": "robot_clearance_m",
}
"""Columns of ``metrics.csv``, in order, by the attributes of `RunMetrics`."""


@dataclass(frozen=True, eq=False)
class RunMetrics:
    """Metrics over a run, at K sampled time steps. Only working robots count.

    Attributes
    ----------
    time : (K,) array, s
        Simulation time.
    sensed_area : (K,) array, m²
        Free area within the sensing range of a robot and in its line of sight.
    range_area : (K,) array, m²
        Free area within the sensing range of a robot, regardless of walls (blanket coverage by discs). If the
        ranges of all robots are infinite, only components of the free space that contain a robot count.
    visible_area : (K,) array, m²
        Free area in the line of sight of a robot, at any distance (as in the art gallery problem).
    work : (K,) array, J
        Integral of ``|F v|`` from the start to the sample, summed over the robots. F is the force of the
        controller before any limit.
    effort : (K,) array, N² s
        Integral of ``|F|²`` from the start to the sample, summed over the robots.
    path_length : (K,) array, m
        Path length from the start to the sample, averaged over the robots.
    components : (K,) int array
        Number of components of the communication graph; see
        `robocov.metrics.connectivity.measure_connectivity`.
    algebraic_connectivity : (K,) array
        Second smallest eigenvalue of the Laplacian of this graph; 0 if the graph has several components.
    wall_clearance : (K,) array, m
        Minimum distance from the rim of a robot to a wall since the previous sample; inf if none works.
    robot_clearance : (K,) array, m
        Minimum distance between the rims of two robots since the previous sample; inf if fewer than two
        robots work.
    free_area : float, m²
        Free area of the map.

    See Also
    --------
    compute_run_metrics : Compute the metrics of a run.

    Examples
    --------
    >>> import robocov as rc
    >>> measured = rc.compute_run_metrics(rc.run("square", robots=2, duration=1.0), rate=1.0)
    >>> measured.path_length.shape, measured.final()["components"]
    ((2,), 1.0)
    """

    time: FloatArray
    sensed_area: FloatArray
    range_area: FloatArray
    visible_area: FloatArray
    work: FloatArray
    effort: FloatArray
    path_length: FloatArray
    components: IntArray
    algebraic_connectivity: FloatArray
    wall_clearance: FloatArray
    robot_clearance: FloatArray
    free_area: float

    def __repr__(self) -> str:
        samples = format_count(len(self.time), "sample")
        sensed_fraction = self.sensed_area[-1] / self.free_area
        return (
            f"<RunMetrics {samples}, {self.time[-1]:.1f} s, "
            f"{sensed_fraction:.0%} of the free area sensed at the end>"
        )

    def rows(self) -> list[tuple[float, ...]]:
        """Return the rows of ``metrics.csv``, whose columns are `COLUMNS`.

        Returns
        -------
        list of tuple of float
            One row for each sample.
        """
        return list(zip(*(getattr(self, name).tolist() for name in COLUMNS), strict=True))

    def final(self) -> dict[str, float | None]:
        """Return the metrics at the end of the run.

        Returns
        -------
        dict of str to float or None
            Metrics by column of ``metrics.csv``, except for the time. Clearances are the smallest ones of the
            run; they are None if they are infinite.
        """
        final_values: dict[str, float | None] = {}
        for name, column in COLUMNS.items():
            if name == "time":
                continue
            values = getattr(self, name)
            value = float(values.min() if name.endswith("clearance") else values[-1])
            final_values[column] = value if np.isfinite(value) else None
        return final_values


class _Integrals(NamedTuple):
    """Integrals from the start of a run to each time step, (T,) each; see `RunMetrics` for their meanings."""

    work: FloatArray
    effort: FloatArray
    path_length: FloatArray


def compute_run_metrics(
    record: Record, rate: float = DEFAULT_RATE_HZ, on_sample: Callable[[], None] | None = None
) -> RunMetrics:
    """Compute the metrics of a run.

    Parameters
    ----------
    record : Record
        The run.
    rate : float, Hz
        Number of samples per simulated second. The first and the last time step are always sampled, even if
        the rate is 0. Energy and path lengths are integrated over all time steps of the record, regardless of
        the rate.
    on_sample : callable or None
        Called after each sample, to report progress.

    Returns
    -------
    RunMetrics
        The metrics at each sampled time step.

    Raises
    ------
    ParameterError
        If the rate is negative or not finite.

    See Also
    --------
    compute_cost_history : The coverage cost over a run.
    summarize : The results of a run.

    Examples
    --------
    >>> import robocov as rc
    >>> rooms = rc.load_map("rooms")
    >>> record = rc.Simulation(rooms, rc.Rapf(), rooms.start().sample(6, seed=0)).run(2.0)
    >>> rc.compute_run_metrics(record, rate=1.0).time
    array([0., 1., 2.])
    """
    steps = select_nearest_steps(record.time, rate)
    areas = []
    graphs = []
    for step in steps.tolist():
        areas.append(_compute_areas_at(record, step))
        graphs.append(_measure_connectivity_at(record, step))
        if on_sample is not None:
            on_sample()
    integrals = _integrate(record)
    # The clearances of a sample are the smallest ones since the previous sample. The interval of a sample
    # starts at the step after the previous sample.
    interval_starts = np.concatenate([[0], steps[:-1] + 1])
    wall_gaps = compute_clearances(record).min(axis=1)
    robot_gaps = measure_robot_gaps(record).min_gaps
    return RunMetrics(
        time=record.time[steps],
        sensed_area=np.array([area.sensed for area in areas]),
        range_area=np.array([area.within_range for area in areas]),
        visible_area=np.array([area.visible for area in areas]),
        work=integrals.work[steps],
        effort=integrals.effort[steps],
        path_length=integrals.path_length[steps],
        components=np.array([graph.components for graph in graphs], dtype=np.intp),
        algebraic_connectivity=np.array([graph.algebraic_connectivity for graph in graphs]),
        wall_clearance=np.minimum.reduceat(wall_gaps, interval_starts),
        robot_clearance=np.minimum.reduceat(robot_gaps, interval_starts),
        free_area=float(record.environment.free_area),
    )


def _compute_areas_at(record: Record, step: int) -> CoveredAreas:
    """Compute the areas that the working robots cover at a time step."""
    free = record.environment.at(float(record.time[step])).free
    robots = np.flatnonzero(record.is_working[step])
    return compute_covered_areas(free, record.positions[step, robots], record.team.sensing_range[robots])


def _measure_connectivity_at(record: Record, step: int) -> Connectivity:
    """Measure the connectivity of the working robots at a time step."""
    robots = np.flatnonzero(record.is_working[step])
    return measure_connectivity(record.positions[step, robots], record.team.communication_range[robots])


def find_time_near_final(history: CostHistory, tolerance: float = NEAR_FINAL_TOLERANCE) -> float | None:
    """Find the time from which the mean distance stays near its final value.

    Parameters
    ----------
    history : CostHistory
        Coverage cost over the run.
    tolerance : float
        Maximum relative deviation from the final value, in both directions.

    Returns
    -------
    float or None, s
        Time of a sample of the history. None if the final value is not finite, because no robot works then.
    """
    mean_distance = history.mean_distance
    if not np.isfinite(mean_distance[-1]):
        return None
    is_near_final = np.abs(mean_distance - mean_distance[-1]) <= tolerance * mean_distance[-1]
    # The sample after the last one that is not near the final value; the first sample if all are near.
    last_not_near = int(np.flatnonzero(~is_near_final).max(initial=-1))
    return float(history.time[min(last_not_near + 1, len(mean_distance) - 1)])


def compute_final_metrics(record: Record, history: CostHistory) -> Mapping[str, float | None]:
    """Compute the metrics that describe a whole run by one number each.

    Parameters
    ----------
    record : Record
        The run.
    history : CostHistory
        Coverage cost over the run.

    Returns
    -------
    mapping of str to float or None
        The metrics at the end of the run, the data rate of the messages of a robot, and the time from which
        the mean distance stays near its final value. The names end in the units.
    """
    return {
        **compute_run_metrics(record, rate=0.0).final(),
        "sent_bytes_per_s": compute_sent_rate(record),
        "near_final_s": find_time_near_final(history),
    }


def _integrate(record: Record) -> _Integrals:
    """Integrate work, effort and mean path length from the start of a run to each time step.

    The effort is exact, because forces are constant during a time step. The power is that of the force that
    the controller chose at a time step, with the velocity at that time; it is integrated by the trapezoidal
    rule.
    """
    forces = np.where(record.is_working[:, :, None], record.forces, 0.0)
    power = np.abs((forces * record.velocities).sum(axis=-1)).sum(axis=1)
    squared_force = (forces**2).sum(axis=(1, 2))
    step_durations = np.diff(record.time)
    distances = compute_point_distances(record.positions[1:], record.positions[:-1])
    traveled = np.where(record.traveled, distances, 0.0).mean(axis=1)
    return _Integrals(
        work=_accumulate(0.5 * (power[1:] + power[:-1]) * step_durations),
        effort=_accumulate(squared_force[:-1] * step_durations),
        path_length=_accumulate(traveled),
    )


def _accumulate(increments: FloatArray) -> FloatArray:
    """Return the cumulative sums of increments, starting with 0."""
    return np.concatenate([[0.0], np.cumsum(increments)])
