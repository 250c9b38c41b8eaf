"""Reading the outcomes of a sweep from its table and its records."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import shapely

from robocov.controllers import CONTROLLERS, get_gains
from robocov.metrics.results import Results, read_results
from robocov.record import Record
from robocov_app.replication.design.plan import ROBOTS
from robocov_app.replication.design.studies import Contest
from robocov_app.replication.results.outcomes import (
    GainOutcomes,
    Outcomes,
    ProblemInstance,
    compute_mean_until,
)
from robocov_app.replication.results.references import References
from robocov_app.sweep.study.study import Study

EARLY_S = 20.0
"""Time in which a team spreads over a convex region of ten meters; Lloyd's algorithm has settled by then."""
FIRST_MINUTE_S = 60.0
"""Time that counts as "during the motion"."""

COLUMNS = {
    "final": "mean_distance_m",
    "contacts": "contacts",
    "clearance": "min_clearance_m",
    "settled": "settled_at_s",
    "time": "mean_time_s",
    "path": "path_length_m",
    "over_run": "mean_distance_over_run_m",
    "work": "work_J",
}
"""Columns of a sweep's table by measure; "time" is only available for robots of different speeds."""

_COMPUTED_MEASURES = ("early", "first_minute", "gap", "blocked")
"""Measures of a run that are not in the table of its sweep; see `Outcomes`."""

_ControllerKey: TypeAlias = tuple[Any, ...]
"""A controller and the values of all its gains."""


def read_outcomes(folder: Path, contest: Contest, references: References) -> Outcomes:
    """Read the outcomes of each contender of a sweep.

    Parameters
    ----------
    folder : Path
        Folder of the sweep.
    contest : Contest
    references : dict
        Reference placements by map; on maps without one, the gap is nan.

    Returns
    -------
    Outcomes
    """
    results = read_results(folder)
    instances = list_instances(contest.study)
    controller_keys = {
        contender.key: _identify_controller(contender.controller, contender.all_gains)
        for contender in contest.contenders
    }
    # The values of failed runs, and of measures that are unknown, stay nan.
    values = {}
    for key in controller_keys:
        for measure in (*COLUMNS, *_COMPUTED_MEASURES):
            values[key, measure] = np.full(len(instances), np.nan)
        values[key, "placement"] = np.full((len(instances), ROBOTS, 2), np.nan)
    for instance_index, row in _read_rows(folder, instances):
        controller_key = _identify_controller(row["controller"], row)
        # Several contenders may have the same controller and gains.
        matching_keys = [key for key, candidate in controller_keys.items() if candidate == controller_key]
        if not matching_keys:
            continue
        measured = _measure_run(row, results, references)
        for key in matching_keys:
            for measure, value in measured.items():
                values[key, measure][instance_index] = value
    length_scale_by_map = {}
    for study_map in contest.study.maps:
        area_per_robot = study_map.environment.free_area / ROBOTS
        length_scale_by_map[study_map.name] = float(np.sqrt(area_per_robot))
    return Outcomes(instances, values, length_scale_by_map)


def _measure_run(row: Mapping[str, Any], results: Results, references: References) -> dict[str, Any]:
    """Return the known measures of a run: those in its row, and those computed from its record and costs."""
    measured: dict[str, Any] = {
        measure: row[column] for measure, column in COLUMNS.items() if row.get(column) is not None
    }
    record = results.record(row["run"])
    measured["placement"] = record.positions[-1]
    measured["blocked"] = compute_blocked_fraction(record)
    history = results.history(row["run"])
    measured["early"] = compute_mean_until(history, EARLY_S)
    measured["first_minute"] = compute_mean_until(history, FIRST_MINUTE_S)
    reference = references.get(row["map"])
    if reference is not None and "final" in measured:
        measured["gap"] = measured["final"] / reference.mean_distance - 1.0
    return measured


def compute_blocked_fraction(record: Record) -> float:
    """Compute the fraction of robots that have a wall between them and their goals at the end of a run.

    Parameters
    ----------
    record : Record

    Returns
    -------
    float
        nan if no robot has a goal.
    """
    goals = record.goals[-1]
    has_goal = ~np.isnan(goals).any(axis=1)
    if not has_goal.any():
        return float("nan")
    lines = shapely.linestrings(np.stack([record.positions[-1], goals], axis=1)[has_goal])
    return float(np.mean(~shapely.covers(record.environment.free, lines)))


def read_gain_outcomes(folder: Path, study: Study, references: References) -> dict[str, GainOutcomes]:
    """Read the outcomes of a gain grid.

    Parameters
    ----------
    folder : Path
        Folder of the sweep.
    study : Study
    references : dict
        Reference placements by map; on maps without one, the relative cost is nan.

    Returns
    -------
    dict
        Outcomes by controller.
    """
    instances = list_instances(study)
    gain_sets = {name: study.get_gains(name).choices for name in study.controllers}
    relative_costs = {name: np.full((len(sets), len(instances)), np.nan) for name, sets in gain_sets.items()}
    indices_by_key = {}
    for name, sets in gain_sets.items():
        for gains_index, gains in enumerate(sets):
            indices_by_key[_identify_controller(name, gains)] = (name, gains_index)
    for instance_index, row in _read_rows(folder, instances):
        indices = indices_by_key.get(_identify_controller(row["controller"], row))
        if indices is not None and row["map"] in references:
            name, gains_index = indices
            relative_costs[name][gains_index, instance_index] = (
                row["mean_distance_m"] / references[row["map"]].mean_distance
            )
    return {
        name: GainOutcomes(instances, gain_sets[name], relative_costs[name]) for name in study.controllers
    }


def list_instances(study: Study) -> tuple[ProblemInstance, ...]:
    """Return the problem instances of a sweep: all combinations of maps, starts and seeds."""
    instances: list[ProblemInstance] = []
    for study_map in study.maps:
        for start in study.list_starts(study_map):
            instances += [ProblemInstance(study_map.name, start, seed) for seed in study.seeds]
    return tuple(instances)


def _read_rows(folder: Path, instances: Iterable[ProblemInstance]) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the table rows of runs that did not fail, each with the index of its instance."""
    indices = {instance: index for index, instance in enumerate(instances)}
    for row in read_results(folder).rows():
        index = indices.get(ProblemInstance(row["map"], row["start"], row["seed"]))
        if index is not None and row["error"] is None:
            yield index, row


def _identify_controller(controller: str, gains: Mapping[str, Any]) -> _ControllerKey:
    """Return a key for a controller and all its gains, which are among the given values by name."""
    return (controller, *(gains[name] for name in get_gains(CONTROLLERS.get(controller))))
