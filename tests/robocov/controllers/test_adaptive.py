"""Controllers that learn the density: convergence, exchanged measurements and lost messages."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

from robocov.conditions import Conditions
from robocov.controllers import Adaptive, Lloyd
from robocov.controllers.adaptive import AdaptiveMemory, Lattice
from robocov.controllers.base import Controller
from robocov.density import Gaussian, Gaussians
from robocov.density.base import Density
from robocov.density.cell_edges import CellEdges
from robocov.environment import Environment
from robocov.observation import Decision, Observations, ReceivedMessage
from robocov.observation.neighbors import Neighbors
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.typing import FloatArray

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
REGION = SQUARE.region
HOT = Gaussians((Gaussian((7.5, 7.0), weight=6.0, sigma=1.5),), floor=0.3)


class RecordingDensity(Density):
    """A density that records where it is evaluated, and has no integrals."""

    kind: ClassVar[str] = "recording"
    lower_bound = 0.3
    upper_bound = 7.0

    def __init__(self) -> None:
        self.evaluated: list[FloatArray] = []

    def evaluate(self, points: FloatArray) -> FloatArray:
        self.evaluated.append(points.copy())
        return HOT.evaluate(points)

    def compute_moments(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        raise AssertionError("expected no integrals of the density")


@dataclass(frozen=True)
class BasisDensity(RecordingDensity):
    """A density that the basis represents exactly."""

    lattice: Lattice
    parameters: FloatArray

    def evaluate(self, points: FloatArray) -> FloatArray:
        return self.lattice.evaluate_basis(points) @ self.parameters


def build_observations(
    positions: FloatArray, time: float, density: Density | None, reach: float = np.inf
) -> Observations:
    n = len(positions)
    neighbors = Neighbors.from_ranges(positions, np.full(n, reach))
    no_obstacles = np.full((n, 2), np.nan)
    return Observations(positions, np.zeros((n, 2)), neighbors, no_obstacles, REGION, time, density=density)


def learn_everywhere(
    controller: Adaptive, density: Density | None, steps: int, reach: float = np.inf
) -> AdaptiveMemory:
    """Return the memory of five robots that were moved to random positions in the square."""
    rng = np.random.default_rng(4)
    memory = controller.begin(REGION, Team.homogeneous(5))
    messages: list[list[ReceivedMessage]] = []
    for k in range(steps):
        seen = build_observations(rng.uniform(0.2, 9.8, (5, 2)), k * controller.period, density, reach)
        decision = controller.decide(replace(seen, messages=messages), memory)
        messages = deliver(decision, seen.neighbors)
        memory = decision.memory
    return memory


def deliver(decision: Decision, neighbors: Neighbors) -> list[list[ReceivedMessage]]:
    """Return the messages that arrive at each robot if none is lost."""
    received: list[list[ReceivedMessage]] = [[] for _ in range(neighbors.robot_count)]
    for sender, messages in enumerate(decision.messages):
        for receiver in neighbors.list_neighbors(sender):
            received[receiver] += [ReceivedMessage(sender, message.payload) for message in messages]
    return received


@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_the_density_is_evaluated_only_at_the_positions_of_the_robots(estimate: str) -> None:
    controller = Adaptive(estimate=estimate)
    density = RecordingDensity()
    memory = controller.begin(REGION, Team.homogeneous(3))
    for k in range(5):
        positions = np.random.default_rng(k).uniform(1, 9, (3, 2))
        memory = controller.decide(build_observations(positions, 0.2 * k, density), memory).memory
        np.testing.assert_array_equal(density.evaluated.pop(), positions)
    assert not density.evaluated


@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_a_density_equal_to_the_prior_gives_lloyds_algorithm(estimate: str) -> None:
    controller = Adaptive(estimate=estimate)
    positions = np.array([[2.0, 2.0], [7.0, 3.0], [5.0, 8.0]])
    memory = learn_everywhere(controller, None, 30)
    tolerance = 1e-6 if estimate == "gp" else 0.02
    np.testing.assert_allclose(memory.estimates, 1.0, atol=tolerance)
    team = Team.homogeneous(3)
    goals = controller.decide(build_observations(positions, 0.0, None), controller.begin(REGION, team)).goals
    lloyd = Lloyd().decide(build_observations(positions, 0.0, None), Lloyd().begin(REGION, team)).goals
    np.testing.assert_allclose(goals, lloyd, atol=0.1)


def test_parameters_converge_on_rich_trajectories() -> None:
    """Check the corollary of the paper: estimates converge to the truth on rich trajectories."""
    controller = Adaptive(basis=4.0, coupling=0.0, learning=30.0)
    lattice = Lattice.build(REGION, 4, 0.1)
    truth = np.random.default_rng(2).uniform(0.2, 3.0, 16)
    memory = learn_everywhere(controller, BasisDensity(lattice, truth), 400)
    np.testing.assert_allclose(memory.parameters, np.broadcast_to(truth, (5, 16)), atol=0.05)


@pytest.mark.parametrize("period", [0.01, 0.05, 0.08])
def test_measurements_count_for_the_time_since_the_last_plan(period: float) -> None:
    """The sum of the entries of Λ is the integral of 1 over time, because the basis functions add up to 1."""
    simulation = Simulation(SQUARE, Adaptive(basis=2.0, period=period), [[1.0, 1.0]], dt=0.05)
    for _ in range(13):
        simulation.step()
    memory = simulation.memory
    assert memory.information_matrices.sum() == pytest.approx(memory.plan_time + period)


def test_robots_without_neighbors_learn_alone() -> None:
    controller = Adaptive(coupling=0.0)
    connected = learn_everywhere(controller, HOT, 40, np.inf)
    isolated = learn_everywhere(controller, HOT, 40, 0.01)
    connected_spread = np.ptp(connected.parameters, axis=0).max()
    isolated_spread = np.ptp(isolated.parameters, axis=0).max()
    assert connected_spread < 0.5 * isolated_spread


@pytest.mark.slow
def test_the_gaussian_process_fits_the_measurements() -> None:
    controller = Adaptive(estimate="gp")
    memory = learn_everywhere(controller, HOT, 12)
    for i in range(5):
        known = np.flatnonzero(~np.isnan(memory.measurements[i]))
        # The measurements of the neighbors are included.
        assert len(known) > 40
        squares = memory.lattice.squares[known]
        distances = np.hypot(*(memory.lattice.samples[:, None] - squares).transpose(2, 0, 1))
        nearest = distances.argmin(axis=0)
        measurements = np.maximum(memory.measurements[i, known], controller.min_density)
        errors = np.abs(memory.estimates[i, nearest] - measurements)
        assert np.median(errors) < 0.25
    exploring = learn_everywhere(Adaptive(estimate="gp", explore=1.0), HOT, 12)
    assert (exploring.estimates >= memory.estimates - 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_a_learning_team_covers_nearly_as_well_as_one_that_knows_the_density(estimate: str) -> None:
    starts = SQUARE.start().sample(5, seed=2, radius=0.1)
    hot_square = SQUARE.with_density(HOT)
    informed_cost = compute_final_cost(hot_square, Lloyd(), starts)
    uninformed_cost = compute_final_cost(SQUARE, Lloyd(), starts)
    learned_cost = compute_final_cost(hot_square, Adaptive(estimate=estimate), starts)
    assert informed_cost < learned_cost < 0.7 * uninformed_cost + 0.3 * informed_cost


@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_robots_use_nothing_that_was_sent_less_than_the_latency_ago(estimate: str) -> None:
    """Change what two robots know after 1 s: with a latency of 2 s, the third one notices after 3 s."""
    starts = SQUARE.start().sample(3, seed=2, radius=0.1)
    conditions = Conditions(delay=2.0)
    usual = Simulation(SQUARE, Adaptive(estimate=estimate), starts, conditions=conditions)
    changed = Simulation(SQUARE, Adaptive(estimate=estimate), starts, conditions=conditions)
    is_same = []
    for step in range(240):
        if step == 60:
            changed.memory = change_measurements(changed.memory, robots=[0, 1])
        usual.step()
        changed.step()
        is_same.append((usual.memory.estimates[2] == changed.memory.estimates[2]).all())
    assert all(is_same[:180])
    assert not any(is_same[210:])


def change_measurements(memory: AdaptiveMemory, robots: list[int]) -> AdaptiveMemory:
    """Return a memory in which some robots have measured and learned other values."""
    measurements = memory.measurements.copy()
    vectors = memory.information_vectors.copy()
    measurements[robots, 0] = 5.0
    vectors[robots] += 1.0
    return replace(memory, measurements=measurements, information_vectors=vectors)


def test_lost_measurements_are_sent_again() -> None:
    starts = SQUARE.start().sample(4, seed=2, radius=0.1)
    conditions = Conditions(loss=0.5, message_rate=4.0)
    hot_square = SQUARE.with_density(HOT)
    simulation = Simulation(hot_square, Adaptive(estimate="gp"), starts, conditions=conditions)
    simulation.run(12.0)
    is_known = ~np.isnan(simulation.memory.measurements)
    assert np.count_nonzero(is_known[0]) > 20
    assert (is_known == is_known[0]).all()


@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_a_copy_continues_with_the_same_messages(estimate: str) -> None:
    starts = SQUARE.start().sample(3, seed=2, radius=0.1)
    hot_square = SQUARE.with_density(HOT)
    conditions = Conditions(loss=0.3, delay=0.3)
    simulation = Simulation(hot_square, Adaptive(estimate=estimate), starts, conditions=conditions)
    simulation.run(1.0)
    twin = simulation.copy()
    simulation.run(1.0)
    twin.run(1.0)
    np.testing.assert_array_equal(twin.positions, simulation.positions)
    np.testing.assert_array_equal(twin.memory.estimates, simulation.memory.estimates)


def compute_final_cost(environment: Environment, controller: Controller, starts: FloatArray) -> float:
    """Return the locational cost by the density HOT after 15 s."""
    return compute_hot_cost(Simulation(environment, controller, starts).run(15.0).positions[-1])


def compute_hot_cost(positions: FloatArray) -> float:
    """Return the locational cost with f = r² by the density HOT, approximated on a lattice."""
    x, y = np.meshgrid(np.linspace(0.05, 9.95, 100), np.linspace(0.05, 9.95, 100))
    points = np.column_stack([x.ravel(), y.ravel()])
    squared_distances = ((points[:, None] - positions) ** 2).sum(axis=2).min(axis=1)
    return float((HOT.evaluate(points) * squared_distances).mean())
