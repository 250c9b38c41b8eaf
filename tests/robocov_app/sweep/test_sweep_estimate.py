"""The estimated size and duration of a sweep."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_studies import HALL, ROOM, build_small_study

from robocov_app.sweep import estimate as estimate_module
from robocov_app.sweep.estimate import count_axes, estimate_sweep
from robocov_app.sweep.ledger import open_ledger
from robocov_app.sweep.study.study import StudyMap
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import Outcome, perform


def test_the_values_of_each_axis_are_counted() -> None:
    maps = (StudyMap("room", ROOM), StudyMap("hall", HALL))
    study = build_small_study(
        maps=maps, starts="*", robots=(2, 3), max_speed=(1, 2), gains={"rapf": {"k_rep": [1, 2]}}
    )
    assert count_axes(study) == {
        "maps": 2,
        "robots": 2,
        "teams": 2,
        "starts": 3,
        "seeds": 2,
        "controllers": 2,
        "sets of gains of rapf": 2,
        "sets of gains of rpf": 1,
    }
    assert len(study) == 2 * 2 * 3 * 2 * (2 + 1)


def set_clock(monkeypatch: pytest.MonkeyPatch, *trial_seconds: float) -> None:
    """Let trials take the given times: two trials of each controller."""
    clock_times = []
    for k, seconds in enumerate(trial_seconds):
        start_time = 100.0 * k
        clock_times += [start_time, start_time + seconds]
    monkeypatch.setattr(estimate_module, "perf_counter", iter(clock_times).__next__)


def test_the_second_trial_of_each_controller_gives_its_time_and_size(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    study = build_small_study(seeds=range(5))
    # The first trial of a controller may compile kernels, so its time is not used.
    set_clock(monkeypatch, 1.0, 2.5, 1.0, 6.0)
    estimate = estimate_sweep(study, tmp_path / "none", workers=4)
    assert (estimate.runs, estimate.left) == (10, 10)
    tasks = list(generate_tasks(study))
    sizes = []
    for controller, seconds in (("rapf", 2.5), ("rpf", 6.0)):
        # The trial run is the middle one of the five runs of a controller.
        task = [task for task in tasks if task.controller == controller][2]
        trial = estimate.controllers[controller]
        assert (trial.runs, trial.left, trial.run, trial.error) == (5, 5, task.name, None)
        assert trial.seconds_per_run == seconds
        size = sum(len(content) for content in perform(task).files.values())
        assert trial.bytes_per_run == size
        sizes.append(size)
    assert estimate.seconds == (5 * 2.5 + 5 * 6.0) / 4
    assert estimate.total_bytes == 5 * sum(sizes)
    assert not (tmp_path / "none").exists()


def test_only_the_start_of_a_slow_run_is_executed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    study = build_small_study(controllers=("rapf",), seeds=range(3), duration=40.0)
    durations = []

    def record_duration(task: Task) -> Outcome:
        durations.append(task.duration)
        return perform(task)

    monkeypatch.setattr(estimate_module, "perform", record_duration)
    # The first second of simulation time takes 1 s, so 4 s take the 4 s that a trial may take.
    set_clock(monkeypatch, 1.0, 3.0)
    estimate = estimate_sweep(study, tmp_path, workers=1)
    assert durations == [1.0, 4.0]
    assert estimate.controllers["rapf"].seconds_per_run == 10 * 3.0
    assert estimate.seconds == 3 * 10 * 3.0
    size = sum(len(content) for content in perform(next(generate_tasks(study))).files.values())
    assert estimate.controllers["rapf"].bytes_per_run == pytest.approx(size, rel=0.5)


def test_the_size_is_that_of_the_mean_number_of_robots(tmp_path: Path) -> None:
    study = build_small_study(robots=(2, 4), duration=10.0)
    estimate = estimate_sweep(study, tmp_path, workers=1)
    sizes = [sum(len(content) for content in perform(task).files.values()) for task in generate_tasks(study)]
    assert estimate.total_bytes == pytest.approx(sum(sizes), rel=0.2)


def test_finished_runs_are_not_counted(tmp_path: Path) -> None:
    study = build_small_study(seeds=range(3))
    tasks = list(generate_tasks(study))
    with open_ledger(tmp_path, study.to_json()) as ledger:
        for task in tasks[:2]:
            ledger.store(task, perform(task))
    before = sorted(path.stat().st_mtime_ns for path in tmp_path.rglob("*"))
    estimate = estimate_sweep(study, tmp_path, workers=1)
    assert estimate.left == 4
    assert {trial.run for trial in estimate.controllers.values()} == {tasks[4].name, tasks[5].name}
    assert [trial.left for trial in estimate.controllers.values()] == [2, 2]
    assert sorted(path.stat().st_mtime_ns for path in tmp_path.rglob("*")) == before


def test_the_error_of_a_failed_run_is_reported(tmp_path: Path) -> None:
    estimate = estimate_sweep(build_small_study(robots=(500,)), tmp_path, workers=1)
    for trial in estimate.controllers.values():
        assert trial.error is not None and "space for about" in trial.error
