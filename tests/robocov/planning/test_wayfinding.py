from __future__ import annotations

import heapq
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.observation.region import Region
from robocov.planning.discovered import FREE, UNKNOWN, WALL, DiscoveredMap, Raster, dilate
from robocov.planning.wayfinding import GridPlanner, Window

REGION = Region(np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]]))
RASTER = Raster(REGION, 0.1)


def ways(blocked: np.ndarray, clearance: float = 0.15, most: int = 150) -> GridPlanner:
    window = Window.around(RASTER, np.array([3.0, 2.0]), math.inf, most)
    state = np.where(blocked, WALL, FREE).astype(np.uint8)
    return GridPlanner(DiscoveredMap(RASTER, state), window, clearance)


def walled(door: slice = slice(30, 37)) -> np.ndarray:
    """A wall in the middle with a door."""
    blocked = np.zeros(RASTER.shape, dtype=bool)
    blocked[:, 29:31] = True
    blocked[door, 29:31] = False
    return blocked


def random_blocks(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    blocked = np.zeros(RASTER.shape, dtype=bool)
    for _ in range(rng.integers(0, 8)):
        row, column = rng.integers(0, 36), rng.integers(0, 56)
        blocked[row : row + rng.integers(1, 12), column : column + rng.integers(1, 12)] = True
    return blocked


def test_without_walls_distances_are_nearly_straight() -> None:
    some = ways(np.zeros(RASTER.shape, dtype=bool), clearance=0.0)
    for node in (0, 40, 77):
        straight = np.hypot(*(some.nodes - some.nodes[node]).T)
        found = some.distances(node)
        reached = np.isfinite(found)
        assert reached.mean() > 0.7
        assert (found[reached] >= straight[reached] - 1e-9).all()
        # sixteen directions
        assert (found[reached] <= straight[reached] * 1.0275 + 1e-9).all()


@settings(max_examples=12)
@given(seed=st.integers(0, 1000))
def test_distances_are_those_of_a_plain_search(seed: int) -> None:
    some = ways(random_blocks(seed))
    if not some.roomy.any():
        return
    begin = int(np.flatnonzero(some.roomy)[0])
    graph = some._graph
    best = {begin: 0.0}
    queue = [(0.0, begin)]
    while queue:
        so_far, node = heapq.heappop(queue)
        if so_far > best[node]:
            continue
        # nothing leads on from where there is no room
        assert some.roomy[node] or graph.indptr[node] == graph.indptr[node + 1]
        for k in range(graph.indptr[node], graph.indptr[node + 1]):
            other, length = int(graph.indices[k]), so_far + float(graph.data[k])
            if length < best.get(other, math.inf):
                best[other] = length
                heapq.heappush(queue, (length, other))
    found = some.distances(begin)
    assert set(np.flatnonzero(np.isfinite(found)).tolist()) == set(best)
    np.testing.assert_allclose([found[k] for k in best], list(best.values()), rtol=1e-9)
    (limited,) = some.near([int(np.flatnonzero(some.roomy)[-1])], 1.0)
    assert (limited[np.isfinite(limited)] <= 1.0).all()


@settings(max_examples=15)
@given(seed=st.integers(0, 1000))
def test_routes_keep_off_walls(seed: int) -> None:
    """Between its way-points a route is nowhere closer to a wall than it should be, but for half a cell."""
    some = ways(random_blocks(seed), most=400)
    rng = np.random.default_rng(seed)
    roomy = np.argwhere(~some.tight)
    if not len(roomy):
        return
    place, goal = (RASTER.middles(*roomy[rng.integers(len(roomy))]) for _ in range(2))
    route = some.route(place, goal)
    for begin, end in zip(np.vstack([place, route[:-1]]), route, strict=True):
        part = np.linspace(0.0, 1.0, 400)[:, None]
        points = begin + (end - begin) * part
        met = dilate(some.blocked, some.clearance / 0.1 - 0.5)[RASTER.cells(points)]
        # the first cells may be tight: one may come from anywhere
        assert not met[np.hypot(*(points - place).T) > 2.0 * some.clearance + 0.1].any()


def test_a_route_goes_through_the_door() -> None:
    some = ways(walled(), most=600)
    place, goal = np.array([1.0, 1.0]), np.array([5.0, 1.0])
    route = some.route(place, goal)
    np.testing.assert_array_equal(route[-1], goal)
    length = np.hypot(*np.diff(np.vstack([place, route]), axis=0).T).sum()
    shortest = math.hypot(1.9, 2.0) + math.hypot(1.9, 2.0) + 0.2
    assert shortest < length < 1.12 * shortest


def test_a_crack_is_no_way() -> None:
    """A hole that no robot fits through, as of a wall that was not seen as a whole."""
    for door, through in ((slice(30, 31), False), (slice(30, 32), False), (slice(28, 36), True)):
        some = ways(walled(door), most=600)
        node = some.standing(np.array([1.0, 1.0]))
        beyond = some.nodes[:, 0] > 3.5
        assert np.isfinite(some.distances(node)[beyond & some.roomy]).any() == through
        end = some.route(np.array([1.0, 1.0]), np.array([5.0, 1.0]))[-1]
        assert (end[0] > 3.0) == through


def test_distances_from_places_between_nodes() -> None:
    some = ways(np.zeros(RASTER.shape, dtype=bool), clearance=0.0)
    places = np.array([[1.23, 2.07], [4.4, 1.11]])
    straight = np.hypot(*(some.nodes[:, None] - places).T).min(axis=0)
    found = some.from_places(places)
    reached = np.isfinite(found)
    assert (found[reached] >= straight[reached] - 1e-9).all()
    assert (found[reached] <= 1.06 * straight[reached] + 1e-9).all()
    assert np.isinf(some.from_places(np.empty((0, 2)))).all()


@settings(max_examples=30)
@given(x=st.floats(0, 6), y=st.floats(0, 4), reach=st.floats(0.1, 9.0), most=st.integers(4, 900))
def test_a_window_holds_what_is_near(x: float, y: float, reach: float, most: int) -> None:
    window = Window.around(RASTER, np.array([x, y]), reach, most)
    assert window.rows * window.columns <= most
    rows, columns = RASTER.shape
    row, column = np.mgrid[:rows, :columns]
    near = np.abs(RASTER.middles(row, column) - [x, y]).max(axis=-1) < reach - 0.1
    high, wide = window.row + window.rows * window.stride, window.column + window.columns * window.stride
    assert (row[near] >= window.row).all()
    assert (row[near] < high).all()
    assert (column[near] >= window.column).all()
    assert (column[near] < wide).all()


def test_a_window_may_jut_out_of_the_raster() -> None:
    window = Window(36, 56, 3, 3, 3)
    cut = window.cut(np.zeros(RASTER.shape, dtype=bool), True)
    assert cut.shape == (9, 9)
    assert not cut[:4, :4].any()
    assert cut[4:].all()
    assert cut[:, 4:].all()


@pytest.mark.parametrize("place", [[3.0, 2.0], [2.95, 0.05]])
def test_who_stands_in_a_wall_finds_a_way_out(place: list[float]) -> None:
    route = ways(walled(), most=600).route(np.array(place), np.array([5.0, 1.0]))
    assert np.isfinite(route).all()


def test_ways_through_what_nobody_has_seen_are_longer() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    window = Window.around(RASTER, np.array([3.0, 2.0]), math.inf, 150)
    seen = GridPlanner(DiscoveredMap(RASTER, state), window, 0.15)
    assert seen.updated(DiscoveredMap(RASTER, state.copy()), window) is seen
    dark = state.copy()
    dark[:, 20:40] = UNKNOWN
    unseen = seen.updated(DiscoveredMap(RASTER, dark), window)
    node = int(seen.nearest(np.array([0.3, 2.0])))
    before, after = (each.distances(node) for each in (seen, unseen))
    there = np.isfinite(before) & (seen.nodes[:, 0] < 1.9)
    assert np.array_equal(before[there], after[there])
    across = np.isfinite(before) & (seen.nodes[:, 0] > 4.1)
    straight = 2.0 / np.maximum(seen.nodes[across, 0] - 0.3, 1e-9)
    assert (after[across] / before[across] > 1.0 + 0.3 * straight).all()
    assert (after[across] / before[across] < 1.0 + 0.5 * straight).all()
