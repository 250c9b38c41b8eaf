"""The panes without the controls of the window, drawn in the size of a small screen."""

from collections.abc import Callable
from typing import NamedTuple

import pygame

from robocov_app.look.theme import get_theme
from robocov_app.toolkit.window.layout import build_map_layout
from robocov_app.viewer.canvas.canvas import ViewerCanvas
from robocov_app.viewer.presenter import Presenter

MAX_MAP_PICTURES = 8  # of different sizes that are kept


class _LayoutKey(NamedTuple):
    """Everything on which the layout of the picture depends, to detect changes."""

    size: tuple[int, int]
    scale: float
    theme: str
    pane_count: int
    bounds: tuple[float, float, float, float]


class MapPicture:
    """Draws the panes of a window in another size, for somebody who watches on a phone.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    window_canvas : ViewerCanvas
        The canvas of the window, whose section of the map the picture shows.
    """

    def __init__(self, viewer: Presenter, window_canvas: ViewerCanvas) -> None:
        self._viewer = viewer
        self._window_canvas = window_canvas
        self._canvas = ViewerCanvas(viewer, window_canvas.theme, has_controls=False)
        self._layout_key: _LayoutKey | None = None

    def draw(self, size: tuple[int, int], scale: float) -> pygame.Surface:
        """Draw the panes.

        Parameters
        ----------
        size : (width, height), px
        scale : float
            Size of texts and symbols.

        Returns
        -------
        pygame.Surface
        """
        self._arrange(size, scale)
        surface = pygame.Surface(size, 0, 32)
        surface.fill(self._canvas.theme.background)
        self._canvas.camera.follow(self._window_canvas.camera)
        self._canvas.hovered = self._window_canvas.hovered
        self._canvas.draw(surface)
        return surface

    def find_window_pixel(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same point of the map as a pixel of the picture.

        A point that the window does not show becomes a pixel at the edge of its pane.
        """
        panes = self._window_canvas.layout.panes
        pane = min(self._canvas.find_pane(pixel) or 0, len(panes) - 1)
        x, y = self._window_canvas.to_pixel(self._canvas.to_world(pixel, pane), pane)
        left, top, width, height = panes[pane]
        return min(max(x, left), left + width - 1.0), min(max(y, top), top + height - 1.0)

    def _arrange(self, size: tuple[int, int], scale: float) -> None:
        """Lay out the panes if something has changed on which their layout depends."""
        session = self._viewer.session
        theme = self._viewer.view.theme
        bounds = session.displayed.environment.region.bounds
        key = _LayoutKey(size, scale, theme, len(session.timeline.panes), bounds)
        if key == self._layout_key:
            return
        self._layout_key = key
        low_x, low_y, high_x, high_y = bounds
        aspect = (high_x - low_x) / (high_y - low_y)
        layout = build_map_layout(size, scale, len(session.timeline.panes), aspect)
        self._canvas.arrange(layout, get_theme(theme))


class MapPictures:
    """Pictures of the map of a window in several sizes, for the phones of those who watch.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    window_canvas : ViewerCanvas
        The canvas of the window.
    is_covered : callable
        Returns whether something else is shown in front of the map.
    """

    def __init__(
        self, viewer: Presenter, window_canvas: ViewerCanvas, is_covered: Callable[[], bool]
    ) -> None:
        self._viewer = viewer
        self._window_canvas = window_canvas
        self._is_covered = is_covered
        self._pictures: dict[tuple[int, int], MapPicture] = {}

    def draw(self, size: tuple[int, int], scale: float) -> pygame.Surface | None:
        """Draw the panes without the controls; None while a page or a dialog is open. See `MapDrawing`."""
        if self._is_covered():
            return None
        picture = self._pictures.get(size)
        if picture is None:
            if len(self._pictures) >= MAX_MAP_PICTURES:
                self._pictures.clear()
            picture = MapPicture(self._viewer, self._window_canvas)
            self._pictures[size] = picture
        return picture.draw(size, scale)

    def find_window_pixel(self, size: tuple[int, int], pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same point of the map. See `MapDrawing`."""
        picture = self._pictures.get(size)
        if picture is None or self._is_covered():
            return pixel
        return picture.find_window_pixel(pixel)
