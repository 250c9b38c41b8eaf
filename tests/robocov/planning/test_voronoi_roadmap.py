"""Roadmaps halfway between walls: connections, distances and small rooms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from robocov.planning.voronoi_roadmap import VoronoiRoadmap, find_voronoi_cells

EIGHT_NEIGHBORS = np.ones((3, 3))


def build_rooms(seed: int, free_fraction: float) -> np.ndarray:
    """Return the free cells of rooms with round corners, pillars and narrow passages."""
    smooth = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(40, 50)), 2.0)
    return np.asarray(smooth < np.quantile(smooth, free_fraction))


def count_pieces(cells: np.ndarray) -> int:
    return int(ndimage.label(cells, EIGHT_NEIGHBORS)[1])


def count_obstacles(is_free: np.ndarray) -> int:
    return int(ndimage.label(np.pad(~is_free, 1, constant_values=True))[1])


@given(st.integers(0, 2**32), st.floats(0.2, 0.95))
def test_thinning_preserves_all_connections(seed: int, free_fraction: float) -> None:
    """The graph has as many pieces, and encloses as many obstacles, as the free space."""
    is_free = build_rooms(seed, free_fraction)
    is_graph = find_voronoi_cells(is_free)
    assert not (is_graph & ~is_free).any()
    assert count_pieces(is_graph) == count_pieces(is_free)
    assert count_obstacles(is_graph) == count_obstacles(is_free)
    pieces, count = ndimage.label(is_free, EIGHT_NEIGHBORS)
    assert set(np.unique(pieces[is_graph])) == set(range(1, count + 1))


def test_the_graph_is_halfway_between_walls() -> None:
    hall = np.ones((21, 61), dtype=bool)
    row, column = find_voronoi_cells(hall).nonzero()
    assert set(row) <= {9, 10, 11}
    assert set(column) >= set(range(12, 49))
    # There are no branches into the corners.
    assert column.min() >= 9
    assert column.max() <= 51


def test_the_graph_leads_around_an_obstacle() -> None:
    hall = np.ones((21, 61), dtype=bool)
    hall[8:13, 20:41] = False
    is_graph = find_voronoi_cells(hall)
    for corridor in (is_graph[:8, 20:41], is_graph[13:, 20:41]):
        assert set(corridor.nonzero()[0]) <= {3, 4, 5}
        assert corridor.any(axis=0).all()


@given(st.integers(0, 2**32))
def test_distances_are_along_the_graph_and_every_cell_belongs_to_a_vertex(seed: int) -> None:
    is_free = build_rooms(seed, 0.7)
    roadmap = VoronoiRoadmap.build(is_free, is_free, 3.0, 100)
    vertices = roadmap.vertices
    straight = np.sqrt(((vertices[:, None] - vertices) ** 2).sum(axis=2))
    np.testing.assert_allclose(roadmap.distances, roadmap.distances.T)
    assert (roadmap.distances >= straight - 1e-9).all()
    pieces = ndimage.label(is_free, EIGHT_NEIGHBORS)[0][tuple(vertices.T)]
    assert np.array_equal(np.isfinite(roadmap.distances), pieces[:, None] == pieces)
    has_vertex = roadmap.vertex_of_cell >= 0
    # Vertices spread over shared sides: free cells that only share corners with the graph have none.
    side_pieces, _ = ndimage.label(is_free)
    is_connected = np.isin(side_pieces, side_pieces[find_voronoi_cells(is_free)])
    assert np.array_equal(has_vertex, is_free & is_connected)
    assert np.array_equal(roadmap.vertex_of_cell[tuple(vertices.T)], np.arange(len(vertices)))


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (4, 4)])
def test_small_rooms_have_a_vertex_and_none_have_no_vertex(shape: tuple[int, int]) -> None:
    is_free = np.ones(shape, dtype=bool)
    roadmap = VoronoiRoadmap.build(is_free, is_free, 3.0, 10)
    assert len(roadmap.vertices) >= 1
    assert (roadmap.vertex_of_cell >= 0).all()
    empty = VoronoiRoadmap.build(np.zeros(shape, dtype=bool), is_free, 3.0, 10)
    assert len(empty.vertices) == 0
