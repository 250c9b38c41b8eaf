from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test
from touched_run import (
    HALL,
    LLOYD,
    PILLAR,
    RAPF,
    RPF,
    all_told,
    begun,
    robots_of,
    stepped,
    too_deep,
    with_pillar,
)

from robocov.environment import CircleObstacle, Environment
from robocov.errors import MapError, ParameterError, RobocovError, StartError
from robocov_app.demo.editing import with_moved, with_obstacle, without_obstacle
from robocov_app.demo.scenario import Law, Limits
from robocov_app.demo.timeline import MOST_EVENTS, MOST_GHOSTS

# beginning anew


def test_it_begins_anew_as_it_began():
    session = begun(RAPF, LLOYD)
    start = session.positions(session.lanes[0]).copy()
    stepped(session, 20)
    session.fail_robot(1)
    session.add_robot((3.0, 3.0))
    serial = session.serial
    session.restart()
    assert session.serial == serial + 1
    assert (session.time, session.history.steps, session.live) == (0.0, [0], True)
    assert robots_of(session) == ((1, 2, 3), ())
    for lane in session.lanes:
        np.testing.assert_array_equal(session.positions(lane), start)
    assert list(session.events) == list(session.ghosts) == []
    assert not session.undo.can_undo


def test_what_was_drawn_can_be_undone_after_a_restart_but_not_what_was_done_to_robots() -> None:
    session = begun()
    session.edit(with_obstacle(session.environment, CircleObstacle((5.2, 0.4), 0.2)), "circle drawn")
    session.add_robot((3.4, 3.0))
    session.restart(seed=3)
    assert robots_of(session) == ((1, 2, 3), ())
    assert session.undo.undo() == "circle drawn"
    assert session.environment.obstacles == HALL.obstacles
    assert not session.undo.can_undo
    assert session.undo.redo() == "circle drawn"
    session.restart(environment=HALL)
    assert not session.undo.can_undo and not session.undo.can_redo


def test_it_begins_anew_with_changes():
    session = begun(RAPF)
    session.restart(robots=5)
    assert session.numbers == (1, 2, 3, 4, 5)
    session.restart(start="far", seed=4)
    np.testing.assert_array_equal(
        session.positions(session.lanes[0]), HALL.start("far").sample(5, seed=4, radius=0.1)
    )
    session.restart(laws=(RPF, LLOYD), limits=Limits(radius=0.15))
    assert [lane.law for lane in session.lanes] == [RPF, LLOYD]
    assert session.scenario.start == "far"
    other = Environment("other", ((0, 0), (9, 0), (9, 9), (0, 9)))
    session.restart(environment=other)
    assert session.environment is other
    assert session.scenario.start_name == "uniform"


def test_what_was_chosen_stays_chosen():
    session = begun(RAPF, RPF)
    session.set_law(session.lanes[0], LLOYD)
    session.set_limits(Limits(radius=0.2))
    session.edit(with_pillar(), "circle drawn")
    session.restart()
    assert [lane.law for lane in session.lanes] == [LLOYD, RPF]
    assert session.lanes[0].circumstances.limits == Limits(radius=0.2)
    assert session.environment.obstacles[-1] == PILLAR


def test_also_while_the_past_is_looked_at():
    session = stepped(begun(RAPF), 10)
    session.edit(with_pillar(), "circle drawn")
    session.set_law(session.lanes[0], LLOYD)
    stepped(session, 10)
    session.look_at(0.0)
    assert session.environment is HALL
    session.restart()
    assert session.environment.obstacles[-1] == PILLAR
    assert session.lanes[0].law == LLOYD


def test_a_start_that_was_covered_is_not_gone_back_to():
    session = begun(start="far")
    session.edit(with_obstacle(HALL, CircleObstacle((5.2, 3.2), 0.6)), "circle drawn")
    assert "far" not in session.environment.starts
    session.restart()
    assert session.scenario.start is None
    assert session.scenario.start_name == "corner"


def test_starts_that_were_given_are_gone_back_to_but_not_by_others():
    given_starts = np.array([[1.0, 1.0], [5.0, 3.0], [3.0, 3.0]])
    session = stepped(begun(given=given_starts), 10)
    session.restart(laws=(RPF,))
    np.testing.assert_array_equal(session.positions(session.lanes[0]), given_starts)
    session.restart(seed=1)
    assert session.scenario.given is None
    assert np.abs(session.positions(session.lanes[0]) - given_starts).max() > 0.1


@pytest.mark.parametrize(
    "changes",
    [
        {"robots": 0},
        {"robots": 700},
        {"start": "nowhere"},
        {"laws": (Law("nobody"),)},
        {"laws": ()},
        {"limits": Limits(radius=3.0)},
        {"limits": Limits(max_speed=-1.0)},
        {"dt": 7.0},
        {"seed": -1},
    ],
)
def test_what_cannot_be_begun_leaves_all_as_it_is(changes):
    session = stepped(begun(RAPF, LLOYD), 12)
    session.fail_robot(2)
    session.look_at(0.1)
    before = all_told(session)
    with pytest.raises((StartError, ParameterError)):
        session.restart(**changes)
    assert all_told(session) == before


# controllers and limits


def test_another_controller_takes_over_in_one_pane():
    session = stepped(begun(RAPF, RAPF), 20)
    session.set_law(session.lanes[1], LLOYD)
    assert [lane.law for lane in session.lanes] == [RAPF, LLOYD]
    assert session.scenario.laws == (RAPF, LLOYD)
    assert session.events[-1].text == "LA takes over"
    session.set_law(session.lanes[0], RAPF.with_gain("k_rep", 0.5))
    assert session.events[-1].text == "RAPF: k_rep = 0.5"
    assert len(session.history) == 21
    stepped(session, 20)


def test_the_same_controller_again_is_no_event():
    session = stepped(begun(RAPF), 10)
    session.look_at(0.0)
    before = all_told(session)
    session.set_law(session.lanes[0], Law("rapf"))
    session.set_limits(Limits())
    assert all_told(session) == before


def test_what_was_then_counts_not_what_is_now():
    session = stepped(begun(), 20)
    session.set_limits(Limits(max_speed=0.5))
    session.set_law(session.lanes[0], LLOYD)
    stepped(session, 20)
    session.look_at(0.1)
    session.set_limits(Limits(max_speed=0.5))
    assert session.live
    assert session.lanes[0].circumstances.limits.max_speed == 0.5
    assert session.lanes[0].law == RAPF
    assert session.end == pytest.approx(0.1)


def test_limits_are_those_of_all():
    session = stepped(begun(RAPF, LLOYD), 20)
    session.set_limits(Limits(max_speed=0.3, communication_range=0.5))
    for lane in session.lanes:
        assert lane.simulation.team.max_speed.tolist() == [0.3] * 3
        assert not lane.simulation.snapshot.seen.neighbours.complete
    assert session.events[-1].kind == "limits"
    before = all_told(session)
    for limits in (Limits(max_speed=0.0), Limits(radius=1.9)):
        with pytest.raises((ParameterError, StartError)):
            session.set_limits(limits)
        assert all_told(session) == before


def test_larger_robots_make_room_for_each_other():
    session = begun(robots=6)
    session.set_limits(Limits(radius=0.3))
    places = session.positions(session.lanes[0])
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    assert apart[np.triu_indices(6, 1)].min() >= 0.6
    assert too_deep(session) <= 0.0


# anything

points = st.tuples(st.floats(-0.5, 6.5), st.floats(-0.5, 4.5))
laws = st.sampled_from([RAPF, RPF, LLOYD, RAPF.with_gain("k_rep", 1.0)])
some_limits = st.builds(
    Limits,
    radius=st.sampled_from([0.05, 0.1, 0.25]),
    max_speed=st.sampled_from([0.5, 1.0, 4.0]),
    sensing_range=st.sampled_from([0.3, 3.0, np.inf]),
    communication_range=st.sampled_from([0.5, np.inf]),
)


class Anything(RuleBasedStateMachine):
    """Whatever users do."""

    @initialize(laws=st.lists(laws, min_size=1, max_size=2), robots=st.integers(1, 5), seed=st.integers(0, 9))
    def begin(self, laws, robots, seed):
        self.session = begun(*laws, robots=robots, seed=seed, start="spread")

    def attempt(self, touch) -> None:
        """Do something; what is refused leaves everything as it was."""
        before = all_told(self.session)
        try:
            touch()
        except RobocovError as error:
            assert str(error)
            assert all_told(self.session) == before

    def number(self, k: int) -> int:
        working, failed = robots_of(self.session)
        return [*working, *failed][k % (len(working) + len(failed))]

    @rule(steps=st.integers(1, 12))
    def step(self, steps):
        stepped(self.session, steps)

    @rule(playing=st.booleans())
    def pause(self, playing):
        self.session.playing = playing

    @rule(seconds=st.floats(0.0, 0.2))
    def pass_time(self, seconds):
        self.session.advance(seconds)

    @rule(k=st.integers(0, 9), point=points)
    def grab(self, k, point):
        self.attempt(lambda: self.session.grab(self.number(k), point))

    @rule()
    def release(self):
        self.session.release()
        assert self.session.hand is None

    @rule(k=st.integers(0, 9), point=points)
    def place(self, k, point):
        self.attempt(lambda: self.session.place(self.number(k), point))

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
            self.session.edit(with_obstacle(self.session.environment, circle), "circle drawn")

        self.attempt(draw)

    @rule(k=st.integers(0, 9), by=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
    def move_obstacle(self, k, by):
        there = self.session.environment
        if there.obstacles:
            k %= len(there.obstacles)
            self.attempt(lambda: self.session.edit(with_moved(there, k, *by), "moved"))

    @rule(k=st.integers(0, 9))
    def delete_obstacle(self, k):
        there = self.session.environment
        if there.obstacles:
            k %= len(there.obstacles)
            self.attempt(lambda: self.session.edit(without_obstacle(there, k), "deleted"))

    @rule(redo=st.booleans())
    def undo(self, redo):
        self.session.look_at(1e9)
        self.attempt(self.session.undo.redo if redo else self.session.undo.undo)

    @rule(k=st.integers(0, 3), law=laws)
    def set_law(self, k, law):
        lane = self.session.lanes[k % len(self.session.lanes)]
        self.attempt(lambda: self.session.set_law(lane, law))

    @rule(limits=some_limits)
    def set_limits(self, limits):
        self.attempt(lambda: self.session.set_limits(limits))

    @rule(part=st.floats(0.0, 1.0))
    def look_at(self, part):
        self.session.look_at(part * self.session.end)

    @rule(by=st.integers(-8, 8))
    def look_by(self, by):
        self.session.look_by(by)

    @rule()
    def branch(self):
        self.attempt(self.session.branch)
        assert self.session.live

    @rule(robots=st.integers(1, 6) | st.none())
    def restart(self, robots):
        self.attempt(lambda: self.session.restart(**({} if robots is None else {"robots": robots})))

    @rule(law=laws)
    def add_pane(self, law):
        if len(self.session.lanes) < 3:
            self.attempt(lambda: self.session.add_pane(law))

    @rule(k=st.integers(0, 3))
    def remove_pane(self, k):
        if len(self.session.lanes) > 1:
            self.session.remove_pane(self.session.lanes[k % len(self.session.lanes)])

    @invariant()
    def lanes_are_alike(self):
        if not hasattr(self, "session"):
            return
        session = self.session
        first = session.lanes[0].circumstances
        assert len(first.numbers) >= 1
        assert list(first.numbers) == sorted(set(first.numbers))
        assert not set(first.numbers) & set(first.failed)
        for lane in session.lanes:
            there = lane.circumstances
            assert there.numbers == first.numbers
            assert set(there.failed) == set(first.failed)
            assert there.environment is first.environment
            assert there.limits == first.limits
            count = len(there.numbers)
            for rows in (lane.simulation.positions, lane.starts, lane.trail.positions[-1]):
                assert rows.shape == (count, 2)
                assert np.isfinite(rows).all()
            assert len(lane.simulation.team) == count
        assert len({lane.number for lane in session.lanes}) == len(session.lanes)
        assert session.scenario.environment is first.environment
        assert session.scenario.laws == tuple(lane.law for lane in session.lanes)
        assert session.scenario.limits == first.limits

    @invariant()
    def times_are_consistent(self):
        if not hasattr(self, "session"):
            return
        session = self.session
        assert 0.0 <= session.time <= session.end
        assert session.live == (session.time == session.end)
        assert (np.diff(session.history.steps) > 0).all()
        assert session.history.time(len(session.history) - 1) == session.end
        for lane in session.lanes:
            assert lane.time == pytest.approx(session.end, abs=1e-9)
            assert (np.diff(lane.trail.time) > 0).all()
            assert lane.trail.time[-1] <= session.end + 1e-9
            last = session.history.last.states[lane.number]
            np.testing.assert_array_equal(last.positions, lane.simulation.positions)
            np.testing.assert_array_equal(last.velocities, lane.simulation.velocities)
            assert last.circumstances is lane.circumstances
        assert len(session.events) <= MOST_EVENTS
        assert len(session.ghosts) <= MOST_GHOSTS
        times = [event.time for event in session.events]
        assert times == sorted(times)
        assert not times or times[-1] <= session.end
        assert session.hand is None or (session.live and session.hand[0] in session.numbers)

    @invariant()
    def what_is_looked_at_can_be_shown(self):
        if not hasattr(self, "session"):
            return
        for lane in self.session.lanes:
            there, snapshot = self.session.circumstances(lane), self.session.snapshot(lane)
            assert snapshot.time == pytest.approx(self.session.time, abs=1e-9)
            np.testing.assert_array_equal(snapshot.positions, self.session.positions(lane))
            trail, times = self.session.trail(lane)
            assert trail.shape[1:] == snapshot.positions.shape == (len(there.numbers), 2)
            assert len(trail) == len(times) >= 1
            assert times[-1] <= self.session.time + 1e-6

    @invariant()
    def robots_are_where_there_is_room(self):
        if hasattr(self, "session"):
            assert too_deep(self.session) < 2e-3


def test_whatever_users_do_all_stays_in_order():
    run_state_machine_as_test(Anything, settings=settings(max_examples=25, stateful_step_count=25))


undoable = st.tuples(
    st.sampled_from(["draw", "delete", "add", "remove", "fail", "revive", "step"]), points, st.integers(0, 9)
)


def touched(session, kind, point, k) -> None:
    working, failed = robots_of(session)
    obstacles = len(session.environment.obstacles)
    if kind == "draw":
        session.edit(with_obstacle(session.environment, CircleObstacle(point, 0.2)), "drawn")
    elif kind == "delete" and obstacles:
        session.edit(without_obstacle(session.environment, k % obstacles), "deleted")
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
        stepped(session, k)


@given(st.lists(undoable, max_size=15))
@settings(max_examples=25)
def test_who_takes_all_back_has_the_same_map_and_the_same_robots(touches):
    session = begun(RAPF, LLOYD)
    for touch in touches:
        # the last robot that works; a map that cannot be
        with suppress(ParameterError, MapError):
            touched(session, *touch)
    end = robots_of(session), session.environment
    while session.undo.undo() is not None:
        stepped(session, 1)
    assert robots_of(session) == ((1, 2, 3), ())
    assert session.environment == HALL
    while session.undo.redo() is not None:
        stepped(session, 1)
    assert (robots_of(session), session.environment) == end
    assert {lane.numbers for lane in session.lanes} == {session.numbers}


@given(
    st.lists(undoable, max_size=6),
    st.lists(laws, min_size=1, max_size=2),
    st.integers(1, 30),
    st.integers(0, 30),
)
@settings(max_examples=30)
def test_however_it_came_so_far_from_there_it_goes_the_same_way_again(touches, controllers, steps, back):
    session = begun(*controllers)
    for touch in touches:
        with suppress(ParameterError, MapError):
            touched(session, *touch)
    since = session.end
    stepped(session, steps)
    end, went = session.end, [lane.simulation.positions for lane in session.lanes]
    session.look_at(max(end - back / 60, since))
    session.branch()
    while session.end < end:
        session.step()
    for lane, before in zip(session.lanes, went, strict=True):
        np.testing.assert_allclose(lane.simulation.positions, before, rtol=0.0, atol=1e-9)
