"""The paper's figures 1 to 8 on environments of the same kinds, ready for print, and what they show in words.

Starts are green, final positions blue, trajectories red; RAPF's cost is blue, RPF's red, as in the paper.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from robocov.environment import Environment
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.voronoi import partition
from robocov_app.figures import arena
from robocov_app.figures.curves import draw_curves, end_label
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL, TITLE, Page, tone
from robocov_app.render.layout import united
from robocov_app.render.scene import CENTROID, GOAL
from robocov_app.render.theme import LIGHT, Theme, mix, theme_named
from robocov_app.replication.claims import amount
from robocov_app.replication.outcomes import FIRST_MINUTE, matched_distance, mean_until
from robocov_app.replication.results import FigureRun

DOTS = 3.0  # scale of the pages: 300 dots an inch
WIDE, NARROW = 2148, 1050  # pixels of two columns of a journal (7.16 inches) and of one (3.5 inches)
HIDDEN = 0.25  # m from its centroid within which a robot's disc hides it, on a map of ten metres
ARRIVED = 0.05  # a cost has arrived when it stays within 5 % of its last value

# the paper's figures, in its order: the case of each, and what is to be seen
FIGURES = {
    1: (
        "partition",
        "A Voronoi partition of a convex region: robots in blue, the centres of mass of their cells as dots.",
    ),
    2: ("convex", "A convex region without obstacles: (a) RAPF, (b) LA."),
    3: ("convex", "The cost of both against time."),
    4: ("a", "A first non-convex environment: (a) RAPF, (b) RPF, from the same starts."),
    5: ("a", "The cost of both against time."),
    6: ("b", "A second non-convex environment, the same starts as in figure 4: (a) RAPF, (b) RPF."),
    7: ("b", "The cost of both against time."),
    8: ("other", "The second environment again, from other starts: (a) RAPF, (b) RPF."),
}
COSTS = (3, 5, 7)  # figures of the cost against time; all but the first of the others show trajectories


def draw_figure(number: int, runs: Mapping[str, FigureRun], first: Record, theme: Theme | str) -> Figure:
    """Draw a figure of the paper: of `runs` by "case/controller", figure 1 the first moment of `first`."""
    theme = theme_named(theme)
    if number == 1:
        return partition_figure(first, theme)
    pair = _pair(runs, number)
    return cost_figure(pair, theme) if number in COSTS else trajectories_figure(pair, theme)


def describe_figure(number: int, runs: Mapping[str, FigureRun], first: Record) -> str:
    """Return what a figure shows here, in words with numbers; parameters as for `draw_figure`."""
    if number == 1:
        places = first.positions[0]
        away = np.hypot(*(partition(places, first.environment.region).centroid - places).T)
        return (
            f"The robots stand anywhere in “{first.environment.name}”, on average "
            f"{amount(float(away.mean()), 'm')} from the centres of mass of their cells."
        )
    ours, other = pair = _pair(runs, number)
    label, costs = other.record.label, [run.history.mean_distance for run in pair]
    if number in COSTS:
        early, shared = [mean_until(run.history, FIRST_MINUTE) for run in pair], min(map(len, costs))
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
        moved = [matched_distance(ends[f"b/{law}"], ends[f"other/{law}"]) for law in ("rapf", "rpf")]
        words += (
            f" Between the ends of figure 6 and these, robots are {amount(moved[0], 'm')} apart with RAPF "
            f"and {amount(moved[1], 'm')} with RPF (matched with the least sum of distances)."
        )
    return words


@plain_style()
def partition_figure(first: Record, theme: Theme = LIGHT) -> Figure:
    """Draw the Voronoi partition of a run's first moment with robots and centroids (figure 1)."""
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


def trajectories_figure(runs: Sequence[FigureRun], theme: Theme = LIGHT) -> Figure:
    """Draw runs on one map side by side: (a), (b), ... (figures 2, 4, 6, 8)."""
    hidden = all(
        (np.hypot(*(run.record.goals[-1] - run.record.positions[-1]).T) < HIDDEN).all()
        for run in runs
        if arena.has_goals(run.record)
    )
    records = [run.record for run in runs]
    finals = [f"mean distance {run.history.mean_distance[-1]:.3f} m" for run in runs]
    unnamed = (CENTROID, GOAL) if hidden else ()
    return side_by_side(records, [each.label for each in records], finals, theme, unnamed)


@plain_style()
def side_by_side(
    records: Sequence[Record],
    titles: Sequence[str],
    finals: Sequence[str],
    theme: Theme,
    unnamed: Sequence[str] = (),
) -> Figure:
    """Draw runs on one map side by side, titles and final costs above; the legend leaves `unnamed` out."""
    handles = united((arena.run_handles(record, theme, "paper") for record in records), arena.label_of)
    handles = [handle for handle in handles if arena.label_of(handle) not in unnamed]
    page, places = panels(records[0].environment, len(records), WIDE, handles, theme, above=30.0)
    each = zip("abcdef", records, titles, finals, places, strict=False)
    for letter, record, title, final, axes in each:
        arena.draw_run(axes, record, theme, "paper")
        box = axes.get_position()
        left, right = box.x0 * page.size[0], box.x1 * page.size[0]
        top = (1.0 - box.y1) * page.size[1] - 14 * page.scale
        page.text(f"({letter})  {title}", left, top, points=TITLE, bold=True)
        page.text(final, right, top, points=SMALL, colour=theme.faint, align="right")
    return page.figure


@plain_style()
def cost_figure(runs: Sequence[FigureRun], theme: Theme = LIGHT) -> Figure:
    """Draw the cost of runs against time (figures 3, 5, 7)."""
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
    case, _ = FIGURES[number]
    return runs[f"{case}/rapf"], runs[f"{case}/{'lloyd' if case == 'convex' else 'rpf'}"]


def _difference_text(mine: float, theirs: float) -> str:
    change = mine / theirs - 1.0
    if abs(change) < 0.0005:
        return "the same"
    return f"{amount(abs(change), '%')} {'less' if change < 0 else 'more'}"
