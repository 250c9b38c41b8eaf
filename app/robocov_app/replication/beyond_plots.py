"""The figures beyond the paper, made of the plots of reports and of the parts that they show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from robocov_app.figures.arena import draw_run, label_of, run_handles
from robocov_app.figures.files import plain_style
from robocov_app.figures.heights import plot_heights
from robocov_app.figures.page import SMALL, TITLE
from robocov_app.figures.results import Pairs, Sample, plot_final_costs, plot_paired
from robocov_app.figures.styles import CurveStyle, curve_styles
from robocov_app.render.layout import united
from robocov_app.render.theme import Theme, theme_named
from robocov_app.replication.beyond_plan import OURS
from robocov_app.replication.beyond_studies import TARGETS, TEAMS
from robocov_app.replication.claims import compared
from robocov_app.replication.degradation_plots import plot_degradations
from robocov_app.replication.evidence import evidence_rows
from robocov_app.replication.figures import DOTS, WIDE, panels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from robocov.arrays import Array
    from robocov_app.replication.beyond import BeyondMaterial, Weighed
    from robocov_app.replication.outcomes import Outcomes

WORDS = {
    "beyond-gaps": "How far every contender ends above the centralised reference: every run, quartiles and "
    "median. The axis is one of square roots, so that what is near the reference can be told apart.",
    "beyond-pairs": "Our controller's final cost by that of every other contender in the same run: every "
    "pair, the median and its interval. Left of 1 ours is better.",
    "beyond-heights": "Where a sensor that hovers at height h is best placed over a cell: what (14) says, "
    "and the text after it denies. The path from the optimum near the ground to the centroid.",
    "beyond-targets": "RAPF's final cost with another target by that with the centroid, pair by pair.",
    "beyond-density": "Two runs from the same places, where the shading says how much each place counts: "
    "RAPF that knows it, and RAPF that does not. Crosses are where they head: the centroids of the cells, "
    "weighed and not.",
    "beyond-teams": "The mean time until the first robot is at a place, of robots that are not equally fast: "
    "with cells by time, by that with cells by distance, pair by pair.",
    "beyond-conditions": "The final cost where messages get lost or are late, where robots hear less far, "
    "sense badly or fail, by that of the same run under ideal conditions: medians with 95 % intervals.",
}
"""What is said of the figures."""

_TICKS = (0.0, 1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0, 800.0)
"""Marks of the axis of gaps, in percent."""

_CONDITIONS_SIZE = (1180, 720)


def beyond_figures(material: BeyondMaterial, theme: Theme | str) -> Mapping[str, Callable[[], Figure]]:
    """Return how every figure is drawn, by its name; those without a run are left out."""
    look = theme_named(theme)
    drawn: dict[str, Callable[[], Figure]] = {}
    samples = gap_samples(material)
    if samples:
        drawn["beyond-gaps"] = lambda: gaps_figure(samples, look)
    duels = ours_by_others(material)
    if duels:
        drawn["beyond-pairs"] = _paired(duels, "ours by the other's, pair by pair (1: equal)", look)
    drawn["beyond-heights"] = lambda: plot_heights(
        theme=look, size=(WIDE, round(0.41 * WIDE)), title="", scale=0.68 * DOTS
    )
    targets = [
        pairs
        for law in TARGETS[1:]
        if (pairs := pair_row(material.targets, law.key, TARGETS[0].key, law.label, "rapf")) is not None
    ]
    if targets:
        drawn["beyond-targets"] = _paired(targets, "by the centroid, pair by pair (1: equal)", look)
    drawn["beyond-density"] = lambda: density_figure(material.weighed, look)
    teams = [
        pairs
        for law, other in zip(TEAMS[1::2], TEAMS[::2], strict=True)
        if (pairs := pair_row(material.teams, law.key, other.key, law.label, law.controller)) is not None
    ]
    if teams:
        drawn["beyond-teams"] = _paired(teams, "mean time, by time to by distance (1: equal)", look)
    if any(np.isfinite(each.ratio.estimate) for each in material.degradations):
        drawn["beyond-conditions"] = lambda: plot_degradations(
            material.degradations, look, _CONDITIONS_SIZE, "Coverage when things go wrong"
        )
    return drawn


def gap_samples(material: BeyondMaterial) -> list[Sample]:
    """Return the gap of every run of every contender in percent, the least median first."""
    found = []
    for row in evidence_rows(material.outcomes, material.contenders, {}):
        gap = material.outcomes.of(row.law.key, "gap")
        found.append(Sample(row.law.label, row.controller, 100.0 * gap[np.isfinite(gap)]))
    return found


def ours_by_others(material: BeyondMaterial) -> list[Pairs]:
    """Return our first controller against every other contender."""
    ours = material.ours
    if ours is None:
        return []
    found = [
        pair_row(material.outcomes, ours, row.law.key, row.law.label, row.controller)
        for row in evidence_rows(material.outcomes, material.contenders, {})
        if row.law.key != ours
    ]
    return [pairs for pairs in found if pairs is not None]


def pair_row(outcomes: Outcomes, first: str, second: str, words: str, controller: str) -> Pairs | None:
    """Return how one contender did against another at the end; None where they never met."""
    found = compared(outcomes, first, second)
    if found is None:
        return None
    paired, fine = found
    return Pairs(
        words, controller, np.asarray(fine.of(first, "final") / fine.of(second, "final")), paired.ratio
    )


def gaps_figure(samples: Sequence[Sample], theme: Theme) -> Figure:
    """Draw the gaps of all contenders as boxes, in percent, on an axis of square roots."""
    from matplotlib.ticker import FixedLocator, NullLocator

    styles = [style_of(sample.controller) for sample in samples]
    label = "J/J_ref − 1 at the end (%)"
    figure = plot_final_costs(
        [("", samples)], theme=theme, size=(WIDE, None), scale=DOTS, label=label, styles=styles
    )
    (axes,) = figure.axes
    values = np.concatenate([sample.values for sample in samples])
    low, high = min(float(values.min()), 0.0), float(values.max())
    with plain_style():
        axes.set_xscale("function", functions=(_root, _square))
        # a little room to the left of what lies below the reference
        axes.set_xlim(-((float(np.sqrt(-low)) + 0.2) ** 2), 1.06 * high)
        axes.xaxis.set_major_locator(FixedLocator([tick for tick in _TICKS if tick <= high]))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter("{x:g}")
    return figure


def style_of(controller: str) -> CurveStyle:
    """Return the style of a controller among many: ours stands out, rivals are alike."""
    style = curve_styles([controller])[controller]
    if not style.name.startswith("other"):
        return style
    return style._replace(name="other-0" if controller in OURS else "other-2")


def density_figure(weighed: Weighed, theme: Theme) -> Figure:
    """Draw the run that knew the density beside the one that did not, both over the density."""
    shown, costs = weighed.pictures, weighed.costs
    environment = shown[0].record.environment
    records = [replace(each.record, environment=environment) for each in shown]
    with plain_style():
        handles = united((run_handles(record, theme, "paper") for record in records), label_of)
        page, places = panels(environment, 2, WIDE, handles, theme, above=30.0)
        titles = ("(a)  knows φ", "(b)  ignores φ")
        for title, record, cost, axes in zip(titles, records, costs, places, strict=True):
            draw_run(axes, record, theme, "paper")
            box = axes.get_position()
            top = (1.0 - box.y1) * page.size[1] - 14 * page.scale
            page.text(title, box.x0 * page.size[0], top, points=TITLE, bold=True)
            final = f"mean distance by φ {cost:.3f} m"
            page.text(final, box.x1 * page.size[0], top, points=SMALL, colour=theme.faint, align="right")
        return page.figure


def _paired(pairs: Sequence[Pairs], label: str, theme: Theme) -> Callable[[], Figure]:
    styles = [style_of(each.controller) for each in pairs]
    return lambda: plot_paired(pairs, theme=theme, size=(WIDE, None), scale=DOTS, label=label, styles=styles)


def _root(values: Array) -> Array:
    return np.asarray(np.sign(values) * np.sqrt(np.abs(values)))


def _square(values: Array) -> Array:
    return np.asarray(np.sign(values) * np.square(values))
