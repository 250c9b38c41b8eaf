"""Plots of the ratios of pairs of runs."""

from collections.abc import Sequence

import numpy as np

from robocov_app.figures.pairs import Pairs, plot_pairs
from robocov_app.report.analysis.comparisons import GroupComparison, format_ratio
from robocov_app.report.plots.plot import MAX_PANELS, PANEL_SIZE_PX, GroupStyles, PagePlot
from robocov_app.report.svg import inline_svg


def build_pair_plots(comparisons: Sequence[GroupComparison], styles: GroupStyles, key: str) -> list[PagePlot]:
    """Build a plot for each comparison with several pairs: a row for each map, and one over all maps.

    Parameters
    ----------
    comparisons : sequence of GroupComparison
    styles : mapping of str to CurveStyle
    key : str
        Start of the ids in the plots.

    Returns
    -------
    list of PagePlot
    """
    plots = []
    for number, comparison in enumerate(comparisons):
        if comparison.pair_count < 2:
            continue
        rows = _list_rows(comparison, styles)
        texts = "; ".join(f"{row.label}: ratio {format_ratio(row.interval)}" for row in rows)
        figure = plot_pairs(rows, "ratio of final mean distances (log)", width=PANEL_SIZE_PX[0], scale=1.0)
        description = f"{comparison.label}, pair by pair. {texts}."
        plots.append(PagePlot(comparison.label, inline_svg(figure, f"{key}-{number}", description)))
    return plots


def _list_rows(comparison: GroupComparison, styles: GroupStyles) -> list[Pairs]:
    """Return the rows of a comparison's plot: one for each map, unless there are many, and one for all."""
    style = styles[comparison.first.label]
    maps = comparison.maps
    if len(maps) == 1:
        ratios = maps[0].first_distances / maps[0].second_distances
        return [Pairs(f"{comparison.pair_count} pairs", style, ratios, comparison.ratio)]
    rows = []
    if len(maps) <= MAX_PANELS:
        for pairs in maps:
            ratios = pairs.first_distances / pairs.second_distances
            rows.append(Pairs(pairs.map_name, style, ratios, pairs.ratio))
    map_ratios = np.array([pairs.ratio.estimate for pairs in maps])
    label = "both maps" if len(maps) == 2 else f"all {len(maps)} maps"
    rows.append(Pairs(label, style, map_ratios, comparison.ratio))
    return rows
