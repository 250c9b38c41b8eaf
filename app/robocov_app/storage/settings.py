"""Persistent settings of a window, in a JSON file in the user's configuration folder."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from platformdirs import user_config_path
from pydantic import BaseModel

from robocov.errors import OutputError
from robocov.files.writing import replace_file

FOLDER_VARIABLE = "ROBOCOV_SETTINGS"
"""Environment variable that selects another folder for settings; if it is empty, there are none."""
SettingsType = TypeVar("SettingsType", bound=BaseModel)


def find_settings_file(name: str = "window.json") -> Path | None:
    """Return the file of settings; None if there are none."""
    default_folder = str(user_config_path("robocov", appauthor=False))
    folder = os.environ.get(FOLDER_VARIABLE, default_folder)
    if not folder:
        return None
    return Path(folder) / name


def load_settings(kind: type[SettingsType], file: Path | None) -> tuple[SettingsType, str]:
    """Load settings.

    Parameters
    ----------
    kind : type
        Model of the settings.
    file : Path or None

    Returns
    -------
    settings : BaseModel
        The defaults if there is no file, or it cannot be read.
    message : str
        Message if the file cannot be read; otherwise empty.
    """
    try:
        if file is not None and file.exists():
            return kind.model_validate_json(file.read_bytes()), ""
    except (OSError, ValueError):
        return kind(), f"{file} cannot be read; using default settings"
    return kind(), ""


def merge_changed_settings(
    saved: SettingsType, at_opening: SettingsType, at_closing: SettingsType
) -> SettingsType:
    """Return the saved settings with the changes that were made in the window.

    Parameters
    ----------
    saved : BaseModel
        Settings as they were loaded.
    at_opening, at_closing : BaseModel
        Settings of the window. Those selected on the command line are the same in both.

    Returns
    -------
    BaseModel
    """
    changes = {name: value for name, value in at_closing if value != getattr(at_opening, name)}
    return saved.model_copy(update=changes)


def save_settings(settings: BaseModel, file: Path | None) -> str:
    """Save settings.

    Parameters
    ----------
    settings : BaseModel
    file : Path or None
        None to save nothing.

    Returns
    -------
    str
        Message if they cannot be saved; otherwise empty.
    """
    if file is None:
        return ""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with replace_file(file) as temporary:
            temporary.write_text(settings.model_dump_json(indent=1) + "\n", encoding="utf-8")
    except (OSError, OutputError) as error:
        return f"settings cannot be saved: {error}"
    return ""


@contextmanager
def keep_changes(
    settings: SettingsType, file: Path | None, read: Callable[[SettingsType], SettingsType]
) -> Iterator[None]:
    """Save the settings that are changed while the block runs; nothing if it raises.

    Parameters
    ----------
    settings : BaseModel
        Settings as they were loaded.
    file : Path or None
        None to save nothing.
    read : callable
        Returns the present settings of the window, given those that were loaded.
    """
    at_opening = read(settings)
    yield
    save_settings(merge_changed_settings(settings, at_opening, read(settings)), file)
