"""Doing the runs of the study, resumably, in an order in which each has what it needs; what came of them."""

import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from itertools import compress, product
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

import robocov
from robocov.controllers import CONTROLLERS, load_controller_class
from robocov.cost import CoverageCost
from robocov.errors import InputError
from robocov.files.result_folder import report_folder_errors
from robocov.files.writing import replace_file
from robocov.metrics import CostHistory
from robocov.metrics.results import read_results
from robocov.record import Record
from robocov_app.figures.statistics import MIN_BOOTSTRAP_MAPS, Interval, bootstrap
from robocov_app.replication import contenders as laws
from robocov_app.replication import outcomes as reached
from robocov_app.replication import studies
from robocov_app.replication.contenders import OURS, OWN, RAPF_SHARED, UNTUNED, Contender, paper_contenders
from robocov_app.replication.outcomes import GainOutcomes, Outcomes, Scenario, best_gains, read_outcomes
from robocov_app.replication.plan import PARTITION_SEED, ROBOTS, Plan
from robocov_app.replication.references import References, find_references
from robocov_app.replication.step_times import UNKNOWN, StepTimes, step_times
from robocov_app.replication.studies import BASELINE_GAINS
from robocov_app.sweep import worker
from robocov_app.sweep.executors import LocalPool
from robocov_app.sweep.ledger import Ledger, opened
from robocov_app.sweep.parameters import name_parameter_column
from robocov_app.sweep.study import Study, StudyMap
from robocov_app.sweep.sweeping import Count, sweep, sweep_progress, worked_off
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.terminal.interruption import Interruption

MARK = "paper.json"  # says that a folder is that of a study of the paper, and which
_HEAD = {"format": "robocov-paper", "version": 1}
WORST = 4  # so many of RAPF's worst runs are shown

ShownRuns: TypeAlias = list[tuple[Scenario, Record]]
Costs: TypeAlias = dict[tuple[str, int], float]  # final ones by map and seed
Finals: TypeAlias = dict[tuple[str, float | None], Costs]  # by controller and value of a column
IDEAL = "ideal"  # stands for the axis of a disturbance where there is none


class Interrupted(Exception):  # noqa: N818 - it is no error
    """Somebody has pressed Ctrl-C."""


@dataclass(frozen=True)
class RunnerOptions:
    """Execution options: `workers` processes, or the workers of a Dask `scheduler` (its address).

    With `keep_versions`, runs of other versions of robocov, or of what it computes with, are used.
    """

    workers: int
    scheduler: str | None
    quiet: bool
    stop: Interruption
    keep_versions: bool = False

    def raise_if_stopped(self) -> None:
        if self.stop.requested:
            raise Interrupted


@dataclass(frozen=True)
class Forecast:
    """All runs of a study, those `left`, the seconds for these on all workers, and those of one run each."""

    runs: int
    left: int
    seconds: float
    each: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class FigureRun:
    """A run that a figure shows."""

    record: Record
    history: CostHistory


@dataclass(frozen=True, eq=False)
class PaperResults:
    """Results of the paper's claims."""

    figures: Mapping[str, FigureRun]  # by "case/controller"
    best_figures: Mapping[str, FigureRun]  # of figures 4 to 8, at the best gains
    gains: Mapping[str, GainOutcomes]  # by controller
    convex: Outcomes  # in convex regions
    claims: Outcomes  # on non-convex maps
    contenders: tuple[Contender, ...]
    references: References
    worst: ShownRuns  # RAPF's with the shared gains, done again to be shown
    runs: int
    failed: int  # among these


@dataclass(frozen=True, eq=False)
class DensityResults:
    """Results on knowing the density."""

    outcomes: Outcomes  # of ``known`` and ``ignored``; ``final`` is the mean distance by φ, m
    pictures: tuple[FigureRun, FigureRun]  # one run that knew it, one that did not, from the same places
    costs: tuple[float, float]  # their final ones


@dataclass(frozen=True)
class Degradation:
    """The final cost of a controller at one value of a disturbance, by that of the same run without any.

    On the axis `IDEAL` it is that without any, by RAPF's.
    """

    axis: str
    value: float | None
    controller: str
    label: str
    ratio: Interval
    runs: int  # pairs of runs that the median ratio rests on; those without a ratio are left out


@dataclass(frozen=True, eq=False)
class BeyondResults:
    """Results beyond the paper."""

    plan: Plan
    outcomes: Outcomes  # of all contenders: those of the claims, the baselines, and ours
    unseen: Outcomes | None  # of ours and the paper's strongest, on maps of other families
    contenders: tuple[Contender, ...]
    gains: Mapping[str, GainOutcomes]  # of the baselines whose gains were tuned here
    steps: Mapping[int, StepTimes]  # by number of robots
    worst: ShownRuns  # runs of the first of ours, done again to be shown
    targets: Outcomes  # of `TARGETS`
    density: DensityResults
    teams: Outcomes  # of `TEAMS`
    degradations: Sequence[Degradation]
    runs: int  # all that were done for this part alone
    failed: int  # among these


def open_folder(folder: Path, plan: Plan) -> None:
    """Make the folder of a study, or make sure that it is that of the same study, quick or full."""
    mark = folder / MARK
    with report_folder_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        empty = not any(folder.iterdir())
    if empty:
        with replace_file(mark) as part:
            part.write_text(json.dumps({**_HEAD, "plan": plan.name}) + "\n", encoding="utf-8")
        return
    words = "the folder is not empty, and what is in it is no study of the paper"
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        content = json.loads(mark.read_bytes())
        if content["format"] == _HEAD["format"]:
            if content["plan"] == plan.name:
                return
            words = f"expected the {plan.name} study, got the {content['plan']} one"
    raise InputError(f"{folder}: {words}; choose another --out")


def run_study(study: Study, folder: Path, name: str, options: RunnerOptions) -> Path:
    target = folder / "studies" / name
    sweep(study, target, title=f"paper: {name}", **vars(options))
    options.raise_if_stopped()
    return target


def run_together(sweeps: Mapping[str, Study], folder: Path, options: RunnerOptions, title: str) -> None:
    """Do the runs of several sweeps, each in ``studies/`` under its name, with one pool of processes.

    Most are so small that starting processes would take longer than they do. What came of a run stands in the
    folder of its sweep, as if each had been done alone, and each then writes its table.
    """
    homes: dict[str, list[Ledger]] = {}  # two sweeps may have a task in common
    tasks: dict[str, Task] = {}
    notes = []

    def keep(task: Task, outcome: worker.Outcome) -> None:
        for ledger in homes[task.digest]:
            ledger.keep(task, outcome)

    with ExitStack() as stack:
        for name, study in sweeps.items() if options.scheduler is None else ():
            ledger = stack.enter_context(opened(folder / "studies" / name, study.to_json()))
            survey = ledger.survey(generate_tasks(study), keep_versions=options.keep_versions)
            for task in compress(generate_tasks(study), survey.todo):
                tasks[task.digest] = task
                homes.setdefault(task.digest, []).append(ledger)
            notes += [f"{name}: {line}" for line in survey.words(keep_versions=options.keep_versions)]
        if tasks or notes:
            count, workers = Count(len(tasks)), min(options.workers, len(tasks))
            tell = stack.enter_context(sweep_progress(title, count, quiet=options.quiet))
            for note in notes:
                tell.say(note)
            for _ in worked_off(tasks.values(), lambda: LocalPool(workers), count, options.stop, keep):
                tell(count)
    options.raise_if_stopped()
    quiet = options.quiet or options.scheduler is None  # then all has been told
    for name, study in sweeps.items():
        run_study(study, folder, name, replace(options, quiet=quiet))


def references_of(on: Sequence[StudyMap], folder: Path, plan: Plan, options: RunnerOptions) -> References:
    how = options.workers, options.stop
    found = find_references(on, folder / "references", plan, *how, quiet=options.quiet)
    options.raise_if_stopped()
    return found


def forecast(folder: Path, plan: Plan, workers: int, *, claims: bool, beyond: bool) -> Forecast:
    sweeps = studies.figure_studies(plan)
    papers: tuple[Contender, ...] = UNTUNED
    if claims or (beyond and grid_is_done(folder, plan)):
        # any gains stand for the best, distinct ones where that can be
        grids = studies.gain_sets(plan).items()
        guesses = (paper_contenders({law: grid[k] for law, grid in grids}) for k in (0, -1))
        papers = max(guesses, key=lambda guess: sum(map(len, laws.distinct_gains(guess).values())))
    if claims:
        sweeps |= studies.figure_studies(plan, papers)
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
    there = {name: len([*(folder / "studies" / name / "runs").glob("[!.]*")]) for name in sweeps}
    left = {name: max(len(study) - there[name], 0) for name, study in sweeps.items()}
    if not any(left.values()):
        return Forecast(runs, 0, 0.0, {})
    each: dict[str, float] = {}
    for probe in studies.probes(plan, beyond=beyond):
        for task in generate_tasks(probe):
            if not each:
                worker.perform(task)  # what is loaded and built at first does not count
            begin = time.perf_counter()
            worker.perform(task)
            each[task.controller] = (time.perf_counter() - begin) / probe.duration
    work = 0.0
    for name, study in sweeps.items():
        mean = np.mean([each[law] for law in study.controllers for _ in study.get_gains(law).choices])
        work += left[name] * float(mean) * study.duration
    seconds = {law: value * plan.duration for law, value in each.items()}
    return Forecast(runs, sum(left.values()), work / workers, seconds)


def grid_is_done(folder: Path, plan: Plan) -> bool:
    runs = folder / "studies" / "gains" / "runs"
    return all((runs / task.name).exists() for task in generate_tasks(studies.gains_study(plan)))


def partition_record() -> Record:
    """Return the run of which the first moment is figure 1: robots anywhere in the pentagon."""
    environment = robocov.load_map("pentagon")
    starts = environment.start("uniform").sample(ROBOTS, seed=PARTITION_SEED)
    return robocov.Simulation(environment, robocov.Lloyd(), starts).run(0.1)


def run_figures(
    folder: Path, plan: Plan, options: RunnerOptions, papers: Sequence[Contender] = ()
) -> dict[str, FigureRun]:
    """Do the runs that the figures show, as `studies.figure_studies`; InputError when one of them failed."""
    found: dict[str, FigureRun] = {}
    for name, study in studies.figure_studies(plan, papers).items():
        for row, run in _figure_runs(run_study(study, folder, name, options)):
            case = "other" if row["start"] == "other" else name.split("-")[1]
            found[f"{case}/{row['controller']}"] = run
    return found


def _figure_runs(folder: Path) -> Iterator[tuple[dict[str, Any], FigureRun]]:
    results = read_results(folder)
    for row in results.rows():
        if row["error"] is not None:
            raise InputError(f"{folder}: a run that a figure shows failed: {row['error']}")
        yield row, FigureRun(results.record(row["run"]), results.history(row["run"]))


def run_paper(folder: Path, plan: Plan, options: RunnerOptions) -> PaperResults:
    figures = run_figures(folder, plan, options)
    gains, known = _run_grid(studies.gains_study(plan), "gains", folder, plan, options)
    papers = paper_contenders(best_gains(gains))
    best_figures = run_figures(folder, plan, options, papers)
    convex, claims = studies.convex_contest(plan, papers), studies.claims_contest(plan, papers)
    known |= references_of((*convex.study.maps, *claims.study.maps), folder, plan, options)
    in_convex = read_outcomes(run_study(convex.study, folder, "convex", options), convex, known)
    outcomes = read_outcomes(run_study(claims.study, folder, "claims", options), claims, known)
    shown = studies.figure_studies(plan), studies.figure_studies(plan, papers)
    counts = _counts(folder, (*shown[0], *shown[1], "gains", "convex", "claims"))
    worst = worst_runs(claims.study, outcomes, RAPF_SHARED, WORST)
    return PaperResults(figures, best_figures, gains, in_convex, outcomes, papers, known, worst, **counts)


def run_beyond(folder: Path, plan: Plan, options: RunnerOptions, paper: PaperResults | None) -> BeyondResults:
    """Do the runs beyond the paper; without `paper` also its own, at the best gains where they are known."""
    gains: dict[str, GainOutcomes] = {}
    known: References = {}
    if paper is not None:
        known, papers, claims = {**paper.references}, paper.contenders, paper.claims
    else:
        if grid_is_done(folder, plan):
            # nothing is left to be done of it: the table is made sure of
            gains, known = _run_grid(studies.gains_study(plan), "gains", folder, plan, options)
        papers, gains = paper_contenders(best_gains(gains)), {}
        contest = studies.claims_contest(plan, papers)
        known |= references_of(contest.study.maps, folder, plan, options)
        claims = read_outcomes(run_study(contest.study, folder, "claims", options), contest, known)
    if (tuning := studies.baseline_gains_study(plan)) is not None:
        gains, _ = _run_grid(tuning, BASELINE_GAINS, folder, plan, options)
    contests = studies.beyond_contests(plan, best_gains(gains), papers)
    on = *studies.generated_maps(plan.beyond.maps), *studies.unseen_maps(plan)
    known |= references_of(on, folder, plan, options)
    sweeps = {name: each.study for name, each in contests.items()} | studies.conditions_studies(plan)
    run_together(sweeps, folder, options, "paper: beyond")
    at = folder / "studies"
    found = {name: read_outcomes(at / name, each, known) for name, each in contests.items()}
    sides = [name for name in contests if name == "rivals" or name.startswith("ours-")]
    outcomes = reached.joined([among_baselines(claims, plan), *(found[name] for name in sides)])
    return BeyondResults(
        plan,
        outcomes,
        found.get("unseen"),
        contenders=(*papers, *(law for name in sides for law in contests[name].contenders)),
        gains=gains,
        steps=time_steps(folder, plan, options),
        worst=worst_runs(contests[f"ours-{OURS[0]}"].study, outcomes, OWN[0], plan.beyond.worst),
        targets=found["targets"],
        density=_density(at, plan, found["density"], found["density-ignored"]),
        teams=found["teams"],
        degradations=read_degradations(at, plan),
        **_counts(folder, (*[BASELINE_GAINS] * bool(gains), *sweeps)),
    )


def among_baselines(outcomes: Outcomes, plan: Plan) -> Outcomes:
    names, starts = {each.name for each in studies.baseline_maps(plan)}, plan.beyond.starts
    return outcomes.where([each.map in names and each.start in starts for each in outcomes.scenarios])


def time_steps(folder: Path, plan: Plan, options: RunnerOptions) -> dict[int, StepTimes]:
    everybody = tuple(CONTROLLERS)
    wanted = {ROBOTS: everybody, plan.beyond.large: everybody, plan.beyond.huge: OURS[:1]}
    found = step_times(folder, wanted, plan, stopped=lambda: options.stop.requested)
    options.raise_if_stopped()
    return found


def worst_runs(study: Study, outcomes: Outcomes, contender: Contender, count: int) -> ShownRuns:
    """Return a contender's runs farthest above the reference, one a map, done again to be shown."""
    there = outcomes.measured("gap", contender.key)
    wanted: dict[str, Scenario] = {}
    for k in np.argsort(-there.of(contender.key, "gap"), kind="stable").tolist():
        if len(wanted) < count:
            wanted.setdefault(there.scenarios[k].map, there.scenarios[k])
    records = {}
    for task in generate_tasks(study):
        scenario = Scenario(task.map, task.start, task.seed)
        own = task.controller == contender.controller and dict(task.gains) == contender.all_gains
        if own and scenario in wanted.values():
            records[scenario] = worker.simulate(task).thin(10.0)
    return [(scenario, records[scenario]) for scenario in wanted.values()]


def read_degradations(at: Path, plan: Plan) -> list[Degradation]:
    """Return what became of final costs: under each condition by the ideal ones, and these by RAPF's."""
    found, parts = [], studies.disturbed(plan)
    ideal = {key: costs for part in parts for key, costs in _finals(at / f"{part}-ideal").items()}

    def add(axis: str, value: float | None, controller: str, costs: Costs, by: Costs) -> None:
        ratios = {key: costs[key] / by[key] for key in by if key in costs}
        names = [name for name, _ in ratios]
        # of few maps runs are drawn one by one: the interval is then of these maps alone
        clusters = names if len(set(names)) >= MIN_BOOTSTRAP_MAPS else None
        ratio = bootstrap([*ratios.values()], clusters=clusters) if ratios else UNKNOWN
        label = str(load_controller_class(controller).label)
        found.append(Degradation(axis, value, controller, label, ratio, len(ratios)))

    for part, (controllers, _, axes) in parts.items():
        for name in controllers:
            add(IDEAL, None, name, ideal.get((name, None), {}), ideal.get((RAPF_SHARED.controller, None), {}))
        for axis, (best, *bad) in axes.items():
            costs = _finals(at / f"{part}-{axis.replace('_', '-')}", name_parameter_column(axis), bad[0])
            for value, name in product((best, *bad), controllers):
                usual = ideal.get((name, None), {})
                add(axis, value, name, usual if value == best else costs.get((name, value), {}), usual)
    return found


def _finals(folder: Path, column: str = "", only: float | None = None) -> Finals:
    """Return the final costs of a sweep; without the column its value is `only`."""
    found: Finals = {}
    for row in read_results(folder).rows():
        if row["mean_distance_m"] is not None:
            group = found.setdefault((row["controller"], row.get(column, only)), {})
            group[row["map"], row["seed"]] = float(row["mean_distance_m"])
    return found


def _density(at: Path, plan: Plan, *found: Outcomes) -> DensityResults:
    costs = {each.name: CoverageCost(each.environment, plan.lattice) for each in studies.density_maps(plan)}
    values = {}
    for key, outcomes in zip(("known", "ignored"), found, strict=True):
        (places,) = (each for (_, measure), each in outcomes.values.items() if measure == "placement")
        finals = [
            costs[name](place).mean_distance if np.isfinite(place).all() else np.nan
            for name, place in zip(outcomes.maps, places, strict=True)
        ]
        values[key, "final"] = np.array(finals)
    ((_, known),) = _figure_runs(at / "density-picture")
    ((_, ignored),) = _figure_runs(at / "density-picture-ignored")
    judge = CoverageCost(known.record.environment, plan.lattice)
    first, second = (float(judge(each.record.positions[-1]).mean_distance) for each in (known, ignored))
    return DensityResults(Outcomes(found[0].scenarios, values), (known, ignored), (first, second))


def _run_grid(
    study: Study, name: str, folder: Path, plan: Plan, options: RunnerOptions
) -> tuple[dict[str, GainOutcomes], References]:
    known = references_of(study.maps, folder, plan, options)
    return reached.read_gain_outcomes(run_study(study, folder, name, options), study, known), known


def _counts(folder: Path, names: Iterable[str]) -> dict[str, int]:
    found = [read_results(folder / "studies" / name) for name in names]
    return {"runs": sum(map(len, found)), "failed": sum(len(each.failures()) for each in found)}
