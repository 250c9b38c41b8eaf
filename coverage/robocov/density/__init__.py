"""The density φ: how important each point of the region is, and its integrals over cells.

- `base`: the interface of densities, and the uniform one
- `gaussians`, `polygons`, `raster`: sums of Gaussians, weighted areas, and images
- `cell_edges`: cells as edges, over which densities are integrated
- `polygon_masses`: integrals over other polygons

Each density is integrated over all Voronoi cells at once, in closed form or by an exact quadrature. By
the divergence theorem an integral over a cell is a sum over its edges, so that no cell is ever clipped.
"""

from robocov.density.base import MAX_WEIGHT, Density, Uniform
from robocov.density.gaussians import Gaussian, Gaussians
from robocov.density.polygons import WeightedArea, WeightedPolygons
from robocov.density.raster import MAX_RASTER_SIZE, Interpolation, Raster, sample_density

__all__ = [
    "MAX_RASTER_SIZE",
    "MAX_WEIGHT",
    "Density",
    "Gaussian",
    "Gaussians",
    "Interpolation",
    "Raster",
    "Uniform",
    "WeightedArea",
    "WeightedPolygons",
    "sample_density",
]
