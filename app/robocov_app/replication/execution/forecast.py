"""Forecast of the number of runs of a study, and of its computing time."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from robocov.files.result_names import RUNS_FOLDER
from robocov_app.replication.design import contenders, studies
from robocov_app.replication.design.contenders import UNTUNED, Contender, build_paper_contenders
from robocov_app.replication.design.plan import Plan
from robocov_app.replication.execution.runner import get_study_folder
from robocov_app.sweep import worker
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.tasks import generate_tasks


@dataclass(frozen=True)
class Forecast:
    """Forecast of a study.

    Parameters
    ----------
    runs : int
        Number of all runs.
    left : int
        Number of runs that are not finished.
    seconds : float
        Time that the unfinished runs take with all workers, s.
    seconds_per_run : Mapping
        Computing time of one run, s, by controller.
    """

    runs: int
    left: int
    seconds: float
    seconds_per_run: Mapping[str, float]


def forecast_study(folder: Path, plan: Plan, workers: int, *, claims: bool, beyond: bool) -> Forecast:
    """Forecast a study from a short run of every controller.

    Parameters
    ----------
    folder : Path
        Folder of the study, which may contain finished runs.
    plan : Plan
    workers : int
        Number of processes.
    claims, beyond : bool
        Whether to include the paper's claims, and the part beyond the paper.

    Returns
    -------
    Forecast
    """
    sweeps = _list_studies(folder, plan, claims=claims, beyond=beyond)
    left = {name: _count_runs_left(folder, name, study) for name, study in sweeps.items()}
    runs = sum(len(study) for study in sweeps.values())
    if not any(left.values()):
        return Forecast(runs, left=0, seconds=0.0, seconds_per_run={})
    factors = _measure_real_time_factors(plan, beyond=beyond)
    total = 0.0
    for name, study in sweeps.items():
        study_factors = []
        for controller in study.controllers:
            study_factors += [factors[controller]] * len(study.get_gains(controller).choices)
        total += left[name] * float(np.mean(study_factors)) * study.duration
    return Forecast(
        runs,
        left=sum(left.values()),
        seconds=total / workers,
        seconds_per_run={controller: factor * plan.duration for controller, factor in factors.items()},
    )


def _list_studies(folder: Path, plan: Plan, *, claims: bool, beyond: bool) -> dict[str, Study]:
    """Return all sweeps of a study by name.

    The best gains are not known yet, but the number of runs hardly depends on them.
    """
    sweeps = studies.build_figure_studies(plan)
    paper_contenders: tuple[Contender, ...] = UNTUNED
    if claims or (beyond and is_gain_grid_finished(folder, plan)):
        paper_contenders = _guess_paper_contenders(plan)
    if claims:
        sweeps |= studies.build_best_figure_studies(plan, paper_contenders)
        sweeps["gains"] = studies.build_gains_study(plan)
        sweeps["convex"] = studies.build_convex_contest(plan, paper_contenders).study
        sweeps["limited"] = studies.build_limited_contest(plan, paper_contenders).study
    if claims or beyond:
        sweeps["claims"] = studies.build_claims_contest(plan, paper_contenders).study
    if beyond:
        tuning = studies.build_baseline_gains_study(plan)
        if tuning is not None:
            sweeps[studies.BASELINE_GAINS] = tuning
        for name, contest in studies.build_beyond_contests(plan, {}, paper_contenders).items():
            sweeps[name] = contest.study
        sweeps |= studies.build_conditions_studies(plan)
    return sweeps


def _guess_paper_contenders(plan: Plan) -> tuple[Contender, ...]:
    """Return the paper's contenders with a guess of their best gains.

    If the best gains equal the shared ones, there are fewer runs, so the guess with more sets is returned.
    """
    guesses = []
    for k in (0, -1):
        best = {controller: gain_sets[k] for controller, gain_sets in studies.list_gain_sets(plan).items()}
        guesses.append(build_paper_contenders(best))
    return max(guesses, key=_count_gain_sets)


def _count_gain_sets(participants: tuple[Contender, ...]) -> int:
    """Return the number of different combinations of a controller and its gains."""
    return sum(len(sets) for sets in contenders.collect_gain_sets(participants).values())


def _count_runs_left(folder: Path, name: str, study: Study) -> int:
    """Return the number of runs of a sweep that have no folder yet."""
    finished = list((get_study_folder(folder, name) / RUNS_FOLDER).glob("[!.]*"))
    return max(len(study) - len(finished), 0)


def _measure_real_time_factors(plan: Plan, *, beyond: bool) -> dict[str, float]:
    """Return the computing time relative to the simulation time, by controller."""
    factors: dict[str, float] = {}
    for study in studies.build_probe_studies(plan, beyond=beyond):
        for task in generate_tasks(study):
            if not factors:
                # An untimed run first, which loads and compiles everything.
                worker.perform(task)
            start = time.perf_counter()
            worker.perform(task)
            factors[task.controller] = (time.perf_counter() - start) / study.duration
    return factors


def is_gain_grid_finished(folder: Path, plan: Plan) -> bool:
    """Return whether all runs of the gain grids of RAPF and RPF are finished."""
    runs = get_study_folder(folder, "gains") / RUNS_FOLDER
    return all((runs / task.name).exists() for task in generate_tasks(studies.build_gains_study(plan)))
