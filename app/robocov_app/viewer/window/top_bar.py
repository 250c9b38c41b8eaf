"""The top bar: undo, file, playback and speed, help and appearance."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from pygame import Rect, Surface

from robocov_app.render.fonts import measure_text, shorten_to_width
from robocov_app.toolkit.commands.command import CommandTable
from robocov_app.toolkit.overlay import draw_edge
from robocov_app.toolkit.panel import WindowPart
from robocov_app.toolkit.widgets.appearance import TEXT_PX
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.layout import Box, Layout
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS, find_speed_index, format_speed

NO_UNDO_REASON = "nothing to undo"
NO_REDO_REASON = "nothing to redo"
UNSAVED_SIGN = "●"

# Lengths in pixels at scale 1.
_MARGIN_PX = 8.0
_GAP_PX = 2.0
_ICON_WIDTH_PX = 34.0
_PLAY_WIDTH_PX = 44.0
_BUTTON_HEIGHT_PX = 36.0
_SPACE_PX = 8.0
_SPEED_PX = 90.0
_SPEED_TEXT_PX = 40.0
_MAX_NAME_PX = 220.0
_MIN_NAME_PX = 40.0
_LABEL_MARGIN_PX = 44.0
"""Width of a button with icon and label, without the text of the label."""
NARROW_PX = 700.0
"""Below this width, the bar has only the most important buttons."""
WIDE_PX = 1150.0
"""From this width on, the buttons for files and help have labels."""


class _Cell(NamedTuple):
    """A cell of the bar: its width at scale 1, px, and the function that shows its content."""

    width: float
    show: Callable[[Ui], None]


class TopBar(WindowPart):
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

    def __init__(
        self, viewer: Presenter, commands: CommandTable, run_command: Callable[[str], object]
    ) -> None:
        super().__init__()
        self._viewer = viewer
        self._commands = commands
        self._run_command = run_command

    def get_box(self, layout: Layout) -> Box:
        """Return the box of the bar."""
        return layout.bar

    def draw(self, screen: Surface) -> None:
        """Draw the bar, with a line at its lower edge."""
        box = self.ui.box
        self.ui.draw(screen)
        draw_edge(screen, Rect(box.left, box.bottom - 1, box.width, 1), self.ui.theme)
        self.ui.draw_overlays(screen)

    def update(self) -> None:
        """Request a redraw if something that the bar shows has changed."""
        viewer = self._viewer
        playback = viewer.session.playback
        node, _ = viewer.session.timeline.destination
        self.request_redraw(
            (
                playback.is_playing,
                playback.stop_when_settled,
                playback.clock.speed,
                node.parent is None,
                node.redo_child is None,
                self._get_file_text(),
                viewer.view.theme,
                viewer.view.has_panel,
            )
        )

    def show_content(self, ui: Ui) -> None:
        """Show three groups of cells: at the left end, in the middle, and at the right end."""
        ui.inset(_MARGIN_PX, (ui.box.height / ui.scale - _BUTTON_HEIGHT_PX) / 2, _MARGIN_PX)
        center = self._list_playback_cells(ui.width)
        right = self._list_help_cells(ui)
        left_space = max((ui.width - _measure(center)) / 2, 0.0)
        left = self._list_file_cells(ui, left_space - _SPACE_PX)
        first_gap = max(left_space - _measure(left) - 2 * _GAP_PX, 0.0)
        used = _measure(left) + first_gap + _measure(center) + _measure(right) + 4 * _GAP_PX
        second_gap = max(ui.width - used, 0.0)
        cells = [*left, _Cell(first_gap, _show_nothing), *center, _Cell(second_gap, _show_nothing), *right]
        # A cell of width 0 would take the remaining width.
        widths = [max(cell.width, 0.1) for cell in cells]
        ui.row(*widths, height=_BUTTON_HEIGHT_PX, gap=_GAP_PX, below=0)
        for cell in cells:
            cell.show(ui)

    # Groups

    def _list_file_cells(self, ui: Ui, width: float) -> list[_Cell]:
        """Return the cells of undo, redo and the file, which take at most a width, px."""
        node, _ = self._viewer.session.timeline.destination
        undo_reason = "" if node.parent is not None else NO_UNDO_REASON
        redo_reason = "" if node.redo_child is not None else NO_REDO_REASON
        cells = [
            self._build_button("undo", "Undo", disabled_reason=undo_reason),
            self._build_button("redo", "Redo", disabled_reason=redo_reason),
        ]
        save = self._build_button("save", "Save", command="save:session")
        if ui.width < NARROW_PX:
            return [*cells, save]
        buttons = [self._build_button("open", "Open", command="open:file"), save]
        if ui.width >= WIDE_PX:
            buttons = [
                self._build_labeled_button(ui, "open", "Open", command="open:file"),
                self._build_labeled_button(ui, "save", "Save", command="save:session"),
            ]
        free = min(width - _measure([*cells, *buttons]) - 2 * _SPACE_PX, _MAX_NAME_PX)
        cells.append(_Cell(_SPACE_PX, _show_nothing))
        if free >= _MIN_NAME_PX:
            cells.append(self._build_file_name(ui, free))
        return [*cells, *buttons]

    def _list_playback_cells(self, width: float) -> list[_Cell]:
        """Return the cells that play, step and restart, and those of the speed."""
        playback = self._viewer.session.playback
        restart = self._build_button("restart", "Restart")
        step = self._build_button("step", "Step")
        play = _Cell(_PLAY_WIDTH_PX, self._show_play)
        speed = [_Cell(_SPEED_PX, self._show_speed), _Cell(_SPEED_TEXT_PX, self._show_speed_text)]
        if width < NARROW_PX:
            return [restart, play, step]
        settle = self._build_button("settle", "Settle", selected=playback.stop_when_settled)
        return [restart, play, step, settle, _Cell(_SPACE_PX, _show_nothing), *speed]

    def _list_help_cells(self, ui: Ui) -> list[_Cell]:
        """Return the cells of lesson, help, commands, theme and panel."""
        help_button = self._build_button("help", "Help", command="help")
        panel = self._build_button("panel", "Panel", command="panel")
        if ui.width < NARROW_PX:
            return [help_button, panel]
        search = self._build_button("search", "Commands", command="palette")
        theme = self._build_button("theme", "Light or dark")
        lesson = self._build_button("lesson", "Lesson", command="tour")
        if ui.width >= WIDE_PX:
            lesson = self._build_labeled_button(ui, "lesson", "Lesson", command="tour")
            help_button = self._build_labeled_button(ui, "help", "Help", command="help")
        return [lesson, help_button, search, theme, panel]

    # Cells

    def _build_button(
        self, icon: str, text: str, *, command: str = "", disabled_reason: str = "", selected: bool = False
    ) -> _Cell:
        """Return the cell of a button with an icon; its command is by default named like the icon."""
        show = partial(
            self._show_button,
            icon=icon,
            text=text,
            command=command or icon,
            disabled_reason=disabled_reason,
            selected=selected,
        )
        return _Cell(_ICON_WIDTH_PX, show)

    def _build_labeled_button(self, ui: Ui, icon: str, text: str, *, command: str) -> _Cell:
        """Return the cell of a button with an icon and a label."""
        width = measure_text(text, ui.px(TEXT_PX)) / ui.scale + _LABEL_MARGIN_PX
        return _Cell(width, partial(self._show_button, icon=icon, text=text, command=command, has_label=True))

    def _show_button(
        self,
        ui: Ui,
        *,
        icon: str,
        text: str,
        command: str,
        disabled_reason: str = "",
        selected: bool = False,
        has_label: bool = False,
    ) -> None:
        is_clicked = ui.icon_button(
            icon,
            text,
            key=command,
            tip=self._commands[command].tip,
            disabled_reason=disabled_reason,
            selected=selected,
            has_label=has_label,
        )
        if is_clicked:
            self._run_command(command)

    def _build_file_name(self, ui: Ui, max_width: float) -> _Cell:
        """Return the cell with the name of the file, of limited width."""
        text = shorten_to_width(self._get_file_text(), ui.px(TEXT_PX), max_width * ui.scale)
        width = measure_text(text, ui.px(TEXT_PX)) / ui.scale + _SPACE_PX
        return _Cell(width, partial(self._show_file_name, text=text))

    def _show_file_name(self, ui: Ui, *, text: str) -> None:
        workspace = self._viewer.files.workspace
        tip = str(workspace.path) if workspace.path is not None else "This session has no file yet"
        if workspace.has_unsaved_edits:
            tip += f"; it has unsaved changes: {self._commands['save:session'].tip}"
        ui.label(text, key="file", tip=tip)

    def _get_file_text(self) -> str:
        """Return the name of the session's file, or of its map; a dot in front of it marks unsaved edits."""
        files = self._viewer.files
        path = files.workspace.path
        name = Path(files.map_name).stem if path is None else path.name
        if files.workspace.has_unsaved_edits:
            return f"{UNSAVED_SIGN} {name}"
        return name

    def _show_play(self, ui: Ui) -> None:
        is_playing = self._viewer.session.playback.is_playing
        icon = "pause" if is_playing else "play"
        text = "Pause" if is_playing else "Play"
        if ui.main_button(icon, text, key="pause", tip=self._commands["pause"].tip):
            self._run_command("pause")

    def _show_speed(self, ui: Ui) -> None:
        viewer = self._viewer
        index = float(find_speed_index(viewer.session.playback.clock.speed))
        tip = f"Speed: {self._commands['slower'].tip}, {self._commands['faster'].tip}"
        index_chosen = ui.slider("speed", index, 0.0, len(SPEEDS) - 1.0, step=1.0, tip=tip)
        if index_chosen is not None:
            viewer.attempt(partial(viewer.playback.set_speed, SPEEDS[round(index_chosen)]))

    def _show_speed_text(self, ui: Ui) -> None:
        ui.label(format_speed(self._viewer.session.playback.clock.speed), key="speed")


def _show_nothing(ui: Ui) -> None:
    """Leave a cell empty."""
    ui.cell()


def _measure(cells: list[_Cell]) -> float:
    """Return the width of cells with the gaps between them, at scale 1, px."""
    return sum(cell.width for cell in cells) + _GAP_PX * max(len(cells) - 1, 0)
