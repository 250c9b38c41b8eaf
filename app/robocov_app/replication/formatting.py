"""Numbers, intervals and medians as text."""

import math

import numpy as np

from robocov.typing import FloatArray
from robocov_app.figures.statistics import Interval

NO_VALUE = "–"


def format_amount(value: float, unit: str = "") -> str:
    """Format a number with its unit.

    It has about three significant digits. Percentages have at most one decimal place, and ratios from 1 to
    1.1 have three.

    Parameters
    ----------
    value : float
    unit : str
        For "%", a value of 0.5 is written as 50%.

    Examples
    --------
    >>> format_amount(0.0512, "%"), format_amount(0.643), format_amount(1.0042)
    ('5.1%', '0.643', '1.004')
    >>> format_amount(1.5, "m"), format_amount(6420.9, "J")
    ('1.5 m', '6,421 J')
    >>> format_amount(-0.012, "%"), format_amount(-0.0001, "%")
    ('−1.2%', '0%')
    """
    if not math.isfinite(value):
        return NO_VALUE
    if value < 0.0:
        text = format_amount(-value, unit)
        return text if text == "0%" else f"−{text}"
    if unit == "%":
        percent = 100.0 * value
        has_decimal = percent < 99.95 and round(percent, 1) != round(percent)
        return f"{percent:.1f}%" if has_decimal else f"{percent:.0f}%"
    if not unit and 1.0 < value < 1.1:
        # Ratios near 1 differ in their third decimal place.
        text = f"{value:.3f}"
    elif value < 999.5:
        text = f"{value:.3g}"
    else:
        text = f"{value:,.0f}"
    return f"{text} {unit}".rstrip()


def format_interval(interval: Interval, unit: str = "") -> str:
    """Format an estimate with its interval, for example "5.2% (3.1% to 8%)"."""
    estimate = format_amount(interval.estimate, unit)
    if math.isnan(interval.low):
        return estimate
    return f"{estimate} ({format_amount(interval.low, unit)} to {format_amount(interval.high, unit)})"


def format_median(values: FloatArray, unit: str = "") -> str:
    """Format the median of values, (m,), with its unit; a dash without values."""
    if not len(values):
        return NO_VALUE
    return format_amount(float(np.median(values)), unit)


def capitalize(text: str) -> str:
    """Capitalize the first letter of a text; unlike `str.capitalize`, leave the rest unchanged."""
    return text[:1].upper() + text[1:]
