"""Maps that robots discover: known cells, rays, and walls that are removed."""

from __future__ import annotations

from copy import deepcopy

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import Environment
from robocov.planning.discovered_map import (
    CERTAIN_WALL,
    FREE,
    PRESUMED_WALL,
    UNKNOWN,
    WALL,
    DiscoveredMap,
    dilate,
)
from robocov.planning.raster import Raster
from robocov.sensor import RangeSensor
from robocov.world.obstacle_pieces import build_solid_pieces


@pytest.fixture(scope="module")
def sensor(cluttered: Environment) -> RangeSensor:
    return RangeSensor(build_solid_pieces(cluttered))


def build_map(
    environment: Environment, sensor: RangeSensor, positions: np.ndarray, sensing_range: float
) -> DiscoveredMap:
    """Build a map from one scan at each position."""
    known_map = DiscoveredMap.build_unknown(Raster(environment.region, 0.1))
    distances, is_hit = sensor.scan(positions, 120, np.full(len(positions), sensing_range))
    for k, position in enumerate(positions):
        known_map = known_map.add_scan(position, distances[k], is_hit[k])
    return known_map


def sample_free_positions(environment: Environment, n: int, seed: int) -> np.ndarray:
    points = np.random.default_rng(seed).uniform(0.1, 4.9, size=(30 * n, 2))
    is_free = shapely.contains_xy(environment.free.buffer(-0.1), points[:, 0], points[:, 1])
    return points[is_free][:n]


def compute_all_centers(raster: Raster) -> np.ndarray:
    rows, columns = np.indices(raster.shape)
    return raster.compute_centers(rows, columns)


@settings(max_examples=count_examples(15))
@given(seed=st.integers(0, 10_000), sensing_range=st.floats(0.5, 8.0))
def test_known_cells_agree_with_the_environment(
    cluttered: Environment, sensor: RangeSensor, seed: int, sensing_range: float
) -> None:
    """Walls are where walls are, up to a cell; free cells contain free space."""
    positions = sample_free_positions(cluttered, 3, seed)
    known_map = build_map(cluttered, sensor, positions, sensing_range)
    centers = compute_all_centers(known_map.raster)
    walls = shapely.points(centers[known_map.state >= WALL])
    assert shapely.distance(walls, cluttered.free.boundary).max(initial=0.0) < 0.1
    free = shapely.points(centers[known_map.state == FREE])
    assert shapely.distance(free, cluttered.free).max(initial=0.0) < 0.1 * np.sqrt(0.5) + 1e-9


def test_a_repeated_scan_returns_the_same_immutable_map(cluttered: Environment, sensor: RangeSensor) -> None:
    positions = sample_free_positions(cluttered, 4, 1)
    known_map = build_map(cluttered, sensor, positions, 3.0)
    distances, is_hit = sensor.scan(positions, 120, np.full(4, 3.0))
    assert known_map.add_scan(positions[-1], distances[-1], is_hit[-1]) is known_map
    assert deepcopy(known_map) is known_map
    with pytest.raises(ValueError, match="read-only"):
        known_map.state[0, 0] = WALL


def test_nothing_is_known_beyond_the_sensing_range(cluttered: Environment, sensor: RangeSensor) -> None:
    positions = sample_free_positions(cluttered, 1, 5)
    known_map = build_map(cluttered, sensor, positions, 0.8)
    centers = compute_all_centers(known_map.raster)[known_map.state != UNKNOWN]
    assert np.hypot(*(centers - positions[0]).T).max() < 0.8 + 0.1


def test_ends_of_neighboring_rays_are_joined_until_a_ray_passes_between(empty: Environment) -> None:
    raster = Raster(empty.region, 0.1)
    unknown_map = DiscoveredMap.build_unknown(raster)
    closed = unknown_map.add_scan(np.array([2.05, 2.05]), np.full(24, 1.5), np.ones(24, dtype=bool))
    assert (closed.state == PRESUMED_WALL).any()
    row, column = np.argwhere(closed.state == PRESUMED_WALL)[0]
    x, y = raster.compute_centers(row, column)
    ray_length = np.array([np.hypot(x - 0.55, 0.0) + 1.0])
    opened = closed.add_scan(np.array([x - 0.5, y]), ray_length, np.array([False]))
    assert opened.state[row, column] == FREE
    assert (opened.state[closed.state >= WALL] >= WALL).all()


@given(seed=st.integers(0, 1000), radius=st.floats(0.0, 0.8))
def test_cells_where_robots_are_become_free_except_for_walls(
    empty: Environment, seed: int, radius: float
) -> None:
    rng = np.random.default_rng(seed)
    raster = Raster(empty.region, 0.1)
    state = rng.integers(UNKNOWN, CERTAIN_WALL + 1, raster.shape).astype(np.uint8)
    before = DiscoveredMap(raster, state)
    low_x, low_y, high_x, high_y = empty.region.bounds
    positions = rng.uniform((low_x, low_y), (high_x, high_y), (3, 2))
    offsets = compute_all_centers(raster)[:, :, None] - positions
    distance = np.sqrt((offsets**2).sum(axis=-1)).min(axis=-1)
    after = before.add_robots(positions, radius)
    must_be_free = (distance <= radius) & (before.state < WALL)
    assert (after.state == np.where(must_be_free, FREE, before.state)).all()
    assert after.add_robots(positions, radius) is after


def test_a_wall_is_removed_when_rays_have_passed_it_in_several_scans(empty: Environment) -> None:
    position = np.array([2.0, 2.0])
    raster = Raster(empty.region, 0.05)
    distances = np.full(240, 1.0)
    is_hit = np.ones(240, dtype=bool)
    closed = DiscoveredMap.build_unknown(raster).add_scan(position, distances, is_hit)
    assert closed.add_scan(position, distances, is_hit) is closed
    distances[:30] = 1.5
    is_hit[:30] = False
    opened = closed
    for _ in range(CERTAIN_WALL - WALL + 1):
        opened = opened.add_scan(position, distances, is_hit)
    # All cells count except for those next to walls that remain.
    cells_along_arc = 30 * 2.0 * np.pi / 240 / 0.05
    changed = opened.count_changed_walls(closed)
    assert cells_along_arc * 0.6 < changed < cells_along_arc * 2.0
    assert closed.count_changed_walls(opened) == changed
    is_unaffected = (compute_all_centers(raster) - position)[..., 1] < -0.1
    assert np.array_equal(opened.state[is_unaffected], closed.state[is_unaffected])


@settings(max_examples=count_examples(20))
@given(seed=st.integers(0, 1000), reach=st.floats(0.0, 4.0), is_outside_marked=st.booleans())
def test_dilated_cells_are_those_close_to_marked_ones(
    seed: int, reach: float, is_outside_marked: bool
) -> None:
    is_marked = np.random.default_rng(seed).random((14, 11)) < 0.05
    row, column = np.mgrid[:14, :11]
    expected = np.zeros_like(is_marked)
    margin = 5  # cells; more than any reach
    padded = np.pad(is_marked, margin, constant_values=is_outside_marked)
    for r, c in np.argwhere(padded) - margin:
        expected |= (row - r) ** 2 + (column - c) ** 2 <= reach * reach
    assert np.array_equal(dilate(is_marked, reach, is_outside_marked=is_outside_marked), expected)
