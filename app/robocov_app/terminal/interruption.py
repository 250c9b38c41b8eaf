"""Ctrl-C that keeps what is done."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Self

INTERRUPTED = 130  # exit status


_arrived: set[int] = set()
"""Signals that have arrived since the command began."""


def was_interrupted() -> bool:
    """Return whether a `KeyboardInterrupt` comes from Ctrl-C, rather than from a user's controller."""
    return bool(_arrived)


@contextmanager
def noting_interrupts() -> Iterator[None]:
    """Note Ctrl-C for `was_interrupted`, and raise `KeyboardInterrupt` as Python does by itself."""
    _arrived.clear()
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        _arrived.add(signal.SIGINT)  # it cannot be known
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        _arrived.add(number)
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGINT) is interrupt:
            signal.signal(signal.SIGINT, signal.default_int_handler)


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
        _arrived.add(number)
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
        with suppress(OSError):
            os.write(2, b"\nstopping; Ctrl-C again ends at once\n")


def interruptible(now: bool) -> None:
    """Hold Ctrl C back, which a terminal sends to all processes, while one of them begins; or let it come."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK if now else signal.SIG_BLOCK, {signal.SIGINT})
