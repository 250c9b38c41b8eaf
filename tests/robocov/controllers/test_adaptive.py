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
from robocov.observation.neighbours import Neighbours
from robocov.simulation import Simulation
from robocov.team import Team

SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))
REGION = SQUARE.region
HOT = Gaussians((Gaussian((7.5, 7.0), weight=6.0, sigma=1.5),), floor=0.3)


class Probed(Density):
    """A density that notes where it is asked for, and has no integrals."""

    kind: ClassVar[str] = "probed"
    min_value = 0.3
    max_value = 7.0

    def __init__(self) -> None:
        self.asked: list[Array] = []

    def evaluate(self, points: Array) -> Array:
        self.asked.append(points.copy())
        return HOT.evaluate(points)

    def compute_moments(self, edges: CellEdges, origins: Array) -> Array:
        raise AssertionError("nobody knows it but where it is")


@dataclass(frozen=True)
class OfBasis(Probed):
    """The density that the basis can tell exactly."""

    lattice: Lattice
    parameters: Array

    def evaluate(self, points: Array) -> Array:
        return self.lattice.basis(points) @ self.parameters


def seen_from(positions: Array, time: float, density: Density | None, reach: float = np.inf) -> Observations:
    n = len(positions)
    neighbours = Neighbours.from_ranges(positions, np.full(n, reach))
    nothing = np.full((n, 2), np.nan)
    return Observations(positions, np.zeros((n, 2)), neighbours, nothing, REGION, time, density=density)


def carried(law: Adaptive, density: Density | None, steps: int, reach: float = np.inf) -> AdaptiveMemory:
    """What five robots know that were carried through the square on rich ways."""
    rng = np.random.default_rng(4)
    memory = law.begin(REGION, Team.homogeneous(5))
    for k in range(steps):
        seen = seen_from(rng.uniform(0.2, 9.8, (5, 2)), k * law.period, density, reach)
        memory = law.decide(seen, memory).memory
    return memory


@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_the_density_is_read_where_the_robots_are_and_nowhere_else(estimate: str) -> None:
    law, density = Adaptive(estimate=estimate), Probed()
    memory = law.begin(REGION, Team.homogeneous(3))
    for k in range(5):
        positions = np.random.default_rng(k).uniform(1, 9, (3, 2))
        memory = law.decide(seen_from(positions, 0.2 * k, density), memory).memory
        np.testing.assert_array_equal(density.asked.pop(), positions)
    assert not density.asked


@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_what_is_as_guessed_needs_no_learning_and_is_lloyds_algorithm(estimate: str) -> None:
    law, positions = Adaptive(estimate=estimate), np.array([[2.0, 2.0], [7.0, 3.0], [5.0, 8.0]])
    memory = carried(law, None, 30)
    np.testing.assert_allclose(memory.estimates, 1.0, atol=1e-6 if estimate == "gp" else 0.02)
    team = Team.homogeneous(3)
    goals = law.decide(seen_from(positions, 0.0, None), law.begin(REGION, team)).goals
    lloyd = Lloyd().decide(seen_from(positions, 0.0, None), Lloyd().begin(REGION, team)).goals
    np.testing.assert_allclose(goals, lloyd, atol=0.1)


def test_parameters_are_learned_on_rich_ways_and_agreed_on() -> None:
    """The paper's corollary: where ways are rich enough, estimates come to the truth."""
    law = Adaptive(basis=4.0, coupling=0.0, learning=30.0)
    lattice = Lattice.over(REGION, 4, 0.1)
    truth = np.random.default_rng(2).uniform(0.2, 3.0, 16)
    memory = carried(law, OfBasis(lattice, truth), 400)
    np.testing.assert_allclose(memory.parameters, np.broadcast_to(truth, (5, 16)), atol=0.05)


def test_who_hears_nobody_learns_alone() -> None:
    law = Adaptive(coupling=0.0)
    together, alone = (carried(law, HOT, 40, reach) for reach in (np.inf, 0.01))
    spread = [np.ptp(memory.parameters, axis=0).max() for memory in (together, alone)]
    assert spread[0] < 0.5 * spread[1]


@pytest.mark.slow
def test_the_process_goes_through_what_was_measured() -> None:
    law = Adaptive(estimate="gp")
    memory = carried(law, HOT, 12)
    for i in range(5):
        known = np.flatnonzero(~np.isnan(memory.measured[i]))
        assert len(known) > 40  # of the neighbours, too
        squares = memory.lattice.squares[known]
        near = np.hypot(*(memory.lattice.places[:, None] - squares).transpose(2, 0, 1)).argmin(axis=0)
        error = np.abs(memory.estimates[i, near] - np.maximum(memory.measured[i, known], law.least))
        assert np.median(error) < 0.25
    bolder = carried(Adaptive(estimate="gp", explore=1.0), HOT, 12)
    assert (bolder.estimates >= memory.estimates - 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize("estimate", ["basis", "gp"])
def test_a_team_that_learns_ends_nearer_to_one_that_knows(estimate: str) -> None:
    starts = SQUARE.start().sample(5, seed=2, radius=0.1)
    places = {}
    for name, law, density in (
        ("knows", Lloyd(), HOT),
        ("blind", Lloyd(), None),
        ("learns", Adaptive(estimate=estimate), HOT),
    ):
        environment = SQUARE if density is None else SQUARE.with_density(density)
        places[name] = Simulation(environment, law, starts).run(15.0).positions[-1]
    cost = {name: hot_cost(place) for name, place in places.items()}
    assert cost["knows"] < cost["learns"] < 0.7 * cost["blind"] + 0.3 * cost["knows"]


def hot_cost(places: Array) -> float:
    """The locational cost with f = r², sampled."""
    x, y = np.meshgrid(np.linspace(0.05, 9.95, 100), np.linspace(0.05, 9.95, 100))
    points = np.column_stack([x.ravel(), y.ravel()])
    square = ((points[:, None] - places) ** 2).sum(axis=2).min(axis=1)
    return float((HOT.evaluate(points) * square).mean())
