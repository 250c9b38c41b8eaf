"""Parameters of a generated map, and the rounding of its coordinates."""

import math
from dataclasses import dataclass

import numpy as np

from robocov.arrays import Array
from robocov.environment import MIN_START_GAP_RADII, Ring
from robocov.errors import require_number
from robocov.team import DEFAULT_RADIUS

LEAST_GAP = 0.21  # m; robots of the usual size pass it
assert LEAST_GAP > 2.0 * DEFAULT_RADIUS * (1.0 + MIN_START_GAP_RADII)

AREA_TOLERANCE = 0.005
"""Blocked area of a generated map, as a part of its area, differs by at most so much from what was asked."""

MOST_OBSTACLES = 100_000
SIDES = 1.0, 1000.0  # m


@dataclass(frozen=True)
class Request:
    """Request for a map, see `robocov.generator.generate_map`."""

    obstacles: int
    area: float
    gap: float
    width: float
    height: float

    def __post_init__(self) -> None:
        require_number("obstacles", self.obstacles, 1, MOST_OBSTACLES, whole=True)
        require_number("area", self.area, 0.01, 0.9)
        require_number("width", self.width, *SIDES)
        require_number("height", self.height, *SIDES)
        require_number("gap", self.gap, LEAST_GAP, min(self.width, self.height) / 3.0)

    @property
    def size(self) -> Array:
        """Width and height, (2,) m."""
        return np.array([self.width, self.height])

    @property
    def blocked(self) -> float:
        """The area to be blocked, m²."""
        return self.area * self.width * self.height

    @property
    def unit(self) -> float:
        """The side of a square of which there is one for each obstacle, m."""
        return math.sqrt(self.width * self.height / self.obstacles)

    @property
    def digits(self) -> int:
        """Digits after the point of all coordinates: centimetres, millimetres where gaps are narrow."""
        return 2 if self.gap >= 0.5 else 3

    @property
    def step(self) -> float:
        """Rounding step of coordinates, m."""
        return 10.0**-self.digits

    def rounded(self, points: Array) -> Array:
        """Return coordinates rounded."""
        return np.round(points, self.digits) + 0.0

    def ring(self, points: Array) -> Ring:
        """Return (k, 2) coordinates, rounded, as an outline."""
        return tuple((x, y) for x, y in self.rounded(points).tolist())

    def floor(self, value: float) -> float:
        """Return a length rounded down."""
        return round(math.floor(value / self.step + 1e-9) * self.step, self.digits)
