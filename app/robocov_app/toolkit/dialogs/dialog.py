"""Base class of dialogs."""

import math

from pygame import Rect

from robocov_app.toolkit.widgets.ui import Ui

_HEIGHT_FRACTION = 0.42
"""Fraction of the free height that is left above a dialog."""


class Dialog:
    """A card over the window that gets all events while it is open.

    Attributes
    ----------
    width : float
        Width at scale 1, px.
    margin : tuple of float
        Space left and right, and space above and below, at scale 1, px.
    has_veil : bool
        Whether the rest of the window is dimmed.
    closes_on_outside_click : bool
        Whether a click outside the dialog cancels it.
    is_done : bool
        Whether it has been answered and is about to close.
    has_key_hints : bool
        Whether it mentions keys, which a phone does not have.
    window_height : float
        Height of the window at scale 1, px; infinite until the dialog is drawn.
    """

    width = 560.0
    margin = 20.0, 16.0
    has_veil = True
    closes_on_outside_click = False
    is_done = False
    has_key_hints = True
    window_height = math.inf

    def show_content(self, ui: Ui) -> None:
        """Show the widgets of the dialog, and handle their input; called in every run of the page."""

    def place(self, box: Rect, screen: Rect, scale: float) -> None:
        """Move the box of the dialog to its position on the screen."""
        top = round((screen.height - box.height) * _HEIGHT_FRACTION)
        box.midtop = screen.width // 2, max(top, 0)

    def show_with_margin(self, ui: Ui) -> None:
        """Show the content with a margin around it."""
        side, above = self.margin
        ui.inset(side, above, side)
        self.show_content(ui)
        ui.space(above)

    def handle_key(self, name: str, ui: Ui) -> bool:
        """Handle a key; return whether it was used. If not, the focused widget gets it."""
        return False

    def handle_wheel(self, notches: float) -> bool:
        """Handle the mouse wheel; return whether it was used. If not, the widgets get it."""
        return False

    def read_widgets(self, ui: Ui) -> None:
        """Read the widgets after an event."""

    def handle_cancel(self) -> None:
        """React to the dialog being canceled."""
