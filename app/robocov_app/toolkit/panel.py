"""Panels with tabbed pages, whose buttons run commands."""

from collections.abc import Callable, Mapping
from typing import NamedTuple, TypeAlias

from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window_part import CommandPart

PanelPage: TypeAlias = Callable[[Ui], None]
"""Function that shows the widgets of a page and handles their input."""


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


class CommandPanel(CommandPart):
    """A panel with tabbed pages whose buttons run the commands of the window; see `CommandPart`.

    Attributes
    ----------
    tabs : tuple of str
        Names of the pages.
    tab_widths : tuple of float, px
        Widths of their tabs at scale 1; tabs of width 0 share the remaining width.
    tab : str
        Name of the open tab.
    """

    tabs: tuple[str, ...] = ()
    tab_widths: tuple[float, ...] = ()
    # Tooltips next to the panel do not cover other rows.
    tip_side = "left"

    def __init__(self, commands: CommandTable, run_command: Callable[[str], object]) -> None:
        super().__init__(commands, run_command)
        self.tab = self.tabs[0]

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
            Name of the command. Its title and keys are the tooltip.
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
        # Columns of width 0 share the space equally.
        equal_widths = [0.0 for _ in row]
        ui.row(*equal_widths, below=4)
        for button in row:
            self.show_button(ui, button.label, button.command, small=True)
