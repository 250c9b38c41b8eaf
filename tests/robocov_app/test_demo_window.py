"""The window, as it is used: everything is pressed, dragged and typed, without a display."""

from __future__ import annotations

import json
import math
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pygame
import pytest
from driven_window import FRAME, Driver, opened
from PIL import Image
from touched_run import RAPF, RPF, begun

from robocov.controllers import CONTROLLERS
from robocov_app.demo.actions import KEY_REPEAT
from robocov_app.demo.opening import Opening
from robocov_app.demo.overlays import Palette
from robocov_app.demo.panel import TABS, law_labels
from robocov_app.demo.settings import FOLDER
from robocov_app.demo.status import cursor_words

MIDDLE = (0.6, 3.6)
"""A place in the hall where nothing is."""


@pytest.fixture
def driver(tmp_path: Path):
    with opened(tmp_path) as driver:
        yield driver


def place(driver: Driver, number: int, pane: int = 0) -> np.ndarray:
    lane = driver.session.lanes[pane]
    return driver.session.positions(lane)[lane.numbers.index(number)]


# playing


def test_space_plays_and_pauses(driver: Driver) -> None:
    driver.key("space")
    driver.frames(10)
    assert driver.session.time == pytest.approx(10 * FRAME, abs=0.02)
    driver.key("space")
    driver.frames(5)
    assert driver.session.time == pytest.approx(10 * FRAME, abs=0.02)


def test_buttons_play_step_settle_and_restart(driver: Driver) -> None:
    driver.push("pause")
    assert driver.session.playing and driver.widget("button", "pause").text == "Pause"
    driver.frames(5)
    driver.push("pause")
    assert not driver.session.playing and driver.widget("button", "pause").text == "Play"
    end = driver.session.end
    driver.push("step")
    assert driver.session.end == pytest.approx(end + driver.session.scenario.dt)
    driver.push("settle")
    assert driver.session.stop_when_settled
    assert "#chosen" in driver.widget("button", "settle").object_ids
    driver.push("restart")
    assert driver.session.end < 0.1


def test_it_stops_when_the_team_has_settled(tmp_path: Path) -> None:
    with opened(tmp_path, robots=1) as driver:
        driver.key("s")
        for _ in range(2000):
            driver.window.advance(0.1)
            if not driver.session.playing:
                break
        assert driver.session.settled
        assert driver.desk.message.startswith("settled at ")


def test_twice_the_speed_is_twice_the_time(driver: Driver) -> None:
    driver.key("=")
    driver.key("space")
    driver.frames(10)
    assert driver.session.time == pytest.approx(2 * 10 * FRAME, abs=0.03)


# the hand


def test_a_robot_that_is_dragged_follows_the_mouse(driver: Driver) -> None:
    driver.key("space")
    driver.press(*driver.robot(2))
    target = driver.pixel(MIDDLE)
    for _ in range(60):
        driver.move(*target, held=1, settled=False)
        driver.frames()
    assert np.hypot(*(place(driver, 2) - MIDDLE)) < 0.3
    assert driver.session.hand is not None and driver.session.hand[0] == 2
    driver.release()
    assert driver.session.hand is None
    assert driver.desk.selected == 2 and driver.window.panel.tab == "robot"


def test_a_robot_that_is_let_go_of_in_swing_flies_on(driver: Driver) -> None:
    driver.desk.attempt(lambda: driver.session.place(1, (0.5, 3.0)))
    driver.key("space")
    driver.press(*driver.robot(1))
    x, y = driver.at
    for k in range(12):
        driver.move(x + 8 * k, y, held=1, settled=False)
        driver.frames()
    driver.release()
    lane = driver.session.lanes[0]
    fast = float(np.hypot(*lane.simulation.velocities[lane.numbers.index(1)]))
    assert fast > lane.circumstances.limits.max_speed
    before = place(driver, 1).copy()
    driver.frames(10)
    assert place(driver, 1)[0] > before[0] + 0.1


def test_while_paused_a_robot_is_put_where_the_mouse_is(driver: Driver) -> None:
    driver.drag(driver.robot(3), driver.pixel((5.0, 3.4)))
    assert np.allclose(place(driver, 3), (5.0, 3.4), atol=0.03)


def test_a_click_on_the_floor_forgets_the_robot_and_a_drag_pans(driver: Driver) -> None:
    driver.click(*driver.robot(1))
    assert driver.desk.selected == 1
    x, y = driver.pixel(MIDDLE)
    driver.drag((x, y), (x + 40, y + 30))
    assert driver.desk.selected == 1
    assert np.allclose(driver.pixel(MIDDLE), (x + 40, y + 30), atol=2)
    driver.click(*driver.pixel(MIDDLE))
    assert driver.desk.selected is None


def test_an_obstacle_is_moved_and_that_can_be_undone_and_done_again(driver: Driver) -> None:
    before = driver.session.environment
    driver.drag_at((4.2, 1.2), (4.6, 1.6), (5.0, 1.8))
    (pillar, _) = driver.session.environment.obstacles
    assert pillar.center == pytest.approx((5.0, 1.8), abs=0.03)
    assert driver.desk.message.startswith("circle “pillar” moved")
    driver.key("ctrl+z")
    assert driver.session.environment == before and driver.desk.message.startswith("undone: ")
    driver.key("ctrl+y")
    assert driver.session.environment.obstacles[0] == pillar
    driver.key("ctrl+z")
    driver.key("ctrl+shift+z")
    assert driver.session.environment.obstacles[0] == pillar


def test_escape_lets_go_of_what_is_dragged(driver: Driver) -> None:
    before = driver.session.environment
    driver.press(*driver.pixel((4.2, 1.2)))
    driver.move(*driver.pixel((5.0, 1.8)), held=1)
    driver.key("escape")
    driver.release()
    assert driver.session.environment is before


def test_the_second_button_does_not_let_go_of_what_the_first_holds(driver: Driver) -> None:
    driver.press(*driver.pixel((4.2, 1.2)))
    driver.move(*driver.pixel((4.6, 1.4)), held=1)
    driver.post(pygame.MOUSEBUTTONDOWN, pos=driver.at, button=3)
    driver.release(3)
    driver.move(*driver.pixel((5.0, 1.8)), held=1)
    driver.release()
    assert driver.session.environment.obstacles[0].center == pytest.approx((5.0, 1.8), abs=0.03)


# drawing


def test_a_polygon_is_drawn_corner_by_corner_and_closed_by_enter(driver: Driver) -> None:
    driver.key("p")
    for corner in ((0.4, 3.0), (1.2, 3.0), (0.8, 3.7)):
        driver.click_at(corner)
    assert len(driver.session.environment.obstacles) == 2
    driver.key("return")
    obstacle = driver.session.environment.obstacles[-1]
    assert np.allclose(obstacle.vertices, ((0.4, 3.0), (1.2, 3.0), (0.8, 3.7)), atol=0.02)
    assert driver.desk.message.startswith("polygon drawn")


@pytest.mark.parametrize("how", ["double click", "first corner", "right click"])
def test_a_polygon_is_closed_by(how: str, driver: Driver) -> None:
    driver.key("p")
    for corner in ((0.4, 3.0), (1.2, 3.0), (0.8, 3.7)):
        driver.click_at(corner)
        driver.frames(20)
    if how == "double click":
        driver.click_at((0.5, 3.5))
        driver.click_at((0.5, 3.5))
    elif how == "first corner":
        driver.click_at((0.4, 3.0))
    else:
        driver.click_at((1.8, 3.0), button=3)
    obstacle = driver.session.environment.obstacles[-1]
    assert len(obstacle.vertices) == (4 if how == "double click" else 3)


def test_a_wall_is_as_wide_as_was_asked(driver: Driver) -> None:
    driver.key("w")
    driver.key("]")
    driver.click_at((0.4, 3.6))
    driver.click_at((1.4, 3.6))
    driver.key("enter")
    wall = driver.session.environment.obstacles[-1]
    assert wall.width == 0.125 and np.allclose(wall.points, ((0.4, 3.6), (1.4, 3.6)), atol=0.02)


def test_a_circle_is_dragged_from_its_middle_to_its_rim(driver: Driver) -> None:
    driver.key("c")
    driver.drag_at((1.0, 3.2), (1.2, 3.2), (1.4, 3.2))
    circle = driver.session.environment.obstacles[-1]
    assert circle.center == pytest.approx((1.0, 3.2), abs=0.02)
    assert circle.radius == pytest.approx(0.4, abs=0.03)


def test_the_eraser_deletes_obstacles_and_robots(driver: Driver) -> None:
    driver.key("x")
    driver.click_at((4.2, 1.2))
    assert len(driver.session.environment.obstacles) == 1
    driver.click(*driver.robot(2))
    assert driver.session.numbers == (1, 3)
    driver.key("ctrl+z", 2)
    assert driver.session.numbers == (1, 2, 3) and len(driver.session.environment.obstacles) == 2


def test_robots_join_fail_and_are_revived_by_clicks(driver: Driver) -> None:
    driver.key("a")
    driver.click_at((5.0, 3.0))
    assert driver.session.numbers == (1, 2, 3, 4)
    assert np.allclose(place(driver, 4), (5.0, 3.0), atol=0.02)
    driver.key("d")
    driver.click(*driver.robot(4))
    assert driver.session.numbers == (1, 2, 3)
    driver.click_at((5.0, 3.0))
    assert driver.session.numbers == (1, 2, 3, 4)


@pytest.mark.parametrize(
    ("corners", "why"),
    [
        (((0.4, 3.0), (1.2, 3.0)), "three corners"),
        (((0.4, 3.0), (1.2, 3.6), (1.2, 3.0), (0.4, 3.6)), "crosses itself"),
    ],
)
def test_an_obstacle_that_cannot_be_is_refused_with_the_reason(corners, why: str, driver: Driver) -> None:
    before = driver.session.environment
    driver.key("p")
    for corner in corners:
        driver.click_at(corner)
    driver.key("return")
    assert why in driver.desk.message and driver.desk.trouble
    assert driver.session.environment is before


def test_an_obstacle_over_all_of_the_floor_is_refused(driver: Driver) -> None:
    before = driver.session.environment
    driver.key("p")
    for corner in ((0.01, 0.01), (5.99, 0.01), (5.99, 3.99), (0.01, 3.99)):
        driver.click_at(corner)
    driver.key("return")
    assert driver.desk.trouble and driver.desk.message
    assert driver.session.environment is before


def test_the_ruler_measures(driver: Driver) -> None:
    driver.key("m")
    driver.drag_at((1.0, 3.0), (3.0, 3.0))
    preview = driver.desk.tool.preview(driver.session)
    assert preview is not None and preview.words.startswith("2.0")


def test_what_is_drawn_is_in_the_pane_under_the_mouse(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, RPF) as driver:
        driver.key("c")
        driver.drag(driver.pixel((1.0, 3.2), 1), driver.pixel((1.4, 3.2), 1))
        assert driver.desk.active == 1
        for lane in driver.session.lanes:
            assert lane.circumstances.environment.obstacles[-1].center == pytest.approx((1.0, 3.2), abs=0.05)


# the panel


def test_a_controller_is_chosen_from_the_menu(driver: Driver) -> None:
    driver.choose("law:0", "RPF")
    assert driver.session.lanes[0].law.name == "rpf"
    assert driver.window.panel.widgets.find("entry", "k_att") is None
    driver.choose("law:0", "LA")
    assert driver.session.lanes[0].law.name == "lloyd"


def test_an_own_controller_of_the_same_name_can_be_told_from_the_other(tmp_path: Path) -> None:
    own = "from dataclasses import dataclass\nimport numpy as np\n@dataclass(frozen=True)\nclass Mine:\n"
    own += "    label = 'RAPF'\n    def force(self, own):\n        return np.zeros(2)\n"
    (tmp_path / "mine.py").write_text(own)
    (tmp_path / "also").mkdir()
    (tmp_path / "also/mine.py").write_text(own)
    names = [f"{tmp_path / 'mine.py'}:Mine", f"{tmp_path / 'also/mine.py'}:Mine"]
    assert law_labels(["rapf", *names]) == {
        "rapf": "RAPF",
        names[0]: "RAPF (mine.py)",
        names[1]: f"RAPF ({names[1]})",
    }
    with opened(tmp_path, RAPF, RPF, RPF, RPF) as driver:
        for name in names:
            driver.desk.attempt(lambda name=name: driver.desk.command(f"controller {name}"))
        driver.desk.attempt(lambda: driver.desk.set_law(0, "rapf"))
        driver.settle()
        menu = driver.widget("menu", "law:1")
        driver.click(*menu.rect.center)
        items = [item["text"] for item in menu.current_state.options_selection_list.item_list]
        assert len(set(items)) == len(items) == len(CONTROLLERS) + 2
        driver.key("escape")
        driver.choose("law:1", items[-1].strip())
        assert driver.session.lanes[1].law.name == names[1]


def test_a_map_and_a_start_are_chosen_from_their_menus(driver: Driver) -> None:
    driver.choose("map", "trap")
    assert driver.desk.map_name == "trap" and driver.session.environment.name == "Trap"
    driver.choose("start", "inside")
    assert driver.session.scenario.start_name == "inside"


def test_a_start_that_an_obstacle_covers_stays_in_the_menu_until_another_is_chosen(driver: Driver) -> None:
    driver.choose("start", "far")
    driver.key("c")
    driver.drag_at((5.2, 3.2), (5.2, 3.5), (5.2, 3.75))
    assert "far" not in driver.session.environment.starts and driver.session.scenario.start_name == "far"
    driver.push("seed")
    driver.choose("start", "spread")
    assert driver.session.scenario.start_name == "spread"


def test_a_menu_is_closed_by_a_click_elsewhere_and_that_click_does_nothing_else(driver: Driver) -> None:
    driver.click(*driver.widget("menu", "map").rect.center)
    assert driver.window.panel.unfolded
    camera = driver.window.arena._painters[0].camera
    driver.click_at(MIDDLE)
    driver.settle()
    assert not driver.window.panel.unfolded
    assert driver.window.arena._painters[0].camera == camera and driver.desk.map_name == "hall"


def test_escape_closes_a_menu_and_nothing_else(driver: Driver) -> None:
    driver.key("p")
    driver.click(*driver.widget("menu", "map").rect.center)
    driver.key("escape")
    driver.settle()
    assert not driver.window.panel.unfolded and driver.desk.tool.name == "polygon"


def test_an_open_menu_lies_over_what_is_below_it(driver: Driver) -> None:
    """A choice from the list presses none of the buttons under it."""
    step = driver.widget("button", "step").rect
    driver.click(*driver.widget("menu", "map").rect.center)
    options = driver.widget("menu", "map").current_state.options_selection_list
    over = [i for i in options.item_list if i["button_element"] is not None]
    item = next(i for i in over if i["button_element"].rect.collidepoint(driver.at[0], step.centery))
    driver.click(driver.at[0], step.centery)
    assert driver.session.end == 0.0 and driver.desk.map_name == item["text"].strip()


def test_a_slider_that_is_dragged_sets_its_gain_as_it_moves(driver: Driver) -> None:
    driver.slide("k_rep", 0.75)
    value = driver.session.lanes[0].law.value("k_rep")
    assert value == pytest.approx(0.3 * 30**0.5, rel=0.2)
    assert driver.widget("entry", "k_rep").get_text() == f"{value:.4g}"
    assert driver.session.events[-1].kind == "law"


def test_a_click_beside_the_knob_brings_it_there(driver: Driver) -> None:
    slider = driver.widget("slider", "team.max_speed")
    driver.click(slider.rect.right - 12, slider.rect.centery)
    assert driver.session.lanes[0].circumstances.limits.max_speed > 4.0
    assert slider.sliding_button.rect.collidepoint(driver.at)


def test_sliding_builds_nothing_anew(driver: Driver) -> None:
    made = driver.widget("entry", "k_rep")
    driver.slide("k_rep", 0.2)
    driver.slide("team.radius", 0.6)
    assert driver.widget("entry", "k_rep") is made


def test_the_knob_can_be_dragged_far_beyond_its_slider(driver: Driver) -> None:
    slider = driver.widget("slider", "speed")
    knob = slider.sliding_button.rect
    driver.drag(knob.center, (knob.centerx + 40, 10), (20, 590))
    assert driver.session.clock.speed == 0.1


def test_the_speed_slider_rests_on_speeds(driver: Driver) -> None:
    slider = driver.widget("slider", "speed")
    driver.slide("speed", 0.81)
    assert driver.session.clock.speed == 8.0
    driver.frames(3)
    assert slider.get_current_value() == 6
    driver.slide("speed", 1.0)
    assert math.isinf(driver.session.clock.speed)


def test_a_value_that_is_typed_replaces_the_old_one_with_enter(driver: Driver) -> None:
    driver.write("k_rep", "1.25")
    assert driver.session.lanes[0].law.value("k_rep") != 1.25 and driver.window.panel.typing
    driver.key("return")
    assert driver.session.lanes[0].law.value("k_rep") == 1.25
    assert not driver.window.panel.typing
    assert driver.widget("slider", "k_rep").get_current_value() > 0.5


def test_the_enter_of_the_key_pad_does_too(driver: Driver) -> None:
    driver.write("team.max_speed", "0.5")
    driver.key("enter")
    assert driver.session.lanes[0].circumstances.limits.max_speed == 0.5


@pytest.mark.parametrize(("field", "text"), [("k_rep", "much"), ("team.max_speed", "-1"), ("robots", "1.5")])
def test_a_wrong_value_is_told_and_the_field_shows_the_old_one_again(
    field: str, text: str, driver: Driver
) -> None:
    before = driver.widget("entry", field).get_text()
    driver.write(field, text)
    assert driver.widget("entry", field).get_text() == text
    driver.key("return")
    assert driver.desk.trouble and driver.desk.message
    assert driver.widget("entry", field).get_text() == before


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
    assert driver.widget("entry", "k_rep").get_text() == "0.3"
    assert driver.session.lanes[0].law == RAPF


def test_keys_that_are_typed_into_a_field_are_no_shortcuts(driver: Driver) -> None:
    shown = set(driver.desk.shown)
    driver.write("k_rep", "1r t")
    driver.key("space")
    driver.key("home")
    driver.key("delete")
    assert driver.desk.shown == shown and driver.desk.theme == "light" and not driver.session.playing
    driver.key("f1")
    assert driver.window.help


def test_keys_repeat_as_before_after_something_was_typed(driver: Driver) -> None:
    driver.write("k_rep", "1")
    driver.key("return")
    driver.frames(2)
    assert pygame.key.get_repeat() == KEY_REPEAT


def test_typing_goes_on_in_the_middle_after_a_second_click(driver: Driver) -> None:
    entry = driver.widget("entry", "seed")
    driver.write("seed", "123")
    driver.frames(40)
    driver.click(entry.rect.left + 8, entry.rect.centery)
    driver.type("9")
    assert sorted(entry.get_text()) == ["1", "2", "3", "9"]


def test_the_reset_button_goes_back_to_the_default(driver: Driver) -> None:
    driver.desk.attempt(lambda: driver.desk.command("k_rep 4"))
    driver.settle()
    assert driver.widget("slider", "k_rep").get_current_value() > 0.7
    driver.push("reset:k_rep")
    assert driver.session.lanes[0].law.value("k_rep") == 0.3
    assert driver.widget("slider", "k_rep").get_current_value() == pytest.approx(0.5, abs=0.02)
    assert driver.widget("entry", "k_rep").get_text() == "0.3"


def test_robots_and_seed_are_typed_and_counted(driver: Driver) -> None:
    driver.write("robots", "5")
    driver.key("return")
    assert len(driver.session.numbers) == 5
    driver.push("fewer")
    driver.push("more")
    driver.push("more")
    assert driver.session.scenario.robots == 6 and driver.widget("entry", "robots").get_text() == "6"
    driver.write("seed", "41")
    driver.key("return")
    driver.push("seed")
    assert driver.session.scenario.seed == 42 and driver.widget("entry", "seed").get_text() == "42"
    assert driver.widget("button", "seed").text == "↻"


def test_tabs_turn_pages_and_check_boxes_switch_layers(driver: Driver) -> None:
    for tab in TABS:
        driver.turn(tab)
        assert driver.window.panel.tab == tab
        assert "#chosen_tab" in driver.widget("button", f"tab:{tab}").object_ids
    driver.turn("show")
    for name in ("cells", "grid"):
        assert name in driver.desk.shown
        driver.tick(name)
        assert name not in driver.desk.shown and not driver.widget("check", name).is_checked
    words = driver.widget("check", "cells").text_label.rect
    driver.click(*words.center)
    assert "cells" in driver.desk.shown
    driver.key("1")
    driver.frames(3)
    assert "cells" not in driver.desk.shown and not driver.widget("check", "cells").is_checked
    driver.key("ctrl+tab")
    assert driver.window.panel.tab == "robot"


def test_panes_are_added_up_to_four_and_closed_again(driver: Driver) -> None:
    for count in (2, 3, 4):
        driver.push("pane:add")
        assert len(driver.session.lanes) == count
    assert driver.window.panel.widgets.find("button", "pane:add") is None
    assert len({box[2:] for box in driver.window.layout.panes}) == 1
    driver.frames(3)
    laws = [lane.law.name for lane in driver.session.lanes]
    driver.push("close:1")
    assert [lane.law.name for lane in driver.session.lanes] == [laws[0], *laws[2:]]
    driver.push("close:0")
    driver.push("close:1")
    assert [lane.law.name for lane in driver.session.lanes] == [laws[2]]
    assert driver.window.panel.widgets.find("button", "close:0") is None


def test_the_page_is_of_the_pane_that_was_clicked(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, RPF) as driver:
        assert driver.window.panel.widgets.find("entry", "k_att") is not None
        driver.click(*driver.pixel(MIDDLE, 1))
        assert driver.desk.active == 1
        assert driver.window.panel.widgets.find("entry", "k_att") is None
        driver.write("k_rep", "5")
        driver.key("return")
        assert [lane.law.value("k_rep") for lane in driver.session.lanes] == [0.3, 5.0]


def test_fail_and_remove_buttons_are_of_the_robot_that_is_asked(driver: Driver) -> None:
    driver.click(*driver.robot(2))
    driver.push("robot:fail")
    assert driver.session.numbers == (1, 3)
    driver.push("robot:fail")
    driver.push("robot:next")
    driver.push("robot:remove")
    assert driver.session.numbers == (1, 2)


def test_the_panel_can_be_hidden_and_the_arena_takes_its_place(driver: Driver) -> None:
    driver.key("h")
    assert driver.window.layout.panel[2] == 0 and driver.window.panel.widgets is None
    assert driver.window.layout.arena[2] == 900
    driver.click(880, 40)
    driver.key("space")
    driver.frames(3)
    driver.key("h")
    assert driver.window.panel.widgets is not None and driver.session.end > 0.0


def test_pages_that_were_turned_to_before_look_as_they_did(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, RPF) as driver:
        driver.move(100, 300)
        pictures = {}
        for tab in TABS * 2:
            driver.window.panel.show_tab(tab)
            driver.frames(3, 0.3)
            if tab in pictures:
                assert driver.same(pictures[tab]), tab
            pictures[tab] = driver.picture()
        driver.desk.active = 1
        driver.window.panel.show_tab("parameters")
        driver.frames(2, 0.3)
        assert not driver.same(pictures["parameters"])
        driver.desk.active = 0
        driver.desk.version += 1
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
        driver.desk.attempt(lambda: driver.session.add_pane(RPF))
        panel(driver)
        resized(driver, (1100, 700))
        assert np.array_equal(panel(driver), wanted)


# tool tips


def test_tool_tips_tell_what_and_by_which_key(driver: Driver) -> None:
    button = driver.widget("button", "step")
    driver.move(*button.rect.center)
    driver.frames(60)
    assert button.tool_tip is not None
    assert "Single step (.)" in button.tool_tip_text
    driver.move(100, 100)
    driver.frames(12)
    assert button.tool_tip is None


def test_tool_tips_of_gains_tell_what_they_mean_and_no_letter_is_taken_for_a_sign(driver: Driver) -> None:
    tips = [each.tool_tip_text for each in driver.window.panel.widgets.manager.ui_group.sprites()]
    assert any(tip and "N m³" in tip for tip in tips)
    assert not any(tip and "<" in tip for tip in tips)


# time line


def played(driver: Driver, steps: int) -> Driver:
    for _ in range(steps):
        driver.session.step()
        driver.window._ask_costs()
    driver.frames(2, 0.2)
    return driver


def at(driver: Driver, time: float) -> tuple[float, float]:
    """Return the pixel on the time line of a time."""
    _, top, _, high = driver.window.layout.track
    return driver.window.chart.column(time), top + high / 2


def test_the_time_line_is_dragged_to_look_back_and_to_the_end_again(driver: Driver) -> None:
    played(driver, 120)
    driver.press(*at(driver, 1.0))
    assert driver.session.time == pytest.approx(1.0, abs=0.05) and not driver.session.live
    driver.move(*at(driver, 0.4), held=1)
    assert driver.session.time == pytest.approx(0.4, abs=0.05)
    driver.move(*at(driver, 9.0), held=1)
    assert driver.session.live
    driver.release()
    driver.move(*at(driver, 0.2))
    assert driver.session.live


def test_a_branch_leaves_a_ghost_of_what_came_after(driver: Driver) -> None:
    played(driver, 120)
    driver.click(*at(driver, 0.5))
    driver.key("b")
    assert driver.session.live and driver.session.playing
    assert driver.session.end < 0.7 and len(driver.session.ghosts) == 1
    driver.frames(3)


def test_a_touch_in_the_past_goes_on_from_there(driver: Driver) -> None:
    played(driver, 120)
    driver.click(*at(driver, 0.5))
    driver.key("c")
    driver.drag_at((1.0, 3.2), (1.3, 3.2))
    assert driver.session.live and driver.session.end == pytest.approx(0.5, abs=0.05)
    assert [event.kind for event in driver.session.events] == ["obstacle"]


def test_what_happened_is_marked_and_told_under_the_mouse(driver: Driver) -> None:
    played(driver, 60)
    driver.move(*at(driver, 0.5))
    quiet = driver.picture()
    driver.desk.attempt(lambda: driver.session.fail_robot(2))
    played(driver, 60)
    (event,) = driver.session.events
    assert event.time == pytest.approx(1.0) and event.text == "robot 2 failed"
    assert not driver.same(quiet)
    driver.move(*at(driver, 1.0))
    assert driver.window.chart.hover == driver.at


def test_home_end_and_arrows_go_through_time(driver: Driver) -> None:
    played(driver, 120)
    driver.key("home")
    assert driver.session.time == 0.0
    driver.key("right")
    assert 0.0 < driver.session.time < 0.2
    driver.key("shift+right")
    assert driver.session.time == pytest.approx(1.0, abs=0.2)
    driver.key("end")
    assert driver.session.live


# camera


def world(driver: Driver, pane: int = 0) -> np.ndarray:
    return np.array(driver.window.arena.to_world(driver.at, pane))


@pytest.mark.parametrize("amount", [3, -1])
def test_zooming_keeps_the_place_under_the_cursor(amount: int, driver: Driver) -> None:
    driver.wheel(200, 150, 2)
    before, zoom = world(driver), driver.window.arena._painters[0].camera.zoom
    driver.wheel(200, 150, amount)
    assert np.allclose(world(driver), before, atol=1e-9)
    assert (driver.window.arena._painters[0].camera.zoom > zoom) == (amount > 0)


@pytest.mark.parametrize("button", [2, 3])
def test_the_other_buttons_pan_whatever_tool_there_is(button: int, driver: Driver) -> None:
    driver.key("p")
    before = driver.pixel(MIDDLE)
    driver.drag((200, 200), (230, 190), (260, 180), button=button)
    assert np.allclose(driver.pixel(MIDDLE), np.add(before, (60, -20)), atol=1)
    assert driver.desk.tool.preview(driver.session) is None


def test_fitting_shows_the_whole_map_again_after_zooming_and_panning_by_keys(driver: Driver) -> None:
    camera = driver.window.arena._painters[0].camera
    for key in ("ctrl+=", "ctrl+=", "ctrl+left", "ctrl+up", "ctrl+-", "ctrl+right", "ctrl+down"):
        before = driver.window.arena._painters[0].camera
        driver.key(key)
        assert driver.window.arena._painters[0].camera != before, key
    driver.key("f")
    assert driver.window.arena._painters[0].camera == camera


def test_one_camera_for_all_panes(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, RPF) as driver:
        x, y = driver.pixel(MIDDLE, 1)
        driver.wheel(x, y, 3)
        first, second = driver.window.arena._painters
        assert first.camera.zoom == second.camera.zoom and first.camera.center == second.camera.center
        assert np.allclose(driver.window.arena.to_world(driver.at, 1), MIDDLE, atol=0.02)


# words, pictures, files


def test_the_status_line_tells_of_the_place_under_the_cursor(tmp_path: Path) -> None:
    with opened(tmp_path, lattice=48) as driver:
        driver.frames(3)
        driver.move(*driver.robot(2))
        assert "robot 2" in cursor_words(driver.desk)
        driver.move(*driver.pixel((4.2, 1.2)))
        assert "not free" in cursor_words(driver.desk)
        driver.post(pygame.WINDOWLEAVE)
        driver.settle()
        assert cursor_words(driver.desk) == ""


def test_a_screenshot_is_what_is_in_the_window(driver: Driver, tmp_path: Path) -> None:
    picture = driver.picture()
    driver.key("f12")
    with Image.open(tmp_path / "robocov-1.png") as saved:
        assert np.array_equal(np.asarray(saved.convert("RGB")).astype(int), picture)
    driver.turn("keep")
    driver.push("screenshot")
    assert (tmp_path / "robocov-2.png").exists()


def test_a_run_is_saved_beside_the_window(driver: Driver, tmp_path: Path) -> None:
    for _ in range(30):
        driver.session.step()
    driver.key("ctrl+e")
    driver.window.keeper.finish()
    driver.frames(2)
    assert not driver.desk.trouble and "saved" in driver.desk.message
    (record,) = tmp_path.rglob("record.npz")
    assert record.parent != tmp_path


def test_a_film_is_as_long_as_what_it_shows(driver: Driver, tmp_path: Path) -> None:
    driver.key("space")
    driver.key("f9")
    assert driver.desk.filming
    driver.frames(60)
    resized(driver, (1000, 640))
    driver.frames(15)
    driver.key("f9")
    path = tmp_path / "robocov-1.mp4"
    assert driver.desk.message.startswith(f"film saved: {path}") and not driver.desk.filming
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert seconds == pytest.approx(75 * FRAME, abs=0.15) and count == pytest.approx(45, abs=4)
    assert next(imageio_ffmpeg.read_frames(str(path)))["size"] == (900, 600)


def test_closing_ends_the_film(tmp_path: Path) -> None:
    with opened(tmp_path) as driver:
        driver.key("f9")
        driver.frames(10)
        driver.post(pygame.QUIT)
        driver.settle()
        assert driver.window.closed
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "robocov-1.mp4"))[0] > 0


def test_a_folder_that_is_none_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with opened(tmp_path / "file") as driver:
        for key in ("f12", "f9", "ctrl+s"):
            driver.desk.trouble = False
            driver.key(key)
            assert driver.desk.trouble and driver.desk.message, key
        assert driver.window.film is None and not driver.desk.filming


# help, palette, theme, size


@pytest.mark.parametrize("key", ["f1", "shift+/"])
def test_the_keys_are_shown_and_go_with_a_key_or_a_click(key: str, driver: Driver) -> None:
    plain = driver.picture()
    driver.key(key)
    assert driver.window.help and not driver.same(plain)
    driver.key("escape")
    assert not driver.window.help
    driver.key(key)
    driver.click(300, 300)
    assert not driver.window.help and driver.desk.selected is None


@pytest.mark.parametrize("key", ["/", "ctrl+k"])
def test_commands_are_found_by_their_names(key: str, driver: Driver) -> None:
    driver.key(key)
    palette = driver.window.palette
    assert palette.open and palette.text == ""
    driver.type("single")
    assert [action.name for action in palette.found] == ["step"]
    driver.key("return")
    assert driver.session.end > 0.0 and not palette.open


def test_the_palette_is_moved_through_erased_and_left(driver: Driver) -> None:
    palette = driver.window.palette
    driver.key("ctrl+k")
    driver.type("rob")
    several = palette.found
    assert len(several) > 2
    driver.key("down", 2)
    driver.key("up")
    assert palette.chosen == 1
    driver.key("backspace")
    assert palette.text == "ro" and palette.chosen == 0
    driver.key("up")
    assert palette.chosen == 0
    driver.key("down", Palette.ROWS + 3)
    assert palette.chosen == len(palette.found) - 1
    driver.key("escape")
    assert not palette.open and driver.session.end == 0.0


def test_values_are_set_by_typing(driver: Driver) -> None:
    driver.key("ctrl+k")
    driver.type("k_rep 0.5")
    driver.key("return")
    assert driver.session.lanes[0].law.value("k_rep") == 0.5
    driver.key("ctrl+k")
    driver.type("robots 5")
    driver.key("enter")
    assert len(driver.session.numbers) == 5
    driver.key("ctrl+k")
    driver.type("robots many")
    driver.key("return")
    assert driver.desk.trouble


def test_a_key_that_is_held_down_saves_one_picture_but_goes_on_stepping(
    driver: Driver, tmp_path: Path
) -> None:
    for code, name in ((pygame.K_F12, ""), (pygame.K_PERIOD, ".")):
        for _ in range(5):
            driver.post(pygame.KEYDOWN, key=code, mod=0, unicode=name, scancode=0)
        driver.post(pygame.KEYUP, key=code, mod=0, unicode=name, scancode=0)
    driver.settle()
    assert [path.name for path in tmp_path.iterdir()] == ["robocov-1.png"]
    assert driver.session.end == pytest.approx(5 / 60)
    driver.key("f12")
    assert (tmp_path / "robocov-2.png").exists()


def test_the_theme_is_switched_for_everything(driver: Driver) -> None:
    light = driver.picture()
    driver.key("t")
    driver.frames(3, 0.3)
    dark = driver.picture()
    for part in (slice(0, 500), slice(600, 900)):
        assert light[:, part].mean() > 190 and dark[:, part].mean() < 90
    driver.key("t")
    driver.frames(3, 0.3)
    assert driver.picture().mean() > 190


def resized(driver: Driver, size: tuple[int, int]) -> None:
    pygame.display.set_mode(size, pygame.RESIZABLE)
    driver.post(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1])
    driver.settle()


@pytest.mark.parametrize("size", [(900, 600), (1500, 700), (3840, 2160), (640, 480)])
@pytest.mark.parametrize("panes", [1, 3])
def test_any_size_is_laid_out_and_can_be_used(size: tuple[int, int], panes: int, tmp_path: Path) -> None:
    with opened(
        tmp_path, *([RAPF] * panes), size=(1280, 720), scale=2.0 if size[0] > 3000 else 1.0
    ) as driver:
        resized(driver, size)
        assert driver.window.layout.size == size
        driver.key("space")
        driver.frames(2)
        driver.push("pause")
        assert not driver.session.playing
        driver.turn("keep")
        driver.click(*driver.robot(1))
        assert driver.desk.selected == 1
        if size[0] >= 900:
            driver.turn("parameters")
            driver.push("reset:k_rep")


def test_a_page_that_is_too_long_is_scrolled_by_the_wheel_and_by_its_bar(driver: Driver) -> None:
    entry = driver.widget("entry", "team.radius")
    left, top, width, height = driver.window.panel.body
    assert entry.rect.bottom > 600
    for _ in range(12):
        driver.wheel(left + width / 2, top + height / 2, -3)
        driver.frames(3)
    assert entry.rect.bottom <= 600
    driver.write("team.radius", "0.12")
    driver.key("return")
    assert driver.session.lanes[0].circumstances.limits.radius == 0.12
    bar = driver.window.panel.widgets._sections["page"].scrolled.vert_scroll_bar.sliding_button
    driver.drag(bar.rect.center, (bar.rect.centerx, bar.rect.centery - 200))
    driver.frames(2)
    assert entry.rect.bottom > 600
    camera = driver.window.arena._painters[0].camera
    driver.wheel(left + width / 2, top + height / 2, -3)
    assert driver.window.arena._painters[0].camera == camera


# tour


def test_the_tour_is_played_and_ends_on_a_key(driver: Driver) -> None:
    shown = set(driver.desk.shown)
    driver.key("f2")
    assert driver.window.tour is not None and driver.session.playing
    driver.frames(5)
    driver.key("f12")
    driver.key("t")
    assert driver.window.tour is not None
    driver.key("escape")
    assert driver.window.tour is None and driver.desk.shown == shown
    assert driver.desk.message == "the tour has ended"


def test_the_tour_ends_when_the_arena_is_touched(driver: Driver) -> None:
    driver.key("f2")
    driver.frames(3)
    driver.click(*driver.window.layout.arena[2:])
    driver.click(200, 200)
    assert driver.window.tour is None


# settings


def test_settings_are_written_and_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER, str(tmp_path / "settings"))
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")

    def window(size: tuple[int, int] | None = None):
        opening = Opening(begun(), "hall", tmp_path, size=size, lattice=4)
        return opening.window()

    with window((1000, 640)) as first:
        driver = Driver(first)
        driver.key("t")
        driver.key("shift+t")
        driver.turn("show")
        driver.tick("cells")
        first.close()
    kept = json.loads((tmp_path / "settings/window.json").read_text())
    assert kept["theme"] == "dark" and kept["fade"] and kept["tab"] == "show"
    assert "cells" not in kept["shown"] and (kept["width"], kept["height"]) == (1000, 640)
    with window() as second:
        assert second.screen.get_size() == (1000, 640)
        assert second.desk.theme == "dark" and second.desk.fade and second.panel.tab == "show"
        assert "cells" not in second.desk.shown and "robots" in second.desk.shown
        second.close()
