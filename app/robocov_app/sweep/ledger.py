"""The folder of a sweep: each run in a folder of its own, there whole or not at all, with check sums."""

import json
import os
import re
import shutil
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from hashlib import blake2b
from pathlib import Path
from typing import Any, NamedTuple

from robocov.errors import InputError, OutputError, format_count
from robocov.files.folder_lock import lock_folder
from robocov.files.result_folder import report_folder_errors
from robocov.files.writing import flush_to_disk
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import FIGURES, Outcome, list_result_versions
from robocov_app.terminal.output import write_json

RUNS = "runs"  # name of the folder of the runs' folders
STUDY, CSV = "study.json", "results.csv"
_ROW = "row.json"  # what the table holds of a run, in its folder
_HEAD = {"format": "robocov-row", "version": 2}
_LEFT_OVER = re.compile(
    r"\..*-[0-9a-f]{10}\.part|\.robocov-[0-9a-f]{12}\.part\.json|\.(results|study)\..*part\.(csv|parquet|json)"
)
"""Names of what a sweep that was killed has left half-written."""
_NAMED = 5  # damaged runs that are named


class Entry(NamedTuple):
    """Ledger entry of a run; no figures where it failed, not `checked` in version 1."""

    figures: Mapping[str, float | int | None]
    error: str | None
    versions: Mapping[str, str] = {}
    checked: bool = True


class Damaged(ValueError):  # noqa: N818 - it is handled
    """A run is there, but is not as it was written."""


@dataclass
class Survey:
    """Inventory of a study's runs: `todo` has 1 for each, in order, that is to be done."""

    todo: bytearray = field(default_factory=bytearray)
    damaged: list[str] = field(default_factory=list)
    outdated: Counter[str] = field(default_factory=Counter)
    unchecked: int = 0
    failed: int = 0

    def words(self, *, keep_versions: bool) -> list[str]:
        lines = []
        if self.damaged:
            count, rest = len(self.damaged), len(self.damaged) - _NAMED
            names = ", ".join(self.damaged[:_NAMED]) + (f" and {rest} more" if rest > 0 else "")
            lines.append(f"{format_count(count, 'damaged run')} will be done again: {names}")
        for difference, count in self.outdated.items():
            then = "will be used all the same" if keep_versions else "will be done again"
            lines.append(f"{format_count(count, 'run')} made with {difference} {then}")
        if self.outdated and not keep_versions:
            lines.append("--keep-versions uses them as they are")
        if self.unchecked:
            runs = (
                f"{format_count(self.unchecked, 'run')} of an earlier version of robocov without check sums"
            )
            damage = "damage to their cost curves and trajectories would not be noticed"
            lines.append(f"{runs} will be used; {damage}")
        return lines


class Ledger:
    """The runs in the folder of a sweep."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._runs = folder / RUNS

    def entry(self, task: Task) -> Entry | None:
        """Return what came of a task, None where nothing (or nothing that can be used) is there."""
        with suppress(Damaged):
            return self._entry(task)
        return None

    def survey(
        self, tasks: Iterable[Task], *, retry_failed: bool = False, keep_versions: bool = False
    ) -> Survey:
        found = Survey()
        for task in tasks:
            entry = None
            try:
                entry = self._entry(task, files=True)
            except Damaged:
                found.damaged.append(task.name)
            todo = entry is None or (retry_failed and entry.error is not None)
            if entry is not None and not todo:
                if difference := difference_of(entry.versions):
                    found.outdated[difference] += 1
                    todo = not keep_versions
                found.unchecked += not todo and not entry.checked
                found.failed += not todo and entry.error is not None
            found.todo.append(todo)
        return found

    def _entry(self, task: Task, *, files: bool = False) -> Entry | None:
        """Return what came of a task, None for nothing; with `files`, check all of them."""
        folder = self._runs / task.name
        if not os.path.lexists(folder):
            return None
        try:
            row = json.loads(_content(folder / _ROW))
            figures, error = row["figures"], row["error"]
            _require(row["format"] == _HEAD["format"] and row["digest"] == task.digest)
            _require(all(value is None or type(value) in (int, float) for value in figures.values()))
            _require(isinstance(error, str | None))
            if row["version"] == 1 and "check_sum" not in row:
                run = _content(folder / ("run.json" if error is None else "error.json"))
                return Entry(figures, error, _versions_1(json.loads(run), figures, error), checked=False)
            _require(row.pop("check_sum") == _check_sum(row))
            for name, (size, digest) in row["files"].items() if files else ():
                content = _content(folder / name)
                _require(len(content) == size and _digest(content) == digest)
            return Entry(figures, error, row["versions"])
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as fault:
            raise Damaged from fault

    def keep(self, task: Task, outcome: Outcome) -> None:
        """Write the folder of a run, in the place of an earlier one: all of it, or nothing."""
        target = self._runs / task.name
        part = self._runs / f".{task.name}.part"
        row: dict[str, Any] = {**_HEAD, "digest": task.digest, "versions": dict(outcome.versions)}
        row |= {"figures": dict(outcome.figures), "error": outcome.error}
        row["files"] = {name: (len(content), _digest(content)) for name, content in outcome.files.items()}
        row["check_sum"] = _check_sum(row)
        files = {**outcome.files, _ROW: (json.dumps(row, allow_nan=False) + "\n").encode()}
        try:
            _remove(part)
            part.mkdir()
            for name, content in files.items():
                (part / name).write_bytes(content)
            flush_to_disk([*(part / name for name in files), part])
            _remove(target)
            part.rename(target)
        except OSError as error:
            with suppress(OSError):
                _remove(part)
            raise OutputError(f"{target}: cannot be written: {error.strerror or error}") from error


def difference_of(versions: Mapping[str, str]) -> str:
    """Return how known versions differ from those here, as in ``numpy 2.0.1 instead of 2.1.0``."""
    differences = []
    for name, current in list_result_versions().items():
        if versions.get(name, current) != current:
            differences.append(f"{name} {versions[name]} instead of {current}")
    return ", ".join(differences)


@contextmanager
def opened(folder: Path, study: Mapping[str, Any]) -> Iterator[Ledger]:
    """Give the ledger of a sweep, for one process at a time; `study` is the content of ``study.json``."""
    with report_folder_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        used = any(not path.name.startswith(".") for path in folder.iterdir())
    if used and not is_sweep(folder):
        foreign = "the folder is not empty, and what is in it is no sweep"
        raise InputError(f"{folder}: {foreign}; choose another --out")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"{folder}: cannot be used for results: Permission denied")
    with lock_folder(folder):
        ledger = Ledger(folder)
        try:
            for part in (*ledger._runs.glob(".*"), *folder.glob(".*")):
                if _LEFT_OVER.fullmatch(part.name):
                    _remove(part)
            # first: it says that the folder is ours
            if not has_all_rows(folder):
                write_json(folder / STUDY, study)
            (folder / RUNS).mkdir(exist_ok=True)
        except OSError as error:
            at = error.filename or folder
            raise OutputError(f"{at}: cannot be used for results: {error.strerror or error}") from error
        yield ledger


def rows_in(folder: Path) -> int:
    """Return the number of rows in the table of a sweep, 0 where there is none."""
    with suppress(OSError), (folder / CSV).open("rb") as file:
        return max(0, sum(1 for _ in file) - 1)
    return 0


def has_all_rows(folder: Path) -> bool:
    """Return whether the table of a sweep has a row for each run of ``study.json``."""
    try:
        return rows_in(folder) >= int(json.loads(_content(folder / STUDY))["runs"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def is_sweep(folder: Path) -> bool:
    """Return whether a folder is that of a sweep, also of one whose ``study.json`` is damaged."""
    try:
        content = json.loads(_content(folder / STUDY))
    except OSError:
        return False
    except (ValueError, RecursionError):
        return (folder / RUNS).is_dir() and (folder / ".lock").is_file()
    return isinstance(content, dict) and content.get("format") == "robocov-study"


def _versions_1(run: Mapping[str, Any], figures: Mapping[str, Any], error: str | None) -> Mapping[str, str]:
    """Return what a run of version 1 was made with, if its row agrees with its other file."""
    if error is not None:
        _require(run["error"] == error)
        return {}
    for name in FIGURES:
        value = run["summary"][name]
        _require(figures[name] == (sum(value) / len(value) if isinstance(value, list) else value))
    return dict(run["versions"])


def _require(sound: bool) -> None:
    if not sound:
        raise Damaged


def _content(path: Path) -> bytes:
    if not path.is_file():  # a pipe, say, might have no end
        raise FileNotFoundError(path)
    return path.read_bytes()


def _digest(content: bytes) -> str:
    return blake2b(content, digest_size=16).hexdigest()


def _check_sum(row: Mapping[str, Any]) -> str:
    return _digest(json.dumps(row, sort_keys=True, allow_nan=False).encode())


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
