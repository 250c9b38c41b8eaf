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
    select_sampled_moments,
    summarise,
)
from robocov.metrics.run_metrics import compute_run_metrics
from robocov.record import Record
from robocov.simulation import Simulation

DT = 0.1


def times(seconds: float) -> np.ndarray:
    return np.arange(round(seconds / DT) + 1) * DT


def track(x: np.ndarray) -> np.ndarray:
    """Positions (T, 1, 2) of one robot that moves along x."""
    return np.stack([x, np.zeros_like(x)], axis=-1)[:, None, :]


@pytest.fixture(scope="module")
def record(cluttered: Environment) -> Record:
    return Simulation(cluttered, Lloyd(), cluttered.start().sample(6), dt=0.02).run(12.0)


def test_a_robot_that_stops_settles_when_it_stops() -> None:
    time = times(20)
    moving = track(np.minimum(time * 0.5, 3.0))  # stops at 6 s
    # in the last window that begins before the stop it still gets 0.05 m
    assert find_settling_time(time, moving) == pytest.approx(5.9, abs=0.11)


def test_trembling_robots_have_settled_and_creeping_ones_have_not() -> None:
    time = times(30)
    assert find_settling_time(time, track(0.01 * np.sin(40 * time))) == 0.0
    assert find_settling_time(time, track(0.02 * time)) is None


def test_robots_that_move_late_settle_late() -> None:
    time = times(30)
    late = track(np.where(time > 15, np.minimum(time - 15, 1.0), 0.0))
    assert find_settling_time(time, late) == pytest.approx(16.0, abs=0.11)
    assert find_settling_time(time, track(np.where(time > 29, 1.0, 0.0))) is None


def test_one_robot_that_moves_by_the_limit_keeps_the_team_from_settling() -> None:
    time = np.arange(9) * 0.25
    jump = track(np.where(time >= 1.0, 0.5, 0.0))
    assert find_settling_time(time, jump, window=1.0, distance=0.5) == 1.0
    team = np.concatenate([track(np.zeros(9)), jump], axis=1)
    assert find_settling_time(time, team, window=1.0, distance=0.5) == 1.0


def test_a_run_shorter_than_the_window_cannot_settle() -> None:
    assert find_settling_time(times(3), track(np.zeros(31))) is None
    assert find_settling_time(np.array([0.0]), np.zeros((1, 1, 2))) is None


def test_path_length_of_a_circle() -> None:
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
    gap = np.array([[0.5, 0.0], [0.0, 0.0], [0.0, 0.3], [0.2, 0.0], [0.0, 0.2]])
    apart = np.zeros((steps, 2, 2))
    apart[:, 1, 0] = [1.0, 0.2, 0.2, 0.5, 0.2]  # two robots of radius 0.1 meet, part and meet again
    team = replace(record.team, **{name: getattr(record.team, name)[:2] for name in record.team.__slots__})
    made = replace(record, team=team, positions=apart, time=np.arange(steps) * 0.1)
    # walls: robot 0 at steps 1 and 4, robot 1 at step 0 (it starts so) and 3; robots: at steps 1 and 4
    assert count_contacts(made, gap) == 4 + 2


@pytest.mark.slow
@pytest.mark.parametrize("robots", [1, 2, 7, 130])
def test_contacts_of_robots_agree_with_a_check_of_all_pairs(record: Record, robots: int) -> None:
    """Of few robots all pairs are looked at at once, of many only the close ones."""
    rng = np.random.default_rng(robots)
    steps, size = 40, 0.2 * (robots - 1) ** 0.5
    walk = np.cumsum(rng.normal(0.0, 0.05, (steps, robots, 2)), axis=0) + rng.uniform(0, size, (robots, 2))
    radius = rng.uniform(0.02, 0.1, robots)
    team = replace(
        record.team,
        **{name: np.full(robots, getattr(record.team, name)[0]) for name in record.team.__slots__},
    )
    made = replace(record, team=replace(team, radius=radius), positions=walk, time=np.arange(steps) * 0.1)
    met = np.zeros((robots, robots), dtype=bool)
    expected = 0
    for places in walk:
        for i in range(robots):
            for j in range(i):
                touch = bool(np.hypot(*(places[i] - places[j])) <= radius[i] + radius[j] + 1e-3)
                expected += touch and not met[i, j]
                met[i, j] = touch
    assert count_contacts(made, np.ones((steps, robots))) == expected
    assert (expected > 0) is (robots > 1)


@pytest.fixture(scope="module")
def changing(record: Record) -> Record:
    """Robot 2 fails after a second, and robot 1 runs into it; robot 3 joins where robot 1 has been."""
    name = {name: getattr(record.team, name)[:3] for name in record.team.__slots__}
    positions = np.array(
        [[[1.0, 1.0], [2.0, 1.0], [1.05, 1.0]], [[1.0, 1.0], [2.0, 1.0], [1.05, 1.0]]]
        + [[[1.8, 1.0], [2.0, 1.0], [1.0, 1.0]]]
    )
    arrays = {each: np.ones((3, 3, 2)) for each in ("velocities", "forces", "goals", "obstacle_points")}
    conditions = Conditions(failures=((2, 1.0),), joins=((3, 2.0),))
    team = replace(record.team, **name)
    return replace(
        record, team=team, time=np.arange(3.0), positions=positions, conditions=conditions, **arrays
    )


def test_failed_robots_are_walls_and_robots_that_have_not_joined_are_absent(changing: Record) -> None:
    gap = compute_clearances(changing)
    assert np.isinf(gap).tolist() == [[False, False, True], [False, True, True], [False, True, False]]
    assert gap[:, 0] == pytest.approx([0.9, 0.8, 0.0], abs=1e-9)
    assert count_contacts(changing, gap) == 1
    cost = CoverageCost(changing.environment, lattice=24)
    history = compute_cost_history(changing, cost)
    for k, rows in enumerate(([0, 1], [0], [0, 2])):
        assert history.mean_distance[k] == cost(changing.positions[k, rows]).mean_distance


def test_only_working_robots_count_in_run_metrics(changing: Record) -> None:
    metrics = compute_run_metrics(changing, 1.0)
    assert metrics.work == pytest.approx([0.0, 3.0, 6.0])  # |F v| is 2: of two robots, one, two
    assert metrics.effort == pytest.approx([0.0, 4.0, 6.0])
    assert metrics.robot_clearance == pytest.approx([0.8, np.inf, 0.6])
    assert metrics.components.tolist() == [1, 1, 1]


def test_metrics_use_the_map_of_each_moment() -> None:
    path = ObstaclePath(((0.0, 0.0), (4.0, 0.0)), 2.0)
    wall = PolygonObstacle(((3.0, 0.0), (3.5, 0.0), (3.5, 4.0), (3.0, 4.0)), path=path)
    hall = Environment("hall", ((0.0, 0.0), (8.0, 0.0), (8.0, 4.0), (0.0, 4.0)), (wall,))
    some = Simulation(hall, Lloyd(), [[1.0, 2.0]], dt=0.1).run(1.0)
    assert select_sampled_moments(some, 10.0) == [0, 10]
    assert compute_run_metrics(some, 10.0).visible_area[[0, -1]] == pytest.approx([12.0, 20.0])


def test_the_mean_over_a_run_is_weighted_by_time() -> None:
    time = np.array([0.0, 1.0, 1.5, 4.0])
    assert compute_mean_over_run(time, 3.0 - 0.5 * time) == pytest.approx(2.0)
    assert compute_mean_over_run(time, np.full(4, 7.25)) == 7.25
    assert compute_mean_over_run(np.array([0.0]), np.array([3.0])) == 3.0


def goals(position: float, steps: int) -> np.ndarray:
    return np.tile([position, 0.0], (steps, 1, 1))


def test_a_robot_at_rest_away_from_its_goal_is_stuck() -> None:
    time = times(20)
    still = track(np.minimum(time, 3.0))
    assert count_stuck_robots(time, still, goals(3.6, 201)) == 1
    assert count_stuck_robots(time, still, goals(3.4, 201)) == 0, "it is nearly there"
    assert count_stuck_robots(time, track(0.02 * time), goals(9.0, 201)) == 0, "it creeps on"
    assert count_stuck_robots(time, track(0.005 * time), goals(9.0, 201)) == 1
    trembling = track(0.01 * np.sin(40 * time))
    assert count_stuck_robots(time, trembling, goals(9.0, 201)) == 1, "net displacement counts"


def test_the_window_of_a_stuck_robot_contains_its_first_moment() -> None:
    time = np.arange(41) * 0.25
    assert count_stuck_robots(time, track(np.where(time > 5.0, 1.0, 0.0)), goals(9.0, 41)) == 0
    assert count_stuck_robots(time, track(np.where(time >= 5.0, 1.0, 0.0)), goals(9.0, 41)) == 1


def test_robots_are_counted_and_those_without_goals_are_not_stuck() -> None:
    time = times(6)
    positions = np.zeros((61, 3, 2))
    aims = np.stack([np.full((61, 2), np.nan), np.full((61, 2), 4.0), np.full((61, 2), 5.0)], axis=1)
    assert count_stuck_robots(time, positions, aims) == 2
    assert count_stuck_robots(time, positions, np.full_like(positions, np.nan)) is None


def test_runs_shorter_than_the_window_have_no_stuck_robots() -> None:
    assert count_stuck_robots(times(4), np.zeros((41, 1, 2)), goals(9.0, 41)) is None
    assert count_stuck_robots(times(5), np.zeros((51, 1, 2)), goals(9.0, 51)) == 1
    assert count_stuck_robots(np.array([0.0]), np.zeros((1, 1, 2)), goals(9.0, 1)) is None


def test_cost_history_samples_at_the_rate_and_at_the_end(record: Record) -> None:
    cost = CoverageCost(record.environment, lattice=24)
    history = compute_cost_history(record, cost, rate=10.0)
    np.testing.assert_allclose(history.time, np.arange(121) / 10, atol=1e-9)
    assert history.mean_distance[-1] == cost(record.positions[-1]).mean_distance
    odd = replace(record, time=record.time[:-7], positions=record.positions[:-7])
    assert select_sampled_moments(odd, 10.0)[-1] == len(odd) - 1


def test_summaries_contain_the_figures_of_a_run(record: Record) -> None:
    history = compute_cost_history(record, CoverageCost(record.environment, lattice=24))
    summary = summarise(record, history)
    assert set(summary) == {
        "mean_distance_m",
        "mean_distance_over_run_m",
        "cost_m3",
        "uncovered_area_m2",
        "settled_at_s",
        "contacts",
        "min_clearance_m",
        "path_length_m",
        "stuck_robots",
    }
    assert history.mean_distance.min() < summary["mean_distance_over_run_m"] < history.mean_distance.max()
    assert 0 <= summary["stuck_robots"] <= 6
    assert summary["contacts"] > 0, "Lloyd's robots slide along walls here"
    assert -2e-3 < summary["min_clearance_m"] < 1e-3
    assert len(summary["path_length_m"]) == 6
    assert summary["cost_m3"] == pytest.approx(summary["mean_distance_m"] * record.environment.free_area)
    assert summary["uncovered_area_m2"] == 0.0


def test_rapf_touches_nothing(cluttered: Environment) -> None:
    quiet = Simulation(cluttered, Rapf(), cluttered.start().sample(6), dt=0.02).run(12.0)
    assert count_contacts(quiet, compute_clearances(quiet)) == 0


def test_histories_have_a_short_repr(record: Record) -> None:
    history = compute_cost_history(record, CoverageCost(record.environment, 16), 1.0)
    first, last = history.mean_distance[[0, -1]]
    assert repr(history) == f"<CostHistory 13 moments, 12.0 s, mean distance {first:.3f} to {last:.3f} m>"
