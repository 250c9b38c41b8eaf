"""Problems of a map, and messages that name objects instead of paths in a file."""

import re
from dataclasses import dataclass
from typing import Literal, NamedTuple, TypeAlias

import shapely

from robocov_app.editor.model.selection import format_numbered_name
from robocov_app.editor.model.sketch import Owner, Sketch

ProblemKind: TypeAlias = Literal[
    "other",
    "no boundary",
    "crossing",
    "spot",
    "no space",
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


class _PathStep(NamedTuple):
    """A step of a JSON path: a number, an attribute or a key; the other two are empty."""

    number: str
    attribute: str
    key: str


@dataclass(frozen=True, eq=False)
class Problem:
    """An error or a warning about a map.

    Attributes
    ----------
    message : str
        Message for the user.
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
    """Format a position, m, to the millimeter for messages, for example "(1.5, 2)"."""
    # Adding 0.0 turns -0.0 into 0.0.
    return f"({round(x, 3) + 0.0:.10g}, {round(y, 3) + 0.0:.10g})"


def translate_message(message: str, sketch: Sketch) -> str:
    """Replace the JSON paths in a message about a map file by the names of objects."""

    def replace_path(match: re.Match[str]) -> str:
        return _translate_path(match, sketch)

    return _JSON_PATH.sub(replace_path, message.removeprefix("map: "))


def _translate_path(match: re.Match[str], sketch: Sketch) -> str:
    """Translate a matched path such as "obstacles[2].points[1]" to a name such as "wall 3, point 2"."""
    section = match[1]
    steps = [_PathStep(*step) for step in _STEP.findall(match[2])]
    if section == "obstacles":
        number = steps[0].number
        if not number or int(number) >= len(sketch.obstacles):
            return match[0]
        obstacle = format_numbered_name(sketch, sketch.obstacles[int(number)].key)
        return ", ".join([obstacle, *_describe_steps(steps[1:])])
    if section == "starts":
        step = steps[0]
        name = step.number or step.attribute or step.key
        return ", ".join([f"start “{name}”", *_describe_steps(steps[1:])])
    return ", ".join([section, *_describe_steps(steps)])


def _describe_steps(steps: list[_PathStep]) -> list[str]:
    """Describe the steps below an object, for example [0] after .holes as "hole 1"."""
    words: list[str] = []
    noun = "corner"
    for step in steps:
        if not step.number:
            name = step.attribute or step.key
            noun = _NOUNS.get(name, name)
            words.append(noun)
        elif noun:
            if words and words[-1] == noun:
                words.pop()
            words.append(f"{noun} {int(step.number) + 1}")
            # A hole is followed by the number of its corner; nothing else is numbered twice.
            noun = "corner" if noun == "hole" else ""
    return words
