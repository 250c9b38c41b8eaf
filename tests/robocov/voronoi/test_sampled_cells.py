"""Voronoi cells as sets of sample points."""

from __future__ import annotations

import numpy as np

from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

SAMPLES = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])


def test_samples_belong_to_the_nearest_robot_and_to_both_if_they_are_equally_near() -> None:
    """The robots at x = 0 and x = 2 know of each other; the third one knows of no other."""
    positions = np.array([[0.0, 0.0], [2.0, 0.0], [2.5, 0.0]])
    is_own = find_own_samples(SAMPLES, positions, np.array([0, 1]), positions[[1, 0]])
    assert is_own.tolist() == [[True, True, False, False], [False, True, True, True], [True] * 4]


def test_centroids_are_weighted_by_mass_and_empty_cells_keep_their_position() -> None:
    is_own = np.array([[True, True, False, False], [False, False, True, False], [False] * 4])
    positions = np.array([[0.5, 0.0], [2.0, 1.0], [7.0, 8.0]])
    mass = np.array([1.0, 3.0, 0.0, 1.0])
    centroids = compute_sample_centroids(is_own, SAMPLES, mass, positions)
    assert centroids.tolist() == [[0.75, 0.0], [2.0, 1.0], [7.0, 8.0]]
