from __future__ import annotations

import numpy as np
import pytest

from robocov.environment import Environment, PolygonObstacle
from robocov.geodesic.corners import Walls, useful, vertex_at
from robocov.geodesic.orientation import Grid

SIZE = 8.0


def box(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


HALL = box(0, 0, 8, 8)


def walls(*obstacles, boundary=HALL):
    where = Environment("test", boundary, tuple(PolygonObstacle(ring) for ring in obstacles))
    return Walls.of(where.free, Grid.over(np.zeros(2), SIZE))


def places(x, y):
    return sorted(zip((x * SIZE / 2.0**48).tolist(), (y * SIZE / 2.0**48).tolist(), strict=True))


def test_an_empty_square_has_neither_corners_nor_walls_that_hide():
    empty = walls()
    assert len(empty.corners.x) == 0
    assert len(empty.start) == 0
    assert len(empty.sectors.wide) == 4


def test_corners_are_where_free_space_turns_round_an_obstacle():
    pillar = walls(box(3, 3, 5, 5))
    assert places(pillar.corners.x, pillar.corners.y) == [(3, 3), (3, 5), (5, 3), (5, 5)]
    assert len(pillar.start) == 4
    room = walls(boundary=((0, 0), (8, 0), (8, 4), (4, 4), (4, 8), (0, 8)))
    assert places(room.corners.x, room.corners.y) == [(4, 4)]
    assert len(room.start) == 2


def test_vertices_in_line_are_no_corners():
    pillar = walls(((3, 3), (4, 3), (5, 3), (5, 5), (3, 5)))
    assert places(pillar.corners.x, pillar.corners.y) == [(3, 3), (3, 5), (5, 3), (5, 5)]


@pytest.mark.parametrize("touching", [box(5, 5, 7, 7), ((5, 5), (7, 5), (6, 7))])
def test_a_pinch_has_two_narrow_sectors_and_no_corner(touching):
    pinch = walls(box(3, 3, 5, 5), touching)
    at = vertex_at(pinch.sectors, 5.0 / 8 * 2.0**48, 5.0 / 8 * 2.0**48)
    sectors = slice(*pinch.sectors.first[at : at + 2])
    assert len(pinch.sectors.wide[sectors]) == 2
    assert (5.0, 5.0) not in places(pinch.corners.x, pinch.corners.y)
    assert not pinch.sectors.wide[sectors].any()


def test_a_straight_wall_past_a_pinch_is_a_corner():
    line = walls(((1, 1), (3, 1), (2, 3)), box(3, 1, 6, 4))
    assert (3.0, 1.0) in places(line.corners.x, line.corners.y)


def test_useful_points_of_a_corner_are_those_beside_its_walls():
    room = walls(boundary=((0, 0), (8, 0), (8, 4), (4, 4), (4, 8), (0, 8)))
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
    x, y = (np.array(list(points)) / SIZE * 2.0**48).T
    found = [useful(room.corners, 0, *point) for point in zip(x, y, strict=True)]
    assert found == list(points.values())


def test_vertices_are_found_by_their_place():
    pillar = walls(box(3, 3, 5, 5))
    sectors = pillar.sectors
    for number, (x, y) in enumerate(zip(sectors.x, sectors.y, strict=True)):
        assert vertex_at(sectors, x, y) == number
        assert vertex_at(sectors, x + 1, y) == vertex_at(sectors, x, y - 1) == -1
