"""Locks on folders, so that two processes do not write to one folder."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from robocov.errors import OutputError, describe_error

_UNSUPPORTED_ERRORS = frozenset({errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP})
"""Error numbers of file systems that cannot lock files."""


@contextmanager
def lock_folder(folder: Path, name: str = ".lock", *, remove: bool = False) -> Iterator[None]:
    """Lock a folder within a ``with`` block.

    The lock is also released when the process ends for any reason. On file systems that cannot lock files,
    the block runs without a lock.

    Parameters
    ----------
    folder : Path
        The folder to lock; it must exist.
    name : str
        Name of the lock file in the folder.
    remove : bool
        Whether to remove the lock file at the end.

    Raises
    ------
    OutputError
        If another process has locked the folder, or the folder cannot be written to.
    """
    # Importing the package takes a tenth of a second, and most commands lock nothing.
    from filelock import FileLock, Timeout

    path = folder / name
    # The thread that leaves the block may differ from the one that entered it.
    lock = FileLock(path, mode=0o644, timeout=0, thread_local=False)
    try:
        lock.acquire()
    except Timeout:
        raise OutputError(
            f"{folder}: another process is using this folder; wait until it has ended"
        ) from None
    except OSError as error:
        if error.errno not in _UNSUPPORTED_ERRORS:
            raise OutputError(f"{folder}: cannot be written to: {describe_error(error)}") from error
    except NotImplementedError:
        pass  # The file system cannot lock files.
    try:
        yield
    finally:
        if remove:
            # The file is removed while it is locked, so that no other process holds a lock on it. On a system
            # that cannot remove open files, it remains, which does no harm.
            with suppress(OSError):
                path.unlink()
        lock.release()
