"""Context menus."""

from collections.abc import Callable, Sequence

from pygame import Rect

from robocov_app.render.fonts import measure_text
from robocov_app.toolkit.commands.command import Command
from robocov_app.toolkit.dialogs import Dialog
from robocov_app.toolkit.widgets.appearance import SMALL_TEXT_PX, TEXT_PX
from robocov_app.toolkit.widgets.ui import Ui
from robocov_app.toolkit.window.input import ENTER_KEYS

# Lengths in pixels at scale 1.
_ROW_PX = 24
_FINGER_ROW_PX = 48
_SEPARATOR_PX = 7
_TEXT_MARGINS_PX = 50
_WINDOW_GAP_PX = 4
"""Minimum distance of a menu from the edges of the window."""

_KEY_STEPS = {"up": -1, "down": 1}


class Menu(Dialog):
    """A context menu: commands to choose from, at a given position in the window.

    Parameters
    ----------
    rows : sequence of Command or None
        None leaves space between groups.
    position : (x, y) or None, px
        Upper left corner; the menu moves if it does not fit there. If None, it opens in the middle of the
        lower edge, as the sheets of a phone do.
    run : callable
        Runs a command by its name.
    is_for_fingers : bool
        Whether rows are as high as fingers need them, and keys are left out, as on a phone.

    Attributes
    ----------
    rows
        As passed.
    highlighted : int
        Index of the row highlighted with the arrow keys; -1 if there is none.
    """

    margin = 5.0, 5.0
    has_veil = False
    closes_on_outside_click = True

    def __init__(
        self,
        rows: Sequence[Command | None],
        position: tuple[int, int] | None,
        run: Callable[[str], object],
        *,
        is_for_fingers: bool = False,
    ) -> None:
        self.rows = rows
        self.highlighted = -1
        self._is_for_fingers = is_for_fingers
        self._position = position
        self._run = run

    def show_content(self, ui: Ui) -> None:
        """Show the commands; if they are higher than the window, they scroll."""
        with ui.scroll("menu"):
            for number, command in enumerate(self.rows):
                if command is None:
                    ui.row(height=_SEPARATOR_PX, below=0)
                    ui.cell()
                else:
                    ui.row(height=self._row_height, below=0)
                    self._show_command(ui, number, command)

    @property
    def _row_height(self) -> int:
        """Height of a row with a command at scale 1, px."""
        return _FINGER_ROW_PX if self._is_for_fingers else _ROW_PX

    def _show_command(self, ui: Ui, number: int, command: Command) -> None:
        is_clicked = ui.option(
            self._get_title(command),
            self._get_key_text(command),
            key=command.name,
            highlighted=number == self.highlighted,
            disabled_reason=command.get_disabled_reason(),
        )
        if is_clicked:
            self._choose(command)

    def _get_title(self, command: Command) -> str:
        """Return the title of a command in its row; on a phone without the explanation after a colon."""
        return command.title.partition(":")[0] if self._is_for_fingers else command.title

    def _get_key_text(self, command: Command) -> str:
        """Return the key of a command at the right end of its row; empty on a phone."""
        return "" if self._is_for_fingers else command.key_text

    def _choose(self, command: Command | None) -> None:
        self.is_done = True
        if command is not None:
            self._run(command.name)

    def handle_key(self, name: str, ui: Ui) -> bool:
        """Highlight a command with the arrow keys, or run it with Enter."""
        numbers = [number for number, row in enumerate(self.rows) if _is_enabled(row)]
        if name in _KEY_STEPS and numbers:
            self._move(_KEY_STEPS[name], numbers)
            self._reveal_highlighted(ui)
        elif name in ENTER_KEYS and self.highlighted in numbers:
            self._choose(self.rows[self.highlighted])
        return True

    def _move(self, step: int, numbers: list[int]) -> None:
        """Highlight the next enabled row; the first or last one if none is highlighted yet.

        Parameters
        ----------
        step : int
            1 to move down, -1 to move up; the ends are connected.
        numbers : list of int
            Indices of the enabled rows.
        """
        if self.highlighted in numbers:
            index = numbers.index(self.highlighted) + step
        elif step > 0:
            index = 0
        else:
            index = -1
        self.highlighted = numbers[index % len(numbers)]

    def _reveal_highlighted(self, ui: Ui) -> None:
        """Scroll the highlighted row into view: the scroll area reveals the widget with the focus."""
        command = self.rows[self.highlighted]
        if command is not None:
            ui.set_focus(command.name)

    def place(self, box: Rect, screen: Rect, scale: float) -> None:
        """Move the box to its position, and make it as wide as the longest row and as high as all rows."""
        title_size = round(TEXT_PX * scale)
        key_size = round(SMALL_TEXT_PX * scale)
        widths = [
            measure_text(self._get_title(command), title_size)
            + measure_text(self._get_key_text(command), key_size)
            for command in self.rows
            if command is not None
        ]
        command_count = len(widths)
        separator_count = len(self.rows) - command_count
        _, margin = self.margin
        height = command_count * self._row_height + separator_count * _SEPARATOR_PX + 2 * margin
        gap = round(_WINDOW_GAP_PX * scale)
        free_area = screen.inflate(-2 * gap, -2 * gap)
        box.width = round(_TEXT_MARGINS_PX * scale) + max(widths)
        box.height = min(round(height * scale), free_area.height)
        if self._position is None:
            box.midbottom = free_area.midbottom
        else:
            box.topleft = self._position
        box.clamp_ip(free_area)


def _is_enabled(command: Command | None) -> bool:
    return command is not None and not command.get_disabled_reason()
