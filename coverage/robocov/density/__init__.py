"""The density φ: how much each place of the region counts, and its integrals over cells.

Every density integrates over all Voronoi cells at once, in closed form or exactly by quadrature: by the
divergence theorem an integral over a cell is a sum over its edges, so that no cell is ever clipped.
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
