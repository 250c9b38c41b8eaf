"""The window, used by mouse and keys: the hand and the tools that draw."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import MIDDLE, Driver, get_position, open_viewer
from sample_sessions import RAPF, RPF

# the hand


def test_a_dragged_robot_follows_the_mouse(driver: Driver) -> None:
    driver.press_key("space")
    driver.press(*driver.find_robot_pixel(2))
    target = driver.find_pixel(MIDDLE)
    for _ in range(60):
        driver.move(*target, held=1, settled=False)
        driver.run_frames()
    assert np.hypot(*(get_position(driver, 2) - MIDDLE)) < 0.3
    assert driver.session.timeline.run.drag is not None
    assert driver.session.timeline.run.drag.robot == 2
    driver.release()
    assert driver.session.timeline.run.drag is None
    assert driver.viewer.selected_robot == 2
    assert driver.window.panel.tab == "robot"


def test_a_thrown_robot_keeps_moving(driver: Driver) -> None:
    driver.viewer.attempt(lambda: driver.session.place_robot(1, (0.5, 3.0)))
    driver.press_key("space")
    driver.press(*driver.find_robot_pixel(1))
    x, y = driver.pixel
    for k in range(12):
        driver.move(x + 8 * k, y, held=1, settled=False)
        driver.run_frames()
    driver.release()
    pane = driver.session.timeline.panes[0]
    fast = float(np.hypot(*pane.simulation.velocities[pane.numbers.index(1)]))
    assert fast > pane.setup.properties.max_speed
    before = get_position(driver, 1).copy()
    driver.run_frames(10)
    assert get_position(driver, 1)[0] > before[0] + 0.1


def test_a_robot_is_placed_at_the_mouse_while_paused(driver: Driver) -> None:
    driver.drag(driver.find_robot_pixel(3), driver.find_pixel((5.0, 3.4)))
    assert np.allclose(get_position(driver, 3), (5.0, 3.4), atol=0.03)


def test_a_click_on_the_floor_clears_the_selection_and_a_drag_pans(driver: Driver) -> None:
    driver.click(*driver.find_robot_pixel(1))
    assert driver.viewer.selected_robot == 1
    x, y = driver.find_pixel(MIDDLE)
    driver.drag((x, y), (x + 40, y + 30))
    assert driver.viewer.selected_robot == 1
    assert np.allclose(driver.find_pixel(MIDDLE), (x + 40, y + 30), atol=2)
    driver.click(*driver.find_pixel(MIDDLE))
    assert driver.viewer.selected_robot is None


def test_moving_an_obstacle_can_be_undone_and_redone(driver: Driver) -> None:
    before = driver.session.displayed.environment
    driver.drag_at((4.2, 1.2), (4.6, 1.6), (5.0, 1.8))
    pillar, _ = driver.session.displayed.environment.obstacles
    assert pillar.center == pytest.approx((5.0, 1.8), abs=0.03)
    assert driver.viewer.message.startswith("Circle “pillar” moved")
    driver.press_key("ctrl+z")
    assert driver.session.displayed.environment == before
    assert driver.viewer.message.startswith("Undone: ")
    driver.press_key("ctrl+y")
    assert driver.session.displayed.environment.obstacles[0] == pillar
    driver.press_key("ctrl+z")
    driver.press_key("ctrl+shift+z")
    assert driver.session.displayed.environment.obstacles[0] == pillar


def test_escape_releases_a_dragged_obstacle(driver: Driver) -> None:
    before = driver.session.displayed.environment
    driver.press(*driver.find_pixel((4.2, 1.2)))
    driver.move(*driver.find_pixel((5.0, 1.8)), held=1)
    driver.press_key("escape")
    driver.release()
    assert driver.session.displayed.environment is before


def test_another_button_does_not_release_a_dragged_obstacle(driver: Driver) -> None:
    driver.press(*driver.find_pixel((4.2, 1.2)))
    driver.move(*driver.find_pixel((4.6, 1.4)), held=1)
    driver.post(pygame.MOUSEBUTTONDOWN, pos=driver.pixel, button=3)
    driver.release(3)
    driver.move(*driver.find_pixel((5.0, 1.8)), held=1)
    driver.release()
    assert driver.session.displayed.environment.obstacles[0].center == pytest.approx((5.0, 1.8), abs=0.03)


# drawing


def test_a_polygon_is_drawn_corner_by_corner_and_closed_by_enter(driver: Driver) -> None:
    driver.press_key("p")
    for corner in ((0.4, 3.0), (1.2, 3.0), (0.8, 3.7)):
        driver.click_at(corner)
    assert len(driver.session.displayed.environment.obstacles) == 2
    driver.press_key("return")
    obstacle = driver.session.displayed.environment.obstacles[-1]
    assert np.allclose(obstacle.vertices, ((0.4, 3.0), (1.2, 3.0), (0.8, 3.7)), atol=0.02)
    assert driver.viewer.message.startswith("Polygon drawn")


def click_three_corners(driver: Driver) -> None:
    """Start a polygon, clicking too slowly for double clicks."""
    driver.press_key("p")
    for corner in ((0.4, 3.0), (1.2, 3.0), (0.8, 3.7)):
        driver.click_at(corner)
        driver.run_frames(20)


def test_a_double_click_adds_a_corner_and_closes_the_polygon(driver: Driver) -> None:
    click_three_corners(driver)
    driver.click_at((0.5, 3.5))
    driver.click_at((0.5, 3.5))
    assert len(driver.session.displayed.environment.obstacles[-1].vertices) == 4


def test_a_click_on_the_first_corner_closes_the_polygon(driver: Driver) -> None:
    click_three_corners(driver)
    driver.click_at((0.4, 3.0))
    assert len(driver.session.displayed.environment.obstacles[-1].vertices) == 3


def test_a_right_click_closes_the_polygon(driver: Driver) -> None:
    click_three_corners(driver)
    driver.click_at((1.8, 3.0), button=3)
    assert len(driver.session.displayed.environment.obstacles[-1].vertices) == 3


def test_a_wall_has_the_chosen_width(driver: Driver) -> None:
    driver.press_key("w")
    driver.press_key("]")
    driver.click_at((0.4, 3.6))
    driver.click_at((1.4, 3.6))
    driver.press_key("enter")
    wall = driver.session.displayed.environment.obstacles[-1]
    assert wall.width == 0.125
    assert np.allclose(wall.points, ((0.4, 3.6), (1.4, 3.6)), atol=0.02)


def test_a_circle_is_dragged_from_its_center_to_its_rim(driver: Driver) -> None:
    driver.press_key("c")
    driver.drag_at((1.0, 3.2), (1.2, 3.2), (1.4, 3.2))
    circle = driver.session.displayed.environment.obstacles[-1]
    assert circle.center == pytest.approx((1.0, 3.2), abs=0.02)
    assert circle.radius == pytest.approx(0.4, abs=0.03)


def test_the_eraser_deletes_obstacles_and_robots(driver: Driver) -> None:
    driver.press_key("x")
    driver.click_at((4.2, 1.2))
    assert len(driver.session.displayed.environment.obstacles) == 1
    driver.click(*driver.find_robot_pixel(2))
    assert driver.session.displayed.numbers == (1, 3)
    driver.press_key("ctrl+z", 2)
    assert driver.session.displayed.numbers == (1, 2, 3)
    assert len(driver.session.displayed.environment.obstacles) == 2


def test_robots_are_added_failed_and_revived_by_clicks(driver: Driver) -> None:
    driver.press_key("a")
    driver.click_at((5.0, 3.0))
    assert driver.session.displayed.numbers == (1, 2, 3, 4)
    assert np.allclose(get_position(driver, 4), (5.0, 3.0), atol=0.02)
    driver.press_key("d")
    driver.click(*driver.find_robot_pixel(4))
    assert driver.session.displayed.numbers == (1, 2, 3)
    driver.click_at((5.0, 3.0))
    assert driver.session.displayed.numbers == (1, 2, 3, 4)


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        (((0.4, 3.0), (1.2, 3.0)), "three corners"),
        (((0.4, 3.0), (1.2, 3.6), (1.2, 3.0), (0.4, 3.6)), "crosses itself"),
    ],
)
def test_an_invalid_obstacle_is_rejected_with_the_reason(corners, reason: str, driver: Driver) -> None:
    before = driver.session.displayed.environment
    driver.press_key("p")
    for corner in corners:
        driver.click_at(corner)
    driver.press_key("return")
    assert reason in driver.viewer.message
    assert driver.viewer.has_error_message
    assert driver.session.displayed.environment is before


def test_an_obstacle_that_covers_the_floor_is_rejected(driver: Driver) -> None:
    before = driver.session.displayed.environment
    driver.press_key("p")
    for corner in ((0.01, 0.01), (5.99, 0.01), (5.99, 3.99), (0.01, 3.99)):
        driver.click_at(corner)
    driver.press_key("return")
    assert driver.viewer.has_error_message
    assert driver.viewer.message
    assert driver.session.displayed.environment is before


def test_the_ruler_measures_a_distance(driver: Driver) -> None:
    driver.press_key("m")
    driver.drag_at((1.0, 3.0), (3.0, 3.0))
    state = driver.viewer.tool.build_overlay(driver.session)
    assert state.label.startswith("2.0")


def test_drawing_in_a_pane_activates_it_and_edits_all_panes(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, RPF) as driver:
        driver.press_key("c")
        driver.drag(driver.find_pixel((1.0, 3.2), 1), driver.find_pixel((1.4, 3.2), 1))
        assert driver.viewer.active_pane == 1
        for pane in driver.session.timeline.panes:
            assert pane.setup.environment.obstacles[-1].center == pytest.approx((1.0, 3.2), abs=0.05)
