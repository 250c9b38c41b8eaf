"""Handles of the selection: its vertices, the sides and corners of its frame, and the rotation knob."""

from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeAlias

from robocov.environment import Point
from robocov_app.editor.edits.transform import compute_bounds, compute_box
from robocov_app.editor.model.geometry import Box, compute_center, distance
from robocov_app.editor.model.selection import Selection, Vertex, list_vertices
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

HandleKind: TypeAlias = Literal["vertex", "scale", "rotate"]

# Lengths in pixels at scale 1.
FRAME_MARGIN_PX = 11.0  # between the selection and the frame around it
KNOB_HEIGHT_PX = 24.0  # between the frame and the rotation knob above it
MIN_SIDE_WITH_MIDDLE_PX = 34.0  # shorter sides of the frame have no handle in their middle
MIN_SIZE_WITH_VERTICES_PX = 26.0  # smaller objects do not show vertices, so that there is space to drag them

MAX_VERTEX_HANDLES = 4000  # more handles could not be distinguished


@dataclass(frozen=True)
class Handle:
    """A handle of the selection that can be dragged.

    Attributes
    ----------
    kind : {"vertex", "scale", "rotate"}
        Effect of dragging the handle.
    position : Point
        Position, m.
    vertex : Vertex or None
        Vertex that the handle moves.
    side : tuple of int
        Side or corner of the frame that the handle moves, (x, y): -1, 0 or 1 along each axis.
    """

    kind: HandleKind
    position: Point
    vertex: Vertex | None = None
    side: tuple[int, int] = (0, 0)


def list_vertex_owners(selection: Selection) -> tuple[Owner, ...]:
    """Return the objects whose vertices are shown: a single selected one, or owners of selected vertices."""
    owners = selection.owners | {vertex.owner for vertex in selection.vertices}
    if selection.vertices or len(owners) == 1:
        return tuple(sorted(owners, key=str))
    return ()


def compute_frame(sketch: Sketch, selection: Selection, pixel: float) -> Box | None:
    """Compute the frame around selected objects.

    Parameters
    ----------
    sketch : Sketch
        The map.
    selection : Selection
        The selection. There is no frame if it contains vertices.
    pixel : float
        Side length of a pixel at scale 1, m.

    Returns
    -------
    Box or None
        Frame, m; None if there is none.
    """
    if selection.vertices:
        return None
    bounds = compute_bounds(sketch, selection)
    if bounds is None:
        return None
    margin = FRAME_MARGIN_PX * pixel
    return bounds[0] - margin, bounds[1] - margin, bounds[2] + margin, bounds[3] + margin


def list_handles(sketch: Sketch, selection: Selection, pixel: float) -> tuple[Handle, ...]:
    """Return the handles of a selection; `pixel` is the side length of a pixel at scale 1, m."""
    handles: list[Handle] = []
    frame = compute_frame(sketch, selection, pixel)
    if frame is not None:
        handles += _list_frame_handles(frame, pixel)
    for owner in list_vertex_owners(selection):
        if _shows_vertices(sketch, selection, owner, pixel):
            vertices = list_vertices(sketch, owner)[:MAX_VERTEX_HANDLES]
            handles += [Handle("vertex", position, vertex) for vertex, position in vertices]
    return tuple(handles)


def _list_frame_handles(frame: Box, pixel: float) -> list[Handle]:
    """Return the handles at the corners and sides of a frame, and the rotation knob above it."""
    low_x, low_y, high_x, high_y = frame
    min_side = MIN_SIDE_WITH_MIDDLE_PX * pixel
    columns = [-1, 1]
    rows = [-1, 1]
    if high_x - low_x > min_side:
        columns = [-1, 0, 1]
    if high_y - low_y > min_side:
        rows = [-1, 0, 1]
    sides = [side for side in product(columns, rows) if side != (0, 0)]
    handles = [Handle("scale", compute_side_position(frame, side), side=side) for side in sides]
    knob = (compute_center(frame)[0], high_y + KNOB_HEIGHT_PX * pixel)
    handles.append(Handle("rotate", knob))
    return handles


def _shows_vertices(sketch: Sketch, selection: Selection, owner: Owner, pixel: float) -> bool:
    if owner == BOUNDARY or selection.vertices:
        return True
    box = compute_box(sketch, owner)
    if box is None:
        return True
    return max(box[2] - box[0], box[3] - box[1]) >= MIN_SIZE_WITH_VERTICES_PX * pixel


def compute_side_position(box: Box, side: tuple[int, int]) -> Point:
    """Return a corner or the middle of a side of a box; `side` is -1, 0 or 1 along each axis."""
    low_x, low_y, high_x, high_y = box
    x, y = side
    return (low_x + high_x + x * (high_x - low_x)) / 2, (low_y + high_y + y * (high_y - low_y)) / 2


def find_handle(handles: tuple[Handle, ...], point: Point, reach: float) -> Handle | None:
    """Return the nearest handle within `reach` meters of a point; None without one.

    Vertices take precedence over other handles.
    """
    nearby = [handle for handle in handles if distance(handle.position, point) <= reach]
    return min(
        nearby, key=lambda handle: (handle.kind != "vertex", distance(handle.position, point)), default=None
    )
