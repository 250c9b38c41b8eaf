"""The range sensor, all that robots know of obstacles by: nearest point and ray scan, both asked of pymunk.

The space that is asked holds no robots that work: they neither hide obstacles nor are taken for some.
"""

from __future__ import annotations

import platform
import sys
from functools import cached_property
from typing import Any

import numpy as np
import pymunk

from robocov.arrays import Array, BoolArray, IntArray, frozen
from robocov.compiled import call_c, kernel
from robocov.observation import headings
from robocov.world import obstacle_space
from robocov.world.engine import addresses_of
from robocov.world.solid import Mover

_FARTHEST = 1e6
"""An unlimited range, in metres, as the engine's bounding boxes can hold it."""
_ALL = pymunk.ShapeFilter()
_IN_REGISTERS = sys.platform != "win32" and platform.machine() in ("x86_64", "aarch64", "arm64")
"""Whether C takes a vector as two floats and a filter as two words, as kernels call it."""


class RangeSensor:
    """Asks a static pymunk space for what a robot would measure among pieces as of `solid.solid_pieces`.

    Obstacles that move are where they are at time zero, until they are to `show` another time.
    """

    def __init__(self, pieces: tuple[Array, ...], movers: tuple[Mover, ...] = ()) -> None:
        self._pieces, self._movers = pieces, movers
        self._space = obstacle_space((pieces, movers, None))
        # an empty step builds the static index; queries never change the space
        self._space.step(1e-9)
        self._bodies = self._space.bodies
        self._failed: dict[tuple[float, float, float], pymunk.Circle] = {}

    def copy(self) -> RangeSensor:
        """Return one of the same obstacles, at time zero."""
        return RangeSensor(self._pieces, self._movers)

    def __reduce__(self) -> tuple[type[RangeSensor], tuple[Any, ...]]:
        """Return how to rebuild one of the same obstacles, at time zero."""
        return RangeSensor, (self._pieces, self._movers)

    def show(self, time: float, failed_robots: Array | None = None) -> None:
        """Move to a time, s, at which some robots have failed, and are obstacles: x, y, radius, (w, 3) m."""
        for body, mover in zip(self._bodies, self._movers, strict=True):
            body.position = tuple(mover.path.shift(time).tolist())
            self._space.reindex_shapes_for_body(body)
        wanted = set() if failed_robots is None else set(map(tuple, failed_robots.tolist()))
        for gone in self._failed.keys() - wanted:
            self._space.remove(self._failed.pop(gone))
        for x, y, radius in sorted(wanted - self._failed.keys()):
            disc = pymunk.Circle(self._space.static_body, radius, (x, y))
            self._space.add(disc)
            self._failed[x, y, radius] = disc

    def nearest(self, positions: Array, ranges: Array) -> Array:
        """Return the closest solid point of each robot at (n, 2) m within its range, (n,) m; nan if none."""
        points = np.array(positions, dtype=float)
        if self._addresses is not None:
            _nearest(self._addresses, points, ranges)
        else:
            for row, (place, reach) in enumerate(zip(points.tolist(), ranges.tolist(), strict=True)):
                found = self._space.point_query_nearest(tuple(place), min(reach, _FARTHEST), _ALL)
                points[row] = np.nan if found is None else found.point
        points.setflags(write=False)
        return points

    def scan(self, position: Array, rays: int, reach: float) -> tuple[Array, Array]:
        """Return distances, (rays,) m, and ends, (rays, 2) m, of rays from one place; see `scans`."""
        distances, _ = self.scans(np.asarray(position)[None], rays, np.array([reach]))
        return distances[0], position + distances[0][:, None] * headings(rays)

    def scans(self, positions: Array, rays: int, ranges: Array) -> tuple[Array, BoolArray]:
        """Cast `rays` rays evenly round a full turn from each place, (n, 2) m, the first along +x.

        Returns distances, (n, rays) m, the range, (n,) m, where nothing is met, and whether something is.
        """
        limit = np.minimum(ranges, _FARTHEST)
        ends = positions[:, None, :] + limit[:, None, None] * headings(rays)
        fraction, hit = np.ones(ends.shape[:2]), np.zeros(ends.shape[:2], dtype=bool)
        if self._addresses is not None:
            _first_met(self._addresses, np.array(positions), ends, fraction, hit)
        else:
            for row, (start, turn) in enumerate(zip(positions.tolist(), ends.tolist(), strict=True)):
                for ray, end in enumerate(turn):
                    found = self._space.segment_query_first(tuple(start), tuple(end), 0.0, _ALL)
                    if found is not None:
                        fraction[row, ray], hit[row, ray] = found.alpha, True
        distances = limit[:, None] * fraction
        distances.setflags(write=False)
        hit.setflags(write=False)
        return distances, hit

    @cached_property
    def _addresses(self) -> IntArray | None:
        """The space and its queries for kernels; None where these cannot call them."""
        if not _IN_REGISTERS:
            return None
        queries = "cpSpacePointQueryNearest", "cpSpaceSegmentQueryFirst"
        addresses, point = addresses_of(self._space._space, *queries), np.array([[0.25, 0.5]])
        expected = self._space.point_query_nearest((0.25, 0.5), _FARTHEST, _ALL)
        _nearest(addresses, point, frozen([_FARTHEST]))
        same = bool(np.isnan(point[0, 0])) if expected is None else tuple(point[0]) == expected.point
        return addresses if same else None


@kernel
def _nearest(addresses: IntArray, points: Array, ranges: Array) -> None:
    """Replace points by the nearest solid ones."""
    answer = np.empty(6)  # a cpPointQueryInfo: shape, point, ...
    for i in range(len(points)):
        reach = min(ranges[i], _FARTHEST)
        asked = (addresses[0], points[i, 0], points[i, 1], reach, 0, -1, answer.ctypes.data)
        found = call_c(addresses[1], asked)
        points[i, 0], points[i, 1] = (answer[1], answer[2]) if found else (np.nan, np.nan)


@kernel
def _first_met(addresses: IntArray, positions: Array, ends: Array, fraction: Array, hit: BoolArray) -> None:
    """Set at which parts of them segments meet something first."""
    answer = np.empty(6)  # a cpSegmentQueryInfo, which ends with the part
    for i in range(len(positions)):
        for k in range(ends.shape[1]):
            x, y = ends[i, k, 0], ends[i, k, 1]
            start = (addresses[0], positions[i, 0], positions[i, 1])
            if call_c(addresses[2], (*start, x, y, 0.0, 0, -1, answer.ctypes.data)):
                fraction[i, k], hit[i, k] = answer[5], True
