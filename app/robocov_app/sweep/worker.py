"""Execution of one task: simulation and evaluation of a run, and its files and metrics for the table."""

from __future__ import annotations

import gc
import io
import threading
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from typing import Any, TypeAlias

import numpy as np

from robocov.conditions.communication import POSITION_BYTES
from robocov.controllers.base import Controller
from robocov.controllers.user_modules import provide_modules
from robocov.cost import CoverageCost
from robocov.errors import RobocovError
from robocov.files.result_names import COST_FILE, ERROR_FILE, RECORD_FILE, RUN_FILE
from robocov.metrics import CostHistory, compute_cost_history, summarize
from robocov.metrics.run_metrics import compute_final_metrics
from robocov.observation import Snapshot
from robocov.record import Record, list_versions
from robocov.simulation import Simulation
from robocov_app.jobs.messages import Channel
from robocov_app.runs.cost_table import build_cost_table
from robocov_app.sweep.study.controller_files import source_to_json
from robocov_app.sweep.study.parameters import build_swept_team
from robocov_app.sweep.tasks import MAX_CACHED_MAPS, Task, parse_map
from robocov_app.terminal.output import format_csv, format_json, replace_non_finite

_COLLECTION_STEPS = 1000
"""Number of steps between two garbage collections in a long run."""
METRICS = {
    "mean_distance_m": ("double", "m", "mean distance to the nearest robot at the end, weighted by φ"),
    "mean_distance_over_run_m": ("double", "m", "time average of the mean distance over the run"),
    "cost_m3": ("double", "m³", "coverage cost (22) at the end"),
    "uncovered_area_m2": ("double", "m²", "area cut off from every robot"),
    "settled_at_s": ("double", "s", "time at which the team settled, null if it did not"),
    "contacts": ("int64", "", "number of contacts of a robot with a wall or another robot"),
    "min_clearance_m": ("double", "m", "smallest distance from a robot to a wall"),
    "path_length_m": ("double", "m", "path length, mean over the robots"),
    "stuck_robots": ("int64", "", "robots at rest away from their goals at the end, null without goals"),
}
"""Metrics of a run in the table, in order, with the type of the column, the unit and the meaning."""
MEAN_TIME = "mean_time_s"
"""Additional metric of runs in which robots differ in speed."""
EFFORT_FILE = "effort.json"
"""File with the computing time and the sent bytes of a run with metrics. They are not in the table, because
the table must not depend on the machine."""
Watch: TypeAlias = Callable[[Snapshot], object]
"""Receives the observations and decisions of a run, step by step."""
_execution_lock = threading.Lock()
_RESULTS_VERSION = 5
"""Number to be increased in each release in which the same inputs give other results. Since version 5, robots
share maps by messages, and the cost counts no paths through gaps that are narrower than a robot."""


@cache
def list_result_versions() -> dict[str, str]:
    """Return the versions on which the results of this process depend, by package."""
    versions = dict(list_versions())
    del versions["python"]
    versions["robocov"] = f"{versions['robocov']} (results {_RESULTS_VERSION})"
    return versions


@dataclass(frozen=True)
class Outcome:
    """Outcome of a task.

    Attributes
    ----------
    files : mapping of str to bytes
        Files in the folder of the run, by name.
    metrics : mapping of str to float, int or None
        Metrics in the table; empty if the run failed.
    error : str or None
        Reason why the run failed; None if it did not.
    versions : mapping of str to str
        Versions of the packages on which the results depend.
    """

    files: Mapping[str, bytes]
    metrics: Mapping[str, float | int | None]
    error: str | None = None
    versions: Mapping[str, str] = field(default_factory=list_result_versions)


def perform(task: Task, watch: Watch | None = None, controller: Controller | None = None) -> Outcome:
    """Execute a task. Errors of the run are not raised, but are part of the outcome.

    Parameters
    ----------
    task : Task
        The run to execute.
    watch : callable or None
        Called with the snapshot of each step.
    controller : Controller or None
        Controller that replaces that of the task.

    Returns
    -------
    Outcome
    """
    # pymunk is not thread-safe, so only one run is executed at a time. Its garbage is collected here: an
    # automatic collection in another thread could free bodies in the middle of the next run's steps.
    with _execution_lock:
        was_enabled = gc.isenabled()
        gc.disable()
        try:
            return _perform(task, watch, controller)
        except BaseException as error:  # A controller of the user may raise anything.
            message = str(error) if isinstance(error, RobocovError) else f"{type(error).__name__}: {error}"
            return build_failure(message, traceback.format_exc())
        finally:
            # Generation 1 is enough, since the garbage of the run is young.
            gc.collect(1)
            if was_enabled:
                gc.enable()


def _perform(task: Task, watch: Watch | None, controller: Controller | None) -> Outcome:
    """Simulate and evaluate a run, and build its files; errors are raised."""
    cost = prepare_cost(task)
    record, effort = _simulate_and_measure(task, watch, controller)
    history = compute_cost_history(record, cost, task.cost_hz)
    # Metrics are computed from all steps; the saved record contains only some of them.
    summary = replace_non_finite(summarize(record, history))
    metrics = _select_metrics(summary)
    files = _build_files(task, record, history, summary)
    if task.metrics:
        metrics |= replace_non_finite(compute_final_metrics(record, history))
        files[EFFORT_FILE] = format_json(effort).encode()
    return Outcome(files, metrics)


def _select_metrics(summary: Mapping[str, Any]) -> dict[str, float | int | None]:
    """Select the metrics for the table from the summary of a run; the path length is averaged over robots."""
    path_lengths = summary["path_length_m"]
    values = {**summary, "path_length_m": sum(path_lengths) / len(path_lengths)}
    return {name: values[name] for name in (*METRICS, MEAN_TIME) if name in values}


def _build_files(
    task: Task, record: Record, history: CostHistory, summary: Mapping[str, Any]
) -> dict[str, bytes]:
    """Build the files of a successful run, by name."""
    content = record.to_json(summary, lattice=task.lattice)
    content["cost_hz"] = task.cost_hz
    content["record_hz"] = task.record_hz
    content["controller"] |= source_to_json(task.source)
    thinned_record = record.thin(task.record_hz)
    arrays = io.BytesIO()
    np.savez_compressed(arrays, **{name: getattr(thinned_record, name) for name in thinned_record.arrays})
    return {
        RUN_FILE: format_json(content).encode(),
        RECORD_FILE: arrays.getvalue(),
        COST_FILE: format_csv(*build_cost_table(history)).encode(),
    }


class TaskService:
    """Worker service that executes the tasks of a `LocalPool`."""

    failure_message = "the run failed"

    def __call__(self, requests: list[Task], channel: Channel) -> Outcome:
        """Execute the task. A `LocalPool` sends one at a time, so there is only one request."""
        (task,) = requests
        return perform(task)


def build_failure(message: str, details: str) -> Outcome:
    """Build the outcome of a failed run.

    Parameters
    ----------
    message : str
        Reason for the failure. It may contain any characters, because controllers of the user write it.
    details : str
        Traceback, or the last output of the process.

    Returns
    -------
    Outcome
        Outcome whose error is a single line of valid characters.
    """
    line = " ".join(message.split()).encode(errors="replace").decode()
    error = line or "no reason was given"
    content = {"error": error, "traceback": details}
    return Outcome({ERROR_FILE: format_json(content).encode()}, {}, error)


def simulate(task: Task) -> Record:
    """Simulate the run of a task, and return the record of all steps.

    Raises
    ------
    RobocovError
        If the run is impossible, or its controller fails.
    """
    record, _ = _simulate_and_measure(task)
    return record


def _simulate_and_measure(
    task: Task, watch: Watch | None = None, controller: Controller | None = None
) -> tuple[Record, dict[str, float | None]]:
    """Simulate a run; return its record and the content of ``effort.json``."""
    scenario = task.build_scenario()
    with provide_modules({} if task.source is None else task.source.modules):
        simulation = scenario.build_simulation(controller)
        meter = CommunicationMeter(simulation)

        def observe_step(step: int) -> bool:
            # Automatic garbage collection is off during a run (see `perform`).
            if step and step % _COLLECTION_STEPS == 0:
                gc.collect(0)
            # Before the first step, nothing has been sent.
            if step and task.metrics:
                meter.count_positions()
            if watch is not None:
                watch(simulation.observe_and_decide())
            return False  # The run continues.

        record = scenario.run(simulation, on_step=observe_step)
    return record, {"deciding_s": simulation.decision_time, "sent_bytes": meter.bytes}


class CommunicationMeter:
    """Counts the bytes that robots send, whether they are received or not.

    Each robot sends its position at the message rate of the conditions, by default in each control step.
    Controller messages are counted by the simulation.

    Parameters
    ----------
    simulation : Simulation
        The run whose messages are counted.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        rate: float | None = getattr(simulation.conditions, "message_rate", None)
        self._positions_per_step = 1.0 if rate is None else min(1.0, rate * simulation.dt)
        self._position_bytes = 0.0

    def count_positions(self) -> None:
        """Count the positions that the robots sent in the latest step."""
        sender_count = int(self._simulation.is_working.sum())
        self._position_bytes += self._positions_per_step * POSITION_BYTES * sender_count

    @property
    def bytes(self) -> float:
        """Number of bytes so far."""
        return self._position_bytes + self._simulation.sent_bytes


def prepare_cost(task: Task) -> CoverageCost:
    """Return the coverage cost for the map of a task. The costs of the latest maps are kept in memory."""
    team = build_swept_team(task.robots, task.team)
    return _build_cost(task.document, task.map, task.lattice, team.min_radius)


@lru_cache(MAX_CACHED_MAPS)
def _build_cost(document: str, name: str, lattice: int, radius: float) -> CoverageCost:
    return CoverageCost(parse_map(document, name), lattice, radius=radius)
