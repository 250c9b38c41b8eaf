"""Edits of vertices: moving, inserting, removing them, and cutting corners."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, valid_sketches
from hypothesis import given
from hypothesis import strategies as st

from robocov.environment import (
    CircleObstacle,
    DiscStart,
    ObstaclePath,
    PointsStart,
    PolygonObstacle,
    WallObstacle,
)
from robocov.errors import MapError
from robocov_app.editor.edits import vertices
from robocov_app.editor.model.selection import (
    Edge,
    Selection,
    Vertex,
    find_position,
    list_vertices,
)
from robocov_app.editor.model.sketch import BOUNDARY, Sketch

HOLE = ((2.0, 2.0), (3.0, 2.0), (3.0, 3.0), (2.0, 3.0))
FRAME = PolygonObstacle(((1.0, 1.0), (5.0, 1.0), (5.0, 5.0), (1.0, 5.0)), (HOLE,), "frame")
PILLAR = CircleObstacle((8.0, 4.0), 0.5)
WALL = WallObstacle(((6.0, 1.0), (9.0, 1.0), (9.0, 3.0)), 0.1, "west")
STARTS = (("disc", DiscStart((10.0, 6.0), 1.0)), ("two", PointsStart(((7.0, 6.0), (8.0, 6.0)))))


@pytest.fixture
def sketch() -> Sketch:
    return Sketch("Hall", boundary=HALL, starts=STARTS).with_obstacles([FRAME, PILLAR, WALL])[0]


def select_vertices(*chosen: Vertex) -> Selection:
    return Selection(vertices=frozenset(chosen))


# moving


@given(st.data())
def test_a_placed_vertex_has_its_position(data):
    sketch = data.draw(valid_sketches(min_size=1))
    owner = data.draw(st.sampled_from([BOUNDARY, *(item.key for item in sketch.obstacles)]))
    vertex, before = data.draw(st.sampled_from(list_vertices(sketch, owner)))
    to = data.draw(st.tuples(st.integers(-5, 15), st.integers(-5, 15)))
    place = (to[0] + 0.25, to[1] + 0.5)
    after = vertices.place_vertices(sketch, {vertex: place})
    circle = isinstance(sketch.get_item(owner).shape, CircleObstacle) if owner != BOUNDARY else False
    if circle and vertex.index:
        center = find_position(sketch, Vertex(owner, 0, 0))
        assert find_position(after, Vertex(owner, 0, 0)) == center
        assert after.get_item(owner).shape.radius == pytest.approx(math.dist(center, place), abs=1e-4)
        return
    assert find_position(after, vertex) == place
    others = [other for other, _ in list_vertices(sketch, owner) if other != vertex]
    if not circle:
        assert all(find_position(after, other) == find_position(sketch, other) for other in others)
    moved_back = vertices.place_vertices(after, {vertex: before})
    assert moved_back == sketch


def test_vertices_of_several_objects_move_together(sketch):
    chosen = select_vertices(
        Vertex(0, 0, 2),
        Vertex(0, 1, 0),
        Vertex(1, 0, 1),
        Vertex(2, 0, 2),
        Vertex(BOUNDARY, 0, 0),
        Vertex("two", 0, 1),
    )
    change = vertices.move_vertices(sketch, chosen, 0.5, -0.25)
    assert change.description == "6 vertices moved"
    assert change.selection == chosen
    after = change.sketch
    assert after.get_item(0).shape.vertices[2] == (5.5, 4.75)
    assert after.get_item(0).shape.holes[0][0] == (2.5, 1.75)
    assert after.get_item(1).shape == CircleObstacle((8.0, 4.0), round(math.hypot(1.0, 0.25), 4))
    assert after.get_item(2).shape.points[2] == (9.5, 2.75)
    assert after.boundary[0] == (0.5, -0.25)
    assert after.get_start("two").positions == ((7.0, 6.0), (8.5, 5.75))


def test_center_and_rim_of_discs_are_vertices(sketch):
    assert vertices.place_vertices(sketch, {Vertex("disc", 0, 0): (9.0, 5.0)}).get_start("disc") == DiscStart(
        (9.0, 5.0), 1.0
    )
    assert vertices.place_vertices(sketch, {Vertex("disc", 0, 3): (10.0, 4.0)}).get_start(
        "disc"
    ) == DiscStart((10.0, 6.0), 2.0)
    both = {Vertex(1, 0, 0): (1.0, 1.0), Vertex(1, 0, 1): (9.0, 9.0)}
    assert vertices.place_vertices(sketch, both).get_item(1).shape == CircleObstacle((1.0, 1.0), 0.5)


@pytest.mark.parametrize(
    ("deed", "words"),
    [
        (lambda s: vertices.move_vertices(s, Selection.of(0), 1, 1), "select vertices"),
        (
            lambda s: vertices.move_vertices(s, select_vertices(Vertex(0, 0, 9)), 1, 1),
            "vertex no longer exists",
        ),
        (
            lambda s: vertices.move_vertices(s, select_vertices(Vertex(99, 0, 0)), 1, 1),
            "vertex no longer exists",
        ),
        (
            lambda s: vertices.move_vertices(s, select_vertices(Vertex("none", 0, 0)), 1, 1),
            "vertex no longer exists",
        ),
        (lambda s: vertices.place_vertices(s, {Vertex(1, 0, 1): (8.0, 4.0)}), "needs a radius"),
        (lambda s: vertices.insert_vertex(s, Edge(2, 0, 2, (9.0, 2.0))), "edge no longer exists"),
        (lambda s: vertices.insert_vertex(s, Edge(1, 0, 0, (9.0, 2.0))), "edge no longer exists"),
        (lambda s: vertices.extend_wall(s, Vertex(2, 0, 1), (1.0, 1.0)), "from its ends only"),
        (lambda s: vertices.extend_wall(s, Vertex(0, 0, 1), (1.0, 1.0)), "not a wall"),
        (lambda s: vertices.delete_vertices(s, Selection.of(0)), "select vertices"),
        (lambda s: vertices.delete_vertices(s, select_vertices(Vertex(1, 0, 1))), "delete the circle itself"),
        (
            lambda s: vertices.delete_vertices(s, select_vertices(Vertex("disc", 0, 1))),
            "delete the start itself",
        ),
        (
            lambda s: vertices.delete_vertices(s, select_vertices(Vertex(-1, 0, 1), Vertex(-1, 0, 2))),
            "at least three corners",
        ),
        (lambda s: vertices.bevel_corners(s, select_vertices(Vertex(0, 0, 0)), 0.0), "length above 0"),
        (
            lambda s: vertices.bevel_corners(s, select_vertices(Vertex(0, 0, 0)), 4.5),
            "the cut needs 4.5 m of an edge, but the edge is 4 m long",
        ),
        (
            lambda s: vertices.bevel_corners(s, select_vertices(Vertex(0, 0, 0), Vertex(0, 0, 1)), 2.5),
            "5 m of .* both ends",
        ),
        (lambda s: vertices.bevel_corners(s, select_vertices(Vertex(2, 0, 0)), 0.1), "select corners"),
        (lambda s: vertices.bevel_corners(s, select_vertices(Vertex(1, 0, 0)), 0.1), "select corners"),
        (lambda s: vertices.round_corners(s, select_vertices(Vertex(0, 0, 0)), -1.0), "radius above 0"),
        (lambda s: vertices.fill_hole(s, 0, 2), "no such hole"),
        (lambda s: vertices.split_wall(s, Vertex(2, 0, 0)), "between its ends"),
        (lambda s: vertices.split_wall(s, Vertex(0, 0, 0)), "not a wall"),
        (lambda s: vertices.join_walls(s, Selection.of(0, 2)), "walls to join"),
        (lambda s: vertices.join_walls(s, Selection.of(2)), "walls to join"),
    ],
)
def test_impossible_edits_raise_a_map_error(sketch, deed, words):
    with pytest.raises(MapError, match=words) as caught:
        deed(sketch)
    assert "\n" not in str(caught.value)


# inserting and deleting


@given(st.data())
def test_inserting_on_an_edge_keeps_the_shape(data):
    sketch = data.draw(valid_sketches(min_size=1))
    edges = [
        Edge(owner, ring, k, (0.0, 0.0))
        for owner in (BOUNDARY, *(item.key for item in sketch.obstacles))
        for ring, points, closed in sketch.list_rings(owner)
        for k in range(len(points) - (not closed))
    ]
    edge = data.draw(st.sampled_from(edges))
    ring = sketch.list_vertex_rings(edge.owner)[edge.ring]
    a = ring[edge.index]
    b = ring[(edge.index + 1) % len(ring)]
    middle = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
    change = vertices.insert_vertex(sketch, replace(edge, point=middle))
    (new,) = change.selection.vertices
    assert (new.owner, new.ring, new.index) == (edge.owner, edge.ring, edge.index + 1)
    assert find_position(change.sketch, new) == pytest.approx(middle, abs=1e-4)
    if edge.owner != BOUNDARY:
        difference = change.sketch.get_item(edge.owner).geometry ^ sketch.get_item(edge.owner).geometry
        assert difference.area < 1e-3
    assert vertices.delete_vertices(change.sketch, change.selection).sketch == sketch


def test_rings_with_too_few_vertices_are_removed(sketch):
    gone = vertices.delete_vertices(sketch, select_vertices(Vertex(0, 1, 0), Vertex(0, 1, 1)))
    assert gone.sketch.get_item(0).shape.holes == ()
    assert gone.description == "2 vertices deleted"
    gone = vertices.delete_vertices(sketch, select_vertices(*(Vertex(0, 0, k) for k in (0, 1))))
    assert 0 not in gone.sketch.index_by_key
    gone = vertices.delete_vertices(sketch, select_vertices(Vertex(2, 0, 0), Vertex(2, 0, 1)))
    assert 2 not in gone.sketch.index_by_key
    gone = vertices.delete_vertices(sketch, select_vertices(Vertex("two", 0, 0)))
    assert gone.sketch.get_start("two").positions == ((8.0, 6.0),)
    gone = vertices.delete_vertices(gone.sketch, select_vertices(Vertex("two", 0, 0)))
    assert "two" not in dict(gone.sketch.starts)
    assert len(vertices.delete_vertices(sketch, select_vertices(Vertex(BOUNDARY, 0, 0))).sketch.boundary) == 3


# corners


@given(st.floats(20.0, 160.0), st.floats(0.1, 0.9))
def test_a_bevel_has_the_given_length_and_an_arc_touches_both_edges(degrees, length):
    angle = math.radians(degrees)
    corner = ((2.0, 0.0), (0.0, 0.0), (2.0 * math.cos(angle), 2.0 * math.sin(angle)))
    sketch, (key,) = Sketch().with_obstacles([WallObstacle(corner, 0.1)])
    change = vertices.bevel_corners(sketch, select_vertices(Vertex(key, 0, 1)), length)
    points = np.array(change.sketch.get_item(key).shape.points)
    assert len(points) == 4
    np.testing.assert_allclose(points[1], (length, 0.0), atol=1e-4)
    np.testing.assert_allclose(points[-2], (length * math.cos(angle), length * math.sin(angle)), atol=1e-4)
    # The circle touches both edges there, so its center is on the bisector.
    radius = length * math.tan(angle / 2)
    center = np.array([length, radius])
    rounded = vertices.round_corners(sketch, select_vertices(Vertex(key, 0, 1)), radius)
    points = np.array(rounded.sketch.get_item(key).shape.points)
    np.testing.assert_allclose(np.linalg.norm(points[1:-1] - center, axis=1), radius, atol=2e-4)
    middles = (points[1:-2] + points[2:-1]) / 2
    assert (radius - np.linalg.norm(middles - center, axis=1)).max() <= 1.2e-3


def test_corners_of_rings_are_cut_all_at_once(sketch):
    corners = select_vertices(*(Vertex(0, 0, k) for k in range(4)), *(Vertex(0, 1, k) for k in range(4)))
    change = vertices.bevel_corners(sketch, corners, 0.5)
    shape = change.sketch.get_item(0).shape
    assert change.description == "8 corners bevelled"
    assert shape.polygon.is_valid
    assert shape.polygon.area == pytest.approx(16.0 - 4 * 0.125 - (1.0 - 4 * 0.125))
    assert len(shape.vertices) == 8
    # Cuts that meet in the middle of an edge share one vertex.
    assert len(shape.holes[0]) == 4
    bounded = vertices.bevel_corners(sketch, select_vertices(Vertex(BOUNDARY, 0, 0)), 1.0).sketch.boundary
    assert bounded == ((0.0, 1.0), (1.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0))
    disc = (
        vertices.round_corners(sketch, select_vertices(*(Vertex(0, 0, k) for k in range(4))), 2.0)
        .sketch.get_item(0)
        .shape
    )
    assert shapely.Polygon(disc.vertices).area == pytest.approx(math.pi * 4.0, abs=0.02)


def test_a_straight_vertex_is_not_a_corner():
    ring = ((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 2.0))
    sketch, (key,) = Sketch().with_obstacles([PolygonObstacle(ring)])
    with pytest.raises(MapError, match="select corners"):
        vertices.bevel_corners(sketch, select_vertices(Vertex(key, 0, 1)), 0.1)
    spike = WallObstacle(((0.0, 0.0), (1.0, 0.0), (0.2, 0.0)), 0.1)
    sketch, (key,) = Sketch().with_obstacles([spike])
    with pytest.raises(MapError, match="fold back on each other"):
        vertices.bevel_corners(sketch, select_vertices(Vertex(key, 0, 1)), 0.1)


# edges


# holes and walls


def test_holes_are_filled(sketch):
    filled = vertices.fill_hole(sketch, 0, 1)
    assert filled.description == "hole of polygon “frame” filled"
    assert filled.sketch.get_item(0).shape.holes == ()


def test_a_wall_is_extended_split_and_joined(sketch):
    longer = vertices.extend_wall(sketch, Vertex(2, 0, 2), (11.0, 3.0))
    assert longer.sketch.get_item(2).shape.points[-1] == (11.0, 3.0)
    assert longer.selection == select_vertices(Vertex(2, 0, 3))
    before = vertices.extend_wall(sketch, Vertex(2, 0, 0), (6.0, 0.0))
    assert before.sketch.get_item(2).shape.points[0] == (6.0, 0.0)
    assert before.selection == select_vertices(Vertex(2, 0, 0))
    halves = vertices.split_wall(longer.sketch, Vertex(2, 0, 1))
    first, second = [halves.sketch.get_item(key).shape for key in sorted(halves.selection.items)]
    assert first.points == ((6.0, 1.0), (9.0, 1.0))
    assert second.points == ((9.0, 1.0), (9.0, 3.0), (11.0, 3.0))
    assert first.name == second.name == "west"
    again = vertices.join_walls(halves.sketch, halves.selection)
    assert again.sketch == longer.sketch
    assert again.description == "2 walls joined"


@given(st.permutations(range(4)), st.lists(st.booleans(), min_size=4, max_size=4))
def test_walls_join_in_any_order_either_way_round(order, turned):
    whole = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (3.0, 1.0), (3.0, 5.0)]
    pieces = [whole[k : k + 2][:: -1 if turned[k] else 1] for k in order]
    sketch, keys = Sketch().with_obstacles([WallObstacle(tuple(piece), 0.1) for piece in pieces])
    (item,) = vertices.join_walls(sketch, Selection.of(*keys)).sketch.obstacles
    assert list(item.shape.points) in (whole, whole[::-1])


def test_joined_walls_move_along_the_path_of_the_lowest():
    there = ObstaclePath(((0.5, 0.0), (0.5, 3.0)), 0.5, "back-and-forth")
    back = ObstaclePath(((0.5, 0.0), (3.0, 0.0)), 0.5, "back-and-forth")
    walls = [
        WallObstacle(((0.0, 0.0), (1.0, 0.0)), 0.1, path=there),
        WallObstacle(((1.0, 0.0), (2.0, 0.0)), 0.1, path=back),
        WallObstacle(((2.0, 0.0), (3.0, 0.0)), 0.1),
    ]
    sketch, keys = Sketch().with_obstacles(walls)
    change = vertices.join_walls(sketch, Selection.of(*keys))
    (item,) = change.sketch.obstacles
    assert item.shape.path == there
    assert change.description == "3 walls joined, 1 path removed"


def test_separate_walls_are_joined_at_their_nearest_ends():
    walls = [WallObstacle(((0.0, 0.0), (1.0, 0.0)), 0.1), WallObstacle(((5.0, 0.0), (2.0, 0.5)), 0.3, "b")]
    sketch, keys = Sketch().with_obstacles(walls)
    (item,) = vertices.join_walls(sketch, Selection.of(*keys)).sketch.obstacles
    assert item.shape == WallObstacle(((0.0, 0.0), (1.0, 0.0), (2.0, 0.5), (5.0, 0.0)), 0.1, "b")
