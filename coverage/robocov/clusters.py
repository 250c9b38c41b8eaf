"""Many points in small groups with bounding boxes: who is nearest to whom, and who is within a distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, IntArray

if TYPE_CHECKING:
    from collections.abc import Iterator

_FAN = 8
"""Children of a node."""

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
    """Points in a coherent order: runs of `leaf` of them are leaves, runs of 8 leaves nodes, and so on.

    Parameters
    ----------
    x, y : (m,)
    leaf : int
    """

    def __init__(self, x: Array, y: Array, leaf: int) -> None:
        self._count = len(x)
        self._leaf = leaf
        rows = -(-self._count // leaf)
        # the last point fills up the last leaf, the last child the last node
        slots = np.minimum(np.arange(rows * leaf), self._count - 1).reshape(rows, leaf)
        self._x, self._y = x[slots], y[slots]
        self._boxes: list[Array] = []
        if rows:
            x, y = self._x, self._y
            boxes = np.array([x.min(axis=1), x.max(axis=1), y.min(axis=1), y.max(axis=1)])
            while not self._boxes or boxes.shape[1] > 1:
                children = _filled(boxes)
                self._boxes.insert(0, children)
                low_x, high_x, low_y, high_y = children
                boxes = np.array(
                    [low_x.min(axis=1), high_x.max(axis=1), low_y.min(axis=1), high_y.max(axis=1)]
                )

    def nearest(self, x: Array, y: Array) -> tuple[IntArray, Array]:
        """Return each point's nearest of (n,) others, the first of equals, and its squared distance."""
        robot = np.zeros(self._x.shape, dtype=np.intp)
        best = np.full(self._x.shape, np.inf)
        for leaf, other in self._descend(x, y, None):
            distance2 = (self._x[leaf] - x[other, None]) ** 2 + (self._y[leaf] - y[other, None]) ** 2
            begin = np.nonzero(np.diff(leaf, prepend=-1))[0]
            best[leaf[begin]] = np.minimum.reduceat(distance2, begin, axis=0)
            # the first of equals is written last
            pair, slot = (part[::-1] for part in np.nonzero(distance2 == best[leaf]))
            robot[leaf[pair], slot] = other[pair]
        return robot.ravel()[: self._count], best.ravel()[: self._count]

    def within(self, x: Array, y: Array, bound: Array) -> tuple[IntArray, IntArray, Array]:
        """Return the pairs of a point and one of (n,) others that are less than `bound` (m,) apart.

        Returns
        -------
        point, other : (p,)
        distance : (p,)
        """
        limit = np.zeros(self._x.shape)
        limit.ravel()[: self._count] = bound * bound
        limits: list[Array] = []
        largest = limit.max(axis=1, initial=0.0)
        for _ in self._boxes:
            limits.insert(0, _filled(largest[None])[0])
            largest = limits[0].max(axis=1)
        pieces = [(np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0))]
        for leaf, other in self._descend(x, y, limits):
            distance2 = (self._x[leaf] - x[other, None]) ** 2 + (self._y[leaf] - y[other, None]) ** 2
            pair, slot = np.nonzero(distance2 < limit[leaf])
            point = leaf[pair] * self._leaf + slot
            pieces.append((point, other[pair], np.sqrt(distance2[pair, slot])))
        point, other, distance = (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
        return point, other, distance

    def _descend(
        self,
        x: Array,
        y: Array,
        limits: list[Array] | None,
        above: tuple[int, IntArray, IntArray] | None = None,
    ) -> Iterator[tuple[IntArray, IntArray]]:
        """Yield pairs of a leaf and an other that may be near, sorted, from the pairs of the level `above`.

        With limits (squared distances for every node of every level) near means nearer than that,
        without it means that no other is surely nearer to all of the leaf.
        """
        level, node, other = above or (0, np.zeros(len(x), dtype=np.intp), np.arange(len(x)))
        if level == len(self._boxes):
            yield from ((node[part], other[part]) for part in _runs(node, _PAIRS // self._leaf) if level)
            return
        box = self._boxes[level]
        for part in _runs(node, _PAIRS // _FAN):
            parent, them = node[part], other[part]
            near, far = _nearest_and_farthest(box[:, parent], x[them, None], y[them, None])
            if limits is None:
                fresh = np.diff(parent, prepend=-1) > 0
                least = np.minimum.reduceat(far, np.nonzero(fresh)[0], axis=0)
                pair, child = np.nonzero(near <= least[np.cumsum(fresh) - 1])
            else:
                pair, child = np.nonzero(near < limits[level][parent])
            child += parent[pair] * _FAN
            count = self._boxes[level + 1].shape[1] if level + 1 < len(self._boxes) else len(self._x)
            # without those that only fill up the last node
            real = child < count
            pair, child = pair[real], child[real]
            # numpy sorts 16 bit integers in linear time
            order = np.argsort(child.astype(np.uint16) if count <= 1 << 16 else child, kind="stable")
            yield from self._descend(x, y, limits, (level + 1, child[order], them[pair[order]]))


def _filled(values: Array) -> Array:
    """Return (k, n) values as (k, nodes, children), the last one repeated to fill up the last node."""
    fan = min(_FAN, values.shape[1])
    nodes = -(-values.shape[1] // fan)
    at = np.minimum(np.arange(nodes * fan), values.shape[1] - 1)
    return values[:, at].reshape(len(values), nodes, fan)


def _runs(node: IntArray, size: int) -> Iterator[slice]:
    """Yield slices that hold whole runs of equal nodes, of at most `size` pairs if one run allows it."""
    if len(node) <= size:
        if len(node):
            yield slice(0, len(node))
        return
    ends = np.append(np.nonzero(np.diff(node))[0] + 1, len(node))
    begin = 0
    while begin < len(node):
        fitting = np.searchsorted(ends, begin + size, side="right") - 1
        end = int(ends[max(fitting, np.searchsorted(ends, begin, side="right"))])
        yield slice(begin, end)
        begin = end


def _nearest_and_farthest(box: Array, x: Array, y: Array) -> tuple[Array, Array]:
    """Return the squared distances from points to the nearest and the farthest point of boxes."""
    low_x, high_x, low_y, high_y = box
    left, right, below, above = low_x - x, x - high_x, low_y - y, y - high_y
    dx, dy = np.maximum(np.maximum(left, right), 0.0), np.maximum(np.maximum(below, above), 0.0)
    far_x, far_y = np.minimum(left, right), np.minimum(below, above)
    return dx * dx + dy * dy, far_x * far_x + far_y * far_y
