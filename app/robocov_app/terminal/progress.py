"""Progress of long tasks on standard error: a bar in a terminal, otherwise one plain line at the end."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import count

from robocov.text import escape_controls
from robocov_app.terminal.output import echo

PATIENCE_S = 1.0
"""Elapsed time after which `show_late_progress` starts to show progress."""


@contextmanager
def show_progress(label: str, total: int, *, quiet: bool = False) -> Iterator[Callable[[int], None]]:
    """Show the progress of a task that consists of steps.

    Parameters
    ----------
    label : str
        Name of the task.
    total : int
        Number of steps.
    quiet : bool
        Whether nothing is shown.

    Yields
    ------
    callable
        To be called with the number of finished steps.
    """
    label = escape_controls(label)
    if quiet:
        yield lambda finished: None
    elif sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        progress_bar = Progress(
            TextColumn(f"{label:<12}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=Console(stderr=True),
        )
        with progress_bar as bar:
            task = bar.add_task(label, total=total)
            yield lambda finished: bar.update(task, completed=finished)
    else:
        start = time.perf_counter()
        latest = 0

        def note(finished: int) -> None:
            nonlocal latest
            latest = finished

        yield note
        seconds = time.perf_counter() - start
        echo(f"{label}: {latest} of {total} in {seconds:.1f} s", to_stderr=True)


@contextmanager
def show_late_progress(label: str, *, quiet: bool = False) -> Iterator[Callable[[float], None]]:
    """Show the progress of a task once it has taken more than `PATIENCE_S`.

    Parameters
    ----------
    label : str
        Name of the task.
    quiet : bool
        Whether nothing is shown.

    Yields
    ------
    callable
        To be called with the finished fraction, from 0 to 1.
    """
    start = time.perf_counter()
    with ExitStack() as stack:
        update: Callable[[int], None] | None = None

        def report(fraction: float) -> None:
            nonlocal update
            if update is None and time.perf_counter() - start > PATIENCE_S:
                update = stack.enter_context(show_progress(label, 100, quiet=quiet))
            if update is not None:
                update(round(100 * fraction))

        yield report
        if update is not None:
            update(100)


def make_counter(update: Callable[[int], None]) -> Callable[[], None]:
    """Return a function that counts its calls and reports the count.

    Parameters
    ----------
    update : callable
        The function that `show_progress` yields.

    Returns
    -------
    callable
    """
    numbers = count(1)
    return lambda: update(next(numbers))


@contextmanager
def report_compilation() -> Iterator[None]:
    """Print a line when a kernel is compiled within the context, which makes the first command slow."""
    from robocov.compiled import report_compilation

    has_reported = False

    def report(_: str) -> None:
        nonlocal has_reported
        if not has_reported:
            has_reported = True
            _print_compilation_notice()

    with report_compilation(report):
        yield


def _print_compilation_notice() -> None:
    echo(
        "compiling the numerical loops, once per version: half a minute or more (other controllers may need "
        "further loops)",
        to_stderr=True,
    )
