"""The pages of the editor's panel: the map, what is selected, snapping and showing, problems."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle, WallObstacle
from robocov_app.editor.edits.density import density_words
from robocov_app.editor.model.sketch import BOUNDARY
from robocov_app.editor.ui.commands import all_commands, whole
from robocov_app.editor.ui.fields import FIELDS
from robocov_app.editor.ui.settings import SHOWN, SNAPS
from robocov_app.viewer.actions import key_words
from robocov_app.viewer.pages import GAP, MARGIN, WIDE, columns

if TYPE_CHECKING:
    from robocov_app.editor.ui.editor import Editor
    from robocov_app.viewer.widgets import Widgets

ROW = 29
"""Pixels at scale 1 from one row of fields to the next."""

_NAME = 62
"""Pixels at scale 1 that the word before a field takes."""

FACTS = ("size", "free", "parts", "gap", "count", "density")
_FACT_WORDS = {
    "size": "Size",
    "free": "Free",
    "parts": "Parts",
    "gap": "Gap",
    "count": "Holds",
    "density": "Density",
}
_FACT_TIPS = {
    "size": "Width and height of the boundary",
    "free": "Area where robots can be, of that inside the boundary",
    "parts": "Connected parts of the free space, and those that a robot can sweep",
    "gap": "The narrowest passage, against a robot's diameter",
    "count": "Obstacles and their vertices",
    "density": "How much each place counts: the tool Density; floor 0.5 and density none are commands",
}


def field(
    widgets: Widgets, desk: Editor, name: str, place: tuple[float, float, float], word: str, unit: str = ""
) -> None:
    """Make a field with a word before it and its unit after it; what is typed goes to the desk."""
    x, y, wide = place
    spec = FIELDS[name]
    before = _NAME if wide > 160 else 14 if len(word) < 3 else 48
    after = 10 + 7 * len(unit) if unit else 0
    widgets.label(word, widgets.rect(x, y, before, 26), tip=spec.tip)
    rect = widgets.rect(x + before, y, wide - before - after, 26)
    widgets.entry(name, spec.text(desk), rect, lambda text: desk.attempt(lambda: spec.take(desk, text)))
    if unit:
        widgets.label(unit, widgets.rect(x + wide - after + 5, y, after, 26), style="#unit")


def map_page(widgets: Widgets, desk: Editor, top: float) -> None:
    """Name and description, what the map is like, robots and starts."""

    def build(bar: float) -> None:
        wide = WIDE - bar
        field(widgets, desk, "title", (MARGIN, 0, wide), "Name")
        field(widgets, desk, "description", (MARGIN, ROW, wide), "About")
        y = 2 * ROW + 4.0
        for name in FACTS:
            tip = _FACT_TIPS[name]
            widgets.label(_FACT_WORDS[name], widgets.rect(MARGIN, y, _NAME, 20), style="#unit", tip=tip)
            rect = widgets.rect(MARGIN + _NAME, y, wide - _NAME, 20)
            widgets.label(" " * 60, rect, name=f"fact:{name}")
            y += 20
        y += 6
        widgets.label("ROBOTS", widgets.rect(MARGIN, y, wide, 18), style="#header")
        y += 20
        (left, half), (right, _) = columns(2, wide)
        field(widgets, desk, "radius", (left, y, half), "Radius", "m")
        field(widgets, desk, "robots", (right, y, half - 54), "Team")
        widgets.does("−", widgets.rect(right + half - 50, y, 23, 26), "fewer")
        widgets.does("+", widgets.rect(right + half - 24, y, 23, 26), "more")
        y += ROW + 4
        widgets.label("STARTS", widgets.rect(MARGIN, y, wide, 18), style="#header")
        y += 20
        does = (
            ("Disc", "tool:disc"),
            ("Points", "tool:places"),
            ("Anywhere", "start:uniform"),
            ("Next", "start:next"),
        )
        for (x, width), (text, action) in zip(columns(4, wide), does, strict=True):
            widgets.does(text, widgets.rect(x, y, width, 26), action)
        y += 30
        rect = widgets.rect(MARGIN, y, 17, 17)

        def show(on: bool) -> None:
            if on != ("robots" in desk.shown):
                desk.attempt(lambda: desk.switch("show", "robots"))

        widgets.check("show:robots", "Show the team there", rect, "robots" in desk.shown, show, "A")

    widgets.page("map", top, 2 * ROW + 4 + 20 * len(FACTS) + 6 + 20 + ROW + 4 + 20 + 30 + 22, build)


def object_kind(desk: Editor) -> str:
    """Return what kind of thing is selected, on which it depends what the page offers."""
    selection = desk.selection
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
        spec = dict(desk.sketch.starts).get(name)
        return "disc" if isinstance(spec, DiscStart) else "start"
    (key,) = selection.items
    if key not in desk.sketch.places:
        return "nothing"
    shape = desk.sketch.item(key).shape
    return {PolygonObstacle: "polygon", CircleObstacle: "circle", WallObstacle: "wall"}[type(shape)]


OBJECT_HEIGHTS = {
    "nothing": 92,
    "vertex": ROW + 62,
    "vertices": 62,
    "several": 3 * ROW + 212,
    "boundary": 2 * ROW + 62,
    "disc": 3 * ROW + 62,
    "start": ROW + 62,
    "polygon": 4 * ROW + 96,
    "circle": 4 * ROW + 96,
    "wall": 5 * ROW + 96,
}
"""Pixels at scale 1 that the page's widgets are high; below them is the list of vertices."""


def object_page(widgets: Widgets, desk: Editor, top: float) -> None:
    """What is selected: its name, place and size, typed; and what can be done with it."""
    kind = object_kind(desk)

    def build(bar: float) -> None:
        wide = WIDE - bar
        y = 0.0
        if kind == "nothing":
            words = (
                "Nothing is selected.",
                "Click an obstacle, a start or the boundary;",
                "drag a box around several; Tab goes on",
                "to the next; Ctrl A takes all.",
            )
            for line in words:
                widgets.label(line, widgets.rect(MARGIN, y, wide, 20), style="#unit")
                y += 21
            return
        widgets.label(" " * 60, widgets.rect(MARGIN, y, wide, 18), name="object", style="#header")
        y += 22
        if kind in ("polygon", "circle", "wall", "disc", "start"):
            field(widgets, desk, "name", (MARGIN, y, wide), "Name")
            y += ROW
        if kind in ("polygon", "circle", "wall", "several"):
            field(widgets, desk, "note", (MARGIN, y, wide), "Note")
            y += ROW
        (left, half), (right, _) = columns(2, wide)
        if kind not in ("vertices", "start"):
            field(widgets, desk, "x", (left, y, half), "x", "m")
            field(widgets, desk, "y", (right, y, half), "y", "m")
            y += ROW
        if kind in ("circle", "disc"):
            field(widgets, desk, "size:radius", (left, y, half), "Radius", "m")
            y += ROW
        elif kind in ("polygon", "wall", "several", "boundary"):
            field(widgets, desk, "wide", (left, y, half), "Wide", "m")
            field(widgets, desk, "high", (right, y, half), "High", "m")
            y += ROW
        if kind == "wall":
            field(widgets, desk, "width", (left, y, half), "Thick", "m")
            y += ROW
        _buttons(widgets, kind, y + 2, wide)

    widgets.page(("object", kind), top, OBJECT_HEIGHTS[kind], build)


def _buttons(widgets: Widgets, kind: str, y: float, wide: float) -> None:
    rows: list[tuple[tuple[str, str], ...]] = []
    turns = (
        ("Turn ↺", "rotate:left"),
        ("Turn ↻", "rotate:right"),
        ("Flip ↔", "mirror:x"),
        ("Flip ↕", "mirror:y"),
    )
    if kind == "vertex":
        rows = [(("Delete", "delete"), ("Cut off", "bevel"), ("Round", "round"), ("Split", "split"))]
    elif kind == "vertices":
        rows = [(("Delete", "delete"), ("Cut off", "bevel"), ("Round", "round"), ("Align", "align:left"))]
    elif kind == "boundary":
        rows = [(("Simplify", "simplify"), ("Straighten", "straighten"), ("Repair", "repair"))]
    elif kind in ("disc", "start"):
        rows = [(("Delete", "delete"), ("Copy", "duplicate"), ("Default", "start:default"))]
    elif kind == "several":
        rows = [
            turns,
            (("Unite", "unite"), ("Subtract", "subtract"), ("Intersect", "intersect"), ("Divide", "divide")),
            (
                ("Left", "align:left"),
                ("Centre", "align:centre"),
                ("Right", "align:right"),
                ("Gaps ↔", "distribute:x"),
            ),
            (
                ("Top", "align:top"),
                ("Middle", "align:middle"),
                ("Bottom", "align:bottom"),
                ("Gaps ↕", "distribute:y"),
            ),
            (("Join", "join"), ("Polygons", "polygons"), ("Simplify", "simplify"), ("Delete", "delete")),
        ]
    else:
        path = (("Path", "tool:path"), ("Loop ↺", "path:repeat"), ("Play", "path:play"))
        rows = [turns, (*path, ("No path", "path:none"))]
    for row in rows:
        for (x, width), (text, action) in zip(columns(len(row), wide), row, strict=True):
            widgets.does(text, widgets.rect(x, y, width, 26), action, style="#small")
        y += 30


def snap_page(widgets: Widgets, desk: Editor, top: float) -> None:
    """What is snapped to, what is shown, and the picture under the map."""
    keys = {action.name: action for action in all_commands()}

    def box(kind: str, name: str, title: str, x: float, y: float) -> None:
        def switch(on: bool) -> None:
            chosen = desk.shown if kind == "show" else desk.snaps
            if on != (name in chosen):
                desk.attempt(lambda: desk.switch(kind, name))

        chosen = desk.shown if kind == "show" else desk.snaps
        tip = key_words(keys[f"{kind}:{name}"].keys[0])
        place = "page" if kind == "show" else kind
        widgets.check(f"{place}:{name}", title, widgets.rect(x, y, 17, 17), name in chosen, switch, tip)

    def build(bar: float) -> None:
        wide = WIDE - bar
        (left, half), (right, _) = columns(2, wide)
        widgets.label("SNAP TO", widgets.rect(MARGIN, 0, wide, 18), style="#header")
        y = 22.0
        for k, (name, (title, _)) in enumerate(SNAPS.items()):
            box("snap", name, title, (left, right)[k % 2], y + 23 * (k // 2))
        y += 23 * 3 + 4
        field(widgets, desk, "grid", (left, y, half), "Grid", "m")
        field(widgets, desk, "angle", (right, y, half), "Angle", "°")
        y += ROW + 4
        widgets.label("SHOW", widgets.rect(MARGIN, y, wide, 18), style="#header")
        y += 22
        names = [(name, title) for name, title in SHOWN.items() if name != "robots"]
        for k, (name, title) in enumerate(names):
            box("show", name, title, (left, right)[k % 2], y + 23 * (k // 2))
        y += 23 * (-(-len(names) // 2)) + 4
        widgets.label("PICTURE UNDER THE MAP", widgets.rect(MARGIN, y, wide, 18), style="#header")
        y += 22
        does = (("Choose…", "background"), ("Scale, move", "tool:picture"), ("Remove", "background:none"))
        for (x, width), (text, action) in zip(columns(3, wide), does, strict=True):
            widgets.does(text, widgets.rect(x, y, width, 26), action)
        y += ROW + 2
        field(widgets, desk, "picture:scale", (left, y, half), "Pixel", "m")
        field(widgets, desk, "picture:turn", (right, y, half), "Turn", "°")
        y += ROW
        widgets.label("Opacity", widgets.rect(MARGIN, y, 56, 24))

        def fade(part: float) -> None:
            FIELDS["picture:opacity"].take(desk, f"{part:.2f}")

        slider = widgets.rect(MARGIN + 60, y + 5, wide - 60, 14)
        widgets.slider("opacity", slider, 0.5, (0.0, 1.0), lambda part: desk.attempt(lambda: fade(part)))

    rows = -(-(len(SHOWN) - 1) // 2)
    widgets.page("snap", top, 22 + 73 + ROW + 4 + 22 + 23 * rows + 4 + 22 + 2 * ROW + 2 + 26, build)


def problems_page(widgets: Widgets, top: float) -> None:
    """Buttons above the list of problems, which is drawn, not written into widgets."""

    def build(_: float) -> None:
        does = (("Next", "problem:next"), ("Repair", "repair"), ("Clip", "clip"), ("Mend", "problem:fix"))
        for (x, width), (text, action) in zip(columns(4), does, strict=True):
            widgets.does(text, widgets.rect(x, 2, width, 26), action)

    widgets.page("problems", top, 34, build)


def history_page(widgets: Widgets, top: float) -> None:
    """Buttons above the list of what was done, which is drawn."""

    def build(_: float) -> None:
        for (x, width), (text, action) in zip(columns(2), (("Undo", "undo"), ("Redo", "redo")), strict=True):
            widgets.does(text, widgets.rect(x, 2, width, 26), action)

    widgets.page("history", top, 34, build)


def facts(desk: Editor) -> dict[str, str]:
    """Return what the map page says of the map."""
    sketch, measurement = desk.sketch, desk.measurement
    said = dict.fromkeys(FACTS, "…")
    said["density"] = density_words(sketch.density)
    ring = sketch.boundary
    if ring:
        xs, ys = [x for x, _ in ring], [y for _, y in ring]
        said["size"] = f"{max(xs) - min(xs):.2f} x {max(ys) - min(ys):.2f} m"
    else:
        said["size"] = "no boundary yet: B draws one"
    if measurement is not None:
        said["free"] = f"{measurement.free_area:.2f} m²"
        parts, reached = len(measurement.components), len(measurement.reached)
        said["parts"] = f"{parts}" if parts == reached else f"{parts}; {reached} for a robot"
        gap = measurement.gap
        sign = "" if gap is None else "≥" if gap.width >= 2 * measurement.radius else "<"
        said["gap"] = "none" if gap is None else f"{gap.width:.3f} m {sign} {2 * measurement.radius:.2f} m"
        count = len(sketch.obstacles)
        said["count"] = f"{count} obstacle{'' if count == 1 else 's'}, {measurement.vertices} vertices"
    return said


def object_words(desk: Editor) -> str:
    """Return what the object page is about."""
    selection = desk.selection
    if not selection:
        return ""
    if selection.vertices:
        owners = whole(selection)
        return f"{selection.words(desk.sketch)} of {owners.words(desk.sketch)}".upper()
    if selection.owners == {BOUNDARY}:
        return "BOUNDARY"
    return selection.words(desk.sketch).upper()


__all__ = [
    "FACTS",
    "GAP",
    "OBJECT_HEIGHTS",
    "facts",
    "field",
    "history_page",
    "map_page",
    "object_kind",
    "object_page",
    "object_words",
    "problems_page",
    "snap_page",
]
