"""Small SVG drawings in the pages: bars of intervals, and strips of dots."""

import math
from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import NamedTuple

from markupsafe import Markup

from robocov_app.replication.claims.claim import Criterion
from robocov_app.replication.formatting import format_amount

_BAR_WIDTH_PX = 320.0
_BAR_HEIGHT_PX = 44.0
_BAR_EDGE_PX = 14.0
_RANGE_TOP_PX = 4
_RANGE_HEIGHT_PX = 26
_AXIS_Y_PX = 30
_BOUND_BOTTOM_PX = 34
_INTERVAL_Y_PX = 17.0
_LABEL_Y_PX = 43
"""Vertical positions in a bar: the shaded range, its axis, the lines at bounds, the interval, and labels."""
_MIN_LABEL_GAP_PX = 40.0
"""If two bounds are closer than this, their labels are to their left and right instead of centered."""

_STRIP_WIDTH_PX = 440.0
_STRIP_HEIGHT_PX = 40.0
_STRIP_LEFT_PX = 12.0
_STRIP_RIGHT_PX = 16.0
_STRIP_LABEL_PX = 13.0
_STRIP_AXIS_PX = 22.0
_DOT_ROWS = 8
_DOT_ROW_STEP = 5
_MAX_DOT_OFFSET_PX = 7.0
"""Dots with similar values are in different rows of a strip, up to this distance from its middle."""
_MIN_TICK_GAP_PX = 36.0
_TICKS = (0.0, 0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 2.0, 4.0)
"""Ticks of an axis of gaps."""
_MIN_HIGHEST_GAP = 0.01


class _Range(NamedTuple):
    """The lowest and the highest value on the axis of a bar."""

    low: float
    high: float


def draw_interval_bar(criterion: Criterion) -> Markup:
    """Draw a criterion: the required range is shaded, the interval is a line, the estimate a dot.

    Parameters
    ----------
    criterion : Criterion

    Returns
    -------
    Markup
        An SVG element; empty if the estimate or the range is unknown.
    """
    interval = criterion.interval
    known = [*filter(math.isfinite, (interval.estimate, interval.low, interval.high))]
    bounds = [*filter(math.isfinite, (criterion.low, criterion.high))]
    if not known or not bounds:
        return Markup("")
    axis = _find_bar_range([*known, *bounds], criterion.unit)

    def to_x(value: float) -> float:
        fraction = (min(max(value, axis.low), axis.high) - axis.low) / (axis.high - axis.low)
        return round(_BAR_EDGE_PX + fraction * (_BAR_WIDTH_PX - 2 * _BAR_EDGE_PX), 1)

    start = to_x(criterion.low)
    end = to_x(criterion.high)
    parts = [
        f'<rect class="expected" x="{start}" y="{_RANGE_TOP_PX}" width="{round(end - start, 1)}" '
        f'height="{_RANGE_HEIGHT_PX}" rx="3"/>',
        f'<path class="axis" d="M{_BAR_EDGE_PX} {_AXIS_Y_PX}H{_BAR_WIDTH_PX - _BAR_EDGE_PX}"/>',
    ]
    are_labels_close = len(bounds) == 2 and end - start < _MIN_LABEL_GAP_PX
    for value, anchor in zip(bounds, ("end", "start"), strict=False):
        style = f' style="text-anchor: {anchor}"' if are_labels_close else ""
        label = format_amount(value, criterion.unit)
        parts.append(f'<path class="bound" d="M{to_x(value)} {_RANGE_TOP_PX}V{_BOUND_BOTTOM_PX}"/>')
        parts.append(f'<text x="{to_x(value)}" y="{_LABEL_Y_PX}"{style}>{label}</text>')
    state = {True: "yes", False: "no", None: "open"}[criterion.is_met]
    if math.isfinite(interval.low):
        line = f"M{to_x(interval.low)} {_INTERVAL_Y_PX}H{to_x(interval.high)}"
        parts.append(f'<path class="interval {state}" d="{line}"/>')
    x = to_x(interval.estimate)
    parts.append(f'<circle class="estimate {state}" cx="{x}" cy="{_INTERVAL_Y_PX}" r="5.5"/>')
    description = f"{criterion.result_text}; expected: {criterion.range_text}"
    return _build_svg("bar", _BAR_WIDTH_PX, _BAR_HEIGHT_PX, description, parts)


def _find_bar_range(values: Sequence[float], unit: str) -> _Range:
    """Return the range of a bar's axis: all values and a margin, but no negative percentages."""
    low = min(values)
    high = max(values)
    margin = 0.18 * (high - low) if high > low else max(0.1 * abs(high), 0.01)
    min_low = 0.0 if unit == "%" and low >= 0.0 else -math.inf
    return _Range(max(low - margin, min_low), high + margin)


class DotStrip(NamedTuple):
    """A row of dots: the median gap on each map."""

    label: str
    is_ours: bool
    """Whether the controller is one of ours, which are highlighted."""
    medians_by_map: Mapping[str, float]


def draw_strips(strips: Sequence[DotStrip], highest: float) -> Markup:
    """Draw strips of dots below each other, with a dot for each map, on a square-root axis.

    Parameters
    ----------
    strips : sequence of DotStrip
    highest : float
        Highest gap on the axis.

    Returns
    -------
    Markup
        An SVG element; empty if there are no dots.
    """
    strips = [strip for strip in strips if strip.medians_by_map]
    if not strips:
        return Markup("")
    lowest = min(0.0, *(min(strip.medians_by_map.values()) for strip in strips))
    highest = max(highest, _MIN_HIGHEST_GAP)
    start = _compute_signed_root(lowest)
    end = _compute_signed_root(highest)

    def to_x(value: float) -> float:
        fraction = (_compute_signed_root(value) - start) / (end - start)
        width = _STRIP_WIDTH_PX - _STRIP_LEFT_PX - _STRIP_RIGHT_PX
        return round(_STRIP_LEFT_PX + min(max(fraction, 0.0), 1.0) * width, 1)

    parts = _format_ticks(highest, to_x, len(strips))
    ranges = []
    for number, strip in enumerate(strips):
        parts += _format_strip(strip, _STRIP_HEIGHT_PX * number, to_x)
        lowest_text = format_amount(min(strip.medians_by_map.values()), "%")
        highest_text = format_amount(max(strip.medians_by_map.values()), "%")
        ranges.append(f"{escape(strip.label)}: {lowest_text} to {highest_text}")
    maps = max(len(strip.medians_by_map) for strip in strips)
    description = f"Median gap on each of {maps} maps. {'; '.join(ranges)}"
    height = _STRIP_HEIGHT_PX * len(strips) + _STRIP_AXIS_PX
    return _build_svg("strips", _STRIP_WIDTH_PX, height, description, parts)


def _format_ticks(highest: float, to_x: Callable[[float], float], strips: int) -> list[str]:
    """Return the SVG elements of grid lines and labels for a number of strips, without overlaps."""
    height = _STRIP_HEIGHT_PX * strips
    parts = []
    last_x = -math.inf
    for tick in _TICKS:
        x = to_x(tick)
        if tick <= highest and x - last_x >= _MIN_TICK_GAP_PX:
            last_x = x
            label = format_amount(tick, "%")
            parts.append(f'<path class="grid" d="M{x} 0V{height}"/>')
            parts.append(f'<text class="tick" x="{x}" y="{height + _STRIP_AXIS_PX - 6}">{label}</text>')
    return parts


def _format_strip(strip: DotStrip, top: float, to_x: Callable[[float], float]) -> list[str]:
    """Return the SVG elements of a strip: its name, a dot for each map, and a line at the median."""
    kind = "ours" if strip.is_ours else "other"
    middle = top + _STRIP_LABEL_PX + (_STRIP_HEIGHT_PX - _STRIP_LABEL_PX) / 2
    # Leave a little space between the label and the dots.
    label_y = top + _STRIP_LABEL_PX - 2
    parts = [f'<text class="name" x="{_STRIP_LEFT_PX - 4}" y="{label_y}">{escape(strip.label)}</text>']
    ranked = sorted(strip.medians_by_map.items(), key=lambda item: item[1])
    for rank, (name, value) in enumerate(ranked):
        y = round(middle + _compute_dot_offset(rank), 1)
        title = f"<title>{escape(name)}: {format_amount(value, '%')}</title>"
        parts.append(f'<circle class="{kind}" cx="{to_x(value)}" cy="{y}" r="3">{title}</circle>')
    # The mean of the two middle values, which are the same if the number of values is odd.
    median = ranked[(len(ranked) - 1) // 2][1] / 2 + ranked[len(ranked) // 2][1] / 2
    parts.append(f'<path class="middle" d="M{to_x(median)} {middle - 11}V{middle + 11}"/>')
    return parts


def _compute_dot_offset(rank: int) -> float:
    """Return the vertical offset of a dot, px, which keeps dots with neighboring ranks apart.

    There are eight rows of dots. From one rank to the next, the row changes by five, modulo eight.
    """
    row = rank * _DOT_ROW_STEP % _DOT_ROWS
    fraction = row / (_DOT_ROWS - 1)
    return _MAX_DOT_OFFSET_PX * (fraction - 0.5) * 2.0


def _build_svg(kind: str, width: float, height: float, description: str, parts: Sequence[str]) -> Markup:
    """Build an SVG element of a CSS class and a size, px, with a description for screen readers."""
    head = f'<svg class="{kind}" viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{description}">'
    return Markup(f"{head}{''.join(parts)}</svg>")


def _compute_signed_root(value: float) -> float:
    """Return the square root of the absolute value, with the sign of the value."""
    return math.copysign(math.sqrt(abs(value)), value)
