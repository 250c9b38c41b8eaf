"""Kernels: plain loops over arrays, which numba compiles when they are first called.

Numba is imported only then. Its own cache keeps the machine code in the user's cache folder, in a folder
named after a digest of this installation of robocov, so that code of another version is never used. The
environment variable ``NUMBA_CACHE_DIR`` selects another folder, and ``ROBOCOV_CACHE`` one for all caches of
robocov; if the latter is empty, nothing is cached. With ``NUMBA_DISABLE_JIT=1`` kernels run as Python.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import pickle
import re
import shutil
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numpy as np

from robocov.files.cache_folders import find_cache_root, open_private_folder

_Function = TypeVar("_Function", bound=Callable[..., Any])

IS_COMPILER_ENABLED = os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")
"""Whether kernels are compiled; the environment variable ``NUMBA_DISABLE_JIT`` prevents it."""
_MAX_KEPT_VERSIONS = 4
"""Number of most recently used versions whose machine code is kept."""
_MIN_UNUSED_DAYS = 1.0
"""Machine code that was used more recently is kept in any case: a program may still be running with it."""

_compilation_listeners: list[Callable[[str], None]] = []
"""Functions that `notify_compilation` calls."""
_lock = threading.RLock()
_is_cache_usable = True
_must_interpret: Callable[[str, tuple[Any, ...]], bool] | None = None
_kernels: weakref.WeakSet[Kernel] = weakref.WeakSet()
_ADDRESS = re.compile(" at 0x[0-9a-f]+")
_CACHE_ERRORS = (OSError, EOFError, pickle.UnpicklingError)
"""Errors that numba raises if its cache cannot be read or written; kernels themselves raise none of these."""


def kernel(function: _Function) -> _Function:
    """Decorate a function so that it is compiled to machine code when it is first called.

    Its arguments are numbers, arrays, and named tuples of these. It may call other kernels, from any module,
    and read global numbers. Arithmetic is that of Python, without fused or reordered operations, so that the
    results have the same bits on all processors.

    Parameters
    ----------
    function : callable
        Plain Python that numba can compile in its "nopython" mode.

    Returns
    -------
    callable
        A `Kernel`, or the function itself if the compiler is disabled.

    Examples
    --------
    >>> @kernel
    ... def double(x):
    ...     return 2.0 * x
    >>> double(0.5)
    1.0
    >>> double(x=4.0)
    8.0
    """
    if not IS_COMPILER_ENABLED:
        return function
    return Kernel(function)  # type: ignore[return-value]


def inlined_kernel(function: _Function) -> _Function:
    """Compile a function as a part of each kernel that calls it.

    Use it for short functions in inner loops: a call updates the reference counts of all arrays that it
    passes, which can take longer than the arithmetic. Inlining makes the calling kernels slower to compile.

    Parameters
    ----------
    function : callable
        See `kernel`.

    Returns
    -------
    callable
        A `Kernel`, or the function itself if the compiler is disabled.
    """
    if not IS_COMPILER_ENABLED:
        return function
    return Kernel(function, is_inlined=True)  # type: ignore[return-value]


class Kernel:
    """A function that is compiled when it is first called.

    Attributes
    ----------
    py_func : callable
        The function in Python.
    name : str
        Its module and name.
    is_inlined : bool
        Whether it becomes part of the kernels that call it.
    """

    def __init__(self, function: Callable[..., Any], *, is_inlined: bool = False) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        self.name = f"{function.__module__}.{function.__qualname__}"
        self.is_inlined = is_inlined
        self._dispatcher: Any = None
        self._is_cached = False
        _kernels.add(self)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the compiled function; compile it first if there is no machine code for these types."""
        if _must_interpret is not None and _must_interpret(self.name, args):
            with np.errstate(all="ignore"):
                return self.py_func(*args, **kwargs)
        dispatcher = self._dispatcher or self.get_dispatcher()
        try:
            return dispatcher(*args, **kwargs)
        except SystemError as error:
            # numba turns a Ctrl-C that arrives while it inspects the arguments into a SystemError.
            if isinstance(error.__cause__, KeyboardInterrupt):
                raise KeyboardInterrupt from None
            raise
        except _CACHE_ERRORS:
            if not _is_cache_usable:
                raise
            # Continue without the cache if it is damaged or the disk is full.
            _disable_cache()
            return self.get_dispatcher()(*args, **kwargs)

    @property
    def is_compiled(self) -> bool:
        """Whether this process has machine code of the kernel, for any types."""
        return self._dispatcher is not None and len(self._dispatcher.signatures) > 0

    def get_dispatcher(self) -> Any:
        """Return numba's dispatcher for the function; import numba if this is the first kernel.

        Returns
        -------
        numba dispatcher
        """
        with _lock:
            if self._dispatcher is None or (self._is_cached and not _is_cache_usable):
                self._is_cached = _is_cache_usable and open_cache_folder() is not None
                self._dispatcher = self._build_dispatcher()
            return self._dispatcher

    def _build_dispatcher(self) -> Any:
        numba = import_numba()
        options = {"error_model": "numpy", "forceinline": self.is_inlined}
        # A dispatcher looks up the cache folder when it is built. The setting is restored afterwards.
        previous = numba.config.CACHE_DIR
        try:
            if self._is_cached:
                numba.config.CACHE_DIR = str(open_cache_folder())
                with suppress(RuntimeError):  # functions without a file, as in a doctest, cannot be cached
                    return numba.njit(self.py_func, cache=True, **options)
            return numba.njit(self.py_func, **options)
        finally:
            numba.config.CACHE_DIR = previous


def interpret_kernels(must_interpret: Callable[[str, tuple[Any, ...]], bool] | None) -> None:
    """Run some kernels as Python, which gives the same results, only more slowly.

    Parameters
    ----------
    must_interpret : callable or None
        Takes the `Kernel.name` of a kernel and the positional arguments of a call, and returns whether to run
        it as Python. None runs none as Python.
    """
    global _must_interpret
    _must_interpret = must_interpret


def is_interpreting() -> bool:
    """Return whether some kernels may be run as Python; see `interpret_kernels`.

    Returns
    -------
    bool
    """
    return _must_interpret is not None


def list_compiled_kernels() -> dict[str, list[str]]:
    """Return the kernels that this process has compiled, or loaded from the cache.

    Returns
    -------
    dict of str to list of str
        For each name of a kernel, the types for which there is machine code, as from
        `describe_argument_types`, in alphabetical order.
    """
    compiled: dict[str, list[str]] = {}
    for item in _kernels:
        if item.is_compiled:
            types = [_format_types(signature) for signature in item.get_dispatcher().signatures]
            compiled[item.name] = sorted(types)
    return compiled


def describe_argument_types(arguments: tuple[Any, ...]) -> str:
    """Return numba's types of the arguments of a kernel, as text.

    Parameters
    ----------
    arguments : tuple

    Returns
    -------
    str
    """
    numba = import_numba()
    return _format_types([numba.typeof(argument) for argument in arguments])


def _format_types(types: Iterable[Any]) -> str:
    # The type of a kernel that is passed to another one contains the address of its function.
    return _ADDRESS.sub("", "; ".join(map(str, types)))


def _disable_cache() -> None:
    """Continue without the cache for the rest of the process; kernels build new dispatchers when needed."""
    global _is_cache_usable
    _is_cache_usable = False


def import_numba() -> ModuleType:
    """Import numba despite a folder `coverage` on the path, and let kernels call other kernels.

    Numba takes any module `coverage` for coverage.py, including our source root of that name.

    Returns
    -------
    module
    """
    with _lock:
        return _import_numba()


@functools.cache
def _import_numba() -> ModuleType:
    is_source_root = False
    if "numba" not in sys.modules and "coverage" not in sys.modules:
        spec = importlib.util.find_spec("coverage")
        is_source_root = spec is not None and spec.origin is None
    if is_source_root:
        sys.modules["coverage"] = None  # type: ignore[assignment]
    try:
        import numba
        from numba.core import event  # documented as numba's event API
        from numba.extending import typeof_impl
    finally:
        if is_source_root:
            del sys.modules["coverage"]

    typeof: Callable[[Any], Any] = numba.typeof
    register: Callable[[str, event.Listener], None] = event.register

    @typeof_impl.register(Kernel)
    def type_kernel(called: Kernel, context: Any) -> Any:
        """Let numba see the dispatcher of a kernel that another kernel calls."""
        return typeof(called.get_dispatcher())

    class CompilationListener(event.Listener):
        """Passes the names of kernels to the functions of `notify_compilation`."""

        def on_start(self, started: Any) -> None:
            """Report the kernel that is compiled."""
            for report in tuple(_compilation_listeners):
                report(started.data["dispatcher"].__name__)

        def on_end(self, ended: Any) -> None:
            """Ignore the end of a compilation."""

    register("numba:compile", CompilationListener())
    return numba


@contextmanager
def notify_compilation(report: Callable[[str], None]) -> Iterator[None]:
    """Call a function right before each compilation of a kernel, as long as the context is open.

    Parameters
    ----------
    report : callable
        Called with the name of the kernel.
    """
    _compilation_listeners.append(report)
    try:
        yield
    finally:
        _compilation_listeners.remove(report)


@functools.cache
def open_cache_folder() -> Path | None:
    """Open the folder with the machine code of this version; create it if needed.

    A folder that belongs to somebody else, or that others may write to, is ignored, because code from it
    would run as this user. A folder that cannot be written to is ignored as well.

    Returns
    -------
    Path or None
        None if nothing is cached.
    """
    configured = os.environ.get("NUMBA_CACHE_DIR")
    root = Path(configured) if configured else find_cache_root()
    if root is None:
        return None
    parent = root if configured else root / "kernels"
    folder = open_private_folder(parent / _compute_installation_digest())
    if folder is not None:
        with suppress(OSError):
            os.utime(folder)
        _remove_unused_versions(folder.parent)
    return folder


def _compute_installation_digest(package: Path = Path(__file__).parent) -> str:
    """Return a digest of an installation: its sources and folder, and the versions of Python and numba.

    Numba looks for machine code by the folder of the sources and the versions of Python and numba. Each
    combination has its own cache folder, so that a kernel counts as ready only where numba will find it.
    """
    numba_version = importlib.metadata.version("numba")
    digest = hashlib.blake2b(digest_size=10)
    digest.update(f"{package.resolve()}\n{sys.implementation.cache_tag} {numba_version}\n".encode())
    for path in sorted(package.rglob("*.py")):
        source = path.read_bytes()
        digest.update(f"{path.relative_to(package).as_posix()} {len(source)}\n".encode())
        digest.update(source)
    return f"robocov-{digest.hexdigest()}"


def _remove_unused_versions(parent: Path) -> None:
    """Remove the machine code of versions of the library that have not been used for some time."""
    max_removal_time = time.time() - _MIN_UNUSED_DAYS * 24 * 3600
    last_used: list[tuple[float, Path]] = []
    for folder in parent.glob("robocov-*"):
        with suppress(OSError):
            last_used.append((folder.stat().st_mtime, folder))
    for use_time, folder in sorted(last_used, reverse=True)[_MAX_KEPT_VERSIONS:]:
        if use_time < max_removal_time:
            shutil.rmtree(folder, ignore_errors=True)
