"""The help page, which lists the keys of all commands."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.render.fonts import measure_text, render_text, shorten_to_width
from robocov_app.toolkit.commands.command import Command
from robocov_app.toolkit.overlay import draw_card, draw_rounded_box, draw_veil, wrap_text
from robocov_app.toolkit.window.input import SCROLL_PX_PER_NOTCH, format_key, get_key_name, get_wheel_notches

Position: TypeAlias = tuple[float, float]
"""Horizontal and vertical position in the window, px."""

# Lengths in pixels at scale 1. The page is never drawn at a smaller scale.
_TEXT_PX = 12
_ROW_PX = 17.5
_MIN_COLUMN_PX = 266
_MAX_WIDTH_PX = 1240
_MARGIN_PX = 20
_TOP_PX = 44
_BOTTOM_PX = 14
_TITLE_SIZE_PX = 16
_KEY_WIDTH_PX = 98
_TITLE_GAP_PX = 8
"""Distance between the title of a command and the next column, and between the title and the hint."""
_TITLE_TOP_PX = 12
_HINT_MIDDLE_PX = 22
"""Distance of the middle of the hint from the upper edge of the page."""
_HINT_LINE_PX = 16
_WINDOW_MARGIN_PX = 12
"""Minimum distance of the page from the edges of the window."""
_BAR_WIDTH_PX = 6
_BAR_RIGHT_PX = 7
"""Distance of the scroll bar from the right edge of the page."""
_MIN_KNOB_PX = 20

_MIN_SCALE = 1.0
_TITLE = "Keys"
_MAX_COLUMNS = 4
_HEADING_GAP_ROWS = 0.5
"""Space above a heading."""
_TITLE_STRENGTH = 0.8
"""Fraction of the color of text in the titles of commands."""
_KNOB_STRENGTH = 0.35
"""Fraction of the color of text in the scroll bar."""
_HEADING_ROWS = 3.5
"""Rows that must be free for a heading, so that at least two commands follow it in its column."""

_LINE_KEYS = {"up": -1.0, "down": 1.0}
"""Number of rows by which a key scrolls the page."""
_PAGE_KEYS = {"page up": -1.0, "page down": 1.0, "home": -math.inf, "end": math.inf}
"""Number of visible heights by which a key scrolls the page."""


class _Cell(NamedTuple):
    """A heading or a command with its column, and its row below the start of the columns."""

    line: str | Command
    column: int
    row: float


@dataclass(frozen=True)
class _Columns:
    """Layout of the help page, in pixels.

    Attributes
    ----------
    count : int
        Number of columns.
    cells : list of _Cell
        The lines with their positions.
    box : Rect
        The card.
    hint_lines : list of str
        Lines of the hint below the title; empty if the hint is next to the title.
    scale : float
        Scale of the text.
    """

    count: int
    cells: list[_Cell]
    box: Rect
    hint_lines: list[str]
    scale: float

    @property
    def row_height(self) -> float:
        """Height of a row, px."""
        return _ROW_PX * self.scale

    @property
    def text_size(self) -> int:
        """Size of the text, px."""
        return round(_TEXT_PX * self.scale)

    @property
    def width(self) -> float:
        """Width of a column, px."""
        return (self.box.width - 2 * _MARGIN_PX * self.scale) / self.count

    @property
    def height(self) -> float:
        """Height of the longest column, px."""
        return max(cell.row + 1 for cell in self.cells) * self.row_height

    @property
    def view(self) -> Rect:
        """Part of the card in which the columns are visible."""
        top = round(_measure_top(self.hint_lines) * self.scale)
        bottom = round(_BOTTOM_PX * self.scale)
        return Rect(self.box.left, self.box.top + top, self.box.width, self.box.height - top - bottom)

    @property
    def max_offset(self) -> float:
        """Maximum distance by which the columns can be scrolled, px."""
        return max(self.height - self.view.height, 0.0)


class HelpPage:
    """The page with the keys of all commands; it scrolls if they do not fit into the window.

    Parameters
    ----------
    groups : sequence of str
        Names of the command groups, in the order in which they are shown.
    hint : str
        Text next to the title, or below it in a narrow window.

    Attributes
    ----------
    is_open : bool
        Whether the page is shown.
    """

    def __init__(self, groups: Sequence[str], hint: str) -> None:
        self.is_open = False
        self._groups = groups
        self._hint = hint
        self._offset = 0.0
        self._columns: _Columns | None = None

    @property
    def frame_key(self) -> object:
        """Values on which the drawn page depends."""
        return self.is_open, self._offset

    def toggle(self) -> None:
        """Show the page from its start, or close it."""
        self.is_open = not self.is_open
        self._offset = 0.0

    def close(self) -> None:
        """Close the page."""
        self.is_open = False

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Scroll or close the open page; return whether the event was handled.

        A click closes the page, and is not passed on.
        """
        columns = self._columns
        if not self.is_open or columns is None:
            return False
        if event.type == pygame.KEYDOWN:
            return self._handle_key(get_key_name(event), columns)
        if event.type == pygame.MOUSEWHEEL:
            self._scroll(-SCROLL_PX_PER_NOTCH * columns.scale * get_wheel_notches(event), columns)
            return True
        if event.type == pygame.MOUSEBUTTONDOWN:
            # pygame also reports the wheel as further buttons.
            if event.button <= pygame.BUTTON_RIGHT:
                self.close()
            return True
        return False

    def _handle_key(self, name: str, columns: _Columns) -> bool:
        """Scroll the page by a key; return whether it was handled."""
        if name in _LINE_KEYS:
            self._scroll(_LINE_KEYS[name] * columns.row_height, columns)
            return True
        if name in _PAGE_KEYS:
            self._scroll(_PAGE_KEYS[name] * columns.view.height, columns)
            return True
        return False

    def _scroll(self, distance: float, columns: _Columns) -> None:
        """Scroll the columns by a distance, px; they stop at their ends."""
        self._offset = min(max(self._offset + distance, 0.0), columns.max_offset)

    def draw(self, screen: Surface, theme: Theme, scale: float, commands: Sequence[Command]) -> None:
        """Draw the page over the window, if it is open.

        Parameters
        ----------
        screen : pygame.Surface
        theme : Theme
        scale : float
            Scale of the window. The page is drawn at scale 1 or larger.
        commands : sequence of Command
        """
        if not self.is_open:
            return
        draw_veil(screen, theme)
        lines = _list_lines(commands, self._groups)
        columns = _arrange_columns(screen, max(scale, _MIN_SCALE), self._hint, lines)
        self._columns = columns
        # In a larger window, the page may end before the offset.
        self._scroll(0.0, columns)
        draw_card(screen, columns.box, theme, columns.scale)
        _draw_title(screen, theme, columns, self._hint)
        view = columns.view
        screen.set_clip(view.clip(screen.get_rect()))
        for cell in columns.cells:
            x = columns.box.left + _MARGIN_PX * columns.scale + cell.column * columns.width
            y = view.top + cell.row * columns.row_height - self._offset
            if not view.top - columns.row_height < y < view.bottom:
                continue
            if isinstance(cell.line, str):
                image = render_text(cell.line.upper(), columns.text_size, theme.accent, bold=True)
                screen.blit(image, (round(x), round(y)))
            else:
                _draw_command(screen, theme, columns, cell.line, (x, y))
        screen.set_clip(None)
        _draw_scroll_bar(screen, theme, columns, self._offset)


def _list_lines(commands: Sequence[Command], groups: Sequence[str]) -> list[str | Command]:
    """List the headings, each followed by those of its commands that have a key and are not hidden."""
    lines: list[str | Command] = []
    for group in groups:
        lines.append(group)
        with_keys = [command for command in commands if command.keys and not command.hidden]
        lines += [command for command in with_keys if command.group == group]
    return lines


def _arrange_columns(screen: Surface, scale: float, hint: str, lines: Sequence[str | Command]) -> _Columns:
    """Choose the number of columns by the width of the window, and the height of the card by the rows."""
    width, height = screen.get_size()
    margin = 2 * _WINDOW_MARGIN_PX * scale
    box_width = round(min(width - margin, _MAX_WIDTH_PX * scale))
    text_width = box_width - 2 * _MARGIN_PX * scale
    count = min(max(int(text_width / (_MIN_COLUMN_PX * scale)), 1), _MAX_COLUMNS)
    cells = _place_lines(lines, count)
    hint_lines = _wrap_hint(hint, text_width, scale)
    space_around_rows = (_measure_top(hint_lines) + _BOTTOM_PX) * scale
    rows_height = max(cell.row + 1 for cell in cells) * _ROW_PX * scale
    box_height = min(math.ceil(rows_height + space_around_rows) + 1, round(height - margin))
    box = Rect(0, 0, box_width, box_height)
    box.center = width // 2, height // 2
    return _Columns(count, cells, box, hint_lines, scale)


def _place_lines(lines: Sequence[str | Command], count: int) -> list[_Cell]:
    """Distribute lines over a number of columns that are as short as possible."""
    rows = math.ceil(len(lines) / count)
    cells = _fill_columns(lines, rows)
    while cells[-1].column >= count:
        rows += 1
        cells = _fill_columns(lines, rows)
    return cells


def _fill_columns(lines: Sequence[str | Command], rows: int) -> list[_Cell]:
    """Fill columns of at most `rows` rows from top to bottom, as many columns as are needed."""
    cells: list[_Cell] = []
    column = 0
    row = 0.0
    for line in lines:
        is_heading = isinstance(line, str)
        if row > 0.0 and row + (_HEADING_ROWS if is_heading else 1) > rows:
            column += 1
            row = 0.0
        if is_heading and row > 0.0:
            row += _HEADING_GAP_ROWS
        cells.append(_Cell(line, column, row))
        row += 1
    return cells


def _wrap_hint(hint: str, width: float, scale: float) -> list[str]:
    """Return the lines of the hint below the title; none if it fits next to the title in a width, px."""
    size = round(_TEXT_PX * scale)
    title_width = measure_text(_TITLE, round(_TITLE_SIZE_PX * scale), bold=True)
    if title_width + _TITLE_GAP_PX * scale + measure_text(hint, size) <= width:
        return []
    return wrap_text(hint, size, width)


def _measure_top(hint_lines: Sequence[str]) -> float:
    """Return the height of the title, and of the hint below it, px at scale 1."""
    return _TOP_PX + _HINT_LINE_PX * len(hint_lines)


def _draw_title(screen: Surface, theme: Theme, columns: _Columns, hint: str) -> None:
    """Draw the title, and the hint next to it or, if the hint has several lines, below it."""
    scale = columns.scale
    left = columns.box.left + round(_MARGIN_PX * scale)
    top = columns.box.top
    title = render_text(_TITLE, round(_TITLE_SIZE_PX * scale), theme.ink, bold=True)
    screen.blit(title, (left, top + round(_TITLE_TOP_PX * scale)))
    for number, line in enumerate(columns.hint_lines):
        image = render_text(line, columns.text_size, theme.faint)
        y = top + round((_TITLE_TOP_PX + _TITLE_SIZE_PX + _TITLE_GAP_PX + _HINT_LINE_PX * number) * scale)
        screen.blit(image, (left, y))
    if not columns.hint_lines:
        image = render_text(hint, columns.text_size, theme.faint)
        hint_end = (columns.box.right - round(_MARGIN_PX * scale), top + round(_HINT_MIDDLE_PX * scale))
        screen.blit(image, image.get_rect(midright=hint_end))


def _draw_scroll_bar(screen: Surface, theme: Theme, columns: _Columns, offset: float) -> None:
    """Draw the scroll bar at the right edge of the card, if not all rows are visible."""
    if not columns.max_offset:
        return
    view = columns.view
    width = round(_BAR_WIDTH_PX * columns.scale)
    height = max(round(view.height**2 / columns.height), round(_MIN_KNOB_PX * columns.scale))
    top = view.top + round((view.height - height) * offset / columns.max_offset)
    left = columns.box.right - round(_BAR_RIGHT_PX * columns.scale) - width
    color = mix(theme.panel, theme.ink, _KNOB_STRENGTH)
    draw_rounded_box(screen, Rect(left, top, width, height), color, edge=color, radius=width // 2)


def _draw_command(
    screen: Surface, theme: Theme, columns: _Columns, command: Command, position: Position
) -> None:
    """Draw the key and the title of a command in a row; `position` is the upper left corner, px."""
    size = columns.text_size
    x, y = position
    screen.blit(render_text(format_key(command.keys[0]), size, theme.ink, bold=True), (round(x), round(y)))
    max_width = columns.width - (_KEY_WIDTH_PX + _TITLE_GAP_PX) * columns.scale
    title = shorten_to_width(command.title.partition(":")[0], size, max_width)
    image = render_text(title, size, mix(theme.panel, theme.ink, _TITLE_STRENGTH))
    screen.blit(image, (round(x + _KEY_WIDTH_PX * columns.scale), round(y)))
