"""Messages that robots send each other, in addition to their positions.

A controller returns the messages of each robot with its decision. They are broadcast to all robots in
communication range at the end of the step, and arrive with the observations of a later step. Range, delay,
loss, rate and bandwidth are those of the conditions; see `robocov.conditions.communication`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import Any, NamedTuple

from robocov.errors import ParameterError, is_number, quote

HEADER_BYTES = 4
"""Size of the index of the sender, at the start of a message."""
MAX_MESSAGE_BYTES = 10**9
"""Maximum size of a message."""


@dataclass(frozen=True, slots=True, eq=False)
class Message:
    """A message of a robot to all robots in communication range.

    Parameters
    ----------
    payload : object
        The content. It must not be changed after the message has been sent.
    size : int, bytes
        Size of the payload when encoded. It determines how long the transmission takes, and how likely
        the message is lost.

    Raises
    ------
    ParameterError
        If the size is not a whole number from 1 to `MAX_MESSAGE_BYTES`.

    See Also
    --------
    Decision : Contains the messages of each robot.
    Observations : Contains the messages that have arrived.

    Examples
    --------
    >>> Message([1.5, 2.0], size=16)
    Message(payload=[1.5, 2.0], size=16)
    """

    payload: Any
    size: int

    def __post_init__(self) -> None:
        if not is_number(self.size, Integral) or not 1 <= self.size <= MAX_MESSAGE_BYTES:
            raise ParameterError(
                f"message: size: expected a whole number of bytes from 1 to {MAX_MESSAGE_BYTES}, "
                f"got {quote(self.size)}"
            )


class ReceivedMessage(NamedTuple):
    """A message that has arrived.

    Attributes
    ----------
    sender : int
        Index of the robot that sent it, from 0.
    payload : object
        The content.
    """

    sender: int
    payload: Any


def check_messages(messages: Any, robot_count: int, subject: str) -> Sequence[Sequence[Message]]:
    """Check the messages of a decision, and return them unchanged.

    Parameters
    ----------
    messages : object
        The messages that a controller returned.
    robot_count : int
        Number of robots.
    subject : str
        First words of an error, such as "controller 'x' returned messages".

    Returns
    -------
    sequence of sequence of Message
        The messages of each robot; empty if no robot sends any.

    Raises
    ------
    ParameterError
        If they are not a sequence of messages for each robot.
    """
    if not isinstance(messages, Sequence) or len(messages) not in (0, robot_count):
        raise ParameterError(f"{subject} {quote(messages)}, expected a list of messages for each robot")
    for robot, robot_messages in enumerate(messages):
        if not _is_message_list(robot_messages):
            raise ParameterError(
                f"{subject} {quote(robot_messages)} for robot {robot + 1}, expected a list of Message"
            )
    return messages


def _is_message_list(value: object) -> bool:
    return isinstance(value, Sequence) and all(isinstance(item, Message) for item in value)
