"""Plots of mean distances over time, and of final mean distances."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from robocov.errors import format_count
from robocov.typing import FloatArray
from robocov_app.figures.cost_bands import Band, compute_quartiles, plot_cost_bands
from robocov_app.figures.curves import DISTANCE
from robocov_app.figures.final_values import Sample, plot_final_values
from robocov_app.figures.page import ValueAxis
from robocov_app.report.analysis.scaling import compute_medians, scale_distances
from robocov_app.report.descriptions import format_seconds
from robocov_app.report.plots.plot import (
    FINAL_DISTANCE_LABEL,
    LARGE_PANEL_SIZE_PX,
    SCALED_DISTANCE_LABEL,
    DrawnPanel,
    GroupStyles,
    PagePlot,
    Panel,
    build_panel_plot,
    compute_map_ranges,
    list_panels,
)
from robocov_app.report.results.result import ReportedResult, ReportedRun

MIN_COMMON_FRACTION = 0.4
"""Maps have a common axis if the curves of each reach at least this fraction of it."""
_CURVE_SAMPLES = 121
"""Number of samples of a curve over time, about one for every three pixels."""


def build_cost_plots(result: ReportedResult, styles: GroupStyles, key: str) -> list[PagePlot]:
    """Build the plots of mean distances over time.

    Parameters
    ----------
    result : ReportedResult
    styles : mapping of str to CurveStyle
    key : str
        Start of the ids in the plots.

    Returns
    -------
    list of PagePlot
        First all settings together, as fractions of the values at the start, then each setting. Panels
        without any known cost are left out. All axes of distances are the same and begin at 0, unless the
        curves of a map would use less than `MIN_COMMON_FRACTION` of it; then only panels of a map have the
        same axis.
    """
    times, distances = _sample_histories(result)
    drawn_panels = []
    for panel in list_panels(result, key):
        bands = []
        for group in panel.groups:
            rows = [distances[run] for run in group.runs if run in distances]
            if panel.is_together:
                rows = [row / row[0] for row in rows if np.isfinite(row[0]) and row[0] > 0.0]
            if rows:
                bands.append(Band(group.label, styles[group.label], times, np.array(rows)))
        if bands:
            values = np.concatenate([compute_quartiles(band.values) for band in bands])
            drawn_panels.append(DrawnPanel(panel, bands, values))
    maxima = _choose_axis_maxima(drawn_panels)
    return [
        _build_cost_plot(drawn.panel, drawn.contents, maxima[drawn.panel.map_name]) for drawn in drawn_panels
    ]


def _choose_axis_maxima(panels: Sequence[DrawnPanel[Band]]) -> dict[str, float]:
    """Choose the largest value on the axis of each map, by `Panel.map_name`.

    All maps have the same axis, unless the curves of one would be too low to read.
    """
    maxima = {name: high for name, (_, high) in compute_map_ranges(panels).items()}
    map_maxima = [high for name, high in maxima.items() if name]
    if not map_maxima or min(map_maxima) < MIN_COMMON_FRACTION * max(map_maxima):
        return maxima
    common = max(map_maxima)
    return {name: common if name else high for name, high in maxima.items()}


def _sample_histories(result: ReportedResult) -> tuple[FloatArray, dict[ReportedRun, FloatArray]]:
    """Sample the mean distances of all runs at the same times.

    Return the times since the start, (T,) s, and the mean distances of each run, (T,) m, which are nan after
    the end of the run.
    """
    histories = {}
    for run in result.completed_runs:
        history = result.read_history(run)
        if history is not None and np.isfinite(history.mean_distance).any():
            histories[run] = history
    durations = [float(history.time[-1] - history.time[0]) for history in histories.values()]
    duration = max(durations, default=0.0)
    times = np.linspace(0.0, duration, _CURVE_SAMPLES if duration > 0.0 else 1)
    distances = {}
    for run, history in histories.items():
        time_since_start = history.time - history.time[0]
        distances[run] = np.interp(times, time_since_start, history.mean_distance, right=np.nan)
    return times, distances


def _build_cost_plot(panel: Panel, bands: list[Band], maximum: float) -> PagePlot:
    """Build the plot of the bands in a panel, with an axis from 0 to a maximum."""
    if panel.is_together:
        axis_label = "mean distance / initial mean distance"
        unit = ""
    else:
        axis_label = DISTANCE
        unit = " m"
    band_descriptions = "; ".join(_describe_band(band, unit) for band in bands)
    end = format_seconds(bands[0].time[-1])
    description = f"{axis_label} against time, up to {end}. {band_descriptions}."
    # The unit is in the label of the axis, because there is little space for the names of the curves.
    draw = partial(plot_cost_bands, bands, value_axis=ValueAxis(axis_label, value_range=(0.0, maximum)))
    return build_panel_plot(panel, description, draw, size=LARGE_PANEL_SIZE_PX)


def _describe_band(band: Band, unit: str) -> str:
    """Describe the last values of a band: the median and, for several runs, the quartiles."""
    low, middle, high = (row[np.isfinite(row)][-1] for row in compute_quartiles(band.values))
    text = f"{band.label}: {middle:.3f}{unit}"
    if len(band.values) > 1:
        runs = len(band.values)
        text += f" at the end (median of {runs} runs, quartiles {low:.3f} to {high:.3f})"
    return text


def build_final_distance_plots(result: ReportedResult, styles: GroupStyles, key: str) -> list[PagePlot]:
    """Build the plots of the distributions of final mean distances.

    Parameters
    ----------
    result : ReportedResult
    styles : mapping of str to CurveStyle
    key : str
        Start of the ids in the plots.

    Returns
    -------
    list of PagePlot
        First all settings together, divided by their medians, then each setting. Panels in which no group
        has several runs are left out. The panels of a map have the same axis.
    """
    medians = compute_medians(result)
    meters = dict.fromkeys(result.completed_runs, 1.0)
    drawn_panels = []
    for panel in list_panels(result, key):
        scales = medians if panel.is_together else meters
        samples = []
        for group in panel.groups:
            distances = scale_distances(group.runs, scales)
            if len(distances):
                samples.append(Sample(group.label, styles[group.label], distances))
        if max((len(sample.values) for sample in samples), default=0) > 1:
            values = np.concatenate([sample.values for sample in samples])
            drawn_panels.append(DrawnPanel(panel, samples, values))
    ranges = compute_map_ranges(drawn_panels)
    return [
        _build_final_distance_plot(drawn.panel, drawn.contents, ranges[drawn.panel.map_name])
        for drawn in drawn_panels
    ]


def _build_final_distance_plot(
    panel: Panel, samples: list[Sample], value_range: tuple[float, float]
) -> PagePlot:
    """Build the plot of the samples in a panel, with an axis for a range of values."""
    if panel.is_together:
        axis_label = SCALED_DISTANCE_LABEL
        unit = ""
    else:
        axis_label = FINAL_DISTANCE_LABEL
        unit = " m"
    sample_descriptions = "; ".join(_describe_sample(sample, unit) for sample in samples)
    value_axis = ValueAxis(axis_label, value_range=value_range)

    def draw(size: tuple[int, int]) -> Figure:
        width, _ = size
        return plot_final_values([("", samples)], value_axis, width=width, scale=1.0)

    return build_panel_plot(panel, f"{axis_label}. {sample_descriptions}.", draw)


def _describe_sample(sample: Sample, unit: str) -> str:
    """Describe the median and the quartiles of a sample."""
    low, middle, high = np.percentile(sample.values, [25, 50, 75])
    text = f"{sample.label}: median {middle:.3f}{unit}, quartiles {low:.3f} to {high:.3f}"
    return f"{text}, {format_count(len(sample.values), 'run')}"
