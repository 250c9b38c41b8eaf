"""Detection of a user's controller that uses channels that no robot has: files, connections or processes.

The guard is for a process that does nothing but call a controller. It uses the audit events of Python, and
forbids the actions in `_FORBIDDEN_PREFIXES`, writing files, and reading the data of the benchmark or the
memory of other processes. They are allowed only to a compiler, and to other packages while they are imported.

Python code can change its own process, so this is a tripwire and not a sandbox: only verify controllers that
you would also run.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
import sysconfig
from collections.abc import Callable, Collection, Iterator
from functools import cache
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import robocov.compiled
import robocov_app
from robocov.controllers.user_modules import find_own_modules

_COMPILERS = ("numba", "llvmlite")
"""Packages that, like `robocov.compiled`, may write files and load libraries when they compile functions."""
_IMPORT_FILE = "<frozen importlib._bootstrap>"
"""Name in place of a file for the code of Python that imports modules."""
_IMPORT_FUNCTION = "_find_and_load"
"""Function in `_IMPORT_FILE` that imports the module in its variable ``name``."""
_DATA_FOLDER = str(Path(__file__).parent)
"""Folder of the suite's references and of the bundled results, which a controller must not read."""
_PROCESS_PATTERN = re.compile(r"/proc/(\d+)/")
"""Beginning of the paths of files that give access to a process."""
_FROZEN_PATTERN = re.compile(r"<frozen (.+)>")
"""Name in place of a file for a module that is part of the Python executable."""
_FORBIDDEN_PREFIXES = (
    "ctypes.dlopen",
    "fcntl.",
    "mmap.",
    "os.chmod",
    "os.exec",
    "os.fork",
    "os.kill",
    "os.link",
    "os.mkdir",
    "os.posix_spawn",
    "os.remove",
    "os.rename",
    "os.rmdir",
    "os.setxattr",
    "os.spawn",
    "os.symlink",
    "os.system",
    "os.truncate",
    "os.utime",
    "shutil.",
    "socket.",
    "sqlite3.",
    "subprocess.",
    "_thread.start_new_thread",
    "_posixsubprocess.",
)
"""Beginnings of the names of audit events that a controller must not cause."""
_WRITE_FLAGS = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
"""Flags with which a file is opened for writing."""


def install_guard(
    report_violation: Callable[[str], object],
    report_reading: Callable[[str], object],
    own_packages: Collection[str] = (),
) -> None:
    """Guard this process until it ends, because audit hooks cannot be removed.

    Parameters
    ----------
    report_violation : callable
        Receives a description of each forbidden action. The action then raises PermissionError.
    report_reading : callable
        Receives the path of each file that is read, apart from those of Python and installed packages.
    own_packages : collection of str
        Names of the modules and packages that belong to the controller.
    """
    # Importing the user's modules must not write bytecode files.
    sys.dont_write_bytecode = True
    callers = _Callers(own_packages)

    is_checking = False

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal is_checking
        action = _describe_action(event, arguments)
        path = _find_opened_file(event, arguments)
        # The check itself reads files.
        if is_checking or (action is None and path is None):
            return
        is_checking = True
        try:
            if callers.is_trusted_call(sys._getframe(1)):
                return
        finally:
            is_checking = False
        if action is not None:
            report_violation(action)
            raise PermissionError(f"a controller must not do this: {action}")
        if path is not None and not callers.is_library_file(path):
            report_reading(path)

    sys.addaudithook(audit)


class _Callers:
    """Decides whether an action was caused by a compiler, or by the import of an installed package.

    A frame is recognized by its code, which must be in the file of the package. The name of a module or of a
    file would not be enough, because a controller can execute its own code under any name.

    Parameters
    ----------
    own_packages : collection of str
        Names of the modules and packages that belong to the controller.
    """

    def __init__(self, own_packages: Collection[str]) -> None:
        self._own_packages = frozenset(name.partition(".")[0] for name in own_packages)
        own_folders = [_find_folder(name) for name in self._own_packages]
        self._own_folders = tuple(folder for folder in own_folders if folder is not None)
        compiler_folders = [folder for name in _COMPILERS if (folder := _find_folder(name))]
        self._compiler_paths = (*compiler_folders, os.path.realpath(robocov.compiled.__file__))
        folders = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")]
        folders += [str(Path(path).parent) for path in (robocov.__file__, robocov_app.__file__)]
        self._library_folders = tuple(os.path.realpath(folder) + os.sep for folder in folders)

    def is_trusted_call(self, frame: FrameType | None) -> bool:
        """Return whether a compiler or an import called a frame, without own code in between."""
        while frame is not None:
            code = frame.f_code
            file = _find_file(code)
            if not self.is_library_file(file) or code not in _load_codes(file):
                return False
            if file.startswith(self._compiler_paths):
                return True
            if (code.co_filename, code.co_name) == (_IMPORT_FILE, _IMPORT_FUNCTION):
                return not self._is_own_module(frame.f_locals["name"])
            frame = frame.f_back
        return False

    def is_library_file(self, file: str) -> bool:
        """Return whether a file belongs to Python or to an installed package other than the controller's."""
        return file.startswith(self._library_folders) and not file.startswith(self._own_folders)

    def _is_own_module(self, name: str) -> bool:
        """Return whether a module belongs to the controller."""
        return name.partition(".")[0] in self._own_packages or bool(find_own_modules(f"import {name}"))


def _find_folder(package: str) -> str | None:
    """Return the folder of a package with a separator at its end; None if it is not installed."""
    spec = importlib.util.find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        return None
    return os.path.realpath(spec.submodule_search_locations[0]) + os.sep


def _find_file(code: CodeType) -> str:
    """Return the file that code names; for a module in the Python executable, its file in the library."""
    frozen_name = _FROZEN_PATTERN.fullmatch(code.co_filename)
    if frozen_name is None:
        return os.path.realpath(code.co_filename)
    path = Path(sysconfig.get_path("stdlib"), *frozen_name[1].split("."))
    return os.path.realpath(f"{path}.py")


@cache
def _load_codes(file: str) -> frozenset[CodeType]:
    """Return the code of a module and of all functions in its file; empty if the file cannot be compiled."""
    try:
        module_code = compile(Path(file).read_bytes(), file, "exec", dont_inherit=True)
    except (OSError, SyntaxError, ValueError):
        return frozenset()
    return frozenset(_list_codes(module_code))


def _list_codes(code: CodeType) -> Iterator[CodeType]:
    """Yield a code object and those of all functions in it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _list_codes(constant)


def _describe_action(event: str, arguments: tuple[Any, ...]) -> str | None:
    """Describe the action of an audit event; return None if the action is allowed."""
    if event == "open":
        return _describe_opening(*arguments[:3])
    if event.startswith(_FORBIDDEN_PREFIXES):
        detail = next((str(value) for value in arguments if isinstance(value, str | bytes | Path)), "")
        return f"{event} {detail}".strip()
    return None


def _find_opened_file(event: str, arguments: tuple[Any, ...]) -> str | None:
    """Return the path of the file that an audit event opens; None if it opens no file."""
    if event != "open" or isinstance(arguments[0], int):
        return None
    return os.path.realpath(os.fsdecode(arguments[0]))


def _describe_opening(path: Any, mode: Any, flags: Any) -> str | None:
    """Describe the opening of a file; return None if it is allowed."""
    if isinstance(path, int):
        return None
    name = os.path.realpath(os.fsdecode(path))
    writes = isinstance(flags, int) and bool(flags & _WRITE_FLAGS)
    if isinstance(mode, str):
        writes = writes or any(character in mode for character in "wax+")
    if writes:
        return f"writing {name}"
    if name.startswith(_DATA_FOLDER) and not name.endswith((".py", ".pyc")):
        return f"reading {name}"
    process = _PROCESS_PATTERN.match(name)
    if process is not None and int(process[1]) != os.getpid():
        return f"reading {name}"
    return None
