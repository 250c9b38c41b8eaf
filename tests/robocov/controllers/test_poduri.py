"""Spreading with at least k neighbors, by Poduri and Sukhatme."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.controllers import Poduri, make_controller
from robocov.environment import Environment
from robocov.errors import ParameterError
from robocov.mapfile import load_map
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.simulation import Simulation
from robocov.team import Team

HALL = Environment("hall", ((0, 0), (60, 0), (60, 60), (0, 60)))
CROWD = 30.0 + 0.3 * np.mgrid[-2:2, -2:2].reshape(2, -1).T
"""(16, 2) m, starts in the middle of the hall."""


def observe(positions: np.ndarray, communication_range: float = np.inf) -> Observations:
    """Return the observations of robots at rest, without obstacle points."""
    n = len(positions)
    return Observations(
        positions,
        np.zeros((n, 2)),
        Neighbors.from_ranges(positions, np.full(n, communication_range)),
        np.full((n, 2), np.nan),
        HALL.region,
    )


def count_links(positions: np.ndarray, link_range: float) -> np.ndarray:
    """Return the number of links of each robot, (n,)."""
    distances = np.hypot(*(positions[:, None] - positions).T)
    return np.asarray((distances <= link_range).sum(axis=1) - 1)


@pytest.mark.parametrize(("k", "min_distance"), [(1, 2.0), (3, 1.4)])
def test_every_robot_keeps_k_neighbors_while_the_team_spreads(k: int, min_distance: float) -> None:
    """The claim of the paper, far from walls."""
    simulation = Simulation(HALL, Poduri(neighbors=float(k), link_range=3.0, k_cover=1.0), CROWD)
    min_count = len(CROWD)
    for _ in range(60 * 15):
        simulation.step()
        min_count = min(min_count, int(count_links(simulation.positions, 3.0).min()))
    assert min_count >= k
    distances = np.hypot(*(simulation.positions[:, None] - simulation.positions).T)
    assert distances[~np.eye(len(CROWD), dtype=bool)].min() > min_distance


@pytest.mark.parametrize("name", ["rooms", "blocks-a"])
def test_robots_keep_two_neighbors_by_default(name: str) -> None:
    environment = load_map(name)
    simulation = Simulation(environment, Poduri(), environment.start().sample(6, seed=1))
    for _ in range(60 * 8):
        simulation.step()
        assert count_links(simulation.positions, 6.0).min() >= 2


def test_robots_with_fewer_neighbors_spread_farther() -> None:
    spreads = []
    for k in (1.0, 6.0):
        simulation = Simulation(HALL, Poduri(neighbors=k, link_range=3.0, k_cover=1.0), CROWD)
        for _ in range(60 * 6):
            simulation.step()
        spreads.append(float(simulation.positions.std()))
    assert spreads[0] > spreads[1]


@pytest.mark.parametrize("seed", [0, 1])
def test_robots_keep_their_neighbors_among_walls(seed: int) -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(8, seed=seed)
    assert count_links(starts, 3.0).min() >= 2
    simulation = Simulation(rooms, Poduri(neighbors=2.0, link_range=3.0, k_cover=1.0), starts)
    for _ in range(60 * 8):
        simulation.step()
        assert count_links(simulation.positions, 3.0).min() >= 2


def compute_expected_force(
    positions: np.ndarray, i: int, known: set[int], k: int, link_range: float
) -> np.ndarray:
    """Return the force on robot i, which knows some robots, for k_cover = 0.5 and η = 0.8."""

    def is_critical(robot: int, neighbor: int) -> bool:
        distances = {m: np.hypot(*(positions[robot] - positions[m])) for m in known if m != robot}
        near_count = sum(distance <= 0.8 * link_range for distance in distances.values())
        nearer_count = sum(distance < distances[neighbor] for distance in distances.values())
        return near_count <= k and nearer_count < k

    force = np.zeros(2)
    for j in known - {i}:
        offset = positions[i] - positions[j]
        distance = float(np.hypot(*offset))
        if distance > link_range:
            continue
        force += 0.5 * offset / distance**3
        if is_critical(i, j) or is_critical(j, i):
            slack = link_range - min(distance, 0.999 * link_range)
            force -= 0.5 * (1 / 0.8 - 1) ** 2 / slack**2 * offset / distance
    return force


@settings(max_examples=count_examples(40))
@given(
    seed=st.integers(0, 2**32),
    k=st.integers(0, 4),
    communication_range=st.floats(1.0, 6.0),
    reports=st.booleans(),
)
def test_forces_follow_the_rules_for_each_robot(
    seed: int, k: int, communication_range: float, reports: bool
) -> None:
    """With reported positions, which are the true ones here, the forces are the same."""
    n = 9
    positions = np.random.default_rng(seed).uniform(0, 8, size=(n, 2))
    controller = Poduri(neighbors=float(k), link_range=3.5, eta=0.8, k_cover=0.5)
    seen = observe(positions, communication_range)
    if reports:
        _, neighbor = seen.neighbors.list_pairs()
        seen = replace(seen, reported_positions=positions[neighbor])
    team = Team.homogeneous(n, communication_range=communication_range)
    forces = controller.decide(seen, controller.begin(HALL.region, team)).forces
    for i in range(n):
        known = {i, *seen.neighbors.list_neighbors(i).tolist()}
        expected = compute_expected_force(positions, i, known, k, min(communication_range, 3.5))
        np.testing.assert_allclose(forces[i], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("distance", "sign"), [(1.4, -1), (1.5, 0), (1.6, 1)])
def test_the_two_forces_of_a_critical_link_are_equal_at_eta_times_its_range(
    distance: float, sign: int
) -> None:
    controller = Poduri(neighbors=1.0, link_range=2.0, eta=0.75)
    memory = controller.begin(HALL.region, Team.homogeneous(2))
    seen = observe(np.array([[20.0, 20.0], [20.0 + distance, 20.0]]))
    force = controller.decide(seen, memory).forces[0, 0]
    assert np.sign(round(force, 9)) == sign


def test_k_is_a_whole_number() -> None:
    with pytest.raises(ParameterError, match=r"poduri\.neighbors: .*whole number from 0 to 100.*2\.5"):
        make_controller("poduri", {"neighbors": 2.5})


def test_runs_are_reproducible() -> None:
    rooms = load_map("rooms")
    starts = rooms.start().sample(6, seed=1)
    first = Simulation(rooms, Poduri(), starts).run(3.0)
    second = Simulation(rooms, Poduri(), starts).run(3.0)
    assert first.positions.tobytes() == second.positions.tobytes()
