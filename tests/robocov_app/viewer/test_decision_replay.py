from __future__ import annotations

import numpy as np
import pytest
from sample_sessions import LLOYD, RAPF, RPF, advance_session, start_session

from robocov_app.viewer.session import decision_replay as module
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.decision_replay import rebuild_snapshot

MINE = """
from dataclasses import dataclass
import numpy as np
from robocov.observation import Decision

@dataclass(frozen=True)
class Counting:
    def begin(self, region, team):
        return [0]

    def decide(self, seen, memory):
        memory[0] += 1
        return Decision(np.full_like(seen.positions, float(memory[0])), memory=memory)

@dataclass(frozen=True)
class Late:
    way: float = 0.0

    def begin(self, region, team):
        return None

    def decide(self, seen, memory):
        if seen.time < 0.1:
            return Decision(np.ones_like(seen.positions))
        if self.way == 0.0:
            raise SystemExit
        if self.way == 1.0:
            return None
        if self.way == 2.0:
            return Decision(np.ones(3))
        if self.way == 3.0:
            return Decision(np.full_like(seen.positions, np.nan))
        return Decision(np.ones_like(seen.positions), goals=np.ones(3))
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "mine.py"
    path.write_text(MINE)
    return path


@pytest.mark.parametrize("law", [RAPF, RPF, LLOYD])
def test_the_past_is_explained_as_it_was(law):
    session = start_session(law)
    pane = session.timeline.panes[0]
    seen = []
    for _ in range(20):
        seen.append(pane.simulation.observe_and_decide())
        session.playback.step()
    for k in (13, 2, 19, 0):
        told = rebuild_snapshot(session.timeline.history[k].states[0], session.timeline.history.get_time(k))
        assert told.time == pytest.approx(seen[k].time)
        for name in ("positions", "velocities", "obstacle_points"):
            np.testing.assert_array_equal(getattr(told.seen, name), getattr(seen[k].seen, name))
        assert told.decision.forces == pytest.approx(seen[k].decision.forces, abs=1e-9)
        assert set(told.decision.terms) == set(seen[k].decision.terms)


def test_a_controller_may_remember_what_it_did(file):
    session = advance_session(start_session(ControllerChoice(f"{file}:Counting")), 10)
    for k in (3, 8):
        for _ in range(3):
            told = rebuild_snapshot(
                session.timeline.history[k].states[0], session.timeline.history.get_time(k)
            )
            assert told.decision.forces[0, 0] == k + 1.0


@pytest.mark.parametrize("way", range(5))
def test_a_controller_that_fails_decided_nothing(file, way):
    session = advance_session(start_session(ControllerChoice(f"{file}:Late", {"way": float(way)})), 3)
    state = session.timeline.history[2].states[0]
    assert rebuild_snapshot(state, 0.0).decision.forces.tolist() == np.ones((3, 2)).tolist()
    told = rebuild_snapshot(state, 1.0)
    assert told.decision.forces.tolist() == np.zeros((3, 2)).tolist()
    assert told.decision.goals is None
    np.testing.assert_array_equal(told.positions, state.positions)


def test_panes_do_not_take_turns_in_preparing_the_map(monkeypatch):
    session = advance_session(start_session(RAPF, RPF, LLOYD, RAPF), 3)
    made = []
    real = module.RangeSensor
    monkeypatch.setattr(module, "RangeSensor", lambda pieces, movers=(): made.append(1) or real(pieces))
    module.get_sensor.cache_clear()
    session.show_time(0.0)
    for _ in range(5):
        for pane in session.timeline.panes:
            session.displayed.get_snapshot(pane)
    assert len(made) == 1
    module.get_sensor.cache_clear()
