"""A pane: one team under one controller, which can be resumed and changed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sample_sessions import HALL, LLOYD, RAPF, RPF

from robocov.environment import CircleObstacle, Environment
from robocov.errors import ParameterError, StartError
from robocov_app.viewer.session.pane import (
    STEPS_BETWEEN_SENSED_POINTS,
    Continuation,
    Pane,
    resume_simulation,
    start_simulation,
)
from robocov_app.viewer.session.past.states import PaneSetup
from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
from robocov_app.viewer.session.setup.robot_properties import RobotProperties

DT = 1 / 60
PANE_NUMBER = 7
STARTS = np.array([[1.0, 1.0], [1.6, 1.0], [1.0, 2.0]])
SETUP = PaneSetup(HALL, RAPF, RobotProperties(), (1, 2, 3), {})

USER_CONTROLLERS = """
from dataclasses import dataclass
import numpy as np
from robocov.observation import Decision

@dataclass(frozen=True)
class ChangesMemoryInPlace:
    push: float = 1.0

    def begin(self, region, team):
        return {"steps": 0, "ones": np.ones(3)}

    def decide(self, seen, memory):
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
def controller_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("controllers") / "user_controllers.py"
    path.write_text(USER_CONTROLLERS)
    return path


@pytest.fixture(scope="module")
def controller_with_memory(controller_file) -> ControllerChoice:
    return ControllerChoice(f"{controller_file}:ChangesMemoryInPlace")


def build_pane(controller=RAPF, steps=0, **changes) -> Pane:
    setup = replace(SETUP, controller=controller, **changes)
    pane = Pane(PANE_NUMBER, setup, start_simulation(setup, STARTS, DT))
    for _ in range(steps):
        pane.step()
    return pane


def change_pane(pane, **changes) -> Pane:
    continuation = Continuation(replace(pane.setup, **changes))
    pane.adopt(continuation.setup, pane.build_changed_simulation(continuation))
    return pane


def test_a_pane_starts_at_the_starting_positions():
    pane = build_pane()
    assert (pane.number, pane.controller, pane.numbers, pane.time) == (PANE_NUMBER, RAPF, (1, 2, 3), 0.0)
    assert (pane.get_row(1), pane.get_row(3), pane.get_row(9)) == (0, 2, None)
    np.testing.assert_array_equal(pane.starts, STARTS)
    np.testing.assert_array_equal(pane.trail.positions, [STARTS])
    assert len(pane.distance_curve) == len(pane.sensed) == 0


def test_starting_positions_outside_the_map_are_rejected():
    with pytest.raises(StartError, match="outside the boundary"):
        start_simulation(SETUP, STARTS - 5.0, DT)


def test_a_pane_steps_like_its_simulation():
    pane = build_pane(steps=30)
    simulation = start_simulation(SETUP, STARTS, DT)
    for _ in range(30):
        simulation.step()
    np.testing.assert_array_equal(pane.simulation.positions, simulation.positions)
    assert pane.time == pytest.approx(0.5)
    assert pane.trail.times[-1] == pytest.approx(0.5)
    assert len(pane.trail) == 16
    forces = pane.simulation.observe_and_decide().decision.forces
    np.testing.assert_array_equal(forces, simulation.observe_and_decide().decision.forces)


def test_sensed_points_are_noted_at_some_steps():
    pane = build_pane(steps=1)
    assert len(pane.sensed) == 3
    points = start_simulation(SETUP, STARTS, DT).observe_and_decide().seen.obstacle_points
    np.testing.assert_array_equal(pane.sensed.get_until(0.0)[0], points)
    later = build_pane(steps=STEPS_BETWEEN_SENSED_POINTS)
    assert later.sensed.get_until(1.0)[1].tolist() == [1, 2, 3]


@pytest.mark.parametrize("controller", [RAPF, RPF, LLOYD])
def test_a_resumed_simulation_is_the_same_bit_for_bit(controller):
    pane = build_pane(controller, steps=25)
    state = pane.build_state()
    assert state.memory is None
    resumed = resume_simulation(state, DT, 25)
    assert resumed.time == pane.time
    for _ in range(40):
        pane.step()
        resumed.step()
    np.testing.assert_array_equal(resumed.positions, pane.simulation.positions)
    np.testing.assert_array_equal(resumed.velocities, pane.simulation.velocities)


def test_a_resumed_controller_may_change_its_memory_in_place(controller_with_memory):
    pane = build_pane(controller_with_memory, steps=25)
    state = pane.build_state()
    assert state.memory["steps"] == 25
    for _ in range(40):
        pane.step()
    assert state.memory["steps"] == 25
    for _ in range(2):
        resumed = resume_simulation(state, DT, 25)
        for _ in range(40):
            resumed.step()
        np.testing.assert_array_equal(resumed.positions, pane.simulation.positions)


def test_a_changed_simulation_leaves_the_pane_as_it_is():
    pane = build_pane(steps=10)
    before = pane.simulation
    simulation = pane.build_changed_simulation(Continuation(replace(pane.setup, controller=LLOYD)))
    assert pane.simulation is before
    assert pane.controller == RAPF
    assert simulation.time == before.time
    np.testing.assert_array_equal(simulation.positions, before.positions)


def test_a_change_to_the_same_setup_changes_nothing():
    pane = build_pane(steps=30)
    unchanged = build_pane(steps=30)
    change_pane(pane)
    for _ in range(30):
        pane.step()
        unchanged.step()
    np.testing.assert_array_equal(pane.simulation.positions, unchanged.simulation.positions)
    assert pane.time == pytest.approx(unchanged.time)


def test_another_controller_keeps_the_velocities():
    pane = build_pane(steps=30)
    velocities = pane.simulation.velocities
    change_pane(pane, controller=LLOYD)
    np.testing.assert_array_equal(pane.simulation.velocities, velocities)
    assert pane.simulation.controller.name == "lloyd"


def test_a_controller_keeps_its_memory_unless_its_gains_change(controller_with_memory):
    pane = build_pane(controller_with_memory, steps=30)
    change_pane(pane, properties=RobotProperties(viscosity=1.0))
    assert pane.build_state().memory["steps"] == 30
    change_pane(pane, controller=controller_with_memory.with_gain("push", 2.0))
    assert pane.build_state().memory["steps"] == 0


def test_an_obstacle_pushes_robots_away():
    pane = build_pane(steps=30)
    others = pane.simulation.positions[1:]
    center = tuple(pane.simulation.positions[0].tolist())
    environment = replace(HALL, obstacles=(*HALL.obstacles, CircleObstacle(center, 0.15)))
    change_pane(pane, environment=environment)
    distance = np.hypot(*(pane.simulation.positions[0] - center))
    assert 0.249 < distance < 0.26
    assert pane.simulation.velocities[0].tolist() == [0.0, 0.0]
    np.testing.assert_array_equal(pane.simulation.positions[1:], others)
    assert pane.trail.positions[-1].tolist() == pane.simulation.positions.tolist()


def test_a_change_that_is_not_possible_changes_nothing(controller_file):
    pane = build_pane(steps=30)
    simulation = pane.simulation
    trail_rows = len(pane.trail)
    narrow = Environment("narrow", ((0, 0), (0.3, 0), (0.3, 0.3), (0, 0.3)))
    for changes, error in (
        ({"environment": narrow}, StartError),
        ({"properties": RobotProperties(radius=1.5)}, StartError),
        ({"properties": RobotProperties(radius=-1.0)}, ParameterError),
        ({"controller": ControllerChoice("unknown")}, ParameterError),
        ({"controller": ControllerChoice(f"{controller_file}:Broken")}, ParameterError),
    ):
        with pytest.raises(error):
            change_pane(pane, **changes)
        assert pane.simulation is simulation
        assert pane.setup.controller == RAPF
        assert len(pane.trail) == trail_rows


def test_trail_and_starts_follow_the_robots():
    pane = build_pane(steps=30)
    trail = pane.trail.positions.copy()
    continuation = Continuation(
        replace(pane.setup, numbers=(1, 3, 9)),
        np.vstack([pane.simulation.positions[[0, 2]], (5.0, 3.0)]),
        np.zeros((3, 2)),
    )
    pane.adopt(continuation.setup, pane.build_changed_simulation(continuation))
    np.testing.assert_array_equal(pane.trail.positions[:, :2], trail[:, [0, 2]])
    assert np.isnan(pane.trail.positions[:-1, 2]).all()
    assert pane.trail.positions[-1, 2].tolist() == [5.0, 3.0]
    assert pane.starts.tolist() == [*STARTS[[0, 2]].tolist(), [5.0, 3.0]]


def test_failed_robots_are_sensed_like_obstacles():
    pane = build_pane(failed={8: (1.3, 1.5)})
    seen = pane.simulation.observe_and_decide().seen
    assert len(seen.positions) == seen.neighbors.robot_count == 3
    distances = np.linalg.norm(seen.obstacle_points - (1.3, 1.5), axis=1)
    assert distances == pytest.approx(0.1, abs=2e-3)
