"""Menus of the viewer's window: those of the selection, of what can be shared, and of the presets."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from robocov_app.toolkit.commands.command import Command, CommandTable
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.dialogs import Dialogs
from robocov_app.viewer.layer_presets import LAYER_PRESETS
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.sharing.share import ShareActions

ROBOT_COMMANDS = ("robot:fail", "robot:follow", "", "robot:remove")
WALL_COMMANDS = ("wider", "narrower", "", "duplicate", "delete")
OBSTACLE_COMMANDS = ("duplicate", "delete")
FLOOR_COMMANDS = ("robot:add", "", "undo", "redo", "", "fit")
SHARE_COMMANDS = ("share:copy", "screenshot", "video", "", "share:command", "share:python")
LINK_COMMAND = "share:link"
COMMANDS_OF_SHARE_MENU = frozenset({"share", LINK_COMMAND, *SHARE_COMMANDS} - {""})
"""The command that opens the share menu, and those in it; a lesson continues after them."""


class WindowMenus:
    """Opens the menus of a window.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    share : ShareActions
        Actions of the share menu.
    commands : CommandTable
        All commands.
    dialogs : Dialogs
        Shows the open menu.
    run_command : callable
        Runs the command with a given name.
    """

    def __init__(
        self,
        viewer: Presenter,
        share: ShareActions,
        commands: CommandTable,
        dialogs: Dialogs,
        run_command: Callable[[str], object],
    ) -> None:
        self._viewer = viewer
        self._share = share
        self._commands = commands
        self._dialogs = dialogs
        self._run_command = run_command

    def open_context_menu(self, pixel: tuple[int, int]) -> None:
        """Open the context menu of the selection at a pixel."""
        self._open_menu(list_context_commands(self._viewer), pixel)

    def open_share_menu(self, pixel: tuple[int, int] | None) -> None:
        """Open the menu of what can be shared at a pixel or, without one, at the lower edge of the window.

        Links need a served window.
        """
        names = list(SHARE_COMMANDS)
        if self._share.has_link:
            names.insert(0, LINK_COMMAND)
        self._open_menu(names, pixel)

    def open_preset_menu(self, pixel: tuple[int, int]) -> None:
        """Open the menu of the presets of layers at a pixel."""
        self._open_menu([f"preset:{preset.name}" for preset in LAYER_PRESETS], pixel)

    def _open_menu(self, names: Sequence[str], pixel: tuple[int, int] | None) -> None:
        """Open a menu of commands; an empty name separates two groups."""
        rows = [self._get_command(name) if name else None for name in names]
        is_on_phone = self._viewer.view.is_compact
        self._dialogs.ask(Menu(rows, pixel, self._run_command, is_for_fingers=is_on_phone))

    def _get_command(self, name: str) -> Command:
        """Return a command; those that switch something say what they do now."""
        command = self._commands[name]
        if name == "video":
            is_recording = self._viewer.view.is_recording
            return replace(command, title="Stop recording" if is_recording else "Record a video")
        if name == "robot:fail":
            setup = self._viewer.session.displayed.get_setup(self._viewer.pane)
            has_failed = self._viewer.selected_robot in setup.failed
            return replace(command, title="Revive" if has_failed else "Fail")
        return command


def list_context_commands(viewer: Presenter) -> tuple[str, ...]:
    """Return the names of the commands for the selection; an empty name separates two groups."""
    if viewer.selected_robot is not None:
        return ROBOT_COMMANDS
    if viewer.selection.has_wall:
        return WALL_COMMANDS
    if viewer.selected_obstacles:
        return OBSTACLE_COMMANDS
    return FLOOR_COMMANDS
