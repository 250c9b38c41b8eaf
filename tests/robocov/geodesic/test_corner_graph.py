"""Shortest paths over the graph of corners."""

from __future__ import annotations

import numpy as np

from robocov.geodesic.corner_graph import CornerPaths, CornerQueue, build_corner_graph, relax_paths


def test_of_equally_short_paths_the_one_from_the_first_source_is_taken() -> None:
    """The path from source 1 is found first, since its corner is the first in the queue."""
    graph = build_corner_graph(3, np.array([[0, 2], [1, 2]]), np.array([1.0, 1.0]))
    paths = CornerPaths(
        lengths=np.array([5.0, 5.0, np.inf]),
        sources=np.array([1, 0, 2]),
        first_corners=np.array([0, 1, -1]),
        previous_corners=np.array([-1, -1, -1]),
    )
    queue = CornerQueue(corners=np.array([0, 1, 0, 0]), is_waiting=np.array([True, True, False]))
    relax_paths(graph, paths, queue, 2)
    assert paths.lengths.tolist() == [5.0, 5.0, 6.0]
    assert paths.sources[2] == 0
    assert paths.first_corners[2] == 1
    assert paths.previous_corners[2] == 1
