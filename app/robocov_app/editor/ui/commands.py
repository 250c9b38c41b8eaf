"""Everything that the editor does, by key, menu, button, palette or typed value."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeVar

from robocov.environment import Point, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import boolean, density, paths, properties, transform, vertices
from robocov_app.editor.edits.clipboard import copied, pasted
from robocov_app.editor.edits.create import anywhere_added
from robocov_app.editor.edits.fixes import fixed, unreachable_filled
from robocov_app.editor.edits.transform import bounds_of
from robocov_app.editor.model.coordinates import angle_of, length_of, point_of, size_of
from robocov_app.editor.model.selection import Change, Selection, Vertex, place_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner
from robocov_app.editor.tools.density import DensityTool
from robocov_app.editor.tools.draw import MeasureTool
from robocov_app.editor.tools.snapping import SNAPS
from robocov_app.editor.ui.editor import SHOWN, Editor
from robocov_app.toolkit import clipboard
from robocov_app.toolkit.command import Command, Takes

FAR = 10  # how many times farther arrows nudge with Shift
FINGER = 12.0  # pixels at scale 1 that a finger is wide
WIDER = 1.25
TOLERANCE = 0.02  # metres that simplified outlines may be off

GHOST = "Type a command, or  rotate 30 · grid 0.25 · width 0.2 · size 3 x 2 · robots 8"

Edit = Callable[..., Change]
Run = Callable[[Editor], object]
RunWith = Callable[[Editor, str], object]
_Number = TypeVar("_Number", int, float)


def selected(editor: Editor) -> Selection:
    if selection := whole(editor.selection):
        return selection
    raise MapError("nothing is selected: click something first, or press Ctrl A")


def edited(edit: Edit, *rest: object) -> Run:
    """Return what makes an edit of the selected things."""
    return lambda editor: editor.change(edit(editor.sketch, selected(editor), *rest))


def align(editor: Editor, side: transform.Side) -> None:
    selection = editor.selection if editor.selection.vertices else selected(editor)
    editor.change(transform.aligned(editor.sketch, selection, side))


def of_map(edit: Edit, *rest: object) -> Run:
    return lambda editor: editor.change(edit(editor.sketch, *rest))


def whole(selection: Selection) -> Selection:
    """Return the selected things, and of selected vertices what they belong to."""
    return selection.without_vertices().plus(Selection.of(*{vertex.of for vertex in selection.vertices}))


def vertices_or_things(selection: Selection) -> Selection:
    return Selection(vertices=selection.vertices) if selection.vertices else selection


def play(editor: Editor) -> str:
    if editor.moves_since is not None:
        editor.moves_since = None
        return "obstacles stand as they are at time zero"
    if not paths.moving(editor.sketch):
        raise MapError("no obstacle moves: the tool Path gives one a path")
    editor.moves_since = editor.now
    return "obstacles move as they will; L ends it"


def back(editor: Editor) -> None:
    """Take the last point back, else delete what is selected."""
    if not editor.tool.back(editor) and not editor.tool.busy and editor.selection:
        delete(editor)


def delete(editor: Editor) -> None:
    selection = editor.selection
    if not selection:
        raise MapError("nothing is selected: click something first")
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
    if not text.strip():
        raise MapError("the clipboard is empty")
    editor.change(pasted(editor.sketch, text, at, editor.grid if "grid" in editor.snaps else None))


def duplicate(editor: Editor) -> None:
    by = editor.grid * FAR / 2
    editor.change(transform.duplicated(editor.sketch, selected(editor), by, -by))


def level(editor: Editor) -> None:
    """Turn the whole map so that the line that was measured is level or upright."""
    tape = editor.tools["measure"]
    assert isinstance(tape, MeasureTool)
    if len(tape.measured) != 2:
        raise MapError("measure along a wall first: the tool Measure, two clicks")
    editor.change(transform.levelled(editor.sketch, *tape.measured))
    tape.cancel(editor)


def nudge(x: int, y: int) -> Run:

    def run(editor: Editor) -> None:
        selection = editor.selection
        if not selection:
            raise MapError("nothing is selected: arrows move what is; Ctrl and arrows move the sheet")
        moved = move(editor, x * editor.grid, y * editor.grid, vertices_or_things(selection))
        editor.change(moved, drag=("nudge", selection))

    return run


def move(editor: Editor, dx: float, dy: float, selection: Selection) -> Change:
    act = vertices.moved if selection.vertices else transform.moved
    return act(editor.sketch, selection, dx, dy)


def cancel(editor: Editor) -> None:
    """Give up what is half done, else put the tool away, else select nothing."""
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
    if len(editor.selection.vertices) != 1:
        raise MapError("select one vertex first: click an obstacle, then one of its corners")
    (vertex,) = editor.selection.vertices
    return vertex


def trim(editor: Editor, edit: Edit, length: float | None = None) -> None:
    """Cut the selected corners off, or round them, by twice the grid unless a length is given, m."""
    if not editor.selection.vertices:
        raise MapError("select corners first: click an obstacle, then its corners, or drag a box around them")
    editor.change(edit(editor.sketch, vertices_or_things(editor.selection), length or 2 * editor.grid))


def extend(editor: Editor) -> None:
    """Go on with a wall from the vertex that is selected, to where the cursor is."""
    if editor.cursor is None:
        raise MapError("move the mouse to where the wall is to go on to")
    vertex = one_vertex(editor)
    to = editor.snapped(editor.cursor, FINGER * editor.pixel, place_of(editor.sketch, vertex)).point
    editor.change(vertices.extended(editor.sketch, vertex, to))


def fill(editor: Editor) -> None:
    vertex = one_vertex(editor)
    if not isinstance(vertex.of, int) or vertex.ring == 0:
        raise MapError("select a vertex of the hole first")
    editor.change(vertices.hole_filled(editor.sketch, vertex.of, vertex.ring))


def widen(editor: Editor, factor: float) -> None:
    """Make the selected walls wider or narrower, and those that are drawn."""
    selection = whole(editor.selection)
    shapes = [editor.sketch.item(key).shape for key in selection.items]
    widths = [shape.width for shape in shapes if isinstance(shape, WallObstacle)]
    width = round(max((widths[0] if widths else editor.wall_width) * factor, 0.01), 3)
    if widths and not editor.tool.busy:
        change = properties.widened(editor.sketch, selection, width)
        editor.change(change, drag=("width", editor.selection))
    editor.set_length("wall_width", width)
    editor.say(f"walls are {width:g} m wide")


def next_start(editor: Editor) -> None:
    names = editor.start_names
    if not names:
        raise MapError("the map has no start yet: S draws one")
    now = editor.start_name
    name = names[(names.index(now) + 1) % len(names)] if now in names else names[0]
    editor.start = name
    editor.select(Selection.of(name))
    editor.say(f"start “{name}”")


def make_default(editor: Editor) -> None:
    if len(editor.selection.starts) != 1:
        raise MapError("select one start first")
    (name,) = editor.selection.starts
    editor.change(properties.start_first(editor.sketch, name))


def make_areas(editor: Editor) -> None:
    tool = editor.tools["density"]
    assert isinstance(tool, DensityTool)
    editor.change(density.areas_made(editor.sketch, selected(editor), tool.weight))


def fix_problem(editor: Editor) -> None:
    """Mend the problem that is shown, or the first that can be."""
    for problem in [editor.problem] if editor.problem is not None else editor.problems:
        change = fixed(editor.sketch, problem, editor.radius)
        if change is not None:
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
        raise MapError(f"{word}: {text!r}, but {wanted} was wanted") from None


def _set_angle(editor: Editor, text: str) -> None:
    angle = angle_of(text)
    if not 0.1 <= angle <= 90.0:
        raise MapError(f"angle: {angle:g}°, but 0.1° to 90° was wanted")
    editor.snap_angle = angle
    editor.say(f"angles snap to multiples of {angle:g}°")


def _set_length(name: str) -> RunWith:
    return lambda editor, text: editor.set_length(name, length_of(text, now=getattr(editor, name)))


def _edit_to(edit: Edit, read: Callable[[str], object]) -> RunWith:
    return lambda editor, text: editor.change(edit(editor.sketch, selected(editor), read(text)))


def _move(editor: Editor, text: str) -> None:
    text = text.strip()
    dx, dy = point_of(text if text[0] in "+@" else f"@{text}", last=(0.0, 0.0))
    editor.change(move(editor, dx, dy, editor.selection or selected(editor)))


def _place(editor: Editor, text: str) -> None:
    selection = selected(editor)
    bounds = bounds_of(editor.sketch, selection)
    x, y = point_of(text, last=bounds[:2] if bounds else None)
    editor.change(transform.placed(editor.sketch, selection, x, y))


def _scale(editor: Editor, text: str) -> None:
    selection = selected(editor)
    if bounds_of(editor.sketch, selection) is None:
        raise MapError("there is nothing to scale")
    factor = length_of(text if text.endswith("%") else f"*{text.lstrip('*x')}", now=1.0)
    editor.change(transform.scaled(editor.sketch, selection, factor))


def _size(editor: Editor, text: str) -> None:
    width, height = size_of(text)
    editor.change(transform.resized(editor.sketch, selected(editor), width, height))


def _name(editor: Editor, text: str) -> None:
    owners = whole(editor.selection).owners
    if len(owners) != 1:
        raise MapError("select one obstacle or start first")
    (owner,) = owners
    editor.change(properties.renamed(editor.sketch, owner, text))


def _signed(text: str) -> float:
    sign = -1.0 if text.strip().startswith("-") else 1.0
    return sign * length_of(text.strip().lstrip("+-"))


def _set_density(editor: Editor, text: str) -> None:
    if text.strip() != "none":
        raise MapError(f"density: {text!r}, but none was wanted; hot spots are drawn with the tool Density")
    editor.change(density.density_removed(editor.sketch))


def _array(editor: Editor, text: str) -> None:
    parts = text.replace("x", " ").split()
    if len(parts) != 4:
        raise MapError("array: columns, rows and both distances were wanted, as in array 3 x 2 1.5 1.5")
    columns, rows = (_number("array", each, int) for each in parts[:2])
    dx, dy = (length_of(each.lstrip("-")) * (-1.0 if each.startswith("-") else 1.0) for each in parts[2:])
    editor.change(transform.arrayed(editor.sketch, selected(editor), columns, rows, dx, dy))


GROUPS = ("File", "Edit", "Arrange", "Combine", "Tools", "Vertices", "Snap", "View", "Robots", "Help")
"""Headings of the help, in their order."""

# of the tools and of what is shown, in their order
_TOOL_KEYS = ("v", "g", "p", "r", "c", "w", "k", "b", "m", "s", "shift+s", "d", "o", "i")
_SHOWN_KEYS = ("alt+3", "alt+2", "alt+1", "alt+5", "a", "alt+6", "alt+7", "alt+4")

# commands that are done again and again while their key is held down
_REPEATED = (
    *("undo", "redo", "paste", "duplicate", "select:next", "select:previous", "back", "more", "fewer"),
    *("left", "right", "up", "down", "left:far", "right:far", "up:far", "down:far", "wider", "narrower"),
    *("rotate:left", "rotate:right", "grid:finer", "grid:coarser", "zoom:in", "zoom:out", "problem:next"),
    *("pan:left", "pan:right", "pan:up", "pan:down"),
)

# keys are separated by commas; what the window does has no function here
_ROWS: dict[str, tuple[tuple[str, str, str, Run | None], ...]] = {
    "File": (
        ("new", "New map", "ctrl+n", None),
        ("open", "Open a map", "ctrl+o", None),
        ("recent", "Open a recent or bundled map", "ctrl+shift+o", None),
        ("save", "Save", "ctrl+s", None),
        ("save:as", "Save as", "ctrl+shift+s", None),
        ("export", "Export to another format", "ctrl+e", None),
        ("background", "Picture under the map", "ctrl+b", None),
        ("background:none", "Take the picture under the map away", "", of_map(properties.underlaid, None)),
        ("reload", "Read the file again", "ctrl+r", None),
        ("try", "Try it in the demo, and back", "f5", None),
        ("screenshot", "Screenshot", "f12", None),
        ("quit", "Quit", "ctrl+q", None),
    ),
    "Edit": (
        ("undo", "Undo", "ctrl+z", Editor.undo),
        ("redo", "Redo", "ctrl+y, ctrl+shift+z", Editor.redo),
        ("cut", "Cut", "ctrl+x", cut),
        ("copy", "Copy", "ctrl+c", copy),
        ("paste", "Paste at the cursor", "ctrl+v", lambda editor: paste(editor, editor.cursor)),
        ("paste:there", "Paste in the same place", "ctrl+shift+v", lambda editor: paste(editor, None)),
        ("duplicate", "Duplicate", "ctrl+d", duplicate),
        ("delete", "Delete", "delete, x", delete),
        ("select:all", "Select all", "ctrl+a", lambda editor: editor.select(Selection.all(editor.sketch))),
        ("select:next", "Select the next obstacle", "tab", partial(select_next, by=1)),
        ("select:previous", "Select the previous obstacle", "shift+tab", partial(select_next, by=-1)),
        ("name", "Name what is selected", "f2", None),
        ("left", "Nudge by the grid (all arrows)", "left", nudge(-1, 0)),
        ("right", "", "right", nudge(1, 0)),
        ("up", "", "up", nudge(0, 1)),
        ("down", "", "down", nudge(0, -1)),
        ("left:far", "Nudge ten times as far (all arrows)", "shift+left", nudge(-FAR, 0)),
        ("right:far", "", "shift+right", nudge(FAR, 0)),
        ("up:far", "", "shift+up", nudge(0, FAR)),
        ("down:far", "", "shift+down", nudge(0, -FAR)),
        ("finish", "Finish what is being drawn", "return, enter", lambda editor: editor.tool.finish(editor)),
        ("back", "Take the last point back, or delete", "backspace", back),
        ("cancel", "Give up; select nothing; close", "escape", cancel),
        ("menu", "What can be done here (right click)", "menu, shift+f10", None),
    ),
    "Arrange": (
        ("rotate:left", "Turn by 90° to the left", "q", edited(transform.rotated, 90.0)),
        ("rotate:right", "Turn by 90° to the right", "e", edited(transform.rotated, -90.0)),
        ("level", "Level: turn the map so that the measured line is level or upright", "", level),
        ("mirror:x", "Mirror left and right", "shift+h", edited(transform.mirrored, "x")),
        ("mirror:y", "Mirror up and down", "shift+v", edited(transform.mirrored, "y")),
        ("align:left", "Align left sides", "alt+left", partial(align, side="left")),
        ("align:right", "Align right sides", "alt+right", partial(align, side="right")),
        ("align:top", "Align tops", "alt+up", partial(align, side="top")),
        ("align:bottom", "Align bottoms", "alt+down", partial(align, side="bottom")),
        ("align:centre", "Align middles across", "alt+c", partial(align, side="centre")),
        ("align:middle", "Align middles in height", "alt+m", partial(align, side="middle")),
        ("distribute:x", "Equal gaps across", "alt+x", edited(transform.distributed, "x")),
        ("distribute:y", "Equal gaps in height", "alt+y", edited(transform.distributed, "y")),
        ("raise", "To the top", "page up", edited(properties.raised, "top")),
        ("lower", "To the bottom", "page down", edited(properties.raised, "bottom")),
        ("group", "Group: a click selects all of it", "ctrl+g", edited(properties.grouped)),
        ("ungroup", "Take out of its group", "ctrl+shift+g", edited(properties.ungrouped)),
        ("lock", "Lock: the mouse takes it no more", "ctrl+l", edited(properties.locked)),
        ("hide", "Hide in the editor", "ctrl+h", edited(properties.hidden)),
        ("release", "Unlock and show all", "ctrl+shift+l", of_map(properties.released)),
    ),
    "Combine": (
        ("unite", "Unite", "alt+u", edited(boolean.united)),
        ("subtract", "Subtract the upper ones", "alt+s", edited(boolean.subtracted)),
        ("intersect", "Keep what they have in common", "alt+i", edited(boolean.intersected)),
        ("divide", "Cut along each other", "alt+d", edited(boolean.divided)),
        (
            "clip",
            "Cut off outside the boundary",
            "alt+b",
            lambda editor: editor.change(boolean.clipped(editor.sketch, editor.selection.without_vertices())),
        ),
        ("join", "Join walls end to end", "alt+j", edited(vertices.joined)),
        ("polygons", "Turn into polygons", "alt+p", edited(properties.made_polygons)),
        ("boundary:of", "Make it the boundary", "", edited(properties.made_boundary)),
        ("repair", "Repair crossing outlines", "alt+r", edited(boolean.repaired)),
        ("density:area", "Make it an area that counts more", "", make_areas),
        (
            "fill:unreachable",
            "Fill all that robots cannot reach",
            "",
            lambda editor: editor.change(unreachable_filled(editor.sketch, editor.radius)),
        ),
    ),
    "Vertices": (
        ("bevel", "Cut corners off", "shift+b", lambda editor: trim(editor, vertices.bevelled)),
        ("round", "Round corners", "shift+r", lambda editor: trim(editor, vertices.rounded_off)),
        (
            "split",
            "Cut a wall in two here",
            "shift+c",
            lambda editor: editor.change(vertices.split(editor.sketch, one_vertex(editor))),
        ),
        ("extend", "Go on with the wall from here", "shift+w", extend),
        ("fill", "Fill the hole", "shift+f", fill),
        ("simplify", "Leave needless vertices out", "shift+p", edited(vertices.simplified, TOLERANCE)),
        ("straighten", "Make edges straight that nearly are", "shift+l", edited(vertices.straightened)),
        ("path:repeat", "Obstacle goes in a loop, or back and forth", "shift+o", edited(paths.path_turned)),
        ("path:none", "Take an obstacle's path away", "alt+o", edited(paths.path_removed)),
        ("wider", "Wider walls", "]", lambda editor: widen(editor, WIDER)),
        ("narrower", "Narrower walls", "[", lambda editor: widen(editor, 1.0 / WIDER)),
    ),
    "Snap": (
        ("grid:finer", "Finer grid", "-", lambda editor: editor.change_grid(-1)),
        ("grid:coarser", "Coarser grid", "=, +", lambda editor: editor.change_grid(1)),
        ("snap:all", "Snap to everything, or to nothing", "0", lambda editor: editor.switch("snap", "all")),
    ),
    "View": (
        ("fit", "Show the whole map", "f", None),
        ("fit:selection", "Show what is selected", "z", None),
        ("zoom:in", "Zoom in", "ctrl+=, ctrl++", None),
        ("zoom:out", "Zoom out", "ctrl+-", None),
        ("pan:left", "Pan (all arrows)", "ctrl+left", None),
        ("pan:right", "", "ctrl+right", None),
        ("pan:up", "", "ctrl+up", None),
        ("pan:down", "", "ctrl+down", None),
        ("pan:hold", "Pan while it is held down", "space", None),
        ("theme", "Light or dark", "t", None),
        ("panel", "Hide or show the panel", "h", None),
        ("tab", "Next page of the panel", "ctrl+tab", None),
        ("fullscreen", "Full screen", "f11", None),
        ("path:play", "Let obstacles move, or stand again", "l", play),
        ("problem:next", "Go to the next problem", "f8, n", next_problem),
        ("problem:fix", "Mend the problem that is shown", "shift+f8", fix_problem),
    ),
    "Robots": (
        ("start:uniform", "A start anywhere in the free space", "shift+u", of_map(anywhere_added)),
        ("start:next", "Next start of the map", "shift+n", next_start),
        ("start:default", "Make it the default start", "shift+d", make_default),
        ("more", "One robot more", "shift+=, shift++", lambda editor: editor.add_robots(1)),
        ("fewer", "One robot fewer", "shift+-", lambda editor: editor.add_robots(-1)),
    ),
    "Help": (("help", "Keys", "f1, shift+/", None), ("palette", "Commands by name", "ctrl+k, /", None)),
}


def editor_commands(editor: Editor, of_window: Mapping[str, Callable[[], object]]) -> list[Command]:
    found = []
    for group, rows in _ROWS.items():
        for name, title, keys, run in rows:
            does = of_window[name] if run is None else partial(run, editor)
            pressed = tuple(keys.split(", ")) if keys else ()
            repeats, hidden = name in _REPEATED, not title
            found.append(Command(name, title, group, does, pressed, repeats=repeats, hidden=hidden))
    for tool, key in zip(editor.tools.values(), _TOOL_KEYS, strict=True):
        choose, title = partial(editor.choose, tool.name), f"{tool.title}: {tool.hint}"
        found.append(Command(f"tool:{tool.name}", title, "Tools", choose, (key,)))
    titles = [(name, f"Snap to {title.lower()}") for name, (title, _) in SNAPS.items()]
    snaps = [(*titled, str(k)) for k, titled in enumerate(titles, 1)]
    shows = [(name, title, key) for (name, title), key in zip(SHOWN.items(), _SHOWN_KEYS, strict=True)]
    for kind, group, switches in (("snap", "Snap", snaps), ("show", "View", shows)):
        for name, title, key in switches:
            found.append(Command(f"{kind}:{name}", title, group, partial(editor.switch, kind, name), (key,)))
    return found


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
    "size": ("3 x 2: width and height", _size),
    "width": ("0.2: of walls", _edit_to(properties.widened, length_of)),
    "circle": ("0.5: radius of circles", _edit_to(properties.sized, length_of)),
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
    "array": ("3 x 2 1.5 1.5: columns, rows, distances", _array),
    "name": ("pillar: of what is selected", _name),
    "note": ("words: on what is selected", _edit_to(properties.noted, str)),
    "title": ("Hall: of the map", lambda editor, text: editor.change(properties.titled(editor.sketch, text))),
}
"""Commands that are typed with a value: an example of one with its meaning, and the action."""


def typed_commands(editor: Editor) -> list[Command]:

    def run(word: str, text: str) -> None:
        editor.carry_out(lambda: run_typed(editor, word, text))

    return [
        Command(word, f"{word} {example}", "", partial(run, word), takes=Takes(example))
        for word, (example, _) in TYPED.items()
    ]


def run_typed(editor: Editor, word: str, text: str) -> None:
    """Do what was typed, as ``rotate 30``; raises a MapError when that means nothing, or cannot be done."""
    if not text.strip():
        raise MapError(f"{word}: a value was wanted after it")
    TYPED[word][1](editor, text.strip())


def offered(editor: Editor) -> list[str]:
    """Return the names of the actions that apply to what is selected, with an empty one between groups."""
    names = [name for group in _offered_groups(editor) if group for name in ("", *group)]
    return names[1:]


def _offered_groups(editor: Editor) -> list[list[str]]:
    selection = editor.selection
    if not selection:
        drawn = ["polygon", "rectangle", "circle", "wall", "boundary", "disc"]
        tools = [f"tool:{name}" for name in drawn]
        return [["paste", "select:all"], tools, ["fit", "background", "try"]]
    if selection.vertices:
        return _of_vertices(editor)
    shapes = [editor.sketch.item(key).shape for key in selection.items if key in editor.sketch.places]
    if selection.starts and not shapes:
        return [["copy", "duplicate", "delete"], ["name", "show:robots", "fit:selection"]]
    if not shapes:
        return [["fit", "simplify", "straighten", "repair"], ["tool:boundary"]]
    one, several = len(selection.owners) == 1, len(shapes) > 1
    walls = sum(isinstance(shape, WallObstacle) for shape in shapes)
    polygons = sum(isinstance(shape, PolygonObstacle) for shape in shapes)
    spread = ["distribute:x", "distribute:y"] if len(shapes) > 2 else []
    of_shapes = {
        "join": several and walls == len(shapes),
        "polygons": polygons < len(shapes),
        "simplify": polygons or selection.boundary,
        "straighten": polygons or selection.boundary,
        "boundary:of": one and len(shapes) == polygons == 1,
        "repair": any(problem.of in selection.owners and problem.grave for problem in editor.problems),
    }
    return [
        ["cut", "copy", "duplicate", "delete"],
        ["name", "fit:selection"] if one and not selection.boundary else [],
        ["rotate:left", "rotate:right", "mirror:x", "mirror:y"],
        ["unite", "subtract", "intersect", "divide"] if several else [],
        ["align:left", "align:bottom", *spread] if several else [],
        [*(["group"] if several else []), "lock", "hide"] if shapes else [],
        [name for name, means_something in of_shapes.items() if means_something],
    ]


def _of_vertices(editor: Editor) -> list[list[str]]:
    selection = editor.selection
    names, aligning = ["delete", "bevel", "round"], ["align:left", "align:bottom"]
    if len(selection.vertices) == 1:
        (vertex,), aligning = selection.vertices, []
        shape = editor.sketch.item(vertex.of).shape if isinstance(vertex.of, int) and vertex.of >= 0 else None
        if isinstance(shape, WallObstacle):
            names.append("extend" if vertex.index in (0, len(shape.points) - 1) else "split")
        if vertex.ring:
            names.append("fill")
    copying = ["copy", "duplicate"] if BOUNDARY not in whole(selection).owners else []
    return [names, aligning, ["straighten", "simplify"], copying]
