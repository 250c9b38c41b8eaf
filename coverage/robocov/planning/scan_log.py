"""The scans that a robot has, its own and those of others, and the map that it builds from them.

All robots scan at the same times. The scans that they take at one time are a *round*; rounds and robots are
numbered from 0. Whatever the order in which scans arrive, they are added to the map in the order of rounds
and, within a round, of robots. Robots with the same scans therefore have the same map, bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.observation import Scans
from robocov.observation.region import Region
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.scan_areas import ScanAreas
from robocov.typing import BoolArray, FloatArray, IntArray

REPORTED_ROUNDS = 64
"""Number of rounds that an `Inventory` reports one by one, after the first missing scan of a robot."""

_DISTANCE_STEPS = 65535
"""Number of steps in which distances up to the diameter of the region are stored."""
_SCAN_HEADER_BYTES = 32
"""Size of the numbers of the robot and the round, the time, and the position, in a message with a scan."""
_MAX_CHECKPOINT_GAP = 1.0
"""Maximum gap between two older checkpoints, as a fraction of the age of the younger one.

Gaps and ages are counted in rounds.
"""


@dataclass(frozen=True, slots=True, eq=False)
class NumberedScan:
    """A scan with the index of its robot and the number of its round. Immutable.

    Attributes
    ----------
    robot : int
        Index of the robot that took the scan, from 0.
    round_number : int
        Number of the round in which all robots took a scan, from 0.
    time : float, s
        Time at which the scan was taken.
    position : (2,) array, m
        Position of the robot at that time, as the robot knew it.
    distances : (rays,) uint16 array
        Lengths of the rays, in units of 1/65535 of the diameter of the region.
    is_hit : (rays,) bool array
        Whether each ray ends at an obstacle.
    """

    robot: int
    round_number: int
    time: float
    position: FloatArray
    distances: NDArray[np.uint16]
    is_hit: BoolArray

    @property
    def size(self) -> int:
        """Size of a message with the scan, bytes: 32, plus 2 for each ray and 1 for every 8 rays, rounded up.

        Examples
        --------
        >>> ray_count = 240
        >>> distances = np.zeros(ray_count, dtype=np.uint16)
        >>> NumberedScan(0, 0, 0.0, np.zeros(2), distances, distances > 0).size
        542
        """
        rays = len(self.distances)
        return _SCAN_HEADER_BYTES + 2 * rays + math.ceil(rays / 8)

    def __deepcopy__(self, memo: object) -> NumberedScan:
        # Copies share the object, because it never changes.
        return self


def number_scans(
    scans: Scans, positions: FloatArray, region: Region, *, round_number: int, time: float
) -> list[NumberedScan]:
    """Build the numbered scans of a round.

    Parameters
    ----------
    scans : Scans
        A scan of each robot.
    positions : (n, 2) array, m
        Positions of the robots, as they know them.
    region : Region
    round_number : int
    time : float, s
        Time at which the scans were taken.

    Returns
    -------
    list of NumberedScan
        One for each robot.
    """
    step_m = region.diameter / _DISTANCE_STEPS
    distances = np.rint(np.minimum(scans.distances, region.diameter) / step_m).astype(np.uint16)
    positions = np.array(positions)
    is_hit = np.array(scans.is_hit)
    for array in (distances, positions, is_hit):
        array.setflags(write=False)
    return [
        NumberedScan(robot, round_number, time, positions[robot], distances[robot], is_hit[robot])
        for robot in range(len(positions))
    ]


class Inventory(NamedTuple):
    """List of the scans that a robot has, as it reports them to others."""

    first_missing: IntArray
    """(n,) For each robot, the first round whose scan is missing."""
    has_later: BoolArray
    """(n, `REPORTED_ROUNDS`) For each robot, whether the scans of the rounds after that one are present."""

    def find_missing(self, is_present: BoolArray) -> BoolArray:
        """Find the scans that this inventory lacks, among those that another robot has.

        Parameters
        ----------
        is_present : (rounds, n) bool array
            The scans that the other robot has.

        Returns
        -------
        (rounds, n) bool array
            False for scans of rounds that the inventory does not report.
        """
        # Column k of `has_later` belongs to the round `first_missing` + 1 + k.
        columns = np.arange(len(is_present))[:, None] - self.first_missing - 1
        is_reported = (columns >= -1) & (columns < REPORTED_ROUNDS)
        existing_columns = np.clip(columns, 0, REPORTED_ROUNDS - 1)
        robots = np.arange(len(self.first_missing))
        is_in_inventory = (columns >= 0) & self.has_later[robots, existing_columns]
        return np.asarray(is_present & is_reported & ~is_in_inventory)

    def equals(self, other: Inventory) -> bool:
        """Return whether two inventories report the same scans."""
        if other is self:
            return True
        is_first_equal = np.array_equal(self.first_missing, other.first_missing)
        return is_first_equal and np.array_equal(self.has_later, other.has_later)

    def contains(self, scan: NumberedScan) -> bool:
        """Return whether the inventory reports a scan as present."""
        first_missing = int(self.first_missing[scan.robot])
        if scan.round_number <= first_missing:
            return scan.round_number < first_missing
        column = scan.round_number - first_missing - 1
        return column < REPORTED_ROUNDS and bool(self.has_later[scan.robot, column])


ScanRound: TypeAlias = tuple[NumberedScan | None, ...]
"""The scan of each robot in a round; None if it is missing."""


class Checkpoint(NamedTuple):
    """The map of the scans of the first rounds."""

    round_count: int
    """Number of these rounds."""
    known_map: DiscoveredMap


@dataclass(frozen=True, eq=False)
class ScanLog:
    """The scans that a robot has, and the map that it builds from them. Immutable.

    The map is updated only when it is needed, by `update_map`, because many scans may arrive in between. Some
    earlier maps are stored as checkpoints. When scans of earlier rounds arrive, each later checkpoint is
    repaired: the cells near these scans are reset to the checkpoint before it, and all scans near them are
    added again. What happens to a cell does not depend on other cells, so the result is bit-identical to
    adding all scans in order.

    Attributes
    ----------
    rounds : tuple of ScanRound
        The scans of each round.
    is_present : (rounds, n) bool array
        Whether each scan is in the log.
    checkpoints : tuple of Checkpoint
        In ascending order of their numbers of rounds. The first one has no rounds, and an unknown map.
    pending_scans : tuple of NumberedScan
        The scans that the checkpoints lack.
    known_map : DiscoveredMap
        The map after its last update.
    robot_radius : float or None, m
        Radius around the position of each scan within which cells of the map become free. None: only the
        cells that rays pass through become free.
    """

    rounds: tuple[ScanRound, ...]
    is_present: BoolArray
    checkpoints: tuple[Checkpoint, ...]
    pending_scans: tuple[NumberedScan, ...]
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
            Map in which all cells are unknown.
        robot_radius : float or None, m
            See `ScanLog`.

        Returns
        -------
        ScanLog
        """
        return cls(
            rounds=(),
            is_present=np.zeros((0, robot_count), dtype=bool),
            checkpoints=(Checkpoint(0, unknown_map),),
            pending_scans=(),
            known_map=unknown_map,
            robot_radius=robot_radius,
        )

    def __deepcopy__(self, memo: object) -> ScanLog:
        # Copies share the object, because it never changes.
        return self

    @cached_property
    def inventory(self) -> Inventory:
        """List of the scans in the log."""
        robot_count = self.is_present.shape[1]
        # Missing rounds are appended, so that each robot has a first missing round and enough later ones.
        padding = np.zeros((REPORTED_ROUNDS + 1, robot_count), dtype=bool)
        is_present = np.concatenate([self.is_present, padding])
        first_missing = is_present.argmin(axis=0)
        later_rounds = first_missing[:, None] + 1 + np.arange(REPORTED_ROUNDS)
        return Inventory(first_missing, is_present[later_rounds, np.arange(robot_count)[:, None]])

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
            In any order. Scans that are already in the log are ignored.

        Returns
        -------
        ScanLog
            This log itself if there is no new scan.
        """
        old_count, robot_count = self.is_present.shape
        new_scans = [
            scan
            for scan in scans
            if scan.round_number >= old_count or not self.is_present[scan.round_number, scan.robot]
        ]
        if not new_scans:
            return self
        round_count = max(old_count, max(scan.round_number for scan in new_scans) + 1)
        is_present = np.zeros((round_count, robot_count), dtype=bool)
        is_present[:old_count] = self.is_present
        empty_round: ScanRound = (None,) * robot_count
        rounds = [*self.rounds, *[empty_round] * (round_count - old_count)]
        for scan in new_scans:
            is_present[scan.round_number, scan.robot] = True
            scans_of_round = list(rounds[scan.round_number])
            scans_of_round[scan.robot] = scan
            rounds[scan.round_number] = tuple(scans_of_round)
        return replace(
            self,
            rounds=tuple(rounds),
            is_present=is_present,
            pending_scans=(*self.pending_scans, *new_scans),
        )

    def update_map(self) -> ScanLog:
        """Return the log with an up-to-date map, which contains all scans.

        Returns
        -------
        ScanLog
            Its map is the same object as before if no cell has changed.
        """
        if not self.pending_scans:
            return self
        checkpoints = self._repair_checkpoints()
        last = checkpoints[-1]
        new_scans = self._list_scans(last.round_count, len(self.rounds))
        known_map = self._add_scans(last.known_map, new_scans)
        if np.array_equal(known_map.state, self.known_map.state):
            known_map = self.known_map
        return replace(self, checkpoints=checkpoints, pending_scans=()).share_map(known_map)

    def _list_scans(self, first_round: int, end_round: int) -> list[NumberedScan]:
        """Return the scans of the rounds from `first_round` up to, but not including, `end_round`."""
        rounds = self.rounds[first_round:end_round]
        return [scan for scan in chain.from_iterable(rounds) if scan is not None]

    def _repair_checkpoints(self) -> tuple[Checkpoint, ...]:
        """Return the checkpoints with the pending scans added."""
        previous = self.checkpoints[0]
        repaired = [previous]
        for checkpoint in self.checkpoints[1:]:
            round_count = checkpoint.round_count
            late_scans = [scan for scan in self.pending_scans if scan.round_number < round_count]
            if late_scans:
                known_map = self._repair_map(checkpoint, late_scans, previous)
                previous = Checkpoint(round_count, known_map)
            else:
                previous = checkpoint
            repaired.append(previous)
        return tuple(repaired)

    def _repair_map(
        self, checkpoint: Checkpoint, late_scans: list[NumberedScan], previous: Checkpoint
    ) -> DiscoveredMap:
        """Return the map of a checkpoint with late scans added.

        Only the cells near the late scans are computed again, from the previous checkpoint.

        Parameters
        ----------
        checkpoint : Checkpoint
        late_scans : list of NumberedScan
            Scans that the map of this checkpoint lacks. The map of the previous one contains those of its own
            rounds.
        previous : Checkpoint
            The checkpoint before this one, already repaired.

        Returns
        -------
        DiscoveredMap
        """
        late_areas = self._find_areas(late_scans)
        nearby_scans = self._list_scans(previous.round_count, checkpoint.round_count)
        if nearby_scans:
            is_near = self._find_areas(nearby_scans).overlaps_any(late_areas)
            nearby_scans = [scan for scan, near in zip(nearby_scans, is_near, strict=True) if near]
        repeated_map = self._add_scans(previous.known_map, nearby_scans)
        stale_map = checkpoint.known_map
        return stale_map.replace_cells(late_areas.mark(stale_map.raster), repeated_map)

    def _find_areas(self, scans: list[NumberedScan]) -> ScanAreas:
        """Return the bounding boxes of the areas that scans can change."""
        max_distances = np.array([scan.distances for scan in scans]).max(axis=1)
        ranges = np.maximum(max_distances * self._distance_step, self.robot_radius or 0.0)
        positions = np.array([scan.position for scan in scans])
        return ScanAreas.build(positions, ranges, self.known_map.raster)

    def _add_scans(self, known_map: DiscoveredMap, scans: list[NumberedScan]) -> DiscoveredMap:
        """Return a map with more scans, in the given order."""
        if not scans:
            return known_map
        return known_map.add_scans(
            np.array([scan.position for scan in scans]),
            np.array([scan.distances for scan in scans]) * self._distance_step,
            np.array([scan.is_hit for scan in scans]),
            self.robot_radius,
        )

    @property
    def _distance_step(self) -> float:
        """Step of the distances in scans, m."""
        return self.known_map.raster.region.diameter / _DISTANCE_STEPS

    def share_map(self, known_map: DiscoveredMap) -> ScanLog:
        """Return the log with a given map object, and with a checkpoint for it.

        Robots with equal maps use this to share one object.

        Parameters
        ----------
        known_map : DiscoveredMap
            The map of all scans in the log.

        Returns
        -------
        ScanLog
        """
        round_count = len(self.rounds)
        earlier = [checkpoint for checkpoint in self.checkpoints if checkpoint.round_count < round_count]
        checkpoints = _thin_out([*earlier, Checkpoint(round_count, known_map)])
        return replace(self, checkpoints=checkpoints, known_map=known_map)


def _thin_out(checkpoints: Sequence[Checkpoint]) -> tuple[Checkpoint, ...]:
    """Return fewer checkpoints: older ones are farther apart, and the first and the last one are kept.

    The number of checkpoints then grows only with the logarithm of the number of rounds. When a late scan
    arrives, the number of rounds that have to be added again is proportional to the age of that scan.
    """
    remaining = [checkpoints[0]]
    last_count = checkpoints[-1].round_count
    for checkpoint, next_checkpoint in pairwise(checkpoints[1:]):
        # The gap that there would be without this checkpoint.
        gap = next_checkpoint.round_count - remaining[-1].round_count
        age = last_count - next_checkpoint.round_count
        if gap > _MAX_CHECKPOINT_GAP * age:
            remaining.append(checkpoint)
    if len(checkpoints) > 1:
        remaining.append(checkpoints[-1])
    return tuple(remaining)
