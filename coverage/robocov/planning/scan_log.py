"""The scans that a robot has, its own and those of others, and the map that it builds from them.

All robots scan at the same times. The scans of one time are a *round*; rounds and robots are numbered from 0.
The map is the result of adding all scans in the order of rounds, and of robots within a round, whenever they
arrived. Robots with the same scans therefore have the same map, bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, BoolArray, IntArray
from robocov.observation import Scans
from robocov.observation.region import Region
from robocov.planning.discovered_map import DiscoveredMap

REPORTED_ROUNDS = 64
"""Number of rounds after the first missing scan of a robot of which an `Inventory` reports the scans."""

_DISTANCE_STEPS = 65535
"""Number of steps in which distances up to the diameter of the region are stored."""
_SCAN_HEADER_BYTES = 32
"""Size of the number of a robot and of a round, the time, and the position."""
_MAX_CHECKPOINT_GAP = 1.0
"""Maximum gap between two older checkpoints, as a fraction of the age of the younger one."""


@dataclass(frozen=True, slots=True, eq=False)
class NumberedScan:
    """A scan with the numbers of its robot and its round. Immutable.

    Attributes
    ----------
    robot : int
    number : int
        Number of the round.
    time : float, s
        Time at which it was taken.
    position : (2,) array, m
        Position of the robot, as it knew it.
    distances : (rays,) uint16 array
        Lengths of the rays, in steps of the diameter of the region divided by 65535.
    is_hit : (rays,) bool array
        Whether each ray ends at an obstacle.
    """

    robot: int
    number: int
    time: float
    position: Array
    distances: NDArray[np.uint16]
    is_hit: BoolArray

    @property
    def size(self) -> int:
        """Size of a message with the scan, bytes: 32, 2 for each ray, and 1 for every 8 rays.

        Examples
        --------
        >>> ray_count = 240
        >>> distances = np.zeros(ray_count, dtype=np.uint16)
        >>> NumberedScan(0, 0, 0.0, np.zeros(2), distances, distances > 0).size
        542
        """
        rays = len(self.distances)
        return _SCAN_HEADER_BYTES + 2 * rays + -(-rays // 8)

    def __deepcopy__(self, memo: object) -> NumberedScan:
        return self


def number_scans(
    scans: Scans, positions: Array, region: Region, *, number: int, time: float
) -> list[NumberedScan]:
    """Build the numbered scans of a round.

    Parameters
    ----------
    scans : Scans
        A scan of each robot.
    positions : (n, 2) array, m
        Positions of the robots, as they know them.
    region : Region
    number : int
        Number of the round.
    time : float, s

    Returns
    -------
    list of NumberedScan
        One for each robot.
    """
    step_m = region.diameter / _DISTANCE_STEPS
    distances = np.rint(np.minimum(scans.distances, region.diameter) / step_m).astype(np.uint16)
    positions = np.array(positions)
    is_hit = np.array(scans.hit)
    for array in (distances, positions, is_hit):
        array.setflags(write=False)
    return [
        NumberedScan(robot, number, time, positions[robot], distances[robot], is_hit[robot])
        for robot in range(len(positions))
    ]


class Inventory(NamedTuple):
    """The scans that a robot has, as it reports them to others."""

    counts: IntArray
    """(n,) Number of the first scan of each robot that is missing."""
    has_later: BoolArray
    """(n, `REPORTED_ROUNDS`) Whether the scan of each robot is there in each of the rounds after that."""

    def find_missing(self, is_present: BoolArray) -> BoolArray:
        """Find the scans that are missing in this inventory, among those that are present elsewhere.

        Parameters
        ----------
        is_present : (rounds, n) bool array

        Returns
        -------
        (rounds, n) bool array
            False for scans of rounds that the inventory does not report.
        """
        offsets = np.arange(len(is_present))[:, None] - self.counts - 1
        is_reported = (offsets >= -1) & (offsets < REPORTED_ROUNDS)
        columns = np.clip(offsets, 0, REPORTED_ROUNDS - 1)
        robots = np.arange(len(self.counts))
        is_there = (offsets >= 0) & self.has_later[robots, columns]
        return np.asarray(is_present & is_reported & ~is_there)

    def equals(self, other: Inventory) -> bool:
        """Return whether two inventories report the same scans."""
        if other is self:
            return True
        return np.array_equal(self.counts, other.counts) and np.array_equal(self.has_later, other.has_later)

    def contains(self, scan: NumberedScan) -> bool:
        """Return whether a scan is reported as present."""
        offset = scan.number - int(self.counts[scan.robot]) - 1
        if offset < 0:
            return offset < -1
        return offset < REPORTED_ROUNDS and bool(self.has_later[scan.robot, offset])


ScanRound: TypeAlias = tuple[NumberedScan | None, ...]
"""The scan of each robot in a round; None if it is missing."""


class Checkpoint(NamedTuple):
    """The map of the scans of the first rounds."""

    round_count: int
    known_map: DiscoveredMap


@dataclass(frozen=True, eq=False)
class ScanLog:
    """The scans that a robot has, and the map that it builds from them. Immutable.

    The map is only updated on demand, by `update_map`, because many scans may arrive in between. Maps of the
    past are stored as checkpoints, from which the map is rebuilt when a scan of an earlier round arrives.

    Attributes
    ----------
    rounds : tuple of ScanRound
    is_present : (rounds, n) bool array
        Whether each scan is in the log.
    checkpoints : tuple of Checkpoint
        In the order of rounds. The first one is the unknown map.
    known_map : DiscoveredMap
        The map after its last update.
    robot_radius : float or None, m
        Radius around the positions of robots within which cells are free; None if they may not be.
    """

    rounds: tuple[ScanRound, ...]
    is_present: BoolArray
    checkpoints: tuple[Checkpoint, ...]
    known_map: DiscoveredMap
    robot_radius: float | None

    @classmethod
    def build_empty(
        cls, robot_count: int, unknown_map: DiscoveredMap, robot_radius: float | None = None
    ) -> ScanLog:
        """Build the log of a robot that has no scans.

        Parameters
        ----------
        robot_count : int
            Number of robots n of the team.
        unknown_map : DiscoveredMap
        robot_radius : float or None, m

        Returns
        -------
        ScanLog
        """
        return cls(
            rounds=(),
            is_present=np.zeros((0, robot_count), dtype=bool),
            checkpoints=(Checkpoint(0, unknown_map),),
            known_map=unknown_map,
            robot_radius=robot_radius,
        )

    def __deepcopy__(self, memo: object) -> ScanLog:
        return self

    @cached_property
    def inventory(self) -> Inventory:
        """Which scans are in the log."""
        robot_count = self.is_present.shape[1]
        # The rounds after the last one, all of them missing, are long enough for every window.
        padding = np.zeros((REPORTED_ROUNDS + 1, robot_count), dtype=bool)
        is_present = np.concatenate([self.is_present, padding])
        counts = is_present.argmin(axis=0)
        later_rounds = counts[:, None] + 1 + np.arange(REPORTED_ROUNDS)
        return Inventory(counts, is_present[later_rounds, np.arange(robot_count)[:, None]])

    def get_scan(self, robot: int, number: int) -> NumberedScan:
        """Return the scan of a robot in a round, which must be in the log."""
        scan = self.rounds[number][robot]
        assert scan is not None
        return scan

    def add(self, scans: Sequence[NumberedScan]) -> ScanLog:
        """Return the log with more scans. The map is not updated yet.

        Parameters
        ----------
        scans : sequence of NumberedScan
            In any order. Those that are in the log already are ignored.

        Returns
        -------
        ScanLog
            This log itself if there is no new scan.
        """
        old_count, robot_count = self.is_present.shape
        new_scans = [
            scan for scan in scans if scan.number >= old_count or not self.is_present[scan.number, scan.robot]
        ]
        if not new_scans:
            return self
        round_count = max(old_count, max(scan.number for scan in new_scans) + 1)
        is_present = np.zeros((round_count, robot_count), dtype=bool)
        is_present[:old_count] = self.is_present
        changed_rounds: dict[int, list[NumberedScan | None]] = {}
        for scan in new_scans:
            is_present[scan.number, scan.robot] = True
            if scan.number not in changed_rounds:
                is_known_round = scan.number < old_count
                changed_rounds[scan.number] = (
                    list(self.rounds[scan.number]) if is_known_round else [None] * robot_count
                )
            changed_rounds[scan.number][scan.robot] = scan
        rounds = [*self.rounds, *[(None,) * robot_count] * (round_count - old_count)]
        for number, round_scans in changed_rounds.items():
            rounds[number] = tuple(round_scans)
        first_changed = min(changed_rounds)
        return replace(
            self,
            rounds=tuple(rounds),
            is_present=is_present,
            checkpoints=tuple(each for each in self.checkpoints if each.round_count <= first_changed),
        )

    def update_map(self) -> ScanLog:
        """Return the log with the map of all of its scans.

        Returns
        -------
        ScanLog
            If the cells of the map have not changed, it has the same map object as before.
        """
        start = self.checkpoints[-1]
        if start.round_count == len(self.rounds):
            return self
        new_rounds = self.rounds[start.round_count :]
        scans = [scan for round_scans in new_rounds for scan in round_scans if scan is not None]
        known_map = start.known_map
        if scans:
            step_m = known_map.raster.region.diameter / _DISTANCE_STEPS
            known_map = known_map.add_scans(
                np.array([scan.position for scan in scans]),
                np.array([scan.distances for scan in scans]) * step_m,
                np.array([scan.is_hit for scan in scans]),
                self.robot_radius,
            )
        if np.array_equal(known_map.state, self.known_map.state):
            known_map = self.known_map
        return self.share_map(known_map)

    def share_map(self, known_map: DiscoveredMap) -> ScanLog:
        """Return the log with an equal map object, and a checkpoint with it.

        Parameters
        ----------
        known_map : DiscoveredMap
            The map of all scans in the log.

        Returns
        -------
        ScanLog
        """
        earlier = [each for each in self.checkpoints if each.round_count < len(self.rounds)]
        checkpoints = _thin_out([*earlier, Checkpoint(len(self.rounds), known_map)])
        return replace(self, checkpoints=checkpoints, known_map=known_map)


def _thin_out(checkpoints: Sequence[Checkpoint]) -> tuple[Checkpoint, ...]:
    """Remove checkpoints such that older ones are farther apart, and keep the first and the last one.

    Their number then grows with the logarithm of the number of rounds, and the number of scans that are added
    again when a late scan arrives is proportional to the age of that scan.
    """
    kept = [checkpoints[0]]
    last_count = checkpoints[-1].round_count
    for candidate, next_one in pairwise(checkpoints[1:]):
        gap = next_one.round_count - kept[-1].round_count
        if gap > _MAX_CHECKPOINT_GAP * (last_count - next_one.round_count):
            kept.append(candidate)
    if len(checkpoints) > 1:
        kept.append(checkpoints[-1])
    return tuple(kept)
