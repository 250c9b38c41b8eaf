"""Files that a foreign file names: pictures, includes, sets of tiles."""

from __future__ import annotations

from pathlib import Path, PureWindowsPath

from robocov.errors import MapError, shown

_LONG = 400
"""Longest name of a file, in characters."""


def named_file(path: Path, name: str, *, anywhere: bool, at: str, what: str) -> tuple[Path, str | None]:
    """Return the file that the one at `path` names, and what was put right about it.

    It must be in the file's folder or below. Programs write where it was when it was saved, often from
    the root, and it may have moved with the file: one of the same name beside it is as good.

    Parameters
    ----------
    path : Path
    name : str
        As it is written there, relative to the folder of `path`.
    anywhere : bool
        Whether it may be outside of that folder.
    at, what : str
        The place that names it, and what kind of file it is, for messages.

    Raises
    ------
    MapError
        When it is no name of a file, or outside of the folder.
    """
    if not name:
        raise MapError(f"{at}: empty, but the name of a {what} was wanted")
    if len(name) > _LONG:
        raise MapError(f"{at}: {shown(name)}: {len(name)} characters, but a shorter name was wanted")
    named = path.parent / name
    beside = path.parent / PureWindowsPath(name).name
    try:
        allowed = anywhere or _inside(named, path.parent)
        if not (allowed and _exists(named)) and beside.is_file() and _inside(beside, path.parent):
            key = at.rpartition(": ")[2]
            return beside, f"{key}: {shown(name)} is not there, {shown(beside.name)} beside the file taken"
    except (OSError, ValueError, RuntimeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "no name of a file"
        raise MapError(f"{at}: {shown(name)}: {reason}") from None
    if not allowed:
        raise MapError(
            f"{at}: {shown(name)} is outside of the file's folder, but a {what} in it was wanted "
            f"(--anywhere allows it)"
        )
    return named, None


def _inside(named: Path, folder: Path) -> bool:
    """Return whether a file is in `folder` or below, links followed."""
    return named.resolve().is_relative_to(folder.resolve())


def _exists(named: Path) -> bool:
    """Return whether there is such a file; an OSError where that cannot be known, as from a name too long."""
    try:
        named.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True
