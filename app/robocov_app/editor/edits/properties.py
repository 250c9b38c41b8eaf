"""Edits of what things are: deleted, named, noted, sized, ordered, grouped, locked, hidden."""

from dataclasses import replace
from functools import partial
from itertools import count
from typing import Any

from robocov.environment import PolygonObstacle
from robocov.errors import MapError, to_one_line
from robocov.mapfile.models import MAX_SIZE_M, MIN_SIZE_M
from robocov_app.editor.edits import create, vertices
from robocov_app.editor.model import require
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.geometry import outlines, tenths
from robocov_app.editor.model.selection import Change, Selection, replace_obstacles
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch


def deleted(sketch: Sketch, selection: Selection) -> Change:
    require(selection, "select something first")
    after = sketch.without(selection.items | selection.starts)
    after = replace(after, boundary=None if selection.boundary else sketch.boundary)
    others = Selection(vertices=selection.vertices).within(after)
    after = vertices.deleted(after, others).sketch if others else after
    return Change(after, Selection(), f"{selection.words(sketch)} deleted")


def renamed(sketch: Sketch, owner: Owner, name: str) -> Change:
    """Name an obstacle or a start; an empty name takes an obstacle's name away."""
    name = create.label_of(name)
    words = f"{sketch.display_name(owner)} renamed to “{name}”"
    require(owner != BOUNDARY, "the boundary has no name; the map has one")
    if isinstance(owner, str):
        require(name, "a start needs a name")
        require(name == owner or name not in dict(sketch.starts), f"there is a start “{name}” already")
        starts = tuple((name if each == owner else each, spec) for each, spec in sketch.starts)
        return Change(replace(sketch, starts=starts), Selection.of(name), words)
    words = words if name else f"{sketch.display_name(owner)}: name taken away"
    after = sketch.with_things({owner: replace(sketch.item(owner).shape, name=name or None)})
    return Change(after, Selection.of(owner), words)


def noted(sketch: Sketch, selection: Selection, note: str) -> Change:
    require(selection.items, "select obstacles first: notes are written to them")
    note = create.text_of(note, "a note")
    words = f"note on {Selection(items=selection.items).words(sketch)}{'' if note else ' taken away'}"
    return replace(_marked(sketch, selection, "", note=note), words=words)


def grouped(sketch: Sketch, selection: Selection, name: str = "") -> Change:
    """Put the selected obstacles into a group, a new one without a name: a click selects all of it."""
    require(len(selection.items) >= 2, "select two or more obstacles to group")
    taken = {item.group for item in sketch.obstacles}
    name = create.label_of(name) or next(each for k in count(1) if (each := f"group {k}") not in taken)
    return _marked(sketch, selection, f"grouped as “{name}”", group=name)


def ungrouped(sketch: Sketch, selection: Selection) -> Change:
    keys = [key for key in selection.items if sketch.item(key).group]
    require(keys, "select obstacles that are in a group")
    return _marked(sketch, Selection.of(*keys), "ungrouped", group="")


def released(sketch: Sketch) -> Change:
    """Unlock and show all obstacles; those that were locked or hidden are selected then."""
    keys = [item.key for item in sketch.obstacles if not item.takeable]
    require(keys, "nothing is locked or hidden")
    return _marked(sketch, Selection.of(*keys), "unlocked and shown", locked=False, hidden=False)


def _marked(sketch: Sketch, selection: Selection, words: str, **marks: Any) -> Change:
    require(selection.items, "select obstacles first")
    items = tuple(replace(i, **marks) if i.key in selection.items else i for i in sketch.obstacles)
    words = f"{Selection(items=selection.items).words(sketch)} {words}"
    left = replace(selection, items=frozenset()) if True in marks.values() else selection
    return Change(replace(sketch, obstacles=items), left, words)


locked = partial(_marked, words="locked", locked=True)  # the mouse cannot take them
hidden = partial(_marked, words="hidden", hidden=True)  # in the editor; robots meet them all the same


def titled(sketch: Sketch, name: str | None = None, description: str | None = None) -> Change:
    after, words = sketch, "map described"
    if name is not None:
        name = create.label_of(name)
        require(name, "a map needs a name")
        after, words = replace(after, name=name), f"map named “{name}”"
    if description is not None:
        after = replace(after, description=create.text_of(description, "a description"))
    return Change(after, Selection(), words)


def widened(sketch: Sketch, selection: Selection, width: float) -> Change:
    return _sized(sketch, selection, "width", width, "select walls first", "made {:g} m wide")


def sized(sketch: Sketch, selection: Selection, radius: float) -> Change:
    missing = "select circles first, or starts that are discs"
    return _sized(sketch, selection, "radius", radius, missing, "given a radius of {:g} m")


def _sized(sketch: Sketch, selection: Selection, name: str, size: float, missing: str, words: str) -> Change:
    require(MIN_SIZE_M <= size <= MAX_SIZE_M, f"expected a {name} of at least {1000 * MIN_SIZE_M:g} mm")
    things: dict[Owner, Any] = {owner: sketch.thing(owner) for owner in selection.owners}
    sized = {owner: thing for owner, thing in things.items() if hasattr(thing, name)}
    require(sized, missing)
    after = sketch.with_things({o: replace(thing, **{name: tenths(size)}) for o, thing in sized.items()})
    return Change(after, selection, f"{Selection.of(*sized).words(sketch)} {words.format(tenths(size))}")


def raised(sketch: Sketch, selection: Selection, where: str) -> Change:
    require(selection.items, "select obstacles first")
    require(where in ("top", "bottom"), "expected top or bottom")
    upper = selection.items if where == "top" else sketch.places.keys() - selection.items
    order = tuple(sorted(sketch.obstacles, key=lambda item: item.key in upper))
    way = "brought to the top" if where == "top" else "sent to the bottom"
    words = f"{Selection(items=selection.items).words(sketch)} {way}"
    return Change(replace(sketch, obstacles=order), selection, words)


def start_first(sketch: Sketch, name: str) -> Change:
    require(name in dict(sketch.starts), f"there is no start “{to_one_line(name)}”")
    starts = tuple(sorted(sketch.starts, key=lambda pair: pair[0] != name))
    words = f"start “{to_one_line(name)}” made the default"
    return Change(replace(sketch, starts=starts), Selection.of(name), words)


def made_polygons(sketch: Sketch, selection: Selection) -> Change:
    chosen = [item for item in selection.items_in(sketch) if not isinstance(item.shape, PolygonObstacle)]
    require(chosen, "select circles or walls first")
    shapes = {}
    for item in chosen:
        polygons = outlines(item.geometry, item.shape.name)
        require(polygons, f"the {sketch.display_name(item.key)} covers nothing: it cannot become a polygon")
        shapes[item.key] = [replace(polygon, path=item.shape.path) for polygon in polygons]
    change = replace_obstacles(sketch, shapes, f"{Selection.of(*shapes).words(sketch)} turned into polygons")
    return replace(change, selection=change.selection.plus(selection.without_vertices()))


def made_boundary(sketch: Sketch, selection: Selection) -> Change:
    shapes = [sketch.item(key).shape for key in selection.items]
    if len(shapes) != 1 or not isinstance(shapes[0], PolygonObstacle):
        raise MapError("select one polygon: its outline becomes the boundary")
    after = replace(sketch.without(selection.items), boundary=shapes[0].vertices)
    return Change(after, Selection(boundary=True), f"{selection.words(sketch)} made the boundary")


def underlaid(sketch: Sketch, background: Background | None) -> Change:
    words = "picture laid under" if sketch.background is None else "picture changed"
    words = "picture taken away" if background is None else words
    return Change(replace(sketch, background=background), Selection(), words)
