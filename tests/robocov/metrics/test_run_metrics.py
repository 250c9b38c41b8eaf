"""Metrics of a run over time, and connectivity."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.controllers import Rapf
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError
from robocov.mapfile import load_map
from robocov.metrics import CostHistory, select_sampled_steps
from robocov.metrics.run_metrics import (
    COLUMNS,
    compute_final_metrics,
    compute_run_metrics,
    find_time_near_final,
    measure_connectivity,
)
from robocov.record import Record
from robocov.simulation import Simulation
from robocov.team import Team

ROOM = Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6)), (WallObstacle(((4, 0), (4, 3)), 0.1),))


@pytest.fixture(scope="module")
def record() -> Record:
    team = replace(Team.homogeneous(3, communication_range=2.5), radius=np.array([0.1, 0.2, 0.3]))
    return Simulation(ROOM, Rapf(), [[1, 1], [2, 1], [1, 3]], team, dt=1 / 30).run(4.0)


def build_history(values: list[float]) -> CostHistory:
    cost = np.array(values)
    return CostHistory(np.arange(len(cost), dtype=float), cost, cost, np.zeros_like(cost))


def test_integrals_agree_with_plain_loops(record: Record) -> None:
    work = 0.0
    effort = 0.0
    mean_path_length = 0.0
    for k in range(len(record) - 1):
        step = record.time[k + 1] - record.time[k]
        for robot in range(3):
            power = abs(record.forces[k, robot] @ record.velocities[k, robot])
            next_power = abs(record.forces[k + 1, robot] @ record.velocities[k + 1, robot])
            work += step * (power + next_power) / 2
            effort += step * record.forces[k, robot] @ record.forces[k, robot]
            mean_path_length += np.hypot(*(record.positions[k + 1, robot] - record.positions[k, robot])) / 3
    metrics = compute_run_metrics(record, 5.0)
    assert metrics.work[0] == metrics.effort[0] == metrics.path_length[0] == 0.0
    assert metrics.work[-1] == pytest.approx(work, rel=1e-12)
    assert metrics.effort[-1] == pytest.approx(effort, rel=1e-12)
    assert metrics.path_length[-1] == pytest.approx(mean_path_length, rel=1e-12)
    assert (np.diff(metrics.work) >= 0).all()


def test_the_rate_does_not_change_the_final_metrics(record: Record) -> None:
    fine = compute_run_metrics(record, 30.0)
    coarse = compute_run_metrics(record, 0.0)
    assert len(fine.time) == 121
    assert len(coarse.time) == 2
    assert fine.final() == pytest.approx(coarse.final())
    assert np.array(fine.rows()).shape == (121, len(COLUMNS))


def test_clearances_are_minima_since_the_previous_sample(record: Record) -> None:
    radius = record.team.radius
    gaps = [
        np.hypot(*(record.positions[:, i] - record.positions[:, j]).T) - radius[i] - radius[j]
        for i, j in ((0, 1), (0, 2), (1, 2))
    ]
    smallest = np.min(gaps, axis=0)
    metrics = compute_run_metrics(record, 1.0)
    assert metrics.robot_clearance[0] == pytest.approx(smallest[0])
    assert metrics.robot_clearance[1] == pytest.approx(smallest[1:31].min())
    assert metrics.final()["robot_clearance_m"] == pytest.approx(smallest.min())
    walls = np.minimum.reduce([record.positions[..., 0], record.positions[..., 1]]) - radius
    assert metrics.wall_clearance[0] <= walls[0].min() + 1e-6


def test_covered_areas_are_parts_of_the_free_area(record: Record) -> None:
    metrics = compute_run_metrics(record)
    assert metrics.free_area == pytest.approx(ROOM.free.area)
    assert (metrics.sensed_area <= metrics.range_area + 1e-9).all()
    assert (metrics.visible_area <= metrics.free_area + 1e-9).all()
    assert "of the free area sensed at the end" in repr(metrics)


def test_a_single_robot_has_no_clearance_to_others() -> None:
    metrics = compute_run_metrics(Simulation(ROOM, Rapf(), [[1, 1]]).run(0.5))
    assert metrics.final()["robot_clearance_m"] is None
    assert metrics.components.tolist() == [1, 1]
    assert metrics.algebraic_connectivity.tolist() == [0.0, 0.0]


@settings(max_examples=count_examples(40))
@given(st.integers(2, 9), st.floats(0.2, 4.0), st.integers(0, 2**32 - 1))
def test_connectivity_agrees_with_the_laplacian(n: int, reach: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    positions = rng.uniform(0, 5, (n, 2))
    ranges = reach * rng.choice([1.0, 2.0], n)
    offsets = positions[:, None] - positions
    is_linked = np.hypot(offsets[:, :, 0], offsets[:, :, 1]) <= np.minimum(ranges[:, None], ranges)
    np.fill_diagonal(is_linked, False)
    laplacian = np.diag(is_linked.sum(axis=1)) - is_linked.astype(float)
    eigenvalues = np.linalg.eigvalsh(laplacian)
    components, connectivity = measure_connectivity(positions, ranges)
    assert components == int((eigenvalues < 1e-9).sum())
    assert connectivity == pytest.approx(max(eigenvalues[1], 0.0), abs=1e-9)
    assert (connectivity == 0.0) == (components > 1)


def test_a_ring_and_extreme_graphs_have_their_known_connectivity() -> None:
    angle = np.arange(6) * np.pi / 3
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    # The second eigenvalue of a ring is 2 - 2 cos(2 pi / 6).
    assert measure_connectivity(ring, np.full(6, 1.01)) == (1, pytest.approx(1.0))
    assert measure_connectivity(ring, np.full(6, np.inf)) == (1, 6.0)
    assert measure_connectivity(ring, np.full(6, 0.5)) == (6, 0.0)
    assert measure_connectivity(np.empty((0, 2)), np.empty(0)) == (0, 0.0)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([5.0, 2.0, 1.04, 1.0], 2.0),
        ([1.0, 1.0], 0.0),
        ([1.0, 0.9, 1.0], 2.0),
        ([2.0, 1.0], 1.0),
        ([3.0], 0.0),
        ([2.0, np.nan, np.nan], None),
    ],
)
def test_the_cost_is_near_its_final_value_after_the_last_deviation(
    values: list[float], expected: float | None
) -> None:
    assert find_time_near_final(build_history(values)) == expected


def test_final_metrics_have_a_figure_for_each_column(record: Record) -> None:
    metrics = compute_final_metrics(record, build_history([2.0, 1.0, 1.0]))
    assert metrics["near_final_s"] == 1.0
    assert set(metrics) == {*COLUMNS.values(), "near_final_s", "sent_bytes_per_s"} - {"time_s"}


@pytest.mark.parametrize("rate", [-1.0, float("nan"), float("inf"), "5", None])
def test_invalid_rates_are_rejected(record: Record, rate: Any) -> None:
    with pytest.raises(ParameterError, match="rate: "):
        compute_run_metrics(record, rate)
    forklifts = load_map("forklifts")
    with pytest.raises(ParameterError, match="rate: "):
        select_sampled_steps(replace(record, environment=forklifts), rate)
