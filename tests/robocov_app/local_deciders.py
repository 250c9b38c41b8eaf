"""Processes of controllers without processes: the same program, called in the process of the test."""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from typing import Any

import numpy as np

from robocov.controllers import get_information, make_controller
from robocov.observation import Decision, DensitySensor, Observations, Scanning, Snapshot
from robocov.typing import FloatArray, IntArray
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.verification.controller_messages import (
    Setup,
    Step,
    decode_decision,
    encode_decision,
)
from robocov_app.benchmark.verification.controller_program import ControllerProgram
from robocov_app.benchmark.verification.isolation import IsolatedTeam
from robocov_app.sweep.tasks import Task
from robocov_app.sweep.worker import Outcome, perform


class LocalDecider:
    """Decides like a `ControllerProcess`, with the same copies of everything that is sent."""

    def __init__(self) -> None:
        self.received: list[Observations] = []

    def begin(self, setup: Setup) -> None:
        self._robot_count = len(setup.team)
        self._program = ControllerProgram(pickle.loads(pickle.dumps(setup)), DensitySensor(self._measure))

    def wait_until_ready(self) -> None:
        pass

    def send_step(self, step: Step) -> None:
        self._step = pickle.loads(pickle.dumps(step))
        self.received.append(self._step.observations)

    def receive_decision(self, measure: Any) -> Decision:
        self._measure_density = measure
        decision = self._program.decide(self._step)
        return decode_decision(encode_decision(decision), self._robot_count)

    def _measure(self, robots: IntArray, points: FloatArray) -> FloatArray:
        return np.asarray(self._measure_density(robots, points))


def run_isolated(
    task: Task, robots: Sequence[int], snapshots: list[Snapshot] | None = None
) -> tuple[Outcome, IsolatedTeam, dict[int, LocalDecider]]:
    """Run a task as a referee does; return the outcome, the team and the deciders of the robots."""
    controller = make_controller(task.controller, task.gains, source=task.source)
    scanning: Scanning | None = getattr(controller, "scanning", None)
    information = get_information(controller)
    environment = None
    if information == "whole map":
        environment = task.hide_unknown_density().build_environment().static
    team = IsolatedTeam(
        ControllerCode(task.controller, task.gains, task.source),
        LocalDecider(),
        robots,
        scanning=scanning,
        environment=environment,
        may_send_messages=information != "own",
        rng=np.random.default_rng(0),
    )

    def watch(snapshot: Snapshot) -> None:
        team.record_step(snapshot)
        if snapshots is not None:
            snapshots.append(snapshot)

    deciders = {robot: LocalDecider() for robot in robots}
    with team:
        outcome = perform(task, watch, team)
        for robot, decider in deciders.items():
            team.check_robot(robot, decider)
    return outcome, team, deciders
