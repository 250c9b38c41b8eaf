"""The area that a moving obstacle sweeps, compared with the obstacle at many times."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from robocov.environment import (
    CircleObstacle,
    ObstaclePath,
    PolygonObstacle,
    WallObstacle,
    compute_swept_area,
    find_overlaps,
    shift_obstacle,
)

FRAME = PolygonObstacle(
    ((0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)), (((0.2, 0.2), (0.8, 0.2), (0.5, 0.8)),)
)
NUMBERS = st.integers(-40, 40).map(lambda k: k / 10)
POINTS = st.lists(st.tuples(NUMBERS, NUMBERS), min_size=2, max_size=4, unique=True).map(tuple)


@pytest.mark.slow
@given(POINTS, st.sampled_from(["loop", "back-and-forth"]))
def test_the_swept_area_is_the_union_of_the_obstacle_over_time(points, repeat) -> None:
    path = ObstaclePath(points, 0.5, repeat)
    area = compute_swept_area(FRAME.polygon, path)
    times = np.linspace(0.0, path.period, 200)
    shapes = [shift_obstacle(FRAME, path.compute_displacement(time)).polygon for time in times]
    union = shapely.union_all(shapes)
    assert union.difference(area.buffer(1e-6)).area < 1e-6
    step = 0.5 * path.period / 199
    assert area.difference(union.buffer(step + 1e-6)).area < 1e-6


def test_a_bar_between_two_holes_sweeps_them() -> None:
    frame = shapely.box(0, 0, 10, 4) - shapely.box(1, 1, 4, 3) - shapely.box(5, 1, 9, 3)
    area = compute_swept_area(frame, ObstaclePath(((0.0, 0.0), (-2.5, 0.0)), 1.0))
    assert area.covers(shapely.box(1.5, 1, 4, 3))
    assert area.area == pytest.approx(12.5 * 4 - 2 * (1.5 - 1 + 9 - 2.5 - 5))


def test_a_hole_is_swept_only_as_far_as_its_rim_moves() -> None:
    wide = PolygonObstacle(((0, 0), (4, 0), (4, 4), (0, 4)), (((1, 1), (3, 1), (3, 3), (1, 3)),))
    area = compute_swept_area(wide.polygon, ObstaclePath(((0, 0), (0.5, 0)), 1.0))
    assert area.area == pytest.approx(4.5 * 4 - 1.5 * 2)


def test_a_wall_of_several_polygons_sweeps_the_areas_of_all() -> None:
    wall = WallObstacle(((0.4, 0.6), (0.7, 0.6), (0.7, 0.5)), width=2.0)
    assert wall.polygon.geom_type == "MultiPolygon"
    area = compute_swept_area(wall.polygon, ObstaclePath(((0, 0), (5, 0)), 1.0))
    parts = [compute_swept_area(part, ObstaclePath(((0, 0), (5, 0)), 1.0)) for part in wall.polygon.geoms]
    assert area.equals(shapely.union_all(parts))


@pytest.mark.parametrize("points", [(), ((1, 1),), ((1, 1), (1, 1))])
@pytest.mark.parametrize("repeat", ["loop", "back-and-forth"])
def test_a_path_without_length_sweeps_only_the_obstacle(points, repeat) -> None:
    assert compute_swept_area(FRAME.polygon, ObstaclePath(points, 1.0, repeat)).equals(FRAME.polygon)


def test_obstacles_that_only_touch_the_swept_area_do_not_overlap_it() -> None:
    area = compute_swept_area(CircleObstacle((0, 0), 0.5).polygon, ObstaclePath(((0, 0), (4, 0)), 1.0))
    others = {
        "on the path": shapely.box(2, -0.1, 2.2, 0.1),
        "touching": shapely.box(1, 0.5, 2, 1),
        "distant": shapely.box(8, 8, 9, 9),
    }
    overlaps, area_outside = find_overlaps(area, others)
    assert list(overlaps) == ["on the path"]
    assert area_outside is None
    assert overlaps["on the path"].equals(others["on the path"])
    assert find_overlaps(area, {}) == ({}, None)


def test_obstacles_that_leave_the_boundary_are_reported() -> None:
    area = compute_swept_area(CircleObstacle((0, 0), 0.5).polygon, ObstaclePath(((0, 0), (4, 0)), 1.0))
    _, area_outside = find_overlaps(area, {}, shapely.box(-1, -1, 4, 1))
    assert area_outside is not None
    assert area_outside.bounds == pytest.approx((4.0, -0.5, 4.5, 0.5), abs=1e-2)
    assert find_overlaps(area, {}, shapely.box(-1, -1, 5, 1)) == ({}, None)
