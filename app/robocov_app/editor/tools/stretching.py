"""Tools that draw from one point to another: rectangles, circles, discs to start from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle
from robocov_app.editor.edits import edits
from robocov_app.editor.model.coordinates import length_of, point_of, size_of
from robocov_app.editor.tools.drawing import SAME
from robocov_app.editor.tools.tool import Preview, Tool, apart, length_words

if TYPE_CHECKING:
    from robocov.environment import Obstacle, Point
    from robocov_app.editor.model.selection import Change
    from robocov_app.editor.tools.tool import Aim
    from robocov_app.editor.ui.desk import Desk


class Stretch(Tool, ABC):
    """Draws from one point to another: by dragging, or by two clicks."""

    def __init__(self) -> None:
        super().__init__()
        self.begun: Point | None = None
        self.at: Point = (0.0, 0.0)

    @property
    def busy(self) -> bool:
        """Whether the first point is there."""
        return self.begun is not None

    @property
    def drawn(self) -> tuple[Point, ...]:
        """The first point."""
        return () if self.begun is None else (self.begun,)

    @abstractmethod
    def made(self, desk: Desk, a: Point, b: Point) -> Change:
        """Return what the two points make."""

    @abstractmethod
    def end_for(self, text: str) -> Point:
        """Return where the second point is for what was typed."""

    def press(self, desk: Desk, aim: Aim) -> None:
        """Begin, or end with the second click."""
        if self.begun is None:
            self.begun = self.at = aim.point
        else:
            self.at = self._second(aim)
            self.finish(desk)

    def twice(self, desk: Desk, aim: Aim) -> None:
        """Take it for one more click."""
        self.press(desk, aim)

    def move(self, desk: Desk, aim: Aim) -> None:
        """Show it."""
        self.at = self._second(aim)

    def release(self, desk: Desk, aim: Aim, *, clicked: bool) -> None:
        """End what was dragged."""
        if not clicked and self.begun is not None:
            self.at = self._second(aim)
            self.finish(desk)

    def finish(self, desk: Desk) -> bool:
        """Put it down."""
        begun, self.begun = self.begun, None
        if begun is None:
            return False
        desk.change(self.made(desk, begun, self.at))
        return True

    def cancel(self, desk: Desk) -> bool:
        """Give it up."""
        had, self.begun = self.begun is not None, None
        return had

    def enter(self, desk: Desk, text: str) -> None:
        """Take the first point, or the size."""
        if self.begun is None:
            self.begun = self.at = point_of(text)
            return
        self.at = self.end_for(text)
        self.finish(desk)

    def _second(self, aim: Aim) -> Point:
        return aim.point


class Rectangle(Stretch):
    """Draws a rectangle from corner to corner; with Shift a square."""

    name = "rectangle"
    title = "Rectangle"
    hint = "drag from corner to corner, or click both; type 3 x 2 for metres; Shift makes a square"

    def made(self, desk: Desk, a: Point, b: Point) -> Change:
        """Return the map with the rectangle."""
        return edits.rectangle_drawn(desk.sketch, a, b)

    def end_for(self, text: str) -> Point:
        """Return the corner for a size, on the cursor's side."""
        assert self.begun is not None
        width, height = size_of(text)
        right = self.at[0] >= self.begun[0]
        up = self.at[1] >= self.begun[1]
        return self.begun[0] + (width if right else -width), self.begun[1] + (height if up else -height)

    def _second(self, aim: Aim) -> Point:
        if not aim.shift or self.begun is None:
            return aim.point
        dx, dy = aim.point[0] - self.begun[0], aim.point[1] - self.begun[1]
        side = max(abs(dx), abs(dy))
        return self.begun[0] + float(np.copysign(side, dx)), self.begun[1] + float(np.copysign(side, dy))

    def preview(self, desk: Desk) -> Preview | None:
        """Show it with its size."""
        if self.begun is None:
            return None
        (ax, ay), (bx, by) = self.begun, self.at
        ring = ((ax, ay), (bx, ay), (bx, by), (ax, by))
        wide, high = abs(bx - ax), abs(by - ay)
        shapes: tuple[Obstacle, ...] = (PolygonObstacle(ring),) if min(wide, high) > SAME else ()
        words = f"{length_words(wide)} x {length_words(high)}   {wide * high:.2f} m²"
        return Preview(ring, True, shapes=shapes, words=words)


class Circle(Stretch):
    """Draws a round pillar from its middle."""

    name = "circle"
    title = "Circle"
    hint = "drag from the middle to the rim, or click both; type the radius for metres"

    def made(self, desk: Desk, a: Point, b: Point) -> Change:
        """Return the map with the circle."""
        return edits.circle_drawn(desk.sketch, a, apart(a, b))

    def end_for(self, text: str) -> Point:
        """Return a point of the rim for a radius."""
        assert self.begun is not None
        return self.begun[0] + length_of(text), self.begun[1]

    def preview(self, desk: Desk) -> Preview | None:
        """Show it with its radius."""
        if self.begun is None:
            return None
        radius = apart(self.begun, self.at)
        shapes: tuple[Obstacle, ...] = (CircleObstacle(self.begun, radius),) if radius > SAME else ()
        return Preview((self.begun, self.at), shapes=shapes, words=f"radius {length_words(radius)}")


class Disc(Circle):
    """Draws a start that is a disc."""

    name = "disc"
    title = "Start disc"
    hint = "drag from the middle to the rim: the robots start somewhere in it; type the radius for metres"

    def made(self, desk: Desk, a: Point, b: Point) -> Change:
        """Return the map with the start."""
        return edits.disc_start_drawn(desk.sketch, a, apart(a, b))

    def preview(self, desk: Desk) -> Preview | None:
        """Show it with its radius."""
        if self.begun is None:
            return None
        radius = apart(self.begun, self.at)
        start = DiscStart(self.begun, radius) if radius > SAME else None
        return Preview((self.begun, self.at), start=start, words=f"radius {length_words(radius)}")
