"""Comparison of a foreign map with the environment that was made from it, for previews."""

from __future__ import annotations

from dataclasses import dataclass

import shapely
from shapely import MultiPolygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import Environment, Gap, find_narrowest_gap
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.polygons import make_valid
from robocov_app.formats.reports import ImportReport

_MAX_GAP_VERTICES = 20_000
"""Maps with more vertices are not searched for their narrowest passage, which would take too long."""
_MIN_DIFFERENCE_WIDTH = 2.0
"""Differences narrower than this many tolerances are walls that have moved."""


@dataclass(frozen=True, eq=False)
class ImportComparison:
    """The free space of a foreign map before and after its conversion.

    Attributes
    ----------
    before, after : shapely geometry, m
        The free space.
    lost, opened : shapely geometry, m
        Free space that became solid, and the reverse, except for walls that have moved.
    region : shapely geometry, m
        Convex, around all of it.
    gap : Gap or None
        The narrowest passage of the environment, unless its computation would take too long.
    """

    before: BaseGeometry
    after: BaseGeometry
    lost: BaseGeometry
    opened: BaseGeometry
    region: BaseGeometry
    gap: Gap | None

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Lower left and upper right corner of all of it, m."""
        x, y, right, top = self.region.bounds
        return x, y, right, top


def compare_maps(foreign: ForeignMap, environment: Environment, report: ImportReport) -> ImportComparison:
    """Compare a foreign map with the environment that was made from it.

    Parameters
    ----------
    foreign : ForeignMap
    environment : Environment
    report : ImportReport
        The report on the conversion.

    Returns
    -------
    ImportComparison
    """
    before: BaseGeometry = foreign.free
    after = environment.free
    if not before.is_valid:
        before = make_valid(before)
    everything = [before, after, environment.region.polygon, foreign.boundary or before]
    gap = None
    if report.vertices_kept <= _MAX_GAP_VERTICES:
        gap = find_narrowest_gap(after)
    return ImportComparison(
        before=before,
        after=after,
        lost=_subtract(before, after, report.tolerance),
        opened=_subtract(after, before, report.tolerance),
        region=shapely.GeometryCollection(everything).convex_hull,
        gap=gap,
    )


def _subtract(first: BaseGeometry, second: BaseGeometry, tolerance: float) -> MultiPolygon:
    """Return the difference of two areas without the slivers along walls that have moved."""
    parts = shapely.get_parts(shapely.difference(first, second))
    parts = parts[shapely.area(parts) > 0.0]
    # For a long strip, this is its width.
    width = 2.0 * shapely.area(parts) / shapely.length(parts)
    min_width = max(_MIN_DIFFERENCE_WIDTH * tolerance, 1e-3) / 2
    return MultiPolygon(parts[width > min_width].tolist())
