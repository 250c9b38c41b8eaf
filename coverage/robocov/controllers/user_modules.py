"""Controllers in users' files: their classes, the modules that they import, and their faults in one line.

A file and the modules of its author that it imports are texts as well, which run on any machine.
"""

import ast
import hashlib
import importlib.abc
import importlib.util
import inspect
import os
import sys
import sysconfig
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from importlib.machinery import ModuleSpec, PathFinder
from itertools import accumulate
from pathlib import Path
from typing import Any, NamedTuple

from robocov.errors import ControllerEndedError, ParameterError, RobocovError, describe_unknown_name, quote

_MODULE = "robocov_user_"  # prefix of the names of modules loaded from files of users
_OURS = str(Path(__file__).parents[1])
_INSTALLED = frozenset(("site-packages", "dist-packages"))  # folders of packages, which have versions


class ModuleText(NamedTuple):
    """A module that a controller's file imports; a package without ``__init__.py`` has no path."""

    path: str
    text: str


class ControllerSource(NamedTuple):
    """The file of a controller, its absolute path, and the `find_own_modules` that it imports, by name."""

    path: str
    text: str
    modules: Mapping[str, ModuleText] = {}


def explain_fault(where: str, error: BaseException, when: str = "") -> RobocovError:
    """Describe what went wrong in code that is not ours.

    Parameters
    ----------
    where : str
        The controller, with which the message begins.
    error : BaseException
        What the code raised; its notes, as "robot 3", are added to the message.
    when : str
        The end of the message, as " at 0.117 s".

    Returns
    -------
    ControllerEndedError
        If the exception would have ended Python, as `SystemExit` does.
    ParameterError
        For any other exception. Both name file and line.
    """
    frames = _frames(error)
    theirs = [frame for frame in frames if frame[0].startswith(_MODULE)]
    theirs = theirs or [frame for frame in frames if not frame[1].startswith((_OURS, "<"))]
    at = f" ({Path(theirs[-1][1]).name}, line {theirs[-1][2]})" if theirs else ""
    notes = "".join(f" for {note}" for note in getattr(error, "__notes__", ()) if note.startswith("robot "))
    try:
        message = str(error)
    except Exception:  # it is the user's own
        message = "it has no message"
    what = f"{type(error).__name__}: {message}" if message else type(error).__name__
    if isinstance(error, Exception):
        return ParameterError(f"{where}: {what}{at}{notes}{when}")
    return ControllerEndedError(f"{where}: it ended Python by {what}{at}{notes}{when}")


def format_location(function: object) -> str:
    """Return file and line of a function or method of a user, as " (mine.py, line 12)"; empty if unknown."""
    with suppress(Exception):  # it may be any object that can be called
        code = inspect.unwrap(getattr(function, "__func__", function)).__code__  # type: ignore[arg-type]
        return f" ({Path(code.co_filename).name}, line {code.co_firstlineno})"
    return ""


def explain_user_fault(error: BaseException) -> RobocovError | None:
    """Return what tells of an error that came up in a user's file; None where it did elsewhere."""
    theirs = any(frame[0].startswith(_MODULE) for frame in _frames(error))
    return explain_fault("a controller of your own", error) if theirs else None


def _frames(error: BaseException) -> list[tuple[str, str, int]]:
    """Return module, file and line of each call that led to an error."""
    calls = traceback.walk_tb(error.__traceback__)
    return [(str(call.f_globals.get("__name__")), call.f_code.co_filename, line) for call, line in calls]


def load_class(name: str, source: ControllerSource | None) -> type[Any]:
    """Return the controller class ``file.py:ClassName``; this runs the file, or its text in `source`."""
    file, _, class_name = name.rpartition(":")
    where = f"controller {quote(name)}"
    if not class_name or not file.endswith(".py"):
        raise ParameterError(f"{where}: a file and a class, as in mine.py:MyController, was wanted")
    path = os.path.realpath(file) if source is None else source.path
    if source is None and not Path(path).is_file():
        raise ParameterError(f"{where}: there is no file {file}")
    # a name of its own for each file, so that two files called mine.py do not replace each other
    module_name = f"{_MODULE}{hashlib.sha256(path.encode()).hexdigest()[:12]}"
    loader = None if source is None else _TextLoader(source.path, source.text)
    spec = importlib.util.spec_from_file_location(module_name, path, loader=loader)
    assert spec is not None and spec.loader is not None
    sys.modules[module_name] = module = importlib.util.module_from_spec(spec)
    try:
        with provide_modules({} if source is None else source.modules):
            spec.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise explain_fault(f"{where}: {file} cannot be run", error) from error
    kind, wrong = vars(module).get(class_name), ""
    if kind is None:
        classes = {key: each for key, each in vars(module).items() if isinstance(each, type)}
        kinds = [key for key, each in classes.items() if each.__module__ == module_name]
        raise ParameterError(f"controller {file}: {describe_unknown_name('class', class_name, kinds)}")
    if not (isinstance(kind, type) and (hasattr(kind, "decide") or hasattr(kind, "force"))):
        wrong = "has neither a method decide(seen, memory) nor force(own)"
    elif not getattr(getattr(kind, "__dataclass_params__", None), "frozen", False):
        wrong = "is not a frozen dataclass; @dataclass(frozen=True) above it was wanted"
    if wrong:
        raise ParameterError(f"{where}: {class_name} {wrong}")
    return kind


def find_own_modules(text: str) -> dict[str, ModuleText]:
    """Return the modules that a text imports, and those that these import, as far as they are its author's.

    They are found on ``sys.path`` without being executed. The standard library, installed packages and
    robocov are left out; so is what cannot be read, and what is imported by a name put together at run time.
    """
    importlib.invalidate_caches()
    found: dict[str, ModuleText] = {}
    places: dict[str, list[str] | None] = {}  # where the submodules of what was looked for are
    waiting = list(_imported(text, ""))
    while waiting:
        where: list[str] | None = None
        for part in accumulate(waiting.pop().split("."), "{}.{}".format):
            if part not in places:
                spec = PathFinder.find_spec(part, where)
                places[part] = None if spec is None else list(spec.submodule_search_locations or ())
                if spec is None or not _is_own(spec):
                    places[part] = None
                elif spec.origin is None:
                    found[part] = ModuleText("", "")
                elif spec.origin.endswith(".py"):
                    with suppress(OSError, SyntaxError, ValueError):
                        text = importlib.util.decode_source(Path(spec.origin).read_bytes())
                        found[part] = ModuleText(spec.origin, text)
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


def _is_own(spec: ModuleSpec) -> bool:
    """Return whether a module is neither installed nor a part of Python or robocov."""
    built_in = spec.origin is not None and not spec.has_location  # or frozen
    if built_in or spec.name.partition(".")[0] in ("robocov", "robocov_app"):
        return False
    path = Path(os.path.realpath(spec.origin or next(iter(spec.submodule_search_locations or ()), "")))
    others = [os.path.realpath(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib")]
    return not _INSTALLED.intersection(path.parts) and not any(path.is_relative_to(each) for each in others)


class _TextLoader(importlib.abc.ExecutionLoader):
    """Loads a module from the text of its file, which need not be there any more."""

    def __init__(self, path: str, text: str) -> None:
        self._path, self._text = path, text

    def get_filename(self, fullname: str) -> str:
        return self._path

    def get_source(self, fullname: str) -> str:
        return self._text

    def is_package(self, fullname: str) -> bool:
        return Path(self._path).name == "__init__.py"


class _TextFinder(importlib.abc.MetaPathFinder):
    """Finds modules by name among texts."""

    def __init__(self, modules: Mapping[str, ModuleText]) -> None:
        self.modules = modules

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        module = self.modules.get(fullname)
        if module is None or not module.path:
            return None if module is None else ModuleSpec(fullname, None, is_package=True)
        loader = _TextLoader(module.path, module.text)
        return importlib.util.spec_from_file_location(fullname, module.path, loader=loader)


@contextmanager
def provide_modules(modules: Mapping[str, ModuleText]) -> Iterator[None]:
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
