"""Scrubbing: dragging the time slider to display another time."""

import pygame

from robocov_app.toolkit.tools.pointer import Gesture
from robocov_app.viewer.chart.chart import Chart
from robocov_app.viewer.presenter import Presenter


class TimeGesture(Gesture):
    """Displays the time under the mouse while the time slider is dragged.

    Parameters
    ----------
    viewer : Presenter
    chart : Chart
    """

    def __init__(self, viewer: Presenter, chart: Chart) -> None:
        self._viewer = viewer
        self._chart = chart

    def move(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Display the time under the mouse."""
        self._viewer.attempt(lambda: self._viewer.playback.show_time(self._chart.to_time(event.pos[0])))
