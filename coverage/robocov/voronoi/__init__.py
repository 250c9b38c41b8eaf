"""Voronoi cells of a convex region: of the nearest robot, of the one there first, of those in range."""

from __future__ import annotations

from robocov.voronoi.bounded_cells import VoronoiPartition, partition

__all__ = ["VoronoiPartition", "partition"]
