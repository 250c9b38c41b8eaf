"""Imperfect perception: noisy observations, and messages in place of ideal communication."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocov.arrays import Array, BoolArray, compute_point_distances
from robocov.conditions.communication import Inbox, Radio
from robocov.conditions.conditions import Conditions
from robocov.conditions.random_streams import (
    POSITION_STREAM,
    SCANNING_STREAM,
    SENSING_STREAM,
    create_generator,
)
from robocov.observation import Decision, Observations, Scans
from robocov.team import Team

MIN_MEASURED_DISTANCE_M = 1e-3
"""Shortest distance that a noisy range sensor measures."""


class Perception:
    """Turns the true state into the observations of the robots. Only robot i knows row i.

    Parameters
    ----------
    conditions : Conditions
    team : Team
        n robots.
    dt : float, s
        Control period.
    """

    def __init__(self, conditions: Conditions, team: Team, dt: float) -> None:
        self._conditions = conditions
        self._dt = dt
        self._count = len(team)
        self._radio = Radio(conditions, team.communication_range, dt)

    def create_inbox(self) -> Inbox | None:
        """Create the inbox before the first step.

        Returns
        -------
        Inbox or None
            None if communication is ideal.
        """
        return Inbox.create_empty(self._count) if self._conditions.uses_messages else None

    def perceive(
        self, truth: Observations, inbox: Inbox | None, working: BoolArray
    ) -> tuple[Observations, Inbox | None]:
        """Compute the observations of the robots in a step.

        Parameters
        ----------
        truth : Observations
            Observations under ideal conditions.
        inbox : Inbox or None
            Messages before the step; None if communication is ideal and no messages are in flight.
        working : (n,) bool array
            Mask of the robots that work.

        Returns
        -------
        observations : Observations
        inbox : Inbox or None
            Messages after the positions of the step were exchanged.
        """
        step = round(truth.time / self._dt)
        positions = self._add_position_noise(step, truth.positions)
        obstacle_points = self._add_sensing_noise(step, truth, positions)
        if not working.all():
            obstacle_points = np.where(working[:, None], obstacle_points, np.nan)
        obstacle_points.setflags(write=False)
        observations = replace(
            truth,
            positions=positions,
            obstacle_points=obstacle_points,
            scans=self._add_scanning_noise(step, truth.scans),
        )
        if inbox is None or not self._conditions.uses_messages:
            neighbors = truth.neighbors.restrict_to_working(working)
            return replace(observations, neighbors=neighbors), inbox
        inbox = self._radio.exchange_positions(inbox, step, positions, truth.positions, working)
        neighbors, reported_positions, ages = self._radio.read_reports(inbox, step, working)
        observations = replace(
            observations,
            neighbors=neighbors,
            reported_positions=reported_positions,
            report_ages=ages,
        )
        return observations, inbox

    def _add_position_noise(self, step: int, positions: Array) -> Array:
        """Return the robots' own estimates of their positions, (n, 2) m."""
        sigma = self._conditions.position_noise
        if not sigma:
            return positions
        rng = create_generator(self._conditions.seed, POSITION_STREAM, step)
        noisy = positions + rng.normal(scale=sigma, size=positions.shape)
        noisy.setflags(write=False)
        return np.asarray(noisy)

    def _add_sensing_noise(self, step: int, truth: Observations, positions: Array) -> Array:
        """Return the measured obstacle points, (n, 2) m; the robots think that they are at `positions`."""
        sigma = self._conditions.sensing_noise
        if not sigma and positions is truth.positions:
            return truth.obstacle_points
        offset = truth.obstacle_points - truth.positions
        if sigma:
            distance = compute_point_distances(truth.obstacle_points, truth.positions)
            rng = create_generator(self._conditions.seed, SENSING_STREAM, step)
            noise = rng.normal(scale=sigma, size=self._count)
            measured = np.maximum(distance + noise, MIN_MEASURED_DISTANCE_M)
            # The direction to a point at distance zero is undefined: it stays where it is.
            has_direction = distance > 0.0
            divisor = np.where(has_direction, distance, 1.0)
            offset *= np.where(has_direction, measured / divisor, 1.0)[:, None]
        return np.asarray(positions + offset)

    def _add_scanning_noise(self, step: int, scans: Scans | None) -> Scans | None:
        """Return the scans as measured. A ray that meets no obstacle is measured without noise."""
        sigma = self._conditions.sensing_noise
        if scans is None or not sigma:
            return scans
        rng = create_generator(self._conditions.seed, SCANNING_STREAM, step)
        noise = rng.normal(scale=sigma, size=scans.distances.shape)
        measured = np.maximum(scans.distances + noise, MIN_MEASURED_DISTANCE_M)
        distances = np.where(scans.hit, measured, scans.distances)
        distances.setflags(write=False)
        return replace(scans, distances=distances)


def ignore_idle_robots(decision: Decision, working: BoolArray) -> Decision:
    """Remove the forces and goals of robots that do not work from a decision.

    Parameters
    ----------
    decision : Decision
    working : (n,) bool array

    Returns
    -------
    Decision
        The same object if all robots work.
    """
    if working.all():
        return decision
    is_working = working[:, None]
    goals = decision.goals
    if goals is not None:
        goals = np.where(is_working, goals, np.nan)
    return replace(
        decision,
        forces=np.where(is_working, decision.forces, 0.0),
        goals=goals,
        terms={name: np.where(is_working, term, 0.0) for name, term in decision.terms.items()},
    )
