"""The panel of the editor: pages for the map, the selection, snapping, problems and the history."""

from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple

import pygame

from robocov.environment import DiscStart
from robocov.errors import MapError
from robocov_app.editor.canvas.overlay import draw_badge
from robocov_app.editor.editor import Editor
from robocov_app.editor.edits.fixes import FIXES
from robocov_app.editor.model.selection import (
    Selection,
    find_position,
    format_numbered_name,
    list_vertices,
)
from robocov_app.editor.model.sketch import BOUNDARY, KINDS, Item, Owner
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.settings import LAYERS
from robocov_app.editor.tools.snap_switches import SNAPS
from robocov_app.editor.ui.actions import fix_problem, select_owners
from robocov_app.editor.ui.fields import FIELDS, set_background_opacity
from robocov_app.editor.ui.map_facts import list_map_facts
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.overlay import create_flat_canvas, wrap_text
from robocov_app.toolkit.panel import CommandPanel, PanelButton, PanelPage
from robocov_app.toolkit.widgets.appearance import SMALL_TEXT_PX, TEXT_PX
from robocov_app.toolkit.widgets.ui import Ui

ROW_HEIGHT_PX = 20.0  # height of a row in a list
LABEL_WIDTH_PX = 62.0
SHORT_LABEL_WIDTH_PX = 14.0
MEDIUM_LABEL_WIDTH_PX = 48.0
LONG_LABEL_WIDTH_PX = 64.0
UNIT_WIDTH_PX = 16.0
TEAM_LABEL_WIDTH_PX = 44.0
TEAM_FIELD_WIDTH_PX = 44.0
STEP_BUTTON_WIDTH_PX = 23.0
BADGE_COLUMN_PX = 20.0
PROBLEM_MARGIN_PX = 44.0  # to the left and right of the message of a problem, together
FIX_BUTTON_WIDTH_PX = 54.0
FIX_COLUMN_PX = 66.0  # width of the button with its margins
PROBLEM_LINE_GAP_PX = 5
PROBLEM_PADDING_PX = 8
BADGE_TOP_PX = 13  # from the top of a problem to the middle of its badge
CHECK_HEIGHT_PX = 20.0
FACT_HEIGHT_PX = 18.0
MAX_SHORT_LABEL = 2  # number of characters
MAX_MEDIUM_LABEL = 6
MAX_PROBLEMS = 200  # number of problems that are listed
MAX_PROBLEM_COUNT = 99  # maximum number of problems in the title of their page
NOTHING_SELECTED = (
    "Nothing is selected. Click an obstacle, a start or the boundary; drag a box around several; "
    "Tab selects the next; Ctrl+A selects all."
)


class FieldCell(NamedTuple):
    """A field in a row of the panel.

    Attributes
    ----------
    name : str
        Name of the field in `FIELDS`.
    label : str
        Text before the field.
    unit : str
        Text after the field.
    """

    name: str
    label: str
    unit: str = ""


START_BUTTONS = (
    PanelButton("Disc", "tool:disc"),
    PanelButton("Points", "tool:places"),
    PanelButton("Anywhere", "start:uniform"),
    PanelButton("Next", "start:next"),
)
BACKGROUND_BUTTONS = (
    PanelButton("Choose…", "background"),
    PanelButton("Scale, move", "tool:background"),
    PanelButton("Remove", "background:none"),
)
PROBLEM_BUTTONS = (
    PanelButton("Next", "problem:next"),
    PanelButton("Repair", "repair"),
    PanelButton("Clip", "clip"),
    PanelButton("Fix", "problem:fix"),
)
HISTORY_BUTTONS = (PanelButton("Undo", "undo"), PanelButton("Redo", "redo"))
_TURN_BUTTONS = (
    PanelButton("Turn ↺", "rotate:left"),
    PanelButton("Turn ↻", "rotate:right"),
    PanelButton("Flip ↔", "mirror:x"),
    PanelButton("Flip ↕", "mirror:y"),
)
_PATH_BUTTONS = (
    PanelButton("Path", "tool:path"),
    PanelButton("Loop ↺", "path:repeat"),
    PanelButton("Play", "path:play"),
    PanelButton("No path", "path:none"),
)
_START_OBJECT_BUTTONS = (
    PanelButton("Delete", "delete"),
    PanelButton("Copy", "duplicate"),
    PanelButton("Default", "start:default"),
)
_CORNER_BUTTONS = (
    PanelButton("Delete", "delete"),
    PanelButton("Cut off", "bevel"),
    PanelButton("Round", "round"),
)
OBJECT_BUTTONS: dict[str, tuple[tuple[PanelButton, ...], ...]] = {
    "vertex": ((*_CORNER_BUTTONS, PanelButton("Split", "split")),),
    "vertices": ((*_CORNER_BUTTONS, PanelButton("Align", "align:left")),),
    "boundary": (
        (
            PanelButton("Simplify", "simplify"),
            PanelButton("Straighten", "straighten"),
            PanelButton("Repair", "repair"),
        ),
    ),
    "disc": (_START_OBJECT_BUTTONS,),
    "start": (_START_OBJECT_BUTTONS,),
    "polygon": (_TURN_BUTTONS, _PATH_BUTTONS),
    "circle": (_TURN_BUTTONS, _PATH_BUTTONS),
    "wall": (_TURN_BUTTONS, _PATH_BUTTONS),
    "several": (
        _TURN_BUTTONS,
        (
            PanelButton("Unite", "unite"),
            PanelButton("Subtract", "subtract"),
            PanelButton("Intersect", "intersect"),
            PanelButton("Divide", "divide"),
        ),
        (
            PanelButton("Left", "align:left"),
            PanelButton("Center", "align:center"),
            PanelButton("Right", "align:right"),
            PanelButton("Space ↔", "distribute:x"),
        ),
        (
            PanelButton("Top", "align:top"),
            PanelButton("Middle", "align:middle"),
            PanelButton("Bottom", "align:bottom"),
            PanelButton("Space ↕", "distribute:y"),
        ),
        (
            PanelButton("Join", "join"),
            PanelButton("Polygons", "polygons"),
            PanelButton("Simplify", "simplify"),
            PanelButton("Delete", "delete"),
        ),
    ),
}
"""Rows of buttons on the page "object", by the kind of the selection; see `find_object_kind`."""

_NAMED_KINDS = ("polygon", "circle", "wall", "disc", "start")
_NOTED_KINDS = ("polygon", "circle", "wall", "several")
_SIZED_KINDS = ("polygon", "wall", "several", "boundary")


class EditorPanel(CommandPanel):
    """Panel of the editor.

    Parameters
    ----------
    editor : Editor
        The editor.
    commands : CommandTable
        The commands of the window.
    run_command : callable
        Takes the name of a command, and runs it.
    show_problem : callable
        Called after a problem was clicked.
    """

    tabs = ("map", "object", "snap", "problems", "history")
    tab_widths = (44, 56, 46, 72, 0)

    def __init__(
        self,
        editor: Editor,
        commands: CommandTable,
        run_command: Callable[[str], object],
        show_problem: Callable[[], object],
    ) -> None:
        super().__init__(commands, run_command)
        self.editor = editor
        self._show_problem = show_problem

    def update(self) -> None:
        """Request a redraw if anything that the panel shows has changed."""
        editor = self.editor
        sketch, selection = editor.displayed
        state = (
            editor.revision,
            self.tab,
            id(sketch),
            selection,
            id(editor.measurement),
        )
        if state != self.drawn_state:
            self.drawn_state = state
            self.ui.needs_redraw = True

    def list_pages(self) -> dict[str, PanelPage]:
        """Return the functions that draw the pages, by tab name."""
        return {
            "map": self._draw_map_page,
            "object": self._draw_object_page,
            "snap": self._draw_snap_page,
            "problems": self._draw_problems_page,
            "history": self._draw_history_page,
        }

    def show_content(self, ui: Ui) -> None:
        """Show the tabs and the open page."""
        ui.inset(12, 8, 12)
        count = len(self.editor.problems)
        titles: dict[str, str] = {}
        if count:
            titles = {"problems": f"Problems {min(count, MAX_PROBLEM_COUNT)}"}
        self.show_pages(ui, titles)

    def _draw_layer_check(self, ui: Ui, name: str) -> None:
        self._draw_check(ui, f"show:{name}", LAYERS[name].title, is_on=name in self.editor.shown)

    def _draw_check(self, ui: Ui, command: str, title: str, *, is_on: bool) -> None:
        tip = self.commands[command].tip
        if ui.check_box(title, key=command, value=is_on, tip=tip) is not None:
            self._run_command(command)

    def _draw_field(self, ui: Ui, cell: FieldCell) -> None:
        """Draw the label, text and unit of a field; apply the text that the user enters."""
        editor = self.editor
        field = FIELDS[cell.name]
        ui.label(cell.label, key=f"word:{cell.name}", tip=field.tip)
        text = ""
        with suppress(MapError, LookupError):
            text = field.read(editor)
        typed = ui.text_field(cell.name, text, tip=field.tip)
        if cell.unit:
            ui.label(cell.unit, key=f"unit:{cell.name}", style="unit")
        if typed is not None:
            editor.attempt(lambda: field.write(editor, typed))

    def _draw_field_pair(self, ui: Ui, *cells: FieldCell) -> None:
        longest = max(len(cell.label) for cell in cells)
        label_width = LONG_LABEL_WIDTH_PX
        if longest <= MAX_SHORT_LABEL:
            label_width = SHORT_LABEL_WIDTH_PX
        elif longest <= MAX_MEDIUM_LABEL:
            label_width = MEDIUM_LABEL_WIDTH_PX
        ui.row(label_width, 0.0, UNIT_WIDTH_PX, label_width, 0.0, UNIT_WIDTH_PX)
        for cell in cells:
            self._draw_field(ui, cell)

    def _draw_wide_field(self, ui: Ui, name: str, label: str) -> None:
        ui.row(LABEL_WIDTH_PX, 0)
        self._draw_field(ui, FieldCell(name, label))

    def _draw_map_page(self, ui: Ui) -> None:
        """Draw the page "map": name, description, facts, robots and starts."""
        with ui.scroll("map"):
            self._draw_wide_field(ui, "title", "Name")
            self._draw_wide_field(ui, "description", "About")
            ui.row(LABEL_WIDTH_PX, 0, height=FACT_HEIGHT_PX, below=2)
            for fact in list_map_facts(self.editor):
                ui.label(fact.label, style="unit", tip=fact.tip)
                ui.label(fact.text, key=f"fact:{fact.label}")
            ui.space(4)
            ui.header("Robots")
            ui.row(
                MEDIUM_LABEL_WIDTH_PX,
                0,
                UNIT_WIDTH_PX,
                TEAM_LABEL_WIDTH_PX,
                TEAM_FIELD_WIDTH_PX,
                STEP_BUTTON_WIDTH_PX,
                STEP_BUTTON_WIDTH_PX,
            )
            self._draw_field(ui, FieldCell("radius", "Radius", "m"))
            self._draw_field(ui, FieldCell("robots", "Team"))
            self.show_button(ui, "−", "fewer", small=True)
            self.show_button(ui, "+", "more", small=True)
            ui.header("Starts")
            self.show_buttons(ui, START_BUTTONS)
            ui.row()
            is_on = "robots" in self.editor.shown
            self._draw_check(ui, "show:robots", "Show the robots at the start", is_on=is_on)

    def _draw_object_page(self, ui: Ui) -> None:
        """Draw the page "object": fields and buttons for the selection, and a list of vertices or objects."""
        editor = self.editor
        kind = find_object_kind(editor)
        if kind == "nothing":
            ui.paragraph(NOTHING_SELECTED, size=SMALL_TEXT_PX + 1, color=ui.theme.faint)
            ui.space(6)
            self._draw_object_list(ui)
            return
        title = editor.selection.describe(editor.sketch)
        if editor.selection.vertices:
            title += f" of {select_owners(editor.selection).describe(editor.sketch)}"
        ui.header(title[:1].upper() + title[1:])
        self._draw_object_fields(ui, kind)
        for row in OBJECT_BUTTONS[kind]:
            self.show_buttons(ui, row)
        ui.space(4)
        if editor.vertex_owners:
            self._draw_vertex_list(ui)
        else:
            self._draw_object_list(ui)

    def _draw_object_fields(self, ui: Ui, kind: str) -> None:
        """Draw the fields that a selection of the given kind has."""
        if kind in _NAMED_KINDS:
            self._draw_wide_field(ui, "name", "Name")
        if kind in _NOTED_KINDS:
            self._draw_wide_field(ui, "note", "Note")
        if kind not in ("vertices", "start"):
            self._draw_field_pair(ui, FieldCell("x", "x", "m"), FieldCell("y", "y", "m"))
        if kind in ("circle", "disc"):
            self._draw_field_pair(ui, FieldCell("size:radius", "Radius", "m"))
        elif kind in _SIZED_KINDS:
            self._draw_field_pair(ui, FieldCell("wide", "Width", "m"), FieldCell("high", "Height", "m"))
        if kind == "wall":
            self._draw_field_pair(ui, FieldCell("width", "Thickness", "m"))

    def _draw_snap_page(self, ui: Ui) -> None:
        """Draw the page "snap": snap modes, grid, visible layers, and the background image."""
        with ui.scroll("snap"):
            ui.header("Snap to")
            ui.row(0, 0, height=CHECK_HEIGHT_PX, below=3)
            for name, mode in SNAPS.items():
                self._draw_check(ui, f"snap:{name}", mode.title, is_on=name in self.editor.snaps)
            ui.row()
            self._draw_field_pair(ui, FieldCell("grid", "Grid", "m"), FieldCell("angle", "Angle", "°"))
            ui.header("Show")
            ui.row(0, 0, height=CHECK_HEIGHT_PX, below=3)
            for name in LAYERS:
                # The team has its check box next to the starts.
                if name != "robots":
                    self._draw_layer_check(ui, name)
            self._draw_background_section(ui)

    def _draw_background_section(self, ui: Ui) -> None:
        """Draw the buttons, fields and opacity slider of the background image."""
        ui.header("Background image")
        self.show_buttons(ui, BACKGROUND_BUTTONS)
        scale = FieldCell("background:scale", "Pixel", "m")
        turn = FieldCell("background:turn", "Turn", "°")
        self._draw_field_pair(ui, scale, turn)
        ui.row(LABEL_WIDTH_PX, 0)
        ui.label("Opacity")
        background = self.editor.sketch.background
        if background is None:
            ui.slider("opacity", 0.5, 0.0, 1.0, disabled_reason="there is no background image")
            return
        opacity = ui.slider("opacity", background.opacity, 0.0, 1.0)
        if opacity is not None:
            self.editor.attempt(lambda: set_background_opacity(self.editor, round(opacity, 2)))

    def _draw_problems_page(self, ui: Ui) -> None:
        """Draw the page "problems": buttons, and a list of all problems."""
        problems = self.editor.problems
        self.show_buttons(ui, PROBLEM_BUTTONS)
        with ui.scroll("problems"):
            if not problems:
                text = "The map has no problems."
                if self.editor.measurement is None:
                    text = "Checking the map …"
                ui.paragraph(text, color=ui.theme.faint)
            for number, problem in enumerate(problems[:MAX_PROBLEMS]):
                is_fixed = self._draw_problem(ui, number, problem)
                if is_fixed:
                    # The remaining problems are those of the map before the fix.
                    return
            if len(problems) > MAX_PROBLEMS:
                ui.paragraph(f"… and {len(problems) - MAX_PROBLEMS} more", color=ui.theme.faint)

    def _draw_problem(self, ui: Ui, number: int, problem: Problem) -> bool:
        """Draw a problem with its badge and fix; return whether the user has applied the fix."""
        editor = self.editor
        fix = FIXES.get(problem.kind)
        text_width = ui.width - PROBLEM_MARGIN_PX
        columns = [BADGE_COLUMN_PX, 0.0]
        if fix is not None:
            text_width -= FIX_COLUMN_PX
            columns.append(FIX_BUTTON_WIDTH_PX)
        lines = wrap_text(problem.message, ui.px(TEXT_PX), ui.px(text_width))
        ui.row(*columns, height=(TEXT_PX + PROBLEM_LINE_GAP_PX) * len(lines) + PROBLEM_PADDING_PX, below=2)
        badge = ui.cell()
        if ui.surface is not None:
            canvas = create_flat_canvas(ui.surface, ui.theme, ui.scale)
            draw_badge(canvas, badge.centerx, badge.top + ui.px(BADGE_TOP_PX), is_error=problem.is_error)
        if ui.option("\n".join(lines), key=f"problem:{number}", highlighted=problem is editor.problem):
            editor.problem = problem
            if problem.owner is not None:
                editor.select(Selection.of(problem.owner).restrict_to(editor.sketch))
            editor.revision += 1
            self._show_problem()
        if fix is not None and ui.button(fix.title, key=f"fix:{number}", small=True):
            editor.problem = problem
            editor.attempt(lambda: fix_problem(editor))
            return True
        return False

    def _draw_history_page(self, ui: Ui) -> None:
        """Draw the page "history": a list of all steps, in which a click undoes or redoes changes."""
        history = self.editor.document.history
        self.show_buttons(ui, HISTORY_BUTTONS)
        undone = history.redo_descriptions
        steps: list[tuple[str, int]] = []  # description, and number of changes to undo (negative: redo)
        steps += [(text, k - len(undone)) for k, text in enumerate(reversed(undone))]
        steps += [(text, k) for k, text in enumerate(history.undo_descriptions)]
        steps.append(("opened", len(history.undo_descriptions)))
        with ui.scroll("history"):
            for number in ui.visible_rows(len(steps), ROW_HEIGHT_PX + 2):
                text, count = steps[number]
                mark = ""
                if count < 0:
                    mark = "undone"
                if ui.option(text, mark, key=f"step:{number}", highlighted=count == 0):
                    self.editor.undo_steps(count)

    def _draw_object_list(self, ui: Ui) -> None:
        """Draw the list of all objects, the topmost obstacle first; a click selects an object."""
        editor = self.editor
        sketch = editor.sketch
        rows: list[tuple[Owner, str]] = []  # each object with the text about its marks
        rows += [(item.key, _describe_marks(item)) for item in reversed(sketch.obstacles)]
        rows += [(name, "") for name, _ in sketch.starts]
        if sketch.boundary is not None:
            rows.append((BOUNDARY, ""))
        with ui.scroll("objects"):
            for number in ui.visible_rows(len(rows), ROW_HEIGHT_PX):
                owner, marks_text = rows[number]
                is_selected = owner in editor.selection.owners
                name = format_numbered_name(sketch, owner)
                # The quotes around the name of a start distinguish it from the key of an obstacle.
                key = f"object:{owner!r}"
                if ui.option(name, marks_text, key=key, highlighted=is_selected):
                    self._select(Selection.of(owner), editor.selection.without_vertices())

    def _draw_vertex_list(self, ui: Ui) -> None:
        """Draw the list of the vertices of the selected objects; a click selects a vertex."""
        editor = self.editor
        vertices = []
        for owner in editor.vertex_owners:
            vertices += [vertex for vertex, _ in list_vertices(editor.sketch, owner)]
        with ui.scroll("vertices"):
            for number in ui.visible_rows(len(vertices), ROW_HEIGHT_PX):
                vertex = vertices[number]
                x, y = find_position(editor.displayed[0], vertex)
                position = f"{x:.3f}      {y:.3f}  m"
                is_selected = vertex in editor.selection.vertices
                if ui.option(f"{number + 1}", position, key=f"vertex:{number}", highlighted=is_selected):
                    previous = Selection(vertices=editor.selection.vertices)
                    self._select(Selection(vertices=frozenset({vertex})), previous)

    def _select(self, clicked: Selection, previous: Selection) -> None:
        """Select the clicked objects of a list; with Shift, add them to the selection or remove them."""
        if pygame.key.get_mods() & pygame.KMOD_SHIFT:
            clicked = previous.toggle(clicked)
        self.editor.select(clicked)


def _describe_marks(item: Item) -> str:
    """Return the text next to an obstacle in the list of objects: group, and whether locked or hidden."""
    marks: list[str] = []
    if item.group:
        marks.append(item.group)
    if item.locked:
        marks.append("locked")
    if item.hidden:
        marks.append("hidden")
    return " · ".join(marks)


def find_object_kind(editor: Editor) -> str:
    """Return the kind of the selection: a key of `OBJECT_BUTTONS`, or "nothing"."""
    sketch = editor.sketch
    selection = editor.selection
    if len(selection.vertices) == 1:
        return "vertex"
    if selection.vertices:
        return "vertices"
    if len(selection.owners) > 1:
        return "several"
    if selection.boundary:
        return "boundary"
    for name in selection.starts:
        return "disc" if isinstance(sketch.get_shape(name), DiscStart) else "start"
    for key in selection.items & sketch.index_by_key.keys():
        return KINDS[type(sketch.get_item(key).shape)]
    return "nothing"
