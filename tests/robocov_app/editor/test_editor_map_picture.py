"""Images of the editor's map in the size of a phone."""

from __future__ import annotations

from pathlib import Path

import pygame
import pytest
from driven_editor import build_sheet, open_editor

from robocov.environment import CircleObstacle

PHONE = (400, 700)
SCALE = 1.5
CIRCLE = CircleObstacle((6.0, 4.0), 0.5)


@pytest.mark.parametrize("notches", [0, 4])
def test_pixels_of_a_phone_have_pixels_of_the_window(tmp_path: Path, notches: int) -> None:
    with open_editor(tmp_path, build_sheet(CIRCLE)) as driver:
        window = driver.window
        pixel = window.canvas.to_pixel(CIRCLE.center)
        if notches:
            driver.turn_wheel(*pixel, notches)
            pixel = window.canvas.to_pixel(CIRCLE.center)
        reach = window.editor.pixel
        picture = window.map_pictures.draw(PHONE, SCALE, is_controlling=True)
        assert picture.get_size() == PHONE
        assert window.editor.pixel == reach, "tools of the window reach as far as before"
        canvas = window.map_pictures._pictures[PHONE, True]._canvas
        on_phone = canvas.to_pixel(CIRCLE.center)
        assert pygame.Rect(0, 0, *PHONE).collidepoint(on_phone)
        assert picture.get_at((round(on_phone[0]), round(on_phone[1]))) == canvas.theme.obstacle
        assert window.map_pictures.find_window_pixel(PHONE, on_phone) == pytest.approx(pixel)


def test_a_phone_shows_the_map_below_a_dialog(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(CIRCLE)) as driver:
        pictures = driver.window.map_pictures
        before = pygame.image.tobytes(pictures.draw(PHONE, SCALE, is_controlling=False), "RGB")
        driver.window.run_command("palette")
        driver.settle()
        assert driver.window.controls.is_covered
        assert pygame.image.tobytes(pictures.draw(PHONE, SCALE, is_controlling=False), "RGB") == before
        assert pictures.draw_cover(PHONE, SCALE).get_size() == PHONE
