"""The tool that selects and drags objects and vertices, and the tool that pans the view."""

from dataclasses import replace

from robocov_app.editor.edits import vertices
from robocov_app.editor.model.hit_test import find_edge, find_owners
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Owner
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.handles import Handle, find_handle
from robocov_app.editor.tools.selection_drags import (
    BoxDrag,
    Drag,
    MoveDrag,
    RotateDrag,
    ScaleDrag,
    VertexDrag,
)
from robocov_app.editor.tools.tool import EditorPointerEvent, EditorTool
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.toolkit.tools.tool import CursorShape

HANDLE_REACH_FRACTION = 0.6  # of the pointer's reach: handles and edges are picked within this distance
OBJECT_REACH_FRACTION = 0.5  # of the pointer's reach: objects are picked within this distance
EDGE_TOLERANCE_M = 1e-5  # a point this close to an edge counts as lying on it
_SIDE_CURSORS: dict[tuple[int, int], CursorShape] = {
    (1, 0): "sideways",
    (-1, 0): "sideways",
    (0, 1): "updown",
    (0, -1): "updown",
    (1, 1): "rising",
    (-1, -1): "rising",
    (-1, 1): "falling",
    (1, -1): "falling",
}


class SelectTool(EditorTool):
    """Selects objects and vertices, and drags them or the frame around them.

    Attributes
    ----------
    hovered : Owner or None
        Object under the cursor.
    hovered_handle : Handle or None
        Handle under the cursor.
    drag : Drag or None
        The current drag.
    """

    name = "select"
    title = "Select"
    key = "v"
    hint = "click or drag a box; drag to move, Alt-drag to copy; double-click an edge to insert a vertex"
    snaps = False

    def __init__(self) -> None:
        super().__init__()
        self.hovered: Owner | None = None
        self.hovered_handle: Handle | None = None
        self.drag: Drag | None = None
        self._handle: Handle | None = None  # the handle that was pressed
        # Whether a click narrows the selection, because the press was on a selected object.
        self._narrows = False
        # Objects that a click with Shift removes from the selection; a drag moves them instead.
        self._removed = Selection()

    @property
    def is_busy(self) -> bool:
        """Whether something is dragged."""
        return self.drag is not None

    def press(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Select the vertex whose handle is under the pointer, or else the object there."""
        self.pressed = event
        self.drag = None
        self._narrows = False
        self._removed = Selection()
        self._handle = self._find_handle(context, event)
        if self._handle is None:
            self._press_object(context, event)
        elif self._handle.vertex is not None:
            self._press_vertex(context, event, self._handle)

    def _press_vertex(self, context: EditorContext, event: EditorPointerEvent, handle: Handle) -> None:
        vertex = handle.vertex
        assert vertex is not None
        pressed = Selection(vertices=frozenset({vertex}))
        if event.shift:
            context.select(Selection(vertices=context.selection.vertices).toggle(pressed))
        elif vertex not in context.selection.vertices:
            context.select(pressed)

    def _press_object(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Select the object under the pointer with its group; with Shift, add it or remove it."""
        owners = _find_owners(context, event)
        if not owners:
            return
        # A selected object takes precedence over others on top of it.
        selected = next((owner for owner in owners if owner in context.selection.owners), None)
        owner = owners[0]
        if selected is not None and not event.shift:
            owner = selected
        pressed = Selection.of(owner).with_groups(context.sketch)
        if event.shift and owner in context.selection.owners:
            self._removed = pressed
        elif event.shift:
            context.select(context.selection.without_vertices().toggle(pressed))
        elif selected is None or context.selection.vertices:
            context.select(pressed)
        else:
            self._narrows = True

    def move(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Find the handle or object under the pointer or, while the button is held down, drag."""
        if self.pressed is None:
            self.hovered_handle = self._find_handle(context, event)
            self.hovered = None
            if self.hovered_handle is None:
                self.hovered = next(iter(_find_owners(context, event)), None)
            return
        if self.drag is None and event.has_moved_from(self.pressed.unsnapped_point):
            self.drag = self._start_drag(context, self.pressed)
        if self.drag is not None:
            self.drag.update(event)
            self.guides = self.drag.guides

    def _start_drag(self, context: EditorContext, pressed: EditorPointerEvent) -> Drag:
        """Return the drag that a press starts: of a handle, a selected object, or a selection box."""
        handle = self._handle
        objects = context.selection.without_vertices()
        if handle is not None and handle.vertex is not None:
            return VertexDrag(context, handle.vertex, context.selection)
        if handle is not None and handle.kind == "rotate":
            return RotateDrag(context, objects, pressed.unsnapped_point)
        if handle is not None:
            return ScaleDrag(context, objects, handle)
        if any(owner in objects.owners for owner in _find_owners(context, pressed)):
            return MoveDrag(context, objects, pressed.unsnapped_point)
        return BoxDrag(context, pressed.unsnapped_point, adds=pressed.shift)

    def release(self, context: EditorContext, event: EditorPointerEvent, *, is_click: bool) -> None:
        """End the drag, or handle the click."""
        pressed = self.pressed
        drag = self.drag
        self._stop()
        if drag is not None:
            drag.update(event)
            drag.end()
        elif self._removed:
            context.select(context.selection.without_vertices().toggle(self._removed))
        elif pressed is not None and self._handle is None and not event.shift:
            self._click(context, pressed)

    def _click(self, context: EditorContext, pressed: EditorPointerEvent) -> None:
        """Narrow the selection to the clicked object; on a single selected object, select the one below."""
        owners = _find_owners(context, pressed)
        selected = context.selection.owners
        if not owners:
            context.select(Selection())
        elif self._narrows and len(selected) > 1:
            context.select(Selection.of(next(owner for owner in owners if owner in selected)))
        elif self._narrows and len(owners) > 1:
            (owner,) = selected
            below = (owners.index(owner) + 1) % len(owners)
            context.select(Selection.of(owners[below]))

    def double_click(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Insert a vertex into the edge under the pointer; if there is none, handle it like a press."""
        owners = context.vertex_owners or _find_owners(context, event)[:1]
        edge = find_edge(context.sketch, event.unsnapped_point, HANDLE_REACH_FRACTION * event.reach, owners)
        if edge is None or self._find_handle(context, event) is not None:
            self.press(context, event)
            return
        self.pressed = None
        self.drag = None
        if not event.ctrl:
            # Snap the vertex, but only if it remains on the edge.
            position = context.snap(edge.point, event.reach).point
            edge = find_edge(context.sketch, position, EDGE_TOLERANCE_M, [edge.owner]) or edge
        context.apply(vertices.insert_vertex(context.sketch, edge))

    def enter_text(self, context: EditorContext, text: str) -> None:
        """End the drag with a value that the user typed."""
        drag = self.drag
        if drag is None:
            super().enter_text(context, text)
            return
        drag.enter_text(text)
        self._stop()
        drag.end()

    def cancel(self, context: EditorContext) -> bool:
        """Cancel the drag; without one, replace selected vertices by their owners, or clear the selection."""
        had_something = bool(self.drag or context.selection)
        if self.drag is not None:
            self._stop()
        elif had_something:
            owners = {vertex.owner for vertex in context.selection.vertices}
            context.select(Selection.of(*owners))
        return had_something

    def _stop(self) -> None:
        self.pressed = None
        self.drag = None
        self.guides = ()

    def build_overlay(self, context: EditorContext) -> EditorToolOverlay:
        """Return the state of the drag, or the handle and object under the cursor."""
        if self.drag is not None:
            return replace(self.drag.build_overlay(), hovered_handle=self.hovered_handle)
        return EditorToolOverlay(
            hovered=self.hovered,
            hovered_handle=self.hovered_handle,
            shows_handles=True,
            labels_cursor=False,
        )

    def choose_cursor(self, context: EditorContext) -> CursorShape:
        """Return the shape of the cursor."""
        if self.drag is not None and self.drag.cursor_shape is not None:
            return self.drag.cursor_shape
        handle = self.hovered_handle if self.drag is None else self._handle
        if handle is not None:
            return _SIDE_CURSORS.get(handle.side, "hand")
        if self.hovered is None:
            return "arrow"
        if self.hovered in context.selection.owners:
            return "move"
        return "hand"

    def _find_handle(self, context: EditorContext, event: EditorPointerEvent) -> Handle | None:
        return find_handle(context.handles, event.unsnapped_point, HANDLE_REACH_FRACTION * event.reach)


def _find_owners(context: EditorContext, event: EditorPointerEvent) -> tuple[Owner, ...]:
    return find_owners(context.sketch, event.unsnapped_point, OBJECT_REACH_FRACTION * event.reach)


class PanTool(EditorTool):
    """Pans the view. The tool itself does nothing, because the window has the camera."""

    name = "pan"
    title = "Pan"
    key = "g"
    hint = "drag the sheet; with every tool, drag with the right button, or hold Space"
    snaps = False
    accepts_text = False

    def choose_cursor(self, context: EditorContext) -> CursorShape:
        """Return the shape of the cursor."""
        return "move"
