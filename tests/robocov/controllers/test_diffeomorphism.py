"""Lloyd's algorithm in a chart without obstacles: the chart, its Jacobian and cells of samples."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import Diffeomorphism, Lloyd
from robocov.controllers.convex_chart import ConvexChart
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, PolygonObstacle, WallObstacle, find_nearest_inside
from robocov.errors import ParameterError
from robocov.mapfile import load_map
from robocov.observation import Observations
from robocov.observation.neighbors import Neighbors
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

PENTAGON = Environment("pentagon", ((0, 0), (10, -1), (12, 6), (5, 9), (-1, 5)))
BLOCK = PolygonObstacle(((3, 3), (6, 3.5), (5, 6)))
WALLS = (WallObstacle(((5, 0), (5, 6)), 0.2), BLOCK)
DOOR = Environment("door", ((0, 0), (10, 0), (10, 8), (0, 8)), (WallObstacle(((5, 0), (5, 6)), 0.2),))


@pytest.fixture(scope="module")
def chart() -> ConvexChart:
    walls = Environment("walls", ((0, 0), (10, 0), (10, 8), (0, 8)), WALLS)
    return ConvexChart(walls, 0.13, 24, 100.0)


def compute_signed_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the areas of triangles, positive if they are counter-clockwise."""
    sides = np.diff(points[triangles], axis=1)
    return np.asarray(0.5 * (sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]))


@pytest.mark.parametrize("name", ["rooms", "museum", "l-shape", "pentagon"])
@pytest.mark.parametrize("shrink", [1.0, 1e4])
def test_charts_are_one_to_one(name: str, shrink: float) -> None:
    """No triangle changes its orientation (Tutte, Floater), and the boundary is fixed."""
    environment = load_map(name)
    chart = ConvexChart(environment, 0.13, 48, shrink)
    assert (compute_signed_areas(chart.points, chart.triangles) > 0.0).all()
    assert (compute_signed_areas(chart.images, chart.triangles) > 0.0).all()
    distances = shapely.distance(environment.region.polygon.exterior, shapely.points(chart.points))
    is_fixed = distances < 1e-5
    np.testing.assert_array_equal(chart.images[is_fixed], chart.points[is_fixed])
    assert chart.mass.sum() == pytest.approx(environment.free_area, rel=1e-3)


def test_a_chart_that_does_not_shrink_obstacles_is_the_identity() -> None:
    chart = ConvexChart(load_map("rooms"), 0.13, 48, 1.0)
    np.testing.assert_allclose(chart.images, chart.points, atol=1e-9)


def test_obstacles_become_points() -> None:
    environment = Environment("block", PENTAGON.boundary, (BLOCK,))
    sizes = []
    for shrink in (1.0, 1e2, 1e4):
        chart = ConvexChart(environment, 0.1, 48, shrink)
        is_inside = shapely.contains_xy(BLOCK.polygon, chart.points)
        sizes.append(np.ptp(chart.images[is_inside], axis=0).max())
    assert sizes[0] > 1.5
    assert sizes[1] < 0.4 * sizes[0]
    assert sizes[2] < 0.01 * sizes[0]


@given(seed=st.integers(0, 2**32))
def test_jacobians_are_the_derivatives_of_the_chart(chart: ConvexChart, seed: int) -> None:
    rng = np.random.default_rng(seed)
    point = rng.uniform((1, 1), (9, 7), size=(1, 2))
    step = rng.normal(scale=1e-7, size=(1, 2))
    image, jacobian = chart.map_to_chart(point)
    next_image, next_jacobian = chart.map_to_chart(point + step)
    is_free = shapely.contains_xy(chart.configuration_space.buffer(-0.01), point).all()
    if is_free and (jacobian == next_jacobian).all():
        np.testing.assert_allclose(next_image - image, (jacobian @ step[..., None])[..., 0], atol=1e-13)


@given(seed=st.integers(0, 2**32))
def test_maps_to_the_chart_and_back_are_inverse(chart: ConvexChart, seed: int) -> None:
    points = np.random.default_rng(seed).uniform((1, 1), (9, 7), size=(5, 2))
    points = find_nearest_inside(chart.configuration_space, points)
    images, _ = chart.map_to_chart(points)
    np.testing.assert_allclose(chart.map_to_region(images), points, atol=1e-9)


def test_samples_belong_to_the_nearest_robot_in_range() -> None:
    rng = np.random.default_rng(1)
    samples = rng.uniform(0, 10, (300, 2))
    positions = rng.uniform(0, 10, (7, 2))
    robot, neighbor = Neighbors.from_ranges(positions, np.full(7, 5.0)).list_pairs()
    is_own = find_own_samples(samples, positions, robot, positions[neighbor])
    centroids = compute_sample_centroids(is_own, samples, np.ones(300), positions)
    for i in range(7):
        known = [i, *neighbor[robot == i]]
        distances = np.hypot(*(samples[:, None] - positions[known]).transpose(2, 0, 1))
        np.testing.assert_array_equal(is_own[i], distances.argmin(axis=1) == 0)
        np.testing.assert_allclose(centroids[i], samples[is_own[i]].mean(axis=0))


def test_robots_without_samples_are_their_own_centroids() -> None:
    positions = np.array([[1.0, 2.0], [3.0, 4.0]])
    is_own = np.zeros((2, 5), dtype=bool)
    centroids = compute_sample_centroids(is_own, np.ones((5, 2)), np.ones(5), positions)
    np.testing.assert_array_equal(centroids, positions)


@pytest.mark.parametrize(
    "density", [None, Gaussians((Gaussian((8.0, 3.0), weight=4.0, sigma=2.0),), floor=0.3)]
)
def test_without_obstacles_it_is_lloyds_algorithm(density: Gaussians | None) -> None:
    """F is the identity; because cells are sampled, centroids agree within 3 cm."""
    environment = PENTAGON.with_density(density) if density else PENTAGON
    controller = Diffeomorphism(shrink=1.0, clearance=0.0).inform(environment)
    lloyd = Lloyd()
    positions = np.array([[2.0, 2.0], [3.0, 5.0], [8.0, 4.0], [7.0, 1.5]])
    region = environment.region
    seen = Observations(
        positions, np.zeros((4, 2)), Neighbors(4), np.full((4, 2), np.nan), region, density=density
    )
    team = Team.homogeneous(4)
    memory = controller.decide(seen, controller.begin(region, team)).memory
    expected = lloyd.decide(seen, lloyd.begin(region, team)).goals
    np.testing.assert_allclose(memory.chart_centroids, expected, atol=0.03)


@pytest.mark.slow
def test_robots_move_through_the_door_to_the_other_side_of_a_wall() -> None:
    """Robots of Lloyd's algorithm stay on their side."""
    starts = [[2.0, 1.0], [3.0, 2.0]]
    record = Simulation(DOOR, Diffeomorphism(lattice=32.0), starts).run(25.0)
    assert (record.positions[-1, :, 0] > 5.0).sum() == 1
    assert shapely.distance(DOOR.free.boundary, shapely.points(record.positions)).min() > 0.1
    lloyd = Simulation(DOOR, Lloyd(), starts).run(25.0)
    assert (lloyd.positions[-1, :, 0] < 5.0).all()


def test_without_a_map_it_cannot_start() -> None:
    with pytest.raises(ParameterError, match=r"'diffeomorphism': expected a map, call inform"):
        Diffeomorphism().begin(DOOR.region, Team.homogeneous(1))


def test_a_map_without_space_for_robots_is_rejected() -> None:
    with pytest.raises(ParameterError, match=r"map 'door': no space for robots that keep 5\.1 m"):
        Diffeomorphism(clearance=5.0).inform(DOOR).begin(DOOR.region, Team.homogeneous(1))
