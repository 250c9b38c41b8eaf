"""Many points in small groups with bounding boxes: who is nearest to whom, and who is within a distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, IntArray

if TYPE_CHECKING:
    from collections.abc import Iterator

_LEAVES = 16
"""Leaves in a block."""

_PAIRS = 1 << 18
"""Pairs looked at in one piece, which bounds the memory."""


def coherent_order(column: IntArray, row: IntArray) -> IntArray:
    """Return an order of cells, given by whole numbers from 0 to 65535, that keeps neighbours together.

    Along the Z-curve every run of 64 cells of a full lattice is a square of 8 by 8.
    """
    key = np.zeros(len(column), dtype=np.int64)
    for bit in range(16):
        key |= ((column >> bit) & 1) << (2 * bit) | ((row >> bit) & 1) << (2 * bit + 1)
    return np.argsort(key, kind="stable")


class Clusters:
    """Points in a coherent order, `leaf` consecutive ones in a leaf, 16 leaves in a block.

    Parameters
    ----------
    x, y : (m,)
    leaf : int
    """

    def __init__(self, x: Array, y: Array, leaf: int) -> None:
        self._count = len(x)
        self._leaf = leaf
        rows = -(-self._count // leaf)
        blocks = -(-rows // _LEAVES)
        # the last point and the last leaf fill up what is missing
        slots = np.minimum(np.arange(rows * leaf), self._count - 1).reshape(rows, leaf)
        self._x, self._y = x[slots], y[slots]
        padded = np.minimum(np.arange(blocks * _LEAVES), rows - 1)
        ends = [
            side
            for values in (self._x, self._y)
            for side in (values.min(axis=1, initial=np.inf), values.max(axis=1, initial=-np.inf))
        ]
        self._leaf_box = np.array(ends)[:, padded].reshape(4, blocks, _LEAVES)
        low_x, high_x, low_y, high_y = self._leaf_box
        self._block_box = np.array(
            [low_x.min(axis=1), high_x.max(axis=1), low_y.min(axis=1), high_y.max(axis=1)]
        )

    def nearest(self, x: Array, y: Array) -> tuple[IntArray, Array]:
        """Return each point's nearest of (n,) others, the first of equals, and its squared distance."""
        robot = np.zeros(self._x.shape, dtype=np.intp)
        best = np.full(self._x.shape, np.inf)
        for leaf, other in self._leaves_near(x, y):
            distance2 = (self._x[leaf] - x[other, None]) ** 2 + (self._y[leaf] - y[other, None]) ** 2
            begin = np.nonzero(np.diff(leaf, prepend=-1))[0]
            best[leaf[begin]] = np.minimum.reduceat(distance2, begin, axis=0)
            # the first of equals is written last
            pair, slot = (part[::-1] for part in np.nonzero(distance2 == best[leaf]))
            robot[leaf[pair], slot] = other[pair]
        return robot.ravel()[: self._count], best.ravel()[: self._count]

    def _leaves_near(self, x: Array, y: Array) -> Iterator[tuple[IntArray, IntArray]]:
        """Yield pairs of a leaf and an other that may be the nearest to a point of it, sorted."""
        blocks = self._block_box.shape[1]
        step = max(1, _PAIRS // (len(x) * _LEAVES))
        for begin in range(0, blocks, step):
            box = self._block_box[:, begin : begin + step, None]
            near, far = _nearest_and_farthest(box, x, y)
            block, other = np.nonzero(near <= far.min(axis=1)[:, None])
            if not len(block):
                continue
            near, far = _nearest_and_farthest(
                self._leaf_box[:, begin + block], x[other, None], y[other, None]
            )
            count = np.bincount(block)
            least = np.minimum.reduceat(far, np.cumsum(count) - count, axis=0)
            pair, leaf = np.nonzero(near <= least[block])
            leaf += (begin + block[pair]) * _LEAVES
            leaf, other = _sorted_pairs(leaf, other[pair], len(self._x))
            count = np.cumsum(np.bincount(leaf, minlength=len(self._x)))
            cut = 0
            while cut < len(leaf):
                done = cut
                # whole leaves, as many as make a piece
                last = int(np.searchsorted(count, done + _PAIRS // self._leaf, side="right"))
                cut = max(int(count[last - 1]) if last else 0, int(count[leaf[done]]))
                yield leaf[done:cut], other[done:cut]

    def within(self, x: Array, y: Array, bound: Array) -> tuple[IntArray, IntArray, Array]:
        """Return the pairs of a point and one of (n,) others that are less than `bound` (m,) apart.

        Returns
        -------
        point, other : (p,)
        distance : (p,)
        """
        limit = np.zeros(self._x.shape)
        limit.ravel()[: self._count] = bound * bound
        leaf_limit = np.zeros(self._leaf_box.shape[1:])
        leaf_limit.ravel()[: len(limit)] = limit.max(axis=1, initial=0.0)
        pieces = [(np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0))]
        wanted = np.nonzero(leaf_limit.any(axis=1))[0]
        step = max(1, _PAIRS // (len(x) * _LEAVES))
        for begin in range(0, len(wanted), step):
            blocks = wanted[begin : begin + step]
            near = _nearest(self._block_box[:, blocks, None], x, y)
            block, other = np.nonzero(near < leaf_limit[blocks].max(axis=1)[:, None])
            block = blocks[block]
            near = _nearest(self._leaf_box[:, block], x[other, None], y[other, None])
            pair, leaf = np.nonzero(near < leaf_limit[block])
            leaf, other = leaf + block[pair] * _LEAVES, other[pair]
            rows = _PAIRS // self._leaf
            for at in range(0, len(leaf), rows):
                part, with_ = leaf[at : at + rows], other[at : at + rows]
                distance2 = (self._x[part] - x[with_, None]) ** 2 + (self._y[part] - y[with_, None]) ** 2
                pair, slot = np.nonzero(distance2 < limit[part])
                pieces.append((part[pair] * self._leaf + slot, with_[pair], np.sqrt(distance2[pair, slot])))
        point, other, distance = (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
        return point, other, distance


def _sorted_pairs(leaf: IntArray, other: IntArray, leaves: int) -> tuple[IntArray, IntArray]:
    """Return the pairs by leaf, in the order that they had, without the leaves that only fill up a block."""
    # numpy sorts 16 bit integers in linear time
    order = np.argsort(leaf.astype(np.uint16) if leaves < 1 << 16 else leaf, kind="stable")
    order = order[: np.searchsorted(leaf[order], leaves)]
    return leaf[order], other[order]


def _nearest(box: Array, x: Array, y: Array) -> Array:
    """Return the squared distance from points to boxes of low x, high x, low y, high y."""
    low_x, high_x, low_y, high_y = box
    dx = np.maximum(np.maximum(low_x - x, x - high_x), 0.0)
    dy = np.maximum(np.maximum(low_y - y, y - high_y), 0.0)
    return np.asarray(dx * dx + dy * dy)


def _nearest_and_farthest(box: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Return the squared distances from points to the nearest and the farthest point of boxes."""
    low_x, high_x, low_y, high_y = box
    left, right, below, above = low_x - x, x - high_x, low_y - y, y - high_y
    dx, dy = np.maximum(np.maximum(left, right), 0.0), np.maximum(np.maximum(below, above), 0.0)
    far_x, far_y = np.minimum(left, right), np.minimum(below, above)
    return dx * dx + dy * dy, far_x * far_x + far_y * far_y
