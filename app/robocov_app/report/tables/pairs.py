"""Tables of comparisons in pairs of runs."""

from collections.abc import Sequence

import numpy as np

from robocov.errors import format_count
from robocov_app.report.analysis.comparisons import GroupComparison, MapPairs, format_ratio
from robocov_app.report.tables.table import PageTable


def build_pairs_table(comparisons: Sequence[GroupComparison]) -> PageTable | None:
    """Build the table of comparisons over all maps; return None if there are no comparisons."""
    if not comparisons:
        return None
    rows = []
    for comparison in comparisons:
        pair_count = comparison.pair_count
        lower_count = sum(pairs.lower_count for pairs in comparison.maps)
        verdicts = comparison.format_verdicts() if pair_count > 1 else "one pair only"
        row = (
            comparison.first.label,
            comparison.second.label,
            format_ratio(comparison.ratio),
            verdicts,
            f"{lower_count} of {format_count(pair_count, 'pair')}",
        )
        rows.append(row)
    caption = "Final mean distance of the first divided by that of the second"
    head = ("First", "Second", "Ratio", "First is", "First has the lower cost in")
    return PageTable(caption, head, rows, text_columns=frozenset({1, 3}))


def build_map_pairs_tables(comparisons: Sequence[GroupComparison]) -> list[PageTable]:
    """Build a table for each comparison on several maps, with a row for each map."""
    head = (
        "Map",
        "Pairs",
        "First, mean in m",
        "Second, mean in m",
        "Ratio",
        "First is",
        "First has the lower cost in",
    )
    tables = []
    for comparison in comparisons:
        if len(comparison.maps) > 1:
            rows = [_build_map_row(pairs) for pairs in comparison.maps]
            tables.append(PageTable(comparison.label, head, rows, text_columns=frozenset({5})))
    return tables


def _build_map_row(pairs: MapPairs) -> tuple[str, ...]:
    """Build the row of the pairs on one map."""
    return (
        pairs.map_name,
        str(pairs.pair_count),
        f"{np.mean(pairs.first_distances):.3f}",
        f"{np.mean(pairs.second_distances):.3f}",
        format_ratio(pairs.ratio),
        pairs.verdict,
        f"{pairs.lower_count} of {format_count(pairs.pair_count, 'pair')}",
    )
