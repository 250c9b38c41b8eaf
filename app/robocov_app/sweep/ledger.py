"""The folder of a sweep: which runs are done, which have failed, and what the table holds of them.

Every run has a folder of its own, which is written aside and renamed: it is there whole or not at all.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from robocov.errors import InputError, OutputError
from robocov.files.atomic import written
from robocov.files.lock import locked

if TYPE_CHECKING:
    from robocov_app.sweep.performing import Outcome
    from robocov_app.sweep.task import Task

RUNS = "runs"
"""Name of the folder of the runs' folders."""

STUDY = "study.json"

_ROW = "row.json"
"""What the table holds of a run, in its folder."""

_HEAD = {"format": "robocov-row", "version": 1}

_STUDY_FORMAT = "robocov-study"


class Entry(NamedTuple):
    """What the table holds of a run that is there.

    Attributes
    ----------
    figures : dict of name to value
        Empty where it failed.
    error : str or None
    """

    figures: Mapping[str, float | int | None]
    error: str | None


class Ledger:
    """The runs in the folder of a sweep."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._runs = folder / RUNS

    def entry(self, task: Task) -> Entry | None:
        """Return what came of a task, None where nothing (or nothing that can be read) is there."""
        try:
            content = json.loads((self._runs / task.name / _ROW).read_bytes())
            if content["digest"] != task.digest or content["format"] != _HEAD["format"]:
                return None
            figures, error = dict(content["figures"]), content["error"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        return Entry(figures, error)

    def keep(self, task: Task, outcome: Outcome) -> Entry:
        """Write the folder of a run, in the place of an earlier one, and return its entry.

        Raises
        ------
        OutputError
            When it cannot be written; nothing is left of it then.
        """
        target = self._runs / task.name
        part = self._runs / f".{task.name}.part"
        row = {**_HEAD, "digest": task.digest, "figures": dict(outcome.figures), "error": outcome.error}
        files = {**outcome.files, _ROW: (json.dumps(row, allow_nan=False) + "\n").encode()}
        try:
            _remove(part)
            part.mkdir()
            for name, content in files.items():
                (part / name).write_bytes(content)
            _remove(target)
            part.rename(target)
        except OSError as error:
            with suppress(OSError):
                _remove(part)
            raise OutputError(f"{target}: cannot be written: {error.strerror or error}") from error
        return Entry(outcome.figures, outcome.error)

    def _tidy(self) -> None:
        """Remove what a sweep that was killed has left half-written."""
        for part in self._runs.glob(".*.part"):
            _remove(part)
        for pattern in (".robocov-*.part.*", ".study.*.part.json", ".results.*.part.*"):
            for part in self.folder.glob(pattern):
                part.unlink()


@contextmanager
def opened(folder: Path, study: Mapping[str, Any]) -> Iterator[Ledger]:
    """Give the ledger of a sweep, for one process at a time; the folder is made where it is missing.

    Parameters
    ----------
    folder : Path
    study : dict
        The content of ``study.json``; that of an earlier study is replaced.

    Raises
    ------
    InputError
        When the folder holds something else than a sweep.
    OutputError
        When it cannot be made or written to, or another process is at work in it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        used = any(not path.name.startswith(".") for path in folder.iterdir())
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used for results: {error.strerror or error}") from error
    if used and not is_sweep(folder):
        raise InputError(
            f"{folder}: the folder is not empty, and what is in it is no sweep; another --out was wanted"
        )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"{folder}: cannot be used for results: Permission denied")
    with locked(folder):
        ledger = Ledger(folder)
        try:
            ledger._tidy()
            with written(folder / STUDY) as part:
                part.write_text(json.dumps(study, allow_nan=False, indent=1) + "\n", encoding="utf-8")
            (folder / RUNS).mkdir(exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot be used for results: {error.strerror or error}") from error
        yield ledger


def is_sweep(folder: Path) -> bool:
    """Return whether a folder is that of a sweep."""
    try:
        content = json.loads((folder / STUDY).read_bytes())
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(content, dict) and content.get("format") == _STUDY_FORMAT


def _remove(folder: Path) -> None:
    """Remove the folder of a run; links are not followed."""
    if folder.is_symlink() or folder.is_file():
        folder.unlink()
    elif folder.exists():
        shutil.rmtree(folder)
