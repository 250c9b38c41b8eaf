"""Progress of long work on stderr: a bar in a terminal, one plain line elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import count

from robocov.text import escape_controls
from robocov_app.terminal.output import echo

PATIENCE = 1.0  # seconds without a word


@contextmanager
def progress(label: str, total: int, *, quiet: bool = False) -> Iterator[Callable[[int], None]]:
    """Show how far `label` is; the value is a function to be called with the number done so far."""
    label = escape_controls(label)
    if quiet:
        yield lambda done: None
    elif sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        words = TextColumn(f"{label:<12}", markup=False)
        left = TimeRemainingColumn(elapsed_when_finished=True)
        with Progress(words, BarColumn(), MofNCompleteColumn(), left, console=Console(stderr=True)) as bar:
            task = bar.add_task(label, total=total)
            yield lambda done: bar.update(task, completed=done)
    else:
        began, reached = time.perf_counter(), 0

        def note(done: int) -> None:
            nonlocal reached
            reached = done

        yield note
        echo(f"{label}: {reached} of {total} in {time.perf_counter() - began:.1f} s", to_stderr=True)


@contextmanager
def late_progress(label: str, *, quiet: bool = False) -> Iterator[Callable[[float], None]]:
    """Show how far something is, from 0 to 1, once it takes more than `PATIENCE`; the value takes that."""
    began = time.perf_counter()
    with ExitStack() as stack:
        update: Callable[[int], None] | None = None

        def tell(done: float) -> None:
            nonlocal update
            if update is None and time.perf_counter() - began > PATIENCE:
                update = stack.enter_context(progress(label, 100, quiet=quiet))
            if update is not None:
                update(round(100 * done))

        yield tell
        if update is not None:
            update(100)


def counting(update: Callable[[int], None]) -> Callable[[], None]:
    """Return what counts one more each time, for an `update` of `progress`."""
    numbers = count(1)
    return lambda: update(next(numbers))


def tell_of_compiling() -> None:
    from robocov import compiled

    if _tell not in compiled.on_compile:
        compiled.on_compile.append(_tell)


def _tell(_: str) -> None:
    from robocov import compiled

    compiled.on_compile.remove(_tell)
    echo("compiling the simulation, once", to_stderr=True)
