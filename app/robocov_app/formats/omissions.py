"""Counts of the shapes that an import leaves out, such as those of dropped layers, for its report."""

from collections import Counter

import numpy as np

from robocov.errors import format_count
from robocov.typing import FloatArray


class Omissions:
    """Counts of shapes that are left out.

    Attributes
    ----------
    counts : Counter of (str, str)
        Number of shapes by kind and reason.
    """

    def __init__(self) -> None:
        self.counts: Counter[tuple[str, str]] = Counter()
        self._heights: list[FloatArray] = []

    def add_heights(self, heights: FloatArray) -> None:
        """Count third coordinates, which are dropped because maps are plane; nan stands for a missing one."""
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
    """Return a count with its noun, including nouns whose plural ends in -es or -ies.

    Examples
    --------
    >>> format_plural(2, "box"), format_plural(2, "geometry"), format_plural(2, "way")
    ('2 boxes', '2 geometries', '2 ways')
    """
    if count == 1:
        return f"{count} {noun}"
    ending = noun[-2:].lower()
    if ending in ("ch", "sh") or ending.endswith("x"):
        return f"{count} {noun}es"
    if noun.endswith("y") and ending[0] not in "aeiouy":
        return f"{count} {noun[:-1]}ies"
    return format_count(count, noun)
