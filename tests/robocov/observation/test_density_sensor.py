"""Measurements of an unknown density: their range, their log, and what gets into another process."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import CONTROLLERS, Lloyd
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.observation import DensitySensor, Observations, RecordedDensitySensor
from robocov.simulation import Simulation
from robocov.team import Team

PEAK = Gaussians((Gaussian((2.0, 2.0), weight=4.0, sigma=1.0),), floor=1.0)
ROOM = Environment("room", ((0, 0), (8, 0), (8, 6), (0, 6))).with_density(PEAK)
STARTS = np.array([[2.0, 2.0], [6.0, 3.0]])


def observe(**conditions: float) -> Observations:
    team = Team.homogeneous(2, sensing_range=1.5)
    sensed = Conditions(density="sensed", **conditions)
    return Simulation(ROOM, Lloyd(), STARTS, team, conditions=sensed).observe()


def test_robots_measure_within_their_sensing_range() -> None:
    seen = observe()
    assert seen.density is None
    assert not seen.has_known_uniform_density
    points = STARTS + [1.5, 0.0]
    np.testing.assert_array_equal(seen.measure_density([0, 1], points), PEAK.evaluate(points))
    message = r"robot 2: expected a point within its sensing range of 1\.5 m, got a point at 1\.6 m"
    with pytest.raises(ParameterError, match=message):
        seen.measure_density(1, STARTS[1:] + [1.6, 0.0])
    with pytest.raises(ParameterError, match="got a point at nan m"):
        seen.measure_density(1, np.array([[np.nan, 3.0]]))


def test_a_known_density_can_be_measured_everywhere() -> None:
    seen = Simulation(ROOM, Lloyd(), STARTS).observe()
    assert seen.density is PEAK
    far_points = np.array([[7.0, 5.0]])
    np.testing.assert_array_equal(seen.measure_density(0, far_points), PEAK.evaluate(far_points))
    plain = Simulation(ROOM.with_density(None), Lloyd(), STARTS).observe()
    assert plain.has_known_uniform_density
    assert plain.measure_density(0, far_points).tolist() == [1.0]


def test_a_robot_measures_relative_to_its_true_position() -> None:
    seen = observe(position_noise=0.3)
    assert not np.array_equal(seen.positions, STARTS)
    np.testing.assert_allclose(seen.measure_density([0, 1], seen.positions), PEAK.evaluate(STARTS))


def test_a_pickled_sensor_repeats_its_measurements_without_the_density() -> None:
    sensor = observe().density_sensor
    assert sensor is not None
    values = sensor.measure([0, 1], STARTS)
    data = pickle.dumps(sensor)
    assert b"Gaussians" not in data
    repeated: DensitySensor = pickle.loads(data)
    np.testing.assert_array_equal(repeated.measure([0, 1], STARTS), values)
    with pytest.raises(
        ParameterError, match=r"robot 1: expected a point that it has measured, got \[6\.0, 3\.0\]"
    ):
        repeated.measure(0, STARTS[1:])


def test_a_recorded_sensor_of_one_robot_hides_the_measurements_of_others() -> None:
    sensor = observe().density_sensor
    assert sensor is not None
    values = sensor.measure([0, 1], STARTS)
    own = pickle.loads(pickle.dumps(RecordedDensitySensor(sensor.log, robot=0)))
    assert own.measure([0, 1], STARTS).tolist() == [values[0], 1.0]


def test_a_map_without_a_density_is_measured_as_1() -> None:
    conditions = Conditions(density="sensed")
    seen = Simulation(ROOM.with_density(None), Lloyd(), STARTS, conditions=conditions).observe()
    assert seen.measure_density([0, 1], STARTS).tolist() == [1.0, 1.0]


@pytest.mark.parametrize("name", ["lloyd", "rapf", "geodesic-lloyd", "local-search"])
def test_controllers_that_do_not_measure_decide_as_without_a_density(name: str) -> None:
    """This includes controllers that know the map: theirs has no density."""
    hidden = Simulation(ROOM, CONTROLLERS[name](), STARTS, conditions=Conditions(density="sensed"))
    plain = Simulation(ROOM.with_density(None), CONTROLLERS[name](), STARTS)
    hidden.run(1.0)
    plain.run(1.0)
    np.testing.assert_array_equal(hidden.positions, plain.positions)


def test_a_copy_with_another_density_still_hides_it() -> None:
    simulation = Simulation(ROOM, Lloyd(), STARTS, conditions=Conditions(density="sensed"))
    other = Gaussians((Gaussian((6.0, 3.0), weight=8.0, sigma=1.0),), floor=1.0)
    seen = simulation.with_density(ROOM.with_density(other)).observe()
    assert seen.density is None
    assert seen.measure_density(1, STARTS[1:]).tolist() == [9.0]
