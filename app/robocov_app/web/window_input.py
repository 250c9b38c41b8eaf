"""Input of the controlling page, passed from the server's thread to the window's thread."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING

import pygame

from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.page_view import PageAppearance
from robocov_app.web.events import (
    EventTranslator,
    InputMessage,
    PageChanged,
    PointerMessage,
    Uploaded,
    get_modifiers,
)
from robocov_app.web.pages import MapSize

if TYPE_CHECKING:
    from robocov_app.toolkit.window.window import BaseWindow

MAX_WAITING_MESSAGES = 5000
"""If more messages are waiting, the server stops reading until the window has caught up."""
_MIN_WAIT_S = 0.001
"""Lets other threads run even if the window would not wait."""
_DIALOG_MARGINS_PX = 16.0
"""Width to the left and right of dialogs on a phone, together, at scale 1."""


class WindowInput:
    """Messages and settings of the controlling page, on their way to the window.

    The server's thread calls `put` and `set_page`, the window's thread `wait` and `post`.

    Parameters
    ----------
    clipboard : Clipboard
        Clipboard that receives text pasted in the page.
    """

    def __init__(self, clipboard: Clipboard) -> None:
        self._messages: deque[InputMessage | Uploaded] = deque()
        self._page: PageChanged | None = None
        self._fitted: tuple[PageChanged, MapSize | None] | None = None
        self._map_size: MapSize | None = None
        self._is_small = False
        self._translator = EventTranslator(clipboard)
        self._held = 0
        self._has_arrived = threading.Event()

    @property
    def is_full(self) -> bool:
        """Whether the queue is full, so that no more messages should be read."""
        return len(self._messages) > MAX_WAITING_MESSAGES

    def put(self, message: InputMessage | Uploaded) -> None:
        """Pass a message to the window."""
        self._messages.append(message)
        self._has_arrived.set()

    def set_page(self, page: PageChanged | None, map_size: MapSize | None = None) -> None:
        """Let the window adopt the size and color scheme of a page; None changes nothing.

        Parameters
        ----------
        page : PageChanged or None
        map_size : MapSize or None
            Size of the map if the controlling page shows it instead of the window.
        """
        self._page = page or self._page
        self._map_size = map_size
        self._has_arrived.set()

    def wait(self, seconds: float) -> None:
        """Wait until something arrives, at most for the given time."""
        if self._has_arrived.wait(max(seconds, _MIN_WAIT_S)):
            self._has_arrived.clear()

    def post(self, window: BaseWindow) -> None:
        """Fit the window to the page, and post the received messages as pygame events."""
        page = self._page
        if page is not None and self._fitted != (page, self._map_size):
            self._fitted = (page, self._map_size)
            self._fit(window, page)
        has_posted = False
        while self._messages:
            held = getattr(self._messages[0], "held", self._held)
            if held != self._held:
                if has_posted:
                    # pygame has one global state of held modifier keys, so the window must first handle the
                    # events posted so far. It gets the others in the next frame, which must not wait for
                    # new input.
                    self._has_arrived.set()
                    return
                self._held = held
                pygame.key.set_mods(get_modifiers(held))
            message = self._convert_pixel(self._messages.popleft(), window)
            for event in self._translator.translate(message):
                pygame.event.post(event)
                has_posted = True

    def _convert_pixel(self, message: InputMessage | Uploaded, window: BaseWindow) -> InputMessage | Uploaded:
        """Convert a pixel of the map that a phone shows to the pixel of the window with the same point."""
        size = self._map_size
        if size is None or not isinstance(message, PointerMessage):
            return message
        pictures = (window.replacement or window).map_pictures
        if pictures is None:
            return message
        x, y = pictures.find_window_pixel((size.width, size.height), (message.x, message.y))
        return message.model_copy(update={"x": x, "y": y})

    def _fit(self, window: BaseWindow, page: PageChanged) -> None:
        """Give the window the size, scale and color scheme of a page."""
        size = (page.width, page.height)
        if window.screen.get_size() != size:
            pygame.display.set_mode(size, pygame.RESIZABLE)
            pygame.event.post(pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
        theme = "dark" if page.dark else "light"
        # Show or hide the panel only when a page becomes large or small, so that the user's choice is kept.
        is_small = page.is_small
        shows_panel: bool | None = None
        if is_small != self._is_small:
            shows_panel = not is_small
        self._is_small = is_small
        appearance = PageAppearance(
            scale=page.ratio,
            theme=theme,
            shows_panel=shows_panel,
            is_compact=page.is_compact,
            is_motion_reduced=page.reduced_motion,
            max_dialog_width=self._find_max_dialog_width(),
        )
        window.set_appearance(appearance)

    def _find_max_dialog_width(self) -> float | None:
        """Return the width of the phone that controls the window, px at scale 1; None if none does."""
        size = self._map_size
        if size is None:
            return None
        return size.width / size.scale - _DIALOG_MARGINS_PX
