"""Folders of the parts of a saved branch, which are listed in ``branch.json``."""

import json
from pathlib import Path
from typing import Any

from robocov.errors import InputError, to_one_line
from robocov.files.paths import is_existing_file
from robocov.files.result_names import BRANCH_FILE, FORMER_BRANCH_FILE
from robocov_app.terminal.output import write_json

_FORMAT = "robocov-branch"
_FORMER_FORMAT = "robocov-story"
"""Format of files of earlier versions."""
_FORMER_DESCRIPTION_KEY = "words"
"""Key of the description of a part in these files."""
_VERSION = 1


def write_branch_file(folder: Path, parts: list[dict[str, Any]]) -> None:
    """Write the file that lists the parts of a branch."""
    write_json(folder / BRANCH_FILE, {"format": _FORMAT, "version": _VERSION, "parts": parts})


def find_branch_file(folder: Path) -> Path | None:
    """Return the file that lists the parts of a branch.

    Parameters
    ----------
    folder : Path
        Folder of a branch, or of any other result.

    Returns
    -------
    Path or None
        None if this is not the folder of a branch.
    """
    for name in (BRANCH_FILE, FORMER_BRANCH_FILE):
        if is_existing_file(folder / name):
            return folder / name
    return None


def list_part_folders(folder: Path) -> list[tuple[Path, str]]:
    """Return the folders of the parts of a branch.

    Parameters
    ----------
    folder : Path
        Folder of a branch, or of any other result.

    Returns
    -------
    list of (Path, str)
        Folder and description of each part; for other results, the folder itself with an empty description.

    Raises
    ------
    InputError
        If ``branch.json`` is damaged.
    """
    file = find_branch_file(folder)
    if file is None:
        # This is another kind of result, whose reader reports any problems.
        return [(folder, "")]
    try:
        content = json.loads(file.read_bytes())
        if content["format"] not in (_FORMAT, _FORMER_FORMAT):
            return [(folder, "")]
        return [_read_part(folder, part) for part in content["parts"]]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise InputError(f"{file}: cannot be read: {to_one_line(error)}") from None


def _read_part(folder: Path, part: dict[str, Any]) -> tuple[Path, str]:
    key = _FORMER_DESCRIPTION_KEY if _FORMER_DESCRIPTION_KEY in part else "description"
    description = f"{part['from_s']:.1f} to {part['to_s']:.1f} s, {part[key]}"
    return folder / to_one_line(part["folder"]), description
