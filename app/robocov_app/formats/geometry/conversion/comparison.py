"""Comparison of a foreign map with the environment built from it, for previews."""

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
"""Maximum number of vertices for which the narrowest passage is searched, because the search takes long."""
_MIN_DIFFERENCE_WIDTH = 2.0
"""Differences narrower than this, in tolerances, are walls that have moved and are not shown."""


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
        Convex hull of the map before and after.
    gap : Gap or None
        The narrowest passage of the environment, or None if it would take too long to find.
    """

    before: BaseGeometry
    after: BaseGeometry
    lost: BaseGeometry
    opened: BaseGeometry
    region: BaseGeometry
    gap: Gap | None

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Bounding box of the region: left, bottom, right, top, m."""
        x, y, right, top = self.region.bounds
        return x, y, right, top


def compare_maps(foreign: ForeignMap, environment: Environment, report: ImportReport) -> ImportComparison:
    """Compare a foreign map with the environment built from it.

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
    # The width of a long strip is twice its area divided by its perimeter.
    width = 2.0 * shapely.area(parts) / shapely.length(parts)
    min_width = max(_MIN_DIFFERENCE_WIDTH * tolerance, 1e-3) / 2
    return MultiPolygon(parts[width > min_width].tolist())
