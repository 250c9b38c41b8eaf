"""The top bar and the tool rail: what they show, and what a click on them does."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import MIDDLE, Driver, open_viewer

import robocov_app
from robocov_app.toolkit.command_bar import NARROW_PX, UNSAVED_SIGN, WIDE_PX
from robocov_app.toolkit.widgets.icons import ICONS, render_icon


def test_undo_and_redo_are_buttons_that_tell_whether_there_is_something_to_undo(driver: Driver) -> None:
    assert not driver.get_widget("button", "undo").enabled
    driver.viewer.attempt(lambda: driver.session.fail_robot(1))
    driver.run_frames(2)
    driver.push_button("undo")
    assert driver.session.displayed.numbers == (1, 2, 3)
    assert not driver.get_widget("button", "undo").enabled
    driver.push_button("redo")
    assert driver.session.displayed.numbers == (2, 3)
    assert not driver.get_widget("button", "redo").enabled


def test_a_dot_marks_unsaved_edits_until_the_session_is_saved(driver: Driver) -> None:
    assert driver.get_widget("label", "file").text == "hall"
    driver.viewer.attempt(lambda: driver.session.fail_robot(1))
    driver.run_frames(2)
    assert driver.get_widget("label", "file").text.startswith(UNSAVED_SIGN)
    driver.push_button("save:session")
    driver.run_frames(2)
    assert driver.viewer.files.workspace.path is not None
    assert driver.get_widget("label", "file").text == driver.viewer.files.workspace.path.name


def test_buttons_stay_in_place_when_the_name_of_the_file_changes(driver: Driver) -> None:
    """With the name before them, the second click of a double click on Save opened the dialog of Open."""
    before = driver.get_widget("button", "save:session").rect.copy()
    driver.viewer.attempt(lambda: driver.session.fail_robot(1))
    driver.run_frames(2)
    assert driver.get_widget("button", "save:session").rect == before
    driver.push_button("save:session")
    driver.run_frames(2)
    assert driver.get_widget("button", "save:session").rect == before


@pytest.mark.parametrize("size", [(460, 620), (900, 600), (1280, 720), (2560, 1440)])
def test_buttons_of_the_bar_lie_in_it_side_by_side(tmp_path: Path, size: tuple[int, int]) -> None:
    with open_viewer(tmp_path) as driver:
        # A browser may ask for a picture that is smaller than any window.
        driver.window.display.surface = pygame.Surface(size)
        driver.viewer.attempt(lambda: driver.session.fail_robot(1))
        driver.run_frames(2)
        bar = driver.window.top_bar.ui
        rects = [widget.rect for widget in bar.widgets.values()]
        assert all(bar.box.contains(rect) for rect in rects)
        for first, second in pairwise(rects):
            assert first.right <= second.left
        play = driver.get_widget("button", "pause").rect
        assert min(play.size) >= 36 * driver.window.layout.scale - 1
        is_narrow = size[0] < NARROW_PX
        assert (driver.find_widget("slider", "speed") is None) == is_narrow
        is_wide = size[0] / driver.window.layout.scale >= WIDE_PX
        assert (driver.get_widget("button", "help").rect.width > play.width) == is_wide


def test_every_tool_has_a_button_with_its_key_and_a_picture(driver: Driver) -> None:
    for tool in driver.viewer.toolbox.by_name.values():
        button = driver.get_widget("button", f"tool:{tool.name}")
        assert button.tip.startswith(f"{tool.title} ({tool.key.upper()})")
        assert driver.window.tool_rail.ui.box.contains(button.rect)
        driver.push_button(f"tool:{tool.name}")
        assert driver.viewer.tool is tool
        assert tool.name in ICONS


def test_a_press_on_the_bar_ends_typing_in_the_panel(driver: Driver) -> None:
    driver.type_into("seed", "7")
    driver.push_button("step")
    assert driver.window.panel.ui.edit is None
    driver.press_key("w")
    assert driver.viewer.tool.name == "wall"


def test_the_bar_and_the_rail_are_not_part_of_the_map(driver: Driver) -> None:
    driver.press_key("a")
    before = driver.session.displayed.numbers
    driver.click(*driver.window.top_bar.ui.box.center)
    left, top, width, height = driver.window.layout.rail
    driver.click(left + width / 2, top + height - 1)
    assert driver.session.displayed.numbers == before
    driver.click_at(MIDDLE)
    assert len(driver.session.displayed.numbers) == len(before) + 1


@pytest.mark.parametrize("name", sorted(ICONS))
def test_icons_have_ink_and_stay_within_their_square(name: str) -> None:
    image = render_icon(name, 40, (10, 20, 30))
    mask = image.get_bounding_rect(min_alpha=30)
    assert mask.width >= 18
    assert mask.height >= 18
    assert image.get_rect().inflate(-1, -1).contains(mask.inflate(-1, -1))


@pytest.mark.parametrize("name", ["restart", "step", "settle"])
def test_icons_of_playback_have_straight_symmetric_shapes_unlike_undo(name: str) -> None:
    def is_symmetric(icon: str) -> bool:
        alpha = pygame.surfarray.array_alpha(render_icon(icon, 40, (10, 20, 30))).astype(int)
        return bool(np.abs(alpha - alpha[:, ::-1]).mean() < 8)

    assert is_symmetric(name)
    assert not is_symmetric("undo")


FIRST_ACTIONS = {
    "pause": "Play",
    "tool:wall": "Wall",
    "tool:failure": "Fail",
    "pane:add": "Compare",
    "undo": "Undo",
    "save:session": "Save",
    "share": "Share",
    "tour": "lesson",
}
"""Commands that a new user looks for, with a word by which they are found."""


@pytest.mark.parametrize("size", [(900, 600), (1280, 720), (1920, 1080), (2560, 1440)])
def test_first_actions_have_visible_buttons_with_words(tmp_path: Path, size: tuple[int, int]) -> None:
    with open_viewer(tmp_path, size=size) as driver:
        window_box = driver.window.screen.get_rect()
        for command, word in FIRST_ACTIONS.items():
            button = driver.find_widget("button", command)
            assert button is not None, command
            assert window_box.contains(button.rect), command
            assert min(button.rect.size) >= 24, command
            assert word.lower() in f"{button.text} {button.tip}".lower(), command


def test_the_button_of_the_panel_has_the_word_that_it_has_on_phones(driver: Driver) -> None:
    button = driver.find_widget("button", "panel")
    assert button is not None
    assert button.text == "Settings"
    page = (Path(robocov_app.__file__).parent / "web/page.html").read_text()
    assert ">Panel<" not in page
    assert '"Panel"' not in page
