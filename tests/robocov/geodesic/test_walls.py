"""Walls and corners of the free space."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import Environment, PolygonObstacle
from robocov.geodesic.integer_grid import Grid, cross
from robocov.geodesic.walls import build_walls, can_bend_at_corner, count_windings, find_vertex

SIZE = 8.0


def build_ring(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


HALL = build_ring(0, 0, 8, 8)


def build_environment(*obstacles, boundary=HALL):
    return Environment("test", boundary, tuple(PolygonObstacle(ring) for ring in obstacles))


def build_walls_around(*obstacles, boundary=HALL):
    environment = build_environment(*obstacles, boundary=boundary)
    return build_walls(shapely.transform(environment.free, Grid.from_square(np.zeros(2), SIZE).snap))


def list_corners(walls):
    """Return the corners in meters, sorted."""
    return sorted(map(tuple, (walls.corners * SIZE / 2.0**48).tolist()))


def count_hiding_walls(walls):
    return int(walls.can_hide_free_space.sum())


def test_an_empty_square_has_neither_corners_nor_hiding_walls():
    empty = build_walls_around()
    assert len(empty.corners) == count_hiding_walls(empty) == 0
    assert len(empty.sector_walls) == len(empty.ends) == 4


def test_corners_are_where_the_free_space_is_not_convex():
    pillar = build_walls_around(build_ring(3, 3, 5, 5))
    assert list_corners(pillar) == [(3, 3), (3, 5), (5, 3), (5, 5)]
    assert count_hiding_walls(pillar) == 4
    room = build_walls_around(boundary=((0, 0), (8, 0), (8, 4), (4, 4), (4, 8), (0, 8)))
    assert list_corners(room) == [(4, 4)]
    assert count_hiding_walls(room) == 2


def test_collinear_vertices_are_not_corners():
    pillar = build_walls_around(((3, 3), (4, 3), (5, 3), (5, 5), (3, 5)))
    assert list_corners(pillar) == [(3, 3), (3, 5), (5, 3), (5, 5)]


@pytest.mark.parametrize("touching", [build_ring(5, 5, 7, 7), ((5, 5), (7, 5), (6, 7))])
def test_a_pinch_has_two_narrow_sectors_and_no_corner(touching):
    pinch = build_walls_around(build_ring(3, 3, 5, 5), touching)
    vertex = find_vertex(pinch.vertices, 5.0 / 8 * 2.0**48, 5.0 / 8 * 2.0**48)
    sectors = slice(pinch.sector_starts[vertex], pinch.sector_starts[vertex + 1])
    assert len(pinch.sector_walls[sectors]) == 2
    assert (5.0, 5.0) not in list_corners(pinch)
    assert not pinch.sector_is_corner[sectors].any()


def test_a_straight_wall_past_a_pinch_is_a_corner():
    line = build_walls_around(((1, 1), (3, 1), (2, 3)), build_ring(3, 1, 6, 4))
    assert (3.0, 1.0) in list_corners(line)


def test_paths_bend_at_a_corner_only_from_points_next_to_its_walls():
    room = build_walls_around(boundary=((0, 0), (8, 0), (8, 4), (4, 4), (4, 8), (0, 8)))
    points = {
        (6, 2): True,
        (2, 6): True,
        (8, 4): True,
        (4, 8): True,
        (4, 4): True,
        (4, 2): True,
        (2, 4): True,
        (2, 2): False,
        (3.999, 3.999): False,
        (6, 6): False,
        (4.001, 6): False,
    }
    grid_points = np.array(list(points)) / SIZE * 2.0**48
    can_bend = [can_bend_at_corner(room.corners, room.corner_walls, 0, x, y) for x, y in grid_points]
    assert can_bend == list(points.values())


def test_vertices_are_found_by_their_position():
    pillar = build_walls_around(build_ring(3, 3, 5, 5))
    for number, (x, y) in enumerate(pillar.vertices):
        assert find_vertex(pillar.vertices, x, y) == number
        assert find_vertex(pillar.vertices, x + 1, y) == find_vertex(pillar.vertices, x, y - 1) == -1


def test_points_are_inside_outside_or_on_the_boundary():
    obstacles = [
        build_ring(3, 3, 5, 5),
        build_ring(5, 5, 7, 7),
        build_ring(0, 4, 3.5, 4.5),
        build_ring(7, 4, 8, 6),
    ]
    components = build_environment(*obstacles).free.geoms
    coordinates = np.arange(-1, 10, 0.5)
    points = np.array([(x, y) for x in coordinates for y in coordinates])
    windings = np.empty((len(points), len(components)), dtype=np.int64)
    count_windings(build_walls_around(*obstacles), points / SIZE * 2.0**48, windings)
    for k, component in enumerate(components):
        np.testing.assert_array_equal(windings[:, k] > 0, shapely.intersects_xy(component, *points.T))
        np.testing.assert_array_equal(windings[:, k] == 1, shapely.contains_xy(component, *points.T))


whole = st.integers(-(2**49), 2**49)


@settings(max_examples=count_examples(300), deadline=None)
@given(whole, whole, st.integers(-3, 3), st.integers(-3, 3), st.integers(1, 5), whole, whole)
def test_the_side_of_a_line_is_exact(ux, uy, offset_x, offset_y, multiple, wx, wy):
    almost_parallel = (ux // 5 * multiple + offset_x, uy // 5 * multiple + offset_y)
    for vx, vy in (almost_parallel, (wx, wy)):
        value = cross(*map(float, (ux, uy, vx, vy)))
        exact = ux * vy - uy * vx
        assert np.sign(value) == (exact > 0) - (exact < 0)
        assert value == pytest.approx(exact, rel=1e-12, abs=2.0**50)


def test_the_grid_keeps_dyadic_numbers():
    grid = Grid.from_square(np.array([-3.0, 5.0]), 10.0)
    points = np.array([[-2.875, 5.5], [7.0, 14.99]])
    assert grid.spacing == 2.0**-44
    np.testing.assert_allclose(grid.to_meters(grid.snap(points)), points, rtol=0, atol=grid.spacing)
    np.testing.assert_array_equal(grid.to_meters(grid.snap(points))[0], points[0])
