"""Plots of results against a gain, and over grids of two gains."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedLocator, Locator, LogLocator, MaxNLocator, NullLocator

from robocov.controllers.gains import Value, format_value
from robocov.typing import FloatArray
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import (
    SMALL_SIZE_PT,
    FigurePage,
    PageBox,
    ValueAxis,
    get_figure,
    set_value_limits,
    style_axes,
    to_plot_color,
)
from robocov_app.look.curve_styles import CurveStyle
from robocov_app.look.labels import shorten_text
from robocov_app.look.theme import LIGHT, Theme

MAX_LEVELS = 15
"""Maximum number of gain values with a median each; above this, gains are treated as continuous."""
MAX_NAME_CHARS = 28
"""Maximum length of a name on an axis or in a legend."""
MAX_DRAWN_RUNS = 600
"""Approximate maximum number of points drawn for a controller."""
_MIN_LOG_RATIO = 8.0
"""Minimum ratio of the highest value to the lowest for a logarithmic axis."""
_MAX_LEVEL_TICKS = 8
"""Maximum number of gain values with a tick each."""
_MARGIN_FRACTION = 0.07
_CELL_SIZE = 0.96
"""Width and height of a drawn cell; the rest of its square is a thin line in the background color."""
_MAX_DECIMALS = 4


class GainResults(NamedTuple):
    """Results of the runs of one controller against a gain.

    Attributes
    ----------
    label : str
    style : CurveStyle
    gains : (m,) array
        Values of the gain; nan stands for no limit. For a text-valued gain, indices of its values.
    values : (m,) array
    """

    label: str
    style: CurveStyle
    gains: FloatArray
    values: FloatArray


@dataclass(frozen=True)
class GainGrid:
    """Results over a grid of two gains.

    Attributes
    ----------
    column_label, row_label : str
        Names of the gains.
    columns, rows : sequence of Value
        Values of the gains, in ascending order; None for no limit.
    values : (rows, columns) array
        nan if the combination was not tried.
    """

    column_label: str
    row_label: str
    columns: Sequence[Value]
    rows: Sequence[Value]
    values: FloatArray


@plain_style()
def plot_gains(
    all_results: Sequence[GainResults],
    gain: str,
    size: tuple[int, int],
    label: str,
    choices: Sequence[str] = (),
) -> Figure:
    """Plot the results of runs against a gain, as points, with the median at each gain.

    Parameters
    ----------
    all_results : sequence of GainResults
    gain : str
        Name of the gain.
    size : (width, height), px
    label : str
        Label of the value axis.
    choices : sequence of str
        Possible values of a text-valued gain; empty for a numeric one. For a numeric gain, a line connects
        the medians, the axis is logarithmic if its range is wide, and "no limit" is at its right end.

    Returns
    -------
    matplotlib.figure.Figure
    """
    axes = _create_axes(size)
    if choices:
        unlimited_position = None
        axes.set_xlim(-0.5, len(choices) - 0.5)
        axes.set_xticks(range(len(choices)), list(choices))
    else:
        gains = np.concatenate([results.gains for results in all_results])
        unlimited_position = _set_number_axis(axes, gains)
    for results in all_results:
        positions = results.gains
        if unlimited_position is not None:
            positions = np.where(np.isnan(positions), unlimited_position, positions)
        _draw_results(axes, results, positions, is_joined=not choices)
    values = np.concatenate([results.values for results in all_results])
    set_value_limits(axes.yaxis, values, ValueAxis(label))
    style_axes(axes, LIGHT, _shorten_name(gain), label, grid="y")
    if len(all_results) > 1:
        axes.legend(
            frameon=False, fontsize=SMALL_SIZE_PT, labelcolor=to_plot_color(LIGHT.ink), borderaxespad=0.2
        )
    return get_figure(axes)


@plain_style()
def plot_gain_grid(grid: GainGrid, size: tuple[int, int]) -> Figure:
    """Plot a grid of two gains on a separate page. See `draw_gain_grid`."""
    axes = _create_axes(size)
    draw_gain_grid(axes, grid, LIGHT)
    return get_figure(axes)


@plain_style()
def draw_gain_grid(axes: Axes, grid: GainGrid, theme: Theme) -> None:
    """Draw results over two gains as a heat map with their values, the lowest one in bold.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    grid : GainGrid
    theme : Theme
    """
    low = float(np.nanmin(grid.values))
    high = float(np.nanmax(grid.values))
    colors = theme.muted_heat
    decimals = _choose_decimals(low, high)
    for row, column in np.argwhere(np.isfinite(grid.values)).tolist():
        value = grid.values[row, column]
        fraction = (value - low) / (high - low) if high > low else 0.0
        color = to_plot_color(colors[round(fraction * (len(colors) - 1))])
        corner = (column - 0.5 * _CELL_SIZE, row - 0.5 * _CELL_SIZE)
        axes.add_patch(Rectangle(corner, _CELL_SIZE, _CELL_SIZE, facecolor=color, linewidth=0.0))
        axes.text(
            column,
            row,
            f"{value:.{decimals}f}",
            ha="center",
            va="center",
            fontsize=SMALL_SIZE_PT,
            color=to_plot_color(theme.ink),
            fontweight="bold" if value == low else "normal",
        )
    axes.set(xlim=(-0.5, len(grid.columns) - 0.5), ylim=(-0.5, len(grid.rows) - 0.5))
    axes.set_xticks(range(len(grid.columns)), [format_value(value, digits=4) for value in grid.columns])
    axes.set_yticks(range(len(grid.rows)), [format_value(value, digits=4) for value in grid.rows])
    style_axes(axes, theme, _shorten_name(grid.column_label), _shorten_name(grid.row_label))
    axes.tick_params(length=0.0)


def _choose_decimals(low: float, high: float) -> int:
    """Return the number of decimals that shows three digits of the highest value and tenths of the range."""
    sizes = [size for size in (high, 10.0 * (high - low)) if size]
    if not sizes:
        return 2
    decimals = [2 - math.floor(math.log10(abs(size))) for size in sizes]
    return min(max(0, *decimals), _MAX_DECIMALS)


def _create_axes(size: tuple[int, int]) -> Axes:
    """Create axes that fill a page, except for margins for labels."""
    width, height = size
    return FigurePage(size, LIGHT, 1.0).add_axes(PageBox(52, 34, width - 70, height - 84))


def _shorten_name(name: str) -> str:
    """Shorten a name so that it fits on an axis or in a legend."""
    return shorten_text(name, len, MAX_NAME_CHARS)


def _set_number_axis(axes: Axes, gains: FloatArray) -> float | None:
    """Set the scale, limits and ticks of the horizontal axis for a gain that is a number.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    gains : (m,) array
        Values of the gain; nan stands for no limit.

    Returns
    -------
    float or None
        Position on the axis for "no limit"; None if all gains are limited.
    """
    levels = np.unique(gains[np.isfinite(gains)])
    low = 0.0
    high = 0.0
    if len(levels):
        low = float(levels[0])
        high = float(levels[-1])
    has_unlimited = bool(np.isnan(gains).any())
    is_logarithmic = len(levels) > 1 and low > 0 and high / low >= _MIN_LOG_RATIO
    if is_logarithmic:
        end = _set_logarithmic_limits(axes, low, high, has_unlimited=has_unlimited)
    else:
        end = _set_linear_limits(axes, low, high, has_unlimited=has_unlimited)
    ticks: list[float] = levels.tolist()
    if len(levels) > _MAX_LEVEL_TICKS:
        locator: Locator = MaxNLocator(6, steps=[1, 2, 5, 10])
        if is_logarithmic:
            locator = LogLocator(subs=(1.0, 3.0))
        ticks = [float(value) for value in locator.tick_values(low, high) if low <= value <= high]
    labels = [format_value(value, digits=4) for value in ticks]
    if has_unlimited:
        ticks.append(end)
        labels.append("no limit")
    axes.xaxis.set_major_locator(FixedLocator(ticks))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticklabels(labels)
    if not has_unlimited:
        return None
    return end


def _set_logarithmic_limits(axes: Axes, low: float, high: float, *, has_unlimited: bool) -> float:
    """Set the limits of a logarithmic axis; return the position of "no limit", or `high` if it has none."""
    axes.set_xscale("log")
    margin = (high / low) ** _MARGIN_FRACTION
    end = high
    if has_unlimited:
        end *= margin**3
    axes.set_xlim(low / margin, end * margin)
    return end


def _set_linear_limits(axes: Axes, low: float, high: float, *, has_unlimited: bool) -> float:
    """Set the limits of a linear axis; return the position of "no limit", or `high` if it has none."""
    if high > low:
        margin = _MARGIN_FRACTION * (high - low)
    else:
        margin = 0.5 * max(abs(high), 1.0)
    end = high
    if has_unlimited:
        end += 3 * margin
    axes.set_xlim(low - margin, end + margin)
    return end


def _draw_results(axes: Axes, results: GainResults, positions: FloatArray, *, is_joined: bool) -> None:
    """Draw the runs of a controller as points, and the median at each position if there are few positions.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    results : GainResults
    positions : (m,) array
        Positions of the gains on the axis.
    is_joined : bool
        Whether a line connects the medians.
    """
    style = results.style
    label = _shorten_name(results.label)
    color = to_plot_color(style.get_color(LIGHT))
    # Only every step-th run is drawn.
    step = math.ceil(len(positions) / MAX_DRAWN_RUNS)
    points: dict[str, Any] = {"color": color, "markeredgewidth": 0.0, "linestyle": "none"}
    axes.plot(positions[::step], results.values[::step], style.mark, markersize=3.6, alpha=0.5, **points)
    levels = np.unique(positions)
    if len(levels) > MAX_LEVELS:
        # An empty plot adds the entry in the legend.
        axes.plot([], [], style.mark, markersize=5.0, label=label, **points)
        return
    medians = np.array([np.median(results.values[positions == level]) for level in levels])
    axes.plot(
        levels,
        medians,
        marker=style.mark,
        markersize=6.5,
        color=color,
        linestyle=style.dashes if is_joined else "none",
        linewidth=2.0,
        label=label,
    )
