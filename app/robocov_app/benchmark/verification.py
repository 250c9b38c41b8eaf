"""Verifying a result of the benchmark: a sample of its runs is executed again."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from robocov.errors import InputError
from robocov_app.benchmark.rated_controller import RatedController, Selection
from robocov_app.benchmark.results import Row, build_row, compute_gaps, read_result
from robocov_app.sweep.ledger import describe_version_differences
from robocov_app.sweep.local_pool import LocalPool
from robocov_app.sweep.progress import SweepProgress, report_progress
from robocov_app.sweep.study import Study
from robocov_app.sweep.sweeping import execute_tasks
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import EFFORT_FILE, Outcome
from robocov_app.terminal.interruption import Interruption

RunKey: TypeAlias = tuple[str, str, int]
"""Track, map and seed of a run."""
_MACHINE_DEPENDENT = ("deciding_s",)
"""Figures that differ from run to run, and are not compared."""


def verify_result(
    path: Path,
    *,
    controller: str | None = None,
    sample: int = 5,
    seed: int = 0,
    workers: int = 1,
    quiet: bool = False,
    stop: Interruption,
) -> tuple[int, list[str]]:
    """Verify a result by executing some of its runs again.

    The gaps of all rows are recomputed as well, and missing rows are found. No code that a result refers to
    is executed: the controller of a user has to be named, and its source code must have the digest of the
    result.

    Parameters
    ----------
    path : Path
        A result, or a folder that contains one.
    controller : str, optional
        The controller as ``FILE.py:CLASS``, if it is a user's.
    sample : int
        Number of runs to execute.
    seed : int
        Seed of the sample.
    workers : int
        Maximum number of processes.
    quiet : bool
        Show no progress.
    stop : Interruption

    Returns
    -------
    tuple of int and list of str
        Number of executed runs, and all differences.

    Raises
    ------
    InputError
        If the result cannot be read, or the controller is not the one that was rated.
    """
    result = read_result(path)
    studies = _build_studies(result, path, controller)
    tasks = _index_tasks(studies)
    rows = {(row["track"], row["map"], row["seed"]): row for row in result["rows"]}
    differences = list(_compare_without_running(result, rows, tasks))
    sampled = _sample_runs(rows.keys() & tasks.keys(), sample, seed)
    progress = SweepProgress(len(sampled))
    differences += _repeat_runs(
        {key: tasks[key] for key in sampled}, rows, progress, workers=workers, quiet=quiet, stop=stop
    )
    return progress.finished, list(dict.fromkeys(differences))


def _index_tasks(studies: Mapping[str, Study]) -> dict[RunKey, Task]:
    """Return the tasks of the sweeps of all tracks."""
    tasks = {}
    for track, study in studies.items():
        for task in generate_tasks(study):
            tasks[track, task.map, task.seed] = task
    return tasks


def _repeat_runs(
    tasks: Mapping[RunKey, Task],
    rows: Mapping[RunKey, Row],
    progress: SweepProgress,
    *,
    workers: int,
    quiet: bool,
    stop: Interruption,
) -> list[str]:
    """Execute tasks again, and list the differences from their rows."""
    differences: list[str] = []
    keys_by_name = {task.name: key for key, task in tasks.items()}

    def compare(task: Task, outcome: Outcome) -> None:
        key = keys_by_name[task.name]
        track = key[0]
        row = build_row(track, task, outcome, outcome.files.get(EFFORT_FILE, b"{}"))
        differences.extend(_list_differences(key, rows[key], row))

    def open_pool() -> LocalPool:
        return LocalPool(min(workers, len(tasks)))

    with report_progress("verify", progress, quiet=quiet) as reporter:
        for _ in execute_tasks(tasks.values(), open_pool, progress, stop, compare):
            reporter.update(progress)
    return differences


def _build_studies(result: Mapping[str, Any], path: Path, controller: str | None) -> dict[str, Study]:
    """Return the sweeps of a result by track, after checking that the controller is the rated one."""
    entry = result["entry"]
    name = controller or entry["controller"]
    if entry["source_sha256"] and controller is None:
        raise InputError(f"{path}: its controller {name} is a file; pass --controller FILE.py:CLASS")
    selected = result["selection"]
    selection = Selection(selected["quick"], tuple(selected["tracks"]), tuple(selected["maps"]))
    rated = RatedController(name, entry["set"])
    studies = dict(rated.build_studies(selection))
    any_study = next(iter(studies.values()))
    if rated.describe(any_study)["source_sha256"] != entry["source_sha256"]:
        raise InputError(f"{path}: --controller: {name} is not the source that was rated: its digest differs")
    return studies


def _compare_without_running(
    result: Mapping[str, Any], rows: Mapping[RunKey, Row], tasks: Mapping[RunKey, Task]
) -> Iterator[str]:
    """Yield the differences of versions, of the selection of runs, and of the gaps."""
    versions = describe_version_differences(result["versions"])
    if versions:
        yield f"made with {versions}"
    for key in tasks:
        if key not in rows:
            yield f"{_format_key(key)}: missing row"
    for key in rows:
        if key not in tasks:
            yield f"{_format_key(key)}: a row of a run that was not selected"
    for key, row in rows.items():
        if "error" not in row:
            yield from _list_differences(key, row, compute_gaps(row["track"], row["map"], row))


def _sample_runs(keys: Iterable[RunKey], sample: int, seed: int) -> list[RunKey]:
    """Return a random sample of runs in their sorted order."""
    ordered = sorted(keys)
    chosen = np.random.default_rng(seed).permutation(len(ordered))[:sample].tolist()
    return [ordered[k] for k in sorted(chosen)]


def _format_key(key: RunKey) -> str:
    track, map_name, seed = key
    return f"{track}, {map_name}, seed {seed}"


def _list_differences(key: RunKey, row: Row, recomputed: Mapping[str, Any]) -> list[str]:
    return [
        f"{_format_key(key)}: {name}: expected {value}, got {row.get(name)}"
        for name, value in recomputed.items()
        if name not in _MACHINE_DEPENDENT and row.get(name) != value
    ]
