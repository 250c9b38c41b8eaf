"""The picture of a dialog on a phone that controls a window of another size."""

import pygame
import pytest

from robocov_app.look.theme import LIGHT
from robocov_app.toolkit.window.cover_picture import CoverPicture

DIALOG = pygame.Rect(400, 100, 300, 200)
RED = (255, 0, 0)


def draw_window() -> pygame.Surface:
    window = pygame.Surface((1280, 720), 0, 32)
    window.fill(RED, DIALOG)
    return window


@pytest.mark.parametrize(("size", "max_factor"), [((390, 790), 2.0), ((844, 338), 1.0), ((200, 200), 3.0)])
def test_a_dialog_is_shown_alone_and_points_are_found_in_the_window(size, max_factor):
    cover = CoverPicture()
    picture = cover.draw(draw_window(), DIALOG, size, max_factor, LIGHT)
    assert picture.get_size() == size
    red = pygame.mask.from_threshold(picture, RED, (4, 4, 4, 255))
    (shown,) = red.get_bounding_rects()
    assert shown.width / shown.height == pytest.approx(1.5, abs=0.02)
    factor = shown.width / DIALOG.width
    assert factor == pytest.approx(min(size[0] / 300, size[1] / 200, max_factor), abs=0.01)
    assert cover.find_window_pixel(size, shown.topleft) == pytest.approx(DIALOG.topleft, abs=1.0)
    assert cover.find_window_pixel(size, shown.bottomright) == pytest.approx(DIALOG.bottomright, abs=1.0)


def test_a_point_next_to_the_dialog_is_next_to_it_in_the_window():
    cover = CoverPicture()
    cover.draw(draw_window(), DIALOG, (390, 790), 2.0, LIGHT)
    assert not DIALOG.collidepoint(cover.find_window_pixel((390, 790), (195, 780)))


def test_points_of_a_picture_of_another_size_are_those_of_the_window():
    cover = CoverPicture()
    cover.draw(draw_window(), DIALOG, (390, 790), 2.0, LIGHT)
    assert cover.find_window_pixel((844, 338), (10, 20)) == (10, 20)
