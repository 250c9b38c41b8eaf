import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, places, sound_shapes, sound_sketches
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
from robocov_app.editor.edits import create, properties, transform
from robocov_app.editor.edits.transform import Affine
from robocov_app.editor.model.background import Background
from robocov_app.editor.model.geometry import cos_sin, ring_near, rounded, tenths
from robocov_app.editor.model.hit_test import in_box, owners_at
from robocov_app.editor.model.parser import parse_sketch
from robocov_app.editor.model.selection import Selection, Vertex
from robocov_app.editor.model.sketch import BOUNDARY, Sketch, sketch_text

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
    return Sketch("Hall", boundary=HALL, starts=STARTS).added([BOX, PILLAR, WALL])[0]


ALL = Selection(frozenset({0, 1, 2}), frozenset(), frozenset({"corner", "two", "all"}), True)


# drawing


def test_what_is_drawn_lies_on_top_and_is_selected(sketch):
    change = create.circle_drawn(sketch, (2.00004, 3.0), 0.70001)
    item = change.sketch.obstacles[-1]
    assert item.shape == CircleObstacle((2.0, 3.0), 0.7)
    assert change.selection == Selection.of(item.key)
    assert change.words == "circle drawn"
    wall = create.wall_drawn(sketch, [(1.0, 1.0), (1.0, 1.0), (2.0, 1.0)], 0.15)
    assert wall.sketch.obstacles[-1].shape == WallObstacle(((1.0, 1.0), (2.0, 1.0)), 0.15)
    box = create.rectangle_drawn(sketch, [(3.0, 2.0), (1.0, 5.0)])
    assert box.sketch.obstacles[-1].shape.vertices == ((1.0, 2.0), (3.0, 2.0), (3.0, 5.0), (1.0, 5.0))
    ring = create.polygon_drawn(sketch, [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)])
    assert ring.sketch.obstacles[-1].shape.vertices == ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    crossing = create.polygon_drawn(sketch, [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)])
    assert len(crossing.sketch.obstacles) == 4


def test_boundary_and_starts_are_drawn(sketch):
    ring = [(0.0, 0.0), (4.0, 0.0), (0.0, 4.0)]
    assert create.boundary_drawn(Sketch(), ring).words == "boundary drawn"
    change = create.boundary_drawn(sketch, ring)
    assert change.sketch.boundary == tuple(ring)
    assert change.selection == Selection(boundary=True)
    assert change.words == "boundary drawn anew"
    change = create.disc_start_drawn(sketch, (2.0, 2.0), 0.5)
    assert change.sketch.starts[-1] == ("start", DiscStart((2.0, 2.0), 0.5))
    change = create.disc_start_drawn(change.sketch, (2.0, 2.0), 0.5)
    assert change.sketch.starts[-1][0] == "start 2"
    assert change.selection == Selection.of("start 2")
    change = create.points_start_drawn(sketch, [(1.0, 1.0), (2.0, 1.0), (1.0, 1.00001)])
    assert change.sketch.starts[-1] == ("start", PointsStart(((1.0, 1.0), (2.0, 1.0))))
    assert create.anywhere_added(sketch).sketch.start("start") == UniformStart()


@pytest.mark.parametrize(
    ("deed", "words"),
    [
        (lambda s: create.polygon_drawn(s, [(0, 0), (1, 1)]), "three corners"),
        (lambda s: create.polygon_drawn(s, [(0, 0), (1, 1), (2, 2)]), "enclose something"),
        (lambda s: create.rectangle_drawn(s, [(0, 0), (0, 3)]), "a width and a height"),
        (lambda s: create.circle_drawn(s, (0, 0), 0.0), "needs a radius"),
        (lambda s: create.circle_drawn(s, (math.nan, 0), 1.0), "too far away"),
        (lambda s: create.circle_drawn(s, (1e8, 0), 1.0), "too far away"),
        (lambda s: create.wall_drawn(s, [(1, 1), (1, 1)], 0.1), "two points that are apart"),
        (lambda s: create.wall_drawn(s, [(1, 1), (2, 1)], 0.0), "width is at least 1 mm"),
        (lambda s: create.boundary_drawn(s, [(1, 1), (2, 1)]), "three corners"),
        (lambda s: create.disc_start_drawn(s, (1, 1), 0.0), "needs a radius"),
        (lambda s: create.points_start_drawn(s, []), "a place for a robot"),
        (lambda s: transform.moved(s, Selection(), 1, 1), "select something"),
        (lambda s: transform.moved(s, ALL, 1e9, 1), "too far away"),
        (lambda s: transform.moved(s, ALL, math.nan, 1), "too far away"),
        (lambda s: transform.rotated(s, ALL, math.inf), "an angle"),
        (lambda s: transform.scaled(s, ALL, 0.0, 0.0), "a factor that is not 0"),
        (lambda s: transform.scaled(s, Selection.of("corner"), 1.0, 2.0), "by the same factor both ways"),
        (lambda s: transform.resized(s, Selection.of(0), None, None), "a width or a height"),
        (lambda s: transform.resized(s, Selection.of(0), 0.0, None), "a width from 1 mm"),
        (lambda s: transform.resized(s, Selection.of("all"), 1.0, None), "select something"),
        (lambda s: transform.mirrored(s, ALL, "z"), "an axis x or y"),
        (lambda s: transform.duplicated(s, Selection(boundary=True)), "obstacles or starts to copy"),
        (lambda s: transform.arrayed(s, ALL, 1, 1, 1.0, 1.0), "two columns or rows"),
        (lambda s: transform.arrayed(s, ALL, 1000, 1000, 1.0, 1.0), "more than 10000"),
        (lambda s: properties.deleted(s, Selection()), "select something"),
        (lambda s: properties.renamed(s, "corner", " "), "a start needs a name"),
        (lambda s: properties.renamed(s, "corner", "two"), "a start “two” already"),
        (lambda s: properties.renamed(s, 0, "x" * 101), "at most 100 characters"),
        (lambda s: properties.renamed(s, 0, "a\x00b"), "text on one line"),
        (lambda s: properties.renamed(s, BOUNDARY, "b"), "boundary has no name"),
        (lambda s: properties.noted(s, Selection.of("corner"), "x"), "select obstacles"),
        (lambda s: properties.titled(s, ""), "a map needs a name"),
        (lambda s: properties.titled(s, None, "x" * 10001), "at most 10000"),
        (lambda s: properties.widened(s, Selection.of(0), 0.2), "select walls"),
        (lambda s: properties.widened(s, ALL, -0.2), "at least 1 mm"),
        (lambda s: properties.sized(s, Selection.of(0), 0.2), "select circles"),
        (lambda s: properties.raised(s, ALL, "left"), "top or bottom"),
        (lambda s: properties.start_first(s, "none"), "no start “none”"),
        (lambda s: properties.made_polygons(s, Selection.of(0)), "select circles or walls"),
        (lambda s: properties.made_boundary(s, Selection.of(1)), "select one polygon"),
    ],
)
def test_what_cannot_be_done_is_said_in_a_sentence(sketch, deed, words):
    with pytest.raises(MapError, match=words) as caught:
        deed(sketch)
    assert "\n" not in str(caught.value)


# placing


def everything(sketch: Sketch) -> shapely.Geometry:
    shapes = [item.shape.polygon for item in sketch.obstacles]
    return shapely.GeometryCollection([*shapes, shapely.Polygon(sketch.boundary)])


def distance(a: shapely.Geometry, b: shapely.Geometry) -> float:
    """The largest distance between corresponding vertices."""
    first, second = shapely.get_coordinates(a), shapely.get_coordinates(b)
    assert len(first) == len(second)
    return float(np.abs(first - second).max())


@given(sound_sketches(least=1), st.sampled_from([0.0, 1.0, -2.7, 0.1234]), places)
def test_moving_is_what_shapely_says(sketch, dx, about):
    change = transform.moved(sketch, Selection.all(sketch), dx, 0.5)
    expected = affinity.translate(everything(sketch), dx, 0.5)
    assert distance(everything(change.sketch), expected) <= 1e-4
    back = transform.moved(change.sketch, change.selection, -dx, -0.5).sketch
    assert back == sketch


@given(sound_sketches(least=1), st.sampled_from([90.0, 180.0, -90.0, 30.0, 45.0, 1.0]), places)
def test_turning_is_what_shapely_says(sketch, degrees, about):
    polygons = [item.key for item in sketch.obstacles if isinstance(item.shape, PolygonObstacle)]
    change = transform.rotated(sketch, Selection(frozenset(polygons), boundary=True), degrees, about)
    for key in polygons:
        expected = affinity.rotate(sketch.item(key).shape.polygon, degrees, origin=about)
        assert distance(change.sketch.item(key).shape.polygon, expected) <= 1e-4
    whole = Selection(frozenset(item.key for item in sketch.obstacles))
    quarter = sketch
    for _ in range(4):
        quarter = transform.rotated(quarter, whole, 90.0, about).sketch
    assert quarter == sketch, "a whole turn in quarters is exact"


def test_circles_walls_and_starts_turn_too(sketch):
    change = transform.rotated(sketch, ALL, 90.0, (0.0, 0.0))
    assert change.sketch.item(1).shape == replace(PILLAR, center=(-4.0, 6.0))
    assert change.sketch.item(2).shape.points == ((0.0, 5.0), (-2.4, 5.0), (-2.4, 7.0))
    assert change.sketch.start("corner") == DiscStart((-5.0, 1.0), 0.8)
    assert change.sketch.start("two") == PointsStart(((-1.0, 9.0), (-1.0, 10.0)))
    assert change.sketch.start("all") == UniformStart()
    assert change.sketch.boundary == ((0.0, 0.0), (0.0, 12.0), (-8.0, 12.0), (-8.0, 0.0))
    # about its middle by default
    assert transform.rotated(sketch, Selection.of(0), 90.0).sketch.item(0).shape.vertices == (
        (2.5, 0.5),
        (2.5, 2.5),
        (1.5, 2.5),
        (1.5, 0.5),
    )


def test_scaling_both_ways_grows_radii_and_widths(sketch):
    change = transform.scaled(sketch, ALL, 2.0, 2.0, (0.0, 0.0))
    assert change.sketch.item(1).shape == CircleObstacle((12.0, 8.0), 1.0, "pillar")
    assert change.sketch.item(2).shape == WallObstacle(((10.0, 0.0), (10.0, 4.8), (14.0, 4.8)), 0.2)
    assert change.sketch.start("corner") == DiscStart((2.0, 10.0), 1.6)
    assert everything(change.sketch).area == pytest.approx(4.0 * everything(sketch).area, rel=1e-3)


def test_stretching_makes_polygons_of_circles_and_keeps_the_width_of_walls(sketch):
    change = transform.scaled(sketch, Selection.of(0, 1, 2), 2.0, 1.0, (0.0, 0.0))
    ellipse = change.sketch.item(1).shape
    assert isinstance(ellipse, PolygonObstacle)
    assert ellipse.name == "pillar"
    assert ellipse.polygon.area == pytest.approx(2.0 * PILLAR.polygon.area, rel=1e-3)
    assert change.sketch.item(2).shape.width == 0.1
    mirrored = transform.scaled(sketch, Selection.of(1), -1.0, 1.0, (0.0, 0.0))
    assert mirrored.sketch.item(1).shape == replace(PILLAR, center=(-6.0, 4.0))


@given(sound_shapes(), st.sampled_from([0.2, 1.0, 3.7]), st.sampled_from([0.5, 2.0]))
def test_a_typed_size_is_the_size(shape, width, height):
    sketch, (key,) = Sketch().added([shape])
    before = transform.bounds_of(sketch, Selection.of(key))
    for wanted in ((width, height), (width, None), (None, height)):
        try:
            change = transform.resized(sketch, Selection.of(key), *wanted)
        except MapError as error:
            # a level wall is as high as it is wide
            assert isinstance(shape, WallObstacle)
            assert "walls keep their width" in str(error)
            continue
        low_x, low_y, high_x, high_y = transform.bounds_of(change.sketch, change.selection)
        if wanted[0] is not None:
            assert high_x - low_x == pytest.approx(wanted[0], abs=3e-4)
        if wanted[1] is not None:
            assert high_y - low_y == pytest.approx(wanted[1], abs=3e-4)
        if None not in wanted:
            assert (low_x, low_y) == pytest.approx(before[:2], abs=3e-4)


def test_a_typed_place_is_the_place(sketch):
    change = transform.placed(sketch, Selection.of(0), 4.0, None)
    assert transform.bounds_of(change.sketch, change.selection) == (4.0, 1.0, 6.0, 2.0)
    change = transform.placed(sketch, Selection.of(1, "corner"), 0.0, 0.0)
    assert transform.bounds_of(change.sketch, change.selection)[:2] == pytest.approx((0.0, 0.0), abs=1e-4)


@given(sound_sketches(least=1), st.sampled_from(["x", "y"]))
def test_mirroring_twice_is_nothing(sketch, axis):
    whole = Selection.all(sketch)
    once = transform.mirrored(sketch, whole, axis).sketch
    assert distance(everything(transform.mirrored(once, whole, axis).sketch), everything(sketch)) <= 3e-4


def test_single_vertices_go_along_unless_their_owner_does(sketch):
    corner = Vertex(0, 0, 2)
    change = transform.moved(sketch, Selection(frozenset({1}), frozenset({corner})), 1.0, 0.0)
    assert change.sketch.item(0).shape.vertices == ((1.0, 1.0), (3.0, 1.0), (4.0, 2.0), (1.0, 2.0))
    assert change.sketch.item(1).shape.center == (7.0, 4.0)
    once = transform.moved(sketch, Selection(frozenset({0}), frozenset({corner})), 1.0, 0.0)
    assert once.sketch.item(0).shape == Affine(x0=1.0).thing(BOX)
    turned = transform.rotated(sketch, Selection(vertices=frozenset({corner, Vertex(0, 0, 3)})), 180.0)
    assert turned.sketch.item(0).shape.vertices == ((1.0, 1.0), (3.0, 1.0), (1.0, 2.0), (3.0, 2.0))


def test_copies(sketch):
    noted = properties.noted(sketch, Selection.of(0), "oak").sketch
    change = transform.duplicated(noted, Selection.of(0, "corner", "all"), 1.0, 0.5)
    copy = change.sketch.obstacles[-1]
    assert copy.shape == Affine(x0=1.0, y0=0.5).thing(BOX)
    assert copy.note == "oak"
    assert change.sketch.start("corner 2") == DiscStart((2.0, 5.5), 0.8)
    assert change.selection == Selection.of(copy.key, "corner 2", "all 2")
    again = transform.duplicated(change.sketch, change.selection)
    assert "corner 3" in dict(again.sketch.starts)
    grid = transform.arrayed(sketch, Selection.of(1), 3, 2, 1.5, 2.0)
    centers = [item.shape.center for item in grid.sketch.obstacles if isinstance(item.shape, CircleObstacle)]
    assert centers == [(6.0, 4.0), (7.5, 4.0), (9.0, 4.0), (6.0, 6.0), (7.5, 6.0), (9.0, 6.0)]
    assert len(grid.selection.items) == 6
    assert grid.words == "circle “pillar” copied into 3 × 2"


# the rest


def test_deleting(sketch):
    change = properties.deleted(
        sketch, Selection(frozenset({0}), frozenset({Vertex(2, 0, 1)}), frozenset({"two"}))
    )
    assert [item.key for item in change.sketch.obstacles] == [1, 2]
    assert change.sketch.item(2).shape.points == ((5.0, 0.0), (7.0, 2.4))
    assert [name for name, _ in change.sketch.starts] == ["corner", "all"]
    assert change.selection == Selection()
    assert change.words == "3 things deleted"
    assert properties.deleted(sketch, Selection(boundary=True)).sketch.boundary is None


def test_names_and_notes(sketch):
    assert properties.renamed(sketch, 2, " west\twall ").sketch.item(2).shape.name == "west wall"
    change = properties.renamed(sketch, 0, "")
    assert change.sketch.item(0).shape.name is None
    assert change.words == "polygon “desk”: name taken away"
    change = properties.renamed(sketch, "two", "pair")
    assert [name for name, _ in change.sketch.starts] == ["corner", "pair", "all"]
    assert change.selection == Selection.of("pair")
    change = properties.noted(sketch, Selection.of(0, 2), " ask Ada ")
    assert [item.note for item in change.sketch.obstacles] == ["ask Ada", "", "ask Ada"]
    assert properties.noted(change.sketch, Selection.of(0), "").sketch.item(0).note == ""
    change = properties.titled(sketch, "Office", "One floor.")
    assert (change.sketch.name, change.sketch.description) == ("Office", "One floor.")
    # halves of characters, which no file could hold, do not come in
    assert properties.renamed(sketch, 0, "a\ud800b").sketch.item(0).shape.name == "ab"


def test_widths_and_radii(sketch):
    change = properties.widened(sketch, ALL, 0.25)
    assert change.sketch.item(2).shape == replace(WALL, width=0.25)
    assert change.words == "wall made 0.25 m wide"
    change = properties.sized(sketch, ALL, 1.25)
    assert change.sketch.item(1).shape.radius == 1.25
    assert change.sketch.start("corner") == DiscStart((1.0, 5.0), 1.25)


@pytest.mark.parametrize(
    ("where", "order"),
    [("top", [1, 2, 3, 0]), ("bottom", [0, 1, 2, 3])],
)
def test_order(where, order):
    sketch, _ = Sketch().added([BOX, PILLAR, WALL, PILLAR])
    assert [item.key for item in properties.raised(sketch, Selection.of(0), where).sketch.obstacles] == order


def test_several_things_keep_their_order_among_each_other():
    sketch, _ = Sketch().added([BOX, PILLAR, WALL, PILLAR])
    for where, order in [("bottom", [1, 2, 0, 3]), ("top", [0, 3, 1, 2])]:
        change = properties.raised(sketch, Selection.of(1, 2), where)
        assert [item.key for item in change.sketch.obstacles] == order
    there = properties.raised(sketch, Selection.of(2, 3), "top")
    assert there.sketch == sketch


def test_groups_locks_and_what_is_hidden_are_kept_in_the_map(sketch):
    change = properties.grouped(sketch, Selection.of(0, 1))
    assert change.words == "2 obstacles grouped as “group 1”"
    assert properties.grouped(change.sketch, Selection.of(1, 2)).sketch.item(2).group == "group 2"
    assert Selection.of(0).with_groups(change.sketch) == Selection.of(0, 1)
    assert Selection.of(2).with_groups(change.sketch) == Selection.of(2)
    held = properties.locked(change.sketch, Selection.of(0))
    assert held.words.endswith("locked") and held.selection == Selection()
    unseen = properties.hidden(held.sketch, Selection.of(1, 2)).sketch
    assert owners_at(unseen, (2.0, 1.5), 0.1) == owners_at(unseen, (6.0, 4.0), 0.1) == ()
    assert not in_box(unseen, (-50.0, -50.0), (50.0, 50.0)).items and not Selection.all(unseen).items
    assert parse_sketch(sketch_text(unseen), "again") == unseen
    assert Sketch.from_environment(unseen.environment()) == unseen
    shown = properties.released(unseen)
    assert shown.sketch == change.sketch and shown.words == "3 obstacles unlocked and shown"
    apart = properties.ungrouped(held.sketch, Selection.of(0, 1, 2))
    assert not any(item.group for item in apart.sketch.obstacles)
    for deed, words in [
        (lambda: properties.grouped(sketch, Selection.of(0)), "two or more"),
        (lambda: properties.ungrouped(sketch, Selection.of(0)), "in a group"),
        (lambda: properties.locked(sketch, Selection()), "select obstacles"),
    ]:
        with pytest.raises(MapError, match=words):
            deed()


def test_starts_have_an_order_and_kinds(sketch):
    assert properties.start_first(sketch, "all").sketch.starts[0][0] == "all"


def test_a_polygon_becomes_the_boundary(sketch):
    change = properties.made_boundary(sketch, Selection.of(0))
    assert change.sketch.boundary == BOX.vertices
    assert [item.key for item in change.sketch.obstacles] == [1, 2]
    assert properties.underlaid(sketch, Background("p.png", (3, 4))).words == "picture laid under"


def test_bounds(sketch):
    assert transform.bounds_of(sketch, Selection.of(0)) == (1.0, 1.0, 3.0, 2.0)
    assert transform.bounds_of(sketch, Selection.of(2)) == pytest.approx((4.95, 0.0, 7.0, 2.45))
    assert transform.bounds_of(sketch, Selection.of("corner")) == pytest.approx((0.2, 4.2, 1.8, 5.8))
    assert transform.bounds_of(sketch, Selection(vertices=frozenset({Vertex(0, 0, 0)}))) == (
        1.0,
        1.0,
        1.0,
        1.0,
    )
    assert transform.bounds_of(sketch, Selection.of("all")) is None
    assert transform.bounds_of(sketch, Selection.of(BOUNDARY)) == (0.0, 0.0, 12.0, 8.0)


def test_what_is_gone_is_not_moved_and_the_rest_is(sketch):
    change = transform.moved(sketch, Selection(frozenset({0, 99}), starts=frozenset({"none"})), 1.0, 0.0)
    assert change.selection == Selection.of(0) and change.sketch.item(0).shape.vertices[0] == (2.0, 1.0)
    with pytest.raises(MapError, match="select something"):
        transform.rotated(sketch, Selection.of(99), 90.0, (0.0, 0.0))


def test_the_bounds_of_many_things_are_those_of_each():
    shapes = [
        CircleObstacle((k, 1.0), 0.3) if k % 3 else WallObstacle(((k, 2.0), (k, 3.0)), 0.2)
        for k in range(150)
    ]
    sketch, keys = Sketch().added([*shapes, PolygonObstacle(())])
    boxes = np.array([box for key in keys if (box := transform.box_of(sketch, key)) is not None])
    expected = (*boxes[:, :2].min(axis=0), *boxes[:, 2:].max(axis=0))
    assert transform.bounds_of(sketch, Selection.of(*keys)) == expected


# the plane


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_rounding_is_stable_and_the_same_everywhere(x, y):
    point = rounded((x, y))
    assert rounded(point) == point
    (near,) = ring_near(np.array([[x, y]]))
    assert ring_near(np.array([near])) == (near,)
    assert near == pytest.approx(point, abs=1.001e-4)
    assert tenths(x) == point[0]
    assert math.copysign(1.0, ring_near(np.array([[-1e-9, 0.0]]))[0][0]) == 1.0


@given(st.floats(-1e4, 1e4))
def test_cosine_and_sine(degrees):
    cos, sin = cos_sin(degrees)
    assert (cos, sin) == pytest.approx(
        (math.cos(math.radians(degrees)), math.sin(math.radians(degrees))), abs=1e-9
    )
    assert cos_sin(450.0) == (0.0, 1.0)


def test_factors_of_maps():
    assert Affine.turn(33.0, (1.0, 2.0)).factor == 1.0
    assert Affine.stretch(2.0, 2.0, (0.0, 0.0)).factor == pytest.approx(2.0)
    assert Affine.stretch(-2.0, 2.0, (0.0, 0.0)).factor == pytest.approx(2.0)
    assert Affine.stretch(2.0, 1.0, (0.0, 0.0)).factor is None
    assert Affine(1.0, 0.5, 0.0, 1.0).factor is None


def test_a_tilted_scan_is_made_level_by_two_points_on_a_wall():
    path = ObstaclePath(((6.0, 4.0), (8.0, 4.0)), 0.5)
    level, keys = Sketch(boundary=HALL, starts=(("a", DiscStart((1.0, 1.0), 0.5)),)).added(
        [WallObstacle(((2.0, 3.0), (5.0, 3.0)), 0.1), CircleObstacle((6.0, 4.0), 0.5, None, path)]
    )
    peaks = (Gaussian((2.0, 2.0), 3.0, covariance=((4.0, 1.0), (1.0, 1.0))), Gaussian((3.0, 1.0), 1.0, 0.5))
    picture = Background("scan.png", (100, 80), 0.1)
    level = replace(level, density=Gaussians(peaks), background=picture)
    everything = replace(Selection.of(*keys, "a"), boundary=True)
    tilted = transform.rotated(level, everything, 7.0, (0.0, 0.0)).sketch
    assert transform.levelled(level, (2.0, 3.0), (5.0, 3.0)).sketch == level
    change = transform.levelled(tilted, *tilted.item(keys[0]).shape.points)
    after = change.sketch
    assert change.words == "map turned by -7.00°"
    (ax, ay), (bx, by) = after.item(keys[0]).shape.points
    assert (bx - ax, by - ay) == pytest.approx((3.0, 0.0), abs=3e-4)
    for was, now in zip(level.boundary, after.boundary, strict=True):
        assert (now[0] - ax + 2.0, now[1] - ay + 3.0) == pytest.approx(was, abs=1e-3)
    assert after.item(keys[1]).shape.path.points[1][1] == pytest.approx(ay + 1.0, abs=1e-3)
    assert after.background.turn == pytest.approx(-7.0, abs=0.01)
    turned, round_one = after.density.peaks
    assert np.linalg.eigvalsh(turned.covariance) == pytest.approx(np.linalg.eigvalsh(peaks[0].covariance))
    assert turned.covariance != peaks[0].covariance and round_one.sigma == 0.5
    apart = np.subtract(turned.center, round_one.center)
    assert np.hypot(*apart) == pytest.approx(np.hypot(1.0, 1.0), abs=1e-3)
    areas = WeightedPolygons((WeightedArea(((1.0, 1.0), (2.0, 1.0), (2.0, 2.0)), 2.0),), 1.0)
    upright = transform.levelled(replace(level, density=areas), (0.0, 0.0), (-0.1, 1.0)).sketch
    assert upright.density.areas[0].vertices[0] == pytest.approx((1.0945, 0.8955), abs=2e-4)
    with pytest.raises(MapError, match="cannot be turned"):
        transform.levelled(replace(level, density=Raster(np.eye(3), (0, 0, 9, 9))), (0.0, 0.0), (3.0, 1.0))
    with pytest.raises(MapError, match="apart"):
        transform.levelled(level, (1.0, 1.0), (1.0, 1.0))
