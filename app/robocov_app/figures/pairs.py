"""Plots of the ratios of pairs of runs, on a logarithmic axis."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from robocov.typing import FloatArray
from robocov_app.figures.dot_rows import (
    arrange_rows,
    create_row_axes,
    draw_row_median,
    draw_row_points,
    label_rows,
)
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import get_figure, to_plot_color
from robocov_app.figures.statistics import Interval
from robocov_app.look.curve_styles import CurveStyle
from robocov_app.look.theme import LIGHT, Theme

_MAX_INTERVAL_FACTOR = 1.5
"""Maximum factor by which an axis is extended beyond the ratios to show the ends of intervals."""
_TICKS = (
    *(0.01, 0.02, 0.05),
    *(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9),
    *(1.0, 1.1, 1.25, 1.5, 2.0, 3.0, 5.0),
    *(1e1, 1e2, 1e3, 1e4, 1e5, 1e6),
)
"""Ratios at which there may be a tick."""
_MAX_TICK_INTERVALS = 7


class Pairs(NamedTuple):
    """Ratios of two controllers over pairs of runs.

    Attributes
    ----------
    label : str
    style : CurveStyle
    ratios : (m,) array
        Above 0.
    interval : Interval
        The typical ratio with its 95% interval.
    """

    label: str
    style: CurveStyle
    ratios: FloatArray
    interval: Interval


@plain_style()
def plot_pairs(
    pairs: Sequence[Pairs], label: str, *, width: int, scale: float, theme: Theme = LIGHT
) -> Figure:
    """Plot all ratios in one row per comparison, and the typical ratio with its 95% interval.

    Parameters
    ----------
    pairs : sequence of Pairs
    label : str
        Label of the axis of ratios.
    width : int, px
        Width of the page; its height depends on the number of rows.
    scale : float
        Scale of texts and lines.
    theme : Theme

    Returns
    -------
    matplotlib.figure.Figure
    """
    positions = arrange_rows([("", len(pairs))])
    names = [row_pairs.label for row_pairs in pairs]
    axes, short_names = create_row_axes(positions.total, names, theme, width=width, scale=scale)
    for row_pairs, row in zip(pairs, positions.rows, strict=True):
        draw_row_points(axes, np.sort(row_pairs.ratios), row, row_pairs.style, theme)
        _draw_interval(axes, row_pairs.interval, row, theme)
        draw_row_median(axes, row_pairs.interval.estimate, row, theme)
    label_rows(axes, positions.rows, short_names, theme, label)
    set_ratio_axis(axes, _list_axis_values(pairs), theme)
    return get_figure(axes)


def _draw_interval(axes: Axes, interval: Interval, row: float, theme: Theme) -> None:
    """Draw an interval as a horizontal line, if there is one."""
    if np.isfinite(interval.low):
        axes.plot(
            [interval.low, interval.high],
            [row, row],
            color=to_plot_color(theme.ink),
            linewidth=2.4,
            solid_capstyle="butt",
            zorder=4,
        )


def _list_axis_values(pairs: Sequence[Pairs]) -> FloatArray:
    """Return the values that an axis must show: all ratios, and the ends of intervals.

    An interval from two or three values may be extremely wide, so its ends are limited.
    """
    ratios = np.concatenate([row_pairs.ratios for row_pairs in pairs])
    ends = np.array([(row_pairs.interval.low, row_pairs.interval.high) for row_pairs in pairs]).ravel()
    finite_ends = ends[np.isfinite(ends)]
    low = ratios.min() / _MAX_INTERVAL_FACTOR
    high = ratios.max() * _MAX_INTERVAL_FACTOR
    return np.concatenate([ratios, np.clip(finite_ends, low, high)])


def set_ratio_axis(axes: Axes, ratios: FloatArray, theme: Theme) -> None:
    """Make the horizontal axis logarithmic, with limits and ticks for ratios, and draw a line at 1."""
    low = min(float(ratios.min()), 0.95)
    high = max(float(ratios.max()), 1.05)
    margin = (high / low) ** 0.05
    min_x = low / margin
    max_x = high * margin
    axes.set(xscale="log", xlim=(min_x, max_x))
    ticks = [tick for tick in _TICKS if min_x <= tick <= max_x]
    min_distance = np.log(high / low) / _MAX_TICK_INTERVALS
    axes.xaxis.set_major_locator(FixedLocator(_space_ticks(ticks, min_distance)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter("{x:g}")
    axes.axvline(1.0, color=to_plot_color(theme.ink), linewidth=1.0, zorder=2)


def _space_ticks(ticks: Sequence[float], min_distance: float) -> list[float]:
    """Select ticks whose logarithms are far enough apart: 1, then the others from the nearest to 1."""
    spaced = [1.0]
    for tick in sorted(ticks, key=lambda tick: abs(np.log(tick))):
        distances = [abs(np.log(tick / other)) for other in spaced]
        if min(distances) >= min_distance:
            spaced.append(tick)
    return sorted(spaced)
