"""The sites at which the coverage cost is taken: the free cells of a square lattice over a map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray, frozen
from robocov.arrays.grouping import beginnings, ranges, sizes
from robocov.cost.scanlines import Scanlines
from robocov.errors import ParameterError

if TYPE_CHECKING:
    from robocov.geodesic.corners import Walls

Number = TypeVar("Number", bound=np.generic)

TILE = 4
"""Cells along a side of a tile."""

_GROUP = 16
"""Tiles looked at together, more where there are very many."""

_PAIRS = 1 << 18
"""Pairs of groups and robots looked at at once, which bounds the memory."""


@dataclass(frozen=True, eq=False)
class Sites:
    """Where the sites of a lattice are.

    Attributes
    ----------
    lattice : int
        Cells along a side.
    spacing : float, m
        Side of a cell.
    points : (m, 2) m
        The sites, row by row from the lower left.
    cells : (m,)
        Their numbers among all cells, ``row * lattice + column``.
    """

    lattice: int
    spacing: float
    points: Array
    cells: IntArray

    def grid(self, values: NDArray[Number]) -> NDArray[Number]:
        """Return (m,) values of the sites as a picture of the whole lattice, (n, n), the lowest row first.

        Cells that are not free hold nan, or -1 where the values are whole numbers.
        """
        fill = np.nan if np.issubdtype(values.dtype, np.inexact) else -1
        picture = np.full(self.lattice**2, fill, dtype=values.dtype)
        picture[self.cells] = values
        return picture.reshape(self.lattice, self.lattice)


class Lattice:
    """The free cells of a lattice, by rows, and in tiles of 4 by 4 cells.

    Parameters
    ----------
    walls : Walls
    size : float, m
        Side of the square over the region's bounding box, from its lower left corner.
    side : int
        Cells along a side.

    Attributes
    ----------
    sites : Sites
    x, y : (m,) grid steps
    component : (m,)
        Which component of the free space holds the site.
    scanlines : Scanlines
    by_tile : (m,)
        The sites in the order of the tiles, which follow a Z-curve.
    tile : (m,)
        The tile of each of these, numbered without those that hold no site.
    slot : (m,)
        Its place among the tile's cells.
    tiles : int
    first : (t + 1,)
        The sites of a tile are those from its own `first` up to the next, in `by_tile`.
    low_x, low_y, high_x, high_y : (t,) grid steps
        Boxes around the sites of each tile.

    Raises
    ------
    ParameterError
        When no cell is free.
    """

    def __init__(self, walls: Walls, size: float, side: int) -> None:
        spacing = size / side
        middles = (np.arange(side) + 0.5) * spacing
        column_x, row_y = walls.grid.snap(np.column_stack([middles, middles]) + walls.grid.origin).T
        y, x = (part.ravel() for part in np.meshgrid(row_y, column_x, indexing="ij"))
        component = np.full(side * side, -1, dtype=np.intp)
        for k, part in enumerate(walls.free.geoms):
            component[shapely.contains_xy(part, x, y)] = k
        cells = np.nonzero(component >= 0)[0]
        if not len(cells):
            raise ParameterError(f"lattice: {side}, but none of its sites is free; a finer one was wanted")
        row, column = np.divmod(cells, side)
        points = np.column_stack([middles[column], middles[row]]) + walls.grid.origin
        cells.setflags(write=False)
        self.sites = Sites(side, spacing, frozen(points), cells)
        self.x, self.y, self.component = x[cells], y[cells], component[cells]
        self.scanlines = Scanlines(column_x, row_y, (component >= 0).reshape(side, side))

        tile = _interleaved(column // TILE, row // TILE)
        self.by_tile = np.argsort(tile, kind="stable")
        tile = tile[self.by_tile]
        begin = beginnings(tile)
        self.tile = np.repeat(np.arange(len(begin)), sizes(begin, len(tile)))
        self.slot = (row % TILE * TILE + column % TILE)[self.by_tile]
        self.tiles = len(begin)
        self.first = np.append(begin, len(tile))
        x, y = self.x[self.by_tile], self.y[self.by_tile]
        self.low_x, self.low_y = np.minimum.reduceat(x, begin), np.minimum.reduceat(y, begin)
        self.high_x, self.high_y = np.maximum.reduceat(x, begin), np.maximum.reduceat(y, begin)

    def within(
        self, place: IntArray, bound2: Array, x: Array, y: Array
    ) -> tuple[IntArray, IntArray, Array, Array, Array]:
        """Return the pairs of a site and a robot that are less than a bound apart.

        Parameters
        ----------
        place : (h,)
            The sites, by their places in `by_tile`, ascending.
        bound2 : (h,)
            The bound's square.
        x, y : (n,) grid steps
            The robots.

        Returns
        -------
        index : (p,)
            The site, as an index of `place`.
        robot : (p,)
        dx, dy : (p,) grid steps
            From the robot to the site.
        distance2 : (p,)
        """
        begin = beginnings(self.tile[place])
        tile = self.tile[place[begin]]
        low_x, low_y, high_x, high_y = (
            side[tile] for side in (self.low_x, self.low_y, self.high_x, self.high_y)
        )
        limit2 = np.maximum.reduceat(bound2, begin)
        # first whole groups of tiles
        group = np.arange(0, len(tile), max(_GROUP, len(tile) * len(x) // _PAIRS))
        near2 = _near2(
            np.minimum.reduceat(low_x, group)[:, None] - x,
            np.minimum.reduceat(low_y, group)[:, None] - y,
            np.maximum.reduceat(high_x, group)[:, None] - x,
            np.maximum.reduceat(high_y, group)[:, None] - y,
        )
        which, robot = np.nonzero(near2 < np.maximum.reduceat(limit2, group)[:, None])
        count = sizes(group, len(tile))[which]
        at, robot = ranges(group[which], count), robot.repeat(count)
        px, py = x[robot], y[robot]
        near2 = _near2(low_x[at] - px, low_y[at] - py, high_x[at] - px, high_y[at] - py)
        near = (near2 < limit2[at]).nonzero()[0]
        at, robot = at[near], robot[near]
        count = sizes(begin, len(place))[at]
        index, robot = ranges(begin[at], count), robot.repeat(count)
        site = self.by_tile[place[index]]
        dx, dy = self.x[site] - x[robot], self.y[site] - y[robot]
        distance2 = dx * dx + dy * dy
        near = (distance2 < bound2[index]).nonzero()[0]
        return index[near], robot[near], dx[near], dy[near], distance2[near]


def _near2(low_x: Array, low_y: Array, high_x: Array, high_y: Array) -> Array:
    """Return the squared distances of points to boxes, given by how far their sides are right and above."""
    dx, dy = np.maximum(np.maximum(low_x, -high_x), 0.0), np.maximum(np.maximum(low_y, -high_y), 0.0)
    return np.asarray(dx * dx + dy * dy)


def _interleaved(column: IntArray, row: IntArray) -> IntArray:
    """Return numbers along a Z-curve, which keeps neighbours together, of whole numbers below 65536."""
    key = np.zeros(len(column), dtype=np.int64)
    for bit in range(16):
        key |= ((column >> bit) & 1) << (2 * bit) | ((row >> bit) & 1) << (2 * bit + 1)
    return key
