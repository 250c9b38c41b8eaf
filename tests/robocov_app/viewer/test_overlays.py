"""Texts over the window: the help page, messages and long reports."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygame
import pytest
from drawn_strip_texts import (
    MESSAGES_OF_ALL_LENGTHS,
    check_only_boxes_have_texts,
    check_texts_are_complete_or_hidden,
)
from driven_window import open_viewer
from hypothesis import given
from hypothesis import strategies as st
from sample_sessions import RAPF, RPF

from robocov_app.look.theme import LIGHT
from robocov_app.render.annotations.scale_bar import STRIP_HEIGHT_PX
from robocov_app.render.fonts import measure_text
from robocov_app.toolkit.overlay import draw_message, wrap_text
from robocov_app.toolkit.window.layout import Box
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.window import status_display
from robocov_app.viewer.window.screen_video import copy_pixels

MAX_COVERED_PX = 7
"""Maximum height, at scale 1, of the margins of map and chart that a message of two lines covers."""


@given(st.text(st.characters(whitelist_categories=("Ll", "Zs")), max_size=80), st.integers(60, 300))
def test_wrapped_lines_fit_and_contain_all_words(text: str, width: int) -> None:
    lines = wrap_text(text, 12, width)
    assert "".join("".join(lines).split()) == "".join(text.split())
    assert all(measure_text(line, 12) <= width for line in lines)


def test_a_message_in_a_narrow_arena_keeps_its_words_whole() -> None:
    screen = pygame.Surface((390, 700))
    arena = Box(40, 60, 90, 500)
    draw_message(screen, "all controllers restart from the same starts", arena, LIGHT, 1.0, is_error=False)
    mask = pygame.mask.from_threshold(screen, (0, 0, 0), (1, 1, 1))
    mask.invert()
    (box,) = mask.get_bounding_rects()
    assert box.width > measure_text("all controllers", 12)
    assert box.left > 0


def test_a_long_message_is_wrapped_within_the_arena(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        before = copy_pixels(driver.window.screen).copy()
        driver.viewer.show_message("many words " * 40, is_error=True)
        driver.run_frames(1)
        after = copy_pixels(driver.window.screen)
        rows, columns = np.nonzero((after != before).any(axis=2))
        left, top, width, height = driver.window.layout.arena
        assert columns.min() > left
        assert columns.max() < left + width
        assert rows.min() > top
        assert rows.max() < top + height + MAX_COVERED_PX


@pytest.mark.parametrize("text", ["one line", "The team has settled. Try:\nadd a wall"])
@pytest.mark.parametrize("size", [(390, 844), (900, 600), (1280, 720)])
def test_messages_of_one_or_two_lines_leave_the_map_and_the_chart_visible(
    size: tuple[int, int], text: str, tmp_path: Path
) -> None:
    with open_viewer(tmp_path, size=size) as driver:
        layout = driver.window.layout
        top = layout.arena.top
        height = layout.arena.height
        before = driver.copy_frame()
        driver.viewer.show_message(text)
        driver.run_frames(1, seconds=0.0)
        rows, _ = np.nonzero((driver.copy_frame() != before).any(axis=2))
        strip_top = top + height - STRIP_HEIGHT_PX * layout.scale
        assert rows.min() >= strip_top - MAX_COVERED_PX * layout.scale
        assert rows.max() < top + height + MAX_COVERED_PX * layout.scale


@pytest.mark.parametrize("scale", [1.0, 2.0])
@pytest.mark.parametrize("controllers", [(RAPF,), (RAPF, RPF)], ids=["one pane", "two panes"])
def test_a_message_hides_texts_below_the_map_that_it_would_cover_in_part(
    controllers: tuple[ControllerChoice, ...], scale: float, tmp_path: Path
) -> None:
    size = (round(900 * scale), round(600 * scale))
    with open_viewer(tmp_path, *controllers, size=size, scale=scale) as driver:
        boxes = driver.window.canvas.find_strip_texts(driver.window.screen)
        assert len(boxes) == 2
        without_message = driver.copy_frame()
        if len(controllers) == 1:
            arena = driver.window.layout.arena
            check_only_boxes_have_texts(without_message, boxes, arena)
        for text in MESSAGES_OF_ALL_LENGTHS:
            driver.viewer.show_message(text)
            driver.run_frames(1, seconds=0.0)
            message_box = driver.window.message_box
            assert message_box is not None
            check_texts_are_complete_or_hidden(driver.copy_frame(), without_message, boxes, message_box)


def test_a_click_removes_a_message_and_does_nothing_else(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.press_key("a")  # the tool that adds robots
        driver.viewer.show_message("a message")
        driver.run_frames(1, seconds=0.0)
        assert driver.window.message_box is not None
        driver.click(*driver.window.message_box.center)
        assert not driver.viewer.message
        assert driver.window.message_box is None
        assert len(driver.session.displayed.numbers) == 3


def test_escape_removes_a_message(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.viewer.show_message("a message")
        driver.press_key("escape")
        assert not driver.viewer.message


def test_a_dismissed_suggestion_stays_away_until_there_is_another_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    suggestions = ["add a wall"]
    monkeypatch.setattr(status_display, "suggest_actions", lambda viewer: suggestions[-1])
    with open_viewer(tmp_path) as driver:
        driver.window._status.can_suggest = True
        driver.settle()
        assert driver.window.message_box is not None
        driver.click(*driver.window.message_box.center)
        driver.settle()
        assert driver.window.message_box is None
        suggestions.append("fail a robot")
        driver.press_key("v")
        driver.viewer.clear_message()
        driver.settle()
        assert driver.window.message_box is not None


def test_a_message_leaves_the_text_of_a_lesson_without_a_panel_visible(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.press_key("h")
        driver.press_key("f2")
        driver.session.playback.is_playing = False
        driver.viewer.clear_message()
        driver.run_frames(1, seconds=0.0)
        left, top, width, height = driver.window.layout.arena
        lower_half = pygame.Rect(left, top + height // 2, width, height - height // 2)
        before = copy_pixels(driver.window.screen.subsurface(lower_half)).copy()
        driver.viewer.show_message("a message")
        driver.run_frames(1, seconds=0.0)
        assert np.array_equal(copy_pixels(driver.window.screen.subsurface(lower_half)), before)


def test_a_long_report_is_scrolled_to_its_end_by_the_wheel(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, RAPF, RAPF, RAPF) as driver:
        window = driver.window
        driver.viewer.inspection.selected = 1
        window.panel.show_tab("robot")
        driver.session.playback.is_playing = True
        driver.run_frames(30)
        driver.session.playback.is_playing = False
        driver.run_frames(15)
        left, top, width, height = window.layout.panel
        driver.move(left + width // 2, top + height - 40)
        pictures = [copy_pixels(window.screen)[top:, left:].copy()]
        for notches in (-2, -100, -1, 200):
            window.handle_event(pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=notches))
            window.draw()
            pictures.append(copy_pixels(window.screen)[top:, left:].copy())
        start, below_start, end, still_end, start_again = pictures
        assert not np.array_equal(start, below_start)
        assert np.array_equal(end, still_end)
        assert np.array_equal(start, start_again)
