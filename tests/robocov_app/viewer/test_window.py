"""The window, used by mouse and keys without a display: playback, files, help, palette, sizes, lesson."""

from __future__ import annotations

import json
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pygame
import pytest
from driven_window import FRAME_S, Driver, open_viewer, resize_window
from PIL import Image
from sample_sessions import RAPF, start_session

from robocov_app.storage.settings import FOLDER_VARIABLE
from robocov_app.toolkit.commands.palette import list_options
from robocov_app.viewer.launch import ViewerLauncher
from robocov_app.viewer.window.status import describe_cursor

# title


def test_the_title_names_the_map_and_then_the_file(driver: Driver) -> None:
    assert pygame.display.get_caption()[0] == "hall • robocov"
    driver.viewer.files.save_session(driver.viewer.files.folder / "session.robocov")
    driver.run_frames(1)
    assert pygame.display.get_caption()[0] == "session.robocov • robocov"
    driver.viewer.attempt(lambda: driver.session.fail_robot(1))
    driver.run_frames(1)
    assert pygame.display.get_caption()[0] == "● session.robocov • robocov"


# playing


def test_space_plays_and_pauses(driver: Driver) -> None:
    driver.press_key("space")
    driver.run_frames(10)
    assert driver.session.displayed.time == pytest.approx(10 * FRAME_S, abs=0.02)
    driver.press_key("space")
    driver.run_frames(5)
    assert driver.session.displayed.time == pytest.approx(10 * FRAME_S, abs=0.02)


def test_buttons_play_step_settle_and_restart(driver: Driver) -> None:
    driver.push_button("pause")
    assert driver.session.playback.is_playing
    assert driver.get_widget("button", "pause").text == "Pause"
    driver.run_frames(5)
    driver.push_button("pause")
    assert not driver.session.playback.is_playing
    assert driver.get_widget("button", "pause").text == "Play"
    end = driver.session.timeline.end_time
    driver.push_button("step")
    assert driver.session.timeline.end_time == pytest.approx(end + driver.session.timeline.scenario.dt)
    driver.push_button("settle")
    assert driver.session.playback.stop_when_settled
    assert driver.get_widget("button", "settle").value
    driver.push_button("restart")
    assert driver.session.timeline.end_time < 0.1


def test_playback_stops_when_the_team_has_settled(tmp_path: Path) -> None:
    with open_viewer(tmp_path, robots=1) as driver:
        driver.press_key("s")
        for _ in range(2000):
            driver.window.advance(0.1)
            if not driver.session.playback.is_playing:
                break
        assert driver.session.timeline.is_settled
        assert driver.viewer.message.startswith("Settled at ")


def test_the_speed_multiplies_the_simulated_time(driver: Driver) -> None:
    driver.press_key("=")
    driver.press_key("space")
    driver.run_frames(10)
    assert driver.session.displayed.time == pytest.approx(2 * 10 * FRAME_S, abs=0.03)


# status line, cursor, files


def test_the_status_line_describes_the_point_under_the_cursor(tmp_path: Path) -> None:
    with open_viewer(tmp_path, lattice=48) as driver:
        driver.run_frames(3)
        driver.move(*driver.find_robot_pixel(2))
        assert "robot 2" in describe_cursor(driver.viewer)
        driver.move(*driver.find_pixel((4.2, 1.2)))
        assert "inside an obstacle" in describe_cursor(driver.viewer)
        driver.post(pygame.WINDOWLEAVE)
        driver.settle()
        assert describe_cursor(driver.viewer) == ""


def test_the_cursor_is_an_arrow_over_the_panel(driver: Driver) -> None:
    driver.press_key("w")
    driver.move(*driver.find_pixel((4.2, 1.2)))
    driver.run_frames(1)
    assert driver.window.cursor.shape == pygame.SYSTEM_CURSOR_CROSSHAIR
    left, top, wide, high = driver.window.layout.panel
    driver.move(left + wide / 2, top + high - 5)
    driver.run_frames(1)
    assert driver.window.cursor.shape == pygame.SYSTEM_CURSOR_ARROW


def test_a_screenshot_contains_the_window(driver: Driver, tmp_path: Path) -> None:
    picture = driver.copy_frame()
    driver.press_key("f12")
    with Image.open(tmp_path / "robocov-1.png") as saved:
        assert np.array_equal(np.asarray(saved.convert("RGB")).astype(int), picture)
    driver.open_tab("file")
    driver.push_button("screenshot")
    assert (tmp_path / "robocov-2.png").exists()


@pytest.mark.slow
def test_a_run_is_saved_in_the_background(driver: Driver, tmp_path: Path) -> None:
    for _ in range(30):
        driver.session.playback.step()
    driver.press_key("ctrl+e")
    driver.window.run_saver.finish()
    driver.run_frames(2)
    assert not driver.viewer.has_error_message
    assert "saved" in driver.viewer.message
    (record,) = tmp_path.rglob("record.npz")
    assert record.parent != tmp_path


@pytest.mark.slow
def test_a_video_lasts_as_long_as_the_recording(driver: Driver, tmp_path: Path) -> None:
    driver.press_key("space")
    driver.press_key("f9")
    assert driver.viewer.view.is_recording
    driver.run_frames(60)
    resize_window(driver, (1000, 640))
    driver.run_frames(15)
    driver.press_key("f9")
    path = tmp_path / "robocov-1.mp4"
    assert driver.viewer.message.startswith(f"Video saved: {path}")
    assert not driver.viewer.view.is_recording
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert seconds == pytest.approx(75 * FRAME_S, abs=0.15)
    assert count == pytest.approx(45, abs=4)
    assert next(imageio_ffmpeg.read_frames(str(path)))["size"] == (900, 600)


@pytest.mark.parametrize(
    ("count", "text"), [(0, "s)"), (1, "s, 1 frame skipped)"), (2, "s, 2 frames skipped)")]
)
def test_the_number_of_skipped_frames_of_a_video_is_reported(driver: Driver, count: int, text: str) -> None:
    driver.press_key("f9")
    driver.run_frames(3)
    assert driver.window.video_recorder.video is not None
    driver.window.video_recorder.video.skipped_count = count
    driver.press_key("f9")
    assert driver.viewer.message.endswith(text)


def test_closing_the_window_completes_the_video(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.press_key("f9")
        driver.run_frames(10)
        driver.post(pygame.QUIT)
        driver.settle()
        assert driver.window.closed
    assert imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "robocov-1.mp4"))[0] > 0


def test_an_invalid_folder_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with open_viewer(tmp_path / "file") as driver:
        for key in ("f12", "f9", "ctrl+s"):
            driver.viewer.has_error_message = False
            driver.press_key(key)
            assert driver.viewer.has_error_message
            assert driver.viewer.message, key
        assert driver.window.video_recorder.video is None
        assert not driver.viewer.view.is_recording


def test_playing_removes_the_hint_to_play(driver: Driver) -> None:
    driver.viewer.show_message("It is paused: press Space or Play to continue.")
    driver.press_key("space")
    assert driver.viewer.message == ""


# help, palette, theme, size


@pytest.mark.parametrize("key", ["f1", "shift+/"])
def test_the_help_page_closes_by_key_or_click(key: str, driver: Driver) -> None:
    plain = driver.copy_frame()
    driver.press_key(key)
    assert driver.window.help_page.is_open
    assert not driver.shows_frame(plain)
    driver.press_key("escape")
    assert not driver.window.help_page.is_open
    driver.press_key(key)
    driver.click(300, 300)
    assert not driver.window.help_page.is_open
    assert driver.viewer.selected_robot is None


def test_the_scale_follows_the_size_of_the_window(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pygame.display, "get_desktop_sizes", lambda: [(1920, 1080)])
    with open_viewer(tmp_path, size=(1280, 720), scale=None) as driver:
        assert driver.window.layout.scale == 1.0
        resize_window(driver, (2560, 1440))
        assert driver.window.layout.scale == 1.5
        resize_window(driver, (1280, 720))
        assert driver.window.layout.scale == 1.0


@pytest.mark.parametrize("key", ["/", "ctrl+k"])
def test_commands_are_found_by_their_names(key: str, driver: Driver) -> None:
    driver.press_key(key)
    dialogs = driver.window.dialogs
    assert dialogs.is_open
    assert dialogs.current.text == ""
    driver.type("single")
    assert [option.text for option in dialogs.current.options("single")] == ["Single step"]
    driver.press_key("return")
    assert driver.session.timeline.end_time > 0.0
    assert not dialogs.is_open


def test_the_palette_says_whether_a_video_would_start_or_stop(driver: Driver) -> None:
    command = driver.window.commands["video"]

    def list_video_titles() -> list[str]:
        return [option.text for option in list_options(driver.window.commands, "video")]

    assert "Start recording a video" in list_video_titles()
    driver.window.run_command("video")
    assert command.current_title == "Stop recording the video"
    assert "Stop recording the video" in list_video_titles()
    assert "Start recording a video" not in list_video_titles()
    driver.window.run_command("video")
    assert command.current_title == "Start recording a video"


def test_the_palette_is_navigated_by_keys(driver: Driver) -> None:
    driver.press_key("ctrl+k")
    driver.type("rob")
    palette = driver.window.dialogs.current
    driver.press_key("down", 2)
    driver.press_key("up")
    assert palette.highlighted == 1
    driver.press_key("backspace")
    assert palette.text == "ro"
    assert palette.highlighted == 0
    driver.press_key("down", 30)
    assert palette.highlighted == len(palette.options("ro")) - 1
    driver.press_key("escape")
    assert not driver.window.dialogs.is_open
    assert driver.session.timeline.end_time == 0.0


def test_values_are_set_in_the_palette(driver: Driver) -> None:
    driver.press_key("ctrl+k")
    driver.type("k_rep 0.5")
    driver.press_key("return")
    assert driver.session.timeline.panes[0].controller.get_value("k_rep") == 0.5
    driver.press_key("ctrl+k")
    driver.type("robots 5")
    driver.press_key("enter")
    assert len(driver.session.displayed.numbers) == 5
    driver.press_key("ctrl+k")
    driver.type("robots many")
    driver.press_key("return")
    palette = driver.window.dialogs.current
    assert palette.text == "robots many"
    assert "whole number" in palette.error


def test_held_keys_repeat_steps_but_not_screenshots(driver: Driver, tmp_path: Path) -> None:
    for code, name in ((pygame.K_F12, ""), (pygame.K_PERIOD, ".")):
        for _ in range(5):
            driver.post(pygame.KEYDOWN, key=code, mod=0, unicode=name, scancode=0)
        driver.settle()
        driver.post(pygame.KEYUP, key=code, mod=0, unicode=name, scancode=0)
    driver.settle()
    assert [path.name for path in tmp_path.iterdir()] == ["robocov-1.png"]
    assert driver.session.timeline.end_time == pytest.approx(5 / 60)
    driver.press_key("f12")
    assert (tmp_path / "robocov-2.png").exists()


def test_the_theme_changes_all_parts_of_the_window(driver: Driver) -> None:
    light = driver.copy_frame()
    driver.press_key("t")
    driver.run_frames(3, 0.3)
    dark = driver.copy_frame()
    for part in (slice(0, 500), slice(600, 900)):
        assert light[:, part].mean() > 190
        assert dark[:, part].mean() < 90
    driver.press_key("t")
    driver.run_frames(3, 0.3)
    assert driver.copy_frame().mean() > 190


@pytest.mark.parametrize(
    ("size", "panes"), [((900, 600), 1), ((1500, 700), 3), ((3840, 2160), 3), ((640, 480), 1)]
)
def test_windows_of_any_size_can_be_used(size: tuple[int, int], panes: int, tmp_path: Path) -> None:
    with open_viewer(
        tmp_path, *([RAPF] * panes), size=(1280, 720), scale=2.0 if size[0] > 3000 else 1.0
    ) as driver:
        resize_window(driver, size)
        assert driver.window.layout.size == size
        driver.press_key("space")
        driver.run_frames(2)
        driver.push_button("pause")
        assert not driver.session.playback.is_playing
        driver.open_tab("file")
        driver.click(*driver.find_robot_pixel(1))
        assert driver.viewer.selected_robot == 1
        if size[0] >= 900:
            driver.open_tab("parameters")
            driver.type_into("k_rep", "1")
            driver.press_key("return")
            driver.push_button("reset:k_rep")


def test_long_pages_scroll_by_wheel_and_bar(driver: Driver) -> None:
    driver.window.draw()
    assert driver.find_rect("entry", "team.radius").height == 0  # out of sight
    for _ in range(12):
        driver.turn_wheel(740, 500, -3)
    driver.type_into("team.radius", "0.12")
    driver.press_key("return")
    assert driver.session.timeline.panes[0].setup.properties.radius == 0.12
    bar = driver.get_widget("bar", "parameters:rapf").rect
    driver.drag(bar.center, (bar.centerx, bar.centery - 200))
    driver.window.draw()
    assert driver.find_rect("entry", "team.radius").height == 0
    camera = driver.window.canvas._painters[0].camera
    driver.turn_wheel(740, 500, -3)
    assert driver.window.canvas._painters[0].camera == camera


# lesson


def test_the_lesson_ends_by_a_key(driver: Driver) -> None:
    shown = set(driver.viewer.view.layers)
    driver.press_key("f2")
    assert driver.window.lesson.player is not None
    assert driver.viewer.session.playback.is_playing
    driver.run_frames(5)
    driver.press_key("f12")
    driver.press_key("t")
    assert driver.window.lesson.player is not None
    driver.press_key("escape")
    assert driver.window.lesson.player is None
    assert driver.viewer.view.layers == shown
    assert driver.viewer.session is driver.session
    assert driver.viewer.message == "The lesson has ended; F2 plays it again"


def test_the_lesson_pauses_when_the_arena_is_clicked(driver: Driver) -> None:
    driver.press_key("f2")
    driver.run_frames(3)
    driver.click(*driver.window.layout.arena.size)
    driver.click(200, 200)
    assert driver.window.lesson.player is not None
    assert driver.window.lesson.player.state == "left"
    driver.press_key("f2")
    assert driver.window.lesson.player.state == "playing"


# settings


def test_settings_are_saved_and_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")

    (tmp_path / "settings").mkdir()
    (tmp_path / "settings/window.json").write_text('{"width": 1000, "height": 640}')

    def open_window():
        return ViewerLauncher(start_session(), "hall", tmp_path, lattice=4).window()

    with open_window() as first:
        driver = Driver(first)
        driver.press_key("t")
        driver.press_key("shift+t")
        driver.open_tab("show")
        driver.toggle_check_box("cells")
        first.close()
    settings = json.loads((tmp_path / "settings/window.json").read_text())
    assert settings["theme"] == "dark"
    assert settings["fade"]
    assert settings["tab"] == "show"
    assert "cells" not in settings["shown"]
    assert (settings["width"], settings["height"]) == (1000, 640)
    with open_window() as second:
        assert second.screen.get_size() == (1000, 640)
        assert second.viewer.view.theme == "dark"
        assert second.viewer.view.fades_trajectories
        assert second.panel.tab == "show"
        assert "cells" not in second.viewer.view.layers
        assert "robots" in second.viewer.view.layers
        second.close()
