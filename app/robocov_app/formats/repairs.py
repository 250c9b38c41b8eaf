"""Counts of the shapes that an import repairs, for its report."""

from collections import Counter

from robocov.errors import format_count


class Repairs:
    """Counts of shapes that are repaired.

    Attributes
    ----------
    counts : Counter of (str, str)
        Number of shapes by kind and repair.
    """

    def __init__(self) -> None:
        self.counts: Counter[tuple[str, str]] = Counter()
        self._self_crossings: list[str] = []

    def add_self_crossing(self, reason: str, location: str) -> None:
        """Count an outline that crosses or touches itself.

        Parameters
        ----------
        reason : str
        location : str
            Location in the file; may be empty.
        """
        if location:
            reason = f"{location}: {reason}"
        self._self_crossings.append(reason)

    def describe(self) -> tuple[str, ...]:
        """Return the lines of the report about repairs."""
        lines = []
        for (kind, repair), count in sorted(self.counts.items()):
            lines.append(f"{format_count(count, kind)} {repair}")
        crossings = self._self_crossings
        if len(crossings) == 1:
            lines.append(f"the outline crossed or touched itself: {crossings[0]}")
        elif crossings:
            count = len(crossings)
            lines.append(f"{count} outlines crossed or touched themselves, the first: {crossings[0]}")
        return tuple(lines)
