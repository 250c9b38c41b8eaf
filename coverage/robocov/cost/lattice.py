"""The lattice of sites over which the coverage cost is averaged, and its division into tiles for kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray, find_run_starts, freeze
from robocov.errors import ParameterError
from robocov.geodesic import Geodesics
from robocov.geodesic.box_tree import build_box_tree, compute_z_order

MAX_LATTICE = 4096
"""Maximum number of cells along a side."""

TILE_SIDE = 4
"""Number of cells along a side of a tile."""

SLOTS = TILE_SIDE**2
"""Number of cells per tile."""

TILES_PER_GROUP = 16
"""Number of consecutive tiles that share a bounding box."""

NO_SITE = -1
"""Used in place of a site if a cell is not free."""

_CELLS_PER_BLOCK = 1 << 18
"""Number of cells that are located at the same time, to limit memory."""


@dataclass(frozen=True, eq=False)
class Sites:
    """The sites of a lattice: the centers of its cells that are in the free space.

    Attributes
    ----------
    lattice : int
        Number of cells along a side.
    spacing : float, m
        Side of a cell.
    points : (m, 2) array, m
        Positions, row by row from the lower left.
    cells : (m,) int array
        Index of the cell of each site, ``row * lattice + column``.
    """

    lattice: int
    spacing: float
    points: Array
    cells: IntArray

    def to_grid(self, values: NDArray[Any]) -> NDArray[Any]:
        """Arrange values of the sites as an image of the whole lattice.

        Parameters
        ----------
        values : (m,) array

        Returns
        -------
        (lattice, lattice) array
            The lowest row first. Cells that are not free are nan, or -1 if the values are integers.
        """
        fill = np.nan if np.issubdtype(values.dtype, np.inexact) else -1
        image = np.full(self.lattice**2, fill, dtype=values.dtype)
        image[self.cells] = values
        return image.reshape(self.lattice, self.lattice)


class Tiles(NamedTuple):
    """The sites of a lattice in square tiles of `SLOTS` cells, in grid steps.

    Nearby tiles have nearby indices. A slot whose cell is not free repeats another site of its tile.
    """

    x: Array
    """(t, SLOTS) x coordinate of each site."""
    y: Array
    """(t, SLOTS) y coordinate of each site."""
    site: IntArray
    """(t, SLOTS) Index of the site in the lattice, or `NO_SITE` if the cell is not free."""
    component: IntArray
    """(t, SLOTS) Component of the free space."""
    boxes: Array
    """(t, 4) The bounding box of the sites of each tile; for the columns see `robocov.geodesic.box_tree`."""
    group_boxes: Array
    """(g, 4) The bounding box of each group of `TILES_PER_GROUP` consecutive tiles."""
    tree: Array
    """The box tree of the tiles."""


def build_lattice(geodesics: Geodesics, side: int) -> tuple[Sites, Tiles]:
    """Build the sites of a lattice and their tiles.

    The region's bounding box, extended to a square from its lower left corner, is cut into ``side²`` cells.

    Parameters
    ----------
    geodesics : Geodesics
        The shortest paths of the environment.
    side : int
        Number of cells along a side.

    Returns
    -------
    sites : Sites
    tiles : Tiles

    Raises
    ------
    ParameterError
        If no site is in the free space.
    """
    spacing = geodesics.size / side
    all_cells = []
    all_components = []
    for first in range(0, side * side, _CELLS_PER_BLOCK):
        cells = np.arange(first, min(first + _CELLS_PER_BLOCK, side * side))
        centers = _compute_centers(cells, side, spacing, geodesics.grid.origin)
        # Column c of `is_inside` says which cells are in component c of the free space.
        is_inside = geodesics.count_windings(geodesics.grid.snap(centers)) == 1
        is_free = is_inside.any(axis=1)
        all_cells.append(cells[is_free])
        all_components.append(is_inside[is_free].argmax(axis=1))
    cells = np.concatenate(all_cells)
    if not len(cells):
        raise ParameterError(
            f"lattice: expected at least one site in the free space, got none with {side} cells along a "
            "side; choose a finer lattice"
        )
    cells.setflags(write=False)
    points = freeze(_compute_centers(cells, side, spacing, geodesics.grid.origin))
    sites = Sites(side, spacing, points, cells)
    return sites, _build_tiles(sites, geodesics.grid.snap(points), np.concatenate(all_components))


def _compute_centers(cells: IntArray, side: int, spacing: float, origin: Array) -> Array:
    """Return the centers of cells, (m, 2) m."""
    column = cells % side
    row = cells // side
    return (np.column_stack([column, row]) + 0.5) * spacing + origin


def _build_tiles(sites: Sites, grid_positions: Array, component: IntArray) -> Tiles:
    """Arrange the sites, whose positions are (m, 2) grid steps, in square tiles.

    Each tile has as many slots as cells, so that kernels need no lists of varying length. Its sites
    fill the first slots.
    """
    column = sites.cells % sites.lattice
    row = sites.cells // sites.lattice
    # Sort the sites by tile, so that those of one tile are consecutive entries of `by_tile`.
    tile = compute_z_order(column // TILE_SIDE, row // TILE_SIDE)
    by_tile = np.argsort(tile, kind="stable")
    first = find_run_starts(tile[by_tile])
    count = np.diff(first, append=len(by_tile))
    slot = np.arange(SLOTS)
    is_empty = slot >= count[:, None]
    # Empty slots repeat the first site of their tile, so that they change no bounding box or minimum.
    site = by_tile[first[:, None] + np.where(is_empty, 0, slot)]
    x = np.ascontiguousarray(grid_positions[site, 0])
    y = np.ascontiguousarray(grid_positions[site, 1])
    low = np.column_stack([x.min(axis=1), y.min(axis=1)])
    high = np.column_stack([x.max(axis=1), y.max(axis=1)])
    group_starts = np.arange(0, len(low), TILES_PER_GROUP)
    group_low = np.minimum.reduceat(low, group_starts)
    group_high = np.maximum.reduceat(high, group_starts)
    return Tiles(
        x=x,
        y=y,
        site=np.where(is_empty, NO_SITE, site),
        component=component[site],
        boxes=np.hstack([low, high]),
        group_boxes=np.hstack([group_low, group_high]),
        tree=build_box_tree(low, high),
    )
