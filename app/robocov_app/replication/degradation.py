"""How much worse coverage gets when things go wrong: a study over loss, delay, range, noise and failures.

Every run in which something goes wrong is compared with the run of the same controller on the same map from
the same places in which it does not: what is told is the median of the ratio of their final costs, with its
interval. In all of them robots tell twice a second where they are: of sixty messages nobody would miss one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, NamedTuple, TypeAlias

from robocov.controllers import controller_kind
from robocov.errors import RobocovError, counted
from robocov.mapfile import load_map
from robocov_app.figures.statistics import Interval, bootstrap
from robocov_app.sweep.performing import Outcome, perform
from robocov_app.sweep.study import TEAM, Study, StudyMap, Task, TeamValue, tasks_of

Performing: TypeAlias = Callable[[Sequence[Task]], Iterable[Outcome]]
"""Does tasks, and gives their outcomes in the same order."""

ENOUGH_MAPS = 5
"""Maps from which intervals draw whole maps; of fewer, runs one by one: they are then of these maps alone."""

AXES: Mapping[str, tuple[float | None, ...]] = {
    "loss": (0.0, 0.3, 0.6, 0.9),
    "delay": (0.0, 0.5, 1.0, 2.0),
    "communication_range": (None, 6.0, 4.0, 2.0),
    "position_noise": (0.0, 0.05, 0.1, 0.2),
    "sensing_noise": (0.0, 0.05, 0.1, 0.2),
    "failure_rate": (0.0, 0.005, 0.01, 0.02),
}
"""What goes wrong, from not at all to badly; the first of each is the ideal."""


@dataclass(frozen=True)
class DegradationPlan:
    """What the study runs.

    Attributes
    ----------
    maps, controllers : tuple of str
    axes : dict of name to values
        Of the team or the conditions; the first value of each is the ideal.
    always : dict of name to value
        Conditions that all runs are under, those that they are compared with as well.
    robots : int
    seeds : int
        How many on each map.
    duration, dt : float, s
    lattice : int
    """

    maps: tuple[str, ...] = ("rooms", "museum", "office", "blocks-a", "courtyard", "gaps")
    controllers: tuple[str, ...] = ("rapf", "lloyd")
    axes: Mapping[str, tuple[float | None, ...]] = field(default_factory=lambda: dict(AXES))
    always: Mapping[str, float] = field(default_factory=lambda: {"message_rate": 2.0})
    robots: int = 6
    seeds: int = 10
    duration: float = 60.0
    dt: float = 1 / 60
    lattice: int = 64

    def study(self, **changes: Any) -> Study:
        """Return the study of some of the runs, as changes of the ideal one."""
        return Study(
            maps=tuple(StudyMap(name, load_map(name)) for name in self.maps),
            controllers=self.controllers,
            robots=(self.robots,),
            seeds=range(self.seeds),
            duration=self.duration,
            dt=self.dt,
            lattice=self.lattice,
            cost_hz=0.0,
            record_hz=0.0,
            **changes,
        )

    def tasks(self) -> Iterator[tuple[str, TeamValue, Task]]:
        """Yield axis, value and task of each run; the ideal ones, which all axes share, have no axis."""
        for task in tasks_of(self.study(conditions=dict(self.always))):
            yield "", None, task
        for name, values in self.axes.items():
            bad = list(values[1:])
            if name in TEAM:
                study = self.study(**{name: bad}, conditions=dict(self.always))
            else:
                study = self.study(conditions={**self.always, name: bad})
            for task in tasks_of(study):
                yield name, task.team[name], task


QUICK = DegradationPlan(
    maps=("rooms", "museum"),
    axes={name: (values[0], values[1], values[3]) for name, values in AXES.items()},
    seeds=3,
    duration=20.0,
    dt=1 / 30,
    lattice=32,
)
"""A small one of about a minute."""


class Degradation(NamedTuple):
    """What came of one value of one axis, for one controller.

    Attributes
    ----------
    axis : str
    value : float or None
    controller, label : str
    ratio : Interval
        Median of the final cost as a multiple of that of the same run under ideal conditions.
    runs : int
        Pairs of runs that this rests on.
    lost : int
        Pairs that have no ratio: a run failed, or no robot was left to be counted.
    """

    axis: str
    value: float | None
    controller: str
    label: str
    ratio: Interval
    runs: int
    lost: int

    def to_json(self) -> dict[str, Any]:
        """Return it as plain JSON."""
        return {**self._asdict(), "ratio": asdict(self.ratio)}


def in_turn(tasks: Sequence[Task]) -> Iterator[Outcome]:
    """Do tasks one after the other in this process."""
    yield from map(perform, tasks)


def degradations(
    plan: DegradationPlan, performing: Performing = in_turn, on_run: Callable[[int, int], None] | None = None
) -> list[Degradation]:
    """Run the study.

    Parameters
    ----------
    plan : DegradationPlan
    performing : callable
        Does the runs; by default in this process.
    on_run : callable
        Called with how many runs are done, and how many there are.

    Returns
    -------
    list of Degradation
        By axis, value and controller, in the order of the plan; the ideal values included, with ratio 1.

    Raises
    ------
    RobocovError
        When all runs under ideal conditions fail.
    """
    jobs = list(plan.tasks())
    finals: dict[tuple[str, TeamValue, str], dict[tuple[str, int], float]] = {}
    outcomes = performing([task for *_, task in jobs])
    for done, ((axis, value, task), outcome) in enumerate(zip(jobs, outcomes, strict=True), start=1):
        final = outcome.figures.get("mean_distance_m")
        if final is not None:
            finals.setdefault((axis, value, task.controller), {})[task.map, task.seed] = float(final)
        if on_run is not None:
            on_run(done, len(jobs))
    found = []
    for axis, values in plan.axes.items():
        for value in values:
            for controller in plan.controllers:
                ideal = finals.get(("", None, controller), {})
                if not ideal:
                    raise RobocovError(f"{controller}: all {counted(plan.seeds, 'run')} on each map failed")
                got = ideal if value == values[0] else finals.get((axis, value, controller), {})
                found.append(_compared(axis, value, controller, got, ideal))
    return found


def _compared(
    axis: str,
    value: float | None,
    controller: str,
    got: Mapping[tuple[str, int], float],
    ideal: Mapping[tuple[str, int], float],
) -> Degradation:
    pairs = [key for key in ideal if key in got]
    nothing = float("nan")
    ratio = Interval(nothing, nothing, nothing)
    if pairs:
        maps = [name for name, _ in pairs]
        clusters = maps if len(set(maps)) >= ENOUGH_MAPS else None
        ratio = bootstrap([got[key] / ideal[key] for key in pairs], clusters=clusters)
    label = str(controller_kind(controller).label)
    return Degradation(axis, value, controller, label, ratio, len(pairs), len(ideal) - len(pairs))
