"""Packages that only some parts need, and that are not installed with the rest."""

from __future__ import annotations

import importlib
from typing import Any

from robocov.errors import RobocovError


def extra(module: str, name: str) -> Any:
    """Return a module that the extra called `name` of this package brings.

    Raises
    ------
    RobocovError
        When it is not installed; the message says how it is.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module.partition(".")[0]:  # it is there, and misses something itself
            raise
        raise RobocovError(f'{module} is not installed: pip install "robocov[{name}]"') from error
