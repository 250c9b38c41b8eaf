"""Estimate of the computing time and disk space that a sweep needs, from one of its runs."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import compress
from pathlib import Path

from robocov_app.sweep.ledger import Ledger
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.sweep.worker import perform, prepare_cost


@dataclass(frozen=True)
class SweepEstimate:
    """Estimate of a sweep.

    Attributes
    ----------
    runs : int
        Number of all runs.
    left : int
        Number of runs that remain to be executed.
    axes : dict of str to int
        Number of values of each parameter.
    run : str
        Name of the trial run.
    error : str or None
        Reason why the trial run failed; None if it did not.
    seconds_per_run : float, s
        Computing time of the trial run.
    bytes_per_run : int
        Size of the files of the trial run.
    seconds : float, s
        Estimated time for all remaining runs.
    total_bytes : int
        Estimated size of the files of all runs.
    notes : list of str
        Remarks on runs that were executed earlier.
    """

    runs: int
    left: int
    axes: dict[str, int]
    run: str
    error: str | None
    seconds_per_run: float
    bytes_per_run: int
    seconds: float
    total_bytes: int
    notes: list[str]


def estimate_sweep(
    study: Study, folder: Path, *, workers: int, retry_failed: bool = False, keep_versions: bool = False
) -> SweepEstimate:
    """Estimate a sweep from its first remaining run, without writing anything.

    Parameters
    ----------
    study : Study
        The sweep to estimate.
    folder : Path
        Folder of the sweep; it need not exist.
    workers : int
        Number of runs that are executed at the same time.
    retry_failed, keep_versions : bool
        See `robocov_app.sweep.sweeping.sweep`.

    Returns
    -------
    SweepEstimate
    """
    survey = Ledger(folder).survey(
        generate_tasks(study), retry_failed=retry_failed, keep_versions=keep_versions
    )
    left = sum(survey.must_execute)
    # If no run remains, the very first one is measured.
    task = next(compress(generate_tasks(study), survey.must_execute), None) or next(generate_tasks(study))
    # Not timed: the coverage cost is prepared only once for all runs on a map.
    prepare_cost(task)
    started = time.perf_counter()
    outcome = perform(task)
    seconds = time.perf_counter() - started
    size = sum(len(content) for content in outcome.files.values())
    parallel_runs = max(1, min(workers, left))
    return SweepEstimate(
        runs=len(study),
        left=left,
        axes=count_axes(study),
        run=task.name,
        error=outcome.error,
        seconds_per_run=seconds,
        bytes_per_run=size,
        seconds=seconds * left / parallel_runs,
        total_bytes=size * len(study),
        notes=survey.describe(keep_versions=keep_versions),
    )


def count_axes(study: Study) -> dict[str, int]:
    """Return the number of values of each parameter of a study, by its name."""
    counts = {name: len(getattr(study, name)) for name in ("maps", "robots", "teams")}
    counts["starts"] = sum(len(study.list_starts(study_map)) for study_map in study.maps)
    counts["seeds"] = len(study.seeds)
    counts["controllers"] = len(study.controllers)
    for controller in study.controllers:
        counts[f"gains of {controller}"] = len(study.get_gains(controller).choices)
    return counts
