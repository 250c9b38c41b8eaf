"""The tool for the paths of obstacles that move: way points by clicking and dragging, speeds by typing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.editor.edits.paths import (
    FIRST_SPEED,
    leg_at,
    path_of,
    path_paced,
    path_words,
    speed_of,
    way_point_added,
    way_point_at,
    way_point_moved,
    way_point_removed,
)
from robocov_app.editor.model.document import BOUNDARY
from robocov_app.editor.model.selection import Selection, owners_at
from robocov_app.editor.tools.grips import things
from robocov_app.editor.tools.tool import Preview, Tool, apart, bearing_words, held

if TYPE_CHECKING:
    from robocov.environment import Point
    from robocov_app.editor.model.selection import Change
    from robocov_app.editor.tools.tool import Aim
    from robocov_app.editor.ui.desk import Desk

NEAR = 0.75
"""Part of a finger's width within which a way point is taken hold of."""


class Leading(Tool):
    """Gives the selected obstacle a path, and changes it."""

    name = "path"
    title = "Path"
    hint = "click an obstacle, then where it goes; drag way points, Backspace takes one; type its speed"

    def __init__(self) -> None:
        super().__init__()
        self.speed = FIRST_SPEED
        self.chosen: int | None = None
        self.change: Change | None = None
        """What letting go of the mouse would make."""
        self._held: int | None = None
        self._at: Point = (0.0, 0.0)
        self._last: Point | None = None
        self._leads = False

    @property
    def busy(self) -> bool:
        """Whether an obstacle is led: then digits are its speed."""
        return self._leads

    @property
    def origin(self) -> Point | None:
        """The way point that the next one comes after."""
        return self._last

    def press(self, desk: Desk, aim: Aim) -> None:
        """Take hold of a way point, choose another obstacle, or add a way point."""
        subject = self._subject(desk)
        path = None if subject is None else path_of(desk.sketch, subject)
        self._held = self.change = None
        if path is not None:
            self._held = way_point_at(path, aim.raw, NEAR * aim.reach)
            if self._held is not None:
                self.chosen = self._held
                return
        over = [each for each in owners_at(desk.sketch, aim.raw, 0.0) if _is_obstacle(each)]
        if subject is None or (over and subject not in over):
            self.chosen = None
            if not over:
                desk.say("click the obstacle that is to move first")
                return
            desk.select(Selection.of(over[0]))
            self._note(desk)
            return
        if path is None and subject in over:
            desk.say("now click where it goes")
            return
        at = None if path is None else leg_at(path, aim.raw, 0.5 * aim.reach)
        point = aim.point if at is not None else held(aim, self._last)
        desk.change(way_point_added(desk.sketch, subject, point, at, self.speed))
        count = len(path.points) if path is not None else 1
        self.chosen = self._held = count if at is None else at
        self._note(desk)

    def twice(self, desk: Desk, aim: Aim) -> None:
        """Finish: the first of the two clicks has added the last way point."""
        self.finish(desk)

    def move(self, desk: Desk, aim: Aim) -> None:
        """Drag a way point."""
        self._at = aim.point
        self._note(desk)
        subject = self._subject(desk)
        if subject is None or self._held is None:
            return
        path = path_of(desk.sketch, subject)
        if path is None or self._held >= len(path.points):
            self._held = None
            return
        if self.change is None and apart(path.points[self._held], aim.raw) < 0.25 * aim.reach:
            return
        before = path.points[self._held - 1] if self._held else None
        self.change = way_point_moved(desk.sketch, subject, self._held, held(aim, before))

    def release(self, desk: Desk, aim: Aim, *, clicked: bool) -> None:
        """Leave a way point where it was dragged to."""
        change, self._held, self.change = self.change, None, None
        if change is not None and not clicked:
            desk.change(change)
        self._note(desk)

    def finish(self, desk: Desk) -> bool:
        """Let the obstacle go: another one can be chosen."""
        had = self._subject(desk) is not None
        if had:
            desk.select(Selection())
        self.cancel(desk)
        return had

    def back(self, desk: Desk) -> bool:
        """Take the chosen way point away, or the last one."""
        subject = self._subject(desk)
        path = None if subject is None else path_of(desk.sketch, subject)
        if subject is None or path is None:
            return False
        last = len(path.points) - 1
        chosen = last if self.chosen is None else min(self.chosen, last)
        desk.change(way_point_removed(desk.sketch, subject, chosen))
        self.chosen = max(chosen - 1, 0) if len(path.points) > 2 else None
        self._note(desk)
        return True

    def cancel(self, desk: Desk) -> bool:
        """Give up what is dragged."""
        had = self._held is not None
        self._held = self.change = self.chosen = self._last = None
        self._leads = False
        return had

    def enter(self, desk: Desk, text: str) -> None:
        """Give the obstacle, or the next path, another speed."""
        speed = speed_of(text)
        subject = self._subject(desk)
        if subject is not None and path_of(desk.sketch, subject) is not None:
            desk.change(path_paced(desk.sketch, Selection.of(subject), speed))
        self.speed = speed

    def preview(self, desk: Desk) -> Preview | None:
        """Show the way points, and what the dragged or the next leg is like."""
        subject = self._subject(desk)
        if subject is None:
            return None
        path = path_of(self.change.sketch if self.change is not None else desk.sketch, subject)
        if path is None:
            return Preview(words=f"where it goes, {self.speed:g} m/s")
        words = path_words(path)
        if self._held:
            words = f"{bearing_words(path.points[self._held - 1], path.points[self._held])}; {words}"
        return Preview(words=words, dots=path.points, chosen=self.chosen)

    def shape_of_cursor(self, desk: Desk) -> str:
        """A move where a way point can be taken hold of."""
        subject = self._subject(desk)
        path = None if subject is None else path_of(desk.sketch, subject)
        over = path is not None and way_point_at(path, self._at, 8.0 * desk.pixel) is not None
        return "move" if over or self._held is not None else "cross"

    def _subject(self, desk: Desk) -> int | None:
        """Return the obstacle that is led: the one that is selected."""
        chosen = things(desk.selection.within(desk.sketch))
        if len(chosen.items) != 1 or chosen.starts or chosen.boundary:
            return None
        (key,) = chosen.items
        return key

    def _note(self, desk: Desk) -> None:
        """Note what the next way point comes after."""
        subject = self._subject(desk)
        path = None if subject is None else path_of(desk.sketch, subject)
        self._leads = subject is not None
        self._last = None if path is None else path.points[-1]


def _is_obstacle(owner: int | str) -> bool:
    return isinstance(owner, int) and owner != BOUNDARY
