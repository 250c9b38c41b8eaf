"""Communication graph and near pairs of a team."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel

NO_INDICES: IntArray = np.empty(0, dtype=np.intp)

_BINNED_FROM = 24
"""Points fewer than this are compared with each other, without bins."""


@dataclass(frozen=True, slots=True, eq=False)
class Neighbours:
    """Communication graph: compressed rows, or the complete graph without its n² entries."""

    count: int
    """Number of robots n."""
    ranges: Array | None = None
    """(n,) m, communication ranges; None when everybody hears everybody, whatever the distance."""
    indptr: IntArray | None = None
    """(n + 1,) ``indices[indptr[i]:indptr[i + 1]]``, ascending, are the robots that i hears; None where"""
    indices: IntArray | None = None
    """(m,) the graph is complete."""

    @classmethod
    def from_ranges(cls, positions: Array, ranges: Array) -> Neighbours:
        """Link the robots, at (n, 2) m, whose distance is at most the smaller of their ranges, (n,) m.

        When all are infinite the graph is complete and is not stored.
        """
        if np.isinf(ranges).all():
            return cls(len(positions))
        indptr, _, indices, _ = _pairs(positions, ranges)
        return cls(len(positions), ranges, indptr, indices)

    @classmethod
    def from_pairs(
        cls, count: int, robot: IntArray, neighbour: IntArray, ranges: Array | None = None
    ) -> Neighbours:
        """Return who hears whom from the directed pairs, sorted by robot, then neighbour."""
        indptr = np.zeros(count + 1, dtype=np.intp)
        np.cumsum(np.bincount(robot, minlength=count), out=indptr[1:])
        return cls(count, ranges, indptr, neighbour)

    @classmethod
    def combine(cls, parts: Sequence[Neighbours]) -> Neighbours:
        """Return who hears whom among robots of several runs, in their order: nobody those of another run."""
        if len(parts) == 1:
            return parts[0]
        begins = np.cumsum([0, *(part.count for part in parts)])
        pairs = [np.stack(part.list_pairs()) + begin for part, begin in zip(parts, begins[:-1], strict=True)]
        robot, neighbour = np.concatenate(pairs, axis=1)
        return cls.from_pairs(int(begins[-1]), robot, np.ascontiguousarray(neighbour))

    @property
    def is_complete(self) -> bool:
        """Whether the graph is complete: communication without a limit of range."""
        return self.indptr is None

    def list_neighbours(self, robot: int) -> IntArray:
        """Return the robots that `robot` hears, ascending."""
        if self.indptr is None or self.indices is None:
            return np.delete(np.arange(self.count), robot)
        return self.indices[self.indptr[robot] : self.indptr[robot + 1]]

    def list_pairs(self) -> tuple[IntArray, IntArray]:
        """Return all directed pairs (robot, neighbour), (m,) each, in the order of the rows."""
        if self.indptr is None or self.indices is None:
            robot, neighbour = np.nonzero(~np.eye(self.count, dtype=bool))
            return robot, neighbour
        return np.repeat(np.arange(self.count), np.diff(self.indptr)), self.indices

    def keep_working(self, working: BoolArray) -> Neighbours:
        """Return who of the robots that work, (n,), hears whom; the others neither hear nor are heard."""
        if working.all():
            return self
        first, second = self.list_pairs()
        both = working[first] & working[second]
        return Neighbours.from_pairs(self.count, first[both], second[both], self.ranges)


def find_close_pairs(positions: Array, reach: float) -> tuple[IntArray, IntArray, Array]:
    """Return the directed pairs of points at most `reach` apart, sorted, with their distances.

    >>> find_close_pairs(np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]]), 2.0)
    (array([0, 1]), array([1, 0]), array([1., 1.]))
    """
    _, first, second, distance = _pairs(positions, np.full(len(positions), reach))
    return first, second, distance


@kernel
def find_bin(along: float, scale: float) -> int:
    """Return the number of the row, or the column, of bins so far from the first; 0 of no number."""
    return int(along * scale) if along * scale > 0.0 else 0


@kernel
def sort_into_bins(
    points: Array, first: int, stop: int, reach: float, starts: IntArray, order: IntArray
) -> tuple[float, float, float, int, int]:
    """Sort points from `first` on into square bins, row by row, so that those in reach are in the next ones.

    Written are `starts`, (2 (stop - first) + 8,), and `order`, (stop - first,): bin b then holds the points
    ``order[starts[b]:starts[b + 1]]``, ascending. Returns where the bins begin in x and y, bins per metre,
    and the numbers of columns and rows.
    """
    count = stop - first
    left = right = points[first, 0]
    low = high = points[first, 1]
    for i in range(first, stop):
        left, right = min(left, points[i, 0]), max(right, points[i, 0])
        low, high = min(low, points[i, 1]), max(high, points[i, 1])
    width, height = right - left, high - low
    # no more bins than points, and more than rounding wider than the reach
    side = max(1.000001 * reach, np.sqrt(width * height / count), max(width, height) / count)
    scale = 1.0 / side if count >= _BINNED_FROM and 0.0 < side < np.inf else 0.0
    columns, rows = find_bin(width, scale) + 1, find_bin(height, scale) + 1
    for b in range(columns * rows + 2):
        starts[b] = 0
    for i in range(first, stop):
        starts[find_bin(points[i, 1] - low, scale) * columns + find_bin(points[i, 0] - left, scale) + 2] += 1
    for b in range(columns * rows):
        starts[b + 2] += starts[b + 1]
    for i in range(first, stop):
        b = find_bin(points[i, 1] - low, scale) * columns + find_bin(points[i, 0] - left, scale) + 1
        order[starts[b]] = i
        starts[b] += 1
    return left, low, scale, columns, rows


@kernel
def _pairs(points: Array, ranges: Array) -> tuple[IntArray, IntArray, IntArray, Array]:
    """Return rows, first and second points, and distances of the directed pairs in range of each other."""
    n, reach = len(points), 0.0
    for i in range(n):
        reach = max(reach, ranges[i])
    starts, order = np.empty(2 * n + 8, np.intp), np.empty(n, np.intp)
    left, low, scale, columns, rows = 0.0, 0.0, 0.0, 1, 1
    if n:
        left, low, scale, columns, rows = sort_into_bins(points, 0, n, reach, starts, order)
    indptr, total = np.zeros(n + 1, np.intp), 0
    first, second, distance = np.empty(0, np.intp), np.empty(0, np.intp), np.empty(0)
    # they are counted, then written
    for turn in range(2):
        if turn:
            first, second, distance = np.empty(total, np.intp), np.empty(total, np.intp), np.empty(total)
        total = 0
        for i in range(n):
            x, y = points[i, 0], points[i, 1]
            column, row = find_bin(x - left, scale), find_bin(y - low, scale)
            for r in range(max(row - 1, 0), min(row + 2, rows)):
                b = r * columns
                for k in range(starts[b + max(column - 1, 0)], starts[b + min(column + 2, columns)]):
                    j = order[k]
                    dx, dy = points[j, 0] - x, points[j, 1] - y
                    away = np.sqrt(dx * dx + dy * dy)
                    if not away <= min(ranges[i], ranges[j]) or j == i:
                        continue
                    if turn:
                        # sorted in: those of one bin ascend already
                        place = total
                        while place > indptr[i] and second[place - 1] > j:
                            second[place], distance[place] = second[place - 1], distance[place - 1]
                            place -= 1
                        first[total], second[place], distance[place] = i, j, away
                    total += 1
            indptr[i + 1] = total
    return indptr, first, second, distance
