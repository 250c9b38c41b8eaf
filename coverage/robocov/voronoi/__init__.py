"""Voronoi cells of robots within a convex region.

- `bounded_partition`: the cells of equation (1), with their masses and centroids (2)
- `weighted_cells`: cells by travel time, of robots of different speeds
- `disc_limited_cells`: the intersections of cells with discs around their generators
- `sampled_cells`: cells as sets of sample points
- `clipped_cells`, `clipping`: cells from clipping the region along the bisectors, one cell after another
- `triangulated_cells`, `delaunay`: cells from a Delaunay triangulation that is reused from step to step
- `boundary_curves`, `arcs`: boundaries that consist of segments and circular arcs

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from robocov.voronoi.bounded_partition import VoronoiPartition, partition
from robocov.voronoi.disc_limited_cells import build_disc_limited_polygons, compute_disc_limited_moments
from robocov.voronoi.weighted_cells import WeightedCells, partition_by_travel_time

__all__ = [
    "VoronoiPartition",
    "WeightedCells",
    "build_disc_limited_polygons",
    "compute_disc_limited_moments",
    "partition",
    "partition_by_travel_time",
]
