"""Handling of Ctrl+C that keeps the results so far."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Self

INTERRUPTED = 130
"""Exit status of a command that was interrupted."""

_received_signals: set[int] = set()
"""Signals that the command has received."""


def was_interrupted() -> bool:
    """Return whether a `KeyboardInterrupt` was caused by Ctrl+C, and not raised by a user's controller."""
    return bool(_received_signals)


@contextmanager
def note_interrupts() -> Iterator[None]:
    """Record Ctrl+C for `was_interrupted` within the context, and raise `KeyboardInterrupt` as usual."""
    _received_signals.clear()
    is_main_thread = threading.current_thread() is threading.main_thread()
    if not is_main_thread or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        # Signals cannot be observed here, so any KeyboardInterrupt is attributed to Ctrl+C.
        _received_signals.add(signal.SIGINT)
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        _received_signals.add(number)
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGINT) is interrupt:
            signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def suppress_controller_errors() -> Iterator[None]:
    """Suppress all exceptions of a user's controller in the context, but not the user's Ctrl+C.

    A controller may raise any exception, even `SystemExit` or a `KeyboardInterrupt` of its own. Ctrl+C can be
    told from the latter only within `note_interrupts` or `Interruption`; elsewhere, it is suppressed, too.
    """
    try:
        yield
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) and was_interrupted():
            raise


class Interruption:
    """Context in which the first Ctrl+C or SIGTERM only sets a flag, and a second one ends the command.

    Attributes
    ----------
    requested : bool
        Whether the user has requested to stop.
    """

    def __init__(self) -> None:
        self.requested = False
        self._previous_handlers: dict[signal.Signals, signal._HANDLER] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._previous_handlers[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *exception: object) -> None:
        for number, handler in self._previous_handlers.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal: note the first one, and raise KeyboardInterrupt at the second."""
        _received_signals.add(number)
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
        with suppress(OSError):
            os.write(2, b"\nstopping; press Ctrl+C again to stop immediately\n")


def block_interrupts() -> None:
    """Block Ctrl+C while child processes are started, because a terminal sends it to all of them.

    Children inherit the blocked signal.
    """
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def unblock_interrupts() -> None:
    """Undo `block_interrupts`."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
