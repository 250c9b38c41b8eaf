"""The positions at which robots fit: far enough from walls and from each other."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import MultiPolygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import compute_lengths
from robocov.environment import (
    compute_center_areas,
    compute_start_clearance,
    compute_start_spacing,
    find_nearest_inside,
)
from robocov.potential import compute_spread_directions
from robocov.typing import FloatArray, IntArray

_MAX_PUSHES = 60
"""Maximum number of times that overlapping robots are pushed apart before the search gives up."""

_OVERSHOOT = 1.005
"""Robots are pushed apart to this multiple of their spacing. With a factor of 1, they would approach the
spacing more and more slowly."""

_RELATIVE_ROUNDING = 1e-9
"""Tolerance of the spacing for rounding errors, as a fraction of the spacing."""


class ConfigurationSpace:
    """The free configuration space of robots of the same radius.

    The gaps between robots, and between robots and walls, are at least as wide as at the start of a
    simulation.

    Parameters
    ----------
    free : shapely.MultiPolygon, m
        The free space, one polygon for each component.
    radius : float, m
        Radius of the robots.
    closed : shapely.MultiPolygon, optional, m
        The free space with closed gaps; see `Environment.close_gaps`. Its components are then used instead of
        those of `free`.

    Attributes
    ----------
    clearance : float, m
        Minimum distance between the center of a robot and a wall.
    spacing : float, m
        Minimum distance between the centers of two robots.
    components : tuple of shapely geometries, m
        For each component of the closed free space, the area where the center of a robot can be, which may
        be empty.

    Examples
    --------
    >>> space = ConfigurationSpace(MultiPolygon([shapely.box(0, 0, 4, 4)]), radius=1.0)
    >>> space.find_nearest(np.array([[0.0, 2.0]]), robot_components=np.array([0])).round(2)
    array([[1.02, 2.  ]])
    """

    def __init__(self, free: MultiPolygon, radius: float, closed: MultiPolygon | None = None) -> None:
        self.clearance = compute_start_clearance(radius)
        self.spacing = compute_start_spacing(radius)
        areas = compute_center_areas(free, free if closed is None else closed, self.clearance)
        self.components: tuple[BaseGeometry, ...] = tuple(areas)
        shapely.prepare(list(self.components))

    def find_nearest(self, positions: FloatArray, robot_components: IntArray) -> FloatArray | None:
        """Find positions at which all robots fit, near the given ones.

        Each robot moves to the nearest position clear of walls. Robots that are too close together are then
        pushed apart, until no pair is too close.

        Parameters
        ----------
        positions : (n, 2) array, m
            Positions of the robots.
        robot_components : (n,) int array
            Index of the component of the free space in which each robot stays.

        Returns
        -------
        (n, 2) array, m, or None
            None if no such positions were found.
        """
        areas = np.array(self.components, dtype=object)[robot_components]
        positions = find_nearest_inside(areas, positions)
        max_distance = self.spacing * (1.0 - _RELATIVE_ROUNDING)
        for _ in range(_MAX_PUSHES):
            pairs = cKDTree(positions).query_pairs(max_distance, output_type="ndarray")
            if len(pairs) == 0:
                return positions
            ordered_pairs = pairs[np.lexsort(pairs.T)]
            positions = find_nearest_inside(areas, self._push_apart(positions, ordered_pairs))
        return None

    def _push_apart(self, positions: FloatArray, pairs: IntArray) -> FloatArray:
        """Return the positions, (n, 2), after the two robots of each of the pairs, (p, 2), are pushed apart.

        Both robots of a pair move by the same distance.
        """
        first = pairs[:, 0]
        second = pairs[:, 1]
        offsets = positions[second] - positions[first]
        distances = compute_lengths(offsets)
        # The direction between coincident robots is undefined: use a fixed one that differs between pairs.
        is_coincident = distances == 0.0
        pair_numbers = first[is_coincident] + second[is_coincident] * len(positions)
        offsets[is_coincident] = compute_spread_directions(pair_numbers)
        # The offsets of coincident robots are unit vectors now.
        offset_lengths = np.where(is_coincident, 1.0, distances)
        fractions = (_OVERSHOOT * self.spacing - distances) / 2.0 / offset_lengths
        pushes = offsets * fractions[:, None]
        new_positions = positions.copy()
        np.subtract.at(new_positions, first, pushes)
        np.add.at(new_positions, second, pushes)
        return new_positions
