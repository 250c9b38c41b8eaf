"""From the folders of sweeps to outcomes: which row of a table is whose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.metrics.results import read_results
from robocov_app.replication.claims import EARLY, FIRST_MINUTE
from robocov_app.replication.contenders import Contender
from robocov_app.replication.maps import side_of_share
from robocov_app.replication.outcomes import GainOutcomes, Outcomes, Scenario
from robocov_app.replication.plan import ROBOTS, complete_gains

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov.metrics import CostHistory
    from robocov.metrics.results import Results
    from robocov_app.replication.references import Reference
    from robocov_app.sweep.study import Study

_MEASURES = {
    "final": "mean_distance_m",
    "contacts": "contacts",
    "stuck": "stuck_robots",
    "settled": "settled_at_s",
    "clearance": "min_clearance_m",
    "path": "path_length_m",
}
"""Measures that stand in the table, and their columns."""


def read_outcomes(
    folder: Path,
    study: Study,
    contenders: Sequence[Contender],
    references: Mapping[str, Reference],
) -> Outcomes:
    """Return what the contenders of a study reached.

    Parameters
    ----------
    folder : Path
        Of the sweep.
    study : Study
    contenders : sequence of Contender
    references : dict of map to Reference
        Those of the study's maps; without one there is no gap on a map.

    Raises
    ------
    InputError
        When the results cannot be read.
    """
    results = read_results(folder)
    scenarios = scenarios_of(study)
    place = {scenario: k for k, scenario in enumerate(scenarios)}
    wanted: dict[Any, list[str]] = {}
    for contender in contenders:
        wanted.setdefault(_law(contender.controller, complete_gains(contender)), []).append(contender.key)
    measures = (*_MEASURES, "early", "first_minute", "gap")
    values = {
        (each.key, measure): np.full(len(scenarios), np.nan) for each in contenders for measure in measures
    }
    placements = {each.key: np.full((len(scenarios), ROBOTS, 2), np.nan) for each in contenders}
    for row in _rows(results):
        at = place.get(Scenario(row["map"], row["start"], row["seed"]))
        keys = wanted.get(_law(row["controller"], row), ())
        if at is None or not keys or row["error"] is not None:
            continue
        found = _measured(row, results.history(row["run"]), references.get(row["map"]))
        ends = results.record(row["run"]).positions[-1]
        for key in keys:
            placements[key][at] = ends
            for measure, value in found.items():
                values[key, measure][at] = value
    shares = {each.name: side_of_share(each.environment, ROBOTS) for each in study.maps}
    return Outcomes(scenarios, values, placements, shares)


def read_gain_outcomes(
    folder: Path, study: Study, references: Mapping[str, Reference]
) -> dict[str, GainOutcomes]:
    """Return what each law of a study reached with every set of its gains.

    Raises
    ------
    InputError
        When the results cannot be read.
    """
    results = read_results(folder)
    scenarios = scenarios_of(study)
    place = {scenario: k for k, scenario in enumerate(scenarios)}
    excess: dict[str, Array] = {}
    order: dict[str, dict[Any, int]] = {}
    for controller in study.controllers:
        choices = study.gains_of(controller).choices
        order[controller] = {_law(controller, choice): k for k, choice in enumerate(choices)}
        excess[controller] = np.full((len(choices), len(scenarios)), np.nan)
    for row in _rows(results):
        at = place.get(Scenario(row["map"], row["start"], row["seed"]))
        set_ = order.get(row["controller"], {}).get(_law(row["controller"], row))
        reference = references.get(row["map"])
        if at is not None and set_ is not None and reference is not None and row["error"] is None:
            excess[row["controller"]][set_, at] = row["mean_distance_m"] / reference.mean_distance
    return {
        controller: GainOutcomes(scenarios, study.gains_of(controller).choices, excess[controller])
        for controller in study.controllers
    }


def scenarios_of(study: Study) -> tuple[Scenario, ...]:
    """Return the scenarios of a study, in the order of its table."""
    return tuple(
        Scenario(each.name, start, seed)
        for each in study.maps
        for start in study.starts_on(each)
        for seed in study.seeds
    )


def mean_until(history: CostHistory, until: float) -> float:
    """Return the mean distance averaged over the time up to `until`, s, by the trapezoidal rule; m.

    A run that ends before is averaged over all of it.
    """
    end = min(until, float(history.time[-1]))
    inside = history.time < end
    time = np.append(history.time[inside], end)
    values = np.append(history.mean_distance[inside], np.interp(end, history.time, history.mean_distance))
    if len(time) < 2:
        return float(values[-1])
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def _measured(row: Mapping[str, Any], history: CostHistory, reference: Reference | None) -> dict[str, float]:
    found = {
        measure: np.nan if row[column] is None else float(row[column])
        for measure, column in _MEASURES.items()
    }
    found["early"] = mean_until(history, EARLY)
    found["first_minute"] = mean_until(history, FIRST_MINUTE)
    if reference is not None:
        found["gap"] = found["final"] / reference.mean_distance - 1.0
    return found


def _rows(results: Results) -> Iterator[dict[str, Any]]:
    for batch in results.batches():
        yield from batch.to_pylist()


def _law(controller: str, gains: Mapping[str, Any]) -> tuple[Any, ...]:
    """Return what tells laws apart: the controller and the values of all its gains."""
    from robocov.controllers import CONTROLLERS, gains_of

    return (controller, *(gains[name] for name in gains_of(CONTROLLERS.get(controller))))
