"""Last known positions of all robots of a team, which robots pass on to each other by messages."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.controllers.density_exchange import HEADER_BYTES
from robocov.controllers.exploration.shared_map import CERTAIN_RANGE_FRACTION, MAX_SILENCE_S
from robocov.observation import Message, Observations
from robocov.team import Team

SIGHTING_BYTES = 14
"""Size of a sighting: 2 bytes for the number of the robot, 4 for its time, 8 for its position."""


class SightingList(NamedTuple):
    """Content of a message with the k robots that the sender knows of."""

    robots: IntArray
    """(k,) Numbers of the robots."""
    positions: Array
    """(k, 2) m, their last known positions; nan for lost robots."""
    times: Array
    """(k,) s, the times of these positions."""


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Last known position of each robot, as known to each robot. Immutable.

    A robot that is not heard where it was last seen is lost. From then on its position is nan. Robots pass
    this on like any other position, until there is a newer sighting.

    Attributes
    ----------
    positions : (n, n, 2) array, m
        Row i contains what robot i knows; nan for lost and unknown robots.
    times : (n, n) array, s
        When the robots were at these positions; -inf for unknown robots.
    """

    positions: Array
    times: Array

    @classmethod
    def create_empty(cls, robot_count: int) -> Sightings:
        """Create the sightings of robots that know of no other robot."""
        shape = (robot_count, robot_count)
        return cls(positions=np.full((*shape, 2), np.nan), times=np.full(shape, -np.inf))

    def update(self, seen: Observations, team: Team) -> Sightings:
        """Return the sightings, updated with the robots heard in this step and without the lost ones.

        Parameters
        ----------
        seen : Observations
        team : Team

        Returns
        -------
        Sightings
        """
        positions = self.positions.copy()
        times = self.times.copy()
        pairs = seen.find_near_neighbors(np.inf)
        positions[pairs.robot, pairs.neighbor] = seen.positions[pairs.robot] - pairs.offset
        times[pairs.robot, pairs.neighbor] = seen.time
        distances = np.sqrt(((positions - seen.positions[:, None]) ** 2).sum(axis=2))
        is_silent = seen.time - times > MAX_SILENCE_S
        certain_ranges = CERTAIN_RANGE_FRACTION * team.communication_range
        is_lost = is_silent & (distances < certain_ranges[:, None])
        np.fill_diagonal(is_lost, val=False)
        positions[is_lost] = np.nan
        times[is_lost] = seen.time
        return replace(self, positions=positions, times=times)

    def receive(self, seen: Observations) -> Sightings:
        """Return the sightings, updated with the newer ones that the robots receive in this step."""
        if not seen.messages:
            return self
        positions = self.positions.copy()
        times = self.times.copy()
        for robot in range(len(times)):
            for message in seen.get_messages(robot):
                content = message.payload
                if isinstance(content, SightingList):
                    is_newer = content.times > times[robot, content.robots]
                    updated = content.robots[is_newer]
                    positions[robot, updated] = content.positions[is_newer]
                    times[robot, updated] = content.times[is_newer]
        return replace(self, positions=positions, times=times)

    def build_message(self, robot: int) -> Message:
        """Build the message with which a robot reports all robots that it knows of, except itself."""
        known = np.flatnonzero(np.isfinite(self.times[robot]))
        known = known[known != robot]
        content = SightingList(
            robots=known, positions=self.positions[robot, known], times=self.times[robot, known]
        )
        return Message(content, HEADER_BYTES + SIGHTING_BYTES * len(known))

    def list_pairs(self) -> tuple[IntArray, Array]:
        """List the pairs of a robot and another one whose position it knows.

        Returns
        -------
        robots : (m,) int array
            The robot in each pair, ascending.
        positions : (m, 2) array, m
            The position of the other one.
        """
        is_known = np.isfinite(self.positions[:, :, 0])
        np.fill_diagonal(is_known, val=False)
        robots, others = np.nonzero(is_known)
        return robots, self.positions[robots, others]
