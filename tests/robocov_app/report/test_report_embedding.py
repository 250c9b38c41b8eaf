"""Runs are embedded in pages as compact JSON, with errors that are too small to be visible."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest
from drawn_run import HALL, ROOMS
from hypothesis import given
from hypothesis import strategies as st
from reported_results import HOSTILE, build_history, build_record

from robocov.conditions import Conditions
from robocov.environment import Environment, ObstaclePath, PolygonObstacle
from robocov.team import Team
from robocov.text import escape_controls
from robocov_app.look.curve_styles import choose_controller_styles
from robocov_app.report.descriptions import list_lifetimes
from robocov_app.report.embedding import (
    MAX_RATE_HZ,
    NO_NUMBER,
    ReplayRun,
    embed_map,
    embed_replay,
    embed_run,
    format_script_json,
    list_even_times,
    quantize,
)
from robocov_app.report.pictures import has_path

STYLE = choose_controller_styles(["rapf"])["rapf"]


def dequantize(text: str, low: float, high: float) -> np.ndarray:
    """Restore the values passed to `quantize`, as a reference."""
    levels = np.frombuffer(base64.b64decode(text), dtype="<u2").astype(float)
    return np.where(levels == NO_NUMBER, np.nan, low + levels / (NO_NUMBER - 1) * (high - low))


def build_replay_run(seconds: float = 6.0, **walking) -> ReplayRun:
    record = build_record(seconds=seconds, **walking)
    return ReplayRun(record, build_history(record, 2.0), "a run")


def read_points(data: dict, record, name: str = "positions") -> np.ndarray:
    low_x, low_y, high_x, high_y = record.environment.region.bounds
    flat = dequantize(data[name], 0.0, 1.0).reshape(data["count"], -1, 2)
    return np.array([low_x, low_y]) + flat * np.array([high_x - low_x, high_y - low_y])


def test_speeds_are_embedded_for_cells_by_travel_time() -> None:
    run = build_replay_run()
    size = len(run.record.team)
    speeds = np.where(np.arange(size) == 0, 1.0, 0.4)
    mixed = replace(run.record, team=replace(run.record.team, max_speed=speeds))
    timed = replace(mixed, gains={**mixed.gains, "cells": "time"})
    embedded = [
        embed_run(replace(run, record=record), 0, STYLE, 5.0, include_goals=True)
        for record in (run.record, mixed, timed)
    ]
    assert ["speeds" in data for data in embedded] == [False, False, True]
    assert embedded[2]["speeds"] == speeds.tolist()


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=50))
def test_quantized_numbers_are_accurate_to_half_a_step(values) -> None:
    array = np.array(values)
    low = float(array.min())
    high = float(array.max())
    restored = dequantize(quantize(array, low, high), low, high)
    assert np.abs(restored - array).max() <= 0.51 * (high - low) / (NO_NUMBER - 1) + 1e-12


def test_missing_numbers_stay_missing() -> None:
    restored = dequantize(quantize(np.array([0.0, np.nan, np.inf, 1.0]), 0.0, 1.0), 0.0, 1.0)
    assert np.isnan(restored).tolist() == [False, True, True, False]


@given(st.floats(0.0, 500.0), st.sampled_from([0.05, 1.0, 1.25, 2.5, 5.0]))
def test_even_times_cover_the_run(end, rate) -> None:
    times = list_even_times(end, rate)
    assert times[0] == 0.0 and times[-1] == pytest.approx(end, abs=1e-8)
    steps = np.diff(times)
    assert (steps > 0.0).all() and (steps <= 1.0 / rate + 1e-9).all()
    assert np.allclose(steps[:-1], 1.0 / rate)


@pytest.mark.parametrize("hz", [60.0, 5.0, 3.0])
@pytest.mark.parametrize("seconds", [6.0, 4.35])
def test_positions_and_goals_agree_with_the_record(hz, seconds) -> None:
    run = build_replay_run(seconds, hz=hz)
    data = embed_run(run, 0, STYLE, MAX_RATE_HZ, include_goals=True)
    record = run.record
    times = np.minimum(np.arange(data["count"]) * data["step"], data["end"])
    expected = np.stack(
        [
            np.column_stack([np.interp(times, record.time, record.positions[:, i, k]) for k in (0, 1)])
            for i in range(len(record.team))
        ],
        axis=1,
    )
    assert data["end"] == pytest.approx(record.time[-1])
    assert np.abs(read_points(data, record) - expected).max() < 1e-3
    assert np.abs(read_points(data, record, "goals") - record.goals[0]).max() < 1e-3


def test_costs_agree_with_the_history_and_the_last_is_exact() -> None:
    run = build_replay_run()
    cost = embed_run(run, 0, STYLE, MAX_RATE_HZ, include_goals=True)["cost"]
    assert run.history is not None
    times = np.minimum(np.arange(cost["count"]) * cost["step"], 6.0)
    expected = np.interp(times, run.history.time, run.history.mean_distance)
    assert dequantize(cost["values"], cost["low"], cost["high"]) == pytest.approx(expected, abs=1e-3)
    assert cost["last"] == run.history.mean_distance[-1]


def test_runs_without_goals_costs_or_trajectories_are_embedded() -> None:
    record = build_record(controller="rpf")
    data = embed_run(ReplayRun(record, None, "x"), 0, STYLE, MAX_RATE_HZ, include_goals=True)
    assert data["goals"] is None and data["cost"] is None and data["path"]
    ends = replace(
        record, **{name: getattr(record, name)[[0, -1]] for name in ("time", "positions", "goals")}
    )
    assert not has_path(ends)
    data = embed_run(
        ReplayRun(ends, build_history(record, 2.0), "x"), 0, STYLE, MAX_RATE_HZ, include_goals=True
    )
    assert data["count"] == 2 and not data["path"]
    assert data["cost"]["count"] > 20  # The history of costs has more samples.
    assert np.abs(read_points(data, record) - record.positions[[0, -1]]).max() < 1e-3


def test_missing_goals_are_embedded_as_missing() -> None:
    record = build_record(hz=5.0)
    record.goals[:10] = np.nan
    run = ReplayRun(record, None, "x")
    data = embed_run(run, 0, STYLE, MAX_RATE_HZ, include_goals=True)
    is_missing = np.isnan(read_points(data, record, "goals")).all(axis=(1, 2))
    assert is_missing.tolist() == [k < 10 for k in range(data["count"])]


def test_lifetimes_of_robots_are_embedded() -> None:
    run = build_replay_run()
    assert "lifetimes" not in embed_run(run, 0, STYLE, 5.0, include_goals=True)
    conditions = Conditions(failures=((2, 2.0), (4, 5.0)), joins=((3, 1.5), (4, 3.0)))
    record = replace(run.record, conditions=conditions)
    assert list_lifetimes(record) == [(0.0, None), (0.0, 2.0), (1.5, None), (3.0, 5.0)]
    assert embed_run(replace(run, record=record), 0, STYLE, 5.0, include_goals=True)[
        "lifetimes"
    ] == list_lifetimes(record)
    # A robot that would join after the end of the run never appears.
    late = replace(run.record, conditions=Conditions(joins=((1, 99.0),)))
    assert list_lifetimes(late)[0] == (7.0, None)


def test_moving_obstacles_are_embedded_separately() -> None:
    path = ObstaclePath(((2.0, 3.0), (4.0, 3.0), (4.0, 5.0)), 0.5, "back-and-forth")
    cart = PolygonObstacle(((1.5, 2.5), (2.5, 2.5), (2.5, 3.5)), path=path)
    environment = replace(ROOMS, obstacles=(*ROOMS.obstacles, cart))
    data = embed_map(environment)
    assert data["blocked"] == embed_map(ROOMS)["blocked"]
    assert "movingObstacles" not in embed_map(ROOMS)
    (mover,) = data["movingObstacles"]
    assert (np.array(mover["line"]) * data["unit"]).tolist() == [2, 3, 4, 3, 4, 5, 4, 3, 2, 3]
    assert mover["speed"] == 0.5
    (ring,) = mover["rings"]
    corners = {tuple(corner) for corner in (np.array(ring).reshape(-1, 2) * data["unit"]).tolist()}
    assert corners == set(cart.vertices)


def test_a_run_of_a_single_step_is_embedded() -> None:
    record = build_record(seconds=0.0)
    data = embed_run(
        ReplayRun(record, build_history(record, 2.0), "x"), 0, STYLE, MAX_RATE_HZ, include_goals=True
    )
    assert data["end"] == 0.0 and data["count"] == 1
    json.dumps(data, allow_nan=False)


@pytest.mark.parametrize("environment", [ROOMS, HALL], ids=lambda each: each.name)
def test_maps_are_rounded_to_millimeters(environment) -> None:
    data = embed_map(environment)
    assert data["unit"] == 1e-3
    ring = np.array(data["region"]).reshape(-1, 2) * data["unit"]
    assert np.abs(ring - environment.region.vertices).max() <= 0.51e-3
    assert len(data["blocked"]) == len(environment.blocked.geoms)
    assert sum(len(rings) for rings in data["blocked"]) > len(data["blocked"]) or environment is HALL


def test_tiny_maps_are_rounded_less() -> None:
    tiny = Environment("tiny", ((0, 0), (0.05, 0), (0.05, 0.02), (0, 0.02)))
    data = embed_map(tiny)
    assert np.array(data["bounds"]) * data["unit"] == pytest.approx([0, 0, 0.05, 0.02], abs=1e-5)


def test_a_map_of_several_runs_is_embedded_once() -> None:
    runs = [build_replay_run(), build_replay_run(seed=1), build_replay_run(environment=HALL)]
    data = embed_replay(runs, [STYLE] * 3, [0, 2])
    assert [each["map"] for each in data["runs"]] == [0, 0, 1]
    assert data["panes"] == [0, 2] and len(data["maps"]) == 2 and data["rate"] == MAX_RATE_HZ


def test_large_runs_are_thinned() -> None:
    runs = [build_replay_run(60.0) for _ in range(4)]
    sizes = []
    for budget in (1_000_000, 60_000, 20_000, 4_000, 500):
        data = embed_replay(runs, [STYLE] * 4, [0], budget)
        sizes.append(len(json.dumps(data["runs"])))
        assert sizes[-1] < budget + 4 * 450  # The budget excludes names and single numbers.
        assert data["runs"][0]["end"] == 60.0
    assert sizes == sorted(sizes, reverse=True)


def test_names_in_scripts_are_escaped() -> None:
    text = format_script_json({"name": HOSTILE, "more": "\u2029<&>"})
    assert not set(text) & set("<>&\u2028\u2029")
    assert json.loads(text)["name"] == escape_controls(HOSTILE)


def test_headings_of_unicycles_are_embedded() -> None:
    run = build_replay_run()
    assert "headings" not in embed_run(run, 0, STYLE, 5.0, include_goals=True)
    count, n = run.record.positions.shape[:2]
    angles = np.linspace(0.0, 3.0, count)[:, None] + np.arange(n)
    turning = Team.homogeneous(n, kinematics="unicycle")
    record = replace(run.record, team=turning, steering=np.stack([angles, 0.0 * angles], axis=2))
    data = embed_run(replace(run, record=record), 0, STYLE, 5.0, include_goals=True)
    x, y = dequantize(data["headings"], -1.0, 1.0).reshape(data["count"], -1, 2).transpose(2, 0, 1)
    errors = np.angle(np.exp(1j * (np.arctan2(y, x)[[0, -1]] - angles[[0, -1]])))
    assert np.abs(errors).max() < 1e-3
