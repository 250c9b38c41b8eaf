"""The tool that selects and drags, and the one that moves the view."""

import math

from robocov.environment import CircleObstacle, Point
from robocov.errors import MapError
from robocov_app.editor.edits import transform, vertices
from robocov_app.editor.edits.transform import bounds_of
from robocov_app.editor.model import geometry, require
from robocov_app.editor.model.coordinates import angle_of, length_of, next_point_of
from robocov_app.editor.model.hit_test import edge_at, in_box, owners_at, vertices_in_box
from robocov_app.editor.model.selection import Change, Selection, Vertex, place_of, points_of
from robocov_app.editor.model.sketch import Owner
from robocov_app.editor.tools.snapping import Guide, Snap, snapped_angle, snapped_move
from robocov_app.editor.tools.tool import Handle, PointerEvent, Preview, Tool, Workspace, handle_at, side_of

MANY_POINTS = 1000  # points of what is moved from which on it is moved as a picture
SAME = 1e-9  # metres below which nothing has moved
FEW_POINTS = 60  # points of what is moved that may snap; of more, a choice of them
NEAR = 0.6  # part of a finger's width within which something is taken hold of
ON_EDGE = 1e-5  # metres within which a point lies on an edge
# over scale handles, by their sides
_CURSORS = {(1, 0): "sideways", (0, 1): "updown", (1, 1): "rising", (-1, 1): "falling"}
_CURSORS |= {(-x, -y): shape for (x, y), shape in _CURSORS.items()}


class Drag:
    """Something that is dragged: each move gives the change that letting go would make."""

    def __init__(self, context: Workspace, moving: Selection, begun: Point) -> None:
        self.context, self.moving = context, moving
        self._begun = self._at = begun
        self.change: Change | None = None
        self.guides: tuple[Guide, ...] = ()
        self.words = ""  # beside the cursor

    def to(self, event: PointerEvent) -> None:
        """Follow the mouse."""

    def enter(self, text: str) -> None:
        raise MapError(f"“{text}”: there is nothing to type here")

    def preview(self) -> Preview:
        return Preview(words=self.words)

    def ended(self) -> None:
        if self.change is not None:
            self.context.change(self.change)

    def snapped_to(self, event: PointerEvent, to: Point, origin: Point | None = None) -> Point:
        """Return where a place snaps to anything but what is dragged, unless Ctrl is held down."""
        dragged = self.moving.vertices or self.moving.owners
        snap = Snap(to) if event.ctrl else self.context.snapped(to, event.reach, origin, without=dragged)
        self.guides = snap.guides
        return snap.point


class Moving(Drag):
    """Moves things, with Alt copies; at round angles with Shift, freely with Ctrl; many by an `offset`, m."""

    def __init__(self, context: Workspace, selection: Selection, begun: Point) -> None:
        super().__init__(context, selection, begun)
        points = [at for owner in selection.owners for _, at in points_of(context.sketch, owner)]
        self._points = points[:: max(1, len(points) // FEW_POINTS)]
        self.offset = (0.0, 0.0) if len(points) > MANY_POINTS else None
        self.copies = False

    def to(self, event: PointerEvent) -> None:
        self.copies, self.guides = event.alt, ()
        to = geometry.at_round_angle(self._begun, event.raw) if event.shift else event.raw
        by = [to[0] - self._begun[0], to[1] - self._begun[1]]
        targets = self.context.snapper.targets(self.context.sketch, self.moving.owners)
        if targets is not None and not (event.ctrl or event.shift):
            snap = snapped_move(self._points, by[0], by[1], targets, self.context.snapping(event.reach))
            self.guides = snap.guides
            for axis in (0, 1):
                alone = abs(snap.point[axis] - by[axis]) < SAME  # nothing else counts along this axis
                by[axis] = snap.point[axis]
                if alone and "grid" in self.context.snaps and self._points:
                    first = self._points[0][axis]
                    by[axis] = self.context.grid * round((first + by[axis]) / self.context.grid) - first
        self._move(*by)

    def _move(self, dx: float, dy: float) -> None:
        self._at = self._begun[0] + dx, self._begun[1] + dy
        if self.offset is None:
            self.change = self._made(dx, dy)
        else:
            self.offset = (dx, dy)
        self.words = f"Δx {dx + 0.0:.2f}  Δy {dy + 0.0:.2f}   {geometry.length_words(math.hypot(dx, dy))}"

    def _made(self, dx: float, dy: float) -> Change | None:
        act = transform.duplicated if self.copies else transform.moved
        return act(self.context.sketch, self.moving, dx, dy) if dx or dy else None

    def ended(self) -> None:
        if self.offset is not None:
            self.change = self._made(*self.offset)
        super().ended()

    def enter(self, text: str) -> None:
        """Move by a length towards the cursor, or by what was typed: ``0.5 -2`` or ``2<45``."""
        text = text.strip()
        two = len(text.split()) > 1 or "<" in text or ";" in text
        to = next_point_of(f"@{text}" if two and text[0] not in "@+" else text, self._begun, self._at)
        self._move(to[0] - self._begun[0], to[1] - self._begun[1])


class MovingVertices(Drag):
    """Moves the taken vertex and the selected ones; with Shift at a round angle from the one before it."""

    def __init__(self, context: Workspace, taken: Vertex, selection: Selection) -> None:
        dragged = Selection(vertices=selection.vertices | {taken})
        super().__init__(context, dragged, place_of(context.sketch, taken))
        # the vertex before it on its ring, or after a wall's first; None of circles and starts
        self._origin: Point | None = None
        for _, points, closed in context.sketch.rings_of(taken.of)[taken.ring : taken.ring + 1]:
            first = taken.index == 0 and not closed
            self._origin = points[min(1, len(points) - 1) if first else taken.index - 1]

    def to(self, event: PointerEvent) -> None:
        if event.shift and self._origin is not None:
            self.guides = ()
            self._put(geometry.at_round_angle(self._origin, event.raw))
        else:
            self._put(self.snapped_to(event, event.raw, self._origin))

    def _put(self, to: Point) -> None:
        self._at = to
        dx, dy = to[0] - self._begun[0], to[1] - self._begun[1]
        self.change = vertices.moved(self.context.sketch, self.moving, dx, dy) if dx or dy else None
        self.words = geometry.point_words(to)
        if self._origin is not None:
            self.words += f"   {geometry.bearing_words(self._origin, to)}"

    def enter(self, text: str) -> None:
        self._put(next_point_of(text, self._origin or self._begun, self._at))


class Turning(Drag):
    """Turns whole things about the middle of their box; with Shift in steps, with Ctrl freely."""

    def __init__(self, context: Workspace, selection: Selection, begun: Point) -> None:
        super().__init__(context, selection, begun)
        self.about = geometry.middle_of(bounds_of(context.sketch, selection) or (0.0, 0.0, 0.0, 0.0))
        self._from = geometry.bearing(self.about, begun)

    def to(self, event: PointerEvent) -> None:
        degrees = (geometry.bearing(self.about, event.raw) - self._from + 180.0) % 360.0 - 180.0
        if event.shift:
            degrees = geometry.ANGLE * round(degrees / geometry.ANGLE)
        elif not event.ctrl:
            degrees = snapped_angle(degrees, self.context.snap_angle)
        self._turn(degrees)

    def _turn(self, degrees: float) -> None:
        self.words = f"{degrees + 0.0:.1f}".removesuffix(".0") + "°"
        sketch = self.context.sketch
        self.change = transform.rotated(sketch, self.moving, degrees, self.about) if degrees else None

    def enter(self, text: str) -> None:
        self._turn(angle_of(text))


class Scaling(Drag):
    """Scales things by a corner or side of their box; in proportion with Shift, about its middle with Alt."""

    def __init__(self, context: Workspace, selection: Selection, handle: Handle) -> None:
        super().__init__(context, selection, handle.at)
        self._side = handle.side
        self._bounds = bounds_of(context.sketch, selection) or (0.0, 0.0, 1.0, 1.0)
        self._taken = side_of(self._bounds, self._side)
        self._fixed = side_of(self._bounds, (-self._side[0], -self._side[1]))
        self._offset = handle.at[0] - self._taken[0], handle.at[1] - self._taken[1]
        # a circle that is stretched would be a circle no more
        shapes = {type(item.shape) for item in selection.items_in(context.sketch)}
        self._even = bool(selection.starts) or shapes == {CircleObstacle}

    def to(self, event: PointerEvent) -> None:
        to = self.snapped_to(event, (event.raw[0] - self._offset[0], event.raw[1] - self._offset[1]))
        about = geometry.middle_of(self._bounds) if event.alt else self._fixed
        factors = [1.0, 1.0]
        for k in (0, 1):
            if self._side[k] and abs(self._taken[k] - about[k]) > SAME:
                factors[k] = (to[k] - about[k]) / (self._taken[k] - about[k])
        if event.shift or self._even:
            factors = 2 * [max(factors, key=lambda factor: abs(factor - 1.0))]
        self._scale(factors[0], factors[1], about)

    def _scale(self, fx: float, fy: float, about: Point) -> None:
        wide, high = self._bounds[2] - self._bounds[0], self._bounds[3] - self._bounds[1]
        least = [1e-3 / max(size, 1e-3) for size in (wide, high)]
        fx, fy = (f if abs(f) >= low else low for f, low in zip((fx, fy), least, strict=True))
        same = abs(fx - 1.0) < 1e-12 and abs(fy - 1.0) < 1e-12
        self.change = None if same else transform.scaled(self.context.sketch, self.moving, fx, fy, about)
        factor = f"{100 * fx:.0f} %" if abs(fx - fy) < 1e-9 else f"{100 * fx:.0f} % x {100 * fy:.0f} %"
        sides = [geometry.length_words(abs(side)) for side in (wide * fx, high * fy)]
        self.words = f"{sides[0]} x {sides[1]}   {factor}"

    def enter(self, text: str) -> None:
        axis = 0 if self._side[0] else 1
        now = self._bounds[2 + axis] - self._bounds[axis]
        factor = length_of(text, now=now) / now
        require(factor > 0.0, f"“{text}”: expected a size above 0")
        both = self._even or (self._side[0] and self._side[1])
        fx, fy = (factor if both or axis == k else 1.0 for k in (0, 1))
        self._scale(fx, fy, self._fixed)


class Box(Drag):
    """Selects what lies in a box; drawn to the left also what it touches."""

    def __init__(self, context: Workspace, begun: Point, *, adds: bool) -> None:
        super().__init__(context, Selection(), begun)
        self._before, self._adds = context.selection if adds else Selection(), adds

    def to(self, event: PointerEvent) -> None:
        self._at = event.raw

    def found(self) -> Selection:
        """Return what is in the box: whole things, or vertices where it holds some that are shown."""
        sketch, shown, preview = self.context.sketch, self.context.handled, self.preview()
        inside = in_box(sketch, self._begun, self._at, touched=preview.touched).with_groups(sketch)
        if shown and not self._adds and not (inside.items | inside.starts) - set(shown):
            single = vertices_in_box(sketch, self._begun, self._at, shown)
            if 0 < len(single.vertices) < sum(len(points_of(sketch, each)) for each in shown):
                return single
        return inside

    def ended(self) -> None:
        if self._begun != self._at:
            self.context.select(self._before.plus(self.found()))

    def preview(self) -> Preview:
        return Preview(box=(self._begun, self._at), touched=self._at[0] < self._begun[0])


class SelectTool(Tool):
    """Selects, and drags what is selected: whole, by its vertices, or by the box around it."""

    name = "select"
    hint = "click or drag a box; drag to move, Alt-drag to copy; double click on an edge inserts a vertex"
    snaps = False

    def __init__(self) -> None:
        super().__init__()
        self.hovered: Owner | None = None
        self.near: Handle | None = None
        self.drag: Drag | None = None
        self._handle: Handle | None = None
        self._narrows = False

    @property
    def busy(self) -> bool:
        return self.drag is not None

    def press(self, context: Workspace, event: PointerEvent) -> None:
        self.begun, self.drag, self._narrows = event, None, False
        self._handle = handle_at(context.handles, event.raw, NEAR * event.reach)
        vertex = self._handle.vertex if self._handle is not None else None
        if vertex is not None:
            own = Selection(vertices=frozenset({vertex}))
            if event.shift:
                context.select(Selection(vertices=context.selection.vertices).toggled(own))
            elif vertex not in context.selection.vertices:
                context.select(own)
        # handles of the box wait to be dragged
        found = () if self._handle is not None else _owners_at(context, event)
        if not found:
            return
        # what is selected already is meant, also where something else lies above it
        there = next((each for each in found if each in context.selection.owners), None)
        taken = Selection.of(there if there is not None and not event.shift else found[0])
        taken = taken.with_groups(context.sketch)
        if event.shift:
            context.select(context.selection.without_vertices().toggled(taken))
        elif there is None or context.selection.vertices:
            context.select(taken)
        else:
            self._narrows = True

    def move(self, context: Workspace, event: PointerEvent) -> None:
        if self.begun is None:
            self.near = handle_at(context.handles, event.raw, NEAR * event.reach)
            self.hovered = None if self.near else next(iter(_owners_at(context, event)), None)
            return
        if self.drag is None and event.is_apart_from(self.begun.raw):
            self.drag = self._begun(context, self.begun)
        if self.drag is not None:
            self.drag.to(event)
            self.guides = self.drag.guides

    def _begun(self, context: Workspace, pressed: PointerEvent) -> Drag:
        handle, whole = self._handle, context.selection.without_vertices()
        if handle is not None and handle.vertex is not None:
            return MovingVertices(context, handle.vertex, context.selection)
        if handle is not None and handle.kind == "turn":
            return Turning(context, whole, pressed.raw)
        if handle is not None:
            return Scaling(context, whole, handle)
        if any(each in whole.owners for each in _owners_at(context, pressed)):
            return Moving(context, whole, pressed.raw)
        return Box(context, pressed.raw, adds=pressed.shift)

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        """Do what was dragged; a click selects one of what is selected, and again what lies below."""
        pressed, drag = self.begun, self.drag
        self.begun, self.drag, self.guides = None, None, ()
        if drag is not None:
            drag.to(event)
            drag.ended()
        elif pressed is not None and self._handle is None and not event.shift:
            found, chosen = _owners_at(context, pressed), context.selection.owners
            if not found:
                context.select(Selection())
            elif self._narrows and len(chosen) > 1:
                context.select(Selection.of(next(each for each in found if each in chosen)))
            elif self._narrows and len(found) > 1:
                (one,) = chosen
                context.select(Selection.of(found[(found.index(one) + 1) % len(found)]))

    def twice(self, context: Workspace, event: PointerEvent) -> None:
        """Insert a vertex where the edge of something was clicked twice; elsewhere it is one more press."""
        owners = context.handled or _owners_at(context, event)[:1]
        edge = edge_at(context.sketch, event.raw, NEAR * event.reach, owners)
        if edge is None or handle_at(context.handles, event.raw, NEAR * event.reach) is not None:
            self.press(context, event)
            return
        self.begun = self.drag = None
        if not event.ctrl:
            to = context.snapped(edge.point, event.reach).point  # on the edge, but at a round place
            edge = edge_at(context.sketch, to, ON_EDGE, [edge.of]) or edge
        context.change(vertices.inserted(context.sketch, edge))

    def enter(self, context: Workspace, text: str) -> None:
        if (drag := self.drag) is None:
            super().enter(context, text)
            return
        drag.enter(text)
        self.begun, self.drag, self.guides = None, None, ()
        drag.ended()

    def cancel(self, context: Workspace) -> bool:
        had = bool(self.drag or context.selection)
        if self.drag is not None:
            self.begun, self.drag, self.guides = None, None, ()
        elif had:
            context.select(Selection.of(*{vertex.of for vertex in context.selection.vertices}))
        return had

    def preview(self, context: Workspace) -> Preview | None:
        return self.drag.preview() if self.drag is not None else None

    def shape_of_cursor(self, context: Workspace) -> str:
        handle = self._handle if self.drag is not None else self.near
        if isinstance(self.drag, Moving):
            return "move"
        if handle is not None:
            return _CURSORS.get(handle.side, "hand")
        if self.hovered is not None:
            return "move" if self.hovered in context.selection.owners else "hand"
        return "arrow"


def _owners_at(context: Workspace, event: PointerEvent) -> tuple[Owner, ...]:
    return owners_at(context.sketch, event.raw, 0.5 * event.reach)


class PanTool(Tool):
    """Moves the view; the window does it, since cameras are its own."""

    name = "pan"
    hint = "drag the sheet; the right button does so with every tool, and Space while it is held down"
    snaps = False
    takes_numbers = False

    def shape_of_cursor(self, context: Workspace) -> str:
        return "move"
