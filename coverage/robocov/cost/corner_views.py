"""The sites that each corner sees, which do not depend on the robots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.cost.lattice import NO_SITE, SLOTS, Tiles
from robocov.geodesic.angular_index import (
    NO_SPACE,
    ONLY_SOURCE,
    AngularWallIndex,
    index_walls,
    is_box_hidden,
    is_visible,
)
from robocov.geodesic.box_tree import (
    END_OF_TREE,
    LEAF_SIZE,
    LOW_X,
    ROOT,
    get_first_child,
    get_first_item,
    is_leaf,
    skip_subtree,
)
from robocov.geodesic.walls import Walls, can_bend_at_corner
from robocov.typing import FloatArray, IntArray


class CornerViews(NamedTuple):
    """The sites that each corner sees and to which a shortest path can bend at the corner.

    There is a row for each corner and each tile in which it sees such sites. The rows are sorted by tile.
    """

    row_starts: IntArray
    """(t + 1,) The rows of tile k are those from ``row_starts[k]`` up to ``row_starts[k + 1]``."""
    corners: IntArray
    """(r,) The corner of each row."""
    visible_slots: IntArray
    """(r,) The slots of the tile that contain these sites, as a bit mask: bit s is set for slot s."""
    min_distances: FloatArray
    """(r,) Distance from the corner to the nearest of these sites, grid steps."""
    max_distances: FloatArray
    """(r,) Distance from the corner to the farthest of these sites, grid steps."""


_CORNER = 0
"""Column of the integers that `find_corner_views` writes: the corner."""
_TILE = 1
"""Column of the same integers: the tile."""
_VISIBLE_SLOTS = 2
"""Column of the same integers: the bit mask of the visible slots."""
INDEX_COLUMNS = 3
"""Number of columns of these integers."""

_MIN_DISTANCE = 0
"""Column of the lengths that `find_corner_views` writes: the distance to the nearest visible site."""
_MAX_DISTANCE = 1
"""Column of the same lengths: the distance to the farthest visible site."""
LENGTH_COLUMNS = 2
"""Number of columns of these lengths."""


def build_corner_views(tile_count: int, indices: IntArray, lengths: FloatArray) -> CornerViews:
    """Sort the rows that `find_corner_views` has written by tile.

    Parameters
    ----------
    tile_count : int
        Number of tiles.
    indices : (r, 3) int array
        Corner, tile and visible slots.
    lengths : (r, 2) array, grid steps
        Distances of the nearest and the farthest site.

    Returns
    -------
    CornerViews
    """
    by_tile = np.argsort(indices[:, _TILE], kind="stable")
    indices = indices[by_tile]
    lengths = lengths[by_tile]
    return CornerViews(
        row_starts=np.searchsorted(indices[:, _TILE], np.arange(tile_count + 1)),
        corners=np.ascontiguousarray(indices[:, _CORNER]),
        visible_slots=np.ascontiguousarray(indices[:, _VISIBLE_SLOTS]),
        min_distances=np.ascontiguousarray(lengths[:, _MIN_DISTANCE]),
        max_distances=np.ascontiguousarray(lengths[:, _MAX_DISTANCE]),
    )


@kernel
def find_corner_views(
    walls: Walls,
    tiles: Tiles,
    first: int,
    end: int,
    wall_index: AngularWallIndex,
    indices: IntArray,
    lengths: FloatArray,
) -> int:
    """Find the sites that each corner of a range sees; see `CornerViews`.

    Parameters
    ----------
    walls : Walls
    tiles : Tiles
    first, end : int
        The range of corners, from `first` up to but not including `end`.
    wall_index : AngularWallIndex
        Scratch space for one source.
    indices : (m, 3) int array
        Result: corner, tile and visible slots.
    lengths : (m, 2) array, grid steps
        Result: distances of the nearest and the farthest visible site.

    Returns
    -------
    int
        Number of rows of the result, or `NO_SPACE` if the arrays for it or the wall index are too small.
    """
    row_count = 0
    for corner in range(first, end):
        x = walls.corners[corner, 0]
        y = walls.corners[corner, 1]
        if index_walls(walls, wall_index, x, y) == NO_SPACE:
            return NO_SPACE
        row_count = _add_views(walls, tiles, wall_index, corner, indices, lengths, row_count)
        if row_count == NO_SPACE:
            return NO_SPACE
    return row_count


@kernel
def _add_views(
    walls: Walls,
    tiles: Tiles,
    wall_index: AngularWallIndex,
    corner: int,
    indices: IntArray,
    lengths: FloatArray,
    row_count: int,
) -> int:
    """Add a row to the results for each tile in which a corner sees sites.

    Rows are added to `indices` and `lengths` after the first `row_count` ones. Return the new number of rows,
    or `NO_SPACE`.

    A search in the box tree of the tiles skips boxes that are hidden by walls, and empty boxes, whose lower
    bounds are infinite.
    """
    tree = tiles.tree
    node = ROOT
    while node != END_OF_TREE:
        is_empty = tree[node, LOW_X] == np.inf
        if is_empty or is_box_hidden(tree, node, wall_index, ONLY_SOURCE):
            node = skip_subtree(node)
            continue
        if not is_leaf(tree, node):
            node = get_first_child(node)
            continue
        first_tile = get_first_item(tree, node)
        for tile in range(first_tile, min(first_tile + LEAF_SIZE, len(tiles.boxes))):
            if row_count == len(indices):
                return NO_SPACE
            if is_box_hidden(tiles.boxes, tile, wall_index, ONLY_SOURCE):
                continue
            # The lengths are written even if no site is visible. The next tile then overwrites them.
            visible_slots = _find_visible_sites(walls, wall_index, tiles, corner, tile, lengths[row_count])
            if visible_slots != 0:
                indices[row_count, _CORNER] = corner
                indices[row_count, _TILE] = tile
                indices[row_count, _VISIBLE_SLOTS] = visible_slots
                row_count += 1
        node = skip_subtree(node)
    return row_count


@kernel
def _find_visible_sites(
    walls: Walls, wall_index: AngularWallIndex, tiles: Tiles, corner: int, tile: int, lengths: FloatArray
) -> int:
    """Find the sites of a tile to which a shortest path can lead straight from a corner at which it bends.

    The corner sees these sites, and a shortest path can bend at the corner in their direction. Return the
    sites as a bit mask, with bit s for the site in slot s of the tile. Write the distances from the corner to
    the nearest and to the farthest of these sites to `lengths`.
    """
    corner_x = walls.corners[corner, 0]
    corner_y = walls.corners[corner, 1]
    visible_slots = 0
    min_distance = np.inf
    max_distance = 0.0
    for slot in range(SLOTS):
        x = tiles.x[tile, slot]
        y = tiles.y[tile, slot]
        if (
            tiles.sites[tile, slot] != NO_SITE
            and can_bend_at_corner(walls.corners, walls.corner_walls, corner, x, y)
            and is_visible(walls, wall_index, ONLY_SOURCE, x, y)
        ):
            visible_slots |= 1 << slot
            dx = x - corner_x
            dy = y - corner_y
            distance = np.sqrt(dx * dx + dy * dy)
            min_distance = min(min_distance, distance)
            max_distance = max(max_distance, distance)
    lengths[_MIN_DISTANCE] = min_distance
    lengths[_MAX_DISTANCE] = max_distance
    return visible_slots
