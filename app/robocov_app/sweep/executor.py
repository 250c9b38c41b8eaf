"""The interface of executors of tasks, and their recovery if a worker ends in the middle of a task."""

from __future__ import annotations

import queue
from abc import ABC, abstractmethod
from collections import Counter, deque
from concurrent.futures import Future
from contextlib import suppress
from typing import Any, NamedTuple, Self, TypeAlias

from robocov.errors import OutputError
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import Outcome, build_failure

_MAX_ENDS_PER_TASK = 2
"""Number of workers that a task has ended when it counts as failed."""
_MAX_CONSECUTIVE_ENDS = 20
"""Maximum number of workers that may end in a row, without any finished task in between."""
_MAX_CONSECUTIVE_ENDS_PER_TASK = 4
"""Maximum number of such workers per task that is executed at the same time; the larger limit applies."""


class LostWorker(NamedTuple):
    """The end of a worker in the middle of a task."""

    cause: str
    """Description of the reason."""
    details: str
    """Last lines of the worker's output."""
    is_caused_by_task: bool
    """Whether it is certain that the task itself ended the worker."""


Result: TypeAlias = tuple[Task, Outcome | LostWorker]
"""A task, and its outcome or the end of its worker."""


class Executor(ABC):
    """Executes tasks; leaving its context stops all of them.

    If a worker ends during a task, the task is repeated. If another task may have been the cause, it is
    repeated in isolation, which means that no other task runs at the same time. A task that has ended two
    workers counts as failed. If too many workers end in a row, an OutputError is raised.

    Attributes
    ----------
    lost_workers : int
        Number of workers that have ended.
    """

    def __init__(self) -> None:
        self.lost_workers = 0
        self._consecutive_ends = 0
        self._ends_by_task: Counter[str] = Counter()
        self._waiting: deque[Task] = deque()
        self._waiting_for_isolation: deque[Task] = deque()
        self._running = 0
        self._is_isolated = False  # whether the running task must be the only one
        self._finished: queue.SimpleQueue[tuple[Task, Future[Any]]] = queue.SimpleQueue()

    def __enter__(self) -> Self:
        return self

    @abstractmethod
    def __exit__(self, *exception: object) -> None: ...

    @property
    @abstractmethod
    def capacity(self) -> int:
        """Number of tasks to run at the same time so that no worker is idle."""

    @property
    def waiting_reason(self) -> str:
        """Reason why no worker is running; empty if a worker is running."""
        return ""

    @property
    def unfinished_tasks(self) -> int:
        """Number of tasks that were submitted and have not been returned yet."""
        return self._running + len(self._waiting) + len(self._waiting_for_isolation)

    def submit(self, task: Task) -> None:
        """Submit a task, which starts as soon as there is capacity.

        Parameters
        ----------
        task : Task
            The task to execute.
        """
        self._waiting.append(task)
        self._start_tasks()

    def wait_for_next(self, timeout: float) -> tuple[Task, Outcome] | None:
        """Wait for the next task to finish, and return it with its outcome.

        Parameters
        ----------
        timeout : float, s
            Maximum waiting time.

        Returns
        -------
        (Task, Outcome) or None
            None if no task finishes within this time, or if a worker has ended and its task will be repeated.

        Raises
        ------
        OutputError
            If too many workers end in a row.
        """
        self._start_tasks()
        result = self._wait_for_result(timeout)
        if result is None:
            return None
        task, outcome = result
        # If other tasks were running, one of them may have ended the worker.
        had_others = self._running > 1
        self._is_isolated = False
        self._running -= 1
        if isinstance(outcome, LostWorker):
            failure = self._handle_lost_worker(task, outcome, had_others=had_others)
            self._start_tasks()
            if failure is None:
                return None
            return task, failure
        self._consecutive_ends = 0
        self._start_tasks()
        return task, outcome

    @abstractmethod
    def _start(self, task: Task) -> None:
        """Start a task."""

    def _add_future(self, task: Task, future: Future[Any]) -> None:
        """Arrange that a task is reported as finished once its future is done."""
        future.add_done_callback(lambda done: self._finished.put((task, done)))

    def _wait_for_result(self, timeout: float) -> Result | None:
        """Return the result of a finished task; None if no task finishes within `timeout` seconds."""
        with suppress(queue.Empty):
            task, future = self._finished.get(timeout=timeout)
            return task, self._get_result(future)
        return None

    def _get_result(self, future: Future[Any]) -> Outcome | LostWorker:
        """Return the result of a future that is done."""
        return future.result()  # type: ignore[no-any-return]

    def _start_tasks(self) -> None:
        """Start waiting tasks while there is capacity; a task that needs isolation starts if none is running.

        While a task waits for isolation, no others are started, so that the running ones can finish.
        """
        must_isolate = self._is_isolated or bool(self._waiting_for_isolation)
        while self._waiting and not must_isolate and self._running < self.capacity:
            self._start(self._waiting.popleft())
            self._running += 1
        if self._waiting_for_isolation and not self._running:
            self._is_isolated = True
            self._running = 1
            self._start(self._waiting_for_isolation.popleft())

    def _handle_lost_worker(self, task: Task, lost: LostWorker, *, had_others: bool) -> Outcome | None:
        """Schedule the task again and return None, or return its failure if it has ended too many workers.

        Parameters
        ----------
        task : Task
            The task whose worker ended.
        lost : LostWorker
            How the worker ended.
        had_others : bool
            Whether other tasks were running at the same time.

        Raises
        ------
        OutputError
            If too many workers have ended in a row.
        """
        self.lost_workers += 1
        self._consecutive_ends += 1
        max_ends = max(_MAX_CONSECUTIVE_ENDS, _MAX_CONSECUTIVE_ENDS_PER_TASK * self.capacity)
        if self._consecutive_ends > max_ends:
            raise OutputError(
                f"{self._consecutive_ends} workers ended in a row, the last one because "
                f"{lost.cause}; finished runs are kept, and the same command resumes"
            )
        if had_others and not lost.is_caused_by_task:
            self._waiting_for_isolation.append(task)
            return None
        self._ends_by_task[task.name] += 1
        if self._ends_by_task[task.name] >= _MAX_ENDS_PER_TASK:
            return build_failure(lost.cause, lost.details)
        if lost.is_caused_by_task:
            self._waiting.appendleft(task)
        else:
            self._waiting_for_isolation.appendleft(task)
        return None
