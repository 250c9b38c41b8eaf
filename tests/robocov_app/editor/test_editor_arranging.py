"""Aligning and distributing objects in the editor."""

import numpy as np
import pytest
from drawn_sketches import HALL, valid_sketches
from hypothesis import given
from hypothesis import strategies as st

from robocov.environment import CircleObstacle, DiscStart, PolygonObstacle, UniformStart
from robocov.errors import MapError
from robocov_app.editor.edits.transform import SIDES, align, compute_bounds, distribute
from robocov_app.editor.model.selection import Selection, Vertex, find_position
from robocov_app.editor.model.sketch import BOUNDARY, Sketch


def build_box(x, y, width, height):
    return PolygonObstacle(((x, y), (x + width, y), (x + width, y + height), (x, y + height)))


@pytest.fixture
def sketch() -> Sketch:
    shapes = [build_box(1.0, 1.0, 2.0, 1.0), CircleObstacle((5.0, 4.0), 0.5), build_box(8.0, 2.0, 1.0, 4.0)]
    starts = (("disc", DiscStart((10.0, 7.0), 0.5)), ("all", UniformStart()))
    return Sketch("Hall", boundary=HALL, starts=starts).with_obstacles(shapes)[0]


def list_bounds(sketch, owners):
    return np.array([compute_bounds(sketch, Selection.of(owner)) for owner in owners])


LEVELS = {
    "left": lambda b: b[..., 0],
    "center": lambda b: (b[..., 0] + b[..., 2]) / 2,
    "right": lambda b: b[..., 2],
    "top": lambda b: b[..., 3],
    "middle": lambda b: (b[..., 1] + b[..., 3]) / 2,
    "bottom": lambda b: b[..., 1],
}


@given(valid_sketches(min_size=2), st.sampled_from(SIDES), st.booleans())
def test_aligned_objects_are_level_and_move_along_one_axis(sketch, side, to_boundary):
    keys = [item.key for item in sketch.obstacles]
    before = list_bounds(sketch, keys)
    selection = Selection.of(*keys, BOUNDARY) if to_boundary else Selection.of(*keys)
    change = align(sketch, selection, side)
    after = list_bounds(change.sketch, keys)
    levels = LEVELS[side](after)
    frame = np.array([*before[:, :2].min(axis=0), *before[:, 2:].max(axis=0)])
    if to_boundary:
        frame = np.array([0.0, 0.0, 12.0, 8.0])
    np.testing.assert_allclose(levels, LEVELS[side](frame), atol=1.5e-4)
    still = [1, 3] if side in SIDES[:3] else [0, 2]
    np.testing.assert_allclose(after[:, still], before[:, still], atol=1e-9)
    np.testing.assert_allclose(after[:, 2:] - after[:, :2], before[:, 2:] - before[:, :2], atol=2.1e-4)


@given(valid_sketches(min_size=3), st.sampled_from(["x", "y"]))
def test_gaps_become_equal(sketch, axis):
    keys = [item.key for item in sketch.obstacles]
    a = ("x", "y").index(axis)
    before = list_bounds(sketch, keys)
    order = sorted(range(len(keys)), key=lambda k: (before[k, a], before[k, a + 2]))
    after = list_bounds(distribute(sketch, Selection.of(*keys), axis).sketch, keys)[order]
    gaps = after[1:, a] - after[:-1, a + 2]
    np.testing.assert_allclose(gaps, gaps.mean(), atol=4e-4)
    np.testing.assert_allclose(after[0], before[order[0]])
    np.testing.assert_allclose(after[-1], before[order[-1]], atol=4e-4)
    np.testing.assert_allclose(after[:, 1 - a], before[order, 1 - a], atol=1e-9)


def test_starts_are_aligned_too_and_the_boundary_stays(sketch):
    change = align(sketch, Selection.of(0, "disc", "all"), "left")
    assert change.sketch.get_start("disc") == DiscStart((1.5, 7.0), 0.5)
    assert change.description == "2 objects aligned at the left"
    change = align(sketch, Selection.of(1, BOUNDARY), "middle")
    assert change.sketch.get_item(1).shape.center == (5.0, 4.0)
    change = align(sketch, Selection.of(1, BOUNDARY), "right")
    assert change.sketch.get_item(1).shape.center == (11.5, 4.0)
    assert change.sketch.boundary == HALL


def test_single_vertices_are_aligned(sketch):
    chosen = Selection(vertices=frozenset({Vertex(0, 0, 0), Vertex(2, 0, 1), Vertex(BOUNDARY, 0, 1)}))
    change = align(sketch, chosen, "bottom")
    assert [find_position(change.sketch, vertex)[1] for vertex in chosen.vertices] == [0.0] * 3
    assert find_position(change.sketch, Vertex(0, 0, 0)) == (1.0, 0.0)
    assert change.description == "3 vertices aligned at the bottom"
    middle = align(sketch, chosen, "center")
    assert {find_position(middle.sketch, vertex)[0] for vertex in chosen.vertices} == {6.5}


@pytest.mark.parametrize(
    ("deed", "words"),
    [
        (lambda s: align(s, Selection.of(0), "left"), "two or more"),
        (lambda s: align(s, Selection.of("all", BOUNDARY), "left"), "select obstacles or starts"),
        (lambda s: align(s, Selection.of(0, 1), "up"), "one of left"),
        (
            lambda s: align(s, Selection(vertices=frozenset({Vertex(0, 0, 0)})), "left"),
            "two or more vertices",
        ),
        (lambda s: distribute(s, Selection.of(0, 1), "x"), "three or more"),
        (lambda s: distribute(s, Selection.of(0, 1, 2), "z"), "an axis"),
    ],
)
def test_impossible_arrangements_raise_a_map_error(sketch, deed, words):
    with pytest.raises(MapError, match=words):
        deed(sketch)


def test_aligning_with_a_boundary_requires_one(sketch):
    without, keys = Sketch().with_obstacles([build_box(0.0, 0.0, 1.0, 1.0)])
    with pytest.raises(MapError, match="no boundary"):
        align(without, Selection.of(*keys, BOUNDARY), "left")
