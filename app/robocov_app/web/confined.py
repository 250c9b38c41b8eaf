"""Restriction of a process to the files below one folder, whatever a visitor types in a served window."""

import os
import sys
import sysconfig
import tempfile
from collections.abc import Iterable, Iterator
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

_READING_EVENTS = ("os.listdir", "os.scandir")
_PATH_COUNTS = {
    **dict.fromkeys((*_READING_EVENTS, "open", "os.mkdir", "os.rmdir", "os.remove"), 1),
    **dict.fromkeys(("os.truncate", "os.chmod", "os.utime"), 1),
    **dict.fromkeys(("os.rename", "os.link", "os.symlink"), 2),
}
"""Python's audit events, and how many of their first arguments are paths."""
_WRITE_FLAGS = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_SYSTEM_FOLDERS = ("/dev", "/proc", "/usr/share")

_readable: tuple[Path, ...] | None = None  # None: no restriction
_writable: tuple[Path, ...] = ()


class OutsideError(InputError, PermissionError):
    """A file that is not below the folder of a served window."""


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    """Raise OutsideError if an event of Python's audit hook is about a file that is not allowed."""
    if _readable is None or event not in _PATH_COUNTS:
        return
    is_reading = event in _READING_EVENTS
    if event == "open" and not (arguments[2] or 0) & _WRITE_FLAGS:
        is_reading = True
    for argument in arguments[: _PATH_COUNTS[event]]:
        if not isinstance(argument, str | bytes | os.PathLike):
            continue  # The number of a file that is already open.
        path = Path(os.path.realpath(os.fsdecode(argument)))
        is_compiled_code = "__pycache__" in path.parts
        roots = _readable if is_reading or is_compiled_code else _writable
        if not any(path.is_relative_to(root) for root in roots):
            raise OutsideError(f"{os.fsdecode(argument)}: outside of the folder that is served")


@cache
def _add_hook() -> None:
    sys.addaudithook(_audit)  # Hooks cannot be removed.


@contextmanager
def confine_files(folder: Path) -> Iterator[None]:
    """Let the process read and write only files below a folder, and read the files of programs.

    The restriction holds for every file that Python opens, whether it is typed, named in a session or linked.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OutsideError
        Where another file is opened.
    """
    global _readable, _writable
    _add_hook()
    programs = _list_program_folders()
    arrays = ArrayCache.open_default()
    caches = [
        cache_folder for cache_folder in (open_cache_folder(), arrays and arrays.folder) if cache_folder
    ]
    previous_temporary_folder = tempfile.tempdir
    with tempfile.TemporaryDirectory(prefix="robocov-") as temporary_folder:
        tempfile.tempdir = temporary_folder
        _writable = _resolve_all([folder, temporary_folder, os.devnull, "/dev/shm", *caches])
        _readable = (*_writable, *_resolve_all(programs))
        try:
            yield
        finally:
            _readable = None
            tempfile.tempdir = previous_temporary_folder


def _list_program_folders() -> list[str | Path]:
    """Return the folders of Python, its packages, the system's data and the bundled maps."""
    packages = [Path(str(module.__file__)).parent for module in (robocov, robocov_app)]
    maps = [path.parent for path in list_bundled_maps().values()]
    return [*sysconfig.get_paths().values(), sys.prefix, sys.base_prefix, *_SYSTEM_FOLDERS, *packages, *maps]


def _resolve_all(paths: Iterable[str | Path]) -> tuple[Path, ...]:
    return tuple(Path(os.path.realpath(path)) for path in paths)
