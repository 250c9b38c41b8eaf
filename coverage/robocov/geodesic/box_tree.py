"""Trees of bounding boxes, which let searches skip everything that is far away.

A tree is a (nodes, 4) array. Row i is the box of node i, with the columns `LOW_X`, `LOW_Y`, `HIGH_X` and
`HIGH_Y`. Node 1 is the root, and node i has the children 2 i and 2 i + 1. The second half of the nodes are
leaves of `LEAF_SIZE` consecutive items each; the boxes of empty leaves start at infinity. Row 0 is not used.

A search starts at the `ROOT`. It descends from a node to its first child (`get_first_child`), and skips the
nodes below a box that is too far away: `skip_subtree` returns the next node, or `END_OF_TREE`.
"""

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel

ROOT = 1
"""The node that contains all items."""
END_OF_TREE = 0
"""Returned instead of a node at the end of a search."""
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


def build_box_tree(low: Array, high: Array) -> Array:
    """Build the box tree of items: a binary tree, in which each box contains those of its two children.

    Parameters
    ----------
    low, high : (m, 2) array
        Lower left and upper right corners of the items, in an order in which neighbors are close together.

    Returns
    -------
    (nodes, 4) array
        The tree, as described at the top of this module.
    """
    # The number of leaves is a power of 2, so that each node above them has two children.
    leaf_count = 1
    while leaf_count * LEAF_SIZE < len(low):
        leaf_count *= 2
    # With the upper bounds negated, all four bounds are minima.
    items = np.full((leaf_count * LEAF_SIZE, 4), np.inf)
    items[: len(low)] = np.hstack([low, -high])
    # Each level has half as many boxes as the one below: one for each pair. The last level is the root.
    level = items.reshape(-1, LEAF_SIZE, 4).min(axis=1)
    levels = [level]
    while len(level) > 1:
        level = level.reshape(-1, 2, 4).min(axis=1)
        levels.append(level)
    levels.reverse()
    unused_row = np.full((1, 4), np.inf)
    return np.concatenate([unused_row, *levels]) * [1.0, 1.0, -1.0, -1.0]


def compute_z_order(column: IntArray, row: IntArray) -> IntArray:
    """Compute positions along a Z-curve, on which neighbors in the plane are close together.

    Parameters
    ----------
    column, row : (n,) int array
        Coordinates from 0 to ``2**Z_ORDER_BITS - 1``.

    Returns
    -------
    (n,) int array

    Examples
    --------
    >>> compute_z_order(np.array([0, 1, 0, 1]), np.array([0, 0, 1, 1]))
    array([0, 1, 2, 3])
    """
    # Interleave the bits of both coordinates.
    key = np.zeros(len(column), dtype=np.int64)
    for bit in range(Z_ORDER_BITS):
        key |= ((column >> bit) & 1) << (2 * bit)
        key |= ((row >> bit) & 1) << (2 * bit + 1)
    return key


@kernel
def is_leaf(boxes: Array, node: int) -> bool:
    """Return whether a node is a leaf.

    Parameters
    ----------
    boxes : (nodes, 4) array
    node : int

    Returns
    -------
    bool
    """
    first_leaf = len(boxes) // 2
    return node >= first_leaf


@kernel
def get_first_item(boxes: Array, leaf: int) -> int:
    """Return the index of the first of the `LEAF_SIZE` items of a leaf.

    Parameters
    ----------
    boxes : (nodes, 4) array
    leaf : int

    Returns
    -------
    int
        It may exceed the last item of the tree.
    """
    first_leaf = len(boxes) // 2
    return (leaf - first_leaf) * LEAF_SIZE


@kernel
def get_leaf(boxes: Array, item: int) -> int:
    """Return the leaf that contains an item.

    Parameters
    ----------
    boxes : (nodes, 4) array
    item : int

    Returns
    -------
    int
    """
    first_leaf = len(boxes) // 2
    return first_leaf + item // LEAF_SIZE


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

    Returns
    -------
    int
        The node, or `END_OF_TREE`.
    """
    # The children of node i are 2 i and 2 i + 1. After a second child, whose number is odd, the search
    # continues after the subtree of its parent; after a first child, with the second one.
    while node & 1:
        node >>= 1
    return node + 1 if node != 0 else END_OF_TREE


@kernel
def compute_squared_box_distance(boxes: Array, node: int, x: float, y: float) -> float:
    """Compute the squared distance from a point to a box.

    Parameters
    ----------
    boxes : (nodes, 4) array, grid steps
    node : int
        The node of the box.
    x, y : float, grid steps
        The point.

    Returns
    -------
    float, grid steps²
        0 inside the box.
    """
    dx: float = max(boxes[node, LOW_X] - x, x - boxes[node, HIGH_X], 0.0)
    dy: float = max(boxes[node, LOW_Y] - y, y - boxes[node, HIGH_Y], 0.0)
    return dx * dx + dy * dy
