"""Settling, path lengths, clearance, contacts, stuck robots and the coverage cost over runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from robocov.conditions import Conditions
from robocov.controllers import Lloyd, Rapf
from robocov.cost import CoverageCost
from robocov.environment import Environment, ObstaclePath, PolygonObstacle
from robocov.metrics import (
    compute_clearances,
    compute_cost_history,
    compute_mean_over_run,
    compute_path_lengths,
    count_contacts,
    count_stuck_robots,
    find_settling_time,
    select_sampled_steps,
    summarize,
)
from robocov.metrics.clearance import measure_robot_gaps
from robocov.metrics.run_metrics import compute_run_metrics
from robocov.record import Record
from robocov.simulation import Simulation
from robocov.team import Team

DT = 0.1


def build_times(duration: float) -> np.ndarray:
    return np.arange(round(duration / DT) + 1) * DT


def build_trajectory(x: np.ndarray) -> np.ndarray:
    """Return the positions of one robot that moves along x, (T, 1, 2) m."""
    return np.stack([x, np.zeros_like(x)], axis=-1)[:, None, :]


@pytest.fixture(scope="module")
def record(cluttered: Environment) -> Record:
    return Simulation(cluttered, Lloyd(), cluttered.start().sample(6), dt=0.02).run(12.0)


def test_a_robot_that_stops_settles_when_it_stops() -> None:
    time = build_times(20)
    # It stops at 6 s. In windows that start at least 0.1 s earlier, it still moves by 0.05 m.
    positions = build_trajectory(np.minimum(time * 0.5, 3.0))
    assert find_settling_time(time, positions) == pytest.approx(5.9, abs=0.11)


def test_trembling_robots_have_settled_and_creeping_ones_have_not() -> None:
    time = build_times(30)
    assert find_settling_time(time, build_trajectory(0.01 * np.sin(40 * time))) == 0.0
    assert find_settling_time(time, build_trajectory(0.02 * time)) is None


def test_robots_that_move_late_settle_late() -> None:
    time = build_times(30)
    positions = build_trajectory(np.where(time > 15, np.minimum(time - 15, 1.0), 0.0))
    assert find_settling_time(time, positions) == pytest.approx(16.0, abs=0.11)
    assert find_settling_time(time, build_trajectory(np.where(time > 29, 1.0, 0.0))) is None


def test_one_robot_that_moves_by_the_limit_keeps_the_team_from_settling() -> None:
    time = np.arange(9) * 0.25
    jump = build_trajectory(np.where(time >= 1.0, 0.5, 0.0))
    assert find_settling_time(time, jump, window=1.0, distance=0.5) == 1.0
    team = np.concatenate([build_trajectory(np.zeros(9)), jump], axis=1)
    assert find_settling_time(time, team, window=1.0, distance=0.5) == 1.0


def test_a_run_shorter_than_the_window_cannot_settle() -> None:
    assert find_settling_time(build_times(3), build_trajectory(np.zeros(31))) is None
    assert find_settling_time(np.array([0.0]), np.zeros((1, 1, 2))) is None


def test_the_path_length_of_a_circle_is_its_circumference() -> None:
    angle = np.linspace(0, 2 * np.pi, 2001)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None, :]
    np.testing.assert_allclose(compute_path_lengths(circle), [2 * np.pi], rtol=1e-5)


def test_clearance_agrees_with_shapely_also_beyond_the_sensing_range(record: Record) -> None:
    boundary = record.environment.free.boundary
    expected = shapely.distance(boundary, shapely.points(record.positions)) - 0.1
    np.testing.assert_allclose(compute_clearances(record), expected, atol=1e-9)
    blind = replace(record, obstacle_points=np.full_like(record.obstacle_points, np.nan))
    np.testing.assert_allclose(compute_clearances(blind), expected, atol=1e-9)


def test_contacts_are_counted_when_they_begin(record: Record) -> None:
    steps = 5
    clearances = np.array([[0.5, 0.0], [0.0, 0.0], [0.0, 0.3], [0.2, 0.0], [0.0, 0.2]])
    positions = np.zeros((steps, 2, 2))
    positions[:, 1, 0] = [1.0, 0.2, 0.2, 0.5, 0.2]
    two_robots = replace(record, team=record.team[:2], positions=positions, time=np.arange(steps) * 0.1)
    # Robot 0 touches a wall at steps 1 and 4, robot 1 at steps 0 and 3; they touch each other at 1 and 4.
    assert count_contacts(two_robots, clearances) == 4 + 2


def test_gaps_are_measured_between_the_surfaces_of_robots(record: Record) -> None:
    """Robot 2, which is the largest, is farther along x than robot 1, and yet closer to robot 0."""
    positions = np.array([[[0.0, 0.0], [0.0001, 0.25], [0.62, 0.0]]])
    team = replace(record.team[:3], radius=np.array([0.1, 0.1, 0.5]))
    three_robots = replace(record, team=team, positions=positions, time=np.zeros(1))
    assert measure_robot_gaps(three_robots).min_gaps == pytest.approx([0.02])


@pytest.mark.slow
@pytest.mark.parametrize("robots", [1, 2, 7, 130])
def test_contacts_of_robots_agree_with_a_check_of_all_pairs(record: Record, robots: int) -> None:
    rng = np.random.default_rng(robots)
    steps = 40
    starts = rng.uniform(0, 0.2 * (robots - 1) ** 0.5, (robots, 2))
    positions = starts + np.cumsum(rng.normal(0.0, 0.05, (steps, robots, 2)), axis=0)
    radius = rng.uniform(0.02, 0.1, robots)
    team = replace(Team.homogeneous(robots), radius=radius)
    crowd = replace(record, team=team, positions=positions, time=np.arange(steps) * 0.1)
    is_touching = np.zeros((robots, robots), dtype=bool)
    expected = 0
    for moment in range(steps):
        for i in range(robots):
            for j in range(i):
                distance = np.hypot(*(positions[moment, i] - positions[moment, j]))
                touches = bool(distance <= radius[i] + radius[j] + 1e-3)
                expected += touches and not is_touching[i, j]
                is_touching[i, j] = touches
    assert count_contacts(crowd, np.ones((steps, robots))) == expected
    assert (expected > 0) is (robots > 1)


@pytest.fixture(scope="module")
def changing(record: Record) -> Record:
    """Robot 2 fails after a second, and robot 1 runs into it; robot 3 joins where robot 1 has been."""
    positions = np.array(
        [
            [[1.0, 1.0], [2.0, 1.0], [1.05, 1.0]],
            [[1.0, 1.0], [2.0, 1.0], [1.05, 1.0]],
            [[1.8, 1.0], [2.0, 1.0], [1.0, 1.0]],
        ]
    )
    return replace(
        record,
        team=record.team[:3],
        time=np.arange(3.0),
        positions=positions,
        velocities=np.ones((3, 3, 2)),
        forces=np.ones((3, 3, 2)),
        goals=np.ones((3, 3, 2)),
        obstacle_points=np.ones((3, 3, 2)),
        conditions=Conditions(failures=((2, 1.0),), joins=((3, 2.0),)),
    )


def test_failed_robots_are_walls_and_robots_that_have_not_joined_are_absent(changing: Record) -> None:
    clearances = compute_clearances(changing)
    is_idle = [[False, False, True], [False, True, True], [False, True, False]]
    assert np.isinf(clearances).tolist() == is_idle
    assert clearances[:, 0] == pytest.approx([0.9, 0.8, 0.0], abs=1e-9)
    assert count_contacts(changing, clearances) == 1
    cost = CoverageCost(changing.environment, lattice=24)
    history = compute_cost_history(changing, cost)
    for moment, robots in enumerate(([0, 1], [0], [0, 2])):
        expected = cost(changing.positions[moment, robots]).mean_distance
        assert history.mean_distance[moment] == expected


def test_only_working_robots_count_in_run_metrics(changing: Record) -> None:
    metrics = compute_run_metrics(changing, 1.0)
    # |F v| is 2 for each robot; two, one and two of them work.
    assert metrics.work == pytest.approx([0.0, 3.0, 6.0])
    assert metrics.effort == pytest.approx([0.0, 4.0, 6.0])
    assert metrics.robot_clearance == pytest.approx([0.8, np.inf, 0.6])
    assert metrics.components.tolist() == [1, 1, 1]


def test_metrics_use_the_map_of_each_time() -> None:
    path = ObstaclePath(((0.0, 0.0), (4.0, 0.0)), 2.0)
    wall = PolygonObstacle(((3.0, 0.0), (3.5, 0.0), (3.5, 4.0), (3.0, 4.0)), path=path)
    hall = Environment("hall", ((0.0, 0.0), (8.0, 0.0), (8.0, 4.0), (0.0, 4.0)), (wall,))
    record = Simulation(hall, Lloyd(), [[1.0, 2.0]], dt=0.1).run(1.0)
    assert select_sampled_steps(record, 10.0) == [0, 10]
    assert compute_run_metrics(record, 10.0).visible_area[[0, -1]] == pytest.approx([12.0, 20.0])


def test_the_mean_over_a_run_is_weighted_by_time() -> None:
    time = np.array([0.0, 1.0, 1.5, 4.0])
    assert compute_mean_over_run(time, 3.0 - 0.5 * time) == pytest.approx(2.0)
    assert compute_mean_over_run(time, np.full(4, 7.25)) == 7.25
    assert compute_mean_over_run(np.array([0.0]), np.array([3.0])) == 3.0


def build_goals(x: float, steps: int) -> np.ndarray:
    """Return the goals of one robot at (x, 0), (T, 1, 2) m."""
    return np.tile([x, 0.0], (steps, 1, 1))


def test_a_robot_at_rest_away_from_its_goal_is_stuck() -> None:
    time = build_times(20)
    stopping = build_trajectory(np.minimum(time, 3.0))
    assert count_stuck_robots(time, stopping, build_goals(3.6, 201)) == 1
    # Close to its goal a robot is not stuck.
    assert count_stuck_robots(time, stopping, build_goals(3.4, 201)) == 0
    # The net displacement counts: creeping robots are not stuck, trembling ones are.
    creeping = build_trajectory(0.02 * time)
    assert count_stuck_robots(time, creeping, build_goals(9.0, 201)) == 0
    creeping_slowly = build_trajectory(0.005 * time)
    assert count_stuck_robots(time, creeping_slowly, build_goals(9.0, 201)) == 1
    trembling = build_trajectory(0.01 * np.sin(40 * time))
    assert count_stuck_robots(time, trembling, build_goals(9.0, 201)) == 1


def test_the_window_of_a_stuck_robot_contains_its_first_step() -> None:
    time = np.arange(41) * 0.25
    assert (
        count_stuck_robots(time, build_trajectory(np.where(time > 5.0, 1.0, 0.0)), build_goals(9.0, 41)) == 0
    )
    assert (
        count_stuck_robots(time, build_trajectory(np.where(time >= 5.0, 1.0, 0.0)), build_goals(9.0, 41)) == 1
    )


def test_robots_are_counted_and_those_without_goals_are_not_stuck() -> None:
    time = build_times(6)
    positions = np.zeros((61, 3, 2))
    goals = np.zeros((61, 3, 2))
    goals[:, 0] = np.nan
    goals[:, 1] = 4.0
    goals[:, 2] = 5.0
    assert count_stuck_robots(time, positions, goals) == 2
    assert count_stuck_robots(time, positions, np.full_like(positions, np.nan)) is None


def test_runs_shorter_than_the_window_have_no_stuck_robots() -> None:
    assert count_stuck_robots(build_times(4), np.zeros((41, 1, 2)), build_goals(9.0, 41)) is None
    assert count_stuck_robots(build_times(5), np.zeros((51, 1, 2)), build_goals(9.0, 51)) == 1
    assert count_stuck_robots(np.array([0.0]), np.zeros((1, 1, 2)), build_goals(9.0, 1)) is None


def test_cost_history_samples_at_the_rate_and_at_the_end(record: Record) -> None:
    cost = CoverageCost(record.environment, lattice=24)
    history = compute_cost_history(record, cost, rate=10.0)
    np.testing.assert_allclose(history.time, np.arange(121) / 10, atol=1e-9)
    assert history.mean_distance[-1] == cost(record.positions[-1]).mean_distance
    shorter = replace(record, time=record.time[:-7], positions=record.positions[:-7])
    assert select_sampled_steps(shorter, 10.0)[-1] == len(shorter) - 1


def test_summaries_contain_the_metrics_of_a_run(record: Record) -> None:
    history = compute_cost_history(record, CoverageCost(record.environment, lattice=24))
    summary = summarize(record, history)
    clearances = compute_clearances(record)
    assert summary == {
        "mean_distance_m": history.mean_distance[-1],
        "mean_distance_over_run_m": compute_mean_over_run(history.time, history.mean_distance),
        "cost_m3": pytest.approx(history.mean_distance[-1] * record.environment.free_area),
        "uncovered_area_m2": 0.0,
        "settled_at_s": find_settling_time(record.time, record.positions),
        "contacts": count_contacts(record, clearances),
        "min_clearance_m": clearances.min(),
        "path_length_m": compute_path_lengths(record.positions, record.traveled).tolist(),
        "stuck_robots": count_stuck_robots(record.time, record.positions, record.goals),
    }
    settled = replace(record, positions=np.repeat(record.positions[:1], len(record), axis=0))
    assert summarize(settled, history)["settled_at_s"] == 0.0
    assert summary["contacts"] > 0
    assert -2e-3 < summary["min_clearance_m"] < 1e-3


def test_rapf_has_no_contacts(cluttered: Environment) -> None:
    record = Simulation(cluttered, Rapf(), cluttered.start().sample(6), dt=0.02).run(12.0)
    assert count_contacts(record, compute_clearances(record)) == 0


def test_histories_have_a_short_repr(record: Record) -> None:
    history = compute_cost_history(record, CoverageCost(record.environment, 16), 1.0)
    first, last = history.mean_distance[[0, -1]]
    assert repr(history) == f"<CostHistory 13 samples, 12.0 s, mean distance {first:.3f} to {last:.3f} m>"
