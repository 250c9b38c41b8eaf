"""The boundaries of cells by travel time: which parts of lines and circles of Apollonius all others leave.

About its generator, every boundary that a cell may have is a curve a |q|² + b q = c, and the cell lies
where a |q|² + b q <= c: a line (a = 0), a circle around the cell (a > 0), or one around what is not the
cell's (a < 0). With b² + 4 a c = 1 the curves behave like unit vectors: their product
g = b b' + 2 (a c' + a' c) says how they meet, in two points where |g| < 1.

A curve's point nearest to the generator, r n, and its curvature k = 2 a give it the parameter t in

    q(t) = r n + (2 t m - 2 k t² n) / (1 + k² t²),      m = n turned left,

which is half the tangent of half the angle on a circle, and half the distance on a line. It runs with the
cell on its left. Every other curve's condition on q(t) is a quadratic in t, so that all the ends come from
one square root each. Each meeting is computed once, and is the same place on both curves: they cannot
disagree. A curve is a row: n (2), r, a, and the values of t between which it is looked at.
"""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import inner_kernel, kernel

_PARALLEL = 1e-29
"""sin² of the angle at which two curves meet, below which rounding alone decides whether they do and where;
they are taken to be one within the other, which moves no border by more than rounding does."""


@kernel
def borders(
    speeds: Array,
    sides: Array,
    points: Array,
    indptr: IntArray,
    indices: IntArray,
    offsets: Array,
    edges: Array,
    first: IntArray,
    kind: IntArray,
) -> Array:
    """Return the pieces of the boundaries of all cells: five numbers as in `arcs`, whose, and what is beyond.

    Parameters
    ----------
    speeds : (n,) m/s
    sides : (k, 5)
        As `Region.sides`.
    points : (n, 2) m
    indptr : (n + 1,), indices : (m,)
        Who hears whom, and
    offsets : (m, 2) m
        where, relative to the robot.
    edges : (e, 6)
        x, y, u, v, cell and beyond of the cells among equally fast robots, and
    first : (n + 1,)
        where each cell's begin.
    kind : (n,), written
        0 for a cell that only equally fast robots bound, 1 for one with circles, 2 for none: a faster robot
        is in the same place.
    """
    found, used = np.empty((len(edges) + 64, 7)), 0
    for i in range(len(points)):
        most = indptr[i + 1] - indptr[i] + first[i + 1] - first[i]
        curves, beyond = np.empty((most, 6)), np.empty(most, np.intp)
        lines = first[i + 1] - first[i]
        count = _circles(curves, beyond, lines, speeds, indptr, indices, offsets, edges, first, i)
        kind[i] = 2 if count < 0 else int(count > lines and lines > 0)
        if kind[i] == 0:
            if used + lines > len(found):
                found = _roomier(found, used + lines)
            for e in range(first[i], first[i + 1]):
                for c in range(4):
                    found[used, c] = edges[e, c]
                found[used, 4], found[used, 5], found[used, 6] = 0.0, i, edges[e, 5]
                used += 1
        elif kind[i] == 1:
            _lines(curves, beyond, sides, points, indptr, indices, offsets, edges, first, i)
            meetings = np.empty((count, count, 2))
            _all_meetings(curves, count, lines, meetings)
            for c in range(count):
                if used + 2 * count + 2 > len(found):
                    found = _roomier(found, used + 2 * count + 2)
                used = _parts(curves, count, c, meetings[c], found, used, i, beyond[c])
    return found[:used]


@kernel
def _roomier(table: Array, wanted: int) -> Array:
    more = np.empty((2 * wanted, table.shape[1]))
    more[: len(table)] = table
    return more


@inner_kernel
def _circles(
    curves: Array,
    beyond: IntArray,
    count: int,
    speeds: Array,
    indptr: IntArray,
    indices: IntArray,
    offsets: Array,
    edges: Array,
    first: IntArray,
    i: int,
) -> int:
    """Write the circles that may bound a cell after its lines; return the rows, -1 for a cell of nothing."""
    reach = 0.0
    for e in range(first[i], first[i + 1]):
        reach = max(reach, np.sqrt(edges[e, 0] ** 2 + edges[e, 1] ** 2))
    for k in range(indptr[i], indptr[i + 1]):
        more = speeds[indices[k]] - speeds[i]
        distance = np.sqrt(offsets[k, 0] ** 2 + offsets[k, 1] ** 2)
        if more > 0.0:
            if distance == 0.0:
                return -1
            # the farthest place of a circle around the cell is behind the robot, seen from the faster one
            reach = min(reach, distance * speeds[i] / more)
    for k in range(indptr[i], indptr[i + 1]):
        own, other = speeds[i], speeds[indices[k]]
        distance = np.sqrt(offsets[k, 0] ** 2 + offsets[k, 1] ** 2)
        near = distance * (own / (own + other))
        if own != other and distance > 0.0 and near < reach:
            curves[count, 0], curves[count, 1] = offsets[k, 0] / distance, offsets[k, 1] / distance
            curves[count, 2] = near
            curves[count, 3] = 0.5 * ((other - own) * (own + other) / (own * other)) / distance
            curves[count, 4], curves[count, 5] = -np.inf, np.inf
            beyond[count] = indices[k]
            count += 1
    return count


@inner_kernel
def _lines(
    curves: Array,
    beyond: IntArray,
    sides: Array,
    points: Array,
    indptr: IntArray,
    indices: IntArray,
    offsets: Array,
    edges: Array,
    first: IntArray,
    i: int,
) -> None:
    """Write the edges of a cell as lines between their ends.

    The directions are those of the bisectors and of the region's sides: an edge may be so short that
    rounding decides on its own.
    """
    for e in range(first[i], first[i + 1]):
        c = e - first[i]
        x, y, u, v = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        middle_x, middle_y = 0.5 * (x + u), 0.5 * (y + v)
        beyond[c] = int(edges[e, 5])
        if beyond[c] >= 0:
            for k in range(indptr[i], indptr[i + 1]):
                if indices[k] == beyond[c]:
                    distance = np.sqrt(offsets[k, 0] ** 2 + offsets[k, 1] ** 2)
                    nx, ny, near = offsets[k, 0] / distance, offsets[k, 1] / distance, 0.5 * distance
        else:
            least = np.inf
            for s in range(len(sides)):
                room = sides[s, 4] - (points[i, 0] * sides[s, 2] + points[i, 1] * sides[s, 3])
                away = abs(middle_x * sides[s, 2] + middle_y * sides[s, 3] - room)
                if away < least:
                    least, nx, ny = away, sides[s, 2], sides[s, 3]
            near = nx * middle_x + ny * middle_y
        curves[c, 0], curves[c, 1], curves[c, 2], curves[c, 3] = nx, ny, near, 0.0
        curves[c, 4], curves[c, 5] = 0.5 * (nx * y - ny * x), 0.5 * (nx * v - ny * u)


@inner_kernel
def _all_meetings(curves: Array, count: int, lines: int, meetings: Array) -> None:
    """Write where each curve enters and leaves the cell's side of each other; nan where they do not meet.

    A curve of which no part is on the cell's side of another one gets an empty interval. Lines of one cell
    are not held against each other: between their ends they are its edges.
    """
    for one in range(count):
        meetings[one, one, 0] = meetings[one, one, 1] = np.nan
        for other in range(one + 1, count):
            enter, leave, apart = np.nan, np.nan, 0
            if other >= lines:
                enter, leave, apart = _meeting(curves, one, other)
            if apart & 1:
                curves[one, 5] = -np.inf
            if apart & 2:
                curves[other, 5] = -np.inf
            meetings[one, other, 0], meetings[one, other, 1] = enter, leave
            # where a curve leaves the side of another one, that one enters its side: in the same place
            meetings[other, one, 0] = _parameter(curves, other, *_place(curves, one, leave))
            meetings[other, one, 1] = _parameter(curves, other, *_place(curves, one, enter))


@inner_kernel
def _meeting(curves: Array, one: int, other: int) -> tuple[float, float, int]:
    """Return where a curve enters the cell's side of another one, where it leaves it, and who is apart.

    Apart (1 for the first, 2 for the other, 3 for both) is of which no part is on the other one's side.
    """
    n1x, n1y, r, a1 = curves[one, 0], curves[one, 1], curves[one, 2], curves[one, 3]
    n2x, n2y, r2, a2 = curves[other, 0], curves[other, 1], curves[other, 2], curves[other, 3]
    # b² + 4 a c = 1, and a r² + |b| r = c
    b1, b2 = 1.0 - 2.0 * a1 * r, 1.0 - 2.0 * a2 * r2
    b1x, b1y, c1 = n1x * b1, n1y * b1, r * (1.0 - a1 * r)
    b2x, b2y, c2 = n2x * b2, n2y * b2, r2 * (1.0 - a2 * r2)
    out, left = b2x * n1x + b2y * n1y, b2y * n1x - b2x * n1y + 0.0  # no negative zero
    k = 2.0 * a1
    bend = 2.0 - r * k
    # on the first curve the other one's condition is square t² + 2 left t + constant <= 0
    square = a2 * bend * bend - k * out * bend - c2 * k * k
    constant = a2 * r * r + r * out - c2
    # 1 - g² as a sum of minors: where curves meet at a small angle, it would be nothing but rounding
    turn, across = b1x * b2y - b1y * b2x, a1 * c2 - a2 * c1
    minors = turn * turn - 4.0 * across * across
    minors += 4.0 * (
        (b1x * a2 - b2x * a1) * (b1x * c2 - b2x * c1) + (b1y * a2 - b2y * a1) * (b1y * c2 - b2y * c1)
    )
    if minors > _PARALLEL:
        large = -left - np.copysign(np.sqrt(minors), left)
        if left >= 0.0:
            return large / square, constant / large, 0
        return constant / large, large / square, 0
    # one curve is within the other (g >= 1), or neither, or both are out
    outside = square + constant > 0.0
    g = b1x * b2x + b1y * b2y + 2.0 * (a1 * c2 + a2 * c1)
    return np.nan, np.nan, (1 if outside else 0) + (2 if outside == (g < 0.0) else 0)


@inner_kernel
def _parts(
    curves: Array, count: int, c: int, meetings: Array, found: Array, used: int, i: int, beyond: int
) -> int:
    """Write the parts of a curve that all others leave; return how many pieces there are then."""
    begin, end = curves[c, 4], curves[c, 5]
    for o in range(count):
        if meetings[o, 0] <= meetings[o, 1]:
            begin, end = max(begin, meetings[o, 0]), min(end, meetings[o, 1])
    # where another one leaves two parts there is a gap between them: the gaps by their begins
    gaps = 0
    for o in range(count):
        enter, leave = meetings[o, 0], meetings[o, 1]
        if leave < enter and leave < end and enter > begin:
            k = gaps
            while k > 0 and meetings[k - 1, 1] > leave:
                meetings[k, 0], meetings[k, 1] = meetings[k - 1, 0], meetings[k - 1, 1]
                k -= 1
            meetings[k, 0], meetings[k, 1] = enter, leave
            gaps += 1
    for k in range(gaps):
        used = _piece(curves, c, begin, min(meetings[k, 1], end), found, used, i, beyond)
        begin = max(begin, meetings[k, 0])
    return _piece(curves, c, begin, end, found, used, i, beyond)


@inner_kernel
def _piece(
    curves: Array, c: int, begin: float, end: float, found: Array, used: int, i: int, beyond: int
) -> int:
    """Write a part of a curve, at most half a circle a piece: cut where t is zero."""
    k = 2.0 * curves[c, 3]
    while begin < end:
        stop = 0.0 if begin < 0.0 < end and k != 0.0 else end
        found[used, 0], found[used, 1] = _place(curves, c, begin)
        found[used, 2], found[used, 3] = _place(curves, c, stop)
        found[used, 4] = 0.0 if k == 0.0 else np.arctan(k * stop) - np.arctan(k * begin)
        found[used, 5], found[used, 6] = i, beyond
        begin, used = stop, used + 1
    return used


@inner_kernel
def _place(curves: Array, c: int, t: float) -> tuple[float, float]:
    """Return q(t), m."""
    k = 2.0 * curves[c, 3]
    if abs(k * t) <= 1.0:
        flat = 1.0 + (k * t) ** 2
        left, out = 2.0 * t / flat, curves[c, 2] - 2.0 * k * t * t / flat
    else:
        over = 1.0 / t
        steep = over * over + k * k
        left, out = 2.0 * over / steep, curves[c, 2] - 2.0 * k / steep
    return out * curves[c, 0] - left * curves[c, 1], out * curves[c, 1] + left * curves[c, 0]


@inner_kernel
def _parameter(curves: Array, c: int, x: float, y: float) -> float:
    """Return t where q(t) is nearest to a place next to the curve."""
    k = 2.0 * curves[c, 3]
    out = x * curves[c, 0] + y * curves[c, 1] - curves[c, 2]
    left = y * curves[c, 0] - x * curves[c, 1]
    over = 2.0 + k * out
    t: float = left / over if over > 1.0 else -out / (k * left)
    return t
