"""Handles: vertices, the corners and sides of the box around a selection, and the knob that turns it."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from robocov.environment import Point
from robocov_app.editor.edits.transform import bounds_of, box_of
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.model.selection import Selection, Vertex, points_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

Kind: TypeAlias = Literal["vertex", "scale", "turn"]

BESIDE = 11.0  # pixels at scale 1 between what is selected and the box around it
KNOB = 24.0  # pixels at scale 1 that the knob is above the box
ROOMY = 34.0  # pixels at scale 1 that a side of the box has at least when there is a handle in its middle
SMALL = 26.0
"""Pixels at scale 1 of a thing below which its vertices are no handles: it could not be dragged itself."""

MOST_VERTICES = 4000  # vertices that are shown at most: more could not be told apart


@dataclass(frozen=True)
class Handle:
    """Something that can be taken hold of."""

    kind: Kind  # ``vertex``, ``scale`` or ``turn``
    at: Point  # m; where it is shown
    vertex: Vertex | None = None
    side: tuple[int, int] = (0, 0)  # (x, y); of a handle that scales: -1, 0 or 1 along each axis


def handled(selection: Selection) -> tuple[Owner, ...]:
    """Return whose vertices are shown: of the one thing that is selected, or of selected vertices."""
    of_vertices = {vertex.of for vertex in selection.vertices}
    owners = selection.owners
    if of_vertices:
        return tuple(sorted(of_vertices | owners, key=str))
    return tuple(owners) if len(owners) == 1 else ()


def frame_of(sketch: Sketch, selection: Selection, pixel: float) -> tuple[float, float, float, float] | None:
    """Return the box that is shown around whole things, m; `pixel` is how many metres one is at scale 1."""
    bounds = None if selection.vertices else bounds_of(sketch, selection)
    if bounds is None:
        return None
    far = BESIDE * pixel
    return bounds[0] - far, bounds[1] - far, bounds[2] + far, bounds[3] + far


def handles(sketch: Sketch, selection: Selection, pixel: float) -> tuple[Handle, ...]:
    """Return all handles, those that are taken first last."""
    found: list[Handle] = []
    frame = frame_of(sketch, selection, pixel)
    if frame is not None:
        low_x, low_y, high_x, high_y = frame
        xs = {-1: low_x, 0: (low_x + high_x) / 2, 1: high_x}
        ys = {-1: low_y, 0: (low_y + high_y) / 2, 1: high_y}
        columns = (-1, 0, 1) if high_x - low_x > ROOMY * pixel else (-1, 1)
        rows = (-1, 0, 1) if high_y - low_y > ROOMY * pixel else (-1, 1)
        sides = [(x, y) for x in columns for y in rows if x or y]
        found += [Handle("scale", (xs[x], ys[y]), side=(x, y)) for x, y in sides]
        found.append(Handle("turn", (xs[0], high_y + KNOB * pixel)))
    for owner in handled(selection):
        if selection.vertices or not _is_small(sketch, owner, pixel):
            points = points_of(sketch, owner)
            found += [Handle("vertex", at, vertex) for vertex, at in points[:MOST_VERTICES]]
    return tuple(found)


def handle_at(found: tuple[Handle, ...], point: Point, reach: float) -> Handle | None:
    """Return the handle within `reach` metres of a point: the nearest, a vertex before others."""
    near = [handle for handle in found if distance(handle.at, point) <= reach]
    return min(near, key=lambda each: (each.kind != "vertex", distance(each.at, point)), default=None)


def _is_small(sketch: Sketch, owner: Owner, pixel: float) -> bool:
    box = None if owner == BOUNDARY else box_of(sketch, owner)
    return box is not None and max(box[2] - box[0], box[3] - box[1]) < SMALL * pixel
