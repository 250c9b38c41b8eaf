"""Ctrl-C that keeps what is done."""

import os
import signal
import threading
from contextlib import suppress
from types import FrameType
from typing import Self

INTERRUPTED = 130  # exit status


class Interruption:
    """Context in which the first Ctrl-C (or SIGTERM) is only noted, for long loops; a second ends at once."""

    def __init__(self) -> None:
        self.requested = False
        self._former: dict[signal.Signals, signal._HANDLER] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._former[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *exception: object) -> None:
        for number, handler in self._former.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
        with suppress(OSError):
            os.write(2, b"\nstopping; Ctrl-C again ends at once\n")


def interruptible(now: bool) -> None:
    """Hold Ctrl C back, which a terminal sends to all processes, while one of them begins; or let it come."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK if now else signal.SIG_BLOCK, {signal.SIGINT})
