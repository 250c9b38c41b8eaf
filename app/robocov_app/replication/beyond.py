"""What goes beyond the paper: its runs done, the steps timed, and what came of them read."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from robocov.cost import CoverageCost
from robocov.metrics.results import read_results
from robocov_app.replication import beyond_studies
from robocov_app.replication import plan as planned
from robocov_app.replication.beyond_plan import HUGE, LARGE, SMALL
from robocov_app.replication.beyond_studies import UNSEEN
from robocov_app.replication.contenders import best
from robocov_app.replication.degradation import degradations
from robocov_app.replication.doing import swept_together
from robocov_app.replication.figures import Shown
from robocov_app.replication.maps import KINDS
from robocov_app.replication.outcomes import Outcomes, joined
from robocov_app.replication.reading import read_gain_outcomes, read_outcomes, scenarios_of
from robocov_app.replication.rival_gains import NAME, rival_gains_study, studied_rival_gains, tuned_rivals
from robocov_app.replication.steps import step_times
from robocov_app.replication.studying import (
    Forecast,
    Stopped,
    counted_runs,
    referenced,
    runs_there,
    swept,
    worst_runs,
)
from robocov_app.sweep.performing import Outcome

if TYPE_CHECKING:
    from robocov.record import Record
    from robocov_app.replication.contenders import Contender
    from robocov_app.replication.degradation import Degradation
    from robocov_app.replication.outcomes import GainOutcomes, Scenario
    from robocov_app.replication.plan import Plan
    from robocov_app.replication.references import Reference
    from robocov_app.replication.steps import StepTimes
    from robocov_app.replication.studying import Material, Means
    from robocov_app.sweep.study import Study


class Weighed(NamedTuple):
    """What became of knowing the density.

    Attributes
    ----------
    outcomes : Outcomes
        Contenders ``known`` and ``ignored``; ``final`` is the mean distance by φ, m, for both.
    pictures : Shown, Shown
        One run that knew it and one that did not, on the same map from the same places.
    costs : (float, float), m
        Their mean distances by φ at the end.
    """

    outcomes: Outcomes
    pictures: tuple[Shown, Shown]
    costs: tuple[float, float]


@dataclass(frozen=True, eq=False)
class BeyondMaterial:
    """All that the runs beyond the paper gave.

    Attributes
    ----------
    plan : Plan
    outcomes : Outcomes
        Of all contenders: those of the claims, the rivals, and ours.
    unseen : Outcomes or None
        Of the first of ours and the strongest of the paper's, on maps that played no part in its development.
    contenders : tuple of Contender
    gains : dict of controller to GainOutcomes
        Of the rivals whose gains were tuned here.
    references : dict of map to Reference
    steps : dict of number of robots to StepTimes
    worst : sequence of (Scenario, Record)
        The worst runs of the first of our controllers, done again to be shown.
    targets : Outcomes
        Contenders as `beyond_studies.TARGETS`.
    weighed : Weighed
    teams : Outcomes
        Contenders as `beyond_studies.TEAMS`; ``final`` is the mean time, s.
    degradations : sequence of Degradation
    runs, failed : int
        All that were done for this part alone, and those among them that failed.
    """

    plan: Plan
    outcomes: Outcomes
    unseen: Outcomes | None
    contenders: tuple[Contender, ...]
    gains: Mapping[str, GainOutcomes]
    references: Mapping[str, Reference]
    steps: Mapping[int, StepTimes]
    worst: Sequence[tuple[Scenario, Record]]
    targets: Outcomes
    weighed: Weighed
    teams: Outcomes
    degradations: Sequence[Degradation]
    runs: int
    failed: int

    @property
    def ours(self) -> str | None:
        """The first of our own controllers that took part, for which the goals are."""
        return next((each.key for each in beyond_studies.ours()), None)


def studied_beyond(folder: Path, plan: Plan, means: Means, material: Material | None) -> BeyondMaterial:
    """Do all runs beyond the paper that are not done yet, and read what came of them.

    Parameters
    ----------
    folder : Path
        Of the study of the paper.
    plan : Plan
        With `Plan.beyond`.
    means : Means
    material : Material or None
        What the paper's own part gave; None: it is left out, and the paper's controllers are run here, with
        their best gains if the grids of gains have been run before.

    Raises
    ------
    Stopped
        After Ctrl-C.
    InputError, OutputError
        As `robocov_app.sweep.sweeping.sweep`.
    """
    if material is None:
        known, papers, claims = _papers_laws(folder, plan, means)
    else:
        known = dict(material.references)
        papers, claims = planned.claim_contenders(material.best), material.claims
    gains = studied_rival_gains(folder, plan, means)
    tuned = tuned_rivals(gains)
    rival_studies = beyond_studies.rival_studies(plan, tuned)
    small = beyond_studies.small_studies(plan)
    known |= referenced(beyond_studies.small_maps(plan), folder, plan, means)
    unseen = beyond_studies.unseen_study(plan, papers)
    known |= referenced(beyond_studies.unseen_maps(plan), folder, plan, means)
    swept_together(beyond_studies.all_studies(plan, tuned, papers), folder, means, "paper: beyond")
    others = tuple(law for _, laws in rival_studies.values() for law in laws)
    parts = [among_rivals(claims, plan)]
    for name, (study, laws) in rival_studies.items():
        parts.append(read_outcomes(folder / "studies" / name, study, laws, known))
    steps = timed(folder, plan, means)
    done = [*([NAME] if gains else ()), *rival_studies, *([UNSEEN] if unseen else ()), *small]
    counts = [counted_runs(folder / "studies" / name) for name in done]
    outcomes = joined(parts)
    return BeyondMaterial(
        plan=plan,
        outcomes=outcomes,
        unseen=None if unseen is None else read_outcomes(folder / "studies" / UNSEEN, *unseen, known),
        worst=_worst(plan, outcomes, rival_studies),
        contenders=(*papers, *others),
        gains=gains,
        references=known,
        steps=steps,
        targets=read_outcomes(
            folder / "studies" / "targets", small["targets"], beyond_studies.TARGETS, known
        ),
        weighed=_weighed(folder, plan, small),
        teams=_timed_outcomes(folder / "studies" / "teams", small["teams"], beyond_studies.TEAMS),
        degradations=_degraded(folder, plan),
        runs=sum(runs for runs, _ in counts),
        failed=sum(failed for _, failed in counts),
    )


def among_rivals(outcomes: Outcomes, plan: Plan) -> Outcomes:
    """Return what was reached on the maps and from the kinds of starts that rivals have as well."""
    maps = {each.name for each in beyond_studies.rival_maps(plan)}
    starts = set(beyond_studies.of(plan).starts)
    there = [scenario.map in maps and scenario.start in starts for scenario in outcomes.scenarios]
    return outcomes.among(np.array(there, dtype=bool))


def timed(folder: Path, plan: Plan, means: Means) -> dict[int, StepTimes]:
    """Return how long the steps of every registered controller take beside RAPF's.

    Raises
    ------
    Stopped
        After Ctrl-C.
    OutputError
        When they cannot be kept.
    """
    from robocov.controllers import CONTROLLERS

    beyond = beyond_studies.of(plan)
    own = beyond_studies.controllers(beyond_studies.ours()[:1])
    everybody = tuple(CONTROLLERS)
    found = step_times(
        folder,
        {SMALL: everybody, LARGE: everybody, HUGE: own},
        dt=plan.dt,
        team=plan.team,
        warm_up=beyond.warm_up,
        blocks=beyond.blocks,
        stopped=lambda: means.stop.requested,
    )
    if means.stop.requested:
        raise Stopped
    return found


def forecast_beyond(folder: Path, plan: Plan, workers: int, *, alone: bool) -> Forecast:
    """Return how many runs there are beyond the paper, and how long they will take.

    A short run of each controller is done now. Where this part is done `alone`, the runs of the paper's
    controllers count as well. The time for the references of maps and for the timing of steps is not in it.
    """
    from robocov_app.sweep.performing import perform
    from robocov_app.sweep.study import tasks_of

    studies = beyond_studies.all_studies(plan)
    tuning = rival_gains_study(plan)
    if tuning is not None:
        studies[NAME] = tuning
    if alone:
        laws = _papers_laws_expected(folder, plan)
        studies["claims"] = planned.study_of(plan, planned.claim_maps(plan), laws, KINDS, plan.seeds)
    runs = sum(len(study) for study in studies.values())
    # which gains will be the best is not known yet, and how many runs these are does not depend on it
    there = {name: min(runs_there(folder, name), len(study)) for name, study in studies.items()}
    if runs == sum(there.values()):
        return Forecast(runs, 0, 0.0, {})
    each: dict[str, float] = {}
    for probe in beyond_studies.probes(plan):
        (task,) = tasks_of(probe)
        if not each:
            perform(task)  # what is loaded and built at first does not count
        begin = time.perf_counter()
        perform(task)
        each.setdefault(task.controller, (time.perf_counter() - begin) / probe.duration)
    work = 0.0
    for name, study in studies.items():
        left = len(study) - there[name]
        mean = float(np.mean([each[law] for law in study.controllers for _ in study.gains_of(law).choices]))
        work += left * mean * study.duration
    seconds = {law: value * plan.duration for law, value in each.items()}
    return Forecast(runs, runs - sum(there.values()), work / workers, seconds)


def _worst(
    plan: Plan, outcomes: Outcomes, studies: Mapping[str, tuple[Study, tuple[Contender, ...]]]
) -> list[tuple[Scenario, Record]]:
    for law in beyond_studies.ours()[:1]:
        for study, laws in studies.values():
            if law in laws:
                own = outcomes.among(np.isfinite(outcomes.of(law.key, "gap")))
                return worst_runs(study, own, law, beyond_studies.of(plan).worst)
    return []


def _papers_laws_expected(folder: Path, plan: Plan) -> tuple[Contender, ...]:
    """Return the paper's controllers as `_papers_laws` runs them, with any gains for those that are best."""
    tuning = planned.gains_study(plan)
    if runs_there(folder, "gains", tuning) < len(tuning):
        return beyond_studies.UNTUNED
    # it is taken that the best are none of the others, which the first or the last of a grid may be
    guesses = (
        planned.claim_contenders({law: best(law, grid[k]) for law, grid in planned.gain_sets(plan).items()})
        for k in (0, -1)
    )
    return max(guesses, key=lambda laws: len(planned.distinct(laws)))


def _papers_laws(
    folder: Path, plan: Plan, means: Means
) -> tuple[dict[str, Reference], tuple[Contender, ...], Outcomes]:
    """Run the paper's controllers on the maps of the claims."""
    laws: tuple[Contender, ...] = beyond_studies.UNTUNED
    known: dict[str, Reference] = {}
    tuning = planned.gains_study(plan)
    if runs_there(folder, "gains", tuning) == len(tuning):
        # nothing is left to be done of it: the table is made sure of
        known |= referenced(tuning.maps, folder, plan, means)
        swept(tuning, folder, "gains", means)
        grids = read_gain_outcomes(folder / "studies" / "gains", tuning, known)
        chosen = {law: best(law, grid.gains[grid.best()]) for law, grid in grids.items()}
        laws = planned.claim_contenders(chosen)
    study = planned.study_of(plan, planned.claim_maps(plan), laws, KINDS, plan.seeds)
    known |= referenced(study.maps, folder, plan, means)
    swept(study, folder, "claims", means)
    return known, laws, read_outcomes(folder / "studies" / "claims", study, laws, known)


def _weighed(folder: Path, plan: Plan, studies: Mapping[str, Study]) -> Weighed:
    """Read the runs that knew the density and those that did not; by φ all of them are judged."""
    maps = {each.name: each.environment for each in beyond_studies.weighed_maps(plan)}
    scenarios = scenarios_of(studies["density"])
    values = {(key, "final"): np.full(len(scenarios), np.nan) for key in ("known", "ignored")}
    costs: dict[str, CoverageCost] = {}
    for key, name in (("known", "density"), ("ignored", "density-ignored")):
        results = read_results(folder / "studies" / name)
        for row in results.to_table().to_pylist():
            if row["error"] is None:
                at = [tuple(each) for each in scenarios].index((row["map"], row["start"], row["seed"]))
                cost = costs.get(row["map"])
                if cost is None:
                    cost = costs[row["map"]] = CoverageCost(maps[row["map"]], plan.lattice)
                values[key, "final"][at] = cost(results.record(row["run"]).positions[-1]).mean_distance
    shown = []
    for name in ("density-picture", "density-picture-ignored"):
        results = read_results(folder / "studies" / name)
        (row,) = results.to_table().to_pylist()
        shown.append(Shown(results.record(row["run"]), results.history(row["run"])))
    known, ignored = shown
    judge = CoverageCost(known.record.environment, plan.lattice)
    judged = [float(judge(each.record.positions[-1]).mean_distance) for each in shown]
    return Weighed(Outcomes(scenarios, values), (known, ignored), (judged[0], judged[1]))


def _timed_outcomes(folder: Path, study: Study, laws: Sequence[Contender]) -> Outcomes:
    """Read runs of robots that are not equally fast; ``final`` is the mean time, s."""
    scenarios = scenarios_of(study)
    place = {tuple(scenario): k for k, scenario in enumerate(scenarios)}
    values = {(law.key, "final"): np.full(len(scenarios), np.nan) for law in laws}
    values |= {(law.key, "distance"): np.full(len(scenarios), np.nan) for law in laws}
    keys = {(law.controller, law.gains["cells"]): law.key for law in laws}
    for row in read_results(folder).to_table().to_pylist():
        if row["error"] is None:
            at = place[row["map"], row["start"], row["seed"]]
            key = keys[row["controller"], row["cells"]]
            values[key, "final"][at] = row["mean_time_s"]
            values[key, "distance"][at] = row["mean_distance_m"]
    return Outcomes(scenarios, values)


def _degraded(folder: Path, plan: Plan) -> list[Degradation]:
    """Compare runs under bad conditions with those under ideal ones; all of them are there."""
    from robocov_app.sweep.ledger import Ledger
    from robocov_app.sweep.study import tasks_of

    conditions = beyond_studies.conditions_plan(plan)
    homes: dict[str, Ledger] = {}
    for name, study in beyond_studies.conditions_studies(plan).items():
        ledger = Ledger(folder / "studies" / name)
        homes |= {task.digest: ledger for task in tasks_of(study)}

    def looked_up(tasks: Sequence[Any]) -> list[Outcome]:
        found = []
        for task in tasks:
            entry = homes[task.digest].entry(task)
            found.append(Outcome({}, {} if entry is None else entry.figures))
        return found

    return degradations(conditions, looked_up)
