"""The standard streams of the process, which a user's controller may close or replace."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import IO

_DESCRIPTORS = {"stdout": 1, "stderr": 2}
"""File descriptors of the streams."""
_LABELS = {"stdout": "standard output", "stderr": "standard error"}
"""Names of the streams in messages."""


class StandardStreams:
    """The initial standard output and standard error, with duplicated descriptors for restoring them."""

    def __init__(self) -> None:
        self._streams: dict[str, IO[str]] = {}
        self._duplicates: dict[str, int] = {}
        for name, descriptor in _DESCRIPTORS.items():
            self._streams[name] = getattr(sys, name)
            with suppress(OSError):
                self._duplicates[name] = os.dup(descriptor)

    def close(self) -> None:
        """Close the duplicated descriptors."""
        for descriptor in self._duplicates.values():
            os.close(descriptor)
        self._duplicates.clear()

    def list_closed_streams(self) -> list[str]:
        """Return the labels of the closed streams, such as "standard output"."""
        return [_LABELS[name] for name in self._streams if self._is_closed(name)]

    def restore(self) -> list[str]:
        """Restore streams that were closed or replaced.

        Returns
        -------
        list of str
            Labels of the streams that were closed; see `list_closed_streams`.
        """
        closed_labels = self.list_closed_streams()
        for name in _DESCRIPTORS:
            if self._is_closed(name) and name in self._duplicates:
                os.dup2(self._duplicates[name], _DESCRIPTORS[name])
            if self._streams[name].closed:
                self._streams[name] = _open_stream(_DESCRIPTORS[name])
            setattr(sys, name, self._streams[name])
        return closed_labels

    def _is_closed(self, name: str) -> bool:
        """Return whether a stream or its descriptor was closed."""
        if self._streams[name].closed:
            return True
        if name not in self._duplicates:
            return False
        try:
            os.fstat(_DESCRIPTORS[name])
        except OSError:
            return True
        return False


def _open_stream(descriptor: int) -> IO[str]:
    """Open a text stream on a descriptor, which stays open until the process ends."""
    return open(descriptor, "w", encoding="utf-8", errors="replace", closefd=False)
