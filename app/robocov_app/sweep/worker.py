"""Doing one task: from what a run needs to the files that come of it."""

import gc
import io
import json
import threading
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache

import numpy as np

from robocov.controllers import get_information
from robocov.controllers.teammates import Teammates
from robocov.controllers.user_modules import provide_modules
from robocov.cost import CoverageCost
from robocov.environment import Environment
from robocov.errors import RobocovError
from robocov.mapfile import from_json
from robocov.metrics import compute_cost_history, summarize
from robocov.metrics.run_metrics import compute_final_metrics
from robocov.planning.discovered_map import DiscoveredMap
from robocov.record import Record, list_versions
from robocov.scenario import Scenario
from robocov.simulation import Simulation
from robocov_app.jobs.messages import Line
from robocov_app.runs.execution import build_cost_table
from robocov_app.sweep.controller_files import source_to_json
from robocov_app.sweep.parameters import build_conditions, build_swept_team
from robocov_app.sweep.tasks import Task
from robocov_app.terminal.output import format_csv, format_json, replace_non_finite

_REMEMBERED = 4  # maps whose costs a worker keeps; tasks come map by map
_TIDY = 1000  # steps after which garbage is collected in a long run
FIGURES = {  # of a run in the table, in this order: kind, unit and meaning
    "mean_distance_m": ("double", "m", "final mean distance to the nearest robot, (22) by area or ∫φ"),
    "mean_distance_over_run_m": ("double", "m", "mean of it over the time of the run"),
    "cost_m3": ("double", "m³", "coverage cost (22) at the end"),
    "uncovered_area_m2": ("double", "m²", "area cut off from every robot"),
    "settled_at_s": ("double", "s", "when the team came to rest, null if it did not"),
    "contacts": ("int64", "", "how often a robot began to touch a wall or another robot"),
    "min_clearance_m": ("double", "m", "smallest gap between a robot and a wall"),
    "path_length_m": ("double", "m", "distance travelled, mean over the robots"),
    "stuck_robots": ("int64", "", "robots at rest away from their goals at the end, null without goals"),
}
TIMED = "mean_time_s"  # what it holds as well where robots are not equally fast
EFFORT = "effort.json"  # of runs with metrics: computing time differs each time, so the table has it not
POSITION, CELL, REPORT = 20, 5, 28  # bytes of a position, a cell of a map, and a position at some time
_ONE_AT_A_TIME = threading.Lock()
_RESULTS = 4  # goes up when the same inputs give other results: since noise and loss draw from NumPy


@cache
def made_with() -> dict[str, str]:
    """Return the versions that results of this process depend on."""
    found = dict(list_versions())
    del found["python"]
    return found | {"robocov": f"{found['robocov']} (results {_RESULTS})"}


@dataclass(frozen=True)
class Outcome:
    """Outcome of a task: files of the run's folder, figures of the table, or why it failed."""

    files: Mapping[str, bytes]
    figures: Mapping[str, float | int | None]
    error: str | None = None
    versions: Mapping[str, str] = field(default_factory=made_with)


def perform(task: Task) -> Outcome:
    """Do a run; what goes wrong in it is a part of the outcome.

    No other thread of this process comes near the physics meanwhile, for which pymunk is not made. What runs
    leave behind is collected here too: another thread would free bodies amid the next run's steps.
    """
    with _ONE_AT_A_TIME:
        enabled = gc.isenabled()
        gc.disable()
        try:
            environment, cost = prepared(task)
            record, effort = measured(task, environment)
            history = compute_cost_history(record, cost, task.cost_hz)
            # of all moments: what is kept of them is for people to look at
            summary = replace_non_finite(summarize(record, history))
            path = summary["path_length_m"]
            figures = {**summary, "path_length_m": sum(path) / len(path)}
            figures = {name: figures[name] for name in (*FIGURES, TIMED) if name in figures}
            content = record.to_json(summary, lattice=task.lattice)
            content |= {"cost_hz": task.cost_hz, "record_hz": task.record_hz}
            content["controller"] |= source_to_json(task.source)
            kept, arrays = record.thin(task.record_hz), io.BytesIO()
            np.savez_compressed(arrays, **{name: getattr(kept, name) for name in kept.arrays})
            files = {"run.json": format_json(content).encode(), "record.npz": arrays.getvalue()}
            files["cost.csv"] = format_csv(*build_cost_table(history)).encode()
            if task.metrics:
                figures |= replace_non_finite(compute_final_metrics(record, history))
                files[EFFORT] = format_json(effort).encode()
            return Outcome(files, figures)
        except BaseException as error:  # a user's controller may raise anything
            message = str(error) if isinstance(error, RobocovError) else f"{type(error).__name__}: {error}"
            return failed(message, traceback.format_exc())
        finally:
            gc.collect(1)  # what is older than the run is none of its garbage
            if enabled:
                gc.enable()


class Performing:
    """Does the tasks of a `LocalPool` in a process of its own."""

    failing = "the run failed"

    def __call__(self, questions: list[Task], line: Line) -> Outcome:
        return perform(questions[-1])


def failed(message: str, details: str) -> Outcome:
    # one line of what files can hold, whatever a controller of a user's says
    message = " ".join(message.split()).encode(errors="replace").decode() or "it does not say why"
    return Outcome(
        {"error.json": format_json({"error": message, "traceback": details}).encode()}, {}, message
    )


def simulated(task: Task, environment: Environment) -> Record:
    return measured(task, environment)[0]


def measured(task: Task, environment: Environment) -> tuple[Record, dict[str, float | None]]:
    """Simulate a run, and return the whole of it, and what it took: what ``effort.json`` holds."""
    scenario = Scenario(
        environment,
        task.controller,
        task.gains,
        source=task.source,
        team=build_swept_team(task.robots, task.team),
        start=task.start,
        seed=task.seed,
        duration=task.duration,
        dt=task.dt,
        conditions=build_conditions(task.team, task.seed, task.robots),
    )
    with provide_modules({} if task.source is None else task.source.modules):
        simulation = scenario.build_simulation()
        telling = Telling(simulation)

        def count_and_tidy(step: int) -> bool:
            if step and step % _TIDY == 0:
                gc.collect(0)
            if step and task.metrics:
                telling.count()
            return False

        record = scenario.run(simulation, should_stop=count_and_tidy)
    return record, {"deciding_s": simulation.decision_time, "told_bytes": telling.bytes}


class Telling:
    """Counts the bytes that robots tell each other, whether they are heard or not.

    A message is a position, `POSITION` bytes with the robot's number, at the rate of the conditions or each
    control period. Robots that share maps also tell each cell of theirs that has changed, `CELL` bytes with
    its number, whoever they know it from, and at each plan where they know others to be, `REPORT` bytes each.
    The bytes are None where a law shares other maps than ours.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        rate: float | None = getattr(simulation.conditions, "message_rate", None)
        self._share = 1.0 if rate is None else min(1.0, rate * simulation.dt)
        self._sharing = get_information(simulation.controller) == "shared map"
        self._maps, self._reports = self._known(), self._told()
        self.bytes: float | None = 0.0

    def _known(self) -> tuple[DiscoveredMap, ...] | None:
        return getattr(self._simulation.memory, "maps", None) if self._sharing else ()

    def _told(self) -> tuple[Teammates, ...]:
        return getattr(self._simulation.memory, "reports", ()) if self._sharing else ()

    def count(self) -> None:
        before, self._maps = self._maps, self._known()
        told, self._reports = self._reports, self._told()
        if self.bytes is None or before is None or self._maps is None:
            self.bytes = None
            return
        self.bytes += self._share * POSITION * int(self._simulation.working.sum())
        for old, new in zip(before, self._maps, strict=True):
            if new is not old:
                self.bytes += CELL * int(np.count_nonzero(new.state != old.state))
        for last, others in zip(told, self._reports, strict=True):
            if others is not last:
                self.bytes += REPORT * len(others.robots)


def prepared(task: Task) -> tuple[Environment, CoverageCost]:
    """Return the map of a task and its cost, those of the last few maps as they were."""
    return _prepared(task.document, task.map, task.lattice)


@lru_cache(_REMEMBERED)
def _prepared(document: str, name: str, lattice: int) -> tuple[Environment, CoverageCost]:
    environment = from_json(json.loads(document), name)
    return environment, CoverageCost(environment, lattice)
