"""The sites at which the coverage cost is taken: the free cells of a square lattice over a map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray, beginnings, frozen
from robocov.cost.site_paths import GROUP, SLOTS, TILE, Tiles
from robocov.errors import ParameterError
from robocov.geodesic.walls import along_z_curve, box_tree

if TYPE_CHECKING:
    from robocov.geodesic import Geodesics

Number = TypeVar("Number", bound=np.generic)

_BLOCK = 1 << 18
"""Cells that are looked at together, which bounds the memory."""


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


def lattice_of(geodesics: Geodesics, side: int) -> tuple[Sites, Tiles]:
    """Return the free cells of a lattice of so many cells a side, by rows, and in tiles of 4 by 4 cells.

    Raises
    ------
    ParameterError
        When no cell is free.
    """
    grid, spacing = geodesics.grid, geodesics.size / side

    def middles(cells: IntArray) -> Array:
        return (np.column_stack([cells % side, cells // side]) + 0.5) * spacing + grid.origin

    free, components = [], []
    for block in range(0, side * side, _BLOCK):
        cells = np.arange(block, min(block + _BLOCK, side * side))
        inside = geodesics.winding(grid.snap(middles(cells))) == 1
        some = inside.any(axis=1)
        free.append(cells[some])
        components.append(inside[some].argmax(axis=1))
    cells, component = np.concatenate(free), np.concatenate(components)
    if not len(cells):
        raise ParameterError(f"lattice: {side}, but none of its sites is free; a finer one was wanted")
    cells.setflags(write=False)
    sites = Sites(side, spacing, frozen(middles(cells)), cells)

    tile = along_z_curve(cells % side // TILE, cells // side // TILE)
    order = np.argsort(tile, kind="stable")
    begin = beginnings(tile[order])
    sizes = np.diff(begin, append=len(order))
    slots = np.arange(SLOTS)
    empty = slots >= sizes[:, None]
    slots = np.where(empty, begin[:, None], begin[:, None] + slots)
    places = np.ascontiguousarray(np.moveaxis(grid.snap(sites.points[order])[slots], -1, 0))
    low, high = places.min(axis=2).T, places.max(axis=2).T
    groups = np.arange(0, len(low), GROUP)
    boxes, around = (
        np.hstack([np.minimum.reduceat(low, each), np.maximum.reduceat(high, each)])
        for each in (np.arange(len(low)), groups)
    )
    facts = np.stack([np.where(empty, -1, order[slots]), component[order][slots]])
    return sites, Tiles(places, facts, boxes, around, box_tree(low, high))
