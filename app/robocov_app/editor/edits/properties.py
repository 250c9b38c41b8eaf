"""Edits of properties: delete, rename, annotate, resize, restack, group, lock, hide or convert objects."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from typing import Any, Literal

from robocov.environment import CircleObstacle, DiscStart, Obstacle, PolygonObstacle, WallObstacle
from robocov.errors import MapError, to_one_line
from robocov_app.editor.edits import create, vertices
from robocov_app.editor.model import require
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.geometry import extract_polygons, require_size, round_length
from robocov_app.editor.model.selection import Change, Selection, format_numbered_name, replace_obstacles
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch


def delete(sketch: Sketch, selection: Selection) -> Change:
    """Delete the selected objects and vertices."""
    require(selection, "select something first")
    changed = sketch.without(selection.items | selection.starts)
    if selection.boundary:
        changed = replace(changed, boundary=None)
    remaining = Selection(vertices=selection.vertices).restrict_to(changed)
    if remaining:
        changed = vertices.delete_vertices(changed, remaining).sketch
    return Change(changed, Selection(), f"{selection.describe(sketch)} deleted")


def rename(sketch: Sketch, owner: Owner, name: str) -> Change:
    """Rename an obstacle or a start; an empty name removes the name of an obstacle."""
    name = create.clean_label(name)
    require(owner != BOUNDARY, "the boundary has no name; the map has one")
    if isinstance(owner, str):
        return _rename_start(sketch, owner, name)
    previous = sketch.display_name(owner)
    description = f"{previous}: name removed"
    if name:
        description = f"{previous} renamed to “{name}”"
    shape = replace(sketch.get_item(owner).shape, name=name or None)
    return Change(sketch.with_objects({owner: shape}), Selection.of(owner), description)


def _rename_start(sketch: Sketch, previous: str, name: str) -> Change:
    require(name, "a start needs a name")
    is_free = name == previous or name not in dict(sketch.starts)
    require(is_free, f"a start named “{name}” already exists")
    new_names = {previous: name}
    starts = tuple((new_names.get(key, key), start) for key, start in sketch.starts)
    description = f"{sketch.display_name(previous)} renamed to “{name}”"
    return Change(replace(sketch, starts=starts), Selection.of(name), description)


def set_note(sketch: Sketch, selection: Selection, note: str) -> Change:
    """Set the note of the selected obstacles; an empty note removes it."""
    require(selection.items, "select the obstacles to annotate first")
    note = create.clean_text(note, "a note")
    obstacles = Selection(items=selection.items).describe(sketch)
    description = f"note on {obstacles}"
    if not note:
        description = f"note on {obstacles} removed"
    return replace(_set_fields(sketch, selection, "", note=note), description=description)


def group(sketch: Sketch, selection: Selection, name: str = "") -> Change:
    """Put the selected obstacles into a group with the given name, by default a new name."""
    require(len(selection.items) >= 2, "select two or more obstacles to group")
    name = create.clean_label(name) or _find_free_group(sketch)
    return _set_fields(sketch, selection, f"grouped as “{name}”", group=name)


def _find_free_group(sketch: Sketch) -> str:
    taken = {item.group for item in sketch.obstacles}
    return next(name for k in count(1) if (name := f"group {k}") not in taken)


def ungroup(sketch: Sketch, selection: Selection) -> Change:
    """Take the selected obstacles out of their groups."""
    keys = [key for key in selection.items if sketch.get_item(key).group]
    require(keys, "select obstacles that are in a group")
    return _set_fields(sketch, Selection.of(*keys), "ungrouped", group="")


def lock(sketch: Sketch, selection: Selection) -> Change:
    """Lock and deselect the selected obstacles, so that the mouse cannot select them."""
    change = _set_fields(sketch, selection, "locked", locked=True)
    return replace(change, selection=replace(selection, items=frozenset()))


def hide(sketch: Sketch, selection: Selection) -> Change:
    """Hide and deselect the selected obstacles; they stay part of the map."""
    change = _set_fields(sketch, selection, "hidden", hidden=True)
    return replace(change, selection=replace(selection, items=frozenset()))


def unlock_and_show_all(sketch: Sketch) -> Change:
    """Unlock and show all obstacles; those that were locked or hidden are selected."""
    keys = [item.key for item in sketch.obstacles if not item.is_selectable]
    require(keys, "nothing is locked or hidden")
    return _set_fields(sketch, Selection.of(*keys), "unlocked and shown", locked=False, hidden=False)


def _set_fields(sketch: Sketch, selection: Selection, action: str, **fields: Any) -> Change:
    """Set fields of the selected obstacles, given by name; `action` ends the description of the change."""
    require(selection.items, "select obstacles first")
    items = [replace(item, **fields) for item in selection.list_items(sketch)]
    description = f"{Selection(items=selection.items).describe(sketch)} {action}"
    return Change(sketch.with_items(items), selection, description)


def set_title(sketch: Sketch, name: str) -> Change:
    """Rename the map."""
    name = create.clean_label(name)
    require(name, "a map needs a name")
    return Change(replace(sketch, name=name), Selection(), f"map named “{name}”")


def set_description(sketch: Sketch, description: str) -> Change:
    """Set the description of the map."""
    description = create.clean_text(description, "a description")
    return Change(replace(sketch, description=description), Selection(), "description changed")


def set_width(sketch: Sketch, selection: Selection, width: float) -> Change:
    """Set the width of the selected walls, m."""
    width = _round_size("width", width)
    walls: dict[Owner, Any] = {}
    for owner in selection.owners:
        shape = sketch.get_shape(owner)
        if isinstance(shape, WallObstacle):
            walls[owner] = replace(shape, width=width)
    require(walls, "select walls first")
    description = f"{Selection.of(*walls).describe(sketch)} made {width:g} m wide"
    return Change(sketch.with_objects(walls), selection, description)


def set_radius(sketch: Sketch, selection: Selection, radius: float) -> Change:
    """Set the radius of the selected circles and disc-shaped starts, m."""
    radius = _round_size("radius", radius)
    circles: dict[Owner, Any] = {}
    for owner in selection.owners:
        shape = sketch.get_shape(owner)
        if isinstance(shape, CircleObstacle | DiscStart):
            circles[owner] = replace(shape, radius=radius)
    require(circles, "select circles first, or starts that are discs")
    description = f"{Selection.of(*circles).describe(sketch)} given a radius of {radius:g} m"
    return Change(sketch.with_objects(circles), selection, description)


def _round_size(name: str, size: float) -> float:
    """Return a size rounded to tenths of a millimeter, m; raise MapError if it is out of range."""
    require_size(name, size)
    return round_length(size)


def restack(sketch: Sketch, selection: Selection, end: Literal["top", "bottom"]) -> Change:
    """Bring the selected obstacles to the top, or send them to the bottom."""
    require(selection.items, "select obstacles first")
    require(end in ("top", "bottom"), "expected top or bottom")
    selected = tuple(item for item in sketch.obstacles if item.key in selection.items)
    others = tuple(item for item in sketch.obstacles if item.key not in selection.items)
    order = selected + others
    action = "sent to the bottom"
    if end == "top":
        order = others + selected
        action = "brought to the top"
    description = f"{Selection(items=selection.items).describe(sketch)} {action}"
    return Change(replace(sketch, obstacles=order), selection, description)


def make_default_start(sketch: Sketch, name: str) -> Change:
    """Make a start the default by moving it to the first position."""
    require(name in dict(sketch.starts), f"there is no start “{to_one_line(name)}”")
    # False sorts before True, and the others keep their order.
    starts = tuple(sorted(sketch.starts, key=lambda pair: pair[0] != name))
    description = f"start “{to_one_line(name)}” made the default"
    return Change(replace(sketch, starts=starts), Selection.of(name), description)


def convert_to_polygons(sketch: Sketch, selection: Selection) -> Change:
    """Turn the selected circles and walls into polygons."""
    shapes: dict[int, Sequence[Obstacle]] = {}
    for item in selection.list_items(sketch):
        if isinstance(item.shape, PolygonObstacle):
            continue
        polygons = extract_polygons(item.geometry, item.shape)
        name = format_numbered_name(sketch, item.key)
        require(polygons, f"{name} has no area and cannot become a polygon")
        shapes[item.key] = polygons
    require(shapes, "select circles or walls first")
    description = f"{Selection.of(*shapes).describe(sketch)} turned into polygons"
    change = replace_obstacles(sketch, shapes, description)
    return replace(change, selection=change.selection.union(selection.without_vertices()))


def convert_to_boundary(sketch: Sketch, selection: Selection) -> Change:
    """Make the outline of the selected polygon the boundary; the polygon is removed."""
    shapes = [sketch.get_item(key).shape for key in selection.items]
    if len(shapes) != 1 or not isinstance(shapes[0], PolygonObstacle):
        raise MapError("select one polygon: its outline becomes the boundary")
    changed = replace(sketch.without(selection.items), boundary=shapes[0].vertices)
    return Change(changed, Selection(boundary=True), f"{selection.describe(sketch)} made the boundary")


def set_background(sketch: Sketch, background: Background | None) -> Change:
    """Set the background image, or remove it if None is given."""
    if background is None:
        description = "background image removed"
    elif sketch.background is None:
        description = "background image added"
    else:
        description = "background image changed"
    return Change(replace(sketch, background=background), Selection(), description)
