"""The bar at the top of a window: undo and the file, the main action, help and appearance."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from pygame import Rect, Surface

from robocov_app.render.fonts import measure_text, shorten_to_width
from robocov_app.toolkit.overlay import draw_edge
from robocov_app.toolkit.widgets.appearance import TEXT_PX
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.layout import Box, Layout
from robocov_app.toolkit.window_part import CommandPart

NO_UNDO_REASON = "nothing to undo"
NO_REDO_REASON = "nothing to redo"
UNSAVED_SIGN = "●"

# Lengths in pixels at scale 1.
SPACE_PX = 8.0
"""Space between groups of cells."""
NARROW_PX = 700.0
"""Below this width, the bar has only the most important buttons."""
WIDE_PX = 1150.0
"""From this width on, the buttons for files and help have labels."""
_MARGIN_PX = 8.0
_GAP_PX = 2.0
_ICON_WIDTH_PX = 34.0
_MAIN_WIDTH_PX = 44.0
_BUTTON_HEIGHT_PX = 36.0
_MAX_NAME_PX = 220.0
_MIN_NAME_PX = 40.0
_LABEL_MARGIN_PX = 44.0
"""Width of a button with icon and label, without the text of the label."""
_MIN_CELL_PX = 0.1
"""A cell of width 0 would take the remaining width."""


class BarCell(NamedTuple):
    """A cell of the bar: its width at scale 1, px, and the function that shows its content."""

    width: float
    show: Callable[[Ui], None]


@dataclass(frozen=True)
class BarFile:
    """The open file and its edits, as the bar shows them.

    Attributes
    ----------
    name : str
        Name of the file, or of the content if there is no file yet.
    location : str
        Full path, or a sentence that says that there is no file yet.
    has_unsaved_edits : bool
    can_undo, can_redo : bool
        Whether there is an edit to undo or to redo.
    """

    name: str
    location: str
    has_unsaved_edits: bool
    can_undo: bool
    can_redo: bool

    @property
    def title(self) -> str:
        """The name; a dot in front of it marks unsaved edits."""
        if self.has_unsaved_edits:
            return f"{UNSAVED_SIGN} {self.name}"
        return self.name


class CommandBar(CommandPart):
    """A bar with groups of buttons at the left end, in the middle, and at the right end.

    Subclasses provide the open file and further buttons; see also `CommandPart`.

    Attributes
    ----------
    save_command : str
        Name of the command that saves the file.
    """

    save_command = "save"

    def get_box(self, layout: Layout) -> Box:
        """Return the box of the bar."""
        return layout.bar

    def draw(self, screen: Surface) -> None:
        """Draw the bar, with a line at its lower edge."""
        box = self.ui.box
        self.ui.draw(screen)
        draw_edge(screen, Rect(box.left, box.bottom - 1, box.width, 1), self.ui.theme)
        self.ui.draw_overlays(screen)

    def show_content(self, ui: Ui) -> None:
        """Show the three groups; the middle one is centered if there is enough space."""
        ui.inset(_MARGIN_PX, (ui.box.height / ui.scale - _BUTTON_HEIGHT_PX) / 2, _MARGIN_PX)
        center = self.list_center_cells(ui)
        right = self.list_right_cells(ui)
        left_space = max((ui.width - measure_cells(center)) / 2, 0.0)
        left = self.list_left_cells(ui, left_space - SPACE_PX)
        first_gap = max(left_space - measure_cells(left) - 2 * _GAP_PX, 0.0)
        used = measure_cells(left) + first_gap + measure_cells(center) + measure_cells(right) + 4 * _GAP_PX
        second_gap = max(ui.width - used, 0.0)
        cells = [*left, build_space(first_gap), *center, build_space(second_gap), *right]
        widths = [max(cell.width, _MIN_CELL_PX) for cell in cells]
        ui.row(*widths, height=_BUTTON_HEIGHT_PX, gap=_GAP_PX, below=0)
        for cell in cells:
            cell.show(ui)

    # Groups

    def get_file(self) -> BarFile:
        """Return the open file and its edits."""
        raise NotImplementedError

    def list_left_cells(self, ui: Ui, width: float) -> list[BarCell]:
        """Return the cells at the left end: undo, redo and the file, in at most a width, px at scale 1."""
        file = self.get_file()
        undo_reason = "" if file.can_undo else NO_UNDO_REASON
        redo_reason = "" if file.can_redo else NO_REDO_REASON
        cells = [
            self.build_button("undo", "Undo", disabled_reason=undo_reason),
            self.build_button("redo", "Redo", disabled_reason=redo_reason),
        ]
        if ui.width < NARROW_PX:
            return [*cells, self.build_button("save", "Save", command=self.save_command)]
        buttons = self.list_file_buttons(ui)
        free = min(width - measure_cells([*cells, *buttons]) - 3 * SPACE_PX, _MAX_NAME_PX)
        cells.append(build_space(SPACE_PX))
        # The name is the last cell: buttons behind it would move under the pointer when it changes.
        cells.extend(buttons)
        if free >= _MIN_NAME_PX:
            cells.append(build_space(SPACE_PX))
            cells.append(self._build_file_name(ui, file, free))
        return cells

    def list_file_buttons(self, ui: Ui) -> list[BarCell]:
        """Return the cells that open and save files, in bars that are not narrow."""
        return []

    def list_center_cells(self, ui: Ui) -> list[BarCell]:
        """Return the cells in the middle: the main action of the window."""
        return []

    def list_right_cells(self, ui: Ui) -> list[BarCell]:
        """Return the cells at the right end: help, commands, theme and settings."""
        panel = self.build_button("panel", "Settings")
        if ui.width < NARROW_PX:
            return [self.build_button("help", "Help"), panel]
        return [
            self.build_wide_button(ui, "help", "Help"),
            self.build_button("search", "Commands", command="palette"),
            self.build_button("theme", "Light or dark"),
            panel,
        ]

    # Cells

    def build_button(
        self, icon: str, text: str, *, command: str = "", disabled_reason: str = "", selected: bool = False
    ) -> BarCell:
        """Return the cell of a button with an icon; its command is by default named like the icon."""
        show = partial(
            self._show_button,
            icon=icon,
            text=text,
            command=command or icon,
            disabled_reason=disabled_reason,
            selected=selected,
        )
        return BarCell(_ICON_WIDTH_PX, show)

    def build_wide_button(self, ui: Ui, icon: str, text: str, *, command: str = "") -> BarCell:
        """Return the cell of a button with an icon that also has a label if the bar is wide."""
        if ui.width < WIDE_PX:
            return self.build_button(icon, text, command=command)
        width = measure_text(text, ui.px(TEXT_PX)) / ui.scale + _LABEL_MARGIN_PX
        show = partial(self._show_button, icon=icon, text=text, command=command or icon, has_label=True)
        return BarCell(width, show)

    def build_main_button(self, icon: str, text: str, *, command: str) -> BarCell:
        """Return the cell of the round button of the main action."""
        return BarCell(_MAIN_WIDTH_PX, partial(self._show_main_button, icon=icon, text=text, command=command))

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
            tip=self.commands[command].tip,
            disabled_reason=disabled_reason,
            selected=selected,
            has_label=has_label,
        )
        if is_clicked:
            self._run_command(command)

    def _show_main_button(self, ui: Ui, *, icon: str, text: str, command: str) -> None:
        if ui.main_button(icon, text, key=command, tip=self.commands[command].tip):
            self._run_command(command)

    def _build_file_name(self, ui: Ui, file: BarFile, max_width: float) -> BarCell:
        """Return the cell with the name of the file, of limited width."""
        text = shorten_to_width(file.title, ui.px(TEXT_PX), max_width * ui.scale)
        width = measure_text(text, ui.px(TEXT_PX)) / ui.scale + SPACE_PX
        tip = file.location
        if file.has_unsaved_edits:
            tip += f"; it has unsaved changes: {self.commands[self.save_command].tip}"
        return BarCell(width, partial(_show_file_name, text=text, tip=tip))


def build_space(width: float) -> BarCell:
    """Return an empty cell of a width, px at scale 1."""
    return BarCell(width, _show_nothing)


def measure_cells(cells: list[BarCell]) -> float:
    """Return the width of cells with the gaps between them, px at scale 1."""
    return sum(cell.width for cell in cells) + _GAP_PX * max(len(cells) - 1, 0)


def _show_nothing(ui: Ui) -> None:
    """Leave a cell empty."""
    ui.cell()


def _show_file_name(ui: Ui, *, text: str, tip: str) -> None:
    ui.label(text, key="file", tip=tip)
