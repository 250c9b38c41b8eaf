"""Everything that came of the runs, and doing them in an order in which each part has what it needs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

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
from robocov_app.replication.contenders import (
    OURS,
    OWN,
    RAPF_SHARED,
    Contender,
    paper_contenders,
)
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
    BASELINE_GAINS,
    Interrupted,
    RunnerOptions,
    grid_is_done,
    references_of,
    run_study,
    run_together,
)
from robocov_app.replication.step_times import UNKNOWN, StepTimes, step_times
from robocov_app.sweep.performing import simulated
from robocov_app.sweep.study import Study, parameter_column, tasks_of

WORST = 4
"""So many of RAPF's worst runs are shown."""

ENOUGH_MAPS = 5
"""Maps from which intervals draw whole maps; of fewer, runs one by one: they are then of these maps alone."""


@dataclass(frozen=True, eq=False)
class FigureRun:
    """A run that a figure shows."""

    record: Record
    history: CostHistory


@dataclass(frozen=True, eq=False)
class PaperResults:
    """What the runs of the paper's claims gave.

    Attributes
    ----------
    figures : dict of "case/controller" to FigureRun
    gains : dict of controller to GainOutcomes
    convex, claims : Outcomes
        In convex regions and on non-convex maps.
    contenders : tuple of Contender
    references : dict of map to Reference
    worst : sequence of (Scenario, Record)
        RAPF's worst runs with the shared gains, done again to be shown, on different maps.
    runs, failed : int
        All that there are, and those among them that failed.
    """

    plan: Plan
    figures: Mapping[str, FigureRun]
    gains: Mapping[str, GainOutcomes]
    convex: Outcomes
    claims: Outcomes
    contenders: tuple[Contender, ...]
    references: Mapping[str, Reference]
    worst: Sequence[tuple[Scenario, Record]]
    runs: int
    failed: int


@dataclass(frozen=True, eq=False)
class DensityResults:
    """What became of knowing the density.

    `outcomes` has contenders ``known`` and ``ignored``; ``final`` is the mean distance by φ, m, for both.
    `pictures` are one run that knew it and one that did not, from the same places, `costs` their final ones.
    """

    outcomes: Outcomes
    pictures: tuple[FigureRun, FigureRun]
    costs: tuple[float, float]


@dataclass(frozen=True)
class Degradation:
    """The final cost of a controller at one value of a disturbance, by that of the same run without any.

    `runs` are the pairs of runs that the median `ratio` rests on; those without a ratio are left out.
    """

    axis: str
    value: float | None
    controller: str
    label: str
    ratio: Interval
    runs: int


@dataclass(frozen=True, eq=False)
class BeyondResults:
    """What the runs beyond the paper gave.

    Attributes
    ----------
    outcomes : Outcomes
        Of all contenders: those of the claims, the baselines, and ours.
    unseen : Outcomes or None
        Of the first of ours and the strongest of the paper's, on maps that played no part in its development.
    contenders : tuple of Contender
    gains : dict of controller to GainOutcomes
        Of the baselines whose gains were tuned here.
    steps : dict of number of robots to StepTimes
    worst : sequence of (Scenario, Record)
        The worst runs of the first of ours, done again to be shown.
    targets, teams : Outcomes
        Of `TARGETS`, and of `TEAMS`, where ``final`` is the mean time, s.
    runs, failed : int
        All that were done for this part alone, and those among them that failed.
    """

    plan: Plan
    outcomes: Outcomes
    unseen: Outcomes | None
    contenders: tuple[Contender, ...]
    gains: Mapping[str, GainOutcomes]
    steps: Mapping[int, StepTimes]
    worst: Sequence[tuple[Scenario, Record]]
    targets: Outcomes
    density: DensityResults
    teams: Outcomes
    degradations: Sequence[Degradation]
    runs: int
    failed: int


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
        results = read_results(target)
        for row in results.to_table().to_pylist():
            if row["error"] is not None:
                raise InputError(f"{target}: a run that a figure shows failed: {row['error']}")
            case = "other" if row["start"] == "other" else name.removeprefix("figures-")
            run = FigureRun(results.record(row["run"]), results.history(row["run"]))
            found[f"{case}/{row['controller']}"] = run
    return found


def run_paper(folder: Path, plan: Plan, options: RunnerOptions) -> PaperResults:
    """Do all runs of the paper's claims that are not done yet, and read what came of them.

    Raises as `run_study`.
    """
    figures = run_figures(folder, plan, options)
    gains, known = _run_grid(studies.gains_study(plan), "gains", folder, plan, options)
    papers = paper_contenders(best_gains(gains))
    convex, claims = studies.convex_contest(plan, papers), studies.claims_contest(plan, papers)
    known |= references_of((*convex.study.maps, *claims.study.maps), folder, plan, options)
    in_convex = read_outcomes(run_study(convex.study, folder, "convex", options), convex, known)
    outcomes = read_outcomes(run_study(claims.study, folder, "claims", options), claims, known)
    runs, failed = _counts(folder, (*studies.figure_studies(plan), "gains", "convex", "claims"))
    return PaperResults(
        plan=plan,
        figures=figures,
        gains=gains,
        convex=in_convex,
        claims=outcomes,
        contenders=papers,
        references=known,
        worst=worst_runs(claims.study, outcomes, RAPF_SHARED, WORST),
        runs=runs,
        failed=failed,
    )


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
    best = best_gains(gains)
    contests, small = studies.baseline_contests(plan, best), studies.small_contests(plan)
    unseen = studies.unseen_contest(plan, papers)
    known |= references_of((*studies.small_maps(plan), *studies.unseen_maps(plan)), folder, plan, options)
    sweeps = studies.beyond_studies(plan, best, papers)
    run_together(sweeps, folder, options, "paper: beyond")
    at = folder / "studies"
    parts = [among_baselines(claims, plan)]
    parts += [read_outcomes(at / name, each, known) for name, each in contests.items()]
    outcomes = joined(parts)
    steps = time_steps(folder, plan, options)
    runs, failed = _counts(folder, (*[BASELINE_GAINS] * bool(gains), *sweeps))
    return BeyondResults(
        plan=plan,
        outcomes=outcomes,
        unseen=None if unseen is None else read_outcomes(at / "unseen", unseen, known),
        contenders=(*papers, *(law for each in contests.values() for law in each.contenders)),
        gains=gains,
        steps=steps,
        worst=worst_runs(contests[f"ours-{OURS[0]}"].study, outcomes, OWN[0], plan.beyond.worst),
        targets=read_outcomes(at / "targets", small["targets"], known),
        density=_density(at, plan, small),
        teams=read_outcomes(
            at / "teams", small["teams"], {}, {"final": "mean_time_s", "distance": "mean_distance_m"}
        ),
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
                pairs = [key for key in usual if key in got]
                names = [name for name, _ in pairs]
                clusters = names if len(set(names)) >= ENOUGH_MAPS else None
                ratios = [got[key] / usual[key] for key in pairs]
                ratio = bootstrap(ratios, clusters=clusters) if pairs else UNKNOWN
                label = str(controller_kind(controller).label)
                found.append(Degradation(axis, value, controller, label, ratio, len(pairs)))
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


def _density(at: Path, plan: Plan, contests: Mapping[str, studies.Contest]) -> DensityResults:
    """Read the runs that knew the density and those that did not; by φ all of them are judged."""
    costs = {each.name: CoverageCost(each.environment, plan.lattice) for each in studies.density_maps(plan)}
    values = {}
    for key, name in (("known", "density"), ("ignored", "density-ignored")):
        outcomes = read_outcomes(at / name, contests[name], {})
        (places,) = outcomes.placements.values()
        values[key, "final"] = np.array(
            [
                costs[map_](place).mean_distance if np.isfinite(place).all() else np.nan
                for map_, place in zip(outcomes.maps, places, strict=True)
            ]
        )
    shown = []
    for name in ("density-picture", "density-picture-ignored"):
        results = read_results(at / name)
        (row,) = results.to_table().to_pylist()
        shown.append(FigureRun(results.record(row["run"]), results.history(row["run"])))
    known, ignored = shown
    judge = CoverageCost(known.record.environment, plan.lattice)
    first, second = (float(judge(each.record.positions[-1]).mean_distance) for each in shown)
    return DensityResults(Outcomes(outcomes.scenarios, values), (known, ignored), (first, second))


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
