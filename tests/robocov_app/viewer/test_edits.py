from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_sessions import (
    HALL,
    LLOYD,
    RAPF,
    RPF,
    advance_session,
    compute_penetration,
    describe_state,
    get_robot_numbers,
    start_session,
)

from robocov.environment import CircleObstacle, Environment
from robocov.errors import MapError, ParameterError, StartError
from robocov.team import Team
from robocov.world.free_positions import find_free_position
from robocov_app.viewer.session import edits as module
from robocov_app.viewer.session.edits import AddRobot
from robocov_app.viewer.session.robot_properties import RobotProperties

RADIUS = 0.1


def joined(session, point, number) -> None:
    session.apply(AddRobot(number, point), "robot", f"robot {number} joined")


places = st.tuples(st.floats(-1.0, 7.0), st.floats(-1.0, 5.0))


def place_of(session, number, pane=0) -> list[float]:
    its = session.timeline.panes[pane]
    return its.simulation.positions[its.get_row(number)].tolist()


def failed_at(session, number, pane=0) -> tuple[float, float]:
    return session.timeline.panes[pane].setup.failed[number]


# where there is room


@given(places, st.lists(places, max_size=12), st.sampled_from([0.05, 0.1, 0.3]))
def test_the_nearest_place_where_a_robot_fits(point, others, radius):
    others = np.array(others).reshape(-1, 2)
    place = find_free_position(HALL, radius, others, point)
    room = HALL.free.buffer(-radius)
    if len(others):
        room = room.difference(shapely.union_all(shapely.buffer(shapely.points(others), 2 * radius)))
        assert np.hypot(*(others - place).T).min() >= 2 * radius
    assert shapely.distance(HALL.free.boundary, shapely.Point(place)) >= radius - 1e-9
    assert HALL.free.contains(shapely.Point(place))
    # no other is nearer, but for a millimeter's room
    nearest = shapely.distance(room, shapely.Point(point))
    assert np.hypot(place[0] - point[0], place[1] - point[1]) <= nearest + 0.02


def test_where_it_fits_it_stays():
    assert find_free_position(HALL, RADIUS, np.empty((0, 2)), (3.0, 2.0)) == (3.0, 2.0)
    assert find_free_position(HALL, RADIUS, np.array([[3.0, 2.2]]), (3.0, 2.0)) == (3.0, 2.0)


def test_a_room_that_is_full():
    cell = Environment("cell", ((0, 0), (0.45, 0), (0.45, 0.45), (0, 0.45)))
    assert find_free_position(cell, RADIUS, np.array([[0.15, 0.15]]), (0.15, 0.15))
    for radius, others in ((RADIUS, np.array([[0.225, 0.225]])), (0.3, np.empty((0, 2)))):
        with pytest.raises(StartError, match="no room for a robot there"):
            find_free_position(cell, radius, others, (0.25, 0.25))


# placing


def test_a_robot_is_placed_in_all_panes():
    session = advance_session(start_session(RAPF, LLOYD), 20)
    others = [pane.simulation.positions[1:].copy() for pane in session.timeline.panes]
    session.place_robot(1, (5.0, 3.0))
    for k, pane in enumerate(session.timeline.panes):
        assert place_of(session, 1, k) == [5.0, 3.0]
        assert pane.simulation.velocities[0].tolist() == [0.0, 0.0]
        np.testing.assert_array_equal(pane.simulation.positions[1:], others[k])
    assert session.timeline.history.last.states[0].positions[0].tolist() == [5.0, 3.0]
    assert len(session.timeline.history) == 21


@given(st.lists(st.tuples(st.integers(1, 6), places), min_size=1, max_size=6))
@settings(max_examples=40)
def test_wherever_robots_are_placed_they_fit(drags):
    session = start_session(robots=6)
    for number, point in drags:
        others = [k for k in range(6) if k != number - 1]
        before = session.timeline.panes[0].simulation.positions[others]
        session.place_robot(number, point)
        np.testing.assert_array_equal(session.timeline.panes[0].simulation.positions[others], before)
        assert compute_penetration(session) <= 1e-9
    session.playback.step()
    assert compute_penetration(session) < 2e-3


def test_a_robot_that_failed_is_placed_too():
    session = advance_session(start_session(RAPF, RPF), 10)
    session.fail_robot(2)
    session.fail_robot(3)
    session.place_robot(2, (5.0, 3.0))
    assert [failed_at(session, 2, pane) for pane in (0, 1)] == [(5.0, 3.0)] * 2
    session.place_robot(2, failed_at(session, 3))
    assert np.hypot(*np.subtract(failed_at(session, 2), failed_at(session, 3))) >= 2 * RADIUS
    session.place_robot(2, (9.0, 9.0))
    assert failed_at(session, 2) == pytest.approx((5.899, 3.899))
    assert get_robot_numbers(session) == ((1,), (2, 3))


def test_grabbing_places_while_it_is_paused():
    session = advance_session(start_session(), 5)
    session.drag_robot(2, (3.0, 3.0))
    assert session.timeline.drag is None
    assert place_of(session, 2) == [3.0, 3.0]
    session.playback.is_playing = True
    session.drag_robot(2, (3.2, 3.0))
    assert place_of(session, 2) == [3.0, 3.0]
    assert session.timeline.drag == (2, (3.2, 3.0))
    # paused while it was held
    session.playback.is_playing = False
    session.drag_robot(2, (3.4, 3.0))
    assert session.timeline.drag is None
    assert place_of(session, 2) == [3.4, 3.0]


def test_what_has_failed_is_not_pulled():
    session = start_session()
    session.fail_robot(2)
    session.playback.is_playing = True
    session.drag_robot(2, (3.0, 3.0))
    assert session.timeline.drag is None
    assert failed_at(session, 2) == (3.0, 3.0)


# joining and leaving


def test_robots_join_at_rest():
    session = advance_session(start_session(RAPF, LLOYD), 10)
    velocities = session.timeline.panes[0].simulation.velocities
    assert session.add_robot((5.0, 3.0)) == 4
    assert session.add_robot((5.0, 3.0)) == 5
    for pane in session.timeline.panes:
        assert pane.numbers == (1, 2, 3, 4, 5)
        assert pane.simulation.positions[3].tolist() == [5.0, 3.0]
        assert 2 * RADIUS <= np.hypot(*(pane.simulation.positions[4] - (5.0, 3.0))) < 2 * RADIUS + 0.01
        assert pane.simulation.velocities[3:].tolist() == [[0.0, 0.0]] * 2
    np.testing.assert_array_equal(session.timeline.panes[0].simulation.velocities[:3], velocities)
    assert [event.text for event in session.timeline.events] == ["robot 4 joined", "robot 5 joined"]
    joined(session, (1.0, 3.0), 9)
    assert session.add_robot((1.0, 3.0)) == 10


def test_robots_leave_and_come_back_to_their_rows():
    session = advance_session(start_session(RAPF, LLOYD, robots=4), 15)
    where = [place_of(session, 2, pane) for pane in (0, 1)]
    assert where[0] != where[1]
    session.remove_robot(2)
    assert get_robot_numbers(session) == ((1, 3, 4), ())
    session.undo()
    assert get_robot_numbers(session) == ((1, 2, 3, 4), ())
    # in each pane to its own place
    assert [place_of(session, 2, pane) for pane in (0, 1)] == where
    session.redo()
    assert get_robot_numbers(session) == ((1, 3, 4), ())


def test_a_robot_that_failed_leaves_and_comes_back_failed():
    session = advance_session(start_session(RAPF, LLOYD, robots=3), 15)
    session.fail_robot(1)
    where = [failed_at(session, 1, pane) for pane in (0, 1)]
    session.remove_robot(1)
    assert get_robot_numbers(session) == ((2, 3), ())
    session.undo()
    assert get_robot_numbers(session) == ((2, 3), (1,))
    assert [failed_at(session, 1, pane) for pane in (0, 1)] == where
    assert session.undo() == "robot 1 failed"
    assert get_robot_numbers(session) == ((1, 2, 3), ())


def test_numbers_are_not_given_twice():
    session = start_session()
    session.fail_robot(3)
    assert session.add_robot((3.0, 3.0)) == 4
    session.remove_robot(4)
    assert session.add_robot((3.0, 3.0)) == 4
    for number in (1, 3):
        with pytest.raises(ParameterError, match=f"there is a robot {number} already"):
            joined(session, (3.0, 3.0), number)


# failing


def test_who_fails_is_not_heard_but_sensed():
    session = start_session(RPF, robots=3, given_starts=np.array([[3.0, 3.0], [3.4, 3.0], [1.0, 1.0]]))
    pane = session.timeline.panes[0]
    before = pane.simulation.observe_and_decide()
    assert before.seen.neighbors.list_neighbors(0).tolist() == [1, 2]
    session.fail_robot(2)
    seen = pane.simulation.observe_and_decide().seen
    assert pane.numbers == (1, 3)
    assert seen.neighbors.count == 2
    assert seen.neighbors.list_neighbors(0).tolist() == [1]
    # its rim, where there was nothing nearer than a wall
    assert seen.obstacle_points[0] == pytest.approx([3.3, 3.0], abs=2e-3)
    assert pane.simulation.observe_and_decide().decision.terms["repulsion_obstacle"][0, 0] < 0.0
    session.revive_robot(2)
    assert pane.numbers == (1, 2, 3)
    after = pane.simulation.observe_and_decide()
    np.testing.assert_array_equal(after.seen.obstacle_points, before.seen.obstacle_points)
    np.testing.assert_array_equal(after.decision.forces, before.decision.forces)


def test_who_failed_stands_still_and_in_the_way():
    session = advance_session(start_session(LLOYD, robots=2), 10)
    session.playback.is_playing = True
    session.fail_robot(2)
    there = failed_at(session, 2)
    session.drag_robot(1, there)
    for _ in range(10):
        session.playback.advance(0.1)
    assert failed_at(session, 2) == there
    assert np.hypot(*np.subtract(place_of(session, 1), there)) > 2 * RADIUS - 3e-3
    session.release()
    session.revive_robot(2)
    # who leans on it makes it step aside a little at most
    assert np.hypot(*np.subtract(place_of(session, 2), there)) < 5e-3


def test_who_fails_is_let_go():
    session = advance_session(start_session(), 3)
    session.playback.is_playing = True
    for touch in (session.fail_robot, session.remove_robot):
        session.drag_robot(2, (3.0, 3.0))
        touch(1 if touch == session.fail_robot else 3)
        assert session.timeline.drag is not None
        touch(2)
        assert session.timeline.drag is None
        session.undo()
        session.undo()
        assert get_robot_numbers(session) == ((1, 2, 3), ())


def test_revival_beside_an_obstacle_that_was_drawn_meanwhile():
    session = advance_session(start_session(), 3)
    session.fail_robot(1)
    there = failed_at(session, 1)
    session.edit_map(replace(HALL, obstacles=(*HALL.obstacles, CircleObstacle(there, 0.3))), "circle drawn")
    session.revive_robot(1)
    away = np.hypot(*np.subtract(place_of(session, 1), there))
    assert 0.39 < away < 0.8
    assert compute_penetration(session) < 2e-3


# refusals


def test_what_cannot_be_changes_nothing():
    session = advance_session(start_session(RAPF, RPF), 12)
    session.fail_robot(3)
    session.undo()
    session.redo()
    for paused in (True, False):
        session.playback.is_playing = not paused
        before = describe_state(session)
        for touch, match in (
            (lambda: session.fail_robot(3), "robot 3 has failed already"),
            (lambda: session.fail_robot(9), "there is no robot 9"),
            (lambda: session.revive_robot(1), "robot 1 has not failed"),
            (lambda: session.revive_robot(9), "there is no robot 9"),
            (lambda: session.remove_robot(9), "there is no robot 9"),
            (lambda: session.place_robot(9, (1.0, 1.0)), "there is no robot 9"),
            (lambda: session.drag_robot(9, (1.0, 1.0)), "there is no robot 9"),
            (lambda: joined(session, (1.0, 1.0), 3), "there is a robot 3 already"),
        ):
            with pytest.raises(ParameterError, match=match):
                touch()
            assert describe_state(session) == before


def test_the_last_that_works_stays():
    session = start_session(robots=2)
    session.fail_robot(1)
    before = describe_state(session)
    for touch in (session.fail_robot, session.remove_robot):
        with pytest.raises(ParameterError, match="cannot remove the last working robot"):
            touch(2)
        assert describe_state(session) == before
    # who does not work may go
    session.remove_robot(1)
    assert get_robot_numbers(session) == ((2,), ())


def test_a_full_map_and_a_full_team(monkeypatch):
    cell = Environment("cell", ((0, 0), (0.45, 0), (0.45, 0.45), (0, 0.45)))
    session = start_session(robots=1, environment=cell, given_starts=np.array([[0.225, 0.225]]))
    before = describe_state(session)
    with pytest.raises(StartError, match="no room"):
        session.add_robot((0.1, 0.1))
    assert describe_state(session) == before
    session = start_session(robots=3)
    monkeypatch.setattr(module, "MAX_ROBOTS", 3)
    before = describe_state(session)
    with pytest.raises(ParameterError, match="there are 3 robots already"):
        session.add_robot((3.0, 3.0))
    assert describe_state(session) == before


# from the past


def test_a_touch_goes_on_from_the_moment_that_is_looked_at():
    session = advance_session(start_session(RAPF, LLOYD), 20)
    session.remove_robot(2)
    advance_session(session, 20)
    session.show_time(10 / 60)
    then = session.displayed.get_positions(session.timeline.panes[1]).copy()
    # it is not there any more, but was then
    session.remove_robot(2)
    assert session.timeline.is_live
    assert session.timeline.end_time == pytest.approx(10 / 60)
    assert get_robot_numbers(session) == ((1, 3), ())
    np.testing.assert_array_equal(session.displayed.get_positions(session.timeline.panes[1]), then[[0, 2]])
    session.undo()
    np.testing.assert_array_equal(session.displayed.get_positions(session.timeline.panes[1]), then)


@pytest.mark.parametrize(
    "touch",
    [
        lambda session: session.fail_robot(9),
        lambda session: session.revive_robot(1),
        lambda session: session.remove_robot(4),
        lambda session: session.place_robot(4, (1.0, 1.0)),
        lambda session: joined(session, (1.0, 1.0), 2),
        lambda session: session.edit_map(
            replace(HALL, obstacles=(CircleObstacle((3.0, 2.0), 9.0),)), "filled"
        ),
        lambda session: session.set_properties(RobotProperties(radius=2.5)),
    ],
)
def test_what_could_not_be_then_keeps_what_came_after(touch):
    session = advance_session(start_session(RAPF, LLOYD), 20)
    for pane in session.timeline.panes:
        for k in range(20):
            pane.distance_curve.add(k / 60, 2.0)
    session.add_robot((3.0, 3.0))
    session.undo()
    session.redo()
    advance_session(session, 20)
    session.show_time(10 / 60)
    session.playback.is_playing = True
    before = describe_state(session)
    with pytest.raises((ParameterError, StartError, MapError)):
        touch(session)
    assert describe_state(session) == before
    assert not session.timeline.is_live
    session.show_time(99.0)
    advance_session(session, 3)
    assert get_robot_numbers(session) == ((1, 2, 3, 4), ())


def test_undo_is_of_the_present():
    session = advance_session(start_session(), 20)
    session.remove_robot(2)
    advance_session(session, 20)
    session.show_time(10 / 60)
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    assert session.undo() == "robot 2 removed"
    assert session.timeline.is_live
    assert session.timeline.end_time == pytest.approx(20 / 60)
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    session.show_time(10 / 60)
    assert session.redo() == "robot 2 removed"
    assert get_robot_numbers(session) == ((1, 3), ())
    assert session.timeline.is_live


def test_robots_that_differ_keep_what_is_theirs():
    """Under their numbers, whether they work, fail, or work again; new ones are as the first."""
    radius, speeds = np.array([0.1, 0.3, 0.2]), np.array([1.0, 0.3, 0.3])
    limits = RobotProperties.from_team(replace(Team.homogeneous(3), radius=radius, max_speed=speeds))
    session = start_session(RAPF, robots=3, properties=limits)
    team = session.timeline.panes[0].simulation.team
    assert team.radius.tolist() == radius.tolist()
    positions = session.timeline.panes[0].simulation.positions
    apart = np.hypot(*(positions[:, None] - positions).transpose(2, 0, 1))[np.triu_indices(3, 1)]
    assert apart.min() >= 0.6, "room for the largest"
    session.fail_robot(2)
    assert session.timeline.panes[0].simulation.team.radius.tolist() == [0.1, 0.2]
    (wreck,) = session.timeline.panes[0].setup.sensed_environment.obstacles[len(HALL.obstacles) :]
    assert wreck.radius == 0.3
    session.revive_robot(2)
    assert session.timeline.panes[0].simulation.team.radius.tolist() == radius.tolist()
    session.place_robot(3, place_of(session, 2))
    gap = np.hypot(*np.subtract(place_of(session, 3), place_of(session, 2)))
    assert gap >= 0.5 - 1e-6
    session.add_robot((3.0, 2.0))
    assert session.timeline.panes[0].simulation.team.max_speed.tolist() == [1.0, 0.3, 0.3, 1.0]
    advance_session(session, 3)
    session.set_properties(RobotProperties())
    assert set(session.timeline.panes[0].simulation.team.radius.tolist()) == {0.1}
