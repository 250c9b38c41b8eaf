"""The range sensor: nearest obstacle point and ray scan, both asked of pymunk.

A robot knows of obstacles only what comes out of here. The queries go to a space of their own that
holds the solid pieces and nothing else, so robots neither hide obstacles nor are taken for some.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pymunk

from robocov.arrays import Array, BoolArray
from robocov.observation.scans import headings

if TYPE_CHECKING:
    from robocov.world.solid import Mover

_FARTHEST = 1e6
"""An unlimited range, in metres, as the engine's bounding boxes can hold it."""

_ALL = pymunk.ShapeFilter()

_PROBED = (1e3, 731.0)
"""Where a ray ends on which the binding is tried."""


class RangeSensor:
    """Asks a static pymunk space for what a robot would measure.

    Parameters
    ----------
    pieces : convex polygons, (k, 2) m each
        What `solid.solid_pieces` returns.
    movers : tuple of Mover
        Obstacles that move, where they are at time zero; see `show`.
    """

    def __init__(self, pieces: tuple[Array, ...], movers: tuple[Mover, ...] = ()) -> None:
        self._space = pymunk.Space()
        for ring in pieces:
            self._space.add(pymunk.Poly(self._space.static_body, ring.tolist()))
        # an empty step builds the static index; queries never change the space
        self._space.step(1e-9)
        self._movers = [(added_mover(self._space, mover), mover.path) for mover in movers]
        self._failed_robots: dict[tuple[float, float, float], pymunk.Circle] = {}
        self._direct = _DirectQueries.of(self._space)

    def show(self, time: float, failed_robots: Array | None = None) -> None:
        """Let all that is asked from now on be of a time, s, with robots that failed among the obstacles.

        Parameters
        ----------
        time : float, s
        failed_robots : (w, 3) m or None
            x, y and radius of each.
        """
        for body, path in self._movers:
            body.position = tuple(path.shift(time).tolist())
            self._space.reindex_shapes_for_body(body)
        wanted = {
            (x, y, radius) for x, y, radius in ([] if failed_robots is None else failed_robots.tolist())
        }
        for gone in self._failed_robots.keys() - wanted:
            self._space.remove(self._failed_robots.pop(gone))
        for x, y, radius in sorted(wanted - self._failed_robots.keys()):
            disc = pymunk.Circle(self._space.static_body, radius, (x, y))
            self._space.add(disc)
            self._failed_robots[x, y, radius] = disc

    def nearest(self, positions: Array, ranges: Array) -> Array:
        """Return the closest solid point of each robot within its range.

        Parameters
        ----------
        positions : (n, 2) m
        ranges : (n,) m

        Returns
        -------
        (n, 2) m
            nan where nothing is in range.
        """
        reach = np.minimum(ranges, _FARTHEST).tolist()
        if self._direct is not None:
            return self._direct.nearest(positions, reach)
        points = np.full(positions.shape, np.nan)
        for row, (place, limit) in enumerate(zip(positions.tolist(), reach, strict=True)):
            found = self._space.point_query_nearest(tuple(place), limit, _ALL)
            if found is not None:
                points[row] = found.point
        return points

    def scan(self, position: Array, rays: int, reach: float) -> tuple[Array, Array]:
        """Cast `rays` rays evenly round a full turn, the first along +x.

        Parameters
        ----------
        position : (2,) m
        rays : int
        reach : float, m

        Returns
        -------
        distances : (rays,) m
            `reach` where the ray meets nothing.
        points : (rays, 2) m
            Where each ray ends.
        """
        distances, _ = self.scans(np.asarray(position)[None], rays, np.array([reach]))
        return distances[0], position + distances[0][:, None] * headings(rays)

    def scans(self, positions: Array, rays: int, ranges: Array) -> tuple[Array, BoolArray]:
        """Cast `rays` rays evenly round a full turn from each of some places, the first along +x.

        Parameters
        ----------
        positions : (n, 2) m
        rays : int
        ranges : (n,) m

        Returns
        -------
        distances : (n, rays) m
            The range where the ray meets nothing.
        hit : (n, rays)
            Whether it meets something.
        """
        limit = np.minimum(ranges, _FARTHEST)
        ends = positions[:, None, :] + limit[:, None, None] * headings(rays)
        if self._direct is not None:
            fraction, hit = self._direct.first_along(positions, ends)
        else:
            fraction, hit = np.ones(ends.shape[:2]), np.zeros(ends.shape[:2], dtype=bool)
            for row, (start, turn) in enumerate(zip(positions.tolist(), ends.tolist(), strict=True)):
                for ray, end in enumerate(turn):
                    found = self._space.segment_query_first(tuple(start), tuple(end), 0.0, _ALL)
                    if found is not None:
                        fraction[row, ray], hit[row, ray] = found.alpha, True
        return limit[:, None] * fraction, hit


def added_mover(space: pymunk.Space, mover: Mover) -> pymunk.Body:
    """Add an obstacle that moves to a space, where it is at time zero; its position is its shift."""
    body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    shapes = [pymunk.Poly(body, ring.tolist()) for ring in mover.pieces]
    for shape in shapes:
        shape.friction = shape.elasticity = 0.0
    space.add(body, *shapes)
    return body


class _DirectQueries:
    """pymunk's own queries without the Python objects around each answer (nearest points 6 x faster).

    They call the same library functions through pymunk's binding. The binding is not public, so
    this is used only after it gave the same answer as the public method.
    """

    def __init__(self, space: pymunk.Space, ffi: Any, lib: Any) -> None:
        self._ffi = ffi
        self._query = lib.cpSpacePointQueryNearest
        self._along = lib.cpSpaceSegmentQueryFirst
        self._owner = space
        self._space = space._space
        self._filter = ffi.new("cpShapeFilter *", tuple(_ALL))[0]
        self._size = self._rays = 0

    @classmethod
    def of(cls, space: pymunk.Space) -> _DirectQueries | None:
        """Return direct queries on `space`, or None when this pymunk does not allow them."""
        probe = np.array([[0.25, 0.5]])
        try:
            from pymunk._chipmunk_cffi import ffi, lib

            direct = cls(space, ffi, lib)
            answer = direct.nearest(probe, [_FARTHEST])
            fraction, hit = direct.first_along(probe, np.array([[_PROBED]]))
        except (ImportError, AttributeError, TypeError, ValueError):
            return None
        expected = space.point_query_nearest((0.25, 0.5), _FARTHEST, _ALL)
        same = expected is None or (answer[0] == np.array(expected.point)).all()
        met = space.segment_query_first((0.25, 0.5), _PROBED, 0.0, _ALL)
        same &= bool(hit[0, 0]) == (met is not None) and (met is None or fraction[0, 0] == met.alpha)
        return direct if same else None

    def nearest(self, positions: Array, reach: list[float]) -> Array:
        n = len(positions)
        if self._size != n:
            self._places = self._ffi.new("cpVect[]", n)
            self._place_rows = [self._places[row] for row in range(n)]
            self._place = np.frombuffer(self._ffi.buffer(self._places), dtype=np.float64).reshape(n, 2)
            self._answers = self._ffi.new("cpPointQueryInfo[]", n)
            self._rows = [self._answers + row for row in range(n)]
            table = np.frombuffer(self._ffi.buffer(self._answers), dtype=np.float64).reshape(n, 6)
            self._shape = table.view(np.int64)[:, 0]
            self._point = table[:, 1:3]
            self._size = n
        self._place[:] = positions
        query, space, anything = self._query, self._space, self._filter
        for place, limit, answer in zip(self._place_rows, reach, self._rows, strict=True):
            query(space, place, limit, anything, answer)
        points = self._point.copy()
        points[self._shape == 0] = np.nan
        return points

    def first_along(self, positions: Array, ends: Array) -> tuple[Array, BoolArray]:
        """Return the part of the way from (n, 2) to (n, rays, 2) to what is met, or 1, and whether it is."""
        rays = ends.shape[1]
        if self._rays != rays:
            self._ends = self._ffi.new("cpVect[]", rays)
            self._end_rows = [self._ends[ray] for ray in range(rays)]
            self._end = np.frombuffer(self._ffi.buffer(self._ends), dtype=np.float64).reshape(rays, 2)
            self._met = self._ffi.new("cpSegmentQueryInfo[]", rays)
            self._met_rows = [self._met + ray for ray in range(rays)]
            # shape, point x, y, normal x, y, alpha
            self._meeting = np.frombuffer(self._ffi.buffer(self._met), dtype=np.float64).reshape(rays, 6)
            self._start = self._ffi.new("cpVect *")
            self._rays = rays
        fraction, hit = np.empty(ends.shape[:2]), np.empty(ends.shape[:2], dtype=bool)
        query, space, anything, start = self._along, self._space, self._filter, self._start
        for row, place in enumerate(positions.tolist()):
            start.x, start.y = place
            begin = start[0]
            self._end[:] = ends[row]
            for end, answer in zip(self._end_rows, self._met_rows, strict=True):
                query(space, begin, end, 0.0, anything, answer)
            fraction[row] = self._meeting[:, 5]
            hit[row] = self._meeting.view(np.int64)[:, 0] != 0
        return fraction, hit
