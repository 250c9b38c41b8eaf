"""Simplifying and straightening outlines."""

import math

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, valid_sketches
from hypothesis import given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import CircleObstacle, PolygonObstacle, WallObstacle
from robocov.errors import MapError
from robocov_app.editor.edits.vertices import simplify, straighten
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch


def build_wobbly_ring(count: int, seed: int, radius: float = 3.0, noise: float = 0.05):
    """Build a ring around a center, so that it does not cross itself."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    distance = radius * (1.0 + 0.2 * np.sin(3 * angle)) + rng.uniform(-noise, noise, count)
    points = np.column_stack([np.cos(angle), np.sin(angle)]) * distance[:, None] + 5.0
    return tuple((round(x, 4), round(y, 4)) for x, y in points.tolist())


@settings(max_examples=count_examples(60))
@given(st.integers(0, 10**6), st.integers(8, 120), st.sampled_from([0.001, 0.02, 0.1, 0.5, 2.0]))
def test_removed_vertices_are_near_the_new_outline(seed, count, tolerance):
    ring = build_wobbly_ring(count, seed)
    sketch, (key,) = Sketch().with_obstacles([PolygonObstacle(ring)])
    try:
        change = simplify(sketch, Selection.of(key), tolerance)
    except MapError as error:
        assert "no vertex can be removed" in str(error)
        return
    after = change.sketch.get_item(key).shape
    assert len(after.vertices) < len(ring)
    assert after.polygon.is_valid
    outline = after.polygon.exterior
    assert max(outline.distance(shapely.Point(point)) for point in ring) <= tolerance + 1e-9
    # The remaining vertices have the same positions and the same order.
    places = [ring.index(point) for point in after.vertices]
    assert places == sorted(places)


@pytest.mark.parametrize("tolerance", [-0.1, 20_000.0, math.nan])
def test_impossible_tolerances_are_rejected(tolerance):
    with pytest.raises(MapError, match=f"expected a tolerance from 0 to .* m, got {tolerance:g} m"):
        simplify(Sketch(boundary=HALL), Selection(boundary=True), tolerance)


def test_holes_do_not_cross_their_outline():
    # In a thin frame, the hole would protrude with a coarse tolerance.
    outer = build_wobbly_ring(120, 0, 3.0, 0.0)
    inner = build_wobbly_ring(120, 1, 2.9, 0.0)
    sketch, (key,) = Sketch().with_obstacles([PolygonObstacle(outer, (inner,))])
    assert sketch.get_item(key).shape.polygon.is_valid
    change = simplify(sketch, Selection.of(key), 2.0)
    assert change.sketch.get_item(key).shape.polygon.is_valid
    assert len(change.sketch.list_vertex_rings(key)[1]) < 120


def test_walls_keep_their_ends_and_the_boundary_must_be_selected():
    line = tuple((k / 10, 0.001 * (k % 2)) for k in range(40))
    sketch, (key,) = Sketch(boundary=(*HALL[:2], (12.0, 4.0), *HALL[2:])).with_obstacles(
        [WallObstacle(line, 0.1)]
    )
    change = simplify(sketch, Selection(), 0.01)
    assert change.sketch.get_item(key).shape.points == (line[0], line[-1])
    assert change.description == "38 vertices removed"
    assert change.sketch.boundary == sketch.boundary
    change = simplify(sketch, Selection(boundary=True), 0.01)
    assert set(change.sketch.boundary) == set(HALL)
    assert change.description == "1 vertex removed"


def test_traced_plans_become_straight():
    traced = ((1.0, 1.02), (4.03, 0.98), (3.98, 3.0), (0.99, 3.04))
    sketch, (key,) = Sketch(boundary=HALL).with_obstacles([PolygonObstacle(traced)])
    change = straighten(sketch, Selection.of(key))
    assert change.sketch.get_item(key).shape.vertices == (
        (0.995, 1.0),
        (4.005, 1.0),
        (4.005, 3.02),
        (0.995, 3.02),
    )
    assert change.description == "1 outline straightened"
    with pytest.raises(MapError, match="no edge to straighten"):
        straighten(change.sketch, Selection.of(key))
    # Several edges in a row are moved onto one line; slanted ones stay.
    wall = WallObstacle(((0.0, 0.0), (2.0, 0.04), (4.0, 0.0), (6.0, 2.0), (6.02, 5.0)), 0.1)
    sketch, (key,) = Sketch().with_obstacles([wall])
    assert straighten(sketch, Selection.of(key)).sketch.get_item(key).shape.points == (
        (0.0, 0.02),
        (2.0, 0.02),
        (4.0, 0.02),
        (6.01, 2.0),
        (6.01, 5.0),
    )


@given(valid_sketches(min_size=1), st.sampled_from([1.0, 5.0, 20.0]))
def test_straightening_is_idempotent(sketch, degrees):
    try:
        change = straighten(sketch, Selection(), degrees)
    except MapError:
        return
    slope = math.tan(math.radians(degrees))
    for item in sketch.obstacles:
        if isinstance(item.shape, CircleObstacle):
            assert change.sketch.get_item(item.key) is item
            continue
        for before, after in zip(
            sketch.list_vertex_rings(item.key), change.sketch.list_vertex_rings(item.key), strict=True
        ):
            assert len(before) == len(after)
            if before == after:
                continue
            for k in range(len(before) - 1):
                dx, dy = np.abs(np.subtract(before[k + 1], before[k]))
                if 0.0 < dy <= slope * dx:
                    assert after[k][1] == after[k + 1][1]
                if 0.0 < dx <= slope * dy:
                    assert after[k][0] == after[k + 1][0]


@pytest.mark.parametrize(
    ("deed", "words"),
    [
        (lambda s: simplify(s, Selection.of(0), 0.1), "select polygons, walls or the boundary"),
        (lambda s: simplify(s, Selection(boundary=True), math.nan), "a tolerance"),
        (lambda s: simplify(s, Selection(boundary=True), 0.1), "no vertex can be removed"),
        (lambda s: straighten(s, Selection(boundary=True), 90.0), "up to 30 degrees"),
        (lambda s: straighten(s, Selection(boundary=True), 0.0), "above 0 and up to 30 degrees"),
    ],
)
def test_impossible_edits_raise_a_map_error(deed, words):
    sketch, _ = Sketch(boundary=HALL).with_obstacles([CircleObstacle((1.0, 1.0), 0.5)])
    with pytest.raises(MapError, match=words):
        deed(sketch)
