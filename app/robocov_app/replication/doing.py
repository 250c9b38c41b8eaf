"""Doing the runs of several studies with one executor: a process that has been started does all of them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING

from robocov_app.replication.studying import Stopped, swept
from robocov_app.sweep.executors import LocalPool
from robocov_app.sweep.ledger import opened
from robocov_app.sweep.study import tasks_of
from robocov_app.sweep.sweeping import Count, sweep_progress, worked_off

if TYPE_CHECKING:
    from robocov_app.replication.studying import Means
    from robocov_app.sweep.ledger import Ledger
    from robocov_app.sweep.performing import Outcome
    from robocov_app.sweep.study import Study, Task


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
    if not waiting and not notes:
        return
    tasks = {task.digest: task for _, task in waiting}.values()
    count = Count(len(tasks))
    tell = stack.enter_context(sweep_progress(title, count, quiet=means.quiet))
    for note in notes:
        tell.say(note)
    # two studies may have a task in common
    homes: dict[str, list[Ledger]] = {}
    for ledger, task in waiting:
        homes.setdefault(task.digest, []).append(ledger)

    def keep(task: Task, outcome: Outcome) -> None:
        for ledger in homes[task.digest]:
            ledger.keep(task, outcome)

    for _ in worked_off(tasks, lambda: LocalPool(min(means.workers, len(tasks))), count, means.stop, keep):
        tell(count)
