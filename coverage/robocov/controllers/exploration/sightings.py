"""Last known positions of all robots of a team, which robots pass on to each other in messages."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robocov.controllers.exploration.shared_map import CERTAIN_RANGE_FRACTION, MAX_SILENCE_S
from robocov.observation import Message, Observations
from robocov.observation.messages import HEADER_BYTES
from robocov.team import Team
from robocov.typing import FloatArray, IntArray

SIGHTING_BYTES = 14
"""Size of the last known position of one robot: 2 bytes for its index, 4 for the time, 8 for the position."""


class SightingReport(NamedTuple):
    """Content of a message about the k robots that the sender knows of."""

    robots: IntArray
    """(k,) Indices of the robots."""
    positions: FloatArray
    """(k, 2) m, their last known positions; nan for lost robots."""
    times: FloatArray
    """(k,) s, times at which they were there, or were found to be lost."""


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """The last known positions of all robots, as known to each robot. Immutable.

    A robot is lost if it has been silent for long although it would certainly be in range at its last known
    position. Its position is nan from then on. Robots pass this on like any other position, until there is a
    newer one.

    Attributes
    ----------
    positions : (n, n, 2) array, m
        Entry (i, j) is the last position of robot j that robot i knows; nan if j is lost or unknown to i.
    times : (n, n) array, s
        Time at which robot j was there, or was found to be lost; -inf if j is unknown to i.
    """

    positions: FloatArray
    times: FloatArray

    @classmethod
    def build_empty(cls, robot_count: int) -> Sightings:
        """Build the sightings of robots that know of no other robot."""
        shape = (robot_count, robot_count)
        return cls(positions=np.full((*shape, 2), np.nan), times=np.full(shape, -np.inf))

    def update(self, seen: Observations, team: Team) -> Sightings:
        """Return the sightings after a step: with the current neighbors, and without the lost robots.

        Parameters
        ----------
        seen : Observations
        team : Team
            For the communication range of each robot.

        Returns
        -------
        Sightings
        """
        positions = self.positions.copy()
        times = self.times.copy()
        pairs = seen.find_neighbors()
        report_times = np.full(len(pairs.robots), seen.time)
        if seen.report_ages is not None:
            report_times -= seen.report_ages
        # The report of another robot may be newer than that of the neighbor itself.
        is_newer = report_times >= times[pairs.robots, pairs.neighbors]
        robots = pairs.robots[is_newer]
        neighbors = pairs.neighbors[is_newer]
        positions[robots, neighbors] = seen.positions[robots] - pairs.offsets[is_newer]
        times[robots, neighbors] = report_times[is_newer]
        distances = np.sqrt(((positions - seen.positions[:, None]) ** 2).sum(axis=2))
        is_silent = seen.time - times > MAX_SILENCE_S
        certain_ranges = CERTAIN_RANGE_FRACTION * team.communication_range
        is_lost = is_silent & (distances < certain_ranges[:, None])
        np.fill_diagonal(is_lost, val=False)
        positions[is_lost] = np.nan
        times[is_lost] = seen.time
        return replace(self, positions=positions, times=times)

    def receive(self, seen: Observations) -> Sightings:
        """Return the sightings with the newer ones in the messages that arrive in this step."""
        if not seen.messages:
            return self
        positions = self.positions.copy()
        times = self.times.copy()
        for robot in range(len(times)):
            for message in seen.get_messages(robot):
                content = message.payload
                if isinstance(content, SightingReport):
                    is_newer = content.times > times[robot, content.robots]
                    others = content.robots[is_newer]
                    positions[robot, others] = content.positions[is_newer]
                    times[robot, others] = content.times[is_newer]
        return replace(self, positions=positions, times=times)

    def build_message(self, robot: int) -> Message:
        """Build the message in which a robot reports all robots that it knows of, except itself."""
        known = np.flatnonzero(np.isfinite(self.times[robot]))
        known = known[known != robot]
        content = SightingReport(
            robots=known, positions=self.positions[robot, known], times=self.times[robot, known]
        )
        return Message(content, HEADER_BYTES + SIGHTING_BYTES * len(known))

    def list_pairs(self) -> tuple[IntArray, FloatArray]:
        """List all pairs of a robot and another robot whose position it knows.

        Returns
        -------
        robots : (m,) int array
            Index of the first robot of each pair, ascending.
        positions : (m, 2) array, m
            Last position of the second robot that the first one knows.
        """
        is_known = np.isfinite(self.positions[:, :, 0])
        np.fill_diagonal(is_known, val=False)
        robots, others = np.nonzero(is_known)
        return robots, self.positions[robots, others]
