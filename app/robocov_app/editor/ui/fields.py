"""What the fields of the panel show, and what becomes of what is typed into them. Knows no pygame."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import UnionType
from typing import Any, NamedTuple

from robocov.environment import CircleObstacle, DiscStart, Point, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import properties, transform
from robocov_app.editor.edits.transform import bounds_of
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.coordinates import angle_of, length_of, point_of
from robocov_app.editor.model.selection import place_of
from robocov_app.editor.ui.commands import Edit, move, run_typed, whole
from robocov_app.editor.ui.editor import Editor


class Field(NamedTuple):
    """A field of the panel."""

    text: Callable[[Editor], str]  # what it shows
    take: Callable[[Editor, str], object]  # takes what was typed; MapError where that means nothing
    tip: str = ""

    def shown(self, editor: Editor) -> str:
        """Return what the field shows; nothing where there is no such value."""
        try:
            return self.text(editor)
        except (MapError, LookupError):
            return ""


def number(value: float) -> str:
    """Return a number as it stands in a field: to the tenth of a millimetre, without needless zeros.

    >>> number(2.0), number(0.30004), number(-0.00001)
    ('2', '0.3', '0')
    """
    text = f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def coordinate(text: str, now: float) -> float:
    """Return a typed coordinate, m: a number with a unit or without, or a step as ``+0.5``."""
    text = text.strip()
    if text.startswith(("+", "@")):
        return now + length_of(text.lstrip("+@"))
    # two coordinates are read where only one is typed, so that signs and units mean the same
    return point_of(f"{text} 0", last=(now, 0.0))[0]


def _selected_things(editor: Editor) -> list[Any]:
    """Return the shapes and starts that are selected, as they are shown."""
    sketch, selection = editor.preview
    shapes = [sketch.item(key).shape for key in selection.items if key in sketch.places]
    return [*shapes, *(spec for name, spec in sketch.starts if name in selection.starts)]


def _corner(editor: Editor) -> Point:
    """Return the place that the page shows: of a vertex, a centre, or a box's lower left corner."""
    sketch, selection = editor.preview
    if len(selection.vertices) == 1:
        return place_of(sketch, *selection.vertices)
    if not selection.vertices and len(selection.owners) == 1:
        for thing in _selected_things(editor):
            if isinstance(thing, CircleObstacle | DiscStart):
                return thing.center
    x, y, _, _ = _bounds(editor)
    return x, y


def _bounds(editor: Editor) -> tuple[float, float, float, float]:
    sketch, selection = editor.preview
    bounds = bounds_of(sketch, whole(selection))
    if bounds is None:
        raise MapError("nothing is selected")
    return bounds


def _put(editor: Editor, text: str, axis: int) -> None:
    now = _corner(editor)[axis]
    by = coordinate(text, now) - now
    dx, dy = (by, 0.0) if axis == 0 else (0.0, by)
    editor.change(move(editor, dx, dy, editor.selection))


def _size(editor: Editor, axis: int) -> str:
    bounds = _bounds(editor)
    return number(bounds[axis + 2] - bounds[axis])


def _resize(editor: Editor, text: str, axis: int) -> None:
    """Give what is selected a typed width or height; the other stays, but of circles."""
    low_x, low_y, high_x, high_y = _bounds(editor)
    sides = [high_x - low_x, high_y - low_y]
    sides[axis] = length_of(text, now=sides[axis])
    wide, high = (side or None for side in sides)
    editor.change(transform.resized(editor.sketch, whole(editor.selection), wide, high))


def _shown_name(editor: Editor) -> str:
    owners = whole(editor.selection).owners
    if len(owners) != 1:
        return ""
    (owner,) = owners
    return owner if isinstance(owner, str) else editor.sketch.item(owner).shape.name or ""


def _rename(editor: Editor, text: str) -> None:
    (owner,) = whole(editor.selection).owners
    if text.strip() != _shown_name(editor):
        editor.change(properties.renamed(editor.sketch, owner, text.strip()))


def _shown_note(editor: Editor) -> str:
    notes = {editor.sketch.item(key).note for key in editor.selection.items}
    return notes.pop() if len(notes) == 1 else ""


def _note(editor: Editor, text: str) -> None:
    editor.change(properties.noted(editor.sketch, whole(editor.selection), text.strip()))


def _measure(editor: Editor, name: str, kinds: UnionType | type) -> str:
    """Return the width or radius that all selected things of these kinds have."""
    found = {getattr(thing, name) for thing in _selected_things(editor) if isinstance(thing, kinds)}
    return number(found.pop()) if len(found) == 1 else ""


def _set_measure(editor: Editor, text: str, edit: Edit, now: Callable[[Editor], str]) -> None:
    length = length_of(text, now=float(now(editor)) if now(editor) else None)
    editor.change(edit(editor.sketch, whole(editor.selection), length))


def _picture(editor: Editor) -> Background:
    if editor.sketch.background is None:
        raise MapError("there is no picture under the map: Ctrl B takes one")
    return editor.sketch.background


def _set_scale(editor: Editor, text: str) -> None:
    scale = length_of(text, now=_picture(editor).scale)
    if not scale > 0.0:
        raise MapError("a pixel must be larger than 0 m")
    _lay(editor, scale=scale)


def _set_opacity(editor: Editor, text: str) -> None:
    part = min(max(float(text), 0.0), 1.0)
    _lay(editor, drag="opacity", opacity=round(part, 2))


def _lay(editor: Editor, drag: str | None = None, **changes: float) -> None:
    laid = replace(_picture(editor), **changes)  # type: ignore[arg-type]
    editor.change(properties.underlaid(editor.sketch, laid), drag=drag)


def _typed(text: Callable[[Editor], str], word: str, tip: str) -> Field:
    """Return a field that takes what can also be typed after a command."""
    return Field(text, lambda editor, given: run_typed(editor, word, given), tip)


def _titled(name: str, tip: str) -> Field:
    def take(editor: Editor, text: str) -> None:
        editor.change(properties.titled(editor.sketch, **{name: text.strip()}))

    return Field(lambda editor: str(getattr(editor.sketch, name)), take, tip)


_wall_width = partial(_measure, name="width", kinds=WallObstacle)
_radius = partial(_measure, name="radius", kinds=CircleObstacle | DiscStart)
_set_width = partial(_set_measure, edit=properties.widened, now=_wall_width)
_set_radius = partial(_set_measure, edit=properties.sized, now=_radius)
_MOVES = "{}; +0.5 moves by half a metre"

FIELDS: dict[str, Field] = {
    "title": _titled("name", "The map's name, for people"),
    "description": _titled("description", "A sentence about the map"),
    "radius": _typed(
        lambda editor: number(editor.radius),
        "radius",
        "Radius of a robot: what is too narrow for it is hatched",
    ),
    "robots": _typed(
        lambda editor: str(editor.robots),
        "robots",
        "Robots of the team that is shown at a start, and tried with F5",
    ),
    "grid": _typed(
        lambda editor: number(editor.grid), "grid", "Distance of the grid's lines; arrows move by it"
    ),
    "angle": _typed(lambda editor: number(editor.snap_angle), "angle", "Lines snap to multiples of this"),
    "name": Field(_shown_name, _rename, "What people call it"),
    "note": Field(_shown_note, _note, "Whatever is worth remembering of it"),
    "x": Field(
        lambda editor: number(_corner(editor)[0]), partial(_put, axis=0), _MOVES.format("From the left")
    ),
    "y": Field(lambda editor: number(_corner(editor)[1]), partial(_put, axis=1), _MOVES.format("From below")),
    "wide": Field(partial(_size, axis=0), partial(_resize, axis=0), "Also *2, 50% or +0.3"),
    "high": Field(partial(_size, axis=1), partial(_resize, axis=1), "Also *2, 50% or +0.3"),
    "width": Field(_wall_width, _set_width, "How thick the wall is"),
    "size:radius": Field(_radius, _set_radius, "Its radius"),
    "picture:scale": Field(lambda editor: f"{_picture(editor).scale:.6g}", _set_scale, "Side of a pixel"),
    "picture:turn": Field(
        lambda editor: number(_picture(editor).turn),
        lambda editor, text: _lay(editor, turn=angle_of(text)),
        "Counter-clockwise",
    ),
    "picture:opacity": Field(lambda editor: number(_picture(editor).opacity), _set_opacity),
}
"""All fields by name."""
