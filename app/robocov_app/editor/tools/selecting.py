"""The tool that selects and drags, and the one that moves the sheet."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.editor.edits import vertices
from robocov_app.editor.model.selection import Selection, edge_at, owners_at
from robocov_app.editor.tools.drags import Box, Drag, Moving, MovingVertices, Scaling, Turning
from robocov_app.editor.tools.grips import Grip, grip_at, things
from robocov_app.editor.tools.tool import Tool, apart

if TYPE_CHECKING:
    from robocov_app.editor.model.document import Owner
    from robocov_app.editor.tools.tool import Aim, Preview
    from robocov_app.editor.ui.desk import Desk

NEAR = 0.6
"""Part of a finger's width within which something is taken hold of."""

ON_EDGE = 1e-5
"""Metres within which a point lies on an edge."""

_CURSORS = {
    **dict.fromkeys(((-1, 0), (1, 0)), "sideways"),
    **dict.fromkeys(((0, -1), (0, 1)), "updown"),
    **dict.fromkeys(((-1, -1), (1, 1)), "rising"),
    **dict.fromkeys(((-1, 1), (1, -1)), "falling"),
}
"""What the cursor looks like over grips that scale, by their sides."""


class Select(Tool):
    """Selects, and drags what is selected: whole, by its vertices, or by the box around it."""

    name = "select"
    title = "Select"
    hint = "click or drag a box; drag to move, Alt-drag to copy; double click on an edge inserts a vertex"
    snaps = False

    def __init__(self) -> None:
        super().__init__()
        self.hovered: Owner | None = None
        self.near: Grip | None = None
        self._drag: Drag | None = None
        self._pressed: Aim | None = None
        self._grip: Grip | None = None
        self._narrows = False
        self._gone = False

    @property
    def busy(self) -> bool:
        """Whether something is being dragged."""
        return self._drag is not None

    @property
    def drag(self) -> Drag | None:
        """What is being dragged."""
        return self._drag

    def press(self, desk: Desk, aim: Aim) -> None:
        """Take hold of a grip, or of what is there; else begin a box."""
        self._pressed, self._drag, self._narrows, self._gone = aim, None, False, False
        self._grip = grip_at(desk.grips, aim.raw, NEAR * aim.reach)
        if self._grip is not None:
            self._take(desk, self._grip, aim)
            return
        found = owners_at(desk.sketch, aim.raw, 0.5 * aim.reach)
        if not found:
            return
        # what is selected already is meant, also where something else lies above it
        there = next((each for each in found if each in desk.selection.owners), None)
        if aim.shift:
            desk.select(things(desk.selection).toggled(Selection.of(found[0])))
        elif there is None or desk.selection.vertices:
            desk.select(Selection.of(there if there is not None else found[0]))
        else:
            self._narrows = True

    def _take(self, desk: Desk, grip: Grip, aim: Aim) -> None:
        """Select the vertex that was pressed; the box's grips wait to be dragged."""
        if grip.vertex is None:
            return
        own = Selection(vertices=frozenset({grip.vertex}))
        if aim.shift:
            desk.select(Selection(vertices=desk.selection.vertices).toggled(own))
        elif grip.vertex not in desk.selection.vertices:
            desk.select(own)

    def move(self, desk: Desk, aim: Aim) -> None:
        """Drag; or show what a press would take."""
        if self._pressed is None:
            self._hover(desk, aim)
            return
        if self._gone:
            return
        if self._drag is None and apart(aim.raw, self._pressed.raw) > 0.25 * aim.reach:
            self._drag = self._begun(desk, self._pressed)
        if self._drag is not None:
            self._drag.to(desk, aim)
            self.guides = self._drag.guides

    def _begun(self, desk: Desk, pressed: Aim) -> Drag:
        """Return the drag that the press has begun."""
        grip = self._grip
        if grip is not None and grip.vertex is not None:
            return MovingVertices(desk, grip.vertex, desk.selection)
        if grip is not None and grip.kind == "turn":
            return Turning(desk, things(desk.selection), pressed.raw)
        if grip is not None:
            return Scaling(desk, things(desk.selection), grip)
        found = owners_at(desk.sketch, pressed.raw, 0.5 * pressed.reach)
        if any(each in desk.selection.owners for each in found):
            return Moving(desk, things(desk.selection), pressed.raw)
        return Box(desk, pressed.raw, adds=pressed.shift)

    def _hover(self, desk: Desk, aim: Aim) -> None:
        self.near = grip_at(desk.grips, aim.raw, NEAR * aim.reach)
        found = () if self.near else owners_at(desk.sketch, aim.raw, 0.5 * aim.reach)
        self.hovered = found[0] if found else None

    def release(self, desk: Desk, aim: Aim, *, clicked: bool) -> None:
        """Do what was dragged; a click selects what it is on, and again what lies below."""
        pressed, drag, gone = self._pressed, self._drag, self._gone
        self._pressed = self._drag = None
        self.guides = ()
        if gone or pressed is None:
            return
        if drag is not None:
            drag.to(desk, aim)
            drag.ended(desk)
            return
        if self._grip is not None or aim.shift:
            return
        found = owners_at(desk.sketch, pressed.raw, 0.5 * pressed.reach)
        if not found:
            desk.select(Selection())
        elif self._narrows:
            self._narrow(desk, found)

    def _narrow(self, desk: Desk, found: tuple[Owner, ...]) -> None:
        """Select only one of what is selected; of one, what lies below it."""
        chosen = desk.selection.owners
        if len(chosen) > 1:
            desk.select(Selection.of(next(each for each in found if each in chosen)))
        elif len(found) > 1:
            (one,) = chosen
            desk.select(Selection.of(found[(found.index(one) + 1) % len(found)]))

    def twice(self, desk: Desk, aim: Aim) -> None:
        """Insert a vertex where the edge of something was clicked twice; elsewhere it is one more press."""
        owners = desk.handled or owners_at(desk.sketch, aim.raw, 0.5 * aim.reach)[:1]
        edge = edge_at(desk.sketch, aim.raw, NEAR * aim.reach, owners)
        if edge is None or grip_at(desk.grips, aim.raw, NEAR * aim.reach) is not None:
            self.press(desk, aim)
            return
        self._pressed, self._drag, self._gone = aim, None, True
        if not aim.ctrl:
            # on the edge, but at a round place
            to = desk.snapped(edge.point, aim.reach).point
            edge = edge_at(desk.sketch, to, ON_EDGE, [edge.of]) or edge
        desk.change(vertices.inserted(desk.sketch, edge))

    def enter(self, desk: Desk, text: str) -> None:
        """End the drag with what was typed."""
        drag = self._drag
        if drag is None:
            super().enter(desk, text)
            return
        drag.enter(desk, text)
        self._drag, self._gone, self.guides = None, True, ()
        drag.ended(desk)

    def cancel(self, desk: Desk) -> bool:
        """Give up what is dragged; then select nothing."""
        if self._drag is not None:
            self._drag, self._gone, self.guides = None, True, ()
            return True
        if desk.selection.vertices:
            desk.select(Selection.of(*{vertex.of for vertex in desk.selection.vertices}))
            return True
        if desk.selection:
            desk.select(Selection())
            return True
        return False

    def preview(self, desk: Desk) -> Preview | None:
        """Show the box, or words."""
        return self._drag.preview() if self._drag is not None else None

    def shape_of_cursor(self, desk: Desk) -> str:
        """Tell by the cursor what a press would do."""
        grip = self._grip if self._drag is not None else self.near
        if isinstance(self._drag, Moving):
            return "move"
        if grip is not None:
            return _CURSORS.get(grip.side, "hand")
        if self.hovered is not None:
            return "move" if self.hovered in desk.selection.owners else "hand"
        return "arrow"


class Pan(Tool):
    """Moves the sheet; the window does it, since cameras are its own."""

    name = "pan"
    title = "Pan"
    hint = "drag the sheet; the right button does so with every tool, and Space while it is held down"
    snaps = False
    takes_numbers = False

    def shape_of_cursor(self, desk: Desk) -> str:
        """Show that the sheet moves."""
        return "move"
