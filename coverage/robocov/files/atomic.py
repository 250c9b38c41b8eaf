"""Files that appear whole or not at all, and folders that one process works in at a time."""

import os
import secrets
import stat
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from robocov.errors import OutputError, describe_error, quote

_KINDS = {"d": "a folder", "p": "a named pipe", "s": "a socket", "c": "a device", "b": "a device"}
"""Kinds of files that are no regular ones, by the first character of the mode."""
_LONGEST_SUFFIX = 16
"""Characters; what is longer is no suffix that a writer goes by."""


@contextmanager
def written(target: Path, *, durable: bool = True) -> Iterator[Path]:
    """Give a path beside `target` to write to; rename it to `target` when all went well, else remove it.

    The path has the suffix of `target`, for writers that go by it. A `durable` file is on the disk before it
    gets its name. Through a link, the file that it points to is replaced, not the link; its permissions stay.
    """
    real = writable(target)
    suffix = target.suffix if len(target.suffix) < _LONGEST_SUFFIX else ""
    part = real.with_name(f".robocov-{secrets.token_hex(6)}.part{suffix}")
    try:
        yield part
        if durable:
            _on_disk(part)
        with suppress(FileNotFoundError):
            part.chmod(stat.S_IMODE(real.stat().st_mode))
        part.replace(real)
    except OSError as error:
        raise _refused(target, f"cannot be written: {describe_error(error)}") from error
    finally:
        with suppress(OSError):  # it is gone, or where the folder is none, there never was one
            part.unlink()


def writable(target: Path) -> Path:
    """Return the file that is replaced where `target` is written, which may be a link to it.

    Raises `OutputError` when that is no regular file, a link that leads nowhere, or cannot be looked at.
    """
    try:
        real = target.resolve(strict=True) if target.is_symlink() else target
        mode = real.stat().st_mode
    except FileNotFoundError as error:
        if target.is_symlink():
            raise _refused(target, "is a link to nothing, but a file was wanted") from error
        return target
    except (OSError, RuntimeError, ValueError) as error:  # a circle of links was a RuntimeError before 3.13
        raise _refused(target, f"cannot be written: {describe_error(error)}") from error
    if not stat.S_ISREG(mode):
        kind = _KINDS.get(stat.filemode(mode)[0], "something else")
        raise _refused(target, f"is {kind}, but a file was wanted")
    return real


def _refused(target: Path, what: str) -> OutputError:
    name = str(target)
    return OutputError(f"{name if name.isprintable() else quote(name)}: {what}")


def on_disk(paths: Iterable[Path]) -> None:
    """Return when files and folders are on the disk: all at once, which takes as long as one of them."""
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(8) as threads:  # most of what it takes is waiting
        list(threads.map(_on_disk, paths))


def _on_disk(path: Path) -> None:
    if path.is_dir():
        with suppress(OSError):  # not every system knows that of folders
            descriptor = os.open(path, os.O_RDONLY)
            try:
                os.fsync(descriptor)
            finally:
                os.close(descriptor)
    else:
        with path.open("rb+") as file:
            os.fsync(file.fileno())


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
            raise OutputError(f"{folder}: cannot be written to: {describe_error(error)}") from error
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
    with suppress(OSError):
        return os.path.samestat(os.fstat(descriptor), path.lstat())
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
