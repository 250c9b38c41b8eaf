"""Parts of a window with widgets, such as the panel, the top bar and the tool rail."""

from collections.abc import Callable, Sequence

import pygame
from pygame import Rect, Surface

from robocov_app.look.theme import LIGHT, Theme
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.widgets.tool_tip import TipSide
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.layout import Box, Layout


class WindowPart:
    """A rectangular part of a window with widgets, such as the panel or the top bar.

    Attributes
    ----------
    is_covered : bool
        Whether something else is drawn over it and gets its events.
    hidden : bool
        Whether it is not shown.
    ui : Ui
        Page with the widgets.
    drawn_state : object
        State of the content when it was last drawn, for parts that are redrawn only when it changes.
    tip_side : TipSide
        Side on which tooltips appear.
    """

    tip_side: TipSide = "below"

    def __init__(self) -> None:
        self.is_covered = False
        self.hidden = False
        self.ui = Ui(self.show_content, LIGHT)
        self.drawn_state: object = None

    @property
    def is_typing(self) -> bool:
        """Whether typed text goes to a text field of this part."""
        return self.ui.edit is not None

    def show_content(self, ui: Ui) -> None:
        """Show the widgets, and handle their input; called in every run of the page."""

    def get_box(self, layout: Layout) -> Box:
        """Return the box of this part in a layout."""
        return layout.panel

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Adopt the position and the scale of this part in a layout, and the colors of a theme."""
        box = self.get_box(layout)
        # A part of width or height 0 is hidden.
        self.hidden = not (box.width and box.height)
        if self.hidden:
            self.ui.clear_focus()
        if theme is not self.ui.theme or layout.scale != self.ui.scale:
            self.ui = Ui(self.show_content, theme, layout.scale)
        self.ui.tip_side = self.tip_side
        self.ui.box = Rect(box)
        self.ui.needs_redraw = True

    def request_redraw(self, state: object) -> None:
        """Request a redraw if the state of the content has changed since the last one."""
        if state != self.drawn_state:
            self.drawn_state = state
            self.ui.needs_redraw = True

    def draw(self, screen: Surface) -> None:
        """Draw the widgets, the open list and the tooltip."""
        self.ui.draw(screen)
        self.ui.draw_overlays(screen)

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Pass an event to the widgets; return whether it was meant for this part."""
        return not self.is_covered and not self.hidden and self.ui.handle_event(event)


class CommandPart(WindowPart):
    """A part of a window whose buttons run commands.

    Parameters
    ----------
    commands : CommandTable
        The commands of the window.
    run_command : callable
        Runs the command with a given name.

    Attributes
    ----------
    commands : CommandTable
        The commands of the window.
    """

    def __init__(self, commands: CommandTable, run_command: Callable[[str], object]) -> None:
        super().__init__()
        self.commands = commands
        self._run_command = run_command


def offer_event(parts: Sequence[WindowPart], event: pygame.event.Event) -> bool:
    """Offer an event to the parts of a window until one uses it.

    A part with an open list or a held button comes first. A press on one part ends typing in the others.

    Parameters
    ----------
    parts : sequence of WindowPart
    event : pygame.event.Event

    Returns
    -------
    bool
        Whether a part has used the event.
    """
    if event.type == pygame.MOUSEMOTION:
        # All parts follow the pointer, since leaving one of them changes how it is drawn.
        uses = [part.handle_event(event) for part in parts]
        return any(uses)
    by_urgency = sorted(parts, key=lambda part: not part.ui.is_busy)
    user = next((part for part in by_urgency if part.handle_event(event)), None)
    if event.type == pygame.MOUSEBUTTONDOWN:
        for part in parts:
            if part is not user and part.ui.focus is not None:
                part.ui.clear_focus()
    return user is not None
