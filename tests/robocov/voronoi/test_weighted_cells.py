"""Cells of robots with different speeds: partition, shape and rounding."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples
from voronoi_cases import (
    PENTAGON,
    REGIONS,
    SQUARE,
    build_lattice,
    cluster_in_groups,
    compute_moment_about_centroid,
    names,
    pair_points,
    place_on_circle,
    place_on_line,
    scatter_points,
    seeds,
)

from robocov.density import Density, Gaussian, Gaussians, Uniform
from robocov.errors import InputError
from robocov.observation.close_pairs import find_close_pairs
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi import VoronoiPartition, WeightedCells, partition, partition_by_travel_time

FAMILIES = {
    "scattered": scatter_points,
    "lattice": build_lattice,
    "circle": place_on_circle,
    "collinear": place_on_line,
}
DEGENERATE = {**FAMILIES, "almost twins": pair_points, "huddles": cluster_in_groups}
SPEEDS = {
    "two": lambda n, rng: rng.choice([0.5, 1.0], n),
    "powers of two": lambda n, rng: rng.choice([0.5, 1.0, 2.0, 4.0], n),
    "all different": lambda n, rng: rng.uniform(0.3, 2.0, n),
    "almost equal": lambda n, rng: 1.0 + 10.0 ** rng.uniform(-16, -4, n),
    "very different": lambda n, rng: 10.0 ** rng.uniform(-3, 3, n),
}


def build_cell_of_discs(
    i: int, points: np.ndarray, speeds: np.ndarray, region: Region, neighbors: np.ndarray
) -> shapely.Geometry:
    """Return a cell of shapely: the region, cut by discs and half planes one after the other."""
    cell = region.polygon
    for j in neighbors:
        offset = points[j] - points[i]
        distance = float(np.hypot(*offset))
        if speeds[j] == speeds[i]:
            middle = (points[i] + points[j]) / 2
            along = offset / distance
            left = np.array([-along[1], along[0]])
            far = 4.0 * region.diameter
            corners = [middle + far * left, middle - far * left]
            corners += [corner - far * along for corner in reversed(corners)]
            cell = cell.intersection(shapely.Polygon(corners))
            continue
        square = (speeds[i] / speeds[j]) ** 2
        center = points[i] - offset * square / (1.0 - square)
        radius = np.sqrt(square) * distance / abs(1.0 - square)
        disc = shapely.Point(center).buffer(radius, quad_segs=4000)
        cell = cell.intersection(disc) if square < 1.0 else cell.difference(disc)
    return cell


@given(seeds, names, st.sampled_from(sorted(DEGENERATE)), st.sampled_from(sorted(SPEEDS)), st.integers(1, 40))
def test_cells_tile_the_region(seed: int, name: str, family: str, speeds: str, n: int) -> None:
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    points = np.unique(DEGENERATE[family](region, n, rng), axis=0)
    cells = partition_by_travel_time(points, SPEEDS[speeds](len(points), rng), region)
    # Nearly tangent circles of some micrometers and of a kilometer keep fewer digits.
    tolerance = 1e-6 if speeds == "very different" else 1e-9
    assert cells.masses.sum() == pytest.approx(region.area, rel=tolerance)
    first = cells.masses @ (cells.centroids - region.centroid)
    np.testing.assert_allclose(first, 0.0, atol=tolerance * region.area * region.diameter)


@settings(max_examples=count_examples(12))
@given(seeds, st.sampled_from(["square", "pentagon", "triangle", "corridor"]), st.floats(1.0, 9.0))
def test_cells_agree_with_discs_cut_by_shapely(seed: int, name: str, reach: float) -> None:
    rng = np.random.default_rng(seed)
    region = REGIONS[name]
    points = scatter_points(region, int(rng.integers(2, 9)), rng)
    n = len(points)
    speeds = rng.choice([0.4, 1.0, 1.0, 1.7], n)
    neighbors = Neighbors.from_ranges(points, np.full(n, reach))
    cells = partition_by_travel_time(points, speeds, region, neighbors)
    for i in range(n):
        expected = build_cell_of_discs(i, points, speeds, region, neighbors.list_neighbors(i))
        assert cells.masses[i] == pytest.approx(expected.area, abs=1e-6 * region.area)
        if expected.area > 1e-3 * region.area:
            np.testing.assert_allclose(cells.centroids[i], expected.centroid.coords[0], atol=1e-4)


@settings(max_examples=count_examples(40))
@given(seeds, st.integers(1, 30))
def test_each_point_is_in_the_cell_of_the_robot_that_arrives_first(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    points = scatter_points(PENTAGON, n, rng)
    speeds = rng.choice([0.5, 1.0, 1.5], n)
    cells = partition_by_travel_time(points, speeds, PENTAGON)
    if isinstance(cells, VoronoiPartition):
        return
    samples = scatter_points(PENTAGON, 200, rng)
    time = np.hypot(*(samples[:, None] - points).transpose(2, 0, 1)) / speeds
    outlines, owners = cells.outlines
    painted_owner = np.full(len(samples), -1)
    # The cell of a slow robot is painted over the hole that it makes in the cell of a fast one.
    for outline, owner in zip(outlines, owners.tolist(), strict=True):
        ring = shapely.polygons(outline)
        if shapely.is_ccw(ring.exterior):
            painted_owner[shapely.contains_xy(ring, *samples.T)] = owner
    sorted_time = np.sort(time, axis=1)
    is_clear = np.ones(len(samples), dtype=bool)
    if n > 1:
        is_clear = sorted_time[:, 1] - sorted_time[:, 0] > 0.01
    np.testing.assert_array_equal(painted_owner[is_clear], time.argmin(axis=1)[is_clear])


@settings(max_examples=count_examples(40))
@given(seeds, names, st.integers(1, 60))
def test_equal_speeds_give_the_ordinary_cells_to_the_last_bit(seed: int, name: str, n: int) -> None:
    rng = np.random.default_rng(seed)
    points = scatter_points(REGIONS[name], n, rng)
    cells = partition_by_travel_time(points, np.full(n, rng.uniform(0.1, 3.0)), REGIONS[name])
    ordinary = partition(points, REGIONS[name])
    assert cells.masses.tobytes() == ordinary.masses.tobytes()
    assert cells.centroids.tobytes() == ordinary.centroids.tobytes()


@settings(max_examples=count_examples(40))
@given(seeds, st.sampled_from(["square", "pentagon", "triangle"]), st.integers(2, 30))
def test_nearly_equal_speeds_give_nearly_equal_cells(seed: int, name: str, n: int) -> None:
    """The circles have radii of 10^13 m here and still give the ordinary cells up to 1e-12."""
    rng = np.random.default_rng(seed)
    points = scatter_points(REGIONS[name], n, rng)
    if len(find_close_pairs(points, 0.05)[0]):
        return
    cells = partition_by_travel_time(points, 1.0 + 1e-14 * rng.integers(1, 9, n), REGIONS[name])
    ordinary = partition(points, REGIONS[name])
    np.testing.assert_allclose(cells.masses, ordinary.masses, atol=1e-10)
    large = ordinary.masses > 0.01
    np.testing.assert_allclose(cells.centroids[large], ordinary.centroids[large], atol=1e-9)


def test_a_fast_robot_encloses_a_slow_one_whose_cell_is_a_disc() -> None:
    cells = partition_by_travel_time(np.array([[3.0, 3.0], [4.0, 3.0]]), np.array([1.0, 3.0]), SQUARE)
    assert isinstance(cells, WeightedCells)
    # Apollonius: center p - d / (k² - 1), radius k d / (k² - 1), k = 3
    assert cells.masses[0] == pytest.approx(np.pi * (3 / 8) ** 2, rel=1e-14)
    np.testing.assert_allclose(cells.centroids[0], [3.0 - 1 / 8, 3.0], atol=1e-15)
    assert cells.masses[1] == pytest.approx(36.0 - cells.masses[0], rel=1e-14)
    assert compute_moment_about_centroid(cells)[0] == pytest.approx(np.pi * (3 / 8) ** 4 / 2, rel=1e-13)
    outlines, owners = cells.outlines
    assert owners.tolist() == [1, 1, 0]
    assert cells.adjacency.tolist() == [[0, 1]]
    assert shapely.Polygon(outlines[2]).area == pytest.approx(cells.masses[0], rel=0.01)


def test_a_cell_may_have_two_components_and_a_centroid_outside() -> None:
    corridor = REGIONS["corridor"]
    cells = partition_by_travel_time(np.array([[20.0, 0.5], [19.0, 0.5]]), np.array([1.0, 4.0]), corridor)
    assert isinstance(cells, WeightedCells)
    outlines, owners = cells.outlines
    # The disc of the slow robot is narrower than the corridor.
    assert owners.tolist() == [1, 1, 0]
    cells = partition_by_travel_time(np.array([[20.0, 0.5], [10.0, 0.5]]), np.array([1.0, 4.0]), corridor)
    assert isinstance(cells, WeightedCells)
    outlines, owners = cells.outlines
    assert owners.tolist() == [1, 1, 0]
    assert sum(shapely.Polygon(outline).area for outline in outlines) == pytest.approx(40.0, rel=1e-3)
    # Behind the slow robot the fast one arrives first again, so its centroid lies beyond the slow robot.
    assert cells.centroids[1, 0] > 19.0


def test_speeds_that_differ_by_rounding_give_the_ordinary_cells() -> None:
    """Rounding decides whether bisectors meet 10^20 m away, but not which robot is nearer."""
    points = PENTAGON.centroid + np.array([[0.0, 0.0], [2.0**-6, 0.0], [2.0**-5, 0.0]])
    speeds = 1.0 + 4.0 * np.finfo(float).eps * np.arange(3)
    ordinary = partition(points, PENTAGON)
    np.testing.assert_allclose(
        partition_by_travel_time(points, speeds, PENTAGON).masses, ordinary.masses, rtol=1e-9
    )


def test_robots_at_one_position_share_a_cell_if_they_are_equally_fast() -> None:
    points = np.array([[2.0, 3.0], [2.0, 3.0], [4.0, 3.0], [2.0, 3.0]])
    cells = partition_by_travel_time(points, np.array([1.0, 2.0, 2.0, 2.0]), SQUARE)
    assert cells.masses[0] == 0.0
    np.testing.assert_array_equal(cells.centroids[0], points[0])
    np.testing.assert_allclose(cells.masses[[1, 2, 3]], [18.0, 18.0, 18.0])
    np.testing.assert_array_equal(cells.centroids[1], cells.centroids[3])


@settings(max_examples=count_examples(15))
@given(seeds, st.integers(2, 20))
def test_the_cost_of_given_cells_is_minimal_at_the_centroid(seed: int, n: int) -> None:
    """H = sum of the integrals of (|q - p| / v)² over the cells: dH/dp = 2 M (p - C) / v²."""
    rng = np.random.default_rng(seed)
    points = scatter_points(SQUARE, n, rng)
    speeds = rng.choice([0.5, 1.0, 1.5], n)
    cells = partition_by_travel_time(points, speeds, SQUARE)
    slope = 2.0 * (cells.masses / speeds**2)[:, None] * (points - cells.centroids)

    def compute_cost(positions: np.ndarray) -> float:
        moments = partition_by_travel_time(positions, speeds, SQUARE).polar_moments
        return float((moments / speeds**2).sum())

    i = int(rng.integers(n))
    step = 1e-5
    for axis in (0, 1):
        shift = np.zeros((n, 2))
        shift[i, axis] = step
        numeric = (compute_cost(points + shift) - compute_cost(points - shift)) / (2.0 * step)
        assert numeric == pytest.approx(slope[i, axis], abs=1e-5 * (1.0 + abs(slope[i, axis])))


@settings(max_examples=count_examples(40))
@given(seeds, st.integers(2, 25), st.floats(0.5, 6.0))
def test_a_cell_depends_only_on_the_neighbors_of_its_robot(seed: int, n: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    points = scatter_points(SQUARE, n, rng)
    speeds = rng.choice([0.5, 1.0], n)
    neighbors = Neighbors.from_ranges(points, np.full(n, reach))
    i = int(rng.integers(n))
    is_unknown = np.ones(n, dtype=bool)
    is_unknown[i] = False
    is_unknown[neighbors.list_neighbors(i)] = False
    new_points = points.copy()
    new_speeds = speeds.copy()
    for k in np.flatnonzero(is_unknown):
        position = scatter_points(SQUARE, 1, rng)[0]
        if np.hypot(*(position - points[i])) > reach:
            new_points[k] = position
        new_speeds[k] = rng.choice([0.5, 1.0, 2.0])
    before = partition_by_travel_time(points, speeds, SQUARE, neighbors)
    new_neighbors = Neighbors.from_ranges(new_points, np.full(n, reach))
    after = partition_by_travel_time(new_points, new_speeds, SQUARE, new_neighbors)
    assert before.masses[i].tobytes() == after.masses[i].tobytes()
    assert before.centroids[i].tobytes() == after.centroids[i].tobytes()


def test_reported_positions_replace_the_true_ones() -> None:
    points = np.array([[1.0, 1.0], [5.0, 1.0], [3.0, 5.0]])
    speeds = np.array([1.0, 2.0, 1.0])
    neighbors = Neighbors.from_ranges(points, np.full(3, 100.0))
    reports = points[neighbors.indices] + [[0.3, 0.1]] * 6
    cells = partition_by_travel_time(points, speeds, SQUARE, neighbors, reported_positions=reports)
    for i in range(3):
        known = points.copy()
        known[neighbors.list_neighbors(i)] = reports[neighbors.indptr[i] : neighbors.indptr[i + 1]]
        alone = partition_by_travel_time(known, speeds, SQUARE)
        assert cells.masses[i] == pytest.approx(alone.masses[i], rel=1e-12)


@pytest.mark.parametrize(
    ("points", "speeds", "message"),
    [
        ([[1.0, 2.0, 3.0]], [1.0], "generators: expected an array of shape"),
        ([[1.0, 2.0]], [0.0], r"speeds: expected 1 positive numbers, got \[0.0\]"),
        ([[1.0, 2.0]], [10**400], r"speeds: expected 1 positive numbers, got "),
        ([[1.0, 2.0]], [1.0, 2.0], "expected 1 positive numbers"),
        ([[1.0, 2.0]], ["fast"], "expected 1 positive numbers"),
        ([["east", 2.0]], [1.0], "generators: expected numbers"),
        ([[1.0, 2.0], [1.0, np.nan]], [1.0, 2.0], r"generators\[1\]"),
    ],
)
def test_unusable_generators_and_speeds_are_rejected(
    points: list[list[object]], speeds: list[object], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        partition_by_travel_time(points, speeds, SQUARE)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["gaussians", "uniform"])
def test_mass_and_moments_are_weighted_by_a_density(name: str) -> None:
    density: Density = Uniform(3.0)
    if name == "gaussians":
        density = Gaussians((Gaussian((2.0, 3.0), weight=4.0, sigma=0.8),), floor=0.5)
    points = scatter_points(SQUARE, 5, np.random.default_rng(7))
    speeds = np.array([1.0, 0.3, 1.0, 0.5, 0.3])
    cells = partition_by_travel_time(points, speeds, SQUARE, density=density)
    middles = (np.arange(600) + 0.5) / 100
    x, y = np.meshgrid(middles, middles)
    samples = np.column_stack([x.ravel(), y.ravel()])
    owner = (np.hypot(*(samples[:, None] - points).transpose(2, 0, 1)) / speeds).argmin(axis=1)
    weight = density.evaluate(samples) * 1e-4
    for i in range(5):
        is_owned = owner == i
        mass = weight[is_owned].sum()
        assert cells.masses[i] == pytest.approx(mass, rel=1e-2, abs=1e-3)
        if mass > 0.1:
            centroid = weight[is_owned] @ samples[is_owned] / mass
            np.testing.assert_allclose(cells.centroids[i], centroid, atol=0.02)
        polar = weight[is_owned] @ ((samples[is_owned] - points[i]) ** 2).sum(axis=1)
        assert cells.polar_moments[i] == pytest.approx(polar, rel=2e-2, abs=1e-3)
