from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from robocov.controllers import Lloyd, RangeLimited
from robocov.density import Gaussian, Gaussians
from robocov.environment import Environment
from robocov.observation import Observations
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.voronoi import build_disc_limited_polygons, compute_disc_limited_moments, partition

REGION = Region(np.array([[0.0, 0.0], [11.0, -1.0], [12.0, 8.0], [3.0, 10.0]]))
SQUARE = Environment("square", ((0, 0), (10, 0), (10, 10), (0, 10)))


def seen_from(positions: np.ndarray, reach: float = np.inf, **more: object) -> Observations:
    n = len(positions)
    neighbours = Neighbours.from_ranges(positions, np.full(n, reach))
    nothing = np.full((n, 2), np.nan)
    return Observations(positions, np.zeros((n, 2)), neighbours, nothing, REGION, **more)  # type: ignore[arg-type]


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32), n=st.integers(1, 12), radius=st.floats(0.05, 8.0))
def test_limited_cells_are_those_that_shapely_cuts(seed: int, n: int, radius: float) -> None:
    """An independent way: shapely's intersection with a disc of 4096 sides."""
    positions = np.random.default_rng(seed).uniform((1, 1), (10, 7), size=(n, 2))
    cells = partition(positions, REGION)
    area, centroid = compute_disc_limited_moments(cells.edges, np.full(n, radius))
    for i, ring in enumerate(cells.polygons):
        disc = shapely.Point(positions[i]).buffer(radius, quad_segs=1024)
        part = shapely.Polygon(ring).intersection(disc)
        assert area[i] == pytest.approx(part.area, rel=2e-6)
        np.testing.assert_allclose(positions[i] + centroid[i], part.centroid.coords[0], atol=3e-6 * radius)


@given(seed=st.integers(0, 2**32), outside=st.floats(0.1, 3.0))
def test_a_generator_outside_its_cell(seed: int, outside: float) -> None:
    """A robot that was pushed out of the region: the part of its cell in the disc, or nothing."""
    along = np.random.default_rng(seed).uniform(2.0, 8.0)
    positions = np.array([[-outside, along], [6.0, 4.0]])
    square = Region(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]]))
    cells = partition(positions, square)
    area, centroid = compute_disc_limited_moments(cells.edges, np.full(2, 1.0))
    part = shapely.Polygon(cells.polygons[0]).intersection(
        shapely.Point(positions[0]).buffer(1.0, quad_segs=1024)
    )
    assert area[0] == pytest.approx(part.area, abs=1e-5)
    if part.area == 0.0:
        assert (centroid[0] == 0.0).all()


def test_a_disc_that_holds_the_cell_changes_nothing() -> None:
    positions = np.random.default_rng(1).uniform((2, 1), (10, 7), size=(9, 2))
    cells = partition(positions, REGION)
    for radius in (20.0, np.inf):
        area, centroid = compute_disc_limited_moments(cells.edges, np.full(9, radius))
        np.testing.assert_allclose(area, cells.mass, rtol=1e-12)
        np.testing.assert_allclose(positions + centroid, cells.centroid, rtol=1e-12)


def test_polygons_of_chords_have_nearly_the_same_moments() -> None:
    positions = np.random.default_rng(2).uniform((2, 1), (10, 7), size=(7, 2))
    cells = partition(positions, REGION)
    radius = np.array([0.5, 1.0, 1.5, 2.0, 3.0, 5.0, np.inf])
    area, centroid = compute_disc_limited_moments(cells.edges, radius)
    edges = build_disc_limited_polygons(cells.edges, radius)
    cross = edges.start[:, 0] * edges.end[:, 1] - edges.start[:, 1] * edges.end[:, 0]
    chords = 0.5 * np.bincount(edges.cell, cross, minlength=7)
    assert (chords <= area * (1 + 1e-12)).all()
    np.testing.assert_allclose(chords, area, rtol=5e-4)
    for k in (0, 1):
        first = np.bincount(edges.cell, cross * (edges.start + edges.end)[:, k] / 6.0, minlength=7)
        np.testing.assert_allclose(first / chords, centroid[:, k], atol=1e-3)


@given(seed=st.integers(0, 2**32))
def test_who_is_farther_than_the_range_does_not_matter(seed: int) -> None:
    """The cell is determined by the robots within r: the others may be heard or not."""
    positions = np.random.default_rng(seed).uniform((2, 1), (10, 7), size=(12, 2))
    law = RangeLimited(interaction_range=2.5)
    team = Team.homogeneous(12)
    all_heard = law.decide(seen_from(positions), law.begin(REGION, team))
    near_heard = law.decide(seen_from(positions, 2.5), law.begin(REGION, team))
    assert all_heard.goals is not None
    np.testing.assert_allclose(near_heard.goals, all_heard.goals, atol=1e-9)


def test_without_a_limit_it_is_lloyd() -> None:
    positions = np.random.default_rng(3).uniform((2, 1), (10, 7), size=(9, 2))
    team = Team.homogeneous(9)
    seen = seen_from(positions)
    free, lloyd = RangeLimited(interaction_range=None), Lloyd()
    one = free.decide(seen, free.begin(REGION, team)).forces
    other = lloyd.decide(seen, lloyd.begin(REGION, team)).forces
    np.testing.assert_allclose(one, other, atol=1e-9)


def limited_cost(positions: np.ndarray, radius: float) -> float:
    """The integral of min(|q - p|², radius²) over the square, by a fine grid."""
    x, y = (np.meshgrid(*(np.arange(0.05, 10, 0.1),) * 2)[k].ravel() for k in (0, 1))
    square = ((x[:, None] - positions[:, 0]) ** 2 + (y[:, None] - positions[:, 1]) ** 2).min(axis=1)
    return float(np.minimum(square, radius**2).mean())


@pytest.mark.parametrize("seed", [0, 1])
def test_it_descends_the_cost_of_limited_range(seed: int) -> None:
    """What the paper claims of it, once the robots are at speed."""
    starts = np.random.default_rng(seed).uniform(3, 6, size=(5, 2))
    while (np.hypot(*(starts[:, None] - starts).T) + np.eye(5) < 0.5).any():
        starts = starts * 1.05
    simulation = Simulation(SQUARE, RangeLimited(interaction_range=4.0), starts)
    costs = [limited_cost(simulation.positions, 2.0)]
    for _ in range(20):
        for _ in range(30):
            simulation.step()
        costs.append(limited_cost(simulation.positions, 2.0))
    assert (np.diff(costs) < 1e-4).all()
    assert costs[-1] < 0.9 * costs[0]


def test_a_density_draws_the_centroid_of_what_is_in_range() -> None:
    bell = Gaussians((Gaussian((6.5, 4.0), 1.0, 0.5),), floor=0.01)
    positions = np.array([[5.0, 4.0]])
    law = RangeLimited(interaction_range=4.0)
    seen = seen_from(positions, density=bell)
    goals = law.decide(seen, law.begin(REGION, Team.homogeneous(1))).goals
    x, y = (
        part.ravel() for part in np.meshgrid(np.arange(3, 7, 0.01) + 0.005, np.arange(2, 6, 0.01) + 0.005)
    )
    inside = np.hypot(x - 5, y - 4) < 2
    places = np.column_stack([x, y])[inside]
    weight = bell.evaluate(places)
    assert goals is not None
    np.testing.assert_allclose(goals[0], (places * weight[:, None]).sum(axis=0) / weight.sum(), atol=3e-3)


def test_each_cell_is_limited_by_the_robots_own_communication_range() -> None:
    """The range of one robot does not limit the cells of the others."""
    positions = np.array([[3.0, 4.0], [8.0, 4.0]])
    team = replace(Team.homogeneous(2), communication_range=np.array([1.0, 8.0]))
    controller = RangeLimited(interaction_range=None)
    decision = controller.decide(seen_from(positions), controller.begin(REGION, team))
    assert decision.goals is not None
    cells = partition(positions, REGION)
    for robot, radius in enumerate((0.5, 4.0)):
        disc = shapely.Point(positions[robot]).buffer(radius, quad_segs=1024)
        limited_cell = shapely.Polygon(cells.polygons[robot]).intersection(disc)
        np.testing.assert_allclose(decision.goals[robot], limited_cell.centroid.coords[0], atol=1e-4)
