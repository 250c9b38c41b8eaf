"""Messages between robots, with loss, latency and a limited rate.

A message contains its sender's own estimate of its position, and is sent to all robots in communication
range. For each receiver independently, the message is either lost or arrives after the latency. A robot
remembers the newest message from each other robot. If none arrives for `Conditions.forget_after`, it forgets
that robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.conditions.conditions import TIME_TOLERANCE_S, Conditions
from robocov.conditions.random_streams import LOSS_STREAM, create_generator
from robocov.observation.neighbors import Neighbors

NEVER = -1
"""Placeholder for the step of a message that has not been sent or has not arrived."""


class Broadcast(NamedTuple):
    """The messages that all robots sent in one step.

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
    positions: Array
    is_received: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class Inbox:
    """Messages received and messages in flight. Immutable; replaced in each step.

    Attributes
    ----------
    sent_steps, arrival_steps : (n, n) int array
        Numbers of the steps in which the newest message from the column's robot to the row's robot was sent
        and arrived; `NEVER` if there is none.
    positions : (n, n, 2) array, m
        Positions in these messages.
    in_flight : tuple of Broadcast
        In the order in which they arrive.
    """

    sent_steps: IntArray
    arrival_steps: IntArray
    positions: Array
    in_flight: tuple[Broadcast, ...] = ()

    @classmethod
    def create_empty(cls, count: int) -> Inbox:
        """Create the inbox of robots that have not received any message.

        Parameters
        ----------
        count : int
            Number of robots n.

        Returns
        -------
        Inbox
        """
        never = np.full((count, count), NEVER, dtype=np.intp)
        return cls(sent_steps=never, arrival_steps=never.copy(), positions=np.zeros((count, count, 2)))

    def select_robots(self, rows: IntArray) -> Inbox:
        """Return the inbox of a team of m robots, some of this team and some new.

        Parameters
        ----------
        rows : (m,) int array
            Index in this team of each robot in the new team; -1 for new robots.

        Returns
        -------
        Inbox
        """
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
        )


class Radio:
    """Sends and delivers the messages of a team.

    Parameters
    ----------
    conditions : Conditions
    ranges : (n,) array, m
        Communication ranges of the robots.
    dt : float, s
        Control period.
    """

    def __init__(self, conditions: Conditions, ranges: Array, dt: float) -> None:
        self._conditions = conditions
        self._ranges = ranges
        self._dt = dt
        self._latency_steps = math.ceil(conditions.delay / dt - TIME_TOLERANCE_S)

    def exchange_messages(
        self, inbox: Inbox, step: int, reported_positions: Array, true_positions: Array, working: BoolArray
    ) -> Inbox:
        """Send and deliver the messages of one step.

        Parameters
        ----------
        inbox : Inbox
            Messages before the step.
        step : int
            Number of the step since time zero.
        reported_positions : (n, 2) array, m
            The robots' own estimates of their positions.
        true_positions : (n, 2) array, m
            True positions, which determine which robots are in range.
        working : (n,) bool array
            Mask of the robots that work.

        Returns
        -------
        Inbox
        """
        in_flight = inbox.in_flight
        if self._is_sending(step):
            broadcast = Broadcast(
                sent_step=step,
                arrival_step=step + self._latency_steps,
                positions=np.array(reported_positions),
                is_received=self._find_receivers(step, true_positions, working),
            )
            in_flight = (*in_flight, broadcast)
        # Messages are in flight in the order in which they arrive, so those that are due come first.
        due = [broadcast for broadcast in in_flight if broadcast.arrival_step <= step]
        if len(due) == 0:
            return replace(inbox, in_flight=in_flight)
        sent_steps = inbox.sent_steps.copy()
        arrival_steps = inbox.arrival_steps.copy()
        newest_positions = inbox.positions.copy()
        for broadcast in due:
            sent_steps[broadcast.is_received] = broadcast.sent_step
            arrival_steps[broadcast.is_received] = broadcast.arrival_step
            receiver, sender = np.nonzero(broadcast.is_received)
            newest_positions[receiver, sender] = broadcast.positions[sender]
        return Inbox(sent_steps, arrival_steps, newest_positions, in_flight[len(due) :])

    def read_reports(self, inbox: Inbox, step: int, working: BoolArray) -> tuple[Neighbors, Array, Array]:
        """Read the newest message that each working robot has from every robot that it has not forgotten.

        Parameters
        ----------
        inbox : Inbox
        step : int
            Number of the step since time zero.
        working : (n,) bool array
            Mask of the robots that work.

        Returns
        -------
        neighbors : Neighbors
            The robots from which each robot has such a message.
        positions : (m, 2) array, m
            Positions in the messages, in the order of ``neighbors.indices``.
        ages : (m,) array, s
            Times since the messages were sent.
        """
        silence = (step - inbox.arrival_steps) * self._dt
        is_recent = silence <= self._conditions.forget_after + TIME_TOLERANCE_S
        robot, neighbor = np.nonzero((inbox.arrival_steps >= 0) & is_recent & working[:, None])
        neighbors = Neighbors.from_pairs(len(working), robot, neighbor, self._ranges)
        ages = (step - inbox.sent_steps[robot, neighbor]) * self._dt
        return neighbors, inbox.positions[robot, neighbor], np.asarray(ages)

    def _is_sending(self, step: int) -> bool:
        """Return whether messages are sent in a step: at time zero, and whenever a period has passed."""
        rate = self._conditions.message_rate
        if rate is None:
            return True
        periods_per_step = self._dt * rate
        periods = math.floor(step * periods_per_step + TIME_TOLERANCE_S)
        previous_periods = math.floor((step - 1) * periods_per_step + TIME_TOLERANCE_S)
        return periods > previous_periods

    def _find_receivers(self, step: int, positions: Array, working: BoolArray) -> BoolArray:
        """Find the receivers of each robot's message, an (n, n) mask of receivers by senders."""
        links = Neighbors.from_ranges(positions, self._ranges).restrict_to_working(working)
        receiver, sender = links.list_pairs()
        is_received = np.zeros((len(positions), len(positions)), dtype=bool)
        is_received[receiver, sender] = True
        if self._conditions.loss:
            rng = create_generator(self._conditions.seed, LOSS_STREAM, step)
            is_received &= rng.random(is_received.shape) >= self._conditions.loss
        return is_received
