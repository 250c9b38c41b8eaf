"""What goes wrong in the window: it can be rewound and branched, and goes on the same."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shapely import Polygon

from robocov.conditions import Conditions
from robocov.cost import CoverageCost
from robocov.environment import CircleObstacle, Environment, ObstaclePath
from robocov.errors import ParameterError
from robocov.simulation import Simulation
from robocov_app.look.theme import LIGHT
from robocov_app.render.picture import Painter, standard_layers
from robocov_app.render.scene import Scene
from robocov_app.runs.saved_runs import load_saved_runs
from robocov_app.viewer.costs import Costs
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.pane import Continuation
from robocov_app.viewer.session.recorded import build_replay_session
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.scenario import MAX_COMMUNICATING_ROBOTS, SessionScenario
from robocov_app.viewer.session.session import Session

CART = CircleObstacle((1.0, 3.0), 0.4, "cart", ObstaclePath(((1, 3), (5, 3)), 1.0, "back-and-forth"))
HALL = Environment("hall", ((0, 0), (6, 0), (6, 4), (0, 4)), (CART,))
STARTS = np.array([[1.0, 1.0], [2.0, 1.5], [4.0, 1.0], [5.0, 1.2]])
BAD = Conditions(
    loss=0.4,
    delay=0.2,
    message_rate=5.0,
    position_noise=0.05,
    sensing_noise=0.02,
    failures=((2, 0.75),),
    joins=((3, 1.0, (4.5, 2.0)),),
    seed=3,
)


def begun(conditions: Conditions | None = BAD) -> Session:
    return Session(
        SessionScenario(
            HALL,
            (ControllerChoice("rapf"), ControllerChoice("lloyd")),
            4,
            properties=RobotProperties(communication_range=4.0),
            dt=0.05,
            given_starts=STARTS,
            conditions=conditions,
        )
    )


def states(session: Session, steps: int) -> list[bytes]:
    found = []
    for _ in range(steps):
        session.playback.step()
        for pane in session.timeline.panes:
            seen = pane.simulation.observe_and_decide().seen
            heard = b"" if seen.reported_positions is None else seen.reported_positions.tobytes()
            found.append(pane.simulation.positions.tobytes() + seen.positions.tobytes() + heard)
    return found


def test_robots_fail_and_join_by_themselves() -> None:
    session = begun()
    assert session.displayed.numbers == (1, 2, 4)
    states(session, 16)
    assert session.displayed.numbers == (1, 4)
    assert [event.text for event in session.timeline.events] == ["robot 2 failed"]
    states(session, 6)
    assert session.displayed.numbers == (1, 3, 4)
    place = session.timeline.panes[0].simulation.positions[1]
    assert np.hypot(*(place - [4.5, 2.0])) < 0.2


def test_rewinding_and_playing_on_gives_the_same_again() -> None:
    session = begun()
    states(session, 10)
    expected = states(session, 25)
    for back in (10, 21):  # before anything happened, and between robots that come and go
        session.show_time(back * 0.05)
        session.branch()
        assert states(session, 35 - back) == expected[2 * (back - 10) :]


def test_the_past_is_explained_as_it_was() -> None:
    session = begun()
    pane = session.timeline.panes[0]
    then = []
    for _ in range(12):
        then.append(pane.simulation.observe_and_decide())
        session.playback.step()
    session.show_time(8 * 0.05)
    past = session.displayed.get_snapshot(pane)
    assert past.decision.forces.tobytes() == then[8].decision.forces.tobytes()
    assert past.seen.reported_positions is not None
    assert then[8].seen.reported_positions is not None
    assert past.seen.reported_positions.tobytes() == then[8].seen.reported_positions.tobytes()
    assert (past.positions == then[8].positions).all()


def test_who_stays_keeps_the_messages_when_another_is_taken_out() -> None:
    session = begun(replace(BAD, failures=(), joins=(), loss=0.0))
    states(session, 15)
    before = session.timeline.panes[0].simulation.inbox
    assert before is not None
    session.remove_robot(2)
    after = session.timeline.panes[0].simulation.inbox
    assert after is not None
    kept = [0, 2, 3]
    assert (after.sent == before.sent[np.ix_(kept, kept)]).all()
    assert (after.positions == before.positions[np.ix_(kept, kept)]).all()
    session.add_robot((3.0, 1.0))
    inbox = session.timeline.panes[0].simulation.inbox
    assert inbox is not None
    assert (inbox.arrived[3] == -1).all() and (inbox.arrived[:, 3] == -1).all()
    states(session, 10)


def test_it_goes_as_a_run_does_while_nobody_comes_or_goes() -> None:
    conditions = replace(BAD, failures=(), joins=())
    session = begun(conditions)
    states(session, 30)
    pane = session.timeline.panes[0]
    one = Simulation(
        HALL,
        ControllerChoice("rapf").build(),
        STARTS,
        RobotProperties(communication_range=4.0).build_team(range(1, 5)),
        0.05,
        conditions=conditions,
    )
    record = one.run(1.5)
    assert pane.simulation.positions.tobytes() == record.positions[-1].tobytes()


def test_robots_are_pushed_out_of_where_an_obstacle_is_now() -> None:
    session = begun(None)
    states(session, 40)  # the cart has come to x = 3
    pane = session.timeline.panes[0]
    positions = pane.simulation.positions.copy()
    positions[0] = [3.0, 3.0]
    moved = pane.build_changed_simulation(Continuation(pane.setup, positions, np.zeros_like(positions)))
    assert np.hypot(*(moved.positions[0] - [3.0, 3.0])) > 0.49


def test_what_the_selected_robot_believes_is_drawn() -> None:
    session = begun()
    states(session, 12)
    pane = session.timeline.panes[0]
    scene = Scene.of(HALL, pane.setup.team, pane.simulation.observe_and_decide())
    painter = Painter(HALL, (400, 300), LIGHT, standard_layers(), 1.0)
    # what is drawn of all is what is: cells that neither overlap nor leave gaps
    assert scene.cells is not None
    assert sum(Polygon(cell).area for cell in scene.cells) == pytest.approx(HALL.area)
    plain = painter.frame(replace(scene, numbers=session.displayed.numbers))
    asked = replace(scene, numbers=session.displayed.numbers, selected=1)
    assert (painter.frame(asked) != plain).any(axis=-1).sum() > 200
    assert "as robot 2 believes" in painter.legend(asked)
    assert "as robot 2 believes" not in painter.legend(scene)


def test_a_saved_run_is_looked_at_again_and_gone_on_from(tmp_path: Path) -> None:
    team = RobotProperties(communication_range=4.0).build_team(range(1, 5))
    simulation = Simulation(HALL, ControllerChoice("rapf").build(), STARTS, team, 0.05, conditions=BAD)
    simulation.run(1.5).save(tmp_path)
    session = build_replay_session(load_saved_runs(tmp_path))
    pane = session.timeline.panes[0]
    told = []
    for when in (0.5, 0.9, 1.5):
        session.show_time(when)
        told.append(
            (session.displayed.get_setup(pane).numbers, tuple(session.displayed.get_setup(pane).failed))
        )
    assert told == [((1, 2, 4), ()), ((1, 4), (2,)), ((1, 3, 4), (2,))]
    session.show_time(0.6)
    session.branch()
    assert session.displayed.numbers == (1, 2, 4)
    states(session, 12)
    assert session.displayed.numbers == (1, 3, 4)
    assert pane.simulation.conditions == BAD.drop_team_changes()


@pytest.mark.slow
def test_where_obstacles_move_the_cost_is_told_as_elsewhere() -> None:
    for costs in (Costs(8, direct=True), Costs(8)):
        costs.set_environment(HALL)
        costs.ask(0, 0.0, STARTS)
        end = time.monotonic() + 60.0
        while not costs.poll() and time.monotonic() < end:
            time.sleep(0.005)
        assert costs.known[0].result.mean_distance == CoverageCost(HALL.at(0.0), 8)(STARTS).mean_distance
        assert costs.state == ""
        costs.close()


def test_messages_of_very_many_robots_are_too_much_for_the_past() -> None:
    SessionScenario(HALL, robots=MAX_COMMUNICATING_ROBOTS, conditions=BAD)
    SessionScenario(HALL, robots=500, conditions=Conditions(sensing_noise=0.1))
    with pytest.raises(ParameterError, match="robots: expected at most 100, got 101 where messages"):
        SessionScenario(HALL, robots=MAX_COMMUNICATING_ROBOTS + 1, conditions=BAD)
