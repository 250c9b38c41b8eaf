"""Train the network of the controller `learned` by imitation (DAgger), and write its weights.

    python tests/bench/train_policy.py --out app/robocov_app/learning/policy-network.npz

In each round, teams move on newly generated maps. A planner that knows the map determines where each robot
should go, while the robots themselves follow the current network; only in the first round, they follow the
planner. Then the network is trained on the data of all rounds. The seed is fixed, but the last digits of sums
depend on the processor and on the version of numpy, so the weights are similar elsewhere, not equal.
"""

import argparse
import time
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import ClassVar

import numpy as np

from robocov.controllers import LocalSearch
from robocov.controllers.placement.placement_controller import PlacementMemory
from robocov.environment import Environment
from robocov.errors import NoLayoutError
from robocov.generator import GENERATORS
from robocov.observation import Decision, Observations, Scanning
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.typing import Float32Array, FloatArray
from robocov_app.benchmark import suite
from robocov_app.benchmark.learned import (
    DIRECTIONS,
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
from robocov_app.learning.policy_network import Network, evaluate_network

SEED = 1
FIRST_MAP_SEED = 100_000
"""Seed of the first map. The suite has seeds up to 7007, and verifications draw seeds from 1,000,000 on."""
FAMILIES = (*GENERATORS, "homes", "offices", "yards", "plants")
DURATION_S = 45.0
DT_S = 1 / 30
SHORT_RANGE_M = 3.0
SHORT_RANGE_PROBABILITY = 0.25
MAX_ROBOTS = 9
HIDDEN_UNITS = 128
BATCH_SIZE = 2048
MAX_LEARNING_RATE = 2e-3
MEAN_DECAY = 0.9
SQUARE_DECAY = 0.999
MIN_PROBABILITY = 1e-9
"""Lower limit of probabilities in logarithms."""
MIN_DISTANCE_M = 0.05
"""Distance of a target below which its direction does not matter."""
DISTANCE_WEIGHT = 3.0
"""Weight of an error of 1 m in the distance, relative to the cross entropy of the direction."""
QUARTER_TURNS = 4
INPUT_VECTORS = [
    *(LAYOUT.blocks[name].start for name in ("position", "velocity", "obstacle", "centroid")),
    *(LAYOUT.blocks["neighbor"].start + 3 * k for k in range(LAYOUT.neighbors)),
    *(LAYOUT.size + 1 + 2 * k for k in range(len(TRAIL_TIMES_S))),
]
"""Column of the x component of each vector in the inputs."""


@dataclass(frozen=True, eq=False)
class Lesson:
    """Controller that records what the teacher would do, while robots follow the network or the teacher.

    Parameters
    ----------
    teacher : LocalSearch
        The planner, which knows the map.
    network : Network or None
        Network that the robots follow; None if they follow the teacher.
    """

    name: ClassVar[str] = "lesson"
    label: ClassVar[str] = "lesson"
    summary: ClassVar[str] = "records what a teacher would do"
    scanning: ClassVar[Scanning] = Learned.scanning

    teacher: LocalSearch
    network: Network | None
    inputs: list[Float32Array] = field(default_factory=list)
    targets: list[FloatArray] = field(default_factory=list)

    def begin(self, region: Region, team: Team) -> tuple[PlacementMemory, LearnedMemory]:
        """Return the memories of the teacher and of the learner."""
        return self.teacher.begin(region, team), LearnedMemory(team)

    def decide(self, seen: Observations, memory: tuple[PlacementMemory, LearnedMemory]) -> Decision:
        """Record inputs and targets after each scan, and drive the robots to their goals."""
        teacher_memory, learner_memory = memory
        teacher_memory = self.teacher.decide(seen, teacher_memory).memory
        learner_memory = learner_memory.update(seen)
        if seen.scans is not None:
            inputs = build_inputs(seen, learner_memory)
            targets = find_targets(seen, teacher_memory)
            self.inputs.append(inputs)
            self.targets.append(targets)
            offsets = targets
            if self.network is not None:
                offsets = to_offsets(evaluate_network(self.network, inputs))
            learner_memory = replace(learner_memory, goals=seen.positions + offsets)
        decision = Learned().drive(seen, learner_memory)
        return replace(decision, memory=(teacher_memory, learner_memory))


def find_targets(seen: Observations, teacher_memory: PlacementMemory) -> FloatArray:
    """Return the offsets to the waypoints of the teacher, at most `MAX_OFFSET_M` long, (n, 2) m."""
    targets = np.zeros_like(seen.positions)
    pairs = zip(teacher_memory.routes, teacher_memory.waypoint_indices, strict=True)
    for robot, (route, index) in enumerate(pairs):
        offset = route[index] - seen.positions[robot]
        length = float(np.linalg.norm(offset))
        is_goal = index == len(route) - 1
        if length > MAX_OFFSET_M or (not is_goal and length > 0.0):
            offset = offset * (MAX_OFFSET_M / length)
        targets[robot] = offset
    return targets


def draw_map(rng: np.random.Generator) -> Environment:
    """Draw a map of a random family and, if the family has one, of a random size."""
    while True:
        family = FAMILIES[rng.integers(len(FAMILIES))]
        seed = FIRST_MAP_SEED + int(rng.integers(100_000))
        try:
            return suite.build_family_map(family, seed)
        except NoLayoutError:
            continue  # Not every seed gives a map.


def collect_run(rng: np.random.Generator, network: Network | None) -> tuple[Float32Array, Float32Array]:
    """Simulate a random team on a random map, and return inputs and targets, one row per decision."""
    environment = draw_map(rng)
    robots = int(rng.integers(1, MAX_ROBOTS + 1))
    start_name = str(rng.choice(list(environment.starts)))
    communication_range = SHORT_RANGE_M if rng.random() < SHORT_RANGE_PROBABILITY else np.inf
    team = Team.homogeneous(robots, communication_range=communication_range)
    starts = environment.start(start_name).sample(robots, seed=int(rng.integers(2**31)))
    lesson = Lesson(LocalSearch(nodes=400.0).inform(environment), network)
    simulation = Simulation(environment, lesson, starts, team, DT_S)
    for _ in range(round(DURATION_S / DT_S)):
        simulation.step()
    return np.concatenate(lesson.inputs), np.concatenate(lesson.targets, dtype=np.float32)


@dataclass(frozen=True)
class Symmetry:
    """A reflection in the x axis if `is_mirrored`, followed by `turns` quarter turns counter-clockwise."""

    turns: int
    is_mirrored: bool

    def transform_inputs(self, inputs: Float32Array) -> Float32Array:
        """Return the inputs of the same situation in a rotated or reflected world."""
        transformed = self.transform_vectors(inputs, INPUT_VECTORS)
        rays = LAYOUT.blocks["rays"]
        # Ray k of the transformed scan is ray order[k] of the original one.
        order = np.arange(LAYOUT.rays) - self.turns * (LAYOUT.rays // QUARTER_TURNS)
        if self.is_mirrored:
            order = -order
        transformed[:, rays] = inputs[:, rays][:, order % LAYOUT.rays]
        return transformed

    def transform_vectors(self, rows: Float32Array, first_columns: list[int]) -> Float32Array:
        """Return rows in which the vectors that begin in the given columns are transformed."""
        columns = np.array(first_columns)
        x = rows[:, columns]
        y = rows[:, columns + 1]
        if self.is_mirrored:
            y = -y
        for _ in range(self.turns):
            x, y = -y, x
        transformed = rows.copy()
        transformed[:, columns] = x
        transformed[:, columns + 1] = y
        return transformed


class Adam:
    """The optimizer Adam (Kingma and Ba 2015) for a network.

    Parameters
    ----------
    network : Network
        Its arrays are modified in place.
    """

    def __init__(self, network: Network) -> None:
        self._network = network
        self._means = [np.zeros_like(array) for array in network]
        self._squares = [np.zeros_like(array) for array in network]
        self._steps = 0

    def step(self, gradient: Network, learning_rate: float) -> None:
        """Change the network by one step against a gradient."""
        self._steps += 1
        mean_correction = 1.0 - MEAN_DECAY**self._steps
        square_correction = 1.0 - SQUARE_DECAY**self._steps
        step_size = learning_rate * np.sqrt(square_correction) / mean_correction
        pairs = zip(self._network, gradient, self._means, self._squares, strict=True)
        for array, derivative, mean, square in pairs:
            mean += (1.0 - MEAN_DECAY) * (derivative - mean)
            square += (1.0 - SQUARE_DECAY) * (derivative**2 - square)
            array -= np.float32(step_size) * mean / (np.sqrt(square) + np.float32(1e-8))


def compute_gradient(network: Network, inputs: Float32Array, targets: Float32Array) -> tuple[float, Network]:
    """Compute the loss of a network and its gradient, by backpropagation."""
    hidden_1 = np.maximum(inputs @ network.weights_1.T + network.biases_1, 0.0)
    hidden_2 = np.maximum(hidden_1 @ network.weights_2.T + network.biases_2, 0.0)
    outputs = hidden_2 @ network.weights_3.T + network.biases_3
    loss, slopes_3 = compute_loss(outputs, targets)
    slopes_2 = slopes_3 @ network.weights_3 * (hidden_2 > 0.0)
    slopes_1 = slopes_2 @ network.weights_2 * (hidden_1 > 0.0)
    gradient = Network(
        weights_1=slopes_1.T @ inputs,
        biases_1=slopes_1.sum(axis=0),
        weights_2=slopes_2.T @ hidden_1,
        biases_2=slopes_2.sum(axis=0),
        weights_3=slopes_3.T @ hidden_2,
        biases_3=slopes_3.sum(axis=0),
    )
    return loss, gradient


def compute_loss(outputs: Float32Array, targets: Float32Array) -> tuple[float, Float32Array]:
    """Compute the loss and its derivatives with respect to the outputs, (n, OUTPUT_SIZE).

    The loss is the mean cross entropy of the directions plus `DISTANCE_WEIGHT` times the mean absolute error
    of the distances. The direction is a choice among `DIRECTIONS`, because the average of two ways around an
    obstacle leads into it. A target that is closer than `MIN_DISTANCE_M` has no direction.
    """
    rows = np.arange(len(targets))
    angles = np.arctan2(targets[:, 1], targets[:, 0])
    directions = np.rint(angles * (DIRECTIONS / (2.0 * np.pi))).astype(int) % DIRECTIONS
    distances = np.sqrt((targets**2).sum(axis=1))
    has_direction = distances > MIN_DISTANCE_M

    preferences = outputs[:, :DIRECTIONS]
    likelihoods = np.exp(preferences - preferences.max(axis=1, keepdims=True))
    probabilities = likelihoods / likelihoods.sum(axis=1, keepdims=True)
    entropies = -np.log(probabilities[rows, directions] + np.float32(MIN_PROBABILITY)) * has_direction
    distance_errors = outputs[:, DIRECTIONS] - distances
    loss = float(entropies.mean() + DISTANCE_WEIGHT * np.abs(distance_errors).mean())

    slopes = np.empty_like(outputs)
    slopes[:, :DIRECTIONS] = probabilities
    slopes[rows, directions] -= 1.0
    slopes[:, :DIRECTIONS] *= has_direction[:, None]
    slopes[:, DIRECTIONS] = DISTANCE_WEIGHT * np.sign(distance_errors)
    return loss, slopes / np.float32(len(targets))


def train(
    network: Network, inputs: Float32Array, targets: Float32Array, epochs: int, rng: np.random.Generator
) -> float:
    """Train a network in place, and return its mean loss in the last epoch."""
    optimizer = Adam(network)
    batches = len(inputs) // BATCH_SIZE
    loss = 0.0
    for epoch in range(epochs):
        order = rng.permutation(len(inputs))
        losses = []
        for k in range(batches):
            batch = order[k * BATCH_SIZE : (k + 1) * BATCH_SIZE]
            symmetry = Symmetry(int(rng.integers(QUARTER_TURNS)), bool(rng.integers(2)))
            batch_inputs = symmetry.transform_inputs(inputs[batch])
            batch_targets = symmetry.transform_vectors(targets[batch], [0])
            batch_loss, gradient = compute_gradient(network, batch_inputs, batch_targets)
            progress = (epoch + k / batches) / epochs
            # The learning rate falls to 0 along half a cosine wave.
            optimizer.step(gradient, MAX_LEARNING_RATE * 0.5 * (1.0 + np.cos(np.pi * progress)))
            losses.append(batch_loss)
        loss = float(np.mean(losses))
    return loss


def draw_network(rng: np.random.Generator) -> Network:
    """Draw a network with random weights (He et al. 2015) and no biases."""
    sizes = [INPUT_SIZE, HIDDEN_UNITS, HIDDEN_UNITS, OUTPUT_SIZE]
    arrays: list[Float32Array] = []
    for inputs, outputs in pairwise(sizes):
        deviation = np.sqrt(2.0 / inputs)
        arrays.append(rng.normal(0.0, deviation, (outputs, inputs)).astype(np.float32))
        arrays.append(np.zeros(outputs, dtype=np.float32))
    return Network(*arrays)


def main() -> None:
    """Train the network, and write its weights."""
    parser = argparse.ArgumentParser(description="Train the network of the controller `learned`.")
    parser.add_argument("--out", type=Path, required=True, help="file of the weights (.npz)")
    parser.add_argument("--rounds", type=int, default=5, help="number of rounds")
    parser.add_argument("--runs", type=int, default=60, help="number of runs per round")
    parser.add_argument("--epochs", type=int, default=8, help="number of passes over the data per round")
    options = parser.parse_args()
    rng = np.random.default_rng(SEED)
    network = draw_network(rng)
    all_inputs: list[Float32Array] = []
    all_targets: list[Float32Array] = []
    for round_number in range(1, options.rounds + 1):
        for _ in range(options.runs):
            inputs, targets = collect_run(rng, None if round_number == 1 else network)
            all_inputs.append(inputs)
            all_targets.append(targets)
        loss = train(
            network,
            np.concatenate(all_inputs),
            np.concatenate(all_targets),
            options.epochs,
            rng,
        )
        np.savez_compressed(options.out, **network._asdict())
        rows = sum(len(inputs) for inputs in all_inputs)
        minutes = time.process_time() / 60.0
        print(
            f"round {round_number}: {rows:,} decisions, loss {loss:.3f}, {minutes:.1f} min of processor time",
            flush=True,
        )


if __name__ == "__main__":
    main()
