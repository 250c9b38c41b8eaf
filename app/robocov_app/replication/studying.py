"""Doing all the runs of the paper, in an order in which each part has what it needs; see `plan`."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov.errors import InputError, OutputError
from robocov.files.atomic import written
from robocov.metrics.results import read_results
from robocov_app.replication import plan as planned
from robocov_app.replication.contenders import RAPF_SHARED, Contender, best
from robocov_app.replication.figures import Shown
from robocov_app.replication.outcomes import GainOutcomes, Outcomes, Scenario
from robocov_app.replication.plan import ROBOTS, Plan
from robocov_app.replication.reading import read_gain_outcomes, read_outcomes
from robocov_app.replication.references import Reference, references
from robocov_app.sweep.sweeping import sweep

if TYPE_CHECKING:
    from robocov.record import Record
    from robocov_app.sweep.study import Study, StudyMap
    from robocov_app.terminal.interruption import Interruption

MARK = "paper.json"
"""Says that a folder is that of a study of the paper, and which."""

_HEAD = {"format": "robocov-paper", "version": 1}


class Stopped(Exception):  # noqa: N818 - it is no error
    """Somebody has pressed Ctrl-C."""


@dataclass(frozen=True)
class Means:
    """With what the runs are done.

    Attributes
    ----------
    workers : int
        Processes on this machine.
    scheduler : str or None
        Address of a Dask scheduler that does the runs instead.
    quiet : bool
        Tell nothing.
    stop : Interruption
    keep_versions : bool
        Use runs that other versions of robocov, or of what it computes with, have done.
    """

    workers: int
    scheduler: str | None
    quiet: bool
    stop: Interruption
    keep_versions: bool = False


@dataclass(frozen=True, eq=False)
class Material:
    """All that the runs gave.

    Attributes
    ----------
    plan : Plan
    figures : dict of name to Shown
        See `robocov_app.replication.figures.draw_figure`.
    gains : dict of controller to GainOutcomes
    convex, claims : Outcomes
    best : dict of controller to Contender
    references : dict of map to Reference
    worst : sequence of (Scenario, Record)
        RAPF's worst runs with the shared gains, done again to be shown, on different maps.
    runs, failed : int
        All that there are, and those among them that failed.
    """

    plan: Plan
    figures: Mapping[str, Shown]
    gains: Mapping[str, GainOutcomes]
    convex: Outcomes
    claims: Outcomes
    best: Mapping[str, Contender]
    references: Mapping[str, Reference]
    worst: Sequence[tuple[Scenario, Record]]
    runs: int
    failed: int


def begun(folder: Path, plan: Plan) -> None:
    """Make the folder of a study, or make sure that it is that of the same study.

    Raises
    ------
    InputError
        When it holds something else, or the other one of the quick and the full study.
    OutputError
        When it cannot be made or written to.
    """
    mark = folder / MARK
    try:
        folder.mkdir(parents=True, exist_ok=True)
        used = any(folder.iterdir())
    except OSError as error:
        raise OutputError(f"{folder}: cannot be used for results: {error.strerror or error}") from error
    if used:
        try:
            content = json.loads(mark.read_bytes())
            named = content["plan"] if content["format"] == _HEAD["format"] else None
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            named = None
        if named is None:
            raise InputError(
                f"{folder}: the folder is not empty, and what is in it is no study of the paper; "
                f"another --out was wanted"
            )
        if named != plan.name:
            raise InputError(
                f"{folder}: holds the {named} study, but the {plan.name} one was asked for; "
                f"another --out was wanted"
            )
        return
    with written(mark) as part:
        part.write_text(json.dumps({**_HEAD, "plan": plan.name}) + "\n", encoding="utf-8")


def first_record() -> Record:
    """Return the run of which the first moment is figure 1: robots anywhere in the pentagon."""
    import robocov

    environment = robocov.load_map("pentagon")
    starts = environment.start("uniform").sample(ROBOTS, seed=planned.PARTITION_SEED)
    return robocov.Simulation(environment, robocov.Lloyd(), starts).run(0.1)


def studied_figures(folder: Path, plan: Plan, means: Means) -> dict[str, Shown]:
    """Do the runs that the figures show.

    Raises
    ------
    Stopped
        After Ctrl-C.
    InputError, OutputError
        As `robocov_app.sweep.sweeping.sweep`; also when one of these runs failed.
    """
    shown: dict[str, Shown] = {}
    for name, study in planned.figure_studies(plan).items():
        swept(study, folder, name, means)
        results = read_results(folder / "studies" / name)
        for row in results.to_table().to_pylist():
            if row["error"] is not None:
                raise InputError(
                    f"{folder / 'studies' / name}: a run that a figure shows failed: {row['error']}"
                )
            case = "other" if row["start"] == "other" else name.removeprefix("figures-")
            shown[f"{case}/{row['controller']}"] = Shown(
                results.record(row["run"]), results.history(row["run"])
            )
    return shown


def studied(folder: Path, plan: Plan, means: Means) -> Material:
    """Do all runs that are not done yet, and read what came of them.

    Raises
    ------
    Stopped
        After Ctrl-C.
    InputError, OutputError
        As `robocov_app.sweep.sweeping.sweep`.
    """
    figures = studied_figures(folder, plan, means)

    tuning = planned.gains_study(plan)
    known = referenced(tuning.maps, folder, plan, means)
    swept(tuning, folder, "gains", means)
    gains = read_gain_outcomes(folder / "studies" / "gains", tuning, known)
    chosen = {law: best(law, grid.gains[grid.best()]) for law, grid in gains.items()}

    convex = planned.convex_study(plan, chosen)
    claims = planned.claims_study(plan, chosen)
    known |= referenced((*convex.maps, *claims.maps), folder, plan, means)
    swept(convex, folder, "convex", means)
    swept(claims, folder, "claims", means)
    found = read_outcomes(folder / "studies" / "claims", claims, planned.claim_contenders(chosen), known)
    studies = [*planned.figure_studies(plan), "gains", "convex", "claims"]
    counts = [counted_runs(folder / "studies" / name) for name in studies]
    return Material(
        plan=plan,
        figures=figures,
        gains=gains,
        convex=read_outcomes(folder / "studies" / "convex", convex, planned.convex_contenders(chosen), known),
        claims=found,
        best=chosen,
        references=known,
        worst=worst_runs(claims, found),
        runs=sum(runs for runs, _ in counts),
        failed=sum(failed for _, failed in counts),
    )


WORST = 4
"""So many of RAPF's worst runs are shown."""


def worst_runs(
    study: Study, outcomes: Outcomes, law: Contender = RAPF_SHARED, count: int = WORST
) -> list[tuple[Scenario, Record]]:
    """Return a law's runs farthest above the reference, the worst of each map, done again to be shown."""
    import numpy as np

    from robocov_app.sweep.performing import simulated
    from robocov_app.sweep.study import tasks_of

    gap = outcomes.of(law.key, "gap")
    order = [k for k in np.argsort(-gap, kind="stable").tolist() if np.isfinite(gap[k])]
    wanted: dict[str, Scenario] = {}
    for k in order:
        scenario = outcomes.scenarios[k]
        if len(wanted) < count:
            wanted.setdefault(scenario.map, scenario)
    environments = {each.name: each.environment for each in study.maps}
    gains = planned.complete_gains(law)
    records = {}
    for task in tasks_of(study):
        scenario = Scenario(task.map, task.start, task.seed)
        if scenario in wanted.values() and task.controller == law.controller and dict(task.gains) == gains:
            records[scenario] = simulated(task, environments[task.map]).thinned(10.0)
    return [(scenario, records[scenario]) for scenario in wanted.values()]


@dataclass(frozen=True)
class Forecast:
    """What a study is going to take.

    Attributes
    ----------
    runs : int
        All runs of it.
    left : int
        Those that are not there yet.
    seconds : float
        For these, on all workers.
    each : dict of controller to float, s
        What one run took.
    """

    runs: int
    left: int
    seconds: float
    each: Mapping[str, float]


def forecast(folder: Path, plan: Plan, workers: int, *, figures_only: bool = False) -> Forecast:
    """Return how many runs there are and how long they will take, by doing one of each law now.

    Which gains are best is not known yet: it is taken that none of them are the shared ones.
    """
    from robocov_app.sweep.performing import perform
    from robocov_app.sweep.study import tasks_of

    studies = planned.figure_studies(plan)
    counts: dict[str, int] = {"rapf": 0, "rpf": 0, "lloyd": 0}
    laws = [(_scenarios(study), list(study.controllers)) for study in studies.values()]
    grids = planned.gain_sets(plan)
    if not figures_only:
        rapf, rpf = len(grids["rapf"]), len(grids["rpf"])
        tuned = len(plan.tuning) * len(plan.tuning_starts)
        laws.append((tuned, ["rapf"] * rapf + ["rpf"] * rpf))
        convex = (2 + len(plan.convex_generated)) * 4 * len(plan.convex_seeds)
        laws.append((convex, ["rapf"] * 3 + ["lloyd"]))
        claims = (len(plan.bundled) + len(plan.generated)) * 3 * len(plan.seeds)
        laws.append((claims, ["rapf"] * 3 + ["rpf"] * 2 + ["lloyd"]))
    for scenarios, names in laws:
        for name in names:
            counts[name] += scenarios
    runs = sum(counts.values())
    names = list(studies) if figures_only else [*studies, "gains", "convex", "claims"]
    there = sum(runs_there(folder, name) for name in names)
    if runs <= there:
        return Forecast(runs, 0, 0.0, {})
    each: dict[str, float] = {}
    for task in tasks_of(planned.probe_study(plan)):
        perform(task)  # what is loaded and built at first does not count
        begin = time.perf_counter()
        perform(task)
        each[task.controller] = time.perf_counter() - begin
    work = sum(counts[name] * each[name] for name in counts)
    return Forecast(runs, runs - there, work * (runs - there) / runs / workers, each)


def together(parts: Sequence[Forecast]) -> Forecast:
    """Return what several parts of a study are going to take, one after the other."""
    each = {law: seconds for part in reversed(parts) for law, seconds in part.each.items()}
    return Forecast(
        sum(part.runs for part in parts),
        sum(part.left for part in parts),
        sum(part.seconds for part in parts),
        each,
    )


def runs_there(folder: Path, name: str, study: Study | None = None) -> int:
    """Return how many runs are there under the name of a study, whether its table is written or not.

    Of a study that is given only its own: runs of a former one, of an older version say, may lie beside.
    """
    from robocov_app.sweep.study import tasks_of

    there = {each.name for each in (folder / "studies" / name / "runs").glob("[!.]*")}
    return len(there if study is None else there.intersection(task.name for task in tasks_of(study)))


def _scenarios(study: Study) -> int:
    return sum(len(study.starts_on(each)) for each in study.maps) * len(study.seeds)


def swept(study: Study, folder: Path, name: str, means: Means) -> None:
    """Do the runs of a study that are not done yet, in ``studies/`` under this name.

    Raises
    ------
    Stopped
        After Ctrl-C.
    InputError, OutputError
        As `robocov_app.sweep.sweeping.sweep`.
    """
    target = folder / "studies" / name
    try:
        target.parent.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{target}: cannot be used for results: {error.strerror or error}") from error
    totals = sweep(
        study,
        target,
        workers=means.workers,
        scheduler=means.scheduler,
        keep_versions=means.keep_versions,
        quiet=means.quiet,
        title=f"paper: {name}",
        stop=means.stop,
    )
    if totals.interrupted or means.stop.requested:
        raise Stopped


def referenced(maps: Sequence[StudyMap], folder: Path, plan: Plan, means: Means) -> dict[str, Reference]:
    """Return the centralised reference of every map by its name, searched for where it is not there yet.

    Raises
    ------
    Stopped
        After Ctrl-C.
    OutputError
        As `robocov_app.replication.references.references`.
    """
    found = references(
        maps,
        folder / "references",
        robots=ROBOTS,
        radius=float(plan.team["radius"]),
        lattice=plan.lattice,
        restarts=plan.restarts,
        workers=means.workers,
        quiet=means.quiet,
        stop=means.stop,
    )
    if means.stop.requested:
        raise Stopped
    return found


def counted_runs(folder: Path) -> tuple[int, int]:
    """Return how many runs the folder of a sweep has, and how many of them failed."""
    results = read_results(folder)
    failures: Any = results.failures()
    return len(results), len(failures)
