"""Who sees whom among walls: for each source, the walls around it in angular bins, the nearest first."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.corners import Walls
from robocov.orientation import cross

_PAD = 1e-9
"""Added to the angles that a wall spans, and taken off its distance: far more than rounding, at no cost."""

_PAIRS = 1 << 18
"""Source and wall pairs looked at in one piece, which bounds the memory."""


class Fans:
    """The walls that face each of n sources.

    A wall a → b (free space on its left) hides a target q from a source p iff p is not behind it,
    q is behind it, and the segment meets it, ends included. Touching a vertex of an obstacle from
    outside may therefore hide; a path by way of that vertex is as short. The walls that end in p are
    left out: at a vertex the sectors decide.

    Parameters
    ----------
    walls : Walls
    x, y : (n,) grid steps
        The sources; none of them inside an obstacle.
    bins : int
        Angular bins for each source.
    reach : (n,) grid steps, optional
        No target will be farther from its source.
    """

    def __init__(self, walls: Walls, x: Array, y: Array, bins: int = 64, reach: Array | None = None) -> None:
        self._walls = walls
        self._bins = bins
        self.x, self.y = x, y
        self._ax, self._ay = walls.x[walls.start], walls.y[walls.start]
        self._bx, self._by = walls.x[walls.end], walls.y[walls.end]
        self._ux, self._uy = self._bx - self._ax, self._by - self._ay
        limit = np.full(len(x), np.inf) if reach is None else reach * reach
        rows = max(1, _PAIRS // max(1, len(walls.start)))
        pieces = [self._facing(at, min(at + rows, len(x)), limit) for at in range(0, len(x), rows)]
        source, edge, near = (
            (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
            if pieces
            else (np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp), np.empty(0))
        )
        self._sort(source.astype(np.intp), edge.astype(np.intp), near)

    def _facing(self, first: int, last: int, limit: Array) -> tuple[IntArray, IntArray, Array]:
        """Return (source, edge, squared distance) for walls that face the sources first ... last - 1."""
        px, py = self.x[first:last, None], self.y[first:last, None]
        dx, dy = px - self._ax, py - self._ay
        length2 = self._ux**2 + self._uy**2
        along = np.clip((dx * self._ux + dy * self._uy) / length2, 0.0, 1.0)
        near = (dx - along * self._ux) ** 2 + (dy - along * self._uy) ** 2
        near *= 1.0 - _PAD
        row, edge = np.nonzero(near < limit[first:last, None])
        near = near[row, edge]
        dx, dy = dx[row, edge], dy[row, edge]
        side = cross(self._ux[edge], self._uy[edge], dx, dy)
        # in line with the wall: it hides nothing unless the source is on it, ends apart
        on_wall = dx * (dx - self._ux[edge]) + dy * (dy - self._uy[edge]) < 0.0
        facing = (side > 0.0) | ((side == 0.0) & on_wall)
        return row[facing] + first, edge[facing], near[facing]

    def _sort(self, source: IntArray, edge: IntArray, near: Array) -> None:
        """Enter every wall into the bins that it spans, the nearest first in each."""
        order = np.argsort(near, kind="stable")
        source, edge, near = source[order], edge[order], near[order]
        px, py = self.x[source], self.y[source]
        scale = self._bins / 4.0
        # seen from its front, a wall runs counter-clockwise from a to b, by at most a half turn
        begin = pseudo_angle(self._ax[edge] - px, self._ay[edge] - py)
        finish = pseudo_angle(self._bx[edge] - px, self._by[edge] - py)
        finish[finish < begin] += 4.0
        low = np.floor((begin - _PAD) * scale).astype(np.intp)
        count = np.floor((finish + _PAD) * scale).astype(np.intp) - low + 1
        np.minimum(count, self._bins, out=count)
        entry = np.repeat(np.arange(len(edge)), count)
        step = np.arange(len(entry)) - np.repeat(np.cumsum(count) - count, count)
        key = source[entry] * self._bins + (low[entry] + step) % self._bins
        size = len(self.x) * self._bins
        # numpy sorts 16 bit integers in linear time
        order = np.argsort(key.astype(np.uint16) if size <= 1 << 16 else key, kind="stable")
        entry = entry[order]
        self._edge = edge[entry]
        self._near = np.append(near[entry], np.inf)
        self._first = np.zeros(size + 1, dtype=np.intp)
        np.cumsum(np.bincount(key, minlength=size), out=self._first[1:])

    def see(self, source: IntArray, x: Array, y: Array) -> BoolArray:
        """Return for (m,) pairs of a source and a target at (x, y) whether no wall hides the target.

        Sources at vertices see past the walls that end there: the caller looks after their sectors.
        """
        px, py = self.x[source], self.y[source]
        dx, dy = x - px, y - py
        distance2 = dx * dx + dy * dy
        bin_ = np.minimum((pseudo_angle(dx, dy) * (self._bins / 4.0)).astype(np.intp), self._bins - 1)
        key = source * self._bins + bin_
        at, last = self._first[key], self._first[key + 1]
        visible = np.ones(len(x), dtype=bool)
        pending = np.nonzero((at < last) & (self._near[at] < distance2))[0]
        at = at[pending]
        while pending.size:
            edge = self._edge[at]
            qx, qy = x[pending], y[pending]
            hidden = cross(self._ux[edge], self._uy[edge], qx - self._ax[edge], qy - self._ay[edge]) < 0.0
            # the walls behind which the target is not need no further look
            check = np.nonzero(hidden)[0]
            edge, pair = edge[check], pending[check]
            vx, vy, wx, wy = px[pair], py[pair], dx[pair], dy[pair]
            hidden[check] = (cross(self._ax[edge] - vx, self._ay[edge] - vy, wx, wy) >= 0.0) & (
                cross(wx, wy, self._bx[edge] - vx, self._by[edge] - vy) >= 0.0
            )
            visible[pending[hidden]] = False
            pending, at = pending[~hidden], at[~hidden] + 1
            more = (at < last[pending]) & (self._near[at] < distance2[pending])
            pending, at = pending[more], at[more]
        return visible


def pseudo_angle(dx: Array, dy: Array) -> Array:
    """Return a number in [0, 4] that grows with the direction's angle, without trigonometry.

    >>> pseudo_angle(np.array([0.0, 1.0, 0.0, -1.0]), np.array([-1.0, 0.0, 1.0, 0.0]))
    array([0., 1., 2., 3.])
    """
    part = dy / np.maximum(np.abs(dx) + np.abs(dy), 1e-300)
    return np.asarray(np.where(dx >= 0.0, 1.0 + part, 3.0 - part))
