"""A controller's file and the modules of its author that it imports, as texts that run on any machine."""

from __future__ import annotations

import ast
import importlib.abc
import importlib.machinery
import importlib.util
import os
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from types import CodeType, ModuleType

_OTHERS = frozenset(("site-packages", "dist-packages"))
"""Folders of installed packages, which have versions."""


class Module(NamedTuple):
    """A module that a controller's file imports.

    Attributes
    ----------
    path : str
        Of its file; empty for a package without ``__init__.py``.
    text : str
    """

    path: str
    text: str


class Source(NamedTuple):
    """The file of a controller.

    Attributes
    ----------
    path : str
        Absolute.
    text : str
    modules : dict of name to Module
        Those of the author's own that it imports, directly or not; see `own_modules`.
    """

    path: str
    text: str
    modules: Mapping[str, Module] = {}


def own_modules(text: str) -> dict[str, Module]:
    """Return the modules that a text imports, and those that these import, as far as they are its author's.

    They are found on ``sys.path`` without being executed, also where they are imported only inside functions.
    The standard library, installed packages and robocov are left out; so is what is imported by a name that
    is put together while the program runs, and what cannot be read.
    """
    importlib.invalidate_caches()
    found: dict[str, Module] = {}
    places: dict[str, list[str] | None] = {}  # where the submodules of what was looked for are
    waiting = list(_imported(text, ""))
    while waiting:
        name = waiting.pop()
        where: list[str] | None = None
        for part in accumulate(name.split("."), "{}.{}".format):
            if part not in places:
                spec = importlib.machinery.PathFinder.find_spec(part, where)
                places[part] = None if spec is None else list(spec.submodule_search_locations or ())
                if spec is None or not _is_own(spec):
                    places[part] = None
                elif spec.origin is None:
                    found[part] = Module("", "")
                elif spec.origin.endswith(".py"):
                    with suppress(OSError, SyntaxError, ValueError):
                        text = importlib.util.decode_source(Path(spec.origin).read_bytes())
                        found[part] = Module(spec.origin, text)
                        package = part if spec.submodule_search_locations else part.rpartition(".")[0]
                        waiting += _imported(text, package)
            where = places[part]
            if not where:
                break
    return dict(sorted(found.items()))


def _imported(text: str, package: str) -> Iterator[str]:
    """Yield the names of all modules that a text may import."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                with suppress(ImportError):  # outside the package: it will fail to run, too
                    base = importlib.util.resolve_name("." * node.level + base, package)
            # what is imported from a package may be a module
            yield from (f"{base}.{alias.name}" for alias in node.names if base)


def _is_own(spec: importlib.machinery.ModuleSpec) -> bool:
    """Return whether a module is neither installed nor a part of Python or robocov."""

    if spec.name.partition(".")[0] in ("robocov", "robocov_app"):
        return False
    place = spec.origin or next(iter(spec.submodule_search_locations or ()), "")
    if spec.origin is not None and not spec.has_location:  # built in, or frozen
        return False
    path = Path(os.path.realpath(place))
    others = [os.path.realpath(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib")]
    return not _OTHERS.intersection(path.parts) and not any(path.is_relative_to(each) for each in others)


class TextLoader(importlib.abc.SourceLoader):
    """Loads a module from the text of its file, which need not be there any more."""

    def __init__(self, path: str, text: str) -> None:
        self._path, self._text = path, text

    def get_filename(self, fullname: str) -> str:
        """Return the path of the file."""
        return self._path

    def get_data(self, path: str) -> bytes:
        """Return the text."""
        return self._text.encode()

    def source_to_code(self, data: object, path: object, **_: object) -> CodeType:  # type: ignore[override]
        """Compile the text itself: what it says of its encoding was true of the file."""
        return compile(self._text, self._path, "exec", dont_inherit=True)


class _TextFinder(importlib.abc.MetaPathFinder):
    """Finds modules by name among texts."""

    def __init__(self, modules: Mapping[str, Module]) -> None:
        self.modules = modules

    def find_spec(
        self, fullname: str, path: object, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        module = self.modules.get(fullname)
        if module is None:
            return None
        if not module.path:
            return importlib.machinery.ModuleSpec(fullname, None, is_package=True)
        loader = TextLoader(module.path, module.text)
        return importlib.util.spec_from_file_location(fullname, module.path, loader=loader)


@contextmanager
def provided(modules: Mapping[str, Module]) -> Iterator[None]:
    """Have these modules imported from their texts while the context lasts, whatever else has their names."""
    if any(isinstance(each, _TextFinder) and each.modules is modules for each in sys.meta_path):
        yield  # they are already, and are loaded once
        return
    former = {name: sys.modules.pop(name) for name in modules if name in sys.modules}
    finder = _TextFinder(modules)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for name in modules:
            sys.modules.pop(name, None)
        sys.modules.update(former)
