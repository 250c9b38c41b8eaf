"""How far a sweep is: a bar in a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robocov.errors import counted

if TYPE_CHECKING:
    from rich.progress import Progress

PERIOD = 10.0
"""Seconds between two lines where there is no terminal."""


@dataclass
class Count:
    """How many runs there are, and what became of them so far.

    `done`, `failed`: those of this sweep. `reused`: those that were there already. `lost`: workers that have
    ended in the midst of a run. `waiting`: what everything waits for; empty where somebody is at work.
    `began`, s: when it began, by the clock of `time.perf_counter`.
    """

    total: int
    done: int = 0
    failed: int = 0
    reused: int = 0
    lost: int = 0
    waiting: str = ""
    began: float = field(default_factory=time.perf_counter)

    @property
    def rate(self) -> float:
        """Runs a second; 0 before the first one."""
        seconds = time.perf_counter() - self.began
        return (self.done + self.failed) / seconds if seconds > 0 else 0.0

    @property
    def left(self) -> float | None:
        """Seconds to the end, None before the first run."""
        rest = self.total - self.done - self.failed - self.reused
        return rest / self.rate if self.rate else None

    @property
    def ahead(self) -> str:
        """Estimated time left, or the reason why everything waits."""
        return self.waiting or (f"{duration(self.left)} left" if self.left else "")

    def __str__(self) -> str:
        words = [f"{self.done + self.failed + self.reused} of {self.total} runs"]
        words += [f"{self.failed} failed"] * (self.failed > 0)
        words += [f"{self.reused} were there"] * (self.reused > 0)
        words += [f"{counted(self.lost, 'worker')} lost"] * (self.lost > 0)
        if self.rate > 0:
            words.append(f"{self.rate:.0f} a second" if self.rate >= 10 else f"{self.rate:.2g} a second")
        return ", ".join(words)


class Teller:
    """Is called whenever the count has changed, or some time has passed; this one says nothing."""

    def __call__(self, count: Count) -> None:
        """Say how far it is."""

    def say(self, line: str) -> None:
        """Say something else."""


class _Lines(Teller):
    def __init__(self, title: str) -> None:
        self._title, self._said, self._waiting = title, time.perf_counter(), ""

    def __call__(self, count: Count, *, at_once: bool = False) -> None:
        now = time.perf_counter()
        due = now - self._said >= PERIOD and not count.waiting  # that is told once
        if at_once or due or count.waiting != self._waiting:
            self._said, self._waiting = now, count.waiting
            self.say(", ".join(filter(None, (str(count), count.ahead))))

    def say(self, line: str) -> None:
        sys.stderr.write(f"{self._title}: {line}\n")
        sys.stderr.flush()


class _Bar(Teller):
    def __init__(self, bar: Progress, title: str, total: int) -> None:
        self._bar, self._task = bar, bar.add_task(title, total=total, said="", left="")

    def __call__(self, count: Count) -> None:
        done = count.done + count.failed + count.reused
        self._bar.update(self._task, completed=done, said=str(count), left=count.ahead)

    def say(self, line: str) -> None:
        self._bar.console.print(line, markup=False, highlight=False)


@contextmanager
def told(title: str, count: Count, *, quiet: bool) -> Iterator[Teller]:
    """Give a function to be called with the count when it has changed, and now and then.

    `quiet`: say nothing.
    """
    if quiet:
        yield Teller()
    elif sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.fields[said]}", markup=False),
            TextColumn("{task.fields[left]}", markup=False),
        )
        with Progress(*columns, console=Console(stderr=True)) as bar:
            yield _Bar(bar, title, count.total)
    else:
        lines = _Lines(title)
        yield lines
        lines(count, at_once=True)


def duration(seconds: float) -> str:
    """Return a time for people.

    >>> duration(8.2), duration(95), duration(4000), duration(200000)
    ('8 s', '1 min 35 s', '1 h 6 min', '2 d 7 h')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    if whole < 86400:
        return f"{whole // 3600} h {whole % 3600 // 60} min"
    return f"{whole // 86400} d {whole % 86400 // 3600} h"
