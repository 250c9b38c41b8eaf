"""Edits that combine obstacles: areas, holes, offsets and repairs."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, list_problems, valid_shapes, valid_sketches
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import CircleObstacle, ObstaclePath, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import boolean, properties
from robocov_app.editor.model.geometry import extract_polygons
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Item, Sketch

BOW_TIE = ((1.0, 1.0), (3.0, 3.0), (3.0, 1.0), (1.0, 3.0))
PATH = ObstaclePath(((2.0, 2.0), (8.0, 2.0)), 0.5, "back-and-forth")


def unite_shapes(sketch: Sketch) -> shapely.Geometry:
    return shapely.union_all([item.shape.polygon for item in sketch.obstacles])


def build_box(x, y, width, height):
    return PolygonObstacle(((x, y), (x + width, y), (x + width, y + height), (x, y + height)))


@settings(max_examples=count_examples(150))
@given(
    st.lists(valid_shapes(), min_size=2, max_size=4),
    st.sampled_from(["unite", "subtract", "intersect", "divide"]),
)
def test_results_have_the_areas_of_shapely_and_cover_the_same_points(shapes, name):
    sketch, keys = Sketch("n", boundary=HALL).with_obstacles(shapes)
    raw = [shape.polygon for shape in shapes]
    first = raw[0]
    others = shapely.union_all(raw[1:])
    wanted = {
        "unite": shapely.union_all(raw),
        "subtract": first - others,
        "intersect": shapely.intersection_all(raw),
        "divide": first,
    }
    perimeter = sum(shape.length for shape in raw)
    try:
        change = getattr(boolean, name)(sketch, Selection.of(*keys))
    except MapError:
        assert wanted[name].area < 1e-3 * perimeter
        return
    results = [change.sketch.get_item(key).shape for key in change.selection.items]
    assert len(results) == len(change.sketch.obstacles)
    # Every vertex may move by 0.05 mm in x and in y, and tiny pieces are removed.
    assert sum(shape.polygon.area for shape in results) == pytest.approx(
        wanted[name].area, abs=2e-4 * perimeter
    )
    for shape in results:
        assert isinstance(shape, PolygonObstacle)
        assert shape.polygon.is_valid
        assert shape.name == shapes[0].name
        for ring in (shape.vertices, *shape.holes):
            assert ring[0] != ring[-1]
            assert all(value == round(value, 4) for point in ring for value in point)
    assert not [
        problem for problem in list_problems(change.sketch) if problem.is_error and problem.owner in keys
    ]
    # Random points agree, except for a hair's breadth at the edges.
    rng = np.random.default_rng(0)
    low_x, low_y, high_x, high_y = shapely.union_all(raw).bounds
    points = shapely.points(rng.uniform((low_x, low_y), (high_x, high_y), size=(200, 2)))
    edges = shapely.union_all([shape.boundary for shape in raw])
    points = points[shapely.distance(edges, points) > 1e-3]
    inside = np.array([shapely.contains(shape, points) for shape in raw])
    expected = {
        "unite": inside.any(axis=0),
        "subtract": inside[0] & ~inside[1:].any(axis=0),
        "intersect": inside.all(axis=0),
        "divide": inside[0],
    }[name]
    np.testing.assert_array_equal(shapely.contains(unite_shapes(change.sketch), points), expected)


def test_booleans_preserve_holes():
    frame = PolygonObstacle(
        ((1.0, 1.0), (5.0, 1.0), (5.0, 5.0), (1.0, 5.0)),
        (((2.0, 2.0), (4.0, 2.0), (4.0, 4.0), (2.0, 4.0)),),
        "f",
    )
    sketch, (a, b) = Sketch(boundary=HALL).with_obstacles([frame, build_box(4.5, 2.5, 2.0, 1.0)])
    change = boolean.unite(sketch, Selection.of(a, b))
    (item,) = change.sketch.obstacles
    assert len(item.shape.holes) == 1
    assert item.shape.polygon.area == pytest.approx(12.0 + 1.5)
    assert change.description == "2 obstacles united"
    cut = boolean.subtract(
        change.sketch.with_obstacles([build_box(2.5, 2.5, 10.0, 1.0)])[0], Selection.of(a, 1)
    )
    assert cut.selection
    # A smaller shape cuts a hole into a larger one.
    sketch, keys = Sketch().with_obstacles([build_box(0.0, 0.0, 4.0, 4.0), CircleObstacle((2.0, 2.0), 1.0)])
    (item,) = boolean.subtract(sketch, Selection.of(*keys)).sketch.obstacles
    assert len(item.shape.holes) == 1
    assert item.shape.polygon.area == pytest.approx(16.0 - np.pi, abs=5e-3)


def test_the_result_replaces_the_lowest_obstacle():
    sketch = Sketch(
        obstacles=(
            Item(5, CircleObstacle((9.0, 9.0), 0.5, "other")),
            Item(3, replace(build_box(0.0, 0.0, 3.0, 1.0), name="desk"), "oak"),
            Item(9, CircleObstacle((9.0, 1.0), 0.5, "another")),
            Item(4, replace(build_box(1.0, -1.0, 1.0, 3.0), name="knife")),
        )
    )
    change = boolean.subtract(sketch, Selection.of(4, 3))
    assert change.description == "1 obstacle cut out of polygon “desk”"
    keys = [item.key for item in change.sketch.obstacles]
    assert keys[:2] == [5, 3]
    assert keys[3] == 9
    left, right = change.sketch.obstacles[1:3]
    assert (left.shape.name, left.note, right.shape.name, right.note) == ("desk", "oak", "desk", "oak")
    assert change.selection == Selection.of(left.key, right.key)
    assert len({*keys}) == 4


@pytest.mark.parametrize(
    ("name", "shapes", "words"),
    [
        ("unite", [build_box(0.0, 0.0, 1.0, 1.0)], "select two or more obstacles to unite"),
        (
            "intersect",
            [build_box(0.0, 0.0, 1.0, 1.0), build_box(2.0, 0.0, 1.0, 1.0)],
            "they have nothing in common",
        ),
        (
            "intersect",
            [build_box(0.0, 0.0, 1.0, 1.0), build_box(1.0, 0.0, 1.0, 1.0)],
            "they have nothing in common",
        ),
        (
            "subtract",
            [build_box(0.2, 0.2, 0.5, 0.5), build_box(0.0, 0.0, 1.0, 1.0)],
            "nothing is left of polygon",
        ),
        (
            "unite",
            [build_box(0.0, 0.0, 1.0, 1.0), WallObstacle(((1.0, 1.0),), 0.1)],
            "wall 2 has no area",
        ),
    ],
)
def test_impossible_booleans_raise_a_map_error(name, shapes, words):
    sketch, keys = Sketch().with_obstacles(shapes)
    with pytest.raises(MapError, match=words):
        getattr(boolean, name)(sketch, Selection.of(*keys))


@given(valid_shapes(), st.sampled_from([0.05, 0.3, 1.0, -0.05, -0.2]))
def test_an_offset_has_the_given_distance(shape, by):
    sketch, (key,) = Sketch().with_obstacles([shape])
    before = shape.polygon
    try:
        change = boolean.offset(sketch, Selection.of(key), by)
    except MapError as error:
        assert "nothing would be left" in str(error)
        assert by < 0
        assert before.buffer(by).area < 0.01
        return
    after = unite_shapes(change.sketch)
    if by > 0:
        assert after.buffer(2e-3).covers(before.buffer(by * 0.99))
        # Sharp corners are beveled, which leaves vertices at up to twice the distance; holes may close.
        outline = shapely.Polygon(before.exterior)
        assert outline.buffer(2.0 * by + 2e-3).covers(after)
    else:
        assert before.buffer(by * 0.99 + 2e-3).covers(after.buffer(-1e-3))
    assert after.area > 0.0
    if isinstance(shape, CircleObstacle):
        assert change.sketch.get_item(key).shape.radius == pytest.approx(shape.radius + by, abs=1e-4)


def test_obstacles_are_clipped_to_the_boundary():
    shapes = [
        CircleObstacle((5.0, 4.0), 1.0, "inside"),
        CircleObstacle((12.0, 4.0), 1.0, "half"),
        CircleObstacle((30.0, 4.0), 1.0, "outside"),
    ]
    sketch, _ = Sketch(boundary=HALL).with_obstacles(shapes)
    change = boolean.clip_to_boundary(sketch, Selection())
    assert change.description == "1 obstacle clipped to the boundary, 1 obstacle outside the boundary removed"
    inside, half = change.sketch.obstacles
    assert inside is sketch.obstacles[0]
    assert half.shape.polygon.area == pytest.approx(np.pi / 2, abs=5e-3)
    assert shapely.Polygon(HALL).covers(half.geometry)
    with pytest.raises(MapError, match="no obstacle extends beyond the boundary"):
        boolean.clip_to_boundary(change.sketch, Selection())
    with pytest.raises(MapError, match="boundary must be valid"):
        boolean.clip_to_boundary(replace(sketch, boundary=None), Selection())


def test_crossing_outlines_are_repaired():
    sketch = Sketch("n", boundary=((0.0, 0.0), (8.0, 8.0), (8.0, 0.0), (0.0, 8.0), (0.0, 7.0)))
    sketch, keys = sketch.with_obstacles(
        [PolygonObstacle(BOW_TIE, (), "tie"), CircleObstacle((6.0, 4.0), 0.5)]
    )
    change = boolean.repair_outlines(sketch, Selection())
    assert change.description == "2 outlines repaired"
    assert not [problem for problem in list_problems(change.sketch) if problem.is_error]
    assert sum(item.geometry.area for item in change.sketch.obstacles[:2]) == pytest.approx(2.0)
    assert change.sketch.obstacles[-1] is sketch.obstacles[-1]
    assert change.selection.boundary
    with pytest.raises(MapError, match="nothing to repair"):
        boolean.repair_outlines(change.sketch, Selection())
    # Only selected obstacles are repaired.
    only = boolean.repair_outlines(sketch, Selection.of(keys[0]))
    assert only.sketch.boundary == sketch.boundary
    # The other outlines may still cross themselves.
    with pytest.raises(MapError, match="nothing to repair: no selected outline crosses itself"):
        boolean.repair_outlines(sketch, Selection.of(keys[1]))


@pytest.mark.parametrize(
    ("boundary", "outlines", "message"),
    [
        (HALL, [((7.0, 7.0), (8.0, 8.0))], "1 outline without an area removed"),
        (HALL, [BOW_TIE, ((7.0, 7.0), (8.0, 8.0))], "1 outline repaired, 1 without an area removed"),
        (((0.0, 0.0), (10.0, 0.0), (5.0, 0.0)), [], "1 outline without an area removed"),
    ],
)
def test_a_repair_reports_outlines_that_it_removes(boundary, outlines, message):
    shapes = [PolygonObstacle(outline) for outline in outlines]
    sketch, _ = Sketch("n", boundary=boundary).with_obstacles(shapes)
    assert boolean.repair_outlines(sketch, Selection()).description == message


@pytest.mark.parametrize(
    ("edit", "count"),
    [
        (boolean.repair_outlines, 2),
        (lambda sketch, selection: boolean.offset(sketch, selection, 0.1), 1),
        (boolean.clip_to_boundary, 2),
    ],
)
def test_moving_obstacles_keep_their_paths(edit, count):
    boundary = ((1.5, 0.0), (10.0, 0.0), (10.0, 10.0), (1.5, 10.0))
    cart = PolygonObstacle(BOW_TIE, (), "cart", PATH)
    sketch, (key,) = Sketch("n", boundary=boundary).with_obstacles([cart])
    change = edit(sketch, Selection.of(key))
    assert [item.shape.path for item in change.sketch.obstacles] == [PATH] * count


@pytest.mark.parametrize("name", ["unite", "subtract", "intersect", "divide"])
def test_the_result_keeps_the_path_of_the_lowest_obstacle(name):
    shapes = [replace(build_box(0.0, 0.0, 2.0, 2.0), path=PATH), build_box(1.0, 1.0, 2.0, 2.0)]
    sketch, keys = Sketch().with_obstacles(shapes)
    change = getattr(boolean, name)(sketch, Selection.of(*keys))
    assert {item.shape.path for item in change.sketch.obstacles} == {PATH}
    assert "path" not in change.description


@pytest.mark.parametrize(("name", "verb"), [("unite", "united"), ("intersect", "intersected")])
def test_lost_paths_are_reported(name, verb):
    shapes = [build_box(0.0, 0.0, 2.0, 2.0), replace(build_box(1.0, 1.0, 2.0, 2.0), path=PATH)]
    sketch, keys = Sketch().with_obstacles(shapes)
    change = getattr(boolean, name)(sketch, Selection.of(*keys))
    assert [item.shape.path for item in change.sketch.obstacles] == [None]
    assert change.description == f"2 obstacles {verb}, 1 path removed"


@given(valid_sketches(min_size=1))
def test_walls_and_circles_become_polygons_of_the_same_area(sketch):
    keys = [item.key for item in sketch.obstacles if not isinstance(item.shape, PolygonObstacle)]
    assume(keys)
    change = properties.convert_to_polygons(sketch, Selection.of(*keys))
    assert all(isinstance(item.shape, PolygonObstacle) for item in change.sketch.obstacles)
    difference = unite_shapes(change.sketch) ^ unite_shapes(sketch)
    assert difference.area <= 1e-4 * sum(item.geometry.length for item in sketch.obstacles)


def test_outlines_are_valid_on_their_grid():
    # Examples: a spike thinner than the grid, a tiny piece, and a hole of at most a millimeter.
    spike = shapely.Polygon([(0, 0), (1, 0), (1, 0.5), (1.3, 0.50001), (1, 0.50002), (1, 1), (0, 1)])
    (shape,) = extract_polygons(spike)
    assert shape.polygon.is_valid
    assert len(shape.vertices) == 4
    assert extract_polygons(shapely.box(0, 0, 0.0005, 5.0)) == ()
    slit = shapely.box(0, 0, 1, 1) - shapely.box(0.5, 0.2, 0.5004, 0.8)
    assert extract_polygons(slit)[0].holes == ()
    assert extract_polygons(shapely.LineString([(0, 0), (1, 1)])) == ()
    collinear = shapely.Polygon([(0, 0), (0.5, 0), (1, 0), (1, 1), (0, 1)])
    assert len(extract_polygons(collinear)[0].vertices) == 4
