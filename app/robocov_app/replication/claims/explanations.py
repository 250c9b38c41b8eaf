"""Sentences that several claims share."""

from collections.abc import Sequence

import numpy as np

from robocov.typing import FloatArray
from robocov_app.replication.design.plan import format_start
from robocov_app.replication.design.study_maps import get_map_kind
from robocov_app.replication.formatting import format_amount, format_median
from robocov_app.replication.results.outcomes import PairedComparison


def describe_middle_half(gaps: FloatArray) -> str:
    """Return a sentence with the first and third quartile of gaps, (m,)."""
    low, high = np.quantile(gaps, [0.25, 0.75]).tolist()
    return f"Half of the runs lie between {format_amount(low, '%')} and {format_amount(high, '%')}."


def describe_losses(pairs: PairedComparison, name: str) -> str:
    """Return a sentence on the pairs that the first contender, `name`, loses, and on its worst pair."""
    worst = int(np.argmax(pairs.ratios))
    highest = format_amount(pairs.ratios[worst])
    losses = (pairs.ratios >= 1.0).sum()
    instance = pairs.outcomes.instances[worst]
    return f"{name} loses {losses} of {len(pairs.ratios)}; the highest ratio is {highest} ({instance})."


def list_ratios_by_start(pairs: PairedComparison) -> str:
    """Return the median ratio for each kind of starts: "corner 0.6, center 0.7"."""
    return _list_ratios(pairs, [format_start(kind) for kind in pairs.outcomes.starts])


def list_ratios_by_map_kind(pairs: PairedComparison) -> str:
    """Return the median ratio for each kind of map: "bundled 0.6, polygons 0.7"."""
    return _list_ratios(pairs, [get_map_kind(name) for name in pairs.outcomes.maps])


def _list_ratios(pairs: PairedComparison, kinds: Sequence[str]) -> str:
    """Return the median ratio for each kind, given the kind of each pair."""
    kind_array = np.array(kinds)
    medians = [(kind, pairs.ratios[kind_array == kind]) for kind in dict.fromkeys(kinds)]
    return ", ".join(f"{kind} {format_median(ratios)}" for kind, ratios in medians)
