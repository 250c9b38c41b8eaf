"""Edits of robots: placed, added, removed, failed and revived, now and in the past."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
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
from robocov_app.viewer.session.editing import edits as module
from robocov_app.viewer.session.editing.edits import AddRobot
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

RADIUS = 0.1
NO_ROBOTS = np.empty((0, 2))
CELL = Environment("cell", ((0, 0), (0.45, 0), (0.45, 0.45), (0, 0.45)))
points = st.tuples(st.floats(-1.0, 7.0), st.floats(-1.0, 5.0))


def add_numbered_robot(session, point, number) -> None:
    session.apply(AddRobot(number, point), "robot", f"robot {number} joined")


def get_position(session, number, pane=0) -> list[float]:
    """Return the present position of a working robot, m."""
    shown = session.timeline.panes[pane]
    return shown.simulation.positions[shown.get_row(number)].tolist()


def get_failed_position(session, number, pane=0) -> tuple[float, float]:
    return session.timeline.panes[pane].setup.failed[number]


def compute_distance(point, other) -> float:
    return float(np.hypot(*np.subtract(point, other)))


# Free positions


@given(points, st.lists(points, max_size=12), st.sampled_from([0.05, 0.1, 0.3]))
def test_the_nearest_free_position_is_found(point, others, radius):
    others = np.array(others).reshape(-1, 2)
    position = find_free_position(HALL, radius, others, point)
    free_centers = HALL.free.buffer(-radius)
    if len(others):
        discs = shapely.buffer(shapely.points(others), 2 * radius)
        free_centers = free_centers.difference(shapely.union_all(discs))
        assert np.linalg.norm(others - position, axis=1).min() >= 2 * radius
    assert shapely.distance(HALL.free.boundary, shapely.Point(position)) >= radius - 1e-9
    assert HALL.free.contains(shapely.Point(position))
    nearest = shapely.distance(free_centers, shapely.Point(point))
    assert compute_distance(position, point) <= nearest + 0.02


def test_a_free_position_is_kept():
    assert find_free_position(HALL, RADIUS, NO_ROBOTS, (3.0, 2.0)) == (3.0, 2.0)
    assert find_free_position(HALL, RADIUS, np.array([[3.0, 2.2]]), (3.0, 2.0)) == (3.0, 2.0)


def test_a_full_map_has_no_free_position():
    assert find_free_position(CELL, RADIUS, np.array([[0.15, 0.15]]), (0.15, 0.15))
    for radius, others in ((RADIUS, np.array([[0.225, 0.225]])), (0.3, NO_ROBOTS)):
        with pytest.raises(StartError, match=r"no space for a robot of radius .* m in map"):
            find_free_position(CELL, radius, others, (0.25, 0.25))


# Placing


def test_a_robot_is_placed_in_all_panes():
    session = advance_session(start_session(RAPF, LLOYD), 20)
    others = [pane.simulation.positions[1:].copy() for pane in session.timeline.panes]
    session.place_robot(1, (5.0, 3.0))
    for index, pane in enumerate(session.timeline.panes):
        assert get_position(session, 1, index) == [5.0, 3.0]
        assert pane.simulation.velocities[0].tolist() == [0.0, 0.0]
        np.testing.assert_array_equal(pane.simulation.positions[1:], others[index])
    assert session.timeline.history.last.states[0].positions[0].tolist() == [5.0, 3.0]
    assert len(session.timeline.history) == 21


@given(st.lists(st.tuples(st.integers(1, 6), points), min_size=1, max_size=6))
@settings(max_examples=count_examples(40))
def test_placed_robots_overlap_nothing(placements):
    session = start_session(robots=6)
    for number, point in placements:
        other_rows = [row for row in range(6) if row != number - 1]
        before = session.timeline.panes[0].simulation.positions[other_rows]
        session.place_robot(number, point)
        simulation = session.timeline.panes[0].simulation
        np.testing.assert_array_equal(simulation.positions[other_rows], before)
        assert compute_penetration(session) <= 1e-9
    session.playback.step()
    assert compute_penetration(session) < 2e-3


def test_a_failed_robot_can_be_placed():
    session = advance_session(start_session(RAPF, RPF), 10)
    session.fail_robot(2)
    session.fail_robot(3)
    session.place_robot(2, (5.0, 3.0))
    assert [get_failed_position(session, 2, pane) for pane in (0, 1)] == [(5.0, 3.0)] * 2
    session.place_robot(2, get_failed_position(session, 3))
    distance = compute_distance(get_failed_position(session, 2), get_failed_position(session, 3))
    assert distance >= 2 * RADIUS
    session.place_robot(2, (9.0, 9.0))
    assert get_failed_position(session, 2) == pytest.approx((5.899, 3.899))
    assert get_robot_numbers(session) == ((1,), (2, 3))


def test_a_robot_that_is_dragged_while_paused_is_placed():
    session = advance_session(start_session(), 5)
    session.drag_robot(2, (3.0, 3.0))
    assert session.timeline.run.drag is None
    assert get_position(session, 2) == [3.0, 3.0]
    session.playback.is_playing = True
    session.drag_robot(2, (3.2, 3.0))
    assert get_position(session, 2) == [3.0, 3.0]
    assert session.timeline.run.drag == (2, (3.2, 3.0))
    session.playback.is_playing = False
    session.drag_robot(2, (3.4, 3.0))
    assert session.timeline.run.drag is None
    assert get_position(session, 2) == [3.4, 3.0]


def test_a_failed_robot_that_is_dragged_is_placed():
    session = start_session()
    session.fail_robot(2)
    session.playback.is_playing = True
    session.drag_robot(2, (3.0, 3.0))
    assert session.timeline.run.drag is None
    assert get_failed_position(session, 2) == (3.0, 3.0)


# Adding and removing


def test_added_robots_are_at_rest():
    session = advance_session(start_session(RAPF, LLOYD), 10)
    velocities = session.timeline.panes[0].simulation.velocities
    assert session.add_robot((5.0, 3.0)) == 4
    assert session.add_robot((5.0, 3.0)) == 5
    for pane in session.timeline.panes:
        assert pane.numbers == (1, 2, 3, 4, 5)
        assert pane.simulation.positions[3].tolist() == [5.0, 3.0]
        distance = compute_distance(pane.simulation.positions[4], (5.0, 3.0))
        assert 2 * RADIUS <= distance < 2 * RADIUS + 0.01
        assert pane.simulation.velocities[3:].tolist() == [[0.0, 0.0]] * 2
    np.testing.assert_array_equal(session.timeline.panes[0].simulation.velocities[:3], velocities)
    assert [event.text for event in session.timeline.events] == ["robot 4 joined", "robot 5 joined"]
    add_numbered_robot(session, (1.0, 3.0), 9)
    assert session.add_robot((1.0, 3.0)) == 10


def test_undo_returns_removed_robots_to_their_positions():
    session = advance_session(start_session(RAPF, LLOYD, robots=4), 15)
    before = [get_position(session, 2, pane) for pane in (0, 1)]
    assert before[0] != before[1]
    session.remove_robot(2)
    assert get_robot_numbers(session) == ((1, 3, 4), ())
    session.undo()
    assert get_robot_numbers(session) == ((1, 2, 3, 4), ())
    assert [get_position(session, 2, pane) for pane in (0, 1)] == before
    session.redo()
    assert get_robot_numbers(session) == ((1, 3, 4), ())


def test_undo_returns_a_removed_failed_robot():
    session = advance_session(start_session(RAPF, LLOYD, robots=3), 15)
    session.fail_robot(1)
    before = [get_failed_position(session, 1, pane) for pane in (0, 1)]
    session.remove_robot(1)
    assert get_robot_numbers(session) == ((2, 3), ())
    session.undo()
    assert get_robot_numbers(session) == ((2, 3), (1,))
    assert [get_failed_position(session, 1, pane) for pane in (0, 1)] == before
    assert session.undo() == "robot 1 failed"
    assert get_robot_numbers(session) == ((1, 2, 3), ())


def test_numbers_are_unique():
    session = start_session()
    session.fail_robot(3)
    assert session.add_robot((3.0, 3.0)) == 4
    session.remove_robot(4)
    assert session.add_robot((3.0, 3.0)) == 4
    for number in (1, 3):
        with pytest.raises(ParameterError, match=f"robot {number} already exists"):
            add_numbered_robot(session, (3.0, 3.0), number)


# Failing


def test_a_failed_robot_sends_no_messages_and_is_sensed():
    starts = np.array([[3.0, 3.0], [3.4, 3.0], [1.0, 1.0]])
    session = start_session(RPF, robots=3, given_starts=starts)
    pane = session.timeline.panes[0]
    before = pane.simulation.observe_and_decide()
    assert before.seen.neighbors.list_neighbors(0).tolist() == [1, 2]
    session.fail_robot(2)
    seen = pane.simulation.observe_and_decide().seen
    assert pane.numbers == (1, 3)
    assert seen.neighbors.robot_count == 2
    assert seen.neighbors.list_neighbors(0).tolist() == [1]
    # The rim of the failed robot is the nearest point of an obstacle now.
    assert seen.obstacle_points[0] == pytest.approx([3.3, 3.0], abs=2e-3)
    assert pane.simulation.observe_and_decide().decision.terms["repulsion_obstacle"][0, 0] < 0.0
    session.revive_robot(2)
    assert pane.numbers == (1, 2, 3)
    after = pane.simulation.observe_and_decide()
    np.testing.assert_array_equal(after.seen.obstacle_points, before.seen.obstacle_points)
    np.testing.assert_array_equal(after.decision.forces, before.decision.forces)


def test_a_failed_robot_blocks_the_others():
    session = advance_session(start_session(LLOYD, robots=2), 10)
    session.playback.is_playing = True
    session.fail_robot(2)
    failed_position = get_failed_position(session, 2)
    session.drag_robot(1, failed_position)
    for _ in range(10):
        session.playback.advance(0.1)
    assert get_failed_position(session, 2) == failed_position
    assert compute_distance(get_position(session, 1), failed_position) > 2 * RADIUS - 3e-3
    session.release()
    session.revive_robot(2)
    # The robot that leans on it may push it aside a little.
    assert compute_distance(get_position(session, 2), failed_position) < 5e-3


def test_a_robot_that_fails_or_is_removed_is_released():
    session = advance_session(start_session(), 3)
    session.playback.is_playing = True
    for edit, other_robot in ((session.fail_robot, 1), (session.remove_robot, 3)):
        session.drag_robot(2, (3.0, 3.0))
        edit(other_robot)
        assert session.timeline.run.drag is not None
        edit(2)
        assert session.timeline.run.drag is None
        session.undo()
        session.undo()
        assert get_robot_numbers(session) == ((1, 2, 3), ())


def test_a_robot_is_revived_next_to_an_obstacle_that_was_drawn_over_it():
    session = advance_session(start_session(), 3)
    session.fail_robot(1)
    failed_position = get_failed_position(session, 1)
    circle = CircleObstacle(failed_position, 0.3)
    session.edit_map(replace(HALL, obstacles=(*HALL.obstacles, circle)), "circle drawn")
    session.revive_robot(1)
    assert 0.39 < compute_distance(get_position(session, 1), failed_position) < 0.8
    assert compute_penetration(session) < 2e-3


# Edits that are not possible


@pytest.mark.parametrize("is_playing", [False, True])
def test_an_edit_that_is_not_possible_changes_nothing(is_playing):
    session = advance_session(start_session(RAPF, RPF), 12)
    session.fail_robot(3)
    session.undo()
    session.redo()
    session.playback.is_playing = is_playing
    before = describe_state(session)
    for edit, message in (
        (lambda: session.fail_robot(3), "robot 3 has failed already"),
        (lambda: session.fail_robot(9), "there is no robot 9"),
        (lambda: session.revive_robot(1), "robot 1 has not failed"),
        (lambda: session.revive_robot(9), "there is no robot 9"),
        (lambda: session.remove_robot(9), "there is no robot 9"),
        (lambda: session.place_robot(9, (1.0, 1.0)), "there is no robot 9"),
        (lambda: session.drag_robot(9, (1.0, 1.0)), "there is no robot 9"),
        (lambda: add_numbered_robot(session, (1.0, 1.0), 3), "robot 3 already exists"),
    ):
        with pytest.raises(ParameterError, match=message):
            edit()
        assert describe_state(session) == before


def test_the_last_working_robot_cannot_be_removed():
    session = start_session(robots=2)
    session.fail_robot(1)
    before = describe_state(session)
    for edit in (session.fail_robot, session.remove_robot):
        with pytest.raises(ParameterError, match="cannot remove the last working robot"):
            edit(2)
        assert describe_state(session) == before
    session.remove_robot(1)
    assert get_robot_numbers(session) == ((2,), ())


def test_a_robot_is_not_added_to_a_full_map():
    session = start_session(robots=1, environment=CELL, given_starts=np.array([[0.225, 0.225]]))
    before = describe_state(session)
    with pytest.raises(StartError, match="no space"):
        session.add_robot((0.1, 0.1))
    assert describe_state(session) == before


def test_a_robot_is_not_added_to_a_full_team(monkeypatch):
    session = start_session(robots=3)
    monkeypatch.setattr(module, "MAX_ROBOTS", 3)
    before = describe_state(session)
    with pytest.raises(ParameterError, match="there are 3 robots already"):
        session.add_robot((3.0, 3.0))
    assert describe_state(session) == before


# Edits in the past


def test_an_edit_in_the_past_starts_a_branch_there():
    session = advance_session(start_session(RAPF, LLOYD), 20)
    session.remove_robot(2)
    advance_session(session, 20)
    session.show_time(10 / 60)
    pane = session.timeline.panes[1]
    before = session.displayed.get_positions(pane).copy()
    # The robot is removed from the present already, but it was part of the team then.
    session.remove_robot(2)
    assert session.timeline.is_live
    assert session.timeline.end_time == pytest.approx(10 / 60)
    assert get_robot_numbers(session) == ((1, 3), ())
    pane = session.timeline.panes[1]
    np.testing.assert_array_equal(session.displayed.get_positions(pane), before[[0, 2]])
    session.undo()
    pane = session.timeline.panes[1]
    np.testing.assert_array_equal(session.displayed.get_positions(pane), before)


def fill_map(session) -> None:
    environment = replace(HALL, obstacles=(CircleObstacle((3.0, 2.0), 9.0),))
    session.edit_map(environment, "filled")


@pytest.mark.parametrize(
    "edit",
    [
        lambda session: session.fail_robot(9),
        lambda session: session.revive_robot(1),
        lambda session: session.remove_robot(4),
        lambda session: session.place_robot(4, (1.0, 1.0)),
        lambda session: add_numbered_robot(session, (1.0, 1.0), 2),
        fill_map,
        lambda session: session.set_properties(RobotProperties(radius=2.5)),
    ],
)
def test_an_edit_in_the_past_that_is_not_possible_changes_nothing(edit):
    session = advance_session(start_session(RAPF, LLOYD), 20)
    for pane in session.timeline.panes:
        for step in range(20):
            pane.distance_curve.add(step / 60, 2.0)
    session.add_robot((3.0, 3.0))
    session.undo()
    session.redo()
    advance_session(session, 20)
    session.show_time(10 / 60)
    session.playback.is_playing = True
    before = describe_state(session)
    with pytest.raises((ParameterError, StartError, MapError)):
        edit(session)
    assert describe_state(session) == before
    assert not session.timeline.is_live
    session.show_time(99.0)
    advance_session(session, 3)
    assert get_robot_numbers(session) == ((1, 2, 3, 4), ())


def test_undo_returns_from_the_past_to_before_the_newest_edit():
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


# Robots that differ


def test_different_robots_keep_their_properties():
    radii = np.array([0.1, 0.3, 0.2])
    speeds = np.array([1.0, 0.3, 0.3])
    team = replace(Team.homogeneous(3), radius=radii, max_speed=speeds)
    session = start_session(RAPF, robots=3, properties=RobotProperties.from_team(team))
    pane = session.timeline.panes[0]
    assert pane.simulation.team.radius.tolist() == radii.tolist()
    session.fail_robot(2)
    assert pane.simulation.team.radius.tolist() == [0.1, 0.2]
    (failed_robot,) = pane.setup.sensed_environment.obstacles[len(HALL.obstacles) :]
    assert failed_robot.radius == 0.3
    session.revive_robot(2)
    assert pane.simulation.team.radius.tolist() == radii.tolist()
    session.add_robot((3.0, 2.0))
    # A new robot has the properties of the first one.
    assert pane.simulation.team.max_speed.tolist() == [1.0, 0.3, 0.3, 1.0]
    advance_session(session, 3)
    session.set_properties(RobotProperties())
    assert set(pane.simulation.team.radius.tolist()) == {0.1}


def test_different_robots_have_space_according_to_their_size():
    team = replace(Team.homogeneous(3), radius=np.array([0.1, 0.3, 0.2]))
    session = start_session(RAPF, robots=3, properties=RobotProperties.from_team(team))
    positions = session.timeline.panes[0].simulation.positions
    distances = np.hypot(*(positions[:, None] - positions).transpose(2, 0, 1))
    assert distances[np.triu_indices(3, 1)].min() >= 0.6, "starts have space for the largest robot"
    session.place_robot(3, get_position(session, 2))
    assert compute_distance(get_position(session, 3), get_position(session, 2)) >= 0.5 - 1e-6
