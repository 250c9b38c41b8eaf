"""Paths to files of users, which may be invalid."""

from __future__ import annotations

import os
from pathlib import Path


def is_existing_file(path: Path) -> bool:
    """Return whether a path leads to a file.

    Parameters
    ----------
    path : Path
        Any path, which may not exist.

    Returns
    -------
    bool
        False also if the path is too long for a file, or its folder cannot be accessed. `Path.is_file` raises
        an error in these cases.
    """
    return os.path.isfile(path)  # noqa: PTH113


def describe_path(path: Path) -> str:
    """Describe the kind of a path, for an error message.

    Parameters
    ----------
    path : Path

    Returns
    -------
    str
        "a folder", "a file" or "a path that does not exist".
    """
    if path.is_dir():
        return "a folder"
    return "a file" if path.exists() else "a path that does not exist"
