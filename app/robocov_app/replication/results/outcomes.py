"""Outcomes of contenders on the same problem instances: selecting, comparing and merging them.

The values of failed runs are nan, and comparisons leave these runs out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, compress
from typing import NamedTuple

import numpy as np

from robocov.controllers.gains import Value
from robocov.metrics import CostHistory
from robocov.typing import BoolArray, FloatArray
from robocov_app.figures.statistics import Interval, bootstrap, estimate_fraction
from robocov_app.replication.design.plan import format_start


class ProblemInstance(NamedTuple):
    """A map, a start and a seed, from which the same initial positions follow for all contenders."""

    map: str
    start: str
    seed: int

    def __str__(self) -> str:
        return f"{self.map}, start {format_start(self.start)}, seed {self.seed}"


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Outcomes of every contender on each of m problem instances.

    Measures are ``final`` (m), ``gap`` (J / J_ref - 1), ``early`` and ``first_minute`` (m, time averages),
    ``blocked`` (fraction of robots that have a wall between them and their goals at the end), ``contacts``,
    ``clearance`` (smallest gap to a wall, m), ``settled`` (s, nan if the team did not settle), ``time`` (s),
    ``path`` (m), ``over_run`` (m, time average of the cost) and ``work`` (J, of the team), all (m,), and
    ``placement``, the final positions, (m, n, 2) m.

    Parameters
    ----------
    instances : tuple of ProblemInstance
    values : Mapping
        Arrays by contender and measure; nan where a run failed.
    length_scale_by_map : Mapping
        Side of a square with the mean free area per robot, m, by map; distances are judged relative to it.
    """

    instances: tuple[ProblemInstance, ...]
    values: Mapping[tuple[str, str], FloatArray]
    length_scale_by_map: Mapping[str, float] = field(default_factory=dict)

    def get_values(self, contender: str, measure: str) -> FloatArray:
        """Return the values of a measure for a contender, (m,); all nan if it did not take part."""
        values = self.values.get((contender, measure))
        return np.full(len(self.instances), np.nan) if values is None else values

    @property
    def maps(self) -> tuple[str, ...]:
        """Map of each instance."""
        return tuple(instance.map for instance in self.instances)

    @property
    def starts(self) -> tuple[str, ...]:
        """Kind of starts of each instance."""
        return tuple(instance.start for instance in self.instances)

    def select(self, mask: Sequence[bool] | BoolArray) -> Outcomes:
        """Return the outcomes on the instances where a mask, (m,), is true."""
        rows = np.array(mask, dtype=bool)
        values = {key: array[rows] for key, array in self.values.items()}
        return Outcomes(tuple(compress(self.instances, mask)), values, self.length_scale_by_map)

    def select_finite(self, measure: str, *contenders: str) -> Outcomes:
        """Return the outcomes on the instances on which a measure is finite for all given contenders."""
        is_finite = [np.isfinite(self.get_values(contender, measure)) for contender in contenders]
        return self.select(np.all(is_finite, axis=0))

    def select_starts(self, *starts: str) -> Outcomes:
        """Return the outcomes of the runs from given kinds of starts."""
        return self.select([start in starts for start in self.starts])

    def compute_medians_by_map(self, contender: str, measure: str = "gap") -> dict[str, float]:
        """Return the median of a contender's finite values on each map that has any."""
        known = self.select_finite(measure, contender)
        values = known.get_values(contender, measure)
        maps = np.array(known.maps)
        return {name: float(np.median(values[maps == name])) for name in dict.fromkeys(known.maps)}

    def compute_placement_spreads(self, contender: str) -> dict[str, float]:
        """Compute the dependence of a contender's final placement on the starts.

        Returns
        -------
        dict
            Median matched distance between final placements from different starts, relative to the side of
            a robot's share, by map.
        """
        distances: dict[str, list[float]] = {}
        placements = zip(self.instances, self.values.get((contender, "placement"), ()), strict=False)
        for (instance, positions), (other, other_positions) in combinations(placements, 2):
            if instance.map != other.map or instance.start == other.start:
                continue
            if np.isfinite(positions).all() and np.isfinite(other_positions).all():
                distance = compute_matched_distance(positions, other_positions)
                distances.setdefault(instance.map, []).append(distance)
        return {
            name: float(np.median(values)) / self.length_scale_by_map[name]
            for name, values in distances.items()
        }

    def compare(self, first: str, second: str, measure: str = "final") -> PairedComparison | None:
        """Compare two contenders; None if they have no instance in common."""
        known = self.select_finite(measure, first, second)
        if not known.instances:
            return None
        return PairedComparison(
            known, first, known.get_values(first, measure), known.get_values(second, measure)
        )


@dataclass(frozen=True, eq=False)
class PairedComparison:
    """Comparison of two contenders on the m instances on which both have a value.

    Parameters
    ----------
    outcomes : Outcomes
        Outcomes on these instances.
    first : str
        Key of the first contender.
    first_values, second_values : (m,) arrays
    """

    outcomes: Outcomes
    first: str
    first_values: FloatArray
    second_values: FloatArray

    @cached_property
    def ratios(self) -> FloatArray:
        """Ratios of the first values to the second ones, (m,)."""
        return self.first_values / self.second_values

    @cached_property
    def median_ratio(self) -> Interval:
        """Median ratio, with its interval."""
        return bootstrap(self.ratios, clusters=self.outcomes.maps)

    @cached_property
    def wins(self) -> Interval:
        """Fraction of the pairs in which the first value is lower; a tie counts half."""
        is_lower = self.first_values < self.second_values
        is_tie = self.first_values == self.second_values
        return estimate_fraction(is_lower + 0.5 * is_tie, self.outcomes.maps)


def merge_outcomes(parts: Sequence[Outcomes]) -> Outcomes:
    """Merge the outcomes of several sweeps.

    Parameters
    ----------
    parts : sequence of Outcomes
        If several contain the same run, the last one counts.

    Returns
    -------
    Outcomes
        Outcomes on all instances; nan where a contender did not take part.
    """
    instances = tuple(dict.fromkeys(instance for part in parts for instance in part.instances))
    index = {instance: k for k, instance in enumerate(instances)}
    values: dict[tuple[str, str], FloatArray] = {}
    length_scale_by_map: dict[str, float] = {}
    for part in parts:
        rows = [index[instance] for instance in part.instances]
        for key, array in part.values.items():
            if key not in values:
                values[key] = np.full((len(instances), *array.shape[1:]), np.nan)
            values[key][rows] = array
        length_scale_by_map |= part.length_scale_by_map
    return Outcomes(instances, values, length_scale_by_map)


@dataclass(frozen=True, eq=False)
class GainOutcomes:
    """Outcomes of one controller on m problem instances with each of g sets of gains.

    Parameters
    ----------
    instances : tuple of ProblemInstance
    gains : tuple of Mapping
        The sets of gains.
    relative_costs : (g, m) array
        J / J_ref: the final mean distance relative to that of the map's reference placement; nan where a run
        failed.
    """

    instances: tuple[ProblemInstance, ...]
    gains: tuple[Mapping[str, Value], ...]
    relative_costs: FloatArray

    @property
    def maps(self) -> tuple[str, ...]:
        """Map of each instance."""
        return tuple(instance.map for instance in self.instances)

    def select(self, mask: Sequence[bool] | BoolArray) -> GainOutcomes:
        """Return the outcomes on the instances where a mask, (m,), is true."""
        columns = np.array(mask, dtype=bool)
        return GainOutcomes(
            tuple(compress(self.instances, mask)), self.gains, self.relative_costs[:, columns]
        )

    def select_complete(self) -> GainOutcomes:
        """Return the outcomes on the instances where no run failed."""
        return self.select(np.asarray(np.isfinite(self.relative_costs).all(axis=0)))

    def find_best(self, columns: Sequence[int] | None = None) -> int:
        """Return the index of the set of gains with the lowest mean J / J_ref.

        Parameters
        ----------
        columns : sequence of int, optional
            Instances to consider; by default all. Instances with a failed run are left out.
        """
        relative_costs = self.relative_costs if columns is None else self.relative_costs[:, list(columns)]
        is_complete = np.isfinite(relative_costs).all(axis=0)
        return int(np.argmin(relative_costs[:, is_complete].mean(axis=1)))

    def list_levels(self, gain: str) -> list[float]:
        """Return the different values of a numeric gain, in ascending order."""
        return sorted({get_level(gains, gain) for gains in self.gains if gain in gains})

    def select_gain(self, name: str, value: float) -> GainOutcomes:
        """Return the outcomes of the sets in which the named gain has the given value."""
        mask = [gains.get(name) == value for gains in self.gains]
        return GainOutcomes(self.instances, tuple(compress(self.gains, mask)), self.relative_costs[mask])


def get_level(gains: Mapping[str, Value], name: str) -> float:
    """Return the value of a gain in a set, as a number."""
    value = gains[name]
    # Only the limit of the attraction can be None, for no limit, and no grid varies it.
    assert value is not None
    return float(value)


def find_best_gains(outcomes: Mapping[str, GainOutcomes]) -> dict[str, Mapping[str, Value]]:
    """Return the best gains of controllers, except for those that had a failed run on every instance."""
    best = {}
    for name, grid in outcomes.items():
        if grid.select_complete().instances:
            best[name] = grid.gains[grid.find_best()]
    return best


def compute_mean_until(history: CostHistory, until: float) -> float:
    """Compute the time average of the mean distance up to a time or to the end of the run.

    Parameters
    ----------
    history : CostHistory
    until : float
        Time, s.

    Returns
    -------
    float
        Time average by the trapezoidal rule, m.
    """
    end = min(until, float(history.time[-1]))
    is_before = history.time < end
    time = np.append(history.time[is_before], end)
    end_value = np.interp(end, history.time, history.mean_distance)
    values = np.append(history.mean_distance[is_before], end_value)
    if len(time) == 1:
        return float(values[-1])
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def compute_matched_distance(first: FloatArray, second: FloatArray) -> float:
    """Compute the mean distance between two placements of interchangeable robots.

    Parameters
    ----------
    first, second : (n, 2) arrays, m

    Returns
    -------
    float
        Mean distance between matched robots, m; they are matched such that the sum of distances is minimal.

    Examples
    --------
    >>> import numpy as np
    >>> compute_matched_distance(np.array([[0.0, 0.0], [5.0, 0.0]]), np.array([[5.0, 1.0], [0.0, 1.0]]))
    1.0
    """
    from scipy.optimize import linear_sum_assignment

    offsets = first[:, None] - second[None]
    distances = np.hypot(*offsets.transpose(2, 0, 1))
    return float(distances[linear_sum_assignment(distances)].mean())
