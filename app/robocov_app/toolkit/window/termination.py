"""Ending of a window on SIGTERM or SIGHUP: drafts are written, and the process ends promptly.

If the loop of the window is running, the window closes without asking questions, and its draft is kept. If
the main thread is busy with something else, such as compiling, it cannot do that. Then a separate thread,
which the signal wakes, writes the drafts and ends the process.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from robocov_app.storage.autosave import flush_all

_SIGNALS = ("SIGTERM", "SIGHUP")
"""Signals that end the process; not all of them exist on every system."""
_LOOP_GRACE_S = 0.7
"""Time for the loop to notice that the process should end."""
_CLOSING_GRACE_S = 3.0
"""Time from the signal to the end if the loop has noticed it: videos are closed and settings saved."""
_CLOSED_GRACE_S = 0.1
"""Time for Python to exit once everything is closed."""
_FLUSH_S = 0.2
"""Maximum time for writing the drafts."""
_POLL_S = 0.02

_active: _Watcher | None = None


def is_ending() -> bool:
    """Return whether a signal has asked the process to end; if so, the caller must stop and close files."""
    if _active is None or not _active.number:
        return False
    _active.is_closing = True
    return True


@contextmanager
def ending_on_signals() -> Iterator[None]:
    """End the process promptly on SIGTERM and SIGHUP, unless it ignores them, as under nohup.

    The context has no effect outside the main thread, and within another such context.
    """
    global _active
    if _active is not None or threading.current_thread() is not threading.main_thread():
        yield
        return
    _active = watcher = _Watcher()
    try:
        watcher.start()
        yield
    except BaseException:
        watcher.note_closed(failed=True)
        raise
    else:
        watcher.note_closed(failed=False)
    finally:
        if not watcher.number:  # After a signal, the watcher still has to end the process.
            watcher.stop()
            _active = None


class _Watcher:
    """A thread that waits for signals, and ends the process if the main thread does not end it."""

    def __init__(self) -> None:
        self.number = 0  # Number of the signal that has arrived.
        self.is_closing = False
        self._closed_at: float | None = None
        self._status: int | None = None  # Exit status, once everything is closed.
        self._receiver, self._sender = socket.socketpair()
        self._sender.setblocking(False)
        self._previous_fd = -1
        self._previous_handlers: dict[signal.Signals, signal._HANDLER] = {}
        self._thread = threading.Thread(target=self._watch, name="termination", daemon=True)

    def start(self) -> None:
        """Start waiting for signals, except for those that the process ignores."""
        for name in _SIGNALS:
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                self._previous_handlers[number] = signal.signal(number, self._record_signal)
        # Python's handler runs only when the main thread executes Python code; this wakes our thread at once.
        self._previous_fd = signal.set_wakeup_fd(self._sender.fileno(), warn_on_full_buffer=False)
        self._thread.start()

    def note_closed(self, *, failed: bool) -> None:
        """Let the process end soon after a signal, because everything is closed and saved."""
        if self.number:
            with suppress(OSError, ValueError):
                sys.stdout.flush()
            self._status = 0
            if failed:
                self._status = 128 + self.number
            self._closed_at = time.monotonic()

    def stop(self) -> None:
        """Restore the previous handlers of signals, and end the thread."""
        signal.set_wakeup_fd(self._previous_fd)
        for number, handler in self._previous_handlers.items():
            if signal.getsignal(number) == self._record_signal:
                signal.signal(number, handler)
        self._sender.close()
        self._thread.join()
        self._receiver.close()

    def _record_signal(self, number: int, frame: FrameType | None) -> None:
        self.number = number

    def _watch(self) -> None:
        with suppress(OSError):
            while data := self._receiver.recv(64):
                numbers = [number for number in data if number in self._previous_handlers]
                if numbers:
                    self.number = numbers[0]
                    self._end()

    def _end(self) -> None:
        """Write the drafts, and end the process if the main thread does not end it in time."""
        start_s = time.monotonic()
        flush_all(_FLUSH_S)
        while time.monotonic() < self._compute_deadline(start_s):
            time.sleep(_POLL_S)
        if self._status is None:
            flush_all(_FLUSH_S)
            self._status = 128 + self.number
        os._exit(self._status)

    def _compute_deadline(self, start_s: float) -> float:
        if self._closed_at is not None:
            return self._closed_at + _CLOSED_GRACE_S
        if self.is_closing:
            return start_s + _CLOSING_GRACE_S
        return start_s + _LOOP_GRACE_S
