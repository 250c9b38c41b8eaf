"""Random events for both windows, which must neither raise exceptions nor become unusable."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_editor import EditorDriver, open_editor
from driven_window import Driver, open_viewer
from random_events import RandomEvents

from robocov.environment import Environment
from robocov_app.editor.edits.create import add_circle
from robocov_app.editor.model.history import UndoHistory
from robocov_app.toolkit.window.exceptions import ExceptionLog
from robocov_app.toolkit.window.page_view import PageAppearance
from robocov_app.toolkit.window.window import BaseWindow
from robocov_app.viewer.costs.costs import Costs

N_EVENTS = 2_000
N_EVENTS_IN_FAST_TESTS = 150
SEED = 1


@pytest.fixture(autouse=True)
def _change_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Change to a temporary folder, since random events also save maps to relative paths."""
    monkeypatch.chdir(tmp_path)


def contain_exceptions(window: BaseWindow, folder: Path) -> ExceptionLog:
    """Let a window continue after exceptions, so that one run finds all of them, and return their log."""
    window.guard.is_enabled = True
    window.guard.log = ExceptionLog(folder / "exceptions")
    return window.guard.log


def assert_no_exceptions(log: ExceptionLog) -> None:
    assert log.file is not None
    assert log.count == 0, log.file.read_text()


def play_editor(folder: Path, seed: int, n_events: int) -> ExceptionLog:
    """Send random events to an editor, check that a circle can be added and removed, and return the log."""
    with open_editor(folder, drafts=folder / "drafts") as driver:
        log = contain_exceptions(driver.window, folder)
        random_events = RandomEvents(driver.window, folder / "odd", seed)

        def stay_open() -> None:
            driver.window.file_commands.may_close = False

        random_events.play(n_events, stay_open)
        restore_window(driver)
        history: UndoHistory = driver.editor.document.history
        sketch = history.sketch
        driver.editor.apply(add_circle(history.sketch, (1.0, 1.0), 0.25))
        driver.press_key("ctrl+z")
        assert history.sketch == sketch
    return log


class CostsOfSmallMaps(Costs):
    """Costs of maps with few obstacles. Larger maps would take long, and are tested elsewhere."""

    def set_environment(self, environment: Environment, radius: float) -> None:
        if len(environment.obstacles) < 10:
            super().set_environment(environment, radius)
        else:
            self.forget()
            self._map_request = None


def play_viewer(folder: Path, seed: int, n_events: int) -> ExceptionLog:
    """Send random events to a viewer, check that the palette can be opened, and return the log."""
    with pytest.MonkeyPatch.context() as patch, ExitStack() as stack:
        patch.setattr("driven_window.Costs", CostsOfSmallMaps)
        driver = stack.enter_context(open_viewer(folder, lattice=4, robots=2))
        log = contain_exceptions(driver.window, folder)
        random_events = RandomEvents(driver.window, folder / "odd", seed)

        def keep_small() -> None:
            session = driver.session
            viewer = driver.viewer
            displayed = session.displayed
            has_many_robots = max(len(displayed.numbers), session.timeline.scenario.robots) > 6
            has_many_obstacles = len(displayed.environment.obstacles) > 20
            if has_many_robots or has_many_obstacles:
                viewer.attempt(lambda: viewer.files.open_map("square"))
                viewer.attempt(lambda: viewer.playback.restart(robots=2))

        random_events.play(n_events, keep_small)
        restore_window(driver)
        for pane in driver.session.timeline.panes:
            assert np.isfinite(pane.simulation.positions).all()
        driver.press_key("ctrl+k")
        assert driver.window.dialogs.is_open
    return log


def restore_window(driver: Driver | EditorDriver) -> None:
    """Release all buttons, cancel all actions, and restore the usual size of the window."""
    pygame.event.clear()
    pygame.key.set_mods(0)
    for button in (1, 2, 3):
        driver.release(button)
    pygame.display.set_mode((900, 600), pygame.RESIZABLE)
    driver.post(pygame.VIDEORESIZE, size=(900, 600), w=900, h=600)
    driver.post(pygame.WINDOWFOCUSLOST)
    appearance = PageAppearance(
        scale=1.0, theme="light", shows_panel=True, is_compact=False, is_motion_reduced=False
    )
    driver.window.set_appearance(appearance)
    for _ in range(8):
        driver.press_key("escape")
        driver.window.closed = False


def test_the_editor_handles_a_few_random_events(tmp_path: Path) -> None:
    assert_no_exceptions(play_editor(tmp_path, SEED + 1, N_EVENTS_IN_FAST_TESTS))


def test_the_viewer_handles_a_few_random_events(tmp_path: Path) -> None:
    assert_no_exceptions(play_viewer(tmp_path, SEED + 1, N_EVENTS_IN_FAST_TESTS))


@pytest.mark.slow
@pytest.mark.timeout(580)
def test_the_editor_handles_thousands_of_random_events(tmp_path: Path) -> None:
    assert_no_exceptions(play_editor(tmp_path, SEED, N_EVENTS))


@pytest.mark.slow
@pytest.mark.timeout(580)
def test_the_viewer_handles_thousands_of_random_events(tmp_path: Path) -> None:
    assert_no_exceptions(play_viewer(tmp_path, SEED, N_EVENTS))
