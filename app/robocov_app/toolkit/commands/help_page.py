"""The help page, which lists the keys of all commands."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from pygame import Rect, Surface

from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.render.fonts import render_text, shorten_to_width
from robocov_app.toolkit.commands.command import Command
from robocov_app.toolkit.overlay import draw_card, draw_veil
from robocov_app.toolkit.window.input import format_key

Position: TypeAlias = tuple[float, float]
"""Horizontal and vertical position in the window, px."""

# Lengths in pixels at scale 1.
_WIDE_WINDOW_PX = 1150
_MAX_WIDTH_PX = 1240
_MAX_ROW_PX = 16.5
_MARGIN_PX = 20
_TOP_PX = 44
_BOTTOM_PX = 14
_TITLE_SIZE_PX = 16
_HINT_SIZE_PX = 11
_KEY_WIDTH_PX = 84
_TITLE_GAP_PX = 8
"""Distance between the title of a command and the next column."""
_TITLE_TOP_PX = 12
_HINT_MIDDLE_PX = 22
"""Distance of the middle of the hint from the upper edge of the page."""
_WINDOW_MARGIN_PX = 12
"""Minimum distance of the page from the left and right edges of the window."""
_MIN_SPACE_AROUND_ROWS_PX = 90
"""Minimum difference between the heights of the window and of the rows."""
_SPACE_AROUND_ROWS_PX = 66
"""Difference between the heights of the page and of the rows."""

_COLUMN_COUNT = 3
_WIDE_COLUMN_COUNT = 4
"""Number of columns in windows that are at least `_WIDE_WINDOW_PX` wide."""
_TEXT_FRACTION = 0.66
"""Size of the text as a fraction of the height of a row."""
_HEADING_TEXT_FRACTION = 0.92
"""Size of the headings as a fraction of the size of the text."""
_HEADING_GAP_ROWS = 0.5
"""Space above a heading."""
_TITLE_STRENGTH = 0.8
"""Fraction of the color of text in the titles of commands."""

_MIN_TEXT_PX = 8
"""Minimum text size, at any scale."""
_HEADING_ROWS = 2.6
"""Rows that must be free for a heading, so that it is never the last line of a column."""


@dataclass(frozen=True)
class _Columns:
    """Layout of the help page: `count` columns of rows inside `box`, in pixels."""

    count: int
    row_height: float
    text_size: int
    box: Rect
    scale: float

    @property
    def width(self) -> float:
        """Width of a column, px."""
        return (self.box.width - 2 * _MARGIN_PX * self.scale) / self.count

    @property
    def top(self) -> float:
        """Upper end of the columns, px."""
        return self.box.top + _TOP_PX * self.scale

    @property
    def bottom(self) -> float:
        """Lower end of the columns, px."""
        return self.box.bottom - _BOTTOM_PX * self.scale


def draw_help_page(
    screen: Surface,
    theme: Theme,
    scale: float,
    commands: Sequence[Command],
    *,
    groups: Sequence[str],
    hint: str,
) -> None:
    """Draw the help page with the keys of commands over the window.

    Parameters
    ----------
    screen : pygame.Surface
    theme : Theme
    scale : float
        Scale of the text. The text is reduced further if the page does not fit into the window.
    commands : sequence of Command
    groups : sequence of str
        Names of the command groups, in the order in which they are shown.
    hint : str
        Text next to the title.
    """
    draw_veil(screen, theme)
    lines = _list_lines(commands, groups)
    columns = _arrange_columns(screen, scale, rows=len(lines) + len(groups))
    draw_card(screen, columns.box, theme, scale)
    _draw_title(screen, theme, columns, hint)
    for line, (x, y) in _place_lines(lines, columns):
        if isinstance(line, str):
            size = max(_MIN_TEXT_PX, round(columns.text_size * _HEADING_TEXT_FRACTION))
            screen.blit(render_text(line.upper(), size, theme.accent, True), (round(x), round(y)))
        else:
            _draw_command(screen, theme, columns, line, (x, y))


def _list_lines(commands: Sequence[Command], groups: Sequence[str]) -> list[str | Command]:
    """List the headings, each followed by those of its commands that have a key and are not hidden."""
    lines: list[str | Command] = []
    for group in groups:
        lines.append(group)
        with_keys = [command for command in commands if command.keys and not command.hidden]
        lines += [command for command in with_keys if command.group == group]
    return lines


def _arrange_columns(screen: Surface, scale: float, rows: int) -> _Columns:
    """Choose the number of columns, and a row height at which `rows` rows fit."""
    width, height = screen.get_size()
    count = _COLUMN_COUNT
    if width >= _WIDE_WINDOW_PX * scale:
        count = _WIDE_COLUMN_COUNT
    # One spare row, because a heading may have to move to the next column.
    rows_per_column = math.ceil(rows / count) + 1
    row_height = min(_MAX_ROW_PX * scale, (height - _MIN_SPACE_AROUND_ROWS_PX * scale) / rows_per_column)
    box_width = round(min(width - 2 * _WINDOW_MARGIN_PX * scale, _MAX_WIDTH_PX * scale))
    box_height = round(rows_per_column * row_height + _SPACE_AROUND_ROWS_PX * scale)
    box = Rect(0, 0, box_width, box_height)
    box.center = width // 2, height // 2
    text_size = max(_MIN_TEXT_PX, round(row_height * _TEXT_FRACTION))
    return _Columns(count, row_height, text_size, box, scale)


def _draw_title(screen: Surface, theme: Theme, columns: _Columns, hint: str) -> None:
    scale = columns.scale
    box = columns.box
    title = render_text("Keys", round(_TITLE_SIZE_PX * scale), theme.ink, True)
    screen.blit(title, (box.left + round(_MARGIN_PX * scale), box.top + round(_TITLE_TOP_PX * scale)))
    image = render_text(hint, round(_HINT_SIZE_PX * scale), theme.faint)
    right_end = box.right - round(_MARGIN_PX * scale), box.top + round(_HINT_MIDDLE_PX * scale)
    screen.blit(image, image.get_rect(midright=right_end))


def _place_lines(
    lines: Sequence[str | Command], columns: _Columns
) -> Iterator[tuple[str | Command, Position]]:
    """Yield each line with the position of its upper left corner, px."""
    row_height = columns.row_height
    x = columns.box.left + _MARGIN_PX * columns.scale
    y = columns.top
    for line in lines:
        is_heading = isinstance(line, str)
        # A heading must fit together with its first command.
        height = row_height
        if is_heading:
            height = row_height * _HEADING_ROWS
        if y + height > columns.bottom:
            x += columns.width
            y = columns.top
        if is_heading and y > columns.top + columns.scale:
            y += _HEADING_GAP_ROWS * row_height
        yield line, (x, y)
        y += row_height


def _draw_command(
    screen: Surface, theme: Theme, columns: _Columns, command: Command, position: Position
) -> None:
    """Draw the key and the title of a command in a row; `position` is the upper left corner, px."""
    size = columns.text_size
    x, y = position
    screen.blit(render_text(format_key(command.keys[0]), size, theme.ink, True), (round(x), round(y)))
    max_width = columns.width - (_KEY_WIDTH_PX + _TITLE_GAP_PX) * columns.scale
    title = shorten_to_width(command.title.partition(":")[0], size, max_width)
    image = render_text(title, size, mix(theme.panel, theme.ink, _TITLE_STRENGTH))
    screen.blit(image, (round(x + _KEY_WIDTH_PX * columns.scale), round(y)))
