from __future__ import annotations

import numpy as np
import pytest
import shapely

from robocov.environment import Environment, PolygonObstacle
from robocov.geodesic import Geodesics
from robocov.geodesic.angular_index import AngularWallIndex, add_walls, compute_pseudo_angle, is_visible

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


def environment(*obstacles):
    return Environment("test", SQUARE, tuple(PolygonObstacle(tuple(map(tuple, ring))) for ring in obstacles))


def test_pseudo_angles_grow_with_the_angle():
    angle = np.linspace(-np.pi / 2, 3 * np.pi / 2, 1000, endpoint=False)
    values = np.array([compute_pseudo_angle(np.cos(a), np.sin(a)) for a in angle])
    assert (np.diff(values) > 0.0).all()
    assert values.min() >= 0.0
    assert values.max() <= 4.0


def indexed(geodesics, points, reach, bins=64):
    index, used = AngularWallIndex.allocate(len(points), bins, 5000 * len(points)), 0
    for i, (x, y) in enumerate(points):
        used = add_walls(geodesics.walls, index, i, x, y, reach**2, used)
        assert used >= 0
    return index


def seen(geodesics, index, targets):
    """Return which of the targets each source sees."""
    return np.array(
        [[is_visible(geodesics.walls, index, i, *q) for q in targets] for i in range(len(index.positions))]
    )


@pytest.mark.parametrize("bins", [1, 8, 64, 256])
def test_the_view_does_not_depend_on_the_number_of_bins(bins):
    rng = np.random.default_rng(2)
    rings = [rng.uniform(0.1, 0.9, 2) + 0.07 * np.array([[1, 0], [0, 1], [-1, 0.3]]) for _ in range(12)]
    geodesics = Geodesics(environment(*rings))
    points = np.rint(rng.uniform(size=(40, 2)) * 2.0**48)
    points = points[shapely.intersects_xy(geodesics.free, *points.T)]
    source, target = np.indices((len(points), len(points))).reshape(2, -1)
    lines = shapely.linestrings(np.stack([points[source], points[target]], axis=1))
    expected = shapely.covers(geodesics.free, lines) | (source == target)
    # within reach by the bins, beyond it along the segment
    for reach in (2.0**49, 2.0**46, 0.0):
        index = indexed(geodesics, points, reach, bins)
        np.testing.assert_array_equal(seen(geodesics, index, points).ravel(), expected)


def test_only_walls_within_reach_are_held():
    geodesics = Geodesics(environment([(0.7, 0.2), (0.8, 0.2), (0.8, 0.8), (0.7, 0.8)]))
    near, far = np.array([[0.6, 0.5], [0.9, 0.5]]) * 2.0**48
    for reach, walls in ((0.05, False), (0.31, True)):
        index = indexed(geodesics, [near], reach * 2.0**48)
        assert (index.head >= 0).any() == walls
        assert not seen(geodesics, index, [far])


def test_a_source_on_a_wall_does_not_see_through_it():
    geodesics = Geodesics(environment([(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)]))
    sources = np.array([[0.25, 0.5], [0.5, 0.75], [0.25, 0.25], [0.75, 0.75]]) * 2.0**48
    targets = np.array([[0.875, 0.5], [0.125, 0.5], [0.25, 0.875], [0.5, 0.875], [0.5, 0.125]]) * 2.0**48
    found = seen(geodesics, indexed(geodesics, sources, np.inf), targets)
    assert found[0].tolist() == [False, True, True, False, False]
    assert found[1].tolist() == [False, False, True, True, False]
