"""Lessons: files are checked, chapters wait for the simulation, ask, hand over, and give the session back."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from touched_run import begun

from robocov.errors import MapError
from robocov_app.cli import main
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.lessons import FIRST, Player, lesson_schema, load_lesson
from robocov_app.viewer.presenter import Desk

LESSON = load_lesson()


def content() -> dict:
    return json.loads(FIRST.read_text(encoding="utf-8"))


def written_to(path: Path, chapters: list[dict]) -> Path:
    path.write_text(json.dumps({**content(), "chapters": chapters}), encoding="utf-8")
    return path


def chapter(*steps: dict, **changes: object) -> dict:
    return {"title": "one", "text": "One. Two.", "touch": 1, "steps": list(steps), **changes}


def wait(seconds: float) -> dict:
    return {"do": "wait", "until": {"seconds": seconds}}


ASK = {"do": "ask", "question": "Which?", "answers": ["a", "b"], "right": 2, "because": "so it is."}
TASK = {"do": "task", "text": "Drag it.", "until": {"robot": 2, "inside": [4, 4, 6, 6]}, "solution": 2}


class Played:
    """A lesson on a desk, frame by frame."""

    def __init__(self, path: Path, *chapters: dict, unattended: bool = False) -> None:
        lesson = load_lesson(written_to(path / "mine.json", list(chapters))) if chapters else LESSON
        self.desk = Desk(begun(), Costs(4, direct=True), {"cells"}, Path(), "hall")
        self.desk.session.clock.budget = np.inf
        self.fits = 0
        self.player = Player(self.desk, self._fit, lesson, unattended=unattended)

    def _fit(self) -> None:
        self.fits += 1

    def play(self, seconds: float) -> None:
        """Let so many seconds pass in frames of a tenth."""
        for _ in range(round(10 * seconds)):
            if self.player.done:
                return
            self.player.advance(0.1)
            self.desk.session.advance(0.1)


@pytest.mark.parametrize("k", range(len(LESSON.chapters)))
def test_chapters_of_the_first_lesson_say_two_to_four_sentences(k: int) -> None:
    each = LESSON.chapters[k]
    assert len(re.findall(r"[.!?](?= |$)", each.text)) in (2, 3, 4)
    assert len(each.title) <= 44 and not each.title.endswith(".")


def test_time_on_the_wall_does_not_move_a_chapter_on(tmp_path: Path) -> None:
    played = Played(tmp_path, chapter(wait(2.0)), chapter(wait(1.0)))
    played.player.advance(1000.0)
    assert played.player.number == 0
    played.play(1.8)
    assert played.player.number == 0
    played.play(0.4)
    assert played.player.number == 1 and played.fits == 2


def test_a_paused_lesson_waits(tmp_path: Path) -> None:
    played = Played(tmp_path, chapter(wait(1.0)))
    played.desk.session.playing = False
    played.play(3.0)
    assert not played.player.done


@pytest.mark.parametrize(("answer", "begins"), [(2, "Right: "), (1, "No, b: ")])
def test_a_question_pauses_until_it_is_answered(tmp_path: Path, answer: int, begins: str) -> None:
    played = Played(tmp_path, chapter(ASK, wait(1.0)))
    played.play(3.0)
    assert played.desk.session.end == 0.0 and played.player.text == "Which? 1 a; 2 b."
    assert played.player.answer(3) is None
    assert played.player.answer(answer) is (answer == 2)
    assert played.player.text == begins + "so it is. One. Two."
    played.play(1.2)
    assert played.player.done


def test_a_task_is_over_when_it_has_been_done(tmp_path: Path) -> None:
    played = Played(tmp_path, chapter(TASK | {"solution": None}, wait(9.0)))
    played.play(0.3)
    assert played.player.task is not None and played.player.text == "Drag it."
    played.desk.session.place(2, (5.0, 5.0))
    played.player.advance(0.0)
    assert played.player.task is None and not played.player.done


def test_the_session_from_before_is_there_again(tmp_path: Path) -> None:
    played = Played(tmp_path)
    before = played.desk.workspace.session
    touches = len(before.document.nodes)
    played.play(0.3)
    played.player.choose(7)
    assert played.desk.session is not before and played.player.title == "8  A robot fails"
    serial = played.desk.session.serial
    played.player.end()
    assert played.desk.session is before and len(before.document.nodes) == touches
    assert played.desk.shown == {"cells"} and played.desk.map_name == "hall" and before.serial > serial


def test_skipping_goes_both_ways_and_past_the_last_to_the_end(tmp_path: Path) -> None:
    played = Played(tmp_path)
    played.player.skip(1)
    played.player.skip(-1)
    played.player.skip(-1)
    assert played.player.number == 0
    for _ in LESSON.chapters:
        played.player.skip(1)
    assert played.player.done


def test_a_chapter_is_the_same_again(tmp_path: Path) -> None:
    played = Played(tmp_path)
    ends = []
    for _ in range(2):
        played.player.choose(7)
        played.play(9.5)
        assert 2 in played.desk.session.lanes[0].circumstances.failed
        ends.append(played.desk.session.lanes[0].simulation.positions.copy())
    assert (ends[0] == ends[1]).all()


def test_unattended_questions_and_tasks_are_shown(tmp_path: Path) -> None:
    place = chapter(ASK, {**TASK, "solution": 14, "until": {"robot": 6, "outside": [3.7, 2.1, 8.5, 7.9]}})
    played = Played(tmp_path, {**place, "touch": 8}, unattended=True)
    played.play(6.0)
    assert played.player.task is not None and played.player.told == ""
    played.play(6.0)
    assert played.player.done and not played.desk.trouble


@pytest.mark.slow
def test_all_of_it_plays_by_itself(tmp_path: Path) -> None:
    played, seen = Played(tmp_path, unattended=True), []
    while not played.player.done:
        if played.player.title not in seen:
            seen.append(played.player.title)
        played.play(0.1)
        assert not played.desk.trouble, played.desk.message
    assert len(seen) == len(LESSON.chapters)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (chapter(wait(1.0), touch=99), r"chapters\[0\]\.touch: 99, but a touch from 0 to 14 was wanted"),
        (chapter(wait(-1.0)), r"chapters\[0\]\.steps\[0\]\.until\.seconds"),
        (chapter(wait(1.0), show=["nothing"]), r"chapters\[0\]\.show\[0\]: \"nothing\""),
        (chapter(ASK | {"right": 3}), r"steps\[0\]\.right: 3, but an answer from 1 to 2"),
        (chapter({"do": "wait", "until": {}}), r"until: .*condition"),
        (chapter({"do": "wait", "until": {"inside": [0, 0, 1, 1]}}), r"until: `robot` was wanted"),
        (chapter({"do": "touch", "touch": 99}), r"steps\[0\]\.touch: 99"),
        (chapter(wait(1.0), more=1), r"chapters\[0\].*more.*unknown key"),
    ],
)
def test_mistakes_are_told_with_their_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wrong: dict, words: str
) -> None:
    path = written_to(tmp_path / "mine.json", [wrong])
    with pytest.raises(MapError, match=words):
        load_lesson(path)
    assert main(["lesson", "check", str(path)]) == 2
    assert str(path) in capsys.readouterr().err


def test_a_mistake_in_the_session_is_told(tmp_path: Path) -> None:
    wrong = content()
    wrong["session"]["touches"][3]["parent"] = 9
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(wrong), encoding="utf-8")
    with pytest.raises(MapError, match=r"session.*parent"):
        load_lesson(path)


def test_check_lists_the_chapters(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lesson", "check", str(FIRST)]) == 0
    assert "10 chapters" in capsys.readouterr().out
    assert main(["lesson", "check", str(FIRST), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["chapters"]) == 10
    assert lesson_schema()["title"] == "robocov lesson"
