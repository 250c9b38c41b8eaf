"""The mouse: what is pressed, dragged and let go where, and what that means."""

from collections.abc import Callable
from math import dist

import pygame

from robocov.environment import Point
from robocov_app.toolkit.input import DOUBLE, SLIP, WHEEL, show_cursor, wheel_notches
from robocov_app.toolkit.layout import inside
from robocov_app.viewer.canvas import ViewerCanvas
from robocov_app.viewer.chart import Chart
from robocov_app.viewer.panel import Panel
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.tools import Brush

_TAKES_ROBOTS = ("hand", "eraser", "failure")  # tools that take hold of a robot


class Pointer:
    """Turns events of the mouse into what panel, canvas, chart and tools do: the panel comes first."""

    def __init__(
        self, viewer: Presenter, canvas: ViewerCanvas, chart: Chart, panel: Panel, touched: Callable[[], None]
    ) -> None:
        self._viewer, self._canvas, self._chart, self._panel = viewer, canvas, chart, panel
        self._interrupt = touched  # a lesson waits
        self.at = (0, 0)
        self._drag = ""
        self._held = self._button = 0
        self._pressed_at = (0, 0)
        self._last_click = -1.0, (0, 0)
        self._shape = -1

    def take(self, event: pygame.event.Event, now: float) -> None:
        if event.type != pygame.MOUSEWHEEL:
            self.at = event.pos
        taken = not self._drag and self._panel.take(event)
        if event.type == pygame.MOUSEMOTION:
            self._moved(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            self._released(event)
        elif taken:
            self._viewer.cursor = None
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self._panel.ui.stop_typing()
            self._pressed(event, now)
        elif self._canvas.pane_at(self.at) is not None:
            factor = WHEEL ** wheel_notches(event)
            if isinstance(self._viewer.tool, Brush):
                self._viewer.widen(factor)
            else:
                self._canvas.zoom(factor, self.at)

    def show(self) -> None:
        """Let the cursor, and a ring around the robot under it, tell what a press would do."""
        viewer, canvas, layout = self._viewer, self._canvas, self._canvas.layout
        pane = canvas.pane_at(self.at) if viewer.cursor is not None else None
        if pane is not None:  # the cameras may have moved below it
            viewer.cursor, viewer.cursor_pane = canvas.to_world(self.at, pane), pane
        number = None
        if pane is not None and viewer.tool.name in _TAKES_ROBOTS:
            number = canvas.robot_at(self.at, pane)
        canvas.hovered = (-1, -1) if pane is None or number is None else (pane, number)
        if inside(layout.panel, self.at):
            self._shape = -1  # the panel has set its own
            return
        shape = pygame.SYSTEM_CURSOR_ARROW
        if number is not None:
            shape = pygame.SYSTEM_CURSOR_HAND
        elif pane is not None and viewer.tool is not viewer.hand:
            shape = pygame.SYSTEM_CURSOR_CROSSHAIR
        elif inside(layout.track, self.at) or inside(layout.chart, self.at):
            offered = self._chart.offers(self.at)
            shape = pygame.SYSTEM_CURSOR_HAND if offered else pygame.SYSTEM_CURSOR_SIZEWE
        if shape != self._shape:
            self._shape = shape
            show_cursor(shape)

    def leave(self) -> None:
        self._viewer.cursor = None
        self._chart.hover = None

    def _pressed(self, event: pygame.event.Event, now: float) -> None:
        viewer, layout = self._viewer, self._canvas.layout
        if self._drag:  # a second button while the first is held
            return
        pane = self._canvas.pane_at(event.pos)
        self._pressed_at, self._button = event.pos, event.button
        if inside(layout.track, event.pos) or inside(layout.chart, event.pos):
            if event.button == 1:
                self._press_chart(event.pos)
            return
        if pane is None or event.button not in (1, 2, 3):
            return
        brush = viewer.tool if isinstance(viewer.tool, Brush) else None
        if event.button != 1 and not (brush and event.button == 3):
            self._drag = "pan"
            return
        if brush:
            brush.lowers = event.button == 3
        self._interrupt()
        pane = min(pane, len(viewer.session.panes) - 1)
        if viewer.active != pane:
            viewer.active = pane
            viewer.version += 1
        then, where = self._last_click
        double = now - then < DOUBLE and dist(where, event.pos) < SLIP
        self._last_click = now, event.pos
        if double and viewer.tool.name in ("polygon", "wall"):
            viewer.attempt(viewer.finish)
            return
        point = self._canvas.to_world(event.pos, pane)
        number, reach = self._canvas.robot_at(event.pos, pane), self._canvas.reach(pane)
        viewer.attempt(lambda: viewer.tool.press(viewer.session, point, reach, number))
        if viewer.tool is viewer.hand and number is not None:
            self._panel.show_tab("robot")
        self._drag = "pan" if viewer.tool is viewer.hand and not viewer.hand.holds else "tool"
        self._held = pane

    def _press_chart(self, at: tuple[int, int]) -> None:
        viewer, chart = self._viewer, self._chart
        if chart.offers(at):
            viewer.attempt(chart.switch)
        elif (ghost := chart.ghost_at(at)) is not None:
            viewer.attempt(lambda: viewer.enter(ghost))
        else:
            self._interrupt()
            self._drag = "time"
            viewer.attempt(lambda: viewer.look_at(chart.time_at(at[0])))

    def _moved(self, event: pygame.event.Event) -> None:
        viewer = self._viewer
        pane, viewer.cursor = self._canvas.pane_at(event.pos), None
        if pane is not None and not inside(self._canvas.layout.panel, event.pos):
            viewer.cursor, viewer.cursor_pane = self._canvas.to_world(event.pos, pane), pane
        self._chart.hover = event.pos if not self._drag else None
        if self._drag == "time":
            viewer.attempt(lambda: viewer.look_at(self._chart.time_at(event.pos[0])))
        elif self._drag == "pan":
            self._canvas.pan(*event.rel)
        elif self._drag == "tool":
            viewer.attempt(lambda: viewer.tool.move(viewer.session, self._place(event.pos)))
        elif viewer.cursor is not None:
            viewer.tool.move(viewer.session, viewer.cursor)

    def _released(self, event: pygame.event.Event) -> None:
        viewer, drag = self._viewer, self._drag
        if event.button != self._button:  # another one than the one that is held
            return
        self._drag = ""
        clicked = dist(event.pos, self._pressed_at) < SLIP
        if drag == "tool":
            viewer.attempt(lambda: viewer.tool.release(viewer.session, self._place(event.pos)))
        elif drag == "pan" and clicked and event.button == 3:
            viewer.attempt(viewer.finish)
        elif drag == "pan" and clicked and event.button == 1 and viewer.tool is viewer.hand:
            viewer.hand.selected = None
            viewer.version += 1

    def _place(self, at: tuple[int, int]) -> Point:
        """Return the place under a pixel, m, in the pane in which the button was pressed."""
        return self._canvas.to_world(at, min(self._held, len(self._canvas.layout.panes) - 1))
