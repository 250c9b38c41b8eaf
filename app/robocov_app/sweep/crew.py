"""Whoever does tasks, and what becomes of tasks whose workers end in the midst of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter, deque
from typing import TYPE_CHECKING, NamedTuple, Self, TypeAlias

from robocov.errors import OutputError
from robocov_app.sweep.performing import Outcome, failed

if TYPE_CHECKING:
    from robocov_app.sweep.task import Task

_ENDS = 2
"""Workers that may end through a task before it counts as failed."""

_IN_A_ROW = 20
"""Workers that may end one after the other without a finished run in between."""


class Lost(NamedTuple):
    """A worker has ended in the midst of a task.

    `cause`: one line. `blamed`: whether it is certain that it was this task, and nothing else, that made the
    worker end.
    """

    cause: str
    details: str
    blamed: bool


Returned: TypeAlias = "tuple[Task, Outcome | Lost]"


class Crew(ABC):
    """Does tasks; a context, whose end stops what is going on.

    A task whose worker has ended is done again. Where it is not certain that the task is to blame (another
    one may have taken all the memory), it is done alone, with nothing else going on. When workers have ended
    twice through it, it has failed. When workers end again and again, whatever they do, all ends. `lost`: how
    many workers have ended in the midst of a task.
    """

    def __init__(self) -> None:
        self._backlog: deque[Task] = deque()
        self._alone: deque[Task] = deque()
        self._ends: Counter[str] = Counter()
        self._out = 0
        self._lonely = False  # whether the one that is out is to be alone
        self.lost = self._in_a_row = 0

    def __enter__(self) -> Self:
        return self

    @abstractmethod
    def __exit__(self, *exception: object) -> None: ...

    @property
    @abstractmethod
    def most(self) -> int:
        """How many tasks should be handed out at once, so that nobody is idle."""

    @abstractmethod
    def _hand_out(self, task: Task) -> None:
        """Give a task to a worker."""

    @abstractmethod
    def _returned(self, timeout: float) -> Returned | None:
        """Return a task that was handed out, and what came of it; None where none is for so many seconds."""

    @property
    def waiting(self) -> str:
        """Reason why no worker is at work, in words; empty where one is."""
        return ""

    @property
    def busy(self) -> int:
        """How many tasks were submitted and have not come back."""
        return self._out + len(self._backlog) + len(self._alone)

    @property
    def full(self) -> bool:
        """Whether more tasks would only wait."""
        return self.busy >= self.most

    def submit(self, task: Task) -> None:
        """Take a task on."""
        self._backlog.append(task)
        self._feed()

    def next(self, timeout: float) -> tuple[Task, Outcome] | None:
        """Return a task that has come back, in any order; None where none does for so many seconds.

        Raises OutputError when nobody can do tasks any more, or workers end again and again.
        """
        self._feed()
        back = self._returned(timeout)
        if back is None:
            return None
        task, came = back
        together, self._lonely = self._out > 1, False
        self._out -= 1
        self._in_a_row = self._in_a_row + 1 if isinstance(came, Lost) else 0
        outcome = self._considered(task, came, together) if isinstance(came, Lost) else came
        self._feed()
        return None if outcome is None else (task, outcome)

    def _feed(self) -> None:
        """Hand tasks out, or one alone."""
        if self._lonely:
            return
        if self._alone:
            if self._out == 0:
                self._lonely, self._out = True, 1
                self._hand_out(self._alone.popleft())
            return
        while self._backlog and self._out < self.most:
            self._hand_out(self._backlog.popleft())
            self._out += 1

    def _considered(self, task: Task, lost: Lost, together: bool) -> Outcome | None:
        """Return that a task has failed, None where it is to be done again."""
        self.lost += 1
        if self._in_a_row > max(_IN_A_ROW, 4 * self.most):
            raise OutputError(
                f"{self._in_a_row} workers have ended one after the other, the last one as {lost.cause}; "
                f"what is done is kept, and the same command goes on"
            )
        if together and not lost.blamed:
            self._alone.append(task)
            return None
        self._ends[task.name] += 1
        if self._ends[task.name] < _ENDS:
            (self._backlog if lost.blamed else self._alone).appendleft(task)
            return None
        del self._ends[task.name]
        return failed(lost.cause, lost.details)
