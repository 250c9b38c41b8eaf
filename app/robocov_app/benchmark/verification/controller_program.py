"""The program of a process in which a controller decides during a verification.

It receives the observations of one robot, or those of the whole team, step by step, and answers with forces,
goals and messages. It never has the observations of later steps, the simulation or its metrics, and it has
the map only if the controller declares the information "whole map". So there is nothing here that the code of
a controller could look up or change.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from importlib.metadata import entry_points
from typing import Any, BinaryIO

import numpy as np

from robocov.controllers import make_controller
from robocov.controllers.base import Controller
from robocov.controllers.individual import (
    IndividualControllerAdapter,
    IndividualMemories,
)
from robocov.controllers.registry import ENTRY_POINT_GROUP
from robocov.controllers.user_modules import provide_modules
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError
from robocov.observation import Decision, DensitySensor, Observations, ReceivedMessage
from robocov.simulation.controller_caller import ControllerCaller
from robocov.typing import FloatArray, IntArray
from robocov_app.benchmark.controller_code import ControllerCode
from robocov_app.benchmark.verification.controller_messages import (
    ANSWER,
    FAULT,
    MAX_TEXT_CHARS,
    MEASURE,
    READING,
    VIOLATION,
    Setup,
    Step,
    decode_payload,
    describe,
    encode_decision,
)
from robocov_app.benchmark.verification.guard import install_guard
from robocov_app.jobs.messages import receive, send
from robocov_app.jobs.serving import prepare_process, take_standard_streams


class ControllerProgram:
    """Calls a controller for one robot or for a team, with the observations that it receives.

    Parameters
    ----------
    setup : Setup
        The controller, and what it knows before the first step.
    sensor : DensitySensor or None
        Sensor for a density that robots do not know. None if robots never measure the density.

    Raises
    ------
    RobocovError
        If the controller cannot be built, or fails at the start.
    """

    def __init__(self, setup: Setup, sensor: DensitySensor | None = None) -> None:
        self._region = setup.region
        self._density: Any = None
        self._sensor = sensor
        # Robots that do not know the map know at least the region.
        outline = tuple((float(x), float(y)) for x, y in setup.region.vertices)
        environment = setup.environment or Environment("unknown map", outline)
        self._caller = ControllerCaller(_build_controller(setup), environment, time=0.0)
        self._memory = self._caller.begin(setup.region, setup.team, time=0.0)

    def decide(self, step: Step) -> Decision:
        """Return the decision of the controller for a step."""
        if step.is_new_density:
            self._density = step.observations.density
        observations = replace(
            step.observations,
            region=self._region,
            density=self._density,
            density_sensor=self._sensor if step.has_sensor else None,
            messages=_decode_messages(step.observations),
        )
        decision = self._caller.decide(observations, self._memory)
        self._memory = decision.memory
        return decision


class _SingleRobotAdapter(IndividualControllerAdapter):
    """Calls an individual controller for one robot only, because the rows of others are placeholders."""

    def __init__(self, adapter: IndividualControllerAdapter, robot: int) -> None:
        super().__init__(adapter.controller)
        self._robot = robot

    def decide(
        self, seen: Observations, memory: IndividualMemories | None, robots: Iterable[int] | None = None
    ) -> Decision:
        """Return the decision of this robot; `robots` is ignored."""
        return super().decide(seen, memory, [self._robot])


def _build_controller(setup: Setup) -> Controller:
    """Build the controller.

    An individual controller is called only for the robot of this process, if the process has one.
    """
    code = setup.code
    controller = make_controller(code.name, code.gains, source=code.source)
    if setup.robot is not None and isinstance(controller, IndividualControllerAdapter):
        return _SingleRobotAdapter(controller, setup.robot)
    return controller


def _decode_messages(observations: Observations) -> list[list[ReceivedMessage]]:
    """Return the received messages with their payloads. A message to several robots is decoded once."""
    payloads: dict[int, Any] = {}
    messages = []
    for received in observations.messages:
        decoded = []
        for sender, data in received:
            if id(data) not in payloads:
                payloads[id(data)] = decode_payload(data)
            decoded.append(ReceivedMessage(sender, payloads[id(data)]))
        messages.append(decoded)
    return messages


class _Connection:
    """The pipes of this process, to and from the verification."""

    def __init__(self, source: BinaryIO, target: BinaryIO) -> None:
        self._source = source
        self._target = target

    def receive(self) -> Any:
        """Wait for the next message; None if there will be none."""
        return receive(self._source)

    def send_text(self, kind: str, text: str) -> None:
        """Send text, cut to the length that the verification accepts."""
        self.send(kind, " ".join(text.split())[:MAX_TEXT_CHARS])

    def send(self, kind: str, *values: Any) -> None:
        """Send a message of plain values, unless the verification has ended."""
        with suppress(OSError):
            send(self._target, (kind, *values))

    def measure(self, robots: IntArray, points: FloatArray) -> FloatArray:
        """Let the verification measure the density; the function of a `DensitySensor`."""
        self.send(MEASURE, robots.tolist(), points.tobytes())
        values = self.receive()
        if isinstance(values, str):
            raise ParameterError(values)
        return np.asarray(values)


def run_controller_program() -> None:
    """Answer the messages of a verification until the standard input is closed."""
    prepare_process()
    connection = _Connection(*take_standard_streams())
    request = connection.receive()
    if request is None:
        return
    code = request if isinstance(request, ControllerCode) else request.code
    modules = {} if code.source is None else code.source.modules
    install_guard(
        lambda action: connection.send_text(VIOLATION, action),
        lambda path: connection.send(READING, path[:MAX_TEXT_CHARS]),
        _list_own_modules(code),
        _list_own_files(code),
    )
    with provide_modules(modules):
        try:
            if isinstance(request, ControllerCode):
                connection.send(ANSWER, describe(code))
            else:
                _decide_steps(request, connection)
        except BaseException as error:  # A controller of the user may raise anything.
            message = str(error) if isinstance(error, RobocovError) else f"{type(error).__name__}: {error}"
            connection.send_text(FAULT, message)


def _list_own_modules(code: ControllerCode) -> set[str]:
    """Return the names of the modules and packages that belong to a controller outside robocov."""
    if code.source is not None:
        return set(code.source.modules)
    entries = entry_points(group=ENTRY_POINT_GROUP, name=code.name)
    return {entry.module for entry in entries}


def _list_own_files(code: ControllerCode) -> set[str]:
    """Return the paths of the source files of a controller in a file of the user."""
    if code.source is None:
        return set()
    return {code.source.path, *[module.path for module in code.source.modules.values() if module.path]}


def _decide_steps(setup: Setup, connection: _Connection) -> None:
    """Call the controller for each step that arrives."""
    program = ControllerProgram(setup, DensitySensor(connection.measure))
    connection.send(ANSWER, None)
    while (step := connection.receive()) is not None:
        connection.send(ANSWER, encode_decision(program.decide(step)))
