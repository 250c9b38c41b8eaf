"""The plots beside the claims: one for each of the six questions, made of the plots of reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from robocov_app.figures.gains import plot_gain_grid
from robocov_app.figures.results import Pairs, Sample, plot_final_costs, plot_paired
from robocov_app.replication.asking import CLUSTERED
from robocov_app.replication.claims import compared
from robocov_app.replication.contenders import LABELS
from robocov_app.replication.figures import DOTS, WIDE
from robocov_app.replication.tables import ORDER

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from robocov_app.render.theme import Theme
    from robocov_app.replication.outcomes import GainOutcomes, Outcomes
    from robocov_app.replication.studying import Material


def claim_figures(material: Material, theme: Theme | str) -> Mapping[str, Callable[[], Figure]]:
    """Return how the plot of each question is drawn, by its name; those without a run are left out."""
    drawn: dict[str, Callable[[], Figure]] = {}
    convex, claims = material.convex, material.claims
    questions = {
        "claim-1-convex": (convex_pairs(convex), "RAPF by LA, pair by pair (1: equal)"),
        "claim-2-nonconvex": (nonconvex_pairs(claims), "RAPF by the other law, pair by pair (1: equal)"),
    }
    for name, (pairs, label) in questions.items():
        if pairs:
            drawn[name] = _paired(pairs, label, theme)
    if all(np.isfinite(grid.complete.excess).any() for grid in material.gains.values()):
        drawn["claim-3-gains"] = lambda: gains_figure(material.gains, theme)
    for name, rows, label in (
        ("claim-4-starts", starts_rows(claims), "J/J_ref at the end (1: the centralised reference)"),
        ("claim-6-gap", gap_rows(claims), "J/J_ref at the end (1: the centralised reference)"),
    ):
        if rows:
            drawn[name] = _boxes(rows, label, theme)
    return drawn


def convex_pairs(outcomes: Outcomes) -> list[Pairs]:
    """Return RAPF against LA in convex regions: at the end, and early from each kind of starts."""
    rows = [("at the end", outcomes, "final")]
    rows += [(f"first 20 s, start {start}", outcomes.from_starts([start]), "early") for start in CLUSTERED]
    return [
        pairs
        for words, part, measure in rows
        if (pairs := _pairs(part, "rapf-shared", "lloyd", measure, words)) is not None
    ]


def nonconvex_pairs(outcomes: Outcomes) -> list[Pairs]:
    """Return RAPF against RPF and LA on non-convex maps."""
    rows = [
        ("rapf-shared", "rpf-shared", "final", "RPF, at the end, shared gains"),
        ("rapf-best", "rpf-best", "final", "RPF, at the end, best gains"),
        ("rapf-shared", "rpf-shared", "first_minute", "RPF, first 60 s, shared gains"),
        ("rapf-best", "rpf-best", "first_minute", "RPF, first 60 s, best gains"),
        ("rapf-shared", "lloyd", "final", "LA, at the end, shared gains"),
        ("rapf-best", "lloyd", "final", "LA, at the end, best gains"),
    ]
    return [
        pairs
        for first, second, measure, words in rows
        if (pairs := _pairs(outcomes, first, second, measure, words)) is not None
    ]


def starts_rows(outcomes: Outcomes) -> list[tuple[str, list[Sample]]]:
    """Return the final cost by the kind of the starts, for RAPF and RPF."""
    rows = []
    for law in ("rapf-shared", "rpf-shared"):
        samples = [
            sample
            for start in dict.fromkeys(outcomes.starts)
            if (sample := _sample(outcomes.from_starts([start]), law, f"start {start}")) is not None
        ]
        if samples:
            rows.append((LABELS[law], samples))
    return rows


def gap_rows(outcomes: Outcomes) -> list[tuple[str, list[Sample]]]:
    """Return the final cost of every contender."""
    samples = [sample for law in ORDER if (sample := _sample(outcomes, law, LABELS[law])) is not None]
    return [("", samples)] if samples else []


def gains_figure(gains: Mapping[str, GainOutcomes], theme: Theme | str) -> Figure:
    """Draw the mean of J/J_ref - 1, in percent, over the gains of the repulsion: RPF, RAPF at each k_att."""
    from robocov_app.figures.files import plain_style
    from robocov_app.figures.page import TITLE, Page
    from robocov_app.render.theme import theme_named

    look = theme_named(theme)
    rpf, rapf = gains["rpf"].complete, gains["rapf"].complete
    levels = sorted({float(each["k_att"] or 0.0) for each in rapf.gains})
    panels = [("RPF", rpf)]
    panels += [(f"RAPF, k_att = {level:g}", rapf.with_gain("k_att", level)) for level in levels]
    first = sorted({float(each["k_rep"] or 0.0) for each in rpf.gains})
    second = sorted({float(each["rho_0"] or 0.0) for each in rpf.gains})
    columns = 3 if len(panels) > 4 else 2
    rows = -(-len(panels) // columns)
    left, right, above, below = 44 * DOTS, 10 * DOTS, 52 * DOTS, 44 * DOTS
    width = WIDE / columns - left - right
    height = len(second) * 24 * DOTS
    tall = round(rows * (height + above + below))
    with plain_style():
        page = Page((WIDE, tall), look, DOTS)
        for number, (name, part) in enumerate(panels):
            row, column = divmod(number, columns)
            x, y = left + column * (width + left + right), above + row * (height + above + below)
            axes = page.axes((x, y, width, height))
            values = _grid(part, first, second)
            plot_gain_grid(first, second, values, ("k_rep (N m³)", "rho_0 (m)"), axes, look)
            page.text(name, x - left / 2, y - 36 * DOTS, points=TITLE, bold=True)
        return page.figure


def _grid(part: GainOutcomes, first: Sequence[float], second: Sequence[float]) -> np.ndarray:
    """Return the mean of J/J_ref - 1 over the scenarios in percent, (rows, columns)."""
    values = np.full((len(second), len(first)), np.nan)
    for gains, excess in zip(part.gains, part.excess, strict=True):
        if excess.size:
            place = second.index(float(gains["rho_0"] or 0.0)), first.index(float(gains["k_rep"] or 0.0))
            values[place] = 100.0 * (excess.mean() - 1.0)
    return values


def _pairs(outcomes: Outcomes, first: str, second: str, measure: str, words: str) -> Pairs | None:
    found = compared(outcomes, first, second, measure)
    if found is None:
        return None
    paired, fine = found
    ratios = fine.of(first, measure) / fine.of(second, measure)
    return Pairs(words, "rapf", np.asarray(ratios), paired.ratio)


def _sample(outcomes: Outcomes, law: str, words: str) -> Sample | None:
    values = outcomes.of(law, "gap") + 1.0
    values = values[np.isfinite(values)]
    return Sample(words, law.partition("-")[0], values) if len(values) else None


def _paired(pairs: Sequence[Pairs], label: str, theme: Theme | str) -> Callable[[], Figure]:
    def draw() -> Figure:
        figure = plot_paired(pairs, theme=theme, size=(WIDE, None), scale=DOTS, label=label)
        low, high = figure.axes[0].get_xlim()
        ticks = figure.axes[0].get_xticks()
        if sum(low <= tick <= high for tick in ticks) < 3:
            # where all ratios are near 1, the marks of a logarithmic axis are too far apart
            step = next(step for step in (0.01, 0.02, 0.05, 0.1) if (high - low) / step <= 8)
            figure.axes[0].set_xticks(np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step)
        return figure

    return draw


def _boxes(
    rows: Sequence[tuple[str, Sequence[Sample]]], label: str, theme: Theme | str
) -> Callable[[], Figure]:
    return lambda: plot_final_costs(rows, theme=theme, size=(WIDE, None), scale=DOTS, label=label, origin=1.0)
