"""A folder that one process works in at a time."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from robocov.errors import OutputError

_NAME = ".lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes from the same folder; the lock ends with this process, however that ends.

    Raises
    ------
    OutputError
        When another process has it.
    """
    path = folder / _NAME
    try:
        # not inherited by processes that are started: their lives are their own
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
    try:
        if not _taken(descriptor):
            raise OutputError(f"{folder}: another process is at work in this folder; wait until it has ended")
        yield
    finally:
        os.close(descriptor)


if sys.platform == "win32":
    import msvcrt

    def _taken(descriptor: int) -> bool:
        """Lock the first byte of a file, if nobody has."""
        with suppress(OSError):
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            return True
        return False

else:
    import fcntl

    def _taken(descriptor: int) -> bool:
        """Lock a file, if nobody has; where the file system knows no locks, go on without."""
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:
            return True
        return True
