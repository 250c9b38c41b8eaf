"""Pictures of the map of a window in several sizes, for phones."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Protocol

from pygame import Surface

from robocov_app.toolkit.window.cover_picture import CoverPicture

if TYPE_CHECKING:
    from robocov_app.toolkit.window.command_window import CommandWindow

MAX_MAP_PICTURES = 8
"""Maximum number of pictures of different sizes that are kept."""


class MapPicture(Protocol):
    """Draws the map of a window without its buttons, in another size."""

    def draw(self, size: tuple[int, int], scale: float, *, is_controlling: bool) -> Surface:
        """Draw the map, as `robocov_app.toolkit.window.page_view.MapDrawing.draw` does."""

    def find_window_pixel(self, pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same as a pixel of the newest picture."""


class _PictureKey(NamedTuple):
    size: tuple[int, int]
    is_controlling: bool


class MapPictures:
    """Pictures of a window without its buttons in several sizes. See `MapDrawing`.

    Parameters
    ----------
    window : CommandWindow
        The window.
    create_picture : callable
        Returns a new picture of its map.
    """

    def __init__(self, window: CommandWindow, create_picture: Callable[[], MapPicture]) -> None:
        self._window = window
        self._create_picture = create_picture
        self._pictures: dict[_PictureKey, MapPicture] = {}
        self._cover = CoverPicture()

    @property
    def is_covered(self) -> bool:
        """Whether a dialog, a menu or the help page covers the map. See `MapDrawing`."""
        return self._window.find_cover() is not None

    def draw(self, size: tuple[int, int], scale: float, *, is_controlling: bool) -> Surface:
        """Draw the map without the buttons of the window. See `MapDrawing`."""
        key = _PictureKey(size, is_controlling)
        picture = self._pictures.get(key)
        if picture is None:
            if len(self._pictures) >= MAX_MAP_PICTURES:
                self._pictures.clear()
            picture = self._create_picture()
            self._pictures[key] = picture
        return picture.draw(size, scale, is_controlling=is_controlling)

    def draw_cover(self, size: tuple[int, int], scale: float) -> Surface:
        """Draw the dialog, the menu or the help page that covers the map. See `MapDrawing`."""
        window = self._window
        box = window.find_cover() or window.screen.get_rect()
        return self._cover.draw(window.screen, box, size, scale / window.layout.scale, window.theme)

    def find_window_pixel(self, size: tuple[int, int], pixel: tuple[float, float]) -> tuple[float, float]:
        """Return the pixel of the window that shows the same as a pixel of the picture. See `MapDrawing`."""
        if self.is_covered:
            return self._cover.find_window_pixel(size, pixel)
        picture = self._pictures.get(_PictureKey(size, is_controlling=True))
        if picture is None:
            return pixel
        return picture.find_window_pixel(pixel)
