"""Modules of ours that run in processes of their own, and talk over their standard streams."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import IO, BinaryIO


def started(module: str, *, stderr: IO[bytes] | None = None) -> subprocess.Popen[bytes]:
    """Start a module as a process; pipes lead to its standard input and from its standard output.

    What it complains of goes to `stderr`, by default to that of this process.
    """
    # it is to import what this one does
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        environment.setdefault(name, "1")
    return subprocess.Popen(
        # -P: what lies in the working folder is not meant
        [sys.executable, "-P", "-m", module],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=stderr,
        env=environment,
    )


def own_streams() -> tuple[BinaryIO, BinaryIO]:
    """Return where a process that was started comes to hear, and to say something.

    What anything prints goes to stderr, not among the messages.
    """
    # Ctrl-C is for the parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    target = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return sys.stdin.buffer, target
