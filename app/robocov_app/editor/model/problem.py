"""Problems of a map, and messages that name objects instead of paths in a file."""

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
"""Kind of a problem, which determines its fix; see `robocov_app.editor.edits.fixes`."""

_JSON_PATH = re.compile(r"\b(obstacles|starts|boundary|density)((?:\[\d+\]|\.\w+|\[\"[^\"]*\"\])+)")
_STEP = re.compile(r"\[(\d+)\]|\.(\w+)|\[\"([^\"]*)\"\]")
_NOUNS = {"vertices": "corner", "points": "point", "positions": "position", "holes": "hole", "areas": "area"}


@dataclass(frozen=True, eq=False)
class Problem:
    """An error or a warning about a map.

    Attributes
    ----------
    message : str
        Message for the user. If it begins with a colon or a blank, the name of the object must be put before
        it.
    geometry : shapely.Geometry or None
        Location of the problem on the map, m; None if it has no location.
    owner : Owner or None
        Object that has the problem; None for the whole map.
    is_error : bool
        True for an error, with which the map cannot be simulated; false for a warning.
    kind : str
        Kind of the problem; see `ProblemKind`.
    """

    message: str
    geometry: shapely.Geometry | None
    owner: Owner | None = None
    is_error: bool = True
    kind: ProblemKind = "other"


def format_position(x: float, y: float) -> str:
    """Format a position, m, for messages, for example "(1.5, 2)"."""
    return f"({x:.5g}, {y:.5g})"


def translate_message(message: str, sketch: Sketch) -> str:
    """Replace the JSON paths in a message about a map file by the names of objects."""

    def replace_path(match: re.Match[str]) -> str:
        return _translate_path(match, sketch)

    return _JSON_PATH.sub(replace_path, message.removeprefix("map: "))


def _translate_path(match: re.Match[str], sketch: Sketch) -> str:
    """Translate a matched path such as "obstacles[2].points[1]" to a name such as "wall 3, point 2"."""
    section = match[1]
    words = [section]
    noun = "corner"
    # Index, attribute and key of each step; two of the three are empty.
    steps: list[tuple[str, str, str]] = _STEP.findall(match[2])
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
            # A hole is followed by the number of its corner.
            is_hole = noun == "hole"
            noun = ""
            if is_hole:
                noun = "corner"
    return ", ".join(words)
