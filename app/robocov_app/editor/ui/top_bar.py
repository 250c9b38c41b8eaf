"""The top bar of the editor: undo, file, trying the map, help and appearance."""

from collections.abc import Callable

from robocov_app.editor.editor import Editor
from robocov_app.toolkit.command_bar import BarCell, BarFile, CommandBar
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.widgets.ui import Ui

NO_FILE_TEXT = "This map has no file yet"


class EditorTopBar(CommandBar):
    """The bar at the top of the editor's window.

    Parameters
    ----------
    editor : Editor
        The editor.
    commands : CommandTable
        The commands of the window.
    run_command : callable
        Runs the command with a given name.
    """

    def __init__(self, editor: Editor, commands: CommandTable, run_command: Callable[[str], object]) -> None:
        super().__init__(commands, run_command)
        self._editor = editor

    def update(self) -> None:
        """Request a redraw if something that the bar shows has changed."""
        self.request_redraw((self.get_file(), self._editor.theme, self._editor.shows_panel))

    def get_file(self) -> BarFile:
        """Return the file of the map and its edits."""
        document = self._editor.document
        history = document.history
        location = NO_FILE_TEXT
        if document.path is not None:
            location = self._editor.shorten_paths(str(document.path))
        return BarFile(
            name=document.title,
            location=location,
            has_unsaved_edits=history.has_unsaved_changes,
            can_undo=history.can_undo,
            can_redo=history.can_redo,
        )

    def list_file_buttons(self, ui: Ui) -> list[BarCell]:
        """Return the cells that create, open and save maps."""
        return [
            self.build_wide_button(ui, "new", "New"),
            self.build_wide_button(ui, "open", "Open"),
            self.build_wide_button(ui, "save", "Save"),
        ]

    def list_center_cells(self, ui: Ui) -> list[BarCell]:
        """Return the cell that runs the map in the viewer."""
        return [self.build_main_button("play", "Try it", command="try")]
