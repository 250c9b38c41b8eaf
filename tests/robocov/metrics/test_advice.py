"""Advice on runs whose robots tremble or zigzag."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from robocov.controllers import Lloyd, Rapf
from robocov.environment import Environment, PolygonObstacle
from robocov.mapfile import load_map
from robocov.metrics import compute_clearances
from robocov.metrics.advice import advise, count_zigzags, find_trembling_robots
from robocov.record import Record
from robocov.simulation import Simulation
from robocov.team import Team

HALL = Environment("hall", ((0, 0), (6, 0), (6, 4), (0, 4)))
CORRIDORS = Environment(
    "corridors",
    ((0, 0), (6.2, 0), (6.2, 6.2), (0, 6.2)),
    (PolygonObstacle(((0.6, 0.6), (5.6, 0.6), (5.6, 5.6), (0.6, 5.6))),),
)


def simulate(
    environment: Environment, controller: object, dt: float, duration: float, **limits: float
) -> Record:
    team = Team.homogeneous(3, **limits)
    starts = environment.start("uniform").sample(3, seed=0)
    return Simulation(environment, controller, starts, team, dt).run(duration)


def simulate_rooms(dt: float) -> Record:
    rooms = load_map("rooms")
    return Simulation(rooms, Rapf(), rooms.start().sample(6, seed=0), dt=dt).run(40.0)


def find_advice(record: Record) -> list[str]:
    return advise(record, compute_clearances(record))


def test_too_long_control_periods_are_reported() -> None:
    (advice,) = find_advice(simulate_rooms(0.25))
    assert "The team trembles: " in advice
    assert "cm a step" in advice
    assert "the control period of 0.25 s is too long" in advice
    assert "--dt" in advice
    assert find_advice(simulate_rooms(0.05)) == []


def test_zigzag_in_a_corridor_is_reported_and_ends_with_more_acceleration() -> None:
    record = simulate(CORRIDORS, Rapf(), 1 / 60, 20.0)
    (advice,) = find_advice(record)
    assert advice.startswith("Zigzag in a narrow passage: ")
    assert "than 2 m/s²" in advice
    assert find_advice(simulate(CORRIDORS, Rapf(), 1 / 60, 20.0, max_acceleration=5.0)) == []


@pytest.mark.parametrize("controller", [Rapf(), Lloyd()])
def test_ordinary_runs_get_no_advice(controller: object) -> None:
    assert find_advice(simulate(HALL, controller, 1 / 60, 12.0)) == []
    assert find_advice(simulate(CORRIDORS, Lloyd(), 1 / 60, 12.0)) == []


def test_a_robot_that_patrols_in_circles_does_not_tremble() -> None:
    record = simulate(HALL, Lloyd(), 0.1, 12.0)
    angle = 0.1 * np.arange(len(record))
    circle = np.stack([3.0 + np.cos(angle), 2.0 + np.sin(angle)], axis=1)
    positions = record.positions.copy()
    positions[:, 0] = circle
    assert len(find_trembling_robots(replace(record, positions=positions))) == 0
    # With a period of four steps it trembles.
    angle = 0.5 * np.pi * np.arange(len(record))
    positions[:, 0] = np.stack([3.0 + 0.1 * np.cos(angle), 2.0 + 0.1 * np.sin(angle)], axis=1)
    assert find_trembling_robots(replace(record, positions=positions)).tolist() == [0]


def test_short_and_thinned_records_are_not_judged() -> None:
    record = simulate_rooms(0.25)
    assert len(find_trembling_robots(record)) > 0
    assert len(find_trembling_robots(record.until(3.0))) == 0
    assert len(find_trembling_robots(record.thin(1.0))) == 0


def test_contacts_with_one_wall_are_not_a_zigzag() -> None:
    record = simulate(HALL, Lloyd(), 0.1, 12.0)
    positions = record.positions.copy()
    positions[:, 0] = [3.0, 0.1]
    obstacle_points = record.obstacle_points.copy()
    obstacle_points[:, 0] = [3.0, 0.0]
    clearances = np.ones(positions.shape[:2])
    clearances[::4, 0] = 0.0
    bouncing = replace(record, positions=positions, obstacle_points=obstacle_points)
    assert count_zigzags(bouncing, clearances).tolist() == [0, 0, 0]
    # Contacts with opposite walls in turn are zigzag.
    obstacle_points[4::8, 0] = [3.0, 0.2]
    zigzag = replace(record, positions=positions, obstacle_points=obstacle_points)
    assert count_zigzags(zigzag, clearances)[0] == len(record) // 4
