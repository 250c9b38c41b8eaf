"""Packages that only some parts need, and that are not installed with the rest."""

import importlib
from typing import Any

from robocov.errors import RobocovError


def import_optional(module: str, name: str, where: str = "") -> Any:
    """Return a module that the extra ``robocov[name]`` brings; raise RobocovError where it is missing."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module.partition(".")[0]:  # it is there, and misses something itself
            raise
        raise RobocovError(f'{where}{module} is not installed: pip install "robocov[{name}]"') from error
