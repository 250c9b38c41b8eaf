"""Figures of the metrics of runs over time."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.metrics.run_metrics import RunMetrics
from robocov.typing import FloatArray
from robocov_app.figures.curves import (
    CurveMargins,
    TimeCurve,
    add_curve_axes,
    draw_curves,
    measure_end_labels,
)
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import FigurePage, PageBox, ValueAxis
from robocov_app.look.theme import Theme, get_theme

_PAGE_SIZE_PX = (1200, 800)
_TITLE_HEIGHT_PX = 40
"""Space above the panels at scale 1, px, for the title."""
_MARGINS = CurveMargins(left=44, top=36, bottom=48, right=36, max_right_fraction=0.5)


class MeasuredRun(NamedTuple):
    """A run with its metrics.

    Attributes
    ----------
    label : str
    controller : str
        Name of the controller, which decides the color.
    metrics : RunMetrics
    """

    label: str
    controller: str
    metrics: RunMetrics


class MetricPanel(NamedTuple):
    """A panel of `plot_metrics`.

    Attributes
    ----------
    label, unit : str
        Label of the value axis, and unit of the final values.
    get_values : callable
        Returns the plotted values of a run.
    """

    label: str
    unit: str
    get_values: Callable[[RunMetrics], FloatArray]


def to_free_area_percent(get_area: Callable[[RunMetrics], FloatArray]) -> Callable[[RunMetrics], FloatArray]:
    """Turn a function that returns areas into one that returns percentages of the free area."""
    return lambda metrics: np.asarray(100.0 * get_area(metrics) / metrics.free_area)


METRIC_PANELS = (
    MetricPanel(
        "sensed area (% of the free area)",
        "%",
        to_free_area_percent(lambda metrics: metrics.sensed_area),
    ),
    MetricPanel(
        "visible area (% of the free area)",
        "%",
        to_free_area_percent(lambda metrics: metrics.visible_area),
    ),
    MetricPanel("work ∫|F·v| dt (J)", "J", lambda metrics: metrics.work),
    MetricPanel("path length per robot (m)", "m", lambda metrics: metrics.path_length),
)


@plain_style()
def plot_metrics(runs: Sequence[MeasuredRun], theme: Theme | str, title: str) -> Figure:
    """Plot the metrics of runs against time in the panels of `METRIC_PANELS`.

    Parameters
    ----------
    runs : sequence of MeasuredRun
    theme : Theme or str
    title : str
        Title of the page.

    Returns
    -------
    matplotlib.figure.Figure
    """
    theme = get_theme(theme)
    page = FigurePage(_PAGE_SIZE_PX, theme)
    page.write_title(title, 26)
    curves_of_panels = [_build_curves(runs, panel) for panel in METRIC_PANELS]
    # All panels have space for the widest label, so that their time axes have the same length.
    label_width = max(
        measure_end_labels(page, curves, panel.unit)
        for curves, panel in zip(curves_of_panels, METRIC_PANELS, strict=True)
    )
    for number, (curves, panel) in enumerate(zip(curves_of_panels, METRIC_PANELS, strict=True)):
        axes = _create_axes(page, number, curves, label_width)
        maximum = max(float(np.nanmax(curve.values)) for curve in curves)
        value_axis = ValueAxis(panel.label, panel.unit, value_range=(0.0, maximum))
        draw_curves(axes, curves, theme, value_axis, weight=0.8)
    return page.figure


def _build_curves(runs: Sequence[MeasuredRun], panel: MetricPanel) -> list[TimeCurve]:
    """Build the curves of a panel, one for each run."""
    return [
        TimeCurve(run.label, run.controller, run.metrics.time, panel.get_values(run.metrics)) for run in runs
    ]


def _create_axes(page: FigurePage, number: int, curves: Sequence[TimeCurve], label_width: float) -> Axes:
    """Create the axes of a panel in a grid of 2 x 2, with space for the labels of its curves."""
    page_width, page_height = page.size
    top = _TITLE_HEIGHT_PX * page.scale
    width = page_width / 2
    height = (page_height - top) / 2
    row, column = divmod(number, 2)
    box = PageBox(column * width, top + row * height, width, height)
    return add_curve_axes(page, curves, _MARGINS, box=box, label_width=label_width)
