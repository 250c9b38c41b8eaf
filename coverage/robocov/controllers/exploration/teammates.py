"""A robot's knowledge of each of the others: position, time of the last message, and time at rest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from robocov.observation import Observations
from robocov.typing import BoolArray, FloatArray, IntArray

REST_RADIUS_M = 0.1
"""A robot is at rest while it stays within this distance of one point."""
REPORT_BYTES = 28
"""Size of a report about one robot: its index, its position, and the time of its last message."""


@dataclass(frozen=True, slots=True, eq=False)
class TeammateReport:
    """Message in which a robot reports k other robots to its neighbors. Immutable.

    Attributes
    ----------
    robots : (k,) int array
        Indices of the reported robots, ascending.
    positions : (k, 2) array, m
        Their known or assumed positions.
    message_times : (k,) array, s
        Times of their last messages.
    """

    robots: IntArray
    positions: FloatArray
    message_times: FloatArray

    @property
    def size(self) -> int:
        """Size of a message with the report, bytes: 28 for each robot."""
        return REPORT_BYTES * len(self.robots)


class Teammates(NamedTuple):
    """Knowledge of a robot about k others."""

    robots: IntArray
    """(k,) Indices of the others, ascending."""
    positions: FloatArray
    """(k, 2) m, their known or assumed positions."""
    message_times: FloatArray
    """(k,) s, times of their last messages."""
    message_distances: FloatArray
    """(k,) m, their distances from the robot at these times; infinite for messages known from reports."""
    rest_times: FloatArray
    """(k,) s, times since which they have been within `REST_RADIUS_M` of `rest_positions`."""
    rest_positions: FloatArray
    """(k, 2) m, positions near which they have been since then."""

    @classmethod
    def build_empty(cls) -> Teammates:
        """Build the knowledge of a robot that has not received any message."""
        return cls(
            robots=np.empty(0, dtype=np.intp),
            positions=np.empty((0, 2)),
            message_times=np.empty(0),
            message_distances=np.empty(0),
            rest_times=np.empty(0),
            rest_positions=np.empty((0, 2)),
        )

    def add_observation(
        self,
        robots: IntArray,
        positions: FloatArray,
        own_position: FloatArray,
        time: float,
        is_lost: BoolArray,
    ) -> Teammates:
        """Return the knowledge after the current neighbors are added, and lost robots removed.

        Parameters
        ----------
        robots : (m,) int array
            Indices of the current neighbors.
        positions : (m, 2) array, m
            Positions of these robots.
        own_position : (2,) array, m
        time : float, s
        is_lost : (k,) bool array
            Whether each robot known so far has failed or is missing. It is removed unless it is a neighbor.

        Returns
        -------
        Teammates
        """
        now = np.full(len(robots), time)
        observed = Teammates(
            robots=robots,
            positions=positions,
            message_times=now,
            message_distances=np.sqrt(((positions - own_position) ** 2).sum(axis=1)),
            rest_times=now,
            rest_positions=positions,
        )
        is_kept = ~(np.isin(self.robots, robots) | is_lost)
        joined = Teammates(
            *(np.concatenate([new, old[is_kept]]) for new, old in zip(observed, self, strict=True))
        )
        updated = joined._select(np.argsort(joined.robots))
        # Robots that are still close to where they came to rest keep that position and its time.
        _, rows, previous_rows = np.intersect1d(
            updated.robots, self.robots, assume_unique=True, return_indices=True
        )
        moves = updated.positions[rows] - self.rest_positions[previous_rows]
        is_at_rest = np.sqrt((moves**2).sum(axis=1)) < REST_RADIUS_M
        rows = rows[is_at_rest]
        previous_rows = previous_rows[is_at_rest]
        updated.rest_positions[rows] = self.rest_positions[previous_rows]
        updated.rest_times[rows] = self.rest_times[previous_rows]
        return updated

    def build_report(self) -> TeammateReport:
        """Build the report of this knowledge for neighbors."""
        return TeammateReport(self.robots, self.positions, self.message_times)

    def add_reports(
        self, reports: Sequence[TeammateReport], robot: int, loss_times: Mapping[int, float]
    ) -> Teammates:
        """Return the knowledge with the reports of others, where these are more recent.

        Parameters
        ----------
        reports : sequence of TeammateReport
            Of several reports with the same time, the first one counts.
        robot : int
            Index of the robot itself; reports about it are ignored.
        loss_times : mapping of int to float, s
            Times at which the robot lost others. Only later reports about these count.

        Returns
        -------
        Teammates
        """
        sources: list[Sequence[FloatArray | IntArray]] = [self]
        before_start = -1.0
        for report in reports:
            min_times = [
                math.inf if other == robot else loss_times.get(other, before_start)
                for other in report.robots.tolist()
            ]
            is_new = report.message_times > np.array(min_times)
            reported = Teammates(
                robots=report.robots,
                positions=report.positions,
                message_times=report.message_times,
                # The robot may have been out of range at that time, so its silence does not show that it has
                # failed.
                message_distances=np.full(len(is_new), math.inf),
                rest_times=report.message_times,
                rest_positions=report.positions,
            )
            sources.append(reported._select(np.flatnonzero(is_new)))
        # One after another, each column of all sources.
        merged = Teammates(*(np.concatenate(columns) for columns in zip(*sources, strict=True)))
        # Keep the most recent row of each robot, or the first one of several. The sort is stable.
        order = np.lexsort((-merged.message_times, merged.robots))
        _, first_rows = np.unique(merged.robots[order], return_index=True)
        return merged._select(order[first_rows])

    def _select(self, rows: IntArray) -> Teammates:
        """Return the knowledge about some of the robots, in the given order."""
        columns: list[Any] = [column[rows] for column in self]
        return Teammates(*columns)


def receive_reports(seen: Observations, robot: int) -> dict[int, TeammateReport]:
    """Return the newest report from each sender among the messages that have arrived at a robot in a step.

    Parameters
    ----------
    seen : Observations
    robot : int
        Index of the receiver.

    Returns
    -------
    dict of int to TeammateReport
        Reports by the index of the sender.
    """
    return {
        message.sender: message.payload
        for message in seen.get_messages(robot)
        if isinstance(message.payload, TeammateReport)
    }
