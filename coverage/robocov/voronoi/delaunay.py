"""The Delaunay triangulation, kept from step to step: inserted point by point at first, then mended by flips.

Half-edge h begins at corner ``mesh[0, h]``, and ``mesh[1, h]`` is the half-edge the other way, or -1. The
three of a triangle follow each other, counter-clockwise, and a place is left free behind them, so that
`h & 3` says which of them one is. The points are followed by three sentinels, far out and around all.

An edge is Delaunay when the angles that see it make up at most half a turn, so when their cotangents add up
to 0 or more; the cotangents also say how far out on the edge's bisector the Voronoi vertices are.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel

Mesh: TypeAlias = NDArray[np.int32]
"""Corners and twins of the half-edges, (2, 8 n + 4)."""

_ROUNDING = 1e-14
"""Of the sum of two cotangents, relative to them: below it, nothing is flipped."""

_FLIPS = 16
"""A point, on average, after which triangulating has failed: rounding may flip in circles."""


@kernel
def triangulated(mesh: Mesh, points: Array, cotangent: Array, stack: IntArray) -> bool:
    """Make `mesh`, (2, 8 n + 4), Delaunay, from what it is where that is a triangulation still; tell success.

    ``mesh[0, 0]`` is -1 where there is none yet. The last three of the points, (n + 3, 2) m, are sentinels.
    Written are the cotangents, (8 n + 4,), of the angles opposite of each half-edge; the stack is as long.
    """
    n, count, flips, home = len(points) - 3, mesh.shape[1], 0, 0
    if mesh[0, 0] >= 0:
        upright = _all_measured(mesh, points, cotangent)
        for h in range(count):
            if h & 3 < 3 and h < mesh[1, h] and _bent(mesh, cotangent, h):
                flips, fine = _legalised(mesh, points, cotangent, stack, h, flips)
                upright &= fine
        if flips >= 0 and (upright or _all_measured(mesh, points, cotangent)):
            return True
        flips = 0
    for k in range(3):
        mesh[0, k], mesh[1, k] = n + k, -1
    for i in range(n):
        home = _triangle_around(mesh, points, points[i, 0], points[i, 1], home, 2 * i + 1)
        if home < 0:
            return False
        # the triangle a b c becomes a b i, b c i and c a i
        new = 8 * i + 4
        for k in range(2):
            edge, h = home + 1 + k, new + 4 * k
            mesh[0, h], mesh[0, h + 1], mesh[0, h + 2] = mesh[0, edge], mesh[0, home + (2 + k) % 3], i
            _link(mesh, h, mesh[1, edge])
        mesh[0, home + 2] = i
        _link(mesh, home + 1, new + 2)
        _link(mesh, new + 1, new + 6)
        _link(mesh, new + 5, home + 2)
        for h in (home, new, new + 4):
            _measured(mesh, points, cotangent, h)
        for h in (home, new, new + 4):
            flips, _ = _legalised(mesh, points, cotangent, stack, h, flips)
        if flips < 0:
            return False
    return _all_measured(mesh, points, cotangent)


@kernel
def following(h: int) -> int:
    """Return the next half-edge of the same triangle."""
    return h + 1 if h & 3 < 2 else h - 2


@kernel
def before(h: int) -> int:
    """Return the half-edge of the same triangle that ends where this one begins."""
    return h - 1 if h & 3 else h + 2


@kernel
def _link(mesh: Mesh, one: int, other: int) -> None:
    mesh[1, one] = other
    if other >= 0:
        mesh[1, other] = one


@kernel
def _all_measured(mesh: Mesh, points: Array, cotangent: Array) -> bool:
    upright = True
    for h in range(0, mesh.shape[1], 4):
        upright &= _measured(mesh, points, cotangent, h)
    return upright


@kernel
def _measured(mesh: Mesh, points: Array, cotangent: Array, h: int) -> bool:
    """Compute the cotangents in the triangle of which h is the first half-edge; return whether it is upright.

    Each from its own corner: to the last bit, it does not matter how the triangle is stored. In one that is
    upside down they are as if it were still flat, so that flips put it upright.
    """
    upright = True
    for k in range(3):
        i, j, apex = mesh[0, h + k], mesh[0, h + (k + 1) % 3], mesh[0, h + (k + 2) % 3]
        ax, ay = points[i, 0] - points[apex, 0], points[i, 1] - points[apex, 1]
        bx, by = points[j, 0] - points[apex, 0], points[j, 1] - points[apex, 1]
        cross = ax * by - ay * bx
        cotangent[h + k] = (ax * bx + ay * by) / max(abs(cross), 1e-300)
        upright &= cross > 0.0
    return upright


@kernel
def _bent(mesh: Mesh, cotangent: Array, h: int) -> bool:
    one, other = cotangent[h], cotangent[mesh[1, h]]
    return not one + other >= -_ROUNDING * (abs(one) + abs(other))


@kernel
def _triangle_around(mesh: Mesh, points: Array, x: float, y: float, home: int, triangles: int) -> int:
    """Return the first half-edge of the triangle that a place lies in, by walking there; -1 when lost."""
    for _ in range(3 * triangles + 3):
        for h in range(home, home + 3):
            a, b = mesh[0, h], mesh[0, following(h)]
            ax, ay = points[a, 0], points[a, 1]
            if (points[b, 0] - ax) * (y - ay) - (points[b, 1] - ay) * (x - ax) < 0.0:
                break
        else:
            return home
        if mesh[1, h] < 0:
            break
        home = mesh[1, h] & -4
    return -1


@kernel
def _legalised(
    mesh: Mesh, points: Array, cotangent: Array, stack: IntArray, h: int, flips: int
) -> tuple[int, bool]:
    """Flip half-edge h, and what then asks for it, until all are Delaunay.

    Returns the number of flips so far, -1 on failure, and whether the triangles that they made are upright.
    """
    stack[0], size, upright = h, 1, True
    while size and flips >= 0:
        size -= 1
        a = stack[size]
        b = mesh[1, a]
        if b < 0 or not _bent(mesh, cotangent, a):
            continue
        across, back = before(a), before(b)
        mesh[0, a], mesh[0, b] = mesh[0, back], mesh[0, across]
        _link(mesh, a, mesh[1, back])
        _link(mesh, b, mesh[1, across])
        _link(mesh, across, back)
        upright &= _measured(mesh, points, cotangent, a & -4) & _measured(mesh, points, cotangent, b & -4)
        flips += 1
        if flips > _FLIPS * len(points) or size + 4 > len(stack):
            return -1, False
        stack[size], stack[size + 1] = a, following(a)
        stack[size + 2], stack[size + 3] = b, following(b)
        size += 4
    return flips, upright
