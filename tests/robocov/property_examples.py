"""Numbers of examples of property tests."""

from __future__ import annotations

import math

from hypothesis import settings

# Fraction of the examples that the profile "quick" runs.
_QUICK_FRACTION = 1 / 6


def count_examples(max_examples: int) -> int:
    """Return a maximum number of examples, which is smaller in the profile "quick"."""
    if settings.get_current_profile_name() == "quick":
        return math.ceil(max_examples * _QUICK_FRACTION)
    return max_examples
