"""How long a step of every controller takes, beside RAPF's, measured in turn; kept in a file."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.controllers import gain_values, make_controller
from robocov.files.atomic import written
from robocov.mapfile import load_map
from robocov.record import versions

if TYPE_CHECKING:
    from robocov_app.figures.statistics import Interval

YARDSTICK = "rapf"
"""The controller whose steps the others' are measured by."""

MAP = "campus"
"""Where steps are timed: the largest of the bundled maps has room for large teams."""

BLOCK = 50
"""Steps that are timed together: what is done now and then, a scan or a plan, counts by its share."""

FILE = "steps.json"

_FINE = 1e-5
"""Seconds: what a clock has to tell apart, a block of the quickest steps being some milliseconds."""

_HEAD = {"format": "robocov-steps", "version": 1}


@dataclass(frozen=True)
class StepTimes:
    """How long a step takes, in blocks of `BLOCK` steps.

    Attributes
    ----------
    robots : int
    dt : float, s
        Simulated time of a step.
    seconds : dict of controller to (blocks,)
        A step's share of each block. The blocks of all controllers were timed in turn.
    """

    robots: int
    dt: float
    seconds: Mapping[str, tuple[float, ...]]

    def ratio(self, controller: str) -> float:
        """Return the median over the blocks of the time by RAPF's in the same turn; nan where unmeasured."""
        own, yardstick = self.seconds.get(controller), self.seconds.get(YARDSTICK)
        if not own or not yardstick:
            return float("nan")
        return float(np.median(np.array(own) / np.array(yardstick)))

    def ratio_interval(self, controller: str) -> Interval:
        """Return that ratio with its bootstrap interval over the blocks."""
        from robocov_app.figures.statistics import Interval, bootstrap

        own, yardstick = self.seconds.get(controller), self.seconds.get(YARDSTICK)
        if not own or not yardstick:
            return Interval(*[float("nan")] * 3)
        return bootstrap(np.array(own) / np.array(yardstick))

    def interval(self, controller: str) -> Interval:
        """Return the median time of a step, s, with its bootstrap interval over the blocks."""
        from robocov_app.figures.statistics import Interval, bootstrap

        own = self.seconds.get(controller)
        return bootstrap(own) if own else Interval(*[float("nan")] * 3)


def step_times(
    folder: Path,
    wanted: Mapping[int, Sequence[str]],
    *,
    dt: float,
    team: Mapping[str, Any],
    warm_up: int,
    blocks: int,
    stopped: Callable[[], bool] = lambda: False,
    clock: Callable[[], float] | None = None,
) -> dict[int, StepTimes]:
    """Return how long steps take, by the size of the team: from `folder` where they are there, else timed.

    Parameters
    ----------
    folder : Path
        For `FILE`; times that were kept are those of the same controllers on the machine that measured them.
    wanted : dict of number of robots to controllers
    dt : float, s
    team : dict of name to value
        As `robocov.Team.homogeneous` takes them, None for a range without limit.
    warm_up, blocks : int
        Steps before the first that counts, and blocks of `BLOCK` that count.
    stopped : callable
        Asked between two blocks; what is whole by then is returned.
    clock : callable or None
        Returns seconds; by default those that this process computes, where the system counts them finely:
        what else is going on then hardly matters.

    Raises
    ------
    OutputError
        When the file cannot be written.
    """
    found = {}
    path = folder / FILE
    kept = _kept(path)
    for robots, controllers in wanted.items():
        laws = list(dict.fromkeys((YARDSTICK, *controllers)))
        digest = _digest([robots, dt, dict(team), warm_up, blocks, _gains(laws), versions()["robocov"]])
        entry = kept.get(str(robots))
        if entry is None or entry["digest"] != digest:
            seconds = _timed(robots, laws, dt, team, warm_up, blocks, stopped, clock or _finest_clock())
            if seconds is None:
                break
            entry = {"digest": digest, "seconds_per_step": seconds}
            kept[str(robots)] = entry
            content = {**_HEAD, "map": MAP, "dt_s": dt, "steps_per_block": BLOCK, "robots": kept}
            with written(path) as part:
                part.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        taken = {name: tuple(map(float, values)) for name, values in entry["seconds_per_step"].items()}
        found[robots] = StepTimes(robots, dt, taken)
    return found


def _timed(
    robots: int,
    controllers: Iterable[str],
    dt: float,
    team: Mapping[str, Any],
    warm_up: int,
    blocks: int,
    stopped: Callable[[], bool],
    clock: Callable[[], float],
) -> dict[str, list[float]] | None:
    from robocov_app.runs.spec import RunSpec
    from robocov_app.sweep.study import team_of

    spec = RunSpec(load_map(MAP), team=team_of(robots, team), start="uniform", dt=dt)
    runs = {name: replace(spec, controller=name).simulation() for name in controllers}
    for run in runs.values():
        for _ in range(warm_up):
            run.step()
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(blocks):
        for name, run in runs.items():
            if stopped():
                return None
            begin = clock()
            for _ in range(BLOCK):
                run.step()
            taken[name].append((clock() - begin) / BLOCK)
    return taken


def _finest_clock() -> Callable[[], float]:
    fine = time.get_clock_info("process_time").resolution <= _FINE
    return time.process_time if fine else time.perf_counter


def _gains(controllers: Iterable[str]) -> dict[str, Any]:
    return {name: dict(gain_values(make_controller(name))) for name in controllers}


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _kept(path: Path) -> dict[str, Any]:
    """Return what a file holds, nothing where there is none that can be read."""
    try:
        content = json.loads(path.read_bytes())
        if content["format"] != _HEAD["format"]:
            return {}
        entries = dict(content["robots"])
        for entry in entries.values():
            str(entry["digest"])
            for values in entry["seconds_per_step"].values():
                [float(value) for value in values]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}
    return entries
