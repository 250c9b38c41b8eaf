"""The parts of the study: figures, the paper's claims, and the results beyond the paper.

They are executed in an order in which the results that each part depends on are available.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import robocov
from robocov.controllers import CONTROLLERS
from robocov.cost import CoverageCost
from robocov.errors import InputError
from robocov.metrics.results import read_results
from robocov.record import Record
from robocov.typing import FloatArray
from robocov_app.replication.design import studies
from robocov_app.replication.design.contenders import (
    OURS,
    OWN,
    RAPF_SHARED,
    Contender,
    build_paper_contenders,
)
from robocov_app.replication.design.plan import PARTITION_SEED, ROBOTS, Plan
from robocov_app.replication.design.study_maps import (
    build_baseline_maps,
    build_claim_maps,
    build_convex_maps,
    build_density_maps,
    build_generated_maps,
    build_unseen_maps,
)
from robocov_app.replication.execution.forecast import is_gain_grid_finished
from robocov_app.replication.execution.runner import (
    RunnerOptions,
    find_map_references,
    get_study_folder,
    run_studies,
    run_study,
)
from robocov_app.replication.results.controller_speed import StepTimes, measure_step_times
from robocov_app.replication.results.degradations import read_degradations
from robocov_app.replication.results.outcome_tables import read_gain_outcomes, read_outcomes
from robocov_app.replication.results.outcomes import (
    GainOutcomes,
    Outcomes,
    ProblemInstance,
    find_best_gains,
    merge_outcomes,
)
from robocov_app.replication.results.references import References
from robocov_app.replication.results.study_results import (
    BeyondResults,
    DensityResults,
    FigureRun,
    FigureRuns,
    PaperResults,
    ShownRuns,
)
from robocov_app.sweep import worker
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.tasks import generate_tasks

_WORST_RUNS = 4
"""Number of RAPF's worst runs that are shown."""
_SHOWN_RATE_HZ = 10.0
_PARTITION_DURATION_S = 0.1


def record_partition() -> Record:
    """Record the run whose first frame is figure 1: robots at random positions in the pentagon."""
    environment = robocov.load_map("pentagon")
    starts = environment.start("uniform").sample(ROBOTS, seed=PARTITION_SEED)
    return robocov.Simulation(environment, robocov.Lloyd(), starts).run(_PARTITION_DURATION_S)


def run_figures(folder: Path, plan: Plan, options: RunnerOptions) -> FigureRuns:
    """Execute the runs that are shown in figures with the shared gains.

    Returns
    -------
    FigureRuns

    Raises
    ------
    InputError
        If a run failed.
    """
    sweeps = studies.build_figure_studies(plan)
    run_studies(sweeps, folder, options, "paper: figures")
    return _read_figure_studies(sweeps, folder)


def _read_figure_studies(names: Iterable[str], folder: Path) -> FigureRuns:
    """Read the runs of sweeps whose names are "figures-case" or "figures-case-variant"."""
    runs: FigureRuns = {}
    for name in names:
        _, name_case, *words = name.split("-")
        variant = runs.setdefault("-".join(words), {})
        for row, run in _read_figure_runs(get_study_folder(folder, name)):
            case = "other" if row["start"] == "other" else name_case
            variant[f"{case}/{row['controller']}"] = run
    return runs


def _read_figure_runs(folder: Path) -> Iterator[tuple[dict[str, Any], FigureRun]]:
    """Yield the table row and the content of each run in a sweep; raise InputError if one failed."""
    results = read_results(folder)
    for row in results.rows():
        if row["error"] is not None:
            raise InputError(f"{folder}: a run that a figure shows failed: {row['error']}")
        yield row, FigureRun(results.record(row["run"]), results.history(row["run"]))


def run_paper(folder: Path, plan: Plan, options: RunnerOptions) -> PaperResults:
    """Execute the runs of the paper's figures and claims, and read their results.

    The gain grids come first, because they determine the best gains of the contenders.
    """
    figure_studies = studies.build_figure_studies(plan)
    gains_study = studies.build_gains_study(plan)
    maps = (*gains_study.maps, *build_convex_maps(plan), *build_claim_maps(plan))
    references = find_map_references(maps, folder, plan, options)
    run_studies({**figure_studies, "gains": gains_study}, folder, options, "paper: figures and gains")
    gains = read_gain_outcomes(get_study_folder(folder, "gains"), gains_study, references)
    paper_contenders = build_paper_contenders(find_best_gains(gains))
    best_studies = studies.build_best_figure_studies(plan, paper_contenders)
    contests = {
        "convex": studies.build_convex_contest(plan, paper_contenders),
        "claims": studies.build_claims_contest(plan, paper_contenders),
        "limited": studies.build_limited_contest(plan, paper_contenders),
    }
    contest_studies = {name: contest.study for name, contest in contests.items()}
    run_studies({**best_studies, **contest_studies}, folder, options, "paper: claims")
    outcomes = {
        name: read_outcomes(get_study_folder(folder, name), contest, references)
        for name, contest in contests.items()
    }
    runs, failed = _count_runs(folder, [*figure_studies, "gains", *best_studies, *contests])
    return PaperResults(
        figures=_read_figure_studies([*figure_studies, *best_studies], folder),
        gains=gains,
        convex=outcomes["convex"],
        claims=outcomes["claims"],
        limited=outcomes["limited"],
        contenders=paper_contenders,
        references=references,
        worst=repeat_worst_runs(contests["claims"].study, outcomes["claims"], RAPF_SHARED, _WORST_RUNS),
        runs=runs,
        failed=failed,
    )


def run_beyond(folder: Path, plan: Plan, options: RunnerOptions, paper: PaperResults | None) -> BeyondResults:
    """Execute the runs beyond the paper, and read their results.

    Parameters
    ----------
    folder : Path
    plan : Plan
    options : RunnerOptions
    paper : PaperResults or None
        Results of the paper's claims. Without them, the paper's contenders run as well, with their best gains
        if these are known.

    Returns
    -------
    BeyondResults
    """
    paper_contenders, claims, references = _get_claims_results(folder, plan, options, paper)
    gains = _run_baseline_gain_grids(folder, plan, options)
    contests = studies.build_beyond_contests(plan, find_best_gains(gains), paper_contenders)
    maps = (*build_generated_maps(plan.beyond.maps), *build_unseen_maps(plan))
    references |= find_map_references(maps, folder, plan, options)
    sweeps = {name: contest.study for name, contest in contests.items()}
    sweeps |= studies.build_conditions_studies(plan)
    run_studies(sweeps, folder, options, "paper: beyond")
    outcomes = {
        name: read_outcomes(get_study_folder(folder, name), contest, references)
        for name, contest in contests.items()
    }
    ranked_names = [name for name in contests if name == "rivals" or name.startswith("ours-")]
    ranked_outcomes = [outcomes[name] for name in ranked_names]
    all_outcomes = merge_outcomes([select_baseline_outcomes(claims, plan), *ranked_outcomes])
    ranked_contenders: list[Contender] = []
    for name in ranked_names:
        ranked_contenders += contests[name].contenders
    own_study = contests[f"ours-{OURS[0]}"].study
    names = [*sweeps, studies.BASELINE_GAINS] if gains else list(sweeps)
    runs, failed = _count_runs(folder, names)
    return BeyondResults(
        plan=plan,
        outcomes=all_outcomes,
        unseen=outcomes.get("unseen"),
        contenders=(*paper_contenders, *ranked_contenders),
        gains=gains,
        steps=time_steps(folder, plan, options),
        worst=repeat_worst_runs(own_study, all_outcomes, OWN[0], plan.beyond.worst),
        targets=outcomes["targets"],
        density=_read_density_results(folder, plan, outcomes["density"], outcomes["density-ignored"]),
        teams=outcomes["teams"],
        degradations=read_degradations(folder / "studies", plan),
        runs=runs,
        failed=failed,
    )


def _get_claims_results(
    folder: Path, plan: Plan, options: RunnerOptions, paper: PaperResults | None
) -> tuple[tuple[Contender, ...], Outcomes, References]:
    """Return the paper's contenders, their outcomes and the references; execute missing runs."""
    if paper is not None:
        return paper.contenders, paper.claims, {**paper.references}
    return _run_claims_sweep(folder, plan, options)


def _run_claims_sweep(
    folder: Path, plan: Plan, options: RunnerOptions
) -> tuple[tuple[Contender, ...], Outcomes, References]:
    """Run the paper's contenders on the non-convex maps of its claims.

    Each contender is a controller with a set of gains; some have the best gains of the gain grid.

    Returns
    -------
    contenders : tuple of Contender
    outcomes : Outcomes
    references : References
        Reference placements on the maps.
    """
    gains: dict[str, GainOutcomes] = {}
    references: References = {}
    if is_gain_grid_finished(folder, plan):
        # All runs exist already, but the table may be missing; this writes it.
        gains, references = _run_gain_grid(studies.build_gains_study(plan), "gains", folder, plan, options)
    paper_contenders = build_paper_contenders(find_best_gains(gains))
    contest = studies.build_claims_contest(plan, paper_contenders)
    references |= find_map_references(contest.study.maps, folder, plan, options)
    target = run_study(contest.study, folder, "claims", options)
    return paper_contenders, read_outcomes(target, contest, references), references


def _run_baseline_gain_grids(folder: Path, plan: Plan, options: RunnerOptions) -> dict[str, GainOutcomes]:
    """Run the gain grids of the baselines; return their outcomes by controller, {} if they are not tuned."""
    tuning = studies.build_baseline_gains_study(plan)
    if tuning is None:
        return {}
    outcomes, _ = _run_gain_grid(tuning, studies.BASELINE_GAINS, folder, plan, options)
    return outcomes


def _run_gain_grid(
    study: Study, name: str, folder: Path, plan: Plan, options: RunnerOptions
) -> tuple[dict[str, GainOutcomes], References]:
    """Run a gain grid; return its outcomes by controller, and the references of its maps."""
    references = find_map_references(study.maps, folder, plan, options)
    target = run_study(study, folder, name, options)
    return read_gain_outcomes(target, study, references), references


def select_baseline_outcomes(outcomes: Outcomes, plan: Plan) -> Outcomes:
    """Return the outcomes on the maps and from the starts on which the baselines run."""
    names = {study_map.name for study_map in build_baseline_maps(plan)}
    starts = plan.beyond.starts
    return outcomes.select(
        [instance.map in names and instance.start in starts for instance in outcomes.instances]
    )


def time_steps(folder: Path, plan: Plan, options: RunnerOptions) -> dict[int, StepTimes]:
    """Measure the step times of all controllers; the largest team is only timed with our own controller.

    Raises
    ------
    StudyInterrupted
        If the user has interrupted the study.
    """
    every_controller = tuple(CONTROLLERS)
    controllers_by_size = {
        ROBOTS: every_controller,
        plan.beyond.large: every_controller,
        plan.beyond.huge: OURS[:1],
    }
    step_times = measure_step_times(
        folder, controllers_by_size, plan, is_stopped=lambda: options.stop.requested
    )
    options.raise_if_stopped()
    return step_times


def repeat_worst_runs(study: Study, outcomes: Outcomes, contender: Contender, count: int) -> ShownRuns:
    """Repeat the worst runs of a contender, with trajectories, so that they can be shown.

    Parameters
    ----------
    study : Study
        Sweep that contains these runs.
    outcomes : Outcomes
    contender : Contender
    count : int
        Maximum number of runs.

    Returns
    -------
    list of (ProblemInstance, Record)
        The runs with the highest gaps, at most one for each map.
    """
    known = outcomes.select_finite("gap", contender.key)
    worst: dict[str, ProblemInstance] = {}
    for k in np.argsort(-known.get_values(contender.key, "gap"), kind="stable").tolist():
        if len(worst) < count:
            worst.setdefault(known.instances[k].map, known.instances[k])
    records = {}
    for task in generate_tasks(study):
        instance = ProblemInstance(task.map, task.start, task.seed)
        is_contender = task.controller == contender.controller and dict(task.gains) == contender.all_gains
        if is_contender and instance in worst.values():
            records[instance] = worker.simulate(task).thin(_SHOWN_RATE_HZ)
    return [(instance, records[instance]) for instance in worst.values()]


def _read_density_results(folder: Path, plan: Plan, known: Outcomes, ignored: Outcomes) -> DensityResults:
    """Read the runs with and without knowledge of the density, and compute the weighted costs of both.

    Runs that ignore the density have recorded unweighted costs.
    """
    costs = {
        study_map.name: CoverageCost(study_map.environment, plan.lattice)
        for study_map in build_density_maps(plan)
    }
    values: dict[tuple[str, str], FloatArray] = {}
    for key, outcomes in (("known", known), ("ignored", ignored)):
        finals = []
        for name, positions in zip(outcomes.maps, _get_placements(outcomes), strict=True):
            is_finished = np.isfinite(positions).all()
            finals.append(costs[name](positions).mean_distance if is_finished else np.nan)
        values[key, "final"] = np.array(finals)
    known_run = _read_single_run(get_study_folder(folder, "density-picture"))
    ignored_run = _read_single_run(get_study_folder(folder, "density-picture-ignored"))
    cost = CoverageCost(known_run.record.environment, plan.lattice)
    return DensityResults(
        outcomes=Outcomes(known.instances, values),
        figure_runs=(known_run, ignored_run),
        costs=(
            float(cost(known_run.record.positions[-1]).mean_distance),
            float(cost(ignored_run.record.positions[-1]).mean_distance),
        ),
    )


def _get_placements(outcomes: Outcomes) -> FloatArray:
    """Return the final positions of the only contender, (m, n, 2) m."""
    (placements,) = [array for (_, measure), array in outcomes.values.items() if measure == "placement"]
    return placements


def _read_single_run(folder: Path) -> FigureRun:
    """Read the only run of a sweep."""
    ((_, run),) = _read_figure_runs(folder)
    return run


def _count_runs(folder: Path, names: Iterable[str]) -> tuple[int, int]:
    """Return the number of runs in some sweeps, and the number of failed runs among them."""
    tables = [read_results(get_study_folder(folder, name)) for name in names]
    return sum(len(table) for table in tables), sum(len(table.failures()) for table in tables)
