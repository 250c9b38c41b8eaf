"""Everything that the editor does, by key, menu, button, palette or typed value."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TypeVar

from robocov.environment import Point, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.canvas.canvas import REACH, EditorCanvas
from robocov_app.editor.edits import boolean, create, density, fixes, paths, properties, transform, vertices
from robocov_app.editor.edits.clipboard import copied, pasted
from robocov_app.editor.model import require
from robocov_app.editor.model.coordinates import angle_of, length_of, point_of, size_of
from robocov_app.editor.model.selection import Change, Selection, Vertex, place_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner
from robocov_app.editor.tools.density import DensityTool
from robocov_app.editor.tools.draw import MeasureTool
from robocov_app.editor.tools.snapping import SNAPS
from robocov_app.editor.ui.editor import SHOWN, Editor
from robocov_app.editor.ui.file_commands import OPENED, PICTURES, FileCommands
from robocov_app.toolkit import clipboard
from robocov_app.toolkit.command import Command, Takes

FAR = 10  # how many times farther arrows nudge with Shift
WIDER = 1.25
_PAN = 60  # pixels that a key pans
TOLERANCE = 0.02  # metres that simplified outlines may be off
GHOST = "Type a command, or  rotate 30 · grid 0.25 · width 0.2 · size 3 x 2 · robots 8"
Edit = Callable[..., Change]
Run = Callable[[], object]
RunWith = Callable[[Editor, str], object]
Row = tuple[str, str, str, Run]  # name, title and keys of a command, separated by commas, and what it does
_Number = TypeVar("_Number", int, float)


def selected(editor: Editor) -> Selection:
    return require(whole(editor.selection), "nothing is selected: click something first, or press Ctrl A")


def align(editor: Editor, side: transform.Side) -> None:
    selection = editor.selection if editor.selection.vertices else selected(editor)
    editor.change(transform.aligned(editor.sketch, selection, side))


def whole(selection: Selection) -> Selection:
    """Return the selected things, and of selected vertices what they belong to."""
    return selection.without_vertices().plus(Selection.of(*{vertex.of for vertex in selection.vertices}))


def vertices_or_things(selection: Selection) -> Selection:
    return Selection(vertices=selection.vertices) if selection.vertices else selection


def play(editor: Editor) -> str:
    if editor.moves_since is not None:
        editor.moves_since = None
        return "obstacles stand as they are at time zero"
    require(paths.moving(editor.sketch), "no obstacle moves: the tool Path gives one a path")
    editor.moves_since = editor.now
    return "obstacles move as they will; L ends it"


def back(editor: Editor) -> None:
    if not editor.tool.back(editor) and not editor.tool.busy and editor.selection:
        delete(editor)


def delete(editor: Editor) -> None:
    selection = require(editor.selection, "nothing is selected: click something first")
    act = vertices.deleted if selection.vertices else properties.deleted
    editor.change(act(editor.sketch, vertices_or_things(selection)))


def copy(editor: Editor) -> str:
    selection = whole(editor.selection)
    clipboard.put(copied(editor.sketch, selection))
    return f"copied: {selection.words(editor.sketch)}"


def cut(editor: Editor) -> None:
    copy(editor)
    editor.change(properties.deleted(editor.sketch, whole(editor.selection)))


def paste(editor: Editor, at: Point | None) -> None:
    text = clipboard.get()
    require(text.strip(), "the clipboard is empty")
    editor.change(pasted(editor.sketch, text, at, editor.grid if "grid" in editor.snaps else None))


def duplicate(editor: Editor) -> None:
    by = editor.grid * FAR / 2
    editor.change(transform.duplicated(editor.sketch, selected(editor), by, -by))


def level(editor: Editor) -> None:
    tape = editor.tools["measure"]
    assert isinstance(tape, MeasureTool)
    require(len(tape.measured) == 2, "measure along a wall first: the tool Measure, two clicks")
    editor.change(transform.levelled(editor.sketch, *tape.measured))
    tape.cancel(editor)


def nudge(editor: Editor, steps: int, x: int, y: int) -> None:
    missing = "nothing is selected: arrows move what is; Ctrl and arrows move the sheet"
    selection = require(editor.selection, missing)
    by = steps * editor.grid
    editor.change(move(editor, x * by, y * by, vertices_or_things(selection)), drag=("nudge", selection))


def move(editor: Editor, dx: float, dy: float, selection: Selection) -> Change:
    act = vertices.moved if selection.vertices else transform.moved
    return act(editor.sketch, selection, dx, dy)


def cancel(editor: Editor) -> None:
    if editor.typed:
        editor.typed = ""
    elif not editor.tool.cancel(editor) and editor.tool is not editor.selector:
        editor.choose("select", tell=False)


def select_next(editor: Editor, by: int) -> None:
    order: list[Owner] = [item.key for item in editor.sketch.obstacles if not item.hidden]
    order += [*editor.start_names, *([BOUNDARY] if editor.sketch.boundary is not None else [])]
    if not order:
        return
    now = [order.index(each) for each in whole(editor.selection).owners if each in order]
    place = (max(now) + by if by > 0 else min(now) + by) if now else (0 if by > 0 else -1)
    editor.select(Selection.of(order[place % len(order)]))


def one_vertex(editor: Editor) -> Vertex:
    found = editor.selection.vertices
    require(len(found) == 1, "select one vertex first: click an obstacle, then one of its corners")
    return next(iter(found))


def trim(editor: Editor, edit: Edit, length: float | None = None) -> None:
    """Cut the selected corners off, or round them, by twice the grid unless a length is given, m."""
    found = Selection(vertices=editor.selection.vertices)
    require(found, "select corners first: click an obstacle, then its corners, or drag a box around them")
    editor.change(edit(editor.sketch, found, length or 2 * editor.grid))


def extend(editor: Editor) -> None:
    cursor = require(editor.cursor, "move the mouse to where the wall is to go on to")
    vertex = one_vertex(editor)
    to = editor.snapped(cursor, REACH * editor.pixel, place_of(editor.sketch, vertex)).point
    editor.change(vertices.extended(editor.sketch, vertex, to))


def fill(editor: Editor) -> None:
    vertex = one_vertex(editor)
    if not isinstance(vertex.of, int) or vertex.ring == 0:
        raise MapError("select a vertex of the hole first")
    editor.change(vertices.hole_filled(editor.sketch, vertex.of, vertex.ring))


def widen(editor: Editor, factor: float) -> None:
    selection = whole(editor.selection)
    shapes = [editor.sketch.item(key).shape for key in selection.items]
    widths = [shape.width for shape in shapes if isinstance(shape, WallObstacle)]
    width = round(max((widths[0] if widths else editor.wall_width) * factor, 0.01), 3)
    if widths and not editor.tool.busy:
        editor.change(properties.widened(editor.sketch, selection, width), drag=("width", editor.selection))
    editor.set_length("wall_width", width)
    editor.say(f"walls are {width:g} m wide")


def next_start(editor: Editor) -> None:
    names = require(editor.start_names, "the map has no start yet: S draws one")
    now = editor.start_name
    name = names[(names.index(now) + 1) % len(names)] if now in names else names[0]
    editor.start = name
    editor.select(Selection.of(name))
    editor.say(f"start “{name}”")


def make_default(editor: Editor) -> None:
    require(len(editor.selection.starts) == 1, "select one start first")
    editor.change(properties.start_first(editor.sketch, *editor.selection.starts))


def make_areas(editor: Editor) -> None:
    tool = editor.tools["density"]
    assert isinstance(tool, DensityTool)
    editor.change(density.areas_made(editor.sketch, selected(editor), tool.weight))


def fix_problem(editor: Editor) -> None:
    for problem in [editor.problem] if editor.problem is not None else editor.problems:
        if (change := fixes.fixed(editor.sketch, problem, editor.radius)) is not None:
            editor.change(change)
            return
    raise MapError("there is nothing that can be mended by itself")


def next_problem(editor: Editor) -> None:
    found = editor.problems
    if not found:
        editor.problem = None
        editor.say("nothing is wrong with the map" if editor.measurement is not None else "not looked at yet")
        return
    place = found.index(editor.problem) + 1 if editor.problem in found else 0
    editor.problem = found[place % len(found)]
    editor.say(editor.problem.words, trouble=editor.problem.grave)


def _number(word: str, text: str, kind: type[_Number]) -> _Number:
    try:
        return kind(text)
    except ValueError:
        wanted = "a whole number" if kind is int else "a number"
        raise MapError(f"{word}: expected {wanted}, got {text!r}") from None


def _set_angle(editor: Editor, text: str) -> None:
    angle = angle_of(text)
    require(0.1 <= angle <= 90.0, f"angle: expected 0.1° to 90°, got {angle:g}°")
    editor.snap_angle = angle
    editor.say(f"angles snap to multiples of {angle:g}°")


def _set_length(name: str) -> RunWith:
    return lambda editor, text: editor.set_length(name, length_of(text, now=getattr(editor, name)))


def _edit_to(edit: Edit, read: Callable[[str], object]) -> RunWith:
    def run(editor: Editor, text: str) -> None:
        value = read(text)
        values = value if isinstance(value, tuple) else (value,)
        editor.change(edit(editor.sketch, selected(editor), *values))

    return run


def common_measure(editor: Editor, name: str) -> float | None:
    """Return the width or radius of all selected things that have one; None where they differ."""
    sketch, selection = editor.preview
    found = {getattr(thing, name) for thing in map(sketch.thing, selection.owners) if hasattr(thing, name)}
    return found.pop() if len(found) == 1 else None


def _set_measure(edit: Edit, name: str) -> RunWith:
    def run(editor: Editor, text: str) -> None:
        length = length_of(text, now=common_measure(editor, name))
        editor.change(edit(editor.sketch, selected(editor), length))

    return run


def _move(editor: Editor, text: str) -> None:
    dx, dy = point_of(text if text[0] in "+@" else f"@{text}", last=(0.0, 0.0))
    editor.change(move(editor, dx, dy, editor.selection or selected(editor)))


def _place(editor: Editor, text: str) -> None:
    selection = selected(editor)
    bounds = transform.bounds_of(editor.sketch, selection)
    x, y = point_of(text, last=bounds[:2] if bounds else None)
    editor.change(transform.placed(editor.sketch, selection, x, y))


def _scale(editor: Editor, text: str) -> None:
    selection = selected(editor)
    require(transform.bounds_of(editor.sketch, selection), "there is nothing to scale")
    factor = length_of(text if text.endswith("%") else f"*{text.lstrip('*x')}", now=1.0)
    editor.change(transform.scaled(editor.sketch, selection, factor, factor))


def rename(editor: Editor, text: str) -> None:
    owners = whole(editor.selection).owners
    require(len(owners) == 1, "select one obstacle or start first")
    (owner,) = owners
    editor.change(properties.renamed(editor.sketch, owner, text))


def _signed(text: str) -> float:
    return length_of(text.lstrip("+-")) * (-1.0 if text.startswith("-") else 1.0)


def _set_density(editor: Editor, text: str) -> None:
    require(text == "none", f"density: expected none, got {text!r}; the tool Density draws hot spots")
    editor.change(density.density_removed(editor.sketch))


def _array_of(text: str) -> tuple[int, int, float, float]:
    parts = text.replace("x", " ").split()
    require(len(parts) == 4, "array: expected columns, rows and both distances, as in array 3 x 2 1.5 1.5")
    columns, rows = (_number("array", each, int) for each in parts[:2])
    return columns, rows, _signed(parts[2]), _signed(parts[3])


# headings of the help, and keys of the tools and of what is shown, in their order
GROUPS = ("File", "Edit", "Arrange", "Combine", "Tools", "Vertices", "Snap", "View", "Robots", "Help")
_TOOL_KEYS = ("v", "g", "p", "r", "c", "w", "k", "b", "m", "s", "shift+s", "d", "o", "i")
_SHOWN_KEYS = ("alt+3", "alt+2", "alt+1", "alt+5", "a", "alt+6", "alt+7", "alt+4")
# commands that are done again and again while their key is held down
_REPEATED = (
    *("undo", "redo", "paste", "duplicate", "select:next", "select:previous", "back", "more", "fewer"),
    *("left", "right", "up", "down", "left:far", "right:far", "up:far", "down:far", "wider", "narrower"),
    *("rotate:left", "rotate:right", "grid:finer", "grid:coarser", "zoom:in", "zoom:out", "problem:next"),
    *("pan:left", "pan:right", "pan:up", "pan:down"),
)


def editor_commands(
    editor: Editor, canvas: EditorCanvas, documents: FileCommands, of_window: Mapping[str, Run]
) -> list[Command]:
    def edited(edit: Edit, *rest: object) -> Run:
        return lambda: editor.change(edit(editor.sketch, selected(editor), *rest))

    def of_map(edit: Edit, *rest: Run) -> Run:
        return lambda: editor.change(edit(editor.sketch, *(each() for each in rest)))

    def arrows(name: str, title: str, keys: str, act: Callable[[int, int], object]) -> Iterator[Row]:
        """Yield the commands of the four arrow keys; the first speaks for all of them."""
        for way, x, y in (("left", -1, 0), ("right", 1, 0), ("up", 0, 1), ("down", 0, -1)):
            yield name.format(way), title, keys.format(way), partial(act, x, y)
            title = ""

    def switch_theme() -> None:
        editor.theme = "dark" if editor.theme == "light" else "light"

    clip = of_map(boolean.clipped, lambda: editor.selection.without_vertices())
    fill_unreachable = of_map(fixes.unreachable_filled, lambda: editor.radius)
    level_map = partial(level, editor)
    ask_picture = partial(documents.ask_path, "Picture under the map", documents.underlay, PICTURES)
    no_picture = of_map(properties.underlaid, lambda: None)
    table: tuple[str | Row, ...] = (  # the headings of groups, and below each its commands
        "File",
        ("new", "New map", "ctrl+n", documents.new),
        ("open", "Open a map", "ctrl+o", partial(documents.ask_path, "Open a map", documents.open, OPENED)),
        ("recent", "Open a recent or bundled map", "ctrl+shift+o", documents.ask_recent),
        ("save", "Save", "ctrl+s", documents.save),
        ("save:as", "Save as", "ctrl+shift+s", documents.ask_name),
        ("export", "Export to another format", "ctrl+e", documents.ask_export),
        ("background", "Picture under the map", "ctrl+b", ask_picture),
        ("background:none", "Take the picture under the map away", "", no_picture),
        ("reload", "Read the file again", "ctrl+r", documents.reload),
        ("try", "Try it in the demo, and back", "f5", of_window["try"]),
        ("screenshot", "Screenshot", "f12", of_window["screenshot"]),
        ("quit", "Quit", "ctrl+q", documents.quit),
        "Edit",
        ("undo", "Undo", "ctrl+z", partial(editor.travel, 1)),
        ("redo", "Redo", "ctrl+y, ctrl+shift+z", partial(editor.travel, -1)),
        ("cut", "Cut", "ctrl+x", partial(cut, editor)),
        ("copy", "Copy", "ctrl+c", partial(copy, editor)),
        ("paste", "Paste at the cursor", "ctrl+v", lambda: paste(editor, editor.cursor)),
        ("paste:there", "Paste in the same place", "ctrl+shift+v", partial(paste, editor, None)),
        ("duplicate", "Duplicate", "ctrl+d", partial(duplicate, editor)),
        ("delete", "Delete", "delete, x", partial(delete, editor)),
        ("select:all", "Select all", "ctrl+a", lambda: editor.select(Selection.all(editor.sketch))),
        ("select:next", "Select the next obstacle", "tab", partial(select_next, editor, 1)),
        ("select:previous", "Select the previous obstacle", "shift+tab", partial(select_next, editor, -1)),
        ("name", "Name what is selected", "f2", of_window["name"]),
        *arrows("{}", "Nudge by the grid (all arrows)", "{}", partial(nudge, editor, 1)),
        *arrows("{}:far", "Nudge ten times as far (all arrows)", "shift+{}", partial(nudge, editor, FAR)),
        ("finish", "Finish what is being drawn", "return, enter", lambda: editor.tool.finish(editor)),
        ("back", "Take the last point back, or delete", "backspace", partial(back, editor)),
        ("cancel", "Give up; select nothing; close", "escape", partial(cancel, editor)),
        ("menu", "What can be done here (right click)", "menu, shift+f10", of_window["menu"]),
        "Arrange",
        ("rotate:left", "Turn by 90° to the left", "q", edited(transform.rotated, 90.0)),
        ("rotate:right", "Turn by 90° to the right", "e", edited(transform.rotated, -90.0)),
        ("level", "Level: turn the map so that the measured line is level or upright", "", level_map),
        ("mirror:x", "Mirror left and right", "shift+h", edited(transform.mirrored, "x")),
        ("mirror:y", "Mirror up and down", "shift+v", edited(transform.mirrored, "y")),
        ("align:left", "Align left sides", "alt+left", partial(align, editor, "left")),
        ("align:right", "Align right sides", "alt+right", partial(align, editor, "right")),
        ("align:top", "Align tops", "alt+up", partial(align, editor, "top")),
        ("align:bottom", "Align bottoms", "alt+down", partial(align, editor, "bottom")),
        ("align:centre", "Align middles across", "alt+c", partial(align, editor, "centre")),
        ("align:middle", "Align middles in height", "alt+m", partial(align, editor, "middle")),
        ("distribute:x", "Equal gaps across", "alt+x", edited(transform.distributed, "x")),
        ("distribute:y", "Equal gaps in height", "alt+y", edited(transform.distributed, "y")),
        ("raise", "To the top", "page up", edited(properties.raised, "top")),
        ("lower", "To the bottom", "page down", edited(properties.raised, "bottom")),
        ("group", "Group: a click selects all of it", "ctrl+g", edited(properties.grouped)),
        ("ungroup", "Take out of its group", "ctrl+shift+g", edited(properties.ungrouped)),
        ("lock", "Lock: the mouse takes it no more", "ctrl+l", edited(properties.locked)),
        ("hide", "Hide in the editor", "ctrl+h", edited(properties.hidden)),
        ("release", "Unlock and show all", "ctrl+shift+l", of_map(properties.released)),
        "Combine",
        ("unite", "Unite", "alt+u", edited(boolean.united)),
        ("subtract", "Subtract the upper ones", "alt+s", edited(boolean.subtracted)),
        ("intersect", "Keep what they have in common", "alt+i", edited(boolean.intersected)),
        ("divide", "Cut along each other", "alt+d", edited(boolean.divided)),
        ("clip", "Cut off outside the boundary", "alt+b", clip),
        ("join", "Join walls end to end", "alt+j", edited(vertices.joined)),
        ("polygons", "Turn into polygons", "alt+p", edited(properties.made_polygons)),
        ("boundary:of", "Make it the boundary", "", edited(properties.made_boundary)),
        ("repair", "Repair crossing outlines", "alt+r", edited(boolean.repaired)),
        ("density:area", "Make it an area that counts more", "", partial(make_areas, editor)),
        ("fill:unreachable", "Fill all that robots cannot reach", "", fill_unreachable),
        "Vertices",
        ("bevel", "Cut corners off", "shift+b", partial(trim, editor, vertices.bevelled)),
        ("round", "Round corners", "shift+r", partial(trim, editor, vertices.rounded_off)),
        ("split", "Cut a wall in two here", "shift+c", of_map(vertices.split, partial(one_vertex, editor))),
        ("extend", "Go on with the wall from here", "shift+w", partial(extend, editor)),
        ("fill", "Fill the hole", "shift+f", partial(fill, editor)),
        ("simplify", "Leave needless vertices out", "shift+p", edited(vertices.simplified, TOLERANCE)),
        ("straighten", "Make edges straight that nearly are", "shift+l", edited(vertices.straightened)),
        ("path:repeat", "Obstacle goes in a loop, or back and forth", "shift+o", edited(paths.path_turned)),
        ("path:none", "Take an obstacle's path away", "alt+o", edited(paths.path_removed)),
        ("wider", "Wider walls", "]", partial(widen, editor, WIDER)),
        ("narrower", "Narrower walls", "[", partial(widen, editor, 1.0 / WIDER)),
        "Snap",
        ("grid:finer", "Finer grid", "-", partial(editor.change_grid, -1)),
        ("grid:coarser", "Coarser grid", "=, +", partial(editor.change_grid, 1)),
        ("snap:all", "Snap to everything, or to nothing", "0", partial(editor.switch, "snap", "all")),
        "View",
        ("fit", "Show the whole map", "f", canvas.fit),
        ("fit:selection", "Show what is selected", "z", lambda: canvas.fit(editor.selection)),
        ("zoom:in", "Zoom in", "ctrl+=, ctrl++", partial(canvas.zoom, 1.25)),
        ("zoom:out", "Zoom out", "ctrl+-", partial(canvas.zoom, 0.8)),
        *arrows("pan:{}", "Pan (all arrows)", "ctrl+{}", lambda x, y: canvas.pan(-_PAN * x, _PAN * y)),
        ("pan:hold", "Pan while it is held down", "space", of_window["pan:hold"]),
        ("theme", "Light or dark", "t", switch_theme),
        ("panel", "Hide or show the panel", "h", lambda: setattr(editor, "panel", not editor.panel)),
        ("tab", "Next page of the panel", "ctrl+tab", of_window["tab"]),
        ("fullscreen", "Full screen", "f11", of_window["fullscreen"]),
        ("path:play", "Let obstacles move, or stand again", "l", partial(play, editor)),
        ("problem:next", "Go to the next problem", "f8, n", partial(next_problem, editor)),
        ("problem:fix", "Mend the problem that is shown", "shift+f8", partial(fix_problem, editor)),
        "Robots",
        ("start:uniform", "A start anywhere in the free space", "shift+u", of_map(create.anywhere_added)),
        ("start:next", "Next start of the map", "shift+n", partial(next_start, editor)),
        ("start:default", "Make it the default start", "shift+d", partial(make_default, editor)),
        ("more", "One robot more", "shift+=, shift++", partial(editor.add_robots, 1)),
        ("fewer", "One robot fewer", "shift+-", partial(editor.add_robots, -1)),
        "Help",
        ("help", "Keys", "f1, shift+/", of_window["help"]),
        ("palette", "Commands by name", "ctrl+k, /", of_window["palette"]),
    )
    listed: list[Command] = []

    def add(group: str, name: str, title: str, keys: str, run: Run) -> None:
        pressed, repeats = tuple(filter(None, keys.split(", "))), name in _REPEATED
        listed.append(Command(name, title, group, run, pressed, repeats=repeats, hidden=not title))

    group = ""
    for row in table:
        if isinstance(row, str):
            group = row
        else:
            add(group, *row)
    for tool, key in zip(editor.tools.values(), _TOOL_KEYS, strict=True):
        choose = partial(editor.choose, tool.name)
        add("Tools", f"tool:{tool.name}", f"{tool.title}: {tool.hint}", key, choose)
    for k, (name, (title, _)) in enumerate(SNAPS.items(), 1):
        add("Snap", f"snap:{name}", f"Snap to {title.lower()}", str(k), partial(editor.switch, "snap", name))
    for (name, title), key in zip(SHOWN.items(), _SHOWN_KEYS, strict=True):
        add("View", f"show:{name}", title, key, partial(editor.switch, "show", name))
    return listed


TYPED: dict[str, tuple[str, RunWith]] = {
    "grid": ("0.25: distance of the grid's lines", _set_length("grid")),
    "angle": ("15: lines snap to multiples of it", _set_angle),
    "radius": ("0.2: of a robot", _set_length("radius")),
    "robots": ("8: of the team", lambda editor, text: editor.set_robots(_number("robots", text, int))),
    "seed": (
        "3: of the team's places",
        lambda editor, text: setattr(editor, "seed", max(_number("seed", text, int), 0)),
    ),
    "wall": ("0.1: width of walls that are drawn", _set_length("wall_width")),
    "move": ("1 0.5: what is selected", _move),
    "place": ("2 3: lower left corner", _place),
    "rotate": ("30: by degrees", _edit_to(transform.rotated, angle_of)),
    "scale": ("150%: what is selected", _scale),
    "size": ("3 x 2: width and height", _edit_to(transform.resized, size_of)),
    "width": ("0.2: of walls", _set_measure(properties.widened, "width")),
    "circle": ("0.5: radius of circles", _set_measure(properties.sized, "radius")),
    "bevel": ("0.3: cut corners off", lambda editor, text: trim(editor, vertices.bevelled, length_of(text))),
    "round": ("0.3: round corners", lambda editor, text: trim(editor, vertices.rounded_off, length_of(text))),
    "simplify": ("0.05: leave vertices out, to a tolerance", _edit_to(vertices.simplified, length_of)),
    "floor": (
        "0.1: density away from hot spots",
        lambda editor, text: editor.change(density.floor_set(editor.sketch, _number("floor", text, float))),
    ),
    "weight": ("2: of a hot spot", lambda editor, text: editor.tools["density"].enter(editor, text)),
    "density": ("none: takes it away", _set_density),
    "speed": ("0.5: along a path, m/s", _edit_to(paths.path_paced, paths.speed_of)),
    "offset": ("0.2: grow, or shrink with -", _edit_to(boolean.offset, _signed)),
    "array": ("3 x 2 1.5 1.5: columns, rows, distances", _edit_to(transform.arrayed, _array_of)),
    "name": ("pillar: of what is selected", rename),
    "note": ("words: on what is selected", _edit_to(properties.noted, str)),
    "title": ("Hall: of the map", lambda editor, text: editor.change(properties.titled(editor.sketch, text))),
}
"""Commands that are typed with a value: an example of one with its meaning, and the action."""


def typed_commands(editor: Editor) -> list[Command]:
    def run(word: str, text: str) -> None:
        editor.carry_out(lambda: run_typed(editor, text, word))

    rows = [(word, said) for word, (said, _) in TYPED.items()]
    return [Command(word, f"{word} {said}", "", partial(run, word), takes=Takes(said)) for word, said in rows]


def run_typed(editor: Editor, text: str, word: str) -> None:
    """Do what was typed, as ``rotate 30``; raises a MapError when that means nothing, or cannot be done."""
    require(text.strip(), f"{word}: expected a value after it")
    TYPED[word][1](editor, text.strip())


def offered(editor: Editor) -> list[str]:
    """Return the names of the commands that apply to what is selected, with an empty one between groups."""
    groups = _of_vertices(editor) if editor.selection.vertices else _of_things(editor)
    return [name for group in groups if group for name in ("", *group.split())][1:]


def _of_things(editor: Editor) -> list[str]:
    selection = editor.selection
    shapes = [editor.sketch.item(key).shape for key in selection.items if key in editor.sketch.places]
    if not selection:
        drawn = "tool:polygon tool:rectangle tool:circle tool:wall tool:boundary tool:disc"
        return ["paste select:all", drawn, "fit background try"]
    if not shapes and selection.starts:
        return ["copy duplicate delete", "name show:robots fit:selection"]
    if not shapes:
        return ["fit simplify straighten repair", "tool:boundary"]
    one, several = len(selection.owners) == 1, len(shapes) > 1
    walls = sum(isinstance(shape, WallObstacle) for shape in shapes)
    polygons = sum(isinstance(shape, PolygonObstacle) for shape in shapes)
    of_shapes = {
        "join": several and walls == len(shapes),
        "polygons": polygons < len(shapes),
        "simplify straighten": polygons or selection.boundary,
        "boundary:of": one and len(shapes) == polygons == 1,
        "repair": any(problem.of in selection.owners and problem.grave for problem in editor.problems),
    }
    spread = "distribute:x distribute:y" if len(shapes) > 2 else ""
    return [
        "cut copy duplicate delete",
        "name fit:selection" if one and not selection.boundary else "",
        "rotate:left rotate:right mirror:x mirror:y",
        *(["unite subtract intersect divide", f"align:left align:bottom {spread}"] if several else []),
        "group lock hide" if several else "lock hide",
        " ".join(names for names, means_something in of_shapes.items() if means_something),
    ]


def _of_vertices(editor: Editor) -> list[str]:
    selection = editor.selection
    names, aligning = "delete bevel round", "align:left align:bottom"
    if len(selection.vertices) == 1:
        (vertex,), aligning = selection.vertices, ""
        shape = editor.sketch.item(vertex.of).shape if isinstance(vertex.of, int) and vertex.of >= 0 else None
        if isinstance(shape, WallObstacle):
            names += " extend" if vertex.index in (0, len(shape.points) - 1) else " split"
        names += " fill" if vertex.ring else ""
    copying = "copy duplicate" if BOUNDARY not in whole(selection).owners else ""
    return [names, aligning, "straighten simplify", copying]
