"""Noise, message loss, and robots that fail or join, in sessions that are rewound and branched."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawn_pixels import list_legend_texts
from shapely import Polygon

from robocov.conditions import Conditions
from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov.errors import ParameterError
from robocov.scenario import Scenario
from robocov.simulation import Simulation
from robocov_app.look.theme import LIGHT
from robocov_app.render.layer_catalog import build_standard_layers
from robocov_app.render.painter import Painter
from robocov_app.render.scene import Scene
from robocov_app.runs.saved_runs import SavedRun, load_saved_runs
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.session.pane import Continuation
from robocov_app.viewer.session.recorded import build_replay_session
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import MAX_COMMUNICATING_ROBOTS, SessionScenario

CART = CircleObstacle((1.0, 3.0), 0.4, "cart", ObstaclePath(((1, 3), (5, 3)), 1.0, "back-and-forth"))
HALL = Environment("hall", ((0, 0), (6, 0), (6, 4), (0, 4)), (CART,))
DT = 0.05
PROPERTIES = RobotProperties(communication_range=4.0)
STARTS = np.array([[1.0, 1.0], [2.0, 1.5], [4.0, 1.0], [5.0, 1.2]])
CONDITIONS = Conditions(
    loss=0.4,
    delay=0.2,
    message_rate=5.0,
    position_noise=0.05,
    sensing_noise=0.02,
    failures=((2, 0.75),),
    joins=((3, 1.0, (4.5, 2.0)),),
    seed=3,
)


def start_session(conditions: Conditions | None = CONDITIONS) -> Session:
    scenario = SessionScenario(
        HALL,
        (ControllerChoice("rapf"), ControllerChoice("lloyd")),
        4,
        properties=PROPERTIES,
        dt=DT,
        given_starts=STARTS,
        conditions=conditions,
    )
    return Session(scenario)


def advance_session(session: Session, steps: int) -> list[bytes]:
    """Advance a session, and return what each pane observes at each step."""
    observations = []
    for _ in range(steps):
        session.playback.step()
        for pane in session.timeline.panes:
            seen = pane.simulation.observe_and_decide().seen
            content = pane.simulation.positions.tobytes() + seen.positions.tobytes()
            if seen.reported_positions is not None:
                content += seen.reported_positions.tobytes()
            observations.append(content)
    return observations


def test_robots_fail_and_join_by_themselves() -> None:
    session = start_session()
    assert session.displayed.numbers == (1, 2, 4)
    advance_session(session, 16)
    assert session.displayed.numbers == (1, 4)
    assert [event.text for event in session.timeline.events] == ["robot 2 failed"]
    advance_session(session, 6)
    assert session.displayed.numbers == (1, 3, 4)
    position = session.timeline.panes[0].positions[1]
    assert np.hypot(*(position - [4.5, 2.0])) < 0.2


@pytest.mark.parametrize("last_failures", [(), ((1, 5.0), (3, 5.0), (4, 5.0))])
def test_a_robot_that_fails_at_the_start_is_an_obstacle(last_failures: tuple[tuple[int, float], ...]) -> None:
    session = start_session(Conditions(failures=((2, 0.0), *last_failures)))
    pane = session.timeline.panes[0]
    assert pane.setup.follows_schedule is not bool(last_failures)
    assert session.displayed.numbers == (1, 3, 4)
    assert pane.setup.failed == {2: (2.0, 1.5)}
    advance_session(session, 5)
    assert pane.setup.failed == {2: (2.0, 1.5)}


def test_a_branch_observes_the_same_bit_for_bit() -> None:
    session = start_session()
    advance_session(session, 10)
    expected = advance_session(session, 25)
    # Before all events, and between a failure and a join.
    for step in (10, 21):
        session.show_time(step * DT)
        session.branch()
        assert advance_session(session, 35 - step) == expected[2 * (step - 10) :]


def test_edits_before_an_event_leave_it_on_schedule() -> None:
    session = start_session()
    advance_session(session, 5)
    session.set_properties(replace(PROPERTIES, max_speed=0.5))
    session.place_robot(4, (5.0, 3.0))
    session.edit_map(replace(HALL, obstacles=()), "obstacle deleted")
    pane = session.timeline.panes[0]
    session.set_controller(pane, ControllerChoice("rapf", {"k_rep": 0.2}))
    session.paint(((2.0, 2.0),), 0.5, lowers=False, stroke=object())
    assert pane.setup.follows_schedule
    assert pane.positions[2].tolist() == [5.0, 3.0]
    advance_session(session, 20)
    assert session.displayed.numbers == (1, 3, 4)
    assert sorted(session.timeline.panes[0].setup.failed) == [2]


def test_a_robot_that_the_user_lets_fail_ends_the_schedule_of_the_simulation_only() -> None:
    session = start_session()
    advance_session(session, 5)
    session.fail_robot(1)
    assert session.displayed.numbers == (2, 4)
    assert not session.timeline.panes[0].setup.follows_schedule
    advance_session(session, 20)
    assert session.displayed.numbers == (3, 4)
    session.undo()
    assert session.displayed.numbers == (1, 2, 4)
    assert session.timeline.panes[0].setup.follows_schedule
    advance_session(session, 20)
    assert session.displayed.numbers == (1, 3, 4)


def test_a_failed_robot_that_is_dragged_is_released() -> None:
    session = start_session()
    advance_session(session, 10)
    session.playback.is_playing = True
    session.drag_robot(2, (3.0, 3.0))
    assert session.timeline.run.drag is not None
    advance_session(session, 8)
    assert session.timeline.run.drag is None


def test_messages_of_the_past_are_recomputed() -> None:
    session = start_session()
    pane = session.timeline.panes[0]
    snapshots = []
    for _ in range(12):
        snapshots.append(pane.observe_and_decide())
        session.playback.step()
    session.show_time(8 * DT)
    snapshot = session.displayed.get_snapshot(pane)
    expected = snapshots[8]
    assert snapshot.decision.forces.tobytes() == expected.decision.forces.tobytes()
    assert snapshot.seen.reported_positions is not None
    assert expected.seen.reported_positions is not None
    assert snapshot.seen.reported_positions.tobytes() == expected.seen.reported_positions.tobytes()
    assert (snapshot.positions == expected.positions).all()


def test_the_other_robots_keep_their_messages_when_one_is_removed() -> None:
    session = start_session(replace(CONDITIONS, failures=(), joins=(), loss=0.0))
    advance_session(session, 15)
    before = session.timeline.panes[0].simulation.inbox
    assert before is not None
    session.remove_robot(2)
    after = session.timeline.panes[0].simulation.inbox
    assert after is not None
    pairs = np.ix_([0, 2, 3], [0, 2, 3])
    assert (after.sent_steps == before.sent_steps[pairs]).all()
    assert (after.positions == before.positions[pairs]).all()
    session.add_robot((3.0, 1.0))
    inbox = session.timeline.panes[0].simulation.inbox
    assert inbox is not None
    assert (inbox.arrival_steps[3] == -1).all()
    assert (inbox.arrival_steps[:, 3] == -1).all()
    advance_session(session, 10)


def test_a_session_without_failures_and_joins_is_like_a_run() -> None:
    conditions = replace(CONDITIONS, failures=(), joins=())
    session = start_session(conditions)
    advance_session(session, 30)
    pane = session.timeline.panes[0]
    simulation = Simulation(
        HALL,
        ControllerChoice("rapf").build(),
        STARTS,
        PROPERTIES.build_team((1, 2, 3, 4)),
        0.05,
        conditions=conditions,
    )
    record = simulation.run(1.5)
    assert pane.simulation.positions.tobytes() == record.positions[-1].tobytes()


def test_robots_are_pushed_out_of_a_moving_obstacle() -> None:
    session = start_session(None)
    # After 2 s the cart is at x = 3 m.
    advance_session(session, 40)
    pane = session.timeline.panes[0]
    positions = pane.simulation.positions.copy()
    positions[0] = [3.0, 3.0]
    moved = pane.build_changed_simulation(Continuation(pane.setup, positions, np.zeros_like(positions)))
    assert np.hypot(*(moved.positions[0] - [3.0, 3.0])) > 0.49


def test_the_beliefs_of_the_selected_robot_are_drawn() -> None:
    session = start_session()
    advance_session(session, 12)
    pane = session.timeline.panes[0]
    scene = Scene.from_snapshot(HALL, pane.setup.team, pane.observe_and_decide())
    painter = Painter(HALL, (400, 300), LIGHT, build_standard_layers(), 1.0)
    # The cells of all robots are the true ones, which neither overlap nor leave gaps.
    assert scene.cells is not None
    assert sum(Polygon(cell).area for cell in scene.cells) == pytest.approx(HALL.area)
    plain = painter.render_frame(replace(scene, numbers=session.displayed.numbers))
    selected = replace(scene, numbers=session.displayed.numbers, selected=1)
    assert (painter.render_frame(selected) != plain).any(axis=-1).sum() > 200
    assert "position according to robot 2" in list_legend_texts(painter, selected)
    assert "position according to robot 2" not in list_legend_texts(painter, scene)


def test_a_saved_run_with_conditions_is_replayed_and_continued(tmp_path: Path) -> None:
    team = PROPERTIES.build_team((1, 2, 3, 4))
    simulation = Simulation(HALL, ControllerChoice("rapf").build(), STARTS, team, 0.05, conditions=CONDITIONS)
    simulation.run(1.5).save(tmp_path)
    session = build_replay_session(load_saved_runs(tmp_path))
    pane = session.timeline.panes[0]
    for time_s, working, failed in ((0.5, (1, 2, 4), ()), (0.9, (1, 4), (2,)), (1.5, (1, 3, 4), (2,))):
        session.show_time(time_s)
        setup = session.displayed.get_setup(pane)
        assert setup.numbers == working
        assert tuple(setup.failed) == failed
    session.show_time(0.6)
    session.branch()
    assert session.displayed.numbers == (1, 2, 4)
    advance_session(session, 12)
    assert session.displayed.numbers == (1, 3, 4)


FAILURES = Conditions(failures=((2, 0.75),), joins=((3, 1.0, (4.5, 2.0)),), seed=3)
NOISE = replace(CONDITIONS, failures=(), joins=())


@pytest.mark.parametrize("conditions", [FAILURES, NOISE, CONDITIONS], ids=["failures", "noise", "both"])
@pytest.mark.parametrize("name", ["rapf", "atlas"])
def test_a_record_is_continued_like_a_longer_run_bit_for_bit(name: str, conditions: Conditions) -> None:
    """From the end of the record, before the failure, and between the failure and the joining robot."""
    scenario = Scenario(
        HALL,
        name,
        team=PROPERTIES.build_team((1, 2, 3, 4)),
        starts=STARTS,
        dt=DT,
        duration=2.0,
        conditions=conditions,
    )
    expected = scenario.run()
    record = expected.until(1.2)
    for time_s in (1.2, 0.4, 0.85):
        session = build_replay_session([SavedRun(Path("saved"), record, None)])
        session.show_time(time_s)
        session.branch()
        advance_session(session, round((2.0 - time_s) / DT))
        pane = session.timeline.panes[0]
        rows = np.flatnonzero(expected.is_working[-1])
        assert [number - 1 for number in pane.numbers] == rows.tolist()
        assert pane.positions.tobytes() == expected.positions[-1, rows].tobytes()
        assert pane.velocities.tobytes() == expected.velocities[-1, rows].tobytes()


@pytest.mark.slow
def test_the_cost_is_computed_among_moving_obstacles() -> None:
    for costs in (Costs(8, direct=True), Costs(8)):
        costs.set_environment(HALL)
        costs.request(0, 0.0, STARTS)
        end = time.monotonic() + 60.0
        while not costs.poll() and time.monotonic() < end:
            time.sleep(0.005)
        assert costs.known[0].result.mean_distance == CoverageCost(HALL.at(0.0), 8)(STARTS).mean_distance
        assert costs.state == ""
        costs.close()


def test_the_number_of_robots_with_messages_is_limited() -> None:
    SessionScenario(HALL, robots=MAX_COMMUNICATING_ROBOTS, conditions=CONDITIONS)
    SessionScenario(HALL, robots=500, conditions=Conditions(sensing_noise=0.1))
    with pytest.raises(
        ParameterError, match="robots: expected at most 100 with lost or delayed messages, got 101"
    ):
        SessionScenario(HALL, robots=MAX_COMMUNICATING_ROBOTS + 1, conditions=CONDITIONS)
