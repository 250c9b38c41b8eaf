"""The path of an obstacle that moves: where it has got to at any time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias, get_args

import numpy as np

from robocov.arrays import Array

Repeat: TypeAlias = Literal["loop", "back-and-forth"]
"""What happens at the end of a path: straight to its beginning, or back the way it came."""

REPEATS: tuple[str, ...] = get_args(Repeat)


@dataclass(frozen=True)
class ObstaclePath:
    """A poly-line along which an obstacle is shifted at a constant speed, without turning.

    The obstacle is where its map has it when the path's point is at the first of `points`, at time zero;
    at other times it is shifted by as much as the path's point has moved.

    Attributes
    ----------
    points : ring of [x, y], m
        At least two.
    speed : float, m/s
    repeat : "loop" or "back-and-forth"
        Whether it goes straight from the last point to the first again, or back the way it came.
    """

    points: tuple[tuple[float, float], ...]
    speed: float
    repeat: Repeat = "loop"

    @cached_property
    def _line(self) -> tuple[Array, Array]:
        """One turn, from the first point back to it, (k, 2) m, and how far each is along it, (k,) m."""
        points = np.array(self.points, dtype=float)
        back = points[:1] if self.repeat == "loop" else points[-2::-1]
        line = np.concatenate([points, back])
        length = np.hypot(*np.diff(line, axis=0).T)
        return line, np.concatenate([[0.0], np.cumsum(length)])

    @property
    def period(self) -> float:
        """Seconds until the obstacle is back, and about to go the same way again."""
        return float(self._line[1][-1]) / self.speed

    def shift(self, time: float) -> Array:
        """Return by how much the obstacle has moved, (2,) m.

        Parameters
        ----------
        time : float, s

        Examples
        --------
        >>> path = ObstaclePath(((1.0, 1.0), (3.0, 1.0)), 0.5, "back-and-forth")
        >>> path.shift(2.0).tolist(), path.shift(5.0).tolist(), path.period
        ([1.0, 0.0], [1.5, 0.0], 8.0)
        """
        line, along = self._line
        place = (time * self.speed) % along[-1]
        at = np.array([np.interp(place, along, line[:, k]) for k in (0, 1)])
        return np.asarray(at - line[0])
