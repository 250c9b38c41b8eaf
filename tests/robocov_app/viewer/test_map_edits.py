"""Edits of a map: obstacles that are added, moved, removed and drawn."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from robocov.environment import (
    CircleObstacle,
    DiscStart,
    Environment,
    PointsStart,
    PolygonObstacle,
    UniformStart,
    WallObstacle,
)
from robocov.errors import MapError
from robocov.mapfile import from_json, to_json
from robocov_app.viewer.session.editing.map_edits import (
    MIN_SHAPE_SIZE_M,
    add_obstacle,
    build_circle,
    build_polygon,
    build_wall,
    describe_obstacle,
    find_obstacle,
    move_obstacle,
    replace_obstacles,
)

SQUARE = ((0, 0), (8, 0), (8, 8), (0, 8))
BLOCK = PolygonObstacle(((1, 1), (3, 1), (3, 3), (1, 3)), (((1.5, 1.5), (2.5, 1.5), (2.5, 2.5), (1.5, 2.5)),))
PILLAR = CircleObstacle((5, 5), 1.0, "pillar")
WALL = WallObstacle(((6, 1), (6, 3), (7, 3)), 0.2)
YARD = Environment("yard", SQUARE, (BLOCK, PILLAR, WALL), {"corner": DiscStart((1, 7), 0.8)})

coordinates = st.floats(-50.0, 50.0)
points = st.tuples(coordinates, coordinates)


def test_obstacles_are_added_and_removed():
    circle = CircleObstacle((1.0, 6.0), 0.4)
    with_circle = add_obstacle(YARD, circle)
    assert with_circle.obstacles == (BLOCK, PILLAR, WALL, circle)
    assert YARD.obstacles == (BLOCK, PILLAR, WALL)
    assert replace_obstacles(with_circle, 3, 1) == YARD
    assert replace_obstacles(YARD, 1, 1).obstacles == (BLOCK, WALL)
    assert with_circle.name == YARD.name
    assert with_circle.boundary == YARD.boundary
    assert with_circle.starts == YARD.starts


@given(st.integers(0, 2), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_an_obstacle_is_moved_and_moved_back(index, dx, dy):
    edited = replace_obstacles(YARD, index, 1, [move_obstacle(YARD.obstacles[index], dx, dy)])
    for other in {0, 1, 2} - {index}:
        assert edited.obstacles[other] == YARD.obstacles[other]
    before = YARD.obstacles[index].polygon
    after = edited.obstacles[index].polygon
    assert after.area == pytest.approx(before.area, rel=1e-3)
    assert after.centroid.x - before.centroid.x == pytest.approx(dx, abs=1e-4)
    assert after.centroid.y - before.centroid.y == pytest.approx(dy, abs=1e-4)
    restored = replace_obstacles(edited, index, 1, [move_obstacle(edited.obstacles[index], -dx, -dy)])
    assert restored.obstacles[index].polygon.equals_exact(before, 1e-3)


def test_a_moved_obstacle_keeps_its_name_width_and_holes():
    assert move_obstacle(PILLAR, 1.0, 0.5) == CircleObstacle((6.0, 5.5), 1.0, "pillar")
    assert move_obstacle(WALL, 0.5, 0.00001).points == ((6.5, 1), (6.5, 3), (7.5, 3))
    assert move_obstacle(BLOCK, 1, 0).holes == (((2.5, 1.5), (3.5, 1.5), (3.5, 2.5), (2.5, 2.5)),)


BUILDERS = {
    "polygon": build_polygon,
    "wall": lambda corners: build_wall(corners, 0.1),
    "circle": lambda corners: build_circle(corners[0], corners[-1]),
}


@given(st.lists(points, min_size=1, max_size=6), st.sampled_from(sorted(BUILDERS)))
def test_an_edited_map_is_as_a_file_would_contain_it(corners, kind):
    try:
        drawn = BUILDERS[kind](corners)
        edited = add_obstacle(YARD, drawn)
    except MapError as error:
        assert "\n" not in str(error)
        assert not str(error).startswith("map:")
    else:
        assert from_json(to_json(edited)) == edited
        assert edited.obstacles[-1] == drawn


def test_a_map_without_free_space_is_rejected():
    with pytest.raises(MapError, match=r"^obstacles: no free space is left inside the boundary"):
        add_obstacle(YARD, CircleObstacle((4, 4), 20.0))


class TestStarts:
    YARD = Environment(
        "yard",
        SQUARE,
        (),
        {
            "a": DiscStart((1, 1), 0.5),
            "ab": DiscStart((7, 7), 0.5),
            "the hall": DiscStart((7, 1), 0.5),
            "a.b": DiscStart((1, 7), 0.5),
            "given": PointsStart(((4, 4), (4, 5))),
            "uniform": UniformStart(),
        },
    )

    @pytest.mark.parametrize(
        ("center", "removed"),
        [((1, 1), "a"), ((7, 7), "ab"), ((7, 1), "the hall"), ((1, 7), "a.b"), ((4, 4.4), "given")],
    )
    def test_a_covered_start_is_removed(self, center, removed):
        covered = add_obstacle(self.YARD, CircleObstacle(center, 0.8))
        assert list(covered.starts) == [name for name in self.YARD.starts if name != removed]

    def test_several_covered_starts_are_removed(self):
        covered = add_obstacle(self.YARD, PolygonObstacle(((0, 0), (8, 0), (8, 6), (0, 6))))
        assert list(covered.starts) == ["ab", "a.b", "uniform"]

    def test_all_starts_are_removed_if_hardly_any_space_is_left(self):
        covered = add_obstacle(self.YARD, PolygonObstacle(((0, 0), (8, 0), (8, 7.99), (0, 7.99))))
        assert dict(covered.starts) == {}


class TestFindObstacle:
    def test_an_obstacle_under_the_point_is_found(self):
        assert find_obstacle(YARD, (1.2, 2.0)) == 0
        assert find_obstacle(YARD, (5.5, 5.5)) == 1
        assert find_obstacle(YARD, (6.05, 2.0)) == 2
        assert find_obstacle(YARD, (4.0, 7.0)) is None
        # The hole of a polygon is no obstacle.
        assert find_obstacle(YARD, (2.0, 2.0)) is None
        assert find_obstacle(Environment("empty", SQUARE), (1.0, 1.0), 5.0) is None

    def test_an_obstacle_within_reach_is_found(self):
        assert find_obstacle(YARD, (3.2, 2.0), 0.1) is None
        assert find_obstacle(YARD, (3.2, 2.0), 0.3) == 0

    def test_the_topmost_obstacle_is_found(self):
        assert find_obstacle(add_obstacle(YARD, CircleObstacle((5, 5), 0.5)), (5, 5)) == 3

    def test_an_obstacle_under_the_point_comes_before_one_nearby(self):
        environment = add_obstacle(YARD, CircleObstacle((5, 6.3), 0.2))
        assert find_obstacle(environment, (5.0, 5.95), 0.3) == 1
        assert find_obstacle(environment, (5.0, 6.09), 0.3) == 3


class TestDrawnShapes:
    def test_a_polygon_is_rounded(self):
        triangle = build_polygon([(0.0, 0.0), (1.0, 0.0), (0.0, 1.00004)])
        assert triangle == PolygonObstacle(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
        # A double click, and a click on the first corner.
        assert build_polygon([(0, 0), (1, 0), (1, 0), (0, 1), (0, 0)]) == triangle

    @pytest.mark.parametrize(
        "corners",
        [
            [],
            [(0, 0)],
            [(0, 0), (1, 0)],
            [(0, 0), (1, 0), (0, 0)],
            [(0, 0), (1, 1), (2, 2), (3, 3)],
            [(0, 0), (0.01, 0), (0, 0.01)],
        ],
    )
    def test_a_polygon_encloses_something(self, corners):
        with pytest.raises(MapError, match="three corners that enclose an area"):
            build_polygon(corners)

    @pytest.mark.parametrize(
        "corners", [[(0, 0), (2, 2), (2, 0), (0, 2)], [(0, 0), (4, 0), (4, 2), (1, -1), (0, 3)]]
    )
    def test_an_outline_does_not_cross_itself(self, corners):
        with pytest.raises(MapError, match="crosses itself"):
            build_polygon(corners)

    def test_a_wall_is_rounded(self):
        assert build_wall([(0, 0), (0, 0), (1.00001, 0)], 0.3) == WallObstacle(((0.0, 0.0), (1.0, 0.0)), 0.3)

    def test_a_wall_may_be_closed(self):
        wall = build_wall([(1, 1), (3, 1), (3, 3), (1, 3), (1, 1)], 0.2)
        assert len(wall.points) == 5
        assert wall.polygon.covers(build_wall([(1, 2.8), (1, 1.2)], 0.2).polygon)

    @pytest.mark.parametrize("line", [[], [(0, 0)], [(0, 0), (0.01, 0)], [(1, 1), (1, 1)]])
    def test_a_wall_has_a_length(self, line):
        with pytest.raises(MapError, match="two points that are apart"):
            build_wall(line, 0.1)

    @given(points, st.floats(0.0, 10.0), st.floats(0.0, 2 * math.pi))
    def test_a_circle_is_drawn_from_its_center_to_its_rim(self, center, radius, angle):
        rim = center[0] + radius * math.cos(angle), center[1] + radius * math.sin(angle)
        assume(abs(radius - MIN_SHAPE_SIZE_M) > 1e-6)
        if radius < MIN_SHAPE_SIZE_M:
            with pytest.raises(MapError, match="drag from its center"):
                build_circle(center, rim)
        else:
            circle = build_circle(center, rim)
            assert circle.radius == pytest.approx(radius, abs=1e-4)
            assert circle.center == pytest.approx(center, abs=1e-4)


def test_obstacles_are_described_by_kind_and_name():
    descriptions = [describe_obstacle(obstacle) for obstacle in YARD.obstacles]
    assert descriptions == ["polygon", "circle “pillar”", "wall"]
