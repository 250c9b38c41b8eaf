"""Repeated runs: a referee simulates a run and computes its metrics; the controller decides elsewhere.

A referee is the process of one run. It never imports the code of a user: its simulation gets the forces,
goals and messages of the robots from other processes; see `robocov_app.benchmark.verification.isolation`.
Forces must be finite numbers of the right shape, and are limited like those of any controller.
"""

from __future__ import annotations

import subprocess
import tempfile
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from robocov.errors import OutputError
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.verification.controller_messages import Description
from robocov_app.benchmark.verification.controller_process import ControllerProcess
from robocov_app.benchmark.verification.isolation import IsolatedTeam
from robocov_app.jobs.messages import READY, Channel, receive
from robocov_app.jobs.processes import ask_process, end_process, start_process
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import EFFORT_FILE, Outcome, perform


@dataclass(frozen=True, eq=False)
class RepeatedRun:
    """A run to repeat.

    Attributes
    ----------
    task : Task
        The run. Its own controller is ignored.
    code : ControllerCode
        The controller, which only other processes build.
    description : Description
        What the controller declares about itself.
    robots : sequence of int
        Rows of the robots whose decisions are repeated in processes of their own.
    seed : sequence of int
        Seed of the placeholders for other robots; see `robocov_app.benchmark.verification.isolation`.
    cache_folder : Path
        Folder for the machine code that the processes of controllers compile.
    """

    task: Task
    code: ControllerCode
    description: Description
    robots: Sequence[int]
    seed: Sequence[int]
    cache_folder: Path


@dataclass(frozen=True)
class RunCheck:
    """The check of a run: the run is repeated, and so are the decisions of some robots.

    Attributes
    ----------
    outcome : Outcome or None
        Outcome of the repeated run; None if its process ended, or if the referees were killed before it
        started.
    robots : int
        Number of robots with at least one decision that was repeated in a separate process.
    differences : list of str
        Everything that is not as expected, apart from the metrics of the run.
    read_files : list of str
        Files that the controller has read, apart from those of Python and installed packages.
    steps : int
        Number of steps in which the team decided.
    declared_bytes, compressed_bytes : int
        Total size of all messages, as declared and as compressed payloads.
    """

    outcome: Outcome | None
    robots: int
    differences: list[str]
    read_files: list[str] = field(default_factory=list)
    steps: int = 0
    declared_bytes: int = 0
    compressed_bytes: int = 0


class RefereeService:
    """Worker service that repeats one run, and then the decisions of some of its robots."""

    failure_message = "the verification failed"

    def __call__(self, requests: list[RepeatedRun], channel: Channel) -> RunCheck:
        """Repeat a run while another process executes its controller. There is only one request."""
        (run,) = requests
        environment = None
        if run.description.information == "whole map":
            environment = run.task.hide_unknown_density().build_environment().static
        team_process = ControllerProcess(run.cache_folder)
        processes = [team_process]
        with IsolatedTeam(
            run.code,
            team_process,
            run.robots,
            scanning=run.description.scanning,
            environment=environment,
            may_send_messages=run.description.information != "own",
            rng=np.random.default_rng(run.seed),
        ) as isolated_team:
            with team_process:
                outcome = perform(run.task, isolated_team.record_step, isolated_team)
            checked_robots = run.robots
            # If the run failed before the first decision, there is nothing to compare.
            if isolated_team.step_count == 0:
                checked_robots = ()
            for robot in checked_robots:
                # Processes that exist at the same time could measure each other's computing times.
                with ControllerProcess(run.cache_folder) as robot_process:
                    isolated_team.check_robot(robot, robot_process)
                processes.append(robot_process)
        violations = [action for process in processes for action in process.violations]
        read_files = [file for process in processes for file in process.read_files]
        differences = [f"its controller tried {action}" for action in dict.fromkeys(violations)]
        differences += isolated_team.differences
        # Most files of the run are not needed for its row, and are not sent back.
        files = {name: data for name, data in outcome.files.items() if name == EFFORT_FILE}
        return RunCheck(
            replace(outcome, files=files),
            robots=isolated_team.checked_robot_count,
            steps=isolated_team.step_count,
            differences=differences,
            read_files=list(dict.fromkeys(read_files)),
            declared_bytes=isolated_team.declared_bytes,
            compressed_bytes=isolated_team.compressed_bytes,
        )


class Referees:
    """Starts referees that each repeat a single run."""

    def __init__(self) -> None:
        self._processes: set[subprocess.Popen[bytes]] = set()
        self._is_stopped = False
        self._lock = threading.Lock()

    def repeat(self, run: RepeatedRun) -> RunCheck:
        """Let a new process repeat a run, and wait for it. Several threads may call this at once.

        Parameters
        ----------
        run : RepeatedRun
            The run.

        Returns
        -------
        RunCheck

        Raises
        ------
        OutputError
            If the process failed for a reason other than the controller.
        """
        with tempfile.TemporaryFile() as errors:
            with self._lock:
                if self._is_stopped:
                    return RunCheck(outcome=None, robots=0, differences=[])
                process = start_process(f"{__name__}:RefereeService", stderr=errors)
                self._processes.add(process)
            try:
                assert process.stdout is not None
                reply = None
                if receive(process.stdout) == READY:
                    reply = ask_process(process, run)
            finally:
                end_process(process)
                with self._lock:
                    self._processes.discard(process)
        if reply is None:
            return RunCheck(outcome=None, robots=0, differences=["its process ended"])
        if reply.answer is None:
            raise OutputError(f"the run cannot be repeated: {reply.problem}")
        check: RunCheck = reply.answer
        return check

    def kill(self) -> None:
        """Kill all processes, and prevent the start of others."""
        with self._lock:
            self._is_stopped = True
            for process in self._processes:
                process.kill()
