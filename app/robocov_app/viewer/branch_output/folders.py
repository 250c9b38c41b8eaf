"""Folders of the parts of a saved branch, which are listed in ``story.json``."""

import json
from pathlib import Path
from typing import Any

from robocov.errors import InputError, to_one_line
from robocov.files.result_names import STORY_FILE
from robocov_app.terminal.output import write_json

_FORMAT = "robocov-story"
_VERSION = 1


def write_branch_file(folder: Path, parts: list[dict[str, Any]]) -> None:
    """Write the file that lists the parts of a branch."""
    write_json(folder / STORY_FILE, {"format": _FORMAT, "version": _VERSION, "parts": parts})


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
        If ``story.json`` is damaged.
    """
    file = folder / STORY_FILE
    try:
        content = json.loads(file.read_bytes())
        if content["format"] != _FORMAT:
            return [(folder, "")]
        return [_read_part(folder, part) for part in content["parts"]]
    except OSError:
        # Without the file, this is another kind of result, whose reader reports any problems.
        return [(folder, "")]
    except (ValueError, LookupError, TypeError) as error:
        raise InputError(f"{file}: cannot be read: {to_one_line(error)}") from None


def _read_part(folder: Path, part: dict[str, Any]) -> tuple[Path, str]:
    description = "{from_s:.1f} to {to_s:.1f} s, {words}".format(**part)
    return folder / to_one_line(part["folder"]), description
