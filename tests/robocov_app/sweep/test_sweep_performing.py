"""Execution of the runs of a sweep: outcomes, files and memory."""

from __future__ import annotations

import gc
import io
import json
import weakref
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pytest
from small_studies import HEAD, ROOM, build_small_study, write_controller

from robocov.cost import CoverageCost
from robocov.metrics import compute_cost_history, summarize
from robocov.metrics.results import read_history
from robocov.record import ARRAYS, Record
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.table import build_columns
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.sweep.worker import METRICS, Outcome, perform, prepare_cost, simulate


def get_first_task(study: Study) -> Task:
    return next(generate_tasks(study))


def load_record(outcome: Outcome, folder: Path) -> Record:
    for name, content in outcome.files.items():
        (folder / name).write_bytes(content)
    return Record.load(folder)


def test_a_run_follows_its_task(tmp_path: Path) -> None:
    task = get_first_task(build_small_study(duration=6.0, controllers=("lloyd",), record_hz=4.0, cost_hz=2.0))
    whole = simulate(task)
    outcome = perform(task)
    assert outcome.error is None
    assert list(outcome.files) == ["run.json", "record.npz", "cost.csv"]
    record = load_record(outcome, tmp_path)
    rows = np.searchsorted(whole.time, record.time)
    assert np.array_equal(whole.time[rows], record.time)
    assert rows[0] == 0 and rows[-1] == len(whole) - 1
    assert len(record) == 6 * 4 + 1
    for name in ARRAYS:
        assert np.array_equal(getattr(record, name), getattr(whole, name)[rows], equal_nan=True)
    assert record.dt == task.dt

    history = read_history(tmp_path / "cost.csv")
    expected = compute_cost_history(whole, CoverageCost(ROOM, task.lattice), task.cost_hz)
    assert np.array_equal(history.mean_distance, expected.mean_distance)
    assert len(history.time) == 6 * 2 + 1


def test_metrics_use_all_steps_and_not_only_saved_ones(tmp_path: Path) -> None:
    task = get_first_task(build_small_study(duration=6.0, controllers=("lloyd",), robots=(5,), record_hz=0.0))
    whole = simulate(task)
    history = compute_cost_history(whole, CoverageCost(ROOM, task.lattice), task.cost_hz)
    summary = summarize(whole, history)
    outcome = perform(task)
    assert list(outcome.metrics) == list(METRICS)
    assert outcome.metrics == {
        **{name: summary[name] for name in METRICS},
        "path_length_m": sum(summary["path_length_m"]) / 5,
    }
    record = load_record(outcome, tmp_path)
    assert record.time.tolist() == [0.0, whole.time[-1]]
    content = json.loads(outcome.files["run.json"])
    assert content["summary"] == summary
    assert (content["record_hz"], content["cost_hz"], content["lattice"]) == (0.0, 2.0, 8)


def test_equal_tasks_give_equal_bytes() -> None:
    for task in generate_tasks(build_small_study()):
        assert perform(task) == perform(task)


def test_the_source_of_a_custom_controller_is_saved(tmp_path: Path) -> None:
    task = get_first_task(
        build_small_study(controllers=("mine.py:Mine",), folder=Path(write_controller(tmp_path, "")).parent)
    )
    content = json.loads(perform(task).files["run.json"])
    assert content["controller"]["name"] == "mine.py:Mine"
    assert task.source is not None and content["controller"]["source"] == task.source.text


@pytest.mark.parametrize(
    ("code", "message"),
    [
        (
            "        1 / 0\n",
            "controller 'Mine': ZeroDivisionError: division by zero (mine.py, line 11) for robot 1 at",
        ),
        (
            "        raise SystemExit(3)\n",
            "controller 'Mine': it tried to terminate Python by raising SystemExit: 3 (mine.py, line 11)",
        ),
        (
            "        raise ValueError('a\\nb\\udcff')\n",
            r"controller 'Mine': ValueError: a\nb\udcff (mine.py, line 11)",
        ),
        (
            "        return [float('nan'), 0]\n",
            "controller 'Mine': force(own) returned [nan, 0] for robot 1 at 0.000 s",
        ),
        ("        pass\n\n1 / 0\n", "controller 'mine.py:Mine': mine.py cannot be run: ZeroDivisionError: "),
    ],
)
def test_errors_are_outcomes(tmp_path: Path, code: str, message: str) -> None:
    write_controller(tmp_path, "")
    task = get_first_task(build_small_study(controllers=("mine.py:Mine",), folder=tmp_path))
    # The file is correct when the study is built, and fails only when the task is performed.
    assert task.source is not None
    task = replace(task, source=task.source._replace(text=HEAD + code))
    outcome = perform(task)
    assert outcome.error is not None and outcome.error.startswith(message), outcome.error
    assert not outcome.metrics
    assert list(outcome.files) == ["error.json"]
    content = json.loads(outcome.files["error.json"])
    assert content["error"] == outcome.error
    assert "Traceback" in content["traceback"]


def test_a_start_without_space_is_an_outcome() -> None:
    outcome = perform(get_first_task(build_small_study(robots=(500,))))
    assert outcome.error is not None and outcome.error.startswith("start 'corner': space for about")


def test_costs_of_the_last_maps_are_cached() -> None:
    maps = [StudyMap(f"room {k}", replace(ROOM, name=f"room {k}")) for k in range(6)]
    tasks = list(generate_tasks(build_small_study(maps=maps, controllers=("rapf",), seeds=(0,))))
    costs = [prepare_cost(task) for task in tasks]
    assert prepare_cost(tasks[-1]) is costs[-1]
    assert prepare_cost(tasks[0]) is not costs[0], "memory does not grow with the number of maps"
    again = replace(tasks[-1], seed=5)
    assert prepare_cost(again) is costs[-1]


@pytest.mark.parametrize("code", ["", "        1 / (own.time == 0.0)\n"])
def test_physics_objects_are_freed_after_a_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str
) -> None:
    """Another thread that came upon it would free it in the midst of the next run's steps."""
    alive: list[weakref.ref[object]] = []

    def watch(kind: type[Any]) -> None:
        begin = kind.__init__

        def init(self: object, *arguments: Any, **more: Any) -> None:
            begin(self, *arguments, **more)
            alive.append(weakref.ref(self))

        monkeypatch.setattr(kind, "__init__", init)

    for kind in (pymunk.Space, pymunk.Body, pymunk.Poly, pymunk.Circle):
        watch(kind)
    perform(get_first_task(build_small_study(controllers=(write_controller(tmp_path, code),))))
    assert len(alive) > 8
    assert not [thing for thing in alive if thing() is not None]
    assert gc.isenabled()


def test_garbage_of_a_long_run_is_collected(tmp_path: Path) -> None:
    code = "        ring = []\n        ring.append(ring)\n"
    task = get_first_task(
        build_small_study(controllers=(write_controller(tmp_path, code),), duration=100.0, robots=(2,))
    )
    seen: list[int] = []
    gc.callbacks.append(lambda phase, info: seen.append(info["collected"]) if phase == "stop" else None)
    try:
        assert perform(task).error is None
    finally:
        gc.callbacks.pop()
    assert sum(seen) > 2 * 2000
    assert len(seen) == 2 + 1


def test_runs_of_duration_zero_have_one_step() -> None:
    outcome = perform(get_first_task(build_small_study(duration=0.0)))
    assert outcome.error is None
    with np.load(io.BytesIO(outcome.files["record.npz"])) as arrays:
        assert arrays["time"].tolist() == [0.0]
    assert outcome.metrics["mean_distance_over_run_m"] == outcome.metrics["mean_distance_m"]
    assert outcome.metrics["settled_at_s"] is None
    assert outcome.metrics["stuck_robots"] is None


def test_mixed_teams_and_optional_metrics_have_further_columns() -> None:
    group = ({"count": 1, "max_speed": 1.0, "radius": 0.2}, {"count": 2, "max_speed": 0.4})
    study = build_small_study(group=group, robots=(3,), metrics=True, gains={"rapf": {"cells": "time"}})
    outcome = perform(get_first_task(study))
    assert outcome.error is None
    known = [column.name for column in build_columns(study)]
    assert set(outcome.metrics) <= {*known, "range_area_m2", "wall_clearance_m"}
    assert {"mean_time_s", "sensed_area_m2", "near_final_s", "robot_clearance_m"} <= set(outcome.metrics)
    assert outcome.metrics["mean_time_s"] > outcome.metrics["mean_distance_m"]
    assert outcome.files["cost.csv"].splitlines()[0].endswith(b",mean_time_s")
    plain = build_small_study()
    assert set(perform(get_first_task(plain)).metrics) == set(METRICS)
    assert not {"mean_time_s", "sensed_area_m2"} & {column.name for column in build_columns(plain)}
