"""The mouse over the viewer's canvas and chart: tools, panning, the time slider."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pygame

from robocov_app.toolkit.tools.pointer import (
    LEFT_BUTTON,
    RIGHT_BUTTON,
    Gesture,
    PanGesture,
    Pixel,
    Pointer,
    read_modifiers,
)
from robocov_app.toolkit.tools.tool import CursorShape
from robocov_app.toolkit.window.input import ZOOM_PER_NOTCH, get_wheel_notches
from robocov_app.toolkit.window.layout import is_inside
from robocov_app.toolkit.window.mouse_cursor import MouseCursor
from robocov_app.toolkit.window_part import WindowPart
from robocov_app.viewer.canvas.canvas import HoveredRobot, ViewerCanvas
from robocov_app.viewer.canvas.layer_bar import LayerBar
from robocov_app.viewer.chart.chart import Chart
from robocov_app.viewer.chart.scrubbing import TimeGesture
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.editing import map_edits
from robocov_app.viewer.tools.snapping import MapSnapper
from robocov_app.viewer.tools.tool import ViewerPointerEvent

MENU_REACH_FRACTION = 0.5  # fraction of the reach within which a right click selects an obstacle


@dataclass(frozen=True)
class PointerTargets:
    """Parts of the window that the mouse acts on.

    Attributes
    ----------
    canvas : ViewerCanvas
        The panes.
    chart : Chart
        The chart and the time slider.
    layer_bar : LayerBar
        The chips over the canvas.
    parts : sequence of WindowPart
        Top bar, tool rail and panel, which get events first.
    """

    canvas: ViewerCanvas
    chart: Chart
    layer_bar: LayerBar
    parts: Sequence[WindowPart]


@dataclass(frozen=True)
class PointerActions:
    """Functions of the window that the mouse calls.

    Attributes
    ----------
    leave_lesson : callable
        Lets the user take over from a lesson.
    open_menu : callable
        Opens the context menu at a pixel.
    show_robot_page : callable
        Shows the page of the panel that describes the selected robot.
    """

    leave_lesson: Callable[[], None]
    open_menu: Callable[[Pixel], None]
    show_robot_page: Callable[[], None]


class ViewerPointer(Pointer):
    """Turns mouse events into actions on the canvas, the chart and the tools.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    targets : PointerTargets
        Parts of the window that the mouse acts on.
    actions : PointerActions
        Functions of the window that the mouse calls.
    """

    def __init__(self, viewer: Presenter, targets: PointerTargets, actions: PointerActions) -> None:
        """Connect the mouse to the parts of the window."""
        super().__init__(targets.parts)
        self._viewer = viewer
        self._canvas = targets.canvas
        self._chart = targets.chart
        self._layer_bar = targets.layer_bar
        self._actions = actions
        self._snapper = MapSnapper()

    def get_scale(self) -> float:
        """Return the scale of the window."""
        return self._canvas.layout.scale

    def show_action(self, cursor: MouseCursor) -> None:
        """Show the effect of a press by the cursor shape and a ring around the robot under the cursor."""
        viewer = self._viewer
        inspection = viewer.inspection
        canvas = self._canvas
        if self._layer_bar.is_over(self.pixel) and not self.is_busy:
            canvas.hovered = None
            cursor.show("hand")
            return
        pane = canvas.find_pane(self.pixel) if inspection.cursor is not None else None
        number: int | None = None
        if pane is not None:
            # The camera may have moved even if the mouse has not.
            inspection.cursor = canvas.to_world(self.pixel, pane)
            inspection.cursor_pane = pane
            if viewer.tool.takes_robots:
                number = canvas.find_robot(self.pixel, pane)
        canvas.hovered = None
        if pane is not None and number is not None:
            canvas.hovered = HoveredRobot(pane, number)
        cursor.show(self._choose_cursor(pane, number))

    def _choose_cursor(self, pane: int | None, number: int | None) -> CursorShape:
        """Return the cursor shape over a robot, a pane, or the chart."""
        viewer = self._viewer
        if number is not None:
            return "hand"
        if pane is not None:
            return viewer.tool.choose_cursor(viewer.session)
        if not self._is_over_time():
            return "arrow"
        is_on_branch = self._chart.find_branch(self.pixel) is not None
        if is_on_branch or self._chart.is_on_switch(self.pixel):
            return "hand"
        return "sideways"

    def _is_over_time(self) -> bool:
        layout = self._canvas.layout
        return is_inside(layout.time_slider, self.pixel) or is_inside(layout.chart, self.pixel)

    def leave(self) -> None:
        """React when the mouse leaves the panes."""
        self._viewer.inspection.cursor = None
        self._chart.hover = None
        self._layer_bar.hover(None)

    def zoom(self, factor: float) -> None:
        """Zoom by a factor about the mouse if it is over a pane, else about the center of the first pane."""
        canvas = self._canvas
        left, top, width, height = canvas.layout.panes[0]
        center: tuple[float, float] = (left + width / 2, top + height / 2)
        if canvas.find_pane(self.pixel) is not None:
            center = self.pixel
        canvas.zoom(factor, center)

    def handle_wheel(self, event: pygame.event.Event) -> None:
        """Zoom the map, or change the size of the tool."""
        if self._canvas.find_pane(self.pixel) is None or self._layer_bar.is_over(self.pixel):
            return
        factor = ZOOM_PER_NOTCH ** get_wheel_notches(event)
        if self._viewer.tool.uses_wheel:
            self._viewer.resize_tool(factor)
        else:
            self._canvas.zoom(factor, self.pixel)

    def start_gesture(self, event: pygame.event.Event, now: float) -> Gesture | None:
        """Start a gesture on the chart, with the tool, or for panning; None if the press starts none."""
        if event.button == LEFT_BUTTON and self._layer_bar.press(event.pos):
            return None
        if self._is_over_time():
            if event.button == LEFT_BUTTON:
                return self._press_chart(event.pos)
            return None
        pane = self._canvas.find_pane(event.pos)
        if pane is None:
            return None
        is_right = event.button == RIGHT_BUTTON
        if event.button == LEFT_BUTTON or (is_right and self._viewer.tool.uses_right_button):
            return self._press_tool(event, pane, now)
        return PanGesture(self._canvas.camera.pan, self._click_without_tool)

    def _press_chart(self, pixel: Pixel) -> Gesture | None:
        """Handle a press on the chart: switch the quantity, open a branch, or show the time at the mouse.

        Only the last of these continues as a gesture, which is returned.
        """
        viewer = self._viewer
        chart = self._chart
        if chart.is_on_switch(pixel):
            viewer.attempt(chart.switch_quantity)
            return None
        node = chart.find_branch(pixel)
        if node is not None:
            viewer.attempt(lambda: viewer.playback.go_to_node(node))
            return None
        self._actions.leave_lesson()
        viewer.attempt(lambda: viewer.playback.show_time(chart.to_time(pixel[0])))
        return TimeGesture(viewer, chart)

    def _press_tool(self, event: pygame.event.Event, pane: int, now: float) -> Gesture:
        """Pass a press to the tool in a pane; with the hand on the bare floor, pan the map instead."""
        viewer = self._viewer
        canvas = self._canvas
        hand = viewer.toolbox.hand
        self._actions.leave_lesson()
        # Leaving a lesson may have brought back a session with fewer panes.
        pane = min(pane, len(viewer.session.timeline.panes) - 1)
        if viewer.active_pane != pane:
            viewer.inspection.active_pane = pane
            viewer.revision += 1
        is_right = event.button == RIGHT_BUTTON
        pointer = self.build_event(event.pos, pane, is_right=is_right)
        is_double = self.record_press(event, now) > 1
        handle = viewer.tool.double_click if is_double else viewer.tool.press
        viewer.attempt(lambda: handle(viewer.session, pointer))
        if viewer.tool is not hand:
            return ViewerToolGesture(self, pane)
        if pointer.robot is not None:
            self._actions.show_robot_page()
        if hand.is_holding:
            return ViewerToolGesture(self, pane)
        return PanGesture(canvas.camera.pan, self._click_without_tool)

    def build_event(self, pixel: Pixel, pane: int, *, is_right: bool = False) -> ViewerPointerEvent:
        """Build the tool event for a pixel of a pane; the point is snapped to the map if the tool snaps.

        Parameters
        ----------
        pixel : tuple of int
            Position, px.
        pane : int
            Index of the pane; panes may have been removed since the button was pressed.
        is_right : bool
            Whether the right button is pressed.
        """
        canvas = self._canvas
        viewer = self._viewer
        pane = min(pane, len(canvas.layout.panes) - 1)
        unsnapped = canvas.to_world(pixel, pane)
        reach = canvas.get_reach(pane)
        point = unsnapped
        if viewer.tool.snaps:
            point = self._snapper.snap(viewer.session.displayed.environment, unsnapped, reach)
        robot = canvas.find_robot(pixel, pane) if viewer.tool.takes_robots else None
        modifiers = read_modifiers()
        return ViewerPointerEvent(
            point=point,
            unsnapped_point=unsnapped,
            reach=reach,
            shift=modifiers.shift,
            alt=modifiers.alt,
            ctrl=modifiers.ctrl,
            robot=robot,
            is_right=is_right,
        )

    def move_tool(self, event: pygame.event.Event, pane: int) -> None:
        """Pass a move of the mouse in a pane to the tool."""
        viewer = self._viewer
        pointer = self.build_event(event.pos, pane)
        viewer.attempt(lambda: viewer.tool.move(viewer.session, pointer))

    def release_tool(self, event: pygame.event.Event, pane: int, *, is_click: bool) -> None:
        """Pass the release of the button in a pane to the tool."""
        viewer = self._viewer
        pointer = self.build_event(event.pos, pane)
        viewer.attempt(lambda: viewer.tool.release(viewer.session, pointer, is_click=is_click))

    def _click_without_tool(self, event: pygame.event.Event) -> None:
        """Handle a click that did not pan.

        The right button completes a drawing or opens the context menu, the left one deselects.
        """
        viewer = self._viewer
        if event.button == LEFT_BUTTON and viewer.tool is viewer.toolbox.hand:
            viewer.inspection.clear()
            viewer.revision += 1
        if event.button != RIGHT_BUTTON:
            return
        if viewer.tool.is_busy:
            viewer.attempt(viewer.finish_drawing)
        else:
            self._select_at(event.pos)
            self._actions.open_menu(event.pos)

    def _select_at(self, pixel: Pixel) -> None:
        """Select the robot or the obstacle at a pixel of a pane; nothing on the bare floor.

        If the obstacle is one of several selected ones, all of them stay selected.
        """
        viewer = self._viewer
        pane = self._canvas.find_pane(pixel)
        if pane is None:
            return
        viewer.revision += 1
        number = self._canvas.find_robot(pixel, pane)
        if number is not None:
            viewer.inspection.select_robot(number)
            return
        environment = viewer.session.displayed.environment
        reach = MENU_REACH_FRACTION * self._canvas.get_reach(pane)
        index = map_edits.find_obstacle(environment, self._canvas.to_world(pixel, pane), reach)
        if index is None:
            viewer.inspection.clear()
        elif environment.obstacles[index] not in viewer.inspection.obstacles:
            viewer.inspection.select_obstacles((environment.obstacles[index],))

    def hover(self, event: pygame.event.Event) -> None:
        """Update the inspected point, and while no button is held down, the tool and the chart's tag."""
        viewer = self._viewer
        inspection = viewer.inspection
        pane = self._canvas.find_pane(event.pos)
        inspection.cursor = None
        self._layer_bar.hover(None if self.is_busy else event.pos)
        if self._layer_bar.is_over(event.pos) and not self.is_busy:
            self._chart.hover = None
            return
        if pane is not None and not is_inside(self._canvas.layout.panel, event.pos):
            inspection.cursor = self._canvas.to_world(event.pos, pane)
            inspection.cursor_pane = pane
        self._chart.hover = None if self.is_busy else event.pos
        if inspection.cursor is not None and not self.is_busy:
            pointer = self.build_event(event.pos, inspection.cursor_pane)
            viewer.tool.move(viewer.session, pointer)


class ViewerToolGesture(Gesture):
    """Passes a drag to the tool, in the pane in which the button was pressed.

    Parameters
    ----------
    pointer : ViewerPointer
        The mouse over the panes.
    pane : int
        Index of the pane.
    """

    def __init__(self, pointer: ViewerPointer, pane: int) -> None:
        self._pointer = pointer
        self._pane = pane

    def move(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Pass a move to the tool."""
        self._pointer.move_tool(event, self._pane)

    def release(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Pass the release of the button to the tool."""
        self._pointer.release_tool(event, self._pane, is_click=is_click)
