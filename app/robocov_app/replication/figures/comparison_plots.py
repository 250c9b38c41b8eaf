"""Plots that compare contenders: pairs of runs, final costs, gaps and gain grids."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from robocov.typing import FloatArray
from robocov_app.figures.files import plain_style
from robocov_app.figures.final_values import Sample, plot_final_values
from robocov_app.figures.gains import GainGrid, draw_gain_grid
from robocov_app.figures.page import TITLE_SIZE_PT, FigurePage, PageBox, ValueAxis
from robocov_app.figures.pairs import Pairs, plot_pairs
from robocov_app.look.curve_styles import CurveStyle, choose_controller_styles, choose_curve_styles
from robocov_app.look.theme import Theme
from robocov_app.replication.design.contenders import OURS
from robocov_app.replication.figures.paper_figures import PAGE_SCALE, WIDE_PX
from robocov_app.replication.results.outcomes import GainOutcomes, Outcomes, PairedComparison, get_level

Draw: TypeAlias = Callable[[], Figure]
"""Draws a figure."""
Plots: TypeAlias = Mapping[str, Draw]
"""Plotting functions by name; plots without runs are left out."""

_GAP_TICKS = (0.0, 1.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 400.0, 800.0)
"""Ticks of an axis of gaps, %."""
_GRID_ROW_HEIGHT_PX = 24
"""Height of a row of a gain grid, px at scale 1."""
_GRID_LEFT_PX = 44
_GRID_RIGHT_PX = 10
_GRID_ABOVE_PX = 52
_GRID_BELOW_PX = 44
"""Space around a gain grid, px at scale 1."""
_GRID_NAME_RISE_PX = 36
"""Distance of the name of a gain grid above it, px at scale 1."""
_MIN_TICKS = 3
_TICK_STEPS = (0.01, 0.02, 0.05, 0.1)
_MAX_TICK_INTERVALS = 8


class PairsRow(NamedTuple):
    """A row of a plot of pairs."""

    text: str
    comparison: PairedComparison | None
    controller: str
    """Controller that determines the style of the row."""


class CostRow(NamedTuple):
    """A row of a plot of final costs."""

    text: str
    outcomes: Outcomes
    contender: str


def select_plots(plots: Mapping[str, Draw | None]) -> Plots:
    """Return the plots that have runs."""
    return {name: draw for name, draw in plots.items() if draw is not None}


def get_style(controller: str) -> CurveStyle:
    """Return the style of a controller among many: ours are highlighted, all baselines look the same."""
    style = choose_controller_styles([controller])[controller]
    if not style.name.startswith("other"):
        return style
    return style._replace(name="other-0" if controller in OURS else "other-2")


def prepare_pairs_plot(rows: Iterable[PairsRow], label: str, theme: Theme) -> Draw | None:
    """Return a function that draws the ratios of pairs of runs; None if there are no pairs.

    Parameters
    ----------
    rows : iterable of PairsRow
    label : str
        Label of the axis of ratios.
    theme : Theme
    """
    pairs = [
        Pairs(
            label=row.text,
            style=get_style(row.controller),
            ratios=row.comparison.ratios,
            interval=row.comparison.median_ratio,
        )
        for row in rows
        if row.comparison is not None
    ]
    return partial(_draw_pairs, pairs, label, theme) if pairs else None


def _draw_pairs(pairs: Sequence[Pairs], label: str, theme: Theme) -> Figure:
    """Plot pairs, with at least `_MIN_TICKS` ticks."""
    figure = plot_pairs(pairs, label, width=WIDE_PX, scale=PAGE_SCALE, theme=theme)
    (axes,) = figure.axes
    low, high = axes.get_xlim()
    if sum(low <= tick <= high for tick in axes.get_xticks()) < _MIN_TICKS:
        # If all ratios are near 1, the ticks of the logarithmic axis are too far apart; use equal steps.
        step = next(step for step in _TICK_STEPS if (high - low) / step <= _MAX_TICK_INTERVALS)
        axes.set_xticks(np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step)
    return figure


def build_cost_samples(rows: Iterable[CostRow]) -> list[Sample]:
    """Return the values of J / J_ref in each row; rows without values are left out."""
    texts = []
    controllers = []
    costs = []
    for row in rows:
        known = row.outcomes.select_finite("gap", row.contender)
        values = known.get_values(row.contender, "gap") + 1.0
        if len(values):
            texts.append(row.text)
            # The key of a contender starts with the name of its controller.
            controllers.append(row.contender.partition("-")[0])
            costs.append(values)
    styles = choose_curve_styles(controllers)
    return [Sample(text, style, values) for text, style, values in zip(texts, styles, costs, strict=True)]


def prepare_cost_ratio_plot(groups: Iterable[tuple[str, Sequence[Sample]]], theme: Theme) -> Draw | None:
    """Return a function that draws final J/J_ref in named groups; None if all groups are empty."""
    nonempty_groups = [(name, samples) for name, samples in groups if samples]
    if not nonempty_groups:
        return None
    value_axis = ValueAxis("final J/J_ref (1 = reference)", origin=1.0)
    return partial(
        plot_final_values, nonempty_groups, value_axis, width=WIDE_PX, scale=PAGE_SCALE, theme=theme
    )


@plain_style()
def draw_gaps(samples: Sequence[Sample], theme: Theme) -> Figure:
    """Draw gaps, in percent, on a square-root axis, which shows small gaps as well as large ones."""
    value_axis = ValueAxis("final gap (%)")
    figure = plot_final_values([("", samples)], value_axis, width=WIDE_PX, scale=PAGE_SCALE, theme=theme)
    (axes,) = figure.axes
    values = np.concatenate([sample.values for sample in samples])
    low = min(float(values.min()), 0.0)
    # The axis always includes the reference, even if all values are below it.
    high = max(float(values.max()), 0.0)
    functions = (partial(_compute_signed_power, exponent=0.5), partial(_compute_signed_power, exponent=2.0))
    axes.set_xscale("function", functions=functions)
    # Leave some space to the left of values below the reference.
    axes.set_xlim(-((float(np.sqrt(-low)) + 0.2) ** 2), 1.06 * high)
    axes.xaxis.set_major_locator(FixedLocator([tick for tick in _GAP_TICKS if tick <= high]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter("{x:g}")
    return figure


def _compute_signed_power(values: FloatArray, exponent: float) -> FloatArray:
    """Raise the absolute values to a power, but keep the signs."""
    return np.asarray(np.sign(values) * np.abs(values) ** exponent)


@plain_style()
def draw_gain_grids(gains: Mapping[str, GainOutcomes], theme: Theme) -> Figure:
    """Draw the mean gap, in percent, over k_rep and rho_0, for RPF and for RAPF with each k_att."""
    rpf = gains["rpf"].select_complete()
    rapf = gains["rapf"].select_complete()
    levels = rapf.list_levels("k_att")
    panels = [("RPF", rpf)]
    panels += [(f"RAPF, k_att = {level:g}", rapf.select_gain("k_att", level)) for level in levels]
    k_rep = rpf.list_levels("k_rep")
    rho_0 = rpf.list_levels("rho_0")
    columns = 3 if len(panels) > 4 else 2
    rows = math.ceil(len(panels) / columns)
    left = _GRID_LEFT_PX * PAGE_SCALE
    right = _GRID_RIGHT_PX * PAGE_SCALE
    above = _GRID_ABOVE_PX * PAGE_SCALE
    below = _GRID_BELOW_PX * PAGE_SCALE
    width = WIDE_PX / columns - left - right
    height = len(rho_0) * _GRID_ROW_HEIGHT_PX * PAGE_SCALE
    page = FigurePage((WIDE_PX, round(rows * (height + above + below))), theme, PAGE_SCALE)
    for number, (name, grid) in enumerate(panels):
        row, column = divmod(number, columns)
        x = left + column * (width + left + right)
        y = above + row * (height + above + below)
        axes = page.add_axes(PageBox(x, y, width, height))
        gap_grid = GainGrid(
            column_label="k_rep (N m³)",
            row_label="rho_0 (m)",
            columns=k_rep,
            rows=rho_0,
            values=_compute_mean_gaps(grid, k_rep, rho_0),
        )
        draw_gain_grid(axes, gap_grid, theme)
        page.write(name, x - left / 2, y - _GRID_NAME_RISE_PX * PAGE_SCALE, points=TITLE_SIZE_PT, bold=True)
    return page.figure


def _compute_mean_gaps(grid: GainOutcomes, k_rep: list[float], rho_0: list[float]) -> FloatArray:
    """Return the mean gap for each rho_0 (row) and k_rep (column), %.

    It is nan for pairs that were not tried or with a failed run.
    """
    gaps = np.full((len(rho_0), len(k_rep)), np.nan)
    for gains, relative_costs in zip(grid.gains, grid.relative_costs, strict=True):
        row = rho_0.index(get_level(gains, "rho_0"))
        column = k_rep.index(get_level(gains, "k_rep"))
        gaps[row, column] = 100.0 * (relative_costs.mean() - 1.0)
    return gaps
