"""Tools that draw point by point: polygons, walls, the boundary, places to start; and the tape measure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from robocov.environment import (
    CircleObstacle,
    DiscStart,
    Obstacle,
    Point,
    PointsStart,
    PolygonObstacle,
    WallObstacle,
)
from robocov.errors import MapError
from robocov_app.editor.edits import create
from robocov_app.editor.model.coordinates import length_of, next_point_of, point_of, size_of
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.model.selection import Change
from robocov_app.editor.tools.tool import (
    PointerEvent,
    Preview,
    Tool,
    ToolContext,
    bearing_words,
    constrained_point,
    length_words,
    ring_area,
)

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

    def press(self, context: ToolContext, event: PointerEvent) -> None:
        """Add a point, or end at the first or the last one."""
        point = constrained_point(event, self.origin)
        self.at = point
        if (
            self.closes
            and len(self.points) >= self.least
            and distance(point, self.points[0]) < 0.7 * event.reach
        ):
            self.finish(context)
        elif self.points and distance(point, self.points[-1]) < SAME:
            if len(self.points) >= self.least:
                self.finish(context)
        else:
            self.points.append(point)

    def twice(self, context: ToolContext, event: PointerEvent) -> None:
        """End; the first click of the two has put its point."""
        self.finish(context)

    def move(self, context: ToolContext, event: PointerEvent) -> None:
        """Show the next edge."""
        self.at = constrained_point(event, self.origin)

    @abstractmethod
    def finish(self, context: ToolContext) -> bool:
        """End with the points that there are; return whether there are any."""

    def back(self, context: ToolContext) -> bool:
        """Take the last point back."""
        if self.points:
            self.points.pop()
            return True
        return False

    def cancel(self, context: ToolContext) -> bool:
        """Give it up."""
        had, self.points = bool(self.points), []
        return had

    def enter(self, context: ToolContext, text: str) -> None:
        """Put the next point where it was typed: a length towards the cursor, or coordinates."""
        self.points.append(next_point_of(text, self.origin, self.at if self.points else None))

    def preview(self, context: ToolContext) -> Preview | None:
        """Show what there is so far, and the edge to the cursor."""
        if not self.points:
            return None
        points = (*self.points, self.at)
        words = bearing_words(self.points[-1], self.at)
        if self.closes and len(points) > 2:
            words += f"   {ring_area(points):.2f} m²"
        return Preview(points, self.closes and len(points) > 2, True, words=words)


class Shape(Line, ABC):
    """Draws something that stays in the map."""

    @abstractmethod
    def made(self, context: ToolContext, points: Sequence[Point]) -> Change:
        """Return what the points make."""

    def finish(self, context: ToolContext) -> bool:
        """Put it down."""
        if not self.points:
            return False
        points, self.points = self.points, []
        if len(points) < self.least:
            raise MapError(f"{self.title.lower()}: {len(points)} of at least {self.least} points were drawn")
        context.change(self.made(context, points))
        return True


class Polygon(Shape):
    """Draws an obstacle with corners."""

    name = "polygon"
    title = "Polygon"
    hint = "click the corners; Enter, a double click or a click on the first corner closes it"
    least = 3
    closes = True

    def made(self, context: ToolContext, points: Sequence[Point]) -> Change:
        """Return the map with the polygon."""
        return create.polygon_drawn(context.sketch, points)


class Wall(Shape):
    """Draws a poly-line that is some width thick."""

    name = "wall"
    title = "Wall"
    hint = "click its points; Enter or a double click ends it; [ and ] change its width"

    def made(self, context: ToolContext, points: Sequence[Point]) -> Change:
        """Return the map with the wall."""
        return create.wall_drawn(context.sketch, points, context.wall_width)

    def preview(self, context: ToolContext) -> Preview | None:
        """Show the wall so far."""
        if not self.points:
            return None
        points = (*self.points, self.at)
        line = points if distance(self.points[-1], self.at) > SAME else tuple(self.points)
        shapes: tuple[Obstacle, ...] = (WallObstacle(line, context.wall_width),) if len(line) > 1 else ()
        words = f"{bearing_words(self.points[-1], self.at)}   {length_words(context.wall_width)} wide"
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

    def press(self, context: ToolContext, event: PointerEvent) -> None:
        """Begin, or go on."""
        self.kept = ()
        super().press(context, event)

    def release(self, context: ToolContext, event: PointerEvent, *, clicked: bool) -> None:
        """End what was dragged."""
        if not clicked and len(self.points) == 1:
            self.points.append(constrained_point(event, self.origin))
            self.finish(context)

    def finish(self, context: ToolContext) -> bool:
        """Leave the tape there."""
        if not self.points:
            return False
        self.kept, self.points = tuple(self.points), []
        return True

    def cancel(self, context: ToolContext) -> bool:
        """Take the tape away."""
        had = bool(self.points or self.kept)
        self.points, self.kept = [], ()
        return had

    def preview(self, context: ToolContext) -> Preview | None:
        """Show the lengths."""
        points = (*self.points, self.at) if self.points else self.kept
        if len(points) < 2:
            return None
        (ax, ay), (bx, by) = points[-2], points[-1]
        words = f"{bearing_words(points[-2], points[-1])}   Δx {bx - ax:.2f}  Δy {by - ay:.2f}"
        if len(points) > 2:
            whole = sum(distance(a, b) for a, b in pairwise(points))
            words += f"   {length_words(whole)} in all, {ring_area(points):.2f} m²"
        return Preview(points, False, True, words=words)


class Places(Shape):
    """Draws a start of given places, one for each robot."""

    name = "places"
    title = "Start spots"
    hint = "click a place for each robot; Enter ends it"
    least = 1

    def made(self, context: ToolContext, points: Sequence[Point]) -> Change:
        """Return the map with the start."""
        return create.points_start_drawn(context.sketch, points)

    def preview(self, context: ToolContext) -> Preview | None:
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

    def made(self, context: ToolContext, points: Sequence[Point]) -> Change:
        """Return the map with the boundary."""
        return create.boundary_drawn(context.sketch, points)

    def press(self, context: ToolContext, event: PointerEvent) -> None:
        """Add a corner."""
        super().press(context, event)
        self._pressed = len(self.points) == 1

    def release(self, context: ToolContext, event: PointerEvent, *, clicked: bool) -> None:
        """End a rectangle that was dragged."""
        # meanwhile a key may have taken the corner back
        if self._pressed and self.points and not clicked:
            self.at = event.point
            self.points = list(self._box(self.points[0], self.at))
            self._pressed = False
            self.finish(context)
        self._pressed = False

    def move(self, context: ToolContext, event: PointerEvent) -> None:
        """Show the next edge, or the rectangle."""
        self.at = event.point if self._pressed else constrained_point(event, self.origin)

    def enter(self, context: ToolContext, text: str) -> None:
        """Take a size after the first corner, else the next corner."""
        if len(self.points) == 1 and any(sign in text for sign in "x×*"):
            width, height = size_of(text)
            (x, y), (to_x, to_y) = self.points[0], self.at
            far = x + (width if to_x >= x else -width), y + (height if to_y >= y else -height)
            self.points = list(self._box((x, y), far))
            self.finish(context)
            return
        super().enter(context, text)

    def cancel(self, context: ToolContext) -> bool:
        """Give it up."""
        self._pressed = False
        return super().cancel(context)

    def preview(self, context: ToolContext) -> Preview | None:
        """Show it so far."""
        if not self._pressed or not self.points:
            return super().preview(context)
        (ax, ay), (bx, by) = self.points[0], self.at
        words = f"{length_words(abs(bx - ax))} x {length_words(abs(by - ay))}"
        return Preview(self._box(self.points[0], self.at), True, words=words)

    @staticmethod
    def _box(a: Point, b: Point) -> tuple[Point, Point, Point, Point]:
        return a, (b[0], a[1]), b, (a[0], b[1])


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
    def made(self, context: ToolContext, a: Point, b: Point) -> Change:
        """Return what the two points make."""

    @abstractmethod
    def end_for(self, text: str) -> Point:
        """Return where the second point is for what was typed."""

    def press(self, context: ToolContext, event: PointerEvent) -> None:
        """Begin, or end with the second click."""
        if self.begun is None:
            self.begun = self.at = event.point
        else:
            self.at = self._second(event)
            self.finish(context)

    def twice(self, context: ToolContext, event: PointerEvent) -> None:
        """Take it for one more click."""
        self.press(context, event)

    def move(self, context: ToolContext, event: PointerEvent) -> None:
        """Show it."""
        self.at = self._second(event)

    def release(self, context: ToolContext, event: PointerEvent, *, clicked: bool) -> None:
        """End what was dragged."""
        if not clicked and self.begun is not None:
            self.at = self._second(event)
            self.finish(context)

    def finish(self, context: ToolContext) -> bool:
        """Put it down."""
        begun, self.begun = self.begun, None
        if begun is None:
            return False
        context.change(self.made(context, begun, self.at))
        return True

    def cancel(self, context: ToolContext) -> bool:
        """Give it up."""
        had, self.begun = self.begun is not None, None
        return had

    def enter(self, context: ToolContext, text: str) -> None:
        """Take the first point, or the size."""
        if self.begun is None:
            self.begun = self.at = point_of(text)
            return
        self.at = self.end_for(text)
        self.finish(context)

    def _second(self, event: PointerEvent) -> Point:
        return event.point


class Rectangle(Stretch):
    """Draws a rectangle from corner to corner; with Shift a square."""

    name = "rectangle"
    title = "Rectangle"
    hint = "drag from corner to corner, or click both; type 3 x 2 for metres; Shift makes a square"

    def made(self, context: ToolContext, a: Point, b: Point) -> Change:
        """Return the map with the rectangle."""
        return create.rectangle_drawn(context.sketch, a, b)

    def end_for(self, text: str) -> Point:
        """Return the corner for a size, on the cursor's side."""
        assert self.begun is not None
        width, height = size_of(text)
        right = self.at[0] >= self.begun[0]
        up = self.at[1] >= self.begun[1]
        return self.begun[0] + (width if right else -width), self.begun[1] + (height if up else -height)

    def _second(self, event: PointerEvent) -> Point:
        if not event.shift or self.begun is None:
            return event.point
        dx, dy = event.point[0] - self.begun[0], event.point[1] - self.begun[1]
        side = max(abs(dx), abs(dy))
        return self.begun[0] + float(np.copysign(side, dx)), self.begun[1] + float(np.copysign(side, dy))

    def preview(self, context: ToolContext) -> Preview | None:
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

    def made(self, context: ToolContext, a: Point, b: Point) -> Change:
        """Return the map with the circle."""
        return create.circle_drawn(context.sketch, a, distance(a, b))

    def end_for(self, text: str) -> Point:
        """Return a point of the rim for a radius."""
        assert self.begun is not None
        return self.begun[0] + length_of(text), self.begun[1]

    def preview(self, context: ToolContext) -> Preview | None:
        """Show it with its radius."""
        if self.begun is None:
            return None
        radius = distance(self.begun, self.at)
        shapes: tuple[Obstacle, ...] = (CircleObstacle(self.begun, radius),) if radius > SAME else ()
        return Preview((self.begun, self.at), shapes=shapes, words=f"radius {length_words(radius)}")


class Disc(Circle):
    """Draws a start that is a disc."""

    name = "disc"
    title = "Start disc"
    hint = "drag from the middle to the rim: the robots start somewhere in it; type the radius for metres"

    def made(self, context: ToolContext, a: Point, b: Point) -> Change:
        """Return the map with the start."""
        return create.disc_start_drawn(context.sketch, a, distance(a, b))

    def preview(self, context: ToolContext) -> Preview | None:
        """Show it with its radius."""
        if self.begun is None:
            return None
        radius = distance(self.begun, self.at)
        start = DiscStart(self.begun, radius) if radius > SAME else None
        return Preview((self.begun, self.at), start=start, words=f"radius {length_words(radius)}")
