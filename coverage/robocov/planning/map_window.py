"""The cells of a discovered map in a window, and the nodes that represent blocks of cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from robocov.planning.discovered_map import UNKNOWN, DiscoveredMap, dilate
from robocov.planning.openness import MAX_BLOCKS, compute_openness
from robocov.planning.raster import SIDE_STEPS
from robocov.planning.window import Window
from robocov.typing import BoolArray, FloatArray, IntArray


class Frontier(NamedTuple):
    """The unknown cells next to free cells with space for a robot."""

    rows: IntArray
    """(b,) Row of each unknown cell in the window."""
    columns: IntArray
    """(b,) Column of each unknown cell in the window."""
    patches: IntArray
    """(b,) Label of the unknown patch to which each cell belongs, from 1."""
    is_side_free: BoolArray
    """(b, 4) Whether there is such a free cell on each of the four sides, in the order of `SIDE_STEPS`."""


class UnknownArea(NamedTuple):
    """Unknown cells, grouped by patch and by the node that represents them.

    Entry k belongs to the cells of one patch that one node represents.
    """

    patches: IntArray
    """(k,) Label of the patch, from 1."""
    nodes: IntArray
    """(k,) Index of the node."""
    counts: FloatArray
    """(k,) Number of cells of the patch that the node represents."""
    expected_free_counts: FloatArray
    """(k,) Expected number of free cells among them."""


@dataclass(eq=False)
class MapWindow:
    """The cells of a discovered map in a window, (h, w), and the nodes of the window, (m,).

    A cell is *near a wall* if the distance between its center and that of a blocked cell is at most the
    clearance. Everything outside the window counts as blocked. A node *has clearance* if the cell in which it
    lies is not near a wall.

    Parameters
    ----------
    known_map : DiscoveredMap
    window : Window
    clearance : float, m
        Distance that routes keep from walls, except for the last step to a node.
    """

    known_map: DiscoveredMap
    window: Window
    clearance: float

    @cached_property
    def is_blocked(self) -> BoolArray:
        """Whether each cell is a wall, a presumed wall, or outside the region, (h, w)."""
        return self.window.crop(self.known_map.is_blocked, fill=True)

    @cached_property
    def is_unknown(self) -> BoolArray:
        """Whether each cell is unknown, (h, w). Cells beyond the raster are unknown, too."""
        return np.asarray(self.window.crop(self.known_map.state, np.uint8(UNKNOWN)) == UNKNOWN)

    @cached_property
    def is_outside(self) -> BoolArray:
        """Whether each cell is outside the region, (h, w)."""
        return self.window.crop(self.known_map.raster.is_outside, fill=True)

    @cached_property
    def is_free(self) -> BoolArray:
        """Whether each cell is known to be free, (h, w)."""
        return np.asarray(~(self.is_unknown | self.is_blocked | self.is_outside))

    @cached_property
    def is_near_wall(self) -> BoolArray:
        """Whether each cell is near a wall, (h, w)."""
        return dilate(self.is_blocked, self.clearance / self.known_map.raster.cell_size)

    @cached_property
    def openness(self) -> FloatArray:
        """Probability that each unknown cell is free, (h, w); 0 for all other cells."""
        state = self.window.crop(self.known_map.state, np.uint8(UNKNOWN))
        max_blocks = min(MAX_BLOCKS, self.window.rows * self.window.columns)
        return compute_openness(state, self.is_outside, max_blocks)

    @cached_property
    def patches(self) -> IntArray:
        """Label, from 1, of the connected patch of each unknown cell, (h, w); 0 for all other cells."""
        labels, _ = ndimage.label(self.is_unknown & ~self.is_outside)
        return np.asarray(labels)

    @cached_property
    def free_areas(self) -> IntArray:
        """Label, from 1, of the connected area of each cell known to be free, (h, w); 0 for other cells."""
        labels, _ = ndimage.label(self.is_free)
        return np.asarray(labels)

    @property
    def spacing(self) -> float:
        """Distance between neighboring nodes, m."""
        return self.window.stride * self.known_map.raster.cell_size

    @cached_property
    def nodes(self) -> FloatArray:
        """Positions of the nodes, (m, 2) in meters, row by row."""
        return self.window.compute_nodes(self.known_map.raster)

    @cached_property
    def has_clearance(self) -> BoolArray:
        """Whether each node has the clearance, (m,)."""
        stride = self.window.stride
        return np.asarray(~self.is_near_wall[stride // 2 :: stride, stride // 2 :: stride].ravel())

    @cached_property
    def free_counts(self) -> FloatArray:
        """Number of free cells that each node represents, (m,)."""
        return self.sum_by_node(self.is_free)

    @cached_property
    def expected_free_counts(self) -> FloatArray:
        """Expected number of free cells that each node represents, (m,), with unknown ones by openness."""
        return self.sum_by_node(self.is_free + self.openness)

    @cached_property
    def frontier(self) -> Frontier:
        """The unknown cells next to free cells with space for a robot."""
        # With a margin of one cell, shifted views contain the neighbor of each cell in one direction.
        height, width = self.is_free.shape
        is_usable = np.pad(self.is_free & ~self.is_near_wall, 1)
        is_side_free = np.stack(
            [is_usable[1 + up : 1 + up + height, 1 + right : 1 + right + width] for up, right in SIDE_STEPS],
            axis=-1,
        )
        rows, columns = np.nonzero(is_side_free.any(axis=-1) & (self.patches > 0))
        return Frontier(
            rows=rows,
            columns=columns,
            patches=self.patches[rows, columns],
            is_side_free=is_side_free[rows, columns],
        )

    @cached_property
    def unknown_area(self) -> UnknownArea:
        """The unknown cells, grouped by patch and by node."""
        rows, columns = self.patches.nonzero()
        nodes = self.window.find_nodes(rows, columns)
        # Each pair of a patch and a node is one number, so that the cells can be grouped by pair.
        node_count = len(self.nodes)
        pairs, index = np.unique(self.patches[rows, columns] * node_count + nodes, return_inverse=True)
        return UnknownArea(
            patches=pairs // node_count,
            nodes=pairs % node_count,
            counts=np.bincount(index).astype(np.float64),
            expected_free_counts=np.bincount(index, self.openness[rows, columns]).astype(np.float64),
        )

    def find_connected(self, positions: FloatArray) -> BoolArray:
        """Find which positions are connected to the first one through cells known to be free.

        Parameters
        ----------
        positions : (k, 2) array, m

        Returns
        -------
        (k,) bool array
            False for positions outside the window or in a cell that is not known to be free. If the first
            position is one of these, all are False. A position outside the raster counts as being in the
            nearest cell. The width of passages is ignored.
        """
        rows, columns = self.known_map.raster.find_cells(positions)
        rows = rows - self.window.first_row
        columns = columns - self.window.first_column
        height, width = self.free_areas.shape
        is_inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        areas = np.zeros(len(positions), dtype=np.intp)
        areas[is_inside] = self.free_areas[rows[is_inside], columns[is_inside]]
        return np.asarray((areas == areas[0]) & (areas > 0))

    def sum_by_node(self, values: FloatArray | BoolArray) -> FloatArray:
        """Sum the values of the cells that each node represents.

        Parameters
        ----------
        values : (h, w) array

        Returns
        -------
        (m,) array
        """
        blocks = values.reshape(self.window.block_shape)
        return np.asarray(blocks.sum(axis=(1, 3), dtype=np.float64).ravel())
