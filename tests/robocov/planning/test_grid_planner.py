from __future__ import annotations

import heapq
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.observation.region import Region
from robocov.planning.discovered_map import FREE, UNKNOWN, WALL, DiscoveredMap, dilate
from robocov.planning.goal_candidates import choose_candidates
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.raster import Raster
from robocov.planning.window import Window

REGION = Region(np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]]))
RASTER = Raster(REGION, 0.1)
CENTER = np.array([3.0, 2.0])


def build_planner(is_blocked: np.ndarray, clearance: float = 0.15, max_nodes: int = 150) -> GridPlanner:
    window = Window.build_around(RASTER, CENTER, math.inf, max_nodes)
    state = np.where(is_blocked, WALL, FREE).astype(np.uint8)
    return GridPlanner(DiscoveredMap(RASTER, state), window, clearance)


def build_wall_with_door(door: slice = slice(30, 37)) -> np.ndarray:
    """Return the blocked cells of a wall in the middle with a door."""
    is_blocked = np.zeros(RASTER.shape, dtype=bool)
    is_blocked[:, 29:31] = True
    is_blocked[door, 29:31] = False
    return is_blocked


def build_random_blocks(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    is_blocked = np.zeros(RASTER.shape, dtype=bool)
    for _ in range(rng.integers(0, 8)):
        row = rng.integers(0, 36)
        column = rng.integers(0, 56)
        is_blocked[row : row + rng.integers(1, 12), column : column + rng.integers(1, 12)] = True
    return is_blocked


def search_with_a_heap(planner: GridPlanner, first: int) -> dict[int, float]:
    """Return the distances of all reachable nodes by the textbook version of Dijkstra's algorithm."""
    graph = planner.graph.matrix
    distance = {first: 0.0}
    queue = [(0.0, first)]
    while queue:
        so_far, node = heapq.heappop(queue)
        if so_far > distance[node]:
            continue
        # No edge leads on from a node that is too close to a wall.
        assert planner.map_window.has_clearance[node] or graph.indptr[node] == graph.indptr[node + 1]
        for k in range(graph.indptr[node], graph.indptr[node + 1]):
            other = int(graph.indices[k])
            length = so_far + float(graph.data[k])
            if length < distance.get(other, math.inf):
                distance[other] = length
                heapq.heappush(queue, (length, other))
    return distance


def test_without_walls_distances_are_nearly_straight() -> None:
    planner = build_planner(np.zeros(RASTER.shape, dtype=bool), clearance=0.0)
    for node in (0, 40, 77):
        straight = np.hypot(*(planner.map_window.nodes - planner.map_window.nodes[node]).T)
        distances = planner.graph.get_distances(node)
        is_reached = np.isfinite(distances)
        assert is_reached.mean() > 0.7
        assert (distances[is_reached] >= straight[is_reached] - 1e-9).all()
        # This is the error of sixteen directions.
        assert (distances[is_reached] <= straight[is_reached] * 1.0275 + 1e-9).all()


@settings(max_examples=12)
@given(seed=st.integers(0, 1000))
def test_distances_are_those_of_a_plain_search(seed: int) -> None:
    planner = build_planner(build_random_blocks(seed))
    if not planner.map_window.has_clearance.any():
        return
    first = int(np.flatnonzero(planner.map_window.has_clearance)[0])
    expected = search_with_a_heap(planner, first)
    distances = planner.graph.get_distances(first)
    assert set(np.flatnonzero(np.isfinite(distances)).tolist()) == set(expected)
    np.testing.assert_allclose(distances[list(expected)], list(expected.values()), rtol=1e-9)
    last = int(np.flatnonzero(planner.map_window.has_clearance)[-1])
    (limited,) = planner.graph.compute_distances_within([last], 1.0)
    assert (limited[np.isfinite(limited)] <= 1.0).all()


@settings(max_examples=15)
@given(seed=st.integers(0, 1000))
def test_routes_keep_their_clearance_from_walls(seed: int) -> None:
    """Between waypoints, a route keeps the clearance, up to half a cell."""
    planner = build_planner(build_random_blocks(seed), max_nodes=400)
    rng = np.random.default_rng(seed)
    free_cells = np.argwhere(~planner.map_window.is_near_wall)
    if not len(free_cells):
        return
    position = RASTER.compute_centers(*free_cells[rng.integers(len(free_cells))])
    goal = RASTER.compute_centers(*free_cells[rng.integers(len(free_cells))])
    route = planner.find_route(position, goal)
    is_too_close = dilate(planner.map_window.is_blocked, planner.clearance / 0.1 - 0.5)
    for start, end in zip(np.vstack([position, route[:-1]]), route, strict=True):
        points = start + (end - start) * np.linspace(0.0, 1.0, 400)[:, None]
        # The first cells may be close to a wall, because a robot may start anywhere.
        is_first = np.hypot(*(points - position).T) <= 2.0 * planner.clearance + 0.1
        assert not is_too_close[RASTER.find_cells(points)][~is_first].any()


def test_a_route_leads_through_the_door() -> None:
    planner = build_planner(build_wall_with_door(), max_nodes=600)
    position = np.array([1.0, 1.0])
    goal = np.array([5.0, 1.0])
    route = planner.find_route(position, goal)
    np.testing.assert_array_equal(route[-1], goal)
    length = np.hypot(*np.diff(np.vstack([position, route]), axis=0).T).sum()
    shortest = math.hypot(1.9, 2.0) + math.hypot(1.9, 2.0) + 0.2
    assert shortest < length < 1.12 * shortest


@pytest.mark.parametrize(
    ("door", "is_passage"), [(slice(30, 31), False), (slice(30, 32), False), (slice(28, 36), True)]
)
def test_a_crack_is_no_passage(door: slice, is_passage: bool) -> None:
    """No robot fits through some holes, for example in a wall that has not been seen completely."""
    planner = build_planner(build_wall_with_door(door), max_nodes=600)
    node = planner.visibility.find_visible_node(np.array([1.0, 1.0]))
    is_beyond = planner.map_window.nodes[:, 0] > 3.5
    assert (
        np.isfinite(planner.graph.get_distances(node)[is_beyond & planner.map_window.has_clearance]).any()
        == is_passage
    )
    last = planner.find_route(np.array([1.0, 1.0]), np.array([5.0, 1.0]))[-1]
    assert (last[0] > 3.0) == is_passage


def test_distances_from_positions_between_nodes() -> None:
    planner = build_planner(np.zeros(RASTER.shape, dtype=bool), clearance=0.0)
    positions = np.array([[1.23, 2.07], [4.4, 1.11]])
    straight = np.hypot(*(planner.map_window.nodes[:, None] - positions).T).min(axis=0)
    distances = planner.compute_distances_from(positions)
    is_reached = np.isfinite(distances)
    assert (distances[is_reached] >= straight[is_reached] - 1e-9).all()
    assert (distances[is_reached] <= 1.06 * straight[is_reached] + 1e-9).all()
    assert np.isinf(planner.compute_distances_from(np.empty((0, 2)))).all()


@pytest.mark.parametrize("position", [[3.0, 2.0], [2.95, 0.05]])
def test_a_robot_inside_a_wall_finds_a_way_out(position: list[float]) -> None:
    planner = build_planner(build_wall_with_door(), max_nodes=600)
    assert np.isfinite(planner.find_route(np.array(position), np.array([5.0, 1.0]))).all()


def test_a_map_that_has_not_changed_keeps_its_planner() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    window = Window.build_around(RASTER, CENTER, math.inf, 150)
    planner = GridPlanner(DiscoveredMap(RASTER, state), window, 0.15)
    assert planner.update(DiscoveredMap(RASTER, state.copy()), window) is planner


def test_robots_that_share_a_map_share_its_planner() -> None:
    known_map = DiscoveredMap(RASTER, np.full(RASTER.shape, FREE, dtype=np.uint8))
    window = Window.build_around(RASTER, CENTER, math.inf, 150)
    planner = GridPlanner.get_shared(known_map, window, 0.15)
    assert GridPlanner.get_shared(known_map, window, 0.15) is planner
    assert GridPlanner.get_shared(known_map, window, 0.2) is not planner


def test_routes_through_unknown_cells_count_as_longer() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    window = Window.build_around(RASTER, CENTER, math.inf, 150)
    planner = GridPlanner(DiscoveredMap(RASTER, state), window, 0.15)
    dark = state.copy()
    dark[:, 20:40] = UNKNOWN
    dark_planner = planner.update(DiscoveredMap(RASTER, dark), window)
    node = planner.visibility.find_nearest_node(np.array([0.3, 2.0]))
    before = planner.graph.get_distances(node)
    after = dark_planner.graph.get_distances(node)
    is_same_side = np.isfinite(before) & (planner.map_window.nodes[:, 0] < 1.9)
    assert np.array_equal(before[is_same_side], after[is_same_side])
    is_across = np.isfinite(before) & (planner.map_window.nodes[:, 0] > 4.1)
    unknown_fraction = 2.0 / np.maximum(planner.map_window.nodes[is_across, 0] - 0.3, 1e-9)
    ratio = after[is_across] / before[is_across]
    assert (ratio > 1.0 + 0.3 * unknown_fraction).all()
    assert (ratio < 1.0 + 0.5 * unknown_fraction).all()


@settings(max_examples=25)
@given(seed=st.integers(0, 1000), max_nodes=st.sampled_from([150, 600, 2400]))
def test_no_usable_node_is_far_from_all_candidates(seed: int, max_nodes: int) -> None:
    planner = build_planner(build_random_blocks(seed), max_nodes=max_nodes)
    is_usable = planner.map_window.has_clearance & (planner.map_window.nodes[:, 0] < 5.0)
    candidates = choose_candidates(planner.graph, is_usable)
    assert is_usable[candidates].all()
    assert len(set(candidates.tolist())) == len(candidates)
    step = 1
    while len(planner.map_window.nodes) / step**2 > max(180, len(planner.map_window.nodes) // 9):
        step += 1
    distances = planner.graph.compute_distance_table(candidates).min(axis=0)
    assert distances[is_usable].max() <= 1.5 * step * planner.map_window.spacing


def test_candidates_are_in_every_second_row_and_column_of_open_space() -> None:
    planner = build_planner(np.zeros(RASTER.shape, dtype=bool), clearance=0.0, max_nodes=600)
    candidates = choose_candidates(planner.graph, planner.map_window.has_clearance)
    rows, columns = np.divmod(candidates, planner.window.columns)
    assert set((rows % 2).tolist()) == set((columns % 2).tolist()) == {1}
    assert len(candidates) == (planner.window.rows // 2) * (planner.window.columns // 2)


def test_team_candidates_are_those_of_the_robots_own_component() -> None:
    is_blocked = build_wall_with_door(slice(0, 0))
    planner = build_planner(is_blocked)
    left = planner.visibility.find_nearest_node(np.array([1.0, 2.0]))
    right = planner.visibility.find_nearest_node(np.array([5.0, 2.0]))
    for node, is_left in ((left, True), (right, False), (left, True)):
        candidates = planner.get_team_candidates(node)
        assert ((planner.map_window.nodes[candidates.nodes, 0] < 3.0) == is_left).all()
        np.testing.assert_array_equal(
            candidates.distances[:, node], planner.graph.get_distances(node)[candidates.nodes]
        )


def test_a_visible_node_is_not_behind_a_wall() -> None:
    planner = build_planner(build_wall_with_door(), max_nodes=40)
    position = np.array([2.88, 1.0])
    nearest = planner.map_window.nodes[planner.visibility.find_nearest_node(position)]
    visible = planner.map_window.nodes[planner.visibility.find_visible_node(position)]
    assert visible[0] < 2.9 < 3.1 < nearest[0]
