"""Parameters of a generated map, and the rounding of its coordinates."""

import math
from dataclasses import dataclass

import numpy as np

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import MIN_START_GAP_RADII, Ring
from robocov.errors import require_number
from robocov.typing import FloatArray

MIN_GAP_M = 0.21
"""Minimum gap that may be requested: robots of the default size fit through it."""
assert MIN_GAP_M > 2.0 * DEFAULT_RADIUS_M * (1.0 + MIN_START_GAP_RADII)
BLOCKED_FRACTION_TOLERANCE = 0.005
"""Maximum difference between the blocked fraction of a map's area and the requested fraction."""
MAX_OBSTACLES = 100_000
"""Maximum number of obstacles that may be requested."""
MIN_SIDE_M = 1.0
MAX_SIDE_M = 1000.0
"""Minimum and maximum width and height of a map."""
_MIN_BLOCKED_FRACTION = 0.01
_MAX_BLOCKED_FRACTION = 0.9
"""Minimum and maximum blocked fraction that may be requested."""
_MIN_GAPS_PER_SIDE = 3.0
"""Minimum ratio between the shorter side of a map and the requested gap."""
_MIN_CENTIMETER_GAP_M = 0.5
"""Minimum gap with coordinates in whole centimeters. With narrower gaps, they are in whole millimeters."""
_ROUNDING_ALLOWANCE_STEPS = 3.0
"""Rounding steps by which gaps are made wider, because rounding may bring corners nearer to each other."""
_STEP_TOLERANCE = 1e-9
"""Rounding error of a length that is a multiple of the rounding step, as a fraction of the step."""


@dataclass(frozen=True)
class MapRequest:
    """Parameters of a map; see `robocov.generator.generate_map`.

    Attributes
    ----------
    obstacle_count : int
        Number of obstacles, blocks, rooms, cells or chambers, depending on the kind of map.
    blocked_fraction : float
        Fraction of the map's area that obstacles block.
    gap : float, m
        Minimum gap between obstacles.
    width, height : float, m
        Sides of the map.

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    """

    obstacle_count: int
    blocked_fraction: float
    gap: float
    width: float
    height: float

    def __post_init__(self) -> None:
        # Messages name the parameters of `generate_map`.
        require_number("obstacles", self.obstacle_count, 1, MAX_OBSTACLES, whole=True)
        require_number("area", self.blocked_fraction, _MIN_BLOCKED_FRACTION, _MAX_BLOCKED_FRACTION)
        require_number("width", self.width, MIN_SIDE_M, MAX_SIDE_M)
        require_number("height", self.height, MIN_SIDE_M, MAX_SIDE_M)
        require_number("gap", self.gap, MIN_GAP_M, min(self.width, self.height) / _MIN_GAPS_PER_SIDE)

    @property
    def size(self) -> FloatArray:
        """Width and height, (2,) m."""
        return np.array([self.width, self.height])

    @property
    def blocked_area(self) -> float:
        """Area that obstacles block, m²."""
        return self.blocked_fraction * self.width * self.height

    @property
    def mean_spacing(self) -> float:
        """Side of the square that each obstacle would get if the map were divided evenly, m."""
        return math.sqrt(self.width * self.height / self.obstacle_count)

    @property
    def decimals(self) -> int:
        """Number of decimal places of all coordinates: 2, or 3 if gaps are narrow."""
        return 2 if self.gap >= _MIN_CENTIMETER_GAP_M else 3

    @property
    def rounding_step(self) -> float:
        """Difference between neighboring rounded coordinates, m."""
        return 10.0**-self.decimals

    @property
    def gap_before_rounding(self) -> float:
        """Width of gaps between unrounded corners, m. After rounding, they are at least `gap` wide."""
        return self.gap + _ROUNDING_ALLOWANCE_STEPS * self.rounding_step

    def round_points(self, points: FloatArray) -> FloatArray:
        """Round coordinates to the decimal places of the map.

        Parameters
        ----------
        points : array, m

        Returns
        -------
        array, m
            Rounded coordinates, of the same shape, without negative zeros.
        """
        # Adding 0.0 turns -0.0 into 0.0.
        return np.round(points, self.decimals) + 0.0

    def build_ring(self, points: FloatArray) -> Ring:
        """Build the outline of an obstacle from points, which are rounded first.

        Parameters
        ----------
        points : (k, 2) array, m
            Vertices, not rounded.

        Returns
        -------
        (k, 2) tuple, m
            Rounded vertices.
        """
        return tuple((x, y) for x, y in self.round_points(points).tolist())

    def round_down(self, length: float) -> float:
        """Round a length down to the decimal places of the map.

        Parameters
        ----------
        length : float, m

        Returns
        -------
        float, m
        """
        # With the tolerance, a length that is just below a multiple of the step, because of a rounding error,
        # is not rounded down to the previous multiple.
        steps = math.floor(length / self.rounding_step + _STEP_TOLERANCE)
        return round(steps * self.rounding_step, self.decimals)
