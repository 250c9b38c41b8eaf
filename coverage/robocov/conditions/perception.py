"""Imperfect perception and communication: observations degraded by noise, loss, delay and rate.

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
from robocov.conditions import LOSS, POSITION, SCANNING, SENSING, TIME_TOLERANCE_S, Conditions
from robocov.conditions.random_streams import Draws
from robocov.observation import Decision, Observations, Scans
from robocov.observation.neighbours import Neighbours
from robocov.team import Team

NEVER = -1
"""The step at which something has not happened."""
MIN_MEASURED_DISTANCE_M = 1e-3
"""The shortest distance in metres that a noisy range sensor measures."""


class Perception:
    """Turns what is there into what the robots know: row i still belongs to robot i alone."""

    def __init__(self, conditions: Conditions, team: Team, dt: float) -> None:
        self._conditions, self._ranges, self._dt = conditions, team.communication_range, dt
        self._robots = np.arange(len(team))
        self._delay = math.ceil(conditions.delay / dt - TIME_TOLERANCE_S)
        streams = POSITION, SENSING, SCANNING, LOSS
        chances = [Draws(conditions.seed, stream) for stream in streams]
        self._position_chance, self._sensing_chance, self._scanning_chance, self._loss_chance = chances

    def create_inbox(self) -> Inbox | None:
        """Return what the robots have heard before the first step; None where communication is ideal."""
        return Inbox.create_empty(len(self._robots)) if self._conditions.uses_messages else None

    def perceive(
        self, seen: Observations, inbox: Inbox | None, working: BoolArray
    ) -> tuple[Observations, Inbox | None]:
        """Return what the robots that work, (n,) bool, know of what is `seen` in truth, and their inbox."""
        step, truth = round(seen.time / self._dt), seen.positions
        positions = self._estimated(step, truth)
        points = self._sensed(step, seen, positions)
        if not working.all():
            points = np.where(working[:, None], points, np.nan)
        points.setflags(write=False)
        seen = replace(seen, positions=positions, obstacle_points=points, scans=self._scanned(step, seen))
        if inbox is None or not self._conditions.uses_messages:
            return replace(seen, neighbours=seen.neighbours.keep_working(working)), None
        inbox = self.exchange_messages(inbox, step, positions, truth, working)
        neighbours, places, ages = self.read_reports(inbox, step, working)
        return replace(seen, neighbours=neighbours, reported_positions=places, report_ages=ages), inbox

    def _estimated(self, step: int, positions: Array) -> Array:
        """Return the positions as the robots localize themselves, (n, 2) m."""
        sigma = self._conditions.position_noise
        if not sigma:
            return positions
        estimated = positions + sigma * self._position_chance.normal(step, self._robots)
        estimated.setflags(write=False)
        return np.asarray(estimated)

    def _sensed(self, step: int, seen: Observations, positions: Array) -> Array:
        """Return the obstacle points, (n, 2) m, as robots take them to be that think to be at `positions`."""
        sigma = self._conditions.sensing_noise
        if not sigma and positions is seen.positions:
            return seen.obstacle_points
        offset = seen.obstacle_points - seen.positions
        if sigma:
            distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
            noisy = distance + sigma * self._sensing_chance.normal(step, self._robots)[:, 0]
            # towards where the point is; one that is touched lies in no direction
            away = np.where(distance > 0.0, distance, 1.0)
            offset *= np.where(distance > 0.0, np.maximum(noisy, MIN_MEASURED_DISTANCE_M) / away, 1.0)[
                :, None
            ]
        return np.asarray(positions + offset)

    def _scanned(self, step: int, seen: Observations) -> Scans | None:
        """Return the scans as they are measured: what meets nothing is told to meet nothing."""
        scans, sigma = seen.scans, self._conditions.sensing_noise
        if scans is None or not sigma:
            return scans
        rays = np.arange(scans.rays)
        error = sigma * self._scanning_chance.normal(step, self._robots[:, None], rays)[..., 0]
        distances = np.where(
            scans.hit, np.maximum(scans.distances + error, MIN_MEASURED_DISTANCE_M), scans.distances
        )
        distances.setflags(write=False)
        return replace(scans, distances=distances)

    def exchange_messages(
        self, inbox: Inbox, step: int, told: Array, positions: Array, working: BoolArray
    ) -> Inbox:
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

    def read_reports(self, inbox: Inbox, step: int, working: BoolArray) -> tuple[Neighbours, Array, Array]:
        """Return of whom robots that work have a message that is not forgotten, what it said, and its age.

        These are (m, 2) m and (m,) s, in the order of the neighbours' ``indices``.
        """
        silence = (step - inbox.arrived) * self._dt
        known = (inbox.arrived >= 0) & (silence <= self._conditions.forget_after + TIME_TOLERANCE_S)
        robot, neighbour = np.nonzero(known & working[:, None])
        neighbours = Neighbours.from_pairs(len(known), robot, neighbour, self._ranges)
        ages = (step - inbox.sent[robot, neighbour]) * self._dt
        return neighbours, inbox.places[robot, neighbour], np.asarray(ages)

    def _sends(self, step: int) -> bool:
        """Whether messages are sent at a step: at time zero, and whenever a period has passed."""
        rate = self._conditions.message_rate
        if rate is None:
            return True
        period = self._dt * rate
        return math.floor(step * period + TIME_TOLERANCE_S) > math.floor(
            (step - 1) * period + TIME_TOLERANCE_S
        )

    def _reached(self, step: int, positions: Array, working: BoolArray) -> BoolArray:
        """Return whom a message of each robot gets to, (receiver, sender) bool."""
        receiver, sender = Neighbours.from_ranges(positions, self._ranges).keep_working(working).list_pairs()
        reaches = np.zeros((len(positions), len(positions)), dtype=bool)
        reaches[receiver, sender] = True
        if self._conditions.loss:
            chance = self._loss_chance.uniform(step, receiver, sender)
            reaches[receiver, sender] = chance >= self._conditions.loss
        return reaches


def ignore_idle_robots(decision: Decision, working: BoolArray) -> Decision:
    """Return a decision in which robots that do not work, (n,) bool, want nothing."""
    if working.all():
        return decision
    there = working[:, None]
    forces = np.where(there, decision.forces, 0.0)
    goals = None if decision.goals is None else np.where(there, decision.goals, np.nan)
    terms = {name: np.where(there, term, 0.0) for name, term in decision.terms.items()}
    return replace(decision, forces=forces, goals=goals, terms=terms)


class Broadcast(NamedTuple):
    """Messages of all robots from one step: `places`, (n, 2) m, and which robot's `reaches` whom, (n, n)."""

    arrives: int
    sent: int
    places: Array
    reaches: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class Inbox:
    """Messages received and messages in flight; immutable, replaced at each step."""

    sent: IntArray
    """The step at which the newest message that row's robot has of column's was sent, or `NEVER`, (n, n)."""
    arrived: IntArray
    """The step at which it arrived, (n, n)."""
    places: Array
    """Positions that the messages told, (n, n, 2) m."""
    on_the_way: tuple[Broadcast, ...] = ()
    """In the order in which they arrive."""

    @classmethod
    def create_empty(cls, count: int) -> Inbox:
        """Return what `count` robots know that have heard nothing yet."""
        sent, arrived = np.full((2, count, count), NEVER, dtype=np.intp)
        return cls(sent, arrived, np.zeros((count, count, 2)))

    def select_robots(self, rows: IntArray) -> Inbox:
        """Return what remains for a team in which robot i was that of `rows[i]`; -1 is one that is new."""
        old, new = np.maximum(rows, 0), np.asarray(rows) < 0
        strange, pairs = new[:, None] | new, np.ix_(old, old)
        on_the_way = tuple(
            each._replace(places=each.places[old], reaches=each.reaches[pairs] & ~strange)
            for each in self.on_the_way
        )
        sent, arrived = (np.where(strange, NEVER, steps[pairs]) for steps in (self.sent, self.arrived))
        return Inbox(sent, arrived, self.places[pairs], on_the_way)
