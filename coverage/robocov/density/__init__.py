"""The density φ: how important each point of the region is, and its integrals over cells.

- `base`: the interface of all densities, and the uniform density
- `gaussians`, `polygons`, `raster`: sums of Gaussians, areas of constant weight, and images
- `cell_edges`: the edges of cells, over which densities are integrated
- `polygon_masses`: integrals over polygons that are not cells

Each density is integrated over all Voronoi cells at the same time, in closed form or by an exact quadrature.
By the divergence theorem, the integral over a cell is a sum over the edges of the cell. Therefore, no cell is
ever intersected with the areas or pixels of a density.
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
