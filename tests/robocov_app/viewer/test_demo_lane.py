from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from touched_run import HALL, LLOYD, RAPF, RPF

from robocov.environment import CircleObstacle, Environment
from robocov.errors import ParameterError, StartError
from robocov.observation import Decision
from robocov_app.viewer.session.history import Circumstances
from robocov_app.viewer.session.pane import SENSED_EVERY, Lane, Wanted, begun, resumed
from robocov_app.viewer.session.scenario import Law, Limits

DT = 1 / 60
PLACES = np.array([[1.0, 1.0], [1.6, 1.0], [1.0, 2.0]])
THEN = Circumstances(HALL, RAPF, Limits(), (1, 2, 3), {})

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
def own(tmp_path_factory) -> Law:
    """A law with a memory that it changes in place."""
    file = tmp_path_factory.mktemp("own") / "mine.py"
    file.write_text(MINE)
    return Law(f"{file}:Mine")


def lane_in(circumstances, number=0) -> Lane:
    return Lane(number, circumstances, begun(circumstances, PLACES, DT))


def lane_of(law=RAPF, steps=0, **changes) -> Lane:
    lane = lane_in(replace(THEN, law=law, **changes), number=7)
    for _ in range(steps):
        lane.step()
    return lane


def test_a_lane_begins_at_its_starts():
    lane = lane_of()
    assert (lane.number, lane.law, lane.numbers, lane.time) == (7, RAPF, (1, 2, 3), 0.0)
    assert (lane.row(1), lane.row(3), lane.row(9)) == (0, 2, None)
    np.testing.assert_array_equal(lane.starts, PLACES)
    np.testing.assert_array_equal(lane.trail.positions, [PLACES])
    assert len(lane.curve) == len(lane.sensed) == 0
    with pytest.raises(StartError, match="outside the boundary"):
        begun(THEN, PLACES - 5.0, DT)


def test_it_steps_as_the_simulation_does():
    lane = lane_of(steps=30)
    twin = begun(THEN, PLACES, DT)
    for _ in range(30):
        twin.step()
    np.testing.assert_array_equal(lane.simulation.positions, twin.positions)
    assert lane.time == pytest.approx(0.5)
    assert lane.trail.time[-1] == pytest.approx(0.5)
    assert len(lane.trail) == 16
    np.testing.assert_array_equal(lane.decide().forces, twin.snapshot.decision.forces)


def test_what_is_sensed_is_noted_now_and_then():
    lane = lane_of(steps=1)
    assert len(lane.sensed) == 3
    np.testing.assert_array_equal(
        lane.sensed.until(0.0)[0],
        begun(THEN, PLACES, DT).snapshot.seen.obstacle_points,
    )
    slow = lane_of(steps=SENSED_EVERY)
    assert slow.sensed.until(1.0)[1].tolist() == [1, 2, 3]


@pytest.mark.parametrize("law", [RAPF, RPF, LLOYD])
def test_it_goes_on_from_a_state_as_it_did(law):
    lane = lane_of(law, steps=25)
    state, step = lane.state(), 25
    assert state.memory is None
    twin = resumed(state, DT, step)
    assert twin.time == lane.time
    for _ in range(40):
        lane.step()
        twin.step()
    np.testing.assert_array_equal(twin.positions, lane.simulation.positions)
    np.testing.assert_array_equal(twin.velocities, lane.simulation.velocities)


def test_so_it_does_with_a_controller_that_changes_what_it_remembers(own):
    lane = lane_of(own, steps=25)
    state, step = lane.state(), 25
    assert state.memory["steps"] == 25
    for _ in range(40):
        lane.step()
    assert state.memory["steps"] == 25
    for _ in range(2):
        twin = resumed(state, DT, step)
        for _ in range(40):
            twin.step()
        np.testing.assert_array_equal(twin.positions, lane.simulation.positions)


def changed(lane, **changes) -> Lane:
    """Change a lane's circumstances."""
    wanted = Wanted(replace(lane.circumstances, **changes))
    lane.take(wanted.circumstances, lane.changed(wanted))
    return lane


class TestChanges:
    def test_nothing_changes_until_it_is_taken(self):
        lane = lane_of(steps=10)
        before = lane.simulation
        simulation = lane.changed(Wanted(replace(lane.circumstances, law=LLOYD)))
        assert lane.simulation is before
        assert lane.law == RAPF
        assert simulation.time == before.time
        np.testing.assert_array_equal(simulation.positions, before.positions)

    def test_a_change_to_the_same_changes_nothing(self):
        lane, twin = lane_of(steps=30), lane_of(steps=30)
        changed(lane)
        for _ in range(30):
            lane.step()
            twin.step()
        np.testing.assert_array_equal(lane.simulation.positions, twin.simulation.positions)
        assert lane.time == pytest.approx(twin.time)

    def test_another_controller_takes_over_in_flight(self):
        lane = lane_of(steps=30)
        velocities = lane.simulation.velocities
        changed(lane, law=LLOYD)
        np.testing.assert_array_equal(lane.simulation.velocities, velocities)
        assert lane.simulation.controller.name == "lloyd"

    def test_the_same_controller_goes_on_remembering(self, own):
        lane = changed(lane_of(own, steps=30), limits=Limits(viscosity=1.0))
        assert lane.state().memory["steps"] == 30
        lane = changed(lane, law=own.with_gain("push", 2.0))
        assert lane.state().memory["steps"] == 0

    def test_an_obstacle_pushes_robots_away(self):
        lane = lane_of(steps=30)
        far = lane.simulation.positions[1:]
        place = tuple(lane.simulation.positions[0].tolist())
        wider = replace(HALL, obstacles=(*HALL.obstacles, CircleObstacle(place, 0.15)))
        changed(lane, environment=wider)
        away = np.hypot(*(lane.simulation.positions[0] - place))
        assert 0.249 < away < 0.26
        assert lane.simulation.velocities[0].tolist() == [0.0, 0.0]
        np.testing.assert_array_equal(lane.simulation.positions[1:], far)
        assert lane.trail.positions[-1].tolist() == lane.simulation.positions.tolist()

    def test_what_cannot_be_changes_nothing(self, own):
        lane = lane_of(steps=30)
        before, rows = lane.simulation, len(lane.trail)
        narrow = Environment("narrow", ((0, 0), (0.3, 0), (0.3, 0.3), (0, 0.3)))
        broken = Law(own.name.replace("Mine", "Broken"))
        for changes, error in (
            ({"environment": narrow}, StartError),
            ({"limits": Limits(radius=1.5)}, StartError),
            ({"limits": Limits(radius=-1.0)}, ParameterError),
            ({"law": Law("nobody")}, ParameterError),
            ({"law": broken}, ParameterError),
        ):
            with pytest.raises(error):
                changed(lane, **changes)
            assert lane.simulation is before
            assert lane.circumstances.law == RAPF
            assert len(lane.trail) == rows

    def test_trail_and_starts_follow_the_robots(self):
        lane = lane_of(steps=30)
        trail = lane.trail.positions.copy()
        wanted = Wanted(
            replace(lane.circumstances, numbers=(1, 3, 9)),
            np.vstack([lane.simulation.positions[[0, 2]], (5.0, 3.0)]),
            np.zeros((3, 2)),
        )
        lane.take(wanted.circumstances, lane.changed(wanted))
        np.testing.assert_array_equal(lane.trail.positions[:, :2], trail[:, [0, 2]])
        assert np.isnan(lane.trail.positions[:-1, 2]).all()
        assert lane.trail.positions[-1, 2].tolist() == [5.0, 3.0]
        assert lane.starts.tolist() == [*PLACES[[0, 2]].tolist(), [5.0, 3.0]]


def test_robots_that_failed_are_sensed_as_obstacles_are():
    failed = replace(THEN, failed={8: (1.3, 1.5)})
    lane = lane_in(failed)
    seen = lane.simulation.snapshot.seen
    assert len(seen.positions) == seen.neighbours.count == 3
    away = np.hypot(*(seen.obstacle_points - (1.3, 1.5)).T)
    assert away == pytest.approx(0.1, abs=2e-3)
    assert isinstance(lane.decide(), Decision)
