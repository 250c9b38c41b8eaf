"""The first minutes: the offer of the lesson, suggestions, numbers that match, files and branches."""

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
from robocov_app.toolkit.display import open_display
from robocov_app.viewer import launch as opening
from robocov_app.viewer.launch import ViewerLauncher, ViewerSettings
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.files.workspace import SessionWorkspace, find_recoverable_drafts
from robocov_app.viewer.status import describe_cursor, list_facts, suggest_actions

FOUR = (RAPF, ControllerChoice("rpf"), ControllerChoice("lloyd"), ControllerChoice("geodesic-lloyd"))


@pytest.fixture
def words(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Everything that is written on canvases from now on."""
    written: list[str] = []
    text = Canvas.draw_text

    def noted(canvas: Canvas, words: str, *args: object, **kwargs: object) -> float:
        written.append(words)
        return text(canvas, words, *args, **kwargs)  # type: ignore[arg-type]

    monkeypatch.setattr(Canvas, "draw_text", noted)
    return written


def test_a_caption_has_the_numbers_of_the_chart_with_their_time(tmp_path: Path, words: list[str]) -> None:
    with open_viewer(tmp_path, RAPF, ControllerChoice("rpf")) as driver:
        session = driver.session
        driver.frames(2)
        driver.window._cost_curves.update = lambda: None  # type: ignore[method-assign]  # no answer comes any more
        for _ in range(90):
            session.playback.step()
        words.clear()
        driver.settle()
        for pane in session.timeline.panes:
            value = f"{pane.distance_curve.values[-1]:.3f}"
            assert session.timeline.end_time - pane.distance_curve.last_time > 1.0
            caption = f"mean distance {value} m at {pane.distance_curve.last_time:.1f} s"
            assert caption in words and any(value in each and each != caption for each in words)


def test_a_curve_begins_at_the_beginning_also_if_nobody_answered_then(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, ControllerChoice("rpf")) as driver:
        session, window = driver.session, driver.window
        wanted = {pane.number: pane.distance_curve.interpolate(0.0) for pane in session.timeline.panes}
        for pane in session.timeline.panes:
            pane.curves["distance"].__init__()  # as if the worker had not begun yet
        for _ in range(90):
            session.playback.step()
        window.update(0.0)
        for playing in (True, False):
            session.playback.is_playing = playing
            for _ in range(12):
                window.update(1 / 50)
                assert all(
                    abs(each.time - session.displayed.time) < 0.1
                    for each in window.viewer.costs.known.values()
                )
        for pane in session.timeline.panes:
            times, values = pane.distance_curve.times, pane.distance_curve.values
            assert times[0] == 0.0 and np.diff(times).max() < 0.7 and values[0] == wanted[pane.number]


def test_the_cursor_tells_of_the_pane_below_it_and_of_the_map_as_it_is(tmp_path: Path) -> None:
    with open_viewer(tmp_path, RAPF, ControllerChoice("rpf")) as driver:
        other = driver.session.timeline.panes[1]
        other.simulation = other.simulation.with_changes(positions=other.simulation.positions + [0.3, 0.0])
        driver.viewer.costs.forget()
        said = []
        for pane in (0, 1):
            driver.move(*driver.pixel(MIDDLE, pane))
            driver.frames(2)
            assert driver.viewer.active_pane == 0
            said.append(describe_cursor(driver.viewer))
        assert said[0] != said[1]
        before = driver.viewer.inspection.cursor
        driver.viewer.files.open_map("square")
        driver.frames(2)
        assert driver.viewer.inspection.cursor != before  # the same pixel is another place there
        assert driver.viewer.inspection.cursor == driver.window.canvas.to_world(driver.at, 1)


@pytest.mark.parametrize("size", [(900, 600), (1280, 720), (1600, 640), (2560, 1440)])
def test_each_of_four_panes_has_its_cost(tmp_path: Path, words: list[str], size: tuple[int, int]) -> None:
    with open_viewer(tmp_path, *FOUR, size=size) as driver:
        boxes = driver.window.layout.panes
        driver.frames(2)
        words.clear()
        driver.settle()
        for pane in driver.session.timeline.panes:
            value = f"{pane.distance_curve.interpolate(0.0):.3f} m"
            assert any(value in each for each in words), (size, boxes)
        columns = len({left for left, *_ in boxes})
        assert columns == {900: 2, 1280: 2, 1600: 4, 2560: 2}[size[0]]
        low, high = (
            driver.window.canvas.to_pixel((0.0, y), 0)[1]
            for y in driver.session.displayed.environment.region.bounds[1::2]
        )
        across = (
            driver.window.canvas.to_pixel((1.0, 0.0), 0)[0] - driver.window.canvas.to_pixel((0.0, 0.0), 0)[0]
        )
        bounds = driver.session.displayed.environment.region.bounds
        assert low - high > 0.65 * boxes[0][3] or across * (bounds[2] - bounds[0]) > 0.85 * boxes[0][2]
        (left, _, width, _), scale = driver.window.layout.chart, driver.window.layout.scale
        room = left + width - driver.window.chart.times.right - 9 * scale
        name = max((pane.controller.label for pane in driver.session.timeline.panes), key=len)
        assert (
            measure_text(f"{name}  8.888  +88.8 %", round(driver.window.theme.small_text * scale), True)
            <= room
        )


def test_a_name_is_whole_beside_a_cost_that_is_more_than_twice_the_best(
    tmp_path: Path, words: list[str]
) -> None:
    with open_viewer(tmp_path, ControllerChoice("atlas"), RAPF) as driver:
        for pane, value in zip(driver.session.timeline.panes, (1.856, 4.023), strict=True):
            pane.distance_curve.add(0.0, value)
        words.clear()
        driver.window.draw()
        assert "RAPF  4.023  +117 %" in words


def test_frames_a_second_stay_in_sight_when_they_are_few(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.move(*driver.pixel(MIDDLE))
        slow, fast = list_facts(driver.viewer, 9.0, 60.0, None), list_facts(driver.viewer, 60.0, 60.0, None)
        assert slow.index("9 fps") < slow.index(describe_cursor(driver.viewer))
        assert fast.index("60 fps") > fast.index(describe_cursor(driver.viewer))


def test_the_next_step_is_suggested_once_the_team_has_settled(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        viewer, session = driver.viewer, driver.session
        assert suggest_actions(viewer) == ""
        session.timeline.is_settled = True
        assert suggest_actions(viewer).startswith(
            "The team has settled. Try:\ndraw a wall in a doorway (W) · drag a robot"
        )
        before = driver.picture()
        driver.window.is_unattended = False
        driver.settle()
        assert not driver.same(before)
        session.timeline.is_settled = False
        assert suggest_actions(viewer), "it does not blink while somebody sways"
        session.fail_robot(2)
        assert suggest_actions(viewer) == ""  # something is going on again
        session.timeline.is_settled = True
        assert "fail" not in suggest_actions(viewer)  # that is known now
        session.show_time(0.0)
        driver.window.do("suggestions")
        session.show_time(session.timeline.end_time)
        assert suggest_actions(viewer) == ""


def opened_for_a_person(monkeypatch: pytest.MonkeyPatch, folder: Path, **options: object) -> ViewerLauncher:
    """Return how a window opens that somebody would watch, on a display that nobody sees."""
    monkeypatch.setenv(FOLDER_VARIABLE, str(folder))
    monkeypatch.setattr(
        opening, "open_display", lambda headless, missing_message: open_display(headless=True)
    )
    return ViewerLauncher(start_session(RAPF), "hall", folder, lattice=8, **options)  # type: ignore[arg-type]


def test_who_starts_for_the_first_time_is_offered_the_lesson_once(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for chosen, lesson in (("return", True), ("escape", False)):
        folder = tmp_path / chosen
        launcher = opened_for_a_person(monkeypatch, folder, offers_lesson=True)
        launcher.session.playback.is_playing = True
        with launcher.window() as window:
            assert isinstance(window.dialogs.current, Question)
            assert [answer.text for answer in window.dialogs.current.answers] == [
                "Lesson 1",
                "Just let me play",
            ]
            window.run_frame(0.5)
            assert window.viewer.session.displayed.time == 0.0  # nobody looks at the team yet
            key = pygame.K_RETURN if chosen == "return" else pygame.K_ESCAPE
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key, mod=0, unicode="", scancode=0))
            window.run_frame(0.0)
            assert window.dialogs.current is None and (window.lesson.player is not None) is lesson
            window.run_frame(0.5)
            assert window.viewer.session.displayed.time > 0.0
        with opened_for_a_person(monkeypatch, folder, offers_lesson=True).window() as window:
            assert window.dialogs.current is None


def test_work_that_was_left_behind_is_offered_and_waits_for_the_answer(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(DRAFTS, str(tmp_path / "drafts"))
    for _ in range(2):
        workspace = SessionWorkspace(advance_session(start_session(), 5), tmp_path / "drafts")
        workspace.session.fail_robot(2)
        workspace.save_draft({})
        workspace.close()
    everybody = (1, 2, 3)
    for chosen, left, numbers in (
        (pygame.K_l, 2, everybody),
        (pygame.K_d, 1, everybody),
        (pygame.K_r, 0, (1, 3)),
    ):
        launcher = opened_for_a_person(monkeypatch, tmp_path, offers_lesson=True)
        launcher.session.playback.is_playing = True
        with launcher.window() as window:
            assert isinstance(window.dialogs.current, Question)
            assert "1 edit, never saved" in window.dialogs.current.text
            window.run_frame(0.5)
            assert window.viewer.session.displayed.time == 0.0
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=chosen, mod=0, unicode="", scancode=0))
            window.run_frame(0.0)
            assert window.viewer.session.displayed.numbers == numbers
            assert (window.dialogs.current is not None) is (left == 1)  # the next one is offered
            assert len(find_recoverable_drafts(tmp_path / "drafts")) == left


def test_who_opens_something_of_his_own_is_not_asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with opened_for_a_person(monkeypatch, tmp_path).window() as window:
        assert window.dialogs.current is None


def test_a_scale_takes_the_window_that_it_needs_or_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(opening, "fit_to_screen", lambda size: (min(size[0], 1500), min(size[1], 1000)))
    with opened_for_a_person(monkeypatch, tmp_path, scale=1.5).window() as window:
        assert window.layout.scale == 1.5 and window.screen.get_size() == (1350, 900)
    with opened_for_a_person(monkeypatch, tmp_path, scale=2.0).window() as window:
        assert window.layout.scale == 1.625
        assert window.viewer.message == "scale 2 needs a window of 1800 × 1200; using 1.625"


def test_files_are_opened_from_a_list_with_recent_sessions_first(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        viewer = driver.viewer
        save_map(HALL, tmp_path / "other.json")
        viewer.files.save_session(tmp_path / "first.robocov")
        viewer.files.save_session(tmp_path / "second.robocov")
        (tmp_path / "notes.txt").touch()
        driver.key("ctrl+o")
        asked = driver.window.dialogs.current
        assert isinstance(asked, Choice)
        offered = [each.text for each in asked.options("")]
        assert offered[:2] == [str(tmp_path / "second.robocov"), str(tmp_path / "first.robocov")]
        assert offered[2:] == ["first.robocov", "other.json", "second.robocov", "../"]
        driver.type("oth")
        driver.key("return")
        assert not driver.window.dialogs.is_open and viewer.files.map_name == str(tmp_path / "other.json")
        driver.key("ctrl+o")
        driver.key("down")
        driver.key("return")
        assert viewer.files.workspace.path == tmp_path / "first.robocov"
        assert viewer.files.recent[0] == str(tmp_path / "first.robocov")
        driver.key("ctrl+o")
        driver.type("nothing.robocov")
        driver.key("return")  # an error stays in the dialog, with what was typed
        asked = driver.window.dialogs.current
        assert isinstance(asked, Choice) and "nothing.robocov" in asked.error
        assert asked.text == "nothing.robocov"


def test_files_are_dropped_on_the_window(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        viewer = driver.viewer
        save_map(HALL, tmp_path / "other.json")
        viewer.session.fail_robot(2)
        viewer.files.save_session(tmp_path / "story.robocov")
        (tmp_path / "bad.robocov").write_text("{}")

        def dropped(name: str) -> None:
            pygame.event.post(pygame.event.Event(pygame.DROPFILE, file=str(tmp_path / name)))
            driver.settle()

        dropped("other.json")
        assert viewer.files.map_name == str(tmp_path / "other.json") and viewer.session.displayed.numbers == (
            1,
            2,
            3,
        )
        dropped("story.robocov")
        assert (
            viewer.session.displayed.numbers == (1, 3)
            and viewer.files.workspace.path == tmp_path / "story.robocov"
        )
        dropped("bad.robocov")
        assert (
            viewer.has_error_message
            and "bad.robocov" in viewer.message
            and viewer.session.displayed.numbers == (1, 3)
        )


def test_recent_sessions_are_remembered(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with opened_for_a_person(monkeypatch, tmp_path).window() as window:
        window.viewer.files.save_session(tmp_path / "mine.robocov")
        window.viewer.view.has_suggestions = False
    settings, _ = load_settings(ViewerSettings, find_settings_file())
    assert settings.recent == (str(tmp_path / "mine.robocov"),) and not settings.suggests
    with opened_for_a_person(monkeypatch, tmp_path).window() as window:
        assert (
            window.viewer.files.recent == [str(tmp_path / "mine.robocov")]
            and not window.viewer.view.has_suggestions
        )


def test_branches_are_listed_with_their_costs_and_entered(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        viewer, session = driver.viewer, driver.session
        session.playback.is_playing = True
        driver.frames(20)
        session.fail_robot(2)
        driver.frames(20)
        failed = session.timeline.head
        viewer.playback.look_at(0.2)
        session.fail_robot(3)
        driver.frames(20)
        driver.key("ctrl+b")
        asked = driver.window.dialogs.current
        assert isinstance(asked, Choice)
        lines = asked.options("")
        assert [line.text for line in lines][-1].endswith("robot 3 failed  (here)")
        assert all("RAPF" in line.note and " m" in line.note for line in lines)
        ends = np.array(
            [pane.distance_curve.interpolate(session.timeline.end_time) for pane in session.timeline.panes]
        )
        assert lines[-1].note == f"{session.timeline.end_time:.1f} s · RAPF {ends[0]:.3f} m"
        driver.type("robot 2")
        driver.key("return")
        assert session.timeline.head is failed
