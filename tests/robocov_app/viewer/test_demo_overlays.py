"""What lies over the window: words that fit, keys that are all there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import opened
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.render.fonts import text_width
from robocov_app.viewer import overlays
from robocov_app.viewer.actions import all_actions
from robocov_app.viewer.film import pixels
from robocov_app.viewer.overlays import Palette, wrapped


@given(st.text(st.characters(whitelist_categories=("Ll", "Zs")), max_size=80), st.integers(60, 300))
def test_wrapped_words_are_all_there_and_fit(text: str, width: int) -> None:
    lines = wrapped(text, 12, width)
    assert " ".join(lines).split() == text.split()
    for line in lines:
        assert text_width(line, 12) <= width or " " not in line


@pytest.mark.parametrize(
    ("size", "scale"), [((900, 600), 1.0), ((1280, 720), 1.0), ((1920, 1080), 1.5), ((3840, 2160), 2.0)]
)
def test_the_keys_are_all_on_one_card(
    size: tuple[int, int], scale: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes: list[pygame.Rect] = []
    words: set[str] = set()
    real_label, real_card = overlays.label, overlays.card

    def label(text, *rest):
        words.add(text)
        return real_label(text, *rest)

    def card(screen, box, *rest):
        boxes.append(box.copy())
        real_card(screen, box, *rest)

    with opened(tmp_path, size=size, scale=scale) as driver:
        window = driver.window
        paler = window.screen.copy()
        overlays.dim(paler, window.theme)
        monkeypatch.setattr(overlays, "label", label)
        monkeypatch.setattr(overlays, "card", card)
        overlays.draw_help(window.screen, window.layout, window.theme, window.titles)
        (box,) = boxes
        assert window.screen.get_rect().contains(box)
        for action in all_actions(window.titles):
            title = action.title.partition(":")[0]
            assert any(word.strip("… ") and title.startswith(word.rstrip("…")) for word in words), title
        # nothing sticks out
        for picture in (paler, window.screen):
            picture.fill((0, 0, 0), box)
        assert np.array_equal(pixels(paler), pixels(window.screen))


def test_the_palette_finds_actions_and_knows_commands(tmp_path: Path) -> None:
    with opened(tmp_path) as driver:
        palette = Palette(driver.desk, driver.window.titles)
        palette.show()
        assert len(palette.found) == Palette.ROWS
        palette.type("single")
        assert [action.name for action in palette.found] == ["step"]
        assert not palette.is_command()
        palette.text = "k_rep = 0.5"
        assert palette.is_command()
        palette.text = "robots 12"
        assert palette.is_command()
        palette.text = "robots"
        assert not palette.is_command()
        palette.text = "no such thing"
        assert palette.found == []
        palette.move(1)
        assert palette.chosen == 0


def test_a_long_message_is_broken_into_lines_that_stay_in_the_arena(tmp_path: Path) -> None:
    with opened(tmp_path) as driver:
        before = pixels(driver.window.screen).copy()
        driver.desk.say("many words " * 40, trouble=True)
        driver.frames(1)
        after = pixels(driver.window.screen)
        rows, columns = np.nonzero((after != before).any(axis=2))
        _, _, width, height = driver.window.layout.arena
        assert columns.max() < width and columns.min() > 0
        assert rows.max() < height


def test_a_long_report_is_scrolled_by_the_wheel_and_no_further_than_its_end(tmp_path: Path) -> None:
    with opened(tmp_path) as driver:
        window = driver.window
        driver.desk.hand.selected = 1
        window.panel.show_tab("robot")
        driver.session.playing = True
        driver.frames(30)
        driver.session.playing = False
        driver.frames(15)
        left, top, width, height = window.layout.panel
        driver.move(left + width // 2, top + height - 40)
        seen = [pixels(window.screen)[top:, left:].copy()]
        for notches in (-2, -100, -1, 200):
            window.take(pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=notches))
            window.draw()
            seen.append(pixels(window.screen)[top:, left:].copy())
        assert not np.array_equal(seen[0], seen[1])
        assert np.array_equal(seen[2], seen[3])  # it ends there
        assert np.array_equal(seen[0], seen[4])
