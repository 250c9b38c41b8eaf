"""The paper's figures 1 to 8 on environments of the same kinds, ready for print.

Seven inches wide (two columns of a journal) at 300 dots an inch, texts in the sizes they are read at.
Starts are green, final positions blue, trajectories red; RAPF's cost is blue, RPF's red, as in the paper.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import ParameterError
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

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from robocov.arrays import Array
    from robocov.environment import Environment
    from robocov.metrics import CostHistory
    from robocov.record import Record

DOTS = 3.0
"""Scale of the pages: 300 dots an inch."""

WIDE, NARROW = 2148, 1050
"""Pixels of two columns of a journal (7.16 inches) and of one (3.5 inches)."""

ARRIVED = 0.25
"""Metres from its centroid within which a robot's disc hides it, on a map of ten metres."""

NUMBERS = (1, 2, 3, 4, 5, 6, 7, 8)
"""The paper's figures."""


@dataclass(frozen=True, eq=False)
class Shown:
    """A run that a figure shows.

    Attributes
    ----------
    record : Record
    history : CostHistory
    """

    record: Record
    history: CostHistory


@dataclass(frozen=True)
class FigureText:
    """What is said of a figure.

    Attributes
    ----------
    number : int
    shows : str
        What is to be seen in the paper's figure, and on what environment here.
    claim : str
        What the paper claims of it.
    """

    number: int
    shows: str
    claim: str


TEXTS = (
    FigureText(
        1,
        "A Voronoi partition of a convex region: robots in blue, the centres of mass of their cells as dots.",
        "Lloyd's algorithm moves every robot towards the centre of mass of its cell, until they coincide.",
    ),
    FigureText(
        2,
        "A convex region without obstacles: (a) RAPF, (b) LA.",
        "The trajectories are quite different, the final configurations equally good.",
    ),
    FigureText(
        3,
        "The cost of both against time.",
        "“The two cost functions are almost identical”: in convex environments RAPF's gain is negligible.",
    ),
    FigureText(
        4,
        "A first non-convex environment: (a) RAPF, (b) RPF, from the same starts.",
        "RAPF's robots spread over the whole region, RPF's come to rest in a local minimum.",
    ),
    FigureText(
        5,
        "The cost of both against time.",
        "RAPF “not only improves the performance of the steady state, but also the performance during the "
        "robots motion”.",
    ),
    FigureText(
        6,
        "A second non-convex environment, the same starts as in figure 4: (a) RAPF, (b) RPF.",
        "As in figure 4, with the same potential parameters: RAPF needs no others for another environment.",
    ),
    FigureText(7, "The cost of both against time.", "As in figure 5."),
    FigureText(
        8,
        "The second environment again, from other starts: (a) RAPF, (b) RPF.",
        "RAPF's “final placement does not vary a lot with the initial conditions”, RPF's “is strongly "
        "dependent”: compare with figure 6.",
    ),
)
"""What is said of every figure, in the paper's order."""


def draw_figure(number: int, runs: Mapping[str, Shown], partition: Record, theme: Theme | str) -> Figure:
    """Draw one of the paper's figures.

    Parameters
    ----------
    number : int
        1 to 8.
    runs : dict of name to Shown
        ``convex/rapf``, ``convex/lloyd``, ``a/rapf``, ``a/rpf``, ``b/rapf``, ``b/rpf``, ``other/rapf`` and
        ``other/rpf``.
    partition : Record
        Whose first moment is figure 1.
    theme : Theme or {"light", "dark"}

    Raises
    ------
    ParameterError
        When there is no figure of that number.
    """
    theme = theme_named(theme)
    if number == 1:
        return partition_figure(partition.environment, partition.positions[0], partition.team.radius, theme)
    pairs = {2: "convex", 3: "convex", 4: "a", 5: "a", 6: "b", 7: "b", 8: "other"}
    if number not in pairs:
        raise ParameterError(f"figure: {number}, but a number from 1 to 8 was wanted")
    case = pairs[number]
    shown = [runs[f"{case}/rapf"], runs[f"{case}/{'lloyd' if case == 'convex' else 'rpf'}"]]
    return cost_figure(shown, theme) if number in (3, 5, 7) else trajectories_figure(shown, theme)


def partition_figure(environment: Environment, robots: Array, radius: Array, theme: Theme = LIGHT) -> Figure:
    """Draw a Voronoi partition with robots and centroids (figure 1).

    Parameters
    ----------
    environment : Environment
    robots : (n, 2) m
    radius : (n,) m
    theme : Theme
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.lines import Line2D

    from robocov.voronoi import partition

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
        draw_robots(axes, robots, radius, [theme.final] * len(robots), theme)
        return page.figure


def trajectories_figure(runs: Sequence[Shown], theme: Theme = LIGHT) -> Figure:
    """Draw runs on one map side by side: (a), (b), ... (figures 2, 4, 6, 8)."""
    with plain_style():
        records = [shown.record for shown in runs]
        handles = united((run_handles(record, theme, "paper") for record in records), label_of)
        page, places = panels(
            records[0].environment, len(runs), WIDE, _worth_naming(handles, runs), theme, above=30.0
        )
        for letter, shown, axes in zip("abcdef", runs, places, strict=False):
            draw_run(axes, shown.record, theme, "paper")
            box = axes.get_position()
            left, top = box.x0 * page.size[0], (1.0 - box.y1) * page.size[1] - 14 * page.scale
            page.text(f"({letter})  {shown.record.label}", left, top, points=TITLE, bold=True)
            final = f"mean distance {shown.history.mean_distance[-1]:.3f} m"
            right = box.x1 * page.size[0]
            page.text(final, right, top, points=SMALL, colour=theme.faint, align="right")
        return page.figure


def cost_figure(runs: Sequence[Shown], theme: Theme = LIGHT) -> Figure:
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


def _worth_naming(handles: Sequence[Artist], runs: Sequence[Shown]) -> list[Artist]:
    """Return the legend's entries without that of centroids or goals, where robots hide them all."""
    hidden = all(
        (np.hypot(*(shown.record.goals[-1] - shown.record.positions[-1]).T) < ARRIVED).all()
        for shown in runs
        if has_goals(shown.record)
    )
    return [handle for handle in handles if not (hidden and label_of(handle) in (CENTROID, GOAL))]
