"""Columns of widgets in a panel."""

from __future__ import annotations

MARGIN, WIDE = 12, 296
"""Pixels at scale 1: beside the widgets, and what is left to them."""

GAP = 6
"""Pixels at scale 1 between widgets side by side."""


def columns(count: int, wide: float = WIDE) -> list[tuple[float, float]]:
    """Return left edge and width of so many widgets side by side.

    >>> columns(2)
    [(12.0, 145.0), (163.0, 145.0)]
    """
    width = (wide - GAP * (count - 1)) / count
    return [(MARGIN + k * (width + GAP), width) for k in range(count)]
