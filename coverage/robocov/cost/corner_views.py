"""The sites that each corner sees, which do not depend on the robots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.cost.lattice import SLOTS, Tiles
from robocov.geodesic.angular_index import AngularWallIndex, add_walls, is_box_hidden, is_visible
from robocov.geodesic.box_tree import LEAF_SIZE, skip_subtree
from robocov.geodesic.walls import Walls, can_bend_at_corner


class CornerViews(NamedTuple):
    """The sites that each corner sees. There is a row for each corner and tile, sorted by tile."""

    first_row: IntArray
    """(t + 1,) The rows of tile k are those from ``first_row[k]`` up to ``first_row[k + 1]``."""
    corner: IntArray
    """(r,) The corner of each row."""
    mask: IntArray
    """(r,) Bit s is set if the corner sees the site in slot s, and a shortest path to it can bend there."""
    nearest: Array
    """(r,) Distance from the corner to the nearest of these sites, grid steps."""
    farthest: Array
    """(r,) Distance from the corner to the farthest of these sites, grid steps."""


def build_corner_views(tile_count: int, indices: IntArray, lengths: Array) -> CornerViews:
    """Group the views that `find_corner_views` has found by their tiles.

    Parameters
    ----------
    tile_count : int
    indices : (r, 3) int array
        Corner, tile, and mask of the sites of the tile that see the corner.
    lengths : (r, 2) array, grid steps
        Distances of the nearest and the farthest site.

    Returns
    -------
    CornerViews
    """
    by_tile = np.argsort(indices[:, 1], kind="stable")
    corner, tile, mask = indices[by_tile].T
    nearest, farthest = lengths[by_tile].T
    return CornerViews(
        first_row=np.searchsorted(tile, np.arange(tile_count + 1)),
        corner=np.ascontiguousarray(corner),
        mask=np.ascontiguousarray(mask),
        nearest=np.ascontiguousarray(nearest),
        farthest=np.ascontiguousarray(farthest),
    )


@kernel
def find_corner_views(
    walls: Walls,
    tiles: Tiles,
    first: int,
    end: int,
    index: AngularWallIndex,
    indices: IntArray,
    lengths: Array,
) -> int:
    """Find the sites that are visible from a range of corners.

    Parameters
    ----------
    walls : Walls
    tiles : Tiles
    first, end : int
        The corners are those from `first` up to `end`.
    index : AngularWallIndex
        Scratch space for one source.
    indices : (m, 3) int array
        Result: corner, tile and mask; see `CornerViews`.
    lengths : (m, 2) array, grid steps
        Result: distances of the nearest and the farthest site.

    Returns
    -------
    int
        Number of rows, or -1 if there is not enough space.
    """
    corners = walls.corners
    tree = tiles.tree
    leaves = len(tree) // 2
    used = 0
    for corner in range(first, end):
        if add_walls(walls, index, 0, corners[corner, 0], corners[corner, 1], np.inf, 0) < 0:
            return -1
        node = 1
        while node:
            if tree[node, 0] == np.inf or is_box_hidden(tree, node, index, 0):
                node = skip_subtree(node)
                continue
            if node < leaves:
                node *= 2
                continue
            leaf = (node - leaves) * LEAF_SIZE
            for tile in range(leaf, min(leaf + LEAF_SIZE, len(tiles.boxes))):
                if used == len(indices):
                    return -1
                if is_box_hidden(tiles.boxes, tile, index, 0):
                    continue
                mask = _find_visible_sites(walls, index, tiles, corner, tile, lengths[used])
                if mask != 0:
                    indices[used, 0] = corner
                    indices[used, 1] = tile
                    indices[used, 2] = mask
                    used += 1
            node = skip_subtree(node)
    return used


@kernel
def _find_visible_sites(
    walls: Walls, index: AngularWallIndex, tiles: Tiles, corner: int, tile: int, distances: Array
) -> int:
    """Return the mask of the sites of a tile that a corner sees; write the nearest and farthest distance."""
    corner_x = walls.corners[corner, 0]
    corner_y = walls.corners[corner, 1]
    mask = 0
    nearest = np.inf
    farthest = 0.0
    for slot in range(SLOTS):
        x = tiles.x[tile, slot]
        y = tiles.y[tile, slot]
        if (
            tiles.site[tile, slot] >= 0
            and can_bend_at_corner(walls.corners, walls.corner_walls, corner, x, y)
            and is_visible(walls, index, 0, x, y)
        ):
            mask |= 1 << slot
            dx = x - corner_x
            dy = y - corner_y
            length = np.sqrt(dx * dx + dy * dy)
            nearest = min(nearest, length)
            farthest = max(farthest, length)
    distances[0] = nearest
    distances[1] = farthest
    return mask
