"""What happens while something is dragged: each move gives the change that letting go would make."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import MapError
from robocov_app.editor.edits import edits, vertices
from robocov_app.editor.edits.edits import bounds_of
from robocov_app.editor.model.coordinates import angle_of, length_of, next_point_of
from robocov_app.editor.model.document import BOUNDARY
from robocov_app.editor.model.selection import Selection, in_box, place_of, points_of, vertices_in_box
from robocov_app.editor.tools.snapping import snapped, snapped_angle, snapped_move
from robocov_app.editor.tools.tool import ANGLE, Preview, apart, bearing_words, length_words, straightened

if TYPE_CHECKING:
    from robocov.environment import Point
    from robocov_app.editor.model.selection import Change, Vertex
    from robocov_app.editor.tools.grips import Grip
    from robocov_app.editor.tools.snapping import Guide
    from robocov_app.editor.tools.tool import Aim
    from robocov_app.editor.ui.desk import Desk

MANY_POINTS = 1000
"""Points of what is moved from which on it is moved as a picture."""

SAME = 1e-9
"""Metres below which nothing has moved."""

FEW_POINTS = 60
"""Points of what is moved that may snap; of more, a choice of them."""


class Drag:
    """Something that is dragged.

    Attributes
    ----------
    change : Change or None
        What letting go would make.
    guides : tuple of Guide
        Why it is where it is.
    words : str
        Beside the cursor.
    """

    def __init__(self) -> None:
        self.change: Change | None = None
        self.guides: tuple[Guide, ...] = ()
        self.words = ""

    def to(self, desk: Desk, aim: Aim) -> None:
        """Follow the mouse."""

    def enter(self, desk: Desk, text: str) -> None:
        """Take what was typed instead.

        Raises
        ------
        MapError
            When it means nothing.
        """
        raise MapError(f"“{text}”: there is nothing to type here")

    def preview(self) -> Preview:
        """Return what to show beside the change."""
        return Preview(words=self.words)

    def ended(self, desk: Desk) -> None:
        """Let go: what was changed is done."""
        if self.change is not None:
            desk.change(self.change)


class Moving(Drag):
    """Moves whole things, or copies them.

    Attributes
    ----------
    moving : Selection
    copies : bool
    offset : (dx, dy) or None, m
        By how much, where it is too much to work the change out in every frame.
    """

    def __init__(self, desk: Desk, selection: Selection, begun: Point) -> None:
        super().__init__()
        self.moving, self._begun, self._at = selection, begun, begun
        points = [at for owner in selection.owners for _, at in points_of(desk.sketch, owner)]
        step = max(1, len(points) // FEW_POINTS)
        self._points = points[::step]
        self.offset = (0.0, 0.0) if len(points) > MANY_POINTS else None
        self.copies = False

    def to(self, desk: Desk, aim: Aim) -> None:
        """Follow the mouse; with Alt copies move, with Shift at round angles, with Ctrl freely."""
        self.copies = aim.alt
        to = straightened(self._begun, aim.raw) if aim.shift else aim.raw
        dx, dy = to[0] - self._begun[0], to[1] - self._begun[1]
        self.guides = ()
        if not aim.ctrl and not aim.shift:
            targets = desk.snapper.targets(desk.sketch, self.moving.owners)
            if targets is not None:
                snap = snapped_move(self._points, dx, dy, targets, desk.snapping(aim.reach))
                self.guides = snap.guides
                dx, dy = self._on_grid(desk, (dx, dy), snap.point)
        self._move(desk, dx, dy)

    def _on_grid(self, desk: Desk, free: Point, snapped_to: Point) -> Point:
        """Return the move, with the grid along an axis that nothing else counts for."""
        by = list(snapped_to)
        for axis in (0, 1):
            if "grid" in desk.snaps and abs(by[axis] - free[axis]) < SAME and self._points:
                first = self._points[0][axis]
                by[axis] = desk.grid * round((first + by[axis]) / desk.grid) - first
        return by[0], by[1]

    def _move(self, desk: Desk, dx: float, dy: float) -> None:
        self._at = self._begun[0] + dx, self._begun[1] + dy
        if self.offset is None:
            self.change = self._made(desk, dx, dy)
        else:
            self.offset = (dx, dy)
        self.words = f"Δx {dx + 0.0:.2f}  Δy {dy + 0.0:.2f}   {length_words(float(np.hypot(dx, dy)))}"

    def _made(self, desk: Desk, dx: float, dy: float) -> Change | None:
        act = edits.duplicated if self.copies else edits.moved
        still = dx == 0.0 and dy == 0.0
        return None if still else act(desk.sketch, self.moving, dx, dy)

    def ended(self, desk: Desk) -> None:
        """Let go."""
        if self.offset is not None:
            self.change = self._made(desk, *self.offset)
        super().ended(desk)

    def enter(self, desk: Desk, text: str) -> None:
        """Move by a length towards the cursor, or by what was typed: ``0.5 -2`` or ``2<45``."""
        text = text.strip()
        two = len(text.split()) > 1 or "<" in text or ";" in text
        if two and text[0] not in "@+":
            text = f"@{text}"
        to = next_point_of(text, self._begun, self._at)
        self._move(desk, to[0] - self._begun[0], to[1] - self._begun[1])


class MovingVertices(Drag):
    """Moves single vertices: the one that was taken, and those that are selected with it."""

    def __init__(self, desk: Desk, taken: Vertex, selection: Selection) -> None:
        super().__init__()
        self._selection = Selection(vertices=selection.vertices | {taken})
        self._begun = self._at = place_of(desk.sketch, taken)
        self._origin = _neighbour(desk, taken)

    def to(self, desk: Desk, aim: Aim) -> None:
        """Follow the mouse; with Shift at a round angle from the vertex before, with Ctrl freely."""
        self.guides = ()
        to = aim.raw
        if aim.shift and self._origin is not None:
            to = straightened(self._origin, aim.raw)
        elif not aim.ctrl:
            targets = desk.snapper.targets(desk.sketch, self._selection.vertices)
            if targets is not None:
                snap = snapped(aim.raw, targets, desk.snapping(aim.reach), self._origin)
                to, self.guides = snap.point, snap.guides
        self._put(desk, to)

    def _put(self, desk: Desk, to: Point) -> None:
        self._at = to
        dx, dy = to[0] - self._begun[0], to[1] - self._begun[1]
        still = dx == 0.0 and dy == 0.0
        self.change = None if still else vertices.moved(desk.sketch, self._selection, dx, dy)
        self.words = f"({to[0]:.2f}, {to[1]:.2f}) m"
        if self._origin is not None:
            self.words += f"   {bearing_words(self._origin, to)}"

    def enter(self, desk: Desk, text: str) -> None:
        """Put the vertex where it was typed: a length from the one before, or coordinates."""
        self._put(desk, next_point_of(text, self._origin or self._begun, self._at))


def _neighbour(desk: Desk, vertex: Vertex) -> Point | None:
    """Return the vertex before one on its ring, or after a wall's first; None of circles and starts."""
    same = {other.index: at for other, at in points_of(desk.sketch, vertex.of) if other.ring == vertex.ring}
    if isinstance(vertex.of, str) or not _is_line(desk, vertex):
        return None
    before = vertex.index - 1
    if before < 0:
        shape = None if vertex.of == BOUNDARY else desk.sketch.item(vertex.of).shape
        before = 1 if hasattr(shape, "points") else len(same) - 1
    return same.get(before)


def _is_line(desk: Desk, vertex: Vertex) -> bool:
    if isinstance(vertex.of, str):
        return False
    return vertex.of == BOUNDARY or not hasattr(desk.sketch.item(vertex.of).shape, "center")


class Turning(Drag):
    """Turns whole things about the middle of their box."""

    def __init__(self, desk: Desk, selection: Selection, begun: Point) -> None:
        super().__init__()
        low_x, low_y, high_x, high_y = bounds_of(desk.sketch, selection) or (0.0, 0.0, 0.0, 0.0)
        self.about = (low_x + high_x) / 2, (low_y + high_y) / 2
        self._selection, self._from = selection, self._angle(begun)

    def _angle(self, point: Point) -> float:
        return float(np.degrees(np.arctan2(point[1] - self.about[1], point[0] - self.about[0])))

    def to(self, desk: Desk, aim: Aim) -> None:
        """Follow the mouse; with Shift in steps, with Ctrl freely."""
        degrees = (self._angle(aim.raw) - self._from + 180.0) % 360.0 - 180.0
        if aim.shift:
            degrees = ANGLE * round(degrees / ANGLE)
        elif not aim.ctrl:
            degrees = snapped_angle(degrees, desk.snap_angle)
        self._turn(desk, degrees)

    def _turn(self, desk: Desk, degrees: float) -> None:
        self.words = f"{degrees + 0.0:.1f}".removesuffix(".0") + "°"
        self.change = edits.rotated(desk.sketch, self._selection, degrees, self.about) if degrees else None

    def enter(self, desk: Desk, text: str) -> None:
        """Turn by so many degrees."""
        self._turn(desk, angle_of(text))


class Scaling(Drag):
    """Scales whole things by a corner or a side of their box; the opposite one stays."""

    def __init__(self, desk: Desk, selection: Selection, grip: Grip) -> None:
        super().__init__()
        self._selection, self._side = selection, grip.side
        self._bounds = bounds_of(desk.sketch, selection) or (0.0, 0.0, 1.0, 1.0)
        self._offset = self._edge(1)
        self._offset = grip.at[0] - self._offset[0], grip.at[1] - self._offset[1]
        shapes = [desk.sketch.item(key).shape for key in selection.items]
        # a circle that is stretched would be a circle no more
        self._even = bool(selection.starts) or (
            bool(shapes) and all(hasattr(each, "center") for each in shapes)
        )

    def _edge(self, which: int) -> Point:
        """Return the corner or the middle of the side that is dragged (1), or of the one that stays (-1)."""
        low_x, low_y, high_x, high_y = self._bounds
        xs, ys = (
            {-1: low_x, 0: (low_x + high_x) / 2, 1: high_x},
            {-1: low_y, 0: (low_y + high_y) / 2, 1: high_y},
        )
        return xs[which * self._side[0]], ys[which * self._side[1]]

    def to(self, desk: Desk, aim: Aim) -> None:
        """Follow the mouse; with Shift in proportion, with Alt about the middle, with Ctrl freely."""
        to = aim.raw[0] - self._offset[0], aim.raw[1] - self._offset[1]
        self.guides = ()
        if not aim.ctrl:
            targets = desk.snapper.targets(desk.sketch, self._selection.owners)
            if targets is not None:
                snap = snapped(to, targets, desk.snapping(aim.reach))
                to, self.guides = snap.point, snap.guides
        low_x, low_y, high_x, high_y = self._bounds
        about = ((low_x + high_x) / 2, (low_y + high_y) / 2) if aim.alt else self._edge(-1)
        taken = self._edge(1)
        fx, fy = (
            (to[k] - about[k]) / (taken[k] - about[k])
            if self._side[k] and abs(taken[k] - about[k]) > 1e-9
            else 1.0
            for k in (0, 1)
        )
        if aim.shift or self._even:
            whole = [f for f, side in ((fx, self._side[0]), (fy, self._side[1])) if side]
            fx = fy = max(whole, key=lambda f: abs(f - 1.0))
        self._scale(desk, fx, fy, about)

    def _scale(self, desk: Desk, fx: float, fy: float, about: Point) -> None:
        wide, high = self._bounds[2] - self._bounds[0], self._bounds[3] - self._bounds[1]
        fx, fy = (
            f if abs(f) * max(size, 1e-3) >= 1e-3 else 1e-3 / max(size, 1e-3)
            for f, size in ((fx, wide), (fy, high))
        )
        same = abs(fx - 1.0) < 1e-12 and abs(fy - 1.0) < 1e-12
        self.change = None if same else edits.scaled(desk.sketch, self._selection, fx, fy, about)
        factor = f"{100 * fx:.0f} %" if abs(fx - fy) < 1e-9 else f"{100 * fx:.0f} % x {100 * fy:.0f} %"
        self.words = f"{length_words(abs(wide * fx))} x {length_words(abs(high * fy))}   {factor}"

    def enter(self, desk: Desk, text: str) -> None:
        """Scale to so many metres along the side that is dragged: ``2.5``, ``150%``, ``*2``."""
        axis = 0 if self._side[0] else 1
        now = self._bounds[2 + axis] - self._bounds[axis]
        factor = length_of(text, now=now) / now
        if factor <= 0.0:
            raise MapError(f"“{text}”: a size above 0 was wanted")
        both = self._even or (self._side[0] and self._side[1])
        fx = factor if both or axis == 0 else 1.0
        fy = factor if both or axis == 1 else 1.0
        self._scale(desk, fx, fy, self._edge(-1))


class Box(Drag):
    """Selects what lies in a box; drawn to the left also what it touches."""

    def __init__(self, desk: Desk, begun: Point, *, adds: bool) -> None:
        super().__init__()
        self._begun = self._at = begun
        self._before = desk.selection if adds else Selection()
        self._adds = adds

    def to(self, desk: Desk, aim: Aim) -> None:
        """Follow the mouse."""
        self._at = aim.raw

    def found(self, desk: Desk) -> Selection:
        """Return what is in the box: whole things, or vertices where it holds some that are shown."""
        sketch = desk.sketch
        shown = desk.handled
        inside = in_box(sketch, self._begun, self._at, touched=self._leftwards)
        whole = Selection(inside.items - set(shown), frozenset(), inside.starts - set(shown), False)
        if shown and not self._adds and not whole:
            single = vertices_in_box(sketch, self._begun, self._at, shown)
            if single.vertices and len(single.vertices) < sum(len(points_of(sketch, each)) for each in shown):
                return single
        return inside

    @property
    def _leftwards(self) -> bool:
        return self._at[0] < self._begun[0]

    def ended(self, desk: Desk) -> None:
        """Select."""
        if apart(self._begun, self._at) > 0.0:
            desk.select(self._before.plus(self.found(desk)))

    def preview(self) -> Preview:
        """Show the box."""
        return Preview(box=(self._begun, self._at), touched=self._leftwards)
