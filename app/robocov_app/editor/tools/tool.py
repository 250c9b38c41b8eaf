"""Base class of the tools, the workspace that they act on, and what they show; all lengths in meters."""

from collections.abc import Hashable
from dataclasses import dataclass
from itertools import product
from typing import Literal, TypeAlias

from robocov.environment import Obstacle, Point, Ring, StartSpec
from robocov.errors import MapError
from robocov_app.editor.edits.transform import compute_bounds, compute_box
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.document import Document
from robocov_app.editor.model.geometry import Box, compute_center, constrain_angle, distance
from robocov_app.editor.model.selection import Change, Selection, Vertex, list_vertices
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch
from robocov_app.editor.tools.snapping import SNAPS, Dragged, Guide, Snap, Snapper, SnapSettings, snap_point
from robocov_app.render.surface_cache import Latest

HandleKind: TypeAlias = Literal["vertex", "scale", "turn"]

# Lengths in pixels at scale 1.
FRAME_MARGIN_PX = 11.0  # between the selection and the frame around it
KNOB_HEIGHT_PX = 24.0  # of the rotation knob above the frame
MIN_SIDE_WITH_MIDDLE_PX = 34.0  # shorter sides of the frame have no handle in their middle
MIN_SIZE_WITH_VERTICES_PX = 26.0  # of smaller objects no vertices are shown, so that they can be dragged

SNAP_REACH_FRACTION = 0.6  # of the pointer's reach: a line that is far off must not win over the grid
MAX_VERTEX_HANDLES = 4000  # more could not be told apart
MOVED_FRACTION = 0.25  # of the pointer's reach, from which on the pointer has moved on purpose


@dataclass(frozen=True)
class Handle:
    """A handle of the selection that can be dragged.

    Attributes
    ----------
    kind : {"vertex", "scale", "turn"}
        What dragging it does.
    at : Point
        Its position, m.
    vertex : Vertex or None
        The vertex that it moves.
    side : tuple of int
        Side of the frame that it moves, (x, y): -1, 0 or 1 along each axis.
    """

    kind: HandleKind
    at: Point
    vertex: Vertex | None = None
    side: tuple[int, int] = (0, 0)


def list_vertex_owners(selection: Selection) -> tuple[Owner, ...]:
    """Return the objects whose vertices are shown: a single selected object, or owners of vertices."""
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
        Selected objects; vertices have no frame.
    pixel : float
        Side of a pixel at scale 1, m.

    Returns
    -------
    Box or None
        Frame, m; None where there is none.
    """
    if selection.vertices:
        return None
    bounds = compute_bounds(sketch, selection)
    if bounds is None:
        return None
    margin = FRAME_MARGIN_PX * pixel
    return bounds[0] - margin, bounds[1] - margin, bounds[2] + margin, bounds[3] + margin


def list_handles(sketch: Sketch, selection: Selection, pixel: float) -> tuple[Handle, ...]:
    """Return the handles of a selection; `pixel` is the side of a pixel at scale 1, m."""
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
    low_x, low_y, high_x, high_y = frame
    min_side = MIN_SIDE_WITH_MIDDLE_PX * pixel
    columns = (-1, 0, 1) if high_x - low_x > min_side else (-1, 1)
    rows = (-1, 0, 1) if high_y - low_y > min_side else (-1, 1)
    sides = [side for side in product(columns, rows) if side != (0, 0)]
    handles = [Handle("scale", compute_side_position(frame, side), side=side) for side in sides]
    knob = (compute_center(frame)[0], high_y + KNOB_HEIGHT_PX * pixel)
    handles.append(Handle("turn", knob))
    return handles


def _shows_vertices(sketch: Sketch, selection: Selection, owner: Owner, pixel: float) -> bool:
    if owner == BOUNDARY or selection.vertices:
        return True
    box = compute_box(sketch, owner)
    if box is None:
        return True
    return max(box[2] - box[0], box[3] - box[1]) >= MIN_SIZE_WITH_VERTICES_PX * pixel


def compute_side_position(box: Box, side: tuple[int, int]) -> Point:
    """Return a corner of a box or the middle of a side: -1, 0 or 1 along each axis."""
    low_x, low_y, high_x, high_y = box
    x, y = side
    return (low_x + high_x + x * (high_x - low_x)) / 2, (low_y + high_y + y * (high_y - low_y)) / 2


def find_handle(handles: tuple[Handle, ...], point: Point, reach: float) -> Handle | None:
    """Return the handle within `reach` meters of a point: the nearest, vertices before others."""
    near = [handle for handle in handles if distance(handle.at, point) <= reach]
    return min(near, key=lambda handle: (handle.kind != "vertex", distance(handle.at, point)), default=None)


@dataclass(frozen=True)
class PointerEvent:
    """Position of the pointer, and the modifier keys held down with it.

    Attributes
    ----------
    point : Point
        Position after snapping, m.
    raw : Point
        Position before snapping, m.
    reach : float
        Distance within which the pointer takes hold of something, m.
    shift, alt, ctrl : bool
        Whether the key is held down.
    """

    point: Point
    raw: Point
    reach: float
    shift: bool = False
    alt: bool = False
    ctrl: bool = False

    def has_moved_from(self, position: Point) -> bool:
        """Return whether the pointer has moved on purpose since it was pressed at a position, m."""
        return distance(position, self.raw) >= MOVED_FRACTION * self.reach

    def constrain(self, origin: Point | None) -> Point:
        """Return the point; with Shift, the nearest one at a round angle from `origin`."""
        if self.shift and origin is not None:
            return constrain_angle(origin, self.raw)
        return self.point


@dataclass(frozen=True)
class CarriedItems:
    """Obstacles that are dragged as a picture, because there are too many to move one by one.

    Attributes
    ----------
    selection : Selection
        The obstacles and starts that are dragged.
    offset : tuple of float
        Displacement, (x, y) m.
    are_copies : bool
        Whether the originals stay where they are.
    """

    selection: Selection
    offset: tuple[float, float]
    are_copies: bool


@dataclass(frozen=True)
class DrawState:
    """Everything that a tool shows on the sheet.

    Attributes
    ----------
    line : tuple of Point
        Points of a line with a mark at each, m.
    is_closed : bool
        Whether the line returns to its first point.
    shows_lengths : bool
        Whether each edge of the line has its length written next to it.
    shapes : tuple of Obstacle
        Obstacles that would be drawn.
    start : StartSpec or None
        Start that would be drawn.
    box : tuple of Point or None
        Opposite corners of a selection box, m.
    box_selects_touched : bool
        Whether the box selects what it touches, not only what lies inside.
    label : str
        Text next to the cursor.
    rings : tuple of Ring
        Outlines, m.
    dots : tuple of Point
        Marks, m.
    chosen : int or None
        Index of the ring or dot that stands out.
    pending : Sketch or None
        The map with a density or paths that are being changed.
    background : Background or None
        The reference image at the position to which it is dragged.
    carried : CarriedItems or None
        Obstacles that are dragged as a picture.
    hovered : Owner or None
        Object under the cursor.
    near : Handle or None
        Handle under the cursor.
    shows_handles : bool
        Whether the selection has its handles.
    labels_cursor : bool
        Whether the tool may write next to the cursor.
    """

    line: tuple[Point, ...] = ()
    is_closed: bool = False
    shows_lengths: bool = False
    shapes: tuple[Obstacle, ...] = ()
    start: StartSpec | None = None
    box: tuple[Point, Point] | None = None
    box_selects_touched: bool = False
    label: str = ""
    rings: tuple[Ring, ...] = ()
    dots: tuple[Point, ...] = ()
    chosen: int | None = None
    pending: Sketch | None = None
    background: Background | None = None
    carried: CarriedItems | None = None
    hovered: Owner | None = None
    near: Handle | None = None
    shows_handles: bool = False
    labels_cursor: bool = True


class Workspace:
    """The open map, its selection and the snap settings: the part of the editor that tools know.

    Parameters
    ----------
    document : Document
        The open map.

    Attributes
    ----------
    revision : int
        Grows whenever panel and sheet have to be drawn again.
    snaps : set of str
        Names of the snap modes that are on; see `SNAPS`.
    grid : float
        Spacing of the grid, m.
    snap_angle : float
        Lines snap to multiples of this angle, degrees.
    wall_width : float
        Width of new walls, m.
    pixel : float
        Side of a pixel at scale 1, m.
    message : str
        Latest status message; empty after a few seconds.
    has_error_message : bool
        Whether the message reports an error.
    now : float
        Clock of the window, s.
    message_time : float
        Time at which the message appeared, s.
    """

    def __init__(self, document: Document) -> None:
        self.document = document
        self.revision = 0
        self.snaps = set(SNAPS)
        self.grid = 0.1
        self.snap_angle = 15.0
        self.wall_width = 0.1
        self.pixel = 0.01
        self.snapper = Snapper()
        self.message = ""
        self.has_error_message = False
        self.now = 0.0
        self.message_time = 0.0
        self._handles: Latest[tuple[Handle, ...]] = Latest()

    @property
    def sketch(self) -> Sketch:
        """The map as it is now."""
        return self.document.history.sketch

    @property
    def selection(self) -> Selection:
        """The selected objects and vertices."""
        return self.document.history.selection

    @property
    def vertex_owners(self) -> tuple[Owner, ...]:
        """Objects whose vertices are shown."""
        return list_vertex_owners(self.selection)

    @property
    def handles(self) -> tuple[Handle, ...]:
        """Handles of the selection."""
        sketch = self.sketch
        selection = self.selection
        pixel = self.pixel
        return self._handles.of(sketch, (selection, pixel), lambda: list_handles(sketch, selection, pixel))

    def build_snap_settings(self, reach: float) -> SnapSettings:
        """Return the snap settings for a pointer with a reach, m."""
        kinds = frozenset(kind for name in self.snaps for kind in SNAPS[name].kinds)
        return SnapSettings(SNAP_REACH_FRACTION * reach, self.grid, self.snap_angle, kinds)

    def snap(
        self, raw: Point, reach: float, origin: Point | None = None, more: Ring = (), without: Dragged = ()
    ) -> Snap:
        """Snap a point.

        Parameters
        ----------
        raw : Point
            Position of the pointer, m.
        reach : float
            Reach of the pointer, m.
        origin : Point, optional
            Point from which angles count, m.
        more : sequence of Point
            Further points to snap to, m.
        without : iterable of Owner or Vertex
            Objects and vertices not to snap to, because they are dragged.

        Returns
        -------
        Snap
            The snapped point; the raw point while the targets of a large map are being computed.
        """
        targets = self.snapper.find_targets(self.sketch, without, more)
        if targets is None:
            return Snap(raw)
        return snap_point(raw, targets, self.build_snap_settings(reach), origin)

    def apply(self, change: Change, *, drag: Hashable | None = None) -> None:
        """Apply a change; successive changes of the same `drag` are undone together."""
        if self.document.history.apply(change, drag=drag):
            self.show_message(change.description)
        self._handle_change()

    def _handle_change(self) -> None:
        self.revision += 1

    def select(self, selection: Selection) -> None:
        """Replace the selection."""
        if selection != self.selection:
            self.document.history.selection = selection
            self.revision += 1

    def show_message(self, text: str, *, is_error: bool = False) -> None:
        """Show a status message; an empty one leaves the present message."""
        if text:
            self.message = text
            self.has_error_message = is_error
            self.message_time = self.now


class Tool:
    """A tool that does nothing: base class of the others.

    Attributes
    ----------
    name : str
        Unique name, as in the command ``tool:name``.
    title : str
        Name in the window; by default the capitalized name.
    key : str
        Key that chooses the tool.
    hint : str
        What to do next.
    snaps : bool
        Whether pointer positions are snapped before the tool gets them.
    accepts_text : bool
        Whether values can be typed while the tool is busy.
    starts_with_text : bool
        Whether values can be typed before, too.
    guides : tuple of Guide
        Guides of the latest snap.
    pressed : PointerEvent or None
        Event with which the button was pressed that is held down.
    clicked : list of Point
        Points clicked so far, m.
    cursor : Point
        Position of the cursor, m.
    change : Change or None
        Change that releasing the button would make.
    """

    name = ""
    title = ""
    key = ""
    hint = ""
    snaps = True
    accepts_text = True
    starts_with_text = False

    def __init__(self) -> None:
        self.title = self.title or self.name.capitalize()
        self.guides: tuple[Guide, ...] = ()
        self.pressed: PointerEvent | None = None
        self.clicked: list[Point] = []
        self.cursor: Point = (0.0, 0.0)
        self.change: Change | None = None

    @property
    def is_busy(self) -> bool:
        """Whether something is half done."""
        return self.pressed is not None or bool(self.clicked)

    @property
    def origin(self) -> Point | None:
        """Last point of the line that is being drawn, m."""
        return None

    @property
    def snap_points(self) -> tuple[Point, ...]:
        """Points drawn so far, to which the pointer snaps, m."""
        return ()

    def press(self, context: Workspace, event: PointerEvent) -> None:
        """Handle a press of the left button."""
        self.pressed = event
        self.change = None

    def double_click(self, context: Workspace, event: PointerEvent) -> None:
        """Handle the second press of a double click."""
        self.press(context, event)

    def move(self, context: Workspace, event: PointerEvent) -> None:
        """Handle a move of the pointer, with or without a button held down."""
        self.cursor = event.point

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        """Handle the release of the button; `clicked` if the pointer has not moved since the press."""

    def finish(self, context: Workspace) -> bool:
        """Handle Enter; return whether there was something to finish."""
        return False

    def remove_last(self, context: Workspace) -> bool:
        """Handle Backspace by removing the last point; return whether there was one."""
        if not self.clicked:
            return False
        self.clicked.pop()
        return True

    def cancel(self, context: Workspace) -> bool:
        """Handle Escape; return whether there was something to cancel."""
        was_busy = self.is_busy
        self.pressed = None
        self.change = None
        self.clicked = []
        return was_busy

    def enter_text(self, context: Workspace, text: str) -> None:
        """Handle a typed value; raise MapError if it means nothing."""
        raise MapError(f"“{text}”: there is nothing to type here")

    def build_draw_state(self, context: Workspace) -> DrawState:
        """Return what the tool shows on the sheet."""
        return DrawState()

    def choose_cursor(self, context: Workspace) -> str:
        """Return the shape of the cursor over the map: arrow, cross, hand, move, ..."""
        return "cross"
