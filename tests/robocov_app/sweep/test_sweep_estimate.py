from __future__ import annotations

from pathlib import Path

import pytest
from small_studies import HALL, ROOM, build_small_study

from robocov_app.sweep import estimate as estimate_module
from robocov_app.sweep.estimate import count_axes, estimate_sweep
from robocov_app.sweep.ledger import open_ledger
from robocov_app.sweep.study.study import StudyMap
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.sweep.worker import perform


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
        "gains of rapf": 2,
        "gains of rpf": 1,
    }
    assert len(study) == 2 * 2 * 3 * 2 * (2 + 1)


def test_time_and_space_are_those_of_one_run_times_the_number_of_runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    study = build_small_study(seeds=range(5))
    clock_times = iter([10.0, 12.5])
    monkeypatch.setattr(estimate_module.time, "perf_counter", lambda: next(clock_times))
    estimate = estimate_sweep(study, tmp_path / "none", workers=4)
    first = next(generate_tasks(study))
    size = sum(len(content) for content in perform(first).files.values())
    assert (estimate.runs, estimate.left, estimate.run, estimate.error) == (10, 10, first.name, None)
    assert estimate.seconds_per_run == 2.5
    assert estimate.seconds == 2.5 * 10 / 4
    assert (estimate.bytes_per_run, estimate.total_bytes) == (size, 10 * size)
    assert not (tmp_path / "none").exists()


def test_finished_runs_are_not_counted(tmp_path: Path) -> None:
    study = build_small_study(seeds=range(3))
    tasks = list(generate_tasks(study))
    with open_ledger(tmp_path, study.to_json()) as ledger:
        for task in tasks[:2]:
            ledger.store(task, perform(task))
    before = sorted(path.stat().st_mtime_ns for path in tmp_path.rglob("*"))
    estimate = estimate_sweep(study, tmp_path, workers=1)
    assert (estimate.left, estimate.run) == (4, tasks[2].name)
    assert sorted(path.stat().st_mtime_ns for path in tmp_path.rglob("*")) == before


def test_the_error_of_a_failed_run_is_reported(tmp_path: Path) -> None:
    estimate = estimate_sweep(build_small_study(robots=(500,)), tmp_path, workers=1)
    assert estimate.error is not None and "space for about" in estimate.error
