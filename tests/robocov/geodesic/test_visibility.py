from __future__ import annotations

import numpy as np
import pytest
import shapely

from robocov.environment import Environment, PolygonObstacle
from robocov.geodesic import Geodesics
from robocov.geodesic.visibility import Fans, pseudo_angle

SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


def environment(*obstacles):
    return Environment("test", SQUARE, tuple(PolygonObstacle(tuple(map(tuple, ring))) for ring in obstacles))


def test_pseudo_angles_grow_with_the_angle():
    angle = np.linspace(-np.pi / 2, 3 * np.pi / 2, 1000, endpoint=False)
    values = pseudo_angle(np.cos(angle), np.sin(angle))
    assert (np.diff(values) > 0.0).all()
    assert values.min() >= 0.0
    assert values.max() <= 4.0


@pytest.mark.parametrize("bins", [1, 7, 64, 256])
def test_the_view_does_not_depend_on_the_number_of_bins(bins):
    rng = np.random.default_rng(2)
    rings = [rng.uniform(0.1, 0.9, 2) + 0.07 * np.array([[1, 0], [0, 1], [-1, 0.3]]) for _ in range(12)]
    geodesics = Geodesics(environment(*rings))
    x, y = np.rint(rng.uniform(size=(2, 40)) * 2.0**48)
    free = shapely.intersects_xy(geodesics.walls.free, x, y)
    x, y = x[free], y[free]
    source, target = np.indices((len(x), len(x))).reshape(2, -1)
    lines = shapely.linestrings(np.stack([np.c_[x[source], y[source]], np.c_[x[target], y[target]]], axis=1))
    expected = shapely.covers(geodesics.walls.free, lines) | (source == target)
    np.testing.assert_array_equal(
        Fans(geodesics.index, x, y, np.full(len(x), 2.0**49), bins).see(source, x[target], y[target]),
        expected,
    )


def test_walls_beyond_the_reach_are_not_looked_at():
    geodesics = Geodesics(environment([(0.7, 0.2), (0.8, 0.2), (0.8, 0.8), (0.7, 0.8)]))
    (near_x, x), (near_y, y) = np.array([[0.6, 0.9], [0.5, 0.5]]) * 2.0**48
    source = np.zeros(1, dtype=np.intp)
    for reach, visible in ((0.05, True), (0.31, False)):
        fans = Fans(geodesics.index, np.array([near_x]), np.array([near_y]), np.array([reach * 2.0**48]))
        assert fans.see(source, np.array([x]), np.array([y])).tolist() == [visible]


def test_a_source_on_a_wall_does_not_see_through_it():
    geodesics = Geodesics(environment([(0.25, 0.25), (0.75, 0.25), (0.75, 0.75), (0.25, 0.75)]))
    x, y = np.array([0.25, 0.5, 0.25, 0.75]) * 2.0**48, np.array([0.5, 0.75, 0.25, 0.75]) * 2.0**48
    fans = Fans(geodesics.index, x, y, np.full(4, np.inf))
    target = np.array([[0.875, 0.5], [0.125, 0.5], [0.25, 0.875], [0.5, 0.875], [0.5, 0.125]]) * 2.0**48
    source, to = np.indices((4, 5)).reshape(2, -1)
    seen = fans.see(source, *target[to].T).reshape(4, 5)
    assert seen[0].tolist() == [False, True, True, False, False]
    assert seen[1].tolist() == [False, False, True, True, False]
