"""Lloyd's algorithm with limited interaction range: moments, goals and cost."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.controllers import Lloyd, RangeLimited
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi import build_disc_limited_polygons, compute_disc_limited_moments, partition

REGION = Region(np.array([[0.0, 0.0], [11.0, -1.0], [12.0, 8.0], [3.0, 10.0]]))
SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))


def observe(
    positions: np.ndarray, communication_range: float = np.inf, density: Gaussians | None = None
) -> Observations:
    """Return the observations of robots at rest, without obstacle points."""
    n = len(positions)
    return Observations(
        positions,
        np.zeros((n, 2)),
        Neighbors.from_ranges(positions, np.full(n, communication_range)),
        np.full((n, 2), np.nan),
        REGION,
        density=density,
    )


@settings(max_examples=count_examples(40))
@given(seed=st.integers(0, 2**32), n=st.integers(1, 12), radius=st.floats(0.05, 8.0))
@example(seed=854, n=5, radius=0.3125)
def test_moments_of_limited_cells_agree_with_shapely(seed: int, n: int, radius: float) -> None:
    """Shapely intersects cells with a polygon of 4096 sides."""
    positions = np.random.default_rng(seed).uniform((1, 1), (10, 7), size=(n, 2))
    cells = partition(positions, REGION)
    area, offsets = compute_disc_limited_moments(cells.edges, np.full(n, radius))
    for i, ring in enumerate(cells.polygons):
        disc = shapely.Point(positions[i]).buffer(radius, quad_segs=1024)
        limited_cell = shapely.Polygon(ring).intersection(disc)
        if limited_cell.is_empty:  # a robot outside the region
            assert area[i] == 0.0
            continue
        # The area between the polygon and the circle. It matters most for thin parts of discs.
        missing_area = 1e-6 * radius**2
        assert area[i] == pytest.approx(limited_cell.area, rel=2e-6, abs=missing_area)
        centroid = limited_cell.centroid.coords[0]
        tolerance = radius * (3e-6 + missing_area / limited_cell.area)
        np.testing.assert_allclose(positions[i] + offsets[i], centroid, atol=tolerance)


@given(seed=st.integers(0, 2**32), distance=st.floats(0.1, 3.0))
def test_a_robot_outside_the_region_has_the_part_of_its_cell_in_the_disc(seed: int, distance: float) -> None:
    y = np.random.default_rng(seed).uniform(2.0, 8.0)
    positions = np.array([[-distance, y], [6.0, 4.0]])
    square = Region(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]))
    cells = partition(positions, square)
    area, offsets = compute_disc_limited_moments(cells.edges, np.full(2, 1.0))
    disc = shapely.Point(positions[0]).buffer(1.0, quad_segs=1024)
    limited_cell = shapely.Polygon(cells.polygons[0]).intersection(disc)
    assert area[0] == pytest.approx(limited_cell.area, abs=1e-5)
    if limited_cell.area == 0.0:
        np.testing.assert_array_equal(offsets[0], 0.0)


@pytest.mark.parametrize("radius", [20.0, np.inf])
def test_a_disc_that_contains_the_cell_changes_nothing(radius: float) -> None:
    positions = np.random.default_rng(1).uniform((2, 1), (10, 7), size=(9, 2))
    cells = partition(positions, REGION)
    area, offsets = compute_disc_limited_moments(cells.edges, np.full(9, radius))
    np.testing.assert_allclose(area, cells.masses, rtol=1e-12)
    np.testing.assert_allclose(positions + offsets, cells.centroids, rtol=1e-12)


def test_polygons_with_chords_instead_of_arcs_have_nearly_the_same_moments() -> None:
    positions = np.random.default_rng(2).uniform((2, 1), (10, 7), size=(7, 2))
    cells = partition(positions, REGION)
    radius = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 5.0, np.inf])
    area, offsets = compute_disc_limited_moments(cells.edges, radius)
    edges = build_disc_limited_polygons(cells.edges, radius)
    cross = edges.starts[:, 0] * edges.ends[:, 1] - edges.starts[:, 1] * edges.ends[:, 0]
    polygon_area = 0.5 * np.bincount(edges.cells, cross, minlength=7)
    assert (polygon_area <= area * (1 + 1e-12)).all()
    np.testing.assert_allclose(polygon_area, area, rtol=5e-4)
    for axis in (0, 1):
        moments = cross * (edges.starts + edges.ends)[:, axis] / 6.0
        polygon_offset = np.bincount(edges.cells, moments, minlength=7) / polygon_area
        np.testing.assert_allclose(polygon_offset, offsets[:, axis], atol=1e-3)


@given(seed=st.integers(0, 2**32))
def test_robots_beyond_the_interaction_range_do_not_matter(seed: int) -> None:
    positions = np.random.default_rng(seed).uniform((2, 1), (10, 7), size=(12, 2))
    controller = RangeLimited(interaction_range=2.5)
    memory = controller.begin(REGION, Team.homogeneous(12))
    all_heard = controller.decide(observe(positions), memory)
    near_heard = controller.decide(observe(positions, 2.5), memory)
    assert all_heard.goals is not None
    np.testing.assert_allclose(near_heard.goals, all_heard.goals, atol=1e-9)


def test_without_a_limit_it_is_lloyds_algorithm() -> None:
    positions = np.random.default_rng(3).uniform((2, 1), (10, 7), size=(9, 2))
    team = Team.homogeneous(9)
    seen = observe(positions)
    unlimited = RangeLimited(interaction_range=None)
    lloyd = Lloyd()
    forces = unlimited.decide(seen, unlimited.begin(REGION, team)).forces
    expected = lloyd.decide(seen, lloyd.begin(REGION, team)).forces
    np.testing.assert_allclose(forces, expected, atol=1e-9)


def compute_limited_cost(positions: np.ndarray, radius: float) -> float:
    """Return the mean of min(|q - p|², radius²) over the square, by a fine grid."""
    x, y = np.meshgrid(np.arange(0.05, 10, 0.1), np.arange(0.05, 10, 0.1))
    points = np.column_stack([x.ravel(), y.ravel()])
    square = ((points[:, None] - positions) ** 2).sum(axis=2).min(axis=1)
    return float(np.minimum(square, radius**2).mean())


@pytest.mark.parametrize("seed", [0, 1])
def test_the_limited_cost_decreases(seed: int) -> None:
    """The claim of the paper."""
    starts = np.random.default_rng(seed).uniform(3, 6, size=(5, 2))
    while (np.hypot(*(starts[:, None] - starts).T) + np.eye(5) < 0.5).any():
        starts = starts * 1.05
    simulation = Simulation(SQUARE, RangeLimited(interaction_range=4.0), starts)
    costs = [compute_limited_cost(simulation.positions, 2.0)]
    for _ in range(20):
        for _ in range(30):
            simulation.step()
        costs.append(compute_limited_cost(simulation.positions, 2.0))
    assert (np.diff(costs) < 1e-4).all()
    assert costs[-1] < 0.9 * costs[0]


def test_the_goal_is_the_centroid_of_the_density_within_range() -> None:
    bell = Gaussians((Gaussian((6.5, 4.0), 1.0, 0.5),), floor=0.01)
    controller = RangeLimited(interaction_range=4.0)
    seen = observe(np.array([[5.0, 4.0]]), density=bell)
    goals = controller.decide(seen, controller.begin(REGION, Team.homogeneous(1))).goals
    x, y = np.meshgrid(np.arange(3, 7, 0.01) + 0.005, np.arange(2, 6, 0.01) + 0.005)
    points = np.column_stack([x.ravel(), y.ravel()])
    points = points[np.hypot(*(points - [5.0, 4.0]).T) < 2]
    assert goals is not None
    expected = np.average(points, axis=0, weights=bell.evaluate(points))
    np.testing.assert_allclose(goals[0], expected, atol=3e-3)


def test_each_cell_is_limited_by_the_robots_own_communication_range() -> None:
    """The range of one robot does not limit the cells of the others."""
    positions = np.array([[3.0, 4.0], [8.0, 4.0]])
    team = replace(Team.homogeneous(2), communication_range=np.array([1.0, 8.0]))
    controller = RangeLimited(interaction_range=None)
    decision = controller.decide(observe(positions), controller.begin(REGION, team))
    assert decision.goals is not None
    cells = partition(positions, REGION)
    for robot, radius in enumerate((0.5, 4.0)):
        disc = shapely.Point(positions[robot]).buffer(radius, quad_segs=1024)
        limited_cell = shapely.Polygon(cells.polygons[robot]).intersection(disc)
        np.testing.assert_allclose(decision.goals[robot], limited_cell.centroid.coords[0], atol=1e-4)
