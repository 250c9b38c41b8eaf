"""The learned controller: its network, its inputs, and runs with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robocov as rc
from robocov.metrics import compute_clearances, count_contacts
from robocov.simulation import Simulation
from robocov.team import Team
from robocov_app.benchmark.learned import (
    DIRECTIONS,
    FULL_ALIGNMENT,
    INPUT_SIZE,
    LAYOUT,
    MAX_OFFSET_M,
    OUTPUT_SIZE,
    TRAIL_TIMES_S,
    Learned,
    LearnedMemory,
    build_inputs,
    to_offsets,
)
from robocov_app.learning import policy_network
from robocov_app.learning.policy_network import evaluate_network, load_network

MAX_FILE_SIZE_BYTES = 300_000


def draw_inputs(rows: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1.0, 1.0, (rows, INPUT_SIZE)).astype(np.float32)


def test_the_network_fits_the_inputs_and_is_small() -> None:
    network = load_network()
    assert network.weights_1.shape[1] == INPUT_SIZE
    assert len(network.biases_3) == OUTPUT_SIZE
    assert all(np.isfinite(array).all() for array in network)
    file = Path(policy_network.__file__).parent / "policy-network.npz"
    assert file.stat().st_size < MAX_FILE_SIZE_BYTES


def test_outputs_equal_those_of_matrix_products() -> None:
    network = load_network()
    inputs = draw_inputs(20)
    hidden = inputs.astype(np.float64)
    for weights, biases in (network[0:2], network[2:4]):
        hidden = np.maximum(hidden @ weights.T + biases, 0.0)
    expected = hidden @ network.weights_3.T + network.biases_3
    np.testing.assert_allclose(evaluate_network(network, inputs), expected, rtol=0.0, atol=1e-12)


def test_a_robot_decides_the_same_alone_and_in_a_team() -> None:
    inputs = draw_inputs(7)
    offsets = to_offsets(evaluate_network(load_network(), inputs))
    for robot in range(len(inputs)):
        alone = to_offsets(evaluate_network(load_network(), inputs[robot : robot + 1]))
        assert alone.tobytes() == offsets[robot].tobytes()


def test_inputs_contain_the_observation_and_the_trail() -> None:
    environment = rc.load_map("rooms")
    team = Team.homogeneous(3)
    simulation = Simulation(environment, Learned(), environment.start().sample(3, seed=0), team)
    seen = simulation.observe()
    trail_means = seen.positions[:, None] + np.array([[0.3, 0.0], [0.0, -0.6], [9.0, 0.0]])
    inputs = build_inputs(seen, LearnedMemory(team, trail_means))
    assert inputs.shape == (3, INPUT_SIZE)
    np.testing.assert_array_equal(inputs[:, : LAYOUT.size], LAYOUT.build_rows(seen, team))
    np.testing.assert_allclose(inputs[:, LAYOUT.size], 3.0 / environment.region.diameter, rtol=1e-6)
    # The offsets are divided by the sensing range of 3 m, and limited to 1.
    np.testing.assert_allclose(inputs[:, LAYOUT.size + 1 :], [[0.1, 0.0, 0.0, -0.2, 1.0, 0.0]] * 3, atol=1e-6)


def test_the_trail_follows_the_positions() -> None:
    environment = rc.load_map("rooms")
    team = Team.homogeneous(2)
    seen = Simulation(environment, Learned(), environment.start().sample(2, seed=0), team).observe()
    memory = LearnedMemory(team).update(seen)
    moved = replace(seen, positions=seen.positions + [1.0, 0.0])
    memory = memory.update(moved)
    assert memory.trail_means is not None
    # There are four scans per second.
    shifts = [[0.25 / time_constant, 0.0] for time_constant in TRAIL_TIMES_S]
    np.testing.assert_allclose(memory.trail_means - seen.positions[:, None], [shifts] * 2, atol=1e-12)
    without_scan = memory.update(replace(moved, scans=None))
    assert without_scan.trail_means is memory.trail_means


def test_certain_robots_go_far_and_uncertain_ones_stay() -> None:
    outputs = np.zeros((4, OUTPUT_SIZE))
    outputs[:, DIRECTIONS] = [0.4, 5.0, 1.0, -1.0]
    # The first two robots prefer one direction, the third one prefers none.
    outputs[0, DIRECTIONS // 4] = 50.0
    outputs[1, DIRECTIONS // 2] = 50.0
    offsets = to_offsets(outputs)
    np.testing.assert_allclose(offsets[:2], [[0.0, 0.4], [-MAX_OFFSET_M, 0.0]], atol=1e-9)
    # Half of all directions are on one side, where the mean of the squared cosine is 1/2.
    assert np.hypot(*offsets[2]) == pytest.approx(0.25 / FULL_ALIGNMENT)
    np.testing.assert_array_equal(offsets[3], 0.0)


def test_two_ways_around_an_obstacle_are_not_averaged() -> None:
    outputs = np.zeros((1, OUTPUT_SIZE))
    outputs[0, DIRECTIONS] = 1.0
    # To the left with a probability of 60%, and to the right with 40%.
    outputs[0, DIRECTIONS // 4] = 50.0 + np.log(0.6)
    outputs[0, 3 * DIRECTIONS // 4] = 50.0 + np.log(0.4)
    np.testing.assert_allclose(to_offsets(outputs), [[0.0, 0.6 / FULL_ALIGNMENT]], atol=1e-6)


@pytest.mark.parametrize("name", ["rooms", "trap"])
def test_robots_spread_without_contact(name: str) -> None:
    environment = rc.load_map(name)
    record = rc.run(environment, Learned(), robots=6, seed=0, duration=20.0)
    assert count_contacts(record, compute_clearances(record)) == 0
    spread_before, spread_after = record.positions[[0, -1]].std(axis=1).max(axis=1)
    assert spread_after > 1.5 * spread_before
