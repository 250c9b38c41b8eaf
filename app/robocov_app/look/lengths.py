"""Round lengths for scale bars and grids, and their labels."""

from __future__ import annotations

import math

_METERS_PER_KILOMETER = 1000
_MIN_METERS = 0.1
"""Length below which labels are in centimeters, m."""


def round_down(number: float) -> float:
    """Round a positive number down to 1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> [round_down(number) for number in (0.7, 1.0, 3.9, 49.0)]
    [0.5, 1.0, 2.0, 20.0]
    """
    power = 10.0 ** math.floor(math.log10(number) + 1e-12)
    factor = max(factor for factor in (1.0, 2.0, 5.0) if factor * power <= number * (1 + 1e-9))
    return float(f"{factor * power:.12g}")


def round_up(number: float) -> float:
    """Round a positive number up to 1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> [round_up(number) for number in (0.7, 1.0, 3.9, 49.0)]
    [1.0, 1.0, 5.0, 50.0]
    """
    lower = round_down(number)
    if lower >= number:
        return lower
    # Steps grow by a factor of 2 or 2.5, so the result is the next step after the lower one.
    return round_down(2.5001 * lower)


def format_scale_length(meters: float) -> str:
    """Format a length for a scale bar, in centimeters, meters or kilometers.

    Examples
    --------
    >>> [format_scale_length(meters) for meters in (0.05, 2.0, 5000.0)]
    ['5 cm', '2 m', '5 km']
    """
    if meters >= _METERS_PER_KILOMETER:
        return f"{meters / _METERS_PER_KILOMETER:g} km"
    if meters < _MIN_METERS:
        return f"{meters * 100:g} cm"
    return f"{meters:g} m"
