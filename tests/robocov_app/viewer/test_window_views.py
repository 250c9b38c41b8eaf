"""The window, used by mouse and keys: the time line and the camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from driven_window import MIDDLE, Driver, open_viewer
from sample_sessions import RAPF, RPF

from robocov_app.render.crowding import measure_spacing
from robocov_app.render.layers.robots import compute_drawn_radii
from robocov_app.viewer.tools.tool import ViewerToolOverlay

# time line


def play_steps(driver: Driver, steps: int) -> Driver:
    for _ in range(steps):
        driver.session.playback.step()
        driver.window._cost_curves.update()
    driver.run_frames(2, 0.2)
    return driver


def find_time(driver: Driver, time: float) -> tuple[float, float]:
    """Return the pixel of a time, s, on the time line."""
    _, top, _, height = driver.window.layout.time_slider
    return driver.window.chart.to_column(time), top + height / 2


def test_dragging_the_time_line_shows_the_past_and_the_present(driver: Driver) -> None:
    play_steps(driver, 120)
    driver.press(*find_time(driver, 1.0))
    assert driver.session.displayed.time == pytest.approx(1.0, abs=0.05)
    assert not driver.session.timeline.is_live
    driver.move(*find_time(driver, 0.4), held=1)
    assert driver.session.displayed.time == pytest.approx(0.4, abs=0.05)
    driver.move(*find_time(driver, 9.0), held=1)
    assert driver.session.timeline.is_live
    driver.release()
    driver.move(*find_time(driver, 0.2))
    assert driver.session.timeline.is_live


def test_branching_leaves_a_ghost_curve(driver: Driver) -> None:
    play_steps(driver, 120)
    driver.click(*find_time(driver, 0.5))
    driver.press_key("b")
    assert driver.session.timeline.is_live
    assert driver.session.playback.is_playing
    assert driver.session.timeline.end_time < 0.7
    assert len(driver.session.timeline.ghosts) == 1
    driver.run_frames(3)


def test_an_edit_in_the_past_continues_from_there(driver: Driver) -> None:
    play_steps(driver, 120)
    driver.click(*find_time(driver, 0.5))
    driver.press_key("c")
    driver.drag_at((1.0, 3.2), (1.3, 3.2))
    assert driver.session.timeline.is_live
    assert driver.session.timeline.end_time == pytest.approx(0.5, abs=0.05)
    assert [event.kind for event in driver.session.timeline.events] == ["obstacle"]


def test_events_are_marked_on_the_time_line(driver: Driver) -> None:
    play_steps(driver, 60)
    driver.move(*find_time(driver, 0.5))
    quiet = driver.copy_frame()
    driver.viewer.attempt(lambda: driver.session.fail_robot(2))
    play_steps(driver, 60)
    (event,) = driver.session.timeline.events
    assert event.time == pytest.approx(1.0)
    assert event.text == "robot 2 failed"
    assert not driver.shows_frame(quiet)
    driver.move(*find_time(driver, 1.0))
    assert driver.window.chart.hover == driver.pixel


def test_home_end_and_arrow_keys_move_through_time(driver: Driver) -> None:
    play_steps(driver, 120)
    driver.press_key("home")
    assert driver.session.displayed.time == 0.0
    driver.press_key("right")
    assert 0.0 < driver.session.displayed.time < 0.2
    driver.press_key("shift+right")
    assert driver.session.displayed.time == pytest.approx(1.0, abs=0.2)
    driver.press_key("end")
    assert driver.session.timeline.is_live


# camera


def find_cursor(driver: Driver, pane: int = 0) -> np.ndarray:
    """Return the point of the map under the cursor, (2,) m."""
    return np.array(driver.window.canvas.to_world(driver.pixel, pane))


@pytest.mark.parametrize("amount", [3, -1])
def test_zooming_keeps_the_point_under_the_cursor(amount: int, driver: Driver) -> None:
    driver.turn_wheel(200, 150, 2)
    before = find_cursor(driver)
    zoom = driver.window.canvas._painters[0].camera.zoom
    driver.turn_wheel(200, 150, amount)
    assert np.allclose(find_cursor(driver), before, atol=1e-9)
    assert (driver.window.canvas._painters[0].camera.zoom > zoom) == (amount > 0)


@pytest.mark.parametrize("button", [2, 3])
def test_other_buttons_pan_with_any_tool(button: int, driver: Driver) -> None:
    driver.press_key("p")
    before = driver.find_pixel(MIDDLE)
    driver.drag((200, 200), (230, 190), (260, 180), button=button)
    assert np.allclose(driver.find_pixel(MIDDLE), np.add(before, (60, -20)), atol=1)
    assert driver.viewer.tool.build_overlay(driver.session) == ViewerToolOverlay()


def test_panning_back_to_the_start_completes_no_drawing(driver: Driver) -> None:
    driver.press_key("p")
    for corner in ((200, 200), (260, 200), (260, 260)):
        driver.click(*corner)
    before = driver.find_pixel(MIDDLE)
    driver.drag((200, 200), (230, 190), (200, 200), button=3)
    assert np.allclose(driver.find_pixel(MIDDLE), before, atol=1)
    assert len(driver.viewer.tool.outline.points) == 3
    driver.press_key("escape", 2)


def test_fit_shows_the_whole_map_after_zooming_and_panning(driver: Driver) -> None:
    camera = driver.window.canvas._painters[0].camera
    for key in ("ctrl+=", "ctrl+=", "ctrl+left", "ctrl+up", "ctrl+-", "ctrl+right", "ctrl+down"):
        before = driver.window.canvas._painters[0].camera
        driver.press_key(key)
        assert driver.window.canvas._painters[0].camera != before, key
    driver.press_key("f")
    assert driver.window.canvas._painters[0].camera == camera


def test_panes_share_the_camera(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, RPF) as driver:
        x, y = driver.find_pixel(MIDDLE, 1)
        driver.turn_wheel(x, y, 3)
        first, second = driver.window.canvas._painters
        assert first.camera.zoom == second.camera.zoom
        assert first.camera.center == second.camera.center
        assert np.allclose(driver.window.canvas.to_world(driver.pixel, 1), MIDDLE, atol=0.02)


def test_robots_have_the_same_size_in_all_panes(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, RPF, size=(1280, 720)) as driver:
        driver.viewer.session.playback.is_playing = True
        driver.run_frames(60)
        canvas = driver.window.canvas
        radii = set()
        for pane, scene in enumerate(canvas.scenes):
            pane_canvas = canvas._build_canvas(driver.window.screen, pane, scene)
            radii |= set(compute_drawn_radii(pane_canvas, scene).tolist())
        positions = [scene.now.positions for scene in canvas.scenes]
        assert measure_spacing(positions[0]) != pytest.approx(measure_spacing(positions[1]))
        assert len(radii) == 1


def test_a_click_next_to_a_small_robot_reaches_it(tmp_path: Path) -> None:
    with open_viewer(tmp_path, robots=3, size=(1280, 720)) as driver:
        for _ in range(8):
            driver.window.run_command("zoom:out")
        driver.window.run_command("tool:failure")
        canvas = driver.window.canvas
        pane_canvas = canvas._build_canvas(driver.window.screen, 0, canvas.scenes[0])
        assert max(compute_drawn_radii(pane_canvas, canvas.scenes[0])) < 7.0
        x, y = min(driver.find_robot_pixel(number) for number in (1, 2, 3))
        driver.click(x - 11.5, y)
        assert driver.viewer.message.startswith("Robot ")
