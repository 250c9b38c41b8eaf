"""Functions that start, query and end the process of a service, for callers that wait for each answer."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import IO

from robocov_app.jobs.messages import READY, Progress, Reply, receive, send

_PIPE_BYTES = 1 << 20
"""Capacity of the pipe for answers. If a whole answer fits, its reader wakes up less often."""

_REQUEST_NUMBER = 0
"""Number of every request. The caller waits for each answer, so one number is enough."""


def start_process(service: str, *, stderr: IO[bytes] | None = None) -> subprocess.Popen[bytes]:
    """Start the process of a service.

    Parameters
    ----------
    service : str
        Class of the service as ``package.module:Class``.
    stderr : binary file or None
        File for the standard error of the process; by default, that of this process.

    Returns
    -------
    subprocess.Popen
        The process, with pipes as standard input and output.

    Raises
    ------
    OSError
        If the process cannot be started.
    """
    return start_python(f"from robocov_app.jobs.serving import serve; serve({service!r})", stderr=stderr)


def start_python(
    program: str, *, stderr: IO[bytes] | int | None = None, variables: Mapping[str, str] | None = None
) -> subprocess.Popen[bytes]:
    """Start a process of Python that can import the same modules as this one.

    Parameters
    ----------
    program : str
        Code that the process executes.
    stderr : binary file, int or None
        File for the standard error of the process, or `subprocess.DEVNULL`; by default, that of this process.
    variables : mapping of str to str, optional
        Environment variables that differ from those of this process.

    Returns
    -------
    subprocess.Popen
        The process, with pipes as standard input and output.

    Raises
    ------
    OSError
        If the process cannot be started.
    """
    search_path = os.pathsep.join(path for path in sys.path if path)
    environment = {**os.environ, "PYTHONPATH": search_path, **(variables or {})}
    # Linear algebra uses one thread in each process, unless the user has chosen another number.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        environment.setdefault(name, "1")
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", program],  # -P: modules in the working folder are not imported
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=stderr,
        env=environment,
    )
    if sys.platform == "linux":
        import fcntl

        # Not every user is allowed to create pipes of this size, but smaller pipes work as well.
        with suppress(OSError):
            fcntl.fcntl(process.stdout, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)  # type: ignore[arg-type]
    return process


def ask_process(process: subprocess.Popen[bytes], request: object) -> Reply | None:
    """Send a request to the process of a service, and wait for the reply.

    Parameters
    ----------
    process : subprocess.Popen
        Process that `start_process` returned.
    request : object
        The request, which must be picklable.

    Returns
    -------
    Reply or None
        None if the process ended without a reply.
    """
    assert process.stdin is not None
    assert process.stdout is not None
    with suppress(OSError):
        send(process.stdin, (_REQUEST_NUMBER, request))
    reply = receive(process.stdout)
    while reply == READY or isinstance(reply, Progress):
        reply = receive(process.stdout)
    if not isinstance(reply, Reply):
        return None
    return reply


def end_process(process: subprocess.Popen[bytes]) -> int:
    """Close the pipes of a service, which ends its process, and return its exit status."""
    for stream in (process.stdin, process.stdout):
        assert stream is not None
        with suppress(OSError):
            stream.close()
    return process.wait()
