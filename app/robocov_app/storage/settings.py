"""Persistent settings of a window, stored as a JSON file in the user's configuration folder."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

from platformdirs import user_config_path
from pydantic import BaseModel

from robocov.errors import OutputError
from robocov.files.writing import replace_file

FOLDER_VARIABLE = "ROBOCOV_SETTINGS"
"""Environment variable that selects another folder for settings; if it is empty, none are stored."""
BACKUP_SUFFIX = ".bak"
"""Suffix that is appended to the name of a file that cannot be read, before a new one is written."""
SettingsType = TypeVar("SettingsType", bound=BaseModel)


def find_settings_file(name: str = "window.json") -> Path | None:
    """Return the path of a settings file; None if no settings are stored."""
    default_folder = str(user_config_path("robocov", appauthor=False))
    folder = os.environ.get(FOLDER_VARIABLE, default_folder)
    if not folder:
        return None
    return Path(folder) / name


def load_settings(kind: type[SettingsType], file: Path | None) -> tuple[SettingsType, str]:
    """Load settings from a file.

    Parameters
    ----------
    kind : type
        Pydantic model of the settings.
    file : Path or None
        File of the settings; None if no settings are stored.

    Returns
    -------
    settings : BaseModel
        The default settings if there is no file or it cannot be read.
    message : str
        Message for the user if the file cannot be read; otherwise empty.
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
    """Apply the changes that were made in the window to the saved settings.

    Parameters
    ----------
    saved : BaseModel
        Settings in the file, which another window may have changed.
    at_opening, at_closing : BaseModel
        Settings of the window when it opened and when it closed. Options from the command line are in both,
        so they do not count as changes and are not saved.

    Returns
    -------
    BaseModel
    """
    changes = {name: value for name, value in at_closing if value != getattr(at_opening, name)}
    return saved.model_copy(update=changes)


def save_settings(settings: BaseModel, file: Path | None) -> str:
    """Save settings to a file.

    Parameters
    ----------
    settings : BaseModel
        The settings to save.
    file : Path or None
        File of the settings; None to save nothing.

    Returns
    -------
    str
        Message for the user if the settings cannot be saved; otherwise empty.
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
def save_changed_settings(
    settings: SettingsType, file: Path | None, read: Callable[[SettingsType], SettingsType]
) -> Iterator[None]:
    """Save the settings that change while the block runs; save nothing if it raises.

    Other settings keep the values in the file at that time, because another window may have saved them. If
    the file cannot be read, `BACKUP_SUFFIX` is appended to its name first. Without changes, an existing file
    stays as it is.

    Parameters
    ----------
    settings : BaseModel
        Settings as they were loaded.
    file : Path or None
        File of the settings; None to save nothing.
    read : callable
        Takes the loaded settings, and returns the current settings of the window.
    """
    at_opening = read(settings)
    yield
    at_closing = read(settings)
    if file is None or (at_closing == at_opening and file.exists()):
        return
    saved, problem = load_settings(type(settings), file)
    if problem and file.is_file():
        with suppress(OSError):
            file.replace(file.with_name(file.name + BACKUP_SUFFIX))
    save_settings(merge_changed_settings(saved, at_opening, at_closing), file)
