"""Plots of metrics over time, for runs and comparisons."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from robocov.metrics.run_metrics import RunMetrics, compute_run_metrics
from robocov.typing import FloatArray
from robocov_app.figures.cost_bands import Band, plot_cost_bands
from robocov_app.figures.curves import TIME
from robocov_app.figures.metric_curves import to_free_area_percent
from robocov_app.figures.page import ValueAxis
from robocov_app.look.labels import append_unit
from robocov_app.report.embedding import ReplayRun
from robocov_app.report.pictures import has_path
from robocov_app.report.plots.plot import PANEL_SIZE_PX, GroupStyles, PagePlot
from robocov_app.report.results.result import ReportedResult
from robocov_app.report.svg import inline_svg

MAX_MEASURED_RUNS = 4
MAX_MEASURED_ROBOTS = 60
"""Maximum number of robots of a measured run, because computing their visible areas takes time."""
_SAMPLES_PER_RUN = 30
"""Number of times after its start at which a run is measured."""


class _Metric(NamedTuple):
    """A metric that is plotted.

    Attributes
    ----------
    title : str
    label : str
        Label of the axis.
    unit : str
    get_values : callable
        Returns the values of the metric over time.
    """

    title: str
    label: str
    unit: str
    get_values: Callable[[RunMetrics], FloatArray]


class _MetricCurves(NamedTuple):
    """The curves of a plot.

    Attributes
    ----------
    title, label, unit : str
        See `_Metric`.
    curves : list of ((T,) array, (T,) array)
        Times, s, and values of each run.
    """

    title: str
    label: str
    unit: str
    curves: list[tuple[FloatArray, FloatArray]]


def _round_to_millimeters(gaps: FloatArray) -> FloatArray:
    """Round gaps to 1 mm, since the solver tolerates smaller overlaps, and replace negative zeros by 0."""
    return np.asarray(np.round(gaps, 3) + 0.0)


_CONNECTIVITY = _Metric(
    title="Connectivity",
    label="groups of robots that can communicate",
    unit="",
    get_values=lambda metrics: np.asarray(metrics.components, float),
)
_METRICS = (
    _Metric(
        title="Sensed area",
        label="sensed area (% of the free area)",
        unit="%",
        get_values=to_free_area_percent(lambda metrics: metrics.sensed_area),
    ),
    _Metric(
        title="Visible area",
        label="visible area (% of the free area)",
        unit="%",
        get_values=to_free_area_percent(lambda metrics: metrics.visible_area),
    ),
    _Metric(
        title="Energy",
        label="work ∫|F·v| dt so far (J)",
        unit="J",
        get_values=lambda metrics: metrics.work,
    ),
    _Metric(
        title="Path",
        label="mean path length so far (m)",
        unit="m",
        get_values=lambda metrics: metrics.path_length,
    ),
    _Metric(
        title="Clearance",
        label="smallest distance to a wall (m)",
        unit="m",
        get_values=lambda metrics: _round_to_millimeters(metrics.wall_clearance),
    ),
    _Metric(
        title="Separation",
        label="smallest distance between robots (m)",
        unit="m",
        get_values=lambda metrics: _round_to_millimeters(metrics.robot_clearance),
    ),
)


def build_metric_plots(
    result: ReportedResult, runs: Sequence[ReplayRun], styles: GroupStyles, key: str
) -> list[PagePlot]:
    """Build a plot for each metric.

    Parameters
    ----------
    result : ReportedResult
    runs : sequence of ReplayRun
    styles : mapping of str to CurveStyle
    key : str
        Start of the ids in the plots.

    Returns
    -------
    list of PagePlot
        Empty if the result is a sweep, has too many runs or robots, or lacks trajectories. Mean times are
        plotted only if they are known, and connectivity only if it changes.
    """
    if result.kind == "sweep" or not _are_measurable(runs):
        return []
    plots = []
    for metric_curves in _list_metric_curves(runs):
        bands = _build_bands(metric_curves, runs, styles)
        if bands:
            plots.append(_build_metric_plot(metric_curves, bands, key))
    return plots


def _are_measurable(runs: Sequence[ReplayRun]) -> bool:
    """Return whether the metrics of runs can be computed: trajectories are known, and it is not too slow."""
    if not 0 < len(runs) <= MAX_MEASURED_RUNS:
        return False
    return all(len(run.record.team) <= MAX_MEASURED_ROBOTS and has_path(run.record) for run in runs)


def _list_metric_curves(runs: Sequence[ReplayRun]) -> list[_MetricCurves]:
    """Compute the metrics of runs, and list their curves."""
    all_metrics = [_measure(run) for run in runs]
    metric_curves = []
    mean_times = [
        (run.history.time, run.history.mean_time)
        for run in runs
        if run.history is not None and run.history.mean_time is not None
    ]
    if len(mean_times) == len(runs):
        metric_curves.append(_MetricCurves("Travel time", TIME, "s", mean_times))
    metrics_to_plot = list(_METRICS)
    if any((metrics.components != metrics.components[0]).any() for metrics in all_metrics):
        metrics_to_plot.append(_CONNECTIVITY)
    for metric in metrics_to_plot:
        curves = [(metrics.time, metric.get_values(metrics)) for metrics in all_metrics]
        metric_curves.append(_MetricCurves(metric.title, metric.label, metric.unit, curves))
    return metric_curves


def _measure(run: ReplayRun) -> RunMetrics:
    """Compute the metrics of a run at equal time steps."""
    duration = float(run.record.time[-1] - run.record.time[0])
    rate = _SAMPLES_PER_RUN / duration if duration > 0.0 else 0.0
    return compute_run_metrics(run.record, rate)


def _build_bands(metric_curves: _MetricCurves, runs: Sequence[ReplayRun], styles: GroupStyles) -> list[Band]:
    """Build a band, which is a single line, for each run with any finite value."""
    bands = []
    for run, (times, values) in zip(runs, metric_curves.curves, strict=True):
        is_finite = np.isfinite(values)
        if is_finite.any():
            row = np.where(is_finite, values, np.nan)
            bands.append(Band(run.label, styles[run.label], times - times[0], row[None]))
    return bands


def _build_metric_plot(metric_curves: _MetricCurves, bands: Sequence[Band], key: str) -> PagePlot:
    """Build the plot of a metric."""
    title = metric_curves.title
    label = metric_curves.label
    unit = metric_curves.unit
    texts = []
    for band in bands:
        finite_values = band.values[0][np.isfinite(band.values[0])]
        first, last = finite_values[[0, -1]]
        last_value = append_unit(f"{last:.4g}", unit)
        texts.append(f"{band.label}: from {first:.4g} to {last_value}")
    description = f"{title}: {label} against time. {'; '.join(texts)}."
    figure = plot_cost_bands(bands, PANEL_SIZE_PX, ValueAxis(label, unit))
    svg_key = f"{key}-{title.lower().replace(' ', '-')}"
    return PagePlot(title, inline_svg(figure, svg_key, description))
