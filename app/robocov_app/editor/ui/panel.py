"""The editor's panel: its pages follow the selection, and their fields show and take values."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import pygame

from robocov.environment import CircleObstacle, DiscStart
from robocov.errors import MapError, format_count
from robocov_app.editor.canvas.overlay import draw_badge
from robocov_app.editor.edits import density, fixes, properties, transform
from robocov_app.editor.model import require
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.coordinates import angle_of, length_of, point_of
from robocov_app.editor.model.selection import Selection, numbered_name, place_of, points_of
from robocov_app.editor.model.sketch import BOUNDARY, KINDS, Owner
from robocov_app.editor.tools.snapping import SNAPS
from robocov_app.editor.ui.commands import TYPED, common_measure, fix_problem, move, rename, run_typed, whole
from robocov_app.editor.ui.editor import KEPT, SHOWN, Editor
from robocov_app.toolkit.command import Commands
from robocov_app.toolkit.overlay import flat_canvas, wrapped
from robocov_app.toolkit.ui import SMALL, TEXT, SidePanel, Ui


class Field(NamedTuple):
    """A field of the panel."""

    text: Callable[[Editor], str]  # what it shows; MapError or LookupError where there is no such value
    take: Callable[[Editor, str], object]  # takes what was typed; MapError where that means nothing
    tip: str


def number(value: float | None) -> str:
    """Return a number as it stands in a field: to the tenth of a millimetre, without needless zeros."""
    return "" if value is None else f"{round(value, 4) + 0.0:.12g}"


def _box(editor: Editor) -> tuple[float, float, float, float]:
    """Return the place of a vertex, a centre, or a box's lower left corner, and the box's sides, m."""
    sketch, selection = editor.preview
    x, y, high_x, high_y = require(transform.bounds_of(sketch, whole(selection)), "nothing is selected")
    sides = high_x - x, high_y - y
    if len(selection.vertices) == 1:
        x, y = place_of(sketch, *selection.vertices)
    elif not selection.vertices and len(selection.owners) == 1:
        thing = sketch.thing(*selection.owners)
        if isinstance(thing, CircleObstacle | DiscStart):
            x, y = thing.center
    return x, y, *sides


def _put(editor: Editor, text: str, axis: int) -> None:
    """Move what is selected to a coordinate: a number with a unit or without, or a step as ``+0.5``."""
    now, text = _box(editor)[axis], text.strip()
    if text.startswith(("+", "@")):
        by = length_of(text.lstrip("+@"))
    else:  # two coordinates are read where only one is typed, so that signs and units mean the same
        by = point_of(f"{text} 0", last=(now, 0.0))[0] - now
    dx, dy = (by, 0.0) if axis == 0 else (0.0, by)
    editor.change(move(editor, dx, dy, editor.selection))


def _resize(editor: Editor, text: str, axis: int) -> None:
    """Give what is selected a typed width or height; the other stays, but of circles."""
    sides = list(_box(editor)[2:])
    sides[axis] = length_of(text, now=sides[axis])
    wide, high = (side or None for side in sides)
    editor.change(transform.resized(editor.sketch, whole(editor.selection), wide, high))


def _shown_name(editor: Editor) -> str:
    (owner,) = whole(editor.selection).owners
    return owner if isinstance(owner, str) else editor.sketch.item(owner).shape.name or ""


def _shown_note(editor: Editor) -> str:
    notes = {editor.sketch.item(key).note for key in editor.selection.items}
    return notes.pop() if len(notes) == 1 else ""


def _picture(editor: Editor) -> Background:
    return require(editor.sketch.background, "there is no picture under the map: Ctrl B takes one")


def _lay(editor: Editor, drag: str | None = None, **changes: float) -> None:
    editor.change(properties.underlaid(editor.sketch, replace(_picture(editor), **changes)), drag=drag)  # type: ignore[arg-type]


def _set_scale(editor: Editor, text: str) -> None:
    scale = length_of(text, now=_picture(editor).scale)
    require(scale > 0.0, "a pixel must be larger than 0 m")
    _lay(editor, scale=scale)


def _turn(editor: Editor, text: str) -> None:
    _lay(editor, turn=angle_of(text))


def _typed(word: str, tip: str) -> Field:
    return Field(lambda editor: number(getattr(editor, KEPT[word])), partial(run_typed, word=word), tip)


def _titled(name: str, tip: str) -> Field:
    def take(editor: Editor, text: str) -> None:
        editor.change(properties.titled(editor.sketch, **{name: text.strip()}))

    return Field(lambda editor: str(getattr(editor.sketch, name)), take, tip)


def _measure(name: str, word: str, tip: str) -> Field:
    return Field(lambda editor: number(common_measure(editor, name)), TYPED[word][1], tip)


def _of_box(part: int, take: Callable[..., None], tip: str) -> Field:
    return Field(lambda editor: number(_box(editor)[part]), partial(take, axis=part % 2), tip)


FIELDS: dict[str, Field] = {
    "title": _titled("name", "The map's name, for people"),
    "description": _titled("description", "A sentence about the map"),
    "radius": _typed("radius", "Radius of a robot: what is too narrow for it is hatched"),
    "robots": _typed("robots", "Robots of the team that is shown at a start, and tried with F5"),
    "grid": _typed("grid", "Distance of the grid's lines; arrows move by it"),
    "angle": _typed("angle", "Lines snap to multiples of this"),
    "name": Field(_shown_name, rename, "What people call it"),
    "note": Field(_shown_note, TYPED["note"][1], "Whatever is worth remembering of it"),
    "x": _of_box(0, _put, "From the left; +0.5 moves by half a metre"),
    "y": _of_box(1, _put, "From below; +0.5 moves by half a metre"),
    "wide": _of_box(2, _resize, "Also *2, 50% or +0.3"),
    "high": _of_box(3, _resize, "Also *2, 50% or +0.3"),
    "width": _measure("width", "width", "How thick the wall is"),
    "size:radius": _measure("radius", "circle", "Its radius"),
    "picture:scale": Field(lambda editor: f"{_picture(editor).scale:.6g}", _set_scale, "Side of a pixel"),
    "picture:turn": Field(lambda editor: number(_picture(editor).turn), _turn, "Counter-clockwise"),
}


TABS = ("map", "object", "snap", "problems", "history")
ROW = 20.0  # height of a line of a list, px at scale 1
MOST_PROBLEMS = 200  # that are listed
_NAME = 62.0
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
_PATH = "Path tool:path|Loop ↺ path:repeat|Play path:play|No path path:none"
_BUTTONS = {  # of the page Object, by what is selected
    "vertex": ("Delete delete|Cut off bevel|Round round|Split split",),
    "vertices": ("Delete delete|Cut off bevel|Round round|Align align:left",),
    "boundary": ("Simplify simplify|Straighten straighten|Repair repair",),
    **dict.fromkeys(("disc", "start"), ("Delete delete|Copy duplicate|Default start:default",)),
    **dict.fromkeys(("polygon", "circle", "wall"), (_TURNS, _PATH)),
    "several": (
        _TURNS,
        "Unite unite|Subtract subtract|Intersect intersect|Divide divide",
        "Left align:left|Centre align:centre|Right align:right|Gaps ↔ distribute:x",
        "Top align:top|Middle align:middle|Bottom align:bottom|Gaps ↕ distribute:y",
        "Join join|Polygons polygons|Simplify simplify|Delete delete",
    ),
}


class Panel(SidePanel):
    """Shows the editor, and lets it be edited; `picked` is called when a problem was clicked."""

    def __init__(
        self, editor: Editor, commands: Commands, do: Callable[[str], object], picked: Callable[[], object]
    ) -> None:
        self.editor, self._commands, self._do, self._picked = editor, commands, do, picked
        super().__init__(TABS[0])

    def show_tab(self, name: str) -> None:
        if name in TABS:
            self.tab, self.ui.stale = name, True

    def update(self) -> None:
        editor = self.editor
        (sketch, selection), unsaved = editor.preview, editor.document.history.unsaved
        shows = (editor.version, self.tab, id(sketch), selection, id(editor.measurement), unsaved)
        if shows != self._drawn:
            self._drawn, self.ui.stale = shows, True

    def _page(self, ui: Ui) -> None:
        ui.inset(12, 8, 12)
        document = self.editor.document
        ui.header(f"{document.title}{', not saved' if document.history.unsaved else ''}")
        for row in _FILE:
            self._buttons(ui, row)
        ui.header("TOOLS")
        ui.row(0, 0, 0, 0, below=4)
        for tool in self.editor.tools.values():
            self._does(ui, tool.title, f"tool:{tool.name}", chosen=tool is self.editor.tool)
        count = len(self.editor.problems)
        ui.space(6)
        titles = {"problems": f"Problems {min(count, 99)}"} if count else {}
        if (tab := ui.tabs("tab", TABS, self.tab, 44, 56, 46, 72, 0, titles=titles)) is not None:
            self.show_tab(tab)
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

    def _check(self, ui: Ui, kind: str, name: str, title: str) -> None:
        editor = self.editor
        chosen = editor.shown if kind == "show" else editor.snaps
        tip = self._commands[f"{kind}:{name}"].tip
        if ui.check(title, key=f"{kind}:{name}", now=name in chosen, tip=tip) is not None:
            self._do(f"{kind}:{name}")

    def _field(self, ui: Ui, name: str, word: str, unit: str = "") -> None:
        editor, field = self.editor, FIELDS[name]
        ui.label(word, key=f"word:{name}", tip=field.tip)
        text = ""
        with suppress(MapError, LookupError):
            text = field.text(editor)
        given = ui.text_entry(name, text, tip=field.tip)
        if unit:
            ui.label(unit, key=f"unit:{name}", style="unit")
        if given is not None:
            editor.attempt(lambda: field.take(editor, given))

    def _pair(self, ui: Ui, *fields: tuple[str, str, str]) -> None:
        word = 14.0 if max(len(word) for _, word, _ in fields) < 3 else 48.0
        ui.row(*(width for _ in range(2) for width in (word, 0.0, 16.0)))
        for name, words, unit in fields:
            self._field(ui, name, words, unit or " ")

    def _whole_row(self, ui: Ui, name: str, word: str) -> None:
        ui.row(_NAME, 0)
        self._field(ui, name, word)

    def _map(self, ui: Ui) -> None:
        with ui.scroll("map"):
            self._whole_row(ui, "title", "Name")
            self._whole_row(ui, "description", "About")
            ui.row(_NAME, 0, height=18, below=2)
            for word, said, tip in facts(self.editor):
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
        words = editor.selection.words(editor.sketch)
        if editor.selection.vertices:
            words += f" of {whole(editor.selection).words(editor.sketch)}"
        ui.header(words.upper())
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
                self.editor.attempt(lambda: _lay(self.editor, "opacity", opacity=round(part, 2)))

    def _problems(self, ui: Ui) -> None:
        editor, problems = self.editor, self.editor.problems
        self._buttons(ui, _PROBLEMS)
        with ui.scroll("problems"):
            if not problems:
                seen = editor.measurement is not None
                words = "Nothing is wrong with the map." if seen else "Being looked at …"
                ui.words(words, colour=ui.theme.faint)
            for k, problem in enumerate(problems[:MOST_PROBLEMS]):
                mends = problem.kind in fixes.TITLES
                lines = wrapped(problem.words, ui.px(TEXT), ui.px(ui.wide - 44 - (66 if mends else 0)))
                ui.row(20, 0, *([54] if mends else []), height=(TEXT + 5) * len(lines) + 8, below=2)
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
                if mends and ui.button(fixes.TITLES[problem.kind], key=f"mend:{k}", small=True):
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
                if ui.option(done, "undone" if count < 0 else "", key=f"step:{k}", chosen=count == 0):
                    self.editor.travel(count)

    def _things(self, ui: Ui) -> None:
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
        self.editor.select(before.toggled(own) if pygame.key.get_mods() & pygame.KMOD_SHIFT else own)


def object_kind(editor: Editor) -> str:
    sketch, selection = editor.sketch, editor.selection
    if selection.vertices:
        return "vertex" if len(selection.vertices) == 1 else "vertices"
    if len(selection.owners) > 1:
        return "several"
    if selection.boundary:
        return "boundary"
    for name in selection.starts:
        return "disc" if isinstance(dict(sketch.starts).get(name), DiscStart) else "start"
    for key in selection.items & sketch.places.keys():
        return KINDS[type(sketch.item(key).shape)]
    return "nothing"


def facts(editor: Editor) -> tuple[tuple[str, str, str], ...]:
    """Return what the map page says of the map: a word, what is said, and a tip."""
    sketch, measurement = editor.sketch, editor.measurement
    size, free, parts, narrowest, holds = "no boundary yet: B draws one", "…", "…", "…", "…"
    if sketch.boundary:
        xs, ys = zip(*sketch.boundary, strict=True)
        size = f"{max(xs) - min(xs):.2f} x {max(ys) - min(ys):.2f} m"
    if measurement is not None:
        count, reached = len(measurement.components), len(measurement.reached)
        gap, diameter = measurement.gap, 2 * measurement.radius
        free = f"{measurement.free_area:.2f} m²"
        parts = f"{count}" if count == reached else f"{count}; {reached} for a robot"
        holds = f"{format_count(len(sketch.obstacles), 'obstacle')}, {measurement.vertices} vertices"
        sign = "≥" if gap is not None and gap.width >= diameter else "<"
        narrowest = "none" if gap is None else f"{gap.width:.3f} m {sign} {diameter:.2f} m"
    counts = "How much each place counts: the tool Density; floor 0.5 and density none are commands"
    return (
        ("Size", size, "Width and height of the boundary"),
        ("Free", free, "Area where robots can be, of that inside the boundary"),
        ("Parts", parts, "Connected parts of the free space, and those that a robot can sweep"),
        ("Gap", narrowest, "The narrowest passage, against a robot's diameter"),
        ("Holds", holds, "Obstacles and their vertices"),
        ("Density", density.density_label(sketch.density), counts),
    )
