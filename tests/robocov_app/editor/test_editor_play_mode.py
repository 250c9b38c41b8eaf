"""Trying a map in the demo, in the same window, and back with nothing lost."""

from pathlib import Path

import numpy as np
import pygame
from driven_editor import Hands, of_map, opened_editor, sheet

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle
from robocov_app.editor.edits import properties
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.ui.play_mode import build_trial_change

PILLAR = CircleObstacle((7, 7), 1.0)


def tried(hands: Hands):
    hands.key("f5")
    trial = hands.window.trial
    assert trial is not None
    return trial


def test_back_with_nothing_lost(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet(PILLAR, starts=(("s", DiscStart((2, 2), 1.0)),))) as hands:
        hands.key("r")
        hands.drag_at((4, 4), (4.5, 4.5), (5, 5))
        hands.key("v")
        hands.window.canvas.zoom(2.0, (200.0, 200.0))
        hands.window.run_frame(0.0)
        before, camera, selection = hands.sketch, hands.window.canvas.camera, hands.editor.selection
        picture = hands.picture()
        trial = tried(hands)
        assert trial.viewer.session.displayed.environment == before.build_environment()
        assert trial.viewer.session.timeline.scenario.start_name == "s"
        hands.frames(10)
        assert trial.viewer.session.displayed.time > 0.0
        hands.key("f5")
        assert hands.window.trial is None
        assert hands.sketch is before and hands.window.canvas.camera == camera
        assert hands.editor.selection == selection
        hands.editor.message = ""
        hands.window.run_frame(0.0)
        arena = np.s_[40:500, :500]
        apart = np.abs(hands.picture() - picture)[arena].max(axis=2)
        assert (apart > 40).mean() < 0.05  # but for the message, as it was
        hands.key("ctrl+z")
        assert len(hands.shapes) == 1


def test_escape_leads_back_but_first_closes_what_is_open(tmp_path: Path) -> None:
    with opened_editor(tmp_path, of_map("square")) as hands:
        trial = tried(hands)
        hands.key("f1")
        assert trial.is_help_open
        hands.key("escape")
        assert hands.window.trial is trial and not trial.is_help_open
        hands.key("w")
        hands.key("escape")
        assert hands.window.trial is trial
        hands.key("escape")
        assert hands.window.trial is None


def test_a_draft_says_why_it_cannot_be_run(tmp_path: Path) -> None:
    crossed = PolygonObstacle(((2, 2), (4, 4), (4, 2), (2, 4)))
    with opened_editor(tmp_path, sheet(crossed)) as hands:
        hands.key("f5")
        assert hands.window.trial is None and hands.editor.has_error_message and hands.said
    with opened_editor(tmp_path, Sketch(boundary=None)) as hands:
        hands.key("f5")
        assert hands.window.trial is None and hands.editor.has_error_message
    with opened_editor(tmp_path, sheet(starts=(("tight", DiscStart((5, 5), 0.11)),))) as hands:
        hands.editor.robots = 50
        hands.key("f5")
        assert hands.window.trial is None and "room for about" in hands.said


def test_what_is_drawn_while_trying_comes_along_as_one_edit(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet(PILLAR)) as hands:
        hands.editor.apply(properties.set_note(hands.sketch, Selection.of(0), "old oak"))
        trial = tried(hands)
        hands.key("c")
        x, y = trial.canvas.to_pixel((3.0, 3.0))
        to_x, _ = trial.canvas.to_pixel((3.5, 3.0))
        hands.drag((x, y), (x + 3, y), (to_x, y))
        hands.key("f5")
        assert len(hands.shapes) == 2 and hands.sketch.obstacles[0].note == "old oak"
        hands.key("ctrl+z")
        assert len(hands.shapes) == 1


def test_another_map_opened_while_trying_is_left_behind(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet(PILLAR)) as hands:
        trial = tried(hands)
        trial.viewer.attempt(lambda: trial.viewer.files.open_map("square"))
        assert trial.viewer.files.has_left_tried_map and "Untitled" in trial.viewer.files.list_maps()
        hands.key("f5")
        assert hands.shapes == [PILLAR]
        trial = tried(hands)
        trial.viewer.attempt(lambda: trial.viewer.files.open_map("rooms"))
        trial.viewer.attempt(lambda: trial.viewer.files.open_map("Untitled"))
        assert (
            not trial.viewer.files.has_left_tried_map
            and len(trial.viewer.session.displayed.environment.obstacles) == 1
        )
        hands.key("escape")


def test_closing_the_window_while_trying_asks_about_what_is_unsaved(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet()) as hands:
        hands.key("c")
        hands.drag_at((4, 4), (4.5, 4), (5, 4))
        tried(hands)
        hands.post(pygame.QUIT)
        hands.settle()
        hands.settle()
        assert hands.window.trial is None and hands.window.dialogs.is_open and not hands.window.closed
        hands.key("d")
        assert hands.window.closed


def test_light_and_dark_come_back_too(tmp_path: Path) -> None:
    with opened_editor(tmp_path, sheet()) as hands:
        tried(hands)
        hands.key("t")
        hands.key("f5")
        assert hands.editor.theme == "dark"


def test_nothing_is_brought_back_where_nothing_was_changed() -> None:
    sketch = sheet(PILLAR, PILLAR)
    environment = sketch.build_environment()
    assert build_trial_change(sketch, environment, environment) is None
    assert build_trial_change(sketch, environment, sketch.build_environment()) is None
    other = of_map("rooms").build_environment()
    assert build_trial_change(sketch, environment, other) is None


def test_a_key_that_is_held_down_while_it_opens_does_not_lead_back(tmp_path: Path) -> None:
    with opened_editor(tmp_path, of_map("square")) as hands:
        press = pygame.event.Event(pygame.KEYDOWN, key=pygame.K_F5, mod=0, unicode="")
        for _ in range(3):
            pygame.event.post(press)
        hands.frames(2)
        pygame.event.post(press)
        hands.frames(2)
        trial = hands.window.trial
        assert trial is not None and not trial.ended
        pygame.event.post(pygame.event.Event(pygame.KEYUP, key=pygame.K_F5, mod=0, unicode=""))
        pygame.event.post(press)
        pygame.event.post(press)
        hands.frames(3)
        assert hands.window.trial is None
