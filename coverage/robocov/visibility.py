"""Who sees whom among walls: for each source, the walls around it in angular bins, the nearest first."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.orientation import BITS, cross

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov.corners import Walls

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


class WallIndex:
    """The walls that can block a view, a → b with free space on the left, sorted around each place.

    Attributes
    ----------
    ax, ay, bx, by, ux, uy : (e,) grid steps
        Their ends, and from the one to the other.
    """

    def __init__(self, walls: Walls) -> None:
        self.ax, self.ay = walls.x[walls.start], walls.y[walls.start]
        self.bx, self.by = walls.x[walls.end], walls.y[walls.end]
        self.ux, self.uy = self.bx - self.ax, self.by - self.ay
        self._length2 = self.ux**2 + self.uy**2
        self._tile = 2.0**BITS / _TILES
        middle = (np.arange(_TILES) + 0.5) * self._tile
        y, x = (part.ravel() for part in np.meshgrid(middle, middle, indexing="ij"))
        self._tile_x, self._tile_y = x, y
        edges = np.arange(len(self.ax))
        distances = [
            np.sqrt(self._near(edges, tx - self.ax, ty - self.ay)) for tx, ty in zip(x, y, strict=True)
        ]
        order = [np.argsort(row, kind="stable") for row in distances]
        self._nearest = np.array(order, dtype=np.int32)
        # one sorted list for all tiles
        key = np.array([row[at] for row, at in zip(distances, order, strict=True)])
        self._key = (key + np.arange(len(x))[:, None] * _FAR).ravel()

    def _near(self, edge: IntArray, dx: Array, dy: Array) -> Array:
        """Return a hair less than the squared distance of walls from points at (dx, dy) from their starts."""
        ux, uy = self.ux[edge], self.uy[edge]
        along = np.minimum(np.maximum((dx * ux + dy * uy) / self._length2[edge], 0.0), 1.0)
        near = (dx - along * ux) ** 2 + (dy - along * uy) ** 2
        return np.asarray(near * (1.0 - _PAD))

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
        count = np.searchsorted(self._key, tile * _FAR + radius) - tile * len(self.ax)
        total = np.cumsum(count)
        begin = 0
        while begin < len(x):
            done = total[begin - 1] if begin else 0
            end = max(begin + 1, int(np.searchsorted(total, done + _PAIRS)))
            part = count[begin:end]
            source = np.repeat(np.arange(begin, end), part)
            place = np.arange(len(source)) - np.repeat(total[begin:end] - part - done, part)
            edge = self._nearest[tile[source], place]
            dx, dy = x[source] - self.ax[edge], y[source] - self.ay[edge]
            ux, uy = self.ux[edge], self.uy[edge]
            side = cross(ux, uy, dx, dy)
            # in line with the wall: it hides nothing unless the source is on it, ends apart
            on_wall = (side == 0.0) & (dx * (dx - ux) + dy * (dy - uy) < 0.0)
            front = np.nonzero((side > 0.0) | on_wall)[0]
            source, edge = source[front], edge[front]
            near = self._near(edge, dx[front], dy[front])
            inside = near < reach[source] ** 2
            yield begin, end, source[inside], edge[inside], near[inside]
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
        nothing = np.empty(0, np.int32), np.empty(0), np.zeros(1, np.intp), np.empty(0)
        pieces = [nothing, *(self._bin(*piece) for piece in walls.facing(x, y, reach))]
        self._edge, near, count, self._horizon = (
            np.concatenate([piece[k] for piece in pieces]) for k in range(4)
        )
        self._near = np.append(near, np.inf)
        self._first = np.cumsum(count)

    def _bin(
        self, begin: int, end: int, source: IntArray, edge: IntArray, near: Array
    ) -> tuple[IntArray, Array, IntArray, Array]:
        """Enter every wall into the bins that it spans, the nearest first in each.

        Returns
        -------
        edge, near : (entries,)
        count, horizon : (bins of all sources from `begin` to `end`,)
            How many walls are in a bin, and the squared distance from which on all is hidden.
        """
        walls = self._walls
        order = np.argsort(near, kind="stable")
        source, edge, near = source[order], edge[order], near[order]
        px, py = self.x[source], self.y[source]
        from_x, from_y, to_x, to_y = (
            walls.ax[edge] - px,
            walls.ay[edge] - py,
            walls.bx[edge] - px,
            walls.by[edge] - py,
        )
        # seen from its front, a wall runs counter-clockwise from a to b, by at most a half turn
        scale = self._bins / 4.0
        start, stop = pseudo_angle(from_x, from_y), pseudo_angle(to_x, to_y)
        stop[stop < start] += 4.0
        low = np.floor((start - _PAD) * scale).astype(np.intp)
        count = np.floor((stop + _PAD) * scale).astype(np.intp) - low + 1
        np.minimum(count, self._bins, out=count)
        entry = np.repeat(np.arange(len(edge)), count)
        place = low[entry] + np.arange(len(entry)) - np.repeat(np.cumsum(count) - count, count)
        key = (source[entry] - begin) * self._bins + place % self._bins

        # what is farther than all of a wall across the whole bin is hidden by that one
        far = np.maximum(from_x * from_x + from_y * from_y, to_x * to_x + to_y * to_y) * (1.0 + _PAD)
        across = (place >= ((start + _PAD) * scale)[entry]) & (place + 1 <= ((stop - _PAD) * scale)[entry])
        size = (end - begin) * self._bins
        horizon = np.full(size, np.inf)
        np.minimum.at(horizon, key[across], far[entry[across]])
        some = np.nonzero(near[entry] <= horizon[key])[0]
        entry, key = entry[some], key[some]

        # numpy sorts 16 bit integers in linear time
        order = np.argsort(key.astype(np.uint16) if size <= 1 << 16 else key, kind="stable")
        entry = entry[order]
        return edge[entry], near[entry], np.bincount(key, minlength=size), horizon

    def see(self, source: IntArray, x: Array, y: Array) -> BoolArray:
        """Return for (m,) pairs of a source and a target at (x, y) whether no wall hides the target.

        Sources at vertices see past the walls that end there: the caller looks after their sectors.
        """
        dx, dy = x - self.x[source], y - self.y[source]
        distance2 = dx * dx + dy * dy
        bin_ = np.minimum((pseudo_angle(dx, dy) * (self._bins / 4.0)).astype(np.intp), self._bins - 1)
        key = source * self._bins + bin_
        at, last = self._first[key], self._first[key + 1]
        visible = distance2 <= self._horizon[key]
        pending = np.nonzero(visible & (at < last) & (self._near[at] < distance2))[0]
        at = at[pending]
        while pending.size:
            count = last[pending] - at
            rest = int(count.sum())
            if rest <= _REST:
                # all that is left in one go
                at = np.repeat(at - np.cumsum(count) + count, count) + np.arange(rest)
                pending = np.repeat(pending, count)
                some = self._near[at] < distance2[pending]
                pending, at = pending[some], at[some]
            hidden = self._hides(self._edge[at], source[pending], x[pending], y[pending])
            visible[pending[hidden]] = False
            if rest <= _REST:
                break
            pending, at = pending[~hidden], at[~hidden] + 1
            more = (at < last[pending]) & (self._near[at] < distance2[pending])
            pending, at = pending[more], at[more]
        return visible

    def _hides(self, edge: IntArray, source: IntArray, x: Array, y: Array) -> BoolArray:
        """Return whether a wall that faces a source hides the target at (x, y); (p,) each."""
        walls = self._walls
        ax, ay = walls.ax[edge], walls.ay[edge]
        hides = cross(walls.ux[edge], walls.uy[edge], x - ax, y - ay) < 0.0
        # most walls have the target in front
        behind = np.nonzero(hides)[0]
        edge, source = edge[behind], source[behind]
        px, py = self.x[source], self.y[source]
        dx, dy = x[behind] - px, y[behind] - py
        hides[behind] = (cross(ax[behind] - px, ay[behind] - py, dx, dy) >= 0.0) & (
            cross(dx, dy, walls.bx[edge] - px, walls.by[edge] - py) >= 0.0
        )
        return hides


def pseudo_angle(dx: Array, dy: Array) -> Array:
    """Return a number in [0, 4] that grows with the direction's angle, without trigonometry.

    >>> pseudo_angle(np.array([0.0, 1.0, 0.0, -1.0]), np.array([-1.0, 0.0, 1.0, 0.0]))
    array([0., 1., 2., 3.])
    """
    part = dy / np.maximum(np.abs(dx) + np.abs(dy), 1e-300)
    return np.asarray(np.where(dx >= 0.0, 1.0 + part, 3.0 - part))
