"""The map of a window in the sizes of the pages that show it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from time import monotonic
from typing import TYPE_CHECKING

import numpy as np
from pygame import Surface

from robocov_app.web.frames import Frame
from robocov_app.web.pages import MapSize

if TYPE_CHECKING:
    from robocov_app.toolkit.window.page_view import MapDrawing
    from robocov_app.toolkit.window.window import BaseWindow

MAP_FRAME_INTERVAL_S = 1 / 15
"""Minimum time between two pictures of the map in one size."""
MAX_TIME_FRACTION = 0.25
"""Maximum fraction of the time of the window's thread in which these pictures are drawn."""


class MapFrames:
    """Draws the map in all requested sizes, only as often as spectators need it.

    The server's thread sets `requested_sizes` and reads `frames`, the window's thread calls `update`.

    Attributes
    ----------
    requested_sizes : frozenset of MapSize
        Sizes of the pages that show the map.
    frames : dict of MapSize to Frame
        The newest picture of each size; empty if all pages have to show the window itself.
    """

    def __init__(self) -> None:
        self.requested_sizes: frozenset[MapSize] = frozenset()
        self.frames: dict[MapSize, Frame] = {}
        self._drawn_window: Frame | None = None
        self._drawn_sizes: Collection[MapSize] = ()
        self._next_time = 0.0

    def update(self, window: BaseWindow, window_frame: Frame, create_number: Callable[[], int]) -> bool:
        """Draw the map again if the window has changed.

        Parameters
        ----------
        window : BaseWindow
        window_frame : Frame
            The newest frame of the window.
        create_number : callable
            Returns the number of a new frame.

        Returns
        -------
        bool
            Whether `frames` has changed.
        """
        sizes = self.requested_sizes
        start_time = monotonic()
        is_up_to_date = window_frame is self._drawn_window and sizes == self._drawn_sizes
        if is_up_to_date or start_time < self._next_time:
            return False
        self._drawn_window = window_frame
        self._drawn_sizes = sizes
        frames: dict[MapSize, Frame] = {}
        if window.map_pictures is not None:
            for size in sizes:
                frame = Frame.from_surface(_draw_picture(window.map_pictures, size), create_number())
                previous = self.frames.get(size)
                is_same = previous is not None and np.array_equal(previous.pixels, frame.pixels)
                frames[size] = previous if previous is not None and is_same else frame
        duration = monotonic() - start_time
        self._next_time = start_time + max(MAP_FRAME_INTERVAL_S, duration / MAX_TIME_FRACTION)
        has_changed = frames != self.frames
        self.frames = frames
        return has_changed


def _draw_picture(pictures: MapDrawing, size: MapSize) -> Surface:
    """Draw the map in a size, or what covers it, for the page that controls the window."""
    if size.is_controlling and pictures.is_covered:
        return pictures.draw_cover((size.width, size.height), size.scale)
    return pictures.draw((size.width, size.height), size.scale, is_controlling=size.is_controlling)
