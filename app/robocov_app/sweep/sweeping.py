"""The loop of a sweep: hands out what is not done yet, keeps what comes back, writes the table."""

from __future__ import annotations

from collections import deque
from contextlib import ExitStack
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from robocov.errors import ParameterError, RobocovError, shown
from robocov_app.interruption import Interruption
from robocov_app.sweep.ledger import opened
from robocov_app.sweep.pool import LocalPool, processors
from robocov_app.sweep.table import Table, columns_of, row_of
from robocov_app.sweep.task import tasks_of
from robocov_app.sweep.telling import Count, told

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from robocov_app.sweep.crew import Crew
    from robocov_app.sweep.ledger import Entry, Ledger
    from robocov_app.sweep.study import Study
    from robocov_app.sweep.task import Task

MOST_WORKERS = 1024

_PATIENCE = 0.2
"""Seconds between two looks at what else there is to do."""


class Totals(NamedTuple):
    """What became of the runs of a study.

    Attributes
    ----------
    done, failed : int
        Runs that were done now, well or not.
    reused : int
        Runs that were there already, as they were.
    interrupted : bool
        Whether some are left, as somebody has stopped the sweep.
    """

    done: int
    failed: int
    reused: int
    interrupted: bool


def sweep(
    study: Study,
    folder: Path | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    retry_failed: bool = False,
    quiet: bool = False,
    title: str = "sweep",
    stop: Interruption | None = None,
) -> Totals:
    """Do all runs of a study that are not done yet, and write its table.

    Whatever ends it, the same call goes on where it was, and ends with the same table, byte for byte.

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
        When something cannot be written, or another sweep is at work in the folder. What is done is kept.
    """
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise ParameterError(
            f"workers: {shown(workers)}, but a whole number from 1 to {MOST_WORKERS} was wanted"
        )
    folder = Path(folder)
    with ExitStack() as stack:
        stopped = stack.enter_context(Interruption()) if stop is None else stop
        ledger = stack.enter_context(opened(folder, study.to_json()))
        table = stack.enter_context(Table(folder, columns_of(study)))
        count = Count(len(study))
        tell = stack.enter_context(told(title, count, quiet=quiet))
        rows = _Rows(ledger, table)

        def hired() -> Crew:
            if scheduler is None:
                rest = len(study) - count.reused
                return stack.enter_context(LocalPool(min(workers or processors(), rest)))
            from robocov_app.sweep.cluster import Cluster

            return stack.enter_context(Cluster(scheduler))

        tasks = tasks_of(study)
        failure: RobocovError | None = None
        try:
            for _ in _worked_off(tasks, rows, hired, count, stopped, retry_failed=retry_failed):
                tell(count)
        except RobocovError as error:  # what is done belongs into the table all the same
            failure = error
        if stopped.requested or failure is not None:
            rows.rest(tasks)
    if failure is not None:
        raise failure
    interrupted = count.done + count.failed + count.reused < count.total
    return Totals(count.done, count.failed, count.reused, interrupted)


def _worked_off(
    tasks: Iterator[Task],
    rows: _Rows,
    hired: Callable[[], Crew],
    count: Count,
    stop: Interruption,
    *,
    retry_failed: bool,
) -> Iterator[None]:
    """Do the tasks; yield whenever the count may have changed."""
    crew: Crew | None = None
    for task in tasks:
        entry = rows.expect(task)
        if entry is not None and not (retry_failed and entry.error is not None):
            rows.finished(task, entry)
            count.reused += 1
            continue
        if crew is None:
            crew = hired()
        crew.submit(task)
        while crew.full and not stop.requested:
            _collected(crew, rows, count)
            yield
        if stop.requested:
            return
    while crew is not None and crew.busy and not stop.requested:
        _collected(crew, rows, count)
        yield


def _collected(crew: Crew, rows: _Rows, count: Count) -> None:
    """Keep the next run that comes back, if one does soon."""
    back = crew.next(_PATIENCE)
    if back is None:
        return
    task, outcome = back
    rows.finished(task, rows.ledger.keep(task, outcome))
    if outcome.error is None:
        count.done += 1
    else:
        count.failed += 1


class _Rows:
    """Writes the rows of a table in the order of the tasks, whatever the order in which they are finished.

    Of runs that are finished before others that come first in the table, only the names are kept.
    """

    def __init__(self, ledger: Ledger, table: Table) -> None:
        self.ledger, self._table = ledger, table
        self._line: deque[Task] = deque()
        self._finished: set[str] = set()

    def expect(self, task: Task) -> Entry | None:
        """Put a task at the end of the line; return what came of it earlier."""
        self._line.append(task)
        return self.ledger.entry(task)

    def finished(self, task: Task, entry: Entry) -> None:
        """Write the row of a task, and of those behind it that were finished before, when it is its turn."""
        if task is not self._line[0]:
            self._finished.add(task.name)
            return
        self._table.add(row_of(task, entry))
        self._line.popleft()
        while self._line and self._line[0].name in self._finished:
            self._write(self._line[0])
            self._finished.remove(self._line.popleft().name)

    def rest(self, tasks: Iterator[Task]) -> None:
        """Write the rows of all that is finished, in the line and of these tasks behind it."""
        for task in chain(self._line, tasks):
            self._write(task)

    def _write(self, task: Task) -> None:
        entry = self.ledger.entry(task)
        if entry is not None:
            self._table.add(row_of(task, entry))
