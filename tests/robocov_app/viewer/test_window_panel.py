"""The window, as it is used: the panel, its menus, fields and tool tips."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import MIDDLE, Driver, opened, resized
from sample_sessions import RAPF, RPF

from robocov.controllers import CONTROLLERS
from robocov_app.toolkit.input import DOUBLE_CLICK_S, KEY_REPEAT_MS
from robocov_app.toolkit.tool_tip import TIP_DELAY_S
from robocov_app.viewer.panel import TABS, label_controllers

# the panel


def test_a_controller_is_chosen_from_the_menu(driver: Driver) -> None:
    driver.choose("controller:0", "RPF")
    assert driver.session.timeline.panes[0].controller.name == "rpf"
    assert driver.find("entry", "k_att") is None
    driver.choose("controller:0", "Lloyd")
    assert driver.session.timeline.panes[0].controller.name == "lloyd"


def test_an_own_controller_of_the_same_name_can_be_told_from_the_other(tmp_path: Path) -> None:
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
    with opened(tmp_path, RAPF, RPF, RPF, RPF) as driver:
        for name in names:
            driver.viewer.attempt(lambda name=name: driver.window.commands.run_text(f"controller {name}"))
        driver.viewer.attempt(lambda: driver.viewer.comparison.set_controller(0, "rapf"))
        driver.settle()
        driver.click(*driver.widget("menu", "controller:1").rect.center)
        items = driver.window.panel.ui.open_list.options
        assert len(set(items)) == len(items) == len(CONTROLLERS) + 2
        driver.key("escape")
        driver.choose("controller:1", items[-1])
        assert driver.session.timeline.panes[1].controller.name == names[1]


def test_a_map_and_a_start_are_chosen_from_their_menus(driver: Driver) -> None:
    driver.choose("map", "trap")
    assert driver.viewer.files.map_name == "trap" and driver.session.displayed.environment.name == "Trap"
    driver.choose("start", "inside")
    assert driver.session.timeline.scenario.start_name == "inside"


def test_a_start_that_an_obstacle_covers_stays_in_the_menu_until_another_is_chosen(driver: Driver) -> None:
    driver.choose("start", "far")
    driver.key("c")
    driver.drag_at((5.2, 3.2), (5.2, 3.5), (5.2, 3.75))
    assert (
        "far" not in driver.session.displayed.environment.starts
        and driver.session.timeline.scenario.start_name == "far"
    )
    driver.push("seed:next")
    driver.choose("start", "spread")
    assert driver.session.timeline.scenario.start_name == "spread"


def test_a_menu_is_closed_by_a_click_elsewhere_and_that_click_does_nothing_else(driver: Driver) -> None:
    driver.click(*driver.widget("menu", "map").rect.center)
    assert driver.window.panel.ui.open_list is not None
    camera = driver.window.canvas._painters[0].camera
    driver.click_at(MIDDLE)
    driver.settle()
    assert driver.window.panel.ui.open_list is None
    assert driver.window.canvas._painters[0].camera == camera and driver.viewer.files.map_name == "hall"


def test_escape_closes_a_menu_and_nothing_else(driver: Driver) -> None:
    driver.key("p")
    driver.click(*driver.widget("menu", "map").rect.center)
    driver.key("escape")
    driver.settle()
    assert driver.window.panel.ui.open_list is None and driver.viewer.tool.name == "polygon"


def test_an_open_menu_lies_over_what_is_below_it(driver: Driver) -> None:
    """A choice from the list presses none of the buttons under it."""
    step = driver.widget("button", "step").rect
    driver.click(*driver.widget("menu", "map").rect.center)
    found = driver.window.panel.ui.open_list
    name = found.options[found.find_item((driver.at[0], step.centery))]
    driver.click(driver.at[0], step.centery)
    assert driver.session.timeline.end_time == 0.0 and driver.viewer.files.map_name == name


def test_a_slider_that_is_dragged_sets_its_gain_as_it_moves(driver: Driver) -> None:
    driver.slide("k_rep", 0.75)
    value = driver.session.timeline.panes[0].controller.get_value("k_rep")
    assert value == pytest.approx(0.3 * 30**0.5, rel=0.2)
    assert driver.widget("entry", "k_rep").text == f"{value:.4g}"
    assert driver.session.timeline.events[-1].kind == "law"


def test_a_click_beside_the_knob_brings_it_there(driver: Driver) -> None:
    slider = driver.widget("slider", "team.max_speed")
    driver.click(slider.rect.right - 12, slider.rect.centery)
    assert driver.session.timeline.panes[0].setup.properties.max_speed > 4.0
    assert driver.knob("team.max_speed")[0].collidepoint(driver.at)


def test_the_knob_can_be_dragged_far_beyond_its_slider(driver: Driver) -> None:
    knob, _ = driver.knob("speed")
    driver.drag(knob.center, (knob.centerx + 40, 10), (20, 590))
    assert driver.session.playback.clock.speed == 0.1


def test_the_speed_slider_rests_on_speeds(driver: Driver) -> None:
    driver.slide("speed", 0.81)
    assert driver.session.playback.clock.speed == 8.0
    driver.frames(3)
    assert driver.widget("slider", "speed").value == 6
    driver.slide("speed", 1.0)
    assert math.isinf(driver.session.playback.clock.speed)


def test_a_value_that_is_typed_replaces_the_old_one_with_enter(driver: Driver) -> None:
    driver.write("k_rep", "1.25")
    assert (
        driver.session.timeline.panes[0].controller.get_value("k_rep") != 1.25 and driver.window.panel.ui.edit
    )
    driver.key("return")
    assert driver.session.timeline.panes[0].controller.get_value("k_rep") == 1.25
    assert not driver.window.panel.ui.edit
    assert driver.widget("slider", "k_rep").value > 0.5


def test_the_enter_of_the_key_pad_does_too(driver: Driver) -> None:
    driver.write("team.max_speed", "0.5")
    driver.key("enter")
    assert driver.session.timeline.panes[0].setup.properties.max_speed == 0.5


@pytest.mark.parametrize(("field", "text"), [("k_rep", "much"), ("team.max_speed", "-1"), ("robots", "1.5")])
def test_a_wrong_value_is_told_and_the_field_shows_the_old_one_again(
    field: str, text: str, driver: Driver
) -> None:
    before = driver.widget("entry", field).text
    driver.write(field, text)
    assert driver.widget("entry", field).text == text
    driver.key("return")
    assert driver.viewer.has_error_message and driver.viewer.message
    assert driver.widget("entry", field).text == before


@pytest.mark.parametrize("how", ["escape", "click elsewhere", "another field"])
def test_what_was_typed_without_enter_is_forgotten(how: str, driver: Driver) -> None:
    driver.write("k_rep", "7")
    if how == "escape":
        driver.key("escape")
    elif how == "another field":
        driver.click(*driver.widget("entry", "rho_0").rect.center)
    else:
        driver.click_at(MIDDLE)
    driver.frames(2)
    assert driver.widget("entry", "k_rep").text == "0.3"
    assert driver.session.timeline.panes[0].controller == RAPF


def test_keys_that_are_typed_into_a_field_are_no_shortcuts(driver: Driver) -> None:
    shown = set(driver.viewer.view.layers)
    driver.write("k_rep", "1r t")
    driver.key("space")
    driver.key("home")
    driver.key("delete")
    assert (
        driver.viewer.view.layers == shown
        and driver.viewer.view.theme == "light"
        and not driver.session.playback.is_playing
    )
    driver.key("f1")
    assert driver.window.is_help_open


def test_keys_repeat_as_before_after_something_was_typed(driver: Driver) -> None:
    driver.write("k_rep", "1")
    driver.key("return")
    driver.frames(2)
    assert pygame.key.get_repeat() == KEY_REPEAT_MS


def test_typing_goes_on_in_the_middle_after_a_second_click(driver: Driver) -> None:
    entry = driver.widget("entry", "seed")
    driver.write("seed", "123")
    time.sleep(DOUBLE_CLICK_S)
    driver.click(entry.rect.left + 8, entry.rect.centery)
    driver.type("9")
    assert sorted(driver.widget("entry", "seed").text) == ["1", "2", "3", "9"]


def test_the_reset_button_goes_back_to_the_default(driver: Driver) -> None:
    driver.viewer.attempt(lambda: driver.window.commands.run_text("k_rep 4"))
    driver.settle()
    assert driver.widget("slider", "k_rep").value > 0.7
    driver.push("reset:k_rep")
    assert driver.session.timeline.panes[0].controller.get_value("k_rep") == 0.3
    assert driver.widget("slider", "k_rep").value == pytest.approx(0.5, abs=0.02)
    assert driver.widget("entry", "k_rep").text == "0.3"


def test_robots_and_seed_are_typed_and_counted(driver: Driver) -> None:
    driver.write("robots", "5")
    driver.key("return")
    assert len(driver.session.displayed.numbers) == 5
    driver.push("fewer")
    driver.push("more")
    driver.push("more")
    assert driver.session.timeline.scenario.robots == 6 and driver.widget("entry", "robots").text == "6"
    driver.write("seed", "41")
    driver.key("return")
    driver.push("seed:next")
    assert driver.session.timeline.scenario.seed == 42 and driver.widget("entry", "seed").text == "42"
    assert driver.widget("button", "seed:next").text == "↻"


def test_tabs_turn_pages_and_check_boxes_switch_layers(driver: Driver) -> None:
    for tab in TABS:
        driver.turn(tab)
        assert driver.window.panel.tab == tab
        assert driver.widget("button", f"tab:{tab}").value
    driver.turn("show")
    for name in ("cells", "grid"):
        assert name in driver.viewer.view.layers
        driver.tick(name)
        assert name not in driver.viewer.view.layers and not driver.widget("check", name).value
    box = driver.widget("check", "cells").rect
    driver.click(box.left + 40, box.centery)  # on the words
    assert "cells" in driver.viewer.view.layers
    driver.key("1")
    driver.frames(3)
    assert "cells" not in driver.viewer.view.layers and not driver.widget("check", "cells").value
    driver.key("ctrl+tab")
    assert driver.window.panel.tab == "robot"


def test_panes_are_added_up_to_four_and_closed_again(driver: Driver) -> None:
    for count in (2, 3, 4):
        driver.push("pane:add")
        assert len(driver.session.timeline.panes) == count
    assert driver.find("button", "pane:add") is None
    assert len({box[2:] for box in driver.window.layout.panes}) == 1
    driver.frames(3)
    laws = [pane.controller.name for pane in driver.session.timeline.panes]
    driver.push("close:1")
    assert [pane.controller.name for pane in driver.session.timeline.panes] == [laws[0], *laws[2:]]
    driver.push("close:0")
    driver.push("close:1")
    assert [pane.controller.name for pane in driver.session.timeline.panes] == [laws[2]]
    assert driver.find("button", "close:0") is None


def test_the_page_is_of_the_pane_that_was_clicked(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, RPF) as driver:
        assert driver.find("entry", "k_att") is not None
        driver.click(*driver.pixel(MIDDLE, 1))
        assert driver.viewer.active_pane == 1
        assert driver.find("entry", "k_att") is None
        driver.write("k_rep", "5")
        driver.key("return")
        assert [pane.controller.get_value("k_rep") for pane in driver.session.timeline.panes] == [0.3, 5.0]


def test_fail_and_remove_buttons_are_of_the_robot_that_is_asked(driver: Driver) -> None:
    driver.click(*driver.robot(2))
    driver.push("robot:fail")
    assert (
        driver.session.displayed.numbers == (1, 3) and driver.widget("button", "robot:fail").text == "Revive"
    )
    driver.push("robot:fail")
    assert driver.widget("button", "robot:fail").text == "Fail"
    driver.push("robot:next")
    driver.push("robot:remove")
    assert driver.session.displayed.numbers == (1, 2)


def test_the_panel_can_be_hidden_and_the_arena_takes_its_place(driver: Driver) -> None:
    driver.key("h")
    assert driver.window.layout.panel[2] == 0 and driver.window.panel.hidden
    assert driver.window.layout.arena[2] == 900
    driver.click(880, 40)
    driver.key("space")
    driver.frames(3)
    driver.key("h")
    assert not driver.window.panel.hidden and driver.session.timeline.end_time > 0.0


def test_pages_that_were_turned_to_before_look_as_they_did(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, RPF) as driver:
        driver.move(100, 300)
        pictures = {}
        for tab in TABS * 2:
            driver.window.panel.show_tab(tab)
            driver.frames(9)
            if tab in pictures:
                assert driver.same(pictures[tab]), tab
            pictures[tab] = driver.picture()
        driver.viewer.inspection.active_pane = 1
        driver.window.panel.show_tab("parameters")
        driver.frames(2, 0.3)
        assert not driver.same(pictures["parameters"])
        driver.viewer.inspection.active_pane = 0
        driver.viewer.revision += 1
        driver.frames(2, 0.3)
        assert driver.same(pictures["parameters"])


def test_after_resizing_and_more_panes_the_panel_is_as_if_it_was_built_so(tmp_path: Path) -> None:
    def panel(driver: Driver) -> np.ndarray:
        driver.move(300, 300)
        driver.frames(3, 0.3)
        left = driver.window.layout.panel[0]
        return driver.picture()[:, left:].copy()

    with opened(tmp_path, RAPF, RPF, RPF, size=(1100, 700)) as driver:
        wanted = panel(driver)
    with opened(tmp_path, RAPF, RPF) as driver:
        panel(driver)
        resized(driver, (1280, 760))
        panel(driver)
        driver.viewer.attempt(lambda: driver.session.add_pane(RPF))
        panel(driver)
        resized(driver, (1100, 700))
        assert np.array_equal(panel(driver), wanted)


# tool tips


def test_tool_tips_tell_what_and_by_which_key(driver: Driver) -> None:
    button = driver.widget("button", "step")
    driver.move(*button.rect.center)
    before = driver.picture()
    assert button.tip == "Single step (.)"
    time.sleep(TIP_DELAY_S)
    driver.frames(1)
    assert not driver.same(before)


def test_tool_tips_of_gains_tell_what_they_mean_and_no_letter_is_taken_for_a_sign(driver: Driver) -> None:
    tips = [each.tip for each in driver.window.panel.ui.widgets.values()]
    assert any(tip and "N m³" in tip for tip in tips)
    assert not any(tip and "<" in tip for tip in tips)
