"""Plots of the paper's claims."""

from functools import partial

from robocov_app.look.theme import Theme, get_theme
from robocov_app.replication.claims.thresholds import CLUSTERED
from robocov_app.replication.design.contenders import GAIN_CHOICES, LABELS
from robocov_app.replication.figures.comparison_plots import (
    CostRow,
    PairsRow,
    Plots,
    build_cost_samples,
    draw_gain_grids,
    prepare_cost_ratio_plot,
    prepare_pairs_plot,
    select_plots,
)
from robocov_app.replication.results.outcomes import Outcomes
from robocov_app.replication.results.study_results import PaperResults

_RATIO_LABEL = "RAPF relative to the other controller, per pair (1 = equal)"


def prepare_paper_plots(results: PaperResults, theme: Theme | str) -> Plots:
    """Return the functions that draw the plots of the paper's claims, by name."""
    theme = get_theme(theme)
    claims = results.claims
    by_start = []
    for key in ("rapf-shared", "rpf-shared"):
        rows = [
            CostRow(f"start {start}", claims.select_starts(start), key)
            for start in dict.fromkeys(claims.starts)
        ]
        by_start.append((LABELS[key], build_cost_samples(rows)))
    gap_rows = [CostRow(label, claims, key) for key, label in LABELS.items()]
    has_gains = all(grid.select_complete().instances for grid in results.gains.values())
    return select_plots(
        {
            "claim-1-convex": prepare_pairs_plot(
                _list_convex_rows(results.convex), "RAPF relative to Lloyd, per pair (1 = equal)", theme
            ),
            "claim-2-nonconvex": prepare_pairs_plot(
                _list_nonconvex_rows(claims),
                _RATIO_LABEL,
                theme,
            ),
            "claim-3-gains": partial(draw_gain_grids, results.gains, theme) if has_gains else None,
            "claim-4-starts": prepare_cost_ratio_plot(by_start, theme),
            "claim-6-gap": prepare_cost_ratio_plot([("", build_cost_samples(gap_rows))], theme),
            "claim-7-limited": prepare_pairs_plot(
                _list_nonconvex_rows(results.limited),
                _RATIO_LABEL,
                theme,
            ),
        }
    )


def _list_convex_rows(outcomes: Outcomes) -> list[PairsRow]:
    """Compare RAPF with Lloyd's algorithm at the end, and early on from each kind of clustered starts."""
    rows = [
        PairsRow(f"at the end, {gains} gains", outcomes.compare(f"rapf-{gains}", "lloyd"), "rapf")
        for gains in GAIN_CHOICES
    ]
    for start in CLUSTERED:
        pairs = outcomes.select_starts(start).compare("rapf-shared", "lloyd", "early")
        rows.append(PairsRow(f"first 20 s, start {start}", pairs, "rapf"))
    return rows


def _list_nonconvex_rows(outcomes: Outcomes) -> list[PairsRow]:
    """Compare RAPF with RPF, at the end and in the first minute, and with Lloyd's algorithm at the end."""
    rows = []
    for gains in GAIN_CHOICES:
        pairs = outcomes.compare(f"rapf-{gains}", f"rpf-{gains}", "final")
        rows.append(PairsRow(f"RPF, at the end, {gains} gains", pairs, "rapf"))
    for gains in GAIN_CHOICES:
        pairs = outcomes.compare(f"rapf-{gains}", f"rpf-{gains}", "first_minute")
        rows.append(PairsRow(f"RPF, first 60 s, {gains} gains", pairs, "rapf"))
    for gains in GAIN_CHOICES:
        pairs = outcomes.compare(f"rapf-{gains}", "lloyd", "final")
        rows.append(PairsRow(f"Lloyd, at the end, {gains} gains", pairs, "rapf"))
    return rows
