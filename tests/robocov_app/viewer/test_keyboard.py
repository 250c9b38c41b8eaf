"""The keyboard: Tab visits all controls with a visible ring, Enter and Space use them, Escape leaves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from driven_window import Driver, open_viewer

MAX_STOPS = 200


def list_visited(driver: Driver, key: str = "tab") -> list[tuple[int, str]]:
    """Press Tab until the first control has the focus again; return the visited groups and controls."""
    visited: list[tuple[int, str]] = []
    for _ in range(MAX_STOPS):
        driver.press_key(key)
        group = driver.window.focus.group
        assert group is not None
        assert group.focus is not None
        number = driver.window._list_focus_groups().index(group)
        if (number, group.focus) in visited:
            break
        visited.append((number, group.focus))
    return visited


def test_tab_visits_every_control_of_every_part_once(driver: Driver) -> None:
    groups = driver.window._list_focus_groups()
    assert len(groups) == 5
    expected = [(number, key) for number, group in enumerate(groups) for key in group.list_focusable_keys()]
    assert list_visited(driver) == expected
    # The last press has wrapped around to the first control.
    assert list_visited(driver, "shift+tab") == [*expected[:0:-1], expected[0]][: len(expected)]


def test_each_control_with_the_focus_is_visible_and_has_a_ring(driver: Driver) -> None:
    without_focus = driver.copy_frame()
    for number, key in list_visited(driver):
        group = driver.window._list_focus_groups()[number]
        driver.window.focus.leave()
        group.set_focus(key)
        driver.settle()
        assert not driver.shows_frame(without_focus), key
        if group is driver.window.panel.ui:
            rects = [widget.rect for widget in group.widgets.values() if widget.key == key]
            assert all(rect.height > 0 for rect in rects), f"{key} is scrolled out of sight"


def test_enter_and_space_use_the_control_and_escape_leaves_it(driver: Driver) -> None:
    top_bar = driver.window.top_bar.ui
    top_bar.set_focus("pause")
    driver.press_key("return")
    assert driver.session.playback.is_playing
    driver.press_key("space")
    assert not driver.session.playback.is_playing
    driver.press_key("escape")
    assert driver.window.focus.group is None
    driver.press_key("space")
    assert driver.session.playback.is_playing, "without a focus, Space plays"


def test_chips_are_used_by_the_keyboard(driver: Driver) -> None:
    bar = driver.window.layer_bar
    bar.set_focus("layer layer:cells")
    driver.press_key("space")
    assert "cells" not in driver.viewer.view.layers
    assert bar.focus == "layer layer:cells"
    driver.press_key("escape")
    assert bar.focus is None


def test_the_time_slider_is_moved_by_the_arrow_keys(driver: Driver) -> None:
    for _ in range(5):
        driver.session.playback.step()
    driver.window.chart_focus.set_focus("time")
    driver.press_key("left")
    assert driver.session.displayed.time < driver.session.timeline.end_time
    assert driver.window.chart_focus.focus == "time"


def test_a_press_of_the_mouse_takes_the_focus_away(driver: Driver) -> None:
    for group in (driver.window.top_bar.ui, driver.window.layer_bar, driver.window.chart_focus):
        group.set_focus(group.list_focusable_keys()[0])
        driver.click(*driver.window.tool_rail.ui.box.midbottom)
        assert driver.window.focus.group is None


def test_tab_leaves_a_text_field_for_the_next_control(driver: Driver) -> None:
    driver.type_into("robots", "5")
    driver.press_key("tab")
    group = driver.window.focus.group
    assert group is driver.window.panel.ui
    assert group.focus == "fewer"
    assert driver.window.panel.ui.edit is None


def test_hidden_parts_are_not_visited(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.press_key("h")
        assert driver.window.panel.ui not in driver.window._list_focus_groups()


def test_robots_are_inspected_in_turn_by_i(driver: Driver) -> None:
    driver.press_key("i")
    assert driver.viewer.inspection.selected == 1
    driver.press_key("i")
    assert driver.viewer.inspection.selected == 2
    assert np.isfinite(driver.session.displayed.time)
