"""What one robot has discovered of the obstacles: a grid that its own ray scans fill.

A cell is *unknown* until a ray has passed it (then it is *free*) or ended in it (then it is a *wall*). The
ends of neighbouring rays that are closer together than `BRIDGE` belong to one surface: what lies between
them is *presumed* to be wall, until a ray passes there. Unknown cells count as free wherever somebody plans.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, BoolArray, IntArray
from robocov.observation.scans import headings

if TYPE_CHECKING:
    from collections.abc import Iterable

    from robocov.observation.region import Region

UNKNOWN, FREE, PRESUMED, WALL = 0, 1, 2, 3
"""What is known of a cell, the more the higher."""

BRIDGE = 0.5
"""Ends of neighbouring rays that are closer together, in metres, are on one surface. No wider than the
passages that a robot should find; a door seen from afar would be closed else."""

_STRIDE = 0.7
"""A ray is looked at after every so many cells."""

_INTO = 0.25
"""So many cells behind the end of a ray the obstacle is: the end itself may be on the border of two cells."""

_CORE = 0.3
"""A ray that passes the middle of a presumed cell, up to so much of its side, shows that there is no wall."""


@dataclass(frozen=True, eq=False)
class Raster:
    """The cells that cover the bounding box of a region.

    Attributes
    ----------
    region : Region
    cell : float, m
        Side of a cell.
    """

    region: Region
    cell: float

    @property
    def origin(self) -> tuple[float, float]:
        """The lower left corner, m."""
        return self.region.bounds[:2]

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        low_x, low_y, high_x, high_y = self.region.bounds
        rows, columns = (high_y - low_y) / self.cell, (high_x - low_x) / self.cell
        return max(1, math.ceil(rows - 1e-9)), max(1, math.ceil(columns - 1e-9))

    @cached_property
    def outside(self) -> BoolArray:
        """The cells whose middle is outside the region, (rows, columns)."""
        rows, columns = self.shape
        row, column = np.mgrid[:rows, :columns]
        return np.asarray(~self.region.contains(self.middles(row, column)))

    def middles(self, row: IntArray, column: IntArray) -> Array:
        """Return the middles of cells, (..., 2) m."""
        x, y = self.origin
        return np.stack([x + (column + 0.5) * self.cell, y + (row + 0.5) * self.cell], axis=-1)

    def cells(self, points: Array) -> tuple[IntArray, IntArray]:
        """Return row and column of the cells that hold (..., 2) points, the nearest for points beside."""
        return self.rows(points[..., 1]), self.columns(points[..., 0])

    def rows(self, y: Array) -> IntArray:
        """Return the rows of cells at some heights, m, the nearest for those beside."""
        return _numbers(y, self.origin[1], self.cell, self.shape[0])

    def columns(self, x: Array) -> IntArray:
        """Return the columns of cells, m, as `rows`."""
        return _numbers(x, self.origin[0], self.cell, self.shape[1])


@dataclass(frozen=True, eq=False)
class DiscoveredMap:
    """What a robot knows of the obstacles. Immutable: whatever adds to it gives another map.

    Attributes
    ----------
    raster : Raster
    state : (rows, columns), whole numbers
        `UNKNOWN`, `FREE`, `PRESUMED` or `WALL`, the lowest row first; read-only.
    """

    raster: Raster
    state: NDArray[np.uint8]

    @classmethod
    def nothing(cls, raster: Raster) -> DiscoveredMap:
        """Return the map of who has not seen anything yet."""
        return cls(raster, _fixed(np.zeros(raster.shape, dtype=np.uint8)))

    def __deepcopy__(self, memo: object) -> DiscoveredMap:
        return self

    @cached_property
    def blocked(self) -> BoolArray:
        """The cells where there is a wall, or the region ends, (rows, columns)."""
        return np.asarray((self.state >= PRESUMED) | self.raster.outside)

    def scanned(self, position: Array, distances: Array, hit: BoolArray) -> DiscoveredMap:
        """Return the map with one scan more; the same one where the scan tells nothing new.

        Parameters
        ----------
        position : (2,) m
        distances : (rays,) m
        hit : (rays,)
            As in `robocov.observation.scans.Scans`.
        """
        raster, cell = self.raster, self.raster.cell
        heading = headings(len(distances))
        state = self.state.copy()
        flat = state.reshape(-1)
        columns = raster.shape[1]

        # beyond the region there is nothing to know
        longest = min(float(distances.max()), raster.region.diameter)
        along = (np.arange(math.ceil(longest / (_STRIDE * cell))) + 0.5) * (_STRIDE * cell)
        free = along < distances[:, None] - _STRIDE * cell
        # places on all rays as far as the longest goes: quicker than on each as far as it does
        x, y = ((position[k] + along * heading[:, k, None])[free] for k in (0, 1))
        row, column = raster.rows(y), raster.columns(x)
        place = row * columns + column
        was = flat[place]
        flat[place[was == UNKNOWN]] = FREE
        doubtful = (was == PRESUMED).nonzero()[0]
        if len(doubtful):
            middle = raster.middles(row[doubtful], column[doubtful])
            off = np.maximum(np.abs(x[doubtful] - middle[:, 0]), np.abs(y[doubtful] - middle[:, 1]))
            flat[place[doubtful[off < _CORE * cell]]] = FREE

        ends = position + (distances + _INTO * cell)[:, None] * heading
        following = np.roll(ends, -1, axis=0)
        gap = np.sqrt(((following - ends) ** 2).sum(axis=1))
        joined = (hit & np.roll(hit, -1) & (gap < BRIDGE) & (gap > 0.5 * cell)).nonzero()[0]
        if len(joined):
            part = np.linspace(0.0, 1.0, math.ceil(gap[joined].max() / (0.5 * cell)) + 1)
            between = ends[joined, None] + (following - ends)[joined, None] * part[:, None]
            row, column = raster.cells(between.reshape(-1, 2))
            place = row * columns + column
            flat[place[flat[place] == UNKNOWN]] = PRESUMED
        row, column = raster.cells(ends[hit])
        flat[row * columns + column] = WALL
        if np.array_equal(state, self.state):
            return self
        return DiscoveredMap(raster, _fixed(state))

    def visited(self, places: Array) -> DiscoveredMap:
        """Return the map of who knows that robots have been at (k, 2) places: their cells are free."""
        row, column = self.raster.cells(places)
        fresh = self.state[row, column] == UNKNOWN
        if not fresh.any():
            return self
        state = self.state.copy()
        state[row[fresh], column[fresh]] = FREE
        return DiscoveredMap(self.raster, _fixed(state))

    def merged(self, others: Iterable[DiscoveredMap]) -> DiscoveredMap:
        """Return the map with what others know as well; the same one where they know nothing more."""
        state = self.state
        for other in others:
            # a presumption does not stand against who has looked
            theirs = np.where((other.state == PRESUMED) & (state == FREE), FREE, other.state)
            mine = np.where((state == PRESUMED) & (other.state == FREE), FREE, state)
            state = np.maximum(mine, theirs)
        if np.array_equal(state, self.state):
            return self
        return DiscoveredMap(self.raster, _fixed(state))


def grown(blocked: BoolArray, reach: float) -> BoolArray:
    """Return the cells whose middle is at most `reach` sides from that of a blocked cell, or of one beside.

    >>> grown(np.eye(3, dtype=bool), 0.5).sum()
    np.int64(3)
    """
    margin = int(reach)
    padded = np.pad(blocked, margin, constant_values=True)
    rows, columns = blocked.shape
    result = blocked.copy()
    for up in range(-margin, margin + 1):
        for right in range(-margin, margin + 1):
            if 0 < up * up + right * right <= reach * reach:
                result |= padded[margin + up : margin + up + rows, margin + right : margin + right + columns]
    return result


def _numbers(at: Array, origin: float, cell: float, count: int) -> IntArray:
    number = np.floor((at - origin) * (1.0 / cell)).astype(np.intp)
    # as clip does, which looks up the limits of the type each time
    return np.asarray(np.minimum(np.maximum(number, 0), count - 1))


def _fixed(state: NDArray[np.uint8]) -> NDArray[np.uint8]:
    state.setflags(write=False)
    return state
