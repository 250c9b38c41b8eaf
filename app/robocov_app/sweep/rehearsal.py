"""What a sweep would take, from one of its runs."""

from __future__ import annotations

import time
from dataclasses import dataclass
from itertools import compress
from typing import TYPE_CHECKING, Any

from robocov_app.sweep.ledger import Ledger, Survey
from robocov_app.sweep.performing import perform, prepared
from robocov_app.sweep.task import tasks_of

if TYPE_CHECKING:
    from pathlib import Path

    from robocov_app.sweep.study import Study


@dataclass(frozen=True)
class Rehearsal:
    """What a sweep would take.

    `left`: those that are not done yet. `axes`: how many values there are of each thing that the study
    varies; their product is `runs` where all maps have as many starts, and all controllers as many gains.
    `run`: name of the run that was done. `error`: why that failed. `seconds_a_run` in s. `seconds`, s: for
    all that are left, on so many workers. `bytes`: for all runs together. `notes`: what of that which is
    there is done again, and why.
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
    notes: list[str]


def rehearsed(
    study: Study,
    folder: Path | None,
    *,
    workers: int,
    retry_failed: bool = False,
    keep_versions: bool = False,
) -> Rehearsal:
    """Do the first run that is left, or else the first, and write nothing.

    `folder`: where runs may be that are done already. `workers`: on which the time is estimated.
    `retry_failed`, `keep_versions`: as of a sweep.
    """
    survey = Survey(bytearray(b"\x01") * len(study))
    if folder is not None:
        ledger = Ledger(folder)
        survey = ledger.survey(tasks_of(study), retry_failed=retry_failed, keep_versions=keep_versions)
    left = sum(survey.todo)
    chosen = next(compress(tasks_of(study), survey.todo), None) or next(tasks_of(study))
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
        notes=survey.words(keep_versions=keep_versions),
    )


def axes_of(study: Study) -> dict[str, int]:
    """Return how many values there are of each thing that a study varies."""
    axes: dict[str, Any] = {"maps": study.maps, "robots": study.robots, "teams": study.teams}
    axes |= {"starts": [name for each in study.maps for name in study.starts_on(each)]}
    axes |= {"seeds": study.seeds, "controllers": study.controllers}
    sizes = {name: len(values) for name, values in axes.items()}
    return sizes | {f"gains of {name}": len(study.gains_of(name).choices) for name in study.controllers}
