"""What robots know under conditions: the ideal observations, made as bad as the conditions say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.conditions import POSITION, SCANNING, SENSING, Conditions
from robocov.conditions.communication import Inbox, Radio
from robocov.conditions.draws import Draws
from robocov.observation import Decision, Observations
from robocov.observation.scans import Scans
from robocov.robots import Team

NEAREST = 1e-3
"""The shortest distance in metres that a noisy range sensor measures."""


class Perception:
    """Turns what is there into what the robots know.

    Row i of what they know still belongs to robot i: messages are what i received, and noise is drawn for
    i, by the step and its row alone.
    """

    def __init__(self, conditions: Conditions, team: Team, dt: float) -> None:
        self._conditions, self._dt = conditions, dt
        self._robots = np.arange(len(team))
        self._radio = Radio(conditions, team.communication_range, dt) if conditions.talks else None
        self._position_chance = Draws(conditions.seed, POSITION)
        self._sensing_chance = Draws(conditions.seed, SENSING)
        self._scanning_chance = Draws(conditions.seed, SCANNING)

    def begin(self) -> Inbox | None:
        """Return what the robots have heard before the first step; None where communication is ideal."""
        return None if self._radio is None else Inbox.empty(len(self._robots))

    def known(
        self, seen: Observations, inbox: Inbox | None, working: BoolArray
    ) -> tuple[Observations, Inbox | None]:
        """Return what the robots know that work, (n,) bool, and what they have heard by then.

        `seen` is the truth: where the robots are, who is in range, what the sensor ought to measure; `inbox`
        is as after the step before.
        """
        step = round(seen.time / self._dt)
        truth = seen.positions
        positions = self._estimated(step, truth)
        points = self._sensed(step, seen, positions)
        if not working.all():
            points = np.where(working[:, None], points, np.nan)
        points.setflags(write=False)
        seen = replace(seen, positions=positions, obstacle_points=points, scans=self._scanned(step, seen))
        if self._radio is None or inbox is None:
            return replace(seen, neighbours=seen.neighbours.among(working)), None
        inbox = self._radio.exchange(inbox, step, positions, truth, working)
        neighbours, places, ages = self._radio.reports(inbox, step, working)
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
            offset *= np.where(distance > 0.0, np.maximum(noisy, NEAREST) / away, 1.0)[:, None]
        return np.asarray(positions + offset)

    def _scanned(self, step: int, seen: Observations) -> Scans | None:
        """Return the scans as they are measured: what meets nothing is told to meet nothing."""
        scans, sigma = seen.scans, self._conditions.sensing_noise
        if scans is None or not sigma:
            return scans
        rays = np.arange(scans.distances.shape[1])
        error = sigma * self._scanning_chance.normal(step, self._robots[:, None], rays)[..., 0]
        distances = np.where(scans.hit, np.maximum(scans.distances + error, NEAREST), scans.distances)
        distances.setflags(write=False)
        return replace(scans, distances=distances)


def of_working(decision: Decision, working: BoolArray) -> Decision:
    """Return a decision in which robots that do not work, (n,) bool, want nothing."""
    if working.all():
        return decision
    idle = ~working
    forces = np.where(idle[:, None], 0.0, decision.forces)
    goals = None if decision.goals is None else np.where(idle[:, None], np.nan, decision.goals)
    terms = {name: np.where(idle[:, None], 0.0, term) for name, term in decision.terms.items()}
    return replace(decision, forces=forces, goals=goals, terms=terms)
