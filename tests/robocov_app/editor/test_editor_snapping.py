"""Snapping to vertices, edges, crossings, angles and the grid."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from drawn_sketches import HALL, valid_sketches
from hypothesis import example, given, settings
from hypothesis import strategies as st
from property_examples import count_examples

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov_app.editor.model.selection import Vertex, list_vertices
from robocov_app.editor.model.sketch import BOUNDARY, Sketch
from robocov_app.editor.tools.snap_targets import collect_snap_targets
from robocov_app.toolkit.tools.snap_targets import SnapTargets
from robocov_app.toolkit.tools.snapping import KINDS, SnapSettings, snap_angle, snap_move, snap_point

BOX = PolygonObstacle(((1.0, 1.0), (4.0, 1.0), (4.0, 3.0), (1.0, 3.0)))
PILLAR = CircleObstacle((7.03, 5.04), 0.51)
EVERYTHING = SnapSettings(0.15)

cursor = st.tuples(st.floats(-1.0, 13.0), st.floats(-1.0, 9.0))
some_kinds = st.sets(st.sampled_from(sorted(KINDS))).map(frozenset)


def build_settings(*kinds: str, reach: float = 0.15) -> SnapSettings:
    return SnapSettings(reach, kinds=frozenset(kinds))


@pytest.fixture
def targets() -> SnapTargets:
    return collect_snap_targets(Sketch(boundary=HALL).with_obstacles([BOX, PILLAR])[0])


@settings(max_examples=count_examples(200))
@given(
    valid_sketches(),
    cursor,
    st.sampled_from([0.0, 1e-6, 0.02, 0.3, 5.0]),
    st.sampled_from([0.0, 0.1, 0.25, 3.0]),
    some_kinds,
    st.one_of(st.none(), cursor),
)
@example(Sketch(boundary=HALL), (-0.25, 0.25), 0.3, 0.1, frozenset({"vertex"}), None)
def test_a_snap_stays_within_reach_and_has_a_guide(sketch, point, reach, grid, kinds, origin):
    targets = collect_snap_targets(sketch)
    snapping = SnapSettings(reach, grid, kinds=kinds)
    snap = snap_point(point, targets, snapping, origin)
    assert math.dist(snap.point, point) <= reach
    assert {guide.kind for guide in snap.guides} <= kinds
    assert bool(snap.guides) or snap.point == point
    for guide in snap.guides:
        if guide.kind == "edge":
            assert shapely.LineString(guide.line).distance(shapely.Point(snap.point)) < 1e-8
        else:
            assert guide.line[-1] == snap.point
        assert guide.label
    moved = snap_move([point, (point[0] + 1.0, point[1])], 0.3, -0.2, targets, snapping)
    if "grid" in kinds:
        # Along each axis, a move may snap to the grid beyond the reach.
        max_shift = max(reach, grid / 2) + 1e-7
        assert abs(moved.point[0] - 0.3) <= max_shift
        assert abs(moved.point[1] + 0.2) <= max_shift
    else:
        assert math.dist(moved.point, (0.3, -0.2)) <= reach
        assert moved.guides or moved.point == (0.3, -0.2)
    assert {guide.kind for guide in moved.guides} <= kinds
    if len(kinds) == 1 and snap.guides:
        # A point that has snapped snaps to itself.
        assert math.dist(snap_point(snap.point, targets, snapping, origin).point, snap.point) <= 1e-7


@given(valid_sketches(min_size=1), cursor, st.sampled_from([0.05, 0.4, 2.0]))
def test_the_nearest_vertex_wins(sketch, point, reach):
    marks = [at for owner in (BOUNDARY, *sketch.index_by_key) for vertex, at in list_vertices(sketch, owner)]
    centers = [item.shape.center for item in sketch.obstacles if isinstance(item.shape, CircleObstacle)]
    centers += [spec.center for _, spec in sketch.starts if isinstance(spec, DiscStart)]
    for _, spec in sketch.starts:
        if isinstance(spec, DiscStart):
            x, y = spec.center
            r = spec.radius
            marks += [(x + r, y), (x - r, y), (x, y + r), (x, y - r)]
    for item in sketch.obstacles:
        if isinstance(item.shape, WallObstacle):
            marks += [tuple(at) for at in shapely.get_coordinates(item.shape.polygon).tolist()]
    places = [at for at in marks if at not in centers]
    nearest = min(math.dist(point, at) for at in places)
    snap = snap_point(point, collect_snap_targets(sketch), build_settings("vertex", reach=reach))
    if nearest > reach:
        assert snap.guides == ()
    else:
        assert snap.guides[0].kind == "vertex"
        assert math.dist(point, snap.point) == pytest.approx(nearest, abs=1e-12)
        assert min(math.dist(snap.point, at) for at in places) == 0.0


@pytest.mark.parametrize(
    ("point", "kinds", "snapped_point", "words"),
    [
        ((1.05, 0.96), ("vertex", "edge", "grid"), (1.0, 1.0), "vertex"),
        ((2.51, 1.03), ("midpoint", "edge", "grid"), (2.5, 1.0), "midpoint of an edge"),
        ((7.0, 5.0), ("center", "grid"), (7.03, 5.04), "center"),
        ((2.2, 1.07), ("edge",), (2.2, 1.0), "edge"),
        ((2.21, 1.07), ("edge", "grid"), (2.2, 1.0), "edge"),
        ((9.23, 6.58), ("grid",), (9.2, 6.6), "grid"),
        ((7.54, 5.04), ("vertex",), (7.54, 5.04), "vertex"),
        # Alignment with corners of the box.
        ((4.06, 6.5), ("aligned",), (4.0, 6.5), "aligned"),
        ((4.06, 6.5), ("aligned", "grid"), (4.0, 6.5), "aligned"),
        ((11.0, 3.04), ("aligned",), (11.0, 3.0), "aligned"),
    ],
)
def test_nearby_targets_are_snapped_to(targets, point, kinds, snapped_point, words):
    snap = snap_point(point, targets, build_settings(*kinds))
    assert snap.point == pytest.approx(snapped_point, abs=1e-9)
    assert snap.guides[0].label == words


def test_crossings_of_lines_win_over_single_lines(targets):
    # The point is aligned with the right end of the pillar and with the top of the box.
    snap = snap_point((7.5, 3.05), targets, build_settings("aligned", "grid"))
    assert snap.point == pytest.approx((7.54, 3.0))
    assert [guide.kind for guide in snap.guides] == ["aligned", "aligned"]
    assert {guide.line[0] for guide in snap.guides} == {(4.0, 3.0), (7.54, 5.04)}
    # A ray from the previous point ends at an edge.
    snap = snap_point((2.02, 1.04), targets, build_settings("angle", "edge"), origin=(1.0, 0.0))
    assert snap.point == pytest.approx((2.0, 1.0))
    assert {guide.label for guide in snap.guides} == {"45°", "edge"}


def test_crossings_of_edges_are_targets():
    plank = PolygonObstacle(((0.0, 1.9), (8.0, 1.9), (8.0, 2.1), (0.0, 2.1)))
    targets = collect_snap_targets(Sketch().with_obstacles([BOX, plank])[0])
    snap = snap_point((4.05, 2.06), targets, build_settings("intersection", "edge"))
    assert snap.point == pytest.approx((4.0, 2.1))
    assert snap.guides[0].kind == "intersection"


def test_angles_and_grid_are_combined(targets):
    origin = (8.0, 1.0)
    snap = snap_point((9.02, 1.05), targets, build_settings("angle"), origin)
    assert snap.point == pytest.approx((9.02, 1.0))
    assert snap.guides[0].line == (origin, snap.point)
    assert snap.guides[0].label == "0°"
    snap = snap_point((9.02, 1.05), targets, replace(build_settings("angle", "grid"), grid=0.25), origin)
    assert snap.point == pytest.approx((9.0, 1.0))
    # Along a slanted ray, the length is a multiple of the grid.
    snap = snap_point((8.72, 1.71), targets, replace(build_settings("angle", "grid"), grid=0.5), origin)
    assert math.dist(snap.point, origin) == pytest.approx(1.0)
    assert snap.guides[0].label == "45°"
    # To the left, and downward.
    assert snap_point((7.0, 1.02), targets, build_settings("angle"), origin).guides[0].label == "180°"
    assert snap_point((8.02, 0.0), targets, build_settings("angle"), origin).guides[0].label == "270°"
    # At points near the origin, the angle is undefined.
    assert snap_point((8.05, 1.05), targets, build_settings("angle"), origin).guides == ()


def test_a_coarse_grid_snaps_along_one_axis_only(targets):
    snapping = replace(build_settings("grid"), grid=1.0)
    assert snap_point((9.1, 6.5), targets, snapping).point == (9.0, 6.5)
    assert snap_point((9.1, 6.05), targets, snapping).point == (9.0, 6.0)
    assert snap_point((9.5, 6.5), targets, snapping).guides == ()
    assert snap_point((0.30000001, 0.1), targets, replace(build_settings("grid"), grid=0.1)).point == (
        0.3,
        0.1,
    )


def test_dragged_objects_are_not_targets():
    sketch, (key,) = Sketch(starts=(("two", PointsStart(((6.0, 1.0), (8.0, 1.0)))),)).with_obstacles([BOX])
    near = (1.02, 1.02)
    assert (
        snap_point(
            near, collect_snap_targets(sketch, ignored=[key]), build_settings("vertex", "edge", "grid")
        )
        .guides[0]
        .kind
        == "grid"
    )
    one = collect_snap_targets(sketch, ignored=[Vertex(key, 0, 0)])
    assert snap_point(near, one, build_settings("vertex", "edge", "midpoint")).guides == ()
    assert snap_point((4.02, 2.97), one, build_settings("vertex")).point == (4.0, 3.0)
    # The edges of the ignored vertex are ignored too, but not the other edges.
    assert snap_point((2.2, 1.02), one, build_settings("edge", "midpoint")).guides == ()
    assert snap_point((2.2, 2.98), one, build_settings("edge")).point == pytest.approx((2.2, 3.0))
    # The same holds for the positions of a start.
    without_first = collect_snap_targets(sketch, ignored=[Vertex("two", 0, 0)])
    assert snap_point((6.02, 1.0), without_first, build_settings("center")).guides == ()
    assert snap_point((8.02, 1.0), without_first, build_settings("center")).point == (8.0, 1.0)
    without_start = collect_snap_targets(sketch, ignored=["two"])
    assert snap_point((6.02, 1.0), without_start, build_settings("center")).guides == ()
    # Points that were drawn so far are targets, too.
    with_drawn_point = collect_snap_targets(sketch, extra_points=[(9.0, 5.0)])
    assert snap_point((9.02, 5.0), with_drawn_point, build_settings("vertex")).point == (9.0, 5.0)


def test_a_circle_or_wall_is_no_target_of_its_own_vertices():
    wall = WallObstacle(((1.0, 1.0), (3.0, 1.0), (5.0, 1.0)), 0.2)
    disc = DiscStart((3.0, 6.0), 1.0)
    sketch, (circle_key, wall_key) = Sketch(starts=(("disc", disc),)).with_obstacles([PILLAR, wall])
    kinds = build_settings("vertex", "center", "edge")

    def snap(point: tuple[float, float], dragged: Vertex) -> tuple[float, float]:
        return snap_point(point, collect_snap_targets(sketch, ignored=[dragged]), kinds).point

    for near_center in ((7.06, 5.06), (7.56, 5.06)):
        for index in (0, 1):
            assert snap(near_center, Vertex(circle_key, 0, index)) == near_center
    for near_start in ((3.03, 6.03), (4.03, 6.03)):
        assert snap(near_start, Vertex("disc", 0, 1)) == near_start
    near_end = (5.03, 1.08)
    assert snap(near_end, Vertex(wall_key, 0, 2)) == near_end
    # Sections of the wall that stay where they are remain targets.
    assert snap((2.0, 1.03), Vertex(wall_key, 0, 2)) == pytest.approx((2.0, 1.0))


def test_faces_of_walls_and_rims_of_circles_are_targets():
    wall = WallObstacle(((1.0, 1.0), (5.0, 1.0)), 0.2)
    targets = collect_snap_targets(Sketch().with_obstacles([wall, PILLAR])[0])
    assert snap_point((5.03, 1.12), targets, build_settings("vertex", reach=0.05)).point == pytest.approx(
        (5.0, 1.1)
    )
    assert snap_point((3.3, 1.12), targets, build_settings("edge", reach=0.05)).point == pytest.approx(
        (3.3, 1.1)
    )
    assert snap_point((3.3, 1.02), targets, build_settings("edge", reach=0.05)).point == pytest.approx(
        (3.3, 1.0)
    )
    at = (7.03 + 0.52 * math.cos(1.0), 5.04 + 0.52 * math.sin(1.0))
    on_rim = snap_point(at, targets, build_settings("edge", reach=0.05)).point
    assert math.dist(on_rim, PILLAR.center) == pytest.approx(0.51, abs=2e-3)


def test_a_move_snaps_by_its_nearest_point(targets):
    corners = [(10.0, 6.0), (11.0, 6.0), (11.0, 7.0), (10.0, 7.0)]
    # The lower left corner comes near the upper right corner of the box.
    snap = snap_move(corners, -5.96, -2.95, targets, build_settings("vertex"))
    assert snap.point == pytest.approx((-6.0, -3.0))
    assert snap.guides[0].line == ((4.0, 3.0),)
    # Only the first point snaps to the grid.
    snap = snap_move(corners, -0.52, 0.03, targets, build_settings("grid"))
    assert snap.point == pytest.approx((-0.5, 0.0))
    assert snap_move(corners, 0.3, 0.2, targets, build_settings()).point == (0.3, 0.2)
    assert snap_move([], 0.3, 0.2, targets, EVERYTHING).point == (0.3, 0.2)
    # Beyond the reach, the grid still counts along each axis without another snap.
    snap = snap_move(corners, 0.33, 0.24, targets, build_settings("grid", reach=0.01))
    assert snap.point == pytest.approx((0.3, 0.2))
    assert not snap.guides
    many = [(10.0 + math.cos(k), 6.0 + math.sin(k)) for k in range(500)]
    snap = snap_move(many, -4.95, -3.0, targets, build_settings("vertex"))
    assert math.dist(snap.point, (-4.95, -3.0)) <= 0.15


def test_rotations_snap_to_round_angles():
    assert snap_angle(44.0) == 45.0
    assert snap_angle(-1.0) == 0.0
    assert math.copysign(1.0, snap_angle(-1.0)) == 1.0
    assert snap_angle(40.0) == 40.0
    assert snap_angle(182.0, 90.0) == 180.0


def test_an_empty_map_has_no_targets():
    targets = collect_snap_targets(Sketch())
    assert snap_point((1.04, 2.03), targets, EVERYTHING).point == (1.0, 2.0)
    assert snap_point((1.04, 2.03), targets, build_settings("vertex", "edge", "aligned")).guides == ()
    assert np.isfinite(snap_point((0.0, 0.0), targets, SnapSettings(1.0, grid=0.0)).point).all()
