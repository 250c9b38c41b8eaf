"""Who hears whom, and who is close to whom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from robocov.arrays import Array, BoolArray, IntArray

_BRUTE_FORCE_BELOW = 48
"""Teams smaller than this find close pairs by all distances: cheaper than a tree."""


@dataclass(frozen=True, slots=True, eq=False)
class Neighbours:
    """Who hears whom: compressed rows, or the complete graph without its n² entries.

    Attributes
    ----------
    count : int
        Number of robots n.
    ranges : (n,) m or None
        Communication ranges; None when everybody hears everybody, whatever the distance.
    indptr : (n + 1,) and indices : (m,), or None for the complete graph
        ``indices[indptr[i]:indptr[i + 1]]``, ascending, are the robots that i hears.
    """

    count: int
    ranges: Array | None = None
    indptr: IntArray | None = None
    indices: IntArray | None = None

    @classmethod
    def within(cls, positions: Array, ranges: Array) -> Neighbours:
        """Link the robots that are in range of each other.

        Parameters
        ----------
        positions : (n, 2) m
        ranges : (n,) m
            Two robots are linked when their distance is at most the smaller of their ranges.
            When all are infinite the graph is complete and is not stored.
        """
        n = len(positions)
        if np.isinf(ranges).all():
            return cls(n)
        first, second, distance = close_pairs(positions, float(min(ranges.max(), 1e12)))
        linked = distance <= np.minimum(ranges[first], ranges[second])
        return cls.of_pairs(n, first[linked], second[linked], ranges)

    @classmethod
    def of_pairs(
        cls, count: int, robot: IntArray, neighbour: IntArray, ranges: Array | None = None
    ) -> Neighbours:
        """Return who hears whom from the directed pairs, sorted by robot, then neighbour."""
        indptr = np.zeros(count + 1, dtype=np.intp)
        np.cumsum(np.bincount(robot, minlength=count), out=indptr[1:])
        return cls(count, ranges, indptr, neighbour)

    @property
    def complete(self) -> bool:
        """Whether everybody hears everybody whatever the distance."""
        return self.indptr is None

    def of(self, robot: int) -> IntArray:
        """Return the robots that `robot` hears, ascending."""
        if self.indptr is None or self.indices is None:
            return np.delete(np.arange(self.count), robot)
        return self.indices[self.indptr[robot] : self.indptr[robot + 1]]

    def row(self, robot: int) -> slice:
        """Return where in `indices` the robots are that `robot` hears; not of the complete graph."""
        assert self.indptr is not None
        return slice(int(self.indptr[robot]), int(self.indptr[robot + 1]))

    def pairs(self) -> tuple[IntArray, IntArray]:
        """Return all directed pairs (robot, neighbour), (m,) each, in the order of the rows."""
        if self.indptr is None or self.indices is None:
            others = ~np.eye(self.count, dtype=bool)
            robot, neighbour = np.nonzero(others)
            return robot, neighbour
        return np.repeat(np.arange(self.count), np.diff(self.indptr)), self.indices

    def among(self, working: BoolArray) -> Neighbours:
        """Return who of the robots that work hears whom; the others neither hear nor are heard.

        Parameters
        ----------
        working : (n,) bool
        """
        if working.all():
            return self
        first, second = self.pairs()
        both = working[first] & working[second]
        return Neighbours.of_pairs(self.count, first[both], second[both], self.ranges)

    def closer_than(self, positions: Array, reach: float) -> tuple[IntArray, IntArray, Array]:
        """Return the directed pairs of neighbours at most `reach` metres apart.

        Returns
        -------
        robot : (m,), neighbour : (m,)
            Sorted by robot, then neighbour: sums over a row are then the same to the last bit
            whatever robots that this one cannot hear do.
        distance : (m,) m
        """
        if self.indptr is None or self.indices is None:
            return close_pairs(positions, reach)
        first = np.repeat(np.arange(self.count), np.diff(self.indptr))
        second = self.indices
        distance = _distances(positions, first, second)
        near = distance <= reach
        return first[near], second[near], distance[near]


def close_pairs(positions: Array, reach: float) -> tuple[IntArray, IntArray, Array]:
    """Return the directed pairs of points at most `reach` apart, sorted, with their distances.

    >>> close_pairs(np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]]), 2.0)
    (array([0, 1]), array([1, 0]), array([1., 1.]))
    """
    n = len(positions)
    if n < _BRUTE_FORCE_BELOW:
        delta = positions[:, None, :] - positions[None, :, :]
        square = delta[..., 0] ** 2 + delta[..., 1] ** 2
        square[np.arange(n), np.arange(n)] = np.inf
        first, second = np.nonzero(square <= reach * reach)
        return first, second, np.sqrt(square[first, second])
    # asked only once, the tree need be neither balanced nor tight
    tree = cKDTree(positions, balanced_tree=False, compact_nodes=False)
    pairs = tree.query_pairs(reach, output_type="ndarray")
    first = np.concatenate([pairs[:, 0], pairs[:, 1]]).astype(np.intp, copy=False)
    second = np.concatenate([pairs[:, 1], pairs[:, 0]]).astype(np.intp, copy=False)
    order = np.argsort(first * n + second)
    first, second = first[order], second[order]
    return first, second, _distances(positions, first, second)


def _distances(positions: Array, first: IntArray, second: IntArray) -> Array:
    delta = positions[first] - positions[second]
    return np.sqrt(delta[:, 0] ** 2 + delta[:, 1] ** 2)
