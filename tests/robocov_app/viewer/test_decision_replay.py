"""Observations and decisions that are recomputed from recorded states."""

from __future__ import annotations

import numpy as np
import pytest
from sample_sessions import LLOYD, RAPF, RPF, advance_session, start_session

from robocov_app.viewer.session.past import decision_replay as module
from robocov_app.viewer.session.past.decision_replay import rebuild_snapshot
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice

USER_CONTROLLERS = """
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
class Failing:
    mistake: float = 0.0

    def begin(self, region, team):
        return None

    def decide(self, seen, memory):
        if seen.time < 0.1:
            return Decision(np.ones_like(seen.positions))
        if self.mistake == 0.0:
            raise SystemExit
        if self.mistake == 1.0:
            return None
        if self.mistake == 2.0:
            return Decision(np.ones(3))
        if self.mistake == 3.0:
            return Decision(np.full_like(seen.positions, np.nan))
        return Decision(np.ones_like(seen.positions), goals=np.ones(3))
"""


@pytest.fixture(scope="module")
def controller_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("controllers") / "user_controllers.py"
    path.write_text(USER_CONTROLLERS)
    return path


@pytest.mark.parametrize("controller", [RAPF, RPF, LLOYD])
def test_snapshots_are_recomputed(controller):
    session = start_session(controller)
    pane = session.timeline.panes[0]
    snapshots = []
    for _ in range(20):
        snapshots.append(pane.simulation.observe_and_decide())
        session.playback.step()
    history = session.timeline.history
    for index in (13, 2, 19, 0):
        expected = snapshots[index]
        snapshot = rebuild_snapshot(history[index].states[0], history.get_time(index))
        assert snapshot.time == pytest.approx(expected.time)
        for name in ("positions", "velocities", "obstacle_points"):
            np.testing.assert_array_equal(getattr(snapshot.seen, name), getattr(expected.seen, name))
        assert snapshot.decision.forces == pytest.approx(expected.decision.forces, abs=1e-9)
        assert set(snapshot.decision.terms) == set(expected.decision.terms)


def test_the_memory_of_a_controller_is_that_of_the_state(controller_file):
    session = advance_session(start_session(ControllerChoice(f"{controller_file}:Counting")), 10)
    history = session.timeline.history
    for index in (3, 8):
        for _ in range(3):
            snapshot = rebuild_snapshot(history[index].states[0], history.get_time(index))
            assert snapshot.decision.forces[0, 0] == index + 1.0


@pytest.mark.parametrize("mistake", range(5))
def test_a_controller_that_fails_has_no_forces(controller_file, mistake):
    controller = ControllerChoice(f"{controller_file}:Failing", {"mistake": float(mistake)})
    session = advance_session(start_session(controller), 3)
    state = session.timeline.history[2].states[0]
    assert rebuild_snapshot(state, 0.0).decision.forces.tolist() == np.ones((3, 2)).tolist()
    snapshot = rebuild_snapshot(state, 1.0)
    assert snapshot.decision.forces.tolist() == np.zeros((3, 2)).tolist()
    assert snapshot.decision.goals is None
    np.testing.assert_array_equal(snapshot.positions, state.positions)


def test_panes_on_the_same_map_share_a_sensor(monkeypatch):
    session = advance_session(start_session(RAPF, RPF, LLOYD, RAPF), 3)
    sensors = []
    build_sensor = module.RangeSensor

    def count_sensor(pieces, moving_obstacles=()):
        sensors.append(pieces)
        return build_sensor(pieces, moving_obstacles)

    monkeypatch.setattr(module, "RangeSensor", count_sensor)
    module._build_sensor.cache_clear()
    session.show_time(0.0)
    for _ in range(5):
        for pane in session.timeline.panes:
            session.displayed.get_snapshot(pane)
    assert len(sensors) == 1
    module._build_sensor.cache_clear()
