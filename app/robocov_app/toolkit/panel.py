"""Parts of a window with widgets, and panels with tabbed pages whose buttons run commands."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import pygame
from pygame import Rect, Surface

from robocov_app.look.theme import LIGHT, Theme
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.layout import Box, Layout

PanelPage: TypeAlias = Callable[[Ui], None]
"""Function that shows the widgets of a page and handles their input."""


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
    """

    def __init__(self) -> None:
        self.is_covered = False
        self.hidden = False
        self.ui = Ui(self.show_content, LIGHT)
        self.drawn_state: object = None

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
            self.ui.stop_typing()
        if theme is not self.ui.theme or layout.scale != self.ui.scale:
            self.ui = Ui(self.show_content, theme, layout.scale)
        self.ui.box = Rect(box)
        self.ui.needs_redraw = True

    def request_redraw(self, state: object) -> None:
        """Request a redraw if the state of the content has changed since the last one."""
        if state != self.drawn_state:
            self.drawn_state = state
            self.ui.needs_redraw = True

    def draw(self, screen: Surface) -> None:
        """Draw the widgets, the open list and the tool tip."""
        self.ui.draw(screen)
        self.ui.draw_overlays(screen)

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Pass an event to the widgets; return whether it was meant for this part."""
        return not self.is_covered and not self.hidden and self.ui.handle_event(event)


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
                part.ui.stop_typing()
    return user is not None


class SidePanel(WindowPart):
    """A panel next to the arena.

    Parameters
    ----------
    tab : str
        Name of the tab that is open first.

    Attributes
    ----------
    tab : str
        Name of the open tab.
    """

    def __init__(self, tab: str) -> None:
        super().__init__()
        self.tab = tab


class PanelButton(NamedTuple):
    """A button of the panel.

    Attributes
    ----------
    label : str
        Its text.
    command : str
        Name of the command that it runs.
    """

    label: str
    command: str


class CommandPanel(SidePanel):
    """A panel with tabbed pages whose buttons run the commands of the window.

    Parameters
    ----------
    commands : CommandTable
        The commands of the window.
    run_command : callable
        Runs the command with a given name.

    Attributes
    ----------
    tabs : tuple of str
        Names of the pages.
    tab_widths : tuple of float, px
        Widths of their tabs at scale 1; tabs of width 0 share the remaining width.
    commands : CommandTable
        The commands of the window.
    """

    tabs: tuple[str, ...] = ()
    tab_widths: tuple[float, ...] = ()

    def __init__(self, commands: CommandTable, run_command: Callable[[str], object]) -> None:
        super().__init__(self.tabs[0])
        self.commands = commands
        self._run_command = run_command

    def list_pages(self) -> dict[str, PanelPage]:
        """Return the pages by the names of their tabs."""
        return {}

    def show_tab(self, name: str) -> None:
        """Open the tab with this name, if there is one."""
        if name in self.tabs:
            self.tab = name
            self.ui.needs_redraw = True

    def show_next_tab(self) -> None:
        """Open the next tab; after the last one, the first."""
        self.show_tab(self.tabs[(self.tabs.index(self.tab) + 1) % len(self.tabs)])

    def show_pages(self, ui: Ui, titles: Mapping[str, str]) -> None:
        """Show the tabs, and the page of the open tab.

        Parameters
        ----------
        ui : Ui
            The page of the panel.
        titles : mapping of str to str
            Label of each tab by its name; by default the capitalized name.
        """
        tab = ui.tabs("tab", self.tabs, self.tab, *self.tab_widths, titles=titles)
        if tab is not None:
            self.show_tab(tab)
        pages = self.list_pages()
        pages[self.tab](ui)

    def show_button(
        self,
        ui: Ui,
        label: str,
        command: str,
        *,
        selected: bool = False,
        small: bool = False,
        disabled_reason: str = "",
    ) -> None:
        """Show a button that runs a command.

        Parameters
        ----------
        ui : Ui
            The page of the panel.
        label : str
            Its text.
        command : str
            Name of the command. Its title and keys are the tool tip.
        selected : bool
            Whether it has the accent color.
        small : bool
            Whether its text is small.
        disabled_reason : str
            Why it cannot be pressed; empty if it can.
        """
        key = command
        if ui.find("button", key) is not None:
            # A command may have two buttons on a page, and widget keys must be unique.
            key = f"{key}:again"
        tip = self.commands[command].tip
        is_clicked = ui.button(
            label, key=key, tip=tip, selected=selected, small=small, disabled_reason=disabled_reason
        )
        if is_clicked:
            self._run_command(command)

    def show_buttons(self, ui: Ui, row: tuple[PanelButton, ...]) -> None:
        """Show a row of small buttons of equal width."""
        ui.row(*[0.0] * len(row), below=4)
        for button in row:
            self.show_button(ui, button.label, button.command, small=True)
