"""The loop of a sweep: hands out what is not done yet, keeps what comes back, writes the table."""

from __future__ import annotations

import time
from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass, field
from itertools import compress, takewhile
from pathlib import Path
from typing import TYPE_CHECKING

from robocov.compiled import compile_kernels
from robocov.errors import OutputError, ParameterError, RobocovError, shown
from robocov_app.sweep.ledger import difference_of, opened, study_bytes
from robocov_app.sweep.pool import LocalPool, processors
from robocov_app.sweep.table import Table, columns_of, row_of
from robocov_app.sweep.task import tasks_of
from robocov_app.sweep.telling import Count, told
from robocov_app.terminal.interruption import Interruption

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from robocov_app.sweep.crew import Crew
    from robocov_app.sweep.ledger import Entry, Ledger
    from robocov_app.sweep.performing import Outcome
    from robocov_app.sweep.study import Study
    from robocov_app.sweep.task import Task

MOST_WORKERS = 1024

_PATIENCE = 0.2
"""Seconds between two looks at what else there is to do."""

_ERRORS = 3
"""Different errors of runs that are told."""


@dataclass
class Totals:
    """What became of the runs of a study.

    `done`: runs that were done now, and well. `failed`: runs that failed, now or earlier. `reused`: runs that
    were there already, done well. `interrupted`: whether some are left, as somebody has stopped the sweep.
    `errors`: why the first runs failed that did so for different reasons. `damaged`: runs that were there,
    but not as they were written, and were to be done again. `versions`: how many runs of the table were made
    with which versions; of several the table is mixed. `table_replaced`: whether the table holds these runs;
    the one that was there stays where this one would be shorter.
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
    quiet: bool = False,
    title: str = "sweep",
    stop: Interruption | None = None,
) -> Totals:
    """Do all runs of a study that are not done yet, and write its table.

    Whatever ends it, the same call goes on where it was, and ends with the same table, byte for byte. Runs
    whose files were damaged are done again, and so are those that other versions of robocov, numpy, scipy,
    shapely or pymunk have done.

    Parameters
    ----------
    study : Study
    folder : path
        For ``study.json``, ``results.csv``, ``results.parquet`` and ``runs/``. What an earlier sweep has
        done there is used as far as it belongs to the study.
    workers : int or None
        Processes on this machine; by default one a processor.
    scheduler : str or None
        Address of a Dask scheduler whose workers do the runs instead.
    retry_failed : bool
        Do runs again that have failed.
    keep_versions : bool
        Use runs that other versions have done.
    quiet : bool
        Tell nothing.
    title : str
        What it is called when progress is told.
    stop : Interruption or None
        Asked between two runs; by default Ctrl-C is noted here.

    Raises
    ------
    InputError
        When the folder holds something else, or the scheduler cannot be reached.
    OutputError
        When something cannot be written, another sweep is at work in the folder, workers end again and
        again, or those of a cluster have other versions. What is done is kept.
    """
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise ParameterError(
            f"workers: {shown(workers)}, but a whole number from 1 to {MOST_WORKERS} was wanted"
        )
    folder = Path(folder)
    with ExitStack() as stack:
        stopped = stack.enter_context(Interruption()) if stop is None else stop
        content = study.to_json()
        ledger = stack.enter_context(opened(folder, content))
        table = stack.enter_context(Table(folder, columns_of(study), study_bytes(content)))
        count = Count(len(study))
        tell = stack.enter_context(told(title, count, quiet=quiet))
        looked = takewhile(lambda _: not stopped.requested, tasks_of(study))
        survey = ledger.survey(looked, retry_failed=retry_failed, keep_versions=keep_versions)
        count.reused = len(survey.todo) - sum(survey.todo)
        for line in survey.words(keep_versions=keep_versions):
            tell.say(line)
        rows = _Rows(ledger, table, zip(survey.todo, tasks_of(study), strict=False))

        def hired() -> Crew:
            if scheduler is None:
                compile_kernels()
                return LocalPool(min(workers or processors(), sum(survey.todo)))
            from robocov_app.sweep.cluster import Cluster

            return Cluster(scheduler)

        def keep(task: Task, outcome: Outcome) -> None:
            difference = difference_of(outcome.versions)
            if difference and not keep_versions:
                raise OutputError(
                    f"a worker has {difference}; the same versions everywhere, or --keep-versions, was wanted"
                )
            ledger.keep(task, outcome)
            rows.finished(task)

        failure: RobocovError | None = None
        try:
            rows.write()
            for _ in worked_off(compress(tasks_of(study), survey.todo), hired, count, stopped, keep):
                tell(count)
        except RobocovError as error:  # what is done belongs into the table all the same
            failure = error
        table.complete = failure is None and not stopped.requested
        if not table.complete:
            rows.write(whatever=True)
    if failure is not None:
        raise failure
    return Totals(
        done=count.done,
        failed=count.failed + survey.failed,
        reused=count.reused - survey.failed,
        interrupted=count.done + count.failed + count.reused < count.total,
        errors={run: error for error, run in rows.errors.items()},
        damaged=survey.damaged,
        versions=dict(rows.versions),
        table_replaced=table.replaced,
    )


def worked_off(
    tasks: Iterable[Task],
    hired: Callable[[], Crew],
    count: Count,
    stop: Interruption,
    keep: Callable[[Task, Outcome], object],
) -> Iterator[None]:
    """Have tasks done, and keep what comes back; yield whenever the count may have changed.

    `tasks`: asked for the next one when somebody can do it. `hired`: gives those who do tasks; called if
    there is one.
    """
    with ExitStack() as stack:
        crew: Crew | None = None
        left = iter(tasks)
        task = next(left, None)
        while (task is not None or (crew is not None and crew.busy)) and not stop.requested:
            if crew is None:
                crew = stack.enter_context(hired())
            while task is not None and not crew.full:
                crew.submit(task)
                task = next(left, None)
            back = crew.next(_PATIENCE)
            count.waiting, count.lost = crew.waiting, crew.lost
            if count.waiting and not count.done + count.failed:
                count.began = time.perf_counter()
            if back is not None:
                keep(*back)
                if back[1].error is None:
                    count.done += 1
                else:
                    count.failed += 1
            yield


class _Rows:
    """Writes the rows of a table in the order of the tasks, whatever the order in which they are finished.

    Of runs that are finished before others that come first in the table, only the names are kept.
    """

    def __init__(self, ledger: Ledger, table: Table, tasks: Iterable[tuple[int, Task]]) -> None:
        self._ledger, self._table, self._tasks = ledger, table, iter(tasks)
        self._head = next(self._tasks, None)
        self._finished: set[str] = set()
        self.errors: dict[str, str] = {}
        self.versions: Counter[str] = Counter()

    def finished(self, task: Task) -> None:
        """Write the row of a task, and of those behind it that were finished before, when it is its turn."""
        self._finished.add(task.name)
        self.write()

    def write(self, *, whatever: bool = False) -> None:
        """Write the next rows, up to the first run that is still to be done; or `whatever` is there.

        Raises OutputError when a run that was there is not any more, or a row cannot be written.
        """
        while self._head is not None:
            todo, task = self._head
            if todo and task.name not in self._finished and not whatever:
                return
            entry = self._ledger.entry(task)
            if entry is not None:
                self._add(task, entry)
            elif not whatever:
                raise OutputError(f"{self._ledger.folder}: {task.name} was removed by somebody else")
            self._finished.discard(task.name)
            self._head = next(self._tasks, None)

    def _add(self, task: Task, entry: Entry) -> None:
        self._table.add(row_of(task, entry))
        if entry.versions:
            self.versions[", ".join(map(" ".join, entry.versions.items()))] += 1
        if entry.error is not None and (entry.error in self.errors or len(self.errors) < _ERRORS):
            self.errors.setdefault(entry.error, task.name)
