"""Figures of mean distances over time."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.errors import ParameterError, quote
from robocov_app.figures.curves import CurveMargins, TimeCurve, add_curve_axes, draw_curves
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import TITLE_SIZE_PT, FigurePage, check_not_empty, get_figure, require_page_size
from robocov_app.look.theme import LIGHT, Theme, get_theme

_MARGINS = CurveMargins(left=52, top=86, bottom=56, right=52)
"""Space around the curves on a page without maps; the title is above them."""
_REFERENCE_SIZE_PX = (800, 450)
"""Size of a page without maps on which texts have scale 1."""
_MIN_SCALE = 0.8
_MAX_SCALE = 6.0
_TITLE_ROW_PX = 30
"""Distance of the middle of the title from the upper edge at scale 1."""


@plain_style()
def plot_cost(
    curves: Sequence[TimeCurve],
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Mean distance over time",
) -> Figure:
    """Plot mean distances against time, each curve labeled at its end with its name and final value.

    Parameters
    ----------
    curves : sequence of TimeCurve
    axes : matplotlib.axes.Axes, optional
        By default, new axes on a separate page.
    theme : Theme or str
    size : (width, height), px, optional
        Size of the page.
    title : str
        Title of the page.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ParameterError
        If there are no curves, or one has no finite value.
    """
    check_not_empty("curves", curves)
    for curve in curves:
        _check_curve(curve)
    theme = get_theme(theme)
    if axes is None:
        axes = _create_page(curves, theme, size or (1000, 560), title)
    draw_curves(axes, curves, theme)
    return get_figure(axes)


def _check_curve(curve: TimeCurve) -> None:
    """Raise a ParameterError unless a curve has a value for each time, at least one of them finite."""
    if len(curve.times) != len(curve.values) or not np.isfinite(curve.values).any():
        finite = int(np.isfinite(curve.values).sum())
        raise ParameterError(
            f"curve {quote(curve.label)}: expected a value for each time, at least one of them finite, "
            f"got {len(curve.times)} times and {finite} finite values"
        )


def _create_page(curves: Sequence[TimeCurve], theme: Theme, size: tuple[int, int], title: str) -> Axes:
    """Create a page with only curves, whose texts can be larger than on pages with maps."""
    require_page_size(size)
    width, height = size
    reference_width, reference_height = _REFERENCE_SIZE_PX
    fitting_scale = min(width / reference_width, height / reference_height)
    page = FigurePage(size, theme, float(np.clip(fitting_scale, _MIN_SCALE, _MAX_SCALE)))
    left = _MARGINS.left * page.scale
    title_row = _TITLE_ROW_PX * page.scale
    page.write(title, left, title_row, points=TITLE_SIZE_PT, bold=True, max_width=width - left - page.margin)
    return add_curve_axes(page, curves, _MARGINS)
