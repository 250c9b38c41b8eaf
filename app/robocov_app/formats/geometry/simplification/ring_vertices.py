"""The vertices of many rings in flat arrays, so that a whole outline is processed at once."""

from functools import cached_property

import numpy as np
import shapely

from robocov.arrays import concatenate_ranges, find_run_starts
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.formats.geometry.vectors import compute_cross

_EXTREME_DIGITS = 6
"""Decimals of relative distances, so that rounding errors do not decide between equidistant vertices."""


class RingVertices:
    """The vertices of the rings of polygons, ring after ring, without repeating the first of each ring.

    Parameters
    ----------
    points : (k, 2) array, m
    starts : (r,) array of int
        Index of the first vertex of each ring; no ring is empty.
    source : (k,) array
        Index of each vertex in the original outline. An index plus one half stands for the midpoint of the
        side after that vertex. Along a ring the values increase, except for one step back to the lowest.

    Attributes
    ----------
    vertex : (k,) array of int
        ``source`` rounded down.
    size : (r,) array of int
        Number of vertices of each ring.
    ring : (k,) array of int
        Ring of each vertex.
    after, before : (k,) arrays of int
        Next and previous vertex along the ring.
    """

    def __init__(self, points: FloatArray, starts: IntArray, source: FloatArray) -> None:
        self.points = points
        self.starts = starts
        self.source = source
        self.vertex = source.astype(np.intp)
        self.size = np.diff(starts, append=len(points))
        self.ring = np.arange(len(starts)).repeat(self.size)
        self.after = np.arange(1, len(points) + 1)
        self.after[starts + self.size - 1] = starts
        self.before = np.argsort(self.after)  # the inverse permutation

    @cached_property
    def areas(self) -> FloatArray:
        """Signed area of each ring, (r,) m²; positive if counter-clockwise."""
        local = self.points - self.points[self.starts].repeat(self.size, axis=0)
        total = np.append(0.0, np.cumsum(compute_cross(local, local[self.after])))
        return np.asarray((total[self.starts + self.size] - total[self.starts]) / 2)

    @cached_property
    def sides(self) -> FloatArray:
        """Vectors from each vertex to the next one, (k, 2) m."""
        return np.asarray(self.points[self.after] - self.points)

    @cached_property
    def lengths(self) -> FloatArray:
        """Lengths of the sides, (k,) m."""
        return np.asarray(np.hypot(*self.sides.T))

    @property
    def endpoints(self) -> FloatArray:
        """Start and end of each side, (k, 2, 2) m."""
        return np.stack([self.points, self.points[self.after]], axis=1)

    def find_extremes(self) -> BoolArray:
        """Return a mask, (k,), of two vertices of each ring that are far from each other.

        The first is the farthest from the mean of the vertices, the second the farthest from the first.
        """
        reference = np.add.reduceat(self.points, self.starts, axis=0) / self.size[:, None]
        is_extreme = np.zeros(len(self.points), dtype=bool)
        for _ in range(2):
            distance = np.hypot(*(self.points - reference[self.ring]).T)
            relative = np.round(distance / distance.max(), _EXTREME_DIGITS)
            farthest = np.lexsort((-relative, self.ring))[self.starts]
            is_extreme[farthest] = True
            reference = self.points[farthest]
        return is_extreme

    def simplify(
        self, tolerance: FloatArray, is_fixed: BoolArray, max_tolerance: FloatArray
    ) -> tuple[IntArray, IntArray]:
        """Drop vertices between fixed ones, by the algorithm of Douglas and Peucker.

        Parameters
        ----------
        tolerance : (k,) array, m
            Tolerance at each vertex. Where it changes along a ring, the vertices on both sides are fixed.
        is_fixed : (k,) array of bool
            Vertices that are kept, at least one in each ring.
        max_tolerance : (r,) array, m
            Upper limit of the tolerance in each ring.

        Returns
        -------
        kept : (m,) array of int
            Indices of the remaining vertices, ring after ring.
        starts : (r,) array of int
            First remaining vertex of each ring.
        """
        changes = tolerance != tolerance[self.after]
        is_fixed = is_fixed | changes
        is_fixed[self.after[changes]] = True
        vertex, line = self._split_at(is_fixed)
        # Between its ends, a line has a single tolerance.
        second = vertex[find_run_starts(line) + 1]
        line_tolerance = np.minimum(tolerance[second], max_tolerance[self.ring[second]])
        # GEOS preserves the third coordinate, which here is the index of the vertex.
        lines = shapely.linestrings(np.column_stack([self.points[vertex], vertex]), indices=line)
        simple = shapely.simplify(lines, line_tolerance, preserve_topology=False)
        coordinates, line = shapely.get_coordinates(simple, include_z=True, return_index=True)
        is_inner = np.append(line[1:] == line[:-1], False)
        kept = coordinates[is_inner, 2].astype(np.intp)
        return kept, np.searchsorted(self.ring[kept], np.arange(len(self.starts)))

    def _split_at(self, is_fixed: BoolArray) -> tuple[IntArray, IntArray]:
        """Split each ring into lines from one fixed vertex to the next.

        Two arrays are returned: the index of each vertex along the lines, and the number of its line.
        """
        size = self.size
        index = np.arange(len(is_fixed))
        # Each ring is traversed from its first fixed vertex back to that vertex.
        first = np.minimum.reduceat(np.where(is_fixed, index, len(is_fixed)), self.starts)
        ring = np.arange(len(self.starts)).repeat(size + 1)
        step = concatenate_ranges(np.zeros_like(size), size + 1)
        vertex = self.starts[ring] + (first[ring] - self.starts[ring] + step) % size[ring]
        is_inner = is_fixed[vertex] & (step > 0) & (step < size[ring])
        # A fixed vertex ends one line and starts the next. It occurs twice, first in the line that it ends.
        doubled = np.arange(len(vertex)).repeat(1 + is_inner)
        line = (np.cumsum(is_inner | (step == 0)) - 1)[doubled]
        line[:-1] -= doubled[:-1] == doubled[1:]
        return vertex[doubled], line
