"""Tooltips of the tool rail and of parameters, with and without a drawing."""

from __future__ import annotations

from pathlib import Path

import pygame
import pytest
from driven_window import Driver, open_viewer

from robocov_app.look.theme import LIGHT
from robocov_app.toolkit.widgets import icon_buttons, tool_tip
from robocov_app.toolkit.widgets.tool_tip import TIP_TEXT_COLOR, draw_tool_tip
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.viewer.panel.parameter_drawings import get_parameter_drawing

WIDGET = pygame.Rect(270, 80, 36, 36)
PAGE = pygame.Rect(260, 40, 60, 300)
"""Panel that contains the widget."""


def find_tooltip_box(text: str, **options) -> pygame.Rect:
    """Draw a tooltip for `WIDGET` on a blank surface, and return the box of the changed pixels."""
    blank = pygame.Color(1, 2, 3)
    screen = pygame.Surface((600, 400))
    screen.fill(blank)
    draw_tool_tip(screen, text, LIGHT, 1.0, widget=WIDGET, page=PAGE, **options)
    mask = pygame.mask.from_threshold(screen, blank, (1, 1, 1))
    mask.invert()
    (box,) = mask.get_bounding_rects()
    return box


@pytest.fixture
def immediate_tooltips(monkeypatch: pytest.MonkeyPatch) -> None:
    """Show tooltips at once."""
    monkeypatch.setattr(tool_tip, "TIP_DELAY_S", 0.0)


@pytest.mark.usefixtures("driver")
def test_tooltips_are_below_their_widget_or_next_to_its_page() -> None:
    assert find_tooltip_box("Wall").top > WIDGET.bottom
    right = find_tooltip_box("Wall (W)\nDrag.", side="right")
    assert right.left > PAGE.right
    assert right.top < WIDGET.centery < right.bottom
    assert find_tooltip_box("Wall (W)\nDrag.", side="left").right < PAGE.left


@pytest.mark.usefixtures("driver")
@pytest.mark.parametrize("side", ["left", "right"])
def test_tooltips_next_to_the_page_are_not_above_it(side: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise, the top bar would cover the title of the first tool's tooltip."""
    page = pygame.Rect(260, 75, 60, 300)
    monkeypatch.setitem(globals(), "PAGE", page)
    tip = find_tooltip_box("Hand (V)\nClick or drag a robot\nor an obstacle\nor the floor", side=side)
    assert tip.top == page.top


@pytest.mark.usefixtures("driver")
@pytest.mark.parametrize("page", [pygame.Rect(0, 40, 600, 300), pygame.Rect(0, 60, 600, 340)])
def test_without_space_next_to_the_page_tooltips_are_below_or_above_it(
    page: pygame.Rect, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(globals(), "PAGE", page)
    assert not find_tooltip_box("Radius of the robots", side="left").colliderect(page)


@pytest.mark.usefixtures("immediate_tooltips")
def test_tooltips_of_the_panel_cover_no_row_of_the_panel(driver: Driver) -> None:
    panel = driver.window.panel.ui
    label = driver.get_widget("label", "Repulsion strength")
    driver.move(*driver.find_pixel((0.1, 0.1)))
    driver.window.draw()
    before = driver.copy_frame()
    driver.move(*label.rect.center)
    driver.window.draw()
    differs = (driver.copy_frame() != before).any(axis=2)
    assert not differs[:, panel.box.left :].any()
    assert differs[:, panel.box.left - 60 : panel.box.left].any()


@pytest.mark.usefixtures("immediate_tooltips")
def test_a_pressed_widget_shows_no_tooltip_until_the_mouse_has_left_it(driver: Driver) -> None:
    tip = driver.window.panel.ui.tool_tip
    plus = driver.get_widget("button", "more").rect.center
    driver.move(*plus)
    assert tip.is_due
    driver.click(*plus)
    assert not tip.is_due
    driver.move(*driver.get_widget("button", "fewer").rect.center)
    assert tip.is_due


@pytest.mark.usefixtures("driver")
@pytest.mark.parametrize("parameter", ["k_rep", "k_att", "team.sensing_range"])
def test_drawings_are_below_the_text(parameter: str) -> None:
    drawing = get_parameter_drawing(parameter)
    assert drawing is not None
    assert drawing(1.0).get_bounding_rect().width > 100
    plain = find_tooltip_box("Strength\nWhat it is")
    assert find_tooltip_box("Strength\nWhat it is", drawing=drawing).height > plain.height + 80


def test_three_parameters_have_drawings(driver: Driver) -> None:
    for label in ("Repulsion strength", "Attraction strength", "Sensing range"):
        assert driver.get_widget("label", label).drawing is not None
    assert driver.get_widget("label", "Radius").drawing is None
    assert get_parameter_drawing("radius") is None


@pytest.mark.usefixtures("immediate_tooltips")
def test_every_button_of_the_rail_shows_a_tooltip_with_its_key_next_to_it(driver: Driver) -> None:
    rail = driver.window.tool_rail.ui
    for widget in rail.widgets.values():
        command = driver.window.commands[widget.key]
        assert command.key_text in widget.tip
        driver.move(*driver.find_pixel((0.1, 0.1)))
        driver.window.draw()
        before = driver.copy_frame()
        driver.move(*widget.rect.center)
        driver.window.draw()
        differs = (driver.copy_frame() != before).any(axis=2)
        assert differs[:, rail.box.right : rail.box.right + 60].any(), widget.key


def test_tools_show_their_names_at_once(tmp_path: Path) -> None:
    with open_viewer(tmp_path, size=(900, 600)) as driver:
        failure = driver.get_widget("button", "tool:failure")
        assert failure.tip.startswith("Fail robot (D)")
        before = driver.copy_frame()
        driver.move(*failure.rect.center)
        driver.window.draw()
        left, top, width, height = driver.window.layout.arena
        differs = (driver.copy_frame() != before).any(axis=2)
        assert differs[top : top + height, left : left + width].any()


def test_wide_windows_show_the_names_of_tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    texts: list[str] = []
    draw_text = icon_buttons.draw_text

    def draw_and_list(page: Ui, text: str, *args: object, **options: object) -> None:
        texts.append(text)
        draw_text(page, text, *args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(icon_buttons, "draw_text", draw_and_list)
    with open_viewer(tmp_path, size=(1280, 720)) as driver:
        driver.window.draw()
        for tool in driver.viewer.toolbox.by_name.values():
            assert tool.title in texts


@pytest.mark.usefixtures("immediate_tooltips")
def test_a_message_does_not_cover_a_tooltip(driver: Driver) -> None:
    """In a low window, the tooltips of the lowest tools reach the position of the message."""
    rail = driver.window.tool_rail.ui
    ruler = driver.get_widget("button", "tool:ruler")
    driver.move(*ruler.rect.center)
    driver.window.draw()
    before = driver.copy_frame()
    driver.viewer.message = "a message of many lines " * 60
    driver.window.draw()
    after = driver.copy_frame()
    assert (after != before).any()
    is_text = (before == TIP_TEXT_COLOR).all(axis=2)
    is_text[:, : rail.box.right] = False
    is_text[:, rail.box.right + 150 :] = False
    assert is_text.any()
    assert (after[is_text] == TIP_TEXT_COLOR).all()
