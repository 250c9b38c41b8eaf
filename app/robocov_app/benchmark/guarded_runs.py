"""Runs and replays in guarded processes: the worker service, and the processes that execute it."""

from __future__ import annotations

import subprocess
import tempfile
import threading
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from robocov.controllers import inform_controller, make_controller
from robocov.controllers.individual import IndividualControllerAdapter
from robocov.controllers.registry import load_controller_class
from robocov.controllers.user_modules import explain_fault, provide_modules
from robocov.errors import OutputError, RobocovError
from robocov_app.benchmark.guard import Guard
from robocov_app.benchmark.isolation import Decisions, Replay, Transcript
from robocov_app.jobs.messages import READY, Channel, receive
from robocov_app.jobs.processes import ask_process, end_process, start_process
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import EFFORT_FILE, Outcome, perform


@dataclass(frozen=True, eq=False)
class ObservedRun:
    """A run that was repeated in a guarded process.

    Attributes
    ----------
    outcome : Outcome
        Result of the run, with the files that are needed for its row.
    transcript : Transcript
        Observations and decisions of all steps.
    violations : list of str
        Forbidden actions that the controller attempted.
    """

    outcome: Outcome
    transcript: Transcript
    violations: list[str]


@dataclass(frozen=True, eq=False)
class ReplayAnswer:
    """The answer to a replay.

    Attributes
    ----------
    decisions : Decisions
        The controller's decision for each observation of the replay.
    violations : list of str
        Forbidden actions that the controller attempted.
    """

    decisions: Decisions
    violations: list[str]


Answer: TypeAlias = ObservedRun | ReplayAnswer | None
"""The answer of a guarded process; None if it ended without one."""


class GuardedService:
    """Worker service that executes one run or one replay under a guard."""

    failure_message = "the verification failed"

    def __call__(self, questions: list[Task | Replay], channel: Channel) -> ObservedRun | ReplayAnswer:
        """Execute a task and record it, or call the controller for the observations of a replay."""
        # A guarded process gets a single question, see `GuardedProcesses`.
        question = questions[-1]
        task = question if isinstance(question, Task) else question.task
        guard = Guard(_list_modules(task))
        guard.install()
        if isinstance(question, Task):
            transcript = Transcript()
            # Most files of the run are not needed for its row, and are not sent back.
            outcome = perform(question, transcript.add)
            return ObservedRun(replace(outcome, files=_select_files(outcome)), transcript, guard.violations)
        decisions = _decide_again(question)
        return ReplayAnswer(decisions, guard.violations)


def _list_modules(task: Task) -> set[str]:
    """Return the names of the modules that belong to a controller outside robocov."""
    if task.source is not None:
        return set(task.source.modules)
    package = load_controller_class(task.controller).__module__.partition(".")[0]
    return {package} - {"robocov", "robocov_app"}


def _select_files(outcome: Outcome) -> dict[str, bytes]:
    """Return the files of a run that are needed for its row in a result."""
    return {name: data for name, data in outcome.files.items() if name == EFFORT_FILE}


def _decide_again(replay: Replay) -> Decisions:
    """Call the controller for each observation of a replay; return its decisions, and the error if any."""
    task = replay.task
    decisions = Decisions()
    with provide_modules({} if task.source is None else task.source.modules):
        try:
            for decision in _generate_decisions(replay):
                decisions.forces.append(np.asarray(decision.forces, dtype=np.float64).copy())
                goals = decision.goals
                decisions.goals.append(None if goals is None else np.asarray(goals, dtype=np.float64).copy())
                decisions.messages.append(deepcopy(decision.messages))
        except RobocovError as error:
            return replace(decisions, problem=str(error))
        except BaseException as error:  # A controller of the user may raise anything.
            fault = explain_fault(f"controller {task.controller!r}", error)
            return replace(decisions, problem=str(fault))
    return decisions


def _generate_decisions(replay: Replay) -> Iterator[Any]:
    """Create the controller of a replay, and yield its decision for each observation."""
    task = replay.task
    controller: Any = make_controller(task.controller, task.gains, source=task.source)
    if replay.environment is not None:
        controller = inform_controller(controller, replay.environment)
    region = replay.observations[0].region
    memory = controller.begin(region, task.build_scenario().team)
    is_individual = isinstance(controller, IndividualControllerAdapter)
    for observations in replay.observations:
        if is_individual and replay.robot is not None:
            # The observations of other robots are placeholders, so the controller is not called for them.
            decision = controller.decide(observations, memory, [replay.robot])
        else:
            decision = controller.decide(observations, memory)
        memory = decision.memory
        yield decision


class GuardedProcesses:
    """Starts guarded processes that each answer a single question and receive nothing else."""

    def __init__(self) -> None:
        self._processes: set[subprocess.Popen[bytes]] = set()
        self._is_stopped = False
        self._lock = threading.Lock()

    def ask(self, question: Task | Replay) -> Answer:
        """Send a question to a new process, and wait for its answer. Several threads may call this at once.

        Parameters
        ----------
        question : Task or Replay
            A run to repeat, or observations for which the controller decides again.

        Returns
        -------
        Answer
            None if the process ended without an answer.

        Raises
        ------
        OutputError
            If the service failed for a reason other than the controller.
        """
        with tempfile.TemporaryFile() as errors:
            with self._lock:
                if self._is_stopped:
                    return None
                process = start_process(f"{__name__}:GuardedService", stderr=errors)
                self._processes.add(process)
            try:
                assert process.stdout is not None
                if receive(process.stdout) != READY:
                    return None
                reply = ask_process(process, question)
            finally:
                end_process(process)
                with self._lock:
                    self._processes.discard(process)
        if reply is not None and reply.answer is None:
            raise OutputError(f"the run cannot be repeated: {reply.problem}")
        return None if reply is None else reply.answer

    def kill(self) -> None:
        """Kill all processes, and prevent the start of others."""
        with self._lock:
            self._is_stopped = True
            for process in self._processes:
                process.kill()
