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
"""Python's audit events for file access, and how many of their first arguments are paths."""
_OPEN_FLAGS_ARGUMENT = 2
"""Index of the flags among the arguments of the event "open"; they are None if they are unknown."""
_WRITE_FLAGS = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_SYSTEM_FOLDERS = ("/dev", "/proc", "/usr/share")


class OutsideError(InputError, PermissionError):
    """A served window may not use a file because it is outside the window's folder."""


class FileConfinement:
    """Restricts this process to files in some folders, whether paths are typed, stored or symbolic links.

    Parameters
    ----------
    readable, writable : tuple of Path
        Folders in which files may be read, and in which they may be written, with symbolic links resolved.

    Attributes
    ----------
    is_active : bool
        Whether the restriction applies.
    """

    def __init__(self, readable: tuple[Path, ...], writable: tuple[Path, ...]) -> None:
        self.is_active = True
        self._readable = readable
        self._writable = writable
        # Python cannot remove an audit hook; this one does nothing once the confinement is inactive.
        sys.addaudithook(self.check_event)

    def check_event(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Audit hook of Python: raise OutsideError if an event accesses a file that is not allowed.

        Parameters
        ----------
        event : str
            Name of the audit event, such as "open".
        arguments : tuple
            Its arguments; the first ones are paths, and the third one of "open" contains the flags.
        """
        if not self.is_active or event not in _PATH_COUNTS:
            return
        is_reading = event in _READING_EVENTS
        if event == "open":
            flags = arguments[_OPEN_FLAGS_ARGUMENT] or 0
            is_reading = not flags & _WRITE_FLAGS
        for argument in arguments[: _PATH_COUNTS[event]]:
            if not isinstance(argument, str | bytes | os.PathLike):
                continue  # A file descriptor: the file is already open.
            path = Path(os.path.realpath(os.fsdecode(argument)))
            # Python may write compiled modules next to the modules that it may read.
            is_compiled_code = "__pycache__" in path.parts
            roots = self._readable if is_reading or is_compiled_code else self._writable
            if not any(path.is_relative_to(root) for root in roots):
                raise OutsideError(f"{os.fsdecode(argument)}: outside the served folder")


@contextmanager
def confine_files(folder: Path) -> Iterator[None]:
    """Restrict the process to files in a folder; it may also read the files of installed programs.

    The restriction holds for every file that Python opens, whether its path is typed, stored in a session or
    the target of a symbolic link. Temporary files go to a separate folder, which is removed at the end.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OutsideError
        Raised in this context by any attempt to open another file.
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
    """Make `tempfile`, also in libraries, create files in a new folder that is removed at the end."""
    previous_folder = tempfile.tempdir
    with tempfile.TemporaryDirectory(prefix="robocov-") as folder:
        tempfile.tempdir = folder
        try:
            yield folder
        finally:
            tempfile.tempdir = previous_folder


def _list_program_folders() -> list[str | Path]:
    """Return the folders of Python and its packages, of system data, and of the bundled maps."""
    packages = [Path(str(module.__file__)).parent for module in (robocov, robocov_app)]
    maps = [path.parent for path in list_bundled_maps().values()]
    return [*sysconfig.get_paths().values(), sys.prefix, sys.base_prefix, *_SYSTEM_FOLDERS, *packages, *maps]


def _resolve_all(paths: Iterable[str | Path]) -> tuple[Path, ...]:
    return tuple(Path(os.path.realpath(path)) for path in paths)
