"""Records of robots that join during a run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocov.conditions import Conditions, JoinedRobot
from robocov.controllers import Lloyd, Rapf
from robocov.environment import Environment, PolygonObstacle
from robocov.errors import ParameterError
from robocov.metrics import CostHistory, compute_clearances, compute_path_lengths, summarize
from robocov.metrics.advice import advise
from robocov.metrics.run_metrics import compute_run_metrics
from robocov.record import Record
from robocov.simulation import Simulation

ROOM = Environment(
    "room", ((0, 0), (20, 0), (20, 10), (0, 10)), (PolygonObstacle(((8, 4), (12, 4), (12, 6), (8, 6))),)
)
STARTS = np.array([[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]])


def run_with_joins(*joins: tuple[object, ...], duration: float = 3.0) -> Record:
    conditions = Conditions(joins=joins)
    return Simulation(ROOM, Lloyd(), STARTS, dt=0.05, conditions=conditions).run(duration)


@pytest.mark.parametrize("place", [(19.0, 9.0), (10.0, 5.0), (20.0, 10.0), (0.0, 0.0)])
def test_paths_start_where_robots_join(place: tuple[float, float]) -> None:
    record = run_with_joins((3, 1.0, place))
    lengths = compute_path_lengths(record.positions, record.traveled)
    first_moment = int(np.argmax(record.is_present[:, 2]))
    np.testing.assert_array_equal(lengths[2], compute_path_lengths(record.positions[first_moment:])[2])
    assert 0.0 < lengths[2] <= 2.0  # in 2 s at 1 m/s
    assert compute_run_metrics(record).path_length[-1] == pytest.approx(lengths.mean())
    np.testing.assert_array_equal(lengths[:2], compute_path_lengths(record.positions)[:2])


def test_moved_joining_positions_are_recorded(tmp_path: Path) -> None:
    record = run_with_joins((3, 1.0, (10.0, 5.0)))
    (joined,) = record.joined
    assert joined.robot == 3
    assert joined.time == pytest.approx(1.0)
    assert joined.requested_position == (10.0, 5.0)
    first_moment = int(np.argmax(record.is_present[:, 2]))
    np.testing.assert_array_equal(record.positions[first_moment, 2], joined.position)
    assert joined.offset > 1.0
    record.save(tmp_path)
    loaded = Record.load(tmp_path)
    assert loaded.joined == record.joined
    np.testing.assert_array_equal(loaded.traveled, record.traveled)


def test_notes_contain_positions_to_the_millimeter() -> None:
    joined = JoinedRobot(3, 1234.5, (385123.25, 1.0), (385123.25, 1.5))
    record = replace(run_with_joins(duration=0.1), joined=(joined,))
    value = np.array([1.0])
    history = CostHistory(time=np.zeros(1), mean_distance=value, cost=value, uncovered_area=value)
    note = "Robot 3 joined at 1234.5 s at [385123.25, 1], 0.5 m from [385123.25, 1.5], which is too close"
    assert summarize(record, history)["notes"][0].startswith(note)


def test_robots_with_enough_space_join_at_the_requested_position() -> None:
    (joined,) = run_with_joins((3, 1.0, (19.0, 9.0))).joined
    assert joined == JoinedRobot(3, pytest.approx(1.0), (19.0, 9.0), (19.0, 9.0))
    assert joined.offset == 0.0
    (joined,) = run_with_joins((3, 1.0)).joined
    assert joined.position == joined.requested_position == (3.0, 1.0)


def test_joining_positions_taken_by_another_robot_are_moved() -> None:
    taken_position = tuple(run_with_joins(duration=1.0).positions[-1, 0])
    (joined,) = run_with_joins((3, 1.0, taken_position)).joined
    assert 0.1 < joined.offset < 0.5


def test_robots_that_are_never_present_do_not_join() -> None:
    assert run_with_joins((3, 60.0, (19.0, 9.0))).joined == ()
    conditions = Conditions(joins=[(3, 1.01)], failures=[(3, 1.02)])
    assert Simulation(ROOM, Lloyd(), STARTS, dt=0.05, conditions=conditions).run(2.0).joined == ()


@pytest.mark.parametrize("place", [(100.0, 100.0), (-0.01, 5.0), (20.001, 5.0), (1e300, 0.0)])
def test_joining_positions_outside_the_map_are_rejected(place: tuple[float, float]) -> None:
    with pytest.raises(
        ParameterError, match=r"joins\[0\]: expected a position inside the boundary of map 'room'"
    ):
        run_with_joins((3, 1.0, place))


def test_the_message_about_a_position_outside_the_map_contains_exact_coordinates() -> None:
    x = 385000.25
    y = 5123456.5
    field = Environment("field", ((x, y), (x + 20, y), (x + 20, y + 10), (x, y + 10)))
    conditions = Conditions(joins=[(1, 1.0, (x - 1, y))])
    with pytest.raises(ParameterError) as caught:
        Simulation(field, Lloyd(), STARTS + [x, y], dt=0.05, conditions=conditions)
    assert "(x from 385000.25 to 385020.25 m, y from 5123456.5 to 5123466.5 m)" in str(caught.value)
    assert "got [384999.25, 5123456.5] for robot 1" in str(caught.value)


def test_joining_positions_require_a_time_after_the_start() -> None:
    with pytest.raises(ParameterError, match=r"joins\[0\]: expected a time above 0 s"):
        run_with_joins((3, 0.0, (19.0, 9.0)))


def test_copies_know_which_robots_have_joined() -> None:
    conditions = Conditions(joins=[(3, 0.5), (2, 1.0)])
    simulation = Simulation(ROOM, Lloyd(), STARTS, dt=0.05, conditions=conditions)
    for _ in range(12):
        simulation.step()
    twin = simulation.copy()
    for _ in range(12):
        twin.step()
    assert [joined.robot for joined in simulation.joined] == [3]
    assert [joined.robot for joined in twin.joined] == [3, 2]
    assert twin.with_changes(controller=Rapf()).joined == twin.joined


def test_a_record_contains_only_robots_that_joined_during_its_steps() -> None:
    conditions = Conditions(joins=[(3, 0.5), (2, 1.0)])
    simulation = Simulation(ROOM, Lloyd(), STARTS, dt=0.05, conditions=conditions)
    first_record = simulation.run(0.75)
    second_record = simulation.run(0.75)
    assert [joined.robot for joined in first_record.joined] == [3]
    assert [joined.robot for joined in second_record.joined] == [2]
    assert first_record.until(0.25).joined == ()
    assert first_record.until(0.5).joined == first_record.thin(1.0).joined == first_record.joined


def test_robots_that_are_placed_by_the_user_do_not_travel() -> None:
    record = run_with_joins(duration=2.0)
    positions = record.positions.copy()
    positions[20:, 1] += 5.0
    session = {"placements": [{"time_s": float(record.time[20]), "robots": [7]}], "robots": [4, 7, 9]}
    edited = replace(record, positions=positions, session=session)
    original_lengths = compute_path_lengths(record.positions)
    lengths = compute_path_lengths(edited.positions, edited.traveled)
    np.testing.assert_allclose(lengths[[0, 2]], original_lengths[[0, 2]])
    step_length = np.hypot(*(record.positions[20, 1] - record.positions[19, 1]))
    assert lengths[1] == pytest.approx(original_lengths[1] - step_length)
    assert edited.until(0.5).traveled.all()


def test_robots_of_ordinary_records_travel_in_every_step() -> None:
    record = run_with_joins()
    assert record.joined == ()
    assert record.traveled.all()
    assert "events" not in record.to_json()
    assert advise(record, compute_clearances(record)) == []
