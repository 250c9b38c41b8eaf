"""Failures and joins of robots."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from contextlib import suppress
from numbers import Integral
from typing import Any, NamedTuple, TypeVar

from robocov.errors import ParameterError, format_bound, format_exactly, is_number, quote

MAX_TIME_S = 1e6
"""Latest time of an event."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d{1,3})?"
_EVENT = re.compile(rf"(\d{{1,9}})@({_NUMBER})(?::({_NUMBER}),({_NUMBER}))?", re.ASCII)
"""An event as text: its groups are the robot, the time and, if there is a position, x and y."""


class Failure(NamedTuple):
    """The failure of a robot, which then becomes an obstacle and no longer communicates.

    Attributes
    ----------
    robot : int
        Number of the robot, from 1.
    time : float, s
        Simulation time of the failure.

    See Also
    --------
    Join : The arrival of a robot.
    Conditions : Contains the failures of a run.

    Examples
    --------
    >>> import robocov as rc
    >>> conditions = rc.Conditions(failures=(rc.Failure(robot=2, time=10.0),))
    >>> conditions.find_working_robots(12.0, 3)
    array([ True, False,  True])
    """

    robot: int
    time: float

    def __str__(self) -> str:
        """Return the text from which `parse_event` builds an equal event."""
        return f"{self.robot}@{format_exactly(self.time)}"


class Join(NamedTuple):
    """The arrival of a robot that joins the team.

    Attributes
    ----------
    robot : int
        Number of the robot, from 1.
    time : float, s
        Simulation time of the arrival.
    position : (x, y) or None, m
        Requested position. The robot joins at the nearest position that is free. By default, the position at
        which it would have started.

    See Also
    --------
    Failure : The failure of a robot.
    Conditions : Contains the joins of a run.

    Examples
    --------
    >>> import robocov as rc
    >>> conditions = rc.Conditions(joins=(rc.Join(robot=3, time=5.0, position=(2.0, 1.0)),))
    >>> conditions.find_working_robots(4.0, 3)
    array([ True,  True, False])
    """

    robot: int
    time: float
    position: tuple[float, float] | None = None

    def __str__(self) -> str:
        """Return the text from which `parse_event` builds an equal event."""
        text = f"{self.robot}@{format_exactly(self.time)}"
        if self.position is None:
            return text
        x, y = self.position
        return f"{text}:{format_exactly(x)},{format_exactly(y)}"


class JoinedRobot(NamedTuple):
    """A robot that has joined the team during a run.

    Attributes
    ----------
    robot : int
        Number of the robot, from 1.
    time : float, s
        Simulation time at which it joined.
    position, requested_position : (x, y), m
        Position at which it joined, and the position that was requested.

    See Also
    --------
    Join : Request that a robot joins late.
    """

    robot: int
    time: float
    position: tuple[float, float]
    requested_position: tuple[float, float]

    @property
    def offset(self) -> float:
        """Distance from the requested position, m; above 0 if a wall or another robot was too close to it."""
        return math.dist(self.position, self.requested_position)


Event = TypeVar("Event", bound=Failure | Join)
"""`Failure` or `Join`."""


def parse_event(kind: type[Event], text: str) -> Event:
    """Parse a failure or a join.

    Parameters
    ----------
    kind : Failure or Join
        The class of the event.
    text : str
        ``3@20`` for robot 3 after 20 s; a join may have a position, as in ``5@30:2.5,1``.

    Returns
    -------
    Failure or Join

    Raises
    ------
    ParameterError
        If the text has another form.

    Examples
    --------
    >>> parse_event(Failure, "3@20")
    Failure(robot=3, time=20.0)
    """
    match = _EVENT.fullmatch(text)
    if match is None or (kind is Failure and match[3] is not None):
        form = "ROBOT@SECONDS, as in 3@20" if kind is Failure else "ROBOT@SECONDS or ROBOT@SECONDS:X,Y"
        raise ParameterError(f"expected {form}, got {quote(text)}")
    robot = int(match[1])
    time = float(match[2])
    optional_position = [] if match[3] is None else [(float(match[3]), float(match[4]))]
    return kind(robot, time, *optional_position)


def build_events(name: str, kind: type[Event], values: Iterable[Any]) -> tuple[Event, ...]:
    """Build failures or joins from tuples, sorted by robot.

    Parameters
    ----------
    name : str
        "failures" or "joins", used in error messages.
    kind : Failure or Join
        The class of the events.
    values : iterable of (robot, time) or (robot, time, position)
        The values of each event, as a tuple or list.

    Returns
    -------
    tuple of Failure or Join

    Raises
    ------
    ParameterError
        If the values are not iterable, a value is out of range, or a robot has more than one event.
    """
    if not isinstance(values, Iterable):
        raise ParameterError(f"conditions.{name}: expected a sequence of events, got {quote(values)}")
    events: dict[int, Event] = {}
    for k, value in enumerate(values):
        event = _build_event(f"conditions.{name}[{k}]", kind, value)
        if event.robot in events:
            raise ParameterError(
                f"conditions.{name}[{k}]: expected one event per robot, got robot {event.robot} twice"
            )
        events[event.robot] = event
    return tuple(events[robot] for robot in sorted(events))


def _build_event(path: str, kind: type[Event], value: Any) -> Event:
    """Build a failure or a join from a tuple, and check its values. Messages begin with the path."""
    try:
        robot, time, *optional_position = value
        kind(robot, time, *optional_position)  # Fails if there are too many values.
    except (TypeError, ValueError):
        raise ParameterError(f"{path}: expected a robot and a time, got {quote(value)}") from None
    if not is_number(robot, Integral) or robot < 1:
        raise ParameterError(f"{path}: expected the number of a robot, from 1, got {quote(robot)}")
    if not is_number(time) or not 0.0 <= time <= MAX_TIME_S:
        raise ParameterError(
            f"{path}: expected a time from 0 to {format_bound(MAX_TIME_S)} s, got {quote(time)}"
        )
    checked_position = [
        None if position is None else _check_position(path, position) for position in optional_position
    ]
    return kind(int(robot), float(time), *checked_position)


def _check_position(path: str, value: Any) -> tuple[float, float]:
    """Return a position as two floats; raise a ParameterError if it is not a pair of finite numbers."""
    # A value that is not a pair leads to the error below.
    with suppress(TypeError, ValueError):
        x, y = value
        if all(is_number(coordinate) and math.isfinite(coordinate) for coordinate in (x, y)):
            return float(x), float(y)
    raise ParameterError(f"{path}: expected a position [x, y] in meters, got {quote(value)}")
