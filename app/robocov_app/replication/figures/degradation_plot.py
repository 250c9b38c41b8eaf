"""Plot of final costs under disturbances, with a panel for each kind of disturbance."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.errors import format_count
from robocov.typing import FloatArray
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import (
    SMALL_SIZE_PT,
    TEXT_SIZE_PT,
    FigurePage,
    PageBox,
    style_axes,
    to_plot_color,
)
from robocov_app.look.colors import mix
from robocov_app.look.curve_styles import CurveStyle, choose_controller_styles
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.replication.figures.paper_figures import CAPTIONS
from robocov_app.replication.results.study_results import Degradation
from robocov_app.sweep.study.parameters import UNITS

_SIZE_PX = (1180, 720)
_MAX_COLUMNS = 3
_SIDES_PX = 40
"""Space to the left and to the right of all panels."""
_HEAD_AND_FOOT_PX = 110
"""Space above and below all panels."""
_FIRST_PANEL_LEFT_PX = 64
_FIRST_PANEL_TOP_PX = 100
_PANEL_GAP_PX = 60
"""Space between the axes of adjacent panels."""
_PANEL_LABELS_PX = 84
"""Space for the title and the labels of a panel, above and below its axes."""
_OFFSET = 0.11
"""Horizontal distance between controllers at the same value; the distance between values is 1."""
_TEXT_STRENGTH = 0.7
_REFERENCE_LINE_STRENGTH = 0.35


@plain_style()
def draw_degradations(degradations: Sequence[Degradation], theme: Theme | str = LIGHT) -> Figure:
    """Draw final costs relative to those without disturbances, in a panel for each kind of disturbance.

    Parameters
    ----------
    degradations : sequence of Degradation
        At least one.
    theme : Theme or str

    Returns
    -------
    Figure
    """
    theme = get_theme(theme)
    width, height = _SIZE_PX
    quiet = mix(theme.background, theme.ink, _TEXT_STRENGTH)
    names = list(dict.fromkeys(degradation.axis for degradation in degradations))
    columns = min(_MAX_COLUMNS, len(names))
    rows = math.ceil(len(names) / columns)
    slot_width = (width - _SIDES_PX) / columns
    slot_height = (height - _HEAD_AND_FOOT_PX) / rows
    bottom, top = _find_limits(degradations)
    page = FigurePage(_SIZE_PX, theme, scale=1.0)
    page.write_title("Coverage under disturbances", 26)
    subtitle = "final mean distance relative to the same run without the disturbance"
    page.write(subtitle, page.margin, 50, color=quiet, max_width=page.content_width)
    for number, name in enumerate(names):
        row, column = divmod(number, columns)
        x = _FIRST_PANEL_LEFT_PX + column * slot_width
        y = _FIRST_PANEL_TOP_PX + row * slot_height
        axes = page.add_axes(PageBox(x, y, slot_width - _PANEL_GAP_PX, slot_height - _PANEL_LABELS_PX))
        axes.set_ylim(bottom, top)
        _draw_panel(
            axes, name, [degradation for degradation in degradations if degradation.axis == name], theme
        )
    handles, labels = page.figure.axes[0].get_legend_handles_labels()
    page.figure.legend(
        handles,
        labels,
        ncols=len(handles),
        loc="center right",
        bbox_to_anchor=page.to_figure(width - page.margin, 26),
        frameon=False,
        fontsize=SMALL_SIZE_PT,
        labelcolor=to_plot_color(theme.ink),
    )
    pairs = format_count(max(degradation.runs for degradation in degradations), "pair")
    note = f"medians of {pairs} of runs, and 95% intervals; only working robots count"
    page.write(note, page.margin, height - 18, points=SMALL_SIZE_PT, color=quiet)
    return page.figure


def _find_limits(degradations: Sequence[Degradation]) -> tuple[float, float]:
    """Return the vertical limits that all panels share: they include 1 and all intervals."""
    values = []
    for degradation in degradations:
        values += [degradation.ratio.estimate, degradation.ratio.low, degradation.ratio.high]
    bottom = min(1.0, float(np.nanmin(values)))
    top = max(1.05, float(np.nanmax(values)))
    margin = 0.06 * (top - bottom)
    return bottom - margin, top + margin


def _draw_panel(axes: Axes, name: str, degradations: Sequence[Degradation], theme: Theme) -> None:
    """Draw the panel of a disturbance: the values next to each other, the controllers slightly shifted."""
    values = list(dict.fromkeys(degradation.value for degradation in degradations))
    styles = choose_controller_styles(degradation.controller for degradation in degradations)
    axes.axhline(
        1.0,
        color=to_plot_color(mix(theme.background, theme.ink, _REFERENCE_LINE_STRENGTH)),
        linewidth=1.0,
        zorder=1,
    )
    for k, (controller, style) in enumerate(styles.items()):
        own = [degradation for degradation in degradations if degradation.controller == controller]
        offset = _OFFSET * (k - (len(styles) - 1) / 2)
        x = np.array([values.index(degradation.value) for degradation in own]) + offset
        _draw_curve(axes, x, own, style, theme)
    unit = f" ({UNITS[name]})" if UNITS[name] else ""
    title = f"{CAPTIONS[f'axis-{name}']}{unit}"
    axes.set_title(title, fontsize=TEXT_SIZE_PT, color=to_plot_color(theme.ink), loc="left")
    labels = ["no limit" if value is None else f"{value:g}" for value in values]
    axes.set_xticks(range(len(values)), labels)
    axes.set_xlim(-0.4, len(values) - 0.6)
    style_axes(axes, theme, grid="y")


def _draw_curve(
    axes: Axes, x: FloatArray, degradations: Sequence[Degradation], style: CurveStyle, theme: Theme
) -> None:
    """Draw the median ratios of a controller, with error bars for their confidence intervals."""
    color = to_plot_color(style.get_color(theme))
    y = np.array([degradation.ratio.estimate for degradation in degradations])
    ends = np.array([[degradation.ratio.low, degradation.ratio.high] for degradation in degradations])
    # matplotlib expects the distances from the estimate to both ends, (2, k).
    errors = np.nan_to_num(np.abs(ends - y[:, None]).T)
    axes.errorbar(x, y, errors, fmt="none", ecolor=color, elinewidth=1.4, capsize=2.5, zorder=3)
    axes.plot(
        x,
        y,
        label=degradations[0].label,
        color=color,
        zorder=3,
        linewidth=1.6,
        linestyle=style.dashes,
        marker=style.mark,
        markersize=5.5,
    )
