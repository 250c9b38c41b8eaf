"""The coverage cost at a moment of a run: with the obstacles where they are, and the robots that work."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from robocov.cost.coverage import CoverageCost

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.arrays import Array, BoolArray
    from robocov.cost.coverage import CoverageResult

_REMEMBERED = 64
"""Maps whose costs are kept: an obstacle that moves comes by the same places again."""


class MomentaryCost:
    """The coverage cost (22) of a map at any time.

    Only robots count that work: one that has failed goes nowhere. Nor does one that a moving obstacle has
    run over, until it is out again.

    Parameters
    ----------
    cost : CoverageCost
        Of the map as it was given, at time zero.
    progress : callable
        As `CoverageCost` takes it, for the maps of later moments.
    """

    def __init__(self, cost: CoverageCost, progress: Callable[[float], None] | None = None) -> None:
        self._cost, self._progress = cost, progress
        self._known: dict[bytes, CoverageCost] = {}

    def at(self, time: float) -> CoverageCost:
        """Return the coverage cost of the map as it is at a time, s; the given one where nothing moves."""
        environment = self._cost.environment
        if not environment.moves:
            return self._cost
        now = environment.at(time)
        key = now.free.wkb
        if key not in self._known:
            if len(self._known) >= _REMEMBERED:
                del self._known[next(iter(self._known))]
            self._known[key] = CoverageCost(now, self._cost.lattice, progress=self._progress)
        return self._known[key]

    def counted(self, time: float, positions: Array, working: BoolArray | None = None) -> BoolArray:
        """Return which robots count, (n,) bool.

        Parameters
        ----------
        time : float, s
        positions : (n, 2) m
        working : (n,) bool or None
            None: all.
        """
        counted = np.ones(len(positions), dtype=bool) if working is None else working.copy()
        if self._cost.environment.moves:
            counted &= shapely.contains_properly(self.at(time).environment.free, shapely.points(positions))
        return counted

    def __call__(
        self,
        time: float,
        positions: Array,
        working: BoolArray | None = None,
        speeds: Array | None = None,
    ) -> CoverageResult | None:
        """Return the coverage cost at a time; None where no robot counts.

        The parameters are those of `counted`, and `speeds` (n,) m/s those of `CoverageCost`; the rows of the
        result are those of the robots that count.
        """
        counted = self.counted(time, positions, working)
        if not counted.any():
            return None
        return self.at(time)(positions[counted], None if speeds is None else speeds[counted])

    def of_all(
        self, time: float, positions: Array, working: BoolArray | None = None
    ) -> CoverageResult | None:
        """Return the coverage cost at a time with a row for every robot; None where no robot counts.

        A robot that does not count is nearest to nothing. The parameters are those of `counted`.
        """
        counted = self.counted(time, positions, working)
        if counted.all():
            return self.at(time)(positions) if len(positions) else None
        rows = np.flatnonzero(counted)
        if not len(rows):
            return None
        result = self.at(time)(positions[rows])
        owner = np.where(result.owner >= 0, rows[result.owner], -1)
        return replace(result, positions=np.array(positions), owner=owner)

    def figures(
        self, time: float, positions: Array, working: BoolArray | None = None
    ) -> tuple[float, float, float]:
        """Return mean distance, m, cost (22), m³, and uncovered area, m²; nan, nan, all where none counts."""
        result = self(time, positions, working)
        if result is None:
            return np.nan, np.nan, self.at(time).environment.free_area
        return result.mean_distance, result.value, result.uncovered_area
