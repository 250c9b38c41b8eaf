"""Commands that are typed into the palette: ``rotate 30``, ``grid 0.25``, ``robots 8``. Knows no pygame."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov.errors import MapError, unknown_name
from robocov_app.editor.edits import boolean, motion_path, properties, transform, vertices
from robocov_app.editor.edits import density as density_edits
from robocov_app.editor.edits.transform import bounds_of
from robocov_app.editor.model.coordinates import angle_of, length_of, point_of, size_of
from robocov_app.editor.ui.deeds import bevel, round_corners, simplify_outlines, whole
from robocov_app.viewer.typed import parted

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov_app.editor.model.selection import Selection
    from robocov_app.editor.ui.desk import Desk

GHOST = "Type a command, or  rotate 30 · grid 0.25 · width 0.2 · size 3 x 2 · robots 8"


def command(desk: Desk, text: str) -> None:
    """Do what was typed.

    Raises
    ------
    MapError
        When that means nothing, or cannot be done.
    """
    word, rest = parted(text)
    if word not in COMMANDS:
        raise MapError(unknown_name("command", word, COMMANDS))
    if not rest:
        raise MapError(f"{word}: a value was wanted after it")
    COMMANDS[word](desk, rest)


def _selected(desk: Desk) -> Selection:
    selection = whole(desk.selection)
    if not selection:
        raise MapError("nothing is selected: click something first, or press Ctrl A")
    return selection


def _whole_number(word: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise MapError(f"{word}: {text!r}, but a whole number was wanted") from None


def _set_grid(desk: Desk, text: str) -> None:
    desk.set_grid(length_of(text, now=desk.grid))


def _set_angle(desk: Desk, text: str) -> None:
    angle = angle_of(text)
    if not 0.1 <= angle <= 90.0:
        raise MapError(f"angle: {angle:g}°, but 0.1° to 90° was wanted")
    desk.snap_angle = angle
    desk.say(f"angles snap to multiples of {angle:g}°")


def _set_radius(desk: Desk, text: str) -> None:
    desk.set_radius(length_of(text, now=desk.radius))


def _set_robots(desk: Desk, text: str) -> None:
    desk.set_robots(_whole_number("robots", text))


def _set_seed(desk: Desk, text: str) -> None:
    desk.seed = max(_whole_number("seed", text), 0)


def _set_wall(desk: Desk, text: str) -> None:
    desk.set_wall_width(length_of(text, now=desk.wall_width))


def _move(desk: Desk, text: str) -> None:
    text = text.strip()
    dx, dy = point_of(text if text[0] in "+@" else f"@{text}", last=(0.0, 0.0))
    selection = desk.selection
    if not selection:
        _selected(desk)
    act = vertices.moved if selection.vertices else transform.moved
    desk.change(act(desk.sketch, selection, dx, dy))


def _place(desk: Desk, text: str) -> None:
    selection = _selected(desk)
    bounds = bounds_of(desk.sketch, selection)
    x, y = point_of(text, last=bounds[:2] if bounds else None)
    desk.change(transform.placed(desk.sketch, selection, x, y))


def _rotate(desk: Desk, text: str) -> None:
    desk.change(transform.rotated(desk.sketch, _selected(desk), angle_of(text)))


def _scale(desk: Desk, text: str) -> None:
    selection = _selected(desk)
    bounds = bounds_of(desk.sketch, selection)
    if bounds is None:
        raise MapError("there is nothing to scale")
    factor = length_of(text if text.endswith("%") else f"*{text.lstrip('*x')}", now=1.0)
    desk.change(transform.scaled(desk.sketch, selection, factor))


def _size(desk: Desk, text: str) -> None:
    width, height = size_of(text)
    desk.change(transform.resized(desk.sketch, _selected(desk), width, height))


def _width(desk: Desk, text: str) -> None:
    desk.change(properties.widened(desk.sketch, _selected(desk), length_of(text)))


def _circle(desk: Desk, text: str) -> None:
    desk.change(properties.sized(desk.sketch, _selected(desk), length_of(text)))


def _name(desk: Desk, text: str) -> None:
    owners = sorted(whole(desk.selection).owners, key=str)
    if len(owners) != 1:
        raise MapError("select one obstacle or start first")
    desk.change(properties.renamed(desk.sketch, owners[0], text))


def _note(desk: Desk, text: str) -> None:
    desk.change(properties.noted(desk.sketch, _selected(desk), text))


def _title(desk: Desk, text: str) -> None:
    desk.change(properties.titled(desk.sketch, name=text))


def _offset(desk: Desk, text: str) -> None:
    sign = -1.0 if text.strip().startswith("-") else 1.0
    desk.change(boolean.offset(desk.sketch, _selected(desk), sign * length_of(text.strip().lstrip("+-"))))


def _set_floor(desk: Desk, text: str) -> None:
    desk.change(density_edits.floor_set(desk.sketch, _weight("floor", text)))


def _set_weight(desk: Desk, text: str) -> None:
    desk.tools["density"].enter(desk, text)


def _set_speed(desk: Desk, text: str) -> None:
    desk.change(motion_path.path_paced(desk.sketch, _selected(desk), motion_path.speed_of(text)))


def _set_density(desk: Desk, text: str) -> None:
    if text.strip() != "none":
        raise MapError(f"density: {text!r}, but none was wanted; hot spots are drawn with the tool Density")
    desk.change(density_edits.density_removed(desk.sketch))


def _weight(word: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise MapError(f"{word}: {text!r}, but a number was wanted") from None


def _array(desk: Desk, text: str) -> None:
    parts = text.replace("x", " ").split()
    if len(parts) != 4:
        raise MapError("array: columns, rows and both distances were wanted, as in array 3 x 2 1.5 1.5")
    columns, rows = (_whole_number("array", each) for each in parts[:2])
    dx, dy = (length_of(each.lstrip("-")) * (-1.0 if each.startswith("-") else 1.0) for each in parts[2:])
    desk.change(transform.arrayed(desk.sketch, _selected(desk), columns, rows, dx, dy))


VALUES: dict[str, str] = {
    "grid": "0.25: distance of the grid's lines",
    "angle": "15: lines snap to multiples of it",
    "radius": "0.2: of a robot",
    "robots": "8: of the team",
    "seed": "3: of the team's places",
    "wall": "0.1: width of walls that are drawn",
    "move": "1 0.5: what is selected",
    "place": "2 3: lower left corner",
    "rotate": "30: by degrees",
    "scale": "150%: what is selected",
    "size": "3 x 2: width and height",
    "width": "0.2: of walls",
    "circle": "0.5: radius of circles",
    "bevel": "0.3: cut corners off",
    "round": "0.3: round corners",
    "simplify": "0.05: leave vertices out, to a tolerance",
    "floor": "0.1: density away from hot spots",
    "weight": "2: of a hot spot",
    "density": "none: takes it away",
    "speed": "0.5: along a path, m/s",
    "offset": "0.2: grow, or shrink with -",
    "array": "3 x 2 1.5 1.5: columns, rows, distances",
    "name": "pillar: of what is selected",
    "note": "words: on what is selected",
    "title": "Hall: of the map",
}
"""What is typed after each command, and what it is, as the palette shows it."""

COMMANDS: dict[str, Callable[[Desk, str], None]] = {
    "grid": _set_grid,
    "angle": _set_angle,
    "radius": _set_radius,
    "robots": _set_robots,
    "seed": _set_seed,
    "wall": _set_wall,
    "move": _move,
    "place": _place,
    "rotate": _rotate,
    "scale": _scale,
    "size": _size,
    "width": _width,
    "circle": _circle,
    "bevel": lambda desk, text: bevel(desk, length_of(text)),
    "round": lambda desk, text: round_corners(desk, length_of(text)),
    "simplify": lambda desk, text: simplify_outlines(desk, length_of(text)),
    "floor": _set_floor,
    "weight": _set_weight,
    "density": _set_density,
    "speed": _set_speed,
    "offset": _offset,
    "array": _array,
    "name": _name,
    "note": _note,
    "title": _title,
}
"""What can be typed, each with a value after it."""
