"""Workers of a Dask cluster."""

from __future__ import annotations

import asyncio
import logging
import math
import time
import uuid
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from robocov.errors import InputError, OutputError
from robocov.optional_imports import import_optional
from robocov_app.sweep.executor import Executor, LostWorker
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import Outcome, perform

CONNECTION_TIMEOUT_S = 10.0
"""Maximum time to wait for an answer of the scheduler."""
_MIN_CAPACITY = 4
"""Minimum number of submitted tasks, also for a cluster that has no workers yet."""
_TASKS_PER_THREAD = 2
"""Number of submitted tasks per thread. Sending a task takes time, so a second one waits at each thread."""
_THREAD_COUNT_INTERVAL_S = 2.0
"""Time between two queries of the number of threads; workers may come and go."""
_LOCAL_ADDRESS = "inproc://"
"""Beginning of the address of a scheduler that runs in this process."""


class Cluster(Executor):
    """The workers of a Dask cluster, which need an installation of robocov, but no shared disk.

    Parameters
    ----------
    address : str
        Address of the scheduler, as in ``tcp://host:8786``.

    Raises
    ------
    InputError
        If the scheduler cannot be reached.
    """

    def __init__(self, address: str) -> None:
        super().__init__()
        dask = import_optional("distributed", "dask", "--scheduler: ")
        self._address = address
        self._killed_worker_error = dask.KilledWorker
        self._futures: set[Any] = set()
        try:
            if not address.startswith(_LOCAL_ADDRESS):
                _check_connection(dask, address)
            self._client = dask.Client(address, timeout=CONNECTION_TIMEOUT_S, set_as_default=False)
        except (OSError, ValueError, TypeError, TimeoutError) as error:
            reason = " ".join(str(error).split()) or f"no answer within {CONNECTION_TIMEOUT_S:g} s"
            raise InputError(f"--scheduler: {address}: cannot be reached: {reason}") from error
        self._threads = 0
        self._threads_counted_at = -math.inf
        # Dask logs many lines when a scheduler ends. They are silenced: the user gets one error message.
        self._logger = logging.getLogger("distributed.client")
        self._previous_level = self._logger.level
        self._logger.setLevel(logging.CRITICAL)

    def __exit__(self, *exception: object) -> None:
        # The scheduler may no longer exist.
        with suppress(Exception):
            self._client.cancel(list(self._futures))
        with suppress(Exception):
            self._client.close()
        self._logger.setLevel(self._previous_level)

    @property
    def capacity(self) -> int:
        """Number of tasks to submit at once so that no thread of a worker is idle."""
        return max(_MIN_CAPACITY, _TASKS_PER_THREAD * self.threads)

    @property
    def threads(self) -> int:
        """Number of threads of all workers."""
        if time.monotonic() - self._threads_counted_at > _THREAD_COUNT_INTERVAL_S:
            self._threads = 0
            with suppress(Exception):  # The scheduler may no longer exist.
                self._threads = sum(self._client.nthreads().values())
            self._threads_counted_at = time.monotonic()
        return self._threads

    @property
    def waiting_reason(self) -> str:
        """Reason why no worker is running; empty if a worker is running."""
        if self.threads:
            return ""
        return f"no workers are connected to {self._address}; waiting"

    def _start(self, task: Task) -> None:
        # A unique key prevents Dask from returning the result of another program on the cluster.
        key = f"robocov-{uuid.uuid4().hex}"
        future: Any = self._client.submit(perform, task, key=key, pure=False)
        self._futures.add(future)
        self._add_future(task, future)

    def _get_result(self, future: Future[Any]) -> Outcome | LostWorker:
        """Return the outcome of a task, or how its worker ended; raise OutputError if Dask itself fails."""
        self._futures.remove(future)
        try:
            return super()._get_result(future)
        except Exception as error:
            if isinstance(error, self._killed_worker_error):
                # Tasks that were only waiting on the same worker get this error as well.
                return LostWorker("the process of its worker ended", str(error), is_caused_by_task=False)
            reason = getattr(error, "reason", None) or f"{type(error).__name__}: {error}"
            reason = " ".join(str(reason).split())
            raise OutputError(f"--scheduler: {self._address}: the runs cannot continue: {reason}") from error


def _check_connection(dask: Any, address: str) -> None:
    """Connect to a scheduler and disconnect; unlike Dask's client, this does not wait forever."""

    async def connect() -> None:
        arguments = dask.Security().get_connection_args("client")
        connecting = dask.comm.connect(address, timeout=CONNECTION_TIMEOUT_S, **arguments)
        connection = await asyncio.wait_for(connecting, CONNECTION_TIMEOUT_S)
        await connection.close()

    # A new thread, because this one may already run an event loop, as in a notebook.
    with ThreadPoolExecutor(1) as thread:
        thread.submit(lambda: asyncio.run(connect())).result()
