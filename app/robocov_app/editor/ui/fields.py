"""Fields of the panel: which value each field shows, and how it applies a typed value."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from robocov.environment import CircleObstacle, DiscStart
from robocov_app.editor.editor import Editor
from robocov_app.editor.edits import properties, transform
from robocov_app.editor.model import require
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.coordinates import parse_angle, parse_length, parse_point
from robocov_app.editor.model.selection import find_position
from robocov_app.editor.settings import SETTING_ATTRIBUTES
from robocov_app.editor.ui import actions
from robocov_app.editor.ui.typed_commands import TYPED_COMMANDS, run_typed_command

DECIMALS = 4  # decimal places of numbers in fields: tenths of a millimeter


@dataclass(frozen=True)
class PanelField:
    """A field of the panel.

    Attributes
    ----------
    read : callable
        Takes the editor, and returns the text to show. Raises MapError or LookupError if there is no value.
    write : callable
        Takes the editor and the typed text, and applies it. Raises MapError if the text is invalid.
    tip : str
        Tooltip.
    """

    read: Callable[[Editor], str]
    write: Callable[[Editor, str], object]
    tip: str


@dataclass(frozen=True)
class _Frame:
    """Position of the selection and size of its bounding box, m."""

    x: float
    y: float
    width: float
    height: float


def format_number(value: float | None) -> str:
    """Format a number for a field, without trailing zeros; None becomes an empty text."""
    if value is None:
        return ""
    return f"{round(value, DECIMALS) + 0.0:.12g}"


def _compute_frame(editor: Editor) -> _Frame:
    """Return the position of the selection and the size of its bounding box.

    The position is that of a single vertex, the center of a single circle or disc, or else the lower left
    corner of the box.
    """
    sketch, selection = editor.displayed
    bounds = transform.compute_bounds(sketch, actions.select_owners(selection))
    x, y, high_x, high_y = require(bounds, "nothing is selected")
    width = high_x - x
    height = high_y - y
    if len(selection.vertices) == 1:
        (vertex,) = selection.vertices
        x, y = find_position(sketch, vertex)
    elif not selection.vertices and len(selection.owners) == 1:
        (owner,) = selection.owners
        shape = sketch.get_shape(owner)
        if isinstance(shape, CircleObstacle | DiscStart):
            x, y = shape.center
    return _Frame(x, y, width, height)


def _read_x(editor: Editor) -> str:
    return format_number(_compute_frame(editor).x)


def _read_y(editor: Editor) -> str:
    return format_number(_compute_frame(editor).y)


def _read_width(editor: Editor) -> str:
    return format_number(_compute_frame(editor).width)


def _read_height(editor: Editor) -> str:
    return format_number(_compute_frame(editor).height)


def _write_x(editor: Editor, text: str) -> None:
    step = _parse_step(text, _compute_frame(editor).x)
    editor.apply(actions.move(editor, step, 0.0, editor.selection))


def _write_y(editor: Editor, text: str) -> None:
    step = _parse_step(text, _compute_frame(editor).y)
    editor.apply(actions.move(editor, 0.0, step, editor.selection))


def _parse_step(text: str, current: float) -> float:
    """Return the step, m, to a typed coordinate from the current one; ``+0.5`` is the step itself."""
    text = text.strip()
    if text.startswith(("+", "@")):
        return parse_length(text.lstrip("+@"))
    # The coordinate is parsed as that of a point, so that signs and units have the same meaning as elsewhere.
    x, _ = parse_point(f"{text} 0", last=(current, 0.0))
    return x - current


def _write_width(editor: Editor, text: str) -> None:
    frame = _compute_frame(editor)
    _resize(editor, parse_length(text, now=frame.width), frame.height or None)


def _write_height(editor: Editor, text: str) -> None:
    frame = _compute_frame(editor)
    _resize(editor, frame.width or None, parse_length(text, now=frame.height))


def _resize(editor: Editor, width: float | None, height: float | None) -> None:
    """Resize the selection; None for the width or height of a selection that has none."""
    selection = actions.select_owners(editor.selection)
    editor.apply(transform.resize(editor.sketch, selection, width, height))


def _read_name(editor: Editor) -> str:
    (owner,) = actions.select_owners(editor.selection).owners
    if isinstance(owner, str):
        return owner
    return editor.sketch.get_item(owner).shape.name or ""


def _read_note(editor: Editor) -> str:
    notes = {editor.sketch.get_item(key).note for key in editor.selection.items}
    if len(notes) != 1:
        return ""
    return notes.pop()


def _read_title(editor: Editor) -> str:
    return editor.sketch.name


def _write_title(editor: Editor, text: str) -> None:
    editor.apply(properties.set_title(editor.sketch, text.strip()))


def _read_description(editor: Editor) -> str:
    return editor.sketch.description


def _write_description(editor: Editor, text: str) -> None:
    editor.apply(properties.set_description(editor.sketch, text.strip()))


def _require_background(editor: Editor) -> Background:
    return require(editor.sketch.background, "there is no background image: Ctrl+B chooses one")


def _read_background_scale(editor: Editor) -> str:
    return f"{_require_background(editor).scale:.6g}"


def _write_background_scale(editor: Editor, text: str) -> None:
    background = _require_background(editor)
    scale = parse_length(text, now=background.scale)
    require(scale > 0.0, "a pixel must be larger than 0 m")
    editor.apply(properties.set_background(editor.sketch, replace(background, scale=scale)))


def _read_background_rotation(editor: Editor) -> str:
    return format_number(_require_background(editor).rotation_deg)


def _write_background_rotation(editor: Editor, text: str) -> None:
    degrees = parse_angle(text)
    background = replace(_require_background(editor), rotation_deg=degrees)
    editor.apply(properties.set_background(editor.sketch, background))


def set_background_opacity(editor: Editor, opacity: float) -> None:
    """Set the opacity of the background image, from 0 to 1."""
    background = replace(_require_background(editor), opacity=opacity)
    editor.apply(properties.set_background(editor.sketch, background), drag="opacity")


def _build_setting_field(word: str, tip: str) -> PanelField:
    """Build the field of a setting that is also a typed command."""

    def read(editor: Editor) -> str:
        return format_number(getattr(editor, SETTING_ATTRIBUTES[word]))

    def write(editor: Editor, text: str) -> None:
        run_typed_command(editor, word, text)

    return PanelField(read, write, tip)


def _build_length_field(attribute: str, word: str, tip: str) -> PanelField:
    """Build the field of a length that the selected objects have in common."""

    def read(editor: Editor) -> str:
        return format_number(actions.find_common_length(editor, attribute))

    return PanelField(read, TYPED_COMMANDS[word].action, tip)


FIELDS: dict[str, PanelField] = {
    "title": PanelField(_read_title, _write_title, "The map's name"),
    "description": PanelField(_read_description, _write_description, "A sentence about the map"),
    "radius": _build_setting_field("radius", "Radius of a robot: passages too narrow for it are hatched"),
    "robots": _build_setting_field(
        "robots", "Robots of the team that is shown at a start, and tried with F5"
    ),
    "grid": _build_setting_field("grid", "Spacing of the grid; arrows move by it"),
    "angle": _build_setting_field("angle", "Lines snap to multiples of this"),
    "name": PanelField(_read_name, actions.rename, "Name of the selected object"),
    "note": PanelField(_read_note, TYPED_COMMANDS["note"].action, "Note on the selected obstacles"),
    "x": PanelField(_read_x, _write_x, "x coordinate; +0.5 moves by half a meter"),
    "y": PanelField(_read_y, _write_y, "y coordinate; +0.5 moves by half a meter"),
    "wide": PanelField(_read_width, _write_width, "Also *2, 50% or +0.3"),
    "high": PanelField(_read_height, _write_height, "Also *2, 50% or +0.3"),
    "width": _build_length_field("width", "width", "Thickness of the wall"),
    "size:radius": _build_length_field("radius", "circle", "Its radius"),
    "background:scale": PanelField(_read_background_scale, _write_background_scale, "Side of a pixel"),
    "background:turn": PanelField(_read_background_rotation, _write_background_rotation, "Counter-clockwise"),
}
"""The fields of the panel by name."""
