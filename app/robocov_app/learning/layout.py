"""Observation vectors of learners: one row of numbers from -1 to 1 for each robot."""

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.controllers.base import cells_seen
from robocov.errors import ParameterError, checked, required
from robocov.observation import MOST_RAYS, Observations, Scans
from robocov.observation.region import Region
from robocov.robots import Team

Rows: TypeAlias = NDArray[np.float32]
"""(n, size): one row for each robot."""

MOST_NEIGHBOURS = 1000  # most neighbours that a row has room for


@dataclass(frozen=True)
class ObservationLayout:
    """Layout of an observation: its numbers and their order.

    Row i holds only what robot i knows (see `robocov.observation`); all are from -1 to 1. The unit of
    ``D`` is the diagonal of the known region's bounding box, that of ``S`` the robot's sensing range, or
    ``D`` where that is shorter.

    =============  ==================  =====================================================================
    block          numbers             content
    =============  ==================  =====================================================================
    ``position``   2                   from the middle of the region's bounding box, D
    ``velocity``   2                   in the robot's largest speed
    ``obstacle``   3                   offset of the nearest sensed obstacle point, S; then 1; all 0 for none
    ``neighbour``  3 x `neighbours`    the nearest robots that are heard, nearest first: offset, D; then 1;
                                       all 0 where there is none
    ``rays``       `rays`              distance along each ray, evenly round from +x, S; 1 where it is free
    ``centroid``   2, if `centroid`    offset of the centroid (2) of the robot's Voronoi cell, by φ, D
    =============  ==================  =====================================================================

    Each ray costs a query of the physics. The centroid is the one number that a robot has to compute of the
    others: what Lloyd's algorithm steers to. Raises ParameterError when a number is out of range.

    Examples
    --------
    >>> layout = ObservationLayout(neighbours=2)
    >>> layout.size, layout.blocks["neighbour"]
    (13, slice(7, 13, None))
    """

    neighbours: int = 4
    rays: int = 0
    centroid: bool = False

    def __post_init__(self) -> None:
        for name, most in (("neighbours", MOST_NEIGHBOURS), ("rays", MOST_RAYS)):
            checked(f"observation.{name}", getattr(self, name), 0, most, whole=True)
        required("observation.centroid", self.centroid, bool, "true or false")

    @cached_property
    def blocks(self) -> dict[str, slice]:
        """Slices of the blocks of a row, in their order; only those that it has."""
        counts = {"position": 2, "velocity": 2, "obstacle": 3, "neighbour": 3 * self.neighbours}
        counts |= {"rays": self.rays, "centroid": 2 * self.centroid}
        ends = accumulate(counts.values())
        return {
            name: slice(end - count, end)
            for (name, count), end in zip(counts.items(), ends, strict=True)
            if count
        }

    @property
    def size(self) -> int:
        return 7 + 3 * self.neighbours + self.rays + 2 * self.centroid

    @property
    def bounds(self) -> tuple[Rows, Rows]:
        """Least and largest values of a row, (size,) each."""
        low = np.full(self.size, -1.0, dtype=np.float32)
        rays = 7 + 3 * self.neighbours
        low[6:rays:3] = low[rays : rays + self.rays] = (
            0.0  # whether there is a point, who is heard, distances
        )
        return low, np.ones(self.size, dtype=np.float32)

    def rows(self, seen: Observations, team: Team, scans: Scans | None = None) -> Rows:
        """Return what each robot is told, (n, size), with the latest scans, by default those of `seen`."""
        n, unit = len(seen.positions), seen.region.diameter
        reach = np.clip(team.sensing_range, 1e-9, unit)[:, None]
        places, rows = self.blocks, np.zeros((n, self.size))
        rows[:, places["position"]] = from_middle(seen.positions, seen.region)
        rows[:, places["velocity"]] = seen.velocities / team.max_speed[:, None]
        sensed = ~np.isnan(seen.obstacle_points[:, 0])
        obstacle = rows[:, places["obstacle"]]
        obstacle[sensed, :2] = ((seen.obstacle_points - seen.positions) / reach)[sensed]
        obstacle[:, 2] = sensed
        if self.neighbours:
            robot, _, offset, distance = seen.neighbours_within(4.0 * unit)
            nearest = np.zeros((n, self.neighbours, 3))
            farthest = np.full((n, self.neighbours), np.inf)
            _place_nearest(robot, offset, distance, unit, farthest, nearest)
            rows[:, places["neighbour"]] = nearest.reshape(n, -1)
        if self.rays:
            scans = seen.scans if scans is None else scans
            if scans is None or scans.rays != self.rays:
                found, wanted = "none" if scans is None else scans.rays, f"{self.rays} in a scan were wanted"
                raise ParameterError(f"observation.rays: {wanted}, but {found} are there")
            rows[:, places["rays"]] = np.where(scans.hit, scans.distances / reach, 1.0)
        if self.centroid:
            centroid = cells_seen(seen, "distance", None).centroid
            rows[:, places["centroid"]] = (centroid - seen.positions) / unit
        # what is believed of places may be off by more than there is
        return np.minimum(np.maximum(rows, -1.0), 1.0).astype(np.float32)


def from_middle(positions: Array, region: Region) -> Array:
    """Return positions from the middle of a region's bounding box, in its diagonals, (n, 2)."""
    low_x, low_y, high_x, high_y = region.bounds
    middle = np.array([(low_x + high_x) / 2.0, (low_y + high_y) / 2.0])
    return np.asarray((positions - middle) / region.diameter)


@kernel
def _place_nearest(
    robot: IntArray, offset: Array, distance: Array, unit: float, best: Array, blocks: Array
) -> None:
    """Put the nearest neighbours of robots into `blocks`, (n, count, 3), their distances into `best`."""
    for k in range(len(robot)):
        i, place = robot[k], best.shape[1]
        # what is equally far stays in the order of the numbers
        while place > 0 and distance[k] < best[i, place - 1]:
            place -= 1
        for later in range(best.shape[1] - 1, place, -1):
            best[i, later] = best[i, later - 1]
            for c in range(3):
                blocks[i, later, c] = blocks[i, later - 1, c]
        if place < best.shape[1]:
            best[i, place], blocks[i, place, 2] = distance[k], 1.0
            for c in range(2):
                # from the robot to its neighbour
                blocks[i, place, c] = -offset[k, c] / unit
