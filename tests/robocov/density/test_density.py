"""The density φ: values and exact integrals over cells, checked by quadrature and by identities."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely
from density_cases import GAUSSIANS, KINDS, POLYGONS, RASTERS, integrate_on_fine_lattice
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from property_examples import count_examples
from voronoi_cases import compute_moment_about_centroid

from robocov.density import (
    MAX_RASTER_SIZE,
    Gaussian,
    Gaussians,
    Raster,
    Uniform,
    WeightedArea,
    WeightedPolygons,
    sample_density,
)
from robocov.errors import ParameterError
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi import partition

QUADRILATERAL = Region(np.array([[0.0, 0.0], [10.0, 0.0], [11.0, 7.0], [3.0, 9.0]]))
SQUARE = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]]))
ROBOTS = [[1.0, 1.0], [7.0, 2.0], [6.0, 6.0], [3.5, 4.0], [4.0, 7.0], [2.0, 3.0]]


def build_cells(density, points=ROBOTS, region=QUADRILATERAL):
    return partition(np.array(points), region, density=density)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_mass_centroid_and_polar_moment_agree_with_quadrature(density):
    cells = build_cells(density)
    for k, ring in enumerate(cells.polygons):
        mass, centroid, polar = integrate_on_fine_lattice(density, ring, cells.generators[k])
        is_smooth = isinstance(density, Uniform | Gaussians)
        tolerance = 2e-4 if is_smooth else 8e-3
        assert cells.masses[k] == pytest.approx(mass, rel=tolerance)
        assert_allclose(cells.centroids[k], centroid, atol=tolerance)
        assert cells.polar_moments[k] == pytest.approx(polar, rel=2 * tolerance)


@pytest.mark.parametrize("side", [0.01, 0.5, 2.0, 8.0])
def test_moments_are_accurate_on_cells_much_smaller_than_a_gaussian(side):
    """The cell is a square on which the density is nearly constant, and the generator its center."""
    density = Gaussians((Gaussian((0.0, 0.0), 3.0, sigma=1e4),))
    corners = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]]
    cell = build_cells(density, [[0.5 * side, 0.5 * side]], Region(np.array(corners)))
    assert cell.masses[0] == pytest.approx(3.0 * side**2, rel=1e-6)
    assert cell.polar_moments[0] == pytest.approx(3.0 * side**4 / 6.0, rel=1e-6)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=count_examples(10), deadline=None)
def test_closed_form_and_quadrature_agree_on_small_cells(seed):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-20.0, 28.0, 2)
    density = Gaussians((Gaussian((x, y), 2.0, covariance=((400.0, 100.0), (100.0, 300.0))),))
    points = rng.uniform(1.0, 7.0, (6, 2))
    exact = build_cells(density, points, SQUARE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robocov.density.gaussians._SMALL_CELL_SIZE", np.inf)
        numeric = build_cells(density, points, SQUARE)
        # The moments are computed only when they are needed.
        polar_moments = numeric.polar_moments
    assert_allclose(numeric.masses, exact.masses, rtol=1e-11)
    assert_allclose(numeric.centroids, exact.centroids, rtol=1e-10)
    assert_allclose(polar_moments, exact.polar_moments, rtol=1e-8)
    assert not np.array_equal(polar_moments, exact.polar_moments)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 12))
@settings(max_examples=count_examples(5), deadline=None)
def test_moments_of_cells_add_up_to_those_of_the_region(density, seed, count):
    """Check masses, first moments and polar moments about one point."""
    points = np.random.default_rng(seed).uniform((0.0, 0.0), (8.0, 8.0), (count, 2))
    cells = build_cells(density, points, SQUARE)
    region_cell = build_cells(density, [[4.0, 4.0]], SQUARE)
    assert cells.masses.sum() == pytest.approx(region_cell.masses[0], rel=1e-11)
    first_moment = region_cell.masses[0] * region_cell.centroids[0]
    assert_allclose(cells.masses @ cells.centroids, first_moment, rtol=1e-10)
    lever = np.square(cells.centroids - [4.0, 4.0]).sum(axis=1)
    polar_moments = compute_moment_about_centroid(cells) + cells.masses * lever
    assert polar_moments.sum() == pytest.approx(region_cell.polar_moments[0], rel=1e-10)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
@given(seed=st.integers(0, 10_000))
@settings(max_examples=count_examples(4), deadline=None)
def test_moments_obey_the_parallel_axis_theorem(density, seed):
    """Check equation (3) with moments of cells whose generator is the centroid."""
    points = np.random.default_rng(seed).uniform(1.0, 7.0, (4, 2))
    cells = build_cells(density, points, SQUARE)
    for k, ring in enumerate(cells.polygons):
        centered = build_cells(density, cells.centroids[[k]], Region(ring))
        assert compute_moment_about_centroid(cells)[k] == pytest.approx(centered.polar_moments[0], rel=1e-9)


@pytest.mark.parametrize("density", [*GAUSSIANS.values(), RASTERS["bilinear"], POLYGONS["rooms"]])
@given(seed=st.integers(0, 10_000))
@settings(max_examples=count_examples(4), deadline=None)
def test_the_gradient_of_the_locational_cost_agrees_with_finite_differences(density, seed):
    """Check (13) with φ: the gradient of the sum of polar moments is 2 M (p - C)."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(1.0, 7.0, (5, 2))
    i = int(rng.integers(5))
    cells = build_cells(density, points, SQUARE)
    step = 1e-5
    slope = 2.0 * cells.masses[i] * (points[i] - cells.centroids[i])
    for axis in (0, 1):
        costs = []
        for sign in (1.0, -1.0):
            moved = points.copy()
            moved[i, axis] += sign * step
            costs.append(build_cells(density, moved, SQUARE).polar_moments.sum())
        difference_quotient = (costs[0] - costs[1]) / (2 * step)
        assert difference_quotient == pytest.approx(slope[axis], abs=1e-4 * cells.masses.sum())


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_voronoi_cells_are_the_best_partition(density):
    """Check (5): the cells of other generators have a larger locational cost."""
    points = np.array(ROBOTS)
    best = build_cells(density, points, SQUARE).polar_moments.sum()
    rng = np.random.default_rng(1)
    for _ in range(5):
        cells = build_cells(density, points + rng.normal(0.0, 0.3, points.shape), SQUARE)
        squared_lever = np.square(points - cells.centroids).sum(axis=1)
        assert (compute_moment_about_centroid(cells) + cells.masses * squared_lever).sum() > best


@pytest.mark.parametrize("count", [5, 30])
def test_a_density_of_one_equals_no_density_to_the_last_bit(count):
    points = np.random.default_rng(3).uniform(1.0, 6.0, (count, 2))
    plain = build_cells(None, points)
    uniform = build_cells(Uniform(), points)
    assert np.array_equal(plain.masses, uniform.masses)
    assert np.array_equal(plain.centroids, uniform.centroids)
    assert np.array_equal(plain.polar_moments, uniform.polar_moments)
    assert_allclose(build_cells(Uniform(3.0), points).masses, 3.0 * plain.masses, rtol=1e-15)
    assert np.array_equal(build_cells(Uniform(3.0), points).centroids, plain.centroids)
    assert np.array_equal(build_cells(Gaussians((), 2.0), points).centroids, plain.centroids)


def test_densities_of_each_kind_have_the_expected_values():
    points = np.array([[3.0, 3.0], [0.5, 0.5]])
    peak = Gaussian((3.0, 3.0), 2.0, covariance=((2.0, 0.5), (0.5, 1.0)))
    assert Gaussians((peak, peak), 0.25).evaluate(points)[0] == pytest.approx(4.25)
    offset = np.array([-2.5, -2.5])
    squared_distance = float(offset @ np.linalg.inv(np.array(peak.matrix)) @ offset)
    assert Gaussians((peak,)).evaluate(points)[1] == pytest.approx(2.0 * np.exp(-0.5 * squared_distance))
    assert Uniform(2.0).evaluate(points).tolist() == [2.0, 2.0]
    room = WeightedArea(((2.0, 2.0), (4.0, 2.0), (4.0, 4.0), (2.0, 4.0)), 5.0)
    on_top = WeightedArea(((2.5, 2.5), (3.5, 2.5), (3.5, 3.5), (2.5, 3.5)), 0.5)
    assert WeightedPolygons((room, on_top)).evaluate(points).tolist() == [0.5, 1.0]
    assert WeightedPolygons((on_top, room)).evaluate(points).tolist() == [5.0, 1.0]


def test_a_raster_has_its_lowest_row_first_and_extends_beyond_its_border():
    values = [[1.0, 2.0], [3.0, 4.0]]
    flat = Raster(np.array(values), (0.0, 0.0, 4.0, 2.0), "cells")
    points = np.array([[1.0, 0.5], [3.0, 0.5], [1.0, 1.5], [3.0, 1.5], [9.0, -3.0]])
    assert flat.evaluate(points).tolist() == [1.0, 2.0, 3.0, 4.0, 2.0]
    smooth = Raster(np.array(values), (0.0, 0.0, 4.0, 2.0))
    assert smooth.evaluate(points).tolist() == [1.0, 2.0, 3.0, 4.0, 2.0]
    assert smooth.evaluate(np.array([[2.0, 1.0]])).tolist() == [2.5]


def test_sampling_preserves_linear_densities():
    values = np.arange(6.0)[None, :] + 2.0 * np.arange(4.0)[:, None] + 1.0
    raster = Raster(values, (0.0, 0.0, 6.0, 4.0))
    finer = sample_density(raster, (0.5, 0.5, 5.5, 3.5), 50, 30)
    inside = np.random.default_rng(0).uniform((1.0, 1.0), (5.0, 3.0), (100, 2))
    assert_allclose(finer.evaluate(inside), raster.evaluate(inside), rtol=1e-12)
    assert sample_density(None, (0.0, 0.0, 1.0, 1.0), 3, 3).values.tolist() == [[1.0] * 3] * 3


def test_cells_without_mass_have_the_centroid_of_their_area():
    corner = WeightedArea(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), 1.0)
    points = [[0.5, 0.5], [6.0, 6.0], [7.0, 1.0]]
    cells = build_cells(WeightedPolygons((corner,), 0.0), points, SQUARE)
    plain = build_cells(None, points, SQUARE)
    assert cells.masses.tolist() == pytest.approx([1.0, 0.0, 0.0], abs=1e-13)
    assert_allclose(cells.centroids[0], [0.5, 0.5], atol=1e-6)
    assert_allclose(cells.centroids[1:], plain.centroids[1:], atol=1e-6)


@given(x=st.floats(4.0, 60.0))
@settings(max_examples=count_examples(12), deadline=None)
def test_centroids_far_from_a_peak_are_continuous(x):
    """If the closed form loses all digits, centroids do not jump and stay in their cells."""
    peak = Gaussians((Gaussian((0.0, 0.0), 1.0, sigma=1.0),))
    cell = Region(np.array([[x, -0.5], [x + 1.0, -0.5], [x + 1.0, 0.5], [x, 0.5]]))
    cells = build_cells(peak, [[x + 0.5, 0.1]], cell)
    shifted_cells = build_cells(peak, [[x + 0.5, 0.1 + 1e-9]], cell)
    assert cell.contains(cells.centroids, 1e-6).all()
    assert_allclose(cells.centroids, shifted_cells.centroids, atol=1e-3)


def test_edges_of_areas_on_borders_of_cells_count_once():
    """The edges lie on the borders exactly or up to rounding."""
    centers = [[2.0, 4.0], [6.0, 4.0]]
    for shift in (0.0, 1e-16, 1e-15, -1e-13, 1e-9):
        area = WeightedArea(((4.0 + shift, 0.0), (8.0, 0.0), (8.0, 8.0), (4.0 + shift, 8.0)), 3.0)
        cells = build_cells(WeightedPolygons((area,), 0.0), centers, SQUARE)
        assert_allclose(cells.masses, [0.0, 96.0], atol=1e-6)
    ring = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
    hole = ((2.0, 2.0), (2.0, 6.0), (6.0, 6.0), (6.0, 2.0))
    cells = build_cells(WeightedPolygons((WeightedArea(ring, 2.0, (hole,)),), 1.0), centers, SQUARE)
    assert_allclose(cells.masses, [32.0 + 24.0] * 2, rtol=1e-14)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=count_examples(12), deadline=None)
def test_weighted_polygons_agree_with_intersections_by_shapely(seed):
    """The cells are cut by the areas, and later areas are on top."""
    rng = np.random.default_rng(seed)
    areas = []
    for _ in range(4):
        ring = shapely.MultiPoint(rng.uniform(-1.0, 9.0, (7, 2))).convex_hull.exterior.coords[:-1]
        areas.append(WeightedArea(tuple(ring), float(rng.uniform(0.0, 5.0))))
    density = WeightedPolygons(tuple(areas), 0.5)
    cells = build_cells(density, rng.uniform(0.5, 7.5, (5, 2)), SQUARE)
    rings = [shapely.Polygon(ring) for ring in cells.polygons]
    mass = np.zeros(len(rings))
    above = shapely.MultiPolygon()
    for area in reversed(areas):
        visible_part = area.polygon - above
        above = above | area.polygon
        mass += [area.weight * (ring & visible_part).area for ring in rings]
    mass += [0.5 * (ring - above).area for ring in rings]
    assert_allclose(cells.masses, mass, rtol=1e-9)


@given(seed=st.integers(0, 10_000), rows=st.integers(1, 9), columns=st.integers(1, 9))
@settings(max_examples=count_examples(12), deadline=None)
def test_a_raster_of_cells_equals_polygons(seed, rows, columns):
    rng = np.random.default_rng(seed)
    values = rng.uniform(0.0, 3.0, (rows, columns))
    x = np.linspace(1.0, 7.0, columns + 1)
    y = np.linspace(0.0, 8.0, rows + 1)
    areas = [
        WeightedArea(((x[i], y[j]), (x[i + 1], y[j]), (x[i + 1], y[j + 1]), (x[i], y[j + 1])), values[j, i])
        for j in range(rows)
        for i in range(columns)
    ]
    inner = Region(np.array([[1.0, 0.0], [7.0, 0.0], [7.0, 8.0], [1.0, 8.0]]))
    points = rng.uniform((1.0, 0.0), (7.0, 8.0), (6, 2))
    raster = build_cells(Raster(values, (1.0, 0.0, 7.0, 8.0), "cells"), points, inner)
    polygons = build_cells(WeightedPolygons(tuple(areas), 0.0), points, inner)
    assert_allclose(raster.masses, polygons.masses, rtol=1e-9, atol=1e-12)
    assert_allclose(raster.polar_moments, polygons.polar_moments, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_a_cell_depends_only_on_robots_within_range(density):
    """Other robots do not change a bit of it."""
    rng = np.random.default_rng(5)
    points = rng.uniform(0.5, 7.5, (40, 2))
    ranges = np.full(len(points), 1.6)

    def list_cell_values(positions, i):
        neighbors = Neighbors.from_ranges(positions, ranges[: len(positions)])
        cells = partition(positions, SQUARE, neighbors, density=density)
        return cells.masses[i], *cells.centroids[i], cells.polar_moments[i]

    moved = points.copy()
    distant = np.flatnonzero(np.hypot(*(points - points[0]).T) > 3.4)
    moved[distant] = rng.uniform(0.5, 7.5, (len(distant), 2))
    has_come_near = np.hypot(*(moved[distant] - points[0]).T) <= 1.7
    moved[distant[has_come_near]] = points[distant[has_come_near]]
    assert list_cell_values(points, 0) == list_cell_values(moved, 0)
    in_range = np.flatnonzero(np.hypot(*(points - points[0]).T) <= 1.6)
    assert list_cell_values(points, 0) == list_cell_values(points[in_range], 0)


def test_densities_are_immutable_and_compare_by_value():
    values = np.ones((3, 4))
    bounds = (0.0, 0.0, 1.0, 1.0)
    raster = Raster(values, bounds)
    equal_raster = Raster(values.copy(), bounds)
    assert raster == equal_raster
    assert hash(raster) == hash(equal_raster)
    assert raster != Raster(2 * values, bounds)
    assert raster != Uniform()
    values[0, 0] = 7.0
    assert raster == equal_raster
    with pytest.raises(ValueError, match="read-only"):
        raster.values[0, 0] = 2.0
    assert raster.is_uniform
    assert Uniform().is_uniform
    assert not GAUSSIANS["two"].is_uniform
    assert (raster.lower_bound, raster.upper_bound) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Uniform(0.0), "weight: expected a number above 0 to 1000000, got 0.0"),
        (lambda: Uniform(float("nan")), "weight: expected .* got nan"),
        (lambda: Gaussian((0.0, 0.0), -1.0, sigma=1.0), "weight: expected .* got -1.0"),
        (lambda: Gaussian((0.0, 0.0), 1.0), "sigma, covariance: expected one of them, got neither"),
        (lambda: Gaussian((0.0, 0.0), 1.0, sigma=0.0), r"sigma: expected a number from 1e-100 to 1e\+100"),
        (lambda: Gaussian((0.0, 0.0), 1.0, sigma=1e155), r"1e\+100 m, got 1e\+155"),
        (lambda: Gaussian((0.0, 0.0), 1.0, sigma="1"), r"sigma: expected a number .* got '1'"),  # type: ignore[arg-type]
        (lambda: Gaussian((0.0, 0.0), "1", sigma=1.0), r"weight: expected a number .* got '1'"),  # type: ignore[arg-type]
        (
            lambda: Gaussian((np.nan, 0.0), 1.0, sigma=1.0),
            r"center: expected finite x and y .* got \(nan, 0\.0\)",
        ),
        (lambda: Gaussian("ab", 1.0, sigma=1.0), r"center: expected finite x and y in meters, got 'ab'"),  # type: ignore[arg-type]
        (lambda: Gaussian((1.0, 0.0, 3.0), 1.0, sigma=1.0), "center: expected finite x and y"),  # type: ignore[arg-type]
        (lambda: Gaussian((0.0, 0.0), 1.0, covariance=1.0), "covariance: expected a symmetric"),  # type: ignore[arg-type]
        (lambda: Gaussian((0.0, 0.0), 1.0, covariance=np.eye(3)), "covariance: expected a symmetric"),  # type: ignore[arg-type]
        (
            lambda: Gaussian((0.0, 0.0), 1.0, covariance=((1.0, 1.0 - 2e-10), (1.0 - 2e-10, 1.0))),
            "covariance: expected .* an absolute correlation of at most 1 - 5e-10, got",
        ),
        (lambda: Gaussian((0.0, 0.0), 1.0, covariance=((1e-300, 0.0), (0.0, 1e-300))), "positive definite"),
        (lambda: Gaussian((0.0, 0.0), 1.0, covariance=((1.0, 2.0), (2.0, 1.0))), "positive definite"),
        (lambda: Gaussian((0.0, 0.0), 1.0, covariance=((1.0, 0.2), (0.1, 1.0))), "symmetric"),
        (lambda: Gaussians(()), "floor: expected a number above 0 or a peak"),
        (lambda: WeightedPolygons((), 0.0), "background: expected a number above 0 or an area"),
        (
            lambda: Raster(np.zeros((2, 2)), (0.0, 0.0, 1.0, 1.0)),
            "values: expected at least one",
        ),
        (lambda: Raster(np.ones(3), (0.0, 0.0, 1.0, 1.0)), "shape"),
        (lambda: Raster([[1.0, 2.0], [3.0]], (0.0, 0.0, 1.0, 1.0)), "values: expected rows of numbers"),  # type: ignore[arg-type]
        (lambda: Raster(np.ones((1, MAX_RASTER_SIZE + 1)), (0.0, 0.0, 1.0, 1.0)), "shape"),
        (lambda: Raster(-np.ones((2, 2)), (0.0, 0.0, 1.0, 1.0)), "from 0 to"),
        (lambda: Raster(np.ones((2, 2)), None), "extent: expected"),  # type: ignore[arg-type]
        (lambda: Raster(np.ones((2, 2)), (0.0, 0.0, 1.0)), "extent: expected"),  # type: ignore[arg-type]
        (lambda: Raster(np.ones((2, 2)), (0.0, 0.0, 0.0, 1.0)), "a width and a height"),
        (lambda: Raster(np.ones((2, 2)), (0.0, 0.0, 1.0, 1.0), "cubic"), "bilinear or cells"),  # type: ignore[arg-type]
    ],
)
def test_invalid_densities_are_rejected(build, message):
    with pytest.raises(ParameterError, match=message):
        build()


def test_densities_from_arrays_equal_those_from_tuples():
    covariance = np.cov(np.random.default_rng(0).normal(size=(2, 50)))
    from_arrays = Gaussian(np.array([2.0, 1.0]), 1.0, covariance=covariance)  # type: ignore[arg-type]
    (xx, xy), (yx, yy) = covariance.tolist()
    from_tuples = Gaussian((2.0, 1.0), 1.0, covariance=((xx, xy), (yx, yy)))
    assert Gaussians([from_arrays]) == Gaussians((from_tuples,))  # type: ignore[arg-type]
    assert hash(from_arrays) == hash(from_tuples)
    ring = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0))
    hole = ((2.0, 1.0), (3.0, 1.0), (3.0, 2.0))
    area = WeightedArea(np.array(ring), 3.0, [np.array(hole)])  # type: ignore[arg-type]
    assert WeightedPolygons([area]) == WeightedPolygons((WeightedArea(ring, 3.0, (hole,)),))  # type: ignore[arg-type]
    assert hash(area) == hash(WeightedArea(ring, 3.0, (hole,)))


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        (((0.0, 0.0), (1.0, 1.0)), "vertices: expected at least 3 points with finite coordinates"),
        (((0.0, 0.0), (1.0, 1.0), (0.0, np.nan)), "vertices: expected at least 3 points with finite"),
        (((0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)), r"areas\[0\]: expected a valid polygon"),
    ],
)
def test_invalid_areas_are_rejected_before_they_are_integrated(vertices, message):
    density = WeightedPolygons((WeightedArea(vertices, 3.0),))
    with pytest.raises(ParameterError, match=message):
        build_cells(density)


def test_the_extent_of_a_raster_may_be_a_list():
    extent: Any = [0, 0, 8, 8]
    raster = Raster(np.array([[1.0, 2.0]]), extent)
    assert raster == Raster(np.array([[1.0, 2.0]]), (0.0, 0.0, 8.0, 8.0))
    assert build_cells(raster).masses.sum() > 0.0
