"""Tables of outcomes: what contenders reached in the same scenarios.

A *scenario* is a map, a start and a seed: every contender began from the same positions there. A run that
failed is nan, and drops out of every comparison that needs it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations, compress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.controllers import CONTROLLERS, get_gains
from robocov.controllers.gains import Value
from robocov.metrics import CostHistory
from robocov.metrics.results import read_results
from robocov_app.figures.statistics import Interval, bootstrap, share
from robocov_app.replication.plan import ROBOTS
from robocov_app.replication.references import References
from robocov_app.replication.studies import Contest
from robocov_app.sweep.study import Study

EARLY = 20.0  # s in which a team spreads over a convex region of ten metres: Lloyd's algorithm has settled
FIRST_MINUTE = 60.0  # s that count as "during the motion"

# measures that stand in the table of a sweep, and their columns; robots of one speed have no time
COLUMNS = {
    "final": "mean_distance_m",
    "contacts": "contacts",
    "stuck": "stuck_robots",
    "settled": "settled_at_s",
    "time": "mean_time_s",
    "path": "path_length_m",
    "over_run": "mean_distance_over_run_m",
    "work": "work_J",
}


class Scenario(NamedTuple):
    """Map and starts of a run."""

    map: str
    start: str
    seed: int

    def __str__(self) -> str:
        return f"{self.map}, start {self.start}, seed {self.seed}"


@dataclass(frozen=True, eq=False)
class Outcomes:
    """Results of every contender in each of m scenarios; nan where its run failed.

    Measures are ``final`` (m), ``gap`` (J/J_ref - 1), ``early`` and ``first_minute`` (m, time averages),
    ``stuck`` (robots), ``contacts``, ``settled`` (s, nan where it did not), ``time`` (s), ``path``
    (m), ``over_run`` (m, time average of the cost), ``work`` (J, of the team), all (m,), and ``placement``,
    (m, n, 2) m at the end.
    """

    scenarios: tuple[Scenario, ...]
    values: Mapping[tuple[str, str], Array]  # by contender and measure
    sides: Mapping[str, float] = field(default_factory=dict)  # m, of a robot's share as a square, by map

    def of(self, contender: str, measure: str) -> Array:
        """Return what a contender reached, (m,); all nan where it did not take part."""
        found = self.values.get((contender, measure))
        return np.full(len(self.scenarios), np.nan) if found is None else found

    @property
    def maps(self) -> tuple[str, ...]:
        return tuple(scenario.map for scenario in self.scenarios)

    @property
    def starts(self) -> tuple[str, ...]:
        return tuple(scenario.start for scenario in self.scenarios)

    def where(self, chosen: Sequence[bool] | BoolArray) -> Outcomes:
        kept = {key: values[np.array(chosen, dtype=bool)] for key, values in self.values.items()}
        return Outcomes(tuple(compress(self.scenarios, chosen)), kept, self.sides)

    def measured(self, measure: str, *contenders: str) -> Outcomes:
        return self.where(np.all([np.isfinite(self.of(each, measure)) for each in contenders], axis=0))

    def from_starts(self, *starts: str) -> Outcomes:
        return self.where([start in starts for start in self.starts])

    def median_by_map(self, contender: str, measure: str = "gap") -> dict[str, float]:
        """Return the median of what a contender reached on each map on which it has a finite value."""
        here = self.measured(measure, contender)
        values, names = here.of(contender, measure), np.array(here.maps)
        return {name: float(np.median(values[names == name])) for name in dict.fromkeys(here.maps)}

    def placement_spreads(self, contender: str) -> dict[str, float]:
        """Return by map the median matched distance of ends from different starts, by a robot's share."""
        found: dict[str, list[float]] = {}
        ends = zip(self.scenarios, self.values.get((contender, "placement"), ()), strict=False)
        for (one, first), (other, second) in combinations(ends, 2):
            apart = one.map == other.map and one.start != other.start
            if apart and np.isfinite(first).all() and np.isfinite(second).all():
                found.setdefault(one.map, []).append(matched_distance(first, second))
        return {name: float(np.median(apart)) / self.sides[name] for name, apart in found.items()}

    def compared(self, first: str, second: str, measure: str = "final") -> Comparison | None:
        """Return how `first` compares with `second`; None where they never met."""
        fine = self.measured(measure, first, second)
        both = fine.of(first, measure), fine.of(second, measure)
        return Comparison(fine, first, *both) if fine.scenarios else None


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two contenders pair by pair, in the m scenarios in which both have a value."""

    fine: Outcomes
    first: str
    a: Array  # the first's values, (m,)
    b: Array  # the second's

    @cached_property
    def ratios(self) -> Array:
        return self.a / self.b

    @cached_property
    def ratio(self) -> Interval:
        return bootstrap(self.ratios, clusters=self.fine.maps)

    @cached_property
    def wins(self) -> Interval:
        """Share of pairs in which the first's value is the lower one; ties count half."""
        return share((self.a < self.b) + 0.5 * (self.a == self.b), self.fine.maps)


def joined(parts: Sequence[Outcomes]) -> Outcomes:
    """Return the outcomes of several sweeps, nan where a contender took no part; of two, the last counts."""
    scenarios = tuple(dict.fromkeys(scenario for part in parts for scenario in part.scenarios))
    place = {scenario: k for k, scenario in enumerate(scenarios)}
    values: dict[tuple[str, str], Array] = {}
    sides: dict[str, float] = {}
    for part in parts:
        rows = [place[scenario] for scenario in part.scenarios]
        for key, own in part.values.items():
            values.setdefault(key, np.full((len(scenarios), *own.shape[1:]), np.nan))[rows] = own
        sides |= part.sides
    return Outcomes(scenarios, values, sides)


@dataclass(frozen=True, eq=False)
class GainOutcomes:
    """Results of one controller in m scenarios with each of g sets of gains.

    `excess`, (g, m), is J/J_ref: the final mean distance by that of the map's centralised reference; nan
    where a run failed.
    """

    scenarios: tuple[Scenario, ...]
    gains: tuple[Mapping[str, Value], ...]
    excess: Array

    @property
    def maps(self) -> tuple[str, ...]:
        return tuple(scenario.map for scenario in self.scenarios)

    @property
    def complete(self) -> GainOutcomes:
        return self.where(np.asarray(np.isfinite(self.excess).all(axis=0)))

    def where(self, chosen: Sequence[bool] | BoolArray) -> GainOutcomes:
        kept = tuple(compress(self.scenarios, chosen))
        return GainOutcomes(kept, self.gains, self.excess[:, np.array(chosen, dtype=bool)])

    def best(self, columns: Sequence[int] | None = None) -> int:
        excess = self.excess if columns is None else self.excess[:, list(columns)]
        return int(np.argmin(excess[:, np.isfinite(excess).all(axis=0)].mean(axis=1)))

    def levels(self, gain: str) -> list[float]:
        return sorted({float(gains[gain] or 0.0) for gains in self.gains if gain in gains})

    def with_gain(self, name: str, value: float) -> GainOutcomes:
        chosen = [gains.get(name) == value for gains in self.gains]
        return GainOutcomes(self.scenarios, tuple(compress(self.gains, chosen)), self.excess[chosen])


def best_gains(found: Mapping[str, GainOutcomes]) -> dict[str, Mapping[str, Value]]:
    return {name: grid.gains[grid.best()] for name, grid in found.items() if grid.complete.scenarios}


def read_outcomes(folder: Path, contest: Contest, references: References) -> Outcomes:
    """Return what the contenders of a sweep reached; without a reference there is no gap on a map."""
    results, scenarios = read_results(folder), scenarios_of(contest.study)
    laws = {each.key: _law(each.controller, each.all_gains) for each in contest.contenders}
    measures = (*COLUMNS, "early", "first_minute", "gap")
    values = {(key, measure): np.full(len(scenarios), np.nan) for key in laws for measure in measures}
    values |= {(key, "placement"): np.full((len(scenarios), ROBOTS, 2), np.nan) for key in laws}
    for at, row in _rows(folder, scenarios):
        for key in (key for key, law in laws.items() if law == _law(row["controller"], row)):
            values[key, "placement"][at] = results.record(row["run"]).positions[-1]
            for measure, column in COLUMNS.items():
                if row.get(column) is not None:
                    values[key, measure][at] = row[column]
            history, reference = results.history(row["run"]), references.get(row["map"])
            values[key, "early"][at] = mean_until(history, EARLY)
            values[key, "first_minute"][at] = mean_until(history, FIRST_MINUTE)
            if reference is not None:
                values[key, "gap"][at] = values[key, "final"][at] / reference.mean_distance - 1.0
    sides = {each.name: float(np.sqrt(each.environment.free_area / ROBOTS)) for each in contest.study.maps}
    return Outcomes(scenarios, values, sides)


def read_gain_outcomes(folder: Path, study: Study, references: References) -> dict[str, GainOutcomes]:
    scenarios = scenarios_of(study)
    choices = {name: study.get_gains(name).choices for name in study.controllers}
    excess = {name: np.full((len(sets), len(scenarios)), np.nan) for name, sets in choices.items()}
    place = {_law(name, each): (name, k) for name, sets in choices.items() for k, each in enumerate(sets)}
    for at, row in _rows(folder, scenarios):
        known = place.get(_law(row["controller"], row))
        if known is not None and row["map"] in references:
            name, k = known
            excess[name][k, at] = row["mean_distance_m"] / references[row["map"]].mean_distance
    return {name: GainOutcomes(scenarios, choices[name], excess[name]) for name in study.controllers}


def scenarios_of(study: Study) -> tuple[Scenario, ...]:
    begins = [(each.name, start) for each in study.maps for start in study.list_starts(each)]
    return tuple(Scenario(*begin, seed) for begin in begins for seed in study.seeds)


def mean_until(history: CostHistory, until: float) -> float:
    """Return the mean distance, m, averaged by trapezoids over the time up to `until`, s, or the end."""
    end = min(until, float(history.time[-1]))
    inside = history.time < end
    time = np.append(history.time[inside], end)
    values = np.append(history.mean_distance[inside], np.interp(end, history.time, history.mean_distance))
    return float(np.trapezoid(values, time) / (time[-1] - time[0]) if len(time) > 1 else values[-1])


def matched_distance(first: Array, second: Array) -> float:
    """Return the mean distance, m, of robots of two placements (n, 2), matched so that its sum is least."""
    from scipy.optimize import linear_sum_assignment

    apart = np.hypot(*(first[:, None] - second[None]).transpose(2, 0, 1))
    return float(apart[linear_sum_assignment(apart)].mean())


def _rows(folder: Path, scenarios: Iterable[Scenario]) -> Iterator[tuple[int, dict[str, Any]]]:
    place = {scenario: k for k, scenario in enumerate(scenarios)}
    for row in read_results(folder).rows():
        at = place.get(Scenario(row["map"], row["start"], row["seed"]))
        if at is not None and row["error"] is None:
            yield at, row


def _law(controller: str, gains: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return what tells laws apart: the controller and the values of all its gains."""
    return (controller, *(gains[name] for name in get_gains(CONTROLLERS.get(controller))))
