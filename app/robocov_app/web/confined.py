"""Files of a served window: only those below the folder that was named, whatever is typed in the window."""

import os
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import robocov
import robocov_app
from robocov.compiled import open_cache_folder
from robocov.errors import InputError
from robocov.files.array_files import ArrayCache
from robocov.mapfile import list_bundled_maps

# Python's audit events, and which of their arguments are paths
_READING = ("os.listdir", "os.scandir")
_EVENTS = {
    **dict.fromkeys((*_READING, "open", "os.mkdir", "os.rmdir", "os.remove"), 1),
    **dict.fromkeys(("os.truncate", "os.chmod", "os.utime"), 1),
    **dict.fromkeys(("os.rename", "os.link", "os.symlink"), 2),
}
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND

_read: tuple[Path, ...] | None = None  # None: everything is allowed
_written: tuple[Path, ...] = ()


class OutsideError(InputError, PermissionError):
    """A file that is not below the folder of a served window."""


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if _read is None or event not in _EVENTS:
        return
    reads = event in _READING or (event == "open" and not (arguments[2] or 0) & _WRITES)
    for given in arguments[: _EVENTS[event]]:
        if not isinstance(given, str | bytes | os.PathLike):
            continue  # what is open already
        path = Path(os.path.realpath(os.fsdecode(given)))
        compiled = "__pycache__" in path.parts
        if not any(path.is_relative_to(root) for root in (_read if reads or compiled else _written)):
            raise OutsideError(f"{os.fsdecode(given)}: outside of the folder that is served")


@cache
def _add_hook() -> None:
    sys.addaudithook(_audit)  # for the rest of the process


@contextmanager
def confined(folder: Path) -> Iterator[None]:
    """Let the process read and write files only below a folder, and read those that programs consist of.

    Python itself asks: what is typed, named in a session or linked to is held to this. Raises OutsideError.
    """
    global _read, _written
    _add_hook()
    programs = *sysconfig.get_paths().values(), sys.prefix, sys.base_prefix, "/dev", "/proc", "/usr/share"
    packages = (Path(str(module.__file__)).parent for module in (robocov, robocov_app))
    places: tuple[str | Path, ...] = (
        *programs,
        *packages,
        *(path.parent for path in list_bundled_maps().values()),
    )
    arrays = ArrayCache.open_default()
    caches = [each for each in (open_cache_folder(), arrays and arrays.folder) if each]
    before = tempfile.tempdir
    with tempfile.TemporaryDirectory(prefix="robocov-") as own:
        tempfile.tempdir = own
        ours: tuple[str | Path, ...] = folder, own, os.devnull, "/dev/shm", *caches
        _written = tuple(Path(os.path.realpath(each)) for each in ours)
        _read = (*_written, *(Path(os.path.realpath(each)) for each in places))
        try:
            yield
        finally:
            _read, tempfile.tempdir = None, before
