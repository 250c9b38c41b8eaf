"""Documents of sketches: reading and writing them, and errors with paths."""

import difflib
import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, any_positions, drafts, floats, json_values, renumber, shapes, valid_sketches
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

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
from robocov.mapfile import dump_map, list_bundled_maps, load_map, parse_map, to_json
from robocov_app.editor.edits import vertices
from robocov_app.editor.model.background import Background, read_marks, write_marks
from robocov_app.editor.model.parser import build_sketch, parse_sketch
from robocov_app.editor.model.selection import list_vertices
from robocov_app.editor.model.sketch import BOUNDARY, Item, Sketch, build_geometry, dump_sketch, to_document

EMPTY = {"format": "robocov-map", "version": 1, "name": "n"}


# writing and reading


@settings(max_examples=count_examples(150))
@given(st.one_of(drafts(), drafts(shapes(any_positions, floats)), valid_sketches()))
def test_a_sketch_survives_its_document(sketch):
    document = to_document(sketch)
    again = build_sketch(json.loads(json.dumps(document)), "again")
    assert again == sketch
    assert to_document(again) == document
    assert list(to_document(again)) == list(document)
    assert hash(again) == hash(sketch)


@settings(max_examples=count_examples(60))
@given(st.one_of(drafts(), valid_sketches()))
def test_a_sketch_survives_its_text(sketch):
    text = dump_sketch(sketch)
    assert parse_sketch(text.encode(), "again") == sketch
    assert dump_sketch(parse_sketch(text, "again")) == text


@pytest.mark.parametrize("name", list_bundled_maps())
def test_bundled_maps_are_unchanged(name):
    environment = load_map(name)
    sketch = Sketch.from_environment(environment)
    assert sketch.build_environment() == environment
    assert list(sketch.build_environment().starts) == list(environment.starts)
    assert to_document(sketch) == to_json(environment)
    assert dump_sketch(sketch) == dump_map(environment)


@given(valid_sketches())
def test_a_sketch_runs_like_its_saved_map(sketch):
    try:
        environment = sketch.build_environment("here")
    except MapError as error:
        with pytest.raises(MapError, match="here") as caught:
            parse_map(dump_sketch(sketch), "here")
        assert str(caught.value).split(": ", 1)[1] == str(error).split(": ", 1)[1]
    else:
        assert parse_map(dump_sketch(sketch), "here") == environment


def test_keys_are_not_in_the_file():
    sketch = Sketch(
        obstacles=(Item(7, CircleObstacle((1.0, 1.0), 0.5), "old"), Item(3, WallObstacle((), 0.1)))
    )
    again = build_sketch(to_document(sketch))
    assert [item.key for item in again.obstacles] == [0, 1]
    assert again == renumber(sketch)


def test_a_draft_may_contain_numbers_that_no_map_can_have():
    sketch = Sketch(boundary=((0.0, 0.0), (1e300, 0.0), (0.0, 1e-300)))
    assert build_sketch(json.loads(json.dumps(to_document(sketch)))) == sketch
    with pytest.raises(MapError, match="boundary"):
        sketch.build_environment()


# invalid documents


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ([], "expected a JSON object with a map"),
        ({"format": "geojson"}, 'format: expected "robocov-map", got "geojson"'),
        ({**EMPTY, "version": 2}, "newer robocov"),
        ({**EMPTY, "name": 3}, "name: expected a string, got 3"),
        ({**EMPTY, "nmae": "x"}, "unknown key 'nmae': did you mean 'name'"),
        ({**EMPTY, "boundary": "x"}, "boundary: expected a list of points"),
        ({**EMPTY, "boundary": [[0, 0], [1, "2"]]}, r"boundary\[1\]\[1\]: expected a number"),
        ({**EMPTY, "boundary": [[0, 0, 0]]}, r"boundary\[0\]: expected a point"),
        ({**EMPTY, "boundary": [[0, True]]}, r"boundary\[0\]\[1\]: expected a number"),
        ({**EMPTY, "obstacles": {}}, "obstacles: expected a list of obstacles"),
        ({**EMPTY, "obstacles": [3]}, r"obstacles\[0\]: expected an object whose kind"),
        (
            {**EMPTY, "obstacles": [{"kind": "box"}]},
            r"obstacles\[0\]\.kind: expected one of polygon, circle, wall, got \"box\"",
        ),
        (
            {**EMPTY, "obstacles": [{"center": [0, 0]}]},
            r"obstacles\[0\]\.kind: missing, expected one of polygon, circle, wall",
        ),
        (
            {**EMPTY, "obstacles": [{"kind": ["circle"]}]},
            r"obstacles\[0\]\.kind: expected one of polygon, circle, wall",
        ),
        (
            {**EMPTY, "obstacles": [{"kind": "circle", "center": [0, 0]}]},
            r"obstacles\[0\]\.radius: missing, expected a number",
        ),
        ({**EMPTY, "obstacles": [{"kind": "wall", "points": [], "width": 1, "x": 1}]}, "unknown key 'x'"),
        ({**EMPTY, "starts": {"a": {"kind": "disc"}}}, r"starts\.a\.center: missing, expected a point"),
        ({**EMPTY, "starts": []}, "starts: expected an object"),
        ({**EMPTY, "extra": 1}, "extra: expected an object"),
        ({**EMPTY, "boundary": [[0, float("nan")]]}, "finite"),
    ],
)
def test_invalid_documents_are_reported_with_the_path(document, message):
    with pytest.raises(MapError, match=message) as caught:
        build_sketch(document, "mine.json")
    assert str(caught.value).startswith("mine.json: ")
    assert "\n" not in str(caught.value)


def test_errors_in_text_have_lines():
    text = '{\n "format": "robocov-map",\n "version": 1,\n "boundary": [[0, "x"]]\n}'
    with pytest.raises(MapError, match=r"mine.json:4:19: boundary\[0\]\[1\]"):
        parse_sketch(text, "mine.json")
    with pytest.raises(MapError, match=r"mine\.json:1:1: .*not JSON"):
        parse_sketch("# a map", "mine.json")


def test_a_header_is_a_draft():
    sketch = build_sketch({"format": "robocov-map", "version": 1})
    assert sketch == Sketch(name="")
    assert sketch.bounds is None


# small differences between files


@settings(max_examples=count_examples(60))
@given(st.data())
def test_moving_a_vertex_changes_one_line(data):
    sketch = data.draw(valid_sketches(min_size=1))
    owner = data.draw(st.sampled_from([BOUNDARY, *(item.key for item in sketch.obstacles)]))
    vertex, _ = data.draw(st.sampled_from(list_vertices(sketch, owner)))
    to = data.draw(st.tuples(st.integers(-99999, 99999), st.integers(-99999, 99999)))
    moved = (to[0] / 10000, to[1] / 10000)
    before = dump_sketch(sketch).splitlines()
    after = dump_sketch(vertices.place_vertices(sketch, {vertex: moved})).splitlines()
    changed = [line for line in difflib.ndiff(before, after) if line[:2] in ("- ", "+ ")]
    assert len(changed) <= 2
    assert len(before) == len(after)


def test_numbers_are_written_without_rounding_errors():
    sketch = Sketch(boundary=((0.1 + 0.2, -0.0), (3.0, 1e-17), (0.5, 2.0)))
    (line,) = [line for line in dump_sketch(sketch).splitlines() if "boundary" in line]
    assert line == '  "boundary": [[0.3, 0], [3, 0], [0.5, 2]],'


# notes and other free keys


def build_annotated_sketch() -> Sketch:
    items = (
        Item(0, CircleObstacle((1.0, 1.0), 0.5, "pillar"), "ask Ada"),
        Item(1, CircleObstacle((3.0, 1.0), 0.5)),
        Item(2, CircleObstacle((5.0, 1.0), 0.5), "no name"),
    )
    return Sketch("n", boundary=HALL, obstacles=items, background=Background("plan.png", (40, 30)))


def test_notes_are_in_the_free_keys_of_a_valid_map():
    environment = build_annotated_sketch().build_environment()
    assert environment.extra["editor"]["notes"] == [
        {"obstacle": 0, "name": "pillar", "note": "ask Ada"},
        {"obstacle": 2, "note": "no name"},
    ]
    assert environment.extra["editor"]["background"]["path"] == "plan.png"
    assert Sketch.from_environment(environment) == build_annotated_sketch()


def test_a_note_finds_its_obstacle_after_the_file_was_edited_by_hand():
    document = to_document(build_annotated_sketch())
    first, second, third = document["obstacles"]
    document["obstacles"] = [second, third, first]
    notes = [item.note for item in build_sketch(document).obstacles]
    assert notes[2] == "ask Ada"
    # A note of an obstacle without a name stays at its index.
    document["obstacles"] = [first]
    again = build_sketch(document)
    assert [item.note for item in again.obstacles] == ["ask Ada"]
    # The other note is not lost.
    assert "no name" in json.dumps(again.extra)
    assert build_sketch(to_document(again)) == again


@pytest.mark.parametrize(
    "foreign",
    [
        "vim",
        {"tab": 4},
        {"notes": "mine"},
        {"notes": [1]},
        {"background": {"path": "x"}},
        {"notes": [], "background": {"path": "plan.png"}},
        {"notes": [{"obstacle": 0, "note": "x", "by": "somebody"}]},
        {"notes": [{"obstacle": 99, "note": "x"}], "notes of obstacles that are gone": None},
        {"notes": [{"obstacle": 99, "note": "x"}], "notes of obstacles that are gone": "all"},
    ],
)
def test_free_keys_of_other_programs_are_unchanged(foreign):
    document = {**EMPTY, "boundary": [[0, 0], [1, 0], [0, 1]], "extra": {"editor": foreign, "mine": 1}}
    sketch = build_sketch(document)
    assert sketch.extra == {"editor": foreign, "mine": 1}
    assert to_document(sketch)["extra"] == document["extra"]
    ours = replace(
        sketch, obstacles=build_annotated_sketch().obstacles, background=build_annotated_sketch().background
    )
    again = build_sketch(json.loads(json.dumps(to_document(ours))))
    assert again == ours
    assert again.extra == sketch.extra


MARKS = {"note": "x", "group": "desks", "locked": True}


@given(st.dictionaries(st.sampled_from(["editor", "editor 2", "mine"]), json_values))
def test_notes_are_separated_from_other_free_keys(extra):
    notes, background, others = read_marks(write_marks(extra, {1: MARKS}, ["a", "b"], None), ["a", "b"])
    assert (notes, background) == ({1: MARKS}, None)
    # An empty object of the editor is dropped.
    assert {**others, **{key: {} for key in extra if key not in others}} == extra


# shapes and parts


@given(shapes())
def test_every_shape_has_a_valid_geometry(shape):
    geometry = build_geometry(shape)
    assert geometry.is_valid
    points = shapely.get_coordinates(geometry)
    assert np.isfinite(points).all()


def test_valid_shapes_keep_their_geometry():
    for shape in (
        CircleObstacle((1.0, 2.0), 0.5),
        WallObstacle(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)), 0.1),
        PolygonObstacle(HALL, (((1.0, 1.0), (2.0, 1.0), (2.0, 2.0)),)),
    ):
        assert build_geometry(shape).equals(shape.polygon)
    bow_tie = PolygonObstacle(((0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)))
    assert build_geometry(bow_tie).area == pytest.approx(2.0)
    assert build_geometry(PolygonObstacle(())).is_empty


def test_shapes_beyond_the_limits_of_maps_cover_nothing():
    # A circle with a radius of 1e12 m would be a polygon with millions of sides.
    for shape in (
        CircleObstacle((1.0, 1.0), 1e12),
        CircleObstacle((1e9, 1.0), 1.0),
        PolygonObstacle(((0.0, 0.0), (1e200, 0.0), (0.0, 1e200))),
        WallObstacle(((0.0, 0.0), (1.0, 0.0)), 1e100),
        WallObstacle(((0.0, 0.0), (1e100, 0.0)), 1.0),
    ):
        assert build_geometry(shape).area == 0.0
    holed = PolygonObstacle(HALL, (((1.0, 1.0), (1e200, 0.0), (1.0, 2.0)),))
    assert build_geometry(holed).area == pytest.approx(96.0)


def test_obstacles_and_starts_are_found_by_key():
    sketch, (a, b) = Sketch().with_annotated_obstacles(
        [(CircleObstacle((0.0, 0.0), 1.0), ""), (WallObstacle(HALL, 0.1), "note")]
    )
    assert sketch.get_item(b).note == "note"
    assert sketch.next_key > max(a, b)
    wider = sketch.with_objects({b: WallObstacle(HALL, 0.2)})
    assert wider.get_item(a) is sketch.get_item(a)
    assert wider.get_item(b).shape == WallObstacle(HALL, 0.2)
    assert wider.get_item(b).note == "note"
    assert sketch.without([a]).obstacles == (sketch.get_item(b),)
    with pytest.raises(KeyError):
        sketch.get_item(99)
    sketch = sketch.with_objects({"s": UniformStart(), "t": UniformStart()})
    sketch = sketch.with_objects({"s": DiscStart((0.0, 0.0), 1.0)})
    assert sketch.starts == (("s", DiscStart((0.0, 0.0), 1.0)), ("t", UniformStart()))
    assert sketch.get_start("t") == UniformStart()


def test_bounds_contain_everything():
    sketch = Sketch(
        boundary=HALL,
        obstacles=(Item(0, CircleObstacle((-1.0, 3.0), 2.0)),),
        starts=(("a", DiscStart((12.0, 8.0), 1.0)), ("b", PointsStart(((3.0, -4.0),)))),
        background=Background("p.png", (100, 100), 0.2, (0.0, 0.0)),
    )
    assert sketch.bounds == pytest.approx((-3.0, -4.0, 20.0, 20.0))
    hidden = replace(sketch, background=replace(sketch.background, shown=False))
    assert hidden.bounds == pytest.approx((-3.0, -4.0, 13.0, 9.0))


def test_a_pickled_item_omits_derived_values():
    item = Item(0, CircleObstacle((1.0, 1.0), 0.5), "x")
    bare = pickle.dumps(item)
    assert item.geometry.area > 0.0
    assert pickle.dumps(item) == bare
    assert pickle.loads(bare) == item


def test_an_environment_becomes_the_sketch_of_the_same_map():
    environment = Environment(
        "e", HALL, (CircleObstacle((1.0, 1.0), 0.5),), {"a": UniformStart()}, "d", {"k": 1}
    )
    sketch = Sketch.from_environment(environment)
    assert (sketch.name, sketch.description, sketch.boundary) == ("e", "d", HALL)
    assert sketch.extra == {"k": 1}
    assert sketch.build_unchecked_environment() == environment
