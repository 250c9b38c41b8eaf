"""Plots of the metrics of runs."""

import numpy as np
import pytest
from matplotlib.axes import Axes

from robocov.metrics.run_metrics import RunMetrics
from robocov_app.figures.metric_curves import METRIC_PANELS, MeasuredRun, plot_metrics

TIME = np.linspace(0.0, 5.0, 11)
FREE_AREA = 20.0


def build_run(controller: str, seed: int) -> MeasuredRun:
    """Return a run whose metrics rise at random."""
    increments = np.random.default_rng(seed).uniform(0, 1, (8, len(TIME)))
    rising = np.cumsum(increments, axis=1)
    metrics = RunMetrics(
        time=TIME,
        sensed_area=rising[0],
        range_area=rising[1],
        visible_area=rising[2],
        work=rising[3],
        effort=rising[4],
        path_length=rising[5],
        components=np.ones(len(TIME), dtype=np.intp),
        algebraic_connectivity=rising[6],
        wall_clearance=rising[7],
        robot_clearance=rising[0],
        free_area=FREE_AREA,
    )
    return MeasuredRun(controller.upper(), controller, metrics)


def list_curves(axes: Axes) -> list[list[float]]:
    """Return the values of each curve of axes, without end marks."""
    lines = [line for line in axes.lines if len(line.get_xdata()) == len(TIME)]
    return [np.asarray(line.get_ydata()).tolist() for line in lines]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_each_panel_has_a_curve_of_each_run(theme: str) -> None:
    runs = [build_run("rapf", 1), build_run("rpf", 2)]
    figure = plot_metrics(runs, theme, "Two runs")
    assert len(figure.axes) == len(METRIC_PANELS)
    for axes, panel in zip(figure.axes, METRIC_PANELS, strict=True):
        assert axes.get_ylabel() == panel.label
        curves = list_curves(axes)
        for run in runs:
            assert panel.get_values(run.metrics).tolist() in curves


def test_areas_are_percentages_of_the_free_area() -> None:
    metrics = build_run("rapf", 1).metrics
    percentages = METRIC_PANELS[0].get_values(metrics)
    assert percentages == pytest.approx(100.0 * metrics.sensed_area / FREE_AREA)


def test_time_axes_have_the_same_length() -> None:
    figure = plot_metrics([build_run("rapf", 1)], "light", "One run")
    widths = {round(axes.get_position().width, 9) for axes in figure.axes}
    assert len(widths) == 1


def test_value_axes_start_at_zero():
    figure = plot_metrics([build_run("rapf", 1)], "light", "One run")
    assert [axes.get_ylim()[0] for axes in figure.axes] == [0.0] * len(METRIC_PANELS)
