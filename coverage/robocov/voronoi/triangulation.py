"""The Delaunay triangulation that the cells are read from, carried from step to step and mended by flips.

Robots move little between two steps, and few Delaunay edges change. So the last triangulation is tried
on the new places: where the two angles opposite an edge sum to more than pi, the edge is flipped to the
other diagonal (Lawson 1977), until none is left. Only then is the result used: every edge is locally
Delaunay and every triangle turns left, within a boundary that never moves, which makes it a Delaunay
triangulation. Where that does not come about quickly, all is triangulated anew, by Qhull.

The boundary is a triangle of three *sentinels*, far enough out to cut no cell. A robot that enters or
leaves the convex hull of the team is then a flip like any other, no edge that counts lacks a triangle on
either side, and n robots make 3 n edges, always (those among the sentinels are not stored).

Plane vectors are complex numbers, ``x + i y``. An angle is kept as conj(a) b, of the vectors a and b along
its sides: adding angles is multiplying these, and the imaginary part's sign tells left from right.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay, QhullError

from robocov.arrays import ComplexArray, IntArray

SENTINELS = 3
"""Points beyond the robots, last in every array of points."""

_QHULL_OPTIONS = "Qbb Q5"
"""As scipy's, without the point at infinity (Qz), which only points on one circle need, without leave to
return doubtful facets (Q12), without the list of points left out (Qc): their cells have no mass; and
without widening the facets for printing (Q5)."""

_ROUNDING = 4e-15
"""Bound, in radians, on what rounding adds to the sum of two angles. Within it either diagonal will do:
the Voronoi edge between the two cells has no length."""

_MOST_TURNED = 18
"""Edges, three to a triangle, that see a triangle turned over. Flips right most such triangles, but not
all: where there are more than these, Qhull will probably be needed."""

_PATIENCE = 8
"""Flips for each robot after which none of it makes sense; a team on one circle needs two."""


@dataclass(frozen=True, slots=True, eq=False)
class Triangulation:
    """Which robots and sentinels an edge joins, and which see it; no places.

    There is one order only: two triangulations with the same edges are the same arrays. What is
    computed from them is then the same to the last bit, by whatever flips they came about.

    Attributes
    ----------
    ends : (2, 3 n)
        The ends of each edge, the lower number first. Ascending by the second, then the first; so edges
        among robots, numbers 0 to n - 1, come before those to sentinels, numbers n to n + 2.
    apexes : (2, 3 n)
        The third corners of the triangles to the left and to the right of the edge.
    """

    ends: IntArray
    apexes: IntArray

    @classmethod
    def ordered(cls, ends: IntArray, apexes: IntArray) -> Triangulation:
        """Return the triangulation of these edges; in each column of `ends` the lower number is first."""
        order = _keys(ends).argsort()
        columns = ends.take(order, axis=1), apexes.take(order, axis=1)
        for each in columns:
            each.setflags(write=False)
        return cls(*columns)

    @property
    def robots(self) -> int:
        """Their number, n."""
        return int(self.ends.shape[1]) // 3


class Fitted(NamedTuple):
    """A Delaunay triangulation at its places.

    Attributes
    ----------
    triangulation : Triangulation
    places : (2, 3 n) m
        Of the ends of the edges.
    angles : (2, 3 n) m²
        At the apexes: |a| |b| times the cosine, and the sine.
    """

    triangulation: Triangulation
    places: ComplexArray
    angles: ComplexArray


def triangulated(points: ComplexArray, warm: Triangulation | None = None) -> Fitted | None:
    """Return the Delaunay triangulation of robots and sentinels; None where rounding decides too much.

    Parameters
    ----------
    points : (n + 3,) m
        The robots within the triangle of the sentinels, which are last and counter-clockwise.
    warm : Triangulation or None
        What may be nearly right. It changes how long this takes, not what comes out; among cocircular
        points, where there is a choice, it makes the choice.
    """
    robots = points.size - SENTINELS
    if warm is not None and warm.robots == robots:
        fitted = _mended(warm, points)
        if fitted is not None:
            return fitted
    cold = _by_qhull(points)
    # Qhull decides between the nearly cocircular at random, within a tolerance of its own that is larger
    return None if cold is None else _mended(cold, points)


def _mended(triangulation: Triangulation, points: ComplexArray) -> Fitted | None:
    """Return the triangulation after the flips that make it Delaunay; None when too much is wrong."""
    places = points.take(triangulation.ends)
    angles = _angles(places, points.take(triangulation.apexes))
    turned = np.count_nonzero(angles.imag <= 0.0)
    wrong = _not_delaunay(angles)
    if not wrong.size:
        return Fitted(triangulation, places, angles) if not turned else None
    if turned > _MOST_TURNED:
        return None

    ends, apexes = triangulation.ends.copy(), triangulation.apexes.copy()
    patience = _PATIENCE * triangulation.robots
    while wrong.size:
        patience -= wrong.size
        changed = _flip(ends, apexes, wrong)
        if changed is None or patience < 0:
            return None
        places = points.take(ends.take(changed, axis=1))
        angles = _angles(places, points.take(apexes.take(changed, axis=1)))
        wrong = changed[_not_delaunay(angles)]
    return _mended(Triangulation.ordered(ends, apexes), points)


def _angles(places: ComplexArray, apexes: ComplexArray) -> ComplexArray:
    """Return the angles at the apexes, (2, e) m²; overwrites `apexes`."""
    first = places - apexes
    second = np.subtract(places[::-1], apexes, out=apexes)
    np.conjugate(first, out=first)
    first *= second
    return first


def _not_delaunay(angles: ComplexArray) -> IntArray:
    """Return the edges, ascending, whose opposite angles sum to more than pi by more than rounding.

    That one angle belongs to a triangle turned over, and counts more than pi by itself, is included.
    """
    sums = angles[0] * angles[1]
    wrong: IntArray = (sums.imag < 0.0).nonzero()[0]
    if wrong.size:
        sums = sums[wrong]
        wrong = wrong[sums.imag < -_ROUNDING * np.abs(sums)]
    return wrong


def _flip(ends: IntArray, apexes: IntArray, edges: IntArray) -> IntArray | None:
    """Replace edges by the other diagonals of their two triangles, in place.

    Of edges that share a triangle not all are replaced, but always the first.

    Returns
    -------
    IntArray or None
        The edges to be looked at again, ascending: all of `edges`, and those beside the replaced ones.
        None when two robots have got two edges, or two sentinels one: this leads nowhere.
    """
    keys = _keys(ends)
    order = keys.argsort(kind="stable")
    keys = keys.take(order)
    if np.count_nonzero(keys[1:] == keys[:-1]):
        return None
    # the quadrilaterals are i, right, j, left; beside them lie i left, j left, i right, j right
    near = np.concatenate([ends.take(edges, axis=1)] * 2)
    far = apexes.take(edges, axis=1).repeat(2, axis=0)
    sought = _keys(np.stack([np.minimum(near, far), np.maximum(near, far)]))
    place = np.minimum(keys.searchsorted(sought), keys.size - 1)
    beside = order.take(place)
    # what is not there joins two sentinels
    stored = keys.take(place) == sought

    marked = np.zeros(keys.size, dtype=np.bool_)
    marked[edges] = True
    waiting = (marked.take(beside) & stored & (beside < edges)).any(axis=0)
    if np.count_nonzero(waiting):
        edges, near, far = edges[~waiting], near[:, ~waiting], far[:, ~waiting]
        beside, stored = beside[:, ~waiting], stored[:, ~waiting]

    # the triangle beside has lost the corner across the old diagonal, and has the opposite apex instead
    lost, gained, column = near[[1, 0, 1, 0]][stored], far[[2, 2, 0, 0]][stored], beside[stored]
    apexes[(apexes[0, column] != lost).astype(np.intp), column] = gained
    # seen from the left apex towards the right one, j lies on the left
    i, j, left, right = near[0], near[1], far[0], far[2]
    if np.maximum.reduce(np.minimum(left, right)) >= keys.size // 3:
        return None
    up = left < right
    ends[:, edges] = np.where(up, (left, right), (right, left))
    apexes[:, edges] = np.where(up, (j, i), (i, j))
    marked[column] = True
    return marked.nonzero()[0]


def _keys(ends: IntArray) -> IntArray:
    """Return a number for each pair that is its alone; it grows with the second, then with the first."""
    return np.asarray(ends[1] * ends[1] + ends[0])


def _by_qhull(points: ComplexArray) -> Triangulation | None:
    """Return Qhull's triangulation; None when it left points out, or none of it is left over."""
    robots = points.size - SENTINELS
    try:
        found = Delaunay(points.view(np.float64).reshape(-1, 2), qhull_options=_QHULL_OPTIONS)
    except (QhullError, ValueError):
        return None
    simplices, neighbours = found.simplices, found.neighbors
    if len(simplices) != 2 * robots + 1:
        return None
    # Scipy's triangles turn left, and neighbour k lies beyond the edge opposite corner k. Of the two
    # half-edges of an edge the one in the triangle of lower number; none where there is no other (-1)
    table, triangle = _half_edge_tables(robots)
    half = (neighbours > triangle).ravel().nonzero()[0]
    if half.size != 3 * robots:
        return None
    corners = simplices.astype(np.intp)
    flat = corners.ravel()
    ends = flat.take(table.take(half, axis=1))
    total = corners[:, 0] + corners[:, 1]
    total += corners[:, 2]
    apexes = np.empty_like(ends)
    flat.take(half, out=apexes[0], mode="clip")
    np.subtract(total.take(neighbours.ravel().take(half)), ends[0] + ends[1], out=apexes[1])
    turned = ends[0] > ends[1]
    return Triangulation.ordered(np.where(turned, ends[::-1], ends), np.where(turned, apexes[::-1], apexes))


@lru_cache(maxsize=8)
def _half_edge_tables(robots: int) -> tuple[IntArray, IntArray]:
    """Return, for the half-edge opposite corner k of triangle t, number 3 t + k, its ends and its triangle.

    The ends are numbers of corners, (2, 6 n + 3): the next and the last corner counter-clockwise. The
    triangles are numbered down the rows, (2 n + 1, 1).
    """
    corner = np.arange(6 * robots + 3)
    triangle = corner // 3 * 3
    ends = np.stack([triangle + (corner + 1) % 3, triangle + (corner + 2) % 3])
    return ends, np.arange(2 * robots + 1)[:, None]
