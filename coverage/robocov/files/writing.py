"""Writing of files that appear completely or not at all."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from robocov.errors import OutputError, describe_error, quote

_SPECIAL_FILES = {"d": "a folder", "p": "a named pipe", "s": "a socket", "c": "a device", "b": "a device"}
"""Kinds of files that are not regular, by the first character of the mode."""
_MAX_SUFFIX_CHARACTERS = 16
"""Length from which the ending of a file name does not count as the suffix of a format."""
_FLUSH_THREADS = 8
"""Number of threads that flush files at the same time."""


@contextmanager
def replace_file(target: Path, *, durable: bool = True) -> Iterator[Path]:
    """Provide a temporary file that replaces the target when the ``with`` block ends.

    If the ``with`` block raises an error, the temporary file is removed and the target does not change. If
    the target is a link, the file to which it points is replaced. An existing file keeps its permissions.

    Parameters
    ----------
    target : Path
        The file to create or replace.
    durable : bool
        Whether to flush the file to the disk before it replaces the target.

    Yields
    ------
    Path
        The temporary file, next to the target. It has the suffix of the target, by which writers may choose a
        format.

    Raises
    ------
    OutputError
        If the file cannot be written, or `target` is not a regular file.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     target = Path(folder) / "note.txt"
    ...     with replace_file(target) as temporary:
    ...         _ = temporary.write_text("complete")
    ...     target.read_text()
    'complete'
    """
    real_target = resolve_target(target)
    suffix = target.suffix if len(target.suffix) < _MAX_SUFFIX_CHARACTERS else ""
    temporary = real_target.with_name(f".robocov-{secrets.token_hex(6)}.part{suffix}")
    try:
        yield temporary
        if durable:
            _flush(temporary)
        # If the target exists, its permissions are kept.
        with suppress(FileNotFoundError):
            temporary.chmod(stat.S_IMODE(real_target.stat().st_mode))
        temporary.replace(real_target)
    except OSError as error:
        raise _build_error(target, f"cannot be written: {describe_error(error)}") from error
    finally:
        with suppress(OSError):  # Fails if the file has been renamed, or was never written.
            temporary.unlink()


def resolve_target(target: Path) -> Path:
    """Find the file that would be replaced by writing to a path.

    Parameters
    ----------
    target : Path
        A file that may not exist yet, or a link to a file.

    Returns
    -------
    Path
        The file. It differs from `target` if this is a link.

    Raises
    ------
    OutputError
        If the path is a broken link or not a regular file, or cannot be accessed.
    """
    try:
        real_target = target.resolve(strict=True) if target.is_symlink() else target
        mode = real_target.stat().st_mode
    except FileNotFoundError as error:
        if target.is_symlink():
            raise _build_error(target, "expected a file, got a broken link") from error
        return target
    except (OSError, RuntimeError, ValueError) as error:
        # Before Python 3.13, circular links raise RuntimeError.
        raise _build_error(target, f"cannot be written: {describe_error(error)}") from error
    if not stat.S_ISREG(mode):
        kind = _SPECIAL_FILES.get(stat.filemode(mode)[0], "something else")
        raise _build_error(target, f"expected a file, got {kind}")
    return real_target


def flush_to_disk(paths: Iterable[Path]) -> None:
    """Flush files and folders to the disk, several at the same time.

    Parameters
    ----------
    paths : iterable of Path
        Existing files and folders.
    """
    from concurrent.futures import ThreadPoolExecutor

    # A thread that flushes a file mostly waits for the disk.
    with ThreadPoolExecutor(_FLUSH_THREADS) as threads:
        list(threads.map(_flush, paths))


def _flush(path: Path) -> None:
    if not path.is_dir():
        with path.open("rb+") as file:
            os.fsync(file.fileno())
        return
    with suppress(OSError):  # Not every system can flush folders.
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _build_error(target: Path, message: str) -> OutputError:
    name = str(target)
    return OutputError(f"{name if name.isprintable() else quote(name)}: {message}")
