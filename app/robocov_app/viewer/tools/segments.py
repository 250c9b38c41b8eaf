"""Tools for drags from one point to another: the ruler, and circles that are drawn from their center."""

from contextlib import suppress
from dataclasses import dataclass, field
from math import dist

import numpy as np

from robocov.environment import CircleObstacle, Point
from robocov.errors import RobocovError
from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.tools.tool import ViewerPointerEvent, ViewerTool, ViewerToolOverlay, add_obstacle


@dataclass
class DraggedSegment:
    """Segment from the point where the button was pressed to the cursor.

    Attributes
    ----------
    start : Point or None
        Where the button was pressed, m; None before that.
    end : Point
        Last position of the cursor while the button was held, m.
    is_pressed : bool
        Whether the button is held down.
    """

    start: Point | None = None
    end: Point = (0.0, 0.0)
    is_pressed: bool = False

    def press(self, point: Point) -> None:
        """Start a new segment."""
        self.start = point
        self.end = point
        self.is_pressed = True

    def move(self, point: Point) -> None:
        """Move the end of the segment while the button is held down."""
        if self.is_pressed:
            self.end = point

    def release(self) -> None:
        """Keep the segment as it is."""
        self.is_pressed = False

    def clear(self) -> bool:
        """Discard the segment; return whether there was one."""
        was_drawn = self.start is not None
        self.start = None
        return was_drawn


@dataclass
class SegmentTool(ViewerTool):
    """Base class of tools for drags from one point to another.

    Attributes
    ----------
    segment : DraggedSegment
    """

    segment: DraggedSegment = field(default_factory=DraggedSegment, repr=False)

    def press(self, session: Session, event: ViewerPointerEvent) -> str | None:
        """Start a segment."""
        self.segment.press(event.unsnapped_point)
        return None

    def move(self, session: Session, event: ViewerPointerEvent) -> None:
        """Drag the end of the segment to the cursor; with Shift, its angle is a multiple of 45°."""
        self.segment.move(event.constrain(self.segment.start))

    def cancel(self, session: Session) -> bool:
        """Discard the segment; return whether there was one."""
        return self.segment.clear()


@dataclass
class RulerTool(SegmentTool):
    """Measures the distance between two points."""

    name = "ruler"
    title = "Ruler"
    key = "m"
    hint = "drag from one point to another"

    def release(self, session: Session, event: ViewerPointerEvent, *, is_click: bool) -> str | None:
        """Keep the measurement visible until the next press; after a click, show a hint."""
        self.segment.release()
        if is_click:
            return "nothing measured: drag from one point to another"
        return None

    def build_overlay(self, session: Session) -> ViewerToolOverlay:
        """Return the segment with its length and its components."""
        start = self.segment.start
        if start is None:
            return ViewerToolOverlay()
        end = self.segment.end
        dx = end[0] - start[0]
        dy = end[1] - start[1]
        # A minus sign is as wide as a digit, unlike a hyphen.
        components = f"(Δx {dx:.2f}, Δy {dy:.2f})".replace("-", "−")
        return ViewerToolOverlay((start, end), label=f"{np.hypot(dx, dy):.2f} m  {components}")


@dataclass
class AddCircleTool(SegmentTool):
    """Draws a circular obstacle from its center."""

    name = "circle"
    title = "Circle"
    key = "c"
    hint = "drag from the center to the rim"

    def release(self, session: Session, event: ViewerPointerEvent, *, is_click: bool) -> str | None:
        """Add the circle to the map."""
        center = self.segment.start
        self.segment.clear()
        if center is None:
            return None
        return add_obstacle(session, map_edits.build_circle(center, event.unsnapped_point), self.name)

    def build_overlay(self, session: Session) -> ViewerToolOverlay:
        """Return a preview of the circle whose rim passes through the cursor."""
        center = self.segment.start
        if center is None:
            return ViewerToolOverlay()
        rim = self.segment.end
        circles: tuple[CircleObstacle, ...] = ()
        # A circle whose radius is almost zero is not an obstacle yet.
        with suppress(RobocovError):
            circles = (map_edits.build_circle(center, rim),)
        return ViewerToolOverlay((center, rim), obstacles=circles, label=f"radius {dist(center, rim):.2f} m")
