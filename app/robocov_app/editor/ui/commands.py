"""Everything that the editor does, by key, menu, button, palette or typed value."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

from robocov.environment import Point, PolygonObstacle, WallObstacle
from robocov.errors import MapError, unknown_name
from robocov_app.editor.edits import (
    boolean,
    create,
    fixes,
    motion_path,
    properties,
    simplify,
    transform,
    vertices,
)
from robocov_app.editor.edits import density as density_edits
from robocov_app.editor.edits.clipboard import copied, pasted
from robocov_app.editor.edits.transform import bounds_of
from robocov_app.editor.model.coordinates import angle_of, length_of, point_of, size_of
from robocov_app.editor.model.selection import Change, Selection, Vertex, place_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner
from robocov_app.editor.tools.density import DensityTool
from robocov_app.editor.tools.draw import MeasureTool
from robocov_app.editor.ui.editor import Editor
from robocov_app.editor.ui.settings import SHOWN, SNAPS
from robocov_app.toolkit.command import Command, Takes, parted

FAR = 10
"""How many times farther arrows nudge with Shift."""

FINGER = 12.0
"""Pixels at scale 1 that a finger is wide."""

WIDER = 1.25

TOLERANCE = 0.02
"""Metres that simplified outlines may be off."""

GHOST = "Type a command, or  rotate 30 · grid 0.25 · width 0.2 · size 3 x 2 · robots 8"

_SEPARATE = ""


class Row(NamedTuple):
    """A command of a group: keys separated by commas; `run` is None where the window does it."""

    name: str
    title: str
    keys: str = ""
    run: Callable[[Editor], object] | None = None
    repeats: bool = False


class Typed(NamedTuple):
    """A command with a value after it: an example of one with what it is, and what it does."""

    example: str
    run: Callable[[Editor, str], object]


# what commands do


def edited(edit: Callable[..., Change], *rest: object, single: bool = False) -> Callable[[Editor], None]:
    """Return what makes an edit of the selected things; with `single`, of single vertices if some are."""
    return lambda editor: _do(editor, edit, *rest, single=single)


def _do(editor: Editor, edit: Callable[..., Change], *rest: object, single: bool = False) -> None:
    """Make an edit of whole things; with `single`, of single vertices where some are selected."""
    selection = editor.selection
    if not (single and selection.vertices):
        selection = whole(selection)
    if not selection:
        raise MapError("nothing is selected: click something first, or press Ctrl A")
    editor.change(edit(editor.sketch, selection, *rest))


def whole(selection: Selection) -> Selection:
    """Return the selected things; of selected vertices, what they belong to."""
    return selection.without_vertices().plus(Selection.of(*{vertex.of for vertex in selection.vertices}))


def play(editor: Editor) -> str:
    """Show where obstacles that move get to, or show them no more."""
    if editor.moves_since is not None:
        editor.moves_since = None
        return "obstacles stand as they are at time zero"
    if not motion_path.moving(editor.sketch):
        raise MapError("no obstacle moves: the tool Path gives one a path")
    editor.moves_since = editor.now
    return "obstacles move as they will; L ends it"


def back(editor: Editor) -> None:
    """Take the last point back, else delete what is selected."""
    if not editor.tool.back(editor) and not editor.tool.busy and editor.selection:
        delete(editor)


def delete(editor: Editor) -> None:
    """Delete the selected vertices, or else the selected things."""
    selection = editor.selection
    if not selection:
        raise MapError("nothing is selected: click something first")
    act = vertices.deleted if selection.vertices else properties.deleted
    single = Selection(vertices=selection.vertices)
    editor.change(act(editor.sketch, single if selection.vertices else selection))


def copy(editor: Editor) -> str:
    """Copy what is selected to the clipboard."""
    selection = whole(editor.selection)
    editor.pasteboard.put(copied(editor.sketch, selection))
    return f"copied: {selection.words(editor.sketch)}"


def cut(editor: Editor) -> None:
    """Copy what is selected, and delete it."""
    copy(editor)
    editor.change(properties.deleted(editor.sketch, whole(editor.selection)))


def paste(editor: Editor, at: Point | None) -> None:
    """Paste what is in the clipboard, its middle at a place."""
    text = editor.pasteboard.get()
    if not text.strip():
        raise MapError("the clipboard is empty")
    grid = editor.grid if "grid" in editor.snaps else None
    editor.change(pasted(editor.sketch, text, at, grid))


def level(editor: Editor) -> None:
    """Turn the whole map so that the line that was measured is level or upright."""
    tape = editor.tools["measure"]
    assert isinstance(tape, MeasureTool)
    if len(tape.measured) != 2:
        raise MapError("measure along a wall first: the tool Measure, two clicks")
    editor.change(transform.levelled(editor.sketch, *tape.measured))
    tape.cancel(editor)


def nudge(x: int, y: int) -> Callable[[Editor], None]:
    """Return what moves the selection by so many spacings of the grid."""

    def run(editor: Editor) -> None:
        selection = editor.selection
        if not selection:
            raise MapError("nothing is selected: arrows move what is; Ctrl and arrows move the sheet")
        act = vertices.moved if selection.vertices else transform.moved
        single = Selection(vertices=selection.vertices) if selection.vertices else selection
        editor.change(act(editor.sketch, single, x * editor.grid, y * editor.grid), drag=("nudge", selection))

    return run


def cancel(editor: Editor) -> None:
    """Give up what is half done, else put the tool away, else select nothing."""
    if editor.typed:
        editor.typed = ""
    elif not editor.tool.cancel(editor) and editor.tool is not editor.selector:
        editor.choose("select", tell=False)


def select_next(editor: Editor, by: int) -> None:
    """Select the next obstacle, start or boundary, in the order of the map."""
    order: list[Owner] = [
        *(item.key for item in editor.sketch.obstacles if not item.hidden),
        *(name for name, _ in editor.sketch.starts),
    ]
    if editor.sketch.boundary is not None:
        order.append(BOUNDARY)
    if not order:
        return
    now = [order.index(each) for each in whole(editor.selection).owners if each in order]
    place = (max(now) + by if by > 0 else min(now) + by) if now else (0 if by > 0 else -1)
    editor.select(Selection.of(order[place % len(order)]))


def one_vertex(editor: Editor) -> Vertex:
    """Return the one vertex that is selected."""
    if len(editor.selection.vertices) != 1:
        raise MapError("select one vertex first: click an obstacle, then one of its corners")
    (vertex,) = editor.selection.vertices
    return vertex


def corners(editor: Editor) -> Selection:
    """Return the selected corners."""
    if not editor.selection.vertices:
        raise MapError("select corners first: click an obstacle, then its corners, or drag a box around them")
    return Selection(vertices=editor.selection.vertices)


def bevel(editor: Editor, length: float) -> None:
    """Cut the selected corners off."""
    editor.change(vertices.bevelled(editor.sketch, corners(editor), length))


def round_corners(editor: Editor, radius: float) -> None:
    """Round the selected corners."""
    editor.change(vertices.rounded_off(editor.sketch, corners(editor), radius))


def simplify_outlines(editor: Editor, tolerance: float) -> None:
    """Leave vertices out of what is selected."""
    _do(editor, simplify.simplified, tolerance)


def extend(editor: Editor) -> None:
    """Go on with a wall from the vertex that is selected, to where the cursor is."""
    if editor.cursor is None:
        raise MapError("move the mouse to where the wall is to go on to")
    vertex = one_vertex(editor)
    to = editor.snapped(editor.cursor, FINGER * editor.pixel, place_of(editor.sketch, vertex)).point
    editor.change(vertices.extended(editor.sketch, vertex, to))


def fill(editor: Editor) -> None:
    """Fill the hole whose vertex is selected."""
    vertex = one_vertex(editor)
    if not isinstance(vertex.of, int) or vertex.ring == 0:
        raise MapError("select a vertex of the hole first")
    editor.change(vertices.hole_filled(editor.sketch, vertex.of, vertex.ring))


def widen(editor: Editor, factor: float) -> None:
    """Make the selected walls wider or narrower, and those that are drawn."""
    walls = {key: editor.sketch.item(key).shape for key in whole(editor.selection).items}
    widths = [shape.width for shape in walls.values() if isinstance(shape, WallObstacle)]
    width = round(max((widths[0] if widths else editor.wall_width) * factor, 0.01), 3)
    if widths and not editor.tool.busy:
        editor.change(
            properties.widened(editor.sketch, whole(editor.selection), width),
            drag=("width", editor.selection),
        )
    editor.set_wall_width(width)
    editor.say(f"walls are {width:g} m wide")


def next_start(editor: Editor) -> None:
    """Show the team at the next start."""
    names = editor.start_names
    if not names:
        raise MapError("the map has no start yet: S draws one")
    now = editor.start_name
    name = names[(names.index(now) + 1) % len(names)] if now in names else names[0]
    editor.start = name
    editor.select(Selection.of(name))
    editor.say(f"start “{name}”")


def make_default(editor: Editor) -> None:
    """Make the selected start the map's default."""
    if len(editor.selection.starts) != 1:
        raise MapError("select one start first")
    (name,) = editor.selection.starts
    editor.change(properties.start_first(editor.sketch, name))


def density_weight(editor: Editor) -> float:
    """Return the weight of what is drawn next with the tool Density."""
    tool = editor.tools["density"]
    return tool.weight if isinstance(tool, DensityTool) else 1.0


def fix_problem(editor: Editor) -> None:
    """Mend the problem that is shown, or the first that can be."""
    found = [editor.problem] if editor.problem is not None else list(editor.problems)
    for problem in found:
        change = fixes.fixed(editor.sketch, problem, editor.radius)
        if change is not None:
            editor.change(change)
            return
    raise MapError("there is nothing that can be mended by itself")


def next_problem(editor: Editor) -> None:
    """Show the next problem with its words."""
    found = editor.problems
    if not found:
        editor.problem = None
        editor.say("nothing is wrong with the map" if editor.measurement is not None else "not looked at yet")
        return
    place = found.index(editor.problem) + 1 if editor.problem in found else 0
    editor.problem = found[place % len(found)]
    editor.say(editor.problem.words, trouble=editor.problem.grave)


# values that are typed


def _selected(editor: Editor) -> Selection:
    selection = whole(editor.selection)
    if not selection:
        raise MapError("nothing is selected: click something first, or press Ctrl A")
    return selection


def _whole_number(word: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise MapError(f"{word}: {text!r}, but a whole number was wanted") from None


def _set_angle(editor: Editor, text: str) -> None:
    angle = angle_of(text)
    if not 0.1 <= angle <= 90.0:
        raise MapError(f"angle: {angle:g}°, but 0.1° to 90° was wanted")
    editor.snap_angle = angle
    editor.say(f"angles snap to multiples of {angle:g}°")


def _set_seed(editor: Editor, text: str) -> None:
    editor.seed = max(_whole_number("seed", text), 0)


def _edit_to(edit: Callable[..., Change], read: Callable[[str], object]) -> Callable[[Editor, str], None]:
    """Return what makes an edit of the selected things to a typed value."""
    return lambda editor, text: editor.change(edit(editor.sketch, _selected(editor), read(text)))


def _move(editor: Editor, text: str) -> None:
    text = text.strip()
    dx, dy = point_of(text if text[0] in "+@" else f"@{text}", last=(0.0, 0.0))
    selection = editor.selection
    if not selection:
        _selected(editor)
    act = vertices.moved if selection.vertices else transform.moved
    editor.change(act(editor.sketch, selection, dx, dy))


def _place(editor: Editor, text: str) -> None:
    selection = _selected(editor)
    bounds = bounds_of(editor.sketch, selection)
    x, y = point_of(text, last=bounds[:2] if bounds else None)
    editor.change(transform.placed(editor.sketch, selection, x, y))


def _scale(editor: Editor, text: str) -> None:
    selection = _selected(editor)
    bounds = bounds_of(editor.sketch, selection)
    if bounds is None:
        raise MapError("there is nothing to scale")
    factor = length_of(text if text.endswith("%") else f"*{text.lstrip('*x')}", now=1.0)
    editor.change(transform.scaled(editor.sketch, selection, factor))


def _size(editor: Editor, text: str) -> None:
    width, height = size_of(text)
    editor.change(transform.resized(editor.sketch, _selected(editor), width, height))


def _name(editor: Editor, text: str) -> None:
    owners = sorted(whole(editor.selection).owners, key=str)
    if len(owners) != 1:
        raise MapError("select one obstacle or start first")
    editor.change(properties.renamed(editor.sketch, owners[0], text))


def _offset(editor: Editor, text: str) -> None:
    sign = -1.0 if text.strip().startswith("-") else 1.0
    editor.change(
        boolean.offset(editor.sketch, _selected(editor), sign * length_of(text.strip().lstrip("+-")))
    )


def _set_density(editor: Editor, text: str) -> None:
    if text.strip() != "none":
        raise MapError(f"density: {text!r}, but none was wanted; hot spots are drawn with the tool Density")
    editor.change(density_edits.density_removed(editor.sketch))


def _number(word: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise MapError(f"{word}: {text!r}, but a number was wanted") from None


def _array(editor: Editor, text: str) -> None:
    parts = text.replace("x", " ").split()
    if len(parts) != 4:
        raise MapError("array: columns, rows and both distances were wanted, as in array 3 x 2 1.5 1.5")
    columns, rows = (_whole_number("array", each) for each in parts[:2])
    dx, dy = (length_of(each.lstrip("-")) * (-1.0 if each.startswith("-") else 1.0) for each in parts[2:])
    editor.change(transform.arrayed(editor.sketch, _selected(editor), columns, rows, dx, dy))


# the lists

GROUPS = ("File", "Edit", "Arrange", "Combine", "Tools", "Vertices", "Snap", "View", "Robots", "Help")
"""Headings of the help, in their order."""

_TOOL_KEYS = {
    "select": "v",
    "polygon": "p",
    "rectangle": "r",
    "circle": "c",
    "wall": "w",
    "door": "k",
    "boundary": "b",
    "disc": "s",
    "places": "shift+s",
    "measure": "m",
    "density": "d",
    "path": "o",
    "picture": "i",
    "pan": "g",
}

_SHOWN_KEYS = {
    "grid": "alt+3",
    "names": "alt+2",
    "impassable": "alt+1",
    "problems": "alt+5",
    "robots": "a",
    "picture": "alt+6",
    "legend": "alt+7",
    "handles": "alt+4",
}


_ROWS: dict[str, tuple[Row, ...]] = {
    "File": (
        Row("new", "New map", "ctrl+n"),
        Row("open", "Open a map", "ctrl+o"),
        Row("recent", "Open a recent or bundled map", "ctrl+shift+o"),
        Row("save", "Save", "ctrl+s"),
        Row("save:as", "Save as", "ctrl+shift+s"),
        Row("export", "Export to another format", "ctrl+e"),
        Row("background", "Picture under the map", "ctrl+b"),
        Row(
            "background:none",
            "Take the picture under the map away",
            "",
            lambda editor: editor.change(properties.underlaid(editor.sketch, None)),
        ),
        Row("reload", "Read the file again", "ctrl+r"),
        Row("try", "Try it in the demo, and back", "f5"),
        Row("screenshot", "Screenshot", "f12"),
        Row("quit", "Quit", "ctrl+q"),
    ),
    "Edit": (
        Row("undo", "Undo", "ctrl+z", Editor.undo, repeats=True),
        Row("redo", "Redo", "ctrl+y, ctrl+shift+z", Editor.redo, repeats=True),
        Row("cut", "Cut", "ctrl+x", cut),
        Row("copy", "Copy", "ctrl+c", copy),
        Row(
            "paste",
            "Paste at the cursor",
            "ctrl+v",
            lambda editor: paste(editor, editor.cursor),
            repeats=True,
        ),
        Row("paste:there", "Paste in the same place", "ctrl+shift+v", lambda editor: paste(editor, None)),
        Row(
            "duplicate",
            "Duplicate",
            "ctrl+d",
            lambda editor: _do(editor, transform.duplicated, editor.grid * FAR / 2, -editor.grid * FAR / 2),
            repeats=True,
        ),
        Row("delete", "Delete", "delete, x", delete),
        Row("select:all", "Select all", "ctrl+a", lambda editor: editor.select(Selection.all(editor.sketch))),
        Row(
            "select:next",
            "Select the next obstacle",
            "tab",
            lambda editor: select_next(editor, 1),
            repeats=True,
        ),
        Row(
            "select:previous",
            "Select the previous obstacle",
            "shift+tab",
            lambda editor: select_next(editor, -1),
            repeats=True,
        ),
        Row("name", "Name what is selected", "f2"),
        Row("left", "Nudge by the grid (all arrows)", "left", nudge(-1, 0), repeats=True),
        Row("right", "", "right", nudge(1, 0), repeats=True),
        Row("up", "", "up", nudge(0, 1), repeats=True),
        Row("down", "", "down", nudge(0, -1), repeats=True),
        Row("left:far", "Nudge ten times as far (all arrows)", "shift+left", nudge(-10, 0), repeats=True),
        Row("right:far", "", "shift+right", nudge(10, 0), repeats=True),
        Row("up:far", "", "shift+up", nudge(0, 10), repeats=True),
        Row("down:far", "", "shift+down", nudge(0, -10), repeats=True),
        Row(
            "finish", "Finish what is being drawn", "return, enter", lambda editor: editor.tool.finish(editor)
        ),
        Row("back", "Take the last point back, or delete", "backspace", back, repeats=True),
        Row("cancel", "Give up; select nothing; close", "escape", cancel),
        Row("menu", "What can be done here (right click)", "menu, shift+f10"),
    ),
    "Arrange": (
        Row("rotate:left", "Turn by 90° to the left", "q", edited(transform.rotated, 90.0), repeats=True),
        Row("rotate:right", "Turn by 90° to the right", "e", edited(transform.rotated, -90.0), repeats=True),
        Row("level", "Level: turn the map so that the measured line is level or upright", "", level),
        Row("mirror:x", "Mirror left and right", "shift+h", edited(transform.mirrored, "x")),
        Row("mirror:y", "Mirror up and down", "shift+v", edited(transform.mirrored, "y")),
        Row("align:left", "Align left sides", "alt+left", edited(transform.aligned, "left", single=True)),
        Row("align:right", "Align right sides", "alt+right", edited(transform.aligned, "right", single=True)),
        Row("align:top", "Align tops", "alt+up", edited(transform.aligned, "top", single=True)),
        Row("align:bottom", "Align bottoms", "alt+down", edited(transform.aligned, "bottom", single=True)),
        Row(
            "align:centre", "Align middles across", "alt+c", edited(transform.aligned, "centre", single=True)
        ),
        Row(
            "align:middle",
            "Align middles in height",
            "alt+m",
            edited(transform.aligned, "middle", single=True),
        ),
        Row("distribute:x", "Equal gaps across", "alt+x", edited(transform.distributed, "x")),
        Row("distribute:y", "Equal gaps in height", "alt+y", edited(transform.distributed, "y")),
        Row("raise", "To the top", "page up", edited(properties.raised, "top")),
        Row("lower", "To the bottom", "page down", edited(properties.raised, "bottom")),
        Row("group", "Group: a click selects all of it", "ctrl+g", edited(properties.grouped)),
        Row("ungroup", "Take out of its group", "ctrl+shift+g", edited(properties.ungrouped)),
        Row("lock", "Lock: the mouse takes it no more", "ctrl+l", edited(properties.locked)),
        Row("hide", "Hide in the editor", "ctrl+h", edited(properties.hidden)),
        Row(
            "release",
            "Unlock and show all",
            "ctrl+shift+l",
            lambda editor: editor.change(properties.released(editor.sketch)),
        ),
    ),
    "Combine": (
        Row("unite", "Unite", "alt+u", edited(boolean.united)),
        Row("subtract", "Subtract the upper ones", "alt+s", edited(boolean.subtracted)),
        Row("intersect", "Keep what they have in common", "alt+i", edited(boolean.intersected)),
        Row("divide", "Cut along each other", "alt+d", edited(boolean.divided)),
        Row(
            "clip",
            "Cut off outside the boundary",
            "alt+b",
            lambda editor: editor.change(boolean.clipped(editor.sketch, editor.selection.without_vertices())),
        ),
        Row("join", "Join walls end to end", "alt+j", edited(vertices.joined)),
        Row("polygons", "Turn into polygons", "alt+p", edited(properties.made_polygons)),
        Row("boundary:of", "Make it the boundary", "", edited(properties.made_boundary)),
        Row("repair", "Repair crossing outlines", "alt+r", edited(boolean.repaired)),
        Row(
            "density:area",
            "Make it an area that counts more",
            "",
            lambda editor: _do(editor, density_edits.areas_made, density_weight(editor)),
        ),
        Row(
            "fill:unreachable",
            "Fill all that robots cannot reach",
            "",
            lambda editor: editor.change(fixes.unreachable_filled(editor.sketch, editor.radius)),
        ),
    ),
    "Vertices": (
        Row("bevel", "Cut corners off", "shift+b", lambda editor: bevel(editor, 2 * editor.grid)),
        Row("round", "Round corners", "shift+r", lambda editor: round_corners(editor, 2 * editor.grid)),
        Row(
            "split",
            "Cut a wall in two here",
            "shift+c",
            lambda editor: editor.change(vertices.split(editor.sketch, one_vertex(editor))),
        ),
        Row("extend", "Go on with the wall from here", "shift+w", extend),
        Row("fill", "Fill the hole", "shift+f", fill),
        Row(
            "simplify",
            "Leave needless vertices out",
            "shift+p",
            lambda editor: simplify_outlines(editor, TOLERANCE),
        ),
        Row("straighten", "Make edges straight that nearly are", "shift+l", edited(simplify.straightened)),
        Row(
            "path:repeat",
            "Obstacle goes in a loop, or back and forth",
            "shift+o",
            edited(motion_path.path_turned),
        ),
        Row("path:none", "Take an obstacle's path away", "alt+o", edited(motion_path.path_removed)),
        Row("wider", "Wider walls", "]", lambda editor: widen(editor, WIDER), repeats=True),
        Row("narrower", "Narrower walls", "[", lambda editor: widen(editor, 1.0 / WIDER), repeats=True),
    ),
    "Snap": (
        Row("grid:finer", "Finer grid", "-", lambda editor: editor.change_grid(-1), repeats=True),
        Row("grid:coarser", "Coarser grid", "=, +", lambda editor: editor.change_grid(1), repeats=True),
        Row(
            "snap:all", "Snap to everything, or to nothing", "0", lambda editor: editor.switch("snap", "all")
        ),
    ),
    "View": (
        Row("fit", "Show the whole map", "f"),
        Row("fit:selection", "Show what is selected", "z"),
        Row("zoom:in", "Zoom in", "ctrl+=, ctrl++", repeats=True),
        Row("zoom:out", "Zoom out", "ctrl+-", repeats=True),
        Row("pan:left", "Pan (all arrows)", "ctrl+left", repeats=True),
        Row("pan:right", "", "ctrl+right", repeats=True),
        Row("pan:up", "", "ctrl+up", repeats=True),
        Row("pan:down", "", "ctrl+down", repeats=True),
        Row("pan:hold", "Pan while it is held down", "space"),
        Row("theme", "Light or dark", "t"),
        Row("panel", "Hide or show the panel", "h"),
        Row("tab", "Next page of the panel", "ctrl+tab"),
        Row("fullscreen", "Full screen", "f11"),
        Row("path:play", "Let obstacles move, or stand again", "l", play),
        Row("problem:next", "Go to the next problem", "f8, n", next_problem, repeats=True),
        Row("problem:fix", "Mend the problem that is shown", "shift+f8", fix_problem),
    ),
    "Robots": (
        Row(
            "start:uniform",
            "A start anywhere in the free space",
            "shift+u",
            lambda editor: editor.change(create.uniform_start_added(editor.sketch)),
        ),
        Row("start:next", "Next start of the map", "shift+n", next_start),
        Row("start:default", "Make it the default start", "shift+d", make_default),
        Row(
            "more",
            "One robot more",
            "shift+=, shift++",
            lambda editor: editor.set_robots(min(editor.robots + 1, 1000)),
            repeats=True,
        ),
        Row(
            "fewer",
            "One robot fewer",
            "shift+-",
            lambda editor: editor.set_robots(max(editor.robots - 1, 1)),
            repeats=True,
        ),
    ),
    "Help": (Row("help", "Keys", "f1, shift+/"), Row("palette", "Commands by name", "ctrl+k, /")),
}


def editor_commands(editor: Editor, of_window: Mapping[str, Callable[[], object]]) -> list[Command]:
    """Return every command, those of the tools and of what is snapped to or shown among them."""

    def command(group: str, row: Row) -> Command:
        run = of_window[row.name] if row.run is None else partial(row.run, editor)
        keys = tuple(row.keys.split(", ")) if row.keys else ()
        return Command(row.name, row.title, group, run, keys, repeats=row.repeats, hidden=not row.title)

    def switch(kind: str, name: str, title: str, group: str, key: str) -> Command:
        return Command(f"{kind}:{name}", title, group, partial(editor.switch, kind, name), (key,))

    found = [command(group, row) for group, rows in _ROWS.items() for row in rows]
    for tool in editor.tools.values():
        run, keys = partial(editor.choose, tool.name), (_TOOL_KEYS[tool.name],)
        found.append(Command(f"tool:{tool.name}", f"{tool.title}: {tool.hint}", "Tools", run, keys))
    for k, (name, (title, _)) in enumerate(SNAPS.items(), 1):
        found.append(switch("snap", name, f"Snap to {title.lower()}", "Snap", str(k)))
    found += [switch("show", name, title, "View", _SHOWN_KEYS[name]) for name, title in SHOWN.items()]
    return found


def typed_commands(editor: Editor) -> list[Command]:
    """Return the commands with a value after them."""

    def run(word: str, text: str) -> None:
        editor.carry_out(lambda: run_typed(editor, f"{word} {text}"))

    return [
        Command(word, f"{word} {typed.example}", "", partial(run, word), takes=Takes(typed.example))
        for word, typed in TYPED.items()
    ]


TYPED: dict[str, Typed] = {
    "grid": Typed(
        "0.25: distance of the grid's lines",
        lambda editor, text: editor.set_grid(length_of(text, now=editor.grid)),
    ),
    "angle": Typed("15: lines snap to multiples of it", _set_angle),
    "radius": Typed(
        "0.2: of a robot", lambda editor, text: editor.set_radius(length_of(text, now=editor.radius))
    ),
    "robots": Typed("8: of the team", lambda editor, text: editor.set_robots(_whole_number("robots", text))),
    "seed": Typed("3: of the team's places", _set_seed),
    "wall": Typed(
        "0.1: width of walls that are drawn",
        lambda editor, text: editor.set_wall_width(length_of(text, now=editor.wall_width)),
    ),
    "move": Typed("1 0.5: what is selected", _move),
    "place": Typed("2 3: lower left corner", _place),
    "rotate": Typed("30: by degrees", _edit_to(transform.rotated, angle_of)),
    "scale": Typed("150%: what is selected", _scale),
    "size": Typed("3 x 2: width and height", _size),
    "width": Typed("0.2: of walls", _edit_to(properties.widened, length_of)),
    "circle": Typed("0.5: radius of circles", _edit_to(properties.sized, length_of)),
    "bevel": Typed("0.3: cut corners off", lambda editor, text: bevel(editor, length_of(text))),
    "round": Typed("0.3: round corners", lambda editor, text: round_corners(editor, length_of(text))),
    "simplify": Typed(
        "0.05: leave vertices out, to a tolerance",
        lambda editor, text: simplify_outlines(editor, length_of(text)),
    ),
    "floor": Typed(
        "0.1: density away from hot spots",
        lambda editor, text: editor.change(density_edits.floor_set(editor.sketch, _number("floor", text))),
    ),
    "weight": Typed("2: of a hot spot", lambda editor, text: editor.tools["density"].enter(editor, text)),
    "density": Typed("none: takes it away", _set_density),
    "speed": Typed("0.5: along a path, m/s", _edit_to(motion_path.path_paced, motion_path.speed_of)),
    "offset": Typed("0.2: grow, or shrink with -", _offset),
    "array": Typed("3 x 2 1.5 1.5: columns, rows, distances", _array),
    "name": Typed("pillar: of what is selected", _name),
    "note": Typed("words: on what is selected", _edit_to(properties.noted, str)),
    "title": Typed(
        "Hall: of the map", lambda editor, text: editor.change(properties.titled(editor.sketch, name=text))
    ),
}
"""What can be typed, each with a value after it."""


def run_typed(editor: Editor, text: str) -> None:
    """Do what was typed, as ``rotate 30``; raises a MapError when that means nothing, or cannot be done."""
    word, rest = parted(text)
    if word not in TYPED:
        raise MapError(unknown_name("command", word, TYPED))
    if not rest:
        raise MapError(f"{word}: a value was wanted after it")
    TYPED[word].run(editor, rest)


# the menu at the cursor


def offered(editor: Editor) -> list[str]:
    """Return the names of the actions that apply to what is selected, with an empty one between groups."""
    selection = editor.selection
    if not selection:
        return [
            *("paste", "select:all", _SEPARATE),
            *(
                "tool:polygon",
                "tool:rectangle",
                "tool:circle",
                "tool:wall",
                "tool:boundary",
                "tool:disc",
                _SEPARATE,
            ),
            *("fit", "background", "try"),
        ]
    if selection.vertices:
        return _of_vertices(editor)
    shapes = [editor.sketch.item(key).shape for key in selection.items if key in editor.sketch.places]
    names = ["cut", "copy", "duplicate", "delete", _SEPARATE]
    if len(selection.owners) == 1 and not selection.boundary:
        names += ["name", "fit:selection", _SEPARATE]
    names += ["rotate:left", "rotate:right", "mirror:x", "mirror:y", _SEPARATE]
    if len(shapes) > 1:
        names += ["unite", "subtract", "intersect", "divide", _SEPARATE]
        names += ["align:left", "align:bottom"]
        names += ["distribute:x", "distribute:y"] if len(shapes) > 2 else []
        names.append(_SEPARATE)
    if shapes:
        names += ["group"] if len(shapes) > 1 else []
        names += ["lock", "hide", _SEPARATE]
    walls = [shape for shape in shapes if isinstance(shape, WallObstacle)]
    if len(walls) > 1 and len(walls) == len(shapes):
        names.append("join")
    if any(not isinstance(shape, PolygonObstacle) for shape in shapes):
        names.append("polygons")
    if any(isinstance(shape, PolygonObstacle) for shape in shapes) or selection.boundary:
        names += ["simplify", "straighten"]
    if len(shapes) == 1 and isinstance(shapes[0], PolygonObstacle) and len(selection.owners) == 1:
        names.append("boundary:of")
    if any(problem.of in selection.owners and problem.grave for problem in editor.problems):
        names.append("repair")
    if selection.boundary and not shapes:
        names = ["fit", "simplify", "straighten", "repair", _SEPARATE, "tool:boundary"]
    if selection.starts and not shapes:
        names = ["copy", "duplicate", "delete", _SEPARATE, "name", "show:robots", "fit:selection"]
    return _tidy(names)


def _of_vertices(editor: Editor) -> list[str]:
    selection = editor.selection
    names = ["delete", "bevel", "round"]
    if len(selection.vertices) == 1:
        (vertex,) = selection.vertices
        shape = editor.sketch.item(vertex.of).shape if isinstance(vertex.of, int) and vertex.of >= 0 else None
        if isinstance(shape, WallObstacle):
            names.append("extend" if vertex.index in (0, len(shape.points) - 1) else "split")
        if vertex.ring:
            names.append("fill")
    else:
        names += [_SEPARATE, "align:left", "align:bottom"]
    names += [_SEPARATE, "straighten", "simplify"]
    if BOUNDARY not in whole(selection).owners:
        names += [_SEPARATE, "copy", "duplicate"]
    return _tidy(names)


def _tidy(names: list[str]) -> list[str]:
    """Return the names without separators at the ends, or two in a row."""
    tidy: list[str] = []
    for name in names:
        if name or (tidy and tidy[-1]):
            tidy.append(name)
    return tidy[:-1] if tidy and not tidy[-1] else tidy
