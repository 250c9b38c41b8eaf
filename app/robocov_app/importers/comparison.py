"""The free space of a foreign map as it was read and as it became, and where they differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Polygon

from robocov.environment import Gap, narrowest_gap

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from robocov.environment import Environment
    from robocov_app.importers.foreign import ForeignMap
    from robocov_app.importers.report import ImportReport

_MOST_VERTICES = 20_000
"""Of a map whose narrowest passage is looked for: that takes seconds then."""

_SLIVER = 2.0
"""Width, in tolerances, below which a difference counts as a wall that moved, not as one that was lost."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Free space as it was read and as it became, and what differs; all in metres.

    Attributes
    ----------
    before, after : geometry
    lost, opened : geometry
        What is free in the first alone, and in the second alone, without the slivers along walls that moved.
    region : geometry
        Convex, around all of it.
    gap : Gap or None
        The narrowest passage of the second, if that is soon known.
    """

    before: BaseGeometry
    after: BaseGeometry
    lost: BaseGeometry
    opened: BaseGeometry
    region: BaseGeometry
    gap: Gap | None

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Least x and y, then largest."""
        x, y, right, top = self.region.bounds
        return x, y, right, top


def compare(foreign: ForeignMap, environment: Environment, report: ImportReport) -> Comparison:
    """Return what an import has changed of the free space."""
    before, after = foreign.free, environment.free
    if not before.is_valid:
        before = shapely.make_valid(before, method="structure", keep_collapsed=False)
    everything = [before, after, environment.region.polygon, foreign.boundary or before]
    return Comparison(
        before,
        after,
        lost=_changed(before, after, report.tolerance),
        opened=_changed(after, before, report.tolerance),
        region=shapely.GeometryCollection(everything).convex_hull,
        gap=narrowest_gap(after) if report.vertices_kept <= _MOST_VERTICES else None,
    )


def _changed(first: BaseGeometry, second: BaseGeometry, tolerance: float) -> BaseGeometry:
    """Return what is in the first and not in the second, without the slivers along walls that moved."""
    parts = shapely.get_parts(shapely.difference(first, second))
    parts = np.array([part for part in parts if isinstance(part, Polygon) and part.area > 0.0], dtype=object)
    if not len(parts):
        return shapely.MultiPolygon()
    # of a long strip this is its width
    width = 2.0 * shapely.area(parts) / shapely.length(parts)
    return shapely.MultiPolygon(parts[width > max(_SLIVER * tolerance, 1e-3) / 2].tolist())
