"""Range scans, and the settings that controllers request."""

from __future__ import annotations

import numpy as np
import pytest

from robocov.controllers import OwnView
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.observation import Decision, Observations, Scanning, compute_ray_directions
from robocov.sensor import RangeSensor
from robocov.simulation import Simulation
from robocov.world.obstacle_pieces import build_solid_pieces


class ScanCollector:
    """Stands still, and remembers the times of its scans."""

    name = "scan-collector"
    label = "Scan collector"
    summary = "stands still"
    scanning = Scanning(rays=8, period=0.1)

    def begin(self, region: object, team: object) -> tuple[float, ...]:
        return ()

    def decide(self, seen: Observations, memory: tuple[float, ...]) -> Decision:
        if seen.scans is not None:
            assert seen.scans.distances.shape == seen.scans.is_hit.shape == (len(seen.positions), 8)
            assert not seen.scans.distances.flags.writeable
            memory = (*memory, round(seen.time, 9))
        return Decision(np.zeros_like(seen.positions), memory=memory)


class IndividualWithScanning:
    """Stands still; it requests scans, which `force` does not receive."""

    scanning = Scanning(rays=8, period=0.1)

    def force(self, own: OwnView) -> list[float]:
        return [0.0, 0.0]


def test_an_individual_controller_cannot_request_scans(cluttered: Environment) -> None:
    message = r"'IndividualWithScanning': scanning: expected none in a controller with force\(own\)"
    with pytest.raises(ParameterError, match=message):
        Simulation(cluttered, IndividualWithScanning(), [[1.0, 2.0]])


def test_scans_arrive_with_the_requested_period(cluttered: Environment) -> None:
    simulation = Simulation(cluttered, ScanCollector(), [[1.0, 2.0], [1.5, 2.0]], dt=0.02)
    for _ in range(11):
        simulation.step()
    assert simulation.memory == (0.0, 0.1, 0.2)
    copy = simulation.copy()
    for continued in (simulation, copy):
        for _ in range(5):
            continued.step()
        assert continued.memory == (0.0, 0.1, 0.2, 0.3)


def test_a_team_scan_equals_the_scans_of_single_robots(cluttered: Environment) -> None:
    sensor = RangeSensor(build_solid_pieces(cluttered))
    positions = np.array([[1.0, 2.0], [1.5, 2.2], [0.6, 4.0]])
    ranges = np.array([0.7, 2.0, np.inf])
    distances, is_hit = sensor.scan(positions, 36, ranges)
    for i in range(3):
        own_distances, ends = sensor.scan_from(positions[i], 36, float(ranges[i]))
        np.testing.assert_array_equal(own_distances, distances[i])
        expected_ends = positions[i] + distances[i][:, None] * compute_ray_directions(36)
        np.testing.assert_allclose(ends, expected_ends, atol=1e-9)
        np.testing.assert_array_equal(is_hit[i], distances[i] < min(ranges[i], 1e6))
    assert is_hit[2].all()
    assert not is_hit[0].all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rays": 0}, "scanning.rays: expected a whole number from 1 to 3600"),
        ({"rays": 2.5}, "scanning.rays: expected a whole number from 1 to 3600, got 2.5"),
        ({"rays": True}, "scanning.rays: expected a whole number from 1 to 3600, got True"),
        ({"period": -1.0}, "scanning.period: expected a number from 0 to"),
        ({"period": float("nan")}, "scanning.period: expected a number from 0 to"),
    ],
)
def test_invalid_scan_settings_are_rejected(values: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Scanning(**values)  # type: ignore[arg-type]


def test_periods_are_rounded_to_whole_steps() -> None:
    assert Scanning(period=0.5).count_steps(1 / 60) == 30
    assert Scanning(period=0.0).count_steps(0.02) == 1
    # The nearest number of control periods, not the next lower one.
    assert Scanning(period=0.29).count_steps(0.1) == 3
    np.testing.assert_allclose(compute_ray_directions(4), [[1, 0], [0, 1], [-1, 0], [0, -1]], atol=1e-15)
