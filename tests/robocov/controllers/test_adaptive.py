from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from robocov.arrays import Array
from robocov.controllers import Adaptive, Lloyd
from robocov.controllers.adaptive import AdaptiveMemory, Lattice
from robocov.density import Gaussian, Gaussians
from robocov.density.base import Density
from robocov.density.cell_edges import CellEdges
from robocov.environment import Environment
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
REGION = SQUARE.region
HOT = Gaussians((Gaussian((7.5, 7.0), weight=6.0, sigma=1.5),), floor=0.3)


class RecordingDensity(Density):
    """A density that records where it is evaluated, and has no integrals."""

    kind: ClassVar[str] = "recording"
    min_value = 0.3
    max_value = 7.0

    def __init__(self) -> None:
        self.evaluated: list[Array] = []

    def evaluate(self, points: Array) -> Array:
        self.evaluated.append(points.copy())
        return HOT.evaluate(points)

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        raise AssertionError("it is known at the positions of the robots only")


@dataclass(frozen=True)
class BasisDensity(RecordingDensity):
    """A density that the basis represents exactly."""

    lattice: Lattice
    parameters: Array

    def evaluate(self, points: Array) -> Array:
        return self.lattice.evaluate_basis(points) @ self.parameters


def build_observations(
    positions: Array, time: float, density: Density | None, reach: float = np.inf
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
    for k in range(steps):
        seen = build_observations(rng.uniform(0.2, 9.8, (5, 2)), k * controller.period, density, reach)
        memory = controller.decide(seen, memory).memory
    return memory


@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_the_density_is_read_where_the_robots_are_and_nowhere_else(estimate: str) -> None:
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
    np.testing.assert_allclose(memory.estimates, 1.0, atol=1e-6 if estimate == "gp" else 0.02)
    team = Team.homogeneous(3)
    goals = controller.decide(build_observations(positions, 0.0, None), controller.begin(REGION, team)).goals
    lloyd = Lloyd().decide(build_observations(positions, 0.0, None), Lloyd().begin(REGION, team)).goals
    np.testing.assert_allclose(goals, lloyd, atol=0.1)


def test_parameters_converge_on_rich_trajectories() -> None:
    """The paper's corollary: if trajectories are rich enough, estimates converge to the truth."""
    controller = Adaptive(basis=4.0, coupling=0.0, learning=30.0)
    lattice = Lattice.build(REGION, 4, 0.1)
    truth = np.random.default_rng(2).uniform(0.2, 3.0, 16)
    memory = learn_everywhere(controller, BasisDensity(lattice, truth), 400)
    np.testing.assert_allclose(memory.parameters, np.broadcast_to(truth, (5, 16)), atol=0.05)


def test_robots_without_neighbors_learn_alone() -> None:
    controller = Adaptive(coupling=0.0)
    together, alone = (learn_everywhere(controller, HOT, 40, reach) for reach in (np.inf, 0.01))
    spread = [np.ptp(memory.parameters, axis=0).max() for memory in (together, alone)]
    assert spread[0] < 0.5 * spread[1]


@pytest.mark.slow
def test_the_process_fits_the_measurements() -> None:
    controller = Adaptive(estimate="gp")
    memory = learn_everywhere(controller, HOT, 12)
    for i in range(5):
        known = np.flatnonzero(~np.isnan(memory.measurements[i]))
        assert len(known) > 40, "also those of the neighbors"
        squares = memory.lattice.squares[known]
        near = np.hypot(*(memory.lattice.samples[:, None] - squares).transpose(2, 0, 1)).argmin(axis=0)
        error = np.abs(
            memory.estimates[i, near] - np.maximum(memory.measurements[i, known], controller.least)
        )
        assert np.median(error) < 0.25
    bolder = learn_everywhere(Adaptive(estimate="gp", explore=1.0), HOT, 12)
    assert (bolder.estimates >= memory.estimates - 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_a_team_that_learns_costs_nearly_as_little_as_one_that_knows(estimate: str) -> None:
    starts = SQUARE.start().sample(5, seed=2, radius=0.1)
    final = {}
    for name, controller, density in (
        ("knows", Lloyd(), HOT),
        ("blind", Lloyd(), None),
        ("learns", Adaptive(estimate=estimate), HOT),
    ):
        environment = SQUARE if density is None else SQUARE.with_density(density)
        final[name] = Simulation(environment, controller, starts).run(15.0).positions[-1]
    cost = {name: compute_hot_cost(positions) for name, positions in final.items()}
    assert cost["knows"] < cost["learns"] < 0.7 * cost["blind"] + 0.3 * cost["knows"]


def compute_hot_cost(positions: Array) -> float:
    """Return the locational cost with f = r², sampled."""
    x, y = np.meshgrid(np.linspace(0.05, 9.95, 100), np.linspace(0.05, 9.95, 100))
    points = np.column_stack([x.ravel(), y.ravel()])
    square = ((points[:, None] - positions) ** 2).sum(axis=2).min(axis=1)
    return float((HOT.evaluate(points) * square).mean())
