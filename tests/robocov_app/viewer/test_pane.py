from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sample_sessions import HALL, LLOYD, RAPF, RPF

from robocov.environment import CircleObstacle, Environment
from robocov.errors import ParameterError, StartError
from robocov.observation import Decision
from robocov_app.viewer.session.controller_choice import ControllerChoice
from robocov_app.viewer.session.pane import (
    STEPS_BETWEEN_SENSED_POINTS,
    Continuation,
    Pane,
    resume_simulation,
    start_simulation,
)
from robocov_app.viewer.session.robot_properties import RobotProperties
from robocov_app.viewer.session.states import PaneSetup

DT = 1 / 60
PLACES = np.array([[1.0, 1.0], [1.6, 1.0], [1.0, 2.0]])
THEN = PaneSetup(HALL, RAPF, RobotProperties(), (1, 2, 3), {})

MINE = """
from dataclasses import dataclass
import numpy as np
from robocov.observation import Decision

@dataclass(frozen=True)
class Mine:
    push: float = 1.0

    def begin(self, region, team):
        return {"steps": 0, "ones": np.ones(3)}

    def decide(self, seen, memory):
        # changes what it remembers, which it had better not
        memory["steps"] += 1
        memory["ones"] *= 1.1
        forces = np.zeros_like(seen.positions)
        forces[:, 0] = self.push * np.sin(0.3 * memory["steps"]) * memory["ones"][0]
        return Decision(forces, memory=memory)

@dataclass(frozen=True)
class Broken:
    def begin(self, region, team):
        raise ValueError("not today")

    def decide(self, seen, memory):
        raise ValueError
"""


@pytest.fixture(scope="module")
def own(tmp_path_factory) -> ControllerChoice:
    """A law with a memory that it changes in place."""
    file = tmp_path_factory.mktemp("own") / "mine.py"
    file.write_text(MINE)
    return ControllerChoice(f"{file}:Mine")


def lane_in(setup, number=0) -> Pane:
    return Pane(number, setup, start_simulation(setup, PLACES, DT))


def lane_of(law=RAPF, steps=0, **changes) -> Pane:
    pane = lane_in(replace(THEN, controller=law, **changes), number=7)
    for _ in range(steps):
        pane.step()
    return pane


def test_a_lane_begins_at_its_starts():
    pane = lane_of()
    assert (pane.number, pane.controller, pane.numbers, pane.time) == (7, RAPF, (1, 2, 3), 0.0)
    assert (pane.get_row(1), pane.get_row(3), pane.get_row(9)) == (0, 2, None)
    np.testing.assert_array_equal(pane.starts, PLACES)
    np.testing.assert_array_equal(pane.trail.positions, [PLACES])
    assert len(pane.distance_curve) == len(pane.sensed) == 0
    with pytest.raises(StartError, match="outside the boundary"):
        start_simulation(THEN, PLACES - 5.0, DT)


def test_it_steps_as_the_simulation_does():
    pane = lane_of(steps=30)
    twin = start_simulation(THEN, PLACES, DT)
    for _ in range(30):
        twin.step()
    np.testing.assert_array_equal(pane.simulation.positions, twin.positions)
    assert pane.time == pytest.approx(0.5)
    assert pane.trail.times[-1] == pytest.approx(0.5)
    assert len(pane.trail) == 16
    forces = pane.simulation.observe_and_decide().decision.forces
    np.testing.assert_array_equal(forces, twin.observe_and_decide().decision.forces)


def test_what_is_sensed_is_noted_now_and_then():
    pane = lane_of(steps=1)
    assert len(pane.sensed) == 3
    np.testing.assert_array_equal(
        pane.sensed.until(0.0)[0],
        start_simulation(THEN, PLACES, DT).observe_and_decide().seen.obstacle_points,
    )
    slow = lane_of(steps=STEPS_BETWEEN_SENSED_POINTS)
    assert slow.sensed.until(1.0)[1].tolist() == [1, 2, 3]


@pytest.mark.parametrize("law", [RAPF, RPF, LLOYD])
def test_it_goes_on_from_a_state_as_it_did(law):
    pane = lane_of(law, steps=25)
    state, step = pane.build_state(), 25
    assert state.memory is None
    twin = resume_simulation(state, DT, step)
    assert twin.time == pane.time
    for _ in range(40):
        pane.step()
        twin.step()
    np.testing.assert_array_equal(twin.positions, pane.simulation.positions)
    np.testing.assert_array_equal(twin.velocities, pane.simulation.velocities)


def test_so_it_does_with_a_controller_that_changes_what_it_remembers(own):
    pane = lane_of(own, steps=25)
    state, step = pane.build_state(), 25
    assert state.memory["steps"] == 25
    for _ in range(40):
        pane.step()
    assert state.memory["steps"] == 25
    for _ in range(2):
        twin = resume_simulation(state, DT, step)
        for _ in range(40):
            twin.step()
        np.testing.assert_array_equal(twin.positions, pane.simulation.positions)


def changed(pane, **changes) -> Pane:
    """Change a pane's circumstances."""
    wanted = Continuation(replace(pane.setup, **changes))
    pane.adopt(wanted.setup, pane.build_changed_simulation(wanted))
    return pane


class TestChanges:
    def test_nothing_changes_until_it_is_taken(self):
        pane = lane_of(steps=10)
        before = pane.simulation
        simulation = pane.build_changed_simulation(Continuation(replace(pane.setup, controller=LLOYD)))
        assert pane.simulation is before
        assert pane.controller == RAPF
        assert simulation.time == before.time
        np.testing.assert_array_equal(simulation.positions, before.positions)

    def test_a_change_to_the_same_changes_nothing(self):
        pane, twin = lane_of(steps=30), lane_of(steps=30)
        changed(pane)
        for _ in range(30):
            pane.step()
            twin.step()
        np.testing.assert_array_equal(pane.simulation.positions, twin.simulation.positions)
        assert pane.time == pytest.approx(twin.time)

    def test_another_controller_takes_over_in_flight(self):
        pane = lane_of(steps=30)
        velocities = pane.simulation.velocities
        changed(pane, controller=LLOYD)
        np.testing.assert_array_equal(pane.simulation.velocities, velocities)
        assert pane.simulation.controller.name == "lloyd"

    def test_the_same_controller_goes_on_remembering(self, own):
        pane = changed(lane_of(own, steps=30), properties=RobotProperties(viscosity=1.0))
        assert pane.build_state().memory["steps"] == 30
        pane = changed(pane, controller=own.with_gain("push", 2.0))
        assert pane.build_state().memory["steps"] == 0

    def test_an_obstacle_pushes_robots_away(self):
        pane = lane_of(steps=30)
        far = pane.simulation.positions[1:]
        place = tuple(pane.simulation.positions[0].tolist())
        wider = replace(HALL, obstacles=(*HALL.obstacles, CircleObstacle(place, 0.15)))
        changed(pane, environment=wider)
        away = np.hypot(*(pane.simulation.positions[0] - place))
        assert 0.249 < away < 0.26
        assert pane.simulation.velocities[0].tolist() == [0.0, 0.0]
        np.testing.assert_array_equal(pane.simulation.positions[1:], far)
        assert pane.trail.positions[-1].tolist() == pane.simulation.positions.tolist()

    def test_what_cannot_be_changes_nothing(self, own):
        pane = lane_of(steps=30)
        before, rows = pane.simulation, len(pane.trail)
        narrow = Environment("narrow", ((0, 0), (0.3, 0), (0.3, 0.3), (0, 0.3)))
        broken = ControllerChoice(own.name.replace("Mine", "Broken"))
        for changes, error in (
            ({"environment": narrow}, StartError),
            ({"properties": RobotProperties(radius=1.5)}, StartError),
            ({"properties": RobotProperties(radius=-1.0)}, ParameterError),
            ({"controller": ControllerChoice("nobody")}, ParameterError),
            ({"controller": broken}, ParameterError),
        ):
            with pytest.raises(error):
                changed(pane, **changes)
            assert pane.simulation is before
            assert pane.setup.controller == RAPF
            assert len(pane.trail) == rows

    def test_trail_and_starts_follow_the_robots(self):
        pane = lane_of(steps=30)
        trail = pane.trail.positions.copy()
        wanted = Continuation(
            replace(pane.setup, numbers=(1, 3, 9)),
            np.vstack([pane.simulation.positions[[0, 2]], (5.0, 3.0)]),
            np.zeros((3, 2)),
        )
        pane.adopt(wanted.setup, pane.build_changed_simulation(wanted))
        np.testing.assert_array_equal(pane.trail.positions[:, :2], trail[:, [0, 2]])
        assert np.isnan(pane.trail.positions[:-1, 2]).all()
        assert pane.trail.positions[-1, 2].tolist() == [5.0, 3.0]
        assert pane.starts.tolist() == [*PLACES[[0, 2]].tolist(), [5.0, 3.0]]


def test_robots_that_failed_are_sensed_as_obstacles_are():
    failed = replace(THEN, failed={8: (1.3, 1.5)})
    pane = lane_in(failed)
    seen = pane.simulation.observe_and_decide().seen
    assert len(seen.positions) == seen.neighbors.count == 3
    away = np.hypot(*(seen.obstacle_points - (1.3, 1.5)).T)
    assert away == pytest.approx(0.1, abs=2e-3)
    assert isinstance(pane.simulation.observe_and_decide().decision, Decision)
