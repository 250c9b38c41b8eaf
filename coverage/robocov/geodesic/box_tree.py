"""Trees of bounding boxes, which let searches skip everything that is far away.

The items of a tree, such as walls, are numbered. A tree is a (nodes, 4) array. Row i is the bounding box of
node i, with the columns `LOW_X`, `LOW_Y`, `HIGH_X` and `HIGH_Y`. Node 1 is the root, and node i has the
children 2 i and 2 i + 1. The second half of the nodes are leaves, which contain `LEAF_SIZE` consecutive items
each. The lower bounds of an empty leaf are infinite. Row 0 is not used.

A search starts at the `ROOT`. It descends from a node to its first child (`get_first_child`), and skips the
nodes below a box that is too far away: `skip_subtree` returns the next node, or `END_OF_TREE`.
"""

import numpy as np

from robocov.compiled import kernel
from robocov.typing import FloatArray, IntArray

ROOT = 1
"""The node that contains all items."""
END_OF_TREE = 0
"""Used in place of a node when a search has visited the whole tree."""
LEAF_SIZE = 8
"""Number of items per leaf."""
LOW_X = 0
"""Column of a box: minimum x."""
LOW_Y = 1
"""Column of a box: minimum y."""
HIGH_X = 2
"""Column of a box: maximum x."""
HIGH_Y = 3
"""Column of a box: maximum y."""
Z_ORDER_BITS = 16
"""Number of bits of each coordinate in `compute_z_order`."""


def build_box_tree(low: FloatArray, high: FloatArray) -> FloatArray:
    """Build a binary tree of bounding boxes, in which each box contains the boxes of its two children.

    Parameters
    ----------
    low, high : (m, 2) array
        Lower left and upper right corners of the boxes of the items. A search is fast if items with nearby
        indices are close together.

    Returns
    -------
    (nodes, 4) array
        The tree, as described at the top of this module.
    """
    # The number of leaves is a power of 2, so that each node above them has two children.
    leaf_count = 1
    while leaf_count * LEAF_SIZE < len(low):
        leaf_count *= 2
    # With the upper bounds negated, the bounds of a box that contains others are minima of theirs.
    item_boxes = np.full((leaf_count * LEAF_SIZE, 4), np.inf)
    item_boxes[: len(low)] = np.hstack([low, -high])
    # Each level has one box for each pair of boxes of the level below. The last level is the root.
    level = item_boxes.reshape(-1, LEAF_SIZE, 4).min(axis=1)
    levels = [level]
    while len(level) > 1:
        level = level.reshape(-1, 2, 4).min(axis=1)
        levels.append(level)
    levels.reverse()
    unused_row = np.full((1, 4), np.inf)
    return np.concatenate([unused_row, *levels]) * [1.0, 1.0, -1.0, -1.0]


def compute_z_order(columns: IntArray, rows: IntArray) -> IntArray:
    """Compute the positions of cells along a Z-order curve, which mostly puts neighbors close together.

    Parameters
    ----------
    columns, rows : (n,) int array
        Coordinates of the cells, from 0 to ``2**Z_ORDER_BITS - 1``.

    Returns
    -------
    (n,) int array
        Sorting the cells by these numbers puts them in the order of the curve.

    Examples
    --------
    >>> compute_z_order(np.array([0, 1, 0, 1]), np.array([0, 0, 1, 1]))
    array([0, 1, 2, 3])
    """
    # Interleave the bits of both coordinates.
    keys = np.zeros(len(columns), dtype=np.int64)
    for bit in range(Z_ORDER_BITS):
        keys |= ((columns >> bit) & 1) << (2 * bit)
        keys |= ((rows >> bit) & 1) << (2 * bit + 1)
    return keys


@kernel
def _get_first_leaf(tree: FloatArray) -> int:
    """Return the first node that is a leaf: the leaves are the second half of the nodes."""
    return len(tree) // 2


@kernel
def is_leaf(tree: FloatArray, node: int) -> bool:
    """Return whether a node is a leaf.

    Parameters
    ----------
    tree : (nodes, 4) array
    node : int

    Returns
    -------
    bool
    """
    return node >= _get_first_leaf(tree)


@kernel
def get_first_item(tree: FloatArray, leaf: int) -> int:
    """Return the index of the first of the `LEAF_SIZE` items of a leaf.

    Parameters
    ----------
    tree : (nodes, 4) array
    leaf : int
        The node of the leaf.

    Returns
    -------
    int
        If the leaf is empty, this is not the index of an item, but a larger one.
    """
    return (leaf - _get_first_leaf(tree)) * LEAF_SIZE


@kernel
def get_leaf(tree: FloatArray, item: int) -> int:
    """Return the leaf that contains an item.

    Parameters
    ----------
    tree : (nodes, 4) array
    item : int
        Index of the item.

    Returns
    -------
    int
        The node of the leaf.
    """
    return _get_first_leaf(tree) + item // LEAF_SIZE


@kernel
def get_first_child(node: int) -> int:
    """Return the first child of a node that is not a leaf. The second child follows it.

    Parameters
    ----------
    node : int

    Returns
    -------
    int
    """
    return 2 * node


@kernel
def skip_subtree(node: int) -> int:
    """Return the node that a search visits next if it skips a node and everything below it.

    Parameters
    ----------
    node : int
        The node to skip.

    Returns
    -------
    int
        The next node, or `END_OF_TREE`.
    """
    # The children of node i are 2 i and 2 i + 1. After a first child, the search continues with the second
    # one. After a second child, whose number is odd, it continues after the subtree of the parent. The number
    # of the root is odd too. Its parent would be node 0, which ends the search.
    while node & 1:
        node >>= 1
    return node + 1 if node != 0 else END_OF_TREE


@kernel
def compute_squared_box_distance(boxes: FloatArray, box: int, x: float, y: float) -> float:
    """Compute the squared distance from a point to a box.

    Parameters
    ----------
    boxes : (m, 4) array, grid steps
        A tree, or other boxes with the same columns.
    box : int
        Row of the box.
    x, y : float, grid steps
        The point.

    Returns
    -------
    float, grid steps²
        0 inside the box.
    """
    dx: float = max(boxes[box, LOW_X] - x, x - boxes[box, HIGH_X], 0.0)
    dy: float = max(boxes[box, LOW_Y] - y, y - boxes[box, HIGH_Y], 0.0)
    return dx * dx + dy * dy
