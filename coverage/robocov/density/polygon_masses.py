"""Integrals of a density over polygons that are not cells."""

from collections.abc import Sequence

import numpy as np
import shapely

from robocov.density.base import Density
from robocov.density.cell_edges import MASS, REGION, CellEdges
from robocov.typing import FloatArray, IntArray

_SQUARES_PER_BATCH = 1 << 16
"""Number of squares that are integrated at the same time, to limit memory."""


def compute_polygon_masses(density: Density, polygons: Sequence[shapely.Polygon]) -> FloatArray:
    """Integrate a density over polygons.

    Parameters
    ----------
    density : Density
        The density.
    polygons : sequence of k shapely polygons, m
        Valid polygons, which may have holes.

    Returns
    -------
    (k,) array, m²
        Integral of the density over each polygon, without its holes.

    Examples
    --------
    >>> from robocov import Uniform
    >>> compute_polygon_masses(Uniform(2.0), [shapely.box(0.0, 0.0, 3.0, 1.0)])
    array([6.])
    """
    # The polygons are treated like cells, whose edges are relative to an origin: the centroid of each
    # polygon.
    polygons = shapely.orient_polygons(polygons)
    rings, ring_polygons = shapely.get_rings(polygons, return_index=True)
    origins = shapely.get_coordinates(shapely.centroid(polygons))
    points, point_rings = shapely.get_coordinates(rings, return_index=True)
    point_polygons = ring_polygons[point_rings]
    points -= origins[point_polygons]
    # No edge leads from the last point of a ring to the first point of the next one.
    is_edge = point_rings[1:] == point_rings[:-1]
    edges = _build_edges(points[:-1][is_edge], points[1:][is_edge], point_polygons[:-1][is_edge])
    return np.maximum(density.compute_moments(edges, origins)[:, MASS], 0.0)


def compute_square_means(density: Density, centers: FloatArray, side: float) -> FloatArray:
    """Compute the mean density in each of several axis-aligned squares of the same size.

    Parameters
    ----------
    density : Density
        The density.
    centers : (k, 2) array, m
        Centers of the squares.
    side : float, m
        Length of the sides.

    Returns
    -------
    (k,) array
        Mean density of each square.
    """
    corners = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    next_corners = np.roll(corners, -1, axis=0)
    masses = np.empty(len(centers))
    for first in range(0, len(centers), _SQUARES_PER_BATCH):
        batch = centers[first : first + _SQUARES_PER_BATCH]
        starts = np.tile(corners, (len(batch), 1))
        ends = np.tile(next_corners, (len(batch), 1))
        edges = _build_edges(starts, ends, np.repeat(np.arange(len(batch)), 4))
        masses[first : first + len(batch)] = density.compute_moments(edges, batch)[:, MASS]
    # Rounding must not produce values outside the range of the density, such as negative ones.
    return np.clip(masses / (side * side), density.lower_bound, density.upper_bound)


def _build_edges(starts: FloatArray, ends: FloatArray, polygons: IntArray) -> CellEdges:
    """Return the edges of polygons as those of cells that do not border on each other."""
    other_cells = np.full(len(polygons), REGION)
    return CellEdges(starts, ends, polygons.astype(np.intp, copy=False), other_cells)
