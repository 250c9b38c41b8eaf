"""Lengths, forces, speeds and directions as text."""

import math

MIN_FORCE_N = 5e-4
"""Smaller forces are written as 0 N and are drawn without an arrow."""

_MAX_NUMBER = 1e6
# From these values on, a number is written with no, one or two decimals. They are not powers of ten, because
# rounding would add a digit to a smaller number: 9.95 is written as 10, and 0.995 as 1.0.
_NO_DECIMALS = 9.95
_ONE_DECIMAL = 0.995
_TWO_DECIMALS = 0.00995
_MAX_MILLINEWTONS_N = 0.0995
"""Smaller forces are written in mN, so that they keep two digits."""
_MIN_NUMBER = 0.005
"""Smaller numbers are rounded to 0."""
_DIRECTIONS = ("east", "northeast", "north", "northwest", "west", "southwest", "south", "southeast")


def format_direction(vector: complex) -> str:
    """Return the nearest of eight compass directions of a vector x + i y; empty for a zero vector.

    >>> format_direction(1 + 1j)
    'northeast'
    """
    if not vector:
        return ""
    return _DIRECTIONS[round(math.atan2(vector.imag, vector.real) / (math.pi / 4)) % 8]


def format_number(value: float) -> str:
    """Format a non-negative number: with two decimals below 1, one below 10, and none above.

    >>> [format_number(value) for value in (0.001, 0.314, 2.44, 12.3, 1e9)]
    ['0', '0.31', '2.4', '12', 'over a million']
    """
    if value >= _MAX_NUMBER:
        return "over a million"
    if value >= _NO_DECIMALS:
        return f"{value:.0f}"
    if value >= _ONE_DECIMAL:
        return f"{value:.1f}"
    if value >= _MIN_NUMBER:
        return f"{value:.2f}"
    return "0"


def format_length(meters: float) -> str:
    """Format a length in a suitable unit.

    >>> [format_length(length) for length in (0.0042, 0.42, 2.44)]
    ['4 mm', '42 cm', '2.4 m']
    """
    if meters < _TWO_DECIMALS:
        return f"{1000 * max(meters, 0.0):.0f} mm"
    if meters < _ONE_DECIMAL:
        return f"{100 * meters:.0f} cm"
    return f"{format_number(meters)} m"


def format_force(newtons: float) -> str:
    """Format the magnitude of a force in a suitable unit.

    >>> [format_force(force) for force in (0.0042, 0.022, 0.314)]
    ['4 mN', '22 mN', '0.31 N']
    """
    if MIN_FORCE_N <= newtons < _MAX_MILLINEWTONS_N:
        return f"{1000 * newtons:.0f} mN"
    return f"{format_number(newtons)} N"


def format_robot_count(count: int) -> str:
    """Format a number of robots, such as "3 robots"."""
    if count == 1:
        return f"{count} robot"
    return f"{count} robots"
