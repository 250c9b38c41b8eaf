"""The sites at which the coverage cost is taken: the free cells of a square lattice over a map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray, frozen
from robocov.arrays.grouping import beginnings
from robocov.cost.site_paths import GROUP, Tiles
from robocov.errors import ParameterError
from robocov.geodesic.visibility import Boxes, along_z_curve, boxes_around

if TYPE_CHECKING:
    from robocov.geodesic.corners import Walls

Number = TypeVar("Number", bound=np.generic)

TILE = 4
"""Cells along a side of a tile."""


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
    tiles : Tiles

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

        tile = along_z_curve(column // TILE, row // TILE)
        by_tile = np.argsort(tile, kind="stable")
        begin = beginnings(tile[by_tile])
        slot = (row % TILE * TILE + column % TILE)[by_tile]
        cell = cells[by_tile]
        x, y = x[cell], y[cell]
        boxes = _around(x, y, x, y, begin)
        groups = _around(*boxes, np.arange(0, len(begin), GROUP))
        first = np.append(begin, len(cell))
        tree = boxes_around(*boxes)
        self.tiles = Tiles(by_tile, x, y, slot, component[cell], first, boxes, groups, tree)


def _around(low_x: Array, low_y: Array, high_x: Array, high_y: Array, begin: IntArray) -> Boxes:
    """Return boxes around groups of boxes, given by where the groups begin."""
    low = (np.minimum.reduceat(side, begin) for side in (low_x, low_y))
    high = (np.maximum.reduceat(side, begin) for side in (high_x, high_y))
    return Boxes(*low, *high)
