"""Playing of lessons: session files with chapters that play, ask questions, and set tasks."""

import math
from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.defaults import DEFAULT_LATTICE
from robocov.environment import Environment
from robocov.errors import Issue, MapError
from robocov_app.render.layer_catalog import check_layer_names
from robocov_app.viewer.key_hints import explain_kept_edits, explain_lesson_repetition
from robocov_app.viewer.lessons.suspended_session import SuspendedSession
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.files.maps import find_bundled_name
from robocov_app.viewer.session.files.models import (
    ChapterModel,
    ConditionModel,
    LessonModel,
    QuestionModel,
    TaskModel,
)
from robocov_app.viewer.session.files.session_file import SavedSession, load_session
from robocov_app.viewer.session.files.workspace import SessionWorkspace
from robocov_app.viewer.session.session import Session

FIRST_LESSON = Path(__file__).with_name("assets") / "lesson-1.robocov"  # bundled with robocov
READING_S = 4.0
"""Real time in an unattended window for a question, the end of a chapter, and the closing page."""
READING_S_PER_WORD = 0.25
"""Real time added for each word of what there is to read."""
_CHAPTER_CHANGE_S = 0.5  # real time between two chapters, as a margin of the duration
MAX_TASK_S = 600.0  # simulated time after which `check_lesson` gives up on a chapter
_DISTANCE_INTERVAL_S = 0.5  # simulated time between the mean distances that `check_lesson` computes
STEPS_PER_SECOND = 60
_DEFAULT_NEXT_STEPS = (
    "End the lesson, then draw a wall (W) and see how the robots react.",
    "Let a robot fail (D), and watch its neighbors.",
    "Compare two controllers on a map of your own (K).",
)
BASE_LAYERS = frozenset(
    {
        "cells",
        "grid",
        "obstacles",
        "boundary",
        "trajectories",
        "starts",
        "robots",
        "failed",
        "selection",
        "color_bar",
        "legend",
        "scale_bar",
        "status",
        "caption",
    }
)
"""Layers that every chapter shows."""


class LessonState(StrEnum):
    """State of a chapter."""

    PLAYING = "playing"
    ASKING = "asking"  # waits for an answer before the chapter plays
    TASK = "task"  # waits until the user has done a task
    ENDED = "ended"  # waits until the user goes to another chapter
    CLOSING = "closing"  # the closing page, after the last chapter
    LEFT = "left"  # the user has taken over


class AnswerMark(StrEnum):
    """Mark of an answer to the question of a chapter."""

    NONE = ""
    CHOSEN = "chosen"  # by the user, as long as the chapter plays
    RIGHT = "right"
    WRONG = "wrong"  # chosen by the user


@dataclass(frozen=True)
class MarkedAnswer:
    """An answer to the question of a chapter, with its mark.

    Attributes
    ----------
    text : str
    mark : AnswerMark
    """

    text: str
    mark: AnswerMark


def load_lesson(path: Path = FIRST_LESSON) -> SavedSession:
    """Load a session file with a lesson.

    Raises
    ------
    MapError
        If it cannot be read, or has no lesson.
    ParameterError
        If a chapter shows an unknown layer.
    """
    saved = load_session(path)
    if saved.lesson is None:
        message = "missing, expected an object with the chapters of a lesson"
        raise MapError.from_issues(str(path), [Issue.at_path(("lesson",), message)])
    for index, chapter in enumerate(saved.lesson.chapters):
        check_layer_names(f"{path}: lesson.chapters[{index}].show", chapter.show)
    return saved


def list_next_steps(lesson: LessonModel) -> list[str]:
    """Return what to try after a lesson: the suggestions of its author, or else general ones."""
    return lesson.next_steps or list(_DEFAULT_NEXT_STEPS)


def list_skipped_tasks(lesson: LessonModel, done_tasks: Container[int]) -> list[str]:
    """Return a text for each task of a lesson that was not done, with the title of its chapter.

    Parameters
    ----------
    lesson : LessonModel
    done_tasks : container of int
        Indices of the chapters whose task was done.

    Returns
    -------
    list of str
    """
    texts: list[str] = []
    for index, chapter in enumerate(lesson.chapters):
        if chapter.task is not None and index not in done_tasks:
            texts.append(f"Task skipped: {chapter.title}")
    return texts


def is_fulfilled(condition: ConditionModel, session: Session) -> bool:
    """Return whether a session fulfills a condition of a chapter."""
    if condition.step is not None and session.timeline.step >= condition.step:
        return True
    if condition.settled and session.timeline.is_settled:
        return True
    curve = session.timeline.panes[0].distance_curve
    if condition.mean_distance_below is not None and len(curve):
        return bool(curve.values[-1] < condition.mean_distance_below)
    if condition.robot is None:
        return False
    return _is_robot_in_place(condition, session, condition.robot)


def _is_robot_in_place(condition: ConditionModel, session: Session, robot: int) -> bool:
    """Return whether a robot is inside the box `inside` of a condition, or outside its box `outside`."""
    pane = session.timeline.panes[0]
    row = pane.get_row(robot)
    if row is None:
        return False
    position = pane.positions[row]

    def is_within(box: list[float]) -> bool:
        return bool((box[:2] <= position).all() and (position <= box[2:]).all())

    if condition.inside is not None and is_within(condition.inside):
        return True
    return condition.outside is not None and not is_within(condition.outside)


class LessonPlayer:
    """Plays the chapters of a lesson, and at the end restores the session from before the lesson.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    fit_view : callable
        Shows the whole map.
    saved : SavedSession
        A session with a lesson.
    is_unattended : bool
        Whether there is no user who could answer questions and do tasks, as in a video.

    Attributes
    ----------
    lesson : LessonModel
        The lesson.
    session : Session
        The session that the lesson plays.
    number : int
        Index of the current chapter.
    state : LessonState
        State of the current chapter.
    answer : int or None
        Number of the user's answer, from 1.
    first_answers : dict of int to int
        The user's first answer to the question of each chapter, by the index of the chapter.
    done_tasks : set of int
        Indices of the chapters whose task the user has done.
    is_done : bool
        Whether the lesson has ended.
    """

    def __init__(
        self,
        viewer: Presenter,
        fit_view: Callable[[], None],
        saved: SavedSession,
        *,
        is_unattended: bool = False,
    ) -> None:
        """Remember the state of the viewer, and start the first chapter."""
        assert saved.lesson is not None
        self.lesson = saved.lesson
        self.is_unattended = is_unattended
        self.session = _open_at_start(saved)
        self.session.playback.clock.budget = viewer.session.playback.clock.budget
        self.state = LessonState.PLAYING
        self.number = 0
        self.answer: int | None = None
        self.first_answers: dict[int, int] = {}
        self.done_tasks: set[int] = set()
        self.is_done = False
        self._viewer = viewer
        self._fit_view = fit_view
        self._waited_s = 0.0  # real time since the current state was entered
        self._workspace = SessionWorkspace(self.session, viewer.files.draft_folder)
        self._suspended = SuspendedSession(viewer)
        self.show_chapter(0)
        if self._suspended.has_work:
            viewer.show_message("Your session is set aside. It returns when the lesson ends.")

    @property
    def chapter(self) -> ChapterModel:
        """The current chapter."""
        return self.lesson.chapters[self.number]

    @property
    def lines(self) -> list[str]:
        """Texts for the current state: question and answers, comment on the user's answer, task."""
        lines: list[str] = []
        if self.chapter.question is not None:
            lines += self._list_question_lines(self.chapter.question)
        if self.chapter.task is not None:
            lines += _list_task_lines(self.chapter.task, self.state, is_unattended=self.is_unattended)
        return [line for line in lines if line]

    @property
    def marked_answers(self) -> list[MarkedAnswer]:
        """The answers to the question of the chapter; marked once the user has answered."""
        question = self.chapter.question
        if question is None:
            return []
        marked: list[MarkedAnswer] = []
        for number, text in enumerate(question.answers, 1):
            mark = self._mark_answer(number, question.right)
            marked.append(MarkedAnswer(text, mark))
        return marked

    def _mark_answer(self, number: int, right: int) -> AnswerMark:
        is_chosen = number == self.answer
        if self.answer is None:
            return AnswerMark.NONE
        if self.state not in (LessonState.ENDED, LessonState.TASK):
            return AnswerMark.CHOSEN if is_chosen else AnswerMark.NONE
        if number == right:
            return AnswerMark.RIGHT
        return AnswerMark.WRONG if is_chosen else AnswerMark.NONE

    @property
    def comments(self) -> list[str]:
        """Texts below the answers: their explanation, and the task of the chapter."""
        comments: list[str] = []
        question = self.chapter.question
        is_answered = question is not None and self.answer is not None
        if question is not None and is_answered and self.state in (LessonState.ENDED, LessonState.TASK):
            comments.append(question.why)
        if self.chapter.task is not None:
            comments += _list_task_lines(self.chapter.task, self.state, is_unattended=self.is_unattended)
        return [comment for comment in comments if comment]

    @property
    def findings(self) -> list[str]:
        """Findings of the lesson: those given by its author, or else the answers to its questions."""
        if self.lesson.found:
            return list(self.lesson.found)
        questions = [chapter.question for chapter in self.lesson.chapters if chapter.question is not None]
        return [f"{question.text} {question.answers[question.right - 1]}." for question in questions]

    @property
    def score(self) -> tuple[int, int]:
        """Number of questions whose first answer was right, and number of answered questions."""
        right_count = 0
        for index, answer in self.first_answers.items():
            question = self.lesson.chapters[index].question
            if question is not None and answer == question.right:
                right_count += 1
        return right_count, len(self.first_answers)

    def _list_question_lines(self, question: QuestionModel) -> list[str]:
        if self.state is LessonState.ASKING:
            return _format_question(question)
        if self.state is LessonState.ENDED and self.answer is not None:
            if self.answer == question.right:
                return _explain_answer(question)
            return [f"✗ Not quite. Correct: {question.answers[question.right - 1]}", question.why]
        return []

    @property
    def duration(self) -> float:
        """Maximum duration of the lesson in an unattended window, s of real time."""
        duration = _compute_reading_time([*self.findings, *list_next_steps(self.lesson)]) + _CHAPTER_CHANGE_S
        for chapter in self.lesson.chapters:
            simulated_s = MAX_TASK_S
            if chapter.until.step is not None:
                simulated_s = chapter.until.step / STEPS_PER_SECOND
            duration += simulated_s / chapter.speed
            duration += _CHAPTER_CHANGE_S + _compute_reading_time(_list_comments(chapter))
            if chapter.question is not None:
                duration += _compute_reading_time(_format_question(chapter.question))
        return duration

    @property
    def progress(self) -> float:
        """Fraction of the lesson that has been played, 0 to 1."""
        fraction = 0.5
        if self.state in (LessonState.ENDED, LessonState.CLOSING):
            fraction = 1.0
        elif self.chapter.until.step:
            fraction = min(self.session.timeline.step / self.chapter.until.step, 1.0)
        return (self.number + fraction) / len(self.lesson.chapters)

    def advance(self, seconds: float) -> None:
        """Advance by real time, s: a chapter may end; in an unattended window, the next one follows."""
        if self.is_done or self.state is LessonState.LEFT:
            return
        self._waited_s += seconds
        advance_state = {
            LessonState.ASKING: self._advance_question,
            LessonState.PLAYING: self._advance_playing,
            LessonState.TASK: self._advance_task,
            LessonState.ENDED: self._advance_end,
            LessonState.CLOSING: self._advance_closing,
        }
        advance_state[self.state]()

    def _advance_question(self) -> None:
        if self.is_unattended and self._waited_s >= _compute_reading_time(self.lines):
            assert self.chapter.question is not None
            self.reply(self.chapter.question.right)

    def _advance_playing(self) -> None:
        if not is_fulfilled(self.chapter.until, self.session):
            return
        has_task = self.chapter.task is not None and not self.is_unattended
        if has_task:
            self._enter_state(LessonState.TASK)
        else:
            self._enter_state(LessonState.ENDED)
            self.session.playback.is_playing = False

    def _advance_task(self) -> None:
        assert self.chapter.task is not None
        if is_fulfilled(self.chapter.task.until, self.session):
            self.done_tasks.add(self.number)
            self._enter_state(LessonState.ENDED)

    def _advance_end(self) -> None:
        if self.is_unattended and self._waited_s >= _compute_reading_time(self.lines):
            self.skip(1)

    def _advance_closing(self) -> None:
        reading_s = _compute_reading_time([*self.findings, *list_next_steps(self.lesson)])
        if self.is_unattended and self._waited_s >= reading_s:
            self.end()

    def reply(self, answer: int) -> None:
        """Answer the question, and play the chapter; `answer` counts from 1."""
        question = self.chapter.question
        if self.state is not LessonState.ASKING or question is None:
            return
        if 1 <= answer <= len(question.answers):
            self.answer = answer
            if not self.is_unattended:
                self.first_answers.setdefault(self.number, answer)
            self._enter_state(LessonState.PLAYING)
            self.session.playback.is_playing = True

    def skip(self, chapters: int) -> None:
        """Go to the chapter that is `chapters` later, or earlier if negative.

        The closing page follows the last chapter.
        """
        last = len(self.lesson.chapters) - 1
        if self.state is LessonState.CLOSING:
            # The closing page comes after the last chapter.
            number = last + 1 + chapters
        else:
            number = self.number + chapters
        if number <= last:
            self.show_chapter(max(number, 0))
        elif self.state is LessonState.CLOSING:
            self.end()
        else:
            self.number = last
            self.session.playback.is_playing = False
            self._enter_state(LessonState.CLOSING)

    def leave(self, *, during_task: bool = False) -> None:
        """Let the user take over; during a task only if `during_task`."""
        if during_task or self.state is not LessonState.TASK:
            if self.state is not LessonState.LEFT:
                self._workspace.ignore_edits()
            self._enter_state(LessonState.LEFT)

    def _close_workspace(self) -> bool:
        """Keep a draft of what the user has edited after taking over; return whether there is one.

        Edits during the lesson, such as those of its tasks, are not kept.
        """
        if self.state is LessonState.LEFT:
            self._workspace.save_draft(self._viewer.files.view, at_once=True)
        else:
            self._workspace.ignore_edits()
        return self._workspace.close()

    def end(self) -> None:
        """End the lesson, and restore the session from before it."""
        viewer = self._viewer
        keeps_draft = self._close_workspace()
        self._suspended.restore()
        message = f"the lesson has ended; {explain_lesson_repetition(viewer.view)}"
        if self._suspended.has_work:
            message = "the lesson has ended; your previous session is back"
        if keeps_draft:
            message += f". {explain_kept_edits(self._viewer.view)}"
        viewer.show_message(message)
        self._fit_view()
        self.is_done = True

    def _enter_state(self, state: LessonState) -> None:
        self.state = state
        self._waited_s = 0.0
        self._viewer.revision += 1

    def show_chapter(self, number: int) -> None:
        """Show the start of a chapter, by its index: session, layers and selected robot; ask its question."""
        self.number = number
        self.answer = None
        keeps_draft = False
        if self.state is LessonState.LEFT:
            keeps_draft = self._close_workspace()
            self._workspace = SessionWorkspace(self.session, self._viewer.files.draft_folder)
        self._viewer.files.workspace = self._workspace
        _show_start(self._viewer, self.session, self.chapter)
        if keeps_draft:
            self._viewer.show_message(explain_kept_edits(self._viewer.view))
        self._fit_view()
        if self.chapter.question is None:
            self._enter_state(LessonState.PLAYING)
        else:
            self._enter_state(LessonState.ASKING)


def _show_start(viewer: Presenter, session: Session, chapter: ChapterModel) -> None:
    """Show the start of a chapter of a session in the window, with its layers, speed and selected robot."""
    _go_to_start(session, chapter)
    session.playback.is_playing = chapter.question is None
    session.playback.stop_when_settled = False
    session.playback.clock.speed = chapter.speed
    viewer.show_session(session)
    environment = session.displayed.environment
    viewer.files.map_name = find_bundled_name(environment) or environment.name
    viewer.toolbox.current = viewer.toolbox.hand
    viewer.inspection.active_pane = 0
    viewer.inspection.selected = chapter.robot
    viewer.view.layers = set(BASE_LAYERS | check_layer_names("show", chapter.show))
    viewer.clear_message()


def _compute_reading_time(texts: Iterable[str]) -> float:
    """Return the real time for which an unattended window shows texts before it continues, s."""
    return READING_S + READING_S_PER_WORD * len(" ".join(texts).split())


def _list_comments(chapter: ChapterModel) -> list[str]:
    """Return the texts that an unattended window shows at the end of a chapter."""
    comments: list[str] = []
    if chapter.question is not None:
        comments += _explain_answer(chapter.question)
    if chapter.task is not None:
        comments.append(_describe_task(chapter.task))
    return comments


def _format_question(question: QuestionModel) -> list[str]:
    answers = [f"{number}  {answer}" for number, answer in enumerate(question.answers, 1)]
    return [question.text, *answers]


def _explain_answer(question: QuestionModel) -> list[str]:
    return [f"✓ Correct: {question.answers[question.right - 1]}", question.why]


def _list_task_lines(task: TaskModel, state: LessonState, *, is_unattended: bool) -> list[str]:
    if state is LessonState.TASK:
        return [_describe_task(task)]
    if state is LessonState.ENDED:
        # Without a user, the task is not done.
        return [_describe_task(task) if is_unattended else task.done]
    return []


def _describe_task(task: TaskModel) -> str:
    return f"Your turn: {task.text}"


def _go_to_start(session: Session, chapter: ChapterModel) -> None:
    """Go to the start of a chapter's run, and repeat its edits at their times."""
    target = session.timeline.document.nodes[chapter.edit]
    session.seek(session.timeline.document.get_path(target)[0], 0)
    session.timeline.finish_seek()
    session.timeline.follow(target)


def _open_at_start(saved: SavedSession) -> Session:
    return Session.open(replace(saved, head=saved.document.nodes[0], step=0))


class _DistanceSampler:
    """Adds mean distances to the curve of the first pane, as the window does, but at regular intervals.

    Parameters
    ----------
    session : Session
        The session that plays without a window.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._cost: TimeVaryingCost | None = None
        self._environment: Environment | None = None
        self._radius = 0.0

    def update(self) -> None:
        """Add the mean distance at the current step if one is due."""
        timeline = self._session.timeline
        pane = timeline.panes[0]
        curve = pane.distance_curve
        if len(curve) and timeline.end_time < curve.last_time + _DISTANCE_INTERVAL_S:
            return
        result = self._get_cost().evaluate_all_robots(timeline.end_time, pane.positions)
        # Robots at positions that are not free have no cost.
        if result is not None and math.isfinite(result.mean_distance):
            curve.add(timeline.end_time, result.mean_distance)

    def _get_cost(self) -> TimeVaryingCost:
        """Return the cost on the current map; rebuild it if the map or the smallest radius has changed."""
        environment = self._session.displayed.environment
        radius = min(pane.setup.team.min_radius for pane in self._session.timeline.panes)
        if self._cost is None or environment is not self._environment or radius != self._radius:
            self._environment = environment
            self._radius = radius
            self._cost = TimeVaryingCost(CoverageCost(environment, DEFAULT_LATTICE, radius=radius))
        return self._cost


@dataclass(frozen=True)
class ChapterResult:
    """Outcome of playing a chapter without a user.

    Attributes
    ----------
    title : str
        Title of the chapter.
    duration : float
        Simulated time, s.
    ends : bool
        Whether the chapter ends within `MAX_TASK_S`.
    """

    title: str
    duration: float
    ends: bool


def check_lesson(path: Path, saved: SavedSession) -> list[ChapterResult]:
    """Play a lesson without a window, and return the outcome of each chapter.

    Parameters
    ----------
    path : Path
        The file of the lesson, for messages.
    saved : SavedSession
        The session with the lesson; see `load_lesson`.

    Returns
    -------
    list of ChapterResult

    Raises
    ------
    MapError
        If a chapter ends before its last edit is made.
    """
    assert saved.lesson is not None
    session = _open_at_start(saved)
    results: list[ChapterResult] = []
    for index, chapter in enumerate(saved.lesson.chapters):
        _go_to_start(session, chapter)
        ends = _play_chapter(session, chapter)
        if ends:
            _check_edit_was_made(chapter, session, str(path), ("lesson", "chapters", index, "until"))
        results.append(ChapterResult(chapter.title, session.timeline.end_time, ends))
    return results


def _play_chapter(session: Session, chapter: ChapterModel) -> bool:
    """Play a chapter from its start, and return whether it ends within `MAX_TASK_S`."""
    sampler: _DistanceSampler | None = None
    # No other condition needs the mean distance, which takes long to compute.
    if chapter.until.mean_distance_below is not None:
        sampler = _DistanceSampler(session)
    while True:
        if sampler is not None:
            sampler.update()
        if is_fulfilled(chapter.until, session):
            return True
        if session.timeline.end_time >= MAX_TASK_S:
            return False
        session.playback.step()


def _check_edit_was_made(
    chapter: ChapterModel, session: Session, source_name: str, path: tuple[str | int, ...]
) -> None:
    """Raise a MapError if a chapter that has just ended did not reach its last edit.

    `path` is the JSON path of the condition at which the chapter ends.
    """
    timeline = session.timeline
    last_edit = timeline.document.nodes[chapter.edit]
    if timeline.head is not last_edit:
        expected = (
            f"an end after step {last_edit.branch_step} of edit {chapter.edit} ({last_edit.description})"
        )
        message = f"expected {expected}, got step {timeline.step}"
        raise MapError.from_issues(source_name, [Issue.at_path(path, message)])
