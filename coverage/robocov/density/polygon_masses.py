"""Integrals of a density over polygons that are not cells."""

from collections.abc import Sequence

import numpy as np
import shapely

from robocov.arrays import Array, IntArray
from robocov.density.base import Density
from robocov.density.cell_edges import MASS, REGION, CellEdges

_SQUARES_PER_BATCH = 1 << 16
"""Number of squares that are integrated at the same time, to limit memory."""


def compute_polygon_masses(density: Density, polygons: Sequence[shapely.Polygon]) -> Array:
    """Integrate a density over polygons.

    Parameters
    ----------
    density : Density
    polygons : sequence of k shapely polygons, m
        Valid polygons. Their holes are left out.

    Returns
    -------
    (k,) array, m²

    Examples
    --------
    >>> from robocov import Uniform
    >>> compute_polygon_masses(Uniform(2.0), [shapely.box(0.0, 0.0, 3.0, 1.0)])
    array([6.])
    """
    # Integrate as over cells, whose edges are relative to an origin: here, the centroid of each polygon.
    polygons = shapely.orient_polygons(polygons)
    rings, polygon_of_ring = shapely.get_rings(polygons, return_index=True)
    origins = shapely.get_coordinates(shapely.centroid(polygons))
    points, ring_of_point = shapely.get_coordinates(rings, return_index=True)
    polygon_of_point = polygon_of_ring[ring_of_point]
    points -= origins[polygon_of_point]
    # No edge leads from the last point of a ring to the first point of the next one.
    is_edge = ring_of_point[1:] == ring_of_point[:-1]
    edges = _build_edges(points[:-1][is_edge], points[1:][is_edge], polygon_of_point[:-1][is_edge])
    return np.maximum(density.compute_moments(edges, origins)[:, MASS], 0.0)


def compute_square_means(density: Density, centers: Array, side: float) -> Array:
    """Compute the mean density of axis-parallel squares.

    Parameters
    ----------
    density : Density
    centers : (k, 2) array, m
    side : float, m
        Length of the sides.

    Returns
    -------
    (k,) array
    """
    corners = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    next_corners = np.roll(corners, -1, axis=0)
    masses = np.empty(len(centers))
    for batch_start in range(0, len(centers), _SQUARES_PER_BATCH):
        batch = centers[batch_start : batch_start + _SQUARES_PER_BATCH]
        start = np.tile(corners, (len(batch), 1))
        end = np.tile(next_corners, (len(batch), 1))
        edges = _build_edges(start, end, np.repeat(np.arange(len(batch)), 4))
        masses[batch_start : batch_start + len(batch)] = density.compute_moments(edges, batch)[:, MASS]
    # Rounding must not produce values outside the range of the density, such as negative ones.
    return np.clip(masses / (side * side), density.min_value, density.max_value)


def _build_edges(start: Array, end: Array, cell: IntArray) -> CellEdges:
    """Return edges of polygons without neighbors."""
    other_cell = np.full(len(cell), REGION)
    return CellEdges(start, end, cell.astype(np.intp, copy=False), other_cell)
