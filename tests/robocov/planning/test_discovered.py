from __future__ import annotations

from copy import deepcopy

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.environment import Environment
from robocov.planning.discovered import FREE, PRESUMED, SURE, UNKNOWN, WALL, DiscoveredMap, Raster, dilate
from robocov.sensor import RangeSensor
from robocov.world.obstacle_pieces import build_solid_pieces


@pytest.fixture(scope="module")
def sensor(cluttered: Environment) -> RangeSensor:
    return RangeSensor(build_solid_pieces(cluttered))


def explored(
    environment: Environment, sensor: RangeSensor, places: np.ndarray, reach: float
) -> DiscoveredMap:
    known = DiscoveredMap.nothing(Raster(environment.region, 0.1))
    distances, hit = sensor.scan(places, 120, np.full(len(places), reach))
    for place, far, met in zip(places, distances, hit, strict=True):
        known = known.scanned(place, far, met)
    return known


def free_places(environment: Environment, n: int, seed: int) -> np.ndarray:
    points = np.random.default_rng(seed).uniform(0.1, 4.9, size=(30 * n, 2))
    inside = shapely.contains_xy(environment.free.buffer(-0.1), points[:, 0], points[:, 1])
    return points[inside][:n]


@settings(max_examples=15)
@given(seed=st.integers(0, 10_000), reach=st.floats(0.5, 8.0))
def test_what_is_known_is_true(cluttered: Environment, sensor: RangeSensor, seed: int, reach: float) -> None:
    """Walls are where walls are, up to a cell; free cells have free space in them."""
    known = explored(cluttered, sensor, free_places(cluttered, 3, seed), reach)
    row, column = np.nonzero(known.state >= WALL)
    middles = shapely.points(known.raster.middles(row, column))
    assert shapely.distance(middles, cluttered.free.boundary).max(initial=0.0) < 0.1
    row, column = np.nonzero(known.state == FREE)
    free = shapely.distance(shapely.points(known.raster.middles(row, column)), cluttered.free)
    assert free.max(initial=0.0) < 0.1 * np.sqrt(0.5) + 1e-9


def test_a_scan_again_tells_nothing_new(cluttered: Environment, sensor: RangeSensor) -> None:
    places = free_places(cluttered, 4, 1)
    known = explored(cluttered, sensor, places, 3.0)
    distances, hit = sensor.scan(places, 120, np.full(4, 3.0))
    assert known.scanned(places[-1], distances[-1], hit[-1]) is known
    assert deepcopy(known) is known
    with pytest.raises(ValueError, match="read-only"):
        known.state[0, 0] = WALL


def test_nothing_is_known_beyond_the_range(cluttered: Environment, sensor: RangeSensor) -> None:
    place = free_places(cluttered, 1, 5)
    known = explored(cluttered, sensor, place, 0.8)
    row, column = np.nonzero(known.state != UNKNOWN)
    away = np.hypot(*(known.raster.middles(row, column) - place[0]).T)
    assert away.max() < 0.8 + 0.1


def test_ends_of_rays_on_one_surface_are_joined_and_a_look_opens_a_gap(empty: Environment) -> None:
    raster = Raster(empty.region, 0.1)
    known = DiscoveredMap.nothing(raster)
    distances, hit = np.full(24, 1.5), np.ones(24, dtype=bool)
    known = known.scanned(np.array([2.05, 2.05]), distances, hit)
    assert (known.state == PRESUMED).any()
    row, column = (k[0] for k in np.nonzero(known.state == PRESUMED))
    beyond = raster.middles(row, column)
    ray = np.array([np.hypot(*(beyond - [0.55, beyond[1]])) + 1.0])
    looked = known.scanned(np.array([beyond[0] - 0.5, beyond[1]]), ray, np.array([False]))
    assert looked.state[row, column] == FREE
    assert (looked.state[known.state >= WALL] >= WALL).all()


@given(seed=st.integers(0, 1000), radius=st.floats(0.0, 0.8))
def test_where_robots_were_it_is_free_but_for_walls(empty: Environment, seed: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    raster = Raster(empty.region, 0.1)
    before = DiscoveredMap(raster, rng.integers(UNKNOWN, SURE + 1, raster.shape).astype(np.uint8))
    low_x, low_y, high_x, high_y = empty.region.bounds
    places = rng.uniform((low_x, low_y), (high_x, high_y), (3, 2))
    middles = raster.middles(*np.indices(raster.shape))
    away = np.sqrt(((middles[:, :, None] - places) ** 2).sum(axis=-1)).min(axis=-1)
    after = before.visited(places, radius)
    freed = (away <= radius) & (before.state < WALL)
    assert (after.state == np.where(freed, FREE, before.state)).all()
    assert after.visited(places, radius) is after


def test_maps_are_merged(cluttered: Environment, sensor: RangeSensor) -> None:
    places = free_places(cluttered, 6, 2)
    one, other = (explored(cluttered, sensor, some, 3.0) for some in (places[:3], places[3:]))
    both = one.merged([other])
    seen = (one.state == FREE) | (one.state >= WALL)
    assert np.array_equal(both.state[seen], one.state[seen])
    told = ~seen & (other.state != UNKNOWN)
    assert np.array_equal(both.state[told], other.state[told])
    assert np.array_equal(both.state[~seen & ~told], one.state[~seen & ~told])
    assert both.merged([one, other]) is both


def test_a_wall_is_taken_back_when_rays_have_passed_it_in_several_scans(empty: Environment) -> None:
    place, raster = np.array([2.0, 2.0]), Raster(empty.region, 0.05)
    distances, wall = np.full(240, 1.0), np.ones(240, dtype=bool)
    closed = DiscoveredMap.nothing(raster).scanned(place, distances, wall)
    assert closed.scanned(place, distances, wall) is closed
    distances[:30], wall[:30] = 1.5, False
    opened = closed
    for _ in range(SURE - WALL + 1):
        opened = opened.scanned(place, distances, wall)
    # all but those beside the walls that stay
    arc = 30 * 2.0 * np.pi / 240
    assert arc / 0.05 * 0.6 < opened.walls_changed(closed) < arc / 0.05 * 2.0
    assert closed.walls_changed(opened) == opened.walls_changed(closed)
    still = (raster.middles(*np.indices(raster.shape)) - place)[..., 1] < -0.1
    assert np.array_equal(opened.state[still], closed.state[still])


@settings(max_examples=20)
@given(seed=st.integers(0, 1000), reach=st.floats(0.0, 4.0))
def test_dilated_cells_are_those_near_blocked_ones(seed: int, reach: float) -> None:
    cells = np.random.default_rng(seed).random((14, 11)) < 0.05
    row, column = np.mgrid[:14, :11]
    expected = np.zeros_like(cells)
    padded = np.pad(cells, 5, constant_values=True)
    for r, c in zip(*np.nonzero(padded), strict=True):
        expected |= (row - (r - 5)) ** 2 + (column - (c - 5)) ** 2 <= reach * reach
    assert np.array_equal(dilate(cells, reach), expected)
