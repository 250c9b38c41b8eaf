from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.environment import Environment
from robocov.sensor import RangeSensor
from robocov.world.solid import solid_pieces


@pytest.fixture(scope="module")
def sensor(cluttered: Environment) -> RangeSensor:
    return RangeSensor(solid_pieces(cluttered))


def free_points(environment: Environment, n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 10, size=(20 * n, 2))
    return points[shapely.contains_xy(environment.free, points[:, 0], points[:, 1])][:n]


def test_nearest_points_agree_with_shapely(cluttered: Environment, sensor: RangeSensor) -> None:
    points = free_points(cluttered, 400, 0)
    nearest = sensor.nearest(points, np.full(len(points), np.inf))
    expected = shapely.distance(shapely.points(points), cluttered.free.boundary)
    np.testing.assert_allclose(np.hypot(*(nearest - points).T), expected, atol=1e-9)
    on_wall = shapely.distance(shapely.points(nearest), cluttered.free.boundary)
    assert on_wall.max() < 1e-9


def test_nothing_is_sensed_beyond_the_range(cluttered: Environment, sensor: RangeSensor) -> None:
    points = free_points(cluttered, 200, 1)
    distance = shapely.distance(shapely.points(points), cluttered.free.boundary)
    reach = np.where(np.arange(len(points)) % 2, 0.5, 1.5)
    nearest = sensor.nearest(points, reach)
    assert (np.isnan(nearest[:, 0]) == (distance > reach)).all()


def test_the_direct_queries_are_the_public_ones(cluttered: Environment, sensor: RangeSensor) -> None:
    public = RangeSensor(solid_pieces(cluttered))
    assert sensor._addresses is not None, "kernels can call C here"
    public._addresses = None
    points = free_points(cluttered, 100, 2)
    for reach in (0.3, 1.0, np.inf):
        ranges = np.full(len(points), reach)
        assert np.array_equal(sensor.nearest(points, ranges), public.nearest(points, ranges), equal_nan=True)


def test_a_query_does_not_depend_on_the_others(cluttered: Environment, sensor: RangeSensor) -> None:
    points = free_points(cluttered, 30, 3)
    ranges = np.full(len(points), 2.0)
    together = sensor.nearest(points, ranges)
    for i in range(len(points)):
        alone = sensor.nearest(points[i : i + 1], ranges[i : i + 1])
        assert np.array_equal(alone[0], together[i], equal_nan=True)


@settings(max_examples=40)
@given(x=st.floats(0.2, 4.8), y=st.floats(0.2, 4.8), rays=st.integers(1, 48), reach=st.floats(0.1, 20))
def test_scan_agrees_with_shapely(
    cluttered: Environment, sensor: RangeSensor, x: float, y: float, rays: int, reach: float
) -> None:
    place = np.array([x, y])
    if cluttered.free.boundary.distance(shapely.Point(place)) < 1e-3 or not cluttered.free.contains(
        shapely.Point(place)
    ):
        return
    distances, points = sensor.scan(place, rays, reach)
    for k in range(rays):
        angle = 2 * np.pi * k / rays
        end = place + reach * np.array([np.cos(angle), np.sin(angle)])
        met = shapely.intersection(shapely.LineString([place, end]), cluttered.free.boundary)
        expected = reach if met.is_empty else met.distance(shapely.Point(place))
        assert distances[k] == pytest.approx(expected, abs=1e-6)
        np.testing.assert_allclose(points[k], place + distances[k] * (end - place) / reach, atol=1e-9)


def test_the_first_ray_looks_east(sensor: RangeSensor) -> None:
    distances, points = sensor.scan(np.array([1.0, 2.0]), 4, 50.0)
    np.testing.assert_allclose(distances, [1.5, 3.0, 1.0, 2.0], atol=2e-3)
    np.testing.assert_allclose(points[0], [2.5, 2.0], atol=2e-3)
