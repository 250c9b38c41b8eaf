"""The icon of the windows."""

import pygame
import pytest

from robocov_app.toolkit.window.display import open_display, open_window
from robocov_app.toolkit.window.icon import ICON_SIZE_PX, render_icon


def test_the_icon_has_transparent_corners() -> None:
    icon = render_icon()
    assert icon.get_size() == (ICON_SIZE_PX, ICON_SIZE_PX)
    assert icon.get_at((0, 0)).a == 0


def test_the_icon_has_three_robots_of_different_colors() -> None:
    icon = render_icon()
    colors = {tuple(icon.get_at(pixel)) for pixel in ((16, 18), (49, 18), (30, 49))}
    assert len(colors) == 3


def test_a_window_has_the_icon(monkeypatch: pytest.MonkeyPatch) -> None:
    icons: list[pygame.Surface] = []
    monkeypatch.setattr(pygame.display, "set_icon", icons.append)
    with open_display(headless=True):
        open_window((900, 600))
    assert [icon.get_size() for icon in icons] == [(ICON_SIZE_PX, ICON_SIZE_PX)]
