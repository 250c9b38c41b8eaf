"""Portals: paths through passages that the moves of a coarse lattice miss."""

from __future__ import annotations

import math
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import RASTER, build_map
from property_examples import count_examples
from scipy import ndimage
from scipy.sparse.csgraph import connected_components

from robocov.planning.discovered_map import UNKNOWN, DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.lattice_graph import build_matrix
from robocov.planning.window import Window
from robocov.typing import FloatArray

COARSE = Window.build_around(RASTER, np.array([4.0, 2.0]), math.inf, 30)
LEFT = np.array([1.0, 2.0])
RIGHT = np.array([7.0, 2.0])
LOWER_HALF = (slice(0, 22), slice(39, 41))
UPPER_HALF = (slice(27, 40), slice(39, 41))
"""The two halves of a wall through the middle, with a door of 0.5 m between them."""


def build_coarse_planner(known_map: DiscoveredMap) -> GridPlanner:
    """Build a planner whose moves all miss the door."""
    return GridPlanner(known_map, COARSE, 0.15)


def build_planner_among_walls(seed: int, wall_count: int, max_nodes: int) -> GridPlanner:
    """Build a planner on a map with random upright walls."""
    rng = np.random.default_rng(seed)
    rows, columns = RASTER.shape
    walls = []
    for _ in range(wall_count):
        row = rng.integers(rows)
        column = rng.integers(columns)
        length = rng.integers(5, 30)
        if rng.random() < 0.5:
            walls.append((slice(row, row + 1), slice(column, column + length)))
        else:
            walls.append((slice(row, row + length), slice(column, column + 1)))
    window = Window.build_around(RASTER, np.array([4.0, 2.0]), math.inf, max_nodes)
    return GridPlanner(build_map(*walls), window, 0.15)


@pytest.fixture
def planner() -> GridPlanner:
    return build_coarse_planner(build_map(LOWER_HALF, UPPER_HALF))


def test_the_moves_alone_miss_the_door(planner):
    first = planner.visibility.find_nearest_node(LEFT)
    last = planner.visibility.find_nearest_node(RIGHT)
    _, pieces = connected_components(
        build_matrix(planner.graph.straight_edges), directed=True, connection="strong"
    )
    assert pieces[first] != pieces[last]


def test_distances_lead_through_a_door_that_the_moves_miss(planner):
    distances = planner.compute_distances_from(LEFT[None])
    node = planner.visibility.find_nearest_node(RIGHT)
    door = np.array([4.0, 2.45])
    length = math.dist(LEFT, door) + math.dist(door, planner.map_window.nodes[node])
    assert 0.98 * length <= distances[node] <= 1.25 * length


def test_a_route_leads_through_the_door_at_a_distance_from_walls(planner):
    route = planner.find_route(LEFT, RIGHT)
    np.testing.assert_array_equal(route[-1], RIGHT)
    points = np.vstack([LEFT, route])
    for start, end in pairwise(points):
        assert planner.visibility.find_clear_lines(start, end[None], planner.map_window.is_near_wall)[0]


def test_a_door_that_has_not_been_seen_is_not_a_portal():
    known_map = build_map(LOWER_HALF, UPPER_HALF)
    state = known_map.state.copy()
    state[22:27, 39:41] = UNKNOWN
    planner = build_coarse_planner(DiscoveredMap(RASTER, state))
    assert not len(planner.graph.portals.paths)


def test_there_are_no_portals_where_moves_connect_all_nodes():
    assert not len(build_coarse_planner(build_map()).graph.portals.paths)


@settings(max_examples=count_examples(60))
@given(st.integers(0, 2**32), st.integers(1, 30), st.sampled_from([60, 120, 250]))
def test_portals_connect_all_nodes_that_cells_connect(seed, wall_count, max_nodes):
    planner = build_planner_among_walls(seed, wall_count, max_nodes)
    is_passable = planner.map_window.is_free & ~planner.map_window.is_near_wall
    cells = np.column_stack(RASTER.find_cells(planner.map_window.nodes))
    check_portals(planner, cells, is_passable)
    _, pieces = connected_components(planner.graph.matrix, directed=True, connection="strong")
    areas, _ = ndimage.label(is_passable)
    node_areas = areas[tuple(cells.T)]
    for area in np.unique(node_areas[node_areas > 0]):
        assert len(np.unique(pieces[node_areas == area])) == 1


def check_portals(planner: GridPlanner, cells, is_passable) -> None:
    """Check that each portal is a path of neighboring free cells between its nodes, and its length."""
    portals = planner.graph.portals
    for first, last, length, path in zip(*portals, strict=True):
        np.testing.assert_array_equal(path[[0, -1]], cells[[first, last]])
        steps = np.abs(np.diff(path, axis=0))
        assert steps.max() == 1
        assert is_passable[tuple(path.T)].all()
        # Neither of the two cells beside a step across a corner is a wall.
        assert is_passable[path[:-1, 0], path[1:, 1]].all()
        assert is_passable[path[1:, 0], path[:-1, 1]].all()
        expected = np.where(steps.sum(axis=1) == 2, 1.4, 1.0).sum()
        assert length == pytest.approx(expected)
        assert length >= math.dist(cells[first], cells[last]) * 0.98


def compute_cell_distances(is_passable, sources) -> FloatArray:
    """Compute the distance from the nearest source to each cell, in sides of a cell, by relaxation."""
    distances = np.full(is_passable.shape, np.inf)
    distances[tuple(sources.T)] = 0.0
    previous = None
    while not np.array_equal(distances, previous):
        previous = distances.copy()
        padded = np.pad(distances, 1, constant_values=np.inf)
        is_free = np.pad(is_passable, 1)
        for up, right in product((-1, 0, 1), repeat=2):
            beside = (slice(1 + up, 1 + up + len(distances)), slice(1, -1))
            above = (slice(1, -1), slice(1 + right, 1 + right + distances.shape[1]))
            neighbors = padded[beside[0], above[1]] + (1.4 if up and right else 1.0)
            can_step = is_passable & is_free[beside] & is_free[above]
            np.minimum(distances, np.where(can_step, neighbors, np.inf), out=distances)
    return distances


@settings(max_examples=count_examples(60))
@given(st.integers(0, 2**32), st.integers(1, 30))
def test_portals_are_the_shortest_paths_from_the_nearest_nodes(seed, wall_count):
    planner = build_planner_among_walls(seed, wall_count, 60)
    is_passable = planner.map_window.is_free & ~planner.map_window.is_near_wall
    cells = np.column_stack(RASTER.find_cells(planner.map_window.nodes))
    distances = compute_cell_distances(is_passable, cells[is_passable[tuple(cells.T)]])
    for path in planner.graph.portals.paths:
        from_first = np.concatenate([[0.0], np.cumsum(np.where(np.diff(path, axis=0).all(axis=1), 1.4, 1.0))])
        from_nearest = np.minimum(from_first, from_first[-1] - from_first)
        np.testing.assert_allclose(from_nearest, distances[tuple(path.T)], atol=1e-9)
