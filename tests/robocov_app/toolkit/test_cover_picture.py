"""Dialogs on a phone that controls a window of another size."""

import pygame
import pytest

from robocov_app.look.theme import LIGHT
from robocov_app.toolkit.window.cover_picture import CoverPicture

DIALOG = pygame.Rect(400, 100, 300, 200)
RED = (255, 0, 0)


def draw_window() -> pygame.Surface:
    """Return a black window with a red dialog."""
    window = pygame.Surface((1280, 720), 0, 32)
    window.fill(RED, DIALOG)
    return window


def find_red_rect(surface: pygame.Surface) -> pygame.Rect:
    """Return the only red rectangle of a surface."""
    mask = pygame.mask.from_threshold(surface, RED, (4, 4, 4, 255))
    (rect,) = mask.get_bounding_rects()
    return rect


SIZES = pytest.mark.parametrize(
    ("size", "max_factor"), [((390, 790), 2.0), ((844, 338), 1.0), ((200, 200), 3.0)]
)


@SIZES
def test_a_dialog_fills_the_phone_up_to_a_maximum_factor(size: tuple[int, int], max_factor: float) -> None:
    picture = CoverPicture().draw(draw_window(), DIALOG, size, max_factor, LIGHT)
    rect = find_red_rect(picture)
    expected_factor = min(size[0] / DIALOG.width, size[1] / DIALOG.height, max_factor)
    assert picture.get_size() == size
    assert rect.width / rect.height == pytest.approx(DIALOG.width / DIALOG.height, abs=0.02)
    assert rect.width / DIALOG.width == pytest.approx(expected_factor, abs=0.01)


@SIZES
def test_pixels_of_the_dialog_are_found_in_the_window(size: tuple[int, int], max_factor: float) -> None:
    cover = CoverPicture()
    rect = find_red_rect(cover.draw(draw_window(), DIALOG, size, max_factor, LIGHT))
    assert cover.find_window_pixel(size, rect.topleft) == pytest.approx(DIALOG.topleft, abs=1.0)
    assert cover.find_window_pixel(size, rect.bottomright) == pytest.approx(DIALOG.bottomright, abs=1.0)


def test_a_pixel_outside_the_dialog_is_outside_it_in_the_window() -> None:
    cover = CoverPicture()
    cover.draw(draw_window(), DIALOG, (390, 790), 2.0, LIGHT)
    assert not DIALOG.collidepoint(cover.find_window_pixel((390, 790), (195, 780)))


def test_pixels_of_a_phone_of_another_size_are_those_of_the_window() -> None:
    cover = CoverPicture()
    cover.draw(draw_window(), DIALOG, (390, 790), 2.0, LIGHT)
    assert cover.find_window_pixel((844, 338), (10, 20)) == (10, 20)
