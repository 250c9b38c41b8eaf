"""Lessons: chapters over a session's document that wait for the simulation, ask and hand over. No pygame.

A lesson file holds a session, recorded in the window, and chapters. A chapter begins at one of the session's
touches and goes on step by step; whatever it waits for is measured in simulation time, so that it tells the
same story on a slow machine.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from robocov.errors import MapError, Mistake, shown_json
from robocov.files.strictjson import check_header, located, parse, read_bytes, refused
from robocov_app.viewer.session.changes import Drag, Release
from robocov_app.viewer.session.file import SavedSession, session_of
from robocov_app.viewer.session.session import Session

if TYPE_CHECKING:
    from robocov_app.viewer.presenter import Desk

FORMAT, VERSION = "robocov-lesson", 1

FIRST = Path(__file__).with_name("first_lesson.json")
"""The lesson that comes with robocov: the paper's story."""

_BASE = ("cells", "grid", "obstacles", "boundary", "trajectories", "starts", "robots", "failed", "selection")
PLAIN = frozenset((*_BASE, "colour_bar", "legend", "scale_bar", "status", "caption"))
"""Layers that every chapter shows."""

_READING = 5.0
"""Seconds that a question or a task stands there before the lesson goes on by itself."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


_Text: TypeAlias = Annotated[str, Field(min_length=1, max_length=10_000)]
_Touch: TypeAlias = Annotated[int, Field(ge=0, description="Number of a touch of the session")]
_Robot: TypeAlias = Annotated[int, Field(ge=1, le=1_000_000)]
_Seconds: TypeAlias = Annotated[float, Field(gt=0, le=100_000, description="Of the simulation")]
_Box: TypeAlias = Annotated[
    list[Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]],
    Field(min_length=4, max_length=4, description="[left, bottom, right, top] in metres"),
]


class Condition(_Model):
    """What has to hold; all that is given. Robots are looked at in the first pane."""

    seconds: _Seconds | None = Field(None, description="So much simulation time has passed")
    settled: Literal[True] | None = Field(None, description="No robot gets anywhere any more")
    robot: _Robot | None = Field(None, description="Whose place counts, for `inside` and `outside`")
    inside: _Box | None = None
    outside: _Box | None = None

    def holds(self, session: Session, since: float) -> bool:
        """Return whether it holds in the present of a session; `since` is when waiting began, s."""
        if self.seconds is not None and session.end - since < self.seconds - 1e-9:
            return False
        if self.settled and not session.settled:
            return False
        if self.robot is None:
            return True
        lane = session.lanes[0]
        row = lane.row(self.robot)
        if row is None:
            return False
        x, y = lane.simulation.positions[row].tolist()
        inside = self.inside is None or _within(self.inside, x, y)
        return inside and (self.outside is None or not _within(self.outside, x, y))


class Wait(_Model):
    """Go on when something holds, or at the latest after a while."""

    do: Literal["wait"]
    until: Condition
    at_most_s: _Seconds | None = None


class Ask(_Model):
    """Pause and ask for a prediction; `because` is told after the answer."""

    do: Literal["ask"]
    question: _Text
    answers: Annotated[list[_Text], Field(min_length=2, max_length=9)]
    right: Annotated[int, Field(ge=1, description="Number of the right answer, from 1")]
    because: _Text


class Task(_Model):
    """Hand over until something holds; `solution` is the touch that shows how."""

    do: Literal["task"]
    text: _Text
    until: Condition
    solution: _Touch | None = None


class DoTouch(_Model):
    """Do what a touch of the session did, now."""

    do: Literal["touch"]
    touch: _Touch


class Back(_Model):
    """Look back at a moment, and go on from there."""

    do: Literal["back"]
    to_s: Annotated[float, Field(ge=0, le=100_000)]


class Speed(_Model):
    """Play faster or slower."""

    do: Literal["speed"]
    speed: Annotated[float, Field(ge=0.1, le=16)]


Step: TypeAlias = Annotated[Wait | Ask | Task | DoTouch | Back | Speed, Field(discriminator="do")]


class Chapter(_Model):
    """A scene: where it begins, what is shown, and what happens step by step."""

    title: Annotated[str, Field(min_length=1, max_length=60)]
    text: _Text
    touch: _Touch
    speed: Annotated[float, Field(ge=0.1, le=16)] = 1.0
    show: list[str] = Field([], description="Layers beside the plain ones")
    robot: _Robot | None = Field(None, description="The robot that is asked about")
    steps: Annotated[list[Step], Field(min_length=1)]


class LessonModel(_Model, title="robocov lesson"):
    """A session of the window with chapters."""

    schema_: Annotated[str | None, Field(alias="$schema")] = None
    format: Literal["robocov-lesson"]
    version: Literal[1]
    title: _Text
    session: dict[str, Any]
    chapters: Annotated[list[Chapter], Field(min_length=1, max_length=100)]


@dataclass(frozen=True, eq=False)
class Lesson:
    """A lesson that has been checked; every `session` of it is a new one."""

    model: LessonModel
    where: str
    controllers: Collection[str] = ()

    @property
    def chapters(self) -> list[Chapter]:
        """The chapters in their order."""
        return self.model.chapters

    def saved(self) -> SavedSession:
        """Return the session of the file; MapError, InputError as `load_session`."""
        return session_of(self.model.session, f"{self.where}: session", self.controllers)

    def session(self) -> Session:
        """Return its session, at the very beginning."""
        document = self.saved().document
        return Session.opened(SavedSession(document, document.nodes[0], 0))


def lesson_schema() -> dict[str, Any]:
    """Return the JSON schema of lesson files."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **LessonModel.model_json_schema()}


def load_lesson(path: Path = FIRST, controllers: Collection[str] = ()) -> Lesson:
    """Return a lesson from its file; MapError, InputError as `load_session`."""
    text, where = read_bytes(path), str(path)
    content = parse(text, where)
    try:
        check_header(content, where, FORMAT, VERSION)
        try:
            model = LessonModel.model_validate(content)
        except ValidationError as error:
            raise refused(error, where, _mistake) from None
        lesson = Lesson(model, where, controllers)
        if mistakes := list(_mistakes(model, lesson.saved())):
            raise MapError.of(where, mistakes)
    except MapError as error:
        raise located(error, text, where) from None
    return lesson


def _mistakes(model: LessonModel, saved: SavedSession) -> Iterator[Mistake]:
    """Yield what a model alone cannot tell: touches and layers that are not there, answers, conditions."""
    from robocov_app.render.picture import pane_layers, standard_layers  # loads pygame

    nodes = saved.document.nodes
    layers = {layer.name for layer in (*standard_layers(), *pane_layers())}
    for k, chapter in enumerate(model.chapters):
        at: tuple[str | int, ...] = ("chapters", k)
        last = len(nodes) - 1
        if chapter.touch > last:
            yield Mistake.at((*at, "touch"), f"{chapter.touch}, but a touch from 0 to {last} was wanted")
        for j, name in enumerate(chapter.show):
            if name not in layers:
                yield Mistake.at((*at, "show", j), f"{shown_json(name)}, but the name of a layer was wanted")
        for j, step in enumerate(chapter.steps):
            here = (*at, "steps", j)
            if isinstance(step, Ask) and step.right > len(step.answers):
                most = len(step.answers)
                yield Mistake.at((*here, "right"), f"{step.right}, but an answer from 1 to {most} was wanted")
            if isinstance(step, (Wait, Task)):
                until = step.until
                boxed = until.inside is not None or until.outside is not None
                if boxed != (until.robot is not None):
                    yield Mistake.at((*here, "until"), "`robot` was wanted with `inside` or `outside`")
                elif until == Condition():
                    yield Mistake.at((*here, "until"), "{}, but a condition was wanted")
            key = "solution" if isinstance(step, Task) else "touch"
            number = getattr(step, key, None)
            if number is not None and number > last:
                yield Mistake.at((*here, key), f"{number}, but a touch from 0 to {last} was wanted")
            elif number is not None and any(isinstance(c, (Drag, Release)) for _, c in nodes[number].changes):
                yield Mistake.at((*here, key), f"{number}, but a touch that is no drag was wanted")


def _mistake(detail: Any) -> Mistake:
    steps = list(detail["loc"])
    # pydantic names the kind of step that it has chosen as a part of the path
    path = tuple(each for k, each in enumerate(steps) if k < 2 or steps[k - 2] != "steps")
    if detail["type"] == "missing":
        return Mistake.at(path, "missing")
    if detail["type"] == "extra_forbidden":
        return Mistake.at(path, "unknown key", at_key=True)
    words = str(detail["msg"]).removeprefix("Input should be ").replace("a valid ", "a ")
    return Mistake.at(path, f"{shown_json(detail['input'])}, but {words} was wanted")


def _within(box: list[float], x: float, y: float) -> bool:
    left, bottom, right, top = box
    return left <= x <= right and bottom <= y <= top


class Player:
    """Plays a lesson on a desk, on a session of its own; the end gives back what was there before.

    Unattended, as in a film, questions answer themselves and tasks are shown.

    Attributes
    ----------
    number : int
        Which chapter is played, from 0.
    asked : Ask or None
        The question that waits for an answer.
    task : Task or None
        What has been handed over.
    told : str
        What the last answer was followed by.
    done : bool
    """

    def __init__(
        self, desk: Desk, fit: Callable[[], None], lesson: Lesson, *, unattended: bool = False
    ) -> None:
        self._desk, self._fit, self._lesson, self._unattended = desk, fit, lesson, unattended
        self._before = desk.session, desk.shown, desk.map_name, desk.tool, desk.hand.selected, desk.active
        session = lesson.session()
        session.clock.budget, session.serial = desk.session.clock.budget, desk.session.serial + 1
        desk.session = session
        self.done = False
        self.choose(0)

    @property
    def chapter(self) -> Chapter:
        """The chapter that is played."""
        return self._lesson.chapters[self.number]

    @property
    def chapters(self) -> tuple[str, ...]:
        """The titles of all chapters."""
        return tuple(chapter.title for chapter in self._lesson.chapters)

    @property
    def title(self) -> str:
        """The title of the chapter with its number."""
        return f"{self.number + 1}  {self.chapter.title}"

    @property
    def text(self) -> str:
        """What there is to read now."""
        if self.asked is not None:
            answers = "; ".join(f"{k} {each}" for k, each in enumerate(self.asked.answers, 1))
            return f"{self.asked.question} {answers}."
        return self.task.text if self.task is not None else f"{self.told} {self.chapter.text}".strip()

    @property
    def progress(self) -> float:
        """How much of the lesson is over, 0 to 1."""
        return (self.number + self._at / len(self.chapter.steps)) / len(self._lesson.chapters)

    def choose(self, number: int) -> None:
        """Begin a chapter; past the last the lesson ends."""
        if number >= len(self._lesson.chapters):
            self.end()
            return
        self.number, self._at = max(number, 0), 0
        self.asked: Ask | None = None
        self.task: Task | None = None
        self.told = ""
        desk, chapter = self._desk, self.chapter
        desk.tool, desk.active, desk.message = desk.hand, 0, ""
        self._enter(chapter.touch)
        desk.session.stop_when_settled = False
        desk.session.clock.speed = chapter.speed
        desk.shown = set(PLAIN.union(chapter.show))
        self._show()
        self._fit()
        self._begin_step()

    def skip(self, by: int) -> None:
        """Go to the next chapter, or back to the one before."""
        self.choose(self.number + by)

    def answer(self, number: int) -> bool | None:
        """Answer the question, from 1; return whether it was right, None where there is no such answer."""
        asked = self.asked
        if asked is None or not 1 <= number <= len(asked.answers):
            return None
        right = number == asked.right
        self.told = ("Right: " if right else f"No, {asked.answers[asked.right - 1]}: ") + asked.because
        self.asked = None
        self._desk.session.playing = True
        self._at += 1
        self._begin_step()
        return right

    def advance(self, seconds: float) -> None:
        """Let so many seconds pass on the clock on the wall; only unattended they matter."""
        self._read += seconds
        while not self.done and self._step_is_over():
            self._at += 1
            if self._at < len(self.chapter.steps):
                self._begin_step()
            else:
                self.choose(self.number + 1)

    def end(self) -> None:
        """End the lesson; session, layers and tool are those from before."""
        if self.done:
            return
        desk, serial = self._desk, self._desk.session.serial
        desk.session, desk.shown, desk.map_name, desk.tool, desk.hand.selected, desk.active = self._before
        desk.session.serial = max(serial, desk.session.serial) + 1
        desk.version += 1
        desk.look_at_map()
        self.done = True

    def _begin_step(self) -> None:
        self._read, self._shown, session = 0.0, False, self._desk.session
        step = self.chapter.steps[self._at] if self._at < len(self.chapter.steps) else None
        self._desk.hand.selected = (
            None if isinstance(step, Ask) else self.chapter.robot
        )  # no answer given away
        match step:
            case Ask():
                self.asked, session.playing = step, False
            case Task():
                self.task, self.told, session.playing = step, "", True
            case DoTouch(touch=number):
                self._desk.attempt(lambda: self._touch(number))
            case Back(to_s=time):
                session.look_at(time)
                session.branch()
                session.playing = True
                self._show()
            case Speed(speed=speed):
                session.clock.speed = speed
        self._since = session.end

    def _step_is_over(self) -> bool:
        session = self._desk.session
        step = self.chapter.steps[self._at] if self._at < len(self.chapter.steps) else None
        if session.end < self._since:
            self._since = session.end  # somebody has gone back in time
        if isinstance(step, Wait):
            late = step.at_most_s is not None and session.end - self._since >= step.at_most_s
            return late or step.until.holds(session, self._since)
        if isinstance(step, Ask):
            if self._unattended and self._read >= _READING:
                self.answer(step.right)
            return False  # an answer goes on by itself
        if isinstance(step, Task):
            if self._unattended and self._read >= _READING and not self._shown:
                self._shown = True
                if step.solution is None:
                    return self._over()
                solution = step.solution
                self._desk.attempt(lambda: self._touch(solution))
            return step.until.holds(session, self._since) and self._over()
        return True

    def _over(self) -> bool:
        self.task = None
        return True

    def _enter(self, number: int) -> None:
        """Go to where a touch of the session has just been made."""
        session = self._desk.session
        node = session.document.nodes[number]
        session.enter(node, node.begin)
        session.finish_remaking()
        session.playing = True

    def _touch(self, number: int) -> None:
        """Do the changes of a touch now; one that begins a run anew begins it."""
        session = self._desk.session
        node = session.document.nodes[number]
        if node.scenario is not None:
            self._enter(number)
        else:
            for _, change in node.changes:
                session.do(change, node.kind, node.words)
        session.playing = True
        self._show()

    def _show(self) -> None:
        desk = self._desk
        desk.map_name = desk.session.environment.name
        desk.version += 1
        desk.look_at_map()
