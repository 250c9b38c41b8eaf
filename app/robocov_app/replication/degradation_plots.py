"""The plot of how much worse coverage gets when things go wrong: one panel for each of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import ParameterError
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL, TEXT, TITLE, Box, Page, tone
from robocov_app.figures.styles import curve_styles
from robocov_app.render.theme import LIGHT, Theme, mix, theme_named
from robocov_app.sweep.study import UNITS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from robocov_app.figures.styles import CurveStyle
    from robocov_app.replication.degradation import Degradation

_TITLES = {
    "loss": "Messages lost",
    "delay": "Delay of messages",
    "message_rate": "Messages a second",
    "communication_range": "Communication range",
    "position_noise": "Noise of own position",
    "sensing_noise": "Noise of range sensor",
    "failure_rate": "Failures of each robot",
    "sensing_range": "Sensing range",
}

_APART = 0.11
"""How far controllers stand beside each other, in distances between two values."""


def plot_degradations(
    found: Sequence[Degradation],
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Coverage when things go wrong",
) -> Figure:
    """Plot the final cost as a multiple of that of the run in which nothing goes wrong, with intervals.

    Parameters
    ----------
    found : sequence of Degradation
    theme : Theme or {"light", "dark"}
    size : (width, height) or None, px
    title : str

    Returns
    -------
    matplotlib Figure

    Raises
    ------
    ParameterError
        When there is nothing.
    """
    if not any(np.isfinite(each.ratio.estimate) for each in found):
        raise ParameterError("degradations: none with a ratio, but at least one was wanted")
    theme = theme_named(theme)
    axes_of: dict[str, list[Degradation]] = {}
    for each in found:
        axes_of.setdefault(each.axis, []).append(each)
    styles = curve_styles(each.controller for each in found)
    columns = min(3, len(axes_of))
    rows = -(-len(axes_of) // columns)
    size = size or (380 * columns + 40, 300 * rows + 110)
    with plain_style():
        page = Page(size, theme, scale=1.0)
        page.text(title, page.margin, 26, points=TITLE, bold=True)
        page.text(
            "final mean distance, as a multiple of the same run's in which that does not go wrong",
            page.margin,
            50,
            colour=mix(theme.background, theme.ink, 0.7),
            room=size[0] - 2 * page.margin,
        )
        high = max(max(each.ratio.estimate, each.ratio.high) for each in found if each.ratio.estimate > 0)
        low = min(min(each.ratio.estimate, each.ratio.low) for each in found if each.ratio.estimate > 0)
        bottom, top = min(low, 1.0), max(high, 1.05)
        span = (bottom - 0.06 * (top - bottom), top + 0.06 * (top - bottom))
        for (name, part), box in zip(axes_of.items(), _boxes(len(axes_of), columns, size), strict=True):
            _panel(page.axes(box), name, part, styles, theme, span)
        _legend(page, found, styles)
    return page.figure


def _boxes(count: int, columns: int, size: tuple[int, int]) -> list[Box]:
    width, height = (size[0] - 40) / columns, (size[1] - 110) / -(-count // columns)
    return [
        (20 + (k % columns) * width + 44, 74 + (k // columns) * height + 26, width - 60, height - 84)
        for k in range(count)
    ]


def _panel(
    axes: Axes,
    name: str,
    part: Sequence[Degradation],
    styles: Mapping[str, CurveStyle],
    theme: Theme,
    span: tuple[float, float],
) -> None:
    values = list(dict.fromkeys(each.value for each in part))
    controllers = list(dict.fromkeys(each.controller for each in part))
    axes.set_facecolor(tone(theme.background))
    axes.axhline(1.0, color=tone(mix(theme.background, theme.ink, 0.35)), linewidth=1.0, zorder=1)
    for k, controller in enumerate(controllers):
        style = styles[controller]
        colour = tone(style.colour(theme))
        rows = [each for each in part if each.controller == controller]
        x = np.array([values.index(each.value) for each in rows]) + _APART * (k - (len(controllers) - 1) / 2)
        y = np.array([each.ratio.estimate for each in rows])
        ends = np.array([[each.ratio.low, each.ratio.high] for each in rows])
        off = np.abs(ends - y[:, None]).T
        axes.plot(x, y, color=colour, linewidth=1.6, linestyle=style.dashes, zorder=3)
        axes.errorbar(
            x, y, np.nan_to_num(off), fmt="none", ecolor=colour, elinewidth=1.4, capsize=2.5, zorder=3
        )
        axes.plot(x, y, color=colour, linestyle="none", marker=style.mark, markersize=5.5, zorder=4)
    unit = UNITS[name]
    axes.set_xticks(range(len(values)), ["no limit" if v is None else f"{v:g}" for v in values])
    axes.set_xlim(-0.4, len(values) - 0.6)
    axes.set_ylim(*span)
    axes.set_title(
        _TITLES.get(name, name.replace("_", " ")) + (f" ({unit})" if unit else ""),
        fontsize=TEXT,
        color=tone(theme.ink),
        loc="left",
    )
    axes.tick_params(labelsize=SMALL, colors=tone(theme.ink), length=3)
    axes.grid(axis="y", color=tone(theme.grid), linewidth=0.8, zorder=0)
    axes.set_axisbelow(True)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color(tone(mix(theme.background, theme.ink, 0.5)))


def _legend(page: Page, found: Sequence[Degradation], styles: Mapping[str, CurveStyle]) -> None:
    from matplotlib.lines import Line2D

    labels = {each.controller: each.label for each in found}
    handles: list[Artist] = []
    for controller, label in labels.items():
        style = styles[controller]
        handles.append(
            Line2D(
                [],
                [],
                color=tone(style.colour(page.theme)),
                linestyle=style.dashes,
                marker=style.mark,
                markersize=5.5,
                label=label,
            )
        )
    pairs = max(each.runs for each in found)
    page.figure.legend(
        handles=handles,
        loc="center right",
        bbox_to_anchor=page.at(page.size[0] - page.margin, 26),
        ncols=len(handles),
        frameon=False,
        fontsize=SMALL,
        labelcolor=tone(page.theme.ink),
    )
    page.text(
        f"medians of {pairs} pairs of runs, and 95 % intervals; only robots that work count",
        page.margin,
        page.size[1] - 18,
        points=SMALL,
        colour=mix(page.theme.background, page.theme.ink, 0.7),
    )
