"""The editor without its window: open map, selection, visible layers, and editing actions."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from robocov.environment import Point
from robocov.errors import MapError, RobocovError
from robocov.mapfile.models import MIN_SIZE_M
from robocov_app.editor.model import require
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.measurement import Measurement
from robocov_app.editor.model.selection import Change, Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.model.validation import Problem, translate_message
from robocov_app.editor.settings import LAYERS, EditorSettings
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.snap_switches import SNAPS
from robocov_app.editor.tools.snap_targets import count_vertices
from robocov_app.editor.tools.tool import EditorTool
from robocov_app.editor.tools.toolbox import EditorToolbox
from robocov_app.jobs.workers import Worker
from robocov_app.toolkit.dialogs import Answer, Dialogs, Question
from robocov_app.toolkit.window.clipboard import Clipboard

MAX_LIVE_VERTICES = 1500  # larger maps are not measured during a drag
GRIDS_M = (0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0)
MAX_ROBOTS = 1000
MAX_LENGTHS_M = {"grid": 100.0, "wall_width": 100.0, "radius": 10.0}


class Editor(EditorContext):
    """State of the editor, and the actions by which the user changes it.

    Parameters
    ----------
    document : Document
        The open map.
    measurement_worker : Worker of Measurement
        Measures a map in the background, given a sketch and the radius of a robot.
    folder : Path
        Folder of files without a path.
    settings : EditorSettings
        Settings of the previous session.

    Attributes
    ----------
    toolbox : EditorToolbox
        The tools, and the one in use.
    theme : str
        Colors: "light" or "dark".
    shows_panel : bool
        Whether the panel is shown.
    is_compact : bool
        Whether the buttons of the bar and of the rail are provided by the mobile page.
    shown : set of str
        Names of the visible layers; see `LAYERS`.
    radius : float
        Radius of a robot, m.
    robots : int
        Number of robots in the team.
    seed : int
        Seed of the team's positions.
    start : str or None
        Start that the user chose for the team.
    recent : list of str
        Paths of recently opened maps, the newest first.
    measurement : Measurement or None
        Latest measurement of the map; None before the first one.
    problem : Problem or None
        Problem whose message is shown on the sheet.
    dialogs : Dialogs
        Dialogs of the window.
    clipboard : Clipboard
        Clipboard for copied text.
    cursor : Point or None
        Position of the pointer over the map, m.
    typed : str
        Value that is being typed for the tool.
    motion_start_s : float or None
        Time at which the animation of moving obstacles started; None while they are shown at rest.
    """

    error_message_s = 8.0

    def __init__(
        self,
        document: Document,
        measurement_worker: Worker[Measurement],
        folder: Path,
        settings: EditorSettings,
    ) -> None:
        super().__init__(document)
        self.measurement_worker = measurement_worker
        self.folder = folder
        self.toolbox = EditorToolbox()
        self.theme: str = settings.theme
        self.shows_panel = True
        self.is_compact = False
        self.shown = set(settings.shown) & set(LAYERS)
        self.snaps = set(settings.snaps) & set(SNAPS)
        self.grid = settings.grid
        self.snap_angle = settings.angle
        self.wall_width = settings.wall
        self.radius = settings.radius
        self.robots = settings.robots
        self.seed = 0
        self.start: str | None = None
        self.recent = list(settings.recent)
        self.measurement: Measurement | None = None
        self.problem: Problem | None = None
        self.dialogs = Dialogs()
        self.clipboard = Clipboard()
        self.cursor: Point | None = None
        self.typed = ""
        self.motion_start_s: float | None = None
        self._measured: tuple[Sketch, float] | None = None  # sketch and radius last sent to the worker

    @property
    def tool(self) -> EditorTool:
        """The tool in use."""
        return self.toolbox.current

    @property
    def displayed(self) -> tuple[Sketch, Selection]:
        """Map and selection as displayed: during a drag, as if it ended now."""
        drag = self.toolbox.selector.drag
        if drag is None or drag.change is None:
            return self.sketch, self.selection
        return drag.change.sketch, drag.change.selection

    @property
    def problems(self) -> tuple[Problem, ...]:
        """Problems found by the latest measurement."""
        if self.measurement is None:
            return ()
        return self.measurement.problems

    @property
    def shown_measurement(self) -> Measurement | None:
        """Latest measurement; None if passages that are too narrow are not shown."""
        if "impassable" in self.shown:
            return self.measurement
        return None

    @property
    def start_names(self) -> list[str]:
        """Names of the starts."""
        return [name for name, _ in self.sketch.starts]

    @property
    def start_name(self) -> str | None:
        """Start at which the team is shown: the selected, the chosen or else the first one, if any."""
        for name in (*sorted(self.selection.starts), self.start, *self.start_names):
            if name in self.start_names:
                return name
        return None

    def _handle_change(self) -> None:
        super()._handle_change()
        self.problem = None
        self.document.update_draft()
        self.request_measurement()

    def request_measurement(self) -> None:
        """Request a measurement of the displayed map unless it was requested already.

        During a drag, large maps are measured without the drag, because that would take too long.
        """
        sketch, _ = self.displayed
        if sketch is not self.sketch and count_vertices(sketch) >= MAX_LIVE_VERTICES:
            sketch = self.sketch
        measured = self._measured
        if measured is None or measured[0] is not sketch or measured[1] != self.radius:
            self._measured = (sketch, self.radius)
            self.measurement_worker.put(self._measured)

    def undo_steps(self, steps: int) -> None:
        """Undo a number of changes; a negative number redoes changes."""
        history = self.document.history
        undone: Change | None = None
        redone: Change | None = None
        for _ in range(steps):
            undone = history.undo()
        for _ in range(-steps):
            redone = history.redo()
        if steps == 1:
            self.show_message("nothing to undo" if undone is None else f"undone: {undone.description}")
        elif steps == -1:
            self.show_message("nothing to redo" if redone is None else f"redone: {redone.description}")
        self._handle_change()

    def open_document(self, document: Document) -> None:
        """Replace the open document, and choose the select tool."""
        self.document = document
        self.measurement = None
        self._measured = None
        self.toolbox.selector.cancel(self)
        self.choose_tool("select", shows_hint=False)
        self._handle_change()

    def choose_tool(self, name: str, *, shows_hint: bool = True) -> None:
        """Choose a tool by name; this cancels the current tool's action."""
        self.tool.cancel(self)
        self.toolbox.current = self.toolbox.by_name[name]
        self.typed = ""
        self.revision += 1
        # Hints describe clicks and keys, which phones do not have.
        if shows_hint and not self.is_compact:
            self.show_message(self.tool.hint)

    def carry_out(self, action: Callable[[], object]) -> None:
        """Run an action, and show the message that it returns.

        Raises
        ------
        MapError
            If the action fails. The message names objects as the window does, not by their place in the file.
        """
        try:
            super().carry_out(action)
        except RobocovError as error:
            raise MapError(translate_message(str(error), self.sketch)) from None

    def ask_question(self, title: str, text: str, *answers: tuple[str, str, Callable[[], object]]) -> None:
        """Open a dialog with a question.

        Parameters
        ----------
        title, text : str
            Title and text of the dialog.
        *answers : tuple of str, str and callable
            Label, key and action of each answer. Escape chooses the last answer.
        """
        buttons = [Answer(label, partial(self.attempt, action), key) for label, key, action in answers]
        self.dialogs.ask(Question(title, text, buttons, on_cancel=buttons[-1].call))

    def pass_time(self, seconds: float) -> None:
        """Advance the clock: remove old messages, and receive a finished measurement."""
        super().pass_time(seconds)
        measurement = self.measurement_worker.poll()
        if measurement is not None:
            self.measurement = measurement
            self.revision += 1

    def toggle_layer(self, name: str) -> None:
        """Show or hide a layer."""
        self.shown ^= {name}
        self.show_message(_describe_switch(LAYERS[name].title, is_on=name in self.shown))

    def toggle_snap(self, name: str) -> None:
        """Switch a snap mode on or off."""
        self.snaps ^= {name}
        self.show_message(_describe_switch(SNAPS[name].title, is_on=name in self.snaps))

    def toggle_all_snaps(self) -> None:
        """Switch all snap modes off if any is on, otherwise switch all on."""
        if self.snaps:
            self.snaps = set()
            self.show_message("snaps to nothing")
        else:
            self.snaps = set(SNAPS)
            self.show_message("snaps to everything")

    def set_length(self, name: str, length: float) -> None:
        """Set the attribute grid, wall_width or radius to a length, m; raise MapError if out of range."""
        maximum = MAX_LENGTHS_M[name]
        if not MIN_SIZE_M <= length <= maximum:
            label = name.replace("_", " ")
            raise MapError(f"{label}: expected {MIN_SIZE_M:g} to {maximum:g} m, got {length:g} m")
        setattr(self, name, length)
        if name == "grid":
            self.show_message(f"the grid is {length:g} m")

    def refine_grid(self) -> None:
        """Choose the next finer grid."""
        # The factor allows for rounding errors.
        finer = [grid for grid in GRIDS_M if grid < self.grid * 0.999]
        self.set_length("grid", max(finer, default=GRIDS_M[0]))

    def coarsen_grid(self) -> None:
        """Choose the next coarser grid."""
        coarser = [grid for grid in GRIDS_M if grid > self.grid * 1.001]
        self.set_length("grid", min(coarser, default=GRIDS_M[-1]))

    def set_robots(self, count: int) -> None:
        """Set the number of robots in the team; raise MapError if it is out of range."""
        require(1 <= count <= MAX_ROBOTS, f"robots: expected 1 to {MAX_ROBOTS}, got {count}")
        self.robots = count

    def add_robots(self, count: int) -> None:
        """Add robots to the team, or remove robots if the number is negative."""
        self.set_robots(min(max(self.robots + count, 1), MAX_ROBOTS))

    def switch_theme(self) -> None:
        """Switch between light and dark colors."""
        self.theme = "dark" if self.theme == "light" else "light"

    def toggle_panel(self) -> None:
        """Show or hide the panel."""
        self.shows_panel = not self.shows_panel


def _describe_switch(title: str, *, is_on: bool) -> str:
    state = "on" if is_on else "off"
    return f"{title}: {state}"
