"""Progress of a sweep: a bar in a terminal, otherwise lines at intervals."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robocov.errors import format_count
from robocov.text import escape_controls
from robocov_app.terminal.output import echo

if TYPE_CHECKING:
    from rich.progress import Progress

LINE_INTERVAL_S = 10.0
"""Time between two lines of progress if there is no terminal."""
_MIN_WHOLE_RATE_PER_S = 10.0
"""Rates from this one on are printed as whole numbers."""
_MIN_DECIMAL_RATE_PER_S = 0.5
"""Lower rates are printed as the time between two runs."""
_UNITS = ((86400, "d", 3600, "h"), (3600, "h", 60, "min"), (60, "min", 1, "s"))
"""Length in seconds and name of each unit, followed by those of the next smaller unit."""


@dataclass
class SweepProgress:
    """Numbers of all runs and of finished runs of a sweep.

    Attributes
    ----------
    total : int
        Number of all runs.
    done : int
        Number of runs that were completed in this call.
    failed : int
        Number of runs that failed in this call.
    reused : int
        Number of runs that were completed or failed in earlier calls.
    lost_workers : int
        Number of workers that ended during a run.
    waiting_reason : str
        Reason why no worker is running; empty if a worker is running.
    start_time : float
        Time at which the first run was started, on the clock of `time.perf_counter`, s.
    """

    total: int
    done: int = 0
    failed: int = 0
    reused: int = 0
    lost_workers: int = 0
    waiting_reason: str = ""
    start_time: float = field(default_factory=time.perf_counter)

    @property
    def finished(self) -> int:
        """Number of finished runs."""
        return self.done + self.failed + self.reused

    @property
    def rate(self) -> float:
        """Number of runs per second in this call; 0 before the first one."""
        seconds = time.perf_counter() - self.start_time
        if seconds <= 0:
            return 0.0
        return (self.done + self.failed) / seconds

    @property
    def remaining_time(self) -> float | None:
        """Estimated remaining time, s; None before the first run."""
        if not self.rate:
            return None
        return (self.total - self.finished) / self.rate

    def describe_outlook(self) -> str:
        """Return the reason why all runs wait, or the remaining time, as text; empty if neither is known."""
        if self.waiting_reason:
            return self.waiting_reason
        if not self.remaining_time:
            return ""
        return f"{format_duration(self.remaining_time)} left"

    def describe(self) -> str:
        """Return the numbers of runs as text."""
        parts = [f"{self.finished} of {self.total} runs"]
        if self.failed:
            parts.append(f"{self.failed} failed")
        if self.reused:
            parts.append(f"{self.reused} reused")
        if self.lost_workers:
            parts.append(f"{format_count(self.lost_workers, 'worker')} lost")
        if self.rate >= _MIN_WHOLE_RATE_PER_S:
            parts.append(f"{self.rate:.0f} per second")
        elif self.rate >= _MIN_DECIMAL_RATE_PER_S:
            parts.append(f"{self.rate:.2g} per second")
        elif self.rate > 0:
            parts.append(f"one every {format_duration(1.0 / self.rate)}")
        return ", ".join(parts)

    def describe_all(self) -> str:
        """Return the numbers of runs and the outlook in one line."""
        numbers = self.describe()
        outlook = self.describe_outlook()
        if numbers and outlook:
            return f"{numbers}, {outlook}"
        return numbers or outlook


class ProgressReporter:
    """Prints the progress of a sweep.

    Parameters
    ----------
    title : str
        Beginning of each line.
    is_quiet : bool
        Whether nothing is printed.
    bar : rich.progress.Progress or None
        The bar to update. If it is None, lines are printed.
    """

    def __init__(self, title: str, *, is_quiet: bool = False, bar: Progress | None = None) -> None:
        self._title = title
        self._is_quiet = is_quiet
        self._bar = bar
        self._reported_at = time.perf_counter()
        self._reported_reason = ""

    def update(self, progress: SweepProgress) -> None:
        """Show the progress: in the bar immediately, as a line only when the next one is due."""
        if self._bar is not None:
            task = self._bar.task_ids[0]
            self._bar.update(
                task,
                completed=progress.finished,
                numbers=progress.describe(),
                outlook=progress.describe_outlook(),
            )
            return
        now = time.perf_counter()
        # The reason for waiting is printed once, when it changes.
        is_due = now - self._reported_at >= LINE_INTERVAL_S and not progress.waiting_reason
        if is_due or progress.waiting_reason != self._reported_reason:
            self._reported_at = now
            self._reported_reason = progress.waiting_reason
            self.print_line(progress.describe_all())

    def print_line(self, line: str) -> None:
        """Print a line, above the bar if there is one."""
        if self._bar is not None:
            self._bar.console.print(escape_controls(line), markup=False, highlight=False)
        elif not self._is_quiet:
            echo(f"{self._title}: {line}", to_stderr=True)


@contextmanager
def report_progress(title: str, progress: SweepProgress, *, quiet: bool) -> Iterator[ProgressReporter]:
    """Report the progress of a sweep on stderr.

    Parameters
    ----------
    title : str
        Title of the bar, or beginning of each line.
    progress : SweepProgress
        The progress, whose final state is printed at the end if there is no terminal.
    quiet : bool
        Whether nothing is printed.

    Yields
    ------
    ProgressReporter
    """
    if quiet or not sys.stderr.isatty():
        reporter = ProgressReporter(title, is_quiet=quiet)
        yield reporter
        reporter.print_line(progress.describe_all())
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as ProgressBar

    progress_bar = ProgressBar(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.fields[numbers]}", markup=False),
        TextColumn("{task.fields[outlook]}", markup=False),
        console=Console(stderr=True),
    )
    with progress_bar as bar:
        bar.add_task(title, total=progress.total, numbers="", outlook="")
        yield ProgressReporter(title, bar=bar)


def format_duration(seconds: float) -> str:
    """Format a duration in its two largest units.

    Examples
    --------
    >>> [format_duration(seconds) for seconds in (8.2, 95, 4000, 200000)]
    ['8 s', '1 min 35 s', '1 h 6 min', '2 d 7 h']
    """
    rounded = round(seconds)
    for unit, name, smaller_unit, smaller_name in _UNITS:
        if rounded >= unit:
            rest = rounded % unit // smaller_unit
            return f"{rounded // unit} {name} {rest} {smaller_name}"
    return f"{rounded} s"
