"""The editor on a phone, whose page has the buttons: layout, fingers, and what the buttons show."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest
from driven_editor import EditorDriver, build_sheet, open_editor

from robocov.environment import WallObstacle
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.window.input import COMMAND_EVENT
from robocov_app.toolkit.window.page_view import PageAppearance, WindowControls

SIZE = (780, 1584)
APPEARANCE = PageAppearance(
    scale=2.0, theme="light", shows_panel=False, is_compact=True, is_motion_reduced=True
)


@pytest.fixture
def phone(tmp_path: Path) -> Iterator[EditorDriver]:
    with open_editor(tmp_path, build_sheet(), size=SIZE, scale=2.0) as driver:
        driver.window.set_appearance(APPEARANCE)
        driver.settle()
        driver.run_frames(2)
        yield driver


def run_page_command(driver: EditorDriver, name: str) -> None:
    """Run a command as a button of the page does."""
    driver.post(COMMAND_EVENT, name=name)
    driver.settle()


def read_controls(driver: EditorDriver) -> WindowControls:
    controls = (driver.window.replacement or driver.window).controls
    assert controls is not None
    return controls


def test_the_map_has_the_space_of_the_bar_the_rail_and_the_status_line(phone: EditorDriver) -> None:
    size = phone.window.screen.get_size()
    assert phone.window.layout.arena == (0, 0, *size)
    run_page_command(phone, "panel")
    layout = phone.window.layout
    assert layout.has_sheet
    assert layout.panel.width == layout.arena.width == size[0]
    assert read_controls(phone).scroll_box == layout.panel


def test_a_wall_is_drawn_moved_and_deleted_by_buttons_and_fingers(phone: EditorDriver) -> None:
    assert not read_controls(phone).can_undo
    run_page_command(phone, "tool:wall")
    phone.click_all((3, 5), (7, 5))
    assert read_controls(phone).is_drawing
    run_page_command(phone, "finish")
    assert not read_controls(phone).is_drawing
    assert read_controls(phone).can_undo
    assert [type(shape) for shape in phone.shapes] == [WallObstacle]
    run_page_command(phone, "tool:select")
    before = phone.shapes[0]
    phone.drag(phone.find_pixel((4, 5)), phone.find_pixel((4, 6)), phone.find_pixel((4, 7)))
    assert phone.shapes[0] != before
    assert read_controls(phone).can_delete
    run_page_command(phone, "delete")
    assert not phone.shapes
    assert not read_controls(phone).can_delete


def test_the_context_menu_has_rows_for_fingers_and_scrolls(phone: EditorDriver) -> None:
    run_page_command(phone, "tool:wall")
    phone.click_all((3, 5), (7, 5))
    run_page_command(phone, "finish")
    run_page_command(phone, "tool:select")
    phone.click_at((4, 5), button=3)
    menu = phone.window.dialogs.current
    assert isinstance(menu, Menu)
    phone.run_frames(2)
    box = phone.window.dialogs.box
    assert phone.window.screen.get_rect().contains(box)
    ui = phone.window.dialogs.ui
    rows = [widget.rect for widget in ui.widgets.values() if widget.kind == "option"]
    commands = [command for command in menu.rows if command is not None]
    assert len(rows) == len(commands) > 15
    assert rows[0].height == 48 * 2
    assert ui.widgets["option:lock"].text == "Lock"
    assert rows[-1].height < 48 * 2, "the last row is partly out of sight"
    for _ in range(10):
        phone.turn_wheel(*box.center, -1)
    phone.run_frames(2)
    last_row = ui.widgets[f"option:{commands[-1].name}"].rect
    assert last_row.height == 48 * 2
    phone.click(*last_row.center)
    assert not phone.window.dialogs.is_open


def test_a_trial_on_a_phone_has_its_buttons_and_a_way_back(phone: EditorDriver) -> None:
    assert read_controls(phone).kind == "editor"
    run_page_command(phone, "try")
    controls = read_controls(phone)
    assert controls.kind == "trial"
    assert controls.is_compact
    assert not controls.has_panel
    phone.post(COMMAND_EVENT, name="editor")
    phone.settle()
    phone.run_frames(2)
    assert read_controls(phone).kind == "editor"


def test_every_button_of_the_page_has_a_command(phone: EditorDriver) -> None:
    page = files("robocov_app.web").joinpath("page.html").read_text("utf-8")
    found = re.search(r"const EDITOR_TOOLS = \{(.*?)\};\s*const EDITOR_MORE = \{(.*?)\};", page, re.DOTALL)
    assert found is not None
    tools, others = (re.findall(r'"?([\w:]+)"?: "', text) for text in found.groups())
    commands = phone.window.commands
    assert set(tools) == set(phone.editor.toolbox.by_name)
    others.remove("saved")  # opens a list of the page
    for name in (*others, "finish", "try", "delete", "save", "undo"):
        assert name in commands


def test_phones_get_no_hints_about_keys(phone: EditorDriver) -> None:
    phone.editor.show_message("")
    run_page_command(phone, "tool:wall")
    assert not phone.message
