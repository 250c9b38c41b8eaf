"""The mouse over the canvas and the plot: tools, panning, the time line."""

from collections.abc import Callable
from math import dist

import pygame

from robocov_app.toolkit.input import (
    DOUBLE_CLICK_S,
    MAX_CLICK_MOVE_PX,
    ZOOM_PER_NOTCH,
    get_wheel_notches,
)
from robocov_app.toolkit.layout import is_inside
from robocov_app.toolkit.mouse_cursor import MouseCursor
from robocov_app.toolkit.tool import CursorShape
from robocov_app.viewer.canvas import ViewerCanvas
from robocov_app.viewer.chart import Chart
from robocov_app.viewer.panel import ViewerPanel
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.tools.snapping import SNAP_REACH_FRACTION, snap_point
from robocov_app.viewer.tools.tool import ViewerPointerEvent

LEFT_BUTTON = 1
RIGHT_BUTTON = 3
BUTTONS = (1, 2, 3)  # left, middle, right
_NO_ROBOT = (-1, -1)


class DragGesture:
    """Gesture of a button that is held down: base class of the others."""

    def move(self, event: pygame.event.Event) -> None:
        """Handle a move of the mouse."""

    def release(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Handle the release; `is_click` if the mouse has not moved since the press."""


class PanGesture(DragGesture):
    """Pans the map. A click instead of a drag completes a drawing (right), or clears the selection (left)."""

    def __init__(self, viewer: Presenter, canvas: ViewerCanvas) -> None:
        self._viewer = viewer
        self._canvas = canvas

    def move(self, event: pygame.event.Event) -> None:
        """Move the map with the mouse."""
        self._canvas.pan(*event.rel)

    def release(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Complete a drawing, or clear the selection."""
        if not is_click:
            return
        viewer = self._viewer
        if event.button == RIGHT_BUTTON:
            viewer.attempt(viewer.finish_drawing)
        elif event.button == LEFT_BUTTON and viewer.tool is viewer.toolbox.hand:
            viewer.inspection.selected = None
            viewer.revision += 1


class ToolGesture(DragGesture):
    """Passes the drag on to the tool, in the pane in which the button was pressed."""

    def __init__(self, viewer: Presenter, canvas: ViewerCanvas, pane: int) -> None:
        self._viewer = viewer
        self._canvas = canvas
        self._pane = pane

    def move(self, event: pygame.event.Event) -> None:
        """Move the tool."""
        viewer = self._viewer
        pointer = self._build_event(event)
        viewer.attempt(lambda: viewer.tool.move(viewer.session, pointer))

    def release(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Release the tool."""
        viewer = self._viewer
        pointer = self._build_event(event)
        viewer.attempt(lambda: viewer.tool.release(viewer.session, pointer, clicked=is_click))

    def _build_event(self, event: pygame.event.Event) -> ViewerPointerEvent:
        # Panes may have been removed since the press.
        pane = min(self._pane, len(self._canvas.layout.panes) - 1)
        return build_pointer_event(self._viewer, self._canvas, event.pos, pane)


def build_pointer_event(
    viewer: Presenter, canvas: ViewerCanvas, pixel: tuple[int, int], pane: int, *, is_right: bool = False
) -> ViewerPointerEvent:
    """Return the pointer at a pixel of a pane, snapped to the map if the tool wants that.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    canvas : ViewerCanvas
        The panes.
    pixel : tuple of int
        Position, px.
    pane : int
        Index of the pane.
    is_right : bool
        Whether the right button is pressed.
    """
    raw = canvas.to_world(pixel, pane)
    reach = canvas.get_reach(pane)
    point = raw
    if viewer.tool.snaps:
        point = snap_point(viewer.session.displayed.environment, raw, SNAP_REACH_FRACTION * reach)
    robot = canvas.find_robot(pixel, pane) if viewer.tool.takes_robots else None
    return ViewerPointerEvent(point, raw, reach, robot=robot, is_right=is_right)


class TimeGesture(DragGesture):
    """Shows the time under the mouse."""

    def __init__(self, viewer: Presenter, chart: Chart) -> None:
        self._viewer = viewer
        self._chart = chart

    def move(self, event: pygame.event.Event) -> None:
        """Show the time under the mouse."""
        self._viewer.attempt(lambda: self._viewer.playback.look_at(self._chart.to_time(event.pos[0])))


class ViewerPointer:
    """Turns mouse events into actions of panel, canvas, plot and tools.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    canvas : ViewerCanvas
        The panes.
    chart : Chart
        Plot and time line.
    panel : ViewerPanel
        The panel, which gets events first.
    leave_lesson : callable
        Lets the user take over from a lesson.

    Attributes
    ----------
    at : tuple of int
        Pixel under the mouse.
    """

    def __init__(
        self,
        viewer: Presenter,
        canvas: ViewerCanvas,
        chart: Chart,
        panel: ViewerPanel,
        leave_lesson: Callable[[], None],
    ) -> None:
        self.at = (0, 0)
        self._viewer = viewer
        self._canvas = canvas
        self._chart = chart
        self._panel = panel
        self._leave_lesson = leave_lesson
        self._gesture: DragGesture | None = None
        self._button = 0
        self._pressed_at = (0, 0)
        self._last_click_s = -1.0
        self._last_click_at = (0, 0)

    def handle_event(self, event: pygame.event.Event, now: float) -> None:
        """Handle a mouse event at a time, s."""
        if event.type != pygame.MOUSEWHEEL:
            self.at = event.pos
        is_for_panel = self._gesture is None and self._panel.handle_event(event)
        if event.type == pygame.MOUSEMOTION:
            self._move(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            self._release(event)
        elif is_for_panel:
            self._viewer.inspection.cursor = None
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self._panel.ui.stop_typing()
            self._press(event, now)
        else:
            self._turn_wheel(event)

    def show_action(self, cursor: MouseCursor) -> None:
        """Show the effect of a press: by the cursor's shape, and a ring around the robot under it."""
        viewer = self._viewer
        inspection = viewer.inspection
        canvas = self._canvas
        pane = canvas.find_pane(self.at) if inspection.cursor is not None else None
        number: int | None = None
        if pane is not None:
            # The camera may have moved although the mouse has not.
            inspection.cursor = canvas.to_world(self.at, pane)
            inspection.cursor_pane = pane
            if viewer.tool.takes_robots:
                number = canvas.find_robot(self.at, pane)
        canvas.hovered = _NO_ROBOT
        if pane is not None and number is not None:
            canvas.hovered = (pane, number)
        cursor.show(self._choose_cursor(pane, number))

    def _choose_cursor(self, pane: int | None, number: int | None) -> CursorShape:
        viewer = self._viewer
        if number is not None:
            return "hand"
        if pane is not None:
            return viewer.tool.choose_cursor(viewer.session)
        if not self._is_over_time():
            return "arrow"
        return "hand" if self._chart.is_on_switch(self.at) else "sideways"

    def _is_over_time(self) -> bool:
        layout = self._canvas.layout
        return is_inside(layout.track, self.at) or is_inside(layout.chart, self.at)

    def _turn_wheel(self, event: pygame.event.Event) -> None:
        if self._canvas.find_pane(self.at) is None:
            return
        factor = ZOOM_PER_NOTCH ** get_wheel_notches(event)
        if self._viewer.tool.uses_wheel:
            self._viewer.resize_tool(factor)
        else:
            self._canvas.zoom(factor, self.at)

    def _press(self, event: pygame.event.Event, now: float) -> None:
        # While a button is held, others do nothing.
        if self._gesture is not None:
            return
        self._pressed_at = event.pos
        self._button = event.button
        if self._is_over_time():
            if event.button == LEFT_BUTTON:
                self._press_chart(event.pos)
            return
        pane = self._canvas.find_pane(event.pos)
        if pane is None or event.button not in BUTTONS:
            return
        tool = self._viewer.tool
        is_right = event.button == RIGHT_BUTTON
        if event.button == LEFT_BUTTON or (is_right and tool.uses_right_button):
            self._press_tool(event.pos, pane, now, is_right=is_right)
        else:
            self._gesture = PanGesture(self._viewer, self._canvas)

    def _press_chart(self, pixel: tuple[int, int]) -> None:
        viewer = self._viewer
        chart = self._chart
        if chart.is_on_switch(pixel):
            viewer.attempt(chart.switch_quantity)
            return
        node = chart.find_ghost(pixel)
        if node is not None:
            viewer.attempt(lambda: viewer.playback.enter_node(node))
            return
        self._leave_lesson()
        self._gesture = TimeGesture(viewer, chart)
        viewer.attempt(lambda: viewer.playback.look_at(chart.to_time(pixel[0])))

    def _press_tool(self, pixel: tuple[int, int], pane: int, now: float, *, is_right: bool) -> None:
        viewer = self._viewer
        canvas = self._canvas
        hand = viewer.toolbox.hand
        self._leave_lesson()
        # The session from before a lesson may have fewer panes.
        pane = min(pane, len(viewer.session.timeline.panes) - 1)
        if viewer.active_pane != pane:
            viewer.inspection.active_pane = pane
            viewer.revision += 1
        is_quick = now - self._last_click_s < DOUBLE_CLICK_S
        is_double = is_quick and dist(self._last_click_at, pixel) < MAX_CLICK_MOVE_PX
        self._last_click_s = now
        self._last_click_at = pixel
        pointer = build_pointer_event(viewer, canvas, pixel, pane, is_right=is_right)
        handle = viewer.tool.double_click if is_double else viewer.tool.press
        viewer.attempt(lambda: handle(viewer.session, pointer))
        if viewer.tool is hand and pointer.robot is not None:
            self._panel.show_tab("robot")
        if viewer.tool is hand and not hand.is_holding:
            self._gesture = PanGesture(viewer, canvas)
        else:
            self._gesture = ToolGesture(viewer, canvas, pane)

    def _move(self, event: pygame.event.Event) -> None:
        viewer = self._viewer
        inspection = viewer.inspection
        pane = self._canvas.find_pane(event.pos)
        inspection.cursor = None
        if pane is not None and not is_inside(self._canvas.layout.panel, event.pos):
            inspection.cursor = self._canvas.to_world(event.pos, pane)
            inspection.cursor_pane = pane
        self._chart.hover = event.pos if self._gesture is None else None
        if self._gesture is not None:
            self._gesture.move(event)
        elif inspection.cursor is not None:
            pointer = build_pointer_event(viewer, self._canvas, event.pos, inspection.cursor_pane)
            viewer.tool.move(viewer.session, pointer)

    def _release(self, event: pygame.event.Event) -> None:
        # Another button than the one that is held does nothing.
        if event.button != self._button:
            return
        gesture = self._gesture
        self._gesture = None
        if gesture is not None:
            gesture.release(event, is_click=dist(event.pos, self._pressed_at) < MAX_CLICK_MOVE_PX)
