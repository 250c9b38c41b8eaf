"""Bounded Voronoi partition."""

from __future__ import annotations

from dataclasses import dataclass

from robocov.arrays import Array
from robocov.observation import Neighbours
from robocov.region import Region


@dataclass(frozen=True, eq=False)
class VoronoiPartition:
    """Placeholder."""

    generators: Array
    mass: Array
    centroid: Array

    @property
    def polygons(self) -> list[Array]:
        """The cells, (k, 2) m each, counter-clockwise."""
        return []


def partition(generators: Array, region: Region, neighbours: Neighbours | None = None) -> VoronoiPartition:
    """Placeholder."""
    raise RuntimeError
