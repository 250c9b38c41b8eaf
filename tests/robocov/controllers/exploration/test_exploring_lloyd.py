"""Lloyd's algorithm with an unknown density: measured squares, viewpoints and messages."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest

from robocov.conditions import Conditions, Failure
from robocov.controllers import Lloyd
from robocov.controllers.exploration.exploring_lloyd import ExploringLloyd, ExploringMemory
from robocov.controllers.square_grid import SquareGrid
from robocov.density import Gaussian, Gaussians
from robocov.density.base import Density
from robocov.density.cell_edges import CellEdges
from robocov.environment import Environment
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.typing import FloatArray

SQUARE = Environment("square", ((0, 0), (20, 0), (20, 20), (0, 20)))
PEAK = Gaussians((Gaussian((15.0, 14.0), weight=9.0, sigma=2.0),), floor=0.1)


class SensedDensity(Density):
    """The density PEAK, which may only be evaluated within the sensing range of a robot."""

    kind: ClassVar[str] = "sensed"
    lower_bound = PEAK.lower_bound
    upper_bound = PEAK.upper_bound

    def __init__(self, positions: FloatArray, sensing_range: float) -> None:
        self.positions = positions
        self.sensing_range = sensing_range
        self.evaluated_points: list[FloatArray] = []

    def evaluate(self, points: FloatArray) -> FloatArray:
        self.evaluated_points.append(points)
        squared_distances = ((points[:, None] - self.positions) ** 2).sum(axis=2)
        assert (squared_distances.min(axis=1) <= self.sensing_range**2).all()
        return PEAK.evaluate(points)

    def compute_moments(self, edges: CellEdges, origins: FloatArray) -> FloatArray:
        raise AssertionError("expected no integrals of the density")


def build_observations(positions: FloatArray, density: Density | None, time: float = 0.0) -> Observations:
    """Return the observations of robots out of communication range of each other."""
    n = len(positions)
    neighbors = Neighbors.from_ranges(positions, np.zeros(n))
    no_obstacles = np.full((n, 2), np.nan)
    return Observations(
        positions, np.zeros((n, 2)), neighbors, no_obstacles, SQUARE.region, time, density=density
    )


def run(controller: ExploringLloyd | Lloyd, environment: Environment, duration: float = 40.0) -> Simulation:
    """Return the simulation of five robots with short ranges that start in a corner."""
    team = Team.homogeneous(5, sensing_range=2.0, communication_range=6.0)
    starts = np.array([[1.0, 1.0], [2.0, 1.0], [1.0, 2.0], [2.0, 2.0], [3.0, 1.0]])
    simulation = Simulation(environment, controller, starts, team)
    simulation.run(duration)
    return simulation


def compute_peak_cost(positions: FloatArray) -> float:
    """Return the mean squared distance to the nearest robot, weighted by PEAK, on a lattice."""
    x, y = np.meshgrid(np.arange(0.25, 20.0, 0.5), np.arange(0.25, 20.0, 0.5))
    points = np.column_stack([x.ravel(), y.ravel()])
    squared_distances = ((points[:, None] - positions) ** 2).sum(axis=2).min(axis=1)
    weights = PEAK.evaluate(points)
    return float((weights * squared_distances).sum() / weights.sum())


def test_a_robot_measures_only_within_its_sensing_range() -> None:
    controller = ExploringLloyd()
    positions = np.array([[3.0, 4.0], [16.0, 12.0]])
    memory = controller.begin(SQUARE.region, Team.homogeneous(2, sensing_range=1.5))
    density = SensedDensity(positions, 1.5)
    memory = controller.decide(build_observations(positions, density), memory).memory
    for robot, position in enumerate(positions):
        is_known = ~np.isnan(memory.measurements[robot])
        distances = np.hypot(*(memory.grid.centers - position).T)
        np.testing.assert_array_equal(is_known, distances <= 1.5)


def test_a_robot_measures_each_square_once() -> None:
    controller = ExploringLloyd()
    positions = np.array([[3.0, 4.0]])
    memory = controller.begin(SQUARE.region, Team.homogeneous(1, sensing_range=1.5))
    density = SensedDensity(positions, 1.5)
    for time in (0.0, 2.0, 4.0):
        memory = controller.decide(build_observations(positions, density, time), memory).memory
    points = np.concatenate(density.evaluated_points)
    assert len(points) > 0
    assert len(np.unique(points, axis=0)) == len(points)


def test_a_team_that_explores_finds_a_peak_that_it_does_not_know() -> None:
    peak_square = SQUARE.with_density(PEAK)
    informed_cost = compute_peak_cost(run(Lloyd(), peak_square).positions)
    uninformed_cost = compute_peak_cost(run(Lloyd(), SQUARE).positions)
    cost = compute_peak_cost(run(ExploringLloyd(), peak_square).positions)
    assert cost < 0.5 * informed_cost + 0.5 * uninformed_cost


def test_a_robot_keeps_its_viewpoint_until_the_square_is_measured() -> None:
    controller = ExploringLloyd(exploration=0.1)
    memory = controller.begin(SQUARE.region, Team.homogeneous(1, sensing_range=2.0))
    position = np.array([[10.0, 10.0]])
    memory = controller.decide(build_observations(position, PEAK), memory).memory
    viewpoint = memory.viewpoints[0]
    target = memory.grid.centers[viewpoint]
    np.testing.assert_array_equal(memory.goals[0], target)
    on_the_way = position + 0.1 * (target - position)
    memory = controller.decide(build_observations(on_the_way, PEAK, 2.0), memory).memory
    assert memory.viewpoints[0] == viewpoint
    memory = controller.decide(build_observations(target[None], PEAK, 4.0), memory).memory
    assert memory.viewpoints[0] != viewpoint


def test_without_exploration_a_robot_moves_to_a_centroid() -> None:
    controller = ExploringLloyd(exploration=1.0)
    memory = controller.begin(SQUARE.region, Team.homogeneous(1, sensing_range=2.0))
    memory = controller.decide(build_observations(np.array([[4.0, 4.0]]), PEAK), memory).memory
    assert memory.viewpoints[0] == -1
    # Unknown squares have the mean mass of the known ones, which is nearly constant there.
    np.testing.assert_allclose(memory.goals, [[10.0, 10.0]], atol=0.1)


def test_measurements_of_zero_do_not_end_the_exploration() -> None:
    """A robot that has measured nothing but zeros explores: the mass must be elsewhere."""
    far_peak = Gaussians((Gaussian((19.0, 19.0), weight=1.0, sigma=0.1),))
    controller = ExploringLloyd()
    memory = controller.begin(SQUARE.region, Team.homogeneous(1, sensing_range=2.0))
    memory = controller.decide(build_observations(np.array([[4.0, 4.0]]), far_peak), memory).memory
    assert memory.viewpoints[0] >= 0


def test_a_known_uniform_density_needs_no_measurements_and_no_messages() -> None:
    simulation = run(ExploringLloyd(), SQUARE, duration=2.0)
    memory: ExploringMemory = simulation.memory
    assert np.isnan(memory.measurements).all()
    assert not memory.measurement_exchange.allowances.any()
    assert (memory.viewpoints == -1).all()


def test_robots_measure_a_density_that_replaces_a_uniform_one() -> None:
    uniform = run(ExploringLloyd(), SQUARE)
    simulation = uniform.with_density(SQUARE.with_density(PEAK))
    simulation.run(40.0)
    # A robot has found the peak.
    assert np.nanmax(simulation.memory.measurements) > 8.0
    assert compute_peak_cost(simulation.positions) < 0.8 * compute_peak_cost(uniform.positions)


def test_robots_know_in_time_of_others_that_were_never_in_range() -> None:
    """Three robots in a row: the outer ones are in range only of the middle one, which reports them."""
    starts = np.array([[2.0, 10.0], [7.0, 10.0], [12.0, 10.0]])
    team = Team.homogeneous(3, communication_range=6.0)
    simulation = Simulation(SQUARE, ExploringLloyd(), starts, team)
    simulation.run(1.1)
    sightings = simulation.memory.sightings
    np.testing.assert_allclose(sightings.positions[0, 2], starts[2], atol=1.1)
    assert simulation.observe().neighbors.list_neighbors(0).tolist() == [1]


def test_sightings_have_the_time_at_which_a_position_was_sent() -> None:
    starts = np.array([[2.0, 10.0], [4.0, 10.0]])
    simulation = Simulation(SQUARE, ExploringLloyd(), starts, conditions=Conditions(delay=2.0))
    simulation.run(4.0)
    memory: ExploringMemory = simulation.memory
    assert memory.sightings.times[0, 1] == pytest.approx(memory.plan_time - 2.0)


def test_a_failed_robot_is_lost_and_its_cell_is_divided_among_the_others() -> None:
    starts = np.array([[2.0, 10.0], [6.0, 10.0], [10.0, 2.0]])
    conditions = Conditions(failures=(Failure(3, 1.0),))
    simulation = Simulation(SQUARE, ExploringLloyd(), starts, conditions=conditions)
    simulation.run(40.0)
    assert np.isnan(simulation.memory.sightings.positions[:2, 2]).all()
    # The other two divide the square in the middle.
    first_goal, second_goal = simulation.observe_and_decide().decision.goals[:2]
    np.testing.assert_allclose(0.5 * (first_goal + second_goal), [10.0, 10.0], atol=0.2)


def test_a_copy_continues_with_the_same_messages() -> None:
    simulation = run(ExploringLloyd(), SQUARE.with_density(PEAK), duration=2.5)
    twin = simulation.copy()
    simulation.run(2.5)
    twin.run(2.5)
    np.testing.assert_array_equal(twin.positions, simulation.positions)
    np.testing.assert_array_equal(twin.memory.measurements, simulation.memory.measurements)


@pytest.mark.parametrize(("width", "height", "shape"), [(4.0, 4.0, (8, 8)), (4.0, 1.9, (4, 8))])
def test_squares_cover_the_region(width: float, height: float, shape: tuple[int, int]) -> None:
    region = Region(np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]))
    grid = SquareGrid.build(region, 8)
    assert grid.shape == shape
    assert (grid.centers.max(axis=0) + 0.5 * grid.side >= [width, height]).all()


def test_nearby_squares_are_counted_in_a_box() -> None:
    grid = SquareGrid.build(SQUARE.region, 20)
    is_counted = np.random.default_rng(1).random(400) < 0.3
    counts = grid.count_nearby(is_counted, 2.5)
    for square in (0, 19, 210, 399):
        offsets = np.abs(grid.centers - grid.centers[square]).max(axis=1)
        assert counts[square] == np.count_nonzero(is_counted & (offsets < 2.5))


def test_messages_about_the_team_do_not_depend_on_robots_out_of_range() -> None:
    """A robot without neighbors decides the same, wherever the others are."""
    controller = ExploringLloyd()
    memory = controller.begin(SQUARE.region, Team.homogeneous(2, sensing_range=2.0))
    first = controller.decide(build_observations(np.array([[3.0, 4.0], [9.0, 9.0]]), PEAK), memory)
    second = controller.decide(build_observations(np.array([[3.0, 4.0], [15.0, 12.0]]), PEAK), memory)
    np.testing.assert_array_equal(first.goals[0], second.goals[0])
    assert first.messages[0][0].size == second.messages[0][0].size
