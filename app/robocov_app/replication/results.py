"""Everything that came of the runs, and doing them in an order in which each part has what it needs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import robocov
from robocov.controllers import CONTROLLERS, controller_kind
from robocov.cost import CoverageCost
from robocov.errors import InputError, RobocovError, counted
from robocov.metrics import CostHistory
from robocov.metrics.results import read_results
from robocov.record import Record
from robocov_app.figures.statistics import Interval, bootstrap
from robocov_app.replication import studies
from robocov_app.replication.contenders import OURS, OWN, RAPF_SHARED, Contender, paper_contenders
from robocov_app.replication.outcomes import (
    GainOutcomes,
    Outcomes,
    Scenario,
    best_gains,
    joined,
    read_gain_outcomes,
    read_outcomes,
)
from robocov_app.replication.plan import PARTITION_SEED, ROBOTS, Plan
from robocov_app.replication.references import Reference
from robocov_app.replication.running import (
    Interrupted,
    RunnerOptions,
    grid_is_done,
    references_of,
    run_study,
    run_together,
)
from robocov_app.replication.step_times import UNKNOWN, StepTimes, step_times
from robocov_app.replication.studies import BASELINE_GAINS
from robocov_app.sweep.performing import simulated
from robocov_app.sweep.study import Study, parameter_column, tasks_of

WORST = 4  # so many of RAPF's worst runs are shown

# maps from which intervals draw whole maps; of fewer, runs one by one: they are then of these maps alone
ENOUGH_MAPS = 5


@dataclass(frozen=True, eq=False)
class FigureRun:
    """A run that a figure shows."""

    record: Record
    history: CostHistory


@dataclass(frozen=True, eq=False)
class PaperResults:
    """What the runs of the paper's claims gave."""

    plan: Plan
    figures: Mapping[str, FigureRun]  # by "case/controller"
    gains: Mapping[str, GainOutcomes]  # by controller
    convex: Outcomes  # in convex regions
    claims: Outcomes  # on non-convex maps
    contenders: tuple[Contender, ...]
    references: Mapping[str, Reference]  # by map
    worst: Sequence[
        tuple[Scenario, Record]
    ]  # RAPF's worst runs with the shared gains, done again to be shown
    runs: int
    failed: int  # among these


@dataclass(frozen=True, eq=False)
class DensityResults:
    """What became of knowing the density."""

    outcomes: (
        Outcomes  # contenders ``known`` and ``ignored``; ``final`` is the mean distance by φ, m, for both
    )
    pictures: tuple[FigureRun, FigureRun]  # one run that knew it, one that did not, from the same places
    costs: tuple[float, float]  # their final ones


@dataclass(frozen=True)
class Degradation:
    """The final cost of a controller at one value of a disturbance, by that of the same run without any."""

    axis: str
    value: float | None
    controller: str
    label: str
    ratio: Interval
    runs: int  # pairs of runs that the median ratio rests on; those without a ratio are left out


@dataclass(frozen=True, eq=False)
class BeyondResults:
    """What the runs beyond the paper gave."""

    plan: Plan
    outcomes: Outcomes  # of all contenders: those of the claims, the baselines, and ours
    unseen: (
        Outcomes | None
    )  # of the first of ours and the strongest of the paper's, on maps that nobody looked at
    contenders: tuple[Contender, ...]
    gains: Mapping[str, GainOutcomes]  # of the baselines whose gains were tuned here
    steps: Mapping[int, StepTimes]  # by number of robots
    worst: Sequence[tuple[Scenario, Record]]  # runs of the first of ours, done again to be shown
    targets: Outcomes  # of `TARGETS`
    density: DensityResults
    teams: Outcomes  # of `TEAMS`
    degradations: Sequence[Degradation]
    runs: int  # all that were done for this part alone
    failed: int  # among these


def partition_record() -> Record:
    """Return the run of which the first moment is figure 1: robots anywhere in the pentagon."""
    environment = robocov.load_map("pentagon")
    starts = environment.start("uniform").sample(ROBOTS, seed=PARTITION_SEED)
    return robocov.Simulation(environment, robocov.Lloyd(), starts).run(0.1)


def run_figures(folder: Path, plan: Plan, options: RunnerOptions) -> dict[str, FigureRun]:
    """Do the runs that the figures show; raise as `run_study`, and InputError when one of them failed."""
    found: dict[str, FigureRun] = {}
    for name, study in studies.figure_studies(plan).items():
        target = run_study(study, folder, name, options)
        for row, run in _figure_runs(target):
            case = "other" if row["start"] == "other" else name.removeprefix("figures-")
            found[f"{case}/{row['controller']}"] = run
    return found


def _figure_runs(folder: Path) -> Iterator[tuple[dict[str, Any], FigureRun]]:
    """Yield the rows of a sweep, each with its run; raise InputError when one failed."""
    results = read_results(folder)
    for row in results.to_table().to_pylist():
        if row["error"] is not None:
            raise InputError(f"{folder}: a run that a figure shows failed: {row['error']}")
        yield row, FigureRun(results.record(row["run"]), results.history(row["run"]))


def run_paper(folder: Path, plan: Plan, options: RunnerOptions) -> PaperResults:
    """Do all runs of the paper's claims that are not done yet, and read what came of them.

    Raises as `run_study`.
    """
    figures = run_figures(folder, plan, options)
    gains, known = _run_grid(studies.gains_study(plan), "gains", folder, plan, options)
    papers = paper_contenders(best_gains(gains))
    contests = {
        "convex": studies.convex_contest(plan, papers),
        "claims": studies.claims_contest(plan, papers),
    }
    known |= references_of(
        [each for of in contests.values() for each in of.study.maps], folder, plan, options
    )
    outcomes = {
        name: read_outcomes(run_study(each.study, folder, name, options), each, known)
        for name, each in contests.items()
    }
    runs, failed = _counts(folder, (*studies.figure_studies(plan), "gains", *contests))
    worst = worst_runs(contests["claims"].study, outcomes["claims"], RAPF_SHARED, WORST)
    both = outcomes["convex"], outcomes["claims"]
    return PaperResults(plan, figures, gains, *both, papers, known, worst, runs, failed)


def run_beyond(folder: Path, plan: Plan, options: RunnerOptions, paper: PaperResults | None) -> BeyondResults:
    """Do all runs beyond the paper that are not done yet, and read what came of them.

    Without the paper's own part the paper's controllers are run here, with their best gains if the grids of
    gains have been run before. Raises as `run_study`.
    """
    known: dict[str, Reference] = {}
    if paper is not None:
        known |= paper.references
        papers, claims = paper.contenders, paper.claims
    else:
        grids: Mapping[str, GainOutcomes] = {}
        if grid_is_done(folder, plan):
            # nothing is left to be done of it: the table is made sure of
            grids, known = _run_grid(studies.gains_study(plan), "gains", folder, plan, options)
        papers = paper_contenders(best_gains(grids))
        contest = studies.claims_contest(plan, papers)
        known |= references_of(contest.study.maps, folder, plan, options)
        claims = read_outcomes(run_study(contest.study, folder, "claims", options), contest, known)
    gains: dict[str, GainOutcomes] = {}
    if (tuning := studies.baseline_gains_study(plan)) is not None:
        gains, _ = _run_grid(tuning, BASELINE_GAINS, folder, plan, options)
    contests = studies.beyond_contests(plan, best_gains(gains), papers)
    on = *studies.generated_maps(plan.beyond.maps), *studies.generated_maps(plan.beyond.unseen)
    known |= references_of(on, folder, plan, options)
    sweeps = {name: each.study for name, each in contests.items()} | studies.conditions_studies(plan)
    run_together(sweeps, folder, options, "paper: beyond")
    at = folder / "studies"
    reached = {name: read_outcomes(at / name, each, known) for name, each in contests.items()}
    sides = [name for name in contests if name == "rivals" or name.startswith("ours-")]
    outcomes = joined([among_baselines(claims, plan), *(reached[name] for name in sides)])
    steps = time_steps(folder, plan, options)
    runs, failed = _counts(folder, (*[BASELINE_GAINS] * bool(gains), *sweeps))
    return BeyondResults(
        plan=plan,
        outcomes=outcomes,
        unseen=reached.get("unseen"),
        contenders=(*papers, *(law for name in sides for law in contests[name].contenders)),
        gains=gains,
        steps=steps,
        worst=worst_runs(contests[f"ours-{OURS[0]}"].study, outcomes, OWN[0], plan.beyond.worst),
        targets=reached["targets"],
        density=_density(at, plan, reached["density"], reached["density-ignored"]),
        teams=reached["teams"],
        degradations=read_degradations(at, plan),
        runs=runs,
        failed=failed,
    )


def among_baselines(outcomes: Outcomes, plan: Plan) -> Outcomes:
    """Return what was reached on the maps and from the kinds of starts that baselines have as well."""
    names = {each.name for each in studies.baseline_maps(plan)}
    return outcomes.where(
        [each.map in names and each.start in plan.beyond.starts for each in outcomes.scenarios]
    )


def time_steps(folder: Path, plan: Plan, options: RunnerOptions) -> dict[int, StepTimes]:
    """Return how long the steps of every registered controller take beside RAPF's.

    Raises Interrupted after Ctrl-C, and OutputError when they cannot be kept.
    """
    everybody = tuple(CONTROLLERS)
    wanted = {ROBOTS: everybody, plan.beyond.large: everybody, plan.beyond.huge: OURS[:1]}
    found = step_times(folder, wanted, plan, stopped=lambda: options.stop.requested)
    if options.stop.requested:
        raise Interrupted
    return found


def worst_runs(
    study: Study, outcomes: Outcomes, contender: Contender, count: int
) -> list[tuple[Scenario, Record]]:
    """Return a contender's runs farthest above the reference, one a map, done again to be shown."""
    there = outcomes.measured("gap", contender.key)
    wanted: dict[str, Scenario] = {}
    for k in np.argsort(-there.of(contender.key, "gap"), kind="stable").tolist():
        if len(wanted) < count:
            wanted.setdefault(there.scenarios[k].map, there.scenarios[k])
    environments = {each.name: each.environment for each in study.maps}
    records = {}
    for task in tasks_of(study):
        scenario = Scenario(task.map, task.start, task.seed)
        own = task.controller == contender.controller and dict(task.gains) == contender.all_gains
        if own and scenario in wanted.values():
            records[scenario] = simulated(task, environments[task.map]).thinned(10.0)
    return [(scenario, records[scenario]) for scenario in wanted.values()]


def read_degradations(at: Path, plan: Plan) -> list[Degradation]:
    """Compare runs under each disturbance with those without any, by axis, value and controller."""
    ideal = _finals(at / "conditions-ideal")
    found = []
    for axis, (best, *bad) in studies.axes_of_disturbances(plan).items():
        disturbed = _finals(at / f"conditions-{axis.replace('_', '-')}", parameter_column(axis), bad[0])
        for value in (best, *bad):
            for controller in studies.DISTURBED:
                usual = ideal.get((controller, None), {})
                if not usual:
                    runs = counted(plan.beyond.conditions_seeds, "run")
                    raise RobocovError(f"{controller}: all {runs} on each map failed")
                got = usual if value == best else disturbed.get((controller, value), {})
                ratios = {key: got[key] / usual[key] for key in usual if key in got}
                names = [name for name, _ in ratios]
                clusters = names if len(set(names)) >= ENOUGH_MAPS else None
                ratio = bootstrap([*ratios.values()], clusters=clusters) if ratios else UNKNOWN
                label = str(controller_kind(controller).label)
                found.append(Degradation(axis, value, controller, label, ratio, len(ratios)))
    return found


def _finals(
    folder: Path, column: str = "", only: float | None = None
) -> dict[tuple[str, float | None], dict[tuple[str, int], float]]:
    """Return the final costs by map and seed, for each controller and value of a column.

    A table has no column of what has one value: that is the `only` one.
    """
    found: dict[tuple[str, float | None], dict[tuple[str, int], float]] = {}
    for row in read_results(folder).to_table().to_pylist():
        if row["mean_distance_m"] is not None:
            group = found.setdefault((row["controller"], row.get(column, only)), {})
            group[row["map"], row["seed"]] = float(row["mean_distance_m"])
    return found


def _density(at: Path, plan: Plan, *reached: Outcomes) -> DensityResults:
    """Judge by φ the runs that knew the density, and those that did not."""
    costs = {each.name: CoverageCost(each.environment, plan.lattice) for each in studies.density_maps(plan)}
    values = {}
    for key, outcomes in zip(("known", "ignored"), reached, strict=True):
        (places,) = outcomes.placements.values()
        finals = [
            costs[name](place).mean_distance if np.isfinite(place).all() else np.nan
            for name, place in zip(outcomes.maps, places, strict=True)
        ]
        values[key, "final"] = np.array(finals)
    ((_, known),) = _figure_runs(at / "density-picture")
    ((_, ignored),) = _figure_runs(at / "density-picture-ignored")
    judge = CoverageCost(known.record.environment, plan.lattice)
    first, second = (float(judge(each.record.positions[-1]).mean_distance) for each in (known, ignored))
    return DensityResults(Outcomes(reached[0].scenarios, values), (known, ignored), (first, second))


def _run_grid(
    study: Study, name: str, folder: Path, plan: Plan, options: RunnerOptions
) -> tuple[dict[str, GainOutcomes], dict[str, Reference]]:
    """Do the runs of grids of gains, and return what each controller reached with every set."""
    known = references_of(study.maps, folder, plan, options)
    return read_gain_outcomes(run_study(study, folder, name, options), study, known), known


def _counts(folder: Path, names: Iterable[str]) -> tuple[int, int]:
    """Return how many runs the folders of sweeps have, and how many of them failed."""
    found = [read_results(folder / "studies" / name) for name in names]
    return sum(map(len, found)), sum(len(each.failures()) for each in found)
