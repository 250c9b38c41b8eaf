"""Counts of shapes that an import leaves out, such as those of dropped layers, for its report."""

from collections import Counter

import numpy as np

from robocov.arrays import Array
from robocov.errors import format_count


class Omissions:
    """Counts of shapes that are left out.

    Attributes
    ----------
    counts : Counter of (str, str)
        Number of shapes by their kind and the reason.
    """

    def __init__(self) -> None:
        self.counts: Counter[tuple[str, str]] = Counter()
        self._heights: list[Array] = []

    def add_heights(self, heights: Array) -> None:
        """Count third coordinates, which maps do not have; nan stands for none."""
        self._heights.append(heights[~np.isnan(heights)])

    def describe(self) -> tuple[str, ...]:
        """Return the lines of the report about shapes that were left out."""
        lines = []
        for (kind, reason), count in sorted(self.counts.items()):
            lines.append(f"{format_plural(count, kind)} {reason}".strip())
        heights = np.concatenate([*self._heights, np.empty(0)])
        if len(heights):
            span = f"z from {heights.min():.4g} to {heights.max():.4g}"
            lines.append(f"{format_count(len(heights), 'third coordinate')}, {span}")
        return tuple(lines)


def format_plural(count: int, noun: str) -> str:
    """Return a count with its noun, also for nouns in y and x.

    Examples
    --------
    >>> format_plural(2, "box")
    '2 boxes'
    """
    if count == 1 or not noun.endswith(("y", "x")):
        return format_count(count, noun)
    if noun.endswith("y"):
        return f"{count} {noun[:-1]}ies"
    return f"{count} {noun}es"
