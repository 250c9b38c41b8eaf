"""Plots of the distributions of final values, as horizontal boxes with points."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.typing import FloatArray
from robocov_app.figures.dot_rows import (
    HALF_BOX_HEIGHT,
    MIN_BOX_VALUES,
    arrange_rows,
    create_row_axes,
    draw_row_marks,
    draw_row_median,
    draw_row_points,
    label_rows,
)
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import (
    TEXT_SIZE_PT,
    PlotColor,
    ValueAxis,
    get_figure,
    set_value_limits,
    to_plot_color,
)
from robocov_app.look.curve_styles import CurveStyle
from robocov_app.look.theme import LIGHT, Theme

_WHISKER_LENGTH = 1.5
"""Maximum length of a whisker, in interquartile ranges."""
_MARGIN_FRACTION = 0.06


class Sample(NamedTuple):
    """One value from each of several runs.

    Attributes
    ----------
    label : str
    style : CurveStyle
    values : (m,) array
    """

    label: str
    style: CurveStyle
    values: FloatArray


@plain_style()
def plot_final_values(
    groups: Sequence[tuple[str, Sequence[Sample]]],
    value_axis: ValueAxis,
    *,
    width: int,
    scale: float,
    theme: Theme = LIGHT,
) -> Figure:
    """Plot samples in rows, grouped for example by map: a box with the quartiles, and values as points.

    Parameters
    ----------
    groups : sequence of (str, sequence of Sample)
        Name of each group, which may be empty, and its samples. Values that are not finite are left out.
        Samples of fewer than `MIN_BOX_VALUES` values have no box.
    value_axis : ValueAxis
    width : int, px
        Width of the page; its height depends on the number of samples.
    scale : float
        Scale of texts and lines.
    theme : Theme

    Returns
    -------
    matplotlib.figure.Figure
    """
    samples = [sample for _, group in groups for sample in group]
    positions = arrange_rows([(name, len(group)) for name, group in groups])
    names = [sample.label for sample in samples]
    axes, short_names = create_row_axes(positions.total, names, theme, width=width, scale=scale)
    finite_values = [np.sort(sample.values[np.isfinite(sample.values)]) for sample in samples]
    for sample, values, row in zip(samples, finite_values, positions.rows, strict=True):
        _draw_sample(axes, values, row, sample.style, theme)
    label_rows(axes, positions.rows, short_names, theme, value_axis.label)
    draw_row_marks(axes, positions.rows, [sample.style for sample in samples], theme)
    set_value_limits(axes.xaxis, np.concatenate(finite_values), value_axis, _MARGIN_FRACTION)
    group_names = [name for name, _ in groups]
    _write_headings(axes, group_names, positions.headings, theme)
    return get_figure(axes)


def _write_headings(axes: Axes, names: Sequence[str], heights: Sequence[float], theme: Theme) -> None:
    """Write the name of each group at the left edge of the page."""
    box = axes.get_position()
    # Just right of the left edge of the page, in fractions of the width of the axes.
    left = -box.x0 / box.width + 0.01
    for name, height in zip(names, heights, strict=True):
        if name:
            axes.text(
                left,
                height,
                name,
                transform=axes.get_yaxis_transform(),
                fontsize=TEXT_SIZE_PT,
                fontweight="bold",
                va="center",
                color=to_plot_color(theme.ink),
            )


def _draw_sample(axes: Axes, values: FloatArray, row: float, style: CurveStyle, theme: Theme) -> None:
    """Draw one row of sorted values: points, and a box and the median if there are enough values."""
    if not len(values):
        return
    draw_row_points(axes, values, row, style, theme)
    if len(values) >= MIN_BOX_VALUES:
        _draw_box(axes, values, row, to_plot_color(style.get_color(theme)))
    if len(values) > 1:
        draw_row_median(axes, float(np.median(values)), row, theme)


def _draw_box(axes: Axes, values: FloatArray, row: float, color: PlotColor) -> None:
    """Draw a box between the quartiles of values, with whiskers."""
    low, high = np.percentile(values, [25, 75])
    max_length = _WHISKER_LENGTH * (high - low)
    start = values[values >= low - max_length].min()
    end = values[values <= high + max_length].max()
    line: dict[str, Any] = {"color": color, "linewidth": 1.4, "solid_capstyle": "butt", "zorder": 3}
    axes.plot([start, low], [row, row], **line)
    axes.plot([high, end], [row, row], **line)
    top = row - HALF_BOX_HEIGHT
    bottom = row + HALF_BOX_HEIGHT
    axes.fill(
        [low, high, high, low],
        [top, top, bottom, bottom],
        facecolor=(*color, 0.14),
        edgecolor=color,
        linewidth=1.4,
        zorder=2,
    )
