"""Problems of a map, and messages in which objects have their names instead of paths in a file."""

import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

import shapely

from robocov_app.editor.model.selection import format_numbered_name
from robocov_app.editor.model.sketch import Owner, Sketch

ProblemKind: TypeAlias = Literal[
    "other",
    "no boundary",
    "crossing",
    "spot",
    "no room",
    "outside",
    "twice",
    "double",
    "sealed",
    "narrow",
    "cut off",
]
"""Kind of a problem, by which fixes are found: see `robocov_app.editor.edits.fixes`."""

_JSON_PATH = re.compile(r"\b(obstacles|starts|boundary|density)((?:\[\d+\]|\.\w+|\[\"[^\"]*\"\])+)")
_STEP = re.compile(r"\[(\d+)\]|\.(\w+)|\[\"([^\"]*)\"\]")
_NOUNS = {"vertices": "corner", "points": "point", "positions": "position", "holes": "hole", "areas": "area"}


@dataclass(frozen=True, eq=False)
class Problem:
    """An error or a warning about a map.

    Attributes
    ----------
    message : str
        A sentence for the user. Checks of single objects leave out the name: their messages begin
        with a colon or a blank.
    geometry : shapely.Geometry or None
        Where it is on the map, m; None where it is nowhere.
    owner : Owner or None
        Object that it concerns; None for the map as a whole.
    is_error : bool
        Whether the map cannot run because of it; otherwise it is a warning.
    kind : str
        Its kind.
    """

    message: str
    geometry: shapely.Geometry | None
    owner: Owner | None = None
    is_error: bool = True
    kind: ProblemKind = "other"


def format_position(x: float, y: float) -> str:
    """Format a position, m, for messages."""
    return f"({x:.5g}, {y:.5g})"


def translate_message(message: str, sketch: Sketch) -> str:
    """Return a message about a map file with names of objects instead of paths in the file."""

    def replace_path(match: re.Match[str]) -> str:
        return _translate_path(match, sketch)

    return _JSON_PATH.sub(replace_path, message.removeprefix("map: "))


def _translate_path(match: re.Match[str], sketch: Sketch) -> str:
    """Return a name such as "wall 3, point 2" for a path such as "obstacles[2].points[1]"."""
    section = match[1]
    words = [section]
    noun = "corner"
    steps: list[tuple[str, str, str]] = _STEP.findall(match[2])  # index, attribute or key
    if section == "obstacles":
        index = steps[0][0]
        if not index or int(index) >= len(sketch.obstacles):
            return match[0]
        steps.pop(0)
        words = [format_numbered_name(sketch, sketch.obstacles[int(index)].key)]
    elif section == "starts":
        words = [f"start “{''.join(steps.pop(0))}”"]
    for number, name, key in steps:
        if not number:
            noun = _NOUNS.get(name or key, name or key)
            words.append(noun)
        elif noun:
            numbered = f"{noun} {int(number) + 1}"
            if words[-1] == noun:
                words.pop()
            words.append(numbered)
            # A hole has numbered corners in its turn.
            is_hole = noun == "hole"
            noun = ""
            if is_hole:
                noun = "corner"
    return ", ".join(words)
