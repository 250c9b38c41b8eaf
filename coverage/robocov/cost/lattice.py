"""The lattice of sites over which the coverage cost is averaged, and its division into tiles for kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from robocov.arrays import copy_read_only, find_run_starts
from robocov.errors import ParameterError
from robocov.geodesic import Geodesics
from robocov.geodesic.box_tree import build_box_tree, compute_z_order
from robocov.typing import AnyArray, FloatArray, IntArray

MAX_LATTICE = 4096
"""Maximum number of cells along a side of the lattice."""

TILE_SIDE = 4
"""Number of cells along a side of a tile."""

SLOTS = TILE_SIDE**2
"""Number of slots of a tile: one for each of its cells."""

TILES_PER_GROUP = 16
"""Number of consecutive tiles in a group, which has a bounding box of its own."""

NO_SITE = -1
"""Used in place of a site if a slot of a tile is empty."""

_CELLS_PER_BLOCK = 1 << 18
"""Number of cells whose components are determined at the same time, to limit memory."""


@dataclass(frozen=True, eq=False)
class Sites:
    """The sites of a lattice: the centers of its cells that are in the free space.

    Attributes
    ----------
    lattice : int
        Number of cells along a side of the lattice.
    spacing : float, m
        Side of a cell.
    points : (m, 2) array, m
        Positions of the sites, row by row from the lower left.
    cells : (m,) int array
        Index of the cell of each site, ``row * lattice + column``.
    """

    lattice: int
    spacing: float
    points: FloatArray
    cells: IntArray

    def to_grid(self, values: AnyArray) -> AnyArray:
        """Arrange values of the sites as an image of the whole lattice.

        Parameters
        ----------
        values : (m,) array
            One value for each site.

        Returns
        -------
        (lattice, lattice) array
            The value of each cell, the lowest row first. Cells without a site are nan, or -1 if the values
            are integers.
        """
        fill_value = np.nan if np.issubdtype(values.dtype, np.inexact) else -1
        image = np.full(self.lattice**2, fill_value, dtype=values.dtype)
        image[self.cells] = values
        return image.reshape(self.lattice, self.lattice)


class Tiles(NamedTuple):
    """The sites of a lattice in square tiles of `SLOTS` cells, in grid steps.

    Each tile has one slot per cell. Its sites fill the first slots. If it has fewer sites than slots, the
    other slots are empty: their coordinates and component repeat those of the first site, and their site is
    `NO_SITE`. Nearby tiles have nearby indices.
    """

    x: FloatArray
    """(t, SLOTS) x coordinate of the site in each slot."""
    y: FloatArray
    """(t, SLOTS) y coordinate of the site in each slot."""
    sites: IntArray
    """(t, SLOTS) Index of the site in each slot, as in `Sites`, or `NO_SITE` if the slot is empty."""
    components: IntArray
    """(t, SLOTS) The component of the free space that contains the site in each slot."""
    boxes: FloatArray
    """(t, 4) The bounding box of the sites of each tile; for the columns, see `robocov.geodesic.box_tree`."""
    group_boxes: FloatArray
    """(g, 4) The bounding box of each group of `TILES_PER_GROUP` consecutive tiles."""
    tree: FloatArray
    """The box tree of the tiles."""


def build_lattice(geodesics: Geodesics, lattice: int) -> tuple[Sites, Tiles]:
    """Build the sites of a lattice, and arrange them in tiles.

    The region's bounding box, extended to a square from its lower left corner, is divided into
    ``lattice²`` cells.

    Parameters
    ----------
    geodesics : Geodesics
        The shortest paths of the environment.
    lattice : int
        Number of cells along a side of the lattice.

    Returns
    -------
    sites : Sites
    tiles : Tiles

    Raises
    ------
    ParameterError
        If no site is in the free space.
    """
    spacing = geodesics.size / lattice
    all_cells = []
    all_components = []
    for first in range(0, lattice * lattice, _CELLS_PER_BLOCK):
        cells = np.arange(first, min(first + _CELLS_PER_BLOCK, lattice * lattice))
        centers = _compute_centers(cells, lattice, spacing, geodesics.grid.origin)
        # Column c of `is_inside` says which cells are in component c of the free space.
        is_inside = geodesics.count_windings(geodesics.grid.snap(centers)) == 1
        is_free = is_inside.any(axis=1)
        if is_free.any():
            all_cells.append(cells[is_free])
            all_components.append(is_inside[is_free].argmax(axis=1))
    if not all_cells:
        raise ParameterError(
            f"lattice: expected at least one site in the free space, got none with {lattice} cells along a "
            "side; choose a finer lattice"
        )
    cells = np.concatenate(all_cells)
    cells.setflags(write=False)
    points = copy_read_only(_compute_centers(cells, lattice, spacing, geodesics.grid.origin))
    sites = Sites(lattice, spacing, points, cells)
    return sites, _build_tiles(sites, geodesics.grid.snap(points), np.concatenate(all_components))


def _compute_centers(cells: IntArray, lattice: int, spacing: float, origin: FloatArray) -> FloatArray:
    """Return the centers, (m, 2) in meters, of the cells with the given indices, (m,)."""
    columns = cells % lattice
    rows = cells // lattice
    return (np.column_stack([columns, rows]) + 0.5) * spacing + origin


def _build_tiles(sites: Sites, grid_positions: FloatArray, components: IntArray) -> Tiles:
    """Arrange the sites in square tiles.

    Each tile has one slot per cell, so that kernels can use arrays of fixed size. The m sites lie at the
    given `grid_positions`, (m, 2), in `components`, (m,).
    """
    columns = sites.cells % sites.lattice
    rows = sites.cells // sites.lattice
    # Sort the sites by tile, so that the sites of each tile are contiguous in `by_tile`.
    tile_numbers = compute_z_order(columns // TILE_SIDE, rows // TILE_SIDE)
    by_tile = np.argsort(tile_numbers, kind="stable")
    first_entries = find_run_starts(tile_numbers[by_tile])
    site_counts = np.diff(first_entries, append=len(by_tile))
    slots = np.arange(SLOTS)
    is_empty = slots >= site_counts[:, None]
    # Empty slots repeat the first site of their tile, so that they change no bounding box or minimum.
    slot_sites = by_tile[first_entries[:, None] + np.where(is_empty, 0, slots)]
    x = np.ascontiguousarray(grid_positions[slot_sites, 0])
    y = np.ascontiguousarray(grid_positions[slot_sites, 1])
    low = np.column_stack([x.min(axis=1), y.min(axis=1)])
    high = np.column_stack([x.max(axis=1), y.max(axis=1)])
    group_starts = np.arange(0, len(low), TILES_PER_GROUP)
    group_low = np.minimum.reduceat(low, group_starts)
    group_high = np.maximum.reduceat(high, group_starts)
    return Tiles(
        x=x,
        y=y,
        sites=np.where(is_empty, NO_SITE, slot_sites),
        components=components[slot_sites],
        boxes=np.hstack([low, high]),
        group_boxes=np.hstack([group_low, group_high]),
        tree=build_box_tree(low, high),
    )
