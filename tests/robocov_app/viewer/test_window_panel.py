"""The window, used by mouse and keys: the panel, its menus, fields and tooltips."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import MIDDLE, Driver, open_viewer, resize_window
from sample_sessions import RAPF, RPF

from robocov.controllers import CONTROLLERS
from robocov_app.toolkit.widgets.tool_tip import TIP_DELAY_S
from robocov_app.toolkit.window.input import DOUBLE_CLICK_S, KEY_REPEAT_MS
from robocov_app.toolkit.window.layout import RAIL_WIDTH_PX
from robocov_app.viewer.panel.panel import ViewerPanel, label_controllers
from robocov_app.viewer.session.playback import Playback

# the panel


def test_a_controller_is_chosen_from_the_menu(driver: Driver) -> None:
    driver.choose_option("controller:0", "RPF")
    assert driver.session.timeline.panes[0].controller.name == "rpf"
    assert driver.find_widget("entry", "k_att") is None
    driver.choose_option("controller:0", "Lloyd")
    assert driver.session.timeline.panes[0].controller.name == "lloyd"


def test_parameters_in_a_comparison_name_their_controller(driver: Driver) -> None:
    section = driver.find_widget("section", "section:gains")
    assert section is not None
    assert section.text == "RAPF"
    driver.add_pane()
    driver.settle()
    section = driver.find_widget("section", "section:gains")
    assert section is not None
    assert section.text == "Parameters of RPF"


def test_the_menu_shows_the_controller_of_a_branch_that_takes_long_to_reach(
    driver: Driver, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The state of the branch is reached some frames after the command."""
    driver.session.playback.is_playing = True
    driver.run_frames(20)
    driver.session.playback.is_playing = False
    driver.choose_option("controller:0", "RPF")
    driver.choose_option("controller:0", "Lloyd")
    driver.press_key("ctrl+z", times=2)
    monkeypatch.setattr("robocov_app.viewer.session.playback.SEEK_SLICE_S", 0.0)
    monkeypatch.setattr(Playback, "seek_seconds", 0.0)
    for _ in range(3):
        driver.press_key("alt+left")
        driver.run_frames(60)
        assert not driver.session.timeline.is_seeking
        displayed = driver.session.displayed.get_setup(driver.session.timeline.panes[0]).controller
        menu = driver.find_widget("menu", "controller:0")
        assert menu is not None
        assert menu.value == displayed.label


def test_user_controllers_with_equal_labels_have_unique_menu_entries(tmp_path: Path) -> None:
    own = "from dataclasses import dataclass\nimport numpy as np\n@dataclass(frozen=True)\nclass Mine:\n"
    own += "    label = 'RAPF'\n    def force(self, own):\n        return np.zeros(2)\n"
    (tmp_path / "mine.py").write_text(own)
    (tmp_path / "also").mkdir()
    (tmp_path / "also/mine.py").write_text(own)
    names = [f"{tmp_path / 'mine.py'}:Mine", f"{tmp_path / 'also/mine.py'}:Mine"]
    assert label_controllers(["rapf", *names], {}) == {
        "rapf": "RAPF",
        names[0]: "RAPF (mine.py)",
        names[1]: f"RAPF ({names[1]})",
    }
    assert label_controllers(["rapf"], {"learner": "RAPF"})["learner"] == "RAPF (learner)"
    with open_viewer(tmp_path, RAPF, RPF, RPF, RPF) as driver:
        for name in names:
            driver.viewer.attempt(lambda name=name: driver.window.commands.run_text(f"controller {name}"))
        driver.viewer.attempt(lambda: driver.viewer.comparison.set_controller(0, "rapf"))
        driver.settle()
        driver.click(*driver.get_widget("menu", "controller:1").rect.center)
        items = driver.window.panel.ui.open_list.options
        assert len(set(items)) == len(items) == len(CONTROLLERS) + 2
        driver.press_key("escape")
        driver.choose_option("controller:1", items[-1])
        assert driver.session.timeline.panes[1].controller.name == names[1]


def test_a_map_and_a_start_are_chosen_from_their_menus(driver: Driver) -> None:
    driver.choose_option("map", "trap")
    assert driver.viewer.files.map_name == "trap"
    assert driver.session.displayed.environment.name == "Trap"
    driver.choose_option("start", "inside")
    assert driver.session.timeline.scenario.start_name == "inside"


def test_a_covered_start_stays_in_the_menu_until_another_is_chosen(driver: Driver) -> None:
    driver.choose_option("start", "far")
    driver.press_key("c")
    driver.drag_at((5.2, 3.2), (5.2, 3.5), (5.2, 3.75))
    assert "far" not in driver.session.displayed.environment.starts
    assert driver.session.timeline.scenario.start_name == "far"
    driver.push_button("seed:next")
    driver.choose_option("start", "spread")
    assert driver.session.timeline.scenario.start_name == "spread"


def test_a_click_outside_a_menu_only_closes_it(driver: Driver) -> None:
    driver.click(*driver.get_widget("menu", "map").rect.center)
    assert driver.window.panel.ui.open_list is not None
    camera = driver.window.canvas._painters[0].camera
    driver.click_at(MIDDLE)
    driver.settle()
    assert driver.window.panel.ui.open_list is None
    assert driver.window.canvas._painters[0].camera == camera
    assert driver.viewer.files.map_name == "hall"


def test_escape_only_closes_a_menu(driver: Driver) -> None:
    driver.press_key("p")
    driver.click(*driver.get_widget("menu", "map").rect.center)
    driver.press_key("escape")
    driver.settle()
    assert driver.window.panel.ui.open_list is None
    assert driver.viewer.tool.name == "polygon"


def test_an_open_menu_covers_the_buttons_below_it(driver: Driver) -> None:
    """A choice from the list presses none of the buttons under it."""
    fewer = driver.get_widget("button", "fewer").rect
    driver.click(*driver.get_widget("menu", "map").rect.center)
    open_list = driver.window.panel.ui.open_list
    name = open_list.options[open_list.find_item((driver.pixel[0], fewer.centery))]
    driver.click(driver.pixel[0], fewer.centery)
    assert driver.session.timeline.scenario.robots == 3
    assert driver.viewer.files.map_name == name


def test_a_dragged_slider_sets_its_gain(driver: Driver) -> None:
    driver.drag_slider("k_rep", 0.75)
    value = driver.session.timeline.panes[0].controller.get_value("k_rep")
    assert value == pytest.approx(0.3 * 30**0.5, rel=0.2)
    assert driver.get_widget("entry", "k_rep").text == f"{value:.4g}"
    assert driver.session.timeline.events[-1].kind == "law"


def test_a_click_next_to_the_knob_moves_it_there(driver: Driver) -> None:
    slider = driver.get_widget("slider", "team.max_speed")
    driver.click(slider.rect.right - 12, slider.rect.centery)
    assert driver.session.timeline.panes[0].setup.properties.max_speed > 4.0
    assert driver.find_knob("team.max_speed")[0].collidepoint(driver.pixel)


def test_a_knob_can_be_dragged_beyond_its_slider(driver: Driver) -> None:
    knob, _ = driver.find_knob("speed")
    driver.drag(knob.center, (knob.centerx + 40, 10), (20, 590))
    assert driver.session.playback.clock.speed == 0.1


def test_the_speed_slider_snaps_to_speeds(driver: Driver) -> None:
    driver.drag_slider("speed", 0.81)
    assert driver.session.playback.clock.speed == 8.0
    driver.run_frames(3)
    assert driver.get_widget("slider", "speed").value == 6
    driver.drag_slider("speed", 1.0)
    assert math.isinf(driver.session.playback.clock.speed)


def test_enter_accepts_a_typed_value(driver: Driver) -> None:
    driver.type_into("k_rep", "1.25")
    assert driver.session.timeline.panes[0].controller.get_value("k_rep") != 1.25
    assert driver.window.panel.ui.edit
    driver.press_key("return")
    assert driver.session.timeline.panes[0].controller.get_value("k_rep") == 1.25
    assert not driver.window.panel.ui.edit
    assert driver.get_widget("slider", "k_rep").value > 0.5


def test_keypad_enter_accepts_a_typed_value(driver: Driver) -> None:
    driver.type_into("team.max_speed", "0.5")
    driver.press_key("enter")
    assert driver.session.timeline.panes[0].setup.properties.max_speed == 0.5


@pytest.mark.parametrize(("field", "text"), [("k_rep", "much"), ("team.max_speed", "-1"), ("robots", "1.5")])
def test_an_invalid_value_is_reported_and_the_field_restored(field: str, text: str, driver: Driver) -> None:
    before = driver.get_widget("entry", field).text
    driver.type_into(field, text)
    assert driver.get_widget("entry", field).text == text
    driver.press_key("return")
    assert driver.viewer.has_error_message
    assert driver.viewer.message
    assert driver.get_widget("entry", field).text == before


@pytest.mark.parametrize("how", ["escape", "click elsewhere", "another field"])
def test_text_without_enter_is_discarded(how: str, driver: Driver) -> None:
    driver.type_into("k_rep", "7")
    if how == "escape":
        driver.press_key("escape")
    elif how == "another field":
        driver.click(*driver.get_widget("entry", "rho_0").rect.center)
    else:
        driver.click_at(MIDDLE)
    driver.run_frames(2)
    assert driver.get_widget("entry", "k_rep").text == "0.3"
    assert driver.session.timeline.panes[0].controller == RAPF


def test_keys_typed_into_a_field_are_not_shortcuts(driver: Driver) -> None:
    shown = set(driver.viewer.view.layers)
    driver.type_into("k_rep", "1r t")
    driver.press_key("space")
    driver.press_key("home")
    driver.press_key("delete")
    assert driver.viewer.view.layers == shown
    assert driver.viewer.view.theme == "light"
    assert not driver.session.playback.is_playing
    driver.press_key("f1")
    assert driver.window.help_page.is_open


def test_typing_keeps_the_key_repeat(driver: Driver) -> None:
    driver.type_into("k_rep", "1")
    driver.press_key("return")
    driver.run_frames(2)
    assert pygame.key.get_repeat() == KEY_REPEAT_MS


def test_a_second_click_places_the_text_cursor(driver: Driver) -> None:
    entry = driver.get_widget("entry", "seed")
    driver.type_into("seed", "123")
    time.sleep(DOUBLE_CLICK_S)
    driver.click(entry.rect.left + 8, entry.rect.centery)
    driver.type("9")
    assert sorted(driver.get_widget("entry", "seed").text) == ["1", "2", "3", "9"]


def test_the_reset_button_restores_the_default(driver: Driver) -> None:
    driver.viewer.attempt(lambda: driver.window.commands.run_text("k_rep 4"))
    driver.settle()
    assert driver.get_widget("slider", "k_rep").value > 0.7
    driver.push_button("reset:k_rep")
    assert driver.session.timeline.panes[0].controller.get_value("k_rep") == 0.3
    assert driver.get_widget("slider", "k_rep").value == pytest.approx(0.5, abs=0.02)
    assert driver.get_widget("entry", "k_rep").text == "0.3"


def test_robots_and_seed_are_typed_and_stepped(driver: Driver) -> None:
    driver.type_into("robots", "5")
    driver.press_key("return")
    assert len(driver.session.displayed.numbers) == 5
    driver.push_button("fewer")
    driver.push_button("more")
    driver.push_button("more")
    assert driver.session.timeline.scenario.robots == 6
    assert driver.get_widget("entry", "robots").text == "6"
    driver.type_into("seed", "41")
    driver.press_key("return")
    driver.push_button("seed:next")
    assert driver.session.timeline.scenario.seed == 42
    assert driver.get_widget("entry", "seed").text == "42"
    assert driver.get_widget("button", "seed:next").text == "↻"


def test_tabs_show_pages_and_check_boxes_toggle_layers(driver: Driver) -> None:
    for tab in ViewerPanel.tabs:
        driver.open_tab(tab)
        assert driver.window.panel.tab == tab
        assert driver.get_widget("button", f"tab:{tab}").value
    driver.open_tab("show")
    for name in ("cells", "grid"):
        assert name in driver.viewer.view.layers
        driver.toggle_check_box(name)
        assert name not in driver.viewer.view.layers
        assert not driver.get_widget("check", name).value
    box = driver.get_widget("check", "cells").rect
    driver.click(box.left + 40, box.centery)  # on the words
    assert "cells" in driver.viewer.view.layers
    driver.press_key("1")
    driver.run_frames(3)
    assert "cells" not in driver.viewer.view.layers
    assert not driver.get_widget("check", "cells").value
    driver.press_key("ctrl+tab")
    assert driver.window.panel.tab == "robot"


def test_up_to_four_panes_are_added_and_closed(driver: Driver) -> None:
    for count in (2, 3, 4):
        driver.add_pane()
        assert len(driver.session.timeline.panes) == count
    assert driver.find_widget("button", "pane:add") is None
    assert len({box[2:] for box in driver.window.layout.panes}) == 1
    driver.run_frames(3)
    names = [pane.controller.name for pane in driver.session.timeline.panes]
    driver.push_button("close:1")
    assert [pane.controller.name for pane in driver.session.timeline.panes] == [names[0], *names[2:]]
    driver.push_button("close:0")
    driver.push_button("close:1")
    assert [pane.controller.name for pane in driver.session.timeline.panes] == [names[2]]
    assert driver.find_widget("button", "close:0") is None


def test_the_parameters_belong_to_the_clicked_pane(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, RPF) as driver:
        assert driver.find_widget("entry", "k_att") is not None
        driver.click(*driver.find_pixel(MIDDLE, 1))
        assert driver.viewer.active_pane == 1
        assert driver.find_widget("entry", "k_att") is None
        driver.type_into("k_rep", "5")
        driver.press_key("return")
        assert [pane.controller.get_value("k_rep") for pane in driver.session.timeline.panes] == [0.3, 5.0]


def test_fail_and_remove_buttons_act_on_the_selected_robot(driver: Driver) -> None:
    driver.click(*driver.find_robot_pixel(2))
    driver.push_button("robot:fail")
    assert driver.session.displayed.numbers == (1, 3)
    assert driver.get_widget("button", "robot:fail").text == "Revive"
    driver.push_button("robot:fail")
    assert driver.get_widget("button", "robot:fail").text == "Fail"
    driver.push_button("robot:next")
    driver.push_button("robot:remove")
    assert driver.session.displayed.numbers == (1, 2)


def test_the_arena_fills_the_place_of_a_hidden_panel(driver: Driver) -> None:
    driver.press_key("h")
    assert driver.window.layout.panel.width == 0
    assert driver.window.panel.hidden
    window_width = driver.window.layout.size[0]
    assert driver.window.layout.arena.width == window_width - RAIL_WIDTH_PX
    driver.press_key("h")
    assert not driver.window.panel.hidden


def test_clicks_and_shortcuts_work_without_a_panel(driver: Driver) -> None:
    center = pygame.Rect(driver.window.layout.panel).center
    driver.press_key("h")
    # The hidden panel must not take the click.
    driver.click(*center)
    assert driver.window.panel.hidden
    driver.press_key("space")
    driver.run_frames(3)
    assert driver.session.timeline.end_time > 0.0


def test_pages_look_the_same_when_shown_again(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, RPF) as driver:
        driver.move(100, 300)
        pictures = {}
        for tab in ViewerPanel.tabs * 2:
            driver.window.panel.show_tab(tab)
            driver.run_frames(9)
            if tab in pictures:
                assert driver.shows_frame(pictures[tab]), tab
            pictures[tab] = driver.copy_frame()
        driver.viewer.inspection.active_pane = 1
        driver.window.panel.show_tab("parameters")
        driver.run_frames(2, 0.3)
        assert not driver.shows_frame(pictures["parameters"])
        driver.viewer.inspection.active_pane = 0
        driver.viewer.revision += 1
        driver.run_frames(2, 0.3)
        assert driver.shows_frame(pictures["parameters"])


def test_the_panel_does_not_depend_on_earlier_sizes_and_panes(tmp_path: Path) -> None:
    def draw_panel(driver: Driver) -> np.ndarray:
        driver.move(300, 300)
        driver.run_frames(3, 0.3)
        left = driver.window.layout.panel.left
        return driver.copy_frame()[:, left:].copy()

    with open_viewer(tmp_path, RAPF, RPF, RPF, size=(1100, 700)) as driver:
        expected = draw_panel(driver)
    with open_viewer(tmp_path, RAPF, RPF) as driver:
        draw_panel(driver)
        resize_window(driver, (1280, 760))
        draw_panel(driver)
        driver.viewer.attempt(lambda: driver.session.add_pane(RPF))
        draw_panel(driver)
        resize_window(driver, (1100, 700))
        assert np.array_equal(draw_panel(driver), expected)


# tooltips


def test_tool_tips_show_the_action_and_its_key(driver: Driver) -> None:
    button = driver.get_widget("button", "step")
    driver.move(*button.rect.center)
    before = driver.copy_frame()
    assert button.tip == "Single step (.)"
    time.sleep(TIP_DELAY_S)
    driver.run_frames(1)
    assert not driver.shows_frame(before)


def test_tool_tips_of_gains_show_their_units(driver: Driver) -> None:
    tips = [widget.tip for widget in driver.window.panel.ui.widgets.values()]
    assert any(tip and "N m³" in tip for tip in tips)
    assert not any(tip and "<" in tip for tip in tips)
