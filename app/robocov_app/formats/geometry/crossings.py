"""Limit on the number of crossings of edges, because polygons with millions of crossings take hours."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.errors import MapError
from robocov.typing import FloatArray

MAX_CROSSINGS = 30_000
"""Maximum number of crossings of all edges of a file. A ring of a few kB can cross itself millions of times,
and finding all these points takes minutes and gigabytes."""
_MAX_PAIRWISE_EDGES = 12
"""Up to this number of edges, all pairs are compared, which is faster than a search tree."""
_MAX_SAMPLED_EDGES = 500
"""Number of edges whose crossings are counted for an estimate."""
_EDGES_AT_ONCE = 20
_MAX_COMPARISONS = 400_000
"""Number of pairs of edges after which an estimate ends."""
_MIN_COUNTED_CROSSINGS = 50
"""Number of counted crossings above which an estimate is reliable enough to end early."""


def extract_edges(lines: Iterable[BaseGeometry]) -> FloatArray:
    """Return the start and end of each edge of lines and rings, (n, 2, 2)."""
    points, line = shapely.get_coordinates(lines, return_index=True)
    is_same_line = line[1:] == line[:-1]
    return np.stack([points[:-1][is_same_line], points[1:][is_same_line]], axis=1)


def extract_sides(area: BaseGeometry) -> FloatArray:
    """Return the start and end of each side of polygons, (n, 2, 2)."""
    return extract_edges(shapely.get_rings(shapely.get_parts(area)))


@dataclass
class CrossingCounter:
    """Counts the crossings of the edges in a file; with many edges, the count is an estimate.

    Attributes
    ----------
    source_name : str
        The file, for messages.
    count : float
    """

    source_name: str = "rings"
    count: float = 0.0

    def add(self, lines: Iterable[BaseGeometry]) -> None:
        """Count how often the edges of lines cross; edges that merely touch are not counted.

        Raises
        ------
        MapError
            If the total exceeds `MAX_CROSSINGS`.
        """
        edges = shapely.linestrings(extract_edges(lines))
        if len(edges) <= _MAX_PAIRWISE_EDGES:
            first, second = np.triu_indices(len(edges), 1)
            self.count += float(shapely.crosses(edges[first], edges[second]).sum())
        else:
            self.count += self._estimate(edges)
        if self.count > MAX_CROSSINGS:
            expected = f"expected at most {MAX_CROSSINGS} crossings of lines"
            raise MapError(f"{self.source_name}: {expected}, got about {math.ceil(self.count)}")

    def _estimate(self, edges: FloatArray) -> float:
        """Estimate the number of crossings from a random sample of edges."""
        tree = shapely.STRtree(edges)
        sample = np.random.default_rng(0).permutation(len(edges))[:_MAX_SAMPLED_EDGES]
        crossings = 0
        comparisons = 0
        estimate = 0.0
        for start in range(0, len(sample), _EDGES_AT_ONCE):
            chunk = sample[start : start + _EDGES_AT_ONCE]
            first, second = tree.query(edges[chunk])
            comparisons += len(first)
            crossings += int(shapely.crosses(edges[chunk[first]], edges[second]).sum())
            # Each crossing is found from both of its edges.
            estimate = crossings * len(edges) / (start + len(chunk)) / 2
            is_above = crossings > _MIN_COUNTED_CROSSINGS and self.count + estimate > MAX_CROSSINGS
            if comparisons > _MAX_COMPARISONS or is_above:
                break
        return estimate
