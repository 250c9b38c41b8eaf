"""The session, whatever is done with it in whatever order."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test
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

from robocov.environment import CircleObstacle
from robocov.errors import MapError, ParameterError, RobocovError
from robocov_app.viewer.session.ghosts import MAX_GHOST_BRANCHES
from robocov_app.viewer.session.map_edits import add_obstacle, move_obstacle, replace_obstacles
from robocov_app.viewer.session.robot_properties import RobotProperties

# anything

points = st.tuples(st.floats(-0.5, 6.5), st.floats(-0.5, 4.5))
laws = st.sampled_from([RAPF, RPF, LLOYD, RAPF.with_gain("k_rep", 1.0)])
some_limits = st.builds(
    RobotProperties,
    radius=st.sampled_from([0.05, 0.1, 0.25]),
    max_speed=st.sampled_from([0.5, 1.0, 4.0]),
    sensing_range=st.sampled_from([0.3, 3.0, np.inf]),
    communication_range=st.sampled_from([0.5, np.inf]),
)


class Anything(RuleBasedStateMachine):
    """Whatever users do."""

    @initialize(laws=st.lists(laws, min_size=1, max_size=2), robots=st.integers(1, 5), seed=st.integers(0, 9))
    def begin(self, laws, robots, seed):
        self.session = start_session(*laws, robots=robots, seed=seed, start="spread")

    def attempt(self, touch) -> None:
        """Do something; what is refused leaves everything as it was."""
        before = describe_state(self.session)
        try:
            touch()
        except RobocovError as error:
            assert str(error)
            assert describe_state(self.session) == before

    def number(self, k: int) -> int:
        working, failed = get_robot_numbers(self.session)
        return [*working, *failed][k % (len(working) + len(failed))]

    @rule(steps=st.integers(1, 12))
    def step(self, steps):
        advance_session(self.session, steps)

    @rule(playing=st.booleans())
    def pause(self, playing):
        self.session.playback.is_playing = playing

    @rule(seconds=st.floats(0.0, 0.2))
    def pass_time(self, seconds):
        self.session.playback.advance(seconds)

    @rule(k=st.integers(0, 9), point=points)
    def grab(self, k, point):
        self.attempt(lambda: self.session.drag_robot(self.number(k), point))

    @rule()
    def release(self):
        self.session.release()
        assert self.session.timeline.drag is None

    @rule(k=st.integers(0, 9), point=points)
    def place(self, k, point):
        self.attempt(lambda: self.session.place_robot(self.number(k), point))

    @rule(point=points)
    def add_robot(self, point):
        self.attempt(lambda: self.session.add_robot(point))

    @rule(k=st.integers(0, 9))
    def remove_robot(self, k):
        self.attempt(lambda: self.session.remove_robot(self.number(k)))

    @rule(k=st.integers(0, 9))
    def fail_robot(self, k):
        self.attempt(lambda: self.session.fail_robot(self.number(k)))

    @rule(k=st.integers(0, 9))
    def revive_robot(self, k):
        self.attempt(lambda: self.session.revive_robot(self.number(k)))

    @rule(point=points, radius=st.sampled_from([0.1, 0.4, 1.2, 4.5]))
    def draw(self, point, radius):
        def draw():
            circle = CircleObstacle(point, radius)
            self.session.edit_map(add_obstacle(self.session.displayed.environment, circle), "circle drawn")

        self.attempt(draw)

    @rule(k=st.integers(0, 9), by=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
    def move_obstacle(self, k, by):
        there = self.session.displayed.environment
        if there.obstacles:
            k %= len(there.obstacles)
            self.attempt(
                lambda: self.session.edit_map(
                    replace_obstacles(there, k, 1, [move_obstacle(there.obstacles[k], *by)]), "moved"
                )
            )

    @rule(k=st.integers(0, 9))
    def delete_obstacle(self, k):
        there = self.session.displayed.environment
        if there.obstacles:
            k %= len(there.obstacles)
            self.attempt(lambda: self.session.edit_map(replace_obstacles(there, k, 1), "deleted"))

    @rule(redo=st.booleans())
    def undo(self, redo):
        self.session.show_time(1e9)
        self.attempt(self.session.redo if redo else self.session.undo)

    @rule(k=st.integers(0, 3), law=laws)
    def set_law(self, k, law):
        pane = self.session.timeline.panes[k % len(self.session.timeline.panes)]
        self.attempt(lambda: self.session.set_controller(pane, law))

    @rule(limits=some_limits)
    def set_limits(self, limits):
        self.attempt(lambda: self.session.set_properties(limits))

    @rule(part=st.floats(0.0, 1.0))
    def look_at(self, part):
        self.session.show_time(part * self.session.timeline.end_time)

    @rule(by=st.integers(-8, 8))
    def look_by(self, by):
        self.session.show_offset(by)

    @rule()
    def branch(self):
        self.attempt(self.session.branch)
        assert self.session.timeline.is_live

    @rule(robots=st.integers(1, 6) | st.none())
    def restart(self, robots):
        self.attempt(lambda: self.session.restart(**({} if robots is None else {"robots": robots})))

    @rule(law=laws)
    def add_pane(self, law):
        if len(self.session.timeline.panes) < 3:
            self.attempt(lambda: self.session.add_pane(law))

    @rule(k=st.integers(0, 3))
    def remove_pane(self, k):
        if len(self.session.timeline.panes) > 1:
            self.session.remove_pane(self.session.timeline.panes[k % len(self.session.timeline.panes)])

    @invariant()
    def lanes_are_alike(self):
        if not hasattr(self, "session"):
            return
        session = self.session
        first = session.timeline.panes[0].setup
        assert len(first.numbers) >= 1
        assert list(first.numbers) == sorted(set(first.numbers))
        assert not set(first.numbers) & set(first.failed)
        for pane in session.timeline.panes:
            there = pane.setup
            assert there.numbers == first.numbers
            assert set(there.failed) == set(first.failed)
            assert there.environment is first.environment
            assert there.properties == first.properties
            count = len(there.numbers)
            for rows in (pane.simulation.positions, pane.starts, pane.trail.positions[-1]):
                assert rows.shape == (count, 2)
                assert np.isfinite(rows).all()
            assert len(pane.simulation.team) == count
        assert len({pane.number for pane in session.timeline.panes}) == len(session.timeline.panes)
        assert session.timeline.scenario.environment is first.environment
        assert session.timeline.scenario.controllers == tuple(
            pane.controller for pane in session.timeline.panes
        )
        assert session.timeline.scenario.properties == first.properties

    @invariant()
    def times_are_consistent(self):
        if not hasattr(self, "session"):
            return
        session = self.session
        assert 0.0 <= session.displayed.time <= session.timeline.end_time
        assert session.timeline.is_live == (session.displayed.time == session.timeline.end_time)
        assert (np.diff(session.timeline.history.steps) > 0).all()
        assert (
            session.timeline.history.get_time(len(session.timeline.history) - 1) == session.timeline.end_time
        )
        for pane in session.timeline.panes:
            assert pane.time == pytest.approx(session.timeline.end_time, abs=1e-9)
            assert (np.diff(pane.trail.times) > 0).all()
            assert pane.trail.times[-1] <= session.timeline.end_time + 1e-9
            last = session.timeline.history.last.states[pane.number]
            np.testing.assert_array_equal(last.positions, pane.simulation.positions)
            np.testing.assert_array_equal(last.velocities, pane.simulation.velocities)
            assert last.setup is pane.setup
        assert len(session.timeline.ghosts) <= 2 * MAX_GHOST_BRANCHES * len(session.timeline.panes)
        times = [event.time for event in session.timeline.events]
        assert times == sorted(times)
        assert not times or times[-1] <= session.timeline.end_time
        assert session.timeline.drag is None or (
            session.timeline.is_live and session.timeline.drag[0] in session.displayed.numbers
        )

    @invariant()
    def what_is_looked_at_can_be_shown(self):
        if not hasattr(self, "session"):
            return
        for pane in self.session.timeline.panes:
            there, snapshot = (
                self.session.displayed.get_setup(pane),
                self.session.displayed.get_snapshot(pane),
            )
            assert snapshot.time == pytest.approx(self.session.displayed.time, abs=1e-9)
            np.testing.assert_array_equal(snapshot.positions, self.session.displayed.get_positions(pane))
            trail, times = self.session.displayed.get_trail(pane)
            assert trail.shape[1:] == snapshot.positions.shape == (len(there.numbers), 2)
            assert len(trail) == len(times) >= 1
            assert times[-1] <= self.session.displayed.time + 1e-6

    @invariant()
    def robots_are_where_there_is_room(self):
        if hasattr(self, "session"):
            assert compute_penetration(self.session) < 2e-3


@pytest.mark.slow
def test_whatever_users_do_all_stays_in_order():
    run_state_machine_as_test(Anything, settings=settings(max_examples=25, stateful_step_count=25))


undoable = st.tuples(
    st.sampled_from(["draw", "delete", "add", "remove", "fail", "revive", "step"]), points, st.integers(0, 9)
)


def touched(session, kind, point, k) -> None:
    working, failed = get_robot_numbers(session)
    obstacles = len(session.displayed.environment.obstacles)
    if kind == "draw":
        session.edit_map(add_obstacle(session.displayed.environment, CircleObstacle(point, 0.2)), "drawn")
    elif kind == "delete" and obstacles:
        session.edit_map(replace_obstacles(session.displayed.environment, k % obstacles, 1), "deleted")
    elif kind == "add":
        session.add_robot(point)
    elif kind == "remove":
        everybody = [*working, *failed]
        session.remove_robot(everybody[k % len(everybody)])
    elif kind == "fail":
        session.fail_robot(working[k % len(working)])
    elif kind == "revive" and failed:
        session.revive_robot(failed[k % len(failed)])
    else:
        advance_session(session, k)


@given(st.lists(undoable, max_size=15))
@settings(max_examples=25)
def test_who_takes_all_back_has_the_same_map_and_the_same_robots(touches):
    session = start_session(RAPF, LLOYD)
    for touch in touches:
        # the last robot that works; a map that cannot be
        with suppress(ParameterError, MapError):
            touched(session, *touch)
    end = get_robot_numbers(session), session.displayed.environment
    while session.undo() is not None:
        pass
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    assert session.displayed.environment == HALL
    while session.redo() is not None:
        pass
    assert (get_robot_numbers(session), session.displayed.environment) == end
    assert {pane.numbers for pane in session.timeline.panes} == {session.displayed.numbers}


@given(
    st.lists(undoable, max_size=6),
    st.lists(laws, min_size=1, max_size=2),
    st.integers(1, 30),
    st.integers(0, 30),
)
@settings(max_examples=30)
def test_however_it_came_so_far_from_there_it_goes_the_same_way_again(touches, controllers, steps, back):
    session = start_session(*controllers)
    for touch in touches:
        with suppress(ParameterError, MapError):
            touched(session, *touch)
    since = session.timeline.end_time
    advance_session(session, steps)
    end, went = session.timeline.end_time, [pane.simulation.positions for pane in session.timeline.panes]
    session.show_time(max(end - back / 60, since))
    session.branch()
    while session.timeline.end_time < end:
        session.playback.step()
    for pane, before in zip(session.timeline.panes, went, strict=True):
        np.testing.assert_array_equal(pane.simulation.positions, before)
