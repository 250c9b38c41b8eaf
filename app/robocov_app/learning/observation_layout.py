"""Layout of observations as rows of numbers for learners."""

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

import numpy as np

from robocov.compiled import kernel
from robocov.controllers.known_cells import compute_known_cells
from robocov.errors import ParameterError, require_number, require_type
from robocov.observation import MAX_RAYS, Observations, Scans
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import Float32Array, FloatArray, IntArray

MAX_NEIGHBORS = 1000
"""Maximum number of neighbors in a row."""
_MAX_NEIGHBOR_DIAMETERS = 4.0
"""Search radius for neighbors, in diameters of the map."""
_MIN_SENSING_RANGE_M = 1e-9
_FIXED_SIZE = 7
"""Length of a row without neighbors, rays and centroid."""
_NEIGHBOR_SIZE = 3
"""Numbers for an obstacle or a neighbor: its offset, and 1 if it is present."""
_PRESENCE = 2
"""Index of the presence among these numbers."""
_CENTROID_SIZE = 2


@dataclass(frozen=True)
class ObservationLayout:
    """Layout of an observation: its numbers and their order.

    Row i contains only what robot i knows (see `robocov.observation`). All numbers are between -1 and 1. The
    table gives the units of lengths: ``D`` is the diagonal of the known region's bounding box, and ``S`` is
    the robot's sensing range or ``D``, whichever is shorter.

    =============  ==================  =====================================================================
    block          numbers             content
    =============  ==================  =====================================================================
    ``position``   2                   from the center of the region's bounding box, D
    ``velocity``   2                   relative to the robot's maximum speed
    ``obstacle``   3                   offset of the nearest sensed obstacle point, S; then 1; all 0 for none
    ``neighbor``   3 x `neighbors`     the nearest robots within communication range, nearest first: offset,
                                       D; then 1; all 0 if there is none
    ``rays``       `rays`              distance along each ray, evenly spaced from +x, S; 1 if it is free
    ``centroid``   2, if `centroid`    offset of the centroid (2) of the robot's Voronoi cell, by φ, D
    =============  ==================  =====================================================================

    Each ray takes one query of the physics engine. The centroid, toward which Lloyd's algorithm moves, is
    the only block that a robot has to compute from its other knowledge.

    Parameters
    ----------
    neighbors : int
        Number of neighbors, the nearest ones.
    rays : int
        Number of rays of the range sensor; 0 for none.
    centroid : bool
        Whether the centroid is included.

    Raises
    ------
    ParameterError
        If a number is out of range.

    See Also
    --------
    CoverageTask : Contains the layout of the observations.
    PolicyController : Builds the same observations when a policy is a controller.

    Examples
    --------
    >>> from robocov_app.learning import ObservationLayout
    >>> layout = ObservationLayout(neighbors=2)
    >>> layout.size, layout.blocks["neighbor"]
    (13, slice(7, 13, None))
    """

    neighbors: int = 4
    rays: int = 0
    centroid: bool = False

    def __post_init__(self) -> None:
        require_number("observation.neighbors", self.neighbors, 0, MAX_NEIGHBORS, whole=True)
        require_number("observation.rays", self.rays, 0, MAX_RAYS, whole=True)
        require_type("observation.centroid", self.centroid, bool, "true or false")

    @cached_property
    def blocks(self) -> dict[str, slice]:
        """Slice of each block in a row, in order; blocks without numbers are left out."""
        sizes = {
            "position": 2,
            "velocity": 2,
            "obstacle": _NEIGHBOR_SIZE,
            "neighbor": _NEIGHBOR_SIZE * self.neighbors,
            "rays": self.rays,
            "centroid": self._centroid_size,
        }
        ends = accumulate(sizes.values())
        return {
            name: slice(end - size, end)
            for (name, size), end in zip(sizes.items(), ends, strict=True)
            if size
        }

    @property
    def _centroid_size(self) -> int:
        return _CENTROID_SIZE if self.centroid else 0

    @property
    def size(self) -> int:
        """Length of a row."""
        return _FIXED_SIZE + _NEIGHBOR_SIZE * self.neighbors + self.rays + self._centroid_size

    @property
    def bounds(self) -> tuple[Float32Array, Float32Array]:
        """Minimum and maximum possible values of a row, (size,) each."""
        low = np.full(self.size, -1.0, dtype=np.float32)
        first_ray = _FIXED_SIZE + _NEIGHBOR_SIZE * self.neighbors
        # The presences of the obstacle and of each neighbor.
        low[_FIXED_SIZE - 1 : first_ray : _NEIGHBOR_SIZE] = 0.0
        low[first_ray : first_ray + self.rays] = 0.0
        return low, np.ones(self.size, dtype=np.float32)

    def build_rows(self, seen: Observations, team: Team, scans: Scans | None = None) -> Float32Array:
        """Build the observation rows of all robots.

        Parameters
        ----------
        seen : Observations
        team : Team
        scans : Scans, optional
            Latest scans; by default, those of `seen`.

        Returns
        -------
        (n, size) array

        Raises
        ------
        ParameterError
            If the layout has rays, but there is no scan with the same number of rays.
        """
        n = len(seen.positions)
        unit = seen.region.diameter
        sensing_range = np.clip(team.sensing_range, _MIN_SENSING_RANGE_M, unit)[:, None]
        blocks = self.blocks
        rows = np.zeros((n, self.size))
        rows[:, blocks["position"]] = normalize_positions(seen.positions, seen.region)
        rows[:, blocks["velocity"]] = seen.velocities / team.max_speed[:, None]
        is_sensed = ~np.isnan(seen.obstacle_points[:, 0])
        obstacle = rows[:, blocks["obstacle"]]
        obstacle[is_sensed, :2] = ((seen.obstacle_points - seen.positions) / sensing_range)[is_sensed]
        obstacle[:, _PRESENCE] = is_sensed
        if self.neighbors:
            rows[:, blocks["neighbor"]] = self._find_neighbors(seen).reshape(n, -1)
        if self.rays:
            scans = self._check_scans(seen.scans if scans is None else scans)
            rows[:, blocks["rays"]] = np.where(scans.is_hit, scans.distances / sensing_range, 1.0)
        if self.centroid:
            centroids = compute_known_cells(seen, "distance", None).centroids
            rows[:, blocks["centroid"]] = (centroids - seen.positions) / unit
        # With localization errors, believed positions may be outside the region.
        return np.minimum(np.maximum(rows, -1.0), 1.0).astype(np.float32)

    def _find_neighbors(self, seen: Observations) -> FloatArray:
        """Return the offset of each of the nearest neighbors, and 1 if there is one, (n, neighbors, 3)."""
        n = len(seen.positions)
        unit = seen.region.diameter
        # Noisy positions may be farther apart than the diameter, but not by much.
        pairs = seen.find_neighbors(_MAX_NEIGHBOR_DIAMETERS * unit)
        nearest = np.zeros((n, self.neighbors, _NEIGHBOR_SIZE))
        distances = np.full((n, self.neighbors), np.inf)
        # The offsets point from the neighbor to the robot; the layout needs the opposite direction.
        _insert_nearest(pairs.robots, -pairs.offsets / unit, pairs.distances, distances, nearest)
        return nearest

    def _check_scans(self, scans: Scans | None) -> Scans:
        """Return the scans; raise a ParameterError unless they have as many rays as the layout."""
        if scans is None or scans.rays != self.rays:
            actual = "none" if scans is None else scans.rays
            raise ParameterError(f"observation.rays: expected {self.rays} rays in a scan, got {actual}")
        return scans


def normalize_positions(positions: FloatArray, region: Region) -> FloatArray:
    """Return positions from the center of a region's bounding box, in units of its diagonal, (n, 2)."""
    min_x, min_y, max_x, max_y = region.bounds
    center = np.array([(min_x + max_x) / 2.0, (min_y + max_y) / 2.0])
    return np.asarray((positions - center) / region.diameter)


@kernel
def _insert_nearest(
    robots: IntArray,
    offsets: FloatArray,
    pair_distances: FloatArray,
    distances: FloatArray,
    nearest: FloatArray,
) -> None:
    """Insert pairs of robots into the lists of nearest neighbors, which stay sorted by distance.

    Parameters
    ----------
    robots : (k,) array of int
        Robot of each pair.
    offsets : (k, 2) array
        Offset of the neighbor in each pair.
    pair_distances : (k,) array
        Distance of the neighbor in each pair.
    distances : (n, count) array
        Distances of the nearest neighbors of each robot, modified in place.
    nearest : (n, count, 3) array
        Offset of each of these neighbors, and 1 if there is one, modified in place.
    """
    count = distances.shape[1]
    for pair in range(len(robots)):
        robot = robots[pair]
        rank = count
        # Neighbors at equal distances stay in the order of the pairs.
        while rank > 0 and pair_distances[pair] < distances[robot, rank - 1]:
            rank -= 1
        # Farther neighbors move back by one rank, and the last one is dropped.
        for farther in range(count - 1, rank, -1):
            distances[robot, farther] = distances[robot, farther - 1]
            for column in range(_NEIGHBOR_SIZE):
                nearest[robot, farther, column] = nearest[robot, farther - 1, column]
        if rank < count:
            distances[robot, rank] = pair_distances[pair]
            nearest[robot, rank, _PRESENCE] = 1.0
            for column in range(2):
                nearest[robot, rank, column] = offsets[pair, column]
