"""The window on a phone: the sheet of the panel, fingers, a whole lesson, and the buttons of the page."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path

import pygame
import pytest
from driven_window import Driver, open_viewer

from robocov_app.toolkit.window.input import COMMAND_EVENT
from robocov_app.toolkit.window.page_view import PageAppearance
from robocov_app.viewer.lessons.player import LessonPlayer, LessonState
from robocov_app.viewer.window.status import suggest_actions

RATIO = 2.0
PORTRAIT = (780, 1584)
LANDSCAPE = (1688, 676)
TARGET_PX = 48
"""Minimum height of buttons for fingers at scale 1, px."""
MAX_TAPS = 100
"""More than enough taps for a whole lesson."""


@contextmanager
def open_phone(folder: Path, size: tuple[int, int]) -> Iterator[Driver]:
    """Open a window on a phone, with the panel closed."""
    with open_viewer(folder, size=size, scale=RATIO) as driver:
        driver.viewer.view.is_compact = True
        driver.window.lesson.is_unattended = False
        driver.viewer.view.has_panel = False
        driver.settle()
        driver.settle()
        yield driver


@pytest.fixture(params=[PORTRAIT, LANDSCAPE], ids=["portrait", "landscape"])
def phone(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Driver]:
    with open_phone(tmp_path, request.param) as driver:
        yield driver


@pytest.fixture
def upright_phone(tmp_path: Path) -> Iterator[Driver]:
    with open_phone(tmp_path, PORTRAIT) as driver:
        yield driver


def run_page_command(driver: Driver, name: str) -> None:
    """Run a command as a button of the page does."""
    driver.post(COMMAND_EVENT, name=name)
    driver.settle()


def find_area(driver: Driver, name: str) -> pygame.Rect | None:
    """Return the box of a button of the lesson; None if it is not shown."""
    boxes = [area.box for area in driver.window.lesson.click_areas if area.name == name]
    return boxes[0] if boxes else None


def get_player(driver: Driver) -> LessonPlayer:
    player = driver.window.lesson.player
    assert player is not None
    return player


# the panel


def test_the_map_stays_visible_next_to_the_panel(phone: Driver) -> None:
    run_page_command(phone, "panel")
    layout = phone.window.layout
    assert layout.has_panel
    width, height = layout.size
    if width < height:
        assert layout.panel.height + layout.handle.height <= 0.6 * height + 1
        assert layout.panel.width == layout.arena.width == width
    assert layout.arena.width * layout.arena.height >= 0.39 * width * height
    assert not layout.bar.height
    assert not layout.rail.width


@pytest.mark.parametrize("distance", [0, 60])
def test_the_sheet_is_tapped_or_dragged_closed(upright_phone: Driver, distance: int) -> None:
    run_page_command(upright_phone, "panel")
    x, y = pygame.Rect(upright_phone.window.layout.handle).center
    upright_phone.drag((x, y), (x, y + distance // 2), (x, y + distance))
    assert not upright_phone.viewer.view.has_panel
    assert not upright_phone.window.layout.has_panel


def test_a_short_drag_of_the_handle_leaves_the_sheet_open(upright_phone: Driver) -> None:
    run_page_command(upright_phone, "panel")
    x, y = pygame.Rect(upright_phone.window.layout.handle).center
    upright_phone.drag((x, y), (x, y - 200))
    assert upright_phone.viewer.view.has_panel
    # The handle is released: a later click belongs to the map again.
    upright_phone.click_at((0.6, 3.6))
    assert upright_phone.viewer.view.has_panel


def test_nothing_of_the_chart_is_drawn_over_the_sheet_or_the_map(upright_phone: Driver) -> None:
    run_page_command(upright_phone, "panel")
    before = upright_phone.copy_frame()
    upright_phone.window.chart.draw(upright_phone.window.screen)
    assert upright_phone.shows_frame(before)


def test_a_finger_next_to_the_groove_moves_a_slider(phone: Driver) -> None:
    run_page_command(phone, "panel")
    name = "k_rep"
    value = phone.viewer.session.displayed.get_setup(phone.viewer.pane).controller
    slider = phone.get_widget("slider", name)
    phone.click(slider.rect.left + 0.9 * slider.rect.width, slider.rect.bottom + 8)
    changed = phone.viewer.session.displayed.get_setup(phone.viewer.pane).controller
    assert changed != value
    assert slider.rect.height + 16 >= 24 * RATIO


def test_a_finger_next_to_a_robot_reaches_it(upright_phone: Driver) -> None:
    run_page_command(upright_phone, "tool:failure")
    x, y = upright_phone.find_robot_pixel(2)
    upright_phone.click(x + 23 * RATIO, y)
    assert upright_phone.viewer.message.lower() == "robot 2 failed"


# the lesson


def test_a_whole_lesson_is_done_by_taps_alone(phone: Driver) -> None:
    run_page_command(phone, "tour")
    player = get_player(phone)
    visited = []
    for _ in range(MAX_TAPS):
        if phone.window.lesson.player is None:
            break
        visited.append(player.number)
        name = "answer:1" if player.state is LessonState.ASKING else "next"
        box = find_area(phone, name)
        assert box is not None
        panel = pygame.Rect(phone.window.layout.panel)
        assert panel.contains(box)
        if name == "next":
            assert box.height >= TARGET_PX * RATIO
        phone.click(*box.center)
        phone.settle()
    assert phone.window.lesson.player is None
    assert set(visited) == set(range(len(player.lesson.chapters)))
    assert len(player.first_answers) == sum(
        chapter.question is not None for chapter in player.lesson.chapters
    )


def test_hints_on_a_phone_name_buttons_instead_of_keys(upright_phone: Driver) -> None:
    phone = upright_phone
    run_page_command(phone, "tour")
    player = get_player(phone)
    messages = []
    while player.state is not LessonState.ASKING:
        player.skip(1)
    run_page_command(phone, "pause")
    messages.append(phone.viewer.message)
    player.reply(1)
    while player.state is not LessonState.ENDED:
        player.advance(1.0)
        phone.viewer.session.playback.step()
    run_page_command(phone, "pause")
    messages.append(phone.viewer.message)
    run_page_command(phone, "cancel")
    messages.append(phone.viewer.message)
    assert messages == [
        "Answer first: tap your answer",
        "This chapter is over: tap Next to continue",
        "The lesson has ended; Lesson plays it again",
    ]
    phone.viewer.session.timeline.is_settled = True
    assert suggest_actions(phone.viewer).startswith("The team has settled. Try:\ndraw a wall in a doorway · ")


def test_hints_of_tools_on_a_phone_mention_neither_keys_nor_clicks(upright_phone: Driver) -> None:
    for name in upright_phone.viewer.toolbox.by_name:
        run_page_command(upright_phone, f"tool:{name}")
        assert not re.search(r"click|Enter|Alt|Shift|wheel|\[", upright_phone.viewer.message), name


def open_controller_list(phone: Driver) -> None:
    """Open the list of the controllers with which the current one can be compared."""
    phone.window.set_appearance(
        PageAppearance(scale=RATIO, theme="light", shows_panel=False, is_compact=True, is_motion_reduced=True)
    )
    run_page_command(phone, "pane:add")
    phone.run_frames(2)


def test_a_list_has_a_button_that_closes_it(phone: Driver) -> None:
    """Phones have no Escape key."""
    open_controller_list(phone)
    box = phone.window.dialogs.box
    button = phone.window.dialogs.ui.find("button", "close")
    assert box is not None
    assert button is not None
    assert box.contains(button.rect)
    assert phone.window.screen.get_rect().contains(box)
    phone.click(*button.rect.center)
    assert not phone.window.dialogs.is_open
    assert len(phone.session.timeline.panes) == 1


def test_options_of_a_list_are_large_enough_for_fingers(phone: Driver) -> None:
    open_controller_list(phone)
    box = phone.window.dialogs.box
    assert phone.window.screen.get_rect().contains(box)
    options = [widget.rect for widget in phone.window.dialogs.ui.widgets.values() if widget.kind == "option"]
    assert min(option.height for option in options) >= TARGET_PX * RATIO
    assert all(box.contains(option) for option in options)


def test_answers_are_large_enough_for_fingers(upright_phone: Driver) -> None:
    run_page_command(upright_phone, "tour")
    player = get_player(upright_phone)
    numbers = [k for k, chapter in enumerate(player.lesson.chapters) if chapter.question is not None]
    for number in numbers:
        player.show_chapter(number)
        upright_phone.settle()
        boxes = [
            area.box
            for area in upright_phone.window.lesson.click_areas
            if area.name.startswith("answer:") and area.box.height
        ]
        assert boxes
        assert max(box.height for box in boxes) >= TARGET_PX * RATIO


def test_a_lesson_goes_back_and_ends_by_taps(phone: Driver) -> None:
    before = phone.session
    run_page_command(phone, "tour")
    player = get_player(phone)
    for name, number in (("next", 1), ("back", 0)):
        box = find_area(phone, name)
        assert box is not None
        phone.click(*box.center)
        assert player.number == number
    end = find_area(phone, "end")
    assert end is not None
    assert min(end.size) >= TARGET_PX * RATIO
    phone.click(*end.center)
    assert phone.window.lesson.player is None
    assert phone.session is before


def test_the_handle_leaves_the_lesson_and_the_button_returns_to_it(upright_phone: Driver) -> None:
    run_page_command(upright_phone, "tour")
    assert upright_phone.window.controls.lesson == "shown"
    upright_phone.click(*pygame.Rect(upright_phone.window.layout.handle).center)
    assert upright_phone.window.controls.lesson == "left"
    assert not upright_phone.window.layout.has_panel
    run_page_command(upright_phone, "tour")
    assert upright_phone.window.controls.lesson == "shown"


def test_text_that_does_not_fit_is_scrolled(tmp_path: Path) -> None:
    with open_phone(tmp_path, LANDSCAPE) as driver:
        run_page_command(driver, "tour")
        player = get_player(driver)
        player.show_chapter(next(k for k, chapter in enumerate(player.lesson.chapters) if chapter.question))
        driver.settle()
        view = pygame.Rect(driver.window.layout.panel)
        last = f"answer:{len(player.chapter.question.answers)}"  # type: ignore[union-attr]
        before = find_area(driver, last)
        assert before is not None
        driver.turn_wheel(*view.center, -5)
        driver.settle()
        after = find_area(driver, last)
        assert after is not None
        assert after.top < before.top or after.height > before.height
        assert after.height >= TARGET_PX * RATIO


# buttons of the page


def test_the_page_shows_the_state_of_the_window(upright_phone: Driver) -> None:
    controls = upright_phone.window.controls
    assert controls.is_compact
    assert not controls.is_playing
    assert not controls.can_undo
    assert controls.scroll_box is None
    run_page_command(upright_phone, "pause")
    upright_phone.viewer.attempt(lambda: upright_phone.session.fail_robot(1))
    run_page_command(upright_phone, "tool:wall")
    run_page_command(upright_phone, "panel")
    controls = upright_phone.window.controls
    assert controls.is_playing
    assert controls.can_undo
    assert controls.tool == "wall"
    assert controls.has_panel
    assert controls.scroll_box == upright_phone.window.layout.panel


def test_menus_have_rows_for_fingers_and_no_keys(phone: Driver) -> None:
    run_page_command(phone, "share")
    menu = phone.window.dialogs.current
    options = [widget for widget in phone.window.dialogs.ui.widgets.values() if widget.kind == "option"]
    assert len(options) == len([row for row in menu.rows if row is not None])
    window = pygame.Rect((0, 0), phone.window.layout.size)
    for option in options:
        assert option.rect.height >= TARGET_PX * RATIO
        assert window.contains(option.rect)


def test_the_share_menu_opens_near_the_buttons_of_a_phone(upright_phone: Driver) -> None:
    run_page_command(upright_phone, "share")
    upright_phone.run_frames(2)
    box = upright_phone.window.dialogs.box
    width, height = upright_phone.window.layout.size
    assert box is not None
    assert box.bottom > 0.95 * height
    assert box.left > 0
    assert box.right < width
    assert box.bottom < height


def test_a_button_of_the_page_closes_what_covers_the_window(upright_phone: Driver) -> None:
    run_page_command(upright_phone, "share")
    assert upright_phone.window.dialogs.is_open
    run_page_command(upright_phone, "pause")
    assert not upright_phone.window.dialogs.is_open
    assert upright_phone.session.playback.is_playing
    run_page_command(upright_phone, "no such command")


def test_every_button_of_the_page_has_a_command(upright_phone: Driver) -> None:
    page = files("robocov_app.web").joinpath("page.html").read_text("utf-8")
    lists = re.search(r"const TOOLS = \{(.*?)\};\s*const MORE = \{(.*?)\};", page, re.DOTALL)
    assert lists is not None
    tools, others = (re.findall(r'"?([\w:]+)"?: "', text) for text in lists.groups())
    commands = upright_phone.window.commands
    assert set(tools) == set(upright_phone.viewer.toolbox.by_name)
    assert all(f"tool:{name}" in commands for name in tools)
    assert len(others) > 9
    for name in others:
        assert name in commands or name in ("open", "keyboard", "saved")
    editor_names = {"delete", "save", "editor"}
    for name in set(re.findall(r'runCommand\("([\w:]+)"\)', page)) - editor_names:
        assert name in commands
