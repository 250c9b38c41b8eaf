"""Restriction of a process to the files below one folder, for windows that visitors use."""

import os
import sys
import sysconfig
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
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


class OutsideError(InputError, PermissionError):
    """A file that is not below the folder of a served window."""


class FileConfinement:
    """Restriction of this process to files below some folders, whether paths are typed, stored or linked.

    Parameters
    ----------
    readable, writable : tuple of Path
        Folders from which files may be read, and in which they may be written, without symbolic links.

    Attributes
    ----------
    is_active : bool
        Whether the restriction holds.
    """

    def __init__(self, readable: tuple[Path, ...], writable: tuple[Path, ...]) -> None:
        self.is_active = True
        self._readable = readable
        self._writable = writable
        # Python cannot remove the hook, which does nothing once the confinement is no longer active.
        sys.addaudithook(self.check_event)

    def check_event(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Raise OutsideError if an event of Python's audit hooks is about a file that is not allowed."""
        if not self.is_active or event not in _PATH_COUNTS:
            return
        is_reading = event in _READING_EVENTS
        if event == "open" and not (arguments[2] or 0) & _WRITE_FLAGS:
            is_reading = True
        for argument in arguments[: _PATH_COUNTS[event]]:
            if not isinstance(argument, str | bytes | os.PathLike):
                continue  # The number of a file that is already open.
            path = Path(os.path.realpath(os.fsdecode(argument)))
            is_compiled_code = "__pycache__" in path.parts
            roots = self._readable if is_reading or is_compiled_code else self._writable
            if not any(path.is_relative_to(root) for root in roots):
                raise OutsideError(f"{os.fsdecode(argument)}: outside the served folder")


@contextmanager
def confine_files(folder: Path) -> Iterator[None]:
    """Allow the process to use only files below a folder, and to read the files of programs.

    The restriction holds for every file that Python opens, whether its path is typed, stored in a session or
    the target of a link. Temporary files are written to a separate folder, which is removed at the end.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OutsideError
        Where another file is opened.
    """
    arrays = ArrayCache.open_default()
    caches = [open_cache_folder(), None if arrays is None else arrays.folder]
    used_caches = [cache_folder for cache_folder in caches if cache_folder is not None]
    programs = _list_program_folders()
    with _use_own_temporary_folder() as temporary_folder:
        writable = _resolve_all([folder, temporary_folder, os.devnull, "/dev/shm", *used_caches])
        confinement = FileConfinement((*writable, *_resolve_all(programs)), writable)
        try:
            yield
        finally:
            confinement.is_active = False


@contextmanager
def _use_own_temporary_folder() -> Iterator[str]:
    """Let `tempfile`, also in libraries, create files in a new folder, which is removed at the end."""
    previous_folder = tempfile.tempdir
    with tempfile.TemporaryDirectory(prefix="robocov-") as folder:
        tempfile.tempdir = folder
        try:
            yield folder
        finally:
            tempfile.tempdir = previous_folder


def _list_program_folders() -> list[str | Path]:
    """Return the folders of Python, its packages, the system's data and the bundled maps."""
    packages = [Path(str(module.__file__)).parent for module in (robocov, robocov_app)]
    maps = [path.parent for path in list_bundled_maps().values()]
    return [*sysconfig.get_paths().values(), sys.prefix, sys.base_prefix, *_SYSTEM_FOLDERS, *packages, *maps]


def _resolve_all(paths: Iterable[str | Path]) -> tuple[Path, ...]:
    return tuple(Path(os.path.realpath(path)) for path in paths)
