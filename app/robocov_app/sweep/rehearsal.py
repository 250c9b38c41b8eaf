"""What a sweep would take, from one of its runs."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from robocov_app.sweep.ledger import Ledger
from robocov_app.sweep.performing import perform, prepared
from robocov_app.sweep.task import tasks_of

if TYPE_CHECKING:
    from pathlib import Path

    from robocov_app.sweep.study import Study
    from robocov_app.sweep.task import Task


@dataclass(frozen=True)
class Rehearsal:
    """What a sweep would take.

    Attributes
    ----------
    runs : int
    left : int
        Those that are not done yet.
    axes : dict of name to int
        How many values there are of each thing that the study varies; their product is `runs` where all maps
        have as many starts, and all controllers as many gains.
    run : str
        Name of the run that was done.
    error : str or None
        Why that failed.
    seconds_a_run : float, s
    bytes_a_run : int
    seconds : float, s
        For all that are left, on so many workers.
    bytes : int
        For all runs together.
    """

    runs: int
    left: int
    axes: dict[str, int]
    run: str
    error: str | None
    seconds_a_run: float
    bytes_a_run: int
    seconds: float
    bytes: int


def rehearsed(study: Study, folder: Path | None, *, workers: int, retry_failed: bool = False) -> Rehearsal:
    """Do the first run that is left, or else the first, and write nothing.

    Parameters
    ----------
    study : Study
    folder : Path or None
        Where runs may be that are done already.
    workers : int
        On which the time is estimated.
    retry_failed : bool
        Count runs that have failed as left.
    """
    ledger = None if folder is None else Ledger(folder)
    chosen: Task | None = None
    left = 0
    for task in tasks_of(study):
        entry = None if ledger is None else ledger.entry(task)
        if entry is None or (retry_failed and entry.error is not None):
            chosen = task if left == 0 else chosen
            left += 1
    if chosen is None:
        chosen = next(tasks_of(study))
    prepared(chosen)  # once for all runs on a map
    began = time.perf_counter()
    outcome = perform(chosen)
    seconds = time.perf_counter() - began
    size = sum(map(len, outcome.files.values()))
    return Rehearsal(
        runs=len(study),
        left=left,
        axes=axes_of(study),
        run=chosen.name,
        error=outcome.error,
        seconds_a_run=seconds,
        bytes_a_run=size,
        seconds=seconds * left / max(1, min(workers, left)),
        bytes=size * len(study),
    )


def axes_of(study: Study) -> dict[str, int]:
    """Return how many values there are of each thing that a study varies."""
    axes: dict[str, Any] = {"maps": study.maps, "robots": study.robots, "teams": study.teams}
    axes |= {"starts": [name for each in study.maps for name in study.starts_on(each)]}
    axes |= {"seeds": study.seeds, "controllers": study.controllers}
    sizes = {name: len(values) for name, values in axes.items()}
    return sizes | {f"gains of {name}": len(study.gains_of(name).choices) for name in study.controllers}
