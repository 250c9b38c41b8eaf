"""Loading of saved runs and comparisons, and names for their folders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from robocov.environment import CircleObstacle, Environment
from robocov.errors import InputError
from robocov.files.documents import Document, expect, read_document
from robocov.files.result_folder import complete_commit, require_result
from robocov.files.result_names import COMPARISON_FILE, COST_FILE, RUN_FILE
from robocov.metrics import CostHistory
from robocov.metrics.results import read_history
from robocov.record import Record
from robocov_app.terminal.output import clean_file_stem

COMPARISON_FORMAT = "robocov-comparison"
"""Format in ``comparison.json``."""
COMPARISON_VERSION = 1
"""Version of this format."""


class ComparisonDocument(Document):
    """The content of ``comparison.json``; the list `runs` stays empty until the comparison has ended."""

    folders: list[Annotated[str, Field(pattern=r"^[^./\\\x00][^/\\\x00]*$"), expect("the name of a folder")]]
    runs: list[dict[str, Any]] = Field([])


class SavedRun(NamedTuple):
    """A run that was read from its folder.

    Attributes
    ----------
    folder : Path
        Folder of the run.
    record : Record
        The content of ``record.npz`` and ``run.json``.
    history : CostHistory or None
        The content of ``cost.csv``, if it exists.
    """

    folder: Path
    record: Record
    history: CostHistory | None


class Roster(NamedTuple):
    """The numbers of the robots in a record. When a robot fails in the window, the others keep their numbers.

    Attributes
    ----------
    environment : Environment
        The map without failed robots, which are obstacles in the record.
    numbers : tuple of int
        Number of each robot in the record.
    failed : dict of int to (x, y), m
        Positions of the failed robots, by number.
    """

    environment: Environment
    numbers: tuple[int, ...]
    failed: dict[int, tuple[float, float]]


def load_saved_runs(path: Path) -> list[SavedRun]:
    """Load a run, or the runs of a comparison.

    Parameters
    ----------
    path : Path
        The folder, or its ``run.json`` or ``comparison.json``.

    Returns
    -------
    list of SavedRun
        The runs. If the program was killed during a comparison, only the runs that had been saved.

    Raises
    ------
    InputError
        If this is not the folder of a run or a comparison, or if a file in it is invalid.
    """
    is_file = path.name in (RUN_FILE, COMPARISON_FILE) and not path.is_dir()
    folder = path.parent if is_file else path
    complete_commit(folder)
    comparison_path = folder / COMPARISON_FILE
    if comparison_path.is_file():
        return _load_comparison(comparison_path)
    require_result(folder, "the folder of a run or comparison", (RUN_FILE, COMPARISON_FILE))
    return [_load_run(folder)]


def _load_comparison(path: Path) -> list[SavedRun]:
    """Load the runs of a comparison; raise InputError if they do not have the same map."""
    content = read_document(path, ComparisonDocument, COMPARISON_FORMAT, COMPARISON_VERSION)
    folders = [path.parent / name for name in content.folders]
    for folder in folders:
        if folder.is_symlink():
            raise InputError(f"{folder}: expected a subfolder of the comparison, got a symbolic link")
    # If the program was killed, the file has no results, and some of the runs may not have been saved.
    is_complete = bool(content.runs)
    saved = [_load_run(folder) for folder in folders if is_complete or (folder / RUN_FILE).is_file()]
    if not saved:
        raise InputError(f"{path}: expected at least one run, got none")
    first_environment = build_roster(saved[0].record).environment
    for run in saved[1:]:
        environment = build_roster(run.record).environment
        if not environment.has_same_geometry(first_environment):
            raise InputError(f"{run.folder / RUN_FILE}: expected the same map as in {saved[0].folder}")
    return saved


def has_constant_setting(record: Record) -> bool:
    """Return whether neither the team nor the map of a run changes, so that one placement is always best.

    Parameters
    ----------
    record : Record

    Returns
    -------
    bool
    """
    return bool(record.is_working.all()) and not record.environment.has_moving_obstacles


def build_roster(record: Record) -> Roster:
    """Determine the numbers of the robots in a record, and the robots that failed.

    Parameters
    ----------
    record : Record
        The record of a run, which may be part of a session in the window.

    Returns
    -------
    Roster
        If the record does not come from a session, or its map does not match the session, robots are
        numbered from 1 and none has failed.
    """
    environment = record.environment
    default_numbers = tuple(range(1, len(record.team) + 1))
    numbers = tuple(record.session.get("robots", default_numbers))
    failed = {int(number): (x, y) for number, (x, y) in record.session.get("failed", {}).items()}
    failed_names = {name_failed_robot(number) for number in failed}
    remaining = tuple(
        obstacle
        for obstacle in environment.obstacles
        if not isinstance(obstacle, CircleObstacle) or obstacle.name not in failed_names
    )
    is_consistent = (
        len(numbers) == len(default_numbers)
        and len({*numbers, *failed}) == len(numbers) + len(failed)
        and len(environment.obstacles) - len(remaining) == len(failed)
    )
    if not is_consistent:
        return Roster(environment, default_numbers, {})
    return Roster(replace(environment, obstacles=remaining), numbers, failed)


def name_failed_robot(number: int) -> str:
    """Return the name of the obstacle that represents a failed robot."""
    return f"failed robot {number}"


def name_folders(controllers: Sequence[str]) -> list[str]:
    """Choose a folder name for each controller.

    Parameters
    ----------
    controllers : sequence of str
        Names of controllers.

    Returns
    -------
    list of str
        A different, valid folder name for each controller. The names differ in more than upper and lower
        case, which many file systems do not distinguish.

    Examples
    --------
    >>> name_folders(["rapf", "mine.py:Mine", "other/mine.py:Mine"])
    ['rapf', 'Mine', 'Mine-2']
    """
    folders: list[str] = []
    used_names = set()
    for controller in controllers:
        stem = clean_file_stem(controller.rpartition(":")[2], "controller")
        folder = stem
        number = 1
        while folder.casefold() in used_names:
            number += 1
            folder = f"{stem}-{number}"
        used_names.add(folder.casefold())
        folders.append(folder)
    return folders


def _load_run(folder: Path) -> SavedRun:
    """Load the record of a run, and its cost if that was saved."""
    history_path = folder / COST_FILE
    history = read_history(history_path) if history_path.exists() else None
    return SavedRun(folder, Record.load(folder), history)
