"""Messages between a verification and the processes in which a controller decides.

The code of a user may send anything. From such a process, the verification therefore accepts only plain
values: numbers, strings, bytes, and containers of these. Unpickling any other object would execute code that
the process chooses.

The verification does not look into what robots send each other, either: payloads are bytes for it, which only
the processes of the controller unpickle.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import IO, Any

import numpy as np

from robocov.controllers import get_information, make_controller
from robocov.controllers.base import Information
from robocov.controllers.gains import Value, get_gain_values
from robocov.controllers.individual import unwrap_controller
from robocov.environment import Environment
from robocov.errors import RobocovError, format_count
from robocov.observation import Decision, Message, Observations, Scanning
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import FloatArray
from robocov_app.benchmark.controller_code import ControllerCode

ANSWER = "answer"
"""Kind of a message from a process: the answer to a request."""
FAULT = "fault"
"""Kind of a message from a process: the error of its controller."""
MEASURE = "measure"
"""Kind of a message from a process: points at which robots measure the density."""
READING = "reading"
"""Kind of a message from a process: a file that the controller has read."""
VIOLATION = "violation"
"""Kind of a message from a process: a forbidden action of its controller."""
MAX_TEXT_CHARS = 4096
"""Maximum length of text accepted from a process, such as an error or a path. No path on Linux is longer."""
KEPT: Any = None
"""Value in place of the region or the density in a `Step` if the process already has it."""
_PAYLOAD_PROTOCOL = 4
"""Version of the pickle format. Since version 5, the bytes of an array depend on whether it is read-only."""


class DamagedMessageError(RobocovError):
    """A process has sent something other than the expected plain values."""


@dataclass(frozen=True)
class Description:
    """The answer to a `ControllerCode`: what a controller declares about itself.

    Attributes
    ----------
    label : str
        Name in figures.
    information : Information
        Information that it uses.
    gains : mapping of str to float, str or None
        All gains.
    scanning : Scanning or None
        Settings of the range scans that it needs.
    """

    label: str
    information: Information
    gains: Mapping[str, Value]
    scanning: Scanning | None


@dataclass(frozen=True, eq=False)
class Setup:
    """Everything that a process receives before the first step.

    Attributes
    ----------
    code : ControllerCode
        The controller.
    robot : int or None
        Row of the robot for which the process decides; None for the whole team.
    environment : Environment or None
        The map, if the controller may know it.
    region : Region
        The known outer boundary.
    team : Team
        The robots.
    """

    code: ControllerCode
    robot: int | None
    environment: Environment | None
    region: Region
    team: Team


@dataclass(frozen=True, eq=False)
class Step:
    """The observations of one step.

    Attributes
    ----------
    observations : Observations
        The observations. Their region is `KEPT`, and so is their density unless it has changed. The payloads
        of messages are bytes, and there is no density sensor.
    is_new_density : bool
        Whether the observations contain the density.
    has_sensor : bool
        Whether robots measure the density.
    """

    observations: Observations
    is_new_density: bool
    has_sensor: bool


class StepEncoder:
    """Prepares the observations of one step after the other for a process."""

    def __init__(self) -> None:
        self._density: Any = None

    def encode(self, observations: Observations) -> Step:
        """Return what is sent to the process, without what it already has or must not have."""
        is_new_density = observations.density is not self._density
        self._density = observations.density
        sent = replace(
            observations,
            region=KEPT,
            density=observations.density if is_new_density else KEPT,
            density_sensor=None,
        )
        return Step(sent, is_new_density, has_sensor=observations.density_sensor is not None)


class _PlainUnpickler(pickle.Unpickler):
    """Unpickles plain values only."""

    def find_class(self, module: str, name: str) -> Any:
        """Reject every class and function, because plain values need none."""
        raise pickle.UnpicklingError(f"{module}.{name}: expected plain values")


def receive_plain(stream: IO[bytes]) -> Any:
    """Read a message of plain values.

    Parameters
    ----------
    stream : binary file
        Output of a process that executes the code of a user.

    Returns
    -------
    object

    Raises
    ------
    EOFError
        If the stream ends.
    DamagedMessageError
        If the message contains anything other than plain values.
    """
    try:
        return _PlainUnpickler(stream).load()
    except EOFError:
        raise
    except Exception as error:  # Damaged messages raise errors of many classes.
        raise DamagedMessageError(f"its process sent an invalid message: {error}") from None


def describe(code: ControllerCode) -> dict[str, Any]:
    """Return what a controller declares about itself as plain values. This executes its code."""
    controller = make_controller(code.name, code.gains, source=code.source)
    own_controller = unwrap_controller(controller)
    scanning = getattr(controller, "scanning", None)
    return {
        "label": str(getattr(own_controller, "label", type(own_controller).__name__)),
        "information": get_information(controller),
        "gains": dict(get_gain_values(own_controller)),
        "scanning": None if scanning is None else (int(scanning.rays), float(scanning.period)),
    }


def encode_payload(payload: Any) -> bytes:
    """Pickle the payload of a message; equal payloads have equal bytes, in any process."""
    buffer = io.BytesIO()
    pickler = pickle.Pickler(buffer, _PAYLOAD_PROTOCOL)
    # Otherwise, the bytes would depend on which of several equal parts are the same object.
    pickler.fast = True
    pickler.dump(payload)
    return buffer.getvalue()


def decode_payload(data: bytes) -> Any:
    """Unpickle the payload of a message. Only processes that execute the controller may do this."""
    return pickle.loads(data)


def encode_decision(decision: Decision) -> tuple[Any, ...]:
    """Convert a decision to plain values: forces, goals, and the messages of each robot."""
    goals = None if decision.goals is None else decision.goals.tobytes()
    messages = [
        [(int(message.size), encode_payload(message.payload)) for message in robot_messages]
        for robot_messages in decision.messages
    ]
    return decision.forces.tobytes(), goals, messages


def decode_decision(values: Any, robot_count: int) -> Decision:
    """Convert plain values to a decision, in which the payloads of messages are bytes.

    Parameters
    ----------
    values : object
        As `encode_decision` returns them, or anything else.
    robot_count : int
        Number of robots.

    Returns
    -------
    Decision

    Raises
    ------
    DamagedMessageError
        If the values are not a decision for this number of robots.
    """
    try:
        forces, goals, messages = values
        if not isinstance(messages, list) or len(messages) not in (0, robot_count):
            raise TypeError(f"expected a list of messages for each of {format_count(robot_count, 'robot')}")
        decoded_messages = [
            [_decode_message(size, payload) for size, payload in robot_messages]
            for robot_messages in messages
        ]
        return Decision(
            forces=_decode_rows(forces, robot_count),
            goals=None if goals is None else _decode_rows(goals, robot_count),
            messages=decoded_messages,
        )
    except (TypeError, ValueError, RobocovError) as error:
        raise DamagedMessageError(f"its process sent an invalid decision: {error}") from None


def _decode_rows(data: Any, robot_count: int) -> FloatArray:
    return np.frombuffer(data, dtype=np.float64).reshape(robot_count, 2)


def _decode_message(size: Any, payload: Any) -> Message:
    if not isinstance(payload, bytes):
        raise TypeError(f"expected a payload of bytes, got {type(payload).__name__}")
    return Message(payload, size)
