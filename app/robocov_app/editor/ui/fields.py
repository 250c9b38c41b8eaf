"""What the fields of the panel show, and what becomes of what is typed into them. Knows no pygame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from robocov.environment import CircleObstacle, DiscStart, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import properties, transform, vertices
from robocov_app.editor.edits.properties import underlaid
from robocov_app.editor.edits.transform import bounds_of
from robocov_app.editor.model.coordinates import angle_of, length_of, point_of
from robocov_app.editor.model.selection import place_of
from robocov_app.editor.ui.commands import run_typed, whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Point
    from robocov_app.editor.model.background import Background
    from robocov_app.editor.ui.editor import Editor


@dataclass(frozen=True)
class Field:
    """A field of the panel.

    `text`: returns what it shows. `take`: takes what was typed; raises a MapError where that means nothing.
    """

    text: Callable[[Editor], str]
    take: Callable[[Editor, str], object]
    tip: str = ""


def number(value: float) -> str:
    """Return a number as it stands in a field: to the tenth of a millimetre, without needless zeros.

    >>> number(2.0), number(0.30004), number(-0.00001)
    ('2', '0.3', '0')
    """
    text = f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def coordinate(text: str, now: float) -> float:
    """Return a typed coordinate, m: a number with a unit or without, or a step as ``+0.5``."""
    # two coordinates are read where only one is typed, so that signs and units mean the same
    return (
        point_of(f"{text.strip()} 0", last=(now, 0.0))[0]
        if not text.strip().startswith(("+", "@"))
        else (now + length_of(text.strip().lstrip("+@")))
    )


def _corner(editor: Editor) -> Point:
    """Return the place that the page shows: of a vertex, a centre, or a box's lower left corner."""
    sketch, selection = editor.preview
    if len(selection.vertices) == 1:
        (vertex,) = selection.vertices
        return place_of(sketch, vertex)
    center = _center(editor)
    if center is not None:
        return center
    bounds = bounds_of(sketch, whole(selection))
    if bounds is None:
        raise MapError("nothing is selected")
    return bounds[0], bounds[1]


def _center(editor: Editor) -> Point | None:
    sketch, selection = editor.preview
    if selection.vertices or len(selection.owners) != 1:
        return None
    (owner,) = selection.owners
    if isinstance(owner, str):
        spec = dict(sketch.starts).get(owner)
        return spec.center if isinstance(spec, DiscStart) else None
    if owner not in sketch.places:
        return None
    shape = sketch.item(owner).shape
    return shape.center if isinstance(shape, CircleObstacle) else None


def _put(editor: Editor, axis: int, text: str) -> None:
    """Put what is selected at a typed coordinate."""
    now = _corner(editor)
    by = coordinate(text, now[axis]) - now[axis]
    selection = editor.selection
    dx, dy = (by, 0.0) if axis == 0 else (0.0, by)
    act = vertices.moved if selection.vertices else transform.moved
    editor.change(act(editor.sketch, selection, dx, dy))


def _size(editor: Editor, axis: int) -> str:
    sketch, selection = editor.preview
    bounds = bounds_of(sketch, whole(selection))
    return "" if bounds is None else number(bounds[axis + 2] - bounds[axis])


def _resize(editor: Editor, axis: int, text: str) -> None:
    """Give what is selected a typed width or height; the other stays, but of circles."""
    selection = whole(editor.selection)
    bounds = bounds_of(editor.sketch, selection)
    if bounds is None:
        raise MapError("nothing is selected")
    now = bounds[2] - bounds[0], bounds[3] - bounds[1]
    to = length_of(text, now=now[axis])
    wide, high = (to, now[1]) if axis == 0 else (now[0], to)
    editor.change(transform.resized(editor.sketch, selection, wide or None, high or None))


def _shown_name(editor: Editor) -> str:
    owners = whole(editor.selection).owners
    if len(owners) != 1:
        return ""
    (owner,) = owners
    if isinstance(owner, str):
        return owner
    return editor.sketch.item(owner).shape.name or "" if owner in editor.sketch.places else ""


def _rename(editor: Editor, text: str) -> None:
    (owner,) = whole(editor.selection).owners
    if text.strip() != _shown_name(editor):
        editor.change(properties.renamed(editor.sketch, owner, text.strip()))


def _shown_note(editor: Editor) -> str:
    notes = {editor.sketch.item(key).note for key in editor.selection.items if key in editor.sketch.places}
    return notes.pop() if len(notes) == 1 else ""


def _note(editor: Editor, text: str) -> None:
    editor.change(properties.noted(editor.sketch, whole(editor.selection), text.strip()))


def _wall_width(editor: Editor) -> str:
    shapes = [editor.sketch.item(key).shape for key in editor.selection.items if key in editor.sketch.places]
    widths = {shape.width for shape in shapes if isinstance(shape, WallObstacle)}
    return number(widths.pop()) if len(widths) == 1 else ""


def _set_width(editor: Editor, text: str) -> None:
    now = _wall_width(editor)
    width = length_of(text, now=float(now) if now else None)
    editor.change(properties.widened(editor.sketch, whole(editor.selection), width))


def _radius(editor: Editor) -> str:
    sketch, selection = editor.preview
    for owner in selection.owners:
        if isinstance(owner, str):
            spec = dict(sketch.starts).get(owner)
            if isinstance(spec, DiscStart):
                return number(spec.radius)
        elif owner in sketch.places:
            shape = sketch.item(owner).shape
            if isinstance(shape, CircleObstacle):
                return number(shape.radius)
    return ""


def _set_radius(editor: Editor, text: str) -> None:
    now = _radius(editor)
    radius = length_of(text, now=float(now) if now else None)
    editor.change(properties.sized(editor.sketch, whole(editor.selection), radius))


def _picture(editor: Editor) -> Background:
    if editor.sketch.background is None:
        raise MapError("there is no picture under the map: Ctrl B takes one")
    return editor.sketch.background


def _set_scale(editor: Editor, text: str) -> None:
    laid = _picture(editor)
    scale = length_of(text, now=laid.scale)
    if not scale > 0.0:
        raise MapError("a pixel must be larger than 0 m")
    editor.change(underlaid(editor.sketch, replace(laid, scale=scale)))


def _set_turn(editor: Editor, text: str) -> None:
    editor.change(underlaid(editor.sketch, replace(_picture(editor), turn=angle_of(text))))


def _set_opacity(editor: Editor, text: str) -> None:
    laid = _picture(editor)
    part = min(max(float(text), 0.0), 1.0)
    editor.change(underlaid(editor.sketch, replace(laid, opacity=round(part, 2))), drag="opacity")


def _on_picture(editor: Editor, words: Callable[[Background], str]) -> str:
    return words(editor.sketch.background) if editor.sketch.background is not None else ""


def _or_empty(text: Callable[[Editor], str]) -> Callable[[Editor], str]:
    def shown(editor: Editor) -> str:
        try:
            return text(editor)
        except (MapError, LookupError):
            return ""

    return shown


FIELDS: dict[str, Field] = {
    "title": Field(
        lambda editor: editor.sketch.name,
        lambda editor, text: editor.change(properties.titled(editor.sketch, name=text.strip())),
        "The map's name, for people",
    ),
    "description": Field(
        lambda editor: editor.sketch.description,
        lambda editor, text: editor.change(properties.titled(editor.sketch, description=text.strip())),
        "A sentence about the map",
    ),
    "radius": Field(
        lambda editor: number(editor.radius),
        lambda editor, text: run_typed(editor, f"radius {text}"),
        "Radius of a robot: what is too narrow for it is hatched",
    ),
    "robots": Field(
        lambda editor: str(editor.robots),
        lambda editor, text: run_typed(editor, f"robots {text}"),
        "Robots of the team that is shown at a start, and tried with F5",
    ),
    "grid": Field(
        lambda editor: number(editor.grid),
        lambda editor, text: run_typed(editor, f"grid {text}"),
        "Distance of the grid's lines; arrows move by it",
    ),
    "angle": Field(
        lambda editor: number(editor.snap_angle),
        lambda editor, text: run_typed(editor, f"angle {text}"),
        "Lines snap to multiples of this",
    ),
    "name": Field(_or_empty(_shown_name), _rename, "What people call it"),
    "note": Field(_or_empty(_shown_note), _note, "Whatever is worth remembering of it"),
    "x": Field(
        _or_empty(lambda editor: number(_corner(editor)[0])),
        lambda editor, text: _put(editor, 0, text),
        "From the left; +0.5 moves by half a metre",
    ),
    "y": Field(
        _or_empty(lambda editor: number(_corner(editor)[1])),
        lambda editor, text: _put(editor, 1, text),
        "From below; +0.5 moves by half a metre",
    ),
    "wide": Field(
        _or_empty(lambda editor: _size(editor, 0)),
        lambda editor, text: _resize(editor, 0, text),
        "Also *2, 50% or +0.3",
    ),
    "high": Field(
        _or_empty(lambda editor: _size(editor, 1)),
        lambda editor, text: _resize(editor, 1, text),
        "Also *2, 50% or +0.3",
    ),
    "width": Field(_or_empty(_wall_width), _set_width, "How thick the wall is"),
    "size:radius": Field(_or_empty(_radius), _set_radius, "Its radius"),
    "picture:scale": Field(
        lambda editor: _on_picture(editor, lambda laid: f"{laid.scale:.6g}"), _set_scale, "Side of a pixel"
    ),
    "picture:turn": Field(
        lambda editor: _on_picture(editor, lambda laid: number(laid.turn)), _set_turn, "Counter-clockwise"
    ),
    "picture:opacity": Field(
        lambda editor: _on_picture(editor, lambda laid: number(laid.opacity)), _set_opacity, ""
    ),
}
"""All fields by name."""
