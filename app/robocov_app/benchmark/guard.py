"""Detection of a user's controller that uses channels that no robot has: files, connections or processes.

The guard detects mistakes and simple cheating, but it is not a sandbox: only verify controllers that you
would also run. It uses the audit events of Python. An action is forbidden if it is caused by a function in
one of the controller's own modules. Actions of a compiler, and of other packages while they are imported, are
allowed.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Collection
from pathlib import Path
from types import FrameType
from typing import Any

from robocov.controllers.user_modules import MODULE_PREFIX

_COMPILERS = frozenset(("numba", "llvmlite"))
"""Packages that may write files and load libraries when they compile a function of the controller."""
_IMPORT_MODULE = "importlib._bootstrap"
"""Module of the standard library that executes imports."""
_DATA_FOLDER = str(Path(__file__).parent)
"""Folder of the suite's references and of the bundled results, which a controller must not read."""
_MAX_VIOLATIONS = 20
"""Maximum number of violations that are listed."""
_FORBIDDEN_PREFIXES = (
    "ctypes.dlopen",
    "mmap.",
    "os.exec",
    "os.fork",
    "os.link",
    "os.mkdir",
    "os.posix_spawn",
    "os.remove",
    "os.rename",
    "os.rmdir",
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


class Guard:
    """Prevents the modules of a controller from using channels that no robot has.

    Parameters
    ----------
    modules : collection of str
        Names of the controller's own modules and packages. Files of the user are always included.

    Attributes
    ----------
    violations : list of str
        Forbidden actions that the controller attempted, without duplicates.
    """

    def __init__(self, modules: Collection[str] = ()) -> None:
        self.violations: list[str] = []
        self._modules = frozenset(modules)

    def install(self) -> None:
        """Start to guard this process, until it ends, because audit hooks cannot be removed."""
        # Importing the user's modules must not write bytecode files.
        sys.dont_write_bytecode = True
        sys.addaudithook(self._audit)

    def _audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        """Handle an audit event; raise PermissionError if it is forbidden and the controller causes it."""
        action = _describe_action(event, arguments)
        if action is None or not self._is_caused_by_controller(sys._getframe(1)):
            return
        if action not in self.violations and len(self.violations) < _MAX_VIOLATIONS:
            self.violations.append(action)
        raise PermissionError(f"a controller must not do this: {action}")

    def _is_caused_by_controller(self, frame: FrameType | None) -> bool:
        """Return whether a frame was called, directly or indirectly, by a function of the controller."""
        while frame is not None:
            module = str(frame.f_globals.get("__name__", ""))
            package = module.partition(".")[0]
            if package in _COMPILERS or module == _IMPORT_MODULE:
                return False
            if module.startswith(MODULE_PREFIX) or module in self._modules or package in self._modules:
                return True
            frame = frame.f_back
        return False


def _describe_action(event: str, arguments: tuple[Any, ...]) -> str | None:
    """Describe the action of an audit event; return None if the action is allowed."""
    if event == "open":
        return _describe_opening(*arguments[:3])
    if event.startswith(_FORBIDDEN_PREFIXES):
        detail = next((str(value) for value in arguments if isinstance(value, str | bytes | Path)), "")
        return f"{event} {detail}".strip()
    return None


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
    return None
