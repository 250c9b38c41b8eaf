"""Metrics of runs against time, in small panels."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from robocov.arrays import Array
from robocov.metrics.run_metrics import RunMetrics
from robocov_app.figures.curves import draw_curves, end_label
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import Page
from robocov_app.render.theme import Theme, theme_named


class Measured(NamedTuple):
    """A run and what was measured of it."""

    label: str
    controller: str
    metrics: RunMetrics


def share(area: Callable[[RunMetrics], Array]) -> Callable[[RunMetrics], Array]:
    return lambda metrics: np.asarray(100.0 * area(metrics) / metrics.free_area)


# label, unit and values of each panel
PANELS: tuple[tuple[str, str, Callable[[RunMetrics], Array]], ...] = (
    ("sensed, in line of sight (% of the free area)", "%", share(lambda each: each.sensed_area)),
    ("in line of sight (% of the free area)", "%", share(lambda each: each.visible_area)),
    ("work |F v| (J)", "J", lambda each: each.work),
    ("way of a robot (m)", "m", lambda each: each.path_length),
)


@plain_style()
def plot_metrics(runs: Sequence[Measured], theme: Theme | str, title: str) -> Figure:
    """Plot the metrics of runs against time, each curve named with its value at the end."""
    theme = theme_named(theme)
    page = Page((1200, 800), theme)
    s = page.scale
    page.title(title, 26)
    width, height = 600.0, 400.0 - 20 * s
    for k, (label, unit, of) in enumerate(PANELS):
        curves = [(each.label, each.controller, each.metrics.time, of(each.metrics)) for each in runs]
        longest = max(page.text_width(end_label(curve, unit), bold=True) for curve in curves)
        row, column = divmod(k, 2)
        left, top = column * width + 44 * s, 40 * s + row * height + 36 * s
        right = min(24 * s + longest, 0.5 * width)
        axes = page.axes((left, top, width - 44 * s - right, height - 84 * s))
        draw_curves(axes, curves, theme, label=label, unit=unit, weight=0.8)
    return page.figure
