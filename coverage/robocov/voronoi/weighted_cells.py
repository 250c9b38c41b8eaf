"""Cells by travel time: the multiplicatively weighted Voronoi partition of robots of different speeds.

Cell i holds the places that robot i reaches before all others, |q - p_i| / v_i <= |q - p_j| / v_j, going
straight. Between robots of one speed the border is their bisector; of different speeds it is a circle of
Apollonius, around the slower one. Cells are bounded by segments and arcs, and need be neither convex nor in
one piece: a slow robot's cell is a hole in a fast one's, or divides it. The centroid, where the partition's
cost sum_i int |q - p_i|² / v_i² dq is least for given cells, may then lie in somebody else's cell.

Source: F. Aurenhammer and H. Edelsbrunner, *An optimal algorithm for constructing the weighted Voronoi
diagram in the plane*, Pattern Recognition 17 (1984). Here the boundary pieces of all cells are found at
once instead, and are not linked: Green's theorem needs no order.

About its generator, every boundary that a cell may have is a curve a |q|² + b q = c, and the cell lies
where a |q|² + b q <= c: a line (a = 0), a circle around the cell (a > 0), or one around what is not the
cell's (a < 0). With b² + 4 a c = 1 the curves behave like unit vectors: their product
g = b b' + 2 (a c' + a' c) says how they meet, in two points where |g| < 1.

A curve's point nearest to the generator, r n, and its curvature k = 2 a give it the parameter t in

    q(t) = r n + (2 t m - 2 k t² n) / (1 + k² t²),      m = n turned left,

which is half the tangent of half the angle on a circle, and half the distance on a line. It runs with the
cell on its left. Every other curve's condition on q(t) is a quadratic in t, so that all the ends come from
one square root each. Each meeting is computed once, and is the same place on both curves: they cannot
disagree. A curve is a row: n (2), r, a, the values of t between which it is looked at, whose cell it bounds,
and what is beyond.

A piece of a boundary is a row x, y, u, v, a: its ends (m), and half of the angle that it spans about its
circle's centre, from -pi/2 to pi/2, positive where it turns left; whose it is, and what is beyond. Zero is a
segment, and an arc that is almost one loses no digit, however large its radius. Green's theorem asks for the
triangle that the chord spans with the origin, and for the circular segment between chord and arc.
"""

from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.density.base import CellEdges, Density
from robocov.errors import InputError, quote
from robocov.observation import Cells
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.voronoi import VoronoiPartition, generators_of, partition, weighted
from robocov.voronoi.delaunay import Mesh

_SERIES_BELOW = 0.04
"""sin² of the half angle below which the series is taken: the closed form divides rounding by it."""

_SERIES = np.array([2.0 * comb(2 * m, m) / 4.0**m / (2 * m + 3) for m in range(13, 0, -1)])
"""Of (x - sin x cos x - 2/3 sin³ x) / sin⁵ x by powers of sin² x, the highest first."""

_SAGITTA, _FINE = 2e-4, 2e-5
"""Largest deviation of outlines, and of the polygons that stand for cells in integrals, from their arcs,
relative to the region's diameter."""

_NOTHING = 1e-14
"""Area of a cell, relative to the region's, that is rounding."""

_PARALLEL = 1e-29
"""sin² of the angle at which two curves meet, below which rounding alone decides whether they do and where;
they are taken to be one within the other, which moves no border by more than rounding does."""


@dataclass(eq=False, kw_only=True)
class WeightedCells(Cells):
    """The cells of robots of different speeds within a convex region.

    Where a cell is not convex, its centroid may lie outside of it. There is no triangulation.
    """

    speeds: Array
    """(n,) m/s"""
    pieces: Array
    """(p, 7) The pieces of the boundaries, relative to the generators, in the order of the cells."""
    region: Region

    @cached_property
    def edges(self) -> CellEdges:
        """The boundaries as polygons that leave the arcs by at most 2e-5 of the region's diameter.

        The edges of a cell are not in order: holes are among them, clockwise.
        """
        lines = chords(self.pieces, _FINE * self.region.diameter)
        count = [len(line) - 1 for line in lines]
        start = np.concatenate([np.empty((0, 2)), *(line[:-1] for line in lines)])
        end = np.concatenate([np.empty((0, 2)), *(line[1:] for line in lines)])
        return CellEdges(start, end, *(part.repeat(count) for part in self.pieces[:, 5:].T.astype(np.intp)))

    @cached_property
    def outlines(self) -> tuple[list[Array], IntArray]:
        """The outlines of the cells, (k, 2) m each, and whose each is; arcs are cut into chords.

        Counter-clockwise around a part of a cell, clockwise around a hole. The cells of fast robots come
        first: painted one over the other without regard for holes, they show the partition.
        """
        found, owners = [], []
        for i in np.argsort(-self.speeds, kind="stable").tolist():
            for ring in rings(self.pieces[self.pieces[:, 5] == i], _SAGITTA * self.region.diameter):
                found.append(ring + self.generators[i])
                owners.append(i)
        return found, np.array(owners, dtype=np.intp)

    @cached_property
    def polar_moment(self) -> Array:
        if self.density is not None and not self.density.is_uniform:
            return super().polar_moment
        weight = 1.0 if self.density is None else self.density.max_value
        polar = moments(self.pieces, len(self.generators))[:, 3]
        return np.where(self.mass > 0.0, weight * polar, 0.0)


def weighted_partition(
    generators: Array,
    speeds: Array,
    region: Region,
    neighbours: Neighbours | None = None,
    warm: Mesh | None = None,
    heard: Array | None = None,
    density: Density | None = None,
) -> VoronoiPartition | WeightedCells:
    """Return the cells of the places that each robot reaches first, going straight.

    Parameters and errors are those of `partition`, but for the following. Each cell depends, to the last bit,
    on the places and speeds of the robot and those that it hears alone.

    Parameters
    ----------
    generators : (n, 2) m
        Those at the very same place do not cut each other when they are equally fast; of others the
        fastest has the cell, and the rest have none.
    speeds : (n,) m/s
        Positive; else an InputError is raised. When all are equal, the cells are those of `partition`, bit
        for bit.
    density : Density or None
        φ is integrated over cells whose arcs are cut into chords that leave them by at most 2e-5 of the
        region's diameter.

    A robot of twice the speed leaves a slow one a disc of 2/3 of the distance between them.

    >>> square = Region(np.array([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]))
    >>> cells = weighted_partition(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([1.0, 2.0]), square)
    >>> bool(abs(cells.mass[0] - np.pi * 2.0**2) < 1e-12), cells.centroid[0].round(12).tolist()
    (True, [-1.0, 0.0])
    """
    points = generators_of(generators)
    speeds = np.array(speeds, dtype=np.float64)
    if speeds.shape != points.shape[:1] or not ((speeds > 0.0) & (speeds < np.inf)).all():
        raise InputError(f"speeds: {quote(speeds.tolist())}, but {len(points)} positive numbers were wanted")
    neighbours = Neighbours(len(points)) if neighbours is None else neighbours
    if (speeds == speeds[:1]).all():
        return partition(points, region, neighbours, warm, heard=heard, density=density)
    n = len(points)
    one, other = neighbours.list_pairs()
    equal = speeds[one] == speeds[other]
    places = None if heard is None else heard[equal]
    cells = partition(points, region, Neighbours.from_pairs(n, one[equal], other[equal]), heard=places)
    edges = np.column_stack([cells.edges.start, cells.edges.end, cells.edges.cell, cells.edges.beyond])
    offsets = (points[other] if heard is None else heard) - points[one]
    pairs = np.column_stack([one, other, offsets, speeds[one], speeds[other]])
    straight = np.empty(n, dtype=bool)
    # only Python without the compiler warns of what is infinite, or nothing
    with np.errstate(all="ignore"):
        pieces = _borders(points, region.sides, pairs, edges, straight)
    sums = moments(pieces, n)
    mass = np.where(sums[:, 0] < _NOTHING * region.area, 0.0, sums[:, 0])
    centroid = points + sums[:, 1:3] / np.where(mass > 0.0, mass, np.inf)[:, None]
    mass = np.where(straight, cells.mass, mass)
    centroid = np.where(straight[:, None], cells.centroid, centroid)
    speeds.setflags(write=False)
    found = WeightedCells(points, mass, centroid, speeds=speeds, pieces=pieces, region=region)
    return weighted(found, density)


@kernel
def _borders(points: Array, sides: Array, pairs: Array, edges: Array, straight: BoolArray) -> Array:
    """Return the pieces of all boundaries.

    The sides are `Region.sides`. Pairs, (m, 6), are robot, neighbour, the offset to where that is known to be
    (m), and their speeds (m/s), by robot; edges, (e, 6), are x, y, u, v, cell and beyond of the cells among
    equally fast robots. Written is whether only these bound a cell, `straight`.
    """
    found, used, pair, edge = np.empty((len(edges) + 64, 7)), 0, 0, 0
    for i in range(len(points)):
        first, begin = pair, edge
        while pair < len(pairs) and pairs[pair, 0] == i:
            pair += 1
        while edge < len(edges) and edges[edge, 4] == i:
            edge += 1
        lines, heard, bounds = edge - begin, pairs[first:pair], edges[begin:edge]
        curves, meetings = np.empty((lines + pair - first, 8)), np.empty((0, 0, 2))
        count = _circles(curves, heard, bounds)
        straight[i] = count == lines or (lines == 0 and count > 0)
        if straight[i]:
            count = lines
        elif count > 0:
            _lines(curves, heard, bounds, sides, points[i, 0], points[i, 1])
            meetings = np.empty((count, count, 2))
            _all_meetings(curves[:count], lines, meetings)
        for c in range(count):
            if used + 2 * count + 2 > len(found):
                more = np.empty((2 * (used + 2 * count + 2), 7))
                more[: len(found)] = found
                found = more
            if straight[i]:
                for k in range(4):
                    found[used, k] = bounds[c, k]
                found[used, 4], found[used, 5], found[used, 6] = 0.0, i, bounds[c, 5]
                used += 1
            else:
                used = _parts(curves[c], meetings[c], found, used)
    return found[:used]


@kernel
def _circles(curves: Array, pairs: Array, edges: Array) -> int:
    """Write the circles that may bound a cell after its lines; return the rows, -1 for a cell of nothing."""
    count, reach = len(edges), 0.0
    for e in range(len(edges)):
        reach = max(reach, np.sqrt(edges[e, 0] ** 2 + edges[e, 1] ** 2))
    for turn in range(2):
        for k in range(len(pairs)):
            own, other = pairs[k, 4], pairs[k, 5]
            distance = np.sqrt(pairs[k, 2] ** 2 + pairs[k, 3] ** 2)
            if turn == 0 and other > own:
                if distance == 0.0:
                    return -1
                # the farthest place of a circle around the cell is behind the robot, seen from the faster one
                reach = min(reach, distance * own / (other - own))
            near = distance * (own / (own + other))
            if turn == 1 and own != other and distance > 0.0 and near < reach:
                curves[count, 0], curves[count, 1] = pairs[k, 2] / distance, pairs[k, 3] / distance
                curves[count, 2] = near
                curves[count, 3] = 0.5 * ((other - own) * (own + other) / (own * other)) / distance
                curves[count, 4], curves[count, 5] = -np.inf, np.inf
                curves[count, 6], curves[count, 7] = pairs[k, 0], pairs[k, 1]
                count += 1
    return count


@kernel
def _lines(curves: Array, pairs: Array, edges: Array, sides: Array, px: float, py: float) -> None:
    """Write the edges of a cell as lines between their ends.

    The directions are those of the bisectors and of the region's sides: an edge may be so short that
    rounding decides on its own.
    """
    for e in range(len(edges)):
        x, y, u, v = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        middle_x, middle_y = 0.5 * (x + u), 0.5 * (y + v)
        nx, ny, near, least = 0.0, 0.0, 0.0, np.inf
        for k in range(len(pairs) if edges[e, 5] >= 0.0 else 0):
            if pairs[k, 1] == edges[e, 5]:
                distance = np.sqrt(pairs[k, 2] ** 2 + pairs[k, 3] ** 2)
                nx, ny, near = pairs[k, 2] / distance, pairs[k, 3] / distance, 0.5 * distance
        for s in range(len(sides) if edges[e, 5] < 0.0 else 0):
            room = sides[s, 4] - (px * sides[s, 2] + py * sides[s, 3])
            away = abs(middle_x * sides[s, 2] + middle_y * sides[s, 3] - room)
            if away < least:
                least, nx, ny = away, sides[s, 2], sides[s, 3]
                near = nx * middle_x + ny * middle_y
        curves[e, 0], curves[e, 1], curves[e, 2], curves[e, 3] = nx, ny, near, 0.0
        curves[e, 4], curves[e, 5] = 0.5 * (nx * y - ny * x), 0.5 * (nx * v - ny * u)
        curves[e, 6], curves[e, 7] = edges[e, 4], edges[e, 5]


@kernel
def _all_meetings(curves: Array, lines: int, meetings: Array) -> None:
    """Write where each curve enters and leaves the cell's side of each other; nan where they do not meet.

    A curve of which no part is on the cell's side of another one gets an empty interval. Lines of one cell
    are not held against each other: between their ends they are its edges.
    """
    count = len(curves)
    for one in range(count):
        meetings[one, one, 0] = meetings[one, one, 1] = np.nan
        for other in range(one + 1, count):
            enter, leave, apart = np.nan, np.nan, 0
            if other >= lines:
                enter, leave, apart = _meeting(curves[one], curves[other])
            if apart & 1:
                curves[one, 5] = -np.inf
            if apart & 2:
                curves[other, 5] = -np.inf
            meetings[one, other, 0], meetings[one, other, 1] = enter, leave
            # where a curve leaves the side of another one, that one enters its side: in the same place
            meetings[other, one, 0] = _parameter(curves[other], *_place(curves[one], leave))
            meetings[other, one, 1] = _parameter(curves[other], *_place(curves[one], enter))


@kernel
def _meeting(one: Array, other: Array) -> tuple[float, float, int]:
    """Return where a curve enters the cell's side of another one, where it leaves it, and who is apart.

    Apart (1 for the first, 2 for the other, 3 for both) is of which no part is on the other one's side.
    """
    n1x, n1y, r, a1 = one[0], one[1], one[2], one[3]
    n2x, n2y, r2, a2 = other[0], other[1], other[2], other[3]
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


@kernel
def _parts(curve: Array, meetings: Array, found: Array, used: int) -> int:
    """Write the parts of a curve that all others leave; return how many pieces there are then."""
    begin, end = curve[4], curve[5]
    for o in range(len(meetings)):
        if meetings[o, 0] <= meetings[o, 1]:
            begin, end = max(begin, meetings[o, 0]), min(end, meetings[o, 1])
    # where another one leaves two parts there is a gap between them: the gaps by their begins
    gaps = 0
    for o in range(len(meetings)):
        enter, leave = meetings[o, 0], meetings[o, 1]
        if leave < enter and leave < end and enter > begin:
            k = gaps
            while k > 0 and meetings[k - 1, 1] > leave:
                meetings[k, 0], meetings[k, 1] = meetings[k - 1, 0], meetings[k - 1, 1]
                k -= 1
            meetings[k, 0], meetings[k, 1] = enter, leave
            gaps += 1
    for k in range(gaps):
        used = _piece(curve, begin, min(meetings[k, 1], end), found, used)
        begin = max(begin, meetings[k, 0])
    return _piece(curve, begin, end, found, used)


@kernel
def _piece(curve: Array, begin: float, end: float, found: Array, used: int) -> int:
    """Write a part of a curve, at most half a circle a piece: cut where t is zero."""
    k = 2.0 * curve[3]
    while begin < end:
        stop = 0.0 if begin < 0.0 < end and k != 0.0 else end
        found[used, 0], found[used, 1] = _place(curve, begin)
        found[used, 2], found[used, 3] = _place(curve, stop)
        found[used, 4] = 0.0 if k == 0.0 else np.arctan(k * stop) - np.arctan(k * begin)
        found[used, 5], found[used, 6] = curve[6], curve[7]
        begin, used = stop, used + 1
    return used


@kernel
def _place(curve: Array, t: float) -> tuple[float, float]:
    """Return q(t), m."""
    k = 2.0 * curve[3]
    if abs(k * t) <= 1.0:
        flat = 1.0 + (k * t) ** 2
        left, out = 2.0 * t / flat, curve[2] - 2.0 * k * t * t / flat
    else:
        over = 1.0 / t
        steep = over * over + k * k
        left, out = 2.0 * over / steep, curve[2] - 2.0 * k / steep
    return out * curve[0] - left * curve[1], out * curve[1] + left * curve[0]


@kernel
def _parameter(curve: Array, x: float, y: float) -> float:
    """Return t where q(t) is nearest to a place next to the curve."""
    k = 2.0 * curve[3]
    out = x * curve[0] + y * curve[1] - curve[2]
    left = y * curve[0] - x * curve[1]
    over = 2.0 + k * out
    t: float = left / over if over > 1.0 else -out / (k * left)
    return t


@kernel
def _moments(pieces: Array, n: int, series: Array) -> Array:
    sums = np.zeros((n, 4))
    for k in range(len(pieces)):
        x, y, u, v = pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3]
        cross = x * v - u * y
        middle_x, middle_y = 0.5 * (x + u), 0.5 * (y + v)
        # to the right of the chord, as long as it is
        out_x, out_y = v - y, x - u
        square = out_x * out_x + out_y * out_y
        area, lever, spread = _segment(pieces[k, 4], series)
        area, lever, spread = area * square, lever * square, spread * square * square
        i = int(pieces[k, 5])
        sums[i, 0] += 0.5 * cross + area
        sums[i, 1] += middle_x * (cross / 3.0 + area) + lever * out_x
        sums[i, 2] += middle_y * (cross / 3.0 + area) + lever * out_y
        ends = x * (x + u) + u * u + y * (y + v) + v * v
        along = lever * (middle_x * out_x + middle_y * out_y)
        away = middle_x * middle_x + middle_y * middle_y
        sums[i, 3] += cross * ends / 12.0 + spread + 2.0 * along + area * away
    return sums


@kernel
def _segment(half_angle: float, series: Array) -> tuple[float, float, float]:
    """Return area, lever and spread of the circular segment on a chord of length 1.

    The lever is the first moment about the chord's line, away from the centre; the spread is the polar
    moment about the middle of the chord. With s and c the sine and cosine of the half angle x, and
    h = (x - s c - 2/3 s³) / s⁵, which is 1/5 at zero, all three are sums of terms that do not cancel.
    """
    s, c = np.sin(half_angle), np.cos(half_angle)
    square = s * s
    if square > _SERIES_BELOW:
        h = ((half_angle - s * c) / s**3 - 2.0 / 3.0) / square
    else:
        h = 0.0
        for coefficient in series:
            h = h * square + coefficient
    area = s * (2.0 / 3.0 + square * h) / 4.0
    lever = square * (2.0 / 3.0 / (1.0 + c) - c * h) / 8.0
    return area, lever, s * (1.0 / (1.0 + c) - 2.0 / 3.0 + (1.5 - square) * h) / 16.0


def moments(pieces: Array, n: int) -> Array:
    """Return area (m²), first moments x and y (m³) and polar moment (m⁴) of n cells, (n, 4).

    `pieces` (p, 6 or more) are the boundaries; the sixth number is the cell about whose origin each is.
    """
    return np.asarray(_moments(np.ascontiguousarray(pieces), n, _SERIES))


def chords(pieces: Array, sagitta: float) -> list[Array]:
    """Return each piece as a line of chords, (k, 2) m with both ends, at most `sagitta` from it."""
    lines = []
    for x, y, u, v, half_angle in pieces[:, :5].tolist():
        radius = 0.5 * np.hypot(u - x, v - y) / max(abs(np.sin(half_angle)), 1e-300)
        parts = 1
        if radius * half_angle**2 >= 2.0 * sagitta:
            # a chord of half angle x leaves its arc by r (1 - cos x)
            step = np.sqrt(2.0 * min(sagitta / max(radius, 1e-300), 0.5))
            parts = int(np.ceil(abs(half_angle) / max(step, 1e-3)))
        if parts == 1:
            lines.append(np.array([[x, y], [u, v]]))
            continue
        angle = half_angle * np.linspace(-1.0, 1.0, parts + 1)
        rise = 0.5 * (np.cos(angle) - np.cos(half_angle)) / np.sin(half_angle)
        run = 0.5 + 0.5 * np.sin(angle) / np.sin(half_angle)
        line = np.column_stack([x + run * (u - x) + rise * (v - y), y + run * (v - y) + rise * (x - u)])
        line[0], line[-1] = (x, y), (u, v)
        lines.append(line)
    return lines


def rings(pieces: Array, sagitta: float) -> list[Array]:
    """Return the closed lines that pieces in any order make up, as polygons, (k, 2) m each.

    Outlines run counter-clockwise, those of holes clockwise. Every piece ends where another one begins, up
    to rounding; the polygons leave the arcs by at most `sagitta` (m).
    """
    lines, left, found = chords(pieces, sagitta), list(range(len(pieces))), []
    while left:
        first = k = left.pop(0)
        ring = [lines[k][:-1]]
        while True:
            home = np.hypot(*(pieces[first, :2] - pieces[k, 2:4]))
            away = np.hypot(*(pieces[left, :2] - pieces[k, 2:4]).T)
            if not left or home <= away.min():
                break
            k = left.pop(int(away.argmin()))
            ring.append(lines[k][:-1])
        found.append(np.concatenate(ring))
    return found
