"""Robots that fail and join during a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import Rapf
from robocov.cost import CoverageCost
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError, StartError
from robocov.metrics import compute_clearances, compute_cost_history, count_contacts, summarize
from robocov.record import Record
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.world import ChangingWorld, World
from robocov.world.obstacle_pieces import build_obstacles

HALL = Environment("hall", ((0, 0), (10, 0), (10, 8), (0, 8)))
ROBOT_RADIUS_M = 0.1
STARTS = np.array([[1.0, 1.0], [2.0, 1.5], [1.0, 3.0], [3.0, 2.5]])


def build_world(conditions: Conditions, positions: np.ndarray = STARTS) -> ChangingWorld:
    return ChangingWorld(conditions, HALL, Team.homogeneous(len(positions)), positions)


def test_a_changing_world_equals_a_world_while_all_robots_work() -> None:
    """The robots touch each other; positions and velocities are the same bit for bit."""
    starts = np.array([[1.0, 1.0], [1.3, 1.0], [1.6, 1.05]])
    changing = build_world(Conditions(failures=((1, 100.0),)), starts)
    plain = World(build_obstacles(HALL), Team.homogeneous(3), starts)
    forces = np.array([[3.0, 0.0], [0.0, 0.1], [-3.0, 0.0]])
    for step in range(60):
        changing.step(forces, 0.05, time=step * 0.05)
        plain.step(forces, 0.05)
        assert changing.positions.tobytes() == plain.positions.tobytes()
        assert changing.velocities.tobytes() == plain.velocities.tobytes()


def test_failed_robots_stand_still_and_are_obstacles() -> None:
    changing = build_world(Conditions(failures=((2, 0.5),)), np.array([[1.0, 4.0], [5.0, 4.0]]))
    forces = np.array([[4.0, 0.0], [4.0, 0.0]])
    for step in range(200):
        changing.step(forces, 0.05, time=step * 0.05)
        assert changing.is_working[1] == bool(changing.velocities[1].any())
    distance = changing.positions[1, 0] - 5.0
    assert 0.1 < distance < 0.5
    assert (changing.velocities[1] == 0.0).all()
    assert changing.is_working.tolist() == [True, False]
    assert changing.failed_robots.tolist() == [[*changing.positions[1].tolist(), 0.1]]
    # The other robot leans on it, and does not get past.
    assert changing.positions[0, 0] == pytest.approx(changing.positions[1, 0] - 0.2, abs=2e-3)


def test_robots_that_have_not_joined_are_absent() -> None:
    changing = build_world(Conditions(joins=((2, 4.0),)), np.array([[1.0, 4.0], [3.0, 4.0]]))
    forces = np.array([[4.0, 0.0], [0.0, 0.0]])
    for step in range(60):
        changing.step(forces, 0.05, time=step * 0.05)
    # Robot 1 has passed the position at which robot 2 will join.
    assert changing.positions[0, 0] > 3.5
    assert changing.is_working.tolist() == [True, False]
    for step in range(60, 90):
        changing.step(forces, 0.05, time=step * 0.05)
    assert changing.is_working.all()
    assert changing.positions[1].tolist() == [3.0, 4.0]


def test_robots_that_do_not_work_at_the_start_are_at_rest() -> None:
    """Robot 1 has failed, and robot 2 has not joined yet; robot 3 moves as given."""
    conditions = Conditions(failures=((1, 0.0),), joins=((2, 1.0),))
    velocities = np.array([[0.5, 0.0], [0.5, 0.0], [0.0, 0.5]])
    steering = np.array([[0.0, 0.3], [0.0, 0.3], [1.5, 0.3]])
    team = Team.homogeneous(3, kinematics="unicycle")
    changing = ChangingWorld(conditions, HALL, team, STARTS[:3], velocities, steering=steering)
    assert changing.velocities.tolist() == [[0.0, 0.0], [0.0, 0.0], [0.0, 0.5]]
    assert changing.steering is not None
    assert changing.steering.tolist() == [[0.0, 0.0], [0.0, 0.0], [1.5, 0.3]]


def test_a_robot_joins_next_to_one_that_occupies_its_position() -> None:
    starts = np.array([[5.0, 4.0], [1.0, 1.0]])
    changing = build_world(Conditions(joins=((2, 1.0, (5.05, 4.0)),)), starts)
    for step in range(25):
        changing.step(np.zeros((2, 2)), 0.05, time=step * 0.05)
    distance = np.hypot(*(changing.positions[1] - changing.positions[0]))
    assert 0.2 <= distance < 0.21
    assert changing.positions[1, 0] > 5.1


def test_errors_name_a_robot_without_space_to_join() -> None:
    cell = Environment("cell", ((0, 0), (0.3, 0), (0.3, 0.3), (0, 0.3)))
    starts = np.array([[0.15, 0.15], [0.15, 0.15]])
    with pytest.raises(StartError, match=r"robot 2 joins at 0.1\d* s at .*, but there is no space"):
        Simulation(cell, Rapf(), starts, conditions=Conditions(joins=((2, 0.1),))).run(0.2)


def test_a_run_continues_after_all_robots_have_failed() -> None:
    conditions = Conditions(failures=tuple((k + 1, 0.2) for k in range(4)))
    record = Simulation(HALL, Rapf(), STARTS, conditions=conditions).run(6.0)
    assert not record.is_working[-1].any()
    assert (record.positions[-1] == record.positions[15]).all()
    history = compute_cost_history(record, CoverageCost(HALL, 16), 2.0)
    assert np.isnan(history.mean_distance[-1])
    assert history.uncovered_area[-1] == pytest.approx(80.0)
    assert summarize(record, history)["stuck_robots"] is None


def test_only_working_robots_count_in_the_coverage_cost() -> None:
    conditions = Conditions(failures=((1, 0.3), (2, 0.3)), joins=((3, 0.3),))
    record = Simulation(HALL, Rapf(), STARTS, conditions=conditions).run(0.5)
    cost = CoverageCost(HALL, 32)
    history = compute_cost_history(record, cost, 60.0)
    for step in (0, 10, 20, 30):
        working_positions = record.positions[step][record.is_working[step]]
        assert history.mean_distance[step] == cost(working_positions).mean_distance
    assert record.is_working[0].tolist() == [True, True, False, True]
    assert record.is_working[-1].tolist() == [False, False, True, True]
    assert record.is_present[0].tolist() == [True, True, False, True]
    assert record.is_present[-1].all()


def test_clearance_is_measured_to_walls_and_failed_robots() -> None:
    starts = np.array([[2.0, 4.0], [6.0, 4.0]])
    conditions = Conditions(failures=((2, 0.0),), position_noise=0.3, sensing_noise=0.3)
    clearances = compute_clearances(Simulation(HALL, Rapf(), starts, conditions=conditions).run(0.1))
    # The left wall is closest, whatever the sensor has measured.
    assert clearances[0, 0] == pytest.approx(2.0 - 0.1, abs=1e-6)
    assert np.isinf(clearances[:, 1]).all()


def test_contacts_with_failed_robots_are_counted() -> None:
    starts = np.array([[5.79, 4.0], [6.0, 4.0]])
    record = Simulation(HALL, Rapf(), starts, conditions=Conditions(failures=((2, 0.0),))).run(0.0)
    clearances = compute_clearances(record)
    assert clearances[0, 0] == pytest.approx(0.01, abs=1e-6)
    assert count_contacts(record, clearances) == 0
    assert count_contacts(record, clearances - 0.01) == 1


def test_whole_numbers_are_accepted_as_velocities() -> None:
    team = Team.homogeneous(1)
    worlds = [
        ChangingWorld(Conditions(), HALL, team, np.array([[4.0, 4.0]]), np.array([[1, 0]], dtype=kind))
        for kind in (int, float)
    ]
    for world in worlds:
        world.step(np.zeros((1, 2)), 0.1, time=0.0)
    np.testing.assert_array_equal(worlds[0].velocities, worlds[1].velocities)
    assert 0.0 < worlds[0].velocities[0, 0] < 1.0


def step_until_failure(simulation: Simulation) -> None:
    """Take the steps until a robot that fails at 0.1 s has failed."""
    for _ in range(8):
        simulation.step()
    assert simulation.time > 0.1


def test_robots_sense_failed_robots() -> None:
    starts = np.array([[4.0, 4.0], [6.0, 4.0]])
    simulation = Simulation(HALL, Rapf(), starts, conditions=Conditions(failures=((2, 0.1),)))
    assert np.isnan(simulation.observe().obstacle_points[0]).all()
    step_until_failure(simulation)
    obstacle_point = simulation.observe().obstacle_points[0]
    offset = simulation.positions[0] - simulation.positions[1]
    expected = simulation.positions[1] + ROBOT_RADIUS_M * offset / np.hypot(*offset)
    np.testing.assert_allclose(obstacle_point, expected, atol=1e-9)
    assert np.isnan(simulation.observe().obstacle_points[1]).all()


def test_a_copy_senses_failed_robots_at_the_time_of_the_copy() -> None:
    starts = np.array([[4.0, 4.0], [6.0, 4.0]])
    simulation = Simulation(HALL, Rapf(), starts, conditions=Conditions(failures=((2, 0.1),)))
    step_until_failure(simulation)
    obstacle_point = simulation.observe().obstacle_points[0]
    copy = simulation.copy()
    simulation.step()
    np.testing.assert_array_equal(copy.observe().obstacle_points[0], obstacle_point)


def test_robots_that_have_not_joined_have_no_contacts() -> None:
    """Until they join, all of them are at one position."""
    x, y = np.meshgrid(np.arange(12) * 0.6 + 1, np.arange(10) * 0.6 + 1)
    starts = np.column_stack([x.ravel(), y.ravel()])
    conditions = Conditions(joins=tuple((k + 1, 5.0, (0.5, 0.5)) for k in range(1, 60)))
    record = Simulation(HALL, Rapf(), starts, conditions=conditions).run(0.1)
    assert count_contacts(record, compute_clearances(record)) == 0


def test_records_under_conditions_are_saved_and_loaded(tmp_path: Path) -> None:
    conditions = Conditions(loss=0.2, failures=((1, 0.3),), joins=((3, 0.2, (6.0, 6.0)),), seed=5)
    record = Simulation(HALL, Rapf(), STARTS, conditions=conditions).run(0.5)
    record.save(tmp_path)
    loaded = Record.load(tmp_path)
    assert loaded.conditions == conditions
    np.testing.assert_array_equal(loaded.is_working, record.is_working)
    assert loaded.snapshot(30).is_working is not None
    simulation = Simulation(loaded.environment, Rapf(), loaded.positions[0], conditions=loaded.conditions)
    assert simulation.run(0.5).positions.tobytes() == record.positions.tobytes()


def test_starts_of_robots_that_join_later_may_overlap() -> None:
    starts = np.array([[1.0, 1.0], [1.0, 1.0], [2.0, 2.0]])
    with pytest.raises(StartError, match="overlap"):
        Simulation(HALL, Rapf(), starts)
    record = Simulation(HALL, Rapf(), starts, conditions=Conditions(joins=((2, 1.0),))).run(2.0)
    assert record.is_working[-1].all()
    with pytest.raises(ParameterError, match="expected a robot from 1 to 3, got robot 4"):
        Simulation(HALL, Rapf(), starts, conditions=Conditions(joins=((4, 1.0),)))


def test_larger_robots_must_not_overlap_failed_ones() -> None:
    conditions = Conditions(failures=((2, 0.1),), joins=((3, 5.0, (2.0, 2.2)),))
    starts = np.array([[2.0, 2.0], [2.3, 2.0], [2.0, 2.2]])
    simulation = Simulation(HALL, Rapf(), starts, conditions=conditions)
    simulation.run(0.2)
    team = Team.homogeneous(3, radius=0.2)
    with pytest.raises(StartError, match=r"starts\[0\] and starts\[1\] are 0.3 m apart: the robots overlap"):
        simulation.with_changes(team=team, positions=starts)
    # The third robot has not joined yet.
    apart = np.array([[1.0, 2.0], [2.3, 2.0], [1.0, 2.2]])
    assert simulation.with_changes(team=team, positions=apart).is_working.tolist() == [True, False, False]


def test_a_failure_does_not_affect_robots_elsewhere() -> None:
    """The world is rebuilt when robot 2 fails; robot 1, which leans on a wall, continues as before."""
    walled = Environment("walled", HALL.boundary, (WallObstacle(((5, 0), (5, 8)), 0.1),))
    starts = np.array([[4.0, 4.0], [8.0, 4.0]])
    forces = np.array([[3.0, 1.0], [0.0, 0.0]])
    final_positions = []
    for failure_time in (3.0, 1000.0):
        conditions = Conditions(failures=((2, failure_time),))
        changing = ChangingWorld(conditions, walled, Team.homogeneous(2), starts)
        for step in range(120):
            changing.step(forces, 0.05, time=step * 0.05)
        final_positions.append(changing.positions[0].tobytes())
    assert final_positions[0] == final_positions[1]


def test_robots_that_failed_earlier_remain_obstacles() -> None:
    changing = build_world(Conditions(failures=((1, 0.2), (3, 0.4))))
    for step in range(12):
        changing.step(np.zeros((4, 2)), 0.05, time=step * 0.05)
    assert changing.failed_robots[:, :2].tolist() == STARTS[[0, 2]].tolist()
    assert changing.is_working.tolist() == [False, True, False, True]
    with pytest.raises(ValueError, match="read-only"):
        changing.is_working[...] = True


def test_robots_that_join_at_one_position_stand_next_to_each_other() -> None:
    starts = np.array([[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]])
    conditions = Conditions(joins=((2, 0.2, (5.0, 4.0)), (3, 0.2, (5.0, 4.0))))
    changing = build_world(conditions, starts)
    for step in range(6):
        changing.step(np.zeros((3, 2)), 0.05, time=step * 0.05)
    assert changing.positions[1].tolist() == [5.0, 4.0]
    assert 0.2 <= np.hypot(*(changing.positions[2] - [5.0, 4.0])) < 0.21


def test_a_robot_that_joins_and_fails_within_a_step_is_never_present() -> None:
    changing = build_world(Conditions(joins=((2, 0.21),), failures=((2, 0.22),)))
    for step in range(8):
        changing.step(np.zeros((4, 2)), 0.05, time=step * 0.05)
        assert changing.is_working.tolist() == [True, False, True, True]
        assert len(changing.failed_robots) == 0
