"""The choice of nodes that may become goals."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from map_window_cases import build_map_window, build_open_room, build_random_blocks
from property_examples import count_examples

from robocov.planning.goal_candidates import choose_candidates
from robocov.planning.lattice_graph import LatticeGraph


@settings(max_examples=count_examples(25))
@given(seed=st.integers(0, 1000), max_nodes=st.sampled_from([150, 600, 2400]))
def test_no_usable_node_is_far_from_all_candidates(seed: int, max_nodes: int) -> None:
    map_window = build_map_window(build_random_blocks(seed), max_nodes=max_nodes)
    graph = LatticeGraph(map_window)
    is_usable = map_window.has_clearance & (map_window.nodes[:, 0] < 5.0)
    candidates = choose_candidates(graph, is_usable)
    assert is_usable[candidates].all()
    assert len(set(candidates.tolist())) == len(candidates)
    step = 1
    while len(map_window.nodes) / step**2 > max(180, len(map_window.nodes) // 9):
        step += 1
    distances = graph.compute_distance_table(candidates).min(axis=0)
    assert distances[is_usable].max() <= 1.5 * step * map_window.spacing


def test_candidates_are_in_every_second_row_and_column_of_open_space() -> None:
    map_window = build_map_window(build_open_room(), clearance=0.0, max_nodes=600)
    candidates = choose_candidates(LatticeGraph(map_window), map_window.has_clearance)
    rows, columns = np.divmod(candidates, map_window.window.columns)
    assert set((rows % 2).tolist()) == set((columns % 2).tolist()) == {1}
    assert len(candidates) == (map_window.window.rows // 2) * (map_window.window.columns // 2)
