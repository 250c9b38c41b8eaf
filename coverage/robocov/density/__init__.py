"""The density φ: how much each place of the region counts, and its integrals over cells."""

from __future__ import annotations

from robocov.density.kinds import (
    FINEST,
    HEAVIEST,
    Density,
    Gaussian,
    Gaussians,
    Interpolation,
    Raster,
    Uniform,
    WeightedArea,
    WeightedPolygons,
    sampled,
)

__all__ = [
    "FINEST",
    "HEAVIEST",
    "Density",
    "Gaussian",
    "Gaussians",
    "Interpolation",
    "Raster",
    "Uniform",
    "WeightedArea",
    "WeightedPolygons",
    "sampled",
]
