"""Results of the study: on the paper's claims, and beyond the paper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from robocov.metrics import CostHistory
from robocov.record import Record
from robocov_app.figures.statistics import Interval
from robocov_app.replication.design.contenders import Contender
from robocov_app.replication.design.plan import Plan
from robocov_app.replication.results.controller_speed import StepTimes
from robocov_app.replication.results.outcomes import GainOutcomes, Outcomes, ProblemInstance
from robocov_app.replication.results.references import References

ShownRuns: TypeAlias = list[tuple[ProblemInstance, Record]]
"""Runs that were repeated with trajectories, so that they can be shown."""
IDEAL = "ideal"
"""Axis of a `Degradation` without disturbances."""


@dataclass(frozen=True, eq=False)
class FigureRun:
    """A run that a figure shows."""

    record: Record
    history: CostHistory


FigureRuns: TypeAlias = dict[str, dict[str, FigureRun]]
"""Runs of the figures by variant, then by "case/controller".

The variant "" has the shared gains, "best" the best gains; "limited" and "half-step" have the shared gains at
limited ranges and with half the control period.
"""


@dataclass(frozen=True, eq=False)
class PaperResults:
    """Results of the paper's claims.

    Parameters
    ----------
    figures : dict
        Runs of the figures.
    gains : Mapping
        Outcomes of the gain grids by controller.
    convex, claims, limited : Outcomes
        Outcomes in convex regions, on non-convex maps, and on non-convex maps at limited ranges.
    contenders : tuple of Contender
    references : dict
        Reference placements by map.
    worst : list of (ProblemInstance, Record)
        The worst runs of RAPF with the shared gains.
    runs, failed : int
        Number of all runs, and of those that failed.
    """

    figures: FigureRuns
    gains: Mapping[str, GainOutcomes]
    convex: Outcomes
    claims: Outcomes
    limited: Outcomes
    contenders: tuple[Contender, ...]
    references: References
    worst: ShownRuns
    runs: int
    failed: int


@dataclass(frozen=True, eq=False)
class DensityResults:
    """Results on whether RAPF benefits from knowing the density.

    Parameters
    ----------
    outcomes : Outcomes
        Outcomes of the contenders ``known`` and ``ignored``; ``final`` is the mean distance weighted by φ, m.
    figure_runs : tuple of FigureRun
        A run that knew the density, and one from the same starts that did not.
    costs : tuple of float
        Their final mean distances weighted by φ, m.
    """

    outcomes: Outcomes
    figure_runs: tuple[FigureRun, FigureRun]
    costs: tuple[float, float]


@dataclass(frozen=True)
class Degradation:
    """Final cost of a controller under a disturbance, relative to that of the same runs without it.

    On the axis `IDEAL` it is the cost without disturbances, relative to that of RAPF.

    Parameters
    ----------
    axis : str
        Kind of the disturbance.
    value : float or None
        Its value; None for an unlimited range, and on the axis `IDEAL`.
    controller, label : str
    ratio : Interval
        Median ratio of the costs.
    runs : int
        Number of pairs of runs with a ratio.
    """

    axis: str
    value: float | None
    controller: str
    label: str
    ratio: Interval
    runs: int


@dataclass(frozen=True, eq=False)
class BeyondResults:
    """Results beyond the paper.

    Parameters
    ----------
    plan : Plan
    outcomes : Outcomes
        Outcomes of all contenders: those of the paper's claims, the baselines, and our controllers.
    unseen : Outcomes or None
        Outcomes of our main controller and of the paper's strongest contenders on the maps of `UNSEEN`.
    contenders : tuple of Contender
    gains : Mapping
        Outcomes of the gain grids of the baselines that were tuned, by controller.
    steps : Mapping
        Step times by the number of robots.
    worst : list of (ProblemInstance, Record)
        The worst runs of our main controller.
    targets, teams : Outcomes
        Outcomes of `contenders.TARGETS` and `contenders.TEAMS`.
    density : DensityResults
    degradations : sequence of Degradation
    runs, failed : int
        Number of runs in this part of the study, and of those that failed.
    """

    plan: Plan
    outcomes: Outcomes
    unseen: Outcomes | None
    contenders: tuple[Contender, ...]
    gains: Mapping[str, GainOutcomes]
    steps: Mapping[int, StepTimes]
    worst: ShownRuns
    targets: Outcomes
    density: DensityResults
    teams: Outcomes
    degradations: Sequence[Degradation]
    runs: int
    failed: int
