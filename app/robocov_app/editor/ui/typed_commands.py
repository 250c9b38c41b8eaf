"""Commands that the user types with a value, such as ``rotate 30``."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from robocov.errors import MapError
from robocov_app.editor.editor import Editor
from robocov_app.editor.edits import boolean, density, paths, properties, transform, vertices
from robocov_app.editor.model import require
from robocov_app.editor.model.coordinates import parse_angle, parse_length, parse_point, parse_size
from robocov_app.editor.ui import actions
from robocov_app.editor.ui.actions import Edit
from robocov_app.toolkit.commands.command import Argument, Command

MIN_SNAP_ANGLE_DEG = 0.1
MAX_SNAP_ANGLE_DEG = 90.0
TypedAction = Callable[[Editor, str], object]
_Number = TypeVar("_Number", int, float)


@dataclass(frozen=True)
class TypedCommand:
    """A command that takes a typed value.

    Attributes
    ----------
    word : str
        Name of the command.
    help : str
        Example of a value, and its meaning.
    action : callable
        Takes the editor and the typed value; raises MapError if the value is invalid.
    """

    word: str
    help: str
    action: TypedAction


def list_typed_commands(editor: Editor) -> list[Command]:
    """Return the typed commands for the command palette."""
    commands = []
    for typed in TYPED_COMMANDS.values():
        run = partial(_carry_out, editor, typed.word)
        takes = Argument(typed.help)
        commands.append(Command(typed.word, f"{typed.word} {typed.help}", "", run, argument=takes))
    return commands


def _carry_out(editor: Editor, word: str, value: str) -> None:
    editor.carry_out(lambda: run_typed_command(editor, word, value))


def run_typed_command(editor: Editor, word: str, value: str) -> None:
    """Run a typed command.

    Parameters
    ----------
    editor : Editor
        The editor.
    word : str
        Name of the command.
    value : str
        Value that the user typed.

    Raises
    ------
    MapError
        If the value is invalid, or the command cannot be carried out.
    """
    value = value.strip()
    require(value, f"{word}: expected a value, got nothing")
    TYPED_COMMANDS[word].action(editor, value)


def _parse_int(word: str, text: str) -> int:
    return _parse_number(word, text, int, "a whole number")


def _parse_float(word: str, text: str) -> float:
    return _parse_number(word, text, float, "a number")


def _parse_number(word: str, text: str, kind: type[_Number], expected: str) -> _Number:
    try:
        return kind(text)
    except ValueError:
        raise MapError(f"{word}: expected {expected}, got {text!r}") from None


def _set_angle(editor: Editor, text: str) -> None:
    angle = parse_angle(text)
    require(
        MIN_SNAP_ANGLE_DEG <= angle <= MAX_SNAP_ANGLE_DEG,
        f"angle: expected {MIN_SNAP_ANGLE_DEG:g}° to {MAX_SNAP_ANGLE_DEG:g}°, got {angle:g}°",
    )
    editor.snap_angle = angle
    editor.show_message(f"angles snap to multiples of {angle:g}°")


def _set_grid(editor: Editor, text: str) -> None:
    editor.set_length("grid", parse_length(text, now=editor.grid))


def _set_radius(editor: Editor, text: str) -> None:
    editor.set_length("radius", parse_length(text, now=editor.radius))


def _set_wall_width(editor: Editor, text: str) -> None:
    editor.set_length("wall_width", parse_length(text, now=editor.wall_width))


def _set_robots(editor: Editor, text: str) -> None:
    editor.set_robots(_parse_int("robots", text))


def _set_seed(editor: Editor, text: str) -> None:
    seed = _parse_int("seed", text)
    require(seed >= 0, f"seed: expected a whole number of at least 0, got {seed}")
    editor.seed = seed


def _apply_edit(edit: Edit, parse: Callable[[str], object]) -> TypedAction:
    """Build an action that parses a value, and applies an edit with this value to the selected objects."""

    def apply(editor: Editor, text: str) -> None:
        value = parse(text)
        editor.apply(edit(editor.sketch, actions.require_selection(editor), value))

    return apply


def _apply_common_length(edit: Edit, attribute: str) -> TypedAction:
    """Build an action that sets a length of the selected objects; the text may be relative, such as +0.1."""

    def apply(editor: Editor, text: str) -> None:
        length = parse_length(text, now=actions.find_common_length(editor, attribute))
        editor.apply(edit(editor.sketch, actions.require_selection(editor), length))

    return apply


def _resize(editor: Editor, text: str) -> None:
    width, height = parse_size(text)
    editor.apply(transform.resize(editor.sketch, actions.require_selection(editor), width, height))


def _move(editor: Editor, text: str) -> None:
    if text[0] not in "+@":
        text = f"@{text}"
    dx, dy = parse_point(text, last=(0.0, 0.0))
    selection = editor.selection or actions.require_selection(editor)
    editor.apply(actions.move(editor, dx, dy, selection))


def _place(editor: Editor, text: str) -> None:
    selection = actions.require_selection(editor)
    bounds = transform.compute_bounds(editor.sketch, selection)
    corner = None
    if bounds is not None:
        corner = bounds[:2]
    x, y = parse_point(text, last=corner)
    editor.apply(transform.place(editor.sketch, selection, x, y))


def _scale(editor: Editor, text: str) -> None:
    selection = actions.require_selection(editor)
    require(transform.compute_bounds(editor.sketch, selection), "there is nothing to scale")
    if not text.endswith("%"):
        text = f"*{text.lstrip('*x')}"
    factor = parse_length(text, now=1.0)
    editor.apply(transform.scale(editor.sketch, selection, factor, factor))


def _bevel(editor: Editor, text: str) -> None:
    actions.trim_corners(editor, vertices.bevel_corners, parse_length(text))


def _round(editor: Editor, text: str) -> None:
    actions.trim_corners(editor, vertices.round_corners, parse_length(text))


def _set_floor(editor: Editor, text: str) -> None:
    editor.apply(density.set_floor(editor.sketch, _parse_float("floor", text)))


def _set_weight(editor: Editor, text: str) -> None:
    editor.toolbox.density.enter_text(editor, text)


def _remove_density(editor: Editor, text: str) -> None:
    require(text == "none", f"density: expected none, got {text!r}; the tool Density draws hot spots")
    editor.apply(density.remove_density(editor.sketch))


def _parse_signed_length(text: str) -> float:
    sign = -1.0 if text.startswith("-") else 1.0
    return parse_length(text.lstrip("+-")) * sign


def _copy_to_grid(editor: Editor, text: str) -> None:
    parts = text.replace("x", " ").split()
    require(len(parts) == 4, "array: expected columns, rows and both distances, as in array 3 x 2 1.5 1.5")
    columns = _parse_int("array", parts[0])
    rows = _parse_int("array", parts[1])
    spacing = (_parse_signed_length(parts[2]), _parse_signed_length(parts[3]))
    selection = actions.require_selection(editor)
    editor.apply(transform.copy_to_grid(editor.sketch, selection, columns, rows, spacing))


def _set_title(editor: Editor, text: str) -> None:
    editor.apply(properties.set_title(editor.sketch, text))


_set_width = _apply_common_length(properties.set_width, "width")
_set_circle_radius = _apply_common_length(properties.set_radius, "radius")
_rotate = _apply_edit(transform.rotate, parse_angle)
_simplify = _apply_edit(vertices.simplify, parse_length)
_set_speed = _apply_edit(paths.set_speed, paths.parse_speed)
_offset = _apply_edit(boolean.offset, _parse_signed_length)
_set_note = _apply_edit(properties.set_note, str)

_ROWS = (
    TypedCommand("grid", "0.25: spacing of the grid", _set_grid),
    TypedCommand("angle", "15: lines snap to multiples of this angle", _set_angle),
    TypedCommand("radius", "0.2: radius of a robot", _set_radius),
    TypedCommand("robots", "8: number of robots", _set_robots),
    TypedCommand("seed", "3: seed of the team's positions", _set_seed),
    TypedCommand("wall", "0.1: width of walls that are drawn", _set_wall_width),
    TypedCommand("move", "1 0.5: displacement of the selection", _move),
    TypedCommand("place", "2 3: position of the lower left corner", _place),
    TypedCommand("rotate", "30: angle in degrees", _rotate),
    TypedCommand("scale", "150%: factor for the selection", _scale),
    TypedCommand("size", "3 x 2: width and height", _resize),
    TypedCommand("width", "0.2: width of walls", _set_width),
    TypedCommand("circle", "0.5: radius of circles", _set_circle_radius),
    TypedCommand("bevel", "0.3: cut corners off", _bevel),
    TypedCommand("round", "0.3: round corners", _round),
    TypedCommand("simplify", "0.05: remove vertices, to a tolerance", _simplify),
    TypedCommand("floor", "0.1: density away from hot spots", _set_floor),
    TypedCommand("weight", "2: weight of a hot spot", _set_weight),
    TypedCommand("density", "none: remove the density", _remove_density),
    TypedCommand("speed", "0.5: speed along a path, m/s", _set_speed),
    TypedCommand("offset", "0.2: grow, or shrink with -", _offset),
    TypedCommand("array", "3 x 2 1.5 1.5: columns, rows, distances", _copy_to_grid),
    TypedCommand("name", "pillar: name of the selection", actions.rename),
    TypedCommand("note", "text: note on the selection", _set_note),
    TypedCommand("title", "Hall: name of the map", _set_title),
)
TYPED_COMMANDS = {row.word: row for row in _ROWS}
"""The typed commands by name."""
