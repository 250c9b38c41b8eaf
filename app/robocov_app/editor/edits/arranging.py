"""Selected things aligned and spread: by their bounding boxes, as in drawing programs.

As in `robocov_app.editor.edits.edits`: a `Change`, or a MapError with a sentence for people.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from robocov.errors import MapError
from robocov_app.editor.edits.placing import box_of, each_moved
from robocov_app.editor.edits.vertices import with_places
from robocov_app.editor.model.document import BOUNDARY, Owner, Sketch
from robocov_app.editor.model.selection import Change, Selection, place_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Point

Side: TypeAlias = Literal["left", "centre", "right", "top", "middle", "bottom"]
Axis: TypeAlias = Literal["x", "y"]
Box: TypeAlias = tuple[float, float, float, float]

SIDES: Final = ("left", "centre", "right", "top", "middle", "bottom")
"""Left, centre and right move along x; top, middle and bottom along y."""

_ALONG_X = SIDES[:3]


def aligned(sketch: Sketch, selection: Selection, side: Side, *, to_boundary: bool = False) -> Change:
    """Align the selected obstacles and starts with the side of their common bounding box, or the boundary's.

    The boundary itself stays: when it is selected too, the others align with it. Of single vertices alone:
    gives them the same x or y.
    """
    if side not in SIDES:
        raise MapError(f"one of {', '.join(SIDES)} was wanted")
    if selection.vertices and not selection.owners:
        return _aligned_vertices(sketch, selection, side)
    boxes = _boxes(sketch, selection)
    if to_boundary or selection.boundary:
        frame = box_of(sketch, BOUNDARY)
        if frame is None:
            raise MapError("there is no boundary to align with")
        if not boxes:
            raise MapError("select obstacles or starts to align")
    else:
        if len(boxes) < 2:
            raise MapError("select two or more obstacles or starts to align")
        low_x, low_y, high_x, high_y = zip(*boxes.values(), strict=True)
        frame = min(low_x), min(low_y), max(high_x), max(high_y)
    by: dict[Owner, Point] = {}
    for owner, box in boxes.items():
        off = _level(frame, side) - _level(box, side)
        by[owner] = (off, 0.0) if side in _ALONG_X else (0.0, off)
    words = f"{Selection.of(*boxes).words(sketch)} aligned {_words(side)}"
    return Change(each_moved(sketch, by), selection, words)


def distributed(sketch: Sketch, selection: Selection, axis: Axis, *, gap: float | None = None) -> Change:
    """Spread three or more selected things so that the gaps between their boxes are equal.

    The first and the last stay where they are; with a `gap` in metres, the first only.
    """
    a = _axis(axis)
    boxes = _in_order(sketch, selection, 3 if gap is None else 2, lambda box: (box[a], box[a + 2]))
    if gap is None:
        room = boxes[-1][1][a + 2] - boxes[0][1][a]
        gap = (room - sum(box[a + 2] - box[a] for _, box in boxes)) / (len(boxes) - 1)
    by: dict[Owner, Point] = {}
    low = boxes[0][1][a]
    for owner, box in boxes:
        by[owner] = (low - box[a], 0.0) if a == 0 else (0.0, low - box[a])
        low += box[a + 2] - box[a] + gap
    return _spread(sketch, selection, by)


def _aligned_vertices(sketch: Sketch, selection: Selection, side: Side) -> Change:
    places = {vertex: place_of(sketch, vertex) for vertex in selection.vertices}
    if len(places) < 2:
        raise MapError("select two or more vertices to align")
    xs, ys = zip(*places.values(), strict=True)
    level = _level((min(xs), min(ys), max(xs), max(ys)), side)
    moved = {vertex: (level, y) if side in _ALONG_X else (x, level) for vertex, (x, y) in places.items()}
    words = f"{selection.words(sketch)} aligned {_words(side)}"
    return Change(with_places(sketch, moved), selection, words)


def _boxes(sketch: Sketch, selection: Selection) -> dict[Owner, Box]:
    """Return the boxes of the selected obstacles and starts, in the order of the sketch."""
    owners: list[Owner] = [item.key for item in sketch.obstacles if item.key in selection.items]
    owners += [name for name, _ in sketch.starts if name in selection.starts]
    return {owner: box for owner in owners if (box := box_of(sketch, owner)) is not None}


def _in_order(
    sketch: Sketch, selection: Selection, least: int, rank: Callable[[Box], tuple[float, float]]
) -> list[tuple[Owner, Box]]:
    boxes = _boxes(sketch, selection)
    if len(boxes) < least:
        count = {2: "two", 3: "three"}[least]
        raise MapError(f"select {count} or more obstacles or starts to distribute")
    return sorted(boxes.items(), key=lambda pair: rank(pair[1]))


def _spread(sketch: Sketch, selection: Selection, by: dict[Owner, Point]) -> Change:
    return Change(each_moved(sketch, by), selection, f"{Selection.of(*by).words(sketch)} distributed")


def _axis(axis: Axis) -> int:
    if axis not in ("x", "y"):
        raise MapError("an axis x or y was wanted")
    return ("x", "y").index(axis)


def _level(box: Box, side: Side) -> float:
    low_x, low_y, high_x, high_y = box
    return {
        "left": low_x,
        "centre": (low_x + high_x) / 2,
        "right": high_x,
        "top": high_y,
        "middle": (low_y + high_y) / 2,
        "bottom": low_y,
    }[side]


def _words(side: Side) -> str:
    return {"centre": "by their centres", "middle": "by their middles"}.get(side, f"at the {side}")
