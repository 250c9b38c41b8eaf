"""The editor's panel: file and tools stay in sight, the rest is on pages that follow the selection."""

from collections.abc import Callable

import pygame

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle, WallObstacle
from robocov.errors import counted
from robocov_app.editor.canvas.overlay import draw_badge
from robocov_app.editor.edits.density import density_label
from robocov_app.editor.edits.fixes import TITLES
from robocov_app.editor.model.selection import Selection, numbered_name, place_of, points_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner
from robocov_app.editor.ui.commands import fix_problem, whole
from robocov_app.editor.ui.editor import Editor
from robocov_app.editor.ui.fields import FIELDS
from robocov_app.editor.ui.settings import SHOWN, SNAPS
from robocov_app.render.theme import LIGHT, Theme
from robocov_app.toolkit.command import Commands
from robocov_app.toolkit.layout import Layout
from robocov_app.toolkit.overlay import flat_canvas, wrapped
from robocov_app.toolkit.ui import SMALL, TEXT, Ui

TABS = ("map", "object", "snap", "problems", "history")

ROW = 20.0  # height of a line of a list, px at scale 1
MOST_PROBLEMS = 200  # that are listed
_NAME = 62.0

_FACTS = {
    "Size": "Width and height of the boundary",
    "Free": "Area where robots can be, of that inside the boundary",
    "Parts": "Connected parts of the free space, and those that a robot can sweep",
    "Gap": "The narrowest passage, against a robot's diameter",
    "Holds": "Obstacles and their vertices",
    "Density": "How much each place counts: the tool Density; floor 0.5 and density none are commands",
}

_NOTHING = (
    "Nothing is selected. Click an obstacle, a start or the boundary; drag a box around several; "
    "Tab goes on to the next; Ctrl A takes all."
)

# rows of buttons: their words, and after them the name of the command
_FILE = ("New new|Open open|Save save|Try it try", "Undo undo|Redo redo|Keys help|Commands palette")
_STARTS = "Disc tool:disc|Points tool:places|Anywhere start:uniform|Next start:next"
_PICTURE = "Choose… background|Scale, move tool:picture|Remove background:none"
_PROBLEMS = "Next problem:next|Repair repair|Clip clip|Mend problem:fix"
_TURNS = "Turn ↺ rotate:left|Turn ↻ rotate:right|Flip ↔ mirror:x|Flip ↕ mirror:y"
_ONE = (_TURNS, "Path tool:path|Loop ↺ path:repeat|Play path:play|No path path:none")
_START = ("Delete delete|Copy duplicate|Default start:default",)
_BUTTONS = {
    "vertex": ("Delete delete|Cut off bevel|Round round|Split split",),
    "vertices": ("Delete delete|Cut off bevel|Round round|Align align:left",),
    "boundary": ("Simplify simplify|Straighten straighten|Repair repair",),
    **dict.fromkeys(("disc", "start"), _START),
    **dict.fromkeys(("polygon", "circle", "wall"), _ONE),
    "several": (
        _TURNS,
        "Unite unite|Subtract subtract|Intersect intersect|Divide divide",
        "Left align:left|Centre align:centre|Right align:right|Gaps ↔ distribute:x",
        "Top align:top|Middle align:middle|Bottom align:bottom|Gaps ↕ distribute:y",
        "Join join|Polygons polygons|Simplify simplify|Delete delete",
    ),
}
"""Buttons of the page Object, by what is selected."""


class Panel:
    """Shows the editor, and lets it be edited; `picked` is called when a problem was clicked."""

    def __init__(
        self, editor: Editor, commands: Commands, do: Callable[[str], object], picked: Callable[[], object]
    ) -> None:
        self.editor, self._commands, self._do, self._picked = editor, commands, do, picked
        self.tab = TABS[0]  # the page that is open
        self.covered = self.hidden = False  # whether something else takes the events
        self.ui = Ui(self._page, LIGHT)
        self._drawn: tuple[object, ...] = ()

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Fit another layout and theme."""
        self.hidden = not layout.panel[2]
        if self.hidden:
            self.ui.stop_typing()
        if theme is not self.ui.theme or layout.scale != self.ui.scale:
            self.ui = Ui(self._page, theme, layout.scale)
        self.ui.box, self.ui.stale = pygame.Rect(layout.panel), True

    def show_tab(self, name: str) -> None:
        """Turn to a page."""
        if name in TABS:
            self.tab, self.ui.stale = name, True

    def update(self) -> None:
        """Let the page be drawn anew when something that it shows is different."""
        editor = self.editor
        (sketch, selection), unsaved = editor.preview, editor.document.unsaved
        shows = (editor.version, self.tab, id(sketch), selection, id(editor.measurement), unsaved)
        if shows != self._drawn:
            self._drawn, self.ui.stale = shows, True

    def draw(self, screen: pygame.Surface) -> None:
        """Draw the panel and what hangs over it."""
        self.ui.draw(screen)
        self.ui.draw_over(screen)

    def take(self, event: pygame.event.Event) -> bool:
        """Give an event to the widgets; return whether one of them took it."""
        return not self.covered and not self.hidden and self.ui.take(event)

    def focus(self, name: str) -> None:
        """Let keys go into a field of the open page."""
        self.ui.run(None, None)
        self.ui.set_focus(name)

    # the page

    def _page(self, ui: Ui) -> None:
        ui.inset(12, 8, 12)
        document = self.editor.document
        ui.header(f"{document.title}{', not saved' if document.unsaved else ''}")
        for row in _FILE:
            self._buttons(ui, row)
        ui.header("TOOLS")
        ui.row(0, 0, 0, 0, below=4)
        for tool in self.editor.tools.values():
            self._does(ui, tool.title, f"tool:{tool.name}", chosen=tool is self.editor.tool)
        count = len(self.editor.problems)
        titles = {name: name.capitalize() for name in TABS}
        titles["problems"] += f" {min(count, 99)}" if count else ""
        ui.space(6)
        ui.row(44, 56, 46, 72, 0, below=8)
        for name, title in titles.items():
            if ui.button(title, key=f"tab:{name}", chosen=name == self.tab, small=True):
                self.show_tab(name)
        ui.row()
        pages = (self._map, self._object, self._snap, self._problems, self._history)
        pages[TABS.index(self.tab)](ui)

    def _does(self, ui: Ui, text: str, action: str, *, chosen: bool = False) -> None:
        key = action if ui.find("button", action) is None else f"{action}:again"
        if ui.button(text, key=key, tip=self._commands[action].tip, chosen=chosen, small=True):
            self._do(action)

    def _buttons(self, ui: Ui, row: str) -> None:
        buttons = [each.rsplit(" ", 1) for each in row.split("|")]
        ui.row(*[0.0] * len(buttons), below=4)
        for text, action in buttons:
            self._does(ui, text, action)
        ui.row()

    def _check(self, ui: Ui, kind: str, name: str, title: str) -> None:
        editor = self.editor
        chosen = editor.shown if kind == "show" else editor.snaps
        tip = self._commands[f"{kind}:{name}"].tip
        if ui.check(title, key=f"{kind}:{name}", now=name in chosen, tip=tip) is not None:
            self._do(f"{kind}:{name}")

    def _field(self, ui: Ui, name: str, word: str, unit: str = "") -> None:
        """Show a field between its word and its unit, each in a cell of its own."""
        editor, field = self.editor, FIELDS[name]
        ui.label(word, key=f"word:{name}", tip=field.tip)
        given = ui.text_entry(name, field.shown(editor), tip=field.tip)
        if unit:
            ui.label(unit, key=f"unit:{name}", style="unit")
        if given is not None:
            editor.attempt(lambda: field.take(editor, given))

    def _pair(self, ui: Ui, *fields: tuple[str, str, str]) -> None:
        names = max(len(word) for _, word, _ in fields)
        word = 14.0 if names < 3 else 48.0
        ui.row(*(width for _ in range(2) for width in (word, 0.0, 16.0)))
        for name, words, unit in fields:
            self._field(ui, name, words, unit or " ")
        ui.row()

    def _whole_row(self, ui: Ui, name: str, word: str) -> None:
        ui.row(_NAME, 0)
        self._field(ui, name, word)
        ui.row()

    # pages

    def _map(self, ui: Ui) -> None:
        with ui.scroll("map"):
            self._whole_row(ui, "title", "Name")
            self._whole_row(ui, "description", "About")
            ui.row(_NAME, 0, height=18, below=2)
            for (word, tip), said in zip(_FACTS.items(), facts(self.editor), strict=True):
                ui.label(word, style="unit", tip=tip)
                ui.label(said, key=f"fact:{word}")
            ui.space(4)
            ui.header("ROBOTS")
            ui.row(48, 0, 16, 44, 44, 23, 23)
            self._field(ui, "radius", "Radius", "m")
            self._field(ui, "robots", "Team")
            self._does(ui, "−", "fewer")
            self._does(ui, "+", "more")
            ui.header("STARTS")
            self._buttons(ui, _STARTS)
            ui.row()
            self._check(ui, "show", "robots", "Show the team there")

    def _object(self, ui: Ui) -> None:
        editor, kind = self.editor, object_kind(self.editor)
        if kind == "nothing":
            ui.words(_NOTHING, size=SMALL + 1, colour=ui.theme.faint)
            ui.space(6)
            self._things(ui)
            return
        ui.header(object_words(editor))
        if kind in ("polygon", "circle", "wall", "disc", "start"):
            self._whole_row(ui, "name", "Name")
        if kind in ("polygon", "circle", "wall", "several"):
            self._whole_row(ui, "note", "Note")
        if kind not in ("vertices", "start"):
            self._pair(ui, ("x", "x", "m"), ("y", "y", "m"))
        if kind in ("circle", "disc"):
            self._pair(ui, ("size:radius", "Radius", "m"))
        elif kind in ("polygon", "wall", "several", "boundary"):
            self._pair(ui, ("wide", "Wide", "m"), ("high", "High", "m"))
        if kind == "wall":
            self._pair(ui, ("width", "Thick", "m"))
        for row in _BUTTONS[kind]:
            self._buttons(ui, row)
        ui.space(4)
        if editor.handled:
            self._vertices(ui)
        else:
            self._things(ui)

    def _snap(self, ui: Ui) -> None:
        with ui.scroll("snap"):
            ui.header("SNAP TO")
            ui.row(0, 0, height=20, below=3)
            for name, (title, _) in SNAPS.items():
                self._check(ui, "snap", name, title)
            ui.row()
            self._pair(ui, ("grid", "Grid", "m"), ("angle", "Angle", "°"))
            ui.header("SHOW")
            ui.row(0, 0, height=20, below=3)
            for name, title in SHOWN.items():
                if name != "robots":  # which has its check box beside the starts
                    self._check(ui, "show", name, title)
            ui.header("PICTURE UNDER THE MAP")
            self._buttons(ui, _PICTURE)
            self._pair(ui, ("picture:scale", "Pixel", "m"), ("picture:turn", "Turn", "°"))
            ui.row(_NAME, 0)
            ui.label("Opacity")
            picture = self.editor.sketch.background
            why = "" if picture is not None else "there is no picture under the map"
            part = ui.slider("opacity", picture.opacity if picture is not None else 0.5, 0.0, 1.0, why=why)
            if part is not None:
                text = f"{part:.2f}"
                self.editor.attempt(lambda: FIELDS["picture:opacity"].take(self.editor, text))

    def _problems(self, ui: Ui) -> None:
        editor, problems = self.editor, self.editor.problems
        self._buttons(ui, _PROBLEMS)
        with ui.scroll("problems"):
            if not problems:
                seen = editor.measurement is not None
                said = "Nothing is wrong with the map." if seen else "Being looked at …"
                ui.words(said, colour=ui.theme.faint)
            for k, problem in enumerate(problems[:MOST_PROBLEMS]):
                mends = problem.kind in TITLES
                room = ui.wide - 26 - (66 if mends else 0)
                lines = wrapped(problem.words, ui.px(TEXT), ui.px(room - 18))
                high = (TEXT + 5) * len(lines) + 8
                ui.row(20, 0, *([54] if mends else []), height=high, below=2)
                badge = ui.cell()
                if ui.surface is not None:
                    canvas = flat_canvas(ui.surface, ui.theme, ui.scale)
                    draw_badge(canvas, badge.centerx, badge.top + ui.px(13), grave=problem.grave)
                if ui.option("\n".join(lines), key=f"problem:{k}", chosen=problem is editor.problem):
                    editor.problem = problem
                    if problem.of is not None:
                        editor.select(Selection.of(problem.of).within(editor.sketch))
                    editor.version += 1
                    self._picked()
                if mends and ui.button(TITLES[problem.kind], key=f"mend:{k}", small=True):
                    editor.problem = problem
                    editor.attempt(lambda: fix_problem(editor))
                    return  # these problems are of the map before
            if len(problems) > MOST_PROBLEMS:
                ui.words(f"… and {len(problems) - MOST_PROBLEMS} more", colour=ui.theme.faint)

    def _history(self, ui: Ui) -> None:
        history = self.editor.document.history
        self._buttons(ui, "Undo undo|Redo redo")
        steps = [(words, k - len(history.future)) for k, words in enumerate(reversed(history.future))]
        steps += [(words, k) for k, words in enumerate(history.past)]
        steps.append(("as it was opened", len(history.past)))
        with ui.scroll("history"):
            for k in ui.visible_rows(len(steps), ROW + 2):
                done, count = steps[k]
                aside = "undone" if count < 0 else ""
                if ui.option(done, aside, key=f"step:{k}", chosen=count == 0):
                    self.editor.travel(count)

    # lists

    def _things(self, ui: Ui) -> None:
        """Show all things of the map, the topmost first, also those that are locked or hidden."""
        editor, sketch = self.editor, self.editor.sketch
        things: list[tuple[Owner, str]] = []
        for item in reversed(sketch.obstacles):
            marks = [item.group, "locked" if item.locked else "", "hidden" if item.hidden else ""]
            things.append((item.key, " · ".join(filter(None, marks))))
        things += [(name, "") for name, _ in sketch.starts]
        things += [(BOUNDARY, "")] if sketch.boundary is not None else []
        with ui.scroll("things"):
            for k in ui.visible_rows(len(things), ROW):
                owner, said = things[k]
                chosen = owner in editor.selection.owners
                if ui.option(numbered_name(sketch, owner), said, key=f"thing:{owner}", chosen=chosen):
                    self._pick(Selection.of(owner), editor.selection.without_vertices())

    def _vertices(self, ui: Ui) -> None:
        """Show the vertices of what is selected, with their coordinates; in a drag, where they are by now."""
        editor = self.editor
        found = [vertex for owner in editor.handled for vertex, _ in points_of(editor.sketch, owner)]
        with ui.scroll("vertices"):
            for k in ui.visible_rows(len(found), ROW):
                vertex = found[k]
                x, y = place_of(editor.preview[0], vertex)
                chosen = vertex in editor.selection.vertices
                if ui.option(f"{k + 1}", f"{x:.3f}      {y:.3f}  m", key=f"vertex:{k}", chosen=chosen):
                    before = Selection(vertices=editor.selection.vertices)
                    self._pick(Selection(vertices=frozenset({vertex})), before)

    def _pick(self, own: Selection, before: Selection) -> None:
        """Select something; with Shift besides what was before."""
        shift = pygame.key.get_mods() & pygame.KMOD_SHIFT
        self.editor.select(before.toggled(own) if shift else own)


def object_kind(editor: Editor) -> str:
    """Return what kind of thing is selected, on which it depends what the page offers."""
    selection = editor.selection
    if not selection:
        return "nothing"
    if selection.vertices:
        return "vertex" if len(selection.vertices) == 1 else "vertices"
    if len(selection.owners) > 1:
        return "several"
    if selection.boundary:
        return "boundary"
    if selection.starts:
        (name,) = selection.starts
        spec = dict(editor.sketch.starts).get(name)
        return "disc" if isinstance(spec, DiscStart) else "start"
    (key,) = selection.items
    if key not in editor.sketch.places:
        return "nothing"
    shape = editor.sketch.item(key).shape
    return {PolygonObstacle: "polygon", CircleObstacle: "circle", WallObstacle: "wall"}[type(shape)]


def object_words(editor: Editor) -> str:
    """Return what the object page is about."""
    selection = editor.selection
    if selection.vertices:
        return f"{selection.words(editor.sketch)} of {whole(selection).words(editor.sketch)}".upper()
    if selection.owners == {BOUNDARY}:
        return "BOUNDARY"
    return selection.words(editor.sketch).upper()


def facts(editor: Editor) -> tuple[str, ...]:
    """Return what the map page says of the map, in the order of its words."""
    sketch, measurement = editor.sketch, editor.measurement
    size, ring = "no boundary yet: B draws one", sketch.boundary
    if ring:
        xs, ys = zip(*ring, strict=True)
        size = f"{max(xs) - min(xs):.2f} x {max(ys) - min(ys):.2f} m"
    if measurement is None:
        return (size, "…", "…", "…", "…", density_label(sketch.density))
    parts, reached = len(measurement.components), len(measurement.reached)
    narrowest, gap, diameter = "none", measurement.gap, 2 * measurement.radius
    if gap is not None:
        narrowest = f"{gap.width:.3f} m {'≥' if gap.width >= diameter else '<'} {diameter:.2f} m"
    return (
        size,
        f"{measurement.free_area:.2f} m²",
        f"{parts}" if parts == reached else f"{parts}; {reached} for a robot",
        narrowest,
        f"{counted(len(sketch.obstacles), 'obstacle')}, {measurement.vertices} vertices",
        density_label(sketch.density),
    )
