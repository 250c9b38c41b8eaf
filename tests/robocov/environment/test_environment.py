"""Environments: polygons of obstacles, boundary, free space and its components."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.density import Uniform
from robocov.environment import CircleObstacle, Environment, PolygonObstacle, WallObstacle
from robocov.errors import InputError, MapError, StartError
from robocov.observation.region import Region

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))


@pytest.mark.parametrize("radius", [0.005, 0.05, 0.5, 5.0, 50.0])
def test_polygons_of_circles_deviate_by_at_most_a_millimeter(radius: float) -> None:
    polygon = CircleObstacle((1.0, 2.0), radius).polygon
    center = shapely.Point(1.0, 2.0)
    assert radius - center.distance(polygon.exterior) <= 1e-3 + 1e-12
    assert center.hausdorff_distance(polygon) <= radius * (1 + 1e-12)


def test_a_wall_ends_flat_and_has_mitered_corners() -> None:
    wall = WallObstacle(((0.0, 0.0), (2.0, 0.0), (2.0, 3.0)), 0.2).polygon
    assert wall.area == pytest.approx(2 * 0.2 + 3 * 0.2)
    assert wall.bounds == pytest.approx((0.0, -0.1, 2.1, 3.0))


def test_a_closed_wall_has_no_notch() -> None:
    ring = WallObstacle((*SQUARE, SQUARE[0]), 0.2).polygon
    assert ring.area == pytest.approx(10.2**2 - 9.8**2)


def test_the_boundary_may_have_either_orientation() -> None:
    counterclockwise = Environment("a", SQUARE)
    clockwise = Environment("a", SQUARE[::-1])
    assert counterclockwise.free_area == clockwise.free_area == 100.0
    assert clockwise.free.geoms[0].exterior.is_ccw


def test_overlapping_and_protruding_obstacles_are_counted_once() -> None:
    environment = Environment(
        "x",
        SQUARE,
        (
            PolygonObstacle(((-1.0, 4.0), (5.0, 4.0), (5.0, 6.0), (-1.0, 6.0))),
            PolygonObstacle(((4.0, 3.0), (6.0, 3.0), (6.0, 7.0), (4.0, 7.0))),
            PolygonObstacle(
                ((7.0, 7.0), (9.0, 7.0), (9.0, 9.0), (7.0, 9.0)), (((7.5, 7.5), (8.5, 7.5), (8.5, 8.5)),)
            ),
        ),
    )
    assert environment.free_area == pytest.approx(100 - (10 + 8 - 2) - (4 - 0.5))
    # The hole of the last obstacle is a separate component.
    assert len(environment.free.geoms) == 2
    areas = [component.area for component in environment.free.geoms]
    assert areas == sorted(areas, reverse=True)


@pytest.mark.parametrize(
    ("wall", "lower_left"),
    [((2, 0, 4, 10), (4, 0)), ((6, 0, 8, 10), (0, 0)), ((4, 0, 6, 10), (0, 0)), ((0, 4, 10, 6), (0, 0))],
)
def test_components_are_sorted_by_area_and_then_from_the_lower_left(wall, lower_left) -> None:
    corners = shapely.get_coordinates(shapely.box(*wall))[:4].tolist()
    rooms = Environment("rooms", SQUARE, (PolygonObstacle(tuple(map(tuple, corners))),)).free.geoms
    assert rooms[0].bounds[:2] == lower_left


def test_another_density_has_other_masses_and_the_same_geometry() -> None:
    plain = Environment("plain", SQUARE)
    assert plain.free_masses.tolist() == [100.0]
    weighted = plain.with_density(Uniform(3.0))
    assert weighted.free is plain.free
    assert weighted.free_masses.tolist() == [300.0]
    assert plain.has_same_geometry(weighted)
    assert not plain.has_same_geometry(Environment("plain", SQUARE, (CircleObstacle((5.0, 5.0), 1.0),)))


@settings(max_examples=count_examples(60))
@given(st.lists(st.tuples(st.floats(-1, 11), st.floats(-1, 11), st.floats(0.05, 3)), max_size=6))
def test_free_and_blocked_space_tile_the_region(discs: list[tuple[float, float, float]]) -> None:
    environment = Environment("x", SQUARE, tuple(CircleObstacle((x, y), r) for x, y, r in discs))
    assert environment.free_area + environment.blocked.area == pytest.approx(100.0, rel=1e-6)
    assert shapely.intersection(environment.free, environment.blocked).area < 1e-6


def test_the_region_outside_a_concave_boundary_is_blocked(cluttered: Environment) -> None:
    assert cluttered.region.area == pytest.approx(87.5)
    assert cluttered.blocked.contains(shapely.Point(2.0, 6.0))


def test_starts_are_found_by_name(cluttered: Environment) -> None:
    assert cluttered.start().name == "corner"
    with pytest.raises(StartError, match=r"unknown start 'corner2': did you mean 'corner'\?"):
        cluttered.start("corner2")
    for name in (3, ["corner"]):
        with pytest.raises(StartError, match="unknown start "):
            cluttered.start(name)  # type: ignore[arg-type]
    assert Environment("bare", SQUARE).start().name == "uniform"
    assert cluttered.start("uniform").sample(3).shape == (3, 2)


def test_environments_are_equal_by_content() -> None:
    first = Environment("a", SQUARE, (CircleObstacle((1.0, 1.0), 0.5),), extra={"k": [1]})
    second = Environment("a", SQUARE, (CircleObstacle((1.0, 1.0), 0.5),), extra={"k": [1]})
    assert first == second
    assert hash(first) == hash(second)
    assert first != Environment("a", SQUARE, (CircleObstacle((1.0, 1.0), 0.6),))


def test_region_is_the_convex_hull_without_collinear_vertices() -> None:
    region = Region(np.array([[0, 0], [4, 0], [8, 0], [8, 6], [4, 3], [0, 6], [0, 3]], dtype=float))
    np.testing.assert_allclose(region.vertices, [[0, 0], [8, 0], [8, 6], [0, 6]])
    assert region.area == 48.0
    np.testing.assert_allclose(region.centroid, [4, 3])
    np.testing.assert_allclose(region.normals @ region.centroid < region.offsets, True)
    assert region.contains(np.array([[4.0, 5.0], [9.0, 1.0], [8.0, 6.0]])).tolist() == [True, False, True]
    with pytest.raises(InputError, match="with an area above 0"):
        Region(np.array([[0, 0], [1, 1], [2, 2]], dtype=float))
    with pytest.raises(ValueError, match="read-only"):
        region.vertices[0, 0] = 1.0


def test_the_repr_is_short(cluttered: Environment, empty: Environment) -> None:
    assert repr(cluttered) == "<Environment cluttered, 10 x 10 m, 3 obstacles>"
    assert repr(empty) == "<Environment empty, 10 x 10 m, 0 obstacles>"


@pytest.mark.parametrize(
    "boundary",
    [
        ((0.0, 0.0), (1.0, 1.0)),
        ((0.0, 0.0), (1.0, 0.0), (np.nan, 1.0)),
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)),
        "square",
        None,
    ],
)
def test_a_boundary_that_is_no_list_of_points_raises_an_error(boundary: object) -> None:
    with pytest.raises(MapError, match=r"map hall: boundary: expected at least 3 .*points"):
        _ = Environment("hall", boundary).free  # type: ignore[arg-type]


def test_edges_that_cross_raise_an_error() -> None:
    bow_tie = ((1.0, 1.0), (3.0, 3.0), (3.0, 1.0), (1.0, 3.0))
    with pytest.raises(MapError, match=r"map hall: boundary: .* whose edges do not meet, got .*\[2 2\]"):
        _ = Environment("hall", bow_tie).free
    obstacles = (CircleObstacle((5.0, 5.0), 1.0), PolygonObstacle(bow_tie))
    with pytest.raises(MapError, match=r"map hall: obstacles\[1\]: .* whose edges do not meet"):
        _ = Environment("hall", SQUARE, obstacles).free


def test_an_obstacle_with_two_vertices_raises_an_error() -> None:
    obstacle = PolygonObstacle(((1.0, 1.0), (3.0, 3.0)))
    with pytest.raises(MapError, match="obstacle: expected at least 3 finite points"):
        _ = Environment("hall", SQUARE, (obstacle,)).free
