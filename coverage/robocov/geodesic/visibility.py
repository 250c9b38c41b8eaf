"""Who sees whom among walls: for each source, the walls around it in angular bins, the nearest first."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.geodesic.orientation import BITS, cross

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov.geodesic.corners import Walls

_PAD = 1e-9
"""Added to the angles that a wall spans, and taken off its distance: far more than rounding, at no cost."""

_PAIRS = 1 << 16
"""Source and wall pairs looked at in one piece, which bounds the memory."""

_REST = 1 << 13
"""Entries of bins that are few enough to be looked at all at once."""

_TILES = 16
"""Tiles along a side of the grid; each lists all walls, the nearest first."""

_FAR = 2.0 ** (BITS + 2)
"""More than any distance on the grid, in steps."""


_NOTHING = np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0), np.empty(0)
"""Edges, counts and bounds of the bins of no source."""


class WallIndex:
    """The walls that can block a view, a → b with free space on the left, sorted around each place.

    Attributes
    ----------
    count : int
        How many.
    """

    def __init__(self, walls: Walls) -> None:
        ax, ay = walls.x[walls.start], walls.y[walls.start]
        ux, uy = walls.x[walls.end] - ax, walls.y[walls.end] - ay
        self.count = len(ax)
        self._walls = np.array([ax, ay, ux, uy])
        self._length2 = ux**2 + uy**2
        self._tile = 2.0**BITS / _TILES
        middle = (np.arange(_TILES) + 0.5) * self._tile
        y, x = (part.ravel() for part in np.meshgrid(middle, middle, indexing="ij"))
        self._tile_x, self._tile_y = x, y
        distances = [
            np.sqrt(_near(ax - tx, ay - ty, ux, uy, self._length2)) for tx, ty in zip(x, y, strict=True)
        ]
        order = [np.argsort(row, kind="stable") for row in distances]
        self._nearest = np.array(order, dtype=np.int32).ravel()
        # one sorted list for all tiles
        key = np.array([row[at] for row, at in zip(distances, order, strict=True)])
        self._key = (key + np.arange(len(x))[:, None] * _FAR).ravel()

    def seen_from(self, edge: IntArray, x: Array, y: Array) -> tuple[Array, Array, Array, Array]:
        """Return, x and y each, where walls start as seen from (p,) points, and from there their ends."""
        ax, ay, ux, uy = self._walls.take(edge, axis=1)
        ax -= x
        ay -= y
        return ax, ay, ux, uy

    def facing(
        self, x: Array, y: Array, reach: Array
    ) -> Iterator[tuple[int, int, IntArray, IntArray, Array]]:
        """Yield the walls that (n,) sources look at from the front, nearer than `reach` (n,), in pieces.

        Yields
        ------
        begin, end : int
            The sources of the piece.
        source, edge : (p,)
        near : (p,)
            A hair less than their squared distance.
        """
        last = _TILES - 1
        column = np.minimum(np.maximum(x / self._tile, 0.0), last).astype(np.intp)
        row = np.minimum(np.maximum(y / self._tile, 0.0), last).astype(np.intp)
        tile = row * _TILES + column
        radius = (reach + np.hypot(x - self._tile_x[tile], y - self._tile_y[tile])) * (1.0 + _PAD)
        radius = np.minimum(radius, _FAR * (1.0 - _PAD))
        count = np.searchsorted(self._key, tile * _FAR + radius) - tile * self.count
        total = np.cumsum(count)
        begin = 0
        while begin < len(x):
            done = total[begin - 1] if begin else 0
            end = max(begin + 1, int(np.searchsorted(total, done + _PAIRS)))
            part = count[begin:end]
            source = np.arange(begin, end).repeat(part)
            # the tiles' lists follow each other
            first = tile[begin:end] * self.count - (total[begin:end] - part - done)
            edge = self._nearest.take(np.arange(len(source)) + first.repeat(part))
            ax, ay, ux, uy = self.seen_from(edge, x.take(source), y.take(source))
            side = cross(ax, ay, ux, uy)
            # in line with the wall: it hides nothing unless the source is on it, ends apart
            on_wall = (side == 0.0) & (ax * (ax + ux) + ay * (ay + uy) < 0.0)
            near = _near(ax, ay, ux, uy, self._length2.take(edge))
            front = (((side > 0.0) | on_wall) & (near < (reach * reach).take(source))).nonzero()[0]
            yield begin, end, source[front], edge[front], near[front]
            begin = end


class Fans:
    """The walls that face each of n sources.

    A wall a → b (free space on its left) hides a target q from a source p iff p is not behind it,
    q is behind it, and the segment meets it, ends included. Touching a vertex of an obstacle from
    outside may therefore hide; a path by way of that vertex is as short. The walls that end in p are
    left out: at a vertex the sectors decide.

    Parameters
    ----------
    walls : WallIndex
    x, y : (n,) grid steps
        The sources; none of them inside an obstacle.
    reach : (n,) grid steps
        No target is farther from its source.
    bins : int
        Angular bins for each source.
    """

    def __init__(self, walls: WallIndex, x: Array, y: Array, reach: Array, bins: int = 64) -> None:
        self._walls = walls
        self._bins = bins
        self.x, self.y = x, y
        pieces = [self._bin(*piece) for piece in walls.facing(x, y, reach)] or [_NOTHING]
        self._edge, count, self._clear, self._horizon = (
            parts[0] if len(parts) == 1 else np.concatenate(parts) for parts in zip(*pieces, strict=True)
        )
        self._last = count.cumsum()
        self._first = self._last - count

    def _bin(
        self, begin: int, end: int, source: IntArray, edge: IntArray, near: Array
    ) -> tuple[IntArray, IntArray, Array, Array]:
        """Enter every wall into the bins that it spans.

        Returns
        -------
        edge : (entries,)
        count, clear, horizon : (bins of all sources from `begin` to `end`,)
            How many walls are in a bin, the squared distance up to which none hides anything, and
            that from which on all is hidden.
        """
        walls = self._walls
        from_x, from_y, ux, uy = walls.seen_from(edge, self.x.take(source), self.y.take(source))
        to_x, to_y = from_x + ux, from_y + uy
        # seen from its front, a wall runs counter-clockwise from a to b, by at most a half turn
        scale = self._bins / 4.0
        start, stop = pseudo_angle(from_x, from_y), pseudo_angle(to_x, to_y)
        stop[stop < start] += 4.0
        low = np.floor((start - _PAD) * scale).astype(np.intp)
        count = np.floor((stop + _PAD) * scale).astype(np.intp) - low + 1
        np.minimum(count, self._bins, out=count)
        wall = np.arange(len(edge)).repeat(count)
        place = np.arange(len(wall)) + (low - count.cumsum() + count).repeat(count)
        key = ((source - begin) * self._bins).repeat(count) + place % self._bins

        # what is farther than all of a wall across the whole bin is hidden by that one
        size = (end - begin) * self._bins
        horizon = np.full(size, np.inf)
        far = np.maximum(from_x * from_x + from_y * from_y, to_x * to_x + to_y * to_y) * (1.0 + _PAD)
        inner = np.ceil((start + _PAD) * scale), np.floor((stop - _PAD) * scale)
        across = ((place >= inner[0][wall]) & (place < inner[1][wall])).nonzero()[0]
        np.minimum.at(horizon, key[across], far[wall[across]])
        near = near[wall]
        some = (near <= horizon[key]).nonzero()[0]
        wall, key, near = wall[some], key[some], near[some]
        clear = np.full(size, np.inf)
        np.minimum.at(clear, key, near)

        # numpy sorts 16 bit integers in linear time
        order = (key.astype(np.uint16) if size <= 1 << 16 else key).argsort(kind="stable")
        return edge[wall[order]], np.bincount(key, minlength=size), clear, horizon

    def horizons(self, begin: int, end: int) -> Array:
        """Return the squared distances from which on all is hidden, (sources from `begin` to `end`, bins)."""
        return self._horizon[begin * self._bins : end * self._bins].reshape(-1, self._bins)

    def see(self, source: IntArray, x: Array, y: Array) -> BoolArray:
        """Return for (m,) pairs of a source and a target at (x, y) whether no wall hides the target.

        Sources at vertices see past the walls that end there: the caller looks after their sectors.
        """
        dx, dy = x - self.x[source], y - self.y[source]
        return self.see_along(source, dx, dy, dx * dx + dy * dy)

    def see_along(self, source: IntArray, dx: Array, dy: Array, distance2: Array) -> BoolArray:
        """Return the same for targets at (dx, dy) from their sources, and the square of that distance."""
        angle = pseudo_angle(dx, dy)
        # a hair less, so that a whole turn is in the last bin
        angle *= self._bins / 4.0 * (1.0 - 1e-15)
        key = angle.astype(np.intp)
        key += source * self._bins
        visible = distance2 <= self._clear.take(key)
        pending = (~visible).nonzero()[0]
        key = key[pending]
        some = (distance2[pending] <= self._horizon[key]).nonzero()[0]
        pending, key = pending[some], key[some]
        visible[pending] = True
        at, last = self._first[key], self._last[key]
        while len(pending):
            count = last - at
            rest = int(count.sum())
            if rest <= _REST:
                # all that is left in one go
                at = np.arange(rest) + (at - count.cumsum() + count).repeat(count)
                pending = pending.repeat(count)
            hides = self._hides(self._edge.take(at), source.take(pending), dx.take(pending), dy.take(pending))
            visible[pending[hides]] = False
            if rest <= _REST:
                break
            at += 1
            more = (~hides & (at < last)).nonzero()[0]
            pending, at, last = pending[more], at[more], last[more]
        return visible

    def _hides(self, edge: IntArray, source: IntArray, dx: Array, dy: Array) -> BoolArray:
        """Return whether a wall that faces a source hides the target at (dx, dy) from it; (p,) each."""
        ax, ay, ux, uy = self._walls.seen_from(edge, self.x.take(source), self.y.take(source))
        hides = cross(ux, uy, dx - ax, dy - ay) < 0.0
        # most walls have the target in front
        behind = hides.nonzero()[0]
        ax, ay, ux, uy = ax[behind], ay[behind], ux[behind], uy[behind]
        dx, dy = dx[behind], dy[behind]
        hides[behind] = (cross(ax, ay, dx, dy) >= 0.0) & (cross(dx, dy, ax + ux, ay + uy) >= 0.0)
        return hides


def _near(ax: Array, ay: Array, ux: Array, uy: Array, length2: Array) -> Array:
    """Return a hair less than the squared distance of walls that start at (ax, ay), seen from a point."""
    along = np.minimum(np.maximum(-(ax * ux + ay * uy) / length2, 0.0), 1.0)
    near_x, near_y = ax + along * ux, ay + along * uy
    return np.asarray((near_x * near_x + near_y * near_y) * (1.0 - _PAD))


def pseudo_angle(dx: Array, dy: Array) -> Array:
    """Return a number in [0, 4] that grows with the direction's angle, without trigonometry.

    >>> pseudo_angle(np.array([0.0, 1.0, 0.0, -1.0]), np.array([-1.0, 0.0, 1.0, 0.0]))
    array([0., 1., 2., 3.])
    """
    # in place, which is quicker for many
    angle = np.abs(dx)
    angle += np.abs(dy)
    np.maximum(angle, 1e-300, out=angle)
    np.divide(dy, angle, out=angle)
    np.subtract(1.0, angle, out=angle)
    np.copysign(angle, dx, out=angle)
    return np.subtract(2.0, angle, out=angle)
