"""The hand as a select tool: outlines, Shift and Alt, context menus, Delete, and following a robot."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import pygame
import pytest
from driven_window import MIDDLE, MODIFIERS, Driver, get_position
from pointer_events import build_event
from sample_sessions import advance_session, start_session

from robocov.environment import CircleObstacle, Obstacle, PolygonObstacle, WallObstacle
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.tools.hand import HandTool
from robocov_app.viewer.tools.handles import drag_handle, find_handle, list_handles
from robocov_app.viewer.tools.obstacle_drags import add_obstacles, exchange_obstacles
from robocov_app.viewer.tools.outlines import AddWallTool
from robocov_app.viewer.tools.segments import RulerTool

ObstacleT = TypeVar("ObstacleT", bound=Obstacle)

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
    assert isinstance(driver.viewer.selected_obstacles[0], CircleObstacle)
    assert len(list_obstacles(driver)) == count
    driver.press_key("escape")
    assert driver.viewer.selected_obstacles == ()
    driver.click_at(PILLAR)
    driver.press_key("delete")
    assert len(list_obstacles(driver)) == count - 1
    driver.press_key("ctrl+z")
    assert len(list_obstacles(driver)) == count


def test_delete_removes_the_selected_robot(driver: Driver) -> None:
    driver.click_at(PILLAR)
    driver.press_key("i")
    assert driver.viewer.selected_robot == 1
    assert driver.viewer.selected_obstacles == ()
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
    assert driver.viewer.selected_obstacles == (after[-1],)


def test_of_equal_obstacles_only_one_is_changed() -> None:
    session = start_session()
    obstacles = session.displayed.environment.obstacles
    pillar = next(obstacle for obstacle in obstacles if isinstance(obstacle, CircleObstacle))
    add_obstacles(session, (pillar,), "pillar copied")
    moved = replace(pillar, center=(4.6, 2.9))
    exchange_obstacles(session, (pillar,), (moved,), "pillar moved")
    assert session.displayed.environment.obstacles.count(pillar) == 1
    assert session.displayed.environment.obstacles.count(moved) == 1
    add_obstacles(session, (pillar,), "pillar copied")
    exchange_obstacles(session, (pillar,), (), "pillar deleted")
    assert session.displayed.environment.obstacles.count(pillar) == 1
    exchange_obstacles(session, (pillar, moved), (moved, pillar), "both moved")
    assert session.displayed.environment.obstacles.count(pillar) == 1
    assert session.displayed.environment.obstacles.count(moved) == 1


def test_shift_drag_keeps_the_direction(driver: Driver) -> None:
    hold_keys("shift")
    driver.drag_at(PILLAR, (4.5, 1.25), (5.0, 1.35))
    hold_keys()
    (pillar,) = [obstacle for obstacle in list_obstacles(driver) if isinstance(obstacle, CircleObstacle)]
    assert pillar.center[0] > 4.8
    assert pillar.center[1] == pytest.approx(1.2, abs=1e-6)


def list_titles(driver: Driver) -> list[str]:
    """Return the titles in the open menu."""
    return [row.title for row in driver.window.dialogs.current.rows if row is not None]


def test_the_menu_of_a_wall_changes_duplicates_and_deletes_it(driver: Driver) -> None:
    count = len(list_obstacles(driver))
    assert {"wider", "narrower", "duplicate", "delete"} <= set(open_menu(driver, WALL))
    choose(driver, "wider")
    (wall,) = [obstacle for obstacle in list_obstacles(driver) if isinstance(obstacle, WallObstacle)]
    assert wall.width == pytest.approx(0.125)
    driver.press_key("[")
    assert len(driver.viewer.selected_obstacles) == 1
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
    assert list_titles(driver)[0] == "Fail"
    choose(driver, "robot:fail")
    assert 2 not in driver.session.displayed.numbers
    open_menu(driver, point)
    assert list_titles(driver)[0] == "Revive"
    choose(driver, "robot:fail")
    assert 2 in driver.session.displayed.numbers


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


def find_obstacle(driver: Driver, kind: type[ObstacleT]) -> ObstacleT:
    """Return the only obstacle of a kind."""
    (match,) = [obstacle for obstacle in list_obstacles(driver) if isinstance(obstacle, kind)]
    return match


def test_the_rim_of_a_selected_circle_is_dragged(driver: Driver) -> None:
    pillar = find_obstacle(driver, CircleObstacle)
    x, y = pillar.center
    driver.click_at(pillar.center)
    driver.drag_at((x + pillar.radius, y), (x + pillar.radius + 0.1, y), (x + 0.8, y))
    changed = find_obstacle(driver, CircleObstacle)
    assert changed.center == pillar.center
    assert changed.radius == pytest.approx(0.8, abs=0.03)
    assert driver.viewer.selected_obstacles == (changed,)
    driver.press_key("ctrl+z")
    assert find_obstacle(driver, CircleObstacle) == pillar


def test_the_end_of_a_selected_wall_is_dragged_and_snaps(driver: Driver) -> None:
    wall = find_obstacle(driver, WallObstacle)
    first, last = wall.points
    driver.click_at(WALL)
    driver.drag_at(last, (last[0], 1.0), (last[0] + 0.02, 0.03))
    changed = find_obstacle(driver, WallObstacle)
    assert changed.points[0] == first
    assert changed.points[-1] == pytest.approx((last[0] + 0.02, 0.0), abs=0.01)
    assert changed.width == wall.width


def test_a_polygon_is_resized_by_its_frame() -> None:
    polygon = PolygonObstacle(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)))
    reach = 0.2
    handles = [handle for handle in list_handles(polygon, reach) if handle.kind == "corner"]
    (corner,) = [handle for handle in handles if min(handle.position) > 1.0]
    x, y = corner.position
    larger = drag_handle(polygon, corner, (x + 2.0, y + 0.5))
    assert larger.vertices == ((0.0, 0.0), (4.0, 0.0), (4.0, 1.5), (0.0, 1.5))
    similar = drag_handle(polygon, corner, (x + 2.0, y + 0.5), shift=True)
    assert similar.vertices == ((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0))
    centered = drag_handle(polygon, corner, (x + 1.0, y), alt=True)
    assert centered.vertices == ((-1.0, 0.0), (3.0, 0.0), (3.0, 1.0), (-1.0, 1.0))
    inverted = drag_handle(polygon, corner, (x - 9.0, y))
    assert inverted.polygon.area > 0.0


def test_points_of_a_polygon_are_dragged() -> None:
    polygon = PolygonObstacle(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0)))
    handle = find_handle(polygon, (2.01, 1.0), 0.05)
    assert handle is not None
    assert drag_handle(polygon, handle, (2.2, 1.5)).vertices[2] == (2.2, 1.5)
    assert drag_handle(polygon, handle, (2.1, 1.5), shift=True).vertices[2] == (2.0, 1.5)


def test_obstacles_in_a_box_are_moved_by_the_arrow_keys_and_deleted(driver: Driver) -> None:
    pillar = find_obstacle(driver, CircleObstacle)
    x, y = pillar.center
    hold_keys("shift")
    driver.drag_at((x - 0.6, y - 0.6), (x, y), (x + 0.6, y + 0.6))
    hold_keys()
    assert driver.viewer.selected_obstacles == (pillar,)
    driver.press_key("right")
    driver.press_key("shift+up")
    moved = find_obstacle(driver, CircleObstacle)
    assert (moved.center[0] - x, moved.center[1] - y) == pytest.approx((0.05, 0.5))
    assert driver.viewer.selected_obstacles == (moved,)
    driver.press_key("delete")
    assert [type(obstacle) for obstacle in list_obstacles(driver)] == [WallObstacle]


def test_a_box_dragged_to_the_left_selects_what_it_touches(driver: Driver) -> None:
    pillar = find_obstacle(driver, CircleObstacle)
    x, y = pillar.center
    hold_keys("shift")
    driver.drag_at((x + 0.9, y + 0.9), (x + 0.5, y + 0.3), (x, y))
    assert driver.viewer.selected_obstacles == (pillar,)
    driver.click_at(WALL)
    assert set(driver.viewer.selected_obstacles) == set(list_obstacles(driver))
    driver.click_at(WALL)
    assert driver.viewer.selected_obstacles == (pillar,)
    hold_keys()


def test_selected_obstacles_are_dragged_together(driver: Driver) -> None:
    before = list_obstacles(driver)
    driver.viewer.inspection.select_obstacles(before)
    driver.drag_at(PILLAR, (4.0, 1.25), (4.0, 1.3))
    assert all(changed != old for changed, old in zip(list_obstacles(driver), before, strict=True))


def test_arrow_keys_move_through_time_without_a_selection(driver: Driver) -> None:
    advance_session(driver.session, 5)
    driver.press_key("left")
    assert not driver.session.timeline.is_live


def test_a_hovered_obstacle_that_was_deleted_has_no_outline() -> None:
    hand = HandTool(Inspection(cursor=PILLAR))
    session = start_session()
    hand.move(session, build_event(PILLAR))
    assert hand.build_overlay(session).hovered is not None
    hand.inspection.cursor = None
    assert hand.build_overlay(session).hovered is None
