"""The window, as it is used: the hand and the tools that draw."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import MIDDLE, Driver, opened, place
from sample_sessions import RAPF, RPF

# the hand


def test_a_robot_that_is_dragged_follows_the_mouse(driver: Driver) -> None:
    driver.key("space")
    driver.press(*driver.robot(2))
    target = driver.pixel(MIDDLE)
    for _ in range(60):
        driver.move(*target, held=1, settled=False)
        driver.frames()
    assert np.hypot(*(place(driver, 2) - MIDDLE)) < 0.3
    assert driver.session.timeline.drag is not None and driver.session.timeline.drag[0] == 2
    driver.release()
    assert driver.session.timeline.drag is None
    assert driver.viewer.selected_robot == 2 and driver.window.panel.tab == "robot"


def test_a_robot_that_is_let_go_of_in_swing_flies_on(driver: Driver) -> None:
    driver.viewer.attempt(lambda: driver.session.place_robot(1, (0.5, 3.0)))
    driver.key("space")
    driver.press(*driver.robot(1))
    x, y = driver.at
    for k in range(12):
        driver.move(x + 8 * k, y, held=1, settled=False)
        driver.frames()
    driver.release()
    pane = driver.session.timeline.panes[0]
    fast = float(np.hypot(*pane.simulation.velocities[pane.numbers.index(1)]))
    assert fast > pane.setup.properties.max_speed
    before = place(driver, 1).copy()
    driver.frames(10)
    assert place(driver, 1)[0] > before[0] + 0.1


def test_while_paused_a_robot_is_put_where_the_mouse_is(driver: Driver) -> None:
    driver.drag(driver.robot(3), driver.pixel((5.0, 3.4)))
    assert np.allclose(place(driver, 3), (5.0, 3.4), atol=0.03)


def test_a_click_on_the_floor_forgets_the_robot_and_a_drag_pans(driver: Driver) -> None:
    driver.click(*driver.robot(1))
    assert driver.viewer.selected_robot == 1
    x, y = driver.pixel(MIDDLE)
    driver.drag((x, y), (x + 40, y + 30))
    assert driver.viewer.selected_robot == 1
    assert np.allclose(driver.pixel(MIDDLE), (x + 40, y + 30), atol=2)
    driver.click(*driver.pixel(MIDDLE))
    assert driver.viewer.selected_robot is None


def test_an_obstacle_is_moved_and_that_can_be_undone_and_done_again(driver: Driver) -> None:
    before = driver.session.displayed.environment
    driver.drag_at((4.2, 1.2), (4.6, 1.6), (5.0, 1.8))
    (pillar, _) = driver.session.displayed.environment.obstacles
    assert pillar.center == pytest.approx((5.0, 1.8), abs=0.03)
    assert driver.viewer.message.startswith("circle “pillar” moved")
    driver.key("ctrl+z")
    assert driver.session.displayed.environment == before and driver.viewer.message.startswith("undone: ")
    driver.key("ctrl+y")
    assert driver.session.displayed.environment.obstacles[0] == pillar
    driver.key("ctrl+z")
    driver.key("ctrl+shift+z")
    assert driver.session.displayed.environment.obstacles[0] == pillar


def test_escape_lets_go_of_what_is_dragged(driver: Driver) -> None:
    before = driver.session.displayed.environment
    driver.press(*driver.pixel((4.2, 1.2)))
    driver.move(*driver.pixel((5.0, 1.8)), held=1)
    driver.key("escape")
    driver.release()
    assert driver.session.displayed.environment is before


def test_the_second_button_does_not_let_go_of_what_the_first_holds(driver: Driver) -> None:
    driver.press(*driver.pixel((4.2, 1.2)))
    driver.move(*driver.pixel((4.6, 1.4)), held=1)
    driver.post(pygame.MOUSEBUTTONDOWN, pos=driver.at, button=3)
    driver.release(3)
    driver.move(*driver.pixel((5.0, 1.8)), held=1)
    driver.release()
    assert driver.session.displayed.environment.obstacles[0].center == pytest.approx((5.0, 1.8), abs=0.03)


# drawing


def test_a_polygon_is_drawn_corner_by_corner_and_closed_by_enter(driver: Driver) -> None:
    driver.key("p")
    for corner in ((0.4, 3.0), (1.2, 3.0), (0.8, 3.7)):
        driver.click_at(corner)
    assert len(driver.session.displayed.environment.obstacles) == 2
    driver.key("return")
    obstacle = driver.session.displayed.environment.obstacles[-1]
    assert np.allclose(obstacle.vertices, ((0.4, 3.0), (1.2, 3.0), (0.8, 3.7)), atol=0.02)
    assert driver.viewer.message.startswith("polygon drawn")


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
    obstacle = driver.session.displayed.environment.obstacles[-1]
    assert len(obstacle.vertices) == (4 if how == "double click" else 3)


def test_a_wall_is_as_wide_as_was_asked(driver: Driver) -> None:
    driver.key("w")
    driver.key("]")
    driver.click_at((0.4, 3.6))
    driver.click_at((1.4, 3.6))
    driver.key("enter")
    wall = driver.session.displayed.environment.obstacles[-1]
    assert wall.width == 0.125 and np.allclose(wall.points, ((0.4, 3.6), (1.4, 3.6)), atol=0.02)


def test_a_circle_is_dragged_from_its_middle_to_its_rim(driver: Driver) -> None:
    driver.key("c")
    driver.drag_at((1.0, 3.2), (1.2, 3.2), (1.4, 3.2))
    circle = driver.session.displayed.environment.obstacles[-1]
    assert circle.center == pytest.approx((1.0, 3.2), abs=0.02)
    assert circle.radius == pytest.approx(0.4, abs=0.03)


def test_the_eraser_deletes_obstacles_and_robots(driver: Driver) -> None:
    driver.key("x")
    driver.click_at((4.2, 1.2))
    assert len(driver.session.displayed.environment.obstacles) == 1
    driver.click(*driver.robot(2))
    assert driver.session.displayed.numbers == (1, 3)
    driver.key("ctrl+z", 2)
    assert (
        driver.session.displayed.numbers == (1, 2, 3)
        and len(driver.session.displayed.environment.obstacles) == 2
    )


def test_robots_join_fail_and_are_revived_by_clicks(driver: Driver) -> None:
    driver.key("a")
    driver.click_at((5.0, 3.0))
    assert driver.session.displayed.numbers == (1, 2, 3, 4)
    assert np.allclose(place(driver, 4), (5.0, 3.0), atol=0.02)
    driver.key("d")
    driver.click(*driver.robot(4))
    assert driver.session.displayed.numbers == (1, 2, 3)
    driver.click_at((5.0, 3.0))
    assert driver.session.displayed.numbers == (1, 2, 3, 4)


@pytest.mark.parametrize(
    ("corners", "why"),
    [
        (((0.4, 3.0), (1.2, 3.0)), "three corners"),
        (((0.4, 3.0), (1.2, 3.6), (1.2, 3.0), (0.4, 3.6)), "crosses itself"),
    ],
)
def test_an_obstacle_that_cannot_be_is_refused_with_the_reason(corners, why: str, driver: Driver) -> None:
    before = driver.session.displayed.environment
    driver.key("p")
    for corner in corners:
        driver.click_at(corner)
    driver.key("return")
    assert why in driver.viewer.message and driver.viewer.has_error_message
    assert driver.session.displayed.environment is before


def test_an_obstacle_over_all_of_the_floor_is_refused(driver: Driver) -> None:
    before = driver.session.displayed.environment
    driver.key("p")
    for corner in ((0.01, 0.01), (5.99, 0.01), (5.99, 3.99), (0.01, 3.99)):
        driver.click_at(corner)
    driver.key("return")
    assert driver.viewer.has_error_message and driver.viewer.message
    assert driver.session.displayed.environment is before


def test_the_ruler_measures(driver: Driver) -> None:
    driver.key("m")
    driver.drag_at((1.0, 3.0), (3.0, 3.0))
    state = driver.viewer.tool.build_draw_state(driver.session)
    assert state.label.startswith("2.0")


def test_what_is_drawn_is_in_the_pane_under_the_mouse(tmp_path: Path) -> None:
    with opened(tmp_path, RAPF, RPF) as driver:
        driver.key("c")
        driver.drag(driver.pixel((1.0, 3.2), 1), driver.pixel((1.4, 3.2), 1))
        assert driver.viewer.active_pane == 1
        for pane in driver.session.timeline.panes:
            assert pane.setup.environment.obstacles[-1].center == pytest.approx((1.0, 3.2), abs=0.05)
