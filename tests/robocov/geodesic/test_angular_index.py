"""The index of walls by their direction, with which lines of sight are found."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st

from robocov.environment import Environment, PolygonObstacle
from robocov.geodesic import Geodesics
from robocov.geodesic.angular_index import (
    AngularWallIndex,
    add_walls,
    compute_pseudo_angle,
    is_box_hidden,
    is_visible,
)

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
STEPS_PER_METER = 2.0**48


def build_geodesics(*obstacles):
    rings = [tuple(map(tuple, obstacle)) for obstacle in obstacles]
    return Geodesics(Environment("test", SQUARE, tuple(PolygonObstacle(ring) for ring in rings)))


def build_index(geodesics, sources, reach, bins=64):
    index = AngularWallIndex.allocate(len(sources), bins, 5000 * len(sources))
    used = 0
    for number, (x, y) in enumerate(sources):
        used = add_walls(geodesics.walls, index, number, x, y, reach**2, used)
        assert used >= 0
    return index


def compute_visibility(geodesics, index, targets):
    """Return which of the targets each source sees, (sources, targets)."""
    return np.array(
        [
            [is_visible(geodesics.walls, index, source, *target) for target in targets]
            for source in range(len(index.positions))
        ]
    )


def test_pseudo_angles_grow_with_the_angle():
    angle = np.linspace(-np.pi / 2, 3 * np.pi / 2, 1000, endpoint=False)
    values = np.array([compute_pseudo_angle(np.cos(a), np.sin(a)) for a in angle])
    assert (np.diff(values) > 0.0).all()
    assert values.min() >= 0.0
    assert values.max() <= 4.0


@pytest.mark.parametrize("bins", [1, 8, 64, 256])
def test_visibility_does_not_depend_on_the_number_of_bins(bins):
    rng = np.random.default_rng(2)
    triangles = [rng.uniform(0.1, 0.9, 2) + 0.07 * np.array([[1, 0], [0, 1], [-1, 0.3]]) for _ in range(12)]
    geodesics = build_geodesics(*triangles)
    points = np.rint(rng.uniform(size=(40, 2)) * STEPS_PER_METER)
    points = points[shapely.intersects_xy(geodesics.free, *points.T)]
    source, target = np.indices((len(points), len(points))).reshape(2, -1)
    lines = shapely.linestrings(np.stack([points[source], points[target]], axis=1))
    expected = shapely.covers(geodesics.free, lines) | (source == target)
    # Visibility is found by the bins within the reach, and along the segment beyond it.
    for reach in (2.0**49, 2.0**46, 0.0):
        index = build_index(geodesics, points, reach, bins)
        np.testing.assert_array_equal(compute_visibility(geodesics, index, points).ravel(), expected)


def test_the_index_contains_only_walls_within_reach():
    geodesics = build_geodesics([(0.7, 0.2), (0.8, 0.2), (0.8, 0.8), (0.7, 0.8)])
    source = np.array([0.6, 0.5]) * STEPS_PER_METER
    target = np.array([0.9, 0.5]) * STEPS_PER_METER
    for reach, has_walls in ((0.05, False), (0.31, True)):
        index = build_index(geodesics, [source], reach * STEPS_PER_METER)
        assert (index.heads >= 0).any() == has_walls
        assert not compute_visibility(geodesics, index, [target])


def test_a_source_on_a_wall_does_not_see_through_it():
    geodesics = build_geodesics([(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)])
    sources = np.array([[0.25, 0.5], [0.5, 0.75]]) * STEPS_PER_METER
    targets = np.array([[0.875, 0.5], [0.125, 0.5], [0.25, 0.875], [0.5, 0.875], [0.5, 0.125]])
    targets *= STEPS_PER_METER
    is_seen = compute_visibility(geodesics, build_index(geodesics, sources, np.inf), targets)
    assert is_seen.tolist() == [[False, True, True, False, False], [False, False, True, True, False]]


@pytest.mark.timeout(60)
def test_each_bin_is_checked_once_however_long_the_box_is():
    """The angle of a long box next to a source is estimated to be many turns."""
    index = AngularWallIndex.allocate(1, 8, 1)
    index.positions[:] = 0.0
    index.squared_horizons[:] = 0.0
    boxes = np.array([[-(2.0**30), 1.0, 2.0**30, 1.0]])
    assert is_box_hidden(boxes, 0, index, 0)
    index.squared_horizons[0, 5] = 2.0
    assert not is_box_hidden(boxes, 0, index, 0)


@given(
    size=st.tuples(st.floats(0.0, 1e3), st.floats(0.0, 1e3)),
    offset=st.tuples(st.floats(-2e3, 2e3), st.floats(-2e3, 2e3)),
    fraction=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
)
@example(size=(400.0, 2.0), offset=(-380.0, -3.0), fraction=(1.0, 1.0))
def test_a_box_is_not_hidden_if_one_of_its_points_is_in_an_open_direction(size, offset, fraction):
    low = np.array(offset)
    high = low + size
    point = low + np.multiply(fraction, size)
    index = AngularWallIndex.allocate(1, 64, 1)
    index.positions[:] = 0.0
    index.squared_horizons[:] = 0.0
    open_bin = int(compute_pseudo_angle(*point) * 16)
    index.squared_horizons[0, open_bin % 64] = np.inf
    assert not is_box_hidden(np.array([[*low, *high]]), 0, index, 0)
