"""The density over polygons with holes and over the squares of a lattice."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from density_cases import KINDS
from numpy.testing import assert_allclose
from shapely import Polygon

from robocov.density import Gaussian, Gaussians, Uniform
from robocov.density.polygon_masses import compute_polygon_masses, compute_square_means
from robocov.environment import CircleObstacle, Environment

HOLED = Polygon([(0, 0), (8, 0), (8, 8), (0, 8)], [[(2, 2), (5, 2), (5, 5)]])
BENT = Polygon([(0, 0), (3, 0), (1, 1), (3, 3), (0, 3)])


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_masses_of_polygons_do_not_depend_on_their_orientation(density):
    polygons = [HOLED, shapely.reverse(HOLED), BENT]
    side = 600
    x = (np.arange(side) + 0.5) * 8.0 / side
    points = np.column_stack([np.tile(x, side), np.repeat(x, side)])
    values = density.evaluate(points) * (8.0 / side) ** 2
    masses = compute_polygon_masses(density, polygons)
    expected = [values[shapely.contains_xy(polygon, *points.T)].sum() for polygon in polygons]
    assert_allclose(masses, expected, rtol=1e-2)
    assert masses[0] == pytest.approx(masses[1], rel=1e-12)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(HOLED))
    assert compute_polygon_masses(density, list(triangles)).sum() == pytest.approx(masses[0], rel=1e-11)
    assert compute_polygon_masses(density, []).shape == (0,)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_means_of_squares_agree_with_masses_of_polygons(density):
    centers = np.random.default_rng(1).uniform(0.0, 8.0, (40, 2))
    side = 0.7
    boxes = [Polygon(shapely.box(x - 0.35, y - 0.35, x + 0.35, y + 0.35)) for x, y in centers]
    means = compute_square_means(density, centers, side)
    assert_allclose(means, compute_polygon_masses(density, boxes) / side**2, rtol=1e-9)
    assert (density.lower_bound <= means).all()
    assert (means <= density.upper_bound).all()


def test_batches_of_squares_do_not_change_their_means(monkeypatch):
    density = Gaussians((Gaussian((3.0, 3.0), 2.0, sigma=1.0),), 0.5)
    centers = np.random.default_rng(1).uniform(0.0, 8.0, (50, 2))
    means = compute_square_means(density, centers, 0.5)
    monkeypatch.setattr("robocov.density.polygon_masses._SQUARES_PER_BATCH", 7)
    assert_allclose(compute_square_means(density, centers, 0.5), means, rtol=1e-13)


def test_rounding_far_from_a_peak_gives_no_negative_means():
    peak = Gaussians((Gaussian((0.0, 0.0), 1.0, sigma=1.0),))
    means = compute_square_means(peak, np.random.default_rng(0).uniform(5.0, 50.0, (500, 2)), 0.3)
    assert (means >= 0.0).all()


def test_the_free_masses_of_a_map_are_weighted_by_its_density():
    ring = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
    pillar = Environment("pillar", ring, (CircleObstacle((2.0, 2.0), 0.5),))
    assert pillar.free_masses.tolist() == [component.area for component in pillar.free.geoms]
    assert pillar.with_density(Uniform(2.0)).free_masses == pytest.approx(2.0 * pillar.free_area)
    peak = Gaussians((Gaussian((2.0, 2.0), 1.0, sigma=0.1),), 0.0)
    # Nearly all of the mass is inside the pillar.
    assert pillar.with_density(peak).free_masses[0] < 1e-4 * 2.0 * np.pi * 0.01


def test_maps_with_another_density_share_their_geometry():
    ring = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
    plain = Environment("pillar", ring, (CircleObstacle((2.0, 2.0), 0.5),))
    region = plain.region
    free = plain.free
    weighted = plain.with_density(Uniform(2.0))
    assert weighted.region is region
    assert weighted.free is free
    assert weighted.density == Uniform(2.0)
    assert weighted != plain
    assert weighted.has_same_geometry(plain)
    assert weighted.with_density(None) == plain
    assert not plain.has_same_geometry(Environment("other", ring))
