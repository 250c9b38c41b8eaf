from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from robocov.planning.voronoi_graph import VoronoiGraph, voronoi_cells

EIGHT = np.ones((3, 3))


def rooms(seed: int, openness: float) -> np.ndarray:
    """Return rooms with round corners, pillars and narrow places."""
    smooth = ndimage.gaussian_filter(np.random.default_rng(seed).normal(size=(40, 50)), 2.0)
    return np.asarray(smooth < np.quantile(smooth, openness))


@given(st.integers(0, 2**32), st.floats(0.2, 0.95))
def test_thinning_keeps_all_connections(seed: int, openness: float) -> None:
    """As many pieces, and as many obstacles within, as the room has; and nothing beside it."""
    room = rooms(seed, openness)
    cells = voronoi_cells(room)
    assert not (cells & ~room).any()
    assert ndimage.label(cells, EIGHT)[1] == ndimage.label(room, EIGHT)[1]
    walls = [ndimage.label(np.pad(~each, 1, constant_values=True))[1] for each in (cells, room)]
    assert walls[0] == walls[1]
    # every piece of the room keeps a part of the graph
    pieces, count = ndimage.label(room, EIGHT)
    assert set(np.unique(pieces[cells])) == set(range(1, count + 1))


def test_it_is_halfway_between_walls() -> None:
    hall = np.ones((21, 61), dtype=bool)
    row, column = voronoi_cells(hall).nonzero()
    assert set(row) <= {9, 10, 11} and set(column) >= set(range(12, 49))
    # there are no branches into the corners
    assert column.min() >= 9 and column.max() <= 51
    around = hall.copy()
    around[8:13, 20:41] = False
    cells = voronoi_cells(around)
    above, below = cells[:8, 20:41], cells[13:, 20:41]
    assert set(above.nonzero()[0]) | set(below.nonzero()[0]) <= {3, 4, 5}
    assert above.any(axis=0).all() and below.any(axis=0).all()


@given(st.integers(0, 2**32))
def test_distances_are_along_the_graph_and_regions_tile_the_room(seed: int) -> None:
    room = rooms(seed, 0.7)
    graph = VoronoiGraph.of(room, room, 3.0, 100)
    straight = np.sqrt(((graph.vertices[:, None] - graph.vertices) ** 2).sum(axis=2))
    np.testing.assert_allclose(graph.distances, graph.distances.T)
    assert (graph.distances >= straight - 1e-9).all()
    pieces = ndimage.label(room, EIGHT)[0][tuple(graph.vertices.T)]
    assert np.array_equal(np.isfinite(graph.distances), pieces[:, None] == pieces)
    inside = graph.region >= 0
    assert not (inside & ~room).any()
    # regions go by shared sides: only what hangs on a corner has no vertex
    assert inside[ndimage.binary_opening(room, EIGHT)].all()
    assert np.array_equal(graph.region[tuple(graph.vertices.T)], np.arange(len(graph.vertices)))


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (4, 4)])
def test_small_rooms_have_a_vertex(shape: tuple[int, int]) -> None:
    graph = VoronoiGraph.of(np.ones(shape, dtype=bool), np.ones(shape, dtype=bool), 3.0, 10)
    assert len(graph.vertices) >= 1
    assert (graph.region >= 0).all()
    nothing = VoronoiGraph.of(np.zeros(shape, dtype=bool), np.ones(shape, dtype=bool), 3.0, 10)
    assert len(nothing.vertices) == 0
