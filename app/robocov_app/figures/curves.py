"""Cost curves: mean distance against time, each named at its end."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes

from robocov.arrays import Array
from robocov_app.figures.page import TEXT, Tone, figure_of, quiet_axes, set_even_ticks, set_value_axis, tone
from robocov_app.look.axes import MAX_TIME_INTERVALS
from robocov_app.look.curve_styles import CurveStyle, choose_curve_styles
from robocov_app.look.labels import spread_labels
from robocov_app.look.theme import Theme

# label, controller's name, times (T,) s and mean distances (T,) m
Curve: TypeAlias = tuple[str, str, Array, Array]

DISTANCE = "mean distance to the nearest robot (m)"
TIME = "mean time until the first robot is there (s)"
WEIGHED = "mean distance to the nearest robot, weighed by φ (m)"


def end_label(curve: Curve, unit: str = "m") -> str:
    """Return a curve's name with its last finite value: millimeters, or four digits of what is large."""
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
    """Draw curves, the first lowest and widest, and quartile `bands`; labels at the ends are pushed apart."""
    chosen = choose_curve_styles([controller for _, controller, _, _ in curves]) if styles is None else styles
    around = list(bands or [None] * len(curves))
    lines = [np.asarray(curve[3]) for curve in curves] + [edge for band in around if band for edge in band]
    times = np.concatenate([np.asarray(curve[2]) for curve in curves])
    axes.set_xlim(float(times.min()), max(float(times.max()), float(times.min()) + 1e-9))
    set_even_ticks(axes.xaxis, MAX_TIME_INTERVALS)
    set_value_axis(axes.yaxis, np.concatenate([line[np.isfinite(line)] for line in lines]))
    quiet_axes(axes, theme, "time (s)", label, grid="y")
    for (_, _, time, _), style, band in zip(curves, chosen, around, strict=True):
        if band is not None:
            axes.fill_between(time, *band, color=tone(style.get_color(theme)), alpha=0.16, linewidth=0.0)
    ends = []
    for below, (curve, style) in enumerate(zip(curves, chosen, strict=True)):
        _, _, time, values = curve
        color, dashes, above = tone(style.get_color(theme)), style.dashes, min(len(curves) - 1 - below, 3)
        width = weight * (2.2 + 0.9 * above)
        if not isinstance(dashes, str):
            dashes = 0, tuple(2.2 * weight / width * part for part in dashes[1])
        axes.plot(time, values, color=color, linewidth=width, linestyle=dashes, dash_capstyle="butt")
        last = int(np.nonzero(np.isfinite(values))[0][-1])
        end: Any = {"markersize": weight * (6.5 + 2.0 * above), "clip_on": False, "zorder": 5}
        axes.plot(time[last], values[last], style.mark, color=color, **end)
        ends.append((float(time[last]), float(values[last]), color, end_label(curve, unit)))
    _draw_end_labels(axes, ends)


def _draw_end_labels(axes: Axes, ends: Sequence[tuple[float, float, Tone, str]]) -> None:
    """Write the words of each end (x, y, color, words) beside the axes, a line to what was moved."""
    dpi, box = figure_of(axes).dpi, axes.get_window_extent()
    point, line_height = dpi / 72 / box.width, 1.45 * TEXT * dpi / 72
    places = axes.transData.transform([(x, y) for x, y, _, _ in ends])[:, 1]
    heights = spread_labels(places.tolist(), line_height, float(box.y0), float(box.y1))
    words: Any = {"textcoords": axes.transAxes, "annotation_clip": False, "va": "center", "ha": "left"}
    words |= {"fontsize": TEXT, "fontweight": "bold"}
    for (x, y, color, text), place, height in zip(ends, places, heights, strict=True):
        fraction = (height - box.y0) / box.height
        axes.annotate(text, (x, y), (1.0 + 12 * point, fraction), color=color, **words)
        if abs(height - place) > 0.3 * line_height:
            line = [1.0 + 4 * point, 1.0 + 10 * point], [(place - box.y0) / box.height, fraction]
            axes.plot(*line, transform=axes.transAxes, color=color, linewidth=0.8, clip_on=False)
