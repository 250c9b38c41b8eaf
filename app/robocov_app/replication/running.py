"""Running the sweeps of the study in its folder, resumably."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path

import numpy as np

from robocov.errors import InputError, OutputError
from robocov.files.atomic import written
from robocov_app.replication import studies
from robocov_app.replication.contenders import UNTUNED, Contender, distinct_gains, of_paper
from robocov_app.replication.plan import Plan
from robocov_app.replication.references import Reference, find_references
from robocov_app.sweep import performing
from robocov_app.sweep.executors import LocalPool
from robocov_app.sweep.ledger import Ledger, opened
from robocov_app.sweep.study import Study, StudyMap, Task, tasks_of
from robocov_app.sweep.sweeping import Count, sweep, sweep_progress, worked_off
from robocov_app.terminal.interruption import Interruption

MARK = "paper.json"  # says that a folder is that of a study of the paper, and which

_HEAD = {"format": "robocov-paper", "version": 1}


class Interrupted(Exception):  # noqa: N818 - it is no error
    """Somebody has pressed Ctrl-C."""


@dataclass(frozen=True)
class RunnerOptions:
    """How runs are done: on `workers` processes, or by the workers of a Dask `scheduler` (its address).

    With `keep_versions`, runs of other versions of robocov, or of what it computes with, are used.
    """

    workers: int
    scheduler: str | None
    quiet: bool
    stop: Interruption
    keep_versions: bool = False


@dataclass(frozen=True)
class Forecast:
    """All runs of a study, those `left`, the seconds for these on all workers, and those of one run each."""

    runs: int
    left: int
    seconds: float
    each: Mapping[str, float]


def open_folder(folder: Path, plan: Plan) -> None:
    """Make the folder of a study, or make sure that it is that of the same study.

    Raises InputError when it holds something else, or the other one of the quick and the full study;
    OutputError when it cannot be made or written to.
    """
    mark = folder / MARK
    try:
        folder.mkdir(parents=True, exist_ok=True)
        used = any(folder.iterdir())
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used for results: {error.strerror or error}") from error
    if not used:
        with written(mark) as part:
            part.write_text(json.dumps({**_HEAD, "plan": plan.name}) + "\n", encoding="utf-8")
        return
    try:
        content = json.loads(mark.read_bytes())
        named = content["plan"] if content["format"] == _HEAD["format"] else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        named = None
    if named == plan.name:
        return
    words = "the folder is not empty, and what is in it is no study of the paper"
    if named is not None:
        words = f"holds the {named} study, but the {plan.name} one was asked for"
    raise InputError(f"{folder}: {words}; another --out was wanted")


def run_study(study: Study, folder: Path, name: str, options: RunnerOptions) -> Path:
    """Do the runs of a sweep that are not done yet, in ``studies/`` under its name; return that folder.

    Raises Interrupted after Ctrl-C, and otherwise as `robocov_app.sweep.sweeping.sweep`.
    """
    target = folder / "studies" / name
    try:
        target.parent.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{target}: cannot be used for results: {error.strerror or error}") from error
    totals = sweep(
        study,
        target,
        workers=options.workers,
        scheduler=options.scheduler,
        keep_versions=options.keep_versions,
        quiet=options.quiet,
        title=f"paper: {name}",
        stop=options.stop,
    )
    if totals.interrupted or options.stop.requested:
        raise Interrupted
    return target


def run_together(sweeps: Mapping[str, Study], folder: Path, options: RunnerOptions, title: str) -> None:
    """Do the runs of several sweeps, each in ``studies/`` under its name, with one pool of processes.

    Most sweeps are so small that starting processes would take longer than they do. What came of a run stands
    in the folder of its sweep, as if each had been done alone, and each then writes its table. Raises as
    `run_study`.
    """
    if options.scheduler is None:
        (folder / "studies").mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            ledgers = {
                name: stack.enter_context(opened(folder / "studies" / name, study.to_json()))
                for name, study in sweeps.items()
            }
            _fill(sweeps, ledgers, options, title, stack)
        if options.stop.requested:
            raise Interrupted
        options = replace(options, quiet=True)  # all has been told
    for name, study in sweeps.items():
        run_study(study, folder, name, options)


def _fill(
    sweeps: Mapping[str, Study],
    ledgers: Mapping[str, Ledger],
    options: RunnerOptions,
    title: str,
    stack: ExitStack,
) -> None:
    homes: dict[str, list[Ledger]] = {}  # two sweeps may have a task in common
    tasks: dict[str, Task] = {}
    notes = []
    for name, study in sweeps.items():
        survey = ledgers[name].survey(tasks_of(study), keep_versions=options.keep_versions)
        for task in compress(tasks_of(study), survey.todo):
            tasks[task.digest] = task
            homes.setdefault(task.digest, []).append(ledgers[name])
        notes += [f"{name}: {line}" for line in survey.words(keep_versions=options.keep_versions)]
    if not tasks and not notes:
        return
    count = Count(len(tasks))
    tell = stack.enter_context(sweep_progress(title, count, quiet=options.quiet))
    for note in notes:
        tell.say(note)

    def keep(task: Task, outcome: performing.Outcome) -> None:
        for ledger in homes[task.digest]:
            ledger.keep(task, outcome)

    def pool() -> LocalPool:
        return LocalPool(min(options.workers, len(tasks)))

    for _ in worked_off(tasks.values(), pool, count, options.stop, keep):
        tell(count)


def references_of(
    maps: Sequence[StudyMap], folder: Path, plan: Plan, options: RunnerOptions
) -> dict[str, Reference]:
    """Return the centralised reference of every map by its name, searched for where it is not there yet.

    Raises Interrupted after Ctrl-C, and OutputError as `find_references`.
    """
    at, workers, quiet = folder / "references", options.workers, options.quiet
    found = find_references(maps, at, plan, workers=workers, quiet=quiet, stop=options.stop)
    if options.stop.requested:
        raise Interrupted
    return found


def forecast(folder: Path, plan: Plan, workers: int, *, claims: bool, beyond: bool) -> Forecast:
    """Return how many runs there are, and how long those that are left will take, by probes.

    `claims` and `beyond`: whether the paper's claims are tested, and what goes beyond it is done. The time
    for references, for timing steps and for the pages is not in it.
    """
    sweeps = studies.figure_studies(plan)
    papers = expected_contenders(plan) if claims or (beyond and grid_is_done(folder, plan)) else UNTUNED
    if claims:
        sweeps["gains"] = studies.gains_study(plan)
        sweeps["convex"] = studies.convex_contest(plan, papers).study
    if claims or beyond:
        sweeps["claims"] = studies.claims_contest(plan, papers).study
    if beyond:
        if (tuning := studies.baseline_gains_study(plan)) is not None:
            sweeps[studies.BASELINE_GAINS] = tuning
        sweeps |= {name: each.study for name, each in studies.beyond_contests(plan, {}, papers).items()}
        sweeps |= studies.conditions_studies(plan)
    runs = sum(map(len, sweeps.values()))
    # which gains will be the best is not known yet, and how many runs these are does not depend on it
    left = {name: len(study) - min(runs_there(folder, name), len(study)) for name, study in sweeps.items()}
    if not any(left.values()):
        return Forecast(runs, 0, 0.0, {})
    each: dict[str, float] = {}
    for probe in studies.probes(plan, beyond=beyond):
        for task in tasks_of(probe):
            if not each:
                performing.perform(task)  # what is loaded and built at first does not count
            begin = time.perf_counter()
            performing.perform(task)
            each[task.controller] = (time.perf_counter() - begin) / probe.duration
    work = 0.0
    for name, study in sweeps.items():
        mean = np.mean([each[law] for law in study.controllers for _ in study.gains_of(law).choices])
        work += left[name] * float(mean) * study.duration
    seconds = {law: value * plan.duration for law, value in each.items()}
    return Forecast(runs, sum(left.values()), work / workers, seconds)


def expected_contenders(plan: Plan) -> tuple[Contender, ...]:
    """Return the paper's contenders with any gains for the best, distinct where that can be."""
    guesses = (
        (*UNTUNED, *(of_paper(f"{law}-best", grid[k]) for law, grid in studies.gain_sets(plan).items()))
        for k in (0, -1)
    )
    return max(guesses, key=lambda laws: sum(map(len, distinct_gains(laws).values())))


def grid_is_done(folder: Path, plan: Plan) -> bool:
    """Return whether all runs of the paper's grids of gains are there."""
    tuning = studies.gains_study(plan)
    return runs_there(folder, "gains", tuning) == len(tuning)


def runs_there(folder: Path, name: str, study: Study | None = None) -> int:
    """Return how many runs are there under the name of a sweep, whether its table is written or not.

    Of a `study` that is given only its own: runs of a former one, of an older version say, may lie beside.
    """
    there = {each.name for each in (folder / "studies" / name / "runs").glob("[!.]*")}
    return len(there if study is None else there.intersection(task.name for task in tasks_of(study)))
