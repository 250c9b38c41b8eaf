"""The editor: what is open, selected and shown, and how every change is made. Knows no pygame."""

from collections.abc import Callable, Hashable
from functools import partial
from pathlib import Path

from robocov.environment import Point
from robocov.errors import MapError, RobocovError
from robocov.mapfile.models import SMALLEST
from robocov.robots import DEFAULT_RADIUS
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.measurement import Measurement
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Owner, Sketch
from robocov_app.editor.model.validation import Problem, in_words
from robocov_app.editor.tools.handles import Handle, handled, handles
from robocov_app.editor.tools.select import SelectTool
from robocov_app.editor.tools.snap_targets import Snapper, vertex_count
from robocov_app.editor.tools.snapping import Snap, Snapping, snapped
from robocov_app.editor.tools.tool import Tool
from robocov_app.editor.tools.toolbox import toolbox
from robocov_app.editor.ui.settings import SHOWN, SNAPS
from robocov_app.toolkit.cache import Latest
from robocov_app.toolkit.dialogs import Answer, Dialog, Dialogs, Question
from robocov_app.toolkit.worker import Worker

SAID_FOR, TROUBLE_FOR = 5.0, 8.0  # seconds for which a message stays, or one of what went wrong
SNAPS_WITHIN = 0.6  # part of a finger's width: a line that is far off is not to beat the grid
FEW = 1500  # vertices up to which a map is measured while something is dragged
GRIDS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)  # m; spacings to choose from


class Editor:
    """What the user does, and what of it is shown."""

    def __init__(self, document: Document, readings: Worker[Measurement], folder: Path) -> None:
        self.document, self.readings, self.folder = document, readings, folder
        self.tools = toolbox()
        self.tool: Tool = self.tools["select"]
        self.version = 0  # grows whenever panel and sheet have to look again at what there is
        self.theme = "light"
        self.panel = True
        self.shown = {name for name in SHOWN if name != "robots"}
        self.snaps = set(SNAPS)
        self.grid, self.snap_angle = 0.1, 15.0
        self.wall_width = 0.1
        self.radius, self.robots, self.seed = DEFAULT_RADIUS, 6, 0
        self.start: str | None = None
        self.recent: list[str] = []
        self.measurement: Measurement | None = None
        self.problem: Problem | None = None  # the one that is shown with its words
        self.dialogs = Dialogs()  # with what waits for an answer
        self.message = ""  # what was said last, empty when it is old
        self.trouble = False
        self.pixel = 0.01  # m; what a pixel at scale 1 is on the sheet
        self.cursor: Point | None = None  # where the mouse is, m
        self.typed = ""
        self.now = 0.0
        self.moves_since: float | None = None  # s; since when obstacles that move are shown moving
        self._said = 0.0
        self.snapper = Snapper()
        self._handles: Latest[tuple[Handle, ...]] = Latest()
        self._about: tuple[object, float] | None = None

    # what there is

    @property
    def sketch(self) -> Sketch:
        """The map as it is now."""
        return self.document.history.sketch

    @property
    def selection(self) -> Selection:
        """What is selected."""
        return self.document.history.selection

    @property
    def selector(self) -> SelectTool:
        """The tool that selects."""
        return self.tools["select"]  # type: ignore[return-value]

    @property
    def pending(self) -> Change | None:
        """What letting go of the mouse would make."""
        drag = self.selector.drag
        return drag.change if drag is not None else None

    @property
    def preview(self) -> tuple[Sketch, Selection]:
        """The map and what is selected as they are shown: in a drag, what letting go would make."""
        pending = self.pending
        return (self.sketch, self.selection) if pending is None else (pending.sketch, pending.selection)

    @property
    def handled(self) -> tuple[Owner, ...]:
        """Whose vertices are shown."""
        return handled(self.selection)

    @property
    def handles(self) -> tuple[Handle, ...]:
        """What of the selection can be taken hold of."""
        sketch, look = self.sketch, (self.selection, self.pixel)
        return self._handles.of(sketch, look, lambda: handles(sketch, *look))

    @property
    def problems(self) -> tuple[Problem, ...]:
        """What is wrong, as far as is known."""
        return self.measurement.problems if self.measurement is not None else ()

    @property
    def start_names(self) -> list[str]:
        """The starts that a team may be shown at."""
        return [name for name, _ in self.sketch.starts]

    @property
    def start_name(self) -> str | None:
        """The start at which the team is shown: the selected one, the chosen one, or the first."""
        names = self.start_names
        wanted = (*sorted(self.selection.starts), self.start, *names)
        return next((name for name in wanted if name in names), None)

    # snapping

    def snapping(self, reach: float) -> Snapping:
        """Return what to snap to, for a finger that is so many metres wide."""
        kinds = frozenset(kind for name in self.snaps for kind in SNAPS[name][1])
        return Snapping(SNAPS_WITHIN * reach, self.grid, self.snap_angle, kinds)

    def snap(self, raw: Point, reach: float) -> Snap:
        """Return where a place means for the tool that is chosen."""
        tool = self.tool
        if not tool.snaps or not self.snaps:
            return Snap(raw)
        return self.snapped(raw, reach, tool.origin, tool.drawn)

    def snapped(
        self, raw: Point, reach: float, origin: Point | None = None, more: tuple[Point, ...] = ()
    ) -> Snap:
        """Return where a place means, whatever tool is chosen."""
        targets = self.snapper.targets(self.sketch, (), more)
        return Snap(raw) if targets is None else snapped(raw, targets, self.snapping(reach), origin)

    # changing

    def change(self, change: Change, *, drag: Hashable | None = None) -> None:
        """Make a change, and tell what it was."""
        if self.document.history.do(change, drag=drag):
            self.say(change.words)
        self._changed()

    def _changed(self) -> None:
        self.version += 1
        self.problem = None
        self.document.keep()
        self.ask_readings()

    def ask_readings(self) -> None:
        """Ask what the map is like, also one of few vertices that is being dragged; not the same again."""
        sketch, pending = self.sketch, self.pending
        if pending is not None and vertex_count(pending.sketch) < FEW:
            sketch = pending.sketch
        about = self._about
        if about is None or about[0] is not sketch or about[1] != self.radius:
            self._about = sketch, self.radius
            self.readings.put(self._about)

    def select(self, selection: Selection) -> None:
        """Select something else."""
        if selection != self.selection:
            self.document.history.selection = selection
            self.version += 1

    def undo(self) -> None:
        """Take the newest change back."""
        change = self.document.history.undo()
        self.say(f"undone: {change.words}" if change else "nothing to undo")
        self._changed()

    def redo(self) -> None:
        """Do again what was undone last."""
        change = self.document.history.redo()
        self.say(f"done again: {change.words}" if change else "nothing to do again")
        self._changed()

    def travel(self, steps: int) -> None:
        """Undo so many changes, or with a negative number do them again."""
        history = self.document.history
        for _ in range(abs(steps)):
            if (history.undo if steps > 0 else history.redo)() is None:
                break
        self._changed()

    def put(self, document: Document) -> None:
        """Put another document in the editor."""
        self.document = document
        self.measurement, self._about = None, None
        self.selector.cancel(self)
        self.choose("select", tell=False)
        self._changed()

    def choose(self, name: str, *, tell: bool = True) -> None:
        """Take a tool."""
        self.tool.cancel(self)
        self.tool, self.typed = self.tools[name], ""
        self.version += 1
        if tell:
            self.say(self.tool.hint)

    # messages

    def say(self, words: str, *, trouble: bool = False) -> None:
        """Tell something for a while."""
        if words:
            self.message, self.trouble, self._said = words, trouble, self.now

    def attempt(self, action: Callable[[], object]) -> None:
        """Do something; what cannot be done is told, in a sentence."""
        try:
            self.carry_out(action)
        except RobocovError as error:
            self.say(str(error), trouble=True)

    def carry_out(self, action: Callable[[], object]) -> None:
        """Do something; a MapError names what is wrong by its name, not by its place in the file."""
        self.version += 1
        try:
            words = action()
        except RobocovError as error:
            raise MapError(in_words(str(error), self.sketch)) from None
        if isinstance(words, str):
            self.say(words)

    @property
    def asked(self) -> Dialog | None:
        """The dialog that is open."""
        return self.dialogs.asked

    def ask(self, title: str, words: str, *answers: tuple[str, str, Callable[[], object]]) -> None:
        """Ask a question with answers: their words, keys, and what they do; Escape gives the last one."""
        given = [Answer(text, partial(self.attempt, call), key) for text, key, call in answers]
        self.dialogs.ask(Question(title, words, given, on_cancel=given[-1].call))

    def pass_time(self, seconds: float) -> None:
        """Let the clock go on: old messages go, answers come."""
        self.now += seconds
        if self.message and self.now - self._said > (TROUBLE_FOR if self.trouble else SAID_FOR):
            self.message = ""
        answer = self.readings.poll()
        if answer is not None:
            self.measurement = answer
            self.version += 1

    # typing while something is drawn

    @property
    def takes_numbers(self) -> bool:
        """Whether digits are for the tool."""
        tool = self.tool
        return tool.takes_numbers and (tool.busy or tool.begins_typed or bool(self.typed))

    def enter(self) -> None:
        """Give the tool what was typed."""
        text, self.typed = self.typed, ""
        self.attempt(lambda: self.tool.enter(self, text))

    # settings

    def switch(self, kind: str, name: str) -> None:
        """Show something, or snap to it, or not."""
        chosen = self.shown if kind == "show" else self.snaps
        if kind == "snap" and name == "all":
            self.snaps = set() if self.snaps else set(SNAPS)
            self.say("snaps to everything" if self.snaps else "snaps to nothing")
        else:
            chosen ^= {name}
            title = SHOWN[name] if kind == "show" else SNAPS[name][0]
            self.say(f"{title}: {'on' if name in chosen else 'off'}")
        self.version += 1

    def set_length(self, name: str, length: float) -> None:
        """Give grid, robots' radius or drawn walls another length, m."""
        most = 10.0 if name == "radius" else 100.0
        if not SMALLEST <= length <= most:
            wanted = f"{SMALLEST:g} to {most:g} m was wanted"
            raise MapError(f"{name.replace('_', ' ')}: {length:g} m, but {wanted}")
        setattr(self, name, length)
        self.version += 1
        self.ask_readings()
        if name == "grid":
            self.say(f"the grid is {length:g} m")

    def change_grid(self, by: int) -> None:
        """Take the next finer or coarser grid."""
        finer = [each for each in GRIDS if each < self.grid * 0.999] or GRIDS[:1]
        coarser = [each for each in GRIDS if each > self.grid * 1.001] or GRIDS[-1:]
        self.set_length("grid", coarser[0] if by > 0 else finer[-1])

    def set_robots(self, count: int) -> None:
        """Show a team of another size."""
        if not 1 <= count <= 1000:
            raise MapError(f"robots: {count}, but 1 to 1000 were wanted")
        self.robots = count
        self.version += 1

    def add_robots(self, by: int) -> None:
        """Show a team of more or fewer robots."""
        self.set_robots(min(max(self.robots + by, 1), 1000))
