"""The hand as a select tool: outlines, Shift and Alt, context menus, Delete, and following a robot."""

from __future__ import annotations

import pygame
import pytest
from driven_window import MIDDLE, MODIFIERS, Driver, get_position
from pointer_events import build_event
from sample_sessions import start_session

from robocov.environment import CircleObstacle, Obstacle, WallObstacle
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.tools.hand import HandTool
from robocov_app.viewer.tools.outlines import AddWallTool
from robocov_app.viewer.tools.segments import RulerTool

PILLAR = (4.2, 1.2)
WALL = (2.5, 3.2)
"""Positions on the pillar and on the wall of the hall, m."""


def list_obstacles(driver: Driver) -> tuple[Obstacle, ...]:
    return driver.session.displayed.environment.obstacles


def hold_keys(*names: str) -> None:
    pygame.key.set_mods(sum(MODIFIERS[name] for name in names))


def open_menu(driver: Driver, point: tuple[float, float]) -> list[str]:
    """Right-click a position, m, and return the names of the commands in the menu."""
    driver.click_at(point, button=3)
    menu = driver.window.dialogs.current
    assert isinstance(menu, Menu)
    driver.window.draw()
    return [command.name for command in menu.rows if command is not None]


def choose(driver: Driver, command: str) -> None:
    driver.click(*driver.window.dialogs.ui.widgets[f"option:{command}"].rect.center)
    assert not driver.window.dialogs.is_open


def test_the_obstacle_under_the_cursor_has_an_outline(driver: Driver) -> None:
    driver.move(*driver.find_pixel(MIDDLE))
    plain = driver.copy_frame()
    driver.move(*driver.find_pixel(PILLAR))
    assert not driver.shows_frame(plain)
    assert driver.window.cursor.shape == pygame.SYSTEM_CURSOR_SIZEALL
    driver.move(*driver.find_pixel(MIDDLE))
    assert driver.shows_frame(plain)
    assert driver.window.cursor.shape == pygame.SYSTEM_CURSOR_ARROW


def test_a_click_selects_an_obstacle_and_delete_deletes_it(driver: Driver) -> None:
    count = len(list_obstacles(driver))
    driver.click_at(PILLAR)
    assert isinstance(driver.viewer.inspection.obstacle, CircleObstacle)
    assert len(list_obstacles(driver)) == count
    driver.press_key("escape")
    assert driver.viewer.selected_obstacle is None
    driver.click_at(PILLAR)
    driver.press_key("delete")
    assert len(list_obstacles(driver)) == count - 1
    driver.press_key("ctrl+z")
    assert len(list_obstacles(driver)) == count


def test_delete_removes_the_selected_robot(driver: Driver) -> None:
    driver.click_at(PILLAR)
    driver.press_key("i")
    assert driver.viewer.selected_robot == 1
    assert driver.viewer.selected_obstacle is None
    driver.press_key("delete")
    assert 1 not in driver.session.displayed.numbers


def test_alt_drag_copies_an_obstacle(driver: Driver) -> None:
    before = list_obstacles(driver)
    hold_keys("alt")
    driver.drag_at(PILLAR, (4.4, 2.0), (4.6, 2.9))
    hold_keys()
    after = list_obstacles(driver)
    assert after[: len(before)] == before
    assert isinstance(after[-1], CircleObstacle)
    assert after[-1].center == pytest.approx((4.6, 2.9), abs=0.05)
    assert driver.viewer.inspection.obstacle == after[-1]


def test_shift_drag_keeps_the_direction(driver: Driver) -> None:
    hold_keys("shift")
    driver.drag_at(PILLAR, (4.5, 1.25), (5.0, 1.35))
    hold_keys()
    (pillar,) = [each for each in list_obstacles(driver) if isinstance(each, CircleObstacle)]
    assert pillar.center[0] > 4.8
    assert pillar.center[1] == pytest.approx(1.2, abs=1e-6)


def test_the_menu_of_a_wall_changes_duplicates_and_deletes_it(driver: Driver) -> None:
    count = len(list_obstacles(driver))
    assert {"wider", "narrower", "duplicate", "delete"} <= set(open_menu(driver, WALL))
    choose(driver, "wider")
    (wall,) = [each for each in list_obstacles(driver) if isinstance(each, WallObstacle)]
    assert wall.width == pytest.approx(0.125)
    driver.press_key("[")
    assert driver.viewer.inspection.obstacle == list_obstacles(driver)[driver.viewer.selected_obstacle]
    open_menu(driver, WALL)
    choose(driver, "duplicate")
    assert len(list_obstacles(driver)) == count + 1
    open_menu(driver, WALL)
    choose(driver, "delete")
    assert len(list_obstacles(driver)) == count


def test_the_menu_of_a_pillar_has_no_width(driver: Driver) -> None:
    names = open_menu(driver, PILLAR)
    assert "delete" in names
    assert "wider" not in names


def test_the_menu_of_a_robot_lets_it_fail(driver: Driver) -> None:
    point = tuple(get_position(driver, 2).tolist())
    assert {"robot:fail", "robot:remove", "robot:follow"} <= set(open_menu(driver, point))
    assert driver.viewer.selected_robot == 2
    choose(driver, "robot:fail")
    assert 2 not in driver.session.displayed.numbers


def test_the_menu_of_the_floor_adds_a_robot(driver: Driver) -> None:
    count = len(driver.session.displayed.numbers)
    open_menu(driver, MIDDLE)
    choose(driver, "robot:add")
    assert len(driver.session.displayed.numbers) == count + 1
    assert get_position(driver, count + 1).tolist() == pytest.approx(MIDDLE, abs=0.05)


def test_a_right_click_still_completes_a_drawing(driver: Driver) -> None:
    count = len(list_obstacles(driver))
    driver.press_key("w")
    driver.click_at((0.5, 3.0))
    driver.click_at((1.5, 3.0))
    driver.click_at((1.5, 3.0), button=3)
    assert not driver.window.dialogs.is_open
    assert len(list_obstacles(driver)) == count + 1


def test_the_view_follows_a_robot_until_it_is_panned(driver: Driver) -> None:
    driver.viewer.robots.select(1)
    driver.press_key("shift+v")
    driver.session.place_robot(1, (3.0, 2.0))
    driver.run_frames(2)
    left, top, width, height = driver.window.layout.panes[0]
    x, y = driver.find_robot_pixel(1)
    assert abs(x - (left + width / 2)) < 0.1 * width
    assert abs(y - (top + height / 2)) < 0.1 * height
    driver.press_key("f")
    assert driver.viewer.inspection.followed is None


def test_shift_keeps_angles_of_walls_and_of_the_ruler() -> None:
    session = start_session()
    wall = AddWallTool()
    wall.press(session, build_event((0.5, 3.0)))
    wall.move(session, build_event((1.5, 3.1), shift=True))
    assert wall.build_overlay(session).line[-1] == pytest.approx((1.5, 3.0))
    ruler = RulerTool()
    ruler.press(session, build_event((0.5, 3.0)))
    ruler.move(session, build_event((1.5, 3.9), shift=True))
    assert ruler.segment.end == pytest.approx((1.45, 3.95))


def test_a_hovered_obstacle_that_was_deleted_has_no_outline() -> None:
    hand = HandTool(Inspection(cursor=PILLAR))
    session = start_session()
    hand.move(session, build_event(PILLAR))
    assert hand.build_overlay(session).hovered is not None
    hand.inspection.cursor = None
    assert hand.build_overlay(session).hovered is None
