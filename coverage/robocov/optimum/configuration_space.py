"""The positions at which robots fit: clear of walls and of each other."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import MultiPolygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, IntArray, compute_lengths
from robocov.environment import (
    compute_center_areas,
    compute_start_clearance,
    compute_start_spacing,
    find_nearest_inside,
)
from robocov.potential import compute_spread_directions

_EDGES_PER_QUARTER = 32
"""Edges per quarter circle around corners. They cut off 3e-4 of the radius, less than the gap to walls."""

_MAX_PUSHES = 60
"""Maximum number of times that overlapping robots are pushed apart before the search gives up."""

_OVERSHOOT = 1.005
"""Robots are pushed apart to this multiple of their spacing. With a factor of 1, they would only converge."""

_RELATIVE_ROUNDING = 1e-9
"""Tolerance of the spacing for rounding errors, as a fraction."""


class ConfigurationSpace:
    """The free configuration space of robots of the same radius.

    Robots keep the same gaps to walls and to each other as at the start of a simulation.

    Parameters
    ----------
    free : shapely.MultiPolygon, m
        The free space, one polygon for each component.
    radius : float, m
    closed : shapely.MultiPolygon, optional, m
        The free space with closed gaps, if a component may consist of several parts between which a robot
        cannot move. By default no gap is closed.

    Attributes
    ----------
    clearance : float, m
        Minimum distance of a robot's center from walls.
    spacing : float, m
        Minimum distance between the centers of two robots.
    components : tuple of shapely geometries, m
        For each component of the closed free space, the area where the center of a robot can be, which may
        be empty.

    Examples
    --------
    >>> space = ConfigurationSpace(MultiPolygon([shapely.box(0, 0, 4, 4)]), radius=1.0)
    >>> space.find_nearest(np.array([[0.0, 2.0]]), component=np.array([0])).round(2)
    array([[1.02, 2.  ]])
    """

    def __init__(self, free: MultiPolygon, radius: float, closed: MultiPolygon | None = None) -> None:
        self.clearance = compute_start_clearance(radius)
        self.spacing = compute_start_spacing(radius)
        areas = compute_center_areas(
            free,
            free if closed is None else closed,
            clearance=self.clearance,
            edges_per_quarter=_EDGES_PER_QUARTER,
        )
        self.components: tuple[BaseGeometry, ...] = tuple(areas)
        shapely.prepare(list(self.components))

    def find_nearest(self, positions: Array, component: IntArray) -> Array | None:
        """Find positions where all robots fit, near the given ones.

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
            max_distance = self.spacing * (1.0 - _RELATIVE_ROUNDING)
            pairs = cKDTree(positions).query_pairs(max_distance, output_type="ndarray")
            if len(pairs) == 0:
                return positions
            ordered_pairs = pairs[np.lexsort(pairs.T)]
            positions = find_nearest_inside(areas, self._push_apart(positions, ordered_pairs))
        return None

    def _push_apart(self, positions: Array, pairs: IntArray) -> Array:
        """Return the (n, 2) positions after the robots of each of the (p, 2) pairs are pushed apart.

        Both robots of a pair move by the same distance.
        """
        first = pairs[:, 0]
        second = pairs[:, 1]
        offset = positions[second] - positions[first]
        distance = compute_lengths(offset)
        # The direction between coincident robots is undefined: use a fixed one that differs between pairs.
        is_coincident = distance == 0.0
        pair_numbers = first[is_coincident] + second[is_coincident] * len(positions)
        offset[is_coincident] = compute_spread_directions(pair_numbers)
        # The offsets of coincident robots are unit vectors now.
        offset_length = np.where(is_coincident, 1.0, distance)
        fraction = (_OVERSHOOT * self.spacing - distance) / 2.0 / offset_length
        push = offset * fraction[:, None]
        new_positions = positions.copy()
        np.subtract.at(new_positions, first, push)
        np.add.at(new_positions, second, push)
        return new_positions
