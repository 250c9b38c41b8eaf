"""Doing the runs of several studies with one crew: a process that has been started does all of them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING

from robocov_app.paper.studying import Stopped, swept
from robocov_app.sweep.ledger import opened
from robocov_app.sweep.pool import LocalPool
from robocov_app.sweep.task import tasks_of
from robocov_app.sweep.telling import Count, told

if TYPE_CHECKING:
    from robocov_app.paper.studying import Means
    from robocov_app.sweep.crew import Crew
    from robocov_app.sweep.ledger import Ledger
    from robocov_app.sweep.study import Study
    from robocov_app.sweep.task import Task

_PATIENCE = 0.2
"""Seconds between two looks whether somebody has pressed Ctrl-C."""


def swept_together(studies: Mapping[str, Study], folder: Path, means: Means, title: str) -> None:
    """Do the runs of studies that are not done yet, each in ``studies/`` under its name.

    On this machine the processes are started once for all of them: most studies are so small that starting
    would take longer than they do. What came of a run stands in the folder of its study, as if each had been
    swept alone, and each then writes its table.

    Parameters
    ----------
    studies : dict of name to Study
    folder : Path
        Of the study of the paper.
    means : Means
    title : str
        What all of it is called when progress is told.

    Raises
    ------
    Stopped
        After Ctrl-C.
    InputError, OutputError
        As `robocov_app.sweep.sweeping.sweep`.
    """
    if means.scheduler is None:
        (folder / "studies").mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            ledgers = {
                name: stack.enter_context(opened(folder / "studies" / name, study.to_json()))
                for name, study in studies.items()
            }
            _filled(studies, ledgers, means, title, stack)
        if means.stop.requested:
            raise Stopped
        means = replace(means, quiet=True)  # all has been told
    for name, study in studies.items():
        swept(study, folder, name, means)


def _filled(
    studies: Mapping[str, Study], ledgers: Mapping[str, Ledger], means: Means, title: str, stack: ExitStack
) -> None:
    waiting: list[tuple[Ledger, Task]] = []
    notes = []
    for name, study in studies.items():
        survey = ledgers[name].survey(tasks_of(study), keep_versions=means.keep_versions)
        waiting += [(ledgers[name], task) for task in compress(tasks_of(study), survey.todo)]
        notes += [f"{name}: {line}" for line in survey.words(keep_versions=means.keep_versions)]
    count = Count(len(waiting))
    tell = stack.enter_context(told(title, count, quiet=means.quiet))
    for note in notes:
        tell.say(note)
    if not waiting or means.stop.requested:
        return
    crew: Crew = stack.enter_context(LocalPool(min(means.workers, len(waiting))))
    # two studies may have a task in common
    homes: dict[str, list[Ledger]] = {}
    for ledger, each in waiting:
        homes.setdefault(each.digest, []).append(ledger)
    left = iter({each.digest: each for _, each in waiting}.values())
    task: Task | None = next(left, None)
    while (task is not None or crew.busy) and not means.stop.requested:
        while task is not None and not crew.full:
            crew.submit(task)
            task = next(left, None)
        back = crew.next(_PATIENCE)
        count.lost = crew.lost
        if back is not None:
            done, outcome = back
            for ledger in homes[done.digest]:
                ledger.keep(done, outcome)
                if outcome.error is None:
                    count.done += 1
                else:
                    count.failed += 1
        tell(count)
