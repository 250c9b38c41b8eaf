"""Curves over time, each labeled at its end with its name and its final value."""

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
    PlotColor,
    ValueAxis,
    get_figure,
    set_even_ticks,
    set_value_limits,
    style_axes,
    to_plot_color,
)
from robocov_app.look.axes import MAX_TIME_INTERVALS
from robocov_app.look.curve_styles import CurveStyle, choose_curve_styles
from robocov_app.look.labels import append_unit, spread_labels
from robocov_app.look.theme import Theme

DISTANCE = "mean distance to the nearest robot (m)"
TIME = "mean time until the first robot arrives (s)"
WEIGHTED_DISTANCE = "mean distance to the nearest robot, weighted by φ (m)"
DISTANCE_AXIS = ValueAxis(DISTANCE, "m")

_MIN_EXPONENT_VALUE = 1e7
"""From this value on, final values may have an exponent."""
_MIN_THOUSANDS_VALUE = 1e4
"""From this value on, units other than meters and percent have thousands separators and no decimals."""
_MIN_SHORT_VALUE = 10.0
"""From this value on, units other than meters have four significant digits instead of three decimals."""
MAX_FILLED_BANDS = 2
"""Maximum number of filled bands. The colors of more could not be told apart where they overlap."""
_FILL_OPACITY = 0.14
_EDGE_OPACITY = 0.6
_EDGE_WIDTH_PT = 0.7
_BARS = 6
"""Number of bars of a band that is not filled."""
_BAR_WIDTH_PT = 1.4
_CAP_PT = 5.0
"""Width of the ends of a bar."""
_LINE_WIDTH_PT = 2.2
_SOLID_ORDER = 2.0
_DASHED_ORDER = 2.1
_MARK_PT = 6.5
_LABEL_LINE_HEIGHT = 1.45
"""Height of a line of labels, in text sizes."""
_CONNECTION_WIDTH_PT = 0.8
"""Width of the line from a curve's last value to its label."""
# Horizontal distances from the axes.
_CONNECTION_START_PT = 2
_CONNECTION_END_PT = 9
_MARK_CENTER_PT = 14
_LABEL_START_PT = 21


class TimeCurve(NamedTuple):
    """A curve over time.

    Attributes
    ----------
    label : str
    controller : str
        Name of the controller, which decides the color.
    times : (T,) array, s
    values : (T,) array
        nan if a value is missing.
    """

    label: str
    controller: str
    times: FloatArray
    values: FloatArray


class StyledCurve(NamedTuple):
    """A curve with its style, and a band around it.

    Attributes
    ----------
    curve : TimeCurve
    style : CurveStyle
    band : ((T,) array, (T,) array), optional
        Lower and upper edge of the band.
    """

    curve: TimeCurve
    style: CurveStyle
    band: tuple[FloatArray, FloatArray] | None = None


class CurveMargins(NamedTuple):
    """Space between the edges of a box and the axes of curves in it, px at scale 1.

    Attributes
    ----------
    left : float
        For the labels of the ticks.
    top : float
        For the label of the value axis, and titles above it.
    bottom : float
        For the labels of the ticks and of the time axis.
    right : float
        In addition to the width of the labels at the ends of the curves.
    max_right_fraction : float
        Maximum width to the right of the axes, labels included, as a fraction of the width of the box.
    """

    left: float
    top: float
    bottom: float
    right: float
    max_right_fraction: float = 0.45


class _CurveEnd(NamedTuple):
    """The last known value of a curve, and its label.

    Attributes
    ----------
    time : float, s
    value : float
    color : PlotColor
    mark : str
        Marker of matplotlib.
    text : str
    """

    time: float
    value: float
    color: PlotColor
    mark: str
    text: str


def format_end_label(curve: TimeCurve, unit: str = "m") -> str:
    """Return the label of a curve with its last finite value, if it has one.

    Parameters
    ----------
    curve : TimeCurve
    unit : str
        Meters have three decimals, and percentages have one. In other units, values below 10 have three
        decimals, and larger ones have four significant digits or are whole numbers. Values from 10 million
        have an exponent in any unit.

    Returns
    -------
    str
    """
    finite_values = curve.values[np.isfinite(curve.values)]
    if not len(finite_values):
        return curve.label
    value = append_unit(_format_end_value(float(finite_values[-1]), unit), unit)
    return f"{curve.label}  {value}"


def _format_end_value(value: float, unit: str) -> str:
    """Return the last value of a curve as text, without its unit; see `format_end_label`."""
    if abs(value) >= _MIN_EXPONENT_VALUE:
        return f"{value:.4g}"
    # The option z writes values that round to zero without a minus sign.
    if unit == "%":
        return f"{value:z.1f}"
    if unit == "m" or abs(value) < _MIN_SHORT_VALUE:
        return f"{value:z.3f}"
    # Rounding to four digits may reach the limit, from which on they would have an exponent.
    if float(f"{abs(value):.4g}") < _MIN_THOUSANDS_VALUE:
        return f"{value:.4g}"
    return f"{value:,.0f}"


def add_curve_axes(
    page: FigurePage,
    curves: Sequence[TimeCurve],
    margins: CurveMargins,
    *,
    box: PageBox | None = None,
    unit: str = "m",
    label_width: float | None = None,
) -> Axes:
    """Add axes for curves to a page, with space for the labels at their ends.

    Parameters
    ----------
    page : FigurePage
    curves : sequence of TimeCurve
        At least one.
    margins : CurveMargins
    box : PageBox, optional
        Area of the page for the axes and all their labels; by default the whole page.
    unit : str
        Unit of the values at the ends, as for `draw_curves`.
    label_width : float, optional
        Width of the space for the labels, px; by default that of the widest label.

    Returns
    -------
    matplotlib.axes.Axes
    """
    if box is None:
        page_width, page_height = page.size
        box = PageBox(0.0, 0.0, page_width, page_height)
    scale = page.scale
    left = margins.left * scale
    top = margins.top * scale
    bottom = margins.bottom * scale
    right = compute_right_margin(page, curves, margins, box.width, unit=unit, label_width=label_width)
    width = box.width - left - right
    height = box.height - top - bottom
    return page.add_axes(PageBox(box.left + left, box.top + top, width, height))


def compute_right_margin(
    page: FigurePage,
    curves: Sequence[TimeCurve],
    margins: CurveMargins,
    box_width: float,
    *,
    unit: str = "m",
    label_width: float | None = None,
) -> float:
    """Return the width of the space to the right of the axes of curves in a box, px; see `add_curve_axes`."""
    if label_width is None:
        label_width = measure_end_labels(page, curves, unit)
    return min(margins.right * page.scale + label_width, margins.max_right_fraction * box_width)


def measure_end_labels(page: FigurePage, curves: Sequence[TimeCurve], unit: str = "m") -> float:
    """Return the width of the widest label at the end of a curve, px."""
    return max(page.measure_text(format_end_label(curve, unit), bold=True) for curve in curves)


def draw_curves(
    axes: Axes,
    curves: Sequence[TimeCurve],
    theme: Theme,
    value_axis: ValueAxis = DISTANCE_AXIS,
    *,
    weight: float = 1.0,
) -> None:
    """Draw curves in the styles of their controllers; see `draw_styled_curves`."""
    styles = choose_curve_styles([curve.controller for curve in curves])
    styled_curves = [StyledCurve(curve, style) for curve, style in zip(curves, styles, strict=True)]
    draw_styled_curves(axes, styled_curves, theme, value_axis, weight=weight)


def draw_styled_curves(
    axes: Axes,
    styled_curves: Sequence[StyledCurve],
    theme: Theme,
    value_axis: ValueAxis,
    *,
    weight: float = 1.0,
) -> None:
    """Draw curves, each with its mark, name and final value next to its end.

    Solid curves are below dashed ones, so that equal curves can be seen. At most `MAX_FILLED_BANDS` bands are
    filled; more are drawn as bars at different times. Curves without a finite value are left out.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    styled_curves : sequence of StyledCurve
    theme : Theme
    value_axis : ValueAxis
    weight : float
        Factor by which line widths and marks are multiplied.
    """
    _set_axes(axes, styled_curves, value_axis)
    style_axes(axes, theme, "time (s)", value_axis.label, grid="y")
    _draw_bands(axes, [item for item in styled_curves if item.band is not None], theme, weight)
    ends = []
    for item in styled_curves:
        if not np.isfinite(item.curve.values).any():
            continue
        color = to_plot_color(item.style.get_color(theme))
        _draw_line(axes, item, color, weight)
        ends.append(_build_end(item, color, value_axis.unit))
    if ends:
        _draw_end_labels(axes, ends, weight)


def _draw_bands(axes: Axes, items: Sequence[StyledCurve], theme: Theme, weight: float) -> None:
    """Draw the bands of curves: filled if there are few, otherwise as bars, which do not hide each other."""
    for number, item in enumerate(items):
        color = to_plot_color(item.style.get_color(theme))
        if len(items) <= MAX_FILLED_BANDS:
            _fill_band(axes, item, color)
        else:
            _draw_bars(axes, item, color, weight, phase=(number + 0.5) / len(items))


def _fill_band(axes: Axes, item: StyledCurve, color: PlotColor) -> None:
    """Fill the band of a curve, and draw its edges as thin lines."""
    assert item.band is not None
    low, high = item.band
    axes.fill_between(item.curve.times, low, high, color=color, alpha=_FILL_OPACITY, linewidth=0.0)
    for edge in item.band:
        axes.plot(item.curve.times, edge, color=color, linewidth=_EDGE_WIDTH_PT, alpha=_EDGE_OPACITY)


def _draw_bars(axes: Axes, item: StyledCurve, color: PlotColor, weight: float, *, phase: float) -> None:
    """Draw a band as vertical bars at even intervals.

    `phase`, from 0 to 1, is the position of the first bar in the first interval. It differs between curves,
    so that their bars are next to each other.
    """
    assert item.band is not None
    times = item.curve.times
    is_known = np.isfinite(item.curve.values)
    if not is_known.any():
        return
    start = float(times[is_known][0])
    duration = float(times[is_known][-1]) - start
    bar_times = start + duration * (np.arange(_BARS) + phase) / _BARS
    low, high = (np.interp(bar_times, times[is_known], edge[is_known]) for edge in item.band)
    width = weight * _BAR_WIDTH_PT
    axes.vlines(bar_times, low, high, colors=[color], linewidth=width, zorder=_DASHED_ORDER)
    for ends in (low, high):
        axes.plot(
            bar_times,
            ends,
            "_",
            color=color,
            markersize=weight * _CAP_PT,
            markeredgewidth=width,
            zorder=_DASHED_ORDER,
        )


def _build_end(item: StyledCurve, color: PlotColor, unit: str) -> _CurveEnd:
    """Return the last finite value of a curve, with its label."""
    curve = item.curve
    last = int(np.flatnonzero(np.isfinite(curve.values))[-1])
    return _CurveEnd(
        time=float(curve.times[last]),
        value=float(curve.values[last]),
        color=color,
        mark=item.style.mark,
        text=format_end_label(curve, unit),
    )


def _set_axes(axes: Axes, styled_curves: Sequence[StyledCurve], value_axis: ValueAxis) -> None:
    """Set the limits and ticks of axes for curves and their bands."""
    times = np.concatenate([item.curve.times for item in styled_curves])
    lines = [item.curve.values for item in styled_curves]
    for item in styled_curves:
        if item.band is not None:
            lines += item.band
    start = float(times.min())
    # Limits must differ, even if there is a single time.
    axes.set_xlim(start, max(float(times.max()), start + 1e-9))
    set_even_ticks(axes.xaxis, MAX_TIME_INTERVALS)
    values = np.concatenate([line[np.isfinite(line)] for line in lines])
    set_value_limits(axes.yaxis, values, value_axis)


def _draw_line(axes: Axes, item: StyledCurve, color: PlotColor, weight: float) -> None:
    """Draw the line of a curve; dashed lines are above solid ones, which are visible in their gaps."""
    dash_lengths = item.style.list_dash_lengths()
    axes.plot(
        item.curve.times,
        item.curve.values,
        color=color,
        linewidth=weight * _LINE_WIDTH_PT,
        linestyle=item.style.dashes,
        dash_capstyle="butt",
        zorder=_DASHED_ORDER if dash_lengths else _SOLID_ORDER,
    )


def _draw_end_labels(axes: Axes, ends: Sequence[_CurveEnd], weight: float) -> None:
    """Draw mark and label of each curve to the right of the axes, with a line at the height of its end."""
    dpi = get_figure(axes).dpi
    box = axes.get_window_extent()
    # One point as a fraction of the width of the axes.
    point_fraction = dpi / POINTS_PER_INCH / box.width
    line_height = _LABEL_LINE_HEIGHT * TEXT_SIZE_PT * dpi / POINTS_PER_INCH
    # Heights on the page, px.
    end_points: FloatArray = axes.transData.transform([(end.time, end.value) for end in ends])
    end_heights: list[float] = end_points[:, 1].tolist()
    label_heights = spread_labels(end_heights, line_height, float(box.y0), float(box.y1))
    for end, end_height, label_height in zip(ends, end_heights, label_heights, strict=True):
        label_fraction = (label_height - box.y0) / box.height
        axes.text(
            1.0 + _LABEL_START_PT * point_fraction,
            label_fraction,
            end.text,
            color=end.color,
            transform=axes.transAxes,
            va="center",
            ha="left",
            fontsize=TEXT_SIZE_PT,
            fontweight="bold",
        )
        axes.plot(
            [1.0 + _CONNECTION_START_PT * point_fraction, 1.0 + _CONNECTION_END_PT * point_fraction],
            [(end_height - box.y0) / box.height, label_fraction],
            transform=axes.transAxes,
            color=end.color,
            linewidth=_CONNECTION_WIDTH_PT,
            clip_on=False,
        )
        axes.plot(
            1.0 + _MARK_CENTER_PT * point_fraction,
            label_fraction,
            end.mark,
            transform=axes.transAxes,
            color=end.color,
            markersize=weight * _MARK_PT,
            clip_on=False,
        )
