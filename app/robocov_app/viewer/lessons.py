"""Lessons: session files with chapters that wait for the simulation, ask, hand over, and go on."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from robocov.errors import MapError, Mistake
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.file import SavedSession, load_session
from robocov_app.viewer.session.file_models import ChapterModel, ConditionModel
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.workspace import SessionWorkspace

FIRST = Path(__file__).with_name("assets") / "lesson-1.robocov"  # the lesson that comes with robocov
READING = 4.0  # seconds on the wall after a chapter's end, and for an answer where nobody answers
LONGEST_TASK = 600.0  # seconds of simulation after which `check` gives a task up
PLAIN = {  # layers that every chapter shows
    *("cells", "grid", "obstacles", "boundary", "trajectories", "starts", "robots", "failed"),
    *("selection", "color_bar", "legend", "scale_bar", "status", "caption"),
}


def load_lesson(path: Path = FIRST) -> SavedSession:
    """Return the lesson in a session file; MapError as `load_session`, or where there is none in it."""
    saved = load_session(path)
    if saved.lesson is None:
        raise MapError.from_mistakes(str(path), [Mistake.at_path(("lesson",), "missing")])
    return saved


def holds(condition: ConditionModel, session: Session) -> bool:
    pane = session.timeline.panes[0]
    reached = condition.step is not None and session.timeline.step >= condition.step
    if reached or (condition.settled and session.timeline.is_settled):
        return True
    if condition.mean_distance_below is not None and len(pane.distance_curve):
        return bool(pane.distance_curve.values[-1] < condition.mean_distance_below)
    if condition.robot is None or (row := pane.get_row(condition.robot)) is None:
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
        self.lesson, self._viewer, self._fit = saved.lesson, viewer, fit
        self.alone = alone  # nobody is there to answer or to do tasks, as in a film
        self._before = viewer.workspace, viewer.map_name, viewer.shown, viewer.tool, viewer.active
        self._asked_before, self.session = viewer.hand.selected, _begun(saved)
        self.session.playback.clock.budget = viewer.session.playback.clock.budget
        self._workspace = SessionWorkspace(self.session, None)
        self.state = "plays"  # or asks, task, ended, left
        self.answer: int | None = None  # from 1
        self.done = self.held = False
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
            lines.append("Now you: " + chapter.task.text if self.state == "task" else chapter.task.done)
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
        part = min(self.session.timeline.step / end, 1.0) if end else 0.5
        return (self.number + (1.0 if self.state == "ended" else part)) / len(self.lesson.chapters)

    def advance(self, seconds: float) -> None:
        if self.done or self.state == "left":
            return
        session, chapter = self.session, self.chapter
        self._waited += seconds
        reading = READING + (0.0 if self.alone else 0.25 * len(" ".join(self.asks).split()))
        if self.state == "asks" and self.alone and self._waited >= READING:
            assert chapter.question is not None
            self.reply(chapter.question.right)
        elif self.state == "plays" and holds(chapter.until, session):
            tries = chapter.task is not None and not self.alone
            self._turn("task" if tries else "ended")
            session.playback.is_playing = session.playback.is_playing and tries
        elif self.state == "task" and chapter.task is not None and holds(chapter.task.until, session):
            self._turn("ended")
        elif self.state == "ended" and self._waited >= reading and not self.held:
            self.skip(1)

    def reply(self, answer: int) -> None:
        question = self.chapter.question
        if self.state == "asks" and question is not None and 1 <= answer <= len(question.answers):
            self.answer = answer
            self._turn("plays")
            self.session.playback.is_playing = True

    def skip(self, by: int) -> None:
        if self.number + by >= len(self.lesson.chapters):
            self.end()
        else:
            self._begin(max(self.number + by, 0))

    def leave(self, *, task: bool = False) -> None:
        """Let whoever watches play with what is there; a `task` is left only where that is asked for."""
        if task or self.state != "task":
            self._turn("left")

    def end(self) -> None:
        viewer = self._viewer
        self._workspace.close()
        viewer.workspace, map_name, viewer.shown, viewer.tool, viewer.active = self._before
        viewer.show_session(viewer.workspace.session)
        viewer.map_name, viewer.hand.selected = map_name, self._asked_before
        viewer.say("the lesson has ended; what was before it is there again")
        self._fit()
        self.done = True

    def hold(self) -> str:
        """Let a chapter that has ended stay, or let the next one come; return words for it."""
        self.held, self.session.playback.is_playing = not self.held, False
        return "this chapter stays until Space or →" if self.held else "on to the next chapter"

    def _turn(self, state: str) -> None:
        self.state, self._waited, self.held = state, 0.0, False
        self._viewer.version += 1

    def _begin(self, number: int) -> None:
        self.number, self.answer = number, None
        chapter, viewer, session = self.chapter, self._viewer, self.session
        _set_out(session, chapter)
        session.playback.is_playing, session.playback.stop_when_settled = chapter.question is None, False
        session.playback.clock.speed, viewer.workspace = chapter.speed, self._workspace
        viewer.show_session(session)
        viewer.map_name = session.displayed.environment.name
        viewer.tool, viewer.active, viewer.hand.selected = viewer.hand, 0, chapter.robot
        viewer.shown, viewer.message = PLAIN | set(chapter.show), ""
        self._fit()
        self._turn("asks" if chapter.question is not None else "plays")


def _set_out(session: Session, chapter: ChapterModel) -> None:
    target = session.timeline.document.nodes[chapter.touch]
    session.seek(session.timeline.document.get_path(target)[0], 0)
    session.timeline.finish_seek()
    session.timeline.follow(target)


def _begun(saved: SavedSession) -> Session:
    return Session.open(replace(saved, head=saved.document.nodes[0], step=0))


def checked(saved: SavedSession) -> list[tuple[str, float, bool]]:
    """Play a lesson without a window: title, simulated seconds, and whether it ended, of each chapter."""
    assert saved.lesson is not None
    session, found = _begun(saved), []
    for chapter in saved.lesson.chapters:
        _set_out(session, chapter)
        while not (ended := holds(chapter.until, session)) and session.timeline.end_time < LONGEST_TASK:
            session.playback.step()
        found.append((chapter.title, session.timeline.end_time, ended))
    return found
