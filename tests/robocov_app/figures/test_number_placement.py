"""Placement of the numbers of robots."""

import numpy as np
import pytest

from robocov_app.figures.number_placement import Discs, join_discs, place_numbers

NOTHING = Discs(np.empty((0, 2)), np.empty(0))


def test_numbers_of_close_marks_are_apart():
    centers = np.array([[0.0, 0.0], [8.0, 0.0], [0.0, 8.0], [8.0, 8.0]])
    numbers = place_numbers(Discs(centers, np.full(4, 3.0)), NOTHING, text_size=6.0)
    distances = np.linalg.norm(numbers[:, None] - numbers, axis=2)
    np.fill_diagonal(distances, np.inf)
    assert distances.min() > 6.0


def test_a_number_is_not_on_a_trajectory():
    points = np.column_stack([np.zeros(50), np.linspace(0.0, 40.0, 50)])
    mark = Discs(np.array([[0.0, 0.0]]), np.array([3.0]))
    (number,) = place_numbers(mark, Discs(points, np.zeros(50)), text_size=6.0)
    assert np.linalg.norm(points - number, axis=1).min() >= 3.6


def test_a_number_is_not_on_another_disc():
    mark = Discs(np.array([[0.0, 0.0]]), np.array([3.0]))
    large = Discs(np.array([[14.0, 0.0]]), np.array([10.0]))
    (number,) = place_numbers(mark, join_discs([mark, large]), text_size=6.0)
    assert np.linalg.norm(number - large.centers[0]) >= 13.6


def test_a_number_is_only_at_an_allowed_position():
    mark = Discs(np.array([[0.0, 0.0]]), np.array([3.0]))
    (number,) = place_numbers(mark, NOTHING, text_size=6.0, is_allowed=lambda points: points[:, 0] < -1.0)
    assert number[0] < -1.0
    assert np.linalg.norm(number) == pytest.approx(6.6)


def test_without_an_allowed_position_a_number_is_still_placed():
    mark = Discs(np.array([[0.0, 0.0]]), np.array([3.0]))
    numbers = place_numbers(
        mark, NOTHING, text_size=6.0, is_allowed=lambda points: np.zeros(len(points), dtype=bool)
    )
    assert np.isfinite(numbers).all()
