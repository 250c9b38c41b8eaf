"""The loop of a sweep: hands out what is not done yet, keeps what comes back, writes the table."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from itertools import compress, takewhile
from pathlib import Path
from typing import TYPE_CHECKING

from robocov.errors import OutputError, RobocovError, format_count, require_number
from robocov.kernel_compilation import compile_kernels
from robocov.text import escape_controls
from robocov_app.sweep.executors import Cluster, Executor, LocalPool, processors
from robocov_app.sweep.ledger import Ledger, difference_of, opened
from robocov_app.sweep.study import Study
from robocov_app.sweep.table import Table, columns_of, row_of
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import Outcome, perform, prepare_cost
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import echo, format_json

if TYPE_CHECKING:
    from rich.progress import Progress

PERIOD = 10.0  # seconds between two lines where there is no terminal
_PATIENCE = 0.2  # seconds between two looks at what else there is to do
_ERRORS = 3  # different errors of runs that are told


@dataclass
class Count:
    """Number of runs, done and left, and of workers `lost`; `waiting`: why nobody does any, in words."""

    total: int
    done: int = 0
    failed: int = 0
    reused: int = 0
    lost: int = 0
    waiting: str = ""
    began: float = field(default_factory=time.perf_counter)

    @property
    def over(self) -> int:
        return self.done + self.failed + self.reused

    @property
    def rate(self) -> float:
        """Runs a second; 0 before the first one."""
        seconds = time.perf_counter() - self.began
        return (self.done + self.failed) / seconds if seconds > 0 else 0.0

    @property
    def left(self) -> float | None:
        """Seconds to the end, None before the first run."""
        return (self.total - self.over) / self.rate if self.rate else None

    @property
    def ahead(self) -> str:
        """Estimated time left, or the reason why everything waits."""
        return self.waiting or (f"{duration(self.left)} left" if self.left else "")

    @property
    def line(self) -> str:
        return ", ".join(filter(None, (str(self), self.ahead)))

    def __str__(self) -> str:
        words = [f"{self.over} of {self.total} runs"]
        words += [f"{self.failed} failed"] * (self.failed > 0)
        words += [f"{self.reused} were there"] * (self.reused > 0)
        words += [f"{format_count(self.lost, 'worker')} lost"] * (self.lost > 0)
        if self.rate > 0:
            words.append(f"{self.rate:.0f} a second" if self.rate >= 10 else f"{self.rate:.2g} a second")
        return ", ".join(words)


class Teller:
    """Tells how far a sweep is: by a bar of rich, in lines now and then, or if `quiet` not at all."""

    def __init__(self, title: str, *, quiet: bool = False, bar: Progress | None = None) -> None:
        self._title, self._quiet, self._bar = title, quiet, bar
        self._said, self._waiting = time.perf_counter(), ""

    def __call__(self, count: Count) -> None:
        now = time.perf_counter()
        due = now - self._said >= PERIOD and not count.waiting  # that is told once
        if (bar := self._bar) is not None:
            bar.update(bar.task_ids[0], completed=count.over, said=str(count), left=count.ahead)
        elif due or count.waiting != self._waiting:
            self._said, self._waiting = now, count.waiting
            self.say(count.line)

    def say(self, line: str) -> None:
        if self._bar is not None:
            self._bar.console.print(escape_controls(line), markup=False, highlight=False)
        elif not self._quiet:
            echo(f"{self._title}: {line}", to_stderr=True)


@contextmanager
def sweep_progress(title: str, count: Count, *, quiet: bool) -> Iterator[Teller]:
    """Give what tells of the count: a bar in a terminal, a line now and then elsewhere."""
    if quiet or not sys.stderr.isatty():
        teller = Teller(title, quiet=quiet)
        yield teller
        teller.say(count.line)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    words = ("{task.description}", "{task.fields[said]}", "{task.fields[left]}")
    name, said, left = (TextColumn(each, markup=False) for each in words)
    with Progress(name, BarColumn(), said, left, console=Console(stderr=True)) as bar:
        bar.add_task(title, total=count.total, said="", left="")
        yield Teller(title, bar=bar)


def duration(seconds: float) -> str:
    """Return a time for people.

    >>> duration(8.2), duration(95), duration(4000), duration(200000)
    ('8 s', '1 min 35 s', '1 h 6 min', '2 d 7 h')
    """
    whole = round(seconds)
    for unit, name, part, part_name in ((86400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s")):
        if whole >= unit:
            return f"{whole // unit} {name} {whole % unit // part} {part_name}"
    return f"{whole} s"


@dataclass
class Totals:
    """Totals of the runs of a study."""

    done: int
    failed: int  # earlier ones too
    reused: int
    interrupted: bool
    errors: dict[str, str] = field(default_factory=dict, compare=False)  # the first different ones, by run
    damaged: list[str] = field(default_factory=list, compare=False)
    versions: dict[str, int] = field(default_factory=dict, compare=False)  # how many were made with which
    table_replaced: bool = field(default=True, compare=False)  # not where it would have become shorter


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
    """Do all runs of a study that are not done yet, and write its table.

    Whatever ends it, the same call goes on where it was, and ends with the same table, byte for byte.
    `scheduler`: the address of a Dask scheduler whose workers do the runs, in place of `workers` processes
    (one a processor). `keep_versions`: use runs of other versions, which are done again else. `parquet`:
    write the table as ``results.parquet`` too, which needs ``robocov[parquet]``. Raises
    InputError when the folder holds something else, OutputError when workers end again and again or something
    cannot be written; what is done is kept.
    """
    if workers is not None:
        require_number("workers", workers, 1, 1024, whole=True)
    folder = Path(folder)
    with ExitStack() as stack:
        stopped = stack.enter_context(Interruption()) if stop is None else stop
        columns = columns_of(study)
        content = study.to_json() | {"columns": [column._asdict() for column in columns]}
        ledger = stack.enter_context(opened(folder, content))
        table = stack.enter_context(Table(folder, columns, format_json(content).encode(), parquet=parquet))
        count = Count(len(study))
        tell = stack.enter_context(sweep_progress(title, count, quiet=quiet))
        looked = takewhile(lambda _: not stopped.requested, generate_tasks(study))
        survey = ledger.survey(looked, retry_failed=retry_failed, keep_versions=keep_versions)
        count.reused = len(survey.todo) - sum(survey.todo)
        for line in survey.words(keep_versions=keep_versions):
            tell.say(line)
        rows = _Rows(ledger, table, zip(survey.todo, generate_tasks(study), strict=False))

        def open_executor() -> Executor:
            if scheduler is not None:
                return Cluster(scheduler)
            compile_kernels()
            return LocalPool(min(workers or processors(), sum(survey.todo)))

        def keep(task: Task, outcome: Outcome) -> None:
            if (difference := difference_of(outcome.versions)) and not keep_versions:
                wanted = "expected the same versions everywhere, or --keep-versions"
                raise OutputError(f"a worker has {difference}; {wanted}")
            ledger.keep(task, outcome)
            rows.finished.add(task.name)
            rows.write()

        failure: RobocovError | None = None
        try:
            rows.write()
            for _ in worked_off(
                compress(generate_tasks(study), survey.todo), open_executor, count, stopped, keep
            ):
                tell(count)
        except RobocovError as error:  # what is done belongs into the table all the same
            failure = error
        table.complete = failure is None and not stopped.requested
        if not table.complete:
            rows.write(whatever=True)
    if failure is not None:
        raise failure
    failed, reused = count.failed + survey.failed, count.reused - survey.failed
    errors = {run: error for error, run in rows.errors.items()}
    details = errors, survey.damaged, dict(rows.versions), table.replaced
    return Totals(count.done, failed, reused, count.over < count.total, *details)


def worked_off(
    tasks: Iterable[Task],
    open_executor: Callable[[], Executor],
    count: Count,
    stop: Interruption,
    keep: Callable[[Task, Outcome], object],
) -> Iterator[None]:
    """Have tasks done, and keep what comes back; yield whenever the count may have changed."""
    left = iter(tasks)
    task = next(left, None)
    if task is None or stop.requested:
        return
    with open_executor() as executor:
        while (task is not None or executor.busy) and not stop.requested:
            while task is not None and executor.busy < executor.most:
                executor.submit(task)
                task = next(left, None)
            back = executor.next(_PATIENCE)
            count.waiting, count.lost = executor.waiting, executor.lost
            if count.waiting and not count.done + count.failed:
                count.began = time.perf_counter()
            if back is not None:
                keep(*back)
                count.done += back[1].error is None
                count.failed += back[1].error is not None
            yield


class _Rows:
    """Writes the rows of a table in the order of the tasks, whatever the order in which they are finished."""

    def __init__(self, ledger: Ledger, table: Table, tasks: Iterator[tuple[int, Task]]) -> None:
        self._ledger, self._table, self._tasks = ledger, table, tasks
        self._head = next(tasks, None)
        self.finished: set[str] = set()
        self.errors: dict[str, str] = {}
        self.versions: Counter[str] = Counter()

    def write(self, *, whatever: bool = False) -> None:
        """Write the next rows, up to the first run that is still to be done; or `whatever` is there."""
        while self._head is not None:
            todo, task = self._head
            if todo and task.name not in self.finished and not whatever:
                return
            entry = self._ledger.entry(task)
            if entry is not None:
                self._table.add(row_of(task, entry))
                if entry.versions:
                    self.versions[", ".join(map(" ".join, entry.versions.items()))] += 1
                if entry.error is not None and len(self.errors) < _ERRORS:
                    self.errors.setdefault(entry.error, task.name)
            elif not whatever:
                raise OutputError(f"{self._ledger.folder}: {task.name} was removed by somebody else")
            self.finished.discard(task.name)
            self._head = next(self._tasks, None)


@dataclass(frozen=True)
class Rehearsal:
    """Estimate of a sweep by one `run` of it: seconds for all that are left, bytes for all."""

    runs: int
    left: int
    axes: dict[str, int]
    run: str
    error: str | None
    seconds_a_run: float
    bytes_a_run: int
    seconds: float
    bytes: int
    notes: list[str]


def rehearsed(
    study: Study, folder: Path, *, workers: int, retry_failed: bool = False, keep_versions: bool = False
) -> Rehearsal:
    """Do the first run that is left, or else the first, and write nothing."""
    again = {"retry_failed": retry_failed, "keep_versions": keep_versions}
    survey = Ledger(folder).survey(generate_tasks(study), **again)
    left = sum(survey.todo)
    chosen = next(compress(generate_tasks(study), survey.todo), None) or next(generate_tasks(study))
    prepare_cost(chosen)  # once for all runs on a map
    began = time.perf_counter()
    outcome = perform(chosen)
    seconds, size = time.perf_counter() - began, sum(map(len, outcome.files.values()))
    one = axes_of(study), chosen.name, outcome.error, seconds, size
    every = seconds * left / max(1, min(workers, left)), size * len(study)
    return Rehearsal(len(study), left, *one, *every, survey.words(keep_versions=keep_versions))


def axes_of(study: Study) -> dict[str, int]:
    sizes = {name: len(getattr(study, name)) for name in ("maps", "robots", "teams")}
    sizes["starts"] = sum(len(study.list_starts(each)) for each in study.maps)
    sizes |= {name: len(getattr(study, name)) for name in ("seeds", "controllers")}
    return sizes | {f"gains of {name}": len(study.get_gains(name).choices) for name in study.controllers}
