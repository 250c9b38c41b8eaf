from __future__ import annotations

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import Rapf
from robocov.cost import CoverageCost
from robocov.environment import Environment, WallObstacle
from robocov.errors import ParameterError, StartError
from robocov.metrics import compute_clearances, compute_cost_history, count_contacts, summarise
from robocov.record import Record
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.world import ChangingWorld, World
from robocov.world.obstacle_pieces import build_solid_pieces

HALL = Environment("hall", ((0, 0), (10, 0), (10, 8), (0, 8)))
STARTS = np.array([[1.0, 1.0], [2.0, 1.5], [1.0, 3.0], [3.0, 2.5]])


def world(conditions: Conditions, positions: np.ndarray = STARTS, **team: float) -> ChangingWorld:
    made = Team.homogeneous(len(positions), **team)
    return ChangingWorld(conditions, HALL, made, positions)


def test_as_long_as_all_work_it_is_a_world() -> None:
    """Bit for bit, with robots that touch."""
    places = np.array([[1.0, 1.0], [1.3, 1.0], [1.6, 1.05]])
    changing = world(Conditions(failures=((1, 100.0),)), places)
    plain = World(build_solid_pieces(HALL), Team.homogeneous(3), places)
    forces = np.array([[3.0, 0.0], [0.0, 0.1], [-3.0, 0.0]])
    for step in range(60):
        changing.step(forces, 0.05, time=step * 0.05)
        plain.step(forces, 0.05)
        assert changing.positions.tobytes() == plain.positions.tobytes()
        assert changing.velocities.tobytes() == plain.velocities.tobytes()


def test_who_failed_stands_still_and_is_in_the_way() -> None:
    places = np.array([[1.0, 4.0], [5.0, 4.0]])
    changing = world(Conditions(failures=((2, 0.5),)), places)
    forces = np.array([[4.0, 0.0], [4.0, 0.0]])
    for step in range(200):
        changing.step(forces, 0.05, time=step * 0.05)
        assert changing.working[1] == bool(changing.velocities[1].any())
    moved = changing.positions[1, 0] - 5.0
    assert 0.1 < moved < 0.5
    assert (changing.velocities[1] == 0.0).all()
    assert changing.working.tolist() == [True, False]
    assert changing.failed_robots.tolist() == [[*changing.positions[1].tolist(), 0.1]]
    # the other leans on it, and does not get past
    assert changing.positions[0, 0] == pytest.approx(changing.positions[1, 0] - 0.2, abs=2e-3)


def test_who_has_not_joined_is_nowhere() -> None:
    places = np.array([[1.0, 4.0], [3.0, 4.0]])
    changing = world(Conditions(joins=((2, 4.0),)), places)
    forces = np.array([[4.0, 0.0], [0.0, 0.0]])
    for step in range(60):
        changing.step(forces, 0.05, time=step * 0.05)
    assert changing.positions[0, 0] > 3.5  # it went through where the other will be
    assert changing.working.tolist() == [True, False]
    for step in range(60, 90):
        changing.step(forces, 0.05, time=step * 0.05)
    assert changing.working.all()
    assert changing.positions[1].tolist() == [3.0, 4.0]


def test_who_joins_where_another_stands_appears_beside_it() -> None:
    places = np.array([[5.0, 4.0], [1.0, 1.0]])
    changing = world(Conditions(joins=((2, 1.0, (5.05, 4.0)),)), places)
    for step in range(25):
        changing.step(np.zeros((2, 2)), 0.05, time=step * 0.05)
    apart = np.hypot(*(changing.positions[1] - changing.positions[0]))
    assert 0.2 <= apart < 0.21
    assert changing.positions[1, 0] > 5.1


def test_a_robot_that_has_no_room_to_join_is_named() -> None:
    cell = Environment("cell", ((0, 0), (0.3, 0), (0.3, 0.3), (0, 0.3)))
    starts = np.array([[0.15, 0.15], [0.15, 0.15]])
    with pytest.raises(StartError, match=r"robot 2 joins at 0.1\d* s at .*, but there is no room"):
        Simulation(cell, Rapf(), starts, conditions=Conditions(joins=((2, 0.1),))).run(0.2)


def test_when_all_have_failed_the_run_goes_on() -> None:
    conditions = Conditions(failures=tuple((k + 1, 0.2) for k in range(4)))
    record = Simulation(HALL, Rapf(), STARTS, conditions=conditions).run(6.0)
    assert not record.working[-1].any()
    assert (record.positions[-1] == record.positions[15]).all()
    history = compute_cost_history(record, CoverageCost(HALL, 16), 2.0)
    assert np.isnan(history.mean_distance[-1])
    assert history.uncovered_area[-1] == pytest.approx(80.0)
    assert summarise(record, history)["stuck_robots"] is None


def test_cost_counts_who_works() -> None:
    conditions = Conditions(failures=((1, 0.3), (2, 0.3)), joins=((3, 0.3),))
    record = Simulation(HALL, Rapf(), STARTS, conditions=conditions).run(0.5)
    cost = CoverageCost(HALL, 32)
    history = compute_cost_history(record, cost, 60.0)
    for k in (0, 10, 20, 30):
        counted = record.working[k]
        assert history.mean_distance[k] == cost(record.positions[k][counted]).mean_distance
    assert record.working[0].tolist() == [True, True, False, True]
    assert record.working[-1].tolist() == [False, False, True, True]
    assert record.present[0].tolist() == [True, True, False, True]
    assert record.present[-1].all()


def test_clearance_is_to_walls_and_to_robots_that_failed() -> None:
    places = np.array([[2.0, 4.0], [6.0, 4.0]])
    conditions = Conditions(failures=((2, 0.0),), position_noise=0.3, sensing_noise=0.3)
    record = Simulation(HALL, Rapf(), places, conditions=conditions).run(0.1)
    gap = compute_clearances(record)
    assert gap[0, 0] == pytest.approx(2.0 - 0.1, abs=1e-6)  # the left wall, whatever the sensor said
    assert np.isinf(gap[:, 1]).all()
    near = np.array([[5.79, 4.0], [6.0, 4.0]])
    touching = Simulation(HALL, Rapf(), near, conditions=Conditions(failures=((2, 0.0),))).run(0.0)
    assert compute_clearances(touching)[0, 0] == pytest.approx(0.01, abs=1e-6)
    assert count_contacts(touching, compute_clearances(touching) - 0.01) == 1


def test_others_sense_who_failed() -> None:
    places = np.array([[4.0, 4.0], [6.0, 4.0]])
    one = Simulation(HALL, Rapf(), places, conditions=Conditions(failures=((2, 0.1),)))
    assert np.isnan(one.observe().obstacle_points[0]).all()
    for _ in range(8):
        one.step()
    point = one.observe().obstacle_points[0]
    expected = one.positions[1] + 0.1 * (one.positions[0] - one.positions[1]) / np.hypot(
        *(one.positions[0] - one.positions[1])
    )
    np.testing.assert_allclose(point, expected, atol=1e-9)
    assert np.isnan(one.observe().obstacle_points[1]).all()
    twin = one.copy()
    one.step()
    assert (twin.observe().obstacle_points[0] == point).all()


def test_many_robots_touch_only_while_they_work() -> None:
    grid = np.stack(np.meshgrid(np.arange(12) * 0.6 + 1, np.arange(10) * 0.6 + 1), axis=-1).reshape(-1, 2)
    team = Team.homogeneous(len(grid), radius=0.1)
    conditions = Conditions(joins=tuple((k + 1, 5.0, (0.5, 0.5)) for k in range(1, 60)))
    record = Simulation(HALL, Rapf(), grid, team, conditions=conditions).run(0.1)
    assert (
        count_contacts(record, compute_clearances(record)) == 0
    )  # those that will join are all in one place until then


def test_a_run_under_conditions_is_saved_and_read(tmp_path: object) -> None:
    conditions = Conditions(loss=0.2, failures=((1, 0.3),), joins=((3, 0.2, (6.0, 6.0)),), seed=5)
    record = Simulation(HALL, Rapf(), STARTS, conditions=conditions).run(0.5)
    folder = tmp_path  # type: ignore[assignment]
    record.save(folder)  # type: ignore[arg-type]
    again = Record.load(folder)  # type: ignore[arg-type]
    assert again.conditions == conditions
    assert (again.working == record.working).all()
    assert again.snapshot(30).working is not None
    repeated = Simulation(again.environment, Rapf(), again.positions[0], conditions=again.conditions).run(0.5)
    assert repeated.positions.tobytes() == record.positions.tobytes()


def test_starts_that_are_not_taken_yet_may_overlap() -> None:
    places = np.array([[1.0, 1.0], [1.0, 1.0], [2.0, 2.0]])
    with pytest.raises(StartError, match="overlap"):
        Simulation(HALL, Rapf(), places)
    record = Simulation(HALL, Rapf(), places, conditions=Conditions(joins=((2, 1.0),))).run(2.0)
    assert record.working[-1].all()
    with pytest.raises(ParameterError, match="expected a robot from 1 to 3, got robot 4"):
        Simulation(HALL, Rapf(), places, conditions=Conditions(joins=((4, 1.0),)))


def test_a_failure_beside_a_wall_changes_nothing_for_others() -> None:
    """The world is made anew when a robot fails; one that leans on a wall elsewhere goes on as it did."""
    walled = Environment("walled", HALL.boundary, (WallObstacle(((5, 0), (5, 8)), 0.1),))
    places = np.array([[4.0, 4.0], [8.0, 4.0]])
    forces = np.array([[3.0, 1.0], [0.0, 0.0]])
    made = [
        ChangingWorld(each, walled, Team.homogeneous(2), places)
        for each in (Conditions(failures=((2, 3.0),)), Conditions(failures=((2, 1e3),)))
    ]
    for step in range(120):
        for each in made:
            each.step(forces, 0.05, time=step * 0.05)
    assert made[0].positions[0].tobytes() == made[1].positions[0].tobytes()


def test_who_failed_earlier_stays_in_the_way_when_another_one_fails() -> None:
    changing = world(Conditions(failures=((1, 0.2), (3, 0.4))))
    for step in range(12):
        changing.step(np.zeros((4, 2)), 0.05, time=step * 0.05)
    assert changing.failed_robots[:, :2].tolist() == STARTS[[0, 2]].tolist()
    assert changing.working.tolist() == [False, True, False, True]
    with pytest.raises(ValueError, match="read-only"):
        changing.working[...] = True


def test_two_that_join_in_one_place_stand_beside_each_other() -> None:
    places = np.array([[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]])
    changing = world(Conditions(joins=((2, 0.2, (5.0, 4.0)), (3, 0.2, (5.0, 4.0)))), places)
    for step in range(6):
        changing.step(np.zeros((3, 2)), 0.05, time=step * 0.05)
    assert changing.positions[1].tolist() == [5.0, 4.0]
    assert 0.2 <= np.hypot(*(changing.positions[2] - [5.0, 4.0])) < 0.21


def test_who_joins_and_fails_within_a_step_was_never_there() -> None:
    changing = world(Conditions(joins=((2, 0.21),), failures=((2, 0.22),)))
    for step in range(8):
        changing.step(np.zeros((4, 2)), 0.05, time=step * 0.05)
        assert changing.working.tolist() == [True, False, True, True]
        assert len(changing.failed_robots) == 0
