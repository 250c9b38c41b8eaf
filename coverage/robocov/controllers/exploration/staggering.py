"""Fractions that differ from robot to robot, so that robots do not all act at the same times."""

import math

_GOLDEN_FRACTION = (math.sqrt(5.0) - 1.0) / 2.0
"""Its multiples, modulo 1, are spread evenly between 0 and 1 (Weyl's equidistribution theorem)."""


def compute_stagger_fraction(number: float) -> float:
    """Compute a fraction from 0 to 1. The fractions of consecutive numbers are spread evenly.

    Parameters
    ----------
    number : float
        For example the index of a robot.

    Returns
    -------
    float

    Examples
    --------
    >>> [round(compute_stagger_fraction(robot), 2) for robot in range(4)]
    [0.0, 0.62, 0.24, 0.85]
    """
    return number * _GOLDEN_FRACTION % 1.0
