"""Visits of robots to targets on frontiers, each of which ends after a limited time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.controllers.density_exchange import HEADER_BYTES
from robocov.observation import Message, Observations
from robocov.typing import BoolArray, FloatArray, IntArray

NO_TARGETS = np.empty((0, 2))
"""The positions of no targets."""
TARGET_BYTES = 8
"""Size of the position of a target in a message."""
NO_VISIT = -1
"""Index that stands for no visit."""
VISIT_RADIUS_M = 0.5
"""Distance below which two targets belong to the same visit."""


class VisitReport(NamedTuple):
    """Content of a message about the visits that are over."""

    targets: FloatArray
    """(v, 2) m, the targets of these visits."""


class Visits(NamedTuple):
    """Visits of the k robots of a group to targets on frontiers. Immutable.

    A visit is over after an arrival, or when robots have headed for its target for a limited time. The visits
    that are over are remembered as well, so that no robot visits their targets again.
    """

    positions: FloatArray
    """(v, 2) m, the first target of each visit. Later targets close to it belong to the same visit."""
    durations: FloatArray
    """(v,) s, time for which robots have headed for the target. Infinite after an arrival."""
    limits: FloatArray
    """(v,) s, time after which the target is given up."""
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

    def build_message(self) -> Message:
        """Build the message in which a robot reports the visits that are over."""
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

    def add_reported(self, targets: FloatArray) -> Visits:
        """Return the visits together with those that other robots have reported as over.

        Parameters
        ----------
        targets : (t, 2) array, m
            Targets of the reported visits.

        Returns
        -------
        Visits
            Without reported visits close to one that is over already.
        """
        added = targets[~self.find_excluded(targets)]
        return self._replace(
            positions=np.vstack([self.positions, added]),
            durations=np.append(self.durations, np.full(len(added), np.inf)),
            limits=np.append(self.limits, np.zeros(len(added))),
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


def receive_reported_targets(seen: Observations, robot: int) -> FloatArray:
    """Return the targets in the reports of visits that a robot receives in this step, (t, 2) m."""
    reports = [
        message.payload.targets
        for message in seen.get_messages(robot)
        if isinstance(message.payload, VisitReport)
    ]
    return np.concatenate([NO_TARGETS, *reports])
