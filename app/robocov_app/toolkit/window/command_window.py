"""A window with commands, a panel, dialogs, help and a map: base class of the viewer and the editor."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import pygame

from robocov_app.look.theme import Theme
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.commands.help_page import HelpPage
from robocov_app.toolkit.commands.palette import create_palette
from robocov_app.toolkit.dialogs import Dialogs
from robocov_app.toolkit.panel import CommandPanel
from robocov_app.toolkit.sheet_handle import SheetHandle
from robocov_app.toolkit.tools.pointer import LEFT_BUTTON, Pointer
from robocov_app.toolkit.window.display import find_suitable_scale
from robocov_app.toolkit.window.input import COMMAND_EVENT, MOUSE_EVENTS
from robocov_app.toolkit.window.layout import Layout
from robocov_app.toolkit.window.window import BaseWindow
from robocov_app.toolkit.window.window_display import WindowDisplay
from robocov_app.toolkit.window.window_model import WindowModel
from robocov_app.toolkit.window_part import WindowPart, offer_event

Action: TypeAlias = Callable[[], object]


@dataclass(frozen=True)
class WindowActions:
    """Functions of a window that are called by the commands that both windows have.

    Attributes
    ----------
    show_next_tab : callable
        Shows the next page of the panel.
    toggle_fullscreen : callable
        Switches full screen on and off.
    save_screenshot : callable
        Saves a screenshot of the window.
    toggle_help : callable
        Shows or hides the help page.
    open_palette : callable
        Opens the palette.
    """

    show_next_tab: Action
    toggle_fullscreen: Action
    save_screenshot: Action
    toggle_help: Action
    open_palette: Action


class CommandWindow(BaseWindow):
    """A window that passes each event to the open dialog, or else to the panel, a command or the map.

    Parameters
    ----------
    model : WindowModel
        State of the window.
    dialogs : Dialogs
        Shows the open dialog.
    size : (width, height), px
    scale : float or None
        Size of texts and widgets; None for one that suits the size of the window.
    display : WindowDisplay, optional
        Display of another window, which this one temporarily replaces; by default a new window is opened.

    Attributes
    ----------
    groups : tuple of str
        Headings of the help page, in the order in which they are shown.
    keys_hint : str
        Hint next to the title of the help page.
    palette_hint : str
        Faint text in the empty field of the palette.
    model : WindowModel
        State of the window.
    dialogs : Dialogs
        Shows the open dialog.
    help_page : HelpPage
        The page with the keys of all commands.
    commands : CommandTable
        All commands.
    panel : CommandPanel
        The panel.
    pointer : Pointer
        The mouse over the map.
    sheet_handle : SheetHandle
        Closes the panel of a narrow window.
    message_box : pygame.Rect or None
        Where a click removes the status message of the last frame, px; None without a message.
    layout : Layout
        Boxes of the window.
    theme : Theme
        Colors.
    """

    groups: tuple[str, ...] = ()
    keys_hint = ""
    palette_hint = ""

    commands: CommandTable
    panel: CommandPanel
    pointer: Pointer
    layout: Layout
    theme: Theme

    def __init__(
        self,
        model: WindowModel,
        dialogs: Dialogs,
        size: tuple[int, int],
        scale: float | None,
        display: WindowDisplay | None = None,
    ) -> None:
        """Open the window; subclasses build the commands, the panel and the pointer."""
        super().__init__(size, display)
        self.model = model
        self.dialogs = dialogs
        self.scale = scale
        self.help_page = HelpPage(self.groups, self.keys_hint)
        self.sheet_handle = SheetHandle(self.close_sheet)
        self.message_box: pygame.Rect | None = None

    @property
    def suitable_scale(self) -> float:
        """The requested scale, or else one that suits the size of the window."""
        if self.scale is not None:
            return self.scale
        return find_suitable_scale(self.screen.get_size())

    @property
    def status_text(self) -> str:
        """The status message."""
        return self.model.message

    @property
    def has_status_hint(self) -> bool:
        """Whether the status line ends with a hint; a page shows who controls the window there."""
        return self.remote is None

    def hide_folder(self, folder: Path) -> None:
        """Omit a folder from the paths in messages; see `BaseWindow`."""
        self.model.hidden_folder = folder

    # Commands

    def run_command(self, name: str) -> None:
        """Run the command with this name; while the help page is open, "cancel" only closes that.

        Otherwise, "cancel" also removes the status message.
        """
        if name == "cancel" and self.help_page.is_open:
            self.help_page.close()
            return
        message = self.model.message
        self.commands.run(name)
        if name == "cancel" and self.model.message == message:
            self.dismiss_message()

    def dismiss_message(self) -> None:
        """Remove the status message."""
        self.model.clear_message()
        self.model.revision += 1

    def close_sheet(self) -> None:
        """Close the panel of a narrow window."""
        self.run_command("panel")

    def _run_page_command(self, name: str) -> None:
        """Run a command that was chosen in a browser page, after closing what covers the window."""
        if name not in self.commands:
            return
        if self.dialogs.is_open:
            self.dialogs.close()
            if name == "cancel":
                return
        if name not in ("help", "cancel"):
            self.help_page.close()
        self.run_command(name)

    def toggle_help(self) -> None:
        """Show or hide the help page."""
        self.help_page.toggle()

    def open_palette(self) -> None:
        """Open the dialog that finds and runs commands by their names."""
        self.dialogs.ask(create_palette(self.commands, self.palette_hint, self.show_result))

    def show_result(self, message: str) -> None:
        """Show the message that a command of the palette has returned; nothing if it is empty."""
        self.model.attempt(lambda: message)

    # Events

    @property
    def parts(self) -> Sequence[WindowPart]:
        """Parts of the window with widgets, which get events before the map."""
        return (self.panel,)

    def handle_event(self, event: pygame.event.Event) -> None:
        """Pass an event to the open dialog, or else to the panel, a command or the map."""
        if event.type == pygame.KEYUP:
            self.commands.release_key(event)
        elif event.type == pygame.WINDOWFOCUSLOST:
            self.commands.reset_keys()
        if event.type == pygame.QUIT:
            self.handle_quit()
        elif event.type == COMMAND_EVENT:
            self._run_page_command(event.name)
        elif not self.dialogs.handle_event(event):
            self._handle_below_dialogs(event)

    def find_cover(self) -> pygame.Rect | None:
        """Return the box of the dialog, menu or help page that covers the map; None if nothing does."""
        if self.dialogs.is_open:
            return self.dialogs.box or self.screen.get_rect()
        return self.screen.get_rect() if self.help_page.is_open else None

    def handle_quit(self) -> None:
        """React when the user closes the window."""
        self.closed = True

    def open_file(self, path: Path) -> str | None:
        """Open a file that was dropped on the window; return a status message, if there is one."""

    def use_key(self, event: pygame.event.Event) -> bool:
        """Offer a key to the parts before commands get it; return whether it was used."""
        return offer_event(self.parts, event)

    def handle_mouse(self, event: pygame.event.Event) -> None:
        """Handle a mouse event that no dialog has used."""
        if not self.sheet_handle.handle_event(event, self.layout):
            self.pointer.handle_event(event, self.model.now)

    def _handle_below_dialogs(self, event: pygame.event.Event) -> None:
        """Handle an event that no dialog has used."""
        if event.type == pygame.DROPFILE:
            self.model.attempt(lambda: self.open_file(Path(event.file)))
        elif self.help_page.handle_event(event):
            pass
        elif event.type == pygame.KEYDOWN:
            self.press_key(event)
        elif self._is_press_on_message(event):
            self.dismiss_message()
        elif event.type in MOUSE_EVENTS:
            self.handle_mouse(event)
        elif event.type == pygame.WINDOWLEAVE:
            self.pointer.leave()
            for part in self.parts:
                part.ui.leave()
        else:
            offer_event(self.parts, event)

    def _is_press_on_message(self, event: pygame.event.Event) -> bool:
        """Return whether an event presses the left button on the status message."""
        if event.type != pygame.MOUSEBUTTONDOWN or event.button != LEFT_BUTTON or self.message_box is None:
            return False
        return self.message_box.collidepoint(event.pos)

    def press_key(self, event: pygame.event.Event) -> None:
        """Handle a key press: as input for the panel, or by running the command of that key."""
        if not self.use_key(event):
            command = self.commands.take_command(event)
            if command is not None:
                self.run_command(command.name)
        # The character of the key follows as a separate text event, which a newly opened dialog must ignore.
        self.dialogs.ignore_character(event.unicode)

    # Exceptions and drawing

    def report_exception(self, message: str, *, in_drawing: bool) -> None:
        """Show a message about an unexpected exception; close what may have caused it in drawing."""
        if in_drawing:
            self.restore_view()
        self.model.show_message(message, is_error=True)
        self.model.revision += 1

    def restore_view(self) -> None:
        """Close everything that may have caused an exception while drawing."""
        self.help_page.close()
        self.dialogs.discard()

    def draw_above_map(self) -> None:
        """Draw the help page and the open dialog over the window, and show the frame."""
        scale = self.layout.scale
        self.help_page.draw(self.screen, self.theme, scale, self.commands.commands)
        self.dialogs.draw(self.screen, self.theme, scale)
        self.display.show()
