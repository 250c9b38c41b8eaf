"""The standard streams of the process, which a user's controller may close or replace."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import IO

_DESCRIPTORS = {"stdout": 1, "stderr": 2}
_NAMES = {"stdout": "standard output", "stderr": "standard error"}


class StandardStreams:
    """Standard output and standard error as they are now, with spare descriptors to restore them."""

    def __init__(self) -> None:
        self._streams: dict[str, IO[str]] = {}
        self._spares: dict[str, int] = {}
        for name, descriptor in _DESCRIPTORS.items():
            self._streams[name] = getattr(sys, name)
            with suppress(OSError):
                self._spares[name] = os.dup(descriptor)

    def close(self) -> None:
        """Give the spare descriptors back."""
        while self._spares:
            os.close(self._spares.popitem()[1])

    def find_closed(self) -> list[str]:
        """Return the names of the streams that cannot be written to any more, as messages call them."""
        return [_NAMES[name] for name in self._streams if self._is_closed(name)]

    def restore(self) -> list[str]:
        """Open what was closed, put back what was replaced, and return what `find_closed` does."""
        closed = self.find_closed()
        for name, stream in self._streams.items():
            descriptor, spare = _DESCRIPTORS[name], self._spares.get(name)
            if self._is_closed(name) and spare is not None:
                os.dup2(spare, descriptor)
            if stream.closed:
                stream = open(  # noqa: SIM115 - it stays open to the end
                    descriptor, "w", encoding="utf-8", errors="replace", closefd=False
                )
                self._streams[name] = stream
            setattr(sys, name, stream)
        return closed

    def _is_closed(self, name: str) -> bool:
        if self._streams[name].closed:
            return True
        if name not in self._spares:
            return False
        try:
            os.fstat(_DESCRIPTORS[name])
        except OSError:
            return True
        return False
