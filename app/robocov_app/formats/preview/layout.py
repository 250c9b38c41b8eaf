"""Layout of the figure of an import: two arenas side by side or stacked, captions, and lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.artist import Artist

from robocov_app.figures.page import SMALL_SIZE_PT, TITLE_SIZE_PT, FigurePage, PagePanel
from robocov_app.look.theme import Theme
from robocov_app.render.panel_grid import choose_column_count

LINE_HEIGHT_PX = 17.0
"""Height of a line of the report, at scale 1."""
_MAX_WIDTH_PX = 1600
_MIN_WIDTH_PX = 1040
"""Width that the text needs."""
_MAX_ARENAS_HEIGHT_PX = 1000
_MIN_HEIGHT_PX = 320
_SCALE = 1.3
"""Scale of text and lines."""
_TITLE_HEIGHT_PX = 66.0
_CAPTION_HEIGHT_PX = 34.0
_ROW_GAP_PX = 14
_MARGIN_BELOW_LINES_PX = 14
_CAPTION_GAP_PX = 12
"""All at scale 1."""
_ARENA_COUNT = 2
_MAX_LINES = 12
"""Maximum number of lines of the report; the last one counts those that are omitted."""
_CONTINUATION_INDENT = "    "


class Caption(NamedTuple):
    """The text above an arena: a name, followed by facts in a fainter color."""

    name: str
    facts: str


class ImportPage(NamedTuple):
    """The page of an import.

    Attributes
    ----------
    page : FigurePage
    panels : list of PagePanel
        Positions of the map as read and of the map as imported.
    lines : list of str
        Lines of the report, wrapped to the width of the page.
    """

    page: FigurePage
    panels: list[PagePanel]
    lines: list[str]


def lay_out_page(
    theme: Theme, aspect: float, captions: Sequence[Caption], handles: list[Artist], lines: Sequence[str]
) -> ImportPage:
    """Compute the size of the page of an import, and the positions of its contents.

    Parameters
    ----------
    theme : Theme
    aspect : float
        Width of an arena divided by its height.
    captions : sequence of Caption
        One for each arena.
    handles : list of matplotlib artists
        Entries of the legend.
    lines : sequence of str
        Lines of the report.

    Returns
    -------
    ImportPage
        An empty page and the positions on it.
    """
    # A first page only to measure text; its size does not matter.
    page = FigurePage((_MAX_WIDTH_PX, _MAX_WIDTH_PX), theme, _SCALE)
    margin = page.margin
    title_height = _TITLE_HEIGHT_PX * page.scale
    caption_height = _CAPTION_HEIGHT_PX * page.scale
    caption_width = max(
        measure_caption_indent(page, caption.name) + page.measure_text(caption.facts) for caption in captions
    )
    columns = choose_column_count(
        _ARENA_COUNT, aspect, (_MAX_WIDTH_PX, _MAX_ARENAS_HEIGHT_PX), row_margin=caption_height
    )
    rows = _ARENA_COUNT // columns
    max_arena_height = _MAX_ARENAS_HEIGHT_PX / rows
    max_arena_width = (_MAX_WIDTH_PX - margin) / columns - margin
    # A map that is taller than wide does not need a wide page.
    arena_width = min(max_arena_width, max(aspect * max_arena_height, caption_width))
    arena_height = min(arena_width / aspect, max_arena_height)
    width = max(columns * (arena_width + margin) + margin, _MIN_WIDTH_PX)
    slot_width = min(max(arena_height * aspect, caption_width), (width - margin) / columns - margin)
    left = (width - columns * slot_width - (columns - 1) * margin) / 2
    # A second page, of the final width, to measure the lines and the legend that determine the height.
    page = FigurePage((int(width), _MAX_WIDTH_PX), theme, _SCALE)
    wrapped_lines = wrap_lines(page, lines, width - left - margin)
    lines_height = (LINE_HEIGHT_PX * len(wrapped_lines) + _MARGIN_BELOW_LINES_PX) * page.scale
    height_below = page.measure_footer(handles, bar_left=left) + lines_height
    gaps_height = (rows - 1) * _ROW_GAP_PX * page.scale
    height = title_height + rows * (caption_height + arena_height) + gaps_height + height_below
    page = FigurePage((int(width), int(max(height, _MIN_HEIGHT_PX))), theme, _SCALE)
    panels = page.arrange_panels(
        _ARENA_COUNT,
        columns,
        aspect=aspect,
        caption_width=caption_width,
        caption_height=caption_height,
        top=title_height,
        bottom=height_below,
    )
    return ImportPage(page, panels, wrapped_lines)


def measure_caption_indent(page: FigurePage, name: str) -> float:
    """Return the distance from the start of a caption to its facts, px."""
    return page.measure_text(name, points=TITLE_SIZE_PT, bold=True) + _CAPTION_GAP_PX * page.scale


def wrap_lines(page: FigurePage, lines: Sequence[str], max_width: float) -> list[str]:
    """Wrap the lines of the report to `max_width`, px; the last one gives the number of lines left out."""
    wrapped: list[str] = []
    for line in lines:
        wrapped += _wrap_line(page, line, max_width)
    if len(wrapped) > _MAX_LINES:
        first_lines = wrapped[: _MAX_LINES - 1]
        wrapped = [*first_lines, f"and {len(wrapped) - len(first_lines)} more lines"]
    return wrapped


def _wrap_line(page: FigurePage, line: str, max_width: float) -> list[str]:
    """Break a line that is wider than `max_width`, px, into several; all but the first are indented."""
    if page.measure_text(line, points=SMALL_SIZE_PT) <= max_width:
        return [line]
    wrapped: list[str] = []
    current = ""
    for word in line.split():
        extended = f"{current} {word}" if current else word
        if current and page.measure_text(extended, points=SMALL_SIZE_PT) > max_width:
            wrapped.append(current)
            extended = f"{_CONTINUATION_INDENT}{word}"
        current = extended
    return [*wrapped, current]
