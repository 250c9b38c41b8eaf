"""The document of a session: all states are recomputed from its edits, bit for bit, branch by branch."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from sample_sessions import (
    HALL,
    LLOYD,
    RAPF,
    advance_session,
    advance_with_costs,
    get_positions,
    start_session,
)

from robocov.density import Gaussian, Gaussians
from robocov.environment import CircleObstacle, ObstaclePath
from robocov.errors import RobocovError
from robocov_app.viewer.session import playback as module
from robocov_app.viewer.session.editing.edits import SetDensity
from robocov_app.viewer.session.editing.map_edits import add_obstacle
from robocov_app.viewer.session.files.session_file import build_session_content, format_session, parse_session
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

ATLAS = ControllerChoice("atlas")
Point = tuple[float, float]


def drag_robot(session: Session, point: Point, number: int) -> None:
    numbers = session.displayed.numbers
    session.playback.is_playing = True
    for _ in range(number):
        session.drag_robot(numbers[number % len(numbers)], point)
        session.playback.advance(1 / 60)
    session.release()


def draw_circle(session: Session, point: Point, number: int) -> None:
    environment = add_obstacle(session.displayed.environment, CircleObstacle(point, 0.2))
    session.edit_map(environment, "circle drawn")


def fail_robot(session: Session, point: Point, number: int) -> None:
    numbers = session.displayed.numbers
    session.fail_robot(numbers[number % len(numbers)])


def remove_robot(session: Session, point: Point, number: int) -> None:
    numbers = session.displayed.numbers
    session.remove_robot(numbers[number % len(numbers)])


def set_gain(session: Session, point: Point, number: int) -> None:
    pane = session.timeline.panes[0]
    session.set_controller(pane, pane.controller.with_gain("k_rep", number / 5))


EDITS = {
    "add robot": lambda session, point, number: session.add_robot(point),
    "drag robot": drag_robot,
    "draw circle": draw_circle,
    "fail robot": fail_robot,
    "paint": lambda session, point, number: session.paint(
        (point,), 0.7, lowers=number % 2 == 0, stroke=number
    ),
    "redo": lambda session, point, number: session.redo(),
    "remove robot": remove_robot,
    "restart": lambda session, point, number: session.restart(seed=number),
    "set gain": set_gain,
    "set speed": lambda session, point, number: session.set_properties(RobotProperties(max_speed=number / 5)),
    "show past": lambda session, point, number: session.show_time(session.timeline.end_time * number / 10),
    "undo": lambda session, point, number: session.undo(),
}
points = st.tuples(st.floats(0.2, 5.8), st.floats(0.2, 3.8))
edits = st.lists(st.tuples(st.sampled_from(sorted(EDITS)), points, st.integers(1, 9)), min_size=1, max_size=6)


def recompute(session: Session) -> Session:
    """Return a session that is recomputed from the content of a file."""
    timeline = session.timeline
    content = build_session_content(timeline.document, timeline.head, timeline.step, {"theme": "dark"})
    saved = parse_session(json.loads(format_session(content)), "again.robocov")
    assert saved.view == {"theme": "dark"}
    return Session.open(saved)


def assert_same_positions(session: Session, other: Session) -> None:
    for positions, other_positions in zip(get_positions(session), get_positions(other), strict=True):
        np.testing.assert_array_equal(positions, other_positions)


@pytest.mark.slow
@given(edits, st.sampled_from([(RAPF,), (LLOYD, RAPF), (ATLAS,)]), st.booleans())
@settings(max_examples=count_examples(40))
def test_every_session_is_recomputed_bit_for_bit(edits, controllers, has_moving_obstacle):
    environment = HALL
    if has_moving_obstacle:
        path = ObstaclePath(((3.4, 2.0), (3.4, 3.0)), 0.4)
        cart = CircleObstacle((3.4, 2.0), 0.2, "cart", path)
        environment = replace(HALL, obstacles=(*HALL.obstacles, cart))
    session = start_session(*controllers, environment=environment, robots=4, start="spread")
    advance_session(session, 5)
    for name, point, number in edits:
        with suppress(RobocovError):
            EDITS[name](session, point, number)
        advance_session(session, number)
    timeline = session.timeline
    session.show_time(timeline.end_time)
    recomputed = recompute(session)
    assert recomputed.timeline.end_time == timeline.end_time
    assert recomputed.timeline.events == timeline.events
    assert_same_positions(recomputed, session)
    head = timeline.head
    step = timeline.step
    for branch in timeline.document.list_branches():
        session.seek(branch.node)
        recomputed.seek(recomputed.timeline.document.nodes[branch.node.number])
        assert_same_positions(recomputed, session)
    session.seek(head, step)


def build_session_displayed_within_a_drag() -> Session:
    """Return a session of which a state in the middle of a drag is displayed."""
    session = advance_session(start_session(RAPF), 5)
    session.playback.is_playing = True
    for move in range(60):
        session.drag_robot(2, (1.0 + move / 20, 2.0))
        session.playback.advance(1 / 60)
    session.release()
    session.show_time(0.5)
    return session


@pytest.mark.parametrize("is_undone", [False, True])
def test_an_edit_within_a_drag_releases_the_robot(is_undone: bool) -> None:
    session = build_session_displayed_within_a_drag()
    session.fail_robot(1)
    advance_session(session, 5)
    if is_undone:
        session.undo()
    advance_session(session, 80)
    assert session.timeline.run.drag is None
    assert_same_positions(recompute(session), session)


def test_a_branch_within_a_drag_continues_the_drag() -> None:
    session = build_session_displayed_within_a_drag()
    session.branch()
    assert session.timeline.run.drag is not None
    advance_session(session, 80)
    assert session.timeline.run.drag is None
    assert_same_positions(recompute(session), session)


def test_all_edits_of_a_gesture_are_kept() -> None:
    """Dabs of a brush add up, and robots that were slowed down by a limit stay slow."""
    session = advance_session(start_session(RAPF), 25)
    for speed in (1.0, 0.05, 1.0):
        session.set_properties(RobotProperties(max_speed=speed, radius=0.11))
    for x in (1.0, 2.0, 3.0):
        session.paint(((x, 2.0),), 0.7, lowers=False, stroke=1)
    advance_session(session, 20)
    assert len(session.timeline.document.nodes) == 3
    assert_same_positions(recompute(session), session)


def test_every_density_can_be_stored() -> None:
    session = advance_session(start_session(RAPF), 5)
    for density in (Gaussians((Gaussian((2.0, 2.0), 0.5, 3.0),), 0.2), None):
        session.apply(SetDensity(density), "density", "density changed")
        advance_session(session, 5)
        recomputed = recompute(session)
        assert recomputed.displayed.environment.density == density
        assert_same_positions(recomputed, session)


def test_limits_also_hold_for_a_resumed_controller_without_memory() -> None:
    session = advance_session(start_session(LLOYD), 5)
    session.set_properties(RobotProperties(max_speed=0.5))
    advance_session(session, 10)
    session.show_time(7 / 60)
    session.branch()
    advance_session(session, 20)
    assert_same_positions(recompute(session), session)


def test_all_branches_can_be_entered() -> None:
    session = advance_session(start_session(RAPF), 10)
    timeline = session.timeline
    session.fail_robot(1)
    advance_with_costs(session, 20)
    failed = timeline.head
    assert session.undo() == "robot 1 failed"
    assert session.displayed.time == 10 / 60
    session.add_robot((3.0, 3.0))
    advance_with_costs(session, 30)
    descriptions = [branch.description for branch in timeline.document.list_branches()]
    assert descriptions == ["robot 1 failed", "robot 4 joined"]
    (ghost,) = timeline.ghosts
    assert ghost.node == failed.number
    assert ghost.times[-1] == pytest.approx(29 / 60)
    session.seek(timeline.document.nodes[ghost.node])
    assert session.displayed.numbers == (2, 3)
    assert session.displayed.time == 30 / 60
    assert timeline.panes[0].distance_curve.last_time == pytest.approx(29 / 60)
    assert [ghost.node for ghost in timeline.ghosts] == [2]


def test_an_edit_in_the_past_adds_a_branch() -> None:
    session = advance_session(start_session(RAPF), 10)
    session.fail_robot(1)
    advance_session(session, 20)
    session.show_time(5 / 60)
    session.set_controller(session.timeline.panes[0], LLOYD)
    assert len(session.timeline.document.list_branches()) == 2


def test_a_window_stays_responsive_while_it_simulates_a_branch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SEEK_SLICE_S", 0.0)
    session = advance_session(start_session(RAPF), 400)
    session.fail_robot(1)
    advance_session(session, 5)
    timeline = session.timeline
    for node in timeline.document.nodes:
        node.cached_states = []
    last = timeline.history.last
    timeline.history = timeline.history.copy_until(0)
    timeline.history.append(last)
    time = session.displayed.time
    session.playback.clock.budget = 0.008
    session.seek(timeline.document.nodes[0], 390)
    frames = 0
    while timeline.is_seeking:
        assert session.displayed.time == time
        assert session.displayed.numbers == (2, 3)
        session.playback.advance(1 / 60)
        frames += 1
    assert frames > 300
    assert session.displayed.time == pytest.approx(390 / 60)
    assert session.displayed.numbers == (1, 2, 3)
