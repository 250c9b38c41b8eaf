"""The window without its buttons, drawn in the size of the screen of a phone."""

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import pygame

from robocov_app.look.theme import get_theme
from robocov_app.toolkit.window.layout import build_layout, compute_aspect, is_inside
from robocov_app.viewer.canvas.canvas import FINGER_RADIUS_PX, ViewerCanvas
from robocov_app.viewer.chart.chart import Chart
from robocov_app.viewer.lessons.guide import LessonGuide
from robocov_app.viewer.lessons.page import ClickArea
from robocov_app.viewer.lessons.sheet import draw_lesson_sheet
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.window.status_display import StatusDisplay

_UNUSED_PIXEL = (1.0, 1.0)  # of the window, in the margin of its bar, where a press has no effect


class _LayoutKey(NamedTuple):
    """Everything on which the layout of the picture depends, to detect changes."""

    size: tuple[int, int]
    scale: float
    theme: str
    pane_count: int
    bounds: tuple[float, float, float, float]
    has_lesson: bool


@dataclass(frozen=True)
class PictureSources:
    """Parts of the window that its pictures show.

    Attributes
    ----------
    canvas : ViewerCanvas
        The panes, whose section of the map the pictures show.
    chart : Chart
        The chart and the time slider.
    lesson : LessonGuide
        The lesson, if there is one.
    status : StatusDisplay
        The message above the map.
    """

    canvas: ViewerCanvas
    chart: Chart
    lesson: LessonGuide
    status: StatusDisplay


class ViewerMapPicture:
    """Draws panes, chart, message and lesson of a window in another size. See `MapPicture`.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    sources : PictureSources
        Parts of the window that the picture shows.
    """

    def __init__(self, viewer: Presenter, sources: PictureSources) -> None:
        self._viewer = viewer
        self._sources = sources
        self._canvas = ViewerCanvas(viewer, sources.canvas.theme, has_controls=False)
        self._chart = Chart(viewer)
        self._lesson_areas: list[ClickArea] = []
        self._layout_key: _LayoutKey | None = None

    def draw(self, size: tuple[int, int], scale: float, *, is_controlling: bool) -> pygame.Surface:
        """Draw the panes, the chart, the message and the lesson. See `MapPicture`."""
        self._arrange(size, scale)
        theme = self._canvas.theme
        layout = self._canvas.layout
        surface = pygame.Surface(size, 0, 32)
        surface.fill(theme.background)
        window_canvas = self._sources.canvas
        self._canvas.camera.follow(window_canvas.camera)
        self._canvas.hovered = window_canvas.hovered
        self._canvas.draw(surface)
        if is_controlling:
            window_canvas.finger_reach = FINGER_RADIUS_PX * scale / self._canvas.get_zoom()
        self._chart.draw(surface)
        self._lesson_areas = []
        lesson = self._sources.lesson.shown
        if lesson is not None:
            self._lesson_areas, _, _ = draw_lesson_sheet(
                surface, layout, theme, lesson, None, has_buttons=is_controlling
            )
        find_strip_texts = partial(self._canvas.find_strip_texts, surface)
        self._sources.status.draw_message(surface, layout, theme, find_strip_texts)
        return surface

    def find_window_pixel(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same as a pixel of the picture.

        A point of the map that the window does not show becomes a pixel at the edge of its pane. A button of
        the lesson becomes the same button of the window.
        """
        layout = self._canvas.layout
        if is_inside(layout.panel, pixel) or is_inside(layout.handle, pixel):
            return self._find_lesson_pixel(pixel)
        if is_inside(layout.chart, pixel) or is_inside(layout.time_slider, pixel):
            return self._find_time_pixel(pixel)
        panes = self._sources.canvas.layout.panes
        pane = min(self._canvas.find_pane(pixel) or 0, len(panes) - 1)
        return panes[pane].clamp(self._sources.canvas.to_pixel(self._canvas.to_world(pixel, pane), pane))

    def _find_lesson_pixel(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the center of the window's button that a button of the lesson in the picture stands for."""
        pressed = [area.name for area in self._lesson_areas if area.box.collidepoint(pixel)]
        for area in self._sources.lesson.click_areas:
            if area.name in pressed:
                x, y = area.box.center
                return float(x), float(y)
        return _UNUSED_PIXEL

    def _find_time_pixel(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel on the time slider of the window with the time of a pixel of the picture."""
        slider = self._sources.chart.layout.time_slider
        column = self._sources.chart.to_column(self._chart.to_time(pixel[0]))
        return slider.clamp((column, slider.top + 0.5 * slider.height))

    def _arrange(self, size: tuple[int, int], scale: float) -> None:
        """Lay out the picture if something has changed on which its layout depends."""
        session = self._viewer.session
        theme = self._viewer.view.theme
        bounds = session.displayed.environment.region.bounds
        has_lesson = self._sources.lesson.shown is not None
        panes = len(session.timeline.panes)
        key = _LayoutKey(size, scale, theme, panes, bounds, has_lesson)
        if key == self._layout_key:
            return
        self._layout_key = key
        layout = build_layout(size, scale, panes, compute_aspect(bounds), panel=has_lesson, is_compact=True)
        self._canvas.arrange(layout, get_theme(theme))
        self._chart.arrange(layout, get_theme(theme))
