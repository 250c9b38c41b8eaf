"""The help page: all keys in readable text, on a card that scrolls if the window is too small for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_editor import EditorDriver, open_editor
from driven_window import Driver, open_viewer

from robocov_app.toolkit.commands import help_page
from robocov_app.viewer.window.screen_video import copy_pixels

MIN_TEXT_PX = 12

SIZES = [((900, 600), 1.0), ((640, 480), 1.0), ((390, 844), 1.0), ((1280, 720), 1.0), ((2560, 1440), 1.5)]


@pytest.fixture
def drawn_texts(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Texts of the help page with their sizes, as they are drawn."""
    texts: dict[str, int] = {}
    render_text = help_page.render_text

    def render_and_list(text: str, size: int, *rest: object, **options: object) -> pygame.Surface:
        texts[text] = size
        return render_text(text, size, *rest, **options)

    monkeypatch.setattr(help_page, "render_text", render_and_list)
    return texts


@pytest.fixture
def small_window(tmp_path: Path) -> Iterator[Driver]:
    with open_viewer(tmp_path, size=(900, 600)) as driver:
        yield driver


@pytest.mark.parametrize("column_count", [1, 2, 3, 4])
def test_two_commands_follow_each_heading_in_its_column(column_count: int, small_window: Driver) -> None:
    window = small_window.window
    lines = help_page._list_lines(window.commands.commands, window.groups)
    cells = help_page._place_lines(lines, column_count)
    for heading, first, second in zip(cells, cells[1:], cells[2:], strict=False):
        if isinstance(heading.line, str):
            assert heading.column == first.column == second.column, heading.line


@pytest.mark.slow
@pytest.mark.parametrize(("size", "scale"), SIZES)
def test_all_keys_are_shown_in_readable_text(
    size: tuple[int, int], scale: float, tmp_path: Path, drawn_texts: dict[str, int]
) -> None:
    with open_viewer(tmp_path, size=size, scale=scale) as driver:
        driver.press_key("f1")
        for _ in range(20):
            driver.press_key("page down")
        # Long titles are shortened.
        starts = tuple(text.rstrip("…") for text in drawn_texts if text.strip("… "))
        for command in driver.window.commands.commands:
            if command.keys and not command.hidden:
                title = command.title.partition(":")[0]
                assert any(title.startswith(start) for start in starts), title
        assert min(drawn_texts.values()) >= MIN_TEXT_PX


@pytest.mark.parametrize("size", [(900, 600), (1280, 720), (1920, 1080)])
@pytest.mark.parametrize("open_window", [open_viewer, open_editor], ids=["viewer", "editor"])
def test_no_title_is_shortened(
    open_window: Callable[..., AbstractContextManager[Driver | EditorDriver]],
    size: tuple[int, int],
    tmp_path: Path,
    drawn_texts: dict[str, int],
) -> None:
    with open_window(tmp_path, size=size) as driver:
        driver.press_key("f1")
        driver.press_key("end")
        driver.press_key("home")
    assert len(drawn_texts) > 100
    assert [text for text in drawn_texts if len(text) > 1 and text.endswith("…")] == []


@pytest.mark.parametrize("size", [(900, 600), (1280, 720), (390, 844)])
def test_nothing_is_drawn_outside_the_card(
    size: tuple[int, int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes: list[pygame.Rect] = []
    draw_card = help_page.draw_card

    def draw_and_list(screen: pygame.Surface, box: pygame.Rect, *rest: object) -> None:
        boxes.append(box.copy())
        draw_card(screen, box, *rest)

    monkeypatch.setattr(help_page, "draw_card", draw_and_list)
    with open_viewer(tmp_path, size=size) as driver:
        window = driver.window
        screen = window.screen
        veiled = screen.copy()
        help_page.draw_veil(veiled, window.theme)
        window.help_page.toggle()
        window.help_page.draw(screen, window.theme, window.layout.scale, window.commands.commands)
        (box,) = boxes
        assert screen.get_rect().contains(box)
        for picture in (veiled, screen):
            picture.fill((0, 0, 0), box)
        assert np.array_equal(copy_pixels(veiled), copy_pixels(screen))


@pytest.mark.parametrize("key", ["down", "page down", "end"])
def test_keys_scroll_the_page_and_do_nothing_else(key: str, small_window: Driver) -> None:
    small_window.press_key("f1")
    top = small_window.copy_frame()
    map_name = small_window.viewer.files.map_name
    small_window.press_key(key)
    assert not small_window.shows_frame(top)
    small_window.press_key("home")
    assert small_window.shows_frame(top)
    assert small_window.viewer.files.map_name == map_name


def test_the_wheel_scrolls_the_page_without_closing_it(small_window: Driver) -> None:
    small_window.press_key("f1")
    top = small_window.copy_frame()
    small_window.post(pygame.MOUSEBUTTONDOWN, pos=(450, 300), button=5)
    small_window.turn_wheel(450, 300, -1)
    assert small_window.window.help_page.is_open
    assert not small_window.shows_frame(top)


def test_an_open_help_page_covers_the_window_of_a_phone(small_window: Driver) -> None:
    small_window.press_key("f1")
    controls = small_window.window.controls
    assert controls.is_covered
    assert controls.scroll_box == (0, 0, 900, 600)


@pytest.mark.parametrize("scale", [1.0, 1.125, 1.25, 1.5])
def test_a_page_that_fits_does_not_scroll(scale: float, tmp_path: Path) -> None:
    with open_viewer(tmp_path, size=(2560, 1440), scale=scale) as driver:
        driver.press_key("f1")
        top = driver.copy_frame()
        driver.press_key("end")
        assert driver.shows_frame(top)
