"""Talking with a process of our own from a window that must not wait for it."""

from __future__ import annotations

import contextlib
import sys
import threading
from abc import ABC, abstractmethod
from typing import IO, TYPE_CHECKING, Any, BinaryIO

from robocov_app.live.messages import receive, send
from robocov_app.live.own_process import started

if TYPE_CHECKING:
    from collections.abc import Iterable

_PIPE = 1 << 20
"""Bytes; more is not allowed to everybody."""


class Talk(ABC):
    """One process, with a thread that writes to it and one that reads: no call waits for it.

    What is to be said is kept by whoever derives from this, and changed with `changed` held and notified;
    all of that has to be there before the threads are, that is before ``super().__init__()``.

    Parameters
    ----------
    module : str
        What the process runs.

    Attributes
    ----------
    changed : Condition
    ended : bool
        Whether the process has, for whatever reason.
    """

    def __init__(self, module: str) -> None:
        self._process = started(module)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        _widen(self._process.stdout)
        self.changed = threading.Condition()
        self._closed = False
        self.ended = False
        streams = (self._write, self._process.stdin), (self._read, self._process.stdout)
        self._threads = [
            threading.Thread(target=call, args=(stream,), daemon=True) for call, stream in streams
        ]
        for thread in self._threads:
            thread.start()

    @abstractmethod
    def taken(self) -> Any:
        """Return what there is to be said now, once, and None for nothing; `changed` is held."""

    @abstractmethod
    def messages(self, taken: Any) -> Iterable[object]:
        """Return the messages that say what was taken; nobody waits for this."""

    @abstractmethod
    def hear(self, message: Any) -> None:
        """Keep what the process has said."""

    def close(self) -> None:
        """Let the process end, and wait for that: it takes a moment, whatever it is doing."""
        with self.changed:
            self._closed = True
            self.changed.notify()
        self._process.kill()
        self._process.wait()
        for thread in self._threads:
            thread.join()

    def _write(self, stream: BinaryIO) -> None:
        # when the process has ended, reading says so
        with contextlib.suppress(OSError), stream:
            while True:
                with self.changed:
                    taken = None
                    while not self._closed and (taken := self.taken()) is None:
                        self.changed.wait()
                    if self._closed:
                        return
                for message in self.messages(taken):
                    send(stream, message)

    def _read(self, stream: BinaryIO) -> None:
        try:
            with stream:
                while (message := receive(stream)) is not None:
                    self.hear(message)
        finally:
            self.ended = True


def _widen(pipe: IO[bytes]) -> None:
    """Let a pipe hold a whole answer where the system can: its reader then wakes less often."""
    if sys.platform == "linux":
        import fcntl

        with contextlib.suppress(OSError):
            fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _PIPE)
