"""Limits and ticks of the axes of curves.

The same rule applies in windows, figures and replays. A value axis starts at zero if the curves then still
use 60% of its height: proportions can be read off, and little space is lost. Otherwise it starts just below
the lowest value, since controllers often differ by only a few percent.
"""

import math
from typing import NamedTuple

import numpy as np

from robocov.typing import FloatArray
from robocov_app.look.lengths import round_down

MAX_LOW_FRACTION = 0.4
"""An axis starts at zero if the lowest value is below this fraction of the highest."""
VALUE_MARGIN = 0.08
"""Free space above and below the values, as a fraction of their range."""
GROWTH_FRACTION = 0.5
"""Space for lower values on the axis of a curve that is still growing, as a fraction of its range."""
MIN_SPAN_FRACTION = 0.25
"""Minimum length of the axis of a curve that is still growing, as a fraction of its highest value."""
TICK_FACTORS = (1, 2, 5, 10)
"""Steps between ticks are one of these times a power of ten."""
MAX_VALUE_INTERVALS = 6
"""Maximum number of intervals between the ticks of a value axis."""
MAX_TIME_INTERVALS = 8
"""Maximum number of intervals between the ticks of a time axis."""
MIN_TIME_LIMIT_S = 10.0
"""A growing time axis shows at least this many seconds."""
_FREE_TIME_FRACTION = 0.03
"""Free space after the present on a growing time axis, as a fraction of the time so far."""
_MIN_TIME_LIMIT_FRACTION = 0.96
"""Fraction of `MIN_TIME_LIMIT_S` up to which a growing time axis has this length."""
_EARLY_TIME_S = 40.0
_EARLY_INTERVALS = 4.0
"""Before `_EARLY_TIME_S`, the step of a growing time axis is half of a round quarter of the time so far."""
_LATE_INTERVALS = 5.0
"""From `_EARLY_TIME_S` on, the step is a round fifth of the time so far."""
_TIME_TOLERANCE_S = 1e-9
_MIN_TIME_STEP_S = 5.0
"""A growing time axis ends at a multiple of at least this step."""
_MIN_VALUE = 1e-3
"""If all values are equal, the axis is chosen as if their absolute value were at least this."""


class Axis(NamedTuple):
    """Limits of an axis, and the step between its ticks."""

    start: float
    end: float
    step: float

    @property
    def ticks(self) -> FloatArray:
        """Multiples of the step within the limits."""
        return list_ticks(self.start, self.end, self.step)


def choose_value_limits(
    low: float, high: float, *, margin: float = VALUE_MARGIN, origin: float = 0.0
) -> tuple[float, float]:
    """Choose the limits of a value axis.

    Parameters
    ----------
    low, high : float
        Minimum and maximum value, finite.
    margin : float
        Free space on both sides as a fraction of the range. If both values are equal, it is a tenth of them.
    origin : float
        Value that proportions refer to: 0 for distances, 1 for ratios.

    Returns
    -------
    start, end : float

    Examples
    --------
    >>> choose_value_limits(2.0, 6.0)
    (0.0, 6.32)
    >>> choose_value_limits(5.0, 6.0)
    (4.92, 6.08)
    """
    if high > low:
        space = margin * (high - low)
    else:
        space = 0.1 * max(abs(high), _MIN_VALUE)
    is_near_origin = 0.0 <= low - origin < MAX_LOW_FRACTION * (high - origin)
    start = origin if is_near_origin else low - space
    return start, high + space


def choose_tick_step(span: float, max_intervals: float) -> float:
    """Choose the smallest round step that divides a span into at most a number of intervals.

    Parameters
    ----------
    span : float
        Length of the axis, positive.
    max_intervals : float
        Maximum number of intervals.

    Returns
    -------
    float
        1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> [choose_tick_step(span, 6) for span in (0.5, 6.0, 60.0, 70.0)]
    [0.1, 1.0, 10.0, 20.0]
    """
    min_step = span / max(max_intervals, 1.0)
    power = 10.0 ** math.floor(math.log10(min_step))
    # Accept steps that are too small only by a rounding error.
    step = next(factor * power for factor in TICK_FACTORS if factor * power >= 0.999 * min_step)
    return float(f"{step:.12g}")


def list_ticks(start: float, end: float, step: float) -> FloatArray:
    """Return the multiples of a step from `start` to `end`, both included."""
    first = math.ceil(start / step - 1e-9)
    last = math.floor(end / step + 1e-9)
    return np.asarray(step * np.arange(first, last + 1))


def choose_growing_value_axis(low: float, high: float, max_intervals: float) -> Axis:
    """Choose the value axis of curves that grow while the user watches them.

    Costs fall at first, so the axis has space for lower values, and a minimum length. It starts at a
    multiple of the step, so that it rarely changes.

    Parameters
    ----------
    low, high : float
        Minimum and maximum value so far; nan without values.
    max_intervals : float
        Maximum number of intervals between ticks.

    Returns
    -------
    Axis

    Examples
    --------
    >>> choose_growing_value_axis(0.9, 3.2, 4)
    Axis(start=0.0, end=3.384, step=1.0)
    """
    if not math.isfinite(low) or not math.isfinite(high) or high <= 0.0:
        return Axis(0.0, 1.0, 0.5)
    start, end = choose_value_limits(low, high)
    if start > 0.0:
        start -= GROWTH_FRACTION * (high - low)
        # Otherwise, the first small changes would fill the whole height, and then shrink with every sample.
        start = min(start, (1.0 - MIN_SPAN_FRACTION) * high)
        end = max(end, high + VALUE_MARGIN * (high - start))
    start = max(start, 0.0)
    step = choose_tick_step(end - start, max_intervals)
    start = float(f"{step * math.floor(start / step):.12g}")
    # Rounding must not cut off the highest value of a short axis.
    end = max(float(f"{end:.6g}"), high)
    return Axis(start, end, step)


def choose_growing_time_limit(end_s: float) -> float:
    """Choose the end of the time axis of a running simulation, which has reached the time `end_s`.

    It is a round time a little after the present, so that the axis rarely changes.

    Examples
    --------
    >>> [choose_growing_time_limit(t) for t in (0.0, 9.0, 9.9, 61.0)]
    [10.0, 10.0, 15.0, 70.0]
    """
    if end_s <= _MIN_TIME_LIMIT_FRACTION * MIN_TIME_LIMIT_S:
        return MIN_TIME_LIMIT_S
    # The end is a multiple of a round step of about an eighth of the time so far, then of a fifth.
    if end_s < _EARLY_TIME_S:
        step = round_down(max(end_s / _EARLY_INTERVALS, 1.0)) / 2.0
    else:
        step = round_down(end_s / _LATE_INTERVALS)
    step = max(step, _MIN_TIME_STEP_S)
    min_limit = end_s * (1.0 + _FREE_TIME_FRACTION)
    return float(math.ceil((min_limit + _TIME_TOLERANCE_S) / step) * step)
