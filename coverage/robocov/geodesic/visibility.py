"""Who sees whom among walls: for each source, the walls that face it in angular bins.

A wall a → b (free space on its left) hides a target q from a source p iff p is not behind it, q is behind
it, and the segment meets it, ends included. Touching a vertex of an obstacle from outside may therefore hide;
a path by way of that vertex is as short. The walls that end in p are left out: there, the sectors decide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import inlined_kernel, inner_kernel, kernel
from robocov.geodesic.corners import Sectors, Walls, sectors_hold, vertex_at
from robocov.geodesic.orientation import cross

_PAD = 1e-9
"""Added to the angles that a wall spans, and taken off its distance: far more than rounding, at no cost."""

LEAF = 4
"""Items of a leaf of a `Boxes`."""

_CHAIN = 16
"""Walls in a row that are looked at together."""


class Boxes(NamedTuple):
    """A binary tree of boxes around items in their order: node k holds nodes 2k and 2k + 1, the root is 1.

    A leaf, of which there are as many as other nodes, holds the next `LEAF` items.
    """

    low_x: Array
    low_y: Array
    high_x: Array
    high_y: Array


class WallTree(NamedTuple):
    """The walls that can block a view, a → b with free space on the left, (e,) each, neighbours together."""

    ax: Array
    ay: Array
    bx: Array
    by: Array
    after: IntArray
    """The wall that begins at b, -1 where none or several do."""
    boxes: Boxes
    sectors: Sectors


class Fans(NamedTuple):
    """The walls that face each of n sources, in angular bins."""

    x: Array
    y: Array
    vertex: IntArray
    """The vertex that the source coincides with, -1 for none."""
    reach2: Array
    """Walls are held up to here, by the square of the distance."""
    clear: Array
    """(n, bins) Squared distance up to which nothing is hidden, and"""
    horizon: Array
    """that from which on all is hidden."""
    head: IntArray
    """(n, bins) The last entry of each bin, -1 for none."""
    entry: IntArray
    """(entries, 2) A wall, and the entry of the same bin before."""


def boxes_around(low_x: Array, low_y: Array, high_x: Array, high_y: Array) -> Boxes:
    """Return the tree of boxes around items, given by (m,) boxes of their own."""
    leaves = 1
    while leaves * LEAF < len(low_x):
        leaves *= 2
    sides = []
    for items, empty, fold in (
        (low_x, np.inf, np.minimum),
        (low_y, np.inf, np.minimum),
        (high_x, -np.inf, np.maximum),
        (high_y, -np.inf, np.maximum),
    ):
        level = np.full(leaves * LEAF, empty)
        level[: len(items)] = items
        levels = [fold.reduce(level.reshape(-1, LEAF), axis=1)]
        while len(levels[-1]) > 1:
            levels.append(fold.reduce(levels[-1].reshape(-1, 2), axis=1))
        sides.append(np.concatenate([np.full(1, empty), *levels[::-1]]))
    return Boxes(*sides)


def along_z_curve(column: IntArray, row: IntArray) -> IntArray:
    """Return numbers along a Z-curve, which keeps neighbours together, of whole numbers below 65536."""
    key = np.zeros(len(column), dtype=np.int64)
    for bit in range(16):
        key |= ((column >> bit) & 1) << (2 * bit) | ((row >> bit) & 1) << (2 * bit + 1)
    return key


def wall_tree(walls: Walls, side: float) -> WallTree:
    """Return the walls of a map on a square grid of so many steps."""
    x, y = walls.sectors.x, walls.sectors.y
    middle = (x[walls.start] + x[walls.end]) / 2.0, (y[walls.start] + y[walls.end]) / 2.0
    key = along_z_curve(*((part * (65535.0 / side)).astype(np.int64) for part in middle))
    order = np.argsort(key, kind="stable")
    start, end = walls.start[order], walls.end[order]
    ax, ay, bx, by = x[start], y[start], x[end], y[end]
    beginning = np.full(len(x), -1, dtype=np.intp)
    beginning[start] = np.arange(len(start))
    after = np.where(np.bincount(start, minlength=len(x))[end] == 1, beginning[end], -1)
    boxes = boxes_around(np.minimum(ax, bx), np.minimum(ay, by), np.maximum(ax, bx), np.maximum(ay, by))
    return WallTree(ax, ay, bx, by, after, boxes, walls.sectors)


@inlined_kernel
def pseudo_angle(dx: float, dy: float) -> float:
    """Return a number in [0, 4] that grows with the direction's angle, without trigonometry.

    >>> [pseudo_angle(dx, dy) for dx, dy in ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))]
    [0.0, 1.0, 2.0, 3.0]
    """
    part = dy / max(abs(dx) + abs(dy), 1e-300)
    return 1.0 + part if dx >= 0.0 else 3.0 - part


@inner_kernel
def skipped(node: int) -> int:
    """Return the node that follows all that is below a node of a tree, 0 at the end."""
    while node & 1:
        node >>= 1
    return node + 1 if node else 0


@inlined_kernel
def near2(boxes: Boxes, node: int, x: float, y: float) -> float:
    """Return the squared distance of a point to a box."""
    dx: float = max(boxes.low_x[node] - x, x - boxes.high_x[node], 0.0)
    dy: float = max(boxes.low_y[node] - y, y - boxes.high_y[node], 0.0)
    return dx * dx + dy * dy


@inner_kernel
def beyond_horizon(boxes: Boxes, node: int, x: float, y: float, horizon: Array) -> bool:
    """Return whether all of a box is hidden from (x, y): beyond the horizon in every bin where it lies."""
    least = near2(boxes, node, x, y) * (1.0 - _PAD)
    if least == 0.0:
        return False
    bins = len(horizon)
    half_x = 0.5 * (boxes.high_x[node] - boxes.low_x[node])
    half_y = 0.5 * (boxes.high_y[node] - boxes.low_y[node])
    dx, dy = boxes.low_x[node] + half_x - x, boxes.low_y[node] + half_y - y
    # a pseudo-angle grows by at most the angle, of which a half turn is at most pi/2 by its sine
    wide = np.sqrt((half_x * half_x + half_y * half_y) / (dx * dx + dy * dy)) * (0.5 * np.pi) + _PAD
    angle = pseudo_angle(dx, dy)
    first, last = int(np.floor((angle - wide) * (bins * 0.25))), int(np.floor((angle + wide) * (bins * 0.25)))
    for k in range(first, min(last, first + bins - 1) + 1):  # noqa: SIM110, kernels are plain loops
        if horizon[k % bins] >= least:
            return False
    return True


@kernel
def fans_of(tree: WallTree, x: Array, y: Array, reach: Array, bins: int) -> Fans:
    """Return the fans of (n,) sources, not inside an obstacle, with the walls nearer than `reach`."""
    n = len(x)
    clear, horizon = np.full((n, bins), np.inf), np.full((n, bins), np.inf)
    head = np.full((n, bins), -1)
    entry, used = np.empty((64 * n + 4 * bins, 2), dtype=np.int64), 0
    vertex, stack = np.empty(n, dtype=np.int64), np.empty(64, dtype=np.int64)
    for i in range(n):
        vertex[i] = vertex_at(tree.sectors, x[i], y[i])
        fan = clear[i], horizon[i], head[i]
        filled = _fill(tree, x[i], y[i], reach[i] * reach[i], *fan, entry, used, stack)
        while filled < 0:
            # no room for more entries: once more with twice as much
            entry = np.concatenate((entry, entry))
            clear[i], horizon[i], head[i] = np.inf, np.inf, -1
            filled = _fill(tree, x[i], y[i], reach[i] * reach[i], *fan, entry, used, stack)
        used = filled
    return Fans(x, y, vertex, reach * reach, clear, horizon, head, entry)


@inner_kernel
def _fill(
    tree: WallTree, px: float, py: float, reach2: float, clear: Array, horizon: Array, head: IntArray,
    entry: IntArray, used: int, stack: IntArray,
) -> int:  # fmt: skip
    """Enter the walls around a source; return how many entries are used then, -1 if there is no room."""
    boxes, leaves, bins = tree.boxes, len(tree.boxes.low_x) // 2, len(clear)
    stack[0], height = 1, 1
    while height:
        height -= 1
        node = stack[height]
        if near2(boxes, node, px, py) >= reach2 or beyond_horizon(boxes, node, px, py, horizon):
            continue
        if node < leaves:
            # the nearer half first: what it hides need not be looked at
            near = 2 * node + int(near2(boxes, 2 * node + 1, px, py) < near2(boxes, 2 * node, px, py))
            stack[height], stack[height + 1] = near ^ 1, near
            height += 2
            continue
        begin = (node - leaves) * LEAF
        for wall in range(begin, min(begin + LEAF, len(tree.ax))):
            if used + bins > len(entry):
                return -1
            used = _enter(tree, wall, px, py, reach2, clear, horizon, head, entry, used)
    return used


@inner_kernel
def _enter(
    tree: WallTree, wall: int, px: float, py: float, reach2: float, clear: Array, horizon: Array,
    head: IntArray, entry: IntArray, used: int,
) -> int:  # fmt: skip
    """Enter a wall into the bins that it spans, if it faces the source."""
    ax, ay, bx, by = tree.ax[wall] - px, tree.ay[wall] - py, tree.bx[wall] - px, tree.by[wall] - py
    ux, uy = bx - ax, by - ay
    side = cross(ax, ay, ux, uy)
    # in line with the wall: it hides nothing unless the source is on it, ends apart
    if side < 0.0 or (side == 0.0 and ax * bx + ay * by >= 0.0):
        return used
    along = min(max(-(ax * ux + ay * uy) / (ux * ux + uy * uy), 0.0), 1.0)
    nx, ny = ax + along * ux, ay + along * uy
    near = (nx * nx + ny * ny) * (1.0 - _PAD)
    if near >= reach2:
        return used
    # seen from its front, a wall runs counter-clockwise from a to b, by at most a half turn
    bins = len(clear)
    scale = bins * 0.25
    start, stop = pseudo_angle(ax, ay), pseudo_angle(bx, by)
    if stop < start:
        stop += 4.0
    low, high = int(np.floor((start - _PAD) * scale)), int(np.floor((stop + _PAD) * scale))
    inner_low, inner_high = int(np.ceil((start + _PAD) * scale)), int(np.floor((stop - _PAD) * scale))
    far = max(ax * ax + ay * ay, bx * bx + by * by) * (1.0 + _PAD)
    for place in range(low, min(high, low + bins - 1) + 1):
        k = place % bins
        if near > horizon[k]:
            continue
        clear[k] = min(clear[k], near)
        entry[used, 0], entry[used, 1] = wall, head[k]
        head[k] = used
        used += 1
        # what is farther than all of a wall across the whole bin is hidden by that one
        if inner_low <= place < inner_high:
            horizon[k] = min(horizon[k], far)
    if inner_low <= inner_high < low + bins and far < horizon[inner_high % bins]:
        k = inner_high % bins
        horizon[k] = min(horizon[k], _chained(tree, wall, px, py, stop, (inner_high + 1) / scale, far))
    return used


@inner_kernel
def _chained(
    tree: WallTree, wall: int, px: float, py: float, angle: float, wanted: float, far: float
) -> float:
    """Return the farthest of a chain of walls that faces the source up to an angle, inf for none."""
    for _ in range(_CHAIN):
        ax, ay = tree.bx[wall] - px, tree.by[wall] - py
        wall = tree.after[wall]
        if wall < 0:
            return np.inf
        bx, by = tree.bx[wall] - px, tree.by[wall] - py
        if cross(ax, ay, bx - ax, by - ay) <= 0.0:
            return np.inf
        stop = pseudo_angle(bx, by)
        while stop < angle - _PAD:
            stop += 4.0
        angle, far = stop, max(far, (bx * bx + by * by) * (1.0 + _PAD))
        if angle - _PAD >= wanted:
            return far
    return np.inf


@inlined_kernel
def sees(tree: WallTree, fans: Fans, i: int, x: float, y: float) -> bool:
    """Return whether source i sees a target, at any distance; from a vertex into its free space only."""
    dx, dy = x - fans.x[i], y - fans.y[i]
    away2 = dx * dx + dy * dy
    bins = fans.clear.shape[1]
    k = min(int(pseudo_angle(dx, dy) * (bins * 0.25)), bins - 1)
    if fans.vertex[i] < 0 and away2 <= fans.reach2[i]:
        # this decides most
        if away2 <= fans.clear[i, k]:
            return True
        if away2 > fans.horizon[i, k]:
            return False
    return _sees_past(tree, fans, i, k, dx, dy)


@inner_kernel
def _sees_past(tree: WallTree, fans: Fans, i: int, k: int, dx: float, dy: float) -> bool:
    """Return whether source i sees what is at (dx, dy) from it, in bin k, by looking at each wall."""
    if fans.vertex[i] >= 0 and not sectors_hold(tree.sectors, fans.vertex[i], dx, dy):
        return False
    if dx * dx + dy * dy > fans.reach2[i]:
        return _unhidden(tree, fans.x[i], fans.y[i], dx, dy)
    at = fans.head[i, k]
    while at >= 0:
        if _hides(tree, fans.entry[at, 0], fans.x[i], fans.y[i], dx, dy):
            return False
        at = fans.entry[at, 1]
    return True


@inlined_kernel
def _hides(tree: WallTree, wall: int, px: float, py: float, dx: float, dy: float) -> bool:
    """Return whether a wall that faces p hides what is at (dx, dy) from there."""
    ax, ay, bx, by = tree.ax[wall] - px, tree.ay[wall] - py, tree.bx[wall] - px, tree.by[wall] - py
    return (
        cross(bx - ax, by - ay, dx - ax, dy - ay) < 0.0
        and cross(ax, ay, dx, dy) >= 0.0
        and cross(dx, dy, bx, by) >= 0.0
    )


@inner_kernel
def _unhidden(tree: WallTree, px: float, py: float, dx: float, dy: float) -> bool:
    """Return whether no wall hides what is at (dx, dy) from p, by looking along the segment."""
    boxes, leaves = tree.boxes, len(tree.boxes.low_x) // 2
    low_x, high_x, low_y, high_y = px + min(dx, 0.0), px + max(dx, 0.0), py + min(dy, 0.0), py + max(dy, 0.0)
    node = 1
    while node:
        if (
            boxes.low_x[node] > high_x or boxes.high_x[node] < low_x
            or boxes.low_y[node] > high_y or boxes.high_y[node] < low_y
        ):  # fmt: skip
            node = skipped(node)
            continue
        half_x = 0.5 * (boxes.high_x[node] - boxes.low_x[node])
        half_y = 0.5 * (boxes.high_y[node] - boxes.low_y[node])
        side = dx * (boxes.low_y[node] + half_y - py) - dy * (boxes.low_x[node] + half_x - px)
        if abs(side) * (1.0 - _PAD) > (abs(dx) * half_y + abs(dy) * half_x) * (1.0 + _PAD) + 2.0**55:
            node = skipped(node)
            continue
        if node < leaves:
            node *= 2
            continue
        begin = (node - leaves) * LEAF
        for wall in range(begin, min(begin + LEAF, len(tree.ax))):
            ax, ay = tree.ax[wall] - px, tree.ay[wall] - py
            bx, by = tree.bx[wall] - px, tree.by[wall] - py
            side = cross(ax, ay, bx - ax, by - ay)
            faces = side > 0.0 or (side == 0.0 and ax * bx + ay * by < 0.0)
            if faces and _hides(tree, wall, px, py, dx, dy):
                return False
        node = skipped(node)
    return True
