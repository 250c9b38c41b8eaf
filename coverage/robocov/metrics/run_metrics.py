"""Metrics of a run over time: coverage, visible area, energy, path lengths, connectivity, clearance."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from robocov.arrays import Array, IntArray
from robocov.errors import ParameterError, format_count, quote
from robocov.metrics import CostHistory, clearances, robot_gaps
from robocov.metrics.sight import covered
from robocov.observation.neighbours import Neighbours
from robocov.record import Record, nearest_moments

RATE = 2.0
"""Moments a second at which areas and graphs are looked at where nothing else is said."""

NEAR_FINAL = 0.05
"""A cost counts as that of the end when it is within this part of it."""

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
"""The columns of ``metrics.csv``, in their order, by the attributes of `RunMetrics`."""


@dataclass(frozen=True, eq=False)
class RunMetrics:
    """Metrics along a run, at K of its moments. Only robots that work count."""

    time: Array
    """Simulated time of each moment, s; (K,), as all arrays."""
    sensed_area: Array
    """Free area within the sensing range of a robot and in its line of sight, m²."""
    range_area: Array
    """Free area within the sensing range of a robot, walls or not, m² (blanket coverage by discs)."""
    visible_area: Array
    """Free area in line of sight of a robot at any distance, m² (the guards of an art gallery)."""
    work: Array
    """Integral of ``|F v|`` so far, all robots together, J; F is the controller's force before any limit."""
    effort: Array
    """Integral of ``|F|²`` so far, all robots together, N² s."""
    path_length: Array
    """Distance travelled so far, mean over the robots, m."""
    components: IntArray
    """Parts into which the team falls that hear each other, see `connections`."""
    algebraic_connectivity: Array
    """Second smallest eigenvalue of the Laplacian of who hears whom; 0 for a team in several parts."""
    wall_clearance: Array
    """Smallest gap between a robot's rim and a wall since the moment before, m; inf for none."""
    robot_clearance: Array
    """Smallest gap between the rims of two robots since the moment before, m; inf for none."""
    free_area: float
    """Free area of the map, of which the areas are parts, m²."""

    def __repr__(self) -> str:
        share = f"{self.sensed_area[-1] / self.free_area:.0%} of the free area sensed at the end"
        return f"<RunMetrics {format_count(len(self.time), 'moment')}, {self.time[-1]:.1f} s, {share}>"

    def rows(self) -> list[tuple[float, ...]]:
        """Return the rows of ``metrics.csv``, under `COLUMNS`."""
        return list(zip(*(getattr(self, name).tolist() for name in COLUMNS), strict=True))

    def final(self) -> dict[str, float | None]:
        """Return the figures of the whole run by their names with units: those of the end.

        Clearances are the smallest of the run, None where there is none.
        """
        found: dict[str, float | None] = {}
        for name, column in COLUMNS.items():
            if name != "time":
                values = getattr(self, name)
                value = float(values.min() if name.endswith("clearance") else values[-1])
                found[column] = value if np.isfinite(value) else None
        return found


def run_metrics(
    record: Record, rate: float = RATE, on_sample: Callable[[], None] | None = None
) -> RunMetrics:
    """Measure a run, `rate` times a second and at its last moment; `on_sample` is called after each.

    Energy and ways are integrated over all moments of the record. Raises ParameterError when the rate is
    negative or not finite.
    """
    if not 0.0 <= rate < np.inf:
        raise ParameterError(f"rate: {quote(rate)} Hz, but a finite number from 0 was wanted")
    moments = nearest_moments(record.time, rate)
    team, working = record.team, record.working
    since = np.concatenate([[0], moments[:-1] + 1])
    areas, graphs = [], []
    for k in moments.tolist():
        some = np.flatnonzero(working[k])
        places = record.positions[k, some]
        free = record.environment.at(float(record.time[k])).free
        areas.append(covered(free, places, team.sensing_range[some]))
        graphs.append(connections(places, team.communication_range[some]))
        if on_sample is not None:
            on_sample()
    parts, connectivity = np.array(graphs).T
    gaps = clearances(record).min(axis=1), robot_gaps(record)[0]
    # in the order of the class
    columns: list[Any] = [record.time[moments], *np.array(areas).T, *_integrals(record)[:, moments]]
    columns += [parts.astype(np.intp), connectivity, *(np.minimum.reduceat(gap, since) for gap in gaps)]
    columns.append(float(record.environment.free_area))
    return RunMetrics(*columns)


def connections(places: Array, ranges: Array) -> tuple[int, float]:
    """Return the number of components of the graph of who hears whom, and its algebraic connectivity.

    Two robots hear each other when they are in range of each other. The algebraic connectivity is the second
    smallest eigenvalue of the graph's Laplacian: 0 where it falls apart or there is one robot, n where all n
    robots hear each other.

    Source: M. Fiedler, *Algebraic connectivity of graphs*, Czechoslovak Mathematical Journal 23 (1973).

    >>> connections(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]), np.full(3, 1.0))
    (1, 1.0)
    """
    n = len(places)
    if n == 0:
        return 0, 0.0
    neighbours = Neighbours.from_ranges(places, ranges)
    if neighbours.is_complete:
        return 1, float(n) if n > 1 else 0.0
    one, other = neighbours.list_pairs()
    parts = int(connected_components(coo_array((np.ones(len(one)), (one, other)), (n, n)), directed=False)[0])
    if n == 1 or parts > 1:
        return parts, 0.0
    laplacian = np.diag(np.bincount(one).astype(float))
    laplacian[one, other] = -1.0
    # whole numbers in the matrix: what is less than this is rounding
    return parts, round(float(np.linalg.eigvalsh(laplacian)[1]), 12)


def time_near_final(history: CostHistory, part: float = NEAR_FINAL) -> float:
    """Return from when on the mean distance stays within `part` of what it is at the end, s.

    Both ways: also a cost that was lower before counts as being away from its end.
    """
    cost = history.mean_distance
    away = np.flatnonzero(~(np.abs(cost - cost[-1]) <= part * cost[-1]))
    return float(history.time[min(away.max(initial=-1) + 1, len(cost) - 1)])


def figures_of(record: Record, history: CostHistory) -> Mapping[str, float | None]:
    """Return the metrics of the end of a run, with that from when on its cost was that of the end."""
    return {**run_metrics(record, 0.0).final(), "near_final_s": time_near_final(history)}


def _integrals(record: Record) -> Array:
    """Return work, effort and mean way from the first moment to each one, (3, T)."""
    forces = np.where(record.working[:, :, None], record.forces, 0.0)
    power = np.abs((forces * record.velocities).sum(axis=-1)).sum(axis=1)
    square = (forces**2).sum(axis=(1, 2))
    step = np.diff(record.time)
    distances = np.sqrt((np.diff(record.positions, axis=0) ** 2).sum(axis=-1))
    moved = np.where(record.travelled, distances, 0.0).mean(axis=1)
    # the force holds until the next moment; what it does meanwhile, by the trapezoidal rule
    parts = 0.5 * (power[1:] + power[:-1]) * step, square[:-1] * step, moved
    return np.array([np.concatenate([[0.0], np.cumsum(part)]) for part in parts])
