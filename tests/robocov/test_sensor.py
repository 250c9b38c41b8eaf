"""The range sensor: nearest obstacle points and ray scans."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import Environment, WallObstacle
from robocov.sensor import RangeSensor
from robocov.world.obstacle_pieces import build_solid_pieces


@pytest.fixture(scope="module")
def sensor(cluttered: Environment) -> RangeSensor:
    return RangeSensor(build_solid_pieces(cluttered))


def sample_free_points(environment: Environment, n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 10, size=(20 * n, 2))
    return points[shapely.contains_xy(environment.free, points[:, 0], points[:, 1])][:n]


def test_nearest_points_agree_with_shapely(cluttered: Environment, sensor: RangeSensor) -> None:
    points = sample_free_points(cluttered, 400, 0)
    nearest = sensor.find_nearest_points(points, np.full(len(points), np.inf))
    expected = shapely.distance(shapely.points(points), cluttered.free.boundary)
    np.testing.assert_allclose(np.hypot(*(nearest - points).T), expected, atol=1e-9)
    on_wall = shapely.distance(shapely.points(nearest), cluttered.free.boundary)
    assert on_wall.max() < 1e-9


def test_the_nearest_point_of_a_position_on_a_surface_is_the_position() -> None:
    wall = Environment("wall", ((0, 0), (8, 0), (8, 6), (0, 6)), (WallObstacle(((2, 0), (2, 1)), 0.2),))
    sensor = RangeSensor(build_solid_pieces(wall))
    positions = np.array([[2.1, 0.5], [0.0, 3.0]])
    np.testing.assert_array_equal(sensor.find_nearest_points(positions, np.ones(2)), positions)


def test_nothing_is_sensed_beyond_the_range(cluttered: Environment, sensor: RangeSensor) -> None:
    points = sample_free_points(cluttered, 200, 1)
    distance = shapely.distance(shapely.points(points), cluttered.free.boundary)
    ranges = np.where(np.arange(len(points)) % 2, 0.5, 1.5)
    nearest = sensor.find_nearest_points(points, ranges)
    np.testing.assert_array_equal(np.isnan(nearest[:, 0]), distance > ranges)


def test_a_query_does_not_depend_on_the_others(cluttered: Environment, sensor: RangeSensor) -> None:
    points = sample_free_points(cluttered, 30, 3)
    ranges = np.full(len(points), 2.0)
    together = sensor.find_nearest_points(points, ranges)
    for i in range(len(points)):
        alone = sensor.find_nearest_points(points[i : i + 1], ranges[i : i + 1])
        assert np.array_equal(alone[0], together[i], equal_nan=True)


@settings(max_examples=count_examples(40))
@given(x=st.floats(0.2, 4.8), y=st.floats(0.2, 4.8), rays=st.integers(1, 48), reach=st.floats(0.1, 20))
def test_scan_agrees_with_shapely(
    cluttered: Environment, sensor: RangeSensor, x: float, y: float, rays: int, reach: float
) -> None:
    position = np.array([x, y])
    point = shapely.Point(position)
    assume(cluttered.free.contains(point))
    assume(cluttered.free.boundary.distance(point) > 1e-3)
    distances, ends = sensor.scan_from(position, rays, reach)
    for k in range(rays):
        angle = 2 * np.pi * k / rays
        direction = np.array([np.cos(angle), np.sin(angle)])
        ray = shapely.LineString([position, position + reach * direction])
        hits = shapely.intersection(ray, cluttered.free.boundary)
        expected = reach if hits.is_empty else hits.distance(point)
        assert distances[k] == pytest.approx(expected, abs=1e-6)
        np.testing.assert_allclose(ends[k], position + distances[k] * direction, atol=1e-9)


def test_failed_robots_are_obstacles_as_long_as_they_are_given() -> None:
    sensor = RangeSensor((np.array([[9.0, -1.0], [10.0, -1.0], [10.0, 1.0], [9.0, 1.0]]),))
    position = np.zeros((1, 2))
    ranges = np.array([5.0])
    assert np.isnan(sensor.find_nearest_points(position, ranges)).all()
    sensor.set_time(1.0, np.array([[2.0, 0.0, 0.5], [0.0, 3.0, 0.5]]))
    np.testing.assert_allclose(sensor.find_nearest_points(position, ranges), [[1.5, 0.0]], atol=1e-12)
    sensor.set_time(2.0, np.array([[0.0, 3.0, 0.5]]))
    np.testing.assert_allclose(sensor.find_nearest_points(position, ranges), [[0.0, 2.5]], atol=1e-12)
    sensor.set_time(0.0)
    assert np.isnan(sensor.find_nearest_points(position, ranges)).all()


def test_the_first_ray_points_along_x(sensor: RangeSensor) -> None:
    distances, points = sensor.scan_from(np.array([1.0, 2.0]), 4, 50.0)
    np.testing.assert_allclose(distances, [1.5, 3.0, 1.0, 2.0], atol=2e-3)
    np.testing.assert_allclose(points[0], [2.5, 2.0], atol=2e-3)
