"""Lessons: session files with chapters that wait for the simulation, ask, hand over, and go on.

A chapter does again what was done on the way to a touch of the session. It may ask for a prediction before,
and hand a task over afterwards. It ends by conditions of the simulation, however slow the machine is.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

from robocov.errors import MapError, Mistake
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.file import (
    ChapterModel,
    ConditionModel,
    SavedSession,
    load_session,
    session_of,
)
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.workspace import Workspace

FIRST = "lesson-1.robocov"  # the lesson that comes with robocov
READING = 4.0  # seconds on the wall after a chapter's end, and for an answer where nobody answers
LONGEST_TASK = 600.0  # seconds of simulation after which `check` gives a task up

# layers that every chapter shows
PLAIN = {
    *("cells", "grid", "obstacles", "boundary", "trajectories", "starts", "robots", "failed"),
    *("selection", "colour_bar", "legend", "scale_bar", "status", "caption"),
}


def first_lesson() -> SavedSession:
    text = files("robocov_app.viewer").joinpath("assets", FIRST).read_text(encoding="utf-8")
    return session_of(json.loads(text), FIRST)


def load_lesson(path: Path) -> SavedSession:
    """Return the lesson in a session file; MapError as `load_session`, or where there is none in it."""
    saved = load_session(path)
    if saved.lesson is None:
        raise MapError.of(str(path), [Mistake.at(("lesson",), "missing")])
    return saved


def holds(condition: ConditionModel, session: Session) -> bool:
    pane = session.panes[0]
    if condition.step is not None and session.step_now >= condition.step:
        return True
    if condition.settled and session.settled:
        return True
    if condition.mean_distance_below is not None and len(pane.curve):
        return bool(pane.curve.value[-1] < condition.mean_distance_below)
    if condition.robot is None or (row := pane.row(condition.robot)) is None:
        return False
    place, inside, outside = pane.simulation.positions[row], condition.inside, condition.outside

    def within(box: list[float]) -> bool:
        return bool((box[:2] <= place).all() and (place <= box[2:]).all())

    return (inside is not None and within(inside)) or (outside is not None and not within(outside))


class LessonPlayer:
    """Plays the chapters of a lesson, and then gives the session from before back."""

    def __init__(
        self, viewer: Presenter, fit: Callable[[], None], saved: SavedSession, *, alone: bool = False
    ) -> None:
        assert saved.lesson is not None
        self.lesson = saved.lesson
        self._viewer, self._fit = viewer, fit
        self.alone = alone  # nobody is there to answer or to do tasks, as in a film
        self._before = viewer.workspace, viewer.map_name, viewer.shown, viewer.tool, viewer.active
        self._asked_before = viewer.hand.selected
        self.session = _begun(saved)
        self.session.clock.budget = viewer.session.clock.budget
        self._workspace = Workspace(self.session, None)
        self.number, self.done = 0, False
        self.state = "plays"  # or asks, task, ended, left
        self.answer: int | None = None  # from 1
        self._waited = 0.0
        self.held = False
        self._begin(0)

    @property
    def chapter(self) -> ChapterModel:
        return self.lesson.chapters[self.number]

    @property
    def asks(self) -> list[str]:
        chapter = self.chapter
        question, lines = chapter.question, []
        if question is not None and self.state == "asks":
            lines = [question.text, *(f"{k}  {each}" for k, each in enumerate(question.answers, 1))]
        elif question is not None and self.state == "ended" and self.answer is not None:
            right = question.answers[question.right - 1]
            lines = [f"{'Right' if self.answer == question.right else 'Not quite'}: {right}", question.why]
        if chapter.task is not None and self.state in ("task", "ended"):
            lines += ["Now you: " + chapter.task.text if self.state == "task" else chapter.task.done]
        return [line for line in lines if line]

    @property
    def seconds(self) -> float:
        return sum(
            (each.until.step or 0) / 60 / each.speed + READING * (2 if each.question else 1) + 0.5
            for each in self.lesson.chapters
        )

    @property
    def progress(self) -> float:
        end = self.chapter.until.step
        part = min(self.session.step_now / end, 1.0) if end else 0.5
        return (self.number + (1.0 if self.state == "ended" else part)) / len(self.lesson.chapters)

    def advance(self, seconds: float) -> None:
        if self.done or self.state == "left":
            return
        session, chapter = self.session, self.chapter
        self._waited += seconds
        if self.state == "asks" and self.alone and self._waited >= READING:
            assert chapter.question is not None
            self.reply(chapter.question.right)
        elif self.state == "plays" and holds(chapter.until, session):
            if chapter.task is not None and not self.alone:
                self._turn("task")
            else:
                self._turn("ended")
                session.playing = False
        elif self.state == "task" and chapter.task is not None and holds(chapter.task.until, session):
            self._turn("ended")
        elif self.state == "ended" and self._waited >= self._reading and not self.held:
            self.skip(1)

    @property
    def _reading(self) -> float:
        """Seconds until the next chapter: longer where somebody has an answer to read."""
        return READING + (0.0 if self.alone else 0.25 * len(" ".join(self.asks).split()))

    def reply(self, answer: int) -> None:
        question = self.chapter.question
        if self.state == "asks" and question is not None and 1 <= answer <= len(question.answers):
            self.answer = answer
            self._turn("plays")
            self.session.playing = True

    def skip(self, by: int) -> None:
        if self.number + by >= len(self.lesson.chapters):
            self.end()
        else:
            self._begin(max(self.number + by, 0))

    def leave(self, *, task: bool = False) -> None:
        """Let whoever watches play with what is there; a `task` is left only where that is asked for."""
        if task or self.state != "task":
            self._turn("left")

    def leave_or_come_back(self) -> None:
        if self.state == "left":
            self._begin(self.number)
        else:
            self.leave(task=True)

    def end(self) -> None:
        viewer = self._viewer
        self._workspace.close()
        viewer.workspace, map_name, viewer.shown, viewer.tool, viewer.active = self._before
        viewer.show_session(viewer.workspace.session)
        viewer.map_name = map_name
        viewer.hand.selected = self._asked_before
        viewer.say("the lesson has ended; what was before it is there again")
        self._fit()
        self.done = True

    def hold(self) -> str:
        """Let a chapter that has ended stay, or let the next one come; return words for it."""
        self.held, self.session.playing = not self.held, False
        return "this chapter stays until Space or →" if self.held else "on to the next chapter"

    def _turn(self, state: str) -> None:
        self.state, self._waited, self.held = state, 0.0, False
        self._viewer.version += 1

    def _begin(self, number: int) -> None:
        self.number, self.answer = number, None
        chapter, viewer, session = self.chapter, self._viewer, self.session
        _set_out(session, chapter)
        session.playing, session.stop_when_settled = chapter.question is None, False
        session.clock.speed = chapter.speed
        viewer.workspace = self._workspace
        viewer.show_session(session)
        viewer.map_name = session.environment.name
        viewer.tool, viewer.active = viewer.hand, 0
        viewer.hand.selected = chapter.robot
        viewer.shown = PLAIN | set(chapter.show)
        viewer.message = ""
        self._fit()
        self._turn("asks" if chapter.question is not None else "plays")


def _set_out(session: Session, chapter: ChapterModel) -> None:
    """Go to the beginning of a chapter's branch; what was done on its way will be done again."""
    target = session.document.nodes[chapter.touch]
    session.enter(session.document.path(target)[0], 0)
    session.remake()
    session.follow(target)


def _begun(saved: SavedSession) -> Session:
    return Session.opened(replace(saved, head=saved.document.nodes[0], step=0))


def checked(saved: SavedSession) -> list[tuple[str, float, bool]]:
    """Play a lesson without a window: title, simulated seconds, and whether it ended, of each chapter."""
    assert saved.lesson is not None
    session = _begun(saved)
    found = []
    for chapter in saved.lesson.chapters:
        _set_out(session, chapter)
        while not (ended := holds(chapter.until, session)) and session.end < LONGEST_TASK:
            session.step()
        found.append((chapter.title, session.end, ended))
    return found
