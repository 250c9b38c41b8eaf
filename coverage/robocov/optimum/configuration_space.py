"""Where robots can be: clear of walls, and of each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import MultiPolygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, IntArray
from robocov.environment import MIN_START_GAP_RADII
from robocov.potential import GOLDEN_ANGLE

_EDGES_PER_QUARTER = 32
"""Edges of a quarter circle around corners: they cut 3e-4 of the radius off, less than the gap at starts."""

_MAX_PUSHES = 60
"""Maximum number of times that overlapping robots are pushed apart; then there is not enough space."""

_OVERSHOOT = 1.005
"""Factor of the distance to which robots are pushed apart; to exactly 1 they would only converge."""


class ConfigurationSpace:
    """The free configuration space of robots of the same radius.

    Robots keep the gap of starts to walls and to each other.

    Parameters
    ----------
    free : shapely.MultiPolygon, m
        The free space, one polygon for each component.
    radius : float, m

    Attributes
    ----------
    clearance : float, m
        Minimum distance of a robot's centre from walls.
    spacing : float, m
        Minimum distance of the centres of two robots.
    components : tuple of shapely geometries, m
        For each component of the free space, where the centre of a robot can be; may be empty.

    Examples
    --------
    >>> space = ConfigurationSpace(MultiPolygon([shapely.box(0, 0, 4, 4)]), radius=1.0)
    >>> space.find_nearest(np.array([[0.0, 2.0]]), component=np.array([0])).round(2)
    array([[1.02, 2.  ]])
    """

    def __init__(self, free: MultiPolygon, radius: float) -> None:
        self.clearance = radius * (1.0 + MIN_START_GAP_RADII)
        self.spacing = 2.0 * radius * (1.0 + MIN_START_GAP_RADII)
        self.components: tuple[BaseGeometry, ...] = tuple(
            component.buffer(-self.clearance, quad_segs=_EDGES_PER_QUARTER) for component in free.geoms
        )
        shapely.prepare(list(self.components))

    def find_nearest(self, positions: Array, component: IntArray) -> Array | None:
        """Find positions near given ones where all robots fit.

        Parameters
        ----------
        positions : (n, 2) array, m
        component : (n,) int array
            The component of the free space in which each robot stays.

        Returns
        -------
        (n, 2) array, m, or None
            None if no such positions were found.
        """
        areas = np.array(self.components, dtype=object)[component]
        positions = find_nearest_inside(areas, positions)
        for _ in range(_MAX_PUSHES):
            max_distance = self.spacing * (1.0 - 1e-9)
            pairs = cKDTree(positions).query_pairs(max_distance, output_type="ndarray")
            if not len(pairs):
                return positions
            ordered_pairs = pairs[np.lexsort(pairs.T)]
            positions = find_nearest_inside(areas, self._push_apart(positions, ordered_pairs))
        return None

    def _push_apart(self, positions: Array, pairs: IntArray) -> Array:
        """Return (n, 2) positions with each of (p, 2) pairs pushed apart, both robots by the same length."""
        first = pairs[:, 0]
        second = pairs[:, 1]
        offset = positions[second] - positions[first]
        distance = np.hypot(offset[:, 0], offset[:, 1])
        # Two robots at the same point have no direction apart: take a fixed one, another for each pair.
        coincide = distance == 0.0
        angle = GOLDEN_ANGLE * (first[coincide] + second[coincide] * len(positions))
        offset[coincide] = np.column_stack([np.cos(angle), np.sin(angle)])
        length = np.where(coincide, 1.0, distance)
        fraction = (_OVERSHOOT * self.spacing - distance) / 2.0 / length
        push = offset * fraction[:, None]
        pushed = positions.copy()
        np.subtract.at(pushed, first, push)
        np.add.at(pushed, second, push)
        return pushed


def find_nearest_inside(area: Any, positions: Array) -> Array:
    """Find the points of an area that are nearest to given positions.

    Parameters
    ----------
    area : shapely geometry, or (n,) array of them
        One area for all positions, or one for each.
    positions : (n, 2) array

    Returns
    -------
    (n, 2) array
        The same array if all positions are inside.

    Examples
    --------
    >>> find_nearest_inside(shapely.box(0, 0, 1, 1), np.array([[0.5, 0.5], [2.0, 0.25]]))
    array([[0.5 , 0.5 ],
           [1.  , 0.25]])
    """
    points = shapely.points(positions)
    outside = np.flatnonzero(~shapely.intersects(area, points))
    if not len(outside):
        return positions
    areas = np.broadcast_to(area, len(points))
    lines = shapely.shortest_line(areas[outside], points[outside])
    moved = positions.copy()
    moved[outside] = shapely.get_coordinates(lines)[::2]
    return moved
