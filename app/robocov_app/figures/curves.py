"""Cost curves: mean distance against time, each named at its end."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np

from robocov.arrays import Array
from robocov_app.figures.page import SMALL, TEXT, tone
from robocov_app.render.theme import Colour, Theme

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Curve: TypeAlias = tuple[str, str, Array, Array]
"""Label, controller's name, times (T,) s and mean distances (T,) m."""

_KNOWN: dict[str, tuple[Any, str]] = {
    "rapf": ("-", "o"),
    "rpf": ((0, (5, 1.6)), "s"),
    "lloyd": ((0, (1.6, 1.2)), "^"),
}
"""Dashes and end mark of the paper's controllers: the same in every picture."""

VARIANTS: tuple[tuple[Any, str], ...] = (
    ((0, (6, 1.6, 1.6, 1.6)), "D"),
    ((0, (9, 2.5)), "v"),
    ((0, (3, 1.2, 1.2, 1.2, 1.2, 1.2)), "P"),
    ((0, (2.5, 2.5)), "*"),
    ((0, (9, 1.4, 3, 1.4)), "X"),
)
"""Those of controllers that have none of their own, and of one controller's second, third, ... gains."""

_LOOKS = (*_KNOWN.values(), *VARIANTS)

MARKS = {
    "o": "M0-5a5 5 0 1 0 .01 0z",
    "s": "M-4.6-4.6h9.2v9.2h-9.2z",
    "^": "M0-5.6 5.6 4.4H-5.6z",
    "v": "M0 5.6 5.6-4.4H-5.6z",
    "D": "M0-6 6 0 0 6-6 0z",
    "P": "M-2-6h4v4h4v4h-4v4h-4v-4h-4v-4h4z",
    "*": "M0-6.6 1.8-2.1 6.6-1.8 2.9 1.3 4.1 6 0 3.4-4.1 6-2.9 1.3-6.6-1.8-1.8-2.1z",
    "X": "M-5.6-3-3-5.6 0-2.6 3-5.6 5.6-3 2.6 0 5.6 3 3 5.6 0 2.6-3 5.6-5.6 3-2.6 0z",
}
"""The marks as SVG paths round the origin, 10 to 13 across."""

DISTANCE = "mean distance to the nearest robot (m)"
TIME = "mean time until the first robot is there (s)"
WEIGHED = "mean distance to the nearest robot, weighed by φ (m)"

_FROM_ZERO = 0.4
"""The axis begins at zero when the lowest value is below this part of the highest."""


class CurveStyle(NamedTuple):
    """How a controller's curves are told from others: never by a colour alone.

    `name` is that of the colour: the controller's own, or ``other-0``, ``other-1``, ... for those of
    `Theme.others`.
    """

    name: str
    dashes: Any
    mark: str

    def colour(self, theme: Theme) -> Colour:
        """Return the colour in a theme."""
        kind, _, number = self.name.rpartition("-")
        return theme.others[int(number)] if kind == "other" else theme.controller(self.name)


def curve_styles(controllers: Iterable[str]) -> dict[str, CurveStyle]:
    """Return a style for each controller; those that have none of their own get the others' in turn."""
    names = list(dict.fromkeys(controllers))
    return dict(zip(names, styles_of(names), strict=True))


def styles_of(controllers: Sequence[str]) -> list[CurveStyle]:
    """Return a style for each of several curves: another colour, dashes and mark for a controller's variants.

    >>> [(style.name, style.mark) for style in styles_of(["rapf", "rapf", "mine"])]
    [('rapf', 'o'), ('other-1', 'v'), ('other-0', 'D')]
    """
    spare = [CurveStyle(f"other-{k}", *look) for k, look in enumerate(VARIANTS)]
    free = itertools.cycle(spare)
    first = {
        name: CurveStyle(name, *_KNOWN[name]) if name in _KNOWN else next(free)
        for name in dict.fromkeys(controllers)
    }
    left, used = dict(first), set(first.values())
    styles = []
    for name in controllers:
        style = left.pop(name, None)
        if style is None:
            own = [first[name]._replace(dashes=dashes, mark=mark) for dashes, mark in _LOOKS]
            style = next((each for each in (*spare, *own) if each not in used), first[name])
            used.add(style)
        styles.append(style)
    return styles


def end_label(curve: Curve, unit: str = "m") -> str:
    """Return what stands at a curve's end: its name and its last finite value.

    Lengths have millimetres, as in captions; what is measured in other units, and is large, four digits.
    """
    label, _, _, values = curve
    last = float(values[np.isfinite(values)][-1])
    number = f"{last:.3f}"
    if abs(last) >= 1e7:
        number = f"{last:.4g}"
    elif unit != "m" and abs(last) >= 10.0:
        number = f"{last:.4g}" if abs(last) < 1e4 else f"{last:,.0f}"
    return f"{label}  {number} {unit}".rstrip()


def draw_curves(
    axes: Axes,
    curves: Sequence[Curve],
    theme: Theme,
    *,
    styles: Sequence[CurveStyle] | None = None,
    bands: Sequence[tuple[Array, Array] | None] | None = None,
    label: str = DISTANCE,
    unit: str = "m",
    weight: float = 1.0,
) -> None:
    """Draw curves with their labels at their right ends, pushed apart where they would overlap.

    The first is the widest and lowest: curves that lie on each other are still all seen. `bands` are what
    lies around each curve, as quartiles around a median; a `weight` below 1 is for small pictures.
    """
    chosen = styles_of([controller for _, controller, _, _ in curves]) if styles is None else styles
    looks = [(style.colour(theme), style.dashes, style.mark) for style in chosen]
    around = [band for band in bands or () if band is not None]
    _frame(axes, curves, theme, around, label)
    for (_, _, time, _), (shade, _, _), band in zip(
        curves, looks, bands or [None] * len(curves), strict=True
    ):
        if band is not None:
            axes.fill_between(time, *band, color=tone(shade), alpha=0.16, linewidth=0.0)
    ends = []
    for below, (curve, (shade, dashes, mark)) in enumerate(zip(curves, looks, strict=True)):
        _, _, time, values = curve
        colour, above = tone(shade), min(len(curves) - 1 - below, 3)
        width = weight * (2.2 + 0.9 * above)
        if not isinstance(dashes, str):
            dashes = 0, tuple(2.2 * weight / width * part for part in dashes[1])
        axes.plot(time, values, color=colour, linewidth=width, linestyle=dashes, dash_capstyle="butt")
        last = int(np.nonzero(np.isfinite(values))[0][-1])
        size = weight * (6.5 + 2.0 * above)
        axes.plot(time[last], values[last], mark, color=colour, markersize=size, clip_on=False, zorder=5)
        ends.append((float(time[last]), float(values[last]), colour, end_label(curve, unit)))
    figure = axes.get_figure(root=True)
    assert figure is not None
    line_height = 1.45 * TEXT * figure.dpi / 72
    at = axes.transData.transform([(x, y) for x, y, _, _ in ends])
    box = axes.get_window_extent()
    heights = spread(at[:, 1], line_height, float(box.y0), float(box.y1))
    for (x, y, colour, text), height in zip(ends, heights.tolist(), strict=True):
        fraction = (height - box.y0) / box.height
        axes.annotate(
            text,
            xy=(x, y),
            xytext=(1.0, fraction),
            textcoords=axes.transAxes,
            xycoords="data",
            annotation_clip=False,
            fontsize=TEXT,
            fontweight="bold",
            color=colour,
            va="center",
            ha="left",
        ).set_position((1.0 + 12 * figure.dpi / 72 / box.width, fraction))
        if abs(height - float(axes.transData.transform((x, y))[1])) > 0.3 * line_height:
            axes.plot(
                [1.0 + 4 * figure.dpi / 72 / box.width, 1.0 + 10 * figure.dpi / 72 / box.width],
                [float(axes.transAxes.inverted().transform(axes.transData.transform((x, y)))[1]), fraction],
                transform=axes.transAxes,
                color=colour,
                linewidth=0.8,
                clip_on=False,
            )


def _frame(
    axes: Axes, curves: Sequence[Curve], theme: Theme, bands: Sequence[tuple[Array, Array]], label: str
) -> None:
    """Set limits, units and a quiet grid."""
    from matplotlib.ticker import MaxNLocator

    ink, faint = tone(theme.ink), tone(theme.faint)
    lines = [*(np.asarray(curve[3]) for curve in curves), *(edge for band in bands for edge in band)]
    values = np.concatenate([line[np.isfinite(line)] for line in lines])
    times = np.concatenate([np.asarray(curve[2]) for curve in curves])
    low, high = float(values.min()), float(values.max())
    room = 0.08 * (high - low) if high > low else 0.1 * max(abs(high), 1e-3)
    axes.set_ylim(0.0 if low < _FROM_ZERO * high else low - room, high + room)
    axes.set_xlim(float(times.min()), max(float(times.max()), float(times.min()) + 1e-9))
    axes.set_facecolor(tone(theme.background))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=8, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_major_locator(MaxNLocator(nbins=6, steps=[1, 2, 5, 10]))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xlabel("time (s)", fontsize=TEXT, color=ink)
    # level words are read more easily than words on their side
    axes.set_ylabel(label, fontsize=TEXT, color=ink)
    axes.yaxis.label.set(rotation=0, ha="left", va="bottom")
    axes.yaxis.set_label_coords(0.0, 1.03)
    axes.grid(axis="y", color=tone(theme.grid), linewidth=0.8, alpha=0.7)
    axes.set_axisbelow(True)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(faint)
    axes.tick_params(colors=tone(theme.faint), labelcolor=ink, labelsize=SMALL, left=False)


def spread(heights: Array, gap: float, low: float, high: float) -> Array:
    """Return heights at least `gap` apart, in the same order, as near to the given ones as a sweep gets.

    `heights` in (m,). `low`, `high`: they stay within, as far as there is room.

    Examples
    --------
    >>> spread(np.array([5.0, 5.0, 20.0]), 4.0, 0.0, 30.0).tolist()
    [3.0, 7.0, 20.0]
    """
    order = np.argsort(heights, kind="stable")
    blocks: list[list[float]] = []  # sum of wanted first heights, number of members
    for rank in order.tolist():
        blocks.append([float(heights[rank]), 1.0])
        while len(blocks) > 1:
            (above, m), (below, k) = blocks[-1], blocks[-2]
            bottom = below / k - 0.5 * gap * (k - 1)
            if above / m - 0.5 * gap * (m - 1) - (bottom + gap * (k - 1)) >= gap - 1e-9:
                break
            blocks[-2:] = [[below + above, k + m]]
    placed: list[float] = []
    for total, count in blocks:
        first = total / count - 0.5 * gap * (count - 1)
        placed += [first + gap * k for k in range(int(count))]
    result = np.empty(len(heights))
    result[order] = placed
    for k, rank in enumerate(order.tolist()):
        floor = low + gap * k
        result[rank] = max(result[rank], floor)
    for k, rank in enumerate(order[::-1].tolist()):
        ceiling = high - gap * k
        result[rank] = min(result[rank], ceiling)
    return result
