"""A sweep: executes the remaining tasks, stores their results and writes the table."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import compress, takewhile
from pathlib import Path

from robocov.errors import OutputError, RobocovError, require_number
from robocov.kernel_compilation import compile_kernels
from robocov_app.sweep.cluster import Cluster
from robocov_app.sweep.executor import Executor
from robocov_app.sweep.ledger import Ledger, Survey, describe_version_differences, open_ledger
from robocov_app.sweep.local_pool import LocalPool, count_processors
from robocov_app.sweep.progress import ProgressReporter, SweepProgress, report_progress
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.table import Table, build_columns, build_row
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import Outcome
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import format_json

MAX_WORKERS = 1024
"""Maximum number of processes on this machine."""
_CHECK_INTERVAL_S = 0.2
"""Time between two checks for an interruption."""
_MAX_ERRORS = 3
"""Maximum number of different run errors that are reported."""


@dataclass
class Totals:
    """Totals of the runs of a study.

    Attributes
    ----------
    done : int
        Number of runs that were completed in this call.
    failed : int
        Number of runs that failed, in this call or earlier.
    reused : int
        Number of runs that were completed earlier.
    interrupted : bool
        Whether runs remain to be executed.
    errors : dict of str to str
        The first different errors, by the name of a run with this error.
    damaged : list of str
        Names of runs whose folders were damaged.
    versions : dict of str to int
        Number of runs by the versions with which they were executed.
    table_replaced : bool
        Whether the table contains these runs; an interrupted sweep does not replace a longer table.
    """

    done: int
    failed: int
    reused: int
    interrupted: bool
    errors: dict[str, str] = field(default_factory=dict, compare=False)
    damaged: list[str] = field(default_factory=list, compare=False)
    versions: dict[str, int] = field(default_factory=dict, compare=False)
    table_replaced: bool = field(default=True, compare=False)


def sweep(
    study: Study,
    folder: Path | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    retry_failed: bool = False,
    keep_versions: bool = False,
    parquet: bool = False,
    quiet: bool = False,
    title: str = "sweep",
    stop: Interruption | None = None,
) -> Totals:
    """Execute the remaining runs of a study, and write its table.

    After an interruption, the same call resumes the sweep, and the final table is the same, byte for byte.

    Parameters
    ----------
    study : Study
        Definition of the runs.
    folder : Path or str
        Folder of the sweep; it is created if necessary.
    workers : int, optional
        Number of processes on this machine; by default one per processor.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers execute the runs instead of local processes.
    retry_failed : bool
        Whether failed runs are repeated.
    keep_versions : bool
        Whether runs that were made with other versions are reused; by default they are repeated.
    parquet : bool
        Whether the table is also written as ``results.parquet``, which needs ``robocov[parquet]``.
    quiet : bool
        Whether no progress is printed.
    title : str
        Title of the progress display.
    stop : Interruption, optional
        Ends the sweep early when it is requested; by default by Ctrl+C.

    Returns
    -------
    Totals

    Raises
    ------
    InputError
        If the folder contains anything other than a sweep, or the scheduler cannot be reached.
    OutputError
        If workers end repeatedly, or something cannot be written. Finished runs are kept.
    """
    if workers is not None:
        require_number("workers", workers, 1, MAX_WORKERS, whole=True)
    with ExitStack() as stack:
        interruption = stack.enter_context(Interruption()) if stop is None else stop
        ledger, table = stack.enter_context(_open_results(study, Path(folder), parquet=parquet))
        progress = SweepProgress(len(study))
        reporter = stack.enter_context(report_progress(title, progress, quiet=quiet))
        # An interruption ends the survey early. Tasks that were not surveyed are not executed either.
        surveyed_tasks = takewhile(lambda _: not interruption.requested, generate_tasks(study))
        survey = ledger.survey(surveyed_tasks, retry_failed=retry_failed, keep_versions=keep_versions)
        progress.reused = survey.reused
        for line in survey.describe(keep_versions=keep_versions):
            reporter.print_line(line)
        rows = _RowWriter(ledger, table, zip(survey.must_execute, generate_tasks(study), strict=False))
        outcomes = _OutcomeStore(ledger, rows, requires_same_versions=not keep_versions)
        failure = _execute_remaining(
            tasks=compress(generate_tasks(study), survey.must_execute),
            open_executor=partial(_open_executor, scheduler, workers, survey.remaining),
            outcomes=outcomes,
            reporter=reporter,
            progress=progress,
            interruption=interruption,
        )
        table.is_complete = failure is None and not interruption.requested
        if not table.is_complete:
            rows.write_remaining()
    if failure is not None:
        raise failure
    return _compute_totals(progress, survey, rows, table)


@contextmanager
def _open_results(study: Study, folder: Path, *, parquet: bool) -> Iterator[tuple[Ledger, Table]]:
    """Open the ledger and the table in the folder of a sweep."""
    columns = build_columns(study)
    document = study.to_json() | {"columns": [column._asdict() for column in columns]}
    study_content = format_json(document).encode()
    with (
        open_ledger(folder, document) as ledger,
        Table(folder, columns, study_content, parquet=parquet) as table,
    ):
        yield ledger, table


def _execute_remaining(
    *,
    tasks: Iterable[Task],
    open_executor: Callable[[], Executor],
    outcomes: _OutcomeStore,
    reporter: ProgressReporter,
    progress: SweepProgress,
    interruption: Interruption,
) -> RobocovError | None:
    """Execute the remaining tasks, and return the error that stopped them, if any.

    The error is not raised here, because the caller must first write the rows of the finished runs.
    """
    try:
        # The rows of reused runs can be written before any task is executed.
        outcomes.rows.write()
        for _ in execute_tasks(tasks, open_executor, progress, interruption, outcomes.store):
            reporter.update(progress)
    except RobocovError as error:
        return error
    return None


def _open_executor(scheduler: str | None, workers: int | None, runs: int) -> Executor:
    """Connect to a Dask scheduler, or start processes on this machine if there is none."""
    if scheduler is not None:
        return Cluster(scheduler)
    compile_kernels()
    return LocalPool(min(workers or count_processors(), runs))


def _compute_totals(progress: SweepProgress, survey: Survey, rows: _RowWriter, table: Table) -> Totals:
    """Combine the runs of this call with those of earlier calls."""
    return Totals(
        done=progress.done,
        failed=progress.failed + survey.failed,
        reused=progress.reused - survey.failed,
        interrupted=progress.finished < progress.total,
        errors={run: error for error, run in rows.run_by_error.items()},
        damaged=survey.damaged,
        versions=dict(rows.version_counts),
        table_replaced=table.is_replaced,
    )


def _require_same_versions(outcome: Outcome) -> None:
    """Raise OutputError if a worker has different versions from this process."""
    differences = describe_version_differences(outcome.versions)
    if differences:
        raise OutputError(
            f"a worker has {differences}; expected the same versions everywhere, or --keep-versions"
        )


def execute_tasks(
    tasks: Iterable[Task],
    open_executor: Callable[[], Executor],
    progress: SweepProgress,
    interruption: Interruption,
    store: Callable[[Task, Outcome], object],
) -> Iterator[None]:
    """Execute tasks, and store their outcomes.

    Parameters
    ----------
    tasks : iterable of Task
        The tasks to execute.
    open_executor : callable
        Returns the executor; only called if there is a task.
    progress : SweepProgress
        Numbers of runs and start time, which are updated.
    interruption : Interruption
        Ends the execution early when it is requested.
    store : callable
        Called with each task and its outcome, in the order in which the tasks finish.

    Yields
    ------
    None
        Whenever the progress may have changed.
    """
    remaining = iter(tasks)
    task = next(remaining, None)
    if task is None or interruption.requested:
        return
    with open_executor() as executor:
        # The survey of earlier runs and the compilation do not count as computing time of the runs.
        progress.start_time = time.perf_counter()
        while (task is not None or executor.unfinished_tasks) and not interruption.requested:
            while task is not None and executor.unfinished_tasks < executor.capacity:
                executor.submit(task)
                task = next(remaining, None)
            result = executor.wait_for_next(_CHECK_INTERVAL_S)
            progress.waiting_reason = executor.waiting_reason
            progress.lost_workers = executor.lost_workers
            if progress.waiting_reason and not progress.done + progress.failed:
                # Waiting for the first worker does not count as computing time of the runs.
                progress.start_time = time.perf_counter()
            if result is not None:
                finished_task, outcome = result
                store(finished_task, outcome)
                if outcome.error is None:
                    progress.done += 1
                else:
                    progress.failed += 1
            yield


class _RowWriter:
    """Writes the rows of a table in the order of the tasks, which may finish in any order.

    Parameters
    ----------
    ledger : Ledger
        Contains the results of finished tasks.
    table : Table
    tasks : iterator of (int, Task)
        All tasks in order, each after 1 if it had to be executed, or 0 if an earlier run is reused.

    Attributes
    ----------
    finished : set of str
        Names of the tasks that have finished but have no row yet.
    run_by_error : dict of str to str
        For each of the first different errors, the name of a run with this error.
    version_counts : Counter
        Number of runs by the versions with which they were executed.
    """

    def __init__(self, ledger: Ledger, table: Table, tasks: Iterator[tuple[int, Task]]) -> None:
        self.finished: set[str] = set()
        self.run_by_error: dict[str, str] = {}
        self.version_counts: Counter[str] = Counter()
        self._ledger = ledger
        self._table = table
        self._tasks = tasks
        self._next_task = next(tasks, None)

    def write(self) -> None:
        """Write the next rows, up to the first task that has not finished."""
        while self._next_task is not None:
            must_execute, task = self._next_task
            if must_execute and task.name not in self.finished:
                return
            if not self._write_row(task):
                raise OutputError(f"{self._ledger.folder}: {task.name} was removed by another program")
            self._advance(task)

    def write_remaining(self) -> None:
        """Write the rows of all remaining tasks that have finished, and leave out the others."""
        while self._next_task is not None:
            _, task = self._next_task
            self._write_row(task)
            self._advance(task)

    def _advance(self, task: Task) -> None:
        """Continue with the next task, and forget the given one."""
        self.finished.discard(task.name)
        self._next_task = next(self._tasks, None)

    def _write_row(self, task: Task) -> bool:
        """Write the row of a task; return False if the ledger has no entry for it."""
        entry = self._ledger.read_entry(task)
        if entry is None:
            return False
        self._table.add(build_row(task, entry))
        if entry.versions:
            versions = ", ".join(f"{name} {version}" for name, version in entry.versions.items())
            self.version_counts[versions] += 1
        if entry.error is not None and len(self.run_by_error) < _MAX_ERRORS:
            self.run_by_error.setdefault(entry.error, task.name)
        return True


class _OutcomeStore:
    """Stores the outcomes of tasks in the ledger, and writes their rows.

    Parameters
    ----------
    ledger : Ledger
        Stores the outcomes.
    rows : _RowWriter
        Writes the rows of the table.
    requires_same_versions : bool
        Whether outcomes are rejected if their versions differ from those of this process.
    """

    def __init__(self, ledger: Ledger, rows: _RowWriter, *, requires_same_versions: bool) -> None:
        self.rows = rows
        self._ledger = ledger
        self._requires_same_versions = requires_same_versions

    def store(self, task: Task, outcome: Outcome) -> None:
        """Store the outcome of a task, and write the rows that can be written now."""
        if self._requires_same_versions:
            _require_same_versions(outcome)
        self._ledger.store(task, outcome)
        self.rows.finished.add(task.name)
        self.rows.write()
