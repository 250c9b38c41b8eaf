"""Areas in line of sight and in sensing range."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from cost_cases import OFFICE
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.metrics.visible_area import compute_covered_areas, compute_visibility_polygons

seeds = st.integers(0, 2**32 - 1)
ROOMS = shapely.box(0, 0, 6, 3) - shapely.box(2.9, 0, 3.1, 2)


def build_lattice(free: shapely.Geometry, side: int = 70) -> np.ndarray:
    """Return a lattice of free points, (n, 2) m."""
    low_x, low_y, high_x, high_y = free.bounds
    x, y = np.meshgrid(np.linspace(low_x, high_x, side), np.linspace(low_y, high_y, side))
    points = np.column_stack([x.ravel(), y.ravel()])
    return points[shapely.contains_xy(free, *points.T)]


def is_in_line_of_sight(free: shapely.Geometry, position: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return whether the segment from a position to each target is in the free space."""
    shapely.prepare(free)
    ends = np.stack([np.broadcast_to(position, targets.shape), targets], axis=1)
    return shapely.covers(free, shapely.linestrings(ends))


@settings(max_examples=count_examples(20))
@given(seeds, st.sampled_from(["office", "rooms"]))
def test_visibility_polygons_agree_with_lines_of_sight(seed: int, name: str) -> None:
    rng = np.random.default_rng(seed)
    free = OFFICE.free if name == "office" else ROOMS
    targets = build_lattice(free)
    position = targets[rng.integers(len(targets))] + rng.uniform(-0.01, 0.01, 2)
    assume(shapely.contains_xy(free, *position))
    (view,) = compute_visibility_polygons(free, position[None])
    # Rounding decides about points on the boundary of the view.
    targets = targets[shapely.distance(view.boundary, shapely.points(targets)) > 1e-9]
    is_in_view = shapely.contains_xy(view, *targets.T)
    np.testing.assert_array_equal(is_in_view, is_in_line_of_sight(free, position, targets))


def test_all_of_a_convex_room_is_visible_from_anywhere() -> None:
    walls = shapely.box(0, 0, 4, 3)
    for view in compute_visibility_polygons(walls, np.array([[0.1, 0.1], [2.0, 1.5], [3.999, 2.999]])):
        assert view.area == pytest.approx(12.0, rel=1e-12)


def test_views_along_collinear_corners_are_exact() -> None:
    """Seen from (0.5, 2), both corners at the end of the wall are on one horizontal ray."""
    (view,) = compute_visibility_polygons(ROOMS, np.array([[0.5, 2.0]]))
    assert view.area == pytest.approx(2.9 * 3 + 3.1 * 1, rel=1e-12)


@settings(max_examples=count_examples(6))
@given(seeds, st.integers(1, 5), st.floats(0.3, 6.0))
def test_covered_areas_agree_with_a_fine_lattice(seed: int, n: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    free = OFFICE.free
    targets = build_lattice(free, 90)
    positions = targets[rng.choice(len(targets), n, replace=False)]
    areas = compute_covered_areas(free, positions, np.full(n, reach))
    discs = shapely.union_all(shapely.buffer(shapely.points(positions), reach, quad_segs=1000))
    assert areas.within_range == pytest.approx(shapely.intersection(discs, free).area, rel=1e-4)
    is_visible = np.stack([is_in_line_of_sight(free, position, targets) for position in positions])
    is_near = np.stack([np.hypot(*(targets - position).T) <= reach for position in positions])
    cell_area = free.area / len(targets)
    visible_area = is_visible.any(axis=0).sum() * cell_area
    sensed_area = (is_visible & is_near).any(axis=0).sum() * cell_area
    assert areas.visible == pytest.approx(visible_area, abs=0.05 * free.area)
    assert areas.sensed == pytest.approx(sensed_area, abs=0.05 * free.area)
    assert areas.sensed <= min(areas.within_range, areas.visible) * (1 + 1e-9)


def test_covered_areas_agree_with_discs_and_rectangles() -> None:
    square = shapely.box(0, 0, 10, 10)
    areas = compute_covered_areas(square, np.array([[5.0, 5.0]]), np.array([2.0]))
    assert areas.sensed == pytest.approx(4 * np.pi, rel=5e-5)
    halves = shapely.box(0, 0, 4, 4) - shapely.box(1.9, 0, 2.1, 4)
    areas = compute_covered_areas(halves, np.array([[1.0, 2.0]]), np.array([np.inf]))
    assert areas == pytest.approx((1.9 * 4, 1.9 * 4, 1.9 * 4))
    areas = compute_covered_areas(halves, np.array([[1.0, 2.0]]), np.array([3.0]))
    assert areas.visible == pytest.approx(1.9 * 4)
    assert areas.within_range > areas.visible


def test_robots_outside_the_free_space_cover_nothing() -> None:
    assert compute_covered_areas(ROOMS, np.empty((0, 2)), np.empty(0)) == (0.0, 0.0, 0.0)
    assert compute_covered_areas(ROOMS, np.array([[3.0, 1.0]]), np.array([2.0])) == (0.0, 0.0, 0.0)
