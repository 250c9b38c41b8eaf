"""Kernels: plain loops over arrays, which numba compiles when they are first called.

Numba is imported when a kernel is first called. Its cache stores the machine code in the user's cache folder,
in a folder named after a digest of this installation of robocov, so that the code of another version is never
used.

The environment variable ``NUMBA_CACHE_DIR`` selects another folder for the machine code, and
``ROBOCOV_CACHE`` another folder for all caches of robocov. If ``ROBOCOV_CACHE`` is set but empty, nothing is
cached. With ``NUMBA_DISABLE_JIT=1``, kernels run as Python.
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
"""Whether kernels are compiled. The environment variable ``NUMBA_DISABLE_JIT`` disables the compiler."""
_MIN_KEPT_VERSIONS = 4
"""Number of most recently used versions whose machine code is always kept."""
_MIN_UNUSED_DAYS = 1.0
"""Machine code used within this time is always kept, because a program may still be running it."""

_CACHE_ERRORS = (OSError, EOFError, pickle.UnpicklingError)
"""Errors that numba raises if its cache cannot be read or written. Kernels themselves raise none of these."""

_compilation_listeners: list[Callable[[str], None]] = []
"""Functions to call before each compilation; see `report_compilation`."""
_lock = threading.RLock()
"""Lock of the import of numba, and of the dispatchers of kernels."""
_is_cache_usable = True
"""False after the cache has failed in this process."""
_must_interpret: Callable[[str, tuple[Any, ...]], bool] | None = None
"""Function that selects kernels to run as Python; see `interpret_kernels`."""
_kernels: weakref.WeakSet[Kernel] = weakref.WeakSet()
"""All kernels of this process."""
_ADDRESS = re.compile(" at 0x[0-9a-f]+")
"""Address of a function in the text of a numba type."""


def kernel(function: _Function) -> _Function:
    """Decorate a function so that it is compiled to machine code when it is first called.

    The arguments of the function are numbers, arrays, and named tuples of these. The function may call other
    kernels, from any module, and read global numbers. The arithmetic is that of Python, without fused or
    reordered operations, so that the results have the same bits on all processors.

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
    """Decorate a function so that it is compiled as a part of each kernel that calls it.

    Use this for short functions in inner loops. A call updates the reference counts of all arrays that are
    passed, which can take longer than the arithmetic. Kernels that inline functions take longer to compile.

    Parameters
    ----------
    function : callable
        Function as for `kernel`.

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
        The Python function.
    name : str
        Module and name of the function.
    is_inlined : bool
        Whether the function becomes part of the kernels that call it.
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
            # If Ctrl+C is pressed while numba inspects the arguments, numba raises a SystemError.
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
        """Return numba's dispatcher for the function, which is built by the first call.

        Returns
        -------
        numba dispatcher
            Compiled function, which compiles itself for further types of arguments.
        """
        with _lock:
            if self._dispatcher is None or (self._is_cached and not _is_cache_usable):
                self._is_cached = _is_cache_usable and open_cache_folder() is not None
                self._dispatcher = self._build_dispatcher()
            return self._dispatcher

    def _build_dispatcher(self) -> Any:
        """Build numba's dispatcher for the function, with or without a cache."""
        numba = import_numba()
        options = {"error_model": "numpy", "forceinline": self.is_inlined}
        # A dispatcher reads the cache folder from numba's configuration when it is built.
        previous_folder = numba.config.CACHE_DIR
        try:
            if self._is_cached:
                numba.config.CACHE_DIR = str(open_cache_folder())
                with suppress(RuntimeError):  # Functions without a file, as in a doctest, cannot be cached.
                    return numba.njit(self.py_func, cache=True, **options)
            return numba.njit(self.py_func, **options)
        finally:
            numba.config.CACHE_DIR = previous_folder


def interpret_kernels(must_interpret: Callable[[str, tuple[Any, ...]], bool] | None) -> None:
    """Run some kernels as Python from now on. They return the same results, but take longer.

    Parameters
    ----------
    must_interpret : callable or None
        Called with the `Kernel.name` of a kernel and the positional arguments of a call. Returns whether to
        run the kernel as Python. If it is None, no kernel is run as Python.
    """
    global _must_interpret
    _must_interpret = must_interpret


def is_interpreting() -> bool:
    """Return whether some kernels may be run as Python; see `interpret_kernels`.

    Returns
    -------
    bool
        False if all kernels are compiled.
    """
    return _must_interpret is not None


def list_compiled_kernels() -> dict[str, list[str]]:
    """List the kernels that this process has compiled or loaded from the cache.

    Returns
    -------
    dict of str to list of str
        For each name of a kernel, the types of arguments for which there is machine code, formatted as by
        `describe_argument_types` and sorted.
    """
    compiled: dict[str, list[str]] = {}
    for item in _kernels:
        if item.is_compiled:
            types = [_format_types(signature) for signature in item.get_dispatcher().signatures]
            compiled[item.name] = sorted(types)
    return compiled


def describe_argument_types(arguments: tuple[Any, ...]) -> str:
    """Return a text that names numba's types of the arguments of a kernel.

    Parameters
    ----------
    arguments : tuple
        Positional arguments of a call.

    Returns
    -------
    str
        Names of the types. Equal types have equal texts, in every process.
    """
    numba = import_numba()
    return _format_types([numba.typeof(argument) for argument in arguments])


def _format_types(types: Iterable[Any]) -> str:
    """Return a text that names numba types."""
    # The name of the type of a kernel contains the address of its function, which differs between processes.
    return _ADDRESS.sub("", "; ".join(map(str, types)))


def _disable_cache() -> None:
    """Continue without the cache for the rest of the process. Kernels then build new dispatchers."""
    global _is_cache_usable
    _is_cache_usable = False


def import_numba() -> ModuleType:
    """Import numba, and let kernels call other kernels.

    Numba uses the package coverage.py, and mistakes any module `coverage` for it. In a checkout, this is the
    source folder of robocov, which is therefore hidden from the import.

    Returns
    -------
    module
        The package numba.
    """
    with _lock:
        return _import_numba()


@functools.cache
def _import_numba() -> ModuleType:
    """Import numba once, register the type of kernels, and report compilations to the listeners."""
    is_source_root = False
    if "numba" not in sys.modules and "coverage" not in sys.modules:
        spec = importlib.util.find_spec("coverage")
        is_source_root = spec is not None and spec.origin is None
    if is_source_root:
        # With None as its module, an import of this name fails as if there were no such package.
        sys.modules["coverage"] = None  # type: ignore[assignment]
    try:
        import numba
        from numba.core import event  # This is the documented event API of numba.
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
        """Passes the names of kernels to the functions of `report_compilation`."""

        def on_start(self, started: Any) -> None:
            """Report the kernel that is compiled."""
            for report in tuple(_compilation_listeners):
                report(started.data["dispatcher"].__name__)

        def on_end(self, ended: Any) -> None:
            """Ignore the end of a compilation."""

    register("numba:compile", CompilationListener())
    return numba


@contextmanager
def report_compilation(report: Callable[[str], None]) -> Iterator[None]:
    """Call a function before each compilation of a kernel within a ``with`` block.

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
    """Open the folder with the machine code of this version, or create it.

    A folder that belongs to another user, or to which other users may write, is not used, because its code
    would run as this user. Nor is a folder that cannot be written to.

    Returns
    -------
    Path or None
        The folder. None if nothing is cached.
    """
    configured = os.environ.get("NUMBA_CACHE_DIR")
    root = Path(configured) if configured else find_cache_root()
    if root is None:
        return None
    parent = root if configured else root / "kernels"
    folder = open_private_folder(parent / _compute_installation_digest())
    if folder is not None:
        # If the time of the last use cannot be stored, the folder may be removed early and is built again.
        with suppress(OSError):
            os.utime(folder)
        _remove_unused_versions(folder.parent)
    return folder


def _compute_installation_digest(package: Path = Path(__file__).parent) -> str:
    """Return a digest of an installation: its sources and folder, and the versions of Python and numba.

    Numba finds cached machine code by the folder of the sources and by the versions of Python and numba. Each
    combination has its own cache folder, so that a kernel counts as compiled only if numba will find its
    code.
    """
    numba_version = importlib.metadata.version("numba")
    digest = hashlib.blake2b(digest_size=10)
    # Names of folders may contain bytes that are not valid UTF-8.
    digest.update(os.fsencode(package.resolve()))
    digest.update(f"\n{sys.implementation.cache_tag} {numba_version}\n".encode())
    for path in sorted(package.rglob("*.py")):
        source = path.read_bytes()
        digest.update(f"{path.relative_to(package).as_posix()} {len(source)}\n".encode())
        digest.update(source)
    return f"robocov-{digest.hexdigest()}"


def _remove_unused_versions(parent: Path) -> None:
    """Remove old versions' machine code, except recently used ones."""
    cutoff_time = time.time() - _MIN_UNUSED_DAYS * 24 * 3600
    versions: list[tuple[float, Path]] = []
    for folder in parent.glob("robocov-*"):
        with suppress(OSError):  # Another process may have removed the folder.
            versions.append((folder.stat().st_mtime, folder))
    for last_use_time, folder in sorted(versions, reverse=True)[_MIN_KEPT_VERSIONS:]:
        if last_use_time < cutoff_time:
            shutil.rmtree(folder, ignore_errors=True)
