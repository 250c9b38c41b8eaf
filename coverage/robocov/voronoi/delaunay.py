"""The Delaunay triangulation of moving points, reused from step to step and repaired by flips.

A mesh stores three half-edges for each triangle, counter-clockwise. Half-edge h begins at the point
``mesh[CORNER, h]``, and ``mesh[TWIN, h]`` is the half-edge of the neighboring triangle along the same
edge, or -1. One entry after each triangle is unused, so that ``h & 3`` is the position of h within its
triangle and ``h & -4`` the first half-edge of that triangle. Three distant sentinels enclose all points; they
are the last three.

An edge is Delaunay if the two angles opposite to it add up to at most half a turn, that is, if their
cotangents add up to at least 0. The cotangents also give the positions of the Voronoi vertices on the edge's
bisector.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray
from robocov.compiled import inlined_kernel, kernel

Mesh: TypeAlias = NDArray[np.int32]
"""Corners and twins of the half-edges of a triangulation of n points, (2, 8 n + 4)."""

CORNER = 0
"""Row of a mesh: the point at which each half-edge begins."""
TWIN = 1
"""Row of a mesh: the half-edge of the neighboring triangle along the same edge; -1 where there is none."""

_TOLERANCE = 1e-14
"""Sum of two cotangents, relative to their size, that counts as rounding; such an edge is not flipped."""
_MAX_FLIPS_PER_POINT = 16
"""Number of flips, on average, after which triangulating has failed: rounding may cause endless flips."""
_MIN_CROSS = 1e-300
"""Smallest cross product by which a cotangent is divided."""


@kernel
def update_triangulation(mesh: Mesh, points: Array, cotangents: Array, stack: IntArray) -> bool:
    """Make a mesh Delaunay: repair it if it is still a triangulation, and otherwise build it from scratch.

    Parameters
    ----------
    mesh : (2, 8 n + 4) int32 array
        Changed in place. ``mesh[CORNER, 0]`` is -1 if there is no triangulation yet.
    points : (n + 3, 2) array, m
        The last three are sentinels, whose triangle contains all others.
    cotangents : (8 n + 4,) array
        Overwritten by the cotangents of the angles opposite to each half-edge.
    stack : (8 n + 4,) int array
        Working memory.

    Returns
    -------
    bool
        Whether it succeeded.
    """
    if mesh[CORNER, 0] >= 0 and _repair(mesh, points, cotangents, stack):
        return True
    return _build(mesh, points, cotangents, stack)


@inlined_kernel
def get_next(h: int) -> int:
    """Return the half-edge that follows another one in its triangle.

    Parameters
    ----------
    h : int

    Returns
    -------
    int
    """
    return h + 1 if h & 3 < 2 else h - 2


@inlined_kernel
def get_first(h: int) -> int:
    """Return the first half-edge of the triangle of a half-edge.

    Parameters
    ----------
    h : int

    Returns
    -------
    int
    """
    return h & -4


@inlined_kernel
def get_previous(h: int) -> int:
    """Return the half-edge that precedes another one in its triangle.

    Parameters
    ----------
    h : int

    Returns
    -------
    int
    """
    return h - 1 if h & 3 else h + 2


@kernel
def _repair(mesh: Mesh, points: Array, cotangents: Array, stack: IntArray) -> bool:
    """Flip all edges that are no longer Delaunay; return whether the result is a triangulation."""
    flips = 0
    is_ccw = _compute_all_cotangents(mesh, points, cotangents)
    for h in range(mesh.shape[1]):
        if h & 3 < 3 and h < mesh[TWIN, h] and _must_flip(mesh, cotangents, h):
            flips, are_new_ccw = _flip_from(mesh, points, cotangents, stack, h, flips)
            is_ccw &= are_new_ccw
            if flips < 0:
                return False
    # Flips may have removed triangles that were clockwise before.
    return is_ccw or _compute_all_cotangents(mesh, points, cotangents)


@kernel
def _build(mesh: Mesh, points: Array, cotangents: Array, stack: IntArray) -> bool:
    """Triangulate from scratch by inserting the points one after the other."""
    n = len(points) - 3
    for k in range(3):
        mesh[CORNER, k] = n + k
        mesh[TWIN, k] = -1
    flips = 0
    triangle = 0
    for i in range(n):
        triangle = _find_triangle(mesh, points, points[i, 0], points[i, 1], triangle, 2 * i + 1)
        if triangle < 0:
            return False
        new = 8 * i + 4
        _split_triangle(mesh, triangle, new, i)
        for h in (triangle, new, new + 4):
            _compute_cotangents(mesh, points, cotangents, h)
        for h in (triangle, new, new + 4):
            flips, _ = _flip_from(mesh, points, cotangents, stack, h, flips)
        if flips < 0:
            return False
    return _compute_all_cotangents(mesh, points, cotangents)


@kernel
def _split_triangle(mesh: Mesh, triangle: int, new: int, i: int) -> None:
    """Split a triangle a b c by a point i: a b i takes its place, and b c i and c a i begin at `new`."""
    for k in range(2):
        edge = triangle + 1 + k
        h = new + 4 * k
        mesh[CORNER, h] = mesh[CORNER, edge]
        mesh[CORNER, h + 1] = mesh[CORNER, triangle + (2 + k) % 3]
        mesh[CORNER, h + 2] = i
        _link(mesh, h, mesh[TWIN, edge])
    mesh[CORNER, triangle + 2] = i
    _link(mesh, triangle + 1, new + 2)
    _link(mesh, new + 1, new + 6)
    _link(mesh, new + 5, triangle + 2)


@inlined_kernel
def _link(mesh: Mesh, h: int, twin: int) -> None:
    """Make two half-edges each other's twins; a twin of -1 is none."""
    mesh[TWIN, h] = twin
    if twin >= 0:
        mesh[TWIN, twin] = h


@inlined_kernel
def _compute_all_cotangents(mesh: Mesh, points: Array, cotangents: Array) -> bool:
    """Compute the cotangents in all triangles; return whether all triangles are counter-clockwise."""
    is_ccw = True
    for h in range(0, mesh.shape[1], 4):
        is_ccw &= _compute_cotangents(mesh, points, cotangents, h)
    return is_ccw


@inlined_kernel
def _compute_cotangents(mesh: Mesh, points: Array, cotangents: Array, h: int) -> bool:
    """Compute the cotangents in a triangle with first half-edge h; return whether it is counter-clockwise.

    Each is computed from its own corner, so that its last bit does not depend on how the triangle is stored.
    In a clockwise triangle the sign of the cross product is ignored, so that flips can correct it.
    """
    is_ccw = True
    for k in range(3):
        i = mesh[CORNER, h + k]
        j = mesh[CORNER, h + (k + 1) % 3]
        apex = mesh[CORNER, h + (k + 2) % 3]
        ax = points[i, 0] - points[apex, 0]
        ay = points[i, 1] - points[apex, 1]
        bx = points[j, 0] - points[apex, 0]
        by = points[j, 1] - points[apex, 1]
        cross = ax * by - ay * bx
        cotangents[h + k] = (ax * bx + ay * by) / max(abs(cross), _MIN_CROSS)
        is_ccw &= cross > 0.0
    return is_ccw


@inlined_kernel
def _must_flip(mesh: Mesh, cotangents: Array, h: int) -> bool:
    """Return whether the edge of a half-edge with a twin is not Delaunay, or its angles are undefined."""
    own = cotangents[h]
    opposite = cotangents[mesh[TWIN, h]]
    return not own + opposite >= -_TOLERANCE * (abs(own) + abs(opposite))


@kernel
def _find_triangle(mesh: Mesh, points: Array, x: float, y: float, start: int, triangle_count: int) -> int:
    """Walk from a triangle to the one that contains (x, y); return its first half-edge, or -1 on failure."""
    triangle = start
    for _ in range(3 * triangle_count + 3):
        for h in range(triangle, triangle + 3):
            a = mesh[CORNER, h]
            b = mesh[CORNER, get_next(h)]
            ax = points[a, 0]
            ay = points[a, 1]
            if (points[b, 0] - ax) * (y - ay) - (points[b, 1] - ay) * (x - ax) < 0.0:
                break
        else:
            return triangle
        if mesh[TWIN, h] < 0:
            break
        triangle = get_first(mesh[TWIN, h])
    return -1


@inlined_kernel
def _flip_from(
    mesh: Mesh, points: Array, cotangents: Array, stack: IntArray, h: int, flips: int
) -> tuple[int, bool]:
    """Flip the edge of h if it is not Delaunay, then the edges around it, until all of them are.

    Return the number of flips so far, -1 on failure, and whether all new triangles are counter-clockwise.
    """
    stack[0] = h
    size = 1
    is_ccw = True
    while size and flips >= 0:
        size -= 1
        a = stack[size]
        b = mesh[TWIN, a]
        if b < 0 or not _must_flip(mesh, cotangents, a):
            continue
        before_a = get_previous(a)
        before_b = get_previous(b)
        mesh[CORNER, a] = mesh[CORNER, before_b]
        mesh[CORNER, b] = mesh[CORNER, before_a]
        _link(mesh, a, mesh[TWIN, before_b])
        _link(mesh, b, mesh[TWIN, before_a])
        _link(mesh, before_a, before_b)
        is_ccw &= _compute_cotangents(mesh, points, cotangents, get_first(a))
        is_ccw &= _compute_cotangents(mesh, points, cotangents, get_first(b))
        flips += 1
        if flips > _MAX_FLIPS_PER_POINT * len(points) or size + 4 > len(stack):
            return -1, False
        stack[size] = a
        stack[size + 1] = get_next(a)
        stack[size + 2] = b
        stack[size + 3] = get_next(b)
        size += 4
    return flips, is_ccw
