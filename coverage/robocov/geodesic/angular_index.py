"""Visibility among walls: for each source, the walls that face it in angular bins.

A wall a → b (free space on its left) hides a target q from a source p iff p is not behind it, q is behind
it, and the segment meets it, ends included. Touching a vertex of an obstacle from outside may therefore hide;
a path by way of that vertex is as short. The walls that end in p are left out: there, the sectors decide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.geodesic.walls import (
    LEAF_SIZE,
    Walls,
    compute_squared_box_distance,
    contains_direction,
    cross,
    find_vertex,
    skip_subtree,
)

_PAD = 1e-9
"""Added to the angles that a wall spans, and taken off its distance: far more than rounding, at no cost."""

_CHAIN = 16
"""Walls in a row that are looked at together."""


class AngularWallIndex(NamedTuple):
    """The walls that face each of n sources, in angular bins, grid steps."""

    sources: Array
    """(n, 3) Where they are, and the squared distance up to which walls are held."""
    limits: Array
    """(n, bins, 2) Squared distances up to which nothing, and from which on all, is hidden."""
    head: IntArray
    """(n, bins) The last entry of each bin, -1 for none."""
    entries: IntArray
    """(m, 2) A wall, and the entry of the same bin before, -1 for none."""
    stack: IntArray
    """Nodes of the tree that are to be looked at."""

    @classmethod
    def allocate(cls, n: int, bins: int, entries: int) -> AngularWallIndex:
        """Return room for the index of so many sources, for `add_walls`; bins are a power of 2."""
        return cls(
            np.empty((n, 3)), np.empty((n, bins, 2)), np.empty((n, bins), np.int64),
            np.empty((entries, 2), np.int64), np.empty(64, np.int64),
        )  # fmt: skip


@kernel
def compute_pseudo_angle(dx: float, dy: float) -> float:
    """Return a number in [0, 4] that grows with the direction's angle, without trigonometry.

    >>> [compute_pseudo_angle(dx, dy) for dx, dy in ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))]
    [0.0, 1.0, 2.0, 3.0]
    """
    part = dy / max(abs(dx) + abs(dy), 1e-300)
    return 1.0 + part if dx >= 0.0 else 3.0 - part


@kernel
def is_box_hidden(boxes: Array, node: int, index: AngularWallIndex, i: int) -> bool:
    """Return whether all of a box is hidden from source i: beyond the horizon in every bin where it lies."""
    x, y, limits = index.sources[i, 0], index.sources[i, 1], index.limits
    least = compute_squared_box_distance(boxes, node, x, y) * (1.0 - _PAD)
    if least == 0.0:
        return False
    bins = limits.shape[1]
    half_x, half_y = 0.5 * (boxes[node, 2] - boxes[node, 0]), 0.5 * (boxes[node, 3] - boxes[node, 1])
    dx, dy = boxes[node, 0] + half_x - x, boxes[node, 1] + half_y - y
    # a pseudo-angle grows by at most the angle, of which a half turn is at most pi/2 by its sine
    wide = np.sqrt((half_x * half_x + half_y * half_y) / (dx * dx + dy * dy)) * (0.5 * np.pi) + _PAD
    angle = compute_pseudo_angle(dx, dy)
    first, last = int(np.floor((angle - wide) * (bins * 0.25))), int(np.floor((angle + wide) * (bins * 0.25)))
    for k in range(first, min(last, first + bins - 1) + 1):  # noqa: SIM110, kernels are plain loops
        if limits[i, k & (bins - 1), 1] >= least:
            return False
    return True


@kernel
def add_walls(
    walls: Walls, index: AngularWallIndex, i: int, x: float, y: float, reach2: float, used: int
) -> int:
    """Enter the walls around (x, y), not inside an obstacle, as source i.

    `used` entries are taken already; return how many are then, -1 if there is no room.
    """
    boxes, leaves, bins, limits = walls.boxes, len(walls.boxes) // 2, index.limits.shape[1], index.limits
    stack = index.stack
    index.sources[i, 0], index.sources[i, 1], index.sources[i, 2] = x, y, reach2
    for k in range(bins):
        limits[i, k, 0], limits[i, k, 1], index.head[i, k] = reach2, np.inf, -1
    stack[0], height = 1, 1
    while height:
        height -= 1
        node = stack[height]
        if compute_squared_box_distance(boxes, node, x, y) >= reach2 or is_box_hidden(boxes, node, index, i):
            continue
        if node < leaves:
            # the nearer half first: what it hides need not be looked at
            near = 2 * node + int(
                compute_squared_box_distance(boxes, 2 * node + 1, x, y)
                < compute_squared_box_distance(boxes, 2 * node, x, y)
            )
            stack[height], stack[height + 1] = near ^ 1, near
            height += 2
            continue
        begin = (node - leaves) * LEAF_SIZE
        for wall in range(begin, min(begin + LEAF_SIZE, len(walls.ends))):
            if used + bins > len(index.entries):
                return -1
            if walls.facts[wall, 2]:
                used = _enter(walls, wall, index, i, used)
    if find_vertex(walls.vertices, x, y) >= 0:
        # its sectors decide before the walls do
        for k in range(bins):
            limits[i, k, 0] = -1.0
    return used


@kernel
def _enter(walls: Walls, wall: int, index: AngularWallIndex, i: int, used: int) -> int:
    """Enter a wall into the bins that it spans, if it faces the source; return how many entries are used."""
    px, py, limits, ends = index.sources[i, 0], index.sources[i, 1], index.limits, walls.ends
    ax, ay, bx, by = ends[wall, 0] - px, ends[wall, 1] - py, ends[wall, 2] - px, ends[wall, 3] - py
    ux, uy = bx - ax, by - ay
    side = cross(ax, ay, ux, uy)
    # in line with the wall: it hides nothing unless the source is on it, ends apart
    if side < 0.0 or (side == 0.0 and ax * bx + ay * by >= 0.0):
        return used
    along = min(max(-(ax * ux + ay * uy) / (ux * ux + uy * uy), 0.0), 1.0)
    nx, ny = ax + along * ux, ay + along * uy
    near = (nx * nx + ny * ny) * (1.0 - _PAD)
    if near >= index.sources[i, 2]:
        return used
    # seen from its front, a wall runs counter-clockwise from a to b, by at most a half turn
    bins = limits.shape[1]
    scale = bins * 0.25
    start, stop = compute_pseudo_angle(ax, ay), compute_pseudo_angle(bx, by)
    if stop < start:
        stop += 4.0
    low, high = int(np.floor((start - _PAD) * scale)), int(np.floor((stop + _PAD) * scale))
    inner_low, inner_high = int(np.ceil((start + _PAD) * scale)), int(np.floor((stop - _PAD) * scale))
    far = max(ax * ax + ay * ay, bx * bx + by * by) * (1.0 + _PAD)
    for place in range(low, min(high, low + bins - 1) + 1):
        k = place & (bins - 1)
        if near > limits[i, k, 1]:
            continue
        limits[i, k, 0] = min(limits[i, k, 0], near)
        index.entries[used, 0], index.entries[used, 1] = wall, index.head[i, k]
        index.head[i, k] = used
        used += 1
        # what is farther than all of a wall across the whole bin is hidden by that one
        if inner_low <= place < inner_high:
            limits[i, k, 1] = min(limits[i, k, 1], far)
    last = inner_high & (bins - 1)
    if inner_low <= inner_high < low + bins and far < limits[i, last, 1]:
        far = _chained(walls, wall, px, py, stop, (inner_high + 1) / scale, far)
        limits[i, last, 1] = min(limits[i, last, 1], far)
    return used


@kernel
def _chained(walls: Walls, wall: int, px: float, py: float, angle: float, wanted: float, far: float) -> float:
    """Return the farthest of a chain of walls that faces the source up to an angle, inf for none."""
    ends = walls.ends
    for _ in range(_CHAIN):
        ax, ay = ends[wall, 2] - px, ends[wall, 3] - py
        wall = walls.facts[wall, 0]
        if wall < 0:
            break
        bx, by = ends[wall, 2] - px, ends[wall, 3] - py
        if cross(ax, ay, bx - ax, by - ay) <= 0.0:
            break
        stop = compute_pseudo_angle(bx, by)
        while stop < angle - _PAD:
            stop += 4.0
        angle, far = stop, max(far, (bx * bx + by * by) * (1.0 + _PAD))
        if angle - _PAD >= wanted:
            return far
    return np.inf


@kernel
def is_visible(walls: Walls, index: AngularWallIndex, i: int, x: float, y: float) -> bool:
    """Return whether source i sees a target, at any distance; from a vertex into its free space only."""
    dx, dy = x - index.sources[i, 0], y - index.sources[i, 1]
    away2 = dx * dx + dy * dy
    bins = index.limits.shape[1]
    k = min(int(compute_pseudo_angle(dx, dy) * (bins * 0.25)), bins - 1)
    # this decides most
    if away2 <= index.limits[i, k, 0]:
        return True
    if away2 > index.limits[i, k, 1]:
        return False
    return _sees_past(walls, index, i, k, dx, dy)


@kernel
def _sees_past(walls: Walls, index: AngularWallIndex, i: int, k: int, dx: float, dy: float) -> bool:
    """Return whether source i sees what is at (dx, dy) from it, in bin k, by looking at each wall."""
    px, py = index.sources[i, 0], index.sources[i, 1]
    if index.limits[i, k, 0] < 0.0 and not contains_direction(
        walls.first, walls.sectors, find_vertex(walls.vertices, px, py), dx, dy
    ):
        return False
    if dx * dx + dy * dy > index.sources[i, 2]:
        return _unhidden(walls, px, py, dx, dy)
    at = index.head[i, k]
    while at >= 0:
        if _hides(walls.ends, index.entries[at, 0], px, py, dx, dy):
            return False
        at = index.entries[at, 1]
    return True


@kernel
def _hides(ends: Array, wall: int, px: float, py: float, dx: float, dy: float) -> bool:
    """Return whether a wall that faces p hides what is at (dx, dy) from there."""
    ax, ay, bx, by = ends[wall, 0] - px, ends[wall, 1] - py, ends[wall, 2] - px, ends[wall, 3] - py
    return (
        cross(bx - ax, by - ay, dx - ax, dy - ay) < 0.0
        and cross(ax, ay, dx, dy) >= 0.0
        and cross(dx, dy, bx, by) >= 0.0
    )


@kernel
def _unhidden(walls: Walls, px: float, py: float, dx: float, dy: float) -> bool:
    """Return whether no wall hides what is at (dx, dy) from p, by looking along the segment."""
    boxes, ends, leaves = walls.boxes, walls.ends, len(walls.boxes) // 2
    low_x, high_x, low_y, high_y = px + min(dx, 0.0), px + max(dx, 0.0), py + min(dy, 0.0), py + max(dy, 0.0)
    node = 1
    while node:
        if (
            boxes[node, 0] > high_x or boxes[node, 2] < low_x
            or boxes[node, 1] > high_y or boxes[node, 3] < low_y
        ):  # fmt: skip
            node = skip_subtree(node)
            continue
        half_x, half_y = 0.5 * (boxes[node, 2] - boxes[node, 0]), 0.5 * (boxes[node, 3] - boxes[node, 1])
        side = dx * (boxes[node, 1] + half_y - py) - dy * (boxes[node, 0] + half_x - px)
        if abs(side) * (1.0 - _PAD) > (abs(dx) * half_y + abs(dy) * half_x) * (1.0 + _PAD) + 2.0**55:
            node = skip_subtree(node)
            continue
        if node < leaves:
            node *= 2
            continue
        begin = (node - leaves) * LEAF_SIZE
        for wall in range(begin, min(begin + LEAF_SIZE, len(ends))):
            ax, ay, bx, by = ends[wall, 0] - px, ends[wall, 1] - py, ends[wall, 2] - px, ends[wall, 3] - py
            side = cross(ax, ay, bx - ax, by - ay)
            faces = side > 0.0 or (side == 0.0 and ax * bx + ay * by < 0.0)
            if faces and walls.facts[wall, 2] and _hides(ends, wall, px, py, dx, dy):
                return False
        node = skip_subtree(node)
    return True
