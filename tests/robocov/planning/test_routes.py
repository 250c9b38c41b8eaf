"""Routes around known walls."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from map_window_cases import RASTER, build_map_window, build_random_blocks, build_wall_with_door
from property_examples import count_examples

from robocov.planning.discovered_map import dilate
from robocov.planning.lattice_graph import LatticeGraph
from robocov.planning.map_window import MapWindow
from robocov.planning.node_visibility import NodeVisibility
from robocov.planning.routes import find_route


def find_route_in(map_window: MapWindow, position: np.ndarray, goal: np.ndarray) -> np.ndarray:
    return find_route(LatticeGraph(map_window), NodeVisibility(map_window), position, goal)


@settings(max_examples=count_examples(15))
@given(seed=st.integers(0, 1000))
def test_routes_keep_their_clearance_from_walls(seed: int) -> None:
    """Between waypoints, a route keeps the clearance, up to half a cell."""
    map_window = build_map_window(build_random_blocks(seed), max_nodes=400)
    rng = np.random.default_rng(seed)
    free_cells = np.argwhere(~map_window.is_near_wall)
    if not len(free_cells):
        return
    position = RASTER.compute_centers(*free_cells[rng.integers(len(free_cells))])
    goal = RASTER.compute_centers(*free_cells[rng.integers(len(free_cells))])
    route = find_route_in(map_window, position, goal)
    is_too_close = dilate(map_window.is_blocked, map_window.clearance / 0.1 - 0.5)
    for start, end in zip(np.vstack([position, route[:-1]]), route, strict=True):
        points = start + (end - start) * np.linspace(0.0, 1.0, 400)[:, None]
        # The first cells may be close to a wall, because a robot may start anywhere.
        is_first = np.hypot(*(points - position).T) <= 2.0 * map_window.clearance + 0.1
        assert not is_too_close[RASTER.find_cells(points)][~is_first].any()


def test_a_route_leads_through_the_door() -> None:
    position = np.array([1.0, 1.0])
    goal = np.array([5.0, 1.0])
    route = find_route_in(build_map_window(build_wall_with_door(), max_nodes=600), position, goal)
    np.testing.assert_array_equal(route[-1], goal)
    length = np.hypot(*np.diff(np.vstack([position, route]), axis=0).T).sum()
    shortest = math.hypot(1.9, 2.0) + math.hypot(1.9, 2.0) + 0.2
    assert shortest < length < 1.12 * shortest


@pytest.mark.parametrize(
    ("door", "is_passage"), [(slice(30, 31), False), (slice(30, 32), False), (slice(28, 36), True)]
)
def test_a_crack_is_not_a_passage(door: slice, is_passage: bool) -> None:
    """No robot fits through some holes, for example in a wall that has not been seen completely."""
    map_window = build_map_window(build_wall_with_door(door), max_nodes=600)
    node = NodeVisibility(map_window).find_entry_node(np.array([1.0, 1.0]))
    is_beyond = map_window.has_clearance & (map_window.nodes[:, 0] > 3.5)
    assert np.isfinite(LatticeGraph(map_window).get_distances(node)[is_beyond]).any() == is_passage
    last = find_route_in(map_window, np.array([1.0, 1.0]), np.array([5.0, 1.0]))[-1]
    assert (last[0] > 3.0) == is_passage


@pytest.mark.parametrize("position", [[3.0, 2.0], [2.95, 0.05]])
def test_a_robot_inside_a_wall_finds_a_way_out(position: list[float]) -> None:
    map_window = build_map_window(build_wall_with_door(), max_nodes=600)
    assert np.isfinite(find_route_in(map_window, np.array(position), np.array([5.0, 1.0]))).all()
