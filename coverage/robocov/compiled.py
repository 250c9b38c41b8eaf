"""Kernels: plain loops over arrays, compiled by numba when they are first called.

Numba is imported only then. What it compiles is kept in the user's cache folder (``NUMBA_CACHE_DIR`` names
another one, else ``ROBOCOV_CACHE`` one for all that is kept, or none), by the code of a kernel and of all
kernels that it calls; an entry that is damaged, or of another numba or processor, counts as missing. No two
processes compile the same kernel at the same time: the second one waits, and loads it.
With ``NUMBA_DISABLE_JIT=1`` kernels run as Python.
"""

from __future__ import annotations

import ctypes
import gc
import importlib.util
import os
import pickle
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from functools import cached_property, update_wrapper
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import platformdirs

from robocov.errors import OutputError
from robocov.files.array_files import ArrayCache
from robocov.files.atomic import locked

if TYPE_CHECKING:
    from collections.abc import Callable

_Function = TypeVar("_Function", bound="Callable[..., Any]")

_FORMAT = 1
"""Version of the entries in the cache."""

_COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0")

_LIMIT = 1 << 28
"""Bytes of all that is kept; what was not used for the longest time goes first."""

_PATIENCE = 60.0
"""Seconds for which another process is waited for."""

_EXAMPLES = ["robocov.cost", "robocov.simulation", "robocov.metrics"]
"""Modules whose function `example` calls the kernels of the coverage cost, a step, and a summary."""

_ahead: list[str] = []

_helpers: list[subprocess.Popen[bytes]] = []

on_compile: list[Callable[[str], None]] = []
"""Called with the name of each kernel that the cache does not hold, before it is compiled."""


def kernel(function: _Function) -> _Function:
    """Return a function of numbers, arrays and named tuples of these as a compiled one.

    It may call other kernels, whatever module they come from, and read global numbers. Arithmetic is that of
    Python, without fused or reordered operations, so that all processors give the same bits.

    >>> @kernel
    ... def doubled(x):
    ...     return 2.0 * x
    >>> doubled(0.5)
    1.0
    """
    return _as_kernel(function)


def inner_kernel(function: _Function) -> _Function:
    """Return the same of a function that makes no array, for loops: references are not counted."""
    return _as_kernel(function, _nrt=False)


def inlined_kernel(function: _Function) -> _Function:
    """Return the same of a short one, which becomes part of the loops that call it."""
    return _as_kernel(function, _nrt=False, forceinline=True)


def _as_kernel(function: _Function, **options: bool) -> _Function:
    if not _COMPILED:
        return function
    return Kernel(function, options)  # type: ignore[return-value]


class Kernel:
    """A function that is compiled when it is first called."""

    def __init__(self, function: Callable[..., Any], options: dict[str, bool]) -> None:
        assert isinstance(function, FunctionType)
        update_wrapper(self, function)
        self._function, self._options = function, options

    def __call__(self, *args: Any) -> Any:
        """Return what the function returns."""
        try:
            return self._dispatcher(*args)
        except SystemError as error:
            # Ctrl-C while numba looks at the arguments
            if isinstance(error.__cause__, KeyboardInterrupt):
                raise KeyboardInterrupt from None
            raise

    @cached_property
    def _callees(self) -> dict[str, Kernel]:
        found = {name: self._function.__globals__.get(name) for name in self._function.__code__.co_names}
        return {name: value for name, value in found.items() if isinstance(value, Kernel)}

    @cached_property
    def _linked(self) -> FunctionType:
        # numba knows its own dispatchers only, in the place of the kernels that this one calls
        known = {name: callee._inner for name, callee in self._callees.items()}
        function = self._function
        linked = FunctionType(function.__code__, function.__globals__ | known, function.__name__)
        linked.__module__, linked.__qualname__ = function.__module__, function.__qualname__
        return linked

    @cached_property
    def _inner(self) -> Any:
        """For other kernels: what Python needs to call it takes long to compile."""
        numba = _numba()
        options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, **self._options}
        inner = numba.njit(self._linked, error_model="numpy", **options)
        template = inner.get_call_template

        def without_literals(args: Any, kws: Any) -> Any:
            # else each constant that a caller passes would be compiled anew
            return template(tuple(map(numba.types.unliteral, args)), kws)

        inner.get_call_template = without_literals
        return inner

    @cached_property
    def _dispatcher(self) -> Any:
        dispatcher = _numba().njit(self._linked, error_model="numpy", no_cfunc_wrapper=True, **self._options)
        cache = dispatcher._cache = _KernelCache(self._function.__name__, self._identity)
        compiling = dispatcher.compile

        def released(types: Any) -> Any:
            with cache.held:  # until it is saved, or has failed
                return compiling(types)

        dispatcher.compile = released
        array, typeof = _numba().types.Array, dispatcher.typeof_pyval

        def without_flags(value: Any) -> Any:
            # else each combination of arrays that may be written and that may not would be compiled anew
            kind = typeof(value)
            return kind.copy(readonly=False) if isinstance(kind, array) and not kind.mutable else kind

        dispatcher.typeof_pyval = without_flags
        return dispatcher

    @cached_property
    def _identity(self) -> str:
        """Name what the machine code comes from: the kernel, those that it calls, the numbers it reads."""
        code, scope = self._function.__code__, self._function.__globals__
        parts: list[str] = [self.__module__, self.__qualname__, code.co_code.hex()]  # type: ignore[attr-defined]
        parts += map(repr, (code.co_consts, code.co_names, code.co_varnames, self._options))
        for name in code.co_names:
            value = scope.get(name)
            if isinstance(value, (int, float)):
                parts.append(f"{name}={value!r}")
            elif isinstance(value, type):
                parts.append(f"{name}={getattr(value, '_fields', None)}")
        parts += [self._callees[name]._identity for name in sorted(self._callees)]
        return ArrayCache.key(*parts)


class _ForeignCall(Kernel):
    """`call_c` as numba's own instruction."""

    # of this instruction; what Python does instead is nowhere in machine code
    _identity = "call_c 1"

    @cached_property
    def _inner(self) -> Any:
        numba = _numba()
        from llvmlite import ir

        def typed(_: Any, address: Any, arguments: Any) -> Any:
            kinds = numba.types.Tuple([numba.types.unliteral(kind) for kind in arguments])

            def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
                passed = [builder.extract_value(values[1], k) for k in range(len(kinds))]
                function = ir.FunctionType(ir.IntType(64), [value.type for value in passed])
                return builder.call(builder.inttoptr(values[0], function.as_pointer()), passed)

            return numba.types.intp(numba.types.intp, kinds), generate

        return numba.extending.intrinsic(typed)


def call_c(address: int, arguments: tuple[float, ...]) -> int:
    """Call a C function by its address, also from kernels, and return the word that it returns.

    Arguments are floats, and whole numbers of 64 bits, which stand for pointers as well.
    """
    passed = [each if isinstance(each, float) else int(each) for each in arguments]
    kinds = [ctypes.c_double if isinstance(each, float) else ctypes.c_ssize_t for each in passed]
    return int(ctypes.CFUNCTYPE(ctypes.c_ssize_t, *kinds)(int(address))(*passed))


if _COMPILED:
    call_c = _ForeignCall(call_c, {})  # type: ignore[assignment]


class _KernelCache:
    """The machine code of one kernel in the user's cache, where numba looks: an entry for each signature."""

    def __init__(self, name: str, identity: str) -> None:
        self._name, self._identity = name, identity
        folder, self.held = cache_folder(), ExitStack()
        self._cache = None if folder is None else ArrayCache(folder, _LIMIT)

    def _key(self, sig: Any, codegen: Any) -> str:
        parts = _numba().__version__, np.__version__, sys.version, repr(codegen.magic_tuple())
        return ArrayCache.key("kernel", _FORMAT, self._identity, *parts, *map(_described, sig))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the machine code for the types of the arguments, None where it is to be compiled."""
        target_context.refresh()
        key = self._key(sig, target_context.codegen())
        found = self._loaded(key, target_context)
        if found is None:
            for tell in tuple(on_compile):
                tell(self._name)
            found = self._awaited(key, target_context)
        if found is None and gc.isenabled():
            # a tenth of the time, for next to no garbage
            gc.disable()
            self.held.callback(gc.enable)
        return found

    def _awaited(self, key: str, target_context: Any) -> Any:
        """Return what another process that has begun to compile this is going to save, None if none has."""
        if self._cache is None:
            return None
        with suppress(OSError):
            self._cache.folder.mkdir(parents=True, exist_ok=True)
        if not (self._cache.folder.is_dir() and os.access(self._cache.folder, os.W_OK)):
            return None
        _start_helper()
        until = time.monotonic() + _PATIENCE
        while time.monotonic() < until:
            try:
                self.held.enter_context(locked(self._cache.folder, f".{key}.lock", remove=True))
            except OutputError as error:
                if error.__cause__ is not None:  # nobody can lock there
                    return None
                time.sleep(0.02)
                continue
            # it may have been saved just before
            return self._loaded(key, target_context)
        return None

    def _loaded(self, key: str, target_context: Any) -> Any:
        from numba.core import compiler

        entry = None if self._cache is None else self._cache.load(key)
        if entry is not None:
            # a cache is never in the way, whatever there may be in it
            with suppress(Exception):
                rebuild: Any = compiler.CompileResult._rebuild
                return rebuild(target_context, *pickle.loads(entry["code"].tobytes()))
        return None

    def save_overload(self, sig: Any, result: Any) -> None:
        if self._cache is not None:
            code = np.frombuffer(pickle.dumps(result._reduce()), dtype=np.uint8)
            self._cache.save(self._key(sig, result.codegen), {"code": code})


def cache_folder() -> Path | None:
    """Return where kernels are kept between processes, None where they are not."""
    # the variable of numba's own caches
    named, ours = os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("ROBOCOV_CACHE")
    if named:
        return Path(named)
    if ours == "":
        return None
    return (Path(ours) if ours else platformdirs.user_cache_path("robocov", appauthor=False)) / "kernels"


def compile_kernels() -> None:
    """Have the kernels of a run and its summary in the cache, and ready to be called here.

    As soon as one is missing, another process compiles all but those of the cost, if there is a core for it.
    """
    _ahead[:] = _EXAMPLES[1:]
    for module in _EXAMPLES:
        importlib.import_module(module).example()


def _start_helper() -> None:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    path, no = os.pathsep.join(filter(None, sys.path)), subprocess.DEVNULL
    if _ahead and not _helpers and cores > 1:
        script = "; ".join(f"import {module}; {module}.example()" for module in _ahead)
        # -P: what lies in the working folder is not meant
        command = [sys.executable, "-P", "-c", script]
        with suppress(OSError):
            env = {**os.environ, "PYTHONPATH": path}
            _helpers.append(subprocess.Popen(command, env=env, stdin=no, stdout=no, stderr=no))


def _described(kind: Any) -> str:
    """Return a type of numba's in words."""
    if hasattr(kind, "fields"):
        return f"{kind.fields}({', '.join(map(_described, kind.types))})"
    return repr(kind)


def _numba() -> ModuleType:
    """Return numba, imported in spite of a folder `coverage` on the path."""
    if "numba" in sys.modules:
        return sys.modules["numba"]
    # numba takes any `coverage` for coverage.py, also our source root on the path: an empty entry hides it
    found = None if "coverage" in sys.modules else importlib.util.find_spec("coverage")
    ours = found is not None and found.origin is None
    if ours:
        sys.modules["coverage"] = None  # type: ignore[assignment]
    try:
        import numba
    finally:
        if ours:
            del sys.modules["coverage"]
    return numba
