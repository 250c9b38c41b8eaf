"""First use of the viewer: the offered lesson, suggestions, consistent values, files and branches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import MIDDLE, open_viewer
from sample_sessions import HALL, RAPF, advance_session, start_session

from robocov.mapfile import save_map
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import measure_text
from robocov_app.storage.autosave import FOLDER_VARIABLE as DRAFTS
from robocov_app.storage.settings import FOLDER_VARIABLE, find_settings_file, load_settings
from robocov_app.toolkit.dialogs import Choice, Question
from robocov_app.toolkit.window.display import open_display
from robocov_app.viewer import launch as opening
from robocov_app.viewer.launch import ViewerLauncher, ViewerSettings
from robocov_app.viewer.session.files.drafts import find_recoverable_drafts
from robocov_app.viewer.session.files.workspace import SessionWorkspace
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.window.status import describe_cursor, suggest_actions

FOUR = (RAPF, ControllerChoice("rpf"), ControllerChoice("lloyd"), ControllerChoice("geodesic-lloyd"))


@pytest.fixture
def drawn_texts(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """List of all texts that canvases draw during the test."""
    texts: list[str] = []
    draw_text = Canvas.draw_text

    def draw_and_list(canvas: Canvas, text: str, *args: object, **kwargs: object) -> float:
        texts.append(text)
        return draw_text(canvas, text, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(Canvas, "draw_text", draw_and_list)
    return texts


def test_captions_show_the_values_of_the_chart_with_their_time(
    tmp_path: Path, drawn_texts: list[str]
) -> None:
    with open_viewer(tmp_path, RAPF, ControllerChoice("rpf"), size=(1280, 720)) as driver:
        session = driver.session
        driver.run_frames(2)
        # The curves get no further values.
        driver.window._cost_curves.update = lambda: None  # type: ignore[method-assign]
        for _ in range(90):
            session.playback.step()
        drawn_texts.clear()
        driver.settle()
        for pane in session.timeline.panes:
            value = f"{pane.distance_curve.values[-1]:.3f}"
            assert session.timeline.end_time - pane.distance_curve.last_time > 1.0
            caption = f"mean distance {value} m at {pane.distance_curve.last_time:.1f} s"
            assert caption in drawn_texts
            assert any(value in text and text != caption for text in drawn_texts)


def test_curves_begin_at_time_0_even_if_the_worker_started_late(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, ControllerChoice("rpf")) as driver:
        session = driver.session
        window = driver.window
        first_values = {pane.number: pane.distance_curve.interpolate(0.0) for pane in session.timeline.panes}
        for pane in session.timeline.panes:
            pane.curves["distance"].__init__()  # simulates that the worker has not started yet
        for _ in range(90):
            session.playback.step()
        window.update(0.0)
        for playing in (True, False):
            session.playback.is_playing = playing
            for _ in range(12):
                window.update(1 / 50)
                for answer in window.viewer.costs.known.values():
                    assert abs(answer.time - session.displayed.time) < 0.1
        for pane in session.timeline.panes:
            times = pane.distance_curve.times
            values = pane.distance_curve.values
            assert times[0] == 0.0
            assert np.diff(times).max() < 0.7
            assert values[0] == first_values[pane.number]


def test_the_cursor_is_described_in_the_pane_below_it_and_on_the_present_map(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, ControllerChoice("rpf")) as driver:
        other = driver.session.timeline.panes[1]
        other.simulation = other.simulation.with_changes(positions=other.simulation.positions + [0.3, 0.0])
        driver.viewer.costs.forget()
        texts = []
        for pane in (0, 1):
            driver.move(*driver.find_pixel(MIDDLE, pane))
            driver.run_frames(2)
            assert driver.viewer.active_pane == 0
            texts.append(describe_cursor(driver.viewer))
        assert texts[0] != texts[1]
        before = driver.viewer.inspection.cursor
        driver.viewer.files.open_map("square")
        driver.run_frames(2)
        # The same pixel is another point of the new map.
        assert driver.viewer.inspection.cursor != before
        assert driver.viewer.inspection.cursor == driver.window.canvas.to_world(driver.pixel, 1)


@pytest.mark.parametrize("size", [(900, 600), (1280, 720), (1600, 640), (2560, 1440)])
def test_each_of_four_panes_shows_its_cost(
    tmp_path: Path, drawn_texts: list[str], size: tuple[int, int]
) -> None:
    with open_viewer(tmp_path, *FOUR, size=size) as driver:
        boxes = driver.window.layout.panes
        driver.run_frames(2)
        drawn_texts.clear()
        driver.settle()
        for pane in driver.session.timeline.panes:
            value = f"{pane.distance_curve.interpolate(0.0):.3f} m"
            assert any(value in text for text in drawn_texts), (size, boxes)
        columns = len({left for left, *_ in boxes})
        assert columns == {900: 2, 1280: 2, 1600: 4, 2560: 2}[size[0]]
        bounds = driver.session.displayed.environment.region.bounds
        _, low = driver.window.canvas.to_pixel((0.0, bounds[1]), 0)
        _, high = driver.window.canvas.to_pixel((0.0, bounds[3]), 0)
        origin = driver.window.canvas.to_pixel((0.0, 0.0), 0)
        pixels_per_m = driver.window.canvas.to_pixel((1.0, 0.0), 0)[0] - origin[0]
        map_width = pixels_per_m * (bounds[2] - bounds[0])
        assert low - high > 0.65 * boxes[0][3] or map_width > 0.85 * boxes[0][2]
        left, _, width, _ = driver.window.layout.chart
        scale = driver.window.layout.scale
        free_width = left + width - driver.window.chart.times.right - 9 * scale
        name = max((pane.controller.label for pane in driver.session.timeline.panes), key=len)
        text_size = round(driver.window.theme.small_text * scale)
        assert measure_text(f"{name}  8.888  +88.8%", text_size, bold=True) <= free_width


def test_a_controller_name_is_not_cut_next_to_a_large_cost(tmp_path: Path, drawn_texts: list[str]) -> None:
    with open_viewer(tmp_path, ControllerChoice("atlas"), RAPF) as driver:
        for pane, value in zip(driver.session.timeline.panes, (1.856, 4.023), strict=True):
            pane.distance_curve.add(0.0, value)
        drawn_texts.clear()
        driver.window.draw()
        assert "RAPF  4.023  +117%" in drawn_texts


def test_actions_are_suggested_once_the_team_has_settled(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        viewer = driver.viewer
        session = driver.session
        assert suggest_actions(viewer) == ""
        session.timeline.is_settled = True
        assert suggest_actions(viewer).startswith(
            "The team has settled. Try:\ndraw a wall in a doorway (W) · drag a robot"
        )
        before = driver.copy_frame()
        driver.window._status.can_suggest = True
        driver.settle()
        assert not driver.shows_frame(before)
        session.timeline.is_settled = False
        assert suggest_actions(viewer), "a swaying robot does not make the suggestion blink"
        session.fail_robot(2)
        assert suggest_actions(viewer) == ""
        session.timeline.is_settled = True
        assert "fail" not in suggest_actions(viewer), "an action that was used is not suggested again"
        session.show_time(0.0)
        driver.window.run_command("suggestions")
        session.show_time(session.timeline.end_time)
        assert suggest_actions(viewer) == ""


def build_visible_launcher(
    monkeypatch: pytest.MonkeyPatch, folder: Path, **options: object
) -> ViewerLauncher:
    """Build a launcher that treats its invisible display like a visible one."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(folder))
    monkeypatch.setattr(
        opening, "open_display", lambda headless, missing_message: open_display(headless=True)
    )
    return ViewerLauncher(start_session(RAPF), "hall", folder, lattice=8, **options)  # type: ignore[arg-type]


def test_new_users_are_offered_the_lesson_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for key, starts_lesson in ((pygame.K_RETURN, True), (pygame.K_ESCAPE, False)):
        folder = tmp_path / pygame.key.name(key)
        launcher = build_visible_launcher(monkeypatch, folder, offers_lesson=True)
        launcher.session.playback.is_playing = True
        with launcher.window() as window:
            assert isinstance(window.dialogs.current, Question)
            texts = [answer.text for answer in window.dialogs.current.answers]
            assert texts == ["Start the lesson", "Explore on my own"]
            window.run_frame(0.5)
            assert window.viewer.session.displayed.time == 0.0, "the session waits for the answer"
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0, unicode="", scancode=0))
            window.run_frame(0.0)
            assert window.dialogs.current is None
            assert (window.lesson.player is not None) is starts_lesson
            window.run_frame(0.5)
            assert window.viewer.session.displayed.time > 0.0, "the robots move without another key"
        with build_visible_launcher(monkeypatch, folder, offers_lesson=True).window() as window:
            assert window.dialogs.current is None


def test_the_button_behind_the_offer_pauses_once_the_offer_is_closed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    launcher = build_visible_launcher(monkeypatch, tmp_path, offers_lesson=True)
    launcher.session.playback.is_playing = True
    with launcher.window() as window:
        window.run_frame(0.0)
        button = window.top_bar.ui.find("button", "pause")
        assert button is not None
        assert button.text == "Pause"
        states = []
        # The first click only closes the dialog.
        for _ in range(2):
            for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
                pygame.event.post(pygame.event.Event(kind, pos=button.rect.center, button=1))
            window.run_frame(0.0)
            states.append((window.dialogs.is_open, window.viewer.session.playback.is_playing))
        assert states == [(False, True), (False, False)]


def test_drafts_are_offered_and_the_session_waits_for_the_answer(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(DRAFTS, str(tmp_path / "drafts"))
    for _ in range(2):
        workspace = SessionWorkspace(advance_session(start_session(), 5), tmp_path / "drafts")
        workspace.session.fail_robot(2)
        workspace.save_draft({})
        workspace.close()
    for key, remaining_drafts, numbers in (
        (pygame.K_l, 2, (1, 2, 3)),
        (pygame.K_d, 1, (1, 2, 3)),
        (pygame.K_r, 0, (1, 3)),
    ):
        launcher = build_visible_launcher(monkeypatch, tmp_path, offers_lesson=True)
        launcher.session.playback.is_playing = True
        with launcher.window() as window:
            assert isinstance(window.dialogs.current, Question)
            assert window.dialogs.current.text.startswith("Unsaved session")
            window.run_frame(0.5)
            assert window.viewer.session.displayed.time == 0.0
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0, unicode="", scancode=0))
            window.run_frame(0.0)
            assert window.viewer.session.displayed.numbers == numbers
            is_recovered = key == pygame.K_r
            assert window.viewer.session.playback.is_playing is not is_recovered
            says_how_to_play = window.viewer.message.endswith(
                "It is paused: press Space or Play to continue."
            )
            assert says_how_to_play is is_recovered
            # After a draft was discarded, the next one is offered.
            assert (window.dialogs.current is not None) is (remaining_drafts == 1)
            assert len(find_recoverable_drafts(tmp_path / "drafts")) == remaining_drafts


def test_the_lesson_is_not_offered_with_a_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with build_visible_launcher(monkeypatch, tmp_path).window() as window:
        assert window.dialogs.current is None


def test_a_scale_enlarges_the_window_or_is_reduced_with_a_message(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(opening, "fit_to_screen", lambda size: (min(size[0], 1500), min(size[1], 1000)))
    with build_visible_launcher(monkeypatch, tmp_path, scale=1.5).window() as window:
        assert window.layout.scale == 1.5
        assert window.screen.get_size() == (1350, 900)
    assert capsys.readouterr().err == ""
    with build_visible_launcher(monkeypatch, tmp_path, scale=2.0).window() as window:
        assert window.layout.scale == 1.625
        assert window.viewer.message == "Scale 2 needs a window of 1800 × 1200; using 1.625"
    # A dialog may cover the message in the window.
    assert capsys.readouterr().err == "robocov: scale 2 needs a window of 1800 × 1200; using 1.625\n"


def test_frames_without_a_display_do_not_show_that_the_scale_is_reduced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launcher = ViewerLauncher(
        start_session(RAPF), "hall", tmp_path, size=(1280, 720), scale=1.5, headless=True
    )
    with launcher.window() as window:
        assert window.viewer.message == ""
    assert capsys.readouterr().err == "robocov: scale 1.5 needs a window of 1350 × 900; using 1.125\n"


def test_files_are_opened_from_a_list_with_recent_sessions_first(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        viewer = driver.viewer
        save_map(HALL, tmp_path / "other.json")
        viewer.files.save_session(tmp_path / "first.robocov")
        viewer.files.save_session(tmp_path / "second.robocov")
        (tmp_path / "notes.txt").touch()
        driver.press_key("ctrl+o")
        dialog = driver.window.dialogs.current
        assert isinstance(dialog, Choice)
        offered = [option.text for option in dialog.options("")]
        assert offered[:2] == [str(tmp_path / "second.robocov"), str(tmp_path / "first.robocov")]
        assert offered[2:] == ["first.robocov", "other.json", "second.robocov", "../"]
        driver.type("oth")
        driver.press_key("return")
        assert not driver.window.dialogs.is_open
        assert viewer.files.map_name == str(tmp_path / "other.json")
        driver.press_key("ctrl+o")
        driver.press_key("down")
        driver.press_key("return")
        assert viewer.files.workspace.path == tmp_path / "first.robocov"
        assert viewer.files.recent[0] == str(tmp_path / "first.robocov")
        driver.press_key("ctrl+o")
        driver.type("nothing.robocov")
        driver.press_key("return")
        # The dialog stays open with the typed text and the error.
        dialog = driver.window.dialogs.current
        assert isinstance(dialog, Choice)
        assert "nothing.robocov" in dialog.error
        assert dialog.text == "nothing.robocov"


def test_files_are_dropped_on_the_window(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        viewer = driver.viewer
        save_map(HALL, tmp_path / "other.json")
        viewer.session.fail_robot(2)
        viewer.files.save_session(tmp_path / "session.robocov")
        (tmp_path / "bad.robocov").write_text("{}")

        def drop(name: str) -> None:
            pygame.event.post(pygame.event.Event(pygame.DROPFILE, file=str(tmp_path / name)))
            driver.settle()

        drop("other.json")
        assert viewer.files.map_name == str(tmp_path / "other.json")
        assert viewer.session.displayed.numbers == (1, 2, 3)
        drop("session.robocov")
        assert viewer.session.displayed.numbers == (1, 3)
        assert viewer.files.workspace.path == tmp_path / "session.robocov"
        drop("bad.robocov")
        assert viewer.has_error_message
        assert "bad.robocov" in viewer.message
        assert viewer.session.displayed.numbers == (1, 3)


def test_recent_sessions_are_saved_in_the_settings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with build_visible_launcher(monkeypatch, tmp_path).window() as window:
        window.viewer.files.save_session(tmp_path / "mine.robocov")
        window.viewer.view.has_suggestions = False
    settings, _ = load_settings(ViewerSettings, find_settings_file())
    assert settings.recent == (str(tmp_path / "mine.robocov"),)
    assert not settings.suggests
    with build_visible_launcher(monkeypatch, tmp_path).window() as window:
        assert window.viewer.files.recent == [str(tmp_path / "mine.robocov")]
        assert not window.viewer.view.has_suggestions


def test_branches_are_listed_with_their_costs_and_entered(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        viewer = driver.viewer
        session = driver.session
        session.playback.is_playing = True
        driver.run_frames(20)
        session.fail_robot(2)
        driver.run_frames(20)
        failed = session.timeline.head
        viewer.playback.show_time(0.2)
        session.fail_robot(3)
        driver.run_frames(20)
        driver.press_key("ctrl+b")
        dialog = driver.window.dialogs.current
        assert isinstance(dialog, Choice)
        options = dialog.options("")
        assert options[-1].text.endswith("robot 3 failed  (here)")
        for option in options:
            assert "RAPF" in option.note
            assert " m" in option.note
        end_time = session.timeline.end_time
        end_value = session.timeline.panes[0].distance_curve.interpolate(end_time)
        assert options[-1].note == f"{end_time:.1f} s · RAPF {end_value:.3f} m"
        driver.type("robot 2")
        driver.press_key("return")
        assert session.timeline.head is failed


def test_a_lesson_waits_for_the_answer_about_drafts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(DRAFTS, str(tmp_path / "drafts"))
    workspace = SessionWorkspace(advance_session(start_session(), 5), tmp_path / "drafts")
    workspace.session.fail_robot(2)
    workspace.save_draft({})
    workspace.close()
    launcher = build_visible_launcher(monkeypatch, tmp_path, offers_lesson=False)
    with launcher.window() as window:
        window.run_command("tour")
        window.run_frame(0.5)
        start = window.lesson.frame_key
        window.run_frame(0.5)
        assert window.lesson.frame_key == start
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_l, mod=0, unicode="", scancode=0))
        window.run_frame(0.0)
        window.run_frame(0.5)
        assert window.lesson.frame_key != start
