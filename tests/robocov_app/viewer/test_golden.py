"""Whole windows against pictures that were looked at, close enough that a missing number is found."""

from __future__ import annotations

import numpy as np
import pytest
from golden_windows import SCENES, compute_difference, draw_scene, read_golden

TOLERANCE = 1e-4
"""Part of the pixels that may differ."""


@pytest.mark.parametrize("name", SCENES)
def test_the_window_looks_as_it_did(name: str) -> None:
    assert compute_difference(draw_scene(name), read_golden(name)) < TOLERANCE


def test_a_missing_legend_is_found() -> None:
    spoiled = draw_scene("past-light", lambda window: window.do("layer:legend"))
    assert compute_difference(spoiled, read_golden("past-light")) > TOLERANCE


def test_missing_numbers_on_robots_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robocov_app.render.layers.robots.MIN_NUMBER_SIZE_PX", 1000.0)
    assert compute_difference(draw_scene("past-light"), read_golden("past-light")) > TOLERANCE


def test_one_missing_word_of_the_panel_is_found() -> None:
    picture = read_golden("past-light").copy()
    low = picture[20:60, 600:700]
    low[:] = np.median(low.reshape(-1, 3), axis=0)
    assert compute_difference(picture, read_golden("past-light")) > TOLERANCE
