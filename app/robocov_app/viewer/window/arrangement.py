"""The layout of the window, which depends on its size, its settings, and the panes and the lesson shown."""

from collections.abc import Sequence
from typing import NamedTuple

from robocov_app.look.theme import Theme, get_theme
from robocov_app.toolkit.window.layout import Layout, build_layout, compute_aspect, uses_sheet
from robocov_app.toolkit.window_part import WindowPart
from robocov_app.viewer.canvas.canvas import ViewerCanvas
from robocov_app.viewer.chart.chart import Chart
from robocov_app.viewer.lessons.guide import LessonGuide
from robocov_app.viewer.presenter import Presenter

_ASPECT_DECIMALS = 3  # smaller changes of the shape of the map do not change the layout


class _FrameSettings(NamedTuple):
    """Settings on which all parts of the layout depend."""

    size: tuple[int, int]
    scale: float
    has_panel: bool
    is_compact: bool
    theme: str


class LayoutKey(NamedTuple):
    """Everything on which the layout depends, to detect changes."""

    frame: _FrameSettings
    pane_count: int
    aspect: float


class Arrangement:
    """Lays out the parts of the window when something has changed on which the layout depends.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    lesson : LessonGuide
        The lesson, if there is one.
    canvas : ViewerCanvas
        The panes.
    chart : Chart
        The chart and the time slider.
    parts : sequence of WindowPart
        Top bar, tool rail and panel.

    Attributes
    ----------
    key : LayoutKey or None
        Everything on which the current layout depends; None before the first `update`.
    layout : Layout
        Boxes of the window.
    theme : Theme
        Colors.
    """

    layout: Layout
    theme: Theme

    def __init__(
        self,
        viewer: Presenter,
        lesson: LessonGuide,
        canvas: ViewerCanvas,
        chart: Chart,
        parts: Sequence[WindowPart],
    ) -> None:
        self.key: LayoutKey | None = None
        self._viewer = viewer
        self._lesson = lesson
        self._canvas = canvas
        self._chart = chart
        self._parts = parts

    def update(self, size: tuple[int, int], scale: float) -> None:
        """Lay out the parts of a window of the given size, px, and scale, if anything has changed."""
        before = self.key
        aspect = compute_aspect(self._viewer.session.displayed.environment.region.bounds)
        frame = self._build_frame_settings(size, scale)
        panes = len(self._viewer.session.timeline.panes)
        key = LayoutKey(frame, panes, round(aspect, _ASPECT_DECIMALS))
        if key == before:
            return
        self.key = key
        self.theme = get_theme(frame.theme)
        self.layout = build_layout(
            size, scale, panes, aspect, panel=frame.has_panel, is_compact=frame.is_compact
        )
        self._canvas.arrange(self.layout, self.theme)
        self._chart.arrange(self.layout, self.theme)
        # The parts do not depend on the panes.
        if before is None or frame != before.frame:
            for part in self._parts:
                part.arrange(self.layout, self.theme)

    def _build_frame_settings(self, size: tuple[int, int], scale: float) -> _FrameSettings:
        view = self._viewer.view
        return _FrameSettings(
            size=size,
            scale=scale,
            has_panel=view.has_panel or self._has_lesson_sheet(size, scale),
            is_compact=view.is_compact,
            theme=view.theme,
        )

    def _has_lesson_sheet(self, size: tuple[int, int], scale: float) -> bool:
        """Return whether a lesson is shown in a sheet, because there is no space for a card over the map."""
        if self._lesson.shown is None:
            return False
        return self._viewer.view.is_compact or uses_sheet(size, scale)
