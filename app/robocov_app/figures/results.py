"""Plots of many runs together: cost bands, final costs, and pairs of controllers.

They take plain numbers. What a result depends on (gains, team sizes) is in `robocov_app.figures.gains`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from robocov.arrays import Array
from robocov.errors import ParameterError, shown
from robocov_app.figures.curves import DISTANCE, Curve, draw_curves, end_label
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import Page, even_ticks, figure_of, tone, value_limits
from robocov_app.figures.rows import (
    cut_to,
    draw_box,
    draw_heading,
    draw_median,
    draw_points,
    laid_rows,
    ratio_limits,
    row_frame,
    rows_page,
)
from robocov_app.figures.statistics import Interval
from robocov_app.figures.styles import CurveStyle, curve_styles, styles_of
from robocov_app.render.theme import LIGHT, Theme, theme_named

_REACH = 1.5  # so much farther than its pairs an axis of ratios goes for their intervals
_USUAL = 700.0  # width of a page in pixels from which on lines have their full width


class Band(NamedTuple):
    """Runs of one controller over time (T,) s: `values` (m, T) has a row for each, nan where it has none."""

    label: str
    controller: str
    time: Array
    values: Array


class Sample(NamedTuple):
    """One value of each of several runs: label, controller's name, (m,) values."""

    label: str
    controller: str
    values: Array


class Pairs(NamedTuple):
    """Ratios (m,) of two controllers in pairs of runs, and the typical one; the colour is the first one's."""

    label: str
    controller: str
    ratios: Array
    interval: Interval


@plain_style()
def plot_cost_bands(
    bands: Sequence[Band],
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Coverage cost over time",
    *,
    scale: float | None = None,
    styles: Sequence[CurveStyle] | None = None,
    label: str = DISTANCE,
    unit: str = "m",
) -> Figure:
    """Plot values against time: of several runs their median and quartiles, of one run its line."""
    if not bands:
        raise ParameterError("bands: none were given, but at least one was wanted")
    for band in bands:
        if band.values.ndim != 2 or band.values.shape[1] != len(band.time):
            raise ParameterError(
                f"band {shown(band.label)}: values of shape {band.values.shape}, but a row for each run with "
                f"{len(band.time)} columns was wanted"
            )
        if not np.isfinite(band.values).any():
            raise ParameterError(
                f"band {shown(band.label)}: no finite value, but at least one in each was wanted"
            )
    theme = theme_named(theme)
    looks = styles_of([band.controller for band in bands]) if styles is None else styles
    quarters = [quartiles(band.values) for band in bands]
    curves = [
        (band.label, band.controller, band.time, middle)
        for band, (_, middle, _) in zip(bands, quarters, strict=True)
    ]
    around = [
        (low, high) if len(band.values) > 1 else None
        for band, (low, _, high) in zip(bands, quarters, strict=True)
    ]
    page = Page(size or (1000, 560), theme, scale if size else scale or 1.25)
    s = page.scale
    most = 0.5 * page.size[0] - 30 * s
    curves = [_fitting(curve, page, unit, most) for curve in curves]
    right = 30 * s + max(page.text_width(end_label(curve, unit), bold=True) for curve in curves)
    left, top = 44 * s, (72 if title else 44) * s
    if title:
        page.title(title, 22)
    axes = page.axes((left, top, page.size[0] - left - right, page.size[1] - top - 50 * s))
    # lines as in a picture of the usual size would fill a small one
    weight = 1.0 if size is None or size[0] >= _USUAL * (scale or 1.0) else 0.7
    draw_curves(axes, curves, theme, styles=looks, bands=around, label=label, unit=unit, weight=weight)
    return figure_of(axes)


@plain_style()
def plot_final_costs(
    rows: Sequence[tuple[str, Sequence[Sample]]],
    theme: Theme | str = LIGHT,
    size: tuple[int, int | None] | None = None,
    title: str = "",
    *,
    scale: float | None = None,
    styles: Sequence[CurveStyle] | None = None,
    label: str = DISTANCE,
    origin: float = 0.0,
) -> Figure:
    """Plot samples as boxes on their side, every value as a point, in groups such as maps.

    Boxes span the quartiles, whiskers 1.5 times as much; a sample of fewer than `FEW` values has points and
    median alone. `rows` are groups from top to bottom. A height of None is what they need. The axis begins at
    `origin` unless all values are far from it.
    """
    samples = [sample for _, group in rows for sample in group]
    _check_samples(samples)
    theme = theme_named(theme)
    places, heads, total = laid_rows([(name, len(group)) for name, group in rows])
    names = [sample.label for sample in samples]
    axes, names = rows_page(total, names, theme, size, title, scale)
    looks: list[CurveStyle] = []
    for _, group in rows:
        looks += styles_of([each.controller for each in group]) if styles is None else styles[: len(group)]
    for sample, place, look in zip(samples, places, looks, strict=True):
        draw_box(axes, np.sort(sample.values[np.isfinite(sample.values)]), place, look, theme)
    row_frame(axes, places, names, total, theme, label, looks)
    values = np.concatenate([sample.values[np.isfinite(sample.values)] for sample in samples])
    low, high = float(values.min()), float(values.max())
    axes.set_xlim(*value_limits(low, high, room=0.06, origin=origin))
    even_ticks(axes.xaxis, 6)
    for (name, _), head in zip(rows, heads, strict=True):
        if name:
            draw_heading(axes, name, head, theme)
    return figure_of(axes)


@plain_style()
def plot_paired(
    pairs: Sequence[Pairs],
    theme: Theme | str = LIGHT,
    size: tuple[int, int | None] | None = None,
    title: str = "",
    *,
    scale: float | None = None,
    label: str = "ratio of final mean distances",
    styles: Sequence[CurveStyle] | None = None,
) -> Figure:
    """Plot ratios pair by pair, with the median and its 95 % interval, on a logarithmic axis."""
    _check_samples([Sample(each.label, each.controller, each.ratios) for each in pairs])
    for each in pairs:
        if not (each.ratios > 0).all():
            raise ParameterError(f"pairs {shown(each.label)}: ratios above 0 were wanted")
    theme = theme_named(theme)
    places, _, total = laid_rows([("", len(pairs))])
    names = [each.label for each in pairs]
    axes, names = rows_page(total, names, theme, size, title, scale)
    known = curve_styles(each.controller for each in pairs)
    looks = [known[each.controller] for each in pairs] if styles is None else styles
    for each, look, place in zip(pairs, looks, places, strict=True):
        colour = tone(look.colour(theme))
        draw_points(axes, np.sort(each.ratios), place, colour, theme)
        ratio = each.interval
        if np.isfinite(ratio.low):
            line: Any = {"linewidth": 2.4, "solid_capstyle": "butt", "zorder": 4}
            axes.plot([ratio.low, ratio.high], [place, place], color=tone(theme.ink), **line)
        draw_median(axes, ratio.estimate, place, theme)
    row_frame(axes, places, names, total, theme, label)
    ratios = np.concatenate([each.ratios for each in pairs])
    ends = [end for each in pairs for end in (each.interval.low, each.interval.high) if np.isfinite(end)]
    # an interval of two or three values may be endless: it leaves the axis then
    ends = np.clip(ends, ratios.min() / _REACH, ratios.max() * _REACH).tolist()
    ratio_limits(axes, np.concatenate([ratios, ends]), theme)
    return figure_of(axes)


def quartiles(values: Array) -> tuple[Array, Array, Array]:
    """Return quartiles and the median between, (T,), over finite rows of (m, T); nan for none."""
    kept = np.where(np.isfinite(values), values, np.nan)
    result = np.full((3, values.shape[1]), np.nan)
    some = ~np.isnan(kept).all(axis=0)
    result[:, some] = np.nanpercentile(kept[:, some], [25, 50, 75], axis=0)
    return result[0], result[1], result[2]


def _fitting(curve: Curve, page: Page, unit: str, room: float) -> Curve:
    """Return a curve with its name cut so that what stands at its end takes no more than `room` pixels."""

    def width_of(label: str) -> float:
        return page.text_width(end_label((label, *curve[1:]), unit), bold=True)

    return cut_to(curve[0], width_of, room), *curve[1:]


def _check_samples(samples: Sequence[Sample]) -> None:
    if not samples:
        raise ParameterError("samples: none were given, but at least one was wanted")
    for sample in samples:
        if not np.isfinite(sample.values).any():
            raise ParameterError(
                f"sample {shown(sample.label)}: no finite value, but at least one was wanted"
            )
