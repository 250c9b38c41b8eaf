"""Messages among the robots: where each of them is, sent now and then, lost, late, and forgotten.

A message tells where its sender believes itself to be. It goes to all that are in range of it, and it in
range of them, when it is sent; for each of these it is lost or not by itself; and it arrives after the
delay. Of every other robot, a robot knows the newest message that arrived, until nothing has arrived for
so long that the other is taken to be gone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.conditions import LOSS, SOON, Conditions
from robocov.conditions.draws import Draws
from robocov.observation.neighbours import Neighbours

NEVER = -1
"""The step at which something has not happened."""


class Broadcast(NamedTuple):
    """Messages of all robots from one step, on their way."""

    arrives: int
    """Step, as `sent`."""
    sent: int
    places: Array
    """Reported positions, (n, 2) m."""
    reaches: BoolArray
    """Whether the message of the robot of the column gets to that of the row, (n, n)."""


@dataclass(frozen=True, slots=True, eq=False)
class Inbox:
    """What has arrived, and what is on its way; never changed, only replaced.

    Attributes
    ----------
    sent : (n, n) int
        The step at which the newest message that row's robot has of column's was sent, `NEVER` if none.
    arrived : (n, n) int
        The step at which it arrived.
    places : (n, n, 2) m
        What it said.
    on_the_way : tuple of Broadcast
        In the order in which they arrive.
    """

    sent: IntArray
    arrived: IntArray
    places: Array
    on_the_way: tuple[Broadcast, ...] = ()

    @classmethod
    def empty(cls, count: int) -> Inbox:
        """Return what `count` robots know that have heard nothing yet."""
        sent, arrived = np.full((2, count, count), NEVER, dtype=np.intp)
        return cls(sent, arrived, np.zeros((count, count, 2)))

    def rearranged(self, rows: IntArray) -> Inbox:
        """Return what remains for a team in which robot i was that of `rows[i]`; -1 is one that is new."""
        old, new = np.maximum(rows, 0), np.asarray(rows) < 0
        strange = new[:, None] | new

        def taken(values: IntArray) -> IntArray:
            return np.where(strange, NEVER, values[np.ix_(old, old)])

        on_the_way = tuple(
            each._replace(places=each.places[old], reaches=each.reaches[np.ix_(old, old)] & ~strange)
            for each in self.on_the_way
        )
        return Inbox(taken(self.sent), taken(self.arrived), self.places[np.ix_(old, old)], on_the_way)


class Radio:
    """Sends and delivers messages under some conditions among robots of communication ranges, (n,) m."""

    def __init__(self, conditions: Conditions, ranges: Array, dt: float) -> None:
        self._conditions, self._ranges, self._dt = conditions, ranges, dt
        self._chance = Draws(conditions.seed, LOSS)
        self._delay = math.ceil(conditions.delay / dt - SOON)

    def exchange(self, inbox: Inbox, step: int, told: Array, positions: Array, working: BoolArray) -> Inbox:
        """Return what the robots have once messages were sent and delivered at a step since time zero.

        Robots tell where they believe themselves to be, (n, 2) m; where they are says who is in range.
        """
        on_the_way = inbox.on_the_way
        if self._sends(step):
            reaches = self._reached(step, positions, working)
            on_the_way = (*on_the_way, Broadcast(step + self._delay, step, np.array(told), reaches))
        due = [each for each in on_the_way if each.arrives <= step]
        if not due:
            return replace(inbox, on_the_way=on_the_way)
        sent, arrived, places = inbox.sent.copy(), inbox.arrived.copy(), inbox.places.copy()
        for each in due:
            sent[each.reaches], arrived[each.reaches] = each.sent, each.arrives
            receiver, sender = np.nonzero(each.reaches)
            places[receiver, sender] = each.places[sender]
        return Inbox(sent, arrived, places, on_the_way[len(due) :])

    def reports(self, inbox: Inbox, step: int, working: BoolArray) -> tuple[Neighbours, Array, Array]:
        """Return what robots that work know of others.

        Returns
        -------
        neighbours : Neighbours
            Of whom each has a message that is not forgotten.
        places : (m, 2) m
            What these messages said, in the order of ``neighbours.indices``.
        ages : (m,) s
            How long ago they were sent.
        """
        silence = (step - inbox.arrived) * self._dt
        known = (inbox.arrived >= 0) & (silence <= self._conditions.forget_after + SOON)
        known &= working[:, None]
        robot, neighbour = np.nonzero(known)
        neighbours = Neighbours.of_pairs(len(known), robot, neighbour, self._ranges)
        ages = (step - inbox.sent[robot, neighbour]) * self._dt
        return neighbours, inbox.places[robot, neighbour], np.asarray(ages)

    def _sends(self, step: int) -> bool:
        """Whether messages are sent at a step: at time zero, and whenever a period has passed."""
        rate = self._conditions.message_rate
        if rate is None:
            return True
        period = self._dt * rate
        return math.floor(step * period + SOON) > math.floor((step - 1) * period + SOON)

    def _reached(self, step: int, positions: Array, working: BoolArray) -> BoolArray:
        """Return whom a message of each robot gets to, (receiver, sender) bool."""
        count = len(positions)
        linked = Neighbours.within(positions, self._ranges).among(working)
        receiver, sender = linked.pairs()
        if self._conditions.loss:
            got = self._chance.uniform(step, receiver, sender) >= self._conditions.loss
            receiver, sender = receiver[got], sender[got]
        reaches = np.zeros((count, count), dtype=bool)
        reaches[receiver, sender] = True
        return reaches
