"""The editor: what is open, selected, shown and remembered, and how every change is made. No pygame."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.environment import Point
from robocov.errors import MapError, RobocovError
from robocov.mapfile.models import MIN_SIZE_M
from robocov_app.editor.model import require
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.measurement import Measurement
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.model.validation import Problem, in_words
from robocov_app.editor.tools import draw
from robocov_app.editor.tools.density import DensityTool
from robocov_app.editor.tools.motion_path import MotionPathTool
from robocov_app.editor.tools.reference_image import ReferenceImageTool
from robocov_app.editor.tools.select import PanTool, SelectTool
from robocov_app.editor.tools.snapping import SNAPS, vertex_count
from robocov_app.editor.tools.tool import Tool, Workspace
from robocov_app.jobs.workers import Worker
from robocov_app.toolkit.dialogs import Answer, Dialogs, Question
from robocov_app.toolkit.faults import describe_os_error

FILE = "editor.json"
# layers that can be shown or hidden, with their titles
SHOWN = {"grid": "Grid", "names": "Names", "impassable": "Too narrow", "problems": "Problems"}
SHOWN |= {"robots": "Robots at start", "picture": "Picture", "legend": "Legend", "handles": "Handles"}
# settings that are as an attribute of the editor, with its name
KEPT = {"grid": "grid", "angle": "snap_angle", "radius": "radius", "robots": "robots", "wall": "wall_width"}
MOST_RECENT = 10


class EditorSettings(BaseModel):
    """Appearance and snapping of the editor, and its recent maps."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    theme: Literal["light", "dark"] = "light"
    scale: float | None = Field(default=None, ge=0.5, le=4.0)
    width: int = Field(default=1280, ge=900, le=7680)
    height: int = Field(default=720, ge=600, le=4320)
    tab: str = "map"
    grid: float = Field(default=0.1, ge=0.001, le=100.0)
    angle: float = Field(default=15.0, gt=0.0, le=90.0)
    snaps: tuple[str, ...] = tuple(SNAPS)
    shown: tuple[str, ...] = tuple(name for name in SHOWN if name != "robots")
    radius: float = Field(default=DEFAULT_RADIUS_M, ge=0.001, le=10.0)
    robots: int = Field(default=6, ge=1, le=1000)
    wall: float = Field(default=0.1, ge=0.001, le=100.0)
    recent: tuple[str, ...] = ()


SAID_FOR, TROUBLE_FOR = 5.0, 8.0  # seconds for which a message stays, or one of what went wrong
FEW = 1500  # vertices up to which a map is measured while something is dragged
GRIDS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)  # m; spacings to choose from


@dataclass(frozen=True)
class Team:
    """A team at a start, for its preview."""

    start: str | None  # None for anywhere in the free space
    robots: int
    radius: float  # m
    places: tuple[Point, ...] = ()  # m; empty where it cannot stand there
    words: str = ""  # why not


def placed(sketch: Sketch, start: str | None, robots: int, seed: int, radius: float) -> Team:
    try:
        points = sketch.environment().start(start).sample(robots, seed=seed, radius=radius)
    except Exception as error:  # what nobody has foreseen must not end the window either
        return Team(start, robots, radius, words=str(error).removeprefix("map: "))
    return Team(start, robots, radius, tuple((x, y) for x, y in points.tolist()))


class TeamThread:
    """Asks `placed` in a thread, so that the window does not wait; only the newest question counts."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, "team")
        self._asked: tuple[object, ...] = ()
        self._answer: Future[Team] | None = None

    def ask(self, sketch: Sketch, start: str | None, robots: int, seed: int, radius: float) -> Team | None:
        """Ask for a team; return it once, as soon as it is there."""
        team = sketch, start, robots, seed, radius
        if self._asked != team:
            self._asked = team
            if self._answer is not None:
                self._answer.cancel()
            self._answer = self._pool.submit(placed, *team)
        if self._answer is None or not self._answer.done():
            return None
        answer, self._answer = self._answer.result(), None
        return answer

    def close(self) -> None:
        self._pool.shutdown(wait=False, cancel_futures=True)


class Editor(Workspace):
    """Editor state and the user's actions on it."""

    def __init__(
        self, document: Document, readings: Worker[Measurement], folder: Path, settings: EditorSettings
    ) -> None:
        super().__init__(document)
        self.readings, self.folder = readings, folder
        self.selector = SelectTool()
        tools = (  # in the order in which they are shown
            *(self.selector, PanTool(), draw.PolygonTool(), draw.RectangleTool(), draw.CircleTool()),
            *(draw.WallTool(), draw.DoorTool(), draw.BoundaryTool(), draw.MeasureTool(), draw.DiscTool()),
            *(draw.PlacesTool(), DensityTool(), MotionPathTool(), ReferenceImageTool()),
        )
        self.tools: dict[str, Tool] = {tool.name: tool for tool in tools}
        self.tool: Tool = self.selector
        self.theme: str = settings.theme
        self.panel = True
        self.shown, self.snaps = set(settings.shown) & set(SHOWN), set(settings.snaps) & set(SNAPS)
        self.grid, self.snap_angle, self.wall_width = settings.grid, settings.angle, settings.wall
        self.radius, self.robots, self.seed = settings.radius, settings.robots, 0
        self.start: str | None = None
        self.recent = list(settings.recent)
        self.measurement: Measurement | None = None
        self.problem: Problem | None = None  # the one that is shown with its words
        self.dialogs = Dialogs()  # with what waits for an answer
        self.cursor: Point | None = None  # where the mouse is, m
        self.typed = ""
        self.moves_since: float | None = None  # s; since when obstacles that move are shown moving
        self._about: tuple[object, float] | None = None

    @property
    def preview(self) -> tuple[Sketch, Selection]:
        """The map and what is selected as they are shown: in a drag, what letting go would make."""
        change = self.selector.drag.change if self.selector.drag is not None else None
        return (self.sketch, self.selection) if change is None else (change.sketch, change.selection)

    @property
    def problems(self) -> tuple[Problem, ...]:
        return self.measurement.problems if self.measurement is not None else ()

    @property
    def start_names(self) -> list[str]:
        return [name for name, _ in self.sketch.starts]

    @property
    def start_name(self) -> str | None:
        """The start at which the team is shown: the selected one, the chosen one, or the first."""
        wanted = (*sorted(self.selection.starts), self.start, *self.start_names)
        return next((name for name in wanted if name in self.start_names), None)

    def _changed(self) -> None:
        super()._changed()
        self.problem = None
        self.document.keep()
        self.ask_readings()

    def ask_readings(self) -> None:
        """Ask what the map is like, also one of few vertices that is being dragged; not the same again."""
        sketch, about = self.preview[0], self._about
        if sketch is not self.sketch and vertex_count(sketch) >= FEW:
            sketch = self.sketch
        if about is None or about[0] is not sketch or about[1] != self.radius:
            self._about = sketch, self.radius
            self.readings.put(self._about)

    def travel(self, steps: int) -> None:
        """Undo so many changes, or with a negative number do them again; tell of a single one."""
        history, change = self.document.history, None
        for _ in range(abs(steps)):
            change = history.undo() if steps > 0 else history.redo()
        if abs(steps) == 1:
            done, none = ("undone", "undo") if steps > 0 else ("done again", "do again")
            self.say(f"{done}: {change.words}" if change else f"nothing to {none}")
        self._changed()

    def put(self, document: Document) -> None:
        self.document = document
        self.measurement = self._about = None
        self.selector.cancel(self)
        self.choose("select", tell=False)
        self._changed()

    def choose(self, name: str, *, tell: bool = True) -> None:
        self.tool.cancel(self)
        self.tool, self.typed = self.tools[name], ""
        self.version += 1
        if tell:
            self.say(self.tool.hint)

    def attempt(self, action: Callable[[], object]) -> None:
        try:
            self.carry_out(action)
        except RobocovError as error:
            self.say(str(error), trouble=True)
        except OSError as error:
            self.say(describe_os_error(error), trouble=True)

    def carry_out(self, action: Callable[[], object]) -> None:
        """Do something; a MapError names what is wrong by its name, not by its place in the file."""
        self.version += 1
        try:
            words = action()
        except RobocovError as error:
            raise MapError(in_words(str(error), self.sketch)) from None
        if isinstance(words, str):
            self.say(words)

    def ask(self, title: str, words: str, *answers: tuple[str, str, Callable[[], object]]) -> None:
        """Ask a question with answers: their words, keys, and what they do; Escape gives the last one."""
        given = [Answer(text, partial(self.attempt, call), key) for text, key, call in answers]
        self.dialogs.ask(Question(title, words, given, on_cancel=given[-1].call))

    def pass_time(self, seconds: float) -> None:
        self.now += seconds
        if self.message and self.now - self.said > (TROUBLE_FOR if self.trouble else SAID_FOR):
            self.message = ""
        if (answer := self.readings.poll()) is not None:
            self.measurement = answer
            self.version += 1

    def switch(self, kind: str, name: str) -> None:
        chosen = self.shown if kind == "show" else self.snaps
        if kind == "snap" and name == "all":
            self.snaps = set() if self.snaps else set(SNAPS)
            self.say("snaps to everything" if self.snaps else "snaps to nothing")
            return
        chosen ^= {name}
        title = SHOWN[name] if kind == "show" else SNAPS[name][0]
        self.say(f"{title}: {'on' if name in chosen else 'off'}")

    def set_length(self, name: str, length: float) -> None:
        most, what = 10.0 if name == "radius" else 100.0, name.replace("_", " ")
        if not MIN_SIZE_M <= length <= most:
            raise MapError(f"{what}: expected {MIN_SIZE_M:g} to {most:g} m, got {length:g} m")
        setattr(self, name, length)
        if name == "grid":
            self.say(f"the grid is {length:g} m")

    def change_grid(self, by: int) -> None:
        finer = [each for each in GRIDS if each < self.grid * 0.999] or GRIDS[:1]
        coarser = [each for each in GRIDS if each > self.grid * 1.001] or GRIDS[-1:]
        self.set_length("grid", coarser[0] if by > 0 else finer[-1])

    def set_robots(self, count: int) -> None:
        require(1 <= count <= 1000, f"robots: expected 1 to 1000, got {count}")
        self.robots = count

    def add_robots(self, by: int) -> None:
        self.set_robots(min(max(self.robots + by, 1), 1000))
