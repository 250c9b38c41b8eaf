"""Large plans: each is a map without warnings, of the promised size, with wide passages and a large start."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from robocov.errors import NoLayoutError
from robocov.mapfile.check import check_map
from robocov_app.benchmark.maps.large_plans import LARGE_PLANS, build_large_plan
from robocov_app.benchmark.maps.large_plans.drawing import Drawing, build_outline
from robocov_app.benchmark.maps.large_plans.tunnels import draw_tunnels
from robocov_app.benchmark.maps.plan_search import find_valid_map
from robocov_app.benchmark.maps.plan_shapes import FloorPlan

SEEDS = range(7001, 7005)
"""One seed for each layout."""
LARGEST_TEAM = 50
RADIUS_M = 0.1


@pytest.mark.parametrize("kind", LARGE_PLANS)
def test_plans_are_valid_and_large(kind: str) -> None:
    for seed in SEEDS:
        plan = build_large_plan(kind, seed)
        report = check_map(plan, RADIUS_M)
        assert report.warnings == ()
        assert [(start.name, start.kind) for start in report.starts] == [("entry", "disc")]
        assert report.starts[0].capacity >= LARGEST_TEAM
        left, bottom, right, top = plan.boundary_polygon.bounds
        assert 30.0 <= min(right - left, top - bottom) < max(right - left, top - bottom) <= 60.0
        assert len(plan.obstacles) <= 150


@pytest.mark.parametrize("kind", LARGE_PLANS)
def test_plans_are_connected_by_wide_passages(kind: str) -> None:
    plan = build_large_plan(kind, SEEDS[0])
    assert isinstance(plan.free.buffer(-0.3), shapely.Polygon)


def test_plans_depend_on_their_seed_only() -> None:
    assert build_large_plan("wards", 1) == build_large_plan("wards", 1)
    # Seeds 1 and 5 have the same layout.
    assert build_large_plan("wards", 1).boundary != build_large_plan("wards", 5).boundary


def test_a_search_without_a_suitable_plan_fails() -> None:
    # A start disc with a radius of 1 m does not fit in.
    corridor = FloorPlan(boundary=((0.0, 0.0), (9.0, 0.0), (9.0, 1.5), (0.0, 1.5)), obstacles=[])
    with pytest.raises(NoLayoutError, match="map corridors-5: none of 400 random plans is suitable"):
        find_valid_map("corridors", 5, kind_number=0, sample_plan=lambda _: corridor, start_radius=1.0)


def test_tunnels_have_loops_and_dead_ends() -> None:
    for layout in range(4):
        plan = draw_tunnels(np.random.default_rng(3), layout)
        hull = shapely.Polygon(plan.boundary).convex_hull
        rock = [obstacle.polygon for obstacle in plan.obstacles]
        free_area = shapely.Polygon(plan.boundary).area - shapely.union_all(rock).area
        assert free_area < 0.55 * hull.area
        assert sum(piece.area > 4.0 for piece in rock) >= 3


def test_parts_of_a_drawing_are_turned_and_mirrored() -> None:
    drawing = Drawing()
    drawing.open_part(10.0, 5.0).add_block(0.0, 0.0, 2.0, 1.0)
    drawing.open_part(10.0, 5.0, 1).add_block(0.0, 0.0, 2.0, 1.0)
    drawing.open_part(10.0, 5.0, 1, mirrored=True).add_block(0.0, 0.0, 2.0, 1.0)
    drawing.open_part(10.0, 5.0, 2).open_part(1.0, 0.0, 1).add_block(0.0, 0.0, 2.0, 1.0)
    bounds = [obstacle.polygon.bounds for obstacle in drawing.obstacles]
    assert bounds == [(10, 5, 12, 6), (9, 5, 10, 7), (10, 5, 11, 7), (9, 3, 10, 5)]


def test_walls_have_gaps_at_their_doors() -> None:
    drawing = Drawing()
    drawing.add_wall_with_doors((0.0, 2.0), (10.0, 2.0), [6.0, 0.55], width=1.0, thickness=0.2)
    bounds = [obstacle.polygon.bounds for obstacle in drawing.obstacles]
    # The doors are given out of order. The piece before the door at 0.55 m would be 0.05 m long, which is too
    # short for a wall.
    assert bounds == [pytest.approx((1.05, 1.9, 5.5, 2.1)), pytest.approx((6.5, 1.9, 10.0, 2.1))]


def test_outlines_have_no_needless_corners() -> None:
    left = shapely.box(0.0, 0.0, 2.0, 3.0)
    right = shapely.box(2.0 - 1e-10, 1e-10, 4.0, 3.0)
    assert len(build_outline([left, right])) == 4
    with pytest.raises(ValueError, match="parts: expected connected shapes, got a MultiPolygon"):
        build_outline([left, shapely.box(5.0, 0.0, 6.0, 3.0)])
