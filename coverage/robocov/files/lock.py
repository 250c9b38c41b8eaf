"""A folder that one process works in at a time."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from robocov.errors import OutputError, reason


@contextmanager
def locked(folder: Path, name: str = ".lock", *, remove: bool = False) -> Iterator[None]:
    """Lock the file `name` in a folder until this process ends, however that ends; then `remove` it.

    Raises `OutputError` when another process has it, or the folder cannot be written to.
    """
    path = folder / name
    while True:
        try:
            # not inherited by processes that are started: their lives are their own
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o644)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be written to: {reason(error)}") from error
        try:
            if not _taken(descriptor):
                what = "another process is at work in this folder; wait until it has ended"
                raise OutputError(f"{folder}: {what}")
            if not _is_at(descriptor, path):
                continue
            try:
                yield
            finally:
                if remove:
                    with suppress(OSError):
                        path.unlink()
            return
        finally:
            os.close(descriptor)


def _is_at(descriptor: int, path: Path) -> bool:
    """Return whether an open file still has its name, which whoever had the lock before may have removed."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.lstat())
    except OSError:
        return False


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
            pass
        return True
