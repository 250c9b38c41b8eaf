"""Copying and pasting objects in the editor, and pasting other texts."""

import json

import pytest
from drawn_sketches import HALL, drafts, valid_sketches
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle, UniformStart, WallObstacle
from robocov.errors import MapError
from robocov.mapfile import dump_map, load_map
from robocov_app.editor.edits import transform
from robocov_app.editor.edits.clipboard import copy_selection, paste
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch, dump_sketch

BOX = PolygonObstacle(((1.0, 1.0), (3.0, 1.0), (3.0, 2.0), (1.0, 2.0)), (), "desk")
PILLAR = CircleObstacle((6.0, 4.0), 0.5)


@settings(max_examples=count_examples(80))
@given(st.one_of(drafts(), valid_sketches(min_size=1)))
def test_copied_objects_can_be_pasted(sketch):
    everything = Selection.select_all(sketch)
    assume(everything)
    text = copy_selection(sketch, everything)
    json.loads(text)
    change = paste(Sketch(), text)
    after = change.sketch
    assert [item.shape for item in after.obstacles] == [item.shape for item in sketch.obstacles]
    assert [item.note for item in after.obstacles] == [item.note for item in sketch.obstacles]
    assert after.starts == sketch.starts
    assert after.boundary == sketch.boundary
    assert change.selection == Selection.select_all(after)
    # A copy of the pasted obstacles has the same content as the original text.
    assert json.loads(copy_selection(after, change.selection))["obstacles"] == json.loads(text)["obstacles"]


@given(valid_sketches(min_size=1), st.sampled_from([(0.0, 0.0), (3.25, -1.5)]))
def test_objects_are_pasted_at_the_cursor(sketch, at):
    whole = Selection(frozenset(item.key for item in sketch.obstacles))
    change = paste(sketch, copy_selection(sketch, whole), at)
    low_x, low_y, high_x, high_y = transform.compute_bounds(change.sketch, change.selection)
    assert ((low_x + high_x) / 2, (low_y + high_y) / 2) == pytest.approx(at, abs=2e-4)
    assert len(change.sketch.obstacles) == 2 * len(sketch.obstacles)
    assert change.sketch.obstacles[: len(sketch.obstacles)] == sketch.obstacles
    assert not change.selection.items & whole.items


def test_names_of_starts_stay_apart_and_a_second_boundary_is_left_out_unless_it_is_alone():
    sketch, _ = Sketch(boundary=HALL, starts=(("corner", DiscStart((1.0, 1.0), 0.8)),)).with_obstacles([BOX])
    change = paste(sketch, copy_selection(sketch, Selection.select_all(sketch)))
    assert [name for name, _ in change.sketch.starts] == ["corner", "corner 2"]
    assert change.sketch.boundary == HALL
    assert [item.shape for item in change.sketch.obstacles] == [BOX, BOX]
    assert change.description == "2 objects pasted"
    alone = paste(sketch, copy_selection(sketch, Selection(boundary=True)))
    assert alone.sketch.obstacles[-1].shape == PolygonObstacle(HALL)


def test_pasted_objects_stay_on_the_grid():
    wall = WallObstacle(((1.0, 1.5), (2.0, 1.5)), 0.1)
    sketch, keys = Sketch(boundary=HALL).with_obstacles([wall])
    change = paste(sketch, copy_selection(sketch, Selection.of(*keys)), (5.13, 3.38), grid=0.5)
    assert change.sketch.obstacles[-1].shape.points == ((4.5, 3.5), (5.5, 3.5))


def test_copying_nothing_raises_a_map_error():
    with pytest.raises(MapError, match="to copy"):
        copy_selection(Sketch(), Selection())
    with pytest.raises(MapError, match="to copy"):
        copy_selection(Sketch(), Selection.of(99))


def test_other_texts_can_be_pasted_too():
    circle = paste(Sketch(), '{"kind": "circle", "center": [1, 2], "radius": 0.5}')
    assert circle.sketch.obstacles[0].shape == CircleObstacle((1.0, 2.0), 0.5)
    two = paste(
        Sketch(),
        '[{"kind": "wall", "points": [[0, 0], [1, 0]], "width": 0.1},'
        ' {"kind": "circle", "center": [1, 2], "radius": 1}]',
    )
    assert two.description == "2 obstacles pasted"
    assert isinstance(two.sketch.obstacles[0].shape, WallObstacle)
    ring = paste(Sketch(), " [[0, 0], [1, 0], [0.333333, 1]]")
    assert ring.sketch.obstacles[0].shape == PolygonObstacle(((0.0, 0.0), (1.0, 0.0), (0.3333, 1.0)))
    rooms = paste(Sketch(), dump_map(load_map("rooms")))
    assert len(rooms.sketch.obstacles) == len(load_map("rooms").obstacles)
    assert rooms.sketch.boundary == load_map("rooms").boundary
    draft = paste(Sketch(), dump_sketch(Sketch(starts=(("a", UniformStart()),))))
    assert draft.sketch.starts == (("a", UniformStart()),)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "  \n",
        "hello",
        "https://example.org/[1]",
        "{",
        "[]",
        "{}",
        "[1, 2]",
        "[[1, 2], 3]",
        "[" * 5000,
        '{"format": "robocov-clipboard"}',
        '{"format": "robocov-clipboard", "version": 9}',
        '{"format": "robocov-clipboard", "version": 1}',
        '{"format": "other"}',
        '{"kind": "circle"}',
        '{"kind": "circle", "center": [1e300, 2], "radius": 0.5}',
        '{"kind": "circle", "center": [NaN, 2], "radius": 0.5}',
        '{"kind": "circle", "kind": "wall"}',
    ],
)
def test_unusable_text_raises_a_map_error(text):
    with pytest.raises(MapError) as caught:
        paste(Sketch(boundary=HALL), text)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


@given(st.text(max_size=30))
def test_any_text_is_pasted_or_rejected(text):
    try:
        paste(Sketch(), text)
    except MapError as error:
        assert "\n" not in str(error)
