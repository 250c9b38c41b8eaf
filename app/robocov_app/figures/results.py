"""Plots of many runs together: cost bands, rows of final costs and of pairs, what results depend on.

They take plain numbers. Heights of rows are counted from the top; names stand to the left, level, names of
groups above their rows.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullLocator

from robocov.arrays import Array
from robocov.controllers.gains import Value, format_value
from robocov_app.figures.curves import draw_curves, end_label
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL, TEXT, Page, figure_of, quiet_axes, set_value_axis, tone
from robocov_app.figures.statistics import Interval
from robocov_app.look.curve_styles import CurveStyle
from robocov_app.look.labels import shorten_text
from robocov_app.look.theme import LIGHT, Theme

_REACH = 1.5  # so much farther than its pairs an axis of ratios goes for their intervals
_USUAL = 700.0  # width of a page in pixels from which on lines have their full width
MOST_POINTS = 250  # points that are drawn of a sample; of more, so many that stand evenly among them by rank
FEW = 5  # values from which on a box says more than its points
_ROW, _HEADING = 30.0, 26.0  # heights of a row and of a group's name above several, in pixels at scale 1
_BESIDE = 13.0  # points between a row's name and the axis, where its mark stands
_HALF = 0.27  # half of the height of a box, in rows
# where an axis of ratios may have its marks; and beyond, powers of ten
_RATIOS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0, 3.0, 5.0)
MAX_LEVELS = 15  # different values of a gain up to which medians are drawn; more are a sample of a range
MOST_LETTERS = 28  # of a name on an axis or in a legend
MOST_RUNS = 600  # points that are drawn of a controller over a gain; of more, every so many-th
_WIDE = 8.0  # an axis is logarithmic when its highest value is so many times its lowest


class Band(NamedTuple):
    """Runs of one controller over time (T,) s: `values` (m, T) has a row for each, nan where it has none."""

    label: str
    style: CurveStyle
    time: Array
    values: Array


class Sample(NamedTuple):
    """One value of each of several runs, (m,)."""

    label: str
    style: CurveStyle
    values: Array


class Pairs(NamedTuple):
    """Ratios (m,) of two controllers in pairs of runs, all above 0, and the typical one."""

    label: str
    style: CurveStyle
    ratios: Array
    interval: Interval


@plain_style()
def plot_cost_bands(bands: Sequence[Band], size: tuple[int, int], label: str, unit: str) -> Figure:
    """Plot values against time: of several runs their median and quartiles, of one run its line."""
    page = Page(size, LIGHT, 1.0)
    curves, around = [], []
    for name, style, time, values in bands:
        low, middle, high = compute_quartiles(values)
        around.append((low, high) if len(values) > 1 else None)

        def width_of(name: str, time: Array = time, middle: Array = middle) -> float:
            return page.text_width(end_label((name, "", time, middle), unit), bold=True)

        # what stands at a curve's end takes no more than half of the page
        curves.append(
            (shorten_text(name, width_of, 0.5 * size[0] - 30, min_chars=1), style.name, time, middle)
        )
    right = 30 + max(page.text_width(end_label(curve, unit), bold=True) for curve in curves)
    axes = page.axes((44, 44, size[0] - 44 - right, size[1] - 94))
    # lines as in a picture of the usual size would fill a small one
    weight, styles = 1.0 if size[0] >= _USUAL else 0.7, [band.style for band in bands]
    draw_curves(axes, curves, LIGHT, styles=styles, bands=around, label=label, unit=unit, weight=weight)
    return page.figure


@plain_style()
def plot_final_costs(
    rows: Sequence[tuple[str, Sequence[Sample]]],
    label: str,
    width: int,
    scale: float,
    theme: Theme = LIGHT,
    origin: float = 0.0,
) -> Figure:
    """Plot samples as boxes on their side, every value as a point, in groups such as maps, from the top.

    Boxes span the quartiles, whiskers 1.5 times as much; below `FEW` values only points and median stand.
    The axis begins at `origin` unless all values are far from it. What is not finite is left out.
    """
    samples = [sample for _, group in rows for sample in group]
    places, heads, total = laid_rows([(name, len(group)) for name, group in rows])
    axes, names = rows_page(total, [sample.label for sample in samples], theme, width, scale)
    finite = [np.sort(sample.values[np.isfinite(sample.values)]) for sample in samples]
    for sample, values, place in zip(samples, finite, places, strict=True):
        draw_box(axes, values, place, sample.style, theme)
    _row_frame(axes, places, names, theme, label, [sample.style for sample in samples])
    set_value_axis(axes.xaxis, np.concatenate(finite), margin=0.06, origin=origin)
    box, ink = axes.get_position(), tone(theme.ink)
    style: Any = {"fontsize": TEXT, "fontweight": "bold", "va": "center", "color": ink}
    for (name, _), head in zip(rows, heads, strict=True):
        if name:
            left = -box.x0 / box.width + 0.01
            axes.text(left, head, name, transform=axes.get_yaxis_transform(), **style)
    return figure_of(axes)


@plain_style()
def plot_pairs(pairs: Sequence[Pairs], label: str, width: int, scale: float, theme: Theme = LIGHT) -> Figure:
    """Plot ratios pair by pair, with the median and its 95 % interval, on a logarithmic axis."""
    places, _, total = laid_rows([("", len(pairs))])
    axes, names = rows_page(total, [each.label for each in pairs], theme, width, scale)
    for each, place in zip(pairs, places, strict=True):
        _draw_points(axes, np.sort(each.ratios), place, each.style, theme)
        ratio = each.interval
        if np.isfinite(ratio.low):
            line: Any = {"linewidth": 2.4, "solid_capstyle": "butt", "zorder": 4}
            axes.plot([ratio.low, ratio.high], [place, place], color=tone(theme.ink), **line)
        _draw_median(axes, ratio.estimate, place, theme)
    _row_frame(axes, places, names, theme, label)
    ratios = np.concatenate([each.ratios for each in pairs])
    ends = [end for each in pairs for end in (each.interval.low, each.interval.high) if np.isfinite(end)]
    # an interval of two or three values may be endless: it leaves the axis then
    ends = np.clip(ends, ratios.min() / _REACH, ratios.max() * _REACH).tolist()
    ratio_limits(axes, np.concatenate([ratios, ends]), theme)
    return figure_of(axes)


def compute_quartiles(values: Array) -> Array:
    """Return the quartiles and the median between, (3, T), over finite rows of (m, T); nan for none."""
    kept = np.where(np.isfinite(values), values, np.nan)
    result = np.full((3, values.shape[1]), np.nan)
    some = ~np.isnan(kept).all(axis=0)
    result[:, some] = np.nanpercentile(kept[:, some], [25, 50, 75], axis=0)
    return result


def laid_rows(groups: Sequence[tuple[str, int]]) -> tuple[list[float], list[float], float]:
    """Return the middle of each row, the middle of each group's name, and the total height, in rows."""
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


def rows_page(rows: float, names: list[str], theme: Theme, wide: int, scale: float) -> tuple[Axes, list[str]]:
    """Return axes on a page high enough for so many rows, and the names as they fit to the left of them."""
    page = Page((wide, 200), theme, scale)
    short = [shorten_text(name, page.text_width, 0.42 * wide, min_chars=1) for name in names]
    left = max(page.text_width(name) for name in short) + 32 * scale
    above, below = 8 * scale, 46 * scale
    height = round(above + _ROW * scale * rows + below)
    page = Page((wide, height), theme, scale)
    axes = page.axes((left, above, wide - left - 16 * scale, height - above - below))
    axes.set_ylim(rows, 0.0)
    return axes, short


def _row_frame(
    axes: Axes, places: list[float], names: list[str], theme: Theme, x: str, looks: Sequence[CurveStyle] = ()
) -> None:
    axes.set_yticks(places, names)
    quiet_axes(axes, theme, x, grid="x")
    axes.tick_params(axis="y", left=True, length=0.0, labelsize=TEXT, pad=_BESIDE)
    aside = -0.5 * (_BESIDE + 3.0) * figure_of(axes).dpi / 72 / axes.get_window_extent().width
    style: Any = {"markersize": 5.5, "transform": axes.get_yaxis_transform(), "clip_on": False}
    for place, look in zip(places, looks, strict=False):
        axes.plot(aside, place, look.mark, color=tone(look.get_color(theme)), **style)


def ratio_limits(axes: Axes, ratios: Array, theme: Theme) -> None:
    low, high = min(float(ratios.min()), 0.95), max(float(ratios.max()), 1.05)
    room = (high / low) ** 0.05
    axes.set(xscale="log", xlim=(low / room, high * room))
    fitting = [ratio for ratio in _RATIOS if low / room <= ratio <= high * room]
    fitting += [10.0**k for k in range(1, 7) if 10.0**k <= high * room]
    axes.xaxis.set_major_locator(FixedLocator(_thinned(fitting, np.log(high / low) / 7)))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter("{x:g}")
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
    color = tone(style.get_color(theme))
    _draw_points(axes, values, place, style, theme)
    low, middle, high = np.percentile(values, [25, 50, 75])
    if len(values) >= FEW:
        reach = 1.5 * (high - low)
        begin, end = values[values >= low - reach].min(), values[values <= high + reach].max()
        line: Any = {"color": color, "linewidth": 1.4, "solid_capstyle": "butt", "zorder": 3}
        axes.plot([begin, low], [place, place], **line)
        axes.plot([high, end], [place, place], **line)
        corners = [low, high, high, low], [place - _HALF, place - _HALF, place + _HALF, place + _HALF]
        axes.fill(*corners, facecolor=(*color, 0.14), edgecolor=color, linewidth=1.4, zorder=2)
    if len(values) > 1:
        _draw_median(axes, float(middle), place, theme)


def _draw_points(axes: Axes, values: Array, place: float, style: CurveStyle, theme: Theme) -> None:
    """Draw sorted values as points, up and down so that few hide each other."""
    if len(values) > MOST_POINTS:
        values = values[np.rint(np.linspace(0, len(values) - 1, MOST_POINTS)).astype(int)]
    alone, powers = len(values) < FEW, np.arange(1, MOST_POINTS.bit_length() + 1)
    # van der Corput's sequence, in which neighbors lie far apart
    scattered = (np.arange(1, len(values) + 1)[:, None] >> (powers - 1) & 1) @ 0.5**powers
    aside = np.zeros(len(values)) if alone else (scattered - 0.5) * 1.5 * _HALF
    look: Any = {"markersize": 6.0, "alpha": 1.0} if alone else {"markersize": 3.6, "alpha": 0.65}
    rim: Any = {"markeredgecolor": tone(theme.background), "markeredgewidth": 0.4}
    axes.plot(values, place + aside, "o", color=tone(style.get_color(theme)), zorder=3.5, **look, **rim)


def _draw_median(axes: Axes, value: float, place: float, theme: Theme) -> None:
    ends = [place - _HALF, place + _HALF]
    axes.plot([value, value], ends, color=tone(theme.ink), linewidth=2.2, solid_capstyle="butt", zorder=5)


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
    """Plot values against a gain, one color and mark a controller, with a line through medians.

    The axis of the gain is logarithmic where it spans much; null has a place of its own at the right. A gain
    that is one of `words` has even places, and no line.
    """
    axes = _page_axes(size)
    null = _gain_axis(axes, np.concatenate([each.gains for each in dependences]), words)
    for each in dependences:
        _draw_dependence(axes, each, null, joined=not words)
    set_value_axis(axes.yaxis, np.concatenate([each.values for each in dependences]))
    quiet_axes(axes, LIGHT, shorten_text(gain, len, MOST_LETTERS), label, grid="y")
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
    colors = theme.quiet_heat
    # numbers tell three digits, and a tenth of the way between the lowest and the highest
    digits = [2 - math.floor(math.log10(abs(size))) for size in (high, 10.0 * (high - low)) if size]
    decimals = min(max(0, *digits), 4) if digits else 2
    for row, column in np.argwhere(np.isfinite(values)).tolist():
        part = (values[row, column] - low) / (high - low) if high > low else 0.0
        color = tone(colors[round(part * (len(colors) - 1))])
        # a hair's breadth of the page between cells
        axes.add_patch(Rectangle((column - 0.48, row - 0.48), 0.96, 0.96, facecolor=color, linewidth=0.0))
        style: Any = {"ha": "center", "va": "center", "fontsize": SMALL, "color": tone(theme.ink)}
        style["fontweight"] = "bold" if values[row, column] == low else "normal"
        axes.text(column, row, f"{values[row, column]:.{decimals}f}", **style)
    axes.set(xlim=(-0.5, len(first) - 0.5), ylim=(-0.5, len(second) - 0.5))
    axes.set_xticks(range(len(first)), [format_value(value, digits=4) for value in first])
    axes.set_yticks(range(len(second)), [format_value(value, digits=4) for value in second])
    x, y = (shorten_text(gain, len, MOST_LETTERS) for gain in gains)
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
    levels = np.unique(gains[np.isfinite(gains)])
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
    ticks = levels.tolist()
    if len(levels) > 8:
        locator = LogLocator(subs=(1.0, 3.0)) if logarithmic else MaxNLocator(6, steps=[1, 2, 5, 10])
        ticks = [float(value) for value in locator.tick_values(low, high) if low <= value <= high]
    axes.xaxis.set_major_locator(FixedLocator(ticks + [end] * unlimited))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xticklabels([format_value(value, digits=4) for value in ticks] + ["none"] * unlimited)
    return end if unlimited else None


def _draw_dependence(axes: Axes, each: Dependence, null: float | None, *, joined: bool) -> None:
    style, label = each.style, shorten_text(each.label, len, MOST_LETTERS)
    color = tone(style.get_color(LIGHT))
    where = each.gains if null is None else np.where(np.isnan(each.gains), null, each.gains)
    step = -(-len(where) // MOST_RUNS)
    dots: Any = {"color": color, "markeredgewidth": 0.0, "linestyle": "none"}
    axes.plot(where[::step], each.values[::step], style.mark, markersize=3.6, alpha=0.5, **dots)
    levels = np.unique(where)
    if len(levels) > MAX_LEVELS:
        axes.plot([], [], style.mark, markersize=5.0, label=label, **dots)
        return
    medians = np.array([np.median(each.values[where == level]) for level in levels])
    dashes = style.dashes if joined else "none"
    line: Any = {"color": color, "linestyle": dashes, "linewidth": 2.0, "label": label}
    axes.plot(levels, medians, marker=style.mark, markersize=6.5, **line)
