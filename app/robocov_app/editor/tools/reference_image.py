"""The tool for the picture under the map: two points and a length give its scale, dragging moves it."""

from __future__ import annotations

from dataclasses import replace

from robocov.environment import Point
from robocov.errors import MapError
from robocov_app.editor.edits.properties import underlaid
from robocov_app.editor.model.background import Background, to_scale
from robocov_app.editor.model.coordinates import length_of
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.tools.tool import PointerEvent, Preview, Tool, ToolContext, length_words


class ReferenceImageTool(Tool):
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

    def press(self, context: ToolContext, event: PointerEvent) -> None:
        """Begin to drag, or to click."""
        if context.sketch.background is None:
            raise MapError("there is no picture under the map: Ctrl B takes one")
        self._from = event.raw

    def move(self, context: ToolContext, event: PointerEvent) -> None:
        """Drag."""
        self._at = event.raw
        background = context.sketch.background
        if self._from is None or background is None or distance(self._from, event.raw) < 0.25 * event.reach:
            return
        dx, dy = event.raw[0] - self._from[0], event.raw[1] - self._from[1]
        self._laid = replace(background, corner=(background.corner[0] + dx, background.corner[1] + dy))

    def release(self, context: ToolContext, event: PointerEvent, *, clicked: bool) -> None:
        """Let the picture lie there, or take the point that was clicked."""
        begun, laid = self._from, self._laid
        self._from = self._laid = None
        if begun is None:
            return
        if laid is not None and not clicked:
            corner = round(laid.corner[0], 4), round(laid.corner[1], 4)
            context.change(underlaid(context.sketch, replace(laid, corner=corner)))
            return
        self._points = (
            [*self._points[-1:], event.raw] if len(self._points) == 2 else [*self._points, event.raw]
        )
        if len(self._points) == 2:
            context.say("type how many metres apart these two points are, then Enter")

    def twice(self, context: ToolContext, event: PointerEvent) -> None:
        """Take no notice: two points in one place mean nothing."""

    def enter(self, context: ToolContext, text: str) -> None:
        """Scale the picture."""
        if len(self._points) != 2 or context.sketch.background is None:
            raise MapError("click two points of the picture first")
        a, b = self._points
        laid = to_scale(context.sketch.background, a, b, length_of(text))
        self._points = []
        context.change(underlaid(context.sketch, laid))

    def back(self, context: ToolContext) -> bool:
        """Take the last point back."""
        return bool(self._points and self._points.pop())

    def cancel(self, context: ToolContext) -> bool:
        """Forget the points."""
        had = bool(self._points or self._from)
        self._points, self._from, self._laid = [], None, None
        return had

    def preview(self, context: ToolContext) -> Preview | None:
        """Show the two points."""
        if not self._points:
            return None
        if len(self._points) == 1:
            return Preview(
                (self._points[0], self._at), words=f"now {length_words(distance(self._points[0], self._at))}"
            )
        words = f"now {length_words(distance(*self._points))}; type how far apart they are"
        return Preview(tuple(self._points), words=words)
