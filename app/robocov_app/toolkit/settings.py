"""Persistent settings of a window, as JSON in the user's folder for settings."""

import os
from pathlib import Path
from typing import TypeVar

from platformdirs import user_config_path
from pydantic import BaseModel

from robocov.errors import OutputError
from robocov.files.writing import replace_file

FOLDER = "ROBOCOV_SETTINGS"  # environment variable with another folder for the settings; empty for none
Kept = TypeVar("Kept", bound=BaseModel)


def settings_file(name: str = "window.json") -> Path | None:
    folder = os.environ.get(FOLDER, str(user_config_path("robocov", appauthor=False)))
    return Path(folder) / name if folder else None


def loaded(kind: type[Kept], file: Path | None) -> tuple[Kept, str]:
    """Return settings of a kind, and what to tell if they could not be read: the defaults are used then."""
    try:
        if file is not None and file.exists():
            return kind.model_validate_json(file.read_bytes()), ""
    except (OSError, ValueError):
        return kind(), f"{file} could not be read: default settings"
    return kind(), ""


def changed_settings(before: Kept, opened: Kept, closed: Kept) -> Kept:
    """Return settings with what was changed in the window, not with what options asked for this time."""
    return before.model_copy(update={name: value for name, value in closed if value != getattr(opened, name)})


def save_settings(settings: BaseModel, file: Path | None) -> str:
    if file is None:
        return ""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with replace_file(file) as part:
            part.write_text(settings.model_dump_json(indent=1) + "\n", encoding="utf-8")
    except (OSError, OutputError) as error:
        return f"settings not saved: {error}"
    return ""
