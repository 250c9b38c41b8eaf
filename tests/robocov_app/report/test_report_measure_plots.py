"""The metrics of single runs as small plots of the report."""

from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest
from reported_results import entry, falling, result_of, walk

from robocov.metrics import CostHistory
from robocov.metrics.run_metrics import compute_run_metrics
from robocov.team import Team
from robocov_app.report.embedding import ReplayRun
from robocov_app.report.groups import styles
from robocov_app.report.plots import MOST_MEASURED, MOST_ROBOTS, measure_plots

ENTRIES = [entry("rapf"), entry("rpf")]
RESULT = replace(result_of(ENTRIES), kind="comparison")


def run_of(controller: str = "rapf", timed: bool = False, **walking) -> ReplayRun:
    record = walk(controller=controller, **walking)
    history: CostHistory = falling(record, 2.0)
    if timed:
        history = replace(history, mean_time=2.0 * history.mean_distance)
    return ReplayRun(record, history, "a run")


def plots_of(runs: list[ReplayRun], result=RESULT) -> dict[str, str]:
    shown = [replace(run, label=each.label) for run, each in zip(runs, cycle(result.entries), strict=False)]
    plots = measure_plots(result, shown, styles(result), "m")
    return {plot.title: plot.svg for plot in plots}


def test_every_metric_has_a_plot_of_all_runs_with_its_end_in_words() -> None:
    runs = [run_of(seconds=2.0), run_of("rpf", seconds=2.0)]
    plots = plots_of(runs)
    assert list(plots) == ["Sensed", "Seen", "Energy", "Path", "Clearance", "Distance kept"]
    metrics = compute_run_metrics(runs[0].record, 15.0)
    assert f"to {metrics.path_length[-1]:.4g} m; RPF" in plots["Path"]
    assert f"to {100.0 * metrics.visible_area[-1] / metrics.free_area:.4g} %" in plots["Seen"]
    assert len({svg.partition('id="')[2].partition('"')[0] for svg in plots.values()}) == len(plots)


def test_what_tells_nothing_is_left_out() -> None:
    assert "Distance kept" not in plots_of([run_of(robots=1, seconds=1.0)])
    apart = run_of()
    team = replace(apart.record.team, communication_range=np.full(4, 3.0))
    apart = replace(apart, record=replace(apart.record, team=team))
    parts = compute_run_metrics(apart.record, 5.0).components
    assert len(set(parts.tolist())) > 1
    assert "Connectivity" in plots_of([apart])


@pytest.mark.slow
def test_the_mean_time_is_there_where_it_is_known_of_all() -> None:
    assert "Time to come" in plots_of([run_of(timed=True), run_of("rpf", timed=True)])
    assert "Time to come" not in plots_of([run_of(timed=True), run_of("rpf")])


def test_sweeps_crowds_and_thin_records_have_none() -> None:
    assert plots_of([run_of()], result_of(ENTRIES)) == {}
    many = replace(RESULT, entries=tuple(entry(seed=k) for k in range(MOST_MEASURED + 1)))
    assert plots_of([run_of()] * (MOST_MEASURED + 1), many) == {}
    crowd = run_of()
    team = Team.homogeneous(MOST_ROBOTS + 1)
    assert plots_of([replace(crowd, record=replace(crowd.record, team=team))]) == {}
    sparse = run_of(seconds=10.0, hz=0.1)
    assert plots_of([sparse]) == {}
