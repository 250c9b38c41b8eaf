"""The tool for the picture under the map: two points and a length give its scale, dragging moves it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from robocov.errors import MapError
from robocov_app.editor.edits.edits import underlaid
from robocov_app.editor.model.background import to_scale
from robocov_app.editor.model.coordinates import length_of
from robocov_app.editor.tools.tool import Preview, Tool, apart, length_words

if TYPE_CHECKING:
    from robocov.environment import Point
    from robocov_app.editor.model.background import Background
    from robocov_app.editor.tools.tool import Aim
    from robocov_app.editor.ui.desk import Desk


class Underlay(Tool):
    """Scales and moves the picture."""

    name = "picture"
    title = "Picture"
    hint = "click two points of the picture and type how far apart they are; drag moves the picture"
    snaps = False

    def __init__(self) -> None:
        super().__init__()
        self._points: list[Point] = []
        self._at: Point = (0.0, 0.0)
        self._from: Point | None = None
        self._laid: Background | None = None

    @property
    def busy(self) -> bool:
        """Whether a point was clicked."""
        return bool(self._points)

    @property
    def moved(self) -> Background | None:
        """The picture where it is being dragged to."""
        return self._laid

    def press(self, desk: Desk, aim: Aim) -> None:
        """Begin to drag, or to click."""
        if desk.sketch.background is None:
            raise MapError("there is no picture under the map: Ctrl B takes one")
        self._from = aim.raw

    def move(self, desk: Desk, aim: Aim) -> None:
        """Drag."""
        self._at = aim.raw
        background = desk.sketch.background
        if self._from is None or background is None or apart(self._from, aim.raw) < 0.25 * aim.reach:
            return
        dx, dy = aim.raw[0] - self._from[0], aim.raw[1] - self._from[1]
        self._laid = replace(background, corner=(background.corner[0] + dx, background.corner[1] + dy))

    def release(self, desk: Desk, aim: Aim, *, clicked: bool) -> None:
        """Let the picture lie there, or take the point that was clicked."""
        begun, laid = self._from, self._laid
        self._from = self._laid = None
        if begun is None:
            return
        if laid is not None and not clicked:
            corner = round(laid.corner[0], 4), round(laid.corner[1], 4)
            desk.change(underlaid(desk.sketch, replace(laid, corner=corner)))
            return
        self._points = [*self._points[-1:], aim.raw] if len(self._points) == 2 else [*self._points, aim.raw]
        if len(self._points) == 2:
            desk.say("type how many metres apart these two points are, then Enter")

    def twice(self, desk: Desk, aim: Aim) -> None:
        """Take no notice: two points in one place mean nothing."""

    def enter(self, desk: Desk, text: str) -> None:
        """Scale the picture."""
        if len(self._points) != 2 or desk.sketch.background is None:
            raise MapError("click two points of the picture first")
        a, b = self._points
        laid = to_scale(desk.sketch.background, a, b, length_of(text))
        self._points = []
        desk.change(underlaid(desk.sketch, laid))

    def back(self, desk: Desk) -> bool:
        """Take the last point back."""
        return bool(self._points and self._points.pop())

    def cancel(self, desk: Desk) -> bool:
        """Forget the points."""
        had = bool(self._points or self._from)
        self._points, self._from, self._laid = [], None, None
        return had

    def preview(self, desk: Desk) -> Preview | None:
        """Show the two points."""
        if not self._points:
            return None
        if len(self._points) == 1:
            return Preview(
                (self._points[0], self._at), words=f"now {length_words(apart(self._points[0], self._at))}"
            )
        words = f"now {length_words(apart(*self._points))}; type how far apart they are"
        return Preview(tuple(self._points), words=words)
