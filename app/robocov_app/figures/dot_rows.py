"""Rows of points on one horizontal axis: their positions, names, points and medians.

Heights are counted from the top, in rows. Names of rows are to the left of the axis, names of groups above
their rows.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from robocov.typing import FloatArray
from robocov_app.figures.page import (
    POINTS_PER_INCH,
    TEXT_SIZE_PT,
    FigurePage,
    PageBox,
    get_figure,
    style_axes,
    to_plot_color,
)
from robocov_app.look.curve_styles import CurveStyle
from robocov_app.look.labels import shorten_text
from robocov_app.look.theme import Theme

MAX_POINTS = 250
"""Maximum number of points drawn for a sample; of larger samples, points with evenly spaced ranks."""
MIN_BOX_VALUES = 5
"""Minimum number of values for a box; of fewer values, the points alone say more."""
HALF_BOX_HEIGHT = 0.27
_ROW_HEIGHT_PX = 30.0
_HEADING_HEIGHT_PX = 26.0
_HEADING_HEIGHT = _HEADING_HEIGHT_PX / _ROW_HEIGHT_PX
_GROUP_GAP = 0.2
_NAME_GAP_PT = 13.0
"""Space between the name of a row and the axis, for its mark."""
_MARK_MARGIN_PT = 3.0
_MAX_NAME_FRACTION = 0.42
"""Maximum width of names, as a fraction of the page width."""
# Margins of a page at scale 1, px.
_LEFT_MARGIN_PX = 32
_RIGHT_MARGIN_PX = 16
_TOP_MARGIN_PX = 8
_BOTTOM_MARGIN_PX = 46
# Sizes of points.
_SINGLE_POINT_PT = 6.0
_POINT_PT = 3.6
_POINT_OPACITY = 0.65


class RowPositions(NamedTuple):
    """Vertical positions of rows and headings, in rows from the top.

    Attributes
    ----------
    rows : list of float
        Middle of each row.
    headings : list of float
        Middle of the heading of each group.
    total : float
        Height of everything.
    """

    rows: list[float]
    headings: list[float]
    total: float


def arrange_rows(groups: Sequence[tuple[str, int]]) -> RowPositions:
    """Compute the vertical positions of rows in groups, each below the heading of its group.

    Parameters
    ----------
    groups : sequence of (str, int)
        Name of each group, which may be empty, and its number of rows.

    Returns
    -------
    RowPositions
    """
    rows: list[float] = []
    headings: list[float] = []
    height = 0.0
    for name, count in groups:
        if name:
            gap = _GROUP_GAP if rows else 0.0
            height += _HEADING_HEIGHT + gap
            headings.append(height - 0.5 * _HEADING_HEIGHT)
        else:
            headings.append(height - 0.5)
        rows += [height + number + 0.5 for number in range(count)]
        height += count
    return RowPositions(rows, headings, height)


def create_row_axes(
    height: float, names: Sequence[str], theme: Theme, *, width: int, scale: float
) -> tuple[Axes, list[str]]:
    """Create a page that is high enough for some rows, with axes that leave space for their names.

    Parameters
    ----------
    height : float
        Total height in rows, from `arrange_rows`.
    names : sequence of str
        Names of the rows.
    theme : Theme
    width : int, px
        Width of the page.
    scale : float
        Scale of texts and lines.

    Returns
    -------
    axes : matplotlib.axes.Axes
    short_names : list of str
        The names, shortened if they do not fit to the left of the axes.
    """
    # A first page, of any height, serves to measure the names.
    page = FigurePage((width, 200), theme, scale)
    max_name_width = _MAX_NAME_FRACTION * width
    short_names = [shorten_text(name, page.measure_text, max_name_width, min_chars=1) for name in names]
    left = max(page.measure_text(name) for name in short_names) + _LEFT_MARGIN_PX * scale
    top = _TOP_MARGIN_PX * scale
    bottom = _BOTTOM_MARGIN_PX * scale
    page_height = round(top + _ROW_HEIGHT_PX * scale * height + bottom)
    page = FigurePage((width, page_height), theme, scale)
    axes_width = width - left - _RIGHT_MARGIN_PX * scale
    axes = page.add_axes(PageBox(left, top, axes_width, page_height - top - bottom))
    axes.set_ylim(height, 0.0)
    return axes, short_names


def label_rows(
    axes: Axes,
    rows: Sequence[float],
    names: Sequence[str],
    theme: Theme,
    label: str,
) -> None:
    """Write the names of rows to the left of the axes, and the label of the horizontal axis."""
    axes.set_yticks(rows, names)
    style_axes(axes, theme, label, grid="x")
    axes.tick_params(axis="y", left=True, length=0.0, labelsize=TEXT_SIZE_PT, pad=_NAME_GAP_PT)


def draw_row_marks(axes: Axes, rows: Sequence[float], styles: Sequence[CurveStyle], theme: Theme) -> None:
    """Draw the mark of each row between its name and the axis."""
    offset_px = -0.5 * (_NAME_GAP_PT + _MARK_MARGIN_PT) * get_figure(axes).dpi / POINTS_PER_INCH
    x = offset_px / axes.get_window_extent().width
    for row, style in zip(rows, styles, strict=True):
        axes.plot(
            x,
            row,
            style.mark,
            color=to_plot_color(style.get_color(theme)),
            markersize=5.5,
            transform=axes.get_yaxis_transform(),
            clip_on=False,
        )


def draw_row_points(axes: Axes, values: FloatArray, row: float, style: CurveStyle, theme: Theme) -> None:
    """Draw sorted values as points in a row, scattered vertically so that they rarely hide each other."""
    if len(values) > MAX_POINTS:
        ranks = np.rint(np.linspace(0, len(values) - 1, MAX_POINTS)).astype(int)
        values = values[ranks]
    if len(values) < MIN_BOX_VALUES:
        offsets = np.zeros(len(values))
        size = _SINGLE_POINT_PT
        opacity = 1.0
    else:
        offsets = _compute_scatter_offsets(len(values))
        size = _POINT_PT
        opacity = _POINT_OPACITY
    axes.plot(
        values,
        row + offsets,
        "o",
        color=to_plot_color(style.get_color(theme)),
        zorder=3.5,
        markeredgecolor=to_plot_color(theme.background),
        markeredgewidth=0.4,
        markersize=size,
        alpha=opacity,
    )


def _compute_scatter_offsets(count: int) -> FloatArray:
    """Return vertical offsets of points, (count,), from the van der Corput sequence.

    Element k of the sequence is the number whose binary fraction has the digits of k in reverse order.
    Successive elements differ widely.
    """
    bits = np.arange(1, MAX_POINTS.bit_length() + 1)
    digits = np.arange(1, count + 1)[:, None] >> (bits - 1) & 1
    fractions = digits @ 0.5**bits
    return np.asarray((fractions - 0.5) * 1.5 * HALF_BOX_HEIGHT)


def draw_row_median(axes: Axes, value: float, row: float, theme: Theme) -> None:
    """Draw a median as a vertical line in a row."""
    axes.plot(
        [value, value],
        [row - HALF_BOX_HEIGHT, row + HALF_BOX_HEIGHT],
        color=to_plot_color(theme.ink),
        linewidth=2.2,
        solid_capstyle="butt",
        zorder=5,
    )
