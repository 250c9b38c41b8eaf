"""Tools that draw obstacles, the boundary and starts, and the tool that measures lengths."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import pairwise
from math import copysign

import shapely

from robocov.environment import CircleObstacle, DiscStart, Point, PointsStart, PolygonObstacle, WallObstacle
from robocov.errors import MapError, format_count
from robocov_app.editor.edits import create
from robocov_app.editor.model.coordinates import parse_length, parse_next_point, parse_size
from robocov_app.editor.model.geometry import (
    build_rectangle,
    distance,
    format_bearing,
    format_length,
    format_shift,
)
from robocov_app.editor.model.selection import Change
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.tool import EditorPointerEvent, EditorTool
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.toolkit.tools.drawn_outline import SAME_POINT_M, DrawnOutline

CLOSING_FRACTION = 0.7  # of the pointer's reach: a click this close to the first point closes the outline


class LineTool(EditorTool, ABC):
    """Draws point by point or with a single drag; subclasses turn the points into an object.

    Attributes
    ----------
    min_points, max_points : int
        Minimum number of points, and number at which the drawing is complete.
    is_closable : bool
        Whether a click on the first point completes the drawing.
    allows_drag : bool
        Whether the tool can also draw with a single drag.
    outline : DrawnOutline
        The points drawn so far.
    """

    starts_with_text = True
    min_points = 2
    max_points = 1_000_000
    is_closable = False
    allows_drag = False

    def __init__(self) -> None:
        super().__init__()
        self.outline = DrawnOutline(self.min_points, self.max_points, self.is_closable, self.allows_drag)

    @abstractmethod
    def finish(self, context: EditorContext) -> None:
        """Complete the drawing with the points drawn so far."""

    def build_preview(self, context: EditorContext, points: tuple[Point, ...]) -> EditorToolOverlay:
        """Return the preview of an unfinished drawing; the last of the points, m, is the cursor."""
        is_closed = self.is_closable and len(points) > 2
        last_point, cursor = points[-2:]
        label = format_bearing(last_point, cursor)
        if is_closed:
            label += f"   {shapely.Polygon(points).area:.2f} m²"
        return EditorToolOverlay(line=points, is_closed=is_closed, shows_lengths=True, label=label)

    def choose_point(self, event: EditorPointerEvent) -> Point:
        """Return the position of the next point, m; with Shift, the angle is constrained."""
        return event.constrain(self.origin)

    def find_drag_end(self, text: str) -> Point | None:
        """Return the end point of a drag with a typed size, m; None if the text is not a size."""
        return None

    @property
    def points(self) -> list[Point]:
        """Points drawn so far, m."""
        return self.outline.points

    @property
    def is_busy(self) -> bool:
        """Whether any point has been drawn."""
        return bool(self.points)

    @property
    def origin(self) -> Point | None:
        """Last point of a line that is being drawn, m; None for shapes given by two points."""
        if not self.points or self.max_points == 2:
            return None
        return self.points[-1]

    @property
    def snap_points(self) -> tuple[Point, ...]:
        """Points drawn so far to which the pointer snaps, m; not the last one of a line."""
        if self.max_points == 2:
            return tuple(self.points)
        return tuple(self.points[:-1])

    def press(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Add a point."""
        if self.outline.press(
            self.choose_point(event), event.unsnapped_point, CLOSING_FRACTION * event.reach
        ):
            self.finish(context)

    def double_click(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Complete the drawing."""
        if self.max_points == 2:
            self.press(context, event)
        else:
            # The first of the two clicks has added its point already.
            self.finish(context)

    def move(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Move the preview of the next point to the pointer."""
        self.outline.cursor = self.choose_point(event)

    def release(self, context: EditorContext, event: EditorPointerEvent, *, is_click: bool) -> None:
        """Complete the drawing if it was drawn with a drag."""
        if self.outline.release(
            self.choose_point(event), event.unsnapped_point, event.reach, is_click=is_click
        ):
            self._finish_drag(context, self.outline.cursor)

    def remove_last(self, context: EditorContext) -> bool:
        """Remove the last point; return whether there was one."""
        if not self.points:
            return False
        self.points.pop()
        return True

    def cancel(self, context: EditorContext) -> bool:
        """Remove all points; return whether there were any."""
        return self.outline.cancel()

    def enter_text(self, context: EditorContext, text: str) -> None:
        """Add a point given by typed coordinates or a length, or complete the drawing with a typed size."""
        if len(self.points) == 1:
            end = self.find_drag_end(text)
            if end is not None:
                self._finish_drag(context, end)
                return
        cursor = None
        if self.points:
            cursor = self.outline.cursor
        self.outline.cursor = parse_next_point(text, self.origin, cursor)
        self.outline.points.append(self.outline.cursor)
        self.outline.is_dragging = False

    def build_overlay(self, context: EditorContext) -> EditorToolOverlay:
        """Return the preview of the unfinished drawing, up to the cursor."""
        if not self.points:
            return EditorToolOverlay()
        return self.build_preview(context, (*self.points, self.outline.cursor))

    def _finish_drag(self, context: EditorContext, end: Point) -> None:
        start = self.points[0]
        if self.is_closable:
            self.outline.points = list(build_rectangle(start, end))
        else:
            self.outline.points = [start, end]
        self.finish(context)

    def _find_far_corner(self, text: str) -> Point:
        """Return the corner of a rectangle with a typed size that is opposite to the first one.

        The rectangle extends from the first corner in the direction of the cursor.
        """
        x, y = self.points[0]
        cursor_x, cursor_y = self.outline.cursor
        width, height = parse_size(text)
        return x + copysign(width, cursor_x - x), y + copysign(height, cursor_y - y)


class DrawTool(LineTool, ABC):
    """Draws an object of the map; subclasses build it from the points."""

    @abstractmethod
    def build_change(self, context: EditorContext, points: Sequence[Point]) -> Change:
        """Return the change that adds the object defined by the points, m."""

    def finish(self, context: EditorContext) -> None:
        """Add the object to the map; raise MapError if too few points were drawn."""
        points = self.outline.take_points()
        if not points:
            return
        if len(points) < self.min_points:
            name = self.title.lower()
            raise MapError(f"{name}: {len(points)} of at least {self.min_points} points were drawn")
        context.apply(self.build_change(context, points))


class PolygonTool(DrawTool):
    """Draws a polygon corner by corner."""

    name = "polygon"
    title = "Polygon"
    key = "p"
    hint = "click the corners; Enter, a double click or a click on the first corner closes it"
    min_points = 3
    is_closable = True

    def build_change(self, context: EditorContext, points: Sequence[Point]) -> Change:
        """Return the change that adds the polygon."""
        return create.add_polygon(context.sketch, points)


class WallTool(DrawTool):
    """Draws a wall along a line."""

    name = "wall"
    title = "Wall"
    key = "w"
    hint = "click its points, Enter or a double click ends it; or drag; [ and ] change its width"
    allows_drag = True

    def build_change(self, context: EditorContext, points: Sequence[Point]) -> Change:
        """Return the change that adds the wall."""
        return create.add_wall(context.sketch, points, context.wall_width)

    def build_preview(self, context: EditorContext, points: tuple[Point, ...]) -> EditorToolOverlay:
        """Return the line, and the wall with its width."""
        last_point, cursor = points[-2:]
        line = points
        if distance(last_point, cursor) <= SAME_POINT_M:
            line = points[:-1]
        shapes = (WallObstacle(line, context.wall_width),) if len(line) > 1 else ()
        label = f"{format_bearing(last_point, cursor)}   {format_length(context.wall_width)} wide"
        return EditorToolOverlay(line=points, shows_lengths=True, shapes=shapes, label=label)


class MeasureTool(LineTool):
    """Measures lengths along a line, which remains visible until another line is drawn."""

    name = "measure"
    title = "Measure"
    key = "m"
    hint = (
        "click points, or drag; “level” rotates the map until the line is level; Esc clears the measurement"
    )
    allows_drag = True

    @property
    def measured(self) -> tuple[Point, ...]:
        """Points of the line that is being drawn or was drawn last, m."""
        return tuple(self.points or self.clicked)

    def press(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Add a point; the first one removes the previous line."""
        self.clicked = []
        super().press(context, event)

    def finish(self, context: EditorContext) -> None:
        """Complete the line, which remains visible."""
        points = self.outline.take_points()
        if points:
            self.clicked = points

    def cancel(self, context: EditorContext) -> bool:
        """Remove the line; return whether there was one."""
        had_line = bool(self.clicked)
        self.clicked = []
        return super().cancel(context) or had_line

    def build_overlay(self, context: EditorContext) -> EditorToolOverlay:
        """Return the line with its length and, from three points on, the area that it encloses.

        A line that crosses itself has no area.
        """
        points = self.clicked
        if self.points:
            points = [*self.points, self.outline.cursor]
        if len(points) < 2:
            return EditorToolOverlay()
        start, end = points[-2:]
        dx = end[0] - start[0]
        dy = end[1] - start[1]
        label = f"{format_bearing(start, end)}   {format_shift(dx, dy)}"
        if len(points) > 2:
            total = sum(distance(a, b) for a, b in pairwise(points))
            label += f"   total {format_length(total)}"
            outline = shapely.Polygon(points)
            if outline.is_valid:
                label += f", area {outline.area:.2f} m²"
        return EditorToolOverlay(line=tuple(points), shows_lengths=True, label=label)


class StartPositionsTool(DrawTool):
    """Draws a start with one position for each robot."""

    name = "places"
    title = "Start spots"
    key = "shift+s"
    hint = "click a position for each robot; Enter ends it"
    min_points = 1

    def build_change(self, context: EditorContext, points: Sequence[Point]) -> Change:
        """Return the change that adds the start."""
        return create.add_points_start(context.sketch, points)

    def build_preview(self, context: EditorContext, points: tuple[Point, ...]) -> EditorToolOverlay:
        """Return the start with the positions clicked so far."""
        label = f"{format_count(len(points) - 1, 'robot')}; Enter ends it"
        return EditorToolOverlay(start=PointsStart(points[:-1]), label=label)


class BoundaryTool(DrawTool):
    """Draws the boundary: a rectangle with a drag, or any outline corner by corner."""

    name = "boundary"
    title = "Boundary"
    key = "b"
    hint = "drag a rectangle, or click the corners and press Enter; type 10 x 8 after the first corner"
    min_points = 3
    is_closable = True
    allows_drag = True

    def build_change(self, context: EditorContext, points: Sequence[Point]) -> Change:
        """Return the change that replaces the boundary."""
        return create.set_boundary(context.sketch, points)

    def choose_point(self, event: EditorPointerEvent) -> Point:
        """Return the position of the next point, m; Shift has no effect while a rectangle is dragged."""
        if self.outline.is_dragging:
            return event.point
        return super().choose_point(event)

    def find_drag_end(self, text: str) -> Point | None:
        """Return the corner opposite to the first one if the text is a size such as 10 x 8; else None."""
        is_size = any(sign in text for sign in "x×*")
        if not is_size:
            return None
        return self._find_far_corner(text)

    def build_preview(self, context: EditorContext, points: tuple[Point, ...]) -> EditorToolOverlay:
        """Return the outline or, during a drag, the rectangle."""
        if not self.outline.is_dragging:
            return super().build_preview(context, points)
        (ax, ay), (bx, by) = points
        label = f"{format_length(abs(bx - ax))} x {format_length(abs(by - ay))}"
        return EditorToolOverlay(line=build_rectangle(*points), is_closed=True, label=label)


class RectangleTool(DrawTool):
    """Draws a rectangle between two opposite corners; with Shift, a square."""

    name = "rectangle"
    title = "Rectangle"
    key = "r"
    hint = "drag from corner to corner, or click both; type 3 x 2 for meters; Shift makes a square"
    max_points = 2
    allows_drag = True

    def build_change(self, context: EditorContext, points: Sequence[Point]) -> Change:
        """Return the change that adds the rectangle."""
        return create.add_rectangle(context.sketch, points)

    def find_drag_end(self, text: str) -> Point | None:
        """Return the corner opposite to the first one for a typed size."""
        return self._find_far_corner(text)

    def choose_point(self, event: EditorPointerEvent) -> Point:
        """Return the corner at the pointer; with Shift, the corner of a square."""
        if not event.shift or not self.points:
            return event.point
        x, y = self.points[0]
        to_x, to_y = event.point
        side = max(abs(to_x - x), abs(to_y - y))
        return x + copysign(side, to_x - x), y + copysign(side, to_y - y)

    def build_preview(self, context: EditorContext, points: tuple[Point, ...]) -> EditorToolOverlay:
        """Return the rectangle with its size and area."""
        (ax, ay), (bx, by) = points
        width = abs(bx - ax)
        height = abs(by - ay)
        ring = build_rectangle(*points)
        shapes = (PolygonObstacle(ring),) if min(width, height) > SAME_POINT_M else ()
        label = f"{format_length(width)} x {format_length(height)}   {width * height:.2f} m²"
        return EditorToolOverlay(line=ring, is_closed=True, shapes=shapes, label=label)


class CircleTool(DrawTool):
    """Draws a circle, given by its center and a point on its rim."""

    name = "circle"
    title = "Circle"
    key = "c"
    hint = "drag from the center to the rim, click both, or type the radius in meters"
    max_points = 2
    allows_drag = True

    def build_change(self, context: EditorContext, points: Sequence[Point]) -> Change:
        """Return the change that adds the circle."""
        return create.add_circle(context.sketch, points[0], distance(*points))

    def find_drag_end(self, text: str) -> Point:
        """Return the rightmost point of a circle with a typed radius."""
        return self.points[0][0] + parse_length(text), self.points[0][1]

    def build_preview(self, context: EditorContext, points: tuple[Point, ...]) -> EditorToolOverlay:
        """Return the circle with its radius."""
        radius = distance(*points)
        shapes = (CircleObstacle(points[0], radius),) if radius > SAME_POINT_M else ()
        return EditorToolOverlay(line=points, shapes=shapes, label=f"radius {format_length(radius)}")


class DiscTool(CircleTool):
    """Draws a disc-shaped start."""

    name = "disc"
    title = "Start disc"
    key = "s"
    hint = "drag from the center to the rim: the robots start somewhere in it; or type the radius in meters"

    def build_change(self, context: EditorContext, points: Sequence[Point]) -> Change:
        """Return the change that adds the start."""
        return create.add_disc_start(context.sketch, points[0], distance(*points))

    def build_preview(self, context: EditorContext, points: tuple[Point, ...]) -> EditorToolOverlay:
        """Return the disc with its radius."""
        radius = distance(*points)
        start = DiscStart(points[0], radius) if radius > SAME_POINT_M else None
        return EditorToolOverlay(line=points, start=start, label=f"radius {format_length(radius)}")
