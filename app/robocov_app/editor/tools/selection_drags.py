"""Drags of the selection tool. Each move of the pointer computes the change that a release would make."""

import math

from robocov.environment import CircleObstacle, Point
from robocov.errors import MapError
from robocov_app.editor.edits import transform, vertices
from robocov_app.editor.edits.transform import compute_bounds
from robocov_app.editor.model import geometry, require
from robocov_app.editor.model.coordinates import parse_angle, parse_length, parse_next_point
from robocov_app.editor.model.hit_test import find_in_box, find_vertices_in_box
from robocov_app.editor.model.selection import Change, Selection, Vertex, find_position, list_vertices
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.handles import Handle, compute_side_position
from robocov_app.editor.tools.tool import EditorPointerEvent
from robocov_app.editor.tools.tool_overlay import DraggedImage, EditorToolOverlay
from robocov_app.toolkit.tools.geometry import compute_bearing, constrain_angle
from robocov_app.toolkit.tools.snapping import Guide, Snap, snap_angle, snap_move
from robocov_app.toolkit.tools.tool import CursorShape

MANY_POINTS = 1000  # if more vertices are dragged, an image of the obstacles is moved instead
_MIN_SNAPPED_POINTS = 60  # of many dragged vertices, this many to twice as many are tried for snapping
NO_MOVE_M = 1e-9  # shorter distances count as zero
MIN_SIZE_M = 1e-3  # minimum size of the selection after scaling
_FACTOR_TOLERANCE = 1e-9  # factors along x and y that differ by less are shown as one
_UNIT_TOLERANCE = 1e-12  # factors that differ from 1 by less change nothing


class Drag:
    """Base class of drags.

    Parameters
    ----------
    context : EditorContext
        The editor.
    selection : Selection
        Objects and vertices that are dragged.
    start : Point
        Position at which the drag started, m.

    Attributes
    ----------
    change : Change or None
        Change that would be made if the drag ended now.
    guides : tuple of Guide
        Guides of the latest snap.
    label : str
        Text next to the cursor.
    cursor_shape : str or None
        Shape of the cursor; None for the one of the handle.
    """

    cursor_shape: CursorShape | None = None

    def __init__(self, context: EditorContext, selection: Selection, start: Point) -> None:
        self.context = context
        self.selection = selection
        self.change: Change | None = None
        self.guides: tuple[Guide, ...] = ()
        self.label = ""
        self._start = start
        self._end = start

    @property
    def dragged_image(self) -> DraggedImage | None:
        """Objects that are dragged as an image; None if they are dragged one by one."""
        return None

    def update(self, event: EditorPointerEvent) -> None:
        """Update the drag after a move of the pointer."""

    def enter_text(self, text: str) -> None:
        """Set the drag to a value that the user typed; raise MapError if the value is invalid."""
        raise MapError(f"“{text}”: this tool takes no typed value")

    def build_overlay(self) -> EditorToolOverlay:
        """Build the overlay that the drag shows on the sheet."""
        return EditorToolOverlay(label=self.label, dragged_image=self.dragged_image, shows_handles=True)

    def end(self) -> None:
        """Apply the change, if there is one."""
        if self.change is not None:
            self.context.apply(self.change)

    def _snap(self, event: EditorPointerEvent, position: Point, origin: Point | None = None) -> Point:
        """Snap a position to anything that is not being dragged; with Ctrl, do not snap."""
        snap = Snap(position)
        if not event.ctrl:
            dragged = self.selection.vertices or self.selection.owners
            snap = self.context.snap(position, event.reach, origin, ignored=dragged)
        self.guides = snap.guides
        return snap.point


class MoveDrag(Drag):
    """Moves objects. Alt makes copies, Shift keeps a multiple of 45°, Ctrl disables snapping."""

    cursor_shape: CursorShape | None = "move"

    def __init__(self, context: EditorContext, selection: Selection, start: Point) -> None:
        super().__init__(context, selection, start)
        points: list[Point] = []
        for owner in selection.owners:
            points += [position for _, position in list_vertices(context.sketch, owner)]
        self._points = points[:: max(1, len(points) // _MIN_SNAPPED_POINTS)]
        self._drags_image = len(points) > MANY_POINTS
        self._offset = (0.0, 0.0)
        self._copies = False

    @property
    def dragged_image(self) -> DraggedImage | None:
        """Objects that are dragged as an image, because they have many vertices; otherwise None."""
        if not self._drags_image:
            return None
        return DraggedImage(self.selection, self._offset, self._copies)

    def update(self, event: EditorPointerEvent) -> None:
        """Update the drag after a move of the pointer."""
        self._copies = event.alt
        self.guides = ()
        end = event.unsnapped_point
        if event.shift:
            end = constrain_angle(self._start, event.unsnapped_point)
        dx = end[0] - self._start[0]
        dy = end[1] - self._start[1]
        context = self.context
        targets = context.snapper.find_targets(context.sketch, self.selection.owners)
        if targets is not None and not event.ctrl and not event.shift:
            snap = snap_move(self._points, dx, dy, targets, context.build_snap_settings(event.reach))
            self.guides = snap.guides
            dx, dy = snap.point
        self._move(dx, dy)

    def _move(self, dx: float, dy: float) -> None:
        self._end = (self._start[0] + dx, self._start[1] + dy)
        if self._drags_image:
            self._offset = (dx, dy)
        else:
            self.change = self._build_change(dx, dy)
        length = geometry.format_length(math.hypot(dx, dy))
        self.label = f"{geometry.format_shift(dx, dy)}   {length}"

    def _build_change(self, dx: float, dy: float) -> Change | None:
        if not dx and not dy:
            return None
        if self._copies:
            return transform.duplicate(self.context.sketch, self.selection, dx, dy)
        return transform.move(self.context.sketch, self.selection, dx, dy)

    def end(self) -> None:
        """Apply the change, if there is one."""
        if self._drags_image:
            self.change = self._build_change(*self._offset)
        super().end()

    def enter_text(self, text: str) -> None:
        """Move by a typed length toward the cursor, or by a displacement such as ``0.5 -2`` or ``2<45``."""
        text = text.strip()
        has_two_values = len(text.split()) > 1 or "<" in text or ";" in text
        if has_two_values and text[0] not in "@+":
            text = f"@{text}"
        end = parse_next_point(text, self._start, self._end)
        self._move(end[0] - self._start[0], end[1] - self._start[1])


class VertexDrag(Drag):
    """Moves a vertex together with the selected ones. Shift constrains the angle of the edge before it."""

    def __init__(self, context: EditorContext, vertex: Vertex, selection: Selection) -> None:
        dragged = Selection(vertices=selection.vertices | {vertex})
        super().__init__(context, dragged, find_position(context.sketch, vertex))
        self._origin = self._find_origin(vertex)

    def _find_origin(self, vertex: Vertex) -> Point | None:
        """Return the previous vertex of the ring, m; for the first vertex of a wall, the next one.

        None for circles and starts, which have no edges.
        """
        rings = self.context.sketch.list_rings(vertex.owner)
        if vertex.ring >= len(rings):
            return None
        _, points, is_closed = rings[vertex.ring]
        if vertex.index == 0 and not is_closed:
            return points[min(1, len(points) - 1)]
        return points[vertex.index - 1]

    def update(self, event: EditorPointerEvent) -> None:
        """Update the drag after a move of the pointer."""
        if event.shift and self._origin is not None:
            self.guides = ()
            self._place(constrain_angle(self._origin, event.unsnapped_point))
        else:
            self._place(self._snap(event, event.unsnapped_point, self._origin))

    def _place(self, position: Point) -> None:
        self._end = position
        dx = position[0] - self._start[0]
        dy = position[1] - self._start[1]
        self.change = None
        if dx or dy:
            self.change = vertices.move_vertices(self.context.sketch, self.selection, dx, dy)
        self.label = geometry.format_point(position)
        if self._origin is not None:
            self.label += f"   {geometry.format_bearing(self._origin, position)}"

    def enter_text(self, text: str) -> None:
        """Move the vertex to a typed position, or by a length toward the cursor."""
        self._place(parse_next_point(text, self._origin or self._start, self._end))


class RotateDrag(Drag):
    """Rotates objects about the center of their box, with Shift in steps of 15°, with Ctrl freely."""

    def __init__(self, context: EditorContext, selection: Selection, start: Point) -> None:
        super().__init__(context, selection, start)
        bounds = compute_bounds(context.sketch, selection) or (0.0, 0.0, 0.0, 0.0)
        self._center = geometry.compute_center(bounds)
        self._start_angle = compute_bearing(self._center, start)

    def update(self, event: EditorPointerEvent) -> None:
        """Update the drag after a move of the pointer."""
        bearing = compute_bearing(self._center, event.unsnapped_point)
        # Between -180 and 180 degrees.
        degrees = (bearing - self._start_angle + 180.0) % 360.0 - 180.0
        if event.shift:
            degrees = geometry.SHIFT_ROTATION_DEG * round(degrees / geometry.SHIFT_ROTATION_DEG)
        elif not event.ctrl:
            degrees = snap_angle(degrees, self.context.snap_angle)
        self._rotate(degrees)

    def _rotate(self, degrees: float) -> None:
        self.label = f"{degrees + 0.0:.1f}".removesuffix(".0") + "°"
        self.change = None
        if degrees:
            self.change = transform.rotate(self.context.sketch, self.selection, degrees, self._center)

    def enter_text(self, text: str) -> None:
        """Rotate by a typed angle."""
        self._rotate(parse_angle(text))


class ScaleDrag(Drag):
    """Scales objects by a handle of their frame. Shift keeps the proportions, Alt scales about the center."""

    def __init__(self, context: EditorContext, selection: Selection, handle: Handle) -> None:
        super().__init__(context, selection, handle.position)
        self._side = handle.side
        self._bounds = compute_bounds(context.sketch, selection) or (0.0, 0.0, 1.0, 1.0)
        self._grip = compute_side_position(self._bounds, self._side)
        self._fixed = compute_side_position(self._bounds, (-self._side[0], -self._side[1]))
        # The handle is on the frame, which is outside the bounding box.
        self._margin = (handle.position[0] - self._grip[0], handle.position[1] - self._grip[1])
        # Circles and starts must be scaled equally in both directions, because ellipses are not supported.
        shapes = {type(item.shape) for item in selection.list_items(context.sketch)}
        self._keeps_proportion = bool(selection.starts) or shapes == {CircleObstacle}

    def update(self, event: EditorPointerEvent) -> None:
        """Update the drag after a move of the pointer."""
        pointer = (event.unsnapped_point[0] - self._margin[0], event.unsnapped_point[1] - self._margin[1])
        position = self._snap(event, pointer)
        center = self._fixed
        if event.alt:
            center = geometry.compute_center(self._bounds)
        factors = [1.0, 1.0]
        for axis in (0, 1):
            if self._side[axis] and abs(self._grip[axis] - center[axis]) > NO_MOVE_M:
                factors[axis] = (position[axis] - center[axis]) / (self._grip[axis] - center[axis])
        if event.shift or self._keeps_proportion:
            factor = max(factors, key=lambda factor: abs(factor - 1.0))
            factors = [factor, factor]
        self._scale(factors[0], factors[1], center)

    def _scale(self, factor_x: float, factor_y: float, center: Point) -> None:
        """Scale by factors along x and y about a point, m, and show the new size next to the cursor."""
        width = self._bounds[2] - self._bounds[0]
        height = self._bounds[3] - self._bounds[1]
        factor_x = _limit_factor(factor_x, width)
        factor_y = _limit_factor(factor_y, height)
        is_unchanged = max(abs(factor_x - 1.0), abs(factor_y - 1.0)) < _UNIT_TOLERANCE
        self.change = None
        if not is_unchanged:
            self.change = transform.scale(self.context.sketch, self.selection, factor_x, factor_y, center)
        percent = f"{100 * factor_x:.0f}%"
        if abs(factor_x - factor_y) >= _FACTOR_TOLERANCE:
            percent += f" x {100 * factor_y:.0f}%"
        new_width = geometry.format_length(abs(width * factor_x))
        new_height = geometry.format_length(abs(height * factor_y))
        self.label = f"{new_width} x {new_height}   {percent}"

    def enter_text(self, text: str) -> None:
        """Scale to a typed width or height."""
        # The text is the width, unless only the height changes with this handle.
        axis = 0 if self._side[0] else 1
        length = self._bounds[2 + axis] - self._bounds[axis]
        name = ("width", "height")[axis]
        require(length > NO_MOVE_M, f"the selection has no {name} that can be scaled")
        factor = parse_length(text, now=length) / length
        require(factor > 0.0, f"“{text}”: expected a size above 0")
        factors = [1.0, 1.0]
        factors[axis] = factor
        if self._keeps_proportion or (self._side[0] and self._side[1]):
            factors = [factor, factor]
        self._scale(factors[0], factors[1], self._fixed)


def _limit_factor(factor: float, length: float) -> float:
    """Limit a factor so that it does not shrink a length, m, below the minimum size."""
    min_factor = MIN_SIZE_M / max(length, MIN_SIZE_M)
    if abs(factor) < min_factor:
        return min_factor
    return factor


class BoxDrag(Drag):
    """Selects the objects in a box; if it is dragged to the left, also those that are only partly inside."""

    def __init__(self, context: EditorContext, start: Point, *, adds: bool) -> None:
        super().__init__(context, Selection(), start)
        self._adds = adds
        self._previous = Selection()
        if adds:
            self._previous = context.selection

    @property
    def _selects_partial(self) -> bool:
        return self._end[0] < self._start[0]

    def update(self, event: EditorPointerEvent) -> None:
        """Update the drag after a move of the pointer."""
        self._end = event.unsnapped_point

    def find_selection(self) -> Selection:
        """Return the objects in the box, or the vertices in it if it contains only some of the shown ones."""
        sketch = self.context.sketch
        owners = self.context.vertex_owners
        inside = find_in_box(sketch, self._start, self._end, includes_partial=self._selects_partial)
        inside = inside.with_groups(sketch)
        has_other_objects = bool((inside.items | inside.starts) - set(owners))
        if owners and not self._adds and not has_other_objects:
            selected = find_vertices_in_box(sketch, self._start, self._end, owners)
            shown = sum(len(list_vertices(sketch, owner)) for owner in owners)
            if 0 < len(selected.vertices) < shown:
                return selected
        return inside

    def end(self) -> None:
        """Select the objects or vertices in the box."""
        if self._start != self._end:
            self.context.select(self._previous.union(self.find_selection()))

    def build_overlay(self) -> EditorToolOverlay:
        """Return the box for drawing."""
        box = (self._start, self._end)
        return EditorToolOverlay(box=box, box_selects_partial=self._selects_partial, shows_handles=True)
