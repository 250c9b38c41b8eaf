"""Ray scans: what a range sensor measures all around, for the controllers that ask for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocov.arrays import Array, BoolArray
from robocov.errors import checked

MOST_RAYS = 3600
"""A ray for each tenth of a degree."""


@dataclass(frozen=True, slots=True)
class Scanning:
    """How a controller wants its robots to scan; it says so in an attribute `scanning`.

    The rays are spread evenly round a full turn, the first along +x. The period (s) between two scans is
    rounded to whole control periods; the first scan is at the beginning. A ParameterError is raised when one
    of them is out of range.
    """

    rays: int = 120
    period: float = 0.5

    def __post_init__(self) -> None:
        checked("scanning.rays", self.rays, 1, MOST_RAYS, whole=True)
        checked("scanning.period", self.period, 0.0, 1e6, "s")

    def every(self, dt: float) -> int:
        """Return after how many control periods of `dt` seconds each scan follows the one before.

        >>> Scanning(period=0.5).every(0.02)
        25
        """
        return max(1, round(self.period / dt))


@dataclass(frozen=True, slots=True, eq=False)
class Scans:
    """One scan of each robot, by its own range sensor; row i belongs to robot i alone."""

    distances: Array
    """(n, rays) m, to the first solid point along each ray; the robot's sensing range where there is none."""
    hit: BoolArray
    """(n, rays) Whether there is one."""

    @property
    def rays(self) -> int:
        """Number of rays of each robot."""
        return int(self.distances.shape[1])

    @property
    def headings(self) -> Array:
        """Unit vectors along the rays, (rays, 2)."""
        return headings(self.rays)


def headings(rays: int) -> Array:
    """Return unit vectors evenly round a full turn, (rays, 2), the first along +x."""
    angle = np.arange(rays) * (2.0 * np.pi / rays)
    return np.column_stack([np.cos(angle), np.sin(angle)])
