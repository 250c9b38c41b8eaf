"""Numbers of examples of property tests."""

from __future__ import annotations

import math

from hypothesis import settings

# Fractions of the examples that profiles run; other profiles run all.
_FRACTIONS = {"quick": 1 / 6, "thorough": 1 / 3}


def count_examples(max_examples: int) -> int:
    """Return a maximum number of examples, which is smaller in the profiles "quick" and "thorough"."""
    fraction = _FRACTIONS.get(settings.get_current_profile_name(), 1.0)
    return math.ceil(max_examples * fraction)
