"""The ratios of a benchmark as a figure: curves over the lattice for the cost, a dot each for the rest."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, cast

import numpy as np

from robocov_app.plots.page import HEADING, SMALL, TEXT, Page, plain_style, tone
from robocov_app.plots.runs import save_figure
from robocov_app.view.theme import LIGHT, Theme

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

    from robocov_app.bench.measure import Row

WIDTH = 1100

ABOVE, PANEL, ROW, LEFT, RIGHT = 92, 270, 26, 400, 90
"""Pixels: for the title, for a panel of the cost, for a line, for its words, for its value."""

GAP = 66
"""Pixels between what belongs to one part and the next, for its heading."""

HEADINGS = {"step": "Simulated step", "render": "Pictures", "window": "Window", "start": "Start"}

MARKS = ("o", "s", "^", "D")


def save_ratios(rows: Sequence[Row], path: Path, theme: Theme = LIGHT) -> None:
    """Draw every ratio and every goal on logarithmic axes, and write them as PNG, SVG or PDF.

    Raises
    ------
    OutputError, ParameterError
        As `save_figure`.
    """
    rows = [row for row in rows if row.ratio is not None]
    cost = [row for row in rows if row.part == "cost"]
    parts = [(part, list(group)) for part, group in groupby(rows, key=lambda row: row.part) if part != "cost"]
    below = sum(GAP + ROW * len(group) + 16 for _, group in parts)
    height = ABOVE + (GAP + PANEL + 76 if cost else 0) + below
    with plain_style():
        page = Page((WIDTH, height), theme, scale=1.0)
        page.text("Time as a multiple of the yardstick's", 24, 30, points=HEADING, bold=True)
        note = (
            "medians of calls in turn on one thread; below 1 robocov is quicker; a bar marks what is wanted"
        )
        page.text(note, 24, 58, colour=theme.faint)
        top = float(ABOVE)
        if cost:
            _draw_cost(page, cost, top)
            top += GAP + PANEL + 76
        for part, group in parts:
            _draw_part(page, HEADINGS[part], group, top)
            top += GAP + ROW * len(group) + 16
    save_figure(page.figure, path)


def _draw_cost(page: Page, rows: Sequence[Row], top: float) -> None:
    """Draw a panel for each number of vertices, in each a curve for each number of robots."""
    theme = page.theme
    page.text(f"Exact coverage cost / {rows[0].yardstick}", 24, top + 16, points=TEXT + 1.5, bold=True)
    vertices = sorted({_number(row, "vertices") for row in rows})
    robots = sorted({_number(row, "robots") for row in rows})
    lattices = sorted({_number(row, "lattice") for row in rows})
    ratios = np.array([cast("float", row.ratio) for row in rows] + [row.goal for row in rows if row.goal])
    low, high = 0.8 * ratios.min(), 1.25 * ratios.max()
    slot = (WIDTH - 68 - 24) / len(vertices)
    handles: list[Line2D] = []
    for number, many in enumerate(vertices):
        axes = page.axes((68 + number * slot, top + GAP, slot - 24, PANEL))
        _plain(axes, theme)
        axes.set_xscale("log", base=2)
        axes.set_yscale("log")
        axes.axhline(1.0, color=tone(theme.faint), linewidth=1)
        handles = []
        for hue, n in enumerate(robots):
            some = [row for row in rows if (_number(row, "vertices"), _number(row, "robots")) == (many, n)]
            colour = tone(theme.trail(hue + 2))
            x = [_number(row, "lattice") for row in some]
            y = [cast("float", row.ratio) for row in some]
            (line,) = axes.plot(
                x, y, MARKS[hue % len(MARKS)] + "-", color=colour, markersize=5, linewidth=1.6
            )
            line.set_label(f"{n} robots")
            handles.append(line)
            for row in some:
                if row.goal is not None:
                    place = _number(row, "lattice")
                    axes.plot(
                        [place / 1.12, place * 1.12], [row.goal] * 2, color=colour, linewidth=3.5, alpha=0.5
                    )
        axes.set_xlim(lattices[0] / 1.25, lattices[-1] * 1.25)
        axes.set_ylim(low, high)
        axes.set_xticks(lattices, [f"{n} x {n}" for n in lattices], fontsize=SMALL)
        ticks = _ticks(low, high)
        axes.set_yticks(
            ticks, [f"{tick:g}" for tick in ticks] if not number else [""] * len(ticks), fontsize=SMALL
        )
        axes.minorticks_off()
        axes.set_title(f"{many} vertices", fontsize=TEXT, color=tone(theme.ink), loc="left")
    page.figure.legend(
        handles=handles,
        loc="center right",
        bbox_to_anchor=page.at(WIDTH - 24, top + 16),
        ncols=len(handles),
        frameon=False,
        fontsize=SMALL,
        labelcolor=tone(theme.ink),
    )
    page.text("sites", 68 + (WIDTH - 92) / 2, top + GAP + PANEL + 36, points=SMALL, colour=theme.faint)


def _draw_part(page: Page, heading: str, rows: Sequence[Row], top: float) -> None:
    """Draw a dot at each ratio and a bar at each goal, a line each."""
    theme = page.theme
    page.text(heading, 24, top + 16, points=TEXT + 1.5, bold=True)
    axes = page.axes((LEFT, top + GAP - 26, WIDTH - LEFT - RIGHT, ROW * len(rows)))
    _plain(axes, theme)
    axes.set_xscale("log")
    ratios = np.array([cast("float", row.ratio) for row in rows])
    wanted = np.array([row.goal for row in rows if row.goal is not None] + [1.0])
    low, high = 0.75 * min(ratios.min(), wanted.min()), 1.35 * max(ratios.max(), wanted.max())
    axes.axvline(1.0, color=tone(theme.faint), linewidth=1)
    for place, row in enumerate(rows):
        ratio, y = cast("float", row.ratio), len(rows) - 1 - place
        colour = tone(theme.controller("rpf" if row.met is False else "rapf"))
        axes.plot([1.0, ratio], [y, y], color=colour, linewidth=1.6, alpha=0.5)
        axes.plot(ratio, y, "o", color=colour, markersize=6.5)
        if row.goal is not None:
            axes.plot([row.goal] * 2, [y - 0.36, y + 0.36], color=tone(theme.ink), linewidth=2)
        words = ", ".join(part for part in (row.name, row.case) if part)
        middle = top + GAP - 26 + ROW * (place + 0.5)
        page.text(
            f"{words}  /  {row.yardstick}", LEFT - 14, middle, points=SMALL, room=LEFT - 38, align="right"
        )
        page.text(f"{ratio:.2f}", WIDTH - RIGHT + 14, middle, points=SMALL, bold=row.met is False)
    axes.set_ylim(-0.5, len(rows) - 0.5)
    axes.set_xlim(low, high)
    ticks = _ticks(low, high)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks], fontsize=SMALL)
    axes.set_yticks([])
    axes.minorticks_off()


def _plain(axes: Axes, theme: Theme) -> None:
    axes.set_facecolor(tone(theme.background))
    axes.tick_params(colors=tone(theme.ink), length=3)
    axes.grid(visible=True, color=tone(theme.grid), linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right", "left", "bottom"):
        axes.spines[side].set_visible(False)


def _ticks(low: float, high: float) -> list[float]:
    """Return round numbers between two bounds, few enough to be read.

    >>> _ticks(0.08, 6.0)
    [0.1, 0.2, 0.5, 1.0, 2.0, 5.0]
    """
    for leading in ((1, 2, 5), (1, 3), (1,)):
        found = [tick for tick in _round_numbers(leading) if low <= tick <= high]
        if len(found) <= 7:
            break
    return found


def _round_numbers(leading: tuple[int, ...]) -> Iterator[float]:
    for power in range(-4, 6):
        yield from (float(f"{digit}e{power}") for digit in leading)


def _number(row: Row, name: str) -> int:
    return int(row.parameters[name])
