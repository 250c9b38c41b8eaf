"""Edits of what things are: deleted, named, noted, sized, ordered, grouped, locked, hidden."""

from dataclasses import replace
from itertools import count

from robocov.environment import CircleObstacle, DiscStart, Obstacle, PolygonObstacle, WallObstacle
from robocov.errors import MapError, one_line
from robocov.mapfile.models import LARGEST, SMALLEST
from robocov_app.editor.edits import vertices
from robocov_app.editor.edits.create import encodable, label_of
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.geometry import outlines, tenths
from robocov_app.editor.model.selection import Change, Selection, display_name, replace_obstacles
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

_LONGEST_TEXT = 10_000


def deleted(sketch: Sketch, selection: Selection) -> Change:
    """Delete what is selected; of single vertices, what `vertices.deleted` deletes."""
    if not selection:
        raise MapError("select something first")
    words = f"{selection.words(sketch)} deleted"
    after = sketch.without(selection.items)
    kept = tuple(pair for pair in sketch.starts if pair[0] not in selection.starts)
    after = replace(after, starts=kept, boundary=None if selection.boundary else sketch.boundary)
    others = Selection(vertices=selection.vertices).within(after)
    return Change(vertices.deleted(after, others).sketch if others else after, Selection(), words)


def renamed(sketch: Sketch, owner: Owner, name: str) -> Change:
    """Name an obstacle or a start; an empty name takes an obstacle's name away."""
    name = label_of(name)
    before = display_name(sketch, owner)
    if owner == BOUNDARY:
        raise MapError("the boundary has no name; the map has one")
    if isinstance(owner, str):
        if not name:
            raise MapError("a start needs a name")
        if name != owner and name in dict(sketch.starts):
            raise MapError(f"there is a start “{name}” already")
        starts = tuple((name if each == owner else each, spec) for each, spec in sketch.starts)
        return Change(replace(sketch, starts=starts), Selection.of(name), f"{before} renamed to “{name}”")
    shape = replace(sketch.item(owner).shape, name=name or None)
    words = f"{before} renamed to “{name}”" if name else f"{before}: name taken away"
    return Change(sketch.with_shapes({owner: shape}), Selection.of(owner), words)


def noted(sketch: Sketch, selection: Selection, note: str) -> Change:
    """Write a note to the selected obstacles; an empty one takes it away."""
    if not selection.items:
        raise MapError("select obstacles first: notes are written to them")
    if len(note) > _LONGEST_TEXT:
        raise MapError(f"a note has at most {_LONGEST_TEXT} characters")
    note = encodable(note.strip())
    what = f"note on {Selection(items=selection.items).words(sketch)}"
    return _marked(sketch, selection, what if note else f"{what} taken away", note=note)


def grouped(sketch: Sketch, selection: Selection, name: str = "") -> Change:
    """Put the selected obstacles into a group, a new one without a name: a click selects all of it."""
    if len(selection.items) < 2:
        raise MapError("select two or more obstacles to group")
    taken = {item.group for item in sketch.obstacles}
    name = label_of(name) or next(each for k in count(1) if (each := f"group {k}") not in taken)
    words = f"{Selection(items=selection.items).words(sketch)} grouped as “{name}”"
    return _marked(sketch, selection, words, group=name)


def ungrouped(sketch: Sketch, selection: Selection) -> Change:
    """Take the selected obstacles out of their groups."""
    keys = [key for key in selection.items if sketch.item(key).group]
    if not keys:
        raise MapError("select obstacles that are in a group")
    return _marked(sketch, Selection.of(*keys), f"{Selection.of(*keys).words(sketch)} ungrouped", group="")


def locked(sketch: Sketch, selection: Selection, on: bool = True) -> Change:
    """Lock obstacles, so that the mouse cannot take them, or unlock them."""
    words = f"{Selection(items=selection.items).words(sketch)} {'locked' if on else 'unlocked'}"
    return _marked(sketch, selection, words, locked=on)


def hidden(sketch: Sketch, selection: Selection, on: bool = True) -> Change:
    """Hide obstacles in the editor, or show them again; robots meet them all the same."""
    words = f"{Selection(items=selection.items).words(sketch)} {'hidden' if on else 'shown'}"
    return _marked(sketch, selection, words, hidden=on)


def released(sketch: Sketch) -> Change:
    """Unlock and show all obstacles; those that were locked or hidden are selected then."""
    keys = [item.key for item in sketch.obstacles if item.locked or item.hidden]
    if not keys:
        raise MapError("nothing is locked or hidden")
    words = f"{Selection.of(*keys).words(sketch)} unlocked and shown"
    return _marked(sketch, Selection.of(*keys), words, locked=False, hidden=False)


def _marked(sketch: Sketch, selection: Selection, words: str, **marks: str | bool) -> Change:
    if not selection.items:
        raise MapError("select obstacles first")
    items = tuple(
        replace(item, **marks) if item.key in selection.items else item  # type: ignore[arg-type]
        for item in sketch.obstacles
    )
    gone = selection.items if marks.get("locked") or marks.get("hidden") else frozenset()
    left = replace(selection, items=selection.items - gone) if gone else selection
    return Change(replace(sketch, obstacles=items), left, words)


def titled(sketch: Sketch, name: str | None = None, description: str | None = None) -> Change:
    """Change the map's name, or its description."""
    after, words = sketch, "map described"
    if name is not None:
        name = label_of(name)
        if not name:
            raise MapError("a map needs a name")
        after, words = replace(after, name=name), f"map named “{name}”"
    if description is not None:
        if len(description) > _LONGEST_TEXT:
            raise MapError(f"a description has at most {_LONGEST_TEXT} characters")
        after = replace(after, description=encodable(description.strip()))
    return Change(after, Selection(), words)


def widened(sketch: Sketch, selection: Selection, width: float) -> Change:
    """Make the selected walls so many metres wide."""
    if not SMALLEST <= width <= LARGEST:
        raise MapError(f"a width of at least {1000 * SMALLEST:g} mm was wanted")
    chosen = {key: sketch.item(key).shape for key in selection.items}
    walls = {key: shape for key, shape in chosen.items() if isinstance(shape, WallObstacle)}
    if not walls:
        raise MapError("select walls first")
    words = f"{Selection.of(*walls).words(sketch)} made {tenths(width):g} m wide"
    shapes = {key: replace(wall, width=tenths(width)) for key, wall in walls.items()}
    return Change(sketch.with_shapes(shapes), selection, words)


def sized(sketch: Sketch, selection: Selection, radius: float) -> Change:
    """Give the selected circles and discs that radius, m."""
    if not SMALLEST <= radius <= LARGEST:
        raise MapError(f"a radius of at least {1000 * SMALLEST:g} mm was wanted")
    radius = tenths(radius)
    shapes: dict[int, Obstacle] = {}
    for key in selection.items:
        shape = sketch.item(key).shape
        if isinstance(shape, CircleObstacle):
            shapes[key] = replace(shape, radius=radius)
    after, discs = sketch.with_shapes(shapes), []
    for name in selection.starts:
        spec = sketch.start(name)
        if isinstance(spec, DiscStart):
            discs.append(name)
            after = after.with_start(name, replace(spec, radius=radius))
    if not shapes and not discs:
        raise MapError("select circles first, or starts that are discs")
    what = Selection.of(*shapes, *discs).words(sketch)
    return Change(after, selection, f"{what} given a radius of {radius:g} m")


def raised(sketch: Sketch, selection: Selection, where: str) -> Change:
    """Change the order of the selected obstacles: to the "top" or to the "bottom"."""
    if not selection.items:
        raise MapError("select obstacles first")
    chosen = tuple(item for item in sketch.obstacles if item.key in selection.items)
    rest = tuple(item for item in sketch.obstacles if item.key not in selection.items)
    orders = {"top": (rest + chosen, "brought to the top"), "bottom": (chosen + rest, "sent to the bottom")}
    if where not in orders:
        raise MapError("top or bottom was wanted")
    order, way = orders[where]
    words = f"{Selection(items=selection.items).words(sketch)} {way}"
    return Change(replace(sketch, obstacles=order), selection, words)


def start_first(sketch: Sketch, name: str) -> Change:
    """Make a start the map's default: the first."""
    if name not in dict(sketch.starts):
        raise MapError(f"there is no start “{one_line(name)}”")
    starts = tuple(sorted(sketch.starts, key=lambda pair: pair[0] != name))
    words = f"start “{one_line(name)}” made the default"
    return Change(replace(sketch, starts=starts), Selection.of(name), words)


def made_polygons(sketch: Sketch, selection: Selection) -> Change:
    """Turn the selected circles and walls into polygons, whose vertices can be edited one by one."""
    chosen = [key for key in selection.items if not isinstance(sketch.item(key).shape, PolygonObstacle)]
    if not chosen:
        raise MapError("select circles or walls first")
    shapes = {}
    for key in chosen:
        item = sketch.item(key)
        polygons = outlines(item.geometry, item.shape.name)
        if not polygons:
            raise MapError(f"the {display_name(sketch, key)} covers nothing: it cannot become a polygon")
        shapes[key] = [replace(polygon, path=item.shape.path) for polygon in polygons]
    words = f"{Selection.of(*chosen).words(sketch)} turned into polygons"
    change = replace_obstacles(sketch, shapes, words)
    return replace(change, selection=change.selection.plus(selection.without_vertices()))


def made_boundary(sketch: Sketch, selection: Selection) -> Change:
    """Make the outline of the one selected polygon the boundary, in place of the obstacle."""
    shapes = [sketch.item(key).shape for key in selection.items]
    if len(shapes) != 1 or not isinstance(shapes[0], PolygonObstacle):
        raise MapError("select one polygon: its outline becomes the boundary")
    after = replace(sketch.without(selection.items), boundary=shapes[0].vertices)
    return Change(after, Selection(boundary=True), f"{selection.words(sketch)} made the boundary")


def underlaid(sketch: Sketch, background: Background | None) -> Change:
    """Put a picture under the map, change it, or take it away."""
    words = "picture laid under" if sketch.background is None else "picture changed"
    words = "picture taken away" if background is None else words
    return Change(replace(sketch, background=background), Selection(), words)
