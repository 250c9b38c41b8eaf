"""State that the tools of the editor draw on the sheet. All lengths are in meters."""

from dataclasses import dataclass

from robocov.environment import Obstacle, Point, Ring, StartSpec
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Owner, Sketch
from robocov_app.editor.tools.handles import Handle
from robocov_app.toolkit.tools.tool import ToolOverlay


@dataclass(frozen=True)
class DraggedImage:
    """Objects that are dragged as an image, because there are too many to move one by one.

    Attributes
    ----------
    selection : Selection
        The obstacles and starts that are dragged.
    offset : tuple of float
        Displacement, (x, y) m.
    shows_copies : bool
        Whether copies are dragged and the originals stay in place.
    """

    selection: Selection
    offset: tuple[float, float]
    shows_copies: bool


@dataclass(frozen=True)
class EditorToolOverlay(ToolOverlay):
    """Everything that a tool of the editor shows on the sheet.

    Attributes
    ----------
    line, is_closed, label
        See `ToolOverlay`. The label is next to the cursor.
    shows_lengths : bool
        Whether the length of each edge is written next to the line.
    shapes : tuple of Obstacle
        Preview of obstacles.
    start : StartSpec or None
        Preview of a start.
    box : tuple of Point or None
        Opposite corners of a selection box, m.
    box_selects_partial : bool
        Whether the box also selects objects that are only partly inside.
    outlines : tuple of Ring
        Outlines to draw, m.
    markers : tuple of Point
        Positions to mark with a square, m.
    chosen : int or None
        Index of the outline or marker that is highlighted.
    pending : Sketch or None
        The map with the density or paths as the current drag changes them.
    background : Background or None
        The background image at the position to which it is being dragged.
    dragged_image : DraggedImage or None
        Objects that are dragged as an image.
    hovered : Owner or None
        Object under the cursor.
    hovered_handle : Handle or None
        Handle under the cursor.
    shows_handles : bool
        Whether the handles of the selection are shown.
    labels_cursor : bool
        Whether the tool may have a label at the cursor, which other labels avoid.
    """

    shows_lengths: bool = False
    shapes: tuple[Obstacle, ...] = ()
    start: StartSpec | None = None
    box: tuple[Point, Point] | None = None
    box_selects_partial: bool = False
    outlines: tuple[Ring, ...] = ()
    markers: tuple[Point, ...] = ()
    chosen: int | None = None
    pending: Sketch | None = None
    background: Background | None = None
    dragged_image: DraggedImage | None = None
    hovered: Owner | None = None
    hovered_handle: Handle | None = None
    shows_handles: bool = False
    labels_cursor: bool = True
