"""The number of runs of a study, which is computed before any combinations are built."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from robocov.errors import ParameterError
from robocov_app.sweep.study.gains import Gains
from robocov_app.sweep.study.sampling import Range, Sampling

DEFAULT_MAX_RUNS = 100_000
"""Maximum number of runs unless the study sets another one. This number takes some days on ten cores."""
MAX_MAX_RUNS = 10_000_000
"""Upper limit of the maximum that a study may set, because the runs are listed in memory."""
_MAX_LISTED_FACTORS = 5
"""Maximum number of varied quantities that the message lists."""


def require_few_runs(
    counts: Mapping[str, int],
    controllers: Sequence[str],
    gains: Mapping[str, Any],
    sampling: Sampling | None,
    max_runs: int,
) -> None:
    """Raise ParameterError if a study has more than `max_runs` runs.

    The combinations are only counted, because a small file may define more than fit into memory.

    Parameters
    ----------
    counts : mapping of str to int
        Number of values of each varied quantity, except for gains.
    controllers, gains, sampling
        As in `Study`.
    max_runs : int
        Maximum number of runs.
    """
    sets_of_gains = sum(_count_gains(gains.get(name, {}), sampling) for name in controllers)
    runs = math.prod(max(count, 1) for count in counts.values()) * sets_of_gains
    if runs <= max_runs:
        return
    varied = [name for name, count in counts.items() if count > 1]
    varied.sort(key=lambda name: counts[name], reverse=True)
    factors = [f"{_format_number(counts[name])} {name}" for name in varied[:_MAX_LISTED_FACTORS]]
    if sets_of_gains > 1:
        factors.append(f"{_format_number(sets_of_gains)} sets of gains")
    message = f"runs: expected at most {max_runs}, got {_format_number(runs)}"
    if factors:
        message += f" ({' x '.join(factors)})"
    raise ParameterError(f"{message}. max_runs in the study allows more, up to {MAX_MAX_RUNS}.")


def count_values(values: object) -> int:
    """Return the number of values in a list; 1 for a single value."""
    if isinstance(values, range):
        # A range may be too long for `len`. The negative signs round the quotient up.
        return max(-(-(values.stop - values.start) // values.step), 0)
    if isinstance(values, Sequence) and not isinstance(values, str):
        return len(values)
    return 1


def _count_gains(specification: Any, sampling: Sampling | None) -> int:
    """Return the number of sets of gains that a study tries for a controller."""
    if isinstance(specification, Gains):
        return len(specification.choices)
    if not isinstance(specification, Mapping):
        return count_values(specification)
    combinations = 1
    has_range = False
    for axis in specification.values():
        if isinstance(axis, Range):
            has_range = True
        else:
            combinations *= max(count_values(axis), 1)
    if has_range and sampling is not None:
        combinations *= sampling.samples
    return combinations


def _format_number(count: int) -> str:
    """Format an integer, which may be too large for a float."""
    if count < 10**9:
        return str(count)
    if count < 10**300:
        return f"{count:.3g}"
    return "more than 1e300"
