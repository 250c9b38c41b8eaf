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
def test_polygons_with_holes_either_way_round(density):
    parts = [HOLED, shapely.reverse(HOLED), BENT]
    side = 600
    x = (np.arange(side) + 0.5) * 8.0 / side
    points = np.column_stack([np.tile(x, side), np.repeat(x, side)])
    values = density.evaluate(points) * (8.0 / side) ** 2
    masses = compute_polygon_masses(density, parts)
    wanted = [values[shapely.contains_xy(part, *points.T)].sum() for part in parts]
    assert_allclose(masses, wanted, rtol=1e-2)
    assert masses[0] == pytest.approx(masses[1], rel=1e-12)
    triangles = shapely.get_parts(shapely.constrained_delaunay_triangles(HOLED))
    assert compute_polygon_masses(density, list(triangles)).sum() == pytest.approx(masses[0], rel=1e-11)
    assert compute_polygon_masses(density, []).shape == (0,)


@pytest.mark.parametrize("density", KINDS.values(), ids=KINDS)
def test_squares_have_the_mean_of_their_polygons(density):
    middles, side = np.random.default_rng(1).uniform(0.0, 8.0, (40, 2)), 0.7
    boxes = [Polygon(shapely.box(x - 0.35, y - 0.35, x + 0.35, y + 0.35)) for x, y in middles]
    means = compute_square_means(density, middles, side)
    assert_allclose(means, compute_polygon_masses(density, boxes) / side**2, rtol=1e-9)
    assert (density.min_value <= means).all() and (means <= density.max_value).all()


def test_many_squares_are_taken_some_at_a_time(monkeypatch):
    density = Gaussians((Gaussian((3.0, 3.0), 2.0, sigma=1.0),), 0.5)
    middles = np.random.default_rng(1).uniform(0.0, 8.0, (50, 2))
    whole = compute_square_means(density, middles, 0.5)
    monkeypatch.setattr("robocov.density.polygon_masses._SQUARES_PER_BATCH", 7)
    assert_allclose(compute_square_means(density, middles, 0.5), whole, rtol=1e-13)


def test_far_away_rounding_makes_nothing_negative():
    peak = Gaussians((Gaussian((0.0, 0.0), 1.0, sigma=1.0),))
    means = compute_square_means(peak, np.random.default_rng(0).uniform(5.0, 50.0, (500, 2)), 0.3)
    assert (means >= 0.0).all()


def test_the_free_space_of_a_map():
    ring = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
    pillar = Environment("pillar", ring, (CircleObstacle((2.0, 2.0), 0.5),))
    assert pillar.free_masses.tolist() == [part.area for part in pillar.free.geoms]
    assert pillar.with_density(Uniform(2.0)).free_masses == pytest.approx(2.0 * pillar.free_area)
    peak = Gaussians((Gaussian((2.0, 2.0), 1.0, sigma=0.1),), 0.0)
    # nearly all of it is inside the pillar
    assert pillar.with_density(peak).free_masses[0] < 1e-4 * 2.0 * np.pi * 0.01


def test_weighed_maps_keep_their_geometry():
    ring = ((0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0))
    plain = Environment("pillar", ring, (CircleObstacle((2.0, 2.0), 0.5),))
    region, free = plain.region, plain.free
    twin = plain.with_density(Uniform(2.0))
    assert twin.region is region and twin.free is free and twin.density == Uniform(2.0)
    assert twin != plain and twin.has_same_geometry(plain) and twin.with_density(None) == plain
    assert not plain.has_same_geometry(Environment("other", ring))
