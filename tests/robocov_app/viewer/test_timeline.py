"""The timeline: any state of a session is built before it replaces the present."""

from __future__ import annotations

import json

import numpy as np
import pytest
from sample_sessions import (
    LLOYD,
    RAPF,
    advance_session,
    advance_with_costs,
    describe_state,
    get_positions,
    start_session,
)

from robocov.errors import InputError, ParameterError, StartError
from robocov_app.viewer.session import playback
from robocov_app.viewer.session.document import SessionDocument
from robocov_app.viewer.session.editing.edits import FailRobot, Restart
from robocov_app.viewer.session.files.session_file import build_session_content, format_session, parse_session
from robocov_app.viewer.session.pane_group import PaneGroup
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties
from robocov_app.viewer.session.setup.scenario import SessionScenario
from robocov_app.viewer.session.timeline import Timeline

FAILING = """
from dataclasses import dataclass
import numpy as np
from robocov.observation import Decision

@dataclass(frozen=True)
class Failing:
    def begin(self, region, team):
        return None

    def decide(self, seen, memory):
        if len(seen.positions) == 2:
            raise ZeroDivisionError("two robots")
        return Decision(np.zeros_like(seen.positions))
"""


def build_branched_session() -> Session:
    """Return a session with two branches, whose present is on the second one."""
    session = advance_session(start_session(RAPF, LLOYD), 10)
    session.fail_robot(2)
    advance_with_costs(session, 20)
    session.undo()
    session.add_robot((3.0, 3.0))
    advance_with_costs(session, 15)
    return session


def forget_cached_states(session: Session) -> None:
    """Forget all states that the document keeps for other branches."""
    for node in session.timeline.document.nodes:
        node.cached_states = []


@pytest.mark.parametrize("is_cached", [True, False])
def test_every_step_of_every_branch_can_be_reached_from_every_other(is_cached: bool) -> None:
    session = build_branched_session()
    timeline = session.timeline
    places = [(timeline.document.nodes[0], 4), (timeline.document.nodes[1], 25)]
    places += [(timeline.document.nodes[2], 12), (timeline.document.nodes[1], 10)]
    expected = {}
    for node, step in places:
        timeline.seek(node, step)
        expected[node.number, step] = get_positions(session)
    for start_node, start_step in places:
        for node, step in places:
            timeline.seek(start_node, start_step)
            if not is_cached:
                forget_cached_states(session)
            timeline.seek(node, step)
            assert timeline.is_live
            assert (timeline.head, timeline.step) == (node, step)
            assert timeline.history.steps == list(range(step + 1))
            for positions, before in zip(get_positions(session), expected[node.number, step], strict=True):
                np.testing.assert_array_equal(positions, before)


def test_an_edit_that_is_not_possible_leaves_the_timeline_as_it_was() -> None:
    session = build_branched_session()
    timeline = session.timeline
    session.show_time(0.1)
    before = describe_state(session)

    def fail_unknown_robot(run: PaneGroup) -> None:
        run.apply(FailRobot(77))

    with pytest.raises(ParameterError, match="there is no robot 77"):
        timeline.seek(timeline.document.nodes[1], 15, edit=fail_unknown_robot)
    assert describe_state(session) == before
    assert not timeline.is_seeking


def test_an_error_on_the_way_leaves_the_timeline_as_it_was() -> None:
    session = build_branched_session()
    timeline = session.timeline
    forget_cached_states(session)
    timeline.document.nodes[1].edits[:] = [FailRobot(77, step=10)]
    before = describe_state(session)
    with pytest.raises(InputError, match=r"edits\[1\], “robot 2 failed”: there is no robot 77"):
        timeline.seek(timeline.document.nodes[1], 20)
    assert describe_state(session) == before
    assert len(timeline.document.nodes) == 3


def test_a_controller_that_raises_anything_on_the_way_leaves_the_timeline_as_it_was(tmp_path) -> None:
    file = tmp_path / "failing.py"
    file.write_text(FAILING)
    session = build_branched_session()
    timeline = session.timeline
    forget_cached_states(session)
    broken = ControllerChoice(f"{file}:Failing")
    before = describe_state(session)
    controllers = (broken,)
    scenario = SessionScenario(session.displayed.environment, controllers, robots=3)
    node = timeline.document.build_node(timeline.head, timeline.step, "begin", "started", Restart(scenario))
    node.edits.append(FailRobot(1, step=5))
    with pytest.raises(ParameterError, match="two robots"):
        timeline.seek(node, 20)
    assert describe_state(session) == before
    assert node not in timeline.document.nodes


def test_a_run_that_cannot_start_is_not_added_to_the_document() -> None:
    timeline = build_branched_session().timeline
    crowded = SessionScenario(timeline.scenario.environment, robots=500)
    node = timeline.document.build_node(timeline.head, timeline.step, "begin", "started", Restart(crowded))
    present = (timeline.head, timeline.run, timeline.history)
    with pytest.raises(StartError):
        timeline.seek(node, 0)
    assert (timeline.head, timeline.run, timeline.history) == present
    assert node not in timeline.document.nodes


def test_the_present_stays_until_a_long_seek_is_complete() -> None:
    session = build_branched_session()
    timeline = session.timeline
    forget_cached_states(session)
    run = timeline.run
    timeline.seek(timeline.document.nodes[1], seconds=0.0)
    assert timeline.is_seeking
    assert timeline.run is run
    calls = 0
    while timeline.is_seeking:
        assert timeline.run is run
        timeline.continue_seek(0.0)
        calls += 1
    assert calls > 10
    assert timeline.run is not run
    assert timeline.head.number == 1


def test_an_edit_completes_a_seek_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(playback, "SEEK_SLICE_S", 0.0)
    session = build_branched_session()
    session.playback.clock.budget = 0.008
    forget_cached_states(session)
    session.seek(session.timeline.document.nodes[1])
    assert session.timeline.is_seeking
    session.remove_robot(1)
    assert not session.timeline.is_seeking
    assert session.timeline.head.parent is session.timeline.document.nodes[1]
    assert session.displayed.numbers == (3,)


def test_a_timeline_starts_with_the_first_node() -> None:
    document = SessionDocument.start(start_session().timeline.scenario)
    timeline = Timeline(document)
    assert (timeline.head, timeline.step) == (document.nodes[0], 0)
    assert timeline.is_live
    assert timeline.is_reproducible
    assert not timeline.is_at_record_end


def test_unlimited_ranges_stay_unlimited_in_a_file() -> None:
    properties = RobotProperties(sensing_range=np.inf, communication_range=np.inf)
    session = advance_session(start_session(RAPF, properties=properties), 30)
    timeline = session.timeline
    text = format_session(build_session_content(timeline.document, timeline.head, timeline.step, {}))
    opened = Session.open(parse_session(json.loads(text), "unlimited"))
    assert opened.timeline.scenario.properties == properties
    np.testing.assert_array_equal(get_positions(opened)[0], get_positions(session)[0])
