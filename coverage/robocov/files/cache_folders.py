"""Folders for caches, and checks that other users cannot write to them."""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

import platformdirs

CACHE_VARIABLE = "ROBOCOV_CACHE"
"""Environment variable with the path of another cache folder. If it is set but empty, no cache is used."""


def find_cache_root() -> Path | None:
    """Find the folder for caches.

    Returns
    -------
    Path or None
        The folder that the environment variable `CACHE_VARIABLE` names, or else the user's cache folder. None
        if no cache is to be used.
    """
    configured = os.environ.get(CACHE_VARIABLE)
    if configured == "":
        return None
    if configured is not None:
        return Path(configured)
    return platformdirs.user_cache_path("robocov", appauthor=False)


def open_private_folder(folder: Path) -> Path | None:
    """Create a folder that only this user may write to, or check an existing one.

    Parameters
    ----------
    folder : Path
        Folder that may not exist yet.

    Returns
    -------
    Path or None
        The folder. None if it cannot be created or written to, belongs to another user, is writable by other
        users, or has a parent folder whose entries all users may replace.
    """
    # An error only means that the folder cannot be used.
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        # Only creating a file shows reliably whether the folder can be written to.
        with tempfile.TemporaryFile(dir=folder):
            pass
        if is_private(folder):
            return folder
    return None


def is_private(path: Path) -> bool:
    """Return whether a file or folder belongs to this user and cannot have been changed by other users.

    Parameters
    ----------
    path : Path
        An existing file or folder.

    Returns
    -------
    bool
        Always True on Windows, where each user has a cache folder that other users cannot access.

    Raises
    ------
    OSError
        If the path cannot be accessed.
    """
    if sys.platform == "win32":
        return True
    real_path = path.resolve(strict=True)
    status = real_path.stat()
    if status.st_uid != os.geteuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return False
    return not any(_lets_all_users_replace_entries(parent) for parent in real_path.parents)


def _lets_all_users_replace_entries(folder: Path) -> bool:
    """Return whether all users may replace the entries of a folder, including those of other users."""
    mode = folder.stat().st_mode
    return bool(mode & stat.S_IWOTH) and not mode & stat.S_ISVTX
