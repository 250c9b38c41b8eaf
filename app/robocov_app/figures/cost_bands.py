"""Plots of runs over time: medians with bands between the quartiles."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from robocov.typing import FloatArray
from robocov_app.figures.curves import (
    CurveMargins,
    StyledCurve,
    TimeCurve,
    add_curve_axes,
    draw_styled_curves,
    format_end_label,
)
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import FigurePage, ValueAxis
from robocov_app.look.curve_styles import CurveStyle
from robocov_app.look.labels import shorten_text
from robocov_app.look.theme import LIGHT

_FULL_WEIGHT_WIDTH_PX = 700.0
"""Minimum width of a page on which lines have their full width; on narrower pages they are thinner."""
_SMALL_WEIGHT = 0.7
_MARGINS = CurveMargins(left=44, top=44, bottom=50, right=42, max_right_fraction=1.0)
_MAX_NAME_FRACTION = 0.5
"""Maximum fraction of the page width for a shortened name, its value and the margin on the right."""


class Band(NamedTuple):
    """The runs of one controller over time.

    Attributes
    ----------
    label : str
    style : CurveStyle
    time : (T,) array, s
    values : (m, T) array
        Values of each run; nan if there is none.
    """

    label: str
    style: CurveStyle
    time: FloatArray
    values: FloatArray


@plain_style()
def plot_cost_bands(bands: Sequence[Band], size: tuple[int, int], value_axis: ValueAxis) -> Figure:
    """Plot the values of runs against time, with one color for each controller.

    Parameters
    ----------
    bands : sequence of Band
        Several runs are drawn as their median with a band between the quartiles, a single run as a line.
    size : (width, height), px
    value_axis : ValueAxis
        Its unit is that of the final values at the ends of the curves.

    Returns
    -------
    matplotlib.figure.Figure
    """
    page = FigurePage(size, LIGHT, 1.0)
    weight = 1.0
    if page.size[0] < _FULL_WEIGHT_WIDTH_PX:
        weight = _SMALL_WEIGHT
    styled_curves = []
    for band in bands:
        low, middle, high = compute_quartiles(band.values)
        curve = _build_curve(page, band, middle, value_axis.unit)
        quartile_band = (low, high) if len(band.values) > 1 else None
        styled_curves.append(StyledCurve(curve, band.style, quartile_band))
    curves = [item.curve for item in styled_curves]
    axes = add_curve_axes(page, curves, _MARGINS, unit=value_axis.unit)
    draw_styled_curves(axes, styled_curves, LIGHT, value_axis, weight=weight)
    return page.figure


def _build_curve(page: FigurePage, band: Band, median: FloatArray, unit: str) -> TimeCurve:
    """Return the median curve of a band, its name shortened so that the end label fits on the page."""

    def measure_end_label(name: str) -> float:
        return page.measure_text(format_end_label(TimeCurve(name, "", band.time, median), unit), bold=True)

    max_width = _MAX_NAME_FRACTION * page.size[0] - _MARGINS.right
    name = shorten_text(band.label, measure_end_label, max_width, min_chars=1)
    return TimeCurve(name, band.style.name, band.time, median)


def compute_quartiles(values: FloatArray) -> FloatArray:
    """Compute the quartiles and the median over runs at each time.

    Parameters
    ----------
    values : (m, T) array
        Values that are not finite are ignored.

    Returns
    -------
    (3, T) array
        First quartile, median and third quartile; nan at times without a value.
    """
    finite_values = np.where(np.isfinite(values), values, np.nan)
    quartiles = np.full((3, values.shape[1]), np.nan)
    has_value = ~np.isnan(finite_values).all(axis=0)
    quartiles[:, has_value] = np.nanpercentile(finite_values[:, has_value], [25, 50, 75], axis=0)
    return quartiles
