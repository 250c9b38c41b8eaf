import numpy as np
import pytest

from robocov.metrics.run_metrics import RunMetrics
from robocov_app.figures.runs import METRIC_PANELS, MeasuredRun, plot_metrics


def measure_run(controller: str, seed: int) -> MeasuredRun:
    rng = np.random.default_rng(seed)
    rising = np.cumsum(rng.uniform(0, 1, (8, 11)), axis=1)
    metrics = RunMetrics(
        np.linspace(0.0, 5.0, 11), *rising[:6], np.ones(11, dtype=np.intp), *rising[[6, 7, 0]], 20.0
    )
    return MeasuredRun(controller.upper(), controller, metrics)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_panel_has_a_curve_of_each_run(theme: str) -> None:
    runs = [measure_run("rapf", 1), measure_run("rpf", 2)]
    figure = plot_metrics(runs, theme, "Two runs")
    assert len(figure.axes) == len(METRIC_PANELS)
    for axes, (label, _, of) in zip(figure.axes, METRIC_PANELS, strict=True):
        assert axes.get_ylabel() == label
        drawn = [np.asarray(line.get_ydata()) for line in axes.lines if len(line.get_xdata()) == 11]
        for run in runs:
            assert any(np.array_equal(line, of(run.metrics)) for line in drawn)
    # shares are of the free area
    assert METRIC_PANELS[0][2](runs[0].metrics)[-1] == pytest.approx(5.0 * runs[0].metrics.sensed_area[-1])


def test_time_axes_have_the_same_length() -> None:
    figure = plot_metrics([measure_run("rapf", 1)], "light", "One run")
    widths = {round(axes.get_position().width, 9) for axes in figure.axes}
    assert len(widths) == 1
