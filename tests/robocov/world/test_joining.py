from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocov.conditions import Conditions, JoinedRobot
from robocov.controllers import Lloyd
from robocov.environment import Environment, PolygonObstacle
from robocov.errors import ParameterError
from robocov.metrics import compute_clearances, compute_path_lengths
from robocov.metrics.advice import advise
from robocov.metrics.run_metrics import compute_run_metrics
from robocov.record import Record
from robocov.simulation import Simulation

ROOM = Environment(
    "room", ((0, 0), (20, 0), (20, 10), (0, 10)), (PolygonObstacle(((8, 4), (12, 4), (12, 6), (8, 6))),)
)
STARTS = np.array([[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]])


def run_with(*joins: tuple[object, ...], duration: float = 3.0) -> Record:
    conditions = Conditions(joins=joins)
    return Simulation(ROOM, Lloyd(), STARTS, dt=0.05, conditions=conditions).run(duration)


@pytest.mark.parametrize("place", [(19.0, 9.0), (10.0, 5.0), (20.0, 10.0), (0.0, 0.0)])
def test_the_path_of_a_robot_begins_where_it_joins(place: tuple[float, float]) -> None:
    record = run_with((3, 1.0, place))
    lengths = compute_path_lengths(record.positions, record.travelled)
    since = int(np.argmax(record.present[:, 2]))
    np.testing.assert_array_equal(lengths[2], compute_path_lengths(record.positions[since:])[2])
    assert 0.0 < lengths[2] <= 2.0  # at 1 m/s
    assert compute_run_metrics(record).path_length[-1] == pytest.approx(lengths.mean())
    np.testing.assert_array_equal(lengths[:2], compute_path_lengths(record.positions)[:2])


def test_a_robot_that_joins_beside_a_wall_is_moved_and_that_is_recorded(tmp_path: Path) -> None:
    record = run_with((3, 1.0, (10.0, 5.0)))
    (joined,) = record.joined
    assert joined.robot == 3 and joined.time == pytest.approx(1.0) and joined.requested == (10.0, 5.0)
    since = int(np.argmax(record.present[:, 2]))
    np.testing.assert_array_equal(record.positions[since, 2], joined.place)
    assert joined.offset > 1.0
    record.save(tmp_path)
    again = Record.load(tmp_path)
    assert again.joined == record.joined
    np.testing.assert_array_equal(again.travelled, record.travelled)


def test_a_robot_with_space_joins_where_it_is_to() -> None:
    (joined,) = run_with((3, 1.0, (19.0, 9.0))).joined
    assert joined == JoinedRobot(3, pytest.approx(1.0), (19.0, 9.0), (19.0, 9.0))
    assert joined.offset == 0.0
    (joined,) = run_with((3, 1.0)).joined
    assert joined.place == joined.requested == (3.0, 1.0)


def test_a_place_that_another_robot_has_is_moved() -> None:
    (joined,) = run_with((3, 1.0, tuple(run_with(duration=1.0).positions[-1, 0]))).joined
    assert 0.1 < joined.offset < 0.5


def test_who_never_joins_is_no_event() -> None:
    assert run_with((3, 60.0, (19.0, 9.0))).joined == ()
    conditions = Conditions(joins=[(3, 1.01)], failures=[(3, 1.02)])
    assert Simulation(ROOM, Lloyd(), STARTS, dt=0.05, conditions=conditions).run(2.0).joined == ()


@pytest.mark.parametrize("place", [(100.0, 100.0), (-0.01, 5.0), (20.001, 5.0), (1e300, 0.0)])
def test_a_place_outside_of_the_map_is_refused(place: tuple[float, float]) -> None:
    with pytest.raises(
        ParameterError, match=r"joins\[0\]: expected a place inside the boundary of map 'room'"
    ):
        run_with((3, 1.0, place))


def test_a_place_of_its_own_takes_a_time_after_the_beginning() -> None:
    with pytest.raises(ParameterError, match=r"joins\[0\]: expected a time above 0 s"):
        run_with((3, 0.0, (19.0, 9.0)))


def test_a_copy_knows_who_joined_and_goes_on() -> None:
    conditions = Conditions(joins=[(3, 0.5), (2, 1.0)])
    simulation = Simulation(ROOM, Lloyd(), STARTS, dt=0.05, conditions=conditions)
    for _ in range(12):
        simulation.step()
    twin = simulation.copy()
    for _ in range(12):
        twin.step()
    assert [each.robot for each in simulation.joined] == [3]
    assert [each.robot for each in twin.joined] == [3, 2]


def test_a_robot_that_was_put_elsewhere_by_hand_did_not_travel_there() -> None:
    record = run_with(duration=2.0)
    positions = record.positions.copy()
    positions[20:, 1] += 5.0
    session = {"placed": [{"time_s": float(record.time[20]), "robots": [7]}], "robots": [4, 7, 9]}
    moved = replace(record, positions=positions, session=session)
    usual = compute_path_lengths(record.positions)
    lengths = compute_path_lengths(moved.positions, moved.travelled)
    np.testing.assert_allclose(lengths[[0, 2]], usual[[0, 2]])
    step = np.hypot(*(record.positions[20, 1] - record.positions[19, 1]))
    assert lengths[1] == pytest.approx(usual[1] - step)
    assert moved.until(0.5).travelled.all()


def test_ordinary_records_travel_in_every_step() -> None:
    record = run_with()
    assert record.joined == () and record.travelled.all()
    assert "events" not in record.to_json()
    assert advise(record, compute_clearances(record)) == []
