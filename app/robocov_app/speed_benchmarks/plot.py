"""Figure of the ratios of a benchmark, one dot for each row."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import cast

from matplotlib.axes import Axes

from robocov_app.figures.files import plain_style, save_figure
from robocov_app.figures.page import (
    HEADING_SIZE_PT,
    SMALL_SIZE_PT,
    TEXT_SIZE_PT,
    FigurePage,
    PageBox,
    style_axes,
    to_plot_color,
)
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.speed_benchmarks.measure import Row

NOTE = "medians of alternating calls on one thread; below 1 robocov is faster; a bar marks the goal"
"""Text below the title."""
HEADINGS = {
    "step": "Simulated step",
    "maps": "Exact coverage cost on maps",
    "cost": "Exact coverage cost among random obstacles",
    "learning": "Learning environments",
    "sweep": "Sweeps",
    "render": "Frames",
    "window": "Window",
    "start": "Start of commands",
}
"""Heading of each part of the benchmark."""
_WIDTH_PX = 1100
_MARGIN_PX = 24
_TITLE_CENTER_PX = 30
_NOTE_CENTER_PX = 58
"""Vertical positions of the title and of the note."""
_TITLE_HEIGHT_PX = 92
_ROW_HEIGHT_PX = 26
_LEFT_PX = 400
"""Width of the row labels, left of the axes."""
_RIGHT_PX = 90
"""Width of the row values, right of the axes."""
_HEADING_HEIGHT_PX = 66
"""Space above a part for its heading."""
_HEADING_OFFSET_PX = 16
"""Distance from the top of a part to the middle of its heading."""
_PART_BOTTOM_PX = 16
_TEXT_GAP_PX = 14
"""Space between the axes and the texts of a row."""
_GOAL_BAR_ROWS = 0.36
"""Half the length of the bar at a goal, as a fraction of the height of a row."""
_RATIO_LINE_WIDTH_PT = 1.6
_RATIO_LINE_OPACITY = 0.5
_DOT_SIZE_PT = 6.5
_LOW_MARGIN = 0.75
_HIGH_MARGIN = 1.35
"""Factors from the smallest and the largest drawn value to the limits of the axes."""
_DECADES = range(-4, 6)
"""Powers of ten between which ticks are chosen."""
_AXES_OFFSET_PX = 26
_MAX_TICKS = 7


def save_ratios(rows: Sequence[Row], path: Path, theme: Theme = LIGHT) -> None:
    """Draw all ratios and goals on logarithmic axes, and save the figure.

    Parameters
    ----------
    rows : sequence of Row
        Rows without a ratio are left out.
    path : Path
        Output file; see `robocov_app.figures.files.save_figure` for the formats.
    theme : Theme
        Color theme.
    """
    with_ratio = [row for row in rows if row.ratio is not None]
    parts = [(part, list(group)) for part, group in groupby(with_ratio, key=lambda row: row.part)]
    height = _TITLE_HEIGHT_PX + sum(_compute_part_height(group) for _, group in parts)
    with plain_style():
        page = FigurePage((_WIDTH_PX, height), theme, scale=1.0)
        page.write(
            "Time relative to the baseline",
            _MARGIN_PX,
            _TITLE_CENTER_PX,
            points=HEADING_SIZE_PT,
            bold=True,
        )
        page.write(NOTE, _MARGIN_PX, _NOTE_CENTER_PX, color=theme.faint)
        top = float(_TITLE_HEIGHT_PX)
        for part, group in parts:
            _draw_part(page, HEADINGS[part], group, top)
            top += _compute_part_height(group)
    save_figure(page.figure, path)


def _compute_part_height(rows: Sequence[Row]) -> int:
    return _HEADING_HEIGHT_PX + _ROW_HEIGHT_PX * len(rows) + _PART_BOTTOM_PX


def _draw_part(page: FigurePage, heading: str, rows: Sequence[Row], top: float) -> None:
    """Draw the heading and the rows of a part, starting at the vertical position `top`, px."""
    page.write(heading, _MARGIN_PX, top + _HEADING_OFFSET_PX, points=TEXT_SIZE_PT + 1.5, bold=True)
    axes_top = top + _HEADING_HEIGHT_PX - _AXES_OFFSET_PX
    width = _WIDTH_PX - _LEFT_PX - _RIGHT_PX
    axes = page.add_axes(PageBox(_LEFT_PX, axes_top, width, _ROW_HEIGHT_PX * len(rows)))
    style_axes(axes, page.theme, grid="x")
    axes.set_xscale("log")
    axes.axvline(1.0, color=to_plot_color(page.theme.faint), linewidth=1)
    for number, row in enumerate(rows):
        # y points up in the axes, and the first row is at the top.
        _draw_row(axes, row, len(rows) - 1 - number, page.theme)
        _draw_row_texts(page, row, axes_top + _ROW_HEIGHT_PX * (number + 0.5))
    low, high = _find_limits(rows)
    axes.set_ylim(-0.5, len(rows) - 0.5)
    axes.set_xlim(low, high)
    ticks = _choose_ticks(low, high)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_yticks([])
    axes.minorticks_off()


def _draw_row(axes: Axes, row: Row, y: float, theme: Theme) -> None:
    """Draw the dot of a row, a line from it to ratio 1, and a bar at its goal."""
    ratio = cast("float", row.ratio)
    color = to_plot_color(theme.accent)
    if row.meets_goals is False:
        color = to_plot_color(theme.error)
    axes.plot([1.0, ratio], [y, y], color=color, linewidth=_RATIO_LINE_WIDTH_PT, alpha=_RATIO_LINE_OPACITY)
    axes.plot(ratio, y, "o", color=color, markersize=_DOT_SIZE_PT)
    if row.max_ratio is not None:
        bar = [y - _GOAL_BAR_ROWS, y + _GOAL_BAR_ROWS]
        axes.plot([row.max_ratio] * 2, bar, color=to_plot_color(theme.ink), linewidth=2)


def _draw_row_texts(page: FigurePage, row: Row, y: float) -> None:
    """Draw the label of a row to the left of the axes, and its ratio to the right."""
    label = ", ".join(text for text in (row.name, row.case) if text)
    page.write(
        f"{label}  /  {row.baseline}",
        _LEFT_PX - _TEXT_GAP_PX,
        y,
        points=SMALL_SIZE_PT,
        max_width=_LEFT_PX - _MARGIN_PX - _TEXT_GAP_PX,
        align="right",
    )
    ratio_x = _WIDTH_PX - _RIGHT_PX + _TEXT_GAP_PX
    page.write(f"{row.ratio:.2f}", ratio_x, y, points=SMALL_SIZE_PT, bold=row.meets_goals is False)


def _find_limits(rows: Sequence[Row]) -> tuple[float, float]:
    """Return horizontal limits that include all ratios, all goals and 1, with some margin."""
    values = [1.0]
    for row in rows:
        values += [value for value in (row.ratio, row.max_ratio) if value is not None]
    return _LOW_MARGIN * min(values), _HIGH_MARGIN * max(values)


def _choose_ticks(low: float, high: float) -> list[float]:
    """Choose round numbers between two limits as ticks, at most `_MAX_TICKS` if possible.

    >>> _choose_ticks(0.08, 6.0)
    [0.1, 0.2, 0.5, 1.0, 2.0, 5.0]
    """
    ticks: list[float] = []
    for leading_digits in ((1, 2, 5), (1, 3), (1,)):
        numbers = [float(f"{digit}e{power}") for power in _DECADES for digit in leading_digits]
        ticks = [number for number in numbers if low <= number <= high]
        if len(ticks) <= _MAX_TICKS:
            break
    return ticks
