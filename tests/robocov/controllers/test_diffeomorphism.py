from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from robocov.controllers import Diffeomorphism, Lloyd
from robocov.controllers.diffeomorphism import Chart
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment, PolygonObstacle, WallObstacle
from robocov.errors import ParameterError
from robocov.mapfile import load_map
from robocov.observation import Observations
from robocov.observation.neighbours import Neighbours
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi.sampled_cells import compute_sample_centroids, find_own_samples

PENTAGON = Environment("pentagon", ((0, 0), (10, -1), (12, 6), (5, 9), (-1, 5)))
BLOCK = PolygonObstacle(((3, 3), (6, 3.5), (5, 6)))
WALLS = (WallObstacle(((5, 0), (5, 6)), 0.2), BLOCK)
DOOR = Environment("door", ((0, 0), (10, 0), (10, 8), (0, 8)), (WallObstacle(((5, 0), (5, 6)), 0.2),))


def turned(chart: Chart) -> np.ndarray:
    """The areas of the images of the triangles, in those of the triangles."""
    doubled = []
    for points in (chart.image, chart.points):
        sides = np.diff(points[chart.triangles], axis=1)
        doubled.append(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])
    assert (doubled[1] > 0.0).all()
    return np.asarray(doubled[0] / doubled[1])


@pytest.mark.parametrize("name", ["rooms", "museum", "l-shape", "pentagon"])
@pytest.mark.parametrize("shrink", [1.0, 1e4])
def test_charts_are_one_to_one(name: str, shrink: float) -> None:
    """No triangle is turned over (Tutte, Floater), and the boundary stays."""
    environment = load_map(name)
    chart = Chart(environment, 0.13, 48, shrink)
    assert (turned(chart) > 0.0).all()
    edge = shapely.distance(environment.region.polygon.exterior, shapely.points(chart.points)) < 1e-5
    np.testing.assert_array_equal(chart.image[edge], chart.points[edge])
    if shrink == 1.0:
        np.testing.assert_allclose(chart.image, chart.points, atol=1e-9)
    assert chart.mass.sum() == pytest.approx(environment.free_area, rel=1e-3)


def test_obstacles_become_points() -> None:
    environment = Environment("block", PENTAGON.boundary, (BLOCK,))
    sizes = []
    for shrink in (1.0, 1e2, 1e4):
        chart = Chart(environment, 0.1, 48, shrink)
        inside = shapely.contains_xy(BLOCK.polygon, chart.points)
        sizes.append(np.ptp(chart.image[inside], axis=0).max())
    assert sizes[0] > 1.5 and sizes[1] < 0.4 * sizes[0] and sizes[2] < 0.01 * sizes[0]


@given(seed=st.integers(0, 2**32))
def test_slopes_are_the_differences_of_the_chart(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place, step = rng.uniform((1, 1), (9, 7), size=(1, 2)), rng.normal(scale=1e-7, size=(1, 2))
    (image, slope), (other, same) = CHART.at(place), CHART.at(place + step)
    if shapely.contains_xy(CHART.room.buffer(-0.01), place).all() and (slope == same).all():
        np.testing.assert_allclose(other - image, (slope @ step[..., None])[..., 0], atol=1e-13)
        np.testing.assert_allclose(CHART.back(image), place, atol=1e-9)


CHART = Chart(Environment("walls", ((0, 0), (10, 0), (10, 8), (0, 8)), WALLS), 0.13, 24, 100.0)


def test_samples_belong_to_the_nearest_robot_that_is_heard() -> None:
    rng = np.random.default_rng(1)
    places, positions = rng.uniform(0, 10, (300, 2)), rng.uniform(0, 10, (7, 2))
    robot, other = Neighbours.from_ranges(positions, np.full(7, 5.0)).list_pairs()
    mine = find_own_samples(places, positions, robot, positions[other])
    for i in range(7):
        known = [i, *other[robot == i]]
        nearest = np.hypot(*(places[:, None] - positions[known]).transpose(2, 0, 1)).argmin(axis=1)
        np.testing.assert_array_equal(mine[i], nearest == 0)
        middle = places[mine[i]].mean(axis=0)
        np.testing.assert_allclose(compute_sample_centroids(mine, places, np.ones(300), positions)[i], middle)
    nobody = compute_sample_centroids(np.zeros((7, 300), dtype=bool), places, np.ones(300), positions)
    np.testing.assert_array_equal(nobody, positions)


@pytest.mark.parametrize(
    "density", [None, Gaussians((Gaussian((8.0, 3.0), weight=4.0, sigma=2.0),), floor=0.3)]
)
def test_without_obstacles_it_is_lloyds_algorithm(density: Gaussians | None) -> None:
    """Where F is the identity; cells are sampled, so that centroids agree to a centimetre or two."""
    environment = PENTAGON.with_density(density) if density else PENTAGON
    law = Diffeomorphism(shrink=1.0, clearance=0.0).inform(environment)
    positions = np.array([[2.0, 2.0], [3.0, 5.0], [8.0, 4.0], [7.0, 1.5]])
    nothing, region = np.full((4, 2), np.nan), environment.region
    seen = Observations(positions, np.zeros((4, 2)), Neighbours(4), nothing, region, density=density)
    team = Team.homogeneous(4)
    memory = law.decide(seen, law.begin(region, team)).memory
    lloyd = Lloyd().decide(seen, Lloyd().begin(region, team))
    np.testing.assert_allclose(memory.centroids, lloyd.goals, atol=0.03)


@pytest.mark.slow
def test_robots_go_round_the_wall_to_the_other_side() -> None:
    """From one side of a wall, through its door: Lloyd's robots stay at the wall."""
    starts = [[2.0, 1.0], [3.0, 2.0]]
    record = Simulation(DOOR, Diffeomorphism(lattice=32.0), starts).run(25.0)
    beyond = record.positions[-1, :, 0] > 5.0
    assert beyond.sum() == 1
    assert shapely.distance(DOOR.free.boundary, shapely.points(record.positions)).min() > 0.1
    lloyd = Simulation(DOOR, Lloyd(), starts).run(25.0)
    assert (lloyd.positions[-1, :, 0] < 5.0).all()


def test_what_it_needs_is_told() -> None:
    team = Team.homogeneous(1)
    with pytest.raises(ParameterError, match="'diffeomorphism': it has not been told the map"):
        Diffeomorphism().begin(DOOR.region, team)
    with pytest.raises(ParameterError, match=r"map .door. has no room for robots that keep 5\.1 m"):
        Diffeomorphism(clearance=5.0).inform(DOOR).begin(DOOR.region, team)
