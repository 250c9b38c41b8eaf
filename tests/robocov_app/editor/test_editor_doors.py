"""Doors: openings in walls, which stay walls."""

import pytest

from robocov.environment import CircleObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits import create
from robocov_app.editor.model.sketch import Item, Sketch

CORNER = WallObstacle(((0.0, 0.0), (4.0, 0.0), (4.0, 3.0)), 0.2, "west")


@pytest.fixture
def sketch() -> Sketch:
    return Sketch(obstacles=(Item(3, CORNER, "oak", "outer"), Item(5, CircleObstacle((8.0, 8.0), 1.0))))


def test_the_pieces_keep_name_note_and_group(sketch):
    change = create.open_door(sketch, 3, (1.0, 0.3), 0.8)
    first, second, _ = change.sketch.obstacles
    assert first.shape.points == ((0.0, 0.0), (0.6, 0.0))
    assert second.shape.points == ((1.4, 0.0), (4.0, 0.0), (4.0, 3.0))
    for item in (first, second):
        assert (item.shape.name, item.shape.width, item.note, item.group) == ("west", 0.2, "oak", "outer")
    assert change.description == "0.8 m door added to the wall “west”"
    assert change.selection.items == {3, second.key}


def test_a_door_may_include_a_corner_or_an_end(sketch):
    round_it = create.open_wall(sketch, 3, (3.5, 0.1), (4.0, 0.5)).sketch
    assert [i.shape.points for i in round_it.obstacles[:2]] == [
        ((0.0, 0.0), (3.5, 0.0)),
        ((4.0, 0.5), (4.0, 3.0)),
    ]
    at_end = create.open_door(sketch, 3, (-1.0, 0.0), 1.0).sketch
    assert [i.shape.points for i in at_end.obstacles[:-1]] == [((1.0, 0.0), (4.0, 0.0), (4.0, 3.0))]


def test_the_nearest_wall_is_found(sketch):
    assert create.find_wall(sketch, (2.0, 0.05), 0.1) == 3
    assert create.find_wall(sketch, (8.0, 8.0), 0.1) is None
    a, b = create.compute_door_ends(sketch, 3, (0.1, 0.0), 1.0)
    assert (a, b) == ((0.0, 0.0), (1.0, 0.0))


@pytest.mark.parametrize(
    ("deed", "words"),
    [
        (lambda s: create.open_door(s, 3, (1.0, 0.0), 0.001), "a door width from 20 mm to 10 km"),
        (lambda s: create.open_door(s, 3, (1.0, 0.0), 1e5), "a door width from 20 mm to 10 km"),
        (lambda s: create.open_door(s, 3, (1.0, 0.0), 7.0), "not longer than a door"),
        (lambda s: create.open_wall(s, 3, (0.0, 0.0), (4.0, 3.0)), "nothing would be left"),
        (lambda s: create.open_wall(s, 5, (0.0, 0.0), (4.0, 3.0)), "opened in walls"),
    ],
)
def test_impossible_doors_raise_a_map_error(sketch, deed, words):
    with pytest.raises(MapError, match=words):
        deed(sketch)
