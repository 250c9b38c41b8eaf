"""Edits of whole things: drawn, moved, turned, scaled, mirrored, copied, deleted, named.

Each takes a sketch and what is selected, and returns the `Change`; it raises a MapError, a sentence for
people, where it cannot be done. Coordinates come out to the tenth of a millimetre. What is moved comes from
the selection's obstacles, starts and boundary, and its single vertices.

What draws is in `adding`, what moves in `placing`; all of it can be had from here.
"""

from __future__ import annotations

from dataclasses import replace

from robocov.environment import CircleObstacle, DiscStart, Obstacle, PolygonObstacle, StartSpec, WallObstacle
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
    if others:
        after = vertices.deleted(after, others).sketch
    return Change(after, Selection(), words)


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
    items = tuple(
        replace(item, note=note) if item.key in selection.items else item for item in sketch.obstacles
    )
    what = Selection(items=selection.items).words(sketch)
    words = f"note on {what}" if note else f"note on {what} taken away"
    return Change(replace(sketch, obstacles=items), selection, words)


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
    shapes: dict[int, Obstacle] = {}
    for key in selection.items:
        shape = sketch.item(key).shape
        if isinstance(shape, WallObstacle):
            shapes[key] = replace(shape, width=tenths(width))
    if not shapes:
        raise MapError("select walls first")
    words = f"{Selection.of(*shapes).words(sketch)} made {tenths(width):g} m wide"
    return Change(sketch.with_shapes(shapes), selection, words)


def sized(sketch: Sketch, selection: Selection, radius: float) -> Change:
    """Give the selected circles and discs that radius, m."""
    if not SMALLEST <= radius <= LARGEST:
        raise MapError(f"a radius of at least {1000 * SMALLEST:g} mm was wanted")
    shapes: dict[int, Obstacle] = {}
    for key in selection.items:
        shape = sketch.item(key).shape
        if isinstance(shape, CircleObstacle):
            shapes[key] = replace(shape, radius=tenths(radius))
    discs = [name for name in selection.starts if isinstance(sketch.start(name), DiscStart)]
    if not shapes and not discs:
        raise MapError("select circles first, or starts that are discs")
    after = sketch.with_shapes(shapes)
    for name in discs:
        spec = after.start(name)
        assert isinstance(spec, DiscStart)
        after = after.with_start(name, replace(spec, radius=tenths(radius)))
    what = Selection.of(*shapes, *discs).words(sketch)
    return Change(after, selection, f"{what} given a radius of {tenths(radius):g} m")


def raised(sketch: Sketch, selection: Selection, where: str) -> Change:
    """Change the order of the selected obstacles: to the "top", "up", "down", to the "bottom"."""
    if not selection.items:
        raise MapError("select obstacles first")
    chosen = [item for item in sketch.obstacles if item.key in selection.items]
    others = [item for item in sketch.obstacles if item.key not in selection.items]
    if where == "top":
        order = others + chosen
    elif where == "bottom":
        order = chosen + others
    elif where in ("up", "down"):
        order = list(sketch.obstacles) if where == "down" else list(reversed(sketch.obstacles))
        for k in range(1, len(order)):
            if order[k].key in selection.items and order[k - 1].key not in selection.items:
                order[k - 1], order[k] = order[k], order[k - 1]
        order = order if where == "down" else order[::-1]
    else:
        raise MapError("top, up, down or bottom was wanted")
    ways = {"top": "brought to the top", "up": "raised", "down": "lowered", "bottom": "sent to the bottom"}
    words = f"{Selection(items=selection.items).words(sketch)} {ways[where]}"
    return Change(replace(sketch, obstacles=tuple(order)), selection, words)


def start_first(sketch: Sketch, name: str) -> Change:
    """Make a start the map's default: the first."""
    if name not in dict(sketch.starts):
        raise MapError(f"there is no start “{one_line(name)}”")
    first = [pair for pair in sketch.starts if pair[0] == name]
    rest = [pair for pair in sketch.starts if pair[0] != name]
    after = replace(sketch, starts=(*first, *rest))
    return Change(after, Selection.of(name), f"start “{one_line(name)}” made the default")


def start_replaced(sketch: Sketch, name: str, spec: StartSpec) -> Change:
    """Give a start another kind or place."""
    if name not in dict(sketch.starts):
        raise MapError(f"there is no start “{one_line(name)}”")
    return Change(sketch.with_start(name, spec), Selection.of(name), f"start “{one_line(name)}” changed")


def made_polygons(sketch: Sketch, selection: Selection) -> Change:
    """Turn the selected circles and walls into polygons, whose vertices can be edited one by one."""
    chosen = {key for key in selection.items if not isinstance(sketch.item(key).shape, PolygonObstacle)}
    if not chosen:
        raise MapError("select circles or walls first")
    shapes = {
        key: tuple(
            replace(polygon, path=item.shape.path) for polygon in outlines(item.geometry, item.shape.name)
        )
        for key in chosen
        for item in (sketch.item(key),)
    }
    for key, polygons in shapes.items():
        if not polygons:
            raise MapError(f"the {display_name(sketch, key)} covers nothing: it cannot become a polygon")
    change = replace_obstacles(
        sketch, shapes, f"{Selection(items=frozenset(chosen)).words(sketch)} turned into polygons"
    )
    return replace(change, selection=change.selection.plus(replace(selection, vertices=frozenset())))


def made_boundary(sketch: Sketch, selection: Selection) -> Change:
    """Make the outline of the one selected polygon the boundary, in place of the obstacle."""
    shapes = [sketch.item(key).shape for key in selection.items]
    if len(shapes) != 1 or not isinstance(shapes[0], PolygonObstacle):
        raise MapError("select one polygon: its outline becomes the boundary")
    after = replace(sketch.without(selection.items), boundary=shapes[0].vertices)
    return Change(after, Selection(boundary=True), f"{selection.words(sketch)} made the boundary")


def underlaid(sketch: Sketch, background: Background | None) -> Change:
    """Put a picture under the map, change it, or take it away."""
    if background is None:
        words = "picture taken away"
    else:
        words = "picture laid under" if sketch.background is None else "picture changed"
    return Change(replace(sketch, background=background), Selection(), words)
