"""The range sensor: nearest obstacle point and ray scan, both asked of pymunk.

A robot knows of obstacles only what comes out of here. The queries go to a space of their own that
holds the solid pieces and nothing else, so robots neither hide obstacles nor are taken for some.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pymunk

from robocov.arrays import Array

_FARTHEST = 1e6
"""An unlimited range, in metres, as the engine's bounding boxes can hold it."""

_ALL = pymunk.ShapeFilter()


class RangeSensor:
    """Asks a static pymunk space for what a robot would measure.

    Parameters
    ----------
    pieces : convex polygons, (k, 2) m each
        What `solid.solid_pieces` returns.
    """

    def __init__(self, pieces: tuple[Array, ...]) -> None:
        self._space = pymunk.Space()
        for ring in pieces:
            self._space.add(pymunk.Poly(self._space.static_body, ring.tolist()))
        # an empty step builds the static index; queries never change the space
        self._space.step(1e-9)
        self._direct = _DirectQueries.of(self._space)

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
        angle = np.arange(rays) * (2.0 * np.pi / rays)
        heading = np.column_stack([np.cos(angle), np.sin(angle)])
        limit = min(reach, _FARTHEST)
        start = (float(position[0]), float(position[1]))
        fraction = np.ones(rays)
        for ray, end in enumerate((position + limit * heading).tolist()):
            hit = self._space.segment_query_first(start, tuple(end), 0.0, _ALL)
            if hit is not None:
                fraction[ray] = hit.alpha
        distances = limit * fraction
        return distances, position + distances[:, None] * heading


class _DirectQueries:
    """pymunk's own nearest-point query without the Python objects around each answer (6 x faster).

    It calls the same library function through pymunk's binding. The binding is not public, so
    this is used only after it gave the same answer as the public method.
    """

    def __init__(self, space: pymunk.Space, ffi: Any, lib: Any) -> None:
        self._ffi = ffi
        self._query = lib.cpSpacePointQueryNearest
        self._owner = space
        self._space = space._space
        self._filter = ffi.new("cpShapeFilter *", tuple(_ALL))[0]
        self._size = 0

    @classmethod
    def of(cls, space: pymunk.Space) -> _DirectQueries | None:
        """Return direct queries on `space`, or None when this pymunk does not allow them."""
        probe = np.array([[0.25, 0.5]])
        try:
            from pymunk._chipmunk_cffi import ffi, lib

            direct = cls(space, ffi, lib)
            answer = direct.nearest(probe, [_FARTHEST])
        except (ImportError, AttributeError, TypeError, ValueError):
            return None
        expected = space.point_query_nearest((0.25, 0.5), _FARTHEST, _ALL)
        same = expected is None or (answer[0] == np.array(expected.point)).all()
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
