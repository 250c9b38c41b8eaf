"""Messages of robots that learn a density together.

Depending on the controller, a robot sends one of the following to its neighbors in each learning period, as
far as the conditions of the communication allow:

- *Parameters.* All m parameters of its estimate, in one message of 4 + 8 m bytes. A receiver uses the newest
  parameters from each neighbor until newer ones arrive, or until it forgets the neighbor.
- *Measurements.* At most `MAX_SENT_MEASUREMENTS` of the measurements that the robot knows, its own and
  received ones, in messages of 4 + 10 k bytes for k measurements. Measurements that it has not sent yet come
  first, then those that it sent longest ago. In this way, measurements in lost messages are sent again, and
  robots that meet later receive all measurements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from robocov.observation import Message, Observations
from robocov.observation.messages import HEADER_BYTES
from robocov.observation.neighbors import Neighbors
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray, IntArray

PARAMETER_BYTES = 8
"""Size of a parameter."""
MEASUREMENT_BYTES = 10
"""Size of a measurement: 2 bytes for the index of its square, 8 for its value."""
MAX_SENT_MEASUREMENTS = 50
"""Maximum number of measurements that a robot sends in one learning period."""

MessageLists: TypeAlias = Sequence[Sequence[Message]]
"""The messages that each robot sends in a step; may be empty if no robot sends any."""


@dataclass(frozen=True, slots=True, eq=False)
class ParameterExchange:
    """Parameters that robots have received from others, and still have to send. Immutable.

    Attributes
    ----------
    received : tuple of mapping of int to (m,) array
        The newest parameters that each robot has received from others, by the index of the sender.
    is_unsent : (n,) bool array
        Whether each robot still has to send its own parameters in this learning period.
    """

    received: tuple[Mapping[int, FloatArray], ...]
    is_unsent: BoolArray

    @classmethod
    def build_empty(cls, robot_count: int) -> ParameterExchange:
        """Build the exchange of robots that have not received anything."""
        return cls(received=({},) * robot_count, is_unsent=np.zeros(robot_count, dtype=bool))

    def receive(self, seen: Observations) -> ParameterExchange:
        """Return the exchange after the messages of a step have arrived."""
        if not seen.messages:
            return self
        received = []
        for robot, known in enumerate(self.received):
            arrived = {message.sender: message.payload for message in seen.get_messages(robot)}
            received.append({**known, **arrived} if arrived else known)
        return replace(self, received=tuple(received))

    def start_period(self) -> ParameterExchange:
        """Return the exchange at the start of a learning period, when all parameters are new."""
        return replace(self, is_unsent=np.ones(len(self.received), dtype=bool))

    def forget_silent_robots(self, neighbors: Neighbors) -> ParameterExchange:
        """Return the exchange without the parameters of robots that are no longer neighbors."""
        received = []
        for robot, known in enumerate(self.received):
            senders = set(neighbors.list_neighbors(robot).tolist())
            received.append(known if senders.issuperset(known) else _select_senders(known, senders))
        return replace(self, received=tuple(received))

    def compute_means(self, parameters: FloatArray) -> FloatArray:
        """Compute the mean of the parameters that each robot has received.

        Parameters
        ----------
        parameters : (n, m) array
            Parameters of the robots themselves.

        Returns
        -------
        (n, m) array
            The robot's own parameters if it has received none.
        """
        means = parameters.copy()
        for robot, known in enumerate(self.received):
            if known:
                means[robot] = np.mean([known[sender] for sender in sorted(known)], axis=0)
        return means

    def send(self, seen: Observations, parameters: FloatArray) -> tuple[ParameterExchange, MessageLists]:
        """Return the exchange after sending, and messages with the parameters that can be sent now.

        Each robot sends its parameters once in a learning period, as soon as it can send messages.

        Parameters
        ----------
        seen : Observations
        parameters : (n, m) array
            Parameters of the robots.

        Returns
        -------
        exchange : ParameterExchange
            The exchange after these messages have been sent.
        messages : sequence of sequence of Message
            The messages of each robot; may be empty if no robot sends any.
        """
        if not self.is_unsent.any():
            return self, ()
        is_sender = self.is_unsent & find_possible_senders(seen)
        size = HEADER_BYTES + PARAMETER_BYTES * parameters.shape[1]
        messages: list[list[Message]] = [[] for _ in parameters]
        for robot in np.flatnonzero(is_sender).tolist():
            messages[robot].append(Message(parameters[robot].copy(), size))
        return replace(self, is_unsent=self.is_unsent & ~is_sender), messages


class Measurements(NamedTuple):
    """Content of a message with k measurements."""

    squares: IntArray
    """(k,) Indices of the squares."""
    values: FloatArray
    """(k,) φ in these squares."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasurementExchange:
    """Measurements that robots have sent, and the number that each may still send. Immutable.

    Attributes
    ----------
    sent_times : (n, s) array, s
        Time at which each robot last sent the measurement in each square; -inf if it never did.
    allowances : (n,) int array
        Number of measurements that each robot may still send in this learning period.
    """

    sent_times: FloatArray
    allowances: IntArray

    @classmethod
    def build_empty(cls, robot_count: int, square_count: int) -> MeasurementExchange:
        """Build the exchange of robots that have not sent anything."""
        return cls(
            sent_times=np.full((robot_count, square_count), -np.inf),
            allowances=np.zeros(robot_count, dtype=np.intp),
        )

    def start_period(self, measurements: FloatArray) -> MeasurementExchange:
        """Return the exchange at the start of a learning period, with new allowances.

        Parameters
        ----------
        measurements : (n, s) array
            Measurements that each robot knows; nan if there is none.
        """
        known_counts = (~np.isnan(measurements)).sum(axis=1)
        return replace(self, allowances=np.minimum(known_counts, MAX_SENT_MEASUREMENTS))

    def send(self, seen: Observations, measurements: FloatArray) -> tuple[MeasurementExchange, MessageLists]:
        """Return the exchange after sending, and messages with measurements.

        Each robot sends as many measurements as its allowance and the communication permit: first those that
        it has never sent, then those that it sent longest ago.

        Parameters
        ----------
        seen : Observations
        measurements : (n, s) array
            Measurements that each robot knows; nan if there is none.

        Returns
        -------
        exchange : MeasurementExchange
            The exchange after these messages have been sent.
        messages : sequence of sequence of Message
            The messages of each robot; may be empty if no robot sends any.
        """
        if not self.allowances.any():
            return self, ()
        is_sender = (self.allowances > 0) & find_possible_senders(seen)
        sent_times = self.sent_times.copy()
        allowances = self.allowances.copy()
        messages: list[list[Message]] = [[] for _ in measurements]
        for robot in np.flatnonzero(is_sender).tolist():
            count = self._count_measurements_to_send(seen, robot)
            known = np.flatnonzero(~np.isnan(measurements[robot]))
            # The time of a measurement that was never sent is -inf, so that it comes first.
            order = np.argsort(sent_times[robot, known], kind="stable")
            squares = known[order[:count]]
            content = Measurements(squares, measurements[robot, squares])
            messages[robot].append(Message(content, HEADER_BYTES + MEASUREMENT_BYTES * len(squares)))
            sent_times[robot, squares] = seen.time
            allowances[robot] -= len(squares)
        return replace(self, sent_times=sent_times, allowances=allowances), messages

    def _count_measurements_to_send(self, seen: Observations, robot: int) -> int:
        """Return the number of measurements that a robot with an allowance sends in this step, at least 1."""
        allowance = int(self.allowances[robot])
        if seen.send_limits is None:
            return allowance
        # The send limit of a robot that has used up its data rate is too low for a measurement. The robot
        # still sends one, which waits in its queue.
        fitting = int((seen.send_limits[robot] - HEADER_BYTES) // MEASUREMENT_BYTES)
        return min(allowance, max(1, fitting))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MeasurementMemory:
    """Memory of robots that exchange measurements, and move to goals that depend on them."""

    team: Team
    measurements: FloatArray
    """(n, s) Measurements of φ in the squares that each robot knows, own and received; nan if unknown."""
    measurement_exchange: MeasurementExchange
    goals: FloatArray | None = None
    """(n, 2) m, goals in the last plan; None before the first one."""
    plan_time: float = -np.inf
    """Time of the last plan, s."""


def measure_own_density(seen: Observations) -> FloatArray:
    """Measure the density at the position of each robot, (n,)."""
    return seen.measure_density(np.arange(len(seen.positions)), seen.positions)


def add_received_measurements(seen: Observations, measurements: FloatArray) -> FloatArray:
    """Add the measurements that arrive in a step to those that the robots know.

    In a square in which a robot already knows a measurement, it keeps that one. Messages with other contents
    are ignored.

    Parameters
    ----------
    seen : Observations
    measurements : (n, s) array
        Measurements that each robot knows; nan if there is none.

    Returns
    -------
    (n, s) array
        The same array if nothing has arrived.
    """
    if not seen.messages:
        return measurements
    measurements = measurements.copy()
    # `known` is a row of the copy, so that assignments to its elements change the copy.
    for robot, known in enumerate(measurements):
        for message in seen.get_messages(robot):
            content = message.payload
            if isinstance(content, Measurements):
                is_new = np.isnan(known[content.squares])
                known[content.squares[is_new]] = content.values[is_new]
    return measurements


def find_possible_senders(seen: Observations) -> BoolArray:
    """Return a mask, (n,), of the robots that can send a message in this step."""
    if seen.send_limits is None:
        return np.ones(len(seen.positions), dtype=bool)
    return np.asarray(seen.send_limits > 0)


def _select_senders(received: Mapping[int, FloatArray], senders: set[int]) -> dict[int, FloatArray]:
    """Return the parameters that a robot has received from the given senders."""
    return {sender: parameters for sender, parameters in received.items() if sender in senders}
