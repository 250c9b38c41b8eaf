"""Controllers in files of the user. A study contains their source text, so workers need no such files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from robocov.controllers import load_controller_class
from robocov.controllers.user_modules import ControllerSource, find_own_modules
from robocov.errors import ParameterError, describe_error, quote, to_one_line


def load_study_controller(name: str, folder: Path) -> tuple[type[Any], ControllerSource | None]:
    """Load the class of a controller, and the source text of its file.

    Parameters
    ----------
    name : str
        Name of a bundled controller, or ``file.py:Class``.
    folder : Path
        Folder to which relative paths refer.

    Returns
    -------
    controller_class : type
    source : ControllerSource or None
        The text of the file and of the modules that it imports; None if the controller is bundled.

    Raises
    ------
    ParameterError
        If there is no such controller, or if its file is invalid.
    """
    source = _read_source(name, folder)
    controller_class = load_controller_class(name, source=source)
    if source is not None:
        # The modules can be found only now, because loading the class may add their folders to sys.path.
        source = source._replace(modules=find_own_modules(source.text))
    return controller_class, source


def read_controller_source(name: str, folder: Path) -> ControllerSource | None:
    """Read the source text of a controller, and of the modules in its folder, without executing any of it.

    Parameters
    ----------
    name, folder : str, Path
        As for `load_study_controller`.

    Returns
    -------
    ControllerSource or None
        As from `load_study_controller`, unless the code of the controller changes ``sys.path``.

    Raises
    ------
    ParameterError
        If the file cannot be read, or is not Python code.
    """
    source = _read_source(name, folder)
    if source is None:
        return None
    # As when the controller is loaded, its folder is searched last. Later imports must not search it.
    search_path = list(sys.path)
    sys.path.append(str(Path(source.path).parent))
    try:
        return source._replace(modules=find_own_modules(source.text))
    except SyntaxError as error:
        location = source.path if error.lineno is None else f"{source.path}:{error.lineno}"
        raise ParameterError(f"{quote(name)}: {location}: not Python code: {error.msg}") from None
    except ValueError as error:
        raise ParameterError(f"{quote(name)}: {source.path}: not Python code: {error}") from None
    finally:
        sys.path[:] = search_path


def _read_source(name: str, folder: Path) -> ControllerSource | None:
    """Read the source file of a controller named ``file.py:Class``; return None for any other name."""
    file_name, _, class_name = name.rpartition(":")
    if not class_name or not file_name.endswith(".py"):
        return None
    path = folder / file_name
    try:
        path = path.resolve()
        return ControllerSource(str(path), path.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise ParameterError(f"{quote(name)}: {path}: not UTF-8") from None
    except (OSError, RuntimeError, ValueError) as error:
        # Before Python 3.13, circular links raise RuntimeError.
        raise ParameterError(f"{quote(name)}: {to_one_line(path)}: {describe_error(error)}") from None


def source_to_json(source: ControllerSource | None) -> dict[str, Any]:
    """Return the JSON entries that contain the source text of a controller.

    Parameters
    ----------
    source : ControllerSource or None

    Returns
    -------
    dict
        ``source`` and, if the file imports other files of the user, ``modules``. Empty without a source.
    """
    if source is None:
        return {}
    entries: dict[str, Any] = {"source": source.text}
    if source.modules:
        entries["modules"] = {name: module.text for name, module in source.modules.items()}
    return entries
