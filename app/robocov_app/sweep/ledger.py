"""The folder of a sweep: each run has its own folder, which is complete or absent, with checksums.

There is no database in addition to the folders. An SQLite index of 2000 runs saved 0.1 ms per run when a
sweep was resumed (0.07 instead of 0.17 ms, since checksums must always be verified), but each
transaction took 4 ms in addition to the 6 ms for the folder of the run. The index would be a second
description of the runs, which may contradict the first one after a crash or after a user has removed a
folder. Moreover, its write-ahead log does not work on network file systems, to which sweeps on clusters are
written.
"""

from __future__ import annotations

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
from robocov.files.result_names import ERROR_FILE, RUN_FILE, RUNS_FOLDER, STUDY_FILE, SWEEP_TABLE_FILE
from robocov.files.writing import flush_to_disk
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import METRICS, Outcome, list_result_versions
from robocov_app.terminal.output import write_json

_ROW_FILE = "row.json"
"""File in the folder of a run with its metrics for the table and the checksums of its other files."""
_ROW_FORMAT = "robocov-row"
_ROW_VERSION = 2
_CHECKSUM_BYTES = 16
_TEMPORARY_NAME = re.compile(
    r"\..*-[0-9a-f]{10}\.part|\.robocov-[0-9a-f]{12}\.part\.json|\.(results|study)\..*part\.(csv|parquet|json)"
)
"""Names of incomplete files and folders, which a killed sweep leaves behind."""
_METRICS_KEY = "figures"
"""Key of the metrics in `_ROW_FILE`. It never changes, so that existing runs can be reused."""
_MAX_NAMED_RUNS = 5
"""Maximum number of damaged runs that a message names."""


class Entry(NamedTuple):
    """The ledger's entry of a run."""

    metrics: Mapping[str, float | int | None]
    """Metrics in the table; empty if the run failed."""
    error: str | None
    """Reason why the run failed; None if it did not."""
    versions: Mapping[str, str] = {}
    """Versions of the packages on which the results depend."""
    has_checksums: bool = True
    """Whether the files of the run have checksums."""


class DamagedRunError(ValueError):
    """The folder of a run exists, but its content has changed since it was written."""


@dataclass
class Survey:
    """State of the runs of a study.

    Attributes
    ----------
    must_execute : bytearray
        1 for each run that must still be executed, 0 for the others, in the order of the tasks.
    damaged : list of str
        Names of damaged runs.
    outdated : Counter
        Number of runs that were made with other versions, by the description of the differences.
    without_checksums : int
        Number of reused runs without checksums.
    failed : int
        Number of reused runs that failed.
    """

    must_execute: bytearray = field(default_factory=bytearray)
    damaged: list[str] = field(default_factory=list)
    outdated: Counter[str] = field(default_factory=Counter)
    without_checksums: int = 0
    failed: int = 0

    @property
    def remaining(self) -> int:
        """Number of runs that remain to be executed."""
        return sum(self.must_execute)

    @property
    def reused(self) -> int:
        """Number of runs that are used without being repeated."""
        return len(self.must_execute) - self.remaining

    def describe(self, *, keep_versions: bool) -> list[str]:
        """Return remarks on damaged runs and on runs of other versions, one per line.

        Parameters
        ----------
        keep_versions : bool
            Whether runs that were made with other versions are reused.
        """
        lines = []
        if self.damaged:
            names = ", ".join(self.damaged[:_MAX_NAMED_RUNS])
            unnamed = len(self.damaged) - _MAX_NAMED_RUNS
            if unnamed > 0:
                names = f"{names} and {unnamed} more"
            runs = format_count(len(self.damaged), "damaged run")
            lines.append(f"{runs} will be repeated: {names}")
        decision = "will be repeated"
        if keep_versions:
            decision = "will be reused anyway"
        for differences, count in self.outdated.items():
            lines.append(f"{format_count(count, 'run')} made with {differences} {decision}")
        if self.outdated and not keep_versions:
            lines.append("--keep-versions reuses them as they are")
        if self.without_checksums:
            runs = format_count(self.without_checksums, "run")
            lines.append(
                f"{runs} of an earlier version of robocov without checksums will be used; damage to their "
                "cost curves and trajectories would not be noticed"
            )
        return lines


class Ledger:
    """The runs in the folder of a sweep.

    Parameters
    ----------
    folder : Path
        Folder of the sweep.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.runs_folder = folder / RUNS_FOLDER

    def read_entry(self, task: Task) -> Entry | None:
        """Return the entry of a task; None if it is missing or damaged."""
        with suppress(DamagedRunError):
            return self._read_entry(task, checks_files=False)
        return None

    def survey(
        self, tasks: Iterable[Task], *, retry_failed: bool = False, keep_versions: bool = False
    ) -> Survey:
        """Find out which runs remain to be executed.

        Parameters
        ----------
        tasks : iterable of Task
            The runs of a study.
        retry_failed : bool
            Whether failed runs are repeated.
        keep_versions : bool
            Whether runs that were made with other versions are reused.

        Returns
        -------
        Survey
        """
        survey = Survey()
        for task in tasks:
            survey.must_execute.append(
                self._survey_task(survey, task, retry_failed=retry_failed, keep_versions=keep_versions)
            )
        return survey

    def _survey_task(self, survey: Survey, task: Task, *, retry_failed: bool, keep_versions: bool) -> bool:
        """Count a task in a survey; return whether it remains to be executed."""
        try:
            entry = self._read_entry(task, checks_files=True)
        except DamagedRunError:
            survey.damaged.append(task.name)
            return True
        if entry is None or (retry_failed and entry.error is not None):
            return True
        differences = describe_version_differences(entry.versions)
        if differences:
            survey.outdated[differences] += 1
            if not keep_versions:
                return True
        if not entry.has_checksums:
            survey.without_checksums += 1
        if entry.error is not None:
            survey.failed += 1
        return False

    def _read_entry(self, task: Task, *, checks_files: bool) -> Entry | None:
        """Return the entry of a task; None if there is none.

        Raises
        ------
        DamagedRunError
            If the entry has changed since it was written or, with `checks_files`, any other file of the run.
        """
        folder = self.runs_folder / task.name
        if not os.path.lexists(folder):
            return None
        try:
            row = json.loads(_read_file(folder / _ROW_FILE))
            metrics = row[_METRICS_KEY]
            error = row["error"]
            _require_undamaged(row["format"] == _ROW_FORMAT and row["digest"] == task.input_hash)
            _require_undamaged(
                all(value is None or type(value) in (int, float) for value in metrics.values())
            )
            _require_undamaged(isinstance(error, str | None))
            if row["version"] == 1 and "check_sum" not in row:
                versions = _read_format_1_versions(folder, metrics, error)
                return Entry(metrics, error, versions, has_checksums=False)
            _require_undamaged(row.pop("check_sum") == _compute_row_checksum(row))
            if checks_files:
                _check_files(folder, row["files"])
            return Entry(metrics, error, row["versions"])
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as fault:
            raise DamagedRunError from fault

    def store(self, task: Task, outcome: Outcome) -> None:
        """Write the folder of a run, replacing an earlier one.

        The folder gets its name only when it is complete, so no run can have a partly written folder.

        Parameters
        ----------
        task : Task
            The run, whose name is that of the folder.
        outcome : Outcome
            Files and metrics of the run.

        Raises
        ------
        OutputError
            If the folder cannot be written.
        """
        target = self.runs_folder / task.name
        temporary = self.runs_folder / f".{task.name}.part"
        row: dict[str, Any] = {
            "format": _ROW_FORMAT,
            "version": _ROW_VERSION,
            "digest": task.input_hash,
            "versions": dict(outcome.versions),
            _METRICS_KEY: dict(outcome.metrics),
            "error": outcome.error,
            "files": {name: _describe_file(content) for name, content in outcome.files.items()},
        }
        row["check_sum"] = _compute_row_checksum(row)
        row_content = (json.dumps(row, allow_nan=False) + "\n").encode()
        files = {**outcome.files, _ROW_FILE: row_content}
        try:
            _remove(temporary)
            temporary.mkdir()
            for name, content in files.items():
                (temporary / name).write_bytes(content)
            flush_to_disk([*(temporary / name for name in files), temporary])
            _remove(target)
            temporary.rename(target)
        except OSError as error:
            with suppress(OSError):
                _remove(temporary)
            raise OutputError(f"{target}: cannot be written: {error.strerror or error}") from error


def describe_version_differences(
    versions: Mapping[str, str], current_versions: Mapping[str, str] | None = None
) -> str:
    """Describe how versions differ from those of this process.

    Parameters
    ----------
    versions : mapping of str to str
        Versions by package; missing packages do not count as different.
    current_versions : mapping of str to str, optional
        Versions in this process. By default, those of the packages on which every result depends.

    Returns
    -------
    str
        Such as ``numpy 2.0.1 instead of 2.1.0``; empty if there are no differences.
    """
    if current_versions is None:
        current_versions = list_result_versions()
    differences = []
    for name, current in current_versions.items():
        if versions.get(name, current) != current:
            differences.append(f"{name} {versions[name]} instead of {current}")
    return ", ".join(differences)


@contextmanager
def open_ledger(folder: Path, study: Mapping[str, Any]) -> Iterator[Ledger]:
    """Open the ledger of a sweep, locked so that only one process uses it at a time.

    Parameters
    ----------
    folder : Path
        Folder of the sweep; it is created if necessary.
    study : mapping
        Content of ``study.json``.

    Yields
    ------
    Ledger

    Raises
    ------
    InputError
        If the folder contains anything other than a sweep.
    OutputError
        If the folder is not writable.
    """
    with report_folder_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        is_used = any(not path.name.startswith(".") for path in folder.iterdir())
    if is_used and not is_sweep(folder):
        raise InputError(f"{folder}: expected an empty folder or a sweep; choose another --out")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise OutputError(f"{folder}: cannot be written: Permission denied")
    with lock_folder(folder):
        ledger = Ledger(folder)
        try:
            for path in (*ledger.runs_folder.glob(".*"), *folder.glob(".*")):
                if _TEMPORARY_NAME.fullmatch(path.name):
                    _remove(path)
            # This file comes first, because it marks the folder as the folder of a sweep.
            if not has_all_rows(folder):
                write_json(folder / STUDY_FILE, study)
            ledger.runs_folder.mkdir(exist_ok=True)
        except OSError as error:
            path = error.filename or folder
            raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error
        yield ledger


def count_rows(folder: Path) -> int:
    """Return the number of rows in the table of a sweep; 0 if there is no table."""
    with suppress(OSError), (folder / SWEEP_TABLE_FILE).open("rb") as file:
        return max(0, sum(1 for _ in file) - 1)
    return 0


def has_all_rows(folder: Path) -> bool:
    """Return whether the table of a sweep has a row for each run of ``study.json``."""
    try:
        return count_rows(folder) >= int(json.loads(_read_file(folder / STUDY_FILE))["runs"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def is_sweep(folder: Path) -> bool:
    """Return whether a folder contains a sweep, even if its ``study.json`` is damaged."""
    try:
        content = json.loads(_read_file(folder / STUDY_FILE))
    except OSError:
        return False
    except (ValueError, RecursionError):
        return (folder / RUNS_FOLDER).is_dir() and (folder / ".lock").is_file()
    return isinstance(content, dict) and content.get("format") == "robocov-study"


def _read_format_1_versions(folder: Path, metrics: Mapping[str, Any], error: str | None) -> Mapping[str, str]:
    """Read the versions of a run in format 1; raise DamagedRunError if its files contradict its row.

    `metrics` and `error` are those of the row. Failed runs have no versions.
    """
    file_name = RUN_FILE if error is None else ERROR_FILE
    run = json.loads(_read_file(folder / file_name))
    if error is not None:
        _require_undamaged(run["error"] == error)
        return {}
    for name in METRICS:
        value = run["summary"][name]
        # The table contains the mean of values for each robot.
        expected = sum(value) / len(value) if isinstance(value, list) else value
        _require_undamaged(metrics[name] == expected)
    return dict(run["versions"])


def _check_files(folder: Path, files: Mapping[str, tuple[int, str]]) -> None:
    """Raise DamagedRunError unless each file has its recorded size and checksum."""
    for name, (size, checksum) in files.items():
        content = _read_file(folder / name)
        _require_undamaged(len(content) == size and _compute_file_checksum(content) == checksum)


def _describe_file(content: bytes) -> tuple[int, str]:
    """Return the size of a file and its checksum."""
    return len(content), _compute_file_checksum(content)


def _require_undamaged(is_valid: bool) -> None:
    """Raise DamagedRunError if a check of a run has failed."""
    if not is_valid:
        raise DamagedRunError


def _read_file(path: Path) -> bytes:
    """Return the content of a regular file; raise FileNotFoundError for anything else."""
    # Reading something else, such as a pipe, might never end.
    if not path.is_file():
        raise FileNotFoundError(path)
    return path.read_bytes()


def _compute_file_checksum(content: bytes) -> str:
    return blake2b(content, digest_size=_CHECKSUM_BYTES).hexdigest()


def _compute_row_checksum(row: Mapping[str, Any]) -> str:
    """Return the checksum of a row, which does not depend on the order of its entries."""
    return _compute_file_checksum(json.dumps(row, sort_keys=True, allow_nan=False).encode())


def _remove(path: Path) -> None:
    """Remove a file or a folder with its content, if it exists."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
