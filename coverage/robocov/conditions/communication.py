"""Messages between robots, with loss, latency, a limited rate and a limited bandwidth.

There are two kinds of messages. Both are sent to all robots in communication range, at the rate of the
conditions. For each receiver independently, a message is either lost or arrives after the latency.

- *Positions.* Each robot sends its own estimate of its position. A robot remembers the newest position that
  it received from each other robot. If none arrives for `Conditions.forget_after`, it forgets that robot.
- *Controller messages* (`robocov.observation.Message`) contain anything else that robots tell each other,
  such as maps. The controller returns them with its decision, at the end of a step, and they arrive in the
  next step at the earliest. A long message is sent in packets of at most `MAX_PACKET_BYTES`; the message is
  lost if any of its packets is lost.

The bandwidth limits the bytes per second that each robot sends, by a token bucket: a robot earns credits at
the rate of the bandwidth, and pays with them for what it sends. Controller messages for which there are no
credits wait in a queue at the sender, in order. A position does not wait in this queue: it is sent next, or
replaced by a newer one. While controller messages wait, the robot sends them and its position alternately.

The state of the communication is an `Inbox`, which contains the messages that have arrived, are in flight or
wait. It is part of the state of a simulation, so that a copy continues with the same messages.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robocov.conditions.conditions import TIME_TOLERANCE_S, Conditions
from robocov.conditions.random_streams import LOSS_STREAM, MESSAGE_LOSS_STREAM, create_generator
from robocov.observation import Message, Observations, ReceivedMessage
from robocov.observation.neighbors import Neighbors
from robocov.typing import BoolArray, FloatArray, IntArray

NEVER = -1
"""Placeholder for the step of a message that has not been sent or has not arrived."""
POSITION_BYTES = 20
"""Size of a message with the number and the position of a robot."""
MAX_PACKET_BYTES = 1400
"""Maximum size of a packet: about the payload of a frame in a wireless network."""
_MIN_SEND_LIMIT_BYTES = 1.0
"""Minimum send limit of a robot whose queue is empty, so that a robot without credits can queue a message."""


class Broadcast(NamedTuple):
    """The positions that all robots sent in one step.

    Attributes
    ----------
    sent_step, arrival_step : int
        Numbers of the steps, from time zero, in which the messages were sent and arrive.
    positions : (n, 2) array, m
        Reported positions of the senders.
    is_received : (n, n) bool array
        Whether the row's robot receives the message of the column's robot.
    """

    sent_step: int
    arrival_step: int
    positions: FloatArray
    is_received: BoolArray


class Transmission(NamedTuple):
    """A controller message in flight.

    Attributes
    ----------
    arrival_step : int
        Number of the step, from time zero, in which the message arrives.
    message : ReceivedMessage
        The message as its receivers will see it.
    is_received : (n,) bool array
        Whether each robot receives the message.
    """

    arrival_step: int
    message: ReceivedMessage
    is_received: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class Outbox:
    """Controller messages that wait at the senders because the bandwidth or the rate is limited. Immutable.

    Attributes
    ----------
    queues : tuple of tuple of Message
        The waiting messages of each robot, in order.
    credits : (n,) array, bytes
        Bytes that each robot may send now; negative after a message that was larger than the credits.
    sent_position : (n,) bool array
        Whether the last transmission of each robot was its position.
    """

    queues: tuple[tuple[Message, ...], ...]
    credits: FloatArray
    sent_position: BoolArray

    @classmethod
    def create_empty(cls, robot_count: int) -> Outbox:
        """Create the outbox of robots that have not sent any message.

        Parameters
        ----------
        robot_count : int
            Number of robots n.

        Returns
        -------
        Outbox
        """
        return cls(
            queues=((),) * robot_count,
            credits=np.zeros(robot_count),
            sent_position=np.zeros(robot_count, dtype=bool),
        )

    def append(self, messages: Sequence[Sequence[Message]], is_working: BoolArray) -> Outbox:
        """Return the outbox with new messages at the ends of the queues.

        Parameters
        ----------
        messages : sequence of sequence of Message
            New messages of each robot; empty if there are none.
        is_working : (n,) bool array
            Mask of the working robots. The queues of the other robots are emptied.

        Returns
        -------
        Outbox
        """
        queues = list(self.queues)
        for robot in np.flatnonzero(~is_working).tolist():
            queues[robot] = ()
        if messages:
            for robot in np.flatnonzero(is_working).tolist():
                queues[robot] = (*queues[robot], *messages[robot])
        return replace(self, queues=tuple(queues))


@dataclass(frozen=True, slots=True, eq=False)
class Inbox:
    """Messages that were received, are in flight or wait to be sent. Immutable; replaced in each step.

    Attributes
    ----------
    sent_steps, arrival_steps : (n, n) int array
        Numbers of the steps in which the newest position that the row's robot has received from the column's
        robot was sent and arrived; `NEVER` if it has received none.
    positions : (n, n, 2) array, m
        These newest positions, by receiver and sender.
    in_flight : tuple of Broadcast
        Positions in flight, in the order in which they arrive.
    transmissions : tuple of Transmission
        Controller messages in flight, in the order in which they arrive.
    outbox : Outbox
        Controller messages that wait to be sent.
    """

    sent_steps: IntArray
    arrival_steps: IntArray
    positions: FloatArray
    in_flight: tuple[Broadcast, ...]
    transmissions: tuple[Transmission, ...]
    outbox: Outbox

    @classmethod
    def create_empty(cls, robot_count: int) -> Inbox:
        """Create the inbox of robots that have not received any message.

        Parameters
        ----------
        robot_count : int
            Number of robots n.

        Returns
        -------
        Inbox
        """
        never = np.full((robot_count, robot_count), NEVER, dtype=np.intp)
        return cls(
            sent_steps=never,
            arrival_steps=never.copy(),
            positions=np.zeros((robot_count, robot_count, 2)),
            in_flight=(),
            transmissions=(),
            outbox=Outbox.create_empty(robot_count),
        )

    @property
    def has_messages(self) -> bool:
        """Whether controller messages are in flight or wait to be sent."""
        return bool(self.transmissions) or any(self.outbox.queues)

    def drop_messages(self) -> Inbox:
        """Return the inbox without controller messages, for a controller that would not understand them."""
        if not self.has_messages:
            return self
        outbox = Outbox.create_empty(len(self.positions))
        return replace(self, transmissions=(), outbox=outbox)

    def select_robots(self, rows: IntArray) -> Inbox:
        """Return the inbox of another team of m robots, some of which are robots of this team.

        Controller messages are dropped, because the memory of a controller belongs to a whole team.

        Parameters
        ----------
        rows : (m,) int array
            Index in this team of each robot in the new team; -1 for new robots.

        Returns
        -------
        Inbox
        """
        # A pair is new if one of its robots is new. No message has been sent between the two. Any row of this
        # team can stand for a new robot, because its values are then replaced.
        is_new = np.asarray(rows) < 0
        is_new_pair = is_new[:, None] | is_new
        old_rows = np.maximum(rows, 0)
        old_pairs = np.ix_(old_rows, old_rows)
        in_flight = tuple(
            broadcast._replace(
                positions=broadcast.positions[old_rows],
                is_received=broadcast.is_received[old_pairs] & ~is_new_pair,
            )
            for broadcast in self.in_flight
        )
        return Inbox(
            sent_steps=np.where(is_new_pair, NEVER, self.sent_steps[old_pairs]),
            arrival_steps=np.where(is_new_pair, NEVER, self.arrival_steps[old_pairs]),
            positions=self.positions[old_pairs],
            in_flight=in_flight,
            transmissions=(),
            outbox=Outbox.create_empty(len(old_rows)),
        )


class PositionReports(NamedTuple):
    """The newest positions that robots know of others from messages."""

    neighbors: Neighbors
    """The graph that links each robot to the robots whose positions it knows."""
    positions: FloatArray
    """(m, 2) m, the known positions, in the order of ``neighbors.indices``."""
    ages: FloatArray
    """(m,) s, times since these positions were sent."""


class Radio:
    """Sends and delivers the messages of a team.

    Parameters
    ----------
    conditions : Conditions
        Loss, latency, rate and bandwidth of messages.
    ranges : (n,) array, m
        Communication ranges of the robots.
    dt : float, s
        Control period.
    """

    def __init__(self, conditions: Conditions, ranges: FloatArray, dt: float) -> None:
        self._conditions = conditions
        self._ranges = ranges
        self._dt = dt
        self._latency_steps = math.ceil(conditions.delay / dt - TIME_TOLERANCE_S)
        self._period_bytes: float | None = None
        if conditions.bandwidth is not None:
            period = dt if conditions.message_rate is None else max(dt, 1.0 / conditions.message_rate)
            self._period_bytes = conditions.bandwidth * period

    def exchange_positions(
        self,
        inbox: Inbox,
        step: int,
        reported_positions: FloatArray,
        true_positions: FloatArray,
        is_working: BoolArray,
    ) -> Inbox:
        """Return the inbox after the robots sent their positions, and the positions due in this step arrived.

        Parameters
        ----------
        inbox : Inbox
            Messages before the step.
        step : int
            Index of the step, from 0 at time zero.
        reported_positions : (n, 2) array, m
            The robots' own estimates of their positions.
        true_positions : (n, 2) array, m
            True positions, which determine which robots are in range.
        is_working : (n,) bool array
            Mask of the working robots.

        Returns
        -------
        Inbox
            Messages after the positions were exchanged.
        """
        if self._is_sending(step):
            is_received = self._sample_reception_mask(step, true_positions, is_working)
            if self._period_bytes is not None:
                inbox, is_sender = self._allocate_bandwidth_to_positions(inbox)
                is_received &= is_sender
            broadcast = Broadcast(
                sent_step=step,
                arrival_step=step + self._latency_steps,
                positions=np.array(reported_positions),
                is_received=is_received,
            )
            inbox = replace(inbox, in_flight=(*inbox.in_flight, broadcast))
        return self._deliver_positions(inbox, step)

    @staticmethod
    def _deliver_positions(inbox: Inbox, step: int) -> Inbox:
        """Return the inbox after the positions that arrive in a step were delivered."""
        # Messages in flight are in the order of their arrival, so those that are due come first.
        due = [broadcast for broadcast in inbox.in_flight if broadcast.arrival_step <= step]
        if len(due) == 0:
            return inbox
        sent_steps = inbox.sent_steps.copy()
        arrival_steps = inbox.arrival_steps.copy()
        newest_positions = inbox.positions.copy()
        for broadcast in due:
            sent_steps[broadcast.is_received] = broadcast.sent_step
            arrival_steps[broadcast.is_received] = broadcast.arrival_step
            receiver, sender = np.nonzero(broadcast.is_received)
            newest_positions[receiver, sender] = broadcast.positions[sender]
        return replace(
            inbox,
            sent_steps=sent_steps,
            arrival_steps=arrival_steps,
            positions=newest_positions,
            in_flight=inbox.in_flight[len(due) :],
        )

    def receive_messages(
        self, inbox: Inbox | None, step: int, observations: Observations
    ) -> tuple[Inbox | None, Observations]:
        """Return the inbox and the observations after the controller messages due in a step have arrived.

        Parameters
        ----------
        inbox : Inbox or None
            Messages after the positions of the step were exchanged. None if no message is in flight or
            waiting.
        step : int
            Index of the step, from 0 at time zero.
        observations : Observations
            Observations of the step without controller messages.

        Returns
        -------
        inbox : Inbox or None
            The inbox without the delivered messages. None if no message is in flight or waits, and
            communication is ideal.
        observations : Observations
            The observations with the delivered messages and the send limits.
        """
        send_limits = self._compute_send_limits(inbox, step, len(observations.positions))
        due = []
        if inbox is not None:
            due = [transmission for transmission in inbox.transmissions if transmission.arrival_step <= step]
            inbox = replace(inbox, transmissions=inbox.transmissions[len(due) :])
            if not (inbox.has_messages or self._conditions.uses_messages):
                inbox = None
        if not due and send_limits is None:
            return inbox, observations
        received: list[list[ReceivedMessage]] = [[] for _ in observations.positions]
        for transmission in due:
            for robot in np.flatnonzero(transmission.is_received).tolist():
                received[robot].append(transmission.message)
        messages = tuple(map(tuple, received)) if due else ()
        return inbox, replace(observations, messages=messages, send_limits=send_limits)

    def _compute_send_limits(self, inbox: Inbox | None, step: int, robot_count: int) -> FloatArray | None:
        """Compute the total size of the messages that each robot can send in a step, (n,) bytes.

        None means unlimited.
        """
        if not self._is_sending(step):
            return np.zeros(robot_count)
        if self._period_bytes is None or inbox is None:
            return None
        is_waiting = np.array([len(queue) > 0 for queue in inbox.outbox.queues])
        limits = np.maximum(inbox.outbox.credits, _MIN_SEND_LIMIT_BYTES)
        return np.where(is_waiting, 0.0, limits)

    def send_messages(
        self,
        inbox: Inbox | None,
        step: int,
        messages: Sequence[Sequence[Message]],
        true_positions: FloatArray,
        is_working: BoolArray,
    ) -> tuple[Inbox | None, int]:
        """Return the inbox after controller messages were sent at the end of a step, and their total size.

        Messages beyond the limits of the conditions wait in the queues of the senders.

        Parameters
        ----------
        inbox : Inbox or None
            Messages after the observations of the step; None if no message is in flight or waiting.
        step : int
            Index of the step, from 0 at time zero.
        messages : sequence of sequence of Message
            New messages of each robot; empty if there are none. Messages of failed robots are dropped.
        true_positions : (n, 2) array, m
            True positions, which determine which robots are in range.
        is_working : (n,) bool array
            Mask of the working robots.

        Returns
        -------
        inbox : Inbox or None
            Messages after the step. None if it was None and there are no new messages.
        sent_bytes : int
            Total size of the messages that were sent in this step, excluding those still waiting.
        """
        if inbox is None and not any(messages):
            return None, 0
        if inbox is None:
            inbox = Inbox.create_empty(len(is_working))
        outbox = inbox.outbox.append(messages, is_working)
        if not (self._is_sending(step) and any(outbox.queues)):
            return replace(inbox, outbox=outbox), 0
        outbox, departing = self._take_from_queues(outbox)
        links = Neighbors.from_ranges(true_positions, self._ranges).restrict_to_working(is_working)
        transmissions = []
        sent_bytes = 0
        for sender, sent_messages in enumerate(departing):
            if sent_messages:
                is_linked = np.zeros(len(is_working), dtype=bool)
                is_linked[links.list_neighbors(sender)] = True
                transmissions += self._transmit(sender, sent_messages, step, is_linked)
                sent_bytes += sum(message.size for message in sent_messages)
        inbox = replace(inbox, transmissions=(*inbox.transmissions, *transmissions), outbox=outbox)
        return inbox, sent_bytes

    def _allocate_bandwidth_to_positions(self, inbox: Inbox) -> tuple[Inbox, BoolArray]:
        """Return the inbox after the robots paid for their positions, and which of them send theirs now.

        The bytes of one sending period are added to the credits, and those of sent positions subtracted.
        The credits of a robot never exceed the bytes of one period. A robot whose last transmission was its
        position does not send it again while messages wait.

        Returns
        -------
        inbox : Inbox
            The inbox with the new credits.
        is_sender : (n,) bool array
            Mask of the robots that send their positions now.
        """
        assert self._period_bytes is not None
        outbox = inbox.outbox
        available = np.minimum(outbox.credits + self._period_bytes, self._period_bytes)
        is_waiting = np.array([len(queue) > 0 for queue in outbox.queues])
        is_sender = (available > 0.0) & ~(is_waiting & outbox.sent_position)
        available = available - POSITION_BYTES * is_sender
        sent_position = outbox.sent_position | is_sender
        return replace(inbox, outbox=Outbox(outbox.queues, available, sent_position)), is_sender

    def _take_from_queues(self, outbox: Outbox) -> tuple[Outbox, list[tuple[Message, ...]]]:
        """Return the outbox without the messages that are sent now, and these messages.

        Returns
        -------
        outbox : Outbox
            The outbox without these messages.
        departing : list of tuple of Message
            The removed messages of each robot, in order.
        """
        if self._period_bytes is None:
            return replace(outbox, queues=((),) * len(outbox.queues)), list(outbox.queues)
        available = outbox.credits.copy()
        sent_position = outbox.sent_position.copy()
        queues = []
        departing = []
        for robot, queue in enumerate(outbox.queues):
            # A message is sent as soon as there are any credits, which it may overdraw.
            count = 0
            while count < len(queue) and available[robot] > 0.0:
                available[robot] -= queue[count].size
                count += 1
            if count > 0:
                sent_position[robot] = False
            departing.append(queue[:count])
            queues.append(queue[count:])
        return Outbox(tuple(queues), available, sent_position), departing

    def _transmit(
        self, sender: int, messages: Sequence[Message], step: int, is_linked: BoolArray
    ) -> list[Transmission]:
        """Return the transmissions of a robot's messages to the robots in the mask `is_linked`, (n,)."""
        arrival_step = step + max(1, self._latency_steps)
        is_received = np.broadcast_to(is_linked, (len(messages), len(is_linked)))
        if self._conditions.loss:
            # A message arrives only if all of its packets arrive.
            packet_counts = np.array([math.ceil(message.size / MAX_PACKET_BYTES) for message in messages])
            arrival_probabilities = (1.0 - self._conditions.loss) ** packet_counts
            rng = create_generator(self._conditions.seed, MESSAGE_LOSS_STREAM, step, sender)
            is_received = is_received & (rng.random(is_received.shape) < arrival_probabilities[:, None])
        return [
            Transmission(arrival_step, ReceivedMessage(sender, message.payload), receivers)
            for message, receivers in zip(messages, is_received, strict=True)
        ]

    def read_reports(self, inbox: Inbox, step: int, is_working: BoolArray) -> PositionReports:
        """Return the newest positions that working robots have received and have not forgotten.

        Parameters
        ----------
        inbox : Inbox
            Messages after the positions of the step were exchanged.
        step : int
            Index of the step, from 0 at time zero.
        is_working : (n,) bool array
            Mask of the working robots.

        Returns
        -------
        PositionReports
        """
        silence = (step - inbox.arrival_steps) * self._dt
        is_recent = silence <= self._conditions.forget_after + TIME_TOLERANCE_S
        robot, neighbor = np.nonzero((inbox.arrival_steps >= 0) & is_recent & is_working[:, None])
        neighbors = Neighbors.from_pairs(len(is_working), robot, neighbor, self._ranges)
        ages = (step - inbox.sent_steps[robot, neighbor]) * self._dt
        return PositionReports(
            neighbors=neighbors, positions=inbox.positions[robot, neighbor], ages=np.asarray(ages)
        )

    def _is_sending(self, step: int) -> bool:
        """Return whether messages are sent in a step: at time zero, and once in each period of the rate."""
        rate = self._conditions.message_rate
        if rate is None:
            return True
        periods_per_step = self._dt * rate
        periods = math.floor(step * periods_per_step + TIME_TOLERANCE_S)
        previous_periods = math.floor((step - 1) * periods_per_step + TIME_TOLERANCE_S)
        return periods > previous_periods

    def _sample_reception_mask(self, step: int, positions: FloatArray, is_working: BoolArray) -> BoolArray:
        """Return which robot (row) receives the position of which other robot (column), (n, n) bool.

        Robots receive each other within range, unless the message is lost at random.
        """
        links = Neighbors.from_ranges(positions, self._ranges).restrict_to_working(is_working)
        receiver, sender = links.list_pairs()
        is_received = np.zeros((len(positions), len(positions)), dtype=bool)
        is_received[receiver, sender] = True
        if self._conditions.loss:
            rng = create_generator(self._conditions.seed, LOSS_STREAM, step)
            is_received &= rng.random(is_received.shape) >= self._conditions.loss
        return is_received
