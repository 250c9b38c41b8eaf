"""Reading the folder of a run, a comparison or a sweep for a report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from robocov.controllers import CONTROLLERS, get_gains
from robocov.controllers.gains import Value
from robocov.controllers.registry import get_controller_label
from robocov.environment import Environment
from robocov.errors import InputError, RobocovError, is_number
from robocov.files.documents import read_document, read_json_object
from robocov.files.result_folder import complete_commit, require_result
from robocov.files.result_names import COMPARISON_FILE, RUN_FILE, RUNS_FOLDER, STUDY_FILE
from robocov.mapfile import from_json
from robocov.metrics import CostHistory, compute_mean_over_run
from robocov.metrics.results import read_results
from robocov_app.report.results.result import (
    METRIC_NAMES,
    DamagedRun,
    Gains,
    ReportedResult,
    ReportedRun,
    ResultKind,
    describe_damage,
    replace_unprintable,
)
from robocov_app.runs.saved_runs import (
    COMPARISON_FORMAT,
    COMPARISON_VERSION,
    ComparisonDocument,
    SavedRun,
    build_roster,
    load_saved_runs,
)
from robocov_app.sweep.study.parameters import UNITS, name_parameter_column
from robocov_app.sweep.table import get_gain_column


def load_result(folder: Path) -> ReportedResult:
    """Load the result in a folder.

    Parameters
    ----------
    folder : Path
        The folder of a run, a comparison or a sweep.

    Returns
    -------
    ReportedResult

    Raises
    ------
    InputError
        If the folder contains no result, or if the result cannot be read.
    """
    if folder.is_dir():
        if (folder / STUDY_FILE).is_file():
            return _load_sweep(folder)
        complete_commit(folder)
    marks = (RUN_FILE, COMPARISON_FILE, STUDY_FILE)
    require_result(folder, "the folder of a run, comparison or sweep", marks)
    return _load_runs(folder)


def _load_runs(folder: Path) -> ReportedResult:
    """Load a run, or the runs of a comparison; runs that cannot be read are listed as damaged."""
    kind: ResultKind = "run"
    run_folders = [folder]
    is_unfinished = False
    path = folder / COMPARISON_FILE
    if path.is_file():
        kind = "comparison"
        document = read_document(path, ComparisonDocument, COMPARISON_FORMAT, COMPARISON_VERSION)
        run_folders = [folder / name for name in document.folders]
        is_unfinished = not document.runs
    started_folders = run_folders
    if is_unfinished:
        started_folders = [run_folder for run_folder in run_folders if (run_folder / RUN_FILE).is_file()]
    saved_runs, damaged_runs = _read_runs(started_folders)
    if not saved_runs and not damaged_runs:
        raise InputError(f"{path}: expected at least one run, got none")
    runs = []
    maps: dict[str, Environment] = {}
    facts: dict[str, Any] = {}
    for saved_run in saved_runs:
        content = read_json_object(saved_run.folder / RUN_FILE)
        run = _build_run(saved_run, content)
        runs.append(run)
        maps.setdefault(run.map, build_roster(saved_run.record).environment)
        if not facts:
            facts = _collect_run_facts(saved_run, content)
    gain_units, gain_meanings = _collect_gain_texts(runs, {})
    return ReportedResult(
        kind=kind,
        folder=folder,
        runs=_number_labels(runs),
        maps=maps,
        expected_count=len(run_folders),
        gain_units=gain_units,
        gain_meanings=gain_meanings,
        facts=facts,
        loaded={saved_run.folder: saved_run for saved_run in saved_runs},
        damaged_runs=tuple(damaged_runs),
    )


def _read_runs(folders: Sequence[Path]) -> tuple[list[SavedRun], list[DamagedRun]]:
    """Read the runs in folders, which must all have the same map; return readable and damaged runs."""
    saved_runs: list[SavedRun] = []
    damaged_runs: list[DamagedRun] = []
    for folder in folders:
        try:
            saved_run = load_saved_runs(folder)[0]
            if saved_runs:
                _check_same_map(saved_run, saved_runs[0])
            saved_runs.append(saved_run)
        except InputError as error:
            damaged_runs.append(describe_damage(folder, error))
    return saved_runs, damaged_runs


def _check_same_map(saved_run: SavedRun, first_run: SavedRun) -> None:
    """Raise InputError if a run does not have the same map as the first run of its comparison."""
    environment = build_roster(saved_run.record).environment
    first_environment = build_roster(first_run.record).environment
    if not environment.has_same_geometry(first_environment):
        path = saved_run.folder / RUN_FILE
        raise InputError(f"{path}: expected the same map as in {first_run.folder.name}")


def _build_run(saved_run: SavedRun, content: Mapping[str, Any]) -> ReportedRun:
    """Build a run from its record and the content of its ``run.json``."""
    record = saved_run.record
    return ReportedRun(
        map=replace_unprintable(record.environment.name),
        controller=record.controller,
        label=replace_unprintable(record.label),
        robots=len(record.team),
        team=(),
        start=None if record.start is None else replace_unprintable(str(record.start)),
        seed=record.seed,
        gains=_list_gains(record.gains),
        metrics=_read_metrics(content.get("summary"), saved_run.history),
        error=None,
        folder=saved_run.folder,
    )


def _collect_run_facts(saved_run: SavedRun, content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts that all runs of a comparison have in common, from one of them."""
    time = saved_run.record.time
    facts: dict[str, Any] = {
        "duration_s": float(time[-1] - time[0]),
        "dt_s": saved_run.record.dt,
    }
    for name in ("lattice", "team", "versions"):
        facts[name] = content.get(name)
    return facts


@dataclass(frozen=True)
class _SweepStudy:
    """The parts of a sweep's study that a report needs.

    Attributes
    ----------
    maps : dict of str to Environment
    gain_names : dict of str to list of str
        Names of the gains of each controller.
    teams : list of dict
        Parameters of each team, keyed by name.
    run_count : int
    facts : dict
        See `ReportedResult`.
    """

    maps: dict[str, Environment]
    gain_names: dict[str, list[str]]
    teams: list[dict[str, Any]]
    run_count: int
    facts: dict[str, Any]

    @cached_property
    def varying_parameters(self) -> list[str]:
        """Names of the team parameters that have several values."""
        return [name for name in UNITS if len({team.get(name) for team in self.teams}) > 1]


def _load_sweep(folder: Path) -> ReportedResult:
    """Load the runs of a sweep from its table."""
    results = read_results(folder)
    study = _read_study(results.study, folder / STUDY_FILE)
    rows = list(results.rows())
    if not rows:
        raise InputError(
            f"{folder}: none of the {study.run_count} runs has finished; continue the sweep before the report"
        )
    runs = [_build_run_of_row(row, study, folder) for row in rows]
    facts = dict(study.facts)
    if study.teams:
        varying_parameters = study.varying_parameters
        first_team = study.teams[0].items()
        facts["team"] = {name: value for name, value in first_team if name not in varying_parameters}
    facts["versions"] = _read_versions(runs)
    gain_units, gain_meanings = _collect_gain_texts(runs, _read_gain_columns(results.study, study))
    return ReportedResult(
        kind="sweep",
        folder=folder,
        runs=_number_labels(runs),
        maps={replace_unprintable(name): environment for name, environment in study.maps.items()},
        expected_count=study.run_count,
        gain_units=gain_units,
        gain_meanings=gain_meanings,
        facts=facts,
        loaded={},
    )


def _read_study(content: Mapping[str, Any], path: Path) -> _SweepStudy:
    """Read the content of ``study.json``."""
    try:
        maps = {}
        for map_content in content["maps"]:
            maps[str(map_content["name"])] = from_json(map_content["map"], f"{path}: maps")
        gain_names = {}
        for controller, gains in content["gains"].items():
            # All sets of gains of a controller have the same names.
            gain_names[controller] = list(gains["choices"][0])
        fact_names = ("duration_s", "dt_s", "lattice", "cost_hz", "record_hz")
        return _SweepStudy(
            maps=maps,
            gain_names=gain_names,
            teams=[dict(team) for team in content["teams"]],
            run_count=int(content["runs"]),
            facts={name: content.get(name) for name in fact_names},
        )
    except RobocovError:
        raise
    except Exception as error:
        raise InputError(f"{path}: the study cannot be read: {type(error).__name__}: {error}") from error


def _build_run_of_row(row: Mapping[str, Any], study: _SweepStudy, folder: Path) -> ReportedRun:
    """Build a run from its row in the table of a sweep."""
    controller = str(row["controller"])
    error = row["error"]
    if error is None:
        metrics = {name: row.get(name) for name in METRIC_NAMES}
        error_text = None
    else:
        metrics = {}
        error_text = replace_unprintable(str(error))
    gain_names = study.gain_names.get(controller, ())
    team = [(name, row.get(name_parameter_column(name))) for name in study.varying_parameters]
    return ReportedRun(
        map=replace_unprintable(str(row["map"])),
        controller=controller,
        label=replace_unprintable(get_controller_label(controller)),
        robots=int(row["robots"]),
        team=tuple(team),
        start=replace_unprintable(str(row["start"])),
        seed=row["seed"],
        gains=_list_gains({name: row.get(get_gain_column(name)) for name in gain_names}),
        metrics=metrics,
        error=error_text,
        folder=folder / RUNS_FOLDER / Path(str(row["run"])).name,
    )


def _read_versions(runs: Iterable[ReportedRun]) -> Any:
    """Return the versions of packages in the first completed run that has a readable ``run.json``."""
    for run in runs:
        if run.error is not None:
            continue
        try:
            return read_json_object(run.folder / RUN_FILE).get("versions")
        except InputError:
            continue
    return None


def _read_gain_columns(content: Mapping[str, Any], study: _SweepStudy) -> dict[str, tuple[str, str]]:
    """Return the unit and the meaning of each gain, from the column descriptions of a sweep."""
    columns = {}
    for column in content.get("columns", ()):
        columns[column["name"]] = (column["unit"], column["meaning"])
    texts = {}
    for names in study.gain_names.values():
        for name in names:
            texts[name] = columns.get(get_gain_column(name), ("", ""))
    return texts


def _number_labels(runs: Sequence[ReportedRun]) -> tuple[ReportedRun, ...]:
    """Distinguish controllers with the same label by numbers: "Mine", "Mine #2", ..."""
    labels: dict[str, str] = {}
    for run in runs:
        if run.controller in labels:
            continue
        label = run.label
        same_labels = [other for other in labels.values() if other.partition(" #")[0] == run.label]
        if same_labels:
            label += f" #{len(same_labels) + 1}"
        labels[run.controller] = label
    return tuple(replace(run, label=labels[run.controller]) for run in runs)


def _list_gains(gains: Mapping[str, Value]) -> Gains:
    """Return gains as pairs of name and value, with unprintable characters replaced."""
    pairs: list[tuple[str, Value]] = []
    for name, value in gains.items():
        if isinstance(value, str):
            value = replace_unprintable(value)
        pairs.append((replace_unprintable(name), value))
    return tuple(pairs)


def _collect_gain_texts(
    runs: Sequence[ReportedRun], columns: Mapping[str, tuple[str, str]]
) -> tuple[dict[str, str], dict[str, str]]:
    """Return the units and the meanings of gains.

    Those of built-in controllers take precedence over those in the columns of a sweep's table.
    """
    controllers = dict.fromkeys(run.controller for run in runs if run.controller in CONTROLLERS)
    units: dict[str, str] = {}
    meanings: dict[str, str] = {}
    for controller in controllers:
        for name, gain in get_gains(CONTROLLERS[controller]).items():
            units[name] = gain.unit
            meanings[name] = gain.meaning
    for name, (unit, meaning) in columns.items():
        if unit or meaning:
            # The unit "1" stands for a number without a unit.
            units.setdefault(name, "" if unit == "1" else replace_unprintable(unit))
            meanings.setdefault(name, replace_unprintable(meaning))
    return units, meanings


def _read_metrics(summary: Any, history: CostHistory | None) -> dict[str, float | None]:
    """Return the metrics of a run from its summary; missing ones are computed from its cost over time."""
    values = summary if isinstance(summary, dict) else {}
    metrics: dict[str, float | None] = {}
    for name in METRIC_NAMES:
        value = values.get(name)
        if name == "path_length_m" and isinstance(value, list) and value and all(map(is_number, value)):
            value = sum(value) / len(value)
        metrics[name] = value if is_number(value) else None
    if history is None or not len(history.time):
        return metrics
    final_distance = float(history.mean_distance[-1])
    if metrics["mean_distance_m"] is None and np.isfinite(final_distance):
        metrics["mean_distance_m"] = final_distance
    if metrics["mean_distance_over_run_m"] is None and np.isfinite(history.mean_distance).all():
        metrics["mean_distance_over_run_m"] = compute_mean_over_run(history.time, history.mean_distance)
    return metrics
