"""The paper's figures 1 to 8 on environments of the same kinds, ready for print, and what they show in words.

Seven inches wide (two columns of a journal) at 300 dots an inch, texts in the sizes they are read at.
Starts are green, final positions blue, trajectories red; RAPF's cost is blue, RPF's red, as in the paper.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov.environment import Environment
from robocov.metrics import CostHistory
from robocov.record import Record
from robocov.voronoi import partition
from robocov_app.figures.arena import (
    draw_map,
    draw_robots,
    draw_run,
    has_goals,
    label_of,
    map_handles,
    robot_handle,
    run_handles,
)
from robocov_app.figures.curves import draw_curves, end_label
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL, TITLE, Page, tone
from robocov_app.render.layout import united
from robocov_app.render.scene import CENTROID, GOAL
from robocov_app.render.theme import LIGHT, Theme, mix, theme_named
from robocov_app.replication.outcomes import FIRST_MINUTE, matched_distance, mean_until
from robocov_app.replication.results import FigureRun
from robocov_app.replication.verdicts import amount

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOTS = 3.0
"""Scale of the pages: 300 dots an inch."""

WIDE, NARROW = 2148, 1050
"""Pixels of two columns of a journal (7.16 inches) and of one (3.5 inches)."""

HIDDEN = 0.25
"""Metres from its centroid within which a robot's disc hides it, on a map of ten metres."""

ARRIVED = 0.05
"""A cost has arrived when it stays within 5 % of its last value."""


class PaperFigure(NamedTuple):
    """A figure: the case that it shows, what is to be seen, and what the paper claims of it."""

    number: int
    case: str
    shows: str
    claim: str


FIGURES = (
    PaperFigure(
        1,
        "partition",
        "A Voronoi partition of a convex region: robots in blue, the centres of mass of their cells as dots.",
        "Lloyd's algorithm moves every robot towards the centre of mass of its cell, until they coincide.",
    ),
    PaperFigure(
        2,
        "convex",
        "A convex region without obstacles: (a) RAPF, (b) LA.",
        "The trajectories are quite different, the final configurations equally good.",
    ),
    PaperFigure(
        3,
        "convex",
        "The cost of both against time.",
        "“The two cost functions are almost identical”: in convex environments RAPF's gain is negligible.",
    ),
    PaperFigure(
        4,
        "a",
        "A first non-convex environment: (a) RAPF, (b) RPF, from the same starts.",
        "RAPF's robots spread over the whole region, RPF's come to rest in a local minimum.",
    ),
    PaperFigure(
        5,
        "a",
        "The cost of both against time.",
        "RAPF “not only improves the performance of the steady state, but also the performance during the "
        "robots motion”.",
    ),
    PaperFigure(
        6,
        "b",
        "A second non-convex environment, the same starts as in figure 4: (a) RAPF, (b) RPF.",
        "As in figure 4, with the same potential parameters: RAPF needs no others for another environment.",
    ),
    PaperFigure(7, "b", "The cost of both against time.", "As in figure 5."),
    PaperFigure(
        8,
        "other",
        "The second environment again, from other starts: (a) RAPF, (b) RPF.",
        "RAPF's “final placement does not vary a lot with the initial conditions”, RPF's “is strongly "
        "dependent”: compare with figure 6.",
    ),
)
"""The paper's figures, in its order."""

COSTS = (3, 5, 7)
"""Figures of the cost against time; all but the first of the others show trajectories."""


def draw_figure(number: int, runs: Mapping[str, FigureRun], first: Record, theme: Theme | str) -> Figure:
    """Draw one of the paper's figures 1 to 8.

    `runs` are ``convex/rapf``, ``convex/lloyd``, and of ``a``, ``b`` and ``other`` those of ``rapf`` and
    ``rpf``; the first moment of `first` is figure 1.
    """
    theme = theme_named(theme)
    if number == 1:
        return partition_figure(first, theme)
    pair = _pair(runs, FIGURES[number - 1].case)
    return cost_figure(pair, theme) if number in COSTS else trajectories_figure(pair, theme)


def describe_figure(number: int, runs: Mapping[str, FigureRun], first: Record) -> str:
    """Return what a figure shows here, in words with numbers; parameters as for `draw_figure`."""
    if number == 1:
        return _partition_text(first)
    pair = _pair(runs, FIGURES[number - 1].case)
    if number in COSTS:
        return _motion_text(*pair)
    return f"{_ends_text(*pair)} {_moved_text(runs)}" if number == 8 else _ends_text(*pair)


def partition_figure(first: Record, theme: Theme = LIGHT) -> Figure:
    """Draw the Voronoi partition of a run's first moment with robots and centroids (figure 1)."""
    from matplotlib.collections import PolyCollection
    from matplotlib.lines import Line2D

    environment, robots = first.environment, first.positions[0]
    with plain_style():
        centroid = Line2D(
            [],
            [],
            linestyle="none",
            marker="o",
            markersize=4.0,
            color=tone(theme.ink),
            label="centre of mass of its cell",
        )
        handles: list[Artist] = [
            robot_handle("robot", theme.final, theme),
            centroid,
            Line2D([], [], color=tone(theme.cell_edge), linewidth=0.9, label="Voronoi cell"),
            *map_handles(environment, theme)[1:],
        ]
        page, (axes,) = panels(environment, 1, NARROW, handles, theme, above=10.0)
        draw_map(axes, environment, theme)
        cells = partition(robots, environment.region)
        axes.add_collection(
            PolyCollection(
                list(cells.polygons),
                facecolors=[
                    tone(mix(theme.background, theme.robots[k % len(theme.robots)], theme.paper_tint))
                    for k in range(len(robots))
                ],
                edgecolors=tone(theme.cell_edge),
                linewidths=0.8,
                zorder=1,
            ),
            autolim=False,
        )
        axes.plot(*cells.centroid.T, "o", markersize=4.0, color=tone(theme.ink), zorder=8, clip_on=False)
        draw_robots(axes, robots, first.team.radius, [theme.final] * len(robots), theme)
        return page.figure


def trajectories_figure(runs: Sequence[FigureRun], theme: Theme = LIGHT) -> Figure:
    """Draw runs on one map side by side: (a), (b), ... (figures 2, 4, 6, 8)."""
    hidden = all(
        (np.hypot(*(run.record.goals[-1] - run.record.positions[-1]).T) < HIDDEN).all()
        for run in runs
        if has_goals(run.record)
    )
    return side_by_side(
        [run.record for run in runs],
        [run.record.label for run in runs],
        [f"mean distance {run.history.mean_distance[-1]:.3f} m" for run in runs],
        theme,
        unnamed=(CENTROID, GOAL) if hidden else (),
    )


def side_by_side(
    records: Sequence[Record],
    titles: Sequence[str],
    finals: Sequence[str],
    theme: Theme,
    unnamed: Sequence[str] = (),
) -> Figure:
    """Draw runs on one map side by side, each with its title and its final cost above.

    Entries of the legend that are `unnamed` are left out.
    """
    with plain_style():
        handles = united((run_handles(record, theme, "paper") for record in records), label_of)
        handles = [handle for handle in handles if label_of(handle) not in unnamed]
        page, places = panels(records[0].environment, len(records), WIDE, handles, theme, above=30.0)
        for letter, record, title, final, axes in zip(
            "abcdef", records, titles, finals, places, strict=False
        ):
            draw_run(axes, record, theme, "paper")
            box = axes.get_position()
            left, right = box.x0 * page.size[0], box.x1 * page.size[0]
            top = (1.0 - box.y1) * page.size[1] - 14 * page.scale
            page.text(f"({letter})  {title}", left, top, points=TITLE, bold=True)
            page.text(final, right, top, points=SMALL, colour=theme.faint, align="right")
        return page.figure


def cost_figure(runs: Sequence[FigureRun], theme: Theme = LIGHT) -> Figure:
    """Draw the cost of runs against time (figures 3, 5, 7)."""
    with plain_style():
        curves = [
            (shown.record.label, shown.record.controller, shown.history.time, shown.history.mean_distance)
            for shown in runs
        ]
        page = Page((WIDE, 1050), theme, DOTS)
        s = page.scale
        longest = max(page.text_width(end_label(curve), bold=True) for curve in curves)
        box = (34 * s, 34 * s, WIDE - 34 * s - 34 * s - longest, 1050 - 34 * s - 44 * s)
        draw_curves(page.axes(box), curves, theme)
        return page.figure


def panels(
    environment: Environment, count: int, wide: int, handles: Sequence[Artist], theme: Theme, above: float
) -> tuple[Page, list[Axes]]:
    """Return a page of `wide` pixels with equal axes for one map in a row, its legend and scale bar."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    aspect = (high_x - low_x) / (high_y - low_y)
    sketch = Page((wide, wide), theme, DOTS)
    inner = (wide - (count + 1) * sketch.margin) / count
    head = above * DOTS
    tall = round(head + inner / aspect + sketch.footer_height(handles))
    page = Page((wide, tall), theme, DOTS)
    found = []
    for k in range(count):
        axes = page.axes((page.margin + k * (inner + page.margin), head, inner, inner / aspect))
        axes.set_xlim(low_x, high_x)
        axes.set_ylim(low_y, high_y)
        axes.set_axis_off()
        found.append(axes)
    bottom = head + inner / aspect
    page.footer(handles, page.margin, wide - page.margin, bottom, inner / (high_x - low_x))
    return page, found


def arrival(history: CostHistory) -> float:
    """Return from when on a cost stays within 5 % of its last value, s."""
    cost = history.mean_distance
    away = np.flatnonzero(np.abs(cost - cost[-1]) > ARRIVED * cost[-1])
    return float(history.time[away[-1] + 1]) if len(away) else float(history.time[0])


def _pair(runs: Mapping[str, FigureRun], case: str) -> tuple[FigureRun, FigureRun]:
    return runs[f"{case}/rapf"], runs[f"{case}/{'lloyd' if case == 'convex' else 'rpf'}"]


def _partition_text(first: Record) -> str:
    places = first.positions[0]
    centres = partition(places, first.environment.region).centroid
    away = np.hypot(*(centres - places).T)
    return (
        f"The robots stand anywhere in “{first.environment.name}”, on average "
        f"{amount(float(away.mean()), 'm')} from the centres of mass of their cells."
    )


def _ends_text(ours: FigureRun, other: FigureRun) -> str:
    mine, theirs = (float(each.history.mean_distance[-1]) for each in (ours, other))
    return (
        f"On “{ours.record.environment.name}” RAPF ends with a mean distance of {mine:.3f} m, "
        f"{other.record.label} with {theirs:.3f} m: {_difference_text(mine, theirs)}."
    )


def _motion_text(ours: FigureRun, other: FigureRun) -> str:
    early = [mean_until(each.history, FIRST_MINUTE) for each in (ours, other)]
    shared = min(len(ours.history.time), len(other.history.time))
    below = ours.history.mean_distance[1:shared] < other.history.mean_distance[1:shared]
    return (
        f"Averaged over the first {FIRST_MINUTE:g} s RAPF has {early[0]:.3f} m, {other.record.label} "
        f"{early[1]:.3f} m: {_difference_text(*early)}. RAPF's is the lower one "
        f"{amount(float(below.mean()), '%')} of the time. RAPF stays within 5 % of its last value from "
        f"{arrival(ours.history):.0f} s on, {other.record.label} from {arrival(other.history):.0f} s on."
    )


def _moved_text(runs: Mapping[str, FigureRun]) -> str:
    apart = [
        matched_distance(runs[f"b/{law}"].record.positions[-1], runs[f"other/{law}"].record.positions[-1])
        for law in ("rapf", "rpf")
    ]
    return (
        f"Between the ends of figure 6 and these, robots are {amount(apart[0], 'm')} apart with RAPF and "
        f"{amount(apart[1], 'm')} with RPF (matched with the least sum of distances)."
    )


def _difference_text(mine: float, theirs: float) -> str:
    change = mine / theirs - 1.0
    if abs(change) < 0.0005:
        return "the same"
    return f"{amount(abs(change), '%')} {'less' if change < 0 else 'more'}"
