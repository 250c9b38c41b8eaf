"""A table of a page, and formatting of its cells."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

NO_VALUE = "–"
"""Text of a cell whose value is unknown."""


@dataclass(frozen=True)
class PageTable:
    """A table whose first column contains the headings of the rows.

    Attributes
    ----------
    caption : str
    head : tuple of str
    rows : sequence of tuple of str
    text_columns : frozenset of int
        Columns after the first that contain text instead of numbers.
    notes : tuple of str
        Notes below the table.
    """

    caption: str
    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    text_columns: frozenset[int] = frozenset()
    notes: tuple[str, ...] = ()


def format_quartiles(values: Sequence[float], decimals: int, no_value: str = NO_VALUE) -> str:
    """Format the median of values, followed by the quartiles if there are several values.

    Examples
    --------
    >>> format_quartiles([1.0, 2.0, 3.0], 1)
    '2.0 (1.5–2.5)'
    """
    if not values:
        return no_value
    low, middle, high = np.percentile(values, [25, 50, 75])
    text = f"{middle:.{decimals}f}"
    if len(values) > 1:
        text += f" ({low:.{decimals}f}–{high:.{decimals}f})"
    return text
