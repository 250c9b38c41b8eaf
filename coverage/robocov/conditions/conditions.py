"""The conditions of a run: noise, message loss, latency, and robots that fail or join."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from robocov.conditions.events import MAX_TIME_S, Failure, Join, build_events
from robocov.conditions.random_streams import FAILURE_STREAM, create_generator
from robocov.errors import ParameterError, quote, require_number, require_whole_number
from robocov.typing import BoolArray, FloatArray

TIME_TOLERANCE_S = 1e-9
"""Maximum difference between two times that count as equal: sums of steps have rounding errors."""

_FORMER_POSITION_KEY = "place_m"
"""Key of the position of a robot that joins in files of earlier versions."""

DensityKnowledge: TypeAlias = Literal["known", "sensed"]
"""Whether robots know the density φ from the start, or have to measure it within their sensing range."""


class ConditionParameter(NamedTuple):
    """Range and unit of a condition that is a number, and its name in files.

    Attributes
    ----------
    minimum, maximum : float
        Range of values.
    unit : str
        Unit of the values, as it appears in messages; empty for numbers without unit.
    json_key : str
        Name in ``run.json``, with the unit.
    may_be_null : bool
        Whether the value may be None, which means no limit.
    """

    minimum: float
    maximum: float
    unit: str
    json_key: str
    may_be_null: bool = False


PARAMETERS: dict[str, ConditionParameter] = {
    "loss": ConditionParameter(0.0, 1.0, "", "loss"),
    "delay": ConditionParameter(0.0, 1e3, "s", "delay_s"),
    "message_rate": ConditionParameter(1e-3, 1e4, "Hz", "message_rate_hz", may_be_null=True),
    "bandwidth": ConditionParameter(1.0, 1e12, "B/s", "bandwidth_bytes_per_s", may_be_null=True),
    "forget_after": ConditionParameter(1e-3, MAX_TIME_S, "s", "forget_after_s"),
    "position_noise": ConditionParameter(0.0, 1e3, "m", "position_noise_m"),
    "sensing_noise": ConditionParameter(0.0, 1e3, "m", "sensing_noise_m"),
    "failure_rate": ConditionParameter(0.0, 1e3, "1/s", "failure_rate_per_s"),
}
"""The conditions that are numbers, by name."""
UNITS = {name: parameter.unit for name, parameter in PARAMETERS.items()}
"""Units of the conditions that are numbers."""


@dataclass(frozen=True)
class Conditions:
    """Imperfections and changes during a run, with the seed of their random numbers.

    Communication is ideal unless there is message loss, a delay, a message rate, a bandwidth or localization
    noise. When a robot fails, the others forget it at once if communication is ideal, and otherwise after
    `forget_after`.

    Attributes
    ----------
    loss : float
        Probability that a message does not reach a receiver. A controller message that is sent in several
        packets is lost if any of them is lost; see `robocov.conditions.communication`.
    delay : float, s
        Latency of messages.
    message_rate : float or None, Hz
        Rate at which robots broadcast their positions and other messages. None: in every control step.
    bandwidth : float or None, B/s
        Bytes per second that each robot can send. Messages beyond that wait in a queue. None: unlimited.
    forget_after : float, s
        Time without a message from a robot after which the others forget its position.
    position_noise : float, m
        Standard deviation of the localization noise in x and in y, white over the control steps. A robot acts
        on the noisy position and broadcasts it; the physics continues from the true one.
    sensing_noise : float, m
        Standard deviation of the noise of the range sensor.
    failure_rate : float, 1/s
        Rate of random failures of each working robot. Lifetimes are exponentially distributed.
    failures : tuple of Failure
        Robots that fail at a given time, at most once each; also accepted as ``(robot, time)``.
    joins : tuple of Join
        Robots that join during the run, at most once each; also accepted as ``(robot, time)`` or
        ``(robot, time, position)``.
    density : str
        "known": all robots know the density of the map. "sensed": they do not know it, and can only measure
        it within their sensing range, see `Observations.measure_density`. The map that a controller with the
        information "whole map" receives has no density then.
    seed : int
        Seed of the random numbers.

    Raises
    ------
    ParameterError
        If a value is out of range. The message names it.

    See Also
    --------
    Failure : The failure of a robot.
    Join : The arrival of a robot.

    Examples
    --------
    >>> import robocov as rc
    >>> conditions = rc.Conditions(failures=((2, 10.0),))
    >>> conditions.find_working_robots(12.0, 3)
    array([ True, False,  True])
    """

    loss: float = 0.0
    delay: float = 0.0
    message_rate: float | None = None
    bandwidth: float | None = None
    forget_after: float = 3.0
    position_noise: float = 0.0
    sensing_noise: float = 0.0
    failure_rate: float = 0.0
    failures: tuple[Failure, ...] = ()
    joins: tuple[Join, ...] = ()
    seed: int = 0
    density: DensityKnowledge = "known"

    def __post_init__(self) -> None:
        for name, parameter in PARAMETERS.items():
            value = getattr(self, name)
            if value is None and parameter.may_be_null:
                continue
            unit = f"{parameter.unit} or null" if parameter.may_be_null else parameter.unit
            number = require_number(f"conditions.{name}", value, parameter.minimum, parameter.maximum, unit)
            object.__setattr__(self, name, number)
        object.__setattr__(self, "failures", build_events("failures", Failure, self.failures))
        object.__setattr__(self, "joins", build_events("joins", Join, self.joins))
        require_whole_number("conditions.seed", self.seed, 0)
        if self.density not in get_args(DensityKnowledge):
            raise ParameterError(f"conditions.density: expected known or sensed, got {quote(self.density)}")
        self._check_forget_after()
        self._check_event_order()

    def _check_forget_after(self) -> None:
        """Raise an error if a robot would be forgotten before its next message is due."""
        if self.message_rate is not None and self.forget_after * self.message_rate < 1.0:
            period = 1.0 / self.message_rate
            raise ParameterError(
                f"conditions.forget_after: expected at least {period:g} s, the time between two messages, "
                f"got {self.forget_after:g} s"
            )

    def _check_event_order(self) -> None:
        """Raise an error if a robot joins after it has failed."""
        failure_times = {failure.robot: failure.time for failure in self.failures}
        for k, join in enumerate(self.joins):
            failure_time = failure_times.get(join.robot, math.inf)
            if failure_time <= join.time:
                raise ParameterError(
                    f"conditions.joins[{k}]: expected robot {join.robot} to join before it fails at "
                    f"{failure_time:g} s, got {join.time:g} s"
                )

    @property
    def is_ideal(self) -> bool:
        """Whether these conditions have no effect."""
        is_exact = not (self.uses_messages or self.sensing_noise or self.hides_density)
        return is_exact and not self.has_team_changes

    @property
    def uses_messages(self) -> bool:
        """Whether robots know each other's positions only from messages."""
        is_limited = self.message_rate is not None or self.bandwidth is not None
        return bool(self.loss or self.delay or is_limited or self.position_noise)

    @property
    def hides_density(self) -> bool:
        """Whether robots have to measure the density, because they do not know it."""
        return self.density == "sensed"

    @property
    def has_team_changes(self) -> bool:
        """Whether robots may fail or join."""
        return bool(self.failure_rate or self.failures or self.joins)

    def drop_team_changes(self) -> Conditions | None:
        """Return the conditions without failures and joins.

        Returns
        -------
        Conditions or None
            None if the remaining conditions are ideal.
        """
        remaining = replace(self, failure_rate=0.0, failures=(), joins=())
        return None if remaining.is_ideal else remaining

    def advance(self, time: float, robot_count: int) -> Conditions:
        """Return the conditions for a run that continues another run from a given time.

        Parameters
        ----------
        time : float, s
            Time since the beginning of the other run.
        robot_count : int
            Number of robots of the team.

        Returns
        -------
        Conditions
            Earlier failures happen at the start, and random failures at the times at which they would have
            happened. Robots that had joined are present from the start.
        """
        _, failure_times = self.compute_working_periods(robot_count)
        failures = [
            Failure(robot, max(failure_time - time, 0.0))
            for robot, failure_time in enumerate(failure_times.tolist(), start=1)
            if failure_time - time <= MAX_TIME_S
        ]
        joins = [
            Join(join.robot, join.time - time, join.position)
            for join in self.joins
            if join.time > time + TIME_TOLERANCE_S
        ]
        return replace(self, failure_rate=0.0, failures=tuple(failures), joins=tuple(joins))

    def check_team(self, robot_count: int) -> None:
        """Check that the failures and joins are possible in a team.

        Parameters
        ----------
        robot_count : int
            Number of robots of the team.

        Raises
        ------
        ParameterError
            If a robot that fails or joins is not in the team, or no robot is present from the start.
        """
        robots_by_event = {
            "failures": [failure.robot for failure in self.failures],
            "joins": [join.robot for join in self.joins],
        }
        for name, robots in robots_by_event.items():
            for k, robot in enumerate(robots):
                if robot > robot_count:
                    raise ParameterError(
                        f"conditions.{name}[{k}]: expected a robot from 1 to {robot_count}, got robot {robot}"
                    )
        if len(self.joins) == robot_count and min(join.time for join in self.joins) > 0.0:
            raise ParameterError(
                "conditions.joins: expected at least one robot from the start, got all robots joining later"
            )

    def compute_working_periods(self, robot_count: int) -> tuple[FloatArray, FloatArray]:
        """Compute the times at which each robot starts and stops working.

        Parameters
        ----------
        robot_count : int
            Number of robots n.

        Returns
        -------
        starts, stops : (n,) arrays, s
            `starts` is -inf for robots that are present from the start; `stops` is inf for robots that do not
            fail.
        """
        starts = np.full(robot_count, -np.inf)
        stops = np.full(robot_count, np.inf)
        for join in self.joins:
            starts[join.robot - 1] = join.time
        if self.failure_rate:
            rng = create_generator(self.seed, FAILURE_STREAM)
            stops = np.maximum(starts, 0.0) + rng.exponential(1.0 / self.failure_rate, size=robot_count)
        for failure in self.failures:
            stops[failure.robot - 1] = min(stops[failure.robot - 1], failure.time)
        return starts, stops

    def find_working_robots(self, time: float | FloatArray, robot_count: int) -> BoolArray:
        """Find the robots that are present and have not failed.

        Parameters
        ----------
        time : float or (k,) array, s
            Simulation time, or several.
        robot_count : int
            Number of robots n.

        Returns
        -------
        (n,) or (k, n) bool array
            Mask of the robots, at each time.
        """
        return self.find_present_robots(time, robot_count) & ~self.find_failed_robots(time, robot_count)

    def find_failed_robots(self, time: float | FloatArray, robot_count: int) -> BoolArray:
        """Find the robots that have failed.

        Parameters
        ----------
        time : float or (k,) array, s
            Simulation time, or several.
        robot_count : int
            Number of robots n.

        Returns
        -------
        (n,) or (k, n) bool array
            Mask of the robots, at each time.
        """
        _, stops = self.compute_working_periods(robot_count)
        # The last axis is that of the robots.
        return np.asarray(stops <= np.asarray(time)[..., None] + TIME_TOLERANCE_S)

    def find_present_robots(self, time: float | FloatArray, robot_count: int) -> BoolArray:
        """Find the robots that have joined the team, including those that have failed since.

        Parameters
        ----------
        time : float or (k,) array, s
            Simulation time, or several.
        robot_count : int
            Number of robots n.

        Returns
        -------
        (n,) or (k, n) bool array
            Mask of the robots, at each time.
        """
        starts, _ = self.compute_working_periods(robot_count)
        # The last axis is that of the robots.
        return np.asarray(starts <= np.asarray(time)[..., None] + TIME_TOLERANCE_S)

    def to_dict(self) -> dict[str, Any]:
        """Return the conditions as a JSON object, whose keys contain the units.

        Returns
        -------
        dict
        """
        document: dict[str, Any] = {
            parameter.json_key: getattr(self, name) for name, parameter in PARAMETERS.items()
        }
        if self.bandwidth is None:
            # Files that were written before there was a bandwidth stay the same when they are written again.
            del document[PARAMETERS["bandwidth"].json_key]
        document["failures"] = [{"robot": failure.robot, "time_s": failure.time} for failure in self.failures]
        document["joins"] = [
            {
                "robot": join.robot,
                "time_s": join.time,
                "position_m": None if join.position is None else list(join.position),
            }
            for join in self.joins
        ]
        document["seed"] = int(self.seed)
        if self.hides_density:
            document["density"] = self.density
        return document

    @classmethod
    def from_dict(cls, document: Mapping[str, Any]) -> Conditions:
        """Build conditions from the result of `to_dict`.

        Parameters
        ----------
        document : mapping
            JSON object in the format of `to_dict`.

        Returns
        -------
        Conditions

        Raises
        ------
        ParameterError
            If a key is missing or a value is invalid.
        """
        try:
            # Files of earlier versions have no bandwidth.
            document = {PARAMETERS["bandwidth"].json_key: None, **document}
            numbers = {name: document[parameter.json_key] for name, parameter in PARAMETERS.items()}
            failures = [(failure["robot"], failure["time_s"]) for failure in document["failures"]]
            joins = [(join["robot"], join["time_s"], _read_position(join)) for join in document["joins"]]
            arguments: dict[str, Any] = {**numbers, "failures": failures, "joins": joins}
            density = document.get("density", "known")
            return cls(**arguments, seed=document["seed"], density=density)
        except KeyError as error:
            raise ParameterError(f"conditions: missing key {error}") from error
        except TypeError as error:
            raise ParameterError(f"conditions: cannot be read: {error}") from error

    def __repr__(self) -> str:
        arguments = []
        for parameter in fields(self):
            value = getattr(self, parameter.name)
            if repr(value) != repr(parameter.default):
                arguments.append(f"{parameter.name}={value!r}")
        return f"Conditions({', '.join(arguments)})"


def _read_position(join: Mapping[str, Any]) -> Any:
    """Return the requested position of a robot that joins, from a JSON object; None for its start."""
    if _FORMER_POSITION_KEY in join:
        return join[_FORMER_POSITION_KEY]
    return join["position_m"]
