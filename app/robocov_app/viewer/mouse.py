"""What every window of ours does with the mouse: the panel first, then what is beside it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np
import pygame

from robocov_app.viewer.layout import inside

if TYPE_CHECKING:
    from robocov_app.viewer.layout import Box
    from robocov_app.viewer.paged import Paged

WHEEL = 1.15
"""How far one notch of the wheel magnifies."""

DOUBLE = 0.35
"""Seconds between the two clicks of a double click, at most."""


class Mouse(ABC):
    """Shares the events of the mouse out between a panel and what is beside it.

    Parameters
    ----------
    panel : Paged
    """

    def __init__(self, panel: Paged) -> None:
        self._panel = panel
        self.at = (0, 0)
        self._drag = ""
        self._button = 0
        self._pressed_at = (0, 0)
        self._last_click = -1.0, (0, 0)
        self._shape = -1

    @property
    def dragging(self) -> bool:
        """Whether a button is held down on something."""
        return bool(self._drag)

    def take(self, event: pygame.event.Event, now: float) -> None:
        """Take an event of the mouse at a time in seconds."""
        moved = event.type == pygame.MOUSEMOTION
        if event.type != pygame.MOUSEWHEEL:
            self.at = event.pos
        # an open menu may hang over what is beside; a slider may be dragged beyond the panel
        over_panel = inside(self._panel_box(), self.at) or self._panel.unfolded
        # of moves the panel takes note by itself, once a frame
        if not self._drag and (over_panel or event.type == pygame.MOUSEBUTTONUP) and not moved:
            self._panel.take(event)
        if moved:
            self._moved(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            self._released(event)
        elif over_panel and not self._drag:
            self._over_panel()
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self._panel.stop_typing()
            self._pressed(event, now)
        elif event.type == pygame.MOUSEWHEEL:
            amount = getattr(event, "precise_y", event.y) or event.y
            self._turned(WHEEL ** float(np.clip(amount, -5, 5)))

    def _show_cursor(self, shape: int) -> None:
        if shape != self._shape:
            self._shape = shape
            with suppress(pygame.error):  # not every display has cursors
                pygame.mouse.set_cursor(shape)

    @abstractmethod
    def _panel_box(self) -> Box:
        """Return where the panel is."""

    @abstractmethod
    def _over_panel(self) -> None:
        """Take note that the panel has the mouse."""

    @abstractmethod
    def _pressed(self, event: pygame.event.Event, now: float) -> None:
        """Take a button that goes down beside the panel."""

    @abstractmethod
    def _moved(self, event: pygame.event.Event) -> None:
        """Take a move, wherever it is."""

    @abstractmethod
    def _released(self, event: pygame.event.Event) -> None:
        """Take a button that goes up, wherever that is."""

    @abstractmethod
    def _turned(self, factor: float) -> None:
        """Take the wheel beside the panel: it magnifies by so much."""
