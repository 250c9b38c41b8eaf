"""Plots beside the claims, and figures beyond the paper: functions of nothing, that draw what is wanted."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from robocov.arrays import Array
from robocov.errors import counted
from robocov_app.figures.files import plain_style
from robocov_app.figures.gains import plot_gain_grid
from robocov_app.figures.heights import plot_heights
from robocov_app.figures.page import SMALL, TEXT, TITLE, Page, quiet_axes, tone
from robocov_app.figures.results import Pairs, Sample, plot_final_costs, plot_paired
from robocov_app.figures.styles import CurveStyle, curve_styles
from robocov_app.render.theme import LIGHT, Theme, mix, theme_named
from robocov_app.replication.claims import CLUSTERED
from robocov_app.replication.contenders import LABELS, OURS, OWN, TARGETS, TEAMS
from robocov_app.replication.evidence import ranked_rows
from robocov_app.replication.figures import DOTS, WIDE, side_by_side
from robocov_app.replication.outcomes import Comparison, GainOutcomes, Outcomes
from robocov_app.replication.results import BeyondResults, Degradation, PaperResults
from robocov_app.sweep.study import UNITS

# how every plot is drawn, by its name; those without a run are left out
Plots: TypeAlias = Mapping[str, Callable[[], Figure]]

# what is said of the plots
WORDS = {
    "claim-1-convex": "RAPF against LA in convex regions: every pair of runs, the median and its interval.",
    "claim-2-nonconvex": "RAPF against RPF and LA on non-convex maps: every pair of runs, the median and its "
    "interval. Left of 1 RAPF is better.",
    "claim-3-gains": "How far the final cost is above the reference for every set of gains, in percent: the "
    "mean over the maps of the tuning. The best set of each panel is bold.",
    "claim-4-starts": "The final cost from each kind of starts, by the reference.",
    "claim-6-gap": "The final cost of every law on the non-convex maps, by the reference.",
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

# what the axes of disturbances are called
AXES = {
    "loss": "Messages lost",
    "delay": "Delay of messages",
    "communication_range": "Communication range",
    "position_noise": "Noise of own position",
    "sensing_noise": "Noise of range sensor",
    "failure_rate": "Failures of each robot",
}

_TICKS = (0.0, 1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0, 800.0)  # of the axis of gaps, %
_BESIDE = 0.11  # how far controllers stand beside each other, in distances between two values
_SIZE = (1180, 720)  # of the plot of degradations, px


def paper_plots(results: PaperResults, theme: Theme | str) -> Plots:
    """Return how the plot of each question is drawn."""
    convex, claims, theme = results.convex, results.claims, theme_named(theme)
    against_lloyd = [("at the end", convex.compared("rapf-shared", "lloyd"), "rapf")]
    for start in CLUSTERED:
        pairs = convex.from_starts(start).compared("rapf-shared", "lloyd", "early")
        against_lloyd.append((f"first 20 s, start {start}", pairs, "rapf"))
    nonconvex = [
        (
            f"{label}, {when}, {gains} gains",
            claims.compared(f"rapf-{gains}", other.format(gains), measure),
            "rapf",
        )
        for label, other, measure, when in (
            ("RPF", "rpf-{}", "final", "at the end"),
            ("RPF", "rpf-{}", "first_minute", "first 60 s"),
            ("LA", "lloyd", "final", "at the end"),
        )
        for gains in ("shared", "best")
    ]
    kinds = list(dict.fromkeys(claims.starts))
    by_start = [
        (LABELS[law], _samples((f"start {start}", claims.from_starts(start), law) for start in kinds))
        for law in ("rapf-shared", "rpf-shared")
    ]
    gaps = [("", _samples((label, claims, law) for law, label in LABELS.items()))]
    known = all(grid.complete.scenarios for grid in results.gains.values())
    against = "RAPF by the other law, pair by pair (1: equal)"
    return _drawn(
        {
            "claim-1-convex": _pairs_plot(against_lloyd, "RAPF by LA, pair by pair (1: equal)", theme),
            "claim-2-nonconvex": _pairs_plot(nonconvex, against, theme),
            "claim-3-gains": partial(gains_plot, results.gains, theme) if known else None,
            "claim-4-starts": _boxes_plot(by_start, theme),
            "claim-6-gap": _boxes_plot(gaps, theme),
        }
    )


def beyond_plots(results: BeyondResults, theme: Theme | str) -> Plots:
    """Return how every figure beyond the paper is drawn."""
    theme, outcomes, teams = theme_named(theme), results.outcomes, results.teams
    laws = [row.contender for row in ranked_rows(results)]
    ours = OWN[0].key
    others = [law for law in laws if law.key != ours]
    duels = [(law.label, outcomes.compared(ours, law.key), law.controller) for law in others]
    targets = [(law.label, results.targets.compared(law.key, TARGETS[0].key), "rapf") for law in TARGETS[1:]]
    times = [
        (law.label, teams.compared(law.key, other.key, "time"), law.controller)
        for other, law in zip(TEAMS[::2], TEAMS[1::2], strict=True)
    ]
    samples, size = gap_samples(results), (WIDE, round(0.41 * WIDE))
    # both over the density
    weighed = results.density.pictures[0].record.environment
    pictures = [replace(each.record, environment=weighed) for each in results.density.pictures]
    finals = [f"mean distance by φ {cost:.3f} m" for cost in results.density.costs]
    known = any(np.isfinite(each.ratio.estimate) for each in results.degradations)
    return _drawn(
        {
            "beyond-gaps": partial(gaps_plot, samples, theme) if samples else None,
            "beyond-pairs": _pairs_plot(duels, "ours by the other's, pair by pair (1: equal)", theme),
            "beyond-heights": partial(plot_heights, theme=theme, size=size, title="", scale=0.68 * DOTS),
            "beyond-targets": _pairs_plot(targets, "by the centroid, pair by pair (1: equal)", theme),
            "beyond-density": partial(side_by_side, pictures, ("knows φ", "ignores φ"), finals, theme),
            "beyond-teams": _pairs_plot(times, "mean time, by time to by distance (1: equal)", theme),
            "beyond-conditions": partial(plot_degradations, results.degradations, theme) if known else None,
        }
    )


def gap_samples(results: BeyondResults) -> list[Sample]:
    """Return the gap of every run of every contender in percent, the least median first."""
    found = []
    for law in (row.contender for row in ranked_rows(results)):
        gap = results.outcomes.of(law.key, "gap")
        found.append(Sample(law.label, law.controller, 100.0 * gap[np.isfinite(gap)]))
    return found


@plain_style()
def gains_plot(gains: Mapping[str, GainOutcomes], theme: Theme) -> Figure:
    """Draw the mean of J/J_ref - 1, in percent, over the gains of the repulsion: RPF, RAPF at each k_att."""
    rpf, rapf = gains["rpf"].complete, gains["rapf"].complete
    attractions = _levels(rapf, "k_att")
    panels = [("RPF", rpf), *((f"RAPF, k_att = {k:g}", rapf.with_gain("k_att", k)) for k in attractions)]
    first, second = _levels(rpf, "k_rep"), _levels(rpf, "rho_0")
    columns = 3 if len(panels) > 4 else 2
    rows = -(-len(panels) // columns)
    left, right, above, below = 44 * DOTS, 10 * DOTS, 52 * DOTS, 44 * DOTS
    width = WIDE / columns - left - right
    height = len(second) * 24 * DOTS
    page = Page((WIDE, round(rows * (height + above + below))), theme, DOTS)
    for number, (name, part) in enumerate(panels):
        row, column = divmod(number, columns)
        x, y = left + column * (width + left + right), above + row * (height + above + below)
        values = np.full((len(second), len(first)), np.nan)
        for each, excess in zip(part.gains, part.excess, strict=True):
            at = second.index(float(each["rho_0"] or 0.0)), first.index(float(each["k_rep"] or 0.0))
            values[at] = 100.0 * (excess.mean() - 1.0)
        axes = page.axes((x, y, width, height))
        plot_gain_grid(first, second, values, ("k_rep (N m³)", "rho_0 (m)"), axes, theme)
        page.text(name, x - left / 2, y - 36 * DOTS, points=TITLE, bold=True)
    return page.figure


@plain_style()
def gaps_plot(samples: Sequence[Sample], theme: Theme) -> Figure:
    """Draw the gaps of all contenders as boxes, in percent, on an axis of square roots."""
    styles = [style_of(sample.controller) for sample in samples]
    label = "J/J_ref − 1 at the end (%)"
    size = (WIDE, None)
    figure = plot_final_costs([("", samples)], theme=theme, size=size, scale=DOTS, label=label, styles=styles)
    (axes,) = figure.axes
    values = np.concatenate([sample.values for sample in samples])
    low, high = min(float(values.min()), 0.0), float(values.max())

    def root(places: Array) -> Array:
        return np.asarray(np.sign(places) * np.sqrt(np.abs(places)))

    def square(places: Array) -> Array:
        return np.asarray(np.sign(places) * np.square(places))

    axes.set_xscale("function", functions=(root, square))
    # a little room to the left of what lies below the reference
    axes.set_xlim(-((float(np.sqrt(-low)) + 0.2) ** 2), 1.06 * high)
    axes.xaxis.set_major_locator(FixedLocator([tick for tick in _TICKS if tick <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter("{x:g}")
    return figure


@plain_style()
def plot_degradations(found: Sequence[Degradation], theme: Theme | str = LIGHT) -> Figure:
    """Plot final costs, one at least, by those of the runs without the disturbance: a panel for each axis."""
    theme = theme_named(theme)
    names = list(dict.fromkeys(each.axis for each in found))
    styles = curve_styles(each.controller for each in found)
    quiet = mix(theme.background, theme.ink, 0.7)
    columns = min(3, len(names))
    width, height = (_SIZE[0] - 40) / columns, (_SIZE[1] - 110) / -(-len(names) // columns)
    ends = [value for each in found for value in (each.ratio.estimate, each.ratio.low, each.ratio.high)]
    bottom, top = min(1.0, float(np.nanmin(ends))), max(1.05, float(np.nanmax(ends)))
    room = 0.06 * (top - bottom)
    page = Page(_SIZE, theme, scale=1.0)
    page.title("Coverage when things go wrong", 26)
    words = "final mean distance, as a multiple of the same run's in which that does not go wrong"
    page.text(words, page.margin, 50, colour=quiet, room=page.room)
    for k, name in enumerate(names):
        row, column = divmod(k, columns)
        box = (20 + column * width + 44, 74 + row * height + 26, width - 60, height - 84)
        axes = page.axes(box)
        axes.set_ylim(bottom - room, top + room)
        _panel(axes, name, [each for each in found if each.axis == name], styles, theme)
    handles, labels = page.figure.axes[0].get_legend_handles_labels()
    place: Any = {"loc": "center right", "bbox_to_anchor": page.at(_SIZE[0] - page.margin, 26)}
    look: Any = {"frameon": False, "fontsize": SMALL, "labelcolor": tone(theme.ink)}
    page.figure.legend(handles, labels, ncols=len(handles), **place, **look)
    pairs = counted(max(each.runs for each in found), "pair")
    words = f"medians of {pairs} of runs, and 95 % intervals; only robots that work count"
    page.text(words, page.margin, _SIZE[1] - 18, points=SMALL, colour=quiet)
    return page.figure


def _panel(
    axes: Axes, name: str, part: Sequence[Degradation], styles: Mapping[str, CurveStyle], theme: Theme
) -> None:
    values = list(dict.fromkeys(each.value for each in part))
    axes.axhline(1.0, color=tone(mix(theme.background, theme.ink, 0.35)), linewidth=1.0, zorder=1)
    for k, (controller, style) in enumerate(styles.items()):
        rows = [each for each in part if each.controller == controller]
        x = np.array([values.index(each.value) for each in rows]) + _BESIDE * (k - (len(styles) - 1) / 2)
        y = np.array([each.ratio.estimate for each in rows])
        ends = np.array([[each.ratio.low, each.ratio.high] for each in rows])
        off, colour = np.nan_to_num(np.abs(ends - y[:, None]).T), tone(style.colour(theme))
        axes.errorbar(x, y, off, fmt="none", ecolor=colour, elinewidth=1.4, capsize=2.5, zorder=3)
        look: Any = {"linewidth": 1.6, "linestyle": style.dashes, "marker": style.mark, "markersize": 5.5}
        axes.plot(x, y, label=rows[0].label, color=colour, zorder=3, **look)
    unit = f" ({UNITS[name]})" if UNITS[name] else ""
    axes.set_title(f"{AXES[name]}{unit}", fontsize=TEXT, color=tone(theme.ink), loc="left")
    axes.set_xticks(range(len(values)), ["no limit" if v is None else f"{v:g}" for v in values])
    axes.set_xlim(-0.4, len(values) - 0.6)
    quiet_axes(axes, theme, grid="y")


def style_of(controller: str) -> CurveStyle:
    """Return the style of a controller among many: ours stands out, baselines are alike."""
    style = curve_styles([controller])[controller]
    if not style.name.startswith("other"):
        return style
    return style._replace(name="other-0" if controller in OURS else "other-2")


def _drawn(plots: Mapping[str, Callable[[], Figure] | None]) -> Plots:
    return {name: draw for name, draw in plots.items() if draw is not None}


def _pairs_plot(
    rows: Iterable[tuple[str, Comparison | None, str]], label: str, theme: Theme
) -> Callable[[], Figure] | None:
    """Return how pairs are drawn: words, comparison, and the controller that the style is of."""
    known = [(words, each, controller) for words, each, controller in rows if each is not None]
    pairs = [Pairs(words, controller, each.ratios, each.ratio) for words, each, controller in known]

    def draw() -> Figure:
        styles = [style_of(each.controller) for each in pairs]
        figure = plot_paired(pairs, theme=theme, size=(WIDE, None), scale=DOTS, label=label, styles=styles)
        (axes,) = figure.axes
        low, high = axes.get_xlim()
        if sum(low <= tick <= high for tick in axes.get_xticks()) < 3:
            # where all ratios are near 1, the marks of a logarithmic axis are too far apart
            step = next(step for step in (0.01, 0.02, 0.05, 0.1) if (high - low) / step <= 8)
            axes.set_xticks(np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step)
        return figure

    return draw if pairs else None


def _samples(rows: Iterable[tuple[str, Outcomes, str]]) -> list[Sample]:
    """Return J/J_ref of contenders: words, outcomes, contender."""
    found = []
    for words, outcomes, law in rows:
        values = outcomes.measured("gap", law).of(law, "gap") + 1.0
        if len(values):
            found.append(Sample(words, law.partition("-")[0], values))
    return found


def _boxes_plot(rows: Iterable[tuple[str, Sequence[Sample]]], theme: Theme) -> Callable[[], Figure] | None:
    there = [row for row in rows if row[1]]
    label = "J/J_ref at the end (1: the centralised reference)"
    size = (WIDE, None)
    draw = partial(plot_final_costs, there, theme=theme, size=size, scale=DOTS, label=label, origin=1.0)
    return draw if there else None


def _levels(grid: GainOutcomes, name: str) -> list[float]:
    return sorted({float(each[name] or 0.0) for each in grid.gains})
