"""Invariants of a session under random edits in any order."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
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

from robocov.environment import CircleObstacle
from robocov.errors import MapError, ParameterError, RobocovError
from robocov_app.viewer.session.editing.map_edits import add_obstacle, move_obstacle, replace_obstacles
from robocov_app.viewer.session.past.ghosts import MAX_GHOST_BRANCHES
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

MAX_PENETRATION_M = 2e-3
points = st.tuples(st.floats(-0.5, 6.5), st.floats(-0.5, 4.5))
controllers = st.sampled_from([RAPF, RPF, LLOYD, RAPF.with_gain("k_rep", 1.0)])
indices = st.integers(0, 9)
robot_properties = st.builds(
    RobotProperties,
    radius=st.sampled_from([0.05, 0.1, 0.25]),
    max_speed=st.sampled_from([0.5, 1.0, 4.0]),
    sensing_range=st.sampled_from([0.3, 3.0, np.inf]),
    communication_range=st.sampled_from([0.5, np.inf]),
)


class RandomEdits(RuleBasedStateMachine):
    """Edits a session at random, and checks its state after each edit."""

    session = None

    @initialize(
        controllers=st.lists(controllers, min_size=1, max_size=2),
        robots=st.integers(1, 5),
        seed=st.integers(0, 9),
    )
    def start(self, controllers, robots, seed):
        self.session = start_session(*controllers, robots=robots, seed=seed, start="spread")

    def attempt(self, edit) -> None:
        """Make an edit. If it raises, nothing may have changed."""
        before = describe_state(self.session)
        try:
            edit()
        except RobocovError as error:
            assert str(error)
            assert describe_state(self.session) == before

    def choose_robot(self, index: int) -> int:
        working, failed = get_robot_numbers(self.session)
        numbers = [*working, *failed]
        return numbers[index % len(numbers)]

    def choose_pane(self, index: int):
        panes = self.session.timeline.panes
        return panes[index % len(panes)]

    # Time

    @rule(steps=st.integers(1, 12))
    def step(self, steps):
        advance_session(self.session, steps)

    @rule(is_playing=st.booleans())
    def pause(self, is_playing):
        self.session.playback.is_playing = is_playing

    @rule(seconds=st.floats(0.0, 0.2))
    def play(self, seconds):
        self.session.playback.advance(seconds)

    @rule(fraction=st.floats(0.0, 1.0))
    def show_time(self, fraction):
        self.session.show_time(fraction * self.session.timeline.end_time)

    @rule(offset=st.integers(-8, 8))
    def show_offset(self, offset):
        self.session.show_offset(offset)

    @rule()
    def branch(self):
        self.attempt(self.session.branch)
        assert self.session.timeline.is_live

    @rule(is_redo=st.booleans())
    def undo_or_redo(self, is_redo):
        self.session.show_time(1e9)
        self.attempt(self.session.redo if is_redo else self.session.undo)

    @rule(robots=st.none() | st.integers(1, 6))
    def restart(self, robots):
        self.attempt(lambda: self.session.restart(robots=robots))

    # Robots

    @rule(index=indices, point=points)
    def drag_robot(self, index, point):
        self.attempt(lambda: self.session.drag_robot(self.choose_robot(index), point))

    @rule()
    def release(self):
        self.session.release()
        assert self.session.timeline.run.drag is None

    @rule(index=indices, point=points)
    def place_robot(self, index, point):
        self.attempt(lambda: self.session.place_robot(self.choose_robot(index), point))

    @rule(point=points)
    def add_robot(self, point):
        self.attempt(lambda: self.session.add_robot(point))

    @rule(index=indices)
    def remove_robot(self, index):
        self.attempt(lambda: self.session.remove_robot(self.choose_robot(index)))

    @rule(index=indices)
    def fail_robot(self, index):
        self.attempt(lambda: self.session.fail_robot(self.choose_robot(index)))

    @rule(index=indices)
    def revive_robot(self, index):
        self.attempt(lambda: self.session.revive_robot(self.choose_robot(index)))

    @rule(properties=robot_properties)
    def set_properties(self, properties):
        self.attempt(lambda: self.session.set_properties(properties))

    # Map

    @rule(point=points, radius=st.sampled_from([0.1, 0.4, 1.2, 4.5]))
    def draw_circle(self, point, radius):
        def draw():
            environment = add_obstacle(self.session.displayed.environment, CircleObstacle(point, radius))
            self.session.edit_map(environment, "circle drawn")

        self.attempt(draw)

    @precondition(lambda self: self.session and self.session.displayed.environment.obstacles)
    @rule(index=indices, displacement=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
    def move_obstacle(self, index, displacement):
        environment = self.session.displayed.environment
        index %= len(environment.obstacles)
        moved = move_obstacle(environment.obstacles[index], *displacement)
        self.attempt(
            lambda: self.session.edit_map(replace_obstacles(environment, index, 1, [moved]), "moved")
        )

    @precondition(lambda self: self.session and self.session.displayed.environment.obstacles)
    @rule(index=indices)
    def delete_obstacle(self, index):
        environment = self.session.displayed.environment
        index %= len(environment.obstacles)
        self.attempt(lambda: self.session.edit_map(replace_obstacles(environment, index, 1), "deleted"))

    # Panes

    @rule(index=indices, controller=controllers)
    def set_controller(self, index, controller):
        self.attempt(lambda: self.session.set_controller(self.choose_pane(index), controller))

    @precondition(lambda self: self.session and len(self.session.timeline.panes) < 3)
    @rule(controller=controllers)
    def add_pane(self, controller):
        self.attempt(lambda: self.session.add_pane(controller))

    @precondition(lambda self: self.session and len(self.session.timeline.panes) > 1)
    @rule(index=indices)
    def remove_pane(self, index):
        self.session.remove_pane(self.choose_pane(index))

    # Invariants

    @precondition(lambda self: self.session)
    @invariant()
    def robots_have_unique_ascending_numbers(self):
        setup = self.session.timeline.panes[0].setup
        assert len(setup.numbers) >= 1
        assert list(setup.numbers) == sorted(set(setup.numbers))
        assert not set(setup.numbers) & set(setup.failed)

    @precondition(lambda self: self.session)
    @invariant()
    def all_panes_have_the_same_map_and_robots(self):
        timeline = self.session.timeline
        first = timeline.panes[0].setup
        for pane in timeline.panes:
            assert pane.setup.numbers == first.numbers
            assert set(pane.setup.failed) == set(first.failed)
            assert pane.setup.environment is first.environment
            assert pane.setup.properties == first.properties
        assert len({pane.number for pane in timeline.panes}) == len(timeline.panes)
        assert timeline.scenario.environment is first.environment
        assert timeline.scenario.properties == first.properties
        assert timeline.scenario.controllers == tuple(pane.controller for pane in timeline.panes)

    @precondition(lambda self: self.session)
    @invariant()
    def arrays_have_a_finite_row_for_each_robot(self):
        for pane in self.session.timeline.panes:
            working = len(pane.setup.numbers)
            with_failed = working + len(pane.setup.failed)
            for rows, robots in (
                (pane.simulation.positions, working),
                (pane.starts, working),
                (pane.trail.positions[-1], with_failed),
            ):
                assert rows.shape == (robots, 2)
                assert np.isfinite(rows[:working]).all()
            assert len(pane.simulation.team) == working

    @precondition(lambda self: self.session)
    @invariant()
    def times_are_consistent(self):
        timeline = self.session.timeline
        assert 0.0 <= self.session.displayed.time <= timeline.end_time
        assert timeline.is_live == (self.session.displayed.time == timeline.end_time)
        assert (np.diff(timeline.history.steps) > 0).all()
        assert timeline.history.get_time(len(timeline.history) - 1) == timeline.end_time
        for pane in timeline.panes:
            assert pane.time == pytest.approx(timeline.end_time, abs=1e-9)
            assert (np.diff(pane.trail.times) > 0).all()
            assert pane.trail.times[-1] <= timeline.end_time + 1e-9

    @precondition(lambda self: self.session)
    @invariant()
    def the_last_recorded_state_is_the_present(self):
        timeline = self.session.timeline
        for pane in timeline.panes:
            last = timeline.history.last.states[pane.number]
            np.testing.assert_array_equal(last.positions, pane.simulation.positions)
            np.testing.assert_array_equal(last.velocities, pane.simulation.velocities)
            assert last.setup is pane.setup

    @precondition(lambda self: self.session)
    @invariant()
    def events_and_ghosts_are_consistent(self):
        timeline = self.session.timeline
        assert len({ghost.node for ghost in timeline.ghosts}) <= MAX_GHOST_BRANCHES
        times = [event.time for event in timeline.events]
        assert times == sorted(times)
        assert not times or times[-1] <= timeline.end_time

    @precondition(lambda self: self.session and self.session.timeline.run.drag)
    @invariant()
    def a_dragged_robot_works_at_present(self):
        number, _ = self.session.timeline.run.drag
        assert self.session.timeline.is_live
        assert number in self.session.displayed.numbers

    @precondition(lambda self: self.session)
    @invariant()
    def the_displayed_state_can_be_drawn(self):
        displayed = self.session.displayed
        for pane in self.session.timeline.panes:
            snapshot = displayed.get_snapshot(pane)
            assert snapshot.time == pytest.approx(displayed.time, abs=1e-9)
            np.testing.assert_array_equal(snapshot.positions, displayed.get_positions(pane))
            trail, times = displayed.get_trail(pane)
            setup = displayed.get_setup(pane)
            assert snapshot.positions.shape == (len(setup.numbers), 2)
            assert trail.shape[1:] == (len(setup.numbers) + len(setup.failed), 2)
            assert len(trail) == len(times) >= 1
            assert times[-1] <= displayed.time + 1e-6

    @precondition(lambda self: self.session)
    @invariant()
    def robots_overlap_no_obstacles(self):
        assert compute_penetration(self.session) < MAX_PENETRATION_M


@pytest.mark.slow
def test_a_session_stays_consistent_under_any_edits():
    run_state_machine_as_test(RandomEdits, settings=settings(max_examples=25, stateful_step_count=25))


EDIT_NAMES = ("draw", "delete", "add", "remove", "fail", "revive", "step")
edits = st.tuples(st.sampled_from(EDIT_NAMES), points, indices)


def apply_edit(session, name, point, index) -> None:
    """Apply an edit by its name, as far as it is possible."""
    working, failed = get_robot_numbers(session)
    environment = session.displayed.environment
    obstacles = len(environment.obstacles)
    with suppress(ParameterError, MapError):
        if name == "draw":
            session.edit_map(add_obstacle(environment, CircleObstacle(point, 0.2)), "drawn")
        elif name == "delete" and obstacles:
            session.edit_map(replace_obstacles(environment, index % obstacles, 1), "deleted")
        elif name == "add":
            session.add_robot(point)
        elif name == "remove":
            numbers = [*working, *failed]
            session.remove_robot(numbers[index % len(numbers)])
        elif name == "fail":
            session.fail_robot(working[index % len(working)])
        elif name == "revive" and failed:
            session.revive_robot(failed[index % len(failed)])
        else:
            advance_session(session, index)


@given(st.lists(edits, max_size=15))
@settings(max_examples=count_examples(25))
def test_undo_and_redo_of_all_edits_restore_map_and_robots(edits):
    session = start_session(RAPF, LLOYD)
    for name, point, index in edits:
        apply_edit(session, name, point, index)
    numbers = get_robot_numbers(session)
    environment = session.displayed.environment
    while session.undo() is not None:
        pass
    assert get_robot_numbers(session) == ((1, 2, 3), ())
    assert session.displayed.environment == HALL
    while session.redo() is not None:
        pass
    assert get_robot_numbers(session) == numbers
    assert session.displayed.environment == environment
    assert {pane.numbers for pane in session.timeline.panes} == {session.displayed.numbers}


@given(
    edits=st.lists(edits, max_size=6),
    controllers=st.lists(controllers, min_size=1, max_size=2),
    steps=st.integers(1, 30),
    steps_back=st.integers(0, 30),
)
@settings(max_examples=count_examples(30))
def test_a_branch_after_any_edits_is_the_same_bit_for_bit(edits, controllers, steps, steps_back):
    session = start_session(*controllers)
    for name, point, index in edits:
        apply_edit(session, name, point, index)
    last_edit_time = session.timeline.end_time
    advance_session(session, steps)
    end_time = session.timeline.end_time
    expected = [pane.simulation.positions for pane in session.timeline.panes]
    session.show_time(max(end_time - steps_back / 60, last_edit_time))
    session.branch()
    while session.timeline.end_time < end_time:
        session.playback.step()
    for pane, positions in zip(session.timeline.panes, expected, strict=True):
        np.testing.assert_array_equal(pane.simulation.positions, positions)
