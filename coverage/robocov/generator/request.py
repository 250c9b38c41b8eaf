"""Parameters of a generated map, and the rounding of its coordinates."""

import math
from dataclasses import dataclass

import numpy as np

from robocov.arrays import Array
from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import MIN_START_GAP_RADII, Ring
from robocov.errors import require_number

MIN_GAP_M = 0.21
"""Smallest gap that may be requested: robots of the default size fit through it."""
assert MIN_GAP_M > 2.0 * DEFAULT_RADIUS_M * (1.0 + MIN_START_GAP_RADII)
AREA_TOLERANCE = 0.005
"""Largest difference between the blocked fraction of a map's area and the requested one."""
MAX_OBSTACLES = 100_000
MIN_SIDE_M = 1.0
MAX_SIDE_M = 1000.0
_MIN_AREA = 0.01
_MAX_AREA = 0.9
_MIN_GAPS_PER_SIDE = 3.0
_MIN_CENTIMETER_GAP_M = 0.5
"""Coordinates are rounded to centimeters from this gap on, to millimeters below."""
_ROUNDING_ALLOWANCE_STEPS = 3.0
"""Rounding steps by which gaps are made wider, because rounding may bring corners nearer to each other."""
_STEP_TOLERANCE = 1e-9
"""Fraction of a step by which a length may miss a multiple of it because of rounding."""


@dataclass(frozen=True)
class Request:
    """Parameters of a map; see `robocov.generator.generate_map`.

    Attributes
    ----------
    count : int
        Number of obstacles, blocks, rooms, cells or chambers, depending on the kind of map.
    area : float
        Blocked fraction of the map's area.
    gap : float, m
        Smallest gap between obstacles.
    width, height : float, m
        Sides of the map.

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    """

    count: int
    area: float
    gap: float
    width: float
    height: float

    def __post_init__(self) -> None:
        require_number("obstacles", self.count, 1, MAX_OBSTACLES, whole=True)
        require_number("area", self.area, _MIN_AREA, _MAX_AREA)
        require_number("width", self.width, MIN_SIDE_M, MAX_SIDE_M)
        require_number("height", self.height, MIN_SIDE_M, MAX_SIDE_M)
        require_number("gap", self.gap, MIN_GAP_M, min(self.width, self.height) / _MIN_GAPS_PER_SIDE)

    @property
    def size(self) -> Array:
        """Width and height, (2,) m."""
        return np.array([self.width, self.height])

    @property
    def blocked_area(self) -> float:
        """Area to be blocked, m²."""
        return self.area * self.width * self.height

    @property
    def unit(self) -> float:
        """Side of the square that each obstacle would get if the map were divided evenly, m."""
        return math.sqrt(self.width * self.height / self.count)

    @property
    def digits(self) -> int:
        """Decimal places of all coordinates: centimeters, or millimeters if gaps are narrow."""
        return 2 if self.gap >= _MIN_CENTIMETER_GAP_M else 3

    @property
    def step(self) -> float:
        """Rounding step of coordinates, m."""
        return 10.0**-self.digits

    @property
    def gap_before_rounding(self) -> float:
        """Width of the gaps between unrounded corners, which leaves at least `gap` after rounding, m."""
        return self.gap + _ROUNDING_ALLOWANCE_STEPS * self.step

    def round_points(self, points: Array) -> Array:
        """Round coordinates to the decimal places of the map.

        Parameters
        ----------
        points : array, m

        Returns
        -------
        array, m
            Without negative zeros.
        """
        return np.round(points, self.digits) + 0.0

    def build_ring(self, points: Array) -> Ring:
        """Build an outline from points, which are rounded first.

        Parameters
        ----------
        points : (k, 2) array, m

        Returns
        -------
        (k, 2) tuple, m
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
        # With the tolerance, a multiple of the step does not lose a step to a rounding error.
        return round(math.floor(length / self.step + _STEP_TOLERANCE) * self.step, self.digits)
