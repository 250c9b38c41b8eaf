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
from robocov_app.editor.model.geometry import extract_polygons, round_length
from robocov_app.editor.model.selection import Change, Selection, replace_obstacles
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch


def delete(sketch: Sketch, selection: Selection) -> Change:
    require(selection, "select something first")
    after = sketch.without(selection.items | selection.starts)
    after = replace(after, boundary=None if selection.boundary else sketch.boundary)
    others = Selection(vertices=selection.vertices).restrict_to(after)
    after = vertices.delete_vertices(after, others).sketch if others else after
    return Change(after, Selection(), f"{selection.describe(sketch)} deleted")


def rename(sketch: Sketch, owner: Owner, name: str) -> Change:
    """Name an obstacle or a start; an empty name takes an obstacle's name away."""
    name = create.clean_label(name)
    words = f"{sketch.display_name(owner)} renamed to “{name}”"
    require(owner != BOUNDARY, "the boundary has no name; the map has one")
    if isinstance(owner, str):
        require(name, "a start needs a name")
        require(name == owner or name not in dict(sketch.starts), f"there is a start “{name}” already")
        starts = tuple((name if each == owner else each, spec) for each, spec in sketch.starts)
        return Change(replace(sketch, starts=starts), Selection.of(name), words)
    words = words if name else f"{sketch.display_name(owner)}: name taken away"
    after = sketch.with_objects({owner: replace(sketch.get_item(owner).shape, name=name or None)})
    return Change(after, Selection.of(owner), words)


def set_note(sketch: Sketch, selection: Selection, note: str) -> Change:
    require(selection.items, "select obstacles first: notes are written to them")
    note = create.clean_text(note, "a note")
    words = f"note on {Selection(items=selection.items).describe(sketch)}{'' if note else ' taken away'}"
    return replace(_marked(sketch, selection, "", note=note), description=words)


def group(sketch: Sketch, selection: Selection, name: str = "") -> Change:
    """Put the selected obstacles into a group, a new one without a name: a click selects all of it."""
    require(len(selection.items) >= 2, "select two or more obstacles to group")
    taken = {item.group for item in sketch.obstacles}
    name = create.clean_label(name) or next(each for k in count(1) if (each := f"group {k}") not in taken)
    return _marked(sketch, selection, f"grouped as “{name}”", group=name)


def ungroup(sketch: Sketch, selection: Selection) -> Change:
    keys = [key for key in selection.items if sketch.get_item(key).group]
    require(keys, "select obstacles that are in a group")
    return _marked(sketch, Selection.of(*keys), "ungrouped", group="")


def release(sketch: Sketch) -> Change:
    """Unlock and show all obstacles; those that were locked or hidden are selected then."""
    keys = [item.key for item in sketch.obstacles if not item.is_selectable]
    require(keys, "nothing is locked or hidden")
    return _marked(sketch, Selection.of(*keys), "unlocked and shown", locked=False, hidden=False)


def _marked(sketch: Sketch, selection: Selection, words: str, **marks: Any) -> Change:
    require(selection.items, "select obstacles first")
    items = tuple(replace(i, **marks) if i.key in selection.items else i for i in sketch.obstacles)
    words = f"{Selection(items=selection.items).describe(sketch)} {words}"
    left = replace(selection, items=frozenset()) if True in marks.values() else selection
    return Change(replace(sketch, obstacles=items), left, words)


lock = partial(_marked, words="locked", locked=True)  # the mouse cannot take them
hide = partial(_marked, words="hidden", hidden=True)  # in the editor; robots meet them all the same


def set_title(sketch: Sketch, name: str) -> Change:
    """Rename the map."""
    name = create.clean_label(name)
    require(name, "a map needs a name")
    return Change(replace(sketch, name=name), Selection(), f"map named “{name}”")


def set_description(sketch: Sketch, description: str) -> Change:
    """Describe the map."""
    description = create.clean_text(description, "a description")
    return Change(replace(sketch, description=description), Selection(), "map described")


def set_width(sketch: Sketch, selection: Selection, width: float) -> Change:
    return _sized(sketch, selection, "width", width, "select walls first", "made {:g} m wide")


def set_radius(sketch: Sketch, selection: Selection, radius: float) -> Change:
    missing = "select circles first, or starts that are discs"
    return _sized(sketch, selection, "radius", radius, missing, "given a radius of {:g} m")


def _sized(sketch: Sketch, selection: Selection, name: str, size: float, missing: str, words: str) -> Change:
    require(MIN_SIZE_M <= size <= MAX_SIZE_M, f"expected a {name} of at least {1000 * MIN_SIZE_M:g} mm")
    things: dict[Owner, Any] = {owner: sketch.find_object(owner) for owner in selection.owners}
    sized = {owner: thing for owner, thing in things.items() if hasattr(thing, name)}
    require(sized, missing)
    after = sketch.with_objects(
        {o: replace(thing, **{name: round_length(size)}) for o, thing in sized.items()}
    )
    return Change(
        after, selection, f"{Selection.of(*sized).describe(sketch)} {words.format(round_length(size))}"
    )


def restack(sketch: Sketch, selection: Selection, where: str) -> Change:
    require(selection.items, "select obstacles first")
    require(where in ("top", "bottom"), "expected top or bottom")
    upper = selection.items if where == "top" else sketch.index_by_key.keys() - selection.items
    order = tuple(sorted(sketch.obstacles, key=lambda item: item.key in upper))
    way = "brought to the top" if where == "top" else "sent to the bottom"
    words = f"{Selection(items=selection.items).describe(sketch)} {way}"
    return Change(replace(sketch, obstacles=order), selection, words)


def make_default_start(sketch: Sketch, name: str) -> Change:
    require(name in dict(sketch.starts), f"there is no start “{to_one_line(name)}”")
    starts = tuple(sorted(sketch.starts, key=lambda pair: pair[0] != name))
    words = f"start “{to_one_line(name)}” made the default"
    return Change(replace(sketch, starts=starts), Selection.of(name), words)


def convert_to_polygons(sketch: Sketch, selection: Selection) -> Change:
    chosen = [item for item in selection.list_items(sketch) if not isinstance(item.shape, PolygonObstacle)]
    require(chosen, "select circles or walls first")
    shapes = {}
    for item in chosen:
        polygons = extract_polygons(item.geometry, item.shape.name)
        require(polygons, f"the {sketch.display_name(item.key)} covers nothing: it cannot become a polygon")
        shapes[item.key] = [replace(polygon, path=item.shape.path) for polygon in polygons]
    change = replace_obstacles(
        sketch, shapes, f"{Selection.of(*shapes).describe(sketch)} turned into polygons"
    )
    return replace(change, selection=change.selection.union(selection.without_vertices()))


def convert_to_boundary(sketch: Sketch, selection: Selection) -> Change:
    shapes = [sketch.get_item(key).shape for key in selection.items]
    if len(shapes) != 1 or not isinstance(shapes[0], PolygonObstacle):
        raise MapError("select one polygon: its outline becomes the boundary")
    after = replace(sketch.without(selection.items), boundary=shapes[0].vertices)
    return Change(after, Selection(boundary=True), f"{selection.describe(sketch)} made the boundary")


def set_background(sketch: Sketch, background: Background | None) -> Change:
    words = "picture laid under" if sketch.background is None else "picture changed"
    words = "picture taken away" if background is None else words
    return Change(replace(sketch, background=background), Selection(), words)
