"""The process that does tasks: ``python -m robocov_app.sweep.worker``, for a `LocalPool` only.

It ends when nobody is there any more who could give it a task, also in the midst of one.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import queue
import signal
import sys
import threading
from contextlib import suppress
from io import BufferedReader

READY = "ready"
"""What a worker says when it has begun."""

_SET_DEATH_SIGNAL = 1
"""``PR_SET_PDEATHSIG`` of Linux."""


def main() -> None:
    """Do tasks until there are no more."""
    # Ctrl-C is for the parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.version_info >= (3, 14):
        # the engine's own frames would take the place of the controller's
        faulthandler.enable(c_stack=False)
    else:
        faulthandler.enable()
    _end_with_parent()
    source = os.fdopen(os.dup(sys.stdin.fileno()), "rb")
    target = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    # a controller of a user's may read and print what it likes
    with open(os.devnull, "rb") as nothing:  # noqa: PTH123 - it is no file
        os.dup2(nothing.fileno(), sys.stdin.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    inbox: queue.SimpleQueue[object] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(source, inbox), daemon=True).start()

    # what takes long is imported once somebody listens
    from robocov_app.live.messages import send
    from robocov_app.sweep.performing import perform

    with suppress(OSError):  # nobody may be there any more
        send(target, READY)
        while True:
            task = inbox.get()
            _forget_complaints()
            send(target, perform(task))  # type: ignore[arg-type]


def _end_with_parent() -> None:
    """Have the kernel end this process with its parent, where it can; see `_listen` for the others."""
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).prctl(_SET_DEATH_SIGNAL, signal.SIGKILL)


def _listen(source: BufferedReader, inbox: queue.SimpleQueue[object]) -> None:
    """Take tasks on; end the process when the parent's end of the pipe is closed, also while modules load."""
    if source.peek(1):
        from robocov_app.live.messages import receive

        while (task := receive(source)) is not None:
            inbox.put(task)
    os._exit(0)


def _forget_complaints() -> None:
    """Empty the file that stderr is, so that it holds those of one task only and does not grow for ever."""
    with suppress(OSError, ValueError):
        sys.stderr.flush()
        os.ftruncate(sys.stderr.fileno(), 0)


if __name__ == "__main__":
    main()
