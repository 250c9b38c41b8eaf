"""The list of recent sessions on the start page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from pygame import Rect

from robocov_app.render.fonts import shorten_to_width
from robocov_app.viewer.start.drawing import StartDrawing
from robocov_app.viewer.start.items import StartItem
from robocov_app.viewer.start.layout import RECENT_ROW_PX, StartLayout

MAX_RECENT_ROWS = 7

# Lengths in pixels at scale 1.
_NAME_PX = 13
_FOLDER_PX = 11
_MARGIN_PX = 8
_NAME_TOP_PX = 4
_FOLDER_DROP_PX = 3  # from the middle of a row to the top of the folder


class RecentSection:
    """A row for each of the sessions used last.

    Parameters
    ----------
    recent : sequence of Path
        Sessions used recently, newest first.
    open_file : callable
        Called with the path of the chosen session.
    """

    def __init__(self, recent: Sequence[Path], open_file: Callable[[Path], None]) -> None:
        self._paths = recent[:MAX_RECENT_ROWS]
        self._open_file = open_file

    def list_items(self, layout: StartLayout) -> list[StartItem]:
        """Return the rows that fit."""
        items: list[StartItem] = []
        for row, path in enumerate(self._paths):
            box = layout.get_recent_row(row)
            if box.bottom <= layout.recent.bottom:
                action = partial(self._open_file, path)
                items.append(StartItem(f"recent:{row}", box, action, partial(_draw_row, path, box)))
        return items


def _draw_row(path: Path, box: Rect, drawing: StartDrawing, is_focused: bool) -> None:
    """Draw a session: its name above its folder."""
    theme = drawing.theme
    scale = drawing.scale
    if is_focused:
        drawing.draw_frame(box, is_focused=True)
    width = box.width - 2 * _MARGIN_PX * scale
    x = box.left + _MARGIN_PX * scale
    name = shorten_to_width(path.stem, drawing.px(_NAME_PX), width)
    drawing.write(name, (x, box.top + _NAME_TOP_PX * scale), _NAME_PX, theme.ink)
    folder = shorten_to_width(str(path.parent), drawing.px(_FOLDER_PX), width)
    folder_top = box.top + (RECENT_ROW_PX / 2 + _FOLDER_DROP_PX) * scale
    drawing.write(folder, (x, folder_top), _FOLDER_PX, theme.faint)
