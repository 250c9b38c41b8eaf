"""Trying a map in the demo in the same window, and returning without losing anything."""

from pathlib import Path

import numpy as np
import pygame
from driven_editor import EditorDriver, build_sheet, load_sketch, open_editor

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle
from robocov_app.editor.edits import properties
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.ui.play_mode.map_changes import build_play_change
from robocov_app.editor.ui.play_mode.window import BACK_COMMAND

PILLAR = CircleObstacle((7, 7), 1.0)


def start_trial(driver: EditorDriver):
    driver.press_key("f5")
    trial = driver.window.play_mode.window
    assert trial is not None
    return trial


def test_returning_from_a_trial_loses_nothing(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(PILLAR, starts=(("s", DiscStart((2, 2), 1.0)),))) as driver:
        driver.press_key("r")
        driver.drag_at((4, 4), (4.5, 4.5), (5, 5))
        driver.press_key("v")
        driver.window.canvas.zoom(2.0, (200.0, 200.0))
        driver.window.run_frame(0.0)
        before = driver.sketch
        camera = driver.window.canvas.camera
        selection = driver.editor.selection
        picture = driver.copy_frame()
        trial = start_trial(driver)
        assert trial.viewer.session.displayed.environment == before.build_environment()
        assert trial.viewer.session.timeline.scenario.start_name == "s"
        driver.run_frames(10)
        assert trial.viewer.session.displayed.time > 0.0
        driver.press_key("f5")
        assert driver.window.play_mode.window is None
        assert driver.sketch is before and driver.window.canvas.camera == camera
        assert driver.editor.selection == selection
        driver.editor.message = ""
        driver.window.run_frame(0.0)
        arena = np.s_[40:500, :500]
        differences = np.abs(driver.copy_frame() - picture)[arena].max(axis=2)
        assert (differences > 40).mean() < 0.05  # only the message differs
        driver.press_key("ctrl+z")
        assert len(driver.shapes) == 1


def test_escape_closes_dialogs_before_it_leads_back(tmp_path: Path) -> None:
    with open_editor(tmp_path, load_sketch("square")) as driver:
        trial = start_trial(driver)
        driver.press_key("f1")
        assert trial.help_page.is_open
        driver.press_key("escape")
        assert driver.window.play_mode.window is trial and not trial.help_page.is_open
        driver.press_key("w")
        driver.press_key("escape")
        assert driver.window.play_mode.window is trial
        driver.press_key("escape")
        assert driver.window.play_mode.window is None


def test_a_draft_says_why_it_cannot_be_run(tmp_path: Path) -> None:
    crossed = PolygonObstacle(((2, 2), (4, 4), (4, 2), (2, 4)))
    with open_editor(tmp_path, build_sheet(crossed)) as driver:
        driver.press_key("f5")
        assert driver.window.play_mode.window is None and driver.editor.has_error_message and driver.message
    with open_editor(tmp_path, Sketch(boundary=None)) as driver:
        driver.press_key("f5")
        assert driver.window.play_mode.window is None and driver.editor.has_error_message
    with open_editor(tmp_path, build_sheet(starts=(("tight", DiscStart((5, 5), 0.11)),))) as driver:
        driver.editor.robots = 50
        driver.press_key("f5")
        assert driver.window.play_mode.window is None and "space for about" in driver.message


def test_changes_of_a_trial_are_one_edit(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(PILLAR)) as driver:
        driver.editor.apply(properties.set_note(driver.sketch, Selection.of(0), "old oak"))
        trial = start_trial(driver)
        driver.press_key("c")
        x, y = trial.canvas.to_pixel((3.0, 3.0))
        to_x, _ = trial.canvas.to_pixel((3.5, 3.0))
        driver.drag((x, y), (x + 3, y), (to_x, y))
        driver.press_key("f5")
        assert len(driver.shapes) == 2 and driver.sketch.obstacles[0].note == "old oak"
        driver.press_key("ctrl+z")
        assert len(driver.shapes) == 1


def test_another_map_opened_in_a_trial_is_discarded(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet(PILLAR)) as driver:
        trial = start_trial(driver)
        trial.viewer.attempt(lambda: trial.viewer.files.open_map("square"))
        assert trial.viewer.files.has_left_edited_map and "Untitled" in trial.viewer.files.list_maps()
        driver.press_key("f5")
        assert driver.shapes == [PILLAR]
        trial = start_trial(driver)
        trial.viewer.attempt(lambda: trial.viewer.files.open_map("rooms"))
        trial.viewer.attempt(lambda: trial.viewer.files.open_map("Untitled"))
        assert (
            not trial.viewer.files.has_left_edited_map
            and len(trial.viewer.session.displayed.environment.obstacles) == 1
        )
        driver.press_key("escape")


def test_closing_the_window_in_a_trial_asks_about_unsaved_changes(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet()) as driver:
        driver.press_key("c")
        driver.drag_at((4, 4), (4.5, 4), (5, 4))
        start_trial(driver)
        driver.post(pygame.QUIT)
        driver.settle()
        driver.settle()
        assert (
            driver.window.play_mode.window is None
            and driver.window.dialogs.is_open
            and not driver.window.closed
        )
        driver.press_key("d")
        assert driver.window.closed


def test_a_button_leads_back_to_the_editor(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet()) as driver:
        trial = start_trial(driver)
        driver.run_frames(2)
        button = trial.top_bar.ui.find("button", BACK_COMMAND)
        assert button is not None
        assert "F5" in trial.commands[BACK_COMMAND].tip
        driver.click(*button.rect.center)
        assert driver.window.play_mode.window is None


def test_the_theme_returns_to_the_editor(tmp_path: Path) -> None:
    with open_editor(tmp_path, build_sheet()) as driver:
        start_trial(driver)
        driver.press_key("t")
        driver.press_key("f5")
        assert driver.editor.theme == "dark"


def test_a_trial_without_changes_is_not_an_edit() -> None:
    sketch = build_sheet(PILLAR, PILLAR)
    environment = sketch.build_environment()
    assert build_play_change(sketch, environment, environment) is None
    assert build_play_change(sketch, environment, sketch.build_environment()) is None
    other = load_sketch("rooms").build_environment()
    assert build_play_change(sketch, environment, other) is None


def test_a_held_key_does_not_end_the_trial(tmp_path: Path) -> None:
    with open_editor(tmp_path, load_sketch("square")) as driver:
        press = pygame.event.Event(pygame.KEYDOWN, key=pygame.K_F5, mod=0, unicode="")
        for _ in range(3):
            pygame.event.post(press)
        driver.run_frames(2)
        pygame.event.post(press)
        driver.run_frames(2)
        trial = driver.window.play_mode.window
        assert trial is not None and not trial.returns_to_editor
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=pygame.K_F5, mod=0, unicode=""))
        pygame.event.post(press)
        pygame.event.post(press)
        driver.run_frames(3)
        assert driver.window.play_mode.window is None
