"""Placement of the numbers next to starts."""

import numpy as np
import pytest

from robocov_app.figures.start_numbers import place_start_numbers


def test_numbers_of_close_starts_are_apart():
    starts = np.array([[0.0, 0.0], [8.0, 0.0], [0.0, 8.0], [8.0, 8.0]])
    centers = place_start_numbers(starts, np.empty((0, 2)), mark_size=6.0, text_size=6.0)
    distances = np.linalg.norm(centers[:, None] - centers, axis=2)
    np.fill_diagonal(distances, np.inf)
    assert distances.min() > 6.0


def test_a_number_is_not_on_the_trajectory():
    trajectory = np.column_stack([np.zeros(50), np.linspace(0.0, 40.0, 50)])
    (center,) = place_start_numbers(np.array([[0.0, 0.0]]), trajectory, mark_size=6.0, text_size=6.0)
    distances = np.linalg.norm(trajectory - center, axis=1)
    assert distances.min() == pytest.approx(6.6)
