"""Positions of labels, and texts that are shortened to a width."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import isotonic_regression

from robocov_app.look.labels import shorten_text, shorten_word, spread_labels


@given(st.lists(st.floats(0, 100), min_size=1, max_size=8), st.floats(0.1, 10))
def test_spread_labels_keep_their_order_and_a_gap(positions: list[float], gap: float) -> None:
    spread = np.array(spread_labels(positions, gap, 0.0, 100.0))
    order = np.argsort(positions, kind="stable")
    assert (np.diff(spread[order]) >= gap * (1 - 1e-9)).all()


@given(st.lists(st.floats(0, 100), min_size=1, max_size=8), st.floats(0.1, 10))
def test_spread_labels_stay_within_limits(positions: list[float], gap: float) -> None:
    spread = spread_labels(positions, gap, 0.0, 100.0)
    assert min(spread) >= -1e-9
    assert max(spread) <= 100 + 1e-9


@given(st.lists(st.floats(0, 100), min_size=1, max_size=8), st.floats(0.1, 10))
def test_labels_with_enough_space_are_not_moved(positions: list[float], gap: float) -> None:
    has_space = (np.diff(np.sort(positions)) >= gap).all()
    if has_space:
        assert spread_labels(positions, gap, 0.0, 100.0) == pytest.approx(positions)


@given(st.lists(st.floats(0, 100), min_size=1, max_size=12), st.floats(0.1, 10))
def test_labels_move_as_little_as_possible(positions: list[float], gap: float) -> None:
    order = np.argsort(positions, kind="stable")
    steps = gap * np.arange(len(positions))
    nearest = isotonic_regression(np.array(positions)[order] - steps).x + steps
    spread = np.array(spread_labels(positions, gap, -1e3, 1e3))
    assert spread[order] == pytest.approx(nearest, abs=1e-6)


def test_no_labels_have_no_positions() -> None:
    assert spread_labels([], 5.0, 0.0, 10.0) == []


@given(st.text(max_size=30), st.integers(0, 30))
def test_a_shortened_text_fits(text: str, width: int) -> None:
    assert len(shorten_text(text, len, width)) <= width


@given(st.text(max_size=30))
def test_a_text_that_fits_is_not_shortened(text: str) -> None:
    assert shorten_text(text, len, len(text)) == text


def test_a_text_keeps_a_minimum_of_characters() -> None:
    assert shorten_text("Lloyd", len, 0) == ""
    assert shorten_text("Lloyd", len, 0, min_chars=1) == "L…"
    assert shorten_text("L", len, 0, min_chars=1) == "L"
    assert shorten_text("Lloyd", len, 2, min_chars=5) == "Lloyd"


def test_a_shortened_word_keeps_both_ends() -> None:
    assert shorten_word("short", 40) == "short"
    shortened = shorten_word("a" * 50 + "-of-2024.json", 40)
    assert len(shortened) == 40
    assert shortened.endswith("of-2024.json")
