"""Saved runs and comparisons, read back; names of their folders."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from robocov.environment import CircleObstacle, Environment
from robocov.errors import InputError
from robocov.files.documents import Document, expect, read_document
from robocov.files.result_folder import complete_commit
from robocov.metrics import CostHistory
from robocov.metrics.results import read_history
from robocov.record import Record


class ComparisonDocument(Document):
    """The content of ``comparison.json``; without `runs` as long as the comparison goes on."""

    folders: list[Annotated[str, Field(pattern=r"^[^./\\\x00][^/\\\x00]*$"), expect("the name of a folder")]]
    runs: list[dict[str, Any]] = Field([])


class Saved(NamedTuple):
    """A run that was saved. `history`: what is in ``cost.csv``, if it is there."""

    folder: Path
    record: Record
    history: CostHistory | None


class Roster(NamedTuple):
    """Robots of a record: the map without robots that failed, and where these stand, m."""

    environment: Environment
    numbers: tuple[int, ...]
    failed: dict[int, tuple[float, float]]


def load_saved(path: Path) -> list[Saved]:
    """Return a run, or those of a comparison (if it was killed, those there), by the folder or its JSON."""
    folder = path.parent if path.name in ("run.json", "comparison.json") and not path.is_dir() else path
    complete_commit(folder)
    if (path := folder / "comparison.json").is_file():
        content = read_document(path, ComparisonDocument, "robocov-comparison", 1)
        parts = [folder / name for name in content.folders]
        if linked := next((part for part in parts if part.is_symlink()), None):
            raise InputError(f"{linked}: expected a folder in that of the comparison, got a link")
        saved = [_load_run(part) for part in parts if content.runs or (part / "run.json").is_file()]
        if not saved:
            raise InputError(f"{path}: there is no run in it")
        maps = [roster_of(each.record).environment for each in saved]
        for each, found in zip(saved, maps, strict=True):
            if (found.boundary, found.obstacles) != (maps[0].boundary, maps[0].obstacles):
                raise InputError(f"{each.folder / 'run.json'}: another map than in {saved[0].folder}")
        return saved
    if not (folder / "run.json").is_file():
        none = "(there is no run.json and no comparison.json)"
        raise InputError(f"{folder}: not the folder of a run or a comparison {none}")
    return [_load_run(folder)]


def roster_of(record: Record) -> Roster:
    """Return who is who in a record of a session in the window; in others, robots are numbered from 1."""
    environment, session, usual = record.environment, record.session, tuple(range(1, len(record.team) + 1))
    numbers = tuple(session.get("robots", usual))
    failed = {int(number): (x, y) for number, (x, y) in session.get("failed", {}).items()}
    wrecks = {wreck_name(number) for number in failed}
    shapes = environment.obstacles
    standing = tuple(one for one in shapes if not isinstance(one, CircleObstacle) or one.name not in wrecks)
    told = len(numbers), len({*numbers, *failed}), len(shapes) - len(standing)
    if told != (len(usual), len(numbers) + len(failed), len(failed)):
        return Roster(environment, usual, {})
    return Roster(replace(environment, obstacles=standing), numbers, failed)


def wreck_name(number: int) -> str:
    return f"failed robot {number}"


def folder_names(names: Sequence[str]) -> list[str]:
    """Return a folder name for each controller: its own name, made fit for a folder and different for all.

    >>> folder_names(["rapf", "mine.py:Mine", "other/mine.py:Mine"])
    ['rapf', 'Mine', 'Mine-2']
    """
    taken: list[str] = []
    for name in names:
        stem = re.sub(r"[^\w.-]+", "-", name.rpartition(":")[2]).strip(".-")[:64] or "controller"
        alike = re.compile(re.escape(stem) + r"(-\d+)?")
        number = 1 + sum(alike.fullmatch(other) is not None for other in taken)
        taken.append(stem if number == 1 else f"{stem}-{number}")
    return taken


def _load_run(folder: Path) -> Saved:
    history = folder / "cost.csv"
    return Saved(folder, Record.load(folder), read_history(history) if history.exists() else None)
