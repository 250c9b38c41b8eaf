"""Counts of shapes that an import leaves out or repairs, for its report."""

from collections import Counter

import numpy as np

from robocov.arrays import Array
from robocov.errors import format_count


class ImportTally:
    """Counts of shapes that are left out or repaired.

    Attributes
    ----------
    left_out, mended : Counter of (str, str)
        Number of shapes of a kind, by the kind and the reason.
    """

    def __init__(self) -> None:
        self.left_out: Counter[tuple[str, str]] = Counter()
        self.mended: Counter[tuple[str, str]] = Counter()
        self._self_crossings: list[str] = []
        self._heights: list[Array] = []

    def add_self_crossing(self, reason: str, at: str) -> None:
        """Count an outline that meets itself.

        Parameters
        ----------
        reason : str
        at : str
            Position in the file; may be empty.
        """
        self._self_crossings.append(f"{at}: {reason}" if at else reason)

    def add_heights(self, heights: Array) -> None:
        """Count third coordinates, which maps do not have; nan stands for none."""
        self._heights.append(heights[~np.isnan(heights)])

    def describe_repairs(self) -> tuple[str, ...]:
        """Return the lines of the report about repairs."""
        lines = [f"{format_count(count, kind)} {what}" for (kind, what), count in sorted(self.mended.items())]
        crossings = self._self_crossings
        if len(crossings) == 1:
            lines.append(f"the outline met itself: {crossings[0]}")
        elif crossings:
            lines.append(f"{len(crossings)} outlines met themselves, the first: {crossings[0]}")
        return tuple(lines)

    def describe_omissions(self) -> tuple[str, ...]:
        """Return the lines of the report about shapes that were left out."""
        lines = [
            f"{format_plural(count, kind)} {reason}".strip()
            for (kind, reason), count in sorted(self.left_out.items())
        ]
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
