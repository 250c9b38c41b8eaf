"""The top bar of the viewer: undo, file, playback and speed, help and appearance."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from robocov_app.toolkit.command_bar import (
    NARROW_PX,
    SPACE_PX,
    BarCell,
    BarFile,
    CommandBar,
    build_space,
)
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS, find_speed_index, format_speed

# Lengths in pixels at scale 1.
_SPEED_PX = 90.0
_SPEED_TEXT_PX = 40.0


class TopBar(CommandBar):
    """The bar at the top of the viewer's window.

    Parameters
    ----------
    viewer : Presenter
        The viewer.
    commands : CommandTable
        The commands of the window.
    run_command : callable
        Runs the command with a given name.
    """

    save_command = "save:session"

    def __init__(
        self, viewer: Presenter, commands: CommandTable, run_command: Callable[[str], object]
    ) -> None:
        super().__init__(commands, run_command)
        self._viewer = viewer

    def update(self) -> None:
        """Request a redraw if something that the bar shows has changed."""
        viewer = self._viewer
        playback = viewer.session.playback
        self.request_redraw(
            (
                playback.is_playing,
                playback.stop_when_settled,
                playback.clock.speed,
                self.get_file(),
                viewer.view.theme,
                viewer.view.has_panel,
            )
        )

    # Groups

    def get_file(self) -> BarFile:
        """Return the file of the session; without one, the name of the map."""
        files = self._viewer.files
        path = files.workspace.path
        name = Path(files.map_title).stem if path is None else path.name
        location = "This session has no file yet"
        if path is not None:
            location = self._viewer.shorten_paths(str(path))
        node, _ = self._viewer.session.timeline.destination
        return BarFile(
            name=name,
            location=location,
            has_unsaved_edits=files.workspace.has_unsaved_edits,
            can_undo=node.parent is not None,
            can_redo=node.redo_child is not None,
        )

    def list_file_buttons(self, ui: Ui) -> list[BarCell]:
        """Return the cells that open and save sessions."""
        return [
            self.build_wide_button(ui, "open", "Open", command="open:file"),
            self.build_wide_button(ui, "save", "Save", command=self.save_command),
        ]

    def list_center_cells(self, ui: Ui) -> list[BarCell]:
        """Return the cells that play, step and restart, and those of the speed."""
        playback = self._viewer.session.playback
        restart = self.build_button("restart", "Restart")
        step = self.build_button("step", "Step")
        play = self.build_main_button("play", "Play", command="pause")
        if playback.is_playing:
            play = self.build_main_button("pause", "Pause", command="pause")
        if ui.width < NARROW_PX:
            return [restart, play, step]
        settle = self.build_button("settle", "Settle", selected=playback.stop_when_settled)
        speed = [BarCell(_SPEED_PX, self._show_speed), BarCell(_SPEED_TEXT_PX, self._show_speed_text)]
        return [restart, play, step, settle, build_space(SPACE_PX), *speed]

    def list_right_cells(self, ui: Ui) -> list[BarCell]:
        """Return the cells of share, lesson, help, commands, theme and settings."""
        share = self.build_wide_button(ui, "share", "Share", command="share")
        cells = super().list_right_cells(ui)
        if ui.width < NARROW_PX:
            return [share, *cells]
        return [share, self.build_wide_button(ui, "lesson", "Lesson", command="tour"), *cells]

    def find_menu_position(self, command: str) -> tuple[int, int] | None:
        """Return the pixel below the button of a command, where its menu opens; None without a button."""
        button = self.ui.find("button", command)
        if button is None or self.hidden:
            return None
        return button.rect.bottomleft

    # Cells

    def _show_speed(self, ui: Ui) -> None:
        viewer = self._viewer
        index = float(find_speed_index(viewer.session.playback.clock.speed))
        tip = f"Speed: {self.commands['slower'].tip}, {self.commands['faster'].tip}"
        index_chosen = ui.slider("speed", index, 0.0, len(SPEEDS) - 1.0, step=1.0, tip=tip)
        if index_chosen is not None:
            viewer.attempt(partial(viewer.playback.set_speed, SPEEDS[round(index_chosen)]))

    def _show_speed_text(self, ui: Ui) -> None:
        ui.label(format_speed(self._viewer.session.playback.clock.speed), key="speed")
