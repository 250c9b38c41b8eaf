"""The Delaunay triangulation of moving points, reused from step to step and repaired by flips.

A mesh stores the sides of each triangle, counter-clockwise. They are called half-edges, because the edge
between two triangles is stored twice, once for each triangle. The two half-edges of an edge are *twins*, and
run in opposite directions. Half-edge h starts at the point ``mesh[CORNER, h]``. Its twin is ``mesh[TWIN,
h]``, or `NO_TWIN` on the outline of the mesh. The half-edges of triangle k have the indices 4 k, 4 k + 1 and
4 k + 2. Entry 4 k + 3 is unused, so that the lowest two bits of h are the position of a half-edge within its
triangle.

Three distant points, the *sentinels*, form a triangle around the n points, and follow them in arrays of
points. There are therefore 2 n + 1 triangles, and 8 n + 4 entries.

An edge is Delaunay if the sum of the two angles opposite to it is at most half a turn, that is, if the sum of
their cotangents is at least 0. Otherwise the edge is *flipped*: it is replaced by the other diagonal of the
quadrilateral that its two triangles form. The Voronoi vertices on the bisector of an edge also follow from
the cotangents.
"""

from typing import TypeAlias

from robocov.compiled import inlined_kernel, kernel
from robocov.typing import FloatArray, Int32Array, IntArray

Mesh: TypeAlias = Int32Array
"""Corners and twins of the half-edges of a triangulation of n points, (2, 8 n + 4)."""

CORNER = 0
"""Row of a mesh: the point at which each half-edge starts."""
TWIN = 1
"""Row of a mesh: the twin of each half-edge, or `NO_TWIN`."""
NO_TWIN = -1
"""Used in place of a twin on the outline of a mesh."""
NOT_TRIANGULATED = -1
"""First corner of a mesh that does not contain a triangulation."""
ENTRIES_PER_TRIANGLE = 4
"""Number of entries of a mesh per triangle: three half-edges and an unused entry."""

_POSITION_MASK = 0b11
"""Bit mask for the position of a half-edge within its triangle."""
_FAILED = -1
"""Returned instead of a triangle or of a number of flips if rounding makes the triangulation fail."""
_NO_HALF_EDGE = -1
"""Used in place of a half-edge if there is none."""

_TOLERANCE = 1e-14
"""An edge is not flipped if the sum of its two cotangents is negative by at most this fraction of the sum of
their magnitudes, because the sign may then be due to rounding."""
_MAX_FLIPS_PER_POINT = 16
"""Maximum number of flips divided by the number of points. With more flips, the triangulation fails: they may
be endless because of rounding."""
_MIN_CROSS = 1e-300
"""Minimum divisor, m²; prevents division by zero."""


@kernel
def update_triangulation(mesh: Mesh, points: FloatArray, cotangents: FloatArray, stack: IntArray) -> bool:
    """Compute the Delaunay triangulation of points: repair a previous one, or else build it from scratch.

    Parameters
    ----------
    mesh : (2, 8 n + 4) int32 array
        On entry, a triangulation of these points at other positions, or a mesh in which ``mesh[CORNER, 0]``
        is `NOT_TRIANGULATED`. Changed in place.
    points : (n + 3, 2) array, m
        Positions of the points. The last three are sentinels, whose triangle contains all others.
    cotangents : (8 n + 4,) array
        Output: the cotangent of the angle opposite to each half-edge.
    stack : (8 n + 4,) int array
        Scratch space.

    Returns
    -------
    bool
        False if rounding made the triangulation fail.
    """
    if mesh[CORNER, 0] != NOT_TRIANGULATED and _repair(mesh, points, cotangents, stack):
        return True
    return _build(mesh, points, cotangents, stack)


@inlined_kernel
def is_half_edge(h: int) -> bool:
    """Return whether an entry of a mesh is a half-edge: every fourth entry is unused.

    Parameters
    ----------
    h : int
        Index of the entry.

    Returns
    -------
    bool
    """
    return (h & _POSITION_MASK) < 3


@inlined_kernel
def get_next_half_edge(h: int) -> int:
    """Return the half-edge that follows another one in its triangle.

    Parameters
    ----------
    h : int
        The other half-edge.

    Returns
    -------
    int
    """
    return h + 1 if (h & _POSITION_MASK) < 2 else h - 2


@inlined_kernel
def get_first_half_edge(h: int) -> int:
    """Return the first half-edge of the triangle of a half-edge.

    Parameters
    ----------
    h : int
        The half-edge.

    Returns
    -------
    int
    """
    return h & ~_POSITION_MASK


@inlined_kernel
def get_previous_half_edge(h: int) -> int:
    """Return the half-edge that precedes another one in its triangle.

    Parameters
    ----------
    h : int
        The other half-edge.

    Returns
    -------
    int
    """
    return h - 1 if (h & _POSITION_MASK) > 0 else h + 2


@kernel
def _repair(mesh: Mesh, points: FloatArray, cotangents: FloatArray, stack: IntArray) -> bool:
    """Flip all edges that are no longer Delaunay after the points have moved.

    Return whether the result is a triangulation, in which all triangles are counter-clockwise.
    """
    flip_count = 0
    is_ccw = _compute_all_cotangents(mesh, points, cotangents)
    for h in range(mesh.shape[1]):
        # Of the two half-edges of an edge, only the first one is tested.
        if is_half_edge(h) and h < mesh[TWIN, h] and _must_flip(mesh, cotangents, h):
            flip_count, are_new_ccw = _flip_from(mesh, points, cotangents, stack, h, flip_count)
            is_ccw &= are_new_ccw
            if flip_count == _FAILED:
                return False
    # Triangles that were clockwise may have been corrected or removed by later flips, so test all again.
    return is_ccw or _compute_all_cotangents(mesh, points, cotangents)


@kernel
def _build(mesh: Mesh, points: FloatArray, cotangents: FloatArray, stack: IntArray) -> bool:
    """Triangulate from scratch by inserting one point after another; return whether it succeeded.

    Each point splits the triangle that contains it into three. Edges that are then no longer Delaunay are
    flipped. The last three points are the sentinels, the corners of a triangle around all other points.
    Triangles are represented by their first half-edges, and `stack` is scratch space.
    """
    n = len(points) - 3
    # Start with a single triangle, that of the sentinels.
    for k in range(3):
        mesh[CORNER, k] = n + k
        mesh[TWIN, k] = NO_TWIN
    flip_count = 0
    triangle = 0
    for i in range(n):
        # Each previous point has added two triangles. The search starts at the triangle in which the
        # previous point was.
        triangle_count = 2 * i + 1
        triangle = _find_triangle(mesh, points, points[i, 0], points[i, 1], triangle, triangle_count)
        if triangle == _FAILED:
            return False
        second = ENTRIES_PER_TRIANGLE * triangle_count
        third = second + ENTRIES_PER_TRIANGLE
        _split_triangle(mesh, triangle, second, third, i)
        for first_half_edge in (triangle, second, third):
            _compute_cotangents(mesh, points, cotangents, first_half_edge)
        for first_half_edge in (triangle, second, third):
            flip_count, _ = _flip_from(mesh, points, cotangents, stack, first_half_edge, flip_count)
            if flip_count == _FAILED:
                return False
    return _compute_all_cotangents(mesh, points, cotangents)


@kernel
def _split_triangle(mesh: Mesh, first: int, second: int, third: int, i: int) -> None:
    """Split the triangle a b c at a point i inside it into the triangles a b i, b c i and c a i.

    `first` is the first half-edge of a b c and of a b i, which replaces it. `second` and `third` are the
    first half-edges of the two new triangles, b c i and c a i.
    """
    a = mesh[CORNER, first]
    b = mesh[CORNER, first + 1]
    c = mesh[CORNER, first + 2]
    _write_triangle(mesh, second, b, c, i)
    _write_triangle(mesh, third, c, a, i)
    # The three sides of a b c keep their twins. Then the half-edges of each of the three new edges, which end
    # at i, are linked.
    _link(mesh, second, mesh[TWIN, first + 1])
    _link(mesh, third, mesh[TWIN, first + 2])
    mesh[CORNER, first + 2] = i
    _link(mesh, first + 1, second + 2)
    _link(mesh, second + 1, third + 2)
    _link(mesh, third + 1, first + 2)


@inlined_kernel
def _write_triangle(mesh: Mesh, first: int, a: int, b: int, c: int) -> None:
    """Write the corners of a triangle."""
    mesh[CORNER, first] = a
    mesh[CORNER, first + 1] = b
    mesh[CORNER, first + 2] = c


@inlined_kernel
def _link(mesh: Mesh, h: int, twin: int) -> None:
    """Make two half-edges each other's twins; `twin` may be `NO_TWIN`."""
    mesh[TWIN, h] = twin
    if twin != NO_TWIN:
        mesh[TWIN, twin] = h


@inlined_kernel
def _compute_all_cotangents(mesh: Mesh, points: FloatArray, cotangents: FloatArray) -> bool:
    """Compute the cotangents in all triangles; return whether all triangles are counter-clockwise."""
    is_ccw = True
    for first_half_edge in range(0, mesh.shape[1], ENTRIES_PER_TRIANGLE):
        is_ccw &= _compute_cotangents(mesh, points, cotangents, first_half_edge)
    return is_ccw


@inlined_kernel
def _compute_cotangents(mesh: Mesh, points: FloatArray, cotangents: FloatArray, first_half_edge: int) -> bool:
    """Compute the cotangents in the triangle of a first half-edge; return whether it is counter-clockwise.

    The cotangent of a half-edge is that of the angle opposite to it, at the apex of the triangle. It is
    computed from vectors that start at the apex, so that its last bit does not depend on which half-edge is
    the first. In a clockwise triangle, the sign of the cross product is ignored, so that flips can correct
    the triangle.
    """
    is_ccw = True
    for k in range(3):
        i = mesh[CORNER, first_half_edge + k]
        j = mesh[CORNER, first_half_edge + (k + 1) % 3]
        apex = mesh[CORNER, first_half_edge + (k + 2) % 3]
        ax = points[i, 0] - points[apex, 0]
        ay = points[i, 1] - points[apex, 1]
        bx = points[j, 0] - points[apex, 0]
        by = points[j, 1] - points[apex, 1]
        cross = ax * by - ay * bx
        cotangents[first_half_edge + k] = (ax * bx + ay * by) / max(abs(cross), _MIN_CROSS)
        is_ccw &= cross > 0.0
    return is_ccw


@inlined_kernel
def _must_flip(mesh: Mesh, cotangents: FloatArray, h: int) -> bool:
    """Return whether the edge of a half-edge with a twin is not Delaunay, or has undefined angles."""
    cotangent = cotangents[h]
    twin_cotangent = cotangents[mesh[TWIN, h]]
    # Because of the `not`, this is also true if a cotangent is nan.
    return not cotangent + twin_cotangent >= -_TOLERANCE * (abs(cotangent) + abs(twin_cotangent))


@kernel
def _find_triangle(
    mesh: Mesh, points: FloatArray, x: float, y: float, start: int, triangle_count: int
) -> int:
    """Walk from a triangle to the one that contains (x, y); return its first half-edge, or `_FAILED`.

    Each step crosses an edge that separates the triangle from the point.
    """
    triangle = start
    # Because of rounding, the walk could otherwise be endless.
    max_steps = 3 * triangle_count + 3
    for _ in range(max_steps):
        h = _find_edge_to_cross(mesh, points, triangle, x, y)
        contains_point = h == _NO_HALF_EDGE
        if contains_point:
            return triangle
        twin = mesh[TWIN, h]
        if twin == NO_TWIN:
            return _FAILED
        triangle = get_first_half_edge(twin)
    return _FAILED


@inlined_kernel
def _find_edge_to_cross(mesh: Mesh, points: FloatArray, triangle: int, x: float, y: float) -> int:
    """Return a half-edge of a triangle with (x, y) on its right; `_NO_HALF_EDGE` if (x, y) is inside."""
    for h in range(triangle, triangle + 3):
        start = mesh[CORNER, h]
        end = mesh[CORNER, get_next_half_edge(h)]
        start_x = points[start, 0]
        start_y = points[start, 1]
        edge_x = points[end, 0] - start_x
        edge_y = points[end, 1] - start_y
        if edge_x * (y - start_y) - edge_y * (x - start_x) < 0.0:
            return h
    return _NO_HALF_EDGE


@inlined_kernel
def _flip_from(
    mesh: Mesh,
    points: FloatArray,
    cotangents: FloatArray,
    stack: IntArray,
    first_half_edge: int,
    flip_count: int,
) -> tuple[int, bool]:
    r"""Flip the edge of a half-edge if it is not Delaunay, then the edges around it, until all of them are.

    A flip replaces the edge between two triangles by the other diagonal of the quadrilateral that they form::

             c                    c
           / | \                /   \
          a  |  b      ->      a-----b
           \ | /                \   /
             d                    d

    Afterwards, the four sides of the quadrilateral may have to be flipped. The stack contains the edges that
    still have to be tested. Return the number of flips so far, or `_FAILED`, and whether all new triangles
    are counter-clockwise.
    """
    stack[0] = first_half_edge
    stack_size = 1
    is_ccw = True
    while stack_size > 0:
        stack_size -= 1
        half_edge = stack[stack_size]
        twin = mesh[TWIN, half_edge]
        if twin == NO_TWIN or not _must_flip(mesh, cotangents, half_edge):
            continue
        # The new edge connects the two corners opposite to the old edge. The half-edges that precede those of
        # the old edge in their triangles, `before_half_edge` and `before_twin`, become its half-edges. The
        # half-edges of the old edge take their place as sides of the quadrilateral: `half_edge` that of
        # `before_twin`, and `twin` that of `before_half_edge`.
        before_half_edge = get_previous_half_edge(half_edge)
        before_twin = get_previous_half_edge(twin)
        mesh[CORNER, half_edge] = mesh[CORNER, before_twin]
        mesh[CORNER, twin] = mesh[CORNER, before_half_edge]
        _link(mesh, half_edge, mesh[TWIN, before_twin])
        _link(mesh, twin, mesh[TWIN, before_half_edge])
        _link(mesh, before_half_edge, before_twin)
        is_ccw &= _compute_cotangents(mesh, points, cotangents, get_first_half_edge(half_edge))
        is_ccw &= _compute_cotangents(mesh, points, cotangents, get_first_half_edge(twin))
        flip_count += 1
        if flip_count > _MAX_FLIPS_PER_POINT * len(points) or stack_size + 4 > len(stack):
            return _FAILED, False
        # The four sides of the quadrilateral may no longer be Delaunay.
        stack[stack_size] = half_edge
        stack[stack_size + 1] = get_next_half_edge(half_edge)
        stack[stack_size + 2] = twin
        stack[stack_size + 3] = get_next_half_edge(twin)
        stack_size += 4
    return flip_count, is_ccw
