"""Visits of robots to targets on frontiers, each of which ends after a limited time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.observation import Message, Observations
from robocov.observation.messages import HEADER_BYTES
from robocov.typing import BoolArray, FloatArray, IntArray

NO_TARGETS = np.empty((0, 2))
"""An empty array of targets."""
TARGET_BYTES = 8
"""Size of a target in a message: 4 bytes for each coordinate."""
NO_VISIT = -1
"""Index that stands for no visit."""
VISIT_RADIUS_M = 0.5
"""Distance below which two targets belong to the same visit."""


class VisitReport(NamedTuple):
    """Content of a message about the visits that the sender knows to be over."""

    targets: FloatArray
    """(t, 2) m, targets of these visits."""


class Visits(NamedTuple):
    """Visits of the k robots of a group to targets on frontiers. Immutable.

    A visit is over after an arrival, when robots have headed for its target for a limited time, or when
    another robot reports that it is over. The visits that are over are remembered as well, so that no robot
    visits their targets again.
    """

    positions: FloatArray
    """(v, 2) m, the first target of each visit. Later targets close to it belong to the same visit."""
    durations: FloatArray
    """(v,) s, time for which robots have headed for the target. Infinite after an arrival or a report."""
    limits: FloatArray
    """(v,) s, time after which the target is given up; 0 for visits that other robots reported."""
    current: IntArray
    """(k,) Index of the visit that each robot is on, or `NO_VISIT`."""

    @classmethod
    def build_empty(cls, robot_count: int) -> Visits:
        """Build the visits of robots that have not visited any target yet.

        Parameters
        ----------
        robot_count : int

        Returns
        -------
        Visits
        """
        return cls(
            positions=NO_TARGETS,
            durations=np.empty(0),
            limits=np.empty(0),
            current=np.full(robot_count, NO_VISIT),
        )

    @property
    def is_over(self) -> BoolArray:
        """Whether each visit is over, (v,)."""
        return np.asarray(self.durations >= self.limits)

    def build_report(self) -> Message:
        """Build the message in which a robot reports the visits that are over.

        Returns
        -------
        Message
            With a `VisitReport` as its payload.
        """
        targets = self.positions[self.is_over]
        return Message(VisitReport(targets), HEADER_BYTES + TARGET_BYTES * len(targets))

    def find_excluded(self, targets: FloatArray) -> BoolArray:
        """Find the targets that belong to visits that are over.

        Parameters
        ----------
        targets : (t, 2) array, m

        Returns
        -------
        (t,) bool array
            Whether each target belongs to such a visit.
        """
        over = self.positions[self.is_over]
        squared_distances = ((targets[:, None] - over) ** 2).sum(axis=2).min(axis=1, initial=np.inf)
        return np.asarray(squared_distances < VISIT_RADIUS_M**2)

    def select_new(self, targets: FloatArray) -> FloatArray:
        """Select the targets that differ from those of all visits that are over.

        Targets are compared exactly, not within `VISIT_RADIUS_M`, so that all robots exclude the same ones.

        Parameters
        ----------
        targets : (t, 2) array, m

        Returns
        -------
        (s, 2) array, m
        """
        over = self.positions[self.is_over]
        is_known = (targets[:, None] == over).all(axis=2).any(axis=1)
        return np.asarray(targets[~is_known])

    def add_reported(self, targets: FloatArray) -> Visits:
        """Return the visits together with visits that other robots have reported as over.

        Parameters
        ----------
        targets : (t, 2) array, m
            Targets of the reported visits.

        Returns
        -------
        Visits
            The indices of earlier visits stay the same.
        """
        count = len(targets)
        return self._replace(
            positions=np.vstack([self.positions, targets]),
            durations=np.append(self.durations, np.full(count, np.inf)),
            limits=np.append(self.limits, np.zeros(count)),
        )

    def stop(self, robots_on_visit: IntArray, has_arrived: BoolArray, time_spent: float) -> Visits:
        """Return the visits after some time. No robot is on a visit any more.

        Parameters
        ----------
        robots_on_visit : (k,) int array
            Index of the visit that each robot has been on, or `NO_VISIT`.
        has_arrived : (k,) bool array
            Whether each robot has arrived at its target.
        time_spent : float, s
            Time since the visits were started.

        Returns
        -------
        Visits
        """
        is_on_visit = robots_on_visit != NO_VISIT
        durations = self.durations.copy()
        # Several robots may be on the same visit, whose time counts once.
        durations[np.unique(robots_on_visit[is_on_visit])] += time_spent
        durations[robots_on_visit[is_on_visit & has_arrived]] = np.inf
        return self._replace(durations=durations, current=np.full(len(robots_on_visit), NO_VISIT))

    def start(self, target: FloatArray, is_visitor: BoolArray, limit: float) -> Visits:
        """Return the visits after some robots have started to head for a target.

        A target close to that of an earlier visit continues this visit, so that the time adds up.

        Parameters
        ----------
        target : (2,) array, m
        is_visitor : (k,) bool array
            Whether each robot heads for the target.
        limit : float, s
            Time for which robots may head for the target before it is given up, including the time of an
            earlier visit. If the earlier visit has a longer limit, that limit stays.

        Returns
        -------
        Visits
        """
        squared_distances = ((self.positions - target) ** 2).sum(axis=1)
        if squared_distances.min(initial=np.inf) < VISIT_RADIUS_M**2:
            visit = int(squared_distances.argmin())
            visits = self
        else:
            visit = len(self.positions)
            visits = self._replace(
                positions=np.vstack([self.positions, target]),
                durations=np.append(self.durations, 0.0),
                limits=np.append(self.limits, limit),
            )
        limits = visits.limits.copy()
        limits[visit] = max(limits[visit], limit)
        return visits._replace(limits=limits, current=np.where(is_visitor, visit, self.current))


def extract_reported_targets(seen: Observations, robot: int) -> FloatArray:
    """Extract the targets from the reports of visits that reach a robot in a step.

    Parameters
    ----------
    seen : Observations
    robot : int
        Index of the receiver.

    Returns
    -------
    (t, 2) array, m
    """
    reports = [
        message.payload.targets
        for message in seen.get_messages(robot)
        if isinstance(message.payload, VisitReport)
    ]
    return np.concatenate([NO_TARGETS, *reports])
