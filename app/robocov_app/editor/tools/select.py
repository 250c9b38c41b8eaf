"""The tool that selects and drags, and the one that moves the view."""

import numpy as np

from robocov.environment import CircleObstacle, Point
from robocov.errors import MapError
from robocov_app.editor.edits import transform, vertices
from robocov_app.editor.edits.transform import bounds_of
from robocov_app.editor.model import geometry
from robocov_app.editor.model.coordinates import angle_of, length_of, next_point_of
from robocov_app.editor.model.hit_test import edge_at, in_box, owners_at, vertices_in_box
from robocov_app.editor.model.selection import Change, Selection, Vertex, place_of, points_of, rings_of
from robocov_app.editor.model.sketch import Owner
from robocov_app.editor.tools.snapping import Guide, snapped, snapped_angle, snapped_move
from robocov_app.editor.tools.tool import Handle, PointerEvent, Preview, Tool, Workspace, handle_at

MANY_POINTS = 1000  # points of what is moved from which on it is moved as a picture
SAME = 1e-9  # metres below which nothing has moved
FEW_POINTS = 60  # points of what is moved that may snap; of more, a choice of them
NEAR = 0.6  # part of a finger's width within which something is taken hold of
ON_EDGE = 1e-5  # metres within which a point lies on an edge

_CURSORS = {
    **dict.fromkeys(((-1, 0), (1, 0)), "sideways"),
    **dict.fromkeys(((0, -1), (0, 1)), "updown"),
    **dict.fromkeys(((-1, -1), (1, 1)), "rising"),
    **dict.fromkeys(((-1, 1), (1, -1)), "falling"),
}
"""Cursors over scale handles, by their sides."""


class Drag:
    """Something that is dragged: each move gives the change that letting go would make."""

    def __init__(self) -> None:
        self.change: Change | None = None
        self.guides: tuple[Guide, ...] = ()
        self.words = ""  # beside the cursor

    def to(self, context: Workspace, event: PointerEvent) -> None:
        """Follow the mouse."""

    def enter(self, context: Workspace, text: str) -> None:
        raise MapError(f"“{text}”: there is nothing to type here")

    def preview(self) -> Preview:
        return Preview(words=self.words)

    def ended(self, context: Workspace) -> None:
        if self.change is not None:
            context.change(self.change)

    def snapped_to(
        self,
        context: Workspace,
        event: PointerEvent,
        to: Point,
        dragged: Selection,
        origin: Point | None = None,
    ) -> Point:
        """Return where a place snaps to anything but what is dragged, unless Ctrl is held down."""
        without = dragged.vertices or dragged.owners
        targets = None if event.ctrl else context.snapper.targets(context.sketch, without)
        if targets is None:
            return to
        snap = snapped(to, targets, context.snapping(event.reach), origin)
        self.guides = snap.guides
        return snap.point


class Moving(Drag):
    """Moves whole things, or copies them; by an `offset`, m, where a change in each frame took too long."""

    def __init__(self, context: Workspace, selection: Selection, begun: Point) -> None:
        super().__init__()
        self.moving, self._begun, self._at = selection, begun, begun
        points = [at for owner in selection.owners for _, at in points_of(context.sketch, owner)]
        self._points = points[:: max(1, len(points) // FEW_POINTS)]
        self.offset = (0.0, 0.0) if len(points) > MANY_POINTS else None
        self.copies = False

    def to(self, context: Workspace, event: PointerEvent) -> None:
        """Follow the mouse; with Alt copies move, with Shift at round angles, with Ctrl freely."""
        self.copies = event.alt
        to = geometry.at_round_angle(self._begun, event.raw) if event.shift else event.raw
        dx, dy = to[0] - self._begun[0], to[1] - self._begun[1]
        self.guides = ()
        if not event.ctrl and not event.shift:
            targets = context.snapper.targets(context.sketch, self.moving.owners)
            if targets is not None:
                snap = snapped_move(self._points, dx, dy, targets, context.snapping(event.reach))
                self.guides = snap.guides
                dx, dy = self._on_grid(context, (dx, dy), snap.point)
        self._move(context, dx, dy)

    def _on_grid(self, context: Workspace, free: Point, snapped_to: Point) -> Point:
        """Return the move, with the grid along an axis that nothing else counts for."""
        by = list(snapped_to)
        for axis in (0, 1):
            if "grid" in context.snaps and abs(by[axis] - free[axis]) < SAME and self._points:
                first = self._points[0][axis]
                by[axis] = context.grid * round((first + by[axis]) / context.grid) - first
        return by[0], by[1]

    def _move(self, context: Workspace, dx: float, dy: float) -> None:
        self._at = self._begun[0] + dx, self._begun[1] + dy
        if self.offset is None:
            self.change = self._made(context, dx, dy)
        else:
            self.offset = (dx, dy)
        far = geometry.length_words(float(np.hypot(dx, dy)))
        self.words = f"Δx {dx + 0.0:.2f}  Δy {dy + 0.0:.2f}   {far}"

    def _made(self, context: Workspace, dx: float, dy: float) -> Change | None:
        act = transform.duplicated if self.copies else transform.moved
        still = dx == 0.0 and dy == 0.0
        return None if still else act(context.sketch, self.moving, dx, dy)

    def ended(self, context: Workspace) -> None:
        if self.offset is not None:
            self.change = self._made(context, *self.offset)
        super().ended(context)

    def enter(self, context: Workspace, text: str) -> None:
        """Move by a length towards the cursor, or by what was typed: ``0.5 -2`` or ``2<45``."""
        text = text.strip()
        two = len(text.split()) > 1 or "<" in text or ";" in text
        if two and text[0] not in "@+":
            text = f"@{text}"
        to = next_point_of(text, self._begun, self._at)
        self._move(context, to[0] - self._begun[0], to[1] - self._begun[1])


class MovingVertices(Drag):
    """Moves single vertices: the one that was taken, and those that are selected with it."""

    def __init__(self, context: Workspace, taken: Vertex, selection: Selection) -> None:
        super().__init__()
        self._selection = Selection(vertices=selection.vertices | {taken})
        self._begun = self._at = place_of(context.sketch, taken)
        self._origin = _neighbour(context, taken)

    def to(self, context: Workspace, event: PointerEvent) -> None:
        """Follow the mouse; with Shift at a round angle from the vertex before, with Ctrl freely."""
        self.guides = ()
        if event.shift and self._origin is not None:
            self._put(context, geometry.at_round_angle(self._origin, event.raw))
        else:
            self._put(context, self.snapped_to(context, event, event.raw, self._selection, self._origin))

    def _put(self, context: Workspace, to: Point) -> None:
        self._at = to
        dx, dy = to[0] - self._begun[0], to[1] - self._begun[1]
        still = dx == 0.0 and dy == 0.0
        self.change = None if still else vertices.moved(context.sketch, self._selection, dx, dy)
        self.words = geometry.point_words(to)
        if self._origin is not None:
            self.words += f"   {geometry.bearing_words(self._origin, to)}"

    def enter(self, context: Workspace, text: str) -> None:
        self._put(context, next_point_of(text, self._origin or self._begun, self._at))


def _neighbour(context: Workspace, vertex: Vertex) -> Point | None:
    """Return the vertex before one on its ring, or after a wall's first; None of circles and starts."""
    for ring, points, closed in rings_of(context.sketch, vertex.of):
        if ring == vertex.ring:
            before = vertex.index - 1
            return points[before if before >= 0 or closed else min(1, len(points) - 1)]
    return None


class Turning(Drag):
    """Turns whole things about the middle of their box."""

    def __init__(self, context: Workspace, selection: Selection, begun: Point) -> None:
        super().__init__()
        low_x, low_y, high_x, high_y = bounds_of(context.sketch, selection) or (0.0, 0.0, 0.0, 0.0)
        self.about = (low_x + high_x) / 2, (low_y + high_y) / 2
        self._selection, self._from = selection, self._angle(begun)

    def _angle(self, point: Point) -> float:
        return float(np.degrees(np.arctan2(point[1] - self.about[1], point[0] - self.about[0])))

    def to(self, context: Workspace, event: PointerEvent) -> None:
        """Follow the mouse; with Shift in steps, with Ctrl freely."""
        degrees = (self._angle(event.raw) - self._from + 180.0) % 360.0 - 180.0
        if event.shift:
            degrees = geometry.ANGLE * round(degrees / geometry.ANGLE)
        elif not event.ctrl:
            degrees = snapped_angle(degrees, context.snap_angle)
        self._turn(context, degrees)

    def _turn(self, context: Workspace, degrees: float) -> None:
        self.words = f"{degrees + 0.0:.1f}".removesuffix(".0") + "°"
        turned = transform.rotated(context.sketch, self._selection, degrees, self.about) if degrees else None
        self.change = turned

    def enter(self, context: Workspace, text: str) -> None:
        self._turn(context, angle_of(text))


class Scaling(Drag):
    """Scales whole things by a corner or a side of their box; the opposite one stays."""

    def __init__(self, context: Workspace, selection: Selection, handle: Handle) -> None:
        super().__init__()
        self._selection, self._side = selection, handle.side
        self._bounds = bounds_of(context.sketch, selection) or (0.0, 0.0, 1.0, 1.0)
        taken = self._edge(1)
        self._offset = handle.at[0] - taken[0], handle.at[1] - taken[1]
        shapes = [context.sketch.item(key).shape for key in selection.items]
        # a circle that is stretched would be a circle no more
        round_ones = bool(shapes) and all(isinstance(each, CircleObstacle) for each in shapes)
        self._even = bool(selection.starts) or round_ones

    def _edge(self, which: int) -> Point:
        """Return the corner or the middle of the side that is dragged (1), or of the one that stays (-1)."""
        x, y = which * self._side[0], which * self._side[1]
        low_x, low_y, high_x, high_y = self._bounds
        return (low_x + high_x + x * (high_x - low_x)) / 2, (low_y + high_y + y * (high_y - low_y)) / 2

    def to(self, context: Workspace, event: PointerEvent) -> None:
        """Follow the mouse; with Shift in proportion, with Alt about the middle, with Ctrl freely."""
        self.guides = ()
        to = event.raw[0] - self._offset[0], event.raw[1] - self._offset[1]
        to = self.snapped_to(context, event, to, self._selection)
        low_x, low_y, high_x, high_y = self._bounds
        about = ((low_x + high_x) / 2, (low_y + high_y) / 2) if event.alt else self._edge(-1)
        taken = self._edge(1)
        fx, fy = (
            (to[k] - about[k]) / (taken[k] - about[k])
            if self._side[k] and abs(taken[k] - about[k]) > SAME
            else 1.0
            for k in (0, 1)
        )
        if event.shift or self._even:
            whole = [f for f, side in ((fx, self._side[0]), (fy, self._side[1])) if side]
            fx = fy = max(whole, key=lambda f: abs(f - 1.0))
        self._scale(context, fx, fy, about)

    def _scale(self, context: Workspace, fx: float, fy: float, about: Point) -> None:
        wide, high = self._bounds[2] - self._bounds[0], self._bounds[3] - self._bounds[1]
        fx, fy = (
            f if abs(f) * max(size, 1e-3) >= 1e-3 else 1e-3 / max(size, 1e-3)
            for f, size in ((fx, wide), (fy, high))
        )
        same = abs(fx - 1.0) < 1e-12 and abs(fy - 1.0) < 1e-12
        self.change = None if same else transform.scaled(context.sketch, self._selection, fx, fy, about)
        factor = f"{100 * fx:.0f} %" if abs(fx - fy) < 1e-9 else f"{100 * fx:.0f} % x {100 * fy:.0f} %"
        sides = [geometry.length_words(abs(side)) for side in (wide * fx, high * fy)]
        self.words = f"{sides[0]} x {sides[1]}   {factor}"

    def enter(self, context: Workspace, text: str) -> None:
        axis = 0 if self._side[0] else 1
        now = self._bounds[2 + axis] - self._bounds[axis]
        factor = length_of(text, now=now) / now
        if factor <= 0.0:
            raise MapError(f"“{text}”: a size above 0 was wanted")
        both = self._even or (self._side[0] and self._side[1])
        fx, fy = (factor if both or axis == k else 1.0 for k in (0, 1))
        self._scale(context, fx, fy, self._edge(-1))


class Box(Drag):
    """Selects what lies in a box; drawn to the left also what it touches."""

    def __init__(self, context: Workspace, begun: Point, *, adds: bool) -> None:
        super().__init__()
        self._begun = self._at = begun
        self._before = context.selection if adds else Selection()
        self._adds = adds

    def to(self, context: Workspace, event: PointerEvent) -> None:
        self._at = event.raw

    def found(self, context: Workspace) -> Selection:
        """Return what is in the box: whole things, or vertices where it holds some that are shown."""
        sketch, shown = context.sketch, context.handled
        inside = in_box(sketch, self._begun, self._at, touched=self._leftwards).with_groups(sketch)
        if shown and not self._adds and not (inside.items | inside.starts) - set(shown):
            single = vertices_in_box(sketch, self._begun, self._at, shown)
            if single.vertices and len(single.vertices) < sum(len(points_of(sketch, each)) for each in shown):
                return single
        return inside

    @property
    def _leftwards(self) -> bool:
        return self._at[0] < self._begun[0]

    def ended(self, context: Workspace) -> None:
        if geometry.distance(self._begun, self._at) > 0.0:
            context.select(self._before.plus(self.found(context)))

    def preview(self) -> Preview:
        return Preview(box=(self._begun, self._at), touched=self._leftwards)


class SelectTool(Tool):
    """Selects, and drags what is selected: whole, by its vertices, or by the box around it."""

    name = "select"
    title = "Select"
    hint = "click or drag a box; drag to move, Alt-drag to copy; double click on an edge inserts a vertex"
    snaps = False

    def __init__(self) -> None:
        super().__init__()
        self.hovered: Owner | None = None
        self.near: Handle | None = None
        self.drag: Drag | None = None
        self._pressed: PointerEvent | None = None
        self._handle: Handle | None = None
        self._narrows = False
        self._gone = False

    @property
    def busy(self) -> bool:
        return self.drag is not None

    def press(self, context: Workspace, event: PointerEvent) -> None:
        self._pressed, self.drag, self._narrows, self._gone = event, None, False, False
        self._handle = handle_at(context.handles, event.raw, NEAR * event.reach)
        vertex = self._handle.vertex if self._handle is not None else None
        if vertex is not None:
            own = Selection(vertices=frozenset({vertex}))
            if event.shift:
                context.select(Selection(vertices=context.selection.vertices).toggled(own))
            elif vertex not in context.selection.vertices:
                context.select(own)
        if self._handle is not None:  # those of the box wait to be dragged
            return
        found = owners_at(context.sketch, event.raw, 0.5 * event.reach)
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
        if self._pressed is None:
            self.near = handle_at(context.handles, event.raw, NEAR * event.reach)
            found = () if self.near else owners_at(context.sketch, event.raw, 0.5 * event.reach)
            self.hovered = found[0] if found else None
            return
        if self._gone:
            return
        if self.drag is None and geometry.distance(event.raw, self._pressed.raw) > 0.25 * event.reach:
            self.drag = self._begun(context, self._pressed)
        if self.drag is not None:
            self.drag.to(context, event)
            self.guides = self.drag.guides

    def _begun(self, context: Workspace, pressed: PointerEvent) -> Drag:
        handle, whole = self._handle, context.selection.without_vertices()
        if handle is not None and handle.vertex is not None:
            return MovingVertices(context, handle.vertex, context.selection)
        if handle is not None and handle.kind == "turn":
            return Turning(context, whole, pressed.raw)
        if handle is not None:
            return Scaling(context, whole, handle)
        found = owners_at(context.sketch, pressed.raw, 0.5 * pressed.reach)
        if any(each in whole.owners for each in found):
            return Moving(context, whole, pressed.raw)
        return Box(context, pressed.raw, adds=pressed.shift)

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        """Do what was dragged; a click selects one of what is selected, and again what lies below."""
        pressed, drag, gone = self._pressed, self.drag, self._gone
        self._pressed, self.drag, self.guides = None, None, ()
        if gone or pressed is None:
            return
        if drag is not None:
            drag.to(context, event)
            drag.ended(context)
        elif self._handle is None and not event.shift:
            found = owners_at(context.sketch, pressed.raw, 0.5 * pressed.reach)
            if not found:
                context.select(Selection())
            elif self._narrows and len(chosen := context.selection.owners) > 1:
                context.select(Selection.of(next(each for each in found if each in chosen)))
            elif self._narrows and len(found) > 1:
                (one,) = chosen
                context.select(Selection.of(found[(found.index(one) + 1) % len(found)]))

    def twice(self, context: Workspace, event: PointerEvent) -> None:
        """Insert a vertex where the edge of something was clicked twice; elsewhere it is one more press."""
        owners = context.handled or owners_at(context.sketch, event.raw, 0.5 * event.reach)[:1]
        edge = edge_at(context.sketch, event.raw, NEAR * event.reach, owners)
        if edge is None or handle_at(context.handles, event.raw, NEAR * event.reach) is not None:
            self.press(context, event)
            return
        self._pressed, self.drag, self._gone = event, None, True
        if not event.ctrl:
            # on the edge, but at a round place
            to = context.snapped(edge.point, event.reach).point
            edge = edge_at(context.sketch, to, ON_EDGE, [edge.of]) or edge
        context.change(vertices.inserted(context.sketch, edge))

    def enter(self, context: Workspace, text: str) -> None:
        drag = self.drag
        if drag is None:
            super().enter(context, text)
            return
        drag.enter(context, text)
        self.drag, self._gone, self.guides = None, True, ()
        drag.ended(context)

    def cancel(self, context: Workspace) -> bool:
        """Give up what is dragged; then select nothing."""
        had = bool(self.drag or context.selection)
        if self.drag is not None:
            self.drag, self._gone, self.guides = None, True, ()
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


class PanTool(Tool):
    """Moves the view; the window does it, since cameras are its own."""

    name = "pan"
    title = "Pan"
    hint = "drag the sheet; the right button does so with every tool, and Space while it is held down"
    snaps = False
    takes_numbers = False

    def shape_of_cursor(self, context: Workspace) -> str:
        return "move"
