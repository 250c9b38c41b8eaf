"""Whole windows compared with reference images."""

from __future__ import annotations

import numpy as np
import pytest
from golden_windows import SCENES, compute_difference, draw_scene, read_golden

TOLERANCE = 1e-4
"""Maximum fraction of pixels that differ visibly."""


@pytest.mark.parametrize("name", SCENES)
def test_windows_look_like_their_reference_images(name: str) -> None:
    assert compute_difference(draw_scene(name), read_golden(name)) < TOLERANCE


def test_a_missing_legend_is_found() -> None:
    changed_frame = draw_scene("past-light", lambda window: window.run_command("layer:legend"))
    assert compute_difference(changed_frame, read_golden("past-light")) > TOLERANCE


def test_missing_numbers_on_robots_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robocov_app.render.layers.robots.MIN_NUMBER_SIZE_PX", 1000.0)
    assert compute_difference(draw_scene("past-light"), read_golden("past-light")) > TOLERANCE


def test_one_missing_word_of_the_panel_is_found() -> None:
    image = read_golden("past-light").copy()
    word = image[20:60, 600:700]
    word[:] = np.median(word.reshape(-1, 3), axis=0)
    assert compute_difference(image, read_golden("past-light")) > TOLERANCE
