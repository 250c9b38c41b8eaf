"""Lessons: their chapters play, ask questions and set tasks, and the session is restored at the end."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest
from driven_window import Driver, open_viewer
from sample_sessions import HALL, advance_session, start_session

from robocov.errors import InputError, MapError
from robocov.mapfile import save_map
from robocov_app.cli import main
from robocov_app.render.fonts import render_text
from robocov_app.render.layer_catalog import build_pane_layers, build_standard_layers
from robocov_app.viewer.launch import HEADLESS_FPS
from robocov_app.viewer.lessons import page, player
from robocov_app.viewer.lessons.player import (
    BASE_LAYERS,
    FIRST_LESSON,
    LessonPlayer,
    check_lesson,
    load_lesson,
)
from robocov_app.viewer.session.files.drafts import find_recoverable_drafts
from robocov_app.viewer.session.files.session_file import build_session_content, format_session
from robocov_app.viewer.session.session import Session

LAYERS = {layer.name for layer in (*build_standard_layers(), *build_pane_layers())}
LESSON = load_lesson().lesson
assert LESSON is not None


def write_short_lesson(tmp_path: Path, **changes: object) -> Path:
    """Write a lesson of two chapters, in which a robot fails; the second has a question and a task."""
    session = advance_session(start_session(), 20)
    session.fail_robot(2)
    advance_session(session, 20)
    session.restart(start="far")
    advance_session(session, 10)
    content = json.loads(
        format_session(
            build_session_content(session.timeline.document, session.timeline.head, session.timeline.step, {})
        )
    )
    first = {"title": "Failure", "text": "One fails.", "edit": 1, "until": {"step": 30}}
    question = {"text": "What now?", "answers": ["Nothing", "Much"], "right": 2, "why": "So it is."}
    task = {"text": "drag robot 1.", "until": {"robot": 1, "inside": [0, 0, 2, 2]}, "done": "Well done."}
    second = {"title": "Far", "text": "From far.", "edit": 2, "until": {"step": 5}, **changes}
    chapters = [first, {"question": question, "task": task, **second}]
    content["lesson"] = {"title": "Two", "chapters": chapters}
    path = tmp_path / "two.robocov"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize("chapter", LESSON.chapters, ids=lambda chapter: chapter.title)
def test_chapters_are_short_and_their_layers_exist(chapter) -> None:
    assert set(chapter.show) <= LAYERS
    assert LAYERS >= BASE_LAYERS
    assert len(re.findall(r"[.!?](?= |$)", chapter.text)) in (2, 3)
    assert len(chapter.title) <= 44
    assert "  " not in chapter.text
    # People need time to read, and to watch.
    assert chapter.until.step is not None
    seconds = chapter.until.step / 60 / chapter.speed
    assert len(chapter.text.split()) / seconds < 5.0


@pytest.mark.parametrize(("distance", "ends"), [(100.0, True), (0.001, False)])
def test_a_chapter_that_ends_at_a_mean_distance_is_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, distance: float, ends: bool
) -> None:
    monkeypatch.setattr(player, "MAX_TASK_S", 1.0)
    path = write_short_lesson(tmp_path, until={"mean_distance_below": distance})
    first, second = check_lesson(path, load_lesson(path))
    assert first.ends
    assert second.ends is ends
    assert second.duration == pytest.approx(0.0 if ends else 1.0, abs=0.02)


@pytest.mark.slow
def test_every_chapter_of_the_lesson_ends() -> None:
    assert all(chapter.ends for chapter in check_lesson(FIRST_LESSON, load_lesson()))


def test_chapters_repeat_edits_ask_questions_and_set_tasks(tmp_path: Path, capsys) -> None:
    with open_viewer(tmp_path) as driver:
        advance_session(driver.session, 10).fail_robot(3)
        before = driver.viewer.session
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        lesson = driver.window.lesson.player
        viewer = driver.viewer
        assert lesson is not None
        assert lesson.chapter.title == "Failure"
        assert viewer.session is not before
        driver.run_frames(6)
        assert viewer.session.displayed.numbers == (1, 2, 3)
        driver.run_frames(30)
        assert viewer.session.displayed.numbers == (1, 3), "at its step, however long frames take"
        assert lesson.state == "ended"
        assert not viewer.session.playback.is_playing
        lesson.skip(1)
        assert lesson.state == "asking"
        assert lesson.lines == ["What now?", "1  Nothing", "2  Much"]
        driver.run_frames(10)
        assert viewer.session.displayed.time == 0.0, "it waits for an answer"
        driver.press_key("1")
        assert lesson.state == "playing"
        assert lesson.answer == 1
        driver.run_frames(30)
        assert lesson.state == "task"
        assert lesson.lines == ["Your turn: drag robot 1."]
        viewer.session.place_robot(1, (1.0, 1.0))
        driver.run_frames(2)
        assert lesson.state == "ended"
        assert lesson.lines == ["✗ Not quite. Correct: Much", "So it is.", "Well done."]
        assert viewer.session.playback.is_playing, "robots move on after a task"
        driver.press_key("space")
        assert not viewer.session.playback.is_playing
        driver.press_key("space")
        assert viewer.message == "This chapter is over: press → or click Next to continue"
        assert not viewer.session.playback.is_playing
        driver.press_key("escape")
        assert driver.window.lesson.player is None
        assert viewer.session is before
        assert before.displayed.numbers == (1, 2)


def test_a_chapter_that_has_ended_waits_for_the_user(tmp_path: Path) -> None:
    """A page that turns by itself is lost to everybody who reads slowly."""
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        lesson = driver.window.lesson.player
        driver.run_frames(40)
        assert lesson.state == "ended"
        lesson.advance(1000.0)
        assert (lesson.number, lesson.state) == (0, "ended")
        click_area(driver, "skip", 1)
        assert (lesson.number, lesson.state) == (1, "asking")


def test_the_keys_of_answers_do_not_leave_the_lesson_without_an_open_question(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        lesson = driver.window.lesson.player
        layers = set(driver.viewer.view.layers)
        states = []

        def press_all_keys() -> None:
            for key in "1234":
                driver.press_key(key)
                assert driver.viewer.message == "No question is open"
            states.append(lesson.state)

        press_all_keys()
        driver.run_frames(40)
        press_all_keys()
        driver.press_key("right")
        driver.press_key("1")
        press_all_keys()
        assert states == ["playing", "ended", "playing"]
        assert lesson.answer == 1, "the first answer counts"
        assert driver.viewer.view.layers == layers
        driver.run_frames(30)
        assert lesson.state == "task"
        assert "centroids" not in driver.viewer.view.layers
        driver.press_key("2")
        assert lesson.state == "task"
        assert "centroids" in driver.viewer.view.layers, "during a task, layers can be switched"


def test_the_end_is_reported_and_the_selection_restored(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path, robot=1))
        driver.press_key("right")
        assert driver.viewer.selected_robot == 1
        driver.press_key("right")
        assert driver.window.lesson.player.state == "closing"
        driver.press_key("right")
        driver.run_frames(1)
        assert driver.window.lesson.player is None
        assert driver.viewer.selected_robot is None
        assert driver.viewer.message.startswith("The lesson has ended")


def click_area(driver: Driver, action: str, argument: int | None = None) -> None:
    """Click the area of the page that calls a method of the lesson."""
    driver.window.draw()
    for box, call, _ in driver.window.lesson.click_areas:
        function = getattr(call, "func", call)
        arguments = getattr(call, "args", ())
        if function.__name__ == action and (argument is None or arguments == (argument,)):
            driver.click(*box.center)
            return
    raise AssertionError(f"no area for {action} {argument}")


def test_back_and_next_are_buttons_and_the_cross_ends_the_lesson(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        lesson = driver.window.lesson.player
        assert lesson is not None
        click_area(driver, "skip", 1)
        assert lesson.number == 1
        click_area(driver, "skip", -1)
        assert lesson.number == 0
        click_area(driver, "end")
        driver.run_frames(1)
        assert driver.window.lesson.player is None


def test_answers_keep_their_marks_until_the_next_chapter(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path, task=None))
        lesson = driver.window.lesson.player
        assert lesson is not None
        lesson.skip(1)
        assert [answer.mark for answer in lesson.marked_answers] == ["", ""]
        click_area(driver, "reply", 1)
        assert [answer.mark for answer in lesson.marked_answers] == ["chosen", ""], "not revealed yet"
        assert lesson.comments == []
        driver.run_frames(30)
        assert lesson.state == "ended"
        assert [answer.mark for answer in lesson.marked_answers] == ["wrong", "right"]
        assert lesson.comments == ["So it is."]


def test_the_closing_page_says_what_was_found_out(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        lesson = driver.window.lesson.player
        assert lesson is not None
        lesson.skip(1)
        driver.press_key("2")
        lesson.skip(1)
        assert lesson.state == "closing"
        assert lesson.score == (1, 1)
        assert lesson.findings == ["What now? Much."]
        assert not driver.session.playback.is_playing
        lesson.advance(1000.0)
        assert lesson.state == "closing", "it stays until the user closes it"
        click_area(driver, "skip", -1)
        assert (lesson.number, lesson.state) == (1, "asking")
        lesson.skip(1)
        click_area(driver, "skip", 1)
        driver.run_frames(1)
        assert driver.window.lesson.player is None
    assert LESSON is not None
    assert LESSON.found
    assert LESSON.next_steps


def read_lesson_page(driver: Driver, monkeypatch: pytest.MonkeyPatch) -> str:
    """Draw the page of the lesson, and return its lines in one text."""
    lines: list[str] = []

    def record_and_render(text: str, *arguments: Any, **options: Any) -> pygame.Surface:
        lines.append(text)
        return render_text(text, *arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr(page, "render_text", record_and_render)
        driver.window.draw()
    return "\n".join(lines)


def test_the_closing_page_lists_skipped_tasks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        lesson = driver.window.lesson.player
        assert lesson is not None
        lesson.skip(1)
        driver.press_key("1")
        driver.run_frames(30)
        assert lesson.state == "task"
        lesson.skip(1)
        assert "Task skipped: Far" in read_lesson_page(driver, monkeypatch)
        lesson.skip(-1)
        driver.press_key("1")
        driver.run_frames(30)
        driver.session.place_robot(1, (1.0, 1.0))
        driver.run_frames(2)
        assert lesson.state == "ended"
        lesson.skip(1)
        assert lesson.state == "closing"
        assert "skipped" not in read_lesson_page(driver, monkeypatch)


@pytest.mark.parametrize("size", [(900, 600), (1280, 720), (1280, 800)])
def test_the_closing_page_ends_above_its_buttons(
    tmp_path: Path, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path, size=size) as driver:
        driver.window.lesson.is_unattended = False
        driver.press_key("f2")
        lesson = driver.window.lesson.player
        assert lesson is not None
        lesson.first_answers = {2: 1}
        for _ in LESSON.chapters:
            lesson.skip(1)
        assert lesson.state == "closing"
        ends: list[tuple[str, float]] = []
        write = page.LessonPage._write

        def record_and_write(self: page.LessonPage, text: str, size: float, *arguments: Any, **options: Any):
            if self.y == self.layout.panel.top + page._PAGE_TOP_PX * self.scale:
                ends.clear()  # The first text of another try.
            ends.append((text, self.y + size * self.scale))
            write(self, text, size, *arguments, **options)

        monkeypatch.setattr(page.LessonPage, "_write", record_and_write)
        driver.window.draw()
        written = [text for text, _ in ends]
        assert any(text.startswith("Task skipped") for text in written)
        top = min(area.box.top for area in driver.window.lesson.click_areas if area.name in ("back", "next"))
        scale = driver.window.layout.scale
        bar_top = top - (page.LessonPage.progress_above_bottom - page.LessonPage.buttons_above_bottom) * scale
        dots = [area.box.top for area in driver.window.lesson.click_areas if area.name.startswith("chapter")]
        lowest = min([bar_top, *dots])
        hint = ends.pop()
        assert hint[0].startswith("Space")
        titles = [chapter.title for chapter in LESSON.chapters]
        assert max(end for text, end in ends if text not in titles) <= lowest


def test_an_own_lesson_can_be_played_again(tmp_path: Path) -> None:
    path = write_short_lesson(tmp_path)
    with open_viewer(tmp_path) as driver:
        advance_session(driver.session, 10)
        driver.window.lesson.start(path)
        driver.window.lesson.end()
        assert driver.viewer.message == "The lesson has ended; your previous session is back"
        driver.press_key("f2")
        lesson = driver.window.lesson.player
        assert lesson is not None
        assert lesson.lesson.title == "Two"


def test_a_session_before_a_lesson_is_set_aside(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        session = driver.session
        session.fail_robot(3)
        driver.press_key("f2")
        assert driver.viewer.message == "Your session is set aside. It returns when the lesson ends."
        driver.press_key("escape")
        assert driver.viewer.message == "The lesson has ended; your previous session is back"
        assert driver.session is session


def test_edits_after_taking_over_from_a_lesson_can_be_recovered(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.viewer.files.draft_folder = tmp_path / "drafts"
        driver.press_key("f2")
        driver.press_key("f2")
        driver.session.fail_robot(3)
        driver.press_key("f2")
        hint = "What you have changed is kept: Ctrl+Shift+O opens it."
        assert driver.viewer.message == hint
        driver.press_key("f2")
        driver.session.fail_robot(4)
        driver.press_key("escape")
        assert driver.viewer.message.endswith(hint)
        driver.press_key("ctrl+shift+o")
        assert driver.session.displayed.numbers == (1, 2, 3, 5, 6)
        driver.viewer.files.workspace.close()


def test_edits_that_a_lesson_asks_for_leave_no_draft(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.viewer.files.draft_folder = tmp_path / "drafts"
        driver.window.lesson.start(write_short_lesson(tmp_path))
        driver.session.place_robot(1, (1.0, 1.0))
        driver.run_frames(2)
        driver.press_key("escape")
        assert find_recoverable_drafts(tmp_path / "drafts") == ()


@pytest.mark.parametrize("is_left", [False, True])
def test_opening_a_file_ends_the_lesson(tmp_path: Path, is_left: bool) -> None:
    with open_viewer(tmp_path) as driver:
        path = tmp_path / "own.robocov"
        driver.session.fail_robot(3)
        driver.viewer.files.save_session(path)
        session = driver.session
        driver.press_key("f2")
        if is_left:
            driver.press_key("f2")
        driver.post(pygame.DROPFILE, file=str(path))
        driver.settle()
        assert driver.window.lesson.player is None
        opened = driver.session
        assert opened is not session
        driver.press_key("escape")
        assert driver.session is opened
        driver.press_key("f2")
        save_map(HALL, tmp_path / "hall.json")
        driver.post(pygame.DROPFILE, file=str(tmp_path / "hall.json"))
        driver.settle()
        assert driver.window.lesson.player is None
        assert driver.session is opened
        assert driver.viewer.message.startswith("Map opened")


def test_a_file_that_cannot_be_opened_does_not_end_the_lesson(tmp_path: Path) -> None:
    path = tmp_path / "broken.json"
    path.write_text("{}")
    with open_viewer(tmp_path) as driver:
        driver.press_key("f2")
        driver.post(pygame.DROPFILE, file=str(path))
        driver.settle()
        assert driver.viewer.has_error_message
        assert driver.window.lesson.player is not None


def test_a_lesson_that_is_opened_is_played_by_f2_and_saved_with_its_chapters(tmp_path: Path) -> None:
    path = write_short_lesson(tmp_path)
    chapters = json.loads(path.read_text())["lesson"]
    with open_viewer(tmp_path) as driver:
        driver.viewer.files.open_file(path)
        assert driver.viewer.message == f"Session opened: {path}. F2 plays its lesson."
        driver.session.add_robot((1.0, 1.0))
        driver.press_key("ctrl+s")
        assert json.loads(path.read_text())["lesson"] == chapters
        driver.press_key("f2")
        lesson = driver.window.lesson.player
        assert lesson is not None
        assert lesson.lesson.title == "Two"


def test_chapters_on_bundled_maps_have_their_names(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.press_key("f2")
        assert driver.viewer.files.map_name == "rooms"
        assert driver.viewer.files.title == "Rooms • robocov"


def shorten_reading_times(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(player, "READING_S", 0.1)
    monkeypatch.setattr(player, "READING_S_PER_WORD", 0.0)


def test_an_own_lesson_becomes_a_video(tmp_path: Path, monkeypatch, capsys) -> None:
    shorten_reading_times(monkeypatch)
    path = write_short_lesson(tmp_path)
    video = tmp_path / "two.mp4"
    assert main(["demo", "--lesson", str(path), "--video", str(video), "--size", "900x600"]) == 0
    assert video.stat().st_size > 0
    assert f"saved {video}" in capsys.readouterr().out


def test_a_lesson_shows_no_branches_of_other_chapters(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.press_key("f2")
        driver.run_frames(3)
        assert driver.window.lesson.player is not None
        assert driver.window.chart.branch_lines == []


def test_a_lesson_can_be_paused_left_and_resumed(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        lesson = driver.window.lesson.player
        driver.press_key("space")
        assert lesson.state == "playing"
        assert not driver.viewer.session.playback.is_playing
        driver.run_frames(60)
        assert lesson.number == 0
        assert driver.viewer.session.displayed.time < 0.1
        driver.press_key("n")
        assert lesson.state == "left"
        assert driver.window.lesson.player is lesson
        driver.press_key("f2")
        assert lesson.state == "playing"
        assert driver.viewer.session.displayed.time == 0.0
        driver.press_key("right")
        assert lesson.number == 1
        driver.press_key("left")
        assert lesson.number == 0


def test_curves_of_branches_are_hidden_while_a_question_is_open(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        guide = driver.window.lesson
        guide.is_unattended = False
        guide.start(write_short_lesson(tmp_path, task=None))
        driver.press_key("right")
        assert guide.player is not None
        for _ in range(2):
            driver.run_frames(1)
            assert not driver.window.chart.ghosts
            driver.press_key("2")
            driver.run_frames(30)
            assert guide.player.state == "ended"
            guide.player.show_chapter(1)
        # The user takes over, and sees the curve of the chapter that has just been played.
        driver.press_key("f2")
        driver.run_frames(10)
        assert driver.window.chart.ghosts


@pytest.mark.parametrize("command", ["share", "share:command", "share:copy", "screenshot"])
def test_a_lesson_continues_after_sharing(command: str, tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        driver.window.run_command(command)
        driver.window.dialogs.close()
        assert driver.window.lesson.shown is not None
        time = driver.session.displayed.time
        driver.run_frames(10)
        assert driver.session.displayed.time > time


def test_answers_and_chapters_are_clicked(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        driver.window.lesson.is_unattended = False
        driver.window.lesson.start(write_short_lesson(tmp_path))
        lesson = driver.window.lesson.player
        assert lesson is not None
        driver.settle()
        driver.click(*driver.window.lesson.click_areas[1][0].center)
        assert (lesson.number, lesson.state) == (1, "asking")
        driver.press_key("space")
        driver.run_frames(10)
        assert driver.session.displayed.time == 0.0
        assert "Answer first" in driver.viewer.message
        driver.click(*driver.window.lesson.click_areas[1][0].center)
        assert (lesson.answer, lesson.state) == (2, "playing")
        driver.run_frames(30)
        assert lesson.state == "task"
        driver.press_key("f2")
        assert lesson.state == "left"
        assert not driver.window.lesson.click_areas
        driver.press_key("f2")
        assert lesson.state == "asking"


@pytest.mark.parametrize("size", [(900, 600), (1280, 720)])
def test_every_chapter_fits_on_its_page(tmp_path: Path, size: tuple[int, int]) -> None:
    with open_viewer(tmp_path, size=size) as driver:
        driver.window.lesson.is_unattended = False
        driver.press_key("f2")
        lesson = driver.window.lesson.player
        assert lesson is not None
        for _ in LESSON.chapters:
            driver.settle()
            boxes = [area.box for area in driver.window.lesson.click_areas]
            panel = pygame.Rect(driver.window.layout.panel)
            assert all(panel.contains(box) for box in boxes)
            for first, second in itertools.combinations(boxes, 2):
                overlap = first.clip(second)
                assert min(overlap.size) <= 1
            driver.press_key("right")


def test_closing_the_window_restores_the_session(tmp_path: Path) -> None:
    with open_viewer(tmp_path) as driver:
        session = driver.session
        shown = set(driver.viewer.view.layers)
        driver.window.lesson.start(write_short_lesson(tmp_path, show=["distances"]))
        driver.press_key("right")
        driver.window.close()
        assert driver.window.lesson.player is None
        assert driver.session is session
        assert driver.viewer.view.layers == shown


def test_answers_use_the_controller_names_of_the_window() -> None:
    questions = [chapter.question for chapter in LESSON.chapters if chapter.question]
    answers = {answer for question in questions for answer in question.answers}
    assert "LA" not in answers
    assert answers >= {"RAPF", "RPF", "Lloyd"}


def play_unattended_lesson(driver: Driver, path: Path) -> Iterator[LessonPlayer]:
    """Yield the lesson after each frame, until it has ended or its maximum duration is over."""
    driver.window.lesson.is_unattended = True
    driver.window.lesson.start(path)
    lesson = driver.window.lesson.player
    assert lesson is not None
    for _ in range(round(lesson.duration * HEADLESS_FPS)):
        driver.run_frames(1)
        if driver.window.lesson.player is None:
            return
        yield lesson


def test_an_unattended_lesson_plays_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shorten_reading_times(monkeypatch)
    with open_viewer(tmp_path) as driver:
        list(play_unattended_lesson(driver, write_short_lesson(tmp_path)))
        assert driver.window.lesson.player is None


def test_an_unattended_lesson_shows_its_closing_page_without_a_score(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shorten_reading_times(monkeypatch)
    with open_viewer(tmp_path) as driver:
        states = []
        for lesson in play_unattended_lesson(driver, write_short_lesson(tmp_path)):
            states.append(lesson.state)
            assert lesson.score == (0, 0)
        assert states[-1] == "closing"
        assert states.count("closing") > 1


def test_an_unattended_lesson_shows_its_task_as_open(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shorten_reading_times(monkeypatch)
    with open_viewer(tmp_path) as driver:
        lines = []
        for lesson in play_unattended_lesson(driver, write_short_lesson(tmp_path)):
            lines += lesson.lines
        assert "Your turn: drag robot 1." in lines
        assert "Well done." not in lines


def test_a_chapter_that_ends_before_its_edit_is_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_short_lesson(tmp_path)
    content = json.loads(path.read_text())
    content["lesson"]["chapters"][0]["until"] = {"step": 15}
    path.write_text(json.dumps(content))
    assert main(["lesson", "check", str(path)]) != 0
    message = (
        "two.robocov: lesson.chapters[0].until: "
        "expected an end after step 20 of edit 1 (robot 2 failed), got step 15"
    )
    assert message in capsys.readouterr().err


def test_the_command_checks_a_lesson(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lesson", "check", str(write_short_lesson(tmp_path))]) == 0
    assert "1  Failure" in capsys.readouterr().out
    never = write_short_lesson(tmp_path, until={"robot": 1, "inside": [50, 50, 51, 51]})
    path = tmp_path / "plain.robocov"
    content = json.loads(never.read_text())
    del content["lesson"]
    path.write_text(json.dumps(content))
    with pytest.raises(MapError, match="lesson: missing, expected an object with the chapters"):
        load_lesson(path)
    content = json.loads(never.read_text())
    content["lesson"]["chapters"][0]["edit"] = 9
    path.write_text(json.dumps(content))
    with pytest.raises(MapError, match=r"lesson\.chapters\[0\]\.edit: expected the index of an edit, 0 to 2"):
        load_lesson(path)


@pytest.mark.parametrize(
    ("place", "value", "message"),
    [
        (("robot",), 99, r"\.robot: expected a robot of the session, 1 to \d+, got 99"),
        (("until",), {}, r"\.until: expected \"step\", \"settled\".*, got \{\}"),
        (("until",), {"robot": 1}, r"\.until: expected .* \"robot\" with \"inside\""),
        (("until",), {"inside": [0, 0, 1, 1]}, r"\.until: expected .* \"robot\" with \"inside\""),
        (
            ("until",),
            {"robot": 1, "inside": [3, 0, 1, 1]},
            r"\.until\.inside: expected \[left, bottom, right, top\]",
        ),
        (
            ("task",),
            {"text": "Drag it.", "until": {"robot": 99, "outside": [0, 0, 1, 1]}},
            r"\.task\.until\.robot: expected a robot",
        ),
        (
            ("question",),
            {"text": "Which?", "answers": ["A", "B"], "right": 3},
            r"\.question\.right: expected the number of an answer, 1 to 2, got 3",
        ),
        (("title",), "", r"\.title: expected at least 1 character, got \"\""),
        (("show",), ["goal"], r"chapters\[0\]\.show: unknown layer 'goal': did you mean 'goals'"),
    ],
)
def test_a_chapter_that_cannot_work_is_rejected(
    place: tuple[str], value: object, message: str, tmp_path: Path
) -> None:
    path = write_short_lesson(tmp_path)
    content = json.loads(path.read_text())
    content["lesson"]["chapters"][0][place[0]] = value
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match=message):
        load_lesson(path)


def test_followed_edits_repeat_bit_for_bit() -> None:
    session = advance_session(start_session(), 10)
    session.playback.is_playing = True
    for k in range(10):
        session.drag_robot(2, (3.0 + 0.05 * k, 3.0))
        session.playback.advance(1 / 60)
    session.release()
    advance_session(session, 10)
    end = session.timeline.step
    end_positions = session.timeline.panes[0].simulation.positions.copy()
    twin = Session(session.timeline.document.nodes[0].scenario)
    twin.timeline.document = session.timeline.document
    twin.timeline.head = session.timeline.document.nodes[0]
    twin.seek(twin.timeline.head, 0)
    twin.timeline.finish_seek()
    twin.timeline.follow(session.timeline.head)
    while twin.timeline.step < end:
        twin.playback.step()
    np.testing.assert_array_equal(twin.timeline.panes[0].simulation.positions, end_positions)


def test_followed_edits_at_time_0_are_repeated() -> None:
    session = start_session()
    session.fail_robot(2)
    session.fail_robot(3)
    advance_session(session, 10)
    end = session.timeline.head
    root = session.timeline.document.get_path(end)[0]
    session.seek(root, 0)
    session.timeline.finish_seek()
    assert session.displayed.numbers == (1, 2, 3)
    session.timeline.follow(end)
    assert session.displayed.numbers == (1,)
    advance_session(session, 10)
    assert session.timeline.head is end
    assert session.displayed.numbers == (1,)


def test_texts_of_the_lesson_use_the_words_of_the_chart() -> None:
    """A reader of *cost* would look for a chart of the cost, and phones have no chart *below*."""
    assert LESSON is not None
    for chapter in LESSON.chapters:
        texts = [chapter.text]
        if chapter.question is not None:
            texts += [chapter.question.text, chapter.question.why]
        if chapter.task is not None:
            texts += [chapter.task.text, chapter.task.done]
        assert not re.search(r"\b(cost|below\.)", " ".join(texts)), chapter.title
    assert "RAPF, the repulsive and attractive potential field" in LESSON.chapters[0].text
