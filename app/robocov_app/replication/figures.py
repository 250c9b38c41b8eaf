"""The paper's figures 1 to 8 on environments of the same kinds, plots of the claims, and those beyond it.

Starts are green, final positions blue, trajectories red; RAPF's cost is blue, RPF's red, as in the paper.
"""

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import ConnectionPatch, Polygon, Rectangle
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.errors import format_count
from robocov.locational_cost import Distance, Sensing, compute_locational_costs
from robocov.locational_cost.best_points import find_best_points
from robocov.metrics import CostHistory
from robocov.observation.region import Region
from robocov.record import Record
from robocov.voronoi import VoronoiPartition, partition
from robocov_app.figures import arena
from robocov_app.figures.curves import draw_curves, end_label
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL, TEXT, TITLE, Box, Page, quiet_axes, tone
from robocov_app.figures.results import Pairs, Sample, plot_final_costs, plot_gain_grid, plot_paired
from robocov_app.figures.styles import CurveStyle, curve_styles, styles_of
from robocov_app.render.layout import united
from robocov_app.render.scene import CENTROID, GOAL
from robocov_app.render.theme import LIGHT, Theme, mix, theme_named
from robocov_app.replication import outcomes as reached
from robocov_app.replication.claims import CLUSTERED, amount
from robocov_app.replication.contenders import ASSETS, LABELS, OURS, OWN, TARGETS, TEAMS
from robocov_app.replication.evidence import ranked_rows
from robocov_app.replication.outcomes import FIRST_MINUTE, Comparison, GainOutcomes, Outcomes
from robocov_app.replication.results import IDEAL, BeyondResults, Degradation, FigureRun, PaperResults
from robocov_app.replication.studies import DISTURBED
from robocov_app.sweep.parameters import UNITS

DOTS = 3.0  # scale of the pages: 300 dots an inch
WIDE, NARROW = 2148, 1050  # pixels of two columns of a journal (7.16 inches) and of one (3.5 inches)
HIDDEN = 0.25  # m from its centroid within which a robot's disc hides it, on a map of ten metres
ARRIVED = 0.05  # a cost has arrived when it stays within 5 % of its last value

# the paper's figures, in its order, and the case that each shows
FIGURES = {1: "partition", 2: "convex", 3: "convex", 4: "a", 5: "a", 6: "b", 7: "b", 8: "other"}
BEST = (4, 5, 6, 7, 8)  # figures that are drawn at the best gains as well
COSTS = (3, 5, 7)  # figures of the cost against time; all but the first of the others show trajectories

# what is said of the figures, by their names
CAPTIONS: Mapping[str, str] = tomllib.loads((ASSETS / "captions.toml").read_text(encoding="utf-8"))

_TICKS = (0.0, 1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0, 800.0)  # of the axis of gaps, %
_BESIDE = 0.11  # how far controllers stand beside each other, in distances between two values
_SIZE = (1180, 720)  # of the plot of degradations, px

PENTAGON = ((0.0, 0.0), (4.0, 0.0), (5.0, 2.0), (2.0, 4.0), (-1.0, 1.5))  # a cell without any symmetry, m
_APART = 0.13  # heights have words where their places are so far apart, as a part of the path
_LOW, _HIGH = 0.01, 100.0  # the range of heights, m
_LIMIT = 1e-7  # so high, relative to the cell's size, a sensor is as good as on the ground

Draw: TypeAlias = Callable[[], Figure]
Plots: TypeAlias = Mapping[str, Draw]  # how each is drawn, by its name; those without a run are left out


def draw_figure(number: int, runs: Mapping[str, FigureRun], first: Record, theme: Theme | str) -> Figure:
    theme = theme_named(theme)
    if number == 1:
        return partition_figure(first, theme)
    pair = _pair(runs, number)
    if number in COSTS:
        return cost_figure(pair, theme)
    records = [run.record for run in pair]
    aiming = [record for record in records if arena.has_goals(record)]
    hidden = all((np.hypot(*(each.goals[-1] - each.positions[-1]).T) < HIDDEN).all() for each in aiming)
    heads = [(run.record.label, f"mean distance {run.history.mean_distance[-1]:.3f} m") for run in pair]
    return side_by_side(records, heads, theme, (CENTROID, GOAL) if hidden else ())


def describe_figure(number: int, runs: Mapping[str, FigureRun], first: Record) -> str:
    if number == 1:
        places, environment = first.positions[0], first.environment
        centroids = partition(places, environment.region).centroid
        away = amount(float(np.hypot(*(centroids - places).T).mean()), "m")
        where = f"The robots stand anywhere in “{environment.name}”, on average {away}"
        return f"{where} from the centres of mass of their cells."
    ours, other = pair = _pair(runs, number)
    label, costs = other.record.label, [run.history.mean_distance for run in pair]
    if number in COSTS:
        early, shared = [reached.mean_until(run.history, FIRST_MINUTE) for run in pair], min(map(len, costs))
        below, at_rest = costs[0][1:shared] < costs[1][1:shared], [arrival(run.history) for run in pair]
        return (
            f"Averaged over the first {FIRST_MINUTE:g} s RAPF has {early[0]:.3f} m, {label} "
            f"{early[1]:.3f} m: {_difference_text(*early)}. RAPF's is the lower one "
            f"{amount(float(below.mean()), '%')} of the time. RAPF stays within 5 % of its last value from "
            f"{at_rest[0]:.0f} s on, {label} from {at_rest[1]:.0f} s on."
        )
    mine, theirs = (float(cost[-1]) for cost in costs)
    words = (
        f"On “{ours.record.environment.name}” RAPF ends with a mean distance of {mine:.3f} m, {label} with "
        f"{theirs:.3f} m: {_difference_text(mine, theirs)}."
    )
    if number == 8:
        ends = {name: run.record.positions[-1] for name, run in runs.items()}
        moved = [reached.matched_distance(ends[f"b/{law}"], ends[f"other/{law}"]) for law in ("rapf", "rpf")]
        words += (
            f" Between the ends of figure 6 and these, robots are {amount(moved[0], 'm')} apart with RAPF "
            f"and {amount(moved[1], 'm')} with RPF (matched with the least sum of distances)."
        )
    return words


@plain_style()
def partition_figure(first: Record, theme: Theme = LIGHT) -> Figure:
    environment, robots = first.environment, first.positions[0]
    ink, edge = tone(theme.ink), tone(theme.cell_edge)
    dot: Any = {"linestyle": "none", "marker": "o", "markersize": 4.0, "color": ink}
    handles: list[Artist] = [
        arena.robot_handle("robot", theme.final, theme),
        Line2D([], [], label="centre of mass of its cell", **dot),
        Line2D([], [], color=edge, linewidth=0.9, label="Voronoi cell"),
        *arena.map_handles(environment, theme)[1:],
    ]
    page, (axes,) = panels(environment, 1, NARROW, handles, theme, above=10.0)
    arena.draw_map(axes, environment, theme)
    cells = partition(robots, environment.region)
    hues = [theme.robots[k % len(theme.robots)] for k in range(len(robots))]
    fills = [tone(mix(theme.background, hue, theme.paper_tint)) for hue in hues]
    look: Any = {"facecolors": fills, "edgecolors": edge, "linewidths": 0.8, "zorder": 1}
    axes.add_collection(PolyCollection(list(cells.polygons), **look), autolim=False)
    axes.plot(*cells.centroid.T, zorder=8, clip_on=False, **dot)
    arena.draw_robots(axes, robots, first.team.radius, [theme.final] * len(robots), theme)
    return page.figure


@plain_style()
def side_by_side(
    records: Sequence[Record], heads: Iterable[tuple[str, str]], theme: Theme, unnamed: Sequence[str] = ()
) -> Figure:
    """Draw runs on one map side by side, title and final cost above; the legend leaves `unnamed` out."""
    handles = united((arena.run_handles(record, theme, "paper") for record in records), arena.label_of)
    handles = [handle for handle in handles if arena.label_of(handle) not in unnamed]
    page, places = panels(records[0].environment, len(records), WIDE, handles, theme, above=30.0)
    for letter, record, (title, final), axes in zip("abcdef", records, heads, places, strict=False):
        arena.draw_run(axes, record, theme, "paper")
        box = axes.get_position()
        left, right = box.x0 * page.size[0], box.x1 * page.size[0]
        top = (1.0 - box.y1) * page.size[1] - 14 * page.scale
        page.text(f"({letter})  {title}", left, top, points=TITLE, bold=True)
        page.text(final, right, top, points=SMALL, colour=theme.faint, align="right")
    return page.figure


@plain_style()
def cost_figure(runs: Sequence[FigureRun], theme: Theme = LIGHT) -> Figure:
    both = [(run.record, run.history) for run in runs]
    curves = [(run.label, run.controller, cost.time, cost.mean_distance) for run, cost in both]
    page = Page((WIDE, 1050), theme, DOTS)
    edge = 34 * page.scale
    longest = max(page.text_width(end_label(curve), bold=True) for curve in curves)
    box = (edge, edge, WIDE - 2 * edge - longest, 1050 - edge - 44 * page.scale)
    draw_curves(page.axes(box), curves, theme)
    return page.figure


def panels(
    environment: Environment, count: int, wide: int, handles: Sequence[Artist], theme: Theme, above: float
) -> tuple[Page, list[Axes]]:
    """Return a page of `wide` pixels with equal axes for one map in a row, its legend and scale bar."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    sketch = Page((wide, wide), theme, DOTS)
    inner, head = (wide - (count + 1) * sketch.margin) / count, above * DOTS
    high = inner / ((high_x - low_x) / (high_y - low_y))
    page = Page((wide, round(head + high + sketch.footer_height(handles))), theme, DOTS)
    boxes = [(page.margin + k * (inner + page.margin), head, inner, high) for k in range(count)]
    page.footer(handles, boxes, inner / (high_x - low_x))
    return page, [page.map_axes(box, low_x, low_y, high_x, high_y) for box in boxes]


def arrival(history: CostHistory) -> float:
    """Return from when on a cost stays within 5 % of its last value, s."""
    cost = history.mean_distance
    away = np.flatnonzero(np.abs(cost - cost[-1]) > ARRIVED * cost[-1])
    return float(history.time[away[-1] + 1]) if len(away) else float(history.time[0])


def _pair(runs: Mapping[str, FigureRun], number: int) -> tuple[FigureRun, FigureRun]:
    case = FIGURES[number]
    return runs[f"{case}/rapf"], runs[f"{case}/{'lloyd' if case == 'convex' else 'rpf'}"]


def _difference_text(mine: float, theirs: float) -> str:
    change = mine / theirs - 1.0
    if abs(change) < 0.0005:
        return "the same"
    return f"{amount(abs(change), '%')} {'less' if change < 0 else 'more'}"


def paper_plots(results: PaperResults, theme: Theme | str) -> Plots:
    convex, claims, theme = results.convex, results.claims, theme_named(theme)
    against_lloyd = [("at the end", convex.compared("rapf-shared", "lloyd"), "rapf")]
    for start in CLUSTERED:
        pairs = convex.from_starts(start).compared("rapf-shared", "lloyd", "early")
        against_lloyd.append((f"first 20 s, start {start}", pairs, "rapf"))
    nonconvex = []
    for what, other, measure in (
        ("RPF, at the end", "rpf-{}", "final"),
        ("RPF, first 60 s", "rpf-{}", "first_minute"),
        ("LA, at the end", "lloyd", "final"),
    ):
        for gains in ("shared", "best"):
            pairs = claims.compared(f"rapf-{gains}", other.format(gains), measure)
            nonconvex.append((f"{what}, {gains} gains", pairs, "rapf"))
    by_start = []
    for law in ("rapf-shared", "rpf-shared"):
        own = ((f"start {start}", claims.from_starts(start), law) for start in dict.fromkeys(claims.starts))
        by_start.append((LABELS[law], _samples(own)))
    gaps = [("", _samples((label, claims, law) for law, label in LABELS.items()))]
    known = all(grid.complete.scenarios for grid in results.gains.values())
    plots: dict[str, Draw | None] = {
        "claim-1-convex": _pairs_plot(against_lloyd, "RAPF by LA, pair by pair (1: equal)", theme),
        "claim-2-nonconvex": _pairs_plot(nonconvex, "RAPF by the other law, pair by pair (1: equal)", theme),
        "claim-3-gains": partial(gains_plot, results.gains, theme) if known else None,
        "claim-4-starts": _boxes_plot(by_start, theme),
        "claim-6-gap": _boxes_plot(gaps, theme),
    }
    return {name: draw for name, draw in plots.items() if draw is not None}


def beyond_plots(results: BeyondResults, theme: Theme | str) -> Plots:
    theme, outcomes, teams = theme_named(theme), results.outcomes, results.teams
    ours = OWN[0].key
    others = [law for row in ranked_rows(results) if (law := row.contender).key != ours]
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
    finals = (f"mean distance by φ {cost:.3f} m" for cost in results.density.costs)
    heads = list(zip(("knows φ", "ignores φ"), finals, strict=True))
    worse = [each for each in results.degradations if each.controller in DISTURBED and each.axis != IDEAL]
    known = any(np.isfinite(each.ratio.estimate) for each in worse)
    plots: dict[str, Draw | None] = {
        "beyond-gaps": partial(gaps_plot, samples, theme) if samples else None,
        "beyond-pairs": _pairs_plot(duels, "ours by the other's, pair by pair (1: equal)", theme),
        "beyond-heights": partial(plot_heights, size, theme, 0.68 * DOTS),
        "beyond-targets": _pairs_plot(targets, "by the centroid, pair by pair (1: equal)", theme),
        "beyond-density": partial(side_by_side, pictures, heads, theme),
        "beyond-teams": _pairs_plot(times, "mean time, by time to by distance (1: equal)", theme),
        "beyond-conditions": partial(plot_degradations, worse, theme) if known else None,
    }
    return {name: draw for name, draw in plots.items() if draw is not None}


def gap_samples(results: BeyondResults) -> list[Sample]:
    ranked = [row.contender for row in ranked_rows(results)]
    gaps = [100.0 * results.outcomes.measured("gap", law.key).of(law.key, "gap") for law in ranked]
    return [Sample(law.label, style_of(law.controller), gap) for law, gap in zip(ranked, gaps, strict=True)]


@plain_style()
def gains_plot(gains: Mapping[str, GainOutcomes], theme: Theme) -> Figure:
    """Draw the mean of J/J_ref - 1, in percent, over the gains of the repulsion: RPF, RAPF at each k_att."""
    rpf, rapf = gains["rpf"].complete, gains["rapf"].complete
    attracted = ((f"RAPF, k_att = {k:g}", rapf.with_gain("k_att", k)) for k in rapf.levels("k_att"))
    panels = [("RPF", rpf), *attracted]
    first, second = rpf.levels("k_rep"), rpf.levels("rho_0")
    columns = 3 if len(panels) > 4 else 2
    left, right, above, below = 44 * DOTS, 10 * DOTS, 52 * DOTS, 44 * DOTS
    width, height = WIDE / columns - left - right, len(second) * 24 * DOTS
    page = Page((WIDE, round(-(-len(panels) // columns) * (height + above + below))), theme, DOTS)
    for number, (name, part) in enumerate(panels):
        row, column = divmod(number, columns)
        x, y = left + column * (width + left + right), above + row * (height + above + below)
        values = np.full((len(second), len(first)), np.nan)
        for each, excess in zip(part.gains, part.excess, strict=True):
            at = second.index(float(each["rho_0"] or 0.0)), first.index(float(each["k_rep"] or 0.0))
            values[at] = 100.0 * (excess.mean() - 1.0)
        axes = page.axes((x, y, width, height))
        plot_gain_grid(axes, first, second, values, ("k_rep (N m³)", "rho_0 (m)"), theme)
        page.text(name, x - left / 2, y - 36 * DOTS, points=TITLE, bold=True)
    return page.figure


@plain_style()
def gaps_plot(samples: Sequence[Sample], theme: Theme) -> Figure:
    figure = plot_final_costs([("", samples)], "J/J_ref − 1 at the end (%)", WIDE, DOTS, theme)
    (axes,) = figure.axes
    values = np.concatenate([sample.values for sample in samples])
    low, high = min(float(values.min()), 0.0), float(values.max())

    def power(places: Array, exponent: float) -> Array:
        return np.asarray(np.sign(places) * np.abs(places) ** exponent)

    functions = partial(power, exponent=0.5), partial(power, exponent=2.0)
    axes.set_xscale("function", functions=functions)
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
        axes = page.axes((64 + column * width, 100 + row * height, width - 60, height - 84))
        axes.set_ylim(bottom - room, top + room)
        _panel(axes, name, [each for each in found if each.axis == name], theme)
    handles, labels = page.figure.axes[0].get_legend_handles_labels()
    place: Any = {"loc": "center right", "bbox_to_anchor": page.at(_SIZE[0] - page.margin, 26)}
    look: Any = {"frameon": False, "fontsize": SMALL, "labelcolor": tone(theme.ink)}
    page.figure.legend(handles, labels, ncols=len(handles), **place, **look)
    pairs = format_count(max(each.runs for each in found), "pair")
    words = f"medians of {pairs} of runs, and 95 % intervals; only robots that work count"
    page.text(words, page.margin, _SIZE[1] - 18, points=SMALL, colour=quiet)
    return page.figure


def _panel(axes: Axes, name: str, part: Sequence[Degradation], theme: Theme) -> None:
    values = list(dict.fromkeys(each.value for each in part))
    styles = curve_styles(each.controller for each in part)
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
    axes.set_title(f"{CAPTIONS[f'axis-{name}']}{unit}", fontsize=TEXT, color=tone(theme.ink), loc="left")
    axes.set_xticks(range(len(values)), ["no limit" if v is None else f"{v:g}" for v in values])
    axes.set_xlim(-0.4, len(values) - 0.6)
    quiet_axes(axes, theme, grid="y")


def style_of(controller: str) -> CurveStyle:
    """Return the style of a controller among many: ours stands out, baselines are alike."""
    style = curve_styles([controller])[controller]
    other = "other-0" if controller in OURS else "other-2"
    return style._replace(name=other) if style.name.startswith("other") else style


def _pairs_plot(rows: Iterable[tuple[str, Comparison | None, str]], label: str, theme: Theme) -> Draw | None:
    """Return how pairs are drawn: words, comparison, and the controller that the style is of."""
    pairs = [Pairs(words, style_of(law), each.ratios, each.ratio) for words, each, law in rows if each]

    def draw() -> Figure:
        figure = plot_paired(pairs, label, WIDE, DOTS, theme)
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
    each = [(words, law, outcomes.measured("gap", law).of(law, "gap") + 1.0) for words, outcomes, law in rows]
    known = [(words, law.partition("-")[0], values) for words, law, values in each if len(values)]
    styles = styles_of([controller for _, controller, _ in known])
    return [Sample(words, style, values) for (words, _, values), style in zip(known, styles, strict=True)]


def _boxes_plot(rows: Iterable[tuple[str, Sequence[Sample]]], theme: Theme) -> Draw | None:
    there = [row for row in rows if row[1]]
    label = "J/J_ref at the end (1: the centralised reference)"
    return partial(plot_final_costs, there, label, WIDE, DOTS, theme, origin=1.0) if there else None


class AtHeight(NamedTuple):
    """The best place, m, for a sensor at a height, m (equation 14); `missed`: over the centroid."""

    height: float
    x: float
    y: float
    from_centroid: float
    missed: float


def best_at_heights(heights: Sequence[float]) -> list[AtHeight]:
    """Return the best places over the cell at ascending heights, m, and in the limits 0, inf."""
    cell = _cell()
    size, (centroid,) = float(np.sqrt(cell.mass[0])), cell.centroid
    rows = []
    for height in (0.0, *heights, np.inf):
        place, missed = centroid, float("nan")
        if height < np.inf:
            place = find_best_points(cell, Sensing(height or _LIMIT * size))[0]
            if height > 0.0:
                offsets = np.array([place, centroid])[:, None] - cell.generators
                best, plain = (
                    compute_locational_costs(cell.edges, each, Sensing(height))[0] for each in offsets
                )
                missed = float(1.0 - plain / best)
        x, y = place.tolist()
        rows.append(AtHeight(height, x, y, float(np.hypot(*(place - centroid))), missed))
    return rows


@plain_style()
def plot_heights(size: tuple[int, int], theme: Theme, scale: float) -> Figure:
    """Plot the path of the optimum of f = 1/(r²+h²) over a cell, from h → 0 to the centroid for h → ∞."""
    cell = _cell()
    path = best_at_heights(np.geomspace(_LOW, _HIGH, 240).tolist())
    marked = _apart(best_at_heights([n * 10.0**k for k in (-1, 0, 1) for n in (1, 2, 3, 5)]))
    median = find_best_points(cell, Distance())[0]
    page = Page(size, theme, scale)
    wide, high = size
    top, bottom = 44 * scale, 46 * scale
    tall, begin = high - top - bottom, page.margin + 26 * scale
    room = wide - page.margin - begin
    left, middle, right = (
        page.axes((begin + part * room, top, share * room, tall))
        for part, share in ((0.0, 0.30), (0.37, 0.26), (0.68, 0.32))
    )
    heads = "the cell (m)", "the frame in it (m)", "from the optimum to the centroid (mm)"
    for part, words in zip((0.0, 0.37, 0.68), heads, strict=True):
        page.text(words, begin + part * room, top - 16 * scale)
    window = _window(np.array([[row.x, row.y] for row in path] + [median]), 0.26 * room / tall)
    fill, edge = tone(mix(theme.background, theme.robots[1], theme.tint)), tone(theme.boundary)
    left.add_patch(Polygon(cell.polygons[0], facecolor=fill, edgecolor=edge, linewidth=1.6))
    x, y, width, height = window
    left.add_patch(Rectangle((x, y), width, height, fill=False, edgecolor=tone(theme.ink), linewidth=1.2))
    left.set_aspect("equal")
    left.margins(0.02)
    left.autoscale_view()
    _plain(left, theme)
    for axis in (left.xaxis, left.yaxis):
        axis.set_major_locator(MaxNLocator(6, integer=True))
    _draw_path(middle, path, marked, median, window, theme)
    for part in (0.0, 1.0):
        ray: Any = {"xyA": (x + width, y + part * height), "xyB": (0.0, part)}
        ray |= {"coordsA": left.transData, "coordsB": middle.transAxes, "color": tone(theme.faint)}
        page.figure.add_artist(ConnectionPatch(**ray, linewidth=0.8))
    _draw_distance(right, path, marked, theme)
    return page.figure


def _apart(rows: Sequence[AtHeight]) -> list[AtHeight]:
    """Return the limits, and what is far enough from them and from each other to have words beside it."""
    first, *inner, last = rows
    least = _APART * first.from_centroid
    kept = [first]
    for row in inner:
        if row.from_centroid >= least and kept[-1].from_centroid - row.from_centroid >= least:
            kept.append(row)
    return [*kept, last]


def _cell() -> VoronoiPartition:
    region = Region(np.array(PENTAGON))
    return partition(region.centroid[None], region)


def _window(points: Array, aspect: float) -> Box:
    """Return x, y, width and height of what is enlarged: all points, with room for words at the right."""
    low, high = points.min(axis=0), points.max(axis=0)
    width, height = (high - low) * (1.9, 1.3)
    width, height = max(width, height * aspect), max(height, width / aspect)
    return float(low[0] - 0.2 * width), float((low[1] + high[1] - height) / 2.0), float(width), float(height)


def _draw_path(
    axes: Axes, path: Sequence[AtHeight], marked: Sequence[AtHeight], median: Array, window: Box, theme: Theme
) -> None:
    line, faint = tone(theme.final), tone(theme.faint)
    axes.plot([row.x for row in path], [row.y for row in path], color=line, linewidth=2.4, zorder=2)
    for row in marked[1:-1]:
        axes.plot(row.x, row.y, "o", color=line, markersize=5.5, markeredgewidth=0.0, zorder=3)
    ends: list[tuple[AtHeight, str, Any]] = [
        (marked[0], "h → 0", {"marker": "o", "markerfacecolor": tone(theme.background)}),
        (marked[-1], "h → ∞: the centroid", {"marker": "P", "markerfacecolor": line}),
    ]
    for row, _, look in ends:
        axes.plot(row.x, row.y, markersize=9.5, markeredgecolor=line, markeredgewidth=1.8, zorder=4, **look)
    beside: Any = {"textcoords": "offset points", "va": "center", "fontsize": SMALL}
    words = [(row, f"h = {row.height:g} m") for row in marked[1:-1]] + [(row, text) for row, text, _ in ends]
    for row, text in words:
        axes.annotate(text, (row.x, row.y), (11, -1), color=tone(theme.ink), zorder=5, **beside)
    x, y = median.tolist()
    axes.plot(x, y, "D", color=faint, markersize=6.0, zorder=3)
    axes.annotate("median\n(f = r)", (x, y), (-9, 0), ha="right", color=faint, **beside)
    x, y, width, height = window
    axes.set(xlim=(x, x + width), ylim=(y, y + height), aspect="equal")
    _plain(axes, theme)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(4, prune="both"))
    for side in axes.spines.values():
        side.set(visible=True, color=tone(theme.ink), linewidth=1.2)


def _draw_distance(axes: Axes, path: Sequence[AtHeight], marked: Sequence[AtHeight], theme: Theme) -> None:
    line, highest = tone(theme.final), 1e3 * path[0].from_centroid
    inner = path[1:-1]
    axes.axhline(highest, color=tone(theme.faint), linewidth=1.0, linestyle=(0, (4, 3)))
    style: Any = {"marker": "o", "linestyle": "none", "markersize": 5.5, "markeredgewidth": 0.0}
    for rows, look in ((inner, {"linewidth": 2.4}), (marked[1:-1], style)):
        axes.plot([row.height for row in rows], [1e3 * row.from_centroid for row in rows], color=line, **look)
    axes.set(xscale="log", xlim=(inner[0].height, inner[-1].height), ylim=(0.0, 1.12 * highest))
    axes.xaxis.set_major_formatter("{x:g}")
    _plain(axes, theme, "height h (m)", grid="y")
    worst = max(inner, key=lambda row: row.missed)
    style = {"fontsize": SMALL, "color": tone(theme.ink), "ha": "left", "va": "bottom"}
    style |= {"bbox": {"facecolor": tone(theme.background), "edgecolor": "none", "pad": 2.0}}
    words = f"A sensor over the centroid misses\nat most {100.0 * worst.missed:.2g} % of what it could\n"
    words += f"tell, at h = {worst.height:.2g} m."
    axes.annotate(words, (0.04, 0.07), xycoords="axes fraction", **style)


def _plain(axes: Axes, theme: Theme, x: str = "", grid: Literal["y", ""] = "") -> None:
    quiet_axes(axes, theme, x, grid=grid)
    axes.tick_params(length=3.0, left=True)
    axes.minorticks_off()
