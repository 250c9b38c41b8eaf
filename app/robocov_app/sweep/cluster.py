"""Workers of a Dask cluster that do tasks."""

from __future__ import annotations

import asyncio
import importlib.util
import logging
import math
import queue
import time
import uuid
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from robocov.errors import InputError, OutputError
from robocov_app.sweep.crew import Crew, Lost, Returned
from robocov_app.sweep.performing import Outcome, perform

if TYPE_CHECKING:
    from robocov_app.sweep.task import Task

PATIENCE = 10.0
"""Seconds that a scheduler has for an answer."""

_LEAST = 4
"""Tasks that are handed out to a cluster which has no workers yet."""

_LOOK = 2.0
"""Seconds between two looks at how many workers there are; they may come and go."""


class Cluster(Crew):
    """The workers of a Dask cluster; they need robocov, and no disk that is shared.

    `address`: of the scheduler: ``tcp://host:8786``. Raises InputError when Dask is not installed, or nobody
    answers at the address.
    """

    def __init__(self, address: str) -> None:
        super().__init__()
        if importlib.util.find_spec("distributed") is None:
            raise InputError('--scheduler: Dask is not installed; pip install "robocov[dask]" was wanted')
        import distributed

        client: Any = distributed.Client  # it has no types
        self._address = address
        self._tasks: dict[Any, Task] = {}
        self._back: queue.SimpleQueue[Any] = queue.SimpleQueue()
        # a result is that of this sweep alone, whatever else the cluster does
        self._prefix = f"robocov-{uuid.uuid4().hex[:8]}"
        self._submitted = 0
        try:
            _require_answer(address)
            self._client = client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError, TypeError, TimeoutError) as error:
            reason = " ".join(str(error).split()) or f"no answer in {PATIENCE:g} s"
            raise InputError(f"--scheduler: {address}: cannot be reached: {reason}") from error
        self._threads, self._asked = 0, -math.inf
        # what it has to say of a scheduler that goes is said here, in one line
        self._talk = logging.getLogger("distributed.client")
        self._level = self._talk.level
        self._talk.setLevel(logging.CRITICAL)

    def __exit__(self, *exception: object) -> None:
        with suppress(Exception):  # the scheduler may be gone
            self._client.cancel(list(self._tasks))
        with suppress(Exception):
            self._client.close()
        self._talk.setLevel(self._level)

    @property
    def most(self) -> int:
        """Twice as many as there are threads: on its way to a worker, a task takes time."""
        return max(_LEAST, 2 * self.threads)

    @property
    def threads(self) -> int:
        """How many tasks the cluster does at once."""
        if time.monotonic() - self._asked > _LOOK:
            self._threads = 0
            with suppress(Exception):  # the scheduler may be gone
                self._threads = sum(self._client.nthreads().values())
            self._asked = time.monotonic()
        return self._threads

    @property
    def waiting(self) -> str:
        """That there is nobody, where there is nobody."""
        return "" if self.threads else f"no workers are connected to {self._address}; waiting"

    def _hand_out(self, task: Task) -> None:
        self._submitted += 1
        key = f"{self._prefix}-{self._submitted}"
        future: Any = self._client.submit(perform, task, key=key, pure=False)
        self._tasks[future] = task
        future.add_done_callback(self._back.put)

    def _returned(self, timeout: float) -> Returned | None:
        from distributed import KilledWorker

        try:
            future = self._back.get(timeout=timeout)
        except queue.Empty:
            return None
        task = self._tasks.pop(future)
        try:
            outcome: Outcome = future.result()
        except KilledWorker as error:
            # so has every task that waited for the same worker
            return task, Lost("the process of its worker ended", str(error), blamed=False)
        except Exception as error:
            reason = getattr(error, "reason", None) or f"{type(error).__name__}: {error}"
            reason = " ".join(str(reason).split())
            raise OutputError(f"--scheduler: {self._address}: the runs cannot go on: {reason}") from error
        return task, outcome


def _require_answer(address: str) -> None:
    """Greet a scheduler as Dask's own client does, which would wait for an answer for ever.

    Raises OSError, ValueError, TimeoutError when nobody answers there in time.
    """
    import distributed
    from distributed import comm

    if address.startswith("inproc://"):  # it is in this process
        return
    security: Any = distributed.Security  # they have no types
    talk: Any = comm

    async def greet() -> None:
        arguments = security().get_connection_args("client")
        line = await asyncio.wait_for(talk.connect(address, timeout=PATIENCE, **arguments), PATIENCE)
        await line.close()

    # in a notebook, this thread has a loop of events that runs already
    with ThreadPoolExecutor(1) as thread:
        thread.submit(lambda: asyncio.run(greet())).result()
