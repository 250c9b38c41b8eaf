"""The nearest robot of every site of a lattice, row by row: along a row each robot's sites are one run."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import Delaunay, QhullError

from robocov.arrays.grouping import beginnings, sizes

if TYPE_CHECKING:
    from robocov.arrays import Array, BoolArray, IntArray

_FEW = 8
"""Robots up to which each is compared with all others; more are triangulated first."""

_FLAT = 1e-6
"""How little a lifted triangle may face down for the place of its circumcentre to be trusted."""

_PAIRS = 1 << 18
"""Pairs of sites and robots looked at in one piece, which bounds the memory."""


class Runs(NamedTuple):
    """Runs of sites of one row with the same nearest robot, in the order of the sites.

    Attributes
    ----------
    robot : (r,)
    begin : (r,)
        The first site of the run.
    length : (r,)
        How many sites, at least one.
    """

    robot: IntArray
    begin: IntArray
    length: IntArray


class Scanlines:
    """The rows of a square lattice of which some cells are sites.

    Parameters
    ----------
    column_x, row_y : (n,)
        Coordinates, evenly spaced but for rounding.
    free : (n, n)
        Which cells, by row and column, are sites. The sites are numbered row by row.
    """

    def __init__(self, column_x: Array, row_y: Array, free: BoolArray) -> None:
        self._x, self._y, self._free = column_x, row_y, free
        self._side = len(column_x)
        self._step = (column_x[-1] - column_x[0]) / (self._side - 1) if self._side > 1 else 1.0
        self._before = np.zeros(self._side**2 + 1, dtype=np.intp)
        np.cumsum(free.ravel(), out=self._before[1:])

    def nearest(self, x: Array, y: Array) -> Runs:
        """Return the runs of sites nearest to each of (n,) robots; of equals, to rounding, any one.

        Of those that coincide it is the first.
        """
        if len(x) == 1:
            return self._runs(np.zeros(self._side, dtype=np.intp), np.arange(self._side) * self._side)
        neighbours = _neighbours(x, y)
        if neighbours is None:
            place, first = np.unique(np.column_stack([x, y]), axis=0, return_index=True)
            if len(first) == len(x):
                return self._compared(x, y)
            runs = self.nearest(*place.T)
            return runs._replace(robot=first[runs.robot])
        others, low, high = neighbours
        robot, row = self._crossed(low, high)
        left, right = self._between(x, y, others, robot, row)
        some = (left <= right).nonzero()[0]
        return self._filled(x, y, robot[some], row[some], left[some], right[some])

    def _crossed(self, low: Array, high: Array) -> tuple[IntArray, IntArray]:
        """Return pairs of a robot and a row that its cell, from `low` to `high`, may cross."""
        last = self._side - 1
        # a row to spare on either side makes up for rounding
        bottom = np.clip(np.floor((low - self._y[0]) / self._step) - 1, 0, last + 1).astype(np.intp)
        top = np.clip(np.ceil((high - self._y[0]) / self._step) + 1, -1, last).astype(np.intp)
        count = np.maximum(top - bottom + 1, 0)
        robot = np.arange(len(low)).repeat(count)
        return robot, np.arange(len(robot)) + (bottom - count.cumsum() + count).repeat(count)

    def _between(
        self, x: Array, y: Array, others: IntArray, robot: IntArray, row: IntArray
    ) -> tuple[IntArray, IntArray]:
        """Return the first and the last column of each robot in each row, from its neighbours' bisectors."""
        dx, dy = x[others] - x, y[others] - y
        # the bisector is at column (level - dy row) / dx; where dx = 0, all of a row is on one side,
        # or (nan) as near to one as to the other
        level = (0.5 * (x[others] + x) - self._x[0]) * dx + (0.5 * (y[others] + y) - self._y[0]) * dy
        dx = dx.take(robot, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            column = ((level / self._step).take(robot, axis=1) - dy.take(robot, axis=1) * row) / dx
        rightward = dx >= 0.0
        left = np.fmax.reduce(np.where(rightward, -np.inf, column), axis=0)
        right = np.fmin.reduce(np.where(rightward, column, np.inf), axis=0)
        last = self._side - 1
        left = np.ceil(np.fmin(np.fmax(left, 0.0), last + 1.0)).astype(np.intp)
        # what is as near to the robot on the right is left to that one
        right = np.ceil(np.fmax(np.fmin(right, last + 1.0), 0.0)).astype(np.intp) - 1
        return left, right

    def _filled(
        self, x: Array, y: Array, robot: IntArray, row: IntArray, left: IntArray, right: IntArray
    ) -> Runs:
        """Return the runs that begin at `left` in each row and end where the next one begins.

        So a gap or an overlap between neighbours, of a hair by rounding, does no harm.
        """
        cell = row * self._side + left
        mark = np.full(self._side**2, -1, dtype=np.intp)
        mark[cell] = robot
        if (mark[cell] != robot).any():
            # of several that begin at one site the longest is meant, the others are there by rounding;
            # of those that coincide the first
            order = np.lexsort((-robot, right))
            mark[cell[order]] = robot[order]
        begins = mark[:: self._side]
        for k in (begins < 0).nonzero()[0]:
            begins[k] = np.argmin((x - self._x[0]) ** 2 + (y - self._y[k]) ** 2)
        cell = (mark >= 0).nonzero()[0]
        return self._runs(mark[cell], cell)

    def _runs(self, robot: IntArray, cell: IntArray) -> Runs:
        """Return the runs that begin at these cells, among which are the first of all rows."""
        begin = self._before[cell]
        length = sizes(begin, int(self._before[-1]))
        some = np.nonzero(length)[0]
        return Runs(robot[some], begin[some], length[some])

    def _compared(self, x: Array, y: Array) -> Runs:
        """Return the same by looking at all pairs of a site and a robot."""
        row, column = np.nonzero(self._free)
        robot = np.empty(len(row), dtype=np.intp)
        piece = max(1, _PAIRS // len(x))
        for start in range(0, len(row), piece):
            part = slice(start, start + piece)
            dx, dy = self._x[column[part], None] - x, self._y[row[part], None] - y
            robot[part] = (dx * dx + dy * dy).argmin(axis=1)
        begin = beginnings(row * len(x) + robot)
        return Runs(robot[begin], begin, sizes(begin, len(robot)))


def _neighbours(x: Array, y: Array) -> tuple[IntArray, Array, Array] | None:
    """Return the robots whose Voronoi cells may touch, None where Qhull does not place them all.

    Returns
    -------
    others : (d, n)
        The neighbours of each robot, some more than once.
    low, high : (n,)
        Its cell is not below nor above these.
    """
    count = len(x)
    if count <= _FEW:
        others = (np.arange(count) + np.arange(1, count)[:, None]) % count
        everywhere = np.full(count, np.inf)
        return others, -everywhere, everywhere
    try:
        triangulation = Delaunay(np.column_stack([x, y]))
    except QhullError:  # all on one line
        return None
    if len(triangulation.coplanar):  # some coincide
        return None
    first, other = triangulation.vertex_neighbor_vertices
    degree = np.diff(first)
    others = other[first[:-1] + np.minimum(np.arange(degree.max())[:, None], degree - 1)]
    low, high = _extent(x, y, triangulation)
    return others, low, high


def _extent(x: Array, y: Array, triangulation: Delaunay) -> tuple[Array, Array]:
    """Return bounds of the cells' y, up to rounding: the centres of the triangles around each robot."""
    # a circumcentre is where the plane through the triangle, lifted onto a paraboloid, is as steep as it
    _, normal_y, normal_z, _ = triangulation.equations.T
    flat = np.abs(normal_z) < _FLAT
    centre = -0.5 / triangulation.paraboloid_scale * normal_y / np.where(flat, 1.0, normal_z)
    low, high = np.full(len(x), np.inf), np.full(len(x), -np.inf)
    bottom, top = np.where(flat, -np.inf, centre), np.where(flat, np.inf, centre)
    for corner in triangulation.simplices.T:
        np.minimum.at(low, corner, bottom)
        np.maximum.at(high, corner, top)
    # without end to the side of the team that a robot is on
    one, two = hull = triangulation.convex_hull.T
    ux, uy = x[two] - x[one], y[two] - y[one]
    inner = triangulation.simplices[0]
    rightward = ux * (y[inner].sum() / 3.0 - y[one]) > uy * (x[inner].sum() / 3.0 - x[one])
    upward = np.where(rightward, -ux, ux)
    low[hull[:, upward <= 0.0]] = -np.inf
    high[hull[:, upward >= 0.0]] = np.inf
    return low, high
