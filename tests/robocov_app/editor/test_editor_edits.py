"""Edits that add, transform and change objects, and impossible edits."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, positions, valid_shapes, valid_sketches
from hypothesis import given
from hypothesis import strategies as st
from shapely import affinity

from robocov.density import Gaussian, Gaussians, Raster, WeightedArea, WeightedPolygons
from robocov.environment import (
    CircleObstacle,
    DiscStart,
    ObstaclePath,
    PointsStart,
    PolygonObstacle,
    UniformStart,
    WallObstacle,
)
from robocov.errors import MapError
from robocov_app.editor.edits import boolean, create, properties, transform
from robocov_app.editor.edits.transform import Affine
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.geometry import round_length, round_point, round_ring
from robocov_app.editor.model.hit_test import find_in_box, find_owners
from robocov_app.editor.model.parser import parse_sketch
from robocov_app.editor.model.selection import Selection, Vertex
from robocov_app.editor.model.sketch import BOUNDARY, Sketch, dump_sketch
from robocov_app.toolkit.tools.geometry import compute_cos_sin

BOX = PolygonObstacle(((1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)), (), "desk")
PILLAR = CircleObstacle((6.0, 4.0), 0.5, "pillar")
WALL = WallObstacle(((5.0, 0.0), (5.0, 2.4), (7.0, 2.4)), 0.1)
STARTS = (
    ("corner", DiscStart((1.0, 5.0), 0.8)),
    ("two", PointsStart(((9.0, 1.0), (10.0, 1.0)))),
    ("all", UniformStart()),
)


@pytest.fixture
def sketch() -> Sketch:
    return Sketch("Hall", boundary=HALL, starts=STARTS).with_obstacles([BOX, PILLAR, WALL])[0]


ALL = Selection(frozenset({0, 1, 2}), frozenset(), frozenset({"corner", "two", "all"}), True)


# drawing


def test_drawn_obstacles_are_on_top_and_selected(sketch):
    box = ((1.0, 2.0), (3.0, 2.0), (3.0, 5.0), (1.0, 5.0))
    triangle = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    crossing = ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0))
    wall_points = [(1.0, 1.0), (1.0, 1.0), (2.0, 1.0)]
    for change, shape, description in (
        (create.add_circle(sketch, (2.00004, 3.0), 0.70001), CircleObstacle((2.0, 3.0), 0.7), "circle drawn"),
        (
            create.add_wall(sketch, wall_points, 0.15),
            WallObstacle(((1.0, 1.0), (2.0, 1.0)), 0.15),
            "wall drawn",
        ),
        (
            create.add_rectangle(sketch, [(3.0, 2.0), (1.0, 5.0)]),
            PolygonObstacle(box),
            "rectangle drawn",
        ),
        (
            create.add_polygon(sketch, [*triangle, triangle[0]]),
            PolygonObstacle(triangle),
            "polygon drawn",
        ),
        (create.add_polygon(sketch, crossing), PolygonObstacle(crossing), "polygon drawn"),
    ):
        assert len(change.sketch.obstacles) == 4
        item = change.sketch.obstacles[-1]
        assert item.shape == shape
        assert change.selection == Selection.of(item.key)
        assert change.description == description


def test_boundary_and_starts_are_drawn(sketch):
    ring = [(0.0, 0.0), (4.0, 0.0), (0.0, 4.0)]
    assert create.set_boundary(Sketch(), ring).description == "boundary drawn"
    change = create.set_boundary(sketch, ring)
    assert change.sketch.boundary == tuple(ring)
    assert change.selection == Selection(boundary=True)
    assert change.description == "boundary redrawn"
    change = create.add_disc_start(sketch, (2.0, 2.0), 0.5)
    assert change.sketch.starts[-1] == ("start", DiscStart((2.0, 2.0), 0.5))
    change = create.add_disc_start(change.sketch, (2.0, 2.0), 0.5)
    assert change.sketch.starts[-1][0] == "start 2"
    assert change.selection == Selection.of("start 2")
    change = create.add_points_start(sketch, [(1.0, 1.0), (2.0, 1.0), (1.0, 1.00001)])
    assert change.sketch.starts[-1] == ("start", PointsStart(((1.0, 1.0), (2.0, 1.0))))
    assert create.add_uniform_start(sketch).sketch.get_start("start") == UniformStart()


def resize_single_position(sketch: Sketch) -> None:
    change = create.add_points_start(sketch, [(1.0, 1.0)])
    transform.resize(change.sketch, change.selection, 2.0, None)


@pytest.mark.parametrize(
    ("deed", "words"),
    [
        (lambda s: create.add_polygon(s, [(0, 0), (1, 1)]), "three corners"),
        (lambda s: create.add_polygon(s, [(0, 0), (1, 1), (2, 2)]), "enclose an area"),
        (lambda s: create.add_rectangle(s, [(0, 0), (0, 3)]), "a width and a height"),
        (lambda s: create.add_circle(s, (0, 0), 0.0), "needs a radius"),
        (lambda s: create.add_circle(s, (0, 0), 1e5), "a radius from 20 mm to 10 km"),
        (lambda s: create.add_circle(s, (math.nan, 0), 1.0), "too far away"),
        (lambda s: create.add_circle(s, (1e8, 0), 1.0), "too far away"),
        (lambda s: create.add_wall(s, [(1, 1), (1, 1)], 0.1), "two different points"),
        (lambda s: create.add_wall(s, [(1, 1), (2, 1)], 0.0), "a width from 1 mm to 10 km"),
        (lambda s: create.set_boundary(s, [(1, 1), (2, 1)]), "three corners"),
        (lambda s: create.add_disc_start(s, (1, 1), 0.0), "needs a radius"),
        (lambda s: create.add_points_start(s, []), "at least one position"),
        (lambda s: transform.move(s, Selection(), 1, 1), "select something"),
        (lambda s: transform.move(s, ALL, 1e9, 1), "too far away"),
        (lambda s: transform.move(s, ALL, math.nan, 1), "too far away"),
        (lambda s: transform.rotate(s, ALL, math.inf), "an angle"),
        (lambda s: transform.scale(s, ALL, 0.0, 0.0), "a factor other than 0"),
        (lambda s: transform.scale(s, ALL, 1e9, 1e9), r"the factor 1e\+09 is too small or too large"),
        (
            lambda s: transform.scale(s, Selection.of("corner"), 1.0, 2.0),
            "by the same factor along both axes",
        ),
        (lambda s: transform.resize(s, Selection.of(0), None, None), "a width or a height"),
        (lambda s: transform.resize(s, Selection.of(0), 0.0, None), "a width from 1 mm"),
        (lambda s: transform.resize(s, Selection.of("all"), 1.0, None), "select something"),
        (resize_single_position, "the selection has no width that can be scaled"),
        (lambda s: transform.mirror(s, ALL, "z"), "an axis x or y"),
        (lambda s: transform.duplicate(s, Selection(boundary=True)), "obstacles or starts to copy"),
        (lambda s: transform.copy_to_grid(s, ALL, 1, 1, (1.0, 1.0)), "two columns or rows"),
        (lambda s: transform.copy_to_grid(s, ALL, 1000, 1000, (1.0, 1.0)), "more than 10000"),
        (lambda s: properties.delete(s, Selection()), "select something"),
        (lambda s: properties.rename(s, "corner", " "), "a start needs a name"),
        (lambda s: properties.rename(s, "corner", "two"), "a start named “two” already exists"),
        (lambda s: properties.rename(s, 0, "x" * 101), "at most 100 characters"),
        (lambda s: properties.rename(s, 0, "a\x00b"), "text on one line"),
        (lambda s: properties.rename(s, BOUNDARY, "b"), "boundary has no name"),
        (lambda s: properties.set_note(s, Selection.of("corner"), "x"), "select the obstacles to annotate"),
        (lambda s: properties.set_title(s, ""), "a map needs a name"),
        (lambda s: properties.set_description(s, "x" * 10001), "at most 10000"),
        (lambda s: properties.set_width(s, Selection.of(0), 0.2), "select walls"),
        (lambda s: properties.set_width(s, ALL, 1e5), "a width from 1 mm to 10 km"),
        (lambda s: properties.set_radius(s, Selection.of(0), 0.2), "select circles"),
        (lambda s: boolean.offset(s, ALL, 1e5), "a length from 1 mm to 10 km"),
        (lambda s: properties.restack(s, ALL, "left"), "top or bottom"),
        (lambda s: properties.make_default_start(s, "none"), "no start “none”"),
        (lambda s: properties.convert_to_polygons(s, Selection.of(0)), "select circles or walls"),
        (lambda s: properties.convert_to_boundary(s, Selection.of(1)), "select one polygon"),
    ],
)
def test_impossible_edits_raise_a_map_error(sketch, deed, words):
    with pytest.raises(MapError, match=words) as caught:
        deed(sketch)
    assert "\n" not in str(caught.value)


# placing


def collect_shapes(sketch: Sketch) -> shapely.Geometry:
    shapes = [item.shape.polygon for item in sketch.obstacles]
    return shapely.GeometryCollection([*shapes, shapely.Polygon(sketch.boundary)])


def compute_distance(a: shapely.Geometry, b: shapely.Geometry) -> float:
    """Return the largest distance between corresponding vertices."""
    first = shapely.get_coordinates(a)
    second = shapely.get_coordinates(b)
    assert len(first) == len(second)
    return float(np.abs(first - second).max())


@given(valid_sketches(min_size=1), st.sampled_from([0.0, 1.0, -2.7, 0.1234]), positions)
def test_moving_agrees_with_shapely(sketch, dx, about):
    change = transform.move(sketch, Selection.select_all(sketch), dx, 0.5)
    expected = affinity.translate(collect_shapes(sketch), dx, 0.5)
    assert compute_distance(collect_shapes(change.sketch), expected) <= 1e-4
    moved_back = transform.move(change.sketch, change.selection, -dx, -0.5).sketch
    assert moved_back == sketch


@given(valid_sketches(min_size=1), st.sampled_from([90.0, 180.0, -90.0, 30.0, 45.0, 1.0]), positions)
def test_turning_agrees_with_shapely(sketch, degrees, about):
    polygons = [item.key for item in sketch.obstacles if isinstance(item.shape, PolygonObstacle)]
    change = transform.rotate(sketch, Selection(frozenset(polygons), boundary=True), degrees, about)
    for key in polygons:
        expected = affinity.rotate(sketch.get_item(key).shape.polygon, degrees, origin=about)
        assert compute_distance(change.sketch.get_item(key).shape.polygon, expected) <= 1e-4
    whole = Selection(frozenset(item.key for item in sketch.obstacles))
    quarter = sketch
    for _ in range(4):
        quarter = transform.rotate(quarter, whole, 90.0, about).sketch
    assert quarter == sketch, "a whole turn in quarters is exact"


def test_circles_walls_and_starts_turn_too(sketch):
    change = transform.rotate(sketch, ALL, 90.0, (0.0, 0.0))
    assert change.sketch.get_item(1).shape == replace(PILLAR, center=(-4.0, 6.0))
    assert change.sketch.get_item(2).shape.points == ((0.0, 5.0), (-2.4, 5.0), (-2.4, 7.0))
    assert change.sketch.get_start("corner") == DiscStart((-5.0, 1.0), 0.8)
    assert change.sketch.get_start("two") == PointsStart(((-1.0, 9.0), (-1.0, 10.0)))
    assert change.sketch.get_start("all") == UniformStart()
    assert change.sketch.boundary == ((0.0, 0.0), (0.0, 12.0), (-8.0, 12.0), (-8.0, 0.0))
    # By default, the center of rotation is the middle of the object.
    assert transform.rotate(sketch, Selection.of(0), 90.0).sketch.get_item(0).shape.vertices == (
        (2.5, 0.5),
        (2.5, 2.5),
        (1.5, 2.5),
        (1.5, 0.5),
    )


def test_scaling_both_ways_grows_radii_and_widths(sketch):
    change = transform.scale(sketch, ALL, 2.0, 2.0, (0.0, 0.0))
    assert change.sketch.get_item(1).shape == CircleObstacle((12.0, 8.0), 1.0, "pillar")
    assert change.sketch.get_item(2).shape == WallObstacle(((10.0, 0.0), (10.0, 4.8), (14.0, 4.8)), 0.2)
    assert change.sketch.get_start("corner") == DiscStart((2.0, 10.0), 1.6)
    assert collect_shapes(change.sketch).area == pytest.approx(4.0 * collect_shapes(sketch).area, rel=1e-3)


def test_stretching_makes_polygons_of_circles_and_keeps_the_width_of_walls(sketch):
    change = transform.scale(sketch, Selection.of(0, 1, 2), 2.0, 1.0, (0.0, 0.0))
    ellipse = change.sketch.get_item(1).shape
    assert isinstance(ellipse, PolygonObstacle)
    assert ellipse.name == "pillar"
    assert ellipse.polygon.area == pytest.approx(2.0 * PILLAR.polygon.area, rel=1e-3)
    assert change.sketch.get_item(2).shape.width == 0.1
    mirrored = transform.scale(sketch, Selection.of(1), -1.0, 1.0, (0.0, 0.0))
    assert mirrored.sketch.get_item(1).shape == replace(PILLAR, center=(-6.0, 4.0))


@given(valid_shapes(), st.sampled_from([0.2, 1.0, 3.7]), st.sampled_from([0.5, 2.0]))
def test_resizing_gives_the_typed_size(shape, width, height):
    sketch, (key,) = Sketch().with_obstacles([shape])
    before = transform.compute_bounds(sketch, Selection.of(key))
    for size in ((width, height), (width, None), (None, height)):
        try:
            change = transform.resize(sketch, Selection.of(key), *size)
        except MapError as error:
            # The height of a horizontal wall is its width.
            assert isinstance(shape, WallObstacle)
            assert "walls keep their width" in str(error)
            continue
        low_x, low_y, high_x, high_y = transform.compute_bounds(change.sketch, change.selection)
        if size[0] is not None:
            assert high_x - low_x == pytest.approx(size[0], abs=3e-4)
        if size[1] is not None:
            assert high_y - low_y == pytest.approx(size[1], abs=3e-4)
        if None not in size:
            assert (low_x, low_y) == pytest.approx(before[:2], abs=3e-4)


def test_placing_gives_the_typed_position(sketch):
    change = transform.place(sketch, Selection.of(0), 4.0, None)
    assert transform.compute_bounds(change.sketch, change.selection) == (4.0, 1.0, 6.0, 2.0)
    change = transform.place(sketch, Selection.of(1, "corner"), 0.0, 0.0)
    assert transform.compute_bounds(change.sketch, change.selection)[:2] == pytest.approx(
        (0.0, 0.0), abs=1e-4
    )


@given(valid_sketches(min_size=1), st.sampled_from(["x", "y"]))
def test_mirroring_twice_changes_nothing(sketch, axis):
    whole = Selection.select_all(sketch)
    once = transform.mirror(sketch, whole, axis).sketch
    assert (
        compute_distance(collect_shapes(transform.mirror(once, whole, axis).sketch), collect_shapes(sketch))
        <= 3e-4
    )


def test_vertices_are_moved_once_with_their_owner(sketch):
    corner = Vertex(0, 0, 2)
    change = transform.move(sketch, Selection(frozenset({1}), frozenset({corner})), 1.0, 0.0)
    assert change.sketch.get_item(0).shape.vertices == ((1.0, 1.0), (3.0, 1.0), (4.0, 2.0), (1.0, 2.0))
    assert change.sketch.get_item(1).shape.center == (7.0, 4.0)
    once = transform.move(sketch, Selection(frozenset({0}), frozenset({corner})), 1.0, 0.0)
    assert once.sketch.get_item(0).shape == Affine(x0=1.0).transform(BOX)
    turned = transform.rotate(sketch, Selection(vertices=frozenset({corner, Vertex(0, 0, 3)})), 180.0)
    assert turned.sketch.get_item(0).shape.vertices == ((1.0, 1.0), (3.0, 1.0), (1.0, 2.0), (3.0, 2.0))


def test_objects_are_duplicated_and_copied_to_a_grid(sketch):
    noted = properties.set_note(sketch, Selection.of(0), "oak").sketch
    change = transform.duplicate(noted, Selection.of(0, "corner", "all"), 1.0, 0.5)
    copy = change.sketch.obstacles[-1]
    assert copy.shape == Affine(x0=1.0, y0=0.5).transform(BOX)
    assert copy.note == "oak"
    assert change.sketch.get_start("corner 2") == DiscStart((2.0, 5.5), 0.8)
    assert change.selection == Selection.of(copy.key, "corner 2", "all 2")
    again = transform.duplicate(change.sketch, change.selection)
    assert "corner 3" in dict(again.sketch.starts)
    grid = transform.copy_to_grid(sketch, Selection.of(1), 3, 2, (1.5, 2.0))
    centers = [item.shape.center for item in grid.sketch.obstacles if isinstance(item.shape, CircleObstacle)]
    assert centers == [(6.0, 4.0), (7.5, 4.0), (9.0, 4.0), (6.0, 6.0), (7.5, 6.0), (9.0, 6.0)]
    assert len(grid.selection.items) == 6
    assert grid.description == "circle “pillar” copied into 3 × 2"


# the rest


def test_objects_and_vertices_are_deleted(sketch):
    change = properties.delete(
        sketch, Selection(frozenset({0}), frozenset({Vertex(2, 0, 1)}), frozenset({"two"}))
    )
    assert [item.key for item in change.sketch.obstacles] == [1, 2]
    assert change.sketch.get_item(2).shape.points == ((5.0, 0.0), (7.0, 2.4))
    assert [name for name, _ in change.sketch.starts] == ["corner", "all"]
    assert change.selection == Selection()
    assert change.description == "3 objects deleted"
    assert properties.delete(sketch, Selection(boundary=True)).sketch.boundary is None


def test_objects_are_renamed_and_annotated(sketch):
    assert properties.rename(sketch, 2, " west\twall ").sketch.get_item(2).shape.name == "west wall"
    change = properties.rename(sketch, 0, "")
    assert change.sketch.get_item(0).shape.name is None
    assert change.description == "polygon “desk”: name removed"
    change = properties.rename(sketch, "two", "pair")
    assert [name for name, _ in change.sketch.starts] == ["corner", "pair", "all"]
    assert change.selection == Selection.of("pair")
    change = properties.set_note(sketch, Selection.of(0, 2), " ask Ada ")
    assert [item.note for item in change.sketch.obstacles] == ["ask Ada", "", "ask Ada"]
    assert properties.set_note(change.sketch, Selection.of(0), "").sketch.get_item(0).note == ""
    titled = properties.set_title(sketch, "Office").sketch
    change = properties.set_description(titled, "One floor.")
    assert (change.sketch.name, change.sketch.description) == ("Office", "One floor.")
    # Lone surrogates, which files cannot contain, are removed.
    assert properties.rename(sketch, 0, "a\ud800b").sketch.get_item(0).shape.name == "ab"


def test_widths_and_radii_are_set(sketch):
    change = properties.set_width(sketch, ALL, 0.25)
    assert change.sketch.get_item(2).shape == replace(WALL, width=0.25)
    assert change.description == "wall made 0.25 m wide"
    change = properties.set_radius(sketch, ALL, 1.25)
    assert change.sketch.get_item(1).shape.radius == 1.25
    assert change.sketch.get_start("corner") == DiscStart((1.0, 5.0), 1.25)


@pytest.mark.parametrize(
    ("end", "order"),
    [("top", [1, 2, 3, 0]), ("bottom", [0, 1, 2, 3])],
)
def test_obstacles_are_restacked(end, order):
    sketch, _ = Sketch().with_obstacles([BOX, PILLAR, WALL, PILLAR])
    assert [item.key for item in properties.restack(sketch, Selection.of(0), end).sketch.obstacles] == order


def test_restacked_obstacles_keep_their_order():
    sketch, _ = Sketch().with_obstacles([BOX, PILLAR, WALL, PILLAR])
    for end, order in [("bottom", [1, 2, 0, 3]), ("top", [0, 3, 1, 2])]:
        change = properties.restack(sketch, Selection.of(1, 2), end)
        assert [item.key for item in change.sketch.obstacles] == order
    there = properties.restack(sketch, Selection.of(2, 3), "top")
    assert there.sketch == sketch


def test_groups_locks_and_hidden_obstacles_are_saved(sketch):
    change = properties.group(sketch, Selection.of(0, 1))
    assert change.description == "2 obstacles grouped as “group 1”"
    assert properties.group(change.sketch, Selection.of(1, 2)).sketch.get_item(2).group == "group 2"
    assert Selection.of(0).with_groups(change.sketch) == Selection.of(0, 1)
    assert Selection.of(2).with_groups(change.sketch) == Selection.of(2)
    held = properties.lock(change.sketch, Selection.of(0))
    assert held.description.endswith("locked") and held.selection == Selection()
    unseen = properties.hide(held.sketch, Selection.of(1, 2)).sketch
    assert find_owners(unseen, (2.0, 1.5), 0.1) == find_owners(unseen, (6.0, 4.0), 0.1) == ()
    assert (
        not find_in_box(unseen, (-50.0, -50.0), (50.0, 50.0)).items and not Selection.select_all(unseen).items
    )
    assert parse_sketch(dump_sketch(unseen), "again") == unseen
    assert Sketch.from_environment(unseen.build_environment()) == unseen
    shown = properties.unlock_and_show_all(unseen)
    assert shown.sketch == change.sketch and shown.description == "3 obstacles unlocked and shown"
    ungrouped = properties.ungroup(held.sketch, Selection.of(0, 1, 2))
    assert not any(item.group for item in ungrouped.sketch.obstacles)
    for deed, words in [
        (lambda: properties.group(sketch, Selection.of(0)), "two or more"),
        (lambda: properties.ungroup(sketch, Selection.of(0)), "in a group"),
        (lambda: properties.lock(sketch, Selection()), "select obstacles"),
    ]:
        with pytest.raises(MapError, match=words):
            deed()


def test_starts_have_an_order_and_kinds(sketch):
    assert properties.make_default_start(sketch, "all").sketch.starts[0][0] == "all"


def test_a_polygon_becomes_the_boundary(sketch):
    change = properties.convert_to_boundary(sketch, Selection.of(0))
    assert change.sketch.boundary == BOX.vertices
    assert [item.key for item in change.sketch.obstacles] == [1, 2]
    assert (
        properties.set_background(sketch, Background("p.png", (3, 4))).description == "background image added"
    )


def test_bounds_enclose_objects_and_vertices(sketch):
    assert transform.compute_bounds(sketch, Selection.of(0)) == (1.0, 1.0, 3.0, 2.0)
    assert transform.compute_bounds(sketch, Selection.of(2)) == pytest.approx((4.95, 0.0, 7.0, 2.45))
    assert transform.compute_bounds(sketch, Selection.of("corner")) == pytest.approx((0.2, 4.2, 1.8, 5.8))
    assert transform.compute_bounds(sketch, Selection(vertices=frozenset({Vertex(0, 0, 0)}))) == (
        1.0,
        1.0,
        1.0,
        1.0,
    )
    assert transform.compute_bounds(sketch, Selection.of("all")) is None
    assert transform.compute_bounds(sketch, Selection.of(BOUNDARY)) == (0.0, 0.0, 12.0, 8.0)


def test_removed_objects_are_not_moved(sketch):
    change = transform.move(sketch, Selection(frozenset({0, 99}), starts=frozenset({"none"})), 1.0, 0.0)
    assert change.selection == Selection.of(0) and change.sketch.get_item(0).shape.vertices[0] == (2.0, 1.0)
    with pytest.raises(MapError, match="select something"):
        transform.rotate(sketch, Selection.of(99), 90.0, (0.0, 0.0))


def test_bounds_of_many_objects_enclose_each():
    shapes = [
        CircleObstacle((k, 1.0), 0.3) if k % 3 else WallObstacle(((k, 2.0), (k, 3.0)), 0.2)
        for k in range(150)
    ]
    sketch, keys = Sketch().with_obstacles([*shapes, PolygonObstacle(())])
    boxes = np.array([box for key in keys if (box := transform.compute_box(sketch, key)) is not None])
    expected = (*boxes[:, :2].min(axis=0), *boxes[:, 2:].max(axis=0))
    assert transform.compute_bounds(sketch, Selection.of(*keys)) == expected


# the plane


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_rounding_is_stable_and_the_same_everywhere(x, y):
    point = round_point((x, y))
    assert round_point(point) == point
    (near,) = round_ring(np.array([[x, y]]))
    assert round_ring(np.array([near])) == (near,)
    assert near == pytest.approx(point, abs=1.001e-4)
    assert round_length(x) == point[0]
    assert math.copysign(1.0, round_ring(np.array([[-1e-9, 0.0]]))[0][0]) == 1.0


@given(st.floats(-1e4, 1e4))
def test_cosine_and_sine_are_exact_at_quarter_turns(degrees):
    cos, sin = compute_cos_sin(degrees)
    assert (cos, sin) == pytest.approx(
        (math.cos(math.radians(degrees)), math.sin(math.radians(degrees))), abs=1e-9
    )
    assert compute_cos_sin(450.0) == (0.0, 1.0)


def test_affine_maps_have_a_common_factor():
    assert Affine.rotation(33.0, (1.0, 2.0)).factor == 1.0
    assert Affine.scaling(2.0, 2.0, (0.0, 0.0)).factor == pytest.approx(2.0)
    assert Affine.scaling(-2.0, 2.0, (0.0, 0.0)).factor == pytest.approx(2.0)
    assert Affine.scaling(2.0, 1.0, (0.0, 0.0)).factor is None
    assert Affine(1.0, 0.5, 0.0, 1.0).factor is None


def test_a_tilted_scan_is_levelled_by_two_points_on_a_wall():
    path = ObstaclePath(((6.0, 4.0), (8.0, 4.0)), 0.5)
    level, keys = Sketch(boundary=HALL, starts=(("a", DiscStart((1.0, 1.0), 0.5)),)).with_obstacles(
        [WallObstacle(((2.0, 3.0), (5.0, 3.0)), 0.1), CircleObstacle((6.0, 4.0), 0.5, None, path)]
    )
    peaks = (Gaussian((2.0, 2.0), 3.0, covariance=((4.0, 1.0), (1.0, 1.0))), Gaussian((3.0, 1.0), 1.0, 0.5))
    picture = Background("scan.png", (100, 80), 0.1)
    level = replace(level, density=Gaussians(peaks), background=picture)
    collect_shapes = replace(Selection.of(*keys, "a"), boundary=True)
    tilted = transform.rotate(level, collect_shapes, 7.0, (0.0, 0.0)).sketch
    assert transform.level_map(level, (2.0, 3.0), (5.0, 3.0)).sketch == level
    change = transform.level_map(tilted, *tilted.get_item(keys[0]).shape.points)
    after = change.sketch
    assert change.description == "map rotated by -7.00°"
    (ax, ay), (bx, by) = after.get_item(keys[0]).shape.points
    assert (bx - ax, by - ay) == pytest.approx((3.0, 0.0), abs=3e-4)
    for was, now in zip(level.boundary, after.boundary, strict=True):
        assert (now[0] - ax + 2.0, now[1] - ay + 3.0) == pytest.approx(was, abs=1e-3)
    assert after.get_item(keys[1]).shape.path.points[1][1] == pytest.approx(ay + 1.0, abs=1e-3)
    assert after.background.rotation_deg == pytest.approx(-7.0, abs=0.01)
    turned, round_one = after.density.peaks
    assert np.linalg.eigvalsh(turned.covariance) == pytest.approx(np.linalg.eigvalsh(peaks[0].covariance))
    assert turned.covariance != peaks[0].covariance and round_one.sigma == 0.5
    offset = np.subtract(turned.center, round_one.center)
    assert np.hypot(*offset) == pytest.approx(np.hypot(1.0, 1.0), abs=1e-3)
    areas = WeightedPolygons((WeightedArea(((1.0, 1.0), (2.0, 1.0), (2.0, 2.0)), 2.0),), 1.0)
    upright = transform.level_map(replace(level, density=areas), (0.0, 0.0), (-0.1, 1.0)).sketch
    assert upright.density.areas[0].vertices[0] == pytest.approx((1.0945, 0.8955), abs=2e-4)
    with pytest.raises(MapError, match="cannot be rotated"):
        transform.level_map(replace(level, density=Raster(np.eye(3), (0, 0, 9, 9))), (0.0, 0.0), (3.0, 1.0))
    with pytest.raises(MapError, match="two different points"):
        transform.level_map(level, (1.0, 1.0), (1.0, 1.0))
