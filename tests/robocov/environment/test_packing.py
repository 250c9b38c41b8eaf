"""Bounds for the number of points that fit into separate parts of an area."""

from __future__ import annotations

import shapely

from robocov.environment.packing import bound_point_count, pack_densely


def test_each_separate_part_of_an_area_may_hold_one_more_point() -> None:
    """Thirty tiny parts, far apart, hold one point each."""
    specks = shapely.MultiPolygon([shapely.box(x, 0.0, x + 0.01, 0.01) for x in range(30)])
    assert bound_point_count(specks, 0.2) >= 30
    assert len(pack_densely(specks, 0.2)) == 30
