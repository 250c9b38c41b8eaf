"""Finding objects at a point or in a box, and selecting them."""

import math

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, positions, valid_sketches
from hypothesis import given
from hypothesis import strategies as st

from robocov.environment import (
    CircleObstacle,
    DiscStart,
    PointsStart,
    PolygonObstacle,
    UniformStart,
    WallObstacle,
)
from robocov.errors import MapError
from robocov_app.editor.model.hit_test import find_edge, find_in_box, find_owners, find_vertices_in_box
from robocov_app.editor.model.selection import (
    Edge,
    Selection,
    Vertex,
    find_position,
    list_vertices,
)
from robocov_app.editor.model.sketch import BOUNDARY, Sketch

LOW = PolygonObstacle(
    ((1.0, 1.0), (5.0, 1.0), (5.0, 5.0), (1.0, 5.0)), (((2.0, 2.0), (3.0, 2.0), (3.0, 3.0)),)
)
HIGH = CircleObstacle((4.0, 4.0), 2.0, "lamp")
WALL = WallObstacle(((8.0, 1.0), (11.0, 1.0)), 0.1)
STARTS = (
    ("disc", DiscStart((4.5, 2.0), 1.0)),
    ("two", PointsStart(((8.0, 6.0), (9.0, 6.0)))),
    ("all", UniformStart()),
)


@pytest.fixture
def sketch() -> Sketch:
    return Sketch("Hall", boundary=HALL, starts=STARTS).with_obstacles([LOW, HIGH, WALL])[0]


def find_owner_at(sketch: Sketch, point, reach: float):
    return next(iter(find_owners(sketch, point, reach)), None)


def test_a_click_finds_the_topmost_obstacle(sketch):
    assert find_owner_at(sketch, (4.0, 4.0), 0.1) == 1
    assert find_owners(sketch, (4.0, 4.0), 0.1) == (1, 0)
    assert find_owner_at(sketch, (1.2, 1.2), 0.1) == 0
    # A click in a hole finds nothing, but a click near its edge finds the obstacle.
    assert find_owner_at(sketch, (2.7, 2.3), 0.05) is None
    assert find_owner_at(sketch, (2.7, 2.05), 0.1) == 0


def test_starts_are_above_obstacles_at_their_center_and_rim(sketch):
    assert find_owner_at(sketch, (4.5, 2.0), 0.1) == "disc"
    assert find_owner_at(sketch, (4.5, 1.02), 0.1) == "disc"
    assert find_owners(sketch, (4.5, 1.5), 0.1) == (0, "disc")
    assert find_owner_at(sketch, (5.3, 2.0), 0.1) == "disc"
    assert find_owner_at(sketch, (8.05, 6.0), 0.1) == "two"


def test_nearby_obstacles_are_found_where_none_covers_the_point(sketch):
    assert find_owner_at(sketch, (9.0, 1.1), 0.1) == 2
    assert find_owner_at(sketch, (9.0, 1.2), 0.1) is None
    assert find_owner_at(sketch, (12.0, 6.0), 0.1) == BOUNDARY
    assert find_owner_at(sketch, (11.95, 6.0), 0.1) == BOUNDARY
    assert find_owner_at(sketch, (10.0, 5.0), 0.1) is None
    assert find_owner_at(Sketch(), (0.0, 0.0), 1.0) is None


@given(valid_sketches(min_size=2), positions, st.sampled_from([0.05, 0.5]))
def test_the_nearest_vertices_and_edges_are_found(sketch, point, reach):
    owners = [BOUNDARY, *(item.key for item in sketch.obstacles), *(name for name, _ in sketch.starts)]
    lines = [
        shapely.LineString([*points, *points[:1]] if closed else points)
        for owner in owners
        for _, points, closed in sketch.list_rings(owner)
    ]
    nearest = min(line.distance(shapely.Point(point)) for line in lines)
    edge = find_edge(sketch, point, reach, owners)
    if nearest > reach:
        assert edge is None
    else:
        assert math.dist(point, edge.point) == pytest.approx(nearest, abs=1e-9)
        ring = sketch.list_vertex_rings(edge.owner)[edge.ring]
        a = ring[edge.index]
        b = ring[(edge.index + 1) % len(ring)]
        assert shapely.LineString([a, b]).distance(shapely.Point(edge.point)) < 1e-9


def test_objects_have_the_expected_vertices(sketch):
    assert [at for _, at in list_vertices(sketch, 1)] == [
        (4.0, 4.0),
        (6.0, 4.0),
        (4.0, 6.0),
        (2.0, 4.0),
        (4.0, 2.0),
    ]
    assert list_vertices(sketch, 0)[4] == (Vertex(0, 1, 0), (2.0, 2.0))
    assert [vertex.index for vertex, _ in list_vertices(sketch, "disc")] == [0, 1, 2, 3, 4]
    assert list_vertices(sketch, "two")[1] == (Vertex("two", 0, 1), (9.0, 6.0))
    assert list_vertices(sketch, "all") == ()
    assert len(list_vertices(sketch, BOUNDARY)) == 4
    assert list_vertices(sketch, 77) == list_vertices(sketch, "none") == ()
    assert [closed for _, _, closed in sketch.list_rings(2)] == [False]
    assert sketch.list_rings(1) == sketch.list_rings("disc") == ()
    with pytest.raises(MapError, match="vertex no longer exists"):
        find_position(sketch, Vertex(0, 0, 4))


def test_boxes_select_objects(sketch):
    assert find_in_box(sketch, (0.5, 0.5), (5.4, 5.5)) == Selection(frozenset({0}))
    everything = find_in_box(sketch, (13.0, 9.0), (-1.0, -1.0))
    assert everything == Selection(frozenset({0, 1, 2}), starts=frozenset({"disc", "two"}), boundary=True)
    touched = find_in_box(sketch, (4.9, 0.5), (8.5, 6.5), includes_partial=True)
    assert touched == Selection(frozenset({0, 1, 2}), starts=frozenset({"disc", "two"}))
    # The corner of the box does not reach the disc.
    assert not find_in_box(sketch, (5.3, 2.8), (6.0, 3.0), includes_partial=True).starts
    assert find_in_box(Sketch(), (0.0, 0.0), (1.0, 1.0), includes_partial=True) == Selection()
    corners = find_vertices_in_box(sketch, (0.0, 0.0), (2.5, 2.5), [0, BOUNDARY, 2])
    assert corners.vertices == {Vertex(0, 0, 0), Vertex(0, 1, 0), Vertex(BOUNDARY, 0, 0)}


@given(valid_sketches(min_size=1), positions, positions)
def test_boxes_agree_with_shapely(sketch, a, b):
    box = shapely.box(min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1]))
    inside = {item.key for item in sketch.obstacles if box.covers(item.shape.polygon.envelope)}
    assert find_in_box(sketch, a, b).items == inside
    touched = {item.key for item in sketch.obstacles if box.intersects(item.shape.polygon)}
    assert find_in_box(sketch, a, b, includes_partial=True).items == touched


def test_selections_can_be_united_and_toggled(sketch):
    a = Selection.of(0, "disc", BOUNDARY)
    assert a == Selection(frozenset({0}), frozenset(), frozenset({"disc"}), True)
    assert a.owners == {0, "disc", BOUNDARY}
    b = Selection.of(1, "disc")
    assert a.union(b) == Selection.of(0, 1, "disc", BOUNDARY)
    assert a.toggle(b) == Selection.of(0, 1, BOUNDARY)
    assert a.toggle(a) == Selection()
    assert not Selection()
    assert Selection(vertices=frozenset({Vertex(0, 0, 0)}))
    assert Selection.select_all(sketch).owners == {0, 1, 2, "disc", "two", "all", BOUNDARY}
    gone = Selection(frozenset({0, 9}), frozenset({Vertex(0, 0, 3), Vertex(0, 0, 4)}), frozenset({"x"}), True)
    assert gone.restrict_to(sketch) == Selection(
        frozenset({0}), frozenset({Vertex(0, 0, 3)}), frozenset(), True
    )
    assert not gone.restrict_to(Sketch())


VERTEX = Vertex(0, 0, 0)


@pytest.mark.parametrize(
    ("selection", "description"),
    [
        pytest.param(Selection(), "nothing", id="nothing"),
        pytest.param(Selection.of(1), "circle “lamp”", id="named obstacle"),
        pytest.param(Selection.of(0), "polygon", id="obstacle"),
        pytest.param(Selection.of(0, 1), "2 obstacles", id="obstacles"),
        pytest.param(Selection.of("disc"), "start “disc”", id="start"),
        pytest.param(Selection.of("disc", "two"), "2 starts", id="starts"),
        pytest.param(Selection(boundary=True), "boundary", id="boundary"),
        pytest.param(Selection(vertices=frozenset({VERTEX})), "vertex", id="vertex"),
        pytest.param(Selection(vertices=frozenset({VERTEX, Vertex(0, 0, 1)})), "2 vertices", id="vertices"),
        pytest.param(Selection.of(0, 1, "disc"), "3 objects", id="objects"),
    ],
)
def test_selections_are_described(sketch, selection, description):
    assert selection.describe(sketch) == description


def test_the_boundary_has_a_name_for_the_user(sketch):
    assert sketch.display_name(BOUNDARY) == "boundary"


def test_picking_among_a_thousand_obstacles_measures_only_nearby_ones(monkeypatch):
    rng = np.random.default_rng(0)
    shapes = [CircleObstacle((float(x), float(y)), 0.3) for x, y in rng.uniform(0, 50, (1000, 2))]
    sketch, keys = Sketch(boundary=HALL).with_obstacles(shapes)
    measured = []
    distance = shapely.distance
    monkeypatch.setattr(
        shapely, "distance", lambda shape, *more: measured.append(np.size(shape)) or distance(shape, *more)
    )
    for x, y in rng.uniform(0, 50, (50, 2)).tolist():
        find_owner_at(sketch, (x, y), 0.1)
        find_edge(sketch, (x, y), 0.1, keys)
        find_in_box(sketch, (x, y), (x + 5, y + 5), includes_partial=True)
    assert measured and sum(measured) < 50 * 20


def test_edges_are_values():
    assert Edge(0, 0, 1, (1.0, 2.0)) == Edge(0, 0, 1, (1.0, 2.0))
    assert len({Vertex(0, 0, 0), Vertex(0, 0, 0), Vertex("0", 0, 0)}) == 2
