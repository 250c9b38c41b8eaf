"""The density φ: values, and exact integrals over cells, against quadrature and against identities."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from density_cases import GAUSSIANS, KINDS, POLYGONS, RASTERS, integrate_on_fine_lattice
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
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

SHAPE = Region(np.array([[0.0, 0.0], [10.0, 0.0], [11.0, 7.0], [3.0, 9.0]]))
SQUARE = Region(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]]))
ROW = [[1.0, 1.0], [7.0, 2.0], [6.0, 6.0], [3.5, 4.0], [4.0, 7.0], [2.0, 3.0]]


def build_cells(density, points=ROW, region=SHAPE):
    return partition(np.array(points), region, density=density)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_mass_centroid_and_polar_moment_are_those_of_quadrature(density):
    cells = build_cells(density)
    for k, ring in enumerate(cells.polygons):
        mass, centroid, polar = integrate_on_fine_lattice(density, ring, cells.generators[k])
        smooth = isinstance(density, Uniform | Gaussians)
        within = 2e-4 if smooth else 8e-3
        assert cells.mass[k] == pytest.approx(mass, rel=within)
        assert_allclose(cells.centroid[k], centroid, atol=within)
        assert cells.polar_moment[k] == pytest.approx(polar, rel=2 * within)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 12))
@settings(max_examples=5, deadline=None)
def test_cells_share_the_whole_among_them(density, seed, count):
    """Masses, first and polar moments about one point add up to those of the region in one piece."""
    points = np.random.default_rng(seed).uniform((0.0, 0.0), (8.0, 8.0), (count, 2))
    cells, whole = build_cells(density, points, SQUARE), build_cells(density, [[4.0, 4.0]], SQUARE)
    assert cells.mass.sum() == pytest.approx(whole.mass[0], rel=1e-11)
    assert_allclose(cells.mass @ cells.centroid, whole.mass[0] * whole.centroid[0], rtol=1e-10)
    lever = np.square(cells.centroid - [4.0, 4.0]).sum(axis=1)
    about = compute_moment_about_centroid(cells) + cells.mass * lever
    assert about.sum() == pytest.approx(whole.polar_moment[0], rel=1e-10)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
@given(seed=st.integers(0, 10_000))
@settings(max_examples=4, deadline=None)
def test_the_parallel_axis_identity(density, seed):
    """Equation (3), with the moment about the centroid from cells that have it as their generator."""
    points = np.random.default_rng(seed).uniform(1.0, 7.0, (4, 2))
    cells = build_cells(density, points, SQUARE)
    for k, ring in enumerate(cells.polygons):
        alone = build_cells(density, cells.centroid[[k]], Region(ring))
        assert compute_moment_about_centroid(cells)[k] == pytest.approx(alone.polar_moment[0], rel=1e-9)


@pytest.mark.parametrize("density", [*GAUSSIANS.values(), RASTERS["bilinear"], POLYGONS["rooms"]])
@given(seed=st.integers(0, 10_000))
@settings(max_examples=4, deadline=None)
def test_the_gradient_of_the_locational_cost(density, seed):
    """(13) with φ: the sum of the polar moments falls by 2 M (p - C) as a robot moves."""
    rng = np.random.default_rng(seed)
    points, i = rng.uniform(1.0, 7.0, (5, 2)), int(rng.integers(5))
    cells, step = build_cells(density, points, SQUARE), 1e-5
    slope = 2.0 * cells.mass[i] * (points[i] - cells.centroid[i])
    for axis in (0, 1):
        ends = []
        for sign in (1.0, -1.0):
            moved = points.copy()
            moved[i, axis] += sign * step
            ends.append(build_cells(density, moved, SQUARE).polar_moment.sum())
        assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(slope[axis], abs=1e-4 * cells.mass.sum())


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_voronoi_cells_are_the_best_partition(density):
    """(5): with any other assignment of places the locational cost is larger."""
    points = np.array(ROW)
    best = build_cells(density, points, SQUARE).polar_moment.sum()
    rng = np.random.default_rng(1)
    for _ in range(5):
        other = build_cells(density, points + rng.normal(0.0, 0.3, points.shape), SQUARE)
        off = np.square(points - other.centroid).sum(axis=1)
        assert (compute_moment_about_centroid(other) + other.mass * off).sum() > best


@pytest.mark.parametrize("count", [5, 30])
def test_one_everywhere_is_as_no_density_to_the_last_bit(count):
    points = np.random.default_rng(3).uniform(1.0, 6.0, (count, 2))
    plain, one = build_cells(None, points), build_cells(Uniform(), points)
    assert np.array_equal(plain.mass, one.mass)
    assert np.array_equal(plain.centroid, one.centroid)
    assert np.array_equal(plain.polar_moment, one.polar_moment)
    assert_allclose(build_cells(Uniform(3.0), points).mass, 3.0 * plain.mass, rtol=1e-15)
    assert np.array_equal(build_cells(Uniform(3.0), points).centroid, plain.centroid)
    assert np.array_equal(build_cells(Gaussians((), 2.0), points).centroid, plain.centroid)


def test_values_of_all_kinds():
    points = np.array([[3.0, 3.0], [0.5, 0.5]])
    peak = Gaussian((3.0, 3.0), 2.0, covariance=((2.0, 0.5), (0.5, 1.0)))
    assert Gaussians((peak, peak), 0.25).evaluate(points)[0] == pytest.approx(4.25)
    away = np.array([[-2.5, -2.5]])
    square = float((away @ np.linalg.inv(np.array(peak.matrix)) @ away.T)[0, 0])
    assert Gaussians((peak,)).evaluate(points)[1] == pytest.approx(2.0 * np.exp(-0.5 * square))
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


def test_sampling_keeps_linear_densities():
    values = np.arange(6.0)[None, :] + 2.0 * np.arange(4.0)[:, None] + 1.0
    raster = Raster(values, (0.0, 0.0, 6.0, 4.0))
    finer = sample_density(raster, (0.5, 0.5, 5.5, 3.5), 50, 30)
    inside = np.random.default_rng(0).uniform((1.0, 1.0), (5.0, 3.0), (100, 2))
    assert_allclose(finer.evaluate(inside), raster.evaluate(inside), rtol=1e-12)
    assert sample_density(None, (0.0, 0.0, 1.0, 1.0), 3, 3).values.tolist() == [[1.0] * 3] * 3


def test_where_nothing_counts_the_centroid_is_that_of_the_area():
    corner = WeightedArea(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), 1.0)
    points = [[0.5, 0.5], [6.0, 6.0], [7.0, 1.0]]
    cells = build_cells(WeightedPolygons((corner,), 0.0), points, SQUARE)
    plain = build_cells(None, points, SQUARE)
    assert cells.mass.tolist() == pytest.approx([1.0, 0.0, 0.0], abs=1e-13)
    assert_allclose(cells.centroid[0], [0.5, 0.5], atol=1e-6)
    assert_allclose(cells.centroid[1:], plain.centroid[1:], atol=1e-6)


@given(x=st.floats(4.0, 60.0))
@settings(max_examples=12, deadline=None)
def test_far_from_a_hot_spot_the_centroid_goes_over_smoothly(x):
    """Where the closed form has lost all its digits, targets neither jump nor leave their cells."""
    peak = Gaussians((Gaussian((0.0, 0.0), 1.0, sigma=1.0),))
    cell = Region(np.array([[x, -0.5], [x + 1.0, -0.5], [x + 1.0, 0.5], [x, 0.5]]))
    near, far = (build_cells(peak, [[x + 0.5, 0.1 + shift]], cell) for shift in (0.0, 1e-9))
    assert (cell.contains(near.centroid, 1e-6)).all()
    assert_allclose(near.centroid, far.centroid, atol=1e-3)


def test_cells_that_touch_and_coincide_with_areas():
    """Edges of areas that lie on borders of cells, exactly or nearly, count once."""
    halves = [[2.0, 4.0], [6.0, 4.0]]
    for shift in (0.0, 1e-16, 1e-15, -1e-13, 1e-9):
        area = WeightedArea(((4.0 + shift, 0.0), (8.0, 0.0), (8.0, 8.0), (4.0 + shift, 8.0)), 3.0)
        cells = build_cells(WeightedPolygons((area,), 0.0), halves, SQUARE)
        assert_allclose(cells.mass, [0.0, 96.0], atol=1e-6)
    ring = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
    hole = ((2.0, 2.0), (2.0, 6.0), (6.0, 6.0), (6.0, 2.0))
    cells = build_cells(WeightedPolygons((WeightedArea(ring, 2.0, (hole,)),), 1.0), halves, SQUARE)
    assert_allclose(cells.mass, [32.0 + 24.0] * 2, rtol=1e-14)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=12, deadline=None)
def test_weighted_polygons_agree_with_intersections_by_shapely(seed):
    """An independent second way: the cells cut by the areas, the later ones on top."""
    rng = np.random.default_rng(seed)
    areas, above = [], shapely.MultiPolygon()
    for _ in range(4):
        ring = shapely.MultiPoint(rng.uniform(-1.0, 9.0, (7, 2))).convex_hull.exterior.coords[:-1]
        areas.append(WeightedArea(tuple(ring), float(rng.uniform(0.0, 5.0))))
    density = WeightedPolygons(tuple(areas), 0.5)
    cells = build_cells(density, rng.uniform(0.5, 7.5, (5, 2)), SQUARE)
    rings = [shapely.Polygon(ring) for ring in cells.polygons]
    mass = np.zeros(len(rings))
    for area in reversed(areas):
        part = area.polygon - above
        above = above | area.polygon
        mass += [area.weight * (ring & part).area for ring in rings]
    mass += [0.5 * (ring - above).area for ring in rings]
    assert_allclose(cells.mass, mass, rtol=1e-9)


@given(seed=st.integers(0, 10_000), rows=st.integers(1, 9), columns=st.integers(1, 9))
@settings(max_examples=12, deadline=None)
def test_a_raster_of_cells_is_that_many_polygons(seed, rows, columns):
    rng = np.random.default_rng(seed)
    values = rng.uniform(0.0, 3.0, (rows, columns))
    x, y = np.linspace(1.0, 7.0, columns + 1), np.linspace(0.0, 8.0, rows + 1)
    areas = [
        WeightedArea(((x[i], y[j]), (x[i + 1], y[j]), (x[i + 1], y[j + 1]), (x[i], y[j + 1])), values[j, i])
        for j in range(rows)
        for i in range(columns)
    ]
    inner = Region(np.array([[1.0, 0.0], [7.0, 0.0], [7.0, 8.0], [1.0, 8.0]]))
    points = rng.uniform((1.0, 0.0), (7.0, 8.0), (6, 2))
    raster = build_cells(Raster(values, (1.0, 0.0, 7.0, 8.0), "cells"), points, inner)
    polygons = build_cells(WeightedPolygons(tuple(areas), 0.0), points, inner)
    assert_allclose(raster.mass, polygons.mass, rtol=1e-9, atol=1e-12)
    assert_allclose(raster.polar_moment, polygons.polar_moment, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_a_cell_depends_only_on_robots_within_range(density):
    """To the last bit, however many others there are, and wherever they are."""
    rng = np.random.default_rng(5)
    points = rng.uniform(0.5, 7.5, (40, 2))
    ranges = np.full(len(points), 1.6)

    def list_cell_values(places, i):
        heard = Neighbors.from_ranges(places, ranges[: len(places)])
        cells = partition(places, SQUARE, heard, density=density)
        return cells.mass[i], *cells.centroid[i], cells.polar_moment[i]

    moved = points.copy()
    away = np.flatnonzero(np.hypot(*(points - points[0]).T) > 3.4)
    moved[away] = rng.uniform(0.5, 7.5, (len(away), 2))
    still_away = np.hypot(*(moved[away] - points[0]).T) > 1.7
    moved[away[~still_away]] = points[away[~still_away]]
    assert list_cell_values(points, 0) == list_cell_values(moved, 0)
    near = np.flatnonzero(np.hypot(*(points - points[0]).T) <= 1.6)
    assert list_cell_values(points, 0) == list_cell_values(points[near], 0)


def test_densities_are_values():
    values = np.ones((3, 4))
    a, b = Raster(values, (0.0, 0.0, 1.0, 1.0)), Raster(values.copy(), (0.0, 0.0, 1.0, 1.0))
    assert a == b and hash(a) == hash(b) and a != Raster(2 * values, (0.0, 0.0, 1.0, 1.0))
    assert a != Uniform()
    values[0, 0] = 7.0
    assert a == b
    with pytest.raises(ValueError, match="read-only"):
        a.values[0, 0] = 2.0
    assert a.is_uniform and Uniform().is_uniform and not GAUSSIANS["two"].is_uniform
    assert (a.min_value, a.max_value) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Uniform(0.0), "weight: expected a number above 0 to 1000000, got 0.0"),
        (lambda: Uniform(float("nan")), "weight: expected .* got nan"),
        (lambda: Gaussian((0.0, 0.0), -1.0, sigma=1.0), "weight: expected .* got -1.0"),
        (lambda: Gaussian((0.0, 0.0), 1.0), "sigma, covariance: expected one of them, got neither"),
        (lambda: Gaussian((0.0, 0.0), 1.0, sigma=0.0), "sigma: expected a number above 0, got 0.0 m"),
        (lambda: Gaussian((0.0, 0.0), 1.0, covariance=((1.0, 2.0), (2.0, 1.0))), "positive definite"),
        (lambda: Gaussian((0.0, 0.0), 1.0, covariance=((1.0, 0.2), (0.1, 1.0))), "symmetric"),
        (lambda: Gaussians(()), "floor: expected a number above 0 or a peak"),
        (lambda: WeightedPolygons((), 0.0), "background: expected a number above 0 or an area"),
        (
            lambda: Raster(np.zeros((2, 2)), (0.0, 0.0, 1.0, 1.0)),
            "values: expected at least one",
        ),
        (lambda: Raster(np.ones(3), (0.0, 0.0, 1.0, 1.0)), "shape"),
        (lambda: Raster(np.ones((1, MAX_RASTER_SIZE + 1)), (0.0, 0.0, 1.0, 1.0)), "shape"),
        (lambda: Raster(-np.ones((2, 2)), (0.0, 0.0, 1.0, 1.0)), "from 0 to"),
        (lambda: Raster(np.ones((2, 2)), (0.0, 0.0, 0.0, 1.0)), "a width and a height"),
        (lambda: Raster(np.ones((2, 2)), (0.0, 0.0, 1.0, 1.0), "cubic"), "bilinear or cells"),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_density(make, words):
    with pytest.raises(ParameterError, match=words):
        make()
