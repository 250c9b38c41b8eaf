"""Computing times of a step with each controller, measured in alternation and stored in a file."""

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
from robocov_app.replication.design.plan import TEAM, Plan
from robocov_app.sweep.study.parameters import build_swept_team

BASELINE = "rapf"
"""Reference controller for the step times of all others."""
TIMING_MAP = "campus"
"""Map on which steps are timed: the largest bundled one, which has space for large teams."""
STEPS_PER_BLOCK = 50
"""Number of steps that are timed together, so that occasional scans and plans count proportionally."""
STEP_TIMES_FILE = "steps.json"
UNKNOWN = Interval(float("nan"), float("nan"), float("nan"))
"""Interval of an unknown value."""
_MAX_CLOCK_RESOLUTION_S = 1e-5
"""Maximum resolution of a usable clock: a block of the fastest steps takes a few milliseconds."""
_HEAD = {"format": "robocov-steps", "version": 1}


@dataclass(frozen=True)
class StepTimes:
    """Computing times of a step of one team, measured in alternation for all controllers.

    Parameters
    ----------
    robots : int
        Size of the team.
    dt : float
        Simulation time of a step, s.
    seconds : Mapping
        Mean computing time of a step in each block, s, by controller.
    """

    robots: int
    dt: float
    seconds: Mapping[str, tuple[float, ...]]

    def compute_ratio(self, controller: str) -> Interval:
        """Return the median ratio of the step time of a controller to that of RAPF."""
        times = self.seconds.get(controller)
        baseline_times = self.seconds.get(BASELINE)
        if not times or not baseline_times:
            return UNKNOWN
        return bootstrap(np.array(times) / np.array(baseline_times))

    def compute_real_time_factor(self, controller: str) -> Interval:
        """Return the median ratio of computing time to simulation time for a controller."""
        times = self.seconds.get(controller)
        return bootstrap(np.array(times) / self.dt) if times else UNKNOWN


def measure_step_times(
    folder: Path,
    controllers_by_size: Mapping[int, Sequence[str]],
    plan: Plan,
    *,
    is_stopped: Callable[[], bool] = lambda: False,
    clock: Callable[[], float] | None = None,
) -> dict[int, StepTimes]:
    """Return the step times of controllers; those that are not stored yet are measured.

    Stored times may come from another machine.

    Parameters
    ----------
    folder : Path
        Folder of the file.
    controllers_by_size : Mapping
        Controllers to time by the size of the team.
    plan : Plan
    is_stopped : callable
        Called between blocks. If it returns True, only complete measurements are returned.
    clock : callable, optional
        Returns a time in s. By default the processor time of this process, which other processes hardly
        affect; if its resolution is too coarse, the elapsed time.

    Returns
    -------
    dict
        Step times by the number of robots.
    """
    path = folder / STEP_TIMES_FILE
    stored = _load_entries(path)
    if clock is None:
        resolution = time.get_clock_info("process_time").resolution
        clock = time.process_time if resolution <= _MAX_CLOCK_RESOLUTION_S else time.perf_counter
    step_times = {}
    for robots, controllers in controllers_by_size.items():
        names = list(dict.fromkeys((BASELINE, *controllers)))
        input_hash = _hash_inputs(robots, names, plan)
        entry = stored.get(str(robots))
        if entry is None or entry["digest"] != input_hash:
            seconds = _measure(robots, names, plan, is_stopped, clock)
            if seconds is None:
                break
            entry = {"digest": input_hash, "seconds_per_step": seconds}
            stored[str(robots)] = entry
            _save_entries(path, stored, plan)
        times = {name: tuple(seconds) for name, seconds in entry["seconds_per_step"].items()}
        step_times[robots] = StepTimes(robots, plan.dt, times)
    return step_times


def _hash_inputs(robots: int, controllers: Sequence[str], plan: Plan) -> str:
    """Return a hash of everything that step times depend on, apart from the machine."""
    gains = {name: dict(get_gain_values(make_controller(name))) for name in controllers}
    content = [
        robots,
        plan.dt,
        dict(TEAM),
        plan.beyond.warm_up,
        plan.beyond.blocks,
        gains,
        list_versions()["robocov"],
    ]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _measure(
    robots: int,
    controllers: Sequence[str],
    plan: Plan,
    is_stopped: Callable[[], bool],
    clock: Callable[[], float],
) -> dict[str, list[float]] | None:
    """Return the mean step time of each controller in each block, s; None if the measurement was stopped."""
    scenario = Scenario(TIMING_MAP, team=build_swept_team(robots, TEAM), start="uniform", dt=plan.dt)
    simulations = {name: scenario.replace(controller=name).build_simulation() for name in controllers}
    for simulation in simulations.values():
        for _ in range(plan.beyond.warm_up):
            simulation.step()
    seconds: dict[str, list[float]] = {name: [] for name in simulations}
    for _ in range(plan.beyond.blocks):
        for name, simulation in simulations.items():
            if is_stopped():
                return None
            start = clock()
            for _ in range(STEPS_PER_BLOCK):
                simulation.step()
            seconds[name].append((clock() - start) / STEPS_PER_BLOCK)
    return seconds


def _load_entries(path: Path) -> dict[str, Any]:
    """Return the stored measurements by the number of robots; empty if the file cannot be read."""
    with suppress(OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        content = json.loads(path.read_bytes())
        if content["format"] == _HEAD["format"]:
            entries = {}
            for robots, entry in dict(content["robots"]).items():
                times = {name: list(map(float, block)) for name, block in entry["seconds_per_step"].items()}
                entries[robots] = {"digest": str(entry["digest"]), "seconds_per_step": times}
            return entries
    return {}


def _save_entries(path: Path, entries: Mapping[str, Any], plan: Plan) -> None:
    """Write the measurements by the number of robots, with their common settings."""
    document = {
        **_HEAD,
        "map": TIMING_MAP,
        "dt_s": plan.dt,
        "steps_per_block": STEPS_PER_BLOCK,
        "robots": entries,
    }
    with replace_file(path) as temporary:
        temporary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
