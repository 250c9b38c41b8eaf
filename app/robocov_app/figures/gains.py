"""Plots of what a result depends on: gains, team sizes, limits."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullLocator

from robocov.arrays import Array
from robocov.controllers.gains import Value, value_text
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import (
    SMALL,
    Page,
    cut_to,
    even_ticks,
    figure_of,
    quiet_axes,
    tone,
    value_limits,
)
from robocov_app.figures.styles import CurveStyle
from robocov_app.render.theme import LIGHT, Theme

MOST_LEVELS = 15  # different values of a gain up to which medians are drawn; more are a sample of a range
MOST_LETTERS = 28  # of a name on an axis or in a legend
MOST_POINTS = 600  # points that are drawn of a controller; of more, every so many-th
_WIDE = 8.0  # an axis is logarithmic when its highest value is so many times its lowest


class Dependence(NamedTuple):
    """Values of one controller's runs against a gain, (m,) each: nan is no limit, and a word its number."""

    label: str
    style: CurveStyle
    gains: Array
    values: Array


@plain_style()
def plot_gains(
    dependences: Sequence[Dependence], gain: str, size: tuple[int, int], label: str, words: Sequence[str] = ()
) -> Figure:
    """Plot values against a gain, one colour and mark a controller, with a line through medians.

    The axis of the gain is logarithmic where it spans much; null has a place of its own at the right. A gain
    that is one of `words` has even places, and no line.
    """
    axes = _page_axes(size)
    null = _gain_axis(axes, np.concatenate([each.gains for each in dependences]), words)
    for each in dependences:
        _draw_dependence(axes, each, null, joined=not words)
    values = np.concatenate([each.values for each in dependences])
    axes.set_ylim(*value_limits(float(values.min()), float(values.max())))
    even_ticks(axes.yaxis, 6)
    quiet_axes(axes, LIGHT, cut_to(gain, len, MOST_LETTERS), label, grid="y")
    if len(dependences) > 1:
        axes.legend(frameon=False, fontsize=SMALL, labelcolor=tone(LIGHT.ink), borderaxespad=0.2)
    return figure_of(axes)


@plain_style()
def plot_gain_grid(
    on: Axes | tuple[int, int],
    first: Sequence[Value],
    second: Sequence[Value],
    values: Array,
    gains: tuple[str, str],
    theme: Theme = LIGHT,
) -> Figure:
    """Plot values (rows, columns) over a grid of two gains as a heat map with its numbers; nan for none.

    `on`: axes, or the size of a page of its own in px. `first`, `second`: the gains' values, ascending, None
    for no limit.
    """
    axes = on if isinstance(on, Axes) else _page_axes(on)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    colours = theme.quiet_heat
    # numbers tell three digits, and a tenth of the way between the lowest and the highest
    digits = [2 - math.floor(math.log10(abs(size))) for size in (high, 10.0 * (high - low)) if size]
    decimals = min(max(0, *digits), 4) if digits else 2
    for row, column in np.argwhere(np.isfinite(values)).tolist():
        part = (values[row, column] - low) / (high - low) if high > low else 0.0
        colour = tone(colours[round(part * (len(colours) - 1))])
        # a hair's breadth of the page between cells
        box = (column - 0.48, row - 0.48), 0.96, 0.96
        axes.add_patch(Rectangle(*box, facecolor=colour, linewidth=0.0))
        weight = "bold" if values[row, column] == low else "normal"
        text = f"{values[row, column]:.{decimals}f}"
        style: Any = {"ha": "center", "va": "center", "fontsize": SMALL, "color": tone(theme.ink)}
        axes.text(column, row, text, fontweight=weight, **style)
    axes.set_xlim(-0.5, len(first) - 0.5)
    axes.set_ylim(-0.5, len(second) - 0.5)
    axes.set_xticks(range(len(first)), [value_text(value, digits=4) for value in first])
    axes.set_yticks(range(len(second)), [value_text(value, digits=4) for value in second])
    x, y = (cut_to(gain, len, MOST_LETTERS) for gain in gains)
    quiet_axes(axes, theme, x, y)
    axes.tick_params(length=0.0)
    return figure_of(axes)


def _page_axes(size: tuple[int, int]) -> Axes:
    return Page(size, LIGHT, 1.0).axes((52, 34, size[0] - 70, size[1] - 84))


def _gain_axis(axes: Axes, gains: Array, words: Sequence[str]) -> float | None:
    """Set the scale of the axis; return where null stands on it, None where there is no null."""
    if words:
        axes.set_xlim(-0.5, len(words) - 0.5)
        axes.set_xticks(range(len(words)), list(words))
        return None
    finite = gains[np.isfinite(gains)]
    levels = np.unique(finite)
    logarithmic = len(levels) > 1 and levels[0] > 0 and levels[-1] / levels[0] >= _WIDE
    low, high = (float(levels[0]), float(levels[-1])) if len(levels) else (0.0, 0.0)
    unlimited = bool(np.isnan(gains).any())
    if logarithmic:
        axes.set_xscale("log")
        room = (high / low) ** 0.07
        end = high * room**3 if unlimited else high
        axes.set_xlim(low / room, end * room)
    else:
        room = 0.07 * (high - low) if high > low else 0.5 * max(abs(high), 1.0)
        end = high + 3 * room if unlimited else high
        axes.set_xlim(low - room, end + room)
    null = [end] if unlimited else []
    ticks = levels.tolist()
    if len(levels) > 8:
        locator = LogLocator(subs=(1.0, 3.0)) if logarithmic else MaxNLocator(6, steps=[1, 2, 5, 10])
        ticks = [float(value) for value in locator.tick_values(low, high) if low <= value <= high]
    axes.xaxis.set_major_locator(FixedLocator([*ticks, *null]))
    axes.xaxis.set_minor_locator(NullLocator())
    texts = [value_text(value, digits=4) for value in ticks]
    axes.set_xticklabels([*texts, *("none" for _ in null)])
    return end if unlimited else None


def _draw_dependence(axes: Axes, each: Dependence, null: float | None, *, joined: bool) -> None:
    style, label = each.style, cut_to(each.label, len, MOST_LETTERS)
    colour = tone(style.colour(LIGHT))
    where = each.gains if null is None else np.where(np.isnan(each.gains), null, each.gains)
    step = -(-len(where) // MOST_POINTS)
    dots: Any = {"color": colour, "markeredgewidth": 0.0, "linestyle": "none"}
    axes.plot(where[::step], each.values[::step], style.mark, markersize=3.6, alpha=0.5, **dots)
    levels = np.unique(where)
    if len(levels) > MOST_LEVELS:
        axes.plot([], [], style.mark, markersize=5.0, label=label, **dots)
        return
    medians = np.array([np.median(each.values[where == level]) for level in levels])
    dashes = style.dashes if joined else "none"
    line: Any = {"color": colour, "linestyle": dashes, "linewidth": 2.0, "label": label}
    axes.plot(levels, medians, marker=style.mark, markersize=6.5, **line)
