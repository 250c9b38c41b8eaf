"""Which parts of many curves bound many cells: the curves are circles and lines, the cells where all agree.

About its generator, every boundary that a cell may have is a curve a |q|² + b q = c, and the cell lies
where a |q|² + b q <= c: a line (a = 0), a circle around the cell (a > 0), or one around what is not the
cell's (a < 0). With b² + 4 a c = 1 the curves behave like unit vectors: their product
g = b b' + 2 (a c' + a' c) says how they meet, in two points where |g| < 1.

A curve's point nearest to the generator, r n, and its curvature k = 2 a give it the parameter t in

    q(t) = r n + (2 t m - 2 k t² n) / (1 + k² t²),      m = n turned left,

which is half the tangent of half the angle on a circle, and half the distance on a line. It runs with the
cell on its left. Every other curve's condition on q(t) is a quadratic in t, so that all the ends come from
one square root each. Each meeting is computed once, and is the same place on both curves: they cannot
disagree.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.arrays.grouping import beginnings, ranges, sizes
from robocov.voronoi.arcs import Arcs

_SECTORS = 16
"""Directions around a generator in which it is asked how far its cell can reach."""

_PARALLEL = 1e-29
"""sin² of the angle at which two curves meet, below which rounding alone decides whether they do and where;
they are taken to be one within the other, which moves no border by more than rounding does."""

_SLACK = 1.0 + 1e-9
"""More than rounding can do to a reach."""


class Curves(NamedTuple):
    """Curves that may bound cells, each cell's in one run.

    Attributes
    ----------
    cell : (m,)
        Ascending.
    beyond : (m,)
        The robot on the other side, or `REGION`.
    normal : (m, 2)
        n, the unit vector away from the generator.
    near : (m,) m
        r, how far out along it the curve begins.
    half_curvature : (m,) 1/m
        a.
    begin, end : (m,) m
        The values of t between which the curve is looked at; infinite on circles.
    """

    cell: IntArray
    beyond: IntArray
    normal: Array
    near: Array
    half_curvature: Array
    begin: Array
    end: Array

    def take(self, some: IntArray) -> Curves:
        """Return some of the curves."""
        return Curves._make(values[some] for values in self)


class Pieces(NamedTuple):
    """The pieces of the curves that bound the cells.

    Attributes
    ----------
    cell, beyond : (p,)
    arcs : Arcs
        Relative to the generators, each with its cell on its left, and at most half a circle.
    """

    cell: IntArray
    beyond: IntArray
    arcs: Arcs

    def take(self, some: IntArray) -> Pieces:
        """Return some of the pieces."""
        return Pieces(self.cell[some], self.beyond[some], Arcs(*(values[some] for values in self.arcs)))


def in_reach(curves: Curves) -> Curves:
    """Return the curves without those that are out of reach of what the other curves leave of their cell.

    Lines and circles around the cell have it in a convex set about its generator; in each of some sectors it
    is bounded by the least of their far ends there, and what is wholly beyond that bounds nothing.
    """
    if not len(curves.cell):
        return curves
    half = np.pi / _SECTORS
    turn = 2.0 * half * np.arange(_SECTORS)
    # cosine and sine of the angle between a curve's normal and a sector's middle, then to its nearest
    # and farthest direction
    cosine = curves.normal @ np.stack([np.cos(turn), np.sin(turn)])
    sine = np.abs(curves.normal @ np.stack([np.sin(turn), -np.cos(turn)]))
    ahead = np.where(cosine >= np.cos(half), 1.0, cosine * np.cos(half) + sine * np.sin(half))
    aside = np.where(cosine <= -np.cos(half), -1.0, cosine * np.cos(half) - sine * np.sin(half))
    first = beginnings(curves.cell)
    around = curves.half_curvature >= 0.0
    inside = around & (curves.near > 0.0)
    far = np.where(inside[:, None], _radius(curves, aside), np.inf)
    reach = np.minimum.reduceat(far, first).repeat(sizes(first, len(curves.cell)), axis=0)
    near = _radius(curves, ahead) < _SLACK * reach
    return curves.take((near.any(axis=1) | (curves.half_curvature == 0.0)).nonzero()[0])


def _radius(curves: Curves, cosine: Array) -> Array:
    """Return how far from the generator curves (m,) first are at angles (m, s) from their normals."""
    b = (1.0 - 2.0 * curves.half_curvature * curves.near)[:, None]
    c = (curves.near * (1.0 - curves.half_curvature * curves.near))[:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        radius = 2.0 * c / (b * cosine + np.sqrt(1.0 - b * b * (1.0 - cosine * cosine)))
    return np.where(radius >= 0.0, radius, np.inf)


def boundaries(curves: Curves) -> Pieces:
    """Return the pieces of the curves on which all other curves of the same cell agree.

    Lines of one cell are not held against each other: between their ends they are to be its edges.
    """
    if not len(curves.cell):
        return _pieces(curves, curves.cell, curves.begin, curves.end)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return _pieces(curves, *_intervals(curves))


def _intervals(curves: Curves) -> tuple[IntArray, Array, Array]:
    """Return the intervals of t on which curves bound their cells: of which curve, from where to where."""
    one, other = _pairs(curves)
    apart, enter, leave = _meetings(curves, one, other)
    # where a curve leaves the side of another one, that one enters its side: in the same place
    back = _parameter(curves, other, _places(curves, one, leave))
    forth = _parameter(curves, other, _places(curves, one, enter))
    curve = np.concatenate([one, other])
    enter, leave = np.concatenate([enter, back]), np.concatenate([leave, forth])

    begin, end = curves.begin.copy(), curves.end.copy()
    end[apart] = -np.inf
    between = (enter <= leave).nonzero()[0]
    np.maximum.at(begin, curve[between], enter[between])
    np.minimum.at(end, curve[between], leave[between])
    gap = ((leave < enter) & (leave < end[curve]) & (enter > begin[curve])).nonzero()[0]
    return _without_gaps(begin, end, curve[gap], leave[gap], enter[gap])


def _pairs(curves: Curves) -> tuple[IntArray, IntArray]:
    """Return the pairs of curves of one cell, each once, and none of two lines."""
    first = beginnings(curves.cell)
    size = sizes(first, len(curves.cell))
    place = np.arange(len(curves.cell))
    count = (first + size).repeat(size) - place - 1
    one, other = place.repeat(count), ranges(place + 1, count)
    bent = curves.half_curvature != 0.0
    some = (bent[one] | bent[other]).nonzero()[0]
    return one[some], other[some]


def _meetings(curves: Curves, one: IntArray, other: IntArray) -> tuple[IntArray, Array, Array]:
    """Return how (p,) pairs of curves meet.

    Returns
    -------
    apart : (k,)
        The curves of which no part is on the cell's side of another one.
    enter, leave : (p,) m
        Where the first curve of each pair enters the cell's side of the other one, and where it leaves it;
        nan where they do not meet.
    """
    a, near = curves.half_curvature, curves.near
    b = curves.normal * (1.0 - 2.0 * a * near)[:, None]  # b² + 4 a c = 1, and a r² + |b| r = c
    c = near * (1.0 - a * near)
    a1, r, k = a[one], near[one], 2.0 * a[one]
    a2, b2, c2 = a[other], b[other], c[other]
    n1, b1, c1 = curves.normal[one], b[one], c[one]
    out = b2[:, 0] * n1[:, 0] + b2[:, 1] * n1[:, 1]
    left = b2[:, 1] * n1[:, 0] - b2[:, 0] * n1[:, 1] + 0.0  # no negative zero
    bend = 2.0 - r * k
    # on the first curve the other one's condition is square t² + 2 left t + constant <= 0
    square = a2 * bend * bend - k * out * bend - c2 * k * k
    constant = a2 * r * r + r * out - c2
    g = b1[:, 0] * b2[:, 0] + b1[:, 1] * b2[:, 1] + 2.0 * (a1 * c2 + a2 * c1)
    # 1 - g² as a sum of minors: where curves meet at a small angle, it would be nothing but rounding
    ab, bc = b1 * a2[:, None] - b2 * a1[:, None], b1 * c2[:, None] - b2 * c1[:, None]
    minors = (b1[:, 0] * b2[:, 1] - b1[:, 1] * b2[:, 0]) ** 2 - 4.0 * (a1 * c2 - a2 * c1) ** 2
    minors += 4.0 * (ab[:, 0] * bc[:, 0] + ab[:, 1] * bc[:, 1])
    meet = minors > _PARALLEL
    root = np.sqrt(np.where(meet, minors, np.nan))
    large = -left - np.copysign(root, left)
    early, late = large / square, constant / large
    enter, leave = np.where(left >= 0.0, early, late), np.where(left >= 0.0, late, early)
    # without a meeting, one curve is within the other (g >= 1), or neither, or both are out
    outside = square + constant > 0.0
    first = one[~meet & outside]
    second = other[~meet & (outside == (g < 0.0))]
    return np.concatenate([first, second]), enter, leave


def _without_gaps(
    begin: Array, end: Array, curve: IntArray, low: Array, high: Array
) -> tuple[IntArray, Array, Array]:
    """Return what is left of the intervals from `begin` to `end` of all curves without gaps in them."""
    count = len(begin)
    # what is before the interval counts as a gap, too
    curve = np.concatenate([np.arange(count), curve])
    low, high = np.concatenate([np.full(count, -np.inf), low]), np.concatenate([begin, high])
    order = np.lexsort((low, curve))
    curve, low, high = curve[order], low[order], high[order]
    # the farthest end of the gaps so far: a running maximum, of ranks, in which later curves count for more
    rank = np.empty(len(high), dtype=np.intp)
    by_end = high.argsort(kind="stable")
    rank[by_end] = np.arange(len(high))
    farthest = np.maximum.accumulate(rank + curve * len(high)) - curve * len(high)
    start = high[by_end[farthest]]
    following = np.concatenate([low[1:], [0.0]])
    last = np.concatenate([curve[1:] != curve[:-1], [True]])
    stop = np.where(last, end[curve], np.minimum(following, end[curve]))
    some = (start < stop).nonzero()[0]
    return curve[some], start[some], stop[some]


def _pieces(curves: Curves, curve: IntArray, begin: Array, end: Array) -> Pieces:
    # at most half a circle each: cut where t is zero, and where it is infinite they are already
    cut = ((begin < 0.0) & (end > 0.0) & (curves.half_curvature[curve] != 0.0)).nonzero()[0]
    curve = np.concatenate([curve, curve[cut]])
    begin = np.concatenate([begin, np.zeros(len(cut))])
    end = np.concatenate([end, end[cut]])
    end[cut] = 0.0
    order = np.lexsort((begin, curve))
    curve, begin, end = curve[order], begin[order], end[order]
    k = 2.0 * curves.half_curvature[curve]
    angle = np.where(k == 0.0, 0.0, np.arctan(k * end) - np.arctan(k * begin))
    arcs = Arcs(_places(curves, curve, begin), _places(curves, curve, end), angle)
    return Pieces(curves.cell[curve], curves.beyond[curve], arcs)


def _places(curves: Curves, curve: IntArray, t: Array) -> Array:
    """Return q(t), (p, 2) m."""
    k, normal = 2.0 * curves.half_curvature[curve], curves.normal[curve]
    small = np.abs(k * t) <= 1.0
    over = 1.0 / np.where(t == 0.0, 1.0, t)
    flat, steep = 1.0 + (k * t) ** 2, over * over + k * k
    left = 2.0 * np.where(small, t / flat, over / steep)
    out = curves.near[curve] - 2.0 * k * np.where(small, t * t / flat, 1.0 / steep)
    x = out * normal[:, 0] - left * normal[:, 1]
    y = out * normal[:, 1] + left * normal[:, 0]
    return np.column_stack([x, y])


def _parameter(curves: Curves, curve: IntArray, places: Array) -> Array:
    """Return t where q(t) is nearest to (p, 2) places next to the curves."""
    k, normal = 2.0 * curves.half_curvature[curve], curves.normal[curve]
    out = places[:, 0] * normal[:, 0] + places[:, 1] * normal[:, 1] - curves.near[curve]
    left = places[:, 1] * normal[:, 0] - places[:, 0] * normal[:, 1]
    over = 2.0 + k * out
    return np.asarray(np.where(over > 1.0, left / over, -out / (k * left)))
