"""Crossings of edges: their number is limited, as polygons with millions of them take hours to compute."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.errors import MapError

MAX_CROSSINGS = 30_000
"""Maximum number of crossings of all edges of a file. A ring of some kB can cross itself millions of times,
and to find all these points takes minutes and gigabytes."""
_MAX_PAIRWISE_EDGES = 12
"""Up to this number of edges, each is compared with each, which is faster than a search tree."""
_MAX_SAMPLED_EDGES = 500
"""Number of edges whose crossings are counted for an estimate."""
_EDGES_AT_ONCE = 20
_MAX_COMPARISONS = 400_000
"""Number of pairs of edges that are compared for an estimate."""
_MIN_COUNTED_CROSSINGS = 50
"""After more crossings, an estimate above the limit is reliable."""


def extract_edges(lines: Iterable[BaseGeometry]) -> Array:
    """Return start and end of each edge of lines and rings, (n, 2, 2)."""
    points, line = shapely.get_coordinates(lines, return_index=True)
    is_same_line = line[1:] == line[:-1]
    return np.stack([points[:-1][is_same_line], points[1:][is_same_line]], axis=1)


def extract_sides(area: BaseGeometry) -> Array:
    """Return start and end of each side of polygons, (n, 2, 2)."""
    return extract_edges(shapely.get_rings(shapely.get_parts(area)))


@dataclass
class CrossingCounter:
    """The number of crossings of edges in a file, an estimate if there are many edges.

    Attributes
    ----------
    where : str
        The file, for messages.
    count : float
    """

    where: str = "rings"
    count: float = 0.0

    def add(self, lines: Iterable[BaseGeometry]) -> None:
        """Count how often the edges of lines cross; edges that only meet do not count.

        Raises
        ------
        MapError
            If there are more than `MAX_CROSSINGS`.
        """
        edges = shapely.linestrings(extract_edges(lines))
        if len(edges) <= _MAX_PAIRWISE_EDGES:
            first, second = np.triu_indices(len(edges), 1)
            self.count += float(shapely.crosses(edges[first], edges[second]).sum())
        else:
            self.count += self._estimate(edges)
        if self.count > MAX_CROSSINGS:
            actual = f"about {self.count:.1g}"
            raise MapError(f"{self.where}: expected at most {MAX_CROSSINGS} crossings of lines, got {actual}")

    def _estimate(self, edges: Array) -> float:
        """Estimate the number of crossings from those of a sample of edges."""
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
            # Each crossing belongs to two edges.
            estimate = crossings * len(edges) / (start + len(chunk)) / 2
            is_above = crossings > _MIN_COUNTED_CROSSINGS and self.count + estimate > MAX_CROSSINGS
            if comparisons > _MAX_COMPARISONS or is_above:
                break
        return estimate
