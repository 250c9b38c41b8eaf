"""The choice of nodes that may become goals."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from map_window_cases import build_map_window, build_open_room, build_random_blocks
from property_examples import count_examples

from robocov.planning.goal_candidates import choose_candidates
from robocov.planning.lattice_graph import LatticeGraph

MAX_CANDIDATES = 180
"""Maximum number of candidates on regular rows and columns of a small window."""
NODES_PER_CANDIDATE = 9
"""Minimum number of nodes for each of these candidates in a large window."""
MAX_DISTANCE_STEPS = 1.5
"""Maximum distance of a usable node from the nearest candidate, in steps between regular candidates."""


@settings(max_examples=count_examples(25))
@given(seed=st.integers(0, 1000), max_nodes=st.sampled_from([150, 600, 2400]))
def test_no_usable_node_is_far_from_all_candidates(seed: int, max_nodes: int) -> None:
    map_window = build_map_window(build_random_blocks(seed), max_nodes=max_nodes)
    graph = LatticeGraph(map_window)
    is_in_left_part = map_window.nodes[:, 0] < 5.0
    is_usable = map_window.has_clearance & is_in_left_part
    candidates = choose_candidates(graph, is_usable)
    assert is_usable[candidates].all()
    assert len(set(candidates.tolist())) == len(candidates)
    # Every k-th row and column contain at most 1/k² of the nodes. With this step, these are few enough, so
    # the step between regular candidates is not larger.
    node_count = len(map_window.nodes)
    max_regular_candidates = max(MAX_CANDIDATES, node_count // NODES_PER_CANDIDATE)
    step = 1
    while node_count / step**2 > max_regular_candidates:
        step += 1
    distances = graph.compute_distance_table(candidates).min(axis=0)
    assert distances[is_usable].max() <= MAX_DISTANCE_STEPS * step * map_window.spacing


def test_candidates_are_in_every_second_row_and_column_of_open_space() -> None:
    map_window = build_map_window(build_open_room(), clearance=0.0, max_nodes=600)
    candidates = choose_candidates(LatticeGraph(map_window), map_window.has_clearance)
    rows, columns = np.divmod(candidates, map_window.window.columns)
    assert set((rows % 2).tolist()) == set((columns % 2).tolist()) == {1}
    assert len(candidates) == (map_window.window.rows // 2) * (map_window.window.columns // 2)
