"""Times of a step of every controller, beside RAPF's, measured in turn; kept in a file."""

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robocov.controllers import get_gain_values, make_controller
from robocov.files.writing import replace_file
from robocov.record import list_versions
from robocov.scenario import Scenario
from robocov_app.figures.statistics import Interval, bootstrap
from robocov_app.replication.plan import TEAM, Plan
from robocov_app.sweep.parameters import build_swept_team

YARDSTICK = "rapf"  # the controller whose steps the others' are measured by
MAP = "campus"  # where steps are timed: the largest of the bundled maps has room for large teams
BLOCK = 50  # steps that are timed together: what is done now and then, a scan or a plan, counts by its share
FILE = "steps.json"
_FINE = 1e-5  # s: what a clock has to tell apart, a block of the quickest steps being some milliseconds
_HEAD = {"format": "robocov-steps", "version": 1}
UNKNOWN = Interval(float("nan"), float("nan"), float("nan"))


@dataclass(frozen=True)
class StepTimes:
    """Time of a step, s, in each of some blocks of `BLOCK` steps, by controller; all were timed in turn."""

    robots: int
    dt: float  # s, simulated time of a step
    seconds: Mapping[str, tuple[float, ...]]

    def ratio_interval(self, controller: str) -> Interval:
        own, yardstick = self.seconds.get(controller), self.seconds.get(YARDSTICK)
        return bootstrap(np.array(own) / np.array(yardstick)) if own and yardstick else UNKNOWN

    def real_time(self, controller: str) -> Interval:
        """Return the time of a step by the simulated one."""
        own = self.seconds.get(controller)
        return bootstrap(np.array(own) / self.dt) if own else UNKNOWN


def step_times(
    folder: Path,
    wanted: Mapping[int, Sequence[str]],
    plan: Plan,
    *,
    stopped: Callable[[], bool] = lambda: False,
    clock: Callable[[], float] | None = None,
) -> dict[int, StepTimes]:
    """Return how long steps of controllers take, by the size of the team: as kept in `folder`, else timed.

    Times that were kept are those of the machine that measured them. `stopped` is asked between two blocks;
    what is whole by then is returned. `clock` returns seconds; by default those that this process computes,
    where the system counts them finely: what else is going on then hardly matters.
    """
    found, path = {}, folder / FILE
    kept = _kept(path)
    if clock is None:
        fine = time.get_clock_info("process_time").resolution <= _FINE
        clock = time.process_time if fine else time.perf_counter
    for robots, controllers in wanted.items():
        names = list(dict.fromkeys((YARDSTICK, *controllers)))
        gains = {name: dict(get_gain_values(make_controller(name))) for name in names}
        blocks = plan.beyond.warm_up, plan.beyond.blocks
        content = [robots, plan.dt, dict(TEAM), *blocks, gains, list_versions()["robocov"]]
        digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
        entry = kept.get(str(robots))
        if entry is None or entry["digest"] != digest:
            seconds = _timed(robots, names, plan, stopped, clock)
            if seconds is None:
                break
            kept[str(robots)] = entry = {"digest": digest, "seconds_per_step": seconds}
            document = {**_HEAD, "map": MAP, "dt_s": plan.dt, "steps_per_block": BLOCK, "robots": kept}
            with replace_file(path) as part:
                part.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
        taken = {name: tuple(own) for name, own in entry["seconds_per_step"].items()}
        found[robots] = StepTimes(robots, plan.dt, taken)
    return found


def _timed(
    robots: int, names: Sequence[str], plan: Plan, stopped: Callable[[], bool], clock: Callable[[], float]
) -> dict[str, list[float]] | None:
    scenario = Scenario(MAP, team=build_swept_team(robots, TEAM), start="uniform", dt=plan.dt)
    runs = {name: scenario.replace(controller=name).build_simulation() for name in names}
    for run in runs.values():
        for _ in range(plan.beyond.warm_up):
            run.step()
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(plan.beyond.blocks):
        for name, run in runs.items():
            if stopped():
                return None
            begin = clock()
            for _ in range(BLOCK):
                run.step()
            taken[name].append((clock() - begin) / BLOCK)
    return taken


def _kept(path: Path) -> dict[str, Any]:
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        content = json.loads(path.read_bytes())
        if content["format"] == _HEAD["format"]:
            found = {}
            for robots, entry in dict(content["robots"]).items():
                times = {name: list(map(float, own)) for name, own in entry["seconds_per_step"].items()}
                found[robots] = {"digest": str(entry["digest"]), "seconds_per_step": times}
            return found
    return {}
