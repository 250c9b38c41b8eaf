"""Densities of every kind, and a slow way to integrate them."""

from __future__ import annotations

import numpy as np
import shapely

from robocov.density import (
    Density,
    Gaussian,
    Gaussians,
    Raster,
    Uniform,
    WeightedArea,
    WeightedPolygons,
)
from robocov.typing import FloatArray

GAUSSIANS = {
    "one": Gaussians((Gaussian((3.0, 3.0), 2.0, sigma=1.0),), 0.1),
    "two": Gaussians(
        (
            Gaussian((3.0, 3.0), 2.0, sigma=1.0),
            Gaussian((7.0, 5.0), 5.0, covariance=((1.0, 0.6), (0.6, 0.7))),
        ),
        0.2,
    ),
    "no floor": Gaussians((Gaussian((5.0, 4.0), 2.0, sigma=3.0),)),
}
POLYGONS = {
    "rooms": WeightedPolygons(
        (
            WeightedArea(
                ((2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0)),
                4.0,
                holes=(((3.0, 3.0), (4.0, 3.0), (4.0, 4.0)),),
            ),
            WeightedArea(((5.0, 5.0), (9.0, 4.0), (8.0, 7.0)), 0.3),
        ),
        1.0,
    )
}
_PICTURE = np.random.default_rng(0).uniform(0.1, 3.0, (11, 13))
RASTERS = {
    "bilinear": Raster(_PICTURE, (0.0, 0.0, 11.0, 9.0)),
    "cells": Raster(_PICTURE, (1.0, 1.0, 8.0, 7.0), "cells"),
}
KINDS: dict[str, Density] = {"uniform": Uniform(2.5), **GAUSSIANS, **POLYGONS, **RASTERS}


def integrate_on_fine_lattice(
    density: Density, ring: FloatArray, origin: FloatArray, side: int = 300
) -> tuple[float, FloatArray, float]:
    """Return mass, centroid and polar moment about a point of a cell, by sums over a fine lattice."""
    low = ring.min(axis=0)
    high = ring.max(axis=0)
    step = (high - low) / side
    x = low[0] + (np.arange(side) + 0.5) * step[0]
    y = low[1] + (np.arange(side) + 0.5) * step[1]
    points = np.column_stack([np.tile(x, side), np.repeat(y, side)])
    polygon = shapely.Polygon(ring)
    points = points[shapely.contains_xy(polygon, *points.T)]
    weights = density.evaluate(points)
    # The difference between the lattice and the area of the cell is spread evenly.
    weights = weights * (polygon.area / len(points))
    offset = points - origin
    mass = float(weights.sum())
    return mass, origin + weights @ offset / mass, float(weights @ np.square(offset).sum(axis=1))
