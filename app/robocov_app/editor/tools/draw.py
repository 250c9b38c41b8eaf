"""Tools that draw: obstacles, the boundary, starts, doors in walls; and the tape measure."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import copysign

import shapely

from robocov.environment import CircleObstacle, DiscStart, Point, PointsStart, PolygonObstacle, WallObstacle
from robocov.errors import MapError, format_count
from robocov_app.editor.edits import create
from robocov_app.editor.model import require
from robocov_app.editor.model.coordinates import length_of, next_point_of, size_of
from robocov_app.editor.model.geometry import bearing_words, distance, length_words, rectangle
from robocov_app.editor.model.selection import Change
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.tools.tool import PointerEvent, Preview, Tool, Workspace
from robocov_app.toolkit.draw_tools import SAME, Outline


class DrawTool(Tool):
    """Draws point by point, or with a single drag; the tools below say what the points make."""

    begins_typed = True
    least, most = 2, 1_000_000  # points that are needed, and that are taken
    closes = False  # whether a click on the first point ends it
    drags = False  # whether it can be drawn by a single drag, too
    make: Callable[[Sketch, Sequence[Point]], Change]

    def __init__(self) -> None:
        super().__init__()
        self.outline = Outline(self.least, self.most, self.closes, self.drags)

    def made(self, context: Workspace, points: Sequence[Point]) -> Change:
        return self.make(context.sketch, points)

    def shown(self, context: Workspace, points: tuple[Point, ...]) -> Preview:
        """Return what to show of the points, the last of which is the cursor."""
        closed = self.closes and len(points) > 2
        area = f"   {shapely.Polygon(points).area:.2f} m²" if closed else ""
        return Preview(points, closed, True, words=bearing_words(points[-2], points[-1]) + area)

    def placed(self, event: PointerEvent) -> Point:
        return event.constrained(self.origin)

    def end_for(self, text: str) -> Point | None:
        """Return where a drag from the first point ends for a typed size; None where that is no size."""
        return None

    @property
    def points(self) -> list[Point]:
        return self.outline.points

    @property
    def busy(self) -> bool:
        return bool(self.points)

    @property
    def origin(self) -> Point | None:
        return self.points[-1] if self.points and self.most > 2 else None

    @property
    def drawn(self) -> tuple[Point, ...]:
        return tuple(self.points if self.most == 2 else self.points[:-1])

    def press(self, context: Workspace, event: PointerEvent) -> None:
        if self.outline.press(self.placed(event), event.raw, 0.7 * event.reach):
            self.finish(context)

    def twice(self, context: Workspace, event: PointerEvent) -> None:
        if self.most == 2:
            self.press(context, event)
        else:  # the first click of the two has put its point
            self.finish(context)

    def move(self, context: Workspace, event: PointerEvent) -> None:
        self.outline.at = self.placed(event)

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        if self.outline.release(self.placed(event), event.raw, event.reach, clicked=clicked):
            self._finish_drag(context, self.outline.at)

    def finish(self, context: Workspace) -> bool:
        points = self.outline.take()
        if not points:
            return False
        if len(points) < self.least:
            raise MapError(f"{self.title.lower()}: {len(points)} of at least {self.least} points were drawn")
        context.change(self.made(context, points))
        return True

    def back(self, context: Workspace) -> bool:
        return bool(self.points and self.points.pop())

    def cancel(self, context: Workspace) -> bool:
        return self.outline.cancel()

    def enter(self, context: Workspace, text: str) -> None:
        outline = self.outline
        if len(self.points) == 1 and (end := self.end_for(text)) is not None:
            self._finish_drag(context, end)
            return
        outline.at = next_point_of(text, self.origin, outline.at if self.points else None)
        outline.points.append(outline.at)
        outline.dragging = False

    def preview(self, context: Workspace) -> Preview | None:
        return self.shown(context, (*self.points, self.outline.at)) if self.points else None

    def _finish_drag(self, context: Workspace, end: Point) -> None:
        self.outline.points = list(rectangle(self.points[0], end)) if self.closes else [self.points[0], end]
        self.finish(context)

    def _far_corner(self, text: str) -> Point:
        """Return the corner of a rectangle of a typed size, on the cursor's side of the first."""
        (x, y), (to_x, to_y), (width, height) = self.points[0], self.outline.at, size_of(text)
        return x + (width if to_x >= x else -width), y + (height if to_y >= y else -height)


class PolygonTool(DrawTool):
    """Draws an obstacle with corners."""

    name = "polygon"
    hint = "click the corners; Enter, a double click or a click on the first corner closes it"
    least, closes = 3, True
    make = staticmethod(create.polygon_drawn)


class WallTool(DrawTool):
    """Draws a poly-line that is some width thick."""

    name = "wall"
    hint = "click its points, Enter or a double click ends it; or drag; [ and ] change its width"
    drags = True

    def made(self, context: Workspace, points: Sequence[Point]) -> Change:
        return create.wall_drawn(context.sketch, points, context.wall_width)

    def shown(self, context: Workspace, points: tuple[Point, ...]) -> Preview:
        line = points if distance(points[-2], points[-1]) > SAME else points[:-1]
        shapes = (WallObstacle(line, context.wall_width),) if len(line) > 1 else ()
        words = f"{bearing_words(points[-2], points[-1])}   {length_words(context.wall_width)} wide"
        return Preview(points, False, True, shapes, words=words)


class MeasureTool(DrawTool):
    """Measures along a line; what was measured stays until something else is."""

    name = "measure"
    hint = "click points, or drag; “level” turns the map so that the line lies level; Esc takes the tape away"
    drags = True

    @property
    def measured(self) -> tuple[Point, ...]:
        return tuple(self.points or self.clicked)

    def press(self, context: Workspace, event: PointerEvent) -> None:
        self.clicked = []
        super().press(context, event)

    def finish(self, context: Workspace) -> bool:
        points = self.outline.take()
        self.clicked = points or self.clicked
        return bool(points)

    def cancel(self, context: Workspace) -> bool:
        had, self.clicked = bool(self.clicked), []
        return super().cancel(context) or had

    def preview(self, context: Workspace) -> Preview | None:
        points = [*self.points, self.outline.at] if self.points else self.clicked
        if len(points) < 2:
            return None
        (ax, ay), (bx, by) = points[-2], points[-1]
        words = f"{bearing_words(points[-2], points[-1])}   Δx {bx - ax:.2f}  Δy {by - ay:.2f}"
        if len(points) > 2:
            whole = sum(distance(a, b) for a, b in pairwise(points))
            words += f"   {length_words(whole)} in all, {shapely.Polygon(points).area:.2f} m²"
        return Preview(tuple(points), False, True, words=words)


class PlacesTool(DrawTool):
    """Draws a start of given places, one for each robot."""

    name = "places"
    title = "Start spots"
    hint = "click a place for each robot; Enter ends it"
    least = 1
    make = staticmethod(create.points_start_drawn)

    def shown(self, context: Workspace, points: tuple[Point, ...]) -> Preview:
        words = f"{format_count(len(points) - 1, 'robot')}; Enter ends it"
        return Preview(start=PointsStart(points[:-1]), words=words)


class BoundaryTool(DrawTool):
    """Draws the outer boundary: a rectangle by dragging, anything else corner by corner."""

    name = "boundary"
    hint = "drag a rectangle, or click the corners and press Enter; type 10 x 8 after the first corner"
    least, closes, drags = 3, True, True
    make = staticmethod(create.boundary_drawn)

    def placed(self, event: PointerEvent) -> Point:
        return event.point if self.outline.dragging else super().placed(event)

    def end_for(self, text: str) -> Point | None:
        return self._far_corner(text) if any(sign in text for sign in "x×*") else None

    def shown(self, context: Workspace, points: tuple[Point, ...]) -> Preview:
        if not self.outline.dragging:
            return super().shown(context, points)
        (ax, ay), (bx, by) = points
        words = f"{length_words(abs(bx - ax))} x {length_words(abs(by - ay))}"
        return Preview(rectangle(*points), True, words=words)


class RectangleTool(DrawTool):
    """Draws a rectangle from corner to corner; with Shift a square."""

    name = "rectangle"
    hint = "drag from corner to corner, or click both; type 3 x 2 for metres; Shift makes a square"
    most, drags = 2, True
    make = staticmethod(create.rectangle_drawn)
    end_for = DrawTool._far_corner

    def placed(self, event: PointerEvent) -> Point:
        if not event.shift or not self.points:
            return event.point
        (x, y), (to_x, to_y) = self.points[0], event.point
        side = max(abs(to_x - x), abs(to_y - y))
        return x + copysign(side, to_x - x), y + copysign(side, to_y - y)

    def shown(self, context: Workspace, points: tuple[Point, ...]) -> Preview:
        (ax, ay), (bx, by) = points
        wide, high, ring = abs(bx - ax), abs(by - ay), rectangle(*points)
        shapes = (PolygonObstacle(ring),) if min(wide, high) > SAME else ()
        words = f"{length_words(wide)} x {length_words(high)}   {wide * high:.2f} m²"
        return Preview(ring, True, shapes=shapes, words=words)


class CircleTool(DrawTool):
    """Draws a round pillar from its middle."""

    name = "circle"
    hint = "drag from the middle to the rim, or click both; type the radius for metres"
    most, drags = 2, True
    make_round = staticmethod(create.circle_drawn)

    def made(self, context: Workspace, points: Sequence[Point]) -> Change:
        return self.make_round(context.sketch, points[0], distance(*points))

    def end_for(self, text: str) -> Point:
        return self.points[0][0] + length_of(text), self.points[0][1]

    def shown(self, context: Workspace, points: tuple[Point, ...]) -> Preview:
        radius = distance(*points)
        shapes = (CircleObstacle(points[0], radius),) if radius > SAME else ()
        return Preview(points, shapes=shapes, words=f"radius {length_words(radius)}")


class DiscTool(CircleTool):
    """Draws a start that is a disc."""

    name = "disc"
    title = "Start disc"
    hint = "drag from the middle to the rim: the robots start somewhere in it; type the radius for metres"
    make_round = staticmethod(create.disc_start_drawn)

    def shown(self, context: Workspace, points: tuple[Point, ...]) -> Preview:
        radius = distance(*points)
        start = DiscStart(points[0], radius) if radius > SAME else None
        return Preview(points, start=start, words=f"radius {length_words(radius)}")


class DoorTool(Tool):
    """Opens a door in a wall; the pieces stay walls."""

    name = "door"
    hint = "click a wall where its door is to be, or drag along it; type the door's width in metres"
    begins_typed = True

    def __init__(self) -> None:
        super().__init__()
        self.width = 0.9
        self._wall: int | None = None  # over which the cursor is, or that was pressed

    def press(self, context: Workspace, event: PointerEvent) -> None:
        self.begun, self.at = event, event.point
        self._wall = create.wall_at(context.sketch, event.raw, 0.6 * event.reach)
        require(self._wall is not None, "click a wall: doors are opened in walls")

    def move(self, context: Workspace, event: PointerEvent) -> None:
        self.at = event.point
        if self.begun is None:
            self._wall = create.wall_at(context.sketch, event.raw, 0.6 * event.reach)

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        begun, self.begun, wall, self._wall = self.begun, None, self._wall, None
        if begun is None or wall is None:
            return
        if clicked:
            context.change(create.door_opened(context.sketch, wall, event.point, self.width))
        else:
            context.change(create.wall_opened(context.sketch, wall, begun.point, event.point))

    def enter(self, context: Workspace, text: str) -> None:
        self.width = create.door_width(length_of(text))
        context.say(f"doors are {length_words(self.width)} wide")

    def preview(self, context: Workspace) -> Preview | None:
        if self._wall is None or self._wall not in context.sketch.places:
            return None
        a, b = create.door_at(context.sketch, self._wall, self.at, self.width)
        if self.begun is not None and distance(self.begun.point, self.at) > 0.1 * self.width:
            a, b = (create.on_wall(context.sketch, self._wall, at) for at in (self.begun.point, self.at))
        return Preview((a, b), words=f"door, {length_words(distance(a, b))}")
