"""Plots of the results beyond the paper."""

from dataclasses import replace
from functools import partial

import numpy as np

from robocov_app.figures.final_values import Sample
from robocov_app.look.theme import Theme, get_theme
from robocov_app.replication.design.contenders import OWN, TARGETS, TEAMS
from robocov_app.replication.design.studies import DISTURBED
from robocov_app.replication.evidence import rank_contenders
from robocov_app.replication.figures.comparison_plots import (
    Draw,
    PairsRow,
    Plots,
    draw_gaps,
    get_style,
    prepare_pairs_plot,
    select_plots,
)
from robocov_app.replication.figures.degradation_plot import draw_degradations
from robocov_app.replication.figures.height_plot import draw_heights
from robocov_app.replication.figures.paper_figures import PAGE_SCALE, WIDE_PX, draw_side_by_side
from robocov_app.replication.results.study_results import IDEAL, BeyondResults

_HEIGHTS_ASPECT = 0.41
_HEIGHTS_SCALE = 0.68 * PAGE_SCALE


def prepare_beyond_plots(results: BeyondResults, theme: Theme | str) -> Plots:
    """Return the functions that draw the plots of the results beyond the paper, by name."""
    theme = get_theme(theme)
    samples = build_gap_samples(results)
    heights_size = (WIDE_PX, round(_HEIGHTS_ASPECT * WIDE_PX))
    return select_plots(
        {
            "beyond-gaps": partial(draw_gaps, samples, theme) if samples else None,
            "beyond-pairs": prepare_pairs_plot(
                _list_own_pair_rows(results), "our cost / cost of the other, per pair (1 = equal)", theme
            ),
            "beyond-heights": partial(draw_heights, heights_size, theme, _HEIGHTS_SCALE),
            "beyond-targets": prepare_pairs_plot(
                _list_target_rows(results),
                "cost / cost with the centroid, per pair (1 = equal)",
                theme,
            ),
            "beyond-density": _plan_density_figure(results, theme),
            "beyond-teams": prepare_pairs_plot(
                _list_team_rows(results),
                "mean time with cells by time / with cells by distance, per pair (1 = equal)",
                theme,
            ),
            "beyond-conditions": _plan_degradations_plot(results, theme),
        }
    )


def build_gap_samples(results: BeyondResults) -> list[Sample]:
    """Return the gaps of all contenders, %, by ascending median."""
    samples = []
    for summary in rank_contenders(results):
        contender = summary.contender
        known = results.outcomes.select_finite("gap", contender.key)
        gaps = 100.0 * known.get_values(contender.key, "gap")
        samples.append(Sample(contender.label, get_style(contender.controller), gaps))
    return samples


def _list_own_pair_rows(results: BeyondResults) -> list[PairsRow]:
    """Compare our main controller with each other contender, in the order of the ranking."""
    own_key = OWN[0].key
    rows = []
    for summary in rank_contenders(results):
        other = summary.contender
        if other.key != own_key:
            pairs = results.outcomes.compare(own_key, other.key)
            rows.append(PairsRow(other.label, pairs, other.controller))
    return rows


def _list_target_rows(results: BeyondResults) -> list[PairsRow]:
    """Compare RAPF with other targets in its cells with RAPF that moves to the centroids."""
    centroid = TARGETS[0]
    return [
        PairsRow(target.label, results.targets.compare(target.key, centroid.key), "rapf")
        for target in TARGETS[1:]
    ]


def _list_team_rows(results: BeyondResults) -> list[PairsRow]:
    """Compare, for each controller of mixed teams, cells by time with cells by distance."""
    rows = []
    # `TEAMS` lists each controller with cells by distance, followed by the same one with cells by time.
    for by_distance, by_time in zip(TEAMS[::2], TEAMS[1::2], strict=True):
        pairs = results.teams.compare(by_time.key, by_distance.key, "time")
        rows.append(PairsRow(by_time.label, pairs, by_time.controller))
    return rows


def _plan_density_figure(results: BeyondResults, theme: Theme) -> Draw:
    """Return a function that draws runs with and without knowledge of the density, on a map that shows it."""
    known, ignored = results.density.figure_runs
    weighted = known.record.environment
    records = [replace(run.record, environment=weighted) for run in (known, ignored)]
    costs = [f"mean distance weighted by φ {cost:.3f} m" for cost in results.density.costs]
    headings = list(zip(("knows φ", "ignores φ"), costs, strict=True))
    return partial(draw_side_by_side, records, headings, theme)


def _plan_degradations_plot(results: BeyondResults, theme: Theme) -> Draw | None:
    """Return a function that draws the controllers with all disturbances; None without results."""
    degradations = [
        degradation
        for degradation in results.degradations
        if degradation.controller in DISTURBED and degradation.axis != IDEAL
    ]
    if not any(np.isfinite(degradation.ratio.estimate) for degradation in degradations):
        return None
    return partial(draw_degradations, degradations, theme)
