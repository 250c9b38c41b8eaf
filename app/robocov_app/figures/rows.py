"""Rows of boxes and points that share one axis of values: what `robocov_app.figures.results` is made of.

Heights are in rows from the top. Names stand to the left, level; names of groups above their rows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from robocov.arrays import Array
from robocov_app.figures.page import TEXT, Page, figure_of, quiet_axes, tone
from robocov_app.figures.styles import CurveStyle
from robocov_app.render.theme import Theme

MOST_POINTS = 250  # points that are drawn of a sample; of more, so many that stand evenly among them by rank
FEW = 5  # values from which on a box says more than its points
_ROW, _HEADING = 30.0, 26.0  # heights of a row and of a group's name above several, in pixels at scale 1
_BESIDE = 13.0  # points between a row's name and the axis, where its mark stands
_HALF = 0.27  # half of the height of a box, in rows
# where an axis of ratios may have its marks; and beyond, powers of ten
_RATIOS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0, 3.0, 5.0)


def laid_rows(groups: Sequence[tuple[str, int]]) -> tuple[list[float], list[float], float]:
    """Return the middle of each row, the middle of each group's name, and the total height.

    >>> laid_rows([("", 2)])
    ([0.5, 1.5], [-0.5], 2.0)
    """
    places: list[float] = []
    heads: list[float] = []
    at = 0.0
    for name, count in groups:
        if name:
            at += _HEADING / _ROW + (0.2 if places else 0.0)
        heads.append(at - 0.5 * _HEADING / _ROW if name else at - 0.5)
        places += [at + k + 0.5 for k in range(count)]
        at += count
    return places, heads, at


def rows_page(
    total: float,
    names: Sequence[str],
    theme: Theme,
    size: tuple[int, int | None] | None,
    title: str,
    scale: float | None,
) -> tuple[Axes, list[str]]:
    """Return axes on a page high enough for `total` rows, and the names as they fit to the left of them."""
    width, height = size or (800, None)
    # how high it is depends on the scale, not the other way round
    page = Page((width, 200), theme, scale or min(max(width / 640, 0.8), 6.0))
    s = page.scale
    short = [cut_to(name, page.text_width, 0.42 * width) for name in names]
    left = max(page.text_width(name) for name in short) + 32 * s
    above, below = (36 if title else 8) * s, 46 * s
    if height is None:
        height = round(above + _ROW * s * total + below)
    page = Page((width, height), theme, s)
    if title:
        page.title(title, 20)
    return page.axes((left, above, width - left - 16 * s, height - above - below)), short


def row_frame(
    axes: Axes,
    places: Sequence[float],
    names: Sequence[str],
    total: float,
    theme: Theme,
    label: str,
    looks: Sequence[CurveStyle] = (),
) -> None:
    """Write the names beside the rows, with the marks of their styles, and what the values are."""
    axes.set_ylim(total, 0.0)
    axes.set_yticks(list(places), list(names))
    quiet_axes(axes, theme, label, grid="x")
    axes.tick_params(axis="y", left=True, length=0.0, labelsize=TEXT, pad=_BESIDE)
    aside = -0.5 * (_BESIDE + 3.0) * figure_of(axes).dpi / 72 / axes.get_window_extent().width
    style: Any = {"markersize": 5.5, "transform": axes.get_yaxis_transform(), "clip_on": False}
    for place, look in zip(places, looks, strict=False):
        axes.plot(aside, place, look.mark, color=tone(look.colour(theme)), **style)


def cut_to(text: str, width_of: Callable[[str], float], room: float) -> str:
    """Return a text, cut so that it is no wider than `room` unless that leaves nothing of it.

    >>> cut_to("Lloyd's algorithm", len, 8)
    "Lloyd's…"
    """
    kept = text
    while len(kept) > 1 and width_of(text if kept == text else f"{kept}…") > room:
        kept = kept[:-1]
    return text if kept == text else f"{kept.rstrip()}…"


def draw_heading(axes: Axes, name: str, height: float, theme: Theme) -> None:
    """Write the name of a group at the left edge of the page."""
    box = axes.get_position()
    style: Any = {"fontsize": TEXT, "fontweight": "bold", "va": "center", "color": tone(theme.ink)}
    axes.text(-box.x0 / box.width + 0.01, height, name, transform=axes.get_yaxis_transform(), **style)


def ratio_limits(axes: Axes, ratios: Array, theme: Theme) -> None:
    """Give a logarithmic axis around 1 room for all ratios, and mark 1."""
    low, high = min(float(ratios.min()), 0.95), max(float(ratios.max()), 1.05)
    room = (high / low) ** 0.05
    axes.set_xscale("log")
    axes.set_xlim(low / room, high * room)
    fitting = [ratio for ratio in _RATIOS if low / room <= ratio <= high * room]
    fitting += [10.0**k for k in range(1, 7) if 10.0**k <= high * room]
    axes.xaxis.set_major_locator(FixedLocator(_thinned(fitting, np.log(high / low) / 7)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.axvline(1.0, color=tone(theme.ink), linewidth=1.0, zorder=2)


def _thinned(marks: Sequence[float], apart: float) -> list[float]:
    """Return the marks that are at least so far apart in their logarithms, 1 among them."""
    kept = [1.0]
    for mark in sorted(marks, key=lambda value: abs(np.log(value))):
        if all(abs(np.log(mark / other)) >= apart for other in kept):
            kept.append(mark)
    return sorted(kept)


def draw_box(axes: Axes, values: Array, place: float, style: CurveStyle, theme: Theme) -> None:
    """Draw one row of sorted values: points and median, and from `FEW` values on their box and whiskers."""
    colour = tone(style.colour(theme))
    draw_points(axes, values, place, colour, theme)
    low, middle, high = np.percentile(values, [25, 50, 75])
    if len(values) >= FEW:
        reach = 1.5 * (high - low)
        begin = values[values >= low - reach].min()
        end = values[values <= high + reach].max()
        line: Any = {"color": colour, "linewidth": 1.4, "solid_capstyle": "butt", "zorder": 3}
        axes.plot([begin, low], [place, place], **line)
        axes.plot([high, end], [place, place], **line)
        corners = [low, high, high, low], [place - _HALF, place - _HALF, place + _HALF, place + _HALF]
        axes.fill(*corners, facecolor=(*colour, 0.14), edgecolor=colour, linewidth=1.4, zorder=2)
    if len(values) > 1:
        draw_median(axes, float(middle), place, theme)


def draw_points(
    axes: Axes, values: Array, place: float, colour: tuple[float, float, float], theme: Theme
) -> None:
    """Draw sorted values as points, up and down so that few hide each other."""
    if len(values) > MOST_POINTS:
        values = values[np.rint(np.linspace(0, len(values) - 1, MOST_POINTS)).astype(int)]
    alone = len(values) < FEW
    aside = np.zeros(len(values)) if alone else (_scattered(len(values)) - 0.5) * 1.5 * _HALF
    look: Any = {"markersize": 6.0, "alpha": 1.0} if alone else {"markersize": 3.6, "alpha": 0.65}
    rim: Any = {"markeredgecolor": tone(theme.background), "markeredgewidth": 0.4}
    axes.plot(values, place + aside, "o", color=colour, zorder=3.5, **look, **rim)


def draw_median(axes: Axes, value: float, place: float, theme: Theme) -> None:
    """Draw the mark of a median."""
    ends = [place - _HALF, place + _HALF]
    axes.plot([value, value], ends, color=tone(theme.ink), linewidth=2.2, solid_capstyle="butt", zorder=5)


def _scattered(count: int) -> Array:
    """Return numbers from 0 to 1 of which neighbours lie far apart: van der Corput's sequence."""
    numbers = np.zeros(count)
    rest, part = np.arange(1, count + 1), 0.5
    while rest.any():
        numbers += part * (rest % 2)
        rest, part = rest // 2, part / 2
    return numbers
