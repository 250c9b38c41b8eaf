"""Smooth changes of the camera."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from driven_window import Driver

from robocov_app.render.camera import Camera
from robocov_app.toolkit.window.display import REDUCED_MOTION_VARIABLE, prefers_reduced_motion
from robocov_app.viewer.canvas.camera_glide import GLIDE_S, CameraGlide


def test_the_point_under_the_pointer_stays_there() -> None:
    start = Camera((2.0, 3.0), 50.0, (0.0, 0.0, 400.0, 300.0))
    end = start.zoom_at(2.5, (100.0, 40.0))
    glide = CameraGlide(start, end)
    point = start.to_world(np.array([100.0, 40.0]))
    zooms = []
    for _ in range(6):
        camera = glide.advance(GLIDE_S / 6)
        assert camera.to_pixels(point) == pytest.approx([100.0, 40.0])
        zooms.append(camera.zoom)
    assert glide.is_over
    assert zooms == sorted(zooms)
    assert zooms[-1] == end.zoom


def test_the_zoom_may_differ_by_a_rounding_error() -> None:
    start = Camera((2.0, 3.0), 63.0, (0.0, 0.0, 400.0, 300.0))
    end = replace(start, center=(4.0, 3.0), zoom=math.nextafter(63.0, 64.0))
    assert 1.0 / end.zoom == 1.0 / start.zoom
    camera = CameraGlide(start, end).advance(GLIDE_S / 2)
    assert 2.0 < camera.center[0] < 4.0
    assert camera.center[1] == 3.0


def test_the_map_glides_to_the_zoom_and_back(driver: Driver) -> None:
    canvas = driver.window.canvas
    whole = canvas.to_pixel((1.0, 1.0))
    canvas.camera.is_animated = True
    driver.window.run_command("zoom:in")
    assert canvas.to_pixel((1.0, 1.0)) == pytest.approx(whole)
    assert driver.window.build_frame_key() is None
    driver.run_frames(1)
    between = canvas.to_pixel((1.0, 1.0))
    driver.run_frames(15)
    assert not canvas.camera.is_moving
    zoomed = canvas.to_pixel((1.0, 1.0))
    assert len({whole, between, zoomed}) == 3
    driver.window.run_command("fit")
    driver.run_frames(15)
    assert canvas.to_pixel((1.0, 1.0)) == pytest.approx(whole)


def test_quick_turns_of_the_wheel_add_up(driver: Driver) -> None:
    canvas = driver.window.canvas
    for _ in range(3):
        driver.window.run_command("zoom:in")
    zoomed = canvas.to_pixel((1.0, 1.0))
    driver.window.run_command("fit")
    canvas.camera.is_animated = True
    for _ in range(3):
        driver.window.run_command("zoom:in")
        driver.run_frames(1)
    driver.run_frames(15)
    assert canvas.to_pixel((1.0, 1.0)) == pytest.approx(zoomed)


def test_motion_can_be_switched_off(driver: Driver) -> None:
    canvas = driver.window.canvas
    canvas.camera.is_animated = True
    driver.window.run_command("motion")
    driver.window.run_command("zoom:in")
    assert not canvas.camera.is_moving


def test_reduced_motion_of_the_system_is_respected(driver: Driver) -> None:
    canvas = driver.window.canvas
    canvas.camera.is_animated = True
    driver.viewer.view.is_motion_reduced = True
    driver.window.run_command("zoom:in")
    assert not canvas.camera.is_moving
    for _ in range(2):
        driver.window.run_command("motion")
    assert driver.viewer.message == "Zooming is instant, because the system asks for reduced motion"
    driver.viewer.view.is_motion_reduced = False
    driver.window.run_command("zoom:in")
    assert canvas.camera.is_moving


@pytest.mark.parametrize(("value", "is_reduced"), [("1", True), ("0", False), ("", False)])
def test_a_variable_asks_for_reduced_motion(
    value: str, is_reduced: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(REDUCED_MOTION_VARIABLE, value)
    assert prefers_reduced_motion() == is_reduced
