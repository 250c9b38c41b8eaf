"""Detection of a user's controller that uses channels that no robot has: files, connections or processes.

The guard is for a process that does nothing but call a controller. It uses the audit events of Python, and
replaces functions that cause none. It forbids the actions in `_FORBIDDEN_PREFIXES` and
`_FUNCTIONS_WITHOUT_EVENTS`, writing files, listing folders, reading the data of the benchmark, and looking at
other processes. Packages may do so while they are imported. A compiler may write machine code, but
only to the cache folder of this process, whose name no other process knows.

Python code can change its own process, and compiled code can call the system without any event, so this is a
tripwire and not a sandbox: only verify controllers that you would also run.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import sys
import sysconfig
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import robocov.compiled
import robocov_app
from robocov.compiled import open_cache_folder
from robocov.controllers.user_modules import is_own_module

_COMPILERS = ("numba", "llvmlite")
"""Packages that, like `robocov.compiled`, may write machine code and look up functions of libraries."""
_IMPORT_FILE = "<frozen importlib._bootstrap>"
"""Name in place of a file for the code of Python that imports modules."""
_IMPORT_FUNCTION = "_find_and_load"
"""Function in `_IMPORT_FILE` that imports the module in its variable ``name``."""
_DATA_FOLDER = str(Path(__file__).parents[1])
"""Folder of the suite's references and of the bundled results, which a controller must not read."""
_PROCESS_PATTERN = re.compile(r"/proc/(\d+)(?=/|$)")
"""Part of the paths of files that give access to a process, also below ``/proc/self/root``."""
_FROZEN_PATTERN = re.compile(r"<frozen (.+)>")
"""Name in place of a file for a module that is part of the Python executable."""
_LISTING_EVENTS = ("os.listdir", "os.scandir")
"""Audit events of listing a folder."""
_FORBIDDEN_PREFIXES = (
    *_LISTING_EVENTS,
    "ctypes.dlopen",
    "ctypes.dlsym",
    "fcntl.",
    "mmap.",
    "os.chdir",
    "os.chmod",
    "os.chown",
    "os.exec",
    "os.fork",
    "os.kill",
    "os.link",
    "os.lockf",
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
    "resource.",
    "shutil.",
    "socket.",
    "sqlite3.",
    "subprocess.",
    "syslog.",
    "_thread.start_",
)
"""Beginnings of the names of audit events that a controller must not cause."""
_FUNCTIONS_WITHOUT_EVENTS = {
    "os": (
        "memfd_create",
        "mkfifo",
        "mknod",
        "nice",
        "openpty",
        "pidfd_open",
        "posix_openpt",
        "sched_setaffinity",
        "sched_setparam",
        "sched_setscheduler",
        "setpgid",
        "setpgrp",
        "setpriority",
        "setsid",
    ),
    "readline": ("append_history_file", "read_history_file", "read_init_file", "write_history_file"),
    "signal": ("pidfd_send_signal",),
    "subprocess": ("_fork_exec",),
    "sys": ("activate_stack_trampoline",),
    "threading": ("_start_joinable_thread", "_start_new_thread"),
    "_cffi_backend": ("load_library",),
    "_dbm": ("open",),
    "_gdbm": ("open",),
    "_multiprocessing": ("SemLock", "sem_unlink"),
    "_posixshmem": ("shm_open", "shm_unlink"),
    "_posixsubprocess": ("fork_exec",),
    "_thread": ("start_joinable_thread", "start_new", "start_new_thread"),
    "_tkinter": ("create",),
}
"""Functions by module that a controller must not call, and that cause no audit event in some versions of
Python. Each reads or changes something that another process can see, gives access to such functions, or
starts a thread, which could run between the calls of the controller. Modules that are not installed are
skipped."""
_LOOKUP_FUNCTIONS = ("access", "lstat", "open", "readlink", "stat")
"""Functions of the module os that look up a path. Audit events do not contain their argument ``dir_fd``, and
only that of ``open`` exists. Without these checks, a process could see which files another one has opened."""
_COMPILER_EVENTS = ("_multiprocessing.SemLock", "ctypes.dlopen", "ctypes.dlsym", "ctypes.dlsym/handle")
"""Events that a compiler may cause, such as for parallel loops, in addition to those in its cache folder."""
_CACHE_EVENTS = ("open", "os.mkdir", "os.remove", "os.rename", "os.utime", *_LISTING_EVENTS)
"""Audit events that a compiler may cause in its cache folder."""
_WRITE_FLAGS = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
"""Flags with which a file is opened for writing."""


@dataclass(frozen=True)
class _Action:
    """Something that code in this process is about to do.

    Attributes
    ----------
    event : str
        Name of the audit event, or of a function without one.
    paths : tuple of str
        Absolute paths of the files and folders that it concerns.
    prohibition : str
        Description of an action that is forbidden; empty if a file is only read.
    """

    event: str
    paths: tuple[str, ...]
    prohibition: str


def install_guard(
    report_violation: Callable[[str], object],
    report_reading: Callable[[str], object],
    own_packages: Collection[str] = (),
    own_files: Collection[str] = (),
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
    own_files : collection of str
        Paths of the source files of the controller.
    """
    # Importing the user's modules must not write bytecode files.
    sys.dont_write_bytecode = True
    policy = _Policy(own_packages, own_files)
    is_checking = False

    def check(action: _Action | None) -> None:
        nonlocal is_checking
        # The check itself reads files.
        if is_checking or action is None:
            return
        is_checking = True
        try:
            # Frame 0 is this function, and frame 1 the audit hook or the replaced function. Frame 2 acts.
            if policy.allows(action, sys._getframe(2)):
                return
        finally:
            is_checking = False
        if action.prohibition:
            report_violation(action.prohibition)
            raise PermissionError(f"a controller must not do this: {action.prohibition}")
        report_reading(action.paths[0])

    def audit(event: str, arguments: tuple[Any, ...]) -> None:
        check(_describe_event(event, arguments))

    _replace_functions(check)
    sys.addaudithook(audit)


def _replace_functions(check: Callable[[_Action | None], None]) -> None:
    """Replace functions without sufficient audit events by functions that check each call first."""
    for module_name, names in _FUNCTIONS_WITHOUT_EVENTS.items():
        try:
            module = importlib.import_module(module_name)
        except ImportError:
            # Some modules do not exist on all systems.
            continue
        for name in names:
            if hasattr(module, name):
                _forbid_function(module, name, check)
    for name in _LOOKUP_FUNCTIONS:
        _check_lookups(name, check)


def _forbid_function(module: Any, name: str, check: Callable[[_Action | None], None]) -> None:
    """Replace a function that a controller must not call."""
    function = getattr(module, name)
    full_name = f"{module.__name__}.{name}"

    def call_after_check(*arguments: Any, **options: Any) -> Any:
        check(_Action(full_name, (), f"calling {full_name}"))
        return function(*arguments, **options)

    # Python's own modules read constants of some classes that are replaced.
    for attribute in ("SEM_VALUE_MAX", "_rebuild"):
        if hasattr(function, attribute):
            setattr(call_after_check, attribute, getattr(function, attribute))
    _replace_function(module, name, call_after_check)


def _check_lookups(name: str, check: Callable[[_Action | None], None]) -> None:
    """Replace a function of the module os that looks up a path."""
    function = getattr(os, name)

    def call_after_check(path: Any, *arguments: Any, **options: Any) -> Any:
        if not isinstance(path, int):
            # The path of an object is requested only once, because the next one could be different.
            path = os.fspath(path)
        check(_describe_lookup(name, path, options.get("dir_fd")))
        return function(path, *arguments, **options)

    _replace_function(os, name, call_after_check)


def _replace_function(module: Any, name: str, replacement: Callable[..., Any]) -> None:
    """Replace a function of a module, and of the module in which it is implemented."""
    function = getattr(module, name)
    for owner in (module, sys.modules.get(function.__module__ or "")):
        if owner is not None and getattr(owner, name, None) is function:
            setattr(owner, name, replacement)


class _Policy:
    """Decides whether an action is allowed, depending on the code that causes it.

    A frame is recognized by its code, which must be in the file of the package. The name of a module or of a
    file would not be enough, because a controller can execute its own code under any name.

    Parameters
    ----------
    own_packages : collection of str
        Names of the modules and packages that belong to the controller.
    own_files : collection of str
        Paths of the source files of the controller.
    """

    def __init__(self, own_packages: Collection[str], own_files: Collection[str]) -> None:
        self._own_packages = frozenset(name.partition(".")[0] for name in own_packages)
        own_folders = [_find_folder(name) for name in self._own_packages]
        self._own_folders = tuple(folder for folder in own_folders if folder is not None)
        compiler_folders = [folder for name in _COMPILERS if (folder := _find_folder(name))]
        self._compiler_paths = (*compiler_folders, os.path.realpath(robocov.compiled.__file__))
        folders = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")]
        folders += [str(Path(path).parent) for path in (robocov.__file__, robocov_app.__file__)]
        self._library_folders = tuple(os.path.realpath(folder) + os.sep for folder in folders)

        self._importlib_folder = os.path.realpath(Path(importlib.__file__).parent) + os.sep
        self._own_files = frozenset(map(os.path.realpath, own_files))
        # Later changes of sys.path are ignored.
        search_folders = [*map(Path, sys.path), *[Path(file).parent for file in self._own_files]]
        self._search_folders = tuple(os.path.realpath(folder) + os.sep for folder in search_folders)
        self._cache_folder = _find_cache_folder()
        self._bytecode_settings = _get_bytecode_settings()

    def allows(self, action: _Action, frame: FrameType | None) -> bool:
        """Return whether an action in a frame is allowed.

        Any code may read and list the files of Python and of installed packages, and Python looks for
        modules in the folders on ``sys.path``. Compilers and imports may do more, unless code of the
        controller is between them and the action. No code may read the data of the benchmark.
        """
        if action.event == "open" and _is_benchmark_data(action.paths[0]):
            return False
        return self._is_allowed_to_all(action, frame) or self._is_caused_by_library(action, frame)

    def _is_allowed_to_all(self, action: _Action, frame: FrameType | None) -> bool:
        """Return whether any code may cause an action: use installed files, or search for modules."""
        if not action.paths:
            return False
        is_listing = action.event in _LISTING_EVENTS
        if (is_listing or not action.prohibition) and all(map(self._is_library_path, action.paths)):
            return True
        if not action.prohibition and f"{action.paths[0]}{os.sep}" in self._search_folders:
            # An entry of sys.path may be an archive of modules.
            return True
        return is_listing and self._is_search(action.paths[0], frame)

    def _is_caused_by_library(self, action: _Action, frame: FrameType | None) -> bool:
        """Return whether a compiler or an import causes an action, with no code of the controller between."""
        while frame is not None:
            code = frame.f_code
            file = _find_file(code)
            if not self._is_library_path(file) or code not in _load_codes(file):
                return False
            if file.startswith(self._compiler_paths) and self._may_compiler_cause(action):
                return True
            if (code.co_filename, code.co_name) == (_IMPORT_FILE, _IMPORT_FUNCTION):
                # With other settings, imports would read and write bytecode files in any folder.
                is_unchanged = _get_bytecode_settings() == self._bytecode_settings
                return is_unchanged and not self._is_own_module(frame.f_locals["name"])
            frame = frame.f_back
        return False

    def _is_search(self, folder: str, frame: FrameType | None) -> bool:
        """Return whether Python lists a folder on ``sys.path``, or below, in order to find a module."""
        if frame is None or not f"{folder}{os.sep}".startswith(self._search_folders):
            return False
        file = _find_file(frame.f_code)
        return file.startswith(self._importlib_folder) and frame.f_code in _load_codes(file)

    def _may_compiler_cause(self, action: _Action) -> bool:
        """Return whether an action is one that a compiler needs."""
        if action.event in _COMPILER_EVENTS:
            return True
        if not action.prohibition:
            # The compiler reads the functions that it compiles.
            return action.paths[0] in self._own_files or self._is_in_cache(action.paths[0])
        is_in_cache = bool(action.paths) and all(map(self._is_in_cache, action.paths))
        return action.event in _CACHE_EVENTS and is_in_cache

    def _is_in_cache(self, path: str) -> bool:
        """Return whether a path is that of the cache folder, or of something in it."""
        return self._cache_folder is not None and f"{path}{os.sep}".startswith(self._cache_folder)

    def _is_library_path(self, path: str) -> bool:
        """Return whether a path belongs to Python or to an installed package other than the controller's."""
        folder = f"{path}{os.sep}"
        return folder.startswith(self._library_folders) and not folder.startswith(self._own_folders)

    def _is_own_module(self, name: str) -> bool:
        """Return whether a module belongs to the controller."""
        top_name = name.partition(".")[0]
        return top_name in self._own_packages or is_own_module(top_name)


def _find_folder(package: str) -> str | None:
    """Return the folder of a package with a separator at its end; None if it is not installed."""
    spec = importlib.util.find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        return None
    return os.path.realpath(spec.submodule_search_locations[0]) + os.sep


def _get_bytecode_settings() -> tuple[bool, str | None]:
    """Return whether imports write no bytecode files, and the folder that replaces the usual one, if any."""
    return sys.dont_write_bytecode, sys.pycache_prefix


def _find_cache_folder() -> str | None:
    """Return this process's folder for machine code, with a separator at its end; None if it has none."""
    configured = os.environ.get("NUMBA_CACHE_DIR")
    folder = Path(configured) if configured else open_cache_folder()
    return None if folder is None else os.path.realpath(folder) + os.sep


def _find_file(code: CodeType) -> str:
    """Return the file of a code object.

    For a module that is part of the Python executable, this is its source file in the standard library.
    """
    match = _FROZEN_PATTERN.fullmatch(code.co_filename)
    if match is None:
        return os.path.realpath(code.co_filename)
    path = Path(sysconfig.get_path("stdlib"), *match[1].split("."))
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


def _describe_event(event: str, arguments: tuple[Any, ...]) -> _Action | None:
    """Describe the action of an audit event; return None if it is not forbidden and reads no file."""
    if event == "open":
        return _describe_opening(*arguments[:3])
    if event == "import" and arguments[1]:
        # An extension module is opened without a further event. Other imports have no file here.
        return _Action("open", (os.path.realpath(_convert_path(arguments[1])),), "")
    if not event.startswith(_FORBIDDEN_PREFIXES):
        return None
    names = [_convert_path(value) for value in arguments if isinstance(value, str | bytes | os.PathLike)]
    if event in _LISTING_EVENTS and arguments[0] is None:
        names = [os.curdir]
    paths = tuple(os.path.realpath(name) for name in names)
    return _Action(event, paths, " ".join([event, *names[:1]]))


def _describe_lookup(name: str, path: Any, folder: int | None) -> _Action | None:
    """Describe the lookup of a path; return None unless it is forbidden."""
    if folder is not None:
        return _Action(f"os.{name}", (), f"calling os.{name} with dir_fd")
    if isinstance(path, int):
        return None
    absolute_path = os.path.normpath(Path.cwd() / _convert_path(path))
    if _refers_to_other_process(absolute_path):
        return _Action(f"os.{name}", (absolute_path,), f"looking up {absolute_path}")
    return None


def _is_benchmark_data(path: str) -> bool:
    return path.startswith(_DATA_FOLDER) and not path.endswith((".py", ".pyc"))


def _refers_to_other_process(path: str) -> bool:
    """Return whether a path leads to a file that gives access to another process."""
    return any(int(number) != os.getpid() for number in _PROCESS_PATTERN.findall(path))


def _convert_path(path: Any) -> str:
    """Return a path as a plain string, whatever methods its class has."""
    name = os.fspath(path)
    if isinstance(name, bytes):
        return os.fsdecode(b"".join([name]))
    return str.__str__(name)


def _describe_opening(path: Any, mode: Any, flags: Any) -> _Action | None:
    """Describe the opening of a file; return None for the number of a file that is already open."""
    if isinstance(path, int):
        return None
    name = os.path.realpath(_convert_path(path))
    is_writing = isinstance(flags, int) and bool(flags & _WRITE_FLAGS)
    if isinstance(mode, str):
        is_writing = is_writing or any(character in mode for character in "wax+")
    prohibition = ""
    if not isinstance(path, str | bytes):
        # The object could give the function that opens the file a different path.
        prohibition = f"opening {name} through a path object"
    elif is_writing:
        prohibition = f"writing {name}"
    elif _refers_to_other_process(name) or _is_benchmark_data(name):
        prohibition = f"reading {name}"
    return _Action("open", (name,), prohibition)
