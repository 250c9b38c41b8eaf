"""The distances of points, compared with shortest paths of discs around the same corners."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from disc_paths import DiscPaths, Rays
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.arrays import compute_lengths
from robocov.environment import Environment, PolygonObstacle
from robocov.geodesic import Geodesics
from robocov.typing import FloatArray

HALL = ((0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (0.0, 6.0))
TOLERANCE_M = 1e-5
"""Vertices are rounded to 1 µm, and gaps that are too narrow by less than 2 µm stay open."""


def build_random_hall(rng: np.random.Generator, count: int) -> Environment:
    """Build a hall with convex obstacles, which may overlap, and leave gaps of all widths."""
    obstacles = []
    for _ in range(count):
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 4))
        corners = np.column_stack([np.cos(angles), np.sin(angles)])
        points = rng.uniform([0.5, 0.5], [9.5, 5.5]) + rng.uniform(0.3, 1.5, 2) * corners
        obstacles.append(PolygonObstacle(tuple((x, y) for x, y in points.tolist())))
    return Environment("hall", HALL, tuple(obstacles))


def sample_centers(
    hall: Environment, radius: float, count: int, rng: np.random.Generator
) -> FloatArray | None:
    """Sample points where the center of a disc can be; None if they are too rare."""
    points = rng.uniform([0.0, 0.0], [10.0, 6.0], size=(200, 2))
    shapes = shapely.points(points)
    is_center = shapely.contains(hall.free, shapes)
    is_center &= shapely.distance(hall.free.boundary, shapes) > radius + TOLERANCE_M
    centers = points[is_center]
    return centers[:count] if len(centers) >= count else None


@pytest.mark.parametrize("turn", [0.0, 0.2, 1.0, 2.0])
def test_the_path_around_a_corner_has_its_length(turn: float) -> None:
    """A disc of radius 0.1 m passes the tip of a wall; source and target are at 1 m from the tip."""
    radius = 0.1
    tip = np.array([5.0, 3.0])
    wall = PolygonObstacle(((4.999, 0.0), (5.001, 0.0), (5.0, 3.0)))
    hall = Environment("hall", HALL, (wall,))
    left, right = (tip + [side * math.cos(0.5 * turn), -math.sin(0.5 * turn)] for side in (-1.0, 1.0))
    path = DiscPaths(hall.free, radius, left, right, Rays(hall.free)).find_shortest()
    assert path is not None
    turning = turn + 2.0 * math.asin(radius)
    assert path.turning == pytest.approx(turning, abs=1e-5)
    assert path.length == pytest.approx(2.0 * math.sqrt(1.0 - radius**2) + radius * turning, abs=1e-5)
    distance = Geodesics(hall).compute_distances([left], [right])[0, 0]
    assert distance == pytest.approx(2.0, abs=1e-5)
    # The angle by which the point's path turns would be too small for a bound.
    assert radius * turn < path.length - distance < radius * path.turning


@settings(max_examples=count_examples(150))
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 12), radius=st.sampled_from([0.05, 0.15, 0.3]))
def test_the_path_of_a_disc_is_longer_by_at_most_its_radius_times_its_turning_angle(
    seed: int, count: int, radius: float
) -> None:
    """The difference is less than the radius times the angle by which the path of the disc turns."""
    rng = np.random.default_rng(seed)
    hall = build_random_hall(rng, count)
    ends = sample_centers(hall, radius, 2, rng)
    assume(ends is not None)
    source, target = ends
    closed = hall.close_gaps(radius)
    path = Geodesics(closed).find_path(source, target)
    rays = Rays(closed.free)
    paths = DiscPaths(hall.free, radius, source, target, rays)
    shortest = paths.find_shortest()
    if not len(path):
        assert shortest is None
        return
    distance = float(compute_lengths(np.diff(path, axis=0)).sum())
    same_sides = paths.find_shortest(rays.count_crossings(path), max_length=distance + 30.0 * radius)
    assert shortest is not None
    # Narrower gaps are closed, so that a disc can pass all obstacles on the same sides as the point.
    assert same_sides is not None
    assert distance - TOLERANCE_M <= shortest.length <= same_sides.length + TOLERANCE_M
    assert same_sides.length <= distance + radius * same_sides.turning + TOLERANCE_M
