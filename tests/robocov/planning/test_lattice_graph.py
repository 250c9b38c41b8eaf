"""Shortest distances on the nodes of a map window."""

from __future__ import annotations

import heapq
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from map_window_cases import (
    RASTER,
    build_map_window,
    build_open_room,
    build_random_blocks,
    build_whole_window,
)
from property_examples import count_examples

from robocov.planning.discovered_map import FREE, UNKNOWN, DiscoveredMap
from robocov.planning.lattice_graph import LatticeGraph
from robocov.planning.map_window import MapWindow


def search_with_a_heap(graph: LatticeGraph, first: int) -> dict[int, float]:
    """Return the distances of all reachable nodes by the textbook version of Dijkstra's algorithm."""
    matrix = graph.matrix
    distance = {first: 0.0}
    queue = [(0.0, first)]
    while queue:
        so_far, node = heapq.heappop(queue)
        if so_far > distance[node]:
            continue
        # No edge leads on from a node that is too close to a wall.
        assert graph.map_window.has_clearance[node] or matrix.indptr[node] == matrix.indptr[node + 1]
        for k in range(matrix.indptr[node], matrix.indptr[node + 1]):
            other = int(matrix.indices[k])
            length = so_far + float(matrix.data[k])
            if length < distance.get(other, math.inf):
                distance[other] = length
                heapq.heappush(queue, (length, other))
    return distance


def test_without_walls_distances_are_nearly_straight() -> None:
    graph = LatticeGraph(build_map_window(build_open_room(), clearance=0.0))
    nodes = graph.map_window.nodes
    for node in (0, 40, 77):
        straight = np.hypot(*(nodes - nodes[node]).T)
        distances = graph.get_distances(node)
        is_reached = np.isfinite(distances)
        assert is_reached.mean() > 0.7
        assert (distances[is_reached] >= straight[is_reached] - 1e-9).all()
        # This is the error of sixteen directions.
        assert (distances[is_reached] <= straight[is_reached] * 1.0275 + 1e-9).all()


@settings(max_examples=count_examples(12))
@given(seed=st.integers(0, 1000))
def test_distances_are_those_of_a_plain_search(seed: int) -> None:
    graph = LatticeGraph(build_map_window(build_random_blocks(seed)))
    clear_nodes = np.flatnonzero(graph.map_window.has_clearance)
    if not len(clear_nodes):
        return
    first = int(clear_nodes[0])
    expected = search_with_a_heap(graph, first)
    distances = graph.get_distances(first)
    assert set(np.flatnonzero(np.isfinite(distances)).tolist()) == set(expected)
    np.testing.assert_allclose(distances[list(expected)], list(expected.values()), rtol=1e-9)
    last = int(clear_nodes[-1])
    (limited,) = graph.compute_distance_table([last], limit=1.0)
    assert (limited[np.isfinite(limited)] <= 1.0).all()


@settings(max_examples=count_examples(12))
@given(seed=st.integers(0, 1000))
def test_distances_are_sums_of_edge_lengths_along_predecessors(seed: int) -> None:
    graph = LatticeGraph(build_map_window(build_random_blocks(seed)))
    clear_nodes = np.flatnonzero(graph.map_window.has_clearance)
    if not len(clear_nodes):
        return
    first = int(clear_nodes[0])
    distances, predecessors = graph.find_shortest_paths(first)
    np.testing.assert_allclose(distances, graph.get_distances(first), rtol=1e-9)
    has_predecessor = np.isfinite(distances)
    has_predecessor[first] = False
    ends = np.flatnonzero(has_predecessor)
    last_edge_lengths = graph.matrix[predecessors[ends], ends]
    sums = distances[predecessors[ends]] + last_edge_lengths
    np.testing.assert_allclose(sums, distances[ends], rtol=1e-9)


def test_a_search_from_several_nodes_finds_the_nearest_one_with_its_offset() -> None:
    graph = LatticeGraph(build_map_window(build_open_room()))
    first, second = np.flatnonzero(graph.map_window.has_clearance)[[3, -5]].tolist()
    expected = np.minimum(graph.get_distances(first) + 0.7, graph.get_distances(second))
    np.testing.assert_allclose(graph.compute_nearest_distances([first, second], [0.7, 0.0]), expected)


def test_routes_through_unknown_cells_count_as_longer() -> None:
    state = np.full(RASTER.shape, FREE, dtype=np.uint8)
    dark_state = state.copy()
    dark_state[:, 20:40] = UNKNOWN
    map_window = MapWindow(DiscoveredMap(RASTER, state), build_whole_window(), 0.15)
    dark_window = MapWindow(DiscoveredMap(RASTER, dark_state), build_whole_window(), 0.15)
    nodes = map_window.nodes
    node = int(((nodes - [0.5, 2.0]) ** 2).sum(axis=1).argmin())
    before = LatticeGraph(map_window).get_distances(node)
    after = LatticeGraph(dark_window).get_distances(node)
    is_same_side = np.isfinite(before) & (nodes[:, 0] < 1.9)
    assert np.array_equal(before[is_same_side], after[is_same_side])
    is_across = np.isfinite(before) & (nodes[:, 0] > 4.1)
    unknown_fraction = 2.0 / (nodes[is_across, 0] - nodes[node, 0])
    ratio = after[is_across] / before[is_across]
    assert (ratio > 1.0 + 0.3 * unknown_fraction).all()
    assert (ratio < 1.0 + 0.5 * unknown_fraction).all()
