"""Plots of the metrics of runs in a report."""

from dataclasses import replace
from itertools import cycle
from typing import Any

import numpy as np
import pytest
from reported_results import build_history, build_record, build_result, build_run

from robocov.metrics.run_metrics import compute_run_metrics
from robocov.team import Team
from robocov_app.report.analysis.groups import choose_group_styles
from robocov_app.report.embedding import ReplayRun
from robocov_app.report.plots.metrics import MAX_MEASURED_ROBOTS, MAX_MEASURED_RUNS, build_metric_plots
from robocov_app.report.results.result import ReportedResult

RUNS = [build_run("rapf"), build_run("rpf")]
COMPARISON = replace(build_result(RUNS), kind="comparison")


def build_replay_run(controller: str = "rapf", *, has_mean_times: bool = False, **options: Any) -> ReplayRun:
    """Return a run with a made-up record, and mean times if robots are not equally fast."""
    record = build_record(controller=controller, **options)
    history = build_history(record, 2.0)
    if has_mean_times:
        history = replace(history, mean_time=2.0 * history.mean_distance)
    return ReplayRun(record, history, "a run")


def draw_plots(replay_runs: list[ReplayRun], result: ReportedResult = COMPARISON) -> dict[str, str]:
    """Return the SVG of each plot by its title."""
    pairs = zip(replay_runs, cycle(result.runs), strict=False)
    labeled_runs = [replace(replay_run, label=run.label) for replay_run, run in pairs]
    plots = build_metric_plots(result, labeled_runs, choose_group_styles(result), "m")
    return {plot.title: plot.svg for plot in plots}


def test_every_metric_has_a_plot_that_is_described_with_its_final_values() -> None:
    replay_runs = [build_replay_run(seconds=2.0), build_replay_run("rpf", seconds=2.0)]
    plots = draw_plots(replay_runs)
    assert list(plots) == ["Sensed area", "Visible area", "Energy", "Path", "Clearance", "Separation"]
    metrics = compute_run_metrics(replay_runs[0].record, 15.0)
    assert f"to {metrics.path_length[-1]:.4g} m; RPF" in plots["Path"]
    assert f"to {100.0 * metrics.visible_area[-1] / metrics.free_area:.4g}%" in plots["Visible area"]
    first_ids = {svg.partition('id="')[2].partition('"')[0] for svg in plots.values()}
    assert len(first_ids) == len(plots)


def test_a_single_robot_has_no_separation() -> None:
    assert "Separation" not in draw_plots([build_replay_run(robots=1, seconds=1.0)])


def test_connectivity_is_plotted_if_it_changes() -> None:
    replay_run = build_replay_run()
    team = replace(replay_run.record.team, communication_range=np.full(4, 3.0))
    replay_run = replace(replay_run, record=replace(replay_run.record, team=team))
    components = compute_run_metrics(replay_run.record, 5.0).components
    assert len(set(components.tolist())) > 1
    assert "Connectivity" in draw_plots([replay_run])


@pytest.mark.slow
def test_mean_times_are_plotted_if_they_are_known_for_all_runs() -> None:
    timed_run = build_replay_run(has_mean_times=True)
    assert "Travel time" in draw_plots([timed_run, build_replay_run("rpf", has_mean_times=True)])
    assert "Travel time" not in draw_plots([timed_run, build_replay_run("rpf")])


def test_a_sweep_has_no_plots_of_metrics() -> None:
    assert draw_plots([build_replay_run()], build_result(RUNS)) == {}


def test_too_many_runs_or_robots_have_no_plots_of_metrics() -> None:
    runs = tuple(build_run(seed=seed) for seed in range(MAX_MEASURED_RUNS + 1))
    replay_run = build_replay_run()
    assert draw_plots([replay_run] * len(runs), replace(COMPARISON, runs=runs)) == {}
    team = Team.homogeneous(MAX_MEASURED_ROBOTS + 1)
    assert draw_plots([replace(replay_run, record=replace(replay_run.record, team=team))]) == {}


def test_a_record_without_trajectories_has_no_plots_of_metrics() -> None:
    assert draw_plots([build_replay_run(seconds=10.0, hz=0.1)]) == {}
