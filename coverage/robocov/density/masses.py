"""Integrals of a density over what is no Voronoi cell: polygons with holes, the squares of a lattice."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.voronoi.cell_edges import REGION, CellEdges

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Polygon

    from robocov.density.base import Density

_AT_ONCE = 1 << 16
"""Squares that are looked at at once, which bounds the memory."""


def masses_of_polygons(density: Density, polygons: Sequence[Polygon]) -> Array:
    """Return the integral of φ over each of some valid polygons, (k,) m², their holes left out."""
    starts, ends, owners, origins = [], [], [], np.zeros((len(polygons), 2))
    for k, polygon in enumerate(polygons):
        polygon = shapely.orient_polygons(polygon)
        origins[k] = polygon.centroid.coords[0]
        for ring in (polygon.exterior, *polygon.interiors):
            points = shapely.get_coordinates(ring) - origins[k]
            starts.append(points[:-1])
            ends.append(points[1:])
            owners.append(np.full(len(points) - 1, k))
    if not starts:
        return np.zeros(0)
    edges = _edges(np.concatenate(starts), np.concatenate(ends), np.concatenate(owners))
    return np.maximum(density.moments(edges, origins).mass, 0.0)


def means_over_squares(density: Density, middles: Array, side: float) -> Array:
    """Return the mean of φ over axis-parallel squares, (k,), from their middles, (k, 2) m."""
    corners = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    means = np.empty(len(middles))
    for k in range(0, len(middles), _AT_ONCE):
        some = middles[k : k + _AT_ONCE]
        count = len(some)
        start, end = np.tile(corners, (count, 1)), np.tile(np.roll(corners, -1, axis=0), (count, 1))
        edges = _edges(start, end, np.repeat(np.arange(count), 4))
        means[k : k + count] = density.moments(edges, some).mass
    # what rounding makes of nothing
    return np.clip(means / (side * side), density.lowest, density.highest)


def _edges(start: Array, end: Array, cell: Array) -> CellEdges:
    owner = cell.astype(np.intp, copy=False)
    return CellEdges(start, end, owner, np.full(len(owner), REGION))
