"""Load controllers from users' files, find the modules they import, and explain their errors.

A file and the modules that it imports can also be loaded from stored texts, for example on another machine.
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
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from robocov.errors import (
    ControllerEndedError,
    ParameterError,
    RobocovError,
    describe_unknown_name,
    quote,
    to_one_line,
)
from robocov.files.paths import is_existing_file

MODULE_PREFIX = "robocov_user_"
"""Prefix of the names of modules that are loaded from users' files."""
_LIBRARY_FOLDER = str(Path(__file__).parents[1])
"""Folder of robocov itself."""
_PACKAGE_FOLDERS = frozenset(("site-packages", "dist-packages"))
"""Names of folders of installed packages."""


class ModuleText(NamedTuple):
    """A module that a controller's file imports."""

    path: str
    """Path of its file; empty for a package without ``__init__.py``."""
    text: str


class ControllerSource(NamedTuple):
    """The file of a controller, and the modules that it imports."""

    path: str
    """Absolute path of the file."""
    text: str
    modules: Mapping[str, ModuleText] = {}
    """Modules by name, as `find_own_modules` returns them."""


class _Call(NamedTuple):
    """A call in a traceback."""

    module: str
    file: str
    line: int


def explain_fault(context: str, error: BaseException, ending: str = "") -> RobocovError:
    """Return an error with a one-line explanation of an exception in code outside robocov.

    The message names the file and line in which the exception was raised, if they are known.

    Parameters
    ----------
    context : str
        Beginning of the message, which names the controller.
    error : BaseException
        The exception that the code raised. Its notes that begin with "robot ", such as "robot 3", are added
        to the message.
    ending : str
        End of the message, such as " at 0.117 s".

    Returns
    -------
    ControllerEndedError
        For exceptions that would terminate Python, such as `SystemExit`.
    ParameterError
        For all other exceptions.
    """
    notes = [note for note in getattr(error, "__notes__", ()) if note.startswith("robot ")]
    location = _format_fault_location(error)
    suffix = location + "".join(f" for {note}" for note in notes) + ending
    fault = _describe_exception(error)
    if isinstance(error, Exception):
        return ParameterError(f"{context}: {fault}{suffix}")
    return ControllerEndedError(f"{context}: it tried to terminate Python by raising {fault}{suffix}")


def _describe_exception(error: BaseException) -> str:
    """Return the class name and the message of an exception on one line."""
    name = type(error).__name__
    try:
        message = to_one_line(error)
    except KeyboardInterrupt:
        raise
    except BaseException:  # The __str__ of an exception class of the user may raise anything.
        return f"{name} (no message)"
    return f"{name}: {message}" if message else name


def explain_user_fault(error: BaseException) -> RobocovError | None:
    """Return an error that explains an exception in a user's file; None if it was not raised there."""
    if any(_is_in_user_file(call) for call in _list_calls(error)):
        return explain_fault("a controller of your own", error)
    return None


def format_location(function: object) -> str:
    """Return file and line of a user's function, as " (mine.py, line 12)"; empty if they are unknown."""
    with suppress(Exception):  # A callable object may have any attributes.
        code = inspect.unwrap(getattr(function, "__func__", function)).__code__  # type: ignore[arg-type]
        return f" ({Path(code.co_filename).name}, line {code.co_firstlineno})"
    return ""


def _format_fault_location(error: BaseException) -> str:
    """Return file and line of the last call outside robocov, as " (mine.py, line 12)", or an empty string."""
    # Methods that a dataclass generates belong to the user's module, but have no file.
    calls = [call for call in _list_calls(error) if not call.file.startswith("<")]
    user_calls = [call for call in calls if _is_in_user_file(call)]
    if not user_calls:
        user_calls = [call for call in calls if not call.file.startswith(_LIBRARY_FOLDER)]
    if not user_calls:
        return ""
    return f" ({Path(user_calls[-1].file).name}, line {user_calls[-1].line})"


def _list_calls(error: BaseException) -> list[_Call]:
    """Return the calls in the traceback of an error, outermost first."""
    return [
        _Call(str(frame.f_globals.get("__name__")), frame.f_code.co_filename, line)
        for frame, line in traceback.walk_tb(error.__traceback__)
    ]


def _is_in_user_file(call: _Call) -> bool:
    return call.module.startswith(MODULE_PREFIX)


def load_class(name: str, source: ControllerSource | None) -> type[Any]:
    """Load a controller class from a file, which runs the file.

    Parameters
    ----------
    name : str
        ``file.py:ClassName``.
    source : ControllerSource or None
        Text to run instead of the file.

    Returns
    -------
    type

    Raises
    ------
    ParameterError
        If there is no such file or class, the file cannot be run, or the class is not a frozen dataclass with
        a method ``decide`` or ``force``.
    """
    file, _, class_name = name.rpartition(":")
    source_name = f"controller {quote(name)}"
    if not class_name or not file.endswith(".py"):
        raise ParameterError(f"{source_name}: expected a file and a class, as in mine.py:MyController")
    if source is None and not is_existing_file(Path(file)):
        raise ParameterError(f"{file}: no such file")
    try:
        module = _load_module(file, source)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise explain_fault(f"{source_name}: {file} cannot be run", error) from error
    kind = vars(module).get(class_name)
    if kind is None:
        names = _list_own_classes(module)
        raise ParameterError(f"controller {file}: {describe_unknown_name('class', class_name, names)}")
    if not isinstance(kind, type) or not (hasattr(kind, "decide") or hasattr(kind, "force")):
        raise ParameterError(
            f"{file}: {class_name}: expected a class with a method decide(observations, memory) or force(own)"
        )
    if not getattr(getattr(kind, "__dataclass_params__", None), "frozen", False):
        raise ParameterError(
            f"{file}: {class_name}: expected a frozen dataclass. "
            "Write @dataclass(frozen=True) above the class."
        )
    return kind


def _load_module(file: str, source: ControllerSource | None) -> ModuleType:
    """Load a file, or its stored text, as a module. This runs its code."""
    loader = None
    path = os.path.realpath(file)
    modules: Mapping[str, ModuleText] = {}
    if source is not None:
        loader = _TextLoader(source.path, source.text)
        path = source.path
        modules = source.modules
    # If the modules that the file imports are stored as well, its folder is not needed.
    if not modules:
        _add_import_folder(Path(path).parent)
    # Each file gets its own name, so two files called mine.py do not replace each other.
    module_name = f"{MODULE_PREFIX}{hashlib.sha256(path.encode()).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(module_name, path, loader=loader)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[module_name] = module
    with provide_modules(modules):
        spec.loader.exec_module(module)
    return module


def _add_import_folder(folder: Path) -> None:
    """Let a user's file import modules from its folder, as Python does for scripts.

    The folder is the last one on ``sys.path``, so that none of its modules replaces an installed one.
    """
    if folder.is_dir() and str(folder) not in sys.path:
        sys.path.append(str(folder))


def _list_own_classes(module: ModuleType) -> list[str]:
    """Return the names of the classes that a module defines itself."""
    return [
        name
        for name, value in vars(module).items()
        if isinstance(value, type) and value.__module__ == module.__name__
    ]


def find_own_modules(text: str) -> dict[str, ModuleText]:
    """Find the author's own modules that source code imports, directly or indirectly.

    Modules are looked up on ``sys.path`` without being executed. The standard library, installed packages and
    robocov are left out, and so are files that cannot be read. Dynamic imports are not found.

    Parameters
    ----------
    text : str
        Python code.

    Returns
    -------
    dict of str to ModuleText
        Modules by name, sorted.
    """
    importlib.invalidate_caches()
    collector = _ModuleCollector()
    pending = list(_list_imports(text, package=""))
    while pending:
        pending += collector.add(pending.pop())
    return dict(sorted(collector.modules.items()))


def is_own_module(name: str) -> bool:
    """Return whether a module is neither installed nor a part of Python or robocov.

    Unlike `find_own_modules`, this includes modules without source code, such as extension modules.

    Parameters
    ----------
    name : str
        Name of a module or package on ``sys.path``, without dots.

    Returns
    -------
    bool
    """
    importlib.invalidate_caches()
    spec = PathFinder.find_spec(name)
    return spec is not None and _is_own(name, spec)


class _ModuleCollector:
    """Collects modules that are neither installed nor a part of Python or robocov."""

    def __init__(self) -> None:
        self.modules: dict[str, ModuleText] = {}
        self._locations: dict[str, list[str]] = {}
        """Folders with the submodules of each module looked up so far; empty for a module without any."""

    def add(self, name: str) -> list[str]:
        """Add a module, and the packages that contain it; return the names that they import."""
        imports: list[str] = []
        locations: Sequence[str] | None = None  # The first name is looked up on ``sys.path``.
        # For a.b.c: a, then a.b, then a.b.c.
        parts = name.split(".")
        for depth in range(1, len(parts) + 1):
            module = ".".join(parts[:depth])
            if module not in self._locations:
                imports += self._add_module(module, locations)
            locations = self._locations[module]
            if not locations:
                break
        return imports

    def _add_module(self, name: str, locations: Sequence[str] | None) -> list[str]:
        """Add one module; return the names of the modules that it imports."""
        self._locations[name] = []
        # In a folder, only the last part of the name is looked up. For the full name, Python would need the
        # parent package, which has not been imported.
        lookup_name = name if locations is None else name.rpartition(".")[2]
        spec = PathFinder.find_spec(lookup_name, locations)
        if spec is None or not _is_own(name, spec):
            return []
        self._locations[name] = list(spec.submodule_search_locations or ())
        if spec.origin is None:
            self.modules[name] = ModuleText("", "")
            return []
        if not spec.origin.endswith(".py"):
            return []
        package = name if self._locations[name] else name.rpartition(".")[0]
        try:
            text = importlib.util.decode_source(Path(spec.origin).read_bytes())
            self.modules[name] = ModuleText(spec.origin, text)
            return list(_list_imports(text, package))
        except (OSError, SyntaxError, ValueError):
            return []


def _list_imports(text: str, package: str) -> Iterator[str]:
    """Yield the names of all modules that source code in the given package may import."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                with suppress(ImportError):  # The import will also fail when the text runs.
                    base = importlib.util.resolve_name("." * node.level + base, package)
            # A name that is imported from a package may be a module.
            yield from (f"{base}.{alias.name}" for alias in node.names if base)


def _is_own(name: str, spec: ModuleSpec) -> bool:
    """Return whether the module with a full name is neither installed nor a part of Python or robocov."""
    top_name = name.partition(".")[0]
    # A file with the name of a built-in module is never imported.
    if top_name in sys.builtin_module_names or top_name in ("robocov", "robocov_app"):
        return False
    folders = spec.submodule_search_locations or ()
    path = Path(os.path.realpath(spec.origin or next(iter(folders), "")))
    if _PACKAGE_FOLDERS.intersection(path.parts):
        return False
    libraries = [os.path.realpath(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib")]
    return not any(path.is_relative_to(library) for library in libraries)


class _TextLoader(importlib.abc.ExecutionLoader):
    """Loads a module from the text of its file, which may no longer exist."""

    def __init__(self, path: str, text: str) -> None:
        self._path = path
        self._text = text

    def get_filename(self, fullname: str) -> str:
        """Return the path of the file, for tracebacks."""
        return self._path

    def get_source(self, fullname: str) -> str:
        """Return the text of the module."""
        return self._text

    def is_package(self, fullname: str) -> bool:
        """Return whether the module is a package."""
        return Path(self._path).name == "__init__.py"


class _TextFinder(importlib.abc.MetaPathFinder):
    """Finds modules by name in a collection of source texts."""

    def __init__(self, modules: Mapping[str, ModuleText]) -> None:
        self.modules = modules

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        """Find a module among the texts; None if it is not one of them."""
        module = self.modules.get(fullname)
        if module is None:
            return None
        if not module.path:
            return ModuleSpec(fullname, None, is_package=True)
        loader = _TextLoader(module.path, module.text)
        return importlib.util.spec_from_file_location(fullname, module.path, loader=loader)


@contextmanager
def provide_modules(modules: Mapping[str, ModuleText]) -> Iterator[None]:
    """Within the context, import modules from their stored texts instead of their files.

    Parameters
    ----------
    modules : mapping of str to ModuleText
        As `find_own_modules` returns them.
    """
    if any(isinstance(finder, _TextFinder) and finder.modules is modules for finder in sys.meta_path):
        # An outer context already provides them; they are not loaded twice.
        yield
        return
    previous_modules = {name: sys.modules.pop(name) for name in modules if name in sys.modules}
    finder = _TextFinder(modules)
    sys.meta_path.insert(0, finder)
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for name in modules:
            sys.modules.pop(name, None)
        sys.modules.update(previous_modules)
