"""Geodesic distances and paths: known values, brute force, and properties."""

from __future__ import annotations

import brute_force_geodesic as brute
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.cost import CoverageCost
from robocov.environment import Environment, PolygonObstacle
from robocov.errors import InputError
from robocov.geodesic import Geodesics

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
BAY = ((0, 0), (8, 0), (8, 4), (4, 4), (4, 6), (8, 6), (8, 8), (0, 8), (2, 4))


def build_environment(*obstacles, boundary=SQUARE):
    return Environment(
        "test", boundary, tuple(PolygonObstacle(tuple(map(tuple, ring))) for ring in obstacles)
    )


def build_ring(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


PILLAR = build_environment(build_ring(3 / 8, 3 / 8, 5 / 8, 5 / 8))
PILLAR_WITH_COLLINEAR_VERTICES = build_environment(
    [
        (3 / 8, 3 / 8),
        (1 / 2, 3 / 8),
        (5 / 8, 3 / 8),
        (5 / 8, 7 / 16),
        (5 / 8, 5 / 8),
        (7 / 16, 5 / 8),
        (3 / 8, 5 / 8),
    ]
)
CUP = build_environment(
    [
        *((1 / 4, 1 / 4), (3 / 4, 1 / 4), (3 / 4, 3 / 4), (5 / 8, 3 / 4)),
        *((5 / 8, 3 / 8), (3 / 8, 3 / 8), (3 / 8, 3 / 4), (1 / 4, 3 / 4)),
    ]
)
PINCH = build_environment(build_ring(1 / 4, 1 / 4, 1 / 2, 1 / 2), build_ring(1 / 2, 1 / 2, 3 / 4, 3 / 4))
SHARED_EDGE = build_environment(
    build_ring(1 / 4, 1 / 4, 1 / 2, 3 / 4), build_ring(1 / 2, 1 / 4, 3 / 4, 3 / 4)
)
MAZE = build_environment(
    *[build_ring(x, 1 if k % 2 else 0, x + 1, 8 if k % 2 else 7) for k, x in enumerate((1, 3, 5))],
    boundary=((0, 0), (8, 0), (8, 8), (0, 8)),
)


@pytest.mark.parametrize(
    ("environment", "source", "target", "expected"),
    [
        (PILLAR, (1 / 8, 1 / 2), (7 / 8, 1 / 2), 0.809016994375),
        (PILLAR_WITH_COLLINEAR_VERTICES, (1 / 8, 1 / 2), (7 / 8, 1 / 2), 0.809016994375),
        (PILLAR, (3 / 8, 1 / 2), (7 / 8, 1 / 2), 0.654508497187),
        (PILLAR, (3 / 8, 5 / 8), (7 / 8, 1 / 2), 0.529508497187),
        (PILLAR, (3 / 8, 3 / 8), (3 / 8, 3 / 8), 0.0),
        (CUP, (1 / 2, 1 / 2), (1 / 2, 1 / 8), 1.184016994375),
        (PINCH, (3 / 8, 5 / 8), (5 / 8, 3 / 8), 0.853553390593),
        (SHARED_EDGE, (1 / 2, 1 / 8), (1 / 2, 7 / 8), 1.059016994375),
        # Above the first wall, below the second and above the third one.
        (MAZE, (0.5, 0.5), (7.5, 7.5), np.hypot(0.5, 6.5) + 2 + 2 * np.hypot(1, 6) + np.hypot(2.5, 0.5)),
    ],
)
def test_distances_agree_with_closed_forms(environment, source, target, expected):
    distances = Geodesics(environment)
    assert distances.compute_distances([source], [target])[0, 0] == pytest.approx(expected, abs=1e-12)
    assert distances.compute_distances([target], [source])[0, 0] == pytest.approx(expected, abs=1e-12)


def test_paths_pass_collinear_walls_that_touch_in_a_point():
    # The bottoms of both obstacles are on one line and touch in a point; the space below is free.
    environment = build_environment(
        [(1, 1), (3, 1), (2, 3)], build_ring(3, 1, 6, 4), boundary=((0, 0), (8, 0), (8, 8), (0, 8))
    )
    assert Geodesics(environment).compute_distances([[0.5, 1]], [[7, 1]])[0, 0] == pytest.approx(
        6.5, abs=1e-12
    )
    # Above the line the pinch blocks: the path leads around the triangle or around the box.
    above = Geodesics(environment).compute_distances([[2.75, 2]], [[2.5, 0.5]])[0, 0]
    expected = brute.compute_distances(environment.free, [(2.75, 2.0)], [(2.5, 0.5)])[0, 0]
    assert above == pytest.approx(expected, abs=1e-12)
    assert above > 3.0


def test_a_robot_on_a_pinch_sees_both_sides():
    distances = Geodesics(PINCH).compute_distances([[1 / 2, 1 / 2]], [[3 / 8, 5 / 8], [5 / 8, 3 / 8]])
    assert distances[0] == pytest.approx([np.hypot(1 / 8, 1 / 8)] * 2, abs=1e-12)


def test_sealed_rooms_are_infinitely_far():
    environment = build_environment(build_ring(3, 0, 5, 8), boundary=((0, 0), (8, 0), (8, 8), (0, 8)))
    assert len(environment.free.geoms) == 2
    distances = Geodesics(environment).compute_distances([[1, 1], [7, 7]], [[2, 2], [6, 6]])
    assert np.isinf(distances).tolist() == [[False, True], [True, False]]
    assert Geodesics(environment).find_path(np.array([1.0, 1.0]), np.array([7.0, 7.0])).shape == (0, 2)


cell = st.integers(0, 16).map(lambda k: k / 2)
boxes = (
    st.tuples(cell, cell, cell, cell)
    .filter(lambda b: b[0] < b[2] and b[1] < b[3])
    .map(lambda b: build_ring(*b))
)
triangles = st.tuples(*[st.tuples(cell, cell)] * 3).filter(lambda t: shapely.Polygon(t).area > 0.1)
diamonds = st.tuples(cell, cell, st.sampled_from([0.5, 1.0, 2.0])).map(
    lambda d: ((d[0] + d[2], d[1]), (d[0], d[1] + d[2]), (d[0] - d[2], d[1]), (d[0], d[1] - d[2]))
)
maps = st.builds(
    lambda obstacles, boundary: build_environment(*obstacles, boundary=boundary),
    st.lists(boxes | boxes | triangles | diamonds, max_size=6),
    st.sampled_from([build_ring(0, 0, 8, 8), BAY]),
).filter(lambda environment: environment.free_area > 6.0)


def draw_points(data, environment, count):
    """Draw points of the closed free space: vertices, points on walls or in line with them, any points."""
    vertices = np.unique(shapely.get_coordinates(environment.free), axis=0)
    on_grid = st.tuples(st.integers(0, 32), st.integers(0, 32)).map(lambda p: (p[0] / 4, p[1] / 4))
    anywhere = st.tuples(*[st.integers(0, 2**23).map(lambda k: k / 2**20)] * 2)
    at_vertex = st.integers(0, len(vertices) - 1).map(lambda k: tuple(vertices[k].tolist()))
    points = data.draw(st.lists(on_grid | anywhere | at_vertex, min_size=count, max_size=count + 4))
    free_points = [
        point
        for point in points
        if shapely.intersects_xy(environment.free, *point)
        and brute.is_well_placed(environment.free, point, 8.0)
    ]
    assume(free_points)
    return free_points


@settings(max_examples=count_examples(250), deadline=None)
@given(maps, st.data())
def test_distances_agree_with_brute_force(environment, data):
    sources = draw_points(data, environment, 2)
    targets = draw_points(data, environment, 3)
    expected = brute.compute_distances(environment.free, sources, targets)
    np.testing.assert_allclose(
        Geodesics(environment).compute_distances(sources, targets), expected, rtol=0, atol=8e-12
    )


@settings(max_examples=count_examples(150), deadline=None)
@given(maps, st.data())
def test_the_cost_agrees_with_brute_force(environment, data):
    robots = draw_points(data, environment, 3)
    cost = CoverageCost(environment, lattice=7, radius=0.0)
    result = cost(robots)
    is_compared = [brute.is_well_placed(environment.free, point, 8.0) for point in cost.points]
    expected = brute.compute_distances(environment.free, robots, cost.points).min(axis=0)
    np.testing.assert_allclose(result.distances[is_compared], expected[is_compared], rtol=0, atol=8e-12)
    assert ((result.owners >= 0) == np.isfinite(result.distances)).all()


@settings(max_examples=count_examples(60), deadline=None)
@given(maps, st.data())
def test_paths_are_as_long_as_the_distance_and_stay_in_the_free_space(environment, data):
    source, *others = draw_points(data, environment, 4)
    geodesics = Geodesics(environment)
    for target in others:
        path = geodesics.find_path(np.array(source), np.array(target))
        distance = geodesics.compute_distances([source], [target])[0, 0]
        if np.isinf(distance):
            assert path.shape == (0, 2)
            continue
        assert np.hypot(*np.diff(path, axis=0).T).sum() == pytest.approx(distance, abs=8e-12)
        assert shapely.LineString(path).difference(environment.free.buffer(1e-9)).length < 1e-9
        np.testing.assert_allclose(path[[0, -1]], [source, target], rtol=0, atol=1e-12)


@settings(max_examples=count_examples(60), deadline=None)
@given(maps, st.data())
def test_distances_are_a_metric_no_shorter_than_the_straight_line(environment, data):
    points = np.array(draw_points(data, environment, 4))
    vertices = shapely.get_coordinates(environment.free)
    is_no_vertex = np.array([not (vertices == point).all(axis=1).any() for point in points])
    distances = Geodesics(environment).compute_distances(points, points)
    straight = np.hypot(*(points[:, None] - points).transpose(2, 0, 1))
    assert (distances >= straight - 1e-11).all()
    np.testing.assert_array_equal(np.diag(distances), 0.0)
    finite = np.where(np.isinf(distances), 1e9, distances)
    np.testing.assert_allclose(finite, finite.T, rtol=0, atol=1e-11)
    # A point on a pinch belongs to both of its sides, and would be a short cut.
    detours = distances[:, is_no_vertex, None] + distances[None, is_no_vertex]
    assert (distances <= detours.min(axis=1, initial=np.inf) + 1e-11).all()


def test_without_obstacles_the_distance_is_euclidean():
    rng = np.random.default_rng(5)
    points = rng.uniform(size=(20, 2))
    distances = Geodesics(build_environment()).compute_distances(points, points)
    np.testing.assert_allclose(
        distances, np.hypot(*(points[:, None] - points).transpose(2, 0, 1)), atol=1e-15
    )


SLANTED = build_environment([(0.2, 0.31), (0.7, 0.17), (0.83, 0.59), (0.4, 0.77)])


@pytest.mark.parametrize("depth", [-1e-9, -1e-15, 0.0, 1e-15, 1e-9, 1e-6])
def test_points_barely_inside_an_obstacle_are_moved_to_its_wall(depth):
    geodesics = Geodesics(SLANTED)
    start = np.array([0.2, 0.31])
    end = np.array([0.7, 0.17])
    inward = np.array([start[1] - end[1], end[0] - start[0]]) / np.hypot(*(end - start))
    target = np.array([[0.6, 0.9]])
    tolerance = 1.1e-6 if depth == 1e-6 else 3e-8
    for fraction in np.linspace(0.01, 0.99, 30):
        wall_point = start + fraction * (end - start)
        distance = geodesics.compute_distances([wall_point + depth * inward], target)[0, 0]
        distance_from_outside = geodesics.compute_distances([wall_point - 1e-8 * inward], target)[0, 0]
        assert distance == pytest.approx(distance_from_outside, abs=tolerance)
        assert distance > np.hypot(*(wall_point - target[0])) + 0.01


@pytest.mark.parametrize("point", [(0.5, 0.4), (1.1, 0.5), (-1e-3, 0.2), (1e9, 0.0)])
def test_errors_name_points_outside_the_free_space(point):
    with pytest.raises(
        InputError,
        match=r"positions\[1\]: expected a point .* of map 'test', got \[.*\], .* m outside the free space",
    ):
        Geodesics(SLANTED).snap_to_free_space([[0.1, 0.1], point])


def test_a_map_without_free_space_contains_no_point():
    square = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    full = Environment("full", square, (PolygonObstacle(square),))
    with pytest.raises(InputError, match=r"positions\[0\]: map 'full' has no free space"):
        Geodesics(full).snap_to_free_space([[0.5, 0.5]])


def test_errors_name_points_that_are_not_finite():
    with pytest.raises(InputError, match=r"positions\[0\]: expected finite numbers, got \[nan, 1\]"):
        Geodesics(SLANTED).snap_to_free_space([[np.nan, 1.0]])
    with pytest.raises(
        InputError, match=r"positions: expected an array of shape \(n, 2\), .* got shape \(3,\)"
    ):
        Geodesics(SLANTED).snap_to_free_space([1.0, 2.0, 3.0])


@pytest.mark.slow
def test_a_large_map_agrees_with_brute_force():
    rng = np.random.default_rng(11)
    ring = np.array([[1, 0.2], [-0.3, 1], [-1, -0.4], [0.1, -0.9]])
    rings = [rng.uniform(0.05, 0.95, 2) + rng.uniform(0.02, 0.07) * ring for _ in range(24)]
    environment = build_environment(*rings, [(0.5, 0.5), (0.7, 0.5), (0.6, 0.8)])
    cost = CoverageCost(environment, lattice=10, radius=0.0)
    robots = cost.points[[3, 30, 31, 60]]
    expected = brute.compute_distances(environment.free, robots, cost.points)
    np.testing.assert_allclose(
        cost.geodesics.compute_distances(robots, cost.points), expected, rtol=0, atol=1e-12
    )
    for count in (1, 4):
        nearest = expected[:count].min(axis=0)
        np.testing.assert_allclose(cost(robots[:count]).distances, nearest, rtol=0, atol=1e-12)
