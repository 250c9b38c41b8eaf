"""Tools that draw point by point: polygons, walls, the boundary, places to start; and the tape measure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from itertools import pairwise
from typing import TYPE_CHECKING

from robocov.environment import PointsStart, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import edits
from robocov_app.editor.model.coordinates import next_point_of, size_of
from robocov_app.editor.tools.tool import Preview, Tool, apart, bearing_words, held, length_words, swept

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robocov.environment import Obstacle, Point
    from robocov_app.editor.model.selection import Change
    from robocov_app.editor.tools.tool import Aim
    from robocov_app.editor.ui.desk import Desk

SAME = 1e-6
"""Metres below which two points are one."""


class Line(Tool, ABC):
    """Draws point by point; the tools below say of what."""

    least = 2
    """Points that are needed at least."""

    closes = False
    """Whether a click on the first point ends it."""

    def __init__(self) -> None:
        super().__init__()
        self.points: list[Point] = []
        self.at: Point = (0.0, 0.0)

    @property
    def busy(self) -> bool:
        """Whether a point is there."""
        return bool(self.points)

    @property
    def origin(self) -> Point | None:
        """The last point."""
        return self.points[-1] if self.points else None

    @property
    def drawn(self) -> tuple[Point, ...]:
        """All points but the last, which angles count from."""
        return tuple(self.points[:-1])

    def press(self, desk: Desk, aim: Aim) -> None:
        """Add a point, or end at the first or the last one."""
        point = held(aim, self.origin)
        self.at = point
        if self.closes and len(self.points) >= self.least and apart(point, self.points[0]) < 0.7 * aim.reach:
            self.finish(desk)
        elif self.points and apart(point, self.points[-1]) < SAME:
            if len(self.points) >= self.least:
                self.finish(desk)
        else:
            self.points.append(point)

    def twice(self, desk: Desk, aim: Aim) -> None:
        """End; the first click of the two has put its point."""
        self.finish(desk)

    def move(self, desk: Desk, aim: Aim) -> None:
        """Show the next edge."""
        self.at = held(aim, self.origin)

    @abstractmethod
    def finish(self, desk: Desk) -> bool:
        """End with the points that there are; return whether there are any."""

    def back(self, desk: Desk) -> bool:
        """Take the last point back."""
        if self.points:
            self.points.pop()
            return True
        return False

    def cancel(self, desk: Desk) -> bool:
        """Give it up."""
        had, self.points = bool(self.points), []
        return had

    def enter(self, desk: Desk, text: str) -> None:
        """Put the next point where it was typed: a length towards the cursor, or coordinates."""
        self.points.append(next_point_of(text, self.origin, self.at if self.points else None))

    def preview(self, desk: Desk) -> Preview | None:
        """Show what there is so far, and the edge to the cursor."""
        if not self.points:
            return None
        points = (*self.points, self.at)
        words = bearing_words(self.points[-1], self.at)
        if self.closes and len(points) > 2:
            words += f"   {swept(points):.2f} m²"
        return Preview(points, self.closes and len(points) > 2, True, words=words)


class Shape(Line, ABC):
    """Draws something that stays in the map."""

    @abstractmethod
    def made(self, desk: Desk, points: Sequence[Point]) -> Change:
        """Return what the points make."""

    def finish(self, desk: Desk) -> bool:
        """Put it down."""
        if not self.points:
            return False
        points, self.points = self.points, []
        if len(points) < self.least:
            raise MapError(f"{self.title.lower()}: {len(points)} of at least {self.least} points were drawn")
        desk.change(self.made(desk, points))
        return True


class Polygon(Shape):
    """Draws an obstacle with corners."""

    name = "polygon"
    title = "Polygon"
    hint = "click the corners; Enter, a double click or a click on the first corner closes it"
    least = 3
    closes = True

    def made(self, desk: Desk, points: Sequence[Point]) -> Change:
        """Return the map with the polygon."""
        return edits.polygon_drawn(desk.sketch, points)


class Wall(Shape):
    """Draws a poly-line that is some width thick."""

    name = "wall"
    title = "Wall"
    hint = "click its points; Enter or a double click ends it; [ and ] change its width"

    def made(self, desk: Desk, points: Sequence[Point]) -> Change:
        """Return the map with the wall."""
        return edits.wall_drawn(desk.sketch, points, desk.wall_width)

    def preview(self, desk: Desk) -> Preview | None:
        """Show the wall so far."""
        if not self.points:
            return None
        points = (*self.points, self.at)
        line = points if apart(self.points[-1], self.at) > SAME else tuple(self.points)
        shapes: tuple[Obstacle, ...] = (WallObstacle(line, desk.wall_width),) if len(line) > 1 else ()
        words = f"{bearing_words(self.points[-1], self.at)}   {length_words(desk.wall_width)} wide"
        return Preview(points, False, True, shapes, words=words)


class Measure(Line):
    """Measures along a line; what was measured stays until something else is."""

    name = "measure"
    title = "Measure"
    hint = "click points, or drag from one place to another; Esc takes the tape away"

    def __init__(self) -> None:
        super().__init__()
        self.kept: tuple[Point, ...] = ()
        self._from: Point | None = None

    def press(self, desk: Desk, aim: Aim) -> None:
        """Begin, or go on."""
        self.kept = ()
        super().press(desk, aim)

    def release(self, desk: Desk, aim: Aim, *, clicked: bool) -> None:
        """End what was dragged."""
        if not clicked and len(self.points) == 1:
            self.points.append(held(aim, self.origin))
            self.finish(desk)

    def finish(self, desk: Desk) -> bool:
        """Leave the tape there."""
        if not self.points:
            return False
        self.kept, self.points = tuple(self.points), []
        return True

    def cancel(self, desk: Desk) -> bool:
        """Take the tape away."""
        had = bool(self.points or self.kept)
        self.points, self.kept = [], ()
        return had

    def preview(self, desk: Desk) -> Preview | None:
        """Show the lengths."""
        points = (*self.points, self.at) if self.points else self.kept
        if len(points) < 2:
            return None
        (ax, ay), (bx, by) = points[-2], points[-1]
        words = f"{bearing_words(points[-2], points[-1])}   Δx {bx - ax:.2f}  Δy {by - ay:.2f}"
        if len(points) > 2:
            whole = sum(apart(a, b) for a, b in pairwise(points))
            words += f"   {length_words(whole)} in all, {swept(points):.2f} m²"
        return Preview(points, False, True, words=words)


class Places(Shape):
    """Draws a start of given places, one for each robot."""

    name = "places"
    title = "Start spots"
    hint = "click a place for each robot; Enter ends it"
    least = 1

    def made(self, desk: Desk, points: Sequence[Point]) -> Change:
        """Return the map with the start."""
        return edits.points_start_drawn(desk.sketch, points)

    def preview(self, desk: Desk) -> Preview | None:
        """Show the places so far."""
        if not self.points:
            return None
        count = len(self.points)
        return Preview(
            start=PointsStart(tuple(self.points)),
            words=f"{count} robot{'s' if count > 1 else ''}; Enter ends it",
        )


class Boundary(Shape):
    """Draws the outer boundary: a rectangle by dragging, anything else corner by corner."""

    name = "boundary"
    title = "Boundary"
    hint = "drag a rectangle, or click the corners and press Enter; type 10 x 8 after the first corner"
    least = 3
    closes = True

    def __init__(self) -> None:
        super().__init__()
        self._pressed = False

    def made(self, desk: Desk, points: Sequence[Point]) -> Change:
        """Return the map with the boundary."""
        return edits.boundary_drawn(desk.sketch, points)

    def press(self, desk: Desk, aim: Aim) -> None:
        """Add a corner."""
        super().press(desk, aim)
        self._pressed = len(self.points) == 1

    def release(self, desk: Desk, aim: Aim, *, clicked: bool) -> None:
        """End a rectangle that was dragged."""
        # meanwhile a key may have taken the corner back
        if self._pressed and self.points and not clicked:
            self.at = aim.point
            self.points = list(self._box(self.points[0], self.at))
            self._pressed = False
            self.finish(desk)
        self._pressed = False

    def move(self, desk: Desk, aim: Aim) -> None:
        """Show the next edge, or the rectangle."""
        self.at = aim.point if self._pressed else held(aim, self.origin)

    def enter(self, desk: Desk, text: str) -> None:
        """Take a size after the first corner, else the next corner."""
        if len(self.points) == 1 and any(sign in text for sign in "x×*"):
            width, height = size_of(text)
            (x, y), (to_x, to_y) = self.points[0], self.at
            far = x + (width if to_x >= x else -width), y + (height if to_y >= y else -height)
            self.points = list(self._box((x, y), far))
            self.finish(desk)
            return
        super().enter(desk, text)

    def cancel(self, desk: Desk) -> bool:
        """Give it up."""
        self._pressed = False
        return super().cancel(desk)

    def preview(self, desk: Desk) -> Preview | None:
        """Show it so far."""
        if not self._pressed or not self.points:
            return super().preview(desk)
        (ax, ay), (bx, by) = self.points[0], self.at
        words = f"{length_words(abs(bx - ax))} x {length_words(abs(by - ay))}"
        return Preview(self._box(self.points[0], self.at), True, words=words)

    @staticmethod
    def _box(a: Point, b: Point) -> tuple[Point, Point, Point, Point]:
        return a, (b[0], a[1]), b, (a[0], b[1])
