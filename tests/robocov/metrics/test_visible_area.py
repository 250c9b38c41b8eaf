from __future__ import annotations

import numpy as np
import pytest
import shapely
from cost_cases import OFFICE
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.metrics.visible_area import compute_covered_areas, compute_visibility_polygons

seeds = st.integers(0, 2**32 - 1)
ROOMS = shapely.box(0, 0, 6, 3) - shapely.box(2.9, 0, 3.1, 2)


def lattice(free: shapely.Geometry, side: int = 70) -> np.ndarray:
    """Return a lattice of free places."""
    low_x, low_y, high_x, high_y = free.bounds
    x, y = np.meshgrid(np.linspace(low_x, high_x, side), np.linspace(low_y, high_y, side))
    places = np.column_stack([x.ravel(), y.ravel()])
    return places[shapely.contains_xy(free, *places.T)]


def seen_one_by_one(free: shapely.Geometry, place: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return which targets a place sees: the segment between them is covered by the free space."""
    shapely.prepare(free)
    ends = np.stack([np.broadcast_to(place, targets.shape), targets], axis=1)
    return shapely.covers(free, shapely.linestrings(ends))


@settings(max_examples=20)
@given(seeds, st.sampled_from(["office", "rooms"]))
def test_visibility_polygons_agree_with_lines_of_sight(seed: int, name: str) -> None:
    rng = np.random.default_rng(seed)
    free = OFFICE.free if name == "office" else ROOMS
    targets = lattice(free)
    place = targets[rng.integers(len(targets))] + rng.uniform(-0.01, 0.01, 2)
    if not shapely.contains_xy(free, *place):
        return
    (view,) = compute_visibility_polygons(free, place[None])
    # places on the rim of the view are for rounding to decide
    clear = shapely.distance(view.boundary, shapely.points(targets)) > 1e-9
    inside = shapely.contains_xy(view, *targets.T)
    np.testing.assert_array_equal(inside[clear], seen_one_by_one(free, place, targets)[clear])


def test_all_of_a_convex_room_is_visible_from_anywhere() -> None:
    walls = shapely.box(0, 0, 4, 3)
    for view in compute_visibility_polygons(walls, np.array([[0.1, 0.1], [2.0, 1.5], [3.999, 2.999]])):
        assert view.area == pytest.approx(12.0, rel=1e-12)


def test_views_along_collinear_corners_are_exact() -> None:
    """From (0.5, 2) the two corners of the wall's head are on one level ray, which grazes it."""
    (view,) = compute_visibility_polygons(ROOMS, np.array([[0.5, 2.0]]))
    assert view.area == pytest.approx(2.9 * 3 + 3.1 * 1, rel=1e-12)


@settings(max_examples=6)
@given(seeds, st.integers(1, 5), st.floats(0.3, 6.0))
def test_covered_areas_agree_with_a_fine_lattice(seed: int, n: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    free = OFFICE.free
    targets = lattice(free, 90)
    places = targets[rng.choice(len(targets), n, replace=False)]
    found = compute_covered_areas(free, places, np.full(n, reach))
    discs = shapely.union_all(shapely.buffer(shapely.points(places), reach, quad_segs=1000))
    assert found.within_range == pytest.approx(shapely.intersection(discs, free).area, rel=1e-4)
    seen = np.stack([seen_one_by_one(free, place, targets) for place in places])
    near = np.stack([np.hypot(*(targets - place).T) <= reach for place in places])
    cell = free.area / len(targets)
    assert found.visible == pytest.approx(seen.any(axis=0).sum() * cell, abs=0.05 * free.area)
    assert found.sensed == pytest.approx((seen & near).any(axis=0).sum() * cell, abs=0.05 * free.area)
    assert found.sensed <= min(found.within_range, found.visible) * (1 + 1e-9)


def test_covered_areas_of_known_discs() -> None:
    walls = shapely.box(0, 0, 10, 10)
    assert compute_covered_areas(walls, np.array([[5.0, 5.0]]), np.array([2.0])).sensed == pytest.approx(
        4 * np.pi, rel=5e-5
    )
    halves = shapely.box(0, 0, 4, 4) - shapely.box(1.9, 0, 2.1, 4)
    found = compute_covered_areas(halves, np.array([[1.0, 2.0]]), np.array([np.inf]))
    assert found == pytest.approx((1.9 * 4, 1.9 * 4, 1.9 * 4))
    found = compute_covered_areas(halves, np.array([[1.0, 2.0]]), np.array([3.0]))
    assert found.within_range > found.visible == pytest.approx(1.9 * 4)


def test_robots_outside_the_free_space_cover_nothing() -> None:
    walls = ROOMS
    assert compute_covered_areas(walls, np.empty((0, 2)), np.empty(0)) == (0.0, 0.0, 0.0)
    assert compute_covered_areas(walls, np.array([[3.0, 1.0]]), np.array([2.0])) == (0.0, 0.0, 0.0)
