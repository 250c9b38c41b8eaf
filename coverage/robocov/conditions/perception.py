"""Imperfect perception: noisy observations, and positions known only from messages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from robocov.arrays import compute_point_distances
from robocov.conditions.communication import Inbox, Radio
from robocov.conditions.conditions import Conditions
from robocov.conditions.random_streams import (
    POSITION_STREAM,
    SCANNING_STREAM,
    SENSING_STREAM,
    create_generator,
)
from robocov.observation import Decision, DensitySensor, Observations, Scans
from robocov.team import Team
from robocov.typing import BoolArray, FloatArray

MIN_MEASURED_DISTANCE_M = 1e-3
"""Minimum distance that a noisy range sensor measures."""


class Perception:
    """Computes the observations of robots under given conditions.

    Row i of each array is known only to robot i.

    Parameters
    ----------
    conditions : Conditions
        The noise of the sensors, and the limits of the communication.
    team : Team
        The n robots.
    dt : float, s
        Control period.
    """

    def __init__(self, conditions: Conditions, team: Team, dt: float) -> None:
        self._conditions = conditions
        self._dt = dt
        self._robot_count = len(team)
        self._sensing_ranges = team.sensing_range
        self._radio = Radio(conditions, team.communication_range, dt)

    def create_inbox(self) -> Inbox | None:
        """Create the inbox before the first step.

        Returns
        -------
        Inbox or None
            None if communication is ideal.
        """
        return Inbox.create_empty(self._robot_count) if self._conditions.uses_messages else None

    def perceive(
        self, ideal: Observations, inbox: Inbox | None, is_working: BoolArray
    ) -> tuple[Observations, Inbox | None]:
        """Compute the observations of the robots in a step.

        Parameters
        ----------
        ideal : Observations
            The observations under ideal conditions, which contain the true positions.
        inbox : Inbox or None
            Messages before the step; None if communication is ideal and no messages are in flight.
        is_working : (n,) bool array
            Mask of the working robots.

        Returns
        -------
        observations : Observations
            The observations under the conditions.
        inbox : Inbox or None
            Messages after the positions of the step were exchanged; unchanged if communication is ideal.
        """
        step = round(ideal.time / self._dt)
        positions = self._add_position_noise(step, ideal.positions)
        obstacle_points = self._measure_obstacle_points(step, ideal, positions)
        if not is_working.all():
            obstacle_points = np.where(is_working[:, None], obstacle_points, np.nan)
            obstacle_points.setflags(write=False)
        density = ideal.density
        density_sensor = ideal.density_sensor
        if self._conditions.hides_density:
            density = None
            density_sensor = DensitySensor.build(
                ideal.density,
                positions=ideal.positions,
                known_positions=positions,
                sensing_ranges=self._sensing_ranges,
            )
        observations = replace(
            ideal,
            positions=positions,
            obstacle_points=obstacle_points,
            scans=self._add_scanning_noise(step, ideal.scans),
            density=density,
            density_sensor=density_sensor,
        )
        # Under ideal communication, the inbox contains at most controller messages, and neighbors know each
        # other's positions.
        if inbox is None or not self._conditions.uses_messages:
            neighbors = ideal.neighbors.restrict_to_working(is_working)
            return replace(observations, neighbors=neighbors), inbox
        inbox = self._radio.exchange_positions(inbox, step, positions, ideal.positions, is_working)
        reports = self._radio.read_reports(inbox, step, is_working)
        observations = replace(
            observations,
            neighbors=reports.neighbors,
            reported_positions=reports.positions,
            report_ages=reports.ages,
        )
        return observations, inbox

    def _add_position_noise(self, step: int, positions: FloatArray) -> FloatArray:
        """Return the robots' own estimates of their positions, (n, 2) m."""
        sigma = self._conditions.position_noise
        if not sigma:
            return positions
        rng = create_generator(self._conditions.seed, POSITION_STREAM, step)
        noisy = positions + rng.normal(scale=sigma, size=positions.shape)
        noisy.setflags(write=False)
        return np.asarray(noisy)

    def _measure_obstacle_points(
        self, step: int, ideal: Observations, known_positions: FloatArray
    ) -> FloatArray:
        """Return the obstacle points as the robots know them, (n, 2) m.

        A robot measures the distance and direction of its obstacle point, with noise in the distance. It
        locates the point relative to its own estimated position.
        """
        sigma = self._conditions.sensing_noise
        if not sigma and not self._conditions.position_noise:
            return ideal.obstacle_points
        offset = ideal.obstacle_points - ideal.positions
        if sigma:
            distance = compute_point_distances(ideal.obstacle_points, ideal.positions)
            rng = create_generator(self._conditions.seed, SENSING_STREAM, step)
            noise = rng.normal(scale=sigma, size=self._robot_count)
            measured = np.maximum(distance + noise, MIN_MEASURED_DISTANCE_M)
            # A point at distance zero has no direction in which to move it, and stays where it is.
            has_direction = distance > 0.0
            divisor = np.where(has_direction, distance, 1.0)
            offset *= np.where(has_direction, measured / divisor, 1.0)[:, None]
        measured_points = np.asarray(known_positions + offset)
        measured_points.setflags(write=False)
        return measured_points

    def _add_scanning_noise(self, step: int, scans: Scans | None) -> Scans | None:
        """Return the scans with noise on the rays that meet an obstacle."""
        sigma = self._conditions.sensing_noise
        if scans is None or not sigma:
            return scans
        rng = create_generator(self._conditions.seed, SCANNING_STREAM, step)
        noise = rng.normal(scale=sigma, size=scans.distances.shape)
        measured = np.maximum(scans.distances + noise, MIN_MEASURED_DISTANCE_M)
        distances = np.where(scans.is_hit, measured, scans.distances)
        distances.setflags(write=False)
        return replace(scans, distances=distances)


def restrict_decision_to_working(decision: Decision, is_working: BoolArray) -> Decision:
    """Return a decision without the forces and goals of robots that have failed or have not joined yet.

    Parameters
    ----------
    decision : Decision
        The decision of the controller, for all robots.
    is_working : (n,) bool array
        Mask of the working robots.

    Returns
    -------
    Decision
        The forces of the other robots are 0, and their goals nan. The same object if all robots work.
    """
    if is_working.all():
        return decision
    # One column, so that the mask applies to both coordinates.
    column = is_working[:, None]
    goals = decision.goals
    if goals is not None:
        goals = np.where(column, goals, np.nan)
    return replace(
        decision,
        forces=np.where(column, decision.forces, 0.0),
        goals=goals,
        terms={name: np.where(column, term, 0.0) for name, term in decision.terms.items()},
    )
