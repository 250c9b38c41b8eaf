"""What lies over the window: words that fit, keys that are all there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import open_viewer
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.render.fonts import measure_text
from robocov_app.toolkit import help_page as keys_page
from robocov_app.toolkit.overlay import wrap_text
from robocov_app.viewer.commands import GROUPS
from robocov_app.viewer.screen_video import copy_pixels


@given(st.text(st.characters(whitelist_categories=("Ll", "Zs")), max_size=80), st.integers(60, 300))
def test_wrapped_words_are_all_there_and_fit(text: str, width: int) -> None:
    lines = wrap_text(text, 12, width)
    assert "".join("".join(lines).split()) == "".join(text.split())
    assert all(measure_text(line, 12) <= width for line in lines), "a word that is too wide is broken"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "scale"), [((900, 600), 1.0), ((1280, 720), 1.0), ((1920, 1080), 1.5), ((3840, 2160), 2.0)]
)
def test_the_keys_are_all_on_one_card(
    size: tuple[int, int], scale: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes: list[pygame.Rect] = []
    words: set[str] = set()
    real_label, real_card = keys_page.label, keys_page.draw_card

    def label(text, *rest):
        words.add(text)
        return real_label(text, *rest)

    def draw_card(screen, box, *rest):
        boxes.append(box.copy())
        real_card(screen, box, *rest)

    with open_viewer(tmp_path, size=size, scale=scale) as driver:
        window = driver.window
        paler = window.screen.copy()
        keys_page.draw_veil(paler, window.theme)
        monkeypatch.setattr(keys_page, "label", label)
        monkeypatch.setattr(keys_page, "draw_card", draw_card)
        keys_page.draw_help_page(
            window.screen, window.theme, window.layout.scale, window.commands.commands, groups=GROUPS, hint=""
        )
        (box,) = boxes
        assert window.screen.get_rect().contains(box)
        for action in (each for each in window.commands.commands if each.keys):
            title = action.title.partition(":")[0]
            assert any(word.strip("… ") and title.startswith(word.rstrip("…")) for word in words), title
        # nothing sticks out
        for picture in (paler, window.screen):
            picture.fill((0, 0, 0), box)
        assert np.array_equal(copy_pixels(paler), copy_pixels(window.screen))


def test_a_long_message_is_broken_into_lines_that_stay_in_the_arena(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        before = copy_pixels(driver.window.screen).copy()
        driver.viewer.show_message("many words " * 40, is_error=True)
        driver.frames(1)
        after = copy_pixels(driver.window.screen)
        rows, columns = np.nonzero((after != before).any(axis=2))
        _, _, width, height = driver.window.layout.arena
        assert columns.max() < width and columns.min() > 0
        assert rows.max() < height


def test_a_long_report_is_scrolled_by_the_wheel_and_no_further_than_its_end(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        window = driver.window
        driver.viewer.inspection.selected = 1
        window.panel.show_tab("robot")
        driver.session.playback.is_playing = True
        driver.frames(30)
        driver.session.playback.is_playing = False
        driver.frames(15)
        left, top, width, height = window.layout.panel
        driver.move(left + width // 2, top + height - 40)
        seen = [copy_pixels(window.screen)[top:, left:].copy()]
        for notches in (-2, -100, -1, 200):
            window.handle_event(pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=notches))
            window.draw()
            seen.append(copy_pixels(window.screen)[top:, left:].copy())
        assert not np.array_equal(seen[0], seen[1])
        assert np.array_equal(seen[2], seen[3])  # it ends there
        assert np.array_equal(seen[0], seen[4])
