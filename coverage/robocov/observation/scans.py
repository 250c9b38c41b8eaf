"""Range scans: the settings that a controller requests, and the scans of its robots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocov.errors import require_number
from robocov.typing import BoolArray, FloatArray

MAX_RAYS = 3600
"""Maximum number of rays of a scan: one for each tenth of a degree."""

_MAX_PERIOD_S = 1e6


@dataclass(frozen=True, slots=True)
class Scanning:
    """Settings of range scans, which a controller requests with its attribute ``scanning``.

    Parameters
    ----------
    rays : int
        Number of rays, evenly spaced over a full turn; the first points along +x.
    period : float, s
        Time between two scans, rounded to whole steps. The first scan is taken at the start.

    Raises
    ------
    ParameterError
        If a value is out of range.

    See Also
    --------
    Scans : The scans that the controller receives.
    """

    rays: int = 120
    period: float = 0.5

    def __post_init__(self) -> None:
        require_number("scanning.rays", self.rays, 1, MAX_RAYS, whole=True)
        require_number("scanning.period", self.period, 0.0, _MAX_PERIOD_S, "s")

    def count_steps(self, dt: float) -> int:
        """Return the number of steps from one scan to the next, at least one.

        Parameters
        ----------
        dt : float, s
            Control period.

        Returns
        -------
        int

        Examples
        --------
        >>> Scanning(period=0.5).count_steps(0.02)
        25
        """
        return max(1, round(self.period / dt))


@dataclass(frozen=True, slots=True, eq=False)
class Scans:
    """One scan of each robot by its own range sensor. Only robot i knows row i.

    Attributes
    ----------
    distances : (n, rays) array, m
        Distance to the first obstacle along each ray; the robot's sensing range if there is none.
    is_hit : (n, rays) bool array
        Whether there is an obstacle within the sensing range.

    See Also
    --------
    Scanning : Settings with which a controller requests scans.
    """

    distances: FloatArray
    is_hit: BoolArray

    @property
    def rays(self) -> int:
        """Number of rays of each robot."""
        return int(self.distances.shape[1])

    @property
    def directions(self) -> FloatArray:
        """Unit vectors along the rays, (rays, 2)."""
        return compute_ray_directions(self.rays)


def compute_ray_directions(rays: int) -> FloatArray:
    """Compute unit vectors along evenly spaced rays.

    Parameters
    ----------
    rays : int
        Number of rays over a full turn.

    Returns
    -------
    (rays, 2) array
        Counter-clockwise; the first vector is (1, 0).
    """
    angle = np.arange(rays) * (2.0 * np.pi / rays)
    return np.column_stack([np.cos(angle), np.sin(angle)])
