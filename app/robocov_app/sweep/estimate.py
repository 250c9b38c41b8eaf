"""Estimate of the computing time and disk space that a sweep needs, from a trial run of each controller."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path
from time import perf_counter

from robocov_app.sweep.ledger import Ledger
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import Outcome, perform, prepare_cost

_FIRST_TRIAL_S = 1.0
"""Simulation time of the first trial of a controller, which shows how much of a run can be measured."""
_MAX_TRIAL_SECONDS = 4.0
"""Maximum computing time for the measurement of a controller."""
_MAX_TOTAL_SECONDS = 30.0
"""Maximum computing time for the measurements of all controllers."""


@dataclass(frozen=True)
class ControllerEstimate:
    """Estimate of the runs of one controller.

    Attributes
    ----------
    runs : int
        Number of its runs.
    left : int
        Number of its runs that remain to be executed.
    run : str
        Name of the trial run.
    error : str or None
        Reason why the trial run failed; None if it did not.
    seconds_per_run : float, s
        Computing time of a run. If a run takes longer than the time for a trial, only its start is measured.
    bytes_per_run : int
        Size of the files of a run, for the mean number of robots.
    """

    runs: int
    left: int
    run: str
    error: str | None
    seconds_per_run: float
    bytes_per_run: int


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
    controllers : dict of str to ControllerEstimate
        Estimate for each controller.
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
    controllers: dict[str, ControllerEstimate]
    seconds: float
    total_bytes: int
    notes: list[str]


def estimate_sweep(
    study: Study, folder: Path, *, workers: int, retry_failed: bool = False, keep_versions: bool = False
) -> SweepEstimate:
    """Estimate a sweep from one of the remaining runs of each controller, without writing anything.

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
    counts = Counter(task.controller for task in generate_tasks(study))
    left_counts = Counter(task.controller for task in compress(generate_tasks(study), survey.must_execute))
    trials = _select_middle_tasks(generate_tasks(study), counts)
    trials |= _select_middle_tasks(compress(generate_tasks(study), survey.must_execute), left_counts)
    max_seconds = min(_MAX_TRIAL_SECONDS, _MAX_TOTAL_SECONDS / len(trials))
    # Every controller has runs with each number of robots.
    mean_robots = sum(study.robots) / len(study.robots)
    controllers = {
        controller: _estimate_controller(
            task,
            runs=counts[controller],
            left=left_counts[controller],
            mean_robots=mean_robots,
            max_seconds=max_seconds,
        )
        for controller, task in trials.items()
    }
    left = left_counts.total()
    parallel_runs = max(1, min(workers, left))
    seconds = sum(estimate.left * estimate.seconds_per_run for estimate in controllers.values())
    total_bytes = sum(estimate.runs * estimate.bytes_per_run for estimate in controllers.values())
    return SweepEstimate(
        runs=len(study),
        left=left,
        axes=count_axes(study),
        controllers=controllers,
        seconds=seconds / parallel_runs,
        total_bytes=total_bytes,
        notes=survey.describe(keep_versions=keep_versions),
    )


def _select_middle_tasks(tasks: Iterable[Task], counts: Counter[str]) -> dict[str, Task]:
    """Return the task in the middle of those of each controller.

    Parameters
    ----------
    tasks : iterable of Task
    counts : Counter
        Number of tasks of each controller.
    """
    middle_tasks = {}
    seen_counts: Counter[str] = Counter()
    for task in tasks:
        if seen_counts[task.controller] == counts[task.controller] // 2:
            middle_tasks[task.controller] = task
        seen_counts[task.controller] += 1
    return middle_tasks


def _estimate_controller(
    task: Task, *, runs: int, left: int, mean_robots: float, max_seconds: float
) -> ControllerEstimate:
    """Estimate the runs of a controller from one of its tasks."""
    # Not timed: the coverage cost is prepared only once for all runs on a map.
    prepare_cost(task)
    # Its time is not used for the estimate: the first steps of a controller may compile kernels.
    first_duration = min(task.duration, _FIRST_TRIAL_S)
    started = perf_counter()
    first_outcome = perform(replace(task, duration=first_duration))
    first_seconds = perf_counter() - started
    duration = min(task.duration, max(first_duration, first_duration * max_seconds / first_seconds))
    started = perf_counter()
    outcome = perform(replace(task, duration=duration))
    seconds = perf_counter() - started
    size = _measure_files(outcome)
    if duration > first_duration:
        # A part of the files grows with the duration, the rest does not.
        growth = (size - _measure_files(first_outcome)) / (duration - first_duration)
        size += round(growth * (task.duration - duration))
    # The files consist mainly of the trajectories of the robots.
    size = round(size * mean_robots / task.robots)
    return ControllerEstimate(
        runs=runs,
        left=left,
        run=task.name,
        error=outcome.error,
        seconds_per_run=seconds * task.duration / duration,
        bytes_per_run=size,
    )


def _measure_files(outcome: Outcome) -> int:
    """Return the size of the files of a run, bytes."""
    return sum(len(content) for content in outcome.files.values())


def count_axes(study: Study) -> dict[str, int]:
    """Return the number of values of each parameter of a study, by its name."""
    counts = {name: len(getattr(study, name)) for name in ("maps", "robots", "teams")}
    counts["starts"] = sum(len(study.list_starts(study_map)) for study_map in study.maps)
    counts["seeds"] = len(study.seeds)
    counts["controllers"] = len(study.controllers)
    for controller in study.controllers:
        counts[f"sets of gains of {controller}"] = len(study.get_gains(controller).choices)
    return counts
